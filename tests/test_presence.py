"""What is shown when: objects and copies that appear and vanish are read, kept, written and named; copies and points
keep their identity by their ids; and what a mirroring transform shows has its faces outward."""

from __future__ import annotations

import gc
import json

import numpy as np
import pytest
from alembic3d import Abc, AbcCoreAbstract, AbcGeom
from imath import IntArray, V3fArray
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt
from test_alembic import filled, matrix
from test_gltf import Maker
from test_usd import read_all

import athcodec
from athcodec import cli
from athcodec.errors import ClipError, SourceWarning

pytestmark = pytest.mark.formats

BOX = np.array([[x, y, z] for x in (2, 3) for y in (0, 1) for z in (0, 1)], np.float32)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
LEAF = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], np.float32)


def stage_of(path, last=6, first=1):
    stage = Usd.Stage.CreateNew(str(path))
    stage.SetStartTimeCode(first)
    stage.SetEndTimeCode(last)
    return stage


def add_mesh(stage, place, points=LEAF, faces=((0, 1, 2),)):
    mesh = UsdGeom.Mesh.Define(stage, place)
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr([len(face) for face in faces])
    mesh.CreateFaceVertexIndicesAttr(np.concatenate(faces).tolist())
    return mesh


def add_leaves(stage, frames, place="/leaves"):
    """An instancer of leaves: by time code (ids or None, invisible ids or None, x of each); y grows with time and x."""
    instancer = UsdGeom.PointInstancer.Define(stage, place)
    add_mesh(stage, f"{place}/prototypes/leaf")
    instancer.CreatePrototypesRel().SetTargets([f"{place}/prototypes/leaf"])
    for code, (ids, invisible, places) in frames.items():
        instancer.CreateProtoIndicesAttr().Set([0] * len(places), code)
        instancer.CreatePositionsAttr().Set([(x, 0.1 * code * x, 0) for x in places], code)
        if ids is not None:
            instancer.CreateIdsAttr().Set(ids, code)
        if invisible is not None:
            instancer.CreateInvisibleIdsAttr().Set(invisible, code)
    return instancer


def volume(clip, positions):
    """Signed volume of the faces in a frame; above 0 where they look outward."""
    counts, indices = clip.polygons
    faces = np.split(indices, np.cumsum(counts)[:-1])
    fans = [[face[0], face[k], face[k + 1]] for face in faces for k in range(1, len(face) - 1)]
    a, b, c = positions.astype(float)[np.array(fans)].swapaxes(0, 1)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def presence_after(path, out, **options):
    """metadata["presence"] of a clip as it is read, and as it is after an .ath file and another format."""
    with athcodec.read(path) as clip:
        athcodec.encode(clip, out.with_suffix(".ath"), effort="fast")
        with athcodec.open(out.with_suffix(".ath")) as decoder:
            written = athcodec.write(athcodec.ClipView(decoder), out, **options)
        before = clip.metadata["presence"]
    with athcodec.read(out) as again:
        return before, again.metadata.get("presence"), written.facts.get("not_written")


# ---- presence ----


def appearing(path):
    """Three meshes, of which the second is hidden first by itself and the third by the transform above it."""
    stage = stage_of(path)
    for number in range(3):
        UsdGeom.Xform.Define(stage, f"/twig{number}")
        mesh = add_mesh(stage, f"/twig{number}/mesh{number}", LEAF + np.float32([number, 0, 0]))
        hidden = [mesh, UsdGeom.Xform(stage.GetPrimAtPath(f"/twig{number}"))][number // 2]
        if number:
            hidden.GetVisibilityAttr().Set("invisible", 1)
            hidden.GetVisibilityAttr().Set("inherited", 2 * number)
    hidden.GetVisibilityAttr().Set("invisible", 6)
    stage.Save()


APPEARING = {"mesh1": [[1, 6]], "mesh2": [[3, 5]]}


@pytest.mark.parametrize("suffix", [".usda", ".abc", ".npz", ".h5"])
def test_presence_over_time_is_read_kept_and_written_back(tmp_path, suffix):
    appearing(tmp_path / "a.usda")
    assert presence_after(tmp_path / "a.usda", tmp_path / f"b{suffix}") == (APPEARING, APPEARING, None)


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".pc2", ".vtu", ".xdmf"])
def test_presence_that_a_format_has_no_place_for_is_named(tmp_path, suffix, capsys):
    appearing(tmp_path / "a.usda")
    assert cli.main(["encode", str(tmp_path / "a.usda"), str(tmp_path / "c.ath"), "--effort", "fast"]) == 0
    assert cli.main(["decode", str(tmp_path / "c.ath"), str(tmp_path / f"d{suffix}")]) == 0
    assert f"not written: {tmp_path / 'd'}{suffix}: presence mesh1, mesh2\n" in capsys.readouterr().err


