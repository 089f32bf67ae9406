"""Factors on the bound of each vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from athcodec.errors import ClipError
from athcodec.motion.clip import ERROR_WEIGHTS, MotionClip


@dataclass(frozen=True, eq=False)
class ErrorWeights:
    """Factors on the bound of the vertices of a clip, and the attribute that the file stores them in."""

    name: str
    array: np.ndarray  # The attribute.
    values: np.ndarray  # (N,) float64, above 0.

    @classmethod
    def of(cls, clip: MotionClip, weights: str | npt.ArrayLike) -> ErrorWeights:
        """Return factors on the bound for the vertices of a clip, which the attribute of the clip named `weights`
        holds, or the array `weights` itself.

        Raises ClipError unless there is a number above 0 for each vertex.
        """
        name = weights if isinstance(weights, str) else ERROR_WEIGHTS
        attributes = clip.attributes if isinstance(weights, str) else {name: _numbers(weights)}
        if name not in attributes:
            raise ClipError(f"weights: got {name!r}, expected one of {', '.join(attributes) or 'no attributes'}")
        array = attributes[name]
        if array.size != clip.vertex_count or array.dtype.kind not in "biuf":
            raise ClipError(
                f"weights: got {array.dtype} of shape {array.shape} in {name!r}, expected a number for each of "
                f"{clip.vertex_count} vertices"
            )
        values = array.reshape(-1).astype(np.float64)
        bad = np.flatnonzero(~((values > 0) & np.isfinite(values)))
        if bad.size:
            raise ClipError(f"weights: vertex {bad[0]} has {values[bad[0]]:g} in {name!r}, expected a number above 0")
        return cls(name, array, values)


def _numbers(weights: npt.ArrayLike) -> np.ndarray:
    """Return weights as an array that a file can hold, little-endian and without long doubles."""
    array = np.asarray(weights)
    is_long = array.dtype.kind == "f" and array.itemsize > 8
    return array.astype(np.float64 if is_long else array.dtype.newbyteorder("<"), copy=False)
