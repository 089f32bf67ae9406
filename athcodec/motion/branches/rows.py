"""Rows of meshes that are grids: the rings of tubes and the rows of leaves, from the base of each branch to its tip.

Programs that order vertices for the caches of graphics cards, or by no rule, lose the order in which a tube or a leaf
was made. Its faces still tell it: the row at the base is a side of the outline, and every other row is one side of a
face further away from it.
"""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.groups import cheapest_of_each
from athcodec.motion.branches.steady import connected_parts, scipy_module

CORNERS = 4  # Corners of a leaf's outline; a tube's has none.


def row_places(
    rest: np.ndarray, label: np.ndarray, sides: np.ndarray, base: np.ndarray, source: np.ndarray
) -> np.ndarray:
    """Return the place of each vertex on its branch, row by row from the base, (N,); -1 on branches that are no grid,
    or whose rows follow each other in the source.

    Parameters
    ----------
    rest : (N, 3) array
    label : (N,) integer array
        The branch of each vertex.
    sides : (S, 2) integer array
        The sides of all faces, in the direction in which each face goes round.
    base : (B,) integer array
        The vertex at which each branch begins.
    source : (N,) integer array
        The place of each vertex among those of its branch in the source.
    """
    inner = sides[(label[sides[:, 0]] == label[sides[:, 1]]) & (sides[:, 0] != sides[:, 1])]
    pairs, which, times = np.unique(np.sort(inner, axis=1), axis=0, return_inverse=True, return_counts=True)
    outline = inner[times[which.ravel()] == 1]
    across = _first_rows(rest, label, outline, np.bincount(pairs.ravel(), minlength=len(rest)), base)
    level = _hops(pairs, np.flatnonzero(across >= 0), len(rest))
    is_grid = _are_even(label, level, across)
    column = _columns(rest, pairs, outline, np.where(is_grid[label], level, -1), across)
    is_grid &= _are_distinct(label, level, column)
    is_grid &= ~_are_in_order(label, level, source)
    order = np.lexsort((column, level, label))
    first = np.cumsum(np.bincount(label)) - np.bincount(label)
    place = np.empty(len(rest), np.int64)
    place[order] = np.arange(len(rest)) - first[label[order]]
    return np.where(is_grid[label], place, -1)


def _first_rows(
    rest: np.ndarray, label: np.ndarray, outline: np.ndarray, degree: np.ndarray, base: np.ndarray
) -> np.ndarray:
    """Return the place of each vertex along the row at the base of its branch, (N,), -1 for those of other rows.
    `outline`: the sides of one face only, (O, 2); `degree`: how many others each vertex is joined to, (N,).
    """
    across = np.full(len(rest), -1)
    if not len(outline):
        return across
    on_outline, times = np.unique(outline, return_counts=True)
    loop, usual = connected_parts(outline, len(rest)), np.zeros(len(rest), np.int64)
    np.maximum.at(usual, loop[on_outline], degree[on_outline])
    is_corner = degree < usual[loop]
    corners = np.bincount(loop[on_outline], is_corner[on_outline], len(rest))
    passes_once = np.bincount(loop[on_outline], times != 2, len(rest)) == 0
    is_side = passes_once & np.isin(corners, (0, CORNERS))
    away = np.square(rest[on_outline] - rest[base[label[on_outline]]]).sum(axis=1)
    nearest = on_outline[cheapest_of_each(label[on_outline], away)]
    nearest = nearest[is_side[loop[nearest]]]
    # Sides of the outline that meet at no corner are of one row.
    ends = np.argsort(outline.ravel(), kind="stable") // 2
    first = np.zeros(len(rest), np.int64)
    first[on_outline] = np.cumsum(times) - times
    smooth = on_outline[(times == 2) & ~is_corner[on_outline]]
    row = connected_parts(np.stack([ends[first[smooth]], ends[first[smooth] + 1]], axis=1), len(outline))
    length, one, other = np.bincount(row), ends[first[nearest]], ends[first[nearest] + 1]
    is_chosen = np.isin(row, np.where(length[row[one]] <= length[row[other]], row[one], row[other]))
    closed = corners[loop[nearest]] == 0
    arrives = np.where(outline[one, 1] == nearest, one, other)  # A ring is open where its first face ends.
    is_chosen[arrives[closed]] = False
    steps, of_row = outline[is_chosen], row[is_chosen]
    tip, count = np.unique(steps, return_counts=True)
    tips = tip[(count == 1) & ~np.isin(tip, outline[arrives[closed]])]
    is_tip = np.isin(steps, tips)
    key = np.where(is_tip[:, 0], 0, 1) * len(rest) + np.where(is_tip[:, 0], steps[:, 0], steps[:, 1])
    ended = np.flatnonzero(is_tip.any(axis=1))
    begins = ended[cheapest_of_each(of_row[ended], key[ended])] if len(ended) else ended
    starts = np.concatenate([nearest[closed], np.where(is_tip[begins, 0], steps[begins, 0], steps[begins, 1])])
    along, row_vertices = _hops(steps, starts, len(rest)), np.unique(steps)
    across[row_vertices] = along[row_vertices]
    return across


