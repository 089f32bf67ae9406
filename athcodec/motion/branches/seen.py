"""Observations for the methods that find branches: positions in a few frames, and links between vertices."""

from __future__ import annotations

import copy
from functools import cached_property

import numpy as np

from athcodec.motion.branches.bodies import body_links
from athcodec.motion.branches.common_motion import without_common_motion
from athcodec.motion.branches.groups import moments_of_each, sums_of_each
from athcodec.motion.branches.growing_points import growing_links
from athcodec.motion.branches.steady import connected_parts, scipy_module
from athcodec.motion.clip import MotionClip
from athcodec.motion.places import Places
from athcodec.motion.polygons import sides
from athcodec.motion.sampling import spread

SAMPLE_FRAMES = 12  # Frames of the clip that the methods look at.
AFFINE_ERROR = 1e-4  # Part of the diagonal that parts may be off one affine map.
FLAT = 1e-9  # Part of a part's spread below which a direction has none.
WELD = 1e-6  # Part of the diagonal; vertices that stay closer are one vertex of a mesh that was split.


class Seen:
    """Observations of a clip, each computed once, when it is asked for.

    by_price: whether branches hang where they take the fewest bits, and not where they grow. on_carrier: whether roots
    will hang on a branch that moves as the whole plant does, so that this motion costs them nothing.
    """

    def __init__(self, clip: MotionClip, by_price: bool = False):
        self.clip, self.by_price, self.on_carrier = clip, by_price, False

    def by_contact(self) -> Seen:
        """Return the same observations, with what is known of them, for branches that hang where they grow."""
        seen = copy.copy(self)
        seen.by_price = False
        return seen

    def of_carried(self) -> Seen:
        """Return the same observations, with what is known of them, for roots that may hang on what carries them."""
        seen = copy.copy(self)
        seen.on_carrier = True
        return seen

    @cached_property
    def frames(self) -> np.ndarray:
        """The rest pose and a few frames spread over the clip, (1 + k, N, 3) float64, without what they have in common
        as a whole."""
        return self.source_frames if self._standing is None else self._standing

    @property
    def frames_of_roots(self) -> np.ndarray:
        """The same frames with all motion that roots have to describe: what a plant has in common may be a lean."""
        return self.frames if self.on_carrier else self.source_frames

    @property
    def is_carried(self) -> bool:
        """Whether the whole plant turns or travels, so that its frames are seen without that motion."""
        return self._standing is not None

    @cached_property
    def _standing(self) -> np.ndarray | None:
        return without_common_motion(self.source_frames)

    @cached_property
    def source_frames(self) -> np.ndarray:
        """The same frames as the clip has them."""
        clip = self.clip
        some = spread(clip.frame_count, SAMPLE_FRAMES)
        return np.concatenate([clip.rest[None], *(clip.block(frame, frame + 1).astype(np.float64) for frame in some)])

    @cached_property
    def mesh(self) -> np.ndarray:
        """Pairs of vertices that edges or sides of faces join, (L, 2)."""
        return links_of(self.clip)

    @cached_property
    def links(self) -> np.ndarray:
        """The links of `mesh`, and those between vertices that stay at one place."""
        return np.concatenate([self.mesh, self._pairs])

    @cached_property
    def bodies(self) -> np.ndarray:
        """Pairs of points that are near each other on one body, (L, 2), for points that nothing joins."""
        return body_links(self.frames[1:])  # The rest pose may be of other lengths.

    @cached_property
    def growing(self) -> list[np.ndarray]:
        """Ways to link points of plants that grow, (L, 2) each, where nothing joins them; none if nothing grows."""
        return [] if len(self.mesh) else growing_links(self.frames[1:])

    @cached_property
    def neighbours(self) -> np.ndarray:
        """The links, or, of points that nothing joins, pairs near each other on one body, (L, 2)."""
        return self.links if len(self.links) else self.bodies

    @cached_property
    def _pairs(self) -> np.ndarray:
        """Pairs of vertices that stay at one place."""
        return _pairs_at_one_place(self.clip)

    @cached_property
    def parts(self) -> np.ndarray | None:
        """Labels of what sides of faces join, (N,); None: it is no mesh of faces alone, or single points join nothing
        that sides do not."""
        count = self.clip.vertex_count
        label = parts_by_sides(self.clip, Places(components(self._pairs, count)))
        welded = components(self.links, count)
        return None if label is None or label.max() == welded.max() else label


def links_of(clip: MotionClip) -> np.ndarray:
    """Return pairs of vertices that belong together, (L, 2): joined by an edge or a side of a face, or next to each
    other in a copy of a shape.
    """
    pairs = [np.zeros((0, 2), np.int64)]
    if clip.edges is not None:
        pairs.append(clip.edges.astype(np.int64))
    if clip.polygons is not None:
        pairs.append(sides(*clip.polygons))
    copy = copies_of(clip)
    inside = np.flatnonzero((copy[1:] == copy[:-1]) & (copy[1:] > 0))
    pairs.append(np.stack([inside, inside + 1], axis=1))
    return np.concatenate(pairs)


def _parts(clip: MotionClip) -> tuple[np.ndarray, np.ndarray] | None:
    """Return two arrays about the objects of a scene: how many vertices each has, and of how many copies of one shape
    it consists, 1 for all objects if the numbers of copies do not fit. Return None if the clip does not name its
    objects.
    """
    counts, copies = (clip.attributes.get(f"part_{name}") for name in ("vertex_counts", "copies"))
    if counts is None or counts.ndim != 1 or counts.dtype.kind not in "iu":
        return None
    if (counts < 0).any() or counts.sum(dtype=np.int64) != clip.vertex_count:
        return None
    one = np.ones_like(counts)
    if copies is None or copies.shape != counts.shape or copies.dtype.kind not in "iu" or (copies < 1).any():
        return counts, one
    return counts, one if (copies > np.maximum(counts, 1)).any() or (counts % copies).any() else copies


