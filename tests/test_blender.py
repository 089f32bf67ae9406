"""The extension in Blender itself: what it plays is what the decoder gives, what it writes is what Blender shows."""

from __future__ import annotations

import json
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from test_gltf_motion import check_schemas, structure

import athcodec
from athcodec.blender import build

pytestmark = pytest.mark.formats

UP_IS_Z = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.float32)  # in the sample's file it is y

PLAY = """
fresh()
scene = bpy.context.scene
assert bpy.ops.import_scene.ath(filepath=args["ath"], level=args["level"], loop=args["loop"]) == {"FINISHED"}
obj = bpy.context.active_object
shown = []
for frame in args["frames"]:
    scene.frame_set(int(frame), subframe=frame - int(frame))
    points = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", points)
    shown.append(points.reshape(-1, 3))
save(shown=np.array(shown), world=world(obj.name), rate=scene.render.fps / scene.render.fps_base,
     range=[scene.frame_start, scene.frame_end], edges=len(obj.data.edges),
     names=[attribute.name for attribute in obj.data.attributes])
"""


@pytest.mark.programs
@pytest.mark.parametrize("level", [-1, 2, 0])
def test_the_sample_plays_as_the_decoder_has_it(extended_blender, sample_ath, level):
    frames = [1, 50, 119, 40, 7, 7.25]
    shown = extended_blender.run(PLAY, ath=sample_ath, level=level, loop=False, frames=frames)
    with athcodec.open(sample_ath) as decoder:
        shown_level = None if level < 0 else level
        first = decoder.positions(0, shown_level)
        start = int(shown["range"][0])
        for frame, positions in zip(frames, shown["shown"]):
            place = frame - start
            low = decoder.positions(int(place), shown_level)
            high = decoder.positions(int(place) + 1, shown_level) if place > int(place) else low
            expected = low + np.float32(place - int(place)) * (high - low)
            assert np.allclose(positions, expected, rtol=0, atol=1e-6)
        assert not np.array_equal(shown["shown"][1], first)
        assert shown["rate"] == pytest.approx(decoder.fps) and np.diff(shown["range"]) == decoder.frame_count - 1
        assert shown["edges"] == len(decoder.file.edges)
    assert {"radius", "vertex_branch"} <= set(shown["names"])
    assert np.allclose(shown["world"], shown["shown"][-1] @ UP_IS_Z, atol=1e-5)


@pytest.mark.programs
def test_speed_and_frame_offset_choose_the_frames_of_a_loop(extended_blender, sample_ath):
    script = PLAY.replace("shown = []", "shown = []\nobj.ath.speed = 2\nobj.ath.frame_offset = 11")
    shown = extended_blender.run(script, ath=sample_ath, level=-1, loop=True, frames=[11, 16, 71, 10])["shown"]
    with athcodec.open(sample_ath) as decoder:
        for positions, frame in zip(shown, (0, 10, 0, 118)):
            assert np.allclose(positions, decoder.positions(frame), rtol=0, atol=1e-6)


CLIPS = """
fresh()
scene = bpy.context.scene
scene.render.fps = 30
bpy.ops.import_scene.ath(filepath=args["ath"], set_scene=False)
first = bpy.context.active_object
bpy.ops.import_scene.ath(filepath=args["ath"], set_scene=False, clip=args["clip"])
second = bpy.context.active_object
assert (first.ath.clip, second.ath.clip) == ("calm", args["clip"]), (first.ath.clip, second.ath.clip)
first.ath.frame_offset = second.ath.frame_offset = 1
def positions(obj):
    points = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", points)
    return points.reshape(-1, 3)
shown = []
for frame in args["frames"]:
    scene.frame_set(int(frame), subframe=frame - int(frame))
    shown.append([positions(first), positions(second)])
from bl_ext.user_default.athcodec import player
names = player.clip_names(first)
first.ath.clip = "round"
changed = positions(first)
first.ath.clip = "no such"
problem = player.problem_of(first)
bpy.ops.wm.save_as_mainfile(filepath=args["blend"])
fresh()
bpy.ops.wm.open_mainfile(filepath=args["blend"])
save(shown=np.array(shown), names=names, changed=changed, problem=problem,
     kept=sorted(obj.ath.clip for obj in bpy.data.objects))
"""


