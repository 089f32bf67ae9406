"""The branch hierarchy of a clip that names none: labels for its vertices, a tree over the labels, an order along each.

Labels come from attributes named like branch ids, from the joints of a skin, from an edge graph, from the connected
components of a render mesh, or from motion: runs of points that keep their distance (point_runs.py), or patches of a
mesh that move rigidly. All but runs and edge graphs are then arranged alike: a branch hangs where it stays closest to a
larger one in a few frames, and its vertices are put in order of their distance over the mesh from there. It looks at no
more than a few frames, and knows no file format but that of its own results (`save`, `load`).
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.atomic import new_file
from athcodec.motion.clip import MotionClip, check_branches, check_stem_index, source_stem_index, stands_still
from athcodec.motion.hierarchy import branch_orders, branches_from_edges
from athcodec.motion.point_runs import base_points, run_links, scipy_module
from athcodec.options import METHODS, whole

LABEL_NAMES = ("vertex_branch", "branch", "branch_id", "branchid", "branch_index", "branchindex", "branch_number")
PARENT_NAMES = ("branch_parent", "branchparent", "branch_parents", "parent_branch", "parent")

SAMPLE_FRAMES = 12  # of the clip, which the methods look at
NEIGHBOURS = 60  # vertices around each one among which those of other branches are looked for
LONE_PARTS = 64  # parts of the plant, at most, whose nearest others are looked for however far they are
QUERY = 1 << 21  # neighbours in one query
STAYING = 300.0  # weight of how constant the distance of two branches is, against how small it is
ALIKE = 4.0  # further cost of two branches of the same size: no leaf grows on a leaf
ROOT_SIZE = 0.25  # of the diagonal of the largest branch: smaller ones are no roots
LONE_POINTS = 0.1  # of the vertices, up to which runs are tried against no patches
WELD = 1e-6  # of the diagonal: vertices that stay closer than this are one vertex of a mesh that was split
COMPONENTS_AT_MOST = 0.6  # of the vertices: more components than that are no branches but loose points
IN_ORDER = 0.7  # rank correlation of the source's order with the distance from the base from which on it is kept
SMALL = 8  # vertices of a branch, up to which the source's order is kept in any case
PATCH_VERTICES = 150  # that a patch of a mesh without other branches has on average
SMALL_PATCH, LARGE_PATCH = 40, 600  # one of which is tried besides
LARGE_MESH = 10_000  # vertices from which on that is the large one
FREE_PATCHES = (64, 200)  # vertices of patches without parents
PATCH_ROUNDS = 8
MOST_PATCHES = 2000
CRUMB = 12  # vertices: smaller patches join a neighbour


@dataclass(frozen=True, eq=False)
class Found:
    """Branches that were found for a clip; `str` describes them in one line.

    Parameters
    ----------
    vertex_branch : (N,) int32 array
        The branch of each vertex.
    branch_parent : (B,) int32 array
        The branch that each branch grows on, -1 for a root.
    stem_index : (N,) int32 array or None
        The place of each vertex on its stem, as in MotionClip.
    method : str
        How they were found: "attributes", "skeleton", "edges", "components", "runs", "motion", or "file".
    """

    vertex_branch: np.ndarray
    branch_parent: np.ndarray
    stem_index: np.ndarray | None
    method: str

    def __str__(self) -> str:
        orders = branch_orders(self.branch_parent)
        roots = int((self.branch_parent < 0).sum())
        sizes = np.bincount(self.vertex_branch)
        return (
            f"{len(self.branch_parent):,} branches by {self.method}: {roots:,} without a parent, up to order "
            f"{orders.max()}, {sizes.min():,} to {sizes.max():,} vertices each"
        )


def candidates(clip: MotionClip) -> list[Found]:
    """What find_branches gives; and where that goes by motion, or by runs that leave many points alone, also patches of
    other sizes, patches without parents, and one single branch; where it welds pieces of a mesh, also the pieces: only
    a trial shows which of them makes the smallest file. A clip that stands still has no patches and no runs."""
    seen = _Seen(clip)
    single = Found(np.zeros(clip.vertex_count, np.int32), np.array([-1], np.int32), None, "motion")
    if stands_still(clip):
        found = _first_found(seen, METHODS[:-2], None)
        return [single] if found is None else [single, found]
    found = _first_found(seen, METHODS, None) or _by_motion(seen, None)
    if found.method == "skeleton":
        return [found, dataclasses.replace(found, stem_index=None)]
    lone = np.count_nonzero(np.bincount(found.vertex_branch) == 1)
    if found.method == "components":
        unwelded = pieces(clip)  # leaves that touch are welded, which is wrong where they move by themselves
        return [found] if len(unwelded.branch_parent) == len(found.branch_parent) else [found, unwelded]
    if found.method != "motion" and not (found.method == "runs" and lone > LONE_POINTS * clip.vertex_count):
        return [found]
    patches = [found] if found.method == "motion" else [found, _by_motion(seen, None)]
    return [single, *patches, *_more_patches(seen)]


def _more_patches(seen: _Seen) -> list[Found]:
    """Patches of another size than usual, and such without parents."""
    if seen.clip.vertex_count >= LARGE_MESH:
        return [_by_motion(seen, None, LARGE_PATCH), _free_patches(seen, FREE_PATCHES[-1])]
    return [_by_motion(seen, None, SMALL_PATCH), *(_free_patches(seen, size) for size in FREE_PATCHES)]


def find_branches(clip: MotionClip, method: str = "auto", root: int | None = None) -> Found:
    """Find branches for a clip; those that it has are not looked at.

    Parameters
    ----------
    clip : MotionClip
    method : str, optional
        "attributes": arrays named like branch numbers, per vertex or face. "skeleton": the joints that moved the
        vertices. "edges": a graph of centre lines. "components": the connected components of a mesh. "runs": points
        without faces or edges, linked to those that keep their distance: blades, needles, strands, centre lines.
        "motion": patches that move rigidly. "auto": the first of these that the clip has the data for.
    root : int, optional
        A vertex of the branch that all others hang on, directly or not; by default the largest branch is that.

    Returns
    -------
    Found
        The branches; a clip gets them by ``clip.replace(vertex_branch=..., branch_parent=..., stem_index=...)``.

    Raises
    ------
    ClipError
        Where the clip does not have the data that the method needs.
    MissingExtra
        Where scipy is missing.
    ValueError
        For a method that does not exist.
    """
    if method != "auto" and method not in METHODS:
        raise ValueError(f"method: got {method!r}, expected auto or one of {', '.join(METHODS)}")
    root = None if root is None else whole("root", root)
    found = _first_found(_Seen(clip), METHODS if method == "auto" else (method,), root)
    if found is None:
        raise ClipError(f"branches: the clip has nothing to find them by {method}, expected {_EXPECTED[method]}")
    return found


def pieces(clip: MotionClip) -> Found:
    """The connected pieces of a clip's mesh as branches without parents: what can be had without scipy.

    Parameters
    ----------
    clip : MotionClip

    Returns
    -------
    Found
        A single branch where there is one piece, or too many of few vertices.
    """
    links, label = _links(clip), np.arange(clip.vertex_count)
    while len(links) and (label[links[:, 0]] != label[links[:, 1]]).any():
        ends = label[links]
        np.minimum.at(label, ends, ends.min(axis=1, keepdims=True))
        while not np.array_equal(label, label[label]):
            label = label[label]
    label = _numbered(label)
    if label.max() >= COMPONENTS_AT_MOST * clip.vertex_count:
        label[:] = 0
    return Found(label.astype(np.int32), np.full(label.max() + 1, -1, np.int32), None, "components")


class _Seen:
    """What the methods look at in a clip, each made once, when it is asked for."""

    def __init__(self, clip: MotionClip):
        self.clip = clip

    @cached_property
    def frames(self) -> np.ndarray:
        """(1 + k, N, 3) float64: the rest pose and a few frames spread over the clip."""
        return _sampled(self.clip)

    @cached_property
    def mesh(self) -> np.ndarray:
        """(L, 2) pairs of vertices that edges or sides of faces join."""
        return _links(self.clip)

    @cached_property
    def links(self) -> np.ndarray:
        """The same, and what stays at one place."""
        return _welded(self.clip, self.mesh)


def _first_found(seen: _Seen, methods: Sequence[str], root: int | None) -> Found | None:
    """By the first method that has something to go by; motion always has."""
    return next((found for found in (_FINDERS[name](seen, root) for name in methods) if found is not None), None)


def with_branches(clip: MotionClip, found: Found) -> MotionClip:
    """The clip on branches that were found. Raises ClipError where they are for another number of vertices."""
    return clip.replace(
        vertex_branch=found.vertex_branch, branch_parent=found.branch_parent, stem_index=found.stem_index
    )


# ---- results that a user keeps, edits and uses again ----


def save(found: Found, path: str | os.PathLike[str]) -> None:
    """Write branches to a JSON file that a user can edit, one line per branch.

    Parameters
    ----------
    found : Found
    path : str or path
        The file: of each branch its parent, and its vertices from base to tip as runs, "0-5 9". Older JSON is replaced,
        no other file.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    order = _stem_order(found.vertex_branch, found.stem_index)
    bounds = np.searchsorted(found.vertex_branch[order], np.arange(len(found.branch_parent) + 1))
    lines = [
        json.dumps({"branch": branch, "parent": int(parent), "vertices": _runs(order[first:last])})
        for branch, (parent, first, last) in enumerate(zip(found.branch_parent, bounds[:-1], bounds[1:]))
    ]
    with new_file(path) as file:
        file.write(f'{{"vertex_count": {len(order)}, "method": {json.dumps(found.method)}, "branches": [\n'.encode())
        file.write(",\n".join(lines).encode() + b"\n]}\n")


