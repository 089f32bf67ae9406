"""Objects of a scene out of one clip: what writers of scene formats share.

A clip says which of its vertices are which object (MotionClip, "part_names"); here that is checked and taken apart. It
knows no format and touches no positions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from athcodec.clip import frame_rate
from athcodec.errors import ClipError

# kept by the formats themselves, or by their objects
KNOWN_METADATA = ("fps", "start_frame", "part_names", "part_kinds", "part_usd", "domains")
KNOWN_ATTRIBUTES = ("part_vertex_counts", "curve_vertex_counts", "face_vertex_counts", "face_vertex_indices")
DOMAINS = ("vertex", "corner", "face", "constant")


def frame_numbers(motion: Any) -> tuple[np.ndarray, float]:
    """The number of each frame in the tool that made the clip, and frames per second."""
    metadata = motion.metadata
    rate = frame_rate(metadata) if "fps" in metadata else float(motion.fps)
    start = metadata.get("start_frame", 0)
    if isinstance(start, bool) or not isinstance(start, (int, float)):
        raise ClipError(f"start_frame: got {start!r}, expected a number")
    codes = start + np.round(np.asarray(motion.time) * rate, 6)
    if (np.diff(codes) <= 0).any():
        frame = int(np.flatnonzero(np.diff(codes) <= 0)[0]) + 1
        raise ClipError(f"time: frame {frame} has the number {codes[frame]:g} as the one before it, expected a larger "
                        "one")
    return codes, rate


@dataclass
class Part:
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
    target: Any = None  # what a writer makes of it
    width: float = 0.0  # the largest, of curves and points

    @property
    def vertices(self) -> slice:
        return slice(self.first, self.first + self.count)


def parts_of(motion: Any) -> list[Part]:
    names, counts, kinds, details = _division(motion)
    face_counts, face_indices = motion.polygons or (np.empty(0, np.int64), np.empty(0, np.int64))
    face_indices = np.asarray(face_indices, np.int64)
    corners = np.concatenate([[0], np.cumsum(face_counts, dtype=np.int64)])
    ends = np.cumsum(counts, dtype=np.int64)
    owner = _owners(corners, face_indices, ends)
    curves = iter(_curve_counts(motion, ends, kinds))
    parts = []
    for i, (name, kind, end, count, detail) in enumerate(zip(names, kinds, ends, counts, details)):
        low, high = np.searchsorted(owner, [i, i + 1])
        rows, first = slice(int(corners[low]), int(corners[high])), int(end - count)
        faces = np.asarray(face_counts[low:high]), face_indices[rows] - first
        face_rows = slice(int(low), int(high))
        parts.append(Part(name, kind, first, int(count), faces, next(curves), face_rows, rows, detail))
    return parts


def _owners(corners: np.ndarray, indices: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """(F,) the part of each face, ascending; everything belongs to part 0 where faces lie across parts."""
    counts = np.diff(corners)
    of_corner = np.searchsorted(ends, indices, "right")
    faces = np.repeat(np.arange(len(counts)), counts)
    owner = np.zeros(len(counts), np.int64)
    owner[faces] = of_corner
    filled = np.maximum.accumulate(owner) if len(owner) else owner
    owner = np.where(counts > 0, owner, filled)
    return owner


def _division(motion: Any) -> tuple[list[str], np.ndarray, list[str], list[dict[str, str]]]:
    """Names, vertices, kinds and further details of the parts: what the clip says, where that fits, else one part."""
    metadata, counts = motion.metadata, motion.attributes.get("part_vertex_counts")
    names, kinds = metadata.get("part_names"), metadata.get("part_kinds")
    count = motion.vertex_count
    if isinstance(names, list) and counts is not None and counts.dtype.kind in "iu" and counts.shape == (len(names),):
        if (counts >= 0).all() and counts.sum(dtype=np.int64) == count and _fits(motion, counts):
            if not isinstance(kinds, list) or len(kinds) != len(names):
                kinds = [_kind(motion, counts, i) for i in range(len(names))]
            details = metadata.get("part_usd")
            if not isinstance(details, list) or len(details) != len(names):
                details = [{}] * len(names)
            return [str(each) for each in names], counts.astype(np.int64), kinds, details
    return ["plant"], np.array([count]), [_kind(motion, np.array([count]), 0)], [{}]


def _fits(motion: Any, counts: np.ndarray) -> bool:
    """Whether every face is of one part, and the faces are in the order of the parts."""
    if motion.polygons is None:
        return True
    face_counts, indices = motion.polygons
    owner = np.searchsorted(np.cumsum(counts, dtype=np.int64), indices, "right")
    first = np.repeat(np.cumsum(face_counts, dtype=np.int64) - face_counts, face_counts)
    return bool((owner == owner[first]).all() and (np.diff(owner) >= 0).all()) if len(owner) else True


def _kind(motion: Any, counts: np.ndarray, index: int) -> str:
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
    """Vertices per curve where runs of vertices that are neighbours in the numbering and joined by edges make curves
    of two and more, else None. Further edges, where a branch begins at its parent, are not seen in the curves."""
    own = np.asarray(edges, np.int64)
    own = own[(own >= start).all(axis=1) & (own < stop).all(axis=1)]
    neighbours = own[np.abs(np.diff(own, axis=1)[:, 0]) == 1]
    joined = np.zeros(stop - start, bool)
    joined[neighbours.max(axis=1) - start] = True
    counts = np.diff(np.append(np.flatnonzero(~joined), stop - start))
    return counts if (counts > 1).all() else None


def _curve_counts(motion: Any, ends: np.ndarray, kinds: list[str]) -> Iterator[np.ndarray]:
    """For each part its vertices per curve, empty where it is none."""
    said = motion.attributes.get("curve_vertex_counts")
    totals = [int(end - start) if kind == "curves" else 0 for end, start, kind in
              zip(ends, np.append(0, ends[:-1]), kinds)]
    usable = said is not None and said.ndim == 1 and said.dtype.kind in "iu" and int(said.sum()) == sum(totals)
    done = 0
    for end, total in zip(ends, totals):
        if not total:
            yield np.empty(0, np.int64)
        elif usable:
            stop = done + int(np.searchsorted(np.cumsum(said[done:], dtype=np.int64), total)) + 1
            yield said[done:stop]
            done = stop
        else:
            chains = None if motion.edges is None else _chains(motion.edges, int(end) - total, int(end))
            yield np.array([total]) if chains is None else chains


def domain_of(motion: Any, name: str, values: np.ndarray, domains: dict[str, str]) -> str:
    """What the clip says where the rows fit, else what they fit."""
    polygons = motion.polygons or ((), ())
    rows = {"vertex": motion.vertex_count, "corner": len(polygons[1]), "face": len(polygons[0]), "constant": 1,
            "branch": motion.branch_count}
    count = len(values) if values.ndim else -1
    said = domains.get(name) if isinstance(domains, dict) else None
    if said is not None:
        return said if rows.get(said) == count else "other"
    return next((each for each in ("vertex", "branch", "face") if count == rows[each]), "other")


def rows_of(values: np.ndarray, domain: str, part: Part) -> np.ndarray:
    """The rows of a static array that belong to a part."""
    rows = {"vertex": part.vertices, "corner": part.corner_rows, "face": part.face_rows, "constant": slice(0, 1)}
    return values[rows[domain]]


def own_arrays(motion: Any, left: dict[str, tuple[np.ndarray, str]]) -> Iterator[tuple[str, np.ndarray, str]]:
    """(name, array, domain) of what scene formats have no place for: the arrays in `left`, branches, edges, rest."""
    yield "rest", getattr(motion, "source_rest", motion.rest), "vertex"
    for name, domain in (("vertex_branch", "vertex"), ("branch_parent", ""), ("stem_index", "vertex"), ("edges", "")):
        values = getattr(motion, name, None)
        if values is not None:
            yield name, np.asarray(values), domain
    for name, (values, domain) in left.items():
        yield name, values, "" if domain == "other" else domain
