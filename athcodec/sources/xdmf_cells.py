"""Reads the cells of an XDMF Topology."""

from __future__ import annotations

import math

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.reading import Budget
from athcodec.sources.cells import NODE_BYTES, NODES, Block, blocks_of
from athcodec.sources.xdmf_document import Element

MIXED = {
    1: "poly_vertex",
    2: "poly_line",
    3: "polygon",
    4: "triangle",
    5: "quad",
    6: "tetra",
    7: "pyramid",
    8: "wedge",
    9: "hexahedron",
    34: "line3",
    35: "quad9",
    36: "triangle6",
    37: "quad8",
    38: "tetra10",
    39: "pyramid13",
    40: "wedge15",
    41: "wedge18",
    48: "hexahedron20",
    49: "hexahedron24",
    50: "hexahedron27",
}


COUNTED = (1, 2, 3)


TOPOLOGIES = {
    "triangle": "triangle",
    "quadrilateral": "quad",
    "tetrahedron": "tetra",
    "hexahedron": "hexahedron",
    "wedge": "wedge",
    "pyramid": "pyramid",
    "edge_3": "line3",
    "triangle_6": "triangle6",
    "tri_6": "triangle6",
    "quadrilateral_8": "quad8",
    "quad_8": "quad8",
    "quadrilateral_9": "quad9",
    "quad_9": "quad9",
    "tetrahedron_10": "tetra10",
    "tet_10": "tetra10",
    "pyramid_13": "pyramid13",
    "wedge_15": "wedge15",
    "wedge_18": "wedge18",
    "hexahedron_20": "hexahedron20",
    "hex_20": "hexahedron20",
    "hexahedron_24": "hexahedron24",
    "hex_24": "hexahedron24",
    "hexahedron_27": "hexahedron27",
    "hex_27": "hexahedron27",
    "line": "line",
}


PLAIN = {"polyvertex": "poly_vertex", "polyline": "poly_line", "polygon": "polygon"}


RECTILINEAR = ("2drectmesh", "3drectmesh", "2dcorectmesh", "3dcorectmesh")


WITHOUT_POINTS = "save grids without points of their own as unstructured ones"


STRUCTURED = {"2dsmesh": "quad", "3dsmesh": "hexahedron"}


def same_block(one: Block, other: Block) -> bool:
    return one.kind == other.kind and np.array_equal(one.nodes, other.nodes) and np.array_equal(one.rows, other.rows)


def structured_blocks(kind: str, element: Element, budget: Budget) -> list[Block]:
    """Return the cells between the points of a curvilinear grid. `kind` is "quad" for grids of two dimensions, or the
    name of a cell of eight nodes for three. `element` states the number of points along each, the last changing
    fastest."""
    shape = [int(size) for size in (element.get("Dimensions") or element.get("NumberOfElements") or "").split()]
    if len(shape) != (2 if kind == "quad" else 3) or min(shape) < 1:
        raise ClipError(f"Topology: got the dimensions {shape}, expected {2 if kind == 'quad' else 3} of points")
    budget.need(NODE_BYTES * len(shape) ** 2 * math.prod(shape), f"Topology: a grid of {shape} points")
    numbers = np.arange(int(np.prod(shape))).reshape(shape)
    sides = [(slice(None, -1), slice(1, None))] * len(shape)
    around = [(0, 0), (0, 1), (1, 1), (1, 0)]  # Of the last two dimensions, counter-clockwise.
    places = around if kind == "quad" else [(layer, *each) for layer in (0, 1) for each in around]
    cells = [numbers[tuple(side[place] for side, place in zip(sides, each))].reshape(-1) for each in places]
    return [Block(kind, np.stack(cells, axis=1), np.arange(len(cells[0])))]


def whole_numbers(values: np.ndarray) -> np.ndarray:
    if not np.array_equal(values, np.floor(values)):
        raise ClipError("Topology: got numbers with fractions, expected vertices")
    return values


def mixed_blocks(stream: np.ndarray) -> list[Block]:
    """Return the cells in a stream of integers, grouped by type. Each cell is its type number, its number of nodes if
    the type leaves it open, and its nodes. Raises ClipError."""
    types, starts, stops, at = [], [], [], 0
    numbers = stream.tolist()
    while at < len(numbers):
        kind = numbers[at]
        if kind not in MIXED:
            raise ClipError(f"Topology: got the cell type {kind}, expected one of {', '.join(map(str, MIXED))}")
        counted = kind in COUNTED
        size = numbers[at + 1] if counted and at + 1 < len(numbers) else NODES.get(MIXED[kind], -1)
        at += 2 if counted else 1
        if size < 0 or at + size > len(numbers):
            raise ClipError("Topology: got the end of the data, expected the nodes of a cell")
        types.append(kind)
        starts.append(at)
        at += size
        stops.append(at)
    return blocks_of(np.array(types), np.array(starts, np.int64), np.array(stops, np.int64), stream, MIXED)
