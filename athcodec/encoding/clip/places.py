"""Finding the places of a clip's vertices, and the clip with one vertex for each place, which is what is coded.

All frames are read once, block by block, and no longer than vertices are left that have been equal so far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from athcodec._native import address, lib
from athcodec.encoding.options.weights import ErrorWeights
from athcodec.motion.branches.finding import named_labels
from athcodec.motion.branches.grown_pose import grown_pose
from athcodec.motion.branches.result import Found
from athcodec.motion.branches.seen import copies_of, parts_by_sides, parts_of
from athcodec.motion.clip import MotionClip, Skin, stem_index_of
from athcodec.motion.frames import Frames
from athcodec.motion.hierarchy import is_forest
from athcodec.motion.places import Places
from athcodec.motion.polygons import POLYGON_ARRAYS

NEAR_SHARE = 0.98  # Largest share of places that are left where near vertices are joined.
MIXER = np.uint64(0x9E3779B97F4A7C15)  # Odd, so that multiplying by it loses nothing.


@dataclass(frozen=True)
class PlacedClip:
    """A clip as the source has it, and as it is coded.

    source : MotionClip
        With all vertices.
    places : Places
        Which of them are at one place.
    clip : MotionClip
        With a vertex for each place, but without other attributes than branches are found by. It is `source` itself
        if no vertices share a place.
    weights : ErrorWeights or None
        Factors on the bound of all vertices.
    """

    source: MotionClip
    places: Places
    clip: MotionClip
    weights: ErrorWeights | None = None

    @classmethod
    def of(cls, source: MotionClip, places: Places | None = None, weights: ErrorWeights | None = None) -> PlacedClip:
        """Return the clip with these places; None: each vertex has its own."""
        places = Places.apart(source.vertex_count) if places is None else places
        return cls(source, places, clip_of_places(source, places) if places.are_shared else source, weights)

    @cached_property
    def grown_pose(self) -> np.ndarray:
        """The pose of `clip` that shows most of it, (P, 3): its rest pose, or the frame in which it is most grown."""
        pose = grown_pose(self.clip)
        return self.clip.source_rest if pose is None else pose

    def apart(self) -> PlacedClip | None:
        """Return this clip with more places: parts of its mesh that touch at a single place, and not along a side of a
        face, get places of their own there. Return None if no parts touch like that.
        """
        if not self.places.are_shared or self.clip.polygons is None:
            return None
        part = parts_by_sides(self.source, self.places)
        if part is None:
            return None
        places = Places.of_labels(self.places.of_vertex, part, error=self.places.error)
        places = _alike_in_copies(self.source, places)
        return None if places.count == self.places.count else PlacedClip.of(self.source, places, self.weights)

    def regular(self) -> PlacedClip | None:
        """Return the clip with objects of as many vertices joined alike, where vertices coincide in some of them and
        differ by roundings in others; None: they are alike."""
        part = parts_of(self.source)
        if part is None or not self.places.are_shared:
            return None
        places = _alike_in_runs(self.places, np.bincount(part))
        return None if places.count == self.places.count else PlacedClip.of(self.source, places, self.weights)

    def moved_to(self, branches: Found, other: PlacedClip) -> Found:
        """Return branches of these places for those of another clip of the same vertices."""
        of_place = self.places.of_vertex[other.places.first]
        branch = branches.vertex_branch[of_place]
        stem_index = None if branches.stem_index is None else stem_index_of(branch, branches.stem_index[of_place])
        links = None if branches.links is None else other.places.of_vertex[self.places.first[branches.links]]
        return replace(branches, vertex_branch=branch, stem_index=stem_index, links=links)


def find_places(
    clip: MotionClip, labels: Sequence[np.ndarray] = (), zeros_differ: bool = False, most_error: float = 0.0
) -> Places:
    """Find the places of a clip, that is, which vertices coincide for ever. Two vertices are at one place if all their
    coordinates are equal in the rest pose and in every frame, and if they are of the same branch, object and copy, as
    far as the source tells these. Vertices that stay within `most_error` of each other, and would not make two corners
    of a face meet, are put at one place, too, if that takes away at least 2 % of the places: programs compute or print
    the position of a place more than once, with different roundings.

    Parameters
    ----------
    clip : MotionClip
    labels : sequence of (N,) arrays
        What vertices of one place also have in common, such as factors on the bound.
    zeros_differ : bool
        Whether 0.0 and -0.0 are different coordinates.
    most_error : float
        Scene units; 0: only what is equal is at one place.

    Raises
    ------
    ClipError
        For positions that are not finite or cannot be read.
    """
    joined = [*_labels(clip), *labels]
    leader = _leaders_of_first_frame(clip, joined, zeros_differ)
    followers = _followers(leader)
    for _, block in clip.blocks() if len(followers) else ():
        followers = _split(block, leader, followers, zeros_differ)
        if not len(followers):
            break
    places = _numbered(leader)
    if most_error > 0:
        near = _join_near(clip, leader, joined, most_error)
        places = near if near.count <= NEAR_SHARE * places.count else places
    return places if not places.are_shared else _in_order_of_stems(clip, _alike_in_copies(clip, places))


def _in_order_of_stems(clip: MotionClip, places: Places) -> Places:
    """Divide places whose vertices do not follow each other along a stem, so that the order along stems that the source
    states (`stem_index`) can be kept. Vertices of one of the given `places` stay together only where they are
    consecutive in the order of branch and stem index, and their numbers ascend there. Return the divided places, or
    `places` itself if the clip states no such order.
    """
    if clip.stem_index is None or clip.vertex_branch is None:
        return places
    order = np.lexsort((clip.stem_index, clip.vertex_branch))
    place = places.of_vertex[order]
    begins = np.append(True, (place[1:] != place[:-1]) | (order[1:] < order[:-1]))
    run = np.empty(len(order), np.int64)
    run[order] = np.cumsum(begins)
    return Places.of_labels(run, places.of_vertex, error=places.error)


def clip_of_places(clip: MotionClip, places: Places) -> MotionClip:
    """Return a clip that has one vertex for each of `places`: the first vertex of the place in `clip`. Its frames are
    read from `clip` when they are asked for.
    """
    first, of_vertex = places.first, places.of_vertex
    positions = Frames(
        lambda start, stop: np.take(clip.block(start, stop), first, axis=1), clip.frame_count, len(first), clip.dtype
    )
    positions.chunks = getattr(clip.positions, "chunks", None)
    stem_index = None
    if clip.stem_index is not None and clip.vertex_branch is not None:
        stem_index = stem_index_of(clip.vertex_branch[first], clip.stem_index[first])
    skin = clip.skin and Skin(clip.skin.joint_parent, clip.skin.vertex_joint[first], clip.skin.names)
    edges = None if clip.edges is None else of_vertex[clip.edges]
    coded = MotionClip(
        positions,
        clip.time,
        None if clip.vertex_branch is None else clip.vertex_branch[first],
        clip.branch_parent,
        clip.source_rest[first],
        None if edges is None else edges[edges[:, 0] != edges[:, 1]],
        None if clip.faces is None else of_vertex[clip.faces],
        _attributes(clip, places),
        clip.metadata,
        stem_index=stem_index,
        clip_ranges=clip.clip_ranges,
        unchanged=clip.unchanged,
        skin=skin,
        not_read=clip.not_read,
    )
    coded.rest_given = clip.rest_given
    return coded


def _attributes(clip: MotionClip, places: Places) -> dict[str, np.ndarray]:
    """Return the attributes of a clip by name, where arrays of one row per vertex are replaced by arrays of one row per
    place, that of its first vertex. Corners of polygons and counts of vertices of parts are renumbered for places
    likewise.
    """
    domains = clip.metadata.get("domains")
    domains = domains if isinstance(domains, dict) else {}
    arrays = {}
    for name, array in clip.attributes.items():
        if name == POLYGON_ARRAYS[1] and array.ndim == 1 and array.dtype.kind in "iu":
            arrays[name] = places.of_vertex[array]
        elif array.ndim and len(array) == clip.vertex_count and domains.get(name, "vertex") == "vertex":
            arrays[name] = array[places.first]
        else:
            arrays[name] = array
    counts = clip.attributes.get("part_vertex_counts")
    if counts is not None and parts_of(clip) is not None:
        part = np.repeat(np.arange(len(counts)), counts)[places.first]
        arrays["part_vertex_counts"] = np.bincount(part, minlength=len(counts)).astype(counts.dtype)
    return arrays


def _labels(clip: MotionClip) -> list[np.ndarray]:
    """Return arrays, (N,), by which vertices are of different places whatever their positions are."""
    branch = clip.vertex_branch if clip.has_branches else named_labels(clip)
    return [label for label in (parts_of(clip), branch) if label is not None] + _edge_parts(clip)


def _edge_parts(clip: MotionClip) -> list[np.ndarray]:
    """Return a list of one label array, (N,), that keeps apart centre lines that cross at a point without a fork: the
    number of the connected part of each vertex. The list is empty unless the clip consists of centre lines without
    cycles and without branches, whose edges would close cycles if coinciding vertices were joined.
    """
    if clip.edges is None or clip.has_branches or clip.polygons is not None:
        return []
    if not is_forest(clip.edges, clip.vertex_count):
        return []
    leader = _leaders_of_first_frame(clip, [], False)
    ends = leader[clip.edges]
    joined = np.unique(np.sort(ends[ends[:, 0] != ends[:, 1]], axis=1), axis=0)
    return [] if is_forest(joined, clip.vertex_count) else [_parts_of_edges(clip.edges, clip.vertex_count)]


def _parts_of_edges(edges: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return the connected part of each vertex, (N,), named by the smallest vertex in it. `edges`: (E, 2) pairs of
    vertices that are connected.
    """
    label = np.arange(vertex_count)
    ends = edges.astype(np.int64)
    while (label[ends[:, 0]] != label[ends[:, 1]]).any():
        np.minimum.at(label, label[ends], label[ends].min(axis=1, keepdims=True))
        while not np.array_equal(label, label[label]):
            label = label[label]
    return label


