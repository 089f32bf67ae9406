"""The cells of a finite-element mesh that a clip's faces, edges and attributes stand for; see sources/cells.py.

Where the clip has volume cells as attributes (cells_tetra ...) they are written, and not the faces of their outside. A
clip without faces, edges and volumes becomes a point cell per vertex.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from athcodec.exporters.mesh import domain_of
from athcodec.motion.protocol import Motion
from athcodec.sources.cells import NODES, VTK_NUMBERS


@dataclass
class Cells:
    """VTK's numbers of the types (C,), where the nodes of each end (C,), and the nodes; all int64. domain: which data
    have a row per cell, "" for none."""

    types: np.ndarray
    stops: np.ndarray
    nodes: np.ndarray
    domain: str


def cells_of(motion: Motion) -> Cells:
    """Return the cells of a finite-element mesh that a motion's attributes state, or else those that its faces and
    edges make.
    """
    kinds: list[np.ndarray] = []
    counts: list[np.ndarray] = []
    nodes: list[np.ndarray] = []
    domains: list[str] = []
    volumes = {
        name.removeprefix("cells_"): values
        for name, values in motion.attributes.items()
        if name.startswith("cells_") and values.ndim == 2 and values.shape[1:] == (NODES.get(name[6:]),)
    }
    if motion.edges is not None and len(motion.edges):
        _add(kinds, counts, nodes, "line", np.asarray(motion.edges))
        domains.append("edge")
    if motion.polygons is not None and len(motion.polygons[0]) and not volumes:
        sizes, corners = motion.polygons
        kinds.append(
            np.select([sizes == 3, sizes == 4], [VTK_NUMBERS["triangle"], VTK_NUMBERS["quad"]], VTK_NUMBERS["polygon"])
        )
        counts.append(sizes)
        nodes.append(corners)
        domains.append("face")
    for kind, values in volumes.items():
        _add(kinds, counts, nodes, kind, values)
    domains += ["cell"] * bool(volumes)
    if not kinds:
        _add(kinds, counts, nodes, "vertex", np.arange(motion.vertex_count)[:, None])
    types, sizes_of_cells, corners_of_cells = (
        np.concatenate(parts).astype(np.int64) for parts in (kinds, counts, nodes)
    )
    return Cells(types, np.cumsum(sizes_of_cells), corners_of_cells, domains[0] if len(domains) == 1 else "")


def _add(
    kinds: list[np.ndarray], counts: list[np.ndarray], nodes: list[np.ndarray], kind: str, values: np.ndarray
) -> None:
    kinds.append(np.full(len(values), VTK_NUMBERS[kind]))
    counts.append(np.full(len(values), values.shape[1]))
    nodes.append(values.reshape(-1))


def arrays_in(motion: Motion, per_point: Collection[str], per_cell: Collection[str]) -> set[str]:
    """Return the names of the attributes that a file of cells holds: its data per point and per cell, and the cells."""
    return {*per_point, *per_cell, *(name for name in motion.attributes if name.startswith("cells_"))}


def cell_and_point_data(motion: Motion, cells: Cells) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return two mappings from an attribute's name to its values: one row per point, and one row per cell. Rows have at
    most nine numbers.
    """
    per_point, per_cell = {}, {}
    for name, values in motion.attributes.items():
        fits = values.ndim in (1, 2) and values.dtype.kind in "fiu" and values.dtype.itemsize in (1, 2, 4, 8)
        if not fits or (values.ndim == 2 and not 1 <= values.shape[1] <= 9) or values.dtype == np.float16:
            continue
        domain = domain_of(motion, name)
        if domain == "vertex" and len(values) == motion.vertex_count:
            per_point[name] = values
        elif domain and domain == cells.domain and len(values) == len(cells.types):
            per_cell[name] = values
    per_cell.pop("face_vertex_counts", None)
    return per_point, per_cell
