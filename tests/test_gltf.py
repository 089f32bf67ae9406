"""glTF in and out: files that other libraries write come in as the motion that the specification means, what is written
is opened by others and keeps within the error that it states, and broken files are refused in one line."""

from __future__ import annotations

import dataclasses
import json
import os

import numpy as np
import pygltflib
import pytest
import trimesh
from glb import COMPONENTS, TYPES, accessor_of, glb, posed
from moving_meshes import survives_damage
from plants import distance, plant, turns

import athcodec
from athcodec.cli import main
from athcodec.decoding.clip_view import ClipView
from athcodec.errors import ClipError, GuessWarning, SourceWarning
from athcodec.exporters import gltf as gltf_exporter
from athcodec.exporters import write
from athcodec.exporters.fitting import allowed_error
from athcodec.motion.clip import ClipRange, MotionClip
from athcodec.sources import read

pytestmark = pytest.mark.formats

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], np.float32)


class Maker:
    """A glTF file made with pygltflib: arrays become accessors, one buffer view each."""

    def __init__(self):
        self.gltf = pygltflib.GLTF2(scenes=[pygltflib.Scene(nodes=[])], scene=0)
        self.data = b""

    def array(self, values, normalized=False, stride=0):
        values = np.asarray(values)
        values = values.astype(np.float32) if values.dtype == np.float64 else values
        rows = values.reshape(len(values), -1)
        data = np.ascontiguousarray(rows).tobytes()
        if stride:
            padded = np.zeros((len(rows), stride), np.uint8)
            padded[:, : rows.itemsize * rows.shape[1]] = np.frombuffer(data, np.uint8).reshape(len(rows), -1)
            data = padded.tobytes()
        return self.accessor(self.view(data, stride), values.dtype, rows.shape, normalized=normalized)

    def view(self, data, stride=0):
        self.gltf.bufferViews.append(
            pygltflib.BufferView(buffer=0, byteOffset=len(self.data), byteLength=len(data), byteStride=stride or None)
        )
        self.data += data + bytes(-len(data) % 4)
        return len(self.gltf.bufferViews) - 1

    def accessor(self, view, dtype, shape, **more):
        kind = {"componentType": COMPONENTS[np.dtype(dtype).name], "type": TYPES[shape[1]]}
        self.gltf.accessors.append(pygltflib.Accessor(bufferView=view, count=shape[0], **kind, **more))
        return len(self.gltf.accessors) - 1

    def mesh(self, attributes, name=None, indices=None, mode=4, targets=None, weights=None):
        indices = None if indices is None else self.array(np.asarray(indices, np.uint16))
        named = pygltflib.Attributes(**attributes)
        primitive = pygltflib.Primitive(attributes=named, indices=indices, mode=mode, targets=targets)
        self.gltf.meshes.append(pygltflib.Mesh(primitives=[primitive], name=name, weights=weights))
        return len(self.gltf.meshes) - 1

    def node(self, parent=None, **values):
        self.gltf.nodes.append(pygltflib.Node(**values))
        index = len(self.gltf.nodes) - 1
        (self.gltf.scenes[0].nodes if parent is None else self.gltf.nodes[parent].children).append(index)
        return index

    def animation(self, channels, name=None):
        """channels: (node, path, times, values, interpolation)."""
        animation = pygltflib.Animation(name=name, samplers=[], channels=[])
        for node, path, times, values, interpolation in channels:
            width = {"rotation": 4, "weights": 1}.get(path, 3)
            output = self.array(np.asarray(values, np.float32).reshape(-1, width))
            animation.samplers.append(
                pygltflib.AnimationSampler(
                    input=self.array(np.asarray(times, np.float32)), output=output, interpolation=interpolation
                )
            )
            target = pygltflib.AnimationChannelTarget(node=node, path=path)
            animation.channels.append(pygltflib.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))
        self.gltf.animations.append(animation)

    def save(self, path):
        self.gltf.buffers = [pygltflib.Buffer(byteLength=len(self.data))]
        self.gltf.set_binary_blob(self.data)
        self.gltf._path = path.parent
        if path.suffix == ".gltf":
            self.gltf.convert_buffers(
                pygltflib.BufferFormat.BINFILE if "bin" in path.stem else pygltflib.BufferFormat.DATAURI
            )
        self.gltf.save(str(path))
        return path


def moving_cube(channels, **node):
    made = Maker()
    mesh = made.mesh({"POSITION": made.array(CUBE)}, "cube", mode=0)
    made.node(mesh=mesh, **node)
    if channels:
        made.animation(channels)
    return made


def frames_of(path, **options):
    with read(path, **options) as clip:
        return clip.block(0, clip.frame_count), clip


