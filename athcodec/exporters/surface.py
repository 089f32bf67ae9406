"""The surface that faces make: which of them are open, so that they are seen from behind, and normals that follow the
motion.

Faces that share an edge are one piece: a leaf card, a tube of bark. Edges that lie at one place are shared too, as a
mesh may be cut open there for its texture coordinates. Nothing here knows a file format.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

OPEN_SHARE = (
    0.25  # Area of its holes, over its own, from which on a piece is open: 1 of a flat card, 0 of a closed tube.
)
SEAM_COSINE = (
    0.2  # Cosine of the largest angle of faces that a seam joins smoothly: of tubes with 5 sides, not of boxes.
)


class Surface:
    """Faces of counts (F,) and corners (C,), vertices of a rest pose (N, 3)."""

    def __init__(self, counts: np.ndarray, corners: np.ndarray, rest: np.ndarray):
        counts = np.asarray(counts, np.int64)
        self._corners, self._rest = np.asarray(corners, np.int64), np.asarray(rest, np.float64)
        self._face_count, self._face = len(counts), np.repeat(np.arange(len(counts)), counts)
        stops, side = np.cumsum(counts), np.arange(len(self._corners))
        self._first = stops - counts  # the first corner of each face
        self._next = np.where(side + 1 == stops[self._face], self._first[self._face], side + 1)

    @cached_property
    def is_open(self) -> np.ndarray:
        """Whether each face can be seen from behind, (F,) bool: its connected piece encloses no volume, or the faces of
        the piece do not all show the same side.
        """
        piece, sides = self._pieces, self._rims
        piece_of_side = piece[self._face[sides]]
        start, end = self._ends(self._places, sides)
        # A rim is a part of the border that hangs together, and its hole as large as the sum of vectors along it says.
        nodes, ends = np.unique(
            np.concatenate([piece_of_side, piece_of_side]) * len(self._rest) + np.concatenate([start, end]),
            return_inverse=True,
        )
        ends = ends.reshape(2, -1).T
        rim = first_joined(ends, len(nodes))[ends[:, 0]]
        origin = self._rest[self._corners[self._first[piece_of_side]]]
        vectors = _sums(np.cross(self._rest[start] - origin, self._rest[end] - origin) / 2, rim, len(nodes))
        holes = np.bincount(nodes // len(self._rest), np.linalg.norm(vectors, axis=1), self._face_count)
        area = np.bincount(piece, np.linalg.norm(self._face_vectors(self._rest), axis=1), self._face_count)
        is_open = holes >= OPEN_SHARE * area
        is_open[piece[self._face[self._twisted]]] = True
        return is_open[piece]

    def normals(self, positions: np.ndarray) -> np.ndarray:
        """Return the normals of vertices at positions (N, 3), float64 of length 1: means of the faces around them, each
        by its area. They are 0 where no face has any."""
        sums = _sums(self._face_vectors(positions)[self._face], self._groups[self._corners], len(self._rest))
        length = np.linalg.norm(sums, axis=1, keepdims=True)
        return np.divide(sums, length, out=np.zeros_like(sums), where=length > 0)[self._groups]

    def unit_normals(self, positions: np.ndarray) -> np.ndarray:
        """Return the normals as files have them: float32, and all of length 1."""
        normals = self.normals(positions)
        return np.where(normals.any(axis=1, keepdims=True), normals, [0.0, 0.0, 1.0]).astype(np.float32)

    @cached_property
    def neighbours(self) -> np.ndarray:
        """(N,): for each vertex another one of a face of it; itself where it has no face."""
        neighbour = np.arange(len(self._rest))
        neighbour[self._corners] = self._corners[self._next]
        return neighbour

    def _face_vectors(self, positions: np.ndarray) -> np.ndarray:
        """Return (F, 3): normals of the faces, as long as these are large."""
        points = np.asarray(positions, np.float64)[self._corners]
        away = points - points[self._first[self._face]]
        return _sums(np.cross(away, away[self._next]) / 2, self._face, self._face_count)

    def _ends(self, numbers: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of the vertices at which sides of faces begin and end."""
        return numbers[self._corners[sides]], numbers[self._corners[self._next[sides]]]

    @cached_property
    def _inner(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pairs of sides that are one edge of two faces, (p,) and (p,), and the other sides."""
        sides = np.arange(len(self._corners))
        return _shared(*self._ends(np.arange(len(self._rest)), sides), sides)

    @property
    def _twisted(self) -> np.ndarray:
        """Sides of faces that face the other side of the surface than their neighbours."""
        one, other, _ = self._inner
        return one[self._corners[one] == self._corners[other]]

    @cached_property
    def _places(self) -> np.ndarray:
        """(N,): of each vertex at the border the first of those at its place, of others themselves."""
        places, sides = np.arange(len(self._rest)), self._inner[2]
        vertices = np.unique(np.concatenate(self._ends(places, sides)))
        _, first, place = np.unique(self._rest[vertices], axis=0, return_index=True, return_inverse=True)
        places[vertices] = vertices[first][place.ravel()]
        return places

    @cached_property
    def _seams(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `_inner`, of the sides that are left there, by where they are."""
        sides = self._inner[2]
        one, other, rims = _shared(*self._ends(self._places, sides), sides)
        (start, _), (_, end) = self._ends(self._places, one), self._ends(self._places, other)
        runs_on = start == end
        return one[runs_on], other[runs_on], np.concatenate([rims, one[~runs_on], other[~runs_on]])

    @property
    def _rims(self) -> np.ndarray:
        return self._seams[2]

    @cached_property
    def _pieces(self) -> np.ndarray:
        """(F,): the first face of the piece that each is of."""
        pairs = [np.stack([self._face[one], self._face[other]], axis=1) for one, other, _ in (self._inner, self._seams)]
        return first_joined(np.concatenate(pairs), self._face_count)

    @cached_property
    def _groups(self) -> np.ndarray:
        """For each vertex, (N,), the first of the vertices that share its normal, because a smooth seam joins them."""
        one, other, _ = self._seams
        vectors = self._face_vectors(self._rest)
        vectors /= np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.finfo(float).tiny)
        is_smooth = (vectors[self._face[one]] * vectors[self._face[other]]).sum(axis=1) > SEAM_COSINE
        (start, end), (other_start, other_end) = (
            self._ends(np.arange(len(self._rest)), sides[is_smooth]) for sides in (one, other)
        )
        pairs = np.concatenate([np.stack([start, other_end], axis=1), np.stack([end, other_start], axis=1)])
        return first_joined(pairs, len(self._rest))


