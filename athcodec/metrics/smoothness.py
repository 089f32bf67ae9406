"""How smooth decoded motion is over frames: its second differences, those of its error, and jumps at seams."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, nan, sqrt

import numpy as np

from athcodec.metrics.blocks import Meter
from athcodec.options import real, whole

NEAR_SEAM = 2
"""Frames on either side of a seam that count as near it."""


class SmoothnessMeter(Meter):
    """Accumulates second differences over frames: of the source, of what is decoded, and of the error between them.

    The second difference at frame t is x(t - 1) - 2 x(t) + x(t + 1), in length per frame squared; clips whose frames
    are not evenly spaced in time are taken as if they were. The first and the last frame have one in loops only.

    Parameters
    ----------
    frame_count : int
        Number of frames that will be added, T.
    bound : float or (N,) array, optional
        The error bound, of all vertices or of each, in which the figures of the error are given.
    starts : sequence of int, optional
        The first frame of each segment; where two of them meet is a seam.
    loop : bool, optional
        Whether the first frame follows the last, which is a seam too.

    Attributes
    ----------
    source_acceleration, acceleration, error_acceleration : (T,) arrays
        At each frame the RMS over vertices of the second difference, in the unit of the positions: of the source, as
        decoded, of the error. NaN where there is none.
    share : (T,) array
        At each frame the share of vertices whose error's second difference is above the bound.
    max_error_acceleration : float
        Largest second difference of the error of any vertex in any frame, in bounds.
    worst_frame, worst_vertex : int
        Where that is.
    """

    def __init__(
        self, frame_count: int, bound: float | np.ndarray = 1.0, starts: Sequence[int] = (), loop: bool = False
    ) -> None:
        """Begin to measure `frame_count` frames. `bound` is the error bound, or one for each vertex, `starts` has the
        first frames of segments, and `loop` tells whether the first frame follows the last.
        """
        frame_count = whole("frame_count", frame_count)
        self.seams = [start for start in (whole("starts", start) for start in starts) if start > 0] + [0] * loop
        self.source_acceleration, self.acceleration, self.error_acceleration, self.share = np.full(
            (4, frame_count), nan
        )
        self.max_error_acceleration = 0.0
        self.worst_frame = self.worst_vertex = 0
        self._bound, self._loop = np.asarray(bound, np.float64), loop
        self._square = 0.0
        self._points = self._added = 0
        # The last frames of source and decoded positions, two at most.
        self._first = self._last = np.empty((2, 0, 0, 3))

    def _add(self, reference: np.ndarray, decoded: np.ndarray) -> None:
        """Add source and decoded frames (k, N, 3), which follow those added before. The frames around each are needed,
        so two are kept for the next call. Raise ValueError if there are too many frames.
        """
        both = np.stack([reference, decoded])
        if self._added + both.shape[1] > len(self.acceleration):
            raise ValueError(f"frames: got more than {len(self.acceleration)}, expected so many")
        if not self._added:
            self._first = self._last = both[:, :0]
        first_known = self._added - self._last.shape[1] + 1
        near = np.concatenate([self._last, both], axis=1)
        self._measure(first_known, near)
        self._first = np.concatenate([self._first, both[:, :2]], axis=1)[:, :2]
        self._last = near[:, -2:]
        self._added += both.shape[1]
        if self._loop and self._added == len(self.acceleration) > 1:
            around = np.concatenate([self._last, self._first], axis=1)
            self._measure(self._added - 1, around)

    def _measure(self, first: int, frames: np.ndarray) -> None:
        """Measure all frames but the first and the last of a block (2, k, N, 3): source and decoded positions. `first`
        is the number of the first frame that is measured.
        """
        if frames.shape[1] < 3:
            return
        source, decoded = second_differences(frames, axis=1)
        with np.errstate(invalid="ignore"):
            error = decoded - source
        rows = np.arange(first, first + error.shape[0]) % len(self.acceleration)
        for series, values in (
            (self.source_acceleration, source),
            (self.acceleration, decoded),
            (self.error_acceleration, error),
        ):
            series[rows] = np.sqrt(_squares(values).mean(axis=1))
        lengths = np.sqrt(_squares(error))
        bound = np.broadcast_to(self._bound, lengths.shape)
        in_bounds = np.divide(lengths, bound, out=np.where(lengths > 0, np.inf, 0.0), where=bound > 0)
        self.share[rows] = (in_bounds > 1).mean(axis=1)
        frame, vertex = np.unravel_index(in_bounds.argmax(), in_bounds.shape)
        if in_bounds[frame, vertex] > self.max_error_acceleration:
            self.max_error_acceleration = float(in_bounds[frame, vertex])
            self.worst_frame, self.worst_vertex = int(rows[frame]), int(vertex)
        self._square += float((in_bounds**2).sum())
        self._points += in_bounds.size

    @property
    def rms_error_acceleration(self) -> float:
        """Root mean square over vertices and frames of the second difference of the error, in bounds."""
        return sqrt(self._square / self._points) if self._points else 0.0

    @property
    def worst_share(self) -> float:
        """`share` in the frame where it is largest; 0 without second differences."""
        return float(np.nanmax(self.share)) if self._points else 0.0

    @property
    def median_share(self) -> float:
        """`share` in the median frame; 0 without second differences."""
        return float(np.nanmedian(self.share)) if self._points else 0.0

    def jerks(self, bound: float) -> np.ndarray:
        """Return at each frame the decoded acceleration over the source's largest within `NEAR_SEAM` frames, or over
        half the bound of the file if that is larger, (T,); at most 2 at a file's levels, but for predicted motion."""
        frames, series = np.arange(len(self.acceleration)), np.nan_to_num(self.source_acceleration)
        near = frames[:, None] + np.arange(-NEAR_SEAM, NEAR_SEAM + 1)
        near = near % len(frames) if self._loop else near.clip(0, len(frames) - 1)
        allowed = np.maximum(series[near].max(axis=1), 0.5 * real("bound", bound))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(self.acceleration / allowed, posinf=inf)

    @property
    def tick_ratio(self) -> float | None:
        """Frames near seams, see `tick_ratio`."""
        return tick_ratio(self.acceleration, self.seams)

    @property
    def source_tick_ratio(self) -> float | None:
        """`tick_ratio` of the source itself in the same frames, which may jerk as well."""
        return tick_ratio(self.source_acceleration, self.seams)


