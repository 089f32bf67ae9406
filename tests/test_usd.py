"""USD: files that its own library writes are read, and its validators accept what is written."""

from __future__ import annotations

import math
import os
from fractions import Fraction

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, UsdValidation, Vt

import athcodec
from athcodec import cli
from athcodec.errors import ClipError, GuessWarning, SourceWarning
from athcodec.motion.clip import MotionClip

pytestmark = pytest.mark.formats

GRID = np.array([[x, y, 0] for y in range(4) for x in range(3)], np.float32)
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7], [6, 7, 10, 9], [7, 8, 11, 10]], np.int32)
FPS = float(Fraction(24000, 1001))


def vec3(points):
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))


def sway(frame):
    return (GRID + np.sin(frame / 3) * GRID[:, 1:2] * np.array([0.1, 0, 0.05])).astype(np.float32)


def new_stage(path, first=101, last=110, fps=FPS):
    stage = Usd.Stage.CreateNew(str(path))
    stage.SetTimeCodesPerSecond(fps)
    if first is not None:
        stage.SetStartTimeCode(first)
        stage.SetEndTimeCode(last)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    return stage


@pytest.fixture
def stage(tmp_path):
    """A stage without prims, of which a.usda has what it holds when it is saved."""
    return new_stage(tmp_path / "a.usda")


def read_saved(stage, **options):
    stage.Save()
    return read_all(stage.GetRootLayer().realPath, **options)


def add_grid(stage, place="/root/grid", frames=range(101, 111), points=sway):
    mesh = UsdGeom.Mesh.Define(stage, place)
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateFaceVertexCountsAttr([4] * len(QUADS))
    mesh.CreateFaceVertexIndicesAttr(QUADS.reshape(-1).tolist())
    for frame in frames:
        mesh.GetPointsAttr().Set(vec3(points(frame)), frame)
    return mesh


def grid_file(path, leaves=0, **more):
    """A stage that is saved, with the grid and so many leaves."""
    stage = new_stage(path, **more)
    add_grid(stage)
    if leaves:
        add_leaves(stage, count=leaves)
    stage.Save()
    return stage


def read_all(path, **options):
    with athcodec.read(path, **options) as clip:
        return clip, clip.block(0, clip.frame_count)


@pytest.mark.parametrize("suffix", ["usda", "usdc", "usd"])
def test_a_moving_mesh_below_a_moving_transform_is_read_in_world_space(tmp_path, suffix):
    stage = new_stage(tmp_path / f"a.{suffix}")
    root = UsdGeom.Xform.Define(stage, "/root")
    turn, shift = root.AddRotateZOp(), root.AddTranslateOp()
    for frame in (101, 110):
        turn.Set(10.0 * (frame - 101), frame)
        shift.Set(Gf.Vec3d(frame - 101, 0, 5), frame)
    add_grid(stage)
    stage.Save()
    clip, positions = read_all(tmp_path / f"a.{suffix}")
    for i in range(10):
        angle = np.radians(10.0 * i)
        rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        expected = (sway(101 + i) + np.array([i, 0, 5])) @ rotation.T
        assert np.allclose(positions[i], expected, rtol=0, atol=3e-6)
    assert np.array_equal(clip.faces, QUADS) and clip.faces.dtype == np.int32
    parts = {"part_names": ["grid"], "part_kinds": ["mesh"], "domains": {"part_vertex_counts": "constant"}}
    assert clip.metadata == {"fps": FPS, "start_frame": 101, "unit": "cm", "up_axis": "z"} | parts
    assert np.allclose(clip.time, np.arange(10) / FPS, rtol=0, atol=1e-12)


def test_frames_are_the_samples_where_the_stage_has_no_range_or_at_the_rate_of_fps(tmp_path):
    stage = new_stage(tmp_path / "a.usda", first=None, fps=24.0)
    add_grid(stage, frames=[2, 3, 5.5])
    clip, positions = read_saved(stage)
    assert np.allclose(clip.time, [0, 1 / 24, 3.5 / 24]) and clip.metadata["start_frame"] == 2
    assert np.array_equal(positions[2], sway(5.5))
    clip, positions = read_all(tmp_path / "a.usda", fps=48.0)
    assert np.allclose(clip.time, np.arange(8) / 48) and clip.metadata["fps"] == 48
    assert np.allclose(positions[1], (sway(2) + sway(3)) / 2, atol=1e-6)
    stage.SetStartTimeCode(2)
    stage.SetEndTimeCode(6)
    stage.Save()
    with pytest.warns(GuessWarning, match="a.usda: 1 of 3 key times lie between frames at 24 per second"):
        assert read_all(tmp_path / "a.usda")[0].frame_count == 5


