"""How precise a rest pose has to be: as the bound is, as someone asks for, or as its faces need it to keep their shape.

A bound taken from the whole plant is more than a leaf is large: at such a step its edges are noise, and its normals
point anywhere. So every branch may have a largest step of its own (FORMAT.md, Detail).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from athcodec.encoding.quantise import half_octaves
from athcodec.errors import BoundError
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.units import Length, parse_length

OF_BOUND = "bound"
EDGE_STEP, HEIGHT_STEP = 0.025, 0.05  # largest step of a branch, over the lengths of its edges and heights of its faces
SMALL_FACES = 0.05  # part of a branch's faces that may be smaller than those that its step is made for
LEAST_SIZE = 1e-5  # of edges and heights that count, over the diagonal
LENGTH_STEP = 0.85  # largest step over the error that is asked for
WHOLE_DETAIL, MOST_DETAIL = 128, 255  # FORMAT.md, Detail


@dataclass(frozen=True)
class RestPrecision:
    """The option `rest_error` of `encode`, checked: None, what faces need; OF_BOUND; else a length, or a fraction of
    the diagonal. Raises ValueError, BoundError."""

    length: Length | None = None
    fraction: float | None = None
    of_bound: bool = False

    @classmethod
    def of(cls, option: float | str | Length | None) -> RestPrecision:
        if option is None:
            return cls()
        if option == OF_BOUND:
            return cls(of_bound=True)
        length = parse_length(option) if isinstance(option, str) else option if isinstance(option, Length) else None
        if length is not None and length.unit:
            value, found = length.value, cls(length=length)
        else:
            value = float(option if length is None else length.value)
            found = cls(fraction=value)
        if not (math.isfinite(value) and value > 0):
            raise BoundError(f"rest error: got {option}; expected a length or a fraction above 0, or {OF_BOUND!r}")
        return found

    def error(self, clip: MotionClip, diagonal: float) -> float:
        """Largest error that is asked for, in scene units; infinite where none is."""
        if self.length is not None:
            return self.length.in_scene_units(clip.metadata.get("unit"))
        return math.inf if self.fraction is None else self.fraction * diagonal

    def details(self, clip: MotionClip, hierarchy: Hierarchy, diagonal: float) -> np.ndarray:
        """Detail of every branch, (B,) int32, file order."""
        if self.of_bound:
            return np.zeros(hierarchy.branch_count, np.int32)
        error = self.error(clip, diagonal)
        if math.isfinite(error):
            return detail_of(np.full(hierarchy.branch_count, LENGTH_STEP * error))
        return detail_of(shape_steps(clip, hierarchy, diagonal))


def detail_of(steps: np.ndarray) -> np.ndarray:
    """Details of the steps next to these; infinite ones have none."""
    octaves = np.log2(steps, out=np.full(len(steps), np.inf), where=np.isfinite(steps))
    nearest = np.clip(np.rint(2 * np.where(np.isfinite(octaves), octaves, 0)) + WHOLE_DETAIL, 1, MOST_DETAIL)
    return np.where(np.isfinite(octaves), nearest, 0).astype(np.int32)


def finer_than(details: np.ndarray, step: float) -> np.ndarray:
    """Those of branches whose largest step is below the given one; 0 for others."""
    return np.where((details > 0) & (_most(details) < step), details, 0).astype(np.int32)


def _most(details: np.ndarray) -> np.ndarray:
    return half_octaves(details - WHOLE_DETAIL)


def rest_steps(branches: np.ndarray, step: float) -> np.ndarray:
    """(B,) of branches, _native.BRANCH, that of the rest pose where `step` is that of branches without detail."""
    return np.where(branches["detail"] > 0, np.minimum(_most(branches["detail"]), step), step)


def shape_steps(clip: MotionClip, hierarchy: Hierarchy, diagonal: float) -> np.ndarray:
    """(B,) of every branch, in file order, the largest step at which its faces keep their shape; infinite without."""
    steps = np.full(hierarchy.branch_count, np.inf)
    polygons = clip.polygons
    if polygons is None or not len(polygons[0]):
        return steps
    counts, corners = polygons
    faces = np.repeat(np.arange(len(counts)), counts)
    first = np.cumsum(counts) - counts
    following = np.arange(1, len(corners) + 1)
    following[(first + counts - 1)[counts > 0]] = first[counts > 0]
    points = np.asarray(clip.rest, np.float64)
    edges = points[corners[following]] - points[corners]
    lengths = np.linalg.norm(edges, axis=1)
    sizes = np.minimum(EDGE_STEP * lengths, HEIGHT_STEP * _heights(edges, lengths, faces, len(counts), corners, points))
    counted = np.where(lengths > LEAST_SIZE * diagonal, np.maximum(sizes, EDGE_STEP * LEAST_SIZE * diagonal), np.inf)
    branch = hierarchy.vertex_branch()[np.argsort(hierarchy.vertex_source)]  # of the source's vertices
    return _low_quantiles(branch[corners], counted, hierarchy.branch_count)


def _heights(
    edges: np.ndarray, lengths: np.ndarray, faces: np.ndarray, count: int, corners: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Of every corner's face, its area over its longest edge."""
    doubled, longest = np.zeros((count, 3)), np.zeros(count)
    centre = np.zeros((count, 3))
    np.add.at(centre, faces, points[corners])
    centre /= np.maximum(np.bincount(faces, minlength=count), 1)[:, None]
    np.add.at(doubled, faces, np.cross(points[corners] - centre[faces], edges))
    np.maximum.at(longest, faces, lengths)
    return (0.5 * np.linalg.norm(doubled, axis=1) / np.maximum(longest, 1e-300))[faces]


def _low_quantiles(group: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """(count,) of each group the value that a small part of its finite ones fall short of; infinite without any."""
    group, values = group[np.isfinite(values)], values[np.isfinite(values)]
    order = np.lexsort((values, group))
    numbers = np.bincount(group, minlength=count)
    at = np.cumsum(numbers) - numbers + (SMALL_FACES * numbers).astype(int)
    quantiles = np.full(count, np.inf)
    quantiles[numbers > 0] = values[order][at[numbers > 0]]
    return quantiles
