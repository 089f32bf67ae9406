"""The .ath file: the only module that knows byte offsets, checksums and limits (FORMAT.md, "File").

A file is a header, a chunk table and an error table, then the chunks in table order without gaps, so that offsets are
never stored and cannot disagree. Chunks of the prelude come first, those of the motion by (level, segment, kind),
other attributes last. This module packs and parses; what the streams inside mean is the business of entropy.py.
"""

from __future__ import annotations

import json
import math
import re
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
import zstandard

from athcodec._native import SEGMENT_FRAMES, crc32c
from athcodec.clip import Span
from athcodec.errors import (
    BadChecksum,
    BadChunk,
    BadChunkTable,
    BadHeader,
    ClipError,
    FormatError,
    LimitExceeded,
    NotAnAthFile,
    TrailingBytes,
    Truncated,
    UnknownChunk,
    UnsupportedVersion,
)

MAGIC = b"\x89ATH\r\n\x1a\n"
MAJOR, MINOR = 0, 4
NO_LEVEL = 255
OPTIONAL = 0x8000

HIERARCHY, REST, TIME = 1, 2, 3
METADATA, FACES, EDGES = OPTIONAL | 4, OPTIONAL | 5, OPTIONAL | 6
CLIPS = 7
STEMS, AFFINES, CORRECTIONS, SHAPES, EXACT = 16, 17, 18, 19, 20
ATTRIBUTE = OPTIONAL | 32
KIND_NAMES = {HIERARCHY: "HIERARCHY", REST: "REST", TIME: "TIME", METADATA: "METADATA", FACES: "FACES", EDGES: "EDGES",
              CLIPS: "CLIPS", STEMS: "STEMS", AFFINES: "AFFINES", CORRECTIONS: "CORRECTIONS", SHAPES: "SHAPES",
              EXACT: "EXACT", ATTRIBUTE: "ATTRIBUTE"}

_HEADER = struct.Struct("<8sHHIQIIIIIBBBBdQ")
_CHUNK = struct.Struct("<HBBIII")
_ERRORS = struct.Struct("<ff")
_CHECKSUM_AT = 12


@dataclass(frozen=True)
class Limits:
    """What a reader accepts; FORMAT.md, "Limits"."""

    chunks: int = 1 << 20
    table_bytes: int = 16 << 20
    metadata_bytes: int = 1 << 20
    vertices: int = 1 << 26
    branches: int = 1 << 20
    frames: int = 1 << 20
    hierarchy_depth: int = 4096
    attributes: int = 256
    string_bytes: int = 4096
    chunk_bytes: int = 256 << 20
    decoded_chunk_bytes: int = 256 << 20
    memory_bytes: int = 2 << 30


@dataclass
class Header:
    """The fixed header. `max_error` is the promise of the deepest stored level, in scene units; frames and segments are
    those of all clips."""

    vertex_count: int
    branch_count: int
    frame_count: int
    segment_count: int
    level_count: int
    full_level_count: int
    max_error: float
    is_float64: bool = False
    clip_count: int = 1
    chunk_count: int = 0
    file_length: int = 0


@dataclass(frozen=True)
class Chunk:
    """One entry of the chunk table, with the offset that follows from those before it."""

    kind: int
    level: int
    segment: int
    length: int
    checksum: int
    offset: int = 0

    @property
    def is_motion(self) -> bool:
        """Whether the kind belongs to a level and a segment: known ones, and those reserved for it."""
        return 16 <= self.kind & ~OPTIONAL < 32

    def __str__(self) -> str:
        name = KIND_NAMES.get(self.kind, f"kind {self.kind:#06x}")
        place = f" of level {self.level}, segment {self.segment}" if self.is_motion else ""
        return f"chunk {name}{place} at byte {self.offset}"


def _pack_header(header: Header, checksum: int) -> bytes:
    return _HEADER.pack(MAGIC, MAJOR, MINOR, checksum, header.file_length, header.chunk_count, header.vertex_count,
                        header.branch_count, header.frame_count, header.segment_count, header.level_count,
                        header.full_level_count, header.clip_count, int(header.is_float64), header.max_error, 0)


