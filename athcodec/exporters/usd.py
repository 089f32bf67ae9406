"""Writes USD: one Mesh, BasisCurves or Points prim per object of a clip, with time samples of points and extent.

Faces, texture coordinates, names of materials and other static arrays are written once. Frames are written as they come
and saved now and then: what has been saved leaves memory, so that a clip may be longer than memory. USD's points are
float32, a clip in float64 is rounded. The root has a translation if a plant is far from the origin; of other prims only
copies of one shape have transforms: they become a PointInstancer if options.instances asks for it. Every object has a
displayColor, and open faces are doubleSided (looks.py). Meshes whose points have no time samples, as those of a rig,
have normals; of others renderers make those of flat faces, which follow the motion and take no bytes. What USD has no
place for (branches, arrays per branch, bytes) lies in the namespace "athcodec" of the root prim, from where
sources/usd.py takes it back.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters import usd_nanite as nanite
from athcodec.exporters.copies import Copies, cost_of, fit_copies, one_copy, rows_of_one
from athcodec.exporters.gltf_joints import Joints
from athcodec.exporters.looks import Looks, line_look, looks_of
from athcodec.exporters.placing import origin_of
from athcodec.exporters.rig import fit_rig
from athcodec.exporters.samples import samples_of, velocities_of_copies
from athcodec.exporters.scene_objects import (
    KNOWN_ATTRIBUTES,
    KNOWN_METADATA,
    SceneObject,
    distinct,
    domain_of,
    face_materials,
    hidden_copies,
    is_double_sided,
    material_runs,
    objects_of,
    own_arrays,
    rows_of,
)
from athcodec.exporters.timing import distinct_frame_numbers, frame_rate_of
from athcodec.exporters.usd_rig import write_rig
from athcodec.files.atomic import new_files
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.motion.units import METRES, metres_of, unit_symbol
from athcodec.sources.scene_objects import FACE_MATERIAL, GUESSED, OWN, SCHEME
from athcodec.untyped import JsonObject, UsdObject

SAVE_BYTES = 16 << 20
PRIMVARS = {"uv": "st", "colors": "displayColor"}
TYPES: dict[
    str, dict[tuple[int, ...], str]
] = {  # By a row's shape and kind; the shape None stands for any number of values per row.
    "f": {(): "Float", (2,): "Float2", (3,): "Float3", (4,): "Float4"},
    "d": {(): "Double", (2,): "Double2", (3,): "Double3", (4,): "Double4"},
    "e": {(): "Half", (2,): "Half2", (3,): "Half3", (4,): "Half4"},
    "i": {(): "Int", (2,): "Int2", (3,): "Int3", (4,): "Int4"},
    "u": {(): "UInt"},
    "q": {(): "Int64"},
    "Q": {(): "UInt64"},
    "B": {(): "UChar"},
    "?": {(): "Bool"},
}
WIDER = {
    "?": "?",
    "b": "i",
    "h": "i",
    "H": "i",
    "B": "B",
    "i": "i",
    "I": "u",
    "l": "q",
    "q": "q",
    "L": "Q",
    "Q": "Q",
    "e": "e",
    "f": "f",
    "d": "d",
}
NUMPY = {"i": "<i4", "u": "<u4", "q": "<i8", "Q": "<u8", "B": "u1", "?": "?", "e": "<f2", "f": "<f4", "d": "<f8"}
MATERIALS = "materials"
WIND = "wind"  # in what is known of an assembly: the text of its JSON
INTERPOLATION = {"vertex": "vertex", "corner": "faceVarying", "face": "uniform", "constant": "constant"}


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write a MotionClip or a ClipView as .usdc, .usda, .usdz or .usd, which is binary. Return what storing copies as
    instances costs in error. Raise ClipError, OSError.
    """
    path = os.fspath(path)
    with new_files(path) as folder, _saying(path):
        name = Path(path).name
        suffix = Path(path).suffix.lower()
        binary = os.path.join(folder, f"{_identifier(Path(path).stem)}.usdc")
        facts = _write(motion, binary, options, report)
        if wind := facts.pop(WIND, ""):
            Path(folder, f"{Path(path).stem}.wind.json").write_text(wind, "utf-8")
        _convert(binary, os.path.join(folder, name), suffix)
    return facts


