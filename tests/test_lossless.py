"""A lossless file: its last level gives the source's own numbers, and its others play as ever."""

import numpy as np
import pytest
from files import Parts, coded, opened
from plants import clip_of, plant

import athcodec
from athcodec.cli import main
from athcodec.decoding import container as ct
from athcodec.errors import BadChunk, BadChunkTable


def bits(array: np.ndarray) -> bytes:
    return np.ascontiguousarray(array).tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("bound", [{}, {"rel_error": 1e-3}])
def test_the_last_level_has_every_bit_of_positions_and_rest_pose(dtype, bound):
    clip = plant(seed=3, branches=9, frames=40, dtype=dtype, offset=5.0)
    decoder = opened(athcodec.encode(clip, lossless=True, segment_frames=16, effort="fast", **bound), strict=True)
    assert bits(decoder.positions()) == bits(clip.positions) and decoder.positions().dtype == dtype
    assert bits(decoder.positions(17)) == bits(clip.positions[17])
    assert bits(decoder.file.rest.astype(clip.rest_dtype)) == bits(clip.rest.astype(clip.rest_dtype))
    assert decoder.file.max_error_bound == 0 and decoder.levels[-1].max_error == 0


def test_the_level_before_keeps_the_bound_and_plays_as_without(tmp_path):
    clip = plant(seed=4, branches=9, frames=40)
    lossless = opened(athcodec.encode(clip, lossless=True, rel_error=1e-4))
    with coded(clip, tmp_path / "b.ath", rel_error=1e-4, exact_rest=True) as lossy:
        assert lossless.file.level_count == lossy.file.level_count + 1
        for level in range(lossy.file.level_count):
            assert bits(lossless.positions(level=level)) == bits(lossy.positions(level=level))


def test_the_hierarchy_is_as_deep_as_that_of_the_lossy_file(tmp_path):
    clip = plant(seed=6, branches=9, frames=40)
    lossless = opened(athcodec.encode(clip, lossless=True, rel_error=1e-4, ladder="none"))
    lossy = athcodec.encode(clip, tmp_path / "b.ath", rel_error=1e-4, ladder="none")
    assert lossless.file.full_level_count == len(lossy.levels) + 1
    assert lossless.file.table1() == lossy.table1 == lossless.file.info()["ath"]
    assert lossy.table1["depth"] == len(lossy.levels) - 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_numbers_that_arithmetic_would_change_come_back(dtype):
    """Zeros with a sign, the smallest numbers there are, neighbours of 1."""
    rng = np.random.default_rng(7)
    rest = rng.normal(size=(6, 3))
    positions = (rest + 0.1 * rng.normal(size=(20, 6, 3))).astype(dtype)
    positions[3:7, 2] = 0.0
    positions[4, 2] = -0.0
    positions[5, 3] = np.finfo(dtype).smallest_subnormal
    positions[6, 1] = -np.finfo(dtype).smallest_subnormal
    clip = clip_of(positions, rest, np.zeros(6, np.int32), np.array([-1], np.int32), dtype)
    assert bits(opened(athcodec.encode(clip, lossless=True)).positions()) == bits(positions)


def test_leaving_the_last_level_out_leaves_a_lossy_file(tmp_path):
    clip = plant(seed=5, branches=9, frames=40)
    data = athcodec.encode(clip, lossless=True, rel_error=1e-4)
    (tmp_path / "a.ath").write_bytes(data)
    deepest = opened(data).file.level_count - 1
    athcodec.truncate(tmp_path / "a.ath", tmp_path / "b.ath", deepest - 1)
    shorter = opened((tmp_path / "b.ath").read_bytes(), strict=True)
    assert bits(shorter.positions()) == bits(opened(data).positions(level=deepest - 1))
    assert 0 < shorter.file.max_error_bound == shorter.levels[-1].max_error
    cut = opened(data[: opened(data).file.levels[deepest - 1].bytes])
    assert bits(cut.positions()) == bits(shorter.positions())


def test_a_missing_or_corrupted_exact_level_is_refused_by_name():
    clip = plant(seed=6, branches=5, frames=40)
    parts = Parts.of(athcodec.encode(clip, lossless=True, segment_frames=16))
    last = parts.header.level_count - 1
    i = parts.index(ct.EXACT, last, 1)
    with pytest.raises(BadChunkTable, match="EXACT"):
        opened(parts.with_chunks(parts.chunks[:i] + parts.chunks[i + 1 :])).file.check()
    for payload in (parts.payload(ct.EXACT, last) + b"\x01" * 12, b"\xff" * 900):
        decoder = opened(parts.with_payload(ct.EXACT, payload, last))
        with pytest.raises(BadChunk, match="EXACT"):
            decoder.positions(0)
        assert decoder.positions(0, last - 1).shape == (clip.vertex_count, 3)


def test_the_command_line_makes_lossless_files_as_small_as_the_api_does(tmp_path):
    """The bound of the last lossy level has a default of its own, which the command line must not replace."""
    sample = athcodec.sample_path()
    assert main(["encode", str(sample), str(tmp_path / "cli.ath"), "--lossless", "--effort", "fast"]) == 0
    with athcodec.read_hdf5(sample) as clip:
        athcodec.encode(clip, tmp_path / "api.ath", lossless=True, effort="fast")
    assert (tmp_path / "cli.ath").read_bytes() == (tmp_path / "api.ath").read_bytes()
