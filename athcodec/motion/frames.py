"""Positions that are computed when they are asked for, in place of an array in memory.

A reader has a function that makes a run of frames; a MotionClip, and whatever joins clips or changes their units,
slices the result as it would an array.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import DTypeLike


class Frames:
    """Positions (T, N, 3) of which only the frames that are sliced exist.

    Parameters
    ----------
    read : callable
        read(start, stop) gives frames start to stop - 1 as (stop - start, N, 3) in `dtype`; 0 <= start < stop <= T. It
        may raise ClipError, and is called by one thread at a time, mostly forward, often twice over the whole clip.
    frame_count, vertex_count : int
        T and N.
    dtype : dtype, optional
        float32 by default.
    """

    def __init__(
        self, read: Callable[[int, int], np.ndarray], frame_count: int, vertex_count: int, dtype: DTypeLike = np.float32
    ):
        self._read = read
        self.shape, self.dtype = (frame_count, vertex_count, 3), np.dtype(dtype)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, frames: slice) -> np.ndarray:
        start, stop, step = frames.indices(self.shape[0])
        if step != 1:
            raise ValueError(f"frames: got a step of {step}, expected 1")
        if start >= stop:
            return np.empty((0, *self.shape[1:]), self.dtype)
        return self._read(start, stop)
