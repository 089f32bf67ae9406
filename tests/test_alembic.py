"""Alembic: files that its own library and Blender write are read, and both read what is written."""

from __future__ import annotations

import gc
from fractions import Fraction

import imath
import numpy as np
import pytest
from alembic3d import Abc, AbcCoreAbstract, AbcGeom
from test_usd import GRID, QUADS, sway, whole_plant

import athcodec
from athcodec.errors import ClipError, SourceWarning

pytestmark = pytest.mark.formats

FPS = float(Fraction(24000, 1001))
Y_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # of rows whose Z is up
TURN = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # by a right angle about Z, of rows


def filled(kind, values):
    array = kind(len(values))
    np.asarray(memoryview(array))[...] = values
    return array


def matrix(rotation, shift):
    rows = np.eye(4)
    rows[:3, :3], rows[3, :3] = rotation, shift
    return imath.M44d(*(float(x) for x in rows.reshape(-1)))


def write_archive(path, faces=QUADS[:, ::-1], counts=(12,) * 10):
    """A grid that sways below a transform that shifts, itself below one that turns; and a hidden twin."""
    archive = Abc.OArchive(str(path))
    sampling = Abc.Argument(archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / FPS, 101 / FPS)))
    turned = AbcGeom.OXform(archive.getTop(), "turned")
    turn = AbcGeom.XformSample()
    turn.setMatrix(matrix(TURN, [0, 0, 0]))
    turned.getSchema().set(turn)
    shifted = AbcGeom.OXform(turned, "shifted", sampling)
    mesh = AbcGeom.OPolyMesh(shifted, "grid", sampling)
    twin = AbcGeom.OPolyMesh(turned, "twin", sampling)
    AbcGeom.CreateVisibilityProperty(twin, 0).setValue(0)
    held = filled(imath.IntArray, np.full(len(faces), 4)), filled(imath.IntArray, faces.reshape(-1))
    for i, count in enumerate(counts):
        shift = AbcGeom.XformSample()
        shift.setMatrix(matrix(np.eye(3), [i, 0, 5]))
        shifted.getSchema().set(shift)
        points = filled(imath.V3fArray, sway(101 + i)[:count])
        for shape in (mesh, twin):
            sample = AbcGeom.OPolyMeshSchemaSample
            shape.getSchema().set(sample(points, held[1], held[0]) if i == 0 else sample(points))
    del archive, turned, shifted, mesh, twin
    gc.collect()


def test_meshes_below_moving_transforms_are_read_in_world_space(tmp_path):
    write_archive(tmp_path / "a.abc")
    with athcodec.read(tmp_path / "a.abc") as clip:
        for i, positions in enumerate(clip.block(0, 10)):
            assert np.allclose(positions, (sway(101 + i) + [i, 0, 5]) @ TURN, rtol=0, atol=2e-6)
        assert clip.metadata["fps"] == FPS and clip.metadata["start_frame"] == 101
        assert clip.metadata["part_names"] == ["grid"]
        assert np.array_equal(clip.faces, QUADS)  # clockwise in the file
        assert np.allclose(clip.time, np.arange(10) / FPS, rtol=0, atol=1e-12)


def test_subdivision_surfaces_are_read_as_their_cage_and_what_shapes_them_is_named(tmp_path):
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    sampling = Abc.Argument(archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24, 0)))
    surface = AbcGeom.OSubD(archive.getTop(), "grid", sampling)
    counts = filled(imath.IntArray, np.full(len(QUADS), 4))
    corners = filled(imath.IntArray, QUADS[:, ::-1].reshape(-1))
    crease = [filled(imath.IntArray, [0, 1]), filled(imath.IntArray, [2]), filled(imath.FloatArray, [3])]
    for i in range(4):
        points = filled(imath.V3fArray, sway(i))
        sample = AbcGeom.OSubDSchemaSample(points, corners, counts, *crease)
        sample.setInterpolateBoundary(1)
        sample.setVelocities(points)
        surface.getSchema().set(sample)
    Abc.OFloatProperty(surface.getSchema().getUserProperties(), "height").setValue(3.5)
    del archive, surface
    gc.collect()
    with pytest.warns(SourceWarning, match="not read: subdivision /grid.creaseIndices, /grid.interpolateBoundary$"):
        clip = athcodec.read(tmp_path / "a.abc")
    with clip:
        assert np.array_equal(clip.block(0, 4), [sway(i) for i in range(4)]) and np.array_equal(clip.faces, QUADS)
        assert clip.metadata["part_usd"] == [{"subdivisionScheme": "catmullClark"}]
        assert clip.not_read["subdivision"] == ["/grid.creaseIndices", "/grid.interpolateBoundary"]
        assert clip.not_read["attribute"] == ["/grid.velocities", "/grid.userProperties"]


