"""Writes Alembic (Ogawa): one mesh, curves or points object per object of a clip, its points sample by sample.

Faces and static arrays are written once, materials' names as those of face sets; samples go to disk as they come.
Points are float32, a clip in float64 is rounded; a further transform places one that is far from the origin. Copies of
one shape become instances if options.instances asks for it. Everything lies below one transform, which turns a clip
whose Z is up to Alembic's custom, Y up, and keeps what Alembic has no place for (unit, branches, bytes);
sources/alembic_archive.py takes it back from there. See alembic.py for who runs it.
"""

from __future__ import annotations

import gc
import json
import pickle
import re
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import BinaryIO, Protocol

import imath
import numpy as np
from alembic3d import Abc, AbcCoreAbstract, AbcGeom

from athcodec.exporters.copies import Copies, one_copy, rows_of_one
from athcodec.exporters.samples import Sample
from athcodec.exporters.scene_objects import (
    DOMAINS,
    KNOWN_ATTRIBUTES,
    KNOWN_METADATA,
    SceneObject,
    distinct,
    domain_of,
    face_materials,
    material_runs,
    objects_of,
    own_arrays,
    rows_of,
)
from athcodec.exporters.timing import distinct_frame_numbers, frame_rate_of
from athcodec.motion.protocol import Motion
from athcodec.motion.quaternions import rotation_matrices
from athcodec.sources.alembic_archive import BASES
from athcodec.sources.scene_objects import DESCRIPTOR, FACE_MATERIAL, OWN, turned_corners
from athcodec.untyped import AlembicObject, JsonObject

SCOPES = {
    "vertex": AbcGeom.GeometryScope.kVertexScope,
    "corner": AbcGeom.GeometryScope.kFacevaryingScope,
    "face": AbcGeom.GeometryScope.kUniformScope,
    "constant": AbcGeom.GeometryScope.kConstantScope,
}
# By dtype and shape of a row: the array that holds it and the parameter that writes it.
TYPES = {
    ("f4", ()): (imath.FloatArray, "Float"),
    ("f8", ()): (imath.DoubleArray, "Double"),
    ("i4", ()): (imath.IntArray, "Int32"),
    ("u1", ()): (imath.UnsignedCharArray, "Uchar"),
    ("f4", (2,)): (imath.V2fArray, "V2f"),
    ("f4", (3,)): (imath.V3fArray, "V3f"),
    ("f8", (3,)): (imath.V3dArray, "V3d"),
}
KINDS = {"mesh": AbcGeom.OPolyMesh, "curves": AbcGeom.OCurves, "points": AbcGeom.OPoints}
Z_UP = ((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1))  # row vectors

Statics = dict[str, tuple[np.ndarray, str]]  # Arrays that do not move, with their domains.


class Placed(Motion, Protocol):
    """A motion that stands about `place` (3,); None: about the origin."""

    place: list[float] | None


def main() -> None:
    """Read a clip without its motion, and its instances, as a pickle from standard input, and then its frames as
    pickles. Write them as Alembic to the path on the command line, and print "done" or what went wrong.
    """
    pipe = sys.stdin.buffer
    motion, instanced = pickle.load(pipe)
    try:
        _write(motion, _samples(pipe), instanced, sys.argv[1])
        gc.collect()  # an archive is complete when nothing refers to it
        answer = "done"
    except (RuntimeError, TypeError, OSError) as error:
        answer = " ".join(str(error).split()) or type(error).__name__
    print(answer, end="")


def _samples(pipe: BinaryIO) -> Iterator[Sample]:
    """Yield frames as exporters.samples gives them."""
    with suppress(EOFError):
        while True:
            yield pickle.load(pipe)