def second_differences(frames: np.ndarray, axis: int = 0) -> np.ndarray:
    """Return x(t - 1) - 2 x(t) + x(t + 1) along an axis, which gets shorter by two."""
    with np.errstate(invalid="ignore"):
        return np.diff(frames, 2, axis=axis)


def tick_ratio(acceleration: np.ndarray, seams: Sequence[int]) -> float | None:
    """Return how much more a motion jerks at its seams than usually: the largest acceleration near a seam over the
    median.

    Parameters
    ----------
    acceleration : (T,) array
        RMS over vertices of the second difference at each frame, NaN where there is none.
    seams : sequence of int
        The frames that begin behind a seam; 0 is the seam of a loop. Near are two frames on either side.

    Returns
    -------
    float or None
        None if no seam has a second difference near it. If the motion stands still at the median frame, infinite, or 0
        if it stands still near seams, too.
    """
    near = (np.asarray(seams, int)[:, None] + np.arange(-NEAR_SEAM, NEAR_SEAM)).ravel()
    loops = 0 in seams
    count = len(acceleration)
    near = near % count if loops else near[(near >= 0) & (near < count)]
    values = acceleration[near]
    if np.isnan(values).all():
        return None
    worst, median = float(np.nanmax(values)), float(np.nanmedian(acceleration))
    return worst / median if 0 < median < inf else inf if worst else 0.0


def _squares(vectors: np.ndarray) -> np.ndarray:
    """Return squared lengths of (..., 3) vectors, infinite for vectors with NaN."""
    squares = np.einsum("...i,...i->...", vectors, vectors)
    squares[np.isnan(squares)] = inf
    return squares