def pack_front(header: Header, chunks: list[Chunk], errors: np.ndarray) -> bytes:
    """Header, chunk table and error table.

    errors: (levels, segments, 2) of max and RMS error in scene units; the maximum is rounded up to float32.
    """
    table = b"".join(_CHUNK.pack(c.kind, 0, c.level, c.segment, c.length, c.checksum) for c in chunks)
    table += np.ascontiguousarray(_round_up(errors)).astype("<f4").tobytes()
    header.chunk_count = len(chunks)
    header.file_length = _file_length(header, chunks)
    checksum = crc32c(_pack_header(header, 0) + table)
    return _pack_header(header, checksum) + table


def _tables_size(header: Header, chunk_count: int) -> int:
    return chunk_count * _CHUNK.size + header.level_count * header.segment_count * _ERRORS.size


def _file_length(header: Header, chunks: list[Chunk]) -> int:
    return _HEADER.size + _tables_size(header, len(chunks)) + sum(chunk.length for chunk in chunks)


def _round_up(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, np.float64)
    single = values.astype(np.float32)
    return np.where(single < values, np.nextafter(single, np.float32(np.inf)), single)


def _order(chunk: Chunk) -> tuple:
    if chunk.is_motion:
        return (1, chunk.level, chunk.segment, chunk.kind)
    if chunk.kind & ~OPTIONAL < 16:
        return (0, chunk.kind & ~OPTIONAL)
    return (2, chunk.kind & ~OPTIONAL)


@dataclass
class ChunkStore:
    """Chunks on their way into a file: payloads in a spool, in any order."""

    spool: BinaryIO
    entries: list[tuple[Chunk, int]] = field(default_factory=list)

    def add(self, kind: int, payload: bytes, level: int = NO_LEVEL, segment: int = 0) -> None:
        place = self.spool.seek(0, 2)
        self.spool.write(payload)
        self.entries.append((Chunk(kind, level, segment, len(payload), crc32c(payload)), place))

    def replace(self, kind: int, payload: bytes) -> None:
        """Another content for the one chunk of this kind."""
        self.entries = [(chunk, place) for chunk, place in self.entries if chunk.kind != kind]
        self.add(kind, payload)

    def size(self, header: Header) -> int:
        """Bytes of the whole file."""
        return _file_length(header, [chunk for chunk, _ in self.entries])

    def write(self, out: BinaryIO, header: Header, errors: np.ndarray) -> list[Chunk]:
        """Writes the whole file in its order and returns its chunks."""
        entries = sorted(self.entries, key=lambda entry: _order(entry[0]))
        out.write(pack_front(header, [chunk for chunk, _ in entries], errors))
        chunks = []
        for chunk, place in entries:
            chunks.append(_at(chunk, out.tell()))
            self.spool.seek(place)
            out.write(self.spool.read(chunk.length))
        return chunks


def _at(chunk: Chunk, offset: int) -> Chunk:
    return Chunk(chunk.kind, chunk.level, chunk.segment, chunk.length, chunk.checksum, offset)


