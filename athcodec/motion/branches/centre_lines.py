"""Branches of centre lines, as motion shows them: where they are rooted, and which of their parts grow by themselves.

Lines are rooted where they stand still, since roots grow downwards and vines hang. A stem that goes straight on into
another one, as where a bud at its tip grows out later, ends there: its links grow at another time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from athcodec.motion.branches.common_motion import LEAST_STEADY, RIGID
from athcodec.motion.branches.groups import cheapest_of_each
from athcodec.motion.branches.grown_pose import SMALL_LINK, poses_of, shown_frames
from athcodec.motion.branches.seen import Seen
from athcodec.motion.clip import MotionClip, check_indices
from athcodec.motion.hierarchy import branches_from_edges, parts_of_edges, roots_of_parts

SWAYS = 0.01  # Of the diagonal: how much more than what moves least a base may move.
HALF_GROWN = 0.5  # Length of a link, over its largest, at which it grows.
USUAL_STEPS = 6.0  # Times the usual time between a stem's links, up to which the next one is of the same growth.
LEAST_STEPS = 3.0  # Frames of those looked at, between a stem's links, up to which they are.


def line_branches(
    seen: Seen, links: np.ndarray, root: int | Sequence[int] | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the branches that centre lines form, as branches_from_edges returns them. `links`: pairs of points,
    (L, 2); `root`: points that are the bases of their parts, or None. Raises ClipError if the links close a cycle, or
    if `root` is not usable.
    """
    clip, frames = seen.clip, seen.frames[1:]  # The rest pose may have links of other lengths.
    links = np.asarray(check_indices("edges", links, clip.vertex_count, width=2), np.int64)
    roots = _roots(seen, frames, links, root)
    size = np.linalg.norm(frames[:, links[:, 0]] - frames[:, links[:, 1]], axis=2)
    grows = (size.min(axis=0) < SMALL_LINK * size.max(axis=0)).any()

    def begins(parent: np.ndarray, head: np.ndarray, place: np.ndarray) -> np.ndarray:
        return _grows_by_itself(_births(clip, parent), parent, head, place)

    return branches_from_edges(links, clip.vertex_count, clip.rest, roots.tolist(), begins=begins if grows else None)


def _roots(seen: Seen, frames: np.ndarray, links: np.ndarray, root: int | Sequence[int] | None) -> np.ndarray:
    """Return the root of each connected part: the vertex of `root` in it, else the lowest one in the rest pose, unless
    it sways and another one stands still. `frames`: (F, N, 3) positions in a few frames; `links`: (L, 2).
    """
    clip = seen.clip
    part = parts_of_edges(links, clip.vertex_count)
    lowest = roots_of_parts(part, clip.rest, root, clip.metadata.get("up_axis", "y"))
    way = np.sqrt(((frames - frames[0]) ** 2).sum(axis=2).mean(axis=0))
    diagonal = np.linalg.norm(np.ptp(frames.reshape(-1, 3), axis=0))
    if seen.is_carried and np.count_nonzero(way <= RIGID * diagonal) < LEAST_STEADY:
        return lowest  # What moves least beside a common motion that nothing tells exactly may be in the crown.
    stillest = cheapest_of_each(part, way)
    sways = way[lowest] > way[stillest] + SWAYS * diagonal
    is_named = np.isin(lowest, [] if root is None else root)
    return np.where(sways & ~is_named, stillest, lowest)


def _births(clip: MotionClip, parent: np.ndarray) -> np.ndarray:
    """Return for each vertex when the link to the vertex below, `parent` (N,), has half its length for the first time,
    (N,), in frames of those that are looked at; 0 for what is so long from the start, and for roots.
    """
    below = np.where(parent < 0, np.arange(len(parent)), parent)
    sizes = np.stack(
        [np.linalg.norm(pose - pose[below], axis=1).astype(np.float32) for pose in poses_of(clip, shown_frames(clip))]
    )
    sizes /= np.maximum(sizes.max(axis=0), np.finfo(np.float32).tiny)
    after = (sizes >= HALF_GROWN).argmax(axis=0)
    vertices = np.arange(len(parent))
    low, high = sizes[np.maximum(after - 1, 0), vertices], sizes[after, vertices]
    births: np.ndarray = after - np.where(after > 0, (high - HALF_GROWN) / np.where(high > low, high - low, 1.0), 0.0)
    return births


def _grows_by_itself(births: np.ndarray, parent: np.ndarray, head: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return whether each vertex grows at another time than the vertex below it on its stem, (N,) bool, and so begins a
    branch. `births`, `parent`, `head`, `place`: when it grows, the vertex below, the first vertex of the stem, and the
    place on it, (N,) each.
    """
    begins = np.zeros(len(parent), bool)
    later = np.flatnonzero(place >= 2)  # The link below a stem's first vertex is not of the stem.
    if not len(later):
        return begins
    step = np.abs(births[later] - births[parent[later]])
    stem = np.unique(head[later], return_inverse=True)[1]
    size, order = np.bincount(stem), np.lexsort((step, stem))
    usual = step[order[np.cumsum(size) - size + (size - 1) // 2]]
    begins[later] = step > np.maximum(USUAL_STEPS * usual, LEAST_STEPS)[stem]
    for vertex in np.flatnonzero(begins)[np.argsort(place[begins], kind="stable")].tolist():
        begins[vertex] &= not begins[parent[vertex]]  # The link below is no longer of this stem.
    return begins
