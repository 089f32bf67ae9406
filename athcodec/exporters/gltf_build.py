"""The pieces of a GLB file: its structure, its binary chunk, and the objects of a clip as meshes.

Polygons are drawn as triangles (which polygon a triangle came from is not kept), edges as lines where an object has no
faces, vertices as points where it has neither. Vertices keep their order; one whose corners have different texture
coordinates, normals or colours is written once more behind the others of its object. What a vertex of glTF cannot
have (rows per face or branch, numbers that float32 does not hold) is left out and named. Each primitive has a material
(looks.py), and faces have normals, the clip's or those of its rest pose. What is guessed of a material stands in its
extras, as names of its members: {"athcodec": {"guessed": ["name"]}}. See gltf.py for motion.
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from athcodec import __version__
from athcodec.errors import ClipError
from athcodec.exporters.looks import Look, Looks, line_look
from athcodec.exporters.placing import origin_of
from athcodec.exporters.scene_objects import face_materials
from athcodec.exporters.timing import start_frame_of
from athcodec.motion.clip import ClipRange, median_rate, stated_fps
from athcodec.motion.joining import metadata_of
from athcodec.motion.protocol import Motion
from athcodec.motion.units import metres_of
from athcodec.sources.scene_objects import FACE_MATERIAL, GUESSED, OWN
from athcodec.sources.timing import whole
from athcodec.untyped import JsonMapping, JsonObject

COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
VERTICES, INDICES = 34962, 34963
LARGEST_GLB = 2**32 - 1
ROUGHNESS = 0.8  # of all materials that are made here, none of which is of metal
UNLIT = "KHR_materials_unlit"
UNKNOWN_BOUND = -1.2345678901234567e-300  # as long in JSON as a number gets
HALF = float(np.sqrt(0.5))
TURNS = {"y": None, "z": [-HALF, 0.0, 0.0, HALF], "x": [0.0, 0.0, HALF, HALF]}
NOT_PER_VERTEX = ("part_vertex_counts", "face_vertex_counts", "face_vertex_indices")
COLOUR, NORMAL = "COLOR_0", "NORMAL"
MEMBERS = {"name": "name", "colour": "pbrMetallicRoughness", "is_two_sided": "doubleSided"}  # of materials, by Look's
SEMANTICS = {"uv": ("TEXCOORD_0", (2,)), "normals": (NORMAL, (3,)), "colors": (COLOUR, (3, 4))}


class Glb:
    """A file that is being made: `json` is its structure, arrays are added to its binary chunk."""

    def __init__(self, extras: JsonMapping):
        """Begin a GLB with an empty scene; `extras` are stored in its asset."""
        self.json: JsonObject = {
            "asset": {"version": "2.0", "generator": f"athcodec {__version__}", "extras": dict(extras)},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }
        self._pieces: list[bytes | memoryview] = []
        self._length = 0

    def node(self, parent: int | None = None, **values: Any) -> int:
        """Add a node below the node `parent`, or to the scene without one, and return its number. `values` are the
        node's members.
        """
        self.json["nodes"].append(values)
        index = len(self.json["nodes"]) - 1
        above = (
            self.json["scenes"][0]["nodes"]
            if parent is None
            else (self.json["nodes"][parent].setdefault("children", []))
        )
        above.append(index)
        return index

    def view(self, size: int, **values: Any) -> int:
        """Return a buffer view of the next `size` bytes of the binary chunk."""
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": self._length, "byteLength": size} | values)
        self._length += size
        if self._length > LARGEST_GLB:
            raise ClipError(f"GLB: got {self._length} bytes, expected less than 4 GiB: choose fewer frames or levels")
        return len(self.json["bufferViews"]) - 1

    def accessor(self, view: int, dtype: np.dtype, count: int, width: int, **values: Any) -> int:
        """Return the number of a new accessor of (count, width) values in a buffer view; values: further entries."""
        kind = {"bufferView": view, "componentType": COMPONENTS[dtype.name], "count": count, "type": TYPES[width]}
        self.json["accessors"].append(kind | values)
        return len(self.json["accessors"]) - 1

    def array(self, values: np.ndarray, bounds: bool = False, normalized: bool = False, **view: Any) -> int:
        """Store values (count, width) with an accessor of their own and return the accessor's number. Values of
        vertices are padded to whole words of four bytes.
        """
        values = np.ascontiguousarray(values.reshape(len(values), -1))
        more: JsonObject = {"normalized": True} if normalized else {}
        if bounds:
            more |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        count, width = values.shape
        item = values.itemsize * width
        if view.get("target") == VERTICES and item % 4:
            padded = np.zeros((count, item + -item % 4), np.uint8)
            padded[:, :item] = values.view(np.uint8).reshape(count, item)
            data, view = padded.tobytes(), view | {"byteStride": padded.shape[1]}
        else:
            data = values.tobytes()
        index = self.view(len(data), **view)
        self._append(data)
        return self.accessor(index, values.dtype, count, width, **more)

    def stored(self, values: np.ndarray) -> int:
        """Return a buffer view of an array, for accessors of its parts."""
        index = self.view(values.nbytes)
        self._append(values.tobytes())
        return index

    def _append(self, data: bytes) -> None:
        padding = bytes(-len(data) % 4)
        self._pieces.append(data + padding)
        self._length += len(padding)

    def write(self, out: BinaryIO, later: Iterable[bytes] = ()) -> None:
        """Write the whole file. `later` yields the bytes of the views that were made last, in whole words. While it
        does, bounds of accessors that are UNKNOWN_BOUND may still be filled in.
        """
        self.json["buffers"] = [{"byteLength": self._length}]
        room = len(self._text())
        room += -room % 4
        if 28 + room + self._length > LARGEST_GLB:
            raise ClipError(f"GLB: got {room + self._length} bytes, expected less than 4 GiB: choose fewer frames")
        out.write(struct.pack("<4sII", b"glTF", 2, 28 + room + self._length))
        out.write(struct.pack("<II", room, 0x4E4F534A))
        place = out.tell()
        out.write(bytes(room))
        out.write(struct.pack("<II", self._length, 0x004E4942))
        for piece in self._pieces:
            out.write(piece)
        for piece in later:
            out.write(piece)
        out.seek(place)
        out.write(self._text().ljust(room))

    def _text(self) -> bytes:
        return json.dumps(
            {key: value for key, value in self.json.items() if value or key == "scene"},
            separators=(",", ":"),
            allow_nan=False,
        ).encode()


@dataclass(frozen=True, eq=False)
class GltfMesh:
    """One object: source (n,) the clip's vertices that it shows, corners (F, 3) or (E, 2) of them, or None for points;
    the material of each row of these, or (1,) of the points; attributes by their semantic, (n, width)."""

    name: str
    source: np.ndarray
    corners: np.ndarray | None
    materials: np.ndarray
    attributes: dict[str, np.ndarray]

    @property
    def has_faces(self) -> bool:
        return self.corners is not None and self.corners.shape[1] == 3


@dataclass(frozen=True, eq=False)
class GltfMeshes:
    """The objects of a clip, the materials that they number, the names of attributes that they cannot have, and whether
    their normals are those of the rest pose in place of the clip's."""

    meshes: list[GltfMesh]
    materials: list[Look]
    left_out: list[str]
    has_made_normals: bool


