"""Meshes as OBJ and PLY text and bytes: what moves is written per frame, all else is put together once.

OBJ has v per frame; texture coordinates, polygons, lines, objects, groups and materials' names behind it. PLY (binary,
little endian) has the vertices with what each has (colours, uv, any plain number), polygons and edges; objects,
materials, unit, up axis and frame rate are JSON in a comment. Coordinates come back bit for bit: nine digits for
float32, seventeen for float64. Left out: normals, attributes that the format has no place for, other metadata.
"""

from __future__ import annotations

import json
from typing import BinaryIO

import numpy as np

from athcodec.exporters.scene_objects import face_materials, names_and_scene
from athcodec.motion.protocol import Motion
from athcodec.sources.scene_objects import FACE_MATERIAL, OWN
from athcodec.untyped import JsonObject

COORDINATE_FORMATS = {4: "v %.9g %.9g %.9g\n", 8: "v %.16e %.16e %.16e\n"}
BLOCK_ROWS = 1 << 14
_PLY_NAMES = {
    "i1": "char",
    "u1": "uchar",
    "i2": "short",
    "u2": "ushort",
    "i4": "int",
    "u4": "uint",
    "f4": "float",
    "f8": "double",
}
_PLY_COLORS = ("red", "green", "blue", "alpha")


def domain_of(motion: Motion, name: str) -> str:
    """Return "vertex", or what metadata["domains"] says of an attribute; "" where nothing says and rows are not
    vertices."""
    domains = motion.metadata.get("domains")
    domain = domains.get(name) if isinstance(domains, dict) else None
    values = motion.attributes[name]
    return domain or ("vertex" if values.ndim and len(values) == motion.vertex_count else "")


def has_mesh(motion: Motion) -> bool:
    """Return whether there are faces or edges to write."""
    return len(_polygons(motion)[0]) > 0 or (motion.edges is not None and len(motion.edges) > 0)


def part_spans(motion: Motion) -> list[tuple[str, int, int]]:
    """Return triples of a name, a first vertex and the vertex after the last, one for each object of the clip. A clip
    that names no objects is one object.
    """
    names, counts = motion.metadata.get("part_names"), motion.attributes.get("part_vertex_counts")
    if (
        not isinstance(names, list)
        or counts is None
        or len(counts) != len(names)
        or int(np.sum(counts)) != motion.vertex_count
        or np.min(counts, initial=0) < 0
    ):
        name = names[0] if isinstance(names, list) and len(names) == 1 else "plant"
        return [(_one_line(name), 0, motion.vertex_count)]
    ends = np.cumsum(counts, dtype=np.int64)
    return [(_one_line(name), int(end - count), int(end)) for name, end, count in zip(names, ends, counts)]


def _one_line(name: object) -> str:
    return " ".join(str(name).split()) or "plant"