@contextmanager
def _saying(path: str) -> Iterator[None]:
    """Turn errors that USD raises in the context into an OSError of one line that names `path`."""
    with Tf.DiagnosticTrap() as trap:
        try:
            yield
        except Tf.ErrorException as error:
            raise OSError(f"{path}: cannot be written: {' '.join(str(error).split())}") from None
        finally:
            trap.Clear()


def _convert(binary: str, target: str, suffix: str) -> None:
    """Convert the written binary file to the kind of the suffix, at `target`, and remove the binary file."""
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


def _write(motion: Motion, name: str, options: WriteOptions, report: Progress) -> JsonObject:
    """Write the stage to the file `name`, and return what storing copies as instances, or a rig, costs in error."""
    codes, rate = _time_codes(motion), frame_rate_of(motion)
    stage = Usd.Stage.CreateNew(name)
    joints = None if options.rig is None else fit_rig(motion, options.rig, lambda done: report(0.9 * done))
    root = (UsdGeom.Xform if joints is None or options.nanite else UsdSkel.Root).Define(stage, "/clip").GetPrim()
    stage.SetDefaultPrim(root)
    if origin := origin_of(motion):
        UsdGeom.Xformable(root).AddTranslateOp().Set(tuple(origin))
    _describe_stage(stage, motion, max((codes[a:b] for a, b in motion.clip_range_frames), key=len), rate)
    objects = objects_of(motion)
    looks = looks_of(motion, objects)
    if joints is not None and options.nanite:
        return _write_assembly(stage, motion, joints, objects, looks, report)
    instanced = fit_copies(motion, objects) if options.instances and joints is None else {}
    names = distinct(_identifier(obj.name) for obj in objects)
    for number, (obj, name) in enumerate(zip(objects, names)):
        if number in instanced:
            _define_instanced(stage, f"/clip/{name}", obj, instanced[number])
            _set_normals(obj, motion, _normals_of_one(motion, obj, instanced[number], looks))
        else:
            obj.copies, obj.target = 1, _define(stage, f"/clip/{name}", obj)
        _show(obj, motion, looks)
    _bind_materials(stage, motion, objects, names)
    left = _static_arrays(stage, motion, objects)
    _own_arrays(root, motion, left)
    _write_presence(objects, codes)
    if joints is not None:
        return _write_rigged(stage, motion, joints, objects, looks, report) | hidden_copies(objects)
    placed = [(objects[number], copies) for number, copies in instanced.items()]
    _write_places(stage, placed, codes)
    if options.velocities:
        _write_velocities_of_places(motion, placed, codes)
    _write_frames(stage, motion, objects, codes, report, options.velocities)
    return cost_of(instanced) | hidden_copies(objects, options.instances)


def _time_codes(motion: Motion) -> np.ndarray:
    """Return (T,) of all frames; of several clips each from 0 on."""
    if len(motion.clip_ranges) < 2:
        return distinct_frame_numbers(motion)
    times = (np.asarray(motion.time[start:stop], np.float64) for start, stop in motion.clip_range_frames)
    return np.concatenate([np.round((time - time[0]) * frame_rate_of(motion), 6) for time in times])


def _write_rigged(
    stage: Usd.Stage, motion: Motion, joints: Joints, objects: list[SceneObject], looks: Looks, report: Progress
) -> JsonObject:
    _set_rest(motion, objects, looks)
    write_rig(stage, "/clip", motion, joints, objects, _time_codes(motion))
    _must(stage.GetRootLayer().Save(), stage.GetRootLayer().identifier)
    report(1.0)
    return {"animation": "a rig", "joints": len(joints.bind), "max_error": joints.max_error}


