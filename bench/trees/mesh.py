"""A render mesh on a simulated plant: bark tubes around the stems, and leaf cards that flutter on the outer
ones.

A tube is a ring of vertices per node, and one where the stem leaves its parent; a leaf is one rigid quad that
turns about the node it stands on. It bends in the wind as an oscillator does and rolls about its own axis,
the more the stronger the wind (after the sinusoids of Sousa, "Vegetation procedural animation and shading in
Crysis", GPU Gems 3, chapter 16, 2007). The branches of the clip are the stems, with their tubes, and then one
per leaf. No normals, no texture coordinates.
"""

from __future__ import annotations

import numpy as np

from athcodec import MotionClip
from bench.trees.ride import BLOCK_FRAMES, Skeleton, drag_at, limited, rotations, sideways, sway
from bench.trees.wind import Wind

SIDES = 6
LEAF_LENGTH = 0.02  # over the plant's height: a card stands for a cluster of leaves
LEAF_ANGLE = np.radians(60.0)
LEAF_BEND = 0.25  # rad in the mean wind
LEAF_HERTZ = (2.0, 4.0)
LEAF_DAMPING = 0.2
FLUTTER = 0.3  # rad in the mean wind
FLUTTER_HERTZ = (3.0, 6.0)
CARD = np.array([[0.3, -0.35], [0.3, 0.35], [1.3, -0.35], [1.3, 0.35]])  # along and across, over the length


def dress(clip: MotionClip, wind: Wind, frames: int, leaves: int, seed: int) -> MotionClip:
    """The first frames of a simulated clip as a mesh with so many leaves."""
    skeleton = Skeleton.of(clip, frames)
    tubes = _Tubes(skeleton)
    cards = _Leaves(skeleton, wind, leaves, np.random.default_rng(seed))
    shape = (tubes.count + 4 * leaves, 3)
    positions, rest = np.empty((frames, *shape), np.float32), np.empty(shape, np.float32)
    for start in range(0, frames, BLOCK_FRAMES):
        block = slice(start, start + BLOCK_FRAMES)
        nodes = skeleton.positions[block]
        positions[block, : tubes.count] = tubes.at(nodes)
        positions[block, tubes.count :] = cards.at(nodes, cards.bend[block], cards.roll[block])
    rest[: tubes.count] = tubes.at(skeleton.rest)
    rest[tubes.count :] = cards.at(skeleton.rest, np.zeros((leaves, 3)), np.zeros(leaves))
    leaf_branch = np.repeat(len(skeleton.branch_parent) + np.arange(leaves), 4)
    return MotionClip(
        positions=positions,
        time=skeleton.time,
        rest=rest,
        metadata=dict(clip.metadata),
        vertex_branch=np.concatenate([tubes.branch, leaf_branch]),
        branch_parent=np.concatenate([skeleton.branch_parent, skeleton.branch[cards.node]]),
        faces=np.concatenate([tubes.faces, tubes.count + cards.faces]).astype(np.int32),
    )


class _Tubes:
    """Rings in the order of the stems, each with a centre node and the node whose element carries it."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        nodes = np.arange(len(skeleton.parent))
        first = np.flatnonzero((np.diff(skeleton.branch, prepend=0) != 0) & (nodes > 0))
        # the trunk's first ring is that of the root itself; every other stem gets one on its parent
        place = np.concatenate([nodes, first - 0.5])
        order = np.argsort(place)
        self.centre = np.concatenate([nodes, skeleton.parent[first]])[order]
        self.carrier = np.concatenate([nodes, first])[order]
        self.count = SIDES * len(order)
        ring_branch = skeleton.branch[self.carrier]
        self.branch = np.repeat(ring_branch, SIDES)
        self.offsets = self._circles(skeleton.radius[self.carrier])
        self.faces = _tube_faces(ring_branch)

    def _circles(self, radius: np.ndarray) -> np.ndarray:
        """(rings, SIDES, 3) around the elements of the rest pose, without twist from ring to ring."""
        along = self.skeleton.direction(self.skeleton.rest, self.carrier)
        helper = np.eye(3)[np.abs(self._chords()).argmin(axis=1)]
        first = np.cross(along, helper)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        angle = 2 * np.pi * np.arange(SIDES)[:, None, None] / SIDES
        around = np.cos(angle) * first + np.sin(angle) * np.cross(along, first)
        return radius[:, None, None] * around.transpose(1, 0, 2)

    def _chords(self) -> np.ndarray:
        """(rings, 3) base to tip of the ring's stem: one helper axis per stem keeps its rings aligned."""
        branch = self.skeleton.branch
        last = len(branch) - 1 - np.unique(branch[::-1], return_index=True)[1]
        first = np.unique(branch, return_index=True)[1]
        chord = self.skeleton.rest[last] - self.skeleton.rest[np.maximum(self.skeleton.parent[first], 0)]
        return chord[branch[self.carrier]]

    def at(self, nodes: np.ndarray) -> np.ndarray:
        """(..., count, 3) vertices from (..., N, 3) nodes."""
        turned = np.einsum("...rij,rsj->...rsi", self.skeleton.turns(nodes, self.carrier), self.offsets)
        points = nodes[..., self.centre, None, :] + turned
        return points.reshape(*nodes.shape[:-2], -1, 3)


