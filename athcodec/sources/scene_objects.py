"""Objects of a scene as runs of one clip's vertices: what readers of scene formats share.

A reader fills in a SceneObject for each, in the numbering of that object; here their faces, edges, static arrays and
positions are joined. It knows no format.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import RESERVED_NAMES, MotionClip
from athcodec.motion.frames import Frames, is_far
from athcodec.motion.presence import PRESENCE, frame_runs
from athcodec.motion.units import METRES_PER_UNIT
from athcodec.sources import ReadOptions
from athcodec.untyped import JsonObject, JsonValue

MOST_VERTICES = 1 << 27  # Largest number of vertices that copies may make.
MAX_METADATA_BYTES = 1 << 24
DESCRIPTOR = ".descriptor"  # behind the name of an array's property in an Alembic file: that of its ArrayDescriptor
FACE_MATERIAL, MATERIAL_NAMES = "face_material", "material_names"  # an attribute, and metadata
FLIPPED = "faces that turn inside out in time"  # in not_read: objects that a transform mirrors in some frames alone
CHANGING = (
    ": points that appear or vanish cannot be read; write them as copies of a mesh with ids, or read other objects "
    "with --only"
)
GUESSED = "guessed"  # In what our writers add: names of what the clip does not state, so that it is not read as stated.
SCHEME = "subdivisionScheme"  # The key of USD's word in the details of a mesh; without it the faces are the surface.
SURFACE = ("holes", "holeIndices", "creaseIndices", "cornerIndices", "interpolateBoundary")  # They shape that surface.
OWN = "athcodec"  # the namespace of what our writers add to files of other formats
SCENE_KEYS = {"unit": str, "up_axis": str, "fps": float}  # Members of the metadata that some formats have no place for.
KNOWN_METADATA = ("fps", "start_frame", METRES_PER_UNIT, "part_names", "part_kinds", "part_usd", "domains", PRESENCE)


@dataclass
class Static:
    """A named array of one object and what its rows stand for: vertex, corner, face or constant."""

    domain: str
    values: np.ndarray


@dataclass
class SceneObject:
    """One object: its kind ("mesh", "curves" or "points"), its place among the vertices, and what does not move.

    face_counts (F,), face_indices (C,), curve_counts (curves,) int32; details: words that only its format knows.
    """

    kind: str
    name: str = ""
    path: str = ""
    first: int = 0
    count: int = 0
    face_counts: np.ndarray = field(default_factory=lambda: np.empty(0, np.int32))
    face_indices: np.ndarray = field(default_factory=lambda: np.empty(0, np.int32))
    curve_counts: np.ndarray | None = None
    details: dict[str, str] = field(default_factory=dict)
    copies: int = 1  # its vertices are so many copies of one shape, one after the other
    is_rigid: bool = True  # the shape of the copies stays as it is
    left_out: list[str] = field(default_factory=list)  # names of arrays that do not fit
    statics: dict[str, Static] = field(default_factory=dict)
    materials: list[str] = field(default_factory=list)
    face_materials: np.ndarray | None = None  # (F,) the material of each face, -1 for none
    is_flipped: bool = False  # mirrored in some frames and not in others
    is_still: bool = False  # neither its points nor its place change
    still: np.ndarray | None = None  # its positions then, once they have been read
    ids: np.ndarray | None = None  # Identities of points that may stand in another order in each frame.
    shown: np.ndarray = field(default_factory=lambda: np.ones((1, 1), bool))  # (T, 1) or (T, copies): frames that do

    @property
    def vertices(self) -> slice:
        return slice(self.first, self.first + self.count)

    def rows(self, domain: str) -> int:
        sizes = {"vertex": self.count, "corner": len(self.face_indices), "face": len(self.face_counts), "constant": 1}
        return sizes[domain]

    def check(self) -> None:
        """Raise ClipError if faces or curves refer to points that do not exist, or counts do not add up."""
        corners = self.face_counts.sum(dtype=np.int64)
        if (self.face_counts < 0).any() or corners != len(self.face_indices):
            raise ClipError(
                f"{self.path}: got faces of {corners} corners, expected {len(self.face_indices)}, one per index"
            )
        bad = np.flatnonzero((self.face_indices < 0) | (self.face_indices >= self.count))
        if bad.size:
            raise ClipError(
                f"{self.path}: corner {bad[0]} is vertex {self.face_indices[bad[0]]}, expected 0 to {self.count - 1}"
            )
        points = self.count if self.curve_counts is None else self.curve_counts.sum(dtype=np.int64)
        if points != self.count or self.curve_counts is not None and (self.curve_counts < 0).any():
            raise ClipError(f"{self.path}: got curves of {points} points, expected {self.count}")

    def keep(self, name: str, domain: str | None, values: np.ndarray | None) -> None:
        """Store a static array with a row for each element of `domain`; note it as left out if rows do not fit."""
        if name in self.statics:
            return
        if values is None or domain is None or domain == "constant" and len(values) != 1:
            self.left_out.append(name)
            return
        if domain == "face" and self.curve_counts is not None and len(values) == len(self.curve_counts):
            domain, values = "vertex", np.repeat(values, self.curve_counts, axis=0)
        elif domain == "face" and self.kind == "points":
            domain = "constant"
        if len(values) == self.rows(domain):
            self.statics[name] = Static(domain, values)
        else:
            self.left_out.append(name)

    def bind(self, name: str, faces: np.ndarray | slice = slice(None)) -> None:
        """Give the material `name` to some faces of the object, or to all."""
        if name not in self.materials:
            self.materials.append(name)
        if self.face_materials is None:
            self.face_materials = np.full(len(self.face_counts), -1, np.int32)
        self.face_materials[faces] = self.materials.index(name)

    def repeat(self, copies: int) -> None:
        """Turn the object into `copies` copies of itself, one after the other; a rest pose of its own is dropped.
        Raises ClipError if these would have more vertices than a clip may have."""
        if self.count * copies > MOST_VERTICES:
            raise ClipError(
                f"{self.path}: got {copies} copies of {self.count} vertices, expected {MOST_VERTICES} at most"
            )
        shift = np.repeat(np.arange(copies, dtype=np.int32) * np.int32(self.count), len(self.face_indices))
        self.face_indices = np.tile(self.face_indices, copies) + shift
        self.face_counts = np.tile(self.face_counts, copies)
        if self.face_materials is not None:
            self.face_materials = np.tile(self.face_materials, copies)
        if self.curve_counts is not None:
            self.curve_counts = np.tile(self.curve_counts, copies)
        self.statics = {
            name: static
            if static.domain == "constant"
            else Static(static.domain, np.concatenate([static.values] * copies))
            for name, static in self.statics.items()
            if name != "rest"
        }
        self.count, self.copies = self.count * copies, copies

    def ordered(self, points: np.ndarray, ids: np.ndarray, where: str) -> np.ndarray:
        """Return the points (n, 3) with these ids in the order of `self.ids`. Raises ClipError if the ids differ."""
        assert self.ids is not None
        rows = rows_by_id(ids, self.ids)
        if not len(points) == len(ids) == len(rows) or (rows < 0).any():
            raise ClipError(
                f"{self.path}: got {len(points)} points with other ids in {where}, expected the {len(rows)} of the "
                f"first frame{CHANGING}"
            )
        return points[rows]

    def face_outward(self, matrices: Iterable[np.ndarray], is_reversed: bool) -> None:
        """Reverse the corners of faces that a transform mirrors or, with `is_reversed`, of all others, so that faces
        point outward. `matrices`: object to world in each frame, (4, 4) or (copies, 4, 4)."""
        facing = Facing()
        for matrix in matrices:
            facing.add(matrix.reshape(1, -1, 4, 4))
        self.is_flipped, turned = facing.changes, facing.mirrored ^ is_reversed
        if not turned.any():
            return
        faces = np.repeat(turned, len(self.face_counts) // len(turned))
        order = np.arange(len(self.face_indices))
        order = np.where(np.repeat(faces, self.face_counts), turned_corners(self.face_counts), order)
        self.face_indices = self.face_indices[order]
        for static in self.statics.values():
            if static.domain == "corner":
                static.values = static.values[order]

    def turn_normals(self, matrix: np.ndarray, moves: bool) -> None:
        """Turn normals to world space by `matrix` (4, 4); drop them if the object moves or the matrix is singular."""
        normals = self.statics.get("normals")
        if normals is None or normals.values.shape[1:] != (3,):
            return
        if moves or not np.linalg.det(matrix[:3, :3]):
            self.leave_out("normals")
        elif not np.array_equal(matrix[:3, :3], np.eye(3)):
            turned = normals.values @ np.linalg.inv(matrix[:3, :3]).T
            turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-30)
            self.statics["normals"] = Static(normals.domain, turned.astype(normals.values.dtype))

    def leave_out(self, name: str) -> None:
        """Remove a static array, if there is one of this name, and notes that it is left out."""
        if self.statics.pop(name, None) is not None:
            self.left_out.append(name)

    def halve_widths(self, matrix: np.ndarray) -> None:
        """Replace the widths in "radius" by radii in world space."""
        widths = self.statics.get("radius")
        if widths is not None:
            scale = 0.5 * np.cbrt(abs(np.linalg.det(matrix[:3, :3])))
            self.statics["radius"] = Static(widths.domain, (widths.values * scale).astype(widths.values.dtype))


class ArrayDescriptor(NamedTuple):
    """Description of how to make an array of its bytes again, as text that files of other formats can hold: dtype
    as NumPy writes it; shape as JSON; domain: what its rows stand for, "" for nothing."""

    name: str = ""
    dtype: str = ""
    shape: str = ""
    domain: str = ""

    @classmethod
    def of(cls, name: str, values: np.ndarray, domain: str) -> ArrayDescriptor:
        return cls(name, values.dtype.str, json.dumps(list(values.shape)), domain)

    def array(self, raw: bytes) -> np.ndarray | None:
        """Return the array; None where the bytes do not make one."""
        try:
            dtype = np.dtype(self.dtype)
            return None if dtype.hasobject else np.frombuffer(raw, dtype).reshape(json.loads(self.shape))
        except (ValueError, TypeError, RecursionError):
            return None


def clip_of_objects(
    objects: list[Any],
    frames: Frames,
    time: np.ndarray,
    metadata: JsonObject,
    kept: Iterable[tuple[ArrayDescriptor, bytes]],
    options: ReadOptions,
    **more: Any,
) -> MotionClip:
    """Return the clip of all objects, one after the other. `kept` are arrays that athcodec's own writers stored in the
    file, as (descriptor, bytes); `more` are further fields of MotionClip."""
    attributes, domains = _joined_statics(objects, options.skip)
    _add_kept(kept, attributes, domains, options.skip)
    metadata = metadata | _join_materials(objects, metadata, attributes, domains, options.skip)
    known = _fields(attributes, domains)
    rest, links = known.pop("rest", None), known.pop("edges", None)
    polygons = _faces(objects, attributes)
    metadata = metadata | _names_and_kinds(objects)
    left_out = [f"{obj.path}.{name}" for obj in objects for name in obj.left_out if name not in options.skip]
    shaping = [name for name in left_out if name.rpartition(".")[2] in SURFACE]
    kinds = {"subdivision": shaping, "attribute": [name for name in left_out if name not in shaping]}
    not_read = dict(more.pop("not_read", {}))
    for kind, names in kinds.items():
        if names:
            not_read[kind] = [*not_read.get(kind, ()), *names]
    if flipped := [obj.path for obj in objects if obj.is_flipped]:
        not_read[FLIPPED] = flipped
    return MotionClip(
        frames,
        time,
        not_read=not_read,
        **options.rest_fields(rest),
        edges=_edges(objects) if links is None else links,
        faces=polygons,
        attributes=attributes,
        metadata=metadata
        | presence_metadata(metadata["part_names"], [obj.shown for obj in objects])
        | {"domains": domains},
        **known,
        **more,
    )


def frames_of_objects(
    objects: Sequence[Any],
    frame_count: int,
    sample: Callable[[Any, int], tuple[np.ndarray, np.ndarray]],
    frame_name: Callable[[int], str] = "frame {}".format,
    context: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Frames:
    """Return the positions of all objects in world space, read when frames are sliced: float32, or float64 if
    transforms of the first frame place them far from the origin.

    sample(object, frame) returns the object's points (n, 3) and the matrix (4, 4), for row vectors, from them to the
    world; for copies of an object it returns the points of one copy and matrices (copies, 4, 4).
    frame_name(frame) is how errors name a frame; frames are read inside `context()`.
    """
    count = sum(obj.count for obj in objects)

    def positions(obj: Any, frame: int) -> np.ndarray:
        if obj.still is not None:
            return obj.still
        points, matrix = sample(obj, frame)
        if len(points) * obj.copies != obj.count:
            raise ClipError(
                f"{obj.path}: got {len(points)} points in {frame_name(frame)}, expected {obj.count // obj.copies} as "
                f"in the first frame{CHANGING if obj.kind == 'points' else ''}"
            )
        points = transformed(points, matrix)
        if obj.is_still:
            obj.still = points
        return points

    with context():
        first = [positions(obj, 0) for obj in objects]
    dtype = np.dtype(np.result_type(*first) if is_far(np.concatenate(first)) else np.float32)
    for obj in objects:
        obj.still = None if obj.still is None else obj.still.astype(dtype)

    def read(start: int, stop: int) -> np.ndarray:
        out = np.empty((stop - start, count, 3), dtype)
        with context():
            for row, frame in enumerate(range(start, stop)):
                for obj in objects:
                    out[row, obj.vertices] = positions(obj, frame)
        return out

    return Frames(read, frame_count, count, dtype)


def transformed(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return (n, 3) points by a (4, 4) matrix for row vectors, as float64; by (k, 4, 4) k times, one after the other.
    Points that stay keep their type."""
    if matrix.ndim == 3:
        return (points @ matrix[:, :3, :3] + matrix[:, 3:, :3]).reshape(-1, 3)
    if np.array_equal(matrix, np.eye(4)):
        return points
    return points @ matrix[:3, :3] + matrix[3, :3]


