"""The process that reads an Alembic archive for sources/alembic.py, which see; nothing else imports it.

It takes a path and ReadOptions as one line of JSON, answers with the clip but for its motion, and then with the frames
that it is asked for, until there is nothing more to read. Each answer is a line of JSON, {"size": bytes} and these
bytes or {"error": what is wrong}. What kills this process, as a damaged archive may, is an end of answers there.
"""

from __future__ import annotations

import io
import json
import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, BinaryIO

import numpy as np
from alembic3d import Abc, AbcGeom

from athcodec.clip import MotionClip
from athcodec.errors import ClipError
from athcodec.sources import ReadOptions
from athcodec.sources.frames import Frames
from athcodec.sources.parts import (
    OWN,
    ArrayDescriptor,
    Part,
    Static,
    edges,
    faces,
    fields,
    joined,
    names_and_kinds,
    own_metadata,
    turned_corners,
)

MAX_SAMPLES = 1 << 24
MAX_OBJECTS = 1 << 20
SAME_TIME = 1e-4  # of a frame
EXISTING = Abc.WrapExistingFlag.kWrapExisting
SCHEMAS = {"AbcGeom_PolyMesh": ("mesh", AbcGeom.IPolyMesh), "AbcGeom_SubD": ("mesh", AbcGeom.ISubD),
           "AbcGeom_Curve": ("curves", AbcGeom.ICurves), "AbcGeom_Points": ("points", AbcGeom.IPoints)}
SCOPES = {AbcGeom.GeometryScope.kVertexScope: "vertex", AbcGeom.GeometryScope.kVaryingScope: "vertex",
          AbcGeom.GeometryScope.kFacevaryingScope: "corner", AbcGeom.GeometryScope.kUniformScope: "face",
          AbcGeom.GeometryScope.kConstantScope: "constant"}
PARAMS = tuple(getattr(AbcGeom, f"I{name}GeomParam") for name in (
    "Float Double Half Int32 UInt32 Int16 UInt16 Char Uchar Boolean V2f V3f V2d V3d V2i V3i P3f P3d N3f N3d C3f C4f"
).split())
# what the bindings raise: Alembic's exceptions, Boost's for types that do not match, and those of a broken archive
BROKEN = (RuntimeError, ValueError, TypeError, IndexError, OverflowError, MemoryError, UnicodeError)


def main() -> None:
    asked, answers = sys.stdin.buffer, sys.stdout.buffer
    wanted = json.loads(asked.readline())
    path = wanted.pop("path")
    with _answering(answers):
        clip = _clip(_Archive(path), ReadOptions(**wanted))
        _send(answers, _described(clip))
    for line in asked:
        start, stop = map(int, line.split())
        with _answering(answers):
            _send(answers, np.ascontiguousarray(clip.positions[start:stop]).tobytes())


@contextmanager
def _answering(answers: BinaryIO) -> Iterator[None]:
    try:
        yield
    except (*BROKEN, ClipError) as error:
        prefix = "" if isinstance(error, ClipError) else "archive: "
        text = " ".join(str(error).split()) or type(error).__name__
        answers.write(json.dumps({"error": prefix + text}).encode() + b"\n")
        answers.flush()


def _send(answers: BinaryIO, data: bytes) -> None:
    answers.write(json.dumps({"size": len(data)}).encode() + b"\n" + data)
    answers.flush()


def _described(clip: MotionClip) -> bytes:
    """All but the positions, as an .npz."""
    arrays = {f"attributes/{name}": values for name, values in clip.attributes.items()}
    for name in ("time", "vertex_branch", "branch_parent", "stem_index", "edges", "faces"):
        if getattr(clip, name) is not None:
            arrays[name] = getattr(clip, name)
    arrays["rest"] = clip.source_rest
    arrays["metadata"] = np.frombuffer(json.dumps(clip.metadata).encode(), np.uint8)
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


class _Archive:
    """An open archive."""

    def __init__(self, path: str):
        self.path = path
        self.archive = Abc.IArchive(path)
        if not self.archive.valid():
            raise ClipError("archive: cannot be opened")

    def close(self) -> None:
        self.archive = None


class _Track:
    """Samples of a property over time: what it is at a time, or between which two samples."""

    def __init__(self, sampling: Any, count: int):
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

    def sample(self, number: int) -> Any:
        """What asks for a sample: by its time, because the bindings take its number for one."""
        return Abc.ISampleSelector(float(self.times[number]), Abc.ISampleSelector.TimeIndexType.kNearIndex)

    def at(self, time: float) -> list[tuple[int, float]]:
        """Numbers of samples and their weights."""
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

    schema: Any
    track: _Track
    still: np.ndarray | None = None

    def at(self, time: float) -> np.ndarray:
        if self.still is not None:
            return self.still
        matrix = sum(weight * np.array(self.schema.getValue(self.track.sample(i)).getMatrix(), np.float64)
                     for i, weight in self.track.at(time))
        if len(self.track.times) < 2:
            self.still = matrix
        return matrix


