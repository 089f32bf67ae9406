"""Frames that repeat the one before: they are not coded, and come back as what they repeat."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import athcodec
from athcodec.metrics import ErrorMeter
from athcodec.motion.clip import ClipRange

BOUND = 1e-3
FEW = dict(rel_error=BOUND, attributes="none", ladder="none", effort="fast")


@pytest.fixture(scope="module")
def poses() -> athcodec.MotionClip:
    """The first frames of the sample."""
    with athcodec.read_hdf5(athcodec.sample_path()) as clip:
        some = clip.block(0, 40), np.arange(40) / 10.0, clip.vertex_branch, clip.branch_parent
        return athcodec.MotionClip(*some, rest=clip.rest)


def held(clip: athcodec.MotionClip, times: np.ndarray | int) -> athcodec.MotionClip:
    """Each pose so many times."""
    positions = np.repeat(clip.positions, times, axis=0)
    return clip.replace(positions=positions, time=np.arange(len(positions)) / 30.0)


def encoded(clip: athcodec.MotionClip, path: Path, **options) -> athcodec.Summary:
    summary = athcodec.encode(clip, path, **FEW | options)
    with athcodec.open(path, strict=True) as decoder:
        meter = ErrorMeter(clip.rest)
        meter.add(clip.positions, decoder.positions())
        assert meter.max_error <= summary.max_error_bound
    return summary


def repeats_of(decoder: athcodec.Decoder) -> list[bool]:
    return decoder.file.tables.header.repeats.tolist()


@pytest.mark.slow
def test_held_poses_take_few_bytes_more_than_the_poses(poses, tmp_path):
    once = encoded(poses, tmp_path / "once.ath").bytes
    threes = encoded(held(poses, 3), tmp_path / "threes.ath").bytes
    uneven = encoded(held(poses, np.arange(40) % 4 + 1), tmp_path / "uneven.ath").bytes
    assert threes <= once + 12
    assert uneven <= once + 30


@pytest.mark.parametrize("ladder", ["none", "decades"])
def test_repeats_have_the_very_positions_at_every_level(poses, tmp_path, ladder):
    encoded(held(poses, 3), tmp_path / "held.ath", ladder=ladder)
    with athcodec.open(tmp_path / "held.ath") as decoder:
        for level in range(decoder.file.level_count):
            positions = decoder.positions(level=level)
            assert np.array_equal(positions, np.repeat(positions[::3], 3, axis=0))


def test_between_repeats_nothing_moves(poses, tmp_path):
    """Times behind one another are blended as they are of any other frames."""
    encoded(held(poses, 2), tmp_path / "held.ath")
    with athcodec.open(tmp_path / "held.ath") as decoder:
        assert repeats_of(decoder) == [False, True] * 40
        assert np.array_equal(decoder.time, np.arange(80) / 30.0)


def test_a_segment_begins_with_a_frame_of_its_own(poses, tmp_path):
    clip = held(poses, 3)
    encoded(clip, tmp_path / "held.ath", segment_frames=16)
    with athcodec.open(tmp_path / "held.ath") as decoder:
        starts = [start for start, _ in decoder.segments]
        assert len(starts) > 4
        expected = np.arange(120) % 3 > 0
        expected[starts] = False
        assert repeats_of(decoder) == expected.tolist()


def test_shortened_files_keep_repeats(poses, tmp_path):
    encoded(held(poses, 3), tmp_path / "held.ath", ladder="decades", rel_error=1e-4)
    athcodec.truncate(tmp_path / "held.ath", tmp_path / "short.ath", level=1)
    with athcodec.open(tmp_path / "held.ath") as whole, athcodec.open(tmp_path / "short.ath", strict=True) as short:
        assert repeats_of(short) == repeats_of(whole)
        assert np.array_equal(short.positions(), whole.positions(level=1))


def test_lossless_repeats_are_told_by_their_bits(poses):
    """0.0 and -0.0 are equal, and two numbers."""
    positions = np.repeat(poses.positions[:3], 3, axis=0)
    positions[:, 0] = 0.0
    positions[4, 0] = -0.0
    clip = poses.replace(positions=positions, time=np.arange(9) / 30.0)
    with athcodec.open(athcodec.encode(clip, lossless=True, attributes="none")) as decoder:
        assert repeats_of(decoder) == [False, True, True, False, False, False, False, True, True]
        assert decoder.positions().tobytes() == positions.tobytes()


def test_a_loop_holds_its_poses(poses, tmp_path):
    clip = held(poses, 2)
    loop = clip.replace(clip_ranges=(ClipRange("loop", 80, True),))
    encoded(loop, tmp_path / "held.ath")
    with athcodec.open(tmp_path / "held.ath") as decoder:
        assert decoder.clip.loop
        assert sum(repeats_of(decoder)) == 40


@pytest.mark.parametrize("options", [{}, {"segment_frames": 32}, {"weights": np.linspace(0.5, 2.0, 1001)}])
def test_poses_that_are_held_but_for_rounding_are_coded_once_and_every_frame_keeps_its_bound(poses, tmp_path, options):
    clip, rng = held(poses, 3), np.random.default_rng(1)
    size = float(np.linalg.norm(np.ptp(poses.positions.reshape(-1, 3), axis=0)))
    noise = 4e-8 * size * rng.uniform(-1, 1, clip.positions.shape)
    noisy = clip.replace(positions=(clip.positions + noise).astype(np.float32))
    summary = athcodec.encode(noisy, tmp_path / "noisy.ath", **FEW | options)
    plain = athcodec.encode(clip, tmp_path / "plain.ath", **FEW | options)
    assert summary.bytes <= 1.05 * plain.bytes
    with athcodec.open(tmp_path / "plain.ath") as decoder:
        expected = repeats_of(decoder)
    with athcodec.open(tmp_path / "noisy.ath", strict=True) as decoder:
        assert repeats_of(decoder) == expected and sum(expected) == 80
        error = np.linalg.norm(decoder.positions() - noisy.positions.astype(np.float64), axis=2)
        weights = options.get("weights", np.ones(1))
        assert (error <= weights * BOUND * size * (1 + 1e-6)).all()
        for level in decoder.levels:
            shown = np.linalg.norm(decoder.positions(level=level.level) - noisy.positions.astype(np.float64), axis=2)
            assert shown.max() <= level.max_error
        assert len(decoder.file.time) == 120
