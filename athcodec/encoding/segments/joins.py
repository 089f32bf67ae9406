"""Joins: what makes a decoded segment go on where the one before it ends (FORMAT.md, "Joins").

A segment is coded on its own; where two meet, their errors have nothing to do with each other, and plants would tick.
The decoder moves the first frames of the later one by what is left of the jump, and the encoder chooses over how many.
Positions are vertex-major, (N, 3, T), as decoded, not corrected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np

from athcodec.encoding.model.motion import squared_bends
from athcodec.files.threads import ranges

END_FRAMES = 2  # Last frames of a segment that a join starts from.
WIDTHS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64, 96)  # Frames that a join moves.
SLOPED = 128  # Added to the width of a join that joins slopes too.
TURN = 0.5**0.5  # Part of a join at which the share of a slope stops falling faster.
SEEN = 1 << 12  # About how many vertices joins are chosen by.
# Shares, in 32nds, of a correction in the last frame that reach the last four frames, by its width.
END_FOOTPRINTS = {2: (5, 16, 27, 32), 1: (0, 0, 16, 32)}
AXES = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1], [1, 1, 1]])
NO_CORRECTIONS = np.empty((0, 6), np.int32)
# Ticks are changes of velocity at a seam over those of a usual frame.
SMOOTH = 1.2  # Largest tick that nobody sees.
ROUGH = 1.4  # Tick from which on each more weighs ROUGH_WORTH.
ROUGH_WORTH = 30.0  # Cost, in ticks, of a tick beyond ROUGH.
STILL = 0.05  # Least change of velocity in a usual frame, over the source's: a stage that stands still must not jump.
ERROR_WORTH = 8.0  # Cost, in ticks, of an error twice as large.
ORDER_WORTH = 400.0  # Cost, in ticks, of an error twice as large as that of the stage before.
LARGEST_WORTH = 40.0  # Cost, in ticks, of a largest error twice that of the stage before: slopes can throw a part far.
BYTES_WORTH = 40.0  # Cost, in ticks, of twice as many bytes.
CORRECTION_BYTES = 0.3  # Bytes of each position beyond the limit: a correction reaches over frames.


@dataclass(frozen=True)
class End:
    """The end of a segment, from which a stage of the next one goes on.

    positions, source: (N, 3, END_FRAMES), decoded and wanted. usual: the change of velocity in a usual frame.
    corrections: (K, 6) in the last frame, which stand in the first frame of the next segment as well. shown: the last
    frames as shown, and as the source has them less the origin. Of a segment that is too short only these are known.
    """

    positions: np.ndarray
    source: np.ndarray
    usual: float
    corrections: np.ndarray
    shown: tuple[np.ndarray, np.ndarray]

    def of(self, some: slice) -> End:
        """Return the end with some of its vertices alone, in the arrays by which a join is chosen and made."""
        return replace(self, positions=self.positions[some], source=self.source[some])


def end_of(
    positions: np.ndarray, source: np.ndarray, shown: tuple[np.ndarray, np.ndarray], corrections: np.ndarray
) -> End:
    """Return the end of a stage, whose positions are not corrected. source: (N, 3, END_FRAMES) or fewer."""
    if positions.shape[2] <= END_FRAMES:
        return End(np.empty((len(positions), 3, 0)), source[:, :, :0], 0.0, corrections, shown)
    last = positions[:, :, -END_FRAMES:].copy()
    if np.array_equal(last, shown[0]):  # Then memory holds them once.
        shown = last, shown[1]
    return End(last, source, _usual(_changes(positions[seen(len(positions))])), corrections, shown)


def end_corrections(away: np.ndarray, limit: float | np.ndarray, step: float, frame: int) -> np.ndarray:
    """Return corrections of a segment's last frame, (K, 6) rows (vertex, frame, x, y, z, width), for those vertices
    that are beyond their limits in the last two frames. Each moves along as few axes as it can. A vertex that none of
    the tried corrections brings within its limit in all four frames gets no row.

    `away`: (N, 3, 4) decoded less source positions of the last four frames; `limit`: one length or (N,); `step`: the
    length of 1 in a correction; `frame`: the number of the last frame.
    """
    limits = np.broadcast_to(limit, len(away))
    vertices = np.flatnonzero((_squares(away[:, :, -2:]) > limits[:, None] ** 2).any(axis=1))
    away, limits = away[vertices], limits[vertices]
    whole = np.rint(-away[:, :, -1] / step)
    whole = np.where(whole == 0, np.where(away[:, :, -1] < 0, 1, -1), whole)
    rows, done = np.zeros((len(vertices), 6), np.int32), np.zeros(len(vertices), bool)
    rows[:, 0], rows[:, 1] = vertices, frame
    for axes, (width, parts), shorter in product(AXES, END_FOOTPRINTS.items(), (0, 1)):
        tried = axes * (whole - shorter * np.sign(whole))
        left = away + tried[:, :, None] * (step * np.array(parts) / 32)
        good = ~done & (_squares(left) <= limits[:, None] ** 2).all(axis=1)
        rows[good, 2:5], rows[good, 5] = tried[good], width
        done |= good
    return rows[done]


def _ways(end: End, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the jump of each vertex from the end of a segment to the positions after it, and the change of its slope,
    (N, 3) float64 each."""
    start, last = (end.positions[:, :, i].astype(np.float64) for i in range(END_FRAMES))
    first, second = (positions[:, :, i].astype(np.float64) for i in range(2))
    return 0.5 * (3.0 * (last - first) - (start - second)), (last - start) - (second - first)


