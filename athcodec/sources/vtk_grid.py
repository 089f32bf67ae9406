"""A VTK data set as arrays: what one file of a result holds. It opens no files and knows none of VTK's file formats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from athcodec.errors import ClipError
from athcodec.sources.cells import VTK_NAMES, Part, Topology, blocks_of, topology_of
from athcodec.untyped import JsonObject

# Cells of PolyData in the order of their data: VTK's numbers of those with so many nodes, and of the others.
POLY_CELLS: dict[str, tuple[dict[int, int], int]] = {
    "Verts": ({1: 1}, 2),
    "Lines": ({2: 3}, 4),
    "Polys": ({3: 5, 4: 9}, 7),
    "Strips": ({}, 6),
}
TIME_NAMES = ("timevalue", "time_value", "time")  # In lower case; the first one that a file has counts.
STEP_NAMES = ("timestep", "time_step", "cycle", "step", "iteration", "frame")  # They may count steps.
GHOSTS = {  # Bits that keep VTK from showing a cell: cells that another piece has, too, refined and hidden ones.
    "vtkGhostType": 1 | 8 | 32,
    "vtkGhostLevels": 255,
}


@dataclass(eq=False)
class Grid:
    """A data set.

    points                 (N, 2) or (N, 3)
    types                  (C,) VTK's numbers of the cells
    starts, stops          (C,) where the nodes of each cell begin and end in `nodes`
    point_data, cell_data  name: an array with a row per point or cell
    field_data             name: the values of a field that may be a time
    left_out               names of arrays that are not read, or do not fit
    other                  words for what else is not read
    metadata               what our writer adds
    parts                  the objects, as runs of points
    hidden_count           how many cells were left out because VTK does not show them
    title                  the title of a legacy file
    """

    points: np.ndarray
    types: np.ndarray
    starts: np.ndarray
    stops: np.ndarray
    nodes: np.ndarray
    point_data: dict[str, np.ndarray] = field(default_factory=dict)
    cell_data: dict[str, np.ndarray] = field(default_factory=dict)
    field_data: dict[str, np.ndarray] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    other: list[str] = field(default_factory=list)
    metadata: JsonObject = field(default_factory=dict)
    parts: tuple[Part, ...] = ()
    hidden_count: int = 0
    title: str = ""

    def __post_init__(self) -> None:
        """Check that the cells' arrays fit each other, leave out data whose rows do not fit points or cells, and remove
        hidden cells. Raises ClipError."""
        if (
            len(self.types) != len(self.stops)
            or (self.starts > self.stops).any()
            or (len(self.stops) and self.stops.max() > len(self.nodes))
            or (len(self.starts) and self.starts.min() < 0)
        ):
            raise ClipError("cells: got offsets that do not fit types and nodes")
        self.parts = self.parts or (Part("", len(self.points)),)
        for data, count in ((self.point_data, len(self.points)), (self.cell_data, len(self.types))):
            unfit = [name for name, values in data.items() if len(values) != count or not name]
            self.left_out += unfit
            for name in unfit:
                del data[name]
        self._hide()

    def _hide(self) -> None:
        """Remove the cells that a ghost array of VTK marks as hidden, and add their number to `hidden_count`."""
        shown = np.ones(len(self.types), bool)
        for name, bits in GHOSTS.items():
            values = self.cell_data.get(name)
            if values is not None and values.ndim == 1 and values.dtype.kind in "iu":
                shown &= (values & bits) == 0
        if shown.all():
            return
        self.hidden_count += int((~shown).sum())
        self.types, self.starts, self.stops = self.types[shown], self.starts[shown], self.stops[shown]
        self.cell_data = {name: values[shown] for name, values in self.cell_data.items()}

    @property
    def cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The arrays that describe the cells; they have to be equal in all steps."""
        return self.types, self.starts, self.stops, self.nodes

    def topology(self) -> Topology:
        """Raise ClipError for cells of a type that is not read, or with nodes that are no points."""
        return topology_of(blocks_of(*self.cells, VTK_NAMES), len(self.points))

    def time(self) -> tuple[str, float | np.float32] | None:
        """Return (name, value) of the field that states the time of the data set; a field that counts steps
        (STEP_NAMES) is used only if no other states a time. Return None if there is none."""
        known = {name.lower(): name for name in reversed(self.field_data)}
        for name in (*TIME_NAMES, *STEP_NAMES):
            values = self.field_data.get(known.get(name, ""))
            if values is not None and values.size == 1 and np.isfinite(values).all():
                return known[name], values.reshape(-1)[0] if values.dtype == np.float32 else float(
                    values.reshape(-1)[0]
                )
        return None