def test_info_says_what_is_shown_when_and_a_view_of_some_frames_counts_from_its_first(tmp_path, capsys):
    appearing(tmp_path / "a.usda")
    with athcodec.read(tmp_path / "a.usda") as clip:
        athcodec.encode(clip, tmp_path / "a.ath", effort="fast")
    assert cli.main(["info", str(tmp_path / "a.ath")]) == 0
    assert "Shown in some frames only: mesh1 in 1 to 5; mesh2 in 3 to 4." in capsys.readouterr().out
    assert cli.main(["info", str(tmp_path / "a.ath"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["clips"][0]["presence"] == APPEARING
    with athcodec.open(tmp_path / "a.ath") as decoder:
        assert athcodec.ClipView(decoder, frames=range(2, 5)).metadata["presence"] == {"mesh2": [[1, 3]]}


def test_samples_of_visibility_alone_make_frames_where_a_stage_has_no_range(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    add_mesh(stage, "/still")
    blinking = add_mesh(stage, "/blinking").GetVisibilityAttr()
    for code, token in ((1, "inherited"), (3, "invisible"), (4, "inherited")):
        blinking.Set(token, code)
    stage.Save()
    clip, _ = read_all(tmp_path / "a.usda")
    assert clip.frame_count == 3 and clip.metadata["presence"] == {"blinking": [[0, 1], [2, 3]]}


def write_hiding(path):
    """Alembic: a hidden transform over a mesh that says it is visible, one that says nothing, and one that blinks."""
    archive = Abc.OArchive(str(path))
    sampling = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24, 1 / 24))
    above = AbcGeom.OXform(archive.getTop(), "above")
    AbcGeom.CreateVisibilityProperty(above, 0).setValue(0)
    made = []
    for name, values in (("visible", [1]), ("silent", [-1]), ("blinking", [0, 1, -1, 1])):
        place = AbcGeom.OXform(above, name)
        if len(values) == 1:
            AbcGeom.CreateVisibilityProperty(place, 0).setValue(values[0])
        else:
            visibility = AbcGeom.CreateVisibilityProperty(place, sampling)
            for value in values:
                visibility.setValue(value)
        mesh = AbcGeom.OPolyMesh(place, f"{name}_mesh")
        corners, counts = filled(IntArray, [2, 1, 0]), filled(IntArray, [3])
        mesh.getSchema().set(AbcGeom.OPolyMeshSchemaSample(filled(V3fArray, LEAF), corners, counts))
        made += [place, mesh]
    del archive, above, made, place, mesh, visibility
    gc.collect()


def test_a_hidden_parent_in_alembic_hides_no_child_that_says_it_is_visible(tmp_path):
    write_hiding(tmp_path / "a.abc")
    clip, _ = read_all(tmp_path / "a.abc")
    assert clip.metadata["part_names"] == ["visible_mesh", "blinking_mesh"] and clip.frame_count == 4
    assert clip.metadata["presence"] == {"blinking_mesh": [[1, 2], [3, 4]]}
    assert clip.not_read == {"hidden": ["/above/silent/silent_mesh"]}


def test_a_hidden_parent_in_usd_hides_all_below_it_and_these_are_named(tmp_path):
    appearing(tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    UsdGeom.Imageable(stage.GetPrimAtPath("/twig0")).GetVisibilityAttr().Set("invisible")
    stage.Save()
    clip, _ = read_all(tmp_path / "a.usda")
    assert clip.metadata["presence"] == APPEARING and clip.not_read == {"hidden": ["/twig0/mesh0"]}


def test_visibility_of_gltf_nodes_is_presence_and_holds_for_all_below(tmp_path):
    made = Maker()
    made.gltf.extensionsUsed = ["KHR_node_visibility", "KHR_animation_pointer"]
    mesh = made.mesh({"POSITION": made.array(LEAF)}, "leaf", indices=[0, 1, 2])
    above = made.node(name="above")
    for parent, name in ((above, "below"), (None, "still")):
        made.node(parent, name=name, mesh=mesh)
    hidden = made.node(name="hidden", mesh=mesh)
    made.gltf.nodes[hidden].extensions = {"KHR_node_visibility": {"visible": False}}
    made.animation([(2, "translation", [0, 0.5], [[0, 0, 0], [1, 0, 0]], "LINEAR")])
    sampler = len(made.gltf.animations[0].samplers)
    times, values = (made.array(np.array(each)) for each in (np.float32([0, 0.25]), np.uint8([0, 1])))
    made.gltf.animations[0].samplers.append(
        type(made.gltf.animations[0].samplers[0])(input=times, output=values, interpolation="STEP")
    )
    pointer = f"/nodes/{above}/extensions/KHR_node_visibility/visible"
    channel = type(made.gltf.animations[0].channels[0])(sampler=sampler)
    channel.target = type(made.gltf.animations[0].channels[0].target)(
        path="pointer", extensions={"KHR_animation_pointer": {"pointer": pointer}}
    )
    made.gltf.animations[0].channels.append(channel)
    clip, _ = read_all(made.save(tmp_path / "a.glb"), fps=8)
    assert clip.metadata["part_names"] == ["below", "still"] and clip.frame_count == 5
    assert clip.metadata["presence"] == {"below": [[2, 5]]} and clip.not_read == {"hidden": ["hidden"]}


def test_hidden_parts_far_away_are_named_when_they_lengthen_the_diagonal(tmp_path):
    stage = stage_of(tmp_path / "a.usda")
    add_mesh(stage, "/stem", LEAF)
    for name, away in (("near", 0), ("far", 50)):
        mesh = add_mesh(stage, f"/{name}")
        for code, shift, token in ((1, away, "invisible"), (2, 0, "inherited")):
            mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(LEAF + np.float32([shift, 0, 0])), code)
            mesh.GetVisibilityAttr().Set(token, code)
    stage.Save()
    with athcodec.read(tmp_path / "a.usda") as clip, pytest.warns(SourceWarning, match="hidden: far: where this is"):
        athcodec.encode(clip, tmp_path / "a.ath", effort="fast")


# ---- copies ----


def test_a_copy_that_is_hidden_for_a_time_is_kept_and_written_back_as_an_instance(tmp_path):
    stage = stage_of(tmp_path / "a.usda")
    add_leaves(stage, {code: (None, [0] if code < 3 else [], [0, 1, 2]) for code in range(1, 7)})
    stage.Save()
    for name in ("b.usda", "b.abc"):
        before, after, lost = presence_after(tmp_path / "a.usda", tmp_path / name, instances=True)
        assert before == {"leaf:0": [[2, 6]]} and list(after.values()) == [[[2, 6]]] and lost is None
        assert next(iter(after)).endswith(":0")
    _, after, lost = presence_after(tmp_path / "a.usda", tmp_path / "c.usda")
    assert after is None and lost == {"presence of copies, which instances keep": ["leaf"]}


def test_copies_follow_their_ids_and_those_that_appear_or_vanish_become_presence(tmp_path):
    frames = {1: ([7, 3], [1, 0]), 2: ([3, 7], [0, 1]), 3: ([9, 3, 7], [2, 0, 1]), 4: ([9, 3], [2, 0])}
    stage = stage_of(tmp_path / "a.usda", 4)
    add_leaves(stage, {code: (ids, None, places) for code, (ids, places) in frames.items()})
    stage.Save()
    clip, positions = read_all(tmp_path / "a.usda")
    assert clip.metadata["presence"] == {"leaf:1": [[0, 3]], "leaf:2": [[2, 4]]}
    corners = positions[:, ::3, :2]
    assert np.allclose(corners[:, :, 0], [[0, 1, 2]] * 4)
    assert np.allclose(corners[:, 1, 1], [0.1, 0.2, 0.3, 0.3]) and np.allclose(corners[:, 2, 1], [0.6, 0.6, 0.6, 0.8])
    _, between = read_all(tmp_path / "a.usda", fps=48)
    assert np.allclose(between[:, ::3, 0], [[0, 1, 2]] * 7)


def test_copies_that_appear_without_ids_are_refused_with_object_and_frame(tmp_path):
    stage = stage_of(tmp_path / "a.usda", 3)
    add_leaves(stage, {1: (None, None, []), 2: (None, None, [1, 2]), 3: (None, None, [1, 2, 3])})
    add_mesh(stage, "/trunk")
    stage.Save()
    with pytest.raises(ClipError, match=r"/leaves: got 2 copies in frame 1 \(time code 2\), expected 0 as in frame 0"):
        athcodec.read(tmp_path / "a.usda")


def test_what_exists_is_decided_in_the_frames_that_are_played(tmp_path):
    stage = stage_of(tmp_path / "a.usda", 12, first=10)
    add_leaves(stage, {1: (None, None, []), **{code: (None, None, [0, 1, 2]) for code in range(5, 13)}})
    late = add_mesh(stage, "/late")
    late.GetVisibilityAttr().Set("invisible", 1)
    late.GetVisibilityAttr().Set("inherited", 10)
    stage.Save()
    clip, positions = read_all(tmp_path / "a.usda")
    assert positions.shape == (3, 12, 3) and "presence" not in clip.metadata
    assert list(clip.not_read) == ["keys outside of the stage's range"]
    assert np.allclose(positions[:, :9:3, 0], [0, 1, 2])


ORDERS = [[1, 2, 0], [2, 1, 0], [0, 2, 1]]


def test_points_of_usd_follow_their_ids(tmp_path):
    stage = stage_of(tmp_path / "a.usda", 3)
    points = UsdGeom.Points.Define(stage, "/dust")
    points.CreateWidthsAttr([1, 2, 3])
    for code, order in enumerate(ORDERS, 1):
        points.GetPointsAttr().Set([(x, 0, code) for x in order], code)
        points.GetIdsAttr().Set([10 + x for x in order], code)
    stage.Save()
    clip, positions = read_all(tmp_path / "a.usda")
    assert np.array_equal(positions, [[[x, 0, z] for x in range(3)] for z in (1, 2, 3)])
    assert clip.not_read == {"attribute": ["/dust.radius"]} and "radius" not in clip.attributes
    points.GetIdsAttr().Set([10, 12, 13], 3)
    stage.Save()
    with pytest.raises(ClipError, match=r"/dust: got 3 points with other ids in frame 2"):
        read_all(tmp_path / "a.usda")


def test_points_of_alembic_follow_their_ids_between_samples_too(tmp_path):
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    sampling = Abc.Argument(archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24, 0)))
    points = AbcGeom.OPoints(archive.getTop(), "dust", sampling)
    for z, order in enumerate(ORDERS):
        held = filled(V3fArray, [[x, 0, z] for x in order]), filled(IntArray, order)
        points.getSchema().set(AbcGeom.OPointsSchemaSample(*held))
    del archive, points
    gc.collect()
    _, positions = read_all(tmp_path / "a.abc", fps=48)
    assert np.allclose(positions, [[[x, 0, z] for x in range(3)] for z in (0, 0.5, 1, 1.5, 2)])


