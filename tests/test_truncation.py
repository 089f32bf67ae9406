"""A file cut anywhere: what is there plays, what is not is named, and `truncate` makes shorter files that are whole."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

import athcodec
from athcodec import truncate
from athcodec.decoding.container import MAGIC
from athcodec.errors import BadChecksum, FormatError, LevelUnavailable, NotAnAthFile, Truncated


class Whole:
    """A complete file and all it plays."""

    def __init__(self, path):
        self.path, self.data = path, path.read_bytes()
        with athcodec.open(path, strict=True) as decoder:
            self.chunks, self.levels = decoder.file.chunks, decoder.levels
            self.prelude = decoder.file.prelude_length
            self.segments, self.header = decoder.segments, decoder.file.tables.header
            self.positions = [decoder.positions(level=level) for level in range(decoder.file.level_count)]
            self.bound, self.attributes = decoder.file.max_error_bound, decoder.file.attributes
            dtype, count = decoder.file.rest.dtype, decoder.file.level_count
            self.poses = [decoder.level_rest(level).astype(dtype) for level in range(count)]

    def cut(self, size: int, **options) -> athcodec.Decoder:
        return athcodec.open(BytesIO(self.data[:size]), **options)

    def deepest_within(self, size: int) -> int:
        """By the chunks alone: the deepest level whose chunks, and those before it, end at `size` or earlier."""
        late = [chunk.level for chunk in self.chunks if chunk.is_motion and chunk.offset + chunk.length > size]
        return min(late, default=len(self.levels)) - 1


@pytest.fixture(scope="module", params=["sample_ath", "bushy_ath", "full_ath", "layered_ath", "predicted_ath"])
def whole(request):
    return Whole(request.getfixturevalue(request.param))


@pytest.fixture(scope="module")
def bushy(bushy_ath):
    return Whole(bushy_ath)


@pytest.fixture(scope="module")
def full(full_ath):
    return Whole(full_ath)


def assert_plays_as_far_as_it_goes(whole: Whole, size: int) -> None:
    decoder, deepest = whole.cut(size), whole.deepest_within(size)
    assert not decoder.file.complete and decoder.file.missing and "\n" not in decoder.file.missing
    assert [level.available for level in decoder.levels] == [d <= deepest for d in range(len(whole.levels))]
    with pytest.raises(Truncated):
        decoder.file.check()
    if deepest < 0:
        with pytest.raises(Truncated, match="level 0"):
            decoder.positions()
    else:
        assert decoder.file.deepest == deepest
        assert np.array_equal(decoder.positions(), whole.positions[deepest])
    if deepest + 1 < len(whole.levels):
        assert np.array_equal(decoder.file.rest, whole.poses[max(deepest, 0)]), "instead of the source's rest pose"
        with pytest.raises(LevelUnavailable, match=f"level {deepest + 1}, segment"):
            decoder.positions(level=deepest + 1)


def test_every_chunk_boundary_is_a_place_to_stop(whole):
    sizes = sorted({chunk.offset for chunk in whole.chunks if chunk.offset >= whole.prelude})
    assert len(sizes) > len(whole.levels) + len(whole.segments)
    for size in sizes:
        assert_plays_as_far_as_it_goes(whole, size)


def test_any_byte_behind_the_prelude_is_a_place_to_stop(whole):
    for size in np.random.default_rng(0).integers(whole.prelude, len(whole.data), 40):
        assert_plays_as_far_as_it_goes(whole, int(size))


@pytest.mark.slow
def test_every_byte_of_a_small_file_behind_the_prelude_is_a_place_to_stop(full):
    for size in range(full.prelude, len(full.data)):
        assert_plays_as_far_as_it_goes(full, size)


def test_files_cut_inside_the_prelude_are_refused(bushy, full):
    for whole in (bushy, full):
        for size in range(whole.prelude):
            with pytest.raises((Truncated, NotAnAthFile)) as caught:
                whole.cut(size)
            assert "\n" not in str(caught.value)


def test_every_prefix_fails_in_strict_opening(full):
    for size in range(len(full.data)):
        with pytest.raises(FormatError):
            full.cut(size, strict=True)
    full.cut(len(full.data), strict=True).file.check()


def test_what_is_missing_is_named(bushy, full):
    first = next(c.offset for c in bushy.chunks if (c.is_motion, c.level, c.segment) == (True, 1, 2))
    decoder = bushy.cut(first + 1)
    levels = len(bushy.levels)
    assert decoder.file.missing.startswith("level 1: segments 2-3; level 2: segments 0-3")
    assert decoder.file.missing.count("level") == levels - 1
    for file in (bushy, full):
        last = [chunk for chunk in file.chunks if chunk.is_motion][-1]
        rest = (
            "; rest pose of the source"
            if any(chunk.kind == athcodec.decoding.container.SOURCE_REST for chunk in file.chunks)
            else ""
        )
        missing = file.cut(last.offset + last.length - 1).file.missing
        assert missing == f"level {last.level}: segment {last.segment}{rest}"


def test_a_file_cut_in_its_attributes_plays_in_full_and_says_so(full):
    size = next(c.offset for c in full.chunks if c.kind & 0x7FFF == 32) + 3
    decoder = full.cut(size)
    assert not decoder.file.complete and "attributes" in decoder.file.missing
    assert np.array_equal(decoder.positions(), full.positions[-1]) and decoder.file.attributes == {}


def test_segments_that_arrived_play_deeper_than_those_that_did_not(bushy):
    """A player that streams shows each segment at the best level it has."""
    size = next(c.offset for c in bushy.chunks if (c.is_motion, c.level, c.segment) == (True, 3, 2))
    decoder = bushy.cut(size)
    start, stop = bushy.segments[1]
    assert decoder.file.deepest == 2
    assert np.array_equal(decoder.positions(slice(start, stop), 3), bushy.positions[3][start:stop])
    with pytest.raises(LevelUnavailable, match="level 3, segment 2"):
        decoder.positions(stop, 3)


def test_a_prefix_cut_after_a_level_plays_that_level_bit_for_bit(whole):
    for level in whole.levels:
        decoder = whole.cut(level.bytes)
        assert decoder.file.deepest == level.level
        assert np.array_equal(decoder.positions(), whole.positions[level.level])
        with pytest.raises(LevelUnavailable):
            whole.cut(level.bytes - 1).positions(level=level.level)


# ---- truncate ----


def test_truncated_files_are_whole_and_play_the_same_levels(whole, tmp_path):
    for level in whole.levels:
        target = tmp_path / f"{level.level}.ath"
        size = truncate(whole.path, target, level.level)
        assert size == target.stat().st_size
        with athcodec.open(target, strict=True) as decoder:
            decoder.file.check()
            assert decoder.file.complete and decoder.file.missing == ""
            assert decoder.file.level_count == level.level + 1 and decoder.file.full_level_count == len(whole.levels)
            for coarser in range(level.level + 1):
                assert np.array_equal(decoder.positions(level=coarser), whole.positions[coarser])
            with pytest.raises(LevelUnavailable, match=f"expected 0 to {level.level}"):
                decoder.positions(level=level.level + 1)


def test_a_truncated_file_promises_the_error_of_its_last_level(whole, tmp_path):
    for level in whole.levels:
        truncate(whole.path, tmp_path / "cut.ath", level.level)
        with athcodec.open(tmp_path / "cut.ath") as decoder:
            expected = whole.bound if level.level == len(whole.levels) - 1 else level.max_error
            assert decoder.file.max_error_bound == expected
            assert [(d.max_error, d.rms_error, d.nodes) for d in decoder.levels] == [
                (d.max_error, d.rms_error, d.nodes) for d in whole.levels[: level.level + 1]
            ]


def test_a_truncated_file_is_shorter_and_keeps_its_static_data(full, full_clip, tmp_path):
    sizes = [truncate(full.path, tmp_path / "cut.ath", level.level) for level in full.levels]
    assert sizes == sorted(set(sizes)) and sizes[-1] == len(full.data)
    truncate(full.path, tmp_path / "cut.ath", 0)
    with athcodec.open(tmp_path / "cut.ath") as decoder:
        assert np.array_equal(decoder.file.faces, full_clip.faces)
        assert np.array_equal(decoder.file.edges, full_clip.edges)
        assert decoder.metadata.items() >= full_clip.metadata.items()
        assert {name: a.tobytes() for name, a in decoder.file.attributes.items()} == {
            name: a.tobytes() for name, a in full_clip.attributes.items()
        }


def test_truncating_twice_is_truncating_once(bushy, tmp_path):
    truncate(bushy.path, tmp_path / "three.ath", 3)
    truncate(tmp_path / "three.ath", tmp_path / "twice.ath", 1)
    truncate(bushy.path, tmp_path / "once.ath", 1)
    assert (tmp_path / "twice.ath").read_bytes() == (tmp_path / "once.ath").read_bytes()
    with pytest.raises(LevelUnavailable, match="expected 0 to 1"):
        truncate(tmp_path / "twice.ath", tmp_path / "deeper.ath", 2)


def test_a_file_can_be_truncated_onto_itself(bushy, tmp_path):
    path = tmp_path / "own.ath"
    path.write_bytes(bushy.data)
    truncate(path, path, 1)
    with athcodec.open(path, strict=True) as decoder:
        assert np.array_equal(decoder.positions(), bushy.positions[1])


def test_keeping_every_level_keeps_every_byte(whole, tmp_path):
    truncate(whole.path, tmp_path / "same.ath", len(whole.levels) - 1)
    assert (tmp_path / "same.ath").read_bytes() == whole.data


def test_a_prefix_can_be_truncated_to_what_it_holds(bushy, tmp_path):
    (tmp_path / "prefix.ath").write_bytes(bushy.data[: bushy.levels[2].bytes + 5])
    truncate(tmp_path / "prefix.ath", tmp_path / "two.ath", 2)
    with athcodec.open(tmp_path / "two.ath", strict=True) as decoder:
        decoder.file.check()
        assert np.array_equal(decoder.positions(), bushy.positions[2])


def damaged(whole: Whole, change) -> bytes:
    data = bytearray(whole.data)
    change(data)
    return bytes(data)


def flip(place: int):
    def change(data: bytearray) -> None:
        data[place] ^= 4

    return change


REFUSED = {
    "level cut off": (lambda w: w.data[: w.levels[1].bytes - 1], 1, Truncated),
    "prelude cut off": (lambda w: w.data[: w.prelude - 1], 0, Truncated),
    "level damaged": (lambda w: damaged(w, flip(w.prelude + 3)), 1, BadChecksum),
    "prelude damaged": (lambda w: damaged(w, flip(w.prelude - 3)), 0, BadChecksum),
    "table damaged": (lambda w: damaged(w, flip(70)), 0, FormatError),
    "something else": (lambda w: b"no ath file at all", 0, NotAnAthFile),
    "level beyond": (lambda w: w.data, 6, LevelUnavailable),
    "level before": (lambda w: w.data, -1, LevelUnavailable),
}


@pytest.mark.parametrize("make, level, error", REFUSED.values(), ids=REFUSED)
def test_truncating_what_cannot_be_truncated_raises_and_leaves_nothing_new(make, level, error, bushy, tmp_path):
    source, older = tmp_path / "source.ath", tmp_path / "older.ath"
    source.write_bytes(make(bushy))
    older.write_bytes(MAGIC + b"older")
    for target in (tmp_path / "target.ath", older):
        with pytest.raises(error):
            truncate(source, target, level)
    assert older.read_bytes() == MAGIC + b"older" and set(tmp_path.iterdir()) == {source, older}


def test_damage_in_a_level_that_is_left_out_does_no_harm(bushy, tmp_path):
    source = tmp_path / "source.ath"
    last = [chunk for chunk in bushy.chunks if chunk.is_motion][-1]
    source.write_bytes(damaged(bushy, flip(last.offset + last.length - 5)))
    truncate(source, tmp_path / "cut.ath", 2)
    with athcodec.open(tmp_path / "cut.ath", strict=True) as decoder:
        decoder.file.check()
        assert np.array_equal(decoder.positions(), bushy.positions[2])
