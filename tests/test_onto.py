"""A plant's motion on another mesh, against closed forms of how beams bend."""

import json
import warnings

import numpy as np
import pytest
from glb import apart

import athcodec
from athcodec import MotionClip
from athcodec.cli import main
from athcodec.errors import ClipError, CoarseWarning

LENGTH, NODES, FRAMES, SIDES = 2.0, 21, 5, 6
ANGLES = np.linspace(0.0, 1.2, FRAMES)  # Angle between both ends of the bent stem, radians.
SCENE = {"unit": "m", "up_axis": "y"}


def bent(points, angle):
    """Return points beside the y axis as a beam bends them to an arc that turns by an angle from its foot to LENGTH."""
    x, y, z = np.moveaxis(np.asarray(points, np.float64), -1, 0)
    if not angle:
        return np.stack([x, y, z], axis=-1)
    turn, radius = y * angle / LENGTH, LENGTH / angle
    return np.stack([radius - (radius - x) * np.cos(turn), (radius - x) * np.sin(turn), z], axis=-1)


def bent_clip(points, **arrays):
    frames = np.stack([bent(points, angle) for angle in ANGLES])
    return MotionClip(
        frames, np.arange(FRAMES) / 10, rest=np.asarray(points, np.float64), metadata=dict(SCENE), **arrays
    )


def line(count, start=(0, 0, 0), end=(0, LENGTH, 0)):
    return np.linspace(start, end, count)


def rows(count, first=0):
    return first + np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)


def tube(low, high, radius, rings, axis=1, centre=(0.0, 0.0)):
    """Return points and quads of a tube along an axis, a ring of SIDES after the other."""
    around = 2 * np.pi * np.arange(SIDES) / SIDES
    points = np.zeros((rings, SIDES, 3))
    points[..., axis] = np.linspace(low, high, rings)[:, None]
    others = [number for number in range(3) if number != axis]
    points[..., others[0]] = centre[0] + radius * np.cos(around)
    points[..., others[1]] = centre[1] + radius * np.sin(around)
    ring, side = np.arange(rings - 1)[:, None] * SIDES, np.arange(SIDES)
    after = (side + 1) % SIDES
    quads = np.stack([ring + side, ring + after, ring + SIDES + after, ring + SIDES + side], axis=2)
    return points.reshape(-1, 3), quads.reshape(-1, 4)


CARD = np.array([[0.05, 1.0, 0.0], [0.12, 1.03, 0.02], [0.18, 1.0, 0.03], [0.12, 0.97, 0.02]])


@pytest.fixture(scope="module")
def stem():
    """The bytes of a file of a centre line that bends."""
    clip = bent_clip(line(NODES), edges=rows(NODES))
    return athcodec.encode(clip, rel_error=1e-5, exact_rest=True)


@pytest.fixture(scope="module")
def fork():
    """The bytes of a file of a stem with a side stem in the middle, which swings about its foot besides."""
    points = np.concatenate([line(NODES), line(9, (0.0, 1.0, 0.1), (0.0, 1.0, 0.9))])
    edges = np.concatenate([rows(NODES), [[10, NODES]], rows(9, NODES)])
    clip = bent_clip(points, edges=edges)
    frames = np.array(clip.positions)
    for frame, angle in enumerate(ANGLES):
        swing = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
        foot = frames[frame, 10]
        frames[frame, NODES:] = foot + (frames[frame, NODES:] - foot) @ swing.T
    return athcodec.encode(clip.replace(positions=frames), rel_error=1e-5, exact_rest=True)


def opened(data):
    return athcodec.open(data)


def test_a_tube_on_a_centre_line_bends_as_the_beam_does(stem):
    points, quads = tube(0.0, LENGTH, 0.05, 41)
    with opened(stem) as plant, athcodec.onto(plant, points[None], faces=quads) as moving:
        assert moving.shape == (FRAMES, len(points), 3)
        for frame, angle in enumerate(ANGLES):
            off = np.linalg.norm(moving[frame] - bent(points, angle), axis=1)
            # The frame at an end is that of its element, half an element's turn off the beam's.
            assert off.max() < 0.05 * angle / (NODES - 1) / 2 + 2e-4
            assert np.median(off) < 1e-4


