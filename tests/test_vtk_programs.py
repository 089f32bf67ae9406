"""VTK itself reads the series that are written, and what it writes is read: XDMF, VTU in all its encodings, PVD."""

from __future__ import annotations

import numpy as np
import pytest
from moving_meshes import assert_same_mesh, assert_same_motion, mixed_clip, quad_clip
from programs import run_script, vtk_python

import athcodec

pytestmark = pytest.mark.programs

READ = """
import sys, numpy as np, pyvista as pv
path, out = sys.argv[1:]
reader = pv.get_reader(path)
reader.set_active_time_value(reader.time_values[0])
motion, times = [], list(reader.time_values)
for time in times:
    reader.set_active_time_value(time)
    grid = reader.read()
    while isinstance(grid, pv.MultiBlock):
        grid = grid[0]
    points = np.array(grid.points, float)
    if "displacement" in grid.point_data:
        points = points + grid.point_data["displacement"]
    motion.append(points)
cells = [list(grid.get_cell(i).point_ids) for i in range(grid.n_cells)]
np.savez(out, motion=np.array(motion), times=np.array(times), radius=np.array(grid.point_data["radius"]),
         corners=np.array([v for cell in cells for v in cell]), counts=np.array([len(cell) for cell in cells]))
"""

WRITE = """
import sys, numpy as np, vtk, pyvista as pv
source, folder, mode, compressor = sys.argv[1:]
with np.load(source) as arrays:
    for frame, points in enumerate(arrays["motion"], 1):
        grid = pv.UnstructuredGrid(arrays["cells"], arrays["types"], points)
        grid.point_data["radius"] = np.arange(len(points), dtype=np.float32)
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetFileName(folder + "/v_%03d.vtu" % frame)
        writer.SetInputData(grid)
        getattr(writer, "SetDataModeTo" + mode)()
        getattr(writer, "SetCompressorTypeTo" + compressor)()
        writer.SetEncodeAppendedData(compressor != "None")
        writer.SetHeaderTypeToUInt32() if mode == "Binary" else writer.SetHeaderTypeToUInt64()
        assert writer.Write()
        legacy = vtk.vtkUnstructuredGridWriter()
        legacy.SetFileName(folder + "/w_%03d.vtk" % frame)
        legacy.SetInputData(grid)
        legacy.SetFileTypeToBinary() if mode == "Binary" else legacy.SetFileTypeToASCII()
        assert legacy.Write()
"""


@pytest.mark.parametrize("make", [quad_clip, mixed_clip])
@pytest.mark.parametrize("name, gzip", [("a.xdmf", False), ("a.pvd", False), ("a.pvd", True)])
def test_vtk_reads_what_is_written(tmp_path, make, name, gzip):
    clip = make()
    clip.attributes["radius"] = np.linspace(0, 1, clip.vertex_count, dtype=np.float32)
    athcodec.write(clip, tmp_path / name, gzip=gzip)
    run_script(vtk_python(), READ, tmp_path / name, tmp_path / "out.npz")
    with np.load(tmp_path / "out.npz") as out:
        assert np.abs(out["motion"] - clip.block(0, 6)).max() < 1e-6
        assert np.allclose(out["times"], clip.time, rtol=0, atol=1e-12)
        assert np.array_equal(out["radius"], clip.attributes["radius"])
        counts, corners = clip.polygons
        edges = np.zeros((0, 2), int) if clip.edges is None else clip.edges
        assert np.array_equal(out["counts"], [*[2] * len(edges), *counts])
        assert np.array_equal(out["corners"], [*edges.reshape(-1), *corners])


FORMS = [("Ascii", "None"), ("Binary", "None"), ("Binary", "ZLib")]


