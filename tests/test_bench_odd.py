"""The odd clips of the benchmark: each is what its name says, and the same whenever and wherever it is made."""

from __future__ import annotations

import hashlib
import os
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from programs import printed

import athcodec
from athcodec.motion.hierarchy import hierarchy_of
from bench import data, odd, rd
from bench.codecs import Source, check, simple
from bench.codecs.program import CannotKeep
from bench.odd import growing
from bench.odd.bending import Bones, moved_tree, scanned_tree, swaying_tree
from bench.odd.grass import grass
from bench.odd.others import captured_stem, still_mesh, tumbling_cube
from bench.store import read
from bench.trees.plant import grow

ROOT = Path(__file__).resolve().parent.parent

pytestmark = pytest.mark.tools

SHAPES = {"growth": (120, 1001), "growth_in_wind": (120, 1001), "unfolding": (120, 1141), "grass": (160, 5600)}
SHAPES |= {"grass_shuffled": (160, 5600), "capture": (2000, 31), "capture_long": (6000, 31), "calm": (100, 4000)}
SHAPES |= {"few_7": (7, 11666), "few_9": (9, 7207), "one_frame": (1, 8322), "morph": (225, 1528)}
SHAPES |= {"vertex": (100, 1), "cube": (127, 24)}


def digest(clip):
    total = hashlib.sha256()
    for array in (clip.positions, clip.rest, clip.vertex_branch, clip.branch_parent, clip.stem_index, clip.faces):
        total.update(b"none" if array is None else np.ascontiguousarray(array).tobytes())
    return total.hexdigest()


@pytest.fixture(scope="module")
def clips():
    """All of them, by name."""
    return {name: recipe.make() for name, recipe in odd.CLIPS.items()}


def test_another_process_makes_the_same_clips_from_the_same_seeds(clips):
    script = "from test_bench_odd import digest, odd\nfor recipe in odd.CLIPS.values(): print(digest(recipe.make()))"
    found = printed(sys.executable, "-c", script, cwd=ROOT / "tests")
    assert found.split() == [digest(clip) for clip in clips.values()]


def test_clips_have_the_frames_and_vertices_that_they_are_known_for(clips):
    assert {name: (clips[name].frame_count, clips[name].vertex_count) for name in SHAPES} == SHAPES
    assert {name for name, clip in clips.items() if not clip.has_branches} == {
        *("grass_unnamed", "grass_interleaved", "grass_shuffled"),
        *("still", "one_frame", "morph", "morph_narrow", "sheet", "points", "noise", "vertex", "cube"),
    }
    assert set(data.SUITES["odd"]) == set(odd.CLIPS) < set(data.RECIPES)


# ---- growth ----


def test_the_growth_that_ships_with_athcodec_is_that_of_the_benchmark(clips):
    with athcodec.read_hdf5(athcodec.sample_path("growth")) as shipped:
        made = clips["growth_carried"]
        assert np.allclose(shipped.block(0, 120), made.positions, atol=1e-5)  # processors round differently
        assert np.array_equal(shipped.vertex_branch, made.vertex_branch)
        assert np.array_equal(shipped.branch_parent, made.branch_parent)


@pytest.mark.parametrize("eased", (False, True))
def test_in_growth_no_vertex_moves_before_its_branch_begins_or_after_it_has_stopped(eased):
    clip = growing.growth(5, 90, 400, eased)
    bones = Bones.of(grow(400, 2, 8.0, 5))
    begin, end = growing.begin_and_end(bones, 90, np.random.default_rng(5)).T
    frame = np.arange(90)[:, None]
    before, after = frame <= begin[bones.branch], frame >= end[bones.branch]
    attached = bones.rest[growing.attach_node(bones)[bones.branch]].astype(np.float32)
    rest = bones.rest.astype(np.float32)
    assert np.allclose(np.where(before[..., None], clip.positions - attached, 0), 0, atol=1e-6)
    assert np.allclose(np.where(after[..., None], clip.positions - rest, 0), 0, atol=1e-6)
    assert before[:, -1].any() and after[-1].all() and not (before | after).all()


@pytest.mark.parametrize("maker", (growing.growth_in_wind, partial(growing.growth, carried=True)))
def test_a_branch_that_waits_is_carried_by_its_parent(maker):
    clip = maker(5, 90, 400)
    bones = Bones.of(grow(400, 2, 8.0, 5))
    begin = growing.begin_and_end(bones, 90, np.random.default_rng(5))[:, 0]
    attach = growing.attach_node(bones)[bones.branch]
    waits = np.arange(90)[:, None] <= begin[bones.branch]
    assert np.allclose((clip.positions - clip.positions[:, attach])[waits], 0, atol=1e-6)
    assert np.linalg.norm(clip.positions[0], axis=1).max() == 0, "at first all of it is at the root"
    what_has_grown_sways = np.ptp(clip.positions[60:, 10], axis=0).max() > 0.01
    assert what_has_grown_sways == (maker is growing.growth_in_wind)


