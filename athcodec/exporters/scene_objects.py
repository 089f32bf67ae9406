"""Objects of a scene out of one clip: what writers of scene formats share.

A clip says which of its vertices are which object (MotionClip, "part_names"); here that is checked and taken apart. It
knows no format and touches no positions.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from athcodec.motion.joining import OWN as CLIPS
from athcodec.motion.presence import PRESENCE, presence_of_parts, stated_presence
from athcodec.motion.protocol import Motion
from athcodec.sources.scene_objects import FACE_MATERIAL, MATERIAL_NAMES, SCENE_KEYS, SCHEME, ArrayDescriptor
from athcodec.untyped import JsonObject, JsonValue

# kept by the formats themselves, or by their objects
KNOWN_METADATA = ("fps", "start_frame", "part_names", "part_kinds", "part_usd", "domains", PRESENCE)
NOT_WRITTEN = "not_written"  # in what a writer returns: the names of what it has no place for, by kind
KNOWN_ATTRIBUTES = ("part_vertex_counts", "curve_vertex_counts", "face_vertex_counts", "face_vertex_indices")
DOMAINS = ("vertex", "corner", "face", "constant")


@dataclass
class SceneObject:
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
    copies: int = 1  # its vertices and faces are so many copies of one shape
    stated_copies: int = 1  # The clip says so many; `copies` is 1 where they cannot be instances.
    target: Any = None  # The writer's own object for it.
    instancer: Any = None  # and of its copies
    width: float = 0.0  # the largest, of curves and points
    shown: np.ndarray | None = None  # (T, 1) or (T, copies) bool, the frames that show it or its copies; None: all

    @property
    def vertices(self) -> slice:
        return slice(self.first, self.first + self.count)


def objects_of(motion: Motion) -> list[SceneObject]:
    """Return the objects of a motion in the order of their vertices; a motion that names none is one object."""
    names, counts, kinds, details = _division(motion)
    face_counts, face_indices = motion.polygons or (np.empty(0, np.int64), np.empty(0, np.int64))
    face_indices = np.asarray(face_indices, np.int64)
    corners = np.concatenate([[0], np.cumsum(face_counts, dtype=np.int64)])
    ends = np.cumsum(counts, dtype=np.int64)
    owner = _owners(corners, face_indices, ends)
    curves = iter(_curve_counts(motion, ends, kinds))
    objects = []
    for i, (name, kind, end, count, detail) in enumerate(zip(names, kinds, ends, counts, details)):
        low, high = np.searchsorted(owner, [i, i + 1])
        rows, first = slice(int(corners[low]), int(corners[high])), int(end - count)
        faces = np.asarray(face_counts[low:high]), face_indices[rows] - first
        face_rows = slice(int(low), int(high))
        objects.append(SceneObject(name, kind, first, int(count), faces, next(curves), face_rows, rows, detail))
    copy_counts = _copies(motion, len(objects))
    is_one_clip = len(getattr(motion, "clip_ranges", ())) < 2
    presence = presence_of_parts(motion.metadata, names, copy_counts, motion.frame_count) if is_one_clip else {}
    for number, (obj, copies) in enumerate(zip(objects, copy_counts)):
        obj.shown, obj.stated_copies = presence.get(number), copies
        obj.copies = copies if 1 < copies <= obj.count and _repeats(obj, copies) else 1
    return objects


def hidden_copies(objects: list[SceneObject], instances: bool = False) -> JsonObject:
    """Return the sentence about objects whose copies are hidden one by one, but are not written as instances; and about
    all that are not, where `instances` were asked for."""
    names = [obj.name for obj in objects if obj.copies == 1 and obj.shown is not None and obj.shown.shape[1] > 1]
    lost = {"presence of copies, which instances keep": names} if names else {}
    lost |= lost_copies(objects) if instances else {}
    return {NOT_WRITTEN: lost} if lost else {}


def lost_copies(objects: list[SceneObject]) -> dict[str, list[str]]:
    """Return the names of objects whose copies are written as one mesh, in place of instances."""
    names = [f"{obj.name} ({obj.stated_copies} in one mesh)" for obj in objects if obj.copies == 1 < obj.stated_copies]
    return {"copies as instances (mirrored, sheared, bent or of different materials)": names} if names else {}


def lost_arrays(motion: Motion, kept: Collection[str]) -> dict[str, dict[str, list[str]]]:
    """Return the names of attributes that a format has no place for; those that describe other arrays are left out."""
    described = {"part_vertex_counts", "part_copies", "face_vertex_counts", "face_vertex_indices", "normals"}
    names = [name for name in motion.attributes if name not in described | {FACE_MATERIAL, *kept}]
    return {NOT_WRITTEN: {"arrays": names}} if names else {}


def not_written(motion: Motion, kept: Sequence[str]) -> dict[str, list[str]]:
    """Return the names of the objects whose presence over time, two-sided faces or subdivision a format does not keep,
    by the name of the property. `kept` has the properties that the format keeps.
    """
    metadata, is_one_clip = getattr(motion, "metadata", None) or {}, len(getattr(motion, "clip_ranges", ())) < 2
    clips = metadata.get(CLIPS) if not is_one_clip else None
    every = [metadata, *(clips.values() if isinstance(clips, dict) else ())]
    presence = dict.fromkeys(
        name for entries in every if isinstance(entries, dict) for name in stated_presence(entries)
    )
    names, details = metadata.get("part_names"), metadata.get("part_usd")
    pairs = list(zip(names, details)) if isinstance(names, list) and isinstance(details, list) else []
    lost = {"doubleSided": [name for name, detail in pairs if is_double_sided(detail)]}
    lost[SCHEME] = [name for name, detail in pairs if isinstance(detail, dict) and SCHEME in detail]
    lost = {kind: names for kind, names in lost.items() if names and kind not in kept}
    return lost if not presence or is_one_clip and "presence" in kept else lost | {"presence": list(presence)}


def is_double_sided(details: JsonValue) -> bool:
    """Return whether the faces of an object with such details in "part_usd" are seen from both sides."""
    return isinstance(details, dict) and details.get("doubleSided") == "true"


def stated_names(motion: Motion) -> JsonObject:
    """Return the JSON for formats that have no place for objects: their names, kinds, and numbers of vertices and
    copies, and the names of materials. `sources.scene_objects.scene_fields` reads it back.
    """
    stated: JsonObject = {}
    names, counts = motion.metadata.get("part_names"), motion.attributes.get("part_vertex_counts")
    if isinstance(names, list) and counts is not None and counts.shape == (len(names),):
        copies, kinds = motion.attributes.get("part_copies"), motion.metadata.get("part_kinds")
        stated["objects"] = {"names": names, "vertices": counts.tolist()}
        stated["objects"] |= {"kinds": kinds} if isinstance(kinds, list) else {}
        stated["objects"] |= {"copies": copies.tolist()} if copies is not None else {}
    if face_materials(motion) is not None:
        stated[MATERIAL_NAMES] = motion.metadata[MATERIAL_NAMES]
    return stated


def names_and_scene(motion: Motion) -> JsonObject:
    """Return `stated_names`, and with them unit, up axis and frame rate."""
    scene = {key: motion.metadata[key] for key in SCENE_KEYS if motion.metadata.get(key) is not None}
    return {key: SCENE_KEYS[key](value) for key, value in scene.items()} | stated_names(motion)


def _copies(motion: Motion, object_count: int) -> list[int]:
    copies = motion.attributes.get("part_copies")
    if copies is None or copies.shape != (object_count,) or copies.dtype.kind not in "iu":
        return [1] * object_count
    return copies.tolist()


def _repeats(obj: SceneObject, copies: int) -> bool:
    """Return whether the vertices, faces and curves of an object repeat those of its first part `copies` times."""
    counts, indices = obj.faces
    if obj.count % copies or len(counts) % copies or len(indices) % copies or len(obj.curves) % copies:
        return False
    shift = np.arange(copies)[:, None] * (obj.count // copies)
    rows = indices.reshape(copies, -1) - shift
    return all(
        bool((each == each[:1]).all()) for each in (counts.reshape(copies, -1), rows, obj.curves.reshape(copies, -1))
    )


def _owners(corners: np.ndarray, indices: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the number (F,) of the object that each face belongs to, ascending. All faces belong to object 0 if a face
    lies across several objects. `ends` has the vertex after the last of each object.
    """
    counts = np.diff(corners)
    of_corner = np.searchsorted(ends, indices, "right")
    faces = np.repeat(np.arange(len(counts)), counts)
    owner = np.zeros(len(counts), np.int64)
    owner[faces] = of_corner
    filled = np.maximum.accumulate(owner) if len(owner) else owner
    owner = np.where(counts > 0, owner, filled)
    return owner


