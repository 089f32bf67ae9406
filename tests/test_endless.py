"""Clips that play without an end: transitions are not seen, no order comes back, and players always find one."""

from __future__ import annotations

import numpy as np
import pytest
from files import coded
from test_blending import beams

import athcodec
from athcodec.cli import main
from athcodec.errors import ClipError
from athcodec.motion.transitions import transitions_of
from bench.trees.plant import grow
from bench.trees.wind import Wind

FRAMES, FPS = 200, 30.0
HOUR = 3600.0


@pytest.fixture(scope="module")
def tree():
    """A small tree of beams in wind."""
    return beams(grow(300, 2, 8.0, seed=3), Wind(6.0, 8.0, seed=3), FRAMES)


@pytest.fixture(scope="module")
def tree_ath(tree, tmp_path_factory):
    path = tmp_path_factory.mktemp("endless") / "tree.ath"
    return athcodec.encode(athcodec.endless(tree), path, rel_error=1e-4).path


def _jerk(positions) -> float:
    return float(np.linalg.norm(np.diff(np.float64(positions), 2, axis=0), axis=-1).max())


def test_no_transition_jerks_more_than_the_clip(tree, tree_ath):
    """An hour of play shows nothing but frames of the clip and these transitions."""
    most = 1.5 * _jerk(tree.block(0, FRAMES))
    with athcodec.open(tree_ath) as decoder:
        found = transitions_of(decoder.metadata, FRAMES)
        assert len(found) >= 12
        for leave, enter, frames in found:
            shown = []
            for step in range(-2, frames + 3):
                share = np.clip(step / frames, 0, 1)
                weight = share * share * (3 - 2 * share)
                places = [((leave + step) / FPS, 1 - weight), ((enter + step) / FPS, weight)]
                shown.append(decoder.blended_places([(max(at, 0), part) for at, part in places if part > 0]))
            assert _jerk(shown) <= most


def test_minutes_of_play_have_no_seam(tree, tree_ath):
    most, recent = 1.5 * _jerk(tree.block(0, FRAMES)), []
    with athcodec.open(tree_ath) as decoder:
        play = decoder.endless(seed=5)
        for picture in range(int(120 * FPS)):
            recent = [*recent[-2:], play.positions(1800 + picture / FPS)]
            assert len(recent) < 3 or _jerk(recent) <= most


def test_an_hour_has_no_period(tree_ath):
    """Of all shifts of at least the clip's length none shows the same place at more than a third of all times."""
    with athcodec.open(tree_ath) as decoder:
        play = decoder.endless()
        places = np.array([play.places(t)[-1][0] for t in np.arange(0, HOUR, 0.2)])
        assert places.max() <= decoder.time[-1] and places.min() >= 0
        seen = np.histogram(places, bins=20, range=(0, decoder.time[-1]))[0]
        assert (seen > 0).mean() > 0.7  # most of the clip is shown
        for shift in range(int(FRAMES / FPS / 0.2), len(places) // 2):
            assert (np.abs(places[shift:] - places[:-shift]) < 1 / FPS).mean() < 1 / 3


def test_a_seed_names_a_play_and_any_time_of_it_can_be_asked_for(tree_ath):
    with athcodec.open(tree_ath) as decoder:
        one, again, other = (decoder.endless(seed) for seed in (3, 3, 4))
        times = np.random.default_rng(1).uniform(0, HOUR, 300)
        there = [one.places(t) for t in times]
        assert there[::-1] == [again.places(t) for t in times[::-1]]
        assert there != [other.places(t) for t in times]
        for wrong in (-0.1, float("nan"), float("inf")):
            with pytest.raises(ValueError, match="seconds"):
                one.places(wrong)
        first = decoder.positions(7)
        assert np.allclose(one.positions(7 / FPS), first, atol=1e-4)


@pytest.mark.parametrize(
    "given",
    [None, [], 5, "x", [[1, 2]], [[1, 2, 0]], [[-1, 2, 3]], [[1.0, 2, 3]], [[True, 2, 3]], [[10, 20, 30]], [[5, 90, 9]],
     [[99, 0, 1]]],
)  # fmt: skip
def test_transitions_that_no_player_could_take_are_none(given):
    assert transitions_of({"transitions": given}, 100) == []


def test_a_motion_that_does_not_come_back_is_refused():
    steps = np.arange(60, dtype=np.float32) ** 2
    moving = np.zeros((60, 2, 3), np.float32)
    moving[:, 1, 0] = 1 + steps
    clip = athcodec.MotionClip(moving, np.arange(60) / 30, [0, 0], [-1])
    with pytest.raises(ClipError, match="endless"):
        athcodec.endless(clip)
    for count in (1, 2, 9):
        with pytest.raises(ClipError, match="endless"):
            athcodec.endless(clip.replace(positions=moving[:count], time=clip.time[:count]))


def test_each_clip_of_a_file_has_its_own(tree, tmp_path):
    path = tmp_path / "two.ath"
    shorter = tree.replace(positions=tree.positions[:150], time=tree.time[:150])
    with coded(athcodec.join({"calm": shorter, "storm": athcodec.endless(tree)}), path, rel_error=1e-2) as decoder:
        assert [clip["transitions"] > 0 for clip in decoder.file.info()["clips"]] == [False, True]
        with pytest.raises(ValueError, match="transitions"):
            decoder.play("calm").endless()
        assert decoder.play("storm").endless().positions(500.0).shape == (decoder.file.vertex_count, 3)


def test_the_command_line_finds_and_prints_them(tmp_path, capsys):
    source, out = str(athcodec.sample_path()), str(tmp_path / "out.ath")
    assert main(["encode", source, "-o", out, "--rel-error", "1e-2", "--effort", "fast", "--endless", "all"]) == 0
    capsys.readouterr()
    assert main(["info", out]) == 0
    assert "transitions" in capsys.readouterr().out