def load(path: str | os.PathLike[str]) -> Found:
    """Read branches from a file of `save`.

    Parameters
    ----------
    path : str or path
        The numbers of the branches in it may be any, in any order.

    Returns
    -------
    Found

    Raises
    ------
    ClipError
        Where the file is no such JSON, or does not have every vertex once.
    OSError
        Where it cannot be opened.
    """
    with open(path, encoding="utf-8") as file:
        try:
            content = json.load(file)
            vertex_count, branches = int(content["vertex_count"]), content["branches"]
            numbers = {branch["branch"]: number for number, branch in enumerate(branches)}
            parent = np.array([numbers.get(branch["parent"], -1) for branch in branches], np.int64)
            stems = [_vertices(branch["vertices"], vertex_count) for branch in branches]
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ClipError(
                f"{os.fspath(path)}: got no branches ({type(error).__name__}: {error}), expected the JSON "
                "that athcodec hierarchy --save writes"
            ) from None
    labels = np.repeat(np.arange(len(stems)), [len(stem) for stem in stems])
    order = np.concatenate(stems) if stems else np.zeros(0, np.int64)
    if len(numbers) != len(branches) or not np.array_equal(np.sort(order), np.arange(vertex_count)):
        raise ClipError(
            f"{os.fspath(path)}: got vertices or branches twice or not at all, expected each of "
            f"{vertex_count} vertices once"
        )
    vertex_branch = np.empty(vertex_count, np.int64)
    vertex_branch[order] = labels
    place = np.concatenate([np.arange(len(stem)) for stem in stems])
    stem_index = np.empty(vertex_count, np.int64)
    stem_index[order] = place
    return _found(vertex_branch, parent, stem_index, "file")


