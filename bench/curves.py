"""Rate-distortion curves: the size at an error, and the mean saving of one codec against another.

The saving is that of Bjontegaard, "Calculation of average PSNR differences between RD-curves" (ITU-T
VCEG-M33, 2001): the mean difference of the logarithms of the rates over the range of errors that both curves
cover. His cubic fit through four points is replaced by straight lines between neighbouring points in log-log
coordinates: curves here span four decades, where cubics swing, and the integral of a straight line is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class Saving(NamedTuple):
    """Mean saving in per cent (positive: fewer bytes) over the errors from `low` to `high`."""

    percent: float
    low: float
    high: float


@dataclass(frozen=True)
class Curve:
    """Sizes by error, ascending; only points that no other point beats in both."""

    errors: np.ndarray
    sizes: np.ndarray

    @classmethod
    def of(cls, errors, sizes) -> Curve:
        """From points in any order; those with an error or a size of 0 have no logarithm and are left out."""
        kept: list[tuple[float, float]] = []
        for error, size in sorted(zip(errors, sizes, strict=True)):
            if error > 0 and size > 0 and (not kept or size < kept[-1][1]):
                kept.append((float(error), float(size)))
        return cls(np.array([error for error, _ in kept]), np.array([size for _, size in kept]))

    def __len__(self) -> int:
        return len(self.errors)

    def size_at(self, error: float) -> float | None:
        """The size at an error, on the straight line between its neighbours; None beyond the curve's ends."""
        if not len(self) or not self.errors[0] <= error <= self.errors[-1]:
            return None
        return float(np.exp(np.interp(np.log(error), np.log(self.errors), np.log(self.sizes))))

    def _mean_log_size(self, low: float, high: float) -> float:
        inside = self.errors[(self.errors > low) & (self.errors < high)]
        at = np.log(np.concatenate([[low], inside, [high]]))
        values = np.interp(at, np.log(self.errors), np.log(self.sizes))
        return float(((values[1:] + values[:-1]) / 2 * np.diff(at)).sum() / (at[-1] - at[0]))


def mean_saving(ours: Curve, theirs: Curve) -> Saving | None:
    """The saving of `ours` against `theirs`; None if the curves have no range of errors in common."""
    if len(ours) < 2 or len(theirs) < 2:
        return None
    low, high = max(ours.errors[0], theirs.errors[0]), min(ours.errors[-1], theirs.errors[-1])
    if not low < high:
        return None
    difference = ours._mean_log_size(low, high) - theirs._mean_log_size(low, high)
    return Saving(100 * (1 - float(np.exp(difference))), float(low), float(high))
