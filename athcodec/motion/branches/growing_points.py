"""Centre lines among points of plants that grow, which nothing joins.

What is not there yet waits where it will grow, so points of one line that follow each other are never far apart.
"""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.steady import PRECISION, Distances, cheapest_tree, near_pairs

TOGETHER = 0.9  # Distinct places in some frame, over the most in any, below which a plant of points may grow.
NEXT = 0.7  # Factor of a link's cost where the source has its points one after the other.


def growing_links(frames: np.ndarray) -> list[np.ndarray]:
    """Return two ways to link points of plants that grow, (L, 2) each, without cycles: points that are never far apart,
    and those that are near each other in the most grown pose, since some programs have what is not there yet in its
    place from the start. Return none if nothing grows. `frames`: (F, N, 3) positions in a few frames.
    """
    count = frames.shape[1]
    places = np.array([_distinct_places(pose) for pose in frames])
    if count < 2 or places.min() > TOGETHER * places.max():
        return []
    following = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    grown = frames[places.argmax(), None]
    pairs = np.unique(np.concatenate([following, near_pairs(grown[0], np.arange(count))]), axis=0)
    in_order = np.where(pairs[:, 1] - pairs[:, 0] == 1, NEXT, 1.0)
    costs = (Distances(some).largest(pairs) * in_order for some in (frames, grown))
    least = np.finfo(float).tiny  # A cost of 0 would be no link.
    return [cheapest_tree(pairs, cost + cost.max() * 1e-12 + least, count) for cost in costs]


def _distinct_places(pose: np.ndarray) -> int:
    """Return about how many different places the points of a pose, (N, 3), are at."""
    low = pose.min(axis=0)
    cells = np.round((pose - low) / (PRECISION * float(np.linalg.norm(np.ptp(pose, axis=0))) + np.finfo(float).tiny))
    return len(np.unique(cells @ np.array([1.0, np.sqrt(2), np.sqrt(3)])))
