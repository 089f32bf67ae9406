"""Point caches that are written move a mesh in Blender as the clip moves, and files that Blender writes are read."""

from __future__ import annotations

import numpy as np
import pytest
from files import coded
from moving_meshes import assert_same_mesh, on_one_branch, quad_clip
from programs import blender_python, run_script

import athcodec
from athcodec.decoding.clip_view import ClipView

pytestmark = pytest.mark.programs

START = """
import sys, struct, numpy as np, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = 24
scene.frame_start, scene.frame_end = 1, 6

def points(thing, frame):
    scene.frame_set(frame)
    mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    found = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", found)
    return found.reshape(-1, 3)
"""

MOVED_BY_CACHE = (
    START
    + """
folder, kind, how = sys.argv[1:]
bpy.ops.wm.obj_import(filepath=folder + "/tree.obj", forward_axis="Y", up_axis="Z")
tube, = bpy.data.objects
cache = tube.modifiers.new("cache", "MESH_CACHE")
cache.cache_format, cache.filepath, cache.interpolation = kind, folder + "/tree." + kind.lower(), "NONE"
cache.frame_start = 1
cache.play_mode, cache.time_mode = ("SCENE", "FRAME") if how == "frame" else ("CUSTOM", "TIME")
motion = []
for frame in range(1, 7):
    cache.eval_time = frame / 24
    motion.append(points(tube, frame))
np.save(folder + "/moved.npy", np.array(motion))
np.save(folder + "/faces.npy", np.array([list(face.vertices) for face in tube.data.polygons]))
"""
)

MADE_BY_BLENDER = (
    START
    + """
folder, = sys.argv[1:]
bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=5)
ball = bpy.context.object
bend = ball.modifiers.new("bend", "SIMPLE_DEFORM")
bend.deform_method = "BEND"
bend.angle = 0.0
bend.keyframe_insert("angle", frame=1)
bend.angle = 1.5
bend.keyframe_insert("angle", frame=6)
axes = dict(forward_axis="Y", up_axis="Z")
bpy.ops.wm.obj_export(filepath=folder + "/ball.obj", export_animation=True, start_frame=1, end_frame=6, **axes)
for frame in range(1, 7):
    scene.frame_set(frame)
    bpy.ops.wm.ply_export(filepath=folder + "/ball_%03d.ply" % frame, export_uv=False, **axes)
np.save(folder + "/moved.npy", np.array([points(ball, frame) for frame in range(1, 7)]))
np.save(folder + "/corners.npy", np.array([v for face in ball.data.polygons for v in face.vertices]))
"""
)


@pytest.mark.parametrize("kind, how", [("PC2", "frame"), ("MDD", "frame"), ("MDD", "seconds")])
def test_blender_moves_as_the_file_decodes(tmp_path, kind, how):
    clip = quad_clip()
    with coded(on_one_branch(clip), tmp_path / "coded.ath", rel_error=1e-4) as decoder:
        athcodec.write(ClipView(decoder), tmp_path / f"tree.{kind.lower()}")
        decoded, bound = decoder.positions(slice(0, 6)), decoder.file.max_error_bound
    run_script(blender_python(), MOVED_BY_CACHE, tmp_path, kind, how)
    moved = np.load(tmp_path / "moved.npy")
    assert np.abs(moved - decoded).max() < 1e-6
    assert np.linalg.norm(moved.astype(float) - clip.block(0, 6), axis=2).max() < bound + 1e-6
    assert np.array_equal(np.load(tmp_path / "faces.npy"), clip.faces)


def test_numbered_files_of_blender_are_read(tmp_path):
    run_script(blender_python(), MADE_BY_BLENDER, tmp_path)
    wanted, corners = np.load(tmp_path / "moved.npy"), np.load(tmp_path / "corners.npy")
    names = sorted(path.name for path in tmp_path.glob("ball*.obj"))
    with athcodec.read(tmp_path / names[2], fps=24) as clip:
        assert clip.metadata["start_frame"] == 1 and clip.frame_count == 6
        assert np.abs(clip.block(0, 6) - wanted).max() < 1e-6
        assert np.array_equal(clip.polygons[1], corners) and clip.metadata["domains"]["uv"] == "corner"
        athcodec.write(clip, tmp_path / "again.ply")
        with athcodec.read(tmp_path / "again_0001.ply", fps=24) as again:
            assert_same_mesh(again, clip)


def test_ply_files_of_blender_are_read(tmp_path):
    run_script(blender_python(), MADE_BY_BLENDER, tmp_path)
    wanted = np.load(tmp_path / "moved.npy")
    with athcodec.read(tmp_path / "ball_002.ply", fps=24) as clip:
        assert clip.vertex_count == wanted.shape[1] and np.abs(clip.block(0, 6) - wanted).max() < 1e-6
