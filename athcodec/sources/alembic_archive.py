"""Reads Alembic: meshes, subdivision surfaces, curves and points whose points or transforms move, in world space.

Frames are the times at which anything that is read has a sample; options.fps sets another rate. Between samples points
and transforms go on straight lines. Alembic lists the corners of a face clockwise: they come counter-clockwise, as
everywhere else here. An Alembic file names no unit and no axis; Y is up by custom, which is said of Blender's files
alone. The names of face sets become those of materials: attribute "face_material", metadata "material_names". What has
instances, and a shape that stays as it is, becomes one object, of as many copies. Visibility becomes presence, and its
samples count as frames; an object that says it is visible is shown below a hidden one. Objects that are never shown,
NURBS patches, materials, velocities, creases and others are named in the clip's `not_read`. It is imported by the
process of reader_main.py alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from alembic3d import Abc, AbcGeom

from athcodec.errors import ClipError
from athcodec.files.reading import FileWatch
from athcodec.motion.clip import MotionClip
from athcodec.sources import LISTED, ReadOptions, besides
from athcodec.sources.scene_objects import (
    DESCRIPTOR,
    OWN,
    SCHEME,
    SURFACE,
    ArrayDescriptor,
    SceneObject,
    clip_of_objects,
    frames_of_objects,
    own_metadata,
)
from athcodec.untyped import AlembicObject, JsonObject

MAX_SAMPLES = 1 << 24
MAX_OBJECTS = 1 << 20
SAME_TIME = 1e-4  # Largest difference of equal times, in frames.
EXISTING = Abc.WrapExistingFlag.kWrapExisting
SCHEMAS = {
    "AbcGeom_PolyMesh": ("mesh", AbcGeom.IPolyMesh),
    "AbcGeom_SubD": ("mesh", AbcGeom.ISubD),
    "AbcGeom_Curve": ("curves", AbcGeom.ICurves),
    "AbcGeom_Points": ("points", AbcGeom.IPoints),
}
SCOPES = {
    AbcGeom.GeometryScope.kVertexScope: "vertex",
    AbcGeom.GeometryScope.kVaryingScope: "vertex",
    AbcGeom.GeometryScope.kFacevaryingScope: "corner",
    AbcGeom.GeometryScope.kUniformScope: "face",
    AbcGeom.GeometryScope.kConstantScope: "constant",
}
NAMED_PARAMS = (("uv", "getUVsParam"), ("normals", "getNormalsParam"), ("radius", "getWidthsParam"))
BASES = {  # Those of cubic curves, as USD calls them.
    AbcGeom.BasisType.kBezierBasis: "bezier",
    AbcGeom.BasisType.kBsplineBasis: "bspline",
    AbcGeom.BasisType.kCatmullromBasis: "catmullRom",
}
VISIBLE = "visible"  # The property of an object's visibility.
UNREAD = (*SURFACE, "faceVaryingInterpolateBoundary", "velocities", "knots", "orders", "positionWeights")
PARAMS = tuple(
    getattr(AbcGeom, f"I{name}GeomParam")
    for name in (
        "Float Double Half Int32 UInt32 Int16 UInt16 Char Uchar Boolean V2f V3f V2d V3d V2i V3i P3f P3d N3f N3d C3f C4f"
    ).split()
)
# The bindings raise these: Alembic's exceptions, Boost's for types that do not match, and those of a broken archive
BROKEN = (RuntimeError, ValueError, TypeError, IndexError, OverflowError, UnicodeError)


def open_clip(path: str, options: ReadOptions) -> MotionClip:
    """Return the clip in the Alembic file `path`. Raises ClipError if the file is damaged or holds no usable clip."""
    unchanged = FileWatch(path)
    try:
        clip = _clip(Abc.IArchive(path), options)
    except ClipError:
        raise
    except BROKEN as error:
        raise ClipError(f"archive: {' '.join(str(error).split()) or type(error).__name__}") from None
    clip.unchanged = unchanged
    return clip


class _Track:
    """Samples of a property over time: what it is at a time, or between which two samples."""

    def __init__(self, sampling: AlembicObject, count: int):
        """Store the times in seconds of the `count` samples of a property, whose Alembic time sampling is `sampling`.
        Raises ClipError if there are too many samples or a time is not finite."""
        if count > MAX_SAMPLES:
            raise ClipError(f"archive: got {count} samples, expected at most {MAX_SAMPLES}")
        kind = sampling.getTimeSamplingType()
        self.step = kind.getTimePerCycle() if not kind.isAcyclic() else 0.0
        if kind.isUniform():
            self.times = sampling.getSampleTime(0) + np.arange(count) * self.step
        else:
            self.times = np.array([sampling.getSampleTime(i) for i in range(count)])
        if not np.isfinite(self.times).all():
            raise ClipError("archive: got times that are no numbers, expected seconds")

    def sample(self, number: int) -> AlembicObject:
        """Return the selector of a sample: by its time, because the bindings take its number for one."""
        return Abc.ISampleSelector(float(self.times[number]), Abc.ISampleSelector.TimeIndexType.kNearIndex)

    def at(self, time: float) -> list[tuple[int, float]]:
        """Return the samples to mix for the value at `time` in seconds: one or two pairs (number of the sample,
        weight), whose weights add up to 1."""
        after = int(np.searchsorted(self.times, time))
        low = max(0, after - 1)
        high = min(after, len(self.times) - 1)
        if high == low:
            return [(low, 1.0)]
        weight = (time - self.times[low]) / (self.times[high] - self.times[low])
        if weight < SAME_TIME:
            return [(low, 1.0)]
        if weight > 1 - SAME_TIME:
            return [(high, 1.0)]
        return [(low, 1 - weight), (high, weight)]


@dataclass
class _Xform:
    """A transform above an object."""

    schema: AlembicObject
    track: _Track
    still: np.ndarray | None = None

    def at(self, time: float) -> np.ndarray:
        """Return the matrix (4, 4) of the transform at a time in seconds, mixed linearly from the samples before and
        after it."""
        if self.still is not None:
            return self.still
        matrix = np.zeros((4, 4))
        for i, weight in self.track.at(time):
            matrix += weight * np.array(self.schema.getValue(self.track.sample(i)).getMatrix(), np.float64)
        if len(self.track.times) < 2:
            self.still = matrix
        return matrix


@dataclass
class _Visibility:
    """An object's stated visibility: hidden, visible whatever is said above it, or, by -1, nothing."""

    track: _Track
    values: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the stated visibility at each of the times, (T,)."""
        return self.values[[self.track.at(time)[0][0] for time in times]]


@dataclass
class _Place:
    """Where an object or an instance of it hangs: its path, and the transforms and visibilities above, leaf first."""

    path: str = ""
    xforms: list[_Xform] = field(default_factory=list)
    visibilities: list[_Visibility] = field(default_factory=list)

    def tracks(self) -> Iterator[_Track]:
        yield from (xform.track for xform in self.xforms)
        yield from (visibility.track for visibility in self.visibilities)

    def shown(self, times: np.ndarray) -> np.ndarray:
        """Return (T,) whether the object is shown: the nearest that says anything decides."""
        stated = np.full(len(times), -1)
        for visibility in self.visibilities:
            stated = np.where(stated < 0, visibility.at(times), stated)
        return stated != 0

    @property
    def is_seen(self) -> bool:
        """Whether it is shown at the time of any sample of its visibility."""
        times = np.unique([0.0, *(time for each in self.visibilities for time in each.track.times)])
        return bool(self.shown(times).any())

    def matrix(self, time: float) -> np.ndarray:
        """Return (4, 4) to the world."""
        matrix = np.eye(4)
        for xform in self.xforms:
            matrix = matrix @ xform.at(time)
        return matrix


@dataclass(kw_only=True)
class _Object(SceneObject):
    """An object that is read, where it and its instances hang, and how its points are found. source: its path, of an
    instance that of what it shows."""

    schema: AlembicObject
    places: list[_Place]
    source: str
    points: AlembicObject
    track: _Track

    def tracks(self) -> Iterator[_Track]:
        tracks = (track for place in self.places for track in place.tracks())
        yield from (track for track in (self.track, *tracks) if len(track.times) > 1)

    @property
    def moves(self) -> bool:
        return any(len(xform.track.times) > 1 for place in self.places for xform in place.xforms)


def _clip(archive: AlembicObject, options: ReadOptions) -> MotionClip:
    """Return the clip of the objects in an opened Alembic archive. Raises ClipError if the archive holds no usable
    clip."""
    if not archive.valid():
        raise ClipError("archive: cannot be opened")
    metadata, kept = _kept(archive)
    not_read: dict[str, list[str]] = {}
    objects = _together(_find(archive, options.only, not_read))
    times, rate = _times(archive, objects, options.fps)
    first = 0
    for obj in objects:
        _follow_ids(obj)
        obj.first, obj.count = first, len(_points(obj, times[0]))
        obj.is_still = not obj.moves and len(obj.track.times) < 2
        obj.shown = np.stack([place.shown(times) for place in obj.places], axis=1)
        _topology(obj)
        _statics(obj, times[0])
        _name_unread(obj)
        if len(obj.places) > 1:
            obj.leave_out("normals")  # They turn with each copy.
            obj.repeat(len(obj.places))
        if obj.kind == "mesh":  # whose corners are clockwise in the file
            placed_at = times if obj.moves else times[:1]
            obj.face_outward((_matrix(obj, float(time)) for time in placed_at), is_reversed=True)
        first += obj.count
    if first == 0:
        raise ClipError(f"{objects[0].path}: got no points, expected at least one")

    def sample(obj: _Object, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the points (n, 3) of an object in a frame and the matrix that takes them to the world: (4, 4), or
        (copies, 4, 4)."""
        try:
            return _points(obj, times[frame]), _matrix(obj, times[frame])
        except ClipError:
            raise
        except BROKEN as error:
            raise ClipError(
                f"positions: frame {frame} of {obj.path} cannot be read: {' '.join(str(error).split())}"
            ) from None

    return clip_of_objects(
        objects,
        frames_of_objects(objects, len(times), sample),
        times - times[0],
        own_metadata(metadata) | _metadata(archive, times, rate),
        kept,
        options,
        not_read=not_read,
    )


