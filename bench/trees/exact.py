"""Clips with the same bits on every machine: a tree of beams in gusts, and cards that turn from key to key.

Only operations that IEEE 754 rounds in one way are used: + - * / and square roots of arrays, sums in a fixed order, and
comparisons. Sines are a polynomial, random numbers are the raw bits of PCG64, and the equations of the tree are solved
from its tips to its root. Matrix products, factorisations of libraries and sums along rows are not used, because their
order depends on the processor. Vectors are arrays of shape (3, N).

The tree moves by the equations of beams.py, with another wind of the same kind and with turns by a rational formula.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np

from athcodec import MotionClip
from bench.trees.beams import CALM_SECONDS, SHEAR, YOUNG, node_drag, node_mass, rayleigh
from bench.trees.plant import BASE_RADIUS, FIRST_FORK, Plant, sum_above
from bench.trees.ride import cross_matrices
from bench.trees.wind import DIRECTION

FPS, STEPS = 30.0, 2  # Frames a second, time steps of a frame.
UP = np.array([[0.0], [1.0], [0.0]])
GOLDEN_TURN = 0.381966  # Golden angle in turns.
FORK_TURN = 0.15  # Angle between a stem and its side stems in turns.
THINNEST = 0.0002  # Least radius over the plant's height.
WAVES, WAVE_RATIO = 48, 1.2  # Plane waves of the wind, and ratio of the wave numbers of neighbours.


class Numbers:
    """Random numbers from a seed; NumPy promises the bits of its generator for good, but not what it makes of them."""

    def __init__(self, seed: int) -> None:
        self._bits = np.random.PCG64(seed)

    def uniform(self, low: float, high: float, *shape: int) -> np.ndarray:
        return low + (high - low) * ((self._bits.random_raw(shape) >> np.uint64(11)) * 2.0**-53)

    def normal(self, *shape: int) -> np.ndarray:
        """Return sums of four uniform numbers, with mean 0 and variance 1."""
        return reduce(add, self.uniform(-1.0, 1.0, 4, *shape)) * np.sqrt(0.75)


def sine(turns: np.ndarray) -> np.ndarray:
    """Return the sine of angles, given in turns of 360 degrees, by a series that has the same bits on every machine."""
    turns = turns - np.rint(turns)
    folded = np.where(np.abs(turns) > 0.25, np.copysign(0.5, turns) - turns, turns)
    angle = 2 * np.pi * folded
    series = np.ones_like(angle)
    for power in range(20, 0, -2):
        series = 1.0 - angle * angle / (power * (power + 1)) * series
    return angle * series


def cosine(turns: np.ndarray) -> np.ndarray:
    return sine(turns + 0.25)


def dot(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    return reduce(add, left * right)


def cross(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    return np.cross(left, right, axis=0)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.sqrt(dot(vectors, vectors))


def product(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return (6, M, N) products of (6, 6, N) matrices with (6, M, N) matrices."""
    return reduce(add, (left[:, k, None] * right[k] for k in range(6)))


def inverses(matrices: np.ndarray) -> np.ndarray:
    """Return the inverses (6, 6, N) of N symmetric positive definite matrices (6, 6, N), by Gauss-Jordan
    elimination.
    """
    result = matrices.copy()
    for k in range(6):
        pivot = 1.0 / result[k, k]
        row, column = result[k] * pivot, result[:, k].copy()
        result -= column[:, None] * row
        result[k], result[:, k], result[k, k] = row, -column * pivot, pivot
    return result


