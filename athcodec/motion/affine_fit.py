"""Least-squares affine maps of subtrees and stems from the rest pose to each frame (Song, Yang and Peng 2011, eq. 2).

Where the paper's least squares have no unique answer (straight, flat or flattened subtrees) the map is completed, so
that it stays invertible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec._native import address, lib
from athcodec.motion.algebra import determinant, multiply, principal
from athcodec.motion.hierarchy import Hierarchy

RANK_TOLERANCE = 1e-3
"""A subtree's principal extent counts as missing below this part of its largest one: its best-fit stretch
along such a direction would be the noise of the rest pose."""
_SMALLEST_EXTENT = 1e-100  # Squares of smaller numbers have no inverse.
_POINT_EXTENT = 1e-12  # Part of the plant's size below which a subtree is one point.


@dataclass(frozen=True)
class Differences:
    """Return GAD (k,C) and LAD (C,) of C pieces in some frames: the largest distance, and the most vertices beyond
    xi."""

    gads: np.ndarray
    largest_distance: np.ndarray
    most_beyond_xi: np.ndarray

    @classmethod
    def of(cls, frames: np.ndarray, pieces: Pieces, xi: float | None) -> Differences:
        """Return both measures of frames (3,k,N), seen from the origin of the pieces."""
        shape = frames.shape[1], len(pieces.first)
        measured = cls(np.empty(shape), np.zeros(shape[1]), np.zeros(shape[1], np.int32))
        Fit(pieces, frames, measured, np.inf if xi is None else xi)
        return measured

    def __or__(self, other: Differences) -> Differences:
        """Return the LAD of the pieces with their GADs."""
        return Differences(
            other.gads,
            np.maximum(self.largest_distance, other.largest_distance),
            np.maximum(self.most_beyond_xi, other.most_beyond_xi),
        )


def stem_maps(hierarchy: Hierarchy, rest: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return least-squares maps (eq. 2) of every branch's stem, (k,B,3,4) float64, from rest to positions of each
    frame.

    rest is (N,3) and frames (k,N,3), both in file order; B branches in file order.
    """
    every = np.arange(hierarchy.branch_count)
    pieces = Pieces(
        hierarchy, np.asarray(rest, float), every, every + 1, hierarchy.branch_parent, hierarchy.branch_depth
    )
    return pieces.fit(seen_from(pieces.origin, np.moveaxis(np.asarray(frames), 2, 0))).matrices()


class Pieces:
    """Sets of vertices that each get one affine map per frame, with what their fits need of the rest pose.

    A piece is a range of branches: a subtree, or a single stem. `parent` is the piece that a straight one
    inherits its free rotation from (-1: none), `generation` a number greater than the parent's.
    """

    def __init__(
        self,
        hierarchy: Hierarchy,
        rest: np.ndarray,
        first_branch: np.ndarray,
        stop_branch: np.ndarray,
        parent: np.ndarray,
        generation: np.ndarray,
    ) -> None:
        """Describe pieces of a plant in the rest pose (N, 3). Piece i has branches first_branch[i] to stop_branch[i] -
        1; `parent` (C,) is the piece that it hangs on, -1 for none; `generation` (C,) groups pieces that do not
        overlap."""
        bounds = np.append(hierarchy.first_vertex, hierarchy.vertex_count).astype(np.intp)
        self.first_branch, self.stop_branch, self.parent = first_branch, stop_branch, parent
        self.first, self.stop = bounds[first_branch], bounds[stop_branch]
        self.counts = self.stop - self.first
        self.stems, self.order = bounds.astype(np.int64), np.argsort(generation, kind="stable")
        self.origin = rest.mean(axis=0)
        self.rest = np.ascontiguousarray((rest - self.origin).T)
        self._describe_rest_pose([np.flatnonzero(generation == value) for value in np.unique(generation)])
        inherits, lends = (self.rank < 2) & (parent >= 0), np.zeros(len(first_branch), bool)
        lends[parent[inherits]] = True
        self.links = np.stack([first_branch, stop_branch, parent, self.rank, lends], axis=1).astype(np.int64)
        self.shapes = np.concatenate(
            [self.centroid, *(matrices.reshape(-1, 9) for matrices in (self.axes, self.pseudo_inverse))], axis=1
        )

    @classmethod
    def subtrees(
        cls, hierarchy: Hierarchy, rest: np.ndarray, branches: np.ndarray, parent: np.ndarray, generation: np.ndarray
    ) -> Pieces:
        stop_branch = branches + hierarchy.subtree_branches[branches]
        return cls(hierarchy, rest, branches, stop_branch, parent, generation)

    def vertices(self, some: np.ndarray) -> np.ndarray:
        """Return the vertices of some pieces, one piece after the other."""
        counts = self.counts[some]
        return np.arange(counts.sum()) + np.repeat(self.first[some] - starts(counts), counts)

    def fit(self, frames: np.ndarray) -> Fit:
        """Return the maps of all pieces in frames (3,k,N)."""
        return Fit(self, frames)

    def _describe_rest_pose(self, generations: list[np.ndarray]) -> None:
        """Compute the centroid, the principal axes (as columns, longest first), the rank and the pseudo-inverse of each
        piece's rest pose. `generations` are groups of pieces that do not overlap."""
        count = len(self.first)
        self.centroid = np.empty((count, 3))
        covariance = np.empty((count, 3, 3))
        for some in generations:  # Pieces of one generation do not overlap.
            vertices, counts = self.vertices(some), self.counts[some]
            points = self.rest[:, vertices]
            centroid = np.add.reduceat(points, starts(counts), axis=1) / counts
            points -= np.repeat(centroid, counts, axis=1)
            products = np.add.reduceat(points[:, None] * points, starts(counts), axis=2)
            covariance[some] = (products / counts).transpose(2, 0, 1)
            self.centroid[some] = centroid.T
        variance, axes = principal(covariance)
        self.axes = np.ascontiguousarray(np.swapaxes(axes, 1, 2))
        # Right-handed axes, so that completing a flat piece never mirrors it.
        self.axes[:, :, 2] *= np.sign(determinant(self.axes))[:, None]
        extent = np.sqrt(np.maximum(variance, 0.0))
        smallest = max(_POINT_EXTENT * np.ptp(self.rest, axis=1).max(), _SMALLEST_EXTENT)
        present = (extent > RANK_TOLERANCE * extent[:, :1]) & (extent[:, :1] > smallest)
        self.rank = present.sum(axis=1)
        inverse_variance = np.divide(1.0, variance, out=np.zeros_like(variance), where=present)
        self.pseudo_inverse = multiply(self.axes * inverse_variance[:, None], np.swapaxes(self.axes, 1, 2))


