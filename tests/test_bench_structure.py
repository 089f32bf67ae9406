"""Scenes with known branches, split meshes, and the figures that `python -m bench` makes of them."""

from __future__ import annotations

import argparse

import numpy as np
import pytest

import athcodec
from athcodec import MotionClip
from bench import branches, split, structure
from bench.scenes import SCENES, fields

pytestmark = pytest.mark.tools

SMALL = ("wheat", "hedge_tubes", "hedge_ribbons", "hedge_stems", "willow", "bush", "terrain", "kelp", "trellis", "ivy")


def scene_of(name: str):
    return SCENES[name].make()


@pytest.mark.parametrize("name", SMALL)
def test_plants_of_a_scene_move_and_their_feet_stand_still(name):
    scene = scene_of(name)
    moved = np.ptp(scene.clip.positions, axis=0).max(axis=-1)
    assert not moved[scene.foot].any()
    assert moved.max() > 0.01 * np.ptp(scene.clip.positions, axis=(0, 1)).max()


@pytest.mark.parametrize("name", SMALL)
def test_no_face_of_a_scene_joins_two_branches(name):
    clip = scene_of(name).clip
    branch = clip.vertex_branch[clip.faces]
    assert (branch == branch[:, :1]).all()


def test_the_plants_of_a_field_do_not_move_alike():
    scene = scene_of("wheat")
    tips = scene.clip.positions[:, np.flatnonzero(np.diff(scene.plant, append=-1))]
    paths = (tips - tips.mean(axis=0)).transpose(1, 0, 2).reshape(tips.shape[1], -1)
    paths /= np.linalg.norm(paths, axis=1, keepdims=True)
    alike = paths @ paths.T - 2 * np.eye(len(paths))
    assert alike.max() < 0.999


def test_the_parts_of_a_scene_hold_its_vertices_and_faces_once():
    scene = fields.stems(seed=3, plants=4)
    parts = [scene.part(plant) for plant in np.unique(scene.plant)]
    assert len(parts) == 4
    assert sum(part.vertex_count for part in parts) == scene.clip.vertex_count
    assert sum(len(part.faces) for part in parts) == len(scene.clip.faces)


def test_a_turntable_turns_the_tree_that_stands():
    scene = scene_of("turntable")
    turned, standing = (np.linalg.norm(clip.positions[..., [0, 2]], axis=-1) for clip in (scene.clip, scene.standing))
    np.testing.assert_allclose(turned, standing, atol=1e-5)
    assert np.abs(scene.clip.positions - scene.standing.positions).max() > 1.0


def test_structure_weighs_what_was_found_against_the_makers_branches():
    parser = argparse.ArgumentParser()
    structure.add_arguments(parser)
    row = structure.run(parser.parse_args(["turntable", "--effort", "fast", "--short"]))["tables"][0]["rows"][0]
    clip = SCENES["turntable"].make().clip
    true = athcodec.encode(clip, rel_error=1e-4, effort="fast", attributes="none", ladder="none")
    assert row["true"] == len(true)
    assert row["roots, branches"] == [1, clip.branch_count]
    assert row["found / true"] == row["found"] / row["true"]


def cube() -> split.Mesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32)
    bend = 0.2 * np.sin(np.arange(20) / 3.0)[:, None] * corners[:, 1] ** 2
    moved = corners + bend[..., None] * [1.0, 0.0, 0.0]
    return split.Mesh(moved.astype(np.float32), faces, np.arange(20) / 30.0)


def test_a_split_cube_has_the_places_of_its_corners():
    mesh = cube().apart()
    first, place = split.places_of(mesh)
    assert (mesh.positions.shape[1], len(first)) == (24, 8)
    assert np.array_equal(np.bincount(place), np.full(8, 3))
    welded = mesh.with_vertices(first, place)
    assert np.array_equal(welded.positions[:, place], mesh.positions)
    assert np.array_equal(welded.positions[:, welded.faces], mesh.positions[:, mesh.faces])


def test_split_compares_sizes_bits_and_limits_in_both_orders():
    rows = list(split._rows(cube().apart(), 1e-4))
    assert [row["order"] for row in rows] == ["own", "shuffled"]
    assert all(row["same bits"] for row in rows)
    own, shuffled = rows
    assert own["limit"] == round(1.05 * own["welded"] + 0.25 * 24)
    assert shuffled["limit"] == round(1.05 * shuffled["welded"] + 1.2 * 24 * 3 / 8)  # Eight places: three bits.


def test_branches_are_found_for_what_a_source_gives_besides():
    clip = scene_of("turntable").clip
    edges = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    assert list(branches._without_branches(clip)) == ["points"]
    assert list(branches._without_branches(clip.replace(edges=edges))) == ["edges", "points"]
    given = branches._without_branches(scene_of("wheat").clip)
    assert list(given) == ["faces"]
    assert all(isinstance(one, MotionClip) and not one.has_branches for one in given.values())


def test_the_document_says_the_median_and_the_most_that_found_branches_cost():
    sizes = [
        {"clip": name, "given": "faces", "bound": 1e-4, "true": 1000, "found": found, "commit": "abc"}
        for name, found in (("a", 1000), ("b", 1030), ("c", 1200))
    ]
    text = branches.table_text({"sizes": sizes})
    assert "3 meshes: 3.0 % in the median, 20.0 % at most (`c`), above 5 % in 1" in text
