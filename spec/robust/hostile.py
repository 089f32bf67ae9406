"""Files that are cut short, too long, damaged, or made to do harm: each is refused in one line or plays within limits.

Every prefix, every bit and every field of every small valid file, as far as the time goes; with the checksums as they
are, damage has to be refused, with checksums repaired it may play as something else. Files made to be slow cost a
decoder no more per byte than others do. Runs through the Python package, in processes of their own.
"""

from __future__ import annotations

import struct
import sys
import time
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np

import athcodec
from athcodec import container as ct
from athcodec._native import crc32c
from athcodec.container import Container, Limits
from athcodec.errors import FormatError, NotAnAthFile, TrailingBytes, Truncated
from spec.robust import Row, _cases
from spec.robust._cases import Cases, Wrong

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests"))  # what the tests have for making files and using all of one

import hostile_files  # noqa: E402
from files import with_checksum  # noqa: E402
from fuzz import seeds  # noqa: E402
from test_damage import corrupted_front, mutations, struct_fields, use  # noqa: E402

VECTORS = ROOT / "spec" / "vectors" / "valid"
SMALL = 4096
LIMITS = Limits(memory_bytes=64 << 20, decoded_chunk_bytes=16 << 20)


def valid_files() -> dict[str, bytes]:
    vectors = {path.stem: path.read_bytes() for path in sorted(VECTORS.glob("*.ath"))}
    return seeds.valid_files() | {name: data for name, data in vectors.items() if len(data) <= seeds.LARGEST}


# ---- what a case may come to ----


def refused(data: bytes, expected: type[FormatError] | tuple = FormatError, **options) -> None:
    try:
        athcodec.open(BytesIO(data), **options).check()
    except expected as error:
        if "\n" in str(error):
            raise Wrong(f"got more than one line: {error}") from None
        return
    raise Wrong("got accepted; expected a refusal")


def within_limits(data: bytes) -> int:
    """Uses the file in every way; the memory that this may take."""
    use(data, limits=LIMITS)
    return 2 * LIMITS.memory_bytes + _whole_clip(data)


def _whole_clip(data: bytes) -> int:
    """Bytes of all positions, which `use` asks for as doubles."""
    try:
        header = Container(BytesIO(data), limits=LIMITS).header
    except FormatError:
        return 0
    return 2 * 24 * header.vertex_count * header.frame_count


# ---- cut short, too long ----


@cache
def _played(data: bytes) -> list[np.ndarray]:
    decoder = athcodec.open(BytesIO(data))
    return [decoder.positions(depth=depth) for depth in range(decoder.level_count)]


def prefix_strictly(data: bytes, size: int) -> int:
    refused(data[:size], (Truncated, NotAnAthFile), strict=True)
    return 0


def prefix_as_a_stream(data: bytes, size: int) -> int:
    whole = Container(BytesIO(data))
    if size < whole.prelude_length:
        refused(data[:size], (Truncated, NotAnAthFile))
        return 0
    late = [chunk.level for chunk in whole.chunks if chunk.is_motion and chunk.offset + chunk.length > size]
    deepest = min(late, default=whole.header.level_count) - 1
    decoder = athcodec.open(BytesIO(data[:size]))
    if deepest < 0:
        try:
            decoder.positions()
        except Truncated:
            return 0
        raise Wrong(f"{size} bytes: got level 0, which is not there")
    if decoder.deepest != deepest or not np.array_equal(decoder.positions(), _played(data)[deepest], equal_nan=True):
        raise Wrong(f"{size} bytes: got level {decoder.deepest}; expected level {deepest} as in the whole file")
    return 0


def too_long(data: bytes, more: bytes) -> int:
    refused(data + more, TrailingBytes, strict=True)
    decoder = athcodec.open(BytesIO(data + more))
    if not np.array_equal(decoder.positions(), _played(data)[-1], equal_nan=True):
        raise Wrong(f"with {len(more)} bytes more: got other positions")
    return 0


# ---- damage ----


def flipped_bit(data: bytes, bit: int) -> int:
    refused(_flipped(data, bit))
    return 0