def about(axis, angle):
    """Quaternion and matrix of a turn."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return [*(np.sin(angle / 2) * axis), np.cos(angle / 2)], turns(angle * axis)


# ---- reading ----


def test_instances_on_the_gpu_are_read_as_copies_and_what_is_not_read_is_named(tmp_path):
    made = Maker()
    corners = [0, 1, 2, 1, 3, 2]
    shape = {
        "POSITION": made.array(CUBE),
        "_AGE": made.array(np.arange(8.0)),
        "TEXCOORD_1": made.array(np.zeros((8, 2))),
    }
    mesh = made.mesh(shape, "leaf", indices=corners)
    turned = [about([0, 0, 1], angle) for angle in (0.1, 0.2, 0.3)]
    shifts, sizes = np.array([[1, 2, 3], [4, 5, 6], [7, 8, 9.0]]), np.array([[1, 1, 1], [2, 2, 2], [1, 2, 3.0]])
    parts = {
        "TRANSLATION": made.array(shifts),
        "ROTATION": made.array([quaternion for quaternion, _ in turned]),
        "SCALE": made.array(sizes),
        "_ID": made.array(np.arange(3.0)),
    }
    made.node(mesh=made.mesh({"POSITION": made.array(CUBE)}, "trunk", indices=corners))
    node = made.node(mesh=mesh, name="leaves", extensions={"EXT_mesh_gpu_instancing": {"attributes": parts}})
    made.gltf.extensionsUsed = made.gltf.extensionsRequired = ["EXT_mesh_gpu_instancing"]
    made.gltf.materials.append(pygltflib.Material(name="bark"))
    made.animation([(node, "translation", [0, 1], [[0, 0, 0], [3, 0, 0]], "LINEAR")])
    positions, clip = frames_of(made.save(tmp_path / "a.glb"), fps=1)
    assert clip.attributes["part_copies"].tolist() == [1, 3]
    assert clip.attributes["part_vertex_counts"].tolist() == [8, 24]
    for frame in range(2):
        expected = [(CUBE * size) @ turn.T + shift for size, (_, turn), shift in zip(sizes, turned, shifts)]
        assert np.allclose(positions[frame, 8:], np.concatenate(expected) + [3 * frame, 0, 0], rtol=0, atol=1e-5)
    assert clip.faces.tolist() == [
        [a + 8 * i, b + 8 * i, c + 8 * i] for i in range(4) for a, b, c in ((0, 1, 2), (1, 3, 2))
    ]
    assert np.array_equal(clip.attributes["age"][8:], np.tile(np.arange(8), 3))
    assert clip.not_read == {"Material": ["bark"], "attribute": ["leaves.TEXCOORD_1"]}
    assert clip.attributes["id"][8:].tolist() == [0] * 8 + [1] * 8 + [2] * 8
    with read(tmp_path / "a.glb") as clip:
        assert np.array_equal(athcodec.find_branches(clip).vertex_branch, np.repeat([0, 1, 2, 3], 8))


def test_what_trimesh_writes_is_read_where_trimesh_puts_it(tmp_path):
    scene, box = trimesh.Scene(), trimesh.creation.box((1, 2, 3))
    turn = trimesh.transformations.euler_matrix(0.3, 0.5, 0.7)
    turn[:3, 3] = 4, 5, 6
    scene.add_geometry(box, node_name="one", geom_name="box")
    scene.add_geometry(box, node_name="two", geom_name="box", transform=turn)
    scene.add_geometry(trimesh.creation.icosphere(1), node_name="ball", geom_name="ball", parent_node_name="two")
    scene.export(str(tmp_path / "a.glb"))
    positions, clip = frames_of(tmp_path / "a.glb")
    assert sorted(clip.metadata["part_names"]) == ["ball", "one", "two"] and clip.frame_count == 1
    loaded = trimesh.load(str(tmp_path / "a.glb"))
    stops = np.cumsum(clip.attributes["part_vertex_counts"])
    for name, stop, count in zip(clip.metadata["part_names"], stops, clip.attributes["part_vertex_counts"]):
        matrix, geometry = loaded.graph[name]
        mesh = loaded.geometry[geometry].copy()
        mesh.apply_transform(matrix)
        assert np.allclose(positions[0, stop - count : stop], mesh.vertices, atol=1e-6)
        mine = clip.faces[(clip.faces[:, 0] < stop) & (clip.faces[:, 0] >= stop - count)] - (stop - count)
        assert np.array_equal(mine, mesh.faces)
    assert clip.skin.joint_parent.tolist().count(-1) == 2  # "ball" hangs on "two"


def test_keys_are_interpolated_as_the_specification_says(tmp_path):
    (q0, _), (q1, _) = about([0, 0, 1], 0.0), about([0, 0, 1], 2.0)
    cubic = [[[0, 0, 0], [0, 0, 0], [3, 0, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 0]]]
    channels = {
        "LINEAR": (0, "rotation", [0, 1], [q0, [-v for v in q1]], "LINEAR"),
        "STEP": (0, "translation", [0, 0.5, 1], [[0, 0, 0], [5, 0, 0], [7, 0, 0]], "STEP"),
        "CUBICSPLINE": (0, "translation", [0, 1], np.array(cubic), "CUBICSPLINE"),
    }
    t = np.arange(11) / 10
    found = {
        name: frames_of(moving_cube([channel]).save(tmp_path / f"{name}.glb"), fps=10)[0]
        for name, channel in channels.items()
    }
    turned = np.stack([CUBE @ about([0, 0, 1], 2 * angle)[1].T for angle in t])
    assert np.allclose(found["LINEAR"], turned, atol=1e-6)
    assert np.allclose(found["STEP"][:, 0, 0], np.select([t < 0.5, t < 1], [0, 5], 7))
    spline = (t**3 - 2 * t**2 + t) * 3 + 3 * t**2 - 2 * t**3
    assert np.allclose(found["CUBICSPLINE"][:, 0, 0], spline, atol=1e-6)


def test_skins_move_vertices_by_their_weights_and_ignore_their_own_node(tmp_path):
    made = Maker()
    joints = np.tile(np.array([[0, 1, 0, 0]], np.uint8), (8, 1))
    share = np.linspace(0, 255, 8).astype(np.uint8)
    weights = np.stack([255 - share, share, 0 * share, 0 * share], axis=1)
    mesh = made.mesh(
        {
            "POSITION": made.array(CUBE),
            "JOINTS_0": made.array(joints),
            "WEIGHTS_0": made.array(weights, normalized=True),
        },
        "skinned",
        mode=0,
    )
    first = made.node(name="root", translation=[1.0, 0.0, 0.0])
    second = made.node(first, name="tip", translation=[0.0, 2.0, 0.0])
    bind = np.stack([np.eye(4), np.eye(4)])
    bind[1, 3, 1] = -2  # column by column
    made.gltf.skins.append(pygltflib.Skin(joints=[first, second], inverseBindMatrices=made.array(bind.reshape(2, 16))))
    made.node(mesh=mesh, skin=0, translation=[100.0, 0.0, 0.0])
    q, matrix = about([0, 0, 1], np.pi / 2)
    made.animation([(second, "rotation", [0, 1], [[0, 0, 0, 1], q], "LINEAR")])
    positions, clip = frames_of(made.save(tmp_path / "a.glb"), fps=1)
    w = share[:, None] / 255
    turned = (CUBE - [0, 2, 0]) @ matrix.T + [1, 2, 0]
    assert np.allclose(positions[1], (1 - w) * (CUBE + [1, 0, 0]) + w * turned, atol=1e-6)
    assert np.allclose(clip.rest, CUBE + [1, 0, 0])
    assert clip.skin.joint_parent.tolist() == [-1, 0] and tuple(clip.skin.names) == ("root", "tip")
    assert np.array_equal(clip.skin.vertex_joint, (share > 127).astype(int))


def test_morph_targets_are_added_also_sparse_ones(tmp_path):
    made = Maker()
    dense = made.array(np.full((8, 3), 0.25))
    rows = made.view(np.array([1, 6], np.uint8).tobytes())
    numbers = made.view(np.array([[1, 2, 3], [4, 5, 6]], np.float32).tobytes())
    sparse = pygltflib.Sparse(
        count=2,
        indices=pygltflib.AccessorSparseIndices(bufferView=rows, componentType=5121),
        values=pygltflib.AccessorSparseValues(bufferView=numbers),
    )
    made.accessor(None, np.float32, (8, 3), sparse=sparse)
    mesh = made.mesh(
        {"POSITION": made.array(CUBE)},
        mode=0,
        weights=[0.0, 0.5],
        targets=[pygltflib.Attributes(POSITION=dense), pygltflib.Attributes(POSITION=dense + 1)],
    )
    node = made.node(mesh=mesh)
    made.animation([(node, "weights", [0, 1], [0.0, 1.0, 4.0, 0.0], "LINEAR")])
    positions, clip = frames_of(made.save(tmp_path / "a.glb"), fps=2)
    few = np.zeros((8, 3))
    few[1], few[6] = (1, 2, 3), (4, 5, 6)
    expected = [CUBE + a * 0.25 + b * few for a, b in ((0, 1), (2, 0.5), (4, 0))]
    assert np.allclose(positions, expected, atol=1e-6)
    assert np.allclose(clip.rest, CUBE + 0.5 * few)


def test_quantised_and_strided_positions_mean_the_same(tmp_path):
    made = Maker()
    made.gltf.extensionsUsed = made.gltf.extensionsRequired = ["KHR_mesh_quantization"]
    whole = np.round(CUBE / 3 * 65535).astype(np.uint16)
    for values in (
        made.array(whole, normalized=True, stride=8),
        made.array(CUBE, stride=20),
        made.array(np.round(CUBE).astype(np.int8), stride=4),
    ):
        made.node(mesh=made.mesh({"POSITION": values}, mode=0), scale=[3.0] * 3 if values == 0 else None)
    positions, clip = frames_of(made.save(tmp_path / "a.glb"))
    assert np.allclose(positions[0].reshape(3, 8, 3), CUBE, atol=1e-4) and len(clip.metadata["part_names"]) == 3


@pytest.mark.parametrize(
    "mode, corners, rows",
    [
        (1, [0, 1, 2, 3], [[0, 1], [2, 3]]),
        (2, [0, 1, 2], [[0, 1], [1, 2], [2, 0]]),
        (3, [0, 1, 2], [[0, 1], [1, 2]]),
        (4, [0, 1, 2, 3, 4, 5], [[0, 1, 2], [3, 4, 5]]),
        (5, [0, 1, 2, 3, 4], [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (5, [0, 1, 2, 2, 3, 4], [[0, 1, 2], [2, 4, 3]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
    ],
)
def test_every_kind_of_primitive_becomes_faces_or_edges(tmp_path, mode, corners, rows):
    made = Maker()
    made.node(mesh=made.mesh({"POSITION": made.array(CUBE)}, indices=corners, mode=mode))
    _, clip = frames_of(made.save(tmp_path / "a.glb"))
    found, other = (clip.edges, clip.faces) if mode < 4 else (clip.faces, clip.edges)
    assert found.tolist() == rows and other is None
    assert clip.metadata["part_kinds"] == ["curves" if mode < 4 else "mesh"]


def test_attributes_keep_their_names_and_numbers(tmp_path):
    made = Maker()
    ids, colors = np.arange(8, dtype=np.uint16) * 500, np.array([[255, 0, 51]] * 8, np.uint8)
    first = made.mesh(
        {
            "POSITION": made.array(CUBE),
            "TEXCOORD_0": made.array(CUBE[:, :2]),
            "COLOR_0": made.array(colors, normalized=True, stride=4),
            "_BRANCH_ID": made.array(ids, stride=4),
            "_radius": made.array(CUBE[:, 1]),
            "NORMAL": made.array(np.tile([0.0, 0, 1], (8, 1))),
        },
        mode=0,
    )
    made.node(mesh=first, rotation=about([1, 0, 0], np.pi / 2)[0])
    made.node(mesh=made.mesh({"POSITION": made.array(CUBE)}, mode=0))
    _, clip = frames_of(made.save(tmp_path / "a.glb"))
    found = clip.attributes
    assert np.array_equal(found["uv"], np.concatenate([CUBE[:, :2], 0 * CUBE[:, :2]]))
    assert np.allclose(found["colors"], np.concatenate([colors / 255, np.ones((8, 3))]))
    assert found["branch_id"].dtype == np.uint16 and found["branch_id"].tolist() == [*ids, *[0] * 8]
    assert np.array_equal(found["radius"][:8], CUBE[:, 1]) and np.isnan(found["radius"][8:]).all()
    assert np.allclose(found["normals"][:8], [0, -1, 0], atol=1e-6)
    made.animation([(0, "translation", [0, 1], np.zeros((2, 3)), "LINEAR")])
    assert "normals" not in frames_of(made.save(tmp_path / "b.glb"))[1].attributes


@pytest.mark.parametrize(
    "fps, times",
    [
        (24, np.arange(20) / 24),
        (30, np.arange(2, 40) / 30),
        (60, np.arange(7) / 60),
        (25, np.arange(90) / 25),
        (24000 / 1001, np.arange(200) * 1001 / 24000),
        (30000 / 1001, np.arange(64) * 1001 / 30000),
        (24, np.delete(np.arange(100), [3, 4, 50, 51, 52]) / 24),
        (12.5, np.arange(20) / 12.5),
    ],
)
def test_sampled_keys_come_back_one_per_frame(tmp_path, fps, times):
    values = np.zeros((len(times), 3), np.float32)
    values[:, 0] = np.arange(len(times)) ** 2
    path = moving_cube([(0, "translation", times, values, "STEP")]).save(tmp_path / "a.glb")
    positions, clip = frames_of(path)
    places = np.round((times - times[0]) * fps).astype(int)
    assert clip.metadata["fps"] == pytest.approx(fps, rel=1e-12) and clip.frame_count == places[-1] + 1
    assert clip.metadata["start_frame"] == round(times[0] * fps)
    assert np.allclose(clip.time, np.arange(len(clip.time)) / fps, rtol=1e-12)
    assert np.array_equal(positions[places, 0, 0], values[:, 0])


def test_sparse_keys_are_sampled_at_30_or_as_asked(tmp_path):
    path = moving_cube([(0, "translation", [0, 1.234, 1.238, 3], np.eye(4)[:, 1:], "LINEAR")]).save(tmp_path / "a.glb")
    with pytest.warns(
        GuessWarning, match="2 of 4 key times lie between frames at 30 per second, .*; --fps 500 has a frame at each"
    ):
        clip = frames_of(path)[1]
    assert clip.metadata["fps"] == 30 and clip.frame_count == 91
    with read(path, fps=24000 / 1001) as clip:
        assert clip.metadata["fps"] == 24000 / 1001 and clip.frame_count == 72
    with pytest.raises(ClipError, match="expected at most"):
        read(path, fps=1e9)


@pytest.mark.parametrize("takes", [["flips"], "all"])
def test_a_mesh_that_turns_inside_out_in_a_single_frame_of_any_clip_is_named(tmp_path, takes):
    made = Maker()
    mesh = made.mesh({"POSITION": made.array(CUBE)}, "leaf", [0, 1, 2, 4, 5, 6])
    node = made.node(mesh=mesh)
    scales = np.ones((5, 3))
    made.animation([(node, "scale", range(5), scales, "LINEAR")], "still")
    scales[2, 0] = -1
    made.animation([(node, "scale", range(5), scales, "LINEAR")], "flips")
    path = made.save(tmp_path / "a.glb")
    with pytest.warns(SourceWarning, match="not read: faces that turn inside out in time leaf"):
        read(path, fps=1, takes=takes).close()


def test_animations_of_different_nodes_run_together_and_takes_do_not(tmp_path):
    made = moving_cube([(0, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]], "LINEAR")], name="a")
    made.gltf.animations[0].name = "walk"
    made.node(mesh=0, name="b")
    made.animation([(1, "translation", [0, 1], [[0, 0, 0], [0, 1, 0]], "LINEAR")], "wave")
    made.animation([(0, "translation", [0, 1], [[0, 0, 0], [0, 0, 9]], "LINEAR")], "jump")
    path = made.save(tmp_path / "a.glb")
    positions, clip = frames_of(path, fps=1)
    assert clip.metadata["animations"] == ["walk", "wave"]
    assert np.allclose(positions[1] - positions[0], np.repeat([[1, 0, 0], [0, 1, 0]], 8, axis=0))
    jumped, clip = frames_of(path, fps=1, only=["animation:ju*", "a"])
    assert clip.vertex_count == 8 and clip.metadata["part_names"] == ["a"]
    assert np.allclose(jumped[1] - jumped[0], [0, 0, 9])
    for only, message in (
        (["leaf*"], "expected names such as [^\\[]*$"),
        (["animation:run"], "expected one of .*walk"),
    ):
        with pytest.raises(ClipError, match=message):
            read(path, only=only)


def with_takes(path):
    """A cube whose animations are called walk, walk, nothing and turn, the last with a loop in its extras."""
    made = moving_cube([(0, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]], "LINEAR")], name="a")
    made.gltf.animations[0].name = "walk"
    made.animation([(0, "translation", [0, 2], [[0, 0, 0], [0, 2, 0]], "LINEAR")], "walk")
    made.animation([(0, "scale", [0, 1], np.ones((2, 3)), "LINEAR")])
    turns = [about([0, 1, 0], angle)[0] for angle in np.linspace(0, 2 * np.pi, 5)]
    made.animation([(0, "rotation", np.arange(5) / 2, turns, "LINEAR")], "turn")
    made.gltf.animations[3].extras = {"loop": True}
    return made.save(path)


def test_takes_are_clips_of_their_own(tmp_path):
    path = with_takes(tmp_path / "a.glb")
    with read(path, fps=2, takes="all") as clip:
        assert [(clip_range.name, clip_range.frame_count, clip_range.loop) for clip_range in clip.clip_ranges] == [
            ("walk", 3, False),
            ("walk.1", 5, False),
            ("animation 2", 3, False),
            ("turn", 4, True),
        ]
        found = {name: part.block(0, part.frame_count) for name, part in athcodec.split(clip).items()}
        assert np.array_equal(clip.block(0, 15), np.concatenate(list(found.values())))
        assert np.allclose(found["walk"][2], CUBE + [1, 0, 0]) and np.allclose(found["walk.1"][4], CUBE + [0, 2, 0])
        assert np.allclose(found["turn"][1], CUBE @ about([0, 1, 0], np.pi / 2)[1].T, atol=1e-6)
    for takes in (["turn"], ["tu*"], "turn"):
        with read(path, fps=2, takes=takes) as clip:
            assert np.array_equal(clip.block(0, 4), found["turn"]) and clip.clip_ranges[0].name == "turn"
    with read(path, fps=2) as clip:
        assert np.array_equal(clip.block(0, 3), found["walk"]) and clip.clip_ranges == ()
        assert clip.metadata["other_animations"] == ["walk.1", "animation 2", "turn"]
    with pytest.raises(ClipError, match="takes: got run, expected one of .*turn"):
        read(path, takes=["run"])
    with pytest.raises(ClipError, match="takes: got only animation:turn too"):
        read(path, takes=["walk"], only=["animation:turn"])


@pytest.mark.parametrize("rest", ["auto", "first", "mean"])
def test_all_takes_have_the_same_rest_pose(tmp_path, rest):
    with read(with_takes(tmp_path / "a.glb"), takes="all", rest=rest) as clip:
        expected = {"auto": CUBE, "first": clip.block(0, 1)[0], "mean": CUBE + [0.5, 0, 0]}[rest]
        assert np.allclose(clip.rest, expected, atol=1e-6)


def test_a_loop_ends_before_its_first_frame_comes_again(tmp_path):
    """At the keys' rate, at another whose frames do not fit, and where the end is no repetition."""
    path = with_takes(tmp_path / "a.glb")
    for fps, frames, rate in ((2, 4, 2), (8, 16, 8), (0.8, 2, 1)):
        with read(path, fps=fps, takes="turn") as clip:
            assert (clip.frame_count, clip.fps, clip.clip_ranges[0].loop) == (frames, rate, True)
    gltf = pygltflib.GLTF2().load(str(path))
    gltf.animations[0].extras = {"loop": True}
    gltf.save(str(path))
    with read(path, fps=2) as clip:
        assert (clip.frame_count, clip.clip_ranges[0].loop) == (3, True)


