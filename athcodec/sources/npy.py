"""Reads the positions in a NumPy file (.npy), an array and nothing else: see schema.py for its shape and axes.

Frames that lie one after the other are read when they are asked for. An array in another order is read whole, within
options.max_memory. Nothing is unpickled. npz.py reads archives of such files.
"""

from __future__ import annotations

import os
import tokenize
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, closing_on_failure, naming
from athcodec.motion.clip import MotionClip
from athcodec.motion.positions import FRAMES, Order, ordered
from athcodec.sources import ReadOptions
from athcodec.sources.raw import RawRows
from athcodec.sources.schema import Stored, clip_of_arrays
from athcodec.untyped import ArrayLike, JsonMapping, JsonObject

BROKEN = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    TypeError,
    SyntaxError,
    OverflowError,
    MemoryError,
    RuntimeError,
    tokenize.TokenError,  # NumPy's, of headers in old styles
)


@dataclass(frozen=True)
class Header:
    """What stands before the numbers of an array: the shape, whether the first axis is the fastest, the dtype, and the
    number of bytes that say so."""

    shape: tuple[int, ...]
    is_fortran: bool
    dtype: np.dtype
    size: int

    @property
    def bytes(self) -> int:
        """Number of bytes of the numbers."""
        return int(np.prod(self.shape, dtype=object)) * self.dtype.itemsize


def read_header(name: str, file: Any) -> Header:
    """Return the header of the .npy array that begins at the current position of `file`; reading goes on behind it.
    `name` begins the message of a ClipError, which is raised for an unknown version or shape."""
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ClipError(f"{name}: got version {version} of NumPy's format, expected (1, 0) or (2, 0)")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, is_fortran, dtype = read(file)
    if min(shape, default=0) < 0:
        raise ClipError(f"{name}: got shape {shape}, expected no negative number")
    return Header(tuple(int(length) for length in shape), is_fortran, dtype, file.tell())


def check_size(name: str, header: Header, available: int) -> None:
    """Raise ClipError unless so many bytes are those of the array."""
    if available != header.bytes:
        raise ClipError(f"{name}: got {available} bytes, expected {header.bytes} for {header.shape} of {header.dtype}")


def rows_shape(header: Header) -> tuple[int, ...]:
    """Return the shape of an array as its numbers lie: the last axis is the fastest."""
    return header.shape[::-1] if header.is_fortran else header.shape


def positions_of_rows(name: str, rows: Any, header: Header, order: Order, budget: Budget) -> Any:
    """Return the positions (T, N, 3) of a stored array, read from `rows` when they are sliced. `order` says what each
    axis of the array holds. If frames are not the array's slowest axis, it is read whole now, for which ClipError is
    raised if `budget` has no room."""
    order = order[::-1] if header.is_fortran else order
    if order[0][:1] != (FRAMES,):
        budget.take(header.bytes, f"{name}, whose axes are in another order, whole")
        rows = rows[0 : len(rows)]
    positions = ordered(rows, order)
    # A frame is read, converted, checked, and becomes the rest pose.
    budget.need(4 * 3 * positions.shape[1] * header.dtype.itemsize, f"{name or 'positions'}: a frame")
    return positions


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the file `path`. Raises ClipError where it is no array of positions, OSError where it cannot be
    opened."""
    file = open_plain(path)
    with naming(path, *BROKEN), closing_on_failure(file):
        arrays = _Array(file, Budget(options.max_memory))
        return clip_of_arrays(arrays, path, options, resource=file, unchanged=FileWatch(file.fileno()))


class _Array:
    """The only array of a file, without a name: see schema.Arrays."""

    counts_from_1 = False

    def __init__(self, file: BinaryIO, budget: Budget):
        self._file, self._budget, self._header = file, budget, read_header("array", file)
        check_size("array", self._header, os.fstat(file.fileno()).st_size - self._header.size)
        self.stored = {"": Stored("", self._header.shape, self._header.dtype)}
        self.metadata: JsonObject = {}
        self.not_read: dict[str, list[str]] = {}

    def read(self, name: str) -> np.ndarray:
        raise ClipError(f"{name}: got no such array, expected the only one")

    def positions(self, name: str, order: Order) -> ArrayLike:
        header = self._header
        rows = RawRows(self._file, header.size, rows_shape(header), header.dtype)
        return positions_of_rows("positions", rows, header, order, self._budget)

    def notes(self, name: str) -> JsonMapping:
        """Return nothing: an .npy file has no notes."""
        return {}

    def labels(self, name: str) -> Sequence[str]:
        return ()
