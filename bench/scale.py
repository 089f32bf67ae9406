"""Seconds per vertex and frame to encode and decode, over clips of more and more vertices or frames.

They should not depend on the size: the target is a ratio of at most 1.5 between the slowest and the fastest clip of a
series. Two series are made from one clip: copies of the plant as one clip, each some frames ahead of the one before, so
that no two move alike, all at the same position, so that the bound stays the same; and a few of them played forwards
and backwards for longer. So the content of a vertex and a frame stays the same, unlike in plants of different sizes;
the suite `full` has series of those too, where they can be made. File to file and file to array, in one process, files
in the page cache.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import athcodec
from bench.clips import ReplicatedPlants, add_rel_error, add_source, replicated_plants
from bench.decode import compile_program
from bench.suite import cases
from bench.tables import table

TARGET = 1.5
ENCODES, DECODES = 3, 5
REAL = {
    "vertices, 200 frames": ("mj_1k_200f", "mj_4k_200f", "mj_8k_200f", "refined_50k_200f"),
    "frames, 1k vertices": ("mj_1k_200f", "mj_1k_1200f"),
    "frames, 4k vertices": ("mj_4k_200f", "mj_4k_1200f"),
}
SIZES = {
    "quick": ((1, 3), 120, (120, 240), 1),  # copies, their frames; frames, their copies
    "full": ((1, 2, 5, 10, 20, 50), 200, (200, 400, 800, 1200), 8),
}

NOTE = """
Encode: from an HDF5 file to a file, default effort, no attributes, median of {encodes} runs. Decode: opening
and all positions as one float32 array, in Python, median of {decodes} after one that does not count. ns:
nanoseconds per vertex and frame. C: the decoder alone, its file opened and its bases built, median of as many
processes (decode.py); what opening takes is part of 'decode' and the more of it the smaller a clip is.
Plants: copies in the clip.
"""

RATIO_NOTE = "The largest figure of a series divided by its smallest."


@dataclass(frozen=True)
class _Clip:
    """A clip of a series."""

    series: str
    name: str
    path: Path
    plants: int = 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips",
        nargs="*",
        metavar="CLIP",
        default=[],
        help="a series of your own: files CLIP.h5, or names of clips of this benchmark",
    )
    parser.add_argument(
        "--suite", choices=tuple(SIZES), default="quick", help="length of the generated series (default %(default)s)"
    )
    add_source(parser)
    for name, count in (("encodes", ENCODES), ("decodes", DECODES)):
        parser.add_argument(
            f"--{name}", type=int, default=count, metavar="N", help="runs for each median (default %(default)s)"
        )
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        program = compile_program(Path(folder))
        for clip in _series(args, Path(folder)):
            rows.append(_row(clip, Path(folder) / "clip.ath", args, program))
            if clip.path.parent == Path(folder):
                clip.path.unlink()
    note = NOTE.format(encodes=args.encodes, decodes=args.decodes)
    return {
        "tables": [
            table(f"Time by size, bound {args.rel_error:g}", rows, note),
            table("Largest over smallest", list(_ratios(rows)), RATIO_NOTE),
        ],
        "broken": [],
    }


def _row(clip: _Clip, file: Path, args: argparse.Namespace, program: Path) -> dict[str, Any]:
    encode = _encode_seconds(clip.path, file, args.rel_error, args.encodes)
    decode, in_c = _decode_seconds(file, args.decodes), _c_seconds(file, program, args.decodes)
    with athcodec.open(file) as decoder:
        frames, vertices, branches = decoder.frame_count, decoder.file.vertex_count, decoder.file.branch_count
        segments = len(decoder.segments)
    row = {
        "series": clip.series,
        "clip": clip.name,
        "plants": clip.plants,
        "vertices": vertices,
        "branches": branches,
        "frames": frames,
        "segments": segments,
        "bytes": file.stat().st_size,
    }
    seconds = {"encode": encode, "decode": decode, "decode, C": in_c}
    return (
        row
        | {f"{what} s": value for what, value in seconds.items()}
        | {f"{what} ns": 1e9 * value / (frames * vertices) for what, value in seconds.items()}
    )


def _encode_seconds(path: Path, file: Path, rel_error: float, count: int) -> float:
    runs = []
    for _ in range(count):
        start = time.perf_counter()
        with athcodec.read_hdf5(path) as clip:
            athcodec.encode(clip, file, rel_error=rel_error, attributes="none")
        runs.append(time.perf_counter() - start)
    return median(runs)


def _decode_seconds(file: Path, count: int) -> float:
    runs = []
    for _ in range(count + 1):
        start = time.perf_counter()
        with athcodec.open(file) as decoder:
            decoder.positions()
        runs.append(time.perf_counter() - start)
    return median(runs[1:])


def _c_seconds(file: Path, program: Path, count: int) -> float:
    command = [str(program), str(file), "once"]
    runs = [
        json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["decode_ms"]
        for _ in range(count)
    ]
    return median(runs) / 1e3


def _ratios(rows: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for series in dict.fromkeys(row["series"] for row in rows):
        own = [row for row in rows if row["series"] == series]
        for what in ("encode", "decode", "decode, C"):
            figures = [row[f"{what} ns"] for row in own]
            ratio = max(figures) / min(figures)
            yield {
                "series": series,
                "what": what,
                "clips": len(own),
                "least ns": min(figures),
                "most ns": max(figures),
                "ratio": ratio,
                "target": TARGET,
                "met": ratio <= TARGET,
            }


# ---- the clips ----


def _series(args: argparse.Namespace, folder: Path) -> Iterator[_Clip]:
    """Given clips, or those made from one, each written when it is needed."""
    if args.clips:
        yield from _clips("given", args.clips)
        return
    copies, copy_frames, lengths, plants = SIZES[args.suite]
    with replicated_plants(args.of) as replicated:
        for count in copies:
            yield _made("copies", replicated, folder, count, copy_frames)
        for frames in lengths:
            yield _made("repeated frames", replicated, folder, plants, frames)
    if args.suite == "full":
        for series, names in REAL.items():
            yield from _clips(series, names)


def _made(series: str, replicated: ReplicatedPlants, folder: Path, plants: int, frames: int) -> _Clip:
    path = folder / f"{plants}x{frames}.h5"
    replicated.write(path, plants, frames)
    return _Clip(series, f"{replicated.name} x {plants}", path, plants)


def _clips(series: str, words: Iterable[str]) -> Iterator[_Clip]:
    for case in cases(words, "full"):
        if case.path:
            yield _Clip(series, case.name, case.path)
        else:
            print(f"{case.name}: {case.description}", file=sys.stderr)