def _write(motion: Placed, samples: Iterator[Sample], instanced: dict[int, Copies], name: str) -> None:
    """Write an Alembic archive to the path `name`. `samples` yields the positions of each frame, with velocities where
    there are any, and `instanced` has the copies of objects by the objects' numbers.
    """
    numbers, rate = distinct_frame_numbers(motion), frame_rate_of(motion)
    archive = Abc.CreateArchiveWithInfo(name, rate, "athcodec", "plant motion")
    index = archive.addTimeSampling(_sampling(numbers, rate))
    sampling = Abc.Argument(index)
    root = AbcGeom.OXform(archive.getTop(), "clip")
    if str(motion.metadata.get("up_axis", "y")).lower() == "z":
        turn = AbcGeom.XformSample()
        turn.setMatrix(imath.M44d(*(float(number) for row in Z_UP for number in row)))
        root.getSchema().set(turn)
    objects = objects_of(motion)
    for number, obj in enumerate(objects):
        obj.copies = obj.copies if number in instanced else 1
    statics, left = _divide(motion, objects)
    _keep_own(root.getSchema().getUserProperties(), motion, left)
    if motion.place:
        root, place = AbcGeom.OXform(root, "place"), AbcGeom.XformSample()
        place.setTranslation(imath.V3d(*motion.place))
        root.getSchema().set(place)
    names = distinct(re.sub(r"[/\0]", "_", obj.name.strip("/")) or "part" for obj in objects)
    for number, (obj, name) in enumerate(zip(objects, names)):
        if number in instanced:
            places = _add_instanced(root, name, obj, instanced[number], statics, sampling)
        else:
            places = [AbcGeom.OXform(root, name)]  # programs expect a transform of its own
            obj.target = KINDS[obj.kind](places[0], name, sampling)
        _hide(places, obj, index)
    _bind_materials(motion, objects)
    for frame, *values in samples:
        for obj in objects:
            if obj.copies == 1:
                _add(obj, [each[obj.vertices] for each in values], _rows(statics, obj) if frame == 0 else None)


def _sampling(numbers: np.ndarray, rate: float) -> AlembicObject:
    """Return Alembic's time sampling for frames with the given numbers at `rate` frames per second: uniform if the
    numbers are consecutive, else with a time for each frame.
    """
    steps = np.diff(numbers)
    if np.allclose(steps, 1.0, rtol=0, atol=1e-5):
        return AbcCoreAbstract.TimeSampling(1.0 / rate, float(numbers[0]) / rate)
    times = AbcCoreAbstract.TimeVector()
    times.extend([float(number) / rate for number in numbers])
    acyclic = AbcCoreAbstract.TimeSamplingType(AbcCoreAbstract.AcyclicFlag.kAcyclic)
    return AbcCoreAbstract.TimeSampling(acyclic, times)


def _hide(places: list[AlembicObject], obj: SceneObject, sampling: int) -> None:
    """Write in which frames an object, or each of its copies, is visible, to the transforms `places` above it."""
    if obj.shown is None or obj.shown.shape[1] > len(places):
        return
    for place, shown in zip(places, np.broadcast_to(obj.shown, (len(obj.shown), len(places))).T):
        if not shown.all():
            visibility = AbcGeom.CreateVisibilityProperty(place, sampling)
            for value in shown:
                visibility.setValue(int(value))


def _add_instanced(
    root: AlembicObject, name: str, obj: SceneObject, copies: Copies, statics: Statics, sampling: AlembicObject
) -> list[AlembicObject]:
    """Write the shape of an object below the transform of its first copy, and an instance of it below the transform of
    each other copy. Return all these transforms.
    """
    matrices = np.tile(np.eye(4), (*copies.places.shape[:2], 1, 1))  # Matrices act on row vectors.
    linear = rotation_matrices(copies.turns.astype(np.float64)) * copies.scales[:, :, None, :]
    matrices[..., :3, :3], matrices[..., 3, :3] = linear.swapaxes(2, 3), copies.places
    places = [AbcGeom.OXform(root, f"{name}_{number}", sampling) for number in range(obj.copies)]
    for place, track in zip(places, matrices.swapaxes(0, 1)):
        for matrix in track:
            sample = AbcGeom.XformSample()
            sample.setMatrix(imath.M44d(*matrix.reshape(-1).tolist()))
            place.getSchema().set(sample)
    one = one_copy(obj)
    obj.target = one.target = KINDS[obj.kind](places[0], name)
    arrays = {}
    for key, (values, domain) in _rows(statics, obj).items():
        rows = values if domain == "constant" else rows_of_one(values, obj)
        assert rows is not None  # `_divide` leaves out what copies do not share.
        arrays[key] = rows, domain
    _add(one, [copies.shape], arrays)
    for place in places[1:]:
        place.addChildInstance(one.target, name)
    return places


