"""Parts that all meters share: blocks of a few frames, and figures of more values than fit into memory."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

import numpy as np

from athcodec.options import real

SLICE_VALUES = 1 << 20
_SHIFT = 15  # bits of a float32 that a bin leaves away: 256 bins for each power of two


def paired(reference: np.ndarray, decoded: np.ndarray, values: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield pairs of frames of a reference and a decoded block (k, N, 3), in float64, as many frames at once as
    SLICE_VALUES numbers allow. `values` is how many numbers a meter needs for each frame.

    Raise ValueError if the shapes differ.
    """
    reference, decoded = np.asarray(reference), np.asarray(decoded)
    if reference.shape != decoded.shape or reference.ndim != 3 or reference.shape[2] != 3:
        shapes = f"{reference.shape} and {decoded.shape}"
        raise ValueError(f"blocks: got shapes {shapes}, expected two equal ones (k, N, 3)")
    length = max(1, SLICE_VALUES // max(1, reference.shape[1] * 3, values))
    for start in range(0, len(reference), length):
        part = slice(start, start + length)
        yield reference[part].astype(np.float64), decoded[part].astype(np.float64)


class Meter:
    """Accumulates what it measures, block by block."""

    _values = 0
    """How many numbers a frame makes of itself, where that is more than its positions."""

    def add(self, reference: np.ndarray, decoded: np.ndarray) -> None:
        """Add the next frames.

        Parameters
        ----------
        reference, decoded : (k, N, 3) float arrays

        Raises
        ------
        ValueError
            Where their shapes differ, or there are more frames than the meter expects.
        """
        for pair in paired(reference, decoded, self._values):
            self._add(*pair)

    def _add(self, reference: np.ndarray, decoded: np.ndarray) -> None:
        raise NotImplementedError


class Spread:
    """Root mean square and quantiles of values from 0 on, of which there may be any number; NaN counts as infinite.

    Quantiles are at most 0.4 % too large: values are counted in bins, 256 for each power of two, as float32.

    Attributes
    ----------
    count : int
        Number of values.
    """

    def __init__(self) -> None:
        self.count = 0
        self._square = 0.0
        self._bins = np.zeros(1 << (32 - _SHIFT - 1), np.int64)

    def add(self, values: np.ndarray) -> None:
        """Add values, an array of any shape."""
        values = np.where(np.isnan(values), np.inf, values).ravel()
        self.count += values.size
        self._square += float(values @ values)
        with np.errstate(over="ignore"):
            bins = np.ascontiguousarray(values, np.float32).view(np.uint32) >> _SHIFT
        self._bins += np.bincount(bins, minlength=len(self._bins))

    @property
    def rms(self) -> float:
        """Root mean square; 0 of no values."""
        return sqrt(self._square / self.count) if self.count else 0.0

    def quantile(self, fraction: float) -> float:
        """Return the value that this fraction of all do not exceed, at most 0.4 % too large; 0 of no values."""
        if not self.count:
            return 0.0
        place = np.searchsorted(np.cumsum(self._bins), np.ceil(real("fraction", fraction) * self.count))
        infinite = np.float32(np.inf).view(np.uint32) >> _SHIFT
        end = place if place in (0, infinite) else place + 1
        return float(np.array(end << _SHIFT, np.uint32).view(np.float32))
