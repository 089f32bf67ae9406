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
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Gf, Sdf, Tf, Ts, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from athcodec.errors import ClipError
from athcodec.files.plain import open_plain
from athcodec.files.reading import FileWatch, check_inside
from athcodec.motion.clip import MotionClip, Skin
from athcodec.motion.frames import is_far
from athcodec.motion.units import METRES, METRES_PER_UNIT
from athcodec.sources import LISTED, ReadOptions, besides
from athcodec.sources.crate import check_crates
from athcodec.sources.scene_objects import (
    GUESSED,
    OWN,
    SCHEME,
    ArrayDescriptor,
    SceneObject,
    Static,
    clip_of_objects,
    frames_of_objects,
    own_metadata,
    rows_by_id,
    transformed,
)
from athcodec.sources.timing import warn_of_missed
from athcodec.sources.usd_unread import PLACES, clip_layers, is_array, left_out_of_stage, unread_properties

MAX_FRAMES = 1 << 24
# Types of prims that need no note when they are not read.
READ = frozenset(("", "Xform", "Scope", "SkelRoot", "Skeleton", "SkelAnimation", "BlendShape"))
WHOLE = ("Material",)  # prims that are named without those below them
KNOWN = ("Material", "Camera", "GeomSubset")
ABOVE = frozenset(("", "Xform", "Scope", "SkelRoot"))  # Those whose properties are named as those of objects are.
PURPOSES = (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
NAMES = {"st": "uv", "displayColor": "colors"}
DOMAINS = {"vertex": "vertex", "varying": "vertex", "faceVarying": "corner", "uniform": "face", "constant": "constant"}


def open_clip(path: str, options: ReadOptions) -> MotionClip:
    """The clip in a USD file. Raises ClipError, OSError."""
    check_crates(path)
    with quietly() as trap:
        clip = _clip(_Stage(path, options.allow_outside), options)
        if warnings := _warnings(trap):
            clip.not_read["warning of USD"] = warnings
        return clip


@contextmanager
def quietly() -> Iterator[Tf.DiagnosticTrap]:
    """Keeps USD's messages off stderr; its errors become ClipErrors of one line."""
    with Tf.DiagnosticTrap() as trap:
        try:
            yield trap
        except Tf.ErrorException as error:
            raise ClipError(f"stage: {_one_line(error)}") from None
        finally:
            trap.Clear()


def _one_line(error: Exception) -> str:
    """The message of the first of USD's errors, without its place in USD's source."""
    try:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    except UnicodeDecodeError:  # it quotes bytes of the file
        return "cannot be parsed"
    text = (lines or [type(error).__name__])[0].split(" : '", 1)
    return text[-1].rstrip("'")


def _warnings(trap: Tf.DiagnosticTrap) -> list[str]:
    """What USD has warned of, but for layers that cannot be found, which are named as missing."""
    texts = dict.fromkeys(" ".join(str(warning.commentary).split()) for warning in trap.GetWarnings())
    return [text for text in texts if not text.startswith("In <") and "clip layer" not in text]


class _Stage:
    """An open stage, and whether the files that it is made of have stayed as they were."""

    def __init__(self, path: str, allow_outside: bool):
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
    """ClipError where a layer names one that is no plain file or, unless `allow_outside`, lies outside of the folder of
    the first: before USD opens it. Of value clips, and of what plugins name, USD alone knows."""
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


@dataclass
class _Prim(SceneObject):
    """A prim that is read, and how its points are found."""

    prim: Usd.Prim = None
    points: Usd.AttributeQuery = None
    skeleton: _Skeleton | None = None
    instances: _Instances | None = None
    moves: bool = False  # its transforms do, or a skeleton moves it


def _clip(source: _Stage, options: ReadOptions) -> MotionClip:
    stage = source.stage
    layer = own_metadata(stage.GetRootLayer().customLayerData.get(OWN))
    not_read: dict[str, list[str]] = {"missing": source.errors} if source.errors else {}
    objects = _find_objects(stage, options.only, not_read)
    skins = _bind_skeletons(stage, objects, not_read)
    codes, rate = _time_codes(stage, objects, options.fps, layer.pop("irregular", False), not_read)
    objects = _shown(objects, codes, not_read)
    cache = UsdGeom.XformCache()

    def matrix(obj: _Prim, frame: int) -> np.ndarray:
        """Return the map from the points of a prim to the world, (4, 4), or of all its copies, (copies, 4, 4)."""
        cache.SetTime(codes[frame])
        if obj.instances is not None:
            return obj.instances.matrices(cache, obj.prim, frame)
        return np.array(cache.GetLocalToWorldTransform(obj.prim if obj.skeleton is None else obj.skeleton.space))

    def sample(obj: _Prim, frame: int) -> tuple[np.ndarray, np.ndarray]:
        return _points(obj, codes, frame), matrix(obj, frame)

    _measure(objects, codes, matrix)
    frames = frames_of_objects(objects, len(codes), sample, lambda frame: _frame_name(codes, frame), source.reading)
    return clip_of_objects(
        objects,
        frames,
        (codes - codes[0]) / stage.GetTimeCodesPerSecond(),
        layer | _metadata(stage, codes, rate),
        _kept_arrays(stage),
        options,
        resource=source,
        unchanged=source.unchanged,
        skin=_skin(objects, skins),
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


def _find_objects(stage: Usd.Stage, only: Sequence[str], not_read: dict[str, list[str]]) -> list[_Prim]:
    """All with points. What has none, or is no object, is added to not_read by the name of its type."""
    objects, choice, prototypes = list[_Prim](), _Choice(only), set[Sdf.Path]()
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


def _object(prim: Usd.Prim, choice: _Choice, not_read: dict[str, list[str]]) -> _Prim | None:
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
        return _Prim(kind, prim.GetName(), path, prim=prim, points=points)
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
) -> list[_Prim]:
    """Return the meshes in the prototypes of a PointInstancer, each as often as the instancer has it. Adds to `shown`
    the paths of the prototypes."""
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
    copies, objects = _Copies(instancer), []
    for number, prototype in read.items():
        for obj in _in_prototype(prototype, inner, not_read):
            obj.path = f"{path}:{obj.path.removeprefix(f'{path}/')}"
            obj.instances = _Instances(copies, number, prototype)
            objects.append(obj)
    return objects


def _in_prototype(prototype: Usd.Prim, choice: _Choice, not_read: dict[str, list[str]]) -> Iterator[_Prim]:
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
    """The first prims with a shape below an instancer that are in no prototype: USD shows none of these."""
    prims = iter(Usd.PrimRange(instancer, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for prim in prims:
        if prim.GetPath() in prototypes:
            prims.PruneChildren()
        elif prim != instancer and (_kind(prim) or prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer)):
            prims.PruneChildren()
            yield prim


class _Copies:
    """The copies that a PointInstancer shows in the frames that are played, once `follow` has found them.

    A copy is a row of the instancer's arrays or, where ids change in time, an id; ids ascend. `names` (k,) are the rows
    or ids, `protos` (k,) the numbers of their prototypes, `shown` (T, k) the frames that show them.
    """

    def __init__(self, instancer: UsdGeom.PointInstancer):
        self.instancer = instancer
        prim = instancer.GetPrim()
        self.attributes = [prim.GetAttribute(name) for name in PLACES if prim.HasAttribute(name)]
        self.names: np.ndarray | None = None

    def follow(self, codes: np.ndarray) -> None:
        """Finds the prototype of each copy and its row in each frame. Raises ClipError where a copy cannot be told."""
        if self.names is not None:
            return
        schema, times = self.instancer, [float(codes[0])]
        for attribute in (schema.GetProtoIndicesAttr(), schema.GetIdsAttr(), schema.GetInvisibleIdsAttr()):
            times += attribute.GetTimeSamplesInInterval(_interval(codes))
        times = np.unique(times)
        used, self._states = np.unique(_held(times, codes), return_inverse=True)
        self._codes, times = codes, times[used]  # In a frame holds what held at the last of these times.
        protos, ids = (
            [_array(attribute.Get(time), np.int64) for time in times]
            for attribute in (schema.GetProtoIndicesAttr(), schema.GetIdsAttr())
        )
        self.follows_ids = any(not np.array_equal(ids_of_frame, ids[0]) for ids_of_frame in ids)
        self.follows_ids &= all(
            len(ids_of_frame) == len(of) == len(np.unique(ids_of_frame)) for ids_of_frame, of in zip(ids, protos)
        )
        self.names = np.unique(np.concatenate(ids)) if self.follows_ids else np.arange(len(protos[0]))
        self.protos = np.full(len(self.names), -1)
        self._rows = np.empty((len(times), len(self.names)), np.int32)
        self.shown = np.zeros(self._rows.shape, bool)
        for state, count in enumerate(map(len, protos)):
            if not self.follows_ids and count != len(self.names):
                expected = f"{len(self.names)} as in frame 0; give the copies unique ids in all frames"
                self._refuse(state, f"got {count} copies", expected)
            rows = rows_by_id(ids[state], self.names) if self.follows_ids else self.names
            there = np.flatnonzero(rows >= 0)
            new = protos[state][rows[there]]
            if ((self.protos[there] >= 0) & (self.protos[there] != new)).any():
                self._refuse(state, "protoIndices changes", "the same shape of each copy in all frames")
            self.protos[there] = new
            mask = np.array(schema.ComputeMaskAtTime(times[state]), bool)
            self._rows[state], self.shown[state] = rows, rows >= 0
            if len(mask):
                self.shown[state, there] = mask[rows[there]]
        self.shown = self.shown[self._states]
        self._hold()

    def _refuse(self, state: int, got: str, expected: str) -> None:
        frame = int(np.flatnonzero(self._states == state)[0])
        raise ClipError(f"{self.instancer.GetPath()}: {got} in {_frame_name(self._codes, frame)}, expected {expected}")

    def _hold(self) -> None:
        """Notes where copies stand in frames that do not have them: where they were last, or where they appear."""
        absent, states = self._rows < 0, np.arange(len(self._rows))
        last = np.maximum.accumulate(np.where(absent, -1, states[:, None]), axis=0)
        following = np.minimum.accumulate(np.where(absent, states[-1], states[:, None])[::-1], axis=0)[::-1]
        starts, stops = (np.searchsorted(self._states, states, side) for side in ("left", "right"))
        frames = np.where(last >= 0, stops[last] - 1, starts[following])
        # A frame that has the copy, and the copy.
        self._sources = frames * len(self.names) + np.arange(len(self.names))
        self._held = np.unique(self._sources[absent])
        self._places = np.zeros((len(self._held), 4, 4))
        frames, copies = np.divmod(self._held, max(len(self.names), 1))
        for frame in np.unique(frames):
            is_frame = frames == frame
            self._places[is_frame] = self._placed(frame)[self._rows[self._states[frame], copies[is_frame]]]

    def places(self, frame: int) -> np.ndarray:
        """(copies, 4, 4) from the prototype to the instancer."""
        state = self._states[frame]
        rows, absent = self._rows[state], np.flatnonzero(self._rows[state] < 0)
        matrices = self._placed(frame)
        if not len(absent):
            return matrices[rows]
        out = np.empty((len(rows), 4, 4))
        out[rows >= 0] = matrices[rows[rows >= 0]]
        out[absent] = self._places[np.searchsorted(self._held, self._sources[state, absent])]
        return out

    def _placed(self, frame: int) -> np.ndarray:
        """(rows, 4, 4) as the arrays have them."""
        code = _code_of_order(self.instancer.GetIdsAttr(), float(self._codes[frame]))
        matrices = self.instancer.ComputeInstanceTransformsAtTime(
            code, code, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
        placed, expected = np.array(matrices).reshape(-1, 4, 4), self._rows[self._states[frame]].max(initial=-1) + 1
        if len(placed) < expected:
            raise ClipError(
                f"{self.instancer.GetPath()}: got {len(placed)} positions at time code {code:g}, expected {expected}"
            )
        return placed


class _Instances:
    """The copies of one prototype that a PointInstancer has."""

    def __init__(self, copies: _Copies, number: int, prototype: Usd.Prim):
        self.all, self.number, self.prototype = copies, number, prototype
        self.instancer = copies.instancer

    def choose(self, codes: np.ndarray) -> tuple[np.ndarray, list[str]]:
        """The frames that show each copy, (T, copies); and the names of copies that none shows, which are left out."""
        self.all.follow(codes)
        is_of_prototype, seen = self.all.protos == self.number, self.all.shown.any(axis=0)
        self.rows = np.flatnonzero(is_of_prototype & seen)
        return self.all.shown[:, self.rows], [
            f"{self.instancer.GetPath()}:{name}" for name in self.all.names[is_of_prototype & ~seen]
        ]

    def matrices(self, cache: UsdGeom.XformCache, prim: Usd.Prim, frame: int) -> np.ndarray:
        """(copies, 4, 4) from a prim of the prototype to the world, at the time of the cache."""
        inner = np.array(cache.ComputeRelativeTransform(prim, self.prototype)[0])
        world = np.array(cache.GetLocalToWorldTransform(self.instancer.GetPrim()))
        return inner @ self.all.places(frame)[self.rows] @ world

    def add_arrays(self, obj: _Prim, codes: np.ndarray) -> None:
        """Adds the static arrays that the instancer has for each of its copies."""
        obj.left_out += unread_properties(self.instancer.GetPrim())
        for primvar in UsdGeom.PrimvarsAPI(self.instancer).GetPrimvarsWithValues():
            name, values = str(primvar.GetPrimvarName()), _numbers(_value(primvar, codes[0]))
            changes = _changes(primvar, codes) or self.all.follows_ids
            if values is None or changes or len(values) <= self.rows.max(initial=-1):
                obj.left_out.append(name)
            elif NAMES.get(name, name) not in obj.statics:
                obj.left_out = [other for other in obj.left_out if other != NAMES.get(name, name)]
                spread = np.repeat(values[self.rows], obj.count // obj.copies, axis=0)
                obj.keep(NAMES.get(name, name), "vertex", spread)


def _kind(prim: Usd.Prim) -> str | None:
    for schema, kind in ((UsdGeom.Mesh, "mesh"), (UsdGeom.Curves, "curves"), (UsdGeom.Points, "points")):
        if prim.IsA(schema):
            return kind
    return None


def _lineage(prim: Usd.Prim) -> Iterator[Usd.Prim]:
    while prim and not prim.IsPseudoRoot():
        yield prim
        prim = prim.GetParent()


def _all_above(obj: _Prim) -> Iterator[Usd.Prim]:
    """The prims whose transforms place an object."""
    yield from _lineage(obj.prim)
    if obj.instances is not None:
        yield from _lineage(obj.instances.instancer.GetPrim())


def _shown(objects: list[_Prim], codes: np.ndarray, not_read: dict[str, list[str]]) -> list[_Prim]:
    """The objects that a frame shows, with the frames that do; notes the others."""
    known: dict[Sdf.Path, np.ndarray] = {}

    def inherited(prim: Usd.Prim) -> np.ndarray:
        """(T,) whether a prim does not say that it is invisible."""
        attribute = _visibility(prim)
        if attribute is None:
            return np.ones(len(codes), bool)
        if prim.GetPath() not in known:
            times = attribute.GetTimeSamples() if attribute.ValueMightBeTimeVarying() else [codes[0]]
            values = np.array([attribute.Get(time) != UsdGeom.Tokens.invisible for time in times])
            known[prim.GetPath()] = values[_held(times, codes)]
        return known[prim.GetPath()]

    chosen = []
    for obj in objects:
        obj.shown = np.logical_and.reduce([inherited(prim) for prim in _hiding(obj)])[:, None]
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


def _hiding(obj: _Prim) -> Iterator[Usd.Prim]:
    """The prims that hide an object where they are invisible."""
    for prim in _lineage(obj.prim):
        if obj.instances is not None and prim == obj.instances.prototype:
            yield from _lineage(obj.instances.instancer.GetPrim())
            return
        yield prim


def _visibility(prim: Usd.Prim) -> Usd.Attribute | None:
    return UsdGeom.Imageable(prim).GetVisibilityAttr() if prim.IsA(UsdGeom.Imageable) else None


def _held(times: Sequence[float], codes: np.ndarray) -> np.ndarray:
    """(T,) the number of the time whose sample holds at each time code."""
    return np.maximum(np.searchsorted(times, codes + 1e-6, "right") - 1, 0)


def _code_of_order(ids: Usd.Attribute, code: float) -> float:
    """The time code at which to read arrays whose order `ids` says: the code, or, where USD would mix two orders
    between samples, that of the sample before it."""
    if ids.GetNumTimeSamples() < 2:
        return code
    low, high = ids.GetBracketingTimeSamples(code + 1e-6)
    return code if np.array_equal(_array(ids.Get(low), np.int64), _array(ids.Get(high), np.int64)) else low


def _measure(objects: list[_Prim], codes: np.ndarray, matrix: Callable[[_Prim, int], np.ndarray]) -> None:
    """Fills in what the objects are at the first frame; `matrix` is from an object to the world in a frame."""
    first, cache = 0, UsdGeom.XformCache(codes[0])
    for obj in objects:
        _follow_ids(obj, codes)
        points = _points(obj, codes, 0)
        obj.first, obj.count = first, len(points)
        obj.moves = obj.skeleton is not None or any(
            prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).TransformMightBeTimeVarying()
            for prim in _all_above(obj)
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
            obj.face_outward(lambda frame, obj=obj: matrix(obj, frame), frames, is_reversed)
        first += obj.count
    if first == 0:
        raise ClipError(f"{objects[0].path}: got no points, expected at least one")


def _follow_ids(obj: _Prim, codes: np.ndarray) -> None:
    """Notes the ids of points that stand in another order in some frame."""
    if obj.kind != "points":
        return
    attribute = UsdGeom.Points(obj.prim).GetIdsAttr()
    first = _array(attribute.Get(codes[0]), np.int64)
    times = _samples(attribute, codes) if attribute else ()
    if len(np.unique(first)) == len(first) and not all(np.array_equal(attribute.Get(time), first) for time in times):
        obj.ids = np.sort(first)


def _topology(obj: _Prim, codes: np.ndarray) -> None:
    if obj.kind == "mesh":
        mesh = UsdGeom.Mesh(obj.prim)
        obj.face_counts = _fixed(obj, mesh.GetFaceVertexCountsAttr(), codes)
        obj.face_indices = _fixed(obj, mesh.GetFaceVertexIndicesAttr(), codes)
        if mesh.GetDoubleSidedAttr().Get() and not _is_guessed(mesh.GetDoubleSidedAttr()):
            obj.details["doubleSided"] = "true"
        _note(obj, SCHEME, mesh.GetSubdivisionSchemeAttr(), "none")
        _bind_materials(obj)
    elif obj.kind == "curves":
        obj.curve_counts = _fixed(obj, UsdGeom.Curves(obj.prim).GetCurveVertexCountsAttr(), codes)
        if obj.prim.IsA(UsdGeom.BasisCurves):
            curves = UsdGeom.BasisCurves(obj.prim)
            _note(obj, "type", curves.GetTypeAttr(), "linear")
            _note(obj, "wrap", curves.GetWrapAttr(), "nonperiodic")
            if "type" in obj.details:
                _note(obj, "basis", curves.GetBasisAttr(), "")
    obj.check()


def _bind_materials(obj: _Prim) -> None:
    """By the names of the materials that the mesh and subsets of its faces are bound to."""
    binding = UsdShade.MaterialBindingAPI(obj.prim)
    material, _ = binding.ComputeBoundMaterial()
    if material:
        obj.bind(_material_name(material))
    for subset in binding.GetMaterialBindSubsets():
        material, _ = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()
        faces = _array(subset.GetIndicesAttr().Get(Usd.TimeCode.EarliestTime()), np.int64)
        if material and len(faces) and 0 <= faces.min() and faces.max() < len(obj.face_counts):
            obj.bind(_material_name(material), faces)


def _material_name(material: UsdShade.Material) -> str:
    return str(material.GetPrim().GetDisplayName() or material.GetPrim().GetName())


def _note(obj: _Prim, name: str, attribute: Usd.Attribute, usual: str) -> None:
    value = attribute.Get()
    if value and value != usual:
        obj.details[name] = str(value)


def _fixed(obj: _Prim, attribute: Usd.Attribute, codes: np.ndarray) -> np.ndarray:
    """Integers that stay the same in every frame; ClipError where they change."""
    query = Usd.AttributeQuery(attribute)
    first = _array(query.Get(codes[0]), np.int32)
    if query.GetNumTimeSamples() > 1 and query.ValueMightBeTimeVarying():
        for sample in _samples(attribute, codes):
            if not np.array_equal(_array(query.Get(sample), np.int32), first):
                frame = int(np.searchsorted(codes, sample - 1e-9))
                raise ClipError(
                    f"{obj.path}: {attribute.GetName()} changes in frame {min(frame, len(codes) - 1)} "
                    f"(time code {sample:g}), expected the same vertices and faces in all"
                )
    return first


def _samples(source: Usd.Attribute | UsdGeom.Primvar, codes: np.ndarray) -> Sequence[float]:
    """The time codes in the stage's range, or all, at which an attribute or primvar may change: those of its samples,
    or, where it has a spline, those of all frames or knots."""
    attribute = source.GetAttr() if isinstance(source, UsdGeom.Primvar) else source
    if not _has_range(attribute.GetStage()):
        return [*attribute.GetSpline().GetKnots().keys()] if attribute.HasSpline() else source.GetTimeSamples()
    if attribute.HasSpline():
        return codes
    return source.GetTimeSamplesInInterval(_interval(codes))


def _interval(codes: np.ndarray) -> Gf.Interval:
    return Gf.Interval(float(codes[0]), float(codes[-1]))


def _array(value: Any, dtype: Any) -> np.ndarray:
    return np.empty(0, dtype) if value is None else np.array(value, dtype)


# ---- time ----


@dataclass
class _Keys:
    """Time codes, ascending, at which what is read has samples or knots of splines; whether there are splines, and the
    paths of those that go on moving before their first knot or behind their last."""

    times: np.ndarray
    has_splines: bool
    endless: list[str]


def _time_codes(
    stage: Usd.Stage, objects: list[_Prim], fps: float | None, irregular: bool, not_read: dict[str, list[str]]
) -> tuple[np.ndarray, float]:
    """Time codes to read, and frames per second. Keys that lie elsewhere are added to not_read."""
    codes_per_second = stage.GetTimeCodesPerSecond()
    if not 0 < codes_per_second < math.inf:
        raise ClipError(f"timeCodesPerSecond: got {codes_per_second}, expected a positive number")
    keys = _keys(objects)
    start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if _has_range(stage) and not irregular:
        _name_keys_outside(keys.times, start, end, not_read)
    else:
        if stage.HasAuthoredTimeCodeRange() and not start <= end:
            not_read["range of the stage"] = [f"{start:g} to {end:g}, which runs backward"]
        if keys.endless:
            not_read["motion beyond the knots of splines"] = keys.endless
        if not fps and not keys.has_splines:
            return (keys.times if len(keys.times) else np.zeros(1)), _rate(stage, keys, 0.0, not_read)
        start, end = (keys.times[0], keys.times[-1]) if len(keys.times) else (0.0, 0.0)
    if not (math.isfinite(start) and math.isfinite(end)):
        raise ClipError(f"time codes: got {start} to {end}, expected finite numbers")
    rate = fps or _rate(stage, keys, start, not_read)
    step = codes_per_second / rate
    if not fps:
        times = keys.times[(keys.times >= start) & (keys.times <= end)]
        missed = _off_grid(times, start, step)
        warn_of_missed(times / codes_per_second, missed, rate, stage.GetRootLayer().realPath, start / codes_per_second)
    count = math.floor((end - start) / step + 1e-6) + 1
    if count > MAX_FRAMES:
        raise ClipError(f"time codes: got {start:g} to {end:g}, expected at most {MAX_FRAMES} frames")
    return start + np.arange(count) * step, rate


def _has_range(stage: Usd.Stage) -> bool:
    return stage.HasAuthoredTimeCodeRange() and stage.GetStartTimeCode() <= stage.GetEndTimeCode()


def _off_grid(times: np.ndarray, start: float, step: float) -> np.ndarray:
    """(K,) whether time codes lie between frames."""
    places = (times - start) / step
    off: np.ndarray = np.abs(places - np.round(places)) > 1e-3
    return off


def _rate(stage: Usd.Stage, keys: _Keys, start: float, not_read: dict[str, list[str]]) -> float:
    """Frames per second: a frame for each time code, unless framesPerSecond has frames at keys that these miss, or more
    frames of splines; where it is another rate and is not taken, it is added to not_read."""
    codes_per_second, stated = stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()
    if (
        not stage.HasAuthoredMetadata("framesPerSecond")
        or not 0 < stated < math.inf
        or math.isclose(stated, codes_per_second)
    ):
        return codes_per_second
    misses = [bool(_off_grid(keys.times, start, step).any()) for step in (1.0, codes_per_second / stated)]
    if misses == [True, False] or keys.has_splines and stated > codes_per_second and not misses[1]:
        return stated
    not_read["framesPerSecond"] = [f"{stated:g} (frames are time codes, {codes_per_second:g} per second)"]
    return codes_per_second


def _name_keys_outside(times: np.ndarray, start: float, end: float, not_read: dict[str, list[str]]) -> None:
    outside = times[(times < start - 1e-6) | (times > end + 1e-6)]
    if len(outside):
        text = f"time codes {outside[0]:g} to {outside[-1]:g} ({len(outside)} keys; the range is {start:g} to {end:g})"
        not_read["keys outside of the stage's range"] = [text]


def _keys(objects: list[_Prim]) -> _Keys:
    times: set[float] = set()
    splines: dict[str, Any] = {}
    seen: set[Sdf.Path] = set()

    def add(attribute: Usd.Attribute) -> None:
        if attribute.GetPath() in seen:
            return
        seen.add(attribute.GetPath())
        times.update(attribute.GetTimeSamples())
        if attribute.HasSpline():
            splines[str(attribute.GetPath())] = spline = attribute.GetSpline()
            with quietly():  # USD says each time that inner loops are deprecated; not every version bakes them.
                times.update(getattr(spline, "GetKnotsWithInnerLoopsBaked", spline.GetKnots)().keys())

    for obj in objects:
        prims = [*_all_above(obj), *(() if obj.skeleton is None else _lineage(obj.skeleton.query.GetPrim()))]
        attributes = [obj.points.GetAttribute(), *(() if obj.instances is None else obj.instances.all.attributes)]
        attributes += filter(None, map(_visibility, _hiding(obj)))
        for prim in prims:
            if prim.IsA(UsdGeom.Xformable) and prim.GetPath() not in seen:
                seen.add(prim.GetPath())
                attributes += [operation.GetAttr() for operation in UsdGeom.Xformable(prim).GetOrderedXformOps()]
        for attribute in attributes:
            add(attribute)
        if obj.skeleton is not None and obj.skeleton.animation:
            times.update(obj.skeleton.animation.GetJointTransformTimeSamples())
            times.update(obj.skeleton.animation.GetBlendShapeWeightTimeSamples())
    endless = [path for path, spline in splines.items() if _goes_on(spline)]
    return _Keys(np.array(sorted(filter(math.isfinite, times)), np.float64), bool(splines), endless)


def _goes_on(spline: Ts.Spline) -> bool:
    """Whether a spline moves before its first knot or behind its last."""
    still = (Ts.ExtrapHeld, Ts.ExtrapValueBlock)
    return any(each.mode not in still for each in (spline.GetPreExtrapolation(), spline.GetPostExtrapolation()))


def _metadata(stage: Usd.Stage, codes: np.ndarray, rate: float) -> dict[str, Any]:
    start = float(codes[0]) * (rate / stage.GetTimeCodesPerSecond())
    metadata: dict[str, Any] = {"fps": float(rate), "start_frame": int(start) if start == int(start) else start}
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


def _statics(obj: _Prim, codes: np.ndarray, matrix: np.ndarray) -> None:
    for primvar in UsdGeom.PrimvarsAPI(obj.prim).FindPrimvarsWithInheritance():
        if obj.skeleton is not None and str(primvar.GetPrimvarName()).startswith("skel:"):
            continue  # which has moved it
        if _is_guessed(primvar.GetAttr()):
            continue
        if primvar.HasValue() and _changes(primvar, codes):
            obj.left_out.append(primvar.GetPrimvarName())
        elif primvar.HasValue():
            values = _value(primvar, codes[0])
            name = _custom_text(primvar.GetAttr(), "name") or primvar.GetPrimvarName()
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


def _rename_first_uv(obj: _Prim) -> None:
    """Where no primvar is called st, the first texture coordinates are what a renderer takes."""
    if "uv" in obj.statics:
        return
    for primvar in UsdGeom.PrimvarsAPI(obj.prim).GetPrimvars():
        name = primvar.GetPrimvarName()
        if primvar.GetTypeName().role == Sdf.ValueRoleNames.TextureCoordinate and name in obj.statics:
            obj.statics = {("uv" if key == name else key): static for key, static in obj.statics.items()}
            return


def _widths(obj: _Prim, codes: np.ndarray, matrix: np.ndarray) -> None:
    schema = (UsdGeom.Curves if obj.kind == "curves" else UsdGeom.Points)(obj.prim)
    has_radius = "radius" in obj.statics
    _keep_unless_it_changes(obj, codes, "radius", schema.GetWidthsAttr(), schema.GetWidthsInterpolation())
    if not has_radius:
        obj.halve_widths(matrix)


def _keep_unless_it_changes(
    obj: _Prim, codes: np.ndarray, name: str, attribute: Usd.Attribute, interpolation: str
) -> None:
    """Keep an array of the schema that no primvar replaces, or note that it is left out."""
    if not attribute.HasAuthoredValue() or name in obj.statics or _is_guessed(attribute):
        return
    if _changes(attribute, codes):
        obj.left_out.append(attribute.GetName())
    else:
        _keep(obj, name, attribute.Get(codes[0]), interpolation)


def _value(source: Usd.Attribute | UsdGeom.Primvar, code: float) -> Any:
    """What an array holds at a time, without indices; None where USD finds it faulty."""
    try:
        return source.ComputeFlattened(code) if isinstance(source, UsdGeom.Primvar) else source.Get(code)
    except Tf.ErrorException:
        return None


def _changes(source: Usd.Attribute | UsdGeom.Primvar, codes: np.ndarray) -> bool:
    """Whether an array has other values in any frame than in the first."""
    if not source.ValueMightBeTimeVarying():
        return False
    first = np.array(_value(source, codes[0]))
    return any(
        not np.array_equal(np.array(_value(source, code)), first) for code in (*_samples(source, codes), codes[-1])
    )


def _keep(obj: _Prim, name: str, values: Any, interpolation: str, primvar: UsdGeom.Primvar | None = None) -> None:
    """Keeps a static array if it has numbers, and rows that fit the prim; notes the names of others."""
    values, element_size = _numbers(values), 1 if primvar is None else primvar.GetElementSize()
    if values is not None and element_size > 1 and len(values) % element_size == 0:
        values = values.reshape(-1, element_size, *values.shape[1:])
        values = values[..., 0] if values.shape[2:] == (1,) else values
    dtype = None if primvar is None else _custom_text(primvar.GetAttr(), "dtype")
    if values is not None and dtype in WRITTEN_DTYPES:  # exporters/usd.py chose one that USD has
        values = values.astype(dtype)
    obj.keep(name, DOMAINS.get(interpolation), values)


def _numbers(values: Any) -> np.ndarray | None:
    if values is None:
        return None
    try:
        array = np.array(values)
    except (TypeError, ValueError):
        return None
    if array.dtype.kind not in "biuf" or not isinstance(values, (bool, int, float)) and array.ndim == 0:
        return None
    return array.reshape(-1) if array.ndim == 0 else array if is_array(values) else array[None]


def _is_guessed(attribute: Usd.Attribute) -> bool:
    """Whether athcodec's writer has made up the value, so that it says nothing of the clip."""
    return attribute.GetCustomDataByKey(f"{OWN}:{GUESSED}") is True


def _custom_text(attribute: Usd.Attribute, key: str) -> str | None:
    """Return the text that athcodec's writer has kept with an attribute under a key, or None."""
    text = attribute.GetCustomDataByKey(f"{OWN}:{key}")
    return text if isinstance(text, str) else None


WRITTEN_DTYPES = ("|i1", "|b1", "<i2", "<u2", ">i2", ">u2", ">i4", ">u4", ">i8", ">u8", ">f2", ">f4", ">f8", "<f2")


# ---- what exporters/usd.py has written of a clip that USD has no place for ----


def _kept_arrays(stage: Usd.Stage) -> Iterator[tuple[ArrayDescriptor, bytes]]:
    root = stage.GetDefaultPrim()
    for attribute in root.GetAuthoredPropertiesInNamespace(OWN) if root else ():
        values = attribute.Get() if isinstance(attribute, Usd.Attribute) else None
        if isinstance(values, Vt.UCharArray):
            name = _custom_text(attribute, "name") or str(attribute.GetName())[len(OWN) + 1 :]
            texts = (_custom_text(attribute, key) or "" for key in ("dtype", "shape", "domain"))
            yield ArrayDescriptor(name, *texts), np.array(values).tobytes()


# ---- skeletons ----


class _Skeleton:
    """A skeleton and one mesh that it moves."""

    def __init__(self, query: UsdSkel.SkeletonQuery, target: UsdSkel.SkinningQuery):
        self.query, self.target = query, target
        self.animation = query.GetAnimQuery()
        self.skins = target.HasJointInfluences()
        self._shapes = self._mapper = None
        if target.HasBlendShapes() and self.animation:
            self._shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(target.GetPrim()))
            self._mapper = target.GetBlendShapeMapper()
            self._indices = self._shapes.ComputeBlendShapePointIndices()
            self._offsets = self._shapes.ComputeSubShapePointOffsets()

    def deform(self, points: Vt.Vec3fArray, code: float) -> Vt.Vec3fArray:
        """Points in the skeleton's space where joints move them, else in the mesh's own."""
        points = Vt.Vec3fArray(points)
        if self._shapes is not None:
            self._blend(points, code)
        if self.skins:
            joints = self.query.ComputeSkinningTransforms(code)
            if not joints or not self.target.ComputeSkinnedPoints(joints, points, code):
                raise ClipError(f"{self.target.GetPrim().GetPath()}: its skeleton cannot be evaluated at {code:g}")
        return points

    def _blend(self, points: Vt.Vec3fArray, code: float) -> None:
        weights = self.animation.ComputeBlendShapeWeights(code)
        if weights is None:
            return
        if self._mapper is not None:
            weights = self._mapper.Remap(weights, elementSize=1)
        sub_shapes = self._shapes.ComputeSubShapeWeights(weights)
        if sub_shapes is None or not self._shapes.ComputeDeformedPoints(
            *sub_shapes, self._indices, self._offsets, points
        ):
            raise ClipError(f"{self.target.GetPrim().GetPath()}: its blend shapes cannot be evaluated at {code:g}")

    @property
    def space(self) -> Usd.Prim:
        return self.query.GetPrim() if self.skins else self.target.GetPrim()

    def mirrors(self, count: int, code: float) -> bool:
        """Whether skinning turns a mesh of so many points inside out, by the joint that moves most of them."""
        joints = self.largest(count)
        joints = joints[joints >= 0]
        if not len(joints):
            return False
        matrix = np.array(self.query.ComputeSkinningTransforms(code)[int(np.bincount(joints).argmax())])
        bind = np.array(self.target.GetGeomBindTransform())
        return bool(np.linalg.det(bind[:3, :3]) * np.linalg.det(matrix[:3, :3]) < 0)

    def largest(self, count: int) -> np.ndarray:
        """(count,) joint of the skeleton with the largest weight on each vertex, -1 for none."""
        influences = self.target.ComputeVaryingJointInfluences(count) if self.skins else None
        if not influences or count == 0:
            return np.full(count, -1, np.int32)
        joints, weights = (np.array(values).reshape(count, -1) for values in influences)
        rows = np.arange(count), weights.argmax(axis=1)
        chosen = joints[rows]
        order = self.target.GetJointOrder()
        if order:
            places = {str(name): i for i, name in enumerate(self.query.GetJointOrder())}
            place = np.array([places.get(str(name), -1) for name in order])
            chosen = place[np.clip(chosen, 0, len(place) - 1)]
        return np.where(weights[rows] > 0, chosen, -1).astype(np.int32)


def _bind_skeletons(
    stage: Usd.Stage, objects: list[_Prim], not_read: dict[str, list[str]]
) -> list[UsdSkel.SkeletonQuery]:
    by_path = {obj.prim.GetPath(): obj for obj in objects}
    predicate = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    queries, animations = [], {}
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), predicate):
        if prim.IsA(UsdSkel.Animation):
            animations[prim.GetPath()] = str(prim.GetPath())
        if not prim.IsA(UsdSkel.Root):
            continue
        root, cache = UsdSkel.Root(prim), UsdSkel.Cache()
        cache.Populate(root, predicate)
        for binding in cache.ComputeSkelBindings(root, predicate):
            query = cache.GetSkelQuery(binding.GetSkeleton())
            queries.append((cache, query))  # the cache owns what the query refers to
            for target in binding.GetSkinningTargets():
                obj = by_path.get(target.GetPrim().GetPath())
                moves = query and (target.HasJointInfluences() or target.HasBlendShapes())
                if obj is not None and moves and obj.instances is None:
                    obj.skeleton = _Skeleton(query, target)
    for _, query in queries:
        if query.GetAnimQuery():
            animations.pop(query.GetAnimQuery().GetPrim().GetPath(), None)
        elif query and (source := _missing_animation(query.GetPrim())):
            not_read.setdefault("missing", []).append(source)
    if animations:
        not_read["SkelAnimation"] = list(animations.values())
    for obj in objects:
        if obj.skeleton is None and _is_bound(obj.prim):
            kind = "Skeleton of an instance" if obj.instances is not None else "skinning"
            not_read.setdefault(kind, []).append(obj.path)
    return queries


def _is_bound(prim: Usd.Prim) -> bool:
    """Whether a prim says that joints or blend shapes move it."""
    binding = UsdSkel.BindingAPI(prim)
    return binding.GetJointIndicesAttr().HasAuthoredValue() or binding.GetBlendShapesAttr().HasAuthoredValue()


def _missing_animation(skeleton: Usd.Prim) -> str | None:
    """The animation that a skeleton names, or a prim above it does, and that is not there; None where none is named."""
    for prim in _lineage(skeleton):
        relationship = UsdSkel.BindingAPI(prim).GetAnimationSourceRel()
        if relationship and relationship.HasAuthoredTargets():
            return f"animation {', '.join(map(str, relationship.GetTargets()))} of {skeleton.GetPath()}"
    return None


def _skin(objects: list[_Prim], queries: list[tuple[Any, UsdSkel.SkeletonQuery]]) -> Skin | None:
    """The joints of all skeletons, one after the other."""
    parents, names, first = [], [], {}
    for _, query in queries:
        path = query.GetPrim().GetPath()
        if path in first:
            continue
        first[path] = sum(map(len, parents))
        joints_of_object = np.array(query.GetTopology().GetParentIndices(), np.int32)
        parents.append(np.where(joints_of_object < 0, -1, joints_of_object + first[path]))
        names += [str(name) for name in query.GetJointOrder()]
    if not names or not any(obj.skeleton is not None and obj.skeleton.skins for obj in objects):
        return None
    joints = np.full(sum(obj.count for obj in objects), -1, np.int32)
    for obj in objects:
        if obj.skeleton is not None:
            joints_of_object = obj.skeleton.largest(obj.count)
            offset = first[obj.skeleton.query.GetPrim().GetPath()]
            joints[obj.first : obj.first + obj.count] = np.where(joints_of_object < 0, -1, joints_of_object + offset)
    return Skin(np.concatenate(parents).astype(np.int32), joints, names)


# ---- positions ----


def _points(obj: _Prim, codes: np.ndarray, frame: int) -> np.ndarray:
    ids = None if obj.ids is None else UsdGeom.Points(obj.prim).GetIdsAttr()
    code = float(codes[frame]) if ids is None else _code_of_order(ids, float(codes[frame]))
    points = obj.points.Get(code)
    if points is None:
        raise ClipError(f"{obj.path}: got no points in {_frame_name(codes, frame)}")
    if obj.skeleton is not None:
        points = obj.skeleton.deform(points, code)
    points = np.array(points, np.float32).reshape(-1, 3)
    if ids is None:
        return points
    return obj.ordered(points, _array(ids.Get(code + 1e-6), np.int64), _frame_name(codes, frame))


def _frame_name(codes: np.ndarray, frame: int) -> str:
    return f"frame {frame} (time code {codes[frame]:g})"