# ---- objects ----


def _find(archive: AlembicObject, only: Sequence[str], not_read: dict[str, list[str]]) -> list[_Object]:
    """Return the objects of the archive to read, instances included. If `only` is not empty, an object needs one of
    these names or paths. The paths of other objects are added to `not_read`, under the name of their kind."""
    objects, visited, refused = list[_Object](), 0, list[str]()
    waiting = [(archive.getTop(), _Place(), "")]
    while waiting:
        parent, place, above = waiting.pop()
        children = []
        for i in range(parent.getNumChildren()):
            visited += 1
            if visited > MAX_OBJECTS:
                raise ClipError(f"archive: got more than {MAX_OBJECTS} objects")
            child = parent.getChild(i)
            source = child.instanceSourcePath() if child.isInstanceRoot() else f"{above}/{child.getName()}"
            below = _Place(f"{place.path}/{child.getName()}", place.xforms, [*_visibility(child), *place.visibilities])
            if only and _is_shape(child) and not _is_named(child, only):
                refused.append(below.path)
            else:
                below = _add(child, source, below, objects, not_read)
            children.append((child, below, source))
        waiting += reversed(children)
    if not objects:
        filtered = f" named like {', '.join(only)}" if only else ""
        names = f", or {', '.join(refused[:LISTED])}" if refused else ""
        raise ClipError(
            f"objects: got none with points{filtered}, expected a visible mesh, curves or points"
            f"{names}{besides(not_read)}"
        )
    return objects


