"""Options: their words, defaults and limits. Nothing heavy is imported, because the command line needs it to explain
itself."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Sequence
from typing import Any, SupportsFloat, SupportsIndex

DEFAULT_REL_ERROR = 1e-4
LOSSLESS_REL_ERROR = 4e-7  # Error over the diagonal at which a lossless file is about smallest.
EFFORTS = ("fast", "default", "best")
SMOOTHNESS = {"default": 1.15, "bytes": 1.0, "motion": 2.0}  # Factors on the bytes that smooth errors may cost.
LADDERS = {"none": (), "decades": (1e-2, 1e-3, 1e-4, 1e-5)}  # Largest errors over the diagonal.
DEFAULT_LADDER = "decades"
COARSE_SHARE = 1e-2
"""Share of the diagonal above which an error is warned of: the largest that the default ladder has a layer for. On a
screen where the plant is 1,000 pixels high, vertices stray by more than 10."""
MIN_SEGMENT, MAX_SEGMENT, DEFAULT_SEGMENT = 16, 256, 128  # Frames.
METHODS = ("attributes", "skeleton", "edges", "objects", "components", "runs", "motion")  # Methods of finding branches.
SAMPLES = ("tree", "growth")  # Sources that ship with the package.
MAX_MEMORY = 4 << 30  # Bytes that reading a source may take.
RIG_JOINTS = 256  # Default joints of a rig.
HOST = "host"
"""The word for a rest pose that whoever plays the file has: `--rest host`."""


def whole(name: str, number: SupportsIndex, hint: str = "") -> int:
    """Return the number as an int, NumPy's integers too. Raises TypeError for any other, such as 3.5 or 3.0; its
    message ends with the hint."""
    try:
        return operator.index(number)
    except TypeError:
        raise TypeError(f"{name}: got {number!r}, expected a whole number of type int{hint}") from None


def real(name: str, number: SupportsFloat, hint: str = "") -> float:
    """Return the number as a float: an int, a NumPy scalar of any real type, an array without dimensions, or anything
    else that `float` takes. Raises TypeError for truth values, text, complex numbers, and arrays with dimensions; its
    message ends with the hint."""
    kind = getattr(getattr(number, "dtype", None), "kind", "f")  # The dtypes of other libraries have no kind.
    if not isinstance(number, (bool, str, bytes, bytearray)) and kind in "iufO" and not getattr(number, "ndim", 0):
        try:
            return float(number)
        except TypeError:
            pass
    raise TypeError(f"{name}: got {number!r:.80}, expected a number{hint and ' ' + hint}")


def set_numbers(record: Any, *, reals: Iterable[str] = (), wholes: Iterable[str] = ()) -> None:
    """Turn fields of a dataclass, frozen ones too, into float and int, unless they are None. Raises TypeError."""
    for names, number in ((reals, real), (wholes, whole)):
        for name in names:
            if (value := getattr(record, name)) is not None:
                object.__setattr__(record, name, number(name, value))


def ladder_of(ladder: str | Sequence[float]) -> tuple[float, ...]:
    """Return the errors of a ladder's layers, over the diagonal, in descending order. `ladder` is a ladder's name, a
    sequence of errors, or text with commas between errors. Raise ValueError.
    """
    if isinstance(ladder, str) and ladder in LADDERS:
        return LADDERS[ladder]
    try:
        numbers = map(float, ladder.split(",")) if isinstance(ladder, str) else (real("ladder", one) for one in ladder)
        errors = tuple(sorted(numbers, reverse=True))
    except (TypeError, ValueError):
        errors = (math.nan,)
    if not all(0 < error < 1 for error in errors):
        raise ValueError(f"ladder: got {ladder!r}; expected {', '.join(LADDERS)} or errors between 0 and 1")
    return errors
