"""The parameters of the acceptance test TAM (Song, Yang and Peng 2011, section 3)."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

from athcodec.motion.units import Length, LengthLike, length_of
from athcodec.options import whole
from athcodec.untyped import JsonMapping

THRESHOLDS = "hierarchy_thresholds"  # Key of metadata.


@dataclass(frozen=True)
class Thresholds:
    """The parameters of the acceptance test TAM (Song, Yang and Peng 2011, section 3).

    Parameters
    ----------
    epsilon, xi : float, str or Length
        Scene units, or text such as "1mm", at least 0. A length with a unit is a Length until a clip's unit is known.
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
    >>> athcodec.Thresholds(epsilon=0.01, eta=3, xi="2cm", lam=8).eta
    3
    """

    epsilon: LengthLike
    eta: int
    xi: LengthLike
    lam: int

    def __post_init__(self) -> None:
        for name in ("epsilon", "xi"):
            length = length_of(getattr(self, name), f"threshold {name}")
            self._set(name, length if length.unit else length.value, length.value)
        for name in ("eta", "lam"):
            number = whole(f"threshold {name}", getattr(self, name))
            self._set(name, number, number)

    def _set(self, name: str, value: Length | float, number: float) -> None:
        if not number >= 0:
            raise ValueError(f"threshold {name}: got {value}, expected a number >= 0")
        object.__setattr__(self, name, value)

    def in_scene_units(self, scene_unit: object) -> Thresholds:
        """Return the thresholds with lengths as numbers in the units of a clip, as `Length.in_scene_units` takes it.
        Raises BoundError."""
        epsilon, xi = self._distances(scene_unit)
        return replace(self, epsilon=epsilon, xi=xi)

    @property
    def distances(self) -> tuple[float, float]:
        """Epsilon and xi as numbers, scene units. Raises BoundError for a length with a unit: see `in_scene_units`."""
        return self._distances(None)

    def _distances(self, scene_unit: object) -> tuple[float, float]:
        return length_of(self.epsilon).in_scene_units(scene_unit), length_of(self.xi).in_scene_units(scene_unit)

    @property
    def in_metadata(self) -> dict[str, float]:
        """The entry in a file's metadata under THRESHOLDS; JSON has no infinity."""
        epsilon, xi = (min(distance, sys.float_info.max) for distance in self.distances)
        return {"epsilon": epsilon, "xi": xi, "eta": self.eta, "lambda": self.lam}

    @classmethod
    def of_metadata(cls, metadata: JsonMapping) -> Thresholds | None:
        """Return the thresholds in a file's metadata, or None if there are none, or no numbers."""
        try:
            kept = metadata[THRESHOLDS]
            return cls(kept["epsilon"], kept["eta"], kept["xi"], kept["lambda"])
        except (KeyError, TypeError, ValueError):
            return None
