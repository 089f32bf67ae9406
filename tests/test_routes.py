"""The table of routes in docs/formats.md: what survives on the way into each format and out of it.

Every row is a case. Files that athcodec writes are read by other libraries, and files that other libraries write by
athcodec; what is found there has to be what the table says. `python tests/test_routes.py` prints the table.
"""

from __future__ import annotations

import base64
import gc
import json
import struct
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import h5py
import imath
import meshio
import numpy as np
import pygltflib
import pytest
from alembic3d import Abc, AbcCoreAbstract, AbcGeom
from glb import accessor_of, posed
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt
from test_alembic import filled, matrix
from test_gltf import Maker
from test_vat import exr, mesh_of, shown_by_matrices, shown_by_positions

import athcodec
from athcodec import ClipView, MotionClip
from athcodec.errors import ClipError, SourceWarning

pytestmark = pytest.mark.formats

COLUMNS = ("order", "names", "materials", "UVs", "instances", "clips", "unit", "axes", "frame rate", "first frame")
YES, NO = "yes", "no"
PAGE = Path(__file__).resolve().parent.parent / "docs" / "formats.md"

RATE, START, FRAMES, COPIES = 24000 / 1001, 1001, 6, 3
GRID = np.array([[x, 0, z] for z in range(4) for x in range(3)], np.float32)
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7], [6, 7, 10, 9], [7, 8, 11, 10]], np.int32)
CARD = np.array([[0, 0, 0], [0.4, 0, 0], [0.4, 0, 0.7], [0, 0, 0.7]], np.float32)
COUNTS = [len(GRID), COPIES * len(CARD)]
NAMES = ["bough", "leaf"]
FACES = np.concatenate([QUADS, len(GRID) + 4 * np.arange(COPIES)[:, None] + np.arange(4)]).astype(np.int32)
UV = np.concatenate([GRID[:, [0, 2]] / 4, np.tile(CARD[:, [0, 2]], (COPIES, 1))]).astype(np.float32)


def turn(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def places(frame: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rotation and place of each leaf; all are lifted alike, as glTF's instances can be."""
    return [(turn(i), np.array([i, 1 + 0.1 * frame, i / 2])) for i in range(COPIES)]


def bough(frame: int) -> np.ndarray:
    return (GRID + 0.1 * np.sin(frame) * GRID[:, 2:] ** 2 * [0, 1, 0]).astype(np.float32)


POSITIONS = np.stack(
    [np.concatenate([bough(f), *(CARD @ r.T + at for r, at in places(f))]).astype(np.float32) for f in range(FRAMES)]
)


@pytest.fixture(scope="module")
def clip() -> MotionClip:
    """A bough that bends and three leaves of one shape, in centimetres with z up, at 23.976 from frame 1001."""
    names = {"part_names": NAMES, "part_kinds": ["mesh", "mesh"], "material_names": ["bark", "green"]}
    domains = {"part_vertex_counts": "constant", "part_copies": "constant", "face_material": "face"}
    return MotionClip(
        POSITIONS,
        np.arange(FRAMES) / RATE,
        faces=FACES,
        rest=POSITIONS[0],
        vertex_branch=np.repeat(np.arange(1 + COPIES), [len(GRID), 4, 4, 4]).astype(np.int32),
        branch_parent=np.array([-1, 0, 0, 0], np.int32),
        attributes={
            "uv": UV,
            "part_vertex_counts": np.array(COUNTS, np.int32),
            "part_copies": np.array([1, COPIES], np.int32),
            "face_material": np.repeat(np.array([0, 1], np.int32), [len(QUADS), COPIES]),
        },
        metadata={"unit": "cm", "up_axis": "z", "fps": RATE, "start_frame": START, "domains": domains} | names,
    )


@dataclass
class Found:
    """What a reader found: each None or empty where the file does not say it."""

    positions: np.ndarray
    names: list[str]
    uv: np.ndarray | None = None
    materials: list[str] | None = None
    has_instances: bool = False
    clips: int = 1
    unit: str | None = None
    up: str | None = None
    times: np.ndarray | None = None
    rate: float | None = None
    start: float | None = None
    tolerance: float = 1e-4


def cells(found: Found) -> dict[str, str]:
    """The row of the table for it."""
    expected = POSITIONS.astype(np.float64)
    is_turned = found.up == "y"
    if is_turned:
        expected = np.stack([expected[..., 0], expected[..., 2], -expected[..., 1]], axis=-1)
    if found.unit == "m":
        expected = expected / 100
    keeps = found.positions.shape == expected.shape
    keeps = keeps and np.abs(found.positions - expected).max() <= found.tolerance * np.abs(expected).max()
    rate = found.rate if found.rate is not None else _rate_of(found.times)
    is_exact = rate is not None and abs(rate / RATE - 1) < 1e-5
    return {
        "order": YES if keeps else NO,
        "names": YES if found.names == NAMES else NO,
        "materials": "names" if found.materials == ["bark", "green"] else NO,
        "UVs": YES if found.uv is not None and np.allclose(found.uv, UV, rtol=0, atol=1e-6) else NO,
        "instances": YES if found.has_instances else "as vertices",
        "clips": YES if found.clips == 2 else "one a file",
        "unit": {"cm": YES, "m": "metres", None: NO}[found.unit],
        "axes": {"z": YES, "y": "y up", None: NO}[found.up],
        "frame rate": YES if is_exact else NO,
        "first frame": YES if found.start is not None and abs(found.start - START) < 0.01 else NO,
    }


def _rate_of(times: np.ndarray | None) -> float | None:
    return None if times is None else float((len(times) - 1) / (times[-1] - times[0]))


# ---- what other libraries find in files of athcodec ----


def in_usd(path: Path) -> Found:
    stage = Usd.Stage.Open(str(path))
    codes = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1)
    takes = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation)]
    if takes:
        UsdSkel.BakeSkinning(stage.Traverse())
    names, uv, points, has_instances = [], [], [[] for _ in codes], False
    prims = iter(Usd.PrimRange(stage.GetPseudoRoot()))
    for prim in prims:
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()
            has_instances = True
            names.append(prim.GetName())
            _instances_in_usd(UsdGeom.PointInstancer(prim), codes, points, uv)
        elif prim.IsA(UsdGeom.Mesh):
            names.append(prim.GetName())
            uv.append(np.array(UsdGeom.PrimvarsAPI(prim).GetPrimvar("st").Get()))
            for own, code in zip(points, codes):
                own.append(np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(code)))
    return Found(
        np.stack([np.concatenate(own) for own in points]),
        names,
        np.concatenate(uv),
        [prim.GetName() for prim in stage.Traverse() if prim.IsA(UsdShade.Material)],
        has_instances,
        clips=max(len(takes), 1),
        unit={0.01: "cm", 1.0: "m"}[UsdGeom.GetStageMetersPerUnit(stage)],
        up=UsdGeom.GetStageUpAxis(stage).lower(),
        rate=stage.GetTimeCodesPerSecond(),
        start=stage.GetStartTimeCode(),
    )


