"""Small parts that move as they are: which branches are rigid (FORMAT.md, Rigid).

A card that is smaller than the bound is noise after affine functions and modes have been quantised to it. As a rigid
part it keeps its shape whatever the bound, and takes three rows in place of nine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from athcodec._native import PIECE_VERTICES
from athcodec.encoding.quantise import half_octave
from athcodec.motion.algebra import decompose, determinant, multiply

OWN_BEND = 0.3  # what a rigid part may bend by in the source, over the bound
STIFF_BEND = 0.05  # the same of one that is rigid at any bound
LARGEST = 20.0  # size of a part whose shape the bound would spoil, over that
FRAMES = 12  # of a segment that are looked at
TURN_STEP = half_octave(-7)  # largest of rotations: errors of 1 to 2 degrees
MOST_TURN = 15


def rigid_layers(
    first: np.ndarray,
    count: np.ndarray,
    wanted: np.ndarray,
    rest: np.ndarray,
    samples: Sequence[np.ndarray],
    bounds: Sequence[float],
) -> np.ndarray:
    """(B,) int32: of the layers of such bounds, descending, how many see a branch as rigid.

    first, count, wanted: (B,) vertices of the branches, and which may be; rest: (N, 3); samples: (N, 3, T) each.
    """
    layers = np.zeros(len(count), np.int32)
    for size in np.unique(count[wanted & (count > 2) & (count <= PIECE_VERTICES)]).tolist():
        own = np.flatnonzero(wanted & (count == size))
        vertices = first[own, None] + np.arange(size)
        bend = np.max([_bends(rest[vertices], sample, vertices) for sample in samples], axis=0)
        extent = np.linalg.norm(np.ptp(rest[vertices], axis=1), axis=1)
        for bound in bounds:  # refinements of rotations cost more than those of modes: where shape needs them
            stiff = bend <= STIFF_BEND * bound
            layers[own] += (bend <= OWN_BEND * bound) & ((extent <= LARGEST * bound) | stiff)
    return layers


def _bends(shapes: np.ndarray, sample: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(B,) of parts, (B, n, 3), how far any vertex is at most from where the nearest rigid motion takes it."""
    d = shapes - shapes.mean(axis=1, keepdims=True)
    worst = np.zeros(len(shapes))
    for t in np.unique(np.linspace(0, sample.shape[2] - 1, FRAMES).astype(int)):
        x = sample[:, :, t][vertices]
        x = x - x.mean(axis=1, keepdims=True)
        u, _, v = decompose(multiply(x.transpose(0, 2, 1), d))
        u[:, :, 2] *= np.sign(determinant(u) * determinant(v))[:, None]
        away = x - multiply(d, multiply(u, v).transpose(0, 2, 1))
        worst = np.maximum(worst, np.linalg.norm(away, axis=2).max(axis=1))
    return worst


def turn_of(turn_step: float) -> int:
    """Half octaves of the largest step of rotations below 1 radian; 0: any."""
    return round(-2 * np.log2(turn_step)) if turn_step else 0


def finer_turn(turn_step: float) -> float:
    """The next step, or the same where there is none."""
    return half_octave(-min(turn_of(turn_step) + 1, MOST_TURN))
