"""The motion of a plant in wind without an engine: elastic beams that sway by small turns, joined again at full length.

Every element is a Bernoulli beam clamped to its neighbours, with its mass and its foliage's at the nodes. The equations
are linear, so one factorisation serves all time steps (Newmark's average acceleration, stable at any step). Nodes are
then placed by turning every element as its chord turns, which keeps the lengths that linear displacements would stretch
(after Choi and Ko, "Modal warping: real-time simulation of large rotational deformation and manipulation", IEEE TVCG
11(1), 2005). Drag acts on the wood across its axis and on the foliage; the part of it that follows the plant's own
speed is that of the mean wind. Damping is Rayleigh's: a part of critical at the plant's lowest frequency, and at six
times that. The shape as grown is the one under the plant's own weight.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bench.trees.plant import Plant
from bench.trees.ride import cross_matrices, rotations
from bench.trees.wind import Wind

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

STEPS = 3  # Time steps of a frame.
DENSITY = 900.0  # Density of green wood, kg/m3.
YOUNG, SHEAR = 8.5e9, 0.6e9  # Pa
AIR = 1.2  # kg/m3
DRAG_OF_WOOD = 1.0
FOLIAGE_AREA = 0.07  # Drag coefficient times area of all foliage, over the square of the height.
FOLIAGE_MASS = 1.2  # kg per m2 of it
FOLIAGE_SPREAD = 0.05  # Radius of gyration of a node's foliage, m.
SECOND_DAMPED = 6.0  # The other damped frequency, over the lowest.
CALM_SECONDS, SPIN_UP_SECONDS = 1.0, 4.0  # The wind rises over the former; the clip begins after the latter.


def bend(
    plant: Plant, wind: Wind, frames: int, fps: float = 30.0, damping: float = 0.05, spin_up: float = SPIN_UP_SECONDS
) -> np.ndarray:
    """Return float32 positions (T, N, 3) of a plant's nodes as elastic beams in wind. The first frame is `spin_up`
    seconds after the wind began; `damping` is a fraction of the critical damping.
    """
    from scipy.sparse.linalg import splu

    stiffness, mass, drag = _stiffness(plant), node_mass(plant), node_drag(plant)
    mass_factor, stiffness_factor = rayleigh(_lowest_frequency(stiffness, mass), damping)
    friction = drag * wind.speed
    step = 1.0 / (fps * STEPS)
    weight = mass * (4 / step**2 + 2 / step * mass_factor) + 2 / step * friction
    matrix = (stiffness * (1 + 2 / step * stiffness_factor)).tocsc() + _diagonal(weight)
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    place, speed, pull = (np.zeros(len(mass)) for _ in range(3))
    positions = np.empty((frames, len(plant.parent), 3), np.float32)
    first = -round(spin_up * fps * STEPS)
    for count in range(first, (frames - 1) * STEPS + 1):
        air = wind.at(plant.position, count * step) * min(1.0, (count - first) * step)
        force = drag.reshape(-1, 6) * np.pad(np.linalg.norm(air, axis=1, keepdims=True) * air, ((0, 0), (0, 3)))
        inertia = mass * (4 / step**2 * place + 4 / step * speed + pull)
        along = 2 / step * place + speed
        held = (mass_factor * mass + friction) * along + stiffness_factor * (stiffness @ along)
        moved = _clamped(factors.solve(_clamped(force.ravel() + inertia + held)))
        faster = 2 / step * (moved - place) - speed
        pull = 4 / step**2 * (moved - place) - 4 / step * speed - pull
        place, speed = moved, faster
        if count >= 0 and count % STEPS == 0:
            positions[count // STEPS] = _placed(plant, place.reshape(-1, 6)[:, :3])
    return positions


def _clamped(numbers: np.ndarray) -> np.ndarray:
    """Return values with zeros for the root, which is held."""
    numbers[:6] = 0.0
    return numbers


def _diagonal(numbers: np.ndarray) -> csc_matrix:
    from scipy.sparse import diags

    return diags(numbers).tocsc()


def _stiffness(plant: Plant) -> csc_matrix:
    """Return the stiffness matrix (6N, 6N) for displacements and turns of a plant's N nodes. It sums what each element
    resists: stretch, twist, and turns of its two ends against its chord.
    """
    from scipy.sparse import coo_matrix

    element = plant.elements[1:]
    length = np.linalg.norm(element, axis=1)
    axis = element / length[:, None]
    radius = plant.radius[1:]
    moment = np.pi / 4 * radius**4
    count = len(element)
    strain = np.zeros((count, 8, 12))  # rows: stretch, twist, lower end, upper end
    strain[:, 0, 0:3], strain[:, 0, 6:9] = -axis, axis
    strain[:, 1, 3:6], strain[:, 1, 9:12] = -axis, axis
    chord = cross_matrices(axis) / length[:, None, None]
    across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
    for row, turn in ((2, 3), (5, 9)):
        strain[:, row : row + 3, 0:3], strain[:, row : row + 3, 6:9] = chord, -chord
        strain[:, row : row + 3, turn : turn + 3] = across
    resisted = np.zeros((count, 8, 8))
    resisted[:, 0, 0] = YOUNG * np.pi * radius**2 / length
    resisted[:, 1, 1] = SHEAR * 2 * moment / length
    bending = YOUNG * moment / length
    resisted[:, 2:, 2:] = bending[:, None, None] * np.kron([[4, 2], [2, 4]], np.eye(3))
    blocks = strain.transpose(0, 2, 1) @ resisted @ strain
    unknown = np.concatenate(
        [6 * nodes[:, None] + np.arange(6) for nodes in (plant.parent[1:], np.arange(1, count + 1))], axis=1
    )
    rows, columns = (
        np.broadcast_to(unknown[:, :, None], blocks.shape),
        np.broadcast_to(unknown[:, None], blocks.shape),
    )
    size = 6 * len(plant.parent)
    kept = (rows >= 6) & (columns >= 6)
    matrix = coo_matrix((blocks[kept], (rows[kept], columns[kept])), shape=(size, size)).tocsc()
    return matrix + _diagonal(np.where(np.arange(size) < 6, matrix.diagonal().max(), 0.0))  # the root is held


def node_mass(plant: Plant) -> np.ndarray:
    """Return (6N,) masses and moments of inertia of N nodes, six for each node, with half of each adjacent element."""
    length, section = plant.lengths, np.square(plant.radius)
    half = 0.5 * DENSITY * np.pi * section * length
    turned = half * (np.square(length) / 12 + section)
    mass, inertia = half.copy(), turned.copy()
    np.add.at(mass, plant.parent[1:], half[1:])
    np.add.at(inertia, plant.parent[1:], turned[1:])
    leaves = FOLIAGE_MASS * foliage_area(plant)
    return np.repeat(
        np.stack([mass + leaves, inertia + leaves * (FOLIAGE_SPREAD * FOLIAGE_SPREAD)], axis=1), 3, axis=1
    ).ravel()


def node_drag(plant: Plant) -> np.ndarray:
    """Return (6N,) force over the square of the wind's speed."""
    wood = DRAG_OF_WOOD * 2 * plant.radius * plant.lengths
    drag = 0.5 * AIR * (wood + foliage_area(plant))
    return np.stack([drag, 0 * drag], axis=1).repeat(3, axis=1).ravel()