class Container:
    """An opened .ath file: header, chunks, errors, and the bytes of any chunk that is there.

    `strict` refuses a file that is shorter or longer than its header says; otherwise what is missing is known
    (`available_length`) and only a file cut inside its prelude is refused. Counts bytes in `bytes_read`.
    """

    def __init__(self, file: BinaryIO, *, strict: bool = False, limits: Limits | None = None):
        self.file, self.limits = file, limits or Limits()
        self.bytes_read = 0
        self.available_length = file.seek(0, 2)
        self.header, front = self._read_header()
        self.chunks, self.errors = self._read_tables(front)
        self._places = {(chunk.kind, chunk.level, chunk.segment): chunk for chunk in reversed(self.chunks)}
        self._check_length(strict)

    def _read_some(self, offset: int, length: int) -> bytes:
        """`length` bytes, or what there is of them: a file may give fewer at a time than it was asked for."""
        self.file.seek(offset)
        parts, got = [], 0
        while got < length and (part := self.file.read(length - got)):
            parts.append(part)
            got += len(part)
        self.bytes_read += got
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _read(self, offset: int, length: int, what: str) -> bytes:
        data = self._read_some(offset, length)
        if len(data) < length:
            raise Truncated(f"{what}: got {len(data)} bytes; expected {length}")
        return data

    def _read_header(self) -> tuple[Header, bytes]:
        front = self._read_some(0, _HEADER.size)
        if front[:8] != MAGIC[: len(front)] or not front:
            raise NotAnAthFile(f"file: got {front[:8]!r} at byte 0; expected {MAGIC!r}")
        if len(front) >= 12:
            major, minor = struct.unpack_from("<HH", front, 8)
            if (major, minor) != (MAJOR, MINOR):
                raise UnsupportedVersion(f"file: got format version {major}.{minor}; expected {MAJOR}.{MINOR}")
        if len(front) < _HEADER.size:
            raise Truncated(f"header: got {len(front)} bytes; expected {_HEADER.size}")
        (_, _, _, self._checksum, length, chunk_count, vertices, branches, frames, segments, levels, full_levels, clips,
         flags, max_error, reserved) = _HEADER.unpack(front)
        header = Header(vertices, branches, frames, segments, levels, full_levels, max_error, bool(flags & 1),
                        clips, chunk_count, length)
        self._check_header(header, flags, reserved)
        return header, front

    def _check_header(self, header: Header, flags: int, reserved: int) -> None:
        limits = self.limits
        for name, value, limit in (("Vertex_Count", header.vertex_count, limits.vertices),
                                   ("Branch_Count", header.branch_count, limits.branches),
                                   ("Frame_Count", header.frame_count, limits.frames),
                                   ("Segment_Count", header.segment_count, limits.frames),
                                   ("Chunk_Count", header.chunk_count, limits.chunks)):
            if value < 1:
                raise BadHeader(f"header: got {name} 0; expected at least 1")
            if value > limit:
                raise LimitExceeded(f"header: got {name} {value}; the limit is {limit}")
        checks = [
            (header.branch_count <= header.vertex_count, "Branch_Count", header.branch_count, "at most Vertex_Count"),
            (header.segment_count <= header.frame_count <= SEGMENT_FRAMES * header.segment_count, "Segment_Count",
             header.segment_count, f"segments of 1 to {SEGMENT_FRAMES} frames"),
            (2 <= header.full_level_count <= 32, "Full_Level_Count", header.full_level_count, "2 to 32"),
            (1 <= header.level_count <= header.full_level_count, "Level_Count", header.level_count,
             "1 to Full_Level_Count"),
            (header.clip_count >= 1, "Clip_Count", header.clip_count, "at least 1"),
            (flags < 2, "Flags", flags, "reserved bits 0"),
            (reserved == 0, "Reserved", reserved, "0"),
            (math.isfinite(header.max_error) and header.max_error >= 0, "Max_Error", header.max_error,
             "a finite length"),
        ]
        for valid, name, value, expected in checks:
            if not valid:
                raise BadHeader(f"header: got {name} {value}; expected {expected}")

    def _read_tables(self, front: bytes) -> tuple[list[Chunk], np.ndarray]:
        header = self.header
        table_size = header.chunk_count * _CHUNK.size
        size = _tables_size(header, header.chunk_count)
        if size > self.limits.table_bytes:
            raise LimitExceeded(f"chunk table: got {size} bytes; the limit is {self.limits.table_bytes}")
        table = self._read(_HEADER.size, size, "chunk table")
        blank = front[:_CHECKSUM_AT] + b"\0\0\0\0" + front[_CHECKSUM_AT + 4:]
        if crc32c(blank + table) != self._checksum:
            raise BadChecksum(f"header and chunk table: got checksum {crc32c(blank + table):#010x}; "
                              f"expected {self._checksum:#010x}")
        self._front = front + table
        errors = np.frombuffer(table, "<f4", offset=table_size).reshape(header.level_count, header.segment_count, 2)
        if not np.isfinite(errors).all() or (errors < 0).any():
            raise BadChunkTable("error table: got a value that is negative or not finite")
        return self._parse_chunks(table, _HEADER.size + size), errors.astype(np.float64)

    def _parse_chunks(self, table: bytes, offset: int) -> list[Chunk]:
        chunks = []
        for i in range(self.header.chunk_count):
            kind, reserved, level, segment, length, checksum = _CHUNK.unpack_from(table, i * _CHUNK.size)
            chunk = Chunk(kind, level, segment, length, checksum, offset)
            self._check_chunk(chunk, reserved)
            if chunks and self._misplaced(chunks[-1], chunk):
                raise BadChunkTable(f"chunk table: {chunk}: expected after {chunks[-1]} in file order, each once")
            chunks.append(chunk)
            offset += length
        if offset != self.header.file_length:
            raise BadChunkTable(f"chunk table: chunks end at byte {offset}; expected {self.header.file_length}")
        return [chunk for chunk in chunks if chunk.kind in KIND_NAMES]

    @staticmethod
    def _misplaced(before: Chunk, chunk: Chunk) -> bool:
        repeatable = chunk.kind & OPTIONAL and chunk.kind & ~OPTIONAL >= 32
        return _order(chunk) < _order(before) or (_order(chunk) == _order(before) and not repeatable)

    def _check_chunk(self, chunk: Chunk, reserved: int) -> None:
        if chunk.kind not in KIND_NAMES and (not chunk.kind & OPTIONAL or chunk.kind ^ OPTIONAL in KIND_NAMES):
            raise UnknownChunk(f"{chunk}: got a required kind that this decoder does not know")
        if chunk.length > self.limits.chunk_bytes:
            raise LimitExceeded(f"{chunk}: got {chunk.length} bytes; the limit is {self.limits.chunk_bytes}")
        level_valid = chunk.level < self.header.level_count if chunk.is_motion else chunk.level == NO_LEVEL
        segment_valid = chunk.segment < (self.header.segment_count if chunk.is_motion else 1)
        if reserved != 0 or not level_valid or not segment_valid:
            raise BadChunkTable(f"{chunk}: got level {chunk.level}, segment {chunk.segment}, reserved {reserved}; "
                                f"expected what the header announces, and 0")

    def _check_length(self, strict: bool) -> None:
        expected, got = self.header.file_length, self.available_length
        if got < self.prelude_length:
            raise Truncated(f"prelude: got {got} bytes; expected {self.prelude_length}")
        if strict and got < expected:
            raise Truncated(f"file: got {got} bytes; expected {expected}")
        if got > expected and strict:
            raise TrailingBytes(f"file: got {got} bytes; expected {expected}")

    @property
    def prelude_length(self) -> int:
        """Bytes before the first motion chunk."""
        motion = [chunk.offset for chunk in self.chunks if _order(chunk)[0] > 0]
        return min(motion, default=self.header.file_length)

    def is_available(self, chunk: Chunk) -> bool:
        return chunk.offset + chunk.length <= self.available_length

    def find(self, kind: int, level: int = NO_LEVEL, segment: int = 0) -> Chunk | None:
        return self._places.get((kind, level, segment))

    def level_end(self, level: int) -> int:
        """Bytes of the file cut after `level`."""
        ends = [c.offset + c.length for c in self.chunks if _order(c)[0] == 0 or (c.is_motion and c.level <= level)]
        return max(ends)

    def payload(self, chunk: Chunk) -> bytes:
        """A chunk's bytes. Raises Truncated, BadChecksum."""
        data = self._read(chunk.offset, chunk.length, str(chunk))
        if crc32c(data) != chunk.checksum:
            doubt = getattr(self.file, "doubt", "")
            raise BadChecksum(f"{chunk}: got checksum {crc32c(data):#010x}; expected {chunk.checksum:#010x}{doubt}")
        return data

    def prefetch(self, ranges: list[tuple[int, int]]) -> None:
        """Tells a file that is far away which (offset, size) are read next."""
        if hasattr(self.file, "prefetch"):
            self.file.prefetch(ranges)

    def read(self, offset: int, length: int) -> bytes:
        """Bytes of the file as they are. Raises Truncated."""
        return self._read(offset, length, f"bytes from {offset} on")

    def prelude(self) -> bytes:
        """Everything in front of the first motion chunk. Raises Truncated."""
        return self._front + self._read(len(self._front), self.prelude_length - len(self._front), "prelude")

    def required(self, kind: int, level: int = NO_LEVEL, segment: int = 0) -> bytes:
        """The bytes of a chunk that must be there. Raises BadChunkTable where the table has none."""
        chunk = self.find(kind, level, segment)
        if chunk is None:
            place = "" if level == NO_LEVEL else f" of level {level}, segment {segment}"
            raise BadChunkTable(f"chunk table: got no {KIND_NAMES[kind]}{place}; expected one")
        return self.payload(chunk)


