"""Reads a NumPy archive (.npz), with the names of athcodec's HDF5 schema (hdf5.py) or of other programs (schema.py).

Positions as numpy.savez writes them are read from the archive in blocks. Those of numpy.savez_compressed are unpacked
as they are asked for: going forward once, going backward from the start again. Every other array is static and
survives by its name, strings as UTF-8 of fixed length. Metadata are an array `metadata` with JSON text, and the scalars
fps, start_frame, unit and up_axis where there are such. Nothing is unpickled: the clip's `not_read` names objects, and
files in the archive that are no arrays.
"""

from __future__ import annotations

import json
import struct
import sys
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, BinaryIO

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, closing_on_failure, naming
from athcodec.motion.clip import MotionClip
from athcodec.motion.positions import Order
from athcodec.sources import ReadOptions
from athcodec.sources.npy import BROKEN, Header, check_size, positions_of_rows, read_header, rows_shape
from athcodec.sources.raw import RawRows, read_exactly
from athcodec.sources.schema import Stored, clip_of_arrays
from athcodec.untyped import ArrayLike, JsonMapping, JsonObject

SUFFIX = ".npy"
METADATA = "metadata"
SKIP_BYTES = 1 << 20
ENCRYPTED = 1  # Bit of a member's flags.
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_LOCAL_HEADER = struct.Struct("<4s22xHH")
_BROKEN = (*BROKEN, zipfile.BadZipFile, zlib.error, NotImplementedError, struct.error)


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the archive `path`. Raises ClipError where it is no archive or its arrays are no usable clip,
    OSError where it cannot be opened."""
    file = open_plain(path)
    with naming(path, *_BROKEN), closing_on_failure(file):
        arrays = _Members(file, Budget(options.max_memory))
        return clip_of_arrays(arrays, path, options, resource=file, unchanged=FileWatch(file.fileno()))


@contextmanager
def _naming_array(name: str) -> Iterator[None]:
    """Turn errors of the block into ClipErrors whose messages begin with the name of the array."""
    try:
        yield
    except ClipError:
        raise
    except _BROKEN as error:
        text = " ".join(str(error).split())[:200] or type(error).__name__
        raise ClipError(f"{name}: the array cannot be read: {text}") from None


class _Members:
    """The arrays of an archive: see schema.Arrays."""

    counts_from_1 = False

    def __init__(self, file: BinaryIO, budget: Budget):
        """List the arrays in the .npz archive `file`, and read its metadata. `budget` limits the memory that reading
        takes."""
        self._file, self._archive, self._budget = file, zipfile.ZipFile(file), budget
        self._members: dict[str, zipfile.ZipInfo] = {}
        self._headers: dict[str, Header] = {}
        self.metadata: JsonObject = {}
        self.not_read: dict[str, list[str]] = {}
        for info in self._archive.infolist():
            self._add(info.filename.removesuffix(SUFFIX), info)
        self.stored = {name: Stored(name, header.shape, header.dtype) for name, header in self._headers.items()}
        if METADATA in self.stored:
            self.metadata = _parsed(self.read(METADATA))
            del self.stored[METADATA]

    def _add(self, name: str, info: zipfile.ZipInfo) -> None:
        """List the archive's member `info` as the array `name`, or add it to `not_read` if it is no array of numbers.
        Raises ClipError if the member is encrypted or packed in an unusual way."""
        if not info.filename.endswith(SUFFIX):
            if info.filename and not info.is_dir():
                self.not_read.setdefault("member", []).append(info.filename)
            return
        if info.flag_bits & ENCRYPTED:
            raise ClipError(f"{name}: got an encrypted array, expected a plain one")
        if info.compress_type not in PACKINGS:
            raise ClipError(
                f"{name}: got an array that is packed otherwise than NumPy does, expected plain or deflated bytes"
            )
        with _naming_array(name), self._archive.open(info) as member:
            header = read_header(name, member)
        if header.dtype.hasobject:
            self.not_read.setdefault("pickled object", []).append(name)
            return
        self._members[name], self._headers[name] = info, header

    def read(self, name: str) -> np.ndarray:
        """Return the array `name` as a whole, with text as UTF-8 bytes. Raises ClipError if it is damaged or there is
        no memory for it."""
        info = self._members[name]
        self._budget.take(2 * info.file_size, name)  # Once as it is, and once as the clip has it.
        with _naming_array(name), self._archive.open(info) as member:
            values = np.lib.format.read_array(member, allow_pickle=False)
            if member.read(1):
                raise ClipError(f"{name}: got more bytes than its shape {values.shape} has")
        if values.dtype.kind == "U":
            values = values.astype(values.dtype.newbyteorder("="))
            if values.size and (np.ascontiguousarray(values).reshape(-1).view(np.uint32) > sys.maxunicode).any():
                raise ClipError(f"{name}: got text with numbers beyond those of letters, expected Unicode")
        return np.char.encode(values, "utf-8") if values.dtype.kind == "U" and values.ndim else values

    def positions(self, name: str, order: Order) -> ArrayLike:
        """Return the positions in array `name` as (frames, vertices, 3), read from the file when they are sliced.
        `order` says what each axis of the array holds."""
        info, header = self._members[name], self._headers[name]
        check_size(name, header, info.file_size - header.size)
        if info.compress_type == zipfile.ZIP_STORED:
            rows: Any = RawRows(self._file, self._offset(name) + header.size, rows_shape(header), header.dtype)
        else:
            rows = _UnpackedRows(self._file, self._archive, info, header)
        return positions_of_rows(name, rows, header, order, self._budget)

    def notes(self, name: str) -> JsonMapping:
        return {}

    def labels(self, name: str) -> Sequence[str]:
        return ()

    def _offset(self, name: str) -> int:
        """Return the offset, in bytes from the beginning of the file, of the array `name` in the archive. It follows
        the member's own header, whose length varies. Raises ClipError if the file ends before the array does."""
        info = self._members[name]
        self._file.seek(info.header_offset)
        magic, name_bytes, extra_bytes = _LOCAL_HEADER.unpack(read_exactly(self._file, _LOCAL_HEADER.size, name))
        if magic != b"PK\3\4":
            raise ClipError(f"{name}: got no header of a member, expected one")
        start = info.header_offset + _LOCAL_HEADER.size + name_bytes + extra_bytes
        self._file.seek(0, 2)
        if start + info.file_size > self._file.tell():
            raise ClipError(f"{name}: got the end of the file, expected the array")
        return int(start)


