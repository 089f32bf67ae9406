"""Objects of a scene as runs of one clip's vertices: what readers of scene formats share.

A reader fills in a Part per object, in the numbering of that object; here their faces, edges and static arrays are
joined. It knows no format and reads no positions.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from athcodec.clip import RESERVED_NAMES
from athcodec.errors import ClipError

MAX_METADATA_BYTES = 1 << 24
OWN = "athcodec"  # the namespace of what our writers add to files of other formats
KNOWN_METADATA = ("fps", "start_frame", "meters_per_unit", "part_names", "part_kinds", "part_usd", "domains")


@dataclass
class Static:
    """A named array of one part and what its rows stand for: vertex, corner, face or constant."""

    domain: str
    values: np.ndarray


@dataclass
class Part:
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
    statics: dict[str, Static] = field(default_factory=dict)

    def rows(self, domain: str) -> int:
        sizes = {"vertex": self.count, "corner": len(self.face_indices), "face": len(self.face_counts), "constant": 1}
        return sizes[domain]

    def check(self) -> None:
        """Raises ClipError where faces or curves do not fit the points."""
        corners = self.face_counts.sum(dtype=np.int64)
        if (self.face_counts < 0).any() or corners != len(self.face_indices):
            raise ClipError(f"{self.path}: got faces of {corners} corners, expected {len(self.face_indices)}, one per "
                            "index")
        bad = np.flatnonzero((self.face_indices < 0) | (self.face_indices >= self.count))
        if bad.size:
            raise ClipError(f"{self.path}: corner {bad[0]} is vertex {self.face_indices[bad[0]]}, expected 0 to "
                            f"{self.count - 1}")
        points = self.count if self.curve_counts is None else self.curve_counts.sum(dtype=np.int64)
        if points != self.count or self.curve_counts is not None and (self.curve_counts < 0).any():
            raise ClipError(f"{self.path}: got curves of {points} points, expected {self.count}")

    def keep(self, name: str, domain: str | None, values: np.ndarray | None) -> None:
        """Notes a static array where its rows fit; a row per curve becomes one per vertex."""
        if values is None or domain is None or name in self.statics or domain == "constant" and len(values) != 1:
            return
        if domain == "face" and self.curve_counts is not None and len(values) == len(self.curve_counts):
            domain, values = "vertex", np.repeat(values, self.curve_counts, axis=0)
        elif domain == "face" and self.kind == "points":
            domain = "constant"
        if len(values) == self.rows(domain):
            self.statics[name] = Static(domain, values)


def names_and_kinds(parts: Sequence[Part]) -> dict[str, Any]:
    """Metadata: the names, or the paths where names come twice."""
    names = [part.name for part in parts]
    unique = len(set(names)) == len(names)
    metadata = {"part_names": names if unique else [part.path for part in parts],
                "part_kinds": [part.kind for part in parts]}
    return metadata | ({"part_usd": [part.details for part in parts]} if any(part.details for part in parts) else {})


def joined(parts: list[Part], skip: Collection[str]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Static arrays of all parts, one after the other, and what their rows stand for where that is no vertex."""
    attributes, domains = {}, {}
    for name in dict.fromkeys(name for part in parts for name in part.statics):
        if name in skip:
            continue
        array = _joined(name, parts)
        if array is not None:
            attributes[name] = array.values
            if array.domain != "vertex":
                domains[name] = array.domain
    attributes["part_vertex_counts"] = np.array([part.count for part in parts], np.int32)
    domains["part_vertex_counts"] = "constant"
    if any(part.curve_counts is not None for part in parts):
        attributes["curve_vertex_counts"] = np.concatenate([part.curve_counts for part in parts
                                                            if part.curve_counts is not None])
        domains["curve_vertex_counts"] = "constant"
    return attributes, domains


def _joined(name: str, parts: list[Part]) -> Static | None:
    """A part that lacks the array has zeros; None where the parts' arrays do not go together."""
    found = [part.statics[name] for part in parts if name in part.statics]
    shapes = {each.values.shape[1:] for each in found}
    if len(shapes) != 1:
        return None
    domain = _common_domain(found, len(parts))
    dtypes = {each.values.dtype for each in found}
    dtype = dtypes.pop() if len(dtypes) == 1 else np.result_type(*dtypes)
    if domain == "constant":
        return Static(domain, found[0].values.astype(dtype, copy=False))
    rows = [_spread(part, part.statics.get(name), domain, next(iter(shapes))) for part in parts]
    return Static(domain, np.concatenate(rows).astype(dtype, copy=False))


