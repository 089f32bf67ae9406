"""Reads USD stages: meshes, curves and points whose points, transforms or skeletons move.

Every prim of the kinds Mesh, BasisCurves, NurbsCurves, HermiteCurves and Points with the purpose "default" or "render"
that some frame shows is read, also inside instances, into world space: time samples (interpolated as USD does),
splines, transforms, and of UsdSkel the skinning and the blend shapes. Visibility becomes presence. Each such prim in a
prototype of a PointInstancer becomes one object, of as many copies as the frames show; ids say which copy is which. The
frames are the whole time codes of the stage's range where it has one, else, where there are splines, those from the
first key to the last, else the time codes that have samples; options.fps sets another rate. Static primvars become
attributes, the names of materials the metadata "material_names", of which the attribute "face_material" says the number
for each face.

Points are float32 in USD and so they are here, unless a transform places them far from the origin. The stage is opened
as it is composed (layers, payloads, value clips); what else it holds, such as layers that cannot be found, patches,
spheres, other variants, what is in materials, velocities, creases, is named in the clip's `not_read` (usd_unread.py). A
stage is opened by its structure; positions are read frame by frame. USD trusts the lengths of arrays in a binary file
even where it is damaged: it is imported by the process of reader_main.py alone, under a limit of memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdShade, Vt

from athcodec.errors import ClipError
from athcodec.files.plain import open_plain
from athcodec.files.reading import FileWatch, check_inside
from athcodec.motion.clip import MotionClip
from athcodec.motion.frames import is_far
from athcodec.motion.units import METRES, METRES_PER_UNIT
from athcodec.sources import LISTED, ReadOptions, besides
from athcodec.sources.crate import check_crates
from athcodec.sources.scene_objects import (
    OWN,
    SCHEME,
    ArrayDescriptor,
    Static,
    clip_of_objects,
    frames_of_objects,
    own_metadata,
    transformed,
)
from athcodec.sources.usd_instances import Copies, Instances, code_of_order
from athcodec.sources.usd_skeleton import bind_skeletons, skin_of
from athcodec.sources.usd_time import time_codes
from athcodec.sources.usd_unread import clip_layers, left_out_of_stage, unread_properties
from athcodec.sources.usd_values import (
    NAMES,
    PrimObject,
    all_above,
    array_of,
    changes,
    custom_text,
    fixed,
    frame_name,
    held_at,
    hiding,
    is_guessed,
    numbers_of,
    quietly,
    samples,
    value_at,
    visibility,
)
from athcodec.untyped import JsonObject

# Types of prims that need no note when they are not read.
READ = frozenset(("", "Xform", "Scope", "SkelRoot", "Skeleton", "SkelAnimation", "BlendShape"))
WHOLE = ("Material",)  # prims that are named without those below them
KNOWN = ("Material", "Camera", "GeomSubset")
ABOVE = frozenset(("", "Xform", "Scope", "SkelRoot"))  # Those whose properties are named as those of objects are.
PURPOSES = (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
DOMAINS = {"vertex": "vertex", "varying": "vertex", "faceVarying": "corner", "uniform": "face", "constant": "constant"}


def open_clip(path: str, options: ReadOptions) -> MotionClip:
    """Return the clip in a USD file. Raises ClipError, OSError."""
    check_crates(path)
    with quietly() as trap:
        clip = _clip(_Stage(path, options.allow_outside), options)
        if warnings := _warnings(trap):
            clip.not_read = {**clip.not_read, "warning of USD": warnings}
        return clip


def _warnings(trap: Tf.DiagnosticTrap) -> list[str]:
    """Return what USD has warned of, but for layers that cannot be found, which are named as missing."""
    texts = dict.fromkeys(" ".join(str(warning.commentary).split()) for warning in trap.GetWarnings())
    return [text for text in texts if not text.startswith("In <") and "clip layer" not in text]


class _Stage:
    """An open stage, and whether the files that it is made of have stayed as they were."""

    def __init__(self, path: str, allow_outside: bool):
        """Open the USD stage in `path`. Raises ClipError if it cannot be opened or, unless `allow_outside`, uses files
        outside of its folder."""
        known = Sdf.Layer.Find(path)
        if known:
            known.Reload()  # USD keeps layers for as long as anybody has them open
        _check_layers(path, allow_outside)
        self.stage = Usd.Stage.Open(path)
        if not self.stage:
            raise ClipError("stage: cannot be opened")
        self.errors = [" ".join(str(error).split()) for error in self.stage.GetCompositionErrors()]
        layers = [layer.realPath for layer in self.stage.GetUsedLayers()]
        clips, missing = clip_layers(self.stage)
        self.errors += missing
        files = [file for file in dict.fromkeys([*layers, *clips]) if os.path.isfile(file)]
        self.unchanged = FileWatch(*files)
        for file in files:
            check_inside(Path(self.stage.GetRootLayer().realPath).parent, file, allow_outside)

    def close(self) -> None:
        self.stage = None

    @contextmanager
    def reading(self) -> Iterator[None]:
        if self.stage is None:
            raise ClipError("positions: the clip is closed")
        with quietly():
            yield


def _check_layers(path: str, allow_outside: bool) -> None:
    """Raise ClipError if a layer of the stage `path` names a file that is not plain or, unless `allow_outside`, outside
    of the folder of `path`. This is checked before USD opens the files. Value clips and files named by plugins are not
    found here."""
    folder, waiting, seen = Path(path).parent, [path], set()
    while waiting:
        name = waiting.pop()
        layer = Sdf.Layer.FindOrOpen(name)
        for named in layer.GetCompositionAssetDependencies() if layer else ():
            identifier = layer.ComputeAbsolutePath(named)
            file = Ar.SplitPackageRelativePathOuter(identifier)[0]
            if not os.path.isabs(file):  # Names that are searched for: USD says which it does not find.
                file = str(Ar.GetResolver().Resolve(file))
            if not file or identifier in seen:
                continue
            seen.add(identifier)
            check_inside(folder, file, allow_outside)
            if os.path.exists(file):
                open_plain(file).close()
            waiting.append(identifier)


def _clip(source: _Stage, options: ReadOptions) -> MotionClip:
    """Return the clip of the objects in an open stage. Raises ClipError if the stage has no usable object."""
    stage = source.stage
    layer = own_metadata(stage.GetRootLayer().customLayerData.get(OWN))
    not_read: dict[str, list[str]] = {"missing": source.errors} if source.errors else {}
    objects = _find_objects(stage, options.only, not_read)
    skins = bind_skeletons(stage, objects, not_read)
    codes, rate = time_codes(stage, objects, options.fps, layer.pop("irregular", False), not_read)
    objects = _shown(objects, codes, not_read)
    cache = UsdGeom.XformCache()

    def matrix(obj: PrimObject, frame: int) -> np.ndarray:
        """Return the map from the points of a prim to the world, (4, 4), or of all its copies, (copies, 4, 4)."""
        cache.SetTime(codes[frame])
        if obj.instances is not None:
            return obj.instances.matrices(cache, obj.prim, frame)
        return np.array(cache.GetLocalToWorldTransform(obj.prim if obj.skeleton is None else obj.skeleton.space))

    def sample(obj: PrimObject, frame: int) -> tuple[np.ndarray, np.ndarray]:
        return _points(obj, codes, frame), matrix(obj, frame)

    _measure(objects, codes, matrix)
    frames = frames_of_objects(objects, len(codes), sample, lambda frame: frame_name(codes, frame), source.reading)
    return clip_of_objects(
        objects,
        frames,
        (codes - codes[0]) / stage.GetTimeCodesPerSecond(),
        layer | _metadata(stage, codes, rate),
        _kept_arrays(stage),
        options,
        resource=source,
        unchanged=source.unchanged,
        skin=skin_of(objects, skins),
        not_read=not_read,
    )


# ---- prims ----


class _Choice:
    """The prims that the patterns of options.only name, all by default; `refused` are the paths of others."""

    def __init__(self, patterns: Sequence[str] = ()):
        self.patterns, self.refused = patterns, list[str]()

    def takes(self, prim: Usd.Prim) -> bool:
        names = (prim.GetName(), str(prim.GetPath()))
        return not self.patterns or any(fnmatchcase(name, pattern) for pattern in self.patterns for name in names)


def _find_objects(stage: Usd.Stage, only: Sequence[str], not_read: dict[str, list[str]]) -> list[PrimObject]:
    """Return the objects of the stage that have points, those that PointInstancers show included. If `only` is not
    empty, an object needs one of these names. The paths of other prims are added to `not_read` under the name of their
    type."""
    objects, choice, prototypes = list[PrimObject](), _Choice(only), set[Sdf.Path]()
    prims = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for prim in prims:
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()
            objects += _instanced(UsdGeom.PointInstancer(prim), choice, prototypes, not_read)
            continue
        obj = _object(prim, choice, not_read)
        if obj is not None:
            objects.append(obj)
        if prim.GetTypeName() in WHOLE:
            prims.PruneChildren()
    _add_all(not_read, left_out_of_stage(stage, prototypes))
    if not objects:
        filtered = f" named like {', '.join(only)}" if only else ""
        names = f", or {', '.join(choice.refused[:LISTED])}" if choice.refused else ""
        raise ClipError(
            f"prims: got none with points{filtered}, expected a visible Mesh, BasisCurves, NurbsCurves or Points{names}"
            f"{besides(not_read)}"
        )
    return objects


def _add_all(not_read: dict[str, list[str]], more: dict[str, list[str]]) -> None:
    for kind, names in more.items():
        not_read.setdefault(kind, []).extend(names)


def _object(prim: Usd.Prim, choice: _Choice, not_read: dict[str, list[str]]) -> PrimObject | None:
    """Return the object that a prim is, or None if it has no points to read, in which case its path is added to
    `not_read` if the user should know of it."""
    kind, path = _kind(prim), str(prim.GetPath())
    if kind is None:
        if prim.GetTypeName() not in READ and not _is_material_subset(prim):
            not_read.setdefault(_kind_not_read(prim), []).append(path)
        if prim.GetTypeName() in ABOVE and (names := unread_properties(prim)):
            not_read.setdefault("attribute", []).extend(f"{path}.{name}" for name in names)
        return None
    if not choice.takes(prim):
        choice.refused.append(path)
        return None
    points = Usd.AttributeQuery(UsdGeom.PointBased(prim).GetPointsAttr())
    if UsdGeom.Imageable(prim).ComputePurpose() not in PURPOSES:
        not_read.setdefault("hidden", []).append(path)
    elif points.HasAuthoredValue():
        return PrimObject(kind, prim.GetName(), path, prim=prim, points=points)
    else:
        not_read.setdefault("empty", []).append(path)
    return None


def _is_material_subset(prim: Usd.Prim) -> bool:
    return prim.IsA(UsdGeom.Subset) and UsdGeom.Subset(prim).GetFamilyNameAttr().Get() == UsdShade.Tokens.materialBind


def _kind_not_read(prim: Usd.Prim) -> str:
    if prim.HasAPI("LightAPI"):
        return "Light"
    return str(prim.GetTypeName()) if prim.IsA(UsdGeom.Boundable) or prim.GetTypeName() in KNOWN else "other"


def _instanced(
    instancer: UsdGeom.PointInstancer, choice: _Choice, shown: set[Sdf.Path], not_read: dict[str, list[str]]
) -> list[PrimObject]:
    """Return the objects in the prototypes of a PointInstancer, each with all its copies. The paths of the prototypes
    that the instancer shows are added to `shown`; what is not read is added to `not_read`."""
    prim, path, indices = instancer.GetPrim(), instancer.GetPath(), instancer.GetProtoIndicesAttr()
    times = indices.GetTimeSamples() or [Usd.TimeCode.Default()]
    used = set().union(*(indices.Get(time) or () for time in times))
    if UsdGeom.Imageable(instancer).ComputePurpose() not in PURPOSES:
        not_read.setdefault("hidden", []).append(str(path))
        return []
    targets = instancer.GetPrototypesRel().GetForwardedTargets()
    prototypes = {number: prim.GetStage().GetPrimAtPath(target) for number, target in enumerate(targets)}
    if not used:
        not_read.setdefault("empty", []).append(str(path))
    if used - prototypes.keys():  # USD places no copy then.
        text = f"{path} (protoIndices are {min(used)} to {max(used)}, of {len(targets)} prototypes)"
        not_read.setdefault("PointInstancer", []).append(text)
        return []
    missing = [f"prototype {targets[number]} of {path}" for number in sorted(used) if not prototypes[number]]
    _add_all(not_read, {"missing": missing} if missing else {})
    read = {number: prototype for number, prototype in prototypes.items() if number in used and prototype}
    shown.update(prototype.GetPath() for prototype in read.values())
    for other in _unshown(prim, shown):
        not_read.setdefault("hidden", []).append(str(other.GetPath()))
    inner = _Choice() if choice.takes(prim) else choice
    copies, objects = Copies(instancer), []
    for number, prototype in read.items():
        for obj in _in_prototype(prototype, inner, not_read):
            obj.path = f"{path}:{obj.path.removeprefix(f'{path}/')}"
            obj.instances = Instances(copies, number, prototype)
            objects.append(obj)
    return objects


def _in_prototype(prototype: Usd.Prim, choice: _Choice, not_read: dict[str, list[str]]) -> Iterator[PrimObject]:
    """Yield the objects below a prototype of a PointInstancer. The paths of further PointInstancers below it are added
    to `not_read`."""
    prims = iter(Usd.PrimRange(prototype, Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)))
    for prim in prims:
        if prim.IsA(UsdGeom.PointInstancer):
            not_read.setdefault("PointInstancer inside a PointInstancer", []).append(str(prim.GetPath()))
            prims.PruneChildren()
            continue
        if prim.GetTypeName() in WHOLE:
            prims.PruneChildren()
        obj = _object(prim, choice, not_read)
        if obj is not None:
            yield obj


def _unshown(instancer: Usd.Prim, prototypes: set[Sdf.Path]) -> Iterator[Usd.Prim]:
    """Yield the topmost prims with a shape below a PointInstancer that are in none of its `prototypes`, because USD
    does not show these."""
    prims = iter(Usd.PrimRange(instancer, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for prim in prims:
        if prim.GetPath() in prototypes:
            prims.PruneChildren()
        elif prim != instancer and (_kind(prim) or prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer)):
            prims.PruneChildren()
            yield prim


def _kind(prim: Usd.Prim) -> str | None:
    for schema, kind in ((UsdGeom.Mesh, "mesh"), (UsdGeom.Curves, "curves"), (UsdGeom.Points, "points")):
        if prim.IsA(schema):
            return kind
    return None


def _shown(objects: list[PrimObject], codes: np.ndarray, not_read: dict[str, list[str]]) -> list[PrimObject]:
    """Return the objects that at least one frame shows, and store in each which frames do. The paths of others are
    added to `not_read`. `codes` (T,) are the time codes of the frames. Raises ClipError if no object is left."""
    known: dict[Sdf.Path, np.ndarray] = {}

    def inherited(prim: Usd.Prim) -> np.ndarray:
        """Return for each frame (T,) whether the prim itself does not state that it is invisible."""
        attribute = visibility(prim)
        if attribute is None:
            return np.ones(len(codes), bool)
        if prim.GetPath() not in known:
            times = attribute.GetTimeSamples() if attribute.ValueMightBeTimeVarying() else [codes[0]]
            values = np.array([attribute.Get(time) != UsdGeom.Tokens.invisible for time in times])
            known[prim.GetPath()] = values[held_at(times, codes)]
        return known[prim.GetPath()]

    chosen = []
    for obj in objects:
        obj.shown = np.logical_and.reduce([inherited(prim) for prim in hiding(obj)])[:, None]
        if obj.instances is not None:
            shown, hidden = obj.instances.choose(codes)
            obj.shown = obj.shown & shown
            not_read.setdefault("hidden", []).extend(hidden)
        if obj.shown.any():
            chosen.append(obj)
        else:
            not_read.setdefault("hidden", []).append(obj.path)
    if hidden := list(dict.fromkeys(not_read.pop("hidden", ()))):
        not_read["hidden"] = hidden
    if not chosen:
        raise ClipError(f"prims: got {len(objects)} that no frame shows, expected a visible one{besides(not_read)}")
    return chosen


def _measure(objects: list[PrimObject], codes: np.ndarray, matrix: Callable[[PrimObject, int], np.ndarray]) -> None:
    """Read what stays the same of each object, such as its faces and attributes, and its vertex count at the first
    frame. `matrix(object, frame)` returns the matrix from the object to the world; `codes` (T,) are the time codes of
    the frames."""
    first, cache = 0, UsdGeom.XformCache(codes[0])
    for obj in objects:
        _follow_ids(obj, codes)
        points = _points(obj, codes, 0)
        obj.first, obj.count = first, len(points)
        obj.moves = obj.skeleton is not None or any(
            prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).TransformMightBeTimeVarying()
            for prim in all_above(obj)
        )
        if obj.instances is not None:
            obj.moves |= any(attribute.ValueMightBeTimeVarying() for attribute in obj.instances.all.attributes)
        obj.is_rigid = not obj.points.ValueMightBeTimeVarying()
        obj.is_still = not obj.moves and obj.is_rigid
        _topology(obj, codes)
        _statics(obj, codes, np.array(cache.GetLocalToWorldTransform(obj.prim)))
        if obj.instances is not None:
            obj.leave_out("normals")  # They turn with each copy.
            obj.repeat(len(obj.instances.rows))
            obj.instances.add_arrays(obj, codes)
        if obj.kind == "mesh":
            is_reversed = UsdGeom.Mesh(obj.prim).GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
            is_reversed ^= obj.skeleton is not None and obj.skeleton.mirrors(obj.count, codes[0])
            frames = range(len(codes) if obj.moves else 1)
            obj.face_outward((matrix(obj, frame) for frame in frames), is_reversed)
        first += obj.count
    if first == 0:
        raise ClipError(f"{objects[0].path}: got no points, expected at least one")


def _follow_ids(obj: PrimObject, codes: np.ndarray) -> None:
    """Store the ids of an object of points in it, in ascending order, if points change their order over the frames at
    `codes`."""
    if obj.kind != "points":
        return
    attribute = UsdGeom.Points(obj.prim).GetIdsAttr()
    first = array_of(attribute.Get(codes[0]), np.int64)
    times = samples(attribute, codes) if attribute else ()
    if len(np.unique(first)) == len(first) and not all(np.array_equal(attribute.Get(time), first) for time in times):
        obj.ids = np.sort(first)


def _topology(obj: PrimObject, codes: np.ndarray) -> None:
    """Read the faces of a mesh or the vertex counts of curves, and their details, into the object. `codes` are the time
    codes of the frames. Raises ClipError if they change over time or do not fit the points."""
    if obj.kind == "mesh":
        mesh = UsdGeom.Mesh(obj.prim)
        obj.face_counts = fixed(obj, mesh.GetFaceVertexCountsAttr(), codes)
        obj.face_indices = fixed(obj, mesh.GetFaceVertexIndicesAttr(), codes)
        if mesh.GetDoubleSidedAttr().Get() and not is_guessed(mesh.GetDoubleSidedAttr()):
            obj.details["doubleSided"] = "true"
        _note(obj, SCHEME, mesh.GetSubdivisionSchemeAttr(), "none")
        _bind_materials(obj)
    elif obj.kind == "curves":
        obj.curve_counts = fixed(obj, UsdGeom.Curves(obj.prim).GetCurveVertexCountsAttr(), codes)
        if obj.prim.IsA(UsdGeom.BasisCurves):
            curves = UsdGeom.BasisCurves(obj.prim)
            _note(obj, "type", curves.GetTypeAttr(), "linear")
            _note(obj, "wrap", curves.GetWrapAttr(), "nonperiodic")
            if "type" in obj.details:
                _note(obj, "basis", curves.GetBasisAttr(), "")
    obj.check()


def _bind_materials(obj: PrimObject) -> None:
    """Store the names of the materials of a mesh and of subsets of its faces in the object."""
    binding = UsdShade.MaterialBindingAPI(obj.prim)
    material, _ = binding.ComputeBoundMaterial()
    if material:
        obj.bind(_material_name(material))
    for subset in binding.GetMaterialBindSubsets():
        material, _ = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()
        faces = array_of(subset.GetIndicesAttr().Get(Usd.TimeCode.EarliestTime()), np.int64)
        if material and len(faces) and 0 <= faces.min() and faces.max() < len(obj.face_counts):
            obj.bind(_material_name(material), faces)


def _material_name(material: UsdShade.Material) -> str:
    return str(material.GetPrim().GetDisplayName() or material.GetPrim().GetName())


def _note(obj: PrimObject, name: str, attribute: Usd.Attribute, usual: str) -> None:
    value = attribute.Get()
    if value and value != usual:
        obj.details[name] = str(value)


# ---- time ----


def _metadata(stage: Usd.Stage, codes: np.ndarray, rate: float) -> JsonObject:
    """Return the metadata that the stage states: frame rate, first frame, unit and up axis. `codes` (T,) are the time
    codes of the frames and `rate` is in frames per second."""
    start = float(codes[0]) * (rate / stage.GetTimeCodesPerSecond())
    metadata: JsonObject = {"fps": float(rate), "start_frame": int(start) if start == int(start) else start}
    if stage.HasAuthoredMetadata(UsdGeom.Tokens.metersPerUnit):
        metres = stage.GetMetadata(UsdGeom.Tokens.metersPerUnit)  # float32 in files of Blender 2.8
        if not isinstance(metres, (int, float)) or not 0 < metres < math.inf:
            raise ClipError(f"metersPerUnit: got {str(metres)[:60]!r}, expected a number above 0")
        symbols = [symbol for symbol, value in METRES.items() if math.isclose(value, metres, rel_tol=1e-6)]
        metadata |= {"unit": symbols[0]} if symbols else {METRES_PER_UNIT: float(metres)}
    if stage.HasAuthoredMetadata(UsdGeom.Tokens.upAxis):
        metadata["up_axis"] = str(UsdGeom.GetStageUpAxis(stage)).lower()
    return metadata


# ---- what does not move ----


def _statics(obj: PrimObject, codes: np.ndarray, matrix: np.ndarray) -> None:
    """Read the primvars, normals and widths of a prim that stay the same over `codes`, the time codes of the frames,
    into the object. `matrix` (4, 4) takes the object to the world at the first frame."""
    for primvar in UsdGeom.PrimvarsAPI(obj.prim).FindPrimvarsWithInheritance():
        if obj.skeleton is not None and str(primvar.GetPrimvarName()).startswith("skel:"):
            continue  # which has moved it
        if is_guessed(primvar.GetAttr()):
            continue
        if primvar.HasValue() and changes(primvar, codes):
            obj.left_out.append(primvar.GetPrimvarName())
        elif primvar.HasValue():
            values = value_at(primvar, codes[0])
            name = custom_text(primvar.GetAttr(), "name") or primvar.GetPrimvarName()
            _keep(obj, NAMES.get(name, name), values, primvar.GetInterpolation(), primvar)
    _rename_first_uv(obj)
    schema = UsdGeom.PointBased(obj.prim)
    _keep_unless_it_changes(obj, codes, "normals", schema.GetNormalsAttr(), schema.GetNormalsInterpolation())
    obj.turn_normals(matrix, obj.moves)
    if obj.kind != "mesh":
        _widths(obj, codes, matrix)
    if obj.ids is not None:  # Arrays that keep their order do not follow the points.
        obj.left_out += [name for name, static in obj.statics.items() if static.domain == "vertex"]
        obj.statics = {name: static for name, static in obj.statics.items() if static.domain != "vertex"}
    obj.left_out += unread_properties(obj.prim)
    rest = obj.statics.get("rest")
    if rest is not None and rest.values.shape[1:] == (3,) and rest.values.dtype.kind == "f":
        placed = transformed(rest.values, matrix)
        obj.statics["rest"] = Static(rest.domain, placed if is_far(placed) else placed.astype(np.float32))


def _rename_first_uv(obj: PrimObject) -> None:
    """Rename the first array of texture coordinates to "uv" if the object has no array of that name yet."""
    if "uv" in obj.statics:
        return
    for primvar in UsdGeom.PrimvarsAPI(obj.prim).GetPrimvars():
        name = primvar.GetPrimvarName()
        if primvar.GetTypeName().role == Sdf.ValueRoleNames.TextureCoordinate and name in obj.statics:
            obj.statics = {("uv" if key == name else key): static for key, static in obj.statics.items()}
            return


def _widths(obj: PrimObject, codes: np.ndarray, matrix: np.ndarray) -> None:
    schema = (UsdGeom.Curves if obj.kind == "curves" else UsdGeom.Points)(obj.prim)
    has_radius = "radius" in obj.statics
    _keep_unless_it_changes(obj, codes, "radius", schema.GetWidthsAttr(), schema.GetWidthsInterpolation())
    if not has_radius:
        obj.halve_widths(matrix)


def _keep_unless_it_changes(
    obj: PrimObject, codes: np.ndarray, name: str, attribute: Usd.Attribute, interpolation: str
) -> None:
    """Keep an array of the schema that no primvar replaces, or note that it is left out."""
    if not attribute.HasAuthoredValue() or name in obj.statics or is_guessed(attribute):
        return
    if changes(attribute, codes):
        obj.left_out.append(attribute.GetName())
    else:
        _keep(obj, name, attribute.Get(codes[0]), interpolation)


def _keep(obj: PrimObject, name: str, values: Any, interpolation: str, primvar: UsdGeom.Primvar | None = None) -> None:
    """Store a static array in the object under `name` if `values` are numbers whose rows fit its interpolation;
    otherwise note the name as left out."""
    values, element_size = numbers_of(values), 1 if primvar is None else primvar.GetElementSize()
    if values is not None and element_size > 1 and len(values) % element_size == 0:
        values = values.reshape(-1, element_size, *values.shape[1:])
        values = values[..., 0] if values.shape[2:] == (1,) else values
    dtype = None if primvar is None else custom_text(primvar.GetAttr(), "dtype")
    if values is not None and dtype in WRITTEN_DTYPES:  # exporters/usd.py chose one that USD has
        values = values.astype(dtype)
    obj.keep(name, DOMAINS.get(interpolation), values)


WRITTEN_DTYPES = ("|i1", "|b1", "<i2", "<u2", ">i2", ">u2", ">i4", ">u4", ">i8", ">u8", ">f2", ">f4", ">f8", "<f2")


# ---- what exporters/usd.py has written of a clip that USD has no place for ----


def _kept_arrays(stage: Usd.Stage) -> Iterator[tuple[ArrayDescriptor, bytes]]:
    """Yield the arrays that athcodec's own writer stored on the stage's default prim, each as a pair of its descriptor
    and its bytes."""
    root = stage.GetDefaultPrim()
    for attribute in root.GetAuthoredPropertiesInNamespace(OWN) if root else ():
        values = attribute.Get() if isinstance(attribute, Usd.Attribute) else None
        if isinstance(values, Vt.UCharArray):
            name = custom_text(attribute, "name") or str(attribute.GetName())[len(OWN) + 1 :]
            texts = (custom_text(attribute, key) or "" for key in ("dtype", "shape", "domain"))
            yield ArrayDescriptor(name, *texts), np.array(values).tobytes()


# ---- skeletons ----


# ---- positions ----


def _points(obj: PrimObject, codes: np.ndarray, frame: int) -> np.ndarray:
    """Return the points (n, 3) float32 of an object in a frame, after its skeleton has moved them, in ascending order
    of ids if it has any. `codes` has the time code of each frame."""
    ids = None if obj.ids is None else UsdGeom.Points(obj.prim).GetIdsAttr()
    code = float(codes[frame]) if ids is None else code_of_order(ids, float(codes[frame]))
    points = obj.points.Get(code)
    if points is None:
        raise ClipError(f"{obj.path}: got no points in {frame_name(codes, frame)}")
    if obj.skeleton is not None:
        points = obj.skeleton.deform(points, code)
    points = np.array(points, np.float32).reshape(-1, 3)
    if ids is None:
        return points
    return obj.ordered(points, array_of(ids.Get(code + 1e-6), np.int64), frame_name(codes, frame))