@dataclass
class _Object(Part):
    """An object that is read, the transforms above it, leaf first, and how its points are found."""

    schema: Any = None
    xforms: list[_Xform] = field(default_factory=list)
    points: Any = None
    track: _Track | None = None
    still: np.ndarray | None = None

    def tracks(self) -> Iterator[_Track]:
        yield from (each for each in (self.track, *(xform.track for xform in self.xforms)) if len(each.times) > 1)

    @property
    def moves(self) -> bool:
        return any(len(xform.track.times) > 1 for xform in self.xforms)


def _clip(source: _Archive, options: ReadOptions) -> MotionClip:
    own, kept = _own(source.archive)
    parts = _find(source.archive, options.only)
    times, rate = _times(source.archive, parts, options.fps)
    first = 0
    for part in parts:
        part.first, part.count = first, len(_points(part, times[0]))
        first += part.count
        order = _topology(part)
        _statics(part, order, times[0])
    if first == 0:
        raise ClipError("points: got none, expected at least one")
    metadata = own_metadata(own) | _metadata(source.archive, times, rate) | names_and_kinds(parts)
    attributes, domains = joined(parts, options.skip)
    _add_kept(kept, attributes, domains, first, options.skip)
    if domains:
        metadata["domains"] = domains
    known = fields(attributes, domains)
    rest, links = known.pop("rest", None), known.pop("edges", None)
    polygons = faces(parts, attributes)
    reader = _Reader(source, parts, times)
    return MotionClip(
        positions=Frames(reader.read, len(times), first), time=times - times[0],
        rest=rest if options.rest == "auto" else None, rest_pose="mean" if options.rest == "mean" else "first",
        edges=edges(parts) if links is None else links, faces=polygons, attributes=attributes, metadata=metadata,
        resource=source, **known,
    )


# ---- objects ----


def _find(archive: Any, only: Sequence[str]) -> list[_Object]:
    parts, visited = [], 0
    waiting = [(archive.getTop(), [])]
    while waiting:
        parent, xforms = waiting.pop()
        children = []
        for i in range(parent.getNumChildren()):
            visited += 1
            if visited > MAX_OBJECTS:
                raise ClipError(f"archive: got more than {MAX_OBJECTS} objects")
            child = parent.getChild(i)
            if _hidden(child):
                continue
            children.append((child, _add(child, xforms, parts, only)))
        waiting += reversed(children)
    if not parts:
        what = f" named like {', '.join(only)}" if only else ""
        raise ClipError(f"objects: got none with points{what}, expected a visible mesh, curves or points")
    return parts


def _add(child: Any, xforms: list[_Xform], parts: list[_Object], only: Sequence[str]) -> list[_Xform]:
    """Adds an object that has points; returns the transforms above its children."""
    name = child.getHeader().getMetaData().get("schema") or ""
    if name.startswith("AbcGeom_Xform"):
        return _above(child, xforms)
    found = next((each for start, each in SCHEMAS.items() if name.startswith(start)), None)
    names = (child.getName(), child.getFullName())
    if found is None or only and not any(fnmatchcase(each, pattern) for pattern in only for each in names):
        return xforms
    kind, wrap = found
    schema = wrap(child, EXISTING).getSchema()
    points = schema.getPositionsProperty()
    if points.getNumSamples():
        parts.append(_Object(kind, *names, schema=schema, xforms=xforms, points=points, track=_track(points)))
    return xforms


def _above(child: Any, xforms: list[_Xform]) -> list[_Xform]:
    schema = AbcGeom.IXform(child, EXISTING).getSchema()
    above = xforms if schema.getInheritsXforms() else []
    count = schema.getNumSamples()
    if not count or _is_own(schema):
        return above
    own = _Xform(schema, _Track(schema.getTimeSampling(), 1 if schema.isConstant() else count))
    return [own, *above]


def _track(points: Any) -> _Track:
    return _Track(points.getTimeSampling(), 1 if points.isConstant() else points.getNumSamples())


def _hidden(child: Any) -> bool:
    """Whether an object is never seen."""
    visible = AbcGeom.GetVisibilityProperty(child)
    if not visible or not visible.valid() or not visible.isConstant() or not visible.getNumSamples():
        return False
    return AbcGeom.GetVisibility(child) == AbcGeom.ObjectVisibility.kVisibilityHidden