def _set_rest(motion: Motion, objects: list[SceneObject], looks: Looks) -> None:
    """Set the points, normals and extents of all objects to the rest pose."""
    rest = np.asarray(motion.rest, np.float32)
    normals = looks.surface.unit_normals(motion.rest)
    for obj in objects:
        _set_normals(obj, motion, normals[obj.vertices])
        points = rest[obj.vertices]
        obj.target.GetPointsAttr().Set(_vec3(points))
        if len(points):
            obj.target.GetExtentAttr().Set(_vec3([points.min(axis=0), points.max(axis=0)]))


def _write_assembly(
    stage: Usd.Stage, motion: Motion, joints: Joints, objects: list[SceneObject], looks: Looks, report: Progress
) -> JsonObject:
    """Write the stage in the layout of Unreal's Nanite Assemblies (usd_nanite.py), and return facts about it, such as
    its error.
    """
    parts = nanite.parts_of(motion, objects, joints)
    UsdSkel.Root.Define(stage, nanite.BASE)
    names = distinct(("base", *(_identifier(obj.name) for obj in objects)))[1:]
    for number, (obj, name) in enumerate(zip(objects, names)):
        if number in parts:
            mesh = nanite.define_part(stage, f"{nanite.ROOT_PRIM}/{name}", name)
            obj.target = _define(stage, mesh, one_copy(obj))
            obj.instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath(f"{nanite.ROOT_PRIM}/{name}"))
            _set_normals(obj, motion, _normals_of_one(motion, obj, parts[number].copies, looks))
        else:
            obj.copies, obj.target = 1, _define(stage, f"{nanite.BASE}/{name}", obj)
        _show(obj, motion, looks)
    _bind_materials(stage, motion, objects, ["base", *names])
    nanite.mark_root(stage.GetDefaultPrim())
    _own_arrays(stage.GetDefaultPrim(), motion, _static_arrays(stage, motion, objects))
    base = [obj for number, obj in enumerate(objects) if number not in parts]
    _set_rest(motion, base, looks)
    write_rig(stage, nanite.BASE, motion, joints, base, _time_codes(motion))
    for number, part in parts.items():
        nanite.place_part(stage, f"{nanite.ROOT_PRIM}/{names[number]}", names[number], objects[number], part, joints)
    _write_presence(objects, _time_codes(motion))
    _must(stage.GetRootLayer().Save(), stage.GetRootLayer().identifier)
    error = nanite.largest_error(motion, objects, joints, parts)
    report(1.0)
    instances = sum(len(part.joint) for part in parts.values())
    facts = {"animation": "a Nanite Assembly", "joints": len(joints.bind), "instances": instances, "max_error": error}
    return facts | {WIND: nanite.wind_of(motion, joints)} | hidden_copies(objects)


def _describe_stage(stage: Usd.Stage, motion: Motion, codes: np.ndarray, rate: float) -> None:
    """Set the stage's frame rate, its first and last time codes, its unit and its up axis, and keep the remaining
    metadata as JSON.
    """
    metadata = motion.metadata
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(float(codes[0]))
    stage.SetEndTimeCode(float(codes[-1]))
    metres = metres_of(metadata)
    if metres is not None:
        UsdGeom.SetStageMetersPerUnit(stage, metres)
    up_axis = str(metadata.get("up_axis", "")).upper()
    if up_axis in ("Y", "Z"):
        UsdGeom.SetStageUpAxis(stage, up_axis)
    kept = {key: value for key, value in metadata.items() if key not in (*KNOWN_METADATA, "unit", "up_axis")}
    if up_axis == "X":
        kept["up_axis"] = "x"
    unit = metadata.get("unit")
    if unit is not None and unit_symbol(unit) not in METRES:
        kept["unit"] = unit
    if len(codes) > 1 and not np.allclose(codes - codes[0], np.arange(len(codes)), rtol=0, atol=1e-5):
        kept["irregular"] = True
    if kept:
        stage.GetRootLayer().customLayerData = {OWN: json.dumps(kept)}


# ---- objects ----


def _identifier(name: str) -> str:
    return Tf.MakeValidIdentifier(name.strip("/") or "part")


