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
    """Write a GLB of a tree that Blender's skin modifier makes, moved by the armature that Blender makes for it: each
    bone's rotation is keyed and has noise.
    """
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
    """Make a tree with four shapes, bent by wind from four sides, whose values are keyed."""
    rng = np.random.default_rng(seed)
    plant = grow(NODES, 2, 4.0, seed)
    tree = _tree(plant)
    _finish(tree, plant, rng)
    _bend(tree, rng)
    _save(path, bpy.ops.wm.alembic_export, start=1, end=FRAMES)


def grass(path: Path, seed: int, blades: int) -> None:
    """Write a GLB of `blades` blades of grass whose upper parts are displaced by a cloud texture that moves over
    them.
    """
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


def flower(path: Path, seed: int, whorls: int, petals: int) -> None:
    """Write a GLB of a flower that opens by shape keys, one for each of `whorls` whorls of `petals` petals. Faces are
    flat, so the GLB repeats a vertex for each face.
    """
    rng = np.random.default_rng(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rows, columns = 11, 7
    along, across = np.meshgrid(np.linspace(0, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    number = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)

    def petal(angle: float, size: float, opened: float, curl: float) -> np.ndarray:
        """Return the points (rows * columns, 3) of one petal at the azimuth `angle`, in radians. `opened`, 0 to 1,
        tells how far it leans outwards, and `curl`, in radians, adds to that lean towards the tip.
        """
        lean = np.radians(10 + 70 * opened) * along + np.radians(25) * opened + curl * along**2
        step = size / (rows - 1)
        out, up = np.cumsum(np.sin(lean) * step, axis=0), np.cumsum(np.cos(lean) * step, axis=0)
        wide = size * 0.45 * np.sin(np.pi * (0.08 + 0.88 * along)) * across
        cup = (0.35 - 0.3 * opened) * across**2 * size * 0.4 * along
        points = np.stack([0.04 + out - cup * np.cos(lean), wide, up + cup * np.sin(lean)], axis=-1).reshape(-1, 3)
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        return points @ turn.T

    places = [(whorl, 2 * np.pi * (k + 0.5 * whorl) / petals) for whorl in range(whorls) for k in range(petals)]
    sizes, curls = 1.0 + rng.normal(0, 0.06, len(places)), rng.normal(0, 0.1, len(places))

    def shape(opened: Sequence[float]) -> np.ndarray:
        parts = [
            petal(angle, size * (1 - 0.15 * whorl), opened[whorl], curl)
            for (whorl, angle), size, curl in zip(places, sizes, curls)
        ]
        return np.concatenate(parts)

    faces = np.concatenate([quads + len(number.ravel()) * k for k in range(len(places))])
    mesh = bpy.data.meshes.new("flower")
    mesh.from_pydata(shape([0.0] * whorls).tolist(), [], faces.tolist())
    thing = bpy.data.objects.new("flower", mesh)
    bpy.context.collection.objects.link(thing)
    thing.shape_key_add(name="Basis")
    for whorl in range(whorls):
        first = 5 + 18 * whorl + int(rng.integers(0, 8))
        for part, much in (("half", 0.45), ("open", 1.0)):
            key = thing.shape_key_add(name=f"{part} {whorl}")
            moved = shape([much if other == whorl else 0.0 for other in range(whorls)])
            key.data.foreach_set("co", moved.astype(np.float32).ravel())
            half = ((1, 0.0), (first, 0.0), (first + 25, 1.0), (first + 55, 0.0))
            for frame, value in half if part == "half" else ((1, 0.0), (first + 25, 0.0), (first + 55, 1.0)):
                key.value = value
                key.keyframe_insert("value", frame=frame)
    mesh.shade_flat()
    _save(path, bpy.ops.export_scene.gltf, export_format="GLB", export_yup=True)


def forest(path: Path, seed: int, trees: int, nodes: int) -> None:
    """Write a GLB of several trees beside each other, each an object with shapes and winds of its own."""
    rng = np.random.default_rng(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    side = int(np.ceil(np.sqrt(trees)))
    for number in range(trees):
        plant = grow(nodes, 2, 4.0 * rng.uniform(0.7, 1.3), seed + number)
        tree = _bark(plant, f"tree {number}")
        _finish(tree, plant, rng)
        _bend(tree, rng)
        row, column = divmod(number, side)
        tree.location = (1.6 * row + rng.normal(0, 0.3), 1.6 * column + rng.normal(0, 0.3), 0.0)
    _save(path, bpy.ops.wm.alembic_export, start=1, end=FRAMES)


def terrain(path: Path, seed: int, nodes: int, side: int) -> None:
    """Write a GLB of two meshes: a swaying tree, and ground that stands still."""
    rng = np.random.default_rng(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side, y_subdivisions=side, size=14.0)
    ground = bpy.context.object
    ground.name = "ground"
    hills = bpy.data.textures.new("hills", "CLOUDS")
    hills.noise_scale = 2.5
    push = ground.modifiers.new("hills", "DISPLACE")
    push.texture, push.strength = hills, 1.0
    bpy.ops.object.modifier_apply(modifier="hills")
    ground.data.shade_smooth()
    plant = grow(nodes, 2, 4.0, seed)
    tree = _bark(plant, "tree")
    _finish(tree, plant, rng)
    _bend(tree, rng)
    _save(path, bpy.ops.export_scene.gltf, export_format="GLB", export_yup=True)


def turntable(path: Path, seed: int, nodes: int) -> None:
    """Write a GLB of a swaying tree that stands on a table which turns once."""
    rng = np.random.default_rng(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    plant = grow(nodes, 2, 4.0, seed)
    tree = _bark(plant, "tree")
    _finish(tree, plant, rng)
    _bend(tree, rng)
    table = bpy.data.objects.new("table", None)
    bpy.context.collection.objects.link(table)
    tree.parent = table
    for frame, angle in ((1, 0.0), (FRAMES, 2 * np.pi)):
        table.rotation_euler = (0.0, 0.0, angle)
        table.keyframe_insert("rotation_euler", frame=frame)
    _save(path, bpy.ops.wm.alembic_export, start=1, end=FRAMES)


def cloth(path: Path, seed: int, width: float, rows: int, columns: int) -> None:
    """Write a GLB of a leaf that is simulated as cloth, held at its stalk, in wind and turbulence. The cloth has `rows`
    times `columns` vertices.
    """
    rng = np.random.default_rng(seed)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    along, across = np.meshgrid(np.linspace(0, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    half = width / 2 * np.sin(np.pi * (0.05 + 0.92 * along)) ** 0.7
    points = np.stack([along, half * across, 0.1 * np.abs(across) * half], axis=-1).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("leaf")
    mesh.from_pydata(points.tolist(), [], quads.tolist())
    leaf = bpy.data.objects.new("leaf", mesh)
    bpy.context.collection.objects.link(leaf)
    stalk = leaf.vertex_groups.new(name="stalk")
    stalk.add(number[:3].ravel().tolist(), 1.0, "REPLACE")
    blade = leaf.modifiers.new("cloth", "CLOTH")
    settings = blade.settings
    settings.quality, settings.vertex_group_mass = 10, stalk.name
    settings.mass, settings.air_damping = 0.3, 2.0
    settings.tension_stiffness = settings.compression_stiffness = settings.shear_stiffness = 40.0
    settings.bending_stiffness, settings.bending_damping = 8.0, 2.0
    blade.collision_settings.use_collision = blade.collision_settings.use_self_collision = False
    blade.point_cache.frame_start, blade.point_cache.frame_end = 1, FRAMES
    for kind, strength in (("WIND", 250.0), ("TURBULENCE", 120.0)):
        bpy.ops.object.effector_add(type=kind, location=(-2.0, *rng.normal(0, 0.5, 2)), rotation=(0.0, 1.3, 0.0))
        field = bpy.context.object.field
        field.strength, field.seed = strength, int(rng.integers(1, 100))
        if kind == "TURBULENCE":
            field.size, field.flow = 0.6, 0.0
        else:
            field.noise = 2.0
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    for frame in range(1, FRAMES + 1):  # The simulation runs from frame to frame; the export reads its cache.
        scene.frame_set(frame)
    bpy.ops.object.select_all(action="DESELECT")
    leaf.select_set(True)
    _save(path, bpy.ops.wm.alembic_export, start=1, end=FRAMES, selected=True)


def _bend(tree: Any, rng: np.random.Generator) -> None:
    """Add four shape keys to a tree, each bent by wind from another side, and key their values over the frames."""
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


def _z_up(points: np.ndarray) -> np.ndarray:
    return (points * [1, 1, -1])[:, [0, 2, 1]]


def _tree(plant: Plant) -> Any:
    """Return an empty scene with the skeleton of a tree under a skin modifier."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return _bark(plant, "tree")


def _bark(plant: Plant, name: str) -> Any:
    """Return a new Blender object in the scene: the skeleton of a plant under a skin modifier, which makes its bark."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(_z_up(plant.position).tolist(), plant.edges.tolist(), [])
    tree = bpy.data.objects.new(name, mesh)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.collection.objects.link(tree)
    bpy.context.view_layer.objects.active = tree
    tree.select_set(True)
    tree.modifiers.new("Skin", "SKIN")
    for skin, radius in zip(mesh.skin_vertices[0].data, plant.radius):
        skin.radius = 2 * (max(radius, 0.008),)
    mesh.skin_vertices[0].data[0].use_root = True
    return tree


def _finish(tree: Any, plant: Plant, rng: np.random.Generator, bones: Sequence[Any] = ()) -> None:
    """Turn a tree's skin modifier into a mesh, and add leaves that are weighted to the nearest of `bones`."""
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
    """Set keys of a property and put noise on its curve: `scale` in frames."""
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
