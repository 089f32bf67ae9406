"""The clip in a file of named arrays: HDF5 (hdf5.py), NumPy (npz.py, npy.py) and MATLAB (mat.py). It opens no files.

A file of athcodec's schema has `positions` and what hdf5.py lists. In a file of another program the positions are the
array that options.dataset names, else the one that can be meant; a GuessWarning says which was taken. What belongs to
them is looked for in their group, then in the groups above it. If the schema's `time` and `fps` are missing, times and
rates of other names are taken, and said. Arrays of a group are kept under their names in it.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypedDict

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.plain import FilePath
from athcodec.motion.clip import RESERVED_NAMES, MotionClip, frame_rate, stated_fps
from athcodec.motion.hierarchy import branch_orders
from athcodec.motion.joining import read_clip_metadata
from athcodec.motion.positions import (
    FRAMES,
    Order,
    conflicts,
    facts_of,
    in_floats,
    is_possible,
    looks_turned,
    order_of,
    order_of_labels,
    seconds_of_dates,
    turned_advice,
)
from athcodec.motion.units import METRES, unit_symbol
from athcodec.sources import ReadOptions
from athcodec.untyped import ArrayLike, JsonMapping, JsonObject

POSITIONS = "positions"
BRANCHES = ("vertex_branch", "branch_parent", "stem_index")
ROWS = ("time", *BRANCHES)  # Arrays of one dimension, which some programs store as a row or a column.
SCALARS = ("fps", "start_frame", "unit", "up_axis")  # Metadata that may be arrays of one item.
POSITION_NAMES = frozenset("positions position pos points vertices verts coordinates coords xyz nodes".split())
TIME_NAMES = frozenset("time times t timestamps timestamp seconds".split())
RATE_NAMES = frozenset("fps framerate framespersecond rate samplerate samplingrate frequency freq".split())
STEP_NAMES = frozenset("dt deltat timestep frametime frameinterval sampleinterval".split())
SECONDS = {  # By the names of units of time, the seconds that each is.
    **dict.fromkeys("s sec secs second seconds".split(), 1.0),
    **dict.fromkeys("ms msec millisecond milliseconds".split(), 1e-3),
    **dict.fromkeys("us µs usec microsecond microseconds".split(), 1e-6),
    **dict.fromkeys("ns nanosecond nanoseconds".split(), 1e-9),
    **dict.fromkeys("min mins minute minutes".split(), 60.0),
    **dict.fromkeys("h hr hrs hour hours".split(), 3600.0),
    **dict.fromkeys("d day days".split(), 86400.0),
}
LISTED, SHOWN = 12, 80  # Arrays that a message names, and characters of a name.
# Kinds in not_read: arrays of another clip in the file, and what a file says of an array.
OTHER_CLIP, NOTE = "dataset", "note of a dataset"


@dataclass(frozen=True)
class Stored:
    """An array in a file, as the program that wrote it sees it: its path, shape and dtype."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype

    def __str__(self) -> str:
        return f"{self.shown} {self.shape} {str(self.dtype)[:40]}"

    @property
    def shown(self) -> str:
        """The name as messages have it."""
        return one_line(self.name) or "an array"


class Arrays(Protocol):
    """The named arrays of a file, none of which has been read; groups are separated by a slash.

    stored         the arrays, by name
    metadata       what the file says besides, as in MotionClip
    not_read       what it holds that is no array, by kind
    counts_from_1  whether the program that wrote it numbers vertices from 1
    """

    @property
    def stored(self) -> Mapping[str, Stored]: ...
    @property
    def metadata(self) -> JsonObject: ...
    @property
    def not_read(self) -> dict[str, list[str]]: ...
    @property
    def counts_from_1(self) -> bool: ...

    def read(self, name: str) -> np.ndarray:
        """Return the whole array."""

    def positions(self, name: str, order: Order) -> ArrayLike:
        """Return (T, N, 3) frames of an array whose axes have this order, read when they are sliced."""

    def notes(self, name: str) -> JsonMapping:
        """Return what the file says of an array, or of a group."""

    def labels(self, name: str) -> Sequence[str]:
        """Return names of the dimensions of an array, as far as the file states them."""


def clip_of_arrays(arrays: Arrays, path: FilePath, options: ReadOptions, **watched: Any) -> MotionClip:
    """Return the clip of a file's arrays.

    watched: resource and unchanged as in MotionClip. Raises ClipError, which lists the arrays where none, or several,
    can be the positions.
    """
    return _Clip(arrays, path, options).made(**watched)


