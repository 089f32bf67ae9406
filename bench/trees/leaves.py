"""Leaves in turbulent wind: rigid blades hinged on a moving plant by elastic stalks.

A leaf has three degrees of freedom, the turns about its hinge: up and down, sideways, and about its own axis. The wind
relative to its moving middle presses on it as on a flat plate (force and point of attack after Rayleigh, "On the
resistance of fluids", Philosophical Magazine 2(13), 1876), so it lines up with the wind and, where the stalk lets it
turn, flutters: the force attacks ahead of the middle. The stalk answers with a spring that stiffens, and a damper.
Leaves are light, so the air around a blade counts as mass, and springs, dampers and the air's drag are taken
implicitly, at which a step of 1/240 s is stable. Blades that stand in the lee of others get less wind. All that two
neighbours do alike is the gust that both feel. No leaf touches another or pushes the plant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.trees.beams import AIR
from bench.trees.ride import Skeleton, sideways
from bench.trees.wind import DIRECTION, Wind

LEAF_ANGLE = np.radians(60.0)  # to its twig
STEPS = 8  # Time steps of a frame.
WIND_STEPS = 2  # evaluations of the wind in a frame
SETTLING_FRAMES = 30  # before the first, on a plant that stands still
STIFFER = 0.7  # rad at which a stalk is twice as stiff
LEAST_WIND = 0.05  # m/s
LEE_CELL = 0.06  # Size over the plant's height.
LEE = 0.25  # logarithm of the wind's loss behind leaves that hide the view once

Air = Callable[[np.ndarray, float], np.ndarray]


@dataclass(frozen=True, eq=False)
class Species:
    """What all leaves of a plant have in common.

    blade    (V, 3) vertices along the leaf, across it and out of its plane, over the leaf's length; the hinge is at 0
    faces    (F, 4)
    length   over the plant's height; a leaf stands for a cluster of them
    width    of the blade, over the length
    weight   kg/m2
    hertz    of its turns about its axis, up and down, and sideways, in still air
    damping  of these, over critical
    """

    blade: np.ndarray
    faces: np.ndarray
    length: float
    width: float
    weight: float
    hertz: tuple[float, float, float]
    damping: float

    @property
    def middle(self) -> float:
        """Where the middle of the blade is along the leaf, as a share of its length from the hinge."""
        return float(np.ptp(self.blade[:, 0]) / 2 + self.blade[:, 0].min())

    @property
    def chord(self) -> float:
        """Length of the blade alone, over the leaf's length."""
        return float(np.ptp(self.blade[:, 0]))


