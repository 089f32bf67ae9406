"""Cells of finite-element meshes as what a clip has: faces, edges, and the volume cells as attributes.

Triangles, quads and polygons are faces, those of second order by their corners; lines are edges, with their middle
nodes between them. Volume cells keep their vertices, and give the faces that only one of them has: the outside. They
are kept as attributes cells_TYPE (n, k), domain "constant". Types are called as in meshio, corners are ordered as in
VTK.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from athcodec.errors import ClipError
from athcodec.sources.mesh import with_polygons

VTK_NAMES = {
    1: "vertex",
    2: "poly_vertex",
    3: "line",
    4: "poly_line",
    5: "triangle",
    6: "triangle_strip",
    7: "polygon",
    8: "pixel",
    9: "quad",
    10: "tetra",
    11: "voxel",
    12: "hexahedron",
    13: "wedge",
    14: "pyramid",
    21: "line3",
    22: "triangle6",
    23: "quad8",
    24: "tetra10",
    25: "hexahedron20",
    26: "wedge15",
    27: "pyramid13",
    28: "quad9",
    29: "hexahedron27",
    30: "quad6",
    32: "wedge18",
    34: "triangle7",
}
VTK_NUMBERS = {name: number for number, name in VTK_NAMES.items()}
NODES = {
    "vertex": 1,
    "line": 2,
    "line3": 3,
    "triangle": 3,
    "triangle6": 6,
    "triangle7": 7,
    "pixel": 4,
    "quad": 4,
    "quad6": 6,
    "quad8": 8,
    "quad9": 9,
    "tetra": 4,
    "tetra10": 10,
    "voxel": 8,
    "hexahedron": 8,
    "hexahedron20": 20,
    "hexahedron24": 24,
    "hexahedron27": 27,
    "wedge": 6,
    "wedge15": 15,
    "wedge18": 18,
    "pyramid": 5,
    "pyramid13": 13,
}
NODE_BYTES = 160  # Bytes that a vertex of a cell takes while its faces and edges are made.
_CORNERS = {"triangle": [0, 1, 2], "quad": [0, 1, 2, 3], "pixel": [0, 1, 3, 2]}
_SIDES = {
    "tetra": [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]],
    "hexahedron": [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]],
    "voxel": [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]],
    "wedge": [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]],
    "pyramid": [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
}


@dataclass(frozen=True)
class Part:
    """A run of the points of a mesh: an object, or "" for one without a name."""

    name: str
    point_count: int


@dataclass
class Block:
    """Cells of one type: nodes (n, k), and for polygons, polylines and strips counts (n,) with nodes (sum,) behind one
    another; rows: which of the file's cells they are."""

    kind: str
    nodes: np.ndarray
    rows: np.ndarray
    counts: np.ndarray | None = None


@dataclass
class Topology:
    """faces, edges and attributes as in MotionClip, with their domains; for data per cell, the cells that edges, faces
    and volumes are, in that order of dimensions."""

    faces: np.ndarray | None = None
    edges: np.ndarray | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)
    domains: dict[str, str] = field(default_factory=dict)
    edge_rows: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    face_rows: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    cell_rows: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    faces_are_cells: bool = True

    def add_cell_data(self, name: str, values: np.ndarray) -> bool:
        """Add an array with a row of `values` for each cell of the file as attributes of the edges, faces and volumes
        that these cells became. If only one of the three exists, the attribute is called `name`; otherwise the name
        gets "edge_", "face_" or "cell_" in front.

        Returns whether every row was kept. Rows of cells that became none of the three are lost, and so is an attribute
        whose name is taken.
        """
        kinds = [("edge", self.edge_rows), ("face", self.face_rows), ("cell", self.cell_rows)]
        kinds = [(domain, rows) for domain, rows in kinds if len(rows)]
        is_kept = len(np.unique(np.concatenate([np.zeros(0, np.int64), *(rows for _, rows in kinds)]))) == len(values)
        for domain, rows in kinds:
            key = name if len(kinds) == 1 and name not in self.attributes else f"{domain}_{name}"
            if key in self.attributes:
                is_kept = False
            else:
                self.attributes[key] = values[rows]
                self.domains[key] = domain if domain != "face" or self.faces_are_cells else "constant"
        return is_kept


