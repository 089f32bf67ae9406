"""A scan of a simulated plant: one skin of irregular triangles around its stems, which share no vertices, with noise.

The skin is where the distance from the tapered stems is 0, cut from the tetrahedra of a grid whose points are moved at
random. Its own motion knows nothing of how athcodec binds a mesh: vertices ride on triangles of the plant's tubes, and
around forks, where neighbours ride on different tubes, the skin is stretched between them as a membrane is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from athcodec import MotionClip
from bench.trees.mesh import Tubes
from bench.trees.ride import Skeleton

SIDES = 24  # Of the tubes that carry the scan.
SHIFT = 0.3  # Largest shift of a point of the grid, in cells.
CUT = 0.15  # Least distance of a vertex from either end of the edge that it cuts, over the edge, so that none is tiny.
REACH = 2.0  # How far around a fork the skin is a membrane, in radii of the stem.
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
TETRAHEDRA = np.array(
    [np.cumsum([[0, 0, 0], *np.eye(3, dtype=int)[list(order)]], axis=0) @ [4, 2, 1] for order in permutations(range(3))]
)  # Corners of the six that a cell is divided into, (6, 4).


@dataclass(frozen=True)
class Scan:
    """points (P, 3) of a skin at rest, and its triangles (F, 3)."""

    points: np.ndarray
    triangles: np.ndarray

    @property
    def soup(self) -> np.ndarray:
        """The point of each vertex where triangles share none, (3 F,)."""
        return self.triangles.reshape(-1)


def thickened(skeleton: MotionClip, factor: float) -> MotionClip:
    """Return the skeleton with stems so many times as thick."""
    return skeleton.replace(attributes=skeleton.attributes | {"radius": factor * skeleton.attributes["radius"]})


def scanned(clip: MotionClip, cell: float, noise: float, seed: int) -> MotionClip:
    """Return a simulated clip as a scanner would see it, with the clip's motion: one irregular mesh around all stems.
    `cell` is the size of its triangles and `noise` the standard deviation of its points, both in metres.
    """
    random, skeleton = np.random.default_rng(seed), Skeleton.of(clip, clip.frame_count)
    scan = _skin(skeleton, cell, random)
    tubes = Tubes(skeleton, SIDES)
    at_rest = tubes.at(skeleton.rest)
    ride = _Ride(at_rest, tubes.faces, scan.points)
    membrane = _Membrane(scan, tubes.branch[ride.vertex], skeleton)
    rest = scan.points + noise * random.normal(size=scan.points.shape)
    ride.hold(at_rest, rest)
    positions = np.stack([rest + membrane.of(ride.at(tubes.at(nodes)) - rest) for nodes in skeleton.positions])
    return MotionClip(
        positions[:, scan.soup].astype(np.float32),
        clip.time,
        rest=rest[scan.soup].astype(np.float32),
        faces=np.arange(scan.triangles.size, dtype=np.int32).reshape(-1, 3),
        vertex_branch=tubes.branch[ride.vertex][scan.soup],
        branch_parent=skeleton.branch_parent,
        metadata=dict(clip.metadata),
    )


def _distance(points: np.ndarray, skeleton: Skeleton) -> np.ndarray:
    """Return the distance of points (n, 3) from the bark of the nearest stem; it is negative inside."""
    child = np.flatnonzero(skeleton.parent >= 0)
    start, radius = skeleton.parent[child], skeleton.radius.astype(np.float64)
    distance = np.full(len(points), np.inf)
    for a, b in zip(start.tolist(), child.tolist()):
        low, chord = skeleton.rest[a], skeleton.rest[b] - skeleton.rest[a]
        # A side stem is as thick at its foot as at its first node.
        thick = radius[a] if skeleton.branch[a] == skeleton.branch[b] else radius[b]
        share = np.clip((points - low) @ chord / (chord @ chord), 0.0, 1.0)
        away = np.linalg.norm(points - low - share[:, None] * chord, axis=1)
        distance = np.minimum(distance, away - (thick + share * (radius[b] - thick)))
    return distance


def _skin(skeleton: Skeleton, cell: float, random: np.random.Generator) -> Scan:
    """Return the irregular mesh around a skeleton at rest, from a grid of cells `cell` metres wide."""
    child = np.flatnonzero(skeleton.parent >= 0)
    start, most = skeleton.parent[child], float(skeleton.radius.max()) + 2 * cell
    boxes = []
    for a, b in zip(skeleton.rest[start], skeleton.rest[child]):
        low = np.floor((np.minimum(a, b) - most) / cell).astype(int)
        high = np.ceil((np.maximum(a, b) + most) / cell).astype(int)
        box = np.stack(np.meshgrid(*map(np.arange, low, high + 1), indexing="ij"), -1).reshape(-1, 3)
        way, along = cell * box + 0.5 * cell - a, b - a
        share = np.clip(way @ along / (along @ along), 0.0, 1.0)
        boxes.append(box[np.linalg.norm(way - share[:, None] * along, axis=1) < most])
    cells = np.unique(np.concatenate(boxes), axis=0)
    nodes, of_cell = np.unique((cells[:, None] + CORNERS).reshape(-1, 3), axis=0, return_inverse=True)
    places = cell * (nodes + random.uniform(-SHIFT, SHIFT, nodes.shape))
    inside = (value := _distance(places, skeleton)) < 0
    tets = of_cell.reshape(-1, 8)[:, TETRAHEDRA].reshape(-1, 4)
    number = inside[tets].sum(axis=1)
    sides = []  # Pairs (inside, outside) of grid points that the corners of each triangle lie between.
    for count in (1, 2, 3):
        some = tets[number == count]
        a, b, c, d = np.take_along_axis(some, np.argsort(~inside[some], axis=1, kind="stable"), 1).T
        if count == 1:
            sides.append([(a, b), (a, c), (a, d)])
        elif count == 3:
            sides.append([(a, d), (b, d), (c, d)])
        else:
            sides += [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]]
    edges = np.concatenate([np.stack([np.stack(pair, 1) for pair in each], 1) for each in sides])
    pairs, corner = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    low, high = value[pairs].T
    share = np.clip(low / (low - high), CUT, 1 - CUT)[:, None]
    points = places[pairs[:, 0]] * (1 - share) + places[pairs[:, 1]] * share
    triangles = corner.reshape(-1, 3)
    across = np.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))
    outward = (points[triangles] - places[edges[:, :, 0]]).sum(axis=1)
    turned = (across * outward).sum(axis=1) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return Scan(points, triangles)


class _Ride:
    """Points that keep their places on triangles, and offsets in the frames of these. `vertex` (P,) is one of the
    carrier's vertices at each."""

    def __init__(self, carrier: np.ndarray, quads: np.ndarray, points: np.ndarray):
        """Attach each point to the nearest of the triangles that quadrilaterals `quads` of the vertices `carrier` (V,
        3) make, so that it can follow them.
        """
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        near = cKDTree(carrier[triangles].mean(axis=1)).query(points, k=24)[1]
        shares, away = _nearest_on(carrier[triangles[near]], points[:, None])
        best = np.arange(len(points)), away.argmin(axis=1)
        self._triangle, self._shares = triangles[near[best]], shares[best]
        self.vertex = self._triangle[:, 0]
        self._off = np.zeros(points.shape)

    def hold(self, carrier: np.ndarray, points: np.ndarray) -> None:
        """Store where the points (P, 3) are relative to the carrier in this pose (N, 3)."""
        foot, frame = self._frames(carrier)
        self._off = np.einsum("pji,pj->pi", frame, points - foot)

    def at(self, carrier: np.ndarray) -> np.ndarray:
        foot, frame = self._frames(carrier)
        return foot + np.einsum("pij,pj->pi", frame, self._off)

    def _frames(self, carrier: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (P, 3) of the places that P points are attached to on moved vertices, and the axes (P,
        3, 3) of the triangles there.
        """
        corners = carrier[self._triangle].astype(np.float64)
        along, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        normal = np.cross(along, other)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return (self._shares[..., None] * corners).sum(axis=1), np.stack(
            [along, normal, np.cross(along, normal)], axis=2
        )


class _Membrane:
    """Displacements of points around forks as those of a membrane between the points that ride on one stem."""

    def __init__(self, scan: Scan, branch: np.ndarray, skeleton: Skeleton):
        """Prepare to smooth motion across the joints of a scan's stems. `branch` is the stem of each point; points near
        a joint are free, and all others hold them.
        """
        ends = np.concatenate([scan.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
        seeds = np.unique(ends[branch[ends[:, 0]] != branch[ends[:, 1]]])
        radius = skeleton.radius[cKDTree(skeleton.rest).query(scan.points[seeds])[1]]
        near, seed = cKDTree(scan.points[seeds]).query(scan.points)
        free = near < REACH * radius[seed]
        self._free, self._held, count = np.flatnonzero(free), np.flatnonzero(~free), len(free)
        weight = 1.0 / np.linalg.norm(scan.points[ends[:, 0]] - scan.points[ends[:, 1]], axis=1)
        links = sparse.coo_matrix((weight, ends.T), (count, count)).tocsr()
        links = links + links.T
        rows = (sparse.diags(np.asarray(links.sum(axis=1)).reshape(-1)) - links).tocsr()[self._free]
        self._solved = splu(rows[:, self._free].tocsc() + 1e-9 * sparse.identity(len(self._free), format="csc"))
        self._across = rows[:, self._held]

    def of(self, displacement: np.ndarray) -> np.ndarray:
        moved = displacement.copy()
        moved[self._free] = self._solved.solve(-(self._across @ displacement[self._held]))
        return moved


def _nearest_on(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return barycentric weights (..., 3) of the places on triangles (..., 3, 3) that are nearest to points (..., 3),
    and their distances from the points. Places beyond an edge are approximate.
    """
    a, u, v = corners[..., 0, :], corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    w = points - a
    uu, uv, vv = ((x * y).sum(axis=-1) for x, y in ((u, u), (u, v), (v, v)))
    wu, wv = (w * u).sum(axis=-1), (w * v).sum(axis=-1)
    scale = 1.0 / np.maximum(uu * vv - uv * uv, 1e-30)
    second, third = (vv * wu - uv * wv) * scale, (uu * wv - uv * wu) * scale
    shares = np.clip(np.stack([1 - second - third, second, third], -1), 0.0, None)
    shares /= shares.sum(axis=-1, keepdims=True)
    return shares, np.linalg.norm((shares[..., None] * corners).sum(axis=-2) - points, axis=-1)
