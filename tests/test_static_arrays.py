"""Named arrays and metadata in the C core: what it takes, what it refuses and what it gives are Python's."""

from __future__ import annotations

import ctypes
import json
import struct
from collections.abc import Callable
from ctypes import byref
from pathlib import Path

import numpy as np
import pytest
import zstandard
from files import Parts
from header import TYPES, Fault, Range, core
from test_core import Player
from test_damage import attribute, mutations, zstd

import athcodec
from athcodec.decoding import container as ct
from athcodec.decoding.container import Limits
from athcodec.errors import BadChunk, LimitExceeded

Array, Metadata = TYPES["ath_array"], TYPES["ath_metadata"]
VECTORS = Path(__file__).resolve().parent.parent / "spec" / "vectors" / "valid"
OK, MISSING, BAD_ARGUMENT = 0, 66, 69
FLOATS = np.linspace(0, 1, 4, dtype=np.float32)
PLANES = FLOATS.view(np.uint8).reshape(-1, 4).T.tobytes()


class Refused(Exception):
    """Its text is the name of a result."""


def check(result: int, fault: Fault) -> None:
    assert result == fault.code
    if result != OK:
        raise Refused(core.ath_result_name(result).decode())


def unpacked(address: int, size: int, expected: int) -> bytes:
    """The content that a zstd library finds in a frame."""
    try:
        content = zstandard.ZstdDecompressor().decompress(ctypes.string_at(address, size))
    except zstandard.ZstdError:
        raise Refused("BAD_CHUNK") from None
    if len(content) != expected:
        raise Refused("BAD_CHUNK")
    return content


def array_of(player: Player, chunk: int) -> tuple:
    """Name, shape, type and elements."""
    array, fault = Array(), Fault()
    check(core.ath_array_of(player.address, chunk, byref(array), byref(fault)), fault)
    name = ctypes.string_at(ctypes.c_void_p.from_buffer(array, Array.name.offset).value, array.name_bytes)
    elements = ctypes.create_string_buffer(array.bytes)
    if array.bytes:
        core.ath_array_elements(byref(array), unpacked(array.packed, array.packed_bytes, array.bytes), elements)
    kind = f"{ct.ARRAY_KINDS[array.kind]}{array.item_bytes}"
    return name.decode(), tuple(array.shape[: array.dimension_count]), kind, elements.raw


def metadata_of(player: Player) -> bytes:
    metadata, fault = Metadata(), Fault()
    check(core.ath_metadata_of(player.address, byref(metadata), byref(fault)), fault)
    if metadata.is_packed:
        return unpacked(metadata.stored, metadata.stored_bytes, metadata.bytes)
    return ctypes.string_at(metadata.stored, metadata.bytes) if metadata.stored else b"{}"


def described(name: str, array: np.ndarray) -> tuple:
    return name, array.shape, f"{array.dtype.kind}{array.dtype.itemsize}", array.tobytes()


def outcome(of: Callable[[], object]) -> object:
    try:
        return of()
    except Refused as refused:
        return str(refused)
    except BadChunk:
        return "BAD_CHUNK"
    except LimitExceeded:
        return "LIMIT_EXCEEDED"


@pytest.fixture(scope="module")
def parts(full_ath):
    return Parts.of(full_ath.read_bytes())


def both_of_array(parts: Parts, payload: bytes) -> tuple[object, object]:
    """An array of such a chunk in C and in Python."""
    player = Player(parts.with_payload(ct.ATTRIBUTE, payload), build=False)
    in_c = outcome(lambda: array_of(player, parts.index(ct.ATTRIBUTE)))
    return in_c, outcome(lambda: described(*ct.parse_array(payload, "array", Limits())))


