"""What each feature of the format saves: files of many clips that do without it, one feature at a time.

The encoder searches its settings anew without the feature (athcodec.encoding.options.features), so that others may
stand in for it. A feature that a file does not use costs nothing when it is left out; that file is not made again.
Features that stand in for each other seem to save nothing so. With --alone, all features that the encoder can do
without are left out at once, and each is added back.
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
from bench.clips import add_ladder, add_number, beginning, measure
from bench.foreign import CLIPS, PROGRAMS
from bench.store import IN_BRACKETS, Store, commits
from bench.suite import SUITES, cases
from bench.tables import environment, table

RESULTS = Path(__file__).parent / "results" / "features.json"
KEYS = {"sizes": ("clip", "bound", "ladder", "feature"), "alone": ("clip", "frames", "bound", "ladder", "feature")}
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
OF_OPTIONS = frozenset(OPTIONS_WITHOUT)
NEEDS: Mapping[Feature, frozenset[Feature]] = {  # Features without which a feature has nothing to do.
    Feature.COMMON_BASIS: frozenset({Feature.TIME_BASES}),
    Feature.WAVE_BASES: frozenset({Feature.TIME_BASES}),
    Feature.FREE_RIGID: frozenset({Feature.RIGID}),
    Feature.TURN: frozenset({Feature.RIGID}),
    Feature.CONNECTED: frozenset({Feature.ADAPTIVE}),
    Feature.STAGE_0_REST: frozenset({Feature.REFINED_REST}),
}
LEAST = 3.0  # Per cent that a feature has to save on clips of MAKERS makers.
MAKERS = 2  # Makers of clips that a feature without another use has to serve.
GONE = {  # Features that the format had, and that the figures spoke against.
    "loose": "a search for loose branches",
    "lattice": "lattice points of predicted motion",
    "straight": "waves that end in straight lines",
}
USES: Mapping[Feature, str] = {  # Uses that bytes do not judge.
    Feature.RIGID: "the shape of leaves",
    Feature.TURN: "the shape of leaves",
    Feature.FREE_RIGID: "leaves that fall",
    Feature.STAGE_0_REST: "the first picture",
    Feature.REFINED_REST: "the first picture",
    Feature.HOST: "the mesh of the host",
    Feature.JOINS: "seams",
    Feature.PERIODIC: "the seam of a loop",
    Feature.ATTRIBUTES: "arrays of the source",
}
LEAST_BYTES = 500  # Smallest file in the table: a few bytes of smaller ones are many per cent.

NOTE = f"""
The columns with % say how many per cent larger files are without the feature: the mean of all files, the mean of
those that use the feature, the least and the most. The column "makers" says for how many makers a clip is {LEAST:g} %
larger or more. A file that does not use a feature counts as 0. If a number is below 0, the encoder's search ends in a
smaller file without the feature. Files have no attributes, a rest pose within the bound and, unless they are named as
such, no layers. Files for {Feature.RIGID.value}, {Feature.FREE_RIGID.value} and {Feature.TURN.value} have rest poses
that keep the shape of faces. Files for {Feature.CONNECTED.value}, {Feature.SIDES.value} and
{Feature.ATTRIBUTES.value} have all attributes. Files for {Feature.JOINS.value} and {GONE["straight"]} have segments
of {SHORT_SEGMENT} frames. Where several features are left out at once, all of this holds. Files below {LEAST_BYTES}
bytes are left out, because one byte is many per cent of them. A feature stays if it serves clips of {MAKERS} makers,
or a use that bytes do not judge.
"""

NOTE_ALONE = """
The columns with % say how many per cent larger files without any of these features are than files with one of them
alone. This is what a feature saves if no other feature stands in for it. If a feature needs other features, both
files have these. Clips are cut to their first frames.
"""

DECISIONS = f"""
"Left out" and "alone" are the most that a feature saves on clips of {MAKERS} makers, in per cent, by the two tables
above. A feature stays for its bytes if both numbers of one column are {LEAST:g} % or more. Otherwise it stays for a
use that bytes do not judge.
"""

NOT_JUDGED = """
Bytes do not judge these features: lossless levels, uneven times, loops, weights, joins, which smooth motion over
seams, leaves that fall, rigid parts and a largest step of their rotations, which keep the shape of leaves, and a rest
pose for stage 0 alone, which brings the first picture early. An encoder alone cannot leave out these: modes of a free
beam for maps, gaps in bases, the sheet's own rotation, ends first and copies in predicted motion, both kinds of maps.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bench features` to a parser: clips or a suite, error bounds, the features to leave out, and
    where results are kept.
    """
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
    add_number(parser, "--alone", 0, "add each to a file of so many first frames that has no other; 0: leave each out")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE", help="where figures are kept")
    add_ladder(parser, "none")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Encode each clip with and without each feature of the format, and store both sizes. Return the tables of what the
    features save, and the files whose error exceeds their bound.
    """
    wanted = args.features or [(feature,) for feature in Feature if not (args.alone and feature in OF_OPTIONS)]
    store, broken = Store(args.results, environment(args.argv), KEYS), []
    chosen = cases(args.clips, args.suite or "quick") if args.clips or args.suite else []
    name, frames = ("alone", {"frames": args.alone}) if args.alone else ("sizes", {})
    for case in chosen:
        for bound in args.bounds:
            ladder = " ".join(f"{error:g}" for error in args.ladder)
            key = {"clip": case.name, "bound": bound, "ladder": ladder} | frames
            missing = [each for each in wanted if not store.find(name, key | {"feature": _name(each)})]
            if case.path is None or not missing:
                continue
            with tempfile.TemporaryDirectory() as folder, athcodec.read(case.path) as clip:
                part = beginning(clip, args.alone) if args.alone else clip
                files = _Files(part, bound, args.ladder, Path(folder) / "clip.ath")
                for features in missing:
                    both = files.sizes_alone(features) if args.alone else files.sizes(features)
                    row = key | {"feature": _name(features)} | dict(zip(("with", "without"), both))
                    store.add(name, row)
                    print(f"{case.name} {bound:g} {_name(features)} {_growth(row):.2f}", file=sys.stderr, flush=True)
                broken += [f"{case.name} at {bound:g} without {left_out}" for left_out in files.broken]
    contents = store.contents()
    tables = [table("Features", summary(contents["sizes"]), NOTE, NOT_JUDGED)]
    tables.append(table("Features alone", summary(contents["alone"]), NOTE_ALONE))
    tables.append(table("What decides", decisions(contents), DECISIONS))
    return {"tables": tables, "broken": broken}


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
        self._kept: dict[tuple[str, frozenset[Feature]], tuple[Draft, int]] = {}
        self.broken: list[str] = []

    def sizes(self, features: tuple[Feature, ...]) -> tuple[int, int]:
        """Return two numbers of bytes: of the file that may use some features, made with the options of all of them,
        and of the file without these features.
        """
        feature, options = features[0], self._options(features)
        plan, size = self._file(options)
        if not any(self._uses(plan, feature) for feature in features):
            return size, size
        if feature in OPTIONS_WITHOUT:
            return size, self._file(OPTIONS_WITHOUT[feature])[1]
        return size, self._file(options, frozenset(features))[1]

    def sizes_alone(self, features: tuple[Feature, ...]) -> tuple[int, int]:
        """Return the bytes with some features and none besides but those that they need, and without them."""
        needed = frozenset().union(*(NEEDS.get(feature, frozenset()) for feature in features))
        options, left_out = self._options(features), frozenset(Feature) - OF_OPTIONS - needed
        return tuple(self._file(options, without)[1] for without in (left_out - {*features}, left_out))

    def _options(self, features: Iterable[Feature]) -> dict[str, Any]:
        """Return the options of all of some features, beside those of all files."""
        options = {name: value for each in features for name, value in OPTIONS.get(each, {}).items()}
        return {} if self._polygons is None and "rest_error" in options else options

    def _file(self, options: dict[str, Any], without: frozenset[Feature] = frozenset()) -> tuple[Draft, int]:
        """Return a file without some features, made once."""
        key = repr(options), without
        if key not in self._kept:
            self._kept[key] = self._made(options, without)
        return self._kept[key]

    def _made(self, options: dict[str, Any], without: frozenset[Feature]) -> tuple[Draft, int]:
        """Encode the clip with further `options` and without some features. Return the plan that the encoder made and
        the bytes of the file; a file whose error exceeds its bound is added to `broken`.
        """
        settings = {"attributes": "none", "rest_error": "bound", "ladder": self._ladder, "without": without} | options
        plan = draft(self._clip, rel_error=self._bound, **settings)
        coded = code_segments(self._clip, plan, range(plan.segment_count))
        summary = write(self._clip, plan, coded, self._path)
        with athcodec.open(self._path, strict=True, host_mesh=self._clip) as decoder:
            if measure(self._clip, decoder).max_error > summary.max_error_bound:
                self.broken.append(", ".join(feature.value for feature in without) or "nothing")
        return plan, summary.bytes

    def _uses(self, plan: Draft, feature: Feature) -> bool:
        """Return whether the file that a plan describes uses a feature, as far as the plan's settings tell."""
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
            Feature.STAGE_0_REST: layered,
            Feature.REFINED_REST: layered,
            Feature.WIDE: True,
            Feature.JOINS: plan.segment_count > 1,
            Feature.PERIODIC: settings.periodic,
        }.get(feature, False)