class MovingNormals:
    """Normals of vertices at rest (N, 3), as they turn with a surface from frame to frame."""

    def __init__(self, surface: Surface, rest: np.ndarray):
        self._surface = surface
        self._before = self._after = self._frames(rest)

    def move(self, positions: np.ndarray) -> None:
        """Go to the frame in which the vertices are at positions (N, 3)."""
        self._after = self._frames(positions)

    def offsets(self, normals: np.ndarray, vertices: np.ndarray) -> np.ndarray:
        """Return what to add to the normals at rest, (n, 3) float32, of these vertices, (n,), in that frame."""
        before, after = self._before[vertices], self._after[vertices]
        moved = np.einsum("nij,ni->nj", after, np.einsum("nij,nj->ni", before, normals))
        # Where faces have no area, as those of a leaf that unfolds out of a point, nothing says how they turn.
        has_both = before.any(axis=2).all(axis=1) & after.any(axis=2).all(axis=1)
        moved[~has_both] = np.where(after[~has_both, 0].any(axis=1)[:, None], after[~has_both, 0], normals[~has_both])
        return (moved - normals).astype(np.float32)

    def _frames(self, positions: np.ndarray) -> np.ndarray:
        """Return three axes for each vertex, (N, 3, 3): its normal, the direction of one of its edges at right angles
        to that, and the direction at right angles to both.
        """
        points = np.asarray(positions, np.float64)
        normals = self._surface.normals(points)
        along = points[self._surface.neighbours] - points
        along -= normals * (along * normals).sum(axis=1, keepdims=True)
        length = np.linalg.norm(along, axis=1, keepdims=True)
        along = np.divide(along, length, out=np.zeros_like(along), where=length > 0)
        return np.stack([normals, along, np.cross(normals, along)], axis=1)


def first_joined(pairs: np.ndarray, count: int) -> np.ndarray:
    """Return for each of `count` things the lowest number among those that `pairs` (P, 2) join it to, directly or
    through others.
    """
    label = np.arange(count)
    while len(pairs):
        ends = label[pairs]
        differ = ends[:, 0] != ends[:, 1]
        pairs, ends = pairs[differ], ends[differ]
        np.minimum.at(label, ends.max(axis=1), ends.min(axis=1))
        while (label[label] != label).any():
            label = label[label]
    return label


def _shared(start: np.ndarray, end: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return two arrays of sides of faces that are the same edge, pair by pair, and a third of the sides that remain.
    Side number `sides[i]` runs from vertex `start[i]` to `end[i]`; an edge is shared by exactly two sides, and sides of
    no length are not edges.
    """
    count = int(max(start.max(initial=0), end.max(initial=0))) + 1
    edge, uses = np.unique(
        np.minimum(start, end) * count + np.maximum(start, end), return_inverse=True, return_counts=True
    )[1:]
    is_shared = (uses[edge] == 2) & (start != end)
    order = np.argsort(edge[is_shared], kind="stable")
    pairs = sides[is_shared][order].reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1], sides[~is_shared]


def _sums(vectors: np.ndarray, label: np.ndarray, count: int) -> np.ndarray:
    """Return (count, 3) float64: the sums of the vectors of each label."""
    return np.stack([np.bincount(label, column, count) for column in vectors.T], axis=1, dtype=np.float64)
