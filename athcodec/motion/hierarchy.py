"""The branch hierarchy: the parent of every branch, and the vertex order in which every subtree is one range.

Built from branch labels, or derived from an edge graph by going straight on at every fork, so that branch orders
count as botanists count them (trunk 0, its branches 1 ...) and no stem has a kink, which would move as no beam does.
Edge graphs are rooted by an Euler tour and pointer doubling (Tarjan and Vishkin, "An efficient parallel biconnectivity
algorithm", SIAM J. Comput. 14(4), 1985), which takes a logarithmic number of array operations however deep the tree
is. It looks at the rest pose only; who knows the motion says which vertices begin branches.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import check_branches, check_indices, check_stem_index
from athcodec.motion.protocol import Motion
from athcodec.options import whole

MAX_VERTICES = 2**31 - 1
STRAIGHT = 64  # Steps of the cosine of an angle at a fork, within which ways are as straight: about 10 degrees at 0.


@dataclass(frozen=True, eq=False, repr=False)
class Hierarchy:
    """B branches and N vertices in file order; all arrays are int32 and read-only.

    Branches are in depth-first preorder, siblings by their source number. Vertices follow stem after stem in that
    order, each stem from base to tip.

    Attributes
    ----------
    branch_parent : (B,)
        Below the branch's own index, -1 for a root.
    branch_depth : (B,)
        0 for a root.
    first_vertex : (B,)
        First vertex of the stem.
    stem_count : (B,)
        Vertices of the stem, at least 1.
    subtree_branches : (B,)
        Branches in the subtree, itself included: b to b + subtree_branches[b] - 1.
    attach : (B,)
        Vertex of the parent's stem that the branch is attached to, -1 for a root.
    vertex_source : (N,)
        Source number of each vertex.
    branch_source : (B,)
        Source number of each branch.
    """

    branch_parent: np.ndarray
    branch_depth: np.ndarray
    first_vertex: np.ndarray
    stem_count: np.ndarray
    subtree_branches: np.ndarray
    attach: np.ndarray
    vertex_source: np.ndarray
    branch_source: np.ndarray

    def __post_init__(self) -> None:
        for field in fields(self):
            array = np.array(getattr(self, field.name), dtype=np.int32)
            array.flags.writeable = False
            object.__setattr__(self, field.name, array)

    def __repr__(self) -> str:
        depth = int(self.branch_depth.max())
        return f"Hierarchy({self.branch_count} branches, {self.vertex_count} vertices, depth {depth})"

    @classmethod
    def from_parts(
        cls,
        branch_parent: np.ndarray,
        stem_count: np.ndarray,
        attach: np.ndarray,
        vertex_source: np.ndarray | None = None,
        branch_source: np.ndarray | None = None,
    ) -> Hierarchy:
        """Return the hierarchy from the arrays that determine the others.

        Parameters
        ----------
        branch_parent, stem_count, attach : (B,) integer arrays
            In file order: the parent of each branch, -1 for a root; the number of vertices on its stem; and the vertex
            of the parent's stem that it is attached to, -1 for a root.
        vertex_source : (N,) integer array, optional
            The source's number of each vertex, a permutation; by default the numbers are the same.
        branch_source : (B,) integer array, optional
            The source's number of each branch, a permutation; by default the numbers are the same.

        Returns
        -------
        Hierarchy

        Raises
        ------
        ClipError
            If the branches are not in depth-first preorder, a stem is empty, a branch is not attached to its
            parent's stem, or a source array is no permutation.
        """
        parent = np.asarray(branch_parent, np.int64)
        count = np.asarray(stem_count, np.int64)
        attach = np.asarray(attach, np.int64)
        _check_stems(parent, count, attach)
        return cls(
            branch_parent=parent,
            branch_depth=branch_orders(parent),
            first_vertex=np.cumsum(count) - count,
            stem_count=count,
            subtree_branches=_subtree_sizes(parent),
            attach=attach,
            vertex_source=_permutation("vertex_source", vertex_source, int(count.sum())),
            branch_source=_permutation("branch_source", branch_source, len(parent)),
        )

    @property
    def vertex_count(self) -> int:
        """Number of vertices, N."""
        return len(self.vertex_source)

    @property
    def branch_count(self) -> int:
        """Number of branches, B."""
        return len(self.branch_parent)

    def vertex_branch(self) -> np.ndarray:
        """Return the branch of each vertex, (N,) int32, both in file order."""
        return np.repeat(np.arange(self.branch_count, dtype=np.int32), self.stem_count)

    def subtree_range(self, branch: int) -> tuple[int, int]:
        """Return the vertices of the subtree of `branch` in file order: first, and one past the last."""
        if not 0 <= branch < self.branch_count:
            raise IndexError(f"branch {branch}: expected 0 to {self.branch_count - 1}")
        last = branch + int(self.subtree_branches[branch]) - 1
        return int(self.first_vertex[branch]), int(self.first_vertex[last] + self.stem_count[last])

    def source_branches(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (vertex_branch (N,), branch_parent (B,), stem_index (N,)), int32, with vertices and branches numbered
        as in the source."""
        branch = self.vertex_branch()
        vertex_branch = np.empty_like(branch)
        vertex_branch[self.vertex_source] = self.branch_source[branch]
        stem_index = np.empty_like(branch)
        stem_index[self.vertex_source] = np.arange(self.vertex_count) - self.first_vertex[branch]
        branch_parent = np.empty_like(self.branch_parent)
        branch_parent[self.branch_source] = _lookup(self.branch_source, self.branch_parent)
        return vertex_branch, branch_parent, stem_index


