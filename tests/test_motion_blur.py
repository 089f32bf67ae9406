"""Velocities and samples between frames in USD and Alembic, as the libraries of these formats read them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from alembic3d import Abc, AbcGeom
from pxr import Usd, UsdGeom
from test_usd import FPS, complaints, grid_file, read_all, whole_plant

import athcodec
from athcodec import cli

pytestmark = pytest.mark.formats


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """A file of a mesh, leaves, curves and points, in centimetres, z up, at 23.976 frames a second."""
    folder = tmp_path_factory.mktemp("plant")
    whole_plant(folder / "a.usdc")
    athcodec.encode(folder / "a.usdc", folder / "a.ath", rel_error=1e-3, effort="fast")
    return folder / "a.ath"


def usd_samples(path):
    """Time codes, points and velocities of all objects of a file of USD."""
    stage = Usd.Stage.Open(str(path))
    objects = [UsdGeom.PointBased(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.PointBased)]
    codes = objects[0].GetPointsAttr().GetTimeSamples()
    found = []
    for attributes in ([each.GetPointsAttr() for each in objects], [each.GetVelocitiesAttr() for each in objects]):
        assert all(attribute.GetTimeSamples() in (codes, []) for attribute in attributes)
        is_there = attributes[0].HasAuthoredValue()
        found.append(
            np.array([np.concatenate([each.Get(code) for each in attributes]) for code in codes]) if is_there else None
        )
    return np.array(codes) / stage.GetTimeCodesPerSecond(), *found


def alembic_samples(path):
    """Seconds, points and velocities of all objects of an archive."""
    archive = Abc.IArchive(str(path))
    root = archive.getTop().getChild(0)
    found = []
    for number in range(root.getNumChildren()):
        child = root.getChild(number).getChild(0)
        kind = next(
            kind for kind in (AbcGeom.IPolyMesh, AbcGeom.ICurves, AbcGeom.IPoints) if kind.matches(child.getHeader())
        )
        found.append(kind(child, Abc.WrapExistingFlag.kWrapExisting).getSchema())
    counts = {schema.getNumSamples() for schema in found}
    assert len(counts) == 1
    times = [found[0].getTimeSampling().getSampleTime(i) for i in range(*counts)]
    arrays = []
    for properties in (
        [schema.getPositionsProperty() for schema in found],
        [schema.getVelocitiesProperty() for schema in found],
    ):
        frames = zip(*(each.samples for each in properties)) if properties[0].valid() else []
        arrays.append(np.array([np.concatenate([np.array(part) for part in parts]) for parts in frames]))
    return np.array(times), arrays[0], arrays[1] if len(arrays[1]) else None


READERS = {"usdc": usd_samples, "usda": usd_samples, "abc": alembic_samples}


@pytest.mark.parametrize("suffix", READERS)
@pytest.mark.parametrize("samples", [1, 2])
def test_velocities_are_differences_of_the_decoded_positions_per_second(plant, tmp_path, suffix, samples):
    out = tmp_path / f"b.{suffix}"
    with athcodec.open(plant) as decoder:
        written = athcodec.write(decoder, out, velocities=True, samples=samples)
        moments = np.arange(samples * 9 + 1) / samples / FPS
        expected = decoder.at(moments)
    times, points, velocities = READERS[suffix](out)
    assert np.allclose(times, 101 / FPS + moments, rtol=0, atol=1e-7)
    assert np.allclose(points, expected, rtol=0, atol=1e-5)
    assert np.allclose(velocities, np.gradient(points.astype(float), times, axis=0), rtol=1e-4, atol=2e-3)
    assert np.ptp(velocities, axis=0).max() > 1  # It is a plant that moves.
    assert written.facts.get("samples") == (19 if samples == 2 else None)
    assert suffix == "abc" or complaints(out) == []


@pytest.mark.parametrize("suffix", ["usdc", "abc"])
def test_samples_between_frames_are_read_back_and_velocities_are_named_as_not_read(plant, tmp_path, suffix):
    out = tmp_path / f"b.{suffix}"
    with athcodec.open(plant) as decoder:
        athcodec.write(decoder, out, velocities=True, samples=2)
        expected = decoder.at(np.arange(19) / 2 / FPS)
    clip, positions = read_all(out)
    assert np.allclose(positions, expected, rtol=0, atol=1e-5) and np.allclose(clip.time, np.arange(19) / 2 / FPS)
    assert clip.metadata["fps"] == FPS and clip.metadata["start_frame"] == 101
    named = [name.split("/")[-1] for name in clip.not_read["attribute"]]
    assert named == [f"{name}.velocities" for name in ("grid", "leaf", "hair", "dust")]


@pytest.mark.parametrize("suffix", ["usdc", "abc"])
def test_without_the_options_a_file_has_no_velocities_and_its_frames_alone(plant, tmp_path, suffix):
    out = tmp_path / f"b.{suffix}"
    assert cli.main(["decode", str(plant), str(out)]) == 0
    times, _, velocities = READERS[suffix](out)
    assert len(times) == 10 and velocities is None


def test_usd_moves_points_by_the_velocities_that_are_written(plant, tmp_path):
    with athcodec.open(plant) as decoder:
        athcodec.write(decoder, tmp_path / "b.usdc", velocities=True)
        here, before, after = decoder[4], decoder[3], decoder[5]
    stage = Usd.Stage.Open(str(tmp_path / "b.usdc"))
    grid = UsdGeom.PointBased(stage.GetPrimAtPath("/clip/grid"))
    [points] = grid.ComputePointsAtTimes([Usd.TimeCode(105.25)], Usd.TimeCode(105))
    expected = here + 0.25 * (after - before) / 2
    assert np.allclose(points, expected[:12], rtol=0, atol=1e-4)


def test_instances_of_usd_have_velocities_and_turns_that_lead_to_the_next_frame(tmp_path):
    grid_file(tmp_path / "a.usda", leaves=9)
    with athcodec.read(tmp_path / "a.usda") as clip:
        athcodec.write(clip, tmp_path / "b.usda", instances=True, velocities=True)
    stage = Usd.Stage.Open(str(tmp_path / "b.usda"))
    instancer = next(UsdGeom.PointInstancer(p) for p in stage.Traverse() if p.IsA(UsdGeom.PointInstancer))
    angular = instancer.GetAngularVelocitiesAttr()
    assert angular.GetTimeSamples() == instancer.GetVelocitiesAttr().GetTimeSamples() == list(range(101, 111))
    assert np.abs(np.array(angular.Get(105))).max() > 1
    # At the first sample both are those to the next one, so that USD goes there by itself.
    first, code = [Usd.TimeCode(number) for number in (101, 102)]
    moved = np.array(instancer.ComputeInstanceTransformsAtTime(code, first))
    there = np.array(instancer.ComputeInstanceTransformsAtTime(code, code))
    start = np.array(instancer.ComputeInstanceTransformsAtTime(first, first))
    assert np.abs(moved - there).max() < 0.02 * np.abs(start - there).max() + 1e-4
    assert complaints(tmp_path / "b.usda") == []
    clip, _ = read_all(tmp_path / "b.usda")
    assert {name.rpartition(".")[2] for name in clip.not_read["attribute"]} == {"velocities", "angularVelocities"}


def test_decode_writes_velocities_and_samples_and_says_how_many(plant, tmp_path, capsys):
    out = tmp_path / "b.abc"
    assert cli.main(["decode", str(plant), str(out), "--velocities", "--samples", "2"]) == 0
    assert "b.abc: 10 frames in 19 samples, " in capsys.readouterr().out
    times, _, velocities = alembic_samples(out)
    assert len(times) == len(velocities) == 19
    assert cli.main(["decode", str(plant), str(out), "--samples", "4", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["samples"] == 37
    assert cli.main(["decode", str(plant), str(tmp_path / "b.glb"), "--velocities"]) == 1
    assert "velocities: got gltf, expected one of usd, alembic" in capsys.readouterr().err


def test_a_mesh_that_moves_with_a_plant_gets_velocities_and_samples_too(plant, tmp_path):
    with athcodec.open(plant) as decoder, athcodec.onto(decoder, decoder.file.rest[:12]) as mesh:
        athcodec.write(mesh.clip, tmp_path / "b.usdc", velocities=True, samples=2)
        frames = mesh[:]
    _, points, velocities = usd_samples(tmp_path / "b.usdc")
    assert np.allclose(points[::2], frames, rtol=0, atol=1e-5)
    assert np.allclose(points[1::2], (frames[1:] + frames[:-1]) / 2, rtol=0, atol=1e-5)
    assert np.allclose(velocities[1::2], np.diff(frames, axis=0) * FPS, rtol=1e-4, atol=5e-3)


@pytest.mark.parametrize("suffix", ["usdc", "abc"])
def test_a_plant_far_from_the_origin_has_exact_velocities(tmp_path, suffix):
    """Its points are about a place, and their differences are taken in double precision."""
    rng = np.random.default_rng(0)
    far = 5e6 + 0.01 * np.cumsum(rng.normal(size=(6, 5, 3)), axis=0)
    clip = athcodec.MotionClip(far, np.arange(6) / 30, metadata={"unit": "m", "up_axis": "y"})
    athcodec.write(clip, tmp_path / f"b.{suffix}", velocities=True)
    if suffix == "usdc":
        _, _, velocities = usd_samples(tmp_path / "b.usdc")
    else:
        place = Abc.IArchive(str(tmp_path / "b.abc")).getTop().getChild(0).getChild(0).getChild(0).getChild(0)
        schema = AbcGeom.IPoints(place, Abc.WrapExistingFlag.kWrapExisting).getSchema()
        velocities = np.array([np.array(sample) for sample in schema.getVelocitiesProperty().samples])
    assert np.allclose(velocities, np.gradient(far, 1 / 30, axis=0), rtol=0, atol=1e-6)


SHOWN = """
fresh()
scene = bpy.context.scene
scene.render.fps, scene.render.fps_base = 24, 1.001
if args["path"].endswith("abc"):
    bpy.ops.wm.alembic_import(filepath=args["path"])
else:
    bpy.ops.wm.usd_import(filepath=args["path"])
scene.frame_set(105)
found = {}
for thing in bpy.data.objects:
    if thing.name.startswith("grid"):
        mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        velocity = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.attributes["velocity"].data.foreach_get("vector", velocity)
        matrix = np.array(thing.matrix_world)[:3, :3]
        found[thing.name] = velocity.reshape(-1, 3) @ matrix.T
save(**found)
"""


@pytest.mark.programs
@pytest.mark.parametrize("suffix", ["abc", "usdc"])
def test_blender_has_the_velocities_as_an_attribute_per_second(blender, plant, tmp_path, suffix):
    out = tmp_path / f"b.{suffix}"
    with athcodec.read(plant.with_suffix(".usdc"), only=["grid"]) as clip:
        clip.metadata["unit"] = "m"  # Blender scales a stage in centimetres.
        athcodec.write(clip, out, velocities=True)
        frames = clip.block(3, 6).astype(float)
    [shown] = blender.run(SHOWN, path=out).values()
    assert np.allclose(shown, (frames[2] - frames[0]) * FPS / 2, rtol=1e-4, atol=1e-4)
