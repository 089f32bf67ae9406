"""The bound, attacked: whatever a clip does, no vertex is further off than was promised, at any level, in any
frame.

The attacks are those of attacks.py; `pytest -m slow` draws thousands of them.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
import warnings

import h5py
import numpy as np
import pytest
from attacks import ACTIONS, LARGE, Attack, attacks, broken_promises
from hypothesis import given, settings
from hypothesis import strategies as st
from plants import STEADY, clip_of, plant

import athcodec
from athcodec import cli
from athcodec.encoding import decisions
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.streams import streams
from athcodec.errors import BoundError, ClipError, CoarseWarning
from athcodec.metrics import ErrorMeter


@pytest.mark.parametrize("count", [25, pytest.param(3000, marks=pytest.mark.slow)])
def test_no_attack_breaks_a_promise(count, scratch):
    @settings(STEADY, max_examples=count)
    @given(attacks())
    def attacked(attack):
        assert broken_promises(attack, scratch) == []

    attacked()


def test_a_stem_with_all_modes_at_its_base_level_knows_them_from_the_layer_before(scratch):
    """Its base level has a learned time basis, the level that would complete it has cosines and none of its rows."""
    shape = {"branches": 2, "longest": 3, "hierarchy": "one", "rest": "plane", "scale": 1e6, "squeeze": 1e3}
    time = {"actions": ("flatten", "spike", "flatten"), "frames": 33, "segment_frames": 53}
    attack = Attack(seed=1000000, place=1.0, is_float64=True, effort="default", **shape, **time)
    assert broken_promises(attack, scratch) == []


@pytest.mark.parametrize("action", ACTIONS)
def test_every_action_alone_keeps_the_bound(action, scratch):
    assert broken_promises(Attack(seed=3, branches=6, actions=(action,), frames=33, segment_frames=16), scratch) == []


QUICK = {("1,000 branches on one stem", "fast"), ("1,000 roots", "fast")}


@pytest.mark.parametrize(
    "name, effort",
    [
        pytest.param(*large, marks=() if large in QUICK else pytest.mark.slow)
        for large in itertools.product(LARGE, ("fast", "default", "best"))
    ],
)
def test_large_hierarchies_keep_the_bound_at_every_effort(name, effort, scratch):
    assert broken_promises(dataclasses.replace(LARGE[name], effort=effort), scratch) == []


@pytest.mark.slow
@pytest.mark.parametrize("segment_frames", range(16, 257, 8))
@pytest.mark.parametrize("effort", ["fast", "default", "best"])
def test_every_segment_length_keeps_the_bound(segment_frames, effort, scratch):
    attack = Attack(seed=5, branches=5, frames=257, actions=("walk", "spike"), bound=1e-4, effort=effort)
    assert broken_promises(dataclasses.replace(attack, segment_frames=segment_frames), scratch) == []


def test_a_broken_promise_would_be_seen(scratch, monkeypatch):
    """One vertex moved by two bounds in one frame, then a table that states less than what is measured."""
    attack, positions = Attack(actions=("walk",)), athcodec.Decoder.positions

    def moved(decoder, frames=None, level=None, dtype=None):
        shown = positions(decoder, frames, level, dtype).copy()
        if shown.ndim == 3:
            shown[7, 1, 2] += 2 * decoder.file.max_error_bound
        return shown

    monkeypatch.setattr(athcodec.Decoder, "positions", moved)
    assert any(
        re.match(r"frame 7, vertex 1: [12]\.\d+ bounds off", found) for found in broken_promises(attack, scratch)
    )
    monkeypatch.undo()
    monkeypatch.setattr(athcodec.decoding.container, "round_up_singles", lambda values: 0.5 * np.asarray(values))
    assert re.match(r"level 0, segment 0: stated", broken_promises(attack, scratch)[0])


# ---- what cannot be kept is refused ----


@pytest.mark.parametrize(
    "scale, is_float64", [(1e-300, True), (1e-160, True), (1e-100, True), (1e-40, True), (1e-40, False), (1e-36, False)]
)
def test_plants_too_small_for_the_steps_of_a_file_are_refused(scale, is_float64, scratch):
    """float64 clips of 1e-200 came back hundreds of bounds off, as squares of their errors are 0; of 1e-40,
    encoding never ended, as no step of a file is that small."""
    attack = Attack(scale=scale, is_float64=is_float64, actions=("walk",))
    assert broken_promises(attack, scratch) == []
    clip = attack.clip()
    with pytest.raises(BoundError, match="expected at least 1e-35, the smallest that a file can hold"):
        athcodec.encode(clip, scratch / "tiny.ath", **attack.options(clip))
    summary = athcodec.encode(clip, scratch / "tiny.ath", max_error=2e-35)
    with athcodec.open(summary.path) as decoder:
        assert np.abs(decoder.positions().astype(np.float64) - clip.positions).max() <= 2e-35


def test_points_of_denormal_positions_are_refused_without_another_warning(scratch):
    frames = (1e-42 * np.random.default_rng(0).random((20, 7, 3))).astype(np.float32)
    with pytest.raises(BoundError, match="the smallest that a file can hold"):
        athcodec.encode(athcodec.MotionClip(frames, np.arange(20) / 24), scratch / "tiny.ath")


def test_a_clip_without_any_extent_has_a_bound_that_a_file_can_hold(scratch):
    still = clip_of(np.zeros((3, 2, 3)), np.zeros((2, 3)), [0, 0], [-1])
    summary = athcodec.encode(still, scratch / "still.ath")
    assert summary.max_error_bound >= qz.SMALLEST_BOUND
    with athcodec.open(summary.path) as decoder:
        assert not decoder.positions().any()


class Work:
    """Counts the rest poses, the corrections and the predicted segments that an encoder codes, and ends it where they
    are more than any clip of a few vertices needs."""

    MOST = 5000

    def __init__(self, monkeypatch):
        self.done = 0
        for name in ("encode_rest", "find_corrections", "encode_predicted"):
            monkeypatch.setattr(streams, name, self._counted(getattr(streams, name)))

    def _counted(self, function):
        def counted(*arguments, **named):
            self.done += 1
            assert self.done <= self.MOST, "the encoder goes on and on"
            return function(*arguments, **named)

        return counted


def encoded_or_refused(clip, bound, options, path, work) -> float:
    """The bound that is kept: the one asked for, or the smallest one that its refusal names."""
    work.done = 0
    try:
        summary = athcodec.encode(clip, path, max_error=bound, **options)
    except BoundError as error:
        named = re.search(r"expected at least (\S+?),? (?:twice|for|the smallest)", str(error))
        assert named, str(error)
        bound, work.done = float(named[1]), 0
        summary = athcodec.encode(clip, path, max_error=bound, **options)
    with athcodec.open(summary.path, strict=True) as decoder:
        meter = ErrorMeter()
        meter.add(clip.positions, decoder.positions())
        assert meter.max_error <= decoder.file.max_error_bound <= bound
    return bound


@pytest.mark.parametrize("seed", [0, 3])
def test_a_rest_pose_that_fine_steps_cannot_reach_is_tried_at_others(seed, scratch, monkeypatch):
    """Its steps were halved for ever: the finer they are, the less far their integers reach."""
    rng = np.random.default_rng(seed)
    positions = 5e7 + 1.9 + 0.05 * rng.normal(size=(1, 3, 3)) + 1e-7 * rng.normal(size=(3, 3, 3))
    clip = clip_of(positions, positions[0], [0, 0, 0], [-1], np.float64)
    bound = 2.05 * float(np.spacing(5e7))
    assert encoded_or_refused(clip, bound, {}, scratch / "far.ath", Work(monkeypatch)) == bound


def clip_at_its_last_bits(seed: int):
    """A few vertices, a bound of 2 to 10 roundings of the largest coordinate, and options of `encode`."""
    rng = np.random.default_rng(seed)
    vertices, frames, dtype = int(rng.integers(1, 13)), int(rng.integers(1, 12)), (np.float32, np.float64)[seed % 2]
    extent = min(1.0, 2.0 ** rng.uniform(4, 29) * np.finfo(dtype).eps)
    moves = rng.uniform() * rng.normal(size=(frames, vertices, 3)) * rng.integers(0, 2)
    positions = rng.uniform(-1, 1, 3) + extent * (rng.normal(size=(1, vertices, 3)) + moves)
    positions = (10 ** rng.uniform(0, 9) / np.abs(positions).max() * positions).astype(dtype)
    branches = int(rng.integers(1, min(vertices, 4) + 1))
    branch = np.sort(np.append(np.arange(branches), rng.integers(0, branches, vertices - branches)))
    parent = [-1, *(int(rng.integers(-1, b)) for b in range(1, branches))]
    options = {"exact_rest": True, "lossless": True, "ladder": "none", "effort": "fast"}
    chosen = {name: value for name, value in options.items() if rng.integers(3) == 0}
    bound = rng.uniform(2, 10) * float(np.spacing(np.abs(positions).max()))
    return clip_of(positions, positions[0], branch, parent, dtype), bound, chosen


@pytest.mark.parametrize("seeds", [range(24), pytest.param(range(24, 1000), marks=pytest.mark.slow)])
def test_every_bound_ends_in_a_file_within_it_or_in_one_that_can_be_kept(seeds, scratch, monkeypatch):
    work = Work(monkeypatch)
    for seed in seeds:
        clip, bound, options = clip_at_its_last_bits(seed)
        encoded_or_refused(clip, bound, options, scratch / "last_bits.ath", work)


def test_a_bound_that_coding_turns_out_not_to_keep_is_refused_with_one_found_by_coding(scratch, monkeypatch):
    clip, bound, _ = clip_at_its_last_bits(0)
    coded, least = decisions.FileDecisions.decide, 3.7 * bound

    def refusing(self, tried):
        if tried < least:
            raise BoundError("max error: cannot be kept")
        return coded(self, tried)

    monkeypatch.setattr(decisions.FileDecisions, "decide", refusing)
    assert least <= encoded_or_refused(clip, bound, {}, scratch / "named.ath", Work(monkeypatch)) <= 1.1 * least


@settings(STEADY, max_examples=40)
@given(
    st.integers(0, 19),
    st.integers(0, 9),
    st.integers(0, 2),
    st.sampled_from([np.nan, np.inf, -np.inf, 1e19, -3e38]),
    st.sampled_from([np.float32, np.float64]),
)
def test_one_number_that_is_not_finite_is_refused_wherever_it_is(scratch, frame, vertex, axis, value, dtype):
    clip = plant(seed=2, branches=5, longest=4, frames=20, dtype=dtype)
    vertex %= clip.vertex_count
    clip.positions[frame, vertex, axis] = value
    with pytest.raises(ClipError, match=f"frame {frame}, vertex {vertex} "):
        athcodec.encode(clip, scratch / "refused.ath", effort="fast")
    assert not (scratch / "refused.ath").exists()


# ---- bounds that are a large part of the plant ----


STEM = np.zeros((12, 20, 3), np.float32)
STEM[..., 1] = np.linspace(0, 3, 20)
STEM[..., 0] = np.linspace(0, 4, 12)[:, None] * STEM[..., 1] / 3  # The diagonal of the bounding box is 5 m.
BRANCH = {"vertex_branch": [0] * 20, "branch_parent": [-1], "effort": "fast", "unit": "m"}


@pytest.mark.parametrize(
    "options, message",
    [
        (
            {"max_error": 1},
            "^max_error: got 1 m, 20 % of the diagonal of all frames, 5 m; .*most 1 %, .*unit, such as 1mm",
        ),
        ({"max_error": "0.051m"}, "^max_error: got 0.051 m, 1 % of the diagonal of all frames, 5 m; "),
        ({"max_error": 50, "lossless": True}, "^max_error: got 50 m, 10 times the diagonal of all frames, 5 m; "),
        ({"target_size": 150}, r"^target_size: got 150 bytes, whose error is [\d.]+ % of the diagonal .*: allow more"),
    ],
    ids=str,
)
def test_a_bound_that_is_a_large_part_of_the_plant_is_said_to_be_that(options, message, tmp_path, capsys):
    with pytest.warns(CoarseWarning, match=message) as caught:
        athcodec.encode(STEM, **BRANCH | options)
    assert [warning.filename for warning in caught] == [__file__]
    if "max_error" in options:
        with h5py.File(tmp_path / "stem.h5", "w") as file:
            file["positions"], file["vertex_branch"], file["branch_parent"] = STEM, np.zeros(20, int), [-1]
            file.attrs["unit"] = "m"
        words = ["--max-error", str(options["max_error"]), *(["--lossless"] if "lossless" in options else [])]
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            paths = [str(tmp_path / name) for name in ("stem.h5", "a.ath")]
            assert cli.main(["encode", *paths, "--effort", "fast", *words]) == 0
        assert re.fullmatch(f"athcodec: warning: {message[1:]}.*\n", capsys.readouterr().err)


@pytest.mark.parametrize(
    "options", [{}, {"max_error": "4.9cm"}, {"rel_error": 0.2}, {"lossless": True}, {"target_size": "1kB"}], ids=str
)
def test_other_bounds_and_fractions_that_were_asked_for_are_taken_without_a_word(options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        athcodec.encode(STEM, **BRANCH | options)
        athcodec.encode(np.ones((3, 20, 3), np.float32), **BRANCH | options)
