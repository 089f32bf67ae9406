"""Time bases learned from the tracks of a segment, which take the place of waves.

The principal components over time of a level's tracks (Lengyel 1999) represent it in fewer rows than waves, at the
price of storing them. FORMAT.md, "Temporal basis stream".
"""

from __future__ import annotations

import numpy as np

from athcodec._native import address, lib

BASIS_BITS = 14  # of stored integers
TOLERANCE = 5e-4  # mean square, in steps, that a basis may leave out


def basis_rows(steps: np.ndarray) -> np.ndarray:
    """The rows over time that stored integers mean, (rank, frames) float64."""
    return steps.astype(np.float64) * 2.0 ** -(BASIS_BITS - 1)


def principal(moments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues, (K, n) in descending order, and eigenvectors, (K, n, n) a row each, of symmetric matrices (K, n, n),
    which are destroyed. NumPy's own run in threads that go on spinning: they took a third of the time of encoding."""
    values, vectors = np.empty(moments.shape[:2]), np.empty(moments.shape)
    arrays = moments, np.empty(moments.shape[1:]), values, vectors
    lib.ath_principal(*moments.shape[:2], *(address(array, np.float64, 0) for array in arrays))
    return values, vectors


class TimeComponents:
    """Principal components over time, in descending order, of `count` tracks.

    moments: (frames, frames), their second moments in units of their steps.
    """

    def __init__(self, moments: np.ndarray, count: int):
        values, vectors = principal(moments[None])
        self._left_out = np.cumsum(np.maximum(values[0, ::-1], 0.0))  # by leaving out the last i + 1
        self._rows = vectors[0]
        self._count = count

    def basis(self, ratio: float = 1.0) -> np.ndarray | None:
        """The rows that tracks in steps `ratio` times as large need, (rank, frames) int32 as stored, or None where no
        basis smaller than the DCT's would do."""
        frames = len(self._rows)
        allowed = TOLERANCE * ratio**2 * self._count * frames
        rank = frames - int(np.searchsorted(self._left_out, allowed, side="right"))
        if self._count <= 1 or not 1 <= rank <= frames // 2:
            return None
        return np.rint(self._rows[:rank] * 2.0 ** (BASIS_BITS - 1)).astype(np.int32)