def checked_bits(data: bytes) -> list[int]:
    """All but those of unknown chunks, whose bytes no decoder reads."""
    container = Container(BytesIO(data))
    known = [range(chunk.offset, chunk.offset + chunk.length) for chunk in container.chunks]
    front = range(_tables_end(data))
    return [8 * place + bit for places in [front, *known] for place in places for bit in range(8)]


def _flipped(data: bytes, bit: int) -> bytes:
    place = bit // 8
    return data[:place] + bytes([data[place] ^ 1 << bit % 8]) + data[place + 1:]


def repaired(data: bytes) -> bytes:
    """Checksums and File_Length that fit, as far as the tables can be read."""
    at, (count,) = _tables_end(data), struct.unpack_from("<I", data, 24)
    if at > len(data):
        return data
    front, behind = bytearray(data[:at]), data[at:]
    for i in range(ct._HEADER.size, ct._HEADER.size + ct._CHUNK.size * count, ct._CHUNK.size):
        (length,) = struct.unpack_from("<I", front, i + 8)
        struct.pack_into("<I", front, i + 12, crc32c(data[at: at + length]))
        at += length
    struct.pack_into("<Q", front, 16, at)
    return with_checksum(bytes(front)) + behind


def flipped_bit_repaired(data: bytes, bit: int) -> int:
    return within_limits(repaired(_flipped(data, bit)))


def header_field(data: bytes, change: tuple[int, str, float, bool]) -> int:
    at, code, value, repair = change
    changed = bytearray(data)
    struct.pack_into(code, changed, at, value)
    if repair:
        end = _tables_end(changed)
        return within_limits(with_checksum(bytes(changed[:end])) + bytes(changed[end:]))
    if bytes(changed) != data:
        refused(bytes(changed))
    return 0


def _tables_end(data: bytes | bytearray) -> int:
    count, segments, levels = *struct.unpack_from("<I", data, 24), *struct.unpack_from("<I", data, 40), data[44]
    return ct._HEADER.size + ct._CHUNK.size * count + ct._ERRORS.size * segments * levels


def _extremes(code: str) -> list:
    if code[-1] in "fd":
        return [0.0, 5e-324 if code[-1] == "d" else 1e-45, 1.7e308 if code[-1] == "d" else 3e38, float("inf"),
                float("nan"), -1.0]
    largest = 256 ** struct.calcsize(code) - 1
    powers = [1 << k for k in range(1, 8 * struct.calcsize(code))]
    return sorted({0, 1, largest - 1, largest, *powers, *(power - 1 for power in powers)})


def header_changes(data: bytes) -> list[tuple]:
    return [(at, code, value, repair) for at, code in struct_fields(ct._HEADER) if code[-1] != "s"
            for value in _extremes(code) for repair in (False, True)]


def table_changes(data: bytes) -> list[tuple]:
    """Lying lengths and places: every entry of the chunk table at its extremes, under a checksum that fits."""
    (count,) = struct.unpack_from("<I", data, 24)
    entries = range(ct._HEADER.size, ct._HEADER.size + ct._CHUNK.size * count, ct._CHUNK.size)
    return [(entry + at, code, value, True) for entry in entries for at, code in struct_fields(ct._CHUNK)[:5]
            for value in (0, 1, 256 ** struct.calcsize(code) - 2, 256 ** struct.calcsize(code) - 1)]


