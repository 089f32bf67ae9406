"""Trials of branches: what one candidate shows to be hopeless is not tried on the others, which rank as they did."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from plants import blown_tree, diagonal

import athcodec
from athcodec import MotionClip
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.preparation import branch_trials
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.branch_trials import Trial, best_branches
from athcodec.encoding.search.progress import Work
from athcodec.motion.branches.finding import candidates
from athcodec.motion.branches.result import Found
from bench.scenes import fields, singles

pytestmark = pytest.mark.sizes

BOUND = BoundOption(rel_error=1e-4)


@pytest.fixture(scope="module")
def hedge() -> MotionClip:
    return fields.stems(seed=5, plants=4).bare()


@pytest.fixture(scope="module")
def found(hedge) -> list[Found]:
    return list(itertools.islice(candidates(hedge), 3))


def trial(clip: MotionClip, options: EncodingOptions | None = None) -> tuple[Trial, Work]:
    work = Work()
    return Trial(clip, BOUND, options or EncodingOptions(), work), work


def work_of(one: Trial, work: Work, branches: Found) -> tuple[float, int]:
    """Return the size of a file on some branches, and the work of the trial."""
    before = work.done
    return one.size(branches)[0], work.done - before


def test_the_same_pieces_that_hang_elsewhere_take_less_work_after_others_than_alone(hedge, found):
    one, work = trial(hedge)
    one.size(found[0])
    size, second = work_of(one, work, found[1])
    alone, whole = work_of(*trial(hedge), found[1])
    assert second < 0.8 * whole
    assert size == pytest.approx(alone, rel=0.03)


def test_branches_that_are_far_larger_in_waves_are_tried_in_waves_alone(hedge, found):
    one, work = trial(hedge)
    single = Found(np.zeros(hedge.vertex_count, np.int32), np.array([-1], np.int32), None, "motion")
    size, _ = work_of(one, work, found[0])
    other, spent = work_of(one, work, single)
    alone, whole = work_of(*trial(hedge), single)
    assert size < alone and size < other and spent < whole


@pytest.mark.parametrize("of_order", [90.0, 110.0])
def test_the_order_of_the_source_stays_only_if_it_is_smaller(of_order, hedge, found, monkeypatch):
    """Of three candidates the second is the first in the order of the source; the third hangs elsewhere."""
    turned = -np.arange(hedge.vertex_count, dtype=np.int32)
    ordered = [dataclasses.replace(branches, stem_index=turned) for branches in found[:2]]
    proposed = [ordered[0], dataclasses.replace(ordered[0], stem_index=None), ordered[1]]
    monkeypatch.setattr(branch_trials, "candidates", lambda *_: iter(proposed))
    tried: list[bool] = []

    def noted(self: Trial, branches: Found) -> tuple[float, bool]:
        tried.append(branches.stem_index is None)
        return (of_order if len(tried) == 2 else 100.0), False

    monkeypatch.setattr(Trial, "size", noted)
    best_branches(hedge, BOUND, Work())
    assert tried == [False, True, of_order < 100]


def test_a_trial_goes_by_the_faces_of_the_file(hedge, found):
    """Rest poses that go by faces are smaller, which depends on the branches."""
    with_faces, without = EncodingOptions(), EncodingOptions(attributes="none")
    assert trial(hedge, with_faces)[0].size(found[0])[0] < trial(hedge, without)[0].size(found[0])[0]


def test_patches_that_hang_on_nothing_are_tried_at_the_usual_effort():
    clip = singles.cloth_leaf(seed=38, frames=40).bare()
    usual, best = (len(athcodec.encode(clip, effort=effort, rel_error=1e-4)) for effort in ("default", "best"))
    assert usual <= 1.05 * best


@pytest.mark.parametrize("of_torn, is_torn", [(1000.0, False), (900.0, True)])
def test_a_plant_is_not_divided_where_that_saves_less_than_trials_err_by(of_torn, is_torn, hedge, monkeypatch):
    single = Found(np.zeros(hedge.vertex_count, np.int32), np.array([-1], np.int32), None, "motion")
    torn = Found(np.arange(hedge.vertex_count, dtype=np.int32) % 3, np.full(3, -1, np.int32), None, "motion")
    monkeypatch.setattr(branch_trials, "candidates", lambda clip, by_points: iter([single, torn]))
    monkeypatch.setattr(Trial, "size", lambda self, branches: (of_torn if branches is torn else 1010.0, False))
    assert best_branches(hedge, BOUND, Work())[0] is (torn if is_torn else single)


def test_runs_of_points_that_tremble_by_a_small_part_of_the_bound_are_tried():
    clip = blown_tree(3, branches=60, frames=40)
    order = np.random.default_rng(5).permutation(clip.vertex_count)
    points = clip.block(0, clip.frame_count).astype(np.float64)[:, order]
    trembling = points + np.random.default_rng(1).normal(0, 0.01 * BOUND.rel_error * diagonal(clip), points.shape)

    clips = [MotionClip(positions.astype(np.float32), clip.time) for positions in (trembling, points)]
    trembles, usual = (len(athcodec.encode(each, rel_error=BOUND.rel_error, ladder="none")) for each in clips)
    assert trembles < 1.4 * usual
