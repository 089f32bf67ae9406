"""Work of the search for settings: it is counted, and keeps to what a clip allows."""

from __future__ import annotations

import numpy as np
import pytest
from plants import plant, turns

import athcodec
from athcodec import MotionClip
from athcodec.encoding.decisions import FileDecisions
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search import progress
from athcodec.encoding.search.choices import learned_bases
from athcodec.encoding.search.search import Search
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.settings import Settings
from athcodec.motion.branches.result import with_branches
from bench import odd
from bench.scenes import fields, singles

pytestmark = pytest.mark.sizes


def sheet(**options) -> MotionClip:
    return odd.MAKERS["rippling_sheet"](seed=1, **{"side": 16, "frames": 40, "bumps": 5} | options)


KINDS = {
    "plant": lambda: plant(seed=1, branches=10, frames=40),
    "few frames": lambda: plant(seed=2, branches=60, frames=3),
    "many frames": lambda: plant(seed=3, branches=2, frames=400),
    "sheet without branches": lambda: sheet(side=10),
    "points": lambda: odd.MAKERS["drifting_points"](seed=1, points=100, frames=9, noise=1e-4),
    "noise": lambda: odd.MAKERS["white_noise"](seed=1, points=15, frames=40),
    "one vertex": lambda: odd.MAKERS["one_vertex"](seed=1, frames=40),
    "still": lambda: odd.MAKERS["still_mesh"](seed=1, frames=3, nodes=60, leaves=10),
}


@pytest.fixture
def works(monkeypatch) -> list[progress.Work]:
    """The work of every decision about a file."""
    works: list[progress.Work] = []
    decide = FileDecisions._decide

    def noted(decisions: FileDecisions, bound: float, work: progress.Work) -> object:
        works.append(work)
        return decide(decisions, bound, work)

    monkeypatch.setattr(FileDecisions, "_decide", noted)
    return works


def allow(share: float, monkeypatch) -> None:
    monkeypatch.setattr(progress, "LEAST_WORK", share * progress.LEAST_WORK)
    monkeypatch.setattr(progress, "WORK", share * progress.WORK)


@pytest.mark.parametrize("share", [1.0, 0.3])
@pytest.mark.parametrize("kind", KINDS)
def test_counted_work_keeps_to_what_the_clip_allows(kind, share, works, monkeypatch):
    allow(share, monkeypatch)
    athcodec.encode(KINDS[kind]())
    assert works and all(work.done <= work.allowed for work in works)


def test_a_search_names_what_it_left_out(works, tmp_path, monkeypatch):
    clip, path = plant(seed=1, branches=20, frames=40), tmp_path / "a.ath"
    assert athcodec.encode(clip, path).untried == ()
    whole = works[-1].done
    allow(0.1, monkeypatch)
    assert "all choices again" in athcodec.encode(clip, path).untried
    assert works[-1].done < whole
    assert athcodec.encode(clip, path, effort="best").untried == ()


def test_branches_that_are_not_tried_are_named(tmp_path, monkeypatch):
    allow(0.05, monkeypatch)
    assert "branches" in athcodec.encode(sheet(), tmp_path / "a.ath").untried


def summed_shapes(turns_by: float = 0.0) -> MotionClip:
    """Cards that move by a few shapes, and may turn as a whole besides."""
    rng, cards = np.random.default_rng(1), 60
    rest = np.repeat(rng.normal(size=(cards, 3)), 6, axis=0) + 0.05 * rng.normal(size=(6 * cards, 3))
    weights = 0.06 * np.cumsum(rng.normal(size=(120, 3)), axis=0)
    moved = rest + np.tensordot(weights, rng.normal(size=(3, 6 * cards, 3)), 1)
    angles = np.linspace(0.0, turns_by, 120)[:, None] * np.array([0.0, 1.0, 0.0])
    moved = np.einsum("tij,tvj->tvi", turns(angles), moved)
    branches = np.repeat(np.arange(cards), 6), np.minimum(np.arange(cards), 1) - 1
    return MotionClip(moved, np.arange(120) / 30, *branches, rest=rest)