def _add_kept(
    kept: Iterable[tuple[ArrayDescriptor, bytes]],
    attributes: dict[str, np.ndarray],
    domains: dict[str, str],
    skip: Collection[str],
) -> None:
    """Add to `attributes` and `domains` the arrays that athcodec's own writers stored (`kept`), except those in `skip`
    and those whose names are taken."""
    vertices = int(attributes["part_vertex_counts"].sum(dtype=np.int64))
    for descriptor, raw in kept:
        name, domain, values = descriptor.name, descriptor.domain, descriptor.array(raw)
        if values is None or not name or name in skip or name in attributes:
            continue
        if domain == "vertex" and len(values) != vertices:
            continue
        attributes[name] = values
        if domain and domain != "vertex":
            domains[name] = domain


def _names_and_kinds(objects: Sequence[SceneObject]) -> JsonObject:
    """Return metadata of the objects: names, or paths if two names are equal, kinds, and further details."""
    names = [obj.name for obj in objects]
    unique = len(set(names)) == len(names)
    metadata = {
        "part_names": names if unique else [obj.path for obj in objects],
        "part_kinds": [obj.kind for obj in objects],
    }
    return metadata | ({"part_usd": [obj.details for obj in objects]} if any(obj.details for obj in objects) else {})


def presence_metadata(names: Sequence[str], presence: Sequence[np.ndarray]) -> JsonObject:
    """Return as metadata which frames show each object, or copy of it, that is hidden in some frame. `presence` has for
    each object whether a frame shows it: bool, (T, 1), or (T, copies)."""
    stated = {}
    for name, shown in zip(names, presence):
        if (shown == shown[:, :1]).all():
            shown = shown[:, :1]
        for copy in np.flatnonzero(~shown.all(axis=0)).tolist():
            stated[name if shown.shape[1] == 1 else f"{name}:{copy}"] = frame_runs(shown[:, copy])
    return {PRESENCE: stated} if stated else {}


