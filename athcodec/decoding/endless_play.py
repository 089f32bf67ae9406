"""Endless play of a clip, over the transitions that its metadata name."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from athcodec.motion.transitions import Transition
from athcodec.options import real, whole

Blended: TypeAlias = Callable[[Sequence[tuple[float, float]], int | None], np.ndarray]
LONGEST = 1e7  # Seconds that a play can last: 115 days.
TAKEN = 0.5  # Probability that a player takes the transition ahead.


class _Transition(NamedTuple):
    """A transition; its times are seconds since the clip's first frame."""

    leave: float
    enter: float
    lasts: float
    over: float  # Place in the clip at which the transition ends.


class EndlessPlay:
    """A clip that is played without an end; at each transition, chance decides whether it is taken.

    The same seed gives the same play. `Decoder.endless` returns one.
    """

    def __init__(self, time: np.ndarray, stored: Sequence[Transition], blended: Blended, seed: int):
        time = time - time[0]
        self._blended = blended
        self._transitions = [
            _Transition(time[a], time[b], min(time[a + n] - time[a], time[b + n] - time[b]), time[b + n])
            for a, b, n in stored
        ]
        self._state = (whole("seed", seed) * 2654435761 + 1) % 2**32 or 1
        self._begins = [0.0]  # Seconds of play at which each run of the clip begins.
        self._runs = [_Transition(0.0, 0.0, 0.0, 0.0)]  # The transition before each run.
        self._next = self._drawn(0.0)

    def places(self, seconds: float) -> list[tuple[float, float]]:
        """Return the places in the clip that are shown at a time.

        Parameters
        ----------
        seconds : float
            Time since the play began, 0 to 1e7.

        Returns
        -------
        list of tuple of float
            Seconds since the clip's first frame and weight, of one place or, within a transition, of two.
        """
        if not 0.0 <= (seconds := real("seconds", seconds)) <= LONGEST:
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
        weight = share * share * (3 - 2 * share)  # Smoothstep keeps velocities from jumping.
        both = [(way.leave + passed, 1 - weight), (way.enter + passed, weight)]
        return [place for place in both if place[1] > 0]

    def positions(self, seconds: float, level: int | None = None) -> np.ndarray:
        """Return the plant at a time, (N, 3) float32, scene units, blended along the branches within a transition.

        Parameters
        ----------
        seconds : float
            Time, as for `places`.
        level : int, optional
            Level of detail; by default the deepest that is complete.
        """
        return self._blended(self.places(seconds), level)

    def _drawn(self, seconds: float) -> _Transition:
        """Draw the transition that follows a place in the clip. All transitions end before the last of them leaves."""
        last = self._transitions[-1].leave
        ahead = sorted({way.leave for way in self._transitions if seconds <= way.leave < last})
        leave = next((place for place in ahead if self._random() < TAKEN), last)
        ways = [way for way in self._transitions if way.leave == leave]
        return ways[int(self._random() * len(ways))]

    def _random(self) -> float:
        """Return a number from 0 to 1 of a 32-bit xorshift (Marsaglia 2003), the same in all languages."""
        for shift in (13, -17, 5):
            self._state ^= (self._state << shift if shift > 0 else self._state >> -shift) & 0xFFFFFFFF
        return self._state / 2**32