def summary(sizes: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each measured feature: by how many per cent of the bytes with it files grow without it."""
    growth: dict[str, dict[str, float]] = {}
    makers: dict[str, set[str]] = {}
    for row in sizes:
        if row["with"] < LEAST_BYTES:
            continue
        value = _growth(row)
        growth.setdefault(row["feature"], {})[_file_name(row)] = value
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


def decisions(contents: Mapping[str, Iterable[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Return, for each feature, the rows of the stored results that decide whether the feature stays in the format."""
    rows = []
    for feature in Feature:
        best = [_best_of_makers(contents[name], feature.name.lower()) for name in ("sizes", "alone")]
        saves = any(len(clips) == MAKERS and clips[-1][0] >= LEAST for clips in best)
        words = [", ".join(f"{value:.1f} {file}" for value, file in clips if value > 0) or "-" for clips in best]
        stays = ["bytes"] * saves + [USES[one] for one in (feature,) if one in USES]
        stays_for = ", ".join(stays) or "nothing"
        rows.append({"feature": feature.value, "left out": words[0], "alone": words[1], "stays for": stays_for})
    return rows


def _best_of_makers(sizes: Iterable[Mapping[str, Any]], feature: str) -> list[tuple[float, str]]:
    """Return the per cent that a feature saves at most, and the file, of those makers whose clips it serves most."""
    best: dict[str, tuple[float, str]] = {}
    for saving in sizes:
        if saving["feature"] == feature and saving["with"] >= LEAST_BYTES:
            maker, each = _maker(saving["clip"]), (_growth(saving), _file_name(saving))
            best[maker] = max(best.get(maker, each), each)
    return sorted(best.values(), reverse=True)[:MAKERS]


def _growth(row: Mapping[str, Any]) -> float:
    return 100 * (row["without"] / row["with"] - 1)


def _file_name(row: Mapping[str, Any]) -> str:
    return f"`{row['clip']}` at {_bound_name(row)}"


def _bound_name(row: Mapping[str, Any]) -> str:
    return f"{row['bound']:g}" + (" in layers" if row["ladder"] else "")


def _maker(clip: str) -> str:
    """Return the program that made a clip, or the clip's name if it is none of others."""
    return PROGRAMS[CLIPS[clip].program][0] if clip in CLIPS else clip


def _rounded(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}"


def table_text(contents: Mapping[str, Any]) -> str:
    """Return the tables of spec/rationale.md as Markdown, with the measured clips listed below each table."""
    parts = []
    for name, heading, notes in (
        ("sizes", "Left out of files that have all others", (NOTE, NOT_JUDGED)),
        ("alone", "Added to files that have no other", (NOTE_ALONE,)),
    ):
        sizes = [saving for saving in contents.get(name, []) if saving["with"] >= LEAST_BYTES]
        files: dict[str, list[str]] = {}
        for saving in sizes:
            bounds = files.setdefault(saving["clip"], [])
            bound = _bound_name(saving)
            if bound not in bounds:
                bounds.append(bound)
        clips = "; ".join(f"`{clip}` at {', '.join(bounds)}" for clip, bounds in sorted(files.items()))
        lengths = ", ".join(
            str(frames) for frames in sorted({saving["frames"] for saving in sizes if "frames" in saving})
        )
        clips += f"; the first {lengths} frames of each" if lengths else ""
        made_by = f"Commits that measured them, {IN_BRACKETS}: {commits(sizes)}."
        parts += [
            f"### {heading}",
            _markdown(summary(sizes)),
            *(" ".join(text.split()) for text in (f"Files: {clips}.", made_by, *notes)),
        ]
    parts += ["### The rows that decide", _markdown(decisions(contents)), " ".join(DECISIONS.split())]
    return "\n\n".join(parts) + "\n"


def _markdown(rows: list[dict[str, Any]]) -> str:
    """Return a table in Markdown, with numbers at the right."""
    if not rows:
        return ""
    is_text = [name in ("without", "most of", "feature", "left out", "alone", "stays for") for name in rows[0]]
    lines = ["| " + " | ".join(rows[0]) + " |", "|" + "|".join("---" if text else "--:" for text in is_text) + "|"]
    lines += ["| " + " | ".join("-" if cell is None else str(cell) for cell in row.values()) + " |" for row in rows]
    return "\n".join(lines)
