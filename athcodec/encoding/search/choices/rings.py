"""Tubes: which branches are made of rings that move alike (FORMAT.md, Ring).

Bark is a tube around a stem, ring after ring in the order of its vertices. Its rings hardly change their shape,
whatever the stem does, so its motion is that of their centres, and coded so it keeps its thickness at any bound.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from athcodec.encoding.model.quantise import bits
from athcodec.encoding.search.segment_samples import FRAMES
from athcodec.motion.sampling import spread

LEAST_RING = 2  # Least vertices of a ring (FORMAT.md, HIERARCHY).
LARGEST_RING = 32  # Most vertices of a ring (FORMAT.md, HIERARCHY).
LEAST_RINGS = 4  # Rings of a tube.
FINE = 1e-3  # Unit, in lengths of a stem, of the differences by which a period is found.
WITHIN = 0.1  # Largest share of the squared motion of a tube that is within its rings.


def ring_sizes(
    first: np.ndarray, count: np.ndarray, wanted: np.ndarray, rest: np.ndarray, samples: Sequence[np.ndarray]
) -> np.ndarray:
    """Return how many vertices each ring of a branch has, (B,) int32, or 0 for a branch without rings that move alike.

    `first`, `count`: (B,) the first vertex of each branch and the number of its vertices; `wanted`: (B,) bool, which
    branches may have rings; `rest`: (N, 3) positions; `samples`: arrays (N, 3, T) of positions.
    """
    rings = np.zeros(len(count), np.int32)
    for size in np.unique(count[wanted & (count >= LEAST_RINGS * LEAST_RING)]).tolist():
        branches = np.flatnonzero(wanted & (count == size))
        vertices = first[branches, None] + np.arange(size)
        rings[branches] = periods = _periods(rest[vertices])
        for ring in np.unique(periods[periods > 0]).tolist():
            some = periods == ring
            rings[branches[some]] *= _move_alike(rest[vertices[some]], vertices[some], samples, ring)
    return rings


def _periods(stems: np.ndarray) -> np.ndarray:
    """Return for each stem the number of vertices after which its steps from vertex to vertex repeat best, (B,), or 0
    if they do not repeat, or if the last ring would be incomplete and more than a tip. `stems`: (B, n, 3) positions.
    """
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
    """Return for each stem whether the vertices of each of its rings move almost as one, (B,) bool. `stems`: rest
    positions, (B, n, 3); `vertices`: their numbers in the samples; `samples`: arrays (N, 3, T); `ring`: the vertices of
    a ring.
    """
    starts = np.arange(0, stems.shape[1], ring)
    sizes = np.diff(np.append(starts, stems.shape[1]))
    within, all_in_all = np.zeros(len(stems)), np.zeros(len(stems))
    for sample in samples:
        for t in spread(sample.shape[2], FRAMES):
            moved = sample[:, :, t][vertices] - stems
            moved -= moved.mean(axis=1, keepdims=True)
            centres = np.add.reduceat(moved, starts, axis=1) / sizes[:, None]
            within += np.square(moved - np.repeat(centres, sizes, axis=1)).sum(axis=(1, 2))
            all_in_all += np.square(moved).sum(axis=(1, 2))
    return within < WITHIN * all_in_all