@pytest.mark.parametrize("name", ["a.glb", "bin.gltf", "data.gltf"])
def test_buffers_may_be_inside_beside_or_in_the_text(tmp_path, name):
    positions, _ = frames_of(moving_cube(None).save(tmp_path / name))
    assert np.array_equal(positions[0], CUBE)


def test_a_glb_chunk_that_is_not_aligned_is_followed_where_it_ends(tmp_path):
    for spaces in range(4):
        (tmp_path / "a.glb").write_bytes(glb(cube_json(), CUBE.tobytes(), spaces))
        assert np.array_equal(frames_of(tmp_path / "a.glb")[0][0], CUBE)


def test_what_animation_pointers_say_of_a_node_is_played_like_its_own_channels(tmp_path):
    moved = np.float32([[0, 0, 0], [1, 2, 3]])
    turned = np.float32([[0, 0, 0, 1], [0, 0, 1, 0]])
    channels = [(0, "translation", [0, 1], moved, "LINEAR"), (0, "rotation", [0, 1], turned, "LINEAR")]
    made = moving_cube([*channels, (0, "scale", [0, 1], moved + 1, "STEP")])
    plain, _ = frames_of(made.save(tmp_path / "plain.glb"), fps=4)
    for channel in made.gltf.animations[0].channels:
        pointer = {"pointer": f"/nodes/0/{channel.target.path}"}
        channel.target = pygltflib.AnimationChannelTarget(path="pointer", extensions={"KHR_animation_pointer": pointer})
    pointed, _ = frames_of(made.save(tmp_path / "pointed.glb"), fps=4)
    assert len(plain) == 5 and np.array_equal(pointed, plain)