def base_kind(kind: str) -> str:
    """Return the kind of cell without the number of its nodes: "triangle6" gives "triangle", which has the same
    corners."""
    return kind.rstrip("0123456789")


def blocks_of(
    types: np.ndarray, starts: np.ndarray, stops: np.ndarray, nodes: np.ndarray, names: dict[int, str]
) -> list[Block]:
    """Return cells grouped by type, one Block for each type. Cell i has the VTK-like number types[i] and the nodes from
    starts[i] to stops[i] - 1 of `nodes`; `names` gives the name of each number that is allowed. Raises ClipError for
    another number, or for a cell with a wrong number of nodes."""
    blocks = []
    for number in np.unique(types):
        name = names.get(int(number))
        if name is None:
            known = ", ".join(sorted(set(names.values())))
            raise ClipError(f"cells: got the type {number}, expected one of {known}; save the mesh with these alone")
        rows = np.flatnonzero(types == number)
        counts = (stops - starts)[rows]
        if name in NODES:
            if (counts != NODES[name]).any():
                raise ClipError(f"cells: got a {name} of {counts.min()} nodes, expected {NODES[name]}")
            blocks.append(Block(name, nodes[starts[rows][:, None] + np.arange(NODES[name])], rows))
        else:
            inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
            blocks.append(Block(name, nodes[np.repeat(starts[rows], counts) + inside], rows, counts))
    return blocks


def topology_of(blocks: Sequence[Block], vertex_count: int) -> Topology:
    """Return the edges, faces and volumes that cells make up over `vertex_count` vertices. Raises ClipError if a cell
    has a vertex that does not exist."""
    for block in blocks:
        if block.nodes.size and not 0 <= block.nodes.min() <= block.nodes.max() < vertex_count:
            raise ClipError(
                f"cells: got a {block.kind} with vertices {block.nodes.min()} to {block.nodes.max()}, "
                f"expected 0 to {vertex_count - 1}"
            )
    topology = Topology()
    _add_edges(topology, blocks)
    _add_faces(topology, blocks)
    return topology


def _add_edges(topology: Topology, blocks: Sequence[Block]) -> None:
    """Store the segments of all line and polyline cells in `topology` as edges (E, 2), and for each edge the row of its
    cell in the file. Edges are in the order of these rows."""
    pairs: list[np.ndarray] = []
    rows: list[np.ndarray] = []
    for block in blocks:
        if block.kind == "line":
            pairs.append(block.nodes)
            rows.append(block.rows)
        elif block.kind == "line3":
            pairs.append(block.nodes[:, [0, 2, 2, 1]].reshape(-1, 2))
            rows.append(np.repeat(block.rows, 2))
        elif block.kind == "poly_line":
            assert block.counts is not None  # Cells of these kinds differ in size.
            ends = np.cumsum(block.counts)
            pairs.append(np.delete(np.stack([block.nodes[:-1], block.nodes[1:]], axis=1), ends[:-1] - 1, axis=0))
            rows.append(np.repeat(block.rows, np.maximum(block.counts - 1, 0)))
    if pairs:
        cells = np.concatenate(rows)
        order = np.argsort(cells, kind="stable")
        topology.edges, topology.edge_rows = np.concatenate(pairs)[order].astype(np.int32), cells[order]