def _schema(child: AlembicObject) -> str:
    return child.getHeader().getMetaData().get("schema") or ""


def _is_shape(child: AlembicObject) -> bool:
    return any(_schema(child).startswith(start) for start in SCHEMAS)


def _is_named(child: AlembicObject, patterns: Sequence[str]) -> bool:
    names = (child.getName(), child.getFullName())
    return any(fnmatchcase(name, pattern) for pattern in patterns for name in names)


def _together(objects: list[_Object]) -> list[_Object]:
    """Return the objects, with instances of one object merged into the first of them as further copies. Objects whose
    shape changes over time stay apart."""
    by_source: dict[str, _Object] = {}
    remaining = []
    for obj in objects:
        first = by_source.get(obj.source)
        if first is None:
            by_source[obj.source] = obj
            remaining.append(obj)
        elif len(obj.track.times) > 1:
            remaining.append(obj)
        else:
            first.places += obj.places
    return remaining


def _add(
    child: AlembicObject, source: str, place: _Place, objects: list[_Object], not_read: dict[str, list[str]]
) -> _Place:
    """Append the object `child` to `objects` if it has points and is shown; otherwise add it to `not_read`. `source` is
    the path of the shape that the object shows and `place` is where it hangs. Return the place at which its children
    hang, which has one transform more if `child` is a transform."""
    name = _schema(child)
    if unread := _unread_properties(child):
        not_read.setdefault("attribute", []).extend(f"{child.getFullName()}.{each}" for each in unread)
    if name.startswith("AbcGeom_Xform"):
        return replace(place, xforms=_above(child, place.xforms))
    kinds = next((schema for start, schema in SCHEMAS.items() if name.startswith(start)), None)
    if name.startswith("AbcGeom_FaceSet"):
        return place  # A mesh is read together with its face sets.
    if kinds is None and name:
        kind = name.partition("_")[2].rpartition("_")[0] or name  # For example NuPatch of AbcGeom_NuPatch_v2.
        not_read.setdefault(kind, []).append(child.getFullName())
    if kinds is None:
        return place
    kind, wrap = kinds
    schema = wrap(child, EXISTING).getSchema()
    points = schema.getPositionsProperty()
    if not points.getNumSamples():
        not_read.setdefault("empty", []).append(place.path)
    elif not place.is_seen:
        not_read.setdefault("hidden", []).append(place.path)
    else:
        names, track = (child.getName(), child.getFullName()), _track(points)
        objects.append(_Object(kind, *names, schema=schema, places=[place], points=points, track=track, source=source))
    return place


