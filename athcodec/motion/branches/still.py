"""What stands still beside what moves: terrain, pots, trellis. It has branches of its own, on which nothing hangs."""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.seen import components, links_of, near_neighbours
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.clip import MotionClip, stands_still

NEIGHBOURS = 8  # Nearest points of each vertex without links, among which it stands.
LEAST_STILL = 64  # Vertices below which what stands still stays with what moves.
FEET_SHARE = 0.25  # Moving points that are next to points that stand still, over these, from which on they are feet.
INSIDE_SHARE = 0.2  # Smallest share of a connected part that stands still apart from the rest of it.


def still_parts(clip: MotionClip, most: float) -> np.ndarray | None:
    """Return which vertices are of parts that stand still, (N,) bool.

    Parameters
    ----------
    clip : MotionClip
    most : float
        The largest distance, in scene units, of what stands still from its place in the rest pose.

    Returns
    -------
    (N,) bool array or None
        Whole connected parts, or the inside of what stands still in a part of which much stands and much moves, but no
        points without links that are the feet of plants. None if that is too little, or nothing moves.
    """
    if stands_still(clip):
        return None
    still = _still_vertices(clip, most)
    if np.count_nonzero(still) < LEAST_STILL or still.all():
        return None
    links, is_linked = _links(clip)
    label = components(links, clip.vertex_count)
    size, standing = np.bincount(label), np.bincount(label, still)
    inside = _inside(still, links)
    apart = (standing == size) | (np.bincount(label, inside) >= INSIDE_SHARE * size)
    chosen: np.ndarray = np.where((standing == size)[label], True, inside) & apart[label]
    points = np.flatnonzero(chosen & ~is_linked)
    chosen[points[_are_feet(np.asarray(clip.rest), points, ~still, label[points])]] = False
    return chosen if LEAST_STILL <= np.count_nonzero(chosen) < clip.vertex_count else None


def _are_feet(rest: np.ndarray, points: np.ndarray, moves: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return for each of `points`, (K,) vertices that stand still and have no links, whether it is in a group of feet
    of plants, and not of the ground, (K,) bool. Next to many of the feet in a group there is a moving vertex: right
    above it and nearest to no other point, or beside it in the order of the source. `rest`: (N, 3) positions; `moves`:
    (N,) bool; `label`: the group of each point, (K,).
    """
    if not len(points):
        return np.zeros(0, bool)
    count = np.bincount(label)
    nearest = scipy_module("spatial").cKDTree(rest[moves]).query(rest[points])[1]
    above = np.bincount(np.unique(np.stack([label, nearest]), axis=1)[0], minlength=len(count))
    around = np.pad(moves, 1)
    beside = np.bincount(label, around[points] | around[points + 2])
    return (np.maximum(above, beside) >= FEET_SHARE * count)[label]


def _still_vertices(clip: MotionClip, most: float) -> np.ndarray:
    """Return which vertices stay within `most` scene units of their place in the rest pose, (N,) bool. Frames are read
    only until too few such vertices are left to matter.
    """
    rest = clip.source_rest
    still = np.ones(clip.vertex_count, bool)
    for _, block in clip.blocks():
        some = np.flatnonzero(still)
        away = block[:, some] != rest[some]
        moved = away.any(axis=(0, 2))
        if most > 0 and moved.any():
            apart = block[:, some[moved]].astype(np.float64) - rest[some[moved]]
            moved[moved] = np.square(apart).sum(axis=2).max(axis=0) > most**2
        still[some[moved]] = False
        if np.count_nonzero(still) < LEAST_STILL:
            break
    return still


def _links(clip: MotionClip) -> tuple[np.ndarray, np.ndarray]:
    """Return two things: pairs of vertices that belong together, (L, 2), which edges or sides of faces join, or
    nearness where a vertex has neither; and which vertices have edges or faces, (N,) bool.
    """
    links = links_of(clip)
    bare = np.ones(clip.vertex_count, bool)
    bare[links] = False
    points = np.flatnonzero(bare)
    if len(points) > 1:
        links = np.concatenate([links, points[near_neighbours(np.asarray(clip.rest)[points], NEIGHBOURS)]])
    return links, ~bare


def _inside(still: np.ndarray, links: np.ndarray) -> np.ndarray:
    """Return which vertices are inside of what stands still, (N,) bool: they stand still, and they or a neighbour have
    none but neighbours that stand still. `still`: (N,) bool; `links`: (L, 2) pairs of neighbours.
    """
    core = still.copy()
    for here, there in (links.T, links.T[::-1]):
        core[here[~still[there]]] = False
    inside = core.copy()
    for here, there in (links.T, links.T[::-1]):
        inside[here[core[there]]] = True
    return inside & still
