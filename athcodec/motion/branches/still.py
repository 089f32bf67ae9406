"""What stands still beside what moves: terrain, pots, trellis. It has branches of its own, on which nothing hangs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from athcodec.motion.branches.result import Found, checked_branches
from athcodec.motion.branches.seen import components, links_of, near_neighbours
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.clip import MotionClip, source_stem_index, stands_still
from athcodec.motion.frames import Frames
from athcodec.motion.polygons import Polygons

NEIGHBOURS = 8  # Nearest points of each vertex without links, among which it stands.
LEAST_STILL = 64  # Vertices below which what stands still stays with what moves.
FEET_SHARE = 0.25  # Moving points that are next to points that stand still, over these, from which on they are feet.
INSIDE_SHARE = 0.2  # Smallest share of a connected part that stands still apart from the rest of it.


def still_parts(clip: MotionClip, most: float) -> np.ndarray | None:
    """Return which vertices are of parts that stand still, (N,) bool.

    Parameters
    ----------
    clip : MotionClip
    most : float
        The largest distance, in scene units, of what stands still from its place in the rest pose.

    Returns
    -------
    (N,) bool array or None
        Whole connected parts, or the inside of what stands still in a part of which much stands and much moves, but no
        points without links that are the feet of plants. None if that is too little, or nothing moves.
    """
    if stands_still(clip):
        return None
    still = _still_vertices(clip, most)
    if np.count_nonzero(still) < LEAST_STILL or still.all():
        return None
    links, is_linked = _links(clip)
    label = components(links, clip.vertex_count)
    size, standing = np.bincount(label), np.bincount(label, still)
    inside = _inside(still, links)
    apart = (standing == size) | (np.bincount(label, inside) >= INSIDE_SHARE * size)
    chosen: np.ndarray = np.where((standing == size)[label], True, inside) & apart[label]
    points = np.flatnonzero(chosen & ~is_linked)
    chosen[points[_are_feet(np.asarray(clip.rest), points, ~still, label[points])]] = False
    return chosen if LEAST_STILL <= np.count_nonzero(chosen) < clip.vertex_count else None


def _are_feet(rest: np.ndarray, points: np.ndarray, moves: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return for each of `points`, (K,) vertices that stand still and have no links, whether it is in a group of feet
    of plants, and not of the ground, (K,) bool. Next to many of the feet in a group there is a moving vertex: right
    above it and nearest to no other point, or beside it in the order of the source. `rest`: (N, 3) positions; `moves`:
    (N,) bool; `label`: the group of each point, (K,).
    """
    if not len(points):
        return np.zeros(0, bool)
    count = np.bincount(label)
    nearest = scipy_module("spatial").cKDTree(rest[moves]).query(rest[points])[1]
    above = np.bincount(np.unique(np.stack([label, nearest]), axis=1)[0], minlength=len(count))
    around = np.pad(moves, 1)
    beside = np.bincount(label, around[points] | around[points + 2])
    return (np.maximum(above, beside) >= FEET_SHARE * count)[label]


def _still_vertices(clip: MotionClip, most: float) -> np.ndarray:
    """Return which vertices stay within `most` scene units of their place in the rest pose, (N,) bool. Frames are read
    only until too few such vertices are left to matter.
    """
    rest = clip.source_rest
    still = np.ones(clip.vertex_count, bool)
    for _, block in clip.blocks():
        some = np.flatnonzero(still)
        away = block[:, some] != rest[some]
        moved = away.any(axis=(0, 2))
        if most > 0 and moved.any():
            apart = block[:, some[moved]].astype(np.float64) - rest[some[moved]]
            moved[moved] = np.square(apart).sum(axis=2).max(axis=0) > most**2
        still[some[moved]] = False
        if np.count_nonzero(still) < LEAST_STILL:
            break
    return still


def _links(clip: MotionClip) -> tuple[np.ndarray, np.ndarray]:
    """Return two things: pairs of vertices that belong together, (L, 2), which edges or sides of faces join, or
    nearness where a vertex has neither; and which vertices have edges or faces, (N,) bool.
    """
    links = links_of(clip)
    bare = np.ones(clip.vertex_count, bool)
    bare[links] = False
    points = np.flatnonzero(bare)
    if len(points) > 1:
        links = np.concatenate([links, points[near_neighbours(np.asarray(clip.rest)[points], NEIGHBOURS)]])
    return links, ~bare