def cube_json(**changes):
    parts = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 96}],
        "buffers": [{"byteLength": 96}],
    }
    return parts | changes


ACCESSOR = {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}
SPARSE = {"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {}}
REFUSED = {
    "version 1": ({"asset": {"version": "1.0"}}, "version"),
    "no meshes": ({"nodes": [{}]}, "expected at least one"),
    "a cycle": ({"nodes": [{"mesh": 0, "children": [1]}, {"children": [0]}]}, "node"),
    "a child twice": ({"nodes": [{"children": [1, 1]}, {"mesh": 0}]}, "node 0 has child 1"),
    "a node beyond": ({"scenes": [{"nodes": [7]}]}, "node 7"),
    "too many": ({"accessors": [ACCESSOR | {"count": 2**20}]}, "fits into"),
    "too many zeros": ({"accessors": [{"componentType": 5126, "count": 2**20, "type": "VEC3"}]}, "without bytes"),
    "too many vertices": ({"accessors": [ACCESSOR | {"count": 2**50}]}, "vertices, expected at most"),
    "a view too long": (
        {"bufferViews": [{"buffer": 0, "byteLength": 2**50}], "accessors": [ACCESSOR | {"count": 9000}]},
        "buffer of 96",
    ),
    "sparse values nowhere": ({"accessors": [ACCESSOR | {"sparse": SPARSE}]}, "got index None"),
    "a type": ({"accessors": [ACCESSOR | {"type": "VEC9"}]}, "VEC9"),
    "a fraction": ({"accessors": [ACCESSOR | {"count": 7.5}]}, "7.5"),
    "no number": ({"nodes": [{"mesh": "0"}]}, "'0'"),
    "a buffer elsewhere": ({"buffers": [{"byteLength": 96, "uri": "../../secret.bin"}]}, "beside the glTF"),
    "a buffer on the net": ({"buffers": [{"byteLength": 96, "uri": "https://a.b/c.bin"}]}, "beside the glTF"),
    "no base64": ({"buffers": [{"byteLength": 96, "uri": "data:;base64,$$"}]}, "base64"),
    "draco": ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "KHR_draco_mesh_compression"),
    "instancing": ({"nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}}]}, "attributes: got None"),
    "joints missing": ({"nodes": [{"mesh": 0, "skin": 0}], "skins": [{"joints": [0]}]}, "JOINTS_0"),
    "nesting": ({"extras": json.loads("[" * 900 + "]" * 900)}, None),
}


@pytest.mark.parametrize("changes, message", REFUSED.values(), ids=REFUSED)
def test_inconsistent_structures_are_refused_by_name(tmp_path, changes, message):
    path = tmp_path / "a.glb"
    path.write_bytes(glb(cube_json(**changes), CUBE.tobytes()))
    if message is None:
        assert np.array_equal(frames_of(path)[0][0], CUBE)
        return
    with pytest.raises(ClipError, match=message) as caught:
        read(path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


def rich_file(path):
    """Skin, morphs, lines, colours, several animations."""
    made = Maker()
    joints, weights = np.zeros((8, 4), np.uint8), np.tile([[0.5, 0.5, 0, 0]], (8, 1))
    joints[:, 1] = 1
    made.node(name="root")
    made.node(0, translation=[0.0, 1.0, 0.0])
    bind = made.array(np.stack([np.eye(4)] * 2).reshape(2, 16))
    made.gltf.skins.append(pygltflib.Skin(joints=[0, 1], inverseBindMatrices=bind))
    target = pygltflib.Attributes(POSITION=made.array(CUBE))
    mesh = made.mesh(
        {"POSITION": made.array(CUBE), "JOINTS_0": made.array(joints), "WEIGHTS_0": made.array(weights)},
        indices=np.arange(6),
        targets=[target],
    )
    made.node(mesh=mesh, skin=0)
    made.node(mesh=made.mesh({"POSITION": made.array(CUBE), "COLOR_0": made.array(CUBE / 3)}, indices=[0, 1], mode=1))
    t = np.arange(5) / 24
    made.animation(
        [(1, "rotation", t, np.tile([0.0, 0, 0, 1], (5, 1)), "LINEAR"), (2, "weights", t, np.linspace(0, 1, 5), "STEP")]
    )
    return made.save(path)


@pytest.mark.parametrize("make, options", [(rich_file, {}), (with_takes, {"takes": "all"})])
def test_cut_and_changed_files_are_refused_or_read(tmp_path, make, options):
    path = make(tmp_path / "a.glb")
    refused = survives_damage(path, lambda: read(path, **options), cuts=120, changes=400)
    assert 250 < refused < 500


# ---- writing ----


def with_faces(clip, **metadata):
    """Triangles along the branches, attributes of all kinds."""
    rows = np.arange(clip.vertex_count - 2)
    kept = clip.vertex_branch[rows] == clip.vertex_branch[rows + 2]
    faces = np.stack([rows, rows + 1, rows + 2], axis=1)[kept]
    attributes = {
        "radius": np.linspace(1, 2, clip.vertex_count),
        "species": np.arange(clip.vertex_count) % 300,
        "uv": clip.rest[:, :2].astype(np.float32),
        "colors": np.full((clip.vertex_count, 4), 0.5, np.float32),
        "normals": np.tile(np.float32([0, 0, 1]), (clip.vertex_count, 1)),
        "per_branch": np.arange(3.0),
    }
    metadata = {"unit": "m", "up_axis": "y", "fps": 30, "start_frame": 0} | metadata
    return clip.replace(faces=faces, attributes=attributes, rest=clip.rest.astype(np.float32), metadata=metadata)


@pytest.fixture(scope="module")
def leafy():
    return with_faces(plant(seed=3, branches=14, longest=9, frames=40, amount=0.3, rough=0.0))


@pytest.fixture(scope="module")
def leafy_ath(leafy, tmp_path_factory):
    path = tmp_path_factory.mktemp("leafy") / "a.ath"
    return athcodec.encode(leafy, path, rel_error=1e-4).path


def facts_of(path):
    return pygltflib.GLTF2().load(str(path)).asset.extras


def test_joints_keep_the_error_that_the_file_states_at_every_level(leafy_ath, tmp_path):
    with athcodec.open(leafy_ath) as decoder:
        for level in range(decoder.file.level_count):
            view = ClipView(decoder, level)
            path = tmp_path / f"{level}.glb"
            write(view, path, animation="joints")
            facts = facts_of(path)["athcodec"]
            shown = view.block(0, view.frame_count)
            gltf = pygltflib.GLTF2().load(str(path))
            worst = max(distance(posed(gltf, i), shown[i]) for i in range(view.frame_count))
            assert worst == pytest.approx(facts["max_error"], rel=1e-3, abs=1e-6)
            assert worst <= max(view.max_error, 1e-5 * np.linalg.norm(np.ptp(view.rest, axis=0)))
            assert facts["level"] == level and facts["joints"] >= decoder.levels[level].nodes


def test_a_clip_through_ath_and_glb_keeps_the_bound(leafy, leafy_ath, tmp_path):
    with athcodec.open(leafy_ath) as decoder:
        bound = decoder.file.max_error_bound
        for animation, more in (("joints", 1.1 * bound), ("morphs", 1e-6), ("auto", 1.1 * bound)):
            write(ClipView(decoder), tmp_path / "a.glb", animation=animation)
            positions, clip = frames_of(tmp_path / "a.glb")
            assert distance(positions, leafy.block(0, 40)) <= bound + more
            assert clip.time == pytest.approx(leafy.time - leafy.time[0], abs=1e-9)


def test_what_does_not_move_survives(leafy, tmp_path):
    for animation in ("joints", "morphs"):
        write(leafy, tmp_path / "a.glb", animation=animation)
        with read(tmp_path / "a.glb", rest="auto") as clip:
            assert np.array_equal(clip.faces, leafy.faces)
            assert np.array_equal(clip.vertex_branch, leafy.vertex_branch)
            assert np.array_equal(clip.branch_parent, leafy.branch_parent)
            assert distance(clip.rest, leafy.rest) < 1e-5
            for name in ("radius", "species", "uv", "colors"):
                assert np.array_equal(clip.attributes[name], leafy.attributes[name].astype(clip.attributes[name].dtype))
        assert facts_of(tmp_path / "a.glb")["athcodec"]["left_out"] == ["per_branch"]


def test_axes_and_units_are_turned_by_a_node_and_vertices_keep_their_numbers(tmp_path):
    clip = with_faces(plant(seed=1, frames=5), unit="cm", up_axis="z")
    positions = clip.block(0, 5)
    expected = np.stack([positions[..., 0], positions[..., 2], -positions[..., 1]], axis=-1) / 100
    for animation, error in (("joints", 2e-4), ("morphs", 1e-8)):
        write(clip, tmp_path / "a.glb", animation=animation)
        gltf = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
        first = accessor_of(gltf, gltf.meshes[0].primitives[0].attributes.POSITION)
        assert np.array_equal(first, clip.rest.astype(np.float32))
        found, back = frames_of(tmp_path / "a.glb")
        assert distance(found, expected) < error * np.ptp(expected)
        assert (back.metadata["unit"], back.metadata["up_axis"]) == ("m", "y")


@pytest.mark.parametrize("fps", [24, 24000 / 1001, 29.97, 60, 12.5])
def test_frames_keep_their_numbers_and_times(fps, tmp_path):
    clip = plant(seed=2, frames=30)
    metadata = {"fps": fps, "start_frame": 100}
    clip = clip.replace(time=5.0 / fps + np.arange(30) / fps, rest=clip.rest.astype(np.float32), metadata=metadata)
    for animation in ("joints", "morphs"):
        write(clip, tmp_path / "a.glb", animation=animation)
        with read(tmp_path / "a.glb") as back:
            assert back.metadata["fps"] == fps and back.metadata["start_frame"] == 105
            assert back.time == pytest.approx(clip.time - clip.time[0], abs=1e-9) and back.frame_count == 30


def test_objects_stay_apart_and_corners_split_only_where_they_differ(tmp_path):
    rest = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0]], np.float32)
    counts, indices = np.array([4, 3]), np.array([0, 1, 2, 3, 0, 2, 3])
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0], [1, 1], [9, 9]], np.float32)
    attributes = {"face_vertex_counts": counts, "face_vertex_indices": indices, "uv": uv}
    clip = MotionClip(
        rest + np.arange(3, dtype=np.float32)[:, None, None],
        np.arange(3) / 24,
        edges=np.array([[4, 5]]),
        attributes=attributes | {"part_vertex_counts": np.array([4, 2])},
        metadata={"part_names": ["leaf", "twig"], "domains": {"uv": "corner"}},
    )
    write(clip, tmp_path / "a.glb", animation="morphs")
    positions, back = frames_of(tmp_path / "a.glb")
    assert back.metadata["part_names"] == ["leaf", "twig"] and back.metadata["part_kinds"] == ["mesh", "curves"]
    assert back.attributes["part_vertex_counts"].tolist() == [5, 2]  # corner 3 has two places in the texture
    assert np.array_equal(positions[:, [0, 1, 2, 3, 5, 6]], clip.block(0, 3))
    assert back.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 2, 4]] and back.edges.tolist() == [[5, 6]]
    assert back.attributes["uv"][:5].tolist() == [[0, 0], [1, 0], [1, 1], [0, 1], [9, 9]]


