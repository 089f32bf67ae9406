"""Baseline: trajectory-space PCA with prediction along the hierarchy, after CoDDyAC.

Vasa and Skala, "CoDDyAC: connectivity driven dynamic mesh compression", 3DTV-CON 2007: a
learned basis of trajectories; each vertex has few coefficients, predicted from those of its decoded
neighbours, and the integer differences are coded. Here the neighbours are those of the branch hierarchy, in
place of the parallelogram on a mesh: the vertex below, and its step from the one before that, in proportion
to the distances in the coded pose. Both are weighted per component, by least squares that account for
the quantisation noise (an addition, as are corrections and the dead zone). The basis is coded as in pca.py, not
by its own prediction (Vasa and Skala, "COBRA", 2009).
"""

from __future__ import annotations

import numpy as np

from bench.codecs import Source
from bench.codecs.baseline import Baseline, Choice, Ladder, Settings, quantised
from bench.codecs.coder import Reader, Writer
from bench.codecs.pca import (
    GRID,
    fitted_to,
    grid_of,
    read_basis,
    read_front,
    significant,
    source_basis,
    write_basis,
    write_front,
)
from bench.codecs.tree import VertexOrder

WEIGHT_STEPS = 32


class Coddyac(Baseline):
    name = "trajectory PCA + hierarchy (CoDDyAC)"

    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        return grid_of(
            "step keep basis joint dead_zone pose",
            keep=GRID["keep"].starting_at(0.2),
            basis=GRID["basis"].starting_at(0.4),
            pose=GRID["pose"].starting_at(0.25),
        )

    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        """Write the clip as a basis of trajectories and coefficients that are predicted from vertex to vertex along the
        branches. Return the order in which the decoder gets the vertices.
        """
        order, trajectories, pose, motion, step = write_front(writer, source, bound, settings)
        rows = trajectories.rows(motion)
        spectrum = source_basis(source, order, trajectories)
        basis = write_basis(writer, *significant(spectrum, rows, step, settings, trajectories, 1), trajectories)
        units = fitted_to(basis, rows).reshape(len(order.source), -1, len(basis)) / step
        step_ratio = _step_ratio(order, pose)
        weights = writer.table(_weights(units, order, step_ratio))
        q = np.zeros(units.shape, np.int64)

        def add(vertices: np.ndarray, predicted: np.ndarray) -> np.ndarray:
            q[vertices] = quantised(units[vertices] - predicted, settings["dead_zone"])
            return q[vertices]

        _predicted(order, step_ratio, weights, units.shape, add)
        writer.rows(trajectories.to_axes(q.reshape(-1, len(basis))))
        return order

    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        order, trajectories, pose, step = read_front(reader)
        basis = read_basis(reader, trajectories)
        weights = reader.table()
        q = trajectories.from_axes(reader.rows(), len(basis)).reshape(len(order.source), -1, len(basis))
        units = _predicted(order, _step_ratio(order, pose), weights, q.shape, lambda vertices, _: q[vertices])
        return trajectories.motion(units.reshape(-1, len(basis)) @ (basis * step)) + pose[:, :, None], order


def _step_ratio(order: VertexOrder, pose: np.ndarray) -> np.ndarray:
    """Return (N, 1, 1): distance of a vertex from the one before, over the distance of that from its own; 0: none."""
    before, before2 = order.before, order.before2
    length = np.linalg.norm(pose - pose[before], axis=1)
    last = np.linalg.norm(pose[before] - pose[before2], axis=1)
    ratio = np.divide(length, last, out=np.ones_like(length), where=last > 0)
    return np.where(before2 >= 0, np.minimum(ratio, 2), 0)[:, None, None]


def _weights(units: np.ndarray, order: VertexOrder, step_ratio: np.ndarray) -> np.ndarray:
    """Return integers (2, K), two for each of K components: the weight of the coefficient of the vertex before, and
    that of its step from the vertex before it, which together predict coefficients `units` best.
    """
    some = np.flatnonzero(order.before >= 0)
    target, near = units[some], units[order.before[some]]
    step = step_ratio[some] * (near - units[order.before2[some]])
    noise = np.minimum(1 / 12, (units**2).mean(axis=(0, 1)))
    along, r1, r2 = target.shape[0] * target.shape[1], step_ratio[some].mean(), (step_ratio[some] ** 2).mean()
    a = (near**2).sum(axis=(0, 1)) + noise * along
    b = (near * step).sum(axis=(0, 1)) + noise * along * r1
    c = (step**2).sum(axis=(0, 1)) + 2 * noise * along * r2
    p, s = (near * target).sum(axis=(0, 1)), (step * target).sum(axis=(0, 1))
    determinant = np.maximum(a * c - b * b, 1e-9 * a * c + 1e-30)
    weights = np.stack([(p * c - s * b) / determinant, (s * a - p * b) / determinant])
    return np.rint(WEIGHT_STEPS * np.clip(weights, -2, 2)).astype(np.int64)


def _predicted(
    order: VertexOrder, step_ratio: np.ndarray, weights: np.ndarray, shape: tuple[int, ...], residual
) -> np.ndarray:
    """Return coefficients (N, W, K), in quantisation steps, vertex by vertex: the prediction from the vertices before,
    plus what `residual(vertices, predicted)` returns for it.
    """
    units = np.zeros(shape)
    near, along = weights / WEIGHT_STEPS
    for vertices in order.generations:
        before, before2 = order.before[vertices], order.before2[vertices]
        base = units[before]
        predicted = near * base + (along * step_ratio[vertices]) * (base - units[before2])
        predicted[before < 0] = 0
        units[vertices] = predicted + residual(vertices, predicted)
    return units
