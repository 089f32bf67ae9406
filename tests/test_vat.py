"""Vertex animation textures: a shader that follows vat.md, or OpenVAT's layout, shows the level within the error that
the JSON states; written at any level and range of frames, and never half."""

from __future__ import annotations

import dataclasses
import json
import os

import numpy as np
import OpenEXR
import png
import pygltflib
import pytest
from plants import distance, plant
from test_gltf import accessor_of, leafy, leafy_ath  # noqa: F401, the fixtures too

import athcodec
from athcodec.decoding.clip_view import ClipView
from athcodec.errors import ClipError
from athcodec.exporters import openvat, vat, write
from athcodec.motion.clip import MotionClip
from athcodec.sources import read

pytestmark = pytest.mark.formats


def exr(path):
    """(height, width, channels) in the type of the file."""
    with OpenEXR.File(str(path)) as file:
        (pixels,) = (channel.pixels for channel in file.channels().values())
        return pixels


def png16(path):
    with open(path, "rb") as file:
        width, height, rows, info = png.Reader(file=file).read()
        assert info["bitdepth"] == 16 and info["planes"] == 3
        return np.vstack([np.asarray(row, np.uint16) for row in rows]).reshape(height, width, 3)


def mesh_of(path):
    """Attributes of the meshes of a GLB, one after the other, by pygltflib."""
    gltf = pygltflib.GLTF2().load(str(path))
    named = [vars(mesh.primitives[0].attributes) for mesh in gltf.meshes]
    return {
        name: np.concatenate([accessor_of(gltf, each[name]) for each in named])
        for name, index in named[0].items()
        if index is not None
    }