def test_units_without_a_symbol_are_kept_in_metres_and_missing_ones_stay_missing(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    add_grid(stage)
    clip, _ = read_saved(stage)
    assert clip.metadata.keys().isdisjoint({"unit", "up_axis", "meters_per_unit"}) and clip.metadata["fps"] == 24
    UsdGeom.SetStageMetersPerUnit(stage, 0.9144)
    clip, yards = read_saved(stage)
    assert clip.metadata["meters_per_unit"] == 0.9144 and "unit" not in clip.metadata
    clip, feet = read_saved(stage, unit="ft")
    assert clip.metadata["unit"] == "ft" and "meters_per_unit" not in clip.metadata
    assert np.allclose(feet, 3 * yards, rtol=1e-6)
    for metres in (0.0, -1.0, math.nan):
        UsdGeom.SetStageMetersPerUnit(stage, metres)
        with pytest.raises(ClipError, match="metersPerUnit: got .* expected a number above 0"):
            read_saved(stage)
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "a.usda"))
    layer.pseudoRoot.SetInfo("metersPerUnit", Vt.Float(0.01))
    layer.Export(str(tmp_path / "a.usdc"))
    assert read_all(tmp_path / "a.usdc")[0].metadata["unit"] == "cm"


def test_a_layer_that_no_search_finds_is_named_as_missing_and_the_rest_is_read(tmp_path):
    stage = grid_file(tmp_path / "a.usda")
    for number, name in enumerate(("none.usda", "asset:none.usda", "./none.usda")):
        stage.DefinePrim(f"/gone{number}").GetReferences().AddReference(name)
    with pytest.warns(SourceWarning, match="missing"):
        clip, _ = read_saved(stage)
    assert clip.vertex_count == len(GRID) and len(clip.not_read["missing"]) == 3


def whole_plant(path):
    """Two meshes of other polygons, curves and points, in a stage with static data of every kind."""
    stage = new_stage(path)
    grid = add_grid(stage)
    api = UsdGeom.PrimvarsAPI(grid)
    uv = np.random.default_rng(1).random((24, 2)).astype(np.float32)
    api.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying").Set(Vt.Vec2fArray.FromNumpy(uv))
    api.CreatePrimvar("branch_id", Sdf.ValueTypeNames.IntArray, "vertex").Set([0] * 6 + [1] * 6)
    api.CreatePrimvar("age", Sdf.ValueTypeNames.FloatArray, "uniform").Set([1, 2, 3, 4, 5, 6])
    leaf = UsdGeom.Mesh.Define(stage, "/root/leaf")
    leaf.CreateSubdivisionSchemeAttr("none")
    leaf.CreateFaceVertexCountsAttr([3])
    leaf.CreateFaceVertexIndicesAttr([0, 2, 1])
    leaf.CreatePointsAttr(vec3([[0, 0, 1], [1, 0, 1], [0, 1, 1]]))
    leaf.CreateNormalsAttr(vec3([[0, 0, -1]] * 3))
    leaf.AddTranslateOp().Set(Gf.Vec3d(0, 0, 3))
    hair = UsdGeom.BasisCurves.Define(stage, "/root/hair")
    hair.CreateTypeAttr("linear")
    hair.CreateCurveVertexCountsAttr([3, 2])
    hair.CreateWidthsAttr([0.5, 0.4, 0.3, 0.2, 0.1])
    hair.SetWidthsInterpolation("vertex")
    for frame in (101, 110):
        hair.GetPointsAttr().Set(vec3(np.arange(15).reshape(5, 3) + frame), frame)
    dust = UsdGeom.Points.Define(stage, "/root/dust")
    dust.CreatePointsAttr(vec3([[9, 9, 9], [8, 8, 8]]))
    stage.Save()
    return uv


def test_several_prims_are_one_clip_and_their_static_data_is_kept(tmp_path):
    uv = whole_plant(tmp_path / "a.usdc")
    clip, positions = read_all(tmp_path / "a.usdc")
    assert clip.metadata["part_names"] == ["grid", "leaf", "hair", "dust"]
    assert clip.metadata["part_kinds"] == ["mesh", "mesh", "curves", "points"]
    assert clip.attributes["part_vertex_counts"].tolist() == [12, 3, 5, 2]
    counts, indices = clip.polygons
    assert counts.tolist() == [4] * 6 + [3] and indices.tolist() == [*QUADS.reshape(-1), 12, 14, 13]
    assert clip.edges.tolist() == [[15, 16], [16, 17], [18, 19]]
    assert np.array_equal(clip.attributes["uv"][:24], uv) and clip.attributes["uv"].shape == (27, 2)
    assert clip.attributes["branch_id"].tolist() == [0] * 6 + [1] * 6 + [0] * 10
    assert clip.attributes["age"].tolist() == [1, 2, 3, 4, 5, 6, 0]
    assert np.allclose(clip.attributes["radius"], [0] * 15 + [0.25, 0.2, 0.15, 0.1, 0.05] + [0] * 2)
    assert np.array_equal(clip.attributes["normals"][12:15], [[0, 0, -1]] * 3)
    assert clip.metadata["domains"]["uv"] == "corner" and clip.metadata["domains"]["age"] == "face"
    assert np.array_equal(positions[4, 12:15], [[0, 0, 4], [1, 0, 4], [0, 1, 4]])
    assert np.allclose(positions[3, 15:20], np.arange(15).reshape(5, 3) + 104)


