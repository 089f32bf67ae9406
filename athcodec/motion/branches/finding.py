"""Branches for a clip that names none, found by what data it has.

Labels come from attributes named like branch ids, from the joints of a skin, from an edge graph, from the objects of a
scene that move as wholes, from the connected components of a render mesh, or from motion: runs of points that keep
their distance, or patches of a mesh that move rigidly. attachment.py arranges all but runs and edge graphs alike. Only
a few frames are read.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.branches.attachment import arranged, single_by_rows
from athcodec.motion.branches.centre_lines import line_branches
from athcodec.motion.branches.common_motion import carried
from athcodec.motion.branches.grown_pose import with_grown_pose
from athcodec.motion.branches.patches import rigid_patches
from athcodec.motion.branches.point_runs import CROWDED, DOUBTFULLY_CROWDED, base_points, run_links
from athcodec.motion.branches.result import Found, order_of
from athcodec.motion.branches.seen import Seen, affine_share, components, links_of, numbered, parts_of
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.clip import MotionClip, source_stem_index, stands_still
from athcodec.motion.hierarchy import branches_from_edges
from athcodec.options import METHODS, whole

LABEL_NAMES = ("vertex_branch", "branch", "branch_id", "branchid", "branch_index", "branchindex", "branch_number")
PARENT_NAMES = ("branch_parent", "branchparent", "branch_parents", "parent_branch", "parent")
LONE_POINTS = 0.1  # Part of the vertices that may be alone before patches are tried besides runs.
AFFINE = 0.9  # Least share of the vertices that are in objects which move by one affine map each.
COMPONENTS_AT_MOST = 0.6  # Part of the vertices above which components are no branches but loose points.
PATCH_VERTICES = 150  # Average vertices of a patch in a mesh without other branches.
SMALL_PATCH = 40  # Average vertices of a patch that is tried besides.
LARGE_PATCH = 600  # Average vertices of a patch that is tried in its place from LARGE_MESH vertices on.
LARGE_MESH = 10_000  # Vertices of a mesh that is large.
MANY_ROOTS = 0.25  # Part of the branches that are roots from which on all are tried as such.
WOOD_VERTICES = 1000  # Vertices of a piece of a mesh that may be a trunk with its boughs.
WOOD = 0.25  # Part of the vertices that are in such pieces from which on patches are tried besides pieces.
STEADY_NEXT = 0.2  # Change of the distance of two vertices, over their motion, above which they are of two parts.
LOOSE_NEXT = 0.05  # The same above which they may be.
FAR_NEXT = 3.0  # Times the usual distance of two vertices, above which they are of two parts.
STILL = 1e-6  # Of the diagonal: change of a distance that is none.
PARTS_IN_ORDER = 0.125  # Parts for each vertex above which the order of the source says nothing.
COPIES = 8  # Parts from which on it is no accident that most are of one size.
LEAST_COPY = 3  # Vertices of such a part, at least.
ALIKE_PARTS = 0.8  # Share of the parts that are then of one size.
PLANTS = 0.5  # Part of the branches that are roots by their price above which they are plants side by side.
BODY_PATCHES = (40, 16)  # Average vertices of a patch of points that nothing joins.
FREE_PATCHES = (64, 200)  # Vertices of patches without parents.


def find_branches(clip: MotionClip, method: str = "auto", root: int | None = None) -> Found:
    """Find branches for a clip, as `athcodec.find_branches` documents. Raises ClipError, MissingExtra or ValueError."""
    if method != "auto" and method not in METHODS:
        raise ValueError(f"method: got {method!r}, expected auto or one of {', '.join(METHODS)}")
    root = None if root is None else whole("root", root)
    branches = _first_found(Seen(with_grown_pose(clip)), METHODS if method == "auto" else (method,), root)
    if branches is None:
        raise ClipError(f"branches: the clip has nothing to find them by {method}, expected {_EXPECTED[method]}")
    return branches


def candidates(clip: MotionClip, by_points: bool = True) -> Iterator[Found]:
    """Yield what find_branches finds and, if only a trial shows which makes the smallest file, alternatives: for
    motion, or runs that leave many points alone, patches of other sizes, patches without parents and one single branch;
    for a welded mesh, its pieces. by_points: whether to look for patches and runs where there is nothing else; a clip
    that stands still has none. What turns or travels as a whole is tried on a branch that carries all of it, too."""
    seen = Seen(clip, by_price=True)
    if not seen.is_carried:
        yield from _candidates(seen, by_points)
        return
    found = _candidates(seen.of_carried(), by_points)
    on_carrier = ([carried(branches, seen.frames), branches] for branches in found)
    proposals = itertools.chain(itertools.chain.from_iterable(on_carrier), _candidates(seen, by_points))
    yield from _distinct(branches for branches in proposals if branches is not None)


def _candidates(seen: Seen, by_points: bool) -> Iterator[Found]:
    """Yield the ways to divide a clip into branches whose files are worth comparing, the likeliest one first.
    `by_points`: whether runs of points that nothing joins may be sought.
    """
    clip = seen.clip
    single = Found(np.zeros(clip.vertex_count, np.int32), np.array([-1], np.int32), None, "motion")
    still = stands_still(clip)
    by_points = by_points and not still
    first = _first_found(seen, METHODS[:-1] if by_points else METHODS[:-2], None)
    if still or not by_points and first is None:
        yield single
        if first is not None:
            yield first
        return
    if first is not None and first.method == "objects":
        yield from _distinct(_of_objects(seen, first))
        return
    if first is not None and not (first.method == "runs" and _are_doubtful(seen, first)):
        yield from _distinct(itertools.chain([first], _others(seen, first)))
        return
    if first is not None and seen.growing:
        yield first
    for links in seen.growing[1:]:
        yield _of_growing(seen, links, None)
    for branches in _in_order(seen):
        yield branches
        if _are_plants(branches):
            return
    yield single
    by_rows = single_by_rows(seen)
    if by_rows is not None:
        yield by_rows
    if first is not None and not seen.growing:
        yield first
    if not len(seen.mesh):
        doubtful = _by_runs(seen, None, DOUBTFULLY_CROWDED) if first is None else None
        if doubtful is not None:
            yield doubtful
        yield from _of_bodies(seen)
        return
    grown = seen.by_contact()  # Patches of one mesh hang on each other.
    yield _by_motion(grown, None)
    is_large = clip.vertex_count >= LARGE_MESH
    yield _by_motion(grown, None, LARGE_PATCH if is_large else SMALL_PATCH)
    for size in FREE_PATCHES[-1:] if is_large else FREE_PATCHES:
        yield _free_patches(seen, size)


def _distinct(proposals: Iterable[Found]) -> Iterator[Found]:
    """Yield those of some proposals that differ from all before them: two ways to arrange a mesh may give the same
    branches.
    """
    before: list[tuple[np.ndarray, ...]] = []
    for branches in proposals:
        index = source_stem_index(branches.vertex_branch) if branches.stem_index is None else branches.stem_index
        arrays = branches.vertex_branch, branches.branch_parent, index
        if not any(all(map(np.array_equal, arrays, others)) for others in before):
            before.append(arrays)
            yield branches


def _others(seen: Seen, first: Found) -> Iterator[Found]:
    """Yield other branches that may suit as well where the first ones were found by runs of points, joints or connected
    pieces."""
    if first.method == "runs":
        yield from _in_order(seen)
    elif first.method == "skeleton":
        yield dataclasses.replace(first, stem_index=None)
    elif first.method == "components":
        yield from _other_components(seen, first)


def _of_objects(seen: Seen, first: Found) -> Iterator[Found]:
    """Yield the objects of a scene, which `first` takes as branches, with and without parents, since what hangs on a
    part that grows may move more simply alone; and what an object may consist of, such as leaflets."""
    other = _first_found(seen, METHODS[METHODS.index("objects") + 1 : -1], None)
    yield _as_roots(first)
    if other is not None:
        yield _as_roots(other)
    yield first
    yield _by_contact(seen, first)
    if other is not None:
        yield from itertools.chain([other], _others(seen, other))


def _other_components(seen: Seen, first: Found) -> Iterator[Found]:
    """Yield other branches than `first`, for a mesh whose connected pieces `first` takes as branches: pieces without
    parents, with vertices in the order of the source, hung where they touch, in patches, of the parts of the source, or
    apart where they were joined.
    """
    roots = np.count_nonzero(first.branch_parent < 0)
    if MANY_ROOTS * len(first.branch_parent) <= roots < len(first.branch_parent):
        yield _as_roots(first)
    contact = _by_contact(seen, first) if roots <= PLANTS * len(first.branch_parent) else first
    is_lower = order_of(contact) < order_of(
        first
    )  # Then leaves hang on leaves in the first ones, which sway much alike.
    if is_lower:
        yield contact
    yield dataclasses.replace(first, stem_index=None)
    if roots > 1 and not is_lower:
        yield contact
    if _are_of_wood(first):
        yield _by_motion(seen.by_contact(), None, SMALL_PATCH)
    if seen.parts is not None:  # Parts that touch at a point are joined in the first ones.
        yield arranged(seen, seen.parts, None, "components")
    unwelded = pieces(seen.clip)  # Leaves that touch are welded, which is wrong if they move by themselves.
    if len(unwelded.branch_parent) != len(first.branch_parent):
        yield unwelded


def _as_roots(branches: Found) -> Found:
    """Return the same branches without parents, with vertices in the order of the source."""
    return dataclasses.replace(branches, branch_parent=np.full_like(branches.branch_parent, -1), stem_index=None)


def _are_of_wood(components: Found) -> bool:
    """Return whether large pieces of a mesh may be trunks with their boughs, which do not move by one map."""
    size = np.bincount(components.vertex_branch)
    return bool(size[size >= WOOD_VERTICES].sum() >= WOOD * size.sum())


def _by_contact(seen: Seen, first: Found) -> Found:
    """Return the same branches where they grow, as far as contacts show it."""
    branches = _FINDERS[first.method](seen.by_contact(), None)
    return first if branches is None else branches


def _in_order(seen: Seen) -> Iterator[Found]:
    """Yield labels for points that nothing joins: parts whose vertices follow each other in the source, as programs
    write them."""
    for label in _labels_in_order(seen):
        yield dataclasses.replace(arranged(seen, label, None, "motion"), stem_index=None)


def _of_bodies(seen: Seen) -> Iterator[Found]:
    """Yield labels for points that nothing joins, in whatever order: their bodies, such as blades and leaves, and
    patches of these, since what grows on a stem is of one body with it."""
    label = components(seen.bodies, seen.clip.vertex_count)
    if 0 < label.max() < PARTS_IN_ORDER * len(label):
        yield arranged(seen, label, None, "motion")
    for size in BODY_PATCHES:
        yield _by_motion(seen, None, size)


def _labels_in_order(seen: Seen) -> list[np.ndarray]:
    """Return a few ways to divide points that nothing joins into parts that follow each other in the order of the
    source, as labels (N,) each; a part begins at a point that does not keep its distance from the one before it. The
    second way also begins a part at a point that is far from the one before it, since things that stand in the ground
    keep their distances, and the third where a distance changes a little, as that of a leaf from the next. If a way
    gives parts of one size, as copies are, it alone is returned.
    """
    frames, count = seen.frames[1:], seen.clip.vertex_count
    if len(seen.mesh) or count < 2:
        return []
    way = frames[:, 1:] - frames[:, :-1]
    apart = np.linalg.norm(way, axis=2)
    moved = np.sqrt(((way - way.mean(axis=0)) ** 2).sum(axis=2).mean(axis=0))
    still = STILL * float(np.linalg.norm(np.ptp(frames.reshape(-1, 3), axis=0)))
    is_far = apart.mean(axis=0) > FAR_NEXT * np.quantile(apart.mean(axis=0), 1 - PARTS_IN_ORDER)
    is_unsteady = apart.std(axis=0) > STEADY_NEXT * moved + still
    is_loose = apart.std(axis=0) > LOOSE_NEXT * moved + still
    labels: list[np.ndarray] = []
    before = 0
    for begins in (is_unsteady, is_unsteady | is_far, is_loose | is_far):
        label = np.append(0, np.cumsum(begins))
        parts = int(label[-1]) + 1
        if before < parts and _are_even(label) and parts * LEAST_COPY <= count:
            return [label]
        if before < parts <= PARTS_IN_ORDER * count and parts > 1:
            labels.append(label)
        before = parts
    return labels


def _are_even(label: np.ndarray) -> bool:
    """Return whether most parts, some at least, are of one size."""
    sizes = np.bincount(label)
    return len(sizes) >= COPIES and bool(np.bincount(sizes).max() >= ALIKE_PARTS * len(sizes))


def _are_plants(branches: Found) -> bool:
    """Return whether branches are copies of one plant side by side. Rings of one stem would hang on each other."""
    roots = np.count_nonzero(branches.branch_parent < 0)
    return _are_even(branches.vertex_branch) and bool(roots > PLANTS * len(branches.branch_parent))


def _are_doubtful(seen: Seen, runs: Found) -> bool:
    """Return whether others may suit better than these runs: plants grow, or many runs are a single vertex."""
    alone = np.count_nonzero(np.bincount(runs.vertex_branch) == 1)
    return bool(seen.growing or alone > LONE_POINTS * len(runs.vertex_branch))


def pieces(clip: MotionClip) -> Found:
    """Return the connected pieces of a clip's mesh as branches without parents, which takes no scipy.

    Parameters
    ----------
    clip : MotionClip

    Returns
    -------
    Found
        A single branch where there is one piece, or too many of few vertices.
    """
    links, label = links_of(clip), np.arange(clip.vertex_count)
    while len(links) and (label[links[:, 0]] != label[links[:, 1]]).any():
        ends = label[links]
        np.minimum.at(label, ends, ends.min(axis=1, keepdims=True))
        while not np.array_equal(label, label[label]):
            label = label[label]
    label = numbered(label)
    if label.max() >= COMPONENTS_AT_MOST * clip.vertex_count:
        label[:] = 0
    return Found(label.astype(np.int32), np.full(label.max() + 1, -1, np.int32), None, "components")


def _first_found(seen: Seen, methods: Sequence[str], root: int | None) -> Found | None:
    """Return branches by the first method that has data to go by; motion always has."""
    return next(
        (branches for branches in (_FINDERS[name](seen, root) for name in methods) if branches is not None), None
    )


def _by_attributes(seen: Seen, root: int | None) -> Found | None:
    """Return branches from labels that the source has for vertices or faces under a usual name, with their parents if
    it has these too, or None without such labels. `root`: a vertex of the branch that is to be the root, or None.
    """
    clip = seen.clip
    source = _plain_names(clip)
    named = {name: clip.attributes[original] for name, original in source.items()}
    chosen, labels = _named_labels(clip, named)
    if labels is None:
        return None
    names, vertex_branch = np.unique(labels, return_inverse=True)
    parents, parent = next((named[name] for name in PARENT_NAMES if name in named), None), None
    if parents is not None and parents.ndim == 1 and parents.dtype.kind in "iu" and len(parents) > names.max():
        above = parents[names].astype(np.int64)
        parent = np.where(np.isin(above, names), np.searchsorted(names, above).clip(0, len(names) - 1), -1)
    return dataclasses.replace(arranged(seen, vertex_branch, root, "attributes", parent), array_name=source[chosen])


def _plain_names(clip: MotionClip) -> dict[str, str]:
    """Return the names of the arrays by their last words in lower case."""
    return {name.lower().rsplit("/", 1)[-1].replace("primvars:", ""): name for name in clip.attributes}


def _named_labels(clip: MotionClip, named: Mapping[str, np.ndarray]) -> tuple[str, np.ndarray | None]:
    """Return the first of the arrays under a usual name of branch numbers, and the number of each vertex, (N,)."""
    candidates = ((name, _vertex_labels(clip, named.get(name))) for name in LABEL_NAMES)
    return next(((name, label) for name, label in candidates if label is not None), ("", None))


def named_labels(clip: MotionClip) -> np.ndarray | None:
    """Return the number of the branch of each vertex that an array of the source names, (N,); None: none does."""
    return _named_labels(clip, {name: clip.attributes[original] for name, original in _plain_names(clip).items()})[1]


def _vertex_labels(clip: MotionClip, array: np.ndarray | None) -> np.ndarray | None:
    """Return a label for each vertex, (N,) whole numbers from 0 on, from an array of labels of vertices or of faces, or
    None if the array is neither.
    """
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


def _by_skeleton(seen: Seen, root: int | None) -> Found | None:
    """Return branches from chains of joints of a skeleton: a branch consists of the vertices that the same joint moves
    most. An object that no joint moves hangs on the nearest branch. Return None if the clip has no joint that moves a
    vertex.
    """
    clip = seen.clip
    if clip.skin is None or (clip.skin.vertex_joint >= 0).sum() == 0:
        return None
    joint, parents = clip.skin.vertex_joint.astype(np.int64), np.asarray(clip.skin.joint_parent)
    if (joint < 0).any():
        nearest, parts = _nearest_label(clip.rest, joint), _unlabelled_parts(clip, joint)
        joint = np.where(parts < 0, nearest[0], len(parents) + parts)
        order = np.lexsort((nearest[1], parts))
        first = order[np.flatnonzero(np.diff(parts[order], prepend=-1))]  # The nearest vertex of each part.
        parents = np.concatenate([parents, nearest[0][first]])
    names, label = np.unique(joint, return_inverse=True)
    is_used = np.zeros(len(parents), bool)
    is_used[names] = True
    parent = np.array([_used_ancestor(int(name), parents, is_used) for name in names])
    parent = np.where(parent < 0, -1, np.searchsorted(names, parent))
    return arranged(seen, label, root, "skeleton", parent)


def _used_ancestor(joint: int, parents: np.ndarray, is_used: np.ndarray) -> int:
    joint = int(parents[joint])
    while joint >= 0 and not is_used[joint]:
        joint = int(parents[joint])
    return joint


def _nearest_label(rest: np.ndarray, label: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the label of the nearest vertex that has one, and its distance, (N,)."""
    tree = scipy_module("spatial").cKDTree(rest[label >= 0])
    distance, place = tree.query(rest)
    return np.where(label >= 0, label, label[label >= 0][place]), distance


