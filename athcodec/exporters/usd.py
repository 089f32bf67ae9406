"""Writes USD: one Mesh, BasisCurves or Points prim per part of a clip, with time samples of points and extent.

Faces, texture coordinates and other static arrays are written once. Frames are written as they come and saved now and
then: what has been saved leaves memory, so that a clip may be longer than memory. USD's points are float32, a clip in
float64 is rounded. Prims are in world space and hold no transforms. What USD has no place for (branches, arrays per
branch, records) lies in the namespace "athcodec" of the root prim, from where sources/usd.py takes it back.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, Vt

from athcodec.clip import frame_rate
from athcodec.errors import ClipError
from athcodec.exporters import WriteOptions
from athcodec.files import new_files
from athcodec.units import METRES, unit_symbol

SAVE_BYTES = 16 << 20
OWN = "athcodec"
PRIMVARS = {"uv": "st", "colors": "displayColor"}
# kept by the stage itself, or by the prims
KNOWN_METADATA = ("fps", "start_frame", "unit", "up_axis", "part_names", "part_kinds", "part_usd", "domains")
KNOWN_ATTRIBUTES = ("part_vertex_counts", "curve_vertex_counts", "face_vertex_counts", "face_vertex_indices")
TYPES = {  # of a row's shape and kind; for the shape None any number of values per row
    "f": {(): "Float", (2,): "Float2", (3,): "Float3", (4,): "Float4"},
    "d": {(): "Double", (2,): "Double2", (3,): "Double3", (4,): "Double4"},
    "e": {(): "Half", (2,): "Half2", (3,): "Half3", (4,): "Half4"},
    "i": {(): "Int", (2,): "Int2", (3,): "Int3", (4,): "Int4"},
    "u": {(): "UInt"}, "q": {(): "Int64"}, "Q": {(): "UInt64"}, "B": {(): "UChar"}, "?": {(): "Bool"},
}
WIDER = {"?": "?", "b": "i", "h": "i", "H": "i", "B": "B", "i": "i", "I": "u", "l": "q", "q": "q", "L": "Q", "Q": "Q",
         "e": "e", "f": "f", "d": "d"}
NUMPY = {"i": "<i4", "u": "<u4", "q": "<i8", "Q": "<u8", "B": "u1", "?": "?", "e": "<f2", "f": "<f4", "d": "<f8"}
INTERPOLATION = {"vertex": "vertex", "corner": "faceVarying", "face": "uniform", "constant": "constant"}


def write_clip(motion: Any, path: str | PathLike[str], options: WriteOptions, report: Callable[[float], None]) -> None:
    """Write a MotionClip or an Excerpt as .usdc, .usda, .usdz or, binary, .usd. Raises ClipError, OSError."""
    path = os.fspath(path)
    with new_files(path) as folder, _saying(path):
        name = Path(path).name
        suffix = Path(path).suffix.lower()
        binary = os.path.join(folder, f"{_identifier(Path(path).stem)}.usdc")
        _write(motion, binary, report)
        _convert(binary, os.path.join(folder, name), suffix)


@contextmanager
def _saying(path: str) -> Iterator[None]:
    """USD's errors in one line each: that a file cannot be written is all that can go wrong here."""
    with Tf.DiagnosticTrap() as trap:
        try:
            yield
        except Tf.ErrorException as error:
            raise OSError(f"{path}: cannot be written: {' '.join(str(error).split())}") from None
        finally:
            trap.Clear()


def _convert(binary: str, target: str, suffix: str) -> None:
    """From the binary file that was written to what is wanted; the latter alone is left."""
    if suffix == ".usda":
        text = f"{binary}.usda"
        _must(Sdf.Layer.FindOrOpen(binary).Export(text), binary)
    elif suffix == ".usdz":
        text = f"{binary}.usdz"
        writer = Sdf.ZipFileWriter.CreateNew(text)
        _must(writer.AddFile(binary, os.path.basename(binary)), binary)
        _must(writer.Save(), binary)
    else:
        text = binary
    if text != binary:
        os.remove(binary)
    os.rename(text, target)


def _must(done: object, name: str) -> None:
    if not done:
        raise OSError(f"{name}: cannot be written")


