"""Seconds to encode, decode, open, and decode one frame at level 1, compared with reading gzip-compressed HDF5.

Processor time of one process with all its threads, to which other programs on the machine add little, after a warm-up,
files in the page cache. Encoding and decoding go from file to file and from file to array. Runs of decoding and HDF5
alternate, so that conditions are the same for both. Start-up of Python and imports are not counted.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import h5py

import athcodec
from bench.clips import add_clips, add_rel_error, read
from bench.tables import table

ENCODES, DECODES = 3, 7

NOTE = """
Encode: from an HDF5 file to a file, default effort, no attributes. Decode: opening and all positions as one
float32 array. Info: opening and decoder.info(). Frame: opening and one frame at level 1; read:
bytes of the file that this needs. HDF5: h5py reading the same positions, gzip and shuffle, into one array;
decode/HDF5 above 1: slower than HDF5.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    summary, details = [], []
    for path in args.clips:
        with tempfile.TemporaryDirectory() as folder:
            case = _Case(path, Path(folder), args.rel_error)
            seconds = case.measure()
            summary.append({"clip": path.stem} | case.summary(seconds))
            details += [
                {
                    "clip": path.stem,
                    "step": step,
                    "runs": len(runs),
                    "min s": min(runs),
                    "median s": median(runs),
                    "max s": max(runs),
                }
                for step, runs in seconds.items()
            ]
    return {
        "tables": [
            table(f"Speed, bound {args.rel_error:g}, medians in seconds of processor time", summary, NOTE),
            table("All runs", details),
        ],
        "broken": [],
    }


class _Case:
    """The steps that are timed, on one clip; `file` is written by encoding, `gzip` before."""

    def __init__(self, path: Path, folder: Path, rel_error: float) -> None:
        self.path, self.rel_error = path, rel_error
        self.file, self.gzip = folder / "clip.ath", folder / "clip.h5"
        self.frame_bytes = 0
        with read(path) as clip:
            self.frame, self.vertex_frames = clip.frame_count // 2, clip.frame_count * clip.vertex_count
            athcodec.write_hdf5(clip, self.gzip, gzip=True)

    def measure(self) -> dict[str, list[float]]:
        seconds = _in_turns({"encode": self.encode}, ENCODES)
        return seconds | _in_turns(
            {"decode": self.decode, "HDF5": self.read_hdf5, "info": self.info, "frame": self.one_frame}, DECODES
        )

    def encode(self) -> None:
        with read(self.path) as clip:
            athcodec.encode(clip, self.file, rel_error=self.rel_error, attributes="none")

    def decode(self) -> None:
        with athcodec.open(self.file) as decoder:
            decoder.positions()

    def read_hdf5(self) -> None:
        with h5py.File(self.gzip, "r") as file:
            file["positions"][...]

    def info(self) -> None:
        with athcodec.open(self.file) as decoder:
            decoder.file.info()

    def one_frame(self) -> None:
        with athcodec.open(self.file) as decoder:
            decoder.positions(self.frame, level=1)
            self.frame_bytes = decoder.file.bytes_read

    def summary(self, seconds: dict[str, list[float]]) -> dict[str, float | int]:
        middle = {step: median(runs) for step, runs in seconds.items()}
        length = self.file.stat().st_size
        with h5py.File(self.gzip, "r") as file:
            stored = file["positions"].id.get_storage_size()
        return {
            "bytes": length,
            "encode": middle["encode"],
            "decode": middle["decode"],
            "M vertex-frames/s": self.vertex_frames / middle["decode"] / 1e6,
            "info": middle["info"],
            "frame": middle["frame"],
            "read": self.frame_bytes,
            "read %": 100 * self.frame_bytes / length,
            "HDF5": middle["HDF5"],
            "HDF5 bytes": stored,
            "decode/HDF5": middle["decode"] / middle["HDF5"],
        }


def _in_turns(steps: dict[str, Callable[[], None]], rounds: int) -> dict[str, list[float]]:
    """Seconds of every run of every step; steps alternate, after a warm-up round."""
    seconds: dict[str, list[float]] = {name: [] for name in steps}
    for round_number in range(rounds + 1):
        for name, step in steps.items():
            start = time.process_time()
            step()
            if round_number:
                seconds[name].append(time.process_time() - start)
    return seconds
