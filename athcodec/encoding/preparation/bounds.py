"""The error bound that a caller asks for: as a length, as a fraction of the clip's size, or as the size of the file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from athcodec.encoding.model import quantise as qz
from athcodec.encoding.segments.segment import Source
from athcodec.errors import BoundError
from athcodec.motion.algebra import length
from athcodec.motion.clip import MotionClip
from athcodec.options import COARSE_SHARE, DEFAULT_REL_ERROR, LOSSLESS_REL_ERROR, set_numbers
from athcodec.untyped import JsonValue

GUESSED_SIZES = 16  # Files whose bounds are guessed from earlier sizes; later bounds halve the interval.


@dataclass(frozen=True)
class BoundOption:
    """At most one of the options of `encode` that set the bound; `lossless` changes the default.

    Raises ValueError for several of them, TypeError for one that is no number, BoundError for one that is not finite
    and above 0.
    """

    max_error: float | None = None
    rel_error: float | None = None
    target_size: int | None = None
    lossless: bool = False

    def __post_init__(self) -> None:
        """Check the options. Raises ValueError if there is more than one bound, and BoundError for one that is not
        finite and above 0.
        """
        names = ("max_error", "rel_error", "target_size")
        options = {name: value for name in names if (value := getattr(self, name)) is not None}
        if len(options) > 1:
            raise ValueError(f"got {' and '.join(options)}; expected one of them")
        set_numbers(self, reals=names)
        for name, value in options.items():
            if not 0 < getattr(self, name) < math.inf:
                raise BoundError(f"{name}: got {value}; expected a finite number above 0")
        if self.target_size is not None:
            object.__setattr__(self, "target_size", int(self.target_size))

    def in_scene_units(self, source: Source, file_size: Callable[[float], float], filled: float = 0.97) -> float:
        """Return the bound of a file in scene units. A fraction is one of the diagonal of all frames; if that is 0, of
        the extent together with the rest pose.

        file_size: returns the bytes of the file at a bound; filled: share of a target size that the file is to fill.
        """
        if self.max_error is not None:
            return self.max_error
        if self.target_size is not None:
            return _bound_for_size(source, file_size, self.target_size, filled)
        diagonal, extent = source.seen.diagonal, source.extent
        least = 2 * least_bound(source)
        if self.rel_error is None and self.lossless:
            return max(LOSSLESS_REL_ERROR * extent, least, extent / qz.LARGEST_EXTENT)
        fraction = self.rel_error or DEFAULT_REL_ERROR
        return fraction * diagonal if diagonal > 0 else max(fraction * extent, least)

    def objection(self, bound: float, diagonal: float, unit: JsonValue) -> str:
        """Return a sentence that says why a bound is coarse, or an empty text if it is not, or was passed as a
        fraction. `bound`, `diagonal`: in scene units; `unit`: the clip's unit, as its metadata state it.
        """
        if self.max_error is None and self.target_size is None or not bound > COARSE_SHARE * diagonal > 0:
            return ""
        of_unit, share = f" {unit}" if isinstance(unit, str) else "", bound / diagonal
        words = f"{100 * share:.2g} % of" if share < 1 else f"{share:.2g} times"
        of_plant = f"{words} the diagonal of all frames, {diagonal:.3g}{of_unit}"
        expected = f"expected at most {100 * COARSE_SHARE:g} %, beyond which little may be left of the motion"
        if self.target_size is not None:
            return f"target_size: got {self.target_size} bytes, whose error is {of_plant}; {expected}: allow more bytes"
        return f"max_error: got {bound:g}{of_unit}, {of_plant}; {expected}: a length may have a unit, such as 1mm"

    def least(self, clip: MotionClip) -> float:
        """Return a bound in scene units that the clip's bound will not be below, from a few of its frames; 0 if they do
        not tell.
        """
        if self.max_error is not None:
            return self.max_error
        if self.target_size is not None or self.lossless:
            return 0.0
        frames = {0, clip.frame_count // 2, clip.frame_count - 1}
        corners = [
            getattr(clip.block(frame, frame + 1)[0], name)(axis=0) for frame in frames for name in ("min", "max")
        ]
        return (self.rel_error or DEFAULT_REL_ERROR) * length(np.ptp(np.array(corners, float), axis=0))


def least_bound(source: Source) -> float:
    """Return the smallest bound that a file can hold."""
    return qz.least_bound(source.seen.low, source.seen.high, source.clip.dtype)


def _bound_for_size(source: Source, file_size: Callable[[float], float], target: int, filled: float) -> float:
    """Return the bound whose file fills at least the share `filled` of `target` bytes, or else the finest one found
    whose file is not larger than that: sizes of small files jump by some percent from one bound to the next. Raises
    BoundError if no file is small enough.

    `file_size`: returns the bytes of the file at a bound. Between two known sizes the size is interpolated in
    logarithms; elsewhere it is taken to fall about as the square root of the bound.
    """
    diagonal = source.seen.diagonal or 1.0
    # Files at `low` are too large; `high` fits once it has been tried.
    low, high = 1e-7, max(0.1, 2 * least_bound(source) / diagonal)
    sizes: dict[float, float] = {}
    guess = min(DEFAULT_REL_ERROR, high)
    while high / low > 1.01 and sizes.get(high, 0) < filled * target:
        sizes[guess] = file_size(guess * diagonal)
        low, high = (low, guess) if sizes[guess] <= target else (guess, high)
        # Guesses are rounded, because logarithms differ between C libraries in the last bit.
        halving = high if high not in sizes else math.sqrt(low * high)
        guess = qz.single(_next_guess(low, high, sizes, target) if len(sizes) < GUESSED_SIZES else halving)
    if sizes.get(high, target + 1) > target:
        least = file_size(high * diagonal)
        raise BoundError(f"target size: got {target} bytes; expected at least {least} for this clip")
    return high * diagonal


def _next_guess(low: float, high: float, sizes: dict[float, float], target: int) -> float:
    """Return the bound, from `low` to `high`, at which the file is expected to be just smaller than `target` bytes.
    `sizes`: the bytes of the files at bounds that were tried.
    """
    goal = math.log(0.985 * target)
    if low in sizes and high in sizes and math.isfinite(sizes[low]):
        a, b = math.log(sizes[low]), math.log(sizes[high])
        part = (a - goal) / (a - b) if a > b else 0.5
        return low * (high / low) ** min(max(part, 0.05), 0.95)
    known = low if low in sizes else high
    if not math.isfinite(sizes[known]):
        return math.sqrt(low * high)
    guess = known * math.exp((math.log(sizes[known]) - goal) / _fall(known, sizes))
    return min(max(guess, low * 1.01), high if high not in sizes else high / 1.01)


def _fall(known: float, sizes: dict[float, float]) -> float:
    """Return how much the logarithm of the size falls as that of the bound rises, beside a known one."""
    others = [bound for bound, size in sizes.items() if bound != known and math.isfinite(size)]
    if not others:
        return 0.5
    other = min(others, key=lambda bound: abs(math.log(bound / known)))
    fall = math.log(sizes[other] / sizes[known]) / math.log(known / other)
    return min(max(fall, 0.15), 0.6)
