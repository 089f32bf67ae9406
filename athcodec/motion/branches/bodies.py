"""Bodies among points that nothing joins, in any order: blades, tubes, leaves, whole plants.

Points of one body that are near each other keep their distance however they move, and have neighbours of that kind in
common (Jarvis and Patrick 1973, "Clustering Using a Similarity Measure Based on Shared Near Neighbors"). Points of two
bodies may keep their distance by chance, as where both sway along each other, but their neighbours do not.
"""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.groups import cheapest_of_each
from athcodec.motion.branches.steady import PLIANT, STEADY, USUAL, Distances, connected_parts, near_pairs, scipy_module

SHARED = 0.5  # Part of a point's steady neighbours that are neighbours of another one, too, if both are of one body.
LEAST_SHARED = 2  # Such neighbours, at least.
CRUMB = 4  # Points below which a body joins the one from which its distance changes least.
CRUMB_ROUNDS = 6  # Rounds of joining crumbs.
ROWS_AT_ONCE = 1 << 14  # Pairs whose neighbours are compared at once, which bounds memory.


def body_links(frames: np.ndarray) -> np.ndarray:
    """Return pairs of points that are near each other on one body, (L, 2). `frames`: (F, N, 3) positions in a few
    frames.
    """
    frames = np.ldexp(frames, -np.frexp(np.abs(frames).max())[1])  # Squares of tiny or huge positions would be lost.
    count = frames.shape[1]
    pairs = near_pairs(frames[0], np.arange(count))
    change, length = Distances(frames).measured(pairs)
    steady = pairs[change < STEADY]
    links = steady[_share_neighbours(steady, count)]
    least = np.ones(count)
    for end in pairs.T:
        np.minimum.at(least, end, change)
    usual = float(np.quantile(least, USUAL))
    return _with_crumbs(links, pairs, length * np.hypot(change, PLIANT * usual), count)


def _share_neighbours(steady: np.ndarray, count: int) -> np.ndarray:
    """Return which steady pairs of `count` points, (P, 2), have many steady neighbours in common, (P,) bool."""
    graph = scipy_module("sparse").coo_matrix((np.ones(len(steady), np.int32), steady.T), (count, count)).tocsr()
    graph = graph + graph.T
    degree = np.diff(graph.indptr)[steady].min(axis=1)
    common = np.empty(len(steady), np.int64)
    for start in range(0, len(steady), ROWS_AT_ONCE):
        some = slice(start, start + ROWS_AT_ONCE)
        first, second = steady[some].T
        common[some] = np.asarray(graph[first].multiply(graph[second]).sum(axis=1)).ravel()
    is_shared: np.ndarray = common >= np.maximum(SHARED * degree, LEAST_SHARED)
    return is_shared


def _with_crumbs(links: np.ndarray, pairs: np.ndarray, cost: np.ndarray, count: int) -> np.ndarray:
    """Return the links with more links added, which join small bodies of `count` points to others, each by the pair
    (P, 2) of the least cost (P,)."""
    for _ in range(CRUMB_ROUNDS):
        body = connected_parts(links, count)
        is_crumb = np.bincount(body) < CRUMB
        first, second = body[pairs].T
        of_first, of_second = (np.flatnonzero((first != second) & is_crumb[one]) for one in (first, second))
        crumb = np.concatenate([first[of_first], second[of_second]])
        if not len(crumb):
            break
        pair = np.concatenate([of_first, of_second])
        links = np.concatenate([links, pairs[pair[cheapest_of_each(crumb, cost[pair])]]])
    return links
