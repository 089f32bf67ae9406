"""What an engine that calls the C core relies on (ath.h): sizes that are enough and checked, bytes in any order,
levels and times that mean what the header says, and the same bits in whatever order frames are decoded."""

from __future__ import annotations

import ctypes
import itertools
import re
from concurrent.futures import ThreadPoolExecutor
from ctypes import byref, c_int32, c_size_t, c_void_p
from dataclasses import replace

import numpy as np
import pytest
from files import Parts, draft_of, with_header
from header import Chunk, Clip, Fade, Fault, Info, Limits, Part, Range, core
from plants import awkward, flowing_growth

import athcodec
from athcodec import errors
from athcodec.decoding import container as ct
from athcodec.encoding.search import search, start
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.settings import Settings

VERSION = f"{ct.MAJOR}.{ct.MINOR}"

OK, BAD_CHECKSUM, BAD_CHUNK, LIMIT_EXCEEDED = 0, 5, 9, 10
MORE, HELD, MISSING, NOT_PREPARED, NO_MEMORY, BAD_ARGUMENT = range(64, 70)
FILE_ORDER, SOURCE_ORDER = 0, 1
CLAMP, LOOP, PING_PONG, AS_MARKED = 0, 1, 2, 3
GUARD = 0xA5
LADDER = (1e-2, 1e-3)


class Memory:
    """Bytes for the core, aligned to 16 or `off` by some, and guarded: a write behind the end is noticed."""

    def __init__(self, size: int, off: int = 0):
        self.size = size
        self._block = np.full(size + 64, GUARD, np.uint8)
        self._start = -self._block.ctypes.data % 16 + off
        self.bytes[:] = 0

    @property
    def bytes(self) -> np.ndarray:
        return self._block[self._start : self._start + self.size]

    @property
    def address(self) -> int:
        return self._block.ctypes.data + self._start

    def check(self) -> None:
        assert (self._block[: self._start] == GUARD).all(), "written in front of the memory"
        assert (self._block[self._start + self.size :] == GUARD).all(), "written behind the memory"


def front(data: bytes, limits: Limits | None = None, fault: Fault | None = None) -> tuple[int, int, int]:
    """Result, bytes that are needed, memory that ath_open needs."""
    needed, memory = c_size_t(), c_size_t()
    result = core.ath_front(
        data, len(data), limits and byref(limits), byref(needed), byref(memory), fault and byref(fault)
    )
    return result, needed.value, memory.value


def text_of(fault: Fault) -> str:
    text = ctypes.create_string_buffer(256)
    assert core.ath_fault_text(byref(fault), text, len(text)) == len(text.value)
    return text.value.decode()


def refusal(data: bytes, limits: Limits | None = None) -> str:
    """What ath_front says of a file, or ath_open where that accepts it: the result's name and the sentence."""
    fault = Fault()
    result, _, size = front(data, limits, fault)
    if result == OK:
        memory = Memory(size)
        result = core.ath_open(memory.address, size, data, len(data), limits and byref(limits), byref(fault))
        memory.check()
    assert fault.code == result != OK
    return f"{core.ath_result_name(result).decode()} {text_of(fault)}"


def limits_with(**fields: int) -> Limits:
    limits = Limits()
    core.ath_default_limits(byref(limits))
    for name, value in fields.items():
        setattr(limits, name, value)
    return limits


class Player:
    """An opened file; only its prelude is fed unless `whole`."""

    def __init__(self, data: bytes, whole: bool = True, build: bool = True):
        self.data = data
        self.kept: list = []
        result, prelude, size = front(data)
        assert result == OK
        self.prelude = data[:prelude]
        self.memory = self.file = Memory(size)
        fed = data if whole else self.prelude
        self.kept.append(fed)
        assert core.ath_open(self.memory.address, size, fed, len(fed), None, None) == OK
        self.info = Info()
        core.ath_get_info(self.address, byref(self.info))
        if build:
            self.bases = Memory(core.ath_build_size(self.address))
            assert core.ath_build(self.address, self.bases.address, self.bases.size) == OK
        self.memory.check()
        self.refusal = Fault()

    @property
    def address(self) -> int:
        return self.memory.address

    @property
    def levels(self) -> range:
        return range(self.info.level_count)

    @property
    def segments(self) -> range:
        return range(self.info.segment_count)

    @property
    def clips(self) -> list[Clip]:
        return core.ath_clips(self.address)[: self.info.clip_count]

    def times_of(self, clip: Clip) -> np.ndarray:
        times = np.ctypeslib.as_array(core.ath_times(self.address), (self.info.frame_count,))
        return times[clip.first_frame : clip.first_frame + clip.frame_count]

    def after(self, frame: int) -> int:
        """The frame that it blends into: behind the last one of a clip that is the clip's first."""
        clip = next(clip for clip in self.clips if frame < clip.first_frame + clip.frame_count)
        return frame + 1 if frame + 1 < clip.first_frame + clip.frame_count else clip.first_frame

    def start_of(self, segment: int) -> int:
        return core.ath_segment_start(self.address, segment)

    def work(self) -> Memory:
        return Memory(core.ath_work_size(self.address))

    def room(self, level: int) -> Memory:
        """For a segment."""
        return Memory(core.ath_segment_size(self.address, level))

    def refine(self, level: int) -> int:
        """Builds what the layers of a level share; the result of the first call that fails, `refusal` says why."""
        size = c_size_t()
        result = core.ath_refine_size(self.address, level, byref(size), byref(self.refusal))
        if result != OK:
            return result
        self.kept.append(memory := Memory(size.value))
        result = core.ath_refine(self.address, level, memory.address, size.value)
        memory.check()
        return result

    def try_to_prepare(self, segment: int, level: int, work: Memory, into: Memory, call=core.ath_prepare) -> int:
        refined = self.refine(level)
        if refined != OK:
            return refined
        return call(work.address, work.size, self.address, segment, level, into.address, into.size)

    def start(self, segment: int, level: int, work: Memory, into: Memory) -> int:
        return self.try_to_prepare(segment, level, work, into, core.ath_prepare_start)

    def prepare(self, segment: int, level: int, work: Memory | None = None, into: Memory | None = None) -> Memory:
        work, into = work or self.work(), into or self.room(level)
        assert self.try_to_prepare(segment, level, work, into) == OK
        work.check()
        into.check()
        return into

    def keep(self, work: Memory, level: int) -> Memory:
        """Room for what a deeper level goes on from, of a preparation that has begun."""
        room = Memory(max(16, core.ath_keep_size(self.address, level)))
        assert core.ath_keep(work.address, room.address, room.size) == OK
        return room

    def finish(self, work: Memory, into: Memory, room: Memory) -> tuple[Memory, Memory]:
        """The segment and what was kept of it, moved to memory of its own size."""
        result = core.ath_prepare_step(work.address, 2**31 - 1)
        assert result == OK, core.ath_result_name(result)
        for memory in (work, into, room):
            memory.check()
        kept = Memory(core.ath_kept_size(room.address))
        kept.bytes[:] = room.bytes[: kept.size]
        room.bytes[:] = GUARD
        return into, kept

    def prepare_and_keep(self, segment: int, level: int) -> tuple[Memory, Memory]:
        work, into = self.work(), self.room(level)
        assert self.start(segment, level, work, into) == OK
        return self.finish(work, into, self.keep(work, level))

    def start_onward(self, before: tuple[Memory, Memory], level: int, work: Memory, into: Memory) -> int:
        assert self.refine(level) == OK
        shown, kept = before
        before = shown.address, kept.size and kept.address
        return core.ath_prepare_onward(work.address, work.size, self.address, *before, level, into.address, into.size)

    def go_on(
        self, before: tuple[Memory, Memory], level: int, joined_to: Memory | None = None
    ) -> tuple[Memory, Memory]:
        work, into = self.work(), self.room(level)
        assert self.start_onward(before, level, work, into) == OK
        if joined_to:
            assert core.ath_follow(work.address, joined_to.address) == OK
        return self.finish(work, into, self.keep(work, level))

    def prepare_all(self, level: int) -> list[Memory]:
        return [self.prepare(segment, level) for segment in self.segments]

    def result_of_preparing(self, segment: int, level: int) -> int:
        return self.try_to_prepare(segment, level, self.work(), self.room(level))

    def at(self, prepared: list[Memory], frame: float) -> tuple:
        """The first arguments of the functions that show a frame."""
        return self.address, pointers(prepared), len(prepared), frame

    def show(self, prepared: list[Memory], frame: float, order: int = SOURCE_ORDER) -> tuple[int, np.ndarray]:
        """What ath_positions returns, and the positions."""
        xyz = np.full((self.info.vertex_count, 3), np.nan, np.float32)
        return core.ath_positions(*self.at(prepared, frame), order, xyz.ctypes.data, 12), xyz

    def frame(self, prepared: list[Memory], frame: float) -> np.ndarray:
        result, xyz = self.show(prepared, frame)
        assert result == OK
        return xyz

    def ranges(self, level: int, first: int, last: int, fed_too: bool = False) -> list[tuple[int, int]]:
        buffer = (Range * 1000)()
        count = core.ath_ranges(self.address, level, first, last, fed_too, buffer, 1000)
        return [(r.offset, r.size) for r in buffer[:count]]

    def feed(self, offset: int, size: int) -> None:
        piece = bytes(bytearray(self.data[offset : offset + size]))
        self.kept.append(piece)
        core.ath_feed(self.address, piece, offset, size)


