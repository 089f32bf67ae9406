"""Instances of Blender: in whichever way it writes them, they are read as copies, where Blender shows them."""

from __future__ import annotations

import numpy as np
import pytest

import athcodec

pytestmark = pytest.mark.programs
UP_IS_Y = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
LEAF = """
fresh()
scene = bpy.context.scene
scene.render.fps = 24
scene.frame_start, scene.frame_end = 1, 4
mesh = bpy.data.meshes.new("leaf")
mesh.from_pydata([(0, 0, 0), (.3, 0, 0), (.4, .2, 0), (.3, .4, 0), (0, .4, 0)], [], [(0, 1, 2, 3, 4)])
leaf = bpy.data.objects.new("leaf", mesh)
def shown(frame):
    scene.frame_set(frame)
    points = []
    for each in bpy.context.evaluated_depsgraph_get().object_instances:
        if each.is_instance and each.object.type == "MESH":
            matrix = np.array(each.matrix_world)
            own = np.array([vertex.co for vertex in each.object.data.vertices])
            points.append(own @ matrix[:3, :3].T + matrix[:3, 3])
    return np.array(points)
"""
ON_POINTS = (
    LEAF
    + """
scene.collection.objects.link(leaf)
leaf.location = (0, 0, -9)
bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=2)
crown = bpy.context.object
crown.name = "crown"
for frame, z in (1, 0), (4, 2):
    crown.location, crown.rotation_euler = (0, 0, z), (0, 0, z / 3)
    crown.keyframe_insert("location", frame=frame)
    crown.keyframe_insert("rotation_euler", frame=frame)
group = bpy.data.node_groups.new("leaves", "GeometryNodeTree")
for way in "INPUT", "OUTPUT":
    group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
kinds = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo",
         "GeometryNodeJoinGeometry")
into, out, placed, info, joined = map(group.nodes.new, kinds)
info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = leaf, True
for a, b in ((into.outputs[0], placed.inputs["Points"]), (info.outputs["Geometry"], placed.inputs["Instance"]),
             (placed.outputs[0], joined.inputs[0]), (into.outputs[0], joined.inputs[0]),
             (joined.outputs[0], out.inputs[0])):
    group.links.new(a, b)
crown.modifiers.new("leaves", "NODES").node_group = group
bpy.ops.wm.usd_export(filepath=args["folder"] + "/a.usda", export_animation=True, use_instancing=True)
scene.frame_set(1)
bpy.ops.export_scene.gltf(filepath=args["folder"] + "/a.glb", export_gpu_instances=True, export_gn_mesh=True,
                          export_animations=False)
save(shown=[shown(frame) for frame in range(1, 5)])
"""
)
COLLECTION = (
    LEAF
    + """
leaves = bpy.data.collections.new("leaves")
leaves.objects.link(leaf)
for i in range(3):
    place = bpy.data.objects.new(f"place{i}", None)
    place.instance_type, place.instance_collection = "COLLECTION", leaves
    scene.collection.objects.link(place)
    for frame, z in (1, 0), (4, 2):
        place.location, place.rotation_euler = (i, 0, z), (0, 0, i + z)
        place.keyframe_insert("location", frame=frame)
        place.keyframe_insert("rotation_euler", frame=frame)
bpy.ops.wm.alembic_export(filepath=args["folder"] + "/a.abc", use_instancing=True, start=1, end=4)
save(shown=[shown(frame) for frame in range(1, 5)])
"""
)


def assert_shown(positions, shown):
    """Every instance is among the copies (frames, copies, vertices, 3), in any order, but the same in all frames."""
    first = shown[0].reshape(len(shown[0]), -1)
    places = np.abs(positions[0].reshape(len(positions[0]), 1, -1) - first).max(axis=2).argmin(axis=1)
    assert sorted(places) == list(range(shown.shape[1]))
    assert np.allclose(positions, shown[:, places], rtol=0, atol=1e-5)


def copies_of(clip, frames):
    """(frames, copies, vertices, 3) of the only object that is copies."""
    [number] = np.flatnonzero(clip.attributes["part_copies"] > 1)
    count, copies = int(clip.attributes["part_vertex_counts"][number]), int(clip.attributes["part_copies"][number])
    first = int(clip.attributes["part_vertex_counts"][:number].sum())
    return clip.block(0, frames)[:, first : first + count].reshape(frames, copies, -1, 3)


def test_instances_on_points_come_by_usd_and_by_gltf(blender, tmp_path):
    shown = blender.run(ON_POINTS, folder=tmp_path)["shown"]
    assert shown.shape == (4, 12, 5, 3)
    with athcodec.read(tmp_path / "a.usda", only=["*Grid", "*crown_base"]) as clip:
        assert clip.metadata["part_names"] == ["crown_base", "leaf"] and clip.polygons[0].tolist() == [4] * 6 + [5] * 12
        assert_shown(copies_of(clip, 4), shown)
    with athcodec.read(tmp_path / "a.glb") as clip:
        assert_shown(copies_of(clip, 1), shown[:1] @ UP_IS_Y)


def test_instances_of_a_collection_come_by_alembic(blender, tmp_path):
    shown = blender.run(COLLECTION, folder=tmp_path)["shown"]
    with athcodec.read(tmp_path / "a.abc") as clip:
        assert clip.metadata["part_names"] == ["leaf"] and clip.polygons[0].tolist() == [5] * 3
        assert_shown(copies_of(clip, 4), shown @ UP_IS_Y)