def test_instances_are_read_as_copies_and_what_is_not_read_is_named(tmp_path):
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    sampling = Abc.Argument(archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24, 0)))
    places = [AbcGeom.OXform(archive.getTop(), f"place{i}", sampling) for i in range(3)]
    leaf = AbcGeom.OPolyMesh(places[0], "leaf", sampling)
    corners, counts = filled(imath.IntArray, QUADS[:, ::-1].reshape(-1)), filled(imath.IntArray, [4] * len(QUADS))
    leaf.getSchema().set(AbcGeom.OPolyMeshSchemaSample(filled(imath.V3fArray, GRID), corners, counts))
    for i, place in enumerate(places):
        for frame in range(4):
            sample = AbcGeom.XformSample()
            sample.setMatrix(matrix(np.linalg.matrix_power(TURN, i), [10 * i, frame * i, 0]))
            place.getSchema().set(sample)
        if i:
            place.addChildInstance(leaf, "leaf")
    camera = AbcGeom.OCamera(archive.getTop(), "eye")
    patch = AbcGeom.ONuPatch(archive.getTop(), "petal")
    del archive, places, place, leaf, camera, patch
    gc.collect()
    with pytest.warns(SourceWarning, match="a.abc: not read: NuPatch /petal$"):
        clip = athcodec.read(tmp_path / "a.abc")
    with clip:
        assert clip.not_read == {"Camera": ["/eye"], "NuPatch": ["/petal"]}
        assert clip.metadata["part_names"] == ["leaf"] and clip.attributes["part_copies"].tolist() == [3]
        assert np.array_equal(clip.faces, np.concatenate([QUADS, QUADS + 12, QUADS + 24]))
        for frame, positions in enumerate(clip.block(0, 4)):
            for i in range(3):
                expected = GRID @ np.linalg.matrix_power(TURN, i) + [10 * i, frame * i, 0]
                assert np.allclose(positions[12 * i : 12 * i + 12], expected, atol=1e-6)
        found = athcodec.find_branches(clip)
        assert np.array_equal(found.vertex_branch, np.repeat([0, 1, 2], 12))


def test_arrays_that_change_in_a_single_sample_are_named_and_those_with_equal_samples_stay(tmp_path):
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    sampling = Abc.Argument(archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 24, 0)))
    mesh = AbcGeom.OPolyMesh(archive.getTop(), "grid", sampling)
    corners, counts = filled(imath.IntArray, QUADS[:, ::-1].reshape(-1)), filled(imath.IntArray, [4] * len(QUADS))
    scope, place = AbcGeom.GeometryScope.kUniformScope, mesh.getSchema().getArbGeomParams()
    params = {name: AbcGeom.OFloatGeomParam(place, name, False, scope, 1, sampling) for name in ("wet", "dry")}
    for frame in range(5):
        mesh.getSchema().set(AbcGeom.OPolyMeshSchemaSample(filled(imath.V3fArray, sway(frame)), corners, counts))
        for name, param in params.items():
            values = filled(imath.FloatArray, [float(name == "wet" and frame == 2)] * len(QUADS))
            param.set(AbcGeom.OFloatGeomParamSample(values, scope))
    del archive, mesh, place, params, param
    gc.collect()
    with athcodec.read(tmp_path / "a.abc") as clip:
        assert clip.not_read == {"attribute": ["/grid.wet"]}
        assert "dry" in clip.attributes and "wet" not in clip.attributes


def test_another_frame_rate_interpolates_linearly_between_samples(tmp_path):
    write_archive(tmp_path / "a.abc")
    with athcodec.read(tmp_path / "a.abc", fps=2 * FPS) as clip:
        assert clip.frame_count == 19 and clip.metadata["fps"] == 2 * FPS
        expected = ((sway(101) + sway(102)) / 2 + [0.5, 0, 5]) @ TURN
        assert np.allclose(clip.block(1, 2)[0], expected, rtol=0, atol=2e-6)


