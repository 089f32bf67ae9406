"""Objects that are copies of one shape, as that shape and what places each copy: for formats that have instances.

The shape is the first copy's at rest, about its middle and along its principal axes; a copy is placed by a translation,
a rotation and three scales, fitted frame by frame (fitting.py). How far that is off is measured on every vertex. It
knows no file format.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from athcodec.exporters.fitting import Parts, Placed, allowed_error, portions
from athcodec.exporters.scene_objects import SceneObject, face_materials
from athcodec.motion.protocol import Motion
from athcodec.untyped import JsonObject


@dataclass(eq=False)
class Copies:
    """shape (m, 3); of k copies in T frames places (T, k, 3), turns (T, k, 4), quaternions x y z w whose signs run on,
    scales (T, k, 3), and the same at rest, (k, 3), (k, 4), (k, 3), all float32; the largest distance of a vertex from
    where it was to be; and the axes of the shape, as columns (3, 3), in the first copy at rest."""

    shape: np.ndarray
    places: np.ndarray
    turns: np.ndarray
    scales: np.ndarray
    rest: tuple[np.ndarray, np.ndarray, np.ndarray]
    max_error: float
    axes: np.ndarray


def fit_copies(motion: Motion, objects: list[SceneObject], allowed: float | None = None) -> dict[int, Copies]:
    """Return the transforms that place the copies of an object's shape, by the object's number. Only objects are
    included whose copies have the same materials and stay within `allowed` of the motion, in scene units; by default
    within the level's error.
    """
    allowed = allowed_error(motion) if allowed is None else allowed
    materials = face_materials(motion)
    fits = {
        number: _Fit(motion, obj)
        for number, obj in enumerate(objects)
        if obj.copies > 1
        and obj.count
        and (materials is None or rows_of_one(materials[0][obj.face_rows], obj) is not None)
    }
    for start, frames in portions(motion, motion.vertex_count) if fits else ():
        for fit in fits.values():
            fit.add(start, frames)
    return {number: fit.copies for number, fit in fits.items() if fit.copies.max_error <= allowed}


def cost_of(instanced: dict[int, Copies]) -> JsonObject:
    """Return what a writer reports about instances: their number, and the largest error that they cause. The result is
    empty if there are none.
    """
    if not instanced:
        return {}
    error = max(copies.max_error for copies in instanced.values())
    return {
        "animation": "instances",
        "instances": sum(copies.places.shape[1] for copies in instanced.values()),
        "max_error": error,
    }


def one_copy(obj: SceneObject) -> SceneObject:
    """Return the first copy as an object of its own."""
    (counts, indices), copies = obj.faces, obj.copies
    faces = counts[: len(counts) // copies], indices[: len(indices) // copies]
    return replace(obj, count=obj.count // copies, faces=faces, curves=obj.curves[: len(obj.curves) // copies])


def rows_of_one(rows: np.ndarray, obj: SceneObject) -> np.ndarray | None:
    """Return the rows of the first copy, of those of a static array; None where others have other ones."""
    each = rows.reshape(obj.copies, -1, *rows.shape[1:])
    return each[0] if (each == each[:1]).all() else None


class _Fit:
    """The copies of one object, fitted as the frames come."""

    def __init__(self, motion: Motion, obj: SceneObject):
        """Take the first copy of an object, at rest, as the shape of all copies, and fit transforms that place the
        copies of the rest pose.
        """
        self._rows, count = obj.vertices, obj.count // obj.copies
        rest = np.asarray(motion.rest, np.float64)[obj.vertices]
        part = Parts.over(np.arange(count), np.zeros(1, np.int64), np.array([count]), rest[:count])
        shape = ((rest[:count] - part.middle[0]) @ part.axes[0]).astype(np.float32)
        self._local = shape.astype(np.float64)
        spread = np.tile((self._local**2).mean(axis=0), (obj.copies, 1))
        self._solver = Placed(spread, np.tile(part.axes[0], (obj.copies, 1, 1)))
        room = (motion.frame_count, obj.copies)
        places, turns, scales = (np.empty((*room, width), np.float32) for width in (3, 4, 3))
        (place, turn, scale), _ = self._placed(rest.reshape(obj.copies, count, 3))
        self.copies = Copies(
            shape,
            places,
            turns,
            scales,
            (place.astype(np.float32), turn.astype(np.float32), scale.astype(np.float32)),
            0.0,
            part.axes[0],
        )

    def add(self, start: int, frames: np.ndarray) -> None:
        """Fit the next frames."""
        copies = self.copies
        points = frames[:, self._rows].astype(np.float64).reshape(len(frames), copies.places.shape[1], -1, 3)
        for frame, placed in enumerate(points, start):
            (copies.places[frame], copies.turns[frame], copies.scales[frame]), error = self._placed(placed)
            copies.max_error = max(copies.max_error, error)

    def _placed(self, points: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], float]:
        """Return places, turns and scales of copies at points (k, m, 3), and how far off that leaves one."""
        middle = points.mean(axis=1)
        away = points - middle[:, None]
        linear, (turns, scales) = self._solver(np.einsum("kmi,mj->kij", away, self._local) / len(self._local))
        square = ((away - self._local @ linear.swapaxes(1, 2)) ** 2).sum(axis=2)
        return (middle, turns, scales), float(np.sqrt(square.max()))