@cache
def _shares(join: int) -> tuple[np.ndarray, np.ndarray]:
    """Return by which share of the jump, and of the change of slope, a join moves each of its frames, (width,) each."""
    width, is_sloped = join % SLOPED, join >= SLOPED
    u = (np.arange(width) + 0.5) / width if width else np.empty(0)
    left = 1.0 - u
    jumps = np.where(u < 0.5, 1.0 - 2.0 * u * u, 2.0 * left * left)
    slopes = width * np.where(u < TURN, u - (0.5 + TURN) * u * u, (0.5 + TURN) * left * left)
    return jumps, slopes if is_sloped else np.zeros(width)


@cache
def _bends_of(join: int) -> list[np.ndarray]:
    """Return the second differences of both shares, from the last frame before the seam on."""
    return [np.diff(np.pad(share, 2), 2) for share in _shares(join)]


def apply_join(end: End, positions: np.ndarray, join: int) -> None:
    """Join the positions in place, as a decoder does, bit for bit unless maps of nodes make them."""
    jumps, slopes = _shares(join)
    for part in (slice(*some) for some in ranges(len(positions), 3 * len(jumps))):
        moved, (jump, slope) = positions[part, :, : len(jumps)], _ways(end.of(part), positions[part])
        moved[:] = moved + (jump[:, :, None] * jumps + slope[:, :, None] * slopes)


class ErrorPrice:
    """Cost, in ticks, of a larger error of a stage without corrections. rms: the stage's error over so many frames;
    most_rms: the error of the stage before."""

    def __init__(self, rms: float, most_rms: float, frames: int):
        self._rms, self._most_rms, self._frames = rms, most_rms, frames

    def __call__(self, before: np.ndarray, after: np.ndarray) -> float:
        """Return the cost of squared errors in some frames, (N, frames), that become others."""
        if self._rms == 0:
            return 0.0
        more = float(after.sum() - before.sum()) / (len(before) * self._frames)
        rms = max(self._rms**2 + more, 0.0) ** 0.5
        beyond = max(0.0, rms / self._most_rms - 1.0) if self._most_rms > 0 else 0.0
        return ERROR_WORTH * max(0.0, rms / self._rms - 1.0) + ORDER_WORTH * beyond


class CorrectionPrice:
    """Cost, in ticks, of correcting positions beyond a limit, one or (N,); bytes_: of those vertices, up to the
    stage."""

    def __init__(self, limit: float | np.ndarray, bytes_: float):
        self._squared_limit, self._bytes = np.reshape(np.square(limit), (-1, 1)), bytes_

    def __call__(self, before: np.ndarray, after: np.ndarray) -> float:
        """Return the cost, like ErrorPrice."""
        known, now = ((squares > self._squared_limit).sum(dtype=int) for squares in (before, after))
        return BYTES_WORTH * max(0.0, CORRECTION_BYTES * (now - known) / self._bytes)


