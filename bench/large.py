"""Large meshes and long clips: seconds and memory of encoding by frames and threads, each run in its own process.

The plant consists of straight stems on stems; each bends about its own axis with two frequencies. The clip is written
to an HDF5 file first; seconds are those from opening it to the finished .ath file. With --made frames are generated
while they are read and never stored: this is for measuring memory, since generating them takes much of the time, in one
thread.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec import MotionClip
from athcodec.motion.frames import Frames
from bench.tables import table

STEM = 100  # vertices
CHILDREN = 12  # Children of each stem.
FPS = 30.0

NOTE = """
Peak: the largest resident memory of the process, imports included (60 MB). Linear: seconds per frame over those of the
shortest clip with the same vertices and threads. Speed-up: over one thread, for the same clip.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vertices", type=int, default=500_000)
    parser.add_argument("--frames", type=int, nargs="+", default=[100, 1000])
    parser.add_argument("--jobs", type=int, nargs="+", default=[0], help="threads; 0: as encode decides")
    parser.add_argument("--effort", default="default")
    parser.add_argument("--rel-error", type=float, default=1e-3)
    parser.add_argument("--made", action="store_true", help="generate frames while they are read")


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for frames in args.frames:
            path = Path(folder, "clip.h5")
            if not args.made:
                _process("store", args.vertices, frames, path)
            for jobs in args.jobs:
                rows.append(
                    json.loads(
                        _process(
                            "encode",
                            args.vertices,
                            frames,
                            "" if args.made else path,
                            jobs,
                            args.effort,
                            args.rel_error,
                        )
                    )
                )
    for row in rows:
        first = next(other for other in rows if other["threads"] == row["threads"])
        single = [other for other in rows if other["threads"] == 1 and other["frames"] == row["frames"]]
        row["linear"] = row["seconds"] / row["frames"] / (first["seconds"] / first["frames"])
        row["speed-up"] = single[0]["seconds"] / row["seconds"] if single else None
    title = f"Large clips, bound {args.rel_error:g}, effort {args.effort}"
    return {"tables": [table(title, rows, NOTE)], "broken": []}


def _process(*words: object) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "bench.large", *map(str, words)], check=True, capture_output=True, text=True
    )
    return done.stdout


def made(vertices: int, frames: int, seed: int = 0) -> MotionClip:
    """Stems of STEM vertices; each but the first stands on an earlier one and is half as long as that."""
    rng, count = np.random.default_rng(seed), vertices // STEM
    parent = (np.arange(count) - 1) // CHILDREN
    parent[0] = -1
    depth = np.zeros(count, int)
    for stem in range(1, count):
        depth[stem] = depth[parent[stem]] + 1
    length, along = 10.0 * 0.5**depth, np.linspace(0, 1, STEM)
    heading = rng.normal(size=(count, 3))
    heading[:, 1] = np.abs(heading[:, 1])
    heading[0] = 0, 1, 0
    heading /= np.linalg.norm(heading, axis=1)[:, None]
    joint = rng.integers(STEM // 5, STEM, count)
    shift = np.zeros((count, STEM, 3))
    rest = np.zeros((count, STEM, 3))
    for stem in range(count):
        base = rest[parent[stem], joint[stem]] if stem else np.zeros(3)
        rest[stem] = base + heading[stem] * length[stem] * along[:, None]
    across = np.cross(heading, rng.normal(size=(count, 3)))
    across *= (0.05 * length / np.linalg.norm(across, axis=1))[:, None]
    hertz, phase = rng.uniform(0.3, 1.0, count) * 2 ** (depth / 2), rng.uniform(0, 2 * np.pi, count)
    stems_of = [np.flatnonzero(depth == order) for order in range(depth.max() + 1)]

    def read(start: int, stop: int) -> np.ndarray:
        out = np.empty((stop - start, count * STEM, 3), np.float32)
        for row, now in enumerate(np.arange(start, stop) / FPS):
            angle = 2 * np.pi * hertz * now + phase
            bend = (np.sin(angle) + 0.3 * np.sin(2.3 * angle + phase))[:, None, None] * across[:, None]
            for stems in stems_of:
                carried = shift[parent[stems], joint[stems]][:, None] if stems[0] else 0.0
                shift[stems] = bend[stems] * (along**2)[None, :, None] + carried
            out[row] = (rest + shift).reshape(-1, 3)
        return out

    return MotionClip(
        Frames(read, frames, count * STEM),
        np.arange(frames) / FPS,
        np.repeat(np.arange(count), STEM),
        parent,
        rest=rest.reshape(-1, 3).astype(np.float32),
    )


def encode(vertices: int, frames: int, path: str, jobs: int, effort: str, rel_error: float) -> None:
    """Encodes the clip of a file, or a generated one if `path` is empty, and prints its row as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        clip = athcodec.read(path) if path else made(vertices, frames)
        result = athcodec.encode(clip, Path(folder, "a.ath"), rel_error=rel_error, effort=effort, jobs=jobs or None)
        seconds = time.perf_counter() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(
        json.dumps(
            {
                "vertices": clip.vertex_count,
                "frames": frames,
                "threads": jobs,
                "seconds": seconds,
                "peak (MB)": peak / 1e6,
                "float32 (MB)": result.raw_bytes / 1e6,
                "file (MB)": result.bytes / 1e6,
            }
        )
    )


if __name__ == "__main__":
    verb, size, length, *words = sys.argv[1:]
    if verb == "store":
        athcodec.write(made(int(size), int(length)), words[0])
    else:
        encode(int(size), int(length), words[0], int(words[1]), words[2], float(words[3]))