def one_line(name: str) -> str:
    """Return a name as messages of one line can have it."""
    return name[:SHOWN] if name.isprintable() else repr(name[:SHOWN])


def listing(stored: Mapping[str, Stored]) -> str:
    """Return the arrays of a file with their shapes and types, for messages."""
    shown = [f"/{each}" if "/" in each.name else str(each) for each in list(stored.values())[:LISTED]]
    more = f" and {len(stored) - LISTED} more" if len(stored) > LISTED else ""
    return f"the file has {', '.join(shown)}{more}" if stored else "the file has no arrays"


class BranchFields(TypedDict, total=False):
    """The fields of a MotionClip that say what its branches are."""

    vertex_branch: np.ndarray | None
    branch_parent: np.ndarray | None
    stem_index: np.ndarray | None


@dataclass
class _Clip:
    """What is taken from a file, one after the other."""

    arrays: Arrays
    path: FilePath
    options: ReadOptions
    used: dict[str, str] = field(default_factory=dict)  # By name in the schema, the array that was taken.
    not_read: dict[str, list[str]] = field(default_factory=dict)
    loaded: dict[str, np.ndarray] = field(default_factory=dict)

    def made(self, **watched: Any) -> MotionClip:
        """Return the clip of the file's arrays. `watched` are further fields of MotionClip. Raises ClipError."""
        self.not_read = {kind: list(names) for kind, names in self.arrays.not_read.items()}
        self.used[POSITIONS] = name = self._chosen()
        metadata = self._metadata(name)
        known = self._of_schema()
        order = self._order(name, known)
        positions, converted = in_floats(self.arrays.positions(name, order))
        if converted:
            self._warn(converted)
        facts = self._facts(known)
        if self.options.axes is None and looks_turned(positions, facts):
            self._warn(turned_advice(positions.shape))
        time = self._times(known, metadata, positions.shape[0])
        attributes = self._further(name)
        try:
            clip = MotionClip(
                positions,
                time,
                **self.options.rest_fields(known["rest"]),
                edges=known["edges"],
                faces=known["faces"],
                attributes=attributes,
                metadata=metadata,
                not_read=self.not_read,
                **_branches(positions, known, metadata, self.options),
                **watched,
            )
        except ClipError as error:
            if not conflicts(positions.shape, facts):
                raise
            raise ClipError(f"{error}; {listing(self.arrays.stored)}") from None
        depths = None if clip.branch_parent is None else branch_orders(clip.branch_parent)
        if depths is not None and np.array_equal(clip.attributes.get("branch_order", ()), depths):
            del clip.attributes["branch_order"]
        read_clip_metadata(clip)
        return clip

    # ---- the positions ----

    def _chosen(self) -> str:
        """Return the name of the array of positions. Raises ClipError if no array, or several, may be it."""
        stored, order = self.arrays.stored, self.options.order
        if self.options.dataset is not None:
            name = self.options.dataset.strip("/")
            for candidate in (name, f"{name}/{POSITIONS}".lstrip("/")):
                if candidate in stored:
                    return candidate
            raise ClipError(f"dataset: got {self.options.dataset!r}, expected an array; {listing(stored)}")
        if POSITIONS in stored:
            return POSITIONS
        others = [each for each in stored.values() if _last(each.name) not in RESERVED_NAMES - {POSITIONS}]
        possible = [each for each in others if each.dtype.kind == "f" and is_possible(each.shape, order)]
        in_space = [each for each in possible if len(each.shape) == 3]
        usual = [each for each in in_space if each.shape[2] == 3]
        candidates = possible if order else usual or in_space or possible
        if not candidates and len(others) == 1:
            candidates = others  # What is wrong with it is said where it is looked at.
        named = [each for each in candidates if _last(each.name).lower() in POSITION_NAMES]
        for choice in (named, candidates):
            if len(choice) == 1:
                self._say_chosen(choice[0], candidates)
                return choice[0].name
        several = ", ".join(each.shown for each in candidates[:LISTED])
        problem = f"several, {several}" if candidates else "no such dataset"
        apart = {_last(each.name).lower() for each in others} >= set("xyz")
        hint = "; x, y and z in arrays of their own have to be stacked into one" if apart else ""
        raise ClipError(
            f"positions: got {problem}, expected (frames, vertices, 3){hint}; --dataset (dataset=) names the array, "
            f"--axes (axes=) the order of its axes; {listing(stored)}"
        )

    def _say_chosen(self, chosen: Stored, candidates: Sequence[Stored]) -> None:
        """Say which array was taken for the positions, unless the file has no other."""
        if len(self.arrays.stored) > 1 or not _is_unnamed(chosen.name):
            others = ", ".join(each.shown for each in candidates[:LISTED] if each is not chosen)
            beside = f", not {others}" if others else ""
            self._warn(f"positions: {chosen} was taken for them{beside}; --dataset (dataset=) names another array")

    def _order(self, name: str, known: JsonMapping) -> Order:
        """Return what each axis of the positions `name` holds. `known`: arrays by schema name. Raises ClipError."""
        stored = self.arrays.stored[name]
        stated = self.options.order or order_of_labels(self.arrays.labels(name))
        try:
            return order_of(stored.shape, self._facts(known), stated)
        except ClipError as error:
            raise ClipError(
                f"{error}; --dataset (dataset=) names another array; {listing(self.arrays.stored)}"
            ) from None

    def _facts(self, known: JsonMapping) -> dict[str, tuple[str, int]]:
        """Return for arrays beside the positions, by name, the axis whose length each tells, and that length."""
        facts = facts_of(known)
        if "time" not in facts and self.options.fps is None and len(guess := self._guessed_times()) == 1:
            name, count = guess[0], self.arrays.stored[guess[0]].shape
            if max(count) in self.arrays.stored[self.used[POSITIONS]].shape:
                facts[name] = FRAMES, max(count)
        return facts

    # ---- what belongs to them ----

    def _near(self, name: str) -> str | None:
        """Return the array of this name in the group of the positions, or the nearest above it."""
        return next((full for full in _upwards(self.used[POSITIONS], name) if full in self.arrays.stored), None)

    def _of_schema(self) -> dict[str, np.ndarray | None]:
        """Return the arrays beside the positions by their names in the schema, None for one that is missing."""
        known: dict[str, np.ndarray | None] = {}
        for name in sorted(RESERVED_NAMES - {POSITIONS}):
            full = self._near(name)
            known[name] = None if full is None else self._array(name, full)
        if self.arrays.counts_from_1:
            self._count_from_0(known)
        return known

    def _read(self, full: str) -> np.ndarray:
        if full not in self.loaded:
            self.loaded[full] = self.arrays.read(full)
        return self.loaded[full]

    def _array(self, name: str, full: str) -> np.ndarray:
        """Return the array stored as `full` in the shape and type that the schema has for the array `name`."""
        self.used[name] = full
        values = self._read(full)
        if name in ROWS and _is_row(self.arrays.stored[full]):
            values = values.reshape(-1)
        if self.arrays.counts_from_1 and name not in ("time", "rest") and values.dtype.kind == "f":
            with np.errstate(invalid="ignore"):
                whole = values.astype(np.int64)
            values = whole if np.array_equal(whole, values) else values
        return values

    def _count_from_0(self, known: dict[str, np.ndarray | None]) -> None:
        """Subtract 1 from the numbers of vertices and branches in `known` if the file counts them from 1."""
        for names in (("faces",), ("edges",), ("stem_index",), ("vertex_branch", "branch_parent")):
            first = known[names[0]]
            if first is None or not first.size or first.dtype.kind not in "iu" or first.min() < 1:
                continue
            for name in names:
                values = known[name]
                if values is not None and values.size and values.min() >= 0:
                    known[name] = values.astype(np.int64) - 1
            self._warn(f"{names[0]}: the lowest number is {first.min()}, so they were taken to be counted from 1")

    def _metadata(self, name: str) -> JsonObject:
        """Return the metadata that the file, the groups around the positions, and the positions state."""
        metadata = dict(self.arrays.metadata)
        groups = [full.rpartition("/")[0] for full in _upwards(name, "")]
        for group in reversed([group for group in groups if group]):
            metadata |= self.arrays.notes(group)
        notes = dict(self.arrays.notes(name))
        for key in [key for key in notes if _is_scalar_name(key) and key not in metadata]:
            metadata[key] = notes.pop(key)
        for key, value in metadata.items():  # netCDF has arrays of one item for numbers.
            if _is_scalar_name(key) and isinstance(value, list) and len(value) == 1:
                metadata[key] = value[0]
        if unit_symbol(notes.get("units")) in METRES:
            metadata.setdefault("unit", notes.pop("units"))
        if unit_symbol(metadata.get("units")) in METRES:
            metadata.setdefault("unit", metadata["units"])
        for scalar in SCALARS:
            full = self._near(scalar)
            if full is not None and scalar not in metadata and _is_single(self.arrays.stored[full]):
                self.used[scalar], item = full, self._read(full).reshape(-1)[0].item()
                metadata[scalar] = item.decode("utf-8", "replace") if isinstance(item, bytes) else item
        for key in [key for key in notes if _plain(key) in TIME_NAMES and key not in metadata]:
            metadata[key] = notes.pop(key)  # See _times; what is not taken stays as what the file says.
        self._name_notes(name, notes)
        return metadata

    def _name_notes(self, name: str, notes: JsonMapping) -> None:
        if notes:
            self.not_read.setdefault(NOTE, []).extend(f"{name}@{key}" for key in notes)

    # ---- times ----

    def _times(self, known: JsonMapping, metadata: JsonObject, frame_count: int) -> np.ndarray:
        """Return the frames' times (T,) in seconds: stored, or from a stated rate, or guessed with a GuessWarning."""
        if known["time"] is not None:
            return self._in_seconds(self.used["time"], known["time"])
        if self.options.fps is not None:
            metadata["fps"] = self.options.fps
        elif "fps" not in metadata:
            guesses = self._guessed_times()
            fitting = [name for name in guesses if self._read(name).size == frame_count]
            if len(fitting) == 1:
                self.used["time"] = name = fitting[0]
                self._warn(
                    f"time: {one_line(name)} was taken for the seconds of the frames; --fps (fps=) states a rate"
                )
                return self._in_seconds(name, self._read(name).reshape(-1))
            if (key := self._row_of_times(metadata, frame_count)) is not None:
                self._warn(
                    f"time: the attribute {one_line(key)} was taken for the seconds of the frames; --fps (fps=) "
                    "states a rate"
                )
                return np.array(metadata.pop(key), np.float64)
            self._guess_rate(metadata)
            if guesses and "fps" not in metadata:
                shapes = ", ".join(str(self.arrays.stored[name]) for name in guesses)
                self._warn(
                    f"time: {shapes} may be times, but not one for each of {frame_count} frames; frames come "
                    f"{frame_rate(metadata):g} a second; --fps (fps=) states another rate"
                )
        return np.arange(frame_count) / frame_rate(metadata)

    @staticmethod
    def _row_of_times(metadata: JsonMapping, frame_count: int) -> str | None:
        """Return the metadata key whose value looks like times: ascending, one for each frame. None: no such key."""
        for key, row in metadata.items():
            is_row = (
                isinstance(row, list) and len(row) == frame_count > 1 and {type(each) for each in row} <= {int, float}
            )
            if is_row and _plain(key) in TIME_NAMES and _ascends(np.array(row, np.float64)):
                return key
        return None

    def _in_seconds(self, name: str, values: np.ndarray) -> np.ndarray:
        """Return the times `values` in seconds, converted from the unit that the file states for array `name`."""
        notes = dict(self.arrays.notes(name))
        unit = str(notes.pop("units", notes.pop("unit", "s"))).strip()
        self._name_notes(name, notes)
        if values.dtype.kind in "mM":
            return seconds_of_dates(values)
        factor = SECONDS.get(unit.lower().split(" ")[0])
        if factor is None:
            self._warn(f"time: {one_line(name)} is in {unit[:40]!r}, which was taken for seconds")
        return values if factor in (None, 1.0) else values * factor

    def _guessed_times(self) -> list[str]:
        """Return names of arrays near the positions that look like times: ascending, and with a usual name."""
        for full in _upwards(self.used[POSITIONS], ""):
            group = full.rpartition("/")[0]
            guesses = [
                name
                for name, stored in self.arrays.stored.items()
                if name.rpartition("/")[0] == group and _last(name).lower() in TIME_NAMES and _is_row(stored)
                if stored.dtype.kind in "fiumM" and name not in self.options.skip and _ascends(self._read(name))
            ]
            if guesses:
                return guesses
        return []

    def _guess_rate(self, metadata: JsonObject) -> None:
        """Add "fps" to the metadata if the file states a frame rate or time step under another usual name."""
        stated = {key: value for key, value in metadata.items() if _plain(key) in RATE_NAMES | STEP_NAMES}
        groups = {full.rpartition("/")[0] for full in _upwards(self.used[POSITIONS], "")}
        for name, each in self.arrays.stored.items():
            is_rate = _plain(_last(name)) in RATE_NAMES | STEP_NAMES and name.rpartition("/")[0] in groups
            if is_rate and each.dtype.kind in "fiu" and _is_single(each):
                stated[name] = self._read(name).reshape(-1)[0].item()
        numbers = {key: rate for key, value in stated.items() if (rate := stated_fps({"fps": value})) is not None}
        rates = {key: 1 / each if _plain(_last(key)) in STEP_NAMES else each for key, each in numbers.items()}
        if not rates:
            return
        key, rate = next(iter(rates.items()))
        if max(rates.values()) > (1 + 1e-6) * min(rates.values()):
            got = ", ".join(f"{one_line(name)} {number:g}" for name, number in numbers.items())
            raise ClipError(f"fps: got {got}, expected one rate; --fps (fps=) states it")
        metadata["fps"] = rate
        self._warn(
            f"fps: {one_line(key)} {numbers[key]:g} was taken for {rate:.6g} frames a second; --fps (fps=) states "
            "another"
        )

    # ---- all the rest ----

    def _further(self, name: str) -> dict[str, np.ndarray]:
        """Return the arrays outside of the schema by name; beside positions `name`, without the group's name."""
        group, skip = name.rpartition("/")[0], set(self.options.skip)
        names_used, arrays = set(self.used.values()), {}
        names = sorted(self.arrays.stored, key=lambda each: not each.startswith(f"{group}/"))
        for full in names:
            short = full.removeprefix(f"{group}/") if group else full
            if full in names_used or full in skip or short in skip:
                continue
            is_reserved = (_last(full) if group else full) in RESERVED_NAMES
            if is_reserved or short in arrays:
                self.not_read.setdefault(OTHER_CLIP, []).append(full)
                continue
            values = self._read(full)
            if values.dtype.kind in "mMO":
                self.not_read.setdefault(f"array of {values.dtype.name}", []).append(short)
                continue
            arrays[short] = values
            self._name_notes(full, self.arrays.notes(full))
        return {name: arrays[name] for name in sorted(arrays)} if group else arrays

    def _warn(self, text: str) -> None:
        warnings.warn(f"{os.fspath(self.path)}: {text}", GuessWarning, stacklevel=2)


