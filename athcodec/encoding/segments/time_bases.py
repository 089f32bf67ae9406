"""Time bases learned from the tracks of a segment, which take the place of waves.

The principal components over time of a stage's tracks (Lengyel 1999) represent it in fewer rows than waves, at the
price of storing them. FORMAT.md, "Temporal basis stream" and "Basis in waves".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from athcodec._native import address, lib
from athcodec.decoding.container import BASIS_AS_SAMPLES, BASIS_IN_WAVES
from athcodec.encoding.model.quantise import half_octaves
from athcodec.encoding.streams import streams
from athcodec.motion.algebra import multiply, principal

MOST_SAMPLE = 8192  # Integer that stands for 1.
PRECISION = 0.6  # Step of a row's integers, over the step at which they err as much as all tracks in the row.
LEAST_STEP = -200  # Smallest step of a row, in half octaves (FORMAT.md, Basis in waves).
MOST_STEP = 0  # Largest step of a row, in half octaves (FORMAT.md, Basis in waves).
TOLERANCE = 5e-4  # Mean square, in squared steps, that a basis may leave out.


@dataclass(frozen=True)
class Entries:
    """Rows of a learned basis as samples, (rank, frames) int32."""

    kind = BASIS_AS_SAMPLES
    integers: np.ndarray

    @cached_property
    def rows(self) -> np.ndarray:
        """The rows with a decoder's bits, (rank, frames) float64."""
        return self.integers / MOST_SAMPLE

    def stream(self, known: int = 0) -> bytes:
        """Return the stream of all rows but the first `known`."""
        return streams.encode_temporal(self.integers[known:])


@dataclass(frozen=True)
class InWaves:
    """Rows of a learned basis in waves, (frames, frames): integers, (rank, frames) int32, and the steps of the rows in
    half octaves, (rank,) int32."""

    kind = BASIS_IN_WAVES
    waves: np.ndarray
    exponents: np.ndarray
    integers: np.ndarray

    @cached_property
    def rows(self) -> np.ndarray:
        """Return the rows of the time basis, (rank, frames) float64, with the very bits that a decoder computes."""
        rank, frames = self.integers.shape
        rows = np.empty((rank, frames))
        lib.ath_add_basis_rows(
            self.waves.ctypes.data,
            frames,
            0,
            rank,
            address(self.exponents, np.int32, rank),
            address(self.integers, np.int32, rows.size),
            rows.ctypes.data,
        )
        return rows

    def stream(self, known: int = 0) -> bytes:
        """Return the stream of all rows but the first `known`."""
        return streams.encode_basis(self.exponents[known:], self.integers[known:])


class TimeComponents:
    """Principal components over time, in descending order, of `count` tracks.

    moments: (frames, frames) second moments of the tracks in units of their steps; waves: (frames, frames).
    """

    def __init__(self, moments: np.ndarray, count: int, waves: np.ndarray, may_be_in_waves: bool = True):
        values, vectors = principal(moments[None])
        self._energies = np.maximum(values[0], 0.0)
        self._left_out = np.cumsum(self._energies[::-1])  # Energies of the last i + 1 components.
        self._rows, self._waves = vectors[0], waves
        self._count, self._may_be_in_waves = count, may_be_in_waves

    def basis(self, ratio: float = 1.0, precision: float = 1.0, least: int = 0) -> Entries | InWaves | None:
        """Return the rows that tracks in steps `ratio` times as large need, at least so many; None: no basis is smaller
        than waves. precision: how many times as large the steps are that the rows are precise enough for."""
        rank = max(self._rank(ratio), least)
        if self._count <= 1 or not 1 <= rank < len(self._rows):
            return None
        return self._in_waves(rank, precision) if self._suits_waves else self._entries(rank)

    def _rank(self, ratio: float) -> int:
        """Return how many components are worth storing where steps are `ratio` times as large as those that they were
        learned at."""
        frames = len(self._rows)
        allowed = TOLERANCE * ratio**2 * self._count * frames
        return frames - int(np.searchsorted(self._left_out, allowed, side="right"))

    @cached_property
    def _suits_waves(self) -> bool:
        """Whether the learned rows are stored in waves, because that is smaller or samples would be too coarse."""
        rank = max(self._rank(1.0), 1)
        is_coarse = MOST_SAMPLE * PRECISION < np.sqrt(self._energies[0])
        in_waves, entries = self._in_waves(rank, 1.0), self._entries(rank)
        return self._may_be_in_waves and (is_coarse or len(in_waves.stream()) < len(entries.stream()))

    def _entries(self, rank: int) -> Entries:
        return Entries(np.rint(self._rows[:rank] * MOST_SAMPLE).astype(np.int32))

    def _in_waves(self, rank: int, precision: float) -> InWaves:
        step = PRECISION * precision / np.sqrt(np.maximum(self._energies[:rank], 1e-30))
        exponents = np.clip(np.floor(2.0 * np.log2(step)), LEAST_STEP, MOST_STEP).astype(np.int32)
        parts = multiply(self._rows[:rank], self._waves.T)
        integers = np.clip(np.rint(parts / half_octaves(exponents)[:, None]), -(2**30), 2**30)
        return InWaves(self._waves, exponents, integers.astype(np.int32))