@pytest.mark.programs
def test_objects_play_clips_of_one_file_by_name_and_loops_go_on(extended_blender, medley_ath, tmp_path):
    frames = [1, 6, 20, 20.5, 21, 26]
    found = extended_blender.run(CLIPS, ath=medley_ath, clip="Böe", frames=frames, blend=tmp_path / "a.blend")
    with athcodec.open(medley_ath) as decoder:
        calm, gust, loop = decoder.play("calm"), decoder.play("Böe"), decoder.play("round")
        seam = (calm.positions(19) + calm.positions(0)) / 2
        for (one, other), frame, expected in zip(
            found["shown"],
            frames,
            [calm.positions(0), calm.positions(5), calm.positions(19), seam, calm.positions(0), calm.positions(5)],
        ):
            assert np.allclose(one, expected, atol=1e-5)
            place = np.interp((frame - 1) / 30, gust.time - gust.time[0], np.arange(37))
            low, high = gust.positions(int(place)), gust.positions(min(int(place) + 1, 36))
            assert np.allclose(other, low + (place - int(place)) * (high - low), atol=1e-4)
        assert np.allclose(found["changed"], loop.positions(25), atol=1e-5)
    assert found["names"].tolist() == ["calm", "Böe", "still", "round"]
    assert "no such" in str(found["problem"]) and "calm" in str(found["problem"])
    assert found["kept"].tolist() == ["Böe", "no such"]