def _upwards(name: str, last: str) -> Iterator[str]:
    """Yield the path of `last` in the group of an array, and in each of the groups above it."""
    group = name
    while group:
        group = group.rpartition("/")[0]
        yield f"{group}/{last}" if group else last


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _is_unnamed(name: str) -> bool:
    """Return whether a file's only array has no name, or the one that NumPy gives to it."""
    return name in ("", "arr_0")


def _is_row(stored: Stored) -> bool:
    """Return whether an array is a row of numbers, whatever else its shape is."""
    return bool(stored.shape) and max(stored.shape) == np.prod(stored.shape, dtype=object)


def _is_single(stored: Stored) -> bool:
    return np.prod(stored.shape, dtype=object) == 1 and stored.dtype.kind in "biufUS"


def _ascends(values: np.ndarray) -> bool:
    row = values.reshape(-1)
    return bool((row[1:] > row[:-1]).all())


def _is_scalar_name(key: str) -> bool:
    """Return whether metadata of this name are a rate, or what else is a single word or number."""
    return key in SCALARS or _plain(key) in RATE_NAMES | STEP_NAMES


def _plain(key: str) -> str:
    return "".join(letter for letter in key.lower() if letter.isalnum())


def _branches(
    positions: ArrayLike, known: Mapping[str, np.ndarray | None], metadata: JsonObject, options: ReadOptions
) -> BranchFields:
    """Return the branches that the file's arrays `known` describe, or else those that its edges form, as fields of a
    MotionClip; nothing if the file has neither."""
    branches: BranchFields = {
        "vertex_branch": known["vertex_branch"],
        "branch_parent": known["branch_parent"],
        "stem_index": known["stem_index"],
    }
    edges = known["edges"]
    if branches["vertex_branch"] is not None or branches["branch_parent"] is not None:
        return branches
    if edges is None:
        return {}
    # These imports load the C library, which takes longer than to read a small file.
    from athcodec.motion.branches.centre_lines import line_branches
    from athcodec.motion.branches.grown_pose import with_grown_pose
    from athcodec.motion.branches.seen import Seen

    of_file = replace(options, rest="auto").rest_fields(known["rest"])
    clip = MotionClip(positions, np.arange(len(positions)), metadata=metadata, **of_file)
    vertex_branch, branch_parent, stem_index = line_branches(Seen(with_grown_pose(clip)), edges, options.root)
    return {"vertex_branch": vertex_branch, "branch_parent": branch_parent, "stem_index": stem_index}
