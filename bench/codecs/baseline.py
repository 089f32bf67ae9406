"""Common parts of the baselines: the search for the settings of the smallest encoding, and corrections.

A baseline writes and reads its lossy part; here its positions are decoded as a reader decodes them, and vertices whose
error exceeds the bound are corrected as in athcodec. So a baseline's step may be coarser than its worst vertex allows,
and step and corrections are searched together. Settings are searched one after the other, each along its ladder from
its current value in strides of two and then one, until a round changes nothing: a local search. Of large clips a part
is searched in one round, and then step and clusters with all vertices. A search ends early in a process whose processor
time is limited, with the best of what it has tried.
"""

from __future__ import annotations

import resource
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from athcodec.encoding.model import quantise
from bench.codecs import Source
from bench.codecs.coder import Reader, Writer, compiler, read_corrections, write_corrections
from bench.codecs.tree import VertexOrder, ordered

LARGE = 8_000_000  # numbers; larger clips are searched by a part of them
SEARCHED = 3_000  # vertices of that part
AGAIN = ("step", "clusters")  # Settings that are searched again with all vertices.
SEARCH_SHARE = 0.6  # Share of the process's processor time after which no search tries more.


@dataclass(frozen=True)
class Ladder:
    """Ordered numbers, over which the size is expected to have a single minimum."""

    values: tuple[float, ...]
    start: int

    @classmethod
    def geometric(cls, low: float, high: float, start: float, per_octave: int = 2) -> Ladder:
        count = round(np.log2(high / low) * per_octave)
        values = tuple(round(low * 2 ** (i / per_octave), 6) for i in range(count + 1))
        return cls(values, 0).starting_at(start)

    def starting_at(self, value: float) -> Ladder:
        """Return the ladder with the search starting at the number nearest to `value`."""
        return replace(self, start=int(np.argmin(np.abs(np.log(np.array(self.values) / value)))))


@dataclass(frozen=True)
class Choice:
    """Unordered names or numbers; all are tried."""

    values: tuple
    start: int = 0


@dataclass(frozen=True)
class Split(Choice):
    """A choice on which the best values of the others depend: the first round is made for each of its values."""


Settings = dict[str, float | int | str]


class _OutOfTime(Exception):
    """The process needs the rest of its processor time for the encoding."""


@dataclass
class Search:
    """Coordinate descent over named settings."""

    cost: Callable[[Settings], float]
    grid: dict[str, Ladder | Choice]
    known: dict[tuple[int, ...], float] = field(default_factory=dict)

    def settings(self, at: tuple[int, ...]) -> Settings:
        return {name: axis.values[i] for (name, axis), i in zip(self.grid.items(), at, strict=True)}

    def _cost(self, at: tuple[int, ...]) -> float:
        """Return the bytes at a point of the grid, measured once. Raises _OutOfTime."""
        if at not in self.known:
            limit = resource.getrlimit(resource.RLIMIT_CPU)[0]
            if self.known and 0 <= limit * SEARCH_SHARE < time.process_time():  # below 0: no limit
                raise _OutOfTime
            self.known[at] = self.cost(self.settings(at))
        return self.known[at]

    def run(self, rounds: int) -> Settings:
        """Return the best of all settings tried in at most `rounds` passes over all axes. Ends early where a pass
        changes nothing or where the time is up."""
        with suppress(_OutOfTime):
            self._run(rounds)
        return self.settings(min(self.known, key=self.known.get))

    def _run(self, rounds: int) -> None:
        splits = [range(len(axis.values)) if isinstance(axis, Split) else (axis.start,) for axis in self.grid.values()]
        best = min((self._round(first, True) for first in product(*splits)), key=self._cost)
        for _ in range(rounds - 1):
            before, best = best, self._round(best, False)
            if best == before:
                break

    def _round(self, best: tuple[int, ...], first: bool) -> tuple[int, ...]:
        """Search each axis of the grid of settings once, beginning at the point `best`, and return the best point
        found: the index of a value for each setting. If `first` is true, strides of two values are tried as well.
        """
        for axis, values in enumerate(self.grid.values()):
            if isinstance(values, Ladder):
                for stride in (2, 1) if first else (1,):
                    best = self._walk(best, axis, stride)
            elif not (first and isinstance(values, Split)):
                best = min((self._moved(best, axis, i) for i in range(len(values.values))), key=self._cost)
        return best

    def _walk(self, at: tuple[int, ...], axis: int, stride: int) -> tuple[int, ...]:
        """Move along one axis of the grid of settings in steps of `stride` values while the encoded bytes shrink, and
        return the point reached. `at` is the starting point: the index of a value for each setting.
        """
        last = len(list(self.grid.values())[axis].values) - 1
        for direction in (stride, -stride):
            start = at
            while 0 <= at[axis] + direction <= last:
                further = self._moved(at, axis, at[axis] + direction)
                if self._cost(further) >= self._cost(at):
                    break
                at = further
            if at != start:
                break
        return at

    @staticmethod
    def _moved(at: tuple[int, ...], axis: int, value: int) -> tuple[int, ...]:
        return *at[:axis], value, *at[axis + 1 :]