def truncated_front(container: Container, level: int) -> tuple[bytes, list[Chunk]]:
    """Front of a file that stores the levels up to `level`, and the chunks to copy behind it."""
    header = container.header
    chunks = [c for c in container.chunks if not c.is_motion or c.level <= level]
    errors = container.errors[: level + 1]
    promise = header.max_error if level + 1 == header.full_level_count else float(errors[level, :, 0].max())
    shorter = Header(header.vertex_count, header.branch_count, header.frame_count, header.segment_count, level + 1,
                     header.full_level_count, promise, header.is_float64, header.clip_count)
    return pack_front(shorter, chunks, errors), chunks


# ---- heads of the chunks ----------------------------------------------------------------------------------------

_HIERARCHY = struct.Struct("<ffII")
_REST = struct.Struct("<BBH3dd")
_TIME = struct.Struct("<B")
_STEADY = struct.Struct("<dd")
_CLIP = struct.Struct("<IIBB")
_STEMS = struct.Struct("<fBBH")
_BASIS_LENGTH = struct.Struct("<I")
_CORRECTIONS = struct.Struct("<f")
_ARRAY = struct.Struct("<H")


def _head(form: struct.Struct, data: bytes, what: str) -> tuple:
    if len(data) < form.size:
        raise BadChunk(f"{what}: got {len(data)} bytes; expected at least {form.size}")
    return form.unpack_from(data)


