"""Stems as the elastic rods of the physics engine MuJoCo (1D flexes, which replaced its cables), in turbulent wind.

MuJoCo has no file format for motion: these clips are HDF5, and a stem is a branch.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

import athcodec
from bench.trees.wind import Wind

FRAMES, FPS, STEPS = 200, 30.0, 8  # Steps: of the engine in a frame.
RADIUS, WIDTH, DENSITY = 0.002, 0.012, 600.0  # Metres, kg/m3. Width: what the wind sees, with leaves.


def grass(path: Path, seed: int, stems: int) -> None:
    """Stems of grass that stand on a square metre."""
    rng = np.random.default_rng(seed)
    level = np.linspace(0, 1, 16)[:, None]
    lean = rng.normal(0, 0.08, (stems, 1, 3)) * [1, 0, 1]
    feet = rng.uniform(-0.5, 0.5, (stems, 1, 3)) * [1, 0, 1]
    points = feet + rng.uniform(0.35, 0.6, (stems, 1, 1)) * (level * [0, 1, 0] + level**2 * lean)
    _write(path, points, "0 1", 4e8, Wind(3.5, 1.0, length=0.8, seed=seed))


def vine(path: Path, seed: int, joints: int) -> None:
    """Three vines that hang between posts."""
    rng = np.random.default_rng(seed)
    level = np.linspace(-1, 1, joints)[:, None]
    sag = rng.uniform(0.5, 0.8, (3, 1, 1))
    points = level * [1.0, 0, 0] + sag * (level**2 - 1) * [0, 1, 0] + [[[0, 2, z]] for z in (-0.3, 0.0, 0.3)]
    points[:, 1:-1] += 0.002 * rng.normal(size=points[:, 1:-1].shape)
    _write(path, points, f"0 {joints - 1}", 2e7, Wind(3.5, 2.0, length=1.0, seed=seed))


def _write(path: Path, rods: np.ndarray, pins: str, young: float, wind: Wind) -> None:
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
    for step in range((FRAMES - 1) * STEPS + 1):
        if step % STEPS == 0:
            frames.append(state.flexvert_xpos.astype(np.float32))
        blown = wind.at(state.flexvert_xpos, state.time) - (state.flexvert_xpos - before) / model.opt.timestep
        before = state.flexvert_xpos.copy()
        drag = 0.6 * WIDTH * piece[:, None] * np.linalg.norm(blown, axis=1, keepdims=True) * blown
        state.xfrc_applied[bodies, :3] = drag
        mujoco.mj_step(model, state)
    clip = athcodec.MotionClip(
        np.array(frames),
        np.arange(FRAMES) / FPS,
        np.repeat(np.arange(len(rods)), count),
        np.full(len(rods), -1),
        rest=rods.reshape(-1, 3).astype(np.float32),
        metadata={"unit": "m", "up_axis": "y", "fps": FPS},
    )
    athcodec.write_hdf5(clip, path)
