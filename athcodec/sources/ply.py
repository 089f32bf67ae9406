"""Reads meshes in PLY files, vertex for vertex and face for face as the files have them.

Ascii and binary of both byte orders; vertices with any scalar properties, faces with texture coordinates per corner,
edges, and what our writer says in a comment. Not read: normals (they belong to one pose) and triangle strips; the
clip's `not_read` names these and whatever else a file holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import RESERVED_NAMES
from athcodec.sources.mesh import Mesh, add_face_rows, checked_indices, comments, with_polygons
from athcodec.sources.scene_objects import FACE_MATERIAL, OWN, scene_fields, scene_of_json
from athcodec.untyped import JsonObject

Column: TypeAlias = np.ndarray | tuple[np.ndarray, np.ndarray]
"""Values of a property: (rows,) numbers or, of a list, (rows,) lengths and the numbers of all rows in one array."""

STRIPS = "tristrips"
PLY_ELEMENTS = ("vertex", "face", "edge")
HEADER_BYTES = 1 << 24  # names of objects and materials included
PLY_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
}


@dataclass
class PlyElement:
    """An element of a PLY header; properties: (name, dtype, dtype of the count of a list or "")."""

    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)

    @property
    def lists(self) -> list[str]:
        """The names of the properties that are lists."""
        return [name for name, _, counted_by in self.properties if counted_by]

    def row(self, order: str, lengths: dict[str, int]) -> np.dtype:
        """Return the structured dtype of one row of the element. `order` is the byte order ("<", ">" or "="), and
        `lengths` has the length of each list in the row by the list's name."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for name, dtype, counted_by in self.properties:
            if counted_by:
                fields += [(f"{name} count", order + counted_by), (name, order + dtype, (lengths[name],))]
            else:
                fields.append((name, order + dtype))
        return np.dtype(fields)


@dataclass
class PlyHeader:
    """The elements of a PLY file in their order, and the length of the header in bytes."""

    order: str  # "<", ">", or "" for text
    elements: list[PlyElement]
    length: int
    scene: JsonObject = field(default_factory=dict)  # Comments that our exporter adds.


def ply_header(data: bytes) -> PlyHeader:
    """Return the header of a PLY file whose content is `data`. Raises ClipError if it is broken."""
    end = data.find(b"end_header", 0, HEADER_BYTES)
    line_end = data.find(b"\n", end)
    if end < 0 or line_end < 0:
        raise ClipError("got no end of the header, expected a PLY file")
    header = PlyHeader("", [], line_end + 1)
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    for line in data[:end].decode("latin-1").splitlines()[1:]:
        words = line.split()
        if words[:1] == ["format"] and len(words) > 1 and words[1] in orders:
            header.order = orders[words[1]]
        elif words[:1] == ["element"] and len(words) == 3 and words[2].isdigit():
            header.elements.append(PlyElement(words[1], int(words[2])))
        elif words[:1] == ["property"] and header.elements:
            header.elements[-1].properties.append(_ply_property(words[1:]))
        elif words[:2] == ["comment", OWN]:
            header.scene = scene_of_json(line.split(OWN, 1)[1])
        elif words and words[0] not in ("comment", "obj_info"):
            raise ClipError(f"header: got {line[:60]!r}, expected an element or a property of PLY")
    for element in header.elements:
        if len({name for name, *_ in element.properties}) < len(element.properties):
            raise ClipError(f"{element.name}: got two properties of one name")
    return header


def _ply_property(words: Sequence[str]) -> tuple[str, str, str]:
    if len(words) == 4 and words[0] == "list" and PLY_TYPES.get(words[1], "f")[0] in "iu" and words[2] in PLY_TYPES:
        return words[3], PLY_TYPES[words[2]], PLY_TYPES[words[1]]
    if len(words) == 2 and words[0] in PLY_TYPES:
        return words[1], PLY_TYPES[words[0]], ""
    raise ClipError(f"header: got the property {' '.join(words)[:60]!r}, expected a type of PLY and a name")