def _bind_materials(motion: Motion, objects: list[SceneObject]) -> None:
    """Write materials by their names alone, each as the set of the faces that have it."""
    labels, names = face_materials(motion) or (np.empty(0), [])
    sets = distinct(re.sub(r"[/\0]", "_", name) or "material" for name in names)
    for obj in objects if sets else ():
        if obj.kind != "mesh":
            continue
        face_labels = rows_of_one(labels[obj.face_rows], obj) if obj.copies > 1 else labels[obj.face_rows]
        assert face_labels is not None  # The copies of an instanced object have the same materials.
        for label, faces in material_runs(face_labels, names):
            held = _filled(imath.IntArray, faces)
            face_set = obj.target.getSchema().createFaceSet(sets[label])
            face_set.getSchema().set(AbcGeom.OFaceSetSchemaSample(held))


def _rows(statics: Statics, obj: SceneObject) -> Statics:
    return {name: (rows_of(values, domain, obj), domain) for name, (values, domain) in statics.items()}


def _filled(kind: AlembicObject, values: np.ndarray) -> AlembicObject:
    array = kind(len(values))
    if len(values):
        np.asarray(memoryview(array))[...] = values
    return array


# ---- samples ----


def _add(obj: SceneObject, values: list[np.ndarray], arrays: Statics | None) -> None:
    """Write one sample of an object: `values` has its points, and its velocities if there are any. The first sample
    also brings the static arrays, of which the object's rows are taken.
    """
    points, *moving = (_filled(imath.V3fArray, each) for each in values)
    schema = obj.target.getSchema()

    def set_sample(sample: AlembicObject) -> None:
        for velocities in moving:
            sample.setVelocities(velocities)
        schema.set(sample)

    if arrays is None:
        kinds = {
            "mesh": AbcGeom.OPolyMeshSchemaSample,
            "curves": AbcGeom.OCurvesSchemaSample,
            "points": AbcGeom.OPointsSchemaSample,
        }
        set_sample(kinds[obj.kind](points))
        return
    order = turned_corners(obj.faces[0])
    arrays = {name: (rows[order] if domain == "corner" else rows, domain) for name, (rows, domain) in arrays.items()}
    # samples refer to arrays that somebody has to keep until they are written
    held = {
        "points": points,
        "ids": _filled(imath.IntArray, np.arange(obj.count)),
        "counts": _filled(imath.IntArray, obj.faces[0]),
        "curves": _filled(imath.IntArray, obj.curves),
        "indices": _filled(imath.IntArray, obj.faces[1][order]),
    }
    set_sample({"mesh": _mesh_sample, "curves": _curve_sample, "points": _point_sample}[obj.kind](obj, held, arrays))
    for name, (rows, domain) in arrays.items():
        if len(rows) and (domain in ("vertex", "constant") or obj.kind == "mesh"):
            _write_param(schema.getArbGeomParams(), name, rows, domain)


def _mesh_sample(obj: SceneObject, held: dict[str, AlembicObject], arrays: Statics) -> AlembicObject:
    """Return the first sample of a mesh, with the texture coordinates and normals of `arrays`, which are removed
    there.
    """
    further = {}
    for name, row, array, keyword, kind in (
        ("uv", (2,), imath.V2fArray, "iUVs", AbcGeom.OV2fGeomParamSample),
        ("normals", (3,), imath.V3fArray, "iNormals", AbcGeom.ON3fGeomParamSample),
    ):
        values, domain = arrays.get(name, (None, ""))
        if values is not None and values.shape[1:] == row and values.dtype == np.float32:
            del arrays[name]
            held[name] = _filled(array, values)
            further[keyword] = kind(held[name], SCOPES[domain])
    return AbcGeom.OPolyMeshSchemaSample(held["points"], held["indices"], held["counts"], **further)


