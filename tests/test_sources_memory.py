"""Small files that would take much memory: refused within the budget, in one line. Each in a process of its own."""

from __future__ import annotations

import base64
import lzma
import os
import struct
import sys
import zipfile
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from glb import glb
from programs import PEAK, printed

import athcodec
from athcodec.errors import ClipError

pytestmark = pytest.mark.formats

BUDGET = 64 << 20
READER = 512 << 20  # a process that reads: Python, USD, and the stacks of threads
READ = f"""{PEAK}
import athcodec, h5py, numpy
import athcodec.sources.gltf, athcodec.sources.hdf5, athcodec.sources.npz, athcodec.sources.xdmf, athcodec.sources.vtk
import athcodec.sources.vtkhdf, athcodec.sources.npy, athcodec.sources.mat
before = peak()
try:
    with athcodec.read(sys.argv[1], max_memory=int(sys.argv[2])) as clip:
        clip.block(0, 1)
    said = "read"
except athcodec.errors.ClipError as error:
    said = str(error)
print(peak() - before)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
print(said)
"""


def vtu(folder: Path, packer: str, pack: Callable[[bytes], bytes]) -> Path:
    """A field of zeros as blocks, each of a few bytes."""
    block, blocks = pack(bytes(16 << 20)), 64
    head = struct.pack("<3Q", blocks, 16 << 20, 0) + struct.pack("<Q", len(block)) * blocks
    packed = base64.b64encode(head) + base64.b64encode(block * blocks)
    array = f'<DataArray type="Float32" Name="%s" NumberOfComponents="3" format="binary">{packed.decode()}</DataArray>'
    (folder / "a.vtu").write_text(
        '<VTKFile type="UnstructuredGrid" byte_order="LittleEndian" header_type="UInt64" '
        f'compressor="{packer}"><UnstructuredGrid><Piece><Points>{array % "points"}</Points></Piece>'
        "</UnstructuredGrid></VTKFile>"
    )
    return folder / "a.vtu"


def pvd(folder: Path) -> Path:
    (folder / "a.pvd").symlink_to("/dev/zero")
    return folder / "a.pvd"


def npz(folder: Path) -> Path:
    with zipfile.ZipFile(folder / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in {
            "positions": np.zeros((2, 3, 3)),
            **{f"a{i}": np.zeros(1 << 20) for i in range(12)},
        }.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, array)
    return folder / "a.npz"


def hdf5_declared(folder: Path) -> Path:
    with h5py.File(folder / "a.h5", "w") as file:
        file["positions"] = np.zeros((2, 3, 3))
        for number in range(12):
            file.create_dataset(f"a{number}", (1 << 20,), "f8", chunks=(1 << 16,))
    return folder / "a.h5"


def hdf5_chunk(folder: Path) -> Path:
    """A chunk that unpacks to far more than it should have."""
    with h5py.File(folder / "a.h5", "w") as file:
        file["positions"] = np.zeros((2, 3, 3))
        data = file.create_dataset("data", (100,), "f8", chunks=(100,), compression="gzip")
        data.id.write_direct_chunk((0,), zlib.compress(bytes(1 << 29), 1))
    return folder / "a.h5"


def hdf5_texts(folder: Path) -> Path:
    """Attributes whose elements are one long text, as often as they like."""
    with h5py.File(folder / "a.h5", "w") as file:
        file["positions"] = np.zeros((2, 3, 3))
        space = h5py.h5s.create_simple((4000,))
        made = h5py.h5a.create(file.id, b"names", h5py.h5t.py_create(h5py.string_dtype(), logical=True), space)
        made.write(np.array(["x" * (1 << 20), *[""] * 3999], object))
    data = (folder / "a.h5").read_bytes()
    with h5py.File(folder / "a.h5") as file:
        size = len(file.attrs["names"])
    assert size == 4000
    place = data.find(struct.pack("<I", 1 << 20))  # the length and place of the text, 16 bytes
    one = data[place : place + 16]
    (folder / "a.h5").write_bytes(data[:place] + one * 4000 + data[place + 16 * 4000 :])
    return folder / "a.h5"


