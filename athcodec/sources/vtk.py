"""Reads VTK results: .vtu and .vtp files listed with their times in a .pvd, or numbered ones, or numbered .vtk files.

Numbered files are found from any one of them, or by a pattern, as sequence.py says; frames then come options.fps a
second, DEFAULT_FPS (30) without it, and a .pvd beside them that lists the file gives the times instead. See fields.py
for what becomes the motion and cells.py for the cells. VTU and VTP: text, base64 and appended data, plain or compressed
by zlib or LZMA, one piece. Legacy .vtk files, unstructured grids only, are read by meshio. A file is read whole, one at
a time; all are read once to see which data change in time.
"""

from __future__ import annotations

import base64
import binascii
import io
import lzma
import os
import re
import zlib
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr
from os import fspath
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from athcodec.errors import ClipError, MissingExtra
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, check_inside, naming, read_plain
from athcodec.motion.clip import MotionClip
from athcodec.sources import ReadOptions
from athcodec.sources.cells import NODE_BYTES, VTK_NAMES, VTK_NUMBERS, blocks_of, topology_of
from athcodec.sources.fields import clip_of_steps
from athcodec.sources.mesh import same_values
from athcodec.sources.scene_objects import OWN, scene_of_json
from athcodec.sources.sequence import files_to_read
from athcodec.sources.timing import numbered_times, times_in_seconds
from athcodec.sources.xdmf import TEXT_BYTES, parse_xml

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
"""Of the bytes that they may take themselves."""
WORD_BYTES = 16  # Bytes that a byte of a legacy file takes while meshio reads it.
GRIDS = 3  # Grids that are held at once: the first, the latest, and one that is read.
# Cells of PolyData in the order of their data: VTK's numbers of those with so many nodes, and of the others.
_POLY_CELLS = {"Verts": ({1: 1}, 2), "Lines": ({2: 3}, 4), "Polys": ({3: 5, 4: 9}, 7), "Strips": ({}, 6)}
_BROKEN = (
    ValueError,
    KeyError,
    TypeError,
    IndexError,
    OverflowError,
    MemoryError,
    zlib.error,
    lzma.LZMAError,
    binascii.Error,
    ElementTree.ParseError,
)


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the series that `path` belongs to. Raises ClipError where a file is broken or, when its frame is
    read, has other cells than the first; MissingExtra for .vtk without meshio; OSError where one cannot be opened."""
    try:
        files, time, metadata = _files(Path(path), options)
        steps = _Steps(files, options.max_memory // GRIDS)
        if Path(path).is_file():  # an index, or one of the files
            steps.unchanged.add(path)
        name = re.sub(r"[_.\-]*\d+$", "", files[0].stem) or files[0].stem
        said = steps.said | metadata
        return clip_of_steps(steps, time, said, name, options, steps.static(), unchanged=steps.unchanged)
    except _BROKEN as error:
        text = " ".join(str(error).split())
        raise ClipError(text if text.startswith(fspath(path)) else f"{fspath(path)}: {text}") from None


def _files(path: Path, options: ReadOptions) -> tuple[list[Path], np.ndarray, dict[str, Any]]:
    """The files in the order of time, and their times."""
    if path.suffix.lower() == ".pvd":
        return _listed(path, options)
    index = _index_of(path, Budget(options.max_memory))
    if index is not None:
        return _listed(index, options)
    files = files_to_read(path)
    if None in files:
        return list(files.values()), np.zeros(1), {}
    return [*files.values()], *numbered_times(np.array(list(files)), options.fps)


def _index_of(path: Path, budget: Budget) -> Path | None:
    """A .pvd beside a file that lists it."""
    for index in sorted(path.parent.glob("*.pvd")) if path.is_file() else ():
        may_list = index.is_file() and path.name.encode() in read_plain(index, budget)
        if may_list and path in [file for file, _ in _datasets(index, budget)]:
            return index
    return None


def _datasets(index: Path, budget: Budget) -> list[tuple[Path, float]]:
    root = parse_xml(read_plain(index, budget), "VTKFile", budget)
    found = [
        (index.parent / element.get("file", ""), float(element.get("timestep", "nan")), element.get("part", "0"))
        for element in root.iter("DataSet")
    ]
    if not found:
        raise ClipError(f"{index}: got no DataSet, expected some files")
    if len({part for *_, part in found}) > 1:
        raise ClipError(f"{index}: got several parts in a time step, expected one: they have to be merged first")
    return [(file, time) for file, time, _ in found]


def _listed(index: Path, options: ReadOptions) -> tuple[list[Path], np.ndarray, dict[str, Any]]:
    datasets = _datasets(index, Budget(options.max_memory))
    files = [file for file, _ in datasets]
    for file in files:
        check_inside(index.parent, file, options.allow_outside)
    stored = np.array([time for _, time in datasets])
    if len(stored) == 1 and not np.isfinite(stored).all():
        stored = np.zeros(1)
    time, metadata = times_in_seconds(stored, options.fps)
    numbers = [re.search(r"(\d+)$", file.stem) for file in files]
    if "fps" in metadata and all(numbers):
        counted = np.array([float(number[1]) for number in numbers])
        if np.allclose(counted - counted[0], time * metadata["fps"], rtol=0, atol=1e-6):
            metadata["start_frame"] = int(counted[0])
    return files, time, metadata


class _Steps:
    """See fields.Steps."""

    def __init__(self, files: Sequence[Path], max_memory: int):
        self._files, self._max_memory = list(files), max_memory  # The frames of one file.
        self.unchanged = FileWatch(*self._files)
        self._now: tuple[int, _Grid] | None = None
        first = self._grid(0)
        self._cells, self.said, self.left_out = first.cells, first.said, first.left_out
        self.topology = topology_of(blocks_of(*first.cells, VTK_NAMES), len(first.points))
        self._fields, self.elsewhere = list(first.point_data), dict.fromkeys(first.cell_data, "cell")
        self._static, still, self._fixed = dict(first.point_data), dict(first.cell_data), True
        names = dict.fromkeys(self._fields), dict.fromkeys(still)
        for step in range(1, len(files)):
            grid = self._grid(step)
            self._fixed = self._fixed and np.array_equal(grid.points, first.points)
            for same, all_names, data in zip((self._static, still), names, (grid.point_data, grid.cell_data)):
                all_names.update(dict.fromkeys(data))
                for name in [name for name, values in same.items() if not same_values(values, data.get(name))]:
                    del same[name]
        for name, values in still.items():
            self.topology.add_cell_data(name, values)
        self.left_out += [name for name in names[0] if name not in first.point_data]
        self.left_out += [name for name in names[1] if name not in still]

    def static(self) -> dict[str, np.ndarray]:
        return self._static

    def fixed_points(self) -> bool:
        return self._fixed

    def points(self, step: int) -> np.ndarray:
        return self._grid(step).points

    def fields(self) -> list[str]:
        return self._fields

    def field(self, step: int, name: str) -> np.ndarray:
        if name not in self._grid(step).point_data:
            raise ClipError(f"{self._files[step]}: got no field {name!r}, expected one as in the first file")
        return self._grid(step).point_data[name]

    def check(self, step: int) -> None:
        if not all(map(np.array_equal, self._grid(step).cells, self._cells)):
            raise ClipError(
                f"frame {step}, {self._files[step].name}: got other cells than in {self._files[0].name}; "
                "topology that changes cannot be coded"
            )

    def _grid(self, step: int) -> _Grid:
        if self._now is None or self._now[0] != step:
            self._now = step, _read_grid(self._files[step], Budget(self._max_memory))
        return self._now[1]


class _Grid:
    """points (N, 3), data per point and cell, and cells: types, and where their nodes start and stop in a list; said:
    what our writer adds."""

    def __init__(
        self,
        points: np.ndarray,
        cells: tuple[np.ndarray, ...],
        point_data: dict,
        cell_data: dict,
        said: dict[str, Any] | None = None,
        left_out: Sequence[str] = (),
    ):
        self.points, self.cells, self.said = points, cells, said or {}
        self.point_data = {name: values for name, values in point_data.items() if len(values) == len(points) and name}
        self.cell_data = {name: values for name, values in cell_data.items() if len(values) == len(cells[0]) and name}
        self.left_out = [*left_out, *sorted({*point_data, *cell_data} - {*self.point_data, *self.cell_data})]


def _read_grid(path: Path, budget: Budget) -> _Grid:
    if path.is_dir():
        raise ClipError(f"{path}: got a folder, expected a plain file")
    if path.suffix.lower() == ".vtk":
        budget.need(WORD_BYTES * os.stat(path).st_size, fspath(path))
        open_plain(path).close()
        return _legacy_grid(path)
    with naming(path, *_BROKEN):
        return _Vtu(read_plain(path, budget), budget).grid()


def _legacy_grid(path: Path) -> _Grid:
    try:
        from meshio import vtk
    except ImportError:
        raise MissingExtra('VTK files: need meshio: pip install "athcodec[mesh]"') from None
    try:
        with redirect_stderr(io.StringIO()):  # meshio's warnings quote the file
            mesh = vtk.read(path)
    except OSError:
        raise
    except Exception as error:  # meshio trusts its files: a damaged one may raise any exception
        text = " ".join(str(error).split()) or type(error).__name__
        if isinstance(error, KeyError):
            text = f"meshio does not know what it calls {text}; save it as .vtu"
        raise ClipError(f"{path}: the VTK file cannot be read: {text[:200]}") from None
    counts = [np.full(len(block.data), np.shape(block.data)[1] if len(block.data) else 0) for block in mesh.cells]
    kinds = [np.full(len(block.data), VTK_NUMBERS.get(block.type, 0)) for block in mesh.cells]
    stops = np.cumsum(np.concatenate([np.zeros(0, int), *counts]))
    starts = stops - np.concatenate([np.zeros(0, int), *counts])
    nodes = np.concatenate([np.zeros(0, np.int64), *(_in_vtk_order(block).reshape(-1) for block in mesh.cells)])
    cells = np.concatenate([np.zeros(0, int), *kinds]), starts, stops, nodes
    cell_data = {name: np.concatenate(values) for name, values in mesh.cell_data.items()}
    return _Grid(mesh.points, cells, {name: np.asarray(values) for name, values in mesh.point_data.items()}, cell_data)


def _in_vtk_order(block: Any) -> np.ndarray:
    """Return the cells of a block in the order of the file: meshio turns wedges inside out, which it alone does."""
    data = np.asarray(block.data)
    return data[:, [0, 2, 1, 3, 5, 4]] if block.type == "wedge" else data


class _Vtu:
    """The arrays of one VTU or VTP file."""

    def __init__(self, data: bytes, budget: Budget):
        self._budget = budget
        data, self._appended = _without_raw(data)
        self._root = parse_xml(data, "VTKFile", budget)
        self._type, self._left_out = self._root.get("type"), []
        if self._type not in ("UnstructuredGrid", "PolyData"):
            raise ClipError(f"got a VTK file of the type {self._type!r}, expected UnstructuredGrid or PolyData")
        order = ">" if self._root.get("byte_order") == "BigEndian" else "<"
        self._order = order
        self._count = np.dtype(_TYPES[self._root.get("header_type", "UInt32")]).newbyteorder(order)
        name = self._root.get("compressor")
        if name and name not in _UNPACKERS:
            raise ClipError(f"got data packed by {name[:40]!r}, expected one of {', '.join(_UNPACKERS)}")
        self._unpack = _UNPACKERS.get(name or "")

    def grid(self) -> _Grid:
        pieces = self._root.findall(f"{self._type}/Piece")
        if len(pieces) != 1:
            raise ClipError(f"got {len(pieces)} pieces, expected one")
        piece = pieces[0]
        points = piece.find("Points/DataArray")
        if points is None:
            raise ClipError("got no points, expected some")
        types, stops, nodes = self._poly_cells(piece) if self._type == "PolyData" else self._cells(piece, "Cells")
        starts = np.concatenate([[0], stops[:-1]]).astype(np.int64) if len(stops) else stops
        if (
            len(types) != len(stops)
            or (starts > stops).any()
            or (len(stops) and stops[-1] > len(nodes))
            or (len(starts) and starts.min() < 0)
        ):
            raise ClipError("cells: got offsets that do not fit types and nodes")
        found = self._array(points).reshape(-1, int(points.get("NumberOfComponents") or 3))
        said = piece.get("NumberOfPoints")
        if said is not None and int(said) != len(found):
            raise ClipError(f"points: got {len(found)}, expected {int(said)}")
        data = [self._arrays(piece, tag) for tag in ("PointData", "CellData")]
        return _Grid(found, (types, starts, stops, nodes), *data, self._said(), self._left_out)

    def _cells(self, piece: ElementTree.Element, tag: str) -> list[np.ndarray]:
        """Types, ends and nodes of cells; none of what the file does not list."""
        cells = {element.get("Name"): element for element in piece.findall(f"{tag}/DataArray")}
        names = ("types", "offsets", "connectivity")
        return [self._integers(cells[name]) if name in cells else np.zeros(0, np.int64) for name in names]

    def _poly_cells(self, piece: ElementTree.Element) -> list[np.ndarray]:
        """Types, ends and nodes of PolyData's cells, which are in a list for each kind."""
        types, stops, nodes = [], [], []
        for tag, (numbers, other) in _POLY_CELLS.items():
            _, ends, corners = self._cells(piece, tag)
            types.append(np.array([numbers.get(size, other) for size in np.diff(ends, prepend=0).tolist()], np.int64))
            stops.append(ends + sum(map(len, nodes)))
            nodes.append(corners)
        return [np.concatenate(each) for each in (types, stops, nodes)]

    def _said(self) -> dict[str, Any]:
        for element in self._root.findall(f"{self._type}/FieldData/DataArray"):
            if element.get("Name") == OWN and element.get("type") == "UInt8":
                return scene_of_json(self._array(element).tobytes())
        return {}

    def _arrays(self, piece: ElementTree.Element, tag: str) -> dict[str, np.ndarray]:
        found = {}
        for element in (*piece.findall(f"{tag}/DataArray"), *piece.findall(f"{tag}/Array")):
            if element.get("type") not in _TYPES:
                self._left_out.append(element.get("Name", ""))
            else:
                width, values = int(element.get("NumberOfComponents") or 1), self._array(element)
                found[element.get("Name", "")] = values if width == 1 else values.reshape(-1, width)
        return found

    def _integers(self, element: ElementTree.Element) -> np.ndarray:
        values = self._array(element)
        if values.dtype.kind not in "iu":
            raise ClipError(f"cells: got {element.get('Name')} of {values.dtype}, expected integers")
        self._budget.take(8 * values.size, "cells")
        self._budget.need(NODE_BYTES * values.size, "cells")
        return values.astype(np.int64)

    def _array(self, element: ElementTree.Element) -> np.ndarray:
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
        if self._appended is not None:
            if not 0 <= offset < len(self._appended):
                raise ClipError(f"got data at {offset}, expected less than {len(self._appended)}")
            return self._unpacked(self._appended[offset:])
        element = self._root.find("AppendedData")
        text = "" if element is None else (element.text or "").strip().removeprefix("_")
        return self._decoded(text[offset:].encode())

    def _decoded(self, text: bytes) -> bytes:
        """Base64: the counts before packed data are encoded by themselves."""
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
    """The first `size` bytes."""
    data = base64.b64decode(text[: 4 * ((size + 2) // 3)], validate=False)
    if len(data) < size:
        raise ClipError(f"got {len(data)} bytes of data, expected {size}")
    return data[:size]


def _without_raw(data: bytes) -> tuple[bytes, bytes | None]:
    """The XML of a file without the raw bytes that are appended in it, and these; None where there are none."""
    found = re.search(rb"<AppendedData[^>]*encoding\s*=\s*[\"']raw[\"'][^>]*>", data)
    if not found:
        return data, None
    end = data.rfind(b"</AppendedData>")
    start = data.find(b"_", found.end()) + 1
    if not found.end() < start <= end:
        raise ClipError("got no end of the appended data")
    return data[: found.end()] + data[end:], data[start:end]
