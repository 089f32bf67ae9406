"""Rate-distortion curves: the size at an error, between those that were measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Curve:
    """Sizes by error, ascending; only points that no other point beats in both."""

    errors: np.ndarray
    sizes: np.ndarray

    @classmethod
    def of(cls, errors, sizes) -> Curve:
        """Return a curve through points in any order. Points with an error or a size of 0 have no logarithm and are
        left out."""
        kept: list[tuple[float, float]] = []
        for error, size in sorted(zip(errors, sizes, strict=True)):
            if error > 0 and size > 0 and (not kept or size < kept[-1][1]):
                kept.append((float(error), float(size)))
        return cls(np.array([error for error, _ in kept]), np.array([size for _, size in kept]))

    def __len__(self) -> int:
        return len(self.errors)

    def size_at(self, error: float) -> float | None:
        """Return the size at an error, on the straight line between its neighbours; None beyond the curve's ends."""
        if not len(self) or not self.errors[0] <= error <= self.errors[-1]:
            return None
        return float(np.exp(np.interp(np.log(error), np.log(self.errors), np.log(self.sizes))))