def _parsed(values: np.ndarray) -> JsonObject:
    """Return the clip's metadata from `values`, an array with one item of JSON text. Raises ClipError if the text is no
    JSON object."""
    try:
        text = values.reshape(()).item()
        content = json.loads(text.decode("utf-8", "replace") if isinstance(text, bytes) else text)
    except (ValueError, TypeError) as error:
        raise ClipError(f"{METADATA}: got no JSON text, expected one: {error}") from None
    if not isinstance(content, dict):
        raise ClipError(f"{METADATA}: got a {type(content).__name__}, expected a JSON object")
    return content


class _UnpackedRows:
    """An array whose rows are unpacked when they are sliced: going forward once, going backward from the start."""

    def __init__(self, file: BinaryIO, archive: zipfile.ZipFile, info: zipfile.ZipInfo, header: Header):
        self._file, self._archive, self._info, self._header = file, archive, info, header
        self.shape, self.dtype = rows_shape(header), header.dtype.newbyteorder("=")
        self._row_bytes = header.bytes // max(self.shape[0], 1)
        self._member: Any = None
        self._next = 0

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: slice | tuple[slice, ...]) -> np.ndarray:
        """Return the sliced rows of the compressed array. Rows behind those read last are unpacked from there on;
        earlier rows need unpacking from the array's beginning."""
        rows, *others = index if isinstance(index, tuple) else (index,)
        start, stop, step = rows.indices(self.shape[0])
        if step != 1:
            raise ValueError(f"rows: got a step of {step}, expected 1")
        if self._file.closed:
            raise ClipError("got a closed file, expected an open one")
        size = max(stop - start, 0) * self._row_bytes
        with _naming_array(self._info.filename.removesuffix(SUFFIX)):
            if self._member is None or start < self._next:
                self._member, self._next = self._archive.open(self._info), 0
                self._skip(self._header.size)
            self._skip((start - self._next) * self._row_bytes)
            self._next = self.shape[0] + 1  # unknown until all of the rows have been read
            data = bytearray()
            while len(data) < size:
                data += self._some(size - len(data))
            self._next = stop
        block = np.frombuffer(data, self._header.dtype).reshape(-1, *self.shape[1:])
        return block.astype(self.dtype, copy=False)[(slice(None), *others)]

    def _skip(self, size: int) -> None:
        while size:
            size -= len(self._some(min(size, SKIP_BYTES)))

    def _some(self, size: int) -> bytes:
        got = self._member.read(size)
        if not got:
            raise ClipError("positions: got the end of the array, expected frames")
        return got
