"""Rotations as quaternions x y z w, and as matrices."""

from __future__ import annotations

import numpy as np


def normalized(quaternions: np.ndarray) -> np.ndarray:
    """Return quaternions (..., 4) at length 1; a quaternion of length 0 becomes the one without a rotation."""
    length = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    return np.where(length > 0, quaternions / np.where(length > 0, length, 1.0), [0.0, 0.0, 0.0, 1.0])


def rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) of quaternions (..., 4) in the order x, y, z, w. They need not have
    length 1."""
    x, y, z, w = np.moveaxis(normalized(quaternions), -1, 0)
    rows = [
        1 - 2 * (y * y + z * z),
        2 * (x * y - z * w),
        2 * (x * z + y * w),
        2 * (x * y + z * w),
        1 - 2 * (x * x + z * z),
        2 * (y * z - x * w),
        2 * (x * z - y * w),
        2 * (y * z + x * w),
        1 - 2 * (x * x + y * y),
    ]
    return np.stack(rows, axis=-1).reshape(*quaternions.shape[:-1], 3, 3)


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """Return the unit quaternions (..., 4), in the order x, y, z, w, of rotation matrices (..., 3, 3). They are
    computed from their largest component, which loses no digits."""
    m = np.moveaxis(rotations, (-2, -1), (0, 1))
    squares = np.stack(
        [
            1 + m[0, 0] - m[1, 1] - m[2, 2],
            1 - m[0, 0] + m[1, 1] - m[2, 2],
            1 - m[0, 0] - m[1, 1] + m[2, 2],
            1 + m[0, 0] + m[1, 1] + m[2, 2],
        ],
        axis=-1,
    )
    xy, xz, yz = m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1]
    xw, yw, zw = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    rows = np.stack(
        [
            np.stack([squares[..., 0], xy, xz, xw], -1),
            np.stack([xy, squares[..., 1], yz, yw], -1),
            np.stack([xz, yz, squares[..., 2], zw], -1),
            np.stack([xw, yw, zw, squares[..., 3]], -1),
        ],
        -2,
    )
    best = squares.argmax(axis=-1)
    unscaled = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    return unscaled / np.linalg.norm(unscaled, axis=-1, keepdims=True)
