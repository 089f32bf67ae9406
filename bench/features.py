"""What each feature of the format saves: files of the bench's clips that do without it, one feature at a time.

The encoder searches its settings anew without the feature (athcodec.encoding.features), so that others may stand in for
it. A feature that a file does not use costs nothing when it is left out; that file is not made again.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import athcodec
from athcodec.encoding import Draft, code_segments, draft, write
from athcodec.encoding.features import Feature
from athcodec.encoding.segment import SHEET
from bench.clips import add_ladder, measure
from bench.suite import SUITES, Case, cases
from bench.tables import table

BOUNDS = (1e-3, 1e-4, 1e-5)
CLIPS = ("sample", "mj_1k_200f", "canopy_4k_60f", "grass", "scanned", "growth_carried", "cube", "morph")
OPTIONS: Mapping[Feature, dict[str, Any]] = {  # of files that can have the feature, beside those of all
    Feature.RIGID: {"rest_error": None},
    Feature.FREE_RIGID: {"rest_error": None},
    Feature.CONNECTED: {"attributes": "all"},
    Feature.JOINS: {"segment_frames": 32},
}
LEAST = 1.0  # per cent that a feature has to save somewhere

NOTE = f"""
How many per cent larger a file is without the feature; 0 where it does not use it, below 0 where the search does
better without. Files have no attributes and a rest pose of the bound; those for {Feature.RIGID.value} and
{Feature.FREE_RIGID.value} a rest pose that keeps faces, those for {Feature.CONNECTED.value} all attributes, those for
{Feature.JOINS.value} segments of 32 frames. What saves less than {LEAST:g} % everywhere is marked.
"""

NOT_JUDGED = """
Not judged by bytes: exact rest poses, lossless levels, uneven times, loops with their periodic time bases, rest poses
that the host has, weights, joins, which smooth motion over seams, and rigid parts, which keep the shape of faces. Not
to be left out by an encoder alone: modes of a free beam in place of cosines, gaps in bases, the sheet's own rotation
(part of affine functions first), twins and repeats in the hierarchy, both kinds of maps.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips", nargs="*", metavar="CLIP", help=f"files CLIP.h5, or names (default: {', '.join(CLIPS)})"
    )
    parser.add_argument("--suite", choices=SUITES, help="all clips of a suite")
    parser.add_argument(
        "--bounds", type=float, nargs="+", default=list(BOUNDS), metavar="FRACTION", help="error bounds"
    )
    parser.add_argument(
        "--features", nargs="+", choices=[own.name.lower() for own in Feature], metavar="NAME", help="these alone"
    )
    add_ladder(parser, "none")


def run(args: argparse.Namespace) -> dict[str, Any]:
    wanted = [own for own in Feature if args.features is None or own.name.lower() in args.features]
    chosen = cases([] if args.suite else args.clips or CLIPS, args.suite or "quick")
    growth: dict[Feature, dict[str, float]] = {feature: {} for feature in wanted}
    broken: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        for case in chosen:
            if case.path is None:
                continue
            for bound in args.bounds:
                clip = _Sizes(case, bound, args.ladder, Path(folder), broken)
                for feature in wanted:
                    growth[feature][f"{case.name} {bound:g}"] = clip.growth(feature)
    return {
        "tables": [
            table("Features", [_summary_row(*own) for own in growth.items()], NOTE, NOT_JUDGED),
            table("Features by clip", _clip_rows(growth), NOTE),
        ],
        "broken": broken,
    }


@dataclass(frozen=True)
class _File:
    draft: Draft
    bytes: int


class _Sizes:
    """Files of one clip at one bound."""

    def __init__(self, case: Case, bound: float, ladder: tuple[float, ...], folder: Path, broken: list[str]):
        self._case, self._bound, self._ladder, self._folder, self._broken = case, bound, ladder, folder, broken
        self._whole: dict[str, _File] = {}

    def growth(self, feature: Feature) -> float:
        """Per cent of the bytes with all features."""
        options = OPTIONS.get(feature, {})
        if repr(options) not in self._whole:
            self._whole[repr(options)] = self._made(options, frozenset())
        whole = self._whole[repr(options)]
        if not _uses(whole.draft, feature):
            return 0.0
        return 100 * (self._made(options, frozenset({feature})).bytes / whole.bytes - 1)

    def _made(self, options: dict[str, Any], without: frozenset[Feature]) -> _File:
        given = {"attributes": "none", "rest_error": "bound", "ladder": self._ladder, "without": without} | options
        path = self._folder / "clip.ath"
        with athcodec.read_hdf5(self._case.path) as clip:
            plan = draft(clip, rel_error=self._bound, **given)
            summary = write(clip, plan, code_segments(clip, plan, range(plan.segment_count)), path)
            with athcodec.open(path, strict=True) as decoder:
                if measure(clip, decoder).max_error > summary.max_error_bound:
                    left_out = ", ".join(own.value for own in without)
                    self._broken.append(f"{self._case.name} at {self._bound:g} without {left_out or 'nothing'}")
        return _File(plan, summary.bytes)


def _uses(made: Draft, feature: Feature) -> bool:
    """Whether a file has the feature, as far as its settings tell."""
    choice = made.choice
    both = choice.settings, choice.first_layer
    if feature is Feature.CONNECTED:
        return choice.settings.connected_rest
    if choice.predicted is not None:
        return {Feature.PREDICTED: True, Feature.LATTICE: choice.predicted}.get(feature, False)
    return {
        Feature.ROTATIONS: any(any(own.rotation_step_factors) for own in both),
        Feature.SHAPES: any(own.learned_pieces is not None for own in both),
        Feature.TIME_BASES: any(any(own.learned_bases) for own in both),
        Feature.SHEETS: bool((choice.settings.forms == SHEET).any()),
        Feature.RINGS: bool((choice.settings.forms > SHEET).any()),
        Feature.LOOSE: bool(choice.settings.loose.any()),
        Feature.RIGID: bool(choice.settings.rigid.any()),
        Feature.FREE_RIGID: choice.settings.free_rigid,
        Feature.MEAN_POSE: choice.reference is not None,
        Feature.WIDE: True,
        Feature.JOINS: made.segment_count > 1,
        Feature.PERIODIC: choice.settings.periodic,
    }.get(feature, False)


def _summary_row(feature: Feature, growth: dict[str, float]) -> dict[str, Any]:
    values = list(growth.values())
    most = max(growth, key=lambda name: growth[name])
    return {
        "feature": feature.value,
        "name": feature.name.lower(),
        "mean %": round(sum(values) / len(values), 2),
        "least %": round(min(values), 2),
        "most %": round(max(values), 2),
        "most of": most if growth[most] > 0 else None,
        "used in": sum(value != 0 for value in values),
        "earns less": "" if max(values) >= LEAST else "x",
    }


def _clip_rows(growth: dict[Feature, dict[str, float]]) -> list[dict[str, Any]]:
    files = next(iter(growth.values()))
    return [
        {"file": name} | {feature.name.lower(): round(own[name], 2) for feature, own in growth.items()}
        for name in files
    ]