def _write(motion: Any, name: str, report: Callable[[float], None]) -> None:
    codes, rate = _time_codes(motion)
    stage = Usd.Stage.CreateNew(name)
    root = UsdGeom.Xform.Define(stage, "/clip").GetPrim()
    stage.SetDefaultPrim(root)
    _describe_stage(stage, motion, codes, rate)
    parts = _parts(motion)
    for part, place in zip(parts, _places(parts)):
        _define(stage, place, part)
    left = _static_arrays(stage, motion, parts)
    _own_arrays(root, motion, left)
    _write_frames(stage, motion, parts, codes, report)


def _time_codes(motion: Any) -> tuple[np.ndarray, float]:
    """The time code of each frame, its number in the tool that made it, and time codes per second."""
    metadata = motion.metadata
    rate = frame_rate(metadata) if "fps" in metadata else float(motion.fps)
    start = metadata.get("start_frame", 0)
    if isinstance(start, bool) or not isinstance(start, (int, float)):
        raise ClipError(f"start_frame: got {start!r}, expected a number")
    codes = start + np.round(np.asarray(motion.time) * rate, 6)
    if (np.diff(codes) <= 0).any():
        frame = int(np.flatnonzero(np.diff(codes) <= 0)[0]) + 1
        raise ClipError(f"time: frame {frame} is at time code {codes[frame]:g} as the one before it, "
                        "expected a larger one")
    return codes, rate


def _describe_stage(stage: Usd.Stage, motion: Any, codes: np.ndarray, rate: float) -> None:
    metadata = motion.metadata
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(float(codes[0]))
    stage.SetEndTimeCode(float(codes[-1]))
    metres = METRES.get(unit_symbol(metadata.get("unit", "")), metadata.get("meters_per_unit"))
    if isinstance(metres, float) and metres > 0:
        UsdGeom.SetStageMetersPerUnit(stage, metres)
    up_axis = str(metadata.get("up_axis", "")).upper()
    if up_axis in ("Y", "Z"):
        UsdGeom.SetStageUpAxis(stage, up_axis)
    kept = {key: value for key, value in metadata.items() if key not in KNOWN_METADATA}
    if up_axis == "X":
        kept["up_axis"] = "x"
    unit = metadata.get("unit")
    if unit is not None and unit_symbol(unit) not in METRES:
        kept["unit"] = unit
    if len(codes) > 1 and not np.allclose(codes - codes[0], np.arange(len(codes)), rtol=0, atol=1e-5):
        kept["irregular"] = True
    if kept:
        stage.GetRootLayer().customLayerData = {OWN: json.dumps(kept)}


# ---- parts ----


@dataclass
class _Part:
    """A run of vertices that becomes one prim, its faces and its curves in its own numbering."""

    name: str
    kind: str
    first: int
    count: int
    faces: tuple[np.ndarray, np.ndarray]
    curves: np.ndarray
    face_rows: slice
    corner_rows: slice
    details: dict[str, str]
    schema: Any = None
    width: float = 0.0

    @property
    def vertices(self) -> slice:
        return slice(self.first, self.first + self.count)


def _parts(motion: Any) -> list[_Part]:
    names, counts, kinds, details = _division(motion)
    face_counts, face_indices = motion.polygons or (np.empty(0, np.int64), np.empty(0, np.int64))
    face_indices = np.asarray(face_indices, np.int64)
    corners = np.concatenate([[0], np.cumsum(face_counts, dtype=np.int64)])
    ends = np.cumsum(counts, dtype=np.int64)
    owner = _owners(corners, face_indices, ends)
    curves = iter(_curve_counts(motion, ends, kinds))
    parts = []
    for i, (name, kind, end, count, detail) in enumerate(zip(names, kinds, ends, counts, details)):
        low, high = np.searchsorted(owner, [i, i + 1])
        rows, first = slice(int(corners[low]), int(corners[high])), int(end - count)
        faces = np.asarray(face_counts[low:high]), face_indices[rows] - first
        face_rows = slice(int(low), int(high))
        parts.append(_Part(name, kind, first, int(count), faces, next(curves), face_rows, rows, detail))
    return parts