def _polygons(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Return corners per face (F,), and the vertex of each corner (C,); both are empty if there are no faces."""
    return motion.polygons or (np.empty(0, np.int64), np.empty(0, np.int64))


def _corner_uv(motion: Motion) -> tuple[np.ndarray | None, bool]:
    """Return texture coordinates (rows, 2), and whether they have a row per corner (else per vertex); None in place of
    coordinates if the clip has none.
    """
    uv = motion.attributes.get("uv")
    if uv is None or uv.ndim != 2 or uv.shape[1] != 2 or uv.dtype.kind != "f":
        return None, False
    domain = domain_of(motion, "uv")
    if domain == "corner" and motion.polygons is not None and len(uv) == len(motion.polygons[1]):
        return uv, True
    return (uv, False) if domain == "vertex" and len(uv) == motion.vertex_count else (None, False)


def _has_obj_colors(motion: Motion) -> bool:
    """Return whether a clip has colours as OBJ has them: three floats for each vertex."""
    colors = motion.attributes.get("colors")
    fits = colors is not None and colors.shape == (motion.vertex_count, 3) and colors.dtype.kind == "f"
    return fits and domain_of(motion, "colors") == "vertex"


def obj_arrays(motion: Motion) -> set[str]:
    """Return the names of the attributes that OBJ files of a clip hold."""
    kept = {"uv": _corner_uv(motion)[0] is not None, "colors": _has_obj_colors(motion)}
    return {name for name, is_kept in kept.items() if is_kept}


def ply_arrays(motion: Motion) -> set[str]:
    """Return the names of the attributes that PLY files of a clip hold."""
    columns, renamed = _ply_columns(motion), {"uv": "s", "colors": "red"}
    kept = {name for name in motion.attributes if renamed.get(name, name) in columns}
    return kept | obj_arrays(motion) & {"uv"}


class ObjWriter:
    """OBJ files of one clip; write(file, points) for each."""

    suffix, arrays = ".obj", staticmethod(obj_arrays)

    def __init__(self, motion: Motion):
        self._tail = "".join(_obj_tail(motion)).encode()
        self._colors = motion.attributes["colors"] if _has_obj_colors(motion) else None

    def write(self, file: BinaryIO, points: np.ndarray) -> None:
        """Write one frame as OBJ: the points (N, 3), with colours if the clip has them, and then all lines that do not
        change.
        """
        form = COORDINATE_FORMATS[points.dtype.itemsize]
        if self._colors is not None:
            form = form[:-1] + " %.9g %.9g %.9g\n"
        for start in range(0, len(points), BLOCK_ROWS):
            rows = points[start : start + BLOCK_ROWS].astype(np.float64)
            if self._colors is not None:
                rows = np.concatenate([rows, self._colors[start : start + BLOCK_ROWS]], axis=1)
            file.write((form * len(rows) % tuple(rows.reshape(-1).tolist())).encode())
        file.write(self._tail)


def _obj_tail(motion: Motion) -> list[str]:
    """Return the lines of an OBJ file that follow the vertices and are the same in all frames."""
    uv, per_corner = _corner_uv(motion)
    lines = [] if uv is None else [f"vt {u:.9g} {v:.9g}\n" for u, v in uv.tolist()]
    faces = _obj_faces(motion, uv is not None, per_corner)
    ends = [] if motion.edges is None else (np.asarray(motion.edges, np.int64) + 1).tolist()
    edges = [f"l {a} {b}\n" for a, b in ends]
    spans = part_spans(motion)
    stops = np.array([stop for _, _, stop in spans])
    face_parts = _parts_of(stops, _first_corners(motion))
    edge_parts = _parts_of(stops, None if motion.edges is None else np.asarray(motion.edges, np.int64)[:, 0])
    if face_parts is None or edge_parts is None:
        return [*lines, *faces, *edges]
    for number, (name, start, stop) in enumerate(spans):
        lines.append(f"o {name}\n")
        elements = [
            *(faces[slice(*np.searchsorted(face_parts, [number, number + 1]))]),
            *(edges[slice(*np.searchsorted(edge_parts, [number, number + 1]))]),
        ]
        lines += elements or [f"p {' '.join(map(str, range(start + 1, stop + 1)))}\n"] * (stop > start)
    return lines


def _first_corners(motion: Motion) -> np.ndarray | None:
    counts, corners = _polygons(motion)
    if not len(counts):
        return None
    starts = np.cumsum(counts, dtype=np.int64) - counts
    return np.asarray(corners, np.int64)[np.minimum(starts, len(corners) - 1)]


def _parts_of(stops: np.ndarray, vertices: np.ndarray | None) -> np.ndarray | None:
    """Return the part of each vertex; None where they do not come in the order of the parts."""
    parts = np.searchsorted(stops, [] if vertices is None else vertices, side="right")
    return parts if (np.diff(parts) >= 0).all() else None


def _obj_faces(motion: Motion, has_uv: bool, per_corner: bool) -> list[str]:
    """Return a line for each face of an OBJ file, with the lines of its group and material where these begin.
    `per_corner` tells whether texture coordinates are per corner or per vertex.
    """
    counts, corners = _polygons(motion)
    vertices = (np.asarray(corners, np.int64) + 1).tolist()
    words = [
        f"{vertex}/{place if per_corner else vertex}" if has_uv else f"{vertex}"
        for place, vertex in enumerate(vertices, 1)
    ]
    ends = np.cumsum(counts, dtype=np.int64).tolist()
    lines = [f"f {' '.join(words[end - count : end])}\n" for end, count in zip(ends, np.asarray(counts).tolist())]
    _switch_names(motion, lines, "face_material", "material_names", "usemtl")
    _switch_names(motion, lines, "face_group", "group_names", "g")
    return lines


def _switch_names(motion: Motion, lines: list[str], attribute: str, names_key: str, word: str) -> None:
    """Put a line with the name, such as "usemtl leaf", before each face at which the name changes."""
    labels, names = motion.attributes.get(attribute), motion.metadata.get(names_key)
    if labels is None or not isinstance(names, list) or labels.shape != (len(lines),) or labels.dtype.kind not in "iu":
        return
    for face in np.flatnonzero(np.diff(labels, prepend=-1)):
        if 0 <= labels[face] < len(names):
            lines[face] = f"{word} {_one_line(names[labels[face]])}\n{lines[face]}"


class PlyWriter:
    """Binary PLY files of one clip; write(file, points) for each."""

    suffix, arrays = ".ply", staticmethod(ply_arrays)

    def __init__(self, motion: Motion):
        """Prepare what all frames of a PLY file share: its header, the columns of its vertices, its faces and its
        edges.
        """
        columns = _ply_columns(motion)
        coordinate = "<f4" if motion.dtype.itemsize == 4 else "<f8"
        fields = [(axis, coordinate) for axis in "xyz"]
        fields += [(name, f"<{values.dtype.str[1:]}") for name, values in columns.items()]
        self._rows = np.zeros(motion.vertex_count, fields)
        for name, values in columns.items():
            self._rows[name] = values
        face_header, faces = _ply_faces(motion)
        edge_count = 0 if motion.edges is None else len(motion.edges)
        edge_header = [f"element edge {edge_count}", "property int vertex1", "property int vertex2"]
        self._tail = faces + (np.asarray(motion.edges, "<i4").tobytes() if edge_count else b"")
        lines = [
            "ply",
            "format binary_little_endian 1.0",
            f"comment {OWN} {json.dumps(_ply_scene(motion))}",
            f"element vertex {motion.vertex_count}",
            *(f"property {_PLY_NAMES[self._rows.dtype[name].str[1:]]} {name}" for name, _ in fields),
            *face_header,
            *(edge_header if edge_count else []),
            "end_header",
        ]
        self._header = ("\n".join(lines) + "\n").encode()

    def write(self, file: BinaryIO, points: np.ndarray) -> None:
        for axis, name in enumerate("xyz"):
            self._rows[name] = points[:, axis]
        file.write(self._header)
        file.write(self._rows.tobytes())
        file.write(self._tail)


def _ply_columns(motion: Motion) -> dict[str, np.ndarray]:
    """Return the numbers that each vertex has beside its position, (N,) each, by the name of the PLY property."""
    columns: dict[str, np.ndarray] = {}
    for name, values in motion.attributes.items():
        if domain_of(motion, name) != "vertex" or len(values) != motion.vertex_count or name == "normals":
            continue
        names: tuple[str, ...]
        if name == "uv" and values.ndim == 2 and values.shape[1] == 2:
            names = ("s", "t")
        elif name == "colors" and values.ndim == 2 and values.shape[1] in (3, 4):
            names = _PLY_COLORS[: values.shape[1]]
        elif values.ndim == 1 and name.isascii() and name.isprintable() and not set(name) & set(" \t"):
            names = (name,)
        else:
            continue
        if values.dtype.str[1:] in _PLY_NAMES and not set(names) & {"x", "y", "z", *columns}:
            columns |= dict(zip(names, values.reshape(len(values), -1).T))
    return columns


def _ply_scene(motion: Motion) -> JsonObject:
    """Return what the comment of a PLY file holds. Materials of faces are runs: meshio does not read a property of
    faces beside their corners."""
    scene = names_and_scene(motion)
    if face_materials(motion) is not None:
        labels = motion.attributes[FACE_MATERIAL]
        starts = np.flatnonzero(np.diff(labels, prepend=labels[:1] - 1))
        scene[FACE_MATERIAL] = np.stack([labels[starts], np.diff(starts, append=len(labels))], axis=1).tolist()
    return scene


def _ply_faces(motion: Motion) -> tuple[list[str], bytes]:
    """Return the header lines and the bytes of the faces of a PLY file, with texture coordinates if these are per
    corner. Both are empty if there are no faces.
    """
    counts, corners = _polygons(motion)
    if not len(counts):
        return [], b""
    uv, per_corner = _corner_uv(motion)
    counted = "uint" if max(counts) > 127 else "uchar"
    header = [f"element face {len(counts)}", f"property list {counted} int vertex_indices"]
    if per_corner:
        header.append(f"property list {counted} float texcoord")
    corners, number = np.asarray(corners, "<i4"), "<u4" if counted == "uint" else "u1"
    ends = np.cumsum(counts, dtype=np.int64)
    uv = uv if per_corner else None
    if (np.asarray(counts) == counts[0]).all():
        return header, _ply_rows(corners, uv, int(counts[0]), number)
    return header, b"".join(
        _ply_rows(corners[end - size : end], None if uv is None else uv[end - size : end], int(size), number)
        for size, end in zip(np.asarray(counts).tolist(), ends.tolist())
    )


def _ply_rows(corners: np.ndarray, uv: np.ndarray | None, size: int, number: str) -> bytes:
    """Return the bytes of faces that all have `size` corners. `uv` has the texture coordinates of the corners, and
    `number` the type of the count in front of each face.
    """
    fields: list[tuple[str, str, tuple[int, ...]]] = [("count", number, ()), ("corners", "<i4", (size,))]
    if uv is not None:
        fields += [("numbers", number, ()), ("uv", "<f4", (2 * size,))]
    rows = np.zeros(len(corners) // size if size else 1, fields)
    rows["count"], rows["corners"] = size, corners.reshape(-1, size) if size else 0
    if uv is not None:
        rows["numbers"], rows["uv"] = 2 * size, uv.reshape(-1, 2 * size) if size else 0
    return rows.tobytes()


WRITERS = {writer.suffix: writer for writer in (ObjWriter, PlyWriter)}