# ---- mirrored ----


def assert_outward(path, count=1):
    clip, positions = read_all(path)
    assert np.allclose([volume(clip, frame) for frame in positions[-2:]], count)
    return clip


@pytest.mark.parametrize("orientation, scales", [("right", {1: -1}), ("left", {1: 1}), ("left", {1: 0, 2: -1})])
def test_faces_of_mirrored_and_left_handed_meshes_of_usd_look_outward(tmp_path, orientation, scales):
    faces, stage = SIDES if orientation == "right" else [side[::-1] for side in SIDES], stage_of(tmp_path / "a.usda", 3)
    scale = UsdGeom.Xform.Define(stage, "/above").AddScaleOp()
    for code, x in scales.items():
        scale.Set(Gf.Vec3f(x, 1, 1), code)
    mesh = add_mesh(stage, "/above/box", BOX, faces)
    mesh.CreateOrientationAttr(f"{orientation}Handed")
    mesh.CreateDoubleSidedAttr(True)
    corners = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("corner", mesh.GetPointsAttr().GetTypeName(), "faceVarying")
    corners.Set(Vt.Vec3fArray.FromNumpy(BOX[np.concatenate(faces)]))
    stage.Save()
    clip = assert_outward(tmp_path / "a.usda")
    assert np.array_equal(clip.attributes["corner"], BOX[clip.polygons[1]])
    for name in ("b.usda", "b.abc", "b.glb", "b.npz") if scales == {1: -1} else ():
        written = athcodec.write(clip_of(tmp_path / "a.usda"), tmp_path / name)
        again = assert_outward(tmp_path / name)
        lost = {"doubleSided": ["box"]} if name == "b.abc" else None
        assert written.facts.get("not_written") == lost
        assert again.metadata.get("part_usd") == (None if lost else [{"doubleSided": "true"}])


