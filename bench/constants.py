"""Constants that rule the encoder: what files and work change where each is halved or doubled.

First the constants of a module are changed at once, then singly those of modules that change a file by more than the
limits below, on the clips that changed. Every figure is stored as it is measured, and is not measured again; a run that
was stopped goes on.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import sys
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

import athcodec
from athcodec.encoding.search import progress
from athcodec.files.shown import counted
from bench.clips import add_number, add_rel_error, beginning
from bench.store import Store, commits
from bench.suite import cases
from bench.tables import environment, table

RESULTS = Path(__file__).parent / "results" / "constants.json"
KEYS = {"files": ("clip", "frames", "bound", "constants", "factor")}
FOLDERS = ("athcodec.encoding", "athcodec.motion.branches")
CLIPS = (  # Clips of different makers. None is held out.
    "helios_rice_8d",
    "blender_bent_grass",
    "mujoco_cable_vine",
    "cplantbox_maize",
    "shader_card_tree",
    "lsystem_fern",
    "scan_skeleton_tree",
    "skfem_leaf",
)
FRAMES = 8  # First frames of a clip that are encoded.
FACTORS = (0.5, 2.0)
BYTES_LIMIT, WORK_LIMIT = 0.005, 0.05  # Shares by which a constant that matters changes a file or its work.
SINGLY = "no group first; clips behind one that a constant moves are not measured with it"
NONE = ""  # The name of the run in which nothing is changed.
# What is no choice: numbers that FORMAT.md, a type or an option fixes, weights of work that were measured with a clock,
# the limit of work itself, and what changes no file: sizes of buffers, and limits of warnings and refusals.
FIXED: Mapping[str, Sequence[str]] = {
    "progress": (
        *("READING", "POSES", "SURVEY", "MOTION", "ANALYSIS", "PREDICTION", "MAPS", "TURNS", "TRIAL", "BYTE"),
        *("FILE_BYTE", "CORRECTION", "MAP_FIT", "STAGE_MOTION", "START", "POSE", "REST", "PIECE", "BASIS", "COMPONENT"),
        *("EIGENVECTOR", "FINDING", "LEARNT", "LEARNING", "LEAST_WORK", "WORK", "SMALL_TRIALS", "BRANCHES", "SIZES"),
    ),
    "assembly": ("SPOOL_BYTES",),
    "decisions": ("CHUNK_BYTES", "LEVEL_BYTES", "REFUSAL_ROUNDS"),
    "joins": ("END_FRAMES", "WIDTHS", "SLOPED", "TURN"),
    "layers": ("MOST_LAYERS", "MOST_LEVELS", "LARGEST", "RMS", "ROUNDED"),
    "levels": ("ENDS",),
    "motion": ("LEARNED_NUMBERS", "NO_ROOT", "RANGES", "LEAST_RANGE", "LARGE_BYTES"),
    "rigid": ("MOST_TURN",),
    "rings": ("LEAST_RING", "LARGEST_RING"),
    "quantise": (
        *("LARGEST_MODE", "SMALLEST_BOUND", "LARGEST_EXTENT", "SAFE_REST_CAP", "LATTICE_REST_CAP", "BIT_PARTS"),
        *("MOST_LAG", "MESH"),
    ),
    "places": ("MIXER",),
    "segment": ("ROWS_AT_ONCE", "LEAST_THREADED", "WORK_BYTES", "SEGMENT_WORK"),
    "segment_samples": ("SPAN",),
    "segmentation": ("SEGMENT_BYTES",),
    "settings": ("BEAM",),
    "shape": ("WHOLE_DETAIL", "MOST_DETAIL"),
    "streams": ("FIRST", "LAST"),
    "survey": ("MAX_DEPTH", "_READ_VALUES", "_WORK_VERTICES"),
    "time_bases": ("LEAST_STEP", "MOST_STEP", "MOST_SAMPLE"),
    "trials": ("PRELUDES_KEPT", "PRELUDE_BYTES"),
    "writing": ("BY_STEP", "BY_RATE", "ONE_BY_ONE", "IS_HOST", "_IS_CONNECTED", "_IS_MIXED", "_IS_DERIVED"),
    "preparation": ("MOST_LOST",),
    "polygons": ("PLACES_IN_ROWS", "CORNERS_OF_REST", "FACES_OF_REST", "MESH_PARTS"),
    "attachment": ("QUERY",),
    "bodies": ("ROWS_AT_ONCE",),
    "steady": ("PAIRS_AT_ONCE",),
    "price": ("AT_ONCE",),
}

NOTE = f"""
Constants of {" and ".join(FOLDERS)} that were found by trial: numbers, or rows of numbers, at the top of a module,
but those that the format fixes, sizes of buffers and measured weights of work. Bytes and work: largest change of any
clip, in per cent, where the constant is halved and doubled. Moves: a file by more than {100 * BYTES_LIMIT:g} % or its
work by more than {100 * WORK_LIMIT:g} %. Fails: no file could be made so. Work is counted, not timed. The clips are
small; rules for large plants, several clips, loops and weights have no part in them.
"""


@dataclass(frozen=True)
class Constant:
    """A number, or a row of numbers, that has a name at the top of a module."""

    module: str
    name: str
    value: Any

    @property
    def full_name(self) -> str:
        return f"{self.module.removeprefix('athcodec.')}.{self.name}"

    def scaled(self, factor: float) -> Any:
        """Return the value times a factor; a whole number stays one, and at least 1."""
        if isinstance(self.value, tuple):
            return tuple(_scaled(one, factor) for one in self.value)
        return _scaled(self.value, factor)


def _scaled(value: float, factor: float) -> float:
    if isinstance(value, int):
        return max(1, round(value * factor)) if value > 0 else value
    return value * factor


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("clips", nargs="*", metavar="CLIP", default=[], help="files, or names of clips")
    parser.add_argument("--modules", nargs="+", metavar="NAME", help="constants of these modules alone")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE", help="where figures are kept")
    parser.add_argument("--singly", action="store_true", help=SINGLY)
    add_number(parser, "--frames", FRAMES, "first frames of each clip")
    add_number(parser, "--seconds", 1500.0, "processor time after which no other figure is measured", "S")
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Halve and double each numeric constant of the encoder, module by module and then one by one, and encode the clips
    with it. Return tables of what files and work change.
    """
    warnings.simplefilter("ignore")
    known = [one for one in constants() if args.modules is None or one.module.rpartition(".")[2] in args.modules]
    groups: dict[str, list[Constant]] = {}
    for one in known:
        groups.setdefault(_module(one), []).append(one)
    with _Files(args) as files:
        for name, members in groups.items():
            _measure_singly(files, name, members) if args.singly else _measure_group(files, name, members)
    rows = [row for name, members in groups.items() for row in _rows(files, name, members)]
    modules = [_row(files, name, name) | {"constants": len(members)} for name, members in groups.items()]
    counts = {"constants": len(rows)} | Counter(row["moves"] for row in rows)
    tables = [table("Constants", rows, NOTE), table("Modules", modules), table("Counts", [counts])]
    return {"tables": tables, "broken": []}


