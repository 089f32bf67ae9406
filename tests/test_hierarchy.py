"""Branches from labels and from edges: order, attachment, and extreme trees."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from athcodec.errors import ClipError
from athcodec.motion.hierarchy import (
    Hierarchy,
    branch_orders,
    branches_from_edges,
    build_hierarchy,
    derived_edges,
    hierarchy_of,
)


def undirected(edges):
    return {tuple(sorted(edge)) for edge in np.asarray(edges).tolist()}


@st.composite
def random_forests(draw):
    """Edges of a forest under shuffled vertex numbers, and a rest pose with many coincident vertices."""
    count = draw(st.integers(1, 40))
    parent = [draw(st.integers(max(-1, i - 6), i - 1)) for i in range(count)]
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    number = rng.permutation(count)
    edges = np.array([(number[i], number[p]) for i, p in enumerate(parent) if p >= 0], int).reshape(-1, 2)
    return rng.permutation(edges), count, rng.integers(0, 3, (count, 3)).astype(float)


@st.composite
def labelled_trees(draw):
    branches = draw(st.integers(1, 25))
    parent = np.array([draw(st.integers(-1, b - 1)) for b in range(branches)])
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    number = rng.permutation(branches)
    shuffled = np.empty(branches, int)
    shuffled[number] = np.where(parent < 0, -1, number[parent])
    labels = rng.permutation(np.concatenate([np.arange(branches), rng.integers(0, branches, 30)]))
    return labels, shuffled, rng.integers(0, 3, (len(labels), 3)).astype(float)


def slow_orders(parent):
    orders = []
    for branch in range(len(parent)):
        order = 0
        while parent[branch] >= 0:
            branch, order = parent[branch], order + 1
        orders.append(order)
    return orders


@given(labelled_trees())
def test_file_order_is_depth_first_and_says_all_of_the_source(tree):
    labels, parent, rest = tree
    h = build_hierarchy(labels, parent, rest)
    assert np.array_equal(labels[h.vertex_source], h.branch_source[h.vertex_branch()])
    assert (h.branch_parent < np.arange(h.branch_count)).all()
    assert h.branch_depth.tolist() == slow_orders(h.branch_parent)
    for b in range(h.branch_count):
        first, stop = h.subtree_range(b)
        descendants = [c for c in range(h.branch_count) if b in lineage(h, c)]
        assert descendants == list(range(b, b + h.subtree_branches[b]))
        assert np.isin(h.vertex_branch()[first:stop], descendants).all()
        assert stop - first == h.stem_count[descendants].sum()
        assert (np.diff(h.vertex_source[h.first_vertex[b] : h.first_vertex[b] + h.stem_count[b]]) > 0).all()
        siblings = h.branch_source[h.branch_parent == h.branch_parent[b]]
        assert (np.diff(siblings) > 0).all()
    vertex_branch, branch_parent, _ = h.source_branches()
    assert np.array_equal(vertex_branch, labels) and np.array_equal(branch_parent, parent)


def lineage(h, branch):
    found = []
    while branch >= 0:
        found.append(branch)
        branch = h.branch_parent[branch]
    return found


@given(labelled_trees())
def test_without_edges_a_branch_attaches_at_the_nearest_vertex_of_its_parent(tree):
    h = build_hierarchy(*tree)
    rest, branch = tree[2][h.vertex_source], h.vertex_branch()
    for b in range(h.branch_count):
        if h.branch_parent[b] < 0:
            assert h.attach[b] == -1
            continue
        stem = np.flatnonzero(branch == h.branch_parent[b])
        distance = np.linalg.norm(rest[stem] - rest[h.first_vertex[b]], axis=1)
        assert h.attach[b] == stem[distance.argmin()]


@given(random_forests())
def test_branches_derived_from_edges_give_the_edges_back(forest):
    edges, count, rest = forest
    labels, parent, places = branches_from_edges(edges, count, rest)
    h = build_hierarchy(labels, parent, rest, edges, places)
    assert undirected(derived_edges(h)) == undirected(edges)
    assert len(derived_edges(h)) == len(edges)
    assert np.array_equal(h.branch_source, np.arange(h.branch_count))
    assert np.array_equal(h.source_branches()[2], places)


@given(random_forests())
def test_each_part_is_rooted_at_its_lowest_vertex(forest):
    edges, count, rest = forest
    h = build_hierarchy(*branches_from_edges(edges, count, rest, up_axis="-z")[:2], rest)
    for b in np.flatnonzero(h.branch_parent < 0):
        labels, _, places = branches_from_edges(edges, count, rest, up_axis="-z")
        base = np.flatnonzero((labels == h.branch_source[b]) & (places == 0))[0]
        first, stop = h.subtree_range(b)
        assert rest[base, 2] == rest[h.vertex_source[first:stop], 2].max()


def turned_by(rest, before, fork, after):
    """The cosine of the angle by which a way turns, 0 where two vertices coincide."""
    ways = rest[fork] - rest[before], rest[after] - rest[fork]
    lengths = np.prod([np.linalg.norm(way) for way in ways])
    return ways[0] @ ways[1] / lengths if lengths else 0.0


@given(random_forests())
def test_the_stem_goes_straight_on_or_else_into_the_larger_subtree(forest):
    edges, count, rest = forest
    labels, parent, places = branches_from_edges(edges, count, rest)
    h = build_hierarchy(labels, parent, rest, edges, places)
    rest = rest[h.vertex_source]
    for b in np.flatnonzero(h.attach >= 0):
        stem, fork = h.branch_parent[b], h.attach[b]
        stem_end = h.first_vertex[stem] + h.stem_count[stem]
        side = np.subtract(*h.subtree_range(b)[::-1])
        siblings = np.flatnonzero(h.branch_parent == stem)
        later = siblings[h.attach[siblings] > fork]
        ahead = stem_end - 1 - fork + sum(np.subtract(*h.subtree_range(c)[::-1]) for c in later)
        assert fork + 1 < stem_end  # No stem ends where it forks.
        before = fork - 1 if fork > h.first_vertex[stem] else h.attach[stem]
        ways = (fork + 1, h.first_vertex[b])
        on, aside = (0.0, 0.0) if before < 0 else (turned_by(rest, before, fork, way) for way in ways)
        assert on > aside - 1 / 32
        assert ahead >= side or on > aside + 1e-9


def test_a_limb_of_many_vertices_at_the_end_of_a_trunk_does_not_take_its_tip():
    #   0-1-2-3-4 the trunk, 2-5-6-7-8 a limb that leaves it to the side
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [2, 5], [5, 6], [6, 7], [7, 8]])
    rest = np.array([[0, 0], [0, 1], [0, 2], [0.1, 3], [0, 4], [1, 2.5], [2, 3], [3, 3.5], [4, 4]])
    labels, parent, _ = branches_from_edges(edges, 9, np.column_stack([rest, np.zeros(9)]))
    assert labels.tolist() == [0, 0, 0, 0, 0, 1, 1, 1, 1] and parent.tolist() == [-1, 0]


def test_orders_count_from_the_trunk_outwards():
    #   0-1-2-3-4-5 the trunk, 2-6-7-8 a branch, 7-9 a twig
    edges = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [2, 6], [6, 7], [7, 8], [7, 9]]
    rest = np.array([[0, y, 0] for y in (0, 1, 2, 3, 4, 5, 3, 4, 5, 5)], float)
    # The trunk goes on into 6 because more vertices hang there than beyond 3.
    labels, parent, places = branches_from_edges(np.array(edges), 10, rest)
    assert labels.tolist() == [0, 0, 0, 1, 1, 1, 0, 0, 0, 2]
    assert parent.tolist() == [-1, 0, 0]
    assert places.tolist() == [0, 1, 2, 0, 1, 2, 3, 4, 5, 0]


def test_a_given_root_is_used_and_other_parts_find_their_own():
    edges = np.array([[0, 1], [1, 2], [3, 4]])
    rest = np.array([[0, y, 0] for y in (0, 1, 2, 5, 4)], float)
    labels, _, places = branches_from_edges(edges, 5, rest, root=2)
    assert places.tolist() == [2, 1, 0, 1, 0] and labels[0] == labels[1] == labels[2] != labels[3]
    with pytest.raises(ClipError, match="at most one in each connected part"):
        branches_from_edges(edges, 5, rest, root=[0, 2])
    with pytest.raises(ClipError, match="expected vertices 0 to 4"):
        branches_from_edges(edges, 5, rest, root=5)


def test_an_edge_given_twice_is_no_cycle():
    labels, parent, _ = branches_from_edges(np.array([[0, 1], [1, 0], [1, 2]]), 3, np.zeros((3, 3)))
    assert labels.tolist() == [0, 0, 0] and parent.tolist() == [-1]


@given(random_forests(), st.data())
def test_any_cycle_is_refused_with_an_edge_of_it(forest, data):
    edges, count, rest = forest
    labels, parent, places = branches_from_edges(edges, count, rest)
    u, v = (data.draw(st.integers(0, count - 1)) for _ in range(2))
    if tuple(sorted((u, v))) in undirected(edges):
        return
    closed = np.concatenate([edges, [[u, v]]]).astype(int)
    roots = [root_of(parent, labels[vertex]) for vertex in (u, v)]
    if roots[0] != roots[1]:
        branches_from_edges(closed, count, rest)
        return
    with pytest.raises(ClipError, match=r"the edge (\d+) - (\d+) closes a cycle") as caught:
        branches_from_edges(closed, count, rest)
    named = tuple(int(word) for word in str(caught.value).replace(" - ", " ").split() if word.isdigit())
    broken = np.array(sorted(undirected(closed) - {named}), int).reshape(-1, 2)
    branches_from_edges(broken, count, rest)


def root_of(parent, branch):
    while parent[branch] >= 0:
        branch = parent[branch]
    return branch


def test_an_edge_decides_where_a_branch_attaches_even_if_another_vertex_is_nearer():
    rest = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0.1, 2, 0], [1, 2, 0]], float)
    labels, parent = [0, 0, 0, 1, 1], [-1, 0]
    assert build_hierarchy(labels, parent, rest).attach.tolist() == [-1, 2]
    to_base = np.array([[1, 3], [4, 0]], np.uint64)
    assert build_hierarchy(labels, parent, rest, to_base).attach.tolist() == [-1, 1]
    assert build_hierarchy(labels, parent, rest, np.array([[4, 0]])).attach.tolist() == [-1, 0]
    unrelated = np.array([[0, 1], [3, 4], [3, 3]])
    assert build_hierarchy(labels, parent, rest, unrelated).attach.tolist() == [-1, 2]


def test_coincident_vertices_and_a_branch_on_a_first_vertex_work():
    labels, parent = [0, 1, 2, 3], [-1, 0, 1, 1]
    h = build_hierarchy(labels, parent, np.zeros((4, 3)), np.array([[0, 1], [1, 2], [1, 3]]))
    assert h.attach.tolist() == [-1, 0, 1, 1] and h.stem_count.tolist() == [1, 1, 1, 1]


def test_the_sample_is_stored_as_it_stands(sample_clip):
    h = hierarchy_of(sample_clip)
    assert all(np.array_equal(source, np.arange(len(source))) for source in (h.vertex_source, h.branch_source))
    assert h.branch_depth.max() == 2 and h.branch_count == 99
    assert np.array_equal(derived_edges(h), sample_clip.edges)


def test_a_chain_of_100000_vertices_is_one_stem_from_base_to_tip():
    count = 100_000
    chain = np.random.default_rng(0).permutation(count)
    rest = np.zeros((count, 3))
    rest[chain, 1] = np.arange(count)
    labels, parent, places = branches_from_edges(np.stack([chain[1:], chain[:-1]], 1), count, rest)
    assert parent.tolist() == [-1]
    assert np.array_equal(places[chain], np.arange(count))
    assert np.array_equal(build_hierarchy(labels, parent, rest, stem_index=places).vertex_source, chain)


def test_branches_nest_20000_deep():
    count = 20_000
    parent = np.arange(count) - 1
    h = build_hierarchy(np.arange(count), parent, np.zeros((count, 3)))
    assert h.branch_depth[-1] == count - 1 and h.subtree_range(1) == (1, count)
    assert np.array_equal(h.attach, parent)


@given(labelled_trees())
def test_orders_do_not_depend_on_the_numbering(tree):
    assert branch_orders(tree[1]).tolist() == slow_orders(tree[1])


@given(labelled_trees())
def test_a_hierarchy_comes_back_from_its_parts(tree):
    h = build_hierarchy(*tree)
    again = Hierarchy.from_parts(h.branch_parent, h.stem_count, h.attach, h.vertex_source, h.branch_source)
    assert all(np.array_equal(getattr(h, name), getattr(again, name)) for name in h.__dataclass_fields__)
