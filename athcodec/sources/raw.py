"""Numbers that lie in a file one after the other: sought and read row by row, never mapped into memory, so that a file
which becomes shorter gives an error and not a crash. It knows no file format.
"""

from __future__ import annotations

from io import FileIO
from typing import BinaryIO, cast

import numpy as np
from numpy import typing as npt

from athcodec.errors import ClipError
from athcodec.motion.frames import Frames


class RawRows:
    """An array of any shape, in C order, whose rows are read when they are sliced.

    Parameters
    ----------
    file : binary file object
        It is long enough, as the caller has checked.
    offset : int
        Where in the file the numbers begin.
    shape : tuple of int
        (rows, ...).
    dtype : dtype
        In any byte order; rows come in that of the machine.
    """

    def __init__(self, file: BinaryIO, offset: int, shape: tuple[int, ...], dtype: npt.DTypeLike):
        self._file = cast(FileIO, file)  # Files that hold arrays are opened without a buffer.
        self._offset, self._stored = offset, np.dtype(dtype)
        self.shape, self.dtype = shape, self._stored.newbyteorder("=")

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: slice | tuple[slice, ...]) -> np.ndarray:
        """Return the sliced rows of the array, read from the file. The step of a slice has to be 1. Raises ClipError if
        the file ends before the rows do."""
        rows, *others = index if isinstance(index, tuple) else (index,)
        start, stop, step = rows.indices(self.shape[0])
        if step != 1:
            raise ValueError(f"rows: got a step of {step}, expected 1")
        block = np.empty((max(stop - start, 0), *self.shape[1:]), self._stored)
        view, done = memoryview(block.data).cast("B") if block.size else memoryview(b""), 0
        row_bytes = len(view) // max(stop - start, 1)
        self._file.seek(self._offset + start * row_bytes)
        while done < len(view):
            got = self._file.readinto(view[done:])
            if not got:
                raise ClipError(f"frame {start + done // row_bytes}: got the end of the file, expected positions")
            done += got
        return block.astype(self.dtype, copy=False)[(slice(None), *others)]


def raw_frames(file: BinaryIO, offset: int, frame_count: int, vertex_count: int, dtype: npt.DTypeLike) -> Frames:
    """Return the (T, N, 3) numbers of `dtype`, in any byte order, that begin at `offset` of `file`. The caller has
    checked that the file is long enough."""
    rows = RawRows(file, offset, (frame_count, vertex_count, 3), dtype)
    return Frames(lambda start, stop: rows[start:stop], frame_count, vertex_count, rows.dtype)


def read_exactly(file: BinaryIO, size: int, subject: str) -> bytes:
    """Return the next `size` bytes of a file. Raises ClipError where it ends before."""
    data = file.read(size)
    if len(data) < size:
        raise ClipError(f"{subject}: got {len(data)} bytes, expected {size}")
    return data
