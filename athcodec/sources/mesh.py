"""Meshes as OBJ and PLY files hold them, and what their readers share.

Nothing in a file is trusted: indices are checked before they are used.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import polygons
from athcodec.sources.scene_objects import FACE_MATERIAL, OWN
from athcodec.untyped import JsonObject

STRUCTURE = {"part_vertex_counts", "part_copies", "face_vertex_counts", "face_vertex_indices"}
NAMED = {FACE_MATERIAL: "material_names", "face_group": "group_names"}  # Arrays whose numbers stand for names.
COMMENT_BYTES = 4096  # Where comments are looked for that concern the whole file.


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
        """Return "" if the other mesh has as many vertices and the same faces and edges as this one; otherwise return
        text that says what differs."""
        if len(self.points) != len(other.points):
            return f"got {len(other.points)} vertices, expected {len(self.points)}"
        for elements, first, second in (("faces", self.polygons, other.polygons), ("edges", self.edges, other.edges)):
            if (first is None) != (second is None):
                return f"got {'no' if second is None else 'further'} {elements}"
            if first is not None and second is not None and not all(map(np.array_equal, first, second)):
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


def checked_indices(subject: str, indices: np.ndarray, count: int) -> np.ndarray:
    """Return int32 indices. Raises ClipError for any outside of 0 to count - 1."""
    bad = np.flatnonzero((indices < 0) | (indices >= count))
    if bad.size:
        raise ClipError(f"{subject}: got the number {indices[bad[0]]}, counted from 0, expected below {count}")
    return indices.astype(np.int32)


def add_face_rows(mesh: Mesh) -> None:
    if "face_vertex_counts" in mesh.attributes:
        mesh.metadata["domains"] |= {"face_vertex_counts": "face", "face_vertex_indices": "corner"}


def comments(data: bytes) -> list[str]:
    """Return the comments at the beginning of an OBJ or PLY file, but for that of our writer."""
    head, is_ply = data[:COMMENT_BYTES], data.startswith((b"ply\n", b"ply\r"))
    marks = (b"comment", b"obj_info") if is_ply else (b"#",)
    lines = (line.strip() for line in (head.partition(b"end_header")[0] if is_ply else head).splitlines())
    texts = [line[len(mark) :].decode("latin-1").strip() for line in lines for mark in marks if line.startswith(mark)]
    return [line for line in texts if not line.startswith(OWN)]