def meshes_of(motion: Motion, looks: Looks, name: str, more: Mapping[str, np.ndarray] | None = None) -> GltfMeshes:
    """Return the objects of a clip as meshes of glTF, with what was left out. `more` has further attributes (N, width)
    by their semantic.
    """
    faces = motion.polygons
    triangles = _triangles(*faces) if faces is not None else np.zeros((0, 3), np.int64)  # places among the corners
    corner_vertex = np.asarray(faces[1], np.int64) if faces is not None else np.zeros(0, np.int64)
    per_vertex, per_corner, left_out = _sorted_attributes(motion, len(corner_vertex))
    per_vertex |= more or {}
    has_made_normals = bool(len(triangles)) and NORMAL not in per_vertex | per_corner
    if has_made_normals:
        per_vertex[NORMAL] = looks.surface.unit_normals(motion.rest)
    source, corner_place = _split(corner_vertex, per_corner, motion.vertex_count)
    values = {key: array[source] for key, array in per_vertex.items()}
    values |= {key: _from_corners(array, corner_place, len(source)) for key, array in per_corner.items()}
    edges = np.asarray(motion.edges, np.int64) if motion.edges is not None else np.zeros((0, 2), np.int64)
    fans = np.maximum(np.asarray(faces[0], np.int64) - 2, 0) if faces is not None else np.zeros(0, np.int64)
    labels = np.repeat(looks.labels, fans)
    made, materials = [], list(looks.materials)
    for part_name, start, stop in _objects(motion, name, corner_vertex[triangles], edges):
        rows = np.flatnonzero((source >= start) & (source < stop))
        place = np.full(len(source), -1)
        place[rows] = np.arange(len(rows))
        attributes = {key: array[rows] for key, array in values.items()}
        rows_of_part = np.flatnonzero(
            (corner_vertex[triangles[:, 0]] >= start) & (corner_vertex[triangles[:, 0]] < stop)
        )
        if len(rows_of_part):
            made.append(
                GltfMesh(
                    part_name,
                    source[rows],
                    place[corner_place[triangles[rows_of_part]]],
                    labels[rows_of_part],
                    attributes,
                )
            )
            continue
        if has_made_normals:
            del attributes[NORMAL]
        look = line_look(part_name)
        materials += [] if look in materials else [look]
        lines = edges[(edges[:, 0] >= start) & (edges[:, 0] < stop)]
        label = np.full(max(len(lines), 1), materials.index(look))
        made.append(GltfMesh(part_name, source[rows], place[lines] if len(lines) else None, label, attributes))
    return GltfMeshes(made, materials, left_out, has_made_normals)


