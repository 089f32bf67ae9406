"""Truncated, too long, corrupted and malicious files: each is refused in one line or plays within limits.

Every prefix and every bit of every small valid file, as far as time allows. With unchanged checksums,
corruption must be refused; with repaired checksums a file may play as something else. Files made to be slow may cost a
decoder no more per byte than others. All run through the Python package, in separate processes.
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
from athcodec._native import crc32c
from athcodec.decoding import container as ct
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.container import Limits
from athcodec.errors import FormatError, NotAnAthFile, TrailingBytes, Truncated
from spec.document import rules
from spec.robust import Row, _cases
from spec.robust._cases import Cases, Wrong

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests"))  # for making files and reading them completely

import hostile_files  # noqa: E402
from files import with_checksum  # noqa: E402
from fuzz import seeds  # noqa: E402
from test_damage import corrupted_front, mutations, use  # noqa: E402

VECTORS = ROOT / "spec" / "vectors" / "valid"
SMALL = 4096
LIMITS = Limits(memory_bytes=64 << 20, decoded_chunk_bytes=16 << 20)


def valid_files() -> dict[str, bytes]:
    """Return the valid vectors, except those that play only with a mesh of the host."""
    paths = [path for path in sorted(VECTORS.glob("*.ath")) if not path.with_suffix(".mesh").exists()]
    vectors = {path.stem: path.read_bytes() for path in paths}
    return seeds.valid_files() | {name: data for name, data in vectors.items() if len(data) <= seeds.LARGEST}


# ---- allowed results ----


def refused(data: bytes, expected: type[FormatError] | tuple = FormatError, **options) -> None:
    """Open and check a file, and raise Wrong unless it raises an error of the type `expected` whose message is one
    line.
    """
    try:
        athcodec.open(BytesIO(data), **options).file.check()
    except expected as error:
        if "\n" in str(error):
            raise Wrong(f"got more than one line: {error}") from None
        return
    raise Wrong("got accepted; expected a refusal")


def within_limits(data: bytes) -> int:
    """Read the file in every way; returns the memory that this may take."""
    use(data, limits=LIMITS)
    return 2 * LIMITS.memory_bytes + _whole_clip(data)


def _whole_clip(data: bytes) -> int:
    """Return bytes of all positions, which `use` reads as float64."""
    try:
        header = AthFile(BytesIO(data), limits=LIMITS).tables.header
    except FormatError:
        return 0
    return 2 * 24 * header.vertex_count * header.frame_count


# ---- truncated, too long ----


@cache
def _played(data: bytes) -> list[np.ndarray]:
    decoder = athcodec.open(BytesIO(data))
    return [decoder.positions(level=level) for level in range(decoder.file.level_count)]


def prefix_strictly(data: bytes, size: int) -> int:
    refused(data[:size], (Truncated, NotAnAthFile), strict=True)
    return 0


def prefix_as_a_stream(data: bytes, size: int) -> int:
    """Open the first `size` bytes of a file as a stream, and raise Wrong unless exactly the levels that are complete
    can be played, with the same positions as in the whole file. Return 0, the memory needed beyond the usual.
    """
    whole = AthFile(BytesIO(data))
    if size < whole.prelude_length:
        refused(data[:size], (Truncated, NotAnAthFile))
        return 0
    late = [chunk.level for chunk in whole.chunks if chunk.is_motion and chunk.offset + chunk.length > size]
    deepest = min(late, default=whole.level_count) - 1
    decoder = athcodec.open(BytesIO(data[:size]))
    if deepest < 0:
        try:
            decoder.positions()
        except Truncated:
            return 0
        raise Wrong(f"{size} bytes: got level 0, which is incomplete")
    level = decoder.file.deepest
    if level != deepest or not np.array_equal(decoder.positions(), _played(data)[deepest], equal_nan=True):
        raise Wrong(f"{size} bytes: got level {level}; expected level {deepest} as in the whole file")
    return 0


def too_long(data: bytes, more: bytes) -> int:
    refused(data + more, TrailingBytes, strict=True)
    decoder = athcodec.open(BytesIO(data + more))
    if not np.array_equal(decoder.positions(), _played(data)[-1], equal_nan=True):
        raise Wrong(f"with {len(more)} bytes more: got other positions")
    return 0


# ---- corruption ----


def flipped_bit(data: bytes, bit: int) -> int:
    refused(_flipped(data, bit))
    return 0


def checked_bits(data: bytes) -> list[int]:
    """Return all bits but those of unknown chunks, which no decoder reads."""
    file = AthFile(BytesIO(data))
    known = [range(chunk.offset, chunk.offset + chunk.length) for chunk in file.chunks]
    front = range(file.chunks[0].offset)
    return [8 * place + bit for places in [front, *known] for place in places for bit in range(8)]


def _flipped(data: bytes, bit: int) -> bytes:
    place = bit // 8
    return data[:place] + bytes([data[place] ^ 1 << bit % 8]) + data[place + 1 :]


def repaired(data: bytes) -> bytes:
    """Return a file with correct checksums, as far as its front can be read."""
    *_, length, count = ct._HEADER.unpack_from(data) if len(data) >= ct._HEADER.size else (0, 0)
    if not ct._HEADER.size + 4 * count <= length <= len(data):
        return data
    front, behind = with_checksum(data[:length]), data[length:]
    try:
        _, table = rules.decode_front(front[ct._HEADER.size : length - 4 * count], count)
    except rules.Invalid:
        return front + behind
    checksums, at = b"", length
    for *_, size in table:
        checksums += struct.pack("<I", crc32c(data[at : at + size]))
        at += size
    return with_checksum(front[: length - len(checksums)] + checksums) + behind


def flipped_bit_repaired(data: bytes, bit: int) -> int:
    return within_limits(repaired(_flipped(data, bit)))


def corrupted(data: bytes, seed: int) -> int:
    """Change fields of the front so that they mostly fit each other (odd `seed`), or contents of chunks (even `seed`),
    and decode the file within limits. Return the memory that this needs, in bytes.
    """
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
"""Allowed cost of a byte over that of the sample: 100 ns on a machine that decodes the sample at 1.3 ns a byte."""
CHUNK_BYTES = 256
"""Python's memory for a chunk."""
MOST_GROWTH = 3.2
"""Allowed growth of the time when everything in a file is doubled."""