class _Text:
    """The numbers of an ascii file, taken in the shape of rows."""

    def __init__(self, data: bytes):
        self._words, self._at = data.split(), 0

    def rows(self, element: PlyElement, count: int, lengths: dict[str, int]) -> np.ndarray:
        """Return the next `count` rows of an element, of the dtype `element.row("=", lengths)`, without moving on
        behind them. Raises ClipError if the file ends before."""
        width = sum(1 + lengths[name] if counted_by else 1 for name, _, counted_by in element.properties)
        if self._at + count * width > len(self._words):
            raise ClipError(f"{element.name}: got the end of the file, expected {element.count} of them")
        words = self._words[self._at : self._at + count * width]
        table = np.array(list(map(float, words)), np.float64).reshape(count, width)
        rows, column = np.empty(count, element.row("=", lengths)), 0
        for name in rows.dtype.names:
            span = int(np.prod(rows.dtype[name].shape, dtype=int))
            values = table[:, column : column + span]
            with np.errstate(invalid="ignore", over="ignore"):
                rows[name] = values.reshape(rows[name].shape)
            column += span
        return rows

    def skip(self, element: PlyElement, lengths: dict[str, int], count: int) -> None:
        self._at += count * sum(1 + lengths[name] if by else 1 for name, _, by in element.properties)

    def rest(self) -> int:
        return len(self._words) - self._at


class _Binary:
    """Read values of one byte order."""

    def __init__(self, data: bytes, at: int, order: str):
        self._data, self._at, self._order = data, at, order

    def rows(self, element: PlyElement, count: int, lengths: dict[str, int]) -> np.ndarray:
        dtype = element.row(self._order, lengths)
        if self._at + count * dtype.itemsize > len(self._data):
            raise ClipError(f"{element.name}: got the end of the file, expected {element.count} of them")
        return np.frombuffer(self._data, dtype, count, self._at)

    def skip(self, element: PlyElement, lengths: dict[str, int], count: int) -> None:
        """Pass `count` rows of an element whose lists have these lengths."""
        self._at += count * element.row(self._order, lengths).itemsize

    def rest(self) -> int:
        return len(self._data) - self._at


def _element_values(source: _Text | _Binary, element: PlyElement) -> dict[str, Column]:
    """Return the values of each property of an element by its name, and move on behind the element. A list property
    gives a pair: the length of the list in each row, and the items of all lists, one after the other."""
    none = dict.fromkeys(element.lists, 0)
    if not element.properties or not element.count:
        return {}
    if source.rest() < element.count:
        raise ClipError(f"{element.name}: got the end of the file, expected {element.count} of them")
    if not element.lists:
        rows = source.rows(element, element.count, none)
        source.skip(element, none, element.count)
        return {name: rows[name] for name, *_ in element.properties}
    lengths = _first_lengths(source, element)
    with_same = _uniform(source, element, lengths)
    if with_same is not None:
        source.skip(element, lengths, element.count)
        return {
            name: with_same[name]
            if name not in lengths
            else (with_same[f"{name} count"].astype(np.int64), with_same[name].reshape(-1))
            for name, *_ in element.properties
        }
    return _one_by_one(source, element)


def _first_lengths(source: _Text | _Binary, element: PlyElement) -> dict[str, int]:
    """Return the length of each list in the next row, by the list's name. The lists have to be read in order, because
    the length of each stands behind the list before it."""
    lengths: dict[str, int] = {}
    for position, (name, _, counted_by) in enumerate(element.properties):
        if counted_by:
            until = PlyElement(element.name, element.count, [*element.properties[:position], (name, counted_by, "")])
            length = int(source.rows(until, 1, lengths)[name][0])
            if not 0 <= length <= source.rest():
                raise ClipError(f"{element.name}: got a list of {length}, expected one that the file holds")
            lengths[name] = length
    return lengths


def _uniform(source: _Text | _Binary, element: PlyElement, lengths: dict[str, int]) -> np.ndarray | None:
    try:
        rows = source.rows(element, element.count, lengths)
    except ClipError:
        return None
    return rows if all((rows[f"{name} count"] == length).all() for name, length in lengths.items()) else None