def test_leaves_open_one_after_the_other_and_keep_their_foot():
    clip = growing.unfolding_leaves(3, 60, 8)
    leaves = clip.positions[:, 9:].reshape(60, 8, growing.ROWS, growing.WIDE, 3).astype(np.float64)
    length = np.linalg.norm(leaves[:, :, -1, 1] - clip.positions[:, 1:9], axis=-1)
    half = [np.flatnonzero(one > (one[0] + one[-1]) / 2)[0] for one in length.T]
    assert half == sorted(set(half))
    assert (length[-1] > 2 * length[0]).all()
    assert (clip.positions[:, :9] == clip.positions[0, :9]).all()
    assert np.array_equal(np.unique(clip.faces), np.arange(9, clip.vertex_count))


# ---- plants in wind ----


def test_elements_keep_their_lengths_where_plants_sway(clips):
    for name in ("calm", "scanned", "few_7", "held"):
        clip = clips[name]
        ends = clip.positions[:, clip.edges].astype(np.float64)
        lengths = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=-1)
        assert np.ptp(lengths, axis=0).max() < 1e-5, name


def test_the_calm_tree_moves_little_and_the_scanned_one_is_far_from_its_rest_pose(clips):
    def away(clip):
        height = np.ptp(clip.rest[:, 1])
        return np.linalg.norm(clip.positions - clip.rest, axis=-1).mean() / height

    assert away(clips["calm"]) < 0.01 < away(clips["few_7"]) < 0.1 < away(clips["scanned"])
    counts = np.bincount(scanned_tree(4, 2, 50, 5, 0.6).vertex_branch)
    assert set(counts[1:]) == {1, 2, 3, 4, 5}


def test_a_moved_tree_only_jumps_between_its_places():
    still, moved = swaying_tree(6, 60, 100), moved_tree(6, 60, 100, every=20)
    offset = moved.positions - still.positions
    assert np.allclose(offset, offset[:, :1], atol=1e-5)
    jumps = np.flatnonzero(np.linalg.norm(np.diff(offset[:, 0], axis=0), axis=1) > 1e-3) + 1
    assert jumps.tolist() == [20, 40]


def test_held_and_still_clips_repeat_their_frames(clips):
    held = clips["held"].positions
    assert (held[0::3] == held[1::3]).all() and (held[0::3] == held[2::3]).all() and (held[0] != held[3]).any()
    still, one = clips["still"], clips["one_frame"]
    assert (still.positions == one.positions).all() and (one.faces == still.faces).all()
    assert np.array_equal(np.unique(still_mesh(2, 1, 200, 20).faces), np.arange(still_mesh(2, 1, 200, 20).vertex_count))


def test_the_far_tree_has_few_bits_left_for_its_motion(clips):
    clip = clips["far"]
    assert clip.positions[..., 0].min() > 9e4 and np.ptp(clip.positions[..., 0]) < 2000
    along = np.unique(clip.positions[..., 0].astype(np.float64))
    assert np.diff(along).min() == 2.0**-7, "one part in 200,000 of the plant"


# ---- grass ----


def test_the_points_of_grass_are_the_same_named_and_unnamed_in_every_order():
    blades = grass(seed=2, blades=30, points=5, frames=8)
    unnamed = grass(seed=2, blades=30, points=5, frames=8, named=False)
    assert unnamed.vertex_branch is None and np.array_equal(blades.positions, unnamed.positions)
    mixed = grass(seed=2, blades=30, points=5, frames=8, order="interleaved")
    assert mixed.vertex_branch.tolist() == list(range(30)) * 5
    for order in ("interleaved", "shuffled"):
        clip = grass(seed=2, blades=30, points=5, frames=8, order=order)
        assert np.array_equal(clip.positions[:, hierarchy_of(clip).vertex_source], blades.positions)


def test_blades_stand_on_their_feet_keep_their_lengths_and_bend_one_after_the_other_along_the_wind():
    clip = grass(seed=3, blades=300, points=4, frames=100)
    points = clip.positions.reshape(100, 300, 4, 3).astype(np.float64)
    assert (points[:, :, 0] == points[0, :, 0]).all()
    lengths = np.linalg.norm(np.diff(points, axis=2), axis=-1)
    assert np.ptp(lengths, axis=0).max() < 1e-5
    tips = points[:, :, -1, 0] - points[:, :, -1, 0].mean(axis=0)
    foot = points[0, :, 0]
    first = np.argsort(foot[:, 0])
    tips /= tips.std(axis=0)
    near = (tips[:, first[:30]] * tips[:, first[1:31]]).mean()
    assert near > 0.6, "neighbours bend alike"