def grow(orders: tuple[tuple[int, int], ...], height: float, seed: int) -> Plant:
    """Return a plant of the given height in metres. `orders` has for each generation, from the trunk on, the number of
    its stems and the number of their elements in all.
    """
    numbers = Numbers(seed)
    parent, branch, branch_parent = np.array([-1]), np.array([0]), np.array([-1])
    heading, position, length = UP, np.zeros((3, 1)), np.ones(1)
    first, counts, base, start, stem = np.zeros(1, int), np.ones(1, int), np.zeros(1, int), UP, 0
    for order, (stems, elements) in enumerate(orders):
        if order:
            each = stems // len(counts)
            mother = np.arange(stems) // each
            place = FIRST_FORK + (1.0 - FIRST_FORK) * (np.arange(stems) % each + 0.5) / each
            base = first[mother] + np.floor(counts[mother] * place).astype(int)
            length = length[mother] * (0.4 - 0.25 * place) * numbers.uniform(0.85, 1.15, stems)
            start = _side(heading[:, base], GOLDEN_TURN * np.arange(stems), numbers)
            branch_parent = np.concatenate([branch_parent, stem - len(counts) + mother])
        ends = np.cumsum(numbers.uniform(0.4, 1.6, stems))
        counts = np.diff(np.floor(ends / ends[-1] * elements), prepend=0.0).astype(int)
        steps = counts.max()
        inside = np.arange(steps) < counts[:, None]
        track, ahead, place = np.empty((2, 3, stems, steps)), start, position[:, base]
        for step in range(steps):
            lift = UP * (0.6 / counts) if order else 0.0
            ahead = unit(ahead + lift + numbers.normal(3, stems) * (0.25 / np.sqrt(counts)))
            place = place + ahead * (length / counts)
            track[:, :, :, step] = ahead, place
        first = len(parent) + np.cumsum(counts) - counts
        below = np.arange(len(parent), len(parent) + elements) - 1
        below[first - len(parent)] = base
        parent = np.concatenate([parent, below])
        branch = np.concatenate([branch, stem + np.repeat(np.arange(stems), counts)])
        heading, position = (np.concatenate(pair, axis=1) for pair in zip((heading, position), track[:, :, inside]))
        stem += stems
    leafy = (np.arange(len(parent)) >= first[0]) | (np.bincount(parent[1:], minlength=len(parent)) == 0)
    foliage = leafy / leafy.sum()
    radius = np.maximum(BASE_RADIUS * height * np.sqrt(sum_above(parent, foliage)), THINNEST * height)
    return Plant(
        parent.astype(np.int32),
        branch.astype(np.int32),
        branch_parent.astype(np.int32),
        np.ascontiguousarray((position * (height / position[1].max())).T),
        radius,
        foliage,
    )


def _side(heading: np.ndarray, azimuth: np.ndarray, numbers: Numbers) -> np.ndarray:
    """Return directions of side stems, at an angle to the stems and turned around them by azimuths in turns."""
    helper = np.where(np.abs(heading[2]) < 0.9, [[0.0], [0.0], [1.0]], [[1.0], [0.0], [0.0]])
    across = unit(cross(heading, helper))
    out = cosine(azimuth) * across + sine(azimuth) * cross(heading, across)
    fork = FORK_TURN + 0.02 * numbers.normal(len(azimuth))
    return cosine(fork) * heading + sine(fork) * out


class Gusts:
    """The wind of wind.py at fixed points, of fewer waves and with powers that square roots give.

    The profile grows with the fourth root of the height; the exponent 17/6 of the spectrum is 2.8125.
    """

    def __init__(
        self, points: np.ndarray, speed: float, height: float, intensity: float, length: float, seed: int
    ) -> None:
        """Prepare a turbulent wind at points (3, N): `speed` in m/s at the height `height`, with gusts of the relative
        strength `intensity` and of the length `length` in metres.
        """
        numbers, scale = Numbers(seed), 1.339 * length
        edges = 0.05 / scale * np.cumprod(np.full(WAVES, WAVE_RATIO))
        number = edges * numbers.uniform(1.0, WAVE_RATIO, WAVES)
        base = 1.0 + (number * scale) * (number * scale)
        fourth = np.sqrt(np.sqrt(base))
        spread = base * base * np.sqrt(base) * fourth * np.sqrt(np.sqrt(fourth))
        square = number * scale * number * scale
        energy = square * square / spread * edges
        energy = energy * (1.5 * (intensity * speed) * (intensity * speed) / np.cumsum(energy)[-1])
        waves = unit(numbers.normal(3, WAVES))
        self._amplitude = unit(cross(waves, numbers.normal(3, WAVES))) * (2.0 * np.sqrt(energy))
        waves = waves * (number / (2 * np.pi))
        self._rate = speed * dot(waves, DIRECTION[:, None])
        phase = dot(waves[..., None], points[:, None]) + numbers.uniform(0.0, 1.0, WAVES, 1)
        self._cosine, self._sine = cosine(phase), sine(phase)
        profile = np.sqrt(np.sqrt(np.maximum(points[1], 0.0) / height))
        self._mean = speed * profile * DIRECTION[:, None]

    def at(self, time: float) -> np.ndarray:
        """Return (3, N) velocities in m/s."""
        air = self._mean.copy()
        along, across = cosine(self._rate * time), sine(self._rate * time)
        for k in range(WAVES):
            air += self._amplitude[:, k, None] * (self._cosine[k] * along[k] + self._sine[k] * across[k])
        return air


