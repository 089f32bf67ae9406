"""VTKHDF: grids and surfaces with steps, in pieces and as blocks, as VTK lays them out; broken files.

The files are written here with h5py, and by VTK itself in the tier `programs`; the values are closed forms."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from moving_meshes import survives_damage
from programs import run_script, vtk_python

import athcodec
from athcodec.errors import ClipError, GuessWarning, SourceWarning

HEIGHT = np.linspace(0.0, 2.0, 9)
REST = np.concatenate([np.stack([x + 0 * HEIGHT, HEIGHT, 0 * HEIGHT], axis=1) for x in (0.0, 0.2)])
QUADS = np.array([[i, i + 9, i + 10, i + 1] for i in range(8)])
TIMES = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.9])
BENT = 0.1 * np.sin(3 * TIMES)[:, None] * REST[:, 1] ** 2
MOVED = np.stack([BENT, 0 * BENT, 0 * BENT], axis=2)
MOTION = REST + MOVED
STEPS = len(TIMES)


def begin(group, kind, values=TIMES) -> h5py.Group:
    group.attrs["Type"], group.attrs["Version"] = np.bytes_(kind), [2, 3]
    steps = group.create_group("Steps")
    steps.attrs["NSteps"] = len(values)
    steps["Values"] = values
    return steps


def write_grid(group, motion=MOTION, pieces=1, **point_data) -> None:
    """All of each step, one after the other, as vtkHDFWriter writes what changes."""
    steps = begin(group, "UnstructuredGrid")
    runs = np.arange(STEPS)
    group["Points"] = np.tile(motion, (1, pieces, 1)).reshape(-1, 3)
    group["Connectivity"] = np.tile(QUADS.reshape(-1), STEPS * pieces)
    group["Offsets"] = np.tile(np.arange(9) * 4, STEPS * pieces)
    group["Types"] = np.full(8 * STEPS * pieces, 9, np.uint8)
    for name, count in (("NumberOfPoints", 18), ("NumberOfCells", 8), ("NumberOfConnectivityIds", 32)):
        group[name] = np.full(STEPS * pieces, count)
    for name, count in (("PointOffsets", 18), ("CellOffsets", 8), ("ConnectivityIdOffsets", 32), ("PartOffsets", 1)):
        steps[name] = runs * count * pieces
    steps["NumberOfParts"] = np.full(STEPS, pieces)
    for name, values in point_data.items():
        group[f"PointData/{name}"] = np.tile(values, (1, pieces, *[1] * (values.ndim - 2))).reshape(
            -1, *values.shape[2:]
        )


def write_surface(group, **point_data) -> None:
    """A mesh that is written once, with two lines and eight quads, and data that change."""
    steps = begin(group, "PolyData")
    group["Points"], group["NumberOfPoints"] = REST, [18]
    cells = {"Lines": [[0, 1, 2], [9, 10]], "Polygons": QUADS.tolist(), "Vertices": [], "Strips": []}
    for name, rows in cells.items():
        group[f"{name}/Connectivity"] = np.array([node for row in rows for node in row], np.int64)
        group[f"{name}/Offsets"] = np.cumsum([0, *map(len, rows)])
        group[f"{name}/NumberOfCells"] = [len(rows)]
        group[f"{name}/NumberOfConnectivityIds"] = [sum(map(len, rows))]
    for name, width in (("PointOffsets", 1), ("PartOffsets", 1), ("CellOffsets", 4), ("ConnectivityIdOffsets", 4)):
        steps[name] = np.zeros((STEPS, width), np.int64)
    steps["NumberOfParts"] = np.ones(STEPS, np.int64)
    group["CellData/part"] = np.array([7, 8, *range(8)])
    for name, values in point_data.items():
        group[f"PointData/{name}"] = values.reshape(-1, *values.shape[2:])
        steps[f"PointDataOffsets/{name}"] = np.arange(STEPS) * 18


@pytest.fixture
def path(tmp_path):
    return tmp_path / "plant.vtkhdf"


def assert_motion(clip, motion=MOTION):
    assert np.array_equal(clip.block(0, STEPS), motion)
    assert np.allclose(clip.time, TIMES, rtol=0, atol=1e-15)


def test_a_grid_that_moves_is_read_with_its_times(path):
    mass, heat = np.tile(REST[:, 1], (STEPS, 1)), TIMES[:, None] * REST[:, 1]
    with h5py.File(path, "w") as file:
        write_grid(file.create_group("VTKHDF"), mass=mass, heat=heat)
    with athcodec.read(path) as clip:
        assert_motion(clip)
        assert np.array_equal(clip.faces, QUADS) and np.array_equal(clip.attributes["mass"], REST[:, 1])
        assert clip.not_read == {"field": ["heat"]}


@pytest.mark.formats
def test_points_that_are_written_once_move_by_the_displacement(path):
    with h5py.File(path, "w") as file:
        write_surface(file.create_group("VTKHDF"), displacement=MOVED, speed=7 * MOVED)
        file["VTKHDF/FieldData/note"] = [1.0]
    with athcodec.read(path) as clip:
        assert_motion(clip)
        assert np.array_equal(clip.faces, QUADS) and clip.edges.tolist() == [[0, 1], [1, 2], [9, 10]]
        assert clip.attributes["face_part"].tolist() == list(range(8))
        assert clip.attributes["edge_part"].tolist() == [7, 7, 8]
        assert clip.not_read == {"field": ["speed", "note"]}
    with athcodec.read(path, field="speed") as clip:
        assert np.allclose(clip.block(0, STEPS), REST + 7 * MOVED, rtol=0, atol=1e-12)


@pytest.mark.formats
def test_pieces_follow_each_other_and_so_do_blocks(path, tmp_path):
    both = np.concatenate([MOTION, MOTION], axis=1)
    with h5py.File(path, "w") as file:
        write_grid(file.create_group("VTKHDF"), pieces=2)
    with athcodec.read(path) as clip:
        assert_motion(clip, both)
        assert np.array_equal(clip.faces, np.concatenate([QUADS, QUADS + 18]))
    with h5py.File(tmp_path / "blocks.vtkhdf", "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Type"] = np.bytes_("MultiBlockDataSet")
        write_grid(root.create_group("Block_1"), u=MOVED)
        write_surface(root.create_group("Block_2"), u=MOVED)
        root.create_group("Block_3").attrs["Type"] = np.bytes_("ImageData")
        root["Assembly/leaf"], root["Assembly/stem"] = (h5py.SoftLink(f"/VTKHDF/Block_{n}") for n in (1, 2))
    with pytest.warns(SourceWarning, match=r"not read: block Block_3 \(ImageData\)"):
        with athcodec.read(tmp_path / "blocks.vtkhdf") as clip:
            assert clip.metadata["part_names"] == ["leaf", "stem"]
            assert clip.attributes["part_vertex_counts"].tolist() == [18, 18]
            assert np.array_equal(clip.block(0, STEPS)[:, :18], MOTION)
    with pytest.warns(GuessWarning, match="u was taken for the displacement"):
        with athcodec.read(tmp_path / "blocks.vtkhdf", only=["stem"]) as clip:
            assert_motion(clip)


@pytest.mark.formats
def test_a_file_without_steps_is_one_frame(path):
    with h5py.File(path, "w") as file:
        write_surface(file.create_group("VTKHDF"))
        del file["VTKHDF/Steps"]
    with athcodec.read(path) as clip:
        assert clip.frame_count == 1 and np.array_equal(clip.block(0, 1)[0], REST)


def set_to(name, values):
    def change(file):
        group = file["VTKHDF"]
        del group[name]
        group[name] = values

    return change


REFUSED = {
    "another type": (lambda file: file["VTKHDF"].attrs.modify("Type", np.bytes_("ImageData")), "the type 'ImageData'"),
    "cells that change": (
        lambda file: file["VTKHDF/Connectivity"].write_direct(np.array([17]), dest_sel=np.s_[32:33]),
        "frame 1: got other cells",
    ),
    "points outside": (
        set_to("Steps/PointOffsets", np.arange(STEPS) * 19),
        "Points: got 108 rows, expected 18 from 95",
    ),
    "negative places": (set_to("Steps/PointOffsets", np.full(STEPS, -1)), "Points: got 108 rows, expected 18 from -1"),
    "too few steps": (set_to("Steps/Values", TIMES[:4]), "got 4 times, expected NSteps, 6"),
    "times that do not grow": (set_to("Steps/Values", TIMES[::-1]), "time: frame 1"),
    "nodes outside": (set_to("Connectivity", np.full(192, 18)), "expected 0 to 17"),
    "offsets that fall": (
        set_to("Offsets", np.tile(np.arange(9)[::-1] * 4, STEPS)),
        "Offsets: got 0 nodes, expected 32",
    ),
    "pieces outside": (
        set_to("Steps/PartOffsets", np.full(STEPS, 6)),
        "got the pieces 6 to 7 in step 0, expected some of 6",
    ),
    "no numbers": (set_to("Points", np.array([b"a"])), "Points: got no array of numbers"),
}


@pytest.mark.formats
@pytest.mark.parametrize("change, message", REFUSED.values(), ids=REFUSED)
def test_a_broken_file_is_refused_and_named(path, change, message):
    with h5py.File(path, "w") as file:
        write_grid(file.create_group("VTKHDF"))
        change(file)
    with pytest.raises(ClipError, match=message) as caught:
        with athcodec.read(path) as clip:
            list(clip.blocks())
    assert "\n" not in str(caught.value)


@pytest.mark.formats
def test_damaged_files_are_refused_with_a_clip_error(path):
    with h5py.File(path, "w") as file:
        write_grid(file.create_group("VTKHDF"))
    assert survives_damage(path, lambda: athcodec.read(path), cuts=15, changes=40) > 12


WRITE = """
import sys, numpy as np, vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

