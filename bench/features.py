"""What each feature of the format saves: files of many clips that do without it, one feature at a time.

The encoder searches its settings anew without the feature (athcodec.encoding.options.features), so that others may
stand in for it. A feature that a file does not use costs nothing when it is left out; that file is not made again.
Every figure is saved as it is measured, and is not measured again.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec._native import SHEET
from athcodec.encoding import Draft, code_segments, draft, write
from athcodec.encoding.options.features import Feature
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.branch_trials import best_branches
from athcodec.encoding.search.progress import Work
from athcodec.motion.branches.result import with_branches
from athcodec.motion.polygons import Polygons
from bench.clips import add_ladder, measure
from bench.foreign import CLIPS, PROGRAMS
from bench.store import IN_BRACKETS, Store, commits
from bench.suite import SUITES, cases
from bench.tables import environment, table

RESULTS = Path(__file__).parent / "results" / "features.json"
KEYS = {"sizes": ("clip", "bound", "ladder", "feature")}
BOUNDS = (1e-3, 1e-4)
SHORT_SEGMENT = 32  # Frames of the segments of files that are to meet.
OPTIONS: Mapping[Feature, dict[str, Any]] = {  # Options, beside those of all files, that make a file have the feature.
    Feature.RIGID: {"rest_error": None},
    Feature.FREE_RIGID: {"rest_error": None},
    Feature.TURN: {"rest_error": None},
    Feature.CONNECTED: {"attributes": "all"},
    Feature.SIDES: {"attributes": "all"},
    Feature.ATTRIBUTES: {"attributes": "all"},
    Feature.JOINS: {"segment_frames": SHORT_SEGMENT},
    Feature.HOST: {"host_rest": True},
}
# Options of the file without a feature that no search omits.
OPTIONS_WITHOUT: Mapping[Feature, dict[str, Any]] = {Feature.HOST: {}, Feature.ATTRIBUTES: {}}
LEAST = 3.0  # Per cent that a feature has to save on clips of MAKERS makers.
MAKERS = 2  # Makers of clips that a feature without another use has to serve.
GONE = {  # Features that the format had, and that the figures spoke against.
    "loose": "a search for loose branches",
    "lattice": "lattice points of predicted motion",
    "straight": "waves that end in straight lines",
}
LEAST_BYTES = 500  # Smallest file in the table: a few bytes of smaller ones are many per cent.

NOTE = f"""
How many per cent larger files are without the feature: the mean of all files, the mean of those that use it, the least
and the most; makers: of how many makers a clip is {LEAST:g} % larger or more. A file that does not use a feature counts
as 0; below 0 the search ends in a smaller file without. Files have no attributes, a rest pose of the bound and, unless
they are named as such, no layers. Those for {Feature.RIGID.value}, {Feature.FREE_RIGID.value} and {Feature.TURN.value}
have rest poses that keep faces, those for {Feature.CONNECTED.value}, {Feature.SIDES.value} and
{Feature.ATTRIBUTES.value} all attributes, those for {Feature.JOINS.value} and {GONE["straight"]} segments of
{SHORT_SEGMENT} frames; where several are left out at once, all of these. Files below {LEAST_BYTES} bytes, of which a
byte is many per cent, are left out. A feature stays that serves clips of {MAKERS} makers, or a use that bytes do not
judge.
"""

NOT_JUDGED = """
Not judged by bytes: lossless levels, uneven times, loops, weights, joins, which smooth motion over seams, rigid parts
and a largest step of their rotations, which keep the shape of leaves, and a rest pose for level 0 alone, by which the
first picture comes early. Not to be left out by an encoder alone: modes of a free beam for maps, gaps in
bases, the sheet's own rotation, ends first and copies in predicted motion, both kinds of maps.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips", nargs="*", metavar="CLIP", help="files, or names of clips (default: print the figures that are kept)"
    )
    parser.add_argument("--suite", choices=SUITES, help="all clips of a suite")
    parser.add_argument(
        "--bounds", type=float, nargs="+", default=list(BOUNDS), metavar="FRACTION", help="error bounds"
    )
    parser.add_argument(
        "--features",
        nargs="+",
        type=_features,
        metavar="NAME",
        help="features to leave out (default: each of all); A+B leaves out both at once",
    )
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE", help="where figures are kept")
    add_ladder(parser, "none")