class Equations:
    """The stiffness of beams.py times a factor, plus a diagonal (6, N), with the root held: solved along the tree."""

    def __init__(self, plant: Plant, factor: float, diagonal: np.ndarray) -> None:
        """Eliminate the equations of a plant's stiffness, with `factor` times the elasticity and `diagonal` added, from
        the tips to the root, once for all calls of `solve`.
        """
        matrices, coupling = _stiffness(plant, factor)
        for k in range(6):
            matrices[k, k] += diagonal[k]
        self._groups = []
        for nodes in _tips_first(plant):
            below = plant.parent[nodes]
            inverse = inverses(matrices[..., nodes])
            passed = product(coupling[..., nodes], inverse)
            matrices[..., below] -= product(passed, coupling[..., nodes].transpose(1, 0, 2))
            self._groups.append((nodes, below, inverse, passed, passed.transpose(1, 0, 2).copy()))

    def solve(self, load: np.ndarray) -> np.ndarray:
        """Return the displacements and turns (6, N) of the nodes under loads (6, N): forces and then moments."""
        load, moved = load.copy(), np.zeros_like(load)
        for nodes, below, _, passed, _ in self._groups:
            load[:, below] -= reduce(add, (passed * load[:, nodes]).transpose(1, 0, 2))
        for nodes, below, inverse, _, factors in reversed(self._groups):
            held = reduce(add, (factors * moved[:, below]).transpose(1, 0, 2))
            moved[:, nodes] = reduce(add, (inverse * load[:, nodes]).transpose(1, 0, 2)) - held
        return moved


