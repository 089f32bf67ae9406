"""Which frames, vertices or segments stand for all of them where a few are looked at."""

from __future__ import annotations

import numpy as np


def spread(count: int, most: int) -> list[int]:
    """Return at most `most` of the numbers 0 to count - 1, evenly spread from the first to the last."""
    return np.unique(np.linspace(0, count - 1, most).astype(int)).tolist()