@pytest.mark.parametrize("mode, compressor", [*FORMS, *(("Appended", name) for name in ("None", "ZLib", "LZMA"))])
def test_what_vtk_writes_is_read(tmp_path, mode, compressor):
    clip = mixed_clip()
    counts, corners = clip.polygons
    starts = np.cumsum(counts) - counts
    cells = [value for count, start in zip(counts, starts) for value in (count, *corners[start : start + count])]
    np.savez(
        tmp_path / "in.npz",
        motion=clip.block(0, 6),
        cells=np.array([*cells, 2, 5, 6, 2, 6, 7]),
        types=np.array([*np.where(counts == 3, 5, 9), 3, 3], np.uint8),
    )
    run_script(vtk_python(), WRITE, tmp_path / "in.npz", tmp_path, mode, compressor)
    with athcodec.read(tmp_path / "v_002.vtu", fps=24) as again:
        assert_same_motion(again, clip, 1e-6 if mode == "Ascii" else 0.0)
        assert_same_mesh(again, clip)
        assert np.array_equal(again.attributes["radius"], np.arange(8))
    with athcodec.read(tmp_path / "w_###.vtk", fps=24) as again:
        assert_same_motion(again, clip, 1e-6 if mode == "Binary" else 1e-5)  # legacy text has six digits
        assert_same_mesh(again, clip)


WRITE_LISTS = """
import sys, numpy as np, vtk, pyvista as pv
folder, version = sys.argv[1:]
expected = {"points": [], "lines": np.array([[0, 1], [1, 2], [3, 4]])}
for frame, time in enumerate([0.0, 0.1, 0.25, 0.9]):
    points = np.random.default_rng(frame).random((8, 3))
    expected["points"].append(points)
    poly = pv.PolyData(points, lines=[3, 0, 1, 2, 2, 3, 4], faces=[4, 0, 1, 2, 3, 3, 4, 5, 6], strips=[4, 4, 5, 6, 7])
    poly.point_data["age"] = np.arange(8.0)
    poly.field_data["TimeValue"] = [time]
    for name, is_binary in (("a", False), ("b", True)):
        writer = vtk.vtkPolyDataWriter()
        writer.SetFileVersion(int(version))
        writer.SetFileName("%s/%s_%d.vtk" % (folder, name, frame))
        writer.SetInputData(poly)
        writer.SetFileTypeToBinary() if is_binary else writer.SetFileTypeToASCII()
        assert writer.Write()
    poly.save("%s/x_%d.vtp" % (folder, frame))
    blocks = pv.MultiBlock({"tree": poly, "fruit": pv.Sphere(center=(0, 0, time))})
    blocks.field_data["TimeValue"] = [time]
    blocks.save("%s/m_%d.vtm" % (folder, frame))
    expected.setdefault("fruit", []).append(np.array(blocks["fruit"].points))
np.savez(folder + "/out.npz", **expected)
"""


@pytest.mark.parametrize("version", [42, 51])
def test_polydata_lists_and_times_of_vtk_are_read(tmp_path, version):
    run_script(vtk_python(), WRITE_LISTS, tmp_path, version)
    with np.load(tmp_path / "out.npz") as out:
        for name in ("a_1.vtk", "b_1.vtk", "x_1.vtp", "m_1.vtm"):
            with athcodec.read(tmp_path / name) as clip:
                assert clip.time.tolist() == pytest.approx([0, 0.1, 0.25, 0.9], abs=1e-9), name
                assert np.abs(clip.block(0, 4)[:, :8] - out["points"]).max() < 1e-6
                assert np.array_equal(clip.edges, out["lines"])
                counts, corners = clip.polygons
                assert counts.tolist()[:4] == [4, 3, 3, 3]
                assert corners.tolist()[:13] == [0, 1, 2, 3, 4, 5, 6, 4, 5, 6, 5, 7, 6]
                if name == "m_1.vtm":
                    assert np.abs(clip.block(0, 4)[:, 8:] - out["fruit"]).max() < 1e-6
                    assert clip.metadata["part_names"] == ["tree", "fruit"]
                else:
                    assert clip.attributes["age"].tolist() == list(range(8))