def _unread_properties(child: AlembicObject) -> list[str]:
    """Return the names of the properties of an Alembic object that are not read: those outside of its schema and, for a
    transform, also those that users added inside of it."""
    if child.isInstanceRoot() or child.isInstanceDescendant():
        return []  # They are named where the instance's source stands.
    schema = (child.getHeader().getMetaData().get("schemaObjTitle") or "").rpartition(":")[2]
    beside = [name for name in _names_of(child.getProperties()) if name not in (schema, VISIBLE)]
    if not _schema(child).startswith("AbcGeom_Xform"):
        return beside
    transform = AbcGeom.IXform(child, EXISTING).getSchema()
    further = (transform.getArbGeomParams(), transform.getUserProperties())
    return beside + [name for each in further if each.valid() for name in _names_of(each) if not _is_own(transform)]


def _names_of(properties: AlembicObject) -> list[str]:
    return [properties.getPropertyHeader(i).getName() for i in range(properties.getNumProperties())]


def _above(child: AlembicObject, xforms: list[_Xform]) -> list[_Xform]:
    """Return the transforms that apply to the children of the transform `child`, the innermost first: its own, and
    `xforms`, those above it, if it inherits them."""
    schema = AbcGeom.IXform(child, EXISTING).getSchema()
    above = xforms if schema.getInheritsXforms() else []
    count = schema.getNumSamples()
    if not count or _is_own(schema):
        return above
    transform = _Xform(schema, _Track(schema.getTimeSampling(), 1 if schema.isConstant() else count))
    return [transform, *above]


