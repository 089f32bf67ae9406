"""Reads numbered OBJ or PLY files as the frames of one motion: tree_0001.obj, tree_0002.obj ...

Any one of the files names the motion, and so does a pattern: tree_####.obj or tree_%04d.obj. The numbers are frames
and may be below 0: where some are missing, the others keep their times. Frames come options.fps a second, DEFAULT_FPS
(30) without it. A file without a number is a motion of one frame. Files whose names differ in another number, as those
with dates and decimals do, are left out, and a GuessWarning names them. One file is in memory at a time. Faces and
edges come from the first file, and so do texture coordinates and other arrays that are the same in all; the clip's
`not_read` names those that change. See mesh.py for what is read of a file. Exporters that split vertices
(Blender's PLY does where texture coordinates are to be written) split those of all frames alike.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from os import fspath
from pathlib import Path

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget, FileWatch, naming, read_plain
from athcodec.motion.clip import MotionClip, stated_fps
from athcodec.motion.frames import Frames
from athcodec.sources import LISTED, NUMBER_PATTERN, ReadOptions, is_pattern
from athcodec.sources.mesh import (
    NAMED,
    POSITION_COLUMNS,
    Mesh,
    narrowed,
    obj_lines,
    obj_points,
    parse_mesh,
    ply_header,
    ply_points,
    same_values,
)
from athcodec.sources.timing import numbered_times

_NUMBERED = re.compile(r"(.*?)(-?)(\d+)", re.DOTALL)
# Parts of a name that may tell frames apart: numbers that are no part of a word, decimals, and halves of a day.
_PLACES = re.compile(r"(?<![^\W_])-?\d+|\d+(?=[.,]\d)|-?\d+$|(?<![^\W_])[AaPp][Mm](?![^\W_])")
_ELEMENTS = (b"f ", b"f\t", b"l ", b"l\t")
_LABELS = (b"vt ", b"vt\t", b"usemtl ", b"usemtl\t", b"o ", b"o\t", b"g ", b"g\t")
LARGEST_NUMBER = 10**9
FRAME_SUFFIXES = (".obj", ".ply", ".vtu", ".vtp", ".vtk")  # Formats that have one file per frame.


@dataclass(frozen=True)
class Numbering:
    """How the files of a sequence are called: prefix, the number with at least `width` digits, suffix."""

    folder: Path
    prefix: str
    width: int
    suffix: str

    @classmethod
    def of_pattern(cls, path: Path) -> Numbering | None:
        """Return the pattern of a name with # or %04d in it; None where there is none."""
        found = NUMBER_PATTERN.fullmatch(path.name)
        if found is None:
            return None
        prefix, marks, width, suffix = found.groups()
        return cls(path.parent, prefix, len(marks) if marks.startswith("#") else int(width or 1), suffix)

    def path(self, number: int) -> Path:
        """The file of this number."""
        return self.folder / f"{self.prefix}{number:0{self.width}d}{self.suffix}"

    def files(self) -> dict[int, Path]:
        """The files that are there, by their numbers, in that order."""
        found = {}
        for name, sign, digits in _numbered(self.folder, self.prefix, self.suffix):
            longer = len(digits) - self.width
            is_padded = longer == 0 or longer > 0 and digits[0] != "0" or longer == -1 and sign  # -001 beside 0000
            if is_padded and len(digits) <= len(str(LARGEST_NUMBER)) and not (sign and int(digits) == 0):
                found[int(sign + digits)] = self.folder / name
        return dict(sorted(found.items()))


def numbering_of(path: FilePath) -> Numbering | None:
    """The numbering that a pattern, or a file's name with digits before its suffix, belongs to; None: it has none."""
    path = Path(path)
    if is_pattern(path):
        return Numbering.of_pattern(path)
    numbered = _NUMBERED.fullmatch(path.stem)
    if not numbered:
        return None
    prefix, sign, digits = numbered.groups()
    positive = [number for _, below, number in _numbered(path.parent, prefix, path.suffix) if not below]
    if sign and prefix[-1:].isalnum() and not positive:  # The hyphen of tree-001.obj is no sign.
        prefix, sign = prefix + sign, ""
        positive = [number for _, below, number in _numbered(path.parent, prefix, path.suffix) if not below]
    if digits.startswith("0") and not sign:
        return Numbering(path.parent, prefix, len(digits), path.suffix)
    longest = len(digits) + len(sign)
    padded = [len(number) for number in positive if number.startswith("0") and 1 < len(number) <= longest]
    return Numbering(path.parent, prefix, max(padded, default=len(digits) if digits[0] == "0" else 1), path.suffix)


def _numbered(folder: Path, prefix: str, suffix: str) -> list[tuple[str, str, str]]:
    """Return the names of the files with only a number between prefix and suffix, the sign of each, and its digits."""
    form = re.compile(re.escape(prefix) + r"(-?)([0-9]+)" + re.escape(suffix))
    return [(name, *match.groups()) for name in os.listdir(folder) if (match := form.fullmatch(name))]


