"""Which stages are levels of a file: each is better than the one before it, stays near the plant and moves as smoothly.

The others serve finer stages. Positions are vertex-major, (N, 3, T).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from athcodec._native import MEASURES
from athcodec.decoding.container import from_short_float, short_floats
from athcodec.encoding.model.motion import squared_bends
from athcodec.files.threads import ThreadPool, ranges
from athcodec.motion.algebra import length

MOST_AWAY = 0.1  # Largest distance of a vertex from the box of the source, in diagonals.
MOST_JERK = 1.95  # Largest second difference, over that of the source. Files promise 2.0, also after rounding.
NEAR = 2  # Frames on either side in which the source's second differences count.
ENDS = 2  # Frames of a segment that the second differences at its seams take.


@dataclass(frozen=True)
class SourceFrames:
    """What the stages of a segment are compared with.

    positions: (N, 3, T) of the source, coded frames. shown_times: how many frames of the clip show each. before: the
    last frames of the source before them, (N, 3, ENDS) or fewer; None: nothing is before them. box: (2, 3) low and high
    corner of the source in the coordinates of what is decoded.
    """

    positions: np.ndarray
    shown_times: np.ndarray
    before: np.ndarray | None
    box: np.ndarray
    bound: float
    pool: ThreadPool

    def last_shown(self, positions: np.ndarray) -> np.ndarray:
        """Return the last frames that are shown, (N, 3, ENDS) or fewer."""
        some = np.repeat(np.arange(-len(self.shown_times[-ENDS:]), 0), self.shown_times[-ENDS:])
        return positions[:, :, some[-ENDS:]]

    def flaws(self, decoded: np.ndarray, before: np.ndarray | None, away: float = np.inf) -> tuple[float, float]:
        """Return how far decoded positions leave the box, and their largest second difference over the source's, or
        over half the bound where that is larger. before: frames like those of the source. away: the largest error,
        which stands for the way out of the box if that is short enough."""
        if away > MOST_AWAY * length(self.box[1] - self.box[0]):
            low, high = decoded.min(axis=0).min(axis=1), decoded.max(axis=0).max(axis=1)
            away = max(0.0, float((self.box[0] - low).max()), float((high - self.box[1]).max()))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = self._bends(decoded, before) / self._allowed
        return away, float(np.nan_to_num(ratios, posinf=np.inf).max(initial=0.0))

    @cached_property
    def _allowed(self) -> np.ndarray:
        bends = np.pad(self._bends(self.positions, self.before), NEAR)
        count = len(bends) - 2 * NEAR
        windows = [bends[i : i + count] for i in range(2 * NEAR + 1)]
        return np.maximum(np.max(windows, axis=0), self.bound / 2)

    def _bends(self, positions: np.ndarray, before: np.ndarray | None) -> np.ndarray:
        """Return for each frame that has two neighbours the RMS over vertices of the second difference of positions
        there. `positions`: (N, 3, T); `before`: the last positions of the segment before, which the frames follow, or
        None.
        """
        shown = np.repeat(np.arange(len(self.shown_times)), self.shown_times)

        def squares(start: int, stop: int) -> np.ndarray:
            """Return the sums of squares, at each frame, over a range of vertices."""
            frames = positions[start:stop]
            frames = frames if len(shown) == frames.shape[2] else frames[:, :, shown]
            bends = squared_bends(frames)
            if before is None:
                return bends
            first = np.concatenate([before[start:stop], frames[:, :, :2]], axis=2)
            return np.concatenate([squared_bends(first), bends])

        return np.sqrt(sum(self.pool.map(squares, ranges(len(positions), 3 * len(shown)))) / len(positions))


def chosen_levels(
    errors: np.ndarray,
    clip_frames: Sequence[Sequence[int]],
    flaws: np.ndarray,
    diagonal: float,
    exact: bool,
    first_held: int,
) -> list[int]:
    """Return the numbers of the stages that become levels, ascending. They form a chain that ends with the last stage,
    in which neither the RMS nor the largest error of any clip grows from a stage to the next. Of all such chains it is
    the one with most stages that hold an error; of those the longest; and of those the one that begins with the
    coarsest stage.

    `errors`: (stages, segments, 3) by each of MEASURES; `clip_frames`: the frames of each segment of each clip of the
    file; `flaws`: (stages, segments, 2), as SourceFrames.flaws returns them; `diagonal`: in scene units; `exact`:
    whether the last stage is the source itself, which always follows the stage before; `first_held`: the first stage
    that ends a layer, from which on each stage holds an error.
    """

    def rank(chain: list[int]) -> tuple[int, int, int]:
        return sum(stage >= first_held for stage in chain), len(chain), -chain[0]

    stored = np.vectorize(from_short_float, otypes=[float])(short_floats(errors))
    measures = np.concatenate([_of_clips(table, clip_frames) for table in (errors, stored)], axis=1)
    limits = MOST_AWAY * diagonal, MOST_JERK
    last = len(errors) - 1 - exact
    chains: dict[int, list[int]] = {last: list(range(last, len(errors)))}
    for stage in range(last - 1, -1, -1):
        if (flaws[stage] <= limits).all():
            better = [chains[after] for after in chains if (measures[after] <= measures[stage]).all()]
            if better:
                chains[stage] = [stage, *max(better, key=rank)]
    return max(chains.values(), key=rank)


def _of_clips(errors: np.ndarray, clip_frames: Sequence[Sequence[int]]) -> np.ndarray:
    """Return the largest and the RMS error of each stage over all clips, and then in each clip, (stages, 2 + 2 *
    clips)."""
    stops = np.cumsum([len(frames) for frames in clip_frames])[:-1]
    parts = list(zip(np.split(errors, stops, axis=1), clip_frames))
    everything = errors, [frames for of_clip in clip_frames for frames in of_clip]
    return np.concatenate([_of_all(*part) for part in [everything, *parts]], axis=1)


def _of_all(errors: np.ndarray, frames: Sequence[int]) -> np.ndarray:
    """Return the largest and the RMS error of each stage over all segments, (stages, 2)."""
    largest, rms = errors[:, :, MEASURES.index("max")], errors[:, :, MEASURES.index("rms")]
    return np.stack([largest.max(axis=1), np.sqrt((rms**2 * np.asarray(frames)).sum(axis=1) / sum(frames))], axis=1)