def _instances_in_usd(instancer: UsdGeom.PointInstancer, codes: np.ndarray, points: list, uv: list) -> None:
    stage = instancer.GetPrim().GetStage()
    [shape] = [
        prim
        for target in instancer.GetPrototypesRel().GetTargets()
        for prim in Usd.PrimRange(stage.GetPrimAtPath(target))
        if prim.IsA(UsdGeom.Mesh)
    ]
    own = np.array(UsdGeom.Mesh(shape).GetPointsAttr().Get())
    for into, code in zip(points, codes):
        matrices = np.array([np.array(m) for m in instancer.ComputeInstanceTransformsAtTime(code, code)])
        into.append((np.einsum("ni,kij->knj", own, matrices[:, :3, :3]) + matrices[:, None, 3, :3]).reshape(-1, 3))
    uv.append(np.tile(np.array(UsdGeom.PrimvarsAPI(shape).GetPrimvar("st").Get()), (COPIES, 1)))


def in_alembic(path: Path) -> Found:
    archive = Abc.IArchive(str(path))
    found = Found(np.empty(0), [], has_instances=False)
    shapes: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    _walk_alembic(archive.getTop(), np.tile(np.eye(4), (FRAMES, 1, 1)), shapes, found)
    found.positions = np.concatenate([points for points, _, _ in shapes], axis=1)
    found.uv = np.concatenate([uv for _, uv, _ in shapes])
    found.times = shapes[0][2]
    found.start, found.up = shapes[0][2][0] * RATE, "y"  # which Alembic's programs take for granted
    found.names, found.materials = (list(dict.fromkeys(each or [])) for each in (found.names, found.materials))
    return found


