"""The positions of a mesh that hangs on a plant's chains."""

from __future__ import annotations

import numpy as np

from athcodec.binding.chains import Chains
from athcodec.binding.search import Binding

BLOCK_NUMBERS = 1 << 22  # Numbers of one array of float64 that are in memory at once, where a frame is smaller.
NUMBERS_OF_PLACE = 48  # Numbers that the frame of a place takes while it is computed.


class MovingPoints:
    """Points of a mesh that move with a plant.

    Parameters
    ----------
    chains : Chains
        The plant.
    binding : Binding
        What moves each point.
    place : (P, 3) array
        The points in the rest pose.
    of_vertex : (V,) array of integers
        The point of each vertex.
    offset : (V, 3) array
        How far each vertex is from its point, at most the grid on which vertices were taken for one point.
    """

    def __init__(self, chains: Chains, binding: Binding, place: np.ndarray, of_vertex: np.ndarray, offset: np.ndarray):
        """Prepare to move the points `place` (P, 3) of a mesh by a binding to chains. `of_vertex` (V,) is the point of
        each vertex, and `offset` (V, 3) the vertex's offset from that point.
        """
        self._chains, self._of_vertex, self._offset = chains, of_vertex, offset
        key = np.stack([binding.element.astype(np.float64), binding.share], axis=1)
        places, of_row = np.unique(key, axis=0, return_inverse=True)
        self._element, self._share = places[:, 0].astype(np.int64), places[:, 1]
        of_row = of_row.reshape(-1)
        off = place[binding.point] - chains.at_rest(binding.element, binding.share)
        # One table for the first row of every point, one for the second rows, and so on.
        order = np.argsort(binding.point, kind="stable")
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order)) - np.searchsorted(binding.point[order], binding.point[order])
        self._tables = []
        for number in range(int(rank.max(initial=-1)) + 1):
            rows = np.flatnonzero(rank == number)
            self._tables.append((binding.point[rows], of_row[rows], off[rows], binding.weight[rows]))
        self._count = len(place)

    def branch_of_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Return two arrays (P,): the branch, in file order, that moves each point most, and how far along the branch
        the point hangs, in elements.
        """
        branch, along = np.zeros(self._count, np.int64), np.zeros(self._count)
        largest = np.zeros(self._count)
        for point, place, _, weight in self._tables:
            more = weight > largest[point]
            some, of = point[more], place[more]
            branch[some], largest[some] = self._chains.element_branch[self._element[of]], weight[more]
            along[some] = self._element[of] + self._share[of]
        return branch, along

    @property
    def block_length(self) -> int:
        """Frames to move at once."""
        rows = NUMBERS_OF_PLACE * len(self._element) + 16 * self._count + 6 * len(self._of_vertex)
        return max(1, 4 * BLOCK_NUMBERS // (rows + 24 * self._chains.hierarchy.vertex_count))

    def move(self, frames: np.ndarray) -> np.ndarray:
        """Return the vertices (k, V, 3) float64 of the bound mesh in frames (k, N, 3) of the plant."""
        length = self.block_length
        return np.concatenate([self._moved(frames[start : start + length]) for start in range(0, len(frames), length)])

    def _moved(self, frames: np.ndarray) -> np.ndarray:
        """Return the vertices (k, V, 3) of the bound mesh in frames (k, N, 3) of the plant, few enough to fit into
        memory.
        """
        pose = self._chains.pose(frames)
        centre, matrix = self._chains.places(pose, self._element, self._share)
        points = np.zeros((len(frames), self._count, 3))
        for point, place, off, weight in self._tables:
            moved = centre[:, place] + np.einsum("kpij,pj->kpi", matrix[:, place], off)
            points[:, point] += weight[:, None] * moved
        return points[:, self._of_vertex] + self._offset