def both_of_metadata(parts: Parts, payload: bytes) -> tuple[object, object]:
    """The metadata in C, refused if they are no JSON, and in Python."""
    player = Player(parts.with_payload(ct.METADATA, payload), build=False)
    in_c = outcome(lambda: ct._parse_json(metadata_of(player), "metadata"))
    return in_c, outcome(lambda: ct.parse_metadata(payload, Limits()))


# ---- what files hold ----


@pytest.mark.parametrize("path", sorted([*VECTORS.glob("attribute*.ath"), *VECTORS.glob("*metadata*.ath")]))
def test_arrays_and_metadata_of_every_vector_are_those_that_python_reads(path):
    player = Player(path.read_bytes(), build=False)
    chunks = core.ath_chunks(player.address)[: player.info.chunk_count]
    arrays = [array_of(player, i) for i, chunk in enumerate(chunks) if chunk.kind == ct.ATTRIBUTE]
    with athcodec.open(path) as decoder:
        expected = {name: described(name, array) for name, array in decoder.file.attributes.items()}
        assert {array[0]: array for array in arrays} == expected and len(arrays) == len(expected)
        assert json.loads(metadata_of(player)) == decoder.file.metadata


def test_an_array_is_found_by_its_whole_name(parts):
    player = Player(parts.file(), build=False)
    arrays = [i for i, (chunk, _) in enumerate(parts.chunks) if chunk.kind == ct.ATTRIBUTE]
    for name, chunk in zip((b"radius", b"species"), arrays, strict=True):
        assert core.ath_array_named(player.address, name) == chunk
    assert [core.ath_array_named(player.address, name) for name in (b"radiu", b"radius2", b"")] == [-1] * 3


def test_a_number_that_is_no_array_is_a_bad_argument(parts):
    player = Player(parts.file(), build=False)
    for chunk in (-1, 0, player.info.chunk_count):
        assert core.ath_array_of(player.address, chunk, byref(Array()), None) == BAD_ARGUMENT


def test_arrays_that_have_not_come_are_named_as_ranges_which_bring_them(parts):
    data, ranges = parts.file(), (Range * 4)()
    player = Player(data, whole=False, build=False)
    arrays = [i for i, (chunk, _) in enumerate(parts.chunks) if chunk.kind == ct.ATTRIBUTE]
    assert core.ath_array_named(player.address, b"radius") == -1
    assert core.ath_array_of(player.address, arrays[0], byref(Array()), None) == MISSING
    assert core.ath_array_ranges(player.address, None, 0) == 1, "adjacent ones are merged"
    assert core.ath_array_ranges(player.address, ranges, 4) == 1
    start, size = ranges[0].offset, ranges[0].size
    assert size == sum(len(payload) for chunk, payload in parts.chunks if chunk.kind == ct.ATTRIBUTE)
    player.kept.append(bytes_of := data[start : start + size])
    core.ath_feed(player.address, bytes_of, start, size)
    assert core.ath_array_ranges(player.address, ranges, 4) == 0
    assert array_of(player, core.ath_array_named(player.address, b"species"))[3] == b"oakelm"


# ---- frames of zstd ----