def foliage_area(plant: Plant) -> np.ndarray:
    """Return (N,) drag coefficient times area of each node's foliage, m2."""
    return FOLIAGE_AREA * (plant.height * plant.height) * plant.foliage


def rayleigh(lowest: float, damping: float) -> tuple[float, float]:
    """Return factors of mass and stiffness: `damping` at the lowest frequency and at SECOND_DAMPED times it."""
    high = SECOND_DAMPED * lowest
    return 2 * damping * lowest * high / (lowest + high), 2 * damping / (lowest + high)


def _lowest_frequency(stiffness: csc_matrix, mass: np.ndarray) -> float:
    """Return the lowest frequency of the undamped plant at rest, rad/s."""
    from scipy.sparse.linalg import eigsh

    start = np.ones(len(mass))  # A fixed start makes every run equal.
    return float(np.sqrt(eigsh(stiffness, 1, _diagonal(mass), sigma=0.0, v0=start, return_eigenvectors=False)[0]))


def _placed(plant: Plant, displacement: np.ndarray) -> np.ndarray:
    """Return positions (N, 3) of nodes whose elements turn as `displacement` (N, 3) turns their chords, but keep their
    lengths.
    """
    element = plant.elements
    change = displacement - displacement[np.maximum(plant.parent, 0)]
    square = np.maximum((element**2).sum(axis=1, keepdims=True), 1e-30)
    steps = np.einsum("nij,nj->ni", rotations(np.cross(element, change) / square), element)
    for nodes in plant.generations[1:]:
        steps[nodes] += steps[plant.parent[nodes]]
    return steps
