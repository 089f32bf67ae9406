"""XDMF, VTU, VTK and PVD: what meshio writes is read, meshio reads what is written, cells, fields, broken files."""

from __future__ import annotations

import os

import h5py
import meshio
import numpy as np
import pytest
from moving_meshes import POINTS, assert_same_mesh, assert_same_motion, mixed_clip, quad_clip, survives_damage, swaying

import athcodec
from athcodec.errors import ClipError, GuessWarning
from athcodec.motion.clip import MotionClip

pytestmark = pytest.mark.formats

TIMES = np.arange(5) / 24
CUBE = np.array([[x, y, z] for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)], float)
HEXES = np.array([[0, 1, 3, 2, 4, 5, 7, 6], [4, 5, 7, 6, 8, 9, 11, 10]])
CELLS = {
    "triangles": (POINTS, [("triangle", np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4]]))]),
    "quads and lines": (POINTS, [("quad", np.array([[0, 1, 2, 3]])), ("line", np.array([[5, 6], [6, 7]]))]),
    "beams": (POINTS, [("line", np.array([[0, 1], [1, 2], [2, 3]]))]),
    "volumes": (CUBE, [("hexahedron", HEXES)]),
    "flat": (POINTS[:, :2], [("triangle", np.array([[0, 1, 2]]))]),
}


def moved(points):
    """(T, N, 3) float64, and its displacement."""
    rest = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    motion = swaying(rest, len(TIMES), np.float64)
    motion[..., points.shape[1] :] = 0
    return motion, (motion - rest)[..., : points.shape[1]]


def write_xdmf(path, points, cells, displacement, name="displacement", data_format="HDF", **more):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(path.parent)  # meshio puts the data where the process is
        with meshio.xdmf.TimeSeriesWriter(path.name, data_format) as writer:
            writer.write_points_cells(points, cells)
            for time, moved in zip(TIMES, displacement):
                writer.write_data(
                    float(time), point_data={name: moved, **more.get("point_data", {})}, cell_data=more.get("cell_data")
                )
    return path


def write_vtu(folder, motion, cells, suffix=".vtu", **data):
    for frame, points in enumerate(motion, 1):
        meshio.write(folder / f"r_{frame:04}{suffix}", meshio.Mesh(points, cells, **data))
    return folder / f"r_0002{suffix}"


@pytest.mark.parametrize("data_format", ["HDF", "XML", "Binary"])
@pytest.mark.parametrize("points, cells", CELLS.values(), ids=CELLS)
def test_time_series_of_meshio_are_read(tmp_path, points, cells, data_format):
    motion, displacement = moved(points)
    if len(cells) > 1:
        cells = cells[:1]  # its writer of mixed cells is broken
    with athcodec.read(write_xdmf(tmp_path / "a.xdmf", points, cells, displacement, data_format=data_format)) as clip:
        assert np.abs(clip.block(0, 5) - motion).max() < 1e-12 and clip.dtype == np.float64
        assert np.allclose(clip.time, TIMES, rtol=0, atol=1e-12) and clip.metadata["fps"] == 24
        assert np.array_equal(clip.rest[:, :2], points[:, :2])


def test_cells_become_faces_edges_and_volumes(tmp_path):
    for name, (points, cells) in CELLS.items():
        motion, _ = moved(points)
        with athcodec.read(write_vtu(tmp_path, motion, cells)) as clip:
            found = dict(cells)
            if "line" in found:
                assert np.array_equal(clip.edges, found["line"]), name
            for kind in ("triangle", "quad"):
                if kind in found:
                    assert np.array_equal(clip.faces, found[kind]), name
    with athcodec.read(write_vtu(tmp_path, moved(CUBE)[0], [("hexahedron", HEXES)])) as clip:
        assert np.array_equal(clip.attributes["cells_hexahedron"], HEXES)
        assert clip.metadata["domains"]["cells_hexahedron"] == "constant"
        assert clip.faces.shape == (10, 4) and not any(set(face) == {4, 5, 6, 7} for face in clip.faces.tolist())
        corners = CUBE[clip.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1) - CUBE.mean(axis=0)) > 0).all()


