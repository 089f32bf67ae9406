"""ParaView's indices of files that are the frames of one motion: .pvd (XML) and .series (JSON).

Frames come in the order of their times. Entries of one time are the parts of one frame, where a .pvd calls them
different parts or groups. Files that are not there are left out and named.
"""

from __future__ import annotations

import json
import math
import os
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.reading import Budget, check_inside, naming, read_plain
from athcodec.sources import SERIES
from athcodec.sources.numbering import some
from athcodec.sources.xml_tree import parse_xml

PVD = ".pvd"
LISTS = (".pvtu", ".pvtp", ".pvts", ".vtm", ".vtpd", ".vtpc")  # Files that list the pieces of one frame.
JSON_BYTES = 300  # Bytes that a value of JSON takes.
_JSON_MARKS = b",:[{"
_LISTED = re.compile(rb"""(?:file|Source)\s*=\s*["']([^"'\0]+)["']""")


@dataclass(frozen=True)
class _Entry:
    """A line of an index: file, seconds, what its objects are called, and which of the files of its time it is."""

    file: Path
    time: float
    name: str = ""
    part: tuple[str, str] = ("", "0")


@dataclass(frozen=True, eq=False)
class Index:
    """The files of an index.

    frames    the files of each frame, one for each of `parts`
    times     (T,) seconds, which ascend
    parts     what the objects in those files are called, "" for no name
    missing   files that are not there
    """

    path: Path
    frames: tuple[tuple[Path, ...], ...]
    times: np.ndarray
    parts: tuple[str, ...]
    missing: tuple[Path, ...] = ()

    @cached_property
    def _places(self) -> frozenset[str]:
        return frozenset(os.path.abspath(file) for frame in self.frames for file in frame)

    def lists(self, path: Path) -> bool:
        """Return whether a file is in one of the frames."""
        return os.path.abspath(path) in self._places

    def agrees(self, other: Index) -> bool:
        """Return whether another index has the same files at the same times."""
        paths, other_paths = ([list(map(os.path.abspath, frame)) for frame in index.frames] for index in (self, other))
        return paths == other_paths and np.array_equal(self.times, other.times)


def is_index(path: Path) -> bool:
    """Return whether a path has the suffix of an index."""
    return path.suffix.lower() in (PVD, SERIES)


def read_index(path: Path, folder: Path, allow_outside: bool, budget: Budget) -> Index:
    """Return the files that an index lists, with their times.

    Raises ClipError if the file is no index, if it lists a file outside of the folder or the same part of a time
    twice, or if none of its files exists; OSError if it cannot be opened.
    """
    data = read_plain(path, budget)
    with naming(path, ValueError, RecursionError):
        entries = _pvd(path, data, budget) if path.suffix.lower() == PVD else _series(path, data, budget)
        for entry in entries:
            check_inside(folder, entry.file, allow_outside)
        return _index(path, entries)


def _pvd(path: Path, data: bytes, budget: Budget) -> list[_Entry]:
    """Return the entries of a .pvd file, an XML index by ParaView, from its content `data`. Raises ClipError if it
    lists no file, or a time is missing."""
    entries = []
    elements = list(parse_xml(data, "VTKFile", budget).iter("DataSet"))
    for element in elements:
        file, stated = element.get("file", ""), element.get("timestep")
        if stated is None and len(elements) > 1:
            raise ClipError(f"got no timestep for {file[:80]!r}, expected the time of each DataSet")
        group, part = element.get("group", ""), element.get("part", "0")
        time = _seconds(stated or 0.0, file)
        entries.append(_Entry(_beside(path, file), time, group or element.get("name", ""), (group, part)))
    if not entries:
        raise ClipError("got no DataSet, expected some files")
    return entries


def _series(path: Path, data: bytes, budget: Budget) -> list[_Entry]:
    """Return the entries of a .series file, a JSON index by ParaView, from its content `data`. Raises ClipError if it
    is not such a list."""
    budget.need_for(data, _JSON_MARKS, JSON_BYTES, "JSON")
    try:
        content: Any = json.loads(data.decode("utf-8-sig"))
    except ValueError as error:
        raise ClipError(f"got no JSON: {error}") from None
    files = content.get("files") if isinstance(content, dict) else None
    if not isinstance(files, list) or not files:
        raise ClipError('got no "files", expected a list of {"name": "FILE", "time": SECONDS}')
    entries = []
    for place, item in enumerate(files):
        if not isinstance(item, dict) or not isinstance(item.get("name"), str) or "time" not in item:
            raise ClipError(f'files[{place}]: got {str(item)[:60]}, expected {{"name": "FILE", "time": SECONDS}}')
        entries.append(_Entry(_beside(path, item["name"]), _seconds(item["time"], item["name"])))
    return entries


def _seconds(stated: Any, file: str) -> float:
    """Return the stated time of `file` as finite seconds. Raises ClipError if it is not a number."""
    try:
        time = float(stated)
    except (TypeError, ValueError):
        time = math.nan
    if not math.isfinite(time):
        raise ClipError(f"got the time {str(stated)[:40]!r} of {file[:80]!r}, expected seconds")
    return time