def xdmf_data(folder: Path) -> Path:
    with h5py.File(folder / "a.bin.h5", "w") as file:
        file.create_dataset("points", (40 << 20, 3), "f4", chunks=(1 << 16, 3), compression="gzip")
    (folder / "a.xdmf").write_text(
        '<Xdmf><Domain><Grid><Geometry GeometryType="XYZ"><DataItem Format="HDF" Dimensions="41943040 3">'
        "a.bin.h5:/points</DataItem></Geometry></Grid></Domain></Xdmf>"
    )
    return folder / "a.xdmf"


def xdmf_with(folder: Path, topology: str = "", points: str = "") -> Path:
    (folder / "a.xdmf").write_text(
        f'<Xdmf><Domain><Grid>{topology}<Geometry GeometryType="XYZ">{points}</Geometry></Grid></Domain></Xdmf>'
    )
    return folder / "a.xdmf"


def xdmf_grid(folder: Path) -> Path:
    """Cells between points that are not there."""
    point = '<DataItem Dimensions="1 3">0 0 0</DataItem>'
    return xdmf_with(folder, '<Topology TopologyType="3DSMesh" Dimensions="400 400 400"/>', point)


def xdmf_packed(folder: Path) -> Path:
    (folder / "a.bin").write_bytes(zlib.compress(bytes(256 << 20), 9))
    said = 'Format="Binary" Compression="Zlib" Dimensions="22369621 3" Precision="4"'
    return xdmf_with(folder, points=f"<DataItem {said}>a.bin</DataItem>")


def xdmf_function(folder: Path) -> Path:
    """A thousand numbers, again and again."""
    inner = f'<DataItem Dimensions="1000">{"0 " * 1000}</DataItem>'
    for _ in range(4):
        joined = ",".join(["$0"] * 200)
        inner = f'<DataItem ItemType="Function" Function="JOIN({joined})">{inner}</DataItem>'
    return xdmf_with(folder, points=inner)