def test_only_and_skip_choose_prims_and_arrays(tmp_path):
    whole_plant(tmp_path / "a.usdc")
    clip, _ = read_all(tmp_path / "a.usdc", only=["le*", "/root/dust"], skip=["normals"])
    assert clip.metadata["part_names"] == ["leaf", "dust"] and clip.vertex_count == 5
    assert "normals" not in clip.attributes
    with pytest.raises(ClipError, match="a.usdc: prims: got none with points named like bark"):
        athcodec.read(tmp_path / "a.usdc", only=["bark"])


def test_instances_are_read_where_they_stand_and_what_is_hidden_is_not(stage):
    stage.CreateClassPrim("/proto")
    add_grid(stage, "/proto/grid")
    for i in range(2):
        prim = stage.DefinePrim(f"/tree{i}", "Xform")
        prim.GetReferences().AddInternalReference("/proto")
        prim.SetInstanceable(True)
        UsdGeom.Xform(prim).AddTranslateOp().Set(Gf.Vec3d(10 * i, 0, 0))
    UsdGeom.Imageable(add_grid(stage, "/hidden")).MakeInvisible()
    add_grid(stage, "/late").GetVisibilityAttr().Set("invisible", 101)
    stage.GetPrimAtPath("/late").GetAttribute("visibility").Set("inherited", 105)
    for purpose in ("guide", "proxy"):
        UsdGeom.Imageable(add_grid(stage, f"/{purpose}")).CreatePurposeAttr(purpose)
    clip, positions = read_saved(stage)
    assert sorted(clip.metadata["part_names"]) == ["/late", "/tree0/grid", "/tree1/grid"]
    first = 12 * clip.metadata["part_names"].index("/tree0/grid")
    assert np.allclose(positions[:, first + 12 : first + 24] - positions[:, first : first + 12], [10, 0, 0], atol=1e-5)


LEAF = np.array([[0, 0, 0], [0.2, 0.1, 0], [0.4, 0, 0], [0.2, -0.1, 0]], np.float32)


def add_leaves(stage, place="/root/leaves", count=5, frames=range(101, 111)):
    """Two kinds of leaves on an instancer that turns and moves them, and a thorn that none of them is."""
    instancer = UsdGeom.PointInstancer.Define(stage, place)
    instancer.AddTranslateOp().Set(Gf.Vec3d(0, 0, 2))
    for name, size in (("small", 1), ("large", 2), ("thorn", 3)):
        mesh = UsdGeom.Mesh.Define(stage, f"{place}/prototypes/{name}/blade")
        mesh.CreateSubdivisionSchemeAttr("none")
        mesh.CreatePointsAttr(vec3(LEAF))
        mesh.CreateFaceVertexCountsAttr([3, 3])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 3, 1, 2, 3])
        mesh.AddTranslateOp().Set(Gf.Vec3d(0.1, 0, 0))
        UsdGeom.Xform.Define(stage, f"{place}/prototypes/{name}").AddScaleOp().Set(Gf.Vec3f(size))
    instancer.CreatePrototypesRel().SetTargets([f"{place}/prototypes/{name}" for name in ("small", "large", "thorn")])
    instancer.CreateProtoIndicesAttr([i % 2 for i in range(count)])
    UsdGeom.PrimvarsAPI(instancer).CreatePrimvar("age", Sdf.ValueTypeNames.FloatArray, "vertex").Set(list(range(count)))
    places = {}
    for frame in frames:
        angle = 10.0 * (frame - 101)
        shifts = np.array([[i, 0.1 * i * (frame - 101), 0] for i in range(count)])
        instancer.GetPositionsAttr().Set(vec3(shifts), frame)
        turns = Vt.QuathArray(
            [Gf.Quath(Gf.Rotation(Gf.Vec3d(0, 0, 1), angle + 20 * i).GetQuat()) for i in range(count)]
        )
        instancer.GetOrientationsAttr().Set(turns, frame)
        places[frame] = shifts, np.radians(angle + 20 * np.arange(count))
    return instancer, places


def leafy_stage(path, grid=True):
    """A grid, where it is wanted, and leaves."""
    stage = new_stage(path)
    if grid:
        add_grid(stage)
    _, places = add_leaves(stage)
    stage.Save()
    return places


