"""Progress of an encoding as one fraction from 0 to 1, which is about the part of the time that has passed.

Each stage counts from 0 to 1; how much it weighs follows from the vertices and frames that it works on.
"""

from __future__ import annotations

from collections.abc import Callable

from athcodec.encoding.sample import is_small, sample_vertices

Progress = Callable[[str, float], None]

# Microseconds of one thread for a vertex in a frame; only their ratios matter.
SURVEY, TRIAL, MOTION = 0.11, 0.13, 0.24
TRIALS = {"fast": 7, "default": 31, "best": 50}  # Trials that a search takes as long as, by effort.
LAYER_TRIALS = {"fast": 3, "default": 24, "best": 10}  # Trials that layers of precision take in addition.
SMALL_TRIALS = 100  # Trials that a small clip takes in addition, whose choices are made again.
BRANCHES = 0.5  # Work of finding branches, over all other work.
SIZES = 6  # Files that are made to meet a target size.


def silent(stage: str, fraction: float) -> None:
    """Report to nobody."""


def expected_trials(effort: str, layered: bool, small: bool) -> int:
    """Return the number of trials that a search takes as long as."""
    return TRIALS[effort] + LAYER_TRIALS[effort] * layered + SMALL_TRIALS * small


class TrialCount:
    """Counts the trials of a search, and other work that takes as long, and reports them; expected: about how many."""

    def __init__(self, report: Progress = silent):
        self.expected, self._report, self._made = 1, report, 0

    def add(self, trials: int) -> None:
        """Report that so many more trials have been made."""
        self._made += trials
        self._report("search", min(self._made / self.expected, 0.99))

    def finish(self) -> None:
        """Report the end of the search."""
        self._report("search", 1.0)


class WeightedProgress:
    """Takes the fraction of each stage and reports that of the whole, which never falls."""

    def __init__(self, progress: Progress | None, weights: dict[str, float]):
        self._progress, self._reached = progress, 0.0
        total, before = sum(weights.values()) or 1.0, 0.0
        self._ranges = {}
        for stage, weight in weights.items():
            self._ranges[stage] = before / total, weight / total
            before += weight

    def __call__(self, stage: str, fraction: float) -> None:
        start, length = self._ranges.get(stage, (1.0, 0.0))
        self._reached = max(self._reached, min(start + length * fraction, 1.0))
        if self._progress is not None:
            self._progress(stage, self._reached)


def stage_weights(
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
    """Return the estimated work of each stage. samples: segments that a trial codes; branches: whether they have to be
    found; sizes: whether a target size is to be met; motion: whether motion is coded too."""
    longest, frames = max(stop - start for start, stop in segments), segments[-1][1]
    small = is_small(vertices, segments, effort)
    some = vertices if (part := sample_vertices(vertices, len(segments), effort)) is None else part
    work = {
        "survey": SURVEY * vertices * frames,
        "search": TRIAL * expected_trials(effort, layers > 1, small) * samples * some * longest,
        "motion": MOTION * (1 + layers) / 2 * vertices * frames,
    }
    before = {"branches": BRANCHES * sum(work.values())} if branches else {}
    tries = {"size": SIZES * (work["search"] + work["motion"])} if sizes else {}
    after = work if motion else {"survey": work["survey"], "search": work["search"]}
    return before | {"survey": after.pop("survey")} | tries | after
