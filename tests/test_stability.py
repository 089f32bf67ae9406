"""Sizes follow the bound, and no level is worse than the level before."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from plants import blown_tree, clip_of, plant

import athcodec

LOOSER = 1.02  # of the size of a file, with a looser bound
RISE = 1.01  # of the RMS error of a level, over that of the level before
PART = 0.01  # of the bound, beyond that


def size_at(clip, bound: float, path, **options) -> int:
    return athcodec.encode(clip, path, rel_error=bound, attributes="none", ladder="none", **options).bytes


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_a_looser_bound_does_not_make_a_larger_file(seed, tmp_path):
    """Of trees blown far from their rest pose."""
    tree, largest = blown_tree(seed), 0
    for bound in np.geomspace(1e-3, 2e-5, 25):
        size = size_at(tree, bound, tmp_path / "a.ath")
        assert largest <= LOOSER * size, (bound, largest, size)
        largest = max(largest, size)


def rms_errors(decoder, source: np.ndarray) -> list[float]:
    """Of every level, as decoded; source: (frames, vertices, 3) of the clip that plays."""
    errors = []
    for level in decoder.levels:
        shown = [decoder.positions(frame, level.level) for frame in range(decoder.frame_count)]
        errors.append(float(np.sqrt(((np.array(shown, np.float64) - source) ** 2).sum(axis=2).mean())))
    return errors


def check_levels(clip, path, **options) -> None:
    bound = athcodec.encode(clip, path, attributes="none", **options).max_error_bound
    with athcodec.open(path) as decoder:
        for own, (start, stop) in zip(decoder.file.clips, clip.clip_range_frames):
            for before, after in pairwise(rms_errors(decoder.play(own.name), clip.block(start, stop))):
                assert after <= RISE * before + PART * bound, (own.name, before, after)


@pytest.mark.parametrize("ladder", ["none", "decades"])
@pytest.mark.parametrize("bound", [1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_no_level_is_worse_than_the_one_before_on_blown_trees(seed, bound, ladder, tmp_path):
    clip = blown_tree(seed, branches=60, frames=40)
    check_levels(clip, tmp_path / "a.ath", rel_error=bound, ladder=ladder)


@pytest.mark.parametrize("ladder", ["none", "decades"])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_no_level_is_worse_than_the_one_before_on_random_plants(seed, ladder, tmp_path):
    clip = plant(seed, branches=30, longest=6, frames=24)
    check_levels(clip, tmp_path / "a.ath", rel_error=1e-3, ladder=ladder)


def test_no_level_of_several_clips_is_worse_than_the_one_before(tmp_path):
    calm, wild = (blown_tree(4, branches=40, frames=30, sway=sway) for sway in (0.05, 0.3))
    check_levels(athcodec.join({"calm": calm, "wild": wild}), tmp_path / "a.ath", rel_error=1e-3)


@pytest.mark.parametrize("angle", [0.9 * math.pi, math.pi])
def test_what_hangs_on_a_stem_that_has_turned_over_costs_no_more_than_on_one_that_stands(angle, tmp_path):
    """A stem that sways about the opposite of its rest pose, which motion is coded about, and a tip on it."""
    about_rest = {"tam": athcodec.Thresholds(0, 0, 0, 0), "effort": "fast"}

    def swaying(turn: float) -> int:
        time = np.arange(240) / 30
        angles = turn + 0.1 * np.sin(2 * np.pi * time)
        side = 0.1 * np.cos(2 * np.pi * time)
        along = np.stack([np.sin(angles), np.cos(angles) * np.cos(side), np.cos(angles) * np.sin(side)], axis=1)
        rest = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 2.5, 0.1], [0, 3, 0.2]])
        positions = along[:, None, :] * rest[None, :, 1:2]
        clip = clip_of(positions, rest, np.array([0, 0, 0, 1, 1]), np.array([-1, 0]))
        return size_at(clip, 1e-4, tmp_path / "a.ath", **about_rest)

    assert swaying(angle) <= 1.25 * swaying(0.0)


@pytest.mark.slow
def test_a_plant_in_a_pot_that_turns_takes_little_more_than_one_that_stands(tmp_path):
    """The trunk of the sample is upright, so that it hardly shows by itself how it turns."""
    with athcodec.read_hdf5(athcodec.sample_path()) as sample:
        calm = sample.rest + 0.2 * (sample.block(0, 60) - sample.rest)
        angles = np.linspace(0, math.pi / 2, 60)
        c, s, o = np.cos(angles), np.sin(angles), np.zeros(60)
        turns = np.stack([c, o, s, o, o + 1, o, -s, o, c], axis=1).reshape(60, 3, 3)
        standing = sample.replace(positions=calm.astype(np.float32), time=sample.time[:60])
        turning = standing.replace(positions=np.einsum("tij,tvj->tvi", turns, calm).astype(np.float32))
        sizes = [size_at(clip, 1e-2, tmp_path / "a.ath") for clip in (standing, turning)]
    assert sizes[1] <= sizes[0] + 150, sizes