def pointers(prepared: list[Memory]):
    return (c_void_p * max(len(prepared), 1))(*[memory and memory.address for memory in prepared])


@pytest.fixture(scope="module", params=["sample", "bushy", "full", "medley", "layered"])
def data(request) -> bytes:
    """Three segments of a tree, four of a random plant on two roots, two of a plant with uneven times, four clips, and
    the random plant in layers of precision."""
    return request.getfixturevalue(f"{request.param}_ath").read_bytes()


@pytest.fixture(scope="module")
def player(data) -> Player:
    return Player(data)


# ---- results and memory ----


def test_results_have_the_names_and_numbers_of_the_format():
    for error in vars(errors).values():
        if isinstance(error, type) and issubclass(error, errors.FormatError):
            assert core.ath_result_name(error.code).decode() == error.name
    names = [core.ath_result_name(code).decode() for code in range(64, 70)]
    assert names == ["MORE", "HELD", "MISSING", "NOT_PREPARED", "NO_MEMORY", "BAD_ARGUMENT"]
    assert core.ath_result_name(0) == b"OK"
    assert {core.ath_result_name(code) for code in (-1, 15, 63, 70, 2**31 - 1, -(2**31))} == {b"UNKNOWN"}


def too_little(size: int) -> list[tuple[int, int]]:
    """Addresses and sizes that are not `size` bytes aligned to 16."""
    too_little.kept = [Memory(size, off) for off in (0, 1, 4, 8)]
    return [
        (0, size),
        (too_little.kept[0].address, size - 1),
        (too_little.kept[0].address, 0),
        *((memory.address, size) for memory in too_little.kept[1:]),
    ]


def test_memory_that_is_too_small_or_not_aligned_is_refused_and_not_touched(data):
    player = Player(data, build=False)
    deepest = player.levels[-1]
    sizes = {
        "open": front(data)[2],
        "build": core.ath_build_size(player.address),
        "work": core.ath_work_size(player.address),
        "segment": core.ath_segment_size(player.address, deepest),
    }
    built, work, segment = Memory(sizes["build"]), Memory(sizes["work"]), Memory(sizes["segment"])
    for address, size in too_little(sizes["open"]):
        assert core.ath_open(address, size, data, len(data), None, None) == NO_MEMORY
    for address, size in too_little(sizes["build"]):
        assert core.ath_build(player.address, address, size) == NO_MEMORY
    assert core.ath_build(player.address, built.address, built.size) == OK
    for address, size in too_little(sizes["work"]):
        arguments = address, size, player.address, 0, deepest, segment.address, segment.size
        assert core.ath_prepare_start(*arguments) == NO_MEMORY
    for address, size in too_little(sizes["segment"]):
        arguments = work.address, work.size, player.address, 0, deepest, address, size
        assert core.ath_prepare_start(*arguments) == NO_MEMORY
        assert not any(memory.bytes.any() for memory in too_little.kept)
    assert player.try_to_prepare(0, deepest, work, segment) == OK
    for memory in (player.memory, built, work, segment):
        memory.check()


def test_levels_and_segments_that_a_file_does_not_have_are_bad_arguments(player):
    work, segment = player.work(), Memory(max(player.room(level).size for level in player.levels))
    no_segment = [(index, 0) for index in (-1, player.info.segment_count, 2**31 - 1)]
    no_level = [(0, level) for level in (-1, player.info.level_count, 255)]
    for index, level in (*no_segment, *no_level, (-(2**31), -(2**31))):
        assert player.start(index, level, work, segment) == BAD_ARGUMENT


def test_a_file_beyond_a_limit_is_refused_before_it_is_opened(data):
    fields = {"vertices": 5, "frames": 5, "branches": 1, "chunks": 2, "memory_bytes": 1000}
    for field, limit in fields.items():
        assert front(data, limits_with())[0] == OK
        assert front(data, limits_with(**{field: limit}))[0] == LIMIT_EXCEEDED


@pytest.fixture(scope="module")
def parts(full_ath) -> Parts:
    return Parts.of(full_ath.read_bytes())


@pytest.mark.parametrize(
    "fields, sentence",
    [
        ({"chunk_count": 0}, "BAD_HEADER header: got Chunk_Count 0; expected 1 to 1048576"),
        ({"front_length": 1}, "BAD_HEADER front: got 1 bytes; expected {least} to 16777216"),
        ({"frame_count": 2**30}, "LIMIT_EXCEEDED header: got Frame_Count 1073741824; the limit is 1048576"),
        ({"branch_count": 9, "place_count": 8}, "BAD_HEADER header: got Branch_Count 9; expected 1 to 8"),
        ({"frame_count": 600, "segment_count": 2}, "BAD_HEADER header: got Segment_Count 2; expected 3 to 600"),
        ({"full_level_count": 33}, "BAD_HEADER header: got Full_Level_Count 33; expected 1 to 32"),
        ({"full_level_count": 3, "level_count": 0}, "BAD_HEADER header: got Level_Count 0; expected 1 to 3"),
        ({"clip_count": 256}, "BAD_HEADER header: got Clip_Count 256; expected 1 to 255"),
        ({"layer_count": 9}, "BAD_HEADER header: got Layer_Count 9; expected 1 to 8"),
        ({"max_error": float("nan")}, "BAD_HEADER header: got Max_Error nan; expected a finite length"),
        ({"max_error": float("inf")}, "BAD_HEADER header: got Max_Error inf; expected a finite length"),
        ({"clip_count": 2}, "BAD_CHUNK_TABLE chunk table: got no CLIPS; expected one"),
    ],
)
def test_a_refused_header_is_described_by_the_field_and_the_values_found_and_allowed(fields, sentence, parts):
    least = 24 + 4 * len(parts.chunks)  # bytes of a front: the header, and a checksum of each chunk
    assert refusal(with_header(parts.file(), **fields)) == sentence.format(least=least)


def test_a_refused_front_is_described_by_the_place_and_the_values_found_and_allowed(parts):
    data = parts.file()
    front = parts.chunks[0][0].offset
    assert refusal(b"PK" + data[2:]) == "NOT_AN_ATH_FILE file: got first bytes 0x504b5448; expected 0x89415448"
    assert refusal(data[:8] + b"\2\6\0\0" + data[12:]) == (
        f"UNSUPPORTED_VERSION file: got format version 2.6; expected {VERSION}"
    )
    assert refusal(data[:10] + b"\4\x80" + data[12:]) == (
        f"UNSUPPORTED_FEATURE file: got format {VERSION} with feature 2, 15; expected features that this decoder has"
    )
    assert refusal(data[:12]) == "MISSING header: got 12 bytes; expected 24"
    assert refusal(data[:100]) == f"MISSING front: got 100 bytes; expected {front}"
    assert refusal(data[:front]).startswith(f"MISSING prelude: got {front} bytes; expected ")
    assert re.fullmatch(
        "BAD_CHECKSUM front: got checksum 0x[0-9a-f]{8}; expected 0x[0-9a-f]{8}",
        refusal(data[:64] + bytes([data[64] ^ 7]) + data[65:]),
    )
    assert refusal(replace(draft_of(data), stream=lambda stream: stream + b"\0").file()) == (
        "BAD_CHUNK_TABLE front: got a stream that does not decode; expected a valid one"
    )
    assert refusal(data, limits_with(memory_bytes=1000)).startswith("LIMIT_EXCEEDED header: got a need of ")
    assert refusal(data, limits_with(table_bytes=99)) == (f"LIMIT_EXCEEDED front: got {front} bytes; the limit is 99")
    many = with_header(data, frame_count=1 << 20, segment_count=1 << 20, level_count=1)
    assert refusal(many) == (
        f"LIMIT_EXCEEDED tables: got {16 * (len(parts.chunks) + (1 << 20))} bytes; the limit is 16777216"
    )
    assert refusal(data, limits_with(hierarchy_depth=1)).startswith("LIMIT_EXCEEDED chunk HIERARCHY at byte ")


