"""Bark of a skeleton: a ring of vertices around every node, joined to the ring below."""

from __future__ import annotations

import numpy as np

from bench.trees.plant import Plant


def tubes(plant: Plant, sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the bark of a plant with N nodes: points (N * sides, 3), a ring of `sides` points around each node in
    turn, and quadrilateral faces (F, 4).
    """
    along = plant.elements + (plant.parent < 0)[:, None] * [0.0, 1.0, 0.0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    first = np.cross(along, [0.3, 0.2, 1.0])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    turns = 2 * np.pi * np.arange(sides)[:, None] / sides
    ring = np.cos(turns) * first[:, None] + np.sin(turns) * np.cross(along, first)[:, None]
    points = plant.position[:, None] + plant.radius[:, None, None] * ring
    here, after = np.arange(sides), np.roll(np.arange(sides), -1)
    above = np.arange(1, len(plant.parent))[:, None] * sides
    below = plant.parent[1:, None] * sides
    faces = np.stack([below + here, below + after, above + after, above + here], axis=-1)
    return points.reshape(-1, 3), faces.reshape(-1, 4)
