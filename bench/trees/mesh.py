"""A render mesh on a simulated plant: bark tubes around the stems, and leaves in the wind on the outer ones.

A tube is a ring of vertices per node, and one where the stem leaves its parent; for the leaves see leaves.py. The
branches of the clip are the stems, with their tubes, and then one per leaf. No normals.
"""

from __future__ import annotations

import numpy as np

from athcodec import MotionClip
from bench.trees.leaves import SPECIES, Leaves
from bench.trees.ride import BLOCK_FRAMES, Skeleton
from bench.trees.wind import Wind

SIDES = 6


def dress(
    clip: MotionClip, wind: Wind, frames: int, leaves: int, seed: int, species: str = "poplar", sides: int = SIDES
) -> MotionClip:
    """Return the first `frames` frames of a simulated clip as a mesh: tubes of `sides` sides around the stems, and
    `leaves` leaves in the wind on the outer nodes.
    """
    skeleton, kind = Skeleton.of(clip, frames), SPECIES[species]
    tubes = Tubes(skeleton, sides)
    cards = Leaves(skeleton, kind, leaves, np.random.default_rng(seed))
    turns = cards.flown(wind)
    shape = (tubes.count + len(kind.blade) * leaves, 3)
    positions, rest = np.empty((frames, *shape), np.float32), np.empty(shape, np.float32)
    for start in range(0, frames, BLOCK_FRAMES):
        block = slice(start, start + BLOCK_FRAMES)
        nodes = skeleton.positions[block]
        positions[block, : tubes.count] = tubes.at(nodes)
        positions[block, tubes.count :] = cards.at(nodes, turns[block])
    rest[: tubes.count] = tubes.at(skeleton.rest)
    rest[tubes.count :] = cards.at(skeleton.rest, cards.unturned())
    leaf_branch = np.repeat(len(skeleton.branch_parent) + np.arange(leaves), len(kind.blade))
    return MotionClip(
        positions=positions,
        time=skeleton.time,
        rest=rest,
        metadata=dict(clip.metadata),
        vertex_branch=np.concatenate([tubes.branch, leaf_branch]),
        branch_parent=np.concatenate([skeleton.branch_parent, skeleton.branch[cards.node]]),
        faces=np.concatenate([tubes.faces, tubes.count + cards.faces]).astype(np.int32),
    )


class Tubes:
    """Rings in the order of the stems, each with a centre node and the node whose element carries it."""

    def __init__(self, skeleton: Skeleton, sides: int = SIDES) -> None:
        """Lay tubes of `sides` sides around the stems of a skeleton: a ring at each node, and one more where a stem
        begins on its parent.
        """
        self.skeleton, self.sides = skeleton, sides
        nodes = np.arange(len(skeleton.parent))
        first = np.flatnonzero((np.diff(skeleton.branch, prepend=0) != 0) & (nodes > 0))
        # the trunk's first ring is that of the root itself; every other stem gets one on its parent
        place = np.concatenate([nodes, first - 0.5])
        order = np.argsort(place)
        self.centre = np.concatenate([nodes, skeleton.parent[first]])[order]
        self.carrier = np.concatenate([nodes, first])[order]
        self.count = sides * len(order)
        ring_branch = skeleton.branch[self.carrier]
        self.branch = np.repeat(ring_branch, sides)
        self.offsets = self._circles(skeleton.radius[self.carrier])
        self.faces = _tube_faces(ring_branch, sides)

    def _circles(self, radius: np.ndarray) -> np.ndarray:
        """Return rings of offsets (rings, sides, 3) across the stems of the rest pose, with the given radii (rings,),
        without twist from ring to ring.
        """
        along = self.skeleton.direction(self.skeleton.rest, self.carrier)
        helper = np.eye(3)[np.abs(self._chords()).argmin(axis=1)]
        first = np.cross(along, helper)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        angle = 2 * np.pi * np.arange(self.sides)[:, None, None] / self.sides
        around = np.cos(angle) * first + np.sin(angle) * np.cross(along, first)
        return radius[:, None, None] * around.transpose(1, 0, 2)

    def _chords(self) -> np.ndarray:
        """Return (rings, 3) base to tip of the ring's stem: one helper axis per stem keeps its rings aligned."""
        branch = self.skeleton.branch
        last = len(branch) - 1 - np.unique(branch[::-1], return_index=True)[1]
        first = np.unique(branch, return_index=True)[1]
        chord = self.skeleton.rest[last] - self.skeleton.rest[np.maximum(self.skeleton.parent[first], 0)]
        return chord[branch[self.carrier]]

    def at(self, nodes: np.ndarray) -> np.ndarray:
        """Return (..., count, 3) vertices from (..., N, 3) nodes."""
        turned = np.einsum("...rij,rsj->...rsi", self.skeleton.turns(nodes, self.carrier), self.offsets)
        points = nodes[..., self.centre, None, :] + turned
        return points.reshape(*nodes.shape[:-2], -1, 3)


def _tube_faces(ring_branch: np.ndarray, sides: int) -> np.ndarray:
    """Return (F, 4) quads between each ring and the next one of its stem."""
    lower = sides * np.flatnonzero(ring_branch[1:] == ring_branch[:-1])[:, None]
    side, following = np.arange(sides), (np.arange(sides) + 1) % sides
    upper = lower + sides
    return np.stack([lower + side, lower + following, upper + following, upper + side], axis=2).reshape(-1, 4)


def bark_uv(skeleton: Skeleton, tubes: Tubes) -> np.ndarray:
    """Return texture coordinates (count, 2) of the tubes' vertices: around the stem from 0 to 1 and back, and along the
    stem in units of the girth at its foot.
    """
    below = skeleton.rest[np.maximum(skeleton.parent, 0)]
    length = np.linalg.norm(skeleton.rest - below, axis=1)
    girth = 2 * np.pi * np.maximum.reduceat(skeleton.radius, np.unique(skeleton.branch, return_index=True)[1])
    along = np.zeros(len(length))
    for node in range(1, len(length)):
        same = skeleton.branch[node] == skeleton.branch[skeleton.parent[node]]
        start = along[skeleton.parent[node]] if same else 0.0
        along[node] = start + length[node] / girth[skeleton.branch[node]]
    first = tubes.centre != tubes.carrier
    rings = np.where(first, 0.0, along[tubes.carrier])
    around = 1 - np.abs(np.arange(tubes.sides) * 2 / tubes.sides - 1)
    uv = np.stack([np.tile(around, len(rings)), np.repeat(rings, tubes.sides)], axis=1)
    return np.round(uv * 64) / 64
