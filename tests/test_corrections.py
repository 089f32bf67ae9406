"""Corrections: what brings vertices within the bound, and how it looks in motion."""

import numpy as np
import pytest

import athcodec
from athcodec._native import BRANCH
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.motion import Plan
from athcodec.encoding.segments import segment
from athcodec.encoding.streams import streams

pytestmark = pytest.mark.sizes

VERTICES, FRAMES = 40, 96
NOWHERE = np.zeros(3)


def found(error: np.ndarray, limit, dtype=np.float32) -> tuple[np.ndarray, np.ndarray]:
    """Corrections of positions that are off by (N, 3, T), and what is left."""
    wanted = np.random.default_rng(1).normal(size=error.shape)
    decoded = (wanted + error).astype(dtype)
    step = qz.single(qz.CORRECTION_STEP * np.min(limit))
    rows = streams.find_corrections(decoded, wanted, NOWHERE, limit, step)
    assert rows is not None
    streams.apply_corrections(decoded, rows, step)
    return rows, decoded.astype(np.float64) - wanted


def lengths(error: np.ndarray) -> np.ndarray:
    return np.linalg.norm(error, axis=1)


def bends(error: np.ndarray) -> np.ndarray:
    """Lengths of second differences over frames."""
    return lengths(np.diff(error, 2, axis=2))


def waves(amplitude: float) -> np.ndarray:
    """An error that changes slowly."""
    random = np.random.default_rng(2)
    phase, period = random.uniform(0, 6, (VERTICES, 3, 1)), random.uniform(24, 48, (VERTICES, 3, 1))
    return amplitude * np.sin(2 * np.pi * np.arange(FRAMES) / period + phase)


def test_what_is_within_the_limit_is_left_alone():
    rows, _ = found(waves(0.5e-3), 1e-3)
    assert len(rows) == 0


def test_an_error_that_changes_slowly_changes_slowly_when_corrected():
    error = waves(0.8e-3)
    rows, left = found(error, 1e-3)
    beyond = (lengths(error) > 1e-3).sum()
    assert beyond > 2 * len(rows) > 0
    assert bends(left).max() < 1e-3


def test_a_single_frame_that_is_off_is_corrected_alone():
    error = np.zeros((1, 3, FRAMES))
    error[0, 1, 40] = 1.2e-3
    rows, left = found(error, 1e-3)
    assert len(rows) == 1 and rows[0, 1] == 40
    assert lengths(left)[0, 40] <= 1e-3 and bends(left).max() < bends(error).max()


@pytest.mark.parametrize("ladder", ["none", "decades"])
def test_no_vertex_of_the_sample_pops_at_a_loose_bound(ladder, tmp_path):
    """Where the ladder has layers, in none of them: seen against the error that each level has."""
    with athcodec.read(athcodec.sample_path()) as clip:
        source = clip.block(0, clip.frame_count)
        path = athcodec.encode(clip, tmp_path / "tree.ath", rel_error=1e-3, ladder=ladder, attributes="none").path
    with athcodec.open(path) as decoder:
        for level in decoder.levels[decoder.file.core.info.depth_levels - 1 :]:
            error = (decoder.positions(level=level.level).astype(np.float64) - source).transpose(1, 2, 0)
            bound = max(level.max_error, decoder.file.max_error_bound)
            assert bends(error).max() <= 1.5 * bound
            assert ((bends(error) > bound).mean(axis=0) <= 0.02).all()


def test_corrections_that_a_closed_end_cuts_off_bend_little_there():
    """What they add is nothing behind the end, where the segment beside it goes on."""
    random, frames, step = np.random.default_rng(0), 24, 1.12
    ends = []
    for _ in range(100):
        way, middle, width = random.normal(size=3), random.uniform(15, 22), random.uniform(1, 4)
        bump = random.uniform(1.05, 1.4) * np.exp(-(((np.arange(frames) - middle) / width) ** 2))
        decoded = (way[:, None] / np.linalg.norm(way) * bump)[None].astype(np.float32)
        corrected, wanted = decoded.copy(), np.zeros((1, 3, frames))
        met = streams.MetEnds(closed=streams.LAST)
        rows = streams.find_corrections(decoded, wanted, np.zeros(3), 1.0, step, ends=met)
        streams.apply_corrections(corrected, rows, step)
        added = np.pad(corrected - decoded, ((0, 0), (0, 0), (0, 2)))
        ends.append(bends(added)[0, -3:].max())
    assert np.mean(ends) < 0.2