@pytest.mark.programs
def test_a_saved_blend_file_plays_after_it_was_moved(extended_blender, sample_ath, tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
        (folder / "tree.ath").write_bytes(Path(sample_ath).read_bytes())
    extended_blender.run(
        """
fresh()
bpy.ops.import_scene.ath(filepath=args["here"] + "/tree.ath", level=3)
bpy.ops.wm.save_as_mainfile(filepath=args["here"] + "/scene.blend")
assert bpy.context.active_object.ath.filepath == "//tree.ath", bpy.context.active_object.ath.filepath
bpy.ops.wm.save_as_mainfile(filepath=args["there"] + "/scene.blend")
assert bpy.context.active_object.ath.filepath.startswith("//../here/"), bpy.context.active_object.ath.filepath
""",
        here=here,
        there=there,
    )
    (there / "scene.blend").write_bytes((here / "scene.blend").read_bytes())
    (here / "tree.ath").unlink()
    shown = extended_blender.run(
        """
fresh()
bpy.ops.wm.open_mainfile(filepath=args["blend"])
obj = next(found for found in bpy.data.objects if found.ath.filepath)
bpy.context.scene.frame_set(33)
save(shown=world(obj.name), level=obj.ath.level, start=obj.ath.frame_offset)
""",
        blend=there / "scene.blend",
    )
    assert shown["level"] == 3
    with athcodec.open(sample_ath) as decoder:
        positions = decoder.positions(33 - int(shown["start"]), 3)
        assert np.allclose(shown["shown"], positions @ UP_IS_Z, atol=1e-5)


@pytest.mark.programs
def test_a_render_of_many_frames_sees_each(extended_blender, tmp_path):
    extended_blender.run(EXPORT, ath=tmp_path / "a.ath", options={})
    found = extended_blender.run(
        """
fresh()
bpy.ops.import_scene.ath(filepath=args["ath"])
obj, scene = bpy.context.active_object, bpy.context.scene
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
scene.camera, camera.location, camera.rotation_euler = camera, (2, -4, 10), (0.6, 0, 0)
scene.render.engine, scene.cycles.samples = "CYCLES", 4
scene.render.resolution_x = scene.render.resolution_y = 24
scene.render.film_transparent = True
scene.frame_start, scene.frame_end = 12, 28
scene.frame_step = 8
scene.render.filepath = args["out"]
bpy.ops.render.render(animation=True)
def pixels(name):
    return np.array(bpy.data.images.load(name).pixels[:]).reshape(24, 24, 4)[..., 3]
played = [pixels(f"{args['out']}{frame:04d}.png") for frame in (12, 20, 28)]
still = []
obj.ath.filepath = ""  # the same positions, in a mesh that nothing moves
import athcodec
decoder = athcodec.open(args["ath"])
for frame in (12, 20, 28):
    scene.frame_set(frame)
    obj.data.vertices.foreach_set("co", decoder.positions(frame - 11, dtype=np.float32).reshape(-1))
    obj.data.update()
    scene.render.filepath = args["out"] + f"still{frame}.png"
    bpy.ops.render.render(write_still=True)
    still.append(pixels(scene.render.filepath))
save(played=np.array(played), still=np.array(still))
""",
        ath=tmp_path / "a.ath",
        out=str(tmp_path / "frame"),
    )
    played = found["played"]
    assert all((image > 0).sum() > 20 for image in played)
    assert np.abs(np.diff(played, axis=0)).max() > 0.5
    assert np.allclose(played, found["still"], atol=0.02)


@pytest.mark.programs
def test_files_that_cannot_be_played_are_reported_and_stop_nothing(extended_blender, sample_ath, bushy_ath, tmp_path):
    (tmp_path / "bad.ath").write_bytes(b"no such thing")
    found = extended_blender.run(
        """
fresh()
try:
    bpy.ops.import_scene.ath(filepath=args["bad"])
except RuntimeError as error:
    said = str(error)
bpy.ops.import_scene.ath(filepath=args["ath"])
obj = bpy.context.active_object
from bl_ext.user_default.athcodec import player
obj.ath.filepath = args["other"]
other = player.problem_of(obj)
obj.ath.filepath = args["ath"] + ".none"
bpy.context.scene.frame_set(20)
gone = player.problem_of(obj)
obj.ath.filepath = args["ath"]
save(said=said, other=other, gone=gone, again=player.problem_of(obj), objects=len(bpy.data.objects))
""",
        bad=tmp_path / "bad.ath",
        ath=sample_ath,
        other=bushy_ath,
    )
    assert "bad.ath" in str(found["said"]) and "vertices" in str(found["other"])
    assert "none" in str(found["gone"]) and str(found["again"]) == "" and found["objects"] == 1


EXPORT = """
fresh()
scene = bpy.context.scene
scene.render.fps, scene.render.fps_base = 24, 1.001
scene.frame_start, scene.frame_end = 11, 30
bpy.ops.mesh.primitive_grid_add(x_subdivisions=9, y_subdivisions=7)
obj = bpy.context.active_object
obj.modifiers.new("wave", "WAVE").height = 0.4
obj.location = (1, 2, 3)
obj.keyframe_insert("location", frame=11)
obj.location = (2, 2, 1)
obj.keyframe_insert("location", frame=30)
layer = obj.data.attributes.new("vertex_branch", "INT", "POINT")
layer.data.foreach_set("value", [int(i >= 40) for i in range(len(obj.data.vertices))])
obj.data["ath_branch_parent"] = [-1, 0]
scene.frame_set(17)
assert bpy.ops.export_scene.ath(filepath=args["ath"], **args["options"]) == {"FINISHED"}
assert scene.frame_current == 17
shown = []
for frame in range(11, 31):
    scene.frame_set(frame)
    if args["options"].get("space") == "LOCAL":
        obj.location = (0, 0, 0)
        bpy.context.view_layer.update()
    shown.append(world(obj.name))
save(shown=np.array(shown), faces=[list(polygon.vertices) for polygon in obj.data.polygons])
"""


@pytest.mark.programs
@pytest.mark.parametrize(
    "options",
    [{}, {"bound": "LENGTH", "max_error": 0.01, "effort": "fast"}, {"space": "LOCAL"}, {"bound": "LOSSLESS"}],
    ids=["default", "length", "local", "lossless"],
)
def test_what_blender_shows_is_written_within_the_bound(extended_blender, tmp_path, options):
    found = extended_blender.run(EXPORT, ath=tmp_path / "a.ath", options=options)
    with athcodec.open(tmp_path / "a.ath", strict=True) as decoder:
        error = np.linalg.norm(decoder.positions().astype(float) - found["shown"], axis=2).max()
        assert error <= decoder.file.max_error_bound + 2e-6
        assert decoder.file.max_error_bound <= 0.01
        if options.get("bound") == "LOSSLESS":
            assert error < 2e-6  # as numpy multiplies the matrix
        assert np.array_equal(decoder.file.faces, found["faces"]) and "uv" in decoder.file.attributes
        assert decoder.metadata["start_frame"] == 11 and decoder.metadata["up_axis"] == "z"
        assert decoder.metadata["fps"] == pytest.approx(24000 / 1001)
        assert decoder.file.branch_parent.tolist() == [-1, 0]


@pytest.mark.programs
def test_meshes_without_branches_are_written_within_the_bound_too(extended_blender, tmp_path):
    script = EXPORT.replace('obj.data.attributes.new("vertex_branch"', 'obj.data.attributes.new("other"')
    found = extended_blender.run(script, ath=tmp_path / "a.ath", options={})
    with athcodec.open(tmp_path / "a.ath", strict=True) as decoder:
        error = np.linalg.norm(decoder.positions().astype(float) - found["shown"], axis=2).max()
        assert error <= decoder.file.max_error_bound + 2e-6


LEFT_OUT = """
fresh()
bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=3)
other = bpy.context.object
bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=3)
leaf = bpy.context.object
leaf.data.materials.append(bpy.data.materials.new("bark"))
leaf.data.uv_layers.new(name="second")
leaf.data.attributes.new("bend", "FLOAT", "EDGE")
other.select_set(True)
bpy.context.scene.frame_end = 3
import bl_ext.user_default.athcodec.exporter as exporter
summary = exporter.write_object(bpy.context, leaf, args["ath"], effort="fast")
save(attributes=summary.not_read["attribute"], materials=summary.not_read["material"])
named = exporter.left_out_of(bpy.context, summary)
assert named.startswith("object " + other.name) and "material bark" in named, named
"""


@pytest.mark.programs
def test_what_of_a_scene_is_not_written_is_named(extended_blender, tmp_path):
    found = extended_blender.run(LEFT_OUT, ath=str(tmp_path / "a.ath"))
    assert {"second", "bend"} <= set(found["attributes"]) and found["materials"].tolist() == ["bark"]


GLTF = """
fresh()
scene = bpy.context.scene
scene.render.fps, scene.frame_start, scene.frame_end = 24, 11, 30
bpy.ops.mesh.primitive_grid_add(x_subdivisions=9, y_subdivisions=7)
obj = bpy.context.active_object
obj.name = obj.data.name = "flag"
obj.modifiers.new("wave", "WAVE").height = 0.4
if args["subdivided"]:
    obj.modifiers.new("fine", "SUBSURF").levels = 1
obj.location = (1, 2, 3)
for number, name in enumerate(("bark", "green")):
    obj.data.materials.append(bpy.data.materials.new(name))
for polygon in obj.data.polygons:
    polygon.material_index = polygon.index % 2
    polygon.use_smooth = bool(polygon.index % 3)
bpy.ops.mesh.primitive_cube_add()
scene.frame_set(17)
scene.ath_gltf.use, scene.ath_gltf.rel_error = True, 1e-4
bpy.ops.export_scene.gltf(filepath=args["glb"], export_apply=args["apply"])
assert scene.frame_current == 17
shown = []
for frame in range(11, 31):
    scene.frame_set(frame)
    shown.append(world("flag"))
save(shown=np.array(shown))
"""


@pytest.mark.programs
@pytest.mark.parametrize("apply, subdivided", [(True, True), (True, False), (False, False)])
def test_blenders_gltf_has_the_motion_of_what_modifiers_move(extended_blender, tmp_path, apply, subdivided):
    path = tmp_path / "a.glb"
    shown = extended_blender.run(GLTF, glb=path, apply=apply, subdivided=subdivided)["shown"]
    gltf = pygltflib.GLTF2().load(str(path))
    [motion] = gltf.extensions["ATH_motion"]["motions"]
    assert (motion["name"], motion["clips"]) == ("flag", [{"name": "Scene", "start": 11 / 24}])
    assert gltf.extensionsUsed == ["ATH_motion"] and len(gltf.meshes) == 2
    [mesh] = [gltf.meshes[each.mesh] for each in gltf.nodes if each.name == "flag"]
    assert all("ATH_motion" in each.extensions for each in mesh.primitives) and len(mesh.primitives) == 2
    with athcodec.open(path) as decoder:
        assert decoder.clip.name == "Scene" and decoder.fps == 24
        positions = decoder.positions().astype(float) @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]] + [1, 2, 3]
        assert positions.shape == shown.shape
        error = np.linalg.norm(positions - shown, axis=2).max()
        assert error <= decoder.file.max_error_bound + 1e-6 < 1e-3
        assert len(decoder.file.faces) == 2 * (4 if subdivided else 1) * 9 * 7
    check_schemas(json.loads(json.dumps(structure(path))))


