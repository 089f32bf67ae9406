"""Branches that are found against those that a source names: bytes of both, for every clip that names its branches.

A clip is encoded as it is, and without its branches as a source gives it that names none: as a mesh if it has faces,
else with its edges, and as points. Results are saved as they are measured; `python -m bench report` puts what they show
into docs/formats.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from statistics import median
from typing import Any

import athcodec
from athcodec import MotionClip
from bench.clips import POSITIONS, REL_ERROR, add_rel_error, file_and_seconds
from bench.codec_registry import fingerprint_of_athcodec
from bench.data import digest
from bench.scenes import SCENES
from bench.scenes.assembly import bare
from bench.store import Results, Store, commits
from bench.suite import SUITES, cases
from bench.tables import environment, table

RESULTS = Path(__file__).parent / "results" / "branches.json"
KEYS = {"sizes": ("clip", "given", "bound")}
ALL = ("full", "odd", "foreign", "held-out")
LARGEST = 8_000_000  # Vertices in all frames of the largest clip that is encoded where none is named.
LIMIT = 1.05  # Bytes on branches that are found, over those on true ones.
LEAST_BYTES = 500  # Smaller files are left out of what the document says: a few bytes are many per cent.

NOTE = f"""
Bytes of positions alone in a single layer, on the source's own branches (true) and on those found for what the source
gives besides. Roots and branches: the source's and those found. Limit: {LIMIT:g}. Clips of more than {LARGEST:,}
vertices in all frames are left out unless they are named; `scene` are those of `python -m bench structure`.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("clips", nargs="*", metavar="CLIP", default=[], help="files, names of clips, or of scenes")
    parser.add_argument("--suite", choices=SUITES, help="suite of clips (default: all suites, and all scenes)")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE", help="where figures are kept")
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Encode every chosen clip with its named branches and with branches that athcodec has to find. Return the table
    that compares the bytes, and an empty list of broken promises; figures that are stored already are not measured
    again.
    """
    store = Store(args.results, environment(args.argv), KEYS)
    names: list[str] = []
    for name, depends, clip in _clips(args):
        names.append(name)
        for knowledge, without in _without_branches(clip).items():
            key = {"clip": name, "given": knowledge, "bound": args.rel_error}
            if store.find("sizes", key, depends) is None:
                store.add("sizes", key | _figures(clip, without, args.rel_error) | {"depends": depends})
                print(store.find("sizes", key), file=sys.stderr, flush=True)
    rows = [row for row in store.contents()["sizes"] if row["clip"] in names and row["bound"] == args.rel_error]
    return {
        "tables": [table(f"Found against true branches, bound {args.rel_error:g}", _shown(rows), NOTE)],
        "broken": [],
    }


def _clips(args: argparse.Namespace) -> Iterator[tuple[str, dict[str, str], MotionClip]]:
    """Yield clips that name their branches: the clip's name, a mapping of what its stored figures depend on (such as
    its digest), and the clip.
    """
    codec = fingerprint_of_athcodec()
    chosen = args.clips or (() if args.suite else SCENES)
    for name in (name for name in chosen if name in SCENES):
        scene = SCENES[name].make().clip
        yield f"scene {name}", codec | {"clip": name}, scene
    words = [word for word in args.clips if word not in SCENES]
    suites = (() if args.clips else ALL) if args.suite is None else (args.suite,)
    listed = cases(words, "quick") if words else [case for suite in suites for case in cases((), suite)]
    for case in {case.name: case for case in listed if case.path is not None}.values():
        with athcodec.read(case.path) as clip:
            if clip.has_branches and (args.clips or clip.frame_count * clip.vertex_count <= LARGEST):
                yield case.name, codec | {"clip": digest(case.path)}, clip


def _without_branches(clip: MotionClip) -> dict[str, MotionClip]:
    """Return the clip without branches, by what else it gives."""
    if clip.polygons is not None:
        return {"faces": bare(clip).replace(edges=None)}
    points = {"points": bare(clip).replace(edges=None)}
    return points if clip.edges is None else {"edges": bare(clip)} | points


def _figures(clip: MotionClip, without: MotionClip, rel_error: float) -> dict[str, Any]:
    """Encode `clip`, whose branches are named, and `without`, whose branches athcodec finds, at `rel_error` of the
    diagonal. Return for each of the two its bytes, its numbers of roots and branches, and the seconds of encoding.
    """
    figures: dict[str, Any] = {}
    for name, variant in (("true", clip), ("found", without)):
        data, seconds = file_and_seconds(variant, rel_error=rel_error, **POSITIONS)
        with athcodec.open(data) as decoder:
            parent = decoder.file.hierarchy.branch_parent
            branches = [int((parent < 0).sum()), len(parent)]
        figures |= {name: len(data), f"branches, {name}": branches, f"seconds, {name}": seconds}
    return figures


def _shown(rows: Results) -> Results:
    hidden = {"depends", "command", "commit", "bound"}
    kept = [{name: value for name, value in row.items() if name not in hidden} for row in rows]
    return [row | {"found / true": row["found"] / row["true"]} for row in kept]


def table_text(contents: Mapping[str, Any]) -> str:
    """Return a sentence for a document that sums up stored results: by how many per cent files grow if athcodec finds
    the branches, compared with named ones.
    """
    rows = [row for row in contents["sizes"] if row["true"] >= LEAST_BYTES and row["bound"] == REL_ERROR]
    parts = []
    for knowledge, subject in (("faces", "meshes"), ("edges", "skeletons with edges"), ("points", "points alone")):
        ratios = {row["clip"]: row["found"] / row["true"] for row in rows if row["given"] == knowledge}
        if ratios:
            more = sum(ratio > LIMIT for ratio in ratios.values())
            worst = max(ratios, key=lambda clip: ratios[clip])
            parts.append(
                f"{len(ratios)} {subject}: {_percent(median(ratios.values()))} in the median, "
                f"{_percent(ratios[worst])} at most (`{worst}`), above {100 * LIMIT - 100:.0f} % in {more}"
            )
    made_by = f"`python -m bench branches`, commits {commits(rows)}"
    return f"More bytes on branches that are found than on true ones ({made_by}): {'; '.join(parts)}.\n"


def _percent(ratio: float) -> str:
    return f"{100 * (ratio - 1):.1f} %"