def test_what_turns_inside_out_in_time_is_named(tmp_path):
    stage = stage_of(tmp_path / "a.usda", 3)
    scale = UsdGeom.Xform.Define(stage, "/above").AddScaleOp()
    for code in (1, 3):
        scale.Set(Gf.Vec3f(2 - code, 1, 1), code)
    add_mesh(stage, "/above/box", BOX, SIDES)
    stage.Save()
    made = Maker()
    node = made.node(mesh=made.mesh({"POSITION": made.array(LEAF)}, "leaf", indices=[0, 1, 2]))
    made.animation([(node, "scale", [0, 0.5], [[1, 1, 1], [1, 1, -1]], "LINEAR")])
    for path, name in (tmp_path / "a.usda", "/above/box"), (made.save(tmp_path / "a.glb"), "leaf"):
        with pytest.warns(SourceWarning, match=f"not read: faces that turn inside out in time {name}"):
            athcodec.read(path).close()


def clip_of(path):
    with athcodec.read(path) as clip:
        return clip.replace(positions=clip.block(0, clip.frame_count))


def test_faces_of_mirrored_copies_look_outward_whatever_the_others_do(tmp_path):
    stage = stage_of(tmp_path / "a.usda", 2)
    instancer = add_leaves(stage, {1: (None, None, [1, 2]), 2: (None, None, [1, 3])})
    add_mesh(stage, "/leaves/prototypes/leaf", BOX, SIDES)
    instancer.CreateScalesAttr([(-1, 1, 1), (1, 1, 1)])
    stage.Save()
    assert_outward(tmp_path / "a.usda", 2)
    instancer.GetScalesAttr().Set([(-1, 1, 1), (1, -1, 1)])
    stage.Save()
    assert_outward(tmp_path / "a.usda", 2)
    written = athcodec.write(clip_of(tmp_path / "a.usda"), tmp_path / "b.usda", instances=True)
    assert written.facts["instances"] == 2
    assert_outward(tmp_path / "b.usda", 2)