def _track(samples: AlembicObject) -> _Track:
    return _Track(samples.getTimeSampling(), 1 if samples.isConstant() else samples.getNumSamples())


def _visibility(child: AlembicObject) -> Iterator[_Visibility]:
    """Return an object's stated visibility, if any."""
    samples = AbcGeom.GetVisibilityProperty(child)
    if samples and samples.valid() and samples.getNumSamples():
        track = _track(samples)
        values = [samples.getValue(track.sample(i)) for i in range(len(track.times))]
        yield _Visibility(track, np.array(values, np.int64).astype(np.int8))


def _follow_ids(obj: _Object) -> None:
    """Note the ids of points that stand in another order in some sample."""
    samples = obj.schema.getIdsProperty() if obj.kind == "points" else None
    if samples is None or not samples.valid() or samples.isConstant():
        return
    first = np.array(samples.getValue(obj.track.sample(0)), np.uint64)
    if len(np.unique(first)) == len(first):
        obj.ids = np.sort(first)


def _topology(obj: _Object) -> None:
    """Read the faces of a mesh or the vertex counts of curves from the archive and store them in `obj`. Raises
    ClipError if they do not fit the points or change over time."""
    if obj.kind == "curves":
        sample = obj.schema.getValue()
        obj.curve_counts = _fixed(obj, obj.schema.getNumVerticesProperty())
        if sample.getWrap() == AbcGeom.CurvePeriodicity.kPeriodic:
            obj.details["wrap"] = "periodic"
        if sample.getType() == AbcGeom.CurveType.kCubic:
            obj.details["type"] = "cubic"
            if basis := BASES.get(sample.getBasis()):
                obj.details["basis"] = basis
    elif obj.kind == "mesh":
        obj.face_counts = _fixed(obj, obj.schema.getFaceCountsProperty())
        obj.face_indices = _fixed(obj, obj.schema.getFaceIndicesProperty())
    obj.check()
    if obj.kind == "mesh":
        _bind_materials(obj)
    if hasattr(obj.schema, "getSubdivisionSchemeProperty"):
        scheme = obj.schema.getSubdivisionSchemeProperty()
        obj.details[SCHEME] = scheme.getValue().replace("-c", "C") if scheme.valid() else "catmullClark"


def _name_unread(obj: _Object) -> None:
    """Add the names of properties that hold data and are not read to `obj.left_out`."""
    for name in UNREAD:
        prop = getattr(obj.schema, f"get{name[0].upper()}{name[1:]}Property", Abc.IInt32Property)()
        if prop.valid() and prop.getNumSamples():
            values = np.array(prop.getValue())
            obj.left_out += [name] * bool(values.size if values.ndim else values)
    further = obj.schema.getUserProperties()
    obj.left_out += ["userProperties"] * bool(further.valid() and further.getNumProperties())


def _bind_materials(obj: _Object) -> None:
    """Take materials from the names of face sets, where programs write them."""
    for name in obj.schema.getFaceSetNames():
        face_set = obj.schema.getFaceSet(name).getSchema()
        obj.left_out += [f"{name} (a face set that changes)"] * (not face_set.isConstant())
        faces = np.array(face_set.getValue().getFaces(), np.int64)
        if len(faces) and 0 <= faces.min() and faces.max() < len(obj.face_counts):
            obj.bind(str(name), faces)


def _fixed(obj: _Object, values: Any) -> np.ndarray:
    """Return the integers of an Alembic array property (`values`), int32. Raises ClipError if they change over time."""
    first = np.array(values.getValue(), np.int32)
    if values.isConstant():
        return first
    track = _Track(values.getTimeSampling(), values.getNumSamples())
    for i in range(1, len(track.times)):
        if not np.array_equal(np.array(values.getValue(track.sample(i)), np.int32), first):
            raise ClipError(
                f"{obj.path}: {values.getName()} changes in frame {i} (at {track.times[i]:g} s), expected "
                "the same vertices and faces in all"
            )
    return first


