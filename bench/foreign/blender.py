"""Trees that sway and grass that bends in Blender, as its exporters write them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from bench.trees.plant import Plant, grow

FRAMES, FPS = 120, 24
NODES, LEAVES = 110, 5  # Leaves: on each node that carries foliage.


def armature(path: Path, seed: int) -> None:
    """A tree of the skin modifier on the bones that Blender makes for it, each with noise on its keyed rotation."""
    rng = np.random.default_rng(seed)
    plant = grow(NODES, 2, 4.0, seed)
    tree = _tree(plant)
    bpy.ops.object.skin_armature_create(modifier="Skin")
    bones = bpy.context.object
    _finish(tree, plant, rng, bones.data.bones)
    for bone in bones.pose.bones:
        bone.rotation_mode = "XYZ"
        length = bone.bone.head_local.z
        for axis in (0, 2):
            _noise(bone, "rotation_euler", axis, 0.04 + 0.12 * length / 4.0, 15.0 + 20.0 * rng.random(), rng)
    _save(path, bpy.ops.export_scene.gltf, export_format="GLB", export_yup=True)


def shape_keys(path: Path, seed: int) -> None:
    """A tree with four shapes, bent by wind from four sides, whose values are keyed."""
    rng = np.random.default_rng(seed)
    plant = grow(NODES, 2, 4.0, seed)
    tree = _tree(plant)
    _finish(tree, plant, rng)
    points = np.array([vertex.co for vertex in tree.data.vertices])
    tree.shape_key_add(name="Basis")
    for side in range(4):
        key = tree.shape_key_add(name=f"wind {side}")
        wind = np.array([np.cos(side * np.pi / 2), np.sin(side * np.pi / 2), 0.0])
        reach = np.hypot(points[:, 0], points[:, 1])
        bend = 0.1 * np.maximum(points[:, 2], 0) ** 1.5 + 0.1 * reach * np.sin(3.0 * reach + side)
        moved = points + bend[:, None] * wind - np.array([0, 0, 0.02]) * (bend**2)[:, None]
        key.data.foreach_set("co", moved.astype(np.float32).ravel())
        key.slider_min = -1.0
        _noise(key, "value", -1, 1.0, 12.0 + 5 * side, rng)
    _save(path, bpy.ops.wm.alembic_export, start=1, end=FRAMES)


def grass(path: Path, seed: int, blades: int) -> None:
    """Blades whose upper parts are displaced by clouds that an empty carries over them."""
    rng = np.random.default_rng(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    levels = np.linspace(0, 1, 10)[:, None]
    foot = rng.uniform(-0.5, 0.5, (blades, 1, 3)) * [1, 1, 0]
    side = rng.normal(0, 0.004, (blades, 1, 3)) * [1, 1, 0] * np.sqrt(1 - levels)
    middle = foot + rng.uniform(0.25, 0.6, (blades, 1, 1)) * levels * [0, 0, 1]
    middle += levels**2 * rng.normal(0, 0.08, (blades, 1, 3)) * [1, 1, 0]
    points = np.concatenate([middle - side, middle + side], axis=1).reshape(-1, 3)
    faces = 20 * np.arange(blades)[:, None, None] + np.arange(9)[:, None] + [0, 10, 11, 1]
    mesh = bpy.data.meshes.new("grass")
    mesh.from_pydata(points.tolist(), [], faces.reshape(-1, 4).tolist())
    field, wind = bpy.data.objects.new("grass", mesh), bpy.data.objects.new("wind", None)
    group = field.vertex_groups.new(name="height")
    for vertex, height in enumerate(np.tile(levels[:, 0] ** 2, 2 * blades).tolist()):
        group.add([vertex], height, "REPLACE")
    for number, axis in enumerate("XY"):
        clouds = bpy.data.textures.new(f"gusts {axis}", "CLOUDS")
        clouds.noise_scale = 0.35 + 0.1 * number
        push = field.modifiers.new(axis, "DISPLACE")
        push.texture, push.direction, push.vertex_group = clouds, axis, group.name
        push.texture_coords, push.texture_coords_object, push.strength = "OBJECT", wind, 0.35
    for thing in (field, wind):
        bpy.context.collection.objects.link(thing)
    for frame, place in ((1, (0, 0, 0)), (FRAMES, (3.0, 1.0, 0.8))):
        wind.location = place
        wind.keyframe_insert("location", frame=frame)
    _save(path, bpy.ops.wm.usd_export, export_animation=True)


def _z_up(points: np.ndarray) -> np.ndarray:
    return (points * [1, 1, -1])[:, [0, 2, 1]]


def _tree(plant: Plant) -> Any:
    """An empty scene with the skeleton of a tree under a skin modifier."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("tree")
    mesh.from_pydata(_z_up(plant.position).tolist(), plant.edges.tolist(), [])
    tree = bpy.data.objects.new("tree", mesh)
    bpy.context.collection.objects.link(tree)
    bpy.context.view_layer.objects.active = tree
    tree.select_set(True)
    tree.modifiers.new("Skin", "SKIN")
    for skin, radius in zip(mesh.skin_vertices[0].data, plant.radius):
        skin.radius = 2 * (max(radius, 0.008),)
    mesh.skin_vertices[0].data[0].use_root = True
    return tree


def _finish(tree: Any, plant: Plant, rng: np.random.Generator, bones: Sequence[Any] = ()) -> None:
    """Make a mesh of the skin, with leaves that are weighted to the nearest bone."""
    bpy.context.view_layer.objects.active = tree
    tree.modifiers.new("Smooth", "SUBSURF").levels = 1
    tree.modifiers.move(tree.modifiers.find("Smooth"), 1)
    for name in ("Skin", "Smooth"):
        bpy.ops.object.modifier_apply(modifier=name)
    feet = np.repeat(_z_up(plant.position)[plant.foliage > 0], LEAVES, axis=0)
    along, across = rng.normal(size=(2, len(feet), 3)) * [[[0.1]], [[0.04]]] + [0, 0, 0.02]
    points = np.stack([feet, feet + along / 2 + across, feet + along, feet + along / 2 - across], 1)
    mesh = bpy.data.meshes.new("leaves")
    mesh.from_pydata(points.reshape(-1, 3).tolist(), [], np.arange(4 * len(feet)).reshape(-1, 4).tolist())
    leaves = bpy.data.objects.new("leaves", mesh)
    bpy.context.collection.objects.link(leaves)
    for leaf, foot in enumerate(feet.tolist() if bones else ()):
        nearest = min(bones, key=lambda bone: (bone.tail_local - Vector(foot)).length)
        group = leaves.vertex_groups.get(nearest.name) or leaves.vertex_groups.new(name=nearest.name)
        group.add(range(4 * leaf, 4 * leaf + 4), 1.0, "ADD")
    bpy.ops.object.select_all(action="DESELECT")
    leaves.select_set(True)
    tree.select_set(True)
    bpy.ops.object.join()
    tree.data.shade_smooth()


def _noise(owner: Any, where: str, index: int, strength: float, scale: float, rng: np.random.Generator) -> None:
    """Key a property and put noise on its curve: `scale` in frames."""
    for frame in (1, FRAMES):
        owner.keyframe_insert(where, index=index, frame=frame)
    block = owner.id_data.animation_data
    curve = block.action.layers[0].strips[0].channelbag(block.action_slot).fcurves[-1]
    noise = curve.modifiers.new("NOISE")
    noise.strength, noise.scale, noise.phase = strength, scale, rng.uniform(0, 1000)


def _save(path: Path, export: Any, **options: Any) -> None:
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, FRAMES, FPS
    export(filepath=str(path), **options)
