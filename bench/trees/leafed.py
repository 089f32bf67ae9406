"""A broadleaf tree to look at: smooth bark tubes and sprays of leaves, in winds that repeat: its clips are loops.

The wind repeats after each clip, and beams and leaves run until what they began with has died away. A spray is one
hinged blade of several leaves. Texture coordinates: on bark the first is 0 to 1 and back around the stem and the
second grows along it, by the stem's own girth; on leaves they are 1 + 2 k to 2 + 2 k across the leaf, with a shade k
from 0 to SHADES - 1, and 0 to 1 along it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from athcodec import MotionClip, join
from athcodec.motion.clip import ClipRange
from athcodec.motion.joining import in_wind
from bench.trees.beams import bend
from bench.trees.leaves import Leaves, Species, sheet
from bench.trees.mesh import Tubes, bark_uv
from bench.trees.plant import Plant, grow
from bench.trees.ride import BLOCK_FRAMES, Skeleton
from bench.trees.wind import Wind

SIDES = 8
FINER = 2  # rings per element
SHADES = 8
LEAVES_OF_SPRAY = 5
SPRAY_LENGTH = 0.034  # Length over the plant's height.
LEAF_WIDTH = 0.62  # Width over length of the card that the leaf is cut from.
THICKER = 2.4  # the trunk drawn, over the one that bends
ROOTS, ROOTS_HEIGHT = 0.7, 0.025  # how much wider the trunk's foot is, and over what height
SETTLING_SECONDS = 24.0


def leafed(
    nodes: int, orders: int, height: float, sprays: int, frames: int, winds: Mapping[str, float], seed: int, fps: float
) -> MotionClip:
    """Return the tree in one loop for each of the winds (m/s)."""
    plant = grow(nodes, orders, height, seed)

    def moved(wind: Wind) -> MotionClip:
        return _Dressed(plant, bend(plant, wind, frames, fps, spin_up=SETTLING_SECONDS), sprays, fps, seed).clip(wind)

    return in_winds(moved, winds, height, frames, fps, seed)


def in_winds(
    moved: Callable[[Wind], MotionClip], winds: Mapping[str, float], height: float, frames: int, fps: float, seed: int
) -> MotionClip:
    """Return one loop for each of the winds, whose speeds (m/s) are those at `height`."""
    parts = {}
    for name, speed in winds.items():
        part = moved(Wind(speed, height, seed=seed, period=frames / fps))
        part.clip_ranges = (ClipRange(name, frames, loop=True),)
        parts[name] = in_wind(part, speed)
    return join(parts)


class _Dressed:
    """A moving plant with its bark and leaves."""

    def __init__(self, plant: Plant, nodes: np.ndarray, sprays: int, fps: float, seed: int) -> None:
        self.frames, self.fps = len(nodes), fps
        self.skeleton = _smooth(plant, nodes, fps)
        self.tubes = Tubes(self.skeleton, SIDES)
        rng = np.random.default_rng(seed)
        self.leaves = Leaves(self.skeleton, _spray(), sprays, rng)
        self.shade = rng.integers(0, SHADES, sprays * LEAVES_OF_SPRAY)

    def clip(self, wind: Wind) -> MotionClip:
        """Return one loop of the leafed tree in a wind, as a mesh of bark and sprays of leaves."""
        turns = self.leaves.flown(wind)[self.frames :]
        skeleton = self.skeleton
        positions = np.concatenate(
            [
                self._at(skeleton.positions[start : start + BLOCK_FRAMES], turns[start : start + BLOCK_FRAMES])
                for start in range(0, self.frames, BLOCK_FRAMES)
            ]
        )[: self.frames]
        each = len(self.leaves.species.blade)
        sprays = len(self.leaves.node)
        return MotionClip(
            positions=positions,
            time=np.arange(self.frames) / self.fps,
            rest=self._at(skeleton.rest, self.leaves.unturned()),
            vertex_branch=np.concatenate(
                [self.tubes.branch, np.repeat(len(skeleton.branch_parent) + np.arange(sprays), each)]
            ),
            branch_parent=np.concatenate([skeleton.branch_parent, skeleton.branch[self.leaves.node]]),
            faces=np.concatenate([self.tubes.faces, self.tubes.count + self.leaves.faces]).astype(np.int32),
            attributes={"uv": np.concatenate([bark_uv(skeleton, self.tubes), self._leaf_uv()]).astype(np.float32)},
            metadata={"unit": "m", "up_axis": "y", "fps": self.fps, "surfaces": "bark, leaves"},
        )

    def _at(self, nodes: np.ndarray, turns: np.ndarray) -> np.ndarray:
        nodes = nodes[: len(turns)] if nodes.ndim == 3 else nodes
        return np.concatenate([self.tubes.at(nodes), self.leaves.at(nodes, turns)], axis=-2).astype(np.float32)

    def _leaf_uv(self) -> np.ndarray:
        return leaf_uv(np.linspace(0, 1, len(_LEAF[0]) // 2), self.shade)


def leaf_uv(along: np.ndarray, shade: np.ndarray) -> np.ndarray:
    """Return (V L, 2) of leaves with pairs of vertices across them, at these shares of their lengths."""
    card = np.stack([np.tile([0.0, 1.0], len(along)), np.repeat(along, 2)], axis=1)
    uv = np.tile(card, (len(shade), 1))
    uv[:, 0] += 1 + 2 * np.repeat(shade, len(card))
    return uv


_LEAF = sheet([0.0, 0.5, 1.0], [LEAF_WIDTH / 2] * 3, [0.0, 0.09, 0.0])


def _spray() -> Species:
    """Return the species that describes a spray: leaves along a short twig and one at its end, spread in one plane as
    light lets them.
    """
    points, quads = _LEAF
    cards = []
    for number in range(LEAVES_OF_SPRAY):
        share = number / (LEAVES_OF_SPRAY - 1)
        angle = 0.0 if number == LEAVES_OF_SPRAY - 1 else (1.15 - 0.5 * share) * (-1) ** number
        tilt = 0.35 * np.sin(2.4 * number)
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        lean = np.array([[np.cos(tilt), 0, -np.sin(tilt)], [0, 1, 0], [np.sin(tilt), 0, np.cos(tilt)]])
        size = 0.62 + 0.18 * np.sin(3.1 * number + 1)
        cards.append(size * points @ lean.T @ turn.T + [0.1 + 0.75 * share, 0.0, 0.06 * np.sin(2.0 * number)])
    faces = np.concatenate([quads + len(points) * i for i in range(LEAVES_OF_SPRAY)])
    return Species(np.concatenate(cards), faces, SPRAY_LENGTH, 0.8, 0.2, (4.5, 2.0, 2.6), 0.3)


def _smooth(plant: Plant, nodes: np.ndarray, fps: float) -> Skeleton:
    """Return the stems of a plant as smooth splines through its nodes (T, N, 3). The motion is there twice, so that
    leaves can settle in the first round.
    """
    time = np.arange(len(nodes)) / fps
    bare = Skeleton(nodes, plant.position, plant.parent, plant.branch, plant.branch_parent, plant.radius, time)
    splines = _Splines(bare, FINER)
    rest, moved = splines.apply(bare.rest).astype(np.float32), splines.apply(nodes).astype(np.float32)
    parent = np.full(splines.count, -1)
    parent[splines.edges[:, 1]] = splines.edges[:, 0]
    twice = np.concatenate([moved, moved])
    radius = _drawn_radius(plant, splines, rest)
    return Skeleton(twice, rest, parent, splines.branch, plant.branch_parent, radius, np.arange(len(twice)) / fps)


def _drawn_radius(plant: Plant, splines: _Splines, rest: np.ndarray) -> np.ndarray:
    """Return the radii (V,) with which vertices on splines are drawn: the trunk is thicker, its foot is wider, and tips
    end thin.
    """
    start, end = splines.controls[:, 1], splines.controls[:, 2]
    same = plant.branch[start] == plant.branch[end]
    share = splines.share
    radius = (1 - share) * np.where(same, plant.radius[start], plant.radius[end]) + share * plant.radius[end]
    radius = radius * (1 + (THICKER - 1) * np.sqrt(radius / radius.max()))
    trunk = splines.branch == 0
    radius[trunk] *= 1 + ROOTS * np.exp(-rest[trunk, 1] / (ROOTS_HEIGHT * plant.height))
    last = np.flatnonzero(np.diff(splines.branch, append=-1))
    radius[last] *= 0.4
    return radius


class _Splines:
    """Vertices on Catmull-Rom splines through the nodes of each stem, `factor` per element, as sums of four nodes.

    Node i of the skeleton is vertex factor * i. (Catmull and Rom, "A class of local interpolating splines", Computer
    Aided Geometric Design, 1974.)
    """

    def __init__(self, skeleton: Skeleton, factor: int) -> None:
        """Divide each element of a skeleton into `factor` parts, and find the four nodes, with weights, that each of
        the new vertices follows.
        """
        self.count = factor * (len(skeleton.parent) - 1) + 1
        self.node = -(-np.arange(self.count) // factor)
        self.branch = skeleton.branch[self.node]
        self.share = ((np.arange(self.count) - 1) % factor + 1) / factor
        self.controls, self.weights = _controls(skeleton, self.node, self.share)
        below = np.arange(-1, self.count - 1)
        below[1::factor] = factor * skeleton.parent[1:]
        self.edges = np.stack([below[1:], np.arange(1, self.count)], axis=1)

    def apply(self, nodes: np.ndarray) -> np.ndarray:
        """Return (..., count, 3) vertices from (..., N, 3) nodes."""
        return sum(nodes[..., self.controls[:, k], :] * self.weights[:, k : k + 1] for k in range(4))


def _controls(skeleton: Skeleton, node: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes and weights, (V, 4) each, of a Catmull-Rom spline for V vertices. Vertex i lies at the fraction
    `t[i]` of the element that ends at `node[i]`.
    """
    parent, branch = skeleton.parent, skeleton.branch
    start = np.maximum(parent[node], 0)
    before = np.where((branch[start] == branch[node]) & (start > 0), parent[start], -1)
    after = np.minimum(node + 1, len(parent) - 1)
    after = np.where((branch[after] == branch[node]) & (after > node), after, -1)
    weights = 0.5 * np.stack(
        [-t + 2 * t**2 - t**3, 2 - 5 * t**2 + 3 * t**3, t + 4 * t**2 - 3 * t**3, t**3 - t**2], axis=1
    )
    # a missing neighbour is the mirror image of the other one, so that a stem leaves in its own direction
    for missing, outer, near, far in ((before < 0, 0, 1, 2), (after < 0, 3, 2, 1)):
        weights[missing, near] += 2 * weights[missing, outer]
        weights[missing, far] -= weights[missing, outer]
        weights[missing, outer] = 0.0
    weights[node == 0] = [0.0, 0.0, 1.0, 0.0]
    return np.stack([np.maximum(before, 0), start, node, np.maximum(after, 0)], axis=1), weights
