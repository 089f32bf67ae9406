"""Predicted motion: clips that cosines and modes do not suit are small, and all else holds as for other files."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard
from files import opened
from hypothesis import given, settings
from hypothesis import strategies as st
from plants import STEADY, awkward, awkward_plants, bound_for, clip_of, grow, plant, random_hierarchy, sway

import athcodec
from athcodec import encoding
from athcodec.encoding.search import search
from athcodec.metrics import SmoothnessMeter
from bench.odd.growing import unfolding_leaves
from spec.document import File

pytestmark = pytest.mark.sizes

FRAMES = 60


@pytest.fixture
def always(monkeypatch):
    """Every clip is coded with predicted motion."""
    monkeypatch.setattr(search.Search, "first_cost", lambda _: math.inf)


def simple_bytes(positions: np.ndarray, bound: float) -> int:
    """What anyone would write: integers on a grid, differences in time and along vertices, zstd."""
    step = 0.999 * 2 * bound / math.sqrt(3)
    grid = np.rint((positions - positions.reshape(-1, 3).mean(axis=0)) / step).astype(np.int64)
    sizes = []
    for in_time in range(3):
        for along in range(2):
            left = np.diff(grid, in_time, axis=0, prepend=grid[:1] * np.zeros((in_time, 1, 1), int))
            left = np.diff(left, along, axis=1, prepend=left[:, :1] * np.zeros((1, along, 1), int))
            kind = next(
                kind for kind in (np.int8, np.int16, np.int32, np.int64) if abs(left).max() <= np.iinfo(kind).max
            )
            for axes in ((2, 0, 1), (2, 1, 0)):
                numbers = np.ascontiguousarray(left.transpose(axes), kind)
                planes = numbers.reshape(-1, 1).view(np.uint8).T
                sizes.append(len(zstandard.compress(planes.tobytes(), 19)))
    return min(sizes)


def tree(seed: int = 1, branches: int = 25, longest: int = 12):
    rng = np.random.default_rng(seed)
    vertex_branch, branch_parent = random_hierarchy(rng, branches, longest)
    return rng, grow(rng, vertex_branch, branch_parent), vertex_branch, branch_parent


def growth(eased: bool = False) -> athcodec.MotionClip:
    """Branches come out of their parents one after the other, and stop."""
    rng, rest, vertex_branch, branch_parent = tree()
    begin, positions = np.zeros(len(branch_parent)), np.zeros((FRAMES, *rest.shape))
    for branch, parent in enumerate(branch_parent):
        mine = np.flatnonzero(vertex_branch == branch)
        begin[branch] = 2.0 if parent < 0 else begin[parent] + rng.uniform(4, 9)
        length = np.clip((np.arange(FRAMES) - begin[branch]) / 8, 0, 1)[:, None, None]
        length = length * length * (3 - 2 * length) if eased else length
        attach = mine[0]
        if parent >= 0:
            above = np.flatnonzero(vertex_branch == parent)
            attach = above[np.linalg.norm(rest[above] - rest[mine[0]], axis=1).argmin()]
        base = positions[:, [attach]] if parent >= 0 else np.broadcast_to(rest[attach], (FRAMES, 1, 3))
        positions[:, mine] = base + length * (rest[mine] - rest[attach])
    return clip_of(positions, rest, vertex_branch, branch_parent)


def moved(change: Callable[[np.ndarray], np.ndarray]) -> athcodec.MotionClip:
    rng, rest, *branches = tree()
    return clip_of(change(sway(rng, rest, FRAMES, rough=0.0)), rest, *branches)


def jumping(positions: np.ndarray) -> np.ndarray:
    return positions + np.repeat(np.random.default_rng(2).normal(size=(FRAMES // 20, 1, 3)) * 50, 20, axis=0)


def alone(positions: np.ndarray) -> athcodec.MotionClip:
    return athcodec.MotionClip(positions.astype(np.float32), np.arange(len(positions)) / 24)


def circle() -> np.ndarray:
    t = np.linspace(0, 6, 100)
    return np.stack([np.sin(t), np.cos(1.3 * t), t], axis=1)[:, None]


SLOW = pytest.mark.slow
ODD = {
    "growth": growth,
    "eased growth": lambda: growth(eased=True),
    "leaves that unfold": lambda: unfolding_leaves(seed=1, frames=40, leaves=12),
    "noise": lambda: alone(np.random.default_rng(3).normal(size=(40, 90, 3))),
    "one vertex": lambda: alone(circle()),
    "one vertex in one frame": lambda: alone(circle()[:1]),
    "jumps": lambda: moved(jumping),
    "held poses": lambda: moved(lambda positions: np.repeat(positions[::3], 3, axis=0)),
    "a motion that comes again": lambda: moved(lambda positions: np.tile(positions[:20], (3, 1, 1))),
    "few frames": lambda: moved(lambda positions: positions[::12]),
}


def size(clip: athcodec.MotionClip, folder: Path, fraction: float, **options) -> athcodec.Summary:
    given = {"rel_error": fraction} | options
    return athcodec.encode(clip, folder / "a.ath", attributes="none", **{"ladder": "none"} | given)


@pytest.mark.parametrize("fraction", [1e-3, *(pytest.param(other, marks=SLOW) for other in (1e-2, 1e-5, 1e-6))])
@pytest.mark.parametrize(
    "make", [pytest.param(make, id=name, marks=SLOW if name == "noise" else ()) for name, make in ODD.items()]
)
def test_no_odd_clip_takes_more_than_a_simple_codec(make, fraction, tmp_path):
    clip = make()
    positions = clip.block(0, clip.frame_count).astype(float)
    low, high = positions.reshape(-1, 3).min(axis=0), positions.reshape(-1, 3).max(axis=0)
    bound = fraction * (float(np.linalg.norm(high - low)) or 1.0)
    found = size(clip, tmp_path, fraction, rel_error=None, max_error=bound)
    assert found.bytes <= 1.02 * simple_bytes(positions, bound) + 160


@pytest.mark.parametrize("fraction", [1e-3, 1e-5])
@pytest.mark.parametrize("eased", [False, True])
def test_growth_takes_at_most_seven_tenths_of_a_simple_codec(fraction, eased, tmp_path):
    clip = growth(eased)
    positions = clip.block(0, clip.frame_count).astype(float)
    bound = fraction * float(np.linalg.norm(np.ptp(positions.reshape(-1, 3), axis=0)))
    found = size(clip, tmp_path, fraction)
    assert found.choices["motion"] == "predicted"
    assert found.bytes <= 0.7 * simple_bytes(positions, bound)


def growing_front() -> athcodec.MotionClip:
    """A front runs from the root along all branches; what it has not reached stands at its tip."""
    _, rest, vertex_branch, branch_parent = tree()
    first = np.unique(vertex_branch, return_index=True)[1]
    below = np.arange(len(rest)) - 1
    for branch, parent in enumerate(branch_parent):
        on_parent = np.flatnonzero(vertex_branch == parent)
        far = np.linalg.norm(rest[on_parent] - rest[first[branch]], axis=1)
        below[first[branch]] = on_parent[far.argmin()] if parent >= 0 else -1
    way = np.where(below >= 0, np.linalg.norm(rest - rest[below], axis=1), 0.0)
    reached, positions = way.copy(), np.repeat(rest[None], FRAMES, axis=0)
    for v in np.flatnonzero(below >= 0):
        reached[v] += reached[below[v]]
    front = reached.max() * np.linspace(0, 1, FRAMES) ** 1.3
    for v in np.flatnonzero(below >= 0):
        share = np.clip((front - reached[below[v]]) / max(way[v], 1e-9), 0, 1)[:, None]
        positions[:, v] = positions[:, below[v]] + share * (rest[v] - rest[below[v]])
    return clip_of(positions, rest, vertex_branch, branch_parent)


@pytest.mark.parametrize("fraction", [1e-3, 1e-4, 1e-5])
def test_a_growing_front_takes_at_most_six_tenths_of_a_simple_codec(fraction, tmp_path):
    clip = growing_front()
    positions = clip.block(0, clip.frame_count).astype(float)
    bound = fraction * float(np.linalg.norm(np.ptp(positions.reshape(-1, 3), axis=0)))
    found = size(clip, tmp_path, fraction, rest_error="bound")
    assert found.choices["motion"] == "predicted"
    assert found.bytes <= 0.6 * simple_bytes(positions, bound)


def test_stiff_branches_that_no_face_shows_do_not_rule_out_prediction(tmp_path):
    """Rods that fall into their places one after the other; as motion that is transformed they take twice as much."""
    rng = np.random.default_rng(3)
    begin = rng.uniform(-1, 1, (80, 1, 3)) + 0.05 * rng.normal(size=(80, 6, 3))
    falls = np.arange(FRAMES)[:, None] >= rng.integers(2, FRAMES - 2, 80)
    positions = begin - falls[:, :, None, None] * [0.0, 0.0, 3.0]
    clip = clip_of(positions.reshape(FRAMES, -1, 3), begin.reshape(-1, 3), np.repeat(np.arange(80), 6), np.full(80, -1))
    found = size(clip, tmp_path, 1e-4, ladder="none")
    assert found.choices["motion"] == "predicted"


def test_smoothness_has_a_price_limit(tmp_path):
    clip, found, shares = growth(), {}, {}
    for smoothness in ("bytes", "default", "motion"):
        found[smoothness] = size(clip, tmp_path, 1e-4, smoothness=smoothness).bytes
        with athcodec.open(tmp_path / "a.ath") as decoder:
            shares[smoothness] = decoder.file.info()["predicted_error_share"]
    assert found["bytes"] <= found["default"] <= 1.15 * found["bytes"] + 50
    assert found["default"] <= found["motion"] <= 2 * found["bytes"] + 50
    assert shares["bytes"] > 0.9 and shares["motion"] <= min(shares["default"], 0.26)
    with pytest.raises(ValueError, match="smoothness: got 'calm'"):
        size(clip, tmp_path, 1e-4, smoothness="calm")


@pytest.mark.parametrize(("fraction", "most", "share"), [(1e-3, 1.5, 0.02), (1e-4, 1.0, 0.0), (1e-5, 1.0, 0.0)])
@pytest.mark.parametrize("eased", [False, True])
def test_growth_does_not_twitch_where_bytes_are_spent_on_it(fraction, most, share, eased, tmp_path):
    clip = growth(eased)
    found = size(clip, tmp_path, fraction, smoothness="motion")
    meter = SmoothnessMeter(clip.frame_count, found.max_error_bound)
    with athcodec.open(tmp_path / "a.ath") as decoder:
        meter.add(clip.block(0, clip.frame_count), decoder.positions())
    assert meter.max_error_acceleration <= most and meter.worst_share <= share


def test_frames_that_are_there_already_cost_nothing(always, tmp_path):
    once = size(moved(lambda positions: positions[:20]), tmp_path, 1e-4)
    often = size(ODD["a motion that comes again"](), tmp_path, 1e-4)
    held = size(moved(lambda positions: np.repeat(positions[:20], 3, axis=0)), tmp_path, 1e-4)
    assert max(often.bytes, held.bytes) <= once.bytes + 40


def test_swaying_trees_keep_their_modes(tmp_path):
    clip = moved(lambda positions: positions)
    assert size(clip, tmp_path, 1e-3).choices["motion"] == "transformed"


def test_who_asks_for_a_hierarchy_of_maps_gets_it(tmp_path):
    found = size(growth(), tmp_path, 1e-4, effort="fast", tam=athcodec.Thresholds(0, 0, 0, 0))
    assert found.choices["motion"] == "transformed" and found.table1["depth"] > 3


def test_layers_are_given_up_only_for_a_much_smaller_file(tmp_path):
    found = size(growth(), tmp_path, 1e-4, ladder="decades")
    assert found.choices["motion"] == "predicted" and len(found.levels) == 2


# ---- what holds for every file ----


@settings(STEADY, max_examples=20)
@given(awkward_plants(), st.sampled_from([1e-1, 1e-2, 1e-4, 1e-6]), st.sampled_from([None, 16]))
def test_any_clip_keeps_the_bound_and_decodes_as_the_document_says(scratch, clip, fraction, segment_frames):
    bound, path = bound_for(clip, fraction), scratch / "any.ath"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search.Search, "first_cost", lambda _: math.inf)
        found = athcodec.encode(clip, path, max_error=bound, ladder="none", segment_frames=segment_frames)
    positions = clip.block(0, clip.frame_count).astype(float)
    with athcodec.open(path, strict=True) as decoder:
        for level in range(decoder.file.level_count):
            shown = decoder.positions(level=level)
            error = np.linalg.norm(shown.astype(float) - positions, axis=2).max()
            assert error <= decoder.levels[level].max_error * (1 + 1e-9)
        assert error <= bound
        if found.choices["motion"] == "predicted" and positions.size < 30_000:
            assert np.array_equal(File(path.read_bytes()).positions(), shown)


def test_every_vertex_keeps_its_own_bound(always, tmp_path):
    clip, weights = growth(), np.linspace(0.2, 3.0, growth().vertex_count)
    found = size(clip, tmp_path, 1e-3, rel_error=None, max_error=0.01, weights=weights)
    assert found.choices["motion"] == "predicted"
    with athcodec.open(tmp_path / "a.ath") as decoder:
        errors = np.linalg.norm(decoder.positions().astype(float) - clip.positions, axis=2).max(axis=0)
        assert (errors <= 0.01 * weights).all() and errors.max() > 0.01 * weights.min()


def test_several_clips_and_loops_play(always, tmp_path):
    clips = {"up": growth(), "down": growth(eased=True)}
    joined = athcodec.join({name: athcodec.looped(clip) for name, clip in clips.items()})
    assert size(joined, tmp_path, 1e-3).choices["motion"] == "predicted"
    with athcodec.open(tmp_path / "a.ath") as decoder:
        for name, clip in clips.items():
            shown = decoder.play(name).positions().astype(float)
            assert np.linalg.norm(shown - clip.positions, axis=2).max() <= decoder.file.max_error_bound


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_sources_own_numbers_come_back(always, dtype, tmp_path):
    clip = plant(seed=3, branches=9, frames=40, dtype=dtype, offset=5.0)
    assert size(clip, tmp_path, 1e-3, lossless=True).choices["motion"] == "predicted"
    decoder = opened((tmp_path / "a.ath").read_bytes(), strict=True)
    assert decoder.file.level_count == 3 and decoder.positions().tobytes() == clip.positions.tobytes()
    before = decoder.positions(level=1).astype(float)
    assert np.linalg.norm(before - clip.positions, axis=2).max() <= decoder.levels[1].max_error


def test_a_draft_that_was_sent_elsewhere_makes_the_same_file(always, tmp_path):
    clip = plant(seed=5, frames=50)
    options = {"rel_error": 1e-3, "segment_frames": 16}
    athcodec.encode(clip, tmp_path / "a.ath", **options)
    draft = pickle.loads(pickle.dumps(encoding.draft(clip, **options)))
    assert draft.segment_count == 4
    coded = [*encoding.code_segments(clip, draft, [2, 3]), *encoding.code_segments(clip, draft, [0, 1])]
    encoding.write(clip, draft, coded, tmp_path / "b.ath")
    assert (tmp_path / "a.ath").read_bytes() == (tmp_path / "b.ath").read_bytes()


def test_segments_are_as_long_as_can_be_unless_told_otherwise(always, tmp_path):
    clip = plant(seed=6, frames=256)
    size(clip, tmp_path, 1e-2)
    with athcodec.open(tmp_path / "a.ath") as decoder:
        assert decoder.file.tables.header.segment_count == 1
    size(clip, tmp_path, 1e-2, segment_frames=100)
    with athcodec.open(tmp_path / "a.ath") as decoder:
        assert decoder.file.tables.header.segment_count == 3


@pytest.mark.parametrize("target", [700, 1500])
def test_a_target_size_is_met(target, always, tmp_path):
    found = size(growth(), tmp_path, 0, rel_error=None, target_size=target, effort="fast")
    assert found.choices["motion"] == "predicted" and 0.9 * target <= found.bytes <= target


# ---- files cut short, changed, damaged ----


def test_a_copy_of_the_rest_pose_keeps_the_bound_as_it_is_put_out(tmp_path):
    """The rest pose is of the decoder's own numbers, and a frame that repeats it is rounded to the output's."""
    clip = awkward(seed=408505, branches=7, longest=7, frames=3, shape="straight", motion="noise", scale=1e-6)
    just_below = 2.0**-16 * (1 - 2.0**-22)  # numbers are coarser beyond
    positions = (clip.positions / np.abs(clip.positions).max() * just_below).astype(np.float32)
    clip = athcodec.MotionClip(positions, clip.time, clip.vertex_branch, clip.branch_parent)
    bound = 5.2436314 * float(np.spacing(np.abs(clip.positions).max()))
    made = athcodec.encode(clip, tmp_path / "a.ath", max_error=bound, effort="fast")
    with athcodec.open(made.path) as decoder:
        assert decoder.file.tables.header.is_predicted
        assert np.linalg.norm(decoder.positions().astype(float) - clip.positions, axis=2).max() <= bound
