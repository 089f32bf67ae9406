"""The motion of a plant in wind, by the rigid-body engine MuJoCo.

Every element is a rigid link on hinges at its lower end: two that bend (stiffness E I / L) and, on stems that
carry others, one that twists (G J / L). Damping is Rayleigh's: `damping` of critical at the plant's lowest
frequency, which is found by power iteration, and at six times that. Drag acts on the wood across its axis and
on the foliage, by the wind relative to the moving element. The engine takes joint damping implicitly, so a
time step of the size of the damping's stiffness factor keeps the springs of even the lightest twig stable.

The shape as grown is the one under the plant's own weight: gravity is left out, and so are contacts, foliage
that streamlines, and any plasticity or breaking. MuJoCo is optional: pip install mujoco.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from bench.trees.plant import Plant
from bench.trees.wind import Wind

DENSITY = 900.0  # Density of green wood, kg/m3.
YOUNG, SHEAR = 8.5e9, 0.6e9  # Pa
AIR = 1.2  # kg/m3
DRAG_OF_WOOD = 1.0
FOLIAGE_AREA = 0.07  # drag coefficient times area of all foliage, over height squared
FOLIAGE_MASS = 1.2  # kg per m2 of it
FOLIAGE_SPREAD = 0.05  # radius of gyration of a node's foliage, m
SECOND_DAMPED = 6.0  # the other damped frequency, over the lowest
LONGEST_STEP = 1.4  # Longest step over the damping's stiffness factor; from 2 on, stiff springs ring up.
CALM_SECONDS, SPIN_UP_SECONDS = 1.0, 4.0  # the wind rises over the former; the clip begins after the latter
WIND_RATE = 60.0  # evaluations of the wind per second


class MissingEngine(Exception):
    """MuJoCo is not installed."""


class Unstable(Exception):
    """The engine gave something that is not motion."""


@dataclass(frozen=True, eq=False)
class Motion:
    """positions (T, N, 3) float32 of the plant's nodes, times (T,) from 0, and how they were made."""

    positions: np.ndarray
    time: np.ndarray
    settings: dict[str, Any]


def engine() -> ModuleType:
    """The module mujoco; MissingEngine, with what to do, where it is not installed."""
    try:
        return import_module("mujoco")
    except ImportError as error:
        raise MissingEngine(
            "simulated trees: MuJoCo is not installed, expected `pip install mujoco`; "
            "the sample and clips given by their path do without"
        ) from error


def simulate(plant: Plant, wind: Wind, frames: int, fps: float = 30.0, damping: float = 0.05) -> Motion:
    """Frames of the plant in the wind. Raises MissingEngine, and Unstable where the engine lost control."""
    mujoco = engine()
    links = _Links(plant)
    model, bodies, joint_stiffness = links.model(mujoco)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    lowest = _lowest_frequency(mujoco, model, data, joint_stiffness)
    mass_factor, stiffness_factor = rayleigh(lowest, damping)
    model.dof_damping.reshape(model.nv, -1)[:, 0] = stiffness_factor * joint_stiffness
    per_frame = max(2, int(np.ceil(1.0 / (fps * LONGEST_STEP * stiffness_factor))))
    model.opt.timestep = 1.0 / (fps * per_frame)
    run = _Run(mujoco, model, data, links, bodies, wind, mass_factor)
    positions = np.empty((frames, len(plant.parent), 3), np.float32)
    for frame in range(-round(SPIN_UP_SECONDS * fps), frames):
        for _ in range(per_frame):
            run.step()
        if frame >= 0:
            positions[frame] = run.nodes()
    if not np.isfinite(positions).all() or run.warned():
        raise Unstable(f"simulation of {len(plant.parent)} nodes: the engine warned of unstable motion")
    settings = {
        "engine": f"MuJoCo {mujoco.__version__}: rigid links on hinges, implicitfast",
        "steps_per_frame": per_frame,
        "lowest_hz": round(float(lowest) / (2 * np.pi), 4),
        "damping": damping,
        "E": YOUNG,
        "G": SHEAR,
        "rho": DENSITY,
        "wind_speed": wind.speed,
        "turbulence_intensity": wind.intensity,
        "turbulence_length": wind.length,
        "wind_direction": "(-1,0,1)/sqrt2, y up",
        "spectrum": "von Karman, frozen travel",
    }
    return Motion(positions, np.arange(frames) / fps, settings)