def parts_of(clip: MotionClip) -> np.ndarray | None:
    """Return the number of the object of the scene, or of the copy of one, that each vertex is of, (N,); None where the
    clip does not say."""
    parts = _parts(clip)
    if parts is None:
        return None
    each = np.repeat(parts[0] // parts[1], parts[1])
    return numbered(np.repeat(np.arange(len(each)), each))


def affine_share(frames: np.ndarray, label: np.ndarray) -> float:
    """Return which share of the vertices, 0 to 1, belongs to parts that move by one affine map in each of the frames.
    The maps start from the frame in which the part is largest. `frames`: (k, N, 3) positions; `label`: the part of each
    vertex, (N,).
    """
    size = np.bincount(label)
    centred = np.stack([pose - sums_of_each(pose, label)[label] / size[label, None] for pose in frames])
    spreads = np.array([sums_of_each((pose**2).sum(axis=1)[:, None], label)[:, 0] for pose in centred])
    full = centred[spreads.argmax(axis=0)[label], np.arange(len(label))]
    moments = moments_of_each(full, full, label)
    flat = (FLAT * spreads.max(axis=0) + np.finfo(float).tiny)[:, None, None] * np.eye(3)
    inverse = np.linalg.inv(moments + flat)
    tolerance = AFFINE_ERROR * float(np.linalg.norm(np.ptp(frames.reshape(-1, 3), axis=0)))
    moves = np.ones(len(size), bool)
    for pose in centred:
        maps = moments_of_each(pose, full, label) @ inverse
        off = np.linalg.norm(pose - np.einsum("nij,nj->ni", maps[label], full), axis=1)
        moves[label[off > tolerance]] = False
    return float(size[moves].sum() / size.sum())


def copies_of(clip: MotionClip) -> np.ndarray:
    """Return the number of the copy that each vertex is of, (N,), from 1 on; 0 for none (MotionClip, part_copies)."""
    parts = _parts(clip)
    if parts is None:
        return np.zeros(clip.vertex_count, np.int64)
    counts, copies = parts
    each = np.repeat(counts // copies, copies)
    return np.where(np.repeat(copies > 1, counts), np.repeat(np.arange(1, len(each) + 1), each), 0)


def parts_by_sides(clip: MotionClip, places: Places) -> np.ndarray | None:
    """Return the part of the mesh that each vertex is of, (N,), where a part is what faces with common sides make:
    faces that touch at a point alone are of different parts. A vertex of several parts counts for the largest. Return
    None for a clip that does not consist of faces alone, or that has copies.
    """
    if clip.polygons is None or clip.edges is not None or copies_of(clip).any():
        return None
    counts, corners = (array.astype(np.int64) for array in clip.polygons)
    if not len(corners):
        return None
    face = np.repeat(np.arange(len(counts)), counts)
    of_face = faces_by_sides(counts, sides(counts, places.of_vertex[corners]))
    size = np.bincount(of_face[face], minlength=of_face.max() + 1)
    label = np.full(clip.vertex_count, -1)
    largest_last = np.argsort(size[of_face[face]], kind="stable")
    label[corners[largest_last]] = of_face[face[largest_last]]
    bare = label < 0
    label[bare] = len(size) + places.of_vertex[bare]
    return numbered(label)


def faces_by_sides(counts: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return labels of what common sides join, of faces with so many corners, (F,). side: pairs of vertices, (C, 2)."""
    face, side = np.repeat(np.arange(len(counts)), counts), np.sort(side, axis=1)
    order = np.lexsort(side.T)
    same = np.flatnonzero((side[order[1:]] == side[order[:-1]]).all(axis=1))
    return components(np.stack([face[order[same]], face[order[same + 1]]], axis=1), len(counts))


def _pairs_at_one_place(clip: MotionClip) -> np.ndarray:
    """Return pairs of vertices that are at the same place in the rest pose, the middle frame and the last one, (L, 2),
    as where a mesh is split to have two normals.
    """
    rest = clip.rest
    last = clip.block(clip.frame_count - 1, clip.frame_count)[0].astype(np.float64)
    middle = clip.block(clip.frame_count // 2, clip.frame_count // 2 + 1)[0].astype(np.float64)
    step = max(WELD * float(np.linalg.norm(np.ptp(rest, axis=0))), 1e-30)
    cells = np.round(np.concatenate([rest, last, middle], axis=1) / step)
    order = np.lexsort(cells.T)
    copy = copies_of(clip)[order]
    same = np.flatnonzero((cells[order[1:]] == cells[order[:-1]]).all(axis=1) & (copy[1:] == copy[:-1]))
    return np.stack([order[same], order[same + 1]], axis=1)


def components(links: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return labels of the parts that links join, (N,), numbered by their first vertices."""
    return numbered(connected_parts(links, vertex_count))


def numbered(label: np.ndarray) -> np.ndarray:
    """Return labels (N,) renumbered from 0 on, in the order of their first vertices."""
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]


def near_neighbours(points: np.ndarray, count: int) -> np.ndarray:
    """Return pairs of points and their nearest others, (L, 2)."""
    near = (
        scipy_module("spatial").cKDTree(points).query(points, k=min(count + 1, len(points)))[1].reshape(len(points), -1)
    )
    return np.stack([np.repeat(np.arange(len(points)), near.shape[1] - 1), near[:, 1:].reshape(-1)], axis=1)