def _measure_group(files: _Files, group: str, members: Sequence[Constant]) -> None:
    """Measure all constants of the module `group` at once, then each by itself on the clips that changed."""
    for factor in FACTORS:
        moved = [clip for clip in files.clips if files.moves(group, members, factor, clip)]
        for one, clip in product(members if len(members) > 1 else (), moved):
            files.moves(one.full_name, [one], factor, clip)


def _measure_singly(files: _Files, group: str, members: Sequence[Constant]) -> None:
    """Measure each constant of the module `group` by itself, until one of the clips changes."""
    for one in members:
        name = one.full_name if len(members) > 1 else group
        any(files.moves(name, [one], factor, clip) for clip, factor in product(files.clips, FACTORS))


@cache
def constants() -> tuple[Constant, ...]:
    """Return all numeric constants of the encoder's modules, sorted by module."""
    numbers = []
    for folder in FOLDERS:
        package = import_module(folder)
        root = Path(inspect.getfile(package)).parent
        for file in sorted(root.rglob("*.py")):
            words = file.relative_to(root).with_suffix("").parts
            if words[-1] == "__init__":
                continue
            module = import_module(".".join((folder, *words)))
            fixed = FIXED.get(words[-1], ())
            for name in _top_names(module):
                value = getattr(module, name)
                if name not in fixed and _is_number(value):
                    numbers.append(Constant(module.__name__, name, value))
    return tuple(numbers)


def _is_number(value: Any) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(map(_is_number, value))
    return isinstance(value, (int, float)) and not isinstance(value, bool)


@cache
def _tree(module: ModuleType) -> ast.Module:
    return ast.parse(inspect.getsource(module))


@cache
def _imports(module: ModuleType) -> tuple[ast.ImportFrom, ...]:
    return tuple(node for node in ast.walk(_tree(module)) if isinstance(node, ast.ImportFrom))


def _top_names(module: ModuleType) -> list[str]:
    """Return the upper-case names that a module assigns at its top."""
    targets = [target for node in _tree(module).body if isinstance(node, ast.Assign) for target in node.targets]
    names = [part for target in targets for part in (target.elts if isinstance(target, ast.Tuple) else [target])]
    return [name.id for name in names if isinstance(name, ast.Name) and name.id.strip("_").isupper()]


