"""How an encoder cuts motion into segments, and what more effort gives: each is held to the files that it makes."""

import numpy as np
import pytest

import athcodec

pytestmark = pytest.mark.sizes


def fluttering(seed, frames, rows=8, columns=3):
    """Return (frames, rows * columns, 3) positions of a leaf that is held at its foot and swings in a few modes."""
    rng = np.random.default_rng(seed)
    along, across = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, rows), np.linspace(-0.2, 0.2, columns)))
    positions = np.zeros((frames, len(along), 3))
    positions[..., 0], positions[..., 2] = along, across
    decay = np.exp(-0.03 * np.arange(120))
    for mode in range(1, 6):
        swing = np.convolve(rng.normal(size=frames + 119), decay * np.sin(0.13 * mode * np.arange(120)), "valid")
        positions[..., 1] += np.outer(swing, along**2 * np.cos(2.0 * mode * along + 9.0 * mode * across)) * 0.03 / mode
    return positions.astype(np.float32)


def cut(seed, shots, frames, points=60, waves=12):
    """Return shots of a stem of many waves that travel, of so many frames each, one after the other."""
    rng = np.random.default_rng(seed)
    along, time = np.linspace(0, 1, points), np.arange(frames)[:, None]
    positions = np.zeros((shots, frames, points, 3))
    positions[..., 1] = along
    for shot in positions:
        for wave in range(1, waves):
            turns = rng.uniform(0.02, 0.3) * time + rng.uniform(1, 4) * wave * along + rng.uniform(0, 6.28)
            shot[..., rng.choice([0, 2])] += 0.1 / wave * along * np.sin(turns)
    return positions.reshape(-1, points, 3).astype(np.float32)


def encoded(positions, **options):
    options = {"rel_error": 1e-4, "ladder": "none"} | options
    file = athcodec.encode(positions, fps=60, unit="m", **options)
    return len(file), athcodec.open(file).file.segment_count


@pytest.mark.parametrize("rel_error", [1e-3, pytest.param(1e-5, marks=pytest.mark.slow)])
def test_a_leaf_takes_at_most_2_percent_more_than_in_its_best_segments(rel_error):
    leaf = fluttering(1, 280)
    fixed = [encoded(leaf, rel_error=rel_error, segment_frames=frames)[0] for frames in (256, 128, 64, 32)]
    assert encoded(leaf, rel_error=rel_error)[0] <= 1.02 * min(fixed)


@pytest.mark.parametrize("ladder", ["decades", pytest.param("none", marks=pytest.mark.slow)])
def test_what_is_cut_into_shots_gets_segments_as_short_as_these(ladder):
    shots = cut(1, 4, 32, 30)
    size, segments = encoded(shots, ladder=ladder)
    assert segments >= 4
    assert size < 0.95 * encoded(shots, ladder=ladder, segment_frames=256)[0]


@pytest.mark.parametrize("seed, frames", [(2, 300), (1, 40)])
def test_more_effort_never_makes_a_larger_file(seed, frames):
    leaf = fluttering(seed, frames)
    fast, usual, best = (encoded(leaf, rel_error=1e-3, effort=effort)[0] for effort in ("fast", "default", "best"))
    assert best <= usual <= fast