def leaf_at(shift, angle, size):
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return (LEAF + [0.1, 0, 0]) * size @ turn + shift + [0, 0, 2]


def test_a_point_instancer_is_read_as_copies_of_its_prototypes(tmp_path):
    places = leafy_stage(tmp_path / "a.usda")
    clip, positions = read_all(tmp_path / "a.usda")
    leaves = [f"/root/leaves:prototypes/{name}/blade" for name in ("small", "large")]
    assert clip.metadata["part_names"] == ["/root/grid", *leaves]
    assert clip.attributes["part_vertex_counts"].tolist() == [12, 12, 8]
    assert clip.attributes["part_copies"].tolist() == [1, 3, 2]
    assert clip.attributes["age"].tolist() == [0] * 12 + [0] * 4 + [2] * 4 + [4] * 4 + [1] * 4 + [3] * 4
    for row, frame in enumerate(range(101, 111)):
        shifts, angles = places[frame]
        expected = [leaf_at(shifts[i], angles[i], 1 + i % 2) for i in (0, 2, 4, 1, 3)]
        assert np.allclose(positions[row, 12:], np.concatenate(expected), rtol=0, atol=2e-3)  # half floats turn them
    counts, corners = clip.polygons
    corners = corners[24:36].reshape(4, 3).tolist()
    assert counts.tolist() == [4] * 6 + [3] * 10
    assert corners == [[12, 13, 15], [13, 14, 15], [16, 17, 19], [17, 18, 19]]
    with athcodec.read(tmp_path / "a.usda") as clip:
        found = athcodec.find_branches(clip)
    assert len(found.branch_parent) == 6 and len(set(found.vertex_branch[12:16])) == 1


@pytest.mark.parametrize("suffix", ["usda", "abc"])
@pytest.mark.parametrize("instances", [True, False])
def test_copies_come_back_as_copies_from_the_formats_that_have_instances(tmp_path, suffix, instances):
    grid_file(tmp_path / "a.usda", leaves=9)
    with athcodec.read(tmp_path / "a.usda") as clip:
        clip.attributes["noise"] = np.random.default_rng(0).random(clip.vertex_count).astype(np.float32)
        written = athcodec.write(clip, tmp_path / f"b.{suffix}", instances=instances)
        with athcodec.read(tmp_path / f"b.{suffix}") as again:
            off = np.linalg.norm(again.block(0, 10).astype(float) - clip.block(0, 10), axis=2).max()
            assert off <= written.facts.get("max_error", 0) + 1e-5 and bool(written.facts) == instances
            assert np.array_equal(again.polygons[1], clip.polygons[1])
            for name in ("part_vertex_counts", "part_copies", "age", "noise"):
                assert np.array_equal(again.attributes[name], clip.attributes[name]), name


def test_copies_are_written_as_instances_again(tmp_path, capsys):
    grid_file(tmp_path / "a.usda", leaves=40)
    with athcodec.read(tmp_path / "a.usda") as clip:
        written = athcodec.write(clip, tmp_path / "b.usda", instances=True)
        assert written.facts["instances"] == 40 and written.facts["max_error"] + 1e-5 < 1e-3
        athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-3)
    stage = Usd.Stage.Open(str(tmp_path / "b.usda"))
    kinds = [prim.GetTypeName() for prim in stage.Traverse()]
    assert kinds.count("PointInstancer") == 2 and complaints(tmp_path / "b.usda") == []
    assert cli.main(["decode", str(tmp_path / "a.ath"), str(tmp_path / "c.usdc"), "--instances"]) == 0
    assert "Written as instances, the motion is off this level by up to" in capsys.readouterr().out
    with athcodec.open(tmp_path / "a.ath") as decoder, athcodec.read(tmp_path / "c.usdc") as again:
        off = np.linalg.norm(again.block(0, 10).astype(float) - decoder.positions(slice(0, 10)), axis=2).max()
        assert again.attributes["part_copies"].tolist() == [1, 20, 20] and off <= 1.01 * decoder.file.max_error_bound


def test_copies_that_are_written_as_one_mesh_although_instances_were_asked_for_are_named(stage, tmp_path):
    instancer, _ = add_leaves(stage)
    instancer.CreateScalesAttr([(-1, 1, 1), (1, 1, 1), (1, 1, 1), (1, 1, 1), (1, 1, 1)])
    stage.Save()
    for name in ("b.usda", "b.abc", "b.glb"):
        with athcodec.read(tmp_path / "a.usda") as clip:
            [lost] = athcodec.write(clip, tmp_path / name, instances=True).facts["not_written"].items()
        assert lost[0].startswith("copies as instances (mirrored") and "small/blade (3 in one mesh)" in lost[1][0], name