def test_more_than_255_joints_need_wider_numbers(tmp_path):
    clip = plant(seed=8, branches=400, longest=3, frames=4)
    write(clip, tmp_path / "a.glb", animation="joints")
    assert len(pygltflib.GLTF2().load(str(tmp_path / "a.glb")).skins[0].joints) >= 400
    assert distance(frames_of(tmp_path / "a.glb")[0], clip.block(0, 4)) < 2e-4 * np.linalg.norm(
        np.ptp(clip.rest, axis=0)
    )


def test_joints_of_a_leaf_that_unfolds_out_of_a_point_keep_within_the_error(tmp_path):
    leaf = np.random.default_rng(2).random((6, 3)) - 0.5
    bent = np.stack([leaf * (1e-6 + frame / 9) + [100, 0, frame * leaf[1, 0]] for frame in range(10)])
    positions = np.concatenate([bent, np.broadcast_to(200 * leaf, (10, 6, 3))], axis=1).astype(np.float32)
    branches = {"vertex_branch": np.repeat([0, 1], 6), "branch_parent": np.array([1, -1])}
    clip = MotionClip(positions, np.arange(10) / 24, rest=positions[0], **branches)
    for animation in ("joints", "auto"):
        written = write(clip, tmp_path / "a.glb", animation=animation)
        assert written.facts["max_error"] <= allowed_error(clip), animation


