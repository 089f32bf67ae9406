"""Segments that go on from the end of the one before them: no tick where they meet, in any way of decoding."""

from __future__ import annotations

import io

import numpy as np
import pytest
from files import Parts

import athcodec
from athcodec.decoding import core_file, segment_decoder
from athcodec.decoding.container import Limits
from athcodec.encoding.segments import joins
from athcodec.errors import BadChecksum, LimitExceeded
from athcodec.motion.joining import looped
from athcodec.sources import read_hdf5, sample_path

SEGMENT = 40
LADDERS = {"one layer": "none", "layers": "decades"}


def changes(positions: np.ndarray) -> np.ndarray:
    """RMS over vertices of the change of velocity at each frame but the first and the last."""
    second = np.diff(positions.astype(np.float64), 2, axis=0)
    return np.sqrt((second**2).sum(axis=2).mean(axis=1))


def tick(positions: np.ndarray, seams: list[int]) -> float:
    """The largest change of velocity within two frames of a seam over the usual one."""
    found = changes(positions)
    return max(float(found[seam - 3 : seam + 2].max()) for seam in seams) / float(np.median(found))


def without_joins(data: bytes) -> athcodec.Decoder:
    parts = Parts.of(data)
    parts.header.joins = None
    return athcodec.open(io.BytesIO(parts.file()))


@pytest.fixture(scope="module", params=LADDERS.values(), ids=LADDERS.keys())
def coded(request) -> bytes:
    with read_hdf5(sample_path()) as clip:
        return athcodec.encode(clip, rel_error=1e-3, segment_frames=SEGMENT, ladder=request.param, effort="fast")


@pytest.fixture(scope="module")
def loop() -> bytes:
    """Of three segments."""
    with read_hdf5(sample_path()) as clip:
        return athcodec.encode(looped(clip, blend=12), rel_error=1e-3, segment_frames=SEGMENT, effort="fast")


def test_levels_without_corrections_hardly_tick_where_segments_meet(coded):
    with athcodec.open(io.BytesIO(coded)) as decoder, without_joins(coded) as bare:
        seams = [start for start, _ in decoder.segments[1:]]
        for level in range(decoder.file.core.info.depth_levels - 1):
            before, after = tick(bare.positions(level=level), seams), tick(decoder.positions(level=level), seams)
            assert after < 2.2 and after < 0.5 * before


def test_the_last_level_does_not_tick_where_segments_meet(coded, sample_positions):
    """Neither its motion nor its error: no vertex's velocity is off by more than 1.5 bounds."""
    with athcodec.open(io.BytesIO(coded)) as decoder:
        seams = [start for start, _ in decoder.segments[1:]]
        shown = decoder.positions().astype(np.float64)
        bends = np.linalg.norm(np.diff(shown - sample_positions, 2, axis=0), axis=2) / decoder.file.max_error_bound
    assert tick(shown, seams) < 1.9
    near = np.concatenate([bends[seam - 3 : seam + 2] for seam in seams])
    assert (near > 1).mean(axis=1).max() < 0.01 and near.max() < 1.5


def test_at_loose_bounds_no_level_without_corrections_ticks_where_segments_meet(tmp_path):
    path = tmp_path / "loose.ath"
    with read_hdf5(sample_path()) as clip:
        athcodec.encode(clip, path, rel_error=1e-2, segment_frames=SEGMENT, ladder="none")
    with athcodec.open(path) as decoder:
        seams = [start for start, _ in decoder.segments[1:]]
        # Level 1 hardly moves in the last segment, because the search chooses coarse rotations. A join over more frames
        # than 16 would bend less than 2.35 times as much as a usual frame, but make the level worse than level 0.
        assert max(tick(decoder.positions(level=level), seams) for level in range(decoder.file.level_count - 1)) < 2.4
    assert_the_same_however_one_comes_to_it(path.read_bytes())


def test_a_loop_does_not_tick_where_it_begins_again(loop):
    with athcodec.open(io.BytesIO(loop)) as decoder, without_joins(loop) as bare:
        for level in range(3):
            once, alone = decoder.positions(level=level), bare.positions(level=level)
            twice, twice_alone = np.concatenate([once, once]), np.concatenate([alone, alone])
            assert tick(twice, [len(once)]) < 5.0 and tick(twice, [len(once)]) < 0.5 * tick(twice_alone, [len(once)])


def test_the_bound_holds_for_what_is_joined(coded, sample_positions):
    with athcodec.open(io.BytesIO(coded)) as decoder:
        assert decoder.file.joins[:, 1:].any(axis=1).all() and not decoder.file.joins[:, 0].any()
        for level in decoder.levels:
            away = np.linalg.norm(decoder.positions(level=level.level, dtype=np.float64) - sample_positions, axis=2)
            assert away.max() <= level.max_error
        assert away.max() <= decoder.file.max_error_bound


def test_a_frame_is_the_same_however_one_comes_to_it(coded):
    assert_the_same_however_one_comes_to_it(coded)


def test_a_frame_of_a_loop_is_the_same_however_one_comes_to_it(loop):
    assert_the_same_however_one_comes_to_it(loop)