def test_what_of_a_point_instancer_is_never_seen_is_not_read(stage, tmp_path):
    instancer, _ = add_leaves(stage)
    instancer.CreateInvisibleIdsAttr([0, 3])
    instancer.GetInvisibleIdsAttr().Set([0], 105)
    clip, _ = read_saved(stage)
    assert clip.attributes["part_copies"].tolist() == [2, 2]
    instancer.GetProtoIndicesAttr().Set([0] * 5, 104)
    instancer.GetProtoIndicesAttr().Set([1] * 5, 105)
    stage.Save()
    with pytest.raises(ClipError, match="protoIndices changes in frame"):
        athcodec.read(tmp_path / "a.usda")


def test_what_is_not_read_is_named_once(stage, tmp_path, capsys):
    add_grid(stage)
    for i in range(2):
        UsdGeom.Cube.Define(stage, f"/root/box{i}")
    UsdGeom.Camera.Define(stage, "/eye")
    stage.DefinePrim("/root/bark", "Material")
    stage.DefinePrim("/root/bark/shader", "Shader")
    wet = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/root/grid")).CreatePrimvar("wet", Sdf.ValueTypeNames.Float)
    wet.Set(0.5, 101)
    wet.Set(0.7, 103)
    stage.DefinePrim("/gone").GetReferences().AddReference("./none.usda")
    with pytest.warns(SourceWarning, match="Cube /root/box0, /root/box1$") as said:
        clip, _ = read_saved(stage)
    assert len(said) == 1
    found = {kind: len(names) for kind, names in clip.not_read.items()}
    assert found == {"missing": 1, "Material": 1, "Cube": 2, "Camera": 1, "attribute": 1}
    assert cli.main(["encode", str(tmp_path / "a.usda"), str(tmp_path / "a.ath")]) == 0
    [line] = [line for line in capsys.readouterr().err.splitlines() if "not read" in line]
    assert line.startswith(f"athcodec: not read: {tmp_path / 'a.usda'}: missing ")
    kept = "(names are kept for each face, contents only in a GLB by `encode --into`)"
    assert line.endswith(
        f"Cube /root/box0, /root/box1; Material /root/bark {kept}; Camera /eye; attribute /root/grid.wet "
        "(they change in time, do not fit their object, or are of a kind that is not kept)"
    )


def test_the_scheme_of_a_surface_comes_back_and_what_else_is_authored_is_named(stage, tmp_path, capsys):
    mesh = add_grid(stage)
    mesh.CreateSubdivisionSchemeAttr("loop")
    mesh.CreateHoleIndicesAttr([1])
    mesh.CreateCornerIndicesAttr([])
    mesh.CreateInterpolateBoundaryAttr("edgeAndCorner")  # This is USD's fallback.
    mesh.CreateVelocitiesAttr(vec3(GRID))
    mesh.GetPrim().SetCustomData({"author": "me"})
    mesh.GetPrim().CreateAttribute("userProperties:height", Sdf.ValueTypeNames.Float).Set(3.5)
    add_grid(stage, "/root/smooth").GetPrim().RemoveProperty("subdivisionScheme")
    with pytest.warns(SourceWarning, match="not read: subdivision /root/grid.holeIndices$"):
        clip, _ = read_saved(stage)
    named = [f"/root/grid.{name}" for name in ("userProperties", "velocities", "customData")]
    assert clip.not_read == {"subdivision": ["/root/grid.holeIndices"], "attribute": named}
    assert cli.main(["encode", str(tmp_path / "a.usda"), str(tmp_path / "a.ath")]) == 0
    assert cli.main(["decode", str(tmp_path / "a.ath"), str(tmp_path / "b.usda")]) == 0
    again = Usd.Stage.Open(str(tmp_path / "b.usda"))
    meshes = map(UsdGeom.Mesh, again.GetDefaultPrim().GetChildren())
    assert [each.GetSubdivisionSchemeAttr().Get() for each in meshes] == ["loop", "catmullClark"]
    assert "not written" not in capsys.readouterr().err
    assert cli.main(["decode", str(tmp_path / "a.ath"), str(tmp_path / "b.glb")]) == 0
    assert "subdivisionScheme grid, smooth" in capsys.readouterr().err


def test_a_primvar_without_usable_indices_is_named_and_does_not_refuse_the_stage(stage):
    prim = add_grid(stage).GetPrim()
    UsdGeom.PrimvarsAPI(prim).CreatePrimvar("hue", Sdf.ValueTypeNames.FloatArray, "vertex").Set([1.0])
    prim.CreateAttribute("primvars:hue:indices", Sdf.ValueTypeNames.UIntArray).Set([0] * 12)
    clip, _ = read_saved(stage)
    assert clip.not_read == {"attribute": ["/root/grid.hue"]}