def _one_by_one(source: _Text | _Binary, element: PlyElement) -> dict[str, Column]:
    """Return the values of each property of an element by its name, read row by row because the lists differ in length.
    A list property gives a pair: the length of the list in each row, and all items."""
    parts: dict[str, list[np.ndarray]] = {name: [] for name, *_ in element.properties}
    counts: dict[str, list[int]] = {name: [] for name in element.lists}
    for _ in range(element.count):
        lengths = _first_lengths(source, element)
        row = source.rows(element, 1, lengths)
        source.skip(element, lengths, 1)
        for name in parts:
            parts[name].append(row[name].reshape(-1))
        for name, length in lengths.items():
            counts[name].append(length)
    joined = {name: np.concatenate(values) for name, values in parts.items()}
    return {
        name: (np.array(counts[name], np.int64), values) if name in counts else values
        for name, values in joined.items()
    }


def parse_ply(data: bytes) -> Mesh:
    """Return the mesh in a PLY file whose content is `data`. Raises ClipError if it is broken or has no vertices."""
    header = ply_header(data)
    source = _Binary(data, header.length, header.order) if header.order else _Text(data[header.length :])
    values: dict[str, dict[str, Column]] = {}
    for element in header.elements:
        if element.name in values:
            raise ClipError(f"header: got the element {element.name} twice")
        values[element.name] = _element_values(source, element)
    if not header.order and source.rest():  # Lines longer than the header says: what was read is shifted.
        raise ClipError(f"header: got {source.rest()} more words behind the last element, expected it to name them all")
    columns = values.get("vertex", {})
    vertices = _numbers(columns)
    if not {"x", "y", "z"} <= vertices.keys():
        raise ClipError("got no vertices with x, y and z, expected a PLY file with some")
    metadata, attributes = scene_fields(header.scene, len(vertices["x"]))
    mesh = Mesh(ply_points(vertices), metadata={"domains": dict.fromkeys(attributes, "constant")} | metadata)
    mesh.attributes |= attributes
    _add_ply_vertex_values(mesh, columns)
    _add_ply_faces(mesh, values.get("face", {}))
    _add_ply_materials(mesh, header.scene.get(FACE_MATERIAL))
    edges, unread = _numbers(values.get("edge", {})), list(values.get("edge", {}))
    if edges.keys() >= {*_EDGE_ENDS}:
        ends = np.stack([edges[name] for name in _EDGE_ENDS], axis=1).astype(np.int64)
        mesh.edges = checked_indices("edges", ends.reshape(-1), len(mesh.points)).reshape(-1, 2)
        unread = [name for name in unread if name not in _EDGE_ENDS]
    _leave_out(mesh, *(f"edge_{name}" for name in unread))
    if any(comment.startswith(_TEXTURE) for comment in comments(data)):
        mesh.not_read.setdefault("statement", []).append(_TEXTURE)
    others = [element.name for element in header.elements if element.name not in PLY_ELEMENTS and element.count]
    for name in others:
        mesh.not_read.setdefault(STRIPS if name == STRIPS else "element", []).append(name)
    return mesh


def _numbers(columns: Mapping[str, Column]) -> dict[str, np.ndarray]:
    """Return those columns that have one number in each row."""
    return {name: column for name, column in columns.items() if not isinstance(column, tuple)}


def ply_points(vertices: Mapping[str, np.ndarray] | np.ndarray) -> np.ndarray:
    """Return the points (N, 3) of a PLY file from its columns x, y and z. They are float32 if every value of the
    columns' types fits into float32, else float64."""
    dtype = (
        np.float32
        if all(
            vertices[axis].dtype.newbyteorder("=") in (np.float32, np.int8, np.uint8, np.int16, np.uint16)
            for axis in "xyz"
        )
        else np.float64
    )
    return np.stack([vertices[axis].astype(dtype) for axis in "xyz"], axis=1)


_EDGE_ENDS = ("vertex1", "vertex2")
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
POSITION_COLUMNS = ("x", "y", "z", "nx", "ny", "nz")  # Position and normal, which belong to one pose.
_TEXTURE = "TextureFile"  # The comment in which MeshLab and others name the picture of a mesh.
_PLY_COLORS = ("red", "green", "blue", "alpha")


