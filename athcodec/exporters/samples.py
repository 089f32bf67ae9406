"""Samples for motion blur: positions between frames, and velocities at every sample.

Between two frames a vertex goes along a straight line, as players show it. Velocities are differences of the positions
that are written. No file format is known here.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from athcodec.exporters.scene_objects import SceneObject, objects_of
from athcodec.exporters.timing import frame_rate_of
from athcodec.motion.frames import Frames
from athcodec.motion.presence import PRESENCE, stated_presence
from athcodec.motion.protocol import Motion

Sample = tuple[int, *tuple[np.ndarray, ...]]  # The number of a frame, its positions, and velocities if it has them.

# ---- positions between frames ----


def with_samples(motion: Motion, samples: int) -> Motion:
    """Return the motion of one clip with `samples` samples for each interval between frames; the first sample of an
    interval is the frame itself.

    If the clip is a loop, the interval from its last frame to its first one has samples, too. Objects that appear or
    vanish in an interval stand still in it, because they have no place at its other end.
    """
    if samples == 1 or motion.frame_count == 1:
        return motion
    is_loop, frame_count, rate = _is_loop(motion), motion.frame_count, frame_rate_of(motion)
    count = samples * frame_count if is_loop else samples * (frame_count - 1) + 1
    shares = np.arange(count) % samples / samples
    knots = np.append(motion.time, motion.time[-1] + _frame_time(motion))
    steps = np.diff(knots)
    times = np.repeat(motion.time, samples)[:count] + shares * np.repeat(steps, samples)[:count]
    ranges = tuple(replace(clip_range, frame_count=count) for clip_range in motion.clip_ranges)
    stated = dict(motion.metadata) | {"fps": rate}
    if PRESENCE in stated:
        runs = {name: np.minimum(samples * np.array(runs), count) for name, runs in stated_presence(stated).items()}
        stated[PRESENCE] = {name: each.tolist() for name, each in runs.items()}
    presence = _Presence(objects_of(motion), motion.vertex_count)

    def between(frame: int, here: np.ndarray, after: np.ndarray, some: Sequence[int]) -> np.ndarray:
        """Return the samples of these numbers, 0 to `samples`, behind a frame, (k, N, 3)."""
        way = after - here
        if (moved := presence.joined(frame, (frame + 1) % frame_count)) is not None:
            way[~moved] = 0
        return np.stack([after if number == samples else here + way * (number / samples) for number in some])

    class Sampled(type(motion)):  # type: ignore[misc]
        frame_count = property(lambda self: count)
        time = property(lambda self: times)
        metadata = property(lambda self: stated)
        clip_ranges = property(lambda self: ranges)
        positions = property(lambda self: Frames(self.block, count, motion.vertex_count, motion.dtype))

        def block(self, start: int, stop: int) -> np.ndarray:
            return np.concatenate(
                [self._of_frame(frame, start, stop) for frame in range(start // samples, (stop - 1) // samples + 1)]
            )

        def _of_frame(self, frame: int, start: int, stop: int) -> np.ndarray:
            some = range(max(start - samples * frame, 0), min(stop - samples * frame, samples))
            here = motion.block(frame, frame + 1)[0]
            if some.stop == 1:
                return here[None]
            after = (frame + 1) % frame_count
            return between(frame, here, motion.block(after, after + 1)[0], some)

        def blocks(self, *_: object) -> Iterator[tuple[int, np.ndarray]]:
            """Yield the number of the first sample and the positions (k, N, 3) of consecutive samples, interval by
            interval.
            """
            first: np.ndarray | None = None
            before: np.ndarray | None = None
            for start, block in motion.blocks():
                for frame, here in enumerate(block, start):
                    if before is None:
                        first = here
                        yield 0, here[None]
                    else:
                        yield samples * (frame - 1) + 1, between(frame - 1, before, here, range(1, samples + 1))
                    before = here
            if is_loop and before is not None and first is not None:
                yield count - samples + 1, between(frame_count - 1, before, first, range(1, samples))

    sampled = copy.copy(motion)
    sampled.__class__ = Sampled
    return sampled


def _is_loop(motion: Motion) -> bool:
    return len(motion.clip_ranges) == 1 and motion.clip_ranges[0].loop and motion.frame_count > 1


def _frame_time(motion: Motion) -> float:
    """Return the mean time of a frame in seconds, after which the first frame of a loop follows its last."""
    return float(motion.time[-1] - motion.time[0]) / (motion.frame_count - 1)


class _Presence:
    """Which vertices are there in both of two frames, or in neither."""

    def __init__(self, objects: Sequence[SceneObject], vertex_count: int):
        self._hidden = [(obj, obj.shown) for obj in objects if obj.shown is not None]
        self._vertex_count = vertex_count

    def joined(self, frame: int, other: int) -> np.ndarray | None:
        """Return which vertices are present at both frames or absent at both, (N,) bool; None if that holds for all
        vertices.
        """
        changed = [(obj, shown) for obj, shown in self._hidden if (shown[frame] != shown[other]).any()]
        if not changed:
            return None
        joined = np.ones(self._vertex_count, bool)
        for obj, shown in changed:
            joined[obj.vertices] = np.repeat(shown[frame] == shown[other], obj.count // shown.shape[1])
        return joined


# ---- velocities ----


def samples_of(motion: Motion, objects: Sequence[SceneObject], has_velocities: bool) -> Iterator[Sample]:
    """Yield the number of each frame and its positions, (N, 3) float32; and its velocities in lengths per second,
    (N, 3) float32, if `has_velocities`.

    Velocities are central differences over both neighbours in time. At the ends of a clip that is no loop, and where an
    object appears or vanishes, they are differences from the only neighbour; without any they are 0.
    """
    frames = ((start + row, here) for start, block in motion.blocks() for row, here in enumerate(block))
    moving: Iterator[Sample] = _with_velocities(motion, objects, frames) if has_velocities else frames
    for frame, *arrays in moving:
        yield frame, *(each.astype(np.float32, copy=False) for each in arrays)


def _with_velocities(
    motion: Motion, objects: Sequence[SceneObject], frames: Iterator[tuple[int, np.ndarray]]
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Yield each frame's number, positions (N, 3) and velocities (N, 3). A frame is yielded when the next one has been
    read.
    """
    presence, steps, last = _Presence(objects, motion.vertex_count), _steps(motion), motion.frame_count - 1

    def slope(frame: int, before: np.ndarray, here: np.ndarray) -> np.ndarray:
        """Return the velocities between a frame and the one before, NaN where an object appears or vanishes."""
        velocity = (here.astype(np.float64) - before) / steps[frame]
        if (joined := presence.joined(frame - 1, frame)) is not None:
            velocity[~joined] = np.nan
        return velocity

    _, here = next(frames)
    first = slope(0, motion.block(last, last + 1)[0], here)  # It is NaN unless the clip is a loop.
    arriving = first
    for frame, after in frames:
        leaving = slope(frame, here, after)
        yield frame - 1, here, _velocity(arriving, leaving, steps[frame - 1], steps[frame])
        here, arriving = after, leaving
    yield last, here, _velocity(arriving, first, steps[last], steps[0])


