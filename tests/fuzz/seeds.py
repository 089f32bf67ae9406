"""Inputs that fuzzing starts from: small valid files that together hold every chunk, stream and branch shape there is.

They are made anew for every run, so that they follow the format; only finds are kept as files (tests/corpus).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from files import Parts, basis_chunk, roots, still_file
from plants import awkward, bush, clip_of, plant, tube

import athcodec
from athcodec import MotionClip
from athcodec.decoding import container as ct
from athcodec.encoding.streams import streams
from athcodec.sources import read_hdf5, sample_path

CORPUS = Path(__file__).resolve().parent.parent / "corpus"
VECTORS = CORPUS.parent.parent / "spec" / "vectors" / "valid"
MANY_FEATURES = ("everything", "exact-empty", "shapes*", "clips-loops", "clips-steps", "clips-names", "encoded-*")
"""Of the vectors; the others try one rule each."""
LARGEST = 64 << 10
LAYERED: dict = {"rel_error": 1e-4, "ladder": (1e-2, 1e-3)}
"""Options that give a file three layers of precision."""
OPTIONS = 16
"""Bytes behind a file that tell a target how to use it (harness.h)."""


def full_clip() -> MotionClip:
    """Every kind of chunk: uneven times and all sorts of static data."""
    clip = plant(seed=11, branches=5, longest=4, frames=20, rough=0.02)
    clip.faces = np.array([[0, 1, 2], [2, 1, 3]], np.uint16)
    clip.edges = np.array([[0, 1], [clip.vertex_count - 1, 0]], np.int64)
    clip.attributes = {"radius": np.linspace(1, 2, clip.vertex_count, dtype=np.float32)}
    clip.metadata = {"unit": "m", "note": "wind from the west, wind from the west, wind from the west"}
    clip.time = clip.time + np.linspace(0, 1, 20) ** 3 * 0.01
    clip.check()
    return clip


def _point() -> MotionClip:
    return clip_of(np.zeros((1, 1, 3)), np.zeros((1, 3)), [0], [-1])


_ENCODED: dict[str, tuple[Callable[[], MotionClip], dict]] = {
    "full": (full_clip, {"rel_error": 1e-3, "segment_frames": 16, "tam": athcodec.Thresholds(0, 0, 0, 0)}),
    "exact_rest": (lambda: plant(seed=2, branches=4, frames=9), {"rel_error": 1e-2, "exact_rest": True}),
    "host_rest": (lambda: plant(seed=2, branches=4, frames=9), {"rel_error": 1e-2, "host_rest": True}),
    "wide": (lambda: plant(seed=3, branches=4, frames=17, dtype=np.float64), {"rel_error": 1e-6}),
    "wide_exact_rest": (
        lambda: plant(seed=4, branches=3, frames=5, dtype=np.float64),
        {"rel_error": 1e-2, "exact_rest": True},
    ),
    "loose": (lambda: awkward(2, branches=7, roots=3, motion="drift"), {"rel_error": 1e-1}),
    "noise": (lambda: awkward(4, branches=4, longest=5, frames=16, motion="noise"), {"rel_error": 1e-1}),
    "mirrored": (lambda: awkward(6, branches=6, motion="mirror", shuffled=True), {"rel_error": 1e-2}),
    "coincident": (lambda: awkward(7, branches=5, shape="coincident", motion="sway"), {"rel_error": 1e-2}),
    "sheets": (lambda: tube(10, 7, 9), {"rel_error": 1e-3}),
    "learned": (lambda: tube(10, 7, 9), {"rel_error": 1e-3, "effort": "best"}),
    "long_stem": (lambda: plant(seed=8, branches=2, longest=75, frames=6), {"rel_error": 1e-2}),
    "bush": (lambda: bush(25, frames=5), {"rel_error": 1e-2}),
    "still": (lambda: awkward(9, branches=4, motion="static"), {"rel_error": 1e-2}),
    "point": (_point, {"max_error": 0.01}),
    "shapes": (
        lambda: plant(seed=11, branches=5, longest=9, frames=32, rough=0.0),
        {"rel_error": 1e-5, "segment_frames": 16, "effort": "default"},
    ),
    "lossless": (lambda: plant(seed=12, branches=4, longest=4, frames=18), {"rel_error": 1e-2, "lossless": True}),
    "wide_lossless": (
        lambda: plant(seed=13, branches=3, longest=3, frames=5, dtype=np.float64),
        {"rel_error": 1e-2, "lossless": True},
    ),
    "layers": (lambda: plant(seed=11, branches=5, longest=9, frames=32, rough=0.0), LAYERED | {"segment_frames": 16}),
    "layers_loose": (lambda: awkward(2, branches=7, longest=5, roots=3, motion="drift"), LAYERED),
    "layers_learned": (lambda: tube(10, 7, 9), LAYERED | {"effort": "best"}),
    "layers_lossless": (lambda: plant(seed=12, branches=4, longest=4, frames=18), LAYERED | {"lossless": True}),
    "layers_exact_rest": (
        lambda: plant(seed=4, branches=3, frames=5, dtype=np.float64),
        LAYERED | {"exact_rest": True},
    ),
    "layers_host_rest": (lambda: plant(seed=4, branches=3, frames=5), LAYERED | {"host_rest": True}),
    "frames_256": (lambda: plant(seed=10, branches=2, longest=3, frames=257), {"rel_error": 1e-1}),
}


def _wave(frames: int) -> bytes:
    """A learned basis of one row."""
    row = np.rint(100 * np.sin(np.arange(frames)))
    return streams.encode_temporal(row.astype(np.int32)[None])


@cache
def valid_files() -> dict[str, bytes]:
    """Small valid files by name."""
    files = {
        "least": still_file(),
        "three_roots": still_file(frames=3, branches=roots(1, 70, 2)),
        "learned_basis": still_file(frames=9, stems=basis_chunk(_wave(9), 9)),
        "two_segments": still_file(frames=300),
    }
    with TemporaryDirectory() as name:
        folder = Path(name)
        for seed, (make, options) in _ENCODED.items():
            files[seed] = athcodec.encode(make(), **{"effort": "fast"} | options)
        with read_hdf5(sample_path()) as clip:
            files["sample"] = athcodec.encode(clip, effort="fast", rel_error=1e-2)
        files |= {path.stem: path.read_bytes() for name in MANY_FEATURES for path in VECTORS.glob(name + ".ath")}
        files["cut_to_a_level"] = _truncated(files["full"], folder, 1)
        files["cut_to_a_layer"] = _truncated(files["layers"], folder, 4)
    parts = Parts.of(files["full"])
    unknown = ct.Chunk(0x8009, ct.NO_LEVEL, 0, 0, 0), b"from the future"
    place = parts.index(ct.AFFINES)
    files["unknown_chunk"] = parts.with_chunks(parts.chunks[:place] + [unknown] + parts.chunks[place:])
    return {name: data for name, data in files.items() if len(data) <= LARGEST}


def _truncated(data: bytes, folder: Path, level: int) -> bytes:
    (folder / "whole.ath").write_bytes(data)
    athcodec.truncate(folder / "whole.ath", folder / "cut.ath", level)
    return (folder / "cut.ath").read_bytes()


def finds() -> dict[str, bytes]:
    """Files that once went wrong; a target's own inputs have its name behind the dot instead."""
    return {path.stem: path.read_bytes() for path in sorted(CORPUS.glob("*.ath"))}


