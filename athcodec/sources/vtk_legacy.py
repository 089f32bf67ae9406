"""Reads legacy VTK files (.vtk), as text or binary, of the versions 1.0 to 5.1.

Data sets: POLYDATA, UNSTRUCTURED_GRID, STRUCTURED_GRID, STRUCTURED_POINTS and RECTILINEAR_GRID, whose cells become
hexahedra, quads or lines. Their attributes are kept by their names. Not read: arrays of strings, tables of colours,
names of components, other information on arrays, polyhedra.
"""

from __future__ import annotations

import re
from urllib.parse import unquote

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.reading import Budget
from athcodec.sources.cells import NODE_BYTES
from athcodec.sources.vtk_grid import STEP_NAMES, TIME_NAMES, Grid, lattice_cells, poly_cells, starts_of

WORD_BYTES = 128  # Bytes that a word of text and the number made of it take.
_MAGIC = re.compile(rb"# vtk DataFile Version +\d", re.IGNORECASE)
_TYPES = {
    "bit": "u1",
    "char": "i1",
    "signed_char": "i1",
    "unsigned_char": "u1",
    "short": "i2",
    "unsigned_short": "u2",
    "int": "i4",
    "unsigned_int": "u4",
    "long": "i8",
    "unsigned_long": "u8",
    "vtkidtype": "i4",  # VTK writes its indices as int.
    "vtktypeint64": "i8",
    "vtktypeuint64": "u8",
    "long_long": "i8",
    "unsigned_long_long": "u8",
    "float": "f4",
    "double": "f8",
}
_STRINGS = ("string", "utf8_string")
_POLY = {"VERTICES": "Verts", "LINES": "Lines", "POLYGONS": "Polys", "TRIANGLE_STRIPS": "Strips"}
_AXES = ("X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES")
# Numbers of an attribute for each point or cell; of the others the file says how many.
_WIDTHS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6, "GLOBAL_IDS": 1, "PEDIGREE_IDS": 1, "EDGE_FLAGS": 1}


def is_legacy(data: bytes) -> bool:
    """Return whether a file begins as legacy VTK files do."""
    return _MAGIC.match(data) is not None


def read_legacy(data: bytes, budget: Budget) -> Grid:
    """Return the data set in the bytes of a file. Raises ClipError, ValueError, OverflowError."""
    if not is_legacy(data):
        raise ClipError("got no legacy VTK file, expected '# vtk DataFile Version' in its first line")
    return _Legacy(data, budget).grid()


