"""The samples with surfaces: a leafed tree, a fern and a tuft of grass in a calm wind and in a gale, grown, moved and
encoded; and a young tree that grows, as HDF5.

It writes the files that ship with athcodec, and measures them against the clips that they were made of.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.options import DEFAULT_LADDER
from bench import data
from bench.clips import add_effort, measure
from bench.tables import table
from bench.trees.leafed import leafed
from bench.trees.tufts import fern, grass

WINDS = {"calm": 2.5, "gale": 10.0}  # m/s
FRAMES, FPS = 150, 30.0
PLANTS: dict[str, Callable[[], athcodec.MotionClip]] = {
    "leafed": lambda: leafed(
        nodes=900, orders=3, height=9.0, sprays=1300, frames=FRAMES, winds=WINDS, seed=21, fps=FPS
    ),
    "fern": lambda: fern(fronds=12, pairs=15, height=0.8, frames=FRAMES, winds=WINDS, seed=7, fps=FPS),
    "grass": lambda: grass(blades=100, height=0.45, frames=FRAMES, winds=WINDS, seed=5, fps=FPS),
}
GROWTH, GRID = "growth", 2.0**-12  # The grid, in metres, that its positions are rounded to, so that the file is small.
REL_ERROR = 1e-3
LADDERS = {"grass": (3e-2, 1e-2, 4e-3)}  # A tuft has no branches on branches, whose depth would make levels.

NOTE = """
Error: the largest of any vertex in any frame, over the diagonal. Seam: the largest step of a vertex from a clip's last
frame to its first, over the largest between two frames after each other.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bench sample` to a parser: the plants to make, the folder to write to, the error bound and
    the effort.
    """
    parser.add_argument(
        "--only",
        nargs="+",
        choices=[*PLANTS, GROWTH],
        default=[*PLANTS, GROWTH],
        metavar="PLANT",
        help=f"of {', '.join([*PLANTS, GROWTH])}",
    )
    parser.add_argument("--out", type=Path, default=athcodec.sample_path("leafed").parent, metavar="FOLDER")
    parser.add_argument("--rel-error", type=float, default=REL_ERROR, metavar="FRACTION")
    add_effort(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    made = [_grown(args.out) if name == GROWTH else _made(name, args) for name in args.only]
    return {"tables": [each for each, _ in made], "broken": [line for _, lines in made for line in lines]}


def sapling() -> athcodec.MotionClip:
    """Return the tree that grows, its positions on GRID."""
    clip = data.RECIPES["sapling"].make()
    return clip.replace(positions=(np.round(np.asarray(clip.positions) / GRID) * GRID).astype(np.float32))


def _grown(folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Return the table of the tree that grows."""
    clip, out = sapling(), folder / athcodec.sample_path(GROWTH).name
    athcodec.write_hdf5(clip, out, gzip=True)
    still = int((np.diff(clip.positions, axis=0) == 0).all(axis=(1, 2)).sum())
    rows = [{"vertices": clip.vertex_count, "frames": clip.frame_count, "steps without motion": still}]
    return table(f"{out.name}: {out.stat().st_size:,} bytes", rows), []


def _made(name: str, args: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    """Make and encode the sample of one plant. Return the table of its clips, and a line for each clip whose error
    exceeds the bound.
    """
    clip, out = PLANTS[name](), args.out / athcodec.sample_path(name).name
    ladder = LADDERS.get(name, DEFAULT_LADDER)
    athcodec.encode(clip, out, rel_error=args.rel_error, rest_error="bound", effort=args.effort, ladder=ladder)
    diagonal = float(np.linalg.norm(np.ptp(clip.block(0, clip.frame_count).reshape(-1, 3), axis=0)))
    rows = []
    for wind, part in athcodec.split(clip).items():
        with athcodec.open(out, strict=True, clip=wind) as decoder:
            error = measure(part, decoder).max_error / diagonal
        rows.append(
            {
                "clip": wind,
                "vertices": part.vertex_count,
                "frames": part.frame_count,
                "float32 MB": 12e-6 * part.vertex_count * part.frame_count,
                "error": error,
                "seam": _seam(part),
            }
        )
    broken = [
        f"{name}, {row['clip']}: error {row['error']:.2e}" for row in rows if row["error"] > args.rel_error * (1 + 1e-6)
    ]
    return table(f"{out.name}: {out.stat().st_size:,} bytes", rows, NOTE), broken


def _seam(clip: athcodec.MotionClip) -> float:
    positions = clip.block(0, clip.frame_count)
    steps = [float(np.abs(b - a).max()) for a, b in zip(positions, positions[1:], strict=False)]
    return float(np.abs(positions[0] - positions[-1]).max()) / max(steps)