def velocities_of_copies(
    motion: Motion, shown: np.ndarray | None, places: np.ndarray, turns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocities of k copies that are moved by places (T, k, 3) and quaternions (T, k, 4), as two float32
    arrays (T, k, 3).

    The first array has the velocities of the places, in scene units per second. The second has those of the rotations:
    vectors along the axis, as long as the degrees per second. `shown` tells in which frames each copy is visible, as in
    SceneObject.
    """
    places, turns = places.astype(np.float64), turns.astype(np.float64)
    steps = _steps(motion)[:, None, None]
    shown = np.ones((len(places), 1), bool) if shown is None else shown
    joined = (shown == np.roll(shown, 1, axis=0))[..., None]
    velocities = []
    for ways in (places - np.roll(places, 1, axis=0), _turned(np.roll(turns, 1, axis=0), turns)):
        arriving = np.where(joined, ways, np.nan) / steps
        velocities.append(_velocity(arriving, np.roll(arriving, -1, axis=0), steps, np.roll(steps, -1, axis=0)))
    return velocities[0], velocities[1]


def _steps(motion: Motion) -> np.ndarray:
    """Return (T,) the seconds that each frame follows the one before; of the first frame those that it follows the last
    one of a loop, else NaN."""
    return np.append(_frame_time(motion) if _is_loop(motion) else np.nan, np.diff(motion.time))


def _velocity(arriving: np.ndarray, leaving: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return velocities, float32, at the middle of three times from those before and behind, whose steps may differ.

    It is the slope of the parabola through the three. A velocity that is NaN does not count; 0 if both are.
    """
    with np.errstate(over="ignore"):
        central = (after * arriving + before * leaving) / (before + after)
        known = np.where(np.isnan(arriving), leaving, np.where(np.isnan(leaving), arriving, central))
        return np.where(np.isnan(known), 0.0, known).astype(np.float32)


def _turned(before: np.ndarray, here: np.ndarray) -> np.ndarray:
    """Return the rotations from some quaternions (x, y, z, w) to others as vectors (..., 3) along the axis, as long as
    the angle in degrees. The shorter way round is taken.
    """
    axis, real = here[..., :3], here[..., 3:]
    other, other_real = -before[..., :3], before[..., 3:]
    across = real * other + other_real * axis + np.cross(axis, other)
    cosine = real * other_real - (axis * other).sum(axis=-1, keepdims=True)
    across, cosine = np.where(cosine < 0, -across, across), np.abs(cosine)
    sine = np.linalg.norm(across, axis=-1, keepdims=True)
    degrees = np.degrees(2 * np.arctan2(sine, cosine))
    return across * (degrees / np.where(sine > 0, sine, 1.0))
