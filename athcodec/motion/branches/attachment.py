"""A tree over labelled vertices, and the order of the vertices along each branch.

A branch hangs where it stays closest to a larger one in a few frames; or, for an encoder, on one of those that it is
close to, or nowhere, whichever takes the fewest bits (price.py). Its vertices are put in order of their distance over
the mesh from there.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from athcodec.motion.branches.forest import cheapest_forest, without_needless_orders
from athcodec.motion.branches.groups import cheapest_of_each, sizes_of_each
from athcodec.motion.branches.price import Prices
from athcodec.motion.branches.result import Found, checked_branches
from athcodec.motion.branches.rows import row_places
from athcodec.motion.branches.seen import Seen, components
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.clip import source_stem_index, stem_index_of
from athcodec.motion.polygons import sides
from athcodec.untyped import ScipyObject

NEIGHBOURS = 60  # Nearest vertices of each one among which other branches are sought.
LONE_PARTS = 64  # Most parts of the plant whose nearest others are sought at any distance.
QUERY = 1 << 21  # Neighbours in one query.
STAYING = 300.0  # Weight of the variation of two branches' distance against its size.
RELATED = 0.5  # Cost factor for each word that the names of two branches have in common, place by place.
ALIKE = 4.0  # Cost factor of two branches of the same size: no leaf grows on a leaf.
ROOT_SIZE = 0.25  # Part of the largest branch's diagonal below which a branch is no root.
WORTH_LEVELS = 0.01  # Part of the bits of roots that hanging saves at least: a few in levels of their own cost more.
LEVEL = 200.0  # Bits of a level beside those of its branches: components over time, statistics.
LOWER = 10.0  # Bits, for each of its branches, up to which those are not surely better there than at lower levels.
MOST_STRAIN = 30.0  # Bits at most that a contact costs because it is far or does not stay.
IN_ORDER = 0.7  # Rank correlation of the source's order with the distance from the base that keeps the source's order.
SMALL = 8  # Vertices of a branch up to which the source's order is always kept.


def arranged(
    seen: Seen,
    label: np.ndarray,
    root: int | None,
    method: str,
    parent: np.ndarray | None = None,
    names: Sequence[Sequence[str]] = (),
) -> Found:
    """Arrange branches as a forest, and order the vertices of each from base to tip. `label`: the branch of each
    vertex, (N,); `root`: a vertex of the branch that is to be the root, or None; `method`: the name of the method, kept
    in the result; `parent`: the parent of each branch where it is known, else it is found; `names`: the words of each
    branch's name, whose first ones related branches share.
    """
    frames, rest = seen.frames, seen.clip.rest
    if parent is None:
        contacts = _contacts(frames, label, names)
        if seen.by_price:
            joints = _joints_by_price(frames, seen.frames_of_roots, label, contacts, root)
        else:
            joints = _joints_by_contact(frames, label, contacts, root, seen.is_carried)
    else:
        joints = _joints_of(rest, frames, label, parent)
    return checked_branches(label, joints.parent, _along(seen, label, joints), method)


def single_by_rows(seen: Seen) -> Found | None:
    """Return one branch of all vertices, row by row from where it moves least, if it is a grid whose rows the source
    does not keep; else None."""
    label = np.zeros(seen.clip.vertex_count, np.int64)
    place = _row_places(seen, label, _stillest(seen.frames, label))
    return None if place[0] < 0 else checked_branches(label, np.array([-1]), place, "motion")


@dataclass(frozen=True)
class _Joints:
    """Where branches hang: parent (B,), -1 for a root, and base (B,), the branch's vertex that is nearest to the
    parent."""

    parent: np.ndarray
    base: np.ndarray


@dataclass(frozen=True)
class _Contacts:
    """Pairs of branches that may hang on each other: (C, 2) vertices of theirs, and the cost (C,)."""

    vertices: np.ndarray
    cost: np.ndarray


def _joints_by_price(
    frames: np.ndarray, of_roots: np.ndarray, label: np.ndarray, contacts: _Contacts, root: int | None
) -> _Joints:
    """Return the forest of branches that takes the fewest bits: each branch hangs on the one where it costs least, or
    is a root. `frames`: (F, N, 3) positions; `of_roots`: the same with all motion that a root has; `label`: the branch
    of each vertex, (N,); `contacts`: where branches may hang on each other; `root`: a vertex of the only root, as far
    as contacts lead to it, or None.
    """
    prices, count = Prices(frames, label), int(label.max()) + 1
    vertices = np.concatenate([contacts.vertices, contacts.vertices[:, ::-1]])  # Of a branch, and of its parent.
    child, parent = label[vertices].T
    cost = np.tile(contacts.cost, 2)
    size = np.maximum(sizes_of_each(frames[0], label)[child], cost / MOST_STRAIN)
    hanging = prices.on_others(vertices) + cost / np.maximum(size, np.finfo(float).tiny)
    alone = (prices if of_roots is frames else Prices(of_roots, label)).as_roots()
    if root is not None:
        alone += hanging.sum() + alone.sum()
        alone[label[root]] = 0.0
    arcs = np.append(child, np.arange(count)), np.append(parent, np.full(count, count)), np.append(hanging, alone)
    chosen = without_needless_orders(*arcs, cheapest_forest(count, *arcs), LEVEL, LOWER)
    hangs = chosen < len(child)
    if (alone - arcs[2][chosen]).sum() < WORTH_LEVELS * alone.sum():
        hangs[:] = False
    base, above = _stillest(frames, label), np.full(count, -1)
    base[hangs], above[hangs] = vertices[chosen[hangs], 0], parent[chosen[hangs]]
    return _Joints(above, base)


def _joints_by_contact(
    frames: np.ndarray, label: np.ndarray, contacts: _Contacts, root: int | None, is_carried: bool
) -> _Joints:
    """Return a tree for each set of branches that contacts connect: the tree whose contacts have the least total cost,
    hung on its root. `frames`: (F, N, 3) positions; `label`: the branch of each vertex, (N,); `root`: a vertex of the
    branch that is to be a root, or None; `is_carried`: whether the frames lack motion that the whole plant has.
    """
    count = int(label.max()) + 1
    branch, other = label[contacts.vertices].T
    sparse, graphs = scipy_module("sparse"), scipy_module("sparse.csgraph")
    least = contacts.cost.max(initial=1e-30) * 1e-9  # A cost of 0 would be no contact.
    graph = sparse.coo_matrix((contacts.cost + least, (branch, other)), (count, count)).tocsr()
    tree = graphs.minimum_spanning_tree(graph)
    parts = graphs.connected_components(tree, directed=False)[1]
    still = _stillest(frames, label)
    roots = _roots(frames, label, still, parts, root, is_carried)
    hub = sparse.coo_matrix((np.ones(len(roots)), (np.full(len(roots), count), roots)), (count + 1, count + 1))
    whole = sparse.bmat([[tree, None], [None, sparse.coo_matrix((1, 1))]]) + hub
    parent = graphs.breadth_first_order(whole, count, directed=False)[1][:count]
    parent = np.where(parent == count, -1, parent)
    return _Joints(parent, _bases(parent, still, branch, other, contacts.vertices))


def _bases(
    parent: np.ndarray, still: np.ndarray, branch: np.ndarray, other: np.ndarray, vertices: np.ndarray
) -> np.ndarray:
    """Return the vertex at which each branch begins: where it hangs on its parent, else its vertex that moves least."""
    base = still.copy()
    for child, above, vertex in ((branch, other, vertices[:, 0]), (other, branch, vertices[:, 1])):
        hangs = parent[child] == above
        base[child[hangs]] = vertex[hangs]
    return base


def _joints_of(rest: np.ndarray, frames: np.ndarray, label: np.ndarray, parent: np.ndarray) -> _Joints:
    """Return where each branch hangs on its parent, for branches whose `parent`, (B,), is known. `rest`: (N, 3)
    positions; `frames`: (F, N, 3) positions; `label`: the branch of each vertex, (N,).
    """
    tree_of: dict[int, ScipyObject] = {}
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
    """Return the vertex of each branch that moves least, (B,), where a root begins."""
    way = ((frames - frames[0]) ** 2).sum(axis=(0, 2))
    return cheapest_of_each(label, way)


def _roots(
    frames: np.ndarray, label: np.ndarray, still: np.ndarray, parts: np.ndarray, root: int | None, is_carried: bool
) -> np.ndarray:
    """Return the root branch of each connected part: of its large branches, the one with the vertex that moves least,
    or the largest of all if the frames lack motion that the whole plant has, since any part may stand still in these.
    `frames`: (F, N, 3) positions; `label`: the branch of each vertex, (N,); `still`: the vertex of each branch that
    moves least, (B,); `parts`: the connected part of each branch, (B,); `root`: a vertex of the branch that is to be a
    root in any case, or None.
    """
    size = sizes_of_each(frames[0], label)
    largest = np.zeros(parts.max() + 1)
    np.maximum.at(largest, parts, size)
    way = -size if is_carried else ((frames[:, still] - frames[0, still]) ** 2).sum(axis=(0, 2))
    is_small = size < ROOT_SIZE * largest[parts]
    if root is not None:
        way[label[root]], is_small[label[root]] = -np.inf, False
    order = np.lexsort((-size, way, is_small, parts))
    return order[np.unique(parts[order], return_index=True)[1]]


def _contacts(frames: np.ndarray, label: np.ndarray, names: Sequence[Sequence[str]]) -> _Contacts:
    """Return for every two branches that are near each other the pair of vertices, one of each, at which they most
    likely hang together: a pair that is near, and keeps its distance over the frames, costs little. `frames`: (F, N, 3)
    positions, the rest pose first; `label`: the branch of each vertex, (N,); `names`: the words of each branch's name,
    or none.
    """
    pairs = _near_pairs(frames[0], label)
    gap = np.linalg.norm(frames[0, pairs[:, 0]] - frames[0, pairs[:, 1]], axis=1)
    near = gap <= sizes_of_each(frames[0], label)[label[pairs]].max(axis=1)
    pairs, cost = pairs[near], gap[near]
    tracks = np.ascontiguousarray(frames.transpose(1, 0, 2))  # The frames of a vertex follow each other.
    for start in range(0, len(pairs), QUERY // len(frames)):
        some = slice(start, start + QUERY // len(frames))
        squares = np.square(tracks[pairs[some, 0]] - tracks[pairs[some, 1]])
        cost[some] += STAYING * np.sqrt(squares[..., 0] + squares[..., 1] + squares[..., 2]).std(axis=1)
    size = np.bincount(label)[label[pairs]]
    cost[size[:, 0] == size[:, 1]] *= ALIKE
    both = np.sort(label[pairs], axis=1)
    if names:
        pair, back = np.unique(both, axis=0, return_inverse=True)
        shared = [sum(map(operator.eq, names[a], names[b])) for a, b in pair.tolist()]
        cost *= RELATED ** np.array(shared)[back.ravel()]
    best = cheapest_of_each(both[:, 0] * (int(label.max()) + 1) + both[:, 1], cost)
    return _Contacts(pairs[best], cost[best])


def _near_pairs(rest: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return pairs of near vertices of different branches, (C, 2): each vertex with the nearest one on every branch
    that is near it. `rest`: (N, 3) positions; `label`: the branch of each vertex, (N,).
    """
    cKDTree, count = scipy_module("spatial").cKDTree, int(label.max()) + 1
    near_pairs = [np.zeros((0, 2), np.int64), *_others_nearby(cKDTree(rest), rest, label, min(NEIGHBOURS, len(rest)))]
    part = components(np.concatenate([label[pairs] for pairs in near_pairs]), count)
    sizes = np.bincount(part, np.bincount(label, minlength=count))
    # The vertices of such a part have only each other as neighbours.
    for lone in np.argsort(-sizes)[1 : 1 + LONE_PARTS]:
        is_inside = part[label] == lone
        vertices, others = np.flatnonzero(is_inside), np.flatnonzero(~is_inside)
        near_pairs.append(np.stack([vertices, others[cKDTree(rest[others]).query(rest[vertices])[1]]], axis=1))
    return np.concatenate(near_pairs)