def _define(stage: Usd.Stage, place: str, obj: SceneObject) -> UsdGeom.PointBased:
    """Define a mesh, curves or points prim at the path `place` for an object, without its positions, and return it."""
    if obj.kind == "mesh":
        schema = mesh = UsdGeom.Mesh.Define(stage, place)
        mesh.CreateSubdivisionSchemeAttr(obj.details.get(SCHEME, UsdGeom.Tokens.none))
        mesh.CreateFaceVertexCountsAttr(_int_array(obj.faces[0]))
        mesh.CreateFaceVertexIndicesAttr(_int_array(obj.faces[1]))
        if is_double_sided(obj.details):
            mesh.CreateDoubleSidedAttr(True)
    elif obj.kind == "curves":
        schema = curves = UsdGeom.BasisCurves.Define(stage, place)
        curves.CreateCurveVertexCountsAttr(_int_array(obj.curves))
        curves.CreateTypeAttr(obj.details.get("type", UsdGeom.Tokens.linear))
        curves.CreateWrapAttr(obj.details.get("wrap", UsdGeom.Tokens.nonperiodic))
        if obj.details.get("basis"):
            curves.CreateBasisAttr(obj.details["basis"])
    else:
        schema = UsdGeom.Points.Define(stage, place)
    schema.CreatePointsAttr()
    schema.CreateExtentAttr()
    return schema


def _show(obj: SceneObject, motion: Motion, looks: Looks) -> None:
    """Set the colour of an object, or of each face if these differ, and that open faces are seen from both sides.
    Colours of vertices are written with the clip's other arrays.
    """
    colours, of_face = [line_look(obj.name).colour], np.zeros(0, np.int64)
    if obj.kind == "mesh":
        labels = looks.labels[obj.face_rows].reshape(obj.copies, -1)[0]
        used, of_face = np.unique(labels, return_inverse=True)
        colours = [looks.materials[label].colour for label in used]
        if not is_double_sided(obj.details) and looks.surface.is_open[obj.face_rows].any():
            _mark_guess(obj.target.CreateDoubleSidedAttr(True))
    if "colors" in motion.attributes or not colours:
        return
    has_one = len(set(colours)) == 1
    primvar = obj.target.CreateDisplayColorPrimvar(UsdGeom.Tokens.constant if has_one else UsdGeom.Tokens.uniform)
    primvar.Set(_vec3(colours[:1] if has_one else colours))
    if not has_one:
        primvar.SetIndices(_int_array(of_face))
    _mark_guess(primvar.GetAttr())


def _set_normals(obj: SceneObject, motion: Motion, normals: np.ndarray) -> None:
    """Set the normals of a mesh, (n, 3), whose points stay as they are, where the clip has none."""
    if obj.kind == "mesh" and "normals" not in motion.attributes:
        attribute = obj.target.CreateNormalsAttr(_vec3(normals))
        obj.target.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
        _mark_guess(attribute)


def _normals_of_one(motion: Motion, obj: SceneObject, copies: Copies, looks: Looks) -> np.ndarray:
    """Return the normals of the shape of which an object's vertices are copies."""
    return looks.surface.unit_normals(motion.rest)[obj.vertices][: len(copies.shape)] @ copies.axes


def _mark_guess(attribute: Usd.Attribute) -> None:
    attribute.SetCustomDataByKey(f"{OWN}:{GUESSED}", True)