# ---- others ----


def test_the_noise_of_a_capture_is_as_large_as_asked_for():
    clip = captured_stem(5, 500, 31, 1e-3)
    same = captured_stem(5, 500, 31, 0.0)
    diagonal = np.linalg.norm(np.ptp(same.positions.reshape(-1, 3), axis=0))
    assert (clip.positions - same.positions).std() / diagonal == pytest.approx(1e-3, rel=0.02)
    assert np.abs(np.diff(same.positions, n=2, axis=0)).max() < 2e-3 * diagonal, "smooth without it"


@pytest.mark.parametrize("name", ("morph", "morph_narrow"))
def test_few_of_the_shapes_are_mixed_at_a_time_in_straight_lines(clips, name):
    clip = clips[name]
    bent = np.linalg.norm(np.diff(clip.positions.astype(np.float64), n=2, axis=0), axis=-1).max(axis=1)
    assert set(np.flatnonzero(bent > 1e-5) + 1) <= set(range(15, 225, 15))
    motion = (clip.positions - clip.positions[0]).reshape(225, -1).astype(np.float64)
    singular = np.linalg.svd(motion, compute_uv=False)
    assert singular[20] < 1e-5 * singular[0]
    key = np.linalg.svd(motion[[15, 30]], compute_uv=False)
    assert key[1] > 0.1 * key[0]


def test_the_cube_stays_a_cube():
    corners = tumbling_cube(7, 50).positions.astype(np.float64)
    middle = corners.mean(axis=1, keepdims=True)
    assert np.allclose(np.linalg.norm(corners - middle, axis=-1), np.sqrt(0.75), atol=1e-5)
    assert np.abs(middle[25] - middle[0]).max() > 0.5


# ---- the simple codec ----


@pytest.mark.parametrize("name", ("vertex", "cube", "noise", "held", "one_frame", "far"))
@pytest.mark.parametrize("bound", (1e-2, 1e-5))
def test_the_simple_codec_keeps_its_bound_and_another_decodes_its_bytes(clips, name, bound):
    source = Source(clips[name])
    data, decoded = check(simple.Simple(), source, bound * source.diagonal)
    assert np.array_equal(simple.Simple().decode(data), decoded)
    assert len(data) < source.positions.nbytes


def test_the_simple_codec_takes_the_best_differences_for_straight_and_for_constant_motion():
    rng = np.random.default_rng(4)
    start, speed = rng.normal(size=(2, 1, 200, 3))
    straight = athcodec.MotionClip((start + np.arange(100)[:, None, None] * speed).astype(np.float32), np.arange(100))
    codec, source = simple.Simple(), Source(straight)
    size = len(codec.encode(source, 1e-3 * source.diagonal))
    assert codec.settings["in_time"] in (1, 2) and size < 0.1 * source.positions.nbytes
    still = Source(straight.replace(positions=np.repeat(straight.positions[:1], 100, axis=0)))
    alone = Source(straight.replace(positions=straight.positions[:1], time=[0.0]))
    sizes = [len(codec.encode(one, 1e-3 * source.diagonal)) for one in (still, alone)]
    assert sizes[0] < sizes[1] + 40


def test_the_simple_codec_says_where_integers_are_too_small_for_the_bound(clips):
    with pytest.raises(CannotKeep, match="31 bits"):
        simple.Simple().encode(Source(clips["cube"]), 1e-12)


def test_the_suite_prints_one_table_of_its_clips_with_sizes_that_were_checked(tmp_path):
    file = tmp_path / "result.json"
    words = ["rd", "vertex", "--suite", "odd-quick", "--bounds", "1e-3", "--json", file]
    environment = os.environ | {data.FOLDER_VARIABLE: str(tmp_path)}
    text = printed(sys.executable, "-m", "bench", *words, cwd=ROOT, env=environment)
    sizes = {point["codec"]: point["bytes"] for point in read(file)["points"]}
    assert set(sizes) == set(rd.CODECS["odd-quick"])
    ratio = sizes[simple.NAME] / sizes["athcodec"]
    assert f"{sizes[simple.NAME]:,} simple x{ratio:.2f}" in text
    assert (tmp_path / "vertex.h5").exists() and rd.title("vertex") not in text
