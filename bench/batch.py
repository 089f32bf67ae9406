"""Many small clips encoded by one worker and by several: the time that further workers save.

Every round encodes the same clips into an empty directory with each number of workers in turn, so that conditions are
the same for all, and once in a loop in one process, which shows the overhead of the workers. The clips are windows of
one clip that start at different frames. Seconds are wall-clock time; those from the first clip to the last exclude the
start of the workers. Every file is compared with the loop's.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import athcodec
from athcodec import batch
from athcodec.batch.show import Show
from bench.clips import add_effort, add_number, add_rel_error, add_source, read
from bench.tables import table

COUNT, FRAMES, WORKERS, TARGET = 200, 40, (1, 2), 1.7

NOTE = """
Each clip: {frames} frames of {vertices:,} vertices, HDF5; files in the page cache. 'all s': the whole run, with start
and end of the workers; 'clips s': from the first clip to the last. Medians of {rounds} rounds. Loop: athcodec.encode in
one process with one thread. Load: load average of the machine before each run, median; with more running processes
than cores the ratio means little.
"""
RATIO_NOTE = "Seconds from the first clip to the last with one worker over those with several, by round; median."


class _Clock(Show):
    """Times at which a run began its first clip and finished its last."""

    def begin(self, items, kept) -> None:
        self.first = self.last = 0.0

    def stage(self, output, stage, fraction) -> None:
        self.first = self.first or time.perf_counter()

    def finished(self, item, record) -> None:
        self.first = self.first or time.perf_counter() - record.get("seconds", 0.0)
        self.last = time.perf_counter()


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_number(parser, "--clips", COUNT, "number of clips")
    add_number(parser, "--frames", FRAMES, "frames per clip")
    add_source(parser)
    add_effort(parser)
    add_rel_error(parser)
    add_number(parser, "--workers", WORKERS, "numbers of workers; others are compared with the first")
    add_number(parser, "--rounds", 1, "runs of everything")


def run(args: argparse.Namespace) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        source, vertices = Path(folder, "in"), make_clips(args, Path(folder, "in"))
        settings = {"rel_error": args.rel_error, "effort": args.effort}
        runs: dict[str, list[dict[str, float]]] = {}
        broken: list[str] = []
        for number in range(args.rounds):
            runs.setdefault("loop", []).append(encode_in_loop(source, Path(folder, f"loop_{number}"), settings))
            for workers in args.workers:
                out = Path(folder, f"{workers}_{number}")
                runs.setdefault(str(workers), []).append(_run(source, out, settings, workers))
                broken += _differences(Path(folder, f"loop_{number}"), out)
        files = [path.stat().st_size for path in Path(folder, "loop_0").iterdir()]
    rows = [
        {"workers": name, "clips": args.clips, "bytes": sum(files)}
        | {column: median(figures[column] for figures in rounds) for column in rounds[0]}
        | {"clips/s": args.clips / median(figures["clips s"] for figures in rounds)}
        for name, rounds in runs.items()
    ]
    note = NOTE.format(frames=args.frames, vertices=vertices, rounds=args.rounds)
    return {
        "tables": [
            table(f"Many clips, bound {args.rel_error:g}", rows, note),
            table("Speed-up by further workers", _ratios(runs, args.workers), RATIO_NOTE),
        ],
        "broken": broken,
    }


def make_clips(args: argparse.Namespace, folder: Path) -> int:
    """Writes windows of a clip as files; returns their number of vertices."""
    folder.mkdir()
    with read(args.of) as clip:
        frames = min(args.frames, clip.frame_count)
        for number, start in enumerate(np.linspace(0, clip.frame_count - frames, args.clips).astype(int)):
            window = athcodec.MotionClip(
                clip.block(start, start + frames),
                clip.time[:frames],
                clip.vertex_branch,
                clip.branch_parent,
                clip.source_rest,
                stem_index=clip.stem_index,
                metadata=clip.metadata,
            )
            athcodec.write_hdf5(window, folder / f"clip_{number:04}.h5")
        return clip.vertex_count


def encode_in_loop(source: Path, out: Path, settings: dict[str, Any]) -> dict[str, float]:
    out.mkdir()
    load, start = _load(), time.perf_counter()
    for path in sorted(source.iterdir()):
        with athcodec.read_hdf5(path) as clip:
            athcodec.encode(clip, out / f"{path.stem}.ath", jobs=1, **settings)
    seconds = time.perf_counter() - start
    return {"all s": seconds, "clips s": seconds} | load


def _run(source: Path, out: Path, settings: dict[str, Any], workers: int) -> dict[str, float]:
    items = batch.find([source], out, settings=settings)
    clock, load, start = _Clock(), _load(), time.perf_counter()
    outcome = batch.run(items, out, workers=workers, show=clock)
    if outcome.failed:
        raise SystemExit(f"batch: {outcome.failed[0]['output']}: {outcome.failed[0]['reason']}")
    return {"all s": time.perf_counter() - start, "clips s": clock.last - clock.first} | load


def _load() -> dict[str, float]:
    """The machine's load average, where the system reports it."""
    return {"load": os.getloadavg()[0]} if hasattr(os, "getloadavg") else {}


def _differences(loop: Path, out: Path) -> list[str]:
    return [
        f"{path.name}: differs from the file of athcodec.encode"
        for path in sorted(loop.iterdir())
        if path.read_bytes() != (out / path.name).read_bytes()
    ]


def _ratios(runs: dict[str, list[dict[str, float]]], workers: list[int]) -> list[dict[str, Any]]:
    rows = []
    for count in workers[1:]:
        pairs = zip(runs[str(workers[0])], runs[str(count)], strict=True)
        ratio = median(one["clips s"] / several["clips s"] for one, several in pairs)
        row = {"workers": f"{count} for {workers[0]}", "ratio": ratio}
        rows.append(row | ({"target": TARGET, "met": ratio >= TARGET} if (workers[0], count) == WORKERS else {}))
    return rows