NOISE = np.random.default_rng(1).integers(0, 256, 1 << 18, np.uint8).tobytes()
TEXTS = {
    "zeros": bytes(1 << 18),
    "noise": NOISE,
    "repeats": NOISE[:5000] * 60,
    "skewed": np.random.default_rng(2).geometric(0.2, 300_000).clip(0, 255).astype(np.uint8).tobytes(),
    "one byte": b"x",
}
HEAD, BLOCK = bytes.fromhex("28b52ffd"), bytes.fromhex("810000") + PLANES  # One raw block, the last, of 16 bytes.
FRAMES = {
    "a plain frame": zstd(PLANES),
    "a checksum": zstd(PLANES, write_checksum=True),
    "a checksum that differs": zstd(PLANES, write_checksum=True)[:-1] + b"?",
    "no size": zstd(PLANES, write_content_size=False),
    "another size": zstd(PLANES + b"x"),
    "no content": zstd(b""),
    "no frame": b"",
    "another magic": b"PK" + zstd(PLANES),
    "bytes behind": zstd(PLANES) + b"\0",
    "two frames": zstd(PLANES[:8]) + zstd(PLANES[8:]),
    "an empty frame behind": zstd(PLANES) + zstd(b""),
    "a skippable frame before": bytes.fromhex("502a4d1801000000ff") + zstd(PLANES),
    "a skippable frame behind": zstd(PLANES) + bytes.fromhex("502a4d1801000000ff"),
    "a dictionary": zstd(
        PLANES * 9, dict_data=zstandard.ZstdCompressionDict(PLANES * 9, zstandard.DICT_TYPE_RAWCONTENT)
    ),
    "the name of a dictionary": HEAD + bytes.fromhex("210710") + BLOCK,
    "a dictionary without a name": HEAD + bytes.fromhex("210010") + BLOCK,
    "one segment": HEAD + bytes.fromhex("2010") + BLOCK,
    "a size in 2 bytes, which counts from 256": HEAD + bytes.fromhex("6010ff") + BLOCK,
    "a size in 4 bytes": HEAD + bytes.fromhex("a010000000") + BLOCK,
    "a size in 8 bytes": HEAD + bytes.fromhex("e01000000000000000") + BLOCK,
    "a vast size": HEAD + bytes.fromhex("e010000000000000ff") + BLOCK,
    "a window of 8 MiB": HEAD + bytes.fromhex("806810000000") + BLOCK,
    "a window above 8 MiB": HEAD + bytes.fromhex("806910000000") + BLOCK,
    "the largest window": HEAD + bytes.fromhex("80ff10000000") + BLOCK,
    "a window above 8 MiB, and no size": HEAD + bytes.fromhex("0069") + BLOCK,
    "a reserved bit": HEAD + bytes.fromhex("2810") + BLOCK,
    "a reserved block": HEAD + bytes.fromhex("2010870000") + PLANES,
    "a block of one byte many times": HEAD + bytes.fromhex("2010830000") + b"x",
    "an empty block before": HEAD + bytes.fromhex("2010000000") + BLOCK,
    "no last block": HEAD + bytes.fromhex("2010800000") + PLANES,
    "a block beyond the end": HEAD + bytes.fromhex("2010890000") + PLANES,
    "a checksum that is missing": HEAD + bytes.fromhex("2410") + BLOCK,
} | {f"cut to {size} bytes": zstd(PLANES)[:size] for size in range(1, 25, 3)}


@pytest.mark.parametrize("frame", FRAMES.values(), ids=FRAMES)
def test_a_frame_is_taken_or_refused_as_python_does(frame, parts):
    in_c, in_python = both_of_array(parts, attribute(frame))
    assert in_c == in_python
    in_c, in_python = both_of_metadata(parts, b"\1" + frame)
    assert in_c == in_python


def test_some_of_these_frames_are_taken_and_some_refused(parts):
    """What a frame may be is written in FORMAT.md: a size, no dictionary, and nothing before or behind it."""
    taken = {name for name, frame in FRAMES.items() if not isinstance(both_of_array(parts, attribute(frame))[0], str)}
    names = (
        "one segment",
        "a size in 4 bytes",
        "a size in 8 bytes",
        "a window of 8 MiB",
        "a block of one byte many times",
    )
    assert taken == {"a plain frame", "a checksum", "a dictionary without a name", "an empty block before", *names}


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_frames_of_many_blocks_are_one_frame(text, parts):
    """Among them raw blocks, runs, and blocks that reuse tables of the ones before."""
    for level in (-5, 9):
        frame = zstd(text, level=level, write_checksum=level == 9)
        in_c, in_python = both_of_array(parts, attribute(frame, kind=1, size=1, shape=[len(text)]))
        assert in_c == in_python == ("a", (len(text),), "u1", text)


