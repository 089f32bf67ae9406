"""Codecs that the benchmark compares: what each has to offer, and what each gets.

A codec compresses the positions of a clip within a bound on the Euclidean error of every vertex in every frame,
and gives them back from the bytes alone. It tunes itself for the smallest size; every byte that decoding needs is
counted. What is implemented here to be compared with is a baseline; what people would install instead is a program.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

import athcodec
from athcodec.hierarchy import Hierarchy, hierarchy_of

BLOCK = 1 << 20  # numbers


@dataclass
class Source:
    """A clip as codecs see it: all of it in memory, vertices in the source's order."""

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
        """Branches and vertices in file order; its vertex_source says where each stands in the source."""
        return hierarchy_of(self.clip)

    @cached_property
    def diagonal(self) -> float:
        """Of the bounding box of all frames; bounds are given as fractions of it."""
        flat = self.positions.reshape(-1, 3)
        return float(np.linalg.norm(flat.max(axis=0).astype(np.float64) - flat.min(axis=0)))


class Codec(Protocol):
    """One way to store the motion of a clip."""

    name: str
    kind: str  # "athcodec", "baseline" or "program"
    settings: dict  # what the last encode chose

    def missing(self) -> str | None:
        """Why it cannot run here, in one line; None where it can."""

    def encode(self, source: Source, bound: float) -> bytes:
        """The smallest encoding found within `bound`, in scene units."""

    def decode(self, data: bytes) -> np.ndarray:
        """(T, N, 3) float32, in the source's order."""


class BoundBroken(Exception):
    """A codec decoded further from the source than it was allowed."""


def blocks(values: np.ndarray) -> Iterator[slice]:
    """Slices of the first axis, short enough for float64 copies to stay small."""
    length = max(1, BLOCK // values[0].size)
    return (slice(start, start + length) for start in range(0, len(values), length))


def largest_error(positions: np.ndarray, decoded: np.ndarray) -> float:
    """Largest Euclidean distance of any vertex in any frame; infinite where something is not a number."""
    largest = 0.0
    for block in blocks(positions):
        difference = decoded[block].astype(np.float64) - positions[block]
        distance = float(np.sqrt(np.einsum("...k,...k->...", difference, difference).max()))
        largest = max(largest, distance if distance >= 0 else np.inf)
    return largest


def check(codec: Codec, source: Source, bound: float) -> tuple[bytes, np.ndarray]:
    """Encodes and decodes. Raises BoundBroken where the result is beyond the bound, or not of the source's shape."""
    data = codec.encode(source, bound)
    decoded = codec.decode(data)
    if decoded.shape != source.positions.shape or decoded.dtype != np.float32:
        raise BoundBroken(f"{codec.name}: got {decoded.dtype} {decoded.shape}; "
                          f"expected float32 {source.positions.shape}")
    error = largest_error(source.positions, decoded)
    if not error <= bound:
        raise BoundBroken(f"{codec.name}: got an error of {error:.6g}; expected at most {bound:.6g}")
    return data, decoded
