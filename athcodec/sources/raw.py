"""Positions that lie in a file as plain numbers: sought and read frame by frame, never mapped into memory, so that a
file which becomes shorter gives an error and not a crash. It knows no file format.
"""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.frames import Frames


def raw_frames(file: BinaryIO, offset: int, frame_count: int, vertex_count: int, dtype: object) -> Frames:
    """The (T, N, 3) numbers of `dtype`, in any byte order, that begin at `offset` of `file`. The caller has checked
    that the file is long enough."""
    stored = np.dtype(dtype)
    frame_bytes = vertex_count * 3 * stored.itemsize

    def read(start: int, stop: int) -> np.ndarray:
        block = np.empty((stop - start, vertex_count, 3), stored)
        view = memoryview(block).cast("B")
        file.seek(offset + start * frame_bytes)
        done = 0
        while done < len(view):
            got = file.readinto(view[done:])
            if not got:
                raise ClipError(f"frame {start + done // frame_bytes}: got the end of the file, expected positions")
            done += got
        return block.astype(stored.newbyteorder("="), copy=False)

    return Frames(read, frame_count, vertex_count, stored.newbyteorder("="))


def read_exactly(file: BinaryIO, size: int, what: str) -> bytes:
    """The next `size` bytes of a file. Raises ClipError where it ends before."""
    data = file.read(size)
    if len(data) < size:
        raise ClipError(f"{what}: got {len(data)} bytes, expected {size}")
    return data