class Baseline(ABC):
    """A method of the literature."""

    kind = "baseline"
    name = ""
    rounds = 3  # Rounds of the search over all settings.

    def __init__(self) -> None:
        self.settings: Settings = {}

    def missing(self) -> str | None:
        return None if compiler() else "no C compiler: expected cc, gcc or clang, or its name in CC"

    @abstractmethod
    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        """Return the settings that are searched, in the order of the search."""

    @abstractmethod
    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        """Return the lossy part, in the order of vertices that is returned."""

    @abstractmethod
    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        """Return (N, 3, T) float64 positions of the lossy part, and their order."""

    def encode(self, source: Source, bound: float) -> bytes:
        self.settings = self._searched(source, bound)
        return self._trial(source, bound, self.settings)

    def _searched(self, source: Source, bound: float) -> Settings:
        """Search the codec's settings and return those of the smallest encoding that keeps the error bound, in scene
        units.
        """

        def search(source: Source, grid: dict[str, Ladder | Choice], rounds: int) -> Settings:
            return Search(lambda settings: len(self._trial(source, bound, settings)), grid).run(rounds)

        if source.positions.size <= LARGE:
            return search(source, self.grid(source, bound), self.rounds)
        part = source.part(SEARCHED)
        grid = self.grid(part, bound)
        best = search(part, grid, 1)
        near = {
            name: axis.starting_at(best[name]) if name in AGAIN else Choice((best[name],))
            for name, axis in grid.items()
        }
        return search(source, near, 1)

    def _trial(self, source: Source, bound: float, settings: Settings) -> bytes:
        writer = Writer()
        order = self.write(writer, source, bound, settings)
        lossy, _ = self.read(writer.echo())
        positions = np.ascontiguousarray(lossy, np.float32)
        limit = quantise.error_limit(bound, source.diagonal)
        return writer.data() + write_corrections(positions, ordered(source, order), limit)

    def decode(self, data: bytes) -> np.ndarray:
        """Return the float32 positions (T, N, 3), in the source's order of vertices, that `data` holds: the lossy
        motion with its corrections added.
        """
        reader = Reader(data)
        lossy, order = self.read(reader)
        positions = np.ascontiguousarray(lossy, np.float32)
        read_corrections(positions, reader)
        result = np.empty((positions.shape[2], len(positions), 3), np.float32)
        result[:, order.source] = positions.transpose(2, 0, 1)
        return result


def quantised(units: np.ndarray, dead_zone: float) -> np.ndarray:
    """Return integers of numbers in steps: 0 below the dead zone, with rounding biased towards 0 by the same amount."""
    magnitude = np.abs(units)
    magnitude += 1 - dead_zone
    np.floor(magnitude, out=magnitude)
    return np.copysign(magnitude, units).astype(np.int64)
