"""Reads meshes in OBJ and PLY files, vertex for vertex and face for face as the files have them.

OBJ: v (with colours where there are six or seven numbers), vt, f, l, o, g and usemtl; polygons of any size, relative
indices, lines continued by a backslash. PLY: ascii and binary of both byte orders; vertices with any scalar properties,
faces with texture coordinates per corner, edges, and what our writer says in a comment. Not read: normals (they belong
to one pose), materials' contents, curves and surfaces of OBJ, triangle strips of PLY; the clip's `not_read` names these
and whatever else a file holds. A file is read whole, and nothing in it is trusted.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget, read_plain
from athcodec.motion.clip import RESERVED_NAMES, polygons
from athcodec.sources.scene_objects import FACE_MATERIAL, OWN, scene_fields, scene_of_json
from athcodec.untyped import JsonObject

FLOAT32_DIGITS = 9
WORD_ENDS, WORD_BYTES = b" \t\n\r\f\v/", 128  # Bytes that a word of text and the value made of it take.
MESSAGE = 300  # characters of what Python says of a number
STATEMENT_BYTES = 16  # Bytes that an unknown statement of OBJ takes for each word.
STRIPS = "tristrips"
PLY_ELEMENTS = ("vertex", "face", "edge")
STRUCTURE = {"part_vertex_counts", "part_copies", "face_vertex_counts", "face_vertex_indices"}
NAMED = {FACE_MATERIAL: "material_names", "face_group": "group_names"}  # Arrays whose numbers stand for names.
# Statements of OBJ that are shapes of a kind that is not read, the last of them of older versions.
FREE_FORM = ("curv", "curv2", "surf", "bsp", "bzp", "cdc", "cdp")
INCLUDED = "call"  # The statement of OBJ that has another file read in its place.
COMMENT_BYTES = 4096  # Where comments are looked for that concern the whole file.
POLYPAINT = b"#MRGB"  # Colours of vertices, which ZBrush writes as comments.
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
class Mesh:
    """Content of a mesh file: points (N, 3), and the rest as in MotionClip."""

    points: np.ndarray
    faces: np.ndarray | None = None
    edges: np.ndarray | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)
    metadata: JsonObject = field(default_factory=dict)
    not_read: dict[str, list[str]] = field(default_factory=dict)

    @property
    def polygons(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Corners per face (F,), and the vertex of each corner (C,); None where there are no faces."""
        return polygons(self.faces, self.attributes)

    def same_topology(self, other: Mesh) -> str:
        """Return "" if both have as many vertices and the same faces and edges, else what is different."""
        if len(self.points) != len(other.points):
            return f"got {len(other.points)} vertices, expected {len(self.points)}"
        for elements, first, second in (("faces", self.polygons, other.polygons), ("edges", self.edges, other.edges)):
            if (first is None) != (second is None):
                return f"got {'no' if second is None else 'further'} {elements}"
            if first is not None and not all(map(np.array_equal, first, second)):
                return f"got other {elements}"
        return ""

    def changed(self, other: Mesh) -> set[str]:
        """Return the names of the arrays that differ from those of another mesh of this topology, or that only one of
        both has; numbers of groups and materials differ where their names do."""
        names = (self.attributes.keys() | other.attributes.keys()) - STRUCTURE
        different = {name for name in names if not same_values(self.attributes.get(name), other.attributes.get(name))}
        return different | {
            name for name, key in NAMED.items() if name in names and self.metadata.get(key) != other.metadata.get(key)
        }


def same_values(values: np.ndarray | None, others: np.ndarray | None) -> bool:
    """Return whether both are numbers of one shape and value, NaN included."""
    if values is None or others is None or values.dtype.kind != others.dtype.kind:
        return False
    return np.array_equal(values, others, equal_nan=values.dtype.kind == "f")


def read_mesh(path: FilePath, budget: Budget) -> Mesh:
    """Return the mesh in an OBJ or PLY file. Raises ClipError, OSError."""
    return parse_mesh(read_plain(path, budget), path, budget)


