"""Runs among points that nothing joins: blades, needles, strands, the centre lines of plants.

Neighbours along a run keep their distance however they move against each other; points of different runs do not,
however close they stand. So links are sought that keep their length, the shortest of them first. Nothing but positions
is looked at: the order of the points does not matter.
"""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.steady import (
    PLIANT,
    STEADY,
    USUAL,
    Distances,
    cheapest_tree,
    connected_parts,
    near_pairs,
    scipy_module,
)

ROUNDS = 6  # Rounds of linking loose ends, among ever fewer points and so ever further away.
ALIKE = 30.0  # Times a usual change, up to which a link is steady.
UNSTEADY = 0.2  # A loose point is linked only if the link's length changes by less than this part.
UNLIKE = 4.0  # Its other links must change more than this many times as much.
OFF_LINE = 0.5  # Part of a link's length that a still point behind it may be off its line.
CROWD = 1.5  # Part of the length of a point's links within which other steady points are no neighbours on a run.
CROWDED = 0.25  # Such pairs for each point that make the points a sheet or a body.
DOUBTFULLY_CROWDED = 1.0  # The same where a trial decides: noise makes pairs of neighbouring runs as steady as links.
SCATTERED = 0.05  # Links for each point, among its nearest ones, below which points form no runs.
JOINED = 0.5  # Smallest share of the points that must be linked; with fewer, the points form no runs.


def run_links(frames: np.ndarray, crowded: float = CROWDED) -> np.ndarray | None:
    """Return the links between points that lie next to each other on a run, such as a blade or a strand, (L, 2) without
    cycles; None if the points form no runs. `frames`: (F, N, 3) positions in a few frames; `crowded`: pairs for each
    point, beside those that are linked, above which the points are no runs.
    """
    frames = np.ldexp(frames, -np.frexp(np.abs(frames).max())[1])  # Squares of tiny or huge positions would be lost.
    count, steady = frames.shape[1], _Steady(frames)
    links, loose = np.zeros((0, 2), np.int64), np.arange(count)
    for turn in range(ROUNDS):
        steady.add(near_pairs(frames[-turn % len(frames), loose], loose))
        links, before = steady.tree(), len(links)
        if turn == 0 and (steady.beside(links) > crowded * count or len(links) < SCATTERED * count):
            return None
        if len(links) == before:
            break
        loose = np.flatnonzero(_degrees(links, count) < 2)
    links = np.concatenate([links, steady.distinct(near_pairs(frames[0, loose], loose), links)])
    links = _with_still_points(frames, links, steady.precision)
    return links if np.count_nonzero(_degrees(links, count)) >= JOINED * count else None


def base_points(frames: np.ndarray, links: np.ndarray, root: int | None) -> np.ndarray:
    """Return the base of each connected set of points: the end of a run that moves least, or the first of those that
    move alike. `frames`: (F, N, 3) positions; `links`: (L, 2) pairs of points; `root`: a point that is the base of its
    set, or None.
    """
    count = frames.shape[1]
    way = np.sqrt(((frames - frames[0]) ** 2).sum(axis=(0, 2)))
    part, is_inner = connected_parts(links, count), _degrees(links, count) > 1
    least = np.full(part.max() + 1, np.inf)
    np.minimum.at(least, part[~is_inner], way[~is_inner])
    moves_more = way > 2 * least[part]
    order = np.lexsort((moves_more, is_inner, np.arange(count) != root, part))
    bases: np.ndarray = order[np.unique(part[order], return_index=True)[1]]
    return bases