def _topology(part: _Object) -> np.ndarray:
    """Fills in faces or curves; returns where each corner lies in the file."""
    if part.kind == "curves":
        sample = part.schema.getValue()
        part.curve_counts = _fixed(part, part.schema.getNumVerticesProperty())
        if sample.getWrap() == AbcGeom.CurvePeriodicity.kPeriodic:
            part.details["wrap"] = "periodic"
        if sample.getType() == AbcGeom.CurveType.kCubic:
            part.details["type"] = "cubic"
    elif part.kind == "mesh":
        part.face_counts = _fixed(part, part.schema.getFaceCountsProperty())
        part.face_indices = _fixed(part, part.schema.getFaceIndicesProperty())
    part.check()
    order = turned_corners(part.face_counts)
    part.face_indices = part.face_indices[order]
    return order


def _fixed(part: _Object, found: Any) -> np.ndarray:
    """Integers that are the same in every frame; ClipError where they change."""
    first = np.array(found.getValue(), np.int32)
    if found.isConstant():
        return first
    track = _Track(found.getTimeSampling(), found.getNumSamples())
    for i in range(1, len(track.times)):
        if not np.array_equal(np.array(found.getValue(track.sample(i)), np.int32), first):
            raise ClipError(f"{part.path}: {found.getName()} changes in frame {i} (at {track.times[i]:g} s), expected "
                            "the same vertices and faces in all")
    return first


# ---- time ----


def _times(archive: Any, parts: list[_Object], fps: float | None) -> tuple[np.ndarray, float | None]:
    """Seconds of the frames in the archive, and frames per second, None where nothing says it."""
    tracks = [track for part in parts for track in part.tracks()]
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


def _rate(archive: Any, step: float, times: np.ndarray) -> float:
    """What the samples are apart; where they differ, what the archive says of its maker's rate."""
    said = Abc.GetArchiveInfo(archive).get("dccFPS", 0.0)
    rate = 1 / step if step > 0 else float(said) or 1 / float(np.median(np.diff(times)))
    nice = round(rate * 1001) // 1000 * 1000 / 1001
    for exact in (float(round(rate)), nice, (round(rate * 1001 / 1000) * 1000) / 1001):
        if exact > 0 and math.isclose(rate, exact, rel_tol=1e-12 if step > 0 else 1e-6):
            return exact
    if not 0 < rate < math.inf:
        raise ClipError(f"archive: got {rate} frames per second, expected a positive number")
    return rate


def _metadata(archive: Any, times: np.ndarray, rate: float | None) -> dict[str, Any]:
    metadata: dict[str, Any] = {}
    if rate is not None:
        start = float(times[0]) * rate
        whole = math.isclose(start, round(start), abs_tol=1e-4)
        metadata |= {"fps": float(rate), "start_frame": round(start) if whole else start}
    if "Blender" in str(Abc.GetArchiveInfo(archive).get("appName", "")):
        metadata["up_axis"] = "y"
    return metadata


# ---- what does not move ----


def _statics(part: _Object, order: np.ndarray, time: float) -> None:
    params = [] if part.kind == "points" else [("uv", part.schema.getUVsParam()),
                                               ("normals", part.schema.getNormalsParam())]
    if part.kind != "mesh":
        params.append(("radius", part.schema.getWidthsParam()))
    for name, param in params if part.kind != "mesh" or hasattr(part.schema, "getNormalsParam") else params[:1]:
        _keep(part, name, param, order)
    further = part.schema.getArbGeomParams()
    for i in range(further.getNumProperties() if further.valid() else 0):
        header = further.getPropertyHeader(i)
        kind = next((each for each in PARAMS if each.matches(header)), None)
        if kind is not None:
            _keep(part, header.getName(), kind(further, header.getName()), order)
    if "radius" in part.statics and part.kind != "mesh":
        radius = part.statics["radius"]
        scale = 0.5 * np.cbrt(abs(np.linalg.det(_matrix(part, time)[:3, :3])))
        part.statics["radius"] = Static(radius.domain, (radius.values * scale).astype(radius.values.dtype))
    _turn_normals(part, _matrix(part, time))


def _keep(part: _Object, name: str, param: Any, order: np.ndarray) -> None:
    if not param.valid() or not param.isConstant() or not param.getNumSamples():
        return
    sample = param.getExpandedValue()
    values = np.array(sample.getVals())
    if values.dtype.kind not in "biuf" or values.ndim == 0:
        return
    domain = SCOPES.get(sample.getScope())
    extent = param.getArrayExtent()
    if extent > 1 and len(values) % extent == 0:
        values = values.reshape(len(values) // extent, -1)
    if domain in (None, "constant") and len(values) == part.count:  # Blender's widths are said to be constant
        domain = "vertex"
    if domain == "corner" and len(values) == len(order):
        values = values[order]
    part.keep(name, domain, values)


def _turn_normals(part: _Object, matrix: np.ndarray) -> None:
    normals = part.statics.get("normals")
    if normals is None or normals.values.shape[1:] != (3,):
        return
    if part.moves or not np.linalg.det(matrix[:3, :3]):
        del part.statics["normals"]
    elif not np.array_equal(matrix[:3, :3], np.eye(3)):
        turned = normals.values @ np.linalg.inv(matrix[:3, :3]).T
        turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-30)
        part.statics["normals"] = Static(normals.domain, turned.astype(normals.values.dtype))