def _hops(pairs: np.ndarray, starts: np.ndarray, count: int) -> np.ndarray:
    """Return over how many of the pairs of vertices, (P, 2), each of `count` vertices is from the nearest of some
    starts, (count,); -1 where no way leads."""
    if not len(starts):
        return np.full(count, -1)
    graph = scipy_module("sparse").coo_matrix((np.ones(len(pairs)), pairs.T), (count, count)).tocsr()
    dijkstra = scipy_module("sparse.csgraph").dijkstra
    hops = dijkstra(graph, directed=False, indices=starts, min_only=True, unweighted=True)
    return np.where(np.isfinite(hops), hops, -1).astype(np.int64)


def _are_even(label: np.ndarray, level: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Return whether each branch has as many vertices on every level as on the first one, but for the last, (B,)."""
    order = np.lexsort((level, label))
    begins = np.append(True, (np.diff(label[order]) != 0) | (np.diff(level[order]) != 0))
    owner, number = label[order[begins]], level[order[begins]]
    size = np.diff(np.append(np.flatnonzero(begins), len(order)))
    width, rows = np.bincount(label, across >= 0), np.bincount(owner)
    is_last = np.append(owner[1:] != owner[:-1], True)
    odd = np.bincount(owner, (number < 0) | ~is_last & (size != width[owner]))
    even: np.ndarray = (odd == 0) & (width > 1) & (rows > 1)
    return even


def _columns(
    rest: np.ndarray, pairs: np.ndarray, outline: np.ndarray, level: np.ndarray, across: np.ndarray
) -> np.ndarray:
    """Return for each vertex the place along its row, (N,). Rows of leaves begin at the side of the outline that leads
    there from where the first row begins; vertices of rings lie above the nearest ones that sides join them to.
    `level`: the row of each vertex, -1 for what is not asked about.
    """
    of_row = pairs[level[pairs[:, 0]] == level[pairs[:, 1]]]
    rising = outline[level[outline[:, 0]] != level[outline[:, 1]]]
    way = _hops(rising, np.flatnonzero(across == 0), len(rest))
    column = _hops(of_row, np.flatnonzero((way == level) & (level >= 0)), len(rest))
    column[across >= 0] = across[across >= 0]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    lower, upper = both[(level[both[:, 0]] >= 0) & (level[both[:, 1]] == level[both[:, 0]] + 1)].T
    bare = column[upper] < 0
    lower, upper = lower[bare], upper[bare]
    if not len(upper):
        return column
    nearest = cheapest_of_each(upper, np.square(rest[upper] - rest[lower]).sum(axis=1))
    lower, upper = lower[nearest], upper[nearest]
    order = np.argsort(level[upper], kind="stable")
    bounds = np.searchsorted(level[upper][order], np.arange(1, int(level.max()) + 2))
    for begin, end in zip(bounds[:-1], bounds[1:]):
        some = order[begin:end]
        column[upper[some]] = column[lower[some]]
    return column


def _are_distinct(label: np.ndarray, level: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Return whether no two vertices of a branch have the same level and column, (B,)."""
    order = np.lexsort((column, level, label))
    keys = np.stack([label, level, column])[:, order]
    same = (keys[:, 1:] == keys[:, :-1]).all(axis=0)
    distinct = np.ones(int(label.max()) + 1, bool)
    distinct[label[order[1:][same]]] = False
    return distinct


def _are_in_order(label: np.ndarray, level: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Return whether the rows of each branch, or of its reverse, follow each other in the source, (B,)."""
    order = np.lexsort((source, label))
    step, owner = np.diff(level[order]), label[order[1:]]
    inside = label[order[:-1]] == owner
    rises, falls = (np.bincount(owner, inside & some, int(label.max()) + 1) > 0 for some in (step > 0, step < 0))
    return ~(rises & falls)
