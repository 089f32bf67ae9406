"""The front of an .ath file (FORMAT.md, "File"), as it is written, and its static data, as they are read.

A file is its front, which says what it holds, then the chunks in table order without gaps, so that offsets are never
stored and cannot disagree. encoding/streams/writing.py makes the chunks. The C core parses files; only static arrays
and metadata, which it hands over as stored, are parsed here.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Container
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
import zstandard

from athcodec import _native
from athcodec._native import MEASURES, SHORT_FLOATS, SHORT_SHIFT, address, crc32c, lib
from athcodec.errors import BadChunk, LimitExceeded
from athcodec.options import set_numbers
from athcodec.untyped import JsonObject, JsonValue

MAGIC = b"\x89ATH\r\n\x1a\n"
MAJOR = 1  # Version of the format (FORMAT.md, Versions).
MINOR = 0
FEATURES = 0  # Bits of the features that files of this version use; none has a bit yet.
NO_LEVEL = 255
WAVES, BASIS_IN_WAVES, BASIS_AS_SAMPLES = range(3)  # Values of Basis.
ROTATION_FACTORS = (0, 1, 8)  # by Rotation
OPTIONAL, KIND_ID = 0x8000, 0x7FFF
FIRST_PRIVATE = 0xC000  # The first kind of chunk that other programs may define.
PRIVATE_KINDS = "private_kinds"  # Key of metadata: names of the kinds of chunks that other programs define.

HIERARCHY, REST, TIME = 1, 2, 3
METADATA, FACES, EDGES = OPTIONAL | 4, 5, OPTIONAL | 6
CLIPS, PLACES = 7, 8
STEMS, AFFINES, CORRECTIONS, SHAPES, EXACT, REFINED_REST, PREDICTED = 16, 17, 18, 19, 20, 21, 22
ATTRIBUTE, SOURCE_REST = OPTIONAL | 32, 33
KIND_NAMES = {
    HIERARCHY: "HIERARCHY",
    REST: "REST",
    TIME: "TIME",
    METADATA: "METADATA",
    FACES: "FACES",
    EDGES: "EDGES",
    CLIPS: "CLIPS",
    PLACES: "PLACES",
    SOURCE_REST: "SOURCE_REST",
    STEMS: "STEMS",
    AFFINES: "AFFINES",
    CORRECTIONS: "CORRECTIONS",
    SHAPES: "SHAPES",
    EXACT: "EXACT",
    REFINED_REST: "REFINED_REST",
    PREDICTED: "PREDICTED",
    ATTRIBUTE: "ATTRIBUTE",
}

_HEADER = struct.Struct("<8sBBHIII")
_CHECKSUM = struct.Struct("<I")
_FRONT_BYTES, _FRONT_BYTES_OF_EACH, _FRONT_BYTES_OF_FRAME = 512, 128, 2
"""Space for the front stream, of each chunk, each entry of the error table and each frame too: more than it ever takes.
"""


@dataclass(frozen=True)
class Limits:
    """Limits on what a reader accepts; FORMAT.md, "Limits". The defaults are those of the full profile.

    Attributes
    ----------
    chunks, vertices, branches, frames, attributes : int
        Largest numbers of them.
    hierarchy_depth : int
        Branches on each other.
    table_bytes, metadata_bytes, string_bytes, chunk_bytes, decoded_chunk_bytes : int
        Largest sizes: of the front and of both tables, of metadata, of a name, of a chunk as stored, of a static array.
    memory_bytes : int
        What preparing a segment may take.
    corners : int
        Faces and corners of FACES together, and of EDGES.
    """

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
    corners: int = 1 << 26

    def __post_init__(self) -> None:
        set_numbers(self, wholes=self.__dataclass_fields__)

    @classmethod
    def small(cls) -> Limits:
        """Return the limits of the format's small profile, which phones and web pages are expected to decode."""
        return cls(
            chunks=1 << 16,
            table_bytes=1 << 20,
            metadata_bytes=1 << 18,
            vertices=1 << 20,
            branches=1 << 16,
            frames=1 << 16,
            hierarchy_depth=1024,
            attributes=64,
            chunk_bytes=32 << 20,
            decoded_chunk_bytes=32 << 20,
            memory_bytes=256 << 20,
            corners=1 << 23,
        )