def starts_of(stops: np.ndarray) -> np.ndarray:
    """Return the start of each cell's nodes (C,), given where they stop, for cells whose nodes follow one another."""
    return np.concatenate([[0], stops[:-1]]).astype(np.int64) if len(stops) else stops


def poly_cells(cells: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (types, stops, nodes) of the cells of VTK's PolyData: the VTK type of each cell, where its nodes end in
    `nodes`, and the nodes of all cells one after the other. `cells` has (stops, nodes) for each list of cells, by the
    list's name in POLY_CELLS."""
    none = np.zeros(0, np.int64)
    types, stops, nodes = [none], [none], [none]
    for kind, (numbers, other) in POLY_CELLS.items():
        ends, corners = cells.get(kind, (none, none))
        types.append(np.array([numbers.get(size, other) for size in np.diff(ends, prepend=0).tolist()], np.int64))
        stops.append(ends + sum(map(len, nodes)))
        nodes.append(corners)
    return np.concatenate(types), np.concatenate(stops), np.concatenate(nodes)


def lattice_cells(size: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (types, stops, nodes) of the cells between the points of a regular grid with `size` points along x, y and
    z: the VTK type of each cell, where its nodes end in `nodes`, and the nodes of all cells. Cells are hexahedra, quads
    or lines, by how many axes have more than one point."""
    strides = np.cumprod([1, *size])[:3]
    along = [axis for axis in range(3) if size[axis] > 1]
    first = np.zeros(1, np.int64)
    for axis in along:
        first = (np.arange(size[axis] - 1)[:, None] * strides[axis] + first).reshape(-1)
    corners = [0]
    for axis in along:  # In the order of VTK: around each side, and the far side behind the near one.
        far = [corner + int(strides[axis]) for corner in corners]
        corners += far[::-1] if len(corners) == 2 else far
    kind = {0: 1, 1: 3, 2: 9, 3: 12}[len(along)]
    nodes = (first[:, None] + np.array(corners)).reshape(-1)
    return np.full(len(first), kind), np.arange(1, len(first) + 1) * len(corners), nodes


def joined(grids: Sequence[Grid], names: Sequence[str]) -> Grid:
    """Return several data sets joined into one, one after the other. The points of each become the object with its name
    in `names`; neighbours with the same name become one object. Arrays that some data sets lack are noted as left
    out."""
    filled = [(grid, name) for grid, name in zip(grids, names, strict=True) if len(grid.points)] or [(grids[0], "")]
    grids, names = [grid for grid, _ in filled], [name for _, name in filled]
    if len(grids) == 1 and not any(names):
        return grids[0]
    first_points = np.cumsum([0, *(len(grid.points) for grid in grids)])
    first_nodes = np.cumsum([0, *(len(grid.nodes) for grid in grids)])
    width = max(grid.points.shape[-1] for grid in grids)
    points = [np.pad(grid.points, ((0, 0), (0, width - grid.points.shape[-1]))) for grid in grids]
    left_out = [name for grid in grids for name in grid.left_out]
    point_data = _common([grid.point_data for grid in grids], left_out)
    cell_data = _common([grid.cell_data for grid in grids if len(grid.types)], left_out)
    parts: list[Part] = []
    for grid, name in zip(grids, names):
        for part in grid.parts:
            part = Part(name or part.name, part.point_count)
            if parts and parts[-1].name == part.name:
                parts[-1] = Part(part.name, parts[-1].point_count + part.point_count)
            else:
                parts.append(part)
    return Grid(
        np.concatenate(points),
        np.concatenate([grid.types for grid in grids]),
        np.concatenate([grid.starts + first for grid, first in zip(grids, first_nodes)]),
        np.concatenate([grid.stops + first for grid, first in zip(grids, first_nodes)]),
        np.concatenate([grid.nodes + first for grid, first in zip(grids, first_points)]),
        point_data,
        cell_data,
        {name: values for grid in reversed(grids) for name, values in grid.field_data.items()},
        list(dict.fromkeys(left_out)),
        list(dict.fromkeys(word for grid in grids for word in grid.other)),
        {name: value for grid in reversed(grids) for name, value in grid.metadata.items()},
        tuple(parts),
        sum(grid.hidden_count for grid in grids),
        grids[0].title,
    )


def _common(data: Sequence[dict[str, np.ndarray]], left_out: list[str]) -> dict[str, np.ndarray]:
    """Return by name the arrays that every data set has with the same width and kind of number, joined. The names of
    others are added to `left_out`."""
    shared = {}
    for name in dict.fromkeys(name for arrays in data for name in arrays):
        values = [arrays[name] for arrays in data if name in arrays]
        if len(values) == len(data) and len({(array.shape[1:], array.dtype.kind) for array in values}) == 1:
            shared[name] = np.concatenate(values)
        else:
            left_out.append(name)
    return shared