def _walk_alembic(above: Any, matrices: np.ndarray, shapes: list, found: Found) -> None:
    for number in range(above.getNumChildren()):
        is_instance = above.isChildInstance(number)
        found.has_instances |= is_instance
        child = above.getChild(number)
        if AbcGeom.IXform.matches(child.getHeader()):
            schema = AbcGeom.IXform(above, child.getName()).getSchema()
            own = [schema.getValue(at).getMatrix() for at in _samples(schema)]
            own = np.array([[[m[row][column] for column in range(4)] for row in range(4)] for m in own])
            _walk_alembic(child, own @ matrices, shapes, found)
            continue
        schema = AbcGeom.IPolyMesh(child, Abc.WrapExistingFlag.kWrapExisting).getSchema()
        points = [np.array(schema.getValue(at).getPositions()) for at in _samples(schema)]
        points = np.einsum("tni,tij->tnj", np.stack(points), matrices[:, :3, :3]) + matrices[:, None, 3, :3]
        times = np.array([schema.getTimeSampling().getSampleTime(i) for i in range(FRAMES)])
        uv = np.array(schema.getUVsParam().getExpandedValue().getVals())
        shapes.append((points, uv, times))
        found.names.append(child.getName())
        found.materials = [*(found.materials or []), *schema.getFaceSetNames()]


def _samples(schema: Any) -> list[Any]:
    """What asks for each frame, by its time."""
    times = [float(schema.getTimeSampling().getSampleTime(i)) for i in range(max(schema.getNumSamples(), 1))]
    return [Abc.ISampleSelector(times[min(i, len(times) - 1)]) for i in range(FRAMES)]


def in_gltf(path: Path) -> Found:
    gltf = pygltflib.GLTF2().load(str(path))
    frames = [posed(gltf, frame) for frame in range(FRAMES)]
    sampler = gltf.animations[0].samplers[0]
    shown = [node for node in gltf.nodes if node.mesh is not None]
    primitives = [gltf.meshes[node.mesh].primitives[0] for node in shown]
    meshes = dict.fromkeys(node.mesh for node in shown)
    said = (gltf.asset.extras or {}) | (gltf.animations[0].extras or {})
    return Found(
        np.stack(frames),
        [gltf.meshes[mesh].name for mesh in meshes],
        np.concatenate([accessor_of(gltf, primitive.attributes.TEXCOORD_0) for primitive in primitives]),
        [material.name for material in gltf.materials],
        len(meshes) < len(shown),
        clips=len(gltf.animations),
        unit="m",
        up="y",
        times=accessor_of(gltf, sampler.input)[:FRAMES, 0],
        start=said.get("start_frame"),
        tolerance=1e-2 if "rig" in path.stem else 1e-3,
    )


def in_numbered(path: Path) -> Found:
    """OBJ and PLY, by meshio; what meshio does not say of them, by their lines."""
    files = sorted(path.parent.glob(f"{path.stem}_*{path.suffix}"))
    meshes = [meshio.read(file) for file in files]
    positions, number = np.stack([mesh.points for mesh in meshes]), int(files[0].stem.rpartition("_")[2])
    if path.suffix == ".obj":
        names, materials = (_after(files[0], word) for word in ("o", "usemtl"))
        uv = np.array([line.split() for line in _after(files[0], "vt")], float)
        return Found(positions, names, uv, materials, start=number)
    uv = np.stack([meshes[0].point_data[name] for name in ("s", "t")], axis=1)
    header = files[0].read_bytes().partition(b"end_header")[0].decode()
    (said,) = (line.partition("athcodec ")[2] for line in header.splitlines() if line.startswith("comment athcodec "))
    return _with_json(Found(positions, [], uv, start=number), said)


def _with_json(found: Found, text: str, labels: np.ndarray | None = None) -> Found:
    """With what athcodec adds to formats that have no place for it."""
    said = json.loads(text)
    labels = np.repeat(*np.transpose(said["face_material"])) if labels is None else labels
    found.names, found.unit, found.up = said["objects"]["names"], said["unit"], said["up_axis"]
    found.materials = [said["material_names"][number] for number in np.unique(labels)]
    found.has_instances = said["objects"]["copies"] == [1, COPIES]
    found.rate = said["fps"]
    return found


def in_pc2(path: Path) -> Found:
    data = path.read_bytes()
    magic, _, count, start, step, frames = struct.unpack("<12siiffi", data[:32])
    assert magic == b"POINTCACHE2\0" and step == 1
    return _with_mesh(path, Found(np.frombuffer(data[32:], "<f4").reshape(frames, count, 3), [], start=start))


def in_mdd(path: Path) -> Found:
    data = path.read_bytes()
    frames, count = struct.unpack(">2i", data[:8])
    times = np.frombuffer(data[8 : 8 + 4 * frames], ">f4").astype(float)
    positions = np.frombuffer(data[8 + 4 * frames :], ">f4").reshape(frames, count, 3)
    rate = _rate_of(times)
    return _with_mesh(path, Found(positions, [], times=times, start=times[0] * rate))


