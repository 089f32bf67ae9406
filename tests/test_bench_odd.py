"""The odd clips of the benchmark, the same whenever and wherever they are made, and the simple codec."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from programs import printed

import athcodec
from athcodec.motion.hierarchy import hierarchy_of
from bench import data, odd, rd
from bench.codecs import Source, check, simple
from bench.codecs.program import CannotKeep
from bench.odd.grass import grass
from bench.store import read

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


def test_the_growth_that_ships_with_athcodec_is_that_of_the_benchmark(clips):
    with athcodec.read_hdf5(athcodec.sample_path("growth")) as shipped:
        made = clips["growth_carried"]
        assert np.allclose(shipped.block(0, 120), made.positions, atol=1e-5)  # processors round differently
        assert np.array_equal(shipped.vertex_branch, made.vertex_branch)
        assert np.array_equal(shipped.branch_parent, made.branch_parent)


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
