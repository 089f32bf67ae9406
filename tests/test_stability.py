"""Sizes follow the bound and the motion, not the pose that the plant stands in."""

from __future__ import annotations

import math

import numpy as np
import pytest
from plants import blown_tree, clip_of

import athcodec

LOOSER = 1.02  # of the size of a file, with a looser bound


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
