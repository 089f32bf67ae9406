"""Blades of grass in one wind."""

from __future__ import annotations

import numpy as np

from athcodec import MotionClip
from bench.odd.bending import FPS

DENSITY = 1000.0  # blades in a square metre
GUSTS = 8
ORDERS = ("blades", "interleaved", "shuffled")


def grass(
    seed: int, blades: int = 800, points: int = 7, frames: int = 160, named: bool = True, order: str = "blades"
) -> MotionClip:
    """Return a meadow of `blades` blades of `points` points each, in gusts of one wind that travel across it. Blades
    are branches if `named` is true; there are no faces.

    `order` is the order of the vertices: "blades" for blade after blade, "interleaved" for all lowest points before all
    second ones, "shuffled" for a random order.
    """
    rng = np.random.default_rng(seed)
    positions = _bending(rng, blades, points, np.arange(frames) / FPS)  # (T, blades, points, 3)
    branch, place = np.divmod(np.arange(blades * points), points)
    vertices = {
        "blades": np.arange(blades * points),
        "interleaved": np.argsort(place, kind="stable"),
        "shuffled": rng.permutation(blades * points),
    }[order]
    names = {"vertex_branch": branch[vertices], "branch_parent": np.full(blades, -1), "stem_index": place[vertices]}
    return MotionClip(
        positions.reshape(frames, -1, 3)[:, vertices].astype(np.float32),
        np.arange(frames) / FPS,
        metadata={"unit": "m", "up_axis": "y", "fps": FPS},
        **(names if named else {}),
    )


def _bending(rng: np.random.Generator, blades: int, points: int, time: np.ndarray) -> np.ndarray:
    """Return the points (T, blades, points, 3) of blades at times (T,) in seconds, relative to their feet. The lowest
    points stand still, and every other point keeps its distance to the point below.
    """
    side = np.sqrt(blades / DENSITY)
    foot = np.stack([rng.uniform(0, side, blades), np.zeros(blades), rng.uniform(0, side, blades)], axis=-1)
    length, limp = rng.uniform(0.25, 0.5, blades), rng.uniform(0.6, 1.4, blades)
    facing, droop = rng.uniform(0, 2 * np.pi, blades), rng.uniform(0.1, 0.6, blades)
    gust = _gusts(rng, time, foot)
    flutter = 0.02 * np.sin(2 * np.pi * rng.uniform(1.5, 3.0, blades) * time[:, None] + rng.uniform(0, 6.28, blades))
    lean_x = limp * (0.35 + 0.5 * gust) + droop * np.cos(facing)
    lean_z = droop * np.sin(facing) + flutter
    share = np.arange(1, points) / max(1, points - 1)  # an element leans the more the higher it is
    lean = np.stack([lean_x, lean_z], axis=-1)[:, :, None] * share[:, None]
    angle = np.linalg.norm(lean, axis=-1, keepdims=True)
    sideways = lean * np.sinc(angle / np.pi)
    step = np.stack([sideways[..., 0], np.cos(angle[..., 0]), sideways[..., 1]], axis=-1)
    step *= (length / max(1, points - 1))[:, None, None]
    rise = np.cumsum(step, axis=2)
    return foot[:, None] + np.concatenate([np.zeros_like(rise[:, :, :1]), rise], axis=2)


def _gusts(rng: np.random.Generator, time: np.ndarray, foot: np.ndarray) -> np.ndarray:
    """Return (T, blades) strengths about 0, which travel with the wind along x."""
    hertz, phase = rng.uniform(0.15, 1.2, GUSTS), rng.uniform(0, 2 * np.pi, GUSTS)
    across = rng.normal(0, 0.5, GUSTS)
    late = foot[:, :1] / 2.0 + across * foot[:, 2:]  # seconds
    waves = np.sin(2 * np.pi * hertz * (time[:, None, None] - late) + phase)
    return waves @ (rng.uniform(0.5, 1.0, GUSTS) / np.sqrt(GUSTS))