def hierarchy_of(clip: Motion) -> Hierarchy:
    """Return the hierarchy of a clip's branches; see build_hierarchy()."""
    assert clip.vertex_branch is not None and clip.branch_parent is not None  # A motion has both or neither.
    return build_hierarchy(clip.vertex_branch, clip.branch_parent, clip.rest, clip.edges, clip.stem_index)


def build_hierarchy(
    vertex_branch: np.ndarray,
    branch_parent: np.ndarray,
    rest: np.ndarray,
    edges: np.ndarray | None = None,
    stem_index: np.ndarray | None = None,
) -> Hierarchy:
    """Return the hierarchy of branches whose vertices are labelled.

    vertex_branch (N,) is the branch of each vertex, branch_parent (B,) the parent of each branch, -1 for a root, rest
    (N, 3) the rest pose, edges (E, 2) pairs of vertices, and stem_index (N,) the place of each vertex along its branch,
    all in the source's numbering as in MotionClip. A branch is attached to its parent's stem by the edge nearest to the
    branch's base. If no edge joins it to that stem, it is attached to the stem's vertex nearest to its base in the rest
    pose.

    Raises ClipError unless every branch has vertices and no branch is its own ancestor (see check_branches).
    """
    rest = np.asarray(rest, np.float64)
    vertex_branch, branch_parent = check_branches(vertex_branch, branch_parent, len(rest))
    stem_index = check_stem_index(stem_index, vertex_branch)
    edges = check_indices("edges", edges, len(rest), width=2)

    branch_source = _preorder(branch_parent, np.arange(len(branch_parent)))
    file_branch = _inverse(branch_source)
    parent = _lookup(file_branch, branch_parent[branch_source])
    along_stem = np.arange(len(rest)) if stem_index is None else stem_index
    vertex_source = np.lexsort((along_stem, file_branch[vertex_branch]))
    stem_count = np.bincount(file_branch[vertex_branch], minlength=len(parent))
    attach = _attach_points(parent, stem_count, rest[vertex_source], _file_edges(edges, vertex_source))
    return Hierarchy.from_parts(parent, stem_count, attach, vertex_source, branch_source)