# ---- what exporters/alembic.py has written besides ----


def _own_properties(schema: Any) -> Any:
    properties = schema.getUserProperties()
    if not properties.valid():
        return None
    names = [properties.getPropertyHeader(i).getName() for i in range(properties.getNumProperties())]
    return properties if OWN in names else None


def _is_own(schema: Any) -> bool:
    """Whether a transform is the one above everything in a file of ours, which only turns Z up into Y up."""
    return _own_properties(schema) is not None


def _own(archive: Any) -> tuple[str | None, list[tuple[ArrayDescriptor, bytes]]]:
    """The metadata, JSON, and further arrays, that our writer has kept."""
    top = archive.getTop()
    if top.getNumChildren() != 1:
        return None, []
    child = top.getChild(0)
    if not (child.getHeader().getMetaData().get("schema") or "").startswith("AbcGeom_Xform"):
        return None, []
    properties = _own_properties(AbcGeom.IXform(child, EXISTING).getSchema())
    if properties is None:
        return None, []
    names = [properties.getPropertyHeader(i).getName() for i in range(properties.getNumProperties())]
    kept = []
    for name in names:
        if name != OWN and f"{name}.descriptor" in names:
            descriptor = _descriptor(Abc.IStringProperty(properties, f"{name}.descriptor").getValue())
            kept.append((descriptor, np.array(Abc.IUcharArrayProperty(properties, name).getValue(), np.uint8).tobytes()))
    return Abc.IStringProperty(properties, OWN).getValue(), kept


def _descriptor(text: str) -> ArrayDescriptor:
    try:
        found = ArrayDescriptor(**json.loads(text))
    except (ValueError, TypeError, RecursionError):
        return ArrayDescriptor()
    return found if all(isinstance(value, str) for value in found) else ArrayDescriptor()


def _add_kept(kept: list, attributes: dict[str, np.ndarray], domains: dict[str, str], vertices: int, skip: Any) -> None:
    for descriptor, raw in kept:
        name, domain, values = descriptor.name, descriptor.domain, descriptor.array(raw)
        if values is None or name in skip or not name or domain == "vertex" and len(values) != vertices:
            continue
        attributes[name] = values
        domains.pop(name, None)
        if domain and domain != "vertex":
            domains[name] = domain


# ---- positions ----


class _Reader:
    """Positions of all objects, frame by frame."""

    def __init__(self, source: _Archive, parts: list[_Object], times: np.ndarray):
        self._source, self._parts, self._times = source, parts, times
        self._count = sum(part.count for part in parts)

    def read(self, start: int, stop: int) -> np.ndarray:
        """(stop - start, N, 3) float32. Raises ClipError."""
        if self._source.archive is None:
            raise ClipError("positions: the clip is closed")
        out = np.empty((stop - start, self._count, 3), np.float32)
        for row, frame in enumerate(range(start, stop)):
            for part in self._parts:
                try:
                    out[row, part.first: part.first + part.count] = self._part(part, frame)
                except BROKEN as error:
                    if isinstance(error, ClipError):
                        raise
                    raise ClipError(f"positions: frame {frame} of {part.path} cannot be read: "
                                    f"{' '.join(str(error).split())}") from None
        return out

    def _part(self, part: _Object, frame: int) -> np.ndarray:
        if part.still is not None:
            return part.still
        points = _points(part, self._times[frame])
        if len(points) != part.count:
            raise ClipError(f"{part.path}: got {len(points)} points in frame {frame}, expected {part.count} as in the "
                            "first frame")
        matrix = _matrix(part, self._times[frame])
        if not np.array_equal(matrix, np.eye(4)):
            points = (points @ matrix[:3, :3] + matrix[3, :3]).astype(np.float32)
        if not next(part.tracks(), None):
            part.still = points
        return points


def _points(part: _Object, time: float) -> np.ndarray:
    found = [(np.array(part.points.getValue(part.track.sample(i)), np.float32), weight)
             for i, weight in part.track.at(time)]
    counts = {len(points) for points, _ in found}
    if len(counts) != 1:
        raise ClipError(f"{part.path}: got {max(counts)} points in a sample at {time:g} s, expected {part.count}")
    if len(found) == 1:
        return found[0][0].reshape(-1, 3)
    return sum(points.astype(np.float64) * weight for points, weight in found).astype(np.float32).reshape(-1, 3)


def _matrix(part: _Object, time: float) -> np.ndarray:
    matrix = np.eye(4)
    for xform in part.xforms:
        matrix = matrix @ xform.at(time)
    return matrix


if __name__ == "__main__":
    main()
