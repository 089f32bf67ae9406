"""A thread pool for the work on one clip: ranges of arrays, or items that arrive one after the other.

Neither how work is divided nor the order of results depends on the number of threads, so that a file does not either.
Only work that releases the GIL (the C core, NumPy on large arrays) gains by it.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

MOST = 4  # Threads by default.
RANGE_NUMBERS = 3 << 18  # Numbers of an array for each call of a thread.

Item = TypeVar("Item")
Result = TypeVar("Result")


def default_jobs() -> int:
    """Return the default number of threads: one per core, at most MOST."""
    return min(MOST, os.cpu_count() or 1)


class ThreadPool:
    """A pool of `jobs` threads; a single job runs on the caller's thread, unless `beside` asks for another one.

    Functions that the pool runs must not use the pool themselves.
    """

    def __init__(self, jobs: int = 1, beside: bool = False):
        self.jobs = jobs
        self._executor = ThreadPoolExecutor(jobs) if jobs > 1 or beside else None

    def map(self, function: Callable[..., Result], items: Sequence[tuple[object, ...]]) -> list[Result]:
        """Return the list of function(*item) for all items, in their order; threads share the calls."""
        if self._executor is None or len(items) < 2:
            return [function(*item) for item in items]
        started = [self._start(function, *item) for item in items]
        try:
            return [future.result() for future in started]
        finally:
            for future in started:
                future.cancel()

    def ordered(self, function: Callable[[Item], Result], items: Iterable[Item], ahead: int) -> Iterator[Result]:
        """Yield function(item) for all items, in their order. Up to `ahead` further items are read and started while
        one is waited for."""
        if self._executor is None:
            yield from map(function, items)
            return
        pending: deque[Future[Result]] = deque()
        for item in items:
            pending.append(self._start(function, item))
            if len(pending) > ahead:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()

    def _start(self, function: Callable[..., Result], *words: object) -> Future[Result]:
        """Start function(*words) on another thread and return its future. If no thread can be started, run it at once
        on the caller's thread."""
        if self._executor is not None:
            try:
                return self._executor.submit(function, *words)
            except RuntimeError:  # The call may be queued all the same, and run twice.
                self._executor.shutdown()
                self._executor = None
        done: Future[Result] = Future()
        try:
            done.set_result(function(*words))
        except Exception as error:
            done.set_exception(error)
        return done


SERIAL = ThreadPool()


def ranges(count: int, numbers: int) -> list[tuple[int, int]]:
    """Split 0 to count - 1 into (start, stop) for one call each; rows hold `numbers` numbers."""
    length = max(1, RANGE_NUMBERS // max(1, numbers))
    return [(start, min(start + length, count)) for start in range(0, count, length)]
