"""Counted work of an encoding: what it may take, and how far it has come, as one fraction from 0 to 1.

Work is counted, not timed, so that the same file comes out on every machine. Each phase counts from 0 to 1; how much it
weighs follows from the vertices and frames that it works on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock

from athcodec.encoding.search.sample import is_small, sample_vertices

Progress = Callable[[str, float], None]

# Microseconds of a thread, measured on clips of many kinds.
READING = 0.2  # For a vertex in a frame that is read; formats differ.
POSES = 20  # For a vertex whose poses are compared before anything is tried.
SURVEY = 0.11  # For a vertex in a frame of the survey.
MOTION = 0.24  # For a vertex in a frame of a layer that is coded.
ANALYSIS = 0.06  # For a vertex in a frame that is transformed for a trial.
PREDICTION = 0.24  # For a vertex in a frame that is predicted for a trial.
MAPS = 0.005  # For a vertex in a frame at a stage whose maps are tried.
TURNS = 0.008  # For the same where stems turn with what carries them.
TRIAL = 1900  # For a trial, however small.
BYTE = 0.18  # For a byte of a stream that is tried.
FILE_BYTE = 2.0  # For a byte of a file that is coded.
CORRECTION = 3.3  # For a correction.
MAP_FIT = 1.7  # For a vertex to which the maps of a stage are fitted in a few frames.
STAGE_MOTION = 0.1  # For a vertex in a frame at a stage of the hierarchy of a file.
START = 25  # For a vertex of which the settings that a search starts with are found.
POSE = 0.8  # For a vertex of a rest pose that is coded.
REST = 6  # For a vertex of a rest pose that is chosen.
PIECE = 0.05  # For the square of the vertices of a piece of a rest pose that is coded.
BASIS = 0.09  # For a vertex in a frame of components over time.
COMPONENT = 0.0002  # For a vertex in a pair of frames of components over time.
EIGENVECTOR = 0.0013  # For three frames, each any of a segment, of which a stage's components over time are made.
FINDING = 60  # For a vertex whose branch is sought by motion.
BRANCH_SHARE = 0.45  # Largest share of all work that finding branches takes.
LEARNT = 4  # For a vertex from which modes are learned.
LEARNING = 0.15  # For a vertex in a frame from which modes are learned.
LEAST_WORK = 3e6  # Microseconds that an encoding may take.
WORK = 8.0  # Microseconds that it may take besides for each vertex in a frame.
EFFORTS = {"fast": math.inf, "default": 1.0, "best": 8.0}  # Factors on it.

TRIALS = {"fast": 7, "default": 31, "best": 50}  # Trials that a search is expected to take as long as, by effort.
LAYER_TRIALS = {"fast": 3, "default": 24, "best": 10}  # Trials that layers of precision take in addition.
SMALL_TRIALS = 100  # Trials that a small clip takes in addition, whose choices are made again.
BRANCHES = 0.5  # Work of finding branches, over all other work.
SIZES = 6  # Files that are made to meet a target size.


def silent(phase: str, fraction: float) -> None:
    """Ignore a report of progress."""


def allowed_work(vertices: int, frames: int, effort: str) -> float:
    """Return the work that an encoding may take."""
    return EFFORTS[effort] * (LEAST_WORK + WORK * vertices * frames)


def expected_trials(effort: str, layered: bool, small: bool) -> int:
    """Return about how many trials take as long as the whole search does."""
    return TRIALS[effort] + LAYER_TRIALS[effort] * layered + SMALL_TRIALS * small


class Work:
    """Counts the work of deciding about a file, and reports it.

    Sums are of whole numbers, so that they do not depend on the order in which threads add to them. allowed: work
    beyond which nothing more is tried; expected: work at the end of the search; untried: choices left out.
    """

    def __init__(self, allowed: float = math.inf, report: Progress = silent, phase: str = "search"):
        self.allowed, self.expected, self.done = allowed, 0.0, 0
        self.untried: dict[str, None] = {}
        self._report, self._phase, self._choice, self._lock = report, phase, "", Lock()

    def add(self, work: float) -> None:
        """Add work to what was done, in the unit of `allowed`."""
        with self._lock:
            self.done += int(work)

    @property
    def left(self) -> float:
        """Work that is still allowed; below 0 if more was done."""
        return self.allowed - self.done

    def fits(self, work: float) -> bool:
        """Return whether so much more work is allowed; else the choice that is tried counts as left out."""
        if self.done + work <= self.allowed:
            return True
        if self._choice:
            self.untried[self._choice] = None
        return False

    @contextmanager
    def trying(self, choice: str, share: float = 1.0, most: float = math.inf) -> Iterator[None]:
        """Return a context in which the choice that is tried is reported by its name, and may take at most `share` of
        the work left, and no more than `most`.
        """
        before = self._choice, self.allowed
        allowed = self.done + min(share * max(0.0, self.left), most)
        self._choice, self.allowed = choice, min(self.allowed, allowed)
        try:
            self.report()
            yield
        finally:
            self._choice, self.allowed = before

    def report(self) -> None:
        """Report what is tried, and how far the search has come."""
        words = f"{self._phase}: {self._choice}" if self._choice not in ("", self._phase) else self._phase
        self._report(words, min(self.done / self.expected, 0.99) if self.expected else 0.0)

    def finish(self) -> None:
        """Report the end of the search."""
        self._report(self._phase, 1.0)


class WeightedProgress:
    """Takes the fraction of each phase and reports that of the whole, which never falls. A phase may be followed by a
    colon and what it does."""

    def __init__(self, progress: Progress | None, weights: dict[str, float]):
        self._progress, self._reached = progress, 0.0
        total, before = sum(weights.values()) or 1.0, 0.0
        self._ranges = {}
        for phase, weight in weights.items():
            self._ranges[phase] = before / total, weight / total
            before += weight

    def __call__(self, phase: str, fraction: float) -> None:
        start, length = self._ranges.get(phase.partition(":")[0], (1.0, 0.0))
        self._reached = max(self._reached, min(start + length * fraction, 1.0))
        if self._progress is not None:
            self._progress(phase, self._reached)


def phase_weights(
    vertices: int,
    segments: list[tuple[int, int]],
    effort: str,
    *,
    samples: int,
    branches: bool,
    sizes: bool,
    motion: bool,
    layers: int,
) -> dict[str, float]:
    """Return the estimated work of each phase of an encoding, as {phase: work}. `samples`: how many segments a trial
    codes; `branches`: whether branches have to be found; `sizes`: whether a target size is to be met; `motion`: whether
    segments are coded, too; `layers`: the number of layers.
    """
    longest, frames = max(stop - start for start, stop in segments), segments[-1][1]
    small = is_small(vertices, segments, effort)
    some = vertices if (part := sample_vertices(vertices, len(segments), longest, effort)) is None else part
    trial = (ANALYSIS + TURNS) * samples * some * longest
    work = {
        "survey": SURVEY * vertices * frames,
        "search": min(expected_trials(effort, layers > 1, small) * trial, allowed_work(vertices, frames, effort)),
        "motion": MOTION * (1 + layers) / 2 * vertices * frames,
    }
    before = {"branches": BRANCHES * sum(work.values())} if branches else {}
    tries = {"size": SIZES * (work["search"] + work["motion"])} if sizes else {}
    after = work if motion else {"survey": work["survey"], "search": work["search"]}
    return before | {"survey": after.pop("survey")} | tries | after