def test_second_order_cells_keep_their_middle_nodes(tmp_path):
    points = np.random.default_rng(0).random((9, 3))
    cells = [("triangle6", np.array([[0, 1, 2, 3, 4, 5]])), ("line3", np.array([[6, 8, 7]]))]
    with athcodec.read(write_vtu(tmp_path, moved(points)[0], cells)) as clip:
        assert clip.faces.tolist() == [[0, 1, 2]] and clip.edges.tolist() == [[6, 7], [7, 8]]
        assert clip.vertex_count == 9


STRIPS = """<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="3">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">{}</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 4 0 1 2 3 4 3 4 5 6</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 8 12</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5 6 6</DataArray></Cells>
<CellData><DataArray type="Int32" Name="label" format="ascii">7 8 9</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>"""


def test_triangle_strips_become_triangles_that_all_face_one_way(tmp_path):
    numbers = " ".join(map(str, np.arange(24)))
    (tmp_path / "a.vtu").write_text(STRIPS.format(numbers))
    with athcodec.read(tmp_path / "a.vtu") as clip:
        assert clip.faces.tolist() == [[0, 1, 4], [0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 4, 5], [4, 6, 5]]
        assert clip.attributes["label"].tolist() == [7, 8, 8, 8, 9, 9]


def test_a_wedge_has_the_same_sides_in_both_kinds_of_vtk_files(tmp_path):
    points = "0 0 0\n0 1 0\n1 0 0\n0 0 1\n0 1 1\n1 0 1"  # As VTK numbers them: the first three face outwards.
    head = "# vtk DataFile Version 3.0\na wedge\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    cell = "CELLS 1 7\n6 0 1 2 3 4 5\nCELL_TYPES 1\n13\n"
    (tmp_path / "a.vtk").write_text(f"{head}POINTS 6 float\n{points}\n{cell}")
    text = STRIPS.format(points).replace('NumberOfPoints="8" NumberOfCells="3"', 'NumberOfPoints="6" NumberOfCells="1"')
    text = text.replace("0 1 4 0 1 2 3 4 3 4 5 6", "0 1 2 3 4 5").replace("3 8 12", "6").replace("5 6 6", "13")
    (tmp_path / "a.vtu").write_text(text.replace("7 8 9", "7"))
    for name in ("a.vtk", "a.vtu"):
        with athcodec.read(tmp_path / name) as clip:
            counts, corners = (clip.attributes[f"face_vertex_{what}"] for what in ("counts", "indices"))
            rest, volume = clip.rest.astype(float), 0.0
            for face in np.split(corners, np.cumsum(counts)[:-1]):
                fan = rest[face]
                volume += sum(np.linalg.det([fan[0], a, b]) for a, b in zip(fan[1:], fan[2:])) / 6
            assert volume == pytest.approx(0.5), name


def test_a_legacy_file_with_cells_of_an_unknown_type_says_what_to_do(tmp_path):
    points = "\n".join("0 0 0" for _ in range(10))
    cells = "CELLS 1 11\n10 0 1 2 3 4 5 6 7 8 9\nCELL_TYPES 1\n15\n"
    head = "# vtk DataFile Version 3.0\na prism\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 float\n"
    (tmp_path / "a.vtk").write_text(f"{head}{points}\n{cells}")
    with pytest.raises(ClipError, match="cells: got the type 15, expected one of .*; save the mesh with these alone"):
        athcodec.read(tmp_path / "a.vtk")


@pytest.mark.parametrize(
    "suffix, how",
    [
        (".vtu", {}),
        (".vtu", {"binary": False}),
        (".vtu", {"compression": None}),
        (".vtu", {"compression": "lzma"}),
        (".vtk", {}),
        (".vtk", {"binary": False}),
    ],
)
def test_numbered_files_of_meshio_are_read(tmp_path, suffix, how):
    points, cells = CELLS["quads and lines"]
    motion, _ = moved(points)
    for frame, points_of_frame in enumerate(motion, 7):
        (meshio.vtu if suffix == ".vtu" else meshio.vtk).write(
            tmp_path / f"r{frame}{suffix}", meshio.Mesh(points_of_frame, cells), **how
        )
    with athcodec.read(tmp_path / f"r9{suffix}", fps=24) as clip:
        assert np.abs(clip.block(0, 5) - motion).max() < 1e-10 and clip.metadata["start_frame"] == 7
        assert clip.faces.tolist() == [[0, 1, 2, 3]] and clip.edges.tolist() == [[5, 6], [6, 7]]


