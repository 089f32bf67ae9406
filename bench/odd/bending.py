"""Plants that sway by formulas, without an engine: every stem bends by a rotation of its own that is spread over its
elements, and carries what grows on it.

The rotations are sums of a lean, gusts that reach the stems one after the other, and an oscillation of each stem, so
motion is smooth, no two stems move alike, and elements keep their lengths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec import MotionClip
from bench.trees.plant import Plant, grow
from bench.trees.ride import rotations

FPS = 30.0
GUSTS = 6
GUST_HERTZ = (0.1, 0.7)
STEM_HERTZ = (0.5, 2.5)
LATEST = 0.8  # seconds until a gust has reached every stem


@dataclass(frozen=True, eq=False)
class Bones:
    """N nodes as in Plant, of which only what bends: `element` (N, 3) leads from the node below, from the origin for
    the root.
    """

    parent: np.ndarray
    branch: np.ndarray
    branch_parent: np.ndarray
    element: np.ndarray

    @classmethod
    def of(cls, plant: Plant) -> Bones:
        """Return the nodes of a plant, with only what bending needs."""
        return cls(plant.parent, plant.branch, plant.branch_parent, plant.elements)

    @property
    def rest(self) -> np.ndarray:
        """Rest positions of the nodes, (N, 3) float64, in metres."""
        position = self.element.copy()
        for node, below in enumerate(self.parent[1:].tolist(), start=1):
            position[node] += position[below]
        return position

    @property
    def edges(self) -> np.ndarray:
        """(N - 1, 2) node below and node."""
        return np.stack([self.parent[1:], np.arange(1, len(self.parent))], axis=1).astype(np.int32)

    def bent(self, turns: np.ndarray, length: np.ndarray | None = None) -> np.ndarray:
        """Return positions (T, N, 3) of stems that bend by rotation vectors (T, B, 3), in radians, spread evenly from
        each stem's base to its tip. A stem also turns with its parent; `length` (T, B) multiplies the lengths of its
        elements.
        """
        share = 1.0 / np.bincount(self.branch)[self.branch]
        positions = np.empty((len(turns), len(self.parent), 3))
        frames = np.empty((len(self.parent), len(turns), 3, 3))
        for node, (below, branch) in enumerate(zip(self.parent.tolist(), self.branch.tolist(), strict=True)):
            turn = rotations(share[node] * turns[:, branch])
            frames[node] = turn if below < 0 else frames[below] @ turn
            step = frames[node] @ self.element[node]
            if length is not None:
                step *= length[:, branch, None]
            positions[:, node] = step if below < 0 else positions[:, below] + step
        return positions


def gusty(time: np.ndarray, branches: int, amount: float, lean: float, rng: np.random.Generator) -> np.ndarray:
    """Return rotation vectors (T, B, 3), in radians, of `branches` stems in gusts at times (T,) in seconds. Both the
    constant lean and the gusts, of the size `amount`, turn about one horizontal axis.
    """
    across = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    seen = time[:, None] - rng.uniform(0.0, LATEST, branches)  # each stem's own time in the gusts
    phase = rng.uniform(0, 2 * np.pi, GUSTS)
    gust = np.sin(2 * np.pi * rng.uniform(*GUST_HERTZ, GUSTS) * seen[..., None] + phase).mean(axis=-1)
    along_own_axis = np.sin(
        2 * np.pi * rng.uniform(*STEM_HERTZ, branches) * time[:, None] + rng.uniform(0, 2 * np.pi, branches)
    )
    axes = rng.normal(size=(branches, 3))
    strength = rng.uniform(0.5, 1.5, branches)
    along = (lean * strength + 2.0 * amount * strength * gust)[..., None] * across
    return along + 0.3 * amount * along_own_axis[..., None] * axes


def swaying(
    bones: Bones, frames: int, rng: np.random.Generator, amount: float = 0.15, lean: float = 0.0, fps: float = FPS
) -> np.ndarray:
    """Return (T, N, 3) positions in wind."""
    time = np.arange(frames) / fps
    return bones.bent(gusty(time, len(bones.branch_parent), amount, lean, rng))


def clip_of(bones: Bones, positions: np.ndarray, fps: float = FPS, rest: np.ndarray | None = None) -> MotionClip:
    """Return positions (T, N, 3) as a clip with named branches at `fps` frames per second. `rest` (N, 3) is the rest
    pose, by default that of the bones.
    """
    return MotionClip(
        positions.astype(np.float32),
        np.arange(len(positions)) / fps,
        bones.branch,
        bones.branch_parent,
        rest=(bones.rest if rest is None else rest).astype(np.float32),
        edges=bones.edges,
        metadata={"unit": "m", "up_axis": "y", "fps": fps},
    )


def swaying_tree(
    seed: int, frames: int, vertices: int, orders: int = 2, amount: float = 0.15, fps: float = FPS
) -> MotionClip:
    """Return a tree of 8 m that sways."""
    bones = Bones.of(grow(vertices, orders, 8.0, seed))
    return clip_of(bones, swaying(bones, frames, np.random.default_rng(seed), amount, fps=fps), fps)


def moved_tree(seed: int, frames: int, vertices: int, every: int) -> MotionClip:
    """Return a tree that sways and is put down elsewhere every so many frames."""
    clip = swaying_tree(seed, frames, vertices)
    places = np.random.default_rng([seed, 1]).uniform(-20, 20, (-(-frames // every), 3)) * [1, 0, 1]
    return clip.replace(positions=(clip.positions + places[np.arange(frames) // every, None]).astype(np.float32))


def held_tree(seed: int, frames: int, vertices: int, repeats: int) -> MotionClip:
    """Return a tree that sways and keeps each pose for so many frames."""
    clip = swaying_tree(seed, -(-frames // repeats), vertices, fps=FPS / repeats)
    return clip.replace(positions=np.repeat(clip.positions, repeats, axis=0)[:frames], time=np.arange(frames) / FPS)


def far_tree(seed: int, frames: int, vertices: int, distance: float) -> MotionClip:
    """Return a tree in centimetres that sways so far from the origin that float32 leaves few bits for its motion."""
    clip = swaying_tree(seed, frames, vertices)
    place = np.array([1.0, 0.0, 0.0]) * distance
    positions, rest = ((100.0 * array + place).astype(np.float32) for array in (clip.positions, clip.rest))
    return clip.replace(positions=positions, rest=rest, metadata=clip.metadata | {"unit": "cm"})


def scanned_tree(seed: int, frames: int, stems: int, longest: int, lean: float) -> MotionClip:
    """Return a tree as scans give it, a trunk and short stems of one to a few vertices, blown far from its rest
    pose."""
    rng = np.random.default_rng(seed)
    bones = _twiggy(rng, stems, longest)
    return clip_of(bones, swaying(bones, frames, rng, 0.15, lean))


def _twiggy(rng: np.random.Generator, stems: int, longest: int, trunk: int = 12) -> Bones:
    """Return a plant of `stems` stems. Every stem but the trunk, which has `trunk` vertices, has 1 to `longest`
    vertices and stands on the trunk or on one of the last stems before it.
    """
    below = np.concatenate([[-1], [_host(rng, stem) for stem in range(1, stems)]]).astype(np.int32)
    count = np.concatenate([[trunk], rng.integers(1, longest + 1, stems - 1)])
    first = np.cumsum(count) - count
    parent = np.arange(-1, count.sum() - 1)
    parent[first[1:]] = first[below[1:]] + rng.integers(0, count[below[1:]])
    heading = rng.normal(size=(stems, 3)) + [0.0, 0.5, 0.0]
    heading[0] = [0.0, 1.0, 0.0]
    heading /= np.linalg.norm(heading, axis=1, keepdims=True)
    length = rng.uniform(0.1, 1.5, stems) / count
    length[0] = 8.0 / trunk
    branch = np.repeat(np.arange(stems, dtype=np.int32), count)
    element = heading[branch] * length[branch, None]
    element[0] = 0.0
    return Bones(parent.astype(np.int32), branch, below, element)


def _host(rng: np.random.Generator, stem: int, near: int = 40) -> int:
    return int(rng.integers(max(0, stem - near), stem)) if rng.random() < 0.7 else 0
