"""Writes a series of VTU files, and a .pvd that lists them with their times: ParaView opens that.

Each file has the moved points, all cells, and the attributes per vertex, and those per cell where all cells are of one
kind. Objects, names of materials, unit, up axis and frame rate are JSON in the field "athcodec", as characters. Files
are numbered as sequence.py does. Both tree.pvd and tree.vtu give tree_0001.vtu ... and tree.pvd; a single frame written
to tree.vtu is that file alone. Numbers are as in the clip, packed by zlib with gzip.
"""

from __future__ import annotations

import base64
import json
import os
import zlib
from pathlib import Path
from typing import BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np

from athcodec.exporters import FILES, Progress, WriteOptions
from athcodec.exporters.cells import arrays_in, cell_and_point_data, cells_of
from athcodec.exporters.scene_objects import lost_arrays, names_and_scene
from athcodec.exporters.sequence import file_names, write_frames
from athcodec.files.atomic import check_target, new_files
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.sources.scene_objects import OWN
from athcodec.untyped import JsonObject

_HEAD = (
    '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
    'header_type="UInt64"{}>\n<UnstructuredGrid>\n'
)
_PIECE = '<Piece NumberOfPoints="{}" NumberOfCells="{}">\n<Points>\n'


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write a file per frame, and an index if there are several. Return the name of the index or of the only file.
    Raise ClipError if files of the same numbering exist already, OSError if nothing can be written.
    """
    target = Path(check_target(path))
    names = file_names(motion, target.with_suffix(".vtu"))
    index = "" if names == [target.name] else f"{_stem(target)}.pvd"
    if names == [target.with_suffix(".vtu").name] and index:
        names = [f"{target.stem}_0001.vtu"]
    writer = _VtuWriter(motion, options.gzip)
    with new_files(target, named=False) as folder:
        write_frames(motion, writer, [os.path.join(folder, name) for name in names], report)
        if index:
            Path(folder, index).write_text(_index(motion, names), "utf-8")
    return {FILES: [index] if index else names} | lost_arrays(motion, writer.arrays)


def _stem(target: Path) -> str:
    """Return the index's name: that of the series without the place of its numbers."""
    if target.suffix.lower() == ".pvd":
        return target.stem
    bare = target.stem.rstrip("0123456789").partition("#")[0].partition("%")[0].rstrip("_-. ")
    return bare or target.stem


def _index(motion: Motion, names: list[str]) -> str:
    """Return the text of the .pvd file that lists the files `names` with their times."""
    lines = [
        f'<DataSet timestep="{time!r}" group="" part="0" file={quoteattr(name)}/>\n'
        for time, name in zip(np.asarray(motion.time).tolist(), names, strict=True)
    ]
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n<Collection>\n'
        + "".join(lines)
        + "</Collection>\n</VTKFile>\n"
    )


class _VtuWriter:
    """VTU files of one clip; write(file, points) for each. What does not move is put together once."""

    def __init__(self, motion: Motion, packed: bool):
        """Prepare what all frames share: cells, attributes and headers. If `packed` is true, data are compressed."""
        cells = cells_of(motion)
        self._packed = packed
        compressor = ' compressor="vtkZLibDataCompressor"' if packed else ""
        scene = json.dumps(names_and_scene(motion)).encode()
        parts = [
            _HEAD.format(compressor).encode(),
            *self._section("FieldData", {OWN: np.frombuffer(scene, np.uint8)}),
            _PIECE.format(motion.vertex_count, len(cells.types)).encode(),
        ]
        self._head = b"".join(parts)
        per_point, per_cell = cell_and_point_data(motion, cells)
        self.arrays = arrays_in(motion, per_point, per_cell)
        described = {"connectivity": cells.nodes, "offsets": cells.stops, "types": cells.types.astype(np.uint8)}
        parts = [
            b"</Points>\n",
            *self._section("Cells", described),
            *self._section("PointData", per_point),
            *self._section("CellData", per_cell),
            b"</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        ]
        self._tail = b"".join(parts)

    def write(self, file: BinaryIO, points: np.ndarray) -> None:
        file.write(self._head)
        file.write(self._array("Points", points))
        file.write(self._tail)

    def _section(self, tag: str, arrays: dict[str, np.ndarray]) -> list[bytes]:
        return [
            f"<{tag}>\n".encode(),
            *(self._array(name, values) for name, values in arrays.items()),
            f"</{tag}>\n".encode(),
        ]

    def _array(self, name: str, values: np.ndarray) -> bytes:
        kind = {"f": "Float", "i": "Int", "u": "UInt"}[values.dtype.kind] + str(8 * values.dtype.itemsize)
        width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        width += f' NumberOfTuples="{len(values)}"' if name == OWN else ""  # which fields have to say themselves
        raw = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes()
        opened = f'<DataArray type="{kind}" Name={quoteattr(name)}{width} format="binary">'
        return opened.encode() + self._encoded(raw) + b"</DataArray>\n"

    def _encoded(self, raw: bytes) -> bytes:
        """Return bytes as the base64 text of a VTU file, compressed or not, with their length in front."""
        if not self._packed:
            return base64.b64encode(np.uint64(len(raw)).tobytes() + raw)
        if not raw:
            return base64.b64encode(np.zeros(3, "<u8").tobytes())
        packed = zlib.compress(raw)
        counts = np.array([1, len(raw), 0, len(packed)], "<u8")
        return base64.b64encode(counts.tobytes()) + base64.b64encode(packed)
