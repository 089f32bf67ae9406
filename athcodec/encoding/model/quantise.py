"""Steps from an error bound: what the encoder tries, and how real numbers become the integers that a file stores.

The ratios were measured on finite-element trees: the cheapest file quantises coarser than its bound
and corrects the few vertices that end up beyond it.
"""

from __future__ import annotations

import numpy as np

from athcodec.errors import BoundError

DEAD_ZONE = 0.55  # Part of a step that a coefficient has to exceed to become 1.
MODE_STEP = 0.1  # Precision of a learned mode: what its rounding moves in a frame (RMS), in steps.
LEAST_MODE = 0.12  # Least motion of a learned mode in a frame (RMS), in steps.
LARGEST_MODE = 2.0**20  # Largest integer that a learned mode is stored in.
SMALLEST_BOUND = 1e-35  # Scene units. Steps, in float32, are smaller still, and squares of errors must not vanish.
LARGEST_EXTENT = 2.0**28  # Largest extent, in bounds, that corrections alone can express.
REST_CAP = 1.6  # Step of the rest pose, in bounds, at which the error of the pose reaches the bound.
FIRST_REST = 0.2  # Largest step of the first layer's rest pose, in bounds: all layers pay for what it bends wrongly.
SAFE_REST_CAP = 2 / 3**0.5  # Step, in bounds, at which the worst possible rounding of a vertex reaches the bound.
LATTICE_REST_CAP = 3.2 / 5**0.5  # Step over the bound when positions are rounded to points of the lattice.
SOURCE_REST_TOLERANCE = 3e-3  # Largest error, in diagonals, of a rest pose that is not the reference pose.
SOURCE_REST_STEP = 2.0  # Step of such a rest pose, in tolerances, that is tried first.
CORRECTION_STEP = 1.12  # Step of corrections, in limits. Rounding leaves at most sqrt(3)/2 of a step.

# Weights of the value, the slope and the bend of a row at its ends, in squared steps. Where segments meet they are
# END_WEIGHTS over the square of the change of velocity in a usual frame, in bounds, because motion hides errors.
LEAST_END_WEIGHTS = (0.25, 2.5, 2.5)  # Least weights, however much motion hides.
MOST_END_WEIGHTS = (10.0, 300.0, 50.0)  # Largest weights, however little it hides.
END_WEIGHTS = (5.0, 1.0, 0.25)  # Weights at a change of velocity of one bound.
STRAIGHT = 0.05  # Change of velocity in a usual frame, in bounds, below which every bend at an end is seen.
STRAIGHT_END_WEIGHTS = (20.0, 600.0, 50.0)  # Weights then, in place of the largest.


def end_weights(usual_change: float) -> tuple[float, ...]:
    """Return the weights of errors at the ends of segments, which are larger the less a usual frame hides.
    `usual_change`: the change of velocity in a usual frame, in bounds, infinite if no segments meet.
    """
    if usual_change < STRAIGHT:
        return STRAIGHT_END_WEIGHTS
    scale = usual_change**-2
    return tuple(
        max(least, min(most, weight * scale))
        for least, most, weight in zip(LEAST_END_WEIGHTS, MOST_END_WEIGHTS, END_WEIGHTS)
    )


def error_limit(bound: float, diagonal: float) -> float:
    """Return the distance within which decoded positions have to be: the bound less a margin for how others measure."""
    return bound - max(min(1e-6 * diagonal, 0.01 * bound), 1e-15 * bound)


def rounded_up(bound: float) -> float:
    """Return a number of three digits that is the bound or a little more, so that what an error names is accepted."""
    return next(near for near in (float(f"{part * bound:.3g}") for part in (1.0, 1.01)) if near >= bound)


def origin_of(point: np.ndarray, low: np.ndarray, high: np.ndarray, is_exact: bool) -> np.ndarray:
    """Return the point, kept within a box, (3,) in numbers of float32. If `is_exact`, subtracting and adding it returns
    every number in the box to the last bit, because no difference is larger than the number."""
    origin = nearest_singles(np.clip(point, low, high))
    return np.where(is_exact & (np.abs(origin) < 2.001 * (high - low)), 0.0, origin)


def least_bound(low: np.ndarray, high: np.ndarray, dtype: np.dtype) -> float:
    """Return twice the spacing of the source's numbers, or SMALLEST_BOUND. low, high: (3,) bounding box."""
    largest = np.asarray(np.abs([low, high]).max(), dtype)
    return max(2 * float(np.spacing(largest)), SMALLEST_BOUND)