def _with_mesh(path: Path, found: Found) -> Found:
    """With what the OBJ beside it says."""
    beside = path.with_suffix(".obj")
    assert np.array_equal(np.concatenate([block.data for block in meshio.read(beside).cells]), FACES)
    found.names, found.materials = (_after(beside, word) for word in ("o", "usemtl"))
    found.uv = np.array([line.split() for line in _after(beside, "vt")], float)
    return found


def _after(path: Path, word: str) -> list[str]:
    """What the lines of an OBJ file that begin with a word go on with, each once where they are names."""
    found = [line.partition(" ")[2] for line in path.read_text().splitlines() if line.startswith(f"{word} ")]
    return found if word == "vt" else list(dict.fromkeys(found))


def in_xdmf(path: Path) -> Found:
    """By the text of XDMF, with h5py: the geometry of the first step, and what moves it."""
    root = ElementTree.parse(path).getroot()

    def numbers(item: Any) -> np.ndarray:
        name, _, inside = item.text.strip().partition(":")
        with h5py.File(path.parent / name) as file:
            return file[inside][...]

    steps = root.findall(".//Grid[@CollectionType='Temporal']/Grid")
    rest = numbers(steps[0].find("Geometry/DataItem"))
    moved = [numbers(step.find("Attribute[@Name='displacement']/DataItem")) for step in steps]
    said = {item.get("Name"): item.get("Value") for item in root.findall(".//Information")}
    return Found(
        rest + np.stack(moved),
        json.loads(said["objects"])["names"],
        numbers(steps[0].find("Attribute[@Name='uv']/DataItem")),
        json.loads(said["material_names"]),
        json.loads(said["objects"])["copies"] == [1, COPIES],
        unit=said["unit"],
        up=said["up_axis"],
        times=np.array([float(step.find("Time").get("Value")) for step in steps]),
        rate=float(said["fps"]),
        start=float(said["start_frame"]),
    )


def in_vtu(path: Path) -> Found:
    steps = ElementTree.parse(path).getroot().findall(".//DataSet")
    meshes = [meshio.read(path.parent / step.get("file")) for step in steps]
    start = int(Path(steps[0].get("file")).stem.rpartition("_")[2])
    times = np.array([float(step.get("timestep")) for step in steps])
    found = Found(np.stack([m.points for m in meshes]), [], meshes[0].point_data["uv"], times=times, start=start)
    labels = np.concatenate(meshes[0].cell_data["face_material"])
    said = ElementTree.parse(path.parent / steps[0].get("file")).getroot().find(".//FieldData/DataArray").text
    return _with_json(found, base64.b64decode(said)[8:].decode(), labels)


def in_schema(path: Path) -> Found:
    """HDF5 by h5py, .npz by NumPy."""
    if path.suffix == ".npz":
        with np.load(path) as file:
            arrays = dict(file)
        said = json.loads(str(arrays["metadata"])) if "metadata" in arrays else {}
    else:
        with h5py.File(path) as file:
            arrays = {name: file[name][...] for name in file if isinstance(file[name], h5py.Dataset)}
            arrays |= {name: item[...] for name, item in file.get("attributes", {}).items()}
            said = {key: file.attrs[key] for key in file.attrs}
    return Found(
        arrays["positions"],
        list(said["part_names"]),
        arrays.get("uv"),
        list(said["material_names"]),
        "part_copies" in arrays,
        unit=said["unit"],
        up=said["up_axis"],
        times=arrays["time"],
        rate=said["fps"],
        start=said["start_frame"],
    )


def in_vat(path: Path) -> Found:
    frames, facts, _ = shown_by_matrices(path)
    return _of_textures(frames, facts, path / facts["mesh"])


def in_openvat(path: Path) -> Found:
    frames, facts = shown_by_positions(path, exr(next(path.glob("*.exr"))))
    return _of_textures(frames, facts, next(path.glob("*_vat.glb")))


def _of_textures(frames: np.ndarray, facts: dict, mesh: Path) -> Found:
    gltf = pygltflib.GLTF2().load(str(mesh))
    return Found(
        frames,
        [each.name for each in gltf.meshes],
        mesh_of(mesh)["TEXCOORD_0"],
        [material.name for material in gltf.materials],
        unit=facts.get("unit"),
        up=facts.get("up_axis"),
        rate=facts.get("fps"),
        start=facts.get("start_frame"),
    )


# ---- what athcodec finds in files of other libraries ----