def _add_ply_vertex_values(mesh: Mesh, columns: Mapping[str, Column]) -> None:
    """Store the columns of vertices other than positions in the mesh: colours, texture coordinates, and others under
    their own names."""
    columns_used, vertices = set(POSITION_COLUMNS), _numbers(columns)
    if not {"nx", "ny", "nz"}.isdisjoint(columns):
        _leave_out(mesh, "normals")
    colors = [name for name in _PLY_COLORS if name in vertices]
    if set(_PLY_COLORS[:3]) <= set(colors):
        mesh.attributes["colors"] = _native(np.stack([vertices[name] for name in colors], axis=1))
        columns_used |= set(colors)
    for pair in _UV_NAMES:
        if "uv" not in mesh.attributes and set(pair) <= vertices.keys():
            mesh.attributes["uv"] = _native(np.stack([vertices[name] for name in pair], axis=1))
            columns_used |= set(pair)
    for name, column in columns.items():
        if name not in columns_used:
            _add_attribute(mesh, name, column)


def _add_attribute(mesh: Mesh, name: str, values: Column, prefix: str = "vertex_") -> None:
    """Store a column as an attribute of the mesh under its name, or with `prefix` in front if the name is taken. A
    column of lists is noted as not read."""
    if isinstance(values, tuple):
        _leave_out(mesh, f"{prefix}{name} (lists)")
        return
    if name in RESERVED_NAMES or name in mesh.attributes:
        name = "branch_id" if name == "vertex_branch" else prefix + name
    if name not in RESERVED_NAMES and name not in mesh.attributes:
        mesh.attributes[name] = _native(values)
        if prefix == "face_":
            mesh.metadata["domains"][name] = "face"
    else:
        _leave_out(mesh, name)


def _leave_out(mesh: Mesh, *names: str) -> None:
    if names:
        mesh.not_read.setdefault("attribute", []).extend(names)


def _native(values: np.ndarray) -> np.ndarray:
    """Return the values in the byte order of this machine."""
    return values.astype(values.dtype.newbyteorder("="))


def _add_ply_materials(mesh: Mesh, runs: Any) -> None:
    """Store the material of each face in the mesh. `runs` should be a list of [material, number of faces] that covers
    all faces in their order; anything else is ignored."""
    fits = isinstance(runs, list) and all(
        isinstance(run, list) and len(run) == 2 and all(type(n) is int and abs(n) < 1 << 31 for n in run)
        for run in runs
    )
    polygons, labels = mesh.polygons, np.array(runs if fits and runs else np.zeros((0, 2)), np.int32)
    if polygons is None or (labels[:, 1] < 0).any() or labels[:, 1].sum(dtype=np.int64) != len(polygons[0]):
        return
    mesh.attributes[FACE_MATERIAL] = np.repeat(labels[:, 0], labels[:, 1])
    mesh.metadata["domains"][FACE_MATERIAL] = "face"


def _add_ply_faces(mesh: Mesh, face_values: dict[str, Column]) -> None:
    """Store the faces, the texture coordinates of their corners, and further columns of faces in the mesh.
    `face_values` has the columns by name."""
    corner_name = next((name for name in ("vertex_indices", "vertex_index") if name in face_values), "")
    lists = face_values.get(corner_name)
    if not isinstance(lists, tuple):
        if face_values:
            mesh.not_read["faces whose corners have no known name"] = list(face_values)
        return
    del face_values[corner_name]
    counts, corners = lists
    mesh.faces, attributes = with_polygons(counts, checked_indices("faces", corners.astype(np.int64), len(mesh.points)))
    mesh.attributes |= attributes
    add_face_rows(mesh)
    texture_corners = face_values.get("texcoord")
    if isinstance(texture_corners, tuple):
        per_face, uv = texture_corners
        if np.array_equal(per_face, 2 * counts):
            del face_values["texcoord"]
            mesh.attributes["uv"] = _native(uv).reshape(-1, 2)
            mesh.metadata["domains"]["uv"] = "corner"
    for name, column in face_values.items():
        _add_attribute(mesh, name, column, "face_")
