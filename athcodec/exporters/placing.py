"""Motions for formats whose points are float32: how far that rounds them, and far from the origin a place for them.

Points in map coordinates lose their shape in float32. Formats with transforms get them about a place in the plant, and
hold that place in double precision.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Protocol, cast

import numpy as np

from athcodec.motion.frames import is_far
from athcodec.motion.protocol import Motion


class SinglesMotion(Motion, Protocol):
    """A motion about a place, as `in_singles` gives it."""

    origin: np.ndarray
    rounding: float


def in_singles(motion: Motion, can_move: bool) -> SinglesMotion:
    """Return the motion in float64, relative to its new attribute `origin` (3,). The origin is 0 unless `can_move` is
    true and the positions are too far from 0 for float32.

    The attribute `rounding` is the largest distance by which float32 moves a vertex in the blocks read so far.
    """
    rest = np.asarray(motion.rest, np.float64)
    place = (rest.min(axis=0) + rest.max(axis=0)) / 2 if can_move and is_far(rest) else np.zeros(3)
    origin = place.astype(np.float32).astype(np.float64)

    class InSingles(type(motion)):  # type: ignore[misc]
        rounding: float
        rest = property(lambda self: motion.rest - origin)
        source_rest = property(lambda self: getattr(motion, "source_rest", motion.rest))

        def block(self, start: int, stop: int) -> np.ndarray:
            return motion.block(start, stop) - origin

        def blocks(self, *args: bool) -> Iterator[tuple[int, np.ndarray]]:
            for start, block in motion.blocks(*args):
                points = block - origin
                away = np.linalg.norm(points - points.astype(np.float32), axis=-1)
                self.rounding = max(self.rounding, float(away.max(initial=0.0)))
                yield start, points

    moved = cast(SinglesMotion, copy.copy(motion))
    moved.__class__, moved.origin, moved.rounding = InSingles, origin, 0.0
    return moved


def origin_of(motion: Motion) -> list[float] | None:
    """Return the origin that positions of a motion are relative to, x, y and z; None if it is 0."""
    origin = getattr(motion, "origin", None)
    return origin.tolist() if origin is not None and origin.any() else None
