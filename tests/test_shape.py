"""Small faces keep their shape whatever the bound of the plant: in the rest pose and in motion, at every level."""

from __future__ import annotations

import numpy as np
import pytest
from files import coded
from moving_meshes import leafed_tree
from plants import clip_of, diagonal, plant, turns

import athcodec
from athcodec.cli import main
from athcodec.errors import BoundError

pytestmark = pytest.mark.sizes


@pytest.fixture(scope="module")
def tree():
    return leafed_tree()


def edges(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Lengths, (..., F, 4)."""
    return np.linalg.norm(np.roll(points[..., faces, :], 1, axis=-2) - points[..., faces, :], axis=-1)


def normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals of quads, (..., F, 3)."""
    a, b, c, d = (points[..., faces[:, k], :] for k in range(4))
    normal = np.cross(c - a, d - b)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def shape_errors(points: np.ndarray, source: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stretch of all edges, angles between all normals in degrees."""
    stretch = np.abs(edges(points, faces) / edges(source, faces) - 1)
    between = np.linalg.norm(normals(points, faces) - normals(source, faces), axis=-1)
    return stretch, np.degrees(2 * np.arcsin(np.clip(between / 2, 0, 1)))


def source_of(clip: athcodec.MotionClip) -> np.ndarray:
    return clip.block(0, clip.frame_count).astype(float)


def turn(points: np.ndarray, faces: np.ndarray) -> float:
    """RMS turn of the normals from frame to frame, degrees."""
    change = np.diff(normals(points, faces), axis=0)
    return float(np.degrees(np.sqrt((change**2).sum(axis=-1).mean())))


@pytest.mark.parametrize("ladder", ["none", "decades"])
@pytest.mark.parametrize("relative", [1e-2, 1e-3, 1e-4])
def test_cards_smaller_than_the_bound_keep_shape_and_turn_as_in_the_source(tree, scratch, relative, ladder):
    athcodec.encode(tree, scratch / "tree.ath", rel_error=relative, ladder=ladder)
    source = source_of(tree)
    with athcodec.open(scratch / "tree.ath") as decoder:
        decoded = decoder.positions().astype(float)
    stretch, angle = shape_errors(decoded, source, tree.faces)
    assert np.quantile(stretch, 0.999) <= 0.06
    assert np.quantile(angle, 0.999) <= 6.0 and np.sqrt((angle**2).mean()) <= 2.0
    assert turn(decoded, tree.faces) <= 1.1 * turn(source, tree.faces)
    assert np.linalg.norm(decoded - source, axis=2).max() <= relative * diagonal(tree)


@pytest.mark.parametrize("size", [0.5, 0.8])
def test_cards_that_need_corrections_do_not_twitch(scratch, size):
    clip = leafed_tree(size=size)
    with coded(clip, scratch / "tree.ath", rel_error=1e-3) as decoder:
        error = (decoder.positions().astype(float) - source_of(clip)) / (1e-3 * diagonal(clip))
    assert np.linalg.norm(error, axis=2).max() <= 1
    assert np.quantile(np.linalg.norm(np.diff(error, 2, axis=0), axis=2), 0.999) <= 1.6


def test_every_level_and_its_reference_pose_keep_the_shape_of_cards(tree, scratch):
    with coded(tree, scratch / "tree.ath", rel_error=1e-4) as decoder:
        assert len(decoder.levels) > 4
        for level in range(len(decoder.levels)):
            decoded = decoder.positions(level=level).astype(float)
            assert np.quantile(shape_errors(decoded, source_of(tree), tree.faces)[0], 0.99) <= 0.15
            stretch, angle = shape_errors(decoder.level_rest(level), tree.rest.astype(float), tree.faces)
            assert np.quantile(stretch, 0.99) <= 0.04 and np.quantile(angle, 0.99) <= 2.0


def test_a_rest_pose_of_the_bound_takes_fewer_bytes_and_loses_shape(tree, scratch):
    sizes, stretches = {}, {}
    for rest_error in (None, "bound"):
        given = {"rel_error": 1e-2, "ladder": "none", "attributes": "none", "rest_error": rest_error}
        sizes[rest_error] = athcodec.encode(tree, scratch / "tree.ath", **given).bytes
        with athcodec.open(scratch / "tree.ath") as decoder:
            rest = decoder.level_rest().astype(float)
        stretches[rest_error] = np.abs(edges(rest, tree.faces) / edges(tree.rest.astype(float), tree.faces) - 1).mean()
    assert sizes["bound"] < sizes[None]
    assert stretches[None] < 0.02 < stretches["bound"]


@pytest.mark.parametrize("rest_error, metres", [(1e-4, None), ("2mm", 0.002), ("0.5cm", 0.005)])
def test_a_rest_pose_is_as_precise_as_it_is_asked_for_at_every_level(tree, scratch, rest_error, metres):
    clip = tree.replace(metadata={"unit": "m"})
    most = metres or rest_error * diagonal(tree)
    with coded(clip, scratch / "tree.ath", rel_error=1e-3, rest_error=rest_error, effort="fast") as decoder:
        for level in range(len(decoder.levels)):
            assert np.linalg.norm(decoder.level_rest(level) - clip.rest, axis=1).max() <= most


def test_an_error_of_the_rest_pose_is_held_at_every_level(scratch):
    clip = athcodec.read(athcodec.sample_path("tree"))
    clip = clip.replace(positions=clip.block(0, 16), time=clip.time[:16])
    for rest_error in (1e-5, 1e-4, 1e-3):
        with coded(clip, scratch / "plant.ath", rel_error=1e-3, rest_error=rest_error, effort="fast") as decoder:
            for level in range(len(decoder.levels)):
                away = np.linalg.norm(decoder.file.rest_at(level) - clip.rest, axis=1).max()
                assert away <= rest_error * diagonal(clip)


@pytest.mark.parametrize("effort", ["fast", pytest.param("default", marks=pytest.mark.slow)])
def test_a_looser_rest_error_takes_no_more_bytes(effort, scratch):
    """Over several plants, since choices in files so small are worth some percent and are made by other bytes."""
    clips = [plant(seed=seed, branches=40, longest=30) for seed in (1, 2, 5)]
    sizes = []
    for rest_error in (1e-5, 1e-4, 1e-3, None):
        given = {"rel_error": 1e-3, "rest_error": rest_error, "effort": effort}
        sizes.append(sum(athcodec.encode(clip, scratch / "plant.ath", **given).bytes for clip in clips))
    assert (sizes <= 1.02 * np.minimum.accumulate(sizes)).all(), sizes


def test_the_command_line_takes_a_rest_error(tree, scratch):
    athcodec.write_hdf5(tree, scratch / "tree.h5")
    sizes = []
    for error in ("bound", "1e-3", "2mm"):
        given = ["--rel-error", "1e-2", "--ladder", "none", "--attributes", "none", "--rest-error", error]
        code = main(["encode", str(scratch / "tree.h5"), str(scratch / "tree.ath"), *given])
        assert code == (0 if error != "2mm" else 1)  # the clip says no unit
        sizes.append((scratch / "tree.ath").stat().st_size)
    assert sizes[0] < sizes[1]


@pytest.mark.parametrize("wrong", ["0", "-1mm", "3 parsecs", 0.0, float("nan"), float("inf")])
def test_a_rest_error_that_is_none_is_refused(tree, scratch, wrong):
    with pytest.raises(BoundError):
        athcodec.encode(tree, scratch / "tree.ath", rest_error=wrong)


def test_leaves_that_fall_from_the_stem_that_a_source_names_cost_little_more_than_on_their_own():
    rng = np.random.default_rng(4)
    stem, time = np.linspace([0.0, 0, 0], [0, 1, 0], 21), np.arange(48) / 24
    waves = np.sin(rng.uniform(3, 6, (24, 1)) * time + rng.uniform(0, 6, (24, 1)))
    swing = 0.4 * waves[..., None] * rng.uniform(0.5, 1, (24, 1, 3))
    card = np.array([[u, v, 0.3 * u * v] for u in (0, 0.5, 1) for v in (-0.4, 0.4)]) * 0.05
    parts, faces = [stem + 0.1 * np.sin(2 * np.pi * time)[:, None, None] * stem[:, 1:2] ** 2 * [1.0, 0, 0]], []
    for leaf, angles in enumerate(swing):
        since = np.maximum(time - 0.2 - 0.05 * leaf, 0)[:, None] * (leaf % 2)
        foot = parts[0][:, 8 + leaf // 2] + since * [0.3, 0, 0.2] - since**2 * [0, 0.4, 0]
        faces.append(np.array([[0, 1, 3, 2], [2, 3, 5, 4]]) + sum(part.shape[1] for part in parts))
        parts.append(foot[:, None] + card @ turns(angles + 3 * since * [0, 0.6, 0.8]).swapaxes(1, 2))
    positions, branch = np.concatenate(parts, axis=1), np.repeat(np.arange(25), [21] + 24 * [6])
    on_stem, on_their_own = (
        len(
            athcodec.encode(
                clip_of(positions, positions[0], branch, parent, faces=np.concatenate(faces)), max_error=1e-4
            )
        )
        for parent in ([-1] + 24 * [0], 25 * [-1])
    )
    assert on_stem < on_their_own