# ---- as the targets want them ----


def _ways() -> list[bytes]:
    """Options that use a file as it is, and repaired."""
    rng = np.random.default_rng(1)
    tails = [bytes(OPTIONS), b"\1" + bytes(OPTIONS - 1)]
    return tails + [b"\1" + rng.integers(0, 256, OPTIONS - 1, np.uint8).tobytes() for _ in range(2)]


def _prelude_head(vertices: int, branches: int, frames: int, method: int, step: bytes, split: int) -> bytes:
    """The head that prelude.c reads: counts are stored so that it finds them again."""
    head = struct.pack("<HHHB", vertices - 1, branches - 1, frames - 1, method)
    return head + step[1:8] + struct.pack("<H", split)


def _prelude_inputs(data: bytes) -> Iterator[bytes]:
    parts = Parts.of(data)
    header = parts.header
    if header.vertex_count > 512 or header.frame_count > 1024:
        return
    hierarchy, rest, time = (parts.payload(kind) for kind in (ct.HIERARCHY, ct.REST, ct.TIME))
    counts = header.vertex_count, header.branch_count, header.frame_count
    step = struct.pack("<d", *struct.unpack_from("<f", rest, 13))
    yield _prelude_head(*counts, rest[0], step, len(hierarchy)) + hierarchy + rest[17:]
    if time[0] == 2:
        yield _prelude_head(*counts, 4, step, len(hierarchy)) + hierarchy + time[1:]
    for chunk, payload in parts.chunks:
        if chunk.kind == ct.STEMS and payload[5] >= 8:
            bits, (length,) = payload[5], struct.unpack_from("<I", payload, 8)
            stream = payload[12 : 12 + length]
            yield _prelude_head(*counts, 8 | bits - 8 << 4 & 255, step, 0) + stream


def inputs(target: str) -> Iterator[bytes]:
    """What a target starts from."""
    for path in sorted(CORPUS.glob(f"*.{target}")):
        yield path.read_bytes()
    for data in [*valid_files().values(), *finds().values()]:
        if target != "prelude":
            yield from (data + way for way in _ways())
        elif data in valid_files().values():
            yield from _prelude_inputs(data)


def write_inputs(target: str, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for i, data in enumerate(inputs(target)):
        (folder / f"seed-{i:04}").write_bytes(data)