folder, source = sys.argv[1:]
given = np.load(source)
rest, moved, quads, times = (given[name] for name in ("rest", "moved", "quads", "times"))

class Source(VTKPythonAlgorithmBase):
    def __init__(self, kind, make):
        VTKPythonAlgorithmBase.__init__(self, nInputPorts=0, nOutputPorts=1, outputType=kind)
        self.make = make
    def RequestInformation(self, request, before, after):
        information = after.GetInformationObject(0)
        information.Set(Pipeline.TIME_STEPS(), times.tolist(), len(times))
        information.Set(Pipeline.TIME_RANGE(), [times[0], times[-1]], 2)
        return 1
    def RequestData(self, request, before, after):
        time = after.GetInformationObject(0).Get(Pipeline.UPDATE_TIME_STEP())
        out = vtk.vtkDataObject.GetData(after, 0)
        out.ShallowCopy(self.make(int(np.abs(times - time).argmin())))
        out.GetInformation().Set(vtk.vtkDataObject.DATA_TIME_STEP(), time)
        return 1

def mesh(points, is_grid, **data):
    made = vtk.vtkUnstructuredGrid() if is_grid else vtk.vtkPolyData()
    made.SetPoints(vtk.vtkPoints())
    made.GetPoints().SetData(numpy_to_vtk(points.copy(), deep=1))
    made.Allocate(len(quads))
    for quad in quads:
        made.InsertNextCell(9, 4, quad.tolist())
    for name, values in data.items():
        array = numpy_to_vtk(values.copy(), deep=1)
        array.SetName(name)
        made.GetPointData().AddArray(array)
    return made