def parse_mesh(data: bytes, path: FilePath, budget: Budget) -> Mesh:
    """Return the mesh in the bytes of a file, whose name is for messages. Raises ClipError."""
    try:
        budget.need_for(data, WORD_ENDS, WORD_BYTES, "words")
        if data.startswith((b"ply\n", b"ply\r")):
            mesh = parse_ply(data)
        elif Path(path).suffix.lower() == ".ply":
            raise ClipError("got something else, expected a PLY file")
        else:
            mesh = parse_obj(data)
    except (ClipError, ValueError, OverflowError, IndexError, MemoryError) as error:
        raise ClipError(f"{os.fspath(path)}: {str(error)[:MESSAGE]}") from None
    mesh.metadata.setdefault("part_names", [Path(path).stem])
    mesh.metadata.setdefault("part_kinds", [kind_of(mesh.polygons, mesh.edges)])
    mesh.attributes.setdefault("part_vertex_counts", np.array([len(mesh.points)], np.int32))
    mesh.metadata["domains"] = mesh.metadata.get("domains", {}) | {"part_vertex_counts": "constant"}
    return mesh


def kind_of(faces: object, edges: object) -> str:
    """Return the kind in metadata["part_kinds"] of an object with these faces and edges, None for none."""
    return "mesh" if faces is not None else "points" if edges is None else "curves"


def with_polygons(counts: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray | None, dict[str, np.ndarray]]:
    """Return (faces, attributes) of a clip for polygons: faces (F, k) int32 where all have k corners, else two
    attributes."""
    counts, corners = np.asarray(counts, np.int32), np.asarray(corners, np.int32)
    if not len(counts):
        return None, {}
    if counts[0] and (counts == counts[0]).all():
        return corners.reshape(-1, counts[0]), {}
    return None, {"face_vertex_counts": counts, "face_vertex_indices": corners}


def _checked(subject: str, indices: np.ndarray, count: int) -> np.ndarray:
    """Return int32 indices. Raises ClipError for any outside of 0 to count - 1."""
    bad = np.flatnonzero((indices < 0) | (indices >= count))
    if bad.size:
        raise ClipError(f"{subject}: got the number {indices[bad[0]]}, counted from 0, expected below {count}")
    return indices.astype(np.int32)


# ---- OBJ ----


@dataclass
class _Names:
    """The names that faces are under, in the order of the file, and which of them each face has; -1: none."""

    names: list[str] = field(default_factory=list)
    now: int = -1
    numbers: dict[str, int] = field(default_factory=dict)

    def switch(self, name: str) -> None:
        """Let this be the name of the faces that follow."""
        if name not in self.numbers:
            self.numbers[name] = len(self.names)
            self.names.append(name)
        self.now = self.numbers[name]


