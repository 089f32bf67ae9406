"""Steps from an error bound: what the encoder tries, and how real numbers become the integers that a file stores.

The ratios were measured on finite-element trees (spec/rationale.md): the cheapest file quantises coarser than its bound
and corrects the few vertices that end up beyond it.
"""

from __future__ import annotations

import numpy as np

from athcodec.errors import BoundError

DEAD_ZONE = 0.55
MODE_STEP = 0.1  # precision of a learned mode: what it moves in a frame (RMS), in steps
LEAST_MODE = 0.12  # what a learned mode that is kept moves in a frame (RMS), in steps
LARGEST_MODE = 2.0**20
SMALLEST_BOUND = 1e-35  # steps, in float32, are smaller still; squares of errors must not vanish
LARGEST_EXTENT = 2.0**28  # extent over bound that corrections alone can still express
REST_CAP = 1.6  # rest pose step over bound at which its own error reaches the bound
FIRST_REST = 0.2  # largest step of the first layer's, over half its bound: all layers pay for what it bends wrongly
SAFE_REST_CAP = 2 / 3**0.5  # the same for the worst possible rounding of a vertex
LATTICE_REST_CAP = 3.2 / 5**0.5  # and for that to a point of the lattice
SOURCE_REST_TOLERANCE = 3e-3  # over the diagonal: how far a rest pose that is no reference pose may be off
SOURCE_REST_STEP = 2.0  # over that, at first
CORRECTION_STEP = 1.12  # over the limit: rounding a correction leaves at most sqrt(3)/2 of its step

# What the value, the slope and the bend of a row weigh at its ends, in squared steps: at least; where segments meet, at
# most, and where the velocity changes by one bound in a usual frame. Less by the square of that: who moves hides its
# errors.
LEAST_END_WEIGHTS = (0.25, 2.5, 2.5)
MOST_END_WEIGHTS = (10.0, 300.0, 50.0)
END_WEIGHTS = (5.0, 1.0, 0.25)
# Where segments meet and the velocity changes by less than STRAIGHT bounds in a usual frame, the motion that is left is
# far calmer than the source, and every bend at an end is seen: rows end in straight lines there, in waves of that kind.
STRAIGHT, STRAIGHT_END_WEIGHTS = 0.05, (20.0, 600.0, 50.0)


def end_weights(usual_change: float) -> tuple[float, ...]:
    """The weights for a change of velocity in a usual frame, over the bound; infinite where no segments meet."""
    if usual_change < STRAIGHT:
        return STRAIGHT_END_WEIGHTS
    scale = usual_change**-2
    return tuple(
        max(least, min(most, weight * scale))
        for least, most, weight in zip(LEAST_END_WEIGHTS, MOST_END_WEIGHTS, END_WEIGHTS)
    )


def error_limit(bound: float, diagonal: float) -> float:
    """What decoded positions are held to: the bound less a margin for how others measure."""
    return bound - max(min(1e-6 * diagonal, 0.01 * bound), 1e-15 * bound)


def rounded_up(bound: float) -> float:
    """A number of three digits that is the bound or a little more, so that what an error names is accepted."""
    return next(near for near in (float(f"{part * bound:.3g}") for part in (1.0, 1.01)) if near >= bound)


def origin_of(point: np.ndarray, low: np.ndarray, high: np.ndarray, is_exact: bool) -> np.ndarray:
    """The point, kept within a box, (3,) in numbers of float32. Where `is_exact`, taking it off and adding it again
    gives every number in the box to the last bit, because what is left of a number is never larger than the number."""
    origin = nearest_singles(np.clip(point, low, high))
    return np.where(is_exact & (np.abs(origin) < 2.001 * (high - low)), 0.0, origin)


def least_bound(low: np.ndarray, high: np.ndarray, dtype: np.dtype) -> float:
    """Twice the spacing of the source's own numbers, or SMALLEST_BOUND; low, high: (3,) bounding box, dtype: of its
    positions."""
    largest = np.asarray(np.abs([low, high]).max(), dtype)
    return max(2 * float(np.spacing(largest)), SMALLEST_BOUND)


def check_bound(bound: float, low: np.ndarray, high: np.ndarray, dtype: np.dtype, extent: float) -> None:
    """Raises BoundError for a bound below least_bound, or too small for the file's integers to span `extent`."""
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
    """The value as a file stores it (float32), never 0."""
    return float(max(np.float32(value), np.finfo(np.float32).tiny))


def half_octave(exponent: int) -> float:
    """As decoders have it (FORMAT.md, Affines stream)."""
    odd = exponent & 1
    return (1.4142135623730951 if odd else 1.0) * 2.0 ** ((exponent - odd) // 2)


def half_octaves(exponents: np.ndarray) -> np.ndarray:
    """The same of many."""
    odd = exponents & 1
    return np.ldexp(np.where(odd, half_octave(1), 1.0), (exponents - odd) // 2)


def turn_of(turn_step: float) -> int:
    """Return the largest step of rotations in half octaves below 1 radian; 0: any step."""
    return round(-2 * np.log2(turn_step)) if turn_step else 0


def nearest_singles(values: np.ndarray) -> np.ndarray:
    """The same in numbers of float32, as float64."""
    most = float(np.finfo(np.float32).max)
    return np.float64(np.float32(np.clip(values, -most, most)))


def first_step_ratio(relative_bound: float) -> float:
    """Motion step over error bound to start a search from: 4 at loose bounds, 2 at tight ones."""
    return float(np.interp(np.log10(relative_bound), [-5, -4, -3], [2.0, 2.6, 4.0]))


def rest_step_ratio(relative_bound: float) -> float:
    """Rest pose step over error bound."""
    return float(np.interp(np.log10(relative_bound), [-5, -4, -3], [0.7, 0.7, 0.45]))


def first_rest_step(rest_step: float, bound: float, ratio: float) -> float:
    """Of the first layer, whose step is `ratio` times that of the last, which has the given step and bound."""
    return single(max(rest_step, ratio * min(0.5 * rest_step, FIRST_REST * bound)))


def bits(numbers: np.ndarray) -> np.ndarray:
    """About what numbers of such sizes, 0 or more, take: log2(1 + x), in parts that add up exactly. The logarithms of
    processors differ in their last bits, and a choice between equals must not."""
    return np.rint(BIT_PARTS * np.log2(1 + numbers)) / BIT_PARTS


BIT_PARTS = 2.0**16  # of a bit, that estimates are made of
LONGEST_LAG, LONGEST_ROW = 40, 600  # of stems, and of those that may be whole meshes
MESH = 1000  # vertices
SHORT_STEM = 16  # vertices: stems that are likely to come in many alike, which a lag of all of them tells apart


def rest_lag(stem: np.ndarray, attach: np.ndarray | None, step: float) -> int:
    """The lag, 1 or more, that leaves the least of a stem's rest pose to code: see FORMAT.md, Lag. stem: (n, 3)."""
    chain = stem if attach is None else np.vstack([attach, stem])
    steps = np.diff(chain[: MESH if len(chain) <= MESH else 4 * MESH], axis=0)  # a sample does for long stems
    longest = LONGEST_LAG if len(chain) <= MESH else LONGEST_ROW
    none = len(stem)  # no step is that many vertices ago

    def cost(lag: int) -> float:
        residual = steps.copy()
        residual[lag:] -= steps[: max(0, len(steps) - lag)]
        return float(bits(np.abs(residual) / step).sum())

    return min([none, *range(1, min(len(steps), longest))], key=cost)