def sequence_files(path: FilePath) -> dict[int | None, Path]:
    """The files of the sequence by number; {None: path} for a single file without a number. Raises ClipError where a
    pattern matches none, OSError where the folder or the named file is not there."""
    numbering = numbering_of(path)
    if numbering is None:
        return {None: Path(path)}
    files = numbering.files()
    if is_pattern(path):
        if not files:
            raise ClipError(f"{fspath(path)}: got no such files, expected some like {numbering.path(1).name}")
    elif Path(path) not in files.values():
        return {None: Path(path)}
    return files


def files_to_read(path: FilePath) -> dict[int | None, Path]:
    """Return `sequence_files`; a GuessWarning names files whose names differ in numbers, but not in the last alone."""
    files, path = sequence_files(path), Path(path)
    form = _PLACES.sub("#", path.stem)
    if is_pattern(path) or "#" not in form:
        return files
    taken = {file.name for file in files.values()}
    others = sorted(
        name
        for name in set(os.listdir(path.parent)) - taken
        if name.endswith(path.suffix) and _PLACES.sub("#", name.removesuffix(path.suffix)) == form
    )
    if others:
        more = f" and {len(others) - LISTED} more" if len(others) > LISTED else ""
        warnings.warn(
            f"{path}: read as {len(files)} of {len(files) + len(others)} files, without {', '.join(others[:LISTED])}"
            f"{more}; frames differ in the last number alone, written with as many zeros: to read all as one motion, "
            f"call them NAME_0001{path.suffix}, NAME_0002{path.suffix} ... in the order of time",
            GuessWarning,
            stacklevel=2,
        )
    return files


def each_once(paths: Iterable[str]) -> list[tuple[str, str]]:
    """Paths, and what the clip in each is called by its file. Of the files of a sequence, as a shell makes them of a
    pattern, only the first stays, called by their prefix. Raises ClipError where only some of a sequence are named."""
    sequence_of: dict[Path, tuple[Path, ...]] = {}
    named: dict[tuple[Path, ...] | str, list[str]] = {}
    for path in paths:
        if Path(path).suffix.lower() in FRAME_SUFFIXES and os.path.isfile(path) and Path(path) not in sequence_of:
            files = tuple(sequence_files(path).values())
            sequence_of |= dict.fromkeys(files, files)
        named.setdefault(sequence_of.get(Path(path), path), []).append(path)
    found = []
    for files, names in named.items():
        numbering = numbering_of(names[0]) if len(names) > 1 and isinstance(files, tuple) else None
        if numbering is None:
            found += [(path, Path(path).stem) for path in names]
            continue
        if len(set(names)) != len(files):
            raise ClipError(
                f"{names[0]}: got {len(names)} names of a sequence of {len(files)} files, expected one or all of "
                "them; to encode some of its frames, put their files into a folder of their own"
            )
        found.append((names[0], numbering.prefix.rstrip("_-. ") or numbering.folder.resolve().name))
    return found


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """The clip in the sequence that `path` belongs to. Raises ClipError where a file is broken or, when its frame is
    read, has other vertices, faces or edges than the first; OSError where one cannot be opened."""
    files = files_to_read(path)
    reader = FileFrames(list(files.values()), parse_mesh, _fast_reader, Budget(options.max_memory))
    mesh, time, metadata = reader.mesh, np.zeros(1), {}
    if None not in files:
        time, metadata = numbered_times(np.array(list(files)), options.fps or stated_fps(mesh.metadata))
    mesh.metadata["part_names"] = _without_numbers(mesh.metadata["part_names"], reader.paths[0], path)
    changed = reader.changed()
    attributes = {name: values for name, values in mesh.attributes.items() if name not in changed.union(options.skip)}
    for name in changed:
        mesh.metadata["domains"].pop(name, None)
        mesh.metadata.pop(NAMED.get(name, ""), None)
    left_out = sorted(changed.difference(options.skip))
    with naming(path):
        return MotionClip(
            reader.frames,
            time,
            faces=mesh.faces,
            edges=mesh.edges,
            attributes=attributes,
            metadata=mesh.metadata | metadata,
            not_read=mesh.not_read | ({"attribute": left_out} if left_out else {}),
            rest_pose="mean" if options.rest == "mean" else "first",
            unchanged=reader.unchanged,
        )


def _without_numbers(names: Sequence[str], first: Path, path: FilePath) -> list[str]:
    """The names of parts, where they are only the file's own that of the sequence."""
    numbering = numbering_of(path)
    if list(names) != [first.stem] or numbering is None:
        return list(names)
    return [numbering.prefix.rstrip("_-. ") or first.stem]


