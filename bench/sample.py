"""The second sample: a leafed tree in a calm wind and in a gale, grown, moved and encoded.

It writes the file that ships with athcodec, and measures it against the clip that it was made of.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from bench.clips import add_effort, measure
from bench.tables import table
from bench.trees.leafed import leafed

NODES, ORDERS, HEIGHT, SPRAYS, FRAMES, FPS, SEED = 900, 3, 9.0, 1300, 150, 30.0, 21
WINDS = {"calm": 2.5, "gale": 10.0}  # m/s
REL_ERROR = 1e-3

NOTE = """
Error: the largest of any vertex in any frame, over the diagonal. Seam: the largest step of a vertex from a clip's last
frame to its first, over the largest between two frames after each other.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, default=athcodec.sample_path("leafed"), metavar="FILE.ath")
    parser.add_argument("--rel-error", type=float, default=REL_ERROR, metavar="FRACTION")
    add_effort(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    clip = leafed(NODES, ORDERS, HEIGHT, SPRAYS, FRAMES, WINDS, SEED, FPS)
    athcodec.encode(clip, args.out, rel_error=args.rel_error, rest_error="bound", effort=args.effort)
    diagonal = float(np.linalg.norm(np.ptp(clip.block(0, clip.frame_count).reshape(-1, 3), axis=0)))
    rows = []
    for name, part in athcodec.split(clip).items():
        with athcodec.open(args.out, strict=True, clip=name) as decoder:
            error = measure(part, decoder).max_error / diagonal
        rows.append(
            {
                "clip": name,
                "vertices": part.vertex_count,
                "frames": part.frame_count,
                "float32 MB": 12e-6 * part.vertex_count * part.frame_count,
                "error": error,
                "seam": _seam(part),
            }
        )
    size = args.out.stat().st_size
    broken = [f"{row['clip']}: error {row['error']:.2e}" for row in rows if row["error"] > args.rel_error * (1 + 1e-6)]
    return {"tables": [table(f"{args.out.name}: {size:,} bytes", rows, NOTE)], "broken": broken}


def _seam(clip: athcodec.MotionClip) -> float:
    positions = clip.block(0, clip.frame_count)
    steps = [float(np.abs(b - a).max()) for a, b in zip(positions, positions[1:], strict=False)]
    return float(np.abs(positions[0] - positions[-1]).max()) / max(steps)
