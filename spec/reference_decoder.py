"""The .ath format decoded in plain Python and NumPy, to learn it from and to hold other decoders to.

Written from FORMAT.md alone, section by section and in its words; nothing of athcodec is imported. Where
FORMAT.md computes vertex by vertex and frame by frame, arrays take all frames at once: that changes no
result, because every sum still runs in the order written (`in_order`). It decodes whole levels of whole
files, slowly; it does not play, write or repair them.

    python spec/reference_decoder.py FILE [--level L] [--strict] [--out positions.npy] [--checksum]
"""

from __future__ import annotations

import argparse
import json
import math
import struct
import sys
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import islice

import numpy as np
import zstandard

# ---- errors and limits -------------------------------------------------------------------------------------


class AthError(Exception):
    """A file that is refused; `name` is that of FORMAT.md, "Errors"."""

    def __init__(self, name: str, reason: str):
        super().__init__(f"{name}: {reason}")
        self.name = name


def require(condition: bool, reason: str, error: str = "BAD_CHUNK") -> None:
    if not condition:
        raise AthError(error, reason)


@dataclass(frozen=True)
class Limits:
    """FORMAT.md, "Limits": each field is Max_..., with its default."""

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


# ---- reading fields ----------------------------------------------------------------------------------------


def reader(code: str):
    form = struct.Struct("<" + code)
    return lambda data, at: form.unpack_from(data, at)[0]


u16, u32, u64, f32, f64 = map(reader, "HIQfd")
finite = math.isfinite


def _crc_table() -> list[int]:
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = (byte >> 1) ^ (0x82F63B78 if byte & 1 else 0)
        table.append(byte)
    return table


CRC_TABLE = _crc_table()


def crc32c(data: bytes) -> int:
    """FORMAT.md, "Checksums"; a byte at a time instead of a bit at a time."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc = (crc >> 8) ^ CRC_TABLE[(crc ^ byte) & 255]
    return crc ^ 0xFFFFFFFF


# ---- the front: header and chunks ----------------------------------------------------------------------

MAGIC = b"\x89ATH\r\n\x1a\n"
VERSION, KNOWN_FEATURES = (0, 13), 0x0000
HEADER_BYTES, CHECKSUM_BYTES, TABLE_BYTES_OF_EACH = 24, 4, 16
SEGMENT_FRAMES, MOST_LEVELS, MOST_LAYERS, MOST_CLIPS, NO_LEVEL = 256, 32, 8, 255, 255

OPTIONAL = 0x8000
HIERARCHY, REST, TIME = 1, 2, 3
IS_HOST = 4  # of REST's Method
METADATA, FACES, EDGES, CLIPS = OPTIONAL | 4, OPTIONAL | 5, OPTIONAL | 6, 7
STEMS, AFFINES, CORRECTIONS, SHAPES, EXACT, REFINED_REST, PREDICTED = 16, 17, 18, 19, 20, 21, 22
ATTRIBUTE, SOURCE_REST = OPTIONAL | 32, 33
KINDS = {
    HIERARCHY: "HIERARCHY",
    REST: "REST",
    TIME: "TIME",
    METADATA: "METADATA",
    FACES: "FACES",
    EDGES: "EDGES",
    CLIPS: "CLIPS",
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


@dataclass(frozen=True)
class Header:
    front_length: int
    chunk_count: int
    vertex_count: int
    branch_count: int
    frame_count: int
    segment_count: int
    full_level_count: int
    level_count: int
    clip_count: int
    layer_count: int
    is_float64: bool
    is_predicted: bool
    max_error: float


@dataclass(frozen=True)
class Chunk:
    kind: int
    level: int
    segment: int
    length: int
    checksum: int
    offset: int

    @property
    def key(self) -> tuple:
        """What grows along the file."""
        kind_id = self.kind & ~OPTIONAL
        if 16 <= kind_id < 32:
            return (1, self.level, self.segment, self.kind)
        return (0, kind_id) if kind_id < 16 else (2, kind_id)

    @property
    def is_motion(self) -> bool:
        return self.key[0] == 1

    @property
    def repeatable(self) -> bool:
        return bool(self.kind & OPTIONAL) and (self.kind & ~OPTIONAL) >= 32

    def __str__(self) -> str:
        name = KINDS.get(self.kind, f"kind {self.kind:#06x}")
        return f"{name} of level {self.level}, segment {self.segment}" if self.is_motion else name


def check_kind(kind: int) -> None:
    """Kinds that are not known are skipped where they are optional and their number is not that of a known
    one."""
    taken = {known & ~OPTIONAL for known in KINDS}
    skipped = (kind & OPTIONAL) and (kind & ~OPTIONAL) not in taken
    require(kind in KINDS or bool(skipped), f"kind {kind:#06x} is not known", "UNKNOWN_CHUNK")


# ---- clips -------------------------------------------------------------------------------------------------

CLIP_BYTES = 10  # in front of the name


@dataclass(frozen=True)
class Clip:
    frames: int
    segments: int
    name: str = ""
    seams: tuple[float, ...] | None = None  # of a loop: Seam_Errors, one for each level
    periodic: bool = False  # a loop of one segment, in periodic waves

    @property
    def segment_lengths(self) -> list[int]:
        """Frames of each segment."""
        starts = [self.frames * k // self.segments for k in range(self.segments + 1)]
        return [stop - start for start, stop in zip(starts, starts[1:])]

    def entry(self) -> bytes:
        """What CLIPS says of it."""
        name, seams = self.name.encode("utf-8"), self.seams or ()
        head = struct.pack(
            "<IIBB", self.frames, self.segments, (self.seams is not None) | (self.periodic << 1), len(name)
        )
        return head + name + struct.pack(f"<{len(seams)}f", *seams)


def read_clips(chunk: bytes, header: Header) -> list[Clip]:
    clips, at = [], 0
    for _ in range(header.clip_count):
        clip, at = read_clip(chunk, at, header)
        clips.append(clip)
    require(at == len(chunk), "CLIPS has bytes behind its last clip")
    require(len({clip.name for clip in clips}) == len(clips), "two clips have the same Name")
    require(sum(clip.frames for clip in clips) == header.frame_count, "Clip_Frames do not add up to Frame_Count")
    require(
        sum(clip.segments for clip in clips) == header.segment_count, "Clip_Segments do not add up to Segment_Count"
    )
    return clips


def read_clip(chunk: bytes, at: int, header: Header) -> tuple[Clip, int]:
    """One entry, and where the next one begins."""
    require(at + CLIP_BYTES <= len(chunk), "CLIPS ends inside a clip")
    frames, segments, flags, length = u32(chunk, at), u32(chunk, at + 4), chunk[at + 8], chunk[at + 9]
    require(1 <= segments <= frames <= SEGMENT_FRAMES * segments, "Clip_Frames or Clip_Segments is out of range")
    require(flags < 4, "Clip_Flags has reserved bits")
    require(flags < 2 or (flags == 3 and segments == 1), "Periodic of a clip that is no loop of one segment")
    require(length > 0 or header.clip_count == 1, "Name_Length is 0 in a file of several clips")
    name_at, seams_at = at + CLIP_BYTES, at + CLIP_BYTES + length
    end = seams_at + (4 * header.full_level_count if flags & 1 else 0)
    require(end <= len(chunk), "CLIPS ends inside a clip")
    seams = tuple(f32(chunk, i) for i in range(seams_at, end, 4)) if flags & 1 else None
    require(all(finite(seam) and seam >= 0.0 for seam in seams or ()), "a seam's error is no length")
    return Clip(frames, segments, clip_name(chunk[name_at:seams_at]), seams, flags >= 2), end


def clip_name(name: bytes) -> str:
    try:
        text = name.decode("utf-8")
    except UnicodeDecodeError:
        raise AthError("BAD_CHUNK", "the Name of a clip is not UTF-8") from None
    require(all(c >= " " and c != "\x7f" for c in text), "the Name of a clip has a control character")
    return text


# ---- range coder -------------------------------------------------------------------------------------------

MASK = (1 << 64) - 1
SLOWEST = 60
RATES = [131072 // (2 * seen + 5) for seen in range(SLOWEST)] + [690]
LEAST, MOST = 48, 65536 - 48


class Context:
    """The probability of a 1, in 1/65536, and how many bits it has seen."""

    __slots__ = ("one", "seen")

    def __init__(self, one: int):
        self.one = min(max(one, LEAST), MOST)
        self.seen = 0


class RangeDecoder:
    """One stream: binary decisions, each under a context that learns from it, or raw."""

    def __init__(self, stream: bytes):
        self.stream, self.at, self.range = stream, 0, MASK
        self.code = self.word() << 32
        self.code |= self.word()

    def word(self) -> int:
        """Four bytes, big-endian; those behind the end are 0."""
        four = self.stream[self.at : self.at + 4]
        self.at += 4
        return int.from_bytes(four, "big") << (8 * (4 - len(four)))

    def narrow(self, bound: int) -> int:
        if self.code < bound:
            self.range, bit = bound, 1
        else:
            self.code -= bound
            self.range -= bound
            bit = 0
        if self.range < (1 << 32):
            self.range <<= 32
            self.code = ((self.code << 32) | self.word()) & MASK
        return bit

    def bit(self, context: Context) -> int:
        one = context.one
        bit = self.narrow((self.range >> 16) * one)
        if bit:
            one += ((65536 - one) * RATES[context.seen]) >> 16
        else:
            one -= (one * RATES[context.seen]) >> 16
        context.one = LEAST if one < LEAST else MOST if one > MOST else one
        if context.seen < SLOWEST:
            context.seen += 1
        return bit

    def raw_bit(self) -> int:
        return self.narrow(self.range >> 1)

    def is_finished(self) -> bool:
        """Nothing may be left over, nor a byte that could have been left out."""
        canonical = not self.stream or self.stream[-1] != 0
        return canonical and self.at >= len(self.stream) and self.code < self.range

    def finish(self) -> None:
        """Everything is decoded."""
        require(self.is_finished(), "a stream is not used up where it should be, or ends in a zero byte")


# ---- numbers -----------------------------------------------------------------------------------------------

LONGEST = 30  # bits of a magnitude
CLASSES = 28


def number_class(expected: int) -> int:
    """0, 1, 2, 3, 4, 6, 8, 12, 16, ... begin a class."""
    length = expected.bit_length()
    if length < 2:
        return length
    return min(2 * length - 2 + ((expected >> (length - 2)) & 1), CLASSES - 1)


class Contexts(dict):
    """Lists of contexts by a number, each made when it is first asked for: most never are."""

    def __init__(self, starts):
        super().__init__()
        self.starts = starts  # of a number: the probabilities that its contexts start with

    def __missing__(self, number: int) -> list[Context]:
        self[number] = [Context(one) for one in self.starts(number)]
        return self[number]


@cache
def size_starts(c: int) -> list[int]:
    """Probabilities of one more bit of length, for class c."""
    mean = 2 * c + 1 if c < 2 else (5 + 2 * (c & 1)) << (c // 2 - 1)
    more = (mean << 16) // (mean + 32)
    starts = [more]
    for _ in range(LONGEST - 1):
        starts.append(more)
        more = (more * more) >> 16
    return starts


class NumberModel:
    """Contexts of integers: of the bit length, by the class of the magnitude expected, and of the bits below
    the leading one, by the length."""

    def __init__(self):
        self.size = Contexts(size_starts)
        self.mantissa = Contexts(lambda length: [30000] * 4)


def code_unsigned(coder: RangeDecoder, model: NumberModel, expected: int) -> int:
    return code_in_class(coder, model, number_class(expected))


def code_in_class(coder: RangeDecoder, model: NumberModel, c: int) -> int:
    size = model.size[c]
    length = 0
    while length < LONGEST and coder.bit(size[length]):
        length += 1
    return code_mantissa(coder, model.mantissa, length) if length > 0 else 0


def code_mantissa(coder: RangeDecoder, contexts: Contexts, length: int) -> int:
    value = 1
    for taken in range(length - 1):
        if taken < 2:
            bit = coder.bit(contexts[length][0 if taken == 0 else 1 + (value & 1)])
        else:
            bit = coder.raw_bit()
        value = (value << 1) | bit
    return value


def code_signed(coder: RangeDecoder, model: NumberModel, expected: int) -> int:
    return code_signed_in_class(coder, model, number_class(expected))


def code_signed_in_class(coder: RangeDecoder, model: NumberModel, c: int, sign: Context | None = None) -> int:
    magnitude = code_in_class(coder, model, c)
    if magnitude == 0:
        return 0
    return -magnitude if code_sign(coder, sign) else magnitude


def code_sign(coder: RangeDecoder, sign: Context | None) -> int:
    return coder.raw_bit() if sign is None else coder.bit(sign)


ANY, EVEN, ODD = range(3)  # what is known of an integer


class LatticeModel:
    """Of integers of each parity."""

    def __init__(self):
        self.numbers = [NumberModel() for _ in range(3)]

    def code(self, coder: RangeDecoder, parity: int, c: int, sign: Context | None = None) -> int:
        half = max(c - 2, 0)
        if parity == ANY:
            return code_signed_in_class(coder, self.numbers[ANY], c, sign)
        if parity == EVEN:
            return 2 * code_signed_in_class(coder, self.numbers[EVEN], half, sign)
        negative = code_sign(coder, sign)
        magnitude = 2 * code_in_class(coder, self.numbers[ODD], half) + 1
        return -magnitude if negative else magnitude


def parity_of(point: list[int], k: int) -> int:
    """Of integer k of a point of the lattice."""
    return ANY if k == 0 else ODD if point[0] & 1 else EVEN


def clipped(value: int) -> int:
    return min(abs(value), 1 << 20)


def divide_to_zero(a: int, b: int) -> int:
    return a // b if a >= 0 else -(-a // b)


# ---- front stream ------------------------------------------------------------------------------------------

OTHER = len(KINDS)  # any kind but those
KIND_BITS = 5
SHORT_FLOATS, MEASURES = 8160, 3
KIND_LIST = list(KINDS)


def short_float(stored: int) -> float:
    return from_bits(stored << 18, 32)


def read_front(data: bytes, limits: Limits) -> tuple[Header, list[Chunk], list, list, list[int]]:
    """Counts, chunk table, [level][segment] (largest, 99th percentile, root mean square) errors, [level][segment]
    joins, and of each frame whether it repeats the one before."""
    check_magic(data)
    front_length, chunk_count = check_lengths(data, limits)
    checksums_at = front_length - CHECKSUM_BYTES * chunk_count
    checksums = [u32(data, checksums_at + CHECKSUM_BYTES * i) for i in range(chunk_count)]
    return decode_front(data[HEADER_BYTES:checksums_at], front_length, checksums, limits)


def decode_front(
    stream: bytes, front_length: int, checksums: list[int], limits: Limits
) -> tuple[Header, list[Chunk], list, list, list[int]]:
    coder = RangeDecoder(stream)
    header = decode_counts(coder, front_length, len(checksums))
    check_counts(header, limits)
    chunks = decode_chunk_table(coder, header, checksums, limits)
    errors = decode_error_table(coder, header)
    joins, repeats = decode_joins(coder, header), decode_repeats(coder, header)
    require(coder.is_finished(), "the front stream is not used up where it should be", "BAD_CHUNK_TABLE")
    return header, chunks, errors, joins, repeats


def check_magic(data: bytes) -> None:
    require(
        len(data) > 0 and data[:8] == MAGIC[: len(data)],
        "Magic is not that of a file in this format",
        "NOT_AN_ATH_FILE",
    )
    if len(data) >= 12:
        require((data[8], data[9]) == VERSION, f"version {data[8]}.{data[9]} is not known", "UNSUPPORTED_VERSION")
        features = u16(data, 10)
        require(features & ~KNOWN_FEATURES == 0, f"features {features:#06x} are not all known", "UNSUPPORTED_FEATURE")


def check_lengths(data: bytes, limits: Limits) -> tuple[int, int]:
    """Front_Length and Chunk_Count; all of the front is there and undamaged."""
    require(len(data) >= HEADER_BYTES, "ends inside its header", "TRUNCATED")
    length, chunks = u32(data, 16), u32(data, 20)
    require(chunks > 0, "Chunk_Count is 0", "BAD_HEADER")
    require(chunks <= limits.chunks, f"Chunk_Count is {chunks}, more than {limits.chunks}", "LIMIT_EXCEEDED")
    require(length <= limits.table_bytes, "Front_Length is too large", "LIMIT_EXCEEDED")
    require(length >= HEADER_BYTES + CHECKSUM_BYTES * chunks, "Front_Length is too small", "BAD_HEADER")
    require(len(data) >= length, "ends inside its front", "TRUNCATED")
    require(crc32c(data[:12] + bytes(4) + data[16:length]) == u32(data, 12), "the front is damaged", "BAD_CHECKSUM")
    return length, chunks


def raw_bits(coder: RangeDecoder, count: int) -> int:
    value = 0
    for _ in range(count):
        value = (value << 1) | coder.raw_bit()
    return value


def decode_counts(coder: RangeDecoder, front_length: int, chunk_count: int) -> Header:
    model = NumberModel()
    vertices = 1 + code_unsigned(coder, model, 1 << 16)
    branches = 1 + code_unsigned(coder, model, 2 * clipped(vertices))
    frames = 1 + code_unsigned(coder, model, 1 << 11)
    segments = 1 + code_unsigned(coder, model, frames // 4)
    full_levels = 2 + code_unsigned(coder, model, 64)
    levels = full_levels - code_unsigned(coder, model, 0)
    clips = 1 + code_unsigned(coder, model, 0)
    layers = 1 + code_unsigned(coder, model, 16)
    is_float64 = bool(coder.raw_bit())
    is_predicted = bool(coder.bit(Context(6000)))
    max_error = from_bits(raw_bits(coder, 63), 64)
    return Header(
        front_length,
        chunk_count,
        vertices,
        branches,
        frames,
        segments,
        full_levels,
        levels,
        clips,
        layers,
        is_float64,
        is_predicted,
        max_error,
    )


def check_counts(header: Header, limits: Limits) -> None:
    for name, count, most in (
        ("Vertex_Count", header.vertex_count, limits.vertices),
        ("Branch_Count", header.branch_count, limits.branches),
        ("Frame_Count", header.frame_count, limits.frames),
        ("Segment_Count", header.segment_count, limits.frames),
    ):
        require(count <= most, f"{name} is {count}, more than {most}", "LIMIT_EXCEEDED")
    for name, valid in (
        ("Branch_Count", header.branch_count <= header.vertex_count),
        ("Segment_Count", header.segment_count <= header.frame_count),
        ("Frame_Count", header.frame_count <= SEGMENT_FRAMES * header.segment_count),
        ("Full_Level_Count", header.full_level_count <= MOST_LEVELS),
        ("Level_Count", header.level_count >= 1),
        ("Clip_Count", header.clip_count <= MOST_CLIPS),
        ("Layer_Count", header.layer_count <= (1 if header.is_predicted else MOST_LAYERS)),
        ("Max_Error", finite(header.max_error)),
    ):
        require(valid, f"{name} is out of range", "BAD_HEADER")
    size = TABLE_BYTES_OF_EACH * (header.chunk_count + header.level_count * header.segment_count)
    require(size <= limits.table_bytes, "tables are too long", "LIMIT_EXCEEDED")


class ChunkModel:
    """Contexts of the chunk table, and what is remembered of the chunk before."""

    def __init__(self):
        self.kinds = [[Context(32768 if i > 1 else 2000) for i in range(1 << KIND_BITS)] for _ in range(OTHER + 1)]
        self.usual = [Context(60000) for _ in range(OTHER + 1)]
        self.places, self.sizes = NumberModel(), NumberModel()
        self.bits = [8] * (OTHER + 1)
        self.before, self.was_motion, self.place = OTHER, False, (0, 0)

    def code_kind(self, coder: RangeDecoder) -> tuple[int, int]:
        """Its number in the list, and the Kind."""
        node = 1
        while node < (1 << KIND_BITS):
            node = (node << 1) | coder.bit(self.kinds[self.before][node])
        index = min(node - (1 << KIND_BITS), OTHER)
        return index, KIND_LIST[index] if index < OTHER else raw_bits(coder, 16)

    def code_place(self, coder: RangeDecoder, index: int, segment_count: int) -> None:
        level, segment = self.place
        if self.was_motion and index <= self.before:
            usual = (level, segment + 1) if segment + 1 < segment_count else (level + 1, 0)
        else:
            usual = self.place
        if coder.bit(self.usual[self.before]):
            self.place = usual
        else:
            up = code_unsigned(coder, self.places, 16)
            self.place = level + up, code_unsigned(coder, self.places, 16) + (0 if up else segment)

    def code_length(self, coder: RangeDecoder, index: int) -> int:
        self.bits[index] = max(0, min(self.bits[index] + code_signed(coder, self.sizes, 16), LONGEST))
        return code_mantissa(coder, self.sizes.mantissa, self.bits[index]) if self.bits[index] else 0


def decode_chunk_table(coder: RangeDecoder, header: Header, checksums: list[int], limits: Limits) -> list[Chunk]:
    model, chunks, offset = ChunkModel(), [], header.front_length
    for checksum in checksums:
        index, kind = model.code_kind(coder)
        motion = 16 <= (kind & ~OPTIONAL) < 32
        if motion:
            model.code_place(coder, index, header.segment_count)
        length = model.code_length(coder, index)
        model.before, model.was_motion = index, motion
        level, segment = model.place if motion else (NO_LEVEL, 0)
        chunk = Chunk(kind, level, segment, length, checksum, offset)
        check_chunk(chunk, chunks[-1] if chunks else None, header, limits)
        chunks.append(chunk)
        offset += length
    return chunks


def check_chunk(chunk: Chunk, before: Chunk | None, header: Header, limits: Limits) -> None:
    check_kind(chunk.kind)
    require(chunk.length <= limits.chunk_bytes, f"{chunk} is too long", "LIMIT_EXCEEDED")
    if chunk.is_motion:
        fits = chunk.level < header.level_count and chunk.segment < header.segment_count
        require(fits, f"{chunk}: its place does not exist", "BAD_CHUNK_TABLE")
    if before:
        in_order = before.key < chunk.key or (before.key == chunk.key and chunk.repeatable)
        require(in_order, f"{chunk} may not follow {before}", "BAD_CHUNK_TABLE")


def decode_error_table(coder: RangeDecoder, header: Header) -> list:
    with np.errstate(over="ignore"):  # an infinity is more than any short float
        first = min(to_bits(single(header.max_error), 32) >> 18, SHORT_FLOATS - 1)
    model, means, above, table = NumberModel(), [[64] * MEASURES, [1024] * MEASURES], [first] * MEASURES, []
    for _ in range(header.level_count):
        row: list[list[int]] = []
        for segment in range(header.segment_count):
            before, mean = (row[-1], means[0]) if segment else (above, means[1])
            row.append(decode_errors(coder, model, before, mean))
        table.append([tuple(map(short_float, entry)) for entry in row])
        above = row[0]
    table[-1] = [tuple(min(error, header.max_error) for error in entry) for entry in table[-1]]
    return table


def decode_errors(coder: RangeDecoder, model: NumberModel, before: list[int], mean: list[int]) -> list[int]:
    entry, change = [], 0
    for i in range(MEASURES):
        more = code_signed(coder, model, mean[i])
        mean[i] += divide_to_zero(clipped(more) * 16 - mean[i], 2)
        change += more
        require(0 <= before[i] + change < SHORT_FLOATS, "an announced error is no short float", "BAD_CHUNK_TABLE")
        entry.append(before[i] + change)
    return entry


MOST_WIDTH = 127


ROOT_HALF = 0.70710678118654752440
BEND = 0.5 + ROOT_HALF


@dataclass(frozen=True)
class Join:
    """How a segment goes on from the end of the one before it."""

    width: int  # frames; 0: it does not
    is_sloped: bool = False

    def apply(self, end: np.ndarray, x: np.ndarray) -> np.ndarray:
        """end: the last two frames of the segment before; x: those of this one; frames come last."""
        start, last, first, second = (y.astype(float) for y in (end[..., 0], end[..., 1], x[..., 0], x[..., 1]))
        jump, slope = 0.5 * (3.0 * (last - first) - (start - second)), (last - start) - (second - first)
        joined, w = x.copy(), float(self.width)
        for t in range(self.width):
            u = (t + 0.5) / w
            left = 1.0 - u
            jumps = 1.0 - 2.0 * u * u if u < 0.5 else 2.0 * left * left
            slopes = w * (u - BEND * u * u if u < ROOT_HALF else BEND * left * left) if self.is_sloped else 0.0
            joined[..., t] = x[..., t].astype(float) + (jump * jumps + slope * slopes)
        return joined


NO_JOIN = Join(0)


def decode_joins(coder: RangeDecoder, header: Header) -> list[list[Join]]:
    model, joined, sloped = NumberModel(), [Context(32768) for _ in range(3)], [Context(32768) for _ in range(2)]
    last, table = Join(16), []
    for _ in range(header.level_count):
        row: list[Join] = []
        for segment in range(header.segment_count):
            before = 2 if segment == 0 else row[-1].width > 0
            if header.segment_count == 1 or not coder.bit(joined[before]):
                row.append(NO_JOIN)
                continue
            is_sloped = bool(coder.bit(sloped[last.is_sloped]))
            last = Join(last.width + code_signed(coder, model, 64), is_sloped)
            require(1 <= last.width <= MOST_WIDTH, "a segment is joined over too many frames", "BAD_CHUNK_TABLE")
            row.append(last)
        table.append(row)
    return table


MOST_SHOWN = 8


def decode_repeats(coder: RangeDecoder, header: Header) -> list[int]:
    repeats, shown, before = [0] * header.frame_count, 1, 1
    contexts = [[Context(32768) for _ in range(MOST_SHOWN)] for _ in range(MOST_SHOWN)]
    if not coder.bit(Context(1000)):
        return repeats
    for i in range(1, header.frame_count):
        repeats[i] = coder.bit(contexts[shown - 1][before - 1])
        shown, before = (min(shown + 1, MOST_SHOWN), before) if repeats[i] else (1, shown)
    return repeats


# ---- hierarchy stream --------------------------------------------------------------------------------------

SHEET, LOOSE, WHOLE = 1, 2, 4


@dataclass
class Branch:
    """A branch in file order: parents come before children, subtrees are ranges."""

    parent: int  # -1: a root
    depth: int
    first: int  # vertex
    count: int
    flags: int
    lag: int
    attach: int = -1  # the vertex it hangs on
    subtree: int = 1  # branches in it
    last_place: int = 0  # where on this stem the last child so far hangs
    rigid: int = 0  # layers in which it moves as it is
    detail: int = 0
    ring: int = 0  # vertices of each ring of a tube; 0: it is none


PLACES = 256  # of a stem, whose numbers are expected from those of other stems


def decode_hierarchy(stream: bytes, branch_count: int, vertex_count: int):
    """Branches, and both permutations: number i here is number source[i] of the source."""
    coder = RangeDecoder(stream)
    branches = decode_branches(coder, branch_count, vertex_count)
    decode_attaches(coder, branches)
    for branch, rigid in zip(branches, decode_of_branches(coder, branches, MOST_LAYERS)):
        branch.rigid = rigid
    for branch, detail in zip(branches, decode_of_branches(coder, branches, 255)):
        branch.detail = detail
    for branch, ring in zip(branches, decode_of_branches(coder, branches, 32)):
        require(ring == 0 or (ring > 1 and (branch.flags & SHEET)), "a Ring of 1, or of a branch that is no SHEET")
        branch.ring = ring
    branch_source = decode_numbers(coder, [(0, branch_count)], branch_count)
    stem_start, start = [0] * branch_count, 0  # in a source that is sorted by branch
    for b in sorted(range(branch_count), key=lambda b: branch_source[b]):
        stem_start[b] = start
        start += branches[b].count
    runs = [(stem_start[b], branches[b].count) for b in range(branch_count)]
    vertex_source = decode_numbers(coder, runs, vertex_count)
    coder.finish()
    measure_subtrees(branches)
    return branches, branch_source, vertex_source


def decode_branches(coder: RangeDecoder, branch_count: int, vertex_count: int) -> list[Branch]:
    ups, counts, lags = NumberModel(), NumberModel(), NumberModel()
    flag_contexts = [[Context(16384), Context(16384)] for _ in range(3)]
    branches, left, last_up, mean_count = [], vertex_count, 0, [128] * 16
    flags = lag = 0
    for b in range(branch_count):
        parent = b - 1
        if b > 0:
            last_up = up = code_unsigned(coder, ups, min(last_up, 1000) * 16)
            for _ in range(up):
                require(parent >= 0, "a parent lies above the root")
                parent = branches[parent].parent
        depth = branches[parent].depth + 1 if parent >= 0 else 0
        c = min(depth, 15)
        more = code_unsigned(coder, counts, mean_count[c])
        require(more < left, "stems have more vertices than the file")
        mean_count[c] += divide_to_zero(min(more, 1 << 16) * 16 - mean_count[c], 4)
        before, flags = flags, 0
        for i in range(3):
            flags |= coder.bit(flag_contexts[i][(before >> i) & 1]) << i
        lag += code_signed(coder, lags, 0)
        require(0 <= lag <= 65535, "a Lag is out of range")
        require(parent >= 0 or not (flags & LOOSE), "a root is LOOSE")
        branches.append(Branch(parent, depth, vertex_count - left, more + 1, flags, lag))
        left -= more + 1
    require(left == 0, "stems have fewer vertices than the file")
    return branches


def decode_attaches(coder: RangeDecoder, branches: list[Branch]) -> None:
    attaches, mean = NumberModel(), 64
    for branch in branches:
        if branch.parent < 0:
            continue
        parent = branches[branch.parent]
        step = code_signed(coder, attaches, mean)
        place = parent.last_place + step
        require(abs(step) <= (1 << 28) and 0 <= place < parent.count, "an attach vertex is not on the parent's stem")
        branch.attach = parent.first + place
        parent.last_place = place
        mean = mean - (mean + 3) // 4 + clipped(step) * 4


def decode_of_branches(coder: RangeDecoder, branches: list[Branch], most: int) -> list[int]:
    """A number of each, which most have none of: expected to be that of the last branch of a like lag."""
    has_any, differences, last, numbers = coder.bit(Context(2048)), NumberModel(), [0] * 16, []
    for branch in branches:
        c = min(branch.lag, 15)
        if has_any:
            last[c] += code_signed(coder, differences, 0)
        require(0 <= last[c] <= most, "Rigid or Detail is out of range")
        numbers.append(last[c])
    return numbers


def decode_numbers(coder: RangeDecoder, runs: list, total: int) -> list[int]:
    """A permutation of `total` numbers, in runs of (expected first number, length)."""
    numbers: list[int] = []
    if coder.bit(Context(32768)):
        decode_permutation(coder, runs, total, numbers)
    else:
        for start, length in runs:
            numbers += range(start, start + length)
    require(sorted(numbers) == list(range(total)), "a permutation has a number twice")
    return numbers


def decode_permutation(coder: RangeDecoder, runs: list, total: int, numbers: list[int]) -> None:
    """Each number one step behind that before it, or behind that at the same place of an earlier run, or neither."""
    expected = [[[Context(32768) for _ in range(3)] for _ in range(2)] for _ in range(2)]
    differences, mean, last = NumberModel(), 64, 0
    beside, step, step_beside = [-1] * PLACES, 1, 1
    for start, length in runs:
        for i in range(length):
            begins, known = 1 if i == 0 else 0, beside[i] if i < PLACES else -1
            following = start if i == 0 else numbers[-1] + 1
            along = start if i == 0 else numbers[-1] + step
            if coder.bit(expected[0][begins][last]):
                value, last = along, 0
            elif known >= 0 and coder.bit(expected[1][begins][last]):
                value, last = known + step_beside, 1
            else:
                difference, last = code_signed(coder, differences, mean), 2
                mean = mean - (mean + 3) // 4 + clipped(difference) * 4
                value = following + difference
            require(0 <= value < total, "a permutation has a number out of range")
            if i > 0:
                step = value - numbers[-1]
            if known >= 0:
                step_beside = value - known
            if i < PLACES:
                beside[i] = value
            numbers.append(value)


def measure_subtrees(branches: list[Branch]) -> None:
    for branch in reversed(branches):
        if branch.parent >= 0:
            branches[branch.parent].subtree += branch.subtree
    whole_until = 0
    for b, branch in enumerate(branches):
        if branch.flags & WHOLE:
            require(b >= whole_until, "a branch in the subtree of a WHOLE one is WHOLE")
            whole_until = b + branch.subtree


# ---- rest pose ---------------------------------------------------------------------------------------------

RUN_VERTICES = 32
REST_EXACT, REST_FLOAT64, REST_ADAPTIVE, REST_CONNECTED = 1, 2, 8, 16  # bits of Method
Points = list[list[float]]  # three numbers for each vertex
MOST_STEPS = 1073741823


@dataclass
class RestLayer:
    """A rest pose, and the integers that its stream holds, three for each vertex; those of a run's modes stand
    with its vertices: number i of the run's 3 n, axis by axis, at vertex i // 3 and place i % 3."""

    rest: list[list[float]]
    steps: list[list[int]]