def test_a_refused_chunk_is_described_by_its_place_and_the_values_found_and_allowed(parts):
    def with_last(**change) -> bytes:
        """With other fields of the entry of AFFINES of level 1, segment 1."""
        chunks = list(parts.chunks)
        i = parts.index(ct.AFFINES, 1, 1)
        chunks[i] = replace(chunks[i][0], **change), chunks[i][1]
        return parts.with_chunks(chunks)

    chunk, _ = parts.chunks[parts.index(ct.AFFINES, 1, 1)]
    levels, segments = parts.header.level_count, parts.header.segment_count

    def refusal_of_last(**change) -> str:
        """Its offset depends on the length of the front, which the change may have changed."""
        return re.sub(r"at byte \d+", "at byte N", refusal(with_last(**change)))

    assert refusal_of_last(stage=9) == (
        f"BAD_CHUNK_TABLE chunk AFFINES of level {levels - 1}, segment 1 at byte N: got level 9; "
        f"expected 0 to {parts.header.stages[-1]}"
    )
    assert refusal_of_last(segment=99) == (
        f"BAD_CHUNK_TABLE chunk AFFINES of level 1, segment 99 at byte N: got segment 99; expected 0 to {segments - 1}"
    )
    assert refusal_of_last(kind=30) == (
        "UNKNOWN_CHUNK chunk kind 0x001e of level 1, segment 1 at byte N: "
        "got a required kind; expected one that this decoder knows"
    )
    assert refusal_of_last(kind=ct.STEMS).startswith(
        "BAD_CHUNK_TABLE chunk STEMS of level 1, segment 1 at byte N: got entry "
    )
    assert refusal(parts.file(), limits_with(chunk_bytes=1)).startswith("LIMIT_EXCEEDED chunk ")
    assert refusal(parts.with_chunks([entry for entry in parts.chunks if entry[0] != chunk])) == (
        "BAD_CHUNK_TABLE chunk table: got no AFFINES of level 1, segment 1; expected one"
    )
    assert refusal_of_last(kind=ct.EXACT) == (
        "BAD_CHUNK_TABLE chunk EXACT of level 1, segment 1 at byte N: got a chunk that the hierarchy does not ask for; "
        "expected none"
    )
    broken, rest = bytearray(parts.file()), parts.chunks[parts.index(ct.REST)][0]
    broken[rest.offset + 4] ^= 1
    assert re.fullmatch(
        f"BAD_CHECKSUM chunk REST at byte {rest.offset}: got checksum 0x[0-9a-f]{{8}}; expected {rest.checksum:#010x}",
        refusal(bytes(broken)),
    )
    assert re.fullmatch(
        r"BAD_CHUNK chunk REST at byte \d+: got content that does not decode; expected a valid stream",
        refusal(parts.with_payload(ct.REST, bytes(40))),
    )


def test_a_sentence_longer_than_the_room_for_it_is_cut_and_its_length_returned(data):
    fault = Fault()
    front(data[:12], None, fault)
    whole = b"header: got 12 bytes; expected 24"
    for room in range(len(whole) + 2):
        text = ctypes.create_string_buffer(b"\xa5" * 99, 99)
        assert core.ath_fault_text(byref(fault), text, room) == len(whole)
        assert text.raw[room:] == b"\xa5" * (99 - room)
        assert room == 0 or text.value == whole[: room - 1]


# ---- bytes ----


def test_a_prefix_that_is_too_short_says_how_many_bytes_to_come_back_with(data, player):
    prelude = player.info.prelude_length
    for size in range(prelude):
        result, needed, _ = front(data[:size])
        assert result == MISSING and size < needed <= prelude
    size, asked = 0, 0
    while (answer := front(data[:size]))[0] == MISSING:
        size, asked = answer[1], asked + 1
    assert answer == front(data) == (OK, prelude, player.memory.size) and size == prelude and asked <= 4
    memory = Memory(player.memory.size)
    for size in (0, 1, 100, prelude - 1):
        assert core.ath_open(memory.address, memory.size, data[:size], size, None, None) == MISSING
    assert core.ath_open(memory.address, memory.size, data[:prelude], prelude, None, None) == OK


def test_the_ranges_of_a_level_are_what_it_needs_fed_in_any_order(data, player):
    rng = np.random.default_rng(1)
    for level in player.levels:
        stream = Player(data, whole=False)
        ranges = stream.ranges(level, 0, player.info.segment_count - 1)
        assert stream.ranges(level, 0, player.info.segment_count - 1, fed_too=True) == ranges
        assert all(a + size < b for (a, size), (b, _) in zip(ranges, ranges[1:])), "ascending and joined"
        for i in rng.permutation(len(ranges)):
            assert MISSING in [stream.result_of_preparing(segment, level) for segment in stream.segments]
            stream.feed(*ranges[i])
        assert stream.ranges(level, 0, player.info.segment_count - 1) == []
        for segment in stream.segments:
            assert core.ath_ready_level(stream.address, segment) >= level
            whole, streamed = [player.prepare(segment, level)], [stream.prepare(segment, level)]
            for frame in range(player.start_of(segment), player.start_of(segment + 1)):
                assert np.array_equal(player.frame(whole, frame), stream.frame(streamed, frame))


def test_one_segment_plays_without_the_bytes_of_the_others(data, player):
    level, segment = player.levels[-1], player.segments[-1]
    stream = Player(data, whole=False)
    ranges, before = stream.ranges(level, segment, segment), core.ath_joined_to(stream.address, segment, level)
    most = 1.5 if before < 0 else 1.2  # which takes that one's too
    assert sum(size for _, size in ranges) < sum(size for _, size in stream.ranges(level, 0, segment)) / most
    for piece in ranges:
        stream.feed(*piece)
    ready = [core.ath_ready_level(stream.address, s) for s in stream.segments]
    assert ready[segment] == level and all(r == -1 for s, r in enumerate(ready[:segment]) if s != before)
    frame = player.start_of(segment)
    assert np.array_equal(
        stream.frame([stream.prepare(segment, level)], frame), player.frame([player.prepare(segment, level)], frame)
    )


def test_a_growing_prefix_makes_ready_one_level_after_the_other(data, player):
    stream = Player(data, whole=False)
    ready = np.full(player.info.segment_count, -1)
    for size in range(len(stream.prelude), len(data) + 1, 37):
        stream.kept.append(data[:size])
        core.ath_feed(stream.address, stream.kept[-1], 0, size)
        now = np.array([core.ath_ready_level(stream.address, segment) for segment in stream.segments])
        assert (now >= ready).all() and (np.diff(now) <= 0).all()
        if (now > ready).any():
            segment = int(np.argmax(now > ready))
            stream.prepare(segment, int(now[segment]))
        ready = now
    stream.feed(0, len(data))
    assert {core.ath_ready_level(stream.address, s) for s in stream.segments} == {player.levels[-1]}


def test_half_a_chunk_is_left_alone_and_dropped_bytes_are_missing_again(data, player):
    level = player.levels[-1]
    stream = Player(data, whole=False)
    (offset, size), *_ = stream.ranges(level, 0, 0)
    stream.feed(offset, size - 1)
    stream.feed(offset + 1, size - 1)
    assert core.ath_ready_level(stream.address, 0) < level
    stream.feed(0, len(data))
    core.ath_drop(stream.address, offset + size - 1, 1)
    missing = stream.ranges(level, 0, 0)
    assert len(missing) == 1 and missing[0][0] >= offset and sum(missing[0]) >= offset + size
    assert stream.result_of_preparing(0, level) == MISSING
    stream.feed(*missing[0])
    stream.prepare(0, level)