def _curve_sample(obj: SceneObject, held: dict[str, AlembicObject], arrays: Statics) -> AlembicObject:
    """Return the first sample of an object of curves, with their type, basis and wrap, and the widths of `arrays`."""
    is_cubic = obj.details.get("type") == "cubic"
    kind = AbcGeom.CurveType.kCubic if is_cubic else AbcGeom.CurveType.kLinear
    bases = {name: each for each, name in BASES.items()}
    basis = bases.get(obj.details.get("basis", ""), AbcGeom.BasisType.kBsplineBasis)
    basis = basis if is_cubic else AbcGeom.BasisType.kNoBasis
    is_closed = obj.details.get("wrap") == "periodic"
    wrap = AbcGeom.CurvePeriodicity.kPeriodic if is_closed else AbcGeom.CurvePeriodicity.kNonPeriodic
    return AbcGeom.OCurvesSchemaSample(
        held["points"], held["curves"], iType=kind, iWrap=wrap, iBasis=basis, **_widths(held, arrays, "iWidth")
    )


def _point_sample(obj: SceneObject, held: dict[str, AlembicObject], arrays: Statics) -> AlembicObject:
    return AbcGeom.OPointsSchemaSample(held["points"], held["ids"], **_widths(held, arrays, "iWidths"))


def _widths(held: dict[str, AlembicObject], arrays: Statics, name: str) -> JsonObject:
    radius, domain = arrays.get("radius", (None, ""))
    if radius is None or radius.dtype != np.float32 or radius.ndim != 1:
        return {}
    del arrays["radius"]
    held["widths"] = _filled(imath.FloatArray, 2 * radius)
    return {name: AbcGeom.OFloatGeomParamSample(held["widths"], SCOPES[domain])}


# ---- static arrays ----


def _divide(motion: Motion, objects: list[SceneObject]) -> tuple[Statics, Statics]:
    """Return two mappings of static arrays, each with its domain: those that Alembic has a type and place for, and the
    others. An array of copies is kept only if all copies share its values.
    """
    fitting: Statics = {}
    left: Statics = {}
    for name, values in motion.attributes.items():
        if name in KNOWN_ATTRIBUTES or name == FACE_MATERIAL and face_materials(motion):
            continue
        domain = domain_of(motion, name, values, motion.metadata.get("domains", {}))
        key = values.dtype.str[1:], values.shape[1:]
        fits = domain in DOMAINS and key in TYPES and values.dtype.isnative and "/" not in name and len(values)
        fits = fits and (
            domain == "constant"
            or all(rows_of_one(rows_of(values, domain, obj), obj) is not None for obj in objects if obj.copies > 1)
        )
        (fitting if fits else left)[name] = values, domain
    return fitting, left


def _write_param(params: AlembicObject, name: str, values: np.ndarray, domain: str) -> None:
    array, kind = TYPES[values.dtype.str[1:], values.shape[1:]]
    scope = SCOPES[domain]
    param = getattr(AbcGeom, f"O{kind}GeomParam")(params, name, False, scope, 1)
    held = _filled(array, values)
    param.set(getattr(AbcGeom, f"O{kind}GeomParamSample")(held, scope))


def _keep_own(properties: AlembicObject, motion: Motion, left: Statics) -> None:
    """Write the metadata and arrays that Alembic has no place for as properties that athcodec reads again."""
    kept = {key: value for key, value in motion.metadata.items() if key not in KNOWN_METADATA}
    Abc.OStringProperty(properties, OWN).setValue(json.dumps(kept))
    for i, (descriptor, raw) in enumerate(own_arrays(motion, left)):
        Abc.OUcharArrayProperty(properties, f"array{i}").setValue(_filled(imath.UnsignedCharArray, raw))
        Abc.OStringProperty(properties, f"array{i}{DESCRIPTOR}").setValue(json.dumps(descriptor._asdict()))


if __name__ == "__main__":
    main()