def as_read(path: Path, **options: Any) -> Found:
    with athcodec.read(path, **options) as clip:
        said, uv = clip.metadata, clip.attributes.get("uv")
        if uv is not None and len(uv) == FACES.size:  # of corners
            corners, uv = uv, np.empty_like(UV)
            uv[clip.polygons[1]] = corners
        elif uv is not None:
            uv = uv[:, :2]  # meshio fills a third number with zeros for VTK
        copies = clip.attributes.get("part_copies")
        return Found(
            clip.block(0, FRAMES),
            said.get("part_names", []),
            uv,
            said.get("material_names"),
            copies is not None and copies.tolist() == [1, COPIES],
            clips=max(len(clip.clip_ranges), 1),
            unit=said.get("unit"),
            up=said.get("up_axis"),
            rate=said.get("fps"),
            start=said.get("start_frame"),
        )


def by_usd(path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(path))
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetStartTimeCode(START)
    stage.SetEndTimeCode(START + FRAMES - 1)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    mesh = _mesh_by_usd(stage, "/bough", QUADS, UV[:12])
    bark = UsdShade.Material.Define(stage, "/looks/bark")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(bark)
    instancer = UsdGeom.PointInstancer.Define(stage, "/leaf")
    card = _mesh_by_usd(stage, "/leaf/leaf", np.arange(4)[None], UV[12:16])
    card.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(CARD))
    subset = UsdShade.MaterialBindingAPI.Apply(card.GetPrim()).CreateMaterialBindSubset("lamina", [0])
    green = UsdShade.Material.Define(stage, "/looks/green")
    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(green)
    instancer.CreatePrototypesRel().SetTargets(["/leaf/leaf"])
    instancer.CreateProtoIndicesAttr([0] * COPIES)
    turns = [Gf.Quatf(np.cos(i / 2), 0, 0, np.sin(i / 2)) for i in range(COPIES)]
    instancer.CreateOrientationsfAttr(Vt.QuatfArray(turns))
    for frame in range(FRAMES):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(bough(frame)), START + frame)
        shifts = np.array([at for _, at in places(frame)], np.float32)
        instancer.GetPositionsAttr().Set(Vt.Vec3fArray.FromNumpy(shifts), START + frame)
    stage.Save()


def _mesh_by_usd(stage: Usd.Stage, path: str, faces: np.ndarray, uv: np.ndarray) -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreateFaceVertexCountsAttr([4] * len(faces))
    mesh.CreateFaceVertexIndicesAttr(faces.reshape(-1).tolist())
    coordinates = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
    coordinates.Set(Vt.Vec2fArray.FromNumpy(uv))
    return mesh


def by_alembic(path: Path) -> None:
    archive = Abc.OArchive(str(path))
    sampling = Abc.Argument(archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / RATE, START / RATE)))
    mesh = AbcGeom.OPolyMesh(archive.getTop(), "bough", sampling)
    _fill_by_alembic(mesh, [bough(frame) for frame in range(FRAMES)], QUADS, UV[:12], "bark")
    at = [AbcGeom.OXform(archive.getTop(), f"at{i}", sampling) for i in range(COPIES)]
    card = AbcGeom.OPolyMesh(at[0], "leaf")
    _fill_by_alembic(card, [CARD], np.arange(4)[None], UV[12:16], "green")
    for i, place in enumerate(at):
        for frame in range(FRAMES):
            rotation, shift = places(frame)[i]
            sample = AbcGeom.XformSample()
            sample.setMatrix(matrix(rotation.T, shift))
            place.getSchema().set(sample)
        if i:
            place.addChildInstance(card, "leaf")
    del archive, mesh, at, place, card
    gc.collect()


def _fill_by_alembic(mesh: Any, frames: list[np.ndarray], faces: np.ndarray, uv: np.ndarray, material: str) -> None:
    held = [filled(imath.IntArray, faces[:, ::-1].reshape(-1)), filled(imath.IntArray, [4] * len(faces))]
    coordinates = filled(imath.V2fArray, uv)
    said = AbcGeom.OV2fGeomParamSample(coordinates, AbcGeom.GeometryScope.kVertexScope)
    for number, points in enumerate(frames):
        points = filled(imath.V3fArray, points)
        sample = AbcGeom.OPolyMeshSchemaSample
        mesh.getSchema().set(sample(points) if number else sample(points, *held, iUVs=said))
    every = filled(imath.IntArray, np.arange(len(faces)))
    mesh.getSchema().createFaceSet(material).getSchema().set(AbcGeom.OFaceSetSchemaSample(every))