# ---- time ----


def _times(archive: AlembicObject, objects: list[_Object], fps: float | None) -> tuple[np.ndarray, float | None]:
    """Return (times, rate): the seconds (T,) of the clip's frames, and its frames per second, None if nothing states a
    rate. With `fps`, frames are taken at this rate between the first and last sample."""
    tracks = [track for obj in objects for track in obj.tracks()]
    if not tracks:
        return np.zeros(1), fps
    step = min((track.step for track in tracks if track.step > 0), default=0.0)
    times = np.unique(np.concatenate([track.times for track in tracks]))
    rate = _rate(archive, step, times)
    times = times[np.append(True, np.diff(times) > SAME_TIME / rate)]
    if fps is None:
        return times, rate
    count = math.floor((times[-1] - times[0]) * fps + SAME_TIME) + 1
    if count > MAX_SAMPLES:
        raise ClipError(f"archive: got {count} frames, expected at most {MAX_SAMPLES}")
    return times[0] + np.arange(count) / fps, fps


def _rate(archive: AlembicObject, step: float, times: np.ndarray) -> float:
    """Return the frames per second of samples at `times` (T,) in seconds: 1 / `step` if `step`, the shortest regular
    distance of samples in seconds, is above 0; else the rate that the archive states; else the rate of the median
    distance."""
    stated = Abc.GetArchiveInfo(archive).get("dccFPS", 0.0)
    rate = 1 / step if step > 0 else float(stated) or 1 / float(np.median(np.diff(times)))
    nice = round(rate * 1001) // 1000 * 1000 / 1001
    for exact in (float(round(rate)), nice, (round(rate * 1001 / 1000) * 1000) / 1001):
        if exact > 0 and math.isclose(rate, exact, rel_tol=1e-12 if step > 0 else 1e-6):
            return exact
    if not 0 < rate < math.inf:
        raise ClipError(f"archive: got {rate} frames per second, expected a positive number")
    return rate


def _metadata(archive: AlembicObject, times: np.ndarray, rate: float | None) -> JsonObject:
    """Return the metadata of the clip: "fps" and "start_frame" if `rate` is known, and "up_axis" if Blender wrote the
    archive. `times` (T,) are the seconds of the frames."""
    metadata: JsonObject = {}
    if rate is not None:
        start = float(times[0]) * rate
        whole = math.isclose(start, round(start), abs_tol=1e-4)
        metadata |= {"fps": float(rate), "start_frame": round(start) if whole else start}
    if "Blender" in str(Abc.GetArchiveInfo(archive).get("appName", "")):
        metadata["up_axis"] = "y"
    return metadata


# ---- what does not move ----


def _statics(obj: _Object, time: float) -> None:
    """Read the arrays of an object that stay the same in all frames and store them in it. Normals and widths are
    brought to world space by the object's transform at `time`, in seconds."""
    for name, getter in NAMED_PARAMS:
        if hasattr(obj.schema, getter):  # A subdivision surface has no normals.
            _keep(obj, name, getattr(obj.schema, getter)())
    further = obj.schema.getArbGeomParams()
    for i in range(further.getNumProperties() if further.valid() else 0):
        header = further.getPropertyHeader(i)
        kind = next((param for param in PARAMS if param.matches(header)), None)
        if kind is not None:
            _keep(obj, header.getName(), kind(further, header.getName()))
        else:
            obj.left_out.append(header.getName())
    if obj.kind != "mesh":
        obj.halve_widths(obj.places[0].matrix(time))
    obj.turn_normals(obj.places[0].matrix(time), obj.moves)