def _leaders_of_first_frame(clip: MotionClip, labels: Sequence[np.ndarray], zeros_differ: bool) -> np.ndarray:
    """Return for each vertex its leader, (N,): the first vertex that has the same labels, and the same position both in
    the rest pose and in the first frame. `labels`: arrays (N,); `zeros_differ`: whether 0.0 and -0.0 are different
    coordinates.
    """
    every = np.arange(clip.vertex_count, dtype=np.int32)
    hashes = np.zeros(clip.vertex_count, np.uint64)
    numbers = [np.unique(label, return_inverse=True)[1].reshape(-1) for label in labels]
    for number in numbers:
        hashes = (hashes ^ number.astype(np.uint64)) * MIXER
    blocks = clip.rest[None], clip.block(0, 1)
    for block in blocks:
        _mix(block, every, hashes, zeros_differ)
    leader = _first_of_each(hashes, every)
    followers = _followers(leader)
    apart = np.zeros(len(followers), bool)
    for number in numbers:
        apart |= number[followers] != number[leader[followers]]
    for block in blocks:
        apart |= _are_apart(block, followers, leader[followers], zeros_differ)
    leader[followers[apart]] = followers[apart]  # Only a collision of hashes leads here.
    return leader


def _split(block: np.ndarray, leader: np.ndarray, followers: np.ndarray, zeros_differ: bool) -> np.ndarray:
    """Give new leaders, in `leader` (N,), to those followers whose position differs from their leader's in a block of
    frames. Return the vertices that still have a leader other than themselves.

    `block`: (k, N, 3) positions; `followers`: vertices whose leader is another vertex; `zeros_differ`: whether 0.0 and
    -0.0 are different coordinates.
    """
    apart = _are_apart(block, followers, leader[followers], zeros_differ)
    if not apart.any():
        return followers
    some = followers[apart]
    hashes = leader[some].astype(np.uint64) * MIXER
    _mix(block, some, hashes, zeros_differ)
    new = _first_of_each(hashes, some)
    lone = (leader[new] != leader[some]) | _are_apart(block, some, new, zeros_differ)
    leader[some] = np.where(lone, some, new)
    return followers[leader[followers] != followers]


