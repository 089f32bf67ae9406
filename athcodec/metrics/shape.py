"""Effects of decoding on shapes: how edges stretch, how faces turn, which of them collapse."""

from __future__ import annotations

import numpy as np

from athcodec.metrics.blocks import Meter, Spread
from athcodec.motion.clip import MotionClip, source_stem_index
from athcodec.motion.polygons import sides

DEGENERATE_SHARE = 1e-3
"""Of a face's area in the source: a decoded face that has less is degenerate."""

ROUNDING = float(np.finfo(np.float32).eps)

Polygons = tuple[np.ndarray, np.ndarray]
"""Numbers of corners (F,) and the vertex of each corner (C,), face after face."""


class ShapeMeter(Meter):
    """Accumulates how edges stretch and how faces turn, frame by frame, against the source.

    Edges that have no length in the source, and faces that have no area, are left out of that frame and counted: those
    no longer, or no higher, than the rounding of float32 of the frame's largest coordinate. A frame is compared with
    the one before it, so frames have to be added in their order.

    Parameters
    ----------
    edges : (E, 2) array of integers, optional
        Pairs of vertices; see `edges_of`.
    polygons : pair of arrays, optional
        Faces as MotionClip.polygons has them.

    Attributes
    ----------
    stretch : Spread
        |length / length in the source - 1| of every edge in every frame.
    angle : Spread
        Angle between the normal of every face in every frame and its normal in the source, degrees. A decoded face
        without any area counts as a right angle.
    excess_turn : Spread
        By how much more than in the source a normal turns from one frame to the next, degrees, 0 where it turns less.
    left_out_edges, left_out_faces : int
        How often an edge or a face was left out, over all frames.
    """

    def __init__(self, edges: np.ndarray | None = None, polygons: Polygons | None = None) -> None:
        """Begin to measure edges (E, 2), pairs of vertices, and `polygons`: the number of corners of each face, and the
        vertices of all corners.
        """
        self.stretch, self.angle, self.excess_turn = Spread(), Spread(), Spread()
        self.left_out_edges = self.left_out_faces = 0
        self._edges = np.asarray(np.empty((0, 2)) if edges is None else edges, np.int64)
        self._faces = [] if polygons is None else _by_size(*polygons)
        face_count = sum(map(len, self._faces))
        self._degenerate = np.zeros(face_count, bool)
        self._values = 3 * max(len(self._edges), sum(faces.size for faces in self._faces))
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    @property
    def edge_count(self) -> int:
        """Number of edges, E."""
        return len(self._edges)

    @property
    def face_count(self) -> int:
        """Number of faces that have at least three corners, F."""
        return len(self._degenerate)

    @property
    def degenerate_faces(self) -> int:
        """Faces whose decoded area is below 1e-3 of that in the source in any frame."""
        return int(self._degenerate.sum())

    def _add(self, reference: np.ndarray, decoded: np.ndarray) -> None:
        rounding = ROUNDING * np.abs(reference).max(axis=(1, 2), initial=0.0)[:, None]
        with np.errstate(invalid="ignore"):
            if self.edge_count:
                self._add_edges(reference, decoded, rounding)
            if self.face_count:
                self._add_faces(reference, decoded, rounding)

    def _add_edges(self, source: np.ndarray, decoded: np.ndarray, rounding: np.ndarray) -> None:
        before, after = (_lengths(frames, self._edges) for frames in (source, decoded))
        is_edge = before > rounding
        self.left_out_edges += int((~is_edge).sum())
        self.stretch.add(np.abs(after[is_edge] / before[is_edge] - 1.0))

    def _add_faces(self, source: np.ndarray, decoded: np.ndarray, rounding: np.ndarray) -> None:
        area, is_face, normal = self._normals(source, rounding)
        shown_area, _, shown_normal = self._normals(decoded, rounding)
        self.left_out_faces += int((~is_face).sum())
        self._degenerate |= (is_face & ~(shown_area >= DEGENERATE_SHARE * area)).any(axis=0)
        self.angle.add(_degrees(normal[is_face], shown_normal[is_face]))
        self._add_turns(is_face, normal, shown_normal)

    def _add_turns(self, is_face: np.ndarray, normal: np.ndarray, shown: np.ndarray) -> None:
        """Add the angles by which the normals of faces turn from frame to frame, from the last frame added before.
        `is_face` tells which faces have an area.
        """
        frames = is_face, normal, shown
        if self._last is not None:
            is_face, normal, shown = (np.concatenate([last, new]) for last, new in zip(self._last, frames))
        self._last = is_face[-1:], normal[-1:], shown[-1:]
        both = is_face[:-1] & is_face[1:]
        turn, shown_turn = (_degrees(normals[:-1][both], normals[1:][both]) for normals in (normal, shown))
        self.excess_turn.add(np.maximum(shown_turn - turn, 0.0))

    def _normals(self, frames: np.ndarray, rounding: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (k, F) areas, whether a face has one, (k, F, 3) unit normals, 0 where a face has no area at all."""
        vectors, reaches = zip(*(_area_vectors(frames, faces) for faces in self._faces))
        vector = np.concatenate(vectors, axis=1)
        area = np.sqrt(np.einsum("tfi,tfi->tf", vector, vector))
        is_face = area > rounding * np.concatenate(reaches, axis=1)
        return area, is_face, vector / np.where(area > 0, area, 1.0)[..., None]


def edges_of(clip: MotionClip) -> np.ndarray | None:
    """Return the edges of a clip to measure: each side of its faces once; if it has no faces, its edges; if it has
    neither, the links between neighbours on a stem.

    Parameters
    ----------
    clip : MotionClip

    Returns
    -------
    (E, 2) array of integers or None
        None where the clip has none of these.
    """
    if clip.polygons is not None:
        return _sides(*clip.polygons)
    if clip.edges is not None:
        return clip.edges
    if clip.vertex_branch is None:
        return None
    return stem_links(clip.vertex_branch, clip.stem_index)


def stem_links(vertex_branch: np.ndarray, stem_index: np.ndarray | None = None) -> np.ndarray:
    """Return (E, 2) pairs of neighbours on a stem; see MotionClip for the parameters."""
    place = source_stem_index(vertex_branch) if stem_index is None else stem_index
    order = np.lexsort((place, vertex_branch))
    is_link = np.diff(vertex_branch[order]) == 0
    return np.stack([order[:-1][is_link], order[1:][is_link]], axis=1)


def _sides(counts: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Return (E, 2) pairs of neighbouring corners, each once, without those of a vertex with itself."""
    pairs = np.sort(sides(counts, indices), axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def _by_size(counts: np.ndarray, indices: np.ndarray) -> list[np.ndarray]:
    """Return faces of three corners and more as (F, size) arrays, one for each size."""
    counts = np.asarray(counts, np.int64)
    starts = np.cumsum(counts) - counts
    sizes = np.unique(counts[counts > 2])
    return [np.asarray(indices)[starts[counts == size][:, None] + np.arange(size)] for size in sizes]


def _area_vectors(frames: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the area vectors (k, F, 3) of faces (F, size) in k frames, along the normals and as long as the areas, and
    the distance (k, F) from a face's first corner to its furthest.
    """
    first, *others = (frames.take(corners, axis=1) for corners in faces.T)
    spokes = [corner - first for corner in others]
    vector = np.zeros_like(spokes[0])
    for one, other in zip(spokes, spokes[1:]):
        vector += np.cross(one, other)
    reach = np.sqrt(np.max([np.einsum("tfi,tfi->tf", spoke, spoke) for spoke in spokes], axis=0))
    return vector / 2, reach


def _lengths(frames: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the lengths (k, E) of edges (E, 2) in frames (k, N, 3)."""
    along = frames.take(edges[:, 1], axis=1) - frames.take(edges[:, 0], axis=1)
    return np.sqrt(np.einsum("tei,tei->te", along, along))


def _degrees(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return angles between (..., 3) unit vectors; a right angle where one of them is 0."""
    apart, together = one - other, one + other
    sine, cosine = (np.sqrt(np.einsum("...i,...i->...", vectors, vectors)) for vectors in (apart, together))
    return np.degrees(2.0 * np.arctan2(sine, cosine))
