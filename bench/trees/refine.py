"""More vertices on a simulated plant: stems refined by splines, and twigs that ride on the outer ones.

Between two nodes of a stem come vertices on the Catmull-Rom spline through its nodes (Catmull and Rom, "A
class of local interpolating splines", Computer Aided Geometric Design, 1974), in rest pose and motion alike.
Twigs are carried by the element below them and bend in the wind. It serves to measure scaling: the refined
stems have no motion of their own.
"""

from __future__ import annotations

import numpy as np

from athcodec import MotionClip
from bench.trees.ride import BLOCK_FRAMES, Skeleton, drag_at, limited, rotations, sideways, sway
from bench.trees.wind import Wind

TWIG_LENGTH = 0.03  # Length over the plant's height.
TWIG_ANGLE = np.radians(50.0)
TWIG_BEND = 0.3  # rad at the tip in the mean wind
TWIG_HERTZ = (1.5, 4.0)
TWIG_DAMPING = 0.1


def refine(
    clip: MotionClip, wind: Wind, frames: int, factor: int, twigs: int, twig_vertices: int, seed: int
) -> MotionClip:
    """The first frames of a simulated clip, with `factor` vertices per element, and with twigs."""
    skeleton = Skeleton.of(clip, frames)
    spline = Splines(skeleton, factor)
    riders = _Twigs(skeleton, spline, wind, twigs, twig_vertices, np.random.default_rng(seed))
    count = spline.count + twigs * twig_vertices
    positions = np.empty((frames, count, 3), np.float32)
    for start in range(0, frames, BLOCK_FRAMES):
        block = slice(start, start + BLOCK_FRAMES)
        nodes = skeleton.positions[block]
        positions[block, : spline.count] = spline.apply(nodes)
        positions[block, spline.count :] = riders.at(positions[block], nodes, riders.bend[block])
    rest = np.empty((count, 3), np.float32)
    rest[: spline.count] = spline.apply(skeleton.rest)
    rest[spline.count :] = riders.at(rest, skeleton.rest, np.zeros((twigs, 3)))
    return MotionClip(
        positions=positions,
        time=skeleton.time,
        rest=rest,
        vertex_branch=np.concatenate([spline.branch, riders.branch]),
        branch_parent=np.concatenate([skeleton.branch_parent, spline.branch[riders.foot]]),
        edges=np.concatenate([spline.edges, riders.edges]).astype(np.int32),
        metadata=dict(clip.metadata),
    )


class Splines:
    """Vertices as weighted sums of four nodes; node i of the skeleton is vertex factor * i."""

    def __init__(self, skeleton: Skeleton, factor: int) -> None:
        self.count = factor * (len(skeleton.parent) - 1) + 1
        self.node = -(-np.arange(self.count) // factor)
        self.branch = skeleton.branch[self.node]
        self.share = ((np.arange(self.count) - 1) % factor + 1) / factor
        self.controls, self.weights = _controls(skeleton, self.node, self.share)
        below = np.arange(-1, self.count - 1)
        below[1::factor] = factor * skeleton.parent[1:]
        self.edges = np.stack([below[1:], np.arange(1, self.count)], axis=1)

    def apply(self, nodes: np.ndarray) -> np.ndarray:
        """(..., count, 3) vertices from (..., N, 3) nodes."""
        return sum(nodes[..., self.controls[:, k], :] * self.weights[:, k : k + 1] for k in range(4))


def _controls(skeleton: Skeleton, node: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(V, 4) nodes and weights of vertices that lie at the fractions t of the elements below `node`."""
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


class _Twigs:
    """Straight twigs at random places of the outer stems, each bending about its foot."""

    def __init__(
        self, skeleton: Skeleton, spline: Splines, wind: Wind, twigs: int, vertices: int, rng: np.random.Generator
    ) -> None:
        self.skeleton = skeleton
        places = np.flatnonzero(np.isin(spline.node, skeleton.outer_nodes()))
        self.foot = np.sort(rng.choice(places, twigs, replace=twigs > len(places)))
        self.node = spline.node[self.foot]
        below = skeleton.direction(skeleton.rest, self.node)
        direction = sideways(below, rng.uniform(0, 2 * np.pi, twigs), TWIG_ANGLE)
        length = TWIG_LENGTH * skeleton.height * rng.uniform(0.6, 1.4, twigs)
        self.share = np.arange(1, vertices + 1) / vertices
        self.axis = direction * length[:, None]
        number = np.arange(twigs * vertices).reshape(twigs, vertices) + spline.count
        self.edges = np.stack([np.column_stack([self.foot, number[:, :-1]]), number], axis=2).reshape(-1, 2)
        self.branch = np.repeat(len(skeleton.branch_parent) + np.arange(twigs), vertices)
        drag = drag_at(wind, skeleton.positions[:, self.node], skeleton.time)
        torque = TWIG_BEND * np.cross(_carried(skeleton, self.node, direction), drag)
        step = 1.0 if len(skeleton.time) < 2 else skeleton.time[1] - skeleton.time[0]
        self.bend = limited(sway(torque, rng.uniform(*TWIG_HERTZ, twigs), TWIG_DAMPING, step))

    def at(self, vertices: np.ndarray, nodes: np.ndarray, bend: np.ndarray) -> np.ndarray:
        """(..., twigs * their vertices, 3) from refined stems, nodes and (..., twigs, 3) rotation vectors."""
        axis = np.einsum("...ij,...j->...i", self.skeleton.turns(nodes, self.node), self.axis)
        # piece by piece, each turned further than the one before it, so that a twig keeps its length
        pieces = [np.einsum("...ij,...j->...i", rotations(share * bend), axis) for share in self.share]
        offsets = np.cumsum(np.stack(pieces, axis=-2), axis=-2) / len(self.share)
        points = vertices[..., self.foot, None, :] + offsets
        return points.reshape(*points.shape[:-3], -1, 3)


def _carried(skeleton: Skeleton, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """(T, M, 3) vectors of the rest pose as the nodes' elements carry them."""
    starts = range(0, len(skeleton.positions), BLOCK_FRAMES)
    turns = (skeleton.turns(skeleton.positions[start : start + BLOCK_FRAMES], nodes) for start in starts)
    return np.concatenate([np.einsum("tmij,mj->tmi", block, vectors) for block in turns])
