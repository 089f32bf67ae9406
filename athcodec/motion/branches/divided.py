"""Parts of a clip whose branches are found apart and put together: what stands still, and plants side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from athcodec.motion.branches.result import Found, checked_branches
from athcodec.motion.branches.seen import components, links_of
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.clip import MotionClip, source_stem_index
from athcodec.motion.frames import Frames
from athcodec.motion.polygons import Polygons

GAP = 1 / 64  # Of the diagonal: points further apart than about twice this are of two plants.
SPARSE_GAP = 4.0  # The same over the usual distance of a point from its nearest neighbour, if that is more.
LEAST_PLANT = 1 / 20  # Part of the points below which what stands apart counts as one of many.
LEAST_POINTS = 64  # Points below which it does, too.


def plants_apart(clip: MotionClip) -> np.ndarray | None:
    """Return the number of the plant that each vertex is of, (N,), for points that nothing joins, of plants that stand
    apart from each other; what is small and away from them counts as one. None: there is one plant.
    """
    points = np.asarray(clip.rest, np.float64)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if len(points) < 2 * LEAST_POINTS or not size > 0 or len(links_of(clip)):
        return None
    tree = scipy_module("spatial").cKDTree
    nearest = tree(points).query(points, k=2)[0][:, 1]
    gap = max(GAP * size, SPARSE_GAP * float(np.median(nearest)))
    cells, cell = np.unique(np.floor((points - points.min(axis=0)) / gap), axis=0, return_inverse=True)
    near = tree(cells).query_pairs(1.8, output_type="ndarray")  # They touch at a corner.
    label = components(near, len(cells))[cell.reshape(-1)]
    is_large = np.bincount(label) >= max(LEAST_PLANT * len(points), LEAST_POINTS)
    large = np.flatnonzero(is_large)
    if not len(large):
        return None
    plant = np.arange(len(large))
    while True:  # Boughs of a crown stand apart, but the boxes around them reach into each other.
        boxes = _boxes(points[is_large[label]], plant[np.searchsorted(large, label[is_large[label]])])
        met = components(np.argwhere(_meet(boxes, boxes)), len(boxes[0]))
        if met.max() + 1 == len(met):
            break
        plant = met[plant]
    near = _meet(_boxes(points, label), boxes)
    other = np.where(near.any(axis=1), near.argmax(axis=1), len(boxes[0]))
    other[large] = plant
    number = other[label]
    if 0 < np.count_nonzero(number == len(boxes[0])) < LEAST_POINTS:
        number[number == len(boxes[0])] = 0
    return number if number.any() else None


def _boxes(points: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest coordinates of each group of points, (G, 3) each. `group`: (N,)."""
    low = np.full((group.max(initial=-1) + 1, 3), np.inf)
    high = -low
    np.minimum.at(low, group, points)
    np.maximum.at(high, group, points)
    return low, high


def _meet(boxes: tuple[np.ndarray, np.ndarray], others: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return which of some boxes, (A,), meet which of others, (B,), (A, B) bool."""
    meet: np.ndarray = (boxes[0][:, None] <= others[1]) & (others[0] <= boxes[1][:, None])
    return np.all(meet, axis=2)


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


def joined(clip: MotionClip, part: np.ndarray, found: Sequence[Found]) -> Found:
    """Put the branches of the parts of a clip together as branches of the whole clip. `part`: the number of the part
    that each vertex is of, (N,); `found`: the branches of each part.
    """
    label, place = np.empty((2, clip.vertex_count), np.int64)
    parents, links, before = [], [], 0
    for number, branches in enumerate(found):
        some = np.flatnonzero(part == number)
        label[some] = branches.vertex_branch + before
        index = branches.stem_index
        place[some] = source_stem_index(branches.vertex_branch) if index is None else index
        above = branches.branch_parent.astype(np.int64)
        parents.append(np.where(above < 0, -1, above + before))
        links += [] if branches.links is None else [some[branches.links]]
        before += len(above)
    joint = checked_branches(label, np.concatenate(parents), place, found[0].method)
    if all(branches.stem_index is None for branches in found):
        joint = replace(joint, stem_index=None)
    return replace(joint, array_name=found[0].array_name, links=np.concatenate(links) if links else None)