def test_arrays_that_change_in_a_single_frame_are_named_and_those_with_equal_samples_stay(stage):
    primvars = UsdGeom.PrimvarsAPI(add_grid(stage))
    twig = UsdGeom.BasisCurves.Define(stage, "/root/twig")
    twig.CreateCurveVertexCountsAttr([2])
    twig.CreatePointsAttr(vec3(GRID[:2]))
    for name, changes in (("wet", True), ("dry", False)):
        primvar = primvars.CreatePrimvar(name, Sdf.ValueTypeNames.FloatArray, "uniform")
        for frame in range(101, 111):
            primvar.Set([float(changes and frame == 104)] * len(QUADS), frame)
            twig.GetWidthsAttr().Set([1.0 + (frame == 107)] * 2, frame)
    clip, _ = read_saved(stage)
    assert clip.not_read == {"attribute": ["/root/grid.wet", "/root/twig.widths"]}
    assert "dry" in clip.attributes and not clip.attributes.keys() & {"wet", "radius"}


@pytest.mark.parametrize("mirrored", [101, 105, 110])
def test_a_mesh_that_turns_inside_out_in_a_single_frame_is_named(stage, mirrored):
    scale = UsdGeom.Xform.Define(stage, "/root").AddScaleOp()
    for frame in range(101, 111):
        scale.Set(Gf.Vec3f(-1 if frame == mirrored else 1, 1, 1), frame)
    add_grid(stage)
    with pytest.warns(SourceWarning, match="not read: faces that turn inside out in time /root/grid"):
        read_saved(stage)


def skinned(path):
    """A grid on two joints that turn, and a bump that swells by a blend shape."""
    stage = new_stage(path)
    UsdSkel.Root.Define(stage, "/plant")
    skeleton = UsdSkel.Skeleton.Define(stage, "/plant/skeleton")
    skeleton.CreateJointsAttr(["stem", "stem/twig"])
    bind = [Gf.Matrix4d(1), Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 2, 0))]
    skeleton.CreateBindTransformsAttr(bind)
    skeleton.CreateRestTransformsAttr(bind)
    UsdGeom.Xform(skeleton).AddTranslateOp().Set(Gf.Vec3d(0, 0, 7))
    animation = UsdSkel.Animation.Define(stage, "/plant/animation")
    animation.CreateJointsAttr(["stem", "stem/twig"])
    animation.CreateTranslationsAttr([Gf.Vec3f(0), Gf.Vec3f(0, 2, 0)])
    animation.CreateScalesAttr([Gf.Vec3h(1), Gf.Vec3h(1)])
    animation.CreateBlendShapesAttr(["bump"])
    for frame in (101, 110):
        turn = Gf.Quatf(Gf.Rotation(Gf.Vec3d(0, 0, 1), 5.0 * (frame - 101)).GetQuat())
        animation.GetRotationsAttr().Set([Gf.Quatf(1), turn], frame)
        animation.GetBlendShapeWeightsAttr().Set([(frame - 101) / 9], frame)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets(["/plant/animation"])
    mesh = add_grid(stage, "/plant/mesh", frames=[])
    mesh.CreatePointsAttr(vec3(GRID))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets(["/plant/skeleton"])
    heights = GRID[:, 1] / 3
    binding.CreateJointIndicesPrimvar(False, 2).Set(Vt.IntArray([0, 1] * 12))
    weights = np.stack([1 - heights, heights], axis=1).astype(np.float32)
    binding.CreateJointWeightsPrimvar(False, 2).Set(Vt.FloatArray.FromNumpy(weights.reshape(-1)))
    bump = UsdSkel.BlendShape.Define(stage, "/plant/mesh/bump")
    bump.CreateOffsetsAttr([Gf.Vec3f(0, 0, 1)])
    bump.CreatePointIndicesAttr([4])
    binding.CreateBlendShapesAttr(["bump"])
    binding.CreateBlendShapeTargetsRel().SetTargets(["/plant/mesh/bump"])
    stage.Save()
    return weights


def test_skeletons_and_blend_shapes_are_evaluated_and_the_joints_are_kept(tmp_path):
    weights = skinned(tmp_path / "a.usda")
    clip, positions = read_all(tmp_path / "a.usda")
    for i in (0, 9):
        angle = np.radians(5.0 * i)
        rotation = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        points = GRID.astype(float)
        points[4, 2] += i / 9
        twig = (points - [0, 2, 0]) @ rotation.T + [0, 2, 0]
        expected = weights[:, :1] * points + weights[:, 1:] * twig + [0, 0, 7]
        assert np.allclose(positions[i], expected, rtol=0, atol=2e-6)
    assert clip.skin.joint_parent.tolist() == [-1, 0] and list(clip.skin.names) == ["stem", "stem/twig"]
    assert clip.skin.vertex_joint.tolist() == [0] * 6 + [1] * 6


