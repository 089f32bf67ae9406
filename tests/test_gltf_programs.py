"""glTF among the programs that people use: three.js and glTF-Transform write files that come in as three.js plays them,
and what is written passes Khronos' validator without a word and is played by three.js within the error it states.
Needs Node and npm; the packages are installed once, into pytest's cache. Run with -m programs."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from plants import distance
from programs import install_once, printed
from test_gltf import Maker, as_metres, crown, leafy, leafy_ath, seasons, seasons_ath  # noqa: F401, the fixtures too
from test_gltf_motion import structure
from test_vat import exr

import athcodec
from athcodec import MotionClip
from athcodec.decoding.clip_view import ClipView
from athcodec.exporters import write
from athcodec.motion.quaternions import quaternions
from athcodec.sources import read

pytestmark = pytest.mark.programs
SCRIPTS = Path(__file__).resolve().parent / "node"
PACKAGES = [f"@gltf-transform/{part}@4.5.1" for part in ("core", "extensions", "functions")]
PACKAGES += "three@0.187.0 gltf-validator@2.0.0-dev.3.10 meshoptimizer@1.3.0 esbuild@0.28.2".split()
PACKAGES += "@babylonjs/core@8.56.2 @babylonjs/loaders@8.56.2".split()


@pytest.fixture(scope="session")
def node(request):
    """Runs a script of the folder `node` with the packages beside it, and gives what it prints."""
    folder = Path(request.config.cache.mkdir("gltf_programs"))

    def install():
        (folder / "package.json").write_text('{"name": "checks", "private": true, "type": "module"}')
        printed("npm", "install", "--no-audit", "--no-fund", *PACKAGES, cwd=folder)
        for script in SCRIPTS.glob("*.mjs"):
            shutil.copy(script, folder)

    scripts = [hashlib.sha256(script.read_bytes()).hexdigest() for script in sorted(SCRIPTS.glob("*.mjs"))]
    install_once(folder, " ".join([*PACKAGES, *scripts]), install)

    def run(script, *words):
        return printed("node", folder / script, *words)

    return run


@pytest.fixture(scope="session")
def panda(request, tmp_path_factory):
    """A walking panda that people drew and rigged, as Panda3D moves it; see node/panda.py."""
    folder, package = Path(request.config.cache.mkdir("panda3d")), "panda3d==1.10.16"
    command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", folder, package]
    install_once(folder, package, lambda: printed(*command))
    out = tmp_path_factory.mktemp("panda") / "panda.npz"
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    printed(sys.executable, SCRIPTS / "panda.py", out, env=os.environ | {"PYTHONPATH": path})
    return dict(np.load(out))


@pytest.fixture
def played(node, tmp_path):
    """(T, N, 3) where three.js has the vertices of a GLB at some times, in all or one of its animations."""

    def play(path, times, *animation):
        (tmp_path / "times.json").write_text(json.dumps([float(t) for t in times]))
        facts = json.loads(node("play.mjs", path, tmp_path / "times.json", tmp_path / "out.bin", *animation))
        return np.fromfile(tmp_path / "out.bin", "<f4").reshape(len(times), facts["vertices"], 3)

    return play


@pytest.fixture
def three_file(node, tmp_path):
    """Skin, morph targets, steps, splines, instances; 25 frames at 24 per second."""
    node("write_three.mjs", tmp_path / "three.glb")
    return tmp_path / "three.glb"


def assert_valid(node, path):
    found = json.loads(node("validate.mjs", path))
    further = [
        message for message in found["messages"] if not (message.startswith("UNUSED_OBJECT") and "TEXCOORD" in message)
    ]
    assert (found["errors"], found["warnings"], further) == (0, 0, [])  # nothing is drawn with the textures' places


@pytest.mark.parametrize("fps", [None, 30, 100])
def test_what_three_writes_moves_as_three_plays_it(three_file, played, fps):
    with read(three_file, fps=fps) as clip:
        positions = clip.block(0, clip.frame_count)
        assert clip.metadata["fps"] == (fps or 24) and clip.metadata["part_names"] == ["stem", "leaf", "twin"]
        assert clip.skin.joint_parent.tolist() == [-1, 0, 1, 2, 3, -1, -1]
        assert distance(positions, played(three_file, clip.time)) < 1e-5


@pytest.mark.parametrize("form, error", [("quantize", 1e-5), ("sparse", 1e-5), ("meshopt", 1e-3)])
def test_other_forms_by_gltf_transform_move_as_three_plays_them(three_file, node, played, tmp_path, form, error):
    # Quantised rotations are not quite of length 1, which three.js does not mend.
    node("transform.mjs", three_file, tmp_path / "form.glb", form)
    with read(tmp_path / "form.glb") as clip:
        assert distance(clip.block(0, 25), played(tmp_path / "form.glb", clip.time)) < error


def test_files_beside_each_other_by_gltf_transform_are_the_same_clip(three_file, node, tmp_path):
    node("transform.mjs", three_file, tmp_path / "a.gltf", "separate")
    assert (tmp_path / "a.bin").exists()
    with read(three_file) as one, read(tmp_path / "a.gltf") as other:
        assert np.array_equal(one.block(0, 25), other.block(0, 25)) and np.array_equal(one.faces, other.faces)


@pytest.mark.parametrize("animation", ["joints", "morphs"])
def test_what_is_written_is_valid_and_three_plays_it_within_the_stated_error(
    animation, leafy_ath, node, played, tmp_path
):
    path = tmp_path / "a.glb"
    with athcodec.open(leafy_ath) as decoder:
        for level in range(decoder.file.level_count):
            view = ClipView(decoder, level, range(4, 30))
            write(view, path, animation=animation)
            assert_valid(node, path)
            stated = structure(path)["asset"]["extras"]["athcodec"]["max_error"]
            shown = played(path, view.time - view.time[0])
            assert distance(shown, view.block(0, 26)) <= stated + 1e-5


def test_a_rig_is_valid_and_three_plays_it_within_the_stated_error(leafy_ath, node, played, tmp_path):
    path = tmp_path / "a.glb"
    with athcodec.open(leafy_ath) as decoder:
        view = ClipView(decoder)
        stated = write(view, path, rig=300).facts["max_error"]
        assert_valid(node, path)
        assert distance(played(path, view.time - view.time[0]), view.block(0, view.frame_count)) <= stated + 1e-5


@pytest.mark.parametrize("animation", ["joints", "morphs"])
def test_copies_are_valid_and_three_plays_them_within_the_stated_error(animation, node, played, tmp_path):
    clip, path = crown(), tmp_path / "a.glb"
    stated = write(clip, path, animation=animation, instances=True).facts["max_error"]
    assert_valid(node, path)
    assert distance(played(path, clip.time), as_metres(clip)[:, 30:]) <= stated / 100 + 1e-6, "the stem is lines"


def test_copies_that_stand_still_are_instances_for_three(node, played, tmp_path):
    clip, path = crown(moving=False), tmp_path / "a.glb"
    stated = write(clip, path, instances=True).facts["max_error"]
    found = json.loads(node("validate.mjs", path))
    notes = {message.partition(" ")[0] for message in found["messages"]}
    assert found["errors"] == found["warnings"] == 0 and notes <= {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"}
    assert distance(played(path, [0]), as_metres(clip, 1)[:, 30:]) <= stated / 100 + 1e-6


@pytest.mark.parametrize("animation", ["joints", "morphs"])
def test_three_lists_clips_by_name_and_plays_each_within_the_stated_error(
    animation, seasons, seasons_ath, node, played, tmp_path
):
    path = tmp_path / "a.glb"
    with athcodec.open(seasons_ath) as decoder:
        write(ClipView(decoder, all_clips=True), path, animation=animation)
        assert_valid(node, path)
        (tmp_path / "none.json").write_text("[]")
        listed = json.loads(node("play.mjs", path, tmp_path / "none.json", tmp_path / "none.bin"))["animations"]
        assert listed == list(seasons)
        stated = structure(path)["asset"]["extras"]["athcodec"]["max_error"]
        for name in seasons:
            one = decoder.play(name)
            assert distance(played(path, one.time - one.time[0], name), one.positions()) <= stated + 1e-5
        calm = decoder.play("calm")
        ends = played(path, [0, len(calm.time) / calm.fps, (len(calm.time) - 0.5) / calm.fps], "calm")
        assert distance(ends[1], ends[0]) < 1e-6, "what is repeated goes on without a jump"
        between = (calm.positions(0) + calm.positions(-1)) / 2
        assert distance(ends[2], between) < 0.1 * distance(calm.positions(0), calm.positions(-1)) + stated


def test_a_clip_goes_from_three_through_ath_and_back_to_three(three_file, node, played, tmp_path):
    with read(three_file) as clip:
        flat = read_as_one_branch(clip)
        athcodec.encode(flat, tmp_path / "a.ath", rel_error=1e-4)
    before = played(three_file, np.arange(25) / 24)
    with athcodec.open(tmp_path / "a.ath") as decoder:
        write(ClipView(decoder), tmp_path / "b.glb", animation="morphs")
        assert_valid(node, tmp_path / "b.glb")
        assert distance(played(tmp_path / "b.glb", np.arange(25) / 24), before) <= decoder.file.max_error_bound + 1e-5


def read_as_one_branch(clip):
    return clip.replace(vertex_branch=np.zeros(clip.vertex_count, np.int32), branch_parent=np.array([-1]))


def test_lines_points_objects_and_colours_are_valid_too(leafy, node, tmp_path):
    with athcodec.read_hdf5(athcodec.sample_path()) as sample:
        write(sample, tmp_path / "lines.glb", animation="joints")
        write(sample.replace(edges=None), tmp_path / "points.glb")
    counts = np.array([leafy.vertex_count])
    objects = leafy.replace(
        attributes=leafy.attributes | {"part_vertex_counts": counts},
        metadata=leafy.metadata | {"part_names": ["bush"], "unit": "cm", "up_axis": "z"},
    )
    write(objects, tmp_path / "objects.glb", animation="joints")
    for name in ("lines", "points", "objects"):
        assert_valid(node, tmp_path / f"{name}.glb")


@pytest.mark.parametrize("half", [True, False])
def test_three_loads_the_textures_of_matrices_and_their_mesh_is_valid(leafy_ath, node, tmp_path, half):
    with athcodec.open(leafy_ath) as decoder:
        write(ClipView(decoder), tmp_path / "a.vat", half=half)
        write(ClipView(decoder), tmp_path / "a.openvat")
    for glb in (tmp_path / "a.vat" / "a.glb", tmp_path / "a.openvat" / "a_vat.glb"):
        assert_valid(node, glb)
    for name in ("a_matrices_0.exr", "a_pivots.exr"):
        size = json.loads(node("exr.mjs", tmp_path / "a.vat" / name, tmp_path / "out.bin"))
        texels = np.fromfile(tmp_path / "out.bin", "<f4").reshape(size["height"], size["width"], 4)[::-1]
        pixels = exr(tmp_path / "a.vat" / name)
        assert np.array_equal(texels[..., : pixels.shape[2]], pixels)


def rigged(panda, path):
    """The panda as a skin with keys of its joints, made with pygltflib."""
    made = Maker()
    mesh = made.mesh(
        {
            "POSITION": made.array(panda["rest"]),
            "JOINTS_0": made.array(panda["joints"]),
            "WEIGHTS_0": made.array(panda["weights"]),
        },
        "panda",
        indices=panda["faces"].ravel(),
    )
    times, matrices = np.arange(len(panda["matrices"])) / panda["fps"], panda["matrices"]
    joints = [made.node() for _ in range(matrices.shape[1])]
    turns = quaternions(matrices[..., :3, :3])
    made.animation(
        [(node, "translation", times, matrices[:, i, :3, 3], "LINEAR") for i, node in enumerate(joints)]
        + [(node, "rotation", times, turns[:, i], "LINEAR") for i, node in enumerate(joints)],
        "walk",
    )
    made.gltf.skins.append(pygltflib.Skin(joints=joints))
    made.node(mesh=mesh, skin=0)
    return made.save(path)


def test_an_animal_that_people_rigged_walks_as_panda3d_and_three_walk_it(panda, played, tmp_path):
    path, size = rigged(panda, tmp_path / "panda.glb"), np.linalg.norm(np.ptp(panda["rest"], axis=0))
    with read(path) as clip:
        positions = clip.block(0, clip.frame_count)
        assert clip.metadata["fps"] == 30 and np.array_equal(clip.faces, panda["faces"])
        assert distance(positions, panda["positions"]) < 1e-4 * size  # Panda3D's matrices are rigid to 1e-5
        assert distance(positions[::10], played(path, clip.time[::10])) < 1e-6 * size


def test_an_animal_goes_through_ath_and_is_played_within_the_bound(panda, node, played, tmp_path):
    with read(rigged(panda, tmp_path / "panda.glb")) as clip:
        athcodec.encode(read_as_one_branch(clip), tmp_path / "a.ath", rel_error=1e-4)
        wanted, times = clip.block(0, clip.frame_count), clip.time
    with athcodec.open(tmp_path / "a.ath") as decoder:
        for animation in ("joints", "morphs"):
            write(ClipView(decoder), tmp_path / "b.glb", animation=animation)
            assert_valid(node, tmp_path / "b.glb")
            stated = structure(tmp_path / "b.glb")["asset"]["extras"]["athcodec"]["max_error"]
            shown = played(tmp_path / "b.glb", times[::10])
            assert distance(shown, wanted[::10]) <= decoder.file.max_error_bound + stated + 1e-6 * np.abs(wanted).max()


@pytest.mark.parametrize("bound", [1e-3, 1e-4])
def test_an_animal_without_its_joints_is_smaller_than_by_pca(panda, tmp_path, bound):
    """Against principal components of all trajectories, tuned, with the same entropy coder and corrections."""
    from bench.codecs import Source
    from bench.codecs.pca import GlobalPca

    positions = panda["positions"].astype(np.float32)
    clip = MotionClip(positions, np.arange(len(positions)) / 30, faces=panda["faces"])
    ours = athcodec.encode(clip, tmp_path / "panda.ath", rel_error=bound, attributes="none").bytes
    source = Source(MotionClip(positions, clip.time, np.zeros(positions.shape[1], int), np.array([-1])))
    assert ours < len(GlobalPca().encode(source, bound * source.diagonal))
