"""Reads a NumPy archive (.npz) with the names of athcodec's HDF5 schema (see hdf5.py) into a MotionClip.

Positions as numpy.savez writes them are read from the archive in blocks. Those of numpy.savez_compressed are unpacked
as they are asked for: going forward once, going backward from the start again. Every other array is static and
survives by its name, strings as UTF-8 of fixed length. Metadata are an array `metadata` with JSON
text, and the scalars fps, start_frame, unit and up_axis where there are such. Nothing is unpickled.
"""

from __future__ import annotations

import json
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, closing_on_failure, naming
from athcodec.motion.clip import RESERVED_NAMES, MotionClip, check_float_dtype
from athcodec.motion.frames import Frames
from athcodec.sources import ReadOptions
from athcodec.sources.raw import raw_frames, read_exactly
from athcodec.sources.schema import clip_of_arrays

SCALARS = ("fps", "start_frame", "unit", "up_axis")
METADATA = "metadata"
SKIP_BYTES = 1 << 20
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_LOCAL_HEADER = struct.Struct("<4s22xHH")
_BROKEN = (
    zipfile.BadZipFile,
    OSError,
    zlib.error,
    EOFError,
    ValueError,
    KeyError,
    RuntimeError,
    NotImplementedError,
    struct.error,
    MemoryError,
    OverflowError,
    TypeError,
    SyntaxError,
    tokenize.TokenError,  # NumPy's, of headers in old styles
)


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the archive `path`. Raises ClipError where it is no archive or its arrays are no usable clip,
    OSError where it cannot be opened."""
    file = open_plain(path)
    with naming(path, *_BROKEN), closing_on_failure(file):
        return _read(file, options)


@contextmanager
def _naming_array(name: str) -> Iterator[None]:
    """Errors of the block say which array they are about."""
    try:
        yield
    except ClipError:
        raise
    except _BROKEN as error:
        text = " ".join(str(error).split())[:200] or type(error).__name__
        raise ClipError(f"{name}: the array cannot be read: {text}") from None


def _read(file: BinaryIO, options: ReadOptions) -> MotionClip:
    archive, budget = zipfile.ZipFile(file), Budget(options.max_memory)
    members = {
        info.filename.removesuffix(".npy"): info for info in archive.infolist() if info.filename.endswith(".npy")
    }
    if "positions" not in members:
        raise ClipError("positions: got no such array, expected (frames, vertices, 3)")
    with _naming_array("positions"):
        positions = _Positions(file, archive, members.pop("positions"), budget).frames()
    arrays = {
        name: _array(archive, name, info, budget)
        for name, info in members.items()
        if name in RESERVED_NAMES or name not in options.skip
    }
    metadata = _metadata(arrays)
    attributes = {name: values for name, values in arrays.items() if name not in RESERVED_NAMES}
    return clip_of_arrays(
        positions, arrays.get, attributes, metadata, options, resource=file, unchanged=FileWatch(file.fileno())
    )


def _array(archive: zipfile.ZipFile, name: str, info: zipfile.ZipInfo, budget: Budget) -> np.ndarray:
    _check_packing(name, info)
    budget.take(2 * info.file_size, name)  # once as it is, and once as the clip has it
    with _naming_array(name), archive.open(info) as member:
        values = np.lib.format.read_array(member, allow_pickle=False)
        if member.read(1):
            raise ClipError(f"{name}: got more bytes than its shape {values.shape} has")
    return np.char.encode(values, "utf-8") if values.dtype.kind == "U" and values.ndim else values


def _check_packing(name: str, info: zipfile.ZipInfo) -> None:
    if info.compress_type not in PACKINGS:
        raise ClipError(
            f"{name}: got an array that is packed otherwise than NumPy does, expected plain or deflated bytes"
        )


def _metadata(arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """The metadata, which are removed from the arrays."""
    metadata = {}
    for name in SCALARS:
        if name in arrays and arrays[name].ndim == 0 and arrays[name].dtype.kind in "biufUS":
            metadata[name] = _text(arrays.pop(name).item())
    if METADATA in arrays:
        try:
            found = json.loads(_text(arrays.pop(METADATA).reshape(()).item()))
        except (ValueError, TypeError) as error:
            raise ClipError(f"{METADATA}: got no JSON text, expected one: {error}") from None
        if not isinstance(found, dict):
            raise ClipError(f"{METADATA}: got a {type(found).__name__}, expected a JSON object")
        metadata |= found
    return metadata


def _text(value: Any) -> Any:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


class _Positions:
    """The member with the positions: where it lies, or how it is unpacked."""

    def __init__(self, file: BinaryIO, archive: zipfile.ZipFile, info: zipfile.ZipInfo, budget: Budget):
        _check_packing("positions", info)
        self._file, self._archive, self._info = file, archive, info
        with archive.open(info) as member:
            shape, self._fortran, self.dtype = _header(member)
            self._header_bytes = member.tell()
        if len(shape) != 3 or shape[2] != 3 or min(shape) < 1:
            raise ClipError(f"positions: got shape {shape}, expected (frames, vertices, 3)")
        check_float_dtype("positions", self.dtype)
        self.shape = tuple(int(size) for size in shape)
        size = self.shape[0] * self.shape[1] * 3 * self.dtype.itemsize
        budget.need(4 * size // self.shape[0], "positions: a frame")  # read, converted, checked, and the rest pose
        if self._header_bytes + size != info.file_size:
            raise ClipError(f"positions: got {info.file_size - self._header_bytes} bytes, expected {size} for {shape}")
        self._member: Any = None
        self._next = 0

    def frames(self) -> Any:
        if self._info.compress_type != zipfile.ZIP_STORED:
            if self._fortran:
                raise ClipError("positions: got a compressed array in Fortran order, expected C order: frame by frame")
            return Frames(self._unpack, *self.shape[:2], self.dtype.newbyteorder("="))
        if self._info.flag_bits & 1:
            raise ClipError("positions: got an encrypted array, expected a plain one")
        offset = self._offset()
        if self._fortran:
            return np.memmap(self._file.name, self.dtype, "r", offset, self.shape, "F")
        return raw_frames(self._file, offset, *self.shape[:2], self.dtype)

    def _offset(self) -> int:
        """Where the numbers begin in the file: each member has a header of its own length before it."""
        at = self._info.header_offset
        self._file.seek(at)
        magic, name_bytes, extra_bytes = _LOCAL_HEADER.unpack(read_exactly(self._file, _LOCAL_HEADER.size, "positions"))
        if magic != b"PK\3\4":
            raise ClipError("positions: got no header of a member, expected one")
        start = at + _LOCAL_HEADER.size + name_bytes + extra_bytes
        self._file.seek(0, 2)
        if start + self._info.file_size > self._file.tell():
            raise ClipError("positions: got the end of the file, expected the array")
        return start + self._header_bytes

    def _unpack(self, start: int, stop: int) -> np.ndarray:
        if self._file.closed:
            raise ClipError("got a closed file, expected an open one")
        frame_bytes = self.shape[1] * 3 * self.dtype.itemsize
        with _naming_array("positions"):
            if self._member is None or start < self._next:
                self._member, self._next = self._archive.open(self._info), 0
                self._skip(self._header_bytes)
            self._skip((start - self._next) * frame_bytes)
            self._next = self.shape[0] + 1  # unknown until all of the frames have been read
            data = bytearray()
            while len(data) < (stop - start) * frame_bytes:
                data += self._some((stop - start) * frame_bytes - len(data))
            self._next = stop
        block = np.frombuffer(data, self.dtype).reshape(stop - start, *self.shape[1:])
        return block.astype(self.dtype.newbyteorder("="), copy=False)

    def _skip(self, size: int) -> None:
        while size:
            size -= len(self._some(min(size, SKIP_BYTES)))

    def _some(self, size: int) -> bytes:
        got = self._member.read(size)
        if not got:
            raise ClipError("positions: got the end of the array, expected frames")
        return got


def _header(member: Any) -> tuple[tuple[int, ...], bool, np.dtype]:
    version = np.lib.format.read_magic(member)
    if version == (1, 0):
        return np.lib.format.read_array_header_1_0(member)
    if version == (2, 0):
        return np.lib.format.read_array_header_2_0(member)
    raise ClipError(f"positions: got version {version} of NumPy's format, expected (1, 0) or (2, 0)")