def test_objects_beside_a_skinned_mesh_are_branches_on_the_nearest_joint(tmp_path):
    skinned(tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    bark = UsdShade.Material.Define(stage, "/bark")
    plant = stage.GetPrimAtPath("/plant/mesh")
    subset = UsdShade.MaterialBindingAPI.Apply(plant).CreateMaterialBindSubset("low", [0, 1])
    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(bark)
    for number, height in enumerate((0, 3)):
        leaf = UsdGeom.Mesh.Define(stage, f"/leaf{number}")
        leaf.CreatePointsAttr(vec3(GRID[:3] + [5, height, 7]))
        leaf.CreateFaceVertexCountsAttr([3])
        leaf.CreateFaceVertexIndicesAttr([0, 1, 2])
    stage.Save()
    with athcodec.read(tmp_path / "a.usda") as clip:
        assert clip.not_read == {"Material": ["/bark"]} and not any(name.startswith("skel") for name in clip.attributes)
        assert clip.attributes["face_material"].tolist() == [0, 0] + [-1] * (len(clip.polygons[0]) - 2)
        found = athcodec.find_branches(clip)
        assert found.method == "skeleton" and len(found.branch_parent) == 4
        leaves = found.vertex_branch[[12, 15]]
        assert found.branch_parent[leaves].tolist() == [found.vertex_branch[0], found.vertex_branch[11]]


@pytest.mark.parametrize("change", ["faces", "points"])
def test_a_topology_that_changes_is_refused_with_its_frame(stage, tmp_path, change):
    mesh = add_grid(stage)
    if change == "faces":
        mesh.GetFaceVertexIndicesAttr().Set(QUADS.reshape(-1).tolist(), 101)
        mesh.GetFaceVertexIndicesAttr().Set(QUADS[:, ::-1].reshape(-1).tolist(), 104)
    else:
        for frame in range(104, 111):
            mesh.GetPointsAttr().Set(vec3(GRID[:-1]), frame)
    stage.Save()
    with pytest.raises(ClipError, match=r"frame 3 \(time code 104\)"):
        with athcodec.read(tmp_path / "a.usda") as clip:
            clip.block(0, clip.frame_count)


def test_a_file_that_changes_while_it_is_read_is_noticed_and_read_afresh_the_next_time(tmp_path):
    path = tmp_path / "a.usda"
    grid_file(path)
    with athcodec.read(path) as clip:
        assert clip.unchanged()
        text = path.read_text().replace("0.01", "1.0")
        path.write_text(text)
        os.utime(path, (1, 1))
        assert not clip.unchanged()
        with athcodec.read(path) as again:
            assert again.metadata["unit"] == "m"


# ---- export ----


def complaints(path):
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    context = UsdValidation.ValidationContext(validators)
    stage = Usd.Stage.Open(str(path))
    return [f"{error.GetName()} {error.GetMessage()}" for error in context.Validate(stage)]


def assert_same(a, b):
    """Everything that a clip from USD holds."""
    assert np.array_equal(a.block(0, a.frame_count), b.block(0, b.frame_count))
    assert np.allclose(a.time, b.time, rtol=0, atol=1e-9) and np.array_equal(a.rest, b.rest)
    assert a.metadata == b.metadata
    assert a.attributes.keys() == b.attributes.keys()
    for name, values in a.attributes.items():
        assert np.array_equal(values, b.attributes[name]) and values.dtype == b.attributes[name].dtype, name
    for name in ("faces", "edges", "vertex_branch", "branch_parent", "stem_index"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None) == (y is None) and (x is None or np.array_equal(x, y)), name


@pytest.mark.parametrize("suffix", ["usda", "usdc", "usd", "usdz", "abc"])
def test_what_was_read_is_written_again_as_it_was(tmp_path, suffix):
    whole_plant(tmp_path / "a.usdc")
    out = tmp_path / f"b.{suffix}"
    with athcodec.read(tmp_path / "a.usdc") as clip:
        athcodec.write(clip, out)
        with athcodec.read(out) as again:
            assert_same(clip, again)
    assert set(os.listdir(tmp_path)) == {"a.usdc", out.name}
    assert suffix == "abc" or complaints(out) == []


def test_usd_reads_our_file_with_samples_of_what_moves_only(tmp_path):
    whole_plant(tmp_path / "a.usdc")
    with athcodec.read(tmp_path / "a.usdc") as clip:
        athcodec.write(clip, tmp_path / "b.usdc")
        expected = clip.block(0, 10)
    stage = Usd.Stage.Open(str(tmp_path / "b.usdc"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (101, 110)
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == FPS
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01 and UsdGeom.GetStageUpAxis(stage) == "Z"
    prims = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.PointBased)]
    assert [prim.GetName() for prim in prims] == ["grid", "leaf", "hair", "dust"]
    assert [prim.GetTypeName() for prim in prims] == ["Mesh", "Mesh", "BasisCurves", "Points"]
    assert UsdGeom.Mesh(prims[0]).GetSubdivisionSchemeAttr().Get() == "none"
    arrays = [
        {str(each.GetPrimvarName()) for each in UsdGeom.PrimvarsAPI(prim).GetAuthoredPrimvars()} for prim in prims
    ]
    every = {"branch_id", "normals", "displayColor"}
    assert arrays == [every | {"st", "age", "radius"}] * 2 + [every] * 2
    for i, code in enumerate(range(101, 111)):
        points = np.concatenate([np.array(UsdGeom.PointBased(prim).GetPointsAttr().Get(code)) for prim in prims])
        assert np.array_equal(points, expected[i])
        for prim in prims:
            wanted = UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), code)
            assert np.allclose(wanted, UsdGeom.Boundable(prim).GetExtentAttr().Get(code), atol=1e-5)
    for attribute in (found for prim in prims for found in prim.GetAttributes() if found.GetNumTimeSamples()):
        assert attribute.GetName() in ("points", "extent")


