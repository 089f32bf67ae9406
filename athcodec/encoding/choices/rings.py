"""Tubes: which branches are made of rings that move alike (FORMAT.md, Ring).

Bark is a tube around a stem, ring after ring in the order of its vertices. Its rings hardly change their shape,
whatever the stem does, so its motion is that of their centres, and coded so it keeps its thickness at any bound.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from athcodec.encoding.quantise import bits

LEAST_RING, LARGEST_RING = 2, 32
LEAST_RINGS = 4  # of a tube
FINE = 1e-3  # over a stem's length, of what a period is looked for in
WITHIN = 0.1  # of what a stem's vertices move, squared, the most that is within rings
FRAMES = 12  # of a segment that are looked at


def ring_sizes(
    first: np.ndarray, count: np.ndarray, wanted: np.ndarray, rest: np.ndarray, samples: Sequence[np.ndarray]
) -> np.ndarray:
    """(B,) int32: vertices of the rings of each branch, 0 where it has none that move alike.

    first, count, wanted: (B,) vertices of the branches, and which may have rings; rest: (N, 3); samples: (N, 3, T)
    each.
    """
    rings = np.zeros(len(count), np.int32)
    for size in np.unique(count[wanted & (count >= LEAST_RINGS * LEAST_RING)]).tolist():
        own = np.flatnonzero(wanted & (count == size))
        vertices = first[own, None] + np.arange(size)
        rings[own] = _periods(rest[vertices])
        for ring in np.unique(rings[own][rings[own] > 0]).tolist():
            some = rings[own] == ring
            rings[own[some]] *= _move_alike(rest[vertices[some]], vertices[some], samples, ring)
    return rings


def _periods(stems: np.ndarray) -> np.ndarray:
    """(B,) after how many vertices the steps of (B, n, 3) stems repeat best; 0 where they do not, or the last ring
    would have more than a tip and less than the others."""
    size = stems.shape[1]
    steps = np.diff(stems, axis=1)
    unit = FINE * np.linalg.norm(np.ptp(stems, axis=1), axis=1)
    unit = np.where(unit > 0, unit, 1.0)[:, None, None]
    lags = range(1, min(LARGEST_RING, size // LEAST_RINGS) + 1)
    costs = [_cost(steps, lag, unit) for lag in lags]
    best = 1 + np.argmin(costs, axis=0)
    return np.where((best >= LEAST_RING) & (size % best <= 1), best, 0)


def _cost(steps: np.ndarray, lag: int, unit: np.ndarray) -> np.ndarray:
    residual = steps.copy()
    residual[:, lag:] -= steps[:, :-lag]
    return bits(np.abs(residual) / unit).sum(axis=(1, 2))


def _move_alike(stems: np.ndarray, vertices: np.ndarray, samples: Sequence[np.ndarray], ring: int) -> np.ndarray:
    """(B,) bool: whether the vertices of a ring move as one, but for a little."""
    starts = np.arange(0, stems.shape[1], ring)
    sizes = np.diff(np.append(starts, stems.shape[1]))
    within, all_in_all = np.zeros(len(stems)), np.zeros(len(stems))
    for sample in samples:
        for t in np.unique(np.linspace(0, sample.shape[2] - 1, FRAMES).astype(int)):
            moved = sample[:, :, t][vertices] - stems
            moved -= moved.mean(axis=1, keepdims=True)
            centres = np.add.reduceat(moved, starts, axis=1) / sizes[:, None]
            within += np.square(moved - np.repeat(centres, sizes, axis=1)).sum(axis=(1, 2))
            all_in_all += np.square(moved).sum(axis=(1, 2))
    return within < WITHIN * all_in_all