def brief(value: object) -> str:
    """What a file holds, as an error message shows it."""
    text = repr(value)
    return text if len(text) <= 100 else text[:97] + "..."


def _positive(value: float, what: str) -> float:
    if not (math.isfinite(value) and value > 0):
        raise BadChunk(f"{what}: got {value}; expected a finite number above 0")
    return value


def pack_hierarchy(thresholds, stream: bytes) -> bytes:
    """thresholds: ath.Thresholds or (epsilon, eta, xi, lam)."""
    epsilon, eta, xi, lam = thresholds
    clip = float(np.finfo(np.float32).max)
    return _HIERARCHY.pack(min(epsilon, clip), min(xi, clip), int(eta), int(lam)) + stream


@dataclass
class Rest:
    """Head of REST and its stream, which holds the very numbers of the source where `exact`, else steps."""

    origin: np.ndarray
    step: float
    source_dtype: np.dtype
    stream: bytes = b""
    exact: bool = False


def pack_rest(rest: Rest) -> bytes:
    is_float64 = rest.source_dtype == np.float64
    return _REST.pack(int(rest.exact), int(is_float64), 0, *rest.origin, rest.step) + rest.stream


def pack_steady_time(*times: np.ndarray) -> bytes | None:
    """TIME by the rule that gives the very same times in seconds, (T,) float64 for each clip; None where none does."""
    for method in (0, 1):
        steps = [_steady_step(method, time) for time in times]
        if None not in steps:
            pairs = (_STEADY.pack(float(time[0]), step) for time, step in zip(times, steps))
            return _TIME.pack(method) + b"".join(pairs)
    return None


