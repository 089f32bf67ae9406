"""Play without an end, over the transitions that a clip's metadata name."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from athcodec.motion.transitions import transitions_of
from athcodec.options import whole

if TYPE_CHECKING:
    from athcodec.decoding.decoder import Decoder

LONGEST = 1e7  # Seconds that a play can last: 115 days.
TAKEN = 0.5  # Probability that a player takes a transition it comes to.


class _Way(NamedTuple):
    """A transition in seconds since the clip's first frame."""

    leave: float
    enter: float
    lasts: float
    over: float  # where the clip is when it is over


class EndlessPlay:
    """A clip that is played without an end: at each of its transitions chance decides whether it is taken.

    The same seed gives the same play. Made by `Decoder.endless`.
    """

    def __init__(self, decoder: Decoder, seed: int = 1):
        time = decoder.time - decoder.time[0]
        found = transitions_of(decoder.metadata, decoder.frame_count)
        if not found:
            raise ValueError(f"clip {decoder.clip.name!r}: got no transitions, expected some, of encode --endless")
        self._decoder = decoder
        self._ways = [
            _Way(time[a], time[b], min(time[a + n] - time[a], time[b + n] - time[b]), time[b + n]) for a, b, n in found
        ]
        self._state = (whole("seed", seed) * 2654435761 + 1) % 2**32 or 1
        self._begins = [0.0]  # when each run of the clip begins
        self._runs = [_Way(0.0, 0.0, 0.0, 0.0)]  # what led to it
        self._next = self._drawn(0.0)

    def places(self, seconds: float) -> list[tuple[float, float]]:
        """Where in the clip a time is.

        Parameters
        ----------
        seconds : float
            Since the play began, 0 to 1e7.

        Returns
        -------
        list of tuple of float
            Seconds since the clip's first frame and weight, of one place or, within a transition, of two.
        """
        if not 0.0 <= seconds <= LONGEST:
            raise ValueError(f"seconds: got {seconds}, expected 0 to {LONGEST:g}")
        while (begins := self._begins[-1] + self._next.leave - self._runs[-1].enter) <= seconds:
            self._begins.append(begins)
            self._runs.append(self._next)
            self._next = self._drawn(self._next.over)
        run = bisect_right(self._begins, seconds) - 1
        passed, way = seconds - self._begins[run], self._runs[run]
        if passed >= way.lasts:
            return [(way.enter + passed, 1.0)]
        share = passed / way.lasts
        weight = share * share * (3 - 2 * share)  # smoothstep: velocities do not jump
        both = [(way.leave + passed, 1 - weight), (way.enter + passed, weight)]
        return [place for place in both if place[1] > 0]

    def positions(self, seconds: float, level: int | None = None) -> np.ndarray:
        """(N, 3) float32, scene units: the plant at a time, within a transition blended along the branches.

        Parameters
        ----------
        seconds : float
            As for `places`.
        level : int, optional
            Level of detail; by default the deepest that is complete.

        Raises
        ------
        LevelUnavailable, FormatError
            As for `Decoder.positions`.
        """
        return self._decoder.blended_places(self.places(seconds), level)

    def _drawn(self, seconds: float) -> _Way:
        """The way that is taken after this place in the clip. All ways are over before the last of them leaves."""
        last = self._ways[-1].leave
        ahead = sorted({way.leave for way in self._ways if seconds <= way.leave < last})
        leave = next((place for place in ahead if self._random() < TAKEN), last)
        same = [way for way in self._ways if way.leave == leave]
        return same[int(self._random() * len(same))]

    def _random(self) -> float:
        """0 to 1, of a 32-bit xorshift (Marsaglia 2003), the same in all languages."""
        for shift in (13, -17, 5):
            self._state ^= (self._state << shift if shift > 0 else self._state >> -shift) & 0xFFFFFFFF
        return self._state / 2**32
