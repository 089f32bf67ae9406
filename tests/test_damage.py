"""Damaged and hostile files: an error of errors.py or a played level, never a crash, a hang or a flood of memory.

Damage by accident is met by the checksums. Malice repairs them: `Parts` takes a file to pieces and puts it
together again with whatever a test has changed, checksums included. Whatever its front has become, the two that
read it must agree: the core, and FORMAT.md's code.
"""

from __future__ import annotations

import re
import struct
import sys
import tracemalloc
from collections.abc import Sequence
from dataclasses import astuple, fields, replace
from io import BytesIO
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
import zstandard
from files import COUNTS, Parts, opened, with_checksum, with_header
from hostile_files import segments_of_one_frame

import athcodec
from athcodec import errors
from athcodec.decoding import container as ct
from athcodec.decoding import core_file
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.container import Limits
from athcodec.errors import (
    BadChecksum,
    BadChunk,
    BadChunkTable,
    BadHeader,
    FormatError,
    LevelUnavailable,
    LimitExceeded,
    NotAnAthFile,
    Truncated,
    UnknownChunk,
    UnsupportedFeature,
    UnsupportedVersion,
)
from spec import conformance
from spec.document import rules

REFUSED = (FormatError, LevelUnavailable)
TAM = athcodec.Thresholds(0, 0, 0, 0)  # with modes, whatever is smaller
IN_MODES = {"segment_frames": 16, "tam": TAM, "ladder": "none", "rest_error": "bound"}


@pytest.fixture(scope="module")
def data(full_ath) -> bytes:
    return full_ath.read_bytes()


@pytest.fixture(scope="module")
def parts(data) -> Parts:
    return Parts.of(data)


@pytest.fixture(scope="module")
def fine_parts(other_full_clip) -> Parts:
    """Coded so finely that stems of level 2 happen to mean something without SHAPES, too."""
    return Parts.of(athcodec.encode(other_full_clip, rel_error=3e-5, **IN_MODES))


@pytest.fixture(scope="module")
def layered_parts(layered_ath) -> Parts:
    return Parts.of(layered_ath.read_bytes())


@pytest.fixture(scope="module")
def medley_parts(medley_ath) -> Parts:
    """Several clips."""
    return Parts.of(medley_ath.read_bytes())


@pytest.fixture(scope="module")
def lossless_parts(full_clip) -> Parts:
    return Parts.of(athcodec.encode(full_clip, lossless=True, **IN_MODES))


@pytest.fixture(scope="module")
def split_parts(full_clip) -> Parts:
    """Every other vertex is split, as at the edges of a mesh with flat shading."""
    split = np.append(np.arange(full_clip.vertex_count), np.arange(0, full_clip.vertex_count, 2))
    return Parts.of(athcodec.encode(full_clip.block(0, 20)[:, split], rel_error=1e-4, effort="fast"))


@pytest.fixture(scope="module")
def predicted_parts(predicted_ath) -> Parts:
    return Parts.of(predicted_ath.read_bytes())


@pytest.fixture(scope="module")
def played(data) -> list[np.ndarray]:
    """Positions of every level."""
    decoder = athcodec.open(BytesIO(data))
    return [decoder.positions(level=level) for level in range(decoder.file.level_count)]


def check(data: bytes, **options) -> None:
    opened(data, **options).file.check()


def use(data: bytes, **options) -> bool:
    """Asks for everything that a file may hold. Whether it answered; raises what is neither answer nor refusal."""
    asks = [lambda d: d.file.check(), lambda d: d.affines(0), lambda d: d.residual(0, 0), lambda d: d.file.info()]
    asks += [lambda d: [d.play(clip.name).positions() for clip in d.file.clips[1:]]]
    names = "rest vertex_branch stem_index edges faces metadata attributes".split()
    asks += [lambda d, name=name: getattr(d.file, name) for name in names]
    with np.errstate(all="ignore"):
        try:
            decoder = opened(data, **options)
        except REFUSED as error:
            assert "\n" not in str(error)
            return False
        answered = True
        levels = range(decoder.file.level_count)
        for ask in asks + [lambda d, level=level: d.positions(level=level) for level in levels]:
            try:
                ask(decoder)
            except REFUSED as error:
                assert "\n" not in str(error)
                answered = False
            except np.linalg.LinAlgError:
                pytest.fail("linear algebra on hostile numbers reached the caller")
    return answered