@pytest.fixture(scope="module")
def layered(layered_ath) -> bytes:
    return layered_ath.read_bytes()


def refined_rests(player: Player) -> list[Chunk]:
    return [
        chunk for chunk in core.ath_chunks(player.address)[: player.info.chunk_count] if chunk.kind == ct.REFINED_REST
    ]


def rest_of(player: Player, level: int) -> np.ndarray | None:
    """The rest pose that a level moves in file order; None where it has not been read."""
    rest = np.zeros((player.info.vertex_count, 3))
    result = core.ath_level_rest(player.address, level, FILE_ORDER, rest.ctypes.data, 24)
    assert result in (OK, BAD_ARGUMENT)
    return rest if result == OK else None


def test_a_refined_rest_pose_is_asked_for_until_it_is_read(layered):
    stream = Player(layered, whole=False)
    *others, first, second = refined_rests(stream)  # Level 1 may have one, too.
    for chunk in others:
        stream.feed(chunk.offset, chunk.length)
    level, last = second.level, stream.segments[-1]
    asked = stream.ranges(level, last, last)
    assert all(any(o <= c.offset and c.offset + c.length <= o + size for o, size in asked) for c in (first, second))
    assert stream.refine(level) == MISSING and "REFINED_REST" in text_of(stream.refusal)
    stream.feed(first.offset, first.length)
    assert stream.refine(level) == MISSING and stream.refine(first.level) == OK
    assert rest_of(stream, first.level) is not None and rest_of(stream, level) is None
    stream.feed(second.offset, second.length)
    assert stream.refine(level) == OK
    core.ath_drop(stream.address, 0, len(layered))
    lacking = sum(size for _, size in stream.ranges(level, last, last))
    assert lacking == sum(size for _, size in asked) - first.length - second.length
    for offset, size in stream.ranges(level, last, last):
        stream.feed(offset, size)
    assert stream.result_of_preparing(last, level) == OK


def test_a_rest_pose_of_level_1_is_read_for_it_and_matrices_are_of_that_of_their_level(stepwise_ath):
    data = stepwise_ath.read_bytes()
    stream = Player(data, whole=False)
    chunk = refined_rests(stream)[0]
    assert chunk.level == 1
    for offset, size in stream.ranges(0, 0, stream.segments[-1]):
        stream.feed(offset, size)
    assert stream.result_of_preparing(0, 0) == OK and rest_of(stream, 1) is None
    before = stream.frame([stream.prepare(0, 0)], 3)
    assert stream.refine(1) == MISSING and text_of(stream.refusal).startswith("chunk REFINED_REST of level 1")
    for offset, size in stream.ranges(1, 0, stream.segments[-1]):
        stream.feed(offset, size)
    assert stream.result_of_preparing(0, 1) == OK
    assert np.array_equal(stream.frame([stream.prepare(0, 0)], 3), before)
    level_0, *others = (rest_of(stream, level) for level in range(stream.info.depth_levels - 1))
    assert all(np.array_equal(rest, others[0]) for rest in others) and not np.array_equal(level_0, others[0])


def test_layers_are_built_in_any_order_and_play_the_same(layered):
    once, step_by_step = Player(layered), Player(layered)
    deepest = once.levels[-1]
    assert once.result_of_preparing(0, deepest) == OK
    for level in step_by_step.levels:
        segment = step_by_step.prepare(0, level)
        assert np.array_equal(step_by_step.frame([segment], 3), once.frame([once.prepare(0, level)], 3))


def test_the_rest_pose_of_a_level_is_that_of_its_layer(bushy_clip, monkeypatch):
    monkeypatch.setattr(start, "AT_ONCE_SHARE", 0.0)  # One pose for all layers would be smaller.
    # Its motion is about the rest pose of the source.
    player = Player(athcodec.encode(bushy_clip, rel_error=1e-4, ladder=LADDER, effort="fast"))
    assert player.refine(player.levels[-1]) == OK
    source = bushy_clip.rest[np.ctypeslib.as_array(core.ath_vertex_source(player.address), (player.info.vertex_count,))]
    errors = [np.abs(rest_of(player, level) - source).max() for level in player.levels]
    hierarchy = player.info.depth_levels
    assert len(set(errors[1:hierarchy])) == 1 and errors[0] >= errors[1] and hierarchy + 2 == player.info.level_count
    assert errors[hierarchy - 1] > 3 * errors[hierarchy] > 9 * errors[hierarchy + 1]


def test_a_level_whose_layers_are_not_built_is_not_prepared(layered):
    player = Player(layered)
    work, level = player.work(), player.info.depth_levels
    into = player.room(level)
    assert core.ath_prepare(work.address, work.size, player.address, 0, level, into.address, into.size) == NO_MEMORY
    size = c_size_t()
    for wrong in (-1, player.info.level_count, -(2**31), 2**31 - 1):
        assert core.ath_refine_size(player.address, wrong, byref(size), None) == BAD_ARGUMENT
        assert core.ath_refine(player.address, wrong, None, 0) == BAD_ARGUMENT
        assert rest_of(player, wrong) is None
    assert core.ath_refine_size(player.address, level, byref(size), None) == OK and size.value > 0
    for address, less in too_little(size.value):
        assert core.ath_refine(player.address, level, address, less) == NO_MEMORY
    assert player.prepare(0, level)


def test_a_damaged_rest_pose_of_a_layer_is_named_and_coarser_levels_play(layered):
    chunk = refined_rests(Player(layered))[1]
    at = chunk.offset + chunk.length - 1
    broken = Player(layered[:at] + bytes([layered[at] ^ 1]) + layered[at + 1 :])
    assert broken.result_of_preparing(0, chunk.level) == BAD_CHECKSUM
    assert text_of(broken.refusal).startswith(
        f"chunk REFINED_REST of level {chunk.level}, segment 0 at byte {chunk.offset}: "
    )
    parts = Parts.of(layered)
    empty = Player(parts.with_payload(ct.REFINED_REST, bytes(8), chunk.level))
    assert empty.result_of_preparing(0, chunk.level) == BAD_CHUNK and empty.refusal.level == chunk.level
    for player in (broken, empty):
        assert all(player.result_of_preparing(0, level) == OK for level in range(chunk.level))


def test_ranges_beyond_the_capacity_are_counted_and_not_written(data):
    stream = Player(data, whole=False)
    level, last = stream.levels[-1], stream.segments[-1]
    ranges = stream.ranges(level, last, last)
    assert len(ranges) >= 2
    buffer = Memory(16)
    assert core.ath_ranges(stream.address, level, last, last, 0, buffer.address, 1) == len(ranges)
    assert tuple(buffer.bytes.view(np.uint64)) == ranges[0]
    buffer.check()
    assert core.ath_ranges(stream.address, level, last, last, 0, None, 0) == len(ranges)


def test_a_damaged_chunk_is_named_and_its_segment_is_not_prepared(data, player):
    level, last = player.levels[-1], player.segments[-1]
    offset, size = player.ranges(level, last, last, fed_too=True)[-1]
    broken = Player(data[: offset + size - 1] + bytes([data[offset + size - 1] ^ 1]) + data[offset + size :])
    work, segment = broken.work(), broken.room(level)
    assert broken.try_to_prepare(last, level, work, segment) == BAD_CHECKSUM
    fault = Fault()
    core.ath_work_fault(work.address, byref(fault))
    chunk = core.ath_chunks(broken.address)[fault.chunk]
    assert (chunk.offset + chunk.length, chunk.segment) == (offset + size, last)
    assert core.ath_segment_index(segment.address) == core.ath_segment_level(segment.address) == -1
    assert broken.show([segment], 0)[0] == NOT_PREPARED


# ---- preparing ----