def _inside(still: np.ndarray, links: np.ndarray) -> np.ndarray:
    """Return which vertices are inside of what stands still, (N,) bool: they stand still, and they or a neighbour have
    none but neighbours that stand still. `still`: (N,) bool; `links`: (L, 2) pairs of neighbours.
    """
    core = still.copy()
    for here, there in (links.T, links.T[::-1]):
        core[here[~still[there]]] = False
    inside = core.copy()
    for here, there in (links.T, links.T[::-1]):
        inside[here[core[there]]] = True
    return inside & still


def clip_among(clip: MotionClip, vertices: np.ndarray, is_still: bool = False) -> MotionClip:
    """Return a clip of some of a clip's vertices, with the edges, faces and attributes of theirs by which branches are
    found. `vertices`: their numbers, ascending; `is_still`: whether the rest pose is to be the only frame.
    """
    rest = clip.source_rest[vertices]
    if is_still:
        positions, time = rest[None].astype(clip.dtype), clip.time[:1]
    else:
        frames = Frames(lambda a, b: clip.block(a, b)[:, vertices], clip.frame_count, len(vertices), clip.dtype)
        frames.chunks = getattr(clip.positions, "chunks", None)
        positions, time = frames, clip.time
    some = MotionClip(
        positions,
        time,
        rest=rest,
        edges=_among(clip.edges, vertices),
        faces=_among(clip.faces, vertices),
        attributes=_attributes(clip, vertices),
        metadata=clip.metadata,
        clip_ranges=() if is_still else clip.clip_ranges,
    )
    some.rest_given = clip.rest_given
    return some


def _among(rows: np.ndarray | None, vertices: np.ndarray) -> np.ndarray | None:
    """Return the edges or faces all of whose vertices are among these, ascending, by their numbers there."""
    kept = None if rows is None else Polygons.of_rows(rows).among(vertices)
    return kept.rows if kept is not None and kept.face_count else None


def _attributes(clip: MotionClip, vertices: np.ndarray) -> dict[str, np.ndarray]:
    """Return those attributes by which branches are found, such as polygons and parts, for some of the clip's vertices.
    `vertices`: their numbers, ascending.
    """
    polygons = Polygons.of_attributes(clip.attributes)
    kept = None if polygons is None else polygons.among(vertices)
    arrays = kept.attributes if kept is not None and kept.face_count else {}
    parts = clip.attributes.get("part_vertex_counts")
    if parts is not None and parts.ndim == 1 and parts.dtype.kind in "iu" and parts.sum() == clip.vertex_count:
        of_vertex = np.repeat(np.arange(len(parts)), parts)[vertices]
        arrays["part_vertex_counts"] = left = np.bincount(of_vertex, minlength=len(parts)).astype(parts.dtype)
        copies = clip.attributes.get("part_copies")
        if copies is not None and copies.shape == parts.shape:
            arrays["part_copies"] = np.where(left == parts, copies, 1).astype(copies.dtype)
    return arrays


def joined(clip: MotionClip, still: np.ndarray, moving: Found, standing: Found) -> Found:
    """Put the branches of two parts of a clip together as branches of the whole clip. `still`: which vertices stand
    still, (N,) bool; `moving`, `standing`: the branches of the other vertices, and of these.
    """
    first = len(moving.branch_parent)
    label, place = np.empty((2, clip.vertex_count), np.int64)
    label[~still], label[still] = moving.vertex_branch, standing.vertex_branch + first
    for some, branches in ((~still, moving), (still, standing)):
        index = branches.stem_index
        place[some] = source_stem_index(branches.vertex_branch) if index is None else index
    above = standing.branch_parent.astype(np.int64)
    parent = np.concatenate([moving.branch_parent, np.where(above < 0, -1, above + first)])
    joint = checked_branches(label, parent, place, moving.method)
    if moving.stem_index is None and standing.stem_index is None:
        joint = replace(joint, stem_index=None)
    links = [
        np.flatnonzero(some)[branches.links]
        for some, branches in ((~still, moving), (still, standing))
        if branches.links is not None
    ]
    return replace(joint, array_name=moving.array_name, links=np.concatenate(links) if links else None)