def test_rings_of_a_bent_tube_keep_their_shape(stem):
    points, quads = tube(0.0, LENGTH, 0.05, 21)
    with opened(stem) as plant, athcodec.onto(plant, points, faces=quads) as moving:
        rings = np.asarray(moving).reshape(FRAMES, 21, SIDES, 3)
        radii = np.linalg.norm(rings - rings.mean(axis=2, keepdims=True), axis=3)
        np.testing.assert_allclose(radii, 0.05, atol=1e-6)


def test_a_leaf_keeps_its_shape_and_stays_where_it_hangs(stem):
    with opened(stem) as plant, athcodec.onto(plant, CARD, faces=[[0, 1, 2, 3]]) as moving:
        assert moving.report.card_count == 1
        sides = np.linalg.norm(CARD[:, None] - CARD, axis=2)
        for frame, angle in enumerate(ANGLES):
            leaf = moving[frame].astype(np.float64)
            np.testing.assert_allclose(np.linalg.norm(leaf[:, None] - leaf, axis=2), sides, atol=1e-6)
            assert np.linalg.norm(leaf[0] - bent(CARD[0], angle)) < 1e-3


def test_a_leaf_that_shares_a_corner_with_its_twig_is_a_piece_of_its_own(stem):
    points, quads = tube(0.0, LENGTH, 0.05, 21)
    leaf = np.concatenate([points[[10 * SIDES]], CARD[1:]])
    mesh = np.concatenate([points, leaf[1:]])
    count = len(points)
    faces = np.concatenate([quads, [[10 * SIDES, count, count + 1, count + 2]]])
    with opened(stem) as plant, athcodec.onto(plant, mesh, faces=faces) as moving:
        assert moving.report.card_count == 1
        last = moving[-1].astype(np.float64)[[10 * SIDES, count, count + 1, count + 2]]
        sides = np.linalg.norm(leaf[:, None] - leaf, axis=2)
        np.testing.assert_allclose(np.linalg.norm(last[:, None] - last, axis=2), sides, atol=1e-5)


def test_the_base_of_a_side_stem_stays_on_its_stem(fork):
    trunk, quads = tube(0.0, LENGTH, 0.05, 21)
    side, side_quads = tube(0.0, 0.9, 0.03, 10, axis=2, centre=(0.0, 1.0))
    mesh, faces = np.concatenate([trunk, side]), np.concatenate([quads, len(trunk) + side_quads])
    with opened(fork) as plant, athcodec.onto(plant, mesh, faces=faces) as moving:
        assert moving.report.card_count == 0
        base = np.asarray(moving)[:, len(trunk) : len(trunk) + SIDES].mean(axis=1)
        middle = np.array([bent([0.0, 1.0, 0.0], angle) for angle in ANGLES])
        np.testing.assert_allclose(base, middle, atol=1e-4)
        tip = np.asarray(moving)[-1, -SIDES:].mean(axis=0)
        np.testing.assert_allclose(tip, plant[-1][-1], atol=1e-3)  # It swings with its own stem.


def test_a_skin_over_a_fork_does_not_tear(fork):
    trunk, quads = tube(0.0, LENGTH, 0.05, 41)
    side, side_quads = tube(0.05, 0.9, 0.03, 18, axis=2, centre=(0.0, 1.0))
    # One skin: faces join the base of the side stem to the trunk's ring beside it.
    bridge = [[20 * SIDES + 1, 20 * SIDES + 2, len(trunk) + 1, len(trunk)], [20 * SIDES + 2, 21 * SIDES + 2]]
    bridge[1] += [len(trunk) + 2, len(trunk) + 1]
    mesh, faces = np.concatenate([trunk, side]), np.concatenate([quads, len(trunk) + side_quads, bridge])
    sides = np.concatenate([faces[:, [a, (a + 1) % 4]] for a in range(4)])
    with opened(fork) as plant, athcodec.onto(plant, mesh, faces=faces) as moving:
        assert moving.report.joint_count > 0
        length = np.linalg.norm(mesh[sides[:, 0]] - mesh[sides[:, 1]], axis=1)
        for frame in moving:
            now = np.linalg.norm(frame[sides[:, 0]].astype(float) - frame[sides[:, 1]], axis=1)
            assert np.abs(now - length).max() < 0.05


