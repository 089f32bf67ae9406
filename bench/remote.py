"""Requests and bytes over HTTP: opening a long clip and showing one frame of it, a level of it, checking it.

A real server with byte ranges on this machine, with and without a delay before each response. Each row opens the file
anew. Requests and bytes are counted by the reader, and must agree with the server's log. The clips are copies of one
plant at the same position, played forwards and backwards.
"""

from __future__ import annotations

import argparse
import io
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import athcodec
from athcodec.files.remote import READ_AHEAD
from bench.clips import ReplicatedPlants, add_effort, add_number, add_rel_error, add_source, replicated_plants
from bench.tables import table
from bench.throttled_server import ThrottledServer

PLANTS, FRAMES, FRAME, LATENCY, ROUNDS = (1, 20), 1000, 700, 0.05, 5
TARGET = 4  # requests to open a file and show a frame of it coarsely
NAME = "clip.ath"

NOTE = """
Each row: opening the file, and the named step; {frames:,} frames, bound {bound:g}. Needed: bytes that a reader of a
local file touches, prelude included. Over HTTP the first request always fetches {ahead:,} bytes, and each level of a
segment is a separate request unless it is near. Seconds: without delay, and with a delay of {latency:g} ms before each
response; medians of {rounds}, files in memory, decoding included.
"""

Step = Callable[[athcodec.Decoder], Any]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_source(parser)
    add_number(parser, "--plants", PLANTS, "copies of it in a clip")
    add_number(parser, "--frames", FRAMES, "frames of a clip")
    add_number(parser, "--frame", FRAME, "the frame that is shown")
    add_number(parser, "--latency", LATENCY, "seconds before a response", "SECONDS")
    add_number(parser, "--rounds", ROUNDS, "runs of everything")
    add_effort(parser, "fast")
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows, broken = [], []
    with tempfile.TemporaryDirectory() as folder, replicated_plants(args.of) as replicated:
        for plants in args.plants:
            file = _make(replicated, Path(folder), plants, args)
            for row, lines in _rows(file, args):
                rows.append({"plants": plants} | row)
                broken += lines
    note = NOTE.format(
        frames=args.frames, bound=args.rel_error, ahead=READ_AHEAD, latency=1e3 * args.latency, rounds=args.rounds
    )
    return {"tables": [table("A clip behind a URL", rows, note)], "broken": broken}


def _make(replicated: ReplicatedPlants, folder: Path, plants: int, args: argparse.Namespace) -> Path:
    source, file = folder / "clip.h5", folder / NAME
    replicated.write(source, plants, args.frames)
    with athcodec.read_hdf5(source) as clip:
        athcodec.encode(clip, file, rel_error=args.rel_error, effort=args.effort, attributes="none")
    return file


def _steps(frame: int) -> dict[str, tuple[Step, int | None]]:
    """What is done with an opened file, and the largest allowed number of requests."""
    return {
        "open": (lambda decoder: None, None),
        f"frame {frame} at level 1": (lambda decoder: decoder.positions(frame, level=1), TARGET),
        f"frame {frame} in full": (lambda decoder: decoder.positions(frame), None),
        "level 0, all frames": (lambda decoder: decoder.positions(level=0), None),
        "level 1, all frames": (lambda decoder: decoder.positions(level=1), None),
        "everything": (lambda decoder: decoder.positions(), None),
        "verify": (lambda decoder: decoder.file.check(), None),
    }


def _rows(file: Path, args: argparse.Namespace) -> Iterator[tuple[dict[str, Any], list[str]]]:
    """A row and its faults for every step."""
    data = file.read_bytes()
    for what, (step, allowed) in _steps(args.frame).items():
        row = {"what": what, "requests": 0, "allowed": allowed, "bytes": 0, "needed": _needed(file, step)}
        for name, latency in (("s", 0.0), (f"s at {1e3 * args.latency:g} ms", args.latency)):
            with ThrottledServer({NAME: data}, latency=latency) as server:
                row[name], row["requests"], row["bytes"] = _measure(server, step, args.rounds)
                answered = len(server.log) // args.rounds, server.sent(NAME) // args.rounds
        lines = []
        if (row["requests"], row["bytes"]) != answered:
            lines.append(
                f"{what}: the reader counts {row['requests']} requests, {row['bytes']} bytes; the server "
                f"{answered[0]} and {answered[1]}"
            )
        if allowed is not None and row["requests"] > allowed:
            lines.append(f"{what}: got {row['requests']} requests; expected at most {allowed}")
        yield row | {"bytes/needed": row["bytes"] / row["needed"], "file": len(data)}, lines


def _measure(server: ThrottledServer, step: Step, rounds: int) -> tuple[float, int, int]:
    """Seconds, the median of some rounds; requests and bytes of one."""
    seconds = []
    for _ in range(rounds):
        start = time.perf_counter()
        with athcodec.open(server.address + NAME) as decoder:
            step(decoder)
            seconds.append(time.perf_counter() - start)
            requests, size = decoder.file.source.requests, decoder.file.source.bytes
    return median(seconds), requests, size


class _CountingFile(io.FileIO):
    """A file that records which of its bytes were read."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self.touched = np.zeros(file.stat().st_size, bool)

    def read(self, size: int = -1) -> bytes:
        start, data = self.tell(), super().read(size)
        self.touched[start : start + len(data)] = True
        return data


def _needed(file: Path, step: Step) -> int:
    with _CountingFile(file) as source, athcodec.open(source) as decoder:
        step(decoder)
        return int(source.touched.sum())