def _unlabelled_parts(clip: MotionClip, label: np.ndarray) -> np.ndarray:
    """Return the number of each object, and of each of its copies, that has no label at all, (N,); -1 for other
    vertices."""
    part = parts_of(clip)
    if part is None:
        return np.full(len(label), -1)
    is_bare = np.bincount(part, label >= 0) == 0
    place = np.cumsum(is_bare) - 1
    return np.where(is_bare[part], place[part], -1)


def _by_edges(seen: Seen, root: int | None) -> Found | None:
    """Return branches from edges that form centre lines, or None if there are none. Edges of meshes, which close
    cycles, are not used.
    """
    clip = seen.clip
    if clip.edges is None or not len(clip.edges) or clip.polygons is not None:
        return None
    try:
        return Found(*line_branches(seen, clip.edges, root), "edges")
    except ClipError:
        return None


def _by_objects(seen: Seen, root: int | None) -> Found | None:
    """Return each object of a scene as a branch, or None unless most vertices are of objects that move by one affine
    map each.
    """
    clip = seen.clip
    label = parts_of(clip)
    if label is None or label.max() == 0 or label.max() > COMPONENTS_AT_MOST * len(label):
        return None
    if affine_share(seen.frames, label) < AFFINE:
        return None
    counts, names = clip.attributes["part_vertex_counts"], clip.metadata.get("part_names")
    words = names if isinstance(names, list) and len(names) == len(counts) else [""] * len(counts)
    part = np.searchsorted(np.cumsum(counts), np.unique(label, return_index=True)[1], side="right")
    branches = arranged(seen, label, root, "objects", names=[re.split("[/_|]", str(words[number])) for number in part])
    return dataclasses.replace(branches, stem_index=None)


