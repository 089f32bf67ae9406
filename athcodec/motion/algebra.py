"""Linear algebra of the encoder in the C core, whose sums have a fixed order.

NumPy's own (`@`, numpy.linalg) runs in BLAS and LAPACK, which give other bits with other processors and numbers of
threads, and einsum with other instruction sets: what decides which bytes a file holds goes through these functions, so
that a clip makes the same file everywhere."""

from __future__ import annotations

import math

import numpy as np

from athcodec._native import address, lib


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the matrix products a @ b of two stacks of matrices, float64. The sums are added up in one order, so that
    the result has the same bits on every processor."""
    batch = np.broadcast_shapes(a.shape[:-2], b.shape[:-2])
    (rows, inner), columns = a.shape[-2:], b.shape[-1]
    if b.shape[-2] != inner:
        raise ValueError(f"multiply: got {a.shape} and {b.shape}, expected as many columns as rows")
    out = np.empty((*batch, rows, columns))
    (of_a, a_step), (of_b, b_step) = _stack(a, batch), _stack(b, batch)
    lib.ath_multiply(
        math.prod(batch),
        rows,
        inner,
        columns,
        address(of_a, np.float64, 0),
        a_step,
        address(of_b, np.float64, 0),
        b_step,
        address(out, np.float64, 0),
    )
    return out


def largest_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the largest distance of any point of a pose, (N, 3), from where it is in another."""
    x, y, z = np.square(one.astype(np.float64) - other).T  # A sum over three columns is faster than one over an axis.
    return math.sqrt(float((x + y + z).max()))


def _stack(matrices: np.ndarray, batch: tuple[int, ...]) -> tuple[np.ndarray, int]:
    """Return the matrices of a stack behind each other, and the distance from one to the next: 0 if all are the
    same."""
    size = math.prod(matrices.shape[-2:])
    if matrices.size == size:
        return np.ascontiguousarray(matrices, np.float64), 0
    return np.ascontiguousarray(np.broadcast_to(matrices, (*batch, *matrices.shape[-2:])), np.float64), size


def decompose(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the singular value decomposition of (..., 3, 3), as numpy.linalg.svd does."""
    matrices = np.ascontiguousarray(matrices, np.float64)
    left, stretch, right = np.empty(matrices.shape), np.empty(matrices.shape[:-1]), np.empty(matrices.shape)
    arrays = (address(array, np.float64, 0) for array in (matrices, left, stretch, right))
    lib.ath_decompose(matrices.size // 9, *arrays)
    return left, stretch, right


def determinant(matrices: np.ndarray) -> np.ndarray:
    """Return the determinants of (..., 3, 3)."""
    across = np.cross(matrices[..., 1, :], matrices[..., 2, :])
    return (matrices[..., 0, :] * across).sum(axis=-1)


def nearest_rotations(matrices: np.ndarray) -> np.ndarray:
    """Return the rotations nearest to matrices (..., 3, 3)."""
    left, _, right = np.linalg.svd(matrices)
    return rotations_of(left, right)


def rotations_of(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the rotations nearest to matrices of which these are the singular vectors, (..., 3, 3) each, as
    numpy.linalg.svd returns them."""
    left = left.copy()
    left[..., 2] *= np.sign(np.linalg.det(left @ right))[..., None]
    return left @ right


def principal(moments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues (K, n), descending, and eigenvectors (K, n, n), one in each row, of symmetric matrices (K, n,
    n). The matrices are overwritten."""
    values, vectors = np.empty(moments.shape[:2]), np.empty(moments.shape)
    arrays = moments, np.empty(moments.shape[1:]), values, vectors
    lib.ath_principal(*moments.shape[:2], *(address(array, np.float64, 0) for array in arrays))
    return values, vectors


def solve(matrices: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the solutions, (K, n, m), for positive definite matrices (K, n, n) and right-hand sides (K, n, m)."""
    out, scratch = np.array(rows, np.float64, order="C"), np.array(matrices, np.float64, order="C")
    lib.ath_solve(*out.shape, address(scratch, np.float64, 0), address(out, np.float64, 0))
    return out


def length(vector: np.ndarray) -> float:
    """Return the norm of one vector. Without an axis, numpy.linalg.norm would ask BLAS, whose sums have no fixed
    order."""
    return float(np.linalg.norm(vector, axis=0))
