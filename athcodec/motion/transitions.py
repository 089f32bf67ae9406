"""Endless play: transitions between like frames of a clip, and the order in which a player takes them.

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

TRANSITIONS = "transitions"  # Key of metadata: [leave, enter, frames] of each, in frames from the clip's first.
MOST_STRETCH = 1.25  # Largest second difference of a transition, over that of the clip.
LENGTHS = (6, 12, 24, 48)  # Frames of a transition, the shortest first.
ENOUGH = 12  # Transitions at which longer ones are not tried.
MOST = 48  # Transitions that are kept.
BITS = 19  # Integer range of compared coordinates, so that sums of VERTICES squares have less than 53 bits.
MOST_FRAMES = 3000  # Vertices that are compared with each other.
TRIED = 1500  # Pairs of frames that are examined closely.
VERTICES = 256  # Frames that are compared.
VELOCITY = 4.0  # Frames: weight of a difference of velocities beside one of positions.


class Transition(NamedTuple):
    """A transition for `frames` frames from frame `leave` on into the frames from `enter` on."""

    leave: int
    enter: int
    frames: int


def endless(clip: MotionClip) -> MotionClip:
    """Return the clip with transitions between its like frames, by which players play it without an end.

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
        If it is several clips, or no two of its frames are alike enough.

    Examples
    --------
    >>> sway = 0.1 * np.sin(np.arange(90) / 5)[:, None, None] * np.ones((1, 20, 3))
    >>> sway[..., 1] = np.linspace(0, 2, 20)
    >>> clip = athcodec.MotionClip(sway, np.arange(90) / 30, vertex_branch=[0] * 20, branch_parent=[-1])
    >>> "transitions" in athcodec.endless(clip).metadata
    True
    """
    if len(clip.clip_ranges) > 1:
        raise ClipError(f"endless: got {len(clip.clip_ranges)} clips in one, expected a single one")
    transitions = _alike(_sampled(clip))
    if not transitions:
        raise ClipError("endless: got a clip without frames that are alike, expected a motion that comes back")
    return clip.replace(metadata=clip.metadata | {TRANSITIONS: [list(transition) for transition in transitions]})


def transitions_of(metadata: Mapping[str, Any], frame_count: int) -> list[Transition]:
    """Return the transitions that a clip's metadata name, by the frame that they leave at; none if a player cannot
    reach one from every place that they lead to."""
    entries = metadata.get(TRANSITIONS)
    if not isinstance(entries, list) or not entries:
        return []
    for entry in entries:
        whole = isinstance(entry, list) and len(entry) == 3 and all(type(number) is int for number in entry)
        if not whole or min(entry) < 0 or entry[2] < 1 or max(entry[:2]) + entry[2] >= frame_count:
            return []
    transitions = sorted(Transition(*entry) for entry in entries)
    return transitions if all(enter + frames <= transitions[-1].leave for _, enter, frames in transitions) else []


# ---- finding ----


def _sampled(clip: MotionClip) -> np.ndarray:
    """Return vertices spread over the plant, about their mean, (F, V, 3) float64."""
    frames, step = min(clip.frame_count, MOST_FRAMES), -(-clip.vertex_count // VERTICES)
    runs = [clip.block(start, min(start + 64, frames))[:, ::step] for start in range(0, frames, 64)]
    sample = np.concatenate(runs).astype(np.float64)
    return sample - sample.mean(axis=0)


def _alike(sample: np.ndarray) -> list[Transition]:
    """Return transitions of the shortest length that there are enough of, else of the length that there are most of."""
    most = MOST_STRETCH * _jerk(sample)
    best: list[Transition] = []
    for length in LENGTHS:
        transitions = _of_length(sample, length, most)
        if len(transitions) > len(best):
            best = transitions
        if len(best) >= ENOUGH:
            break
    return best


def _jerk(positions: np.ndarray) -> float:
    """Return the largest second difference of any vertex."""
    if len(positions) < 3:
        return 0.0
    return float(np.linalg.norm(np.diff(positions, 2, axis=0), axis=-1).max())


def _of_length(sample: np.ndarray, length: int, most: float) -> list[Transition]:
    """Return transitions whose second differences are at most `most`, the most alike first, none beside another."""
    distance = _distances(sample, length)
    chosen: list[Transition] = []
    occupied = np.zeros(distance.shape, bool)
    for flat in np.argsort(distance, axis=None, kind="stable")[: 20 * TRIED]:
        leave, enter = (int(number) for number in np.unravel_index(flat, distance.shape))
        if not np.isfinite(distance[leave, enter]) or occupied[leave, enter]:
            continue
        near = (
            slice(max(0, leave - length // 2), leave + length // 2 + 1),
            slice(max(0, enter - length // 2), enter + length // 2 + 1),
        )
        occupied[near] = True
        if _jerk(_over(sample, leave, enter, length)) <= most:
            chosen.append(Transition(leave, enter, length))
        if len(chosen) == MOST:
            break
    return _playable(chosen)


def _distances(sample: np.ndarray, length: int) -> np.ndarray:
    """Return how far the frames after one differ from those after another, over a transition, (n, n); infinite for
    frames too close in time to be another motion."""
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
    """Return squared distances of rows of integers, which are exact in whatever order BLAS adds them up."""
    lengths = (rows * rows).sum(axis=1)
    return np.maximum(lengths[:, None] + lengths - 2 * rows @ rows.T, 0)


def _over(sample: np.ndarray, leave: int, enter: int, length: int) -> np.ndarray:
    """Return frames around a transition as they are played, from two before it to two behind it."""
    place = np.arange(-2, length + 3)
    share = np.clip(place / length, 0, 1)[:, None, None]
    weight = share * share * (3 - 2 * share)
    old, new = (sample[np.clip(start + place, 0, len(sample) - 1)] for start in (leave, enter))
    return old + (new - old) * weight


def _playable(chosen: Sequence[Transition]) -> list[Transition]:
    """Return the transitions that lead to a place before the last of them, so that a player always comes to another."""
    transitions = sorted(chosen)
    while transitions:
        kept = [each for each in transitions if each.enter + each.frames <= transitions[-1].leave]
        if len(kept) == len(transitions):
            break
        transitions = kept
    return transitions
