"""Play without an end: transitions between like frames of a clip, and the order in which a player takes them.

As in video textures (Schoedl et al. 2000): where two stretches of a clip are alike in position and velocity, one may go
over into the other. The clip's metadata name these places; a player that draws one at random whenever it comes to some
never plays the same order twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import MotionClip

if TYPE_CHECKING:
    pass

TRANSITIONS = "transitions"  # metadata: [leave, enter, frames] of each, frames numbered from the clip's first
MOST_STRETCH = 1.25  # of the largest second difference of the clip, that a transition may have
LENGTHS = (6, 12, 24, 48)  # frames of a transition, the shortest first
ENOUGH = 12  # transitions, for the shorter lengths to do
MOST = 48  # transitions that are kept
BITS = 19  # of coordinates that are compared, over their largest: the sums of VERTICES squares have less than 53
MOST_FRAMES = 3000  # that are compared with each other
TRIED = 1500  # pairs of frames that are looked at closely
VERTICES = 256  # that are compared
VELOCITY = 4.0  # frames: what a difference of velocities counts beside one of positions


class Transition(NamedTuple):
    """From frame `leave` on, for `frames` frames, a clip goes over into what begins at frame `enter`."""

    leave: int
    enter: int
    frames: int


def endless(clip: MotionClip) -> MotionClip:
    """The clip with transitions between its like frames, by which players play it without an end.

    Parameters
    ----------
    clip : MotionClip
        A single clip of some seconds in which the plant comes back to where it was, as in wind.

    Returns
    -------
    MotionClip
        Closing it closes `clip`.

    Raises
    ------
    ClipError
        Where it is several clips, or no two of its frames are alike enough.
    """
    if len(clip.clip_ranges) > 1:
        raise ClipError(f"endless: got {len(clip.clip_ranges)} clips in one, expected a single one")
    found = _found(_sampled(clip))
    if not found:
        raise ClipError("endless: got a clip without frames that are alike, expected a motion that comes back")
    return clip.replace(metadata=clip.metadata | {TRANSITIONS: [list(transition) for transition in found]})


def transitions_of(metadata: Mapping[str, Any], frame_count: int) -> list[Transition]:
    """Those that a clip's metadata name, by the frame that they leave at; empty where these are not such that a player
    comes to one from everywhere that they lead to."""
    given = metadata.get(TRANSITIONS)
    if not isinstance(given, list) or not given:
        return []
    for entry in given:
        whole = isinstance(entry, list) and len(entry) == 3 and all(type(number) is int for number in entry)
        if not whole or min(entry) < 0 or entry[2] < 1 or max(entry[:2]) + entry[2] >= frame_count:
            return []
    found = sorted(Transition(*entry) for entry in given)
    return found if all(enter + frames <= found[-1].leave for _, enter, frames in found) else []


# ---- finding ----


def _sampled(clip: MotionClip) -> np.ndarray:
    """(F, V, 3) float64: vertices spread over the plant, about their mean."""
    frames, step = min(clip.frame_count, MOST_FRAMES), -(-clip.vertex_count // VERTICES)
    runs = [clip.block(start, min(start + 64, frames))[:, ::step] for start in range(0, frames, 64)]
    sample = np.concatenate(runs).astype(np.float64)
    return sample - sample.mean(axis=0)


def _found(sample: np.ndarray) -> list[Transition]:
    """Transitions of the shortest length that there are enough of, else of the one that there are most of."""
    most = MOST_STRETCH * _jerk(sample)
    best: list[Transition] = []
    for length in LENGTHS:
        found = _of_length(sample, length, most)
        if len(found) > len(best):
            best = found
        if len(best) >= ENOUGH:
            break
    return best


def _jerk(positions: np.ndarray) -> float:
    """The largest second difference of any vertex."""
    if len(positions) < 3:
        return 0.0
    return float(np.linalg.norm(np.diff(positions, 2, axis=0), axis=-1).max())


def _of_length(sample: np.ndarray, length: int, most: float) -> list[Transition]:
    """Transitions whose second differences are at most `most`, the most alike first chosen, none beside another."""
    distance = _distances(sample, length)
    chosen: list[Transition] = []
    taken = np.zeros(distance.shape, bool)
    for flat in np.argsort(distance, axis=None, kind="stable")[: 20 * TRIED]:
        leave, enter = (int(number) for number in np.unravel_index(flat, distance.shape))
        if not np.isfinite(distance[leave, enter]) or taken[leave, enter]:
            continue
        near = (
            slice(max(0, leave - length // 2), leave + length // 2 + 1),
            slice(max(0, enter - length // 2), enter + length // 2 + 1),
        )
        taken[near] = True
        if _jerk(_over(sample, leave, enter, length)) <= most:
            chosen.append(Transition(leave, enter, length))
        if len(chosen) == MOST:
            break
    return _playable(chosen)


def _distances(sample: np.ndarray, length: int) -> np.ndarray:
    """(n, n): how far what follows a frame is, over a transition, from what follows another; infinite for those too
    near each other in time to be another motion."""
    count = len(sample) - length - 1
    if count < 1:
        return np.full((0, 0), np.inf)
    most = np.abs(sample).max(initial=0.0)
    flat = np.rint(sample.reshape(len(sample), -1) * (2**BITS / most if most > 0 else 1.0))
    whole = _squares(flat[:-1]) + VELOCITY**2 * _squares(np.diff(flat, axis=0))
    distance = sum(whole[k : k + count, k : k + count] for k in range(length + 1))
    place = np.arange(count)
    return np.where(np.abs(place[:, None] - place) < 2 * length, np.inf, distance)


def _squares(rows: np.ndarray) -> np.ndarray:
    """Squared distances of rows of integers, which are exact in whatever order BLAS adds them up."""
    lengths = (rows * rows).sum(axis=1)
    return np.maximum(lengths[:, None] + lengths - 2 * rows @ rows.T, 0)


def _over(sample: np.ndarray, leave: int, enter: int, length: int) -> np.ndarray:
    """Frames around a transition as they are played, from two before it to two behind it."""
    place = np.arange(-2, length + 3)
    share = np.clip(place / length, 0, 1)[:, None, None]
    weight = share * share * (3 - 2 * share)
    old, new = (sample[np.clip(start + place, 0, len(sample) - 1)] for start in (leave, enter))
    return old + (new - old) * weight


def _playable(chosen: Sequence[Transition]) -> list[Transition]:
    """Those that lead to a place before the last of them, so that a player comes to one for ever."""
    found = sorted(chosen)
    while found:
        kept = [each for each in found if each.enter + each.frames <= found[-1].leave]
        if len(kept) == len(found):
            break
        found = kept
    return found