def npz_turned(folder: Path) -> Path:
    """Positions that have to be read whole."""
    with zipfile.ZipFile(folder / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("positions.npy", "w") as member:
            np.lib.format.write_array(member, np.asfortranarray(np.zeros((1 << 20, 4, 3))))
    return folder / "a.npz"


def npy_turned(folder: Path) -> Path:
    header = str({"descr": "<f8", "fortran_order": True, "shape": (1 << 20, 16, 3)}).encode()
    (folder / "a.npy").write_bytes(b"\x93NUMPY\x01\0v\0" + header.ljust(117) + b"\n")
    os.truncate(folder / "a.npy", 128 + 8 * 48 * (1 << 20))
    return folder / "a.npy"


def vtkhdf(folder: Path) -> Path:
    """Points that are only declared."""
    with h5py.File(folder / "a.vtkhdf", "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        root.create_dataset("Points", (8 << 20, 3), "f8", chunks=(1 << 16, 3))
        root["NumberOfPoints"], root["NumberOfCells"], root["NumberOfConnectivityIds"] = [8 << 20], [0], [0]
        root["Offsets"], root["Types"], root["Connectivity"] = [0], np.zeros(0, np.uint8), np.zeros(0, np.int64)
    return folder / "a.vtkhdf"


def matlab(folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "a.mat", {"positions": np.zeros((1 << 20, 16, 3))}, do_compression=True)
    return folder / "a.mat"


def xdmf_laughs(folder: Path) -> Path:
    """Defaults of attributes, which the parser gives every element."""
    declared = f'<!DOCTYPE Xdmf [<!ATTLIST Grid Name CDATA "{"ha" * 50_000}">]>'
    (folder / "a.xdmf").write_text(f"{declared}<Xdmf><Domain>{'<Grid/>' * 20_000}</Domain></Xdmf>")
    return folder / "a.xdmf"


def written(folder: Path, gltf: dict, binary: bytes) -> Path:
    gltf |= {"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(binary)}]}
    (folder / "a.glb").write_bytes(glb(gltf, binary))
    return folder / "a.glb"


def triangle(count: int) -> dict:
    return {
        "bufferViews": [{"buffer": 0, "byteLength": 12 * count}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": count}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }


def gltf_nodes(folder: Path) -> Path:
    """One mesh, shown by many nodes."""
    return written(folder, triangle(10_000) | {"nodes": [{"mesh": 0}] * 10_000}, bytes(12 * 10_000))


def gltf_attributes(folder: Path) -> Path:
    """One accessor, under many names."""
    own = triangle(10_000)
    own["meshes"][0]["primitives"][0]["attributes"] |= {f"_A{i}": 0 for i in range(10_000)}
    return written(folder, own | {"nodes": [{"mesh": 0}]}, bytes(12 * 10_000))


def gltf_copies(folder: Path) -> Path:
    own = triangle(10_000)
    moved = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}
    return written(folder, own | {"nodes": [{"mesh": 0, "extensions": moved}]}, bytes(12 * 10_000))


def gltf_meshopt(folder: Path) -> Path:
    """A view that says that it unpacks to much."""
    own = triangle(100 << 20)
    packed = {"buffer": 0, "byteLength": 1 << 20, "byteStride": 12, "count": 100 << 20, "mode": "ATTRIBUTES"}
    own["bufferViews"][0] |= {"extensions": {"EXT_meshopt_compression": packed}}
    return written(folder, own | {"nodes": [{"mesh": 0}]}, bytes(1 << 20))


def usda_laughs(folder: Path) -> Path:
    """Prims that refer to each other, ten times each."""
    prims = ['def Mesh "p0" { point3f[] points = [(0, 0, 0)] }']
    for level in range(1, 8):
        inner = "".join(f'def "c{i}" (references = </p{level - 1}>) {{}}\n' for i in range(10))
        prims.append(f'def "p{level}" {{\n{inner}}}')
    (folder / "a.usda").write_text("#usda 1.0\n" + "\n".join(prims))
    return folder / "a.usda"


def usdc_array(folder: Path) -> Path:
    """An array that takes a thousand times its bytes, when it is unpacked."""
    from pxr import Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(folder / "a.usdc"))
    mesh = UsdGeom.Mesh.Define(stage, "/mesh")
    mesh.CreatePointsAttr([(0, 0, 0)] * 3)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(64 << 20, 3))
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    stage.Save()
    return folder / "a.usdc"


MAKERS = [pvd, npz, hdf5_declared, hdf5_chunk, hdf5_texts, xdmf_data, xdmf_laughs]
MAKERS += [xdmf_grid, xdmf_packed, xdmf_function, npz_turned, npy_turned, vtkhdf, matlab]
MAKERS += [gltf_nodes, gltf_attributes, gltf_copies, gltf_meshopt, usda_laughs, usdc_array]
MAKERS = {maker.__name__: maker for maker in MAKERS} | {
    "vtu_zlib": partial(vtu, packer="vtkZLibDataCompressor", pack=zlib.compress),
    "vtu_lzma": partial(vtu, packer="vtkLZMADataCompressor", pack=lzma.compress),
}


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says how much memory a process has")
@pytest.mark.parametrize("maker", MAKERS.values(), ids=MAKERS)
def test_a_small_file_takes_no_more_memory_than_it_may(maker: Callable, tmp_path):
    path = maker(tmp_path)
    grown, apart, said = printed(sys.executable, "-c", READ, path, BUDGET).splitlines()
    assert said != "read" and str(path) in said
    assert int(grown) < BUDGET and int(apart) < READER + BUDGET


def test_what_is_no_plain_file_is_refused_at_once(tmp_path):
    for suffix in (
        ".h5",
        ".npz",
        ".npy",
        ".mat",
        ".usda",
        ".glb",
        ".abc",
        ".pc2",
        ".mdd",
        ".obj",
        ".ply",
        ".xdmf",
        ".vtu",
        ".pvd",
    ):
        os.mkfifo(tmp_path / f"a{suffix}")
        with pytest.raises(ClipError, match="device, pipe or socket, expected a plain file"):
            athcodec.read(tmp_path / f"a{suffix}")