class _Moved:
    """Squared lengths of vectors in some frames, or their means, that move by shares of two ways, (N, 3) each. vectors:
    returns those of a part of the N, (n, 3, frames), so that few are in memory at a time."""

    def __init__(
        self, vectors: Callable[[slice], np.ndarray], jump: np.ndarray, slope: np.ndarray, are_means: bool = False
    ):
        """Measure the vectors that `vectors` returns for a slice of the vertices, and how far they point along the ways
        `jump` and `slope`, (N, 3) each. `are_means`: keep the means over all vertices, and not the numbers of each.
        """
        rows: list[list[np.ndarray]] = []
        for part in _parts(len(jump), max(WIDTHS)):
            of_part, ways = vectors(part), (jump[part], slope[part])
            numbers = [_squares(of_part), *((of_part * way[:, :, None]).sum(axis=1) for way in ways)]
            rows.append([each.sum(axis=0, keepdims=True) for each in numbers] if are_means else numbers)
        self.squares, *self._along = (np.concatenate(each) for each in zip(*rows))
        self._ways = [(a * b).sum(axis=1, keepdims=True) for a, b in ((jump, jump), (jump, slope), (slope, slope))]
        if are_means:
            self.squares, *self._along = (each.sum(axis=0) / len(jump) for each in (self.squares, *self._along))
            self._ways = [each.mean(axis=0) for each in self._ways]

    def by(self, jumps: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """Return the squared lengths in the first frames after the move, (N, width)."""
        width, (jump2, both, slope2) = len(jumps), self._ways
        of_jump, of_slope = (along[..., :width] for along in self._along)
        moved = jumps * (2.0 * of_jump + jumps * jump2)
        if slopes.any():
            moved += slopes * (2.0 * of_slope + 2.0 * jumps * both + slopes * slope2)
        return np.maximum(self.squares[..., :width] + moved, 0.0)


def seen(vertices: int) -> slice:
    """Return the slice of vertices by which joins are chosen. The stride is odd, so that each corner of a card comes in
    turn."""
    return slice(None, None, vertices // SEEN | 1)


def _squares(away: np.ndarray) -> np.ndarray:
    """Return the squared lengths of vectors, (N, frames)."""
    return np.square(away, dtype=np.float64).sum(axis=1)


def _parts(count: int, frames: int) -> Iterator[slice]:
    """Yield slices of so few vertices that arrays of their positions in `frames` frames stay small."""
    return (slice(*part) for part in ranges(count, 16 * frames))


def _changes(positions: np.ndarray) -> np.ndarray:
    """Return the RMS over vertices of the change of velocity at each frame but the first and the last, (T - 2,)."""
    return np.sqrt(sum(squared_bends(positions[part]) for part in _parts(*positions.shape[::2])) / len(positions))


def _usual(changes: np.ndarray) -> float:
    """Return the change of velocity of a usual frame. If most frames have none, as between keys, it is half the RMS."""
    return max(float(np.median(changes)), 0.5 * float(np.sqrt((changes**2).mean())))


class SourceStart:
    """What all stages of a segment are compared with: the source's first frames, and its change of velocity in a usual
    frame. positions: (N, 3, T) less an origin."""

    def __init__(self, positions: np.ndarray, origin: np.ndarray):
        self.usual, self._frames, self._origin = _usual(_changes(positions)), positions, origin[:, None]

    def frames(self, vertices: slice, count: int) -> np.ndarray:
        """Return the first `count` frames of the source for some of the vertices, with the origin added."""
        return self._frames[vertices, :, :count] + self._origin


def best_join(
    end: End, positions: np.ndarray, start: SourceStart, price: ErrorPrice | CorrectionPrice, largest: float
) -> int:
    """Choose how a stage of a segment is joined to `end`, the end of that stage in the segment before. Return the
    number of frames over which the join is spread, with SLOPED added if slopes are joined too, or 0 for no join.

    `positions`: (N, 3, T) of the vertices that `seen` names, which the other arguments hold alone as well; `start`: the
    source's first frames; `price`: the cost of errors that a join changes; `largest`: the largest error that costs
    nothing.
    """
    decoded, of_source = _changes(positions), start.usual
    usual = max(0.5 * (end.usual + _usual(decoded)), STILL * of_source)  # One side alone may move in straight lines.
    wanted = _changes(np.concatenate([end.source, start.frames(slice(None), END_FRAMES + 1)], axis=2))
    wanted *= usual / max(of_source, 1e-300)
    natural = np.maximum(np.concatenate([wanted, decoded[1:]]), usual)  # From the last frame before the seam on.

    width = min(max(WIDTHS), positions.shape[2] - END_FRAMES)
    ways = _ways(end, positions)
    errors = _Moved(lambda part: positions[part, :, :width] - start.frames(part, width), *ways)

    def bends(part: slice) -> np.ndarray:
        shown = (end.positions[part], positions[part, :, : width + 2])
        return np.diff(np.concatenate(shown, axis=2, dtype=np.float64), 2, axis=2)

    changes = _Moved(bends, *ways, are_means=True)

    def cost(join: int) -> float:
        """Return the cost of a join."""
        shares = _shares(join)
        joined = np.sqrt(changes.by(*_bends_of(join)))
        tick = float((joined / natural[: len(joined)]).max()) if usual > 0 else 0.0
        after = errors.by(*shares)
        beyond = max(0.0, float(after.max(initial=0.0)) ** 0.5 / largest - 1.0) if largest > 0 else 0.0
        price_of_errors = price(errors.squares[:, : len(shares[0])], after) + LARGEST_WORTH * beyond
        return max(tick, SMOOTH) + ROUGH_WORTH * max(0.0, tick - ROUGH) + price_of_errors

    widths = [width for width in WIDTHS if width <= positions.shape[2] - END_FRAMES]
    return min([0, *widths, *(SLOPED + width for width in widths)], key=cost)