def test_time_bases_of_motion_that_sums_a_few_shapes_are_learned_where_work_is_short():
    clip = summed_shapes()
    in_waves, learned = (athcodec.encode(clip, effort=effort, ladder="none") for effort in ("fast", "default"))
    assert len(learned) < 0.75 * len(in_waves)


def test_what_turns_as_a_whole_and_sums_a_few_shapes_has_time_bases_where_work_is_short(monkeypatch):
    """Each shape, seen from where it does not turn, is at most three."""
    allow(0.1, monkeypatch)
    standing, turning = (len(athcodec.encode(summed_shapes(by), ladder="none", rel_error=1e-4)) for by in (0.0, 1.5))
    assert turning < 3 * standing


def test_time_bases_that_pay_stay_where_work_ends(monkeypatch):
    """Waves at the levels where these are shorter are one more trial, which may no longer fit."""
    costs = []

    def ended(search: Search) -> None:
        trials, start = search.trials, search.trials.start
        costs.extend(trials.costs([start, start.in_learned_bases()]))
        trials.work.allowed = trials.work.done
        costs.append(trials.cost(learned_bases.best_bases(start.in_learned_bases(), trials)))
        raise InterruptedError

    monkeypatch.setattr(Trials, "without", lambda _, feature: feature is Feature.COMMON_BASIS)
    monkeypatch.setattr(Search, "decide", ended)
    with pytest.raises(InterruptedError):
        athcodec.encode(summed_shapes(), ladder="none", rel_error=1e-4)
    waves, learned, chosen = costs
    assert chosen <= learned < waves


def test_rotations_that_trials_show_to_be_larger_are_not_taken_where_work_ends(monkeypatch):
    """Only one of the settings of refinements is coded then."""
    clip = fields.stems(seed=4, plants=12).clip
    clip = clip.replace(positions=clip.block(0, 12), time=clip.time[:12])
    usual, first_layer = len(athcodec.encode(clip, rel_error=1e-4)), Search.first_layer

    def last(search: Search) -> Settings:
        settings = first_layer(search)
        search.trials.work.allowed = search.trials.work.done
        return settings

    monkeypatch.setattr(Search, "first_layer", last)
    assert len(athcodec.encode(clip, rel_error=1e-4)) <= 1.01 * usual


@pytest.mark.parametrize("share", [0.35, pytest.param(0.5, marks=pytest.mark.slow)])
def test_leaves_hung_in_many_orders_are_hardly_larger_where_work_is_short(share, monkeypatch):
    """Each trial of a deep hierarchy takes much work: time bases, which save most, may not wait for other choices, and
    of two refinements the one that is smaller by trials is coded."""
    clip = singles.willow(seed=1, leaves=60).without_faces().bare()
    clip = with_branches(clip, athcodec.find_branches(clip))
    usual = len(athcodec.encode(clip, rel_error=1e-4))
    allow(share, monkeypatch)
    assert len(athcodec.encode(clip, rel_error=1e-4)) <= 1.02 * usual


@pytest.mark.parametrize("share", [0.001, 0.1])
def test_less_work_gives_a_file_that_keeps_its_bound(share, tmp_path, monkeypatch):
    allow(share, monkeypatch)
    for clip in (plant(seed=1, branches=20, frames=40), sheet()):
        summary = athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-4)
        with athcodec.open(tmp_path / "a.ath") as decoder:
            away = np.linalg.norm(decoder.positions().astype(float) - clip.block(0, clip.frame_count), axis=2)
        assert summary.untried and away.max() <= summary.max_error_bound


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3])
def test_the_same_is_left_out_with_any_number_of_threads(share, monkeypatch):
    allow(share, monkeypatch)
    clip = plant(seed=1, branches=20, frames=40)
    assert len({athcodec.encode(clip, jobs=jobs) for jobs in (1, 4)}) == 1