def test_points_whose_number_changes_are_refused_with_the_frame(tmp_path):
    write_archive(tmp_path / "a.abc", counts=(12,) * 4 + (11,) * 6)
    with pytest.raises(ClipError, match="in frame 4, expected 12"):
        with athcodec.read(tmp_path / "a.abc") as clip:
            clip.block(0, clip.frame_count)


def test_the_option_only_selects_objects_by_name(tmp_path):
    write_archive(tmp_path / "a.abc")
    with pytest.raises(ClipError, match="a.abc: objects: got none with points named like bark"):
        athcodec.read(tmp_path / "a.abc", only=["bark"])


def test_the_alembic_library_reads_what_is_written(tmp_path):
    whole_plant(tmp_path / "a.usdc")
    with athcodec.read(tmp_path / "a.usdc") as clip:
        athcodec.write(clip, tmp_path / "a.abc")
        expected = clip.block(0, 10)
    archive = Abc.IArchive(str(tmp_path / "a.abc"))
    root = archive.getTop().getChild(0)
    up = np.array(AbcGeom.IXform(root, Abc.WrapExistingFlag.kWrapExisting).getSchema().getValue().getMatrix())
    assert np.allclose(up[:3, :3], Y_UP)  # the clip's Z is up
    assert [root.getChild(i).getName() for i in range(4)] == ["grid", "leaf", "hair", "dust"]
    mesh = AbcGeom.IPolyMesh(root.getChild(0).getChild(0), Abc.WrapExistingFlag.kWrapExisting).getSchema()
    assert mesh.getNumSamples() == 10 and mesh.getFaceCountsProperty().isConstant()
    assert np.array_equal(np.array(mesh.getFaceIndicesProperty().getValue()).reshape(-1, 4), QUADS[:, ::-1])
    for i, sample in enumerate(mesh.getPositionsProperty().samples):
        assert np.array_equal(np.array(sample), expected[i, :12])
        assert mesh.getTimeSampling().getSampleTime(i) == pytest.approx((101 + i) / FPS, abs=1e-12)
    assert np.isclose(Abc.GetArchiveInfo(archive)["dccFPS"], FPS, rtol=1e-5)


# ---- Blender ----

SCENE = """
fresh()
scene = bpy.context.scene
scene.render.fps, scene.render.fps_base = 24, 1.001
scene.frame_start, scene.frame_end = 3, 12
bpy.ops.mesh.primitive_grid_add(x_subdivisions=5, y_subdivisions=4)
grid = bpy.context.object
grid.name = grid.data.name = "Grid"
wave = grid.modifiers.new("wave", "WAVE")
wave.height, wave.speed = 0.4, 0.3
grid.rotation_euler = (0.3, 0.2, 0.1)
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
ball = bpy.context.object
ball.name = ball.data.name = "Ball"
ball.parent, ball.scale = grid, (1, 2, 0.5)
curve = bpy.data.curves.new("Hair", "CURVE")
curve.dimensions = "3D"
spline = curve.splines.new("POLY")
spline.points.add(4)
for i, point in enumerate(spline.points):
    point.co, point.radius = (i, i * i * 0.1, 0, 1), 1 + i
hair = bpy.data.objects.new("Hair", curve)
scene.collection.objects.link(hair)
for obj, ends in ((grid, ((1, 2, 3), (4, 2, 1))), (hair, ((0, 0, 0), (0, 0, 5)))):
    for place, frame in zip(ends, (3, 12)):
        obj.location = place
        obj.keyframe_insert("location", frame=frame)
shown = {name: [] for name in ("Grid", "Ball", "Hair")}
for frame in range(3, 13):
    scene.frame_set(frame)
    shown["Grid"].append(world("Grid"))
    shown["Ball"].append(world("Ball"))
    shift = np.array(hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)[:3, 3]
    shown["Hair"].append(np.array([point.co[:3] for point in spline.points]) + shift)
bpy.ops.wm.alembic_export(filepath=args["path"] + ".abc", start=3, end=12)
bpy.ops.wm.usd_export(filepath=args["path"] + ".usdc", export_animation=True)
save(faces=[list(polygon.vertices) for polygon in grid.data.polygons], **shown)
"""


