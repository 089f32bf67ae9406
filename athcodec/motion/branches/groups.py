"""Sums, sizes and the cheapest of each group of rows, such as the vertices of a branch."""

from __future__ import annotations

import numpy as np


def sums_of_each(values: np.ndarray, label: np.ndarray, count: int = 0) -> np.ndarray:
    """Return the sums of the rows, (N, k), of each label; count: of the labels, if some have no rows."""
    return np.stack([np.bincount(label, column, count) for column in values.T], axis=1)


def moments_of_each(values: np.ndarray, others: np.ndarray, label: np.ndarray, count: int = 0) -> np.ndarray:
    """Return the sums over each label of the outer products of rows, (N, 3) each, (L, 3, 3)."""
    products = (values[:, :, None] * others[:, None]).reshape(-1, 9)
    return sums_of_each(products, label, count).reshape(-1, 3, 3)


def sizes_of_each(rest: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return the diagonals of the branches' bounding boxes."""
    order = np.argsort(label, kind="stable")
    first = np.searchsorted(label[order], np.arange(label.max() + 1))
    low, high = (function.reduceat(rest[order], first) for function in (np.minimum, np.maximum))
    diagonals: np.ndarray = np.linalg.norm(high - low, axis=1)
    return diagonals


def cheapest_of_each(key: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """Return the cheapest entry of each group of the same key, the first of several; groups in the order of their
    keys."""
    order = np.argsort(key, kind="stable")  # Sorting by costs, too, takes several times as long.
    key, cost = key[order], cost[order]
    first = np.flatnonzero(_begins(key))
    least = np.repeat(np.minimum.reduceat(cost, first), np.diff(np.append(first, len(key))))
    cheapest = np.flatnonzero(cost == least)
    return order[cheapest[_begins(key[cheapest])]]


def _begins(key: np.ndarray) -> np.ndarray:
    """Return whether each of some sorted keys differs from the one before it, (K,) bool."""
    return np.append(True, key[1:] != key[:-1])[: len(key)]