def _stiffness(plant: Plant, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return two arrays (6, 6, N) of the plant's stiffness, multiplied by `factor`: the blocks of the nodes, and the
    blocks that couple each node's parent (rows) to the node (columns).
    """
    element = plant.elements.T.copy()
    element[:, 0] = UP[:, 0]
    length = np.sqrt(dot(element, element))
    axis, radius = element / length, factor * plant.radius * plant.radius
    along = axis[:, None] * axis
    across = np.eye(3)[..., None] - along
    moment = np.pi / 4 * radius * plant.radius * plant.radius
    bending, twist = YOUNG * moment / length, SHEAR * 2 * moment / length
    pull = YOUNG * np.pi * radius / length * along + 12 * bending / (length * length) * across
    lever = 6 * bending / length * np.moveaxis(cross_matrices(axis.T), 0, -1)
    turn, other = twist * along + 4 * bending * across, 2 * bending * across - twist * along
    back = lever.transpose(1, 0, 2)
    matrices, below = _blocks(pull, lever, back, turn), _blocks(pull, -lever, -back, turn)
    for node in range(1, len(plant.parent)):
        matrices[..., plant.parent[node]] += below[..., node]
    return matrices, _blocks(-pull, -lever, back, other)


def _blocks(*parts: np.ndarray) -> np.ndarray:
    return np.concatenate([np.concatenate(parts[:2], axis=1), np.concatenate(parts[2:], axis=1)])


def _tips_first(plant: Plant) -> Iterator[np.ndarray]:
    """Yield every node but the root after those it carries, in groups of which no two nodes have one parent."""
    for nodes in reversed(plant.generations[1:]):
        while len(nodes):
            first = np.unique(plant.parent[nodes], return_index=True)[1]
            yield nodes[first]
            nodes = np.delete(nodes, first)


def bend(
    plant: Plant, gusts: Gusts, speed: float, frames: int, hertz: float, damping: float, spin_up: float
) -> np.ndarray:
    """Return float32 positions (T, N, 3) of a plant's nodes in gusts, with the same bits on every machine. `hertz` is
    the lowest natural frequency, `damping` a fraction of the critical damping, and the first frame is `spin_up` seconds
    after the wind began.
    """
    mass, drag = (part(plant).reshape(-1, 6).T for part in (node_mass, node_drag))
    mass_factor, stiffness_factor = rayleigh(2 * np.pi * hertz, damping)
    friction = drag * speed
    step = 1.0 / (FPS * STEPS)
    factor = 1.0 + 2 / step * stiffness_factor
    weight = mass * (4 / (step * step) + 2 / step * mass_factor) + 2 / step * friction
    equations = Equations(plant, factor, weight)
    place, pace, pull = (np.zeros_like(mass) for _ in range(3))
    positions = np.empty((frames, len(plant.parent), 3), np.float32)
    first = -round(spin_up * FPS * STEPS)
    for count in range(first, (frames - 1) * STEPS + 1):
        air = gusts.at(count * step) * min(1.0, (count - first) * step / CALM_SECONDS)
        force = mass * (4 / (step * step) * place + 4 / step * pace + pull)
        force[:3] += drag[:3] * np.sqrt(dot(air, air)) * air
        # The unknown leaves out the part of the displacement whose stiffness and damping cancel each other.
        along = 2 / step * place + pace
        apart = stiffness_factor / factor * along
        moved = equations.solve(force + (mass_factor * mass + friction) * along - weight * apart) + apart
        moved[:, 0] = 0.0
        faster = 2 / step * (moved - place) - pace
        pull = 4 / (step * step) * (moved - place) - 4 / step * pace - pull
        place, pace = moved, faster
        if count >= 0 and count % STEPS == 0:
            positions[count // STEPS] = _placed(plant, place[:3]).T
    return positions


def _placed(plant: Plant, displacement: np.ndarray) -> np.ndarray:
    """Return positions (3, N) of nodes whose elements turn as `displacement` turns their chords, but keep their
    lengths. A turn of size t, the tangent of small turns, is by an angle of 2 arctan(t / 2).
    """
    element = plant.elements.T
    change = displacement - displacement[:, np.maximum(plant.parent, 0)]
    half = 0.5 * cross(element, change) / np.maximum(dot(element, element), 1e-30)
    turned = cross(half, element)
    steps = element + 2.0 / (1.0 + dot(half, half)) * (turned + cross(half, turned))
    for nodes in plant.generations[1:]:
        steps[:, nodes] += steps[:, plant.parent[nodes]]
    return steps


@dataclass(frozen=True)
class Tree:
    """A tree of beams in gusts; `orders` as in grow(), `hertz` the frequency that the damping is meant at."""

    orders: tuple[tuple[int, int], ...]
    frames: int
    height: float
    wind_speed: float
    intensity: float
    length: float
    hertz: float
    damping: float
    seed: int
    digest: str

    def make(self) -> MotionClip:
        plant = grow(self.orders, self.height, self.seed)
        gusts = Gusts(plant.position.T, self.wind_speed, self.height, self.intensity, self.length, self.seed)
        positions = bend(plant, gusts, self.wind_speed, self.frames, self.hertz, self.damping, 2.0)
        return plant.clip(positions, np.arange(self.frames) / FPS, FPS, wind_speed=self.wind_speed)

    def __str__(self) -> str:
        return f"beams, {self.height:g} m tree in gusts of {self.wind_speed:g} m/s"


@dataclass(frozen=True)
class Cards:
    """Rigid leaf cards that turn about their pivots at a constant rate from key to key; the first key is the rest pose.

    Branch 0 holds the pivots, which stand still; z is up. `degrees` are standard deviations of the keys' turns about
    x, y and z; `key_frames` is a power of two.
    """

    cards: int
    keys: int
    key_frames: int
    degrees: tuple[float, float, float]
    seed: int
    digest: str

    def make(self) -> MotionClip:
        """Return a clip of leaf cards, quadrilaterals that each turn about a pivot on a twig, in all frames."""
        numbers, count = Numbers(self.seed), self.cards
        twig = numbers.uniform(-1.0, 1.0, 3, (count + 6) // 7) * [[0.3], [0.3], [0.8]] + [[0.0], [0.0], [1.5]]
        pivots = np.repeat(twig, 7, axis=1)[:, :count] + 0.01 * numbers.normal(3, count)
        along = unit(numbers.normal(3, count) * [[1.0], [1.0], [0.4]])
        across = unit(cross(along, numbers.normal(3, count)))
        length = numbers.uniform(0.056, 0.15, count)
        shape = zip((0.0, 1.0, 1.0, 2.0, 2.0, 3.0), (0.0, -0.72, 0.72, -0.72, 0.72, 0.0), strict=True)
        corners = np.stack([length / 3.0 * (far * along + wide * across) for far, wide in shape], axis=2)
        turns = self._turns(numbers)
        cards = np.stack([pivots[..., None] + _turned(turn[..., None], corners) for turn in turns])
        cards = cards.reshape(len(turns), 3, -1).transpose(0, 2, 1)
        still = np.broadcast_to(pivots.T, (len(turns), count, 3))
        positions = np.concatenate([still, cards], axis=1).astype(np.float32)
        first = count + 6 * np.arange(count)[:, None, None]
        return MotionClip(
            positions,
            np.arange(len(turns)) / FPS,
            np.concatenate([np.zeros(count, int), 1 + np.repeat(np.arange(count), 6)]),
            np.concatenate([[-1], np.zeros(count, int)]),
            rest=positions[0],
            faces=(first + [[0, 1, 3, 2], [2, 3, 5, 4]]).reshape(-1, 4).astype(np.int32),
            metadata={"unit": "m", "up_axis": "z", "fps": FPS},
        )

    def _turns(self, numbers: Numbers) -> np.ndarray:
        """Return the quaternions (T, 4, N), scalar first, of N cards. Keys are random; frames between two keys are
        found by halving the turn between neighbours again and again.
        """
        half = numbers.normal(self.keys, 3, self.cards) * (np.array(self.degrees)[:, None] / 720.0)
        half[0] = 0.0
        x, y, z = (_about(axis, half[:, axis]) for axis in range(3))
        turns = [_composed(_composed(c, b), a) for a, b, c in zip(x, y, z, strict=True)]
        frames = self.key_frames
        while frames > 1:
            between = [unit(before + after) for before, after in zip(turns, turns[1:])]
            turns = [turn for pair in zip(turns, between) for turn in pair] + turns[-1:]
            frames //= 2
        return np.stack(turns)

    def __str__(self) -> str:
        return f"{self.cards} rigid cards that turn about pivots, a key every {self.key_frames} frames"


def _about(axis: int, half: np.ndarray) -> np.ndarray:
    """Return (K, 4, N) quaternions of turns about a coordinate axis, from half of the angles in turns."""
    result = np.zeros((len(half), 4, half.shape[1]))
    result[:, 0], result[:, 1 + axis] = cosine(half), sine(half)
    return result


def _composed(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    scalar = left[0] * right[0] - dot(left[1:], right[1:])
    vector = left[0] * right[1:] + right[0] * left[1:] + cross(left[1:], right[1:])
    return np.concatenate([scalar[None], vector])


def _turned(quaternions: np.ndarray, points: np.ndarray) -> np.ndarray:
    turned = 2.0 * cross(quaternions[1:], points)
    return points + quaternions[0] * turned + cross(quaternions[1:], turned)