def run(args: argparse.Namespace) -> dict[str, Any]:
    wanted = args.features or [(feature,) for feature in Feature]
    store, broken = Store(args.results, environment(args.argv), KEYS), []
    chosen = cases(args.clips, args.suite or "quick") if args.clips or args.suite else []
    for case in chosen:
        for bound in args.bounds:
            key = {"clip": case.name, "bound": bound, "ladder": " ".join(f"{error:g}" for error in args.ladder)}
            missing = [own for own in wanted if not store.find("sizes", key | {"feature": _name(own)})]
            if case.path is None or not missing:
                continue
            with tempfile.TemporaryDirectory() as folder, athcodec.read(case.path) as clip:
                files = _Files(clip, bound, args.ladder, Path(folder) / "clip.ath")
                for features in missing:
                    sizes = dict(zip(("with", "without"), files.sizes(features)))
                    store.add("sizes", key | {"feature": _name(features)} | sizes)
                    growth = 100 * (sizes["without"] / sizes["with"] - 1)
                    print(f"{case.name} {bound:g} {_name(features)} {growth:.2f}", file=sys.stderr, flush=True)
                broken += [f"{case.name} at {bound:g} without {name}" for name in files.broken]
    sizes = store.contents()["sizes"]
    return {"tables": [table("Features", summary(sizes), NOTE, NOT_JUDGED)], "broken": broken}


def _features(word: str) -> tuple[Feature, ...]:
    """Return the features whose names are joined by +."""
    known = {feature.name.lower(): feature for feature in Feature}
    if unknown := set(word.split("+")) - known.keys():
        raise argparse.ArgumentTypeError(f"got {', '.join(unknown)}; expected {', '.join(known)}")
    return tuple(known[name] for name in word.split("+"))


def _name(features: tuple[Feature, ...]) -> str:
    return "+".join(feature.name.lower() for feature in features)


class _Files:
    """Files of one clip at one bound."""

    def __init__(self, clip: athcodec.MotionClip, bound: float, ladder: tuple[float, ...], path: Path):
        if not clip.has_branches:
            clip = with_branches(clip, best_branches(clip, BoundOption(rel_error=bound), Work())[0])
        self._clip, self._bound, self._ladder, self._path = clip, bound, ladder, path
        self._polygons = Polygons.of_attributes(clip.attributes) if clip.faces is None else Polygons.of_rows(clip.faces)
        self._whole: dict[str, tuple[Draft, int]] = {}
        self.broken: list[str] = []

    def sizes(self, features: tuple[Feature, ...]) -> tuple[int, int]:
        """Return the bytes with some features, by the options of all of them, and without them."""
        feature = features[0]
        options = {name: value for each in features for name, value in OPTIONS.get(each, {}).items()}
        if self._polygons is None and "rest_error" in options:
            options = {}
        plan, size = self._with_all(options)
        if not any(self._uses(plan, feature) for feature in features):
            return size, size
        if feature in OPTIONS_WITHOUT:
            return size, self._with_all(OPTIONS_WITHOUT[feature])[1]
        return size, self._made(options, frozenset(features))[1]

    def _with_all(self, options: dict[str, Any]) -> tuple[Draft, int]:
        """Return the file that has all features, made once."""
        if repr(options) not in self._whole:
            self._whole[repr(options)] = self._made(options, frozenset())
        return self._whole[repr(options)]

    def _made(self, options: dict[str, Any], without: frozenset[Feature]) -> tuple[Draft, int]:
        settings = {"attributes": "none", "rest_error": "bound", "ladder": self._ladder, "without": without} | options
        plan = draft(self._clip, rel_error=self._bound, **settings)
        coded = code_segments(self._clip, plan, range(plan.segment_count))
        summary = write(self._clip, plan, coded, self._path)
        with athcodec.open(self._path, strict=True, host_mesh=self._clip) as decoder:
            if measure(self._clip, decoder).max_error > summary.max_error_bound:
                self.broken.append(", ".join(feature.value for feature in without) or "nothing")
        return plan, summary.bytes

    def _uses(self, plan: Draft, feature: Feature) -> bool:
        """Return whether a file has the feature, as far as its settings tell."""
        choice, is_host = plan.choice, plan.options.host_rest
        settings, both = choice.settings, (choice.settings, choice.first_layer)
        layered = choice.first_layer.bound > settings.bound
        of_all = {
            Feature.HOST: is_host,
            Feature.ATTRIBUTES: bool(self._clip.attributes) or self._polygons is not None,
            Feature.SIDES: self._polygons is not None,
            Feature.ADAPTIVE: bool(settings.lags.any()) or settings.connected_rest,
            Feature.CONNECTED: settings.connected_rest,
            Feature.COPIES: settings.shape_of is not None,
            Feature.REPEATS: bool(np.any(plan.seen.repeats)),
            Feature.PREDICTED: choice.predicted,
        }
        if feature in of_all:
            return of_all[feature]
        if choice.predicted:
            return False
        learned = any(any(settings_of_file.learned_bases) for settings_of_file in both)
        return {
            Feature.ROTATIONS: any(any(settings_of_file.rotation_step_factors) for settings_of_file in both),
            Feature.SHAPES: any(settings_of_file.learned_pieces is not None for settings_of_file in both),
            Feature.TIME_BASES: learned,
            Feature.COMMON_BASIS: any(settings_of_file.common_basis for settings_of_file in both),
            Feature.WAVE_BASES: learned,
            Feature.SHEETS: bool((settings.forms == SHEET).any()),
            Feature.RINGS: bool((settings.forms > SHEET).any()),
            Feature.STILL: settings.still,
            Feature.RIGID: bool(settings.rigid.any()),
            Feature.FREE_RIGID: settings.free_rigid,
            Feature.TURN: settings.turn_step > 0,
            Feature.MEAN_POSE: choice.reference is not None,
            Feature.LEVEL_0_REST: layered,
            Feature.REFINED_REST: layered,
            Feature.WIDE: True,
            Feature.JOINS: plan.segment_count > 1,
            Feature.PERIODIC: settings.periodic,
        }.get(feature, False)