def test_faces_of_a_mesh_that_a_skeleton_mirrors_look_outward(tmp_path):
    stage = stage_of(tmp_path / "a.usda", 2)
    UsdSkel.Root.Define(stage, "/plant")
    skeleton = UsdSkel.Skeleton.Define(stage, "/plant/skeleton")
    skeleton.CreateJointsAttr(["stem"])
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1)])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d().SetScale(Gf.Vec3d(-1, 1, 1))])
    mesh = add_mesh(stage, "/plant/box", BOX, SIDES)
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets(["/plant/skeleton"])
    binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray([0] * 8))
    binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray([1.0] * 8))
    stage.Save()
    assert_outward(tmp_path / "a.usda")


def test_faces_of_mirrored_meshes_and_instances_of_alembic_look_outward(tmp_path):
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    places = [AbcGeom.OXform(archive.getTop(), f"place{i}") for i in range(2)]
    for i, place in enumerate(places):
        sample = AbcGeom.XformSample()
        sample.setMatrix(matrix(np.diag([1 - 2 * i, 1, 1]), [0, 0, 3 * i]))
        place.getSchema().set(sample)
    box = AbcGeom.OPolyMesh(places[0], "box")
    corners, counts = (filled(IntArray, np.array(SIDES)[:, ::-1].reshape(-1)), filled(IntArray, [4] * 6))
    box.getSchema().set(AbcGeom.OPolyMeshSchemaSample(filled(V3fArray, BOX), corners, counts))
    places[1].addChildInstance(box, "box")
    del archive, places, place, box
    gc.collect()
    clip = assert_outward(tmp_path / "a.abc", 2)
    assert clip.attributes["part_copies"].tolist() == [2]


