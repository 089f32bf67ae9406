"""Time bases learned from the tracks of a segment, which take the place of waves.

The principal components over time of a stage's tracks (Lengyel 1999) represent it in fewer rows than waves, at the
price of storing them. FORMAT.md, "Temporal basis stream" and "Basis in waves".
"""

from __future__ import annotations

from collections.abc import Sequence
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
KINDS_SAVING = 0.85  # Largest ratio of bits at which components of one kind of plants come before all others.
FEW_COMPONENTS = 0.8  # Components that one kind needs at fine steps, over those of all, up to which that is tried.
ROUNDING = 1e-11  # Of the energy of all tracks: above what is left of nothing by rounding.
FINEST_RATIO = 0.25  # Steps, over those of a layer, for which one kind has components of its own.


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


@dataclass(frozen=True)
class TrackMoments:
    """What tracks have in common over time: their second moments, (frames, frames) in units of their steps, and how
    many tracks there are."""

    moments: np.ndarray
    count: int


class TimeComponents:
    """Components over time, in descending order of what needs them, of the tracks of one kind of plants or of two.

    They are the principal components of all tracks or, if coefficients take fewer bits so, those of one kind and then
    those of what these leave of the other: among components of all, tracks that move alike need those of others, too.
    waves: (frames, frames).
    """

    def __init__(self, kinds: Sequence[TrackMoments], waves: np.ndarray, may_be_in_waves: bool = True):
        moments, self._count = np.sum([kind.moments for kind in kinds], axis=0), sum(kind.count for kind in kinds)
        values, vectors = principal(moments[None].copy())
        self._rows, self._energies = vectors[0], np.maximum(values[0], 0.0)
        self._tails = [(np.cumsum(self._energies[::-1]), self._count)]  # Energies of the last i + 1 components.
        self._waves, self._may_be_in_waves = waves, may_be_in_waves
        if len(kinds) > 1:
            self._tell_apart(kinds, moments)

    def _tell_apart(self, kinds: Sequence[TrackMoments], moments: np.ndarray) -> None:
        """Take the components of the kind that needs far fewer than all tracks do before those of the other, if that
        takes fewer bits. `moments`: those of all tracks."""
        own = [_needed(kind.moments, kind.count) for kind in kinds]
        first = int(np.argmin([len(rows) for rows in own]))
        if len(own[first]) > FEW_COMPONENTS * self._rank(1.0):
            return
        kind, other = kinds[first], kinds[1 - first]
        rows = np.concatenate([own[first], _needed(_without(other.moments, own[first]), other.count)])[: len(moments)]
        if _bits(rows, kinds) >= KINDS_SAVING * _bits(self._rows, kinds):
            return
        rest = moments + ROUNDING * float(np.trace(moments)) * np.eye(len(moments))  # Nothing that is known is left.
        others = principal(_without(rest, rows)[None])[1][0]
        rows = np.concatenate([rows, others[: len(moments) - len(rows)]])
        needs = np.array([_energies(rows, one.moments) / one.count for one in (kind, other)])
        order = np.argsort(-needs.max(axis=0), kind="stable")
        self._rows, self._energies = rows[order], _energies(rows[order], moments)
        self._tails = [(np.cumsum(one.count * need[order][::-1]), one.count) for need, one in zip(needs, (kind, other))]

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
        return max(_rank(tails, count, ratio) for tails, count in self._tails)

    @cached_property
    def _suits_waves(self) -> bool:
        """Whether the learned rows are stored in waves, because that is smaller or samples would be too coarse."""
        rank = max(self._rank(1.0), 1)
        is_coarse = MOST_SAMPLE * PRECISION < np.sqrt(self._energies.max())
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


def _rank(tails: np.ndarray, count: int, ratio: float) -> int:
    """Return how many components `count` tracks need where steps are `ratio` times as large as those that they were
    learned at. `tails`: the energies of the last i + 1 components, (frames,)."""
    allowed = TOLERANCE * ratio**2 * count * len(tails)
    return len(tails) - int(np.searchsorted(tails, allowed, side="right"))


def _needed(moments: np.ndarray, count: int) -> np.ndarray:
    """Return as many components as `count` tracks with these second moments need at fine steps, (rank, frames)."""
    values, rows = principal(moments[None].copy())
    return rows[0][: _rank(np.cumsum(np.maximum(values[0][::-1], 0.0)), count, FINEST_RATIO)]


def _without(moments: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the second moments of what tracks leave of the orthonormal rows `known`, (rank, frames)."""
    rest = np.eye(len(moments)) - multiply(known.T, known)
    return multiply(rest, multiply(moments, rest))


def _energies(rows: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """Return the energies of tracks with these second moments in each of some rows over time, (rank,)."""
    return np.maximum(np.diagonal(multiply(rows, multiply(moments, rows.T))), 0.0)


def _bits(rows: np.ndarray, kinds: Sequence[TrackMoments]) -> float:
    """Return about the bits of the coefficients of all tracks in some rows over time, whose steps are 1."""
    variances = ((kind.count, _energies(rows, kind.moments) / (kind.count * len(rows))) for kind in kinds)
    return sum(count / 2 * float(np.log2(1 + 12 * variance).sum()) for count, variance in variances)