def test_what_stands_still_needs_no_keys(tmp_path):
    clip = plant(seed=4, frames=20)
    rest = clip.rest.astype(np.float32)
    still = dataclasses.replace(clip, positions=np.repeat(rest[None], 20, axis=0), rest=rest)
    write(still, tmp_path / "still.glb", animation="joints")
    assert not pygltflib.GLTF2().load(str(tmp_path / "still.glb")).animations
    moved = dataclasses.replace(still, positions=still.positions + np.float32(3))
    write(moved, tmp_path / "moved.glb", animation="joints")
    gltf = pygltflib.GLTF2().load(str(tmp_path / "moved.glb"))
    assert {channel.target.path for channel in gltf.animations[0].channels} == {"translation"}
    assert all(gltf.accessors[sampler.output].count == 1 for sampler in gltf.animations[0].samplers)


def test_absurd_sizes_are_refused_and_leave_nothing(leafy, tmp_path, monkeypatch):
    monkeypatch.setattr(gltf_exporter, "MORPH_BYTES", 1000)
    monkeypatch.setattr(gltf_exporter, "MOST_JOINTS", 5)
    for animation, message in (("morphs", "choose joints"), ("joints", "expected fewer"), ("auto", "choose joints")):
        with pytest.raises(ClipError, match=message):
            write(leafy, tmp_path / "a.glb", animation=animation)
    assert os.listdir(tmp_path) == []


def test_a_single_frame_of_a_single_vertex_is_written_exactly(tmp_path):
    clip = MotionClip(positions=np.ones((1, 1, 3), np.float32), time=np.zeros(1))
    for animation in ("joints", "morphs", "auto"):
        write(clip, tmp_path / "a.glb", animation=animation)
        assert np.array_equal(frames_of(tmp_path / "a.glb")[0], clip.block(0, 1))