class _Legacy:
    """The sections of a file, taken one after the other."""

    def __init__(self, data: bytes, budget: Budget):
        """Read the first lines of a legacy VTK file whose content is `data`. Raises ClipError if it is neither ASCII
        nor BINARY."""
        self._data, self._budget, self._at = data, budget, 0
        self._line()
        self._title = self._line(or_blank=True)
        form = self._line().upper()
        if form not in ("ASCII", "BINARY"):
            raise ClipError(f"got the form {form[:40]!r}, expected ASCII or BINARY")
        self._is_binary = form == "BINARY"
        self._kind = ""
        self._points: np.ndarray | None = None
        self._axes: dict[str, np.ndarray] = {}
        self._poly: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self._cells: tuple[np.ndarray, np.ndarray] | None = None
        self._types = np.zeros(0, np.int64)
        self._data_of: dict[str, dict[str, np.ndarray]] = {"POINT_DATA": {}, "CELL_DATA": {}, "FIELD": {}}
        self._left_out: list[str] = []
        self._other: dict[str, None] = {}

    def grid(self) -> Grid:
        """Read the whole file and return its data set. Raises ClipError if it is broken."""
        place, count = "FIELD", 0
        while (line := self._line()) != "":
            word, *rest = line.split()
            word = word.upper()
            if word == "DATASET":
                self._begin(rest)
            elif word in ("POINT_DATA", "CELL_DATA"):
                place, count = word, _number(rest, 0, line)
            elif word == "FIELD":
                self._fields(place, _number(rest, 1, line))
            elif word == "METADATA":
                self._metadata()
            elif place != "FIELD":
                self._attribute(place, count, word, rest, line)
            else:
                self._geometry(word, rest, line)
        points, types, stops, nodes = self._built()
        return Grid(
            points,
            types,
            starts_of(stops),
            stops,
            nodes,
            self._data_of["POINT_DATA"],
            self._data_of["CELL_DATA"],
            self._data_of["FIELD"],
            self._left_out,
            list(self._other),
            title=self._title,
        )

    # ---- text ----

    def _line(self, or_blank: bool = False) -> str:
        """Return the next line that is not blank, without spaces around it, or "" at the end of the file. With
        `or_blank`, return the next line even if it is blank."""
        while self._at < len(self._data):
            end = self._data.find(b"\n", self._at)
            end = len(self._data) if end < 0 else end
            line = self._data[self._at : end].decode("latin-1").strip()
            self._at = end + 1
            if line or or_blank:
                return line
        return ""

    def _next_is(self, word: bytes) -> bool:
        """Return whether the next word is this one; nothing is taken."""
        start = self._at
        while self._data[start : start + 1].isspace():
            start += 1
        return self._data[start : start + len(word)].upper() == word

    def _words(self, count: int) -> list[bytes]:
        """Return the next `count` words of a text file and move on behind them. Raises ClipError if the file ends
        before."""
        left = self._data[self._at :]
        if count > len(left):
            raise ClipError(f"got the end of the file, expected {count} numbers")
        self._budget.need(len(left) + WORD_BYTES * count, "numbers")
        words = left.split(None, count)
        if len(words) < count:
            raise ClipError(f"got the end of the file, expected {count} numbers")
        rest = len(words[count]) if len(words) > count else 0
        self._at = len(self._data) - rest
        return words[:count]

    def _array(self, kind: str, count: int, width: int = 1) -> np.ndarray:
        """Return the next `count` numbers (count,) or, if `width` is above 1, rows of numbers (count, width). `kind` is
        VTK's name of their type, such as "float". Raises ClipError if the file ends before or the type is unknown."""
        if count < 0 or width < 1:
            raise ClipError(f"got {count} rows of {width} numbers, expected some")
        name = _TYPES.get(kind.lower())
        if name is None:
            raise ClipError(f"got numbers of the type {kind[:40]!r}, expected one of {', '.join(_TYPES)}")
        dtype, total = np.dtype(name), count * width
        if not self._is_binary:
            words = self._words(total)
            with np.errstate(
                over="ignore", invalid="ignore"
            ):  # Values that do not fit are refused where they are used.
                values = np.array(list(map(float if dtype.kind == "f" else int, words))).astype(dtype)
        else:
            is_bit = kind.lower() == "bit"
            size = (total + 7) // 8 if is_bit else total * dtype.itemsize
            if size > len(self._data) - self._at:
                raise ClipError(f"got the end of the file, expected {size} bytes")
            raw = np.frombuffer(self._data, dtype.newbyteorder(">"), size // dtype.itemsize, self._at)
            values = np.unpackbits(raw)[:total] if is_bit else raw.astype(dtype)
            self._at += size
        self._budget.take(values.nbytes, "numbers")
        return values if width == 1 else values.reshape(count, width)

    def _skip_strings(self, count: int) -> None:
        """Move on behind the next `count` strings without reading them. Raises ClipError if the file ends before."""
        if not self._is_binary:
            for _ in range(count):
                if self._at >= len(self._data):
                    raise ClipError(f"got the end of the file, expected {count} strings")
                self._line(or_blank=True)
            return
        for _ in range(count):  # The first two bits say how many bytes the length takes.
            if self._at >= len(self._data):
                raise ClipError(f"got the end of the file, expected {count} strings")
            size = {3: 1, 2: 2, 1: 4, 0: 8}[self._data[self._at] >> 6]
            head = int.from_bytes(self._data[self._at : self._at + size], "big")
            self._at += size + (head & ((1 << (8 * size - 2)) - 1))

    def _metadata(self) -> None:
        """Pass over names of components and other information, which end with an empty line."""
        while (line := self._line(or_blank=True)) != "":
            if line.upper().startswith("COMPONENT_NAMES"):
                self._other["names of components"] = None
            elif line.upper().startswith("NAME ") and "L2_NORM" not in line:
                self._other[line.split()[1]] = None

    # ---- the data set ----

    def _begin(self, words: list[str]) -> None:
        """Note the type of the data set that the words behind DATASET state. Raises ClipError for others."""
        self._kind = (words[0] if words else "").upper()
        known = ("POLYDATA", "UNSTRUCTURED_GRID", "STRUCTURED_GRID", "STRUCTURED_POINTS", "RECTILINEAR_GRID")
        if self._kind not in known:
            raise ClipError(f"got a data set of the type {self._kind[:40]!r}, expected one of {', '.join(known)}")

    def _geometry(self, word: str, words: list[str], line: str) -> None:
        """Read the section of points, cells, cell types or grid axes that begins with the keyword `word`. `words` are
        the other words of its first line, and `line` is that line for messages. Raises ClipError for an unknown
        keyword."""
        if word == "POINTS":
            self._points = self._array(_word(words, 1, line), _number(words, 0, line), 3)
        elif word in _POLY:
            self._poly[_POLY[word]] = self._cell_list(words, line)
        elif word == "CELLS":
            self._cells = self._cell_list(words, line)
        elif word == "CELL_TYPES":
            self._types = self._array("int", _number(words, 0, line)).astype(np.int64)
        elif word in ("DIMENSIONS", "ORIGIN", "SPACING", "ASPECT_RATIO"):
            kind = float if word != "DIMENSIONS" else int
            self._axes[word] = np.array([kind(number) for number in words[:3]])
            if len(self._axes[word]) != 3:
                raise ClipError(f"got {line[:60]!r}, expected three numbers")
        elif word in _AXES:
            self._axes[word] = self._array(_word(words, 1, line), _number(words, 0, line))
        else:
            raise ClipError(f"got {line[:60]!r}, expected a section of a legacy VTK file; save it as .vtu or .vtp")

    def _cell_list(self, words: list[str], line: str) -> tuple[np.ndarray, np.ndarray]:
        """Return (stops, nodes) of the section of cells that the words on its first line announce: where each cell's
        nodes end in `nodes`, and the nodes of all cells. Version 5 of the format has separate arrays for both, older
        ones a single array."""
        first, second = _number(words, 0, line), _number(words, 1, line)
        if self._next_is(b"OFFSETS"):
            kind = self._line().split()[1]
            offsets = self._integers(kind, first)
            head = self._line().split()
            if [word.upper() for word in head[:1]] != ["CONNECTIVITY"] or len(head) < 2:
                raise ClipError(f"{line[:40]}: got no CONNECTIVITY behind the OFFSETS, expected one")
            nodes = self._integers(head[1], second)
            if len(offsets) and offsets[0] != 0:
                raise ClipError(f"{line[:40]}: got offsets that begin with {offsets[0]}, expected 0")
            return offsets[1:], nodes
        numbers = self._integers("int", second)
        starts, at = [], 0
        flat = numbers.tolist()
        for _ in range(first):  # Each cell says how many nodes it has.
            if not 0 <= at < len(flat) or flat[at] < 0:
                raise ClipError(f"{line[:40]}: got cells that do not fit their numbers")
            starts.append(at)
            at += flat[at] + 1
        if at != len(flat):
            raise ClipError(f"{line[:40]}: got {len(flat)} numbers, expected {at}")
        counted = np.array(starts, np.int64)
        return np.cumsum(numbers[counted]), np.delete(numbers, counted)

    def _integers(self, kind: str, count: int) -> np.ndarray:
        values = self._array(kind, count)
        if values.dtype.kind not in "iu":
            raise ClipError(f"cells: got numbers of {kind[:40]}, expected integers")
        self._budget.take(8 * values.size, "cells")
        self._budget.need(NODE_BYTES * values.size, "cells")
        return values.astype(np.int64)

    def _built(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (points, types, stops, nodes) of the data set: points (N, 3), the VTK type of each cell, where its
        nodes end in `nodes`, and the nodes of all cells. Raises ClipError if parts are missing."""
        if not self._kind:
            raise ClipError("got no DATASET, expected one")
        if self._kind == "STRUCTURED_POINTS":
            size, zero = self._dimensions(), np.zeros(3)
            step = self._axes.get("SPACING", self._axes.get("ASPECT_RATIO", np.ones(3)))
            origin = self._axes.get("ORIGIN", zero)
            with np.errstate(
                over="ignore", invalid="ignore"
            ):  # Values that do not fit are refused where they are used.
                self._points = _lattice([origin[i] + step[i] * np.arange(size[i]) for i in range(3)])
        elif self._kind == "RECTILINEAR_GRID":
            axes = [self._axes.get(name, np.zeros(1)) for name in _AXES]
            if self._dimensions() != [len(axis) for axis in axes]:
                raise ClipError(f"DIMENSIONS: got {self._dimensions()}, expected the numbers of coordinates")
            self._points = _lattice(axes)
        if self._points is None:
            raise ClipError("got no POINTS, expected some")
        if self._kind == "POLYDATA":
            return self._points, *poly_cells(self._poly)
        if self._kind == "UNSTRUCTURED_GRID":
            none = np.zeros(0, np.int64)
            stops, nodes = self._cells or (none, none)
            return self._points, self._types, stops, nodes
        size = self._dimensions()
        if int(np.prod(size, dtype=object)) != len(self._points):
            raise ClipError(f"DIMENSIONS: got {size} for {len(self._points)} points")
        return self._points, *lattice_cells(size)

    def _dimensions(self) -> list[int]:
        """Return the number of points along each axis of a structured grid. Raises ClipError."""
        size = self._axes.get("DIMENSIONS", np.zeros(3, int)).tolist()
        count = int(np.prod(size, dtype=object))
        if min(size) < 1:
            raise ClipError(f"DIMENSIONS: got {size}, expected three numbers above 0")
        self._budget.need((3 * 8 + 8 * NODE_BYTES) * count, "points")
        return size

    # ---- attributes ----

    def _attribute(self, place: str, count: int, word: str, words: list[str], line: str) -> None:
        """Read the array that begins with the keyword `word`, such as SCALARS, and store it. `place` is "POINT_DATA" or
        "CELL_DATA", `count` the number of its rows, `words` are the other words of its first line and `line` is that
        line for messages."""
        if word == "LOOKUP_TABLE":
            size = _number(words, 1, line)
            self._array("unsigned_char" if self._is_binary else "float", size, 4)
            self._other["tables of colours"] = None
            return
        name = unquote(_word(words, 0, line))
        if word == "SCALARS":
            width = int(words[2]) if len(words) > 2 else 1
            if self._next_is(b"LOOKUP_TABLE"):
                self._line()
            self._keep(place, name, _word(words, 1, line), count, width)
        elif word == "COLOR_SCALARS":
            self._keep(place, name, "unsigned_char" if self._is_binary else "float", count, _number(words, 1, line))
        elif word == "TEXTURE_COORDINATES":
            self._keep(place, name, _word(words, 2, line), count, _number(words, 1, line))
        elif word in _WIDTHS:
            self._keep(place, name, _word(words, 1, line), count, _WIDTHS[word])
        else:
            raise ClipError(f"got {line[:60]!r}, expected an attribute of a legacy VTK file; save it as .vtu or .vtp")

    def _fields(self, place: str, count: int) -> None:
        """Read the `count` arrays that follow the keyword FIELD and store them under `place`: "POINT_DATA", "CELL_DATA"
        or "FIELD"."""
        for _ in range(count):
            line = self._line()
            if line.upper() == "METADATA":
                self._metadata()
                line = self._line()
            words = line.split()
            name, width, rows = unquote(_word(words, 0, line)), _number(words, 1, line), _number(words, 2, line)
            self._keep(place, name, _word(words, 3, line), rows, width)

    def _keep(self, place: str, name: str, kind: str, count: int, width: int) -> None:
        """Read an array (count, width) of VTK's type `kind` and store it under `place` and `name`. Strings, and fields
        of the whole data set that state no time, are only noted as left out."""
        values = None
        if kind.lower() in _STRINGS:
            self._skip_strings(count * width)
        else:
            values = self._array(kind, count, width)
        if values is not None and (place != "FIELD" or name.lower() in (*TIME_NAMES, *STEP_NAMES)):
            self._data_of[place][name] = values
        else:
            self._left_out.append(f"{name} (field data)" if place == "FIELD" else name)


def _word(words: list[str], place: int, line: str) -> str:
    if place >= len(words):
        raise ClipError(f"got {line[:60]!r}, expected {place + 1} words behind the first")
    return words[place]


def _number(words: list[str], place: int, line: str) -> int:
    word = _word(words, place, line)
    if not word.isascii() or not word.isdigit():
        raise ClipError(f"got {line[:60]!r}, expected a number in place of {word[:20]!r}")
    return int(word)


def _lattice(axes: list[np.ndarray]) -> np.ndarray:
    """Return (N, 3) points of a lattice, x first."""
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)
