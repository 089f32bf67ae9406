"""Baseline: the affine transform hierarchy stored as its paper has it, with quantised numbers.

Song, Yang and Peng, "Hierarchical approximation of plant motion", Journal of Image and Graphics 16(8), 2011,
sections 2 to 4: an independent least-squares affine map per node and frame (eq. 2), residuals in the space of
the base pose (eq. 3) on the deepest nodes, and a pruned hierarchy (TAM). Every node has its maps, and so has
the stem of every inner node, which the paper leaves open; entries are integers over the range of their kind,
of 16 bits, or of 12 or 20 where that is smaller. The paper says nothing of coding: here maps and residuals
may be differences in time, residuals also along the stems, and how far TAM prunes is searched.
"""

from __future__ import annotations

import numpy as np

from athcodec.encoding.survey import Ath, survey
from athcodec.motion.affine_fit import stem_maps
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.thresholds import Thresholds
from bench.codecs import Source
from bench.codecs.baseline import Baseline, Choice, Ladder, Settings, Split, quantised
from bench.codecs.coder import Reader, Writer
from bench.codecs.lorenzo import read_lorenzo, write_lorenzo
from bench.codecs.tree import VertexOrder, memo, ordered, read_order, read_pose, vertex_order, write_order, write_pose

BITS = Split((12, 16, 20), 1)


class PaperAth(Baseline):
    title = "the paper's ATH"

    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        return {
            "bits": BITS,
            "tolerance": Choice((1, 2, 4, 8, 16, 32, 64, 128, 512, 4096, 1e6), 4),
            "maps_in_time": Choice((0, 1, 2), 1),
            "in_time": Choice((0, 1, 2), 1),
            "along": Choice((0, 1, 2)),
            "step": Ladder.geometric(0.8, 4, 1.4, 4),
            "dead_zone": Ladder((0.5, 0.55, 0.6, 0.65, 0.7), 1),
            "pose": Ladder.geometric(0.05, 2, 0.25),
        }

    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        order = vertex_order(source, "hierarchy")
        write_order(writer, order)
        positions = ordered(source, order)
        pose = write_pose(writer, order, source.rest[order.source].astype(np.float64), settings["pose"] * bound)
        ath, maps = memo(
            source, ("ath", settings["tolerance"] * bound), lambda: _maps(source, settings["tolerance"] * bound)
        )
        nodes = np.zeros(order.hierarchy.branch_count, np.int64)
        nodes[ath.node_branch] = 1
        writer.table(nodes[:, None])
        pieces = _Pieces(order.hierarchy, nodes, pose)
        linear, shift = maps[..., :3], maps[..., 3] + (maps[..., :3] @ pieces.centres[:, :, None])[..., 0]
        linear = _write_entries(writer, linear.reshape(len(maps), -1, 9), settings)
        shift = _write_entries(writer, shift, settings)
        residual = pieces.residual(positions, linear.reshape(len(maps), -1, 3, 3), shift) - pose[:, :, None]
        step = writer.single(settings["step"] * bound)
        write_lorenzo(
            writer, quantised(residual / step, settings["dead_zone"]), order, settings["in_time"], settings["along"]
        )
        return order

    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        order = read_order(reader)
        pose = read_pose(reader, order)
        pieces = _Pieces(order.hierarchy, reader.table()[:, 0], pose)
        linear, shift = _read_entries(reader, pieces.count, 9), _read_entries(reader, pieces.count, 3)
        step = reader.single()
        moved = pose[:, :, None] + read_lorenzo(reader, order) * step
        return pieces.place(moved, linear.reshape(len(linear), -1, 3, 3), shift), order