@pytest.mark.parametrize("make", [mixed_clip, quad_clip])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name, gzip", [("a.xdmf", False), ("a.xdmf", True), ("a.pvd", False), ("a.vtu", True)])
def test_a_motion_comes_back_from_xdmf_pvd_and_vtu(tmp_path, make, dtype, name, gzip):
    clip = make(dtype=dtype)
    clip.attributes["radius"] = np.linspace(0, 1, clip.vertex_count, dtype=np.float32)
    athcodec.write(clip, tmp_path / name, gzip=gzip)
    with athcodec.read(tmp_path / name.replace(".vtu", "_0003.vtu")) as again:
        assert_same_motion(again, clip, 0.0 if name != "a.xdmf" else 1e-6 if dtype == np.float32 else 1e-14)
        assert_same_mesh(again, clip)
        assert again.metadata["fps"] == 24 and again.metadata["start_frame"] == 1
        assert np.array_equal(again.attributes["radius"], clip.attributes["radius"])


@pytest.mark.parametrize("name", ["a.xdmf", "a.pvd"])
def test_volumes_and_data_per_cell_survive(tmp_path, name):
    data = {"cell_data": {"material": [np.array([3, 4])]}, "point_data": {"mass": np.arange(12.0)}}
    with athcodec.read(write_vtu(tmp_path, moved(CUBE)[0], [("hexahedron", HEXES)], **data)) as clip:
        assert clip.attributes["material"].tolist() == [3, 4] and clip.metadata["domains"]["material"] == "cell"
        athcodec.write(clip, tmp_path / name)
        with athcodec.read(tmp_path / name) as again:
            assert_same_mesh(again, clip)
            for key in ("material", "mass", "cells_hexahedron"):
                assert np.array_equal(again.attributes[key], clip.attributes[key])


@pytest.mark.parametrize("name", ["a.xdmf", "a.pvd"])
def test_meshio_reads_what_is_written(tmp_path, name):
    clip = quad_clip(frames=5)
    clip.attributes["thickness"] = np.arange(len(clip.faces), dtype=np.float32)
    clip.metadata["domains"] = {"thickness": "face"}
    athcodec.write(clip, tmp_path / name)
    motion = []
    if name == "a.xdmf":
        with meshio.xdmf.TimeSeriesReader(tmp_path / name) as reader:
            points, cells = reader.read_points_cells()
            for step in range(reader.num_steps):
                time, point_data, cell_data = reader.read_data(step)
                assert time == clip.time[step] and np.array_equal(cell_data["thickness"][0], np.arange(20))
                motion.append(points + point_data["displacement"])
        assert np.array_equal(cells[0].data, clip.faces)
    else:
        for step in range(1, 6):
            mesh = meshio.read(tmp_path / f"a_000{step}.vtu")
            motion.append(mesh.points)
            assert np.array_equal(mesh.cells_dict["quad"], clip.faces)
            assert np.array_equal(mesh.cell_data["thickness"][0], np.arange(20))
    assert np.abs(np.array(motion) - clip.block(0, 5)).max() < 1e-6


def test_the_displacement_is_found_or_named_or_asked_for(tmp_path):
    points, cells = CELLS["triangles"]
    motion, displacement = moved(points)
    path = write_xdmf(tmp_path / "a.xdmf", points, cells, displacement, name="Shift")
    with pytest.raises(ClipError, match="got points that do not move and no displacement, only Shift; name one"):
        athcodec.read(path)
    with pytest.raises(ClipError, match="field: got 'u', expected one of Shift"):
        athcodec.read(path, field="u")
    with athcodec.read(path, field="Shift") as clip:
        assert np.abs(clip.block(0, 5) - motion).max() < 1e-12
    with meshio.xdmf.TimeSeriesWriter(tmp_path / "none.xdmf", data_format="XML") as writer:
        writer.write_points_cells(points, cells)
        for time in TIMES:
            writer.write_data(float(time))
    with athcodec.read(tmp_path / "none.xdmf") as clip:  # Without any data, the mesh stands still.
        assert clip.frame_count == len(TIMES) and (np.diff(clip.block(0, len(TIMES)), axis=0) == 0).all()
    path = write_xdmf(tmp_path / "b.xdmf", points, cells, displacement, point_data={"Displacement": 2 * motion[0]})
    with pytest.raises(ClipError, match="got Displacement, displacement, expected one displacement"):
        athcodec.read(path)


