"""Meshes of a finite-element result that move together, as the one mesh of fields.py. The format is not known here.

The points of the parts follow each other, and so do their cells. A field of some parts only moves those; the others
keep their places, and a GuessWarning says so. Data that are not in all parts are in no clip, and are named.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.reading import Budget
from athcodec.sources.cells import Block, topology_of
from athcodec.sources.mesh import kind_of
from athcodec.untyped import JsonObject

NODE, CELL = "node", "cell"


class Part(Protocol):
    """A mesh and its data, step by step, read when they are asked for.

    name        what the file calls it
    blocks      its cells in the first step, and their number
    elsewhere   names of the data of the first step that are neither per point nor per cell, and what they are per
    """

    @property
    def name(self) -> str: ...
    @property
    def blocks(self) -> Sequence[Block]: ...
    @property
    def cell_count(self) -> int: ...
    @property
    def elsewhere(self) -> Mapping[str, str]: ...

    def points(self, step: int) -> np.ndarray:
        """Return (N, 2) or (N, 3) points."""

    def fixed_points(self) -> bool:
        """Return whether all steps have the points of the first."""

    def check(self, step: int) -> None:
        """Raise ClipError where the cells are others than in the first step."""

    def names(self, center: str) -> Sequence[str]:
        """Return the names of the data per point (NODE) or per cell (CELL) of any step."""

    def values(self, step: int, name: str, center: str) -> np.ndarray:
        """Return (N, ...) values. Raises ClipError where the step has none of this name."""

    def is_static(self, name: str, center: str) -> bool:
        """Return whether all steps have the same values."""


class JoinedSteps:
    """See fields.Steps: the steps of all parts."""

    def __init__(self, parts: Sequence[Part], budget: Budget, warn_as: str):
        """Join the steps of several meshes. `warn_as` is the file's name in warnings; `budget` limits the memory that
        reading takes."""
        self._parts, self._budget, self._warn_as = parts, budget, warn_as
        self._counts = [len(part.points(0)) for part in parts]
        self.topology = topology_of(_joined_blocks(parts, self._counts), sum(self._counts))
        self.elsewhere: dict[str, str] = {}
        for part in parts:
            self.elsewhere |= {**part.elsewhere, **dict.fromkeys(part.names(CELL), CELL)}
        self.left_out = self._add_cell_data()
        self._warned: set[str] = set()

    def objects(self) -> JsonObject:
        """Return what scene_objects.scene_fields takes: names, numbers of vertices and kinds of the parts."""
        return {
            "names": [part.name for part in self._parts],
            "vertices": self._counts,
            "kinds": [_kind(part.blocks, count) for part, count in zip(self._parts, self._counts)],
        }

    def points(self, step: int) -> np.ndarray:
        return self._joined([part.points(step) for part in self._parts], "points")

    def fixed_points(self) -> bool:
        return all(part.fixed_points() for part in self._parts)

    def check(self, step: int) -> None:
        for part in self._parts:
            try:
                part.check(step)
            except ClipError as error:
                raise ClipError(f"{part.name}: {error}" if len(self._parts) > 1 else str(error)) from None

    def fields(self) -> list[str]:
        return list(dict.fromkeys(name for part in self._parts for name in part.names(NODE)))

    def field(self, step: int, name: str) -> np.ndarray:
        """Return the field `name` at a step, with a row for each point of all parts. Points of a part without the field
        get 0. Raises ClipError if no part has it."""
        having = [part for part in self._parts if name in part.names(NODE)]
        if not having:
            raise ClipError(f"frame {step}: got no field {name!r} per point, expected one as in the first")
        still = [part.name for part in self._parts if part not in having]
        if still and name not in self._warned:
            self._warned.add(name)
            text = f"{self._warn_as}: {', '.join(still)} has no {name}, and stays where it is"
            warnings.warn(text, GuessWarning, stacklevel=2)
        rows = [part.values(step, name, NODE) if part in having else None for part in self._parts]
        width = next(each for each in rows if each is not None).shape[1:]
        filled = [np.zeros((count, *width)) if each is None else each for each, count in zip(rows, self._counts)]
        return self._joined(filled, name)

    def static(self) -> dict[str, np.ndarray]:
        """Return data per point that are the same in all steps, and in all parts."""
        return self._static_data(NODE, self._counts)

    def _static_data(self, center: str, counts: Sequence[int]) -> dict[str, np.ndarray]:
        """Return by name the joined arrays that every part has and that stay the same in all steps. `center` says
        whether they are per point or per cell, and `counts` how many rows each part has."""
        kept = {}
        for name in dict.fromkeys(name for part in self._parts for name in part.names(center)):
            if name and all(name in part.names(center) and part.is_static(name, center) for part in self._parts):
                rows = [part.values(0, name, center) for part in self._parts]
                if [len(each) for each in rows] == list(counts) and len({each.shape[1:] for each in rows}) == 1:
                    kept[name] = self._joined(rows, name)
                    self._budget.take(2 * kept[name].nbytes, name)
        return kept

    def _add_cell_data(self) -> list[str]:
        """Keep the data per cell that are the same in all steps; return the names of all data that are in no clip."""
        kept = self._static_data(CELL, [part.cell_count for part in self._parts])
        for name, values in list(kept.items()):
            if not self.topology.add_cell_data(name, values[:, 0] if values.shape[1:] == (1,) else values):
                del kept[name]
        names = [name for part in self._parts for name in (*part.names(CELL), *part.elsewhere)]
        return [name for name in dict.fromkeys(names) if name and name not in kept]

    def _joined(self, rows: Sequence[np.ndarray], subject: str) -> np.ndarray:
        """Return the rows of all parts, one part after the other. Raises ClipError if their widths differ."""
        if len(rows) == 1:
            return rows[0]
        if len({each.shape[1:] for each in rows}) > 1:
            shapes = ", ".join(f"{part.name} {each.shape}" for part, each in zip(self._parts, rows))
            raise ClipError(f"{subject}: got {shapes}, expected as many numbers for each in all of them")
        return np.concatenate(rows)


def _joined_blocks(parts: Sequence[Part], counts: Sequence[int]) -> list[Block]:
    """Return the cells of all parts as if their points and cells formed one mesh, one part after the other. `counts`
    has the number of points of each part."""
    blocks, first, row = [], 0, 0
    for part, count in zip(parts, counts):
        if len(parts) > 1:
            topology_of(part.blocks, count)  # Vertices of another part would be no error any more.
        blocks += [replace(block, nodes=block.nodes + first, rows=block.rows + row) for block in part.blocks]
        first, row = first + count, row + part.cell_count
    return blocks


def _kind(blocks: Sequence[Block], count: int) -> str:
    topology = topology_of(blocks, count)
    faces = topology.faces if topology.faces is not None else topology.attributes.get("face_vertex_counts")
    return kind_of(faces, topology.edges)