def _maps(source: Source, tolerance: float) -> tuple[Ath, np.ndarray]:
    """(T, pieces, 3, 4) maps of all nodes, then of the stems of inner nodes."""
    surveyed = memo(source, ("survey",), lambda: survey(source.clip, source.hierarchy))
    ath = surveyed.ath(Thresholds(tolerance, 0, tolerance, 0))
    frames = source.positions[:, source.hierarchy.vertex_source].astype(np.float64)
    rest = source.rest[source.hierarchy.vertex_source].astype(np.float64)
    stems = np.concatenate(
        [stem_maps(source.hierarchy, rest, frames[at : at + 20]) for at in range(0, len(frames), 20)]
    )
    inner = ath.node_branch[ath.is_inner]
    return ath, np.concatenate([ath.affines(source.positions), stems[:, inner]], axis=1)


class _Pieces:
    """Which map moves which vertex: that of its stem under an inner node, else that of the leaf it is in."""

    def __init__(self, hierarchy: Hierarchy, is_node: np.ndarray, pose: np.ndarray):
        node = np.cumsum(is_node) - 1
        branches = np.flatnonzero(is_node)
        owner = np.zeros(hierarchy.branch_count, np.int64)
        has_child = np.zeros(len(branches), bool)
        for branch, parent in enumerate(hierarchy.branch_parent.tolist()):
            owner[branch] = node[branch] if is_node[branch] else owner[parent]
            if is_node[branch] and parent >= 0:
                has_child[node[parent]] = True
        stem = len(branches) + np.cumsum(has_child) - 1
        self.count = len(branches) + int(has_child.sum())
        self.of_vertex = np.where(has_child, stem, np.arange(len(branches)))[owner][hierarchy.vertex_branch()]
        self.centres = np.array(
            [pose[slice(*hierarchy.subtree_range(b))].mean(axis=0) for b in branches.tolist()]
            + [self._stem(hierarchy, pose, b) for b in branches[has_child].tolist()]
        )

    @staticmethod
    def _stem(hierarchy: Hierarchy, pose: np.ndarray, branch: int) -> np.ndarray:
        first = hierarchy.first_vertex[branch]
        return pose[first : first + hierarchy.stem_count[branch]].mean(axis=0)

    def residual(self, positions: np.ndarray, linear: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """R (eq. 3) of (N, 3, T) positions under maps (T, pieces, ...)."""
        inverse = np.moveaxis(np.linalg.inv(linear), 0, 3)[self.of_vertex]
        return (
            self._apply(inverse, positions - np.moveaxis(shift, 0, 2)[self.of_vertex])
            + self.centres[self.of_vertex, :, None]
        )

    def place(self, residual: np.ndarray, linear: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """A R (eq. 4)."""
        around = residual - self.centres[self.of_vertex, :, None]
        return self._apply(np.moveaxis(linear, 0, 3)[self.of_vertex], around) + np.moveaxis(shift, 0, 2)[self.of_vertex]

    @staticmethod
    def _apply(linear: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(N, 3, 3, T) times (N, 3, T)."""
        return sum(linear[:, :, i] * points[:, None, i] for i in range(3))


def _write_entries(writer: Writer, entries: np.ndarray, settings: Settings) -> np.ndarray:
    """(T, pieces, k) as integers over their range; returns what a reader will decode."""
    low = writer.single(entries.min())
    step = writer.single(max(entries.max() - low, 1e-30) / (2 ** settings["bits"] - 2))
    q = np.rint((entries - low) / step).astype(np.int64)
    table = q.reshape(len(q), -1).T.copy()
    for degree in range(writer.count(settings["maps_in_time"])):
        table[:, degree + 1 :] = table[:, degree + 1 :] - table[:, degree:-1]
    writer.table(table)
    return q * step + low


def _read_entries(reader: Reader, pieces: int, width: int) -> np.ndarray:
    low, step, in_time = reader.single(), reader.single(), reader.count()
    table = reader.table()
    for degree in range(in_time - 1, -1, -1):
        table[:, degree:] = np.cumsum(table[:, degree:], axis=1)
    return table.T.reshape(-1, pieces, width) * step + low