def _steady_step(method: int, time: np.ndarray) -> float | None:
    if len(time) == 1:
        return 1.0
    index, first = np.arange(len(time)), float(time[0])
    steps = {(float(time[-1]) - first) / (len(time) - 1), float(time[1]) - first}
    if method == 1:
        steps = {round(1 / step * 1000) / 1000 for step in steps if step > 1e-300} - {0.0}
    with np.errstate(over="ignore", invalid="ignore"):  # a rule that overflows does not give the times
        fit = (step for step in steps if (first + (index / step if method else index * step) == time).all())
        return next(fit, None)


def pack_clips(spans: Sequence[Span], segment_counts: Sequence[int], seams: Sequence[Sequence[float] | None]) -> bytes:
    """CLIPS; seams: for a loop the error at the seam of each level, scene units, rounded up to float32."""
    entries = []
    for span, segments, errors in zip(spans, segment_counts, seams):
        name = span.name.encode()
        entries.append(_CLIP.pack(span.frame_count, segments, int(span.loop), len(name)) + name)
        if span.loop:
            entries.append(_round_up(errors).astype("<f4").tobytes())
    return b"".join(entries)


def pack_time(stream: bytes) -> bytes:
    return _TIME.pack(2) + stream


@dataclass
class StemsHead:
    """Head of STEMS: step, rotation factor (0, 1, 2, 4, 8), learned time basis (bits, rank, stream) if any."""

    step: float
    omega: int
    bits: int = 0
    rank: int = 0
    basis: bytes = b""


def pack_stems(head: StemsHead, stream: bytes) -> bytes:
    data = _STEMS.pack(head.step, head.omega.bit_length(), head.bits, head.rank)
    if head.bits:
        data += _BASIS_LENGTH.pack(len(head.basis)) + head.basis
    return data + stream


def pack_corrections(step: float, stream: bytes) -> bytes:
    return _CORRECTIONS.pack(step) + stream


# ---- static data --------------------------------------------------------------------------------------------------

_ZSTD_WINDOW = 8 << 20
_ZSTD_SINGLE_SEGMENT = 0x20
ITEM_BYTES = 1 << 20


def _compress(array: np.ndarray) -> bytes:
    """zstd over the array's bytes, shuffled: all first bytes of the items, then all second bytes, ..."""
    array = np.ascontiguousarray(array)
    shuffled = np.frombuffer(array.tobytes(), np.uint8).reshape(-1, array.dtype.itemsize).T.tobytes()
    return zstandard.ZstdCompressor(level=19, write_content_size=True, write_checksum=False).compress(shuffled)


def _decompress(data: bytes, dtype: np.dtype, shape: tuple[int, ...], what: str, limits: Limits) -> np.ndarray:
    size = math.prod(shape) * dtype.itemsize
    raw = np.frombuffer(zstd_decompress_exact(data, size, what, limits), np.uint8)
    return np.frombuffer(raw.reshape(dtype.itemsize, -1).T.tobytes(), dtype).reshape(shape)


def _check_window(data: bytes, expected: int, what: str) -> None:
    """Reads Window_Descriptor (RFC 8878, 3.1.1.1.2) itself: zstd does not tell the largest windows from no frame, and
    max_window_size does not bind where all is decompressed in one call."""
    if data[:4] == zstandard.FRAME_HEADER and len(data) > 5 and not data[4] & _ZSTD_SINGLE_SEGMENT:
        exponent, mantissa = data[5] >> 3, data[5] & 7
        window = (8 + mantissa) << 7 + exponent
        if window > max(_ZSTD_WINDOW, expected):
            raise LimitExceeded(f"{what}: got a zstd window of {window} bytes; the limit is {_ZSTD_WINDOW}")


