"""Reads VTKHDF, the HDF5 files of VTK: unstructured grids and surfaces (PolyData), with steps in time or without, in
one piece or several, alone or as blocks.

hdf5.py opens the file. See fields.py for what becomes the motion, cells.py for the cells and parts.py for several
blocks. Pieces of a parallel run follow each other. What belongs to a step lies where Steps says: data without an offset
of their own lie where the points or cells of the step do. Images, AMR and hyper-trees are refused, with what they are;
field data are named. Nothing in the file is trusted.
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from os import fspath
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget
from athcodec.motion.clip import MotionClip
from athcodec.sources import ReadOptions
from athcodec.sources.cells import NODE_BYTES, VTK_NAMES, Block, blocks_of
from athcodec.sources.fields import clip_of_steps
from athcodec.sources.mesh import same_values
from athcodec.sources.parts import CELL, NODE, JoinedSteps
from athcodec.sources.timing import times_in_seconds
from athcodec.untyped import H5Object

ROOT, ASSEMBLY = "VTKHDF", "Assembly"
GRID, SURFACE = "UnstructuredGrid", "PolyData"
COMPOSITE = ("MultiBlockDataSet", "PartitionedDataSetCollection")
OFFSETS = ("CellOffsets", "ConnectivityIdOffsets")
DATA = {NODE: "PointData", CELL: "CellData"}
# The cells of surfaces, in the order of their data: VTK's numbers of those with so many nodes, and of the others.
SURFACE_CELLS = {"Vertices": ({1: 1}, 2), "Lines": ({2: 3}, 4), "Polygons": ({3: 5, 4: 9}, 7), "Strips": ({}, 6)}


def clip_of_vtkhdf(file: h5py.File, path: FilePath, options: ReadOptions, **watched: Any) -> MotionClip:
    """Return the clip in an open VTKHDF file. `path` gives names for messages and objects; `watched` are the fields
    resource and unchanged of MotionClip. Raises ClipError."""
    budget, name = Budget(options.max_memory), Path(path).stem
    if options.axes is not None:
        raise ClipError(
            "axes: got an order for VTKHDF, whose points have one; --dataset (dataset=) names another array"
        )
    groups, left_out = _groups(file, options.only)
    parts = [_Part(name if len(groups) == 1 else block, group, budget) for block, group in groups.items()]
    stored = parts[0].times
    for part in parts[1:]:
        if not np.array_equal(part.times, stored):
            raise ClipError(
                f"{part.name}: got other times than {parts[0].name}; --only (only=) reads some of the blocks"
            )
    with np.errstate(all="ignore"):  # Times that are no numbers of seconds are refused by the clip.
        time, metadata = times_in_seconds(stored, options.fps)
    steps = JoinedSteps(parts, budget, fspath(path))
    steps.left_out += [name for part in parts for name in part.left_out]
    facts = metadata if len(parts) == 1 else metadata | {"objects": steps.objects()}
    clip = clip_of_steps(steps, time, facts, name, options, steps.static(), **watched)
    others = [each for each in file if each != ROOT]
    clip.not_read = {
        **clip.not_read,
        **({"block": left_out} if left_out else {}),
        **({"dataset beside VTKHDF": others} if others else {}),
    }
    return clip


def _groups(file: h5py.File, only: Sequence[str]) -> tuple[dict[str, h5py.Group], list[str]]:
    """Return (meshes, others): the groups of the file that are meshes, by name, and the names of blocks that are not.
    If `only` is not empty, a block's name has to match one of these patterns. Raises ClipError if no mesh is left."""
    root = file[ROOT]
    kind = _kind(root)
    if kind in (GRID, SURFACE):
        return {ROOT: root}, []
    if kind not in COMPOSITE:
        raise ClipError(
            f"VTKHDF: got the type {kind[:40]!r}, whose points do not move; expected {GRID} or {SURFACE}, alone or as "
            "blocks"
        )
    names = _block_names(root)
    blocks = {names.get(key, key): root[key] for key in root if key != ASSEMBLY and isinstance(root[key], h5py.Group)}
    if only:
        blocks = {name: group for name, group in blocks.items() if any(fnmatchcase(name, each) for each in only)}
    kinds = {name: _kind(group) for name, group in blocks.items()}
    meshes = {name: group for name, group in blocks.items() if kinds[name] in (GRID, SURFACE)}
    if not meshes:
        got = ", ".join(f"{name} ({kinds[name][:40]})" for name in kinds) or f"none of {', '.join(names.values())}"
        raise ClipError(f"VTKHDF: got the blocks {got}, expected {GRID} or {SURFACE}")
    return meshes, [f"{name} ({kind})" for name, kind in kinds.items() if name not in meshes]


