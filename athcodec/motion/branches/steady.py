"""Pairs of points that keep their distance from each other, however they move against each other."""

from __future__ import annotations

import importlib

import numpy as np

from athcodec.errors import MissingExtra
from athcodec.untyped import ScipyObject

NEAR = (16, 96)  # Nearest points of each one, at least and at most, among which neighbours are sought.
PAIRS = 1 << 19  # Pairs in all, if that is more than the least.
PRECISION = 1e-7  # Part of the diagonal, and of the distance from the origin, below which a point stands still.
STEADY = 0.05  # Largest change of a steady pair's distance over the points' motion against each other.
USUAL = 0.25  # Quantile of the changes in distance of all points' steadiest pairs that is a usual one.
PLIANT = 3.0  # Times a usual change, below which the shorter of two pairs is the better.
PAIRS_AT_ONCE = 1 << 13  # Pairs of points whose distances are computed at once, which bounds memory.


class Distances:
    """How much the distances of points change over some frames. precision: the length below which a motion is
    rounding."""

    def __init__(self, frames: np.ndarray):
        """Look at points with the positions `frames`, (F, N, 3)."""
        self._tracks = (frames - frames[0].mean(axis=0)).transpose(1, 0, 2).astype(np.float32)
        low, high = frames.min(axis=(0, 1)), frames.max(axis=(0, 1))
        away = float(np.maximum(np.abs(low), np.abs(high)).max())
        self.precision = PRECISION * max(float(np.linalg.norm(high - low)), away) + 1e-300

    def measured(self, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return two things for each pair of points, (P,): how much their distance changes over the frames, as a share
        of the motion of one point relative to the other; and their mean distance.
        """
        change, length = np.empty(len(pairs)), np.empty(len(pairs))
        for start in range(0, len(pairs), PAIRS_AT_ONCE):
            some = slice(start, start + PAIRS_AT_ONCE)
            way = self._tracks[pairs[some, 0]] - self._tracks[pairs[some, 1]]
            apart = np.sqrt(np.einsum("ptk,ptk->pt", way, way))
            way -= way.mean(axis=1, keepdims=True)
            moved = np.sqrt(np.einsum("ptk,ptk->p", way, way) / way.shape[1])
            change[some] = (apart.std(axis=1) + self.precision) / (moved + self.precision)
            length[some] = apart.mean(axis=1)
        return change, length

    def largest(self, pairs: np.ndarray) -> np.ndarray:
        """Return the largest distance of each pair of points in any frame, (P,)."""
        largest = np.empty(len(pairs))
        for start in range(0, len(pairs), PAIRS_AT_ONCE):
            some = slice(start, start + PAIRS_AT_ONCE)
            way = self._tracks[pairs[some, 0]] - self._tracks[pairs[some, 1]]
            largest[some] = np.sqrt(np.einsum("ptk,ptk->pt", way, way).max(axis=1))
        return largest


def near_pairs(points: np.ndarray, names: np.ndarray) -> np.ndarray:
    """Return pairs of points that are near each other, (P, 2), each once, the smaller name first. `points`: (K, 3)
    positions; `names`: (K,) the numbers by which the pairs name them.
    """
    if len(names) < 2:
        return np.zeros((0, 2), np.int64)
    count = min(len(names), 1 + int(np.clip(PAIRS // len(names), *NEAR)))
    near = names[scipy_module("spatial").cKDTree(points).query(points, k=count)[1].reshape(-1)]
    pairs = np.sort(np.stack([np.repeat(names, count), near], axis=1), axis=1)
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    size = int(names.max()) + 1
    keys = np.sort(pairs[:, 0] * size + pairs[:, 1])
    keys = keys[np.append(True, keys[1:] != keys[:-1])]
    return np.stack([keys // size, keys % size], axis=1)


def connected_parts(links: np.ndarray, count: int) -> np.ndarray:
    """Return a label (N,) for each point: the connected part that links make."""
    graph = scipy_module("sparse").coo_matrix((np.ones(len(links), np.int8), links.T), (count, count))
    labels: np.ndarray = scipy_module("sparse.csgraph").connected_components(graph, directed=False)[1]
    return labels


def cheapest_tree(pairs: np.ndarray, cost: np.ndarray, count: int) -> np.ndarray:
    """Return those of some pairs of points, (L, 2), that join the same points as all of them at the least total cost.
    `pairs`: (P, 2); `cost`: (P,), above 0; `count`: of all points."""
    graph = scipy_module("sparse").coo_matrix((cost, pairs.T), (count, count)).tocsr()
    tree = scipy_module("sparse.csgraph").minimum_spanning_tree(graph).tocoo()
    return np.stack([tree.row, tree.col], axis=1).astype(np.int64)


def scipy_module(name: str) -> ScipyObject:
    """Return a module of scipy. Raises MissingExtra without it."""
    try:
        return importlib.import_module(f"scipy.{name}")
    except ImportError:
        raise MissingExtra(
            'branches, and places of a mesh on a plant: needs scipy: pip install "athcodec[hierarchy]"'
        ) from None