def by_gltf(path: Path) -> None:
    """In metres with y up, as glTF is: the numbers of POSITIONS turned and divided; two animations."""
    made = Maker()
    own, card = (metres(points).astype(np.float32) for points in (np.stack([bough(f) for f in range(FRAMES)]), CARD))
    uv = [made.array(UV[:12]), made.array(UV[12:16])]
    targets = [{"POSITION": made.array(frame - own[0])} for frame in own]
    shape = {"POSITION": made.array(own[0]), "TEXCOORD_0": uv[0]}
    node = made.node(mesh=made.mesh(shape, "bough", corners(QUADS), targets=targets, weights=[0.0] * FRAMES))
    made.gltf.materials += [pygltflib.Material(name=name) for name in ("bark", "green")]
    made.gltf.meshes[0].primitives[0].material = 0
    parts = {
        "TRANSLATION": made.array(metres(np.array([at for _, at in places(0)]))),
        "ROTATION": made.array(np.array([[0, np.sin(i / 2), 0, np.cos(i / 2)] for i in range(COPIES)])),
    }
    shape = {"POSITION": made.array(card), "TEXCOORD_0": uv[1]}
    leaf_mesh = made.mesh(shape, "leaf", corners(np.arange(4)[None]))
    made.gltf.meshes[leaf_mesh].primitives[0].material = 1
    leaf = made.node(mesh=leaf_mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": parts}})
    made.gltf.extensionsUsed = made.gltf.extensionsRequired = ["EXT_mesh_gpu_instancing"]
    times, lift = (START + np.arange(FRAMES)) / RATE, [metres(places(f)[0][1] - places(0)[0][1]) for f in range(FRAMES)]
    for name in ("calm", "storm"):
        weights = (node, "weights", times, np.eye(FRAMES), "LINEAR")
        made.animation([weights, (leaf, "translation", times, lift, "LINEAR")], name)
    made.save(path)


def metres(points: np.ndarray) -> np.ndarray:
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1) / 100


def corners(quads: np.ndarray) -> np.ndarray:
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1)


def by_lines(path: Path) -> None:
    """OBJ, by its text."""
    for frame, points in enumerate(POSITIONS, START):
        write_obj(path.with_name(f"a_{frame}.obj"), points)
    (path.with_name(f"a_{START}.obj")).rename(path)


def write_obj(path: Path, points: np.ndarray) -> None:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()] + [f"vt {u!r} {v!r}" for u, v in UV.tolist()]
    for name, material, faces in zip(NAMES, ("bark", "green"), np.split(FACES + 1, [len(QUADS)])):
        lines += [f"o {name}", f"usemtl {material}"]
        lines += ["f " + " ".join(f"{corner}/{corner}" for corner in face) for face in faces.tolist()]
    path.write_text("\n".join(lines) + "\n")


def by_meshio(path: Path) -> None:
    """PLY, VTK and VTU, a file for each frame, and their PVD."""
    suffix = ".vtu" if path.suffix == ".pvd" else path.suffix
    data = {"s": UV[:, 0], "t": UV[:, 1]} if suffix == ".ply" else {"uv": UV}
    lines = []
    for frame, points in enumerate(POSITIONS):
        name = path.name if suffix != ".vtu" and frame == 0 else f"a_{START + frame}{suffix}"
        meshio.Mesh(points, [("quad", FACES)], point_data=data).write(path.with_name(name))
        lines.append(f'<DataSet timestep="{frame / RATE!r}" part="0" file="{name}"/>')
    if path.suffix == ".pvd":
        head = '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian"><Collection>'
        path.write_text(head + "".join(lines) + "</Collection></VTKFile>")


def by_time_series(path: Path) -> None:
    with meshio.xdmf.TimeSeriesWriter(str(path), data_format="XML") as writer:
        writer.write_points_cells(POSITIONS[0], [("quad", FACES)])
        for frame, points in enumerate(POSITIONS):
            writer.write_data(frame / RATE, point_data={"displacement": points - POSITIONS[0], "uv": UV})


def by_bytes(path: Path) -> None:
    """PC2 and MDD, and the OBJ beside them."""
    write_obj(path.with_suffix(".obj"), POSITIONS[0])
    if path.suffix == ".pc2":
        head = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, POSITIONS.shape[1], START, 1, FRAMES)
        path.write_bytes(head + POSITIONS.astype("<f4").tobytes())
    else:
        times = ((START + np.arange(FRAMES)) / RATE).astype(">f4")
        path.write_bytes(struct.pack(">2i", *POSITIONS.shape[:2]) + times.tobytes() + POSITIONS.astype(">f4").tobytes())