def assert_the_same_however_one_comes_to_it(data: bytes) -> None:
    with athcodec.open(io.BytesIO(data)) as decoder:
        for level in range(decoder.file.level_count):
            forwards = decoder.positions(level=level)
            for start, stop in reversed(decoder.segments):
                assert np.array_equal(decoder.positions(stop - 1, level), forwards[stop - 1])
                with athcodec.open(io.BytesIO(data)) as other:
                    assert np.array_equal(other.positions(slice(start, stop), level), forwards[start:stop])


def test_a_segment_goes_on_from_one_alone(coded):
    """What the segments before that are does not matter."""
    parts = Parts.of(coded)
    with athcodec.open(io.BytesIO(coded)) as decoder:
        start, stop = decoder.segments[2]
        expected = decoder.positions(slice(start, stop))
        first = {(c.kind, c.level): data for c, data in parts.chunks if c.is_motion and c.segment == 1}
    chunks = [(c, first.get((c.kind, c.level), data) if c.segment == 0 else data) for c, data in parts.chunks]
    with athcodec.open(io.BytesIO(parts.with_chunks(chunks))) as other:
        assert np.array_equal(other.positions(slice(start, stop)), expected)


def test_the_end_of_a_segment_is_part_of_what_the_next_one_needs(coded):
    """A file cut off inside the second segment of a level shows neither that nor the third at the level."""
    with athcodec.open(io.BytesIO(coded)) as decoder:
        level = decoder.file.level_count - 1
        core = decoder.file.core
        assert core.joined_to(2, level) == 1 and core.joined_to(0, level) == -1
        of_second = {(c.offset, c.length) for c in decoder.file.chunks if c.level == level and c.segment == 1}
        stems = min(of_second)
        assert any(offset <= stems[0] < offset + size for offset, size in core.missing(level, 2))
        assert not any(offset <= stems[0] < offset + size for offset, size in core.missing_of(2, level))


@pytest.fixture(scope="module")
def many() -> bytes:
    """Of seven segments, joined."""
    with read_hdf5(sample_path()) as clip:
        return athcodec.encode(clip, rel_error=1e-3, segment_frames=18, effort="fast")


@pytest.fixture
def threads(monkeypatch):
    return lambda count: monkeypatch.setattr(segment_decoder, "default_jobs", lambda: count)


@pytest.mark.parametrize("count", [2, 3, 8])
def test_threads_that_share_the_segments_show_what_one_does(count, many, threads):
    with athcodec.open(io.BytesIO(many)) as decoder:
        assert len(decoder.segments) == 7 and decoder.file.joins.any()
        for level in (1, decoder.file.level_count - 1):
            threads(1)
            alone = decoder.positions(level=level)
            threads(count)
            assert np.array_equal(decoder.positions(level=level), alone)
            assert np.array_equal(decoder.positions(slice(20, 111), level), alone[20:111])
            assert np.array_equal(np.concatenate([block for _, block in decoder.blocks(level)]), alone)


def test_threads_take_no_more_memory_than_is_allowed(many, threads, monkeypatch):
    """What one segment takes, without what another is joined to, is enough for all of them."""
    threads(3)
    with athcodec.open(io.BytesIO(many)) as decoder:
        core, level = decoder.file.core, decoder.file.level_count - 1
        expected, needed = decoder.positions(), core.segment_size(level) + core.work_size()
    sizes = []
    own = core_file.Segment.__init__
    monkeypatch.setattr(core_file.Segment, "__init__", lambda self, size: (sizes.append(size), own(self, size))[1])
    with athcodec.open(io.BytesIO(many)) as decoder:
        decoder.file.limits = Limits(memory_bytes=needed)
        assert np.array_equal(decoder.positions(), expected)
        assert len(sizes) == 1
        decoder.file.limits = Limits(memory_bytes=needed - 1)
        with pytest.raises(LimitExceeded, match="segments 0 to 6"):
            decoder.positions()


def test_damage_that_one_of_the_threads_meets_is_refused(many, threads):
    threads(3)
    data = bytearray(many)
    with athcodec.open(io.BytesIO(many)) as decoder:
        intact, level = decoder.positions(slice(0, 36)), decoder.file.level_count - 1
        last = [chunk for chunk in decoder.file.chunks if chunk.segment == 5 and chunk.level == level][-1]
    data[last.offset + last.length // 2] ^= 1
    with athcodec.open(io.BytesIO(bytes(data))) as decoder:
        with pytest.raises(BadChecksum, match="segment 5"):
            decoder.positions()
        assert np.array_equal(decoder.positions(slice(0, 36)), intact)


def test_squared_lengths_of_vectors_that_move_follow_from_those_before():
    rng = np.random.default_rng(1)
    vectors, jump, slope = rng.normal(size=(5, 3, 9)), *rng.normal(size=(2, 5, 3))
    jumps, slopes = rng.normal(size=(2, 7))
    moved = vectors[:, :, :7] + jump[:, :, None] * jumps + slope[:, :, None] * slopes
    of_each, means = (joins._Moved(lambda part: vectors[part], jump, slope, some) for some in (False, True))
    np.testing.assert_allclose(of_each.by(jumps, slopes), (moved**2).sum(axis=1))
    np.testing.assert_allclose(means.by(jumps, slopes), (moved**2).sum(axis=1).mean(axis=0))