def _by_components(seen: Seen, root: int | None) -> Found | None:
    """Return each connected piece of a mesh, such as a bark tube or a leaf card, as a branch. Return None if there is
    no mesh, a single piece, or too many pieces of few vertices.
    """
    if not len(seen.mesh):
        return None
    vertex_count = seen.clip.vertex_count
    label = components(seen.links, vertex_count)
    count = int(label.max()) + 1
    if count == 1 or count > COMPONENTS_AT_MOST * vertex_count:
        return None
    return arranged(seen, label, root, "components")


def _by_runs(seen: Seen, root: int | None, crowded: float = CROWDED) -> Found | None:
    """Return branches such as blades, needles and strands, for points that nothing joins, by linking points that keep
    their distance, or, if plants grow, those that never are far apart; None if the points form no such runs. `crowded`:
    as for `run_links`.
    """
    if len(seen.mesh):
        return None
    if seen.growing:
        return _of_growing(seen, seen.growing[0], root)
    frames = seen.frames[1:]  # The rest pose may have links of other lengths.
    links = run_links(seen.frames_of_roots[1:], crowded)
    if links is None:
        return None
    bases = base_points(frames, links, root)
    branches = branches_from_edges(links, seen.clip.vertex_count, seen.clip.rest, bases.tolist())
    return Found(*branches, "runs", links=links)