class Facing:
    """Whether a transform turns a mesh, or copies of one, inside out, and whether that changes in the frames added.

    The first frame that has an extent decides, because leaves may grow from a scale of 0.
    """

    def __init__(self) -> None:
        self._signs, self.changes = np.zeros(1), False

    def add(self, matrices: np.ndarray) -> None:
        """Note which copies further frames mirror. matrices: (frames, copies, 4, 4) to the world."""
        signs = np.nan_to_num(np.sign(np.linalg.det(matrices[..., :3, :3])))
        signs = np.concatenate([np.broadcast_to(self._signs, (1, signs.shape[1])), signs])
        self._signs = signs[(signs != 0).argmax(axis=0), np.arange(signs.shape[1])]
        self.changes |= bool((signs * self._signs < 0).any())

    @property
    def mirrored(self) -> np.ndarray:
        """(copies,) bool: whether each copy is mirrored in the first frame that tells."""
        return self._signs < 0


def rows_by_id(ids: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the row of each wanted id, (k,) among `ids` (n,); -1 for one that is not there."""
    order = np.argsort(ids, kind="stable")
    places = np.minimum(np.searchsorted(ids[order], wanted), max(len(ids) - 1, 0))
    return np.where(ids[order][places] == wanted, order[places], -1) if len(ids) else np.full(len(wanted), -1)


def _joined_statics(objects: list[SceneObject], skip: Collection[str]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return (attributes, domains): the static arrays of all objects joined by name, and what the rows of each stand
    for unless these are vertices."""
    attributes, domains = {}, {}
    for name in dict.fromkeys(name for obj in objects for name in obj.statics):
        if name in skip:
            continue
        array = _joined_static(name, objects)
        if array is None:
            for obj in objects:
                obj.left_out += [name] * (name in obj.statics)
            continue
        attributes[name] = array.values
        if array.domain != "vertex":
            domains[name] = array.domain
    attributes["part_vertex_counts"] = np.array([obj.count for obj in objects], np.int32)
    domains["part_vertex_counts"] = "constant"
    if any(obj.copies > 1 for obj in objects):
        attributes["part_copies"] = np.array([obj.copies if obj.is_rigid else 1 for obj in objects], np.int32)
        domains["part_copies"] = "constant"
    if any(obj.curve_counts is not None for obj in objects):
        attributes["curve_vertex_counts"] = np.concatenate(
            [obj.curve_counts for obj in objects if obj.curve_counts is not None]
        )
        domains["curve_vertex_counts"] = "constant"
    return attributes, domains


def _joined_static(name: str, objects: list[SceneObject]) -> Static | None:
    """Return the objects' arrays `name` as one, with zeros for objects without it, or None if their shapes differ."""
    statics = [obj.statics[name] for obj in objects if name in obj.statics]
    shapes = {static.values.shape[1:] for static in statics}
    if len(shapes) != 1:
        return None
    domain = _common_domain(statics, len(objects))
    dtypes = {static.values.dtype for static in statics}
    dtype = dtypes.pop() if len(dtypes) == 1 else np.result_type(*dtypes)
    if domain == "constant":
        return Static(domain, statics[0].values.astype(dtype, copy=False))
    rows = [_spread(obj, obj.statics.get(name), domain, next(iter(shapes))) for obj in objects]
    return Static(domain, np.concatenate(rows).astype(dtype, copy=False))


def _common_domain(statics: list[Static], object_count: int) -> str:
    """Return what rows of a joined array stand for, "constant", "vertex", "face" or "corner", to fit those of all
    objects."""
    domains = {static.domain for static in statics}
    if domains == {"constant"}:
        same = all(np.array_equal(static.values, statics[0].values) for static in statics)
        return "constant" if same and len(statics) == object_count else "vertex"
    domains.discard("constant")
    return domains.pop() if len(domains) == 1 else "corner"


def _spread(obj: SceneObject, static: Static | None, domain: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return an object's array with a row for each element of `domain`; zeros of `shape` if `static` is None."""
    if static is None:
        return np.zeros((obj.rows(domain), *shape), np.uint8)
    if static.domain == domain:
        return static.values
    if static.domain == "constant":
        return np.repeat(static.values, obj.rows(domain), axis=0)
    if static.domain == "vertex":
        return static.values[obj.face_indices]
    return np.repeat(static.values, obj.face_counts, axis=0)


def scene_of_json(text: str | bytes) -> JsonObject:
    """Return what athcodec's own writers stored as JSON in a file (names, materials ...); {} for any other text."""
    with suppress(ValueError, RecursionError):
        entries = json.loads(text)
        if isinstance(entries, dict):
            return {
                key: entries[key] for key in (*SCENE_KEYS, MATERIAL_NAMES, FACE_MATERIAL, "objects") if key in entries
            }
    return {}


def scene_fields(entries: JsonObject, count: int) -> tuple[JsonObject, dict[str, np.ndarray]]:
    """Return (metadata, attributes) of a clip of `count` vertices; objects where they fit its vertices, names where
    they are some."""
    metadata = {key: value for key, value in entries.items() if key not in ("objects", MATERIAL_NAMES, FACE_MATERIAL)}
    metadata = {key: value for key, value in metadata.items() if isinstance(value, SCENE_KEYS.get(key, object))}
    if _are_names(entries.get(MATERIAL_NAMES)):
        metadata[MATERIAL_NAMES] = entries[MATERIAL_NAMES]
    objects, numbers = _object_fields(entries.get("objects"), count)
    return metadata | objects, numbers


def _object_fields(entries: Any, count: int) -> tuple[JsonObject, dict[str, np.ndarray]]:
    """Return (metadata, attributes) of objects as athcodec's own writers stated them in a file. Both are empty if the
    entries are broken or do not add up to `count` vertices."""
    entries = entries if isinstance(entries, dict) else {}
    names, numbers = entries.get("names"), {key: entries.get(key) for key in ("vertices", "copies") if key in entries}
    fits = all(
        isinstance(each, list) and all(type(n) is int and 0 <= n <= count for n in each) for each in numbers.values()
    )
    if not _are_names(names) or not fits or sum(numbers.get("vertices", ())) != count:
        return {}, {}
    if {len(each) for each in numbers.values()} != {len(names)}:
        return {}, {}
    kinds = entries.get("kinds")
    metadata = {"part_names": names} | ({"part_kinds": kinds} if _are_names(kinds) and len(kinds) == len(names) else {})
    keys = {"vertices": "part_vertex_counts", "copies": "part_copies"}
    return metadata, {keys[key]: np.array(each, np.int32) for key, each in numbers.items()}


def _are_names(value: JsonValue) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) for name in value)