def check_bound(bound: float, low: np.ndarray, high: np.ndarray, dtype: np.dtype, extent: float) -> None:
    """Raise BoundError for a bound that is smaller than least_bound, or so small that the integers of a file cannot
    span `extent`, the distance of the furthest positions. `low`, `high`: (3,) corners of the bounding box; `dtype`:
    that of the clip.
    """
    least = least_bound(low, high, dtype)
    if not (np.isfinite(bound) and bound >= least):
        reason = (
            "the smallest that a file can hold"
            if least == SMALLEST_BOUND
            else f"twice the spacing of the source's {np.dtype(dtype).name} coordinates"
        )
        raise BoundError(f"max error: got {bound:.3g}; expected at least {rounded_up(least):.3g}, {reason}")
    if extent > LARGEST_EXTENT * bound:
        raise BoundError(
            f"max error: got {bound:.3g}; expected at least {rounded_up(extent / LARGEST_EXTENT):.3g} for positions "
            f"and a rest pose that are up to {extent:.3g} apart"
        )


def single(value: float) -> float:
    """Return the value as a file stores it (float32), never 0."""
    return float(max(np.float32(value), np.finfo(np.float32).tiny))


def half_octave(exponent: int) -> float:
    """Return 2 to the power of half the exponent, with a decoder's bits (FORMAT.md, Affines stream)."""
    return float(half_octaves(np.array(exponent)))


def half_octaves(exponents: np.ndarray) -> np.ndarray:
    """Return the half octaves of an array of exponents."""
    return np.ldexp(np.where(exponents & 1, 1.4142135623730951, 1.0), exponents >> 1)


def turn_of(turn_step: float) -> int:
    """Return the code of a largest rotation step in radians: how many half octaves it is below 1; 0 for no largest
    step."""
    return round(-2 * np.log2(turn_step)) if turn_step else 0


def nearest_singles(values: np.ndarray) -> np.ndarray:
    """Return the nearest numbers of float32, as float64."""
    most = float(np.finfo(np.float32).max)
    return np.clip(values, -most, most).astype(np.float32).astype(np.float64)


def first_step_ratio(relative_bound: float) -> float:
    """Return the step of motion to start a search from, in bounds: 4 at loose bounds, 2 at tight ones."""
    return float(np.interp(np.log10(relative_bound), [-5, -4, -3], [2.0, 2.6, 4.0]))


def rest_step_ratio(relative_bound: float) -> float:
    """Return the step of the rest pose to start a search from, in bounds."""
    return float(np.interp(np.log10(relative_bound), [-5, -4, -3], [0.7, 0.7, 0.45]))


def first_rest_step(rest_step: float, bound: float, ratio: float) -> float:
    """Return the step of the first layer's rest pose; rest_step, bound: of the last layer, whose step is `ratio` times
    finer."""
    return single(max(rest_step, ratio * min(0.5 * rest_step, FIRST_REST * bound)))


def bits(numbers: np.ndarray) -> np.ndarray:
    """Return about how many bits numbers from 0 on take: log2(1 + x), rounded to parts that add up exactly, because the
    logarithms of processors differ in their last bits, and a choice between equals must not."""
    return np.rint(BIT_PARTS * np.log2(1 + numbers)) / BIT_PARTS


BIT_PARTS = 2.0**16  # Parts of a bit in which estimates count.
LONGEST_LAG = 40  # Largest lag, in vertices, that is tried for a stem: rings have at most 32.
LONGEST_ROW = 600  # Largest lag, in vertices, that is tried for a stem that may be a whole mesh: the row of a grid.
MOST_LAG = 65535  # Largest lag, in vertices, that a file can hold.
MESH = 1000  # Vertices from which on a stem may be a whole mesh.
SHORT_STEM = 16  # Vertices up to which many stems are likely to be alike, which a lag of them all tells apart.


def rest_lags(stems: np.ndarray, attach: np.ndarray | None, step: float) -> np.ndarray:
    """Return for each stem the lag, 1 or more, with which its rest pose takes the fewest bits (FORMAT.md, Lag), (B,).
    `stems`: (B, n, 3) rest positions; `attach`: (B, 3) attach points, or None for stems without; `step`: of the rest
    pose.
    """
    none = min(stems.shape[1], MOST_LAG)  # No step, or hardly any, is that many vertices ago.
    chains = stems if attach is None else np.concatenate([attach[:, None], stems], axis=1)
    is_mesh = chains.shape[1] > MESH
    steps = np.diff(chains[:, : 4 * MESH if is_mesh else MESH], axis=1)  # The first vertices of a long stem are enough.
    tried = np.array([none, *range(1, min(steps.shape[1], LONGEST_ROW if is_mesh else LONGEST_LAG))])

    def costs(lag: int) -> np.ndarray:
        residual = steps.copy()
        residual[:, lag:] -= steps[:, : max(0, steps.shape[1] - lag)]
        return bits(np.abs(residual) / step).sum(axis=(1, 2))

    return tried[np.argmin([costs(lag) for lag in tried], axis=0)]