def _runs(vertices: np.ndarray) -> str:
    """ "0-5 9 7" for 0 1 2 3 4 5 9 7."""
    breaks = np.flatnonzero(np.diff(vertices) != 1) + 1
    firsts, lasts = vertices[np.append(0, breaks)], vertices[np.append(breaks, len(vertices)) - 1]
    return " ".join(f"{a}-{b}" if a != b else f"{a}" for a, b in zip(firsts.tolist(), lasts.tolist()))


def _vertices(text: str, vertex_count: int) -> np.ndarray:
    bounds = [[int(number) for number in run.split("-")] for run in text.split()]
    if any(not 0 <= run[0] <= run[-1] < vertex_count for run in bounds):
        raise ValueError(f"vertices {text[:40]!r}")
    return np.concatenate([np.arange(run[0], run[-1] + 1) for run in bounds]) if bounds else np.zeros(0, np.int64)


def _stem_order(vertex_branch: np.ndarray, stem_index: np.ndarray | None) -> np.ndarray:
    return np.lexsort((np.arange(len(vertex_branch)) if stem_index is None else stem_index, vertex_branch))


# ---- the methods ----


def _by_attributes(seen: _Seen, root: int | None) -> Found | None:
    """Labels that the source has under a usual name, for vertices or faces, and their parents if it has those too."""
    clip = seen.clip
    named = {name.lower().rsplit("/", 1)[-1].replace("primvars:", ""): array for name, array in clip.attributes.items()}
    labels = next(
        (label for label in (_vertex_labels(clip, named.get(name)) for name in LABEL_NAMES) if label is not None), None
    )
    if labels is None:
        return None
    names, vertex_branch = np.unique(labels, return_inverse=True)
    parents = next((named[name] for name in PARENT_NAMES if name in named), None)
    if parents is not None and parents.ndim == 1 and parents.dtype.kind in "iu" and len(parents) > names.max():
        own = parents[names].astype(np.int64)
        parent = np.where(np.isin(own, names), np.searchsorted(names, own).clip(0, len(names) - 1), -1)
        return _arranged(seen, vertex_branch, root, "attributes", parent)
    return _arranged(seen, vertex_branch, root, "attributes")


def _vertex_labels(clip: MotionClip, array: np.ndarray | None) -> np.ndarray | None:
    """Whole numbers from 0 on, one per vertex, of an array per vertex or per face; None where it is neither."""
    if array is None or array.size not in (len(array), 0) or array.dtype.kind not in "iuf":
        return None
    values = np.round(array.reshape(-1)).astype(np.int64) if array.size else array
    if len(values) == clip.vertex_count:
        return values if values.min() >= 0 else None
    polygons = clip.polygons
    if polygons is None or len(values) != len(polygons[0]) or values.min() < 0:
        return None
    labels = np.full(clip.vertex_count, -1, np.int64)
    labels[polygons[1][::-1]] = np.repeat(values, polygons[0])[::-1]
    return labels if labels.min() >= 0 else None