def _others_nearby(tree: ScipyObject, rest: np.ndarray, label: np.ndarray, near: int) -> Iterator[np.ndarray]:
    """Yield arrays of pairs of vertices, (K, 2), of different branches: each vertex with those of its `near` nearest
    vertices that are of other branches, the nearest one for each branch. `tree`: a search tree of `rest`, (N, 3);
    `label`: the branch of each vertex, (N,).
    """
    length = max(1, QUERY // near)
    for start in range(0, len(rest), length):
        some = np.arange(start, min(start + length, len(rest)))
        apart, others = (array.reshape(len(some), -1) for array in tree.query(rest[some], k=near))
        row, column = np.nonzero(label[others] != label[some][:, None])
        other = others[row, column]
        best = cheapest_of_each(some[row] * (int(label.max()) + 1) + label[other], apart[row, column])
        yield np.stack([some[row[best]], other[best]], axis=1)


def _along(seen: Seen, label: np.ndarray, joints: _Joints) -> np.ndarray:
    """Return the places of the vertices on their branches, (N,), from the base out: row by row where a branch is a grid
    whose rows the source does not keep; else the source's order, or its reverse, if it is one, else by the distance
    from the base over the links within the branch."""
    rest, source = seen.clip.rest, source_stem_index(label)
    place = stem_index_of(label, _ways(rest, label, joints, seen.links))
    agreement = _rank_correlation(label, place, source)
    size = np.bincount(label)
    turned = np.where(agreement[label] < 0, size[label] - 1 - source, source)
    along = np.where((np.abs(agreement) >= IN_ORDER)[label] | (size <= SMALL)[label], turned, place)
    by_rows = _row_places(seen, label, joints.base)
    return np.where(by_rows < 0, along, by_rows)


def _row_places(seen: Seen, label: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return the places of the vertices on branches whose rows their faces tell, as row_places does, (N,)."""
    polygons = seen.clip.polygons
    if polygons is None:
        return np.full(len(label), -1)
    return row_places(seen.clip.rest, label, sides(*polygons), base, source_stem_index(label))


def _ways(rest: np.ndarray, label: np.ndarray, joints: _Joints, links: np.ndarray) -> np.ndarray:
    """Return the distance of each vertex from the base of its branch, (N,), over the links within it; straight if no
    links lead there."""
    inner = links[label[links[:, 0]] == label[links[:, 1]]]
    length = np.linalg.norm(rest[inner[:, 0]] - rest[inner[:, 1]], axis=1)
    graph = scipy_module("sparse").coo_matrix((length, inner.T), (len(rest),) * 2).tocsr()
    graph.data = np.maximum(graph.data, 1e-30)  # A distance of 0 would be no link.
    way: np.ndarray = scipy_module("sparse.csgraph").dijkstra(graph, directed=False, indices=joints.base, min_only=True)
    return np.where(np.isfinite(way), way, np.linalg.norm(rest - rest[joints.base][label], axis=1))


def _rank_correlation(label: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return Spearman's coefficient of each branch, (B,), between two orders of its vertices."""
    size = np.bincount(label)
    apart = np.bincount(label, (first - second).astype(np.float64) ** 2)
    return 1 - 6 * apart / np.maximum(size * (size.astype(np.float64) ** 2 - 1), 1)