@pytest.mark.programs
@pytest.mark.parametrize("suffix, turn", [("abc", Y_UP), ("usdc", np.eye(3))])
def test_what_blender_writes_is_read_as_blender_shows_it(blender, tmp_path, suffix, turn):
    shown = blender.run(SCENE, path=tmp_path / "a")
    with athcodec.read(tmp_path / f"a.{suffix}") as clip:
        assert sorted(clip.metadata["part_names"]) == ["Ball", "Grid", "Hair"]
        positions, first = clip.block(0, clip.frame_count), 0
        for name, count in zip(clip.metadata["part_names"], clip.attributes["part_vertex_counts"]):
            own = positions[:, first : first + count]
            assert np.allclose(own, shown[name] @ turn, rtol=0, atol=3e-6), name
            if name == "Grid":
                faces = clip.polygons[1][np.isin(clip.polygons[1], np.arange(first, first + count))] - first
                assert np.array_equal(faces.reshape(-1, 4), shown["faces"])
            first += count
        assert clip.metadata["fps"] == pytest.approx(FPS, rel=1e-6) and clip.metadata["start_frame"] == 3
        assert clip.frame_count == 10 and "uv" in clip.attributes


MIXED = """
fresh()
scene = bpy.context.scene
scene.render.fps = 24
scene.frame_start, scene.frame_end = 1, 6
bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=5)
ball = bpy.context.object
ball.name = ball.data.name = "Ball"
ball.keyframe_insert("location", frame=1)
ball.location = (0, 0, 2)
ball.keyframe_insert("location", frame=6)
shown = []
for frame in range(1, 7):
    scene.frame_set(frame)
    shown.append(world("Ball"))
ball.modifiers.new("smooth", "SUBSURF")
bpy.ops.wm.alembic_export(filepath=args["path"], start=1, end=6, subdiv_schema=True)
save(shown=shown, sizes=[len(polygon.vertices) for polygon in ball.data.polygons])
"""


@pytest.mark.programs
def test_subdivision_surfaces_of_blender_are_read_with_their_mixed_polygons(blender, tmp_path):
    found = blender.run(MIXED, path=tmp_path / "a.abc")
    with athcodec.read(tmp_path / "a.abc") as clip:
        assert np.allclose(clip.block(0, 6), found["shown"] @ Y_UP, rtol=0, atol=3e-6)
        assert np.array_equal(clip.polygons[0], found["sizes"]) and set(found["sizes"]) == {3, 4}


OPEN = """
fresh()
scene = bpy.context.scene
scene.render.fps, scene.render.fps_base = 24, 1.001
importer = bpy.ops.wm.alembic_import if args["path"].endswith("abc") else bpy.ops.wm.usd_import
importer(filepath=args["path"])
found = {}
for obj in [item for item in bpy.data.objects if item.type == "MESH"]:
    found[obj.name] = []
    for frame in (101, 104, 110):
        scene.frame_set(frame)
        found[obj.name].append(world(obj.name))
grid = next(item for item in bpy.data.objects if item.type == "MESH" and "grid" in item.name)
uv = np.empty(2 * len(grid.data.loops), np.float32)
grid.data.uv_layers[0].data.foreach_get("uv", uv)
save(uv=uv.reshape(-1, 2), faces=[list(polygon.vertices) for polygon in grid.data.polygons],
     names=list(found), kinds=[item.type for item in bpy.data.objects], **found)
"""


@pytest.mark.programs
@pytest.mark.parametrize("suffix", ["abc", "usdc", "usdz"])
def test_blender_opens_what_we_write(blender, tmp_path, suffix):
    uv = whole_plant(tmp_path / "a.usdc")
    with athcodec.read(tmp_path / "a.usdc", only=["grid", "leaf", "hair"]) as clip:
        clip.metadata["unit"] = "m"  # Blender scales a stage in centimetres
        athcodec.write(clip, tmp_path / f"b.{suffix}")
        expected = clip.block(0, 10)
    found = blender.run(OPEN, path=tmp_path / f"b.{suffix}")
    for name, rows in (("grid", slice(0, 12)), ("leaf", slice(12, 15))):
        shown = next(values for key, values in found.items() if key.startswith(name))
        assert np.allclose(shown, expected[[0, 3, 9], rows], rtol=0, atol=2e-6), name
    assert np.array_equal(found["faces"], QUADS) and np.allclose(found["uv"], uv)
    assert {"CURVES", "CURVE"} & set(found["kinds"])
    assert len(GRID) == found["grid"].shape[1]