def test_short_edges_of_a_skin_over_a_fork_stretch_no_more_than_long_ones(fork):
    """As in scans and meshes of other programs, whose tessellation knows nothing of the stems."""
    trunk, quads = tube(0.0, LENGTH, 0.05, 41)
    side, side_quads = tube(0.05, 0.9, 0.03, 90, axis=2, centre=(0.0, 1.0))
    step = np.where(np.arange(89) % 2, 4e-4, 0.0182)
    side.reshape(90, SIDES, 3)[..., 2] = (0.05 + np.append(0.0, np.cumsum(step)))[:, None]
    ring, first = np.arange(SIDES), 20 * SIDES
    bridge = np.stack([first + ring, first + (ring + 1) % SIDES, len(trunk) + (ring + 1) % SIDES, len(trunk) + ring], 1)
    mesh, faces = np.concatenate([trunk, side]), np.concatenate([quads, len(trunk) + side_quads, bridge])
    rings = len(trunk) + np.arange(len(side)).reshape(90, SIDES)
    with opened(fork) as plant, athcodec.onto(plant, mesh, faces=faces) as moving:
        moved = moving[:2]
    long, short = (np.abs(apart_by(moved, rings, one) / apart_by(mesh[None], rings, one) - 1).max() for one in (0, 1))
    assert 0.005 < long < 0.5 and short < 2 * long


def apart_by(frames, rings, one):
    """How far each other ring of a tube, from `one` on, is from the next, along all sides."""
    return np.linalg.norm(frames[:, rings[one:-1:2]].astype(float) - frames[:, rings[one + 1 :: 2]], axis=-1)


def test_vertices_on_the_nodes_move_as_each_level_does(fork):
    with opened(fork) as plant:
        for level in range(plant.file.level_count):
            shown = plant.at_level(level)
            with athcodec.onto(shown, plant.file.rest) as moving:
                np.testing.assert_allclose(np.asarray(moving), np.asarray(shown), atol=1e-6)


def test_girth_and_leaves_grow_with_a_stem_that_grows():
    points = line(NODES)
    growth = np.array([0.1, 0.5, 1.0])
    clip = MotionClip(growth[:, None, None] * points, np.arange(3) / 10, rest=points, edges=rows(NODES))
    ring, quads = tube(0.0, LENGTH, 0.05, 21)
    with opened(athcodec.encode(clip, rel_error=1e-5, exact_rest=True)) as plant:
        moving = np.asarray(athcodec.onto(plant, ring, faces=quads), np.float64)
    radius = np.linalg.norm(moving[:, :, [0, 2]], axis=2).mean(axis=1) / 0.05
    assert radius[0] < 0.15 and 0.4 < radius[1] < 0.6 and radius[2] == pytest.approx(1.0, abs=1e-5)


def test_a_mesh_in_the_pose_of_a_frame_takes_the_motion_from_there(stem):
    points, quads = tube(0.0, LENGTH, 0.05, 21)
    with opened(stem) as plant, athcodec.onto(plant, bent(points, ANGLES[-1]), faces=quads, frame=-1) as moving:
        for frame, angle in enumerate(ANGLES):
            off = np.linalg.norm(moving[frame] - bent(points, angle), axis=1)
            assert off.max() < 0.05 * (ANGLES[-1] - angle) / (NODES - 1) / 2 + 5e-4
        with pytest.raises(IndexError):
            athcodec.onto(plant, points, frame=FRAMES)