class _Links:
    """Masses, inertias and stiffnesses of a plant's elements; index 0, the root, has none."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.elements = plant.elements
        self.length = np.linalg.norm(self.elements, axis=1)
        self.length[0] = 1.0
        self.axis = self.elements / self.length[:, None]
        wood = DENSITY * np.pi * plant.radius**2 * self.length
        leaves = FOLIAGE_MASS * foliage_area(plant)
        self.mass = wood + leaves
        self.centre = (0.5 * wood + leaves) / self.mass  # from the lower end, over the length
        slender = wood * (self.length**2 / 12 + plant.radius**2 / 4) + leaves * FOLIAGE_SPREAD**2
        apart = wood * (self.centre - 0.5) ** 2 + leaves * (1 - self.centre) ** 2
        self.across = slender + apart * self.length**2
        self.along = 0.5 * wood * plant.radius**2 + leaves * FOLIAGE_SPREAD**2
        moment = np.pi / 4 * plant.radius**4
        self.bending = YOUNG * moment / self.length
        self.twisting = SHEAR * 2 * moment / self.length
        self.twists = np.isin(plant.branch, plant.branch_parent)

    def model(self, mujoco: ModuleType) -> tuple[Any, np.ndarray, np.ndarray]:
        """The compiled model, the body of each node (the world for the root), and each joint's stiffness."""
        spec = mujoco.MjSpec()
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.gravity = np.zeros(3)
        off = mujoco.mjtDisableBit
        spec.option.disableflags = int(off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT | off.mjDSBL_AUTORESET)
        bodies, joints = [spec.worldbody], []
        for node in range(1, len(self.plant.parent)):
            bodies.append(self._add_link(bodies[self.plant.parent[node]], node))
            joints += self._add_hinges(mujoco, bodies[node], node)
        model = spec.compile()
        stiffness = np.empty(model.njnt)
        stiffness[[joint.id for joint, _ in joints]] = [value for _, value in joints]
        return model, np.array([body.id for body in bodies]), stiffness

    def _add_link(self, below: Any, node: int) -> Any:
        """A body whose frame is the world's in the shape as grown, at the element's lower end."""
        body = below.add_body(pos=self.elements[self.plant.parent[node]])
        body.mass, body.ipos = self.mass[node], self.elements[node] * self.centre[node]
        body.inertia = [self.across[node], self.across[node], self.along[node]]
        body.iquat = _turn_from_z(self.axis[node])
        body.explicitinertial = True
        return body

    def _add_hinges(self, mujoco: ModuleType, body: Any, node: int) -> list[tuple[Any, float]]:
        axis = self.axis[node]
        first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        first /= np.linalg.norm(first)
        hinges = [(first, self.bending[node]), (np.cross(axis, first), self.bending[node])]
        if self.twists[node]:
            hinges.append((axis, self.twisting[node]))
        kind = mujoco.mjtJoint.mjJNT_HINGE
        return [(body.add_joint(type=kind, axis=around, stiffness=value), value) for around, value in hinges]