class _Obj:
    """The lines of an OBJ file, taken one after the other."""

    def __init__(self) -> None:
        self.points: list[Sequence[bytes]] = []
        self.uvs: list[Sequence[bytes]] = []
        self.counts: list[int] = []
        self.corners: list[int] = []
        self.corner_uvs: list[int] = []
        self.edges: list[tuple[int, int]] = []
        self.objects, self.groups, self.materials = _Names(), _Names(), _Names()
        self.face_labels: list[tuple[int, int, int]] = []
        self.element_labels: list[tuple[int, int, Sequence[int]]] = []  # Labels of lines and points.
        self.point_objects: list[int] = []
        self.not_read: dict[bytes, None] = {}

    def line(self, line: bytes) -> None:
        """Take the next line. Raises ClipError."""
        words = line.split()
        if not words:
            return
        if words[0] in _OBJ_WORDS:
            getattr(self, f"_{words[0].decode('ascii')}")(words[1:])
        elif not words[0].startswith(b"#") or words[0] == POLYPAINT:
            self.not_read[words[0][:STATEMENT_BYTES]] = None

    def _v(self, words: Sequence[bytes]) -> None:
        self.points.append(words)
        self.point_objects.append(self.objects.now)

    def _vt(self, words: Sequence[bytes]) -> None:
        self.uvs.append(words)

    def _f(self, words: Sequence[bytes]) -> None:
        for word in words:
            numbers = word.split(b"/")
            self.corners.append(self._index(numbers[0], len(self.points)))
            has_uv = len(numbers) > 1 and numbers[1]
            self.corner_uvs.append(self._index(numbers[1], len(self.uvs)) if has_uv else -1)
        self.counts.append(len(words))
        self.face_labels.append((self.objects.now, self.groups.now, self.materials.now))

    def _l(self, words: Sequence[bytes]) -> None:
        if any(b"/" in word for word in words):
            self.not_read[b"vt of l"] = None
        vertices = self._p(words)
        self.edges += zip(vertices, vertices[1:])

    def _p(self, words: Sequence[bytes]) -> Sequence[int]:
        vertices = [self._index(word.split(b"/")[0], len(self.points)) for word in words]
        self.element_labels.append((self.objects.now, self.groups.now, vertices))
        return vertices

    def _o(self, words: Sequence[bytes]) -> None:
        self.objects.switch(_text(words))

    def _g(self, words: Sequence[bytes]) -> None:
        self.groups.switch(_text(words) or "default")

    def _usemtl(self, words: Sequence[bytes]) -> None:
        self.materials.switch(_text(words))

    @staticmethod
    def _index(word: bytes, count: int) -> int:
        number = int(word)
        if number == 0 or number < -count:
            raise ClipError(f"elements: got the number {number}, expected 1 to the number of vertices, or -1 ...")
        return number - 1 if number > 0 else count + number


_OBJ_WORDS = frozenset((b"v", b"vt", b"f", b"l", b"p", b"o", b"g", b"usemtl"))


def _text(words: Sequence[bytes]) -> str:
    return b" ".join(words).decode("utf-8", "replace")


def obj_lines(data: bytes) -> list[bytes]:
    """Return the lines of an OBJ file; those that a backslash continues are joined."""
    if b"\\" in data:
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    return data.splitlines()


def parse_obj(data: bytes) -> Mesh:
    """Return the mesh in the bytes of an OBJ file. Raises ClipError."""
    file = _Obj()
    for line in obj_lines(data):
        file.line(line)
    if not file.points:
        raise ClipError("got no vertices, expected an OBJ file with lines of v")
    points, colors = obj_points(file.points)
    count = len(points)
    faces, attributes = with_polygons(file.counts, _checked("faces", np.array(file.corners, np.int64), count))
    mesh = Mesh(points, faces, attributes=attributes, metadata={"domains": {}})
    if file.edges:
        mesh.edges = _checked("lines", np.array(file.edges, np.int64).reshape(-1), count).reshape(-1, 2)
    if colors is not None:
        mesh.attributes["colors"] = colors
    _add_face_rows(mesh)
    _add_obj_uv(mesh, file)
    _add_obj_names(mesh, file)
    if colors is None and any(len(row) > 3 and (len(row) != 4 or float(row[3]) != 1) for row in file.points):
        mesh.not_read["attribute"] = ["numbers behind the coordinates of v"]  # Weights, or colours that some lack.
    for word in map(_text, ([word] for word in file.not_read)):
        kind = "curve or surface" if word in FREE_FORM else "included file" if word == INCLUDED else "statement"
        mesh.not_read.setdefault(kind, []).append(word)
    return mesh


def obj_points(rows: Sequence[Sequence[bytes]], dtype: object = None) -> tuple[np.ndarray, np.ndarray | None]:
    """Return (N, 3) and the colours behind them, of the words on the lines of v. dtype None: float32, or float64 where
    the coordinates have more digits than float32 holds."""
    flat = [word for row in rows for word in row[:3]]
    if len(flat) != 3 * len(rows) or any(len(row) < 3 for row in rows):
        raise ClipError("vertices: got fewer than three coordinates")
    points = np.array(list(map(float, flat)), np.float64).reshape(-1, 3)
    if dtype is None:
        dtype = (
            np.float64
            if any(len(word) > FLOAT32_DIGITS and _digits(word) > FLOAT32_DIGITS for word in flat)
            else np.float32
        )
    width = len(rows[0])
    if width not in (6, 7) or any(len(row) != width for row in rows):
        return narrowed(points, dtype), None
    colors = np.array([float(word) for row in rows for word in row[3:]], np.float32)
    return narrowed(points, dtype), colors.reshape(len(rows), -1)