@pytest.mark.programs
def test_blenders_gltf_stays_as_it_was_where_no_motion_is_asked_for(extended_blender, tmp_path):
    script = GLTF.replace("scene.ath_gltf.use, scene.ath_gltf.rel_error = True, 1e-4", "")
    extended_blender.run(script, glb=tmp_path / "a.glb", apply=True, subdivided=False)
    gltf = structure(tmp_path / "a.glb")
    assert "extensionsUsed" not in gltf and "_ATH_VERTEX" not in json.dumps(gltf)


@pytest.mark.programs
def test_the_package_is_small(extended_blender):
    """But for wheels of others, which go in as they are."""
    with zipfile.ZipFile(extended_blender.folder / "athcodec-blender.zip") as package:
        ours = [member for member in package.infolist() if not member.filename.startswith("wheels/zstandard-")]
    assert 1e6 < sum(member.compress_size for member in ours) < 4.2e6


@pytest.mark.programs
def test_an_exported_mesh_is_imported_at_the_same_place(extended_blender, tmp_path):
    found = extended_blender.run(
        EXPORT
        + """
bpy.ops.import_scene.ath(filepath=args["ath"])
other, again = bpy.context.active_object, []
for frame in range(11, 31):
    scene.frame_set(frame)
    again.append(world(other.name))
save(shown=np.array(shown), again=np.array(again), faces=[list(polygon.vertices) for polygon in other.data.polygons],
     range=[scene.frame_start, scene.frame_end])
""",
        ath=tmp_path / "a.ath",
        options={},
    )
    assert np.abs(found["again"] - found["shown"]).max() < 2e-3 and found["range"].tolist() == [11, 30]