def by_schema(path: Path) -> None:
    """HDF5 by h5py, .npz by NumPy, as the schema of the page says."""
    arrays = {"positions": POSITIONS, "time": np.arange(FRAMES) / RATE, "faces": FACES, "uv": UV}
    arrays |= {"part_vertex_counts": np.array(COUNTS), "part_copies": np.array([1, COPIES])}
    arrays["face_material"] = np.repeat([0, 1], [len(QUADS), COPIES])
    said = {"unit": "cm", "up_axis": "z", "fps": RATE, "start_frame": START, "part_names": NAMES}
    said["material_names"] = ["bark", "green"]
    if path.suffix == ".npz":
        np.savez(path, **arrays, metadata=json.dumps(said))
        return
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
        file.attrs.update(said)


SHORT = {"+": YES, "-": NO, "vertices": "as vertices", "one": "one a file", "y-up": "y up"}


@dataclass(frozen=True)
class Route:
    """A row: the file, who reads or writes it, and the cells by their short names, in the order of COLUMNS."""

    name: str
    file: str
    other: Callable[[Path], Any]
    libraries: str
    short: str
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def cells(self) -> str:
        return " | ".join(SHORT.get(word, word) for word in self.short.split())


SOURCES: list[Route] = [
    Route("USD", "a.usda", by_usd, "usd-core", "+ + names + + one + + + +"),
    Route("Alembic", "a.abc", by_alembic, "alembic3d", "+ + names + + one - - + +"),
    Route("glTF", "a.glb", by_gltf, "pygltflib", "+ + names + + + metres y-up + +", {"takes": ["all"]}),
    Route("OBJ", f"a_{START}.obj", by_lines, "its text", "+ + names + vertices one - - - +"),
    Route("PLY", f"a_{START}.ply", by_meshio, "meshio", "+ - - + vertices one - - - +"),
    Route("PC2 and its OBJ", "a.pc2", by_bytes, "NumPy", "+ + names + vertices one - - - +"),
    Route("MDD and its OBJ", "a.mdd", by_bytes, "NumPy", "+ + names + vertices one - - + +"),
    Route("XDMF", "a.xdmf", by_time_series, "meshio", "+ - - + vertices one - - + -"),
    Route("VTU, PVD", "a.pvd", by_meshio, "meshio", "+ - - + vertices one - - + +"),
    Route("VTK", f"a_{START}.vtk", by_meshio, "meshio", "+ - - + vertices one - - - +"),
    Route("HDF5", "a.h5", by_schema, "h5py", "+ + names + + one + + + +"),
    Route("NumPy", "a.npz", by_schema, "NumPy", "+ + names + + one + + + +"),
]
TARGETS: list[Route] = [
    Route("USD", "a.usda", in_usd, "usd-core", "+ + names + vertices one + + + +"),
    Route("USD, `--instances`", "a.usdc", in_usd, "usd-core", "+ + names + + one + + + +", {"instances": True}),
    Route("USD, `--rig`", "rig.usda", in_usd, "usd-core", "+ + names + vertices + + + + +", {"rig": 64}),
    Route("Alembic", "a.abc", in_alembic, "alembic3d", "+ + names + vertices one - y-up + +"),
    Route(
        "Alembic, `--instances`", "a.abc", in_alembic, "alembic3d", "+ + names + + one - y-up + +", {"instances": True}
    ),
    Route(
        "glTF, joints", "a.glb", in_gltf, "pygltflib", "+ + names + vertices + metres y-up + +", {"animation": "joints"}
    ),
    Route(
        "glTF, morph targets",
        "a.glb",
        in_gltf,
        "pygltflib",
        "+ + names + vertices + metres y-up + +",
        {"animation": "morphs"},
    ),
    Route("glTF, `--instances`", "a.glb", in_gltf, "pygltflib", "+ + names + + + metres y-up + +", {"instances": True}),
    Route("glTF, `--rig`", "rig.glb", in_gltf, "pygltflib", "+ + names + vertices + metres y-up + +", {"rig": 64}),
    Route("OBJ", "a.obj", in_numbered, "meshio", "+ + names + vertices one - - - +"),
    Route("PLY", "a.ply", in_numbered, "meshio", "+ + names + + one + + + +"),
    Route("PC2 and its OBJ", "a.pc2", in_pc2, "NumPy, meshio", "+ + names + vertices one - - - +"),
    Route("MDD and its OBJ", "a.mdd", in_mdd, "NumPy, meshio", "+ + names + vertices one - - + +"),
    Route("XDMF", "a.xdmf", in_xdmf, "h5py", "+ + names + + one + + + +"),
    Route("VTU, PVD", "a.pvd", in_vtu, "meshio", "+ + names + + one + + + +"),
    Route("HDF5", "a.h5", in_schema, "h5py", "+ + names + + one + + + +"),
    Route("NumPy", "a.npz", in_schema, "NumPy", "+ + names + + one + + + +"),
    Route("`.vat`", "a.vat", in_vat, "OpenEXR, pygltflib", "+ + names + vertices one + + + +", {"half": False}),
    Route(
        "`.openvat`", "a.openvat", in_openvat, "OpenEXR, pygltflib", "+ + names + vertices one - - - -", {"half": False}
    ),
]


