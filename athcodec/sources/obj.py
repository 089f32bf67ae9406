"""Reads meshes in OBJ files, vertex for vertex and face for face as the files have them.

v (with colours where there are six or seven numbers), vt, f, l, o, g and usemtl; polygons of any size, relative
indices, lines continued by a backslash. Not read: normals (they belong to one pose), materials' contents, curves and
surfaces; the clip's `not_read` names these and whatever else a file holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy import typing as npt

from athcodec.errors import ClipError
from athcodec.sources.mesh import Mesh, add_face_rows, checked_indices, with_polygons

FLOAT32_DIGITS = 9
STATEMENT_BYTES = 16  # Bytes that an unknown statement of OBJ takes for each word.
# Statements of OBJ that are shapes of a kind that is not read, the last of them of older versions.
FREE_FORM = ("curv", "curv2", "surf", "bsp", "bzp", "cdc", "cdp")
INCLUDED = "call"  # The statement of OBJ that has another file read in its place.
POLYPAINT = b"#MRGB"  # Colours of vertices, which ZBrush writes as comments.


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
        """Begin an OBJ file without any statement."""
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
        """Take the next line of the file and store what its statement says. Raises ClipError if it is broken."""
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
        """Store a face, from the words behind `f`: one for each corner, with the number of a vertex and, behind a
        slash, of its texture coordinates."""
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
    """Return the mesh in an OBJ file whose content is `data`. Raises ClipError if it is broken or has no vertices."""
    file = _Obj()
    for line in obj_lines(data):
        file.line(line)
    if not file.points:
        raise ClipError("got no vertices, expected an OBJ file with lines of v")
    points, colors = obj_points(file.points)
    count = len(points)
    faces, attributes = with_polygons(
        np.array(file.counts, np.int32), checked_indices("faces", np.array(file.corners, np.int64), count)
    )
    mesh = Mesh(points, faces, attributes=attributes, metadata={"domains": {}})
    if file.edges:
        mesh.edges = checked_indices("lines", np.array(file.edges, np.int64).reshape(-1), count).reshape(-1, 2)
    if colors is not None:
        mesh.attributes["colors"] = colors
    add_face_rows(mesh)
    _add_obj_uv(mesh, file)
    _add_obj_names(mesh, file)
    if colors is None and any(len(row) > 3 and (len(row) != 4 or float(row[3]) != 1) for row in file.points):
        mesh.not_read["attribute"] = ["numbers behind the coordinates of v"]  # Weights, or colours that some lack.
    for word in map(_text, ([word] for word in file.not_read)):
        kind = "curve or surface" if word in FREE_FORM else "included file" if word == INCLUDED else "statement"
        mesh.not_read.setdefault(kind, []).append(word)
    return mesh


def obj_points(
    rows: Sequence[Sequence[bytes]], dtype: npt.DTypeLike | None = None
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return (points, colours) from the words on the `v` lines of an OBJ file: points (N, 3), and colours (N, 3) or (N,
    4), None if not every line has them. Points have the type `dtype`, by default float32, or float64 if they have more
    digits than float32 holds."""
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


def narrowed(points: np.ndarray, dtype: npt.DTypeLike | None) -> np.ndarray:
    with np.errstate(over="ignore"):
        return points.astype(dtype)


def _digits(word: bytes) -> int:
    return len(word.lower().partition(b"e")[0].replace(b".", b"").lstrip(b"+-0"))


def _add_obj_uv(mesh: Mesh, file: _Obj) -> None:
    """Store the texture coordinates of the file's corners in the mesh as the attribute "uv", with a row for each
    corner; corners without any get 0."""
    uv_rows = np.array(file.corner_uvs, np.int64)
    if not file.uvs or not (uv_rows >= 0).any():
        file.not_read |= {b"vt": None} if file.uvs else {}
        return
    checked_indices("texture coordinates", uv_rows[uv_rows >= 0], len(file.uvs))
    table = np.array([[float(word) for word in (*row[:2], b"0", b"0")[:2]] for row in file.uvs], np.float32)
    if any(len(row) > 2 and float(row[2]) != 0 for row in file.uvs):
        file.not_read[b"w of vt"] = None
    uv = table[uv_rows]
    uv[uv_rows < 0] = 0
    mesh.attributes["uv"] = uv
    mesh.metadata["domains"]["uv"] = "corner"


def _add_obj_names(mesh: Mesh, file: _Obj) -> None:
    """Store the names of objects, groups and materials in the mesh. The parts of the mesh are the file's objects, or
    its groups if it has no objects; names that cannot be kept are noted as not read."""
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
    """Return for each vertex (N,) the number of the object (`column` 0) or group (1) of the first face, line or point
    that uses it. A vertex that nothing uses gets the number of the vertex before it. `face_labels` (F,) has the numbers
    of the faces."""
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
    """Store the objects as the parts of the mesh if the vertices of each object follow one another; otherwise leave the
    whole mesh one part. `labels` (N,) is the number of each vertex's object in `names`."""
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
