"""Processor time of encoding over its limit, and seconds to decode and open, compared with gzip-compressed HDF5.

Encoding goes from an opened clip to a file, at default effort; its processor time is that of all threads and child
processes. Decoding goes from file to array, after a warm-up, files in the page cache; its runs alternate with those of
HDF5, so that conditions are the same for both. Start-up of Python and imports are not counted.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import h5py
import scipy.sparse.csgraph
import scipy.spatial  # noqa: F401

import athcodec
import athcodec.encoding.encoder
from athcodec.encoding.search import sample
from bench import data
from bench.clips import add_clips, add_rel_error
from bench.tables import table

DECODES = 7
SECONDS, MICROSECONDS = 3.0, 5.0  # The limit of encoding, and what each vertex in a frame of the source adds to it.

NOTE = f"""
Encode: at default effort. CPU: processor time of that, all threads; CPU/limit: over {SECONDS:g} s and
{MICROSECONDS:g} us for each vertex in a frame, at most 1. Untried: choices that the encoder left out to keep to it.
Decode: opening and all positions as one float32 array. Frame: opening and one frame at level 1; read: bytes of the
file that this needs. Decode/HDF5: over reading the same positions with h5py, gzip and shuffle; above 1: slower.
"""

SAMPLE_NOTE = """
Whole: bytes where all of a plant is tried, and not a sample of it. CPU/whole: processor time over that of then.
Differ: which of the choices that a summary names are others then, beside steps.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bench speed` to a parser: clips or all suites, the error bound, and whether samples of
    plants are measured.
    """
    add_clips(parser)
    add_rel_error(parser)
    parser.add_argument("--all", action="store_true", help="all clips of all suites, made if they are missing")
    parser.add_argument(
        "--sample",
        action="store_true",
        help="compare choices made on a sample of the plant with those made on all of it, too",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Measure how long encoding and decoding take on each clip. Return the tables, and lines about clips whose encoding
    takes more processor time than its limit.
    """
    names = dict.fromkeys(name for suite in data.SUITES.values() for name in suite)
    rows = [_row(path, args.rel_error) for path in (map(data.path_of, names) if args.all else args.clips)]
    tables = [table(f"Speed, bound {args.rel_error:g}, medians in seconds", rows, NOTE)]
    if args.sample:
        tables.append(
            table("Samples of plants", [_sample_row(path, args.rel_error) for path in args.clips], SAMPLE_NOTE)
        )
    slow = [f"{row['clip']}: {row['CPU/limit']:.2f} of the limit" for row in rows if row["CPU/limit"] > 1]
    return {"tables": tables, "broken": slow}


def _row(path: Path, rel_error: float) -> dict[str, Any]:
    """Return the row of one clip: seconds of encoding, processor time over its limit, and seconds of decoding and of
    showing one frame, beside reading gzip-compressed HDF5.
    """
    with tempfile.TemporaryDirectory() as folder, athcodec.read(path) as clip:
        file, gzip = Path(folder) / "clip.ath", Path(folder) / "clip.h5"
        work, middle = clip.frame_count * clip.vertex_count, clip.frame_count // 2
        athcodec.write_hdf5(clip.replace(attributes={}), gzip, gzip=True)
        start, cpu = time.perf_counter(), processor_seconds()
        summary = athcodec.encode(clip, file, rel_error=rel_error)
        encode, cpu = time.perf_counter() - start, processor_seconds() - cpu
        bytes_read = [0]

        def decode() -> None:
            with athcodec.open(file) as decoder:
                decoder.positions()

        def read_hdf5() -> None:
            with h5py.File(gzip, "r") as source:
                source["positions"][...]

        def one_frame() -> None:
            with athcodec.open(file) as decoder:
                decoder.positions(middle, level=min(1, decoder.file.level_count - 1))
                bytes_read[0] = decoder.file.bytes_read

        seconds = _in_turns(decode, read_hdf5, one_frame)
    return {
        "clip": path.stem,
        "vertices": clip.vertex_count,
        "frames": clip.frame_count,
        "bytes": summary.bytes,
        "encode": encode,
        "CPU": cpu,
        "CPU/limit": cpu / (SECONDS + 1e-6 * MICROSECONDS * work),
        "untried": ", ".join(summary.untried),
        "decode": seconds[0],
        "frame": seconds[2],
        "read": bytes_read[0],
        "decode/HDF5": seconds[0] / seconds[1],
    }


def _sample_row(path: Path, rel_error: float) -> dict[str, Any]:
    """Encode a clip twice, with the encoder's choices made on a sample of the plant and on all of it. Return the bytes
    and the processor time of the first as fractions of the second's, and the names of choices that differ.
    """
    summaries, seconds, large = [], [], sample.LARGE
    try:
        for sample.LARGE in (large, sys.maxsize):
            with tempfile.TemporaryDirectory() as folder, athcodec.read(path) as clip:
                cpu = processor_seconds()
                summaries.append(athcodec.encode(clip, Path(folder) / "clip.ath", rel_error=rel_error))
                seconds.append(processor_seconds() - cpu)
    finally:
        sample.LARGE = large
    by_sample, by_whole = summaries
    differ = [name for name, value in by_sample.choices.items() if value != by_whole.choices[name]]
    return {
        "clip": path.stem,
        "bytes": by_sample.bytes,
        "whole": by_whole.bytes,
        "bytes/whole": by_sample.bytes / by_whole.bytes,
        "CPU/whole": seconds[0] / seconds[1],
        "differ": ", ".join(name for name in differ if not name.endswith("step_ratio")),
    }


def processor_seconds() -> float:
    """Return the processor time of this process, with its threads and the children that it waited for, to 1 us."""
    used = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def _in_turns(*steps: Callable[[], None]) -> list[float]:
    """Return the median seconds of each step. The steps are called one after the other in several rounds, after one
    that is not counted.
    """
    seconds: list[list[float]] = []
    for _ in range(DECODES + 1):
        seconds.append([])
        for step in steps:
            start = time.perf_counter()
            step()
            seconds[-1].append(time.perf_counter() - start)
    return [median(runs) for runs in zip(*seconds[1:])]
