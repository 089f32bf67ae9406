"""Reads VTK's XML files: the data sets of .vtu, .vtp and .vts, and what .pvtu, .pvtp, .pvts, .vtm ... list.

Text, base64 and appended data, plain or packed by zlib or LZMA. The pieces of a file are joined. Not read: images and
rectilinear grids, polyhedra, several time steps in one file, arrays of strings, names of components, other information
on arrays.
"""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.reading import Budget
from athcodec.sources.cells import NODE_BYTES
from athcodec.sources.scene_objects import OWN, scene_of_json
from athcodec.sources.vtk_grid import (
    POLY_CELLS,
    STEP_NAMES,
    TIME_NAMES,
    Grid,
    joined,
    lattice_cells,
    poly_cells,
    starts_of,
)
from athcodec.sources.xml_tree import TEXT_BYTES, parse_xml
from athcodec.untyped import JsonObject

_TYPES = {
    "Float32": "f4",
    "Float64": "f8",
    "Int8": "i1",
    "Int16": "i2",
    "Int32": "i4",
    "Int64": "i8",
    "UInt8": "u1",
    "UInt16": "u2",
    "UInt32": "u4",
    "UInt64": "u8",
}
_UNPACKERS: dict[str, Callable[[int], Any]] = {
    "vtkZLibDataCompressor": lambda room: zlib.decompressobj(),
    "vtkLZMADataCompressor": lambda room: lzma.LZMADecompressor(memlimit=room),
}
"""Makers of what unpacks a block, given the bytes of memory that it may take."""
_DATA_SETS = ("UnstructuredGrid", "PolyData", "StructuredGrid")
# Types of files that list others: the tag and the attribute that name a file.
_LISTS = {
    "PUnstructuredGrid": ("Piece", "Source"),
    "PPolyData": ("Piece", "Source"),
    "PStructuredGrid": ("Piece", "Source"),
    "vtkMultiBlockDataSet": ("DataSet", "file"),
    "vtkPartitionedDataSet": ("DataSet", "file"),
    "vtkPartitionedDataSetCollection": ("DataSet", "file"),
}
_READ_TAGS = frozenset("AppendedData FieldData Piece Points Cells PointData CellData".split()).union(POLY_CELLS)


@dataclass(frozen=True)
class Listed:
    """A file that another one lists: the name of the object that it holds, "" for none, and the path as it is there."""

    name: str
    file: str