def test_a_plant_that_grows_from_a_point_takes_a_mesh_of_its_last_frame():
    points = line(NODES)
    growth = np.array([0.0, 0.5, 1.0])
    clip = MotionClip(growth[:, None, None] * points, np.arange(3) / 10, rest=0.0 * points, edges=rows(NODES))
    ring, quads = tube(0.0, LENGTH, 0.05, 21)
    seedling = clip.replace(positions=(growth + 0.05)[:, None, None] * points, rest=0.05 * points)
    with (
        opened(athcodec.encode(seedling, rel_error=1e-5)) as plant,
        pytest.raises(ClipError, match="fits with frame=-1"),
    ):
        athcodec.onto(plant, ring, faces=quads)
    with opened(athcodec.encode(clip, rel_error=1e-5)) as plant:
        with pytest.raises(ClipError, match="frame=-1"):
            athcodec.onto(plant, ring, faces=quads)
        moving = np.asarray(athcodec.onto(plant, ring, faces=quads, frame=-1), np.float64)
    np.testing.assert_allclose(moving[2], ring, atol=1e-4)
    assert np.ptp(moving[0], axis=0).max() < 0.01
    np.testing.assert_allclose(moving[1, :, 1], ring[:, 1] / 2, atol=1e-3)


def test_a_coarse_tube_follows_a_fine_one(stem):
    fine, quads = tube(0.0, LENGTH, 0.05, 81)
    coarse, coarse_quads = tube(0.0, LENGTH, 0.05, 11)
    data = athcodec.encode(bent_clip(fine, faces=quads), rel_error=1e-5, exact_rest=True, effort="fast")
    with opened(data) as plant, athcodec.onto(plant, coarse, faces=coarse_quads) as moving:
        for frame, angle in enumerate(ANGLES):
            assert np.linalg.norm(moving[frame] - bent(coarse, angle), axis=1).max() < 0.04 * 0.05


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        (lambda points: 100 * points, "unit='cm'"),
        (lambda points: points / 0.0254, "unit='in'"),
        (lambda points: points / 1000, "unit='km'"),
        (lambda points: points[:, [0, 2, 1]] * [1, -1, 1], "up_axis='z'"),
        (lambda points: 1000 * points[:, [0, 2, 1]] * [1, -1, 1], "unit='mm', up_axis='z'"),
    ],
)
def test_a_mesh_in_another_unit_or_axis_is_refused_with_what_fits(fork, change, hint):
    points, quads = tube(0.0, LENGTH, 0.05, 21)
    with opened(fork) as plant:
        with pytest.raises(ClipError, match=hint):
            athcodec.onto(plant, change(points), faces=quads)
        options = dict(part.split("=") for part in hint.replace("'", "").split(", "))
        with athcodec.onto(plant, change(points), faces=quads, **options) as moving:
            np.testing.assert_allclose(moving[0], points, atol=1e-4)


def test_another_plant_is_refused(fork):
    with opened(fork) as plant, pytest.raises(ClipError, match="expected a mesh of this plant"):
        athcodec.onto(plant, tube(0.0, LENGTH, 0.05, 21, centre=(9.0, 0.0))[0])


def test_the_report_counts_far_vertices_and_measures_the_mesh_s_own_motion(stem):
    points, quads = tube(0.0, LENGTH, 0.05, 21)
    mesh = bent_clip(np.concatenate([points, [[0.9, 1.0, 0.0]]]), faces=quads)
    with opened(stem) as plant, athcodec.onto(plant, mesh) as moving:
        report = moving.report
        off = np.linalg.norm(np.asarray(moving) - np.asarray(mesh.positions), axis=2)
    assert (report.vertex_count, report.far_count, report.frame_count) == (len(points) + 1, 1, FRAMES)
    assert report.far_limit == pytest.approx(LENGTH / 10)
    assert report.furthest == pytest.approx(0.9, abs=0.01)
    assert report.max_error == pytest.approx(off.max(), rel=1e-4)
    assert report.rms_error == pytest.approx(np.sqrt((off**2).mean()), rel=1e-4)
    assert "1 further away than 0.2 m" in str(report)