def test_single_steps_prepare_the_same_memory_as_one_go(player):
    work = player.work()
    for level in player.levels:
        into = player.room(level)
        player.prepare(0, level, work, into)
        whole = into.bytes.copy()
        into.bytes[:] = 0
        work.bytes[:] = GUARD
        assert player.start(0, level, work, into) == OK and core.ath_prepare_step(work.address, 0) == MORE
        steps = 1
        while core.ath_prepare_step(work.address, 1) == MORE:
            assert core.ath_segment_level(into.address) == -1, "not to be played before it is done"
            steps += 1
        assert core.ath_segment_level(into.address) == level
        assert core.ath_prepare_step(work.address, 1) == OK, "once more does no harm"
        assert np.array_equal(into.bytes, whole) and steps > player.info.branch_count


def test_the_number_of_steps_is_known_before(player):
    """So a player can spread a preparation over the frames that it has until then, as examples/play.c does."""
    work = player.work()
    for level in player.levels:
        into = player.room(level)
        assert player.start(0, level, work, into) == OK
        steps = core.ath_prepare_steps(player.address, 0, level)
        assert core.ath_prepare_step(work.address, steps - 1) == MORE
        assert core.ath_prepare_step(work.address, 1) == OK


def test_threads_prepare_from_one_file_at_the_same_time(player):
    jobs = [(segment, level) for level in player.levels for segment in player.segments]
    alone = {job: player.prepare(*job) for job in jobs}

    def prepare(order) -> dict:
        work = player.work()
        return {job: player.prepare(*job, work) for job in order}

    with ThreadPoolExecutor(2) as threads:
        together = list(threads.map(prepare, (jobs, jobs[::-1])))
    for segment, level in jobs:
        for frame in range(player.start_of(segment), player.start_of(segment + 1)):
            one, *others = [player.frame([done[segment, level]], frame) for done in (alone, *together)]
            assert all(np.array_equal(one, other) for other in others)


@pytest.mark.parametrize(
    "name, options, goes",
    [
        ("tree", {"segment_frames": 50, "ladder": "none", "rel_error": 1e-3}, True),
        ("tree", {"segment_frames": 50, "ladder": LADDER, "rel_error": 1e-4}, True),
        ("tree", {"segment_frames": 50, "ladder": "none", "rel_error": 1e-3, "lossless": True}, True),
        ("growth", {"segment_frames": 50, "ladder": "none", "rel_error": 1e-3}, True),
        ("last branches first", {"segment_frames": 16, "ladder": "none", "rel_error": 1e-3}, True),
        ("last branches first", {"segment_frames": 16, "ladder": LADDER, "rel_error": 1e-4}, True),
        ("last branches first", {"segment_frames": 16, "ladder": "none", "rel_error": 1e-3, "lossless": True}, True),
        ("doubles", {"segment_frames": 16, "ladder": "none", "rel_error": 1e-3}, True),
        ("predicted", {"segment_frames": 16, "ladder": LADDER, "rel_error": 1e-4}, False),
        ("mixed", {"rel_error": 1e-2}, False),
    ],
    ids=[
        *("transformed", "layers", "lossless", "predicted"),
        *(f"branches in another order, {how}" for how in ("one layer", "layers", "lossless", "doubles", "predicted")),
        "branches mixed",
    ],
)
def test_positions_go_to_the_callers_memory_at_levels_of_all_vertices_in_the_order_of_the_source(name, options, goes):
    """The segments are joined, too; frames of the growth repeat. What cannot go there is not touched."""
    clips = {
        "last branches first": lambda: last_branches_first(7),
        "predicted": lambda: last_branches_first(6),
        "doubles": lambda: last_branches_first(7, dtype=np.float64, offset=1e3, scale=1e6),
        "mixed": lambda: awkward(6, branches=6, shuffled=True),
        "growth": flowing_growth,
    }
    clip = clips[name]() if name in clips else athcodec.read(athcodec.sample_path(name))
    player, went = Player(athcodec.encode(clip, attributes="none", effort="fast", **options)), set()
    for level, segment in itertools.product(player.levels, player.segments):
        alone, work = player.prepare(segment, level), player.work()
        into = Memory(core.ath_segment_size_to(player.address, segment, level))
        frames = range(player.start_of(segment), player.start_of(segment + 1))
        assert player.start(segment, level, work, into) == OK
        if into.size < core.ath_segment_size(player.address, level):
            assert core.ath_prepare_step(work.address, 1) == NO_MEMORY, (
                "only ath_prepare_to gives it room for positions"
            )
            assert player.start(segment, level, work, into) == OK
        number = 8 if player.info.is_float64 else 4
        positions = Memory(len(frames) * player.info.vertex_count * 3 * number)
        result = core.ath_prepare_to(work.address, positions.address)
        assert result in (OK, BAD_ARGUMENT)
        assert core.ath_prepare_step(work.address, 2**31 - 1) == OK
        for memory in (work, into, positions):
            memory.check()
        shown = shown_of(player, alone)
        assert np.array_equal(shown_of(player, into), shown)
        if result == OK:
            went.add((level, segment))
            assert np.array_equal(positions.bytes.view(f"f{number}").reshape(shown.shape), shown)
        else:
            assert not positions.bytes.any()
    repeats = ctypes.string_at(core.ath_repeats(player.address), player.info.frame_count)
    steady = [own for own in player.segments if not any(repeats[player.start_of(own) : player.start_of(own + 1)])]
    assert steady and went == set(
        itertools.product(player.levels[player.info.depth_levels - 1 :], steady if goes else [])
    )


# ---- going on ----


def levels_to_go_on_from(player: Player) -> range:
    return range(player.info.depth_levels - 1, player.info.level_count - 1)


def last_branches_first(seed: int, **how) -> athcodec.MotionClip:
    """A plant whose branches stand in the source from the last to the first, the vertices of each side by side."""
    clip = awkward(seed, branches=8, frames=40, **how)
    order = np.argsort(-clip.vertex_branch, kind="stable")
    return clip.replace(
        positions=clip.positions[:, order], rest=clip.rest[order], vertex_branch=clip.vertex_branch[order]
    )


def shown_of(player: Player, segment: Memory) -> np.ndarray:
    """The segment's memory from the last of its positions back: all that it shows."""
    index = core.ath_segment_index(segment.address)
    frames = range(player.start_of(index), player.start_of(index + 1))
    xyz = np.empty((len(frames), player.info.vertex_count, 3))
    for frame, out in zip(frames, xyz):
        assert core.ath_positions_float64(*player.at([segment], frame), SOURCE_ORDER, out.ctypes.data, 24) == OK
    return xyz


GIVEN = {"rel_error": 1e-4, "segment_frames": 16, "attributes": "none", "tam": athcodec.Thresholds(0, 0, 0, 0)}
REFINED = {
    "layers": ("bushy_clip", {"ladder": LADDER}),
    "shapes": ("full_clip", {"ladder": LADDER, "rest_error": "bound"}),
    "time bases": ("bushy_clip", {"ladder": (1e-1, 1e-2), "rel_error": 1e-3, "segment_frames": 32}),
    "clips": ("medley_clips", {"ladder": (1e-2, 5e-4)}),
    "lossless": ("full_clip", {"ladder": LADDER, "lossless": True, "rest_error": "bound"}),
    "float64": ("distant_clip", {"ladder": LADDER, "lossless": True}),
    "one layer": ("full_clip", {"lossless": True, "rest_error": "bound"}),
}


@pytest.fixture(scope="module")
def distant_clip():
    """So far away that its positions are doubles."""
    return awkward(seed=8, branches=9, frames=40, dtype=np.float64, offset=1e3, motion="sway")


def all_learned(settings: Settings, trials: Trials) -> Settings:
    return replace(settings, learned_bases=(True,) * settings.stages)


@pytest.fixture(scope="module", params=REFINED)
def refined(request) -> Player:
    """Files with all that is kept: learned shapes and time bases, rotations and shifts, float64; several clips."""
    name, options = REFINED[request.param]
    clip = request.getfixturevalue(name)
    clip = athcodec.join(clip) if isinstance(clip, dict) else clip
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "time bases":
            patch.setitem(search.BY_NAME, "best_bases", all_learned)
            patch.setitem(search.CHOICES, all_learned, "time bases")
        return Player(athcodec.encode(clip, **GIVEN | options))