def test_what_is_static_is_kept_and_what_moves_is_left_out(tmp_path):
    points, cells = CELLS["triangles"]
    motion, displacement = moved(points)
    path = tmp_path / "a.xdmf"
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        with meshio.xdmf.TimeSeriesWriter("a.xdmf") as writer:
            writer.write_points_cells(points, cells)
            for step, moving in enumerate(displacement):
                writer.write_data(
                    step / 24,
                    {"displacement": moving, "mass": np.arange(8.0), "stress": np.full(8, float(step))},
                    {"part": [np.array([1, 2, 3])], "damage": [np.full(3, float(step))]},
                )
    with athcodec.read(path) as clip:
        assert clip.attributes.keys() == {"mass", "part", "part_vertex_counts"}
        assert clip.not_read == {"field": ["stress", "damage"]}
        assert clip.metadata["domains"]["part"] == "face" and clip.attributes["part"].tolist() == [1, 2, 3]


def write_steps(folder, suffix, steps):
    """Write meshes as VTU, or as one XDMF series that has the mesh in each step; return the path to read."""
    grids = ""
    for step, mesh in enumerate(steps):
        path = folder / f"r_{step:04}{suffix}"
        meshio.write(path, mesh, **({"data_format": "XML"} if suffix == ".xdmf" else {}))
        if suffix == ".xdmf":
            text = path.read_text()
            grid = text[text.index("<Grid") : text.index("</Domain>")]
            grids += grid.replace("<Topology", f'<Time Value="{step}"/><Topology')
    if suffix != ".xdmf":
        return path
    series = '<Xdmf Version="3.0"><Domain><Grid GridType="Collection" CollectionType="Temporal">'
    (folder / "r.xdmf").write_text(f"{series}{grids}</Grid></Domain></Xdmf>")
    return folder / "r.xdmf"


@pytest.mark.parametrize("suffix", [".xdmf", ".vtu"])
def test_points_and_data_that_differ_in_a_single_step_change_in_time(tmp_path, suffix):
    points, cells = CELLS["triangles"]
    motion = np.repeat(points[None], 9, axis=0)
    motion[3, :, 2] += 0.2
    steps = [
        meshio.Mesh(
            motion[step],
            cells,
            point_data={"displacement": motion[step] - points, "mass": np.full(8, float(step == 5))},
            cell_data={"part": [np.arange(3.0)], "damage": [np.full(3, float(step == 6))]},
        )
        for step in range(9)
    ]
    with athcodec.read(write_steps(tmp_path, suffix, steps)) as clip:
        assert np.allclose(clip.block(0, 9), motion, rtol=0, atol=1e-12)
        assert clip.attributes.keys() == {"part", "part_vertex_counts"}
        assert clip.not_read == {"field": ["displacement", "mass", "damage"]}


@pytest.mark.parametrize("suffix", [".xdmf", ".vtu"])
def test_a_field_that_may_be_a_velocity_is_said_to_move_the_mesh(tmp_path, suffix):
    points, cells = CELLS["triangles"]
    motion, displacement = moved(points)
    steps = [meshio.Mesh(points, cells, point_data={"U": moving}) for moving in displacement]
    path = write_steps(tmp_path, suffix, steps)
    with pytest.warns(GuessWarning, match="U was taken for the displacement.*--field U"), athcodec.read(path) as clip:
        assert np.abs(clip.block(0, 5) - motion).max() < 1e-12
    with athcodec.read(path, field="U") as clip:
        assert np.abs(clip.block(0, 5) - motion).max() < 1e-12


@pytest.mark.parametrize("suffix", [".xdmf", ".vtu"])
def test_a_field_that_is_not_per_point_is_named_with_what_it_is_per(tmp_path, suffix):
    points, cells = CELLS["triangles"]
    path = write_steps(tmp_path, suffix, 2 * [meshio.Mesh(points, cells, cell_data={"u": [np.ones((3, 3))]})])
    if suffix == ".xdmf":
        path.write_text(path.read_text().replace('"Cell"', '"Other"'))
    place = "other" if suffix == ".xdmf" else "cell"
    message = rf"no fields per point; not per point: u \({place}\); write the displacement with one value per point"
    with pytest.raises(ClipError, match=message):
        athcodec.read(path)