def test_a_rest_pose_that_is_coarser_than_the_motion_is_warned_of():
    # A rest pose that is unlike all frames is stored apart from the pose that they are coded about, and coarsely.
    points = line(60)
    pose = points + np.cumsum(np.random.default_rng(1).normal(0, 0.1, (60, 3)), axis=0)
    frames = pose + 0.02 * np.sin(np.arange(40) / 5)[:, None, None] * points
    clip = MotionClip(frames, np.arange(40) / 10, rest=points, edges=rows(60))
    with opened(athcodec.encode(clip, rel_error=1e-4)) as plant:
        assert np.abs(plant.file.rest - points).max() <= plant.file.static.rest_error
        with pytest.warns(CoarseWarning, match="--exact-rest"):
            athcodec.onto(plant, points)
    with opened(athcodec.encode(clip, rel_error=1e-4, exact_rest=True)) as plant, warnings.catch_warnings():
        warnings.simplefilter("error")
        athcodec.onto(plant, points)


def test_indices_mean_what_they_mean_for_an_array(stem):
    points = tube(0.0, LENGTH, 0.05, 5)[0]
    with opened(stem) as plant, athcodec.onto(plant, points) as moving:
        whole = np.asarray(moving)
        for index in (0, -1, slice(1, 4), slice(None, None, -2), [3, 0], (slice(None), 2), (1, 2, 0)):
            np.testing.assert_array_equal(moving[index], whole[index])
        np.testing.assert_array_equal(np.stack(list(moving)), whole)


@pytest.fixture
def files(stem, tmp_path):
    """An .ath file, and a mesh beside it."""
    points, quads = tube(0.0, LENGTH, 0.05, 21)
    (tmp_path / "stem.ath").write_bytes(stem)
    uv = np.linspace(0, 1, 2 * len(points)).reshape(-1, 2).astype(np.float32)
    mesh = MotionClip(
        points[None].astype(np.float32),
        [0.0],
        faces=quads,
        attributes={"uv": uv},
        metadata=SCENE | {"domains": {"uv": "vertex"}},
    )
    athcodec.write(mesh, tmp_path / "lod.h5")
    return tmp_path


def test_decode_onto_writes_the_mesh_with_its_faces_and_attributes(files, capsys):
    out = files / "moving.glb"
    words = ["decode", files / "stem.ath", out, "--onto", files / "lod.h5", "--level", "1", "--frames", "1:4", "--json"]
    assert main([*map(str, words)]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["frames"], facts["vertices"], facts["level"]) == (3, 21 * SIDES, 1)
    assert facts["onto"]["far_count"] == 0
    with (
        athcodec.open(files / "stem.ath") as plant,
        athcodec.read(out) as moved,
        athcodec.read(files / "lod.h5") as lod,
    ):
        expected = athcodec.onto(plant.at_level(1), files / "lod.h5")[1:4]
        # glTF joins vertices and cuts quads as it needs; here it keeps the order.
        np.testing.assert_allclose(moved.block(0, 3), expected, atol=1e-3)
        assert len(moved.faces) == 2 * len(lod.faces)
        np.testing.assert_allclose(moved.attributes["uv"][:, 0], lod.attributes["uv"][:, 0], atol=1e-6)


def test_decode_says_how_the_mesh_lies_and_refuses_what_makes_no_sense(files, capsys):
    ath, lod, out = (str(files / name) for name in ("stem.ath", "lod.h5", "out.h5"))
    assert main(["decode", ath, out, "--onto", lod]) == 0
    assert "126 vertices on the plant" in capsys.readouterr().out
    for option in (("--onto-unit", "cm"), ("--onto-up-axis", "z"), ("--onto-frame", "0")):
        assert main(["decode", ath, out, *option]) == 1
        assert f"{option[0]}: got no mesh" in capsys.readouterr().err
    assert main(["decode", ath, out, "--onto", lod, "--onto-frame", "0"]) == 0
    capsys.readouterr()
    assert main(["decode", ath, lod, "--onto", lod]) == 1
    assert "is the input" in capsys.readouterr().err
    assert main(["decode", ath, out, "--onto", lod, "--onto-unit", "mm"]) == 1
    assert "--onto-unit m" in capsys.readouterr().err
    assert main(["decode", ath, out, "--onto", str(files / "missing.h5")]) == 1
    assert "missing.h5" in capsys.readouterr().err


