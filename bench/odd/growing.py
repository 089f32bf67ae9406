"""Plants that grow: branches that come out one after the other, with and without wind, and leaves that unfold on a twig
or on a young tree."""

from __future__ import annotations

import numpy as np

from athcodec import MotionClip
from bench.odd.bending import FPS, Bones, clip_of, gusty
from bench.trees.leafed import SHADES, leaf_uv
from bench.trees.leaves import LEAF_ANGLE, sheet
from bench.trees.mesh import Tubes, bark_uv
from bench.trees.plant import grow
from bench.trees.ride import Skeleton, rotations, sideways

PARTS = 4  # Parts of the clip: trunk, orders 1 and 2 on each other, and rest.
HELD = 1.0  # Seconds at the end of growth without a stop, in which nothing moves.
WOOD = 0.8  # Share of the time of growth after which a sapling's branches have their lengths.


def growth(
    seed: int, frames: int, vertices: int, eased: bool = False, carried: bool = False, flowing: bool = False
) -> MotionClip:
    """Return a tree of `vertices` vertices whose branches grow out of their parents one by one. A branch begins when
    its parent has stopped, or with `flowing` as soon as the parent's tip has passed.

    A branch that has not begun waits where it will be attached, or with `carried` at the growing tip of its parent.
    `eased` lets growth begin and end slowly.
    """
    bones = Bones.of(grow(vertices, 2, 8.0, seed))
    rng = np.random.default_rng(seed)
    times = flowing_begin_and_end(bones, frames, rng) if flowing else begin_and_end(bones, frames, rng)
    grown = growing(times, frames, eased)
    if carried:
        return clip_of(bones, bones.bent(np.zeros((*grown.shape, 3)), grown))
    rest = bones.rest
    base = rest[attach_node(bones)[bones.branch]]
    return clip_of(bones, base + grown[:, bones.branch, None] * (rest - base))


def growth_in_wind(seed: int, frames: int, vertices: int, amount: float = 0.15) -> MotionClip:
    """Return a tree whose branches grow out of their parents, on which they are carried, while all that is there
    sways."""
    bones = Bones.of(grow(vertices, 2, 8.0, seed))
    rng = np.random.default_rng(seed)
    grown = growing(begin_and_end(bones, frames, rng), frames, eased=True)
    turns = gusty(np.arange(frames) / FPS, len(bones.branch_parent), amount, 0.0, rng)
    return clip_of(bones, bones.bent(turns, grown))


def attach_node(bones: Bones) -> np.ndarray:
    """Return (B,) the node that each branch grows out of; the root for the trunk."""
    first = np.unique(bones.branch, return_index=True)[1]
    return np.maximum(bones.parent[first], 0)


def begin_and_end(bones: Bones, frames: int, rng: np.random.Generator) -> np.ndarray:
    """Return the frames (B, 2) at which each branch begins and stops growing. A branch begins after its parent has
    stopped, the earlier the lower it stands on the parent.
    """
    part = frames / PARTS
    times = np.zeros((len(bones.branch_parent), 2))
    times[0] = part * np.array([0.1, 0.8])
    node = attach_node(bones)
    for branch, below in enumerate(bones.branch_parent[1:].tolist(), start=1):
        along = bones.branch == below
        height = (node[branch] - np.flatnonzero(along)[0]) / along.sum()
        begin = times[below, 1] + part * rng.uniform(0.0, 0.1) + 0.5 * part * height
        times[branch] = begin, begin + part * rng.uniform(0.3, 0.5)
    return times


def flowing_begin_and_end(bones: Bones, frames: int, rng: np.random.Generator) -> np.ndarray:
    """Return the frames (B, 2) at which each branch begins and stops growing. A branch begins as the eased tip of its
    parent passes, so that something grows in every frame but those of the last second.
    """
    times = np.zeros((len(bones.branch_parent), 2))
    times[0] = 0.0, 1.0
    node = attach_node(bones)
    for branch, below in enumerate(bones.branch_parent[1:].tolist(), start=1):
        along = bones.branch == below
        height = (node[branch] - np.flatnonzero(along)[0] + 1) / along.sum()
        begin, end = times[below]
        passed = 0.5 - np.sin(np.arcsin(1.0 - 2.0 * min(height, 1.0)) / 3.0)  # where 3 x^2 - 2 x^3 is the height
        times[branch, 0] = begin + (end - begin) * passed
        times[branch, 1] = times[branch, 0] + (end - begin) * rng.uniform(0.5, 0.9)
    return times / times.max() * (frames - 1 - HELD * FPS)


