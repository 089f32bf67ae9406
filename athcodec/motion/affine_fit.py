"""Least-squares affine maps of subtrees and stems from the rest pose to each frame (Song, Yang and Peng 2011, eq. 2).

Where the paper's least squares have no unique answer (straight, flat or flattened subtrees) the map is completed, so
that it stays invertible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec._native import address, lib
from athcodec.motion.algebra import decompose, determinant, multiply, principal
from athcodec.motion.hierarchy import Hierarchy

RANK_TOLERANCE = 1e-3
"""A subtree's principal extent counts as missing below this part of its largest one: its best-fit stretch
along such a direction would be the noise of the rest pose."""
MIN_STRETCH = 0.1
"""Least stretch of any direction in a map, relative to its largest where that is below 1. A frame in which
the best fit flattens a subtree would otherwise have no inverse, or residuals many times as long as the
map's error."""
_LEAST_SCALE = 1e-2  # Smallest value that MIN_STRETCH is relative to, because a subtree may shrink to a point.
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
        return pieces.fit(frames).differences(np.inf if xi is None else xi)

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
    inherits its free rotation from (-1: none), `level` a number greater than the parent's.
    """

    def __init__(
        self,
        hierarchy: Hierarchy,
        rest: np.ndarray,
        first_branch: np.ndarray,
        stop_branch: np.ndarray,
        parent: np.ndarray,
        level: np.ndarray,
    ) -> None:
        bounds = np.append(hierarchy.first_vertex, hierarchy.vertex_count).astype(np.intp)
        self.first_branch, self.stop_branch, self.parent = first_branch, stop_branch, parent
        self.first, self.stop = bounds[first_branch], bounds[stop_branch]
        self.counts = self.stop - self.first
        self.levels = [np.flatnonzero(level == value) for value in np.unique(level)]
        self.stem_starts = bounds[:-1]
        self.origin = rest.mean(axis=0)
        self.rest = np.ascontiguousarray((rest - self.origin).T)
        self._describe_rest_pose()
        self.lends_rotation = np.zeros(len(first_branch), bool)
        self.lends_rotation[parent[(self.rank < 2) & (parent >= 0)]] = True

    @classmethod
    def subtrees(
        cls, hierarchy: Hierarchy, rest: np.ndarray, branches: np.ndarray, parent: np.ndarray, level: np.ndarray
    ) -> Pieces:
        stop_branch = branches + hierarchy.subtree_branches[branches]
        return cls(hierarchy, rest, branches, stop_branch, parent, level)

    def vertices(self, some: np.ndarray) -> np.ndarray:
        """Return the vertices of some pieces, one piece after the other."""
        counts = self.counts[some]
        return np.arange(counts.sum()) + np.repeat(self.first[some] - starts(counts), counts)

    def fit(self, frames: np.ndarray) -> Fit:
        """Return the maps of all pieces in frames (3,k,N)."""
        return Fit(self, frames)

    def _describe_rest_pose(self) -> None:
        """Return each piece's centroid, principal axes (columns, longest first), rank and pseudo-inverse."""
        count = len(self.first)
        self.centroid = np.empty((count, 3))
        covariance = np.empty((count, 3, 3))
        for some in self.levels:  # Pieces of one level do not overlap.
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

    linear and inverse are (k,n,3,3), centroid (k,n,3), all seen from the origin of the pieces.
    """

    def __init__(self, pieces: Pieces, frames: np.ndarray) -> None:
        self.pieces, self.frames = pieces, frames
        sums = self._sums()
        self.centroid = sums[..., 3] / pieces.counts[:, None]
        covariance = sums[..., :3] / pieces.counts[:, None, None]
        covariance -= self.centroid[..., None] * pieces.centroid[:, None]
        self.linear = multiply(covariance, pieces.pseudo_inverse)
        self.inverse = np.empty_like(self.linear)
        rotation = np.broadcast_to(np.eye(3), (len(self.linear), len(pieces.first) + 1, 3, 3)).copy()
        for some in pieces.levels:
            self._complete(some, rotation)
            self.linear[:, some], self.inverse[:, some] = _invertible(self.linear[:, some])
            lenders = some[pieces.lends_rotation[some]]
            rotation[:, lenders] = _nearest_rotation(self.linear[:, lenders])

    def _sums(self) -> np.ndarray:
        """Return sums of x_i y_j and x_i over each piece's vertices, (k,n,3,4), of x now and y at rest.

        Running sums over the stems serve every subtree at once, because a subtree is a range of stems.
        """
        pieces, frames = self.pieces, self.frames
        stems = np.empty((3, 4, frames.shape[1], len(pieces.stem_starts) + 1))
        stems[..., 0] = 0.0
        for j in range(3):
            np.add.reduceat(frames * pieces.rest[j], pieces.stem_starts, axis=2, out=stems[:, j, :, 1:])
        np.add.reduceat(frames, pieces.stem_starts, axis=2, out=stems[:, 3, :, 1:])
        np.cumsum(stems, axis=3, out=stems)
        sums = stems[..., pieces.stop_branch] - stems[..., pieces.first_branch]
        return np.ascontiguousarray(sums.transpose(2, 3, 0, 1))

    def _complete(self, some: np.ndarray, rotation: np.ndarray) -> None:
        """Give the maps of flat, straight and point-like pieces the directions that their rest pose lacks."""
        pieces = self.pieces
        rank = pieces.rank[some]
        flat, straight, points = some[rank == 2], some[rank == 1], some[rank == 0]
        if len(flat):
            axes = pieces.axes[flat]
            images = multiply(self.linear[:, flat], axes[:, :, :2])
            normal = _unit(np.cross(images[..., 0], images[..., 1]))
            self.linear[:, flat] += normal[..., None] * axes[:, None, :, 2]
        if len(straight):
            axis = pieces.axes[straight][:, :, 0]
            image = _unit(multiply(self.linear[:, straight], axis[..., None])[..., 0])
            inherited = rotation[:, pieces.parent[straight]]
            turn = _least_rotation(multiply(inherited, axis[..., None])[..., 0], image)
            across = np.eye(3) - axis[:, :, None] * axis[:, None]
            self.linear[:, straight] += multiply(multiply(turn, inherited), across)
        self.linear[:, points] = rotation[:, pieces.parent[points]]

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

    def differences(self, xi: float) -> Differences:
        """Return how far the residuals are from their base places."""
        pieces, (_, frames, vertices) = self.pieces, self.frames.shape
        inverse, offset = self.inverse_maps()
        count = len(pieces.first)
        fits = Differences(np.empty((frames, count)), np.empty(count), np.empty(count, np.int32))
        lib.ath_differences(
            vertices,
            frames,
            count,
            address(pieces.first, np.int64, count),
            address(pieces.stop, np.int64, count),
            address(inverse, np.float64, frames * count * 9),
            address(offset, np.float64, frames * count * 3),
            address(pieces.rest, np.float64, 3 * vertices),
            address(self.frames, np.float64, self.frames.size),
            xi,
            fits.gads.ctypes.data,
            fits.largest_distance.ctypes.data,
            fits.most_beyond_xi.ctypes.data,
        )
        return fits


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


def _invertible(linear: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the maps (k,n,3,3) with every direction stretched by MIN_STRETCH at least, and their inverses."""
    a, b, c = linear[..., 0], linear[..., 1], linear[..., 2]
    adjugate = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-2)
    determinant = (a * adjugate[..., 0, :]).sum(axis=-1)
    # The least stretch is at least 1 / |inverse|, so the few suspects alone are decomposed.
    suspect = np.linalg.norm(adjugate, axis=(-2, -1)) * MIN_STRETCH >= np.abs(determinant)
    inverse = adjugate / np.where(suspect, 1.0, determinant)[..., None, None]
    if suspect.any():
        linear = linear.copy()
        linear[suspect], inverse[suspect] = _stretched(linear[suspect])
    return linear, inverse