def _array() -> Any:
    return field(default=None, compare=False, repr=False)


@dataclass
class Header:
    """The counts at the front. `max_error` is the promise of the deepest stored level, in scene units; frames and
    segments are those of all clips."""

    vertex_count: int
    place_count: int
    branch_count: int
    frame_count: int
    segment_count: int
    level_count: int
    full_level_count: int
    max_error: float
    is_float64: bool = False
    clip_count: int = 1
    layer_count: int = 1
    is_predicted: bool = False
    chunk_count: int = 0
    file_length: int = 0
    stages: tuple[int, ...] = ()  # Stage of each of the full_level_count levels; (): every stage is a level.
    joins: np.ndarray | None = _array()  # (levels, segments) uint8; None: all are 0
    repeats: np.ndarray | None = _array()  # (frames,) bool: like the one before; None: none


def is_prelude(kind: Any) -> Any:
    """Return whether chunks of a kind, or of an array of kinds, stand in front of those of the motion."""
    return (kind & KIND_ID) < 16


def is_motion(kind: Any) -> Any:
    """Return whether chunks of a kind, or of an array of kinds, are of a level and a segment: known and reserved
    ones."""
    return (kind & KIND_ID) // 16 == 1


@dataclass(frozen=True)
class Chunk:
    """One entry of the chunk table, with the offset that follows from those before it, and its index in the table of a
    file that is read."""

    kind: int
    level: int
    segment: int
    length: int
    checksum: int
    offset: int = 0
    index: int = -1
    stage: int | None = None  # Stage in the table, which counts those that are no levels too; None: `level`.

    @property
    def is_motion(self) -> bool:
        """Whether the chunk is of a level and a segment."""
        return bool(is_motion(self.kind))

    def __str__(self) -> str:
        name = KIND_NAMES.get(self.kind, f"kind {self.kind:#06x}")
        place = f" of level {self.level}, segment {self.segment}" if self.is_motion else ""
        return f"chunk {name}{place} at byte {self.offset}"


def pack_front(header: Header, chunks: list[Chunk], errors: np.ndarray) -> bytes:
    """Return the bytes of the file before the chunks: header, counts, chunk table, errors and checksums. This sets
    `header.chunk_count` and `header.file_length`.

    `errors` (levels, segments, 3) are in scene units, in the order of `MEASURES`; they are rounded up.
    """
    header.chunk_count = len(chunks)
    stream = _front_stream(header, chunks, short_floats(errors))
    checksums = b"".join(_CHECKSUM.pack(chunk.checksum) for chunk in chunks)
    length = _HEADER.size + len(stream) + len(checksums)
    header.file_length = length + sum(chunk.length for chunk in chunks)
    blank = _HEADER.pack(MAGIC, MAJOR, MINOR, FEATURES, 0, length, len(chunks))
    checksum = crc32c(blank + stream + checksums)
    return _HEADER.pack(MAGIC, MAJOR, MINOR, FEATURES, checksum, length, len(chunks)) + stream + checksums