# ---- chunks ----

CHUNKS = {
    "a single element": attribute(zstd(PLANES[:4]), shape=[]),
    "no elements": attribute(shape=[4, 0, 1 << 20]),
    "no elements, but bytes": attribute(b"x", shape=[0]),
    "no elements, of a vast shape": attribute(shape=[0, 1 << 31, 1 << 31]),
    "a vast shape": attribute(zstd(PLANES), shape=[(1 << 32) - 1] * 32),
    "sizes whose product is a whole turn of 64 bits": attribute(zstd(PLANES), shape=[1 << 31, 1 << 31, 4]),
    "32 dimensions": attribute(zstd(PLANES), shape=[1] * 31 + [4]),
    "33 dimensions": attribute(zstd(PLANES), shape=[1] * 32 + [4]),
    "no name": attribute(zstd(PLANES), name=b""),
    "a name that is no text": attribute(zstd(PLANES), name=b"\xc0\x80"),
    "a name with a zero": attribute(zstd(PLANES), name=b"a\0b"),
    "the longest name": attribute(zstd(PLANES), name=b"a" * 4096),
    "a longer name": attribute(zstd(PLANES), name=b"a" * 4097),
    "a name beyond the end": struct.pack("<BBHI", 3, 0, 9, 4) + b"a",
    "shapes beyond the end": struct.pack("<BBHI", 3, 255, 1, 4) + b"a",
    "less than a head": b"\3\0\1\0\4\0\0",
    "halves": attribute(zstd(PLANES), size=2, shape=[8]),
    "floats of one byte": attribute(zstd(PLANES), size=1, shape=[16]),
    "numbers of three bytes": attribute(zstd(PLANES[:12]), kind=1, size=3),
    "booleans": attribute(zstd(b"\0\1\1\0"), kind=0, size=1),
    "texts of three bytes": attribute(zstd(PLANES[:12]), kind=4, size=3),
    "texts of no bytes": attribute(zstd(PLANES), kind=4, size=0),
    "texts that are too long": attribute(zstd(bytes(1 << 21)), kind=4, size=1 << 21, shape=[1]),
    "an unknown kind": attribute(zstd(PLANES), kind=5),
}


@pytest.mark.parametrize("payload", CHUNKS.values(), ids=CHUNKS)
def test_an_array_is_taken_or_refused_as_python_does(payload, parts):
    in_c, in_python = both_of_array(parts, payload)
    assert in_c == in_python


TEXT = b'{"unit": "m"}'
METADATA = {"nothing": b"", "an unknown method": b"\2" + TEXT, "plain": b"\0" + TEXT, "packed": b"\1" + zstd(TEXT)}
METADATA |= {f"{size} bytes": b"\1" + zstd(TEXT.ljust(size)) for size in (1 << 20, (1 << 20) + 1)}
METADATA |= {f"{size} plain bytes": b"\0" + TEXT.ljust(size) for size in (1 << 20, (1 << 20) + 1)}


@pytest.mark.parametrize("payload", METADATA.values(), ids=METADATA)
def test_metadata_are_taken_or_refused_as_python_does(payload, parts):
    in_c, in_python = both_of_metadata(parts, payload)
    assert in_c == in_python


@pytest.mark.parametrize("kind, both", [(ct.ATTRIBUTE, both_of_array), (ct.METADATA, both_of_metadata)])
def test_corrupted_chunks_with_good_checksums_are_taken_or_refused_as_python_does(kind, both, parts):
    rng, refused = np.random.default_rng(kind), 0
    payload = (
        attribute(zstd(TEXTS["repeats"][:600], level=19), shape=[150]) if kind == ct.ATTRIBUTE else b"\1" + zstd(TEXT)
    )
    for _ in range(80):
        in_c, in_python = both(parts, mutations(rng, payload))
        assert in_c == in_python
        refused += isinstance(in_c, str)
    assert 40 < refused