class _Run:
    """A simulation under way: steps, and where the nodes are."""

    def __init__(
        self,
        mujoco: ModuleType,
        model: Any,
        data: Any,
        links: _Links,
        bodies: np.ndarray,
        wind: Wind,
        mass_factor: float,
    ) -> None:
        self.mujoco, self.model, self.data, self.links, self.bodies = mujoco, model, data, links, bodies
        self.damping = mass_factor * links.mass[:, None]
        self.wood = 0.5 * AIR * DRAG_OF_WOOD * (2 * links.plant.radius * links.length)[:, None]
        self.foliage = 0.5 * AIR * foliage_area(links.plant)[:, None]
        self.roots = model.body_rootid[self.bodies]
        self.preorder, sizes = links.plant.preorder()
        place = np.empty(len(bodies), int)
        place[self.preorder] = np.arange(len(place))
        of_hinge = np.argsort(bodies)[model.jnt_bodyid]
        self.hinge_begin, self.hinge_end = place[of_hinge], place[of_hinge] + sizes[of_hinge]
        self.wind, self.gust_time = wind, -np.inf
        self.air = np.zeros((len(self.bodies), 3))

    def step(self) -> None:
        """One time step, under the forces at its beginning."""
        data = self.data
        self.mujoco.mj_step1(self.model, data)
        points = data.xipos[self.bodies]
        if data.time - self.gust_time >= 1.0 / WIND_RATE - 1e-9:
            self.air = self.wind.at(points, data.time) * min(1.0, data.time / CALM_SECONDS)
            self.gust_time = data.time
        velocity = self._velocity(points)
        wind = self.air - velocity
        axis = np.einsum("nij,nj->ni", data.xmat[self.bodies].reshape(-1, 3, 3), self.links.axis)
        across = wind - (wind * axis).sum(axis=1, keepdims=True) * axis
        force = self.foliage * _length(wind) * wind + self.wood * _length(across) * across
        data.qfrc_applied[:] = self._around_hinges(points, force - self.damping * velocity)
        self.mujoco.mj_step2(self.model, data)

    def _around_hinges(self, points: np.ndarray, force: np.ndarray) -> np.ndarray:
        """(hinges,) moments of forces on the bodies: what the engine would do in quadratic time."""
        wrench = np.concatenate([force, np.cross(points, force)], axis=1)[self.preorder]
        running = np.concatenate([np.zeros((1, 6)), np.cumsum(wrench, axis=0)])
        carried = running[self.hinge_end] - running[self.hinge_begin]
        moment = carried[:, 3:] - np.cross(self.data.xanchor, carried[:, :3])
        return (self.data.xaxis * moment).sum(axis=1)

    def _velocity(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) of the bodies at points that move with them, from the engine's spatial velocities."""
        spatial = self.data.cvel[self.bodies]
        return spatial[:, 3:] + np.cross(spatial[:, :3], points - self.data.subtree_com[self.roots])

    def nodes(self) -> np.ndarray:
        """(N, 3): the root, and the upper end of every element."""
        self.mujoco.mj_kinematics(self.model, self.data)
        turns = self.data.xmat[self.bodies].reshape(-1, 3, 3)
        return self.data.xpos[self.bodies] + np.einsum("nij,nj->ni", turns, self.links.elements)

    def warned(self) -> bool:
        return any(warning.number for warning in self.data.warning)


def foliage_area(plant: Plant) -> np.ndarray:
    """(N,) drag coefficient times area of each node's foliage, m2."""
    return FOLIAGE_AREA * (plant.height * plant.height) * plant.foliage


def _lowest_frequency(mujoco: ModuleType, model: Any, data: Any, stiffness: np.ndarray) -> float:
    """Of the undamped plant at rest, rad/s: power iteration on the flexibility times the mass."""
    shape = np.ones(model.nv)
    inertia = np.empty(model.nv)
    period = 0.0
    for _ in range(100):
        mujoco.mj_mulM(model, data, inertia, shape)
        shape = inertia / stiffness
        period = np.linalg.norm(shape)
        shape /= period
    return 1.0 / np.sqrt(period)


def rayleigh(lowest: float, damping: float) -> tuple[float, float]:
    """Factors of mass and stiffness: `damping` at the lowest frequency and at SECOND_DAMPED times it."""
    high = SECOND_DAMPED * lowest
    return 2 * damping * lowest * high / (lowest + high), 2 * damping / (lowest + high)


def _turn_from_z(axis: np.ndarray) -> np.ndarray:
    """Quaternion (w, x, y, z) that turns the z axis to `axis`."""
    if axis[2] < -0.999999:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + axis[2], -axis[1], axis[0], 0.0])
    return turn / np.linalg.norm(turn)


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1, keepdims=True)