def _tube_faces(ring_branch: np.ndarray) -> np.ndarray:
    """(F, 4) quads between each ring and the next one of its stem."""
    lower = SIDES * np.flatnonzero(ring_branch[1:] == ring_branch[:-1])[:, None]
    side, following = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    upper = lower + SIDES
    return np.stack([lower + side, lower + following, upper + following, upper + side], axis=2).reshape(-1, 4)


class _Leaves:
    """Leaves at random nodes of the outer stems, sorted by node."""

    def __init__(self, skeleton: Skeleton, wind: Wind, leaves: int, rng: np.random.Generator) -> None:
        self.skeleton = skeleton
        self.node = np.sort(rng.choice(skeleton.outer_nodes(), leaves))
        below = skeleton.direction(skeleton.rest, self.node)
        self.axis = sideways(below, rng.uniform(0, 2 * np.pi, leaves), LEAF_ANGLE)
        across = np.cross(self.axis, below)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        length = LEAF_LENGTH * skeleton.height * rng.uniform(0.7, 1.3, leaves)
        along = CARD[None, :, :1] * self.axis[:, None, :]
        self.corners = length[:, None, None] * (along + CARD[None, :, 1:] * across[:, None, :])
        self.faces = 4 * np.arange(leaves)[:, None] + [0, 1, 3, 2]
        drag = drag_at(wind, skeleton.positions[:, self.node], skeleton.time)
        # about axes of the rest pose, which the stem then carries: its own turn is small beside the gusts
        self.bend = self._bend(drag, rng)
        self.roll = self._roll(np.linalg.norm(drag, axis=-1), rng)

    def _bend(self, drag: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        step = 1.0 if len(drag) < 2 else self.skeleton.time[1] - self.skeleton.time[0]
        torque = LEAF_BEND * np.cross(self.axis, drag)
        return limited(sway(torque, rng.uniform(*LEAF_HERTZ, len(self.node)), LEAF_DAMPING, step))

    def _roll(self, drag: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(T, leaves) angles about the leaves' axes: two sinusoids that beat, in step with the gusts."""
        shape = (2, 1, len(self.node))
        cycles = rng.uniform(size=shape) + rng.uniform(*FLUTTER_HERTZ, shape) * self.skeleton.time[:, None]
        phase = 2 * np.pi * cycles
        return FLUTTER * np.minimum(drag, 3.0) * (0.6 * np.sin(phase[0]) + 0.4 * np.sin(phase[1]))

    def at(self, nodes: np.ndarray, bend: np.ndarray, roll: np.ndarray) -> np.ndarray:
        """(..., 4 leaves, 3) corners from nodes, (..., leaves, 3) rotation vectors, (..., leaves) angles."""
        own = rotations(bend) @ rotations(roll[..., None] * self.axis)
        turns = self.skeleton.turns(nodes, self.node) @ own
        points = nodes[..., self.node, None, :] + np.einsum("...lij,lcj->...lci", turns, self.corners)
        return points.reshape(*nodes.shape[:-2], -1, 3)