def _of_growing(seen: Seen, links: np.ndarray, root: int | None) -> Found:
    """Return the centre lines of points of plants that grow, which `links` join, (L, 2)."""
    return Found(*line_branches(seen, links, root), "runs", links=links)


def _by_motion(seen: Seen, root: int | None, patch_vertices: int = PATCH_VERTICES) -> Found:
    """Find patches that move rigidly, each on one that it touches."""
    return arranged(seen, _patches(seen, patch_vertices), root, "motion")


def _free_patches(seen: Seen, patch_vertices: int) -> Found:
    """Find patches without parents: a blend of few poses, as in skins, stays one in the space of the clip."""
    label = _patches(seen, patch_vertices)
    return Found(label.astype(np.int32), np.full(label.max() + 1, -1, np.int32), None, "motion")


def _patches(seen: Seen, patch_vertices: int) -> np.ndarray:
    """Return labels of patches grown over the mesh, (N,), or over near neighbours if there is none."""
    return rigid_patches(seen.frames, seen.neighbours, patch_vertices)


_FINDERS: dict[str, Callable[[Seen, int | None], Found | None]] = {
    "attributes": _by_attributes,
    "skeleton": _by_skeleton,
    "edges": _by_edges,
    "objects": _by_objects,
    "components": _by_components,
    "runs": _by_runs,
    "motion": _by_motion,
}
_EXPECTED = {
    "attributes": f"an attribute per vertex or face named as one of {', '.join(LABEL_NAMES)}",
    "skeleton": "joints with weights",
    "edges": "edges without cycles and no faces",
    "objects": "several objects in a scene that move by one affine map each",
    "components": "faces or edges in several separate pieces",
    "runs": "points without faces or edges, of which neighbours keep their distance",
    "motion": "vertices",
    "auto": "vertices",
}
