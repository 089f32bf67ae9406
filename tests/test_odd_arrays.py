"""Arrays that no list of attributes has are kept or named, and meshes of odd encodings are read or refused by name."""

from __future__ import annotations

import gc

import imath
import numpy as np
import pytest
from alembic3d import Abc, AbcGeom
from pxr import Gf, Sdf, Usd, UsdGeom
from test_gltf import CUBE, Maker

import athcodec
from athcodec.errors import ClipError

pytestmark = pytest.mark.formats

VTP = """<VTKFile type="PolyData" version="0.1"><PolyData><Piece NumberOfPoints="5">
<PointData><DataArray type="Float64" Name="mass" format="ascii">0 1 2 3 4</DataArray></PointData>
<CellData><DataArray type="Int32" Name="organ" format="ascii">{organs}</DataArray>
<Array type="String" Name="label" format="ascii">97 0 98 0 99 0</Array></CellData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{points}</DataArray></Points>
<Verts><DataArray type="Int64" Name="connectivity" format="ascii"></DataArray>
<DataArray type="Int64" Name="offsets" format="ascii"></DataArray></Verts>
<Lines><DataArray type="Int64" Name="connectivity" format="ascii">3 4</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">2</DataArray></Lines>
<Polys><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 0 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 6</DataArray></Polys>
</Piece></PolyData></VTKFile>"""


def vtp_files(folder, organs):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 2]], float)
    for frame, frame_organs in enumerate(organs):
        text = " ".join(map(str, (points + 0.1 * frame).reshape(-1)))
        (folder / f"leaf_{frame}.vtp").write_text(VTP.format(points=text, organs=frame_organs))
    return points


def test_polydata_of_vtk_is_read_with_its_faces_lines_and_data(tmp_path):
    points = vtp_files(tmp_path, ["7 8 9"] * 3)
    listed = "".join(f'<DataSet timestep="{i}" file="leaf_{i}.vtp"/>' for i in range(3))
    (tmp_path / "leaf.pvd").write_text(f'<VTKFile type="Collection"><Collection>{listed}</Collection></VTKFile>')
    for name in ("leaf_1.vtp", "leaf.pvd"):
        with athcodec.read(tmp_path / name) as clip:
            assert np.allclose(clip.block(0, 3), points + 0.1 * np.arange(3)[:, None, None], rtol=0, atol=1e-12)
            assert clip.faces.tolist() == [[0, 1, 2], [0, 2, 3]] and clip.edges.tolist() == [[3, 4]]
            assert clip.attributes["mass"].tolist() == [0, 1, 2, 3, 4]
            assert clip.attributes["edge_organ"].tolist() == [7] and clip.attributes["face_organ"].tolist() == [8, 9]
            assert clip.not_read == {"field": ["label"]}


def test_data_per_cell_that_change_in_time_are_named(tmp_path):
    vtp_files(tmp_path, ["7 8 9", "7 8 9", "7 8 1"])
    with athcodec.read(tmp_path / "leaf_0.vtp") as clip:
        assert sorted(clip.not_read["field"]) == ["label", "organ"]


def test_primvars_that_hold_no_numbers_or_do_not_go_together_are_named(tmp_path):
    stage, types = Usd.Stage.CreateNew(str(tmp_path / "a.usda")), Sdf.ValueTypeNames
    for name, kind, values in (("a", types.FloatArray, [1, 2]), ("b", types.Float2Array, [(1, 2), (3, 4)])):
        points = UsdGeom.Points.Define(stage, f"/{name}")
        points.GetPointsAttr().Set([(0, 0, 0), (1, 0, 0)])
        primvars = UsdGeom.PrimvarsAPI(points)
        primvars.CreatePrimvar("age", kind, "vertex").Set(values)
        primvars.CreatePrimvar("species", types.StringArray, "vertex").Set(["oak", "elm"])
        primvars.CreatePrimvar("turn", types.QuatfArray, "vertex").Set([Gf.Quatf(1)] * 2)
    stage.Save()
    with athcodec.read(tmp_path / "a.usda") as clip:
        assert set(clip.not_read["attribute"]) == {"/a.age", "/b.age", "/a.species", "/b.species"}
        assert clip.attributes["turn"].shape == (4, 4)


def test_parameters_of_alembic_that_hold_texts_are_named(tmp_path):
    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    points, ids, texts = imath.V3fArray(2), imath.IntArray(2), imath.StringArray(2)
    leaf = AbcGeom.OPoints(archive.getTop(), "leaf")
    leaf.getSchema().set(AbcGeom.OPointsSchemaSample(points, ids))
    scope = AbcGeom.GeometryScope.kVertexScope
    species = AbcGeom.OStringGeomParam(leaf.getSchema().getArbGeomParams(), "species", False, scope, 1)
    species.set(AbcGeom.OStringGeomParamSample(texts, scope))
    del archive, leaf, species
    gc.collect()
    with athcodec.read(tmp_path / "a.abc") as clip:
        assert clip.not_read == {"attribute": ["/leaf.species"]}


def test_lists_of_ply_that_are_no_faces_are_named(tmp_path):
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "property list uchar int near\nelement face 1\nproperty list uchar int vertex_indices\n"
        "property list uchar float weights\nend_header\n0 0 0 1 1\n1 0 0 1 0\n0 1 0 2 0 1\n3 0 1 2 2 0.5 0.5\n"
    )
    with athcodec.read(tmp_path / "a.ply") as clip:
        assert clip.not_read == {"attribute": ["vertex_near (lists)", "face_weights (lists)"]}


def test_attributes_of_gltf_whose_names_differ_in_case_alone_are_all_kept(tmp_path):
    made = Maker()
    numbers = np.arange(len(CUBE), dtype=np.float32)
    named = {"_AGE": made.array(numbers), "_age": made.array(numbers + 1), "_UV": made.array(numbers + 2)}
    uv = made.array(np.zeros((len(CUBE), 2), np.float32))
    made.node(mesh=made.mesh({"POSITION": made.array(CUBE), "TEXCOORD_0": uv, **named}, mode=0))
    with athcodec.read(made.save(tmp_path / "a.glb")) as clip:
        kept = [values[0].tolist() for values in clip.attributes.values() if len(values) == len(CUBE)]
        assert sorted(map(str, kept)) == ["0.0", "1.0", "2.0", "[0.0, 0.0]"]


@pytest.mark.parametrize("is_required", [True, False])
def test_meshes_of_draco_are_refused_with_the_command_that_unpacks_them(tmp_path, is_required):
    made, draco = Maker(), "KHR_draco_mesh_compression"
    made.node(mesh=made.mesh({"POSITION": made.array(CUBE)}, mode=0))
    made.gltf.extensionsUsed, made.gltf.extensionsRequired = [draco], [draco] if is_required else []
    made.gltf.meshes[0].primitives[0].extensions = {draco: {"bufferView": 0, "attributes": {"POSITION": 0}}}
    made.gltf.accessors[0].bufferView = None
    with pytest.raises(ClipError, match=r"KHR_draco_mesh_compression.*gltf-transform copy"):
        athcodec.read(made.save(tmp_path / "a.glb"))