class VtkXml:
    """The content of one file of VTK's XML formats. Raises ClipError where it is none of those that are read."""

    def __init__(self, data: bytes, budget: Budget):
        """Parse a VTK XML file whose content is `data`. Raises ClipError if its type or compression is none that is
        read."""
        self._budget = budget
        data, self._appended = _without_raw(data)
        self._root = parse_xml(data, "VTKFile", budget)
        self._type = self._root.get("type") or ""
        self._left_out: list[str] = []
        self._other: dict[str, None] = {}
        if self._type not in _LISTS and self._type not in _DATA_SETS:
            raise ClipError(
                f"got a VTK file of the type {self._type[:40]!r}, expected {', '.join(_DATA_SETS)} or a list of such "
                "files; save it as .vtu or .vtp"
            )
        self._order: Literal["<", ">"] = ">" if self._root.get("byte_order") == "BigEndian" else "<"
        self._count = np.dtype(_TYPES[self._root.get("header_type", "UInt32")]).newbyteorder(self._order)
        name = self._root.get("compressor")
        if name and name not in _UNPACKERS:
            raise ClipError(
                f"got data packed by {name[:40]!r}, expected one of {', '.join(_UNPACKERS)}; save it with one of them"
            )
        self._unpack = _UNPACKERS.get(name or "")

    def files(self) -> list[Listed] | None:
        """Return the files that a list of files (.pvtu, .vtm ...) names, or None if this file is a data set itself.
        Raises ClipError if the list is empty."""
        if self._type not in _LISTS:
            return None
        tag, attribute = _LISTS[self._type]
        names = {element: parent.get("name", "") for parent in self._root.iter() for element in parent}
        files = [
            Listed(element.get("name") or names.get(element, ""), element.get(attribute, ""))
            for element in self._root.iter(tag)
            if element.get(attribute)
        ]
        if not files:
            raise ClipError(f"got no {tag} with a {attribute}, expected the files of a {self._type}")
        return files

    def fields(self) -> tuple[dict[str, np.ndarray], JsonObject, list[str]]:
        """Return (times, metadata, others) of the field data: arrays that may state the time, by name; what athcodec's
        own writer stored; and the names of the other fields."""
        times: dict[str, np.ndarray] = {}
        metadata: JsonObject = {}
        others = []
        for field in self._root.iter("FieldData"):
            for element in field:
                name, is_number = element.get("Name", ""), element.get("type") in _TYPES
                if name == OWN and element.get("type") == "UInt8":
                    metadata |= {OWN: True} | scene_of_json(self._array(element).tobytes())
                elif is_number and name.lower() in (*TIME_NAMES, *STEP_NAMES):
                    times.setdefault(name, self._array(element))
                else:
                    others.append(f"{name} (field data)")
        return times, metadata, others

    def grid(self) -> Grid:
        """Return the data set with its pieces joined. Raises ClipError or, for a broken file, ValueError, KeyError and
        the like."""
        whole = self._root.find(self._type)
        pieces = [] if whole is None else whole.findall("Piece")
        if whole is None or not pieces:
            raise ClipError("got no piece, expected one at least")
        steps = {element.get("TimeStep") for element in whole.iter("DataArray")} - {None}
        steps |= set((whole.get("TimeValues") or "").split()[1:])
        if len(steps) > 1:
            raise ClipError("got several time steps in one file (TimeValues), expected one; save each step as a file")
        self._name_others(whole)
        times, metadata, others = self.fields()
        grid = joined([self._piece(piece) for piece in pieces], [""] * len(pieces))
        grid.field_data, grid.metadata = times, metadata
        grid.left_out = list(dict.fromkeys([*grid.left_out, *self._left_out, *others]))
        grid.other = list(self._other)
        return grid

    def _name_others(self, whole: ElementTree.Element) -> None:
        """Note the names of elements and keys in the file that are not read. `whole` is the element of the data set."""
        for element in (*self._root, *whole, *(part for piece in whole.findall("Piece") for part in piece)):
            if element.tag not in _READ_TAGS and element.tag != self._type:
                self._other[element.tag[:40]] = None
        for element in whole.iter():
            if element.tag == "InformationKey" and "L2_NORM" not in element.get("name", ""):
                self._other[element.get("name", "")[:40]] = None
            elif any(key.startswith("ComponentName") for key in element.attrib):
                self._other["names of components"] = None

    def _piece(self, piece: ElementTree.Element) -> Grid:
        """Return the points, cells and arrays of one Piece element as a data set. Raises ClipError."""
        points = piece.find("Points/DataArray")
        if points is None:
            if int(piece.get("NumberOfPoints", "-1")) != 0:
                raise ClipError("got no points, expected some")
            coordinates = np.zeros((0, 3), np.float32)
        else:
            coordinates = self._array(points).reshape(-1, int(points.get("NumberOfComponents") or 3))
        stated = piece.get("NumberOfPoints")
        if stated is not None and int(stated) != len(coordinates):
            raise ClipError(f"points: got {len(coordinates)}, expected {int(stated)}")
        if self._type == "StructuredGrid":
            types, stops, nodes = self._lattice(piece, len(coordinates))
        elif self._type == "PolyData":
            types, stops, nodes = poly_cells({tag: self._cells(piece, tag)[1:] for tag in POLY_CELLS})
        else:
            types, stops, nodes = self._cells(piece, "Cells")
        point_data, cell_data = self._arrays(piece, "PointData"), self._arrays(piece, "CellData")
        return Grid(coordinates, types, starts_of(stops), stops, nodes, point_data, cell_data)

    def _lattice(self, piece: ElementTree.Element, point_count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return types, stops and nodes of the cells between the points of a structured grid, by its extent."""
        ends = [int(number) for number in (piece.get("Extent") or "").split()]
        size = [last - first + 1 for first, last in zip(ends[::2], ends[1::2])]
        if len(size) != 3 or min(size) < 1 or size[0] * size[1] * size[2] != point_count:
            raise ClipError(f"got the extent {piece.get('Extent')!r} of {point_count} points, expected one that fits")
        self._budget.need(8 * NODE_BYTES * point_count, "cells")
        return lattice_cells(size)

    def _cells(self, piece: ElementTree.Element, tag: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return types, ends and nodes of cells; none of what the file does not list."""
        cells = {element.get("Name"): element for element in piece.findall(f"{tag}/DataArray")}
        none = np.zeros(0, np.int64)
        types, stops, nodes = (
            self._integers(cells[name]) if name in cells else none for name in ("types", "offsets", "connectivity")
        )
        return types, stops, nodes

    def _arrays(self, piece: ElementTree.Element, tag: str) -> dict[str, np.ndarray]:
        """Return by name the arrays in a piece's `tag`, "PointData" or "CellData". Arrays of an unknown type are noted
        as left out."""
        arrays = {}
        for element in (*piece.findall(f"{tag}/DataArray"), *piece.findall(f"{tag}/Array")):
            name = element.get("Name", "")
            if element.get("type") not in _TYPES or name in arrays:
                self._left_out.append(name)
            else:
                width, values = int(element.get("NumberOfComponents") or 1), self._array(element)
                arrays[name] = values if width == 1 else values.reshape(-1, width)
        return arrays

    def _integers(self, element: ElementTree.Element) -> np.ndarray:
        values = self._array(element)
        if values.dtype.kind not in "iu":
            raise ClipError(f"cells: got {element.get('Name')} of {values.dtype}, expected integers")
        self._budget.take(8 * values.size, "cells")
        self._budget.need(NODE_BYTES * values.size, "cells")
        return values.astype(np.int64)

    def _array(self, element: ElementTree.Element) -> np.ndarray:
        """Return the numbers of a DataArray element, which may be text, base64 or appended raw bytes. Raises
        ClipError."""
        dtype = np.dtype(_TYPES[element.get("type", "")])
        form = element.get("format", "ascii")
        if form == "ascii":
            self._budget.need(TEXT_BYTES * len(element.text or ""), element.get("Name", "points"))
            words = (element.text or "").split()
            # Values that do not fit are refused where they are used.
            with np.errstate(over="ignore", invalid="ignore"):
                return np.array(words, np.float64 if dtype.kind == "f" else np.int64).astype(dtype)
        if form == "binary":
            data = self._decoded((element.text or "").strip().encode())
        elif form == "appended":
            data = self._appended_at(int(element.get("offset", "0")))
        else:
            raise ClipError(f"got data in the format {form[:40]!r}, expected ascii, binary or appended")
        self._budget.take(len(data), element.get("Name", "points"))
        return np.frombuffer(data, dtype.newbyteorder(self._order)).astype(dtype)

    def _appended_at(self, offset: int) -> bytes:
        """Return the bytes of the array that begins at `offset` in the file's AppendedData element."""
        if self._appended is not None:
            if not 0 <= offset < len(self._appended):
                raise ClipError(f"got data at {offset}, expected less than {len(self._appended)}")
            return self._unpacked(self._appended[offset:])
        element = self._root.find("AppendedData")
        text = "" if element is None else (element.text or "").strip().removeprefix("_")
        return self._decoded(text[offset:].encode())

    def _decoded(self, text: bytes) -> bytes:
        """Return the bytes of an array from its base64 text, decompressed if the file has a compressor. The counts in
        front of compressed data are base64 text of their own."""
        size = self._count.itemsize
        if self._unpack is None:
            length = self._numbers(_from_base64(text, size), 1)[0]
            return _from_base64(text, size + length)[size:]
        blocks = self._numbers(_from_base64(text, size), 1)[0]
        head_bytes = size * (3 + blocks)
        head = _from_base64(text, head_bytes)
        packed = sum(self._numbers(head, 3 + blocks)[3:])
        body = text[4 * ((head_bytes + 2) // 3) :]
        return self._unpacked(head + _from_base64(body, packed))

    def _unpacked(self, data: bytes) -> bytes:
        """Return the bytes of an array that follow the header of sizes at the beginning of `data`, decompressed if the
        file has a compressor. Raises ClipError if bytes are missing."""
        size = self._count.itemsize
        first = self._numbers(data, 1)[0]
        if self._unpack is None:
            if len(data) < size + first:
                raise ClipError(f"got {len(data) - size} bytes of data, expected {first}")
            return data[size : size + first]
        sizes = self._numbers(data, 3 + first)
        at, parts = size * (3 + first), []
        whole_size = sizes[1] * (first - bool(sizes[2])) + sizes[2] if first else 0
        self._budget.need(2 * whole_size, "packed data")
        for length in sizes[3:]:
            block = self._unpack(self._budget.left).decompress(
                data[at : at + length], max(1, min(sizes[1], whole_size))
            )
            parts.append(block)
            at += length
        joined = b"".join(parts)
        if len(joined) != whole_size:
            raise ClipError(f"got {len(joined)} bytes of unpacked data, expected {whole_size}")
        return joined

    def _numbers(self, data: bytes, count: int) -> list[int]:
        if not 0 <= count * self._count.itemsize <= len(data):
            raise ClipError(f"got {len(data)} bytes of data, expected {count} counts before it")
        return np.frombuffer(data, self._count, count).tolist()


def _from_base64(text: bytes, size: int) -> bytes:
    """Return the first `size` bytes."""
    data = base64.b64decode(text[: 4 * ((size + 2) // 3)], validate=False)
    if len(data) < size:
        raise ClipError(f"got {len(data)} bytes of data, expected {size}")
    return data[:size]


def _without_raw(data: bytes) -> tuple[bytes, bytes | None]:
    """Return (xml, raw): the file's XML without the raw bytes appended in it, and these bytes, None if there are none.
    Raises ClipError if the appended data has no end."""
    tags = re.finditer(rb"<AppendedData([^<>]*+)>", data)
    match = next((tag for tag in tags if re.search(rb"encoding\s*+=\s*+[\"']raw[\"']", tag[1])), None)
    if match is None:
        return data, None
    end = data.rfind(b"</AppendedData>")
    start = data.find(b"_", match.end()) + 1
    if not match.end() < start <= end:
        raise ClipError("got no end of the appended data")
    return data[: match.end()] + data[end:], data[start:end]