def _bind_materials(stage: Usd.Stage, motion: Motion, objects: list[SceneObject], names_used: Iterable[str]) -> None:
    """Define the materials by name, without contents, and bind them to the faces that have them."""
    labels_and_names = face_materials(motion)
    if labels_and_names is None or not labels_and_names[1]:
        return
    labels, names = labels_and_names
    scope = UsdGeom.Scope.Define(stage, f"/clip/{distinct([*names_used, MATERIALS])[-1]}").GetPath()
    materials = []
    for name, identifier in zip(names, distinct(map(_identifier, names))):
        material = UsdShade.Material.Define(stage, scope.AppendChild(identifier))
        if name != identifier:
            material.GetPrim().SetDisplayName(name)
        materials.append(material)
    for obj in objects:
        face_labels = rows_of_one(labels[obj.face_rows], obj) if obj.copies > 1 else labels[obj.face_rows]
        runs = [] if face_labels is None or obj.kind != "mesh" else material_runs(face_labels, names)
        prim = obj.target.GetPrim()
        if face_labels is not None and len(runs) == 1 and len(runs[0][1]) == len(face_labels):
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(materials[runs[0][0]])
            continue
        for label, faces in runs:
            binding, part = UsdShade.MaterialBindingAPI.Apply(prim), materials[label].GetPrim().GetName()
            subset = binding.CreateMaterialBindSubset(part, _int_array(faces)).GetPrim()
            UsdShade.MaterialBindingAPI.Apply(subset).Bind(materials[label])


def _define_instanced(stage: Usd.Stage, place: str, obj: SceneObject, copies: Copies) -> None:
    """Define a PointInstancer at the path `place`, and below it the shape of one copy, which becomes the object's
    target.
    """
    instancer = UsdGeom.PointInstancer.Define(stage, place)
    one, name = one_copy(obj), place.rpartition("/")[2]
    obj.target = _define(stage, f"{place}/{name}", one)
    obj.target.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(copies.shape)))
    obj.target.GetExtentAttr().Set(_vec3([copies.shape.min(axis=0), copies.shape.max(axis=0)]))
    instancer.CreatePrototypesRel().SetTargets([f"{place}/{name}"])
    instancer.CreateProtoIndicesAttr(Vt.IntArray(obj.copies, 0))
    obj.instancer = instancer


def _vec3(points: Any) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))


def _write_places(stage: Usd.Stage, instanced: list[tuple[SceneObject, Copies]], codes: np.ndarray) -> None:
    """Write the positions, rotations and scales of all copies in each frame. `codes` (T,) has the time codes."""
    for obj, copies in instanced:
        instancer = obj.instancer
        turned: list[tuple[Usd.Attribute, UsdObject, type[np.floating]]] = [
            (instancer.CreateOrientationsAttr(), Vt.QuathArray, np.float16)
        ]
        if hasattr(instancer, "CreateOrientationsfAttr"):
            turned.append((instancer.CreateOrientationsfAttr(), Vt.QuatfArray, np.float32))
        places, scales = instancer.CreatePositionsAttr(), instancer.CreateScalesAttr()
        for frame, code in enumerate(codes.tolist()):
            places.Set(_vec3(copies.places[frame]), code)
            scales.Set(_vec3(copies.scales[frame]), code)
            for attribute, array, dtype in turned:
                attribute.Set(array.FromNumpy(copies.turns[frame].astype(dtype)), code)


def _write_velocities_of_places(motion: Motion, instanced: list[tuple[SceneObject, Copies]], codes: np.ndarray) -> None:
    for obj, copies in instanced:
        attributes = obj.instancer.CreateVelocitiesAttr(), obj.instancer.CreateAngularVelocitiesAttr()
        for attribute, values in zip(attributes, velocities_of_copies(motion, obj.shown, copies.places, copies.turns)):
            for code, value in zip(codes.tolist(), values):
                attribute.Set(_vec3(value), code)


def _write_presence(objects: list[SceneObject], codes: np.ndarray) -> None:
    """Write when objects are visible, and which copies an instancer hides, at the frames in which this changes."""
    for obj in objects:
        if obj.shown is None or obj.shown.shape[1] > 1 and obj.copies == 1:
            continue
        whole, shown = _whole(obj), obj.shown
        for frame in (0, *np.flatnonzero((shown[1:] != shown[:-1]).any(axis=1)) + 1):
            if shown.shape[1] > 1:
                whole.CreateInvisibleIdsAttr().Set(Vt.Int64Array(np.flatnonzero(~shown[frame]).tolist()), codes[frame])
            else:
                token = UsdGeom.Tokens.inherited if shown[frame, 0] else UsdGeom.Tokens.invisible
                whole.CreateVisibilityAttr().Set(token, codes[frame])