def partitioned(step):
    made = vtk.vtkPartitionedDataSet()
    made.SetPartition(0, mesh(rest + moved[step], True))
    made.SetPartition(1, mesh(rest + 5 + moved[step], True))
    return made

def blocks(step):
    made = vtk.vtkMultiBlockDataSet()
    for number, (name, is_grid) in enumerate((("leaf", True), ("stem", False))):
        made.SetBlock(number, mesh(rest + 5 * number + moved[step], is_grid))
        made.GetMetaData(number).Set(vtk.vtkCompositeDataSet.NAME(), name)
    return made

made = {
    "grid": ("vtkUnstructuredGrid", lambda t: mesh(rest + moved[t], True, mass=rest[:, 1], heat=rest[:, 1] * t)),
    "surface": ("vtkPolyData", lambda step: mesh(rest, False, displacement=moved[step])),
    "pieces": ("vtkPartitionedDataSet", partitioned),
    "blocks": ("vtkMultiBlockDataSet", blocks),
}
for name, (kind, make) in made.items():
    source = Source(kind, make)
    writer = vtk.vtkHDFWriter()
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetFileName(folder + "/" + name + ".vtkhdf")
    writer.SetWriteAllTimeSteps(True)
    writer.Write()
"""


@pytest.mark.programs
def test_what_vtk_writes_is_read(tmp_path):
    np.savez(tmp_path / "given.npz", rest=REST, moved=MOVED, quads=QUADS, times=TIMES)
    run_script(vtk_python(), WRITE, tmp_path, tmp_path / "given.npz")
    both = np.concatenate([MOTION, MOTION + 5], axis=1)
    for name, motion in {"grid": MOTION, "surface": MOTION, "pieces": both, "blocks": both}.items():
        with athcodec.read(tmp_path / f"{name}.vtkhdf") as clip:
            assert np.allclose(clip.block(0, STEPS), motion, rtol=0, atol=1e-12), name
            assert np.allclose(clip.time, TIMES, rtol=0, atol=1e-7), name
            assert len(clip.faces) == 8 * motion.shape[1] // 18, name
            assert clip.not_read == ({"field": ["heat"]} if name == "grid" else {}), name
