"""The numbers that the frames of a clip have in the tool that made it, for formats which count frames."""

from __future__ import annotations

from typing import Any

import numpy as np


def frame_rate_of(motion: Any) -> float:
    """Frames per second: what the clip's metadata say, else the median rate of its times."""
    said = motion.metadata.get("fps")
    is_number = isinstance(said, (int, float)) and not isinstance(said, bool) and 0 < said < float("inf")
    return float(said) if is_number else float(motion.fps)


def start_frame_of(motion: Any) -> float:
    """The number of the frame at time 0, 0 where the clip does not say."""
    said = motion.metadata.get("start_frame", 0)
    is_number = isinstance(said, (int, float)) and not isinstance(said, bool) and abs(said) < 1e9
    return float(said) if is_number else 0.0


def frame_numbers(motion: Any) -> np.ndarray:
    """(T,) float64; whole where times fall on frames but for rounding. Those of a view are those of the clip."""
    return start_frame_of(motion) + np.round(np.asarray(motion.time) * frame_rate_of(motion), 6)
