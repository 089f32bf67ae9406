"""Stems as the elastic rods of the physics engine MuJoCo (1D flexes, which replaced its cables), in turbulent wind.

MuJoCo has no file format for motion: these clips are HDF5, and a stem is a branch; those of fields and hedges are NumPy
archives of a mesh, or of points, whose stems nothing names.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

import athcodec
from bench.scenes import stems as covers
from bench.trees.ride import smallest_turns
from bench.trees.wind import Wind

FRAMES = 200  # Frames of a single plant.
SIDE_BY_SIDE = 80  # Frames of many plants beside each other.
GROUP = 8  # Rods of one model.
FPS = 30.0
STEPS = 8  # Steps of the engine in a frame.
RADIUS, WIDTH, DENSITY = 0.002, 0.012, 600.0  # Metres, kg/m3. Width: what the wind sees, with leaves.


def grass(path: Path, seed: int, stems: int) -> None:
    """Make stems of grass that stand on a square metre."""
    rng = np.random.default_rng(seed)
    level = np.linspace(0, 1, 16)[:, None]
    lean = rng.normal(0, 0.08, (stems, 1, 3)) * [1, 0, 1]
    feet = rng.uniform(-0.5, 0.5, (stems, 1, 3)) * [1, 0, 1]
    points = feet + rng.uniform(0.35, 0.6, (stems, 1, 1)) * (level * [0, 1, 0] + level**2 * lean)
    _write(path, points, "0 1", 4e8, Wind(3.5, 1.0, length=0.8, seed=seed))


def field(path: Path, seed: int, stems: int, apart: float, speed: float, has_faces: bool) -> None:
    """Write blades of a crop that stand in rows `apart` metres from each other, in wind of `speed` m/s. Each blade is a
    ribbon of pairs of vertices, with faces if `has_faces` is true.
    """
    rng = np.random.default_rng(seed)
    level, side = np.linspace(0, 1, 12)[:, None], int(np.ceil(np.sqrt(stems)))
    row, column = np.divmod(np.arange(stems), side)
    feet = apart * (np.stack([row, 0 * row, column], axis=1) - [side / 2, 0, side / 2])
    feet = (feet + rng.normal(0, 0.3 * apart, feet.shape) * [1, 0, 1])[:, None]
    lean = rng.normal(0, 0.15, (stems, 1, 3)) * [1, 0, 1]
    rods = feet + rng.uniform(0.6, 0.9, (stems, 1, 1)) * (level * [0, 1, 0] + level**2 * lean)
    moved = _in_groups(rods, 6e8, Wind(speed, 1.0, length=1.2, seed=seed))
    width = 0.008 * np.sqrt(1.02 - level[:, 0])
    _write_mesh(path, *covers.ribbons(_stems(moved), rng.uniform(0, 2 * np.pi, stems), width), has_faces)


def hedge(path: Path, seed: int, stems: int, sides: int) -> None:
    """Write the stems of a hedge as tubes of `sides` sides, 40 stems to a metre, which grow through each other."""
    rng = np.random.default_rng(seed)
    level = np.linspace(0, 1, 12)[:, None]
    feet = rng.uniform(-0.5, 0.5, (stems, 1, 3)) * [stems / 40, 0, 0.4]
    lean = rng.normal(0, 0.3, (stems, 1, 3)) * [1, 0, 1]
    rods = feet + rng.uniform(0.8, 1.3, (stems, 1, 1)) * (level * [0, 1, 0] + level**2 * lean)
    moved = _in_groups(rods, 8e9, Wind(3.0, 1.0, length=1.5, seed=seed))
    radius = rng.uniform(0.004, 0.008, (stems, 1)) * np.linspace(1, 0.4, 12)
    _write_mesh(path, *covers.tubes(_stems(moved), radius, sides), has_faces=True)


def vine(path: Path, seed: int, joints: int) -> None:
    """Make three vines that hang between posts."""
    rng = np.random.default_rng(seed)
    level = np.linspace(-1, 1, joints)[:, None]
    sag = rng.uniform(0.5, 0.8, (3, 1, 1))
    points = level * [1.0, 0, 0] + sag * (level**2 - 1) * [0, 1, 0] + [[[0, 2, z]] for z in (-0.3, 0.0, 0.3)]
    points[:, 1:-1] += 0.002 * rng.normal(size=points[:, 1:-1].shape)
    _write(path, points, f"0 {joints - 1}", 2e7, Wind(3.5, 2.0, length=1.0, seed=seed))


def _write(path: Path, rods: np.ndarray, pins: str, young: float, wind: Wind) -> None:
    """Simulate rods (S, P, 3) in wind and write their motion as an HDF5 clip with a branch for each rod. `pins` names
    the points that are held, and `young` is Young's modulus in pascals.
    """
    moved = _moved(rods, pins, young, wind, FRAMES)
    clip = athcodec.MotionClip(
        moved.reshape(FRAMES, -1, 3).astype(np.float32),
        np.arange(FRAMES) / FPS,
        np.repeat(np.arange(len(rods)), rods.shape[1]),
        np.full(len(rods), -1),
        rest=rods.reshape(-1, 3).astype(np.float32),
        metadata={"unit": "m", "up_axis": "y", "fps": FPS},
    )
    athcodec.write_hdf5(clip, path)


def _write_mesh(path: Path, positions: np.ndarray, faces: np.ndarray, has_faces: bool) -> None:
    """Write a NumPy archive of (T, S, n, 3) positions, whose stems all have the (F, 4) faces."""
    frames, count, size, _ = positions.shape
    numbers = (faces + size * np.arange(count)[:, None, None]).reshape(-1, 4).astype(np.int32)
    arrays = {"faces": numbers} if has_faces else {}
    np.savez(path, positions=positions.reshape(frames, -1, 3).astype(np.float32), fps=FPS, **arrays)


def _stems(moved: np.ndarray) -> covers.Stems:
    """Return what covers need, of (T, S, P, 3) rods: the smallest turns of their pieces from their first directions."""
    along = np.gradient(moved, axis=2)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    heading = along[0, :, 0]
    return covers.Stems(moved, smallest_turns(heading[:, None], along), heading)


def _in_groups(rods: np.ndarray, young: float, wind: Wind) -> np.ndarray:
    """Return the same of rods that stand in the ground, a few at a time: no rod touches another, and few are solved
    faster."""
    groups = np.array_split(rods, -(-len(rods) // GROUP))
    return np.concatenate([_moved(group, "0 1", young, wind, SIDE_BY_SIDE) for group in groups], axis=1)


def _moved(rods: np.ndarray, pins: str, young: float, wind: Wind, frame_count: int) -> np.ndarray:
    """Simulate elastic rods in the wind and return their points (T, S, P, 3) in `frame_count` frames. `rods` (S, P, 3)
    has the points at rest, `pins` names those that are held, and `young` is Young's modulus in pascals.
    """
    count = rods.shape[1]
    lengths = np.linalg.norm(np.diff(rods, axis=1), axis=2)
    elements = " ".join(f"{i} {i + 1}" for i in range(count - 1))
    flexes = "".join(
        f"""<flexcomp name="rod{i}" type="direct" dim="1" radius="{RADIUS}" element="{elements}"
            mass="{DENSITY * np.pi * RADIUS**2 * lengths[i].sum()}" point="{" ".join(map(str, rod.ravel()))}">
            <edge equality="true" solref="{4 / FPS / STEPS} 1" solimp="0.9995 0.9999 0.001"/>
            <contact contype="0" conaffinity="0" selfcollide="none"/><pin id="{pins}"/>
            <elasticity young="{young}" poisson="0.3" damping="0.02"/></flexcomp>"""
        for i, rod in enumerate(rods)
    )
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 -9.81 0" timestep="{1 / FPS / STEPS}" integrator="discrete"/>
        <worldbody>{flexes}</worldbody></mujoco>"""
    )
    state = mujoco.MjData(model)
    mujoco.mj_forward(model, state)
    piece = np.gradient(np.concatenate([np.zeros((len(rods), 1)), lengths.cumsum(axis=1)], axis=1), axis=1).ravel()
    bodies, frames = model.flex_vertbodyid, []
    before = state.flexvert_xpos.copy()
    for step in range((frame_count - 1) * STEPS + 1):
        if step % STEPS == 0:
            frames.append(state.flexvert_xpos.astype(np.float32))
        blown = wind.at(state.flexvert_xpos, state.time) - (state.flexvert_xpos - before) / model.opt.timestep
        before = state.flexvert_xpos.copy()
        drag = 0.6 * WIDTH * piece[:, None] * np.linalg.norm(blown, axis=1, keepdims=True) * blown
        state.xfrc_applied[bodies, :3] = drag
        mujoco.mj_step(model, state)
    return np.array(frames).reshape(frame_count, *rods.shape)