def summary(sizes: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each feature that was measured, in per cent of the bytes with it."""
    growth: dict[str, dict[str, float]] = {}
    makers: dict[str, set[str]] = {}
    for row in sizes:
        if row["with"] < LEAST_BYTES:
            continue
        name = f"`{row['clip']}` at {row['bound']:g}" + (" in layers" if row["ladder"] else "")
        value = 100 * (row["without"] / row["with"] - 1)
        growth.setdefault(row["feature"], {})[name] = value
        makers.setdefault(row["feature"], set()).update({_maker(row["clip"])} if value >= LEAST else ())
    rows = []
    titles = {feature.name.lower(): feature.value for feature in Feature} | GONE
    for name in [name for name in titles if name in growth] + sorted(growth.keys() - titles.keys()):
        values = growth[name]
        used, most = [value for value in values.values() if value], max(values, key=lambda file: values[file])
        rows.append(
            {
                "without": titles.get(name) or " and ".join(titles[part] for part in name.split("+")),
                "files": len(values),
                "use it": len(used),
                "mean %": _rounded(np.mean(list(values.values()))),
                "mean of these %": _rounded(np.mean(used)) if used else None,
                "least %": _rounded(min(values.values())),
                "most %": _rounded(values[most]),
                "most of": most if values[most] > 0 else "",
                "makers": len(makers[name]),
            }
        )
    return rows


def _maker(clip: str) -> str:
    """Return the program that made a clip, or the clip's name if it is none of others."""
    return PROGRAMS[CLIPS[clip].program][0] if clip in CLIPS else clip


def _rounded(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}"


def table_text(contents: Mapping[str, Any]) -> str:
    """Return the table of spec/rationale.md: Markdown, with the clips that were measured below."""
    sizes = contents["sizes"]
    rows = summary(sizes)
    lines = ["| " + " | ".join(rows[0]) + " |", "|---|--:|--:|--:|--:|--:|--:|---|--:|"] if rows else []
    lines += ["| " + " | ".join("-" if cell is None else str(cell) for cell in row.values()) + " |" for row in rows]
    files: dict[str, list[str]] = {}
    for size_row in sizes:
        if size_row["with"] < LEAST_BYTES:
            continue
        bounds = files.setdefault(size_row["clip"], [])
        name = f"{size_row['bound']:g}" + (" in layers" if size_row["ladder"] else "")
        if name not in bounds:
            bounds.append(name)
    clips = "; ".join(f"`{clip}` at {', '.join(bounds)}" for clip, bounds in sorted(files.items()))
    made_by = f"Commits that measured them, {IN_BRACKETS}: {commits(sizes)}."
    paragraphs = [" ".join(text.split()) for text in (f"Files: {clips}.", made_by, NOTE, NOT_JUDGED)]
    return "\n\n".join(["\n".join(lines), *paragraphs]) + "\n"
