"""Polygons by the vertices of their corners, as FACES and EDGES hold them: all with as many corners, or each with a
count."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from athcodec._native import CorePolygons

POLYGON_ARRAYS = "face_vertex_counts", "face_vertex_indices"
"""Attributes that stand for faces of different sizes."""
_SIGNED = 4


def type_code(dtype: np.dtype) -> int:
    """Return the code of an integer type in FORMAT.md."""
    size = dtype.itemsize.bit_length() - 1
    return size | _SIGNED * (dtype.kind == "i")


def type_of(code: int) -> np.dtype:
    return np.dtype(f"<{'i' if code & _SIGNED else 'u'}{1 << (code & 3)}")


def sides(counts: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the sides of polygons as pairs of vertices, (C, 2) int64: from each corner to the next one of its face.
    counts: (F,) corners of each face. corners: (C,) vertices, face after face."""
    counts, corners = np.asarray(counts, np.int64), np.asarray(corners, np.int64)
    following, stop = np.arange(1, len(corners) + 1), np.cumsum(counts)
    has_corners = counts > 0
    following[stop[has_corners] - 1] = (stop - counts)[has_corners]
    return np.stack([corners, corners[following]], axis=1)


@dataclass(frozen=True)
class Polygons:
    """Corners (C,) int32 in source order, counts (F,) uint32, or None if all faces have `columns` corners, and the
    source's types."""

    corners: np.ndarray
    counts: np.ndarray | None
    face_count: int
    columns: int
    index_type: np.dtype
    count_type: np.dtype | None = None
    derived: bool = False  # Edges that follow from the branches; they have no corners here.

    @classmethod
    def of_rows(cls, rows: np.ndarray) -> Polygons:
        """Return the polygons of an array of vertex numbers, (F, k)."""
        corners = np.ascontiguousarray(rows, np.int32).reshape(-1)
        return cls(corners, None, len(rows), rows.shape[1], rows.dtype)

    @classmethod
    def of_attributes(cls, attributes: Mapping[str, np.ndarray]) -> Polygons | None:
        """Return the polygons in the attributes "face_vertex_counts" and "face_vertex_indices", or None if these do not
        exist or are not flat arrays of integers."""
        counts, indices = (attributes.get(name) for name in POLYGON_ARRAYS)
        if counts is None or indices is None or counts.ndim != 1 or indices.ndim != 1:
            return None
        if counts.dtype.kind not in "iu" or indices.dtype.kind not in "iu":
            return None
        corners = np.ascontiguousarray(indices, np.int32)
        return cls(corners, np.ascontiguousarray(counts, np.uint32), len(counts), 0, indices.dtype, counts.dtype)

    def among(self, vertices: np.ndarray) -> Polygons:
        """Return the polygons all of whose corners are among `vertices` (ascending), renumbered to places in
        `vertices`."""
        number = np.minimum(np.searchsorted(vertices, self.corners), len(vertices) - 1).astype(np.int32)
        counts = np.full(self.face_count, self.columns, np.uint32) if self.counts is None else self.counts
        face = np.repeat(np.arange(self.face_count), counts)
        kept = np.bincount(face, vertices[number] != self.corners, self.face_count) == 0
        some = None if self.counts is None else counts[kept]
        return replace(self, corners=number[kept[face]], counts=some, face_count=int(kept.sum()))

    @property
    def shape(self) -> CorePolygons:
        """The sizes and types of the polygons' arrays, as the C core takes them."""
        return CorePolygons(
            self.face_count,
            len(self.corners),
            self.columns,
            self.count_type is not None,
            False,
            type_code(self.index_type),
            0 if self.count_type is None else type_code(self.count_type),
        )

    @property
    def rows(self) -> np.ndarray:
        """Faces of as many corners, (F, k) of the source's type."""
        return self.corners.astype(self.index_type).reshape(self.face_count, self.columns)

    @property
    def attributes(self) -> dict[str, np.ndarray]:
        """Arrays of faces of different sizes, of the source's types."""
        assert self.counts is not None  # Faces of different sizes have counts.
        arrays = self.counts.astype(self.count_type), self.corners.astype(self.index_type)
        return dict(zip(POLYGON_ARRAYS, arrays))