@pytest.mark.programs
def test_blender_accepts_the_package(extended_blender, tmp_path):
    folder = extended_blender.folder
    with zipfile.ZipFile(folder / "athcodec-blender.zip") as archive:
        manifest = archive.read("blender_manifest.toml").decode()
        assert f'version = "{athcodec.__version__}"' in manifest
        for name in archive.namelist():
            if name.startswith("wheels/"):
                assert f'"./{name}"' in manifest
    extended_blender.run(
        """
import subprocess
from pathlib import Path
tool = next(Path(bpy.utils.resource_path("LOCAL")).rglob("blender_ext.py"))
subprocess.run([sys.executable, str(tool), "validate", args["zip"], "--valid-tags="], check=True)
""",
        zip=folder / "athcodec-blender.zip",
    )


@pytest.mark.parametrize(
    "name, expected",
    [
        ("athcodec-1-py3-none-manylinux2014_x86_64.manylinux_2_17_x86_64.whl", "linux-x64"),
        ("athcodec-1-py3-none-win_amd64.whl", "windows-x64"),
        ("athcodec-1-py3-none-macosx_11_0_arm64.whl", "macos-arm64"),
    ],
)
def test_wheels_are_for_blenders_platforms(name, expected):
    assert build.platform(Path(name)) == expected


def test_a_package_holds_the_extension_and_its_wheels(tmp_path):
    wheels = [tmp_path / f"{name}-1.2.0-py3-none-win_amd64.whl" for name in ("athcodec", "zstandard")]
    for wheel in wheels:
        wheel.write_bytes(b"wheel")
    build.pack(tmp_path / "a.zip", wheels)
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        expected = {"__init__.py", "player.py", "blender_manifest.toml", f"wheels/{wheels[0].name}"}
        assert expected <= set(archive.namelist())
        manifest = archive.read("blender_manifest.toml").decode()
    assert 'version = "1.2.0"' in manifest and 'platforms = ["windows-x64"]' in manifest
    with pytest.raises(ValueError, match="expected one of athcodec"):
        build.pack(tmp_path / "b.zip", wheels[1:])


def test_packing_without_a_wheel_says_what_is_missing_and_how_to_make_it(tmp_path, capsys, monkeypatch):
    other = tmp_path / "zstandard-1-cp311-cp311-win_amd64.whl"
    strange = tmp_path / "athcodec-1-py3-none-any.whl"
    for wheel in (other, strange):
        wheel.write_bytes(b"wheel")
    make = "in a clone `pip wheel --no-deps -w dist .` makes dist/athcodec-*.whl for this platform"
    for wheels, message in (
        ([], f"wheels: got none, expected one of athcodec for each platform; {make}"),
        (["dist/athcodec-*.whl"], f"dist/athcodec-*.whl: there is no such wheel; {make}"),
        ([other], f"wheels: got {other.name}, expected one of athcodec for each platform; {make}"),
        ([strange], f"{strange.name}: got the platform any, expected one that Blender has"),
    ):
        with pytest.raises(SystemExit) as left:
            build.main([str(tmp_path / "a.zip"), *map(str, wheels)])
        assert left.value.code == 2 and capsys.readouterr().err.endswith(f"error: {message}\n")
    monkeypatch.setattr(build.subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], 1))
    own = tmp_path / "athcodec-1-py3-none-win_amd64.whl"
    own.write_bytes(b"wheel")
    with pytest.raises(SystemExit):
        build.main([str(tmp_path / "a.zip"), str(own)])
    err = capsys.readouterr().err
    assert "pip has no zstandard of Python 3.11 for win_amd64" in err and "pip download " in err
    assert not (tmp_path / "a.zip").exists()