def _common_domain(found: list[Static], part_count: int) -> str:
    domains = {each.domain for each in found}
    if domains == {"constant"}:
        same = all(np.array_equal(each.values, found[0].values) for each in found)
        return "constant" if same and len(found) == part_count else "vertex"
    domains.discard("constant")
    return domains.pop() if len(domains) == 1 else "corner"


def _spread(part: Part, static: Static | None, domain: str, shape: tuple[int, ...]) -> np.ndarray:
    if static is None:
        return np.zeros((part.rows(domain), *shape), np.uint8)
    if static.domain == domain:
        return static.values
    if static.domain == "constant":
        return np.repeat(static.values, part.rows(domain), axis=0)
    if static.domain == "vertex":
        return static.values[part.face_indices]
    return np.repeat(static.values, part.face_counts, axis=0)


def faces(parts: list[Part], attributes: dict[str, np.ndarray]) -> np.ndarray | None:
    """(F, k), or None where polygons are mixed, which are attributes then, or where there are none."""
    counts = np.concatenate([part.face_counts for part in parts])
    if not len(counts):
        return None
    indices = np.concatenate([part.face_indices + np.int32(part.first) for part in parts])
    if counts.min() == counts.max() > 0:
        return indices.reshape(-1, counts[0])
    attributes |= {"face_vertex_counts": counts, "face_vertex_indices": indices}
    return None


def edges(parts: list[Part]) -> np.ndarray | None:
    """Those between the neighbours on each curve; closed where it is periodic."""
    found = []
    for part in parts:
        if part.curve_counts is None or not part.count:
            continue
        counts = part.curve_counts[part.curve_counts > 0].astype(np.int64)
        ends = np.cumsum(counts)
        vertices = np.arange(part.count)
        following = vertices + 1
        keep = np.ones(part.count, bool)
        if part.details.get("wrap") == "periodic":
            following[ends - 1] = ends - counts
            keep[ends - 1] = counts > 2
        else:
            keep[ends - 1] = False
        found.append(np.stack([vertices, following], axis=1)[keep] + part.first)
    return np.concatenate(found).astype(np.int32) if found else None


def fields(attributes: dict[str, np.ndarray], domains: dict[str, str]) -> dict[str, Any]:
    """Takes what a MotionClip has members for out of the attributes; others of these names are renamed."""
    found = {}
    vertices = int(attributes["part_vertex_counts"].sum(dtype=np.int64))
    rest, edges = attributes.get("rest"), attributes.get("edges")
    if rest is not None and rest.shape == (vertices, 3) and rest.dtype.kind == "f" and "rest" not in domains:
        found["rest"] = attributes.pop("rest")
    if edges is not None and edges.ndim == 2 and edges.shape[1] == 2 and edges.dtype.kind in "iu":
        found["edges"] = attributes.pop("edges")
    if "vertex_branch" in attributes and "branch_parent" in attributes:
        for name in ("vertex_branch", "branch_parent", "stem_index"):
            if name in attributes:
                found[name] = attributes.pop(name)
    for name in [name for name in attributes if name in RESERVED_NAMES]:
        attributes[f"{name}_primvar"] = attributes.pop(name)
        if name in domains:
            domains[f"{name}_primvar"] = domains.pop(name)
    for name in found:
        domains.pop(name, None)
    return found


def own_metadata(text: Any) -> dict[str, Any]:
    """What a writer of ours has kept of a clip's metadata, JSON, besides what the format itself holds; else nothing."""
    if not isinstance(text, str) or len(text) > MAX_METADATA_BYTES:
        return {}
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    found = found if isinstance(found, dict) else {}
    return {name: value for name, value in found.items() if name not in KNOWN_METADATA}


def own_array(raw: bytes, dtype: str, shape: str) -> np.ndarray | None:
    """An array that a writer of ours has kept byte for byte; None where that is not what it is."""
    try:
        kind = np.dtype([tuple(each) for each in json.loads(dtype)] if dtype.startswith("[") else dtype)
        return None if kind.hasobject else np.frombuffer(raw, kind).reshape(json.loads(shape))
    except (ValueError, TypeError, RecursionError):
        return None


def turned_corners(counts: np.ndarray) -> np.ndarray:
    """(C,) the corners of each face from the last to the first."""
    counts = np.asarray(counts, np.int64)
    ends = np.cumsum(counts)
    return np.repeat(2 * ends - counts - 1, counts) - np.arange(int(ends[-1]) if len(ends) else 0)