def test_going_on_from_any_level_to_any_deeper_one_gives_what_preparing_it_does(refined):
    """Level by level, too, where each keeps what the next goes on from."""
    for segment in refined.segments:
        levels = [*levels_to_go_on_from(refined), refined.levels[-1]]
        expected = {level: shown_of(refined, refined.prepare(segment, level)) for level in levels}
        chain = refined.prepare_and_keep(segment, levels[0])
        for level in levels[:-1]:
            before = refined.prepare_and_keep(segment, level)
            for deeper in range(level + 1, levels[-1] + 1):
                assert np.array_equal(shown_of(refined, refined.go_on(before, deeper)[0]), expected[deeper])
            chain = refined.go_on(chain, level + 1)
            assert np.array_equal(shown_of(refined, chain[0]), expected[level + 1])
            assert core.ath_segment_level(chain[0].address) == level + 1


def test_bytes_of_earlier_levels_may_be_dropped_before_going_on(refined):
    player, last = Player(refined.data), refined.segments[-1]
    for level in levels_to_go_on_from(player):
        deeper = level + 1
        expected = shown_of(refined, refined.prepare(last, deeper))
        before = player.prepare_and_keep(last, level)
        joined_to = core.ath_joined_to(player.address, last, deeper)
        beside = player.prepare(joined_to, deeper) if joined_to >= 0 else None
        core.ath_drop(player.address, 0, len(player.data))
        assert player.result_of_preparing(last, deeper) == MISSING
        ranges = (Range * 100)()
        count = core.ath_onward_ranges(player.address, level, deeper, last, last, 0, ranges, 100)
        for wanted in ranges[:count]:
            player.feed(wanted.offset, wanted.size)
        assert core.ath_onward_ranges(player.address, level, deeper, last, last, 0, None, 0) == 0
        assert sum(r.size for r in ranges[:count]) < sum(size for _, size in player.ranges(deeper, last, last, True))
        assert np.array_equal(shown_of(player, player.go_on(before, deeper, beside)[0]), expected)
        player.feed(0, len(player.data))


def test_what_is_kept_is_small_and_kept_only_where_it_serves(player):
    for level in player.levels:
        room = core.ath_keep_size(player.address, level)
        segment, kept = player.prepare_and_keep(0, level)
        assert (kept.size > 0) == (room > 0) and kept.size <= room
        assert kept.size < core.ath_segment_size(player.address, level)
        if room == 0:
            lossless = level == player.info.level_count - 2 and kept.size == 0
            assert not core.ath_goes_on(player.address, segment.address, None, level + 1) or lossless