FENICS = """<?xml version="1.0"?>
<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>
<Xdmf Version="3.0" xmlns:xi="http://www.w3.org/2001/XInclude">
  <Domain>
    <Grid Name="TimeSeries" GridType="Collection" CollectionType="Temporal">
      <Grid Name="mesh" GridType="Uniform">
        <Topology NumberOfElements="3" TopologyType="Triangle" NodesPerElement="3">
          <DataItem Dimensions="3 3" NumberType="UInt" Format="HDF">a.h5:/Mesh/0/mesh/topology</DataItem>
        </Topology>
        <Geometry GeometryType="XYZ">
          <DataItem Dimensions="8 3" Format="HDF">a.h5:/Mesh/0/mesh/geometry</DataItem>
        </Geometry>
        <Time Value="0" />
        <Attribute Name="Displacement" AttributeType="Vector" Center="Node">
          <DataItem Dimensions="8 3" Format="HDF">a.h5:/VisualisationVector/0</DataItem>
        </Attribute>
      </Grid>
      <Grid>
        <xi:include xpointer="xpointer(//Grid[@Name=&quot;TimeSeries&quot;]/Grid[1]/*[self::Topology or
          self::Geometry])" />
        <Time Value="0.5" />
        <Attribute Name="Displacement" AttributeType="Vector" Center="Node">
          <DataItem Dimensions="8 3" Format="HDF">a.h5:/VisualisationVector/1</DataItem>
        </Attribute>
      </Grid>
    </Grid>
  </Domain>
</Xdmf>
"""


def fenics(folder, text=FENICS):
    motion, displacement = moved(POINTS)
    with h5py.File(folder / "a.h5", "w") as file:
        file["Mesh/0/mesh/topology"] = CELLS["triangles"][1][0][1].astype("u8")
        file["Mesh/0/mesh/geometry"] = POINTS
        file["all"] = displacement
        for step in range(2):
            file[f"VisualisationVector/{step}"] = displacement[step]
    (folder / "a.xdmf").write_text(text)
    return motion


def test_series_as_fenics_writes_them_are_read(tmp_path):
    motion = fenics(tmp_path)
    with athcodec.read(tmp_path / "a.xdmf") as clip:
        assert np.abs(clip.block(0, 2) - motion[:2]).max() < 1e-12 and clip.time.tolist() == [0, 0.5]
        assert np.array_equal(clip.faces, CELLS["triangles"][1][0][1])


def test_steps_cut_out_of_one_array_are_read(tmp_path):
    text = FENICS
    for step in range(2):
        text = text.replace(
            f'<DataItem Dimensions="8 3" Format="HDF">a.h5:/VisualisationVector/{step}</DataItem>',
            '<DataItem ItemType="HyperSlab" Dimensions="8 3"><DataItem Dimensions="3 3" Format="XML">'
            f'{3 * step} 0 0 1 1 1 1 8 3</DataItem><DataItem Dimensions="5 8 3" Format="HDF">a.h5:/all</DataItem>'
            "</DataItem>",
        )
    motion = fenics(tmp_path, text)
    with athcodec.read(tmp_path / "a.xdmf") as clip:
        assert np.abs(clip.block(0, 2) - motion[[0, 3]]).max() < 1e-12


def test_changing_cells_are_refused_with_the_frame(tmp_path):
    points, cells = CELLS["triangles"]
    motion, _ = moved(points)
    first = write_vtu(tmp_path, motion, cells)
    others = [("triangle", np.array([[0, 1, 4], [1, 2, 4], [2, 4, 3]]))]
    meshio.write(tmp_path / "r_0004.vtu", meshio.Mesh(motion[3], others))
    with athcodec.read(first) as clip, pytest.raises(ClipError, match=r"frame 3, r_0004\.vtu: got other cells"):
        list(clip.blocks())
    own = FENICS.replace(
        "<xi:include",
        '<Topology TopologyType="Triangle"><DataItem Dimensions="1 3" NumberType="Int" '
        'Format="XML">0 1 2</DataItem></Topology><xi:include',
    )
    fenics(tmp_path, own)
    with athcodec.read(tmp_path / "a.xdmf") as clip, pytest.raises(ClipError, match="frame 1: got other cells"):
        list(clip.blocks())