class FileFrames:
    """Frames of which each is a file of its own, read whole.

    Parameters
    ----------
    paths : sequence of Path
        In the order of time.
    parse : callable
        (bytes, path, budget) -> Mesh.
    fast_reader : callable
        (bytes of the first file, its mesh) -> a function from the bytes of a further file to its points, or to None
        where all else is not as in the first, or that function cannot tell.
    budget : Budget
        What a file may take.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        parse: Callable[[bytes, Path, Budget], Mesh],
        fast_reader: Callable[[bytes, Mesh], Callable[[bytes], np.ndarray | None]],
        budget: Budget,
    ):
        self.paths, self._parse, self._budget = list(paths), parse, budget
        self.unchanged = FileWatch(*self.paths)
        data = read_plain(self.paths[0], budget)
        self.mesh = parse(data, self.paths[0], budget)
        self._fast = fast_reader(data, self.mesh)
        self.frames = Frames(self._read, len(self.paths), len(self.mesh.points), self.mesh.points.dtype, True)

    def _read(self, start: int, stop: int) -> np.ndarray:
        block = np.empty((stop - start, *self.frames.shape[1:]), self.frames.dtype)
        for frame in range(start, stop):
            with np.errstate(over="ignore"):
                block[frame - start] = self._points(frame)
        return block

    def changed(self) -> set[str]:
        """Return the names of the arrays that are not the same in all files."""
        names: set[str] = set()
        for path in self.paths[1:]:
            data = read_plain(path, self._budget)
            with suppress(ClipError):  # The frame says what is wrong when it is read.
                if self._quick_points(data) is None:
                    mesh = self._parse(data, path, self._budget)
                    names |= set() if self.mesh.same_topology(mesh) else self.mesh.changed(mesh)
        return names

    def _quick_points(self, data: bytes) -> np.ndarray | None:
        try:
            points = self._fast(data)
        except (ClipError, ValueError, IndexError, OverflowError):
            return None  # The full parser says what is wrong.
        return points if points is not None and points.shape == self.mesh.points.shape else None

    def _points(self, frame: int) -> np.ndarray:
        path = self.paths[frame]
        data = read_plain(path, self._budget)
        points = self._quick_points(data)
        if points is not None:
            return points
        mesh = self._parse(data, path, self._budget)
        different = self.mesh.same_topology(mesh)
        if different:
            raise ClipError(
                f"frame {frame}, {path.name}: {different}, unlike {self.paths[0].name}; topology that "
                "changes cannot be coded"
            )
        return mesh.points


def _fast_reader(data: bytes, mesh: Mesh) -> Callable[[bytes], np.ndarray | None]:
    if data.startswith((b"ply\n", b"ply\r")):
        return _fast_ply(data)
    return _fast_obj(data, mesh)


def _fast_obj(data: bytes, mesh: Mesh) -> Callable[[bytes], np.ndarray | None]:
    dtype, elements, colors = mesh.points.dtype, _obj_elements(obj_lines(data)), mesh.attributes.get("colors")
    if any(b"-" in line for line in elements if line.startswith(_ELEMENTS)):
        return lambda data: None  # relative numbers: which vertices they mean depends on the lines around them

    tail = data[data.rfind(b"\nv ") + 1 :].partition(b"\n")[2]  # Usually all that is not a coordinate.

    def points(data: bytes) -> np.ndarray | None:
        if tail and colors is None and data.endswith(tail):
            rows = [line for line in data[: -len(tail)].splitlines() if not line.startswith(b"#")]
            words = b" ".join(rows).split()
            if len(words) == 4 * len(rows) and set(words[::4]) == {b"v"}:
                del words[::4]
                return narrowed(np.array(list(map(float, words)), np.float64).reshape(-1, 3), dtype)
        lines = obj_lines(data)
        if _obj_elements(lines) != elements:
            return None
        points, others = obj_points([line.split()[1:] for line in lines if line[:2] in (b"v ", b"v\t")], dtype)
        return points if colors is others is None or same_values(colors, others) else None

    return points


def _obj_elements(lines: Sequence[bytes]) -> list[bytes]:
    """The lines that say which vertices belong together, and what is where on them."""
    return [line for line in lines if line.startswith(_ELEMENTS + _LABELS)]


def _fast_ply(data: bytes) -> Callable[[bytes], np.ndarray | None]:
    header = ply_header(data)
    vertex = header.elements[0]
    if not header.order or vertex.name != "vertex" or vertex.lists:
        return lambda data: None
    dtype = vertex.row(header.order, {})
    head, end = data[: header.length], header.length + vertex.count * dtype.itemsize
    tail = data[end:]
    first = np.frombuffer(data, dtype, vertex.count, len(head))
    others = [name for name in dtype.names if name not in POSITION_COLUMNS]

    def points(data: bytes) -> np.ndarray | None:
        if data[: len(head)] != head or data[end:] != tail:
            return None
        rows = np.frombuffer(data, dtype, vertex.count, len(head))
        return ply_points(rows) if all(np.array_equal(rows[name], first[name]) for name in others) else None

    return points