def _keep(obj: _Object, name: str, param: AlembicObject) -> None:
    """Store the Alembic parameter `param` in the object as the static array `name`. If the parameter changes over time
    or holds no numbers, its name is added to `obj.left_out` instead."""
    if not param.valid() or not param.getNumSamples():
        return
    if not param.isConstant():
        obj.left_out.append(name)
        return
    sample = param.getExpandedValue()
    values = np.array(sample.getVals())
    if values.dtype.kind not in "biuf" or values.ndim == 0:
        obj.left_out.append(name)
        return
    domain = SCOPES.get(sample.getScope())
    extent = param.getArrayExtent()
    if extent > 1 and len(values) % extent == 0:
        values = values.reshape(len(values) // extent, -1)
    if domain in (None, "constant") and len(values) == obj.count:  # Blender's widths are said to be constant
        domain = "vertex"
    if domain == "vertex" and obj.ids is not None:  # Arrays that keep their order do not follow the points.
        domain = None
    obj.keep(name, domain, values)


# ---- what exporters/alembic.py has written besides ----


def _own_properties(schema: AlembicObject) -> AlembicObject:
    properties = schema.getUserProperties()
    if not properties.valid():
        return None
    return properties if OWN in _names_of(properties) else None


def _is_own(schema: AlembicObject) -> bool:
    """Return whether a transform is the one above everything in a file of ours, which only turns Z up into Y up."""
    return _own_properties(schema) is not None


def _kept(archive: AlembicObject) -> tuple[str | None, list[tuple[ArrayDescriptor, bytes]]]:
    """Return what athcodec's own Alembic writer stored beside the objects: the clip's metadata as JSON text, None if
    the file has none, and a list of arrays, each as a pair of its descriptor and its bytes."""
    top = archive.getTop()
    if top.getNumChildren() != 1:
        return None, []
    child = top.getChild(0)
    if not (child.getHeader().getMetaData().get("schema") or "").startswith("AbcGeom_Xform"):
        return None, []
    properties = _own_properties(AbcGeom.IXform(child, EXISTING).getSchema())
    if properties is None:
        return None, []
    names = _names_of(properties)
    kept = []
    for name in names:
        if name != OWN and name + DESCRIPTOR in names:
            descriptor = _descriptor(Abc.IStringProperty(properties, name + DESCRIPTOR).getValue())
            raw = np.array(Abc.IUcharArrayProperty(properties, name).getValue(), np.uint8).tobytes()
            kept.append((descriptor, raw))
    return Abc.IStringProperty(properties, OWN).getValue(), kept


def _descriptor(text: str) -> ArrayDescriptor:
    """Return the object of a JSON text; an empty one if it cannot be parsed."""
    try:
        descriptor = ArrayDescriptor(**json.loads(text))
    except (ValueError, TypeError, RecursionError):
        return ArrayDescriptor()
    return descriptor if all(isinstance(value, str) for value in descriptor) else ArrayDescriptor()


# ---- positions ----


def _points(obj: _Object, time: float) -> np.ndarray:
    """Return the points (n, 3) float32 of an object at a time in seconds, mixed linearly from the samples before and
    after it."""
    samples = [(_sample(obj, i), weight) for i, weight in obj.track.at(time)]
    counts = {len(points) for points, _ in samples}
    if len(counts) != 1:
        raise ClipError(f"{obj.path}: got {max(counts)} points in a sample at {time:g} s, expected {obj.count}")
    if len(samples) == 1:
        return samples[0][0]
    (before, before_weight), (after, after_weight) = samples
    return (before.astype(np.float64) * before_weight + after.astype(np.float64) * after_weight).astype(np.float32)


def _sample(obj: _Object, number: int) -> np.ndarray:
    """Return (n, 3) points of a sample."""
    when = obj.track.sample(number)
    points = np.array(obj.points.getValue(when), np.float32).reshape(-1, 3)
    if obj.ids is None:
        return points
    ids = np.array(obj.schema.getIdsProperty().getValue(when), np.uint64)
    return obj.ordered(points, ids, f"the sample at {obj.track.times[number]:g} s")


def _matrix(obj: _Object, time: float) -> np.ndarray:
    """Return (4, 4) to the world; of what has instances (copies, 4, 4)."""
    matrices = np.stack([place.matrix(time) for place in obj.places])
    return matrices if len(matrices) > 1 else matrices[0]
