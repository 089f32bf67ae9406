"""Kinds of plants in a scene, which may need other settings than each other, and time bases of their own."""

from __future__ import annotations

import numpy as np

LEAST_KIND = 0.01  # Least share of all vertices in plants of one kind; smaller kinds count as one together.


def plant_kinds(branch_parent: np.ndarray, stem_count: np.ndarray) -> np.ndarray:
    """Return the number of the kind of plant that each branch belongs to, (B,), those of most vertices first.

    Two plants are of one kind if they have about as many vertices, and both or neither of them consists of a single
    branch. `branch_parent`: (B,) the parent of each branch in file order, -1 for a root; `stem_count`: (B,) the
    vertices of each.
    """
    plant = np.cumsum(np.asarray(branch_parent) < 0) - 1
    vertices, branches = np.bincount(plant, stem_count), np.bincount(plant)
    size = 2 * np.rint(2 * np.log2(vertices)) + (branches == 1)
    kind = np.unique(size, return_inverse=True)[1]
    of_kind = np.bincount(kind, vertices)
    of_kind[of_kind < LEAST_KIND * vertices.sum()] = 0
    order = np.argsort(-of_kind, kind="stable")
    number = np.empty(len(order), np.int64)
    number[order] = np.minimum(np.arange(len(order)), np.count_nonzero(of_kind))
    return number[kind][plant]
