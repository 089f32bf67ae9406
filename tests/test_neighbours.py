"""Encoding warns of frames that list other points each, and of no plant that moves, grows or loses its leaves."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from plants import blown_tree, plant, runs_of_points

import athcodec
from athcodec.cli import main
from athcodec.errors import SourceWarning
from athcodec.motion.clip import MotionClip


def cloud(positions, **more):
    return MotionClip(np.asarray(positions, np.float32), np.arange(len(positions)) / 30, **more)


def scanned(seed=0, frames=6, count=300):
    """A crown of which each frame has other points."""
    return np.random.default_rng(seed).random((frames, count, 3)) * [1, 1, 3]


def grown():
    """Points that come out of one place, one after the other."""
    end, birth = scanned()[0], np.linspace(0, 1, 300)[:, None]
    return [end * np.clip(2 * age - birth, 0, 1) for age in np.linspace(0, 1, 12)]


def falling():
    """Points of which half fall to the ground one after the other."""
    start, fall = scanned()[0], np.random.default_rng(1).random(300)
    frames = np.repeat(start[None], 12, 0)
    for age, frame in enumerate(frames):
        fallen = fall < age / 24
        frame[fallen, 2] = 0
        frame[fallen, :2] += 0.2 * (fall[fallen, None] - 0.25)
    return frames


def carried():
    """A still crown that crosses a field."""
    return scanned()[:1] + 5.0 * np.arange(12)[:, None, None]


def encoded(clip, path):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        athcodec.encode(clip, path, rel_error=1e-2, effort="fast", ladder="none")
    return [str(each.message) for each in caught if issubclass(each.category, SourceWarning)]


@pytest.mark.parametrize("branches", [{}, {"vertex_branch": np.zeros(300, int), "branch_parent": np.array([-1])}])
def test_frames_that_list_other_points_get_one_warning_that_says_what_is_expected(tmp_path, branches):
    (message,) = encoded(cloud(scanned(), **branches), tmp_path / "a.ath")
    assert "far from their neighbour" in message and "the same point" in message and "register" in message


@pytest.mark.filterwarnings("default::athcodec.errors.SourceWarning")
def test_scans_in_numbered_files_are_warned_of_in_one_line_of_stderr(tmp_path, capsys):
    for frame, points in enumerate(scanned()):
        lines = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
        (tmp_path / f"scan_{frame}.obj").write_text(lines)
    output = str(tmp_path / "a.ath")
    assert main(["encode", str(tmp_path / "scan_0.obj"), output, "--effort", "fast", "--rel-error", "1e-2"]) == 0
    assert sum("far from their neighbour" in line for line in capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("motion", [grown, falling, carried])
def test_points_that_grow_fall_or_travel_are_not_warned_of(tmp_path, motion):
    branches = {"vertex_branch": np.zeros(300, int), "branch_parent": np.array([-1])}
    assert encoded(cloud(motion(), **branches), tmp_path / "a.ath") == []


@pytest.mark.parametrize(
    "clip",
    [
        lambda: plant(branches=20, frames=8),
        lambda: blown_tree(0, branches=20, frames=12),
        lambda: plant(branches=20, frames=8, amount=1.5, rough=0.1),
        lambda: runs_of_points([8] * 12, drift=0.5),
    ],
)
def test_plants_in_wind_are_not_warned_of(tmp_path, clip):
    assert encoded(clip(), tmp_path / "a.ath") == []