def sheet(along: list[float], half: list[float], fold: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices in pairs across the leaf, and the quads between them."""
    pairs = [[(x, -y, z), (x, y, z)] for x, y, z in zip(along, half, fold, strict=True)]
    first = 2 * np.arange(len(along) - 1)[:, None]
    return np.array(pairs).reshape(-1, 3), first + [0, 1, 3, 2]


def _leaflets(places: list[tuple[float, float, float]], size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of one quad for each (along, across, angle), which points away by the angle."""
    card, quad = sheet([0.0, size], [0.2 * size, 0.2 * size], [0.0, 0.0])
    blades = []
    for along, across, angle in places:
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        blades.append(card @ turn.T + [along, across, 0.1 * abs(across)])
    return np.concatenate(blades), np.concatenate([quad + 4 * i for i in range(len(places))])


SPECIES = {
    "broadleaf": Species(
        *sheet([0.2, 0.65, 1.1], [0.22, 0.36, 0.12], [0.0, 0.05, -0.04]), 0.02, 0.6, 0.25, (6.0, 2.5, 3.2), 0.25
    ),
    # a long, flat stalk that hardly resists sideways turns and twist
    "poplar": Species(*sheet([0.45, 1.2], [0.33, 0.33], [0.0, 0.0]), 0.018, 0.66, 0.2, (1.8, 3.2, 1.4), 0.06),
    "compound": Species(
        *_leaflets([(0.25, 0.06, 0.9), (0.45, -0.06, -0.7), (0.65, 0.0, 0.0)], 0.6),
        *(0.035, 0.5, 0.35, (3.6, 1.7, 2.2), 0.2),
    ),
}


class Leaves:
    """Leaves at random nodes of a skeleton's outer stems, sorted by node; their turns over the skeleton's frames."""

    steps = STEPS  # small leaves, which the wind turns faster, take more

    def __init__(self, skeleton: Skeleton, species: Species, count: int, rng: np.random.Generator) -> None:
        """Put `count` leaves of a species on random outer nodes of a skeleton, with random directions, lengths and
        stiffness.
        """
        self.skeleton, self.species = skeleton, species
        self.node = np.sort(rng.choice(skeleton.outer_nodes(), count))
        below = skeleton.direction(skeleton.rest, self.node)
        axis = sideways(below, rng.uniform(0, 2 * np.pi, count), LEAF_ANGLE)
        across = np.cross(axis, below)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        self.axes = np.stack([axis, across, np.cross(axis, across)], axis=2)  # (L, 3, 3), columns
        self.length = species.length * skeleton.height * rng.uniform(0.7, 1.3, count)
        self.stiffness = rng.uniform(0.7, 1.4, count)

    def at(self, nodes: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """Return (..., V L, 3) vertices from (..., N, 3) nodes and (..., L, 4) quaternions."""
        local = np.einsum("...lij,vj->...lvi", _matrices(turns), self.species.blade) * self.length[:, None, None]
        carried = self.skeleton.turns(nodes, self.node) @ self.axes
        points = nodes[..., self.node, None, :] + np.einsum("...lij,...lvj->...lvi", carried, local)
        return points.reshape(*nodes.shape[:-2], -1, 3)

    @property
    def faces(self) -> np.ndarray:
        first = len(self.species.blade) * np.arange(len(self.node))[:, None, None]
        return (first + self.species.faces).reshape(-1, 4)

    def unturned(self) -> np.ndarray:
        """Return the unit quaternion of no rotation for each leaf, (L, 4)."""
        return np.repeat([[1.0, 0.0, 0.0, 0.0]], len(self.node), axis=0)

    def flown(self, wind: Wind) -> np.ndarray:
        """Return (T, L, 4) float32 quaternions, from the pose as grown to its own in the wind."""
        feet = self.skeleton.rest[self.node]
        share = sheltered(feet, self.area(), LEE_CELL * self.skeleton.height)[:, None]
        return self.turned(lambda points, seconds: share * wind.at(points, seconds), Plates(self))

    def area(self) -> np.ndarray:
        """Return the area of each leaf, (L,) in square metres."""
        return self.species.width * self.species.chord * self.length**2

    def turned(self, air: Air, plates: Plates) -> np.ndarray:
        """Return float32 quaternions (T, L, 4) of L leaves in the wind `air`, a function of positions and seconds.
        `plates` has the state at which the leaves begin.
        """
        frames = len(self.skeleton.time)
        step = 1.0 / 30.0 if frames < 2 else float(self.skeleton.time[1] - self.skeleton.time[0])
        turns = np.empty((frames, len(self.node), 4), np.float32)
        carriers = _Carriers(self)
        for frame in range(-SETTLING_FRAMES, frames):
            if frame >= 0:
                turns[frame] = plates.turn.T
            if frame == frames - 1:
                break
            start, end = carriers.at(frame), carriers.at(frame + 1)
            for part in range(self.steps):
                share = (part + 0.5) / self.steps
                foot, to_plate = (
                    (1 - share) * before + share * after for before, after in zip(start, end, strict=True)
                )
                if part % (self.steps // WIND_STEPS) == 0:
                    blowing = air(foot, (frame + share) * step)
                relative = blowing - (end[0] - start[0]) / step
                plates.step(np.einsum("lij,lj->il", to_plate, relative), step / self.steps)
        return turns


class _Carriers:
    """Where leaves are hinged, (L, 3), and what turns the world's vectors into those of the leaf at rest, (L, 3, 3)."""

    def __init__(self, leaves: Leaves) -> None:
        self.leaves = leaves
        self.known: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def at(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (L, 3) of the leaves' feet and the axes (L, 3, 3) of each leaf in a frame. The last two
        frames are kept.
        """
        frame = max(0, frame)
        if frame not in self.known:
            leaves, nodes = self.leaves, self.leaves.skeleton.positions[frame]
            turns = leaves.skeleton.turns(nodes, leaves.node) @ leaves.axes
            last = {frame - 1: self.known[frame - 1]} if frame - 1 in self.known else {}
            self.known = last | {frame: (nodes[leaves.node].astype(np.float64), turns.transpose(0, 2, 1))}
        return self.known[frame]


class Plates:
    """The state of L plates: quaternions (4, L) from the carrier's frame, angular velocities (3, L) in the plates'."""

    def __init__(self, leaves: Leaves) -> None:
        """Set the mass, stiffness and damping of rigid blades on hinges, for the leaves' sizes, with all blades at
        rest.
        """
        species, length = leaves.species, leaves.length
        count = len(length)
        self.turn = leaves.unturned().T.copy()
        self.speed = np.zeros((3, count))
        self.area = leaves.area()
        self.arm = species.middle * length
        self.width, self.chord = species.width * length, species.chord * length
        mass = self.area * (species.weight + np.pi / 4 * AIR * self.width)
        twist = mass * self.width**2 / 12
        bend = mass * (self.arm**2 + self.chord**2 / 12)
        # sideways a blade moves no air
        swing = self.area * species.weight * (self.arm**2 + (self.chord**2 + self.width**2) / 12)
        self.inertia = np.stack([twist, bend, swing])
        omega = 2 * np.pi * np.array(species.hertz)[:, None] * np.sqrt(leaves.stiffness)
        self.stiffness = self.inertia * omega**2
        self.damping = 2 * species.damping * self.inertia * omega

    def step(self, air: np.ndarray, seconds: float) -> None:
        """Advance the blades by `seconds`. `air` (3, L) is the wind relative to each hinge in m/s, in the axes of the
        leaf at rest.
        """
        wind = _turned_back(self.turn, air)
        wind[1] -= self.speed[2] * self.arm
        wind[2] += self.speed[1] * self.arm
        moment, drag = self._pressed(wind)
        angle = _rotation_vectors(self.turn)
        spring = self.stiffness * (1 + (angle**2).sum(axis=0) / STIFFER**2)
        spin = self.inertia * self.speed
        moment -= np.stack([_minor(self.speed, spin, i) for i in range(3)])  # The gyroscopic moment of a top.
        moment[1] += drag[1] * self.speed[1]  # The wind term above holds this part already.
        resisted = self.inertia + seconds * (self.damping + drag + seconds * spring)
        self.speed = (spin + seconds * (moment - spring * angle)) / resisted
        self.turn = _advanced(self.turn, seconds * self.speed)

    def _pressed(self, wind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return two arrays (3, L): the moments of the wind about the hinges of L blades, and by how much these fall
        per unit of angular velocity.
        """
        flat = np.hypot(wind[0], wind[1])
        speed = np.sqrt(flat**2 + wind[2] ** 2) + LEAST_WIND
        sine = np.abs(wind[2]) / speed
        pressure = 0.5 * AIR * self.area * speed / (0.222 + 0.283 * sine)
        force = pressure * wind[2]
        # the force attacks ahead of the middle, and at the middle where the wind is square to the blade
        ahead = 0.75 * flat / speed / (4 + np.pi * sine) / np.maximum(flat, LEAST_WIND)
        along, across = -ahead * wind[0] * self.chord, -ahead * wind[1] * self.width
        moment = np.stack([across * force, -(self.arm + along) * force, np.zeros_like(force)])
        roll = pressure * self.width**2 / 12
        return moment, np.stack([roll, pressure * self.arm**2, 0.05 * pressure * self.arm**2])


def sheltered(points: np.ndarray, area: np.ndarray, cell: float) -> np.ndarray:
    """Return the fraction (L,) of the wind's strength that reaches each of L leaves behind the leaves upwind of it.
    `area` (L,) is the leaves' areas; leaves shelter those in the same column, `cell` wide, along the wind.
    """
    side = np.cross(DIRECTION, [0.0, 1.0, 0.0])
    column = np.floor(np.stack([points @ side, points[:, 1]]) / cell)
    order = np.lexsort((points @ DIRECTION, *column))
    same = (column[:, order[1:]] == column[:, order[:-1]]).all(axis=0)
    hidden = np.cumsum(area[order]) - area[order]
    first = np.maximum.accumulate(np.where(np.concatenate([[True], ~same]), np.arange(len(order)), 0))
    left = np.empty(len(order))
    left[order] = np.exp(-LEE * (hidden - hidden[first]) / cell**2)
    return left


def _minor(a: np.ndarray, b: np.ndarray, i: int) -> np.ndarray:
    """Return component i of the cross product of (3, L)."""
    j, k = (i + 1) % 3, (i + 2) % 3
    return a[j] * b[k] - a[k] * b[j]


def _turned_back(turn: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (3, L) turned by the inverse of unit quaternions (4, L)."""
    axis = turn[1:]
    first = np.stack([2 * _minor(vectors, axis, i) for i in range(3)])
    return vectors + turn[0] * first + np.stack([_minor(first, axis, i) for i in range(3)])


def _rotation_vectors(turn: np.ndarray) -> np.ndarray:
    """Return (3, L) of unit quaternions (4, L), the shorter way round."""
    sine = np.sqrt((turn[1:] ** 2).sum(axis=0))
    half = np.arctan2(sine, np.abs(turn[0]))
    return np.where(turn[0] < 0, -2.0, 2.0) * half / np.maximum(sine, 1e-12) * turn[1:]


def _advanced(turn: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return quaternions (4, L) after further turns by small rotation vectors (3, L), in radians, about the turned
    axes.
    """
    half = 0.5 * angle
    w, v = turn[0], turn[1:]
    moved = np.empty_like(turn)
    moved[0] = w - (v * half).sum(axis=0)
    for i in range(3):
        moved[1 + i] = v[i] + w * half[i] + _minor(v, half, i)
    return moved / np.sqrt((moved**2).sum(axis=0))


def _matrices(turns: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) of quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(turns.astype(np.float64), -1, 0)
    rows = [
        *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    ]
    return np.stack(rows, axis=-1).reshape(*w.shape, 3, 3)