def narrowed(points: np.ndarray, dtype: object) -> np.ndarray:
    with np.errstate(over="ignore"):
        return points.astype(dtype)


def _digits(word: bytes) -> int:
    return len(word.lower().partition(b"e")[0].replace(b".", b"").lstrip(b"+-0"))


def _add_face_rows(mesh: Mesh) -> None:
    if "face_vertex_counts" in mesh.attributes:
        mesh.metadata["domains"] |= {"face_vertex_counts": "face", "face_vertex_indices": "corner"}


def _add_obj_uv(mesh: Mesh, file: _Obj) -> None:
    uv_rows = np.array(file.corner_uvs, np.int64)
    if not file.uvs or not (uv_rows >= 0).any():
        file.not_read |= {b"vt": None} if file.uvs else {}
        return
    _checked("texture coordinates", uv_rows[uv_rows >= 0], len(file.uvs))
    table = np.array([[float(word) for word in (*row[:2], b"0", b"0")[:2]] for row in file.uvs], np.float32)
    if any(len(row) > 2 and float(row[2]) != 0 for row in file.uvs):
        file.not_read[b"w of vt"] = None
    uv = table[uv_rows]
    uv[uv_rows < 0] = 0
    mesh.attributes["uv"] = uv
    mesh.metadata["domains"]["uv"] = "corner"


def _add_obj_names(mesh: Mesh, file: _Obj) -> None:
    labels = np.array(file.face_labels, np.int32).reshape(-1, 3)
    column, names = (0, file.objects) if file.objects.names else (1, file.groups)
    if names.names:
        _add_parts(mesh, _vertex_labels(mesh, file, labels[:, column], column), names.names)
    are_parts = len(mesh.metadata.get("part_names", ())) == len(names.names)
    if column == 0 and not are_parts:
        file.not_read[b"o"] = None  # Objects whose vertices do not lie together, or that have none of their own.
    if len(file.groups.names) > 1 and (column == 0 or not are_parts):
        _add_face_names(mesh, "face_group", labels[:, 1], "group_names", file.groups.names)
    elif file.groups.names and not (column == 1 and are_parts):
        file.not_read[b"g"] = None
    if file.materials.names:
        _add_face_names(mesh, "face_material", labels[:, 2], "material_names", file.materials.names)


def _vertex_labels(mesh: Mesh, file: _Obj, face_labels: np.ndarray, column: int) -> np.ndarray:
    """Return (N,) the name that the first element with the vertex is under; without one that of the vertex before."""
    labels = np.full(len(mesh.points), -1, np.int64)
    if mesh.polygons is not None:
        counts, corners = mesh.polygons
        labels[corners[::-1]] = np.repeat(face_labels, counts)[::-1]
    for *element_labels, vertices in file.element_labels:
        alone = [vertex for vertex in vertices if labels[vertex] < 0]
        labels[alone] = element_labels[column]
    if column == 0:
        labels = np.where(labels < 0, np.array(file.point_objects), labels)
    known = np.where(labels >= 0, np.arange(len(labels)), -1)
    before = np.maximum.accumulate(known)
    first = labels[known >= 0][0] if (known >= 0).any() else 0
    return np.where(before >= 0, labels[before], first)


