"""Image files of vertex animation textures: EXR by the package OpenEXR, 16-bit PNG written here; and what JSON files
beside them say of a motion."""

from __future__ import annotations

import json
import struct
import zlib

import numpy as np

from athcodec.decoding.clip_view import ClipView
from athcodec.exporters.gltf_build import clock
from athcodec.motion.protocol import Motion
from athcodec.untyped import JsonObject

WIDEST = 4096  # pixels of a side that all devices support
LAYOUT = "athcodec/exporters/vat.md"


def facts_of(motion: Motion) -> JsonObject:
    """Return rate, level and size of a MotionClip or ClipView."""
    level = {"level": motion.level, "level_max_error": float(motion.max_error)} if isinstance(motion, ClipView) else {}
    return {"layout": LAYOUT} | clock(motion) | level | {"frames": motion.frame_count, "vertices": motion.vertex_count}


def write_exr(path: str, channels: dict[str, np.ndarray]) -> None:
    """Write images (height, width, channels), float16 or float32, as one EXR file, compressed without loss. `channels`
    has each image by the names of its channels, "RGB" or "RGBA". Raise OSError.
    """
    import OpenEXR  # only where it is needed: PNG does without

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    try:
        with OpenEXR.File(header, {name: np.ascontiguousarray(values) for name, values in channels.items()}) as file:
            file.write(path)
    except RuntimeError as error:
        raise OSError(f"{path}: {error}") from None


def write_png(path: str, pixels: np.ndarray) -> None:
    """Write an image (height, width, 3) of uint16 as a PNG file, without loss."""
    height, width, _ = pixels.shape
    rows = np.ascontiguousarray(pixels.astype(">u2")).view(np.uint8).reshape(height, -1)
    lines = np.empty((height, rows.shape[1] + 1), np.uint8)
    lines[:, 0] = 2  # each row less the one above
    lines[0, 1:], lines[1:, 1:] = rows[0], rows[1:] - rows[:-1]
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in (
            (b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)),
            (b"IDAT", zlib.compress(lines.tobytes(), 6)),
            (b"IEND", b""),
        ):
            out.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))


def write_json(path: str, facts: JsonObject) -> None:
    """Write facts to a JSON file. Raises OSError."""
    with open(path, "w", encoding="utf-8") as out:
        json.dump(facts, out, indent=1, allow_nan=False)
        out.write("\n")
