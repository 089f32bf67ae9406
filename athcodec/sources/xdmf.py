"""Reads XDMF time series: a temporal collection of grids, data in HDF5, raw binary or text.

The mesh may be in every step, in the first one, or in a grid of its own that the steps include (as meshio and FEniCS
write it). See fields.py for what becomes the motion and cells.py for the cells. Not read: structured grids, spatial
collections (parallel pieces), polyhedra, functions of data. Files that the XML names must lie where it says; data of
HDF5 are read when a frame is asked for.
"""

from __future__ import annotations

import json
import re
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import h5py
import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget, FileWatch, closing_on_failure, file_beside, naming, no_room, read_plain
from athcodec.motion.clip import MotionClip, frame_rate
from athcodec.sources import ReadOptions
from athcodec.sources.cells import NODE_BYTES, NODES, Block, blocks_of, topology_of
from athcodec.sources.fields import clip_of_steps
from athcodec.sources.hdf5 import check_own, chunk_bytes, unpacks_to_more
from athcodec.sources.mesh import same_values
from athcodec.sources.scene_objects import MATERIAL_NAMES
from athcodec.sources.timing import times_in_seconds, whole

XML_BYTES, TEXT_BYTES = 224, 40  # Bytes that an element or attribute takes, and a byte of text that becomes numbers.
MIXED = {
    1: "poly_vertex",
    2: "poly_line",
    3: "polygon",
    4: "triangle",
    5: "quad",
    6: "tetra",
    7: "pyramid",
    8: "wedge",
    9: "hexahedron",
    34: "line3",
    35: "quad9",
    36: "triangle6",
    37: "quad8",
    38: "tetra10",
    39: "pyramid13",
    40: "wedge15",
    41: "wedge18",
    48: "hexahedron20",
    49: "hexahedron24",
    50: "hexahedron27",
}
COUNTED = (1, 2, 3)
TOPOLOGIES = {
    "triangle": "triangle",
    "quadrilateral": "quad",
    "tetrahedron": "tetra",
    "hexahedron": "hexahedron",
    "wedge": "wedge",
    "pyramid": "pyramid",
    "edge_3": "line3",
    "triangle_6": "triangle6",
    "tri_6": "triangle6",
    "quadrilateral_8": "quad8",
    "quad_8": "quad8",
    "quadrilateral_9": "quad9",
    "quad_9": "quad9",
    "tetrahedron_10": "tetra10",
    "tet_10": "tetra10",
    "pyramid_13": "pyramid13",
    "wedge_15": "wedge15",
    "wedge_18": "wedge18",
    "hexahedron_20": "hexahedron20",
    "hex_20": "hexahedron20",
    "hexahedron_24": "hexahedron24",
    "hex_24": "hexahedron24",
    "hexahedron_27": "hexahedron27",
    "hex_27": "hexahedron27",
    "line": "line",
}
PLAIN = {"polyvertex": "poly_vertex", "polyline": "poly_line", "polygon": "polygon"}
_NAMED_DOCTYPE = re.compile(rb"""<!DOCTYPE\s+[\w.:-]+(\s+SYSTEM\s+("[^"<>]*"|'[^'<>]*'))?\s*(\[\s*\])?\s*>""")
_KINDS = {"float": "f", "int": "i", "uint": "u", "char": "i", "uchar": "u", "short": "i", "ushort": "u"}
_SIZES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2}
_XML_ERRORS = (ElementTree.ParseError, ValueError, KeyError, OverflowError, IndexError, TypeError, MemoryError)


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the XDMF file `path`. Raises ClipError where it or what it names is no usable series, OSError
    where the file cannot be opened."""
    data = Data(Path(path), options.allow_outside, Budget(options.max_memory))
    with naming(path, *_XML_ERRORS), closing_on_failure(data):
        steps = _Steps(data, parse_xml(read_plain(path, data.budget), "Xdmf", data.budget), options)
        time, metadata = steps.times(options)
        return clip_of_steps(steps, time, metadata, Path(path).stem, options, steps.static(), data, data.unchanged)


def parse_xml(data: bytes, tag: str, budget: Budget) -> ElementTree.Element:
    """The root element, of this tag. A DOCTYPE with declarations is refused: entities, and the defaults of attributes,
    can grow without end."""
    if b"<!DOCTYPE" in _NAMED_DOCTYPE.sub(b"", data, count=1) or b"\0" in data:
        raise ClipError("got XML with declarations in its DOCTYPE or in UTF-16, expected plain UTF-8 without any")
    budget.need_for(data, b"<=", XML_BYTES, "XML")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # LookupError: an unknown encoding
        raise ClipError(f"got no XML: {error}") from None
    if root.tag != tag:
        raise ClipError(f"got the XML of {root.tag[:40]!r}, expected {tag}")
    return root


class Data:
    """DataItems of one XDMF file, and the HDF5 files that they lie in, open until close()."""

    def __init__(self, path: Path, allow_outside: bool, budget: Budget):
        self._folder, self._allow_outside, self.budget = path.resolve().parent, allow_outside, budget
        self._files: dict[Path, h5py.File] = {}
        self.unchanged = FileWatch(path.resolve())

    def close(self) -> None:
        for file in self._files.values():
            file.close()

    def read(self, item: ElementTree.Element | None) -> np.ndarray:
        """The array of a DataItem. Raises ClipError."""
        if item is None:
            raise ClipError("got no DataItem, expected one")
        if item.get("Reference"):
            raise ClipError("DataItem: got a reference to another, expected data")
        kind = item.get("ItemType", "Uniform")
        if kind == "HyperSlab":
            return self._slab(item)
        if kind != "Uniform":
            raise ClipError(f"DataItem: got the type {kind[:40]!r}, expected Uniform or HyperSlab")
        form = item.get("Format", "XML").upper()
        if form == "HDF":
            return self._hdf(item)
        shape = tuple(int(size) for size in item.get("Dimensions", "").split())
        values = self._text(item) if form == "XML" else self._binary(item, shape) if form == "BINARY" else None
        if values is None:
            raise ClipError(f"DataItem: got the format {form[:40]!r}, expected HDF, Binary or XML")
        if min(shape, default=0) < 0 or values.size != int(np.prod(shape, dtype=object)):
            raise ClipError(f"DataItem: got {values.size} numbers, expected {shape}")
        return values.reshape(shape)

    def _text(self, item: ElementTree.Element) -> np.ndarray:
        text = item.text or ""
        self.budget.need(TEXT_BYTES * len(text), "DataItem")
        with np.errstate(over="ignore", invalid="ignore"):  # Values that do not fit are refused where they are used.
            return np.array(text.split(), np.float64).astype(_dtype(item))

    def _binary(self, item: ElementTree.Element, shape: tuple[int, ...]) -> np.ndarray:
        path = self._file_named((item.text or "").strip())
        order = {"big": ">", "little": "<"}.get(item.get("Endian", "").lower(), "=")
        dtype, count = _dtype(item).newbyteorder(order), int(np.prod(shape, dtype=object))
        seek = int(item.get("Seek", 0))
        if not 0 <= seek <= path.stat().st_size - count * dtype.itemsize or min(shape, default=0) < 0:
            raise ClipError(f"{path.name}: got {path.stat().st_size} bytes, expected {shape} of {dtype} at {seek}")
        self.budget.need(2 * count * dtype.itemsize, path.name)
        return np.fromfile(path, dtype, count, offset=seek).astype(dtype.newbyteorder("="))

    def _hdf(self, item: ElementTree.Element, selection: Any = ()) -> np.ndarray:
        name, _, inside = (item.text or "").strip().rpartition(":")
        path = self._file_named(name)
        if path not in self._files:
            self._files[path] = _open_hdf(path)
        try:
            check_own(self._files[path], inside, self._allow_outside)
            dataset = self._files[path][inside]
            if not isinstance(dataset, h5py.Dataset) or dataset.shape is None or dataset.dtype.kind not in "fiu":
                raise ClipError(f"{path.name}: {inside[:80]!r}: got no array of numbers")
            size = (
                dataset.nbytes
                if selection == ()
                else dataset.dtype.itemsize
                * int(np.prod([len(range(*part.indices(length))) for part, length in zip(selection, dataset.shape)]))
            )
            self.budget.need(2 * size + chunk_bytes(dataset), f"{path.name}: {inside[:80]!r}")
            if unpacks_to_more(dataset, self.budget.left):
                raise ClipError(
                    f"{path.name}: {inside[:80]!r}: got chunks that may unpack to any size, but "
                    + no_room(self.budget.limit)
                )
            return np.asarray(dataset[selection]).astype(dataset.dtype.newbyteorder("="), copy=False)
        except (KeyError, OSError, RuntimeError, TypeError, ValueError) as error:
            if isinstance(error, ClipError):
                raise
            raise ClipError(f"{path.name}: {inside[:80]!r}: cannot be read: {error}") from None

    def _slab(self, item: ElementTree.Element) -> np.ndarray:
        children = item.findall("DataItem")
        if len(children) != 2:
            raise ClipError(f"HyperSlab: got {len(children)} DataItems, expected two")
        start, stride, count = self.read(children[0]).reshape(3, -1).astype(np.int64)
        if (start < 0).any() or (stride < 1).any() or (count < 0).any():
            raise ClipError("HyperSlab: got a negative start or count, expected some of the data")
        selection = tuple(
            slice(a, a + (n - 1) * step + 1 if n else a, step)
            for a, step, n in zip(start.tolist(), stride.tolist(), count.tolist())
        )
        source = children[1]
        whole_file = source.get("Format", "").upper() == "HDF"
        values = self._hdf(source, selection) if whole_file else self.read(source)[selection]
        shape = tuple(int(size) for size in item.get("Dimensions", "").split()) or tuple(count)
        return values.reshape(shape)

    def _file_named(self, name: str) -> Path:
        path = file_beside(self._folder, name, self._allow_outside)
        if not path.is_file():
            raise ClipError(f"DataItem: got the file {name[:80]!r}, which does not exist")
        self.unchanged.add(path)
        return path


def _open_hdf(path: Path) -> h5py.File:
    try:
        return h5py.File(path, "r")
    except OSError as error:
        raise ClipError(f"{path.name}: the HDF5 file cannot be opened: {error}") from None


def _dtype(item: ElementTree.Element) -> np.dtype:
    kind = (item.get("NumberType") or item.get("DataType") or "Float").lower()
    size = int(item.get("Precision") or _SIZES.get(kind, 4))
    if kind not in _KINDS or size not in (1, 2, 4, 8) or (_KINDS[kind] == "f" and size < 4):
        raise ClipError(f"DataItem: got numbers of {kind[:40]!r} with {size} bytes")
    return np.dtype(f"{_KINDS[kind]}{size}")


class _Steps:
    """See fields.Steps."""

    def __init__(self, data: Data, root: ElementTree.Element, options: ReadOptions):
        self._data, self._root = data, root
        self._series, self._grids = _find_steps(root, options.field)
        own = next(
            (
                grid
                for grid in [*root.iter("Grid")]
                if grid.get("GridType", "Uniform") == "Uniform" and grid.find("Geometry") is not None
            ),
            None,
        )
        if own is None:
            raise ClipError("got no grid with a Geometry, expected points")
        self._mesh = self._grids[0] if self._grids[0].find("Geometry") is not None else own
        self._first_blocks = self._blocks(self._topology_element(0))
        self.topology = topology_of(self._first_blocks, len(self.points(0)))
        self.elsewhere = {name: center for name, center, _ in self._attributes(0) if center != "node"}
        self.left_out = self._add_cell_data()

    def times(self, options: ReadOptions) -> tuple[np.ndarray, dict[str, Any]]:
        """(T,) seconds from 0, and what the file says of rate, unit and up axis."""
        said = _information(self._root)
        fps = said.get("fps") if options.fps is None else options.fps
        stored = self._stored_times(fps)
        time, metadata = times_in_seconds(stored, fps)
        if "start_frame" in said:
            start = float(said["start_frame"]) + stored[0] * frame_rate(metadata)
            metadata["start_frame"] = whole(round(start, 6))
        return time, said | metadata

    def _stored_times(self, fps: float | None) -> np.ndarray:
        values = [grid.find("Time") for grid in self._grids]
        if all(value is not None and value.get("Value") for value in values):
            return np.array([float(value.get("Value")) for value in values])
        common = self._series.find("Time") if self._series is not None else None
        if common is None:
            return np.arange(len(self._grids)) / frame_rate({} if fps is None else {"fps": fps})
        numbers = self._data.read(common.find("DataItem")).reshape(-1).astype(np.float64)
        if common.get("TimeType", "Single") == "HyperSlab" and len(numbers) == 3:
            numbers = numbers[0] + numbers[1] * np.arange(len(self._grids))
        if len(numbers) != len(self._grids):
            raise ClipError(f"Time: got {len(numbers)} times, expected {len(self._grids)}, one per grid")
        return numbers

    def _element(self, step: int, tag: str) -> ElementTree.Element | None:
        found = self._grids[step].find(tag)
        return self._mesh.find(tag) if found is None else found

    def _topology_element(self, step: int) -> ElementTree.Element | None:
        return self._element(step, "Topology")

    def points(self, step: int) -> np.ndarray:
        geometry = self._element(step, "Geometry")
        kind = geometry.get("GeometryType") or geometry.get("Type") or "XYZ"
        items = geometry.findall("DataItem")
        if kind == "X_Y_Z" and len(items) == 3:
            return np.stack([self._data.read(item).reshape(-1) for item in items], axis=1)
        if kind not in ("XYZ", "XY") or len(items) != 1:
            raise ClipError(f"Geometry: got the type {kind[:40]!r}, expected XYZ, XY or X_Y_Z")
        return self._data.read(items[0]).reshape(-1, len(kind))

    def fixed_points(self) -> bool:
        if self._same_items("Geometry"):
            return True
        first = self.points(0)
        return all(np.array_equal(first, self.points(step)) for step in range(1, len(self._grids)))

    def _same_items(self, tag: str) -> bool:
        first = _signature(self._element(0, tag))
        return all(_signature(self._element(step, tag)) == first for step in range(1, len(self._grids)))

    def check(self, step: int) -> None:
        element, first = self._topology_element(step), self._topology_element(0)
        if element is first or _signature(element) == _signature(first):
            return
        blocks = self._blocks(element)
        same = len(blocks) == len(self._first_blocks) and all(
            a.kind == b.kind and np.array_equal(a.nodes, b.nodes) and np.array_equal(a.rows, b.rows)
            for a, b in zip(blocks, self._first_blocks)
        )
        if not same:
            raise ClipError(f"frame {step}: got other cells than in the first; topology that changes cannot be coded")

    def fields(self) -> list[str]:
        return [name for name, center, _ in self._attributes(0) if center == "node"]

    def field(self, step: int, name: str) -> np.ndarray:
        for found, center, element in self._attributes(step):
            if found == name and center == "node":
                values = self._data.read(element.find("DataItem"))
                return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values
        raise ClipError(f"frame {step}: got no field {name!r} per point, expected one as in the first")

    def _attributes(self, step: int) -> list[tuple[str, str, ElementTree.Element]]:
        elements = [*self._grids[step].findall("Attribute")]
        if self._mesh is not self._grids[0]:
            elements += self._mesh.findall("Attribute")
        return [(element.get("Name", ""), element.get("Center", "Node").lower(), element) for element in elements]

    def static(self) -> dict[str, np.ndarray]:
        """Data per point that are the same in all steps."""
        count, found = len(self.points(0)), {}
        for name in self.fields():
            if self._is_static(name, "node"):
                values = self.field(0, name)
                if len(values) == count and name:
                    self._data.budget.take(values.nbytes, name)
                    found[name] = values
        return found

    def _add_cell_data(self) -> list[str]:
        """Keep the data per cell that are the same in all steps; return the names of all data that are in no clip."""
        count = sum(len(block.rows) for block in self._first_blocks)
        steps = range(len(self._grids))
        left_out = dict.fromkeys((name, center) for step in steps for name, center, _ in self._attributes(step) if name)
        for name, center, element in self._attributes(0):
            if center == "cell" and name and self._is_static(name, "cell"):
                values = self._data.read(element.find("DataItem"))
                if len(values) == count:
                    self._data.budget.take(2 * values.nbytes, name)
                    self.topology.add_cell_data(name, values[:, 0] if values.shape[1:] == (1,) else values)
                    del left_out[name, center]
            elif center == "node":
                left_out.pop((name, center), None)  # See fields().
        return [name for name, _ in left_out]

    def _is_static(self, name: str, center: str) -> bool:
        """By reference, or by value: the last step is compared first, because what moves is not there where it was."""

        def item(step: int) -> ElementTree.Element | None:
            return next(
                (
                    element.find("DataItem")
                    for found, where, element in self._attributes(step)
                    if (found, where) == (name, center)
                ),
                None,
            )

        first = item(0)
        others = [item(step) for step in range(len(self._grids) - 1, 0, -1)]
        if any(other is None for other in others):
            return False
        others = [other for other in others if _signature(other) != _signature(first)]
        if not others:
            return True
        values = self._data.read(first)
        return all(same_values(values, self._data.read(other)) for other in others)

    def _blocks(self, element: ElementTree.Element | None) -> list[Block]:
        if element is None:
            return []
        kind = (element.get("TopologyType") or element.get("Type") or "").lower()
        item = element.find("DataItem")
        if kind == "polyvertex":
            return []
        nodes = self._data.read(item)
        if nodes.dtype.kind not in "iu":
            nodes = _whole_numbers(nodes)
        self._data.budget.need(NODE_BYTES * nodes.size, "Topology")
        nodes = nodes.astype(np.int64)
        if kind == "mixed":
            return _mixed_blocks(nodes.reshape(-1))
        if kind in PLAIN:
            size = int(element.get("NodesPerElement") or nodes.shape[-1])
            rows = np.arange(nodes.size // max(size, 1))
            if size < 1 or nodes.size % size:
                raise ClipError(f"Topology: got {nodes.size} nodes, expected {size} per cell")
            if size == 2:
                return [Block("line", nodes.reshape(-1, 2), rows)]
            return [Block(PLAIN[kind], nodes.reshape(-1), rows, np.full(len(rows), size))]
        if kind not in TOPOLOGIES or nodes.size % NODES[TOPOLOGIES[kind]]:
            raise ClipError(f"Topology: got {nodes.size} nodes of the type {kind[:40]!r}, expected a known one")
        cells = nodes.reshape(-1, NODES[TOPOLOGIES[kind]])
        return [Block(TOPOLOGIES[kind], cells, np.arange(len(cells)))]


def _whole_numbers(values: np.ndarray) -> np.ndarray:
    if not np.array_equal(values, np.floor(values)):
        raise ClipError("Topology: got numbers with fractions, expected vertices")
    return values


def _signature(element: ElementTree.Element | None) -> bytes:
    return b"" if element is None else ElementTree.tostring(element).strip()


def _find_steps(root: ElementTree.Element, field: str | None) -> tuple[ElementTree.Element | None, list]:
    """The temporal collection (one with the wanted field, else the first) and its grids; a single grid without one."""
    series = [
        grid
        for grid in root.iter("Grid")
        if grid.get("GridType") == "Collection" and grid.get("CollectionType", "Spatial") == "Temporal"
    ]
    series = [collection for collection in series if collection.findall("Grid")]
    if not series:
        single = [grid for grid in root.iter("Grid") if grid.get("GridType", "Uniform") == "Uniform"]
        if len(single) != 1:
            raise ClipError(f"got {len(single)} grids and no temporal collection, expected a time series or one grid")
        return None, single
    wanted = f"Grid/Attribute[@Name='{(field or '').replace(chr(39), '')}']"
    named = [collection for collection in series if field and collection.find(wanted) is not None]
    chosen = (named or series)[0]
    grids = chosen.findall("Grid")
    pieces = [grid for grid in grids if grid.get("GridType", "Uniform") != "Uniform"]
    if pieces:
        raise ClipError(
            f"got a step with a grid of the type {pieces[0].get('GridType')[:40]!r}, expected Uniform: "
            "pieces of parallel runs have to be merged first"
        )
    return chosen, grids


def _information(root: ElementTree.Element) -> dict[str, Any]:
    """fps, start_frame, unit and up_axis, where the domain has Information of these names; and those of objects and
    materials that our writer adds as JSON."""
    said: dict[str, Any] = {}
    for element in root.findall("Domain/Information"):
        name, value = element.get("Name"), element.get("Value", "")
        if name in ("unit", "up_axis"):
            said[name] = value
        elif name in ("fps", "start_frame"):
            said[name] = whole(float(value)) if name == "start_frame" else float(value)
        elif name in ("objects", MATERIAL_NAMES):
            with suppress(ValueError, RecursionError):  # Another program may have written something else here.
                said[name] = json.loads(value)
    frame_rate(said)
    return said


def _mixed_blocks(stream: np.ndarray) -> list[Block]:
    """Cells one behind the other, each with its type before it, and its number of nodes where that varies."""
    types, starts, stops, at = [], [], [], 0
    numbers = stream.tolist()
    while at < len(numbers):
        kind = numbers[at]
        if kind not in MIXED:
            raise ClipError(f"Topology: got the cell type {kind}, expected one of {', '.join(map(str, MIXED))}")
        counted = kind in COUNTED
        size = numbers[at + 1] if counted and at + 1 < len(numbers) else NODES.get(MIXED[kind], -1)
        at += 2 if counted else 1
        if size < 0 or at + size > len(numbers):
            raise ClipError("Topology: got the end of the data, expected the nodes of a cell")
        types.append(kind)
        starts.append(at)
        at += size
        stops.append(at)
    return blocks_of(np.array(types), np.array(starts, np.int64), np.array(stops, np.int64), stream, MIXED)
