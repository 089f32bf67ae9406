"""The parameters of the acceptance test TAM (Song, Yang and Peng 2011, section 3)."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from athcodec.options import set_numbers

THRESHOLDS = "hierarchy_thresholds"  # Key of metadata.


@dataclass(frozen=True)
class Thresholds:
    """The parameters of the acceptance test TAM (Song, Yang and Peng 2011, section 3).

    Parameters
    ----------
    epsilon, xi : float
        Scene units, at least 0.
    eta : int
        Frames, at least 0.
    lam : int
        Vertices, at least 0 (lambda in the paper).

    Raises
    ------
    ValueError
        For a negative threshold.

    Examples
    --------
    >>> athcodec.Thresholds(epsilon=0.01, eta=3, xi=0.02, lam=8).eta
    3
    """

    epsilon: float
    eta: int
    xi: float
    lam: int

    def __post_init__(self) -> None:
        set_numbers(self, reals=("epsilon", "xi"), wholes=("eta", "lam"))
        for name in ("epsilon", "eta", "xi", "lam"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"threshold {name}: got {getattr(self, name)}, expected a number >= 0")

    @property
    def in_metadata(self) -> dict[str, float]:
        """The entry in a file's metadata under THRESHOLDS; JSON has no infinity."""
        most = sys.float_info.max
        return {"epsilon": min(self.epsilon, most), "xi": min(self.xi, most), "eta": self.eta, "lambda": self.lam}

    @classmethod
    def of_metadata(cls, metadata: Mapping[str, Any]) -> Thresholds | None:
        """Return the thresholds in a file's metadata, or None if there are none, or no numbers."""
        try:
            kept = metadata[THRESHOLDS]
            return cls(kept["epsilon"], kept["eta"], kept["xi"], kept["lambda"])
        except (KeyError, TypeError, ValueError):
            return None
