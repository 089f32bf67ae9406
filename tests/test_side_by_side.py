"""Plants that move unlike each other cost in one file about what they cost apart."""

from __future__ import annotations

import io

import numpy as np
import pytest

from athcodec.encoding.encoder import encode_clip
from athcodec.encoding.model.kinds import plant_kinds
from athcodec.encoding.search.sample import even_branches
from athcodec.encoding.segments.time_bases import TimeComponents, TrackMoments
from athcodec.motion.branches.divided import joined, plants_apart
from athcodec.motion.branches.finding import candidates
from athcodec.motion.branches.result import Found
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import build_hierarchy
from bench.scenes import singles

pytestmark = pytest.mark.sizes

FRAMES = 60


def swaying(shape: np.ndarray, turns: np.ndarray, seed: int) -> np.ndarray:
    """Return a crown of points that sways in a few ways over time, `turns` (ways, FRAMES), as (FRAMES, N, 3)."""
    random = np.random.default_rng(seed)
    ways = [
        np.sin(shape @ random.normal(0, 40, 3) + random.uniform(0, 6))[:, None] * random.normal(0, 1, 3) for _ in turns
    ]
    return shape + 0.02 * np.einsum("kt,kni->tni", turns, np.array(ways))


def crown(seed: int, count: int = 1200) -> np.ndarray:
    """Return points of a crown that sways as a whole in five slow ways."""
    random, time = np.random.default_rng(seed), np.arange(FRAMES) / FRAMES
    shape = random.normal(0, 0.15, (count, 3)) + [0, 0.5, 0]
    return swaying(shape, np.sin(np.outer(random.uniform(6, 20, 5), time) + random.uniform(0, 6, (5, 1))), seed)


def stems(seed: int, count: int = 30, points: int = 12) -> np.ndarray:
    """Return points of upright stems, each of which bends in a wind of its own, twelve points after each other."""
    random, along = np.random.default_rng(seed), np.linspace(0, 1, points)
    out = np.empty((FRAMES, count, points, 3))
    for stem in range(count):
        gusts = np.cumsum(np.cumsum(random.normal(0, 0.004, (FRAMES, 2)), axis=0), axis=0)
        gusts -= np.linspace(0, 1, FRAMES)[:, None] * gusts[-1]
        bend = gusts[:, None, :] * (along**2)[None, :, None]
        out[:, stem, :, 1] = 0.6 * along
        out[:, stem, :, 0::2] = bend + [0.09 * (stem % 6), 0.09 * (stem // 6)]
    return out.reshape(FRAMES, -1, 3)


def size_of(positions: np.ndarray, bound: float, **options) -> int:
    file = io.BytesIO()
    clip = MotionClip(positions.astype(np.float32), np.arange(len(positions)) / 24)
    encode_clip(clip, file, max_error=bound, attributes="none", jobs=1, **options)
    return len(file.getvalue())


def test_points_of_plants_that_move_unlike_each_other_cost_little_more_than_apart():
    one, other = crown(1, 800), stems(2, 20) + [0.8, 0, 0]
    apart = size_of(one, 1e-4, ladder="none") + size_of(other, 1e-4, ladder="none")
    assert size_of(np.concatenate([one, other], axis=1), 1e-4, ladder="none") < 1.3 * apart


def test_points_of_leaves_that_sway_much_alike_are_told_apart():
    tree = singles.storm(39).without_faces()
    of_leaf = np.bincount(tree.clip.vertex_branch)[tree.clip.vertex_branch] == 6
    branches = next(candidates(tree.bare()))
    alone = np.bincount(branches.vertex_branch)[branches.vertex_branch] == 6
    assert np.count_nonzero(of_leaf & alone) > 0.9 * np.count_nonzero(of_leaf)


def test_what_stands_apart_is_told_apart_and_what_is_small_stands_together():
    random = np.random.default_rng(3)
    shapes = [random.uniform(0, 1, (400, 3)) * [1, 1, 0.1], random.uniform(0, 1, (300, 3)) * [1, 1, 0.1] + [1.5, 0, 0]]
    small = [random.uniform(0, 0.02, (5, 3)) + [0.3 * i, 0, 2] for i in range(14)]
    plant = plants_apart(MotionClip(np.concatenate(shapes + small)[None].astype(np.float32), np.zeros(1)))
    assert np.array_equal(plant, np.repeat([plant[0], plant[400], plant[700]], [400, 300, 70]))
    assert {plant[0], plant[400], plant[700]} == {0, 1, 2}
    assert plants_apart(MotionClip(shapes[0][None].astype(np.float32), np.zeros(1))) is None


def test_branches_of_parts_keep_their_vertices_and_parents():
    clip = MotionClip(np.random.default_rng(4).uniform(0, 1, (1, 6, 3)).astype(np.float32), np.zeros(1))
    first = Found(np.array([0, 1, 1], np.int32), np.array([-1, 0], np.int32), None, "runs")
    second = Found(np.array([0, 0, 1], np.int32), np.array([1, -1], np.int32), None, "components")
    both = joined(clip, np.array([1, 0, 0, 1, 0, 1]), [first, second])
    assert both.vertex_branch.tolist() == [2, 0, 1, 2, 1, 3]
    assert both.branch_parent.tolist() == [-1, 0, 3, -1]


def test_plants_are_of_one_kind_if_they_have_about_one_size():
    parent = np.array([-1, 0, -1, -1, 3, -1])  # Two plants of two branches, and two of one.
    kinds = plant_kinds(parent, np.array([10, 10, 500, 11, 10, 490]))
    assert kinds.tolist() == [1, 1, 0, 1, 1, 0]


def test_a_sample_of_a_field_has_a_plant_that_is_unlike_all_others():
    count = np.append(np.full(200, 40), 300)
    hierarchy = build_hierarchy(np.repeat(np.arange(201), count), np.full(201, -1), np.zeros((count.sum(), 3)))
    kinds = plant_kinds(hierarchy.branch_parent, hierarchy.stem_count)
    sampled = even_branches(hierarchy, 2000, 0)
    assert set(kinds[sampled]) == set(kinds) == {0, 1}
    assert 1800 < hierarchy.stem_count[sampled].sum() < 2400


def test_tracks_that_move_alike_need_no_components_of_plants_that_move_otherwise():
    random = np.random.default_rng(5)
    few, many = random.normal(0, 1, (3, FRAMES)), random.normal(0, 1, (24, FRAMES))
    alike, other = random.normal(0, 3, (2000, 3)) @ few, random.normal(0, 6, (400, 24)) @ many
    kinds = [TrackMoments(tracks.T @ tracks, len(tracks)) for tracks in (alike, other)]
    together = TrackMoments(kinds[0].moments + kinds[1].moments, 2400)
    used = {}
    for name, moments in (("apart", kinds), ("together", [together])):
        rows = TimeComponents(moments, np.eye(FRAMES), may_be_in_waves=False).basis().rows
        assert np.linalg.norm(other - other @ rows.T @ rows) < 1e-2 * np.linalg.norm(other), "all are described"
        used[name] = np.count_nonzero(np.abs(alike @ rows.T).max(axis=0) > 1.0)
    assert used["apart"] == 3 < used["together"]