def test_taking_a_file_to_pieces_and_putting_it_together_changes_nothing(parts, data):
    assert parts.file() == data and with_header(data) == data
    others = {ct.CLIPS, ct.EXACT, ct.REFINED_REST, ct.PREDICTED, ct.PLACES}
    assert {c.kind for c, _ in parts.chunks} == set(ct.KIND_NAMES) - others, "of a lossy clip in modes"
    assert use(data)


# ---- accidents ----


def flipped(data: bytes, place: int, bit: int = 1) -> bytes:
    return data[:place] + bytes([data[place] ^ bit]) + data[place + 1 :]


def test_a_flipped_bit_anywhere_is_found(data):
    rng = np.random.default_rng(0)
    tables = Parts.of(data).chunks[0][0].offset
    for place in [*range(0, tables, 3), *range(tables, len(data), 2)]:
        with pytest.raises(FormatError) as caught:
            check(flipped(data, place, 1 << rng.integers(8)))
        assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_every_single_flipped_bit_is_found(data):
    for place in range(len(data)):
        for bit in range(8):
            with pytest.raises(FormatError):
                check(flipped(data, place, 1 << bit))


def test_levels_before_a_damaged_chunk_still_play(parts, data, played):
    seen = 0
    for chunk, payload in parts.chunks:
        if not chunk.is_motion:
            continue
        broken = flipped(data, chunk.offset + len(payload) // 2)
        with pytest.raises(BadChecksum, match=f"level {chunk.level}, segment {chunk.segment}"):
            check(broken)
        decoder = opened(broken, allow_partial=True)
        assert f"damaged from level {chunk.level}" in decoder.file.missing
        assert [d.available for d in decoder.levels] == [d < chunk.level for d in range(len(played))]
        for level in range(chunk.level):
            assert np.array_equal(decoder.positions(level=level), played[level])
        if chunk.level > 0:
            assert decoder.file.deepest == chunk.level - 1
            assert np.array_equal(decoder.positions(), played[chunk.level - 1])
        else:
            with pytest.raises(FormatError):
                decoder.positions()
        seen += 1
    assert seen > 8


def test_damage_in_the_prelude_is_refused_even_when_partial_files_are_allowed(parts, data):
    for chunk, _ in parts.chunks:
        if chunk.kind in (ct.HIERARCHY, ct.REST, ct.TIME):
            with pytest.raises(BadChecksum, match=ct.KIND_NAMES[chunk.kind]):
                opened(flipped(data, chunk.offset + 3), allow_partial=True)


def test_damaged_static_data_do_not_keep_the_motion_from_playing(parts, data, played):
    asks = {ct.FACES: "faces", ct.EDGES: "edges", ct.METADATA: "metadata", ct.ATTRIBUTE: "attributes"}
    for kind, ask in asks.items():
        decoder = opened(flipped(data, parts.chunks[parts.index(kind)][0].offset + 3))
        assert np.array_equal(decoder.positions(), played[-1])
        with pytest.raises(BadChecksum, match=ct.KIND_NAMES[kind]):
            getattr(decoder.file, ask)


def test_a_segment_that_was_refused_leaves_the_others_as_they_are(parts, data, played):
    """Whatever was shown before, and however often it is asked for."""
    last = len(played) - 1
    for kind in (ct.STEMS, ct.AFFINES, ct.CORRECTIONS):
        chunk = next(c for c, _ in parts.chunks if c.kind == kind and c.segment == 1)
        decoder = opened(flipped(data, chunk.offset + chunk.length - 1))
        (first, stop), level = decoder.segments[0], last if kind != ct.AFFINES else chunk.level
        for _ in range(2):
            assert np.array_equal(decoder.positions(slice(first, stop), level), played[level][first:stop])
            with pytest.raises(BadChecksum, match=f"{ct.KIND_NAMES[kind]} of level {chunk.level}, segment 1"):
                decoder.positions(stop, level)
            assert np.array_equal(decoder.positions(0, 0), played[0][0])


# ---- hostile headers and tables ----


COUNTED = "vertex_count place_count branch_count frame_count segment_count level_count chunk_count".split()
PLAYING: dict[str, list] = dict.fromkeys(COUNTED, [])
PLAYING |= {"full_level_count": [5], "is_float64": [1]}


@pytest.mark.parametrize("field, playing", PLAYING.items())
def test_header_counts_that_are_off_by_a_little_are_refused_where_they_contradict_the_rest(field, playing, data):
    """A lossless file without its last level has one level fewer than it once had, and a flag makes positions wide."""
    value = int(getattr(Parts.of(data).header, field))
    others = [value + d for d in (-7, -2, -1, 1, 2, 100) if value + d > 0 and (field != "is_float64" or value + d == 1)]
    assert [other for other in others if use(with_header(data, **{field: other}))] == playing


def test_counts_that_need_too_much_memory_are_refused_before_anything_is_allocated(data):
    tracemalloc.start()
    try:
        for fields in (
            {"place_count": 1 << 26},
            {"place_count": 1 << 26, "branch_count": 1 << 20},
            {"frame_count": 1 << 20, "segment_count": 1 << 20},
            {"chunk_count": 1 << 20},
        ):
            with pytest.raises(FormatError):
                check(with_header(data, **fields))
        assert tracemalloc.get_traced_memory()[1] < 40 << 20
    finally:
        tracemalloc.stop()


def unknown(kind: int, data: bytes = b"from the future") -> tuple[ct.Chunk, bytes]:
    return ct.Chunk(kind, ct.NO_LEVEL, 0, len(data), 0), data


def unknown_chunks(path) -> list[tuple[int, int, int, bytes, int]]:
    with athcodec.open(path, strict=True) as decoder:
        file = decoder.file
        unknown = [chunk for chunk in file.chunks.all if chunk.kind not in ct.KIND_NAMES]
        return [
            (chunk.kind, chunk.level, chunk.segment, file.chunks.stored(chunk), chunk.checksum) for chunk in unknown
        ]


@pytest.mark.parametrize(
    "name, going", [("unknown-optional", 1), ("unknown-optional-damaged", 0), ("private-kinds", 0)]
)
def test_truncation_keeps_unknown_optional_chunks_but_those_of_levels_that_go(name, going, tmp_path):
    """Bytes and checksums stay as they are, so that what was damaged stays so."""
    source, target = conformance.FOLDER / f"valid/{name}.ath", tmp_path / "cut.ath"
    athcodec.truncate(source, target, 1)
    before, after = unknown_chunks(source), unknown_chunks(target)
    assert after == [chunk for chunk in before if chunk[1] != 2] and len(before) - len(after) == going
    with athcodec.open(source) as whole, athcodec.open(target) as cut:
        assert np.array_equal(cut.positions(), whole.positions(level=1))


def test_private_chunks_are_found_by_the_name_that_metadata_gives_their_kind():
    data = (conformance.FOLDER / "valid/private-kinds.ath").read_bytes()
    with opened(data) as decoder:
        assert decoder.file.private_chunks("org.example.leaf_age") == [b"from the future", b""]
        assert decoder.file.private_chunks("org.example.licence") == [b"from the future"]
        assert decoder.file.private_chunks("org.example.bark") == []


def test_a_chunk_that_must_be_there_is_missed_by_name(fine_parts):
    chunks, without_shapes = fine_parts.chunks, []
    shape = opened(fine_parts.file()).positions().shape
    for i, (chunk, _) in enumerate(chunks):
        shorter = fine_parts.with_chunks(chunks[:i] + chunks[i + 1 :])
        if chunk.kind == ct.SHAPES:  # nothing says that it was there: the stems mean something else, or nothing
            without_shapes.append(use(shorter))
        elif chunk.kind & ct.OPTIONAL or chunk.kind in (ct.CORRECTIONS, ct.SOURCE_REST, ct.FACES):
            assert opened(shorter, strict=True).positions().shape == shape
        else:
            with pytest.raises(BadChunkTable, match=f"got no {ct.KIND_NAMES[chunk.kind]}"):
                check(shorter)
    assert without_shapes


@pytest.mark.parametrize(
    "claim",
    [
        {"chunk_count": 1 << 20},
        {"frame_count": 1 << 20, "segment_count": 1 << 20, "level_count": 1},
        {"frame_count": 1 << 18, "segment_count": 1 << 17, "level_count": 3},
    ],
)
def test_a_small_front_that_claims_much_is_refused_at_once(claim, data, work_of):
    assert_refused_soon(with_header(data, **claim), data, work_of)


def assert_refused_soon(bad: bytes, good: bytes, work_of) -> None:
    """Refusing the bad file takes less work than opening the good one, which is small."""

    def refuse() -> None:
        with pytest.raises(FormatError):
            opened(bad)

    assert work_of(refuse) < work_of(lambda: opened(good))


def test_a_million_errors_from_no_bytes_cost_little(parts, work_of):
    """As many as the limit allows, all 0: they are decoded before a chunk is found to be missing."""
    entries = (1 << 19) - len(parts.chunks)
    counts = {"frame_count": entries, "segment_count": entries, "level_count": 2}
    header = replace(parts.header, **counts, max_error=0.0, joins=None)
    front = ct.pack_front(header, [chunk for chunk, _ in parts.chunks], np.zeros((2, entries, 3)))
    assert len(front) < 2000
    assert_refused_soon(front + b"".join(payload for _, payload in parts.chunks), parts.file(), work_of)


# ---- fronts, read twice ----


def near(rng: np.random.Generator, value: int, largest: int) -> int:
    flip = 1 << int(rng.integers(largest.bit_length()))
    values = [0, 1, 2, value - 1, value + 1, value ^ flip, largest, largest // 2 + 1]
    return values[rng.integers(len(values))] % (largest + 1)


CHUNK_FIELDS = {"kind": 2**16 - 1, "level": 255, "segment": 2**30 - 1, "length": 2**30 - 1, "checksum": 2**32 - 1}


def corrupted_front(rng: np.random.Generator, data: bytes) -> bytes:
    """The file with fields and entries of its front changed, mostly so that sums and counts still fit."""
    parts = Parts.of(data)
    chunks, start = [chunk for chunk, _ in parts.chunks], parts.chunks[0][0].offset
    flips = []
    for _ in range(rng.integers(1, 4)):
        way, i, j = rng.integers(6), *rng.integers(len(chunks), size=2)
        if way == 0:
            change_a_count(rng, parts)
        elif way == 1:
            name, largest = list(CHUNK_FIELDS.items())[rng.integers(len(CHUNK_FIELDS))]
            chunks[i] = replace(chunks[i], **{name: near(rng, getattr(chunks[i], name), largest)})
        elif way == 2:
            chunks[i], chunks[j] = chunks[j], chunks[i]
        elif way == 3:
            chunks.insert(i, chunks[j])
        elif way == 4:
            kind = int(rng.choice([0x8009, 0x8015, 0x801F, 0x8022, 0x0009, 0x8001]))
            place = (0, 0) if 16 <= kind & 0x7FFF < 32 else (255, 0)
            chunks.insert(i, ct.Chunk(kind, *place, 0, 0))
        else:
            flips.append(rng.random())
    front = bytearray(ct.pack_front(parts.header, chunks, parts.errors))
    for place in flips:
        front[int(place * len(front))] ^= 1 << rng.integers(8)
    return (with_checksum(bytes(front)) if rng.random() < 0.95 else bytes(front)) + data[start:]


def change_a_count(rng: np.random.Generator, parts: Parts) -> None:
    name = COUNTS[rng.integers(len(COUNTS))]
    if name == "max_error":
        value = [np.nan, np.inf, 5e-324, parts.header.max_error * 2][rng.integers(4)]
    else:
        value = near(rng, int(getattr(parts.header, name)), 2**30)
    changed = replace(parts.header, **{name: value})
    if changed.level_count * changed.segment_count < 4096:
        shape = changed.level_count, changed.segment_count
        parts.header = replace(changed, joins=np.resize(parts.header.joins, shape))
        parts.errors = np.resize(parts.errors, (*shape, 3))


def some_limits(rng: np.random.Generator) -> Limits:
    """Mostly those by default; else one of the core's that may be too narrow, or wide."""
    if rng.random() < 0.8:
        return Limits()
    names = [field.name for field in fields(Limits) if hasattr(core_file.Limits, field.name)]
    return Limits(**{rng.choice(names): int(rng.choice([5, 12, 20, 200])) << int(rng.choice([0, 0, 20]))})


def both_readings(data: bytes, limits: Limits) -> str:
    """What a file says of a front, once the document has said the same."""
    try:
        header, chunks = front_by_document(data, limits)
    except rules.Invalid as error:
        with pytest.raises(errors.FormatError) as caught:
            AthFile(BytesIO(data), limits=limits)
        assert caught.value.name == str(error), caught.value
        return str(error)
    try:
        file = AthFile(BytesIO(data), limits=limits)
    except FormatError:
        return "refused for what is behind the front"
    for name in COUNTS:
        assert getattr(file.tables.header, name) == getattr(header, name)
    assert np.array_equal(file.errors, header.errors)
    assert file.tables.header.repeats.tolist() == list(map(bool, header.repeats))
    assert file.joins.tolist() == [[join.width + 128 * join.is_sloped for join in row] for row in header.joins.values()]
    assert [astuple(chunk)[:6] for chunk in file.chunks] == chunks
    return "opened"


def front_by_document(data: bytes, limits: Limits) -> tuple[SimpleNamespace, list[tuple]]:
    """Counts and tables, and kind, level, segment, length, checksum and offset of all known chunks."""
    decode, tables = rules.decode_front, []

    def decode_front(*arguments):
        header, table = decode(*arguments)
        tables.append(table)
        return header, table

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rules, "limit", lambda name: getattr(limits, name.removeprefix("Max_").lower()))
        patch.setattr(rules, "decode_front", decode_front)
        header, _, _, prelude_length, _ = rules.read_front(data)
        rules.require(len(data) >= prelude_length, "TRUNCATED")
    at, chunk_count = struct.unpack_from("<II", data, 16)
    checksums, chunks = struct.unpack_from(f"<{chunk_count}I", data, at - 4 * chunk_count), []
    for (kind, level, segment, length), checksum in zip(tables[0], checksums):
        if kind in rules.KINDS:
            chunks.append((kind, 255 if level is None else level, segment, length, checksum, at))
        at += length
    return header, chunks


ALL_READINGS = {"opened", "refused for what is behind the front"}
ALL_READINGS |= {error.name for error in (NotAnAthFile, UnsupportedVersion, UnsupportedFeature, Truncated, BadChecksum)}
ALL_READINGS |= {error.name for error in (BadHeader, BadChunkTable, UnknownChunk, LimitExceeded)}


def test_a_front_of_one_level_is_refused_for_its_chunk_table_first_as_the_document_does(data, parts):
    """That a file has a level behind its first one follows from its branches, which stand behind the front."""
    header = replace(parts.header, full_level_count=1, level_count=1, stages=parts.header.stages[:1])
    chunks = [chunk for chunk, _ in parts.chunks]
    for table in (chunks, [chunks[1], chunks[0], *chunks[2:]]):
        front = bytes(ct.pack_front(header, table, parts.errors[:1]))
        both_readings(with_checksum(front) + data[chunks[0].offset :], Limits())


@pytest.mark.vectors
@pytest.mark.parametrize("count", [1500, pytest.param(30_000, marks=pytest.mark.slow)])
def test_the_core_reads_a_front_as_the_document_does(count, data, parts):
    assert both_readings(data, Limits()) == "opened"
    still = parts.with_chunks([entry for entry in parts.chunks if not entry[0].is_motion])
    assert both_readings(still, Limits()) == "refused for what is behind the front"
    rng, seen = np.random.default_rng(1), set()
    for _ in range(count):
        corrupted = corrupted_front(rng, data)
        if rng.random() < 0.1:
            corrupted = corrupted[: rng.integers(1, len(corrupted))]
        seen.add(both_readings(corrupted, some_limits(rng)))
    assert seen == ALL_READINGS


def test_the_core_asks_for_more_of_any_front_that_is_not_whole(data):
    prelude, limits = AthFile(BytesIO(data)).prelude_length, core_file.Limits.of(Limits())
    for size in range(prelude):
        needed, _, lacking = core_file.front(data[:size], limits)
        assert size < needed <= prelude and lacking.code == core_file.MISSING == 66
    needed, memory, _ = core_file.front(data[:prelude], limits)
    assert needed == prelude and core_file.File(data[:prelude], memory, limits).info.file_length == len(data)


def calls_of_opening(data: bytes) -> int:
    """Calls of functions, Python's and others, that opening a file takes."""
    events = []
    sys.setprofile(lambda frame, event, argument: events.append(event))
    try:
        opened(data)
    finally:
        sys.setprofile(None)
    return sum(event in ("call", "c_call") for event in events)


def test_opening_takes_no_calls_in_python_for_each_chunk():
    few, many = segments_of_one_frame(2), segments_of_one_frame(1500)
    assert opened(few).file.tables.header.chunk_count == 7 and opened(many).file.tables.header.chunk_count == 3003
    assert calls_of_opening(many) == calls_of_opening(few)


# ---- hostile chunks ----

KINDS = {name: kind for kind, name in ct.KIND_NAMES.items()}


def mutations(rng: np.random.Generator, payload: bytes):
    """One of several ways to corrupt a chunk."""
    way = rng.integers(5)
    if way == 0:
        return bytes(rng.integers(0, 256, rng.integers(0, 200), np.uint8))
    if way == 1:
        return payload[: rng.integers(len(payload))]
    if way == 2:
        return payload + bytes(rng.integers(0, 256, rng.integers(1, 9), np.uint8))
    changed = bytearray(payload)
    for place in rng.integers(len(payload), size=rng.integers(1, 4)):
        changed[place] = rng.integers(256) if way == 3 else (0, 1, 0x7F, 0x80, 0xFF)[rng.integers(5)]
    return bytes(changed)


STATIC = {"METADATA", "FACES", "EDGES", "ATTRIBUTE"}


@pytest.fixture
def parts_with(request, parts):
    """A function that gives a file with chunks of a kind, in parts."""
    others = {"CLIPS": "medley_parts", "EXACT": "lossless_parts", "REFINED_REST": "layered_parts"}
    others |= {"PREDICTED": "predicted_parts", "PLACES": "split_parts"}
    return lambda name: request.getfixturevalue(others[name]) if name in others else parts


def assert_refused_or_played(name: str, outcomes: list[bool], least: int) -> None:
    """So many of each at least; what is wrong with static data or the hierarchy seldom goes unnoticed."""
    played = 0 if name in STATIC or name == "HIERARCHY" else least
    assert outcomes.count(False) >= least and outcomes.count(True) >= played, outcomes


@pytest.mark.parametrize("name", KINDS)
def test_a_corrupted_chunk_with_a_good_checksum_is_refused_or_plays_with_no_more_work(name, parts_with, work_of):
    parts, rng, outcomes, works = parts_with(name), np.random.default_rng(KINDS[name]), [], []
    expected = opened(parts.file()).positions()
    places = [i for i, (c, _) in enumerate(parts.chunks) if c.kind == KINDS[name]]
    for _ in range(40):
        i, chunks = int(rng.choice(places)), list(parts.chunks)
        chunks[i] = chunks[i][0], mutations(rng, chunks[i][1])
        data = parts.with_chunks(chunks)
        works.append(work_of(lambda data=data: outcomes.append(use(data))))
        if name in STATIC:
            assert np.array_equal(opened(data).positions(), expected), "the motion plays whatever they are"
    assert_refused_or_played(name, outcomes, 2)
    assert max(works) < 2 * work_of(lambda: use(parts.file()))


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_of_thousands_of_corrupted_chunks_some_are_refused_and_some_play(name, parts_with):
    parts, rng, outcomes = parts_with(name), np.random.default_rng(100 + KINDS[name]), []
    for _ in range(3000):
        chunks = list(parts.chunks)
        for i in [i for i, (c, _) in enumerate(parts.chunks) if c.kind == KINDS[name]]:
            if rng.random() < 0.5:
                chunks[i] = chunks[i][0], mutations(rng, chunks[i][1])
        outcomes.append(use(parts.with_chunks(chunks)))
    assert_refused_or_played(name, outcomes, 50)


def zstd(data: bytes, **options) -> bytes:
    return zstandard.ZstdCompressor(**options).compress(data)


def attribute(
    body: bytes = b"", kind: int = 3, size: int = 4, shape: Sequence[int] = (4,), name: bytes = b"a"
) -> bytes:
    return struct.pack(f"<BBHI{len(shape)}I", kind, len(shape), len(name), size, *shape) + name + body


def with_step(parts: Parts, kind: int, step: float) -> bytes:
    """The file with another quantisation step in one chunk."""
    level, at = {ct.STEMS: (2, 0), ct.CORRECTIONS: (3, 0), ct.REST: (None, 13)}[kind]
    payload = parts.payload(kind, level)
    return parts.with_payload(kind, payload[:at] + struct.pack("<f", step) + payload[at + 4 :], level)


@pytest.mark.parametrize("kind", [ct.STEMS, ct.CORRECTIONS, ct.REST])
def test_the_smallest_steps_play(kind, parts):
    data = with_step(parts, kind, 1e-38)
    assert use(data) and np.isfinite(opened(data).positions()).all()


@pytest.mark.parametrize("kind, finite", [(ct.STEMS, [0, 1]), (ct.CORRECTIONS, [0, 1, 2, 3]), (ct.REST, [])])
def test_the_largest_steps_play_and_frames_with_infinite_positions_have_no_matrices(kind, finite, parts):
    """The positions are no plant, but numbers or infinities, before anything is joined to an end that is infinite."""
    decoder = opened(with_step(parts, kind, 1e38))
    decoder.file.check()
    found = []
    for level in range(decoder.file.level_count):
        positions = decoder.positions(0, level)
        assert not np.isnan(decoder.positions(slice(*decoder.segments[0]), level)).any()
        if np.isfinite(positions).all():
            found.append(level)
            assert np.isfinite(decoder.affines(0, level).matrices).all()
        else:
            with pytest.raises(BadChunk, match="positions that no matrix fits"):
                decoder.affines(0, level)
    assert found == finite
    if finite == [0, 1, 2, 3]:
        assert np.isfinite(decoder.residual(0, 0)).all()
    else:
        with pytest.raises(BadChunk, match="frame 0: got positions"):
            decoder.residual(0, 0)


STREAMS = {"HIERARCHY": (0, None), "REST": (17, None), "TIME": (1, None), "STEMS": (8, 2), "AFFINES": (0, 1)}
STREAMS |= {"CORRECTIONS": (4, 3), "SHAPES": (0, 1)}


@pytest.mark.parametrize("name, head, level", [(name, *place) for name, place in STREAMS.items()])
def test_streams_of_one_byte_over_and_over_end_soon_and_are_refused_where_they_are_long(
    name, head, level, parts, work_of
):
    most, outcomes = 2 * work_of(lambda: use(parts.file())), {}
    for byte, size in product((b"\x00", b"\xff", b"\x55"), (0, 1, 64, 4096)):
        data = parts.with_payload(KINDS[name], parts.payload(KINDS[name], level)[:head] + byte * size, level)
        assert work_of(lambda data=data, of=(byte, size): outcomes.setdefault(of, use(data))) < most
    assert not any(plays for (_, size), plays in outcomes.items() if size > 1)
    assert any(outcomes.values()) == (name != "HIERARCHY")  # A short stream ends in zeros, which may be valid.


# ---- zstd ----


def exact(data: bytes, expected: int, **limits) -> bytes:
    return ct.zstd_decompress_exact(data, expected, "test", Limits(**limits))


def test_the_frame_that_zstd_answers_with_a_memory_error_is_refused():
    frame = bytes.fromhex("28b52ffde06c06060663636363")
    claimed = zstandard.frame_content_size(frame)
    with pytest.raises(LimitExceeded):
        exact(frame, claimed)
    with pytest.raises(BadChunk):
        exact(frame, claimed, decoded_chunk_bytes=1 << 63)
    with pytest.raises(BadChunk):
        exact(frame, 100)


# ---- limits ----


BEYOND = {"chunks": 5, "table_bytes": 100, "vertices": 12, "branches": 4, "frames": 19, "chunk_bytes": 30}
BEYOND |= {"memory_bytes": 10_000, "metadata_bytes": 50, "attributes": 1, "string_bytes": 5}
BEYOND |= {"decoded_chunk_bytes": 20, "hierarchy_depth": 2}


@pytest.mark.parametrize("limit, number", BEYOND.items(), ids=BEYOND)
def test_a_file_beyond_a_limit_is_refused_by_that_limit(limit, number, data):
    with pytest.raises(LimitExceeded, match=rf"(limit is|more than) {number}\b") as caught:
        check(data, limits=Limits(**{limit: number}))
    assert "\n" not in str(caught.value)


def test_limits_that_just_hold_the_file_accept_it(data, parts, full_clip):
    counts = {"chunks": len(parts.chunks), "vertices": full_clip.vertex_count, "branches": 5, "frames": 20}
    most = {"attributes": 2, "string_bytes": 7, "decoded_chunk_bytes": 161}
    check(data, limits=Limits(chunk_bytes=max(len(payload) for _, payload in parts.chunks), **counts, **most))


def test_limits_that_no_file_reaches_accept_it(data):
    check(data, limits=Limits(**{field.name: 1 << 80 for field in fields(Limits)}))


def test_a_segment_that_takes_more_memory_than_the_limit_is_not_decoded(data):
    """Though the file could be opened, which depends on its counts alone."""
    header = Parts.of(data).header
    frames = -(-header.frame_count // header.segment_count)
    least = header.vertex_count * (60 * frames + 512)
    with pytest.raises(LimitExceeded, match=f"limit is {least - 1}"):
        opened(data, limits=Limits(memory_bytes=least - 1))
    decoder = opened(data, limits=Limits(memory_bytes=least))
    assert decoder.file.rest.shape == (header.vertex_count, 3)
    with pytest.raises(LimitExceeded, match=f"level 0, segment 0.*limit is {least}"):
        decoder.positions(0, 0)


def test_small_chunks_that_unpack_to_much_are_refused_before_they_are_unpacked(parts):
    bomb = attribute(zstd(bytes(200 << 20)), shape=[50 << 20])
    assert len(bomb) < 50_000
    file = parts.with_payload(ct.ATTRIBUTE, bomb)
    tracemalloc.start()
    try:
        with pytest.raises(LimitExceeded):
            check(file, limits=Limits(decoded_chunk_bytes=100 << 20))
        assert tracemalloc.get_traced_memory()[1] < 10 << 20
    finally:
        tracemalloc.stop()


def test_many_attributes_together_keep_to_the_memory_limit(parts):
    chunks = [entry for entry in parts.chunks if entry[0].kind not in (ct.ATTRIBUTE, ct.SOURCE_REST)]
    chunks += [
        unknown(ct.ATTRIBUTE, attribute(zstd(bytes(1 << 20)), name=b"a%d" % i, shape=[1 << 18])) for i in range(9)
    ]
    file = parts.with_chunks(chunks)
    assert len(opened(file).file.attributes) == 9
    with pytest.raises(LimitExceeded, match="attributes"):
        _ = opened(file, limits=Limits(memory_bytes=8 << 20)).file.attributes


# ---- errors ----


def test_every_refusal_of_every_vector_is_one_line_that_says_what_was_found():
    """Each rule of FORMAT.md has a vector that breaks it: test_vectors.py holds the core to the names of the errors."""
    for vector in conformance.vectors():
        data = vector.path.read_bytes()
        for item in (item for item, answer in vector.results.items() if answer in conformance.ERRORS):
            with pytest.raises(conformance.Refused) as caught:
                conformance.package(data, item, vector.mesh)
            said = str(caught.value.__context__)
            assert "\n" not in said and 20 < len(said) < 1000, vector.name
            assert re.search("got|limit|cut off|looks like", said), f"{vector.name}: {said}"