def seconds_and_bytes(data: bytes) -> tuple[float, int]:
    """Decode a file completely. Return the seconds, and the sum of the bytes read, the bytes returned and the bytes of
    the decoder's memory, which the counts in the file determine.
    """
    start = time.perf_counter()
    decoder = athcodec.open(BytesIO(data))
    decoded = sum(block.nbytes for _, block in decoder.blocks())
    seconds = time.perf_counter() - start
    core, deepest = decoder.file.core, decoder.file.level_count - 1
    work = core.work_size() + core.segment_size(deepest)
    memory = len(core._memory) + core.refinement_size(deepest) + work * len(decoder.segments)
    memory += CHUNK_BYTES * decoder.file.tables.header.chunk_count
    return seconds, len(data) + decoded + decoder.file.rest.nbytes + memory


@cache
def _sample_per_byte() -> float:
    return min(seconds / size for seconds, size in (seconds_and_bytes(seeds.valid_files()["sample"]) for _ in range(5)))


def slow_file(_: bytes, name: str) -> int:
    """Raise Wrong if the slow file `name` takes too long to open for its size; return the memory that the test needs.
    Times that are too long are measured again and the least counts, because other load can only add to them.
    """
    files = [hostile_files.SLOW[name](scale) for scale in (1, 2)]
    least, fault = [float("inf")] * 2, ""
    for _ in range(8):
        for i, data in enumerate(files):
            seconds, size = seconds_and_bytes(data)
            least[i] = min(least[i], seconds)
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


def announces_too_much(_: bytes, name: str) -> int:
    """Play small files that announce much: each is refused, or played within the limits."""
    return within_limits(hostile_files.LYING[name]())


# ---- the class ----


def _classes(files: dict[str, bytes]) -> list[tuple[float, Cases]]:
    """Return pairs of a weight, the part of the time, and the cases of one class of hostile files."""
    small = {name: data for name, data in files.items() if len(data) <= SMALL}
    alone = {name: data for name, data in files.items() if not AthFile(BytesIO(data)).needs_host_mesh}
    of_files = [
        (0.5, "a byte or more too many", alone, lambda _: [b"\0", b"more", bytes(4096)], too_long),
        (1, "prefixes, opened strictly", files, lambda data: range(len(data)), prefix_strictly),
        (1, "prefixes, as a stream", alone, lambda data: range(len(data)), prefix_as_a_stream),
        (1.5, "flipped bits", small, checked_bits, flipped_bit),
        (2, "flipped bits, checksums repaired", small, lambda data: range(8 * len(data)), flipped_bit_repaired),
        (1.5, "corrupted fronts and chunks, checksums repaired", small, lambda _: range(10_000), corrupted),
    ]
    made = [
        (0.5, "small files that announce much", hostile_files.LYING, announces_too_much),
        (2, "files made to be slow", hostile_files.SLOW, slow_file),
    ]
    return [
        (weight, Cases(name, of, [(file, x) for file, data in of.items() for x in arguments(data)], attempt))
        for weight, name, of, arguments, attempt in of_files
    ] + [
        (weight, Cases(name, files, [("least", x) for x in names], attempt, few=True))
        for weight, name, names, attempt in made
    ]


def run(budget: float) -> list[Row]:
    classes = _classes(valid_files())
    unit = budget / sum(weight for weight, _ in classes)
    return [_cases.run(cases, unit * weight) for weight, cases in classes]


def figures() -> dict[str, str]:
    """Return sentences on the seconds that slow files take, by the name of the file, measured in this process."""
    lines = {}
    for name, make in hostile_files.SLOW.items():
        seconds, size = seconds_and_bytes(make(2))
        lines[name] = (
            f"{seconds:.2f} s, {1e9 * seconds / size:.1f} ns per byte of file, positions and memory, "
            f"{seconds / size / _sample_per_byte():.1f} times the sample's"
        )
    return lines