def zstd_decompress_exact(data: bytes, expected: int, what: str, limits: Limits) -> bytes:
    """One zstd frame that says it holds `expected` bytes and does; anything else raises BadChunk or LimitExceeded."""
    if expected > limits.decoded_chunk_bytes:
        raise LimitExceeded(f"{what}: got {expected} bytes; the limit is {limits.decoded_chunk_bytes}")
    _check_window(data, expected, what)
    try:
        if expected == 0 or zstandard.frame_content_size(data) != expected:
            raise BadChunk(f"{what}: got a zstd frame of another size; expected {expected} bytes")
        return zstandard.ZstdDecompressor(max_window_size=_ZSTD_WINDOW).decompress(data, allow_extra_data=False)
    except (zstandard.ZstdError, MemoryError) as error:
        raise BadChunk(f"{what}: got a zstd frame that does not decode ({error}); expected {expected} bytes") from None


def _type_of(dtype: np.dtype) -> object:
    return np.lib.format.dtype_to_descr(dtype)


_PLAIN_TYPE = re.compile(r"\|b1|[|<>]?[iu]1|[<>][iu][248]|[<>]f[248]|[<>]c(8|16)|\|S\d{1,7}|[<>]U\d{1,6}|\|V\d{1,7}")


def _is_type(description: object, nesting: int = 16) -> bool:
    """Whether a type follows the grammar of FORMAT.md: a plain one, or a record's [name, type(, shape)] entries."""
    if isinstance(description, str):
        return _PLAIN_TYPE.fullmatch(description) is not None
    return isinstance(description, list) and nesting > 0 and bool(description) and all(
        isinstance(entry, list) and 2 <= len(entry) <= 3 and isinstance(entry[0], str)
        and (entry[0] or (len(entry) == 2 and str(entry[1]).startswith("|V")))
        and _is_type(entry[1], nesting - 1) and all(map(_is_shape, entry[2:])) for entry in description)


def _is_shape(shape: object) -> bool:
    return isinstance(shape, list) and len(shape) <= 32 and all(type(n) is int and 0 <= n < 1 << 40 for n in shape)


def _as_numpy(description: list) -> list:
    """Record entries as NumPy wants them: tuples."""
    return [(name, _as_numpy(kind) if isinstance(kind, list) else kind, *map(tuple, shape))
            for name, kind, *shape in description]


def _dtype_from(description: object, what: str) -> np.dtype:
    dtype = None
    if _is_type(description):
        record = isinstance(description, list)
        with suppress(TypeError, ValueError, OverflowError):
            dtype = np.lib.format.descr_to_dtype(_as_numpy(description) if record else description)
    if dtype is None or not 0 < dtype.itemsize <= ITEM_BYTES:
        raise BadChunk(f"{what}: got type {brief(description)}; expected plain numbers, bytes or records")
    return dtype


def pack_array(array: np.ndarray | None, name: str = "", **notes: object) -> bytes:
    """A named static array, any plain dtype and shape; None stores only the notes.

    Raises ClipError for what no reader would accept.
    """
    what, limits = f"array {brief(name)}" if name else "array", Limits()
    head: dict[str, object] = notes | ({"name": name} if name else {})
    with _refusals(what):
        if array is not None:
            description = json.loads(json.dumps(_type_of(array.dtype)))
            if array.nbytes > limits.decoded_chunk_bytes:  # before it is compressed
                raise LimitExceeded(f"{what}: got {array.nbytes} bytes; the limit is {limits.decoded_chunk_bytes}")
            _dtype_from(description, what)
            head |= {"dtype": description, "shape": list(array.shape)}
        text = json.dumps(head, separators=(",", ":"), ensure_ascii=False).encode()
        packed = _ARRAY.pack(len(text)) + text + (_compress(array) if array is not None and array.size else b"")
        parse_array(packed, what, limits)
        if name:
            array_name(packed, what, limits)
    return packed


@contextmanager
def _refusals(what: str) -> Iterator[None]:
    """What a reader would refuse of something that is being written is the source's fault: ClipError."""
    try:
        yield
    except FormatError as error:
        raise ClipError(str(error)) from None
    except (TypeError, ValueError, RecursionError, struct.error) as error:
        raise ClipError(f"{what}: {error}; expected plain data that a file can hold") from None


