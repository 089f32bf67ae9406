"""A frame as matrices, and what they leave out (paper, equations 2 and 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec.decoding import core_file
from athcodec.decoding.ath_file import AthFile
from athcodec.errors import BadChunk
from athcodec.files.shown import counted
from athcodec.motion.affine_fit import stem_maps


@dataclass(frozen=True, eq=False, repr=False)
class Affines:
    """The parts of a level as matrices, K of them, by first vertex.

    Attributes
    ----------
    branch : (K,) int32
        The branch that each part is on, in the source's numbering.
    first_vertex, vertex_count : (K,) int32
        Vertices of each part, in file order (`AthFile.hierarchy.vertex_source` has their numbers in the source).
    is_stem : (K,) bool
        Whether it is an exact stem, whose matrix is a least-squares fit, or a node of the ATH, which moves as one.
    matrices : (K, 3, 4) float64
        From the reference pose of the level (`Decoder.level_rest`) to positions, both absolute, in scene units:
        x' = matrix[:, :3] @ x + matrix[:, 3].
    """

    branch: np.ndarray
    first_vertex: np.ndarray
    vertex_count: np.ndarray
    is_stem: np.ndarray
    matrices: np.ndarray

    def __repr__(self) -> str:
        return f"<Affines: {counted(len(self.branch), 'part')}, {int(self.is_stem.sum()):,} of them exact stems>"


def affines_of(file: AthFile, ready: core_file.Segment, level: int, frame: int, subject: str) -> Affines:
    """Return frame `frame` of the file as an affine matrix for each part of the plant. `ready` is the frame's segment,
    prepared at `level`; `subject` begins messages. Raises BadChunk if no matrix fits the positions."""
    core, parts, hierarchy = file.core, file.core.cut(level), file.hierarchy
    nodes, stems = parts[parts["branch"] >= 0], file.tables.exact_branches(parts)
    positions = np.empty((core.info.place_count, 3))
    node_matrices = core.matrices(ready, frame, len(nodes))
    core.positions(ready, frame, positions, core_file.FILE_ORDER)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            rest = file.static.level_rest(level, core_file.FILE_ORDER)
            maps = stem_maps(file.static.place_hierarchy, rest, positions[None])
    except np.linalg.LinAlgError:  # Infinite positions lead some plants here.
        maps = np.array(np.nan)
    if not np.isfinite(maps).all():
        raise BadChunk(f"{subject}: got positions that no matrix fits; expected those of a plant")
    first = np.concatenate([nodes["first"], file.tables.branches["first"][stems]])
    stop = first + np.concatenate([nodes["count"], file.tables.branches["count"][stems]])
    first, stop = file.static.place_starts[first], file.static.place_starts[stop]
    branch = hierarchy.branch_source[np.concatenate([nodes["branch"], stems])]
    is_stem, matrices = np.arange(len(first)) >= len(nodes), np.concatenate([node_matrices, maps[0, stems]])
    order = np.argsort(first, kind="stable")
    first, count = (array[order].astype(np.int32) for array in (first, stop - first))
    return Affines(branch[order], first, count, is_stem[order], matrices[order])


def residual_of(parts: Affines, positions: np.ndarray, vertex_source: np.ndarray, subject: str) -> np.ndarray:
    """Return for each vertex, in source order, the point (N, 3) float64 that its part's matrix takes to its position.
    It lies in the space of the level's rest pose. `positions` (N, 3) are in source order, and `vertex_source` (N,) has
    the source's number of each vertex in file order. `subject` begins messages. Raises BadChunk."""
    full = positions[vertex_source]
    if not np.isfinite(full).all():
        raise BadChunk(f"{subject}: got positions that are not finite; expected those of a plant")
    out = np.empty_like(full)
    for first, count, matrix in zip(parts.first_vertex, parts.vertex_count, parts.matrices):
        rows = slice(first, first + count)
        away = (full[rows] - matrix[:, 3]).T
        out[vertex_source[rows]] = np.linalg.lstsq(matrix[:, :3], away, rcond=1e-15)[0].T
    return out