def _by_skeleton(seen: _Seen, root: int | None) -> Found | None:
    """Chains of joints: the vertices whose strongest weights are theirs. An object that no joint moves hangs on the one
    that is nearest."""
    clip = seen.clip
    if clip.skin is None or (clip.skin.vertex_joint >= 0).sum() == 0:
        return None
    joint, parents = clip.skin.vertex_joint.astype(np.int64), np.asarray(clip.skin.joint_parent)
    if (joint < 0).any():
        nearest, parts = _nearest_label(clip.rest, joint), _unlabelled_parts(clip, joint)
        joint = np.where(parts < 0, nearest[0], len(parents) + parts)
        order = np.lexsort((nearest[1], parts))
        first = order[np.flatnonzero(np.diff(parts[order], prepend=-1))]  # of each part the vertex that is nearest
        parents = np.concatenate([parents, nearest[0][first]])
    names, label = np.unique(joint, return_inverse=True)
    is_used = np.zeros(len(parents), bool)
    is_used[names] = True
    parent = np.array([_used_ancestor(int(name), parents, is_used) for name in names])
    parent = np.where(parent < 0, -1, np.searchsorted(names, parent))
    return _arranged(seen, label, root, "skeleton", parent)


def _used_ancestor(joint: int, parents: np.ndarray, is_used: np.ndarray) -> int:
    joint = int(parents[joint])
    while joint >= 0 and not is_used[joint]:
        joint = int(parents[joint])
    return joint