def _division(motion: Motion) -> tuple[list[str], np.ndarray, list[str], list[dict[str, str]]]:
    """Return four lists about the objects of a motion: names, numbers of vertices, kinds and further details. If what
    the clip states does not fit its vertices, there is one object.
    """
    metadata, counts = motion.metadata, motion.attributes.get("part_vertex_counts")
    names, kinds = metadata.get("part_names"), metadata.get("part_kinds")
    count = motion.vertex_count
    if (
        isinstance(names, list)
        and counts is not None
        and counts.dtype.kind in "iu"
        and counts.shape == (len(names),)
        and (counts >= 0).all()
        and counts.sum(dtype=np.int64) == count
        and _fits(motion, counts)
    ):
        if not isinstance(kinds, list) or len(kinds) != len(names):
            kinds = [_kind(motion, counts, i) for i in range(len(names))]
        details = metadata.get("part_usd")
        if not isinstance(details, list) or len(details) != len(names):
            details = [{}] * len(names)
        return [str(name) for name in names], counts.astype(np.int64), kinds, details
    return ["plant"], np.array([count]), [_kind(motion, np.array([count]), 0)], [{}]


def _fits(motion: Motion, counts: np.ndarray) -> bool:
    """Return whether every face is of one object, and the faces are in the order of the objects."""
    if motion.polygons is None:
        return True
    face_counts, indices = motion.polygons
    owner = np.searchsorted(np.cumsum(counts, dtype=np.int64), indices, "right")
    first = np.repeat(np.cumsum(face_counts, dtype=np.int64) - face_counts, face_counts)
    return bool((owner == owner[first]).all() and (np.diff(owner) >= 0).all()) if len(owner) else True