def test_levels_of_detail_that_are_numbered_like_frames_are_read_one_by_one(files):
    with opened((files / "stem.ath").read_bytes()) as plant, warnings.catch_warnings():
        warnings.simplefilter("error")
        for number, rings in enumerate((21, 11, 5)):
            points, quads = tube(0.0, LENGTH, 0.05, rings)
            mesh = MotionClip(points[None].astype(np.float32), [0.0], faces=quads, metadata=dict(SCENE))
            for suffix in (".obj", ".glb"):
                athcodec.write(mesh, files / f"lod{suffix}").files[0].rename(files / f"lod{number}{suffix}")
        for number, rings in enumerate((21, 11, 5)):
            for suffix in (".obj", ".glb"):
                with athcodec.onto(plant, files / f"lod{number}{suffix}") as moving:
                    assert moving.shape == (FRAMES, rings * SIDES, 3)


def test_a_mesh_without_branches_gets_those_that_move_it(fork):
    trunk, quads = tube(0.0, LENGTH, 0.05, 21)
    side, side_quads = tube(0.05, 0.9, 0.03, 10, axis=2, centre=(0.0, 1.0))
    mesh, faces = np.concatenate([trunk, side]), np.concatenate([quads, len(trunk) + side_quads])
    with opened(fork) as plant, athcodec.onto(plant, mesh, faces=faces) as moving:
        clip = moving.clip
        assert clip.branch_parent.tolist() == [-1, 0]
        assert set(clip.vertex_branch[: len(trunk)]) == {0} and set(clip.vertex_branch[len(trunk) :]) == {1}


def test_a_bound_mesh_bends_as_the_moved_mesh_does(stem, tmp_path):
    tube_points, quads = tube(0.0, LENGTH, 0.05, 21)
    mesh, faces = np.concatenate([tube_points, CARD]), [*quads, len(tube_points) + np.arange(4)]
    with opened(stem) as plant, athcodec.onto(plant, mesh, faces=faces) as moving:
        facts = moving.write_bound(tmp_path / "bound.glb")
    # Between bones whose turns differ by a, a skin is thinner by a^2 / 8 of what stands off the stem; most the card.
    most = CARD[:, 0].max() * (ANGLES[-1] / (NODES - 1)) ** 2 / 8
    assert facts["bones"] == NODES and facts["max_error"] < 2 * most
    document, _ = apart((tmp_path / "bound.glb").read_bytes())
    names = document["nodes"][document["skins"][0]["skeleton"]]["extras"]["ATH_bones"]
    assert sorted(names["vertex"]) == list(range(NODES)) and "animations" not in document
    with athcodec.read(tmp_path / "bound.glb") as still:
        np.testing.assert_allclose(still.block(0, 1)[0], mesh, atol=1e-6)


def test_decode_binds_a_mesh_and_refuses_what_has_no_bones(files, capsys):
    ath, lod = str(files / "stem.ath"), str(files / "lod.h5")
    words = ["decode", ath, str(files / "bound.glb"), "--onto", lod, "--bind"]
    assert main(words) == 0
    assert f"a mesh on {NODES} bones" in capsys.readouterr().out
    for options, message in (
        (["decode", ath, str(files / "out.glb"), "--bind"], "--bind: got no mesh"),
        (["decode", ath, str(files / "out.h5"), "--onto", lod, "--bind"], "expected a .glb file"),
        ([*words, "--rig"], "another way to move"),
    ):
        assert main(options) == 1
        assert message in capsys.readouterr().err


def surfaces():
    """A clip of a tube that bends, one that grows on it, and a card that turns about its foot besides."""
    trunk, quads = tube(0.0, LENGTH, 0.05, 41)
    side, side_quads = tube(0.05, 0.9, 0.03, 20, axis=2, centre=(0.0, 1.0))
    first = len(trunk) + len(side)
    faces = np.concatenate([quads, len(trunk) + side_quads, [first + np.arange(4)]])
    branch = np.repeat([0, 1, 2], [len(trunk), len(side), 4])
    clip = bent_clip(
        np.concatenate([trunk, side, CARD]), faces=faces, vertex_branch=branch, branch_parent=np.array([-1, 0, 0])
    )
    frames = np.array(clip.positions)
    for frame, angle in enumerate(2 * ANGLES):
        turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
        foot = frames[frame, first]
        frames[frame, first:] = foot + (frames[frame, first:] - foot) @ turn.T
    return clip.replace(positions=frames)