@contextmanager
def changed(some: Iterable[Constant], factor: float) -> Iterator[None]:
    """Multiply constants by `factor` while the context lasts: in their own modules, in modules that import them by
    name, and in the defaults of functions.
    """
    before: list[tuple[Any, str, Any]] = []
    try:
        for one in some:
            value = one.scaled(factor)
            for module, name in _places(one):
                before.append((module, name, getattr(module, name)))
                setattr(module, name, value)
            for function, index in _defaults(one):
                usual = function.__defaults__
                before.append((function, "__defaults__", usual))
                function.__defaults__ = (*usual[:index], value, *usual[index + 1 :])
        yield
    finally:
        for owner, name, value in reversed(before):
            setattr(owner, name, value)


@cache
def _places(constant: Constant) -> tuple[tuple[ModuleType, str], ...]:
    """Return the pairs of module and name under which the package refers to a constant."""
    places = [(sys.modules[constant.module], constant.name)]
    for name, module in list(sys.modules.items()):
        if name.startswith("athcodec.") and getattr(module, "__file__", None):
            for node in _imports(module):
                if node.module == constant.module:
                    places += [(module, one.asname or one.name) for one in node.names if one.name == constant.name]
    return tuple(places)


@cache
def _defaults(constant: Constant) -> tuple[tuple[Any, int], ...]:
    """Return pairs of a function of the constant's module that has the constant as a default value, and the index of
    that value among the function's defaults.
    """
    module = sys.modules[constant.module]
    return tuple(
        (getattr(module, node.name), index)
        for node in _tree(module).body
        if isinstance(node, ast.FunctionDef)
        for index, default in enumerate(node.args.defaults)
        if isinstance(default, ast.Name) and default.id == constant.name
    )


class _Files:
    """Files of all clips with constants changed, measured once."""

    def __init__(self, args: argparse.Namespace):
        self._args, self._store = args, Store(args.results, environment(args.argv), KEYS)
        self.clips: dict[str, athcodec.MotionClip] = {}

    def __enter__(self) -> _Files:
        for case in cases(self._args.clips or CLIPS, "quick"):
            if case.path is not None:
                with athcodec.read(case.path) as clip:
                    self.clips[case.name] = beginning(clip, self._args.frames)
        return self

    def __exit__(self, *error: object) -> None:
        self.clips.clear() if any(error) else None

    def moves(self, name: str, some: Sequence[Constant], factor: float, clip: str) -> bool:
        """Measure a clip's file with some constants changed, and return whether it or its work is another."""
        if self.find(NONE, 1.0, clip) is None:
            self._measure(NONE, (), 1.0, clip)
        if self.find(name, factor, clip) is None and time.process_time() < self._args.seconds:
            self._measure(name, some, factor, clip)
        change = self.change(name, factor, clip)
        return change is not None and _is_above(change)

    def find(self, name: str, factor: float, clip: str) -> dict[str, Any] | None:
        return self._store.find("files", self._key(name, factor, clip))

    def change(self, name: str, factor: float, clip: str) -> tuple[float, float] | None:
        """Return the shares by which bytes and work change, infinite where no file was made; None: not measured."""
        usual, other = self.find(NONE, 1.0, clip), self.find(name, factor, clip)
        if usual is None or other is None:
            return None
        if other["bytes"] is None:
            return float("inf"), float("inf")
        return other["bytes"] / usual["bytes"] - 1, other["work"] / usual["work"] - 1

    def _key(self, name: str, factor: float, clip: str) -> dict[str, Any]:
        bound = self._args.rel_error
        return {"clip": clip, "frames": self._args.frames, "bound": bound, "constants": name, "factor": factor}

    def _measure(self, name: str, some: Sequence[Constant], factor: float, clip: str) -> None:
        """Encode a clip with some constants multiplied by `factor`, and store its bytes (None if encoding fails), work
        and seconds under `name`.
        """
        total, start = _Total(), time.process_time()
        size: int | None = None
        with changed(some, factor), patch.object(progress.Work, "add", total.adding(progress.Work.add)):
            try:
                size = len(athcodec.encode(self.clips[clip], rel_error=self._args.rel_error))
            except Exception as error:  # Whatever a senseless number leads to is a result.
                print(f"{name} x {factor:g}, {clip}: {error}", file=sys.stderr)
        figures = {"bytes": size, "work": total.work, "seconds": round(time.process_time() - start, 2)}
        self._store.add("files", self._key(name, factor, clip) | figures)
        print(name, factor, clip, self.change(name, factor, clip), file=sys.stderr, flush=True)


