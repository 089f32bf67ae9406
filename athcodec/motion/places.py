"""Places: vertices that coincide in every frame are one, so that motion is coded once for each place.

Meshes have several vertices at one place for flat shading, hard edges and seams of textures; simulators write a vertex
for each corner of each face, some of them with other roundings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class Places:
    """The place of each vertex. Places are numbered in the order of their first vertices.

    Parameters
    ----------
    of_vertex : (N,) int32 array
        The place of each vertex.
    error : float
        Largest distance, over all frames, of a vertex from the first one of its place; 0 if all are equal.
    """

    of_vertex: np.ndarray
    error: float = 0.0

    @classmethod
    def apart(cls, vertex_count: int) -> Places:
        """Return places of vertices none of which share one."""
        return cls(np.arange(vertex_count, dtype=np.int32))

    @classmethod
    def of_labels(cls, *labels: np.ndarray, error: float = 0.0) -> Places:
        """Return the places of vertices: vertices with equal rows in all of the arrays `labels`, which have a row for
        each vertex, share a place. `error` is the largest distance, over all frames, of a vertex from the first one of
        its place."""
        columns = [column for label in labels for column in np.reshape(label, (len(label), -1)).T]
        order = np.lexsort(columns[::-1])
        begins = np.zeros(len(order), bool)
        begins[:1] = True
        for column in columns:
            begins[1:] |= column[order[1:]] != column[order[:-1]]
        # The sort is stable, so each run begins with its first vertex.
        first = order[begins]
        number = np.empty(len(first), np.int32)
        number[np.argsort(first)] = np.arange(len(first))
        of_vertex = np.empty(len(order), np.int32)
        of_vertex[order] = number[np.cumsum(begins) - 1]
        return cls(of_vertex, error)

    @property
    def vertex_count(self) -> int:
        """Number of vertices, N."""
        return len(self.of_vertex)

    @property
    def count(self) -> int:
        """Number of places, P."""
        return len(self.first)

    @property
    def are_shared(self) -> bool:
        """Whether any two vertices share a place."""
        return self.count < self.vertex_count

    @cached_property
    def first(self) -> np.ndarray:
        """The first vertex of each place, (P,) int64, ascending."""
        return np.unique(self.of_vertex, return_index=True)[1]

    @cached_property
    def sizes(self) -> np.ndarray:
        """Number of vertices at each place, (P,) int32."""
        return np.bincount(self.of_vertex, minlength=self.count).astype(np.int32)
