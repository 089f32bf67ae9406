"""Clips of two makers side by side in one file, against the sum of a file for each.

Clips of other programs that have nothing to do with each other, such as a leaf that vibrates and roots that grow, are
put next to each other: positions and faces, or points alone where one of them has no faces. No branches are named.
Results are saved as they are measured; `python -m bench report` puts them into docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec import MotionClip
from athcodec.motion.clip import polygons
from bench.clips import POSITIONS, REL_ERROR, add_rel_error, file_and_seconds
from bench.codec_registry import fingerprint_of_athcodec
from bench.store import Store, commits
from bench.suite import cases
from bench.tables import environment, table

RESULTS = Path(__file__).parent / "results" / "pairs.json"
KEYS = {"pairs": ("pair", "bound")}
# Drawn at random among all pairs of clips of different makers.
PAIRS = (
    "skfem_leaf+cplantbox_brassica",
    "helios_strawberry_20d+scan_skeleton_turntable",
    "mujoco_reeds+cplantbox_lupin",
    "cplantbox_lupin+scan_skeleton_shrub",
    "helios_rice_8d+skfem_blade",
    "mujoco_thicket+helios_strawberry_20d",
    "mujoco_wheat_field+cplantbox_maize",
    "shader_card_tree+mujoco_cable_grass",
    "shader_card_bush+mujoco_cable_reed",
    "mujoco_thicket+skfem_blade",
    "mujoco_wheat_field+shader_poplar",
    "mujoco_wheat_field+skfem_leaf",
    "blender_bent_grass+mujoco_reeds",
    "mujoco_reeds+mujoco_cable_vine",
    "mujoco_hedge+blender_flower",
)
GAP = 0.02  # Between both clips, over the width of the first.
LIMIT = 1.05  # Bytes of the scene, over those of its parts.

NOTE = f"""
Bytes of positions alone, in a single layer and in the default layers: of both clips in one file, over the sum of a file
for each within the same bound in units. The second clip is as large as the first one, and both have the frames of the
shorter. Limit: {LIMIT:g}.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("pairs", nargs="*", metavar="CLIP+CLIP", help=f"by default {len(PAIRS)} pairs")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE", help="where figures are kept")
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Encode both clips of every chosen pair alone and together. Return the table of their bytes, and an empty list of
    broken promises; figures of this encoder that are stored already are not measured again.
    """
    store = Store(args.results, environment(args.argv), KEYS)
    chosen, depends = args.pairs or PAIRS, fingerprint_of_athcodec()
    for pair in chosen:
        if pair.count("+") != 1:
            raise SystemExit(f"pair: got {pair!r}; expected the names of two clips with a + between them")
        key = {"pair": pair, "bound": args.rel_error}
        if store.find("pairs", key, depends) is None:
            store.add("pairs", key | _figures(pair, args.rel_error) | {"depends": depends})
            print(store.find("pairs", key), file=sys.stderr, flush=True)
    rows = [row for row in store.contents()["pairs"] if row["pair"] in chosen and row["bound"] == args.rel_error]
    return {"tables": [table(f"Two clips in one file, bound {args.rel_error:g}", _shown(rows), NOTE)], "broken": []}


def side_by_side(one: MotionClip, other: MotionClip) -> tuple[MotionClip, MotionClip, MotionClip]:
    """Return two clips as they stand beside each other, without branches, and both as one clip. The second one gets the
    size of the first, and both the frames of the shorter one and its rate."""
    frames = min(one.frame_count, other.frame_count)
    first, second = (clip.block(0, frames).astype(np.float64) for clip in (one, other))
    corner, size = first.min(axis=(0, 1)), _diagonal(first)
    second = (second - second.min(axis=(0, 1))) * (size / _diagonal(second)) + corner
    second[..., 0] += (1 + GAP) * np.ptp(first[..., 0])
    of_one, of_other = (polygons(clip.faces, clip.attributes) for clip in (one, other))
    both = None
    if of_one is not None and of_other is not None:
        both = np.concatenate([of_one[0], of_other[0]]), np.concatenate([of_one[1], of_other[1] + one.vertex_count])
    else:
        of_one = of_other = None
    times = np.arange(frames) / one.fps
    return (
        _clip(first, times, of_one),
        _clip(second, times, of_other),
        _clip(np.concatenate([first, second], axis=1), times, both),
    )


def _diagonal(positions: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(positions, axis=(0, 1))))


def _clip(positions: np.ndarray, times: np.ndarray, faces: tuple[np.ndarray, np.ndarray] | None) -> MotionClip:
    arrays = {} if faces is None else {"face_vertex_counts": faces[0], "face_vertex_indices": faces[1]}
    return MotionClip(positions.astype(np.float32), times, attributes=arrays)


def _figures(pair: str, rel_error: float) -> dict[str, Any]:
    one, other = (athcodec.read(case.path) for case in cases(pair.split("+"), "quick"))
    with one, other:
        clips = side_by_side(one, other)
    bound = rel_error * _diagonal(clips[0].block(0, clips[0].frame_count))
    row: dict[str, Any] = {"faces": clips[0].polygons is not None, "vertices": [clip.vertex_count for clip in clips]}
    for name, options in (("single", POSITIONS), ("layers", {"attributes": "none"})):
        row[name] = [len(file_and_seconds(clip, **options, max_error=bound)[0]) for clip in clips]
    return row


def _shown(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [
        {
            "clips": row["pair"].replace("+", " + "),
            "given as": "meshes" if row["faces"] else "points",
            "parts": sum(row["single"][:2]),
            "file": row["single"][2],
            "file / parts": row["single"][2] / sum(row["single"][:2]),
            "in layers": row["layers"][2] / sum(row["layers"][:2]),
        }
        for row in rows
    ]


def table_text(results: Mapping[str, Any]) -> str:
    """Return the table of docs/benchmarks.md."""
    rows = sorted(results["pairs"], key=lambda row: PAIRS.index(row["pair"]) if row["pair"] in PAIRS else len(PAIRS))
    lines = ["| clips | given as | parts | file | / parts | in layers |", "| --- | --- | ---: | ---: | ---: | ---: |"]
    for row in _shown([row for row in rows if row["bound"] == REL_ERROR]):
        first, second = row["clips"].split(" + ")
        lines.append(
            f"| `{first}`, `{second}` | {row['given as']} | {row['parts']:,} | {row['file']:,} "
            f"| {row['file / parts']:.3f} | {row['in layers']:.3f} |"
        )
    return (
        f"`python -m bench pairs`, athcodec {athcodec.__version__}, commit {commits(results['pairs'])}\n\n"
        + "\n".join(lines)
    )
