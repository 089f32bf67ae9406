"""Plants of the forest's floor, in winds that repeat: a tuft of grass, and a fern of hinged pinnae on arching fronds.

Blades and fronds are beams (see beams.py) on feet about one root, thin enough to give way as the plants do; the wind is
that of the trees above them, which is weaker near the ground. Texture coordinates are those of leafed.py.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from athcodec import MotionClip
from bench.trees.beams import bend
from bench.trees.leafed import SETTLING_SECONDS, SHADES, in_winds, leaf_uv
from bench.trees.leaves import Leaves, Species, sheet
from bench.trees.mesh import Tubes, bark_uv
from bench.trees.plant import UP, Plant
from bench.trees.ride import BLOCK_FRAMES, Skeleton
from bench.trees.wind import Wind

WIND_HEIGHT = 9.0  # m, at which the winds' speeds are meant
FOOT_STIFFER = 12.0  # radius of what joins a stem to the root, over the stem's

PINNA = sheet([0.0, 0.45, 1.0], [0.11, 0.14, 0.02], [0.0, 0.03, -0.06])
PINNAE = Species(*PINNA, 1.0, 0.2, 0.4, (10.0, 6.0, 8.0), 0.7)
RACHIS_SIDES = 3


@dataclass(frozen=True)
class Arch:
    """S stems in vertical planes, rising at one angle from the vertical and ending at another.

    foot     (S,) distance from the root, m
    azimuth  (S,)
    length   (S,) m
    start    (S,) angle from the vertical at the foot
    end      (S,) at the tip
    radius   (S,) m, of a round rod that bends as the stem does
    """

    foot: np.ndarray
    azimuth: np.ndarray
    length: np.ndarray
    start: np.ndarray
    end: np.ndarray
    radius: np.ndarray

    @property
    def side(self) -> np.ndarray:
        """(S, 3) across the stems' planes."""
        return np.stack([-np.sin(self.azimuth), np.zeros(len(self.azimuth)), np.cos(self.azimuth)], axis=1)

    def plant(self, count: int) -> Plant:
        """Return the plant of the arched stems, each with a foot on the ground and `count` nodes above it."""
        stems, share = len(self.foot), (np.arange(count) + 0.5) / count
        away = np.stack([np.cos(self.azimuth), np.zeros(stems), np.sin(self.azimuth)], axis=1)
        angle = self.start[:, None] + (self.end - self.start)[:, None] * share**1.4
        step = np.sin(angle)[..., None] * away[:, None] + np.cos(angle)[..., None] * UP
        along = np.cumsum(step * (self.length / count)[:, None, None], axis=1)
        feet = self.foot[:, None] * away
        points = np.concatenate([feet[:, None], feet[:, None] + along], axis=1)  # (S, 1 + count, 3)
        number = 1 + np.arange(stems * (1 + count)).reshape(stems, 1 + count)
        parent = np.concatenate([np.zeros((stems, 1), int), number[:, :-1]], axis=1)
        radius = self.radius[:, None] * np.concatenate([[FOOT_STIFFER], 1 - 0.6 * share])
        foliage = np.tile(np.arange(1 + count) > 0, (stems, 1)) / (stems * count)
        return Plant(
            np.concatenate([[-1], parent.ravel()]).astype(np.int32),
            np.concatenate([[0], np.repeat(np.arange(stems), 1 + count)]).astype(np.int32),
            np.concatenate([[-1], np.zeros(stems - 1, np.int32)]).astype(np.int32),
            np.concatenate([np.zeros((1, 3)), points.reshape(-1, 3)]),
            np.concatenate([[self.radius.max() * FOOT_STIFFER], radius.ravel()]),
            np.concatenate([[0.0], foliage.ravel()]),
        )


def grass(blades: int, height: float, frames: int, winds: Mapping[str, float], seed: int, fps: float) -> MotionClip:
    """Return a tuft of grass of `blades` blades, with one loop of `frames` frames for each of `winds`: names with
    speeds in m/s.
    """
    count = 6
    rng = np.random.default_rng(seed)
    far = np.sqrt(rng.uniform(0.01, 1, blades))
    length = height * rng.uniform(0.55, 1.15, blades) * (1.1 - 0.25 * far)
    arch = Arch(
        0.13 * height * far,
        rng.uniform(0, 2 * np.pi, blades),
        length,
        0.04 + 0.3 * far * rng.uniform(0.5, 1.2, blades),
        0.3 + 1.0 * far * rng.uniform(0.4, 1.2, blades),
        0.0019 * height * rng.uniform(0.94, 1.12, blades) * length / height,
    )
    plant = arch.plant(count)
    ribbons = _Ribbons(plant, arch, count, height, rng)
    return in_winds(
        lambda wind: ribbons.clip(bend(plant, wind, frames, fps, spin_up=SETTLING_SECONDS), fps),
        *(winds, WIND_HEIGHT, frames, fps, seed),
    )