def test_a_pvd_has_the_times_also_of_a_file_that_it_lists(tmp_path):
    clip = MotionClip(quad_clip(frames=4).block(0, 4), np.array([0, 0.1, 0.5, 0.7]), faces=quad_clip().faces)
    athcodec.write(clip, tmp_path / "a.pvd")
    assert len(os.listdir(tmp_path)) == 5
    for name in ("a.pvd", next(path.name for path in tmp_path.glob("*.vtu"))):
        with athcodec.read(tmp_path / name) as again:
            assert np.array_equal(again.time, clip.time)


REFUSED = {
    "no file": (FENICS.replace("a.h5:/Mesh", "b.h5:/Mesh"), r"'b\.h5', which does not exist"),
    "no data": (FENICS.replace("mesh/geometry", "mesh/none"), "mesh/none.: cannot be read"),
    "no XML": ("<Xdmf><Domain>", "got no XML"),
    "no encoding": (FENICS.replace("?>", ' encoding="utfD8"?>'), "got no XML: unknown encoding"),
    "other XML": ("<svg/>", "got the XML of 'svg'"),
    "entities": ('<!DOCTYPE Xdmf [<!ENTITY a "aaaaaaaaaa">]>' + FENICS.split("[]>")[1], "declarations in its DOCTYPE"),
    "no mesh": (FENICS.replace("Geometry", "Other"), "no grid with a Geometry"),
    "times that do not grow": (FENICS.replace('"0.5"', '"0"'), "time: frame 1"),
    "no vertex": (
        FENICS.replace('Format="HDF">a.h5:/Mesh/0/mesh/topology', 'Format="XML">0 1 2 3 4 5 6 7 8'),
        "expected 0 to 7",
    ),
    "too few numbers": (
        FENICS.replace('Format="HDF">a.h5:/Mesh/0/mesh/geometry', 'Format="XML">0 1 2'),
        "got 3 numbers",
    ),
    "pieces": (FENICS.replace("<Grid>", '<Grid GridType="Collection">'), "step 1: got 0 grids, expected 1"),
    "another reference": (FENICS.replace("<DataItem", '<DataItem Reference="XML"'), "expected a path that is known"),
}


@pytest.mark.parametrize("text, message", REFUSED.values(), ids=REFUSED)
def test_a_broken_series_is_refused_and_named(tmp_path, text, message):
    fenics(tmp_path, text)
    with pytest.raises(ClipError, match=message) as caught:
        athcodec.read(tmp_path / "a.xdmf")
    assert str(tmp_path / "a.xdmf") in str(caught.value) and "\n" not in str(caught.value)


def test_arrays_that_are_only_promised_are_not_allocated(tmp_path):
    fenics(tmp_path)
    with h5py.File(tmp_path / "a.h5", "a") as file:
        del file["Mesh/0/mesh/geometry"]
        file.create_dataset("Mesh/0/mesh/geometry", (10**10, 3), "f4", chunks=(10**5, 3))
    with pytest.raises(ClipError, match="got 240,001,200,000 bytes to read, but expected at most 4,294,967,296"):
        athcodec.read(tmp_path / "a.xdmf")


def test_damaged_legacy_files_are_refused_with_a_clip_error(tmp_path):
    points, cells = CELLS["quads and lines"]
    for how in ({}, {"binary": False}):
        for frame, points_of_frame in enumerate(moved(points)[0][:2]):
            meshio.vtk.write(tmp_path / f"r{frame}.vtk", meshio.Mesh(points_of_frame, cells), **how)
        refused = survives_damage(tmp_path / "r0.vtk", lambda: athcodec.read(tmp_path / "r1.vtk"), cuts=15, changes=30)
        assert refused > 12


@pytest.mark.parametrize("suffix", ["pvd", "xdmf"])
def test_a_series_without_any_data_stands_still(tmp_path, suffix):
    clip = MotionClip(np.repeat(CUBE[None], 3, axis=0), np.arange(3) / 24)
    athcodec.write(clip, tmp_path / f"a.{suffix}")
    with athcodec.read(tmp_path / f"a.{suffix}") as again:
        assert np.array_equal(again.block(0, 3), clip.positions)
