"""Vertex orders of the baselines, and prediction of integers from one vertex to the next.

Either the source's own order, where the vertex before is the neighbour, or the order of the hierarchy, where
it is the vertex below on the stem, and the attach point for the first of a stem. The hierarchy is coded as in
an .ath file.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from athcodec._native import BRANCH
from athcodec.encoding.model import quantise
from athcodec.motion.hierarchy import Hierarchy
from bench.codecs import Source
from bench.codecs.coder import Reader, Writer, core_branches

KEPT = 6  # cached values of each kind
ORDERS = ("source", "hierarchy")


@dataclass(eq=False)
class VertexOrder:
    """Vertices as they are coded.

    source     (N,) their numbers in the source
    hierarchy  None in the source's order
    before     (N,) the neighbour nearer to the root, -1: none
    before2    (N,) the one before that, where `before` is on the same stem, else -1
    """

    source: np.ndarray
    hierarchy: Hierarchy | None = None

    @cached_property
    def branches(self) -> np.ndarray:
        """As the core has them; without a hierarchy one of all vertices."""
        if self.hierarchy is not None:
            return core_branches(self.hierarchy)
        branches = np.zeros(1, BRANCH)
        branches["parent"], branches["attach"], branches["count"], branches["subtree"] = -1, -1, len(self.source), 1
        return branches

    @cached_property
    def before(self) -> np.ndarray:
        before = np.arange(len(self.source)) - 1
        if self.hierarchy is not None:
            before[self.hierarchy.first_vertex] = self.hierarchy.attach
        return before

    @cached_property
    def before2(self) -> np.ndarray:
        before2 = np.where(self.before >= 0, self.before[self.before], -1)
        if self.hierarchy is not None:
            before2[self.hierarchy.first_vertex] = -1
        return before2

    @cached_property
    def generations(self) -> list[np.ndarray]:
        """Vertices grouped by their number of ancestors: each follows those that it is predicted from."""
        ancestors = np.zeros(len(self.source), np.int64)
        for v, before in enumerate(self.before.tolist()):
            if before >= 0:
                ancestors[v] = ancestors[before] + 1
        by_age = np.argsort(ancestors, kind="stable")
        return np.split(by_age, np.cumsum(np.bincount(ancestors))[:-1])


def vertex_order(source: Source, name: str) -> VertexOrder:
    """Return the order of vertices by name: "hierarchy", or that of the source."""

    def make() -> VertexOrder:
        if name == "hierarchy":
            return VertexOrder(source.hierarchy.vertex_source, source.hierarchy)
        return VertexOrder(np.arange(source.positions.shape[1]))

    return memo(source, ("order", name), make)


def write_order(writer: Writer, order: VertexOrder) -> None:
    writer.count(int(order.hierarchy is not None))
    writer.hierarchy(order.hierarchy) if order.hierarchy is not None else writer.count(len(order.source))


def read_order(reader: Reader) -> VertexOrder:
    """Read the order of vertices that an encoding begins with."""
    if reader.count():
        hierarchy = reader.hierarchy()
        if "_vertex_order" not in hierarchy.__dict__:  # kept, since an encoder reads the same one in every trial
            hierarchy.__dict__["_vertex_order"] = VertexOrder(hierarchy.vertex_source, hierarchy)
        return hierarchy.__dict__["_vertex_order"]
    return VertexOrder(np.arange(reader.count()))


def memo(source: Source, key: tuple, make):
    """Return the value of `make`, cached with the source; of each kind, key[0], the KEPT last used ones."""
    kind = source.__dict__.setdefault("_known", {}).setdefault(key[0], {})
    kind[key] = kind.pop(key) if key in kind else make()
    if len(kind) > KEPT:
        del kind[next(iter(kind))]
    return kind[key]


def ordered(source: Source, order: VertexOrder) -> np.ndarray:
    """Return (N, 3, T) float64 positions."""

    def make() -> np.ndarray:
        return np.ascontiguousarray(source.positions[:, order.source].transpose(1, 2, 0), np.float64)

    return memo(source, ("positions", order.hierarchy is not None), make)


def differences(q: np.ndarray, order: VertexOrder, degree: int) -> np.ndarray:
    """Return residuals of integers (N, ...) predicted from the vertices before: constant (degree 1) or linear (2)."""
    if degree == 0:
        return q
    expected = np.where(_shaped(order.before >= 0, q), q[order.before], 0)
    if degree == 2:
        expected = expected + np.where(_shaped(order.before2 >= 0, q), q[order.before] - q[order.before2], 0)
    return q - expected


def sums(residual: np.ndarray, order: VertexOrder, degree: int) -> np.ndarray:
    """Return integers from their differences along the branches, the inverse of `differences`. `degree` is how often
    differences were taken, and `order` tells which vertex comes before each.
    """
    if degree == 0:
        return residual
    if order.hierarchy is None:
        steps = residual.copy()
        if degree == 2:
            steps[1:] = np.cumsum(residual[1:], axis=0)
        return np.cumsum(steps, axis=0)
    q = residual.copy()
    for vertices in order.generations[1:] if (order.before[order.generations[0]] < 0).all() else order.generations:
        before, before2 = order.before[vertices], order.before2[vertices]
        q[vertices] += q[before]
        if degree == 2:
            q[vertices] += np.where(_shaped(before2 >= 0, q), q[before] - q[before2], 0)
    return q


def _shaped(mask: np.ndarray, like: np.ndarray) -> np.ndarray:
    return mask.reshape(-1, *(1,) * (like.ndim - 1))


def write_pose(writer: Writer, order: VertexOrder, pose: np.ndarray, step: float) -> np.ndarray:
    """Return a static pose, (N, 3), at a step, as a rest pose of a file; returns what a reader will get."""
    step = writer.single(step)
    return writer.pose(order.branches, _lags(order, pose, step), step, pose)


def read_pose(reader: Reader, order: VertexOrder) -> np.ndarray:
    """Read a pose (N, 3) in the order of its vertices, after its step."""
    return reader.pose(order.branches, reader.single())


def _lags(order: VertexOrder, pose: np.ndarray, step: float) -> list[np.ndarray]:
    """Return the lags of all branches: those of beams, or the best one for the first branch of so many vertices."""
    counts = order.branches["count"]
    sizes, examples, kinds = np.unique(counts, return_index=True, return_inverse=True)
    stems = (pose[order.branches["first"][b] :][:size] for size, b in zip(sizes, examples))
    return [np.zeros_like(counts), np.array([quantise.rest_lags(stem[None], None, step)[0] for stem in stems])[kinds]]
