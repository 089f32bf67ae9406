"""Writes vertex animation textures of positions, laid out as OpenVAT has them: a folder with a 16-bit PNG (or float
EXR) of the offset of every vertex in every frame, remap_info.json and the rest pose as GLB.

The second set of texture coordinates says which texel is whose. OpenVAT's tools for Unity look for FBX: convert the GLB
there. The error is measured on what is written, rounding included, and stated in the JSON and by write_clip; see
vat.md. The texture is made in memory.
"""

from __future__ import annotations

import os
from os import fspath
from pathlib import Path

import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters.fitting import portions
from athcodec.exporters.gltf import write_rest
from athcodec.exporters.gltf_build import branch_extras
from athcodec.exporters.textures import WIDEST, facts_of, write_exr, write_json, write_png
from athcodec.files.atomic import new_folder
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.untyped import JsonObject

NARROWEST = 64
HIGHEST = 16384


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write a MotionClip or a ClipView to the new folder `path`, and return the contents of its JSON file.
    `options.half` selects 16-bit textures in place of float32.

    Raise ClipError if the texture would be larger than engines accept, FileExistsError if `path` exists.
    """
    size = _size(motion.vertex_count, motion.frame_count)
    name = Path(fspath(path)).stem or "clip"
    with new_folder(path) as folder:
        pixels, low, high, error = _texture(motion, size, options.half, report)
        if options.half:
            write_png(os.path.join(folder, f"{name}_vat.png"), pixels)
        else:
            write_exr(os.path.join(folder, f"{name}_vat.exr"), {"RGB": pixels})
        column, row = _texels(motion, size[0])
        places = np.stack([(column + 0.5) / size[0], (row + 0.5) / size[1]], axis=1).astype(np.float32)
        write_rest(motion, os.path.join(folder, f"{name}_vat.glb"), name, {"TEXCOORD_1": places}, branch_extras(motion))
        facts = {
            "os-remap": {"Min": low.tolist(), "Max": high.tolist(), "Frames": motion.frame_count},
            "athcodec": facts_of(motion) | {"max_error": error, "width": size[0], "height": size[1]},
        }
        write_json(os.path.join(folder, f"{name}-remap_info.json"), facts)
    report(1.0)
    return facts["athcodec"]


def _texels(motion: Motion, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return column, and row in the first frame, of each vertex."""
    vertices = np.arange(motion.vertex_count)
    return vertices % width, vertices // width * motion.frame_count


def _texture(
    motion: Motion, size: tuple[int, int], half: bool, report: Progress
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return four results: the pixels of the texture, the smallest and the largest offset on each axis, and the largest
    distance between the motion and what the pixels show. `size` is the texture's width and height.
    """
    rest = np.asarray(motion.rest).astype(np.float32).astype(np.float64)
    low, high = _offset_bounds(motion, rest, lambda done: report(0.4 * done))
    pixels = np.zeros((size[1], size[0], 3), np.uint16 if half else np.float32)
    column, row = _texels(motion, size[0])
    span, largest = np.where(high > low, high - low, 1.0), 0.0
    for start, portion in portions(motion, motion.vertex_count):
        for i, frame in enumerate(portion):
            share = (frame - rest - low) / span
            texels = np.round(share * 65535).astype(np.uint16) if half else share.astype(np.float32)
            pixels[row + start + i, column] = texels
            shown = rest + low + texels / (65535.0 if half else 1.0) * (high - low)
            largest = max(largest, float(((shown - frame) ** 2).sum(axis=1).max()))
        report(0.4 + 0.6 * (start + len(portion)) / motion.frame_count)
    return pixels, low, high, float(np.sqrt(largest))


def _size(vertices: int, frames: int) -> tuple[int, int]:
    """Return the width and height of a texture for all vertices and frames: powers of two of the smallest area, as
    square as possible. Raise ClipError if it would be too large.
    """
    sizes = []
    for width in (1 << i for i in range(NARROWEST.bit_length() - 1, WIDEST.bit_length())):
        rows = -(-vertices // width) * frames
        height = max(1 << (rows - 1).bit_length(), 1)
        if height <= HIGHEST:
            sizes.append((width * height, abs(np.log2(width / height)), width, height))
    if not sizes:
        raise ClipError(
            f"openvat: got {vertices} vertices in {frames} frames, expected what fits into {WIDEST} x "
            f"{HIGHEST} texels: choose fewer frames, or vat"
        )
    return min(sizes)[2:]


def _offset_bounds(motion: Motion, rest: np.ndarray, report: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the largest offset (3,) of any vertex in any frame from the rest pose (N, 3)."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for start, portion in portions(motion, motion.vertex_count):
        offsets = portion - rest
        low, high = np.minimum(low, offsets.min(axis=(0, 1))), np.maximum(high, offsets.max(axis=(0, 1)))
        report((start + len(portion)) / motion.frame_count)
    return low, high