def _skeleton(plant: Plant, nodes: np.ndarray, radius: np.ndarray, fps: float) -> Skeleton:
    """Return the plant with nodes at these places in each frame, and stems of this radius."""
    rest, time = plant.position.astype(np.float32), np.arange(len(nodes)) / fps
    return Skeleton(nodes, rest, plant.parent, plant.branch, plant.branch_parent, radius, time)


class _Ribbons:
    """Two vertices across each node of a blade, that end in a point."""

    def __init__(self, plant: Plant, arch: Arch, count: int, height: float, rng: np.random.Generator) -> None:
        """Make the blades of a tuft of grass: ribbons along arched stems of 1 + `count` nodes, with random widths and
        twists.
        """
        blades = len(arch.foot)
        self.plant, self.count = plant, count
        share = np.arange(1 + count) / count
        wide = (0.45 + 1.4 * share) * np.minimum(1, 1.06 - share) ** 0.75
        width = 0.016 * height * rng.uniform(0.7, 1.3, blades)[:, None] * wide
        twist = rng.normal(0, 0.5, blades)[:, None] + rng.normal(0, 0.6, blades)[:, None] * share
        self.node = np.delete(np.arange(len(plant.parent)), 0)
        carrier = self.node.reshape(blades, 1 + count).copy()
        carrier[:, 0] += 1  # a foot's own element lies on the ground
        self.carrier = carrier.ravel()
        self.branch = np.repeat(np.arange(blades), 2 * (1 + count))
        skeleton = _skeleton(plant, plant.position[None].astype(np.float32), plant.radius, 1.0)
        tangent = skeleton.direction(skeleton.rest, self.carrier).reshape(blades, 1 + count, 3)
        side = np.repeat(arch.side[:, None], 1 + count, axis=1)
        out = np.cross(side, tangent)
        across = np.cos(twist)[..., None] * side + np.sin(twist)[..., None] * out
        half = (0.5 * width[..., None] * across).reshape(-1, 1, 3)
        self.offsets = np.concatenate([-half, half], axis=1)  # (nodes, 2, 3)
        first = 2 * (1 + count) * np.arange(blades)[:, None, None] + 2 * np.arange(count)[:, None]
        self.faces = (first + [0, 1, 3, 2]).reshape(-1, 4)
        self.uv = leaf_uv(share, rng.integers(0, SHADES, blades))

    def clip(self, nodes: np.ndarray, fps: float) -> MotionClip:
        """Return the clip of ribbons that follow the nodes (T, N, 3) of their stems."""
        skeleton = _skeleton(self.plant, nodes, self.plant.radius, fps)
        return MotionClip(
            positions=self._at(skeleton, nodes),
            time=skeleton.time,
            rest=self._at(skeleton, skeleton.rest),
            vertex_branch=self.branch,
            branch_parent=np.full(self.branch[-1] + 1, -1),
            faces=self.faces.astype(np.int32),
            attributes={"uv": self.uv.astype(np.float32)},
            metadata={"unit": "m", "up_axis": "y", "fps": fps, "surfaces": "stalks, blades"},
        )

    def _at(self, skeleton: Skeleton, nodes: np.ndarray) -> np.ndarray:
        turned = np.einsum("...nij,nkj->...nki", skeleton.turns(nodes, self.carrier), self.offsets)
        points = nodes[..., self.node, None, :] + turned
        return points.reshape(*nodes.shape[:-2], -1, 3).astype(np.float32)


def fern(
    fronds: int, pairs: int, height: float, frames: int, winds: Mapping[str, float], seed: int, fps: float
) -> MotionClip:
    """Return a fern of `fronds` fronds with `pairs` pairs of pinnae each, with one loop of `frames` frames for each of
    `winds`: names with speeds in m/s.
    """
    rng = np.random.default_rng(seed)
    inner = np.arange(fronds) / fronds  # the younger fronds stand steeper
    arch = Arch(
        height * 0.03 * rng.uniform(0.6, 1.2, fronds),
        2.399963 * np.arange(fronds) + rng.normal(0, 0.15, fronds),
        height * (1.3 - 0.35 * inner) * rng.uniform(0.9, 1.1, fronds),
        0.6 - 0.45 * inner + rng.normal(0, 0.05, fronds),
        1.9 - 0.75 * inner + rng.normal(0, 0.1, fronds),
        0.0052 * height * rng.uniform(0.9, 1.15, fronds),
    )
    plant = arch.plant(pairs + 2)
    return in_winds(
        lambda wind: _Fern(
            plant, arch, bend(plant, wind, frames, fps, spin_up=SETTLING_SECONDS), fps, np.random.default_rng(seed)
        ).clip(wind),
        *(winds, WIND_HEIGHT, frames, fps, seed),
    )