def _nearest_label(rest: np.ndarray, label: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N,) the label of the vertex that is nearest and has one, and how far away it is."""
    tree = scipy_module("spatial").cKDTree(rest[label >= 0])
    distance, place = tree.query(rest)
    return np.where(label >= 0, label, label[label >= 0][place]), distance


def _unlabelled_parts(clip: MotionClip, label: np.ndarray) -> np.ndarray:
    """(N,) of objects, and of each of their copies, that have no label at all, from 0 on; -1 for all other vertices."""
    counts, copies = (clip.attributes.get(name) for name in ("part_vertex_counts", "part_copies"))
    if counts is None or counts.ndim != 1 or counts.sum() != len(label):
        return np.full(len(label), -1)
    if copies is not None and copies.shape == counts.shape and (counts % np.maximum(copies, 1) == 0).all():
        counts = np.repeat(counts // np.maximum(copies, 1), np.maximum(copies, 1))
    part = np.repeat(np.arange(len(counts)), counts)
    is_bare = np.bincount(part, label >= 0, len(counts)) == 0
    place = np.cumsum(is_bare) - 1
    return np.where(is_bare[part], place[part], -1)


def _by_edges(seen: _Seen, root: int | None) -> Found | None:
    """Stems of a graph of centre lines; not for meshes, whose edges close cycles."""
    clip = seen.clip
    if clip.edges is None or not len(clip.edges) or clip.polygons is not None:
        return None
    try:
        up_axis = clip.metadata.get("up_axis", "y")
        branches = branches_from_edges(clip.edges, clip.vertex_count, clip.rest, root, up_axis)
    except ClipError:
        return None
    return Found(*branches, "edges")


def _by_components(seen: _Seen, root: int | None) -> Found | None:
    """Pieces of a mesh that hang together: bark tubes, leaf cards."""
    if not len(seen.mesh):
        return None
    vertex_count = seen.clip.vertex_count
    label = _components(seen.links, vertex_count)
    count = int(label.max()) + 1
    if count == 1 or count > COMPONENTS_AT_MOST * vertex_count:
        return None
    return _arranged(seen, label, root, "components")


def _by_runs(seen: _Seen, root: int | None) -> Found | None:
    """Points that nothing joins, linked to those that keep their distance: blades, needles, strands, centre lines."""
    if len(seen.mesh):
        return None
    frames = seen.frames[1:]  # the rest pose may have links of other lengths
    links = run_links(frames)
    if links is None:
        return None
    bases = base_points(frames, links, root)
    return Found(*branches_from_edges(links, seen.clip.vertex_count, seen.clip.rest, bases.tolist()), "runs")


def _by_motion(seen: _Seen, root: int | None, patch_vertices: int = PATCH_VERTICES) -> Found:
    """Patches that move rigidly, each on one that it touches."""
    return _arranged(seen, _patches(seen, patch_vertices), root, "motion")


def _free_patches(seen: _Seen, patch_vertices: int) -> Found:
    """Patches without parents: what moves as a blend of few poses, as skins do, stays one in the space of the clip."""
    label = _patches(seen, patch_vertices)
    return Found(label.astype(np.int32), np.full(label.max() + 1, -1, np.int32), None, "motion")


def _patches(seen: _Seen, patch_vertices: int) -> np.ndarray:
    """(N,) labels of patches grown over the mesh, or over near neighbours where there is none."""
    links = seen.links if len(seen.links) else _near_neighbours(seen.clip.rest, 8)
    return _rigid_patches(seen.frames, links, patch_vertices)


_FINDERS: dict[str, Callable[[_Seen, int | None], Found | None]] = {
    "attributes": _by_attributes,
    "skeleton": _by_skeleton,
    "edges": _by_edges,
    "components": _by_components,
    "runs": _by_runs,
    "motion": _by_motion,
}
_EXPECTED = {
    "attributes": f"an attribute per vertex or face named as one of {', '.join(LABEL_NAMES)}",
    "skeleton": "joints with weights",
    "edges": "edges without cycles and no faces",
    "components": "faces or edges in several separate pieces",
    "runs": "points without faces or edges, of which neighbours keep their distance",
    "motion": "vertices",
    "auto": "vertices",
}


# ---- what the methods share ----


def _arranged(seen: _Seen, label: np.ndarray, root: int | None, method: str, parent: np.ndarray | None = None) -> Found:
    """A tree over the labels, whose vertices run from base to tip."""
    frames, rest = seen.frames, seen.clip.rest
    if parent is None:
        joints = _joints(frames, label, _contacts(frames, label), root)
    else:
        joints = _joints_of(rest, frames, label, parent)
    return _found(label, joints.parent, _along(rest, label, joints, seen.links), method)


def _found(vertex_branch: np.ndarray, parent: np.ndarray, stem_index: np.ndarray, method: str) -> Found:
    vertex_branch, parent = check_branches(vertex_branch.astype(np.int64), parent.astype(np.int64), len(vertex_branch))
    return Found(vertex_branch, parent, check_stem_index(stem_index.astype(np.int64), vertex_branch), method)


def _sampled(clip: MotionClip) -> np.ndarray:
    """(1 + k, N, 3) float64: the rest pose and a few frames spread over the clip."""
    some = np.unique(np.linspace(0, clip.frame_count - 1, min(SAMPLE_FRAMES, clip.frame_count)).astype(int))
    return np.concatenate([clip.rest[None], *(clip.block(frame, frame + 1).astype(np.float64) for frame in some)])


def _links(clip: MotionClip) -> np.ndarray:
    """(L, 2) pairs of vertices that edges or sides of faces join."""
    pairs = [np.zeros((0, 2), np.int64)]
    if clip.edges is not None:
        pairs.append(clip.edges.astype(np.int64))
    if clip.polygons is not None:
        counts, indices = (array.astype(np.int64) for array in clip.polygons)
        following = np.arange(1, len(indices) + 1)
        ends = np.cumsum(counts)
        following[ends[counts > 0] - 1] = (ends - counts)[counts > 0]
        pairs.append(np.stack([indices, indices[following]], axis=1))
    copy = copies_of(clip)
    inside = np.flatnonzero((copy[1:] == copy[:-1]) & (copy[1:] > 0))
    pairs.append(np.stack([inside, inside + 1], axis=1))
    return np.concatenate(pairs)


def copies_of(clip: MotionClip) -> np.ndarray:
    """(N,) the number of the copy that each vertex is of, from 1 on; 0 for what is none (MotionClip, part_copies)."""
    counts, copies = (clip.attributes.get(f"part_{name}") for name in ("vertex_counts", "copies"))
    none = np.zeros(clip.vertex_count, np.int64)
    if counts is None or copies is None or counts.dtype.kind not in "iu" or copies.dtype.kind not in "iu":
        return none
    usable = counts.shape == copies.shape and counts.ndim == 1 and (counts >= 0).all() and (copies >= 1).all()
    usable = usable and (copies <= np.maximum(counts, 1)).all()
    if not usable or counts.sum(dtype=np.int64) != len(none) or (counts % copies).any():
        return none
    is_copied = np.repeat(copies > 1, counts)
    each = np.repeat(counts // copies, copies)
    return np.where(is_copied, np.repeat(np.arange(1, len(each) + 1), each), 0)


def _welded(clip: MotionClip, links: np.ndarray) -> np.ndarray:
    """`links`, and one between vertices that stay at the same place: seams of a mesh that was split for its normals."""
    rest = clip.rest
    last = clip.block(clip.frame_count - 1, clip.frame_count)[0].astype(np.float64)
    middle = clip.block(clip.frame_count // 2, clip.frame_count // 2 + 1)[0].astype(np.float64)
    step = max(WELD * float(np.linalg.norm(np.ptp(rest, axis=0))), 1e-30)
    cells = np.round(np.concatenate([rest, last, middle], axis=1) / step)
    order = np.lexsort(cells.T)
    copy = copies_of(clip)[order]
    same = np.flatnonzero((cells[order[1:]] == cells[order[:-1]]).all(axis=1) & (copy[1:] == copy[:-1]))
    return np.concatenate([links, np.stack([order[same], order[same + 1]], axis=1)])


def _components(links: np.ndarray, vertex_count: int) -> np.ndarray:
    """(N,) labels of the parts that links join, numbered by their first vertices."""
    sparse = scipy_module("sparse")
    graph = sparse.coo_matrix((np.ones(len(links), np.int8), links.T), (vertex_count, vertex_count))
    label = scipy_module("sparse.csgraph").connected_components(graph, directed=False)[1]
    return _numbered(label)


def _numbered(label: np.ndarray) -> np.ndarray:
    """Labels numbered from 0 on by their first vertices."""
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[inverse]


@dataclass(frozen=True)
class _Joints:
    """Where branches hang: parent (B,), -1 for a root, and base (B,), the vertex of their own that is nearest to it."""

    parent: np.ndarray
    base: np.ndarray


@dataclass(frozen=True)
class _Contacts:
    """Pairs of branches that may hang on each other: (C, 2) vertices of theirs, and what it costs, (C,)."""

    vertices: np.ndarray
    cost: np.ndarray


def _joints(frames: np.ndarray, label: np.ndarray, contacts: _Contacts, root: int | None) -> _Joints:
    """A tree of branches of the least cost in all, from a root outwards: of each part that no contact joins one."""
    count = int(label.max()) + 1
    own, other = label[contacts.vertices].T
    sparse, graphs = scipy_module("sparse"), scipy_module("sparse.csgraph")
    least = contacts.cost.max(initial=1e-30) * 1e-9  # a cost of nothing would be no contact
    graph = sparse.coo_matrix((contacts.cost + least, (own, other)), (count, count)).tocsr()
    tree = graphs.minimum_spanning_tree(graph)
    parts = graphs.connected_components(tree, directed=False)[1]
    still = _stillest(frames, label)
    roots = _roots(frames, label, still, parts, root)
    hub = sparse.coo_matrix((np.ones(len(roots)), (np.full(len(roots), count), roots)), (count + 1, count + 1))
    whole = sparse.bmat([[tree, None], [None, sparse.coo_matrix((1, 1))]]) + hub
    parent = graphs.breadth_first_order(whole, count, directed=False)[1][:count]
    parent = np.where(parent == count, -1, parent)
    return _Joints(parent, _bases(parent, still, own, other, contacts.vertices))


def _bases(
    parent: np.ndarray, still: np.ndarray, own: np.ndarray, other: np.ndarray, vertices: np.ndarray
) -> np.ndarray:
    base = still.copy()
    for child, its_parent, vertex in ((own, other, vertices[:, 0]), (other, own, vertices[:, 1])):
        hangs = parent[child] == its_parent
        base[child[hangs]] = vertex[hangs]
    return base


def _joints_of(rest: np.ndarray, frames: np.ndarray, label: np.ndarray, parent: np.ndarray) -> _Joints:
    """Where branches touch the parents that they are known to have."""
    tree_of: dict[int, Any] = {}
    base, order = _stillest(frames, label), np.argsort(label, kind="stable")
    bounds = np.searchsorted(label[order], np.arange(len(parent) + 1))
    for branch in np.flatnonzero(parent >= 0).tolist():
        above = int(parent[branch])
        if above not in tree_of:
            tree_of[above] = scipy_module("spatial").cKDTree(rest[order[bounds[above] : bounds[above + 1]]])
        vertices = order[bounds[branch] : bounds[branch + 1]]
        base[branch] = vertices[tree_of[above].query(rest[vertices])[0].argmin()]
    return _Joints(parent, base)


def _stillest(frames: np.ndarray, label: np.ndarray) -> np.ndarray:
    """(B,) of each branch the vertex that moves least, where a root begins."""
    way = ((frames - frames[0]) ** 2).sum(axis=(0, 2))
    order = np.lexsort((way, label))
    return order[np.searchsorted(label[order], np.arange(label.max() + 1))]


def _roots(frames: np.ndarray, label: np.ndarray, still: np.ndarray, parts: np.ndarray, root: int | None) -> np.ndarray:
    """Of each part the branch that moves least somewhere, among those that are large."""
    size = _sizes(frames[0], label)
    largest = np.zeros(parts.max() + 1)
    np.maximum.at(largest, parts, size)
    way = ((frames[:, still] - frames[0, still]) ** 2).sum(axis=(0, 2))
    is_small = size < ROOT_SIZE * largest[parts]
    if root is not None:
        way[label[root]], is_small[label[root]] = -1.0, False
    order = np.lexsort((-size, way, is_small, parts))
    return order[np.unique(parts[order], return_index=True)[1]]


def _sizes(rest: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Diagonals of the branches' bounding boxes."""
    order = np.argsort(label, kind="stable")
    first = np.searchsorted(label[order], np.arange(label.max() + 1))
    low, high = (function.reduceat(rest[order], first) for function in (np.minimum, np.maximum))
    diagonals: np.ndarray = np.linalg.norm(high - low, axis=1)
    return diagonals