def test_an_excursion_of_a_rigid_part_takes_one_correction_that_bends_little():
    parts = np.array([0]), np.array([4])
    wanted, origin, limit, step = np.zeros((4, 3, 20)), np.zeros(3), 1.0, 0.5
    decoded = wanted.astype(np.float32)
    decoded[:, 2] = 1.3 * np.exp(-(((np.arange(20) - 9) / 3) ** 2))
    rows = streams.find_rigid_corrections(parts, decoded, wanted, origin, limit, step)
    assert rows.tolist() == [[vertex, 9, 0, 0, -3, 2] for vertex in range(4)]
    before = bends(decoded).max()
    streams.apply_corrections(decoded, rows, step)
    assert np.abs(decoded).max() <= limit and bends(decoded).max() <= before + 0.5 * limit


def test_rigid_parts_are_moved_as_a_whole_where_that_serves_all_of_their_vertices():
    parts = np.array([0, 3]), np.array([3, 3])
    wanted, origin, limit, step = np.zeros((6, 3, 12)), np.zeros(3), 1.0, 0.5
    decoded = wanted.astype(np.float32)
    decoded[:3, 0, 5] = 1.2, 1.4, 1.6  # one way
    decoded[3:, 1, 7] = 1.6, 0.0, -1.6  # in opposite ways: no correction of all serves
    rows = streams.find_rigid_corrections(parts, decoded, wanted, origin, limit, step)
    assert rows.tolist() == [[vertex, 5, -3, 0, 0, 1] for vertex in range(3)]  # and not in that frame alone: it pops
    narrow = streams.find_rigid_corrections(parts, decoded, wanted, origin, limit, step, narrow=True)
    assert narrow.tolist() == [[vertex, 5, -3, 0, 0, 0] for vertex in range(3)]
    ends = streams.MetEnds(decided=rows)
    rows = streams.find_corrections(decoded, wanted, origin, [limit] * 3 + [np.inf] * 3, step, ends=ends)
    assert rows is not None
    streams.apply_corrections(decoded, rows, step)
    assert np.abs(decoded[:3]).max() <= limit and decoded[3, 1, 7] == np.float32(1.6)


def test_a_trial_corrects_some_of_very_many_frames_only(monkeypatch):
    """A sheet that waves has rotations that fit nothing."""
    u, v = np.meshgrid(np.linspace(0, 1, 30), np.linspace(0, 1, 30))
    phase = 0.3 * np.arange(60)[:, None, None]
    waves = 0.1 * np.sin(9 * u + phase) * np.cos(7 * v - phase)
    positions = np.stack(np.broadcast_arrays(u, v, waves), axis=-1).reshape(60, -1, 3)
    trials, find = [], segment.find_corrections
    monkeypatch.setattr(segment, "find_corrections", lambda *words: trials.append(find(*words)) or trials[-1])
    athcodec.encode(positions, fps=24, rel_error=1e-4, effort="fast")
    assert 0 < max(len(one.rows) for one in trials) < segment.MANY + segment.MANY_SHARE * positions[..., 0].size


@pytest.mark.parametrize("part", [2, 4, 16])
def test_corrections_of_one_long_branch_are_estimated_on_vertices_all_along_it(part):
    count = 1525
    branches = np.zeros(1, BRANCH)
    branches["parent"], branches["attach"], branches["count"] = -1, -1, count
    plan = Plan(branches, count)
    pieces, vertices = plan.pieces.copy(), plan.sample(part).vertices
    thirds, _ = np.histogram(vertices, 3, (0, count))
    assert len(vertices) < count and (thirds > 0).all()
    assert np.array_equal(plan.pieces, pieces)
