"""The clips of the benchmark: connected plants that move as described, and the same in every run."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from programs import printed

import athcodec
from bench import data
from bench.store import read
from bench.trees import beams, exact
from bench.trees.leaves import SPECIES, Leaves, Plates
from bench.trees.mesh import SIDES, dress
from bench.trees.plant import grow
from bench.trees.ride import Skeleton
from bench.trees.wind import DIRECTION, Wind

ROOT = Path(__file__).resolve().parent.parent

pytestmark = pytest.mark.tools

BREEZE = Wind(8.0, 8.0, seed=2)
CANOPY = data.Canopy(nodes=120, orders=1, frames=40, height=5.0, wind_speed=8.0, leaves=80, species="poplar", seed=3)

SMALL_EXACT = {
    "tree": exact.Tree(((1, 12), (4, 24), (12, 60)), 5, 4.0, 11.0, 0.2, 15.0, 1.0, 0.1, seed=2, digest="6059e8adabcb"),
    "cards": exact.Cards(20, 4, 4, (8.0, 2.0, 2.0), seed=3, digest="4433ed57c12f"),
}


@pytest.fixture
def recipes(monkeypatch):
    """The catalogue, to be changed at will."""
    monkeypatch.setattr(data, "RECIPES", dict(data.RECIPES))
    return data.RECIPES


@dataclass(frozen=True)
class Still:
    """A recipe that needs no engine: two vertices."""

    frames: int

    def make(self):
        positions = np.zeros((self.frames, 2, 3), np.float32) + [[0, 0, 0], [0, 1, 0]]
        return athcodec.MotionClip(positions, np.arange(self.frames), np.zeros(2, int), np.array([-1]))


def lengths(positions, edges):
    ends = positions.astype(np.float64)[..., edges, :]
    return np.linalg.norm(ends[..., 0, :] - ends[..., 1, :], axis=-1)


@pytest.mark.parametrize(("nodes", "orders"), [(100, 2), (1000, 2), (1000, 6), (15, 6), (3, 0)])
def test_a_plant_has_the_nodes_and_orders_asked_for_and_thins_towards_its_tips(nodes, orders):
    plant = grow(nodes, orders, 5.0, seed=3)
    athcodec.MotionClip(plant.position[None], [0.0], plant.branch, plant.branch_parent, edges=plant.edges)
    assert len(plant.parent) == nodes and plant.height == pytest.approx(5.0)
    assert data.branch_orders(plant.branch_parent).max() == orders
    assert (plant.parent[1:] < np.arange(1, nodes)).all() and plant.foliage.sum() == pytest.approx(1.0)
    assert (plant.radius > 0).all()
    assert (plant.radius[1:] <= plant.radius[plant.parent[1:]] * (1 + 1e-9)).all()


@pytest.fixture(scope="module")
def canopy():
    return CANOPY.make()


def still(frames: int) -> Skeleton:
    """A plant that does not move."""
    plant = grow(60, 1, 4.0, seed=5)
    positions = np.repeat(plant.position[None], frames, axis=0)
    parts = plant.position, plant.parent, plant.branch, plant.branch_parent, plant.radius
    return Skeleton(positions, *parts, np.arange(frames) / 30)


def test_a_pole_of_beams_bends_and_swings_as_theory_says():
    grown = grow(31, 0, 3.0, seed=1)
    upright = np.linspace(0, 3, 31)[:, None] * [0, 1, 0]
    pole = replace(grown, position=upright, radius=np.full(31, 0.02), foliage=np.zeros(31))
    stiffness, mass = beams._stiffness(pole), beams.node_mass(pole)
    force = np.zeros(6 * 31)
    force[6 * 30] = 2.0
    bent = np.linalg.solve(stiffness.toarray(), force)
    moment = beams.YOUNG * np.pi / 4 * 0.02**4
    assert bent[6 * 30] == pytest.approx(2.0 * 3.0**3 / (3 * moment), rel=1e-4)
    expected = 1.8751**2 / 3.0**2 * np.sqrt(moment / (beams.DENSITY * np.pi * 0.02**2))
    assert beams._lowest_frequency(stiffness, mass) == pytest.approx(expected, rel=0.01)
    assert np.allclose(lengths(beams._placed(pole, bent.reshape(-1, 6)[:, :3]), pole.edges), 0.1)


def test_a_tree_of_beams_leans_down_wind_sways_and_keeps_its_lengths():
    plant = grow(100, 2, 4.0, seed=1)
    positions = beams.bend(plant, BREEZE, 60)
    assert np.allclose(lengths(positions, plant.edges), lengths(plant.position, plant.edges), rtol=1e-4)
    assert ((positions - plant.position).mean(axis=(0, 1)) @ DIRECTION) > 0.01
    tips = positions[:, np.bincount(plant.parent[1:], minlength=100) == 0]
    assert 0.005 < np.sqrt(((tips - tips.mean(axis=0)) ** 2).sum(axis=2).mean()) / plant.height < 0.1
    assert (positions[:, 0] == 0).all()


@pytest.mark.parametrize("species", SPECIES)
def test_a_mesh_has_closed_rings_around_its_stems_and_rigid_leaves_on_them(sample_clip, species):
    mesh = dress(sample_clip, BREEZE, frames=12, leaves=50, seed=7, species=species)
    blade, quads = len(SPECIES[species].blade), len(SPECIES[species].faces)
    rings = 1001 + 98
    tubes = SIDES * rings
    assert mesh.vertex_count == tubes + 50 * blade and mesh.branch_count == 99 + 50
    assert len(mesh.faces) == SIDES * (rings - 99) + 50 * quads
    circles = mesh.positions[:, :tubes].reshape(12, rings, SIDES, 3).astype(np.float64)
    radius = np.linalg.norm(circles - circles.mean(axis=2, keepdims=True), axis=-1)
    assert np.abs(np.ptp(radius, axis=0)).max() < 1e-5, "a ring changes its size"
    for card in mesh.positions[:, tubes:].reshape(12, 50, blade, 3).astype(np.float64).transpose(1, 0, 2, 3):
        apart = np.linalg.norm(card[:, :, None] - card[:, None], axis=-1)
        assert np.ptp(apart, axis=0).max() < 1e-5, "a leaf changes its shape"
    assert np.array_equal(np.unique(mesh.faces), np.arange(mesh.vertex_count))
    athcodec.build_ath(mesh, max_error=1.0)


def test_a_canopy_comes_out_the_same_again_and_otherwise_by_its_seed(canopy):
    canopy.check()
    assert (canopy.frame_count, round(canopy.fps, 6), canopy.metadata["unit"]) == (40, 30, "m")
    assert np.array_equal(canopy.positions, CANOPY.make().positions)
    assert not np.array_equal(canopy.positions, replace(CANOPY, seed=4).make().positions)
    assert np.ptp(canopy.rest[:, 1]) == pytest.approx(5.0, rel=0.1)


def test_leaves_swing_in_the_species_time_and_line_up_with_the_wind():
    kind = SPECIES["broadleaf"]
    leaves = Leaves(still(60), kind, 200, np.random.default_rng(1))
    plates = Plates(leaves)
    plates.area[:] = 0  # no air
    plates.turn[[0, 3]] = [[np.cos(0.005)], [np.sin(0.005)]]
    crossings, last = np.zeros(200), plates.turn[3] > 0
    for _ in range(480):
        plates.step(np.zeros((3, 200)), 1 / 240)
        crossings += last != (plates.turn[3] > 0)
        last = plates.turn[3] > 0
    assert np.allclose(crossings / 4, kind.hertz[2] * np.sqrt(leaves.stiffness), atol=0.4)
    turns = leaves.turned(lambda points, seconds: np.broadcast_to(12.0 * DIRECTION, points.shape), Plates(leaves))
    along = leaves.at(leaves.skeleton.rest, leaves.unturned()), leaves.at(leaves.skeleton.rest, turns[-1])
    into = [(tips.reshape(200, -1, 3)[:, -1] - tips.reshape(200, -1, 3)[:, 0]) @ DIRECTION for tips in along]
    assert into[1].mean() > into[0].mean() + 0.3 * leaves.length.mean()


def test_neighbouring_leaves_feel_the_same_gusts_and_far_ones_others():
    plant = grow(60, 1, 4.0, seed=5)
    skeleton = still(150)
    skeleton.positions[:] *= 5.0  # 20 m, so that gusts differ
    leaves = Leaves(skeleton, SPECIES["broadleaf"], 300, np.random.default_rng(1))
    leaves.axes[:] = leaves.axes[0]  # all stand alike
    leaves.stiffness[:], leaves.length[:] = 1.0, 0.1
    turns = leaves.turned(Wind(6.0, 20.0, length=3.0, seed=4).at, Plates(leaves))[:, :, 2].astype(np.float64)
    feet = 5.0 * plant.position[leaves.node]
    apart = np.linalg.norm(feet[:, None] - feet, axis=2)
    alike = np.corrcoef(turns.T)
    near, far = (apart > 0) & (apart < 1), apart > 8
    assert near.sum() > 50 and np.median(alike[near]) > 0.4
    assert np.median(alike[near]) > np.median(np.abs(alike[far])) + 0.2


def test_a_clip_is_made_once_and_again_where_its_recipe_changed(recipes, tmp_path):
    recipes["still"] = Still(3)
    path, seconds = data._found_or_made("still", tmp_path)
    assert seconds is not None and path == tmp_path / "still.h5"
    assert data._found_or_made("still", tmp_path) == (path, None)
    recipes["still"] = Still(4)
    assert data._found_or_made("still", tmp_path)[1] is not None
    with athcodec.read_hdf5(path) as clip:
        assert clip.frame_count == 4
    path.write_bytes(b"half a file")
    assert data._found_or_made("still", tmp_path)[1] is not None


def test_clips_are_found_by_name_and_by_path(monkeypatch, recipes, tmp_path):
    sample = athcodec.sample_path()
    assert data.path_of("sample") == sample == data.path_of(str(sample))
    with pytest.raises(KeyError, match="got 'nothing', expected the path of a file or one of sample,"):
        data.path_of("nothing")
    monkeypatch.setenv(data.FOLDER_VARIABLE, str(tmp_path))
    recipes["still"] = Still(2)
    assert data.path_of("still") == tmp_path / "still.h5"


def test_the_verb_prints_a_table_of_the_clips(tmp_path):
    words = [sys.executable, "-m", "bench", "data", "sample", "--folder", tmp_path]
    assert "| sample |    1,001 |    120 |       99 | 0-2" in printed(*words, cwd=ROOT)


def exact_digests(folder: Path) -> list[str]:
    """Digests of the small exact clips, which are made anew."""
    data.RECIPES |= {name: replace(recipe, digest="") for name, recipe in SMALL_EXACT.items()}
    return [data.digest(data.path_of(name, folder)) for name in SMALL_EXACT]


def test_exact_clips_have_the_same_bits_on_every_machine(recipes, tmp_path):
    assert exact_digests(tmp_path) == [recipe.digest for recipe in SMALL_EXACT.values()]


def test_exact_clips_have_the_same_bits_without_wide_vectors_and_with_kernels_of_another_processor(tmp_path):
    features = np._core._multiarray_umath.__cpu_dispatch__
    script = "import sys, pathlib, test_bench_data as t; print(*t.exact_digests(pathlib.Path(sys.argv[1])))"
    settings = {"NPY_DISABLE_CPU_FEATURES": " ".join(features), "OPENBLAS_CORETYPE": "Nehalem", "PYTHONPATH": str(ROOT)}
    found = printed(sys.executable, "-c", script, tmp_path, cwd=ROOT / "tests", env=os.environ | settings)
    assert found.split() == [recipe.digest for recipe in SMALL_EXACT.values()]


def test_an_exact_clip_that_comes_out_otherwise_is_refused_and_not_kept(recipes, tmp_path):
    recipes["cards"] = replace(SMALL_EXACT["cards"], seed=4)
    with pytest.raises(data.Different, match=f"clip cards: got digest .*, expected {SMALL_EXACT['cards'].digest}"):
        data.path_of("cards", tmp_path)
    assert not list(tmp_path.iterdir())


def test_exact_trees_solve_the_equations_of_beams():
    plant = exact.grow(((1, 12), (4, 24), (12, 60)), 4.0, seed=2)
    weight, load = np.random.default_rng(1).uniform(1, 1e4, (2, 6, len(plant.parent)))
    load[:, 0] = 0.0
    matrix = 1.5 * beams._stiffness(plant).toarray() + np.diag(weight.T.ravel())
    expected = np.linalg.solve(matrix, load.T.ravel()).reshape(-1, 6).T
    assert np.allclose(exact.Equations(plant, 1.5, weight).solve(load), expected, rtol=1e-6, atol=1e-9)
    turns = np.linspace(-3, 3, 1001)
    assert np.abs(exact.sine(turns) - np.sin(2 * np.pi * turns)).max() < 1e-14


def test_exact_cards_are_rigid_and_turn_steadily_between_keys():
    clip = SMALL_EXACT["cards"].make()
    cards = clip.positions[:, 20:].reshape(13, 20, 6, 3).astype(np.float64)
    apart = np.linalg.norm(cards[:, :, :, None] - cards[:, :, None], axis=-1)
    assert np.ptp(apart, axis=0).max() < 1e-6
    pace = np.linalg.norm(np.diff(cards[:, :, 5], axis=0), axis=-1).reshape(3, 4, 20)
    assert np.ptp(pace, axis=1).max() < 1e-6 and np.ptp(pace, axis=0).max() > 1e-3
    assert (clip.positions[:, :20] == clip.rest[:20]).all() and (clip.positions[0] == clip.rest).all()


def test_the_table_of_clips_that_stand_for_others_is_that_of_the_saved_figures():
    saved = [read(ROOT / "bench" / "results" / f"{name}.json") for name in ("not_made", "stand_ins")]
    old, new = (result["tables"][0]["rows"] for result in saved)
    pairs = {(a["clip"], a["bound"], a["ladder"]): (a["bytes"], b["bytes"]) for a, b in zip(old, new, strict=True)}
    text = (ROOT / "docs" / "benchmarks.md").read_text("utf-8")
    for bound in ("0.001", "0.0001", "1e-05"):
        for ladder in ("none", "decades"):
            sizes = [pairs[clip, bound, ladder] for clip in ("tree_8k_200f", "leaves_373x121f")]
            cells = [f"{one:,} | {other:,} | {other / one:.2f}" for one, other in sizes]
            assert f"| {float(bound):.0e}, `{ladder}` | {' | '.join(cells)} |".replace("e-0", "e-") in text
            assert all(0.5 < other / one < 2 for one, other in sizes)