def coarse_surfaces():
    """The points and faces of a mesh of another tessellation, without the side stem."""
    trunk, quads = tube(0.0, LENGTH, 0.05, 18)
    return np.concatenate([trunk, CARD]), [*quads, len(trunk) + np.arange(4)]


def test_a_mesh_on_surfaces_is_bound_to_their_slices(tmp_path):
    points, faces = coarse_surfaces()
    data = athcodec.encode(surfaces(), rel_error=1e-5, exact_rest=True)
    with opened(data) as plant, athcodec.onto(plant, points, faces=faces) as moving:
        facts = moving.write_bound(tmp_path / "bound.glb")
        card, expected = moving[:, -4:], plant[:, -4:]
    assert facts["bones"] < plant.file.vertex_count / 4  # The stem that moves nothing of the mesh has none.
    assert facts["max_error"] < 1e-3 and np.abs(card - expected).max() < 2e-3
    document, _ = apart((tmp_path / "bound.glb").read_bytes())
    bones = document["nodes"][document["skins"][0]["skeleton"]]["extras"]["ATH_bones"]
    slices = bones["slices"]
    assert slices["bone"] == list(range(facts["bones"])) and set(bones["vertex"]) <= set(slices["vertex"])
    # The vertices of a bone, at rest about it, are those of the plant.
    bone = np.repeat(slices["bone"], slices["count"])
    rest = np.array([document["nodes"][node]["translation"] for node in document["skins"][0]["joints"]])
    places = rest[bone] + np.reshape(slices["offset"], (-1, 3))
    np.testing.assert_allclose(places, surfaces().rest[slices["vertex"]], atol=1e-6)


@pytest.mark.tools
def test_a_scan_moves_and_is_bound_by_the_beams_of_its_tree():
    """One closed skin of irregular triangles that share no vertices, with noise; its own motion rides on tubes."""
    from bench.data import Canopy
    from bench.onto import Case, measured
    from bench.trees.scan import scanned, thickened

    beams = thickened(Canopy(20, 1, 16, 1.2, 8.0, 0, "broadleaf", seed=5).skeleton(), 4.0)
    scan = scanned(beams, 0.012, 2e-4, 1)
    places, vertex = np.unique(scan.rest, axis=0, return_inverse=True)
    sides = np.sort(vertex.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert len(places) < scan.vertex_count / 5 and set(np.unique(sides, axis=0, return_counts=True)[1]) == {2}
    row = measured(Case("scan", beams, scan, np.ones(scan.vertex_count, bool)), 1e-4)
    assert row["far"] == row["whole pieces"] == 0 and row["skeleton stretch"] < 1e-4
    assert row["wood RMS"] < 1e-3 * row["size"] and row["bones max"] < 1e-3 * row["size"]
    assert row["stretch"] < 0.02 + row["own stretch"] and row["gap"] < row["own gap"] + 1e-3 * row["size"]


@pytest.mark.tools
def test_a_canopy_s_mesh_moves_by_the_beams_that_carried_it(tmp_path, monkeypatch):
    from bench.onto import case_of, measured

    monkeypatch.setenv("ATHCODEC_BENCH_DATA", str(tmp_path))
    row = measured(case_of("canopy_1k_60f"), 1e-4)
    assert row["far"] == 0 and row["whole pieces"] == 80  # All leaves, and no wood.
    assert row["skeleton bytes"] < row["mesh bytes"] / 4
    assert row["wood RMS"] < 1e-3 and row["wood max"] < 1e-2
    assert row["stretch"] < 0.02 + row["own stretch"] and row["gap"] < row["own gap"] + 1e-3 * row["size"]
