"""How precise a rest pose has to be: as the bound is, as someone asks for, or as its faces need it to keep their shape.

A bound taken from the whole plant is more than a leaf is large: at such a step its edges are noise, and its normals
point anywhere. So every branch may have a largest step of its own (FORMAT.md, Detail).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from athcodec.encoding.model.quantise import half_octaves
from athcodec.errors import BoundError
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.polygons import sides
from athcodec.motion.units import Length, LengthLike, length_of, scene_unit
from athcodec.untyped import JsonMapping

OF_BOUND = "bound"
EDGE_STEP = 0.025  # Largest step of a branch over the length of its edges, which rounding stretches by as much.
HEIGHT_STEP = 0.05  # Largest step of a branch over the height of its faces, whose normals rounding turns.
SMALL_FACES = 0.05  # Share of a branch's faces that may be smaller than those that its step is made for.
LEAST_SIZE = 1e-5  # Least size, in diagonals, of edges and heights that count: faces without area ask for nothing.
LENGTH_STEP = 0.85  # Largest step over the error that is asked for.
WHOLE_DETAIL = 128  # Detail of a step of 1 (FORMAT.md, Detail).
MOST_DETAIL = 255  # Largest detail (FORMAT.md, Detail).


@dataclass(frozen=True)
class RestPrecision:
    """The option `rest_error` of `encode`, checked: None, what faces need; OF_BOUND; else a length, or a fraction of
    the diagonal. Raises ValueError, BoundError."""

    length: Length | None = None
    fraction: float | None = None
    of_bound: bool = False

    @classmethod
    def of(cls, option: LengthLike | None) -> RestPrecision:
        """Return the option `rest_error` checked. Raises BoundError for a length or fraction that is not finite and
        above 0.
        """
        if option is None:
            return cls()
        if isinstance(option, str) and option == OF_BOUND:
            return cls(of_bound=True)
        length = length_of(option, "rest_error")
        precision = cls(length=length) if length.unit else cls(fraction=length.value)
        if not (math.isfinite(length.value) and length.value > 0):
            raise BoundError(f"rest error: got {option}; expected a length or a fraction above 0, or {OF_BOUND!r}")
        return precision

    def error(self, metadata: JsonMapping, diagonal: float, least: float) -> float:
        """Return the largest error that is asked for, in the scene units of some metadata; infinite: none is. A
        fraction asks for no less than `least`, such as that of a plant whose vertices coincide.
        """
        if self.length is not None:
            return self.length.in_scene_units(scene_unit(metadata))
        return math.inf if self.fraction is None else max(self.fraction * diagonal, least)

    def details(
        self, faces: tuple[np.ndarray, np.ndarray] | None, rest: np.ndarray, hierarchy: Hierarchy, diagonal: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the detail of every branch, (B,) int32, and whether its faces are to keep their shape, (B,) bool, in
        file order. An error that is asked for is that of all branches, so that they need no detail. faces: as
        `MotionClip.polygons`, of vertices of a rest pose, (N, 3), in the same order."""
        none = np.zeros(hierarchy.branch_count, np.int32)
        if self.of_bound:
            return none, none > 0
        details = detail_of(shape_steps(faces, rest, hierarchy, diagonal))
        is_asked = self.length is not None or self.fraction is not None
        return none if is_asked else details, details > 0


def detail_of(steps: np.ndarray) -> np.ndarray:
    """Return the details of the nearest steps; infinite ones, and those of a plant without extent, have none."""
    octaves = np.log2(steps, out=np.full(len(steps), np.inf), where=np.isfinite(steps) & (steps > 0))
    nearest = np.clip(np.rint(2 * np.where(np.isfinite(octaves), octaves, 0)) + WHOLE_DETAIL, 1, MOST_DETAIL)
    return np.where(np.isfinite(octaves), nearest, 0).astype(np.int32)


def finer_than(details: np.ndarray, step: float) -> np.ndarray:
    """Return the details (B,) with 0 in place of those whose step is not finer than `step`."""
    return np.where((details > 0) & (_most(details) < step), details, 0).astype(np.int32)


def _most(details: np.ndarray) -> np.ndarray:
    return half_octaves(details - WHOLE_DETAIL)


def rest_steps(branches: np.ndarray, step: float) -> np.ndarray:
    """Return the step of the rest pose of branches, (B,); step: that of branches without detail."""
    return np.where(branches["detail"] > 0, np.minimum(_most(branches["detail"]), step), step)


def shape_steps(
    polygons: tuple[np.ndarray, np.ndarray] | None, rest: np.ndarray, hierarchy: Hierarchy, diagonal: float
) -> np.ndarray:
    """Return for each branch the largest step of positions at which its faces keep their shape, (B,) in file order;
    infinite without faces. `polygons`: the number of corners of each face, and the corners of all; `rest`: (N, 3)
    positions in source order; `diagonal`: in scene units.
    """
    steps = np.full(hierarchy.branch_count, np.inf)
    if polygons is None or not len(polygons[0]):
        return steps
    counts, corners = polygons
    faces = np.repeat(np.arange(len(counts)), counts)
    points = np.asarray(rest, np.float64)
    start, stop = sides(counts, corners).T
    edges = points[stop] - points[start]
    lengths = np.linalg.norm(edges, axis=1)
    sizes = np.minimum(EDGE_STEP * lengths, HEIGHT_STEP * _heights(edges, lengths, faces, len(counts), corners, points))
    counted = np.where(lengths > LEAST_SIZE * diagonal, np.maximum(sizes, EDGE_STEP * LEAST_SIZE * diagonal), np.inf)
    branch = hierarchy.vertex_branch()[np.argsort(hierarchy.vertex_source)]  # In the order of the source's vertices.
    return _low_quantiles(branch[corners], counted, hierarchy.branch_count)


def _heights(
    edges: np.ndarray, lengths: np.ndarray, faces: np.ndarray, count: int, corners: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Return for each corner the height of its face: the face's area over its longest edge. `edges`, `lengths`: the
    edge that starts at each corner; `faces`: the face of each corner; `count`: the number of faces; `points`: (N, 3)
    positions.
    """
    doubled, longest = np.zeros((count, 3)), np.zeros(count)
    centre = np.zeros((count, 3))
    np.add.at(centre, faces, points[corners])
    centre /= np.maximum(np.bincount(faces, minlength=count), 1)[:, None]
    np.add.at(doubled, faces, np.cross(points[corners] - centre[faces], edges))
    np.maximum.at(longest, faces, lengths)
    return (0.5 * np.linalg.norm(doubled, axis=1) / np.maximum(longest, 1e-300))[faces]


def _low_quantiles(group: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Return for each of `count` groups the value below which a small share of its finite values lies, (count,);
    infinite for a group without any. `group`: the group of each of `values`.
    """
    group, values = group[np.isfinite(values)], values[np.isfinite(values)]
    order = np.lexsort((values, group))
    numbers = np.bincount(group, minlength=count)
    at = np.cumsum(numbers) - numbers + (SMALL_FACES * numbers).astype(int)
    quantiles = np.full(count, np.inf)
    quantiles[numbers > 0] = values[order][at[numbers > 0]]
    return quantiles