def add_mesh(
    glb: Glb, mesh: GltfMesh, rest: np.ndarray, attributes: Mapping[str, np.ndarray] | None = None, **primitive: Any
) -> int:
    """Add a mesh in its rest pose (N, 3) to the file and return its number. `attributes` has further arrays by their
    semantic, and `primitive` further members of each primitive.
    """
    semantic = {"POSITION": glb.array(rest[mesh.source].astype(np.float32), bounds=True, target=VERTICES)}
    for key, values in (mesh.attributes | dict(attributes or {})).items():
        is_ratio = key == COLOUR or key.startswith("WEIGHTS_")
        semantic[key] = glb.array(values, target=VERTICES, normalized=is_ratio and values.dtype.kind == "u")
    primitive |= {"attributes": semantic, "mode": 0}
    if mesh.corners is None:
        primitives = [primitive | {"material": int(mesh.materials[0])}]
    else:
        primitive["mode"] = 4 if mesh.has_faces else 1
        dtype = np.uint16 if mesh.corners.max() < 65535 else np.uint32
        primitives = [
            primitive
            | {"indices": glb.array(corners.astype(dtype).reshape(-1, 1), target=INDICES)}
            | {"material": label}
            for label, corners in by_material(mesh.corners, mesh.materials)
        ]
    glb.json["meshes"].append({"name": mesh.name, "primitives": primitives})
    return len(glb.json["meshes"]) - 1