def _owners(corners: np.ndarray, indices: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(F,) the part of each face, ascending; everything belongs to part 0 where faces lie across parts."""
    counts = np.diff(corners)
    of_corner = np.searchsorted(ends, indices, "right")
    faces = np.repeat(np.arange(len(counts)), counts)
    owner = np.zeros(len(counts), np.int64)
    owner[faces] = of_corner
    filled = np.maximum.accumulate(owner) if len(owner) else owner
    owner = np.where(counts > 0, owner, filled)
    return owner


def _division(motion: Any) -> tuple[list[str], np.ndarray, list[str], list[dict[str, str]]]:
    """Names, vertices, kinds and further details of the parts: what the clip says, where that fits, else one part."""
    metadata, counts = motion.metadata, motion.attributes.get("part_vertex_counts")
    names, kinds = metadata.get("part_names"), metadata.get("part_kinds")
    count = motion.vertex_count
    if isinstance(names, list) and counts is not None and counts.dtype.kind in "iu" and counts.shape == (len(names),):
        if (counts >= 0).all() and counts.sum(dtype=np.int64) == count and _fits(motion, counts):
            if not isinstance(kinds, list) or len(kinds) != len(names):
                kinds = [_kind(motion, counts, i) for i in range(len(names))]
            details = metadata.get("part_usd")
            if not isinstance(details, list) or len(details) != len(names):
                details = [{}] * len(names)
            return [str(each) for each in names], counts.astype(np.int64), kinds, details
    return ["plant"], np.array([count]), [_kind(motion, np.array([count]), 0)], [{}]


def _fits(motion: Any, counts: np.ndarray) -> bool:
    """Whether every face is of one part, and the faces are in the order of the parts."""
    if motion.polygons is None:
        return True
    face_counts, indices = motion.polygons
    owner = np.searchsorted(np.cumsum(counts, dtype=np.int64), indices, "right")
    first = np.repeat(np.cumsum(face_counts, dtype=np.int64) - face_counts, face_counts)
    return bool((owner == owner[first]).all() and (np.diff(owner) >= 0).all()) if len(owner) else True


def _kind(motion: Any, counts: np.ndarray, index: int) -> str:
    stop = int(counts[: index + 1].sum())
    start = stop - int(counts[index])
    polygons = motion.polygons
    if polygons is not None and ((polygons[1] >= start) & (polygons[1] < stop)).any():
        return "mesh"
    edges = motion.edges
    if edges is not None and len(edges) and ((edges[:, 0] >= start) & (edges[:, 0] < stop)).any():
        chains = _chains(edges, start, stop)
        if chains is not None:
            return "curves"
    return "points"


def _chains(edges: np.ndarray, start: int, stop: int) -> np.ndarray | None:
    """Vertices per curve where runs of vertices that are neighbours in the numbering and joined by edges make curves
    of two and more, else None. Further edges, where a branch begins at its parent, are not seen in the curves."""
    own = np.asarray(edges, np.int64)
    own = own[(own >= start).all(axis=1) & (own < stop).all(axis=1)]
    neighbours = own[np.abs(np.diff(own, axis=1)[:, 0]) == 1]
    joined = np.zeros(stop - start, bool)
    joined[neighbours.max(axis=1) - start] = True
    counts = np.diff(np.append(np.flatnonzero(~joined), stop - start))
    return counts if (counts > 1).all() else None


def _curve_counts(motion: Any, ends: np.ndarray, kinds: list[str]) -> Iterator[np.ndarray]:
    """For each part its vertices per curve, empty where it is none."""
    said = motion.attributes.get("curve_vertex_counts")
    totals = [int(end - start) if kind == "curves" else 0 for end, start, kind in
              zip(ends, np.append(0, ends[:-1]), kinds)]
    usable = said is not None and said.ndim == 1 and said.dtype.kind in "iu" and int(said.sum()) == sum(totals)
    done = 0
    for end, total in zip(ends, totals):
        if not total:
            yield np.empty(0, np.int64)
        elif usable:
            stop = done + int(np.searchsorted(np.cumsum(said[done:], dtype=np.int64), total)) + 1
            yield said[done:stop]
            done = stop
        else:
            chains = None if motion.edges is None else _chains(motion.edges, int(end) - total, int(end))
            yield np.array([total]) if chains is None else chains


def _identifier(name: str) -> str:
    return Tf.MakeValidIdentifier(name.strip("/") or "part")


def _places(parts: list[_Part]) -> list[str]:
    taken, places = set(), []
    for part in parts:
        wanted = name = _identifier(part.name)
        number = 1
        while name in taken:
            number += 1
            name = f"{wanted}_{number}"
        taken.add(name)
        places.append(f"/clip/{name}")
    return places


def _define(stage: Usd.Stage, place: str, part: _Part) -> None:
    if part.kind == "mesh":
        part.schema = mesh = UsdGeom.Mesh.Define(stage, place)
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateFaceVertexCountsAttr(_int_array(part.faces[0]))
        mesh.CreateFaceVertexIndicesAttr(_int_array(part.faces[1]))
        if part.details.get("orientation") == UsdGeom.Tokens.leftHanded:
            mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    elif part.kind == "curves":
        part.schema = curves = UsdGeom.BasisCurves.Define(stage, place)
        curves.CreateCurveVertexCountsAttr(_int_array(part.curves))
        curves.CreateTypeAttr(part.details.get("type", UsdGeom.Tokens.linear))
        curves.CreateWrapAttr(part.details.get("wrap", UsdGeom.Tokens.nonperiodic))
        if part.details.get("basis"):
            curves.CreateBasisAttr(part.details["basis"])
    else:
        part.schema = UsdGeom.Points.Define(stage, place)
    part.schema.CreatePointsAttr()
    part.schema.CreateExtentAttr()


def _int_array(values: np.ndarray) -> Vt.IntArray:
    return Vt.IntArray.FromNumpy(np.ascontiguousarray(values, np.int32))


# ---- static arrays ----


def _static_arrays(stage: Usd.Stage, motion: Any, parts: list[_Part]) -> dict[str, tuple[np.ndarray, str]]:
    """Writes those that belong to vertices, corners and faces; returns the others, with their domains."""
    left = {}
    domains = motion.metadata.get("domains", {})
    for name, values in motion.attributes.items():
        if name in KNOWN_ATTRIBUTES:
            continue
        domain = _domain(motion, name, values, domains)
        if domain not in INTERPOLATION or not _write_array(name, values, domain, parts):
            left[name] = values, domain
    return left


def _domain(motion: Any, name: str, values: np.ndarray, domains: dict[str, str]) -> str:
    """What the clip says where the rows fit, else what they fit."""
    polygons = motion.polygons or ((), ())
    rows = {"vertex": motion.vertex_count, "corner": len(polygons[1]), "face": len(polygons[0]), "constant": 1,
            "branch": motion.branch_count}
    count = len(values) if values.ndim else -1
    said = domains.get(name) if isinstance(domains, dict) else None
    if said is not None:
        return said if rows.get(said) == count else "other"
    return next((each for each in ("vertex", "branch", "face") if count == rows[each]), "other")


def _write_array(name: str, values: np.ndarray, domain: str, parts: list[_Part]) -> bool:
    if name == "radius" and domain in ("vertex", "constant") and values.ndim == 1 and values.dtype == np.float32:
        return _write_radius(values, domain, parts)
    kind = WIDER.get(values.dtype.char)
    shapes = TYPES.get(kind or "", {})
    row = values.shape[1:]
    if kind is None or values.dtype.kind not in "biuf" or (row not in shapes and () not in shapes) or not values.size:
        return False
    element_size = 1 if row in shapes else int(np.prod(row))
    if row not in shapes and len(row) > 1:
        return False
    type_name = _type_name(name, kind, row if row in shapes else ())
    for part in parts:
        rows = _rows(values, domain, part)
        primvar = UsdGeom.PrimvarsAPI(part.schema).CreatePrimvar(
            PRIMVARS.get(name, _identifier(name)), type_name, INTERPOLATION[domain], element_size)
        primvar.Set(_vt(rows, type_name, NUMPY[kind]))
        if np.dtype(NUMPY[kind]) != values.dtype:
            primvar.GetAttr().SetCustomDataByKey(f"{OWN}:dtype", values.dtype.str)
        if _identifier(name) != name:
            primvar.GetAttr().SetCustomDataByKey(f"{OWN}:name", name)
    return True


def _write_radius(values: np.ndarray, domain: str, parts: list[_Part]) -> bool:
    """As widths of curves and points; of meshes as a primvar."""
    for part in parts:
        rows = _rows(values, domain, part)
        if part.kind == "mesh":
            primvar = UsdGeom.PrimvarsAPI(part.schema).CreatePrimvar("radius", Sdf.ValueTypeNames.FloatArray,
                                                                     INTERPOLATION[domain])
            primvar.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(rows)))
        else:
            part.schema.CreateWidthsAttr(Vt.FloatArray.FromNumpy(np.ascontiguousarray(rows * np.float32(2))))
            part.schema.SetWidthsInterpolation(INTERPOLATION[domain])
            part.width = 2 * float(rows.max(initial=0))
    return True


def _rows(values: np.ndarray, domain: str, part: _Part) -> np.ndarray:
    rows = {"vertex": part.vertices, "corner": part.corner_rows, "face": part.face_rows, "constant": slice(0, 1)}
    return values[rows[domain]]


def _type_name(name: str, kind: str, row: tuple[int, ...]) -> Sdf.ValueTypeName:
    base = TYPES[kind][row]
    roles = {("uv", "Float2"): "TexCoord2f", ("colors", "Float3"): "Color3f", ("normals", "Float3"): "Normal3f"}
    return getattr(Sdf.ValueTypeNames, f"{roles.get((name, base), base)}Array")


def _vt(values: np.ndarray, type_name: Sdf.ValueTypeName, dtype: str) -> Any:
    array = type(type_name.defaultValue)
    values = np.ascontiguousarray(values, dtype)
    if values.ndim > 1 and not array.__name__.startswith("Vec"):
        values = values.reshape(-1)
    return array.FromNumpy(values) if len(values) else array()


def _own_arrays(root: Usd.Prim, motion: Any, left: dict[str, tuple[np.ndarray, str]]) -> None:
    """What has no place in the prims, byte for byte."""
    rest = np.asarray(motion.rest)
    rest = rest.astype(getattr(motion, "rest_dtype", rest.dtype))
    arrays = {"rest": (rest, "vertex"), **left}
    for name in ("vertex_branch", "branch_parent", "stem_index", "edges"):
        values = getattr(motion, name, None)
        if values is not None:
            arrays[name] = np.asarray(values), {"vertex_branch": "vertex", "stem_index": "vertex"}.get(name, "constant")
    for name, (values, domain) in arrays.items():
        attribute = root.CreateAttribute(f"{OWN}:{_identifier(name)}", Sdf.ValueTypeNames.UCharArray, True,
                                         Sdf.VariabilityUniform)
        raw = np.frombuffer(np.ascontiguousarray(values).tobytes(), np.uint8)
        attribute.Set(Vt.UCharArray.FromNumpy(raw) if len(raw) else Vt.UCharArray())
        dtype = values.dtype
        dtype = json.dumps(values.dtype.descr) if values.dtype.names else values.dtype.str
        said = {"name": name, "dtype": dtype, "shape": json.dumps(list(values.shape)),
                "domain": "" if domain == "other" else domain}
        for key, text in said.items():
            attribute.SetCustomDataByKey(f"{OWN}:{key}", text)


# ---- frames ----


def _write_frames(stage: Usd.Stage, motion: Any, parts: list[_Part], codes: np.ndarray,
                  report: Callable[[float], None]) -> None:
    layer = stage.GetRootLayer()
    places = [(part, part.schema.GetPointsAttr().GetPath(), part.schema.GetExtentAttr().GetPath()) for part in parts]
    unsaved = 0
    for start, block in motion.blocks():
        for row, positions in enumerate(block.astype(np.float32, copy=False)):
            with Sdf.ChangeBlock():
                _write_frame(layer, places, positions, float(codes[start + row]))
            unsaved += positions.nbytes
            if unsaved >= SAVE_BYTES:
                _must(layer.Save(), layer.identifier)
                unsaved = 0
        report((start + len(block)) / len(codes))
    _must(layer.Save(), layer.identifier)


def _write_frame(layer: Sdf.Layer, places: list, positions: np.ndarray, code: float) -> None:
    for part, points, extent in places:
        own = np.ascontiguousarray(positions[part.vertices])
        layer.SetTimeSample(points, code, Vt.Vec3fArray.FromNumpy(own) if len(own) else Vt.Vec3fArray())
        if len(own):
            half = np.float32(part.width / 2)
            box = np.stack([own.min(axis=0) - half, own.max(axis=0) + half])
            layer.SetTimeSample(extent, code, Vt.Vec3fArray.FromNumpy(box))