class _Steady:
    """Pairs of points that keep their distance."""

    def __init__(self, frames: np.ndarray):
        """Begin without pairs, for points with the positions `frames`, (F, N, 3)."""
        self._start, self._count, self._distances = frames[0], frames.shape[1], Distances(frames)
        self.precision = self._distances.precision
        self._best = np.ones(self._count)  # Change of the steadiest pair of each point.
        self._pairs, self._change, self._length = np.zeros((0, 2), np.int64), np.zeros(0), np.zeros(0)

    def add(self, pairs: np.ndarray) -> None:
        """Keep those of the given pairs of points, (P, 2), that keep their distance over the frames, beside the pairs
        kept before.
        """
        change, length = self._distances.measured(pairs)
        for end in pairs.T:
            np.minimum.at(self._best, end, change)
        self._usual = float(np.quantile(self._best, USUAL))
        is_steady = change < min(ALIKE * self._usual, STEADY)
        pairs = np.concatenate([self._pairs, pairs[is_steady]])
        once = np.unique(pairs[:, 0] * self._count + pairs[:, 1], return_index=True)[1]
        self._pairs = pairs[once]
        self._change = np.concatenate([self._change, change[is_steady]])[once]
        self._length = np.concatenate([self._length, length[is_steady]])[once]

    def distinct(self, pairs: np.ndarray, links: np.ndarray) -> np.ndarray:
        """Return those of the given pairs, (L, 2), of which a point has no links yet, and whose distance is much
        steadier than that of any other pair with one of the two points. `links`: (L, 2) links that exist already.
        """
        degree, part = _degrees(links, self._count), connected_parts(links, self._count)
        pairs = pairs[part[pairs[:, 0]] != part[pairs[:, 1]]]
        change, _ = self._distances.measured(pairs)
        least = np.full((2, self._count), np.inf)
        for end in pairs.T:
            np.minimum.at(least[0], end, change)
        is_least = (change <= least[0][pairs].min(axis=1)) & (change < UNSTEADY)
        for end in pairs[~is_least].T:
            np.minimum.at(least[1], end, change[~is_least])
        is_distinct = is_least & (UNLIKE * change < least[1][pairs].min(axis=1))
        return pairs[is_distinct & (degree[pairs].min(axis=1) == 0)]

    def tree(self) -> np.ndarray:
        """Return those of the pairs, (L, 2), that join the same points at the least total cost."""
        cost = np.maximum(self._length, self.precision) * np.hypot(self._change, PLIANT * self._usual)
        return cheapest_tree(self._pairs, cost, self._count)

    def beside(self, links: np.ndarray) -> int:
        """Return how many of the pairs are no links, but about as short as the links at both points."""
        way = np.linalg.norm(self._start[links[:, 0]] - self._start[links[:, 1]], axis=1)
        longest = np.zeros(self._count)
        for end in links.T:
            np.maximum.at(longest, end, way)
        near = self._length <= CROWD * longest[self._pairs].min(axis=1)
        return int(near.sum()) - len(links)


def _with_still_points(frames: np.ndarray, links: np.ndarray, precision: float) -> np.ndarray:
    """Return the links with more links added: points that do not move, and have no link, are linked to the end of a run
    that does not move either, if they stand where the run would go on. `frames`: (F, N, 3); `links`: (L, 2);
    `precision`: the length below which a motion is rounding.
    """
    count = frames.shape[1]
    still = np.sqrt(((frames - frames[0]) ** 2).sum(axis=2)).max(axis=0) <= 4 * precision
    cKDTree = scipy_module("spatial").cKDTree
    for _ in range(ROUNDS):
        degree = _degrees(links, count)
        inner, end = np.concatenate([links, links[:, ::-1]]).T
        is_end = still[end] & (degree[end] == 1)
        inner, end = inner[is_end], end[is_end]
        lone = np.flatnonzero(still & (degree == 0))
        if not len(end) or not len(lone):
            break
        step = frames[0, end] - frames[0, inner]
        apart, nearest = cKDTree(frames[0, lone]).query(frames[0, end] + step)
        fits = np.flatnonzero(apart <= OFF_LINE * np.linalg.norm(step, axis=1))
        fits = fits[np.argsort(apart[fits], kind="stable")]
        used = fits[np.unique(nearest[fits], return_index=True)[1]]
        if not len(used):
            break
        links = np.concatenate([links, np.stack([end[used], lone[nearest[used]]], axis=1)])
    return links


def _degrees(links: np.ndarray, count: int) -> np.ndarray:
    """Return how many links each point has, (N,), of `count` points."""
    return np.bincount(links.reshape(-1), minlength=count)
