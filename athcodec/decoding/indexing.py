"""Indices of an array (frames, vertices, 3) whose frames are decoded when they are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, SupportsIndex, TypeAlias

import numpy as np

from athcodec.errors import LevelUnavailable
from athcodec.options import whole

Frames: TypeAlias = SupportsIndex | slice | Sequence[SupportsIndex] | np.ndarray
"""A frame, or several, as the first index of an array names them."""
BETWEEN = "; at(seconds) shows the motion between frames"


def split_index(index: Any, frame_count: int) -> tuple[np.ndarray, Any]:
    """Return (frames, rest): the frames that a NumPy index of the positions needs, ascending, and the index that
    selects the same items from an array of these frames alone.

    Raises
    ------
    LevelUnavailable
        If one of the frames does not exist.
    TypeError
        If a frame is not a whole number.
    """
    keys = list(index) if isinstance(index, tuple) else [index]
    place = next((place for place, key in enumerate(keys) if key is not None), len(keys))
    chosen = Ellipsis if place == len(keys) else keys[place]
    if isinstance(chosen, slice):
        try:
            frames = np.arange(*chosen.indices(frame_count))
        except TypeError:
            raise TypeError(f"frames: got {chosen}, expected whole numbers{BETWEEN}") from None
        keys[place] = slice(None)
        if len(frames) > 1 and frames[0] > frames[1]:
            frames, keys[place] = frames[::-1], slice(None, None, -1)
        return frames, tuple(keys)
    numbers = np.asarray(chosen)
    if chosen is Ellipsis or (numbers.dtype == bool and numbers.shape != (frame_count,)):
        return np.arange(frame_count), index  # NumPy itself says what such an index of the whole array means.
    if numbers.dtype == bool:
        numbers = np.flatnonzero(numbers)
    elif numbers.size and numbers.dtype.kind not in "iu":
        items = np.array(chosen, object).ravel()  # NumPy has no common type for all integers.
        whole_numbers = [whole("frame", number, BETWEEN) for number in items]
        numbers = np.reshape(whole_numbers, numbers.shape)
    numbers = numbers.astype(np.intp)
    for number in numbers[(numbers < -frame_count) | (numbers >= frame_count)].ravel()[:1]:
        raise LevelUnavailable(f"frame: got {number}; expected 0 to {frame_count - 1}")
    frames, items = np.unique(numbers.ravel() % frame_count, return_inverse=True)
    keys[place] = items.reshape(numbers.shape) if numbers.ndim else 0
    return frames, tuple(keys)