def branches_from_edges(
    edges: np.ndarray,
    vertex_count: int,
    rest: np.ndarray,
    root: int | Sequence[int] | None = None,
    up_axis: str = "y",
    begins: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (vertex_branch (N,), branch_parent (B,), stem_index (N,)), int32, of the branches that centre lines form:
    the branch of each vertex, the parent of each branch, -1 for a root, and the vertex's place along its branch.

    edges (E, 2) joins vertices 0 .. vertex_count - 1 in either direction; an edge given twice counts once.
    Each connected part is rooted at the vertex of `root` that lies in it, else at its lowest vertex along
    up_axis ("y", "z", "-z" ...) in rest (N, 3). At a fork the stem goes straight on, as far as rest shows it, else
    into the subtree with most vertices (the lowest vertex number, if equal), and the others start branches. `begins` is
    given the vertex below each vertex, the first vertex of its stem and its place there, (N,) each, and returns which
    vertices begin a branch all the same. Branches are numbered in depth-first preorder, siblings from base to tip.

    Raises ClipError if the edges close a cycle, of which it names one edge, or if `root` is not usable.
    """
    edges = np.asarray(check_indices("edges", edges, vertex_count, width=2), np.int64)
    tour = _EulerTour(edges, vertex_count)
    points = np.asarray(rest, np.float64)
    parent, subtree_size = tour.rooted_at(roots_of_parts(tour.part, points, root, up_axis))
    goes_on = _goes_straight(parent, subtree_size, points)
    head, stem_index = _stems(parent, goes_on)
    if begins is not None:
        head, stem_index = _stems(parent, goes_on & ~begins(parent, head, stem_index))

    heads = np.flatnonzero(head == np.arange(vertex_count))
    vertex_branch = np.searchsorted(heads, head)
    branch_parent = _lookup(vertex_branch, parent[heads])
    fork_place = _lookup(stem_index, parent[heads])
    number = _inverse(_preorder(branch_parent, np.lexsort((heads, fork_place))))
    renumbered = np.empty_like(branch_parent)
    renumbered[number] = _lookup(number, branch_parent)
    return number[vertex_branch].astype(np.int32), renumbered.astype(np.int32), stem_index.astype(np.int32)


def is_forest(edges: np.ndarray, vertex_count: int) -> bool:
    """Return whether edges (E, 2) between vertices close no cycle; an edge given twice counts once."""
    try:
        _EulerTour(np.asarray(edges, np.int64), vertex_count)
    except ClipError:
        return False
    return True


def parts_of_edges(edges: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return a number for each vertex, (vertex_count,), that all vertices of its connected part share. Raises ClipError
    if edges (E, 2) close a cycle."""
    return _EulerTour(np.asarray(edges, np.int64), vertex_count).part


def derived_edges(hierarchy: Hierarchy) -> np.ndarray:
    """Return the edges that the hierarchy implies, (E, 2) int32, in source numbering.

    One row (u, v) for every vertex v that is not the first of a root's stem, by ascending v: u is the vertex
    before v on its stem, or the attach point where v is the first of its stem.
    """
    before = np.arange(hierarchy.vertex_count) - 1
    before[hierarchy.first_vertex] = hierarchy.attach
    before_source = np.empty(hierarchy.vertex_count, np.int32)
    before_source[hierarchy.vertex_source] = _lookup(hierarchy.vertex_source, before)
    joined = np.flatnonzero(before_source >= 0)
    return np.stack([before_source[joined], joined.astype(np.int32)], axis=1)


def branch_orders(branch_parent: np.ndarray) -> np.ndarray:
    """Return the order of each branch, (B,) int32: 0 for a root, 1 for a branch on a root, 2 for a branch on that, and
    so on.

    branch_parent (B,) has the parent of each branch, -1 for a root, in any order but without a cycle.
    """
    count = len(branch_parent)
    ancestor = np.append(np.where(np.asarray(branch_parent) < 0, count, branch_parent), count)
    order = np.append(np.asarray(branch_parent) >= 0, False).astype(np.int32)
    for _ in range(count.bit_length()):
        order = order + order[ancestor]
        ancestor = ancestor[ancestor]
    return order[:count]


class _EulerTour:
    """Return every edge of a forest once in each direction, in the order of a walk around each connected part."""

    def __init__(self, edges: np.ndarray, vertex_count: int) -> None:
        """Prepare walks around the parts of the graph that `edges` (E, 2) form. Raises ClipError if it has a cycle."""
        once = np.unique(np.sort(edges, axis=1), axis=0)
        loops = np.flatnonzero(once[:, 0] == once[:, 1])
        if loops.size:
            _raise_cycle(once[loops[0]])
        directed = np.concatenate([once, once[:, ::-1]])
        order = np.lexsort((directed[:, 1], directed[:, 0]))
        self.tail, self.tip = directed[order].T
        place = _inverse(order)
        self.reverse = place[(order + len(once)) % max(1, len(order))]
        self.first = np.searchsorted(self.tail, np.arange(vertex_count + 1))
        self.successor = self._next_around_tail()[self.reverse]
        self.doublings = len(order).bit_length()
        self.part = self._parts(once, vertex_count)

    def _next_around_tail(self) -> np.ndarray:
        following = np.arange(len(self.tail)) + 1
        is_last = following == self.first[self.tail + 1]
        return np.where(is_last, self.first[self.tail], following)

    def _parts(self, once: np.ndarray, vertex_count: int) -> np.ndarray:
        """Return a number for each vertex (vertex_count,) that all vertices of its connected part share. `once` (E, 2)
        has each edge once. Raises ClipError if a part has a cycle."""
        label, jump = np.arange(len(self.tail)), self.successor
        for _ in range(self.doublings):
            label, jump = np.minimum(label, label[jump]), jump[jump]
        part = np.arange(vertex_count) + len(label)
        part[self.tail] = label
        # A walk that returns by every edge it took covers a whole part; that is a tree if it has one vertex
        # more than edges.
        walk_edges = np.bincount(label, minlength=len(label)) // 2
        walk_vertices = np.bincount(part, minlength=len(label))[: len(label)]
        is_tree = (walk_edges == walk_vertices - 1)[label]
        if not (np.array_equal(label, label[self.reverse]) and is_tree.all()):
            _raise_cycle(once[_closing_edge(once, vertex_count)])
        return part

    def rooted_at(self, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (parent, subtree_size) of every vertex: its parent, -1 for a root, and the number of vertices in its
        subtree, itself included. `roots` has one vertex of each connected part."""
        remaining, jump = self._steps_to_end(roots)
        for _ in range(self.doublings):
            remaining, jump = remaining + remaining[jump], jump[jump]
        vertex_count = len(self.first) - 1
        parent = np.full(vertex_count, -1, np.int64)
        subtree_size = np.bincount(self.part)[self.part]
        outward = np.flatnonzero(remaining > remaining[self.reverse])
        parent[self.tip[outward]] = self.tail[outward]
        subtree_size[self.tip[outward]] = (remaining[outward] - remaining[self.reverse[outward]] + 1) // 2
        return parent, subtree_size

    def _steps_to_end(self, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return for every directed edge whether a step follows it (1) or it is the last of the walk from its part's
        root (0), and the number of the edge that follows it."""
        starts = self.first[roots][self.first[roots] < self.first[roots + 1]]
        jump = self.successor.copy()
        ends = _inverse(self.successor)[starts]
        jump[ends] = ends
        remaining = np.ones(len(jump), np.int64)
        remaining[ends] = 0
        return remaining, jump


def roots_of_parts(part: np.ndarray, rest: np.ndarray, root: int | Sequence[int] | None, up_axis: str) -> np.ndarray:
    """Return the root vertex of each connected part: the vertex of `root` that lies in it, or else its lowest one along
    `up_axis` in the rest pose (N, 3). `part` (N,) is the part of each vertex. Raises ClipError if `root` is not
    usable."""
    axis, sign = _parse_axis(up_axis)
    vertices = np.array([] if root is None else root, object).ravel()  # NumPy has no common type for all integers.
    wanted = np.array([whole("root", vertex) for vertex in vertices], np.int64)
    if ((wanted < 0) | (wanted >= len(part))).any():
        raise ClipError(f"root: got {wanted.tolist()}, expected vertices 0 to {len(part) - 1}")
    if len(np.unique(part[wanted])) < len(wanted):
        raise ClipError(f"root: got {wanted.tolist()}, expected at most one in each connected part")
    is_other = np.ones(len(part), bool)
    is_other[wanted] = False
    order = np.lexsort((sign * rest[:, axis], is_other, part))
    return order[np.unique(part[order], return_index=True)[1]]


def _parse_axis(up_axis: str) -> tuple[int, float]:
    name = str(up_axis).lower().lstrip("+-")
    if name not in ("x", "y", "z"):
        raise ClipError(f'up_axis: got {up_axis!r}, expected "x", "y" or "z", with "-" in front if it points down')
    return "xyz".index(name), -1.0 if str(up_axis).startswith("-") else 1.0


def _goes_straight(parent: np.ndarray, subtree_size: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Return whether the stem of the vertex below goes on with each vertex, (N,) bool."""
    children = np.flatnonzero(parent >= 0)
    straightness = np.round(STRAIGHT * _cosines(parent, children, rest))
    by_fork = children[np.lexsort((children, -subtree_size[children], -straightness, parent[children]))]
    goes_on = np.zeros(len(parent), bool)
    goes_on[by_fork[np.unique(parent[by_fork], return_index=True)[1]]] = True
    return goes_on


def _stems(parent: np.ndarray, goes_on: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first vertex of every vertex's stem, and the vertex's place on that stem."""
    head = np.where(goes_on, parent, np.arange(len(parent)))
    place = (head != np.arange(len(parent))).astype(np.int64)
    for _ in range(len(parent).bit_length()):
        place, head = place + place[head], head[head]
    return head, place


def _cosines(parent: np.ndarray, children: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Return the cosine of the angle by which the way turns at the parent of each child, (C,); 0 at a root, and where
    two of the vertices coincide."""
    fork = parent[children]
    after = rest[children] - rest[fork]
    before = np.where(parent[fork, None] >= 0, rest[fork] - rest[parent[fork]], 0.0)
    product, square, other = ((a * b).T for a, b in ((before, after), (before, before), (after, after)))
    lengths = np.sqrt(square[0] + square[1] + square[2]) * np.sqrt(other[0] + other[1] + other[2])
    cosines: np.ndarray = (product[0] + product[1] + product[2]) / np.where(lengths > 0, lengths, 1.0)
    return cosines


def _closing_edge(edges: np.ndarray, vertex_count: int) -> int:
    """Return the row of the first edge in `edges` (E, 2) whose vertices earlier edges already connect, so that it
    closes a cycle."""
    leader = list(range(vertex_count))

    def find(vertex: int) -> int:
        while leader[vertex] != vertex:
            leader[vertex] = vertex = leader[leader[vertex]]
        return vertex

    for row, (u, v) in enumerate(edges.tolist()):
        u, v = find(u), find(v)
        if u == v:
            return row
        leader[u] = v
    raise AssertionError("a graph that is no forest has a closing edge")


def _raise_cycle(edge: np.ndarray) -> None:
    raise ClipError(
        f"edges: the edge {edge[0]} - {edge[1]} closes a cycle, expected centre lines without cycles; "
        "or give vertex_branch and branch_parent"
    )


def _preorder(branch_parent: np.ndarray, sibling_order: np.ndarray) -> np.ndarray:
    """Return the branch numbers in depth-first preorder. `sibling_order` lists all branches so that children of one
    branch are in the order in which they are to be visited."""
    children: list[list[int]] = [[] for _ in range(len(branch_parent) + 1)]
    for branch in sibling_order[::-1].tolist():
        children[branch_parent[branch]].append(branch)
    stack, order = children[-1], []
    while stack:
        branch = stack.pop()
        order.append(branch)
        stack += children[branch]
    return np.array(order, np.int64)


def _subtree_sizes(parent: np.ndarray) -> np.ndarray:
    """Return the number of branches in the subtree of each branch, itself included. `parent` (B,) is in file order.
    Raises ClipError unless this is depth-first preorder."""
    counted = [1] * len(parent)
    parents = parent.tolist()
    for branch in range(len(counted) - 1, -1, -1):
        if parents[branch] >= 0:
            counted[parents[branch]] += counted[branch]
    sizes = np.array(counted, np.int64)
    stop = np.arange(len(parent)) + sizes
    bad = np.flatnonzero((parent >= 0) & (stop > stop[parent]))
    if bad.size:
        raise ClipError(
            f"branch_parent: branch {bad[0]} lies outside its parent's range, expected depth-first preorder"
        )
    return sizes


def _check_parents_before(parent: np.ndarray) -> None:
    bad = np.flatnonzero((parent < -1) | (parent >= np.arange(len(parent))))
    if bad.size:
        raise ClipError(f"branch_parent: branch {bad[0]} has parent {parent[bad[0]]}, expected one before it or -1")


def _check_stems(parent: np.ndarray, stem_count: np.ndarray, attach: np.ndarray) -> None:
    """Raise ClipError unless every stem has vertices, parents come before their children, and each branch is attached
    to a vertex of its parent's stem. The arrays (B,) are in file order."""
    if not len(parent) == len(stem_count) == len(attach) > 0:
        lengths = f"{len(parent)}, {len(stem_count)} and {len(attach)}"
        raise ClipError(f"hierarchy: got {lengths} parents, stems and attach points, expected equally many, at least 1")
    bad = np.flatnonzero((stem_count < 1) | (stem_count >= MAX_VERTICES))
    if bad.size:
        raise ClipError(f"stem_count: branch {bad[0]} has {stem_count[bad[0]]} vertices, expected at least 1")
    if stem_count.sum() > MAX_VERTICES:
        raise ClipError(f"stem_count: got {stem_count.sum()} vertices in all, expected at most {MAX_VERTICES}")
    _check_parents_before(parent)
    first = np.cumsum(stem_count) - stem_count
    low = np.where(parent < 0, -1, first[parent])
    high = np.where(parent < 0, -1, first[parent] + stem_count[parent] - 1)
    bad = np.flatnonzero((attach < low) | (attach > high))
    if bad.size:
        b = bad[0]
        raise ClipError(f"attach: branch {b} hangs on vertex {attach[b]}, expected {low[b]} to {high[b]}")


def _attach_points(
    parent: np.ndarray, stem_count: np.ndarray, rest: np.ndarray, edges: np.ndarray | None
) -> np.ndarray:
    """Return the vertex of the parent's stem that each branch is attached to (B,), -1 for a root. If no edge joins a
    branch to that stem, this is the stem's vertex nearest to the branch's base in the rest pose, `rest` (N, 3). All
    arrays are in file order."""
    attach = np.full(len(parent), -1, np.int64)
    first = np.cumsum(stem_count) - stem_count
    if edges is not None:
        branch, joint = _joining_edges(parent, np.repeat(np.arange(len(parent)), stem_count), rest, edges)
        attach[branch] = joint
    for lone in np.flatnonzero((parent >= 0) & (attach < 0)).tolist():
        start = first[parent[lone]]
        stem = rest[start : start + stem_count[parent[lone]]]
        attach[lone] = start + int(((stem - rest[first[lone]]) ** 2).sum(axis=1).argmin())
    return attach


def _joining_edges(
    parent: np.ndarray, vertex_branch: np.ndarray, rest: np.ndarray, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return (branches, vertices): the branches that an edge joins to their parent's stem, and the vertex of the stem
    at that edge. Of several edges, the one nearest to the branch's base is taken, then the shortest."""
    child_vertex, other = np.concatenate([edges, edges[:, ::-1]]).T
    joins = parent[vertex_branch[child_vertex]] == vertex_branch[other]
    child_vertex, other = child_vertex[joins], other[joins]
    length = ((rest[child_vertex] - rest[other]) ** 2).sum(axis=1)
    order = np.lexsort((other, length, child_vertex))
    branch, best = np.unique(vertex_branch[child_vertex[order]], return_index=True)
    return branch, other[order][best]


def _file_edges(edges: np.ndarray | None, vertex_source: np.ndarray) -> np.ndarray | None:
    return None if edges is None else _inverse(vertex_source)[edges.astype(np.int64)]


def _permutation(name: str, permutation: np.ndarray | None, count: int) -> np.ndarray:
    if permutation is None:
        return np.arange(count)
    if not np.array_equal(np.sort(permutation), np.arange(count)):
        raise ClipError(f"{name}: got no permutation, expected each number from 0 to {count - 1} once")
    return permutation


def _inverse(permutation: np.ndarray) -> np.ndarray:
    inverse = np.empty(len(permutation), np.int64)
    inverse[permutation] = np.arange(len(permutation))
    return inverse


def _lookup(table: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Return table[indices], with -1 staying -1."""
    return np.where(indices < 0, -1, table[indices])