def growing(begin_and_end: np.ndarray, frames: int, eased: bool) -> np.ndarray:
    """Return (T, B) lengths of the branches, from 0 to 1, in a straight line or `eased` at both ends."""
    begin, end = begin_and_end.T
    share = np.clip((np.arange(frames)[:, None] - begin) / (end - begin), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share) if eased else share


SIDES, STOUT, TIP = (
    6,
    1.4,
    0.15,
)  # Of a sapling's bark: vertices of a ring, radius over that of a tree, and of its tips.
SPROUT = 0.3  # Part of its radius that a branch has as soon as it is out.
LEAF_LENGTH, LEAF_WIDTH = 0.085, 0.62  # Length of a sapling's leaf over its height; width over length.
BUD = 0.9  # Radians by which a closed leaf lies nearer to its twig.


def sapling(seed: int, frames: int, nodes: int, leaves: int, height: float = 2.0) -> MotionClip:
    """Return a young tree with bark, `height` metres high. Branches come out as the tips of their parents pass and
    thicken to the end; leaves unfold, small at first, where a branch has stopped growing.
    """
    plant, rng = grow(nodes, 2, height, seed), np.random.default_rng(seed)
    bones, last = Bones.of(plant), frames - 1 - HELD * FPS
    times = WOOD * flowing_begin_and_end(bones, frames, rng)
    grown = growing(times, frames, eased=True)
    moved, time = bones.bent(np.zeros((*grown.shape, 3)), grown), np.arange(frames) / FPS
    skeleton = Skeleton(moved, bones.rest, plant.parent, plant.branch, plant.branch_parent, STOUT * plant.radius, time)
    tubes = Tubes(skeleton, SIDES)
    begin = times[:, 0]
    thick = SPROUT * growing(np.stack([begin, begin + 0.1 * last], axis=1), frames, eased=True)
    thick += (1.0 - SPROUT) * growing(np.stack([begin, np.full(len(begin), last)], axis=1), frames, eased=True)
    is_tip = (np.diff(plant.branch, append=-1) != 0)[tubes.carrier] & (tubes.centre == tubes.carrier)
    circles = tubes.offsets * np.where(is_tip, TIP, 1.0)[:, None, None]
    bark = moved[:, tubes.centre, None] + thick[:, plant.branch[tubes.carrier], None, None] * circles
    node, blades = _sapling_leaves(skeleton, times[:, 1], last, leaves, LEAF_LENGTH * height, rng)
    quads = len(tubes.offsets) * SIDES + len(BLADE[0]) * np.arange(leaves)[:, None, None] + BLADE[1]
    positions = np.concatenate([each.reshape(frames, -1, 3) for each in (bark, blades)], axis=1).astype(np.float32)
    uv = leaf_uv(np.linspace(0, 1, len(BLADE[0]) // 2), rng.integers(0, SHADES, leaves))
    return MotionClip(
        positions,
        time,
        np.concatenate([tubes.branch, len(plant.branch_parent) + np.repeat(np.arange(leaves), len(BLADE[0]))]),
        np.concatenate([plant.branch_parent, plant.branch[node]]),
        rest=positions[-1],
        faces=np.concatenate([tubes.faces, quads.reshape(-1, 4)]).astype(np.int32),
        attributes={"uv": np.concatenate([bark_uv(skeleton, tubes), uv]).astype(np.float32)},
        metadata={"unit": "m", "up_axis": "y", "fps": FPS, "surfaces": "bark, leaves"},
    )


BLADE = sheet([0.0, 0.5, 1.0], [LEAF_WIDTH / 2] * 3, [0.0, 0.09, 0.0])


def _sapling_leaves(
    skeleton: Skeleton, ends: np.ndarray, last: float, count: int, length: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (count,) that `count` leaves stand on, and the leaves' vertices (T, count, V, 3). `ends` (B,)
    has the frames at which branches reach their lengths, `last` is the frame from which nothing moves, and `length` a
    leaf's length.
    """
    rest = skeleton.rest
    node = np.sort(rng.choice(np.flatnonzero((skeleton.branch > 0) | (rest[:, 1] > 0.8 * skeleton.height)), count))
    begin = np.minimum(ends[skeleton.branch[node]] * rng.uniform(0.75, 1.0, count), WOOD * last)
    end = np.minimum(begin + last * rng.uniform(0.15, 0.25, count), last)
    opened = growing(np.stack([begin, end], axis=1), len(skeleton.positions), eased=True)
    below = skeleton.direction(rest, node)
    along = sideways(below, 2.4 * np.arange(count), LEAF_ANGLE)
    across = np.cross(along, below)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    axes = np.stack([along, across, np.cross(along, across)], axis=1)
    blades = BLADE[0] * (length * rng.uniform(0.7, 1.3, count))[:, None, None]
    folded = rotations(-BUD * (1.0 - opened)[..., None] * across)
    vertices = opened[..., None, None] * np.einsum("lvk,lki,tlji->tlvj", blades, axes, folded)
    return node, skeleton.positions[:, node, None] + vertices


ROWS, WIDE = 6, 3  # vertices of a leaf along and across


def unfolding_leaves(seed: int, frames: int, leaves: int) -> MotionClip:
    """Return a twig whose leaves, folded at the midrib and rolled up at first, open and stretch out one after the
    other.
    """
    rng = np.random.default_rng(seed)
    twig = np.linspace(0.0, 1.0, leaves + 1)[:, None] * [0.1, 1.0, 0.0]
    open_share = np.clip((np.arange(frames)[:, None] / frames - np.linspace(0.05, 0.7, leaves)) / 0.2, 0.0, 1.0)
    open_share = open_share * open_share * (3.0 - 2.0 * open_share)
    blades = _leaves(twig[1:], open_share, rng)
    still = np.broadcast_to(twig, (frames, *twig.shape))
    positions = np.concatenate([still, blades.reshape(frames, -1, 3)], axis=1).astype(np.float32)
    size = ROWS * WIDE
    corner = np.arange(size).reshape(ROWS, WIDE)
    quads = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    return MotionClip(
        positions,
        np.arange(frames) / FPS,
        np.repeat(np.arange(leaves + 1), [leaves + 1] + [size] * leaves),
        np.concatenate([[-1], np.zeros(leaves, int)]),
        rest=positions[-1],
        faces=(len(twig) + size * np.arange(leaves)[:, None, None] + quads).reshape(-1, 4).astype(np.int32),
        metadata={"unit": "m", "up_axis": "y", "fps": FPS},
    )


def _leaves(feet: np.ndarray, open_share: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return vertices (T, leaves, ROWS, WIDE, 3) of leaves whose feet are at `feet` (leaves, 3). `open_share` (T,
    leaves) runs from 0, folded and rolled up, to 1, open.
    """
    count = len(feet)
    closed = 1.0 - open_share[..., None]
    curl = (1.2 * closed + 0.05) * np.arange(ROWS)  # the angle of each row, rolled up by up to 6 rad
    steps = np.stack([np.cos(curl), 0 * curl, np.sin(curl)], axis=-1)
    midrib = np.cumsum(steps, axis=2) / ROWS
    upwards = np.stack([-np.sin(curl), 0 * curl, np.cos(curl)], axis=-1)
    fold = 1.4 * closed + 0.1
    width = 0.35 * np.sin(np.pi * (np.arange(ROWS) + 0.5) / ROWS)
    side = np.arange(WIDE) - WIDE // 2
    across = (width * np.cos(fold))[..., None] * [0.0, 1.0, 0.0]
    lift = (width * np.sin(fold))[..., None] * upwards
    blade = midrib[..., None, :] + side[:, None] * across[..., None, :] + np.abs(side)[:, None] * lift[..., None, :]
    blade *= 0.15 * rng.uniform(0.8, 1.2, count)[:, None, None, None] * (0.3 + 0.7 * open_share[..., None, None, None])
    azimuth = 2.4 * np.arange(count)
    along = sideways(np.tile([0.0, 1.0, 0.0], (count, 1)), azimuth, np.radians(60.0))
    beside = np.cross([0.0, 1.0, 0.0], along)
    beside /= np.linalg.norm(beside, axis=1, keepdims=True)
    axes = np.stack([along, beside, np.cross(along, beside)], axis=1)
    droop = rotations((0.6 * closed) * beside)  # a closed leaf stands upright
    return feet[:, None, None] + np.einsum("tlrwa,lak,tljk->tlrwj", blade, axes, droop)