def shown_by_matrices(folder):
    """(T, N, 3): what a shader makes of a .vat folder, texel by texel as vat.md says, in float32."""
    (facts,) = (json.loads(path.read_text()) for path in folder.glob("*.json"))
    mesh, pivots = mesh_of(folder / facts["mesh"]), exr(folder / facts["pivots"])
    node, p = mesh["_NODE"][:, 0].astype(int), mesh["POSITION"]
    c = pivots[node // facts["nodes_per_row"], node % facts["nodes_per_row"]]
    frames = np.empty((facts["frames"], *p.shape), np.float32)
    for texture in facts["textures"]:
        texels = exr(folder / texture["file"])
        assert texels.shape == (facts["height"], facts["width"], 4)
        assert texels.dtype == {"half": np.float16, "float": np.float32}[facts["precision"]]
        for g in range(texture["frames"]):
            y = g * facts["rows_per_frame"] + node // facts["nodes_per_row"]
            for r in range(3):
                row = texels[y, 3 * (node % facts["nodes_per_row"]) + r].astype(np.float32)
                moved = p[:, r] + (row[:, :3] * (p - c)).sum(axis=1) + row[:, 3]
                frames[texture["first_frame"] + g, :, r] = moved
    return frames, facts, mesh


def shown_by_positions(folder, pixels):
    """(T, N, 3): what a shader makes of an .openvat folder: second texture coordinates, a step down per frame."""
    (path,) = folder.glob("*-remap_info.json")
    facts = json.loads(path.read_text())
    remap, (glb,) = facts["os-remap"], folder.glob("*_vat.glb")
    mesh, height = mesh_of(glb), pixels.shape[0]
    u, v = mesh["TEXCOORD_1"].T
    low, high = np.array(remap["Min"]), np.array(remap["Max"])
    frames = []
    for frame in range(remap["Frames"]):
        x, y = np.floor(u * pixels.shape[1]).astype(int), np.floor((v + frame / height) * height).astype(int)
        frames.append(mesh["POSITION"] + low + pixels[y, x] * (high - low))
    return np.array(frames), facts


@pytest.mark.parametrize("half", [True, False])
def test_a_shader_shows_every_level_within_the_stated_error(leafy_ath, tmp_path, half):  # noqa: F811
    with athcodec.open(leafy_ath) as decoder:
        for level in range(decoder.file.level_count):
            view = ClipView(decoder, level, range(3, 30))
            folder = tmp_path / f"{level}.vat"
            write(view, folder, half=half)
            frames, facts, _ = shown_by_matrices(folder)
            wanted, size = view.block(0, 27), float(np.linalg.norm(np.ptp(view.rest, axis=0)))
            assert distance(frames, wanted) == pytest.approx(facts["max_error"], rel=0.01, abs=1e-6 * size)
            rounding = 2e-3 * np.abs(wanted - view.rest).max() if half else 1e-6 * size
            assert facts["max_error"] <= max(view.max_error, 1e-5 * size) + rounding
            assert (facts["level"], facts["frames"], facts["start_frame"]) == (level, 27, 3)
            assert facts["level_max_error"] == view.max_error
            assert np.allclose(facts["bounds"]["min"], frames.min(axis=(0, 1)), atol=1e-5 * size)


def test_many_nodes_and_frames_wrap_into_more_rows_and_textures(tmp_path, monkeypatch):
    monkeypatch.setattr(vat, "PER_ROW", 5)
    monkeypatch.setattr(vat, "WIDEST", 16)
    clip = plant(seed=6, branches=17, frames=11)
    write(clip, tmp_path / "a.vat", half=False)
    frames, facts, mesh = shown_by_matrices(tmp_path / "a.vat")
    assert facts["nodes_per_row"] == 5 and facts["rows_per_frame"] >= 4 and len(facts["textures"]) >= 3
    assert max(facts["width"], facts["height"]) <= 16
    assert distance(frames, clip.block(0, 11)) <= facts["max_error"] + 1e-5
    x, y = (mesh["TEXCOORD_1"] * [facts["width"], facts["height"]]).T
    node = mesh["_NODE"][:, 0].astype(int)
    assert np.allclose(x, 3 * (node % 5) + 0.5, atol=1e-4) and np.allclose(y, node // 5 + 0.5, atol=1e-4)


@pytest.mark.parametrize("vertices, frames", [(63, 40), (5000, 30), (1, 1), (64, 1000)])
@pytest.mark.parametrize("half", [True, False])
def test_openvat_textures_show_every_position(tmp_path, vertices, frames, half):
    rng = np.random.default_rng(vertices)
    rest = rng.normal(size=(vertices, 3)).astype(np.float32)
    moved = rest + rng.normal(size=(frames, vertices, 3)).astype(np.float32) * np.float32([1, 0, 0.1])
    clip = MotionClip(positions=moved, time=np.arange(frames) / 24, rest=rest, metadata={"fps": 24.0, "start_frame": 7})
    write(clip, tmp_path / "a.openvat", half=half)
    pixels = png16(tmp_path / "a.openvat" / "a_vat.png") / 65535 if half else exr(tmp_path / "a.openvat" / "a_vat.exr")
    shown, facts = shown_by_positions(tmp_path / "a.openvat", pixels)
    assert pixels.shape[1] <= 4096 and not any(side & (side - 1) for side in pixels.shape[:2])
    stated = facts["athcodec"]["max_error"]
    assert distance(shown, moved) <= stated + 1e-6
    span = np.ptp(moved - rest, axis=(0, 1))
    assert stated <= (np.linalg.norm(span) / 65535 / 2 if half else 1e-6) + 1e-6
    assert (facts["athcodec"]["fps"], facts["athcodec"]["start_frame"]) == (24.0, 7)
    assert sorted(os.listdir(tmp_path / "a.openvat")) == sorted(
        ["a-remap_info.json", "a_vat.glb", "a_vat.png" if half else "a_vat.exr"]
    )


def test_the_mesh_is_the_rest_pose_with_all_that_does_not_move(leafy, tmp_path):  # noqa: F811
    for suffix, name in (("vat", "a.glb"), ("openvat", "a_vat.glb")):
        write(leafy, tmp_path / f"a.{suffix}")
        with read(tmp_path / f"a.{suffix}" / name) as back:
            assert back.frame_count == 1 and distance(back.block(0, 1)[0], leafy.rest) < 1e-5
            assert np.array_equal(back.faces, leafy.faces)
            assert np.array_equal(back.attributes["uv"], leafy.attributes["uv"])
            assert np.array_equal(back.vertex_branch, leafy.vertex_branch)


def test_what_exists_stays_and_what_fails_leaves_nothing(leafy, tmp_path, monkeypatch):  # noqa: F811
    (tmp_path / "a.vat").write_text("mine")
    (tmp_path / "a.openvat").mkdir()
    (tmp_path / "a.openvat" / "b").write_text("mine")
    with pytest.raises(FileExistsError, match="expected the name of a new folder"):
        write(leafy, tmp_path / "a.vat")
    with pytest.raises(OSError, match="got a directory"):
        write(leafy, tmp_path / "a.openvat")
    broken = dataclasses.replace(leafy, rest=leafy.rest.astype(np.float32))
    broken.positions = np.array(broken.positions)
    broken.positions[20] = np.nan
    monkeypatch.setattr(openvat, "HIGHEST", 16)
    for name, message in (("b.vat", "frame 20"), ("b.openvat", "choose fewer frames")):
        with pytest.raises(ClipError, match=message):
            write(broken, tmp_path / name)
    assert sorted(os.listdir(tmp_path)) == ["a.openvat", "a.vat"] and (tmp_path / "a.vat").read_text() == "mine"


def test_motion_beyond_half_precision_is_refused_and_float_holds_it(tmp_path):
    rest = np.zeros((4, 3), np.float32)
    clip = MotionClip(positions=np.stack([rest, rest + np.float32(1e6)]), time=np.arange(2.0), rest=rest)
    with pytest.raises(ClipError, match="half precision"):
        write(clip, tmp_path / "a.vat")
    write(clip, tmp_path / "a.vat", half=False)
    assert np.array_equal(shown_by_matrices(tmp_path / "a.vat")[0], clip.block(0, 2))
    assert os.listdir(tmp_path) == ["a.vat"]


def test_the_layout_that_the_json_points_to_is_installed(leafy, tmp_path):  # noqa: F811
    write(leafy, tmp_path / "a.vat")
    layout = json.loads((tmp_path / "a.vat" / "a.json").read_text())["layout"]
    installed = os.path.join(os.path.dirname(os.path.dirname(athcodec.__file__)), *layout.split("/"))
    with open(installed) as file:
        text = file.read()
    for key in ("nodes_per_row", "rows_per_frame", "first_frame", "max_error", "_NODE"):
        assert key in text
