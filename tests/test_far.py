"""Plants in map coordinates, whose numbers float32 rounds by half a metre, keep their shape through every format."""

from __future__ import annotations

import gc

import imath
import numpy as np
import pytest
from alembic3d import Abc, AbcGeom
from plants import plant
from pxr import Usd, UsdGeom, Vt
from test_gltf import Maker

import athcodec
from athcodec import cli
from athcodec.exporters import write

pytestmark = pytest.mark.formats

PLACE = np.array([5e5, 4e6, 100.0])
LEAF = np.array([[0, 0, 0], [0.25, 0, 0], [0.3, 0.7, 0.1], [0.1, 0.2, 0.9]], np.float32)


def away(points, expected):
    return np.linalg.norm(np.asarray(points, float) - expected, axis=-1).max()


def far_clip():
    near = plant(branches=3, frames=3, dtype=np.float64)
    return near.replace(
        positions=np.asarray(near.positions) + PLACE, rest=near.rest + PLACE, metadata={"unit": "m", "up_axis": "z"}
    )


def usd_leaf(path, instanced=False):
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.Xform.Define(stage, "/site").AddTranslateOp().Set(tuple(PLACE))
    place = "/site/leaf"
    if instanced:
        copies = UsdGeom.PointInstancer.Define(stage, "/site/leaves")
        copies.CreateProtoIndicesAttr([0])
        copies.CreatePositionsAttr([(0, 0, 0)])
        copies.CreatePrototypesRel().SetTargets([place := "/site/leaves/leaf"])
    points = UsdGeom.Points.Define(stage, place)
    points.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(LEAF))
    UsdGeom.PrimvarsAPI(points).CreatePrimvar("rest", points.GetPointsAttr().GetTypeName(), "vertex").Set(
        Vt.Vec3fArray.FromNumpy(LEAF)
    )
    stage.Save()


def alembic_leaf(path):
    archive = Abc.OArchive(str(path))
    place, sample = AbcGeom.OXform(archive.getTop(), "site"), AbcGeom.XformSample()
    sample.setTranslation(imath.V3d(*PLACE))
    place.getSchema().set(sample)
    points, ids = imath.V3fArray(len(LEAF)), imath.IntArray(len(LEAF))
    np.asarray(memoryview(points))[...] = LEAF
    leaf = AbcGeom.OPoints(place, "leaf")
    leaf.getSchema().set(AbcGeom.OPointsSchemaSample(points, ids))
    del archive, place, leaf
    gc.collect()


def gltf_leaf(path):
    maker = Maker()
    mesh = maker.mesh({"POSITION": maker.array(LEAF)}, mode=0)
    site = maker.node(translation=PLACE.tolist())
    maker.node(site, mesh=mesh)
    maker.save(path)


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("a.usda", usd_leaf),
        ("b.usda", lambda path: usd_leaf(path, instanced=True)),
        ("a.abc", alembic_leaf),
        ("a.glb", gltf_leaf),
    ],
)
def test_points_below_a_transform_far_away_keep_all_their_bits(tmp_path, name, make):
    make(tmp_path / name)
    with athcodec.read(tmp_path / name) as clip:
        assert clip.dtype == np.float64
        assert away(clip.block(0, 1)[0], LEAF.astype(float) + PLACE) < 1e-8
        assert away(clip.rest, LEAF.astype(float) + PLACE) < 1e-8


@pytest.mark.parametrize("options", [{}, {"rig": 8}, {"animation": "joints"}, {"instances": True}])
@pytest.mark.parametrize("suffix", ["usda", "abc", "glb"])
def test_formats_with_transforms_hold_the_place_of_a_plant_in_one(tmp_path, suffix, options):
    if suffix == "abc" and "rig" in options:
        return
    clip = far_clip()
    facts = write(clip, tmp_path / f"far.{suffix}", **options).facts
    assert facts.get("max_error", 0.0) < 0.2
    with athcodec.read(tmp_path / f"far.{suffix}", up_axis="z") as back:
        assert away(back.block(0, 3), clip.block(0, 3)) <= facts.get("max_error", 0.0) + 1e-6
    assert 0 < facts["rounding"] < 1e-6


@pytest.mark.parametrize("suffix", ["h5", "npz", "xdmf", "pvd", "obj", "ply"])
def test_formats_of_doubles_keep_a_plant_far_away_to_the_bit(tmp_path, suffix):
    clip = far_clip()
    written = write(clip, tmp_path / f"far.{suffix}")
    with athcodec.read(tmp_path / f"far.{suffix}" if len(written.files) == 1 else written.files[0]) as back:
        assert away(back.block(0, 3), clip.block(0, 3)) < 1e-9
    assert "rounding" not in written.facts


@pytest.mark.parametrize("suffix", ["pc2", "mdd"])
def test_point_caches_say_how_far_off_the_origin_leaves_them(tmp_path, capsys, suffix):
    clip = far_clip()
    athcodec.encode(clip, tmp_path / "far.ath", max_error=1e-3, effort="fast")
    assert cli.main(["decode", str(tmp_path / "far.ath"), str(tmp_path / f"far.{suffix}")]) == 0
    said = capsys.readouterr().err
    assert "warning" in said and "float32 moves positions by up to 0.1" in said and ".h5" in said
    assert cli.main(["decode", str(tmp_path / "far.ath"), str(tmp_path / "far.usdc")]) == 0
    assert "float32" not in capsys.readouterr().err


def test_a_scene_near_the_origin_stays_in_float32(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.Xform.Define(stage, "/site").AddTranslateOp().Set((3, 2, 1))
    UsdGeom.Points.Define(stage, "/site/leaf").GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(LEAF))
    stage.Save()
    with athcodec.read(tmp_path / "a.usda") as clip:
        assert clip.dtype == clip.rest_dtype == np.float32