def _followers(leader: np.ndarray) -> np.ndarray:
    return np.flatnonzero(leader != np.arange(len(leader))).astype(np.int32)


def _first_of_each(hashes: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Return for each vertex, ascending, the first one with its hash."""
    order = np.argsort(hashes, kind="stable")
    begins = np.flatnonzero(np.diff(hashes[order], prepend=~hashes[order[:1]]))
    first = np.empty_like(vertices)
    first[order] = np.repeat(vertices[order[begins]], np.diff(np.append(begins, len(order))))
    return first


def _mix(block: np.ndarray, vertices: np.ndarray, hashes: np.ndarray, zeros_differ: bool) -> None:
    """Mix the positions of vertices in a block of frames into their hashes."""
    block = np.ascontiguousarray(block)
    lib.ath_hash_positions(
        *(len(vertices), address(vertices, np.int32, len(vertices)), block.shape[0], block.shape[1]),
        *(block.dtype == np.float64, zeros_differ, block.ctypes.data, hashes.ctypes.data),
    )


def _are_apart(block: np.ndarray, vertices: np.ndarray, others: np.ndarray, zeros_differ: bool) -> np.ndarray:
    """Return for each i whether vertices[i] and others[i] have different positions in any frame of a block, (K,) bool.
    `block`: (k, N, 3) positions; `zeros_differ`: whether 0.0 and -0.0 are different coordinates.
    """
    block, apart = np.ascontiguousarray(block), np.zeros(len(vertices), np.uint8)
    lib.ath_find_apart(
        *(len(vertices), address(vertices, np.int32, len(vertices)), address(others, np.int32, len(vertices))),
        *(block.shape[0], block.shape[1], block.dtype == np.float64, zeros_differ),
        *(block.ctypes.data, apart.ctypes.data),
    )
    return apart > 0


def _join_near(clip: MotionClip, leader: np.ndarray, labels: Sequence[np.ndarray], most_error: float) -> Places:
    """Return the places of a clip in which leaders that stay within `most_error` of each other in every frame are
    joined, too. `leader`: (N,) the first vertex at the place of each vertex; `labels`: arrays (N,) that are equal for
    vertices of one place.
    """
    some = np.flatnonzero(leader == np.arange(len(leader))).astype(np.int32)
    label = np.zeros(len(some), np.int32)
    if labels:
        label = Places.of_labels(*(array[some] for array in labels)).of_vertex
    near = some[_near_leaders(_typical_poses(clip)[:, some], label, most_error)]
    near = np.where(_share_a_face(clip, leader, some, near), some, near)
    followers, others = some[near != some], near[near != some]
    squares = np.zeros(len(followers))
    for _, block in clip.blocks() if len(followers) else ():
        block = np.ascontiguousarray(block)
        lib.ath_find_far(
            *(len(followers), address(followers, np.int32, 0), address(others, np.int32, 0)),
            *(block.shape[0], block.shape[1], block.dtype == np.float64, block.ctypes.data, squares.ctypes.data),
        )
        stay = squares <= most_error**2
        followers, others, squares = (np.ascontiguousarray(array[stay]) for array in (followers, others, squares))
        if not len(followers):
            break
    joined = leader.copy()
    joined[followers] = others
    return _numbered(joined[leader], float(np.sqrt(squares.max(initial=0.0))))


def _share_a_face(clip: MotionClip, leader: np.ndarray, some: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return which vertices of `some` must not be moved, (K,) bool: if each some[i] were put at the place of near[i],
    these would coincide with another corner of one of their faces, which would then have no area. `leader`: (N,) the
    first vertex at the place of each vertex.
    """
    if clip.polygons is None:
        return np.zeros(len(some), bool)
    counts, corners = clip.polygons
    joined = leader.copy()
    joined[some] = near
    face = np.repeat(np.arange(len(counts)), counts)
    before, after = leader[corners], joined[leader[corners]]
    order = np.lexsort((before, after, face))
    beside = (face[order[1:]] == face[order[:-1]]) & (after[order[1:]] == after[order[:-1]])
    meets = np.flatnonzero(beside & (before[order[1:]] != before[order[:-1]]))
    is_met = np.zeros(len(leader), bool)
    is_met[before[order[meets]]] = is_met[before[order[meets + 1]]] = True
    return is_met[some]


def _typical_poses(clip: MotionClip) -> np.ndarray:
    """Return the rest pose and the first, middle and last frame, (4, N, 3) float64."""
    frames = (0, clip.frame_count // 2, clip.frame_count - 1)
    return np.concatenate([clip.rest[None], *(clip.block(frame, frame + 1).astype(np.float64) for frame in frames)])


def _near_leaders(poses: np.ndarray, label: np.ndarray, tolerance: float) -> np.ndarray:
    """Return for each point the first point that is within `tolerance` of it in every pose and has the same label, (N,)
    int32. `poses`: (k, N, 3) positions; `label`: (N,) int32.
    """
    points, count = np.ascontiguousarray(poses.transpose(1, 0, 2)), poses.shape[1]
    table, leaders = 1 << count.bit_length(), np.empty(count, np.int32)
    work = np.empty(table + count, np.int32)
    widest = int(np.ptp(poses, axis=1).max(axis=1).argmax())
    lib.ath_find_near(
        *(count, len(poses), widest, points.ctypes.data, address(label, np.int32, count), tolerance),
        *(work.ctypes.data, table, leaders.ctypes.data),
    )
    return leaders


def _numbered(leader: np.ndarray, error: float = 0.0) -> Places:
    number = np.cumsum(leader == np.arange(len(leader)), dtype=np.int32) - 1
    return Places(number[leader].astype(np.int32), error)


def _alike_in_copies(clip: MotionClip, places: Places) -> Places:
    """Divide places so that all copies of one shape join the same vertices: two vertices of a copy stay at one place
    only if their counterparts are at one place in every other copy. Return the new places, or `places` if the clip has
    no copies.
    """
    copy, label = copies_of(clip), places.of_vertex.astype(np.int64)
    if not copy.any():
        return places
    counts, copies = clip.attributes["part_vertex_counts"], clip.attributes["part_copies"]
    for first, count, number in zip(np.cumsum(counts) - counts, counts.tolist(), copies.tolist()):
        if number > 1 and count:
            rows = slice(first, first + count)
            label[rows] = _joined_in_all(places.of_vertex[rows].reshape(number, -1)).reshape(-1)
    # Vertices that are no copies keep their labels; `copy` tells copies from each other and from those.
    return Places.of_labels(copy, label, error=places.error)


def _alike_in_runs(places: Places, counts: np.ndarray) -> Places:
    """Return places such that runs of as many vertices, of which there are `counts`, have as many."""
    first, label = np.cumsum(counts) - counts, places.of_vertex.astype(np.int64)
    for count in np.unique(counts):
        rows = first[counts == count][:, None] + np.arange(count)
        label[rows] = _joined_in_all(label[rows])
    return Places.of_labels(np.repeat(np.arange(len(counts)), counts), label, error=places.error)


def _joined_in_all(places: np.ndarray) -> np.ndarray:
    """Return labels (k, n) for k like parts of n vertices, by their places (k, n): two vertices have one label if all
    parts join them."""
    return np.broadcast_to(Places.of_labels(places.T).of_vertex, places.shape)