@pytest.fixture(scope="module")
def coded(clip, tmp_path_factory) -> Path:
    """A folder with the clip, and with two clips in one file."""
    folder = tmp_path_factory.mktemp("coded")
    athcodec.encode(clip, folder / "one.ath", rel_error=1e-5, effort="fast")
    shorter = clip.replace(positions=clip.positions[:4], time=clip.time[:4])
    both = athcodec.join({"calm": clip, "storm": shorter})
    athcodec.encode(both, folder / "two.ath", rel_error=1e-5, effort="fast")
    return folder


def _clip_count(coded: Path, folder: Path, route: Route) -> int:
    """How many of two clips are in a file of the format."""
    with athcodec.open(coded / "two.ath") as decoder:
        try:
            athcodec.write(ClipView(decoder, all_clips=True), folder / route.file, **route.options)
        except ClipError as error:
            assert "several clips" in str(error)
            return 1
    return route.other(folder / route.file).clips


@pytest.mark.parametrize("route", TARGETS, ids=lambda route: route.name)
def test_other_libraries_find_what_the_table_says(coded, tmp_path, route):
    with athcodec.open(coded / "one.ath") as decoder:
        athcodec.write(ClipView(decoder), tmp_path / route.file, **route.options)
    found = route.other(tmp_path / route.file)
    (tmp_path / "two").mkdir()
    found.clips = _clip_count(coded, tmp_path / "two", route)
    assert " | ".join(cells(found).values()) == route.cells


@pytest.mark.parametrize("route", SOURCES, ids=lambda route: route.name)
def test_what_other_libraries_write_is_read_as_the_table_says(tmp_path, route):
    route.other(tmp_path / route.file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SourceWarning)
        found = as_read(tmp_path / route.file, **route.options)
    assert " | ".join(cells(found).values()) == route.cells


@pytest.mark.parametrize("instances", [False, True])
@pytest.mark.parametrize("suffix", ["usda", "usdc", "abc", "glb", "h5", "npz", "obj", "xdmf", "ply", "pvd"])
def test_each_face_keeps_its_material_to_a_file_and_back(clip, tmp_path, suffix, instances):
    materials = np.array([2, 0, -1, 0, 2, 1, 3, 3, 3], np.int32)
    if suffix == "obj":
        materials = np.sort(np.abs(materials))  # which has no word for no material
    clip = clip.replace(
        attributes=clip.attributes | {"face_material": materials},
        metadata=clip.metadata | {"material_names": ["wet bark", "Moss.001", "bark", "green"]},
    )
    written = athcodec.write(clip, tmp_path / f"a.{suffix}", instances=instances)
    with athcodec.read(written.files[0]) as again:
        names, found = again.metadata["material_names"], again.attributes["face_material"]
        assert again.metadata["domains"]["face_material"] == "face"
        counts, corners = again.polygons
        first = {tuple(sorted(face)): number for number, face in enumerate(FACES.tolist())}
        faces = np.split(corners, np.cumsum(counts)[:-1])
        of_face = [next(n for corners, n in first.items() if set(face) <= set(corners)) for face in faces]
        expected = [clip.metadata["material_names"][n] if n >= 0 else None for n in materials[of_face]]
        assert [names[n] if n >= 0 else None for n in found] == expected


def test_faces_of_other_materials_keep_copies_vertices(clip, tmp_path):
    clip = clip.replace(
        attributes=clip.attributes | {"face_material": np.repeat([0, 1, 0], [6, 2, 1]).astype(np.int32)}
    )
    for suffix in ("usda", "abc", "glb"):
        assert "instances" not in athcodec.write(clip, tmp_path / f"a.{suffix}", instances=True).facts


def table() -> str:
    """The rows as Markdown."""
    head = ["| | checked with | " + " | ".join(COLUMNS) + " |", "|---|---|" + "---|" * len(COLUMNS)]
    rows = [
        f"| {way} {route.name} | {route.libraries} | {route.cells} |"
        for way, routes in (("from", SOURCES), ("to", TARGETS))
        for route in routes
    ]
    return "\n".join(head + rows)


def test_the_table_of_the_page_is_that_of_these_tests():
    assert table() in PAGE.read_text("utf-8"), f"expected\n{table()}"


if __name__ == "__main__":
    print(table())