def test_without_room_nothing_is_kept_and_the_segment_is_prepared(layered):
    player = Player(layered)
    level = player.info.depth_levels - 1
    expected, kept = player.prepare_and_keep(0, level)
    for size in (16, 17, 64, kept.size // 2, kept.size):
        work, into, room = player.work(), player.room(level), Memory(size)
        assert player.start(0, level, work, into) == OK
        assert core.ath_keep(work.address, room.address, room.size) == OK
        segment, found = player.finish(work, into, room)
        assert found.size == 0 and np.array_equal(shown_of(player, segment), shown_of(player, expected))
        assert player.start_onward((segment, room), level + 1, work, player.room(level + 1)) == BAD_ARGUMENT
    assert player.start(0, level, work, into) == OK
    for address, size in too_little(16):
        assert core.ath_keep(work.address, address, size) == NO_MEMORY


def test_going_on_from_what_does_not_fit_is_a_bad_argument(layered):
    player = Player(layered)
    level, deepest = player.info.depth_levels - 1, player.levels[-1]
    before, other, coarse = (player.prepare_and_keep(*place) for place in ((0, level), (1, level), (0, level - 1)))
    deeper, unprepared = player.go_on(before, level + 1), (player.room(level), before[1])
    assert player.start(0, level, player.work(), unprepared[0]) == OK
    nothing = Memory(0)
    for (segment, kept), wanted in [
        *[(before, place) for place in (-1, 0, level, deepest + 1)],
        *[((before[0], of), deepest) for of in (nothing, other[1], deeper[1])],
        *[(of, deepest) for of in (coarse, (coarse[0], before[1]), unprepared)],
    ]:
        address = kept.size and kept.address
        assert core.ath_goes_on(player.address, segment.address, address, wanted) == 0
        work, into = player.work(), player.room(deepest)
        arguments = work.address, work.size, player.address, segment.address, address, wanted, into.address, into.size
        assert core.ath_prepare_onward(*arguments) == BAD_ARGUMENT
    assert core.ath_goes_on(player.address, before[0].address, before[1].address, deepest) == 1


def test_a_damaged_refinement_leaves_the_level_before_playable(refined):
    level = refined.info.depth_levels - 1
    player = Player(refined.data)
    (offset, size), *_ = [
        (chunk.offset, chunk.length)
        for chunk in core.ath_chunks(player.address)[: player.info.chunk_count]
        if chunk.level == level + 1 and chunk.segment == 0 and chunk.kind in (ct.STEMS, ct.EXACT)
    ]
    before = player.prepare_and_keep(0, level)
    expected, kept = shown_of(player, before[0]), before[1].bytes.copy()
    damaged = bytearray(player.data[offset : offset + size])
    damaged[size // 2] ^= 1
    player.kept.append(damaged := bytes(damaged))
    core.ath_feed(player.address, damaged, offset, size)
    work, into = player.work(), player.room(level + 1)
    assert player.start_onward(before, level + 1, work, into) == OK
    assert core.ath_prepare_step(work.address, 2**31 - 1) == BAD_CHECKSUM
    assert core.ath_segment_level(into.address) == -1
    assert np.array_equal(shown_of(player, before[0]), expected) and np.array_equal(before[1].bytes, kept)
    player.feed(offset, size)
    assert player.go_on(before, level + 1)


def test_going_on_takes_no_more_steps_than_preparing(layered):
    player = Player(layered)
    for level in levels_to_go_on_from(player):
        work, into = player.work(), player.room(level + 1)
        assert player.start_onward(player.prepare_and_keep(0, level), level + 1, work, into) == OK
        steps = core.ath_prepare_steps(player.address, 0, level + 1)
        assert core.ath_prepare_step(work.address, steps) == OK


# ---- what is shown ----


def test_frames_are_those_of_python_bit_for_bit_in_any_order_of_play(data, player):
    with athcodec.open(data) as decoder:
        for level in player.levels:
            expected = decoder.positions(level=level)
            prepared = player.prepare_all(level)
            order = list(range(len(expected)))
            at_random = np.random.default_rng(level).permutation(len(expected))
            for frame in [*order, *order[::-1], *at_random]:
                assert np.array_equal(player.frame(prepared[::-1], float(frame)), expected[frame])


def test_between_two_frames_is_their_blend_forwards_and_backwards(player):
    for level in player.levels:
        prepared = player.prepare_all(level)
        places = np.linspace(0, player.info.frame_count, 60, endpoint=False)
        forwards = [player.frame(prepared, place) for place in places]
        backwards = [player.frame(prepared, place) for place in places[::-1]][::-1]
        assert np.array_equal(forwards, backwards)
        whole = np.array([player.frame(prepared, t) for t in range(player.info.frame_count)], np.float64)
        scale = np.abs(whole).max()
        for place, shown in zip(places, forwards):
            i = int(place)
            j = player.after(i)
            blended = whole[i] + (whole[j] - whole[i]) * (place - i)
            assert np.allclose(shown, blended, rtol=0, atol=1e-6 * scale)


def shaded_by(parts: list[Part], matrices: Memory, points: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """What the vertex shader of examples/play.c makes of a cut, in file order."""
    shaded, maps = np.zeros((len(rest), 3)), matrices.bytes.view(np.float32).reshape(-1, 3, 4)
    for p in parts:
        own = slice(p.first, p.first + p.count)
        if p.branch < 0:
            shaded[own] = points[p.index : p.index + p.count]
        else:
            shaded[own] = rest[own] @ maps[p.index, :, :3].T + maps[p.index, :, 3]
    return shaded


def test_matrices_and_exact_vertices_of_a_cut_are_the_positions(player):
    for level in player.levels:
        assert player.refine(level) == OK
        rest = rest_of(player, level).astype(np.float32)
        parts, nodes, exact = cut(player, level)
        assert [v for p in parts for v in range(p.first, p.first + p.count)] == list(range(len(rest)))
        assert (nodes == 0) == (level >= player.info.depth_levels - 1) and (exact > 0 or level == 0)
        prepared = player.prepare_all(level)
        for frame in (0.0, 1.5, player.info.frame_count - 1.0, player.info.frame_count - 0.25):
            matrices, points = Memory(48 * nodes), Memory(12 * exact)
            show = player.at(prepared, frame)
            assert core.ath_matrices(*show, matrices.address, 48) == OK
            assert core.ath_exact(*show, points.address, 12) == OK
            matrices.check()
            points.check()
            shaded = shaded_by(parts, matrices, points.bytes.view(np.float32).reshape(-1, 3), rest)
            result, xyz = player.show(prepared, frame, FILE_ORDER)
            assert result == OK and np.allclose(shaded, xyz, rtol=0, atol=4e-6 * np.abs(rest).max())


def cut(player: Player, level: int) -> tuple[list[Part], int, int]:
    """Parts, number of nodes, number of exact vertices."""
    parts, nodes, exact = c_int32(), c_int32(), c_int32()
    core.ath_cut_size(player.address, level, byref(parts), byref(nodes), byref(exact))
    buffer = (Part * parts.value)()
    core.ath_cut(player.address, level, buffer)
    return list(buffer), nodes.value, exact.value


def test_orders_strides_and_widths_hold_the_same_positions(player):
    count = player.info.vertex_count
    source = np.ctypeslib.as_array(core.ath_vertex_source(player.address), (count,))
    for level in (0, player.levels[-1]):
        prepared = player.prepare_all(level)
        _, in_file_order = player.show(prepared, 3.25, FILE_ORDER)
        in_source_order = player.frame(prepared, 3.25)
        assert np.array_equal(in_source_order[source], in_file_order)
        show = player.at(prepared, 3.25)
        vertices, wide = Memory(20 * count), Memory(32 * count)
        assert core.ath_positions(*show, SOURCE_ORDER, vertices.address, 20) == OK
        assert core.ath_positions_float64(*show, SOURCE_ORDER, wide.address, 32) == OK
        for memory in (vertices, wide):
            memory.check()
        for table in (vertices.bytes.view(np.float32).reshape(-1, 5), wide.bytes.view(np.float64).reshape(-1, 4)):
            assert np.array_equal(table[:, :3].astype(np.float32), in_source_order) and not table[:, 3:].any()


def test_between_segments_the_nearer_frame_that_is_there_is_held(player):
    last, first = player.start_of(1) - 1, player.start_of(1)
    fine, coarse = player.levels[-1], player.levels[-2]
    before, after, other = player.prepare(0, fine), player.prepare(1, fine), player.prepare(1, coarse)
    at = {frame: player.frame([before, after], frame) for frame in (last, first)}
    coarse_first = player.frame([other], first)
    for weight in (0.25, 0.75):
        result, blended = player.show([None, after, before], last + weight)
        assert result == OK and not any(np.array_equal(blended, xyz) for xyz in at.values())
        for prepared, shown in (
            ([before], at[last]),
            ([None, after], at[first]),
            ([before, other], at[last] if weight < 0.5 else coarse_first),
        ):
            result, xyz = player.show(prepared, last + weight)
            assert result == HELD and np.array_equal(xyz, shown)
        result, xyz = player.show([other, before, after], last + weight)
        assert result == OK and np.array_equal(xyz, blended), "two of one level are there"


# ---- from level to level ----


def fade_of(*steps: tuple[int, float]) -> Fade:
    fade = Fade()
    for level, share in steps:
        core.ath_fade_to(byref(fade), level, share)
    return fade


def test_a_fade_shows_the_first_level_and_one_after_a_pause_at_once():
    assert fade_of((2, 0.1)).weights == {2: 1}
    assert fade_of((2, 0), (5, 1)).weights == fade_of((2, 0), (1, 0), (5, float("inf"))).weights == {5: 1}
    assert fade_of((2, 0), (5, 0), *[(5, 0.26)] * 4).weights == {5: 1}
    assert fade_of((2, 0), (5, 0), (5, 1)).weights == {5: 1}
    assert core.ath_fade_cut(byref(fade_of((1, 0), (4, 0), (2, 0.5)))) == 4 and core.ath_fade_cut(byref(Fade())) == -1


def test_a_fade_goes_smoothly_from_level_to_level_also_where_it_is_overtaken():
    """The weights change by at most 1.5 times what is linear, and their change by what a smoothstep's does."""
    step, fade, rows = 1 / 64, Fade(), []
    wanted = [0] * 4 + [3] * 20 + [1] * 30 + [3] * 5 + [0] * 5 + [2] * 5 + [1] * 5 + [3] * 200
    for level in wanted:
        core.ath_fade_to(byref(fade), level, step)
        rows.append([fade.weights.get(level, 0.0) for level in range(4)])
    weights = np.array(rows)
    assert np.allclose(weights.sum(axis=1), 1, rtol=0, atol=1e-12) and weights.min() >= -1e-12
    assert np.abs(np.diff(weights, axis=0)).max() <= 2 * 1.5 * step  # one level may fade out twice at once
    assert np.abs(np.diff(weights, 2, axis=0)).max() <= 4 * 6 * step**2
    assert {row.tolist().index(1) for row in weights if row.max() == 1} == {0, 3}
    assert (weights.max(axis=0) > 0.03).all(), "a level that was asked for was left out"
    assert weights[-1].tolist() == [0, 0, 0, 1]


def test_what_fades_is_the_blend_of_its_levels_as_positions_and_as_matrices(player):
    """Also where the deepest one has no weight yet. Level 0 moves the rest pose of level 1, which may be finer."""
    count, deepest = player.info.vertex_count, player.levels[-1]
    middle = max(1, player.info.depth_levels - 2)
    for levels in {(0, middle), (middle, 0), (1, middle, deepest), (deepest, 0, 1), (middle, deepest, middle)}:
        fade = fade_of((levels[0], 0), *[(level, 0.4) for level in levels[1:]])
        for _ in range(2):
            prepared = [segment for level in levels for segment in player.prepare_all(level)]
            by_level = {level: player.prepare_all(level) for level in levels}
            cut_level, place = core.ath_fade_cut(byref(fade)), 1.5
            assert cut_level == max(levels)
            wanted = sum(
                weight * player.show(by_level[level], place, FILE_ORDER)[1].astype(float)
                for level, weight in fade.weights.items()
            )
            parts, nodes, exact = cut(player, cut_level)
            xyz, matrices, points = Memory(12 * count), Memory(48 * nodes), Memory(12 * exact)
            show = player.at(prepared, place)
            assert core.ath_faded_positions(*show, byref(fade), FILE_ORDER, xyz.address, 12) == OK
            assert core.ath_faded_matrices(*show, byref(fade), matrices.address, 48) == OK
            assert core.ath_faded_exact(*show, byref(fade), points.address, 12) == OK
            for memory in (xyz, matrices, points):
                memory.check()
            size = np.abs(wanted).max()
            faded = xyz.bytes.view(np.float32).reshape(-1, 3)
            assert np.allclose(faded, wanted, rtol=0, atol=2e-6 * size)
            rest = rest_of(player, min(1, cut_level))
            drawn = sum(
                weight * on_rest(player, by_level[level], level, place, rest) for level, weight in fade.weights.items()
            )
            shaded = shaded_by(parts, matrices, points.bytes.view(np.float32).reshape(-1, 3), rest)
            assert np.allclose(shaded, drawn, rtol=0, atol=4e-6 * size)
            core.ath_fade_to(byref(fade), levels[-1], 0.2)


def on_rest(player: Player, prepared: list[Memory], level: int, place: float, rest: np.ndarray) -> np.ndarray:
    """What a level shows where its matrices move this rest pose, in file order."""
    parts, nodes, _ = cut(player, level)
    matrices, shown = Memory(48 * nodes), player.show(prepared, place, FILE_ORDER)[1]
    assert core.ath_matrices(*player.at(prepared, place), matrices.address, 48) == OK
    exact = [v for p in parts if p.branch < 0 for v in range(p.first, p.first + p.count)]
    return shaded_by(parts, matrices, shown[exact], rest)


def test_a_fade_that_lacks_a_level_writes_nothing(player):
    fade, deepest = fade_of((0, 0), (1, 0), (1, 0.5)), player.prepare_all(1)
    xyz = np.full((player.info.vertex_count, 3), np.nan, np.float32)
    for prepared in ([], deepest, player.prepare_all(0), [*deepest, player.prepare(player.segments[-1], 0)]):
        show = player.at(prepared, 0.5)
        for call, before in (
            (core.ath_faded_positions, (byref(fade), FILE_ORDER)),
            (core.ath_faded_matrices, (byref(fade),)),
            (core.ath_faded_exact, (byref(fade),)),
        ):
            assert call(*show, *before, xyz.ctypes.data, 12) == NOT_PREPARED and np.isnan(xyz).all()


@pytest.mark.parametrize("per_frame", [0, 1 / 8])
def test_no_vertex_jumps_where_the_level_changes(player, per_frame):
    """In no drawn frame does one go further than a level takes it and its share of the way between levels; going over
    at once does, as is seen where time stands still."""
    duration = 24  # of a fade, in drawn frames, for each of which `per_frame` frames of the file pass
    wanted = [0] * 6 + [player.levels[-1]] * 10 + [1] * 40
    prepared = {level: player.prepare_all(level) for level in set(wanted)}
    together = list(itertools.chain.from_iterable(prepared.values()))
    places = np.arange(len(wanted)) * per_frame
    shown = {level: np.array([player.frame(prepared[level], place) for place in places]) for level in prepared}
    own = max(np.abs(np.diff(xyz, axis=0)).max() for xyz in shown.values())
    apart = max(np.abs(a - b).max() for a, b in itertools.combinations(shown.values(), 2))
    fade, faded = Fade(), []
    for level, place in zip(wanted, places):
        core.ath_fade_to(byref(fade), level, 1 / duration)
        faded.append(xyz := np.zeros((player.info.vertex_count, 3), np.float32))
        show = player.at(together, place)
        assert core.ath_faded_positions(*show, byref(fade), SOURCE_ORDER, xyz.ctypes.data, 12) == OK
    at_once = np.array([shown[level][i] for i, level in enumerate(wanted)])
    most = own + 2 * 1.5 / duration * apart  # two changes are under way
    assert np.abs(np.diff(faded, axis=0)).max() <= 1.001 * most
    assert np.array_equal(faded[-1], at_once[-1]) and np.array_equal(faded[5], at_once[5])
    assert per_frame or np.abs(np.diff(at_once, axis=0)).max() > 2 * most


def test_without_a_segment_that_has_the_frame_nothing_is_written(player):
    first, unprepared, work = player.prepare(0, 0), player.room(0), player.work()
    assert player.start(1, 0, work, unprepared) == OK
    for prepared in ([], [None], [first], [first, unprepared]):
        result, xyz = player.show(prepared, player.start_of(1))
        assert result == NOT_PREPARED and np.isnan(xyz).all()


# ---- time ----


def frame_at(player: Player, clip: int, seconds: float, wrap: int) -> float:
    """Counted from the clip's first."""
    return core.ath_frame_at(player.address, clip, seconds, wrap) - player.clips[clip].first_frame


def expected_frame(times: np.ndarray, seconds: float, wrap: int) -> float:
    """The same in other words: unrolled tracks of frames over time, looked up by interpolation."""
    last = len(times) - 1
    if last == 0:
        return 0
    length, step = times[-1], times[-1] / last
    if wrap == CLAMP:
        return np.interp(seconds, times, np.arange(last + 1))
    if wrap == LOOP:
        return np.interp(seconds % (length + step), [*times, length + step], np.arange(last + 2))
    track = [*times, *(2 * length - times[-2::-1])], [*range(last + 1), *range(last - 1, -1, -1)]
    return np.interp(seconds % (2 * length), *track)


@pytest.mark.parametrize("wrap", [CLAMP, LOOP, PING_PONG], ids=["clamp", "loop", "ping-pong"])
def test_time_is_clamped_looped_or_turned_back_with_uneven_steps_too(wrap, player):
    for index, clip in enumerate(player.clips):
        times = player.times_of(clip)
        times = times - times[0]
        assert clip.duration == times[-1]
        for i in range(clip.frame_count - 1):
            assert frame_at(player, index, times[i], wrap) == i, "frames are hit exactly"
        for seconds in np.linspace(-3.3, 4.1, 500) * times[-1]:
            expected = expected_frame(times, seconds, wrap)
            assert frame_at(player, index, seconds, wrap) == pytest.approx(expected, abs=1e-6)
            assert 0 <= frame_at(player, index, seconds, wrap) < clip.frame_count, "that of another clip"
        for seconds in (float("nan"), float("inf"), float("-inf"), 1e300, -1e300):
            assert 0 <= frame_at(player, index, seconds, wrap) <= clip.frame_count - 1


def test_a_clip_that_is_a_loop_is_played_as_one_where_its_mark_decides(player):
    for index, clip in enumerate(player.clips):
        for seconds in np.linspace(0, 3, 50) * clip.duration:
            marked = frame_at(player, index, seconds, LOOP if clip.loop else CLAMP)
            assert frame_at(player, index, seconds, AS_MARKED) == marked


def test_clips_are_found_by_name_and_follow_each_other(player):
    frame = segment = 0
    for index, clip in enumerate(player.clips):
        assert core.ath_clip_named(player.address, clip.name) == index
        assert (clip.first_frame, clip.first_segment) == (frame, segment)
        frame, segment = frame + clip.frame_count, segment + clip.segment_count
        assert player.start_of(clip.first_segment) == clip.first_frame
    assert (frame, segment) == (player.info.frame_count, player.info.segment_count)
    for nobody in (b"nobody", b"calm ", b"cal"):
        assert core.ath_clip_named(player.address, nobody) == -1


def test_a_loop_blends_the_last_frame_into_the_first(player):
    for index, clip in enumerate(player.clips):
        if clip.frame_count == 1:
            continue
        last = clip.frame_count - 1
        step = clip.duration / last
        place = core.ath_frame_at(player.address, index, clip.duration + step / 4, LOOP)
        blend = core.ath_blend_at(player.address, place)
        assert tuple(blend.frame) == (clip.first_frame + last, clip.first_frame)
        assert blend.weight == pytest.approx(0.25)
        assert tuple(blend.segment) == (clip.first_segment + clip.segment_count - 1, clip.first_segment)
        assert frame_at(player, index, clip.duration + step / 4, CLAMP) == last


def test_a_blend_names_the_segments_of_its_frames(player):
    for frame in range(player.info.frame_count):
        segment = core.ath_segment_of(player.address, frame)
        assert player.start_of(segment) <= frame < player.start_of(segment + 1)
        blend = core.ath_blend_at(player.address, float(frame))
        assert (*blend.frame, *blend.segment, blend.weight) == (frame, frame, segment, segment, 0.0)
    border = core.ath_blend_at(player.address, player.start_of(1) - 0.25)
    assert tuple(border.segment) == (0, 1) and border.weight == 0.75


# ---- level of detail ----


def test_a_distance_asks_for_the_coarsest_level_whose_error_is_not_seen(player):
    def level_for(segments, distance, pixels=1.0):
        return core.ath_level_for(player.address, *segments, measure, distance, 1.0, 1080.0, pixels)

    ranges = (0, player.segments[-1]), *((segment, segment) for segment in player.segments)
    for measure, segments in itertools.product(range(3), ranges):
        worst = [core.ath_level_error(player.address, level, *segments, measure) for level in player.levels]
        unit = 1080 / (2 * np.tan(0.5))
        distances = np.geomspace(worst[-1] * unit / 10, worst[0] * unit * 10, 200)
        levels = [level_for(segments, distance) for distance in distances]
        for distance, level in zip(distances, levels):
            under = [finer for finer in player.levels if worst[finer] * unit / distance <= 1.0]
            assert level == (under[0] if under else player.levels[-1])
            assert level_for(segments, distance, 0.5) >= level
        assert (np.diff(levels) <= 0).all() and (levels[0], levels[-1]) == (player.levels[-1], 0)
        for nowhere in (0.0, -1.0, float("nan")):
            assert level_for(segments, nowhere) == player.levels[-1]