class Fit:
    """The affine maps x -> linear (x - rest centroid) + centroid of all pieces in k frames.

    linear and inverse are (k,n,3,3), centroid (k,n,3), all seen from the origin of the pieces. measured: filled with
    how far the residuals are from their base places; None: nobody asks.
    """

    def __init__(
        self, pieces: Pieces, frames: np.ndarray, measured: Differences | None = None, xi: float = np.inf
    ) -> None:
        """Fit the affine map of every piece in `frames` (3, k, N), with the axes x, y, z first. If `measured` is
        passed, it gets the distances that the fit leaves, and the number of vertices further off than `xi`, in scene
        units."""
        self.pieces, self.frames = pieces, np.ascontiguousarray(frames, np.float64)
        (_, count, vertices), stems, n = frames.shape, len(pieces.stems) - 1, len(pieces.first)
        self.linear, self.inverse = np.empty((2, count, n, 3, 3))
        self.centroid, work = np.empty((count, n, 3)), np.empty(12 * (stems + 1) + 9 * n)
        lib.ath_fit(
            vertices,
            count,
            stems,
            address(pieces.stems, np.int64, stems + 1),
            n,
            address(pieces.order, np.int64, n),
            address(pieces.links, np.int64, 5 * n),
            address(pieces.shapes, np.float64, 21 * n),
            address(pieces.rest, np.float64, 3 * vertices),
            address(self.frames, np.float64, 0),
            xi,
            *(address(array, np.float64, 0) for array in (work, self.linear, self.inverse, self.centroid)),
            *((None,) * 3 if measured is None else (array.ctypes.data for array in vars(measured).values())),
        )

    def matrices(self) -> np.ndarray:
        """Return maps (k,n,3,4) from rest positions to positions of each frame, in the scene's coordinates."""
        pieces = self.pieces
        base = (pieces.centroid + pieces.origin)[..., None]
        offset = self.centroid + pieces.origin - multiply(self.linear, base)[..., 0]
        return np.concatenate([self.linear, offset[..., None]], axis=3)

    def inverse_maps(self) -> tuple[np.ndarray, np.ndarray]:
        """Return (k,n,3,3) and (k,n,3): x goes to its residual as inverse x + offset, both seen from the origin."""
        offset = self.pieces.centroid - multiply(self.inverse, self.centroid[..., None])[..., 0]
        return self.inverse, offset

    def apply(self, some: np.ndarray, vertices: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """Return where some pieces' maps put vertices, (3,k,sum of counts), with counts[i] of them by piece some[i]."""
        linear = self.linear[:, some]
        offset = self.centroid[:, some] - multiply(linear, self.pieces.centroid[some][..., None])[..., 0]
        return map_points(linear, offset, self.pieces.rest[:, None, vertices], counts)


def starts(counts: np.ndarray) -> np.ndarray:
    return np.cumsum(counts) - counts


def map_points(linear: np.ndarray, offset: np.ndarray, points: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return linear x + offset, of (k,n,3,3) and (k,n,3); map i serves the next counts[i] points of (3,k or 1,V)."""
    result = np.empty((3, len(linear), points.shape[2]))
    for i in range(3):
        result[i] = np.repeat(offset[..., i], counts, axis=1)
        for j in range(3):
            result[i] += np.repeat(linear[..., i, j], counts, axis=1) * points[j]
    return result


def seen_from(origin: np.ndarray, portion: np.ndarray) -> np.ndarray:
    return portion.astype(float) - origin[:, None, None]