def test_faces_of_mirrored_nodes_joints_and_instances_of_gltf_look_outward(tmp_path):
    triangles = [[side[k] for k in corner] for side in SIDES for corner in ((0, 1, 2), (0, 2, 3))]
    made = Maker()
    positions = made.array(BOX)
    mesh = made.mesh({"POSITION": positions}, "box", indices=np.concatenate(triangles))
    node = made.node(mesh=mesh, scale=[-1, 1, 1])
    made.animation([(node, "translation", [0, 0.5], [[0, 0, 0], [1, 0, 0]], "LINEAR")])
    copied = made.node(mesh=mesh)
    scales = made.array(np.float32([[1, 1, 1], [1, -1, 1]]))
    made.gltf.nodes[copied].extensions = {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": scales}}}
    assert_outward(made.save(tmp_path / "a.glb"), 3)
    made = Maker()
    weights = {
        "JOINTS_0": made.array(np.zeros((8, 4), np.uint8)),
        "WEIGHTS_0": made.array(np.float32([[1, 0, 0, 0]] * 8)),
    }
    mesh = made.mesh({"POSITION": made.array(BOX)} | weights, "box", indices=np.concatenate(triangles))
    joint = made.node(scale=[1, 1, -1])
    made.gltf.skins.append({"joints": [joint]})
    made.node(mesh=mesh, skin=0)
    assert_outward(made.save(tmp_path / "b.glb"))


def test_faces_of_a_mirrored_node_look_outward_in_a_glb_that_its_motion_was_put_into(tmp_path):
    made = Maker()
    corners = np.concatenate([[side[k] for k in corner] for side in SIDES for corner in ((0, 1, 2), (0, 2, 3))])
    for x in (1, -1):
        mesh = made.mesh({"POSITION": made.array(BOX * np.float32([1, x, 1]))}, f"box{x}", indices=corners[::x])
        node = made.node(mesh=mesh, scale=[1, x, 1])
        made.animation([(node, "translation", [0, 0.5], [[0, 0, 0], [1, 0, 0]], "LINEAR")])
    assert_outward(made.save(tmp_path / "a.glb"), 2)
    assert cli.main(["encode", str(tmp_path / "a.glb"), "--into", str(tmp_path / "b.glb")]) == 0
    assert cli.main(["decode", str(tmp_path / "b.glb"), str(tmp_path / "c.glb")]) == 0
    assert_outward(tmp_path / "c.glb", 2)