def awkward_clip():
    """Numbers and records that USD has no types for, steps in time that differ, no parts, an axis USD does not know."""
    rng = np.random.default_rng(3)
    record = np.array([(1, 2.5), (3, 4.5)], [("a", "<i2"), ("b", "<f8")])
    return MotionClip(
        positions=rng.random((5, 12, 3), np.float32),
        time=np.array([0, 0.1, 0.3, 0.35, 2.0]),
        faces=QUADS,
        vertex_branch=np.repeat([0, 1], 6),
        branch_parent=np.array([-1, 0]),
        edges=np.array([[0, 1], [6, 7]], np.uint16),
        stem_index=np.array([5, 4, 3, 2, 1, 0] * 2),
        attributes={
            "age": np.arange(12, dtype=np.int16),
            "mass": np.arange(2.0),
            "record": record,
            "alive": np.ones(12, bool),
            "scans/first": rng.random((12, 3)),
            "matrix": rng.random((12, 3, 3)),
            "species": np.array([b"oak"]),
            "big": np.arange(12, dtype=">i4"),
            "face_kind": np.arange(6, dtype=np.uint8),
        },
        metadata={
            "unit": "m",
            "up_axis": "x",
            "note": "wind from the west",
            "fps": 30.0,
            "start_frame": 7,
            "domains": {"mass": "branch", "record": "constant", "species": "constant", "face_kind": "face"},
        },
    )


@pytest.mark.parametrize("suffix", ["usdc", "abc"])
def test_data_without_a_place_in_a_format_come_back(tmp_path, suffix):
    clip = awkward_clip()
    athcodec.write(clip, tmp_path / f"a.{suffix}")
    with athcodec.read(tmp_path / f"a.{suffix}") as again:
        for name, values in clip.attributes.items():
            assert np.array_equal(again.attributes[name], values) and again.attributes[name].dtype == values.dtype, name
        for name in ("vertex_branch", "branch_parent", "edges", "rest", "stem_index", "faces"):
            assert np.array_equal(getattr(again, name), getattr(clip, name)), name
        assert np.allclose(again.time, clip.time, rtol=0, atol=1e-7)
        for name in ("unit", "up_axis", "note", "fps", "start_frame"):
            assert again.metadata[name] == clip.metadata[name]
        assert np.array_equal(again.block(0, 5), clip.block(0, 5))


def test_a_plant_of_edges_becomes_curves_that_keep_its_order(tmp_path, sample_clip):
    athcodec.write(sample_clip, tmp_path / "a.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    curves = next(UsdGeom.BasisCurves(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves))
    assert sum(curves.GetCurveVertexCountsAttr().Get()) == sample_clip.vertex_count
    assert len(curves.GetCurveVertexCountsAttr().Get()) > 90
    with athcodec.read(tmp_path / "a.usdc") as again:
        assert np.array_equal(again.edges, sample_clip.edges)
        assert np.array_equal(again.vertex_branch, sample_clip.vertex_branch)


def test_points_that_appear_are_refused_with_what_to_do(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    points = UsdGeom.Points.Define(stage, "/spores").GetPointsAttr()
    for frame, count in enumerate((0, 4, 8)):
        points.Set([(i, frame, 0) for i in range(count)], frame)
    UsdGeom.Points.Define(stage, "/trunk").GetPointsAttr().Set([(0, 0, 0), (0, 5, 0)])
    stage.Save()
    with pytest.raises(ClipError, match=r"/spores: got 4 points in frame 1 .*appear or vanish .*--only"):
        with athcodec.read(tmp_path / "a.usda") as clip:
            clip.block(0, 3)