def _block_names(root: h5py.Group) -> dict[str, str]:
    """Return the readable names that the file's assembly gives to blocks, by the names of their groups. Return nothing
    if two blocks have the same name."""
    names: dict[str, str] = {}
    assembly = root.get(ASSEMBLY)

    def visit(name: str, link: H5Object) -> None:
        if isinstance(link, h5py.SoftLink):
            key = link.path.rpartition("/")[2]
            names.setdefault(key, name.rpartition("/")[2])

    if isinstance(assembly, h5py.Group):
        assembly.visititems_links(visit)
    unique = len(set(names.values())) == len(names)
    return names if unique else {}


def _kind(group: h5py.Group) -> str:
    kind = group.attrs.get("Type", "")
    return kind.decode("utf-8", "replace") if isinstance(kind, bytes) else str(kind)


class _Part:
    """See parts.Part: a grid or surface."""

    def __init__(self, name: str, group: h5py.Group, budget: Budget):
        """Read the cells of the mesh in an HDF5 group, and its times. `name` is what the object is called; `budget`
        limits the memory that reading takes."""
        self.name, self._group, self._budget = name, group, budget
        self._is_surface, self._kept = _kind(group) == SURFACE, dict[str, np.ndarray]()
        steps = group.get("Steps")
        self._steps = steps if isinstance(steps, h5py.Group) else None
        self.times = np.zeros(1) if self._steps is None else self._stored_times(self._steps)
        self.elsewhere: dict[str, str] = {}
        self.left_out = [
            name
            for kind in (*DATA.values(), "FieldData")
            for name in group.get(kind, ())
            if kind == "FieldData" or not _is_numbers(group[kind].get(name))
        ]
        self._cells = self._read_cells(0)
        types, starts, stops, nodes = self._cells
        self.blocks: list[Block] = blocks_of(types, starts, stops, nodes, VTK_NAMES)
        self.cell_count = len(types)

    def points(self, step: int) -> np.ndarray:
        first, count = self._points_at(step)
        return self._rows("Points", first, count)

    def fixed_points(self) -> bool:
        places = [self._points_at(step) for step in range(len(self.times))]
        if len(set(places)) == 1:
            return True
        first = self.points(0)
        return all(np.array_equal(first, self.points(step)) for step in range(1, len(places)))

    def check(self, step: int) -> None:
        if self._cells_at(step) != self._cells_at(0) and not all(
            map(np.array_equal, self._read_cells(step), self._cells)
        ):
            raise ClipError(f"frame {step}: got other cells than in the first; topology that changes cannot be coded")

    def names(self, center: str) -> list[str]:
        group = self._group.get(DATA[center])
        return [] if group is None else [name for name in group if _is_numbers(group.get(name))]

    def values(self, step: int, name: str, center: str) -> np.ndarray:
        place, count = self._data_at(step, name, center)
        values = self._rows(f"{DATA[center]}/{name}", place, count)
        return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values

    def is_static(self, name: str, center: str) -> bool:
        steps = range(len(self.times) - 1, 0, -1)  # The last first, because what moves is not there where it was.
        if all(self._data_at(step, name, center) == self._data_at(0, name, center) for step in steps):
            return True
        first = self.values(0, name, center)
        return all(same_values(first, self.values(step, name, center)) for step in steps)

    # ---- where things lie ----

    def _stored_times(self, steps: H5Object) -> np.ndarray:
        """Return the stored times of the mesh's steps (T,), from the group `Steps`. Raises ClipError if there are too
        few or they are no numbers."""
        count = int(steps.attrs.get("NSteps", 0))
        values = self._array("Steps/Values").reshape(-1)
        if count < 1 or len(values) < count:
            raise ClipError(f"Steps: got {len(values)} times, expected NSteps, {count}")
        if values.dtype.kind not in "fiu":
            raise ClipError(f"Steps: got times of {values.dtype}, expected numbers")
        return values[:count] if values.dtype.kind == "f" else values[:count].astype(np.float64)

    def _pieces(self, step: int) -> range:
        """Return the numbers of the stored pieces that together are the mesh at a step. Raises ClipError if there are
        no such pieces."""
        first = self._of_step("PartOffsets", step, 0)
        total = self._group["NumberOfPoints"].shape[0]
        count = self._of_step("NumberOfParts", step, 1 if self._steps is not None else total)
        if not 0 <= first <= first + count <= total:
            raise ClipError(
                f"Steps: got the pieces {first} to {first + count} in step {step}, expected some of {total}"
            )
        return range(first, first + count)

    def _points_at(self, step: int) -> tuple[int, int]:
        """Return the row of the first point of a step, and the number of its points."""
        pieces = self._pieces(step)
        return self._of_step("PointOffsets", step, 0), sum(self._counts("NumberOfPoints", pieces))

    def _cells_at(self, step: int) -> tuple[Any, ...]:
        """Return a key that is equal for two steps if the file stores the same cells for both."""
        kinds = len(SURFACE_CELLS) if self._is_surface else 1
        pieces = self._pieces(step)
        offsets = [self._of_step(name, step, 0, kind) for name in OFFSETS for kind in range(kinds)]
        return (*offsets, pieces, *self._counts("NumberOfPoints", pieces))

    def _data_at(self, step: int, name: str, center: str) -> tuple[int, int]:
        """Return the first row of an array at a step, and the number of its rows. center: points or cells."""
        kinds = len(SURFACE_CELLS) if self._is_surface and center == CELL else 1
        usual = "PointOffsets" if center == NODE else "CellOffsets"
        place = sum(self._of_step(usual, step, 0, kind) for kind in range(kinds))
        count = self._points_at(step)[1] if center == NODE else self.cell_count
        return self._of_step(f"{DATA[center]}Offsets/{name}", step, place), count

    def _of_step(self, name: str, step: int, missing: int, column: int = 0) -> int:
        """Return the integer in row `step` and `column` of the array `name` in the group Steps, or `missing` if the
        array does not exist. Raises ClipError if it has no such row."""
        if self._steps is None or name not in self._steps:
            return missing
        values = self._array(f"Steps/{name}")
        values = values.reshape(len(values), -1)
        if step >= len(values) or column >= values.shape[1] or values.dtype.kind not in "iu":
            raise ClipError(f"Steps/{name}: got {values.dtype} of shape {values.shape}, expected a row for step {step}")
        return int(values[step, column])

    def _counts(self, name: str, pieces: range) -> list[int]:
        values = self._array(name).reshape(-1)
        if pieces.stop > len(values) or values.dtype.kind not in "iu" or (values < 0).any():
            raise ClipError(f"{name}: got {len(values)} of {values.dtype}, expected a number for each of {pieces.stop}")
        return [int(value) for value in values[pieces.start : pieces.stop]]

    # ---- reading ----

    def _read_cells(self, step: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return (types, starts, stops, nodes) of the cells at a step: the VTK type of each cell (C,), where its nodes
        start and stop in `nodes` (C,), and the nodes of all cells."""
        kinds = SURFACE_CELLS if self._is_surface else {"": ({}, 0)}
        pieces = self._pieces(step)
        points = np.cumsum([0, *self._counts("NumberOfPoints", pieces)])
        cells: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        for piece in range(len(pieces)):
            for column, (prefix, numbers) in enumerate(kinds.items()):
                types, sizes, nodes = self._cells_of(step, prefix, column, pieces, piece, numbers)
                cells.append((types, sizes, nodes + points[piece]))
        types, sizes, nodes = (np.concatenate(each) for each in zip(*cells))
        stops = np.cumsum(sizes)
        return types, stops - sizes, stops, nodes

    def _cells_of(
        self, step: int, prefix: str, column: int, pieces: range, piece: int, numbers: tuple[dict[int, int], int]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (types, sizes, nodes) of the cells of one kind in one piece: the VTK type and the number of nodes of
        each cell, and the nodes of all cells. `prefix` is the kind's group and `column` its column in arrays per step;
        `numbers` gives VTK types by cell size, and the type for other sizes. `piece` counts within `pieces`."""
        within = f"{prefix}/" if prefix else ""
        if within and prefix not in self._group:
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64)
        cells = self._counts(f"{within}NumberOfCells", pieces)
        ids = self._counts(f"{within}NumberOfConnectivityIds", pieces)
        first_cell = self._of_step("CellOffsets", step, 0, column) + sum(cells[:piece])
        first_id = self._of_step("ConnectivityIdOffsets", step, 0, column) + sum(ids[:piece])
        # Offsets have one number more than there are cells in each of the pieces before.
        offsets = self._rows(f"{within}Offsets", first_cell + pieces.start + piece, cells[piece] + 1, whole=True)
        nodes = self._rows(f"{within}Connectivity", first_id, ids[piece], whole=True)
        sizes = np.diff(offsets)
        if offsets[0] != 0 or (sizes < 0).any() or offsets[-1] != len(nodes):
            raise ClipError(f"{within}Offsets: got {offsets[-1]} nodes, expected {len(nodes)}, none of them twice")
        self._budget.need(NODE_BYTES * nodes.size, f"{within}Connectivity")
        if not prefix:
            return self._rows("Types", first_cell, cells[piece], whole=True), sizes, nodes
        by_size, other = numbers
        return np.array([by_size.get(size, other) for size in sizes.tolist()], np.int64), sizes, nodes

    def _rows(self, name: str, first: int, count: int, whole: bool = False) -> np.ndarray:
        """Return `count` rows of the array `name`, from row `first` on. With `whole`, they have to be integers and are
        returned as int64. Raises ClipError if there are no such rows."""
        dataset = self._dataset(name)
        if not 0 <= first <= first + count <= dataset.shape[0]:
            raise ClipError(f"{name}: got {dataset.shape[0]} rows, expected {count} from {first} on")
        self._budget.need(2 * count * int(np.prod(dataset.shape[1:], dtype=object)) * dataset.dtype.itemsize, name)
        if whole and dataset.dtype.kind not in "iu":
            raise ClipError(f"{name}: got {dataset.dtype}, expected integers")
        values = np.asarray(dataset[first : first + count])
        return values.astype(np.int64) if whole else values.astype(dataset.dtype.newbyteorder("="), copy=False)

    def _array(self, name: str) -> np.ndarray:
        """Return a small array, which is read once and kept."""
        if name not in self._kept:
            dataset = self._dataset(name)
            self._budget.take(dataset.nbytes, name)
            self._kept[name] = np.asarray(dataset[...])
        return self._kept[name]

    def _dataset(self, name: str) -> h5py.Dataset:
        dataset = self._group.get(name)
        if not _is_numbers(dataset):
            raise ClipError(f"{self._group.name}/{name}: got no array of numbers, expected one")
        return dataset


def _is_numbers(dataset: H5Object) -> bool:
    return isinstance(dataset, h5py.Dataset) and bool(dataset.shape) and dataset.dtype.kind in "fiu"