def _front_stream(header: Header, chunks: list[Chunk], errors: np.ndarray) -> bytes:
    """Return the compressed counts, chunk table and errors at the front of a file (FORMAT.md, "Front stream"). `errors`
    (levels, segments, 3) has the error measures of each segment as the format's short floats."""
    names = (name for name, _ in _native.Header._fields_ if name != "stages" and hasattr(header, name))
    counts = _native.Header(**{name: getattr(header, name) for name in names})
    first = header.stages[-1] + 1 if header.stages else 0
    most = min(max(header.full_level_count, 0), len(counts.stages))
    counts.stages[:most] = [*header.stages, *range(first, first + most)][:most]
    table = np.zeros(len(chunks), _native.CHUNK)
    for name in ("length", "segment", "kind"):
        table[name] = [getattr(chunk, name) for chunk in chunks]
    table["stage"] = [chunk.level if chunk.stage is None else chunk.stage for chunk in chunks]
    space = _FRONT_BYTES + _FRONT_BYTES_OF_EACH * (len(chunks) + errors.size // len(MEASURES))
    data = np.empty(space + _FRONT_BYTES_OF_FRAME * header.frame_count, np.uint8)
    entries = header.level_count * header.segment_count
    announced = address(errors, np.int32, entries * len(MEASURES))
    joins = np.zeros(entries, np.uint8) if header.joins is None else np.ascontiguousarray(header.joins)
    widths = address(joins, np.uint8, entries)
    flags = None if header.repeats is None or not header.repeats.any() else header.repeats.astype(np.uint8)
    repeats = None if flags is None else address(flags, np.uint8, header.frame_count)
    size = lib.ath_encode_front(data.ctypes.data, len(data), counts, table.ctypes.data, announced, widths, repeats)
    assert size >= 0, "every front has a stream, and space enough"
    return data[:size].tobytes()


def short_floats(lengths: np.ndarray) -> np.ndarray:
    """Return the numbers that the error table stores for lengths, int32: the top bits of binary32, rounded up."""
    bits = np.ascontiguousarray(round_up_singles(lengths), np.float32).view(np.uint32)
    return np.minimum(bits + (1 << SHORT_SHIFT) - 1 >> SHORT_SHIFT, SHORT_FLOATS - 1).astype(np.int32)


def from_short_float(stored: int) -> float:
    """Return the length of which the error table stores this, scene units."""
    return float(np.uint32(stored << SHORT_SHIFT).view(np.float32))


def short_float_within(length: float) -> float:
    """Return the largest length up to this one that the error table stores as it is."""
    [stored] = short_floats(np.array([length]))
    return from_short_float(stored if from_short_float(stored) <= length else stored - 1)


def round_up_singles(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, np.float64)
    single = values.astype(np.float32)
    return np.where(single < values, np.nextafter(single, np.float32(np.inf)), single)


def brief(value: object) -> str:
    """Return what a file holds as an error message shows it."""
    text = repr(value)
    return text if len(text) <= 100 else text[:97] + "..."


ARRAY_HEAD = struct.Struct("<BBHI")  # Type, Dimensions, Name_Length and Item_Bytes of ATTRIBUTE.
_ZSTD_WINDOW = 8 << 20  # Largest window of a zstd frame, in bytes.
_ZSTD_SINGLE_SEGMENT = 0x20

# Types of static arrays: NumPy's letters in the order of FORMAT.md, and the bytes that an element may have.
ARRAY_KINDS = "buifS"
_INTEGER_SIZES = 1, 2, 4, 8
_KIND_SIZES: dict[str, Container[int]] = {
    "b": (1,),
    "u": _INTEGER_SIZES,
    "i": _INTEGER_SIZES,
    "f": (2, 4, 8),
    "S": range(1, (1 << 20) + 1),
}
_MOST_DIMENSIONS = 32


def _decompress(data: bytes, dtype: np.dtype, shape: tuple[int, ...], subject: str, limits: Limits) -> np.ndarray:
    size = math.prod(shape) * dtype.itemsize
    raw = np.frombuffer(zstd_decompress_exact(data, size, subject, limits), np.uint8)
    return np.frombuffer(raw.reshape(dtype.itemsize, -1).T.tobytes(), dtype).reshape(shape)


def _check_window(data: bytes, expected: int, subject: str) -> None:
    """Check Window_Descriptor (RFC 8878, 3.1.1.1.2), because zstd does not tell the largest windows from no frame, and
    max_window_size has no effect if all is decompressed in one call."""
    if data[:4] == zstandard.FRAME_HEADER and len(data) > 5 and not data[4] & _ZSTD_SINGLE_SEGMENT:
        exponent, mantissa = data[5] >> 3, data[5] & 7
        window = (8 + mantissa) << 7 + exponent
        if window > max(_ZSTD_WINDOW, expected):
            raise LimitExceeded(f"{subject}: got a zstd window of {window} bytes; the limit is {_ZSTD_WINDOW}")


def zstd_decompress_exact(data: bytes, expected: int, subject: str, limits: Limits) -> bytes:
    """Return the content of a zstd frame. `subject` begins messages. Raises BadChunk unless the frame states and holds
    `expected` bytes, LimitExceeded if these are too many."""
    if expected > limits.decoded_chunk_bytes:
        raise LimitExceeded(f"{subject}: got {expected} bytes; the limit is {limits.decoded_chunk_bytes}")
    _check_window(data, expected, subject)
    try:
        if expected == 0 or zstandard.frame_content_size(data) != expected:
            raise BadChunk(f"{subject}: got a zstd frame of another size; expected {expected} bytes")
        return zstandard.ZstdDecompressor(max_window_size=_ZSTD_WINDOW).decompress(data, allow_extra_data=False)
    except (zstandard.ZstdError, MemoryError) as error:
        raise BadChunk(
            f"{subject}: got a zstd frame that does not decode ({error}); expected {expected} bytes"
        ) from None


def parse_array(data: bytes, subject: str, limits: Limits) -> tuple[str, np.ndarray]:
    """Return (name, array) from the bytes of an ATTRIBUTE chunk. `subject` begins messages. Raises BadChunk,
    LimitExceeded."""
    if len(data) < ARRAY_HEAD.size:
        raise BadChunk(f"{subject}: got {len(data)} bytes; expected at least {ARRAY_HEAD.size}")
    code, dimensions, length, size = ARRAY_HEAD.unpack_from(data)
    start = ARRAY_HEAD.size + 4 * dimensions
    if start + length > len(data):
        raise BadChunk(f"{subject}: got a head of {start + length} bytes; expected at most what the chunk holds")
    dtype = _array_type(code, size, subject)
    shape, body = struct.unpack_from(f"<{dimensions}I", data, ARRAY_HEAD.size), data[start + length :]
    name = _array_name(data[start : start + length], subject, limits)
    if dimensions > _MOST_DIMENSIONS:
        raise BadChunk(f"{subject}: got {dimensions} dimensions; expected at most {_MOST_DIMENSIONS}")
    if math.prod(n or 1 for n in shape) * size > limits.decoded_chunk_bytes:
        raise LimitExceeded(f"{subject}: got shape {shape}; the limit is {limits.decoded_chunk_bytes} bytes")
    if math.prod(shape):
        return name, _decompress(body, dtype, shape, subject, limits)
    if body:
        raise BadChunk(f"{subject}: got {len(body)} bytes behind an array without elements; expected none")
    return name, np.zeros(shape, dtype)


def _array_type(code: int, size: int, subject: str) -> np.dtype:
    """Return the dtype of Type and Item_Bytes."""
    if code >= len(ARRAY_KINDS) or size not in _KIND_SIZES[ARRAY_KINDS[code]]:
        raise BadChunk(f"{subject}: got type {code} of {size} bytes; expected numbers, booleans or texts")
    return np.dtype(f"<{ARRAY_KINDS[code]}{size}")


def _array_name(text: bytes, subject: str, limits: Limits) -> str:
    """Return the name of an array from its UTF-8 bytes. `subject` begins messages. Raises LimitExceeded if it is too
    long, BadChunk if it is no text."""
    if len(text) > limits.string_bytes:
        raise LimitExceeded(f"{subject}: got a name of {len(text)} bytes; the limit is {limits.string_bytes}")
    try:
        name = text.decode()
    except UnicodeDecodeError:
        name = ""
    if not name:
        raise BadChunk(f"{subject}: got name {brief(text)}; expected text")
    return name


def parse_metadata(data: bytes, limits: Limits) -> JsonObject:
    """Return the JSON object in the bytes of a METADATA chunk. Raises BadChunk, LimitExceeded."""
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


def _parse_json(text: bytes, subject: str) -> JsonObject:
    """Return the JSON object in `text`. Raises BadChunk, which begins with `subject`, for anything else, for a repeated
    key and for numbers that are not finite."""
    try:
        value = json.loads(text.decode(), object_pairs_hook=_unique, parse_constant=_refuse, parse_float=_finite)
        json.dumps(value, ensure_ascii=False).encode()  # Raises for lone surrogates.
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise BadChunk(f"{subject}: got {text[:40]!r}; expected a JSON object")
    return value


def _unique(pairs: list[tuple[str, JsonValue]]) -> JsonObject:
    if len(dict(pairs)) < len(pairs):
        raise ValueError("a key twice")
    return dict(pairs)


def _refuse(constant: str) -> NoReturn:
    raise ValueError(constant)


def _finite(number: str) -> float:
    if not math.isfinite(float(number)):
        raise ValueError(number)
    return float(number)