class _Pinnae(Leaves):
    """In pairs along the fronds, in the fronds' plane and a little above it."""

    steps = 24

    def __init__(self, skeleton: Skeleton, arch: Arch, rng: np.random.Generator) -> None:
        """Put two pinnae (leaflets) on each upper node of a fern's fronds, with directions and lengths that change
        along the frond.
        """
        self.skeleton, self.species = skeleton, PINNAE
        fronds = len(arch.foot)
        each = (len(skeleton.parent) - 1) // fronds
        place = np.arange(3, each)  # above the foot and two nodes of bare stalk
        self.node = np.sort(np.tile((1 + each * np.arange(fronds)[:, None] + place).ravel(), 2))
        count = len(self.node)
        frond = (self.node - 1) // each
        share = ((self.node - 1) % each - 2) / (each - 3)  # 0 to 1, of the leafy part
        way = np.where(np.arange(count) % 2, 1.0, -1.0)
        tangent = skeleton.direction(skeleton.rest, self.node)
        side = arch.side[frond] * way[:, None]
        above = np.cross(arch.side[frond], tangent)
        above *= np.sign(above[:, 1:2])
        angle = 1.35 - 0.6 * share + rng.normal(0, 0.05, count)
        axis = np.cos(angle)[:, None] * tangent + np.sin(angle)[:, None] * side + 0.18 * above
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        across = np.cross(above, axis)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        self.axes = np.stack([axis, across, np.cross(axis, across)], axis=2)
        shape = (1.04 - share) ** 0.85 * np.minimum(1, 0.55 + 1.6 * share)
        self.length = 0.3 * arch.length[frond] * np.maximum(shape, 0.2) * rng.uniform(0.92, 1.08, count)
        self.stiffness = rng.uniform(0.8, 1.3, count)


class _Fern:
    """A moving fern; the motion of its fronds is taken twice over: pinnae settle in the first round."""

    def __init__(self, plant: Plant, arch: Arch, nodes: np.ndarray, fps: float, rng: np.random.Generator) -> None:
        """Dress the simulated nodes (T, N, 3) of a fern's fronds with tubes and pinnae."""
        self.frames, self.fps = len(nodes), fps
        twice = np.concatenate([nodes, nodes])
        drawn = np.where(plant.radius > 2 * arch.radius.max(), 2.2, 1.5 / arch.radius.max() * plant.radius)
        self.skeleton = _skeleton(plant, twice, drawn * arch.radius.max(), fps)
        self.tubes = Tubes(self.skeleton, RACHIS_SIDES)
        self.pinnae = _Pinnae(self.skeleton, arch, rng)
        self.shade = np.repeat(rng.integers(0, SHADES, len(arch.foot)), len(self.pinnae.node) // len(arch.foot))

    def clip(self, wind: Wind) -> MotionClip:
        """Return one loop of the fern in a wind, as a mesh of stalks and pinnae."""
        skeleton, pinnae, frames = self.skeleton, self.pinnae, self.frames
        turns = pinnae.flown(wind)[frames:]
        blocks = [slice(start, min(start + BLOCK_FRAMES, frames)) for start in range(0, frames, BLOCK_FRAMES)]
        each = len(pinnae.species.blade)
        leaf_branch = len(skeleton.branch_parent) + np.repeat(np.arange(len(pinnae.node)), each)
        along = pinnae.species.blade[::2, 0]
        return MotionClip(
            positions=np.concatenate([self._at(skeleton.positions[block], turns[block]) for block in blocks]),
            time=np.arange(frames) / self.fps,
            rest=self._at(skeleton.rest, pinnae.unturned()),
            vertex_branch=np.concatenate([self.tubes.branch, leaf_branch]),
            branch_parent=np.concatenate([skeleton.branch_parent, skeleton.branch[pinnae.node]]),
            faces=np.concatenate([self.tubes.faces, self.tubes.count + pinnae.faces]).astype(np.int32),
            attributes={
                "uv": np.concatenate([bark_uv(skeleton, self.tubes), leaf_uv(along, self.shade)]).astype(np.float32)
            },
            metadata={"unit": "m", "up_axis": "y", "fps": self.fps, "surfaces": "stalks, pinnae"},
        )

    def _at(self, nodes: np.ndarray, turns: np.ndarray) -> np.ndarray:
        return np.concatenate([self.tubes.at(nodes), self.pinnae.at(nodes, turns)], axis=-2).astype(np.float32)