def _int_array(values: np.ndarray) -> Vt.IntArray:
    return Vt.IntArray.FromNumpy(np.ascontiguousarray(values, np.int32))


# ---- static arrays ----


def _static_arrays(stage: Usd.Stage, motion: Motion, objects: list[SceneObject]) -> dict[str, tuple[np.ndarray, str]]:
    """Write the arrays that belong to vertices, corners and faces. Return the other arrays, each with its domain, by
    name.
    """
    left = {}
    domains = motion.metadata.get("domains", {})
    for name, values in motion.attributes.items():
        if name in KNOWN_ATTRIBUTES or name == FACE_MATERIAL and face_materials(motion):
            continue
        domain = domain_of(motion, name, values, domains)
        if domain not in INTERPOLATION or not _write_array(name, values, domain, objects):
            left[name] = values, domain
    return left


def _write_array(name: str, values: np.ndarray, domain: str, objects: list[SceneObject]) -> bool:
    """Write an array as a primvar of the objects that its rows belong to. Return whether USD has a type and a place for
    it.
    """
    if name == "radius" and domain in ("vertex", "constant") and values.ndim == 1 and values.dtype == np.float32:
        return _write_radius(values, domain, objects)
    kind = WIDER.get(values.dtype.char)
    shapes = TYPES.get(kind or "", {})
    row = values.shape[1:]
    if kind is None or values.dtype.kind not in "biuf" or (row not in shapes and () not in shapes) or not values.size:
        return False
    element_size = 1 if row in shapes else int(np.prod(row))
    if row not in shapes and len(row) > 1:
        return False
    type_name = _type_name(name, kind, row if row in shapes else ())
    placed = _all_placed(values, domain, objects)
    if placed is None:
        return False
    for target, rows in placed:
        if not len(rows):  # An object that has no faces or corners has no values for them.
            continue
        primvar = UsdGeom.PrimvarsAPI(target).CreatePrimvar(
            PRIMVARS.get(name, _identifier(name)), type_name, INTERPOLATION[domain], element_size
        )
        primvar.Set(_vt(rows, type_name, NUMPY[kind]))
        if np.dtype(NUMPY[kind]) != values.dtype:
            primvar.GetAttr().SetCustomDataByKey(f"{OWN}:dtype", values.dtype.str)
        if _identifier(name) != name:
            primvar.GetAttr().SetCustomDataByKey(f"{OWN}:name", name)
    return True


def _all_placed(
    values: np.ndarray, domain: str, objects: list[SceneObject]
) -> list[tuple[UsdObject, np.ndarray]] | None:
    """Return the results of `_placed_rows` for all objects; None if USD has no place for the rows of one of them."""
    placed = []
    for obj in objects:
        rows = _placed_rows(rows_of(values, domain, obj), domain, obj)
        if rows is None:
            return None
        placed.append(rows)
    return placed


def _placed_rows(rows: np.ndarray, domain: str, obj: SceneObject) -> tuple[UsdObject, np.ndarray] | None:
    """Return the schema that an object's rows are written to, and the rows. Copies share the rows of one copy if all
    have the same, or have a row each if it is the same throughout a copy. Return None in all other cases.
    """
    if obj.copies == 1 or domain == "constant":
        return obj.target, rows
    shared = rows_of_one(rows, obj)
    if shared is not None:
        return obj.target, shared
    each = rows.reshape(obj.copies, -1, *rows.shape[1:])
    if domain == "vertex" and (each == each[:, :1]).all():
        return obj.instancer, each[:, 0]
    return None