def _beside(path: Path, name: str) -> Path:
    """Return the file that an index names, from its own folder; Windows writes paths with backslashes."""
    if not name or "\0" in name:
        raise ClipError(f"got the file name {name[:80]!r}, expected a path")
    file = path.parent / name
    return path.parent / name.replace("\\", "/") if "\\" in name and not file.exists() else file


def _index(path: Path, entries: Sequence[_Entry]) -> Index:
    """Return the index of all entries, with one frame for each time at which every listed file exists. Raises ClipError
    if the frames do not all have the same parts, or no file exists."""
    times = sorted({entry.time for entry in entries})
    of_time: dict[float, dict[tuple[str, str], _Entry]] = {time: {} for time in times}
    for entry in entries:
        other = of_time[entry.time].setdefault(entry.part, entry)
        if other.file != entry.file:
            raise ClipError(
                f"got {other.file.name} and {entry.file.name} at the time {entry.time:.10g}, expected one file; a .pvd "
                'lists the parts of one frame as part="0", part="1" ...'
            )
    parts = sorted(of_time[times[0]])
    for time in times:
        if sorted(of_time[time]) != parts:
            raise ClipError(
                f"got {len(of_time[time])} files at the time {time:.10g}, expected the {len(parts)} parts that are "
                f"there at {times[0]:.10g}"
            )
    missing = tuple(dict.fromkeys(entry.file for entry in entries if not entry.file.exists()))
    kept = [time for time in times if not any(entry.file in missing for entry in of_time[time].values())]
    if not kept:
        raise ClipError(f"got {len(missing)} files that are not there, such as {missing[0].name}, expected some")
    first = of_time[kept[0]]
    several = len(parts) > 1
    return Index(
        path,
        tuple(tuple(of_time[time][part].file for part in parts) for time in kept),
        np.array(kept),
        tuple(first[part].name if several else "" for part in parts),
        missing,
    )


# ---- indices that nobody named ----


def index_of(path: Path, frames: Sequence[Path], allow_outside: bool, max_memory: int) -> Index | None:
    """Return the index that lists the file `path`, from its folder or the folder above, or None. If `path` is a
    pattern, the index has to list all files of `frames`, the files that match.

    A GuessWarning says which index is used if several disagree, and which files it does not list. Files outside of the
    folder are refused unless `allow_outside`; `max_memory` is in bytes.
    """
    named = [path] if path.is_file() else list(frames)
    candidates = []
    for file in _above(path, lambda name: name.lower().endswith((PVD, SERIES))):
        index = _candidate(file, path, allow_outside, max_memory)
        if index is not None and any(map(index.lists, frames)):
            candidates.append(index)
    fitting = [index for index in candidates if all(map(index.lists, named))]
    if not fitting:
        if candidates:
            listed = sum(map(candidates[0].lists, frames))
            _warn(
                f"{path}: read without the times of {candidates[0].path}, which lists {listed} of the {len(frames)} "
                "files; name it to read those"
            )
        return None
    index = fitting[0]
    others = [str(other.path) for other in fitting[1:] if not index.agrees(other)]
    if others:
        _warn(f"{path}: read by {index.path}; {', '.join(others)} has other files or times: name the one that is meant")
    unlisted = [file.name for file in frames if not index.lists(file)]
    if unlisted:
        _warn(
            f"{path}: read by {index.path} as {len(index.frames)} frames, without {some(unlisted)}, which it does not "
            "list; to read all files, move it to another folder"
        )
    return index


def list_of(path: Path) -> Path | None:
    """Return a file, in the folder of another or the folder above, that lists it as a piece of one frame."""
    for file in _above(path, lambda name: name.lower().endswith(LISTS)):
        with suppress(OSError, ClipError, ValueError):
            names = [name.decode() for name in _LISTED.findall(read_plain(file, Budget()))]
            if file != path and os.path.abspath(path) in {os.path.abspath(file.parent / name) for name in names}:
                return file
    return None


def _candidate(file: Path, path: Path, allow_outside: bool, max_memory: int) -> Index | None:
    """Return the index in `file`, or None if it cannot be used. A GuessWarning says why, if the text of the index names
    the file `path`."""
    try:
        return read_index(file, path.parent, allow_outside, Budget(max_memory))
    except (ClipError, OSError) as error:
        with suppress(OSError, ClipError):
            if path.name.encode() in read_plain(file, Budget(max_memory)):
                _warn(f"{path}: read without its index: {error}")
    return None


def _above(path: Path, is_wanted: Callable[[str], bool]) -> Iterator[Path]:
    """Yield files of the folder of a path, then of the folder above it."""
    parent = path.parent.parent if path.parent.name not in ("", os.pardir) else path.parent / os.pardir
    for folder in (path.parent, parent):
        with suppress(OSError):
            yield from sorted(folder / name for name in os.listdir(folder) if is_wanted(name))


def _warn(text: str) -> None:
    warnings.warn(text, GuessWarning, stacklevel=2)
