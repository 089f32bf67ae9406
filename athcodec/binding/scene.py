"""Units and axes in which a mesh that is far from a plant would lie on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from athcodec.binding.search import Marks
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.scene import axis_turn
from athcodec.motion.units import AXES, METRES

FITS = 0.1  # Share of vertices far from the plant, below which a unit and an axis are named.
COVERS = 0.5  # Share of the plant that is far from the mesh, above which another unit is looked for.
SAMPLE = 4096  # Vertices that are tried.


class Fit:
    """How a mesh lies on a plant.

    Parameters
    ----------
    marks : Marks
        The plant.
    points : (V, 3) array
        The mesh, as it was taken, in the plant's unit and axes.
    limit : float
        The distance from which a point is far.
    """

    def __init__(self, marks: Marks, points: np.ndarray, limit: float):
        self._marks, self._limit = marks, limit
        self._points = points[:: max(1, len(points) // SAMPLE)]
        self._plant = marks.tree.data[:: max(1, len(marks.branch) // SAMPLE)]
        self.mesh_far, self.plant_far = self._far_shares(self._points)

    def _far_shares(self, points: np.ndarray) -> tuple[float, float]:
        """Return the share of the mesh that is far from the plant, and that of the plant that is far from the mesh."""
        back = scipy_module("spatial").cKDTree(points).query(self._plant)[0]
        there = self._marks.distance(points)
        return float((there > self._limit).mean()), float((back > self._limit).mean())

    def better_scene(self, plant: dict[str, str], assumed: dict[str, str]) -> dict[str, str]:
        """Return the "unit" and "up_axis" with which the mesh would lie on the plant, as far as they differ from those
        `assumed`; empty if none would. `plant` has those of the plant.
        """
        best, scene = np.inf, {}
        for unit, factor in _factors(assumed["unit"]):
            for axis, turn in _turns(plant["up_axis"], assumed["up_axis"]):
                mesh_far, plant_far = self._far_shares(factor * self._points @ turn.T)
                if mesh_far < FITS and plant_far < COVERS and mesh_far + plant_far < best:
                    best, scene = mesh_far + plant_far, {"unit": unit, "up_axis": axis}
        return {name: value for name, value in scene.items() if value != assumed[name]}


def _factors(assumed: str) -> Iterator[tuple[str, float]]:
    """Yield each unit of length, and the factor that brings a mesh into it which was read as if in the unit
    `assumed`."""
    for unit, length in METRES.items():
        yield unit, length / METRES[assumed]


def _turns(up: str, assumed: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield up axes, and the turn of a mesh that was taken to have another one and turned from there to `up`."""
    if up not in AXES:  # An axis that points down is not converted.
        yield assumed, np.eye(3)
        return
    for axis in AXES:
        yield axis, axis_turn(axis, up) @ axis_turn(assumed, up).T