def _write_radius(values: np.ndarray, domain: str, objects: list[SceneObject]) -> bool:
    """Write a radius: for curves and points as widths, for meshes as a primvar. Return whether USD has a place for
    it.
    """
    placed = _all_placed(values, domain, objects)
    if placed is None or any(target is not obj.target for (target, _), obj in zip(placed, objects)):
        return False
    for obj, (_, rows) in zip(objects, placed):
        if obj.kind == "mesh":
            primvar = UsdGeom.PrimvarsAPI(obj.target).CreatePrimvar(
                "radius", Sdf.ValueTypeNames.FloatArray, INTERPOLATION[domain]
            )
            primvar.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(rows)))
        else:
            obj.target.CreateWidthsAttr(Vt.FloatArray.FromNumpy(np.ascontiguousarray(rows * np.float32(2))))
            obj.target.SetWidthsInterpolation(INTERPOLATION[domain])
            obj.width = 2 * float(rows.max(initial=0))
    return True


def _type_name(name: str, kind: str, row: tuple[int, ...]) -> Sdf.ValueTypeName:
    base = TYPES[kind][row]
    roles = {("uv", "Float2"): "TexCoord2f", ("colors", "Float3"): "Color3f", ("normals", "Float3"): "Normal3f"}
    return getattr(Sdf.ValueTypeNames, f"{roles.get((name, base), base)}Array")


def _vt(values: np.ndarray, type_name: Sdf.ValueTypeName, dtype: str) -> UsdObject:
    array = type(type_name.defaultValue)
    values = np.ascontiguousarray(values, dtype)
    if values.ndim > 1 and not array.__name__.startswith("Vec"):
        values = values.reshape(-1)
    return array.FromNumpy(values) if len(values) else array()


def _own_arrays(root: Usd.Prim, motion: Motion, left: dict[str, tuple[np.ndarray, str]]) -> None:
    """Write the data that has no place in the prims, byte for byte, as attributes of the prim `root`."""
    for descriptor, raw in own_arrays(motion, left):
        attribute = root.CreateAttribute(
            f"{OWN}:{_identifier(descriptor.name)}", Sdf.ValueTypeNames.UCharArray, True, Sdf.VariabilityUniform
        )
        attribute.Set(Vt.UCharArray.FromNumpy(raw) if len(raw) else Vt.UCharArray())
        for key, text in descriptor._asdict().items():
            attribute.SetCustomDataByKey(f"{OWN}:{key}", text)


# ---- frames ----


def _write_frames(
    stage: Usd.Stage,
    motion: Motion,
    objects: list[SceneObject],
    codes: np.ndarray,
    report: Progress,
    has_velocities: bool,
) -> None:
    """Write points, extents, and velocities if `has_velocities` is true, of all objects in all frames. `codes` (T,) has
    the time codes.
    """
    layer, unsaved = stage.GetRootLayer(), 0
    extents = [(obj, _whole(obj).CreateExtentAttr().GetPath()) for obj in objects]
    moved = [obj for obj in objects if obj.copies == 1]
    arrays = [[(obj.vertices, obj.target.GetPointsAttr().GetPath()) for obj in moved]]
    if has_velocities:
        arrays.append([(obj.vertices, obj.target.CreateVelocitiesAttr().GetPath()) for obj in moved])
    for frame, *values in samples_of(motion, objects, has_velocities):
        with Sdf.ChangeBlock():
            _write_extents(layer, extents, values[0], float(codes[frame]))
            for each, places in zip(values, arrays):
                for vertices, path in places:
                    layer.SetTimeSample(path, float(codes[frame]), _vec3(each[vertices]))
        unsaved += sum(each.nbytes for each in values)
        if unsaved >= SAVE_BYTES:
            _must(layer.Save(), layer.identifier)
            unsaved = 0
        report((frame + 1) / len(codes))
    _must(layer.Save(), layer.identifier)


def _whole(obj: SceneObject) -> UsdObject:
    """Return the schema that all its vertices are under."""
    return obj.target if obj.copies == 1 else obj.instancer


def _write_extents(
    layer: Sdf.Layer, extents: list[tuple[SceneObject, Sdf.Path]], positions: np.ndarray, code: float
) -> None:
    for obj, path in extents:
        points = positions[obj.vertices]
        if len(points):
            half = np.float32(obj.width / 2)
            layer.SetTimeSample(path, code, _vec3([points.min(axis=0) - half, points.max(axis=0) + half]))
