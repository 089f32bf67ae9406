"""The error of decoded motion against its source: maximum, RMS, Karni-Gotsman and motion-normalised error.

The Karni-Gotsman error is that of "Compression of soft-body animation sequences", Computers & Graphics 28(1), 2004.
Positions alone are measured.
"""

from __future__ import annotations

from math import frexp, inf, sqrt

import numpy as np

from athcodec.metrics.blocks import Meter
from athcodec.options import whole


class ErrorMeter(Meter):
    """Accumulates the difference between reference and decoded positions, block by block.

    Lengths are in the unit of the positions; frames are counted in the order in which they are added. A decoded NaN
    counts as an infinite error.

    Parameters
    ----------
    rest : (N, 3) array, optional
        The rest pose, which motion_normalised_error needs.
    weights : (N,) array, optional
        Divide the errors of vertices in max_weighted_error; all 1 by default.

    Attributes
    ----------
    max_error, max_weighted_error : float
        Largest distance of any vertex in any frame.
    worst_frame, worst_vertex : int
        Where max_error is.
    frame_count : int
    """

    def __init__(self, rest: np.ndarray | None = None, weights: np.ndarray | None = None) -> None:
        """Begin to measure. `rest` (N, 3) is the rest pose, needed for the motion-normalised error, and `weights` (N,)
        multiply the errors of vertices in the largest weighted error.
        """
        self.max_error = self.max_weighted_error = 0.0
        self.worst_frame = 0
        self.worst_vertex = 0
        self.frame_count = 0
        self._rest = None if rest is None else np.asarray(rest, np.float64)
        self._weights = None if weights is None else np.asarray(weights, np.float64)
        self._points = 0
        self._error_square = self._spread_square = self._motion_square = 0.0
        self._low = np.full(3, inf)
        self._high = np.full(3, -inf)

    def _add(self, reference: np.ndarray, decoded: np.ndarray) -> None:
        """Add the errors of decoded frames (k, N, 3) against the same frames of the reference, in float64."""
        difference = reference - decoded
        scale = _scale(difference)
        square = ((difference / scale) ** 2).sum(axis=2)
        square[np.isnan(square)] = inf
        frame, vertex = np.unravel_index(square.argmax(), square.shape)
        largest = weighted = scale * sqrt(square[frame, vertex])
        if largest > self.max_error:
            self.max_error = largest
            self.worst_frame = self.frame_count + int(frame)
            self.worst_vertex = int(vertex)
        if self._weights is not None:
            weighted = scale * float(np.sqrt(square.max(axis=0) / self._weights**2).max())
        self.max_weighted_error = max(self.max_weighted_error, weighted)
        self._error_square += scale * scale * float(square.sum())
        self._spread_square += float(((reference - reference.mean(axis=1, keepdims=True)) ** 2).sum())
        if self._rest is not None:
            self._motion_square += float(((reference - self._rest) ** 2).sum())
        self._low = np.minimum(self._low, reference.min(axis=(0, 1)))
        self._high = np.maximum(self._high, reference.max(axis=(0, 1)))
        self._points += square.size
        self.frame_count += len(square)

    @property
    def rms_error(self) -> float:
        """Square root of the mean over vertices and frames of the squared Euclidean distance; 0 before any
        block.
        """
        return sqrt(self._error_square / self._points) if self._points else 0.0

    @property
    def kg_error(self) -> float:
        """Karni-Gotsman error in per cent: 100 |X - X'| / |X - E(X)|, Frobenius norms, E(X) each frame's mean
        vertex.

        Where all vertices of every frame coincide: 0 without error, else infinite.
        """
        return 100.0 * _ratio(self._error_square, self._spread_square)

    @property
    def motion_normalised_error(self) -> float:
        """RMS error over the RMS distance of the reference from the rest pose; ValueError where no rest was
        given.

        Where nothing moves: 0 without error, else infinite.
        """
        if self._rest is None:
            raise ValueError("motion_normalised_error: got no rest pose, expected ErrorMeter(rest)")
        return _ratio(self._error_square, self._motion_square)

    @property
    def diagonal(self) -> float:
        """Diagonal of the reference's bounding box over all frames; 0 before any block."""
        return float(np.linalg.norm(self._high - self._low)) if self._points else 0.0


def bits_per_vertex_frame(byte_count: int, frame_count: int, vertex_count: int) -> float:
    """Return size in bits per vertex and frame."""
    count = whole("frame_count", frame_count) * whole("vertex_count", vertex_count)
    return 8.0 * whole("byte_count", byte_count) / count


def _scale(values: np.ndarray) -> float:
    """Return a power of two of about the largest magnitude, over which squares neither vanish nor overflow."""
    largest = float(np.abs(values).max(initial=0.0))
    return 2.0 ** min(max(frexp(largest)[1], -1021), 1023) if 0.0 < largest < inf else 1.0


def _ratio(error_square: float, reference_square: float) -> float:
    if error_square == 0.0:
        return 0.0
    return sqrt(error_square / reference_square) if reference_square > 0.0 else inf
