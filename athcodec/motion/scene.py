"""Clips brought to another unit of length and up axis."""

from __future__ import annotations

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import MotionClip
from athcodec.motion.frames import Frames
from athcodec.motion.units import AXES, METRES, METRES_PER_UNIT, metres_of


def in_scene(clip: MotionClip, unit: str | None, up_axis: str | None) -> MotionClip:
    """Return a clip in a unit of METRES and with an up axis, "x", "y" or "z"; None keeps what it has.

    A clip that states no unit, or no axis, is taken to be in that one. Raises ClipError for a clip whose axis points
    down or is unknown.
    """
    return _in_axes(_in_units(clip, unit), up_axis)


def axis_turn(before: str, after: str) -> np.ndarray:
    """Return the matrix (3, 3) of the right-angled turn that takes the axis `before` ("x", "y" or "z") to the axis
    `after`."""
    first, last = "xyz".index(before), "xyz".index(after)
    turn = np.eye(3)
    if first != last:
        third = 3 - first - last
        turn = np.zeros((3, 3))
        turn[last, first], turn[first, last], turn[third, third] = 1.0, -1.0, 1.0
    return turn


def _in_units(clip: MotionClip, unit: str | None) -> MotionClip:
    if unit is None:
        return clip
    metres = metres_of(clip.metadata)
    factor = 1.0 if metres is None or clip.metadata.get("unit") == unit else metres / METRES[unit]
    clip.metadata.pop(METRES_PER_UNIT, None)
    return _mapped(clip, np.eye(3) * factor, unit=unit)


def _in_axes(clip: MotionClip, up_axis: str | None) -> MotionClip:
    """Return the clip turned by the right angle that takes its up axis to the wanted one."""
    if up_axis is None:
        return clip
    stated = clip.metadata.get("up_axis") or up_axis
    if stated not in AXES:
        raise ClipError(f"up_axis: got a clip with {stated!r}, expected x, y or z to turn it to {up_axis!r}")
    return _mapped(clip, axis_turn(stated, up_axis), up_axis=up_axis)


def _mapped(clip: MotionClip, matrix: np.ndarray, **metadata: str) -> MotionClip:
    """Return the clip with positions, rest pose and normals multiplied by `matrix` (3, 3), and with further
    metadata."""
    clip.metadata |= metadata
    if np.array_equal(matrix, np.eye(3)):
        return clip
    if "normals" in clip.attributes:
        turned = clip.attributes["normals"] @ (matrix / np.cbrt(np.linalg.det(matrix))).T
        clip.attributes["normals"] = turned.astype(clip.attributes["normals"].dtype)
    source, dtype = clip.positions, clip.dtype
    positions = Frames(
        lambda start, stop: (np.asarray(source[start:stop], np.float64) @ matrix.T).astype(dtype),
        clip.frame_count,
        clip.vertex_count,
        dtype,
    )
    rest = (clip.rest @ matrix.T).astype(clip.rest_dtype)
    return clip.replace(positions=positions, rest=rest, rest_given=clip.rest_given)