# ---- several clips ----


@pytest.fixture(scope="module")
def seasons():
    """Clips of one plant by name: 24 frames as a loop, 15 of other frames at another rate, a pose that is held, and
    one of a single frame."""
    whole = with_faces(plant(seed=6, branches=9, frames=60), from_tool="x")

    def part(start, stop, fps, number=0):
        held = whole.block(start, start + 1).repeat(5, axis=0) if stop == start else whole.block(start, stop)
        metadata = whole.metadata | {"fps": fps, "start_frame": number}
        return whole.replace(positions=held, time=np.arange(len(held)) / fps, metadata=metadata)

    return {
        "calm": athcodec.looped(part(0, 30, 30), 6),
        "gale": part(30, 45, 24, 100),
        "held": part(50, 50, 10),
        "one": part(55, 56, 30),
    }


@pytest.fixture(scope="module")
def seasons_ath(seasons, tmp_path_factory):
    path = tmp_path_factory.mktemp("seasons") / "seasons.ath"
    return athcodec.encode(athcodec.join(seasons), path, rel_error=1e-4, segment_frames=16).path


def same_clips(path, wanted, error):
    """Whether a GLB has the clips by name, each as far off as `error`."""
    with read(path, takes="all") as clip:
        found = athcodec.split(clip)
        assert list(found) == list(wanted)
        for name, motion in wanted.items():
            assert found[name].clip_ranges[0].loop == (name == "calm")
            assert distance(found[name].block(0, found[name].frame_count), motion.block(0, motion.frame_count)) <= error
            assert found[name].time == pytest.approx(motion.time, abs=1e-6)
            for key in ("fps", "start_frame"):
                assert found[name].metadata[key] == pytest.approx(motion.metadata[key])


@pytest.mark.parametrize("animation", ["joints", "morphs"])
def test_clips_keep_names_loops_and_motion_from_glb_through_ath_to_glb(seasons, seasons_ath, tmp_path, animation):
    write(athcodec.join(seasons), tmp_path / "joined.glb", animation=animation)
    same_clips(tmp_path / "joined.glb", seasons, facts_of(tmp_path / "joined.glb")["athcodec"]["max_error"] + 1e-5)
    assert main(["encode", str(tmp_path / "joined.glb"), str(tmp_path / "a.ath"), "--takes", "all"]) == 0
    assert main(["decode", str(tmp_path / "a.ath"), str(tmp_path / "again.glb"), "--animation", animation]) == 0
    with athcodec.open(tmp_path / "a.ath") as decoder:
        error = decoder.file.max_error_bound + 1e-5
    error += sum(facts_of(tmp_path / name)["athcodec"]["max_error"] for name in ("joined.glb", "again.glb"))
    same_clips(tmp_path / "again.glb", seasons, error)
    assert main(["verify", str(tmp_path / "a.ath"), "--takes", "all", "--against", str(tmp_path / "joined.glb")]) == 0


def test_every_clip_moves_all_that_any_moves_over_one_skin(seasons_ath, tmp_path):
    with athcodec.open(seasons_ath) as decoder:
        write(ClipView(decoder, all_clips=True), tmp_path / "a.glb", animation="joints")
    gltf = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    moved = [
        {(channel.target.node, channel.target.path) for channel in animation.channels} for animation in gltf.animations
    ]
    assert len(gltf.skins) == 1 and len(moved) == 4 and all(channels == moved[0] for channels in moved)
    with read(tmp_path / "a.glb") as clip:
        assert clip.metadata["animations"] == ["calm"] and clip.frame_count == 24


def test_clips_that_all_stand_still_become_animations(seasons, tmp_path):
    held = seasons["held"]
    still = held.replace(positions=held.rest[None].repeat(5, axis=0).astype(np.float32))
    write(athcodec.join({"a": still, "b": still}), tmp_path / "a.glb", animation="joints")
    with read(tmp_path / "a.glb", takes="all") as clip:
        assert [(clip_range.name, clip_range.frame_count) for clip_range in clip.clip_ranges] == [("a", 5), ("b", 5)]


@pytest.mark.parametrize("animation", ["joints", "morphs"])
def test_one_clip_of_several_is_an_animation_of_its_name(seasons_ath, tmp_path, animation):
    assert main(["decode", str(seasons_ath), str(tmp_path / "a.glb"), "--clip", "gale", "--animation", animation]) == 0
    assert [animation.name for animation in pygltflib.GLTF2().load(str(tmp_path / "a.glb")).animations] == ["gale"]
    assert facts_of(tmp_path / "a.glb")["start_frame"] == 100
    assert main(["decode", str(seasons_ath), str(tmp_path / "b.glb"), "--frames", "0:3"]) == 1
    assert not (tmp_path / "b.glb").exists()


def test_the_takes_that_are_not_read_are_named(tmp_path, capsys):
    path, out = str(with_takes(tmp_path / "a.glb")), str(tmp_path / "a.ath")
    assert main(["encode", path, out]) == 0
    assert "this is walk; there are walk.1, animation 2, turn too, and --takes all" in capsys.readouterr().err
    assert main(["encode", path, out, "--takes", "turn,gallop"]) == 1
    assert "got gallop, expected one of walk, walk.1, " in capsys.readouterr().err
    assert main(["encode", path, out, "--takes", "all", "--names", "a,b,c,d", "--loop", "a", "--fps", "10"]) == 0
    assert "takes" not in capsys.readouterr().err.splitlines()[-1]
    with athcodec.open(out) as decoder:
        assert {clip.name: clip.loop for clip in decoder.file.clips} == {"a": True, "b": False, "c": False, "d": True}


# ---- copies ----


def crown(frames=12, moving=True, **attributes):
    """A stem that bends, ten leaves on it and four buds that grow, the leaves of a shape with a seam."""
    random, t = np.random.default_rng(4), np.arange(frames) / 24
    stem = np.linspace(0, 4, 30)[:, None] * [0, 0, 1] + random.normal(size=(30, 3)) * 0.02
    bend = 0.3 * np.sin(2 * np.pi * t)[:, None, None] * moving
    placed = [stem + bend * (stem[:, 2:] ** 2 / 8) * [1, 0, 0]]
    leaf = np.array([[0, 0, 0], [0.3, 0, 0.1], [0.35, 0.4, 0], [0, 0.5, 0.2], [-0.1, 0.3, 0.0]])
    for number in range(14):
        at = stem[rng_row(number)]
        turns = [np.array(about([1, 2, 3], number + moving * 0.5 * np.sin(7 * x))[1]) for x in t]
        sizes = np.ones(frames) if number < 10 else 0.2 + 0.1 * t * moving
        shape = leaf if number < 10 else leaf[:4]
        shift = bend[:, 0] * at[2] ** 2 / 8 * [1, 0, 0] + at
        placed.append(np.stack([size * shape @ turn.T for size, turn in zip(sizes, turns)]) + shift[:, None])
    counts = [30, 50, 16]
    corners = [[0, 1, 2, 3], [0, 2, 3, 4]]
    faces = [np.array(corners) + 30 + 5 * i for i in range(10)]
    faces += [np.array([[0, 1, 2, 3]]) + 80 + 4 * i for i in range(4)]
    branch = np.repeat(np.arange(15), [30] + [5] * 10 + [4] * 4)
    return MotionClip(
        np.concatenate(placed, axis=1).astype(np.float32),
        t,
        faces=np.concatenate(faces).astype(np.int32),
        edges=np.stack([np.arange(29), np.arange(1, 30)], axis=1),
        vertex_branch=branch.astype(np.int32),
        branch_parent=np.array([-1] + [0] * 14, np.int32),
        attributes={
            "part_vertex_counts": np.array(counts, np.int32),
            "part_copies": np.array([1, 10, 4], np.int32),
            "wetness": np.concatenate([np.zeros(30), np.repeat(np.arange(14), [5] * 10 + [4] * 4)]).astype(np.float32),
        }
        | attributes,
        metadata={"part_names": ["stem", "leaf", "bud"], "unit": "cm", "up_axis": "z", "fps": 24.0},
    )