def _stretched(linear: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    left, stretch, right = decompose(linear)
    least = MIN_STRETCH * np.clip(stretch[:, 0], _LEAST_SCALE, 1.0)
    # Which side a flattened subtree shows is noise: it is not turned inside out.
    mirrored = (determinant(left) * determinant(right) < 0) & (stretch[:, 2] < least)
    left[mirrored, :, 2] *= -1.0
    stretch = np.maximum(stretch, least[:, None])[:, None]
    return multiply(left * stretch, right), multiply(np.swapaxes(right, 1, 2) / stretch, np.swapaxes(left, 1, 2))


def _nearest_rotation(linear: np.ndarray) -> np.ndarray:
    left, _, right = decompose(linear)
    left[..., 2] *= np.sign(determinant(left) * determinant(right))[..., None]
    return multiply(left, right)


def _least_rotation(start: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Return rotations (...,3,3) that turn unit vectors `start` into `goal` on the shortest way; identities where goal
    is zero."""
    axis = np.cross(start, goal)
    cosine = (start * goal).sum(axis=-1)
    turn = np.zeros((*axis.shape, 3))
    turn[..., 0, 1], turn[..., 0, 2], turn[..., 1, 2] = -axis[..., 2], axis[..., 1], -axis[..., 0]
    turn -= np.swapaxes(turn, -1, -2)
    # Opposite vectors have no least rotation: they stay as they are.
    return np.eye(3) + turn + multiply(turn, turn) / np.maximum(1.0 + cosine, 1e-9)[..., None, None]


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def seen_from(origin: np.ndarray, portion: np.ndarray) -> np.ndarray:
    return portion.astype(float) - origin[:, None, None]
