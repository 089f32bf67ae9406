"""Runs cases in a separate process, so that crashes, hangs and excessive memory are detected.

A class of cases is a list of arguments and a function that raises Wrong for a wrong result.
"""

from __future__ import annotations

import multiprocessing
import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bench.memory import peak_bytes
from spec.robust import Row

HANG_SECONDS = 120.0
POLL_SECONDS = 0.2
FREE_MEMORY = 64 << 20
"""Allowed growth of a process besides that of a case: caches of the allocator, modules imported late."""


class Wrong(Exception):
    """The result of a case is wrong."""


@dataclass(frozen=True)
class Cases:
    """Inputs of one class. attempt(data, argument) -> bytes of memory that the case may take."""

    name: str
    files: dict[str, bytes]
    arguments: Sequence[tuple[str, object]]
    """(name of a file, argument of attempt)"""
    attempt: Callable[[bytes, object], int]
    few: bool = False
    """Whether all are tried, regardless of time."""


def run(cases: Cases, seconds: float, hang: float = HANG_SECONDS) -> Row:
    """Run as many cases as `seconds` allow, in a fixed random order, in a separate process. A case that takes more than
    `hang` seconds counts as hanging. Return the numbers of cases and faults as a row.
    """
    order = list(range(len(cases.arguments)))
    random.Random(0).shuffle(order)
    counts = dict.fromkeys(("crashes", "hangs", "over_limit", "wrong"), 0)
    first, done, deadline = "", 0, time.monotonic() + (float("inf") if cases.few else seconds)
    while done < len(order) and (time.monotonic() < deadline or done == 0):
        done, outcome, message = _until_a_fault(cases, order, done, deadline, hang)
        if outcome:
            counts[outcome] += 1
            first = first or f"{outcome}: {message}"
    note = f"of {len(order):,}" if done < len(order) else "all"
    return Row(cases.name, done, **counts, note=f"{note}; {first}" if first else note)


def _until_a_fault(cases: Cases, order: list[int], start: int, deadline: float, hang: float) -> tuple[int, str, str]:
    """Run cases in a new process, beginning with number `start` of `order`, until one fails, all are done or `deadline`
    has passed. Return three results: the next number, the kind of the fault ("" for none), and a message.
    """
    context = multiprocessing.get_context("spawn")
    at, messages = context.Value("q", start), context.SimpleQueue()
    process = context.Process(target=_work, args=(cases, order, start, deadline, at, messages), daemon=True)
    process.start()
    seen, since = start, time.monotonic()
    while process.is_alive() and messages.empty():
        process.join(POLL_SECONDS)
        if at.value != seen:
            seen, since = at.value, time.monotonic()
        if time.monotonic() - since > hang:
            process.kill()
            process.join()
            return at.value + 1, "hangs", str(cases.arguments[order[at.value]])
    if messages.empty():
        process.join()
    if messages.empty():
        return at.value + 1, "crashes", f"{cases.arguments[order[at.value]]} ended the process: {process.exitcode}"
    done, outcome, message = messages.get()
    process.join()
    return done, outcome, message


def _work(cases: Cases, order: list[int], start: int, deadline: float, at, messages) -> None:
    """Run cases in the separate process until one fails, all are done or `deadline` has passed. `at` shares the number
    of the running case, and `messages` gets the outcome.
    """
    for place in range(start, len(order)):
        if place > start and time.monotonic() > deadline:
            messages.put((place, "", ""))
            return
        at.value = place
        name, argument = cases.arguments[order[place]]
        before = peak_bytes()
        try:
            allowed = cases.attempt(cases.files[name], argument)
        except MemoryError as error:
            messages.put((place + 1, "over_limit", f"{name} {argument}: {error!r}"))
            return
        except BaseException as error:  # pytest.fail does not raise an Exception
            messages.put((place + 1, "wrong", f"{name} {argument}: {error!r}"))
            return
        if peak_bytes() - before > allowed + FREE_MEMORY:
            messages.put((place + 1, "over_limit", f"{name} {argument}: {peak_bytes() - before} bytes"))
            return
    messages.put((len(order), "", ""))