def decode_rest(
    stream: bytes,
    branches: list[Branch],
    usual_step: float,
    before: RestLayer | None = None,
    is_adaptive: bool = False,
    mesh: Mesh | None = None,
) -> RestLayer:
    """Coded rest poses: beams (Lag 0) by the modes of a cantilever, other stems vertex by vertex; of a refinement,
    about the rest pose of the layer before."""
    coder, rows = RangeDecoder(stream), RefinementModel() if before else CoefficientModel()
    models = [NumberModel() for _ in range(4)]
    mean = [[64, 64, 64], [64, 64, 64]]
    rest: list[list[float]] = []
    all_steps: list[list[int]] = []
    adaptive = AdaptiveRest(), AdaptiveRest()  # of branches without detail, and with it
    copies = Copies()
    has_copies = is_adaptive and before is None and bool(coder.bit(copies.any))
    if mesh is not None:
        own = copies if has_copies else None
        rest, all_steps = decode_connected_rest(coder, branches, usual_step, before, mesh, adaptive, own)
        coder.finish()
        return RestLayer(rest, all_steps)
    for b, branch in enumerate(branches):
        step = rest_step(branch, usual_step)
        is_shape, copy = decode_part(coder, copies, branches, b, step, rest) if has_copies else (False, None)
        if copy is not None:
            rest += copy
            all_steps += [[0, 0, 0] for _ in copy]
            continue
        step = SHAPE_FINER * step if is_shape else step
        single_vertices = branch.count if branch.lag > 0 else 1 if branch.attach < 0 else 0
        for i in range(single_vertices):
            if is_adaptive:
                model = adaptive[branch.detail > 0]
                point, steps = decode_adaptive_vertex(coder, model, branch, i, 0.625 * step, rest, before)
                rest.append(point)
                all_steps.append(steps)
                continue
            predicted = predict_rest(branch, rest, i)
            m, steps = mean[1 if i < 2 else 0], []
            for k in range(3):
                about, model = 0, models[1 if i < 2 else 0]
                if before:
                    known, place = before.steps[len(rest)][k], before.rest[len(rest)][k]
                    about = steps_in(place - predicted[k], step) if known != 0 else 0
                    model = models[3 if known != 0 else 2]
                difference = code_signed(coder, model, (m[k] + (m[0] + m[1] + m[2])) // 4)
                steps.append(about + difference)
                m[k] = m[k] - (m[k] + 7) // 8 + clipped(difference) * 2
            rest.append([predicted[k] + float(steps[k]) * step for k in range(3)])
            all_steps.append(steps)
        left = branch.count - single_vertices
        runs = (left + RUN_VERTICES - 1) // RUN_VERTICES
        for r in range(runs):
            n = left * (r + 1) // runs - left * r // runs
            base = rest[branch.attach] if len(rest) == branch.first else rest[-1]
            modes = cantilever((1,) * n, 100.0, 0.0, 1.0)
            if before:
                row = decode_refined_run(coder, rows, modes, step, base, before, len(rest))
            else:
                row, _ = decode_row(coder, rows, RUN_VERTICES, n, 0)
            moved = [in_order(modes * np.array(row[k][:n], float)[:, None]) * step for k in range(3)]
            rest += [[base[k] + float(moved[k][i]) for k in range(3)] for i in range(n)]
            numbers = [row[k][m] for k in range(3) for m in range(n)]
            all_steps += [numbers[3 * i : 3 * i + 3] for i in range(n)]
    coder.finish()
    return RestLayer(rest, all_steps)


def steps_in(value: float, step: float) -> int:
    """The nearest number of steps."""
    units = float(np.divide(value, step))
    if not units > -MOST_STEPS:
        return -MOST_STEPS
    if not units < MOST_STEPS:
        return MOST_STEPS
    return -int(0.5 - units) if units < 0.0 else int(0.5 + units)


def decode_refined_run(
    coder: RangeDecoder,
    model: RefinementModel,
    modes: np.ndarray,
    step: float,
    base: list[float],
    before: RestLayer,
    first: int,
) -> list[list[int]]:
    """The row of a run whose vertices, from `first` on, the layer before has placed."""
    n = len(modes)
    run = np.array(before.rest[first : first + n]) - np.array(base)
    numbers = [number for steps in before.steps[first : first + n] for number in steps]
    predicted, coarse = zero_row(RUN_VERTICES), zero_row(RUN_VERTICES)
    for k in range(3):
        sums = in_order((modes * run[:, k]).T)
        coarse[k][:n] = numbers[k * n : k * n + n]
        predicted[k][:n] = [steps_in(total, step) if known != 0 else 0 for total, known in zip(sums, coarse[k])]
    return decode_refined_row(coder, model, n, 0, predicted, [1] * 3, magnitudes(coarse)).row


def rest_step(branch: Branch, step: float) -> float:
    most = half_octave(branch.detail - 128) if branch.detail > 0 else step
    return most if most < step else step


def predict_rest(branch: Branch, rest: list, i: int) -> list[float]:
    """Where vertex i of a stem should be, from those before it."""

    def on_stem(j: int):  # -1: the attach vertex, None for a root
        if j >= 0:
            return rest[branch.first + j]
        return rest[branch.attach] if branch.attach >= 0 else None

    before, lag = on_stem(i - 1), max(branch.lag, 1)
    before = [0.0, 0.0, 0.0] if before is None else before
    if i < lag or on_stem(i - lag - 1) is None:
        return before
    start, end = on_stem(i - lag - 1), on_stem(i - lag)
    return [before[k] + (end[k] - start[k]) for k in range(3)]


class RestFilter:
    """Weights of the terms, by recursive least squares."""

    def __init__(self) -> None:
        self.weight = [1.0 if j == 3 else 0.0 for j in range(10)]
        self.spread = [[1.0 if j == m else 0.0 for m in range(10)] for j in range(10)]
        self.noise = 16.0


class RestMemory:
    """Mean squared errors of the guesses and mean magnitudes of the integers, axis by axis."""

    def __init__(self) -> None:
        self.error = [[16.0] * 3 for _ in range(9)]
        self.mean = [64, 64, 64]


class AdaptiveRest:
    """What is learned of an adaptive rest pose: of all vertices, and by phase."""

    def __init__(self) -> None:
        self.lattice = LatticeModel()
        self.filters = [RestFilter() for _ in range(6)]
        self.all, self.phases = RestMemory(), [RestMemory() for _ in range(256)]
        self.offsets = [[0.0] * 3 for _ in range(256)]  # of the last vertex of each phase, from the one before it


def decode_adaptive_vertex(
    coder: RangeDecoder,
    model: AdaptiveRest,
    branch: Branch,
    i: int,
    unit: float,
    rest: Points,
    before: RestLayer | None,
) -> tuple[list[float], list[int]]:
    """Position and integers of vertex i of a stem."""
    lag, per_unit = max(branch.lag, 1), 1.0 / unit
    phase = 0 if i == 0 else 1 + i % lag % 255
    weights = model.filters[0 if i == 0 else 1 + i % lag if lag <= 4 else 5]
    base, terms = rest_terms(branch, i, lag, model.offsets[phase], per_unit, rest, before)
    return decode_expected_vertex(coder, model, phase, weights, base, terms, rest_guesses(weights, terms), unit)


def decode_expected_vertex(
    coder: RangeDecoder,
    model: AdaptiveRest,
    phase: int,
    weights: RestFilter,
    base: list[float],
    terms: Points,
    guesses: Points,
    unit: float,
) -> tuple[list[float], list[int]]:
    """Position and integers of a vertex about the guesses of its offset."""
    own, per_unit = model.phases[phase], 1.0 / unit
    offset = [expected_offset(model.all, own, guesses, k) for k in range(3)]
    steps = decode_rest_point(coder, model.lattice, model.all, own)
    point = [(base[k] + offset[k] * unit) + float(steps[k]) * unit for k in range(3)]
    offset = [(point[k] - base[k]) * per_unit for k in range(3)]
    for memory, rate in (model.all, 0.06), (own, 0.1):
        note_vertex(memory, guesses, offset, steps, rate)
    learn_weights(weights, terms, guesses[5], offset)
    model.offsets[phase] = offset
    return point, steps


def rest_terms(
    branch: Branch, i: int, lag: int, last_offset: list[float], per_unit: float, rest: Points, before: RestLayer | None
) -> tuple[list[float], Points]:
    """The vertex before, and what guesses are made of, in units."""

    def on_stem(j: int, pose: Points = rest) -> list[float] | None:
        if j >= 0:
            return pose[branch.first + j]
        return pose[branch.attach] if j == -1 and branch.attach >= 0 else None

    def way(start: list[float] | None, end: list[float] | None) -> list[float]:
        if start is None or end is None:
            return [0.0] * 3
        return [(end[k] - start[k]) * per_unit for k in range(3)]

    origin = [0.0] * 3
    row = on_stem(i - lag) if i >= lag > 1 else None
    base = origin if on_stem(i - 1) is None else on_stem(i - 1)
    terms = [way(on_stem(i - j - 2), on_stem(i - j - 1)) for j in range(3)]
    terms.append(way(on_stem(i - lag - 1), row) if i >= lag else last_offset)
    terms.append(way(row, on_stem(i - lag + 1) if row is not None else None))
    terms.append(way(base, row))
    terms.append(way(on_stem(i - 2 * lag) if i >= 2 * lag else None, row))
    terms.append(way(base, origin))
    if before is not None:
        known = on_stem(i, before.rest)
        terms += [way(base, known), way(on_stem(i - 1, before.rest) or origin, known)]
    return base, terms


def rest_guesses(weights: RestFilter, terms: Points) -> Points:
    """Of the offset from the vertex before, in units."""
    beyond = [terms[5][k] + terms[6][k] for k in range(3)]
    return [[0.0] * 3, terms[0], terms[3], terms[5], beyond, weighted_terms(weights, terms)] + terms[7:]


def weighted_terms(weights: RestFilter, terms: Points) -> list[float]:
    weighted = []
    for k in range(3):
        total = 0.0
        for j in range(len(terms)):
            total = total + weights.weight[j] * terms[j][k]
        weighted.append(total if -1e9 < total < 1e9 else 0.0)
    return weighted


def expected_offset(everywhere: RestMemory, own: RestMemory, guesses: Points, k: int) -> float:
    error = [(everywhere.error[g][k] + 0.05) * (own.error[g][k] + 0.05) for g in range(len(guesses))]
    least, total, weights = min(error), 0.0, 0.0
    for g in range(len(guesses)):
        weight = least / error[g]
        weight = weight * weight
        weight = weight * weight
        total = total + weight * guesses[g][k]
        weights = weights + weight
    return total / weights


def decode_rest_point(coder: RangeDecoder, lattice: LatticeModel, everywhere: RestMemory, own: RestMemory) -> list[int]:
    steps: list[int] = []
    for k in range(3):
        classes = [number_class((m[k] + m[0] + m[1] + m[2]) // 4) for m in (everywhere.mean, own.mean)]
        steps.append(lattice.code(coder, parity_of(steps, k), (classes[0] + classes[1] + 1) // 2))
    return steps


def note_vertex(memory: RestMemory, guesses: Points, offset: list[float], steps: list[int], rate: float) -> None:
    for k in range(3):
        for g in range(len(guesses)):
            error, mean = offset[k] - guesses[g][k], memory.error[g][k]
            square, most = error * error, 4.0 * mean + 16.0
            memory.error[g][k] = mean + ((square if square < most else most) - mean) * rate
        memory.mean[k] = memory.mean[k] - (memory.mean[k] + 7) // 8 + clipped(steps[k]) * 2


def learn_weights(weights: RestFilter, terms: Points, guess: list[float], offset: list[float]) -> None:
    """A step of recursive least squares, which forgets only in the direction that it learns from."""
    squares, n = 0.0, len(terms)
    for k in range(3):
        error = offset[k] - guess[k]
        squares = squares + error * error
    squares = squares / 3.0
    usual = 0.3 + weights.noise
    noise = usual + squares + 0.1 * squares * (squares / usual)
    for k in range(3):
        gain, known, error = [0.0] * n, 0.0, offset[k]
        for j in range(n):
            for m in range(n):
                gain[j] = gain[j] + weights.spread[j][m] * terms[m][k]
            known = known + gain[j] * terms[j][k]
            error = error - weights.weight[j] * terms[j][k]
        if not known > 0.0:
            continue
        step = error / (noise + known)
        less = (known - noise / 2048.0) / (known * (noise + known))
        for j in range(n):
            part = gain[j] * less
            weights.weight[j] = weights.weight[j] + gain[j] * step
            for m in range(j + 1):
                weights.spread[j][m] = weights.spread[j][m] - part * gain[m]
                weights.spread[m][j] = weights.spread[j][m]
    most = 8.0 * weights.noise + 4.0
    weights.noise = weights.noise + ((squares if squares < most else most) - weights.noise) * 0.1


# ---- connected rest poses ---------------------------------------------------------------------------------


@dataclass
class Mesh:
    """Corners of faces by the vertices they are at, in file order: those beside one in its face, the one that makes a
    parallelogram with these three, and those of each vertex; and the order in which vertices are coded."""

    vertex: list[int]
    corners: list[list[int]]
    before: list = field(default_factory=list)
    after: list = field(default_factory=list)
    opposite: list = field(default_factory=list)
    order: list[int] = field(default_factory=list)
    rank: list[int] = field(default_factory=list)


@dataclass
class Ring:
    """What is known around a vertex: how many neighbours, the last of them, and their middle; how many parallelograms
    it completes, their mean, the last of them, and the middle of what is opposite."""

    middle: list[float]
    mean: list[float]
    across: list[float]
    neighbours: int = 0
    parallelograms: int = 0
    base: int | None = None
    last: list[float] | None = None


def build_mesh(counts: list[int], corners: list[int], vertex_source: list[int]) -> Mesh:
    vertex_count, corner_count, first = len(vertex_source), len(corners), 0
    number = [0] * vertex_count
    for v in range(vertex_count):
        number[vertex_source[v]] = v
    mesh = Mesh([number[v] for v in corners], [[] for _ in range(vertex_count)])
    mesh.before, mesh.after, mesh.opposite = ([None] * corner_count for _ in range(3))
    sides = []
    for count in counts:
        for j in range(count):
            k, closed = first + j, count in (3, 4)
            mesh.corners[mesh.vertex[k]].append(k)
            mesh.before[k] = first + (j - 1) % count if j > 0 or closed else None
            mesh.after[k] = first + (j + 1) % count if j < count - 1 or closed else None
            mesh.opposite[k] = first + (j + 2) % count if count == 4 else None
            if count == 3:
                a, b = mesh.vertex[k], mesh.vertex[first + (j + 1) % 3]
                sides.append((min(a, b), max(a, b), k))
        first += count
    join_triangles(mesh, sorted(sides))
    mesh.order = coding_order(mesh)
    mesh.rank = [0] * vertex_count
    for t in range(vertex_count):
        mesh.rank[mesh.order[t]] = t
    return mesh


def join_triangles(
    mesh: Mesh, sides: list[tuple[int, int, int]]
) -> None:  # those with the same ends two by two; the corners that face a side
    i = 0
    while i + 1 < len(sides):
        here, there = sides[i], sides[i + 1]
        if here[:2] == there[:2]:
            a, b = mesh.before[here[2]], mesh.before[there[2]]
            mesh.opposite[a], mesh.opposite[b] = b, a
            i += 1
        i += 1


def coding_order(mesh: Mesh) -> list[int]:
    vertex_count = len(mesh.corners)
    placed, state, order, seed = [False] * vertex_count, [-1] * vertex_count, [], 0
    stacks: list[list[int]] = [[], [], [], []]  # of vertices that complete no parallelogram, one, two, more

    def is_placed(corner: int | None) -> bool:
        return corner is not None and placed[mesh.vertex[corner]]

    def touch(corner: int | None, is_beside: bool) -> None:
        if corner is None or is_placed(corner):
            return
        v = mesh.vertex[corner]
        if state[v] < 0:
            if not is_beside:
                return
            put(v)
        around = (mesh.before[corner], mesh.after[corner], mesh.opposite[corner])
        if state[v] < 3 and is_placed(around[0]) and is_placed(around[1]) and is_placed(around[2]):
            put(v)

    def put(v: int) -> None:
        state[v] += 1
        stacks[state[v]].append(v)

    while len(order) < vertex_count:
        v = None
        for stack in stacks[::-1]:
            while stack and v is None:
                if not placed[stack[-1]]:
                    v = stack[-1]
                stack.pop()
        if v is None:  # nothing is touched: the first vertex that is left
            while placed[seed]:
                seed += 1
            v = seed
        placed[v] = True
        order.append(v)
        for corner in mesh.corners[v]:
            touch(mesh.after[corner], True)
            touch(mesh.before[corner], True)
            touch(mesh.opposite[corner], False)
    return order


def ring_of(mesh: Mesh, rest: list, v: int) -> Ring:  # what is known around a vertex
    now, sums = mesh.rank[v], [[0.0] * 3 for _ in range(3)]
    ring = Ring(middle=sums[0], mean=sums[1], across=sums[2])
    for corner in mesh.corners[v]:
        beside = [mesh.vertex[k] for k in (mesh.before[corner], mesh.after[corner]) if k is not None]
        beside = [w for w in beside if mesh.rank[w] < now]
        for w in beside:
            if ring.base is None or mesh.rank[w] > mesh.rank[ring.base]:
                ring.base = w
            ring.middle = [ring.middle[k] + rest[w][k] for k in range(3)]
            ring.neighbours += 1
        opposite = mesh.opposite[corner]
        if len(beside) < 2 or opposite is None or mesh.rank[mesh.vertex[opposite]] >= now:
            continue
        a, b, c = rest[beside[0]], rest[beside[1]], rest[mesh.vertex[opposite]]
        ring.last = [a[k] + b[k] - c[k] for k in range(3)]
        ring.mean = [ring.mean[k] + ring.last[k] for k in range(3)]
        ring.across = [ring.across[k] + c[k] for k in range(3)]
        ring.parallelograms += 1
    if ring.neighbours > 0:
        ring.middle = [x / float(ring.neighbours) for x in ring.middle]
    if ring.parallelograms > 0:
        ring.mean = [x / float(ring.parallelograms) for x in ring.mean]
        ring.across = [x / float(ring.parallelograms) for x in ring.across]
    return ring


def decode_connected_rest(
    coder: RangeDecoder,
    branches: list[Branch],
    step: float,
    before: RestLayer | None,
    mesh: Mesh,
    by_stems: tuple[AdaptiveRest, AdaptiveRest],
    copies: Copies | None,
) -> tuple[list, list]:
    """In the order of the mesh; by_stems: what is learned of vertices without neighbours, as `decode_rest` has it."""
    by_faces = AdaptiveRest(), AdaptiveRest()
    for own, of_stems in zip(by_faces, by_stems):
        own.lattice = of_stems.lattice
        for f in range(6):
            own.filters[f].weight = [1.0 if j == (0 if f > 0 else 2) else 0.0 for j in range(10)]
    rest: list = [None] * len(mesh.order)
    steps, seen_from = list(rest), list(rest)
    shape = None  # the last branch that is one
    for t, v in enumerate(mesh.order):
        if rest[v] is not None:
            continue
        ring, branch = ring_of(mesh, rest, v), branch_of(branches, v)
        own_step, kind = rest_step(branch, step), branch.detail > 0
        stem = range(branch.first, branch.first + branch.count)
        if copies and ring.base is None and v == branch.first and all(mesh.rank[w] >= t for w in stem):
            is_shape, copy = decode_part(coder, copies, branches, branches.index(branch), own_step, rest)
            if copy is not None:
                for w, point in zip(stem, copy):
                    rest[w], steps[w] = point, [0, 0, 0]
                continue
            shape = branch if is_shape else shape
        unit = 0.625 * (SHAPE_FINER * own_step if branch is shape else own_step)
        seen_from[v] = ring.base
        if ring.base is None:
            model, i = by_stems[kind], v - branch.first
            rest[v], steps[v] = decode_adaptive_vertex(coder, model, branch, i, unit, rest, before)
        else:
            rest[v], steps[v] = decode_connected_vertex(coder, by_faces[kind], ring, seen_from, v, unit, rest, before)
    return rest, steps


def branch_of(branches: list[Branch], v: int) -> Branch:
    return [branch for branch in branches if branch.first <= v][-1]


def decode_connected_vertex(
    coder: RangeDecoder,
    model: AdaptiveRest,
    ring: Ring,
    seen_from: list,
    v: int,
    unit: float,
    rest: list,
    before: RestLayer | None,
) -> tuple[list[float], list[int]]:
    per_unit, base, count = 1.0 / unit, rest[ring.base], ring.parallelograms

    def way(start: list[float], end: list[float]) -> list[float]:
        return [(end[k] - start[k]) * per_unit for k in range(3)]

    place = 4 * min(ring.neighbours - 1, 7) + min(count, 3)
    none, straight = [0.0] * 3, seen_from[ring.base]
    terms = [way(base, ring.mean) if count > 0 else none, way(base, ring.last) if count > 0 else none]
    terms.append(way(base, ring.middle))
    terms.append(none if straight is None else way(rest[straight], base))
    terms.append(way(base, ring.across) if count > 0 else none)
    terms.append(model.offsets[place])
    if before is not None:
        terms += [way(base, before.rest[v]), way(before.rest[ring.base], before.rest[v])]
    weights = model.filters[min(count, 5)]
    between = [0.5 * (terms[0][k] + terms[2][k]) for k in range(3)]
    guesses = [none] + terms[:4] + [weighted_terms(weights, terms), between] + terms[6:]
    return decode_expected_vertex(coder, model, place, weights, base, terms, guesses, unit)


# ---- copies in adaptive rest poses -------------------------------------------------------------------------

SHAPE_FINER = 0.25  # steps of a shape, over those of other branches


class RestShape:
    """A branch that others are copies of, and what the last of them was."""

    def __init__(self, branch: int):
        self.branch, self.mirrored, self.turn, self.scale = branch, 0, [1.0, 0.0, 0.0, 0.0], 0.0
        self.means = [[512, 512] for _ in range(4)] + [[0, 0]]


class Copies:
    def __init__(self) -> None:
        self.any, self.copied = Context(2048), [Context(32768) for _ in range(3)]
        self.is_shape, self.largest = [Context(4096) for _ in range(3)], [Context(32768) for _ in range(3)]
        self.mirrored, self.bent = ([Context(8192), Context(8192)] for _ in range(2))
        self.rank, self.turn, self.scale = NumberModel(), NumberModel(), NumberModel()
        self.lattice = LatticeModel()
        self.first, self.others, self.increment = RestMemory(), RestMemory(), [0.0] * 3
        self.mean_rank, self.are_bent, self.roles = 16, 0, [0] * 16
        self.shapes: list[RestShape] = []


def decode_part(
    coder: RangeDecoder, copies: Copies, branches: list[Branch], b: int, step: float, rest: list
) -> tuple[bool, list | None]:
    """Whether branch b is a shape; the positions of a copy."""
    branch = branches[b]
    kind, like = min(branch.count, 16) - 1, [s for s in copies.shapes if branches[s.branch].count == branch.count]
    role = copies.roles[kind]
    if len(like) > 0 and coder.bit(copies.copied[role]):
        copies.roles[kind] = 2
        rank = code_unsigned(coder, copies.rank, copies.mean_rank)
        require(rank < len(like), "a copy is of no shape")
        copies.mean_rank = copies.mean_rank - (copies.mean_rank + 7) // 8 + clipped(rank) * 2
        shape = like[rank]
        copies.shapes.remove(shape)
        copies.shapes.insert(0, shape)
        return False, decode_copy(coder, copies, branch, branches[shape.branch], shape, 0.625 * step, rest)
    copies.roles[kind] = coder.bit(copies.is_shape[role])
    if copies.roles[kind] == 1:
        shape = RestShape(b)
        copies.shapes = [shape] + copies.shapes[:63]
    return copies.roles[kind] == 1, None


def decode_copy(
    coder: RangeDecoder, copies: Copies, branch: Branch, stem: Branch, shape: RestShape, unit: float, rest: list
) -> list[list[float]]:
    """stem: the branch that is the shape."""
    points = rest[stem.first : stem.first + stem.count]
    bent, matrix = decode_copy_place(coder, copies, shape, lever_of(points), unit)
    attach = rest[branch.attach] if branch.attach >= 0 else None
    from_attach = rest[stem.attach] if stem.attach >= 0 and attach is not None else points[0]
    base, own = [0.0] * 3 if attach is None else attach, 0.5 * unit
    guesses = [[0.0] * 3, copies.increment, way_in_copy(matrix, from_attach, points[0])]
    guesses = [[x * (1.0 / own) for x in guess] for guess in guesses]
    placed = [decode_copy_vertex(coder, copies, copies.first, base, guesses, own)]
    copies.increment = [placed[0][k] - base[k] for k in range(3)]
    for i in range(1, branch.count):
        way = way_in_copy(matrix, points[0], points[i])
        expected = [placed[0][k] + way[k] for k in range(3)]
        if bent:
            guesses = [[expected[k] - placed[-1][k] for k in range(3)], way_in_copy(matrix, points[i - 1], points[i])]
            guesses = [[x * (1.0 / unit) for x in guess] for guess in guesses]
            expected = decode_copy_vertex(coder, copies, copies.others, placed[-1], guesses, unit)
        placed.append(expected)
    return placed


def lever_of(points: list[list[float]]) -> float:
    most = 0.0
    for point in points[1:]:
        x, y, z = (point[k] - points[0][k] for k in range(3))
        most = max(most, x * x + y * y + z * z)
    return math.sqrt(most)


def decode_copy_place(
    coder: RangeDecoder, copies: Copies, shape: RestShape, lever: float, unit: float
) -> tuple[int, list[list[float]]]:
    """Whether a copy is bent; its rotation, scale and mirror in one."""
    shape.mirrored = coder.bit(copies.mirrored[shape.mirrored])
    copies.are_bent = coder.bit(copies.bent[copies.are_bent])
    quantum = (2.0 if copies.are_bent else 0.9) * unit / lever if lever > 0.0 else 1.0
    number = decode_copy_number(coder, copies.scale, shape.means[4], steps_in(shape.scale, quantum))
    shape.scale = float(number) * quantum
    s = 1.0 + shape.scale
    require(1e-3 < s < 1e3, "the scale of a copy is out of range")
    largest = coder.bit(copies.largest[0])
    largest, q, squares = 2 * largest + coder.bit(copies.largest[1 + largest]), shape.turn, 0.0
    for c in range(4):
        if c != largest:
            number = decode_copy_number(coder, copies.turn, shape.means[c], steps_in(q[c], quantum / s))
            q[c] = float(number) * (quantum / s)
            squares = squares + q[c] * q[c]
    require(squares <= 1.0, "the rotation of a copy is out of range")
    q[largest] = math.sqrt(1.0 - squares)
    (w, x, y, z), m = q, -s if shape.mirrored else s
    return copies.are_bent, [
        [m * (1.0 - 2.0 * (y * y + z * z)), s * (2.0 * (x * y - w * z)), s * (2.0 * (x * z + w * y))],
        [m * (2.0 * (x * y + w * z)), s * (1.0 - 2.0 * (x * x + z * z)), s * (2.0 * (y * z - w * x))],
        [m * (2.0 * (x * z - w * y)), s * (2.0 * (y * z + w * x)), s * (1.0 - 2.0 * (x * x + y * y))],
    ]


def decode_copy_number(coder: RangeDecoder, model: NumberModel, mean: list[int], last: int) -> int:
    """About 0 or the last one, whichever has been nearer."""
    repeated = 1 if mean[1] < mean[0] else 0
    number = (last if repeated else 0) + code_signed(coder, model, mean[repeated])
    require(-(1 << 29) < number < (1 << 29), "a number of a copy is out of range")
    for i in range(2):
        magnitude = clipped(number - last if i else number)
        mean[i] = mean[i] - (mean[i] + 7) // 8 + magnitude * 2
    return number


def way_in_copy(matrix: list[list[float]], start: list[float], end: list[float]) -> list[float]:
    x, y, z = (end[k] - start[k] for k in range(3))
    return [row[0] * x + row[1] * y + row[2] * z for row in matrix]


def decode_copy_vertex(
    coder: RangeDecoder, copies: Copies, memory: RestMemory, base: list[float], guesses: list[list[float]], unit: float
) -> list[float]:
    expected = [base[k] + expected_offset(memory, memory, guesses, k) * unit for k in range(3)]
    steps = decode_rest_point(coder, copies.lattice, memory, memory)
    point = [expected[k] + float(steps[k]) * unit for k in range(3)]
    note_vertex(memory, guesses, [(point[k] - base[k]) * (1.0 / unit) for k in range(3)], steps, 0.1)
    return point


# ---- rest pose of the source -------------------------------------------------------------------------------


class BentPose:
    """The rest pose about the reference pose, both (vertices, 3, 1) less Origin: vertices of `rest` become known stem
    by stem."""

    def __init__(self, stream: bytes, branches: list[Branch], step: float, reference: np.ndarray):
        self.coder, self.rows, self.numbers = RangeDecoder(stream), CoefficientModel(), NumberModel()
        self.mean, self.step = [64, 64, 64], step  # that of the branch at hand
        self.reference, self.rest = reference[:, :, None], np.zeros((*reference.shape, 1))
        turns: list[np.ndarray] = []  # of the branches
        for branch in branches:
            turn = np.eye(3)[:, :, None]
            if branch.parent >= 0:
                parent = branches[branch.parent]
                last = parent.first + parent.count - 1
                turn = self._turn_at(parent, branch.attach, last, turns[branch.parent])
            self.step = rest_step(branch, step)
            turns.append(self._beam(branch, turn) if branch.lag == 0 else self._sheet(branch, turn))
        self.coder.finish()

    def _turn_at(self, stem: Branch, v: int, last: int, turn: np.ndarray) -> np.ndarray:
        """Of what hangs on vertex v of a stem whose vertices up to `last` are known."""
        before = v - 1 if v > stem.first else stem.attach if stem.attach >= 0 else v
        after = min(v + 1, last)
        tangent = self.reference[after] - self.reference[before]
        length2 = 0.0 + tangent[0] * tangent[0] + tangent[1] * tangent[1] + tangent[2] * tangent[2]
        if stem.lag > 0 or not length2[0] > 1e-200:
            return turn
        return follow_tangent(turn, tangent * (1.0 / np.sqrt(length2)), self.rest[after] - self.rest[before])

    def _vertex(self, v: int, before: int, turn: np.ndarray) -> None:
        """before: the vertex before it, -1 for the first one of a root."""
        predicted, m = self.reference[v], self.mean
        if before >= 0:
            predicted = self.rest[before] + mat_vec(turn, self.reference[v] - self.reference[before])
        for k in range(3):
            steps = code_signed(self.coder, self.numbers, (m[k] + (m[0] + m[1] + m[2])) // 4)
            self.rest[v, k] = predicted[k] + float(steps) * self.step
            m[k] = m[k] - (m[k] + 7) // 8 + clipped(steps) * 2

    def _sheet(self, stem: Branch, turn: np.ndarray) -> np.ndarray:
        """A stem that is no beam turns as its vertices so far did."""
        H, size2 = np.zeros((3, 3, 1)), 0.0
        for v in range(stem.first, stem.first + stem.count):
            before = v - 1 if v > stem.first else stem.attach
            self._vertex(v, before, turn)
            if before < 0:
                continue
            d, moved = self.reference[v] - self.reference[before], self.rest[v] - self.rest[before]
            size2 = 0.75 * size2
            for k in range(3):
                size2 = size2 + float(d[k, 0]) * float(d[k, 0])
            H = 0.75 * H + moved[:, None] * d[None, :]
            weight = 0.01 * size2 + 3.0 * (self.step * self.step)
            turn = turn_to(H + weight * turn, 1, turn)
        return turn

    def _beam(self, stem: Branch, turn: np.ndarray) -> np.ndarray:
        first = stem.first
        if stem.attach < 0:
            self._vertex(first, -1, turn)
            first += 1
        left = stem.first + stem.count - first
        runs = (left + RUN_VERTICES - 1) // RUN_VERTICES
        for r in range(runs):
            n = left * (r + 1) // runs - left * r // runs
            before = first - 1 if first > stem.first else stem.attach
            self._run(first, n, before, turn if r == 0 else self._turn_at(stem, before, before, turn))
            first += n
        return turn

    def _run(self, first: int, n: int, before: int, turn: np.ndarray) -> None:
        row, _ = decode_row(self.coder, self.rows, RUN_VERTICES, n, 0)
        modes = cantilever((1,) * n, 100.0, 0.0, 1.0)
        bent = np.array([in_order(modes * np.array(row[k][:n], float)[:, None]) * self.step for k in range(3)])
        local = self.reference[first : first + n, :, 0] - self.reference[before, :, 0] + bent.T
        self.rest[first : first + n] = self.rest[before] + mat_vec(turn, local.T).T[:, :, None]


# ---- exact numbers: rest poses and times bit for bit -------------------------------------------------------


class ExactModel:
    def __init__(self):
        self.size = Contexts(lambda before: [60000] * 64)
        self.mantissa = Contexts(lambda length: [30000] * 4)


def single(x: float) -> float:
    """Rounded to the nearest binary32."""
    return float(np.float32(x))


def to_bits(x: float, n: int) -> int:
    return u32(struct.pack("<f", x), 0) if n == 32 else u64(struct.pack("<d", x), 0)


def from_bits(bits: int, n: int) -> float:
    return f32(struct.pack("<I", bits), 0) if n == 32 else f64(struct.pack("<Q", bits), 0)


def ordered(bits: int, n: int) -> int:
    """Bits of a number as an integer that ascends with the numbers."""
    return (1 << n) - 1 - bits if bits >> (n - 1) else bits + (1 << (n - 1))


def code_exact(coder: RangeDecoder, model: ExactModel, n: int, expected: float, before: int):
    """A number of n bits, and the bit length of its difference from the expected one; `before`: the last
    one's."""
    expected = single(expected) if n == 32 else expected
    at = ordered(to_bits(expected if finite(expected) else 0.0, n), n)
    length = 0
    while length < n and coder.bit(model.size[before][length]):
        length += 1
    if length > 0:
        magnitude = code_mantissa(coder, model.mantissa, length)
        at = (at + (-magnitude if coder.raw_bit() else magnitude)) & ((1 << n) - 1)
    number = from_bits(at - (1 << (n - 1)) if at >> (n - 1) else (1 << n) - 1 - at, n)
    require(finite(number), "a number is infinite or NaN")
    return number, length


def decode_exact_rest(
    stream: bytes, branches: list[Branch], is_float64: bool, mesh: Mesh | None = None
) -> list[list[float]]:
    coder, model, before = RangeDecoder(stream), ExactModel(), [0, 0, 0]
    rest: list = [None] * sum(branch.count for branch in branches)
    for v in range(len(rest)) if mesh is None else mesh.order:
        ring = None if mesh is None else ring_of(mesh, rest, v)
        if ring is None or ring.base is None:
            branch = branch_of(branches, v)
            expected = predict_rest(branch, rest, v - branch.first)
        else:
            expected = ring.mean if ring.parallelograms > 0 else ring.middle
        point = []
        for k in range(3):
            number, before[k] = code_exact(coder, model, 64 if is_float64 else 32, expected[k], before[k])
            point.append(number)
        rest[v] = point
    coder.finish()
    return rest


def decode_exact(stream: bytes, positions: np.ndarray) -> np.ndarray:
    """The source's own (vertices, 3, frames), from those of the level before."""
    coder, model, before, exact = RangeDecoder(stream), ExactModel(), [0, 0, 0], positions.copy()
    n = 8 * positions.itemsize
    for v in range(positions.shape[0]):
        for t in range(positions.shape[2]):
            for k in range(3):
                exact[v, k, t], before[k] = code_exact(coder, model, n, float(positions[v, k, t]), before[k])
    coder.finish()
    return exact


def decode_times(stream: bytes, frame_count: int) -> list[float]:
    coder, model, times, before = RangeDecoder(stream), ExactModel(), [], 0
    for i in range(frame_count):
        expected = times[i - 1] if i > 0 else 0.0
        if i > 1:
            expected = expected + (times[i - 1] - times[i - 2])
        number, before = code_exact(coder, model, 64, expected, before)
        times.append(number)
    coder.finish()
    return times


def frame_times(chunk: bytes, clips: list[Clip]) -> list[list[float]]:
    """TIME: seconds of every frame of every clip."""
    require(len(chunk) > 0 and chunk[0] <= 4, "TIME has an unknown Method")
    times = uneven_times(chunk, clips) if chunk[0] == 2 else steady_times(chunk, clips)
    for own in times:
        ascending = all(own[i] < own[i + 1] for i in range(len(own) - 1))
        require(ascending and all(finite(x) for x in own), "times of a clip are not finite and ascending")
    return times


def uneven_times(chunk: bytes, clips: list[Clip]) -> list[list[float]]:
    stream = iter(decode_times(chunk[1:], sum(clip.frames for clip in clips)))
    return [list(islice(stream, clip.frames)) for clip in clips]


def steady_times(chunk: bytes, clips: list[Clip]) -> list[list[float]]:
    method = chunk[0]
    require(len(chunk) == 1 + (16 if method < 2 else 2) * len(clips), "TIME has not the steps of every clip alone")
    times = []
    for c, clip in enumerate(clips):
        if method < 2:
            first, step = f64(chunk, 1 + 16 * c), f64(chunk, 9 + 16 * c)
            require(finite(step) and step > 0.0, "Step of TIME is not above 0")
        else:
            first, rate = 0.0, u16(chunk, 1 + 2 * c)
            require(rate > 0, "Rate of TIME is 0")
            step = float(rate) if method == 3 else 1.0 / rate
        divided = method in (1, 3)
        times.append([first + (float(i) / step if divided else float(i) * step) for i in range(clip.frames)])
    return times


# ---- polygons ----------------------------------------------------------------------------------------------


@dataclass
class PolygonShape:
    """Head of FACES or EDGES."""

    index_type: int
    count_type: int | None
    is_absolute: bool
    is_derived: bool
    face_count: int = 0
    columns: int = 0
    corner_count: int = 0

    def dtype(self, code: int) -> np.dtype:
        return np.dtype(f"{'>' if code & 8 else '<'}{'i' if code & 4 else 'u'}{1 << (code & 3)}")


def parse_polygons(chunk: bytes, kind: int, limits: Limits) -> tuple[PolygonShape, bytes]:
    """FACES or EDGES, and its stream."""
    require(len(chunk) >= 1 and is_integer_type(chunk[0] & 15), "Index_Type is no type")
    flags = chunk[0] & ~15
    shape = PolygonShape(chunk[0] & 15, None, (flags & 32) != 0, flags == 64)
    if shape.is_derived:
        require(len(chunk) == 1 and kind == EDGES, "derived edges have data, or are FACES")
        return shape, b""
    mixed = (flags >> 4) & 1
    require((flags & ~48) == 0 and len(chunk) >= 9 + mixed, "FACES or EDGES has reserved bits, or is too short")
    if mixed:
        shape.count_type = chunk[1]
        require(is_integer_type(chunk[1]), "Count_Type is no type")
    shape.face_count, count = u32(chunk, 1 + mixed), u32(chunk, 5 + mixed)
    shape.columns = 0 if mixed else count
    shape.corner_count = count if mixed else shape.face_count * count
    most = max(shape.face_count + shape.corner_count, shape.columns)
    require(most <= limits.corners, "there are too many faces or corners", "LIMIT_EXCEEDED")
    require(kind == FACES or shape.columns == 2, "EDGES has not two columns")
    return shape, chunk[9 + mixed :]


def is_integer_type(code: int) -> bool:
    return code <= 15 and (code & 11) != 8


class PolygonModel:
    def __init__(self) -> None:
        self.repeats = [Context(60000) for _ in range(16)]
        self.guessed = [[[Context(16384) for _ in range(17)] for _ in range(5)] for _ in range(14)]
        self.is_recent = [Context(32768) for _ in range(5)]
        self.recent = [[Context(32768) for _ in range(32)] for _ in range(5)]
        self.far, self.far_mean = [NumberModel() for _ in range(3)], [1024] * 3
        self.same_count, self.counts_seen = [Context(49152) for _ in range(64)], 0
        self.count, self.count_mean = NumberModel(), 64
        self.places: list[dict[int, int]] = [
            {},
            {},
        ]  # by the hash of 12, and of 3, ways: the corner that followed them last
        self.followed, self.run = 0, 0  # the corner that is expected again (0: none), and for how long one has been
        self.next, self.way = 0, 0  # the vertex behind the highest so far; how the last corner was coded
        self.before: dict[int, list[int]] = {}
        self.after: dict[int, list[int]] = {}  # ends of open sides of a vertex, last ones first


def decode_polygons(
    stream: bytes, shape: PolygonShape, vertex_count: int
) -> tuple[list[int], list[int]]:  # numbers of corners of the faces, vertices of the corners
    coder, model = RangeDecoder(stream), PolygonModel()
    bound = min(vertex_count, largest_of_type(shape.index_type) + 1)
    counts: list[int] = []
    corners: list[int] = []
    previous, count = 0, 3
    for _ in range(shape.face_count):
        first = len(corners)
        if shape.count_type is None:
            count = shape.columns
        else:
            count = decode_face_count(coder, model, count)
            require(count <= largest_of_type(shape.count_type), "a face has more corners than Count_Type holds")
        require(count <= shape.corner_count - first, "faces have more corners than there are")
        for j in range(count):
            decode_corner(coder, model, shape, bound, corners, first, j, previous)
        for k in range(first, first + count - 1):
            note_side(model, corners[k], corners[k + 1])
        if count > 2:
            note_side(model, corners[-1], corners[first])
        if count > 0:
            previous = first
        counts.append(count)
    require(len(corners) == shape.corner_count, "corners are left over")
    coder.finish()
    return counts, corners


def largest_of_type(code: int) -> int:
    return (1 << ((8 << (code & 3)) - ((code >> 2) & 1))) - 1


def decode_face_count(coder: RangeDecoder, model: PolygonModel, before: int) -> int:
    same = coder.bit(model.same_count[model.counts_seen])
    model.counts_seen = ((model.counts_seen << 1) | same) & 63
    if same:
        return before
    count = code_unsigned(coder, model.count, model.count_mean)
    model.count_mean = model.count_mean - (model.count_mean + 7) // 8 + clipped(count) * 2
    return count


def decode_corner(
    coder: RangeDecoder,
    model: PolygonModel,
    shape: PolygonShape,
    bound: int,
    corners: list[int],
    first: int,
    j: int,
    previous: int,
) -> None:
    followed = [follow(model, corners, table, length) for table, length in ((0, 12), (1, 3))]
    if model.followed == 0:
        model.followed = followed[0]
    expected = repeated(corners, model.followed, bound)
    vertex = None
    if expected is not None and coder.bit(model.repeats[min(model.run, 15)]):
        model.way, vertex = 0, expected
    if vertex is None and shape.is_absolute:
        vertex = code_unsigned(coder, model.far[0], 1024)
    if vertex is None:
        guesses = [repeated(corners, followed[1], bound), model.next if model.next < bound else None]
        guesses += guesses_of_sides(model, corners, first, j, previous)
        place = 4 if j > 1 and guesses[2] is not None and guesses[2] == guesses[5] else min(j, 3)
        vertex = decode_guessed(coder, model, place, guesses, expected)
        if vertex is None:
            vertex = decode_other(coder, model, corners, j, place, previous)
    require(0 <= vertex < bound, "a vertex is not there, or beyond Index_Type")
    corners.append(vertex)
    model.next = max(model.next, vertex + 1)
    if model.followed > 0 and vertex == expected:
        model.followed, model.run = model.followed + 1, model.run + 1
    else:
        model.followed = model.run = 0


def follow(
    model: PolygonModel, corners: list[int], table: int, length: int
) -> int:  # the corner that came behind the same ways; the next one is the last now
    i, code = len(corners), 0
    if i <= length:
        return 0
    for k in range(i - length, i):
        code = ((code + (corners[k] - corners[k - 1]) + 1) * 0x9E3779B1) & 0xFFFFFFFF
    found = model.places[table].get(code >> 18, 0)
    model.places[table][code >> 18] = i
    return found


def repeated(
    corners: list[int], at: int, bound: int
) -> int | None:  # the vertex as far from the last one as that of corner `at` was from the one before
    if at == 0:
        return None
    vertex = corners[-1] + corners[at] - corners[at - 1]
    return vertex if 0 <= vertex < bound else None


def guesses_of_sides(
    model: PolygonModel, corners: list[int], first: int, j: int, previous: int
) -> list:  # 12, None: no guess
    def ends(sides: dict[int, list[int]], vertex: int) -> list:
        found = sides.get(vertex, [])
        return found + [None] * (3 - len(found))

    before, after = model.before, model.after
    if j > 0:
        last, start = corners[-1], corners[first]
        return ends(before, last) + ends(after, start) + ends(after, last) + ends(before, start)
    if first == 0:
        return [None] * 12
    start, end, second = corners[previous], corners[first - 1], corners[min(previous + 1, first - 1)]
    return [start, end, second] + ends(after, start) + ends(before, start) + [None] * 3


def decode_guessed(
    coder: RangeDecoder, model: PolygonModel, place: int, guesses: list, expected: int | None
) -> int | None:
    for g in range(14):
        guess = guesses[g]
        if guess is None or guess == expected or guess in guesses[:g]:
            continue
        if coder.bit(model.guessed[g][place][model.way]):
            model.way = 1 + g
            return guess
    return None


def decode_other(
    coder: RangeDecoder, model: PolygonModel, corners: list[int], j: int, place: int, previous: int
) -> int:
    i = len(corners)
    if coder.bit(model.is_recent[place]):
        back = 1
        for _ in range(5):
            back = (back << 1) | coder.bit(model.recent[place][back])
        model.way = 15
        require(back - 32 < i, "a recent corner is before the first")
        return corners[i - 1 - (back - 32)]
    model.way = 16
    kind = min(place, 2)
    difference, mean = code_signed(coder, model.far[kind], model.far_mean[kind]), model.far_mean[kind]
    model.far_mean[kind] = mean - (mean + 7) // 8 + clipped(difference) * 2
    return (corners[i - 1 if j > 0 else previous] if i > 0 else 0) + difference


def note_side(model: PolygonModel, start: int, end: int) -> None:
    def close(sides: dict[int, list[int]], vertex: int, other: int) -> bool:
        found = sides.get(vertex, [])
        if other in found:
            found.remove(other)
            return True
        return False

    closed = [close(model.after, end, start), close(model.before, start, end)]
    if True not in closed:
        closed = [close(model.after, start, end), close(model.before, end, start)]
    if True not in closed:
        model.after[start] = ([end] + model.after.get(start, []))[:3]
        model.before[end] = ([start] + model.before.get(end, []))[:3]


# ---- temporal basis and coefficient streams ----------------------------------------------------------------


def decode_temporal(stream: bytes, rank: int, frames: int, bits: int) -> list[list[int]]:
    """A learned basis over time, as integers."""
    coder, model, basis = RangeDecoder(stream), NumberModel(), []
    for _ in range(rank):
        mean, before, slope, row = 1024, 0, 0, []
        for t in range(frames):
            rest = code_signed(coder, model, mean)
            value = before + slope + rest
            require(abs(value) <= (1 << (bits - 1)), "an entry of a learned basis is beyond 1")
            slope = value - before if t > 0 else 0
            before = value
            mean = mean - (mean + 3) // 4 + clipped(rest) * 4
            row.append(value)
        basis.append(row)
    coder.finish()
    return basis


SLOTS, SHIFT_SLOT, ROTATION_SLOT, BANDS = 66, 64, 65, 4


class CoefficientModel:
    def __init__(self):
        self.numbers = [NumberModel() for _ in range(2 * BANDS)]
        self.empty = [[Context(32768) for _ in range(6)] for _ in range(6)]
        self.count_size = [[Context(40000) for _ in range(10)] for _ in range(6)]
        self.count_mantissa = [[Context(32768) for _ in range(4)] for _ in range(10)]
        self.history = [[[0] * SEGMENT_FRAMES for _ in range(3)] for _ in range(SLOTS)]  # mean magnitudes, in 1/16
        self.history_count = [0] * SLOTS


def count_class(n: int) -> int:
    return 0 if n == 0 else 1 if n <= 2 else 2 if n <= 6 else 3 if n <= 14 else 4 if n <= 30 else 5


def decode_count(coder: RangeDecoder, model: CoefficientModel, history: int, above: int, rank: int) -> int:
    """How many frequencies of a row are coded."""
    if coder.bit(model.empty[count_class(history)][count_class(above)]):
        return 0
    size, length = model.count_size[count_class((history + above + 1) // 2)], 1
    while length < 10 and coder.bit(size[length]):
        length += 1
    count = 1
    for taken in range(length - 1):
        c = 0 if taken == 0 else 1 + (count & 1) if taken == 1 else 3
        count = (count << 1) | coder.bit(model.count_mantissa[length - 1][c])
    require(count <= rank, "a row has more frequencies than its basis")
    return count


def at_frequency(axis: list[int], k: int) -> int:
    return clipped(axis[k]) if 0 <= k < len(axis) else 0


def averaged(mean: int, magnitude: int, half: int) -> int:
    """A running mean in 1/16 with one magnitude more."""
    return mean - (mean + half) // 8 + 2 * magnitude


class RowSurroundings:
    """What tells how large the integers of a row are, while it passes: the axis itself, those before it, the frequency
    before, the row above, and rows of the same slot."""

    def __init__(self, model: CoefficientModel, slot: int, above):
        self.model, self.slot, self.history, self.above = model, slot, model.history[slot], above
        self.near, self.run = [0, 0, 0], [0, 0, 0]  # of each axis: the last magnitude, the mean of late ones in 1/16
        self.before = self.beside = self.over = self.mean = 0

    def start(self, k: int) -> None:
        """Goes on to a frequency."""
        self.before, self.beside = self.beside, 0
        self.over = sum(at_frequency(axis, k) for axis in self.above or ())
        self.mean = sum(axis[k] for axis in self.history) // 3

    def expected(self, axis: int, k: int) -> int:
        """The magnitude expected of an integer, in 1/16."""
        around = self.mean if axis == 0 else (self.beside * 16 // axis + self.mean) // 2
        own = 16 * (self.near[axis] + self.run[axis]) + 12 * self.history[axis][k]
        return (own + 2 * around + self.before + self.over) // 16

    def number(self, axis: int, k: int) -> NumberModel:
        """The model that codes it."""
        louder = self.run[axis] > self.history[axis][k]
        return self.model.numbers[2 * min((k + 1).bit_length() - 1, BANDS - 1) + louder]

    def note(self, axis: int, k: int, magnitude: int) -> None:
        self.history[axis][k] = averaged(self.history[axis][k], magnitude, 7)
        self.run[axis] = averaged(self.run[axis], magnitude, 4)
        self.near[axis] = magnitude
        self.beside += magnitude

    def finish(self, count: int) -> None:
        """The frequencies from `count` on are 0."""
        for axis in self.history:
            axis[count:] = [averaged(mean, 0, 7) for mean in axis[count:]]
        self.model.history_count[self.slot] = count


def zero_row(frames: int) -> list[list[int]]:
    return [[0] * frames for _ in range(3)]


def decode_row(
    coder: RangeDecoder, model: CoefficientModel, frames: int, rank: int, slot: int, above=None, above_count: int = 0
):
    """Three axes of `frames` integers over frequency, and how many frequencies were coded."""
    count = decode_count(coder, model, model.history_count[slot], above_count, rank)
    row, around = zero_row(frames), RowSurroundings(model, slot, above)
    for k in range(count):
        around.start(k)
        for axis in range(3):
            row[axis][k] = code_signed(coder, around.number(axis, k), around.expected(axis, k))
            around.note(axis, k, clipped(row[axis][k]))
    around.finish(count)
    return row, count


def decode_basis(stream: bytes, known: np.ndarray, rank: int, frames: int, waves: np.ndarray) -> np.ndarray:
    """(rank, frames): a learned basis that begins with the `known` rows, the others in waves."""
    coder, model, steps = RangeDecoder(stream), CoefficientModel(), NumberModel()
    basis, exponent, above, count = known, 0, None, 0
    while len(basis) < rank:
        units = []
        for _ in range(min(3, rank - len(basis))):
            change = code_signed(coder, steps, 32)
            require(abs(change) <= 400 and abs(exponent + change) <= 200, "the step of a row is out of range")
            exponent += change
            units.append(half_octave(exponent))
        above, count = decode_row(coder, model, frames, frames, 0, above, count)
        for row in over_time(above[: len(units)], units, waves):
            basis = np.concatenate([basis, [orthonormal(basis, row)]])
    coder.finish()
    return basis


def orthonormal(basis: np.ndarray, row: np.ndarray) -> np.ndarray:
    """A row at right angles to those of a basis, of length 1, in binary32."""
    for other in basis:
        row = row - in_order(other * row) * other
    length2 = in_order(row * row)
    return (row * (1.0 / np.sqrt(length2 if length2 > 1e-200 else 1.0))).astype(np.float32).astype(float)


# ---- refined rows ------------------------------------------------------------------------------------------


class RefinementModel:
    def __init__(self):
        self.rows = CoefficientModel()  # of differences, whose numbers are where the layer before has 0
        self.known = NumberModel()  # elsewhere
        self.sign = [Context(32768) for _ in range(3)]


@dataclass
class RefinedRow:
    row: list[list[int]]
    differences: list[list[int]]  # from the prediction
    count: int  # frequencies of which differences are coded


def magnitudes(coarse: list[list[int]]) -> list[list[int]]:
    return [[clipped(number) for number in axis] for axis in coarse]


def loudness(steps: list[list[int]], below, axis: int, k: int) -> int:
    """How large the integers of the layer before are around one that is 0, where nothing is decoded yet: behind it in
    frequency, on the axes after it, and in the row below."""
    loud = 4 * at_frequency(steps[axis], k + 1) + 2 * at_frequency(steps[axis], k + 2)
    for other in range(3):
        loud += at_frequency(steps[other], k + 1)
        loud += at_frequency(steps[other], k) if other > axis else 0
    if below is not None:
        loud += 2 * sum(at_frequency(below[other], k) for other in range(3)) + at_frequency(below[axis], k + 1)
    return loud


def decode_refined_row(
    coder: RangeDecoder,
    model: RefinementModel,
    rank: int,
    slot: int,
    predicted: list[list[int]],
    ratios: list[int],
    steps: list[list[int]],
    below=None,
    above: RefinedRow | None = None,
) -> RefinedRow:
    """Integers that are known about. `ratios`: of the axes, steps of this layer in one of the layer before. `steps`:
    magnitudes of the row in steps of the layer before, `below`: those of the row that follows."""
    frames, rows = len(predicted[0]), model.rows
    count = decode_count(coder, rows, rows.history_count[slot], above.count if above else 0, rank)
    differences, around = zero_row(frames), RowSurroundings(rows, slot, above and above.differences)
    for k in range(count):
        around.start(k)
        for axis in range(3):
            number, expected = model.known, around.expected(axis, k)
            if steps[axis][k] == 0:
                number, expected = around.number(axis, k), expected + 2 * loudness(steps, below, axis, k)
            elif ratios[axis] > 1:
                expected = 4 * ratios[axis]
            differences[axis][k] = decode_difference(coder, model, number, expected, predicted[axis][k])
            around.note(axis, k, clipped(differences[axis][k]))
    around.finish(count)
    row = [[p + d for p, d in zip(*axis, strict=True)] for axis in zip(predicted, differences, strict=True)]
    return RefinedRow(row, differences, count)


def decode_difference(
    coder: RangeDecoder, model: RefinementModel, number: NumberModel, expected: int, predicted: int
) -> int:
    magnitude = code_unsigned(coder, number, expected)
    if magnitude == 0:
        return 0
    if predicted == 0:
        negative = coder.raw_bit()
    else:  # the bit: against the sign of the prediction
        negative = (predicted < 0) ^ coder.bit(model.sign[0 if magnitude == 1 else 1 if magnitude < 4 else 2])
    return -magnitude if negative else magnitude


# ---- predicted motion --------------------------------------------------------------------------------------

GUESSES, FEATURES, LINE_GUESS = 13, 8, 6
LONGEST_LINE, LONGEST_MEAN, SOLVED_EVERY, RUNS = 24, 64, 16, 8

Point = list[float]


@dataclass
class Follower:
    """A vertex from frame to frame: which others tell of it, and what is known of its motion."""

    before: int
    near: int
    base: int
    like: int
    tip: int  # the last one of its stem, -1: it is an end itself
    earlier: int  # the one before it in the order of coding
    line: Point
    mean: Point
    above: int = -1
    slope: Point = field(default_factory=lambda: [0.0] * 3)
    older: Point = field(default_factory=lambda: [0.0] * 3)
    error: list[float] = field(default_factory=lambda: [0.0] * GUESSES)
    noise: float = 0.0
    age: int = 0
    frames: int = 0
    steps: list[int] = field(default_factory=lambda: [0] * 3)
    size: tuple[int, int] = (0, 0)
    leads: bool = False  # whether its stem has others than ends, which may follow it
    followed: int = 0  # whether they do

    @property
    def kind(self) -> int:
        """0: it follows nothing, 1: the first one of a stem, 2: others."""
        return 0 if self.before < 0 else 2 if self.near == self.before else 1

    def learn_line(self, x: Point, last: Point, off: float, step: float) -> None:
        turned = off > 4.0 * step + 3.0 * self.noise
        if not turned:
            self.noise = self.noise + (off - self.noise) * 0.125
        self.age = 1 if turned else min(self.age + 1, LONGEST_LINE)
        more = (self.age + 1.0) * (self.age + 2.0)
        at, along = (4.0 * self.age + 2.0) / more, 6.0 / more
        for k in range(3):
            ahead = self.line[k] + self.slope[k]
            if turned:
                self.older[k], self.line[k], self.slope[k] = self.slope[k], x[k], x[k] - last[k]
            else:
                self.line[k] = ahead + at * (x[k] - ahead)
                self.slope[k] = self.slope[k] + along * (x[k] - ahead)

    def learn_mean(self, x: Point) -> None:
        self.frames = min(self.frames + 1, LONGEST_MEAN)
        for k in range(3):
            self.mean[k] = self.mean[k] + (x[k] - self.mean[k]) / self.frames


def followers(branches: list[Branch], rest: list[Point], step: float) -> tuple[list[Follower], list[int]]:
    """By their numbers, and the numbers in the order of coding: of each stem the ends first."""
    found: dict[int, Follower] = {}
    order: list[int] = []
    tip_before, first_before, last = -1, -1, {}
    for branch in branches:
        like, first, tip = last.get(branch.count, -1), branch.first, branch.first + branch.count - 1
        last[branch.count] = first
        is_free = branch.attach < 0 and branch.count > 1
        ends = [first, tip] if is_free else [tip]
        start = first if is_free else branch.attach
        for v in ends + [v for v in range(first, tip) if v not in ends]:
            is_end = v in ends
            before = branch.attach if v == first else start if is_end else v - 1
            near = tip_before if is_end else first_before if v == first else v - 1
            base, tip_of = -1 if v == start else start, -1 if is_end else tip
            twin = like + v - first if like >= 0 else -1
            earlier = order[-1] if order else -1
            found[v] = Follower(before, near, base, twin, tip_of, earlier, list(rest[v]), list(rest[v]))
            order.append(v)
        found[tip].leads = branch.count > len(ends)
        tip_before, first_before = tip, first if branch.count > 1 else first_before
    vertices = [found[v] for v in range(len(found))]
    follow_twins(vertices, order, [tuple(steps_in(x, step * 0.00390625) for x in at) for at in rest])
    for vertex in vertices:
        vertex.above = vertices[vertex.before].before if vertex.before >= 0 else -1
    return vertices, order


def follow_twins(found: list[Follower], order: list[int], cells: list[tuple[int, ...]]) -> None:
    """Vertices that rest where an earlier one does, and not where the one does that they follow, follow that."""
    places, table = 16, {}
    while places < 2 * len(found):
        places *= 2
    for v in order:
        vertex = found[v]
        x, y, z = cells[v]
        entry = (x * 73856093 + y * 19349663 + z * 83492791) % (1 << 32)
        entry = (entry ^ (entry >> 15)) % places
        twin = table.get(entry, -1)
        table[entry] = v
        joined = vertex.before >= 0 and cells[vertex.before] == cells[v]
        if twin >= 0 and cells[twin] == cells[v] and not joined:
            vertex.before = vertex.near = twin


class Fit:
    """Least squares over the features of vertices of one kind, and the mean errors of their guesses."""

    def __init__(self):
        self.moments = [[0.0] * FEATURES for _ in range(FEATURES)]
        self.products, self.weights, self.error = [0.0] * FEATURES, [0.0] * FEATURES, [0.0] * GUESSES
        self.count, self.wait = 0, 1

    def learn(self, features: list[list[float]], way: Point, weight: float, memory: int) -> None:
        x, y, z = features
        for i in range(FEATURES):
            wx, wy, wz = weight * x[i], weight * y[i], weight * z[i]
            row = self.moments[i]
            for j in range(FEATURES):
                row[j] = row[j] + (wx * x[j] + wy * y[j] + wz * z[j])
            self.products[i] = self.products[i] + (wx * way[0] + wy * way[1] + wz * way[2])
        self.count = min(self.count + 1, 8 * SOLVED_EVERY)
        self.wait -= 1
        if self.wait == 0:
            self._solve()
            self.wait = min(1 + self.count // 8, SOLVED_EVERY)
            keep = 1.0 - self.wait / memory
            self.moments = [[x * keep for x in row] for row in self.moments]
            self.products = [x * keep for x in self.products]

    def _solve(self) -> None:
        lower, y = [[0.0] * FEATURES for _ in range(FEATURES)], [0.0] * FEATURES
        for i in range(FEATURES):
            for j in range(i + 1):
                a = self.moments[i][j]
                if i == j:
                    a = a + (1.0 + a * 1e-6)
                for k in range(j):
                    a = a - lower[i][k] * lower[j][k]
                lower[i][j] = math.sqrt(a if a > 0.5 else 0.5) if i == j else a / lower[j][j]
            total = self.products[i]
            for k in range(i):
                total = total - lower[i][k] * y[k]
            y[i] = total / lower[i][i]
        for i in reversed(range(FEATURES)):
            total = y[i]
            for k in range(i + 1, FEATURES):
                total = total - lower[k][i] * self.weights[k]
            self.weights[i] = total / lower[i][i]


@dataclass
class Around:
    """Positions less Origin: at rest, in the frame that one is coded about and the two before that, in the frame
    before, and in this one."""

    rest: list[Point]
    was: list[list[Point]]
    last: list[Point]
    now: list[Point]


@dataclass
class Way:
    """Where a vertex is expected to go: of each axis the guesses and features, and what was chosen."""

    guesses: list[list[float]]
    features: list[list[float]]
    way: Point


class Prediction:
    """PREDICTED of a segment."""

    def __init__(self, chunk: bytes, branches: list[Branch], rest: np.ndarray, origin: np.ndarray, number: np.dtype):
        require(len(chunk) >= 5 and chunk[4] <= 31, "Settings of PREDICTED are out of range")
        self.step, self.memory, self.common = f32(chunk, 0), 32 << (chunk[4] & 7), bool(chunk[4] & 8)
        self.is_lattice = chunk[4] >= 16
        self.unit = 0.625 * self.step if self.is_lattice else self.step
        require(finite(self.step) and self.step > 0.0, "Step of PREDICTED is out of range")
        self.coder = RangeDecoder(chunk[5:])
        self.rest, self.origin, self.number = rest.tolist(), origin, number
        self.vertices, self.order = followers(branches, self.rest, self.step)
        self.numbers, self.distances = LatticeModel(), NumberModel()
        self.signs = [[Context(32768) for _ in range(3)] for _ in range(3)]
        self.moved = [
            [[Context(6000 if own + near == 0 else 32768) for _ in range(3)] for near in range(4)] for own in range(4)
        ]
        self.copied = [[Context(6000) for _ in range(RUNS)] for _ in range(RUNS)]
        self.usual = [Context(60000) for _ in range(2)]
        self.followed = [[Context(32768) for _ in range(2)] for _ in range(2)]
        self.last_followed = 0
        self.fits = [Fit() for _ in range(3)]
        self.run = self.last_run = 0
        self.distance = 1

    def decode(self, frames: int) -> np.ndarray:
        """(vertices, 3, frames), as they are put out."""
        out: list[np.ndarray] = []
        known, abouts = [self.rest], [0]  # the rest pose, then the frames; which of these each is coded about
        for t in range(frames):
            copied = self._decode_reference(t)
            about = t + 1 - self.distance
            abouts.append(abouts[about] if copied else about)
            if copied:
                now = out[about - 1] if about > 0 else self._put_out(self.rest)
            else:
                was = [known[about], known[abouts[about]], known[abouts[abouts[about]]]]
                now = self._decode_frame(Around(self.rest, was, known[-1], [[]] * len(self.rest)))
            out.append(now)
            known.append((now.astype(float) - self.origin).tolist())
        self.coder.finish()
        return np.stack(out, axis=2)

    def _put_out(self, positions: list[Point]) -> np.ndarray:
        return (np.array(positions) + self.origin).astype(self.number)

    def _decode_reference(self, frame: int) -> int:
        copied = self.coder.bit(self.copied[min(self.run, RUNS - 1)][min(self.last_run, RUNS - 1)])
        if not self.coder.bit(self.usual[copied]):
            self.distance = code_unsigned(self.coder, self.distances, 64) + 1
        require(self.distance <= frame + 1, "a frame is coded about one before the first")
        if copied:
            self.run += 1
        else:
            self.last_run, self.run = self.run, 0
        return copied

    def _decode_frame(self, around: Around) -> np.ndarray:
        out = np.empty((len(self.vertices), 3), self.number)
        for v in self.order:
            vertex = self.vertices[v]
            if vertex.tip >= 0 and self.vertices[vertex.tip].followed:
                vertex.size = 0, vertex.size[0]
                self._place(around, v, self._between_ends(around, v), out)
                continue
            p = self._predict(around, v)
            steps = self._decode_steps(v)
            at = [around.was[0][v][k] + p.way[k] + float(steps[k]) * self.unit for k in range(3)]
            self._place(around, v, at, out)
            self._learn(around, v, p)
            if vertex.leads:
                vertex.followed = self.coder.bit(self.followed[vertex.followed][self.last_followed])
                self.last_followed = vertex.followed
        return out

    def _place(self, around: Around, v: int, at: Point, out: np.ndarray) -> None:
        out[v] = self._put_out([at])[0]
        around.now[v] = (out[v].astype(float) - self.origin).tolist()

    def _between_ends(self, around: Around, v: int) -> Point:
        base, scale = self.vertices[v].base, self._stem_scale(around, v)
        at = [around.now[base][k] + scale * (around.rest[v][k] - around.rest[base][k]) for k in range(3)]
        return [x if finite(x) else was for x, was in zip(at, around.was[0][v])]

    def _stem_scale(self, around: Around, v: int) -> float:
        """How long the stem of a vertex is over how long it is at rest; of an end as it was, and changed."""
        vertex = self.vertices[v]
        if vertex.tip >= 0:
            return self._grown(around, around.now, vertex.base, vertex.tip)
        was, was2 = (self._grown(around, around.was[i], vertex.base, v) for i in range(2))
        return was + (was - was2)

    def _predict(self, around: Around, v: int) -> Way:
        vertex = self.vertices[v]
        fit, edge = self.fits[vertex.kind], 1.0
        if vertex.kind == 2:
            edge = self._grown(around, around.now, vertex.above, vertex.before)
        scales = edge, self._stem_scale(around, v)
        guesses, features = zip(*(self._guess(vertex, around, v, k, scales, fit.weights) for k in range(3)))
        errors = list(vertex.error)
        if vertex.near >= 0:
            errors = [a + b for a, b in zip(errors, self.vertices[vertex.near].error)]
        if self.common:
            errors = [a + b for a, b in zip(errors, fit.error)]
        chosen = 0
        for i in range(1, GUESSES):
            chosen = i if errors[i] < errors[chosen] else chosen
        way = [own[chosen] if finite(own[chosen]) else 0.0 for own in guesses]
        return Way(list(guesses), list(features), way)

    def _grown(self, around: Around, at: list[Point], u: int, v: int) -> float:
        """How far apart two vertices are along the way between them at rest, over that; near 1 where a step is more."""
        if u < 0 or v < 0:
            return 1.0
        along = length2 = self.step * self.step
        for k in range(3):
            edge = around.rest[v][k] - around.rest[u][k]
            along = along + edge * (at[v][k] - at[u][k])
            length2 = length2 + edge * edge
        return along / length2 if length2 > 1e-60 else 1.0

    @staticmethod
    def _guess(vertex: Follower, around: Around, v: int, k: int, scales: tuple, weights: list[float]) -> tuple:
        now, (was, was2, was3) = around.now, around.was

        def moved(u: int) -> tuple[float, float]:
            return (now[u][k] - was[u][k], was[u][k] - was2[u][k]) if u >= 0 else (0.0, 0.0)

        x, u, joined, edge, stem, waits = was[v][k], vertex.before, 0.0, 0.0, 0.0, 0.0
        if u >= 0:
            joined = now[u][k] - x
            edge = joined + scales[0] * (around.rest[v][k] - around.rest[u][k])
        if vertex.base >= 0:
            waits = around.rest[vertex.base][k] - x
            stem = (now[vertex.base][k] - x) + scales[1] * (around.rest[v][k] - around.rest[vertex.base][k])
        own, (before, before2), (above, above2) = x - was2[v][k], moved(u), moved(vertex.above)
        line, mean = (vertex.line[k] + vertex.slope[k]) - x, vertex.mean[k] - x
        features = [own, was2[v][k] - was3[v][k], before, before2, above, above2, line, mean]
        fitted = 0.0
        for weight, feature in zip(weights, features):
            fitted = fitted + weight * feature
        like = moved(vertex.like)[0]
        both, older = own + (before - before2), vertex.older[k]
        return [0.0, own, before, both, edge, joined, line, mean, like, older, stem, waits, fitted], features

    def _decode_steps(self, v: int) -> list[int]:
        vertex, vertices = self.vertices[v], self.vertices
        own, older = vertex.size
        near = vertices[vertex.near].size[0] if vertex.near >= 0 else 0
        beside = max(vertices[u].size[0] if u >= 0 else 0 for u in (vertex.earlier, vertex.before))
        contexts = self.moved[size_class(own + older // 2)][size_class(near)]
        expected, steps, total = (2 * own + older + 2 * near + beside) * 8 // 9, [], 0
        signs = vertices[vertex.near].steps if vertex.near >= 0 else [0, 0, 0]
        if self.coder.bit(contexts[0 if beside == 0 else 1 if beside < 4 else 2]):
            for k in range(3):
                about = number_class(expected if k == 0 else (2 * expected + total * 16 // k) // 3)
                sign = self.signs[sign_class(signs[k])][sign_class(vertex.steps[k])]
                parity = parity_of(steps, k) if self.is_lattice else ANY
                steps.append(self.numbers.code(self.coder, parity, about, sign))
                total += clipped(steps[k])
            vertex.steps = steps
        vertex.size = total, own
        return steps if len(steps) > 0 else [0, 0, 0]

    def _learn(self, around: Around, v: int, p: Way) -> None:
        vertex, x = self.vertices[v], around.now[v]
        fit, way = self.fits[vertex.kind], [x[k] - around.was[0][v][k] for k in range(3)]
        errors = []
        for i in range(GUESSES):
            a, b, c = (abs(way[k] - p.guesses[k][i]) for k in range(3))
            errors.append(a + b + c)
            vertex.error[i] = 0.5 * vertex.error[i] + errors[i]
            fit.error[i] = 0.9 * fit.error[i] + 0.1 * errors[i]
        a, b, c = (abs(way[k] - p.way[k]) for k in range(3))
        off = a + b + c + self.step
        fit.learn(p.features, way, 1.0 / (off * off), self.memory)
        vertex.learn_line(x, around.last[v], errors[LINE_GUESS], self.step)
        vertex.learn_mean(x)


def size_class(size: int) -> int:
    return 0 if size == 0 else 1 if size < 2 else 2 if size < 6 else 3


def sign_class(value: int) -> int:
    return 0 if value < 0 else 2 if value > 0 else 1


# ---- plan: what all segments share -------------------------------------------------------------------------

PIECE_VERTICES = 64
SHAPE_MODES = 16
MOST_SHIFT = 15


@dataclass
class Piece:
    """At most 64 consecutive vertices of one stem."""

    number: int
    first: int  # vertex
    count: int
    attach: int  # vertex, -1: none
    parent: int  # piece of that vertex, -1: none
    flags: int
    level: int  # that completes it
    low_level: int = -1  # that holds its tracks and first modes instead
    low_modes: int = 0
    carries: bool = False  # whether another piece hangs on it
    rigid: bool = False  # whether its branch is, in the layer
    ring: int = 0  # vertices of each of its rings

    @property
    def rings(self) -> int:
        """How many it has; the last one may lack vertices."""
        return divided_up(self.count, self.ring) if self.ring else 0

    @property
    def base_level(self) -> int:
        return self.low_level if self.low_level >= 0 else self.level

    @property
    def has_shift(self) -> bool:
        """Whether it has a translation track."""
        return self.parent < 0 or bool(self.flags & LOOSE)

    @property
    def vertices(self) -> slice:
        return slice(self.first, self.first + self.count)


@dataclass
class Node:
    """A branch whose subtree moves by one map at the levels `level` to `last`."""

    number: int
    piece: int
    first: int  # vertex
    count: int
    level: int
    last: int
    coded: bool  # whether it has a map of its own; else the first modes of its only piece make one

    @property
    def vertices(self) -> slice:
        return slice(self.first, self.first + self.count)


def divided_up(a: int, b: int) -> int:
    return (a + b - 1) // b


def piece_count(branch: Branch) -> int:
    """Pieces are of at most 64 vertices and of whole rings."""
    ring = max(branch.ring, 1)
    return divided_up(divided_up(branch.count, ring), PIECE_VERTICES // ring)


class Plan:
    """Pieces and nodes of a hierarchy; once the rest pose is set, also their bases."""

    def __init__(self, branches: list[Branch], is_predicted: bool = False, layer: int = 0):
        self.layer = layer
        self.is_predicted = is_predicted  # then no piece has modes, and all nodes have maps
        self.pieces: list[Piece] = []
        self.nodes: list[Node] = []
        self.rest = np.zeros((0, 3))
        self._bases: dict[int, np.ndarray] = {}
        is_node = self._find_nodes(branches)
        piece_of_vertex: list[int] = []
        for b, branch in enumerate(branches):
            if is_node[b]:
                self._add_node(branches, b)
            self._add_pieces(branch, self.nodes[-1] if is_node[b] else None, piece_of_vertex)

    def _find_nodes(self, branches: list[Branch]) -> list[bool]:
        """Branches that no proper ancestor with WHOLE contains."""
        is_node, self.height, b = [False] * len(branches), 0, 0
        while b < len(branches):
            is_node[b] = True
            self.height = max(self.height, branches[b].depth)
            b += branches[b].subtree if branches[b].flags & WHOLE else 1
        return is_node

    def _add_node(self, branches: list[Branch], b: int) -> None:
        branch, last_branch = branches[b], branches[b + branches[b].subtree - 1]
        self.nodes.append(
            Node(
                len(self.nodes),
                len(self.pieces),
                branch.first,
                last_branch.first + last_branch.count - branch.first,
                level=branch.depth,
                last=self.height if branch.flags & WHOLE else branch.depth,
                coded=self.is_predicted or branch.subtree > 1 or piece_count(branch) > 1,
            )
        )

    def _add_pieces(self, branch: Branch, node: Node | None, piece_of_vertex: list[int]) -> None:
        parts, ring = piece_count(branch), max(branch.ring, 1)
        rings = divided_up(branch.count, ring)
        for j in range(parts):
            start, stop = ring * (rings * j // parts), min(ring * (rings * (j + 1) // parts), branch.count)
            first = branch.first + start
            attach = branch.attach if j == 0 else first - 1
            piece = Piece(
                len(self.pieces),
                first,
                stop - start,
                attach,
                parent=piece_of_vertex[attach] if attach >= 0 else -1,
                flags=branch.flags if j == 0 else branch.flags & ~LOOSE,
                level=self.height + 1,
                rigid=branch.rigid > self.layer,
                ring=branch.ring,
            )
            if node is not None and not (branch.flags & WHOLE):
                piece.level = branch.depth + 1
            if node is not None and not node.coded:
                piece.low_level = branch.depth
                piece.low_modes = min(
                    piece.rings or branch.count, 3 if (branch.flags & SHEET) and not branch.ring else 2
                )
            piece_of_vertex += [piece.number] * piece.count
            self.pieces.append(piece)
            if piece.parent >= 0:
                self.pieces[piece.parent].carries = True

    def has_stems(self, level: int) -> bool:
        return not self.is_predicted and any(level in (piece.level, piece.low_level) for piece in self.pieces)

    def has_affines(self, level: int, shown: int) -> bool:
        """Whether playing `shown` needs the maps of `level`."""
        return any(node.coded and node.level == level and shown <= node.last for node in self.nodes)

    def refined(self, branches: list[Branch], level: int, layer: int) -> Plan:
        """That of a refinement, all of whose pieces come with its level; its rest pose is this one's."""
        plan = Plan(branches, layer=layer)
        plan.rest = self.rest
        for piece in plan.pieces:
            piece.level, piece.low_level, piece.low_modes = level, -1, 0
        return plan

    # From here on the rest pose is needed.

    def attach_point(self, piece: Piece) -> np.ndarray:
        return self.rest[piece.attach if piece.attach >= 0 else piece.first]

    def from_attach(self, piece: Piece) -> np.ndarray:
        """(count, 3): rest vertices relative to the attach vertex."""
        return self.rest[piece.vertices] - self.attach_point(piece)

    def basis(self, piece: Piece) -> np.ndarray:
        """(modes, count): functions over the piece's vertices."""
        if piece.number not in self._bases:
            modes = cantilever(piece_gaps(self, piece), 0.1, 0.001, tip_weight(self, piece))
            own = modes
            if piece.flags & SHEET:
                own = tube(self, piece, modes) if piece.ring else sheet(self, piece, modes)
            self._bases[piece.number] = own[:0] if piece.rigid else own
        return self._bases[piece.number]

    def shape_modes(self, piece: Piece) -> int:
        return min(len(self.basis(piece)), SHAPE_MODES)

    def base_shapes(self, piece: Piece) -> int:
        """The most shapes that the piece's base level may hold."""
        modes = self.shape_modes(piece)
        return 3 * (min(piece.low_modes, modes) if piece.low_level >= 0 else modes)

    def whitening(self, node: Node) -> list[np.ndarray]:
        """Up to three functionals, orthonormal over the subtree's rest vertices."""
        x = self.rest[node.vertices] - self.attach_point(self.pieces[node.piece])
        moment = in_order(x[:, :, None] * x[:, None, :]) / float(node.count)
        rows, used, largest = [], set(), 0.0
        for r in range(3):
            best, best_axis, best_w = 0.0, -1, None
            for axis in range(3):
                if axis in used:
                    continue
                w, left = np.zeros(3), moment[axis, axis]
                w[axis] = 1.0
                for e in rows:
                    shared = e[0] * moment[0, axis] + e[1] * moment[1, axis] + e[2] * moment[2, axis]
                    left = left - shared * shared
                    w = w - shared * e
                if left > best:
                    best, best_axis, best_w = left, axis, w
            if r == 0:
                largest = best
            if best_axis < 0 or not best > largest * 1e-4:
                break
            used.add(best_axis)
            rows.append(best_w / np.sqrt(best))
        return rows


# ---- bases -------------------------------------------------------------------------------------------------


def in_order(terms: np.ndarray) -> np.ndarray:
    """0.0 + terms[0] + terms[1] + ..., each sum rounded before the next: accumulate is defined to do that.

    The last 0.0 makes up for the first, which is left out: it tells only where all terms are -0.0.
    """
    if len(terms) == 0:
        return np.zeros(terms.shape[1:])
    return np.add.accumulate(terms, axis=0)[-1] + 0.0


def piece_gaps(plan: Plan, piece: Piece) -> tuple[int, ...]:
    """Distances along a piece in quarters of their mean, 1 to 64."""
    before = np.vstack([plan.attach_point(piece), plan.rest[piece.vertices][:-1]])
    lengths = distances(plan.rest[piece.vertices], before)
    if piece.flags & SHEET:
        lengths[:] = 0.0
    return quarters_of_mean(lengths)


def quarters_of_mean(lengths: np.ndarray) -> tuple[int, ...]:
    total = in_order(lengths)
    quarters = 4.0 * lengths * float(len(lengths)) / total + 0.5 if total > 0.0 else np.full(len(lengths), 4.0)
    return tuple(64 if q >= 64.0 else int(q) if q >= 1.0 else 1 for q in quarters.tolist())


def tip_weight(plan: Plan, piece: Piece) -> float:
    """What the last vertex counts in products of the modes of its piece."""
    points = np.vstack([plan.attach_point(piece), plan.rest[piece.vertices]])
    way, chord = in_order(distances(points[1:], points[:-1])), distances(points[-1], points[0])
    return 2.0 if not (piece.flags & SHEET) and piece.count > 1 and 2.0 * way <= 3.0 * chord else 1.0


def distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    x, y, z = (a - b).T
    return np.sqrt(x * x + y * y + z * z)


@cache
def cantilever(gaps: tuple[int, ...], turn: float, rough: float, tip: float) -> np.ndarray:
    """(n, n): modes of a randomly bent cantilever, its covariance's eigenvectors, largest eigenvalue
    first; orthonormal where the last vertex counts `tip` times."""
    total = float(sum(gaps))
    s = np.cumsum(gaps) / total
    high, low = np.maximum(s[:, None], s), np.minimum(s[:, None], s)
    bend = low * low * (3.0 * high - low) / 6.0
    covariance = bend + turn * (low * high) + rough * low
    covariance[:, -1] *= math.sqrt(tip)
    covariance[-1] *= math.sqrt(tip)
    _, modes = principal(covariance)
    modes[:, -1] /= math.sqrt(tip)
    return modes


def principal(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues in descending order, and a row for the vector of each."""
    n, values, vectors = len(a), [], []
    q, d, e = tridiagonalise(a)
    diagonalise(q, d, e)
    for _ in range(n):
        best = max(range(n), key=lambda i: d[i])  # the first of equals
        sign = -1.0 if q[best, n - 1] < 0.0 else 1.0
        values.append(d[best])
        vectors.append(sign * q[best])
        d[best] = -1e300
    return np.array(values), np.array(vectors)


def tridiagonalise(a: np.ndarray):
    """Householder's reduction: rows q, diagonal d, and e beside it."""
    n = len(a)
    q = np.eye(n)
    for k in range(n - 2):
        rest = slice(k + 1, n)
        column = a[rest, k].copy()
        norm2, head = float(in_order(column * column)), float(column[0])
        if not norm2 - head * head > norm2 * 1e-30:
            continue
        norm = math.sqrt(norm2)
        alpha = -norm if head > 0.0 else norm
        scale = 1.0 / (norm2 - head * alpha)
        v = column
        v[0] = head - alpha
        p = in_order((a[rest, rest] * v).T) * scale
        half = 0.5 * scale * in_order(v * p)
        p = p - half * v
        a[rest, rest] = a[rest, rest] - v[:, None] * p - p[:, None] * v
        a[k + 1, k] = a[k, k + 1] = alpha
        a[k + 2 :, k] = a[k, k + 2 :] = 0.0
        total = in_order(v[:, None] * q[rest]) * scale
        q[rest] = q[rest] - total * v[:, None]
    return q, a.diagonal().tolist(), a.diagonal(-1).tolist() + [0.0]


def diagonalise(q: np.ndarray, d: list[float], e: list[float]) -> None:
    """The implicit QL method: afterwards row i of q belongs to the eigenvalue d[i]."""
    n = len(d)
    for l in range(n):  # noqa: E741
        for _ in range(50):
            m = l
            while m < n - 1 and abs(e[m]) > (abs(d[m]) + abs(d[m + 1])) * 1e-16:
                m += 1
            if m == l:
                break
            g = (d[l + 1] - d[l]) / (2.0 * e[l])
            r = math.sqrt(g * g + 1.0)
            g = d[m] - d[l] + e[l] / (g + r if g >= 0.0 else g - r)
            s, c, p, early = 1.0, 1.0, 0.0, False
            for i in range(m - 1, l - 1, -1):
                f, b = s * e[i], c * e[i]
                r = math.sqrt(f * f + g * g)
                e[i + 1] = r
                if r == 0.0:
                    d[i + 1] = d[i + 1] - p
                    e[m] = 0.0
                    early = True
                    break
                s = f / r
                c = g / r
                g = d[i + 1] - p
                r = (d[i] - g) * s + 2.0 * c * b
                p = s * r
                d[i + 1] = g + p
                g = c * r - b
                high, low = q[i + 1].copy(), q[i].copy()
                q[i + 1] = s * low + c * high
                q[i] = c * low - s * high
            if early:
                continue
            d[l] = d[l] - p
            e[l] = g
            e[m] = 0.0


def sheet(plan: Plan, piece: Piece, modes: np.ndarray) -> np.ndarray:
    """The affine functions over a flat piece's vertices, then what is left of the modes."""
    columns = plan.from_attach(piece).T
    length2 = in_order((columns * columns).T)
    basis: list[np.ndarray] = []
    for _ in range(3):
        best = 0
        for k in range(1, 3):
            if length2[k] > length2[best]:
                best = k
        if length2[best] > 0.0 and len(basis) < piece.count:
            append_orthonormal(basis, columns[best], 1e-4)
        length2[best] = -1.0
    for mode in modes:
        if len(basis) < piece.count:
            append_orthonormal(basis, mode, 1e-10)
    return np.array(basis).reshape(-1, piece.count)


def tube(plan: Plan, piece: Piece, modes: np.ndarray) -> np.ndarray:
    """Rings that move as they are along a cantilever, as affine functions of all, each ring so, then what is left of
    the modes."""
    x, starts = plan.rest[piece.vertices], range(0, piece.count, piece.ring)
    centres = np.array([in_order(x[i : i + piece.ring]) / float(len(x[i : i + piece.ring])) for i in starts])
    lengths = distances(centres, np.vstack([plan.attach_point(piece), centres[:-1]]))
    ring_of = np.arange(piece.count) // piece.ring
    along = cantilever(quarters_of_mean(lengths), 0.1, 0.001, 1.0)[:, ring_of]
    across = (x - centres[ring_of]).T
    basis: list[np.ndarray] = []
    for function in (*along, *across, *(mode * column for mode in along for column in across), *modes):
        if len(basis) < piece.count:
            append_orthonormal(basis, function, 1e-10)
    return np.array(basis).reshape(-1, piece.count)


def append_orthonormal(basis: list, x: np.ndarray, keep: float) -> None:
    before = in_order(x * x)
    for _ in range(2):
        for mode in basis:
            x = x - in_order(mode * x) * mode
    after = in_order(x * x)
    if after > before * keep:
        basis.append(x * (1.0 / np.sqrt(after)))


PI = 3.14159265358979323846
HALF_ROOT_3 = 0.86602540378443864676


# Of what falls: its wave number over that of the cosine, its size at the end over the sine of the phase, and this over
# the square of the first; and how many waves are polynomials.
SECOND = (1.0, 0.0), (1.0, 0.0), (1.0, 0.0), 2
THIRD = (HALF_ROOT_3, -0.5), (2.0 * HALF_ROOT_3, 1.0), (0.0, 2.0), 3


@cache
def waves_over_time(frames: int, periodic: bool) -> np.ndarray:
    """(frames, frames): wave k at frame t, of stems."""
    return np.array(periodic_waves(frames) if periodic else free_waves(frames, THIRD))


@cache
def node_waves_over_time(frames: int, periodic: bool) -> np.ndarray:
    """Of the maps of nodes."""
    return np.array(periodic_waves(frames) if periodic else free_waves(frames, SECOND))


def free_waves(frames: int, order: tuple) -> list[list[float]]:
    return [polynomial_wave(frames, k) if k < order[3] else mode_wave(frames, k, order) for k in range(frames)]


def polynomial_wave(frames: int, k: int) -> list[float]:
    way = [0.5 * (frames - 1) - t for t in range(frames)]
    mean = (frames * frames - 1) / 12.0
    return unit_length([1.0 if k == 0 else x if k == 1 else x * x - mean for x in way])


def unit_length(x: list[float]) -> list[float]:
    length2 = 0.0
    for value in x:
        length2 = length2 + value * value
    scale = 1.0 / math.sqrt(length2)
    return [value * scale for value in x]


def mode_wave(frames: int, k: int, order: tuple) -> list[float]:
    """cos((2 t + 1) h + phase), and what falls from either end by `decay` in half a frame."""
    sine, cosine, slope, decay, apart = mode_at(frames, k, PI * (k - 0.5) / (2 * frames), order)
    for _ in range(32):
        sine, cosine, slope, decay, apart = mode_at(frames, k, (0.5 * PI * k - atan_of(slope)) / frames, order)
    sign, phase_cosine = 1.0 if k % 2 == 0 else -1.0, 1.0 / math.sqrt(1.0 + slope * slope)
    phase_sine = slope * phase_cosine
    c, s = cosine * phase_cosine - sine * phase_sine, sine * phase_cosine + cosine * phase_sine
    turn_c, turn_s = 1.0 - 2.0 * sine * sine, 2.0 * sine * cosine
    edge = times(times((phase_sine * order[1][0], phase_sine * order[1][1]), apart), decay)
    fall, frame_decay, wave = [], times(decay, decay), [0.0] * frames
    for _ in range(frames):
        fall.append(edge[0])
        edge = times(edge, frame_decay)
    for t in range((frames + 1) // 2):
        x = c + (fall[t] + sign * fall[frames - 1 - t])
        wave[frames - 1 - t] = sign * x
        wave[t] = x
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    return unit_length(wave)


def mode_at(frames: int, k: int, h: float, order: tuple):
    """Sine and cosine of h, the tangent of the phase, decay, 1 / (1 - what is left of it at the other end)."""
    sine, cosine = sin_of(h), cos_of(h)
    falls = sine * order[0][0], sine * order[0][1]
    square = times(falls, falls)
    real = 1.0 + square[0]
    length = math.sqrt(real * real + square[1] * square[1])
    root_real = math.sqrt(0.5 * (length + real))
    root = root_real, 0.5 * square[1] / root_real
    decay = root[0] - falls[0], root[1] - falls[1]
    far = power(decay, 2 * frames)
    if k % 2 == 1:
        far = -far[0], -far[1]
    left = 1.0 - far[0]
    scale = 1.0 / (left * left + far[1] * far[1])
    apart = left * scale, far[1] * scale
    slope = cosine / times(times(order[2], root), times((1.0 + far[0], far[1]), apart))[0]
    return sine, cosine, slope, decay, apart


def times(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    """The product of complex numbers."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def power(x: tuple[float, float], n: int) -> tuple[float, float]:
    product = 1.0, 0.0
    while n > 0:
        if n % 2 == 1:
            product = times(product, x)
        x, n = times(x, x), n // 2
    return product


def cos_of(x: float) -> float:
    """0 <= x <= pi / 2."""
    return cos_series(x) if x <= 0.25 * PI else sin_series(0.5 * PI - x)


def sin_of(x: float) -> float:
    return sin_series(x) if x <= 0.25 * PI else cos_series(0.5 * PI - x)


def atan_of(x: float) -> float:
    """x >= 0."""
    if x > 1.0:
        return 0.5 * PI - atan_of(1.0 / x)
    half = x / (1.0 + math.sqrt(1.0 + x * x))
    quarter, total = half / (1.0 + math.sqrt(1.0 + half * half)), 0.0
    for k in range(25, 0, -2):
        total = 1.0 / k - total * (quarter * quarter)
    return 4.0 * (quarter * total)


def periodic_waves(frames: int) -> list[list[float]]:
    once, twice, waves = math.sqrt(1.0 / frames), math.sqrt(2.0 / frames), []
    for k in range(frames):
        turns, later = (k + 1) // 2, 3 * frames if k > 0 and k % 2 == 0 else 0
        size = once if k == 0 or 2 * turns == frames else twice
        waves.append([size * cos_of_fraction((4 * turns * t + later) % (4 * frames), frames) for t in range(frames)])
    return waves


def cos_of_fraction(j: int, frames: int) -> float:
    """cos(pi j / (2 frames)), 0 <= j < 4 frames."""
    if j > 2 * frames:
        j = 4 * frames - j
    sign = 1.0
    if j > frames:
        j, sign = 2 * frames - j, -1.0
    if 2 * j <= frames:
        return sign * cos_series(PI * j / (2 * frames))
    return sign * sin_series(PI * (frames - j) / (2 * frames))


def cos_series(x: float) -> float:
    x2, total = x * x, 1.0
    for k in range(18, 0, -2):
        total = 1.0 - total * x2 / (k * (k - 1))
    return total


def sin_series(x: float) -> float:
    x2, total = x * x, 1.0
    for k in range(19, 1, -2):
        total = 1.0 - total * x2 / (k * (k - 1))
    return x * total


# ---- motion of one segment at one level --------------------------------------------------------------------


@dataclass
class LevelStream:
    """How the integers of a level's STEMS are read."""

    step: float
    rotation_step_factor: float
    only_tips: bool  # pieces that carry others have no rotations
    turn_step: float  # largest of rotations of rigid pieces; 0.0: any
    waves: np.ndarray  # (rank, frames)
    root: int  # the first of the levels whose learned bases begin with the same rows; -1: waves of stems, -2: of nodes


@dataclass
class Motion:
    """The integers of a segment: rows of three axes over frequency. What no chunk holds is missing."""

    frames: int
    periodic: bool
    streams: dict[int, LevelStream] = field(default_factory=dict)  # by level
    shapes: dict[int, list[np.ndarray]] = field(default_factory=dict)  # by piece: (16, 3), one per shape
    shape_rows: dict[int, list] = field(default_factory=dict)  # by piece: their integers
    coefficients: dict[int, list] = field(default_factory=dict)  # by piece.first + mode
    shift: dict[int, list] = field(default_factory=dict)  # by piece
    rotation: dict[int, list] = field(default_factory=dict)  # by piece
    node_rows: dict[int, list] = field(default_factory=dict)  # by node
    node_shift: dict[int, list] = field(default_factory=dict)  # by node
    node_step: dict[int, float] = field(default_factory=dict)  # by node

    @property
    def waves(self) -> np.ndarray:
        return waves_over_time(self.frames, self.periodic)

    @property
    def node_waves(self) -> np.ndarray:
        return node_waves_over_time(self.frames, self.periodic)

    def shapes_of(self, piece: Piece) -> list[np.ndarray]:
        return self.shapes.get(piece.number, [])


def decode_shapes(stream: bytes, plan: Plan, motion: Motion, level: int) -> None:
    """Shapes that pieces have at their base level, or that the level which completes them adds."""
    coder, model, counts, before = RangeDecoder(stream), CoefficientModel(), NumberModel(), [0, 0]
    for piece in plan.pieces:
        if level not in (piece.base_level, piece.level):
            continue
        rows, most, part = motion.shape_rows.get(piece.number, []), plan.base_shapes(piece), 0
        if level != piece.base_level:
            if len(rows) < most:
                continue
            part, most = 1, 3 * plan.shape_modes(piece) - most
        before[part] = count = code_unsigned(coder, counts, before[part] * 16)
        require(count <= most, "a piece has more shapes than modes and axes")
        above, above_count = None, 0
        for _ in range(count):
            above, above_count = decode_row(
                coder, model, SHAPE_MODES, plan.shape_modes(piece), len(rows), above, above_count
            )
            rows = [*rows, above]
        set_shapes(motion, piece, rows)
    coder.finish()


def set_shapes(motion: Motion, piece: Piece, rows: list) -> None:
    motion.shape_rows[piece.number] = rows
    motion.shapes[piece.number] = [unit_shape(row) for row in rows]


def unit_shape(row: list[list[int]]) -> np.ndarray:
    """(16, 3) of unit length."""
    numbers = np.array(row, float).T.ravel()  # axis a of mode m at 3 m + a
    length2 = in_order(numbers * numbers)
    require(length2 > 0.0, "a shape is all 0")
    return (numbers * (1.0 / np.sqrt(length2))).reshape(SHAPE_MODES, 3)


def decode_refined_shapes(stream: bytes, plan: Plan, motion: Motion, before: Motion, shift: int) -> None:
    """All shapes of a refinement, about those of the layer before times 2^shift."""
    coder, model, counts = RangeDecoder(stream), RefinementModel(), NumberModel()
    most = 0x3FFFFFFF >> shift
    for piece in plan.pieces:
        known = before.shape_rows.get(piece.number, [])
        count = code_unsigned(coder, counts, len(known) * 16)
        require(count <= 3 * plan.shape_modes(piece), "a piece has more shapes than modes and axes")
        above, rows = None, []
        for s in range(count):
            coarse = known[s] if s < len(known) else zero_row(SHAPE_MODES)
            predicted = [[min(max(number, -most), most) << shift for number in axis] for axis in coarse]
            above = decode_refined_row(
                coder, model, plan.shape_modes(piece), s, predicted, [1 << shift] * 3, magnitudes(coarse), None, above
            )
            rows.append(above.row)
        set_shapes(motion, piece, rows)
    coder.finish()


def read_stems_head(chunk: bytes, motion: Motion, level: int) -> bytes:
    """Steps and waves of a level; returns its Stems_Stream."""
    require(len(chunk) >= 6, "STEMS is too short")
    step, rotation, bits = f32(chunk, 0), chunk[4], chunk[5]
    require(finite(step) and step > 0.0 and (rotation & 7) <= 4, "Step or Rotation of STEMS is out of range")
    require(bits <= 2 or 8 <= bits <= 16, "Basis_Bits is out of range")
    waves, root, body = (motion.waves, -1, chunk[6:]) if bits == 0 else (motion.node_waves, -2, chunk[6:])
    if bits > 1:
        waves, root, body = read_basis(body, motion, level, bits)
    factor, turn_step = float((1 << (rotation & 7)) >> 1), half_octave(-(rotation >> 4)) if (rotation >> 4) > 0 else 0.0
    motion.streams[level] = LevelStream(step, factor, (rotation & 8) != 0, turn_step, waves, root)
    return body


def read_basis(body: bytes, motion: Motion, level: int, bits: int) -> tuple[np.ndarray, int, bytes]:
    """Waves and root of a learned basis, and what follows it."""
    require(len(body) >= 7, "STEMS is too short")
    rank, base, length = u16(body, 0), body[2], u32(body, 3)
    require(1 <= rank <= motion.frames, "Basis_Rank is out of range")
    require(length <= len(body) - 7, "Basis_Length is more than the chunk holds")
    known, root = np.empty((0, motion.frames)), level
    if base != 255:
        require(base < level and base in motion.streams, "Basis_Level is not a level before with STEMS")
        require(motion.streams[base].root >= 0, "Basis_Level is a level without a learned basis")
        known, root = motion.streams[base].waves, motion.streams[base].root
    require(len(known) <= rank, "Basis_Rank is less than that of the basis that it begins with")
    stream, rest = body[7 : 7 + length], body[7 + length :]
    if bits == 2:
        return decode_basis(stream, known, rank, motion.frames, motion.waves), root, rest
    rows = decode_temporal(stream, rank - len(known), motion.frames, bits)
    own = np.array(rows, float).reshape(len(rows), motion.frames) * 2.0 ** -(bits - 1)
    return np.concatenate([known, own]), root, rest


def decode_stems(stream: bytes, plan: Plan, motion: Motion, level: int) -> None:
    """Tracks of the pieces that begin at a level, and modes of those that begin or are completed there."""
    coder, model = RangeDecoder(stream), CoefficientModel()
    frames, rank = motion.frames, len(motion.streams[level].waves)
    for piece in plan.pieces:
        if level == piece.base_level:
            if piece.has_shift:
                motion.shift[piece.number], _ = decode_row(coder, model, frames, rank, SHIFT_SLOT)
            if turning(plan, piece, motion.streams[level]) is not None:
                motion.rotation[piece.number], _ = decode_row(coder, model, frames, rank, ROTATION_SLOT)
        start = stop = 0
        if level == piece.low_level:
            stop = min(piece.low_modes, len(plan.basis(piece)))
        if level == piece.level:
            start, stop = piece.low_modes, len(plan.basis(piece))
        above, count, shapes = None, 0, len(motion.shapes_of(piece))
        for m in range(start, stop):
            if shapes and shapes <= 3 * m < 3 * plan.shape_modes(piece):
                continue  # the row would hold no shape
            above, count = decode_row(coder, model, frames, rank, m, above, count)
            motion.coefficients[piece.first + m] = above
    coder.finish()


def decode_affines(stream: bytes, plan: Plan, motion: Motion, level: int) -> None:
    """Maps of the coded nodes of a level."""
    coder, model, steps = RangeDecoder(stream), CoefficientModel(), NumberModel()
    exponent, frames = 0, motion.frames
    for node in plan.nodes:
        if not node.coded or node.level != level:
            continue
        change = code_signed(coder, steps, 32)
        require(abs(change) <= 400 and abs(exponent + change) <= 200, "the step of a map is out of range")
        exponent += change
        motion.node_step[node.number] = half_octave(exponent)
        above, count, rows = None, 0, []
        for r in range(len(plan.whitening(node))):
            above, count = decode_row(coder, model, frames, frames, r, above, count)
            rows.append(above)
        motion.node_rows[node.number] = rows
        if plan.pieces[node.piece].has_shift:
            motion.node_shift[node.number], _ = decode_row(coder, model, frames, frames, SHIFT_SLOT)
    coder.finish()


def half_octave(exponent: int) -> float:
    """The square root of 2 to a power."""
    odd = exponent & 1
    return (1.4142135623730951 if odd else 1.0) * 2.0 ** ((exponent - odd) // 2)


# ---- corrections -------------------------------------------------------------------------------------------

BLOCK_FRAMES = 8
FOOTPRINTS = ((32,), (32, 16), (32, 27, 16, 5))


class CorrectionModel:
    def __init__(self):
        self.vertex = [Context(4000 if i == 0 else 32768) for i in range(4)]
        self.block = [[Context(8000) for _ in range(4)] for _ in range(2)]
        self.frame = [[[Context(32768 if i or j else 6000) for _ in range(2)] for j in range(3)] for i in range(3)]
        self.zero = [[Context(32768) for _ in range(3)] for _ in range(2)]
        self.sign = [[Context(32768) for _ in range(3)] for _ in range(3)]
        self.width = [[Context(32768) for _ in range(2)] for _ in range(4)]
        self.size = NumberModel()


def decode_corrections(stream: bytes, vertex_count: int, frames: int) -> np.ndarray:
    """(vertices, 4, frames) integers: vectors and their widths."""
    coder, model = RangeDecoder(stream), CorrectionModel()
    none = [(0, 0, 0, 0)] * frames
    above, before, result = none, 0, []
    for _ in range(vertex_count):
        corrected = coder.bit(model.vertex[before])
        above = decode_corrected_frames(coder, model, above, frames) if corrected else none
        before = ((before << 1) | corrected) & 3
        result.append(above)
    coder.finish()
    return np.array(result, np.int64).transpose(0, 2, 1)


def decode_corrected_frames(coder: RangeDecoder, model: CorrectionModel, above: list, frames: int) -> list:
    """A vertex that has corrections: blocks of frames, frames of a block. What must be true is not coded."""
    row = [(0, 0, 0, 0)] * frames
    some = [is_corrected(q) for q in above]
    found_any = block_before = 0
    for start in range(0, frames, BLOCK_FRAMES):
        stop = min(start + BLOCK_FRAMES, frames)
        inside = True in some[start:stop]
        beside = True in some[max(start - BLOCK_FRAMES, 0) : min(stop + BLOCK_FRAMES, frames)]
        around = 3 if inside else 2 if beside else 0
        last_chance = stop == frames and not found_any
        block = block_before = 1 if last_chance else coder.bit(model.block[block_before][around])
        if not block:
            continue
        found_any, found = 1, 0
        for t in range(start, stop):
            earlier = 2 if t > 0 and is_corrected(row[t - 1]) else 1 if t > 1 and is_corrected(row[t - 2]) else 0
            near = 2 if some[t] else 1 if True in some[max(t - 1, 0) : t + 2] else 0
            if (t == stop - 1 and not found) or coder.bit(model.frame[earlier][near][found]):
                found = 1
                row[t] = decode_correction(coder, model, above[t])
    return row


def is_corrected(q: tuple) -> bool:
    return q != (0, 0, 0, 0)


def decode_correction(coder: RangeDecoder, model: CorrectionModel, like: tuple) -> tuple:
    """Three integers, not all 0, and a width, that are expected to be like others."""
    q, nonzero_any = [0, 0, 0, 0], 0
    width = model.width[1 + like[3] if is_corrected(like) else 0]
    while q[3] < len(FOOTPRINTS) - 1 and coder.bit(width[q[3]]):
        q[3] += 1
    for axis in range(3):
        sign = 0 if like[axis] == 0 else 1 if like[axis] < 0 else 2
        if axis < 2 or nonzero_any:
            c = 1 if sign else 2 if is_corrected(like) else 0
            if not coder.bit(model.zero[nonzero_any][c]):
                continue
        nonzero_any = 1
        negative = coder.bit(model.sign[axis][sign])
        magnitude = code_unsigned(coder, model.size, clipped(like[axis]) * 16) + 1
        q[axis] = -magnitude if negative else magnitude
    return tuple(q)


def corrected_parts(corrections: np.ndarray) -> np.ndarray:
    """What the corrections of vertices add to their frames, (vertices, 3, frames) integers, in 1/32 of their step."""
    vectors, widths = corrections[:, :3], corrections[:, 3:]
    parts = np.zeros_like(vectors)
    for width, footprint in enumerate(FOOTPRINTS):
        own = np.where(widths == width, vectors, 0)
        parts += footprint[0] * own
        for away in range(1, min(len(footprint), own.shape[2])):
            parts[:, :, away:] += footprint[away] * own[:, :, :-away]
            parts[:, :, :-away] += footprint[away] * own[:, :, away:]
    return parts


# ---- reconstruction ----------------------------------------------------------------------------------------
#
# Vectors over time have the shape (3, frames), matrices (3, 3, frames); vertices come first: (count, 3,
# frames).

MOST_PREDICTED = 536870911


def mat_vec(R: np.ndarray, x: np.ndarray) -> np.ndarray:
    """R x of one vector or of many."""
    x0, x1, x2 = (x[..., k, None, :] for k in range(3))
    return R[:, 0] * x0 + R[:, 1] * x1 + R[:, 2] * x2


def mat_mul(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    return A[:, 0, None] * B[0] + A[:, 1, None] * B[1] + A[:, 2, None] * B[2]


def matrix(*nine) -> np.ndarray:
    """(3, 3, frames) from nine rows over time, row-major."""
    return np.array(nine).reshape(3, 3, -1)


def rotation(x, y, z) -> np.ndarray:
    """The quaternion (1, x, y, z), normalised and squared."""
    n2 = x * x + y * y + z * z
    unit = 1.0 / (1.0 + n2)
    w = (1.0 - n2) * unit
    x, y, z = 2.0 * x * unit, 2.0 * y * unit, 2.0 * z * unit
    return matrix(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


def over_time(row, step: float, waves: np.ndarray) -> np.ndarray:
    """(3, frames): integers over frequency as numbers over time; those that are 0 are left out. None: no
    row."""
    if row is None:
        return np.zeros((3, waves.shape[1]))
    tracks = []
    for axis, own in zip(row, np.broadcast_to(step, len(row))):
        numbers = np.array(axis[: len(waves)])
        there = np.flatnonzero(numbers)
        tracks.append(in_order((numbers[there].astype(float) * own)[:, None] * waves[there]))
    return np.array(tracks)


def shift_step(piece: Piece, stream: LevelStream) -> float:
    return stream.step / math.sqrt(float(piece.count))


LEAST_MOMENT = 0.0009765625  # of inertia, that a rotation's step is made for, over the squared lever


@dataclass(frozen=True)
class Turning:
    """Steps of a rotation about three axes, the rows of `axes`; None: those of the rest pose's space."""

    steps: np.ndarray
    axes: np.ndarray | None = None


def turning(plan: Plan, piece: Piece, stream: LevelStream) -> Turning | None:
    """None: no rotation is coded."""
    away = plan.from_attach(piece)
    lever2 = in_order(away.ravel() * away.ravel())
    factor = stream.rotation_step_factor
    if piece.rigid:
        factor = factor if factor > 0.0 else 1.0
    elif stream.only_tips and piece.carries:
        factor = 0.0
    if not lever2 > 0.0 or not factor > 0.0:
        return None
    step = factor * stream.step
    if not piece.rigid:
        return Turning(np.full(3, step / np.sqrt(lever2 * 2.0 / 3.0)))
    moments, axes = axes_of_inertia(away, lever2)
    steps = step / np.sqrt(np.where(moments > LEAST_MOMENT * lever2, moments, LEAST_MOMENT * lever2))
    if stream.turn_step > 0.0:
        steps = np.where(stream.turn_step < steps, stream.turn_step, steps)
    return Turning(steps, axes)


def axes_of_inertia(away: np.ndarray, lever2: float) -> tuple[np.ndarray, np.ndarray]:
    """Moments about the attach point, the largest first, and a row for the axis of each."""
    M = lever2 * np.eye(3)
    for d in away:
        M = M - d[:, None] * d
    return principal(M)


@dataclass(frozen=True)
class End:
    """The last two frames of a segment."""

    maps: dict[int, tuple]  # (c, R) of the nodes shown
    positions: np.ndarray  # (vertices, 3, 2), as output


class Pose:
    """All vertices of one segment, placed piece by piece and node by node."""

    def __init__(self, plan: Plan, motion: Motion):
        self.plan, self.motion, self.frames = plan, motion, motion.frames
        self.placed = np.empty((len(plan.rest), 3, motion.frames))
        self.kept: dict[int, tuple] = {}  # (c, R) of the pieces placed
        self.maps: dict[int, tuple] = {}  # (c, R) of the nodes shown
        self.is_exact = np.ones(len(plan.rest), bool)

    def place_level(self, level: int, join: Join = NO_JOIN, end: End | None = None) -> None:
        for piece in self.plan.pieces:
            if piece.level <= level:
                self.place_piece(piece)
        for node in self.plan.nodes:
            if node.level <= level <= node.last:
                c, R = self.node_frames(node)
                if end is not None:
                    c, R = (join.apply(of_end, own) for of_end, own in zip(end.maps[node.number], (c, R)))
                self.place_node(node, c, R)

    # Attach frames: a piece hangs on a point c and in a rotation R.

    def attach_frame(self, piece: Piece):
        plan, still = self.plan, np.ones(self.frames)
        if piece.parent < 0:
            return plan.attach_point(piece)[:, None] * still, np.eye(3)[:, :, None] * still
        parent, (base, R) = plan.pieces[piece.parent], self.kept[piece.parent]
        c = self.placed[piece.attach].copy()
        if (parent.flags & SHEET) or parent.rigid:
            return c, R
        before, after = piece.attach - 1, min(piece.attach + 1, parent.first + parent.count - 1)
        inside = before >= parent.first
        rest_start = plan.rest[before] if inside else plan.attach_point(parent)
        start, end = (self.placed[before] if inside else base), self.placed[after]
        tangent = plan.rest[after] - rest_start
        length2 = in_order(tangent * tangent)
        if not length2 > 1e-200:
            return c, R
        tangent = tangent * (1.0 / np.sqrt(length2))
        return c, follow_tangent(R, tangent[:, None], end - start)

    def base_stream(self, piece: Piece) -> LevelStream:
        return self.motion.streams[piece.base_level]

    def shift_track(self, piece: Piece) -> np.ndarray:
        """(3, frames); 0.0 where none is coded."""
        stream = self.base_stream(piece)
        return over_time(self.motion.shift.get(piece.number), shift_step(piece, stream), stream.waves)

    def rotation_track(self, piece: Piece) -> np.ndarray:
        """(3, frames); 0.0 where none is coded."""
        stream = self.base_stream(piece)
        own = turning(self.plan, piece, stream)
        track = over_time(self.motion.rotation.get(piece.number), 0.0 if own is None else own.steps, stream.waves)
        return track if own is None or own.axes is None else mat_vec(own.axes.T[:, :, None], track)

    def turned_frames(self, piece: Piece):
        """The attach frame, moved and turned by the piece's own tracks."""
        c, R = self.attach_frame(piece)
        if piece.has_shift:
            c = c + self.shift_track(piece)
        if turning(self.plan, piece, self.base_stream(piece)) is not None:
            x, y, z = 0.25 * self.rotation_track(piece)
            R = mat_mul(R, rotation(x, y, z))
        return c, R

    # Exact pieces.

    def mode_stream(self, piece: Piece, m: int) -> LevelStream:
        return self.motion.streams[piece.base_level if m < piece.low_modes else piece.level]

    def row_step(self, piece: Piece, m: int) -> float:
        """Modes of a cantilever are finer the more they carry."""
        step = self.mode_stream(piece, m).step
        if self.motion.shapes_of(piece) and m < self.plan.shape_modes(piece):
            return 0.875 * step
        if m >= piece.rings if piece.ring else piece.flags & SHEET:
            return step
        return step * ([0.75, 0.875, 0.9375, 1.0][m] if m < 4 else 1.125)

    def mode_row(self, piece: Piece, m: int) -> np.ndarray:
        row = self.motion.coefficients.get(piece.first + m)
        return over_time(row, self.row_step(piece, m), self.mode_stream(piece, m).waves)

    def place_piece(self, piece: Piece) -> None:
        c, R = self.turned_frames(piece)
        x = self.plan.from_attach(piece)[:, :, None] * np.ones(self.frames)
        for moves, track in self.piece_terms(piece):
            x = x + moves[:, :, None] * track
        self.placed[piece.vertices] = c + mat_vec(R, x)
        if (piece.flags & SHEET) and not piece.rigid:
            R = self.sheet_rotation(piece, c, R)
        self.kept[piece.number] = c, R

    def piece_terms(self, piece: Piece):
        """How far a shape or mode moves each vertex, (count, 3), and its track: (frames,) or (3, frames).

        What is 0.0 throughout is left out: adding it could change the sign of a zero, or make a NaN.
        """
        shapes = self.motion.shapes_of(piece)
        for m, mode in enumerate(self.plan.basis(piece)):
            row = self.mode_row(piece, m)
            if shapes and m < self.plan.shape_modes(piece):
                for shape, track in zip(shapes[3 * m : 3 * m + 3], row, strict=False):  # the last mode may have fewer
                    if np.any(track != 0.0):
                        yield self.shape_moves(piece, shape), track
            elif np.any(row != 0.0):
                yield np.repeat(mode[:, None], 3, axis=1), row

    def shape_moves(self, piece: Piece, shape: np.ndarray) -> np.ndarray:
        modes = self.plan.basis(piece)[: self.plan.shape_modes(piece)]
        return in_order(modes[:, :, None] * shape[: len(modes), None, :])

    def sheet_rotation(self, piece: Piece, c: np.ndarray, R: np.ndarray) -> np.ndarray:
        """How a sheet has turned as a whole: the rotation nearest to its placed vertices, in 4 steps."""
        d = self.plan.from_attach(piece)
        size2 = in_order((d * d).ravel())
        moved = self.placed[piece.vertices] - c
        H = in_order(moved[:, :, None, :] * d[:, None, :, None])
        return turn_to(H + 0.01 * size2 * R, 4, R)

    # Nodes.

    def place_node(self, node: Node, c: np.ndarray, R: np.ndarray) -> None:
        self.maps[node.number], self.is_exact[node.vertices] = (c, R), False
        x = self.plan.rest[node.vertices] - self.plan.attach_point(self.plan.pieces[node.piece])
        self.placed[node.vertices] = c + mat_vec(R, x[:, :, None])

    def node_frames(self, node: Node):
        """A node's map takes rest position x0 to c + R (x0 - a)."""
        c, R, parts = self.coded_map(node) if node.coded else self.stem_map(node)
        E = np.zeros((3, 3, self.frames))
        for functional, track in parts:
            if functional.ndim == 1:
                E = E + track[:, None, :] * functional[None, :, None]
            else:
                E = E + track * functional[:, :, None]
        return c, R + mat_mul(R, E)

    def coded_map(self, node: Node):
        """By rows of its own; functionals are (3,) with a track per axis."""
        motion, piece = self.motion, self.plan.pieces[node.piece]
        step = motion.node_step.get(node.number, 1.0)
        c, R = self.attach_frame(piece)
        if piece.has_shift:
            c = c + over_time(motion.node_shift.get(node.number), step, motion.node_waves)
        rows = motion.node_rows.get(node.number, [])  # of predicted motion, where no chunk has them
        return (
            c,
            R,
            [
                (functional, over_time(row, step, motion.node_waves))
                for functional, row in zip(self.plan.whitening(node), rows)
            ],
        )

    def stem_map(self, node: Node):
        """By the first modes or shapes of its only piece; functionals of shapes are (3, 3) with one track."""
        plan, piece = self.plan, self.plan.pieces[node.piece]
        c, R = self.turned_frames(piece)
        shapes, parts = self.motion.shapes_of(piece), []
        for m in range(min(piece.low_modes, len(plan.basis(piece)))):
            row = self.mode_row(piece, m)
            if not shapes:
                parts.append((self.affine_part(node, plan.basis(piece)[m]), row))
            elif m < plan.shape_modes(piece):
                parts += [
                    (self.map_of_shape(node, piece, shape), track)
                    for shape, track in zip(shapes[3 * m : 3 * m + 3], row, strict=False)
                ]
        return c, R, parts

    def affine_part(self, node: Node, mode: np.ndarray) -> np.ndarray:
        """The linear function over the rest pose that is closest to a mode."""
        x = self.plan.rest[node.vertices] - self.plan.attach_point(self.plan.pieces[node.piece])
        moment, g = in_order(mode[:, None] * x), np.zeros(3)
        for w in self.plan.whitening(node):
            dot = (w[0] * moment[0] + w[1] * moment[1] + w[2] * moment[2]) / float(node.count)
            g = g + dot * w
        return g

    def map_of_shape(self, node: Node, piece: Piece, shape: np.ndarray) -> np.ndarray:
        modes = self.plan.basis(piece)[: self.plan.shape_modes(piece)]
        return in_order(np.array([shape[m][:, None] * self.affine_part(node, mode) for m, mode in enumerate(modes)]))


def row_extent(row) -> int:
    """The frequencies up to which a row is not all 0; None: no row."""
    return max((k + 1 for axis in row or () for k, number in enumerate(axis) if number != 0), default=0)


def predict_row(
    stream: LevelStream, frequencies: int, steps, ratios: list[int], track: np.ndarray, coarse
) -> list[list[int]]:
    """Integers that a track, (3, frames), would have in steps of the axes. None for `coarse`: not known; else predicted
    is what is not 0 there."""
    frames, count = track.shape[1], min(frequencies, len(stream.waves))
    units = in_order(stream.waves[:count].T[:, :, None] * track.T[:, None, :]) / steps  # (count, 3)
    row = zero_row(frames)
    for k in range(count):
        for axis in range(3):
            size, least = abs(float(units[k, axis])), 0.5 * ratios[axis] if coarse is None else 0.5
            if size >= least and (coarse is None or coarse[axis][k] != 0):
                nearest = MOST_PREDICTED if size >= MOST_PREDICTED else int(size + 0.5)
                row[axis][k] = -nearest if units[k, axis] < 0.0 else nearest
    return row


class Refinement(Pose):
    """All vertices of one segment in a layer that refines another. What a piece's rows are about is known once the
    pieces that it hangs on are placed: decoding and placing take turns."""

    def __init__(self, plan: Plan, motion: Motion, before: Pose):
        super().__init__(plan, motion)
        self.before = before

    def decode_stems(self, stream: bytes, level: int, ratio: int) -> None:
        """`ratio`: steps of the layer before over those of this one."""
        self.coder, self.model, self.ratio = RangeDecoder(stream), RefinementModel(), ratio
        self.stream = self.motion.streams[level]
        for piece in self.plan.pieces:
            self.decode_piece(piece)
            self.place_piece(piece)
        self.coder.finish()

    def decode_piece(self, piece: Piece) -> None:
        n, before, motion = piece.number, self.before, self.before.motion
        coarse_piece = before.plan.pieces[n]
        modes = range(len(before.plan.basis(coarse_piece)))
        rows = {m: motion.coefficients.get(piece.first + m) or zero_row(self.frames) for m in range(piece.count)}
        reach = [row_extent(rows[m]) for m in modes]
        frequencies = max(row_extent(motion.shift.get(n)), row_extent(motion.rotation.get(n)), *reach)
        streams = [self.stream, before.base_stream(coarse_piece), *(before.mode_stream(coarse_piece, m) for m in modes)]
        same = all(stream.root == self.stream.root for stream in streams)
        if frequencies > 0 and not same:
            frequencies = self.frames
        self.decode_tracks(piece, frequencies, same)
        known = max((m + 1 for m in modes if reach[m] > 0), default=0)
        if known > 0 and motion.shapes_of(piece):
            known = max(known, before.plan.shape_modes(coarse_piece))
        alike = bool(motion.shapes_of(piece)) == bool(self.motion.shapes_of(piece))
        self.decode_modes(piece, frequencies, min(known, len(self.plan.basis(piece))), rows if same and alike else None)

    def magnitudes(self, predicted, ratios: list[int], coarse):
        """In steps of the layer before."""
        if coarse is not None:
            return magnitudes(coarse)
        return [
            [clipped((abs(number) + ratio // 2) // ratio) for number in axis] for axis, ratio in zip(predicted, ratios)
        ]

    def coarse_tracks(self, piece: Piece) -> tuple[np.ndarray, np.ndarray]:
        """Translation and rotation as the layer before has them; of a rigid piece those that take the attach frame of
        this layer to where it was there."""
        before, coarse_piece = self.before, self.before.plan.pieces[piece.number]
        if not coarse_piece.rigid:
            return before.shift_track(coarse_piece), before.rotation_track(coarse_piece)
        (here, A), (c, R) = self.attach_frame(piece), before.kept[piece.number]
        turned = mat_mul(A.transpose(1, 0, 2), R)
        rotation, q = np.empty((3, self.frames)), np.array([1.0, 0.0, 0.0, 0.0])
        for t in range(self.frames):
            q = nearer_quaternion(turned[:, :, t].ravel(), q)
            rotation[:, t] = 4.0 * q[1:] / (1.0 + q[0])
        own = turning(self.plan, piece, self.base_stream(piece))
        turns = own is not None and own.axes is not None
        return c - here, mat_vec(own.axes[:, :, None], rotation) if turns else rotation

    def turn_ratios(self, piece: Piece, own: Turning) -> list[int]:
        before, coarse_piece = self.before, self.before.plan.pieces[piece.number]
        if not coarse_piece.rigid:
            return [self.ratio] * 3
        coarse = turning(before.plan, coarse_piece, before.base_stream(coarse_piece))
        ratios = (np.zeros(3) if coarse is None else coarse.steps) / own.steps + 0.5
        return [65535 if ratio >= 65535.0 else int(ratio) if ratio >= 1.0 else 1 for ratio in ratios]

    def decode_tracks(self, piece: Piece, frequencies: int, same: bool) -> None:
        before, n = self.before.motion, piece.number
        shift, rotation = self.coarse_tracks(piece)
        if piece.has_shift:
            step, ratios = shift_step(piece, self.stream), [self.ratio] * 3
            self.motion.shift[n] = self.decode_track(
                SHIFT_SLOT, frequencies, step, ratios, shift, before.shift.get(n), same
            )
        own = turning(self.plan, piece, self.stream)
        if own is not None:
            self.motion.rotation[n] = self.decode_track(
                ROTATION_SLOT,
                frequencies,
                own.steps,
                self.turn_ratios(piece, own),
                rotation,
                before.rotation.get(n),
                same,
            )

    def decode_track(self, slot: int, frequencies: int, steps, ratios: list[int], track: np.ndarray, row, same: bool):
        coarse = (row or zero_row(self.frames)) if same else None
        predicted = predict_row(self.stream, frequencies, steps, ratios, track, coarse)
        return decode_refined_row(
            self.coder,
            self.model,
            len(self.stream.waves),
            slot,
            predicted,
            ratios,
            self.magnitudes(predicted, ratios, coarse),
        ).row

    def decode_modes(self, piece: Piece, frequencies: int, known: int, coarse) -> None:
        """Rows of modes and shapes; `known`: modes that the layer before has, `coarse`: its rows, or None."""
        shapes, rank = self.motion.shapes_of(piece), len(self.plan.basis(piece))
        predicted, ratios = self.predict_modes(piece, frequencies, known, coarse), [self.ratio] * 3
        steps = [self.magnitudes(predicted[m], ratios, coarse and coarse[m]) for m in range(rank)]
        above = None
        for m in range(rank):
            if shapes and len(shapes) <= 3 * m < 3 * self.plan.shape_modes(piece):
                continue
            below = steps[m + 1] if m + 1 < rank else None
            above = decode_refined_row(
                self.coder, self.model, len(self.stream.waves), m, predicted[m], ratios, steps[m], below, above
            )
            self.motion.coefficients[piece.first + m] = above.row

    def predict_modes(self, piece: Piece, frequencies: int, known: int, coarse) -> list:
        """A row for each mode, from the vertices of the layer before, seen from the attach frame."""
        plan, basis, shapes = self.plan, self.plan.basis(piece), self.motion.shapes_of(piece)
        predicted = [zero_row(self.frames) for _ in basis]
        if known == 0:
            return predicted
        if shapes:
            known = max(known, plan.shape_modes(piece))
        c, R = self.turned_frames(piece)
        local = mat_vec(R.transpose(1, 0, 2), self.before.placed[piece.vertices] - c)
        local = local - plan.from_attach(piece)[:, :, None]
        weights = np.append(np.ones(piece.count - 1), tip_weight(plan, piece))
        tracks = np.array([in_order((mode * weights)[:, None, None] * local) for mode in basis[:known]])
        for m in range(known):
            track = tracks[m]
            if shapes and m < plan.shape_modes(piece):
                track = np.zeros((3, self.frames))
                for axis, shape in enumerate(shapes[3 * m : 3 * m + 3]):
                    weights = shape[: plan.shape_modes(piece)]
                    track[axis] = in_order((weights[:, :, None] * tracks[: len(weights)]).reshape(-1, self.frames))
            predicted[m] = predict_row(
                self.stream, frequencies, self.row_step(piece, m), [self.ratio] * 3, track, coarse and coarse[m]
            )
        return predicted


def nearer_quaternion(R: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Of a rotation, of the two the one nearer to the last; not from -1.0 to -0.9."""
    sizes = [1.0 + R[0] + R[4] + R[8], 1.0 + R[0] - R[4] - R[8], 1.0 - R[0] + R[4] - R[8], 1.0 - R[0] - R[4] + R[8]]
    x, y, z, xy, xz, yz = R[7] - R[5], R[2] - R[6], R[3] - R[1], R[1] + R[3], R[2] + R[6], R[5] + R[7]
    largest = max(range(4), key=lambda i: sizes[i])  # the first of equals
    p = np.array([[sizes[0], x, y, z], [x, sizes[1], xy, xz], [y, xy, sizes[2], yz], [z, xz, yz, sizes[3]]][largest])
    q = p * ((-1.0 if in_order(p * last) < 0.0 else 1.0) / np.sqrt(in_order(p * p)))
    return -q if q[0] < -0.9 else q


def follow_tangent(R: np.ndarray, tangent: np.ndarray, v: np.ndarray) -> np.ndarray:
    """R, turned by the least rotation that takes R tangent to v; beyond a right angle by less and less."""
    u = mat_vec(R, tangent)
    u2 = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    u = u * (1.0 / np.sqrt(np.where(u2 > 1e-200, u2, 1.0)))
    v2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    v = v * (1.0 / np.sqrt(np.where(v2 > 1e-200, v2, 1.0)))
    cosine = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    w, sine2 = 1.0 + np.where(cosine > 0.0, cosine, 0.0), x * x + y * y + z * z
    h = 2.0 / (w * w + sine2)
    g, c = w * h, 1.0 - h * sine2
    return mat_mul(
        matrix(
            c + h * x * x,
            h * x * y - g * z,
            h * x * z + g * y,
            h * x * y + g * z,
            c + h * y * y,
            h * y * z - g * x,
            h * x * z - g * y,
            h * y * z + g * x,
            c + h * z * z,
        ),
        R,
    )


def turn_to(H: np.ndarray, steps: int, R: np.ndarray) -> np.ndarray:
    """R, turned towards the rotation nearest to H; R itself where H vanishes."""
    norm2 = in_order((H * H).reshape(9, -1))
    turns = norm2 > 1e-200
    unit, turned = H * (1.0 / np.sqrt(np.where(turns, norm2, 1.0))), R
    for _ in range(steps):
        turned = turn_towards(unit, turned)
    return np.where(turns, turned, R)


def turn_towards(H: np.ndarray, R: np.ndarray) -> np.ndarray:
    """A step of Newton's method towards the rotation nearest to H, of norm 1; damped where R is far off."""
    C = H[:, None, 0] * R[None, :, 0] + H[:, None, 1] * R[None, :, 1] + H[:, None, 2] * R[None, :, 2]
    C = C.reshape(9, -1)
    wx, wy, wz = C[7] - C[5], C[2] - C[6], C[3] - C[1]
    trace = C[0] + C[4] + C[8]
    most = np.where(trace > 1.0, trace, 1.0) + 1e-6
    a, b, c = most - C[0], most - C[4], most - C[8]
    d, e, f = -0.5 * (C[1] + C[3]), -0.5 * (C[2] + C[6]), -0.5 * (C[5] + C[7])
    xx, xy, xz = b * c - f * f, e * f - d * c, d * f - e * b
    yy, yz, zz = a * c - e * e, d * e - a * f, a * b - d * d
    scale = 0.25 / (a * xx + d * xy + e * xz)
    x = (xx * wx + xy * wy + xz * wz) * scale
    y = (xy * wx + yy * wy + yz * wz) * scale
    z = (xz * wx + yz * wy + zz * wz) * scale
    return mat_mul(rotation(x, y, z), R)


# ---- static data -------------------------------------------------------------------------------------------

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
ZSTD_WINDOW = 8 << 20
# Kinds of Item_Type: NumPy's letter, and what Item_Bytes may be.
ITEM_KINDS = (
    ("b", (1,)),
    ("u", (1, 2, 4, 8)),
    ("i", (1, 2, 4, 8)),
    ("f", (2, 4, 8)),
    ("c", (8, 16)),
    ("S", range(1, 1 + (1 << 20))),
    ("V", range(1, 1 + (1 << 20))),
)


def parse_json(text: bytes, what: str) -> dict:
    """A JSON object as of FORMAT.md, "JSON"."""

    def unique(pairs: list) -> dict:
        require(len(dict(pairs)) == len(pairs), f"{what}: an object has a member twice")
        return dict(pairs)

    def number(literal: str) -> float:
        require(finite(float(literal)), f"{what}: {literal} is not finite")
        return float(literal)

    try:
        value = json.loads(text.decode("utf-8"), object_pairs_hook=unique, parse_float=number, parse_constant=number)
        json.dumps(value, ensure_ascii=False).encode("utf-8")  # refuses halves of surrogate pairs
    except (ValueError, RecursionError):
        raise AthError("BAD_CHUNK", f"{what}: is not JSON") from None
    require(isinstance(value, dict), f"{what}: is no JSON object")
    return value


def zstd_window(data: bytes) -> int:
    """Window_Size that a frame header asks for (RFC 8878, 3.1.1.1.2); 0 where it is the content's size."""
    if len(data) < 6 or (data[4] & 0x20):  # Single_Segment_flag
        return 0
    exponent, mantissa = data[5] >> 3, data[5] & 7
    return (1 << (10 + exponent)) + ((1 << (10 + exponent)) >> 3) * mantissa


def unzstd(data: bytes, size: int | None, what: str, limit: int) -> bytes:
    """One zstd frame that states its size, which must be `size` where that is known."""
    require(data[:4] == ZSTD_MAGIC, f"{what}: is no zstd frame")
    most = max(ZSTD_WINDOW, size or 0)
    require(zstd_window(data) <= most, f"{what}: has a zstd window of more than {most} bytes", "LIMIT_EXCEEDED")
    try:
        stated = zstandard.frame_content_size(data)
    except zstandard.ZstdError:
        raise AthError("BAD_CHUNK", f"{what}: has a bad zstd frame header") from None
    require(stated > 0 and stated == (stated if size is None else size), f"{what}: has a zstd frame of another size")
    require(stated <= limit, f"{what}: unpacks to too much", "LIMIT_EXCEEDED")
    try:
        unpacked = zstandard.ZstdDecompressor().decompress(data, allow_extra_data=False)
    except (zstandard.ZstdError, MemoryError):
        raise AthError("BAD_CHUNK", f"{what}: has a zstd frame that does not decode") from None
    require(len(unpacked) == stated, f"{what}: has a zstd frame that misstates its size")
    return unpacked


def unshuffle(data: bytes, size: int) -> bytes:
    """Elements of `size` bytes from planes: all first bytes, then all second ones, and so on."""
    return np.frombuffer(data, np.uint8).reshape(size, -1).T.tobytes()


def item_type(code: int, size: int, what: str) -> np.dtype:
    """Of Item_Type and Item_Bytes, as NumPy's."""
    kind, big_endian = code & 7, code >> 3
    require(kind < len(ITEM_KINDS) and big_endian <= 1, f"{what}: has an unknown type")
    letter, sizes = ITEM_KINDS[kind]
    require(size in sizes, f"{what}: has elements of {size} bytes")
    require(not big_endian or letter in "uifc" and size > 1, f"{what}: has a byte order without numbers")
    return np.dtype(f"{'<>'[big_endian]}{letter}{size}")


def parse_array(chunk: bytes, what: str, limits: Limits) -> tuple[str, np.ndarray]:
    """Name and array of ATTRIBUTE."""
    require(len(chunk) >= 8, f"{what}: is too short")
    dimensions, length, size = chunk[1], u16(chunk, 2), u32(chunk, 4)
    start = 8 + 4 * dimensions
    require(start + length <= len(chunk), f"{what}: is too short for its shape and name")
    kind, body = item_type(chunk[0], size, what), chunk[start + length :]
    name = array_name(chunk[start : start + length], what, limits)
    require(dimensions <= 32, f"{what}: has too many dimensions")
    shape = [u32(chunk, at) for at in range(8, start, 4)]
    widest = math.prod(n or 1 for n in shape) * size
    require(widest <= limits.decoded_chunk_bytes, f"{what}: is too large", "LIMIT_EXCEEDED")
    if math.prod(shape) == 0:
        require(len(body) == 0, f"{what}: has data though it has no elements")
        return name, np.zeros(shape, kind)
    data = unshuffle(unzstd(body, widest, what, limits.decoded_chunk_bytes), size)
    return name, np.frombuffer(data, kind).reshape(shape)


def array_name(text: bytes, what: str, limits: Limits) -> str:
    require(len(text) <= limits.string_bytes, f"{what}: has too long a name", "LIMIT_EXCEEDED")
    require(len(text) > 0, f"{what}: has no name")
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        raise AthError("BAD_CHUNK", f"{what}: has a name that is not UTF-8") from None


def parse_metadata(chunk: bytes, limits: Limits) -> bytes:
    """Text of METADATA."""
    require(len(chunk) > 0 and chunk[0] <= 1, "METADATA has an unknown Method")
    text = chunk[1:] if chunk[0] == 0 else unzstd(chunk[1:], None, "METADATA", limits.metadata_bytes)
    require(len(text) <= limits.metadata_bytes, "METADATA is too long", "LIMIT_EXCEEDED")
    parse_json(text, "METADATA")
    return text


# ---- a file ------------------------------------------------------------------------------------------------


class AthFile:
    """An opened file. What is wrong with it is an AthError when it is opened, in the order of FORMAT.md,
    "Opening", or asked.

    strict: it has to be as long as it says. Else what has arrived of it, at least the prelude, is decoded.
    """

    def __init__(self, data: bytes, strict: bool = False, limits: Limits | None = None):
        self.data, self.limits = bytes(data), limits or Limits()
        self.header, self.chunks, self.errors, self.joins, self.repeats = read_front(self.data, self.limits)
        self.file_length = self.chunks[-1].offset + self.chunks[-1].length
        self._places = {(c.kind, c.level, c.segment): c for c in self.chunks if not c.repeatable}
        self._check_length(strict)
        self._check_memory(-(-self.header.frame_count // self.header.segment_count))
        self.clips = self._read_clips()
        lengths = [frames for clip in self.clips for frames in clip.segment_lengths]
        self._check_memory(max(lengths))
        self._shown_frames = self._read_repeats(lengths)
        self._segment_lengths = [shown[-1] + 1 for shown in self._shown_frames]  # of frames that are coded
        with np.errstate(all="ignore"):  # infinities and NaN are results like others
            self._read_hierarchy(self.content(HIERARCHY))
            self._check_motion_chunks()
            self._check_joins()
            self._read_rest(self.content(REST))
            self.times = frame_times(self.content(TIME), self.clips)

    def _check_length(self, strict: bool) -> None:
        behind = [c.offset for c in self.chunks if c.key[0] > 0]
        require(len(self.data) >= min(behind, default=self.file_length), "ends inside its prelude", "TRUNCATED")
        if strict:
            require(len(self.data) >= self.file_length, "is shorter than File_Length", "TRUNCATED")
            require(len(self.data) <= self.file_length, "is longer than File_Length", "TRAILING_BYTES")

    def _check_memory(self, segment_frames: int) -> None:
        require(
            self.header.vertex_count * (60 * segment_frames + 512) <= self.limits.memory_bytes,
            "needs too much memory",
            "LIMIT_EXCEEDED",
        )

    def is_available(self, chunk: Chunk) -> bool:
        return chunk.offset + chunk.length <= len(self.data)

    def bytes_of(self, chunk: Chunk) -> bytes:
        require(self.is_available(chunk), f"{chunk} has not arrived", "TRUNCATED")
        content = self.data[chunk.offset : chunk.offset + chunk.length]
        require(crc32c(content) == chunk.checksum, f"{chunk} is damaged", "BAD_CHECKSUM")
        return content

    def find(self, kind: int, level: int = NO_LEVEL, segment: int = 0) -> Chunk | None:
        return self._places.get((kind, level, segment))

    def content(self, kind: int, level: int = NO_LEVEL, segment: int = 0) -> bytes:
        chunk = self.find(kind, level, segment)
        require(chunk is not None, f"the chunk table lacks {KINDS[kind]}", "BAD_CHUNK_TABLE")
        return self.bytes_of(chunk)

    # Prelude.

    def _read_clips(self) -> list[Clip]:
        if self.header.clip_count == 1 and not self.find(CLIPS):
            return [Clip(self.header.frame_count, self.header.segment_count)]
        return read_clips(self.content(CLIPS), self.header)

    def _read_repeats(self, lengths: list[int]) -> list[list[int]]:
        """Of each segment which of its coded frames each frame shows."""
        segments, start = [], 0
        for frames in lengths:
            own = self.repeats[start : start + frames]
            require(not own[0], "the first frame of a segment is a repeat", "BAD_CHUNK_TABLE")
            segments.append([t - sum(own[: t + 1]) for t in range(frames)])
            start += frames
        return segments

    def _read_hierarchy(self, chunk: bytes) -> None:
        require(len(chunk) >= 8, "HIERARCHY is too short")
        for name, at in (("Epsilon", 0), ("Xi", 2)):
            require(u16(chunk, at) < SHORT_FLOATS, f"{name} is no short float")
        self.branches, self.branch_source, self.vertex_source = decode_hierarchy(
            chunk[8:], self.header.branch_count, self.header.vertex_count
        )
        deepest = max(branch.depth for branch in self.branches)
        require(deepest + 1 <= self.limits.hierarchy_depth, "branches are nested too deep", "LIMIT_EXCEEDED")
        self.plan = Plan(self.branches, self.header.is_predicted)
        require(
            self.header.full_level_count in (self.lossy_levels, self.lossy_levels + 1)
            and (self.plan.height == 0 or not self.header.is_predicted),
            "Full_Level_Count is not that of the hierarchy and its layers",
            "BAD_HEADER",
        )

    def _check_motion_chunks(self) -> None:
        """FORMAT.md, "Levels and chunks"."""
        plan, predicted, wanted, allowed = self.plan, self.header.is_predicted, set(), set()
        for level in range(self.header.level_count):
            for s in range(self.header.segment_count):
                wanted |= {(STEMS, level, s)} if self._has_stems(level) else set()
                maps = {(AFFINES, level, s)} if plan.has_affines(level, level) else set()
                wanted |= set() if predicted else maps
                wanted |= {(PREDICTED, level, s)} if predicted and level == 1 else set()
                wanted |= {(EXACT, level, s)} if level == self.lossy_levels else set()
                corrections = plan.height < level < self.lossy_levels and not predicted
                allowed |= {(CORRECTIONS, level, s)} if corrections else maps
            allowed |= {(SHAPES, level, 0)} if self._has_stems(level) else set()
            allowed |= {(REFINED_REST, level, 0)} if self._may_refine_rest(level) else set()
        there = {(c.kind, c.level, c.segment) for c in self.chunks if c.is_motion and c.kind in KINDS}
        require(
            wanted <= there <= (wanted | allowed),
            "motion chunks are not those that the hierarchy asks for",
            "BAD_CHUNK_TABLE",
        )

    def _segment_before(self, s: int) -> int | None:
        """In its clip; before the first of a loop of several segments the last."""
        first = 0
        for clip in self.clips:
            if s < first + clip.segments:
                break
            first += clip.segments
        if s > first:
            return s - 1
        return first + clip.segments - 1 if clip.seams is not None and clip.segments > 1 else None

    def _check_joins(self) -> None:
        levels = 1 if self.header.is_predicted else self.lossy_levels
        for level, row in enumerate(self.joins):
            for s, join in enumerate(row):
                before = self._segment_before(s)
                goes_on = before is not None and self._segment_lengths[before] >= 2
                fits = level < levels and join.width <= self._segment_lengths[s] - 2
                require(
                    join.width == 0 or (fits and goes_on),
                    f"level {level}, segment {s}: a join of {join.width} frames cannot be",
                    "BAD_CHUNK_TABLE",
                )

    def _read_rest(self, chunk: bytes) -> None:
        require(len(chunk) >= 17, "REST is too short")
        known = REST_EXACT | REST_FLOAT64 | REST_ADAPTIVE | REST_CONNECTED
        require(chunk[0] == IS_HOST or (chunk[0] & ~known) == 0, "Method has reserved bits, or others beside Is_Host")
        require((chunk[0] & REST_EXACT) == 0 or (chunk[0] & REST_ADAPTIVE) == 0, "a rest pose is exact and adaptive")
        is_connected = (chunk[0] & REST_CONNECTED) != 0
        require(
            (chunk[0] & (REST_EXACT | IS_HOST)) == 0 or not self.find(SOURCE_REST),
            "there is a second rest pose, though the first is exact",
        )
        require(
            not is_connected or (chunk[0] & (REST_EXACT | REST_ADAPTIVE)) != 0,
            "a connected rest pose is coded by steps",
        )
        self.origin = np.array([f32(chunk, 1 + 4 * k) for k in range(3)])
        step = f32(chunk, 13)
        require(np.isfinite(self.origin).all() and finite(step) and step > 0.0, "Origin or Rest_Step is out of range")
        self.rest_type = np.dtype("<f8" if chunk[0] & REST_FLOAT64 else "<f4")
        self._shown_rest: np.ndarray | None = None
        self._rests: list[RestLayer] = []  # and those that refine it; none where it is exact
        self._plans: list[Plan] = []  # of the layers, from level 1 on
        if chunk[0] == IS_HOST:
            require(len(chunk) == 17 + 8, "Rest_Body is not two checksums")
            self.mesh_checksums = u32(chunk, 17), u32(chunk, 21)
            return  # until there is a mesh
        self._mesh = self._read_mesh() if is_connected else None
        if (chunk[0] & REST_EXACT) == 0:
            self._is_adaptive = (chunk[0] & REST_ADAPTIVE) != 0
            coded = decode_rest(chunk[17:], self.branches, step, None, self._is_adaptive, self._mesh)
            self._rests = [coded]
            rest = np.array(coded.rest)
            self._set_rest(rest, rest + self.origin)
        else:
            is_float64 = bool(chunk[0] & REST_FLOAT64)
            shown = np.array(decode_exact_rest(chunk[17:], self.branches, is_float64, self._mesh))
            self._set_rest(shown - self.origin, shown)

    def _read_mesh(self) -> Mesh:
        """What FACES say of a connected rest pose."""
        require(self.find(FACES) is not None, "FACES are missing", "BAD_CHUNK_TABLE")
        shape, stream = parse_polygons(self.content(FACES), FACES, self.limits)
        vertex_count = len(self.vertex_source)
        few = shape.face_count <= 4 * vertex_count and shape.corner_count <= 8 * vertex_count
        require(few, "FACES have too many faces or corners for a rest pose")
        counts, corners = decode_polygons(stream, shape, vertex_count)
        return build_mesh(counts, corners, list(self.vertex_source))

    def _set_rest(self, rest: np.ndarray, shown: np.ndarray) -> None:
        self.plan.rest = rest
        self._shown_rest = shown.astype(self.rest_type)

    def set_host_mesh(self, mesh: bytes) -> None:
        """Of a file whose rest pose is the host's mesh: its positions, binary32 in source order."""
        require(len(mesh) == 12 * len(self.vertex_source), "the mesh has other vertices", "WRONG_HOST_MESH")
        bits = np.frombuffer(mesh, "<u4").reshape(-1, 3)
        bits = np.where(bits == (1 << 31), 0, bits).astype("<u4")  # 0.0 for -0.0
        require(
            bool(np.isfinite(bits.view("<f4")).all()), "the mesh has numbers that are not finite", "WRONG_HOST_MESH"
        )
        data = bits.tobytes()
        checksums = crc32c(data), crc32c(data[::-1])
        require(checksums == self.mesh_checksums, "the mesh has other checksums", "WRONG_HOST_MESH")
        shown = bits.view("<f4")[self.vertex_source].astype(np.float64)
        with np.errstate(all="ignore"):
            self._set_rest(shown - self.origin, shown)

    # Layers: level h + 1 + q is that of layer q, those below are of layer 0 as well.

    @property
    def lossy_levels(self) -> int:
        return self.plan.height + 1 + self.header.layer_count

    def _layer_of(self, level: int) -> int:
        return max(min(level, self.lossy_levels - 1) - self.plan.height - 1, 0)

    def _has_stems(self, level: int) -> bool:
        return self.plan.has_stems(level) or self.plan.height + 1 < level < self.lossy_levels

    def _may_refine_rest(self, level: int) -> bool:
        """Level 1 may where nothing of level 0 serves other levels."""
        plan = self.plan
        alone = self.header.layer_count > 1 and not plan.has_stems(0) and not plan.has_affines(0, 1)
        return plan.height + 1 < level < self.lossy_levels or (level == 1 and alone)

    def _plan_of(self, level: int, q: int) -> Plan:
        """That of a layer, on its own rest pose, as it serves to show a level."""
        require(self._shown_rest is not None, "no mesh of the host has been given", "NEEDS_HOST_MESH")
        if level == 0:
            return self.plan
        for layer in range(len(self._plans), q + 1):
            place = self.plan.height + 1 + layer if layer > 0 else 1
            plan = self._plans[-1].refined(self.branches, place, layer) if layer > 0 else self.plan
            if self.find(REFINED_REST, place):
                plan = plan if layer > 0 else Plan(self.branches)
                plan.rest = self._refined_rest(self.content(REFINED_REST, place))
            self._plans.append(plan)
        return self._plans[q]

    def _refined_rest(self, chunk: bytes) -> np.ndarray:
        require(len(chunk) >= 4 and finite(f32(chunk, 0)) and f32(chunk, 0) > 0.0, "Rest_Step is out of range")
        require(self._rests != [], "a rest pose that is exact is refined")
        self._rests.append(
            decode_rest(chunk[4:], self.branches, f32(chunk, 0), self._rests[-1], self._is_adaptive, self._mesh)
        )
        rest = np.array(self._rests[-1].rest)
        return rest

    def rest(self, level: int = 0) -> np.ndarray:
        """(vertices, 3) of Rest_Type, source order: the rest pose, as a level's reference pose gives it."""
        if not self.find(SOURCE_REST):
            return self.level_rest(level)
        chunk = self.content(SOURCE_REST)
        require(len(chunk) >= 1 and chunk[0] <= 1, "Method has reserved bits")
        if chunk[0] == 1:
            with np.errstate(over="ignore"):
                exact = decode_exact_rest(chunk[1:], self.branches, self.rest_type == np.dtype("<f8"))
            return self._in_source_order(np.array(exact).astype(self.rest_type))
        require(len(chunk) >= 5 and finite(f32(chunk, 1)) and f32(chunk, 1) > 0.0, "Rest_Step is out of range")
        with np.errstate(all="ignore"):
            reference = self._plan_of(level, self._layer_of(level)).rest
            bent = BentPose(chunk[5:], self.branches, f32(chunk, 1), reference).rest[:, :, 0]
            return self._in_source_order((bent + self.origin).astype(self.rest_type))

    def level_rest(self, level: int = 0) -> np.ndarray:
        """(vertices, 3) of Rest_Type, source order: the reference pose, which the level moves."""
        plan = self._plan_of(level, self._layer_of(level))
        if plan.rest is self.plan.rest:
            return self._in_source_order(self._shown_rest)
        with np.errstate(over="ignore"):
            return self._in_source_order((plan.rest + self.origin).astype(self.rest_type))

    def _in_source_order(self, by_vertex: np.ndarray) -> np.ndarray:
        out = np.empty_like(by_vertex)
        out[self.vertex_source] = by_vertex
        return out

    # Motion.

    @property
    def position_type(self) -> np.dtype:
        return np.dtype("<f8" if self.header.is_float64 else "<f4")

    @cached_property
    def deepest(self) -> int:
        """The deepest complete level."""
        late = [c.level for c in self.chunks if c.is_motion and c.kind in KINDS and not self.is_available(c)]
        complete = min(late, default=self.header.level_count) - 1
        require(complete >= 0, "not even level 0 has arrived", "TRUNCATED")
        return complete

    def positions(self, level: int | None = None) -> np.ndarray:
        """(frames, vertices, 3) in source order, the frames of all clips, of the deepest complete level or
        the one named."""
        level = self.deepest if level is None else level
        if not 0 <= level < self.header.level_count:
            raise ValueError(f"level {level}: the file has 0 to {self.header.level_count - 1}")
        for s in range(self.header.segment_count):
            for chunk in self._needed(s, level):
                require(self.is_available(chunk), f"{chunk} has not arrived", "TRUNCATED")
        with np.errstate(all="ignore"):
            segments = [self._segment(s, level)[..., shown] for s, shown in enumerate(self._shown_frames)]
        return np.ascontiguousarray(self._in_source_order(np.concatenate(segments, axis=2)).transpose(2, 0, 1))

    def _segment(self, s: int, level: int) -> np.ndarray:
        """(vertices, 3, frames) in file order, of the frames that are coded."""
        frames, shown = self._segment_lengths[s], min(level, self.lossy_levels - 1)
        if self.header.is_predicted and shown > 0:
            chunk = self.content(PREDICTED, shown, s)
            coded = Prediction(chunk, self.branches, self.plan.rest, self.origin, self.position_type)
            positions = coded.decode(frames)
        else:
            positions = self._corrected(s, shown, self._joined(s, shown))
        return decode_exact(self.content(EXACT, level, s), positions) if level > shown else positions

    def _joined(self, s: int, shown: int) -> np.ndarray:
        """A segment as it goes on from the one before it."""
        join = self.joins[shown][s]
        if join.width == 0:
            return self._layers(s, shown)[1]
        before, positions = self._layers(self._segment_before(s), shown)
        end = End({n: tuple(y[..., -2:] for y in own) for n, own in before.maps.items()}, positions[..., -2:])
        pose, positions = self._layers(s, shown, join, end)
        exact = pose.is_exact
        positions[exact] = join.apply(end.positions[exact], positions[exact])
        return positions

    def _layers(self, s: int, shown: int, join: Join = NO_JOIN, end: End | None = None) -> tuple[Pose, np.ndarray]:
        """The deepest layer shown, and (vertices, 3, frames) as output. end: what maps of nodes are joined to."""
        frames = self._segment_lengths[s]
        pose = self._first_layer(s, frames, min(shown, self.plan.height + 1), join, end)
        for q in range(1, self._layer_of(shown) + 1):
            pose = self._refinement(s, frames, q, pose)
        return pose, (pose.placed + self.origin[:, None]).astype(self.position_type)

    def _corrected(self, s: int, shown: int, positions: np.ndarray) -> np.ndarray:
        if self.find(CORRECTIONS, shown, s):
            chunk = self.content(CORRECTIONS, shown, s)
            require(len(chunk) >= 4 and finite(f32(chunk, 0)) and f32(chunk, 0) > 0.0, "Correction_Step is not above 0")
            parts = corrected_parts(decode_corrections(chunk[4:], self.header.vertex_count, positions.shape[2]))
            added = parts.astype(float) * (f32(chunk, 0) / 32.0)
            positions = np.where(parts != 0, (positions.astype(float) + added).astype(self.position_type), positions)
        return positions

    def _needed(self, s: int, level: int, with_end: bool = True) -> list[Chunk]:
        """Chunks that playing a segment at a level takes, with those of the end that it goes on from."""
        places = [(CORRECTIONS, min(level, self.lossy_levels - 1), s), (EXACT, level, s)]
        for d in range(level + 1):
            places += [(SHAPES, d, 0), (REFINED_REST, d, 0), (STEMS, d, s), (PREDICTED, d, s)]
            places += [(AFFINES, d, s)] if self.plan.has_affines(d, level) else []
        needed = [self._places[place] for place in places if place in self._places]
        if self.joins[min(level, self.lossy_levels - 1)][s].width == 0 or not with_end:
            return needed
        end = self._needed(self._segment_before(s), level, with_end=False)
        return needed + [chunk for chunk in end if chunk.kind not in (CORRECTIONS, EXACT)]

    def _is_periodic(self, s: int) -> bool:
        return [clip.periodic for clip in self.clips for _ in range(clip.segments)][s]

    def _first_layer(self, s: int, frames: int, level: int, join: Join, end: End | None) -> Pose:
        """All vertices of a segment at a level of the branch hierarchy."""
        plan, motion = self._plan_of(level, 0), Motion(frames, self._is_periodic(s))
        for d in range(level + 1):
            if self.find(SHAPES, d):
                decode_shapes(self.content(SHAPES, d), plan, motion, d)
            if plan.has_stems(d):
                decode_stems(read_stems_head(self.content(STEMS, d, s), motion, d), plan, motion, d)
            if plan.has_affines(d, level) and self.find(AFFINES, d, s):
                decode_affines(self.content(AFFINES, d, s), plan, motion, d)
        pose = Pose(plan, motion)
        pose.place_level(level, join, end)
        return pose

    def _refinement(self, s: int, frames: int, q: int, before: Pose) -> Refinement:
        """All vertices of a segment in a layer, from those of the layer before."""
        level = self.plan.height + 1 + q
        plan = self._plan_of(level, q)
        motion = Motion(frames, self._is_periodic(s), dict(before.motion.streams))
        if self.find(SHAPES, level):
            chunk = self.content(SHAPES, level)
            require(len(chunk) >= 1 and chunk[0] <= MOST_SHIFT, "Shift of SHAPES is out of range")
            decode_refined_shapes(chunk[1:], plan, motion, before.motion, chunk[0])
        chunk = self.content(STEMS, level, s)
        require(len(chunk) >= 2 and u16(chunk, 0) >= 1, "Ratio of STEMS is 0")
        pose = Refinement(plan, motion, before)
        pose.decode_stems(read_stems_head(chunk[2:], motion, level), level, u16(chunk, 0))
        return pose

    # Static data.

    def metadata_text(self) -> bytes:
        """Text of METADATA, b"{}" where there is none."""
        return parse_metadata(self.content(METADATA), self.limits) if self.find(METADATA) else b"{}"

    def metadata(self) -> dict:
        return parse_json(self.metadata_text(), "METADATA")

    def _polygons(self, kind: int) -> tuple[PolygonShape, list[int], list[int]] | None:
        """Their head, numbers of corners, and vertices."""
        if not self.find(kind):
            return None
        shape, stream = parse_polygons(self.content(kind), kind, self.limits)
        if shape.is_derived:
            return shape, [], []
        return shape, *decode_polygons(stream, shape, self.header.vertex_count)

    def faces(self) -> np.ndarray | None:
        """Those with as many corners as each other."""
        found = self._polygons(FACES)
        if found is None or found[0].count_type is not None:
            return None
        shape, _, corners = found
        return np.array(corners, shape.dtype(shape.index_type)).reshape(shape.face_count, shape.columns)

    def _mixed_faces(self) -> dict[str, np.ndarray]:
        found = self._polygons(FACES)
        if found is None or found[0].count_type is None:
            return {}
        shape, counts, corners = found
        return {
            "face_vertex_counts": np.array(counts, shape.dtype(shape.count_type)),
            "face_vertex_indices": np.array(corners, shape.dtype(shape.index_type)),
        }

    def edges(self) -> np.ndarray | None:
        found = self._polygons(EDGES)
        if found is None:
            return None
        shape, _, corners = found
        dtype = shape.dtype(shape.index_type)
        if shape.is_derived:
            return self._derived_edges(dtype)
        return np.array(corners, dtype).reshape(shape.face_count, 2)

    def _derived_edges(self, dtype: np.dtype) -> np.ndarray:
        """An edge from each vertex to the one before it on its stem, or to the attach vertex."""
        require(np.iinfo(dtype).max >= self.header.vertex_count - 1, "the type of derived edges is too small")
        pairs = []
        for branch in self.branches:
            for v in range(branch.first, branch.first + branch.count):
                before = v - 1 if v > branch.first else branch.attach
                if before >= 0:
                    pairs.append((self.vertex_source[before], self.vertex_source[v]))
        pairs.sort(key=lambda pair: pair[1])
        return np.array(pairs, dtype).reshape(-1, 2)

    def attributes(self) -> dict[str, np.ndarray]:
        """Named arrays, of those that have arrived."""
        arrays = self._mixed_faces()
        for chunk in self.chunks:
            if chunk.kind != ATTRIBUTE or not self.is_available(chunk):
                continue
            require(len(arrays) < self.limits.attributes, "there are too many attributes", "LIMIT_EXCEEDED")
            name, array = parse_array(self.bytes_of(chunk), "ATTRIBUTE", self.limits)
            require(name not in arrays, "two attributes have the same name")
            arrays[name] = array
            total = sum(array.nbytes for array in arrays.values())
            require(total <= self.limits.memory_bytes, "attributes are too large", "LIMIT_EXCEEDED")
        return arrays

    def static_bytes(self) -> bytes:
        """Static data one after the other: Text of METADATA, then the elements of all arrays in file
        order."""
        arrays = [self.faces(), self.edges(), *self.attributes().values()]
        text = self.metadata_text() if self.find(METADATA) else b""
        return text + b"".join(array.tobytes() for array in arrays if array is not None)


# ---- command -----------------------------------------------------------------------------------------------


def raw(file: AthFile, what: str, mesh: bytes | None = None) -> bytes:
    """The answer to an item of conformance.py."""
    if what in ("strict", "open"):
        return b""
    if what == "static":
        return file.static_bytes()
    if what == "time":
        return np.concatenate(file.times).astype("<f8").tobytes()
    if what == "clips":
        return b"".join(replace(clip, periodic=False).entry() for clip in file.clips)  # how it is coded is no answer
    if mesh is not None:
        file.set_host_mesh(mesh)
    return (file.rest() if what == "rest" else file.positions(int(what))).tobytes()


def mesh_in(path: str | None) -> bytes | None:
    if path is None:
        return None
    with open(path, "rb") as source:
        return source.read()


def show(options: argparse.Namespace, data: bytes) -> None:
    file = AthFile(data, strict=options.strict)
    if options.host_mesh:
        file.set_host_mesh(mesh_in(options.host_mesh))
    level = file.deepest if options.level is None else options.level
    positions = file.positions(level)
    frames, vertices, _ = positions.shape
    print(f"{frames} frames of {vertices} vertices, {positions.dtype}, level {level} of {file.header.level_count - 1}")
    for clip in file.clips if file.find(CLIPS) else ():
        print(f"{clip.name!r}: {clip.frames} frames" + (", a loop" if clip.seams is not None else ""))
    if options.checksum:
        print(f"{crc32c(positions.tobytes()):08x}")
    if options.out:
        np.save(options.out, positions)


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Decodes a level of an .ath file as FORMAT.md says.")
    parser.add_argument("file")
    parser.add_argument("what", nargs="?", help=argparse.SUPPRESS)
    parser.add_argument("mesh", nargs="?", help=argparse.SUPPRESS)
    parser.add_argument("--level", type=int, help="by default the deepest complete one")
    parser.add_argument("--strict", action="store_true", help="the file has to be as long as it says")
    parser.add_argument("--out", help="write the positions, (frames, vertices, 3), to this .npy file")
    parser.add_argument("--checksum", action="store_true", help="print their CRC-32C, little-endian, source order")
    parser.add_argument("--host-mesh", help="positions of the mesh that is the rest pose: binary32, little-endian")
    parser.add_argument("--raw", action="store_true", help="answer as spec/conformance.py asks: FILE WHAT [MESH]")
    options = parser.parse_args(words)
    try:
        with open(options.file, "rb") as source:
            data = source.read()
        if options.raw:
            what = options.what or "open"
            sys.stdout.buffer.write(raw(AthFile(data, strict=what == "strict"), what, mesh_in(options.mesh)))
        else:
            show(options, data)
    except (AthError, OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