class _Total:
    """The sum of all counted work."""

    def __init__(self) -> None:
        self.work = 0

    def adding(self, add):
        """Return the method of Work that counts, which counts here too."""

        def noted(work: progress.Work, more: float) -> None:
            self.work += int(more)
            add(work, more)

        return noted


def _is_above(change: tuple[float, float]) -> bool:
    return abs(change[0]) > BYTES_LIMIT or abs(change[1]) > WORK_LIMIT


def _rows(files: _Files, group: str, members: Sequence[Constant]) -> list[dict[str, Any]]:
    """Return a row for each constant of the module `group`. Where the module's constants together change no file, none
    is measured alone and all get the module's row.
    """
    rows = []
    for one in members:
        row = _row(files, one.full_name if len(members) > 1 else group, one.full_name)
        if row["moves"] == "not measured" and _row(files, group, group)["moves"] == "no":
            row["moves"] = "no"
        rows.append(row | {"value": str(one.value)})
    return rows


def _row(files: _Files, name: str, title: str) -> dict[str, Any]:
    """Return the table's row of a constant or module `name`, shown as `title`: the largest change of bytes and work in
    per cent when it is halved and doubled, and whether it changes any file at all.
    """
    row: dict[str, Any] = {"constant": title}
    all_changes = []
    for factor, word in zip(FACTORS, ("halved", "doubled")):
        changes = [change for clip in files.clips if (change := files.change(name, factor, clip)) is not None]
        for index, kind in enumerate(("bytes", "work")):
            largest = max((change[index] for change in changes), key=abs, default=None)
            row[f"{word}: {kind} %"] = None if largest in (None, float("inf")) else 100 * largest
        all_changes += changes
    if any(change[0] == float("inf") for change in all_changes):
        row["moves"] = "fails"
    elif not all_changes:
        row["moves"] = "not measured"
    else:
        row["moves"] = "yes" if any(map(_is_above, all_changes)) else "no"
    return row


def left_text(contents: Mapping[str, Any]) -> str:
    """Return sentences for a document: how many constants the encoder has, and for how many of them halving or doubling
    changes files, by the stored results.
    """
    usual, largest = {}, defaultdict(list)
    for row in contents["files"]:
        if row["constants"] == NONE:
            usual[_panel(row)] = row
    for row in contents["files"]:
        if row["constants"] != NONE:
            largest[row["constants"]].append(_is_moved(row, usual[_panel(row)]))
    verdicts = Counter(_verdict(one, largest) for one in constants())
    panels = defaultdict(set)
    for clip, frames, bound in usual:
        panels[frames, bound].add(clip)
    clips = "; ".join(
        f"{counted(len(names), 'clip')} of {frames} frames at {bound:g}"
        for (frames, bound), names in sorted(panels.items())
    )
    words = ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in VERDICTS if verdicts[verdict])
    modules = sum(1 for name in largest if name in {_module(one) for one in constants()})
    return (
        f"{len(constants())} constants are left: {words}. Measured: {modules} modules, "
        f"{len(largest) - modules} constants by themselves, on {clips} (commits {commits(contents['files'])})."
    )


VERDICTS = (  # What stored figures say of constants.
    f"move a file by more than {100 * BYTES_LIMIT:g} % or its work by more than {100 * WORK_LIMIT:g} % by themselves",
    "move neither",
    "are of a module that moves one and have not been measured by themselves",
    "have not been measured",
)


def _verdict(one: Constant, moved: Mapping[str, Sequence[bool]]) -> str:
    """Return the word of VERDICTS that says whether a constant changes any file. `moved` has, by the name of a constant
    or module, whether each measured file changed.
    """
    by_itself, as_module = moved.get(one.full_name), moved.get(_module(one))
    if by_itself is not None:
        return VERDICTS[0] if any(by_itself) else VERDICTS[1]
    if as_module is None:
        return VERDICTS[3]
    is_alone = sum(_module(other) == _module(one) for other in constants()) == 1
    return VERDICTS[1] if not any(as_module) else VERDICTS[0] if is_alone else VERDICTS[2]


def _module(one: Constant) -> str:
    return one.full_name.removesuffix(f".{one.name}")


def _panel(row: Mapping[str, Any]) -> tuple[str, int, float]:
    return row["clip"], row["frames"], row["bound"]


def _is_moved(row: Mapping[str, Any], usual: Mapping[str, Any]) -> bool:
    if row.get("bytes") is None:
        return True
    return _is_above((row["bytes"] / usual["bytes"] - 1, row["work"] / usual["work"] - 1))