def _join_materials(
    objects: list[SceneObject],
    metadata: JsonObject,
    attributes: dict[str, np.ndarray],
    domains: dict[str, str],
    skip: Collection[str],
) -> JsonObject:
    """Add "face_material", the number of each face's material or -1, to `attributes`, and return the metadata
    "material_names". Names that `metadata` states come first."""
    if FACE_MATERIAL in skip or all(obj.face_materials is None for obj in objects):
        return {}
    stated = metadata.get(MATERIAL_NAMES)
    stated = stated if isinstance(stated, list) and all(isinstance(name, str) for name in stated) else []
    names = list(dict.fromkeys([*stated, *(name for obj in objects for name in obj.materials)]))
    rows = []
    for obj in objects:
        place = np.array([*(names.index(name) for name in obj.materials), -1], np.int32)
        labels_of_object = np.full(len(obj.face_counts), -1) if obj.face_materials is None else obj.face_materials
        rows.append(place[labels_of_object])
    attributes[FACE_MATERIAL], domains[FACE_MATERIAL] = np.concatenate(rows), "face"
    return {MATERIAL_NAMES: names}


def _faces(objects: list[SceneObject], attributes: dict[str, np.ndarray]) -> np.ndarray | None:
    """Return the faces (F, k), or None if there are none or if sizes differ; these are put into `attributes`."""
    counts = np.concatenate([obj.face_counts for obj in objects])
    if not len(counts):
        return None
    indices = np.concatenate([obj.face_indices + np.int32(obj.first) for obj in objects])
    if counts.min() == counts.max() > 0:
        return indices.reshape(-1, counts[0])
    attributes |= {"face_vertex_counts": counts, "face_vertex_indices": indices}
    return None