def _contacts(frames: np.ndarray, label: np.ndarray) -> _Contacts:
    """The pair of vertices of every two near branches that stays best at its distance: they may hang together there."""
    pairs = _near_pairs(frames[0], label)
    gap = np.linalg.norm(frames[0, pairs[:, 0]] - frames[0, pairs[:, 1]], axis=1)
    near = gap <= _sizes(frames[0], label)[label[pairs]].max(axis=1)
    pairs, cost = pairs[near], gap[near]
    for start in range(0, len(pairs), QUERY // len(frames)):
        some = slice(start, start + QUERY // len(frames))
        apart = np.linalg.norm(frames[:, pairs[some, 0]] - frames[:, pairs[some, 1]], axis=2)
        cost[some] += STAYING * apart.std(axis=0)
    size = np.bincount(label)[label[pairs]]
    cost[size[:, 0] == size[:, 1]] *= ALIKE
    both = np.sort(label[pairs], axis=1)
    best = _cheapest_of_each(both[:, 0] * (int(label.max()) + 1) + both[:, 1], cost)
    return _Contacts(pairs[best], cost[best])


def _near_pairs(rest: np.ndarray, label: np.ndarray) -> np.ndarray:
    """(C, 2) vertices and the nearest one to each on every branch that is near it."""
    cKDTree, count = scipy_module("spatial").cKDTree, int(label.max()) + 1
    found = [np.zeros((0, 2), np.int64), *_others_nearby(cKDTree(rest), rest, label, min(NEIGHBOURS, len(rest)))]
    part = _components(np.concatenate([label[pairs] for pairs in found]), count)
    sizes = np.bincount(part, np.bincount(label, minlength=count))
    for lone in np.argsort(-sizes)[1 : 1 + LONE_PARTS]:  # all that is near their vertices is of their own branch
        own = part[label] == lone
        vertices, others = np.flatnonzero(own), np.flatnonzero(~own)
        found.append(np.stack([vertices, others[cKDTree(rest[others]).query(rest[vertices])[1]]], axis=1))
    return np.concatenate(found)


def _others_nearby(tree: Any, rest: np.ndarray, label: np.ndarray, near: int) -> Iterator[np.ndarray]:
    """Pairs of vertices and those among their `near` nearest that are of other branches, one of each branch."""
    length = max(1, QUERY // near)
    for start in range(0, len(rest), length):
        some = np.arange(start, min(start + length, len(rest)))
        apart, others = (array.reshape(len(some), -1) for array in tree.query(rest[some], k=near))
        row, column = np.nonzero(label[others] != label[some][:, None])
        other = others[row, column]
        best = _cheapest_of_each(some[row] * (int(label.max()) + 1) + label[other], apart[row, column])
        yield np.stack([some[row[best]], other[best]], axis=1)


def _cheapest_of_each(key: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """Of each group of the same key the entry that costs least."""
    order = np.lexsort((cost, key))
    return order[np.unique(key[order], return_index=True)[1]]


def _along(rest: np.ndarray, label: np.ndarray, joints: _Joints, links: np.ndarray) -> np.ndarray:
    """(N,) places of the vertices on their branches, from the base out: the source's own order, or that turned round,
    where it is one, else by the distance from the base over the links within the branch."""
    count = len(rest)
    way = _ways(rest, label, joints, links)
    place = np.empty(count, np.int64)
    order = np.lexsort((np.arange(count), way, label))
    first = np.searchsorted(label[order], np.arange(label.max() + 1))
    place[order] = np.arange(count) - first[label[order]]
    source = source_stem_index(label)
    agreement = _rank_correlation(label, place, source)
    size = np.bincount(label)
    turned = np.where(agreement[label] < 0, size[label] - 1 - source, source)
    return np.where((np.abs(agreement) >= IN_ORDER)[label] | (size <= SMALL)[label], turned, place)


def _ways(rest: np.ndarray, label: np.ndarray, joints: _Joints, links: np.ndarray) -> np.ndarray:
    """(N,) distances from the base of each vertex's branch over the links within it; straight where none lead there."""
    inner = links[label[links[:, 0]] == label[links[:, 1]]]
    length = np.linalg.norm(rest[inner[:, 0]] - rest[inner[:, 1]], axis=1)
    graph = scipy_module("sparse").coo_matrix((length, inner.T), (len(rest),) * 2).tocsr()
    graph.data = np.maximum(graph.data, 1e-30)  # a distance of nothing would be no link
    way: np.ndarray = scipy_module("sparse.csgraph").dijkstra(graph, directed=False, indices=joints.base, min_only=True)
    return np.where(np.isfinite(way), way, np.linalg.norm(rest - rest[joints.base][label], axis=1))


def _rank_correlation(label: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(B,) of each branch, between two orders of its vertices; Spearman's coefficient."""
    size = np.bincount(label)
    apart = np.bincount(label, (first - second).astype(np.float64) ** 2)
    return 1 - 6 * apart / np.maximum(size * (size.astype(np.float64) ** 2 - 1), 1)


def _near_neighbours(points: np.ndarray, count: int) -> np.ndarray:
    """(L, 2) pairs of points and their nearest others."""
    near = (
        scipy_module("spatial").cKDTree(points).query(points, k=min(count + 1, len(points)))[1].reshape(len(points), -1)
    )
    return np.stack([np.repeat(np.arange(len(points)), near.shape[1] - 1), near[:, 1:].reshape(-1)], axis=1)


# ---- patches that move rigidly ----


def _rigid_patches(frames: np.ndarray, links: np.ndarray, patch_vertices: int) -> np.ndarray:
    """(N,) labels of connected patches whose vertices one affine map per frame carries well: seeds spread over the
    mesh, then maps and memberships in turn (Lloyd's iteration), vertices changing to patches beside theirs only."""
    links = np.concatenate([links, links[:, ::-1]])
    label = _spread(frames[0], links, int(np.clip(frames.shape[1] / patch_vertices, 1, MOST_PATCHES)))
    for _ in range(PATCH_ROUNDS):
        maps = _maps(frames, label)
        own = _misfit(frames, maps, np.arange(len(label)), label)
        beside = label[links[:, 0]] != label[links[:, 1]]
        vertex, other = np.unique(np.stack([links[beside, 0], label[links[beside, 1]]], axis=1), axis=0).T
        misfit = _misfit(frames, maps, vertex, other)
        best = _cheapest_of_each(vertex, misfit)
        best = best[misfit[best] < own[vertex[best]]]
        label[vertex[best]] = other[best]
        label = _numbered(label)
    inner = links[label[links[:, 0]] == label[links[:, 1]]]
    return _without_crumbs(_components(inner, len(label)), links)


def _spread(rest: np.ndarray, links: np.ndarray, count: int) -> np.ndarray:
    """(N,) labels: the nearest, over the links, of `count` seeds that are far from each other; every part has one."""
    length = np.maximum(np.linalg.norm(rest[links[:, 0]] - rest[links[:, 1]], axis=1), 1e-30)
    graph = scipy_module("sparse").coo_matrix((length, links.T), (len(rest),) * 2).tocsr()
    dijkstra = scipy_module("sparse.csgraph").dijkstra
    seeds = np.unique(_components(links, len(rest)), return_index=True)[1].tolist()
    way = dijkstra(graph, indices=seeds, min_only=True)
    while len(seeds) < count and way.max() > 0:
        seeds.append(int(way.argmax()))
        near = dijkstra(graph, indices=seeds[-1], limit=way[seeds[-1]])
        way = np.minimum(way, near)
    source = dijkstra(graph, indices=seeds, min_only=True, return_predecessors=True)[2]
    return _numbered(source)


def _maps(frames: np.ndarray, label: np.ndarray) -> np.ndarray:
    """(B, F, 4, 3) least-squares affine maps from the rest pose; translations where vertices do not determine more."""
    order = np.argsort(label, kind="stable")
    first = np.searchsorted(label[order], np.arange(label.max() + 1))
    rest = np.concatenate([frames[0], np.ones((len(label), 1))], axis=1)[order]
    moved = (frames - frames[0])[:, order]
    squares = np.add.reduceat(rest[:, :, None] * rest[:, None, :], first)
    products = np.stack([np.add.reduceat(rest[:, :, None] * frame[:, None, :], first) for frame in moved], axis=1)
    firmness = 1e-3 * np.trace(squares[:, :3, :3], axis1=1, axis2=2) + 1e-30
    squares[:, np.arange(3), np.arange(3)] += firmness[:, None]
    return np.linalg.solve(squares[:, None], products)


def _misfit(frames: np.ndarray, maps: np.ndarray, vertex: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Sum over frames of the squared distances of vertices from where maps carry them."""
    total = np.zeros(len(vertex))
    rest = np.concatenate([frames[0, vertex], np.ones((len(vertex), 1))], axis=1)
    for frame, moved in enumerate(frames):
        carried = np.einsum("ni,nij->nj", rest, maps[label, frame])
        total += ((moved[vertex] - frames[0, vertex] - carried) ** 2).sum(axis=1)
    return total


def _without_crumbs(label: np.ndarray, links: np.ndarray) -> np.ndarray:
    """Patches of few vertices are merged into a neighbour."""
    for _ in range(PATCH_ROUNDS):
        size = np.bincount(label)
        leaves = (size[label[links[:, 0]]] < CRUMB) & (size[label[links[:, 0]]] < size[label[links[:, 1]]])
        if not leaves.any():
            break
        into = np.arange(len(size))
        into[label[links[leaves, 0]]] = label[links[leaves, 1]]
        label = _numbered(into[label])
    return label
