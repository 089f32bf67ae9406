"""Several clips of a file, or several times of one, blended along the branches."""

from __future__ import annotations

import threading
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from athcodec.decoding import core_file
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.file_tables import Clip


class Share(NamedTuple):
    """A clip at a time in seconds and at a level, with the weight that it has in a blend."""

    clip: Clip
    seconds: float
    level: int
    weight: float


class Blending:
    """Blends of one file; the segments that a blend needed stay prepared for the next one."""

    def __init__(self, file: AthFile):
        self._file = file
        self._lock = threading.Lock()
        self._prepared: dict[tuple[int, int], core_file.Segment] = {}  # By (segment, level).

    def positions(self, shares: Sequence[Share]) -> np.ndarray:
        """Return the positions (N, 3) float32 of up to four clips of the file, each at its own time, blended by weight
        along the branches."""
        file = self._file
        with self._lock:
            before, self._prepared = self._prepared, {}
        ready: dict[tuple[int, int], core_file.Segment] = {}
        blended = []
        for clip, seconds, level, weight in shares:
            frame = file.core.frame_at(file.clips.index(clip), seconds)
            first, starts = int(frame), file.tables.segment_starts(clip)
            after = first + 1 if first + 1 < starts[-1] else starts[0]
            segments = {
                clip.first_segment + bisect_right(starts, place) - 1
                for place in ([first, after] if frame > first else [first])
            }
            for segment in segments:
                place = segment, level
                ready[place] = ready.get(place) or before.get(place) or file.segments.prepare(*place)
            blended.append(([ready[segment, level] for segment in segments], frame, weight))
        with self._lock:
            self._prepared = ready
        return file.core.blended(blended)