def by_material(corners: np.ndarray, labels: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Return the materials of rows of corners, (n, k), and the rows that have each; that of the first row first."""
    used, first = np.unique(labels, return_index=True)
    return [(int(label), corners[labels == label]) for label in used[np.argsort(first)]]


def add_materials(glb: Glb, meshes: GltfMeshes) -> None:
    """Add the materials of meshes, which leave the colours as they are that vertices have."""
    has_colours = any(COLOUR in mesh.attributes for mesh in meshes.meshes)
    glb.json["materials"] = [material_of(look, has_colours) for look in meshes.materials]
    if not all(look.is_lit for look in meshes.materials):
        glb.json.setdefault("extensionsUsed", []).append(UNLIT)


def material_of(look: Look, has_colours: bool) -> JsonObject:
    """Return the material of glTF; has_colours: of vertices that have colours."""
    colour = [1.0, 1.0, 1.0, 1.0] if has_colours else [*look.colour, 1.0]
    surface = {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": ROUGHNESS}
    material: JsonObject = {"name": look.name, "pbrMetallicRoughness": surface}
    material |= {"doubleSided": True} if look.is_two_sided else {}
    material |= {} if look.is_lit else {"extensions": {UNLIT: {}}}
    return material | {"extras": {OWN: {GUESSED: [MEMBERS[field] for field in look.guessed]}}}


def root_transform(motion: Motion) -> JsonObject:
    """Return the translation, rotation and scale of the node that turns the clip's axes and unit into those of glTF."""
    metadata = motion.metadata
    metres = metres_of(metadata) or 1.0
    axis = str(metadata.get("up_axis", "y")).lower()
    turn = TURNS.get(axis)
    transform = ({"rotation": turn} if turn else {}) | ({"scale": [metres] * 3} if metres != 1.0 else {})
    if place := origin_of(motion):
        # TURNS in whole numbers: their quaternions round.
        x, y, z = (metres * number for number in place)
        transform["translation"] = {"y": [x, y, z], "z": [x, z, -y], "x": [-y, x, z]}[axis if turn else "y"]
    return transform


@dataclass(frozen=True, eq=False)
class Take:
    """A clip as an animation: frames `start` to `stop` - 1 of the motion; `times` are its keys' float32 seconds from 0.
    Those of a loop end with its first frame again: what repeats them goes on as it does."""

    name: str
    start: int
    stop: int
    is_loop: bool
    times: np.ndarray
    extras: JsonObject

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the keys of values (T, ...), one per frame of the motion."""
        rows = values[self.start : self.stop]
        return np.concatenate([rows, rows[:1]]) if self.is_loop else rows


def takes(motion: Motion) -> list[Take]:
    """Return an animation for each clip, "motion" where it has no name. Raises ClipError for times that float32 cannot
    tell apart."""
    clip_ranges = motion.clip_ranges or (ClipRange("", motion.frame_count),)
    return [
        _take(motion, clip_range, start, stop)
        for clip_range, (start, stop) in zip(clip_ranges, motion.clip_range_frames)
    ]


def _take(motion: Motion, clip_range: ClipRange, start: int, stop: int) -> Take:
    """Return the animation of the frames `start` to `stop` - 1: its name, its times in seconds from 0, and whether it
    is a loop.
    """
    times = np.asarray(motion.time[start:stop], np.float64)
    is_loop = clip_range.loop and len(times) > 1
    extras = {"loop": True} if clip_range.loop else {}
    if len(motion.clip_ranges) > 1:
        fps = median_rate(times) or motion.fps
        extras |= _clock(metadata_of(motion.metadata, clip_range.name), times, fps)
    times = times - times[0]
    if is_loop:
        times = np.append(times, times[-1] + times[-1] / (len(times) - 1))
    times = times.astype(np.float32)
    if (np.diff(times) <= 0).any():
        raise ClipError("time: got frames closer to each other than float32 seconds tell, expected longer steps")
    return Take(clip_range.name or "motion", start, stop, is_loop, times, extras)


def clock(motion: Motion) -> JsonObject:
    """Return frame rate and first frame of a motion that is a single clip; unit and axis of the vertices."""
    scene = {key: str(motion.metadata[key]) for key in ("unit", "up_axis") if motion.metadata.get(key)}
    return scene if len(motion.clip_ranges) > 1 else _clock(motion.metadata, motion.time, motion.fps) | scene


def _clock(metadata: JsonMapping, time: np.ndarray, fps: float) -> JsonObject:
    """Return frame rate, `fps` where nothing is said, and number of the first frame in the tool that made the clip."""
    fps = stated_fps(metadata) or fps
    return {"fps": fps, "start_frame": whole(start_frame_of(metadata) + round(float(time[0]) * fps, 6))}


def branch_extras(motion: Motion) -> JsonObject:
    """Return the extras that describe the branches of a motion."""
    parent = getattr(motion, "branch_parent", None)
    return {} if parent is None else {"branch_parent": np.asarray(parent).tolist()}


def _triangles(counts: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Return fans over the polygons: (F, 3) places among the corners."""
    counts = np.asarray(counts, np.int64)
    starts, fans = np.cumsum(counts) - counts, np.maximum(counts - 2, 0)
    first = np.repeat(starts, fans)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(fans) - fans, fans)
    return np.stack([first, second, second + 1], axis=1)


def _sorted_attributes(motion: Motion, corner_count: int) -> tuple[JsonObject, JsonObject, list[str]]:
    """Return the clip's attributes in three parts: values (rows, width) per vertex by semantic, values per corner by
    semantic, and the names of attributes that glTF has no place for.
    """
    domains = motion.metadata.get("domains")
    domains = domains if isinstance(domains, dict) else {}
    arrays = dict(motion.attributes)
    for name in ("vertex_branch", "stem_index"):
        if getattr(motion, name, None) is not None:
            arrays[name] = getattr(motion, name)
    per_vertex: dict[str, np.ndarray] = {}
    per_corner: dict[str, np.ndarray] = {}
    left_out: list[str] = []
    for name, array in arrays.items():
        if name in NOT_PER_VERTEX or name == FACE_MATERIAL and face_materials(motion):
            continue
        domain = domains.get(name, "vertex" if array.ndim and len(array) == motion.vertex_count else "")
        where = {"vertex": (per_vertex, motion.vertex_count), "corner": (per_corner, corner_count)}.get(domain)
        entry = _semantic(name, array) if where and array.ndim in (1, 2) and len(array) == where[1] else None
        if where is None or entry is None or entry[0] in where[0]:
            left_out.append(name)
        else:
            where[0][entry[0]] = entry[1]
    return per_vertex, per_corner, left_out