def _add_parts(mesh: Mesh, labels: np.ndarray, names: Sequence[str]) -> None:
    """Add the objects if the vertices of each lie together in the file; else the whole file is one object."""
    starts = np.flatnonzero(np.diff(labels, prepend=-1))
    if len(set(labels[starts])) != len(starts):
        return
    mesh.metadata["part_names"] = [names[label] for label in labels[starts]]
    mesh.attributes["part_vertex_counts"] = np.diff(starts, append=len(labels)).astype(np.int32)
    faced, edged = (np.zeros(len(labels), bool) for _ in range(2))
    if mesh.polygons is not None:
        faced[mesh.polygons[1]] = True
    if mesh.edges is not None:
        edged[mesh.edges] = True
    spans = zip(starts, np.append(starts[1:], len(labels)))
    mesh.metadata["part_kinds"] = [
        "mesh" if faced[a:b].any() else "curves" if edged[a:b].any() else "points" for a, b in spans
    ]


def _add_face_names(mesh: Mesh, name: str, labels: np.ndarray, names_key: str, names: Iterable[str]) -> None:
    mesh.attributes[name] = labels.astype(np.int32)
    mesh.metadata["domains"][name] = "face"
    mesh.metadata[names_key] = list(names)


def comments(data: bytes) -> list[str]:
    """Return the comments at the beginning of an OBJ or PLY file, but for that of our writer."""
    head, is_ply = data[:COMMENT_BYTES], data.startswith((b"ply\n", b"ply\r"))
    marks = (b"comment", b"obj_info") if is_ply else (b"#",)
    lines = (line.strip() for line in (head.partition(b"end_header")[0] if is_ply else head).splitlines())
    texts = [line[len(mark) :].decode("latin-1").strip() for line in lines for mark in marks if line.startswith(mark)]
    return [line for line in texts if not line.startswith(OWN)]


# ---- PLY ----


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
        """Return a row whose lists have these lengths."""
        fields: list[tuple] = []
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
    """Return the header in the bytes of a PLY file. Raises ClipError."""
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


def _element_values(source: _Text | _Binary, element: PlyElement) -> dict[str, np.ndarray]:
    """Return {property: (count,) values, or (counts, values) of a list}."""
    none = dict.fromkeys(element.lists, 0)
    if not element.properties or not element.count:
        return {}
    if source.rest() < element.count:
        raise ClipError(f"{element.name}: got the end of the file, expected {element.count} of them")
    if not element.lists:
        rows = source.rows(element, element.count, none)
        source.skip(element, none, element.count)
        return {name: rows[name] for name in rows.dtype.names}
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
    """Return how long the lists of the next row are: each says it behind those before it."""
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


def _one_by_one(source: _Text | _Binary, element: PlyElement) -> dict[str, np.ndarray]:
    parts: dict[str, list] = {name: [] for name, *_ in element.properties}
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
    """Return the mesh in the bytes of a PLY file. Raises ClipError."""
    header = ply_header(data)
    source = _Binary(data, header.length, header.order) if header.order else _Text(data[header.length :])
    values: dict[str, dict[str, np.ndarray]] = {}
    for element in header.elements:
        if element.name in values:
            raise ClipError(f"header: got the element {element.name} twice")
        values[element.name] = _element_values(source, element)
    if not header.order and source.rest():  # Lines longer than the header says: what was read is shifted.
        raise ClipError(f"header: got {source.rest()} more words behind the last element, expected it to name them all")
    vertices = values.get("vertex", {})
    if not {"x", "y", "z"} <= vertices.keys():
        raise ClipError("got no vertices with x, y and z, expected a PLY file with some")
    metadata, attributes = scene_fields(header.scene, len(vertices["x"]))
    mesh = Mesh(ply_points(vertices), metadata={"domains": dict.fromkeys(attributes, "constant")} | metadata)
    mesh.attributes |= attributes
    _add_ply_vertex_values(mesh, vertices)
    _add_ply_faces(mesh, values.get("face", {}))
    _add_ply_materials(mesh, header.scene.get(FACE_MATERIAL))
    edges = values.get("edge", {})
    if {"vertex1", "vertex2"} <= edges.keys():
        ends = np.stack([edges.pop("vertex1"), edges.pop("vertex2")], axis=1).astype(np.int64)
        mesh.edges = _checked("edges", ends.reshape(-1), len(mesh.points)).reshape(-1, 2)
    _leave_out(mesh, *(f"edge_{name}" for name in edges))
    if any(comment.startswith(_TEXTURE) for comment in comments(data)):
        mesh.not_read.setdefault("statement", []).append(_TEXTURE)
    others = [element.name for element in header.elements if element.name not in PLY_ELEMENTS and element.count]
    for name in others:
        mesh.not_read.setdefault(STRIPS if name == STRIPS else "element", []).append(name)
    return mesh


