"""Units and axes in which a mesh that is far from a plant would lie on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from athcodec.binding.search import Marks
from athcodec.motion.scene import axis_turn
from athcodec.motion.units import AXES, METRES, metres_of

FITS = 0.1  # Share of vertices far from the plant, below which a unit and an axis are named.
SAMPLE = 4096  # Vertices that are tried.


def far_share(marks: Marks, points: np.ndarray, limit: float) -> float:
    """Return the share of points (V, 3) that are further from the plant than a length."""
    return float((marks.distance(points) > limit).mean())


def fitting_scene(marks: Marks, points: np.ndarray, limit: float, plant: dict, mesh: dict) -> tuple[str, str] | None:
    """Return the unit and the up axis of a mesh in which it would lie on the plant, or None.

    `points` (V, 3) are the mesh as it was taken, in the plant's unit and axes; `plant` and `mesh` are the metadata of
    both. A unit or axis that needs no change is "".
    """
    points = points[:: max(1, len(points) // SAMPLE)]
    best, found = FITS, None
    for unit, factor in _factors(plant, mesh):
        for axis, turn in _turns(plant, mesh):
            share = far_share(marks, factor * points @ turn.T, limit)
            if (unit or axis) and share < best:
                best, found = share, (unit, axis)
    return found


def _factors(plant: dict, mesh: dict) -> Iterator[tuple[str, float]]:
    yield "", 1.0
    metres = metres_of(plant) or 1.0
    taken = metres_of(mesh) or metres
    for unit, length in METRES.items():
        if length != taken:
            yield unit, length / taken


def _turns(plant: dict, mesh: dict) -> Iterator[tuple[str, np.ndarray]]:
    yield "", np.eye(3)
    up = plant.get("up_axis") or "y"
    taken = mesh.get("up_axis") or up
    for axis in AXES:
        if axis != taken and up in AXES and taken in AXES:
            # Back to the axes of the file, and from there as if its up axis were the other one.
            yield axis, axis_turn(axis, up) @ axis_turn(taken, up).T
