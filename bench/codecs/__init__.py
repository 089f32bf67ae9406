"""Codecs that the benchmark compares: their interface and their input.

A codec compresses the positions of a clip within a bound on the Euclidean error of every vertex in every frame,
and decodes them from the bytes alone. It tunes itself for the smallest size; every byte that decoding needs is counted.
Baselines are methods of the literature, implemented here; programs are installed from a package index.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

import athcodec
from athcodec.motion.hierarchy import Hierarchy, hierarchy_of

BLOCK = 1 << 20  # numbers
RUNS = 16  # Branches in a part of a clip.


@dataclass
class Source:
    """A clip as input of a codec: entirely in memory, vertices in the source's order."""

    clip: athcodec.MotionClip

    @cached_property
    def positions(self) -> np.ndarray:
        """(T, N, 3) float32."""
        return np.ascontiguousarray(self.clip.block(0, self.clip.frame_count), np.float32)

    @cached_property
    def rest(self) -> np.ndarray:
        """(N, 3) float32."""
        return np.ascontiguousarray(self.clip.rest, np.float32)

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """Branches and vertices in file order; its vertex_source has their numbers in the source."""
        return hierarchy_of(self.clip)

    def part(self, vertices: int) -> Source:
        """Return a smaller clip of about `vertices` vertices: evenly spaced runs of branches, with all branches that
        they hang on.
        """
        hierarchy, count = self.hierarchy, self.positions.shape[1]
        run = max(1, vertices // RUNS)
        is_taken = (np.cumsum(hierarchy.stem_count) // run) % -(-count // vertices) == 0
        is_taken[0] = True
        for branch in range(len(is_taken) - 1, 0, -1):
            if is_taken[branch] and hierarchy.branch_parent[branch] >= 0:
                is_taken[hierarchy.branch_parent[branch]] = True
        number = np.cumsum(is_taken) - 1
        parent = hierarchy.branch_parent[is_taken]
        of_vertex = hierarchy.vertex_branch()
        kept = is_taken[of_vertex]
        source = hierarchy.vertex_source[kept]
        clip = athcodec.MotionClip(
            np.ascontiguousarray(self.positions[:, source]),
            self.clip.time,
            number[of_vertex[kept]],
            np.where(parent < 0, -1, number[parent]),
            rest=self.rest[source],
        )
        return Source(clip)

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the bounding box of all frames; bounds are given as fractions of it."""
        flat = self.positions.reshape(-1, 3)
        return float(np.linalg.norm(flat.max(axis=0).astype(np.float64) - flat.min(axis=0)))


class Codec(Protocol):
    """A way to store the motion of a clip."""

    name: str
    kind: str  # "athcodec", "baseline" or "program"
    settings: dict  # Settings that the last encode chose.

    def missing(self) -> str | None:
        """Return the reason why it cannot run here, in one line; None if it can."""

    def encode(self, source: Source, bound: float) -> bytes:
        """Return the smallest encoding found within `bound`, in scene units."""

    def decode(self, data: bytes) -> np.ndarray:
        """Return (T, N, 3) float32, in the source's order."""


class BoundBroken(Exception):
    """The error of a decoded clip exceeds the bound."""


def blocks(values: np.ndarray) -> Iterator[slice]:
    """Return slices of the first axis, short enough for float64 copies to stay small."""
    length = max(1, BLOCK // values[0].size)
    return (slice(start, start + length) for start in range(0, len(values), length))


def largest_error(positions: np.ndarray, decoded: np.ndarray) -> float:
    """Return the largest Euclidean distance of any vertex in any frame; infinite if something is not a number."""
    largest = 0.0
    for block in blocks(positions):
        difference = decoded[block].astype(np.float64) - positions[block]
        distance = float(np.sqrt(np.einsum("...k,...k->...", difference, difference).max()))
        largest = max(largest, distance if distance >= 0 else np.inf)
    return largest


def check(codec: Codec, source: Source, bound: float) -> tuple[bytes, np.ndarray]:
    """Encode a clip with a codec, decode it again, and return the encoded bytes and the decoded positions (T, N, 3).
    Raise BoundBroken if a vertex is further off than `bound`, in scene units, or if the decoded array has another shape
    or type.
    """
    data = codec.encode(source, bound)
    decoded = codec.decode(data)
    if decoded.shape != source.positions.shape or decoded.dtype != np.float32:
        raise BoundBroken(
            f"{codec.name}: got {decoded.dtype} {decoded.shape}; expected float32 {source.positions.shape}"
        )
    error = largest_error(source.positions, decoded)
    if not error <= bound:
        raise BoundBroken(f"{codec.name}: got an error of {error:.6g}; expected at most {bound:.6g}")
    return data, decoded
