"""The options of a file beside its bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from athcodec.encoding.options.features import Feature
from athcodec.encoding.options.shape import RestPrecision
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.units import LengthLike
from athcodec.options import DEFAULT_LADDER, EFFORTS, MAX_SEGMENT, MIN_SEGMENT, SMOOTHNESS, ladder_of, set_numbers


@dataclass(frozen=True)
class EncodingOptions:
    """The options of `encode` that are not the bound, checked. Raises ValueError."""

    segment_frames: int | None = None  # Longest segment, as split_segments takes it.
    tam: Thresholds | None = None
    exact_rest: bool = False
    host_rest: bool = False
    rest_precision: RestPrecision = RestPrecision()
    lossless: bool = False
    weights: str | np.ndarray | None = None
    attributes: str = "all"
    effort: str = "default"
    smoothness: str = "default"
    jobs: int | None = None
    ladder: tuple[float, ...] = ()  # Largest errors over the diagonal, descending; (): a single layer.
    predicted_frames: int = MAX_SEGMENT  # Longest segment of predicted motion.
    without: frozenset[Feature] = frozenset()  # Features that the file does without.

    @classmethod
    def of(
        cls,
        *,
        segment_frames: int | None = None,
        ladder: str | Sequence[float] = DEFAULT_LADDER,
        rest_error: LengthLike | None = None,
        **options: Any,
    ) -> EncodingOptions:
        """Return checked options; ladder, rest_error: as `ladder_of` and `RestPrecision.of` take them.
        segment_frames: limits the segments of predicted motion, too."""
        if segment_frames is not None:
            options |= {"segment_frames": segment_frames, "predicted_frames": segment_frames}
        return cls(ladder=ladder_of(ladder), rest_precision=RestPrecision.of(rest_error), **options)

    @property
    def keeps_rest(self) -> bool:
        """Whether the clip's rest pose comes back bit for bit, and so is what motion is coded about."""
        return self.exact_rest or self.host_rest

    def __post_init__(self) -> None:
        """Check the options, and raise ValueError for a value that is not among those expected."""
        set_numbers(self, wholes=("segment_frames", "jobs", "predicted_frames"))
        if self.segment_frames is not None and not MIN_SEGMENT <= self.segment_frames <= MAX_SEGMENT:
            raise ValueError(f"segment_frames: got {self.segment_frames}; expected {MIN_SEGMENT} to {MAX_SEGMENT}")
        if self.exact_rest and self.host_rest:
            raise ValueError("host_rest: got exact_rest too; expected one of them")
        if self.attributes not in ("all", "none"):
            raise ValueError(f"attributes: got {self.attributes!r}; expected 'all' or 'none'")
        if self.jobs is not None and self.jobs < 1:
            raise ValueError(f"jobs: got {self.jobs}; expected at least 1")
        if self.effort not in EFFORTS:
            raise ValueError(f"effort: got {self.effort!r}; expected one of {', '.join(EFFORTS)}")
        if self.smoothness not in SMOOTHNESS:
            raise ValueError(f"smoothness: got {self.smoothness!r}; expected one of {', '.join(SMOOTHNESS)}")