def corrupted(data: bytes, seed: int) -> int:
    """Fields of the front changed so that they mostly still fit each other, or contents of chunks."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        return within_limits(corrupted_front(rng, data))
    parts = seeds.Parts.of(data)
    chunks = list(parts.chunks)
    for i in rng.integers(len(chunks), size=rng.integers(1, 3)):
        if chunks[i][1]:
            chunks[i] = chunks[i][0], mutations(rng, chunks[i][1])
    return within_limits(parts.with_chunks(chunks))


# ---- made to be slow ----

MOST_PER_BYTE = 75.0
"""How much more a byte may cost than one of the sample. 100 ns on a machine that decodes it at 1.3 ns a byte."""
CHUNK_BYTES = 256
"""What Python keeps of a chunk."""
MOST_GROWTH = 3.2
"""Of the time, where everything in a file is doubled."""


def seconds_and_bytes(data: bytes) -> tuple[float, int]:
    """Of decoding all; bytes read, given out, and of the decoder's own memory, which the file's counts ask for."""
    start = time.perf_counter()
    decoder = athcodec.open(BytesIO(data))
    given = sum(block.nbytes for _, block in decoder.blocks())
    taken = time.perf_counter() - start
    work = decoder._player.work_size() + decoder._player.segment_size(decoder.level_count - 1)
    own = len(decoder._player._memory) + len(decoder._player._build) + work * len(decoder.segments)
    own += CHUNK_BYTES * decoder.container.header.chunk_count
    return taken, len(data) + given + decoder.rest.nbytes + own


@cache
def _sample_per_byte() -> float:
    return min(seconds / size for seconds, size in (seconds_and_bytes(seeds.valid_files()["sample"]) for _ in range(5)))


def slow_file(_: bytes, name: str) -> int:
    """What else the machine does can only add to a time: one that is too long is taken again, and the least counts."""
    files = [hostile_files.SLOW[name](scale) for scale in (1, 2)]
    least, fault = [float("inf")] * 2, ""
    for _ in range(8):
        for i, data in enumerate(files):
            taken, size = seconds_and_bytes(data)
            least[i] = min(least[i], taken)
        fault = _too_slow(*least, size)
        if not fault:
            return 4 << 30
    raise Wrong(f"{name}: {fault}")


def _too_slow(once: float, twice: float, size: int) -> str:
    ratio = twice / size / _sample_per_byte()
    if ratio > MOST_PER_BYTE:
        return f"got {ratio:.0f} times the sample's cost a byte; expected at most {MOST_PER_BYTE}"
    growth = twice / once
    return f"got {growth:.1f} times the time for twice the file" if growth > MOST_GROWTH else ""


def flood(_: bytes, name: str) -> int:
    """Small files that announce much: refused, or played within the limits."""
    return within_limits(hostile_files.LYING[name]())


# ---- the class ----


def _classes(files: dict[str, bytes]) -> list[tuple[float, Cases]]:
    """(share of the time, cases)"""
    small = {name: data for name, data in files.items() if len(data) <= SMALL}

    def each(of: dict[str, bytes], arguments) -> list[tuple[str, object]]:
        return [(name, argument) for name, data in of.items() for argument in arguments(data)]

    def made(names) -> list[tuple[str, object]]:
        return [("least", name) for name in names]

    return [
        (0.5, Cases("a byte or more too many", files, each(files, lambda _: [b"\0", b"more", bytes(4096)]), too_long)),
        (1, Cases("prefixes, opened strictly", files, each(files, lambda d: range(len(d))), prefix_strictly)),
        (1, Cases("prefixes, as a stream", files, each(files, lambda d: range(len(d))), prefix_as_a_stream)),
        (1.5, Cases("fields of the header at their extremes", small, each(small, header_changes), header_field)),
        (1, Cases("entries of the chunk table at their extremes", small, each(small, table_changes), header_field)),
        (1.5, Cases("flipped bits", small, each(small, checked_bits), flipped_bit)),
        (2, Cases("flipped bits, checksums repaired", small, each(small, lambda d: range(8 * len(d))),
                  flipped_bit_repaired)),
        (1.5, Cases("corrupted fronts and chunks, checksums repaired", small, each(small, lambda _: range(10_000)),
                    corrupted)),
        (0.5, Cases("small files that announce much", files, made(hostile_files.LYING), flood, few=True)),
        (2, Cases("files made to be slow", files, made(hostile_files.SLOW), slow_file, few=True)),
    ]


def run(budget: float) -> list[Row]:
    classes = _classes(valid_files())
    unit = budget / sum(share for share, _ in classes)
    return [_cases.run(cases, unit * share) for share, cases in classes]


def figures() -> dict[str, str]:
    """What slow files cost, measured once more in this process."""
    lines = {}
    for name, make in hostile_files.SLOW.items():
        taken, size = seconds_and_bytes(make(2))
        lines[name] = (f"{taken:.2f} s, {1e9 * taken / size:.1f} ns per byte of file, positions and memory, "
                       f"{taken / size / _sample_per_byte():.1f} times the sample's")
    return lines