def ply_points(vertices: Any) -> np.ndarray:
    """Return (N, 3) of the values x, y and z; float64 where any of them is, or is a large integer."""
    dtype = (
        np.float32
        if all(
            vertices[axis].dtype.newbyteorder("=") in (np.float32, np.int8, np.uint8, np.int16, np.uint16)
            for axis in "xyz"
        )
        else np.float64
    )
    return np.stack([vertices[axis].astype(dtype) for axis in "xyz"], axis=1)


_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
POSITION_COLUMNS = ("x", "y", "z", "nx", "ny", "nz")  # Position and normal, which belong to one pose.
_TEXTURE = "TextureFile"  # The comment in which MeshLab and others name the picture of a mesh.
_PLY_COLORS = ("red", "green", "blue", "alpha")


def _add_ply_vertex_values(mesh: Mesh, vertices: dict[str, np.ndarray]) -> None:
    columns_used = set(POSITION_COLUMNS)
    if not {"nx", "ny", "nz"}.isdisjoint(vertices):
        _leave_out(mesh, "normals")
    colors = [name for name in _PLY_COLORS if name in vertices]
    if set(_PLY_COLORS[:3]) <= set(colors):
        mesh.attributes["colors"] = _native(np.stack([vertices[name] for name in colors], axis=1))
        columns_used |= set(colors)
    for pair in _UV_NAMES:
        if "uv" not in mesh.attributes and set(pair) <= vertices.keys():
            mesh.attributes["uv"] = _native(np.stack([vertices[name] for name in pair], axis=1))
            columns_used |= set(pair)
    for name, column in vertices.items():
        if name not in columns_used:
            _add_attribute(mesh, name, column)


def _add_attribute(mesh: Mesh, name: str, values: Any, prefix: str = "vertex_") -> None:
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
    return values.astype(values.dtype.newbyteorder("="))


def _add_ply_materials(mesh: Mesh, runs: Any) -> None:
    """runs: [label, faces] one after the other, for all faces."""
    fits = isinstance(runs, list) and all(
        isinstance(run, list) and len(run) == 2 and all(type(n) is int and abs(n) < 1 << 31 for n in run)
        for run in runs
    )
    polygons, labels = mesh.polygons, np.array(runs if fits and runs else np.zeros((0, 2)), np.int32)
    if polygons is None or (labels[:, 1] < 0).any() or labels[:, 1].sum(dtype=np.int64) != len(polygons[0]):
        return
    mesh.attributes[FACE_MATERIAL] = np.repeat(labels[:, 0], labels[:, 1])
    mesh.metadata["domains"][FACE_MATERIAL] = "face"


def _add_ply_faces(mesh: Mesh, face_values: dict[str, np.ndarray]) -> None:
    name = next((name for name in ("vertex_indices", "vertex_index") if name in face_values), None)
    if name is None or not isinstance(face_values[name], tuple):
        if face_values:
            mesh.not_read["faces whose corners have no known name"] = list(face_values)
        return
    counts, corners = face_values.pop(name)
    mesh.faces, attributes = with_polygons(counts, _checked("faces", corners.astype(np.int64), len(mesh.points)))
    mesh.attributes |= attributes
    _add_face_rows(mesh)
    if isinstance(face_values.get("texcoord"), tuple):
        per_face, uv = face_values["texcoord"]
        if np.array_equal(per_face, 2 * counts):
            del face_values["texcoord"]
            mesh.attributes["uv"] = _native(uv).reshape(-1, 2)
            mesh.metadata["domains"]["uv"] = "corner"
    for name, column in face_values.items():
        _add_attribute(mesh, name, column, "face_")