def rng_row(number):
    return 5 + (number * 7) % 24


def as_metres(clip, frames=None):
    points = clip.block(0, frames or clip.frame_count).astype(float)
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1) / 100


@pytest.mark.parametrize("animation", ["auto", "joints", "morphs"])
def test_copies_are_nodes_of_one_mesh_and_come_back_as_copies(tmp_path, animation):
    clip = crown()
    calm = clip.replace(clip_ranges=(ClipRange("calm", clip.frame_count, True),))
    both = athcodec.join({"calm": calm, "gust": clip.replace(positions=clip.positions[::-1])})
    plain = write(both, tmp_path / "plain.glb", animation=animation)
    written = write(both, tmp_path / "a.glb", animation=animation, instances=True)
    assert written.facts["instances"] == 14 and "instances" not in plain.facts
    assert (tmp_path / "a.glb").stat().st_size < (tmp_path / "plain.glb").stat().st_size
    with read(tmp_path / "a.glb", takes="all") as again:
        assert distance(again.block(0, 24), as_metres(both)) <= written.facts["max_error"] / 100 + 1e-7
        assert [each.name for each in again.clip_ranges] == ["calm", "gust"] and again.clip_ranges[0].loop
        assert again.metadata["part_names"] == ["stem", "leaf", "bud"]
        for name in ("part_copies", "part_vertex_counts", "wetness"):
            assert np.array_equal(again.attributes[name], clip.attributes[name]), name
        assert np.array_equal(again.vertex_branch, clip.vertex_branch)
        assert np.array_equal(again.branch_parent, clip.branch_parent)
    gltf = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    assert [gltf.accessors[m.primitives[0].attributes.POSITION].count for m in gltf.meshes] == [30, 5, 4]
    assert [sum(node.mesh == mesh for node in gltf.nodes) for mesh in range(3)] == [1, 10, 4]
    shown = trimesh.load(str(tmp_path / "a.glb")).to_geometry() if animation == "joints" else None
    assert shown is None or np.allclose(shown.bounds[1, :2], as_metres(clip, 1)[0, 30:].max(axis=0)[:2], atol=1e-5)


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize("animation", ["joints", "morphs"])
def test_objects_of_one_shape_show_one_mesh_and_keep_their_names(tmp_path, animation, moving):
    clip = crown(moving=moving)
    counts = np.array([30] + [5] * 10 + [4] * 4, np.int32)
    names = ["stem", *(f"leaf {i}" for i in range(10)), *(f"bud {i}" for i in range(4))]
    attributes = {"part_vertex_counts": counts, "wetness": clip.attributes["wetness"]}
    clip = clip.replace(attributes=attributes, metadata=clip.metadata | {"part_names": names})
    written = write(clip, tmp_path / "a.glb", animation=animation, instances=True)
    assert written.facts["instances"] == 14
    gltf = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    assert [sum(node.mesh == mesh for node in gltf.nodes) for mesh in range(len(gltf.meshes))] == [1, 10, 4]
    with read(tmp_path / "a.glb") as again:
        frames = min(again.frame_count, clip.frame_count)
        assert distance(again.block(0, frames), as_metres(clip, frames)) <= written.facts["max_error"] / 100 + 1e-7
        assert again.metadata["part_names"] == names and "part_copies" not in again.attributes
        assert np.array_equal(again.vertex_branch, clip.vertex_branch)
        assert np.array_equal(again.attributes["wetness"], clip.attributes["wetness"])


def test_copies_that_stand_still_are_instances_on_the_gpu(tmp_path):
    clip = crown(frames=3, moving=False)
    written = write(clip, tmp_path / "a.glb", instances=True)
    gltf = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    assert gltf.extensionsRequired == ["EXT_mesh_gpu_instancing"]
    with read(tmp_path / "a.glb") as again:
        assert distance(again.block(0, 1), as_metres(clip, 1)) <= written.facts["max_error"] / 100 + 1e-7
        for name in ("part_copies", "part_vertex_counts", "wetness"):
            assert np.array_equal(again.attributes[name], clip.attributes[name]), name
        assert np.array_equal(again.vertex_branch, clip.vertex_branch)


def test_copies_whose_colours_differ_stay_vertices_and_what_copies_cannot_have_is_named(tmp_path):
    random = np.random.default_rng(0)
    clip = crown(colors=random.random((96, 3)).astype(np.float32))
    written = write(clip, tmp_path / "a.glb", instances=True)
    assert "instances" not in written.facts
    clip = crown(noise=random.random(96).astype(np.float32), uv=np.zeros((96, 2), np.float32))
    written = write(clip, tmp_path / "b.glb", instances=True)
    assert written.facts["instances"] == 14 and "noise" in written.facts["left_out"]
    with read(tmp_path / "b.glb") as again:
        assert "noise" not in again.attributes and again.attributes["uv"].shape == (96, 2)


def test_texture_coordinates_with_seams_are_those_of_each_copy(tmp_path):
    corner = np.tile(np.linspace(0, 1, 16).reshape(8, 2), (10, 1))
    uv = np.concatenate([corner, np.tile(np.linspace(0, 1, 8).reshape(4, 2), (4, 1))]).astype(np.float32)
    clip = crown(uv=uv)
    clip.metadata["domains"] = {"uv": "corner"}
    written = write(clip, tmp_path / "a.glb", instances=True)
    assert written.facts["instances"] == 14
    gltf = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    leaf = gltf.meshes[1].primitives[0].attributes
    assert sorted(map(tuple, accessor_of(gltf, leaf.TEXCOORD_0).tolist())) == sorted(
        map(tuple, corner[:8].astype(np.float32).tolist())
    )
    with read(tmp_path / "a.glb") as again:
        assert again.attributes["part_copies"].tolist() == [1, 10, 4]
