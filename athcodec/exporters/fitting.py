"""The rigid or affine parts of a motion, for formats that hold transforms in place of vertices.

It starts from the parts that an .ath file has at a level (nodes and stems), or from the branches of a clip, and fits to
each, frame by frame, what a format can do: `Placed` finds translation, rotation and three scales, `Mapped` any affine
map. A part that this leaves further off than allowed, such as a stem that bends, is cut into shorter ones, down to
single vertices, which a translation places exactly. It knows no file format.

A part has its own axes: its middle and its principal axes at rest, along which a stem stretches and thins. With scales
fixed the rotation is the orthogonal Procrustes solution (Schonemann, Psychometrika 31, 1966), with the rotation fixed
each scale is a projection; the two take turns. Axes along which a part has no extent follow the frame before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from athcodec.decoding.clip_view import ClipView
from athcodec.exporters import Progress
from athcodec.motion.algebra import nearest_rotations
from athcodec.motion.hierarchy import build_hierarchy, hierarchy_of
from athcodec.motion.protocol import Motion
from athcodec.motion.quaternions import quaternions

ROUNDS = 8
CONVERGED = 1e-5
SMALLEST_SCALE = 1e-4
HELD = 1e-9  # how much, of a part's own extent, the rotation of the frame before counts
FLOAT32_EXTENT = 1e-5  # Smallest extent, over the distance from the origin, that float32 holds well enough to scale.
ROUGHLY = 8  # one frame in so many is looked at first
WORK_BYTES = 32 << 20
FINEST = 1e-5  # Smallest tolerance of a fit, over the clip's size.
OF_LEVEL = 1.0  # Error that a transform may add to the level's, over the level's error.
OF_CLIP = 1e-4  # Tolerance over the clip's size, for clips without levels.

# Ranges of the vertices that parts hold (first, count), the places of the parts, and what the solver gave.
Batch = tuple[np.ndarray, np.ndarray, np.ndarray, list[np.ndarray]]


def allowed_error(motion: Motion) -> float:
    """Return how far transforms may be off, in scene units: as far as the level itself is; of a clip OF_CLIP of its
    size."""
    size = float(np.linalg.norm(np.ptp(np.asarray(motion.rest, np.float64), axis=0)))
    return max(OF_LEVEL * float(motion.max_error), FINEST * size) if isinstance(motion, ClipView) else OF_CLIP * size


@dataclass(eq=False)
class Parts:
    """K parts: part k is the vertices order[first[k] : first[k] + count[k]] of the clip. Its `middle` (K, 3), its axes
    as columns (K, 3, 3), the mean squares along them (K, 3), and how far its vertices go along them, the `extent`."""

    order: np.ndarray
    first: np.ndarray
    count: np.ndarray
    middle: np.ndarray
    axes: np.ndarray
    spread: np.ndarray
    extent: np.ndarray

    def __len__(self) -> int:
        return len(self.first)

    @classmethod
    def over(cls, order: np.ndarray, first: np.ndarray, count: np.ndarray, rest: np.ndarray) -> Parts:
        """Return parts of the rest pose (N, 3), with their middles, axes and extents. Part k holds the vertices
        `order[first[k]:first[k] + count[k]]`.
        """
        rows = np.concatenate([order[a : a + n] for a, n in zip(first, count)])
        starts, points = np.cumsum(count) - count, rest[rows]
        middle = np.add.reduceat(points, starts) / count[:, None]
        away = points - np.repeat(middle, count, axis=0)
        square = np.add.reduceat(away[:, :, None] * away[:, None, :], starts) / count[:, None, None]
        spread, axes = np.linalg.eigh(square)
        axes[:, :, 0] *= np.sign(np.linalg.det(axes))[:, None]
        local = np.einsum("nij,ni->nj", np.repeat(axes, count, axis=0), away)
        extent = np.maximum.reduceat(np.abs(local), starts)
        spread = np.where(spread > (FLOAT32_EXTENT * np.abs(middle).max(axis=1, keepdims=True)) ** 2, spread, 0.0)
        return cls(order, first, count, middle, axes, spread, extent)

    def vertex_part(self) -> np.ndarray:
        """Return (N,) the part of each vertex of the clip, 0 where none holds it."""
        out = np.zeros(len(self.order), np.int64)
        for part, (first, count) in enumerate(zip(self.first, self.count)):
            out[self.order[first : first + count]] = part
        return out


@dataclass(eq=False)
class Moving:
    """Parts and, frame by frame, where their middles are (T, K, 3), and what the solver gave, each (T, K, width)."""

    parts: Parts
    places: np.ndarray
    values: list[np.ndarray]


class Placed:
    """Rotation and scales: values are quaternions (x, y, z, w), whose signs run on from frame to frame, and scales."""

    widths = (4, 3)

    def __init__(self, spread: np.ndarray, axes: np.ndarray):
        """Take the mean squares (K, 3) of parts along their axes (K, 3, 3)."""
        self._spread, self._axes = spread, axes
        largest = spread.max(axis=1)
        self._flat = spread <= HELD * largest[:, None]
        self._held = np.where(largest > 0, HELD * largest, 1.0)[:, None, None]
        self._before, self._scale = quaternions(axes), np.ones_like(spread)

    def __call__(self, cross: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Return maps from a part's axes, and values, for mean products (K, 3, 3) of places in a frame and in these
        axes."""
        rotation, scale = self.nearest(cross)
        turn = quaternions(rotation)
        turn *= np.where((turn * self._before).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        self._before = turn
        return rotation * scale[:, None, :], (turn, scale)

    def nearest(self, cross: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rotations (k, 3, 3) and the scales along three axes (k, 3) that best fit k cross-covariances (k,
        3, 3) of vertices and their shapes.
        """
        scale = self._scale  # The scale of the frame before is a close first guess.
        safe = np.where(self._flat, 1.0, self._spread)
        for _ in range(ROUNDS):
            rotation = nearest_rotations(cross * scale[:, None, :] + self._held * self._axes)
            reached = np.einsum("kij,kij->kj", rotation, cross) / safe
            better = np.where(self._flat, 1.0, np.maximum(reached, SMALLEST_SCALE))
            done = np.abs(better - scale).max() < CONVERGED
            scale = better
            if done:
                break
        self._axes, self._scale = rotation, scale
        return rotation, scale


class Mapped:
    """Any affine map: values are its matrix (9 numbers, row by row) from rest to frame, without the translation."""

    widths = (9,)

    def __init__(self, spread: np.ndarray, axes: np.ndarray):
        """Take the mean squares (K, 3) of parts along their axes (K, 3, 3)."""
        self._placed, self._axes = Placed(spread, axes), axes
        self._flat = spread <= 1e-6 * spread.max(axis=1)[:, None]
        self._spread = np.where(self._flat, 1.0, spread)

    def __call__(self, cross: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray]]:
        rotation, _ = self._placed.nearest(cross)
        linear = np.where(self._flat[:, None, :], rotation, cross / self._spread[:, None, :])
        return linear, ((linear @ self._axes.swapaxes(1, 2)).reshape(-1, 9),)


def fit(
    motion: Motion,
    solver: type[Placed] | type[Mapped],
    allowed: float,
    most: int,
    report: Progress,
    chosen: np.ndarray | None = None,
) -> Moving | None:
    """Return parts of a motion with a transform per frame, cut until no vertex is further off than `allowed`, in scene
    units. Return None if that takes more than `most` parts.

    `chosen` (N,), bool, names vertices of which there is at least one; parts without any of them are left out.
    """
    rest = np.asarray(motion.rest, np.float64)
    order, first, count = _ranges(motion)
    if chosen is not None:
        wanted = np.array([chosen[order[a : a + n]].any() for a, n in zip(first, count)])
        first, count = first[wanted], count[wanted]
    done: list[Batch] = []
    number = 0
    while len(first):
        if len(first) + number > most:
            return None
        parts = Parts.over(order, first, count, rest)
        error = _fitted(motion, parts, solver(parts.spread, parts.axes), rest, ROUGHLY)[
            2
        ]  # most that fail do so in one of a few frames
        good = (error <= allowed) | (count == 1)
        if good.any():
            kept = Parts.over(order, first[good], count[good], rest)
            places, values, error[good] = _fitted(motion, kept, solver(kept.spread, kept.axes), rest)
            held = (error[good] <= allowed) | (kept.count == 1)
            done.append((kept.first[held], kept.count[held], places[:, held], [value[:, held] for value in values]))
            good[good] = held
            number += int(held.sum())
        first, count = _cut(first[~good], count[~good], error[~good] / allowed if allowed > 0 else None)
        report(1 - float(count.sum()) / len(rest))
    return _joined(done, order, rest)


def _ranges(motion: Motion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the parts to begin with: an order of the vertices, and the first position and the number of vertices of
    each part in that order.
    """
    if isinstance(motion, ClipView):
        parts = motion.affines(0)
        return (
            motion.decoder.file.hierarchy.vertex_source,
            parts.first_vertex.astype(np.int64),
            (parts.vertex_count.astype(np.int64)),
        )
    hierarchy = (
        hierarchy_of(motion)
        if motion.branch_parent is not None
        else (build_hierarchy(np.zeros(motion.vertex_count, np.int32), np.array([-1]), np.asarray(motion.rest)))
    )
    return hierarchy.vertex_source, hierarchy.first_vertex.astype(np.int64), hierarchy.stem_count.astype(np.int64)


def _cut(first: np.ndarray, count: np.ndarray, excess: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Cut ranges of vertices into shorter ones and return the first positions and the numbers of vertices of the new
    ranges. `excess` is each range's error over the allowed error, which grows with the square of the length of what
    bends; None cuts into single vertices.
    """
    wanted = count if excess is None else np.ceil(np.sqrt(np.minimum(excess, 1e12)))
    pieces = np.clip(wanted, 2, count).astype(np.int64)
    number = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    of = np.repeat(np.arange(len(first)), pieces)
    starts = number * count[of] // pieces[of]
    stops = (number + 1) * count[of] // pieces[of]
    return first[of] + starts, stops - starts


def _fitted(
    motion: Motion, parts: Parts, solver: Placed | Mapped, rest: np.ndarray, step: int = 1
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Fit a transform to every part in every `step`-th frame; the other frames stay unset. Return the places (T, K, 3)
    of K parts, a list of the solver's values such as rotations and scales, each (T, K, width), and the largest error
    (K,) of each part.
    """
    rows = np.concatenate([parts.order[a : a + n] for a, n in zip(parts.first, parts.count)])
    starts, part = np.cumsum(parts.count) - parts.count, np.repeat(np.arange(len(parts)), parts.count)
    local = np.einsum("nij,ni->nj", parts.axes[part], rest[rows] - parts.middle[part])
    places = np.empty((motion.frame_count, len(parts), 3))
    values = [np.empty((motion.frame_count, len(parts), width)) for width in solver.widths]
    error = np.zeros(len(parts))
    for start, frames in portions(motion, len(rows)):
        numbers = np.arange(start + -start % step, start + len(frames), step)
        if not len(numbers):
            continue
        points = frames[numbers - start][:, rows].astype(np.float64)
        middle = np.add.reduceat(points, starts, axis=1) / parts.count[:, None]
        points -= middle[:, part]
        places[numbers] = middle
        cross = np.empty((len(numbers), len(parts), 3, 3))
        for i in range(3):
            for j in range(3):
                cross[:, :, i, j] = np.add.reduceat(points[:, :, i] * local[:, j], starts, axis=1) / parts.count
        for i, number in enumerate(numbers):
            linear, fit = solver(cross[i])
            for kept, value in zip(values, fit):
                kept[number] = value
            points[i] -= np.einsum("nij,nj->ni", linear[part], local)
        square = np.einsum("tni,tni->tn", points, points).max(axis=0)
        error = np.maximum(error, np.sqrt(np.maximum.reduceat(square, starts)))
    return places, values, error


def portions(motion: Motion, vertex_count: int) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the blocks of a motion, in portions for work on that many of its vertices."""
    step = max(1, WORK_BYTES // (vertex_count * 24))
    for start, frames in motion.blocks():
        for first in range(0, len(frames), step):
            yield start + first, frames[first : first + step]


def _joined(done: list[Batch], order: np.ndarray, rest: np.ndarray) -> Moving:
    first, count = (np.concatenate([batch[i] for batch in done]) for i in range(2))
    by_place = np.argsort(first)
    places = np.concatenate([batch[2] for batch in done], axis=1)[:, by_place]
    values = [np.concatenate([batch[3][i] for batch in done], axis=1)[:, by_place] for i in range(len(done[0][3]))]
    return Moving(Parts.over(order, first[by_place], count[by_place], rest), places, values)