def _semantic(name: str, array: np.ndarray) -> tuple[str, np.ndarray] | None:
    """Return glTF's semantic for the array named `name`, and the values in a type of glTF; None if glTF has no semantic
    that fits.
    """
    values = array.reshape(len(array), -1)
    semantic, widths = SEMANTICS.get(name, ("", ()))
    if semantic and values.shape[1] in widths:
        fitting = _standard(semantic, values)
        if fitting is not None:
            return semantic, fitting
    if not 1 <= values.shape[1] <= 4:
        return None
    fitting = _as_component(values)
    return None if fitting is None else ("_" + re.sub(r"\W", "_", name, flags=re.ASCII), fitting)


def _standard(semantic: str, values: np.ndarray) -> np.ndarray | None:
    """Return values as glTF defines them for a semantic: colours from 0 to 1, normals of length 1. Return None if the
    values are not such.
    """
    if semantic == COLOUR and values.dtype in (np.uint8, np.uint16):
        return values
    if values.dtype.kind != "f" or not np.isfinite(values).all():
        return None
    if semantic == COLOUR and (values.min() < 0 or values.max() > 1):
        return None
    if semantic == NORMAL:
        length = np.linalg.norm(values.astype(np.float64), axis=1, keepdims=True)
        return (values / length).astype(np.float32) if (length > 1e-12).all() else None
    return values.astype(np.float32)


def _as_component(values: np.ndarray) -> np.ndarray | None:
    """Return values in the smallest type of glTF that holds all of them; float64 is rounded to float32. Return None if
    no type holds them.
    """
    if values.dtype.kind == "f":
        with np.errstate(over="ignore"):
            rounded = values.astype(np.float32)
        return rounded if np.isfinite(rounded).all() else None
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if values.dtype.kind not in "iu":
        return None
    low, high = int(values.min()), int(values.max())
    for dtype in (np.uint8, np.int8, np.uint16, np.int16):
        if np.iinfo(dtype).min <= low and high <= np.iinfo(dtype).max:
            return values.astype(dtype)
    return values.astype(np.float32) if max(-low, high) <= 1 << 24 else None


def _split(
    corner_vertex: np.ndarray, per_corner: Mapping[str, np.ndarray], vertex_count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return two arrays: the clip's vertex that each written vertex is, (n,), which begins with all vertices of the
    clip, and the written vertex of each corner. A vertex is written again for each different set of values that its
    corners have.
    """
    if not per_corner or not len(corner_vertex):
        return np.arange(vertex_count), corner_vertex
    rows = [corner_vertex.astype("<i8").view(np.uint8).reshape(-1, 8)]
    rows += [np.ascontiguousarray(v).view(np.uint8).reshape(len(corner_vertex), -1) for v in per_corner.values()]
    table = np.ascontiguousarray(np.concatenate(rows, axis=1))
    _, first, kind = np.unique(table.view(f"V{table.shape[1]}").ravel(), return_index=True, return_inverse=True)
    vertex = corner_vertex[first]
    order = np.lexsort((first, vertex))
    is_first = np.ones(len(order), bool)
    is_first[1:] = np.diff(vertex[order]) > 0
    place = np.empty(len(first), np.int64)
    place[order[is_first]] = vertex[order[is_first]]
    further = order[~is_first]
    place[further] = vertex_count + np.arange(len(further))
    return np.concatenate([np.arange(vertex_count), vertex[further]]), place[kind.ravel()]


def _from_corners(values: np.ndarray, corner_place: np.ndarray, count: int) -> np.ndarray:
    out = np.zeros((count, values.shape[1]), values.dtype)
    if values.shape[1] == 3 and values.dtype.kind == "f":
        out[:, 2] = 1  # a normal of a vertex without faces has length 1 too
    out[corner_place] = values
    return out


def _objects(motion: Motion, name: str, triangles: np.ndarray, edges: np.ndarray) -> list[tuple[str, int, int]]:
    """Return triples of a name, a first vertex and the vertex after the last, one for each object. If faces or edges
    join several objects, there is one object of all vertices.
    """
    counts, names = motion.attributes.get("part_vertex_counts"), motion.metadata.get("part_names")
    whole = [(names[0] if isinstance(names, list) and len(names) == 1 else name, 0, motion.vertex_count)]
    if counts is None or not isinstance(names, list) or len(names) != len(counts) or np.min(counts, initial=1) < 1:
        return whole
    stops = np.cumsum(counts)
    if not len(stops) or stops[-1] != motion.vertex_count:
        return whole
    for corners in (triangles, edges):
        part = np.searchsorted(stops, corners, "right")
        if (part != part[:, :1]).any():
            return whole
    return [(str(name), int(stop - count), int(stop)) for name, count, stop in zip(names, counts, stops)]
