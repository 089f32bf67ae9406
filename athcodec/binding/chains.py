"""A plant as chains of nodes, one for each branch, that carry frames: what a mesh is bound to.

A branch of points in a row is a chain of its vertices. Its frames turn along the stem by the smallest rotations, from
node to node and from a parent to its children (parallel transport, as in Bergou et al., "Discrete elastic rods", ACM
Trans. Graph. 27(3), 2008), so they bend with the stem and do not twist about it. A branch that is a surface is a chain
of slices from its foot to its tip. A slice has the centre of its vertices, the rotation that fits them and their
neighbours best, and their size.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from athcodec.decoding.clip_view import ClipView
from athcodec.motion.algebra import nearest_rotations
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.polygons import sides
from athcodec.motion.quaternions import quaternions, rotation_matrices

WINDING = 4.0  # Length of the path through a branch's vertices over its extent, above which they are no line.
GROWTH = 0.1  # Stretch of a stem, as a share of its length, above which its girth and its leaves grow with it.
PRIOR = 1e-3  # Weight, over that of a fit, of the rotation of the whole branch, which decides where the fit is free.
NO_LENGTH = 1e-9  # Share of the plant's diagonal below which two nodes coincide.
LEAST_LENGTH = 1e-30  # The same length of a plant that is a point.


@dataclass(frozen=True)
class Pose:
    """The M nodes of chains in k frames."""

    centre: np.ndarray  # (k, M, 3)
    turn: np.ndarray  # (k, M, 4) unit quaternions x y z w from the rest pose.
    size: np.ndarray  # (k, M) scale of what hangs on the node.


class Chains:
    """The nodes and elements of a plant.

    Parameters
    ----------
    view : ClipView
        The plant.
    rest : (N, 3) array
        The pose of the plant that the mesh is in, in the source's order.

    Attributes
    ----------
    rest : (M, 3) float64
        Nodes in the rest pose.
    diagonal : float
        Diagonal of the plant's bounding box in the rest pose.
    start, end : (E,) int64
        The nodes at both ends of each element; the same node for a branch of one slice. Elements of a branch follow
        each other, from base to tip.
    element_branch : (E,) int64
        The branch of each element, in file order.
    first_element : (B + 1,) int64
        The first element of each branch.
    vertex_of_nodes : (M,) int64
        The first vertex of each node, in the source's order; a node of a line has one.
    is_line : (B,) bool
        Whether the branch is a row of points; the others are surfaces.
    radius : (M,) float64 or None
        Radius of the stem at each node, where the file has the attribute.
    """

    def __init__(self, view: ClipView, rest: np.ndarray):
        """Divide the plant that a view shows into chains of nodes, one for each branch. `rest` (N, 3) is the pose in
        which meshes lie on it, in the source's order of vertices.
        """
        file = view.decoder.file
        self.hierarchy: Hierarchy = file.hierarchy
        self.vertex_rest = np.asarray(rest, np.float64)
        self.diagonal = float(np.linalg.norm(np.ptp(self.vertex_rest, axis=0)))
        self._least = max(NO_LENGTH * self.diagonal, LEAST_LENGTH)
        self.error = float(view.max_error)
        self.branch_of = _branch_in_file_order(self.hierarchy)
        links, has_faces = _links(view)
        self.is_line = self._lines(has_faces, view.edges is not None)
        self._make_nodes(links)
        self._join_nodes()
        self._make_elements()
        self.radius = self._radii(view.attributes.get("radius"))

    # ---- structure ----

    def _lines(self, has_faces: np.ndarray, has_edges: bool) -> np.ndarray:
        """Return which branches are rows of points, (B,) bool: branches without faces, and, unless the plant has edges,
        only those whose vertices stand in a row.
        """
        hierarchy = self.hierarchy
        rest = self.vertex_rest[hierarchy.vertex_source]
        is_surface = np.zeros(hierarchy.branch_count, bool)
        is_surface[self.branch_of[has_faces]] = True
        if has_edges or has_faces.any():
            return ~is_surface
        step = np.linalg.norm(np.diff(rest, axis=0, prepend=rest[:1]), axis=1)
        step[hierarchy.first_vertex] = 0.0
        length = np.add.reduceat(step, hierarchy.first_vertex)
        low, high = (each.reduceat(rest, hierarchy.first_vertex) for each in (np.minimum, np.maximum))
        return length <= WINDING * np.linalg.norm(high - low, axis=1)

    def _make_nodes(self, links: np.ndarray) -> None:
        """Group the vertices of each branch into nodes from base to tip. `links` (L, 2) has the pairs of vertices that
        a surface joins.
        """
        hierarchy = self.hierarchy
        first, count = hierarchy.first_vertex.astype(np.int64), hierarchy.stem_count.astype(np.int64)
        place = np.arange(hierarchy.vertex_count) - np.repeat(first, count)
        slice_of = np.where(np.repeat(self.is_line, count), place, 0)
        surfaces = np.flatnonzero(~self.is_line)
        if len(surfaces):
            rest = self.vertex_rest[hierarchy.vertex_source]
            along, edge = _along_surfaces(hierarchy, rest, links, surfaces)
            for each in surfaces.tolist():
                rows = slice(first[each], first[each] + count[each])
                slice_of[rows] = _slices(rest[rows], along[rows], edge[each])
        of_branch = hierarchy.vertex_branch().astype(np.int64)
        order = np.lexsort((slice_of, of_branch))
        branch, sliced = of_branch[order], slice_of[order]
        begins = np.append(True, (np.diff(branch) != 0) | (np.diff(sliced) != 0))
        self._vertices = hierarchy.vertex_source[order]
        self._starts = np.flatnonzero(begins)
        self._counts = np.diff(np.append(self._starts, len(order)))
        self.node_branch = branch[begins]
        self.rest = self._means(self.vertex_rest[None])[0]
        self.vertex_of_nodes = self._vertices[self._starts]
        node_of = np.empty(len(order), np.int64)
        node_of[order] = np.cumsum(begins) - 1
        self._node_of_vertex = node_of  # By the vertex' number in file order.

    def _join_nodes(self) -> None:
        """Set `before` and `after`, (N,) each: the neighbour of each node towards the root and towards the tip, -1 for
        none. A branch's first node follows the node of its parent that the branch hangs on.
        """
        hierarchy, nodes = self.hierarchy, np.arange(len(self.rest))
        is_first = np.append(True, np.diff(self.node_branch) != 0)
        attach = hierarchy.attach[self.node_branch]
        hangs_on = np.where(attach >= 0, self._node_of_vertex[np.maximum(attach, 0)], -1)
        # A surface is moved by its slices alone: its foot is in its first slice, wherever its parent is.
        hangs_on = np.where(self.is_line[self.node_branch], hangs_on, -1)
        self.before = np.where(is_first, hangs_on, nodes - 1)
        self.after = np.where(np.append(is_first[1:], True), -1, nodes + 1)

    def _make_elements(self) -> None:
        """Set the elements of all chains, each of which joins two neighbouring nodes: their `start` and `end` nodes,
        and their lengths, branches and tangents in the rest pose.
        """
        hierarchy = self.hierarchy
        is_first = np.append(True, np.diff(self.node_branch) != 0)
        alone = is_first & (self.before < 0) & (self.after < 0)
        end = np.flatnonzero((self.before >= 0) | alone)
        self.end, self.start = end, np.where(alone[end], end, self.before[end])
        self.element_branch = self.node_branch[end]
        self.first_element = np.searchsorted(self.element_branch, np.arange(hierarchy.branch_count + 1))
        chord = self.rest[self.end] - self.rest[self.start]
        self.length = np.linalg.norm(chord, axis=1)
        usable = self.length > self._least
        self.length = np.where(usable, self.length, 0.0)
        tangent = self._tangents(self.rest[None])[0]
        direction = chord / np.where(usable, self.length, 1.0)[:, None]
        # At its base a child leaves its parent in the direction of its first element.
        same = self.node_branch[self.start] == self.element_branch
        towards = np.where(same[:, None], tangent[self.start], direction)
        self._leaves = towards * self.length[:, None]
        self._arrives = tangent[self.end] * self.length[:, None]
        self._rest_tangent = tangent

    def _radii(self, radius: np.ndarray | None) -> np.ndarray | None:
        """Return the mean radius of the vertices of each node, (N,); None if the plant states no usable radii."""
        if radius is None or radius.size != self.hierarchy.vertex_count or radius.dtype.kind not in "fiu":
            return None
        radius = radius.reshape(-1).astype(np.float64)
        if not (np.isfinite(radius).all() and radius.min() >= 0):
            return None
        return np.add.reduceat(radius[self._vertices], self._starts) / self._counts

    def thinned(self, nodes: np.ndarray, most: int) -> Chains:
        """Return chains of some of the nodes, which are given in ascending order. Slices keep at most `most` vertices
        each.

        The node that a kept node hangs on must be kept too. The chains give poses, and no places for a mesh.
        """
        some = copy.copy(self)
        for name in ("_generations", "_beside"):
            some.__dict__.pop(name, None)
        number = np.full(len(self.rest) + 1, -1)
        number[nodes] = np.arange(len(nodes))
        vertices = [self.vertices_of(node) for node in nodes]
        vertices = [each if len(each) <= most else each[_spread_out(self.vertex_rest[each], most)] for each in vertices]
        some._counts = np.array([len(each) for each in vertices])
        some._starts = np.cumsum(some._counts) - some._counts
        some._vertices = np.concatenate(vertices)
        some.vertex_of_nodes = some._vertices[some._starts]
        some.node_branch = self.node_branch[nodes]
        some.before, some.after = number[self.before[nodes]], number[self.after[nodes]]
        some.rest = some._means(self.vertex_rest[None])[0]
        some._make_elements()
        return some

    def vertices_of(self, node: int) -> np.ndarray:
        """Return the vertices of a node, in the source's numbering."""
        return self._vertices[self._starts[node] : self._starts[node] + self._counts[node]]

    # ---- the rest pose as a curve ----

    def at_rest(self, element: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return the points (P, 3) at a share, 0 to 1, of the way along elements of the chains in the rest pose."""
        return self.curve(self.rest[None], self._leaves[None], self._arrives[None], element, share)[0]

    def curve(
        self, centre: np.ndarray, leaves: np.ndarray, arrives: np.ndarray, element: np.ndarray, share: np.ndarray
    ) -> np.ndarray:
        """Return places (k, P, 3) on cubic Hermite curves through nodes (k, M, 3), by the elements' tangents."""
        t = share[:, None]
        low, high = centre[:, self.start[element]], centre[:, self.end[element]]
        rise = t * t * (3 - 2 * t)
        out, into = t * (1 - t) ** 2, t * t * (t - 1)
        return low + rise * (high - low) + out * leaves[:, element] + into * arrives[:, element]

    # ---- motion ----

    def pose(self, frames: np.ndarray) -> Pose:
        """Return the centres, rotations and growth of all nodes in frames (k, V, 3), whose vertices are in the source's
        order.
        """
        frames = np.asarray(frames, np.float64)
        centre = self._means(frames)
        turn = np.zeros((*centre.shape[:2], 4))
        turn[..., 3] = 1.0
        size = np.ones(centre.shape[:2])
        lines = self.is_line[self.node_branch]
        if not lines.all():
            self._fit_surfaces(frames, centre, turn, size)
        if lines.any():
            self._turn_lines(centre, turn)
            size[:, lines] = self._growth(centre)[:, lines]
        return Pose(centre, turn, size)

    def places(self, pose: Pose, element: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the centres (k, P, 3) of P places on the chains in k frames, and the matrices (k, P, 3, 3) that rotate
        and scale what hangs on them. A place is at the fraction `share` of an element.
        """
        start, end = self.start, self.end
        chord = np.linalg.norm(pose.centre[:, end] - pose.centre[:, start], axis=2)
        stretch = (chord / np.where(self.length > 0, self.length, np.inf))[..., None]
        leaves = stretch * rotated(pose.turn[:, start], self._leaves)
        arrives = stretch * rotated(pose.turn[:, end], self._arrives)
        centre = self.curve(pose.centre, leaves, arrives, element, share)
        low, high = pose.turn[:, start[element]], pose.turn[:, end[element]]
        near = np.where((low * high).sum(axis=2, keepdims=True) < 0, -1.0, 1.0)
        matrix = rotation_matrices((1 - share)[:, None] * low + (near * share[:, None]) * high)
        size = (1 - share) * pose.size[:, start[element]] + share * pose.size[:, end[element]]
        return centre, matrix * size[..., None, None]

    def _means(self, frames: np.ndarray) -> np.ndarray:
        return np.add.reduceat(frames[:, self._vertices], self._starts, axis=1) / self._counts[:, None]

    def _tangents(self, centre: np.ndarray) -> np.ndarray:
        """Return unit tangents (k, M, 3) of parabolas through each node and its two neighbours; 0 where these
        coincide.
        """
        before, after = np.maximum(self.before, 0), np.maximum(self.after, 0)
        into = np.where((self.before >= 0)[:, None], centre - centre[:, before], 0.0)
        out = np.where((self.after >= 0)[:, None], centre[:, after] - centre, 0.0)
        least = self._least
        into_length, out_length = (np.linalg.norm(each, axis=2, keepdims=True) for each in (into, out))
        there, goes_on = into_length > least, out_length > least
        into = np.where(there, into / np.maximum(into_length, least), 0.0)
        out = np.where(goes_on, out / np.maximum(out_length, least), 0.0)
        return unit(np.where(goes_on, out_length, 1.0) * into + np.where(there, into_length, 1.0) * out)

    @cached_property
    def _generations(self) -> list[np.ndarray]:
        """Return the nodes of lines in groups by their distance from the root, counted in nodes."""
        depth = np.zeros(len(self.before), np.int64)
        ancestor = np.append(np.where(self.before < 0, len(depth), self.before), len(depth))
        steps = np.append((self.before >= 0).astype(np.int64), 0)
        for _ in range(len(depth).bit_length()):
            steps, ancestor = steps + steps[ancestor], ancestor[ancestor]
        depth = steps[:-1]
        nodes = np.flatnonzero(self.is_line[self.node_branch])
        nodes = nodes[np.argsort(depth[nodes], kind="stable")]
        return np.split(nodes, np.flatnonzero(np.diff(depth[nodes])) + 1)

    def _turn_lines(self, centre: np.ndarray, turn: np.ndarray) -> None:
        """Fill `turn`, quaternions (k, N, 4), for the nodes of lines, from their centres (k, N, 3): each node turns
        with the one below it, and then by the smallest turn that takes its tangent there."""
        tangent = self._tangents(centre)
        for nodes in self._generations:
            before = self.before[nodes]
            inherited = np.where((before >= 0)[:, None], turn[:, np.maximum(before, 0)], [0.0, 0.0, 0.0, 1.0])
            carried = rotated(inherited, self._rest_tangent[nodes])
            turn[:, nodes] = product(smallest_turn(carried, tangent[:, nodes]), inherited)

    def _growth(self, centre: np.ndarray) -> np.ndarray:
        """Return the scale (k, M) of what hangs on nodes of lines: how far the stem around the node is stretched beyond
        what errors of the motion explain.
        """
        count = len(self.rest)
        lines = self.length > 0
        ends = np.concatenate([self.start[lines], self.end[lines]])
        length = np.linalg.norm(centre[:, self.end[lines]] - centre[:, self.start[lines]], axis=2)
        # What hangs on a fork grows with the stem that it is part of, not with a child that begins there.
        weight = (self.node_branch[ends] == np.tile(self.element_branch[lines], 2)).astype(np.float64)
        at_rest = np.bincount(ends, np.tile(self.length[lines], 2) * weight, minlength=count)
        now = np.stack([np.bincount(ends, np.tile(row, 2) * weight, minlength=count) for row in length])
        stretch = np.where(at_rest > 0, now / np.where(at_rest > 0, at_rest, 1.0), 1.0)
        slack = GROWTH + 4 * self.error / np.maximum(at_rest, self._least)
        return stretch / np.clip(stretch, np.maximum(1 - slack, 1e-30), 1 + slack)

    def _fit_surfaces(self, frames: np.ndarray, centre: np.ndarray, turn: np.ndarray, size: np.ndarray) -> None:
        """Fill `turn` (k, N, 4) and `size` (k, N) for nodes of surfaces with the rotations and the growth that fit
        their vertices best in frames (k, V, 3).
        """
        nodes = np.flatnonzero(~self.is_line[self.node_branch])
        branch = self.node_branch
        rest, now = self.vertex_rest[self._vertices], frames[:, self._vertices]
        of = np.repeat(np.arange(len(self.rest)), self._counts)
        rest_off, off = rest - self.rest[of], now - centre[:, of]
        spread = np.add.reduceat((rest_off**2).sum(axis=1), self._starts)
        now_spread = np.add.reduceat((off**2).sum(axis=2), self._starts, axis=1)
        least = self._least**2
        size[:] = np.where(spread > least, np.sqrt(now_spread / np.where(spread > least, spread, 1.0)), 1.0)
        # Moments of one slice about its centre; those of several add up, with those of their centres.
        moment = np.add.reduceat(off[..., :, None] * rest_off[:, None, :], self._starts, axis=1)
        weight = self._counts.astype(np.float64)
        first = np.flatnonzero(np.append(True, np.diff(branch) != 0))
        per_branch = np.diff(np.append(first, len(branch)))
        whole = _joined_moment(moment, weight, centre, self.rest, first, per_branch)
        plant = _best_turn(whole.sum(axis=1, keepdims=True), np.eye(3))
        of_branch = np.repeat(_best_turn(whole, plant), per_branch, axis=1)
        near = [np.where(step >= 0, step, np.arange(len(branch))) for step in self._beside]
        local = sum(
            moment[:, other]
            + weight[other, None, None]
            * (centre[:, other] - centre)[..., :, None]
            * (self.rest[other] - self.rest)[:, None, :]
            for other in (np.arange(len(branch)), *near)
        )
        turn[:, nodes] = quaternions(_best_turn(local, of_branch)[:, nodes])

    @cached_property
    def _beside(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the nodes (N,) before and after each node on its own branch, -1 where the branch begins or ends."""
        before = np.where(self.node_branch[np.maximum(self.before, 0)] == self.node_branch, self.before, -1)
        return before, self.after


def _joined_moment(
    moment: np.ndarray, weight: np.ndarray, centre: np.ndarray, rest: np.ndarray, first: np.ndarray, count: np.ndarray
) -> np.ndarray:
    """Return the moments (k, B, 3, 3) of runs of nodes about their common centres."""
    of = np.repeat(np.arange(len(first)), count)
    total = np.add.reduceat(weight, first)
    middle = np.add.reduceat(centre * weight[:, None], first, axis=1) / total[:, None]
    rest_middle = np.add.reduceat(rest * weight[:, None], first) / total[:, None]
    off, rest_off = centre - middle[:, of], (rest - rest_middle[of]) * weight[:, None]
    return np.add.reduceat(moment + off[..., :, None] * rest_off[:, None, :], first, axis=1)


def _best_turn(moment: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Return the rotations (..., 3, 3) that fit moments best, near `prior` where they leave one free."""
    size = np.linalg.norm(moment, axis=(-2, -1), keepdims=True)
    return nearest_rotations(moment / np.where(size > 0, size, 1.0) + PRIOR * prior)


def _branch_in_file_order(hierarchy: Hierarchy) -> np.ndarray:
    """Return the branch, in file order, of each vertex in the source's order, (N,) int64."""
    branch = np.empty(hierarchy.vertex_count, np.int64)
    branch[hierarchy.vertex_source] = hierarchy.vertex_branch()
    return branch


def _links(view: ClipView) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of vertices (L, 2) that faces and edges join, and whether each vertex is in a face, (N,)
    bool.
    """
    has_faces = np.zeros(view.vertex_count, bool)
    links = [np.empty((0, 2), np.int64)]
    if view.polygons is not None:
        counts, corners = (np.asarray(each, np.int64) for each in view.polygons)
        has_faces[corners] = True
        links.append(sides(counts, corners))
    if view.edges is not None:
        links.append(np.asarray(view.edges, np.int64))
    return np.concatenate(links), has_faces


def _along_surfaces(
    hierarchy: Hierarchy, rest: np.ndarray, links: np.ndarray, surfaces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance (N,) of each vertex from the foot of its branch along the surface, and the length (B,) of the
    longer edges of each branch; both in file order.
    """
    count, first = hierarchy.vertex_count, hierarchy.first_vertex
    branch = hierarchy.vertex_branch()
    place = np.empty(count, np.int64)
    place[hierarchy.vertex_source] = np.arange(count)
    links = place[links]
    links = links[branch[links[:, 0]] == branch[links[:, 1]]]
    length = np.linalg.norm(rest[links[:, 0]] - rest[links[:, 1]], axis=1)
    edge = np.zeros(hierarchy.branch_count)
    order = np.lexsort((length, branch[links[:, 0]]))
    bounds = np.searchsorted(branch[links[order, 0]], np.arange(hierarchy.branch_count + 1))
    has = np.flatnonzero(np.diff(bounds))
    edge[has] = length[order[bounds[has] + 3 * np.diff(bounds)[has] // 4]]
    feet = np.empty(len(surfaces), np.int64)
    straight = np.zeros(count)
    for number, each in enumerate(surfaces.tolist()):
        rows = slice(first[each], first[each] + hierarchy.stem_count[each])
        points, attach = rest[rows], hierarchy.attach[each]
        middle = points.mean(axis=0)
        way = np.linalg.norm(points - (rest[attach] if attach >= 0 else middle), axis=1)
        foot = int(way.argmin() if attach >= 0 else way.argmax())
        feet[number] = first[each] + foot
        straight[rows] = np.linalg.norm(points - points[foot], axis=1)
    # Vertices at one place are joined, or a mesh with hard edges would fall into its faces.
    twins = _twins(rest, branch)
    links, length = np.concatenate([links, twins]), np.append(np.maximum(length, 1e-30), np.full(len(twins), 1e-30))
    graph = scipy_module("sparse").coo_matrix((length, links.T), (count, count)).tocsr()
    way = scipy_module("sparse.csgraph").dijkstra(graph, directed=False, indices=feet, min_only=True)
    return np.where(np.isfinite(way), way, straight), edge


def _twins(rest: np.ndarray, branch: np.ndarray) -> np.ndarray:
    """Return pairs of vertices of one branch that coincide, (L, 2)."""
    order = np.lexsort((*rest.T, branch))
    same = (rest[order[1:]] == rest[order[:-1]]).all(axis=1) & (branch[order[1:]] == branch[order[:-1]])
    return np.stack([order[:-1][same], order[1:][same]], axis=1)


def _slices(points: np.ndarray, along: np.ndarray, edge: float) -> np.ndarray:
    """Return the slice of each vertex of a surface, from its foot to its tip, (n,) int64 from 0 without gaps."""
    off = points - points.mean(axis=0)
    spread = np.linalg.eigvalsh(off.T @ off / len(points))
    width = max(float(np.sqrt(max(spread[1], 0.0))), 1.02 * edge, float(along.max()) / max(len(points) // 2, 1))
    if not width > 0:
        return np.zeros(len(points), np.int64)
    return np.unique((along / width).astype(np.int64), return_inverse=True)[1].reshape(-1)


def _spread_out(points: np.ndarray, count: int) -> np.ndarray:
    """Return the numbers of so many points, each as far as possible from those before it."""
    chosen = [int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())]
    distance = np.full(len(points), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(distance.argmax()))
    return np.array(chosen)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) at length 1, or 0 where they have none."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), 0.0)


def smallest_turn(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the quaternions (..., 4) of the smallest rotations from unit vectors `start` to unit vectors `end`; no
    rotation where a vector is 0.
    """
    cosine = (start * end).sum(axis=-1, keepdims=True)
    there = (start**2).sum(axis=-1, keepdims=True) * (end**2).sum(axis=-1, keepdims=True) > 0.5
    axis, real = np.cross(start, end), 1.0 + cosine
    helper = np.where(np.abs(start[..., :1]) < 0.6, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    opposite = real < 1e-9
    axis = np.where(opposite, np.cross(start, helper), axis)
    turn = np.concatenate([axis, np.where(opposite, 0.0, real)], axis=-1)
    turn = np.where(there, turn, [0.0, 0.0, 0.0, 1.0])
    return turn / np.linalg.norm(turn, axis=-1, keepdims=True)


def product(second: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return the rotation that does `first` and then `second`, quaternions (..., 4) x y z w."""
    a, b = second[..., :3], first[..., :3]
    u, v = second[..., 3:], first[..., 3:]
    return np.concatenate([u * b + v * a + np.cross(a, b), u * v - (a * b).sum(axis=-1, keepdims=True)], axis=-1)


def rotated(turn: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) turned by unit quaternions (..., 4) x y z w."""
    axis, real = turn[..., :3], turn[..., 3:]
    vectors = np.broadcast_to(vectors, axis.shape)
    twice = 2 * np.cross(axis, vectors)
    return vectors + real * twice + np.cross(axis, twice)
