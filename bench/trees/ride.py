"""The rigid frames that the nodes of a moving plant carry along its stems.

A frame follows its element by the smallest turn from the rest pose, so twist about the element's own axis is
left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec import MotionClip

BLOCK_FRAMES = 16


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The nodes of a simulated clip: positions (T, N, 3), rest (N, 3), parent (N,), and so on."""

    positions: np.ndarray
    rest: np.ndarray
    parent: np.ndarray
    branch: np.ndarray
    branch_parent: np.ndarray
    radius: np.ndarray
    time: np.ndarray

    @classmethod
    def of(cls, clip: MotionClip, frames: int) -> Skeleton:
        """Return the skeleton of the first `frames` frames of a simulated clip: the nodes' positions, parents, branches
        and radii.
        """
        parent = np.full(clip.vertex_count, -1)
        parent[clip.edges[:, 1]] = clip.edges[:, 0]
        return cls(
            clip.block(0, frames),
            clip.rest,
            parent,
            clip.vertex_branch,
            clip.branch_parent,
            clip.attributes["radius"],
            clip.time[:frames],
        )

    @property
    def height(self) -> float:
        return float(self.rest[:, 1].max())

    def direction(self, positions: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Return (..., M, 3) unit vectors along the nodes' elements; the root has that of the node after it."""
        nodes = np.maximum(nodes, 1)
        along = positions[..., nodes, :] - positions[..., self.parent[nodes], :].astype(np.float64)
        return along / np.linalg.norm(along, axis=-1, keepdims=True)

    def turns(self, positions: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Return (..., M, 3, 3) the smallest rotations of the nodes' elements from the rest pose."""
        return smallest_turns(self.direction(self.rest, nodes), self.direction(positions, nodes))

    def outer_nodes(self) -> np.ndarray:
        """Return nodes on stems that carry no others."""
        return np.flatnonzero(~np.isin(self.branch, self.branch_parent))


def smallest_turns(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return (..., 3, 3) rotations that take unit vectors to unit vectors, by Rodrigues' formula without angles."""
    axis, cosine = np.cross(start, end), (start * end).sum(axis=-1)
    cross = cross_matrices(axis)
    return np.eye(3) + cross + cross @ cross / np.maximum(1.0 + cosine, 1e-6)[..., None, None]


def rotations(vectors: np.ndarray) -> np.ndarray:
    """Return (..., 3, 3) rotations by rotation vectors (axis times angle)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    cross = cross_matrices(vectors)
    half = np.sinc(angle / (2 * np.pi))
    return np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * (cross @ cross)


def cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """Return (..., 3, 3) matrices that multiply as cross products."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)


def sideways(direction: np.ndarray, azimuth: np.ndarray, angle: float) -> np.ndarray:
    """Return (M, 3) unit vectors at an angle to unit vectors, turned around them by azimuths."""
    helper = np.eye(3)[np.abs(direction).argmin(axis=1)]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    across = np.cos(azimuth)[:, None] * first + np.sin(azimuth)[:, None] * np.cross(direction, first)
    return np.cos(angle) * direction + np.sin(angle) * across
