"""Baseline: positions on a grid, differences in time and from vertex to vertex, and an entropy coder.

The Lorenzo predictor of Ibarria and Rossignac ("Dynapack", SCA 2003) in all degrees: differences
of degree 0 to 3 in time of differences of degree 0 to 2 along the order of vertices. The grid is searched
together with corrections.
"""

from __future__ import annotations

import numpy as np

from bench.codecs import Source
from bench.codecs.baseline import Baseline, Choice, Ladder, Settings
from bench.codecs.coder import Reader, Writer
from bench.codecs.tree import ORDERS, VertexOrder, differences, ordered, read_order, sums, vertex_order, write_order


def write_lorenzo(writer: Writer, q: np.ndarray, order: VertexOrder, in_time: int, along: int) -> None:
    """Integers (N, 3, T); the first frame separately, since it is a pose."""
    residual = differences(q, order, along)
    if in_time == 0:
        writer.count(0)
    else:
        writer.count(in_time)
        writer.table(differences(q[:, :, 0], order, 2))
        for degree in range(in_time):
            residual[:, :, degree + 1 :] = residual[:, :, degree + 1 :] - residual[:, :, degree:-1]
        residual = residual[:, :, 1:]
    writer.count(along)
    writer.rows(residual)


def read_lorenzo(reader: Reader, order: VertexOrder) -> np.ndarray:
    in_time = reader.count()
    first = sums(reader.table(), order, 2) if in_time else None
    along = reader.count()
    residual = reader.rows()
    if in_time:
        residual = np.concatenate([differences(first, order, along)[:, :, None], residual], axis=2)
        for degree in range(in_time - 1, -1, -1):
            residual[:, :, degree:] = np.cumsum(residual[:, :, degree:], axis=2)
    return sums(residual, order, along)


class Lorenzo(Baseline):
    title = "quantise + differences (Lorenzo)"

    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        return {
            "in_time": Choice((1, 2, 3, 0), 1),
            "along": Choice((0, 1, 2), 1),
            "step": Ladder.geometric(0.8, 4, 1.4, 8),
            "order": Choice(ORDERS, 1),
        }

    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        order = vertex_order(source, settings["order"])
        write_order(writer, order)
        step = writer.single(settings["step"] * bound)
        q = np.rint(ordered(source, order) / step).astype(np.int64)
        write_lorenzo(writer, q, order, settings["in_time"], settings["along"])
        return order

    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        order = read_order(reader)
        step = reader.single()
        return read_lorenzo(reader, order) * step, order
