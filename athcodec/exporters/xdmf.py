"""Writes an XDMF time series: tree.xdmf, and its numbers in tree.xdmf.h5 beside it.

The mesh is there once, in the rest pose, in the first step, and the later steps refer to it; what moves is the field
`displacement` per point, in the clip's own precision. Attributes per vertex, and those per cell where all cells are of
one kind, are written once too. Rate, start frame, unit and up axis, and as JSON the names of objects and materials, are
Information of the domain. ParaView shows the motion through its filter "Warp By Vector".
"""

from __future__ import annotations

import json
import os
from os import fspath
from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np

from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters.cells import Cells, arrays_in, cell_and_point_data, cells_of
from athcodec.exporters.hdf5 import Sink
from athcodec.exporters.scene_objects import lost_arrays, stated_names
from athcodec.files.atomic import check_target, new_files
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.sources.cells import VTK_NAMES, VTK_NUMBERS
from athcodec.sources.xdmf_cells import MIXED
from athcodec.untyped import JsonObject

DISPLACEMENT = "displacement"
_XDMF_NUMBERS = {name: number for number, name in MIXED.items()} | {"line": 2, "vertex": 1}
_UNIFORM = {
    "line": "Polyline",
    "vertex": "Polyvertex",
    "triangle": "Triangle",
    "quad": "Quadrilateral",
    "tetra": "Tetrahedron",
    "hexahedron": "Hexahedron",
    "wedge": "Wedge",
    "pyramid": "Pyramid",
    "tetra10": "Tetrahedron_10",
    "hexahedron20": "Hexahedron_20",
    "hexahedron27": "Hexahedron_27",
}
_POINTER = 'xpointer(//Grid[@Name="{}"]/Grid[1]/*[self::Topology or self::Geometry])'
_INCLUDE = "{http://www.w3.org/2001/XInclude}include"
_FORMS = {1: "Scalar", 3: "Vector", 6: "Tensor6", 9: "Tensor"}
SERIES = "motion"


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write the .xdmf file and its HDF5 file. Raise OSError if nothing can be written."""
    name = Path(check_target(path)).name
    with new_files(path) as folder, open(os.path.join(folder, f"{name}.h5"), "w+b", buffering=0) as file:
        sink = Sink(file.fileno(), fspath(path))
        with h5py.File(sink, "w") as data:
            writer = _Writer(motion, data, f"{name}.h5", options.gzip, sink)
            root = writer.write(report)
        sink.check()
        ElementTree.indent(root)
        ElementTree.ElementTree(root).write(os.path.join(folder, name), encoding="utf-8", xml_declaration=True)
    return lost_arrays(motion, writer.arrays)


class _Writer:
    def __init__(self, motion: Motion, data: h5py.File, data_name: str, gzip: bool, sink: Sink):
        self._motion, self._data, self._name, self._sink = motion, data, data_name, sink
        self._packing = {"compression": "gzip", "shuffle": True} if gzip else {}

    def write(self, report: Progress) -> ElementTree.Element:
        """Write all numbers to the HDF5 file and return the XML that refers to them."""
        motion, root = self._motion, ElementTree.Element("Xdmf", Version="3.0")
        domain = ElementTree.SubElement(root, "Domain")
        for key in ("fps", "start_frame", "unit", "up_axis"):
            if motion.metadata.get(key) is not None:
                ElementTree.SubElement(domain, "Information", Name=key, Value=str(motion.metadata[key]))
        for key, names in stated_names(motion).items():
            ElementTree.SubElement(domain, "Information", Name=key, Value=json.dumps(names, ensure_ascii=False))
        series = ElementTree.SubElement(domain, "Grid", Name=SERIES, GridType="Collection", CollectionType="Temporal")
        static, rest = self._static_elements(), np.asarray(motion.rest, np.float64)
        time = np.asarray(motion.time).tolist()
        for start, frames in motion.blocks():
            for frame, points in enumerate(frames, start):
                grid = ElementTree.SubElement(series, "Grid", Name=f"frame {frame}", GridType="Uniform")
                moved = (points - rest).astype(motion.dtype)
                self._fill(grid, frame, time[frame], moved, static)
                self._sink.check()
                report((frame + 1) / motion.frame_count)
        return root

    def _fill(
        self,
        grid: ElementTree.Element,
        frame: int,
        time: float,
        moved: np.ndarray,
        static: tuple[list[ElementTree.Element], list[ElementTree.Element]],
    ) -> None:
        """Fill the XML element `grid` of one frame: its time, the displacements `moved` (N, 3) and what is `static`,
        the elements of the mesh and of the attributes. Frames after the first refer to the mesh of the first.
        """
        mesh, attributes = static
        if frame == 0:
            grid.extend(mesh)
        else:
            ElementTree.SubElement(grid, _INCLUDE, xpointer=_POINTER.format(SERIES))
        ElementTree.SubElement(grid, "Time", Value=repr(time))
        grid.append(self._attribute(DISPLACEMENT, "Node", moved, f"displacement/{frame}"))
        grid.extend(attributes)

    def _static_elements(self) -> tuple[list[ElementTree.Element], list[ElementTree.Element]]:
        """Return the XML elements that do not change with time, in two lists: topology and geometry, and attributes."""
        motion = self._motion
        cells = cells_of(motion)
        geometry = ElementTree.Element("Geometry", GeometryType="XYZ")
        geometry.append(self._item(np.asarray(motion.rest, motion.dtype), "geometry"))
        per_point, per_cell = cell_and_point_data(motion, cells)
        self.arrays = arrays_in(motion, per_point, per_cell)
        attributes = [
            self._attribute(name, center, values, f"{center.lower()}/{index}")
            for center, data in (("Node", per_point), ("Cell", per_cell))
            for index, (name, values) in enumerate(data.items())
            if name != DISPLACEMENT
        ]
        return [self._topology(cells), geometry], attributes

    def _topology(self, cells: Cells) -> ElementTree.Element:
        """Return the XML element of the cells, as one type of cell if all are alike, else as a mixed topology."""
        kinds = np.unique(cells.types)
        name = VTK_NAMES[int(kinds[0])]
        if len(kinds) == 1 and name in _UNIFORM:
            size = int(cells.stops[0])
            element = ElementTree.Element(
                "Topology",
                TopologyType=_UNIFORM[name],
                NodesPerElement=str(size),
                NumberOfElements=str(len(cells.types)),
            )
            element.append(self._item(cells.nodes.reshape(-1, size), "topology"))
            return element
        element = ElementTree.Element("Topology", TopologyType="Mixed", NumberOfElements=str(len(cells.types)))
        element.append(self._item(_mixed(cells), "topology"))
        return element

    def _attribute(self, name: str, center: str, values: np.ndarray, place: str) -> ElementTree.Element:
        width = 1 if values.ndim == 1 else values.shape[1]
        element = ElementTree.Element("Attribute", Name=name, AttributeType=_FORMS.get(width, "Matrix"), Center=center)
        element.append(self._item(values, place))
        return element

    def _item(self, values: np.ndarray, place: str) -> ElementTree.Element:
        """Store values in the HDF5 file at `place`, and return the XML element that refers to them."""
        self._data.create_dataset(place, data=values, **(self._packing if values.size else {}))
        kind = {"f": "Float", "i": "Int", "u": "UInt"}[values.dtype.kind]
        item = ElementTree.Element(
            "DataItem",
            Dimensions=" ".join(map(str, values.shape)),
            Format="HDF",
            NumberType="Char" if values.dtype == np.int8 else "UChar" if values.dtype == np.uint8 else kind,
            Precision=str(values.dtype.itemsize),
        )
        item.text = f"{self._name}:/{place}"
        return item


def _mixed(cells: Cells) -> np.ndarray:
    """Return the numbers of a mixed topology: for each cell the number of its type, its number of nodes if that varies
    for the type, and its nodes.
    """
    parts, start = [], 0
    counted = {VTK_NUMBERS[name] for name in ("line", "vertex", "polygon")}
    for kind, stop in zip(cells.types.tolist(), cells.stops.tolist()):
        head = [_XDMF_NUMBERS[VTK_NAMES[kind]], *([stop - start] if kind in counted else [])]
        parts.append(np.concatenate([head, cells.nodes[start:stop]]))
        start = stop
    return np.concatenate(parts).astype(np.int64)
