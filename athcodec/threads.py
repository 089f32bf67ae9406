"""Threads that share the work on one clip: parts of arrays, or things that come one after the other.

What is shared out does not depend on how many they are, nor does the order in which results come back, so that neither
shows in a file. Only work that lets go of the interpreter (the C core, NumPy on large arrays) gains by it.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

MOST = 4  # threads where nobody says how many
RANGE_NUMBERS = 3 << 18  # of an array that one thread takes at a time


def default_jobs() -> int:
    """Threads where nobody says how many: one per core, at most MOST."""
    return min(MOST, os.cpu_count() or 1)


class ThreadPool:
    """So many threads; with one there are none but the caller's, unless there is to be one `beside` it. What they are
    given must not call on the pool itself."""

    def __init__(self, jobs: int = 1, beside: bool = False):
        self.jobs = jobs
        self._executor = ThreadPoolExecutor(jobs) if jobs > 1 or beside else None

    def map(self, function: Callable[..., Any], items: Sequence[tuple]) -> list:
        """What function(*item) gives for each, in order."""
        if self._executor is None or len(items) < 2:
            return [function(*item) for item in items]
        return list(self._executor.map(lambda item: function(*item), items))

    def ordered(self, function: Callable[[Any], Any], items: Iterable, ahead: int) -> Iterator:
        """What function(item) gives for each, in order; meanwhile up to `ahead` further items are taken and begun."""
        if self._executor is None:
            yield from map(function, items)
            return
        pending: deque[Future] = deque()
        for item in items:
            pending.append(self._executor.submit(function, item))
            if len(pending) > ahead:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()


SERIAL = ThreadPool()


def ranges(count: int, numbers: int) -> list[tuple[int, int]]:
    """Runs (start, stop) of 0 to count - 1, whose rows hold so many numbers, for one thread each."""
    length = max(1, RANGE_NUMBERS // max(1, numbers))
    return [(start, min(start + length, count)) for start in range(0, count, length)]