def _add_faces(topology: Topology, blocks: Sequence[Block]) -> None:
    """Store the polygon cells of `blocks` in `topology` as faces, followed by the outer sides of solid cells."""
    sizes_of_blocks: list[np.ndarray] = []
    corners_of_blocks: list[np.ndarray] = []
    rows: list[np.ndarray] = []
    for block in blocks:
        kind = base_kind(block.kind)
        if kind in _CORNERS:
            chosen = block.nodes[:, _CORNERS[kind]]
            sizes_of_blocks.append(np.full(len(chosen), chosen.shape[1]))
            corners_of_blocks.append(chosen.reshape(-1))
            rows.append(block.rows)
        elif kind == "polygon":
            assert block.counts is not None  # Cells of these kinds differ in size.
            sizes_of_blocks.append(block.counts)
            corners_of_blocks.append(block.nodes)
            rows.append(block.rows)
        elif kind == "triangle_strip":
            assert block.counts is not None  # Cells of these kinds differ in size.
            sizes = np.maximum(block.counts - 2, 0)
            places = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
            turned = places % 2  # Every second triangle of a strip has its corners the other way round.
            starts = places + np.repeat(np.cumsum(block.counts) - block.counts, sizes)
            sizes_of_blocks.append(np.full(len(starts), 3))
            corners_of_blocks.append(
                block.nodes[np.stack([starts, starts + 1 + turned, starts + 2 - turned], axis=1).reshape(-1)]
            )
            rows.append(np.repeat(block.rows, sizes))
    counts, corners = np.zeros(0, np.int64), np.zeros(0, np.int64)
    if rows:
        cells, counts = np.concatenate(rows), np.concatenate(sizes_of_blocks)
        order = np.argsort(cells, kind="stable")
        corners = _in_order(counts, np.concatenate(corners_of_blocks), order)
        counts, topology.face_rows = counts[order], cells[order]
    volumes = [block for block in blocks if base_kind(block.kind) in _SIDES]
    if volumes:
        _keep_volumes(topology, volumes)
        outside = _outside(volumes, counts, corners)
        topology.faces_are_cells = not len(outside[0])
        counts, corners = np.append(counts, outside[0]), np.append(corners, outside[1])
    if len(counts):
        topology.faces, polygons = with_polygons(counts, corners)
        topology.attributes |= polygons
        topology.domains |= {
            name: domain
            for name, domain in (("face_vertex_counts", "face"), ("face_vertex_indices", "corner"))
            if name in polygons
        }


def _in_order(counts: np.ndarray, corners: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Return the corners (C,) of polygons of `counts` corners each, with the polygons in another order."""
    starts, wanted = np.cumsum(counts) - counts, counts[order]
    inside = np.arange(wanted.sum()) - np.repeat(np.cumsum(wanted) - wanted, wanted)
    return corners[np.repeat(starts[order], wanted) + inside]


def _keep_volumes(topology: Topology, volumes: Sequence[Block]) -> None:
    topology.cell_rows = np.concatenate([block.rows for block in volumes])
    for block in volumes:
        name = f"cells_{block.kind}"
        topology.attributes[name] = block.nodes.astype(np.int32)
        topology.domains[name] = "constant"


def _outside(volumes: Sequence[Block], counts: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sides of solid cells that are on the outside: sides that belong to one cell only and are not yet a
    face. `counts` and `corners` are the faces so far: the size of each face, and their corners one after the other. The
    result has the same form, triangles before quads."""
    found_counts, found_corners = [], []
    for size in (3, 4):
        sides_of_blocks = [
            block.nodes[:, side] for block in volumes for side in _SIDES[base_kind(block.kind)] if len(side) == size
        ]
        if not sides_of_blocks:
            continue
        sides = np.concatenate(sides_of_blocks)
        faces = _faces_of_size(counts, corners, size)
        keys = np.sort(np.concatenate([sides, faces]), axis=1)
        _, number, often = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
        alone = sides[often[number.reshape(-1)[: len(sides)]] == 1]
        found_counts.append(np.full(len(alone), size))
        found_corners.append(alone.reshape(-1))
    none = np.zeros(0, np.int64)
    return np.concatenate([none, *found_counts]), np.concatenate([none, *found_corners])


def _faces_of_size(counts: np.ndarray, corners: np.ndarray, size: int) -> np.ndarray:
    starts = (np.cumsum(counts) - counts)[counts == size]
    return corners[starts[:, None] + np.arange(size)] if len(starts) else np.zeros((0, size), np.int64)