def _kind(motion: Motion, counts: np.ndarray, index: int) -> str:
    """Return "mesh", "curves" or "points" for the object number `index`, by the faces and edges of its vertices.
    `counts` has the number of vertices of each object.
    """
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
    """Return the number of vertices of each curve, if edges join the vertices `start` to `stop` - 1 to curves of
    consecutive vertices; else None. Edges from a branch to its parent are not part of a curve.
    """
    links = np.asarray(edges, np.int64)
    links = links[(links >= start).all(axis=1) & (links < stop).all(axis=1)]
    neighbours = links[np.abs(np.diff(links, axis=1)[:, 0]) == 1]
    joined = np.zeros(stop - start, bool)
    joined[neighbours.max(axis=1) - start] = True
    counts = np.diff(np.append(np.flatnonzero(~joined), stop - start))
    return counts if (counts > 1).all() else None


def _curve_counts(motion: Motion, ends: np.ndarray, kinds: list[str]) -> Iterator[np.ndarray]:
    """Yield for each object the numbers of vertices of its curves; an empty array for an object without curves. `ends`
    has the vertex after the last of each object.
    """
    stated = motion.attributes.get("curve_vertex_counts")
    totals = [
        int(end - start) if kind == "curves" else 0 for end, start, kind in zip(ends, np.append(0, ends[:-1]), kinds)
    ]
    if stated is not None and (stated.ndim != 1 or stated.dtype.kind not in "iu" or int(stated.sum()) != sum(totals)):
        stated = None
    done = 0
    for end, total in zip(ends, totals):
        if not total:
            yield np.empty(0, np.int64)
        elif stated is not None:
            stop = done + int(np.searchsorted(np.cumsum(stated[done:], dtype=np.int64), total)) + 1
            yield stated[done:stop]
            done = stop
        else:
            chains = None if motion.edges is None else _chains(motion.edges, int(end) - total, int(end))
            yield np.array([total]) if chains is None else chains


