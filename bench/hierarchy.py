"""The cost of detected branches: the file with detected branches compared with the one with the true ones.

Clips are measured as they are and without their branches, edges and names; of a render mesh, faces and motion remain.
The true branches are those that the clip was made from.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.motion.branches.result import Found, with_branches
from bench.clips import add_rel_error, read
from bench.data import path_of
from bench.tables import table

NOTE = """
Bytes: whole files without static arrays, with the true branches and with those found; more: increase in per cent.
Right: per cent of branches found that are true ones on their true parents. Seconds: to find them.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips", nargs="*", default=["canopy_67k_200f"], metavar="CLIP", help="a name of `data`, or an HDF5 file"
    )
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows = [measure(path_of(name), args.rel_error) for name in args.clips]
    return {"tables": [table(f"Branches found, bound {args.rel_error:g}", rows, NOTE)], "broken": []}


def measure(path: Path, rel_error: float) -> dict[str, Any]:
    with read(path) as clip, tempfile.TemporaryDirectory() as folder:
        bare = dataclasses.replace(
            clip,
            vertex_branch=None,
            branch_parent=None,
            stem_index=None,
            edges=clip.edges if clip.faces is None else None,
            rest=clip.rest.astype(clip.rest_dtype),
        )
        began = time.perf_counter()
        found = athcodec.find_branches(bare)
        seconds = time.perf_counter() - began
        true, ours = (
            athcodec.encode(variant, Path(folder, "a.ath"), rel_error=rel_error, attributes="none").bytes
            for variant in (clip, with_branches(bare, found))
        )
        return {
            "clip": path.stem,
            "vertices": clip.vertex_count,
            "branches": clip.branch_count,
            "found": len(found.branch_parent),
            "by": found.method,
            "right": right_percent(found, clip),
            "seconds": seconds,
            "true bytes": true,
            "found bytes": ours,
            "more": 100 * (ours / true - 1),
        }


def right_percent(found: Found, clip: athcodec.MotionClip) -> float:
    """Per cent of the branches found whose parent is that of their first vertex's true branch."""
    true_branch = clip.vertex_branch[np.unique(found.vertex_branch, return_index=True)[1]]
    parent = np.where(found.branch_parent < 0, -1, true_branch[found.branch_parent])
    return 100 * float((parent == clip.branch_parent[true_branch]).mean())