def _array_head(data: bytes, what: str) -> tuple[dict, bytes]:
    (length,) = _head(_ARRAY, data, what)
    if length > len(data) - _ARRAY.size:
        raise BadChunk(f"{what}: got a head of {length} bytes; expected at most what the chunk holds")
    return _parse_json(data[_ARRAY.size: _ARRAY.size + length], what), data[_ARRAY.size + length:]


def parse_array(data: bytes, what: str, limits: Limits) -> tuple[dict, np.ndarray | None]:
    """(head, array): array is None where only notes were stored."""
    head, body = _array_head(data, what)
    array = None
    if "dtype" in head:
        dtype, shape = _dtype_from(head["dtype"], what), head.get("shape")
        if not _is_shape(shape):
            raise BadChunk(f"{what}: got shape {brief(shape)}; expected a list of sizes")
        if math.prod(shape) > 0:
            return head, _decompress(body, dtype, tuple(shape), what, limits)
        if math.prod(n or 1 for n in shape) * dtype.itemsize > limits.decoded_chunk_bytes:
            raise LimitExceeded(f"{what}: got shape {brief(shape)}; the limit is {limits.decoded_chunk_bytes} bytes")
        array = np.zeros(shape, dtype)
    if body:
        raise BadChunk(f"{what}: got {len(body)} bytes behind a head without data; expected none")
    return head, array


def array_name(data: bytes, what: str, limits: Limits) -> str:
    """The name of a static array without its data."""
    name = _array_head(data, what)[0].get("name")
    if not isinstance(name, str) or not name:
        raise BadChunk(f"{what}: got name {brief(name)}; expected text")
    if len(name.encode(errors="replace")) > limits.string_bytes:
        raise LimitExceeded(f"{what}: got a name of {len(name)} characters; the limit is {limits.string_bytes} bytes")
    return name


def pack_metadata(metadata: dict) -> bytes:
    """JSON, zstd-compressed where that is shorter. Raises ClipError for what no reader would accept."""
    with _refusals("metadata"):
        text = json.dumps(metadata, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        shorter = zstandard.ZstdCompressor(level=19, write_content_size=True).compress(text)
        packed = b"\1" + shorter if len(shorter) < len(text) else b"\0" + text
        parse_metadata(packed, Limits())
    return packed


def parse_metadata(data: bytes, limits: Limits) -> dict:
    if not data or data[0] > 1:
        raise BadChunk("METADATA: got an unknown method; expected 0 or 1")
    text = data[1:]
    if data[0] == 1:
        _check_window(text, 0, "METADATA")
        try:
            size = zstandard.frame_content_size(text)
        except zstandard.ZstdError:
            size = 0
        if size <= 0:
            raise BadChunk("METADATA: got a zstd frame that does not say its size; expected one that does")
        if size > limits.metadata_bytes:
            raise LimitExceeded(f"METADATA: got {size} bytes; the limit is {limits.metadata_bytes}")
        text = zstd_decompress_exact(text, size, "METADATA", limits)
    if len(text) > limits.metadata_bytes:
        raise LimitExceeded(f"METADATA: got {len(text)} bytes; the limit is {limits.metadata_bytes}")
    return _parse_json(text, "METADATA")


def _parse_json(text: bytes, what: str) -> dict:
    try:
        value = json.loads(text.decode(), object_pairs_hook=_unique, parse_constant=_refuse, parse_float=_finite)
        json.dumps(value, ensure_ascii=False).encode()  # lone surrogates
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise BadChunk(f"{what}: got {text[:40]!r}; expected a JSON object")
    return value


def _unique(pairs: list) -> dict:
    if len(dict(pairs)) < len(pairs):
        raise ValueError("a key twice")
    return dict(pairs)


def _refuse(constant: str):
    raise ValueError(constant)


def _finite(number: str) -> float:
    if not math.isfinite(float(number)):
        raise ValueError(number)
    return float(number)
