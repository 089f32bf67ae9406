"""The numbers that the frames of a clip have in the tool that made it, for formats which count frames."""

from __future__ import annotations

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import stated_fps
from athcodec.motion.protocol import Motion
from athcodec.untyped import JsonMapping


def frame_rate_of(motion: Motion) -> float:
    """Return frames per second: what the clip's metadata state, else the median rate of its times."""
    return stated_fps(motion.metadata) or float(motion.fps)


def start_frame_of(metadata: JsonMapping) -> float:
    """Return the number of the frame at time 0, 0 where the metadata state no number."""
    stated = metadata.get("start_frame", 0)
    is_number = isinstance(stated, (int, float)) and not isinstance(stated, bool) and abs(stated) < 1e9
    return float(stated) if is_number else 0.0


def frame_numbers(motion: Motion) -> np.ndarray:
    """Return (T,) float64; whole where times fall on frames but for rounding. Those of a view are those of the clip."""
    return start_frame_of(motion.metadata) + np.round(np.asarray(motion.time) * frame_rate_of(motion), 6)


def distinct_frame_numbers(motion: Motion) -> np.ndarray:
    """Return the number of each frame in the tool that made the clip, for formats that find frames by these. Raise
    ClipError if two frames have the same number.
    """
    numbers = frame_numbers(motion)
    same = np.flatnonzero(np.diff(numbers) <= 0)
    if same.size:
        frame = int(same[0]) + 1
        raise ClipError(
            f"time: frame {frame} has the number {numbers[frame]:g} as the one before it, expected a larger one"
        )
    return numbers