def _edges(objects: list[SceneObject]) -> np.ndarray | None:
    """Return the edges (E, 2) between neighbouring points of each curve, int32; periodic curves are closed."""
    edges = []
    for obj in objects:
        if obj.curve_counts is None or not obj.count:
            continue
        counts = obj.curve_counts[obj.curve_counts > 0].astype(np.int64)
        ends = np.cumsum(counts)
        vertices = np.arange(obj.count)
        following = vertices + 1
        keep = np.ones(obj.count, bool)
        if obj.details.get("wrap") == "periodic":
            following[ends - 1] = ends - counts
            keep[ends - 1] = counts > 2
        else:
            keep[ends - 1] = False
        edges.append(np.stack([vertices, following], axis=1)[keep] + obj.first)
    return np.concatenate(edges).astype(np.int32) if edges else None


def _fields(attributes: dict[str, np.ndarray], domains: dict[str, str]) -> JsonObject:
    """Move the arrays that are fields of a MotionClip from `attributes` to the result; rename others so called."""
    fields = {}
    vertices = int(attributes["part_vertex_counts"].sum(dtype=np.int64))
    rest, edges = attributes.get("rest"), attributes.get("edges")
    if rest is not None and rest.shape == (vertices, 3) and rest.dtype.kind == "f" and "rest" not in domains:
        fields["rest"] = attributes.pop("rest")
    if edges is not None and edges.ndim == 2 and edges.shape[1] == 2 and edges.dtype.kind in "iu":
        fields["edges"] = attributes.pop("edges")
    if "vertex_branch" in attributes and "branch_parent" in attributes:
        for name in ("vertex_branch", "branch_parent", "stem_index"):
            if name in attributes:
                fields[name] = attributes.pop(name)
    for name in [name for name in attributes if name in RESERVED_NAMES]:
        attributes[f"{name}_primvar"] = attributes.pop(name)
        if name in domains:
            domains[f"{name}_primvar"] = domains.pop(name)
    for name in fields:
        domains.pop(name, None)
    return fields


def own_metadata(text: Any) -> JsonObject:
    """Return further metadata that athcodec's own writer stored as JSON `text`; {} if it is anything else."""
    if not isinstance(text, str) or len(text) > MAX_METADATA_BYTES:
        return {}
    try:
        metadata = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    metadata = metadata if isinstance(metadata, dict) else {}
    return {name: value for name, value in metadata.items() if name not in KNOWN_METADATA}


def turned_corners(counts: np.ndarray) -> np.ndarray:
    """Return (C,) the corners of each face from the last to the first."""
    counts = np.asarray(counts, np.int64)
    ends = np.cumsum(counts)
    return np.repeat(2 * ends - counts - 1, counts) - np.arange(int(ends[-1]) if len(ends) else 0)
