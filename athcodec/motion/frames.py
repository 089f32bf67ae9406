"""Positions that are computed when they are asked for, in place of an array in memory.

A reader has a function that makes a run of frames; a MotionClip, and whatever joins clips or changes their units,
slices the result as it would an array.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import DTypeLike

from athcodec.untyped import ArrayLike

KEPT_BYTES = 64 << 20  # Bytes of the positions of clips whose frames are kept.
FAR = 64  # Distance from the origin, in extents of the plant, beyond which float32 loses too many bits of its shape.


def is_far(points: np.ndarray) -> bool:
    """Return whether points (N, 3) lie so far from the origin, as those in map coordinates do, that float32 rounds them
    coarsely."""
    with np.errstate(all="ignore"):
        return bool(len(points) and np.abs(points).max() > FAR * np.ptp(points, axis=0).max())


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
    keeps : bool, optional
        Whether frames that were made are kept, up to KEPT_BYTES in all: for those that are parsed or posed.
    """

    def __init__(
        self,
        read: Callable[[int, int], np.ndarray],
        frame_count: int,
        vertex_count: int,
        dtype: DTypeLike = np.float32,
        keeps: bool = False,
    ):
        self._read = read
        self.shape, self.dtype = (frame_count, vertex_count, 3), np.dtype(dtype)
        self.chunks: ArrayLike = None  # Rows that are best read together, as h5py and dask state them; None: not known.
        keeps &= 3 * frame_count * vertex_count * self.dtype.itemsize <= KEPT_BYTES
        self._kept = np.empty(self.shape, self.dtype) if keeps else None
        self._is_kept = np.zeros(frame_count, bool)

    def __repr__(self) -> str:
        return f"<Frames: {self.shape}, {self.dtype}, read when they are sliced>"

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, frames: slice) -> np.ndarray:
        """Return the positions (k, N, 3) of a slice of frames, reading those that are not in memory. The step of the
        slice has to be 1."""
        start, stop, step = frames.indices(self.shape[0])
        if step != 1:
            raise ValueError(f"frames: got a step of {step}, expected 1")
        if start >= stop:
            return np.empty((0, *self.shape[1:]), self.dtype)
        if self._kept is None:
            return self._read(start, stop)
        missing = start + np.flatnonzero(~self._is_kept[start:stop])
        for run in np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1) if len(missing) else ():
            self._kept[run[0] : run[-1] + 1] = self._read(int(run[0]), int(run[-1]) + 1)
            self._is_kept[run] = True
        kept = self._kept[start:stop]
        kept.flags.writeable = False
        return kept
