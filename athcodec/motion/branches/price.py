"""About how many bits the motion of a branch takes on each other one, and as a root.

A branch takes the bits of what is left of the motion of a few of its vertices once its parent's is taken off: the
way of the vertex that it hangs on, with the turn of the parent, with its turn there, or without. Motion is written in
the components that all branches' motion over time has (Karhunen-Loeve), since the encoder learns such bases, too. A few
vertices in a few frames tell a right parent from a wrong one beside it by a few bits only, so what is smaller than the
branch that would hang on it is charged some.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from athcodec.motion.algebra import rotations_of
from athcodec.motion.branches.groups import cheapest_of_each, moments_of_each, sizes_of_each, sums_of_each
from athcodec.motion.branches.steady import scipy_module
from athcodec.untyped import ScipyObject

STEP = 1e-4  # Of the diagonal: about the steps of quantisation, below which motion costs nothing.
SHOWN = 3  # Vertices of a branch, far from each other, whose motion stands for its own.
HANGING = 30.0  # Bits of hanging on anything: a flag, a vertex, and the errors of what it hangs on.
SMALLER = 10.0  # Bits of hanging on what is smaller, and as many again of hanging on what is not twice as large.
AROUND = 12  # Vertices about the one that a branch hangs on, whose turn is that of its parent there.
APART = 16.0  # Distance of branches, in diagonals, at which no vertex has a neighbour of another one.
AT_ONCE = 1 << 14  # Pairs of vertices whose prices are computed at once.
FLAT = 1e-6  # Ratio of the extents of a branch below which its turns are not known.


class Prices:
    """Bits of the motion of labelled branches in a few frames, (1 + F, N, 3), of which the first is the rest pose."""

    def __init__(self, frames: np.ndarray, label: np.ndarray):
        """Take a few frames, (1 + F, N, 3), of which the first is the rest pose, and the branch of each vertex, `label`
        (N,).
        """
        self._frames, self._rest, self._label = frames, frames[0], label
        self._ways = (frames[1:] - frames[0]).transpose(1, 2, 0)  # (N, 3, F)
        self._shown = _far_vertices(self._rest, label)
        tracks = self._ways[self._shown].reshape(-1, len(frames) - 1)
        self._components = np.linalg.eigh(tracks.T @ tracks)[1]
        self._turns, self._sizes = _turns(frames, label), sizes_of_each(frames[0], label)
        self._diagonal = float(np.linalg.norm(np.ptp(frames.reshape(-1, 3), axis=0))) + np.finfo(float).tiny
        self._step = STEP * self._diagonal

    def as_roots(self) -> np.ndarray:
        """Return the bits of each branch as a root, (B,)."""
        return self._bits(self._ways[self._shown])

    def on_others(self, vertices: np.ndarray) -> np.ndarray:
        """Return the bits of a branch that hangs on another, (C,), for pairs of a vertex of the branch and the vertex
        of the other that it hangs on, (C, 2)."""
        bits, some = np.zeros(len(vertices)), np.argsort(vertices[:, 1], kind="stable")
        for first in range(0, len(vertices), AT_ONCE):
            chunk = some[first : first + AT_ONCE]
            bits[chunk] = self._on(vertices[chunk])
        return bits + self._of_sizes(*self._label[vertices].T)

    def _on(self, vertices: np.ndarray) -> np.ndarray:
        """Return for each pair of vertices, (C, 2), the bits that the first vertex's branch takes if it hangs on the
        second one's branch there, (C,).
        """
        child, attach = self._label[vertices[:, 0]], vertices[:, 1]
        left = self._ways[self._shown[child]] - self._ways[attach][:, None]
        arm = self._rest[self._shown[child]] - self._rest[attach][:, None]
        bits = self._bits(left)
        where, place = np.unique(attach, return_inverse=True)
        for turns in self._turns[self._label[attach]], self._turns_at(where)[place]:
            np.minimum(bits, self._bits(left - np.einsum("cijf,cpj->cpif", turns, arm)), out=bits)
        return HANGING + bits

    def _of_sizes(self, child: np.ndarray, parent: np.ndarray) -> np.ndarray:
        """Return the bits (C,) that are added where a branch hangs on one that is smaller, or less than twice as
        large."""
        smaller, larger = self._sizes[child], self._sizes[parent]
        return SMALLER * ((larger < smaller).astype(float) + (larger < 2 * smaller))

    def _turns_at(self, vertices: np.ndarray) -> np.ndarray:
        """Return the rotations of the surroundings of each vertex on its own branch, as `_turns` returns them.
        `vertices`: (K,).
        """
        near = self._tree.query(self._apart[vertices], k=min(AROUND, len(self._rest)), distance_upper_bound=APART / 2)[
            1
        ]
        near = near.reshape(len(vertices), -1)
        near = np.where(near < len(self._rest), near, near[:, :1])  # Small branches have fewer.
        poses = self._frames[:, near.ravel()]
        return _turns(poses, np.repeat(np.arange(len(vertices)), near.shape[1]))

    @cached_property
    def _apart(self) -> np.ndarray:
        """The vertices (N, 4) as points in four dimensions: the fourth separates branches, so that neighbours are of
        one branch."""
        return np.column_stack([self._rest / self._diagonal, APART * self._label])

    @cached_property
    def _tree(self) -> ScipyObject:
        return scipy_module("spatial").cKDTree(self._apart)

    def _bits(self, tracks: np.ndarray) -> np.ndarray:
        """Return about how many bits the tracks (K, p, 3, F) of K branches take, for each branch."""
        bits: np.ndarray = 0.5 * np.log2(1 + np.square(tracks @ self._components / self._step)).sum(axis=(1, 2, 3))
        return bits


def _far_vertices(rest: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return for each branch SHOWN of its vertices that are far from its centre and from each other, (B, SHOWN).
    `rest`: (N, 3) positions; `label`: the branch of each vertex, (N,).
    """
    away = np.square(_centred(rest, label)).sum(axis=1)
    shown: list[np.ndarray] = []
    for _ in range(SHOWN):
        shown.append(cheapest_of_each(label, -away))
        apart = ((rest - rest[shown[-1]][label]) ** 2).sum(axis=1)
        away = apart if len(shown) == 1 else np.minimum(away, apart)
    return np.stack(shown, axis=1)


def _turns(frames: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return the rotations that carry the branches best from the rest pose to each frame, less the identity,
    (B, 3, 3, F) (Kabsch 1976); zero for branches whose vertices lie on a line."""
    rest = _centred(frames[0], label)
    moments = np.stack([moments_of_each(pose, rest, label) for pose in frames[1:]])
    left, sizes, right = np.linalg.svd(moments)
    flat = sizes[..., 1] <= FLAT * sizes[..., 0]
    turns = np.where(flat[..., None, None], 0.0, rotations_of(left, right) - np.eye(3))
    return turns.transpose(1, 2, 3, 0)


def _centred(rest: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return positions less the mean of those of the same branch, (N, 3)."""
    centred: np.ndarray = rest - (sums_of_each(rest, label) / np.bincount(label)[:, None])[label]
    return centred