def face_materials(motion: Motion) -> tuple[np.ndarray, list[str]] | None:
    """Return (F,) the material of each face, among the names; outside them where it has none. None where the clip says
    it of no face."""
    labels, names = motion.attributes.get(FACE_MATERIAL), motion.metadata.get(MATERIAL_NAMES)
    count = 0 if motion.polygons is None else len(motion.polygons[0])
    if labels is None or not isinstance(names, list) or labels.shape != (count,) or labels.dtype.kind not in "iu":
        return None
    return labels.astype(np.int64), [str(name) for name in names]


def material_runs(labels: np.ndarray, names: list[str]) -> list[tuple[int, np.ndarray]]:
    """Return the materials that faces have, (F,), and which faces these are."""
    return [(int(label), np.flatnonzero(labels == label)) for label in np.unique(labels) if 0 <= label < len(names)]


def domain_of(motion: Motion, name: str, values: np.ndarray, domains: dict[str, str]) -> str:
    """Return what each row of an array belongs to: "vertex", "corner", "face", "branch", "constant" or "other". The
    domain that the clip states is taken if the number of rows fits it, else a domain whose number of rows fits.
    """
    polygons = motion.polygons or ((), ())
    rows = {
        "vertex": motion.vertex_count,
        "corner": len(polygons[1]),
        "face": len(polygons[0]),
        "constant": 1,
        "branch": motion.branch_count,
    }
    count = len(values) if values.ndim else -1
    stated = domains.get(name) if isinstance(domains, dict) else None
    if stated is not None:
        return stated if rows.get(stated) == count else "other"
    return next((domain for domain in ("vertex", "branch", "face") if count == rows[domain]), "other")


def rows_of(values: np.ndarray, domain: str, obj: SceneObject) -> np.ndarray:
    """Return the rows of a static array that belong to an object."""
    rows = {"vertex": obj.vertices, "corner": obj.corner_rows, "face": obj.face_rows, "constant": slice(0, 1)}
    return values[rows[domain]]


def own_arrays(motion: Motion, left: dict[str, tuple[np.ndarray, str]]) -> Iterator[tuple[ArrayDescriptor, np.ndarray]]:
    """Yield the arrays that scene formats cannot hold, which are the rest pose, branches, edges and the arrays in
    `left`: each with its descriptor, and as bytes in a uint8 array.
    """
    arrays = {"rest": (getattr(motion, "source_rest", motion.rest), "vertex")}
    for name, domain in (("vertex_branch", "vertex"), ("branch_parent", ""), ("stem_index", "vertex"), ("edges", "")):
        arrays[name] = getattr(motion, name, None), domain
    for name, (values, domain) in (arrays | left).items():
        if values is not None:
            values = np.asarray(values)
            raw = np.frombuffer(np.ascontiguousarray(values).tobytes(), np.uint8)
            yield ArrayDescriptor.of(name, values, "" if domain == "other" else domain), raw


def distinct(names: Iterable[str]) -> list[str]:
    """Return names in the same order, with a number added to each name that occurred before."""
    names_used: dict[str, None] = {}
    for wanted in names:
        name, number = wanted, 1
        while name in names_used:
            number += 1
            name = f"{wanted}_{number}"
        names_used[name] = None
    return list(names_used)
