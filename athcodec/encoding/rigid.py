"""Small parts that move as they are: which branches are rigid (FORMAT.md, Rigid), and corrections that keep them so.

A card that is smaller than the bound is noise after affine functions and modes have been quantised to it. As a rigid
part it keeps its shape whatever the bound, and takes three rows in place of nine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from athcodec._native import PIECE_VERTICES
from athcodec.encoding.motion import Plan
from athcodec.encoding.quantise import half_octave

OWN_BEND = 0.3  # what a rigid part may bend by in the source, over the bound
STIFF_BEND = 0.05  # the same of one that is rigid at any bound
LARGEST = 20.0  # size of a part whose shape the bound would spoil, over that
FRAMES = 12  # of a segment that are looked at
TURN = 7  # half octaves of the largest step of rotations, below 1 radian: errors of 1 to 2 degrees
TURN_STEP = half_octave(-TURN)


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
        u, _, v = np.linalg.svd(np.einsum("bni,bnj->bij", x, d))
        u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
        worst = np.maximum(worst, np.linalg.norm(x - d @ (u @ v).transpose(0, 2, 1), axis=2).max(axis=1))
    return worst


def rigid_moves(
    plan: Plan,
    decoded: np.ndarray,
    positions: np.ndarray,
    origin: np.ndarray,
    limit: float | np.ndarray,
    step: float,
    stored: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """Corrections, (K, 6), ascending, that move all vertices of a rigid part together: where one of `decoded`,
    (N, 3, T), is beyond its limit, and this brings all of them within."""
    found = [np.empty((0, 6), np.int32)]
    rigid = plan.pieces[plan.is_rigid]
    limits = np.broadcast_to(limit, len(decoded))
    for size in np.unique(rigid["count"]).tolist():
        vertices = rigid["first"][rigid["count"] == size][:, None] + np.arange(size)
        away = positions[vertices] + origin[:, None] - decoded[vertices]
        part, frame = np.nonzero(((away**2).sum(axis=2) > limits[vertices, None] ** 2).any(axis=1))
        if not len(part):
            continue
        away, own = away[part, :, :, frame], limits[vertices[part]]
        steps = np.rint((away.max(axis=1) + away.min(axis=1)) / (2 * step)).astype(np.int32)
        here = decoded[vertices[part], :, frame[:, None]]
        moved = np.where(steps[:, None] != 0, stored(here + steps[:, None] * step), here)
        left = positions[vertices[part], :, frame[:, None]] + origin - moved
        good = np.flatnonzero(((left**2).sum(axis=2) <= own**2).all(axis=1) & steps.any(axis=1))
        rows = np.zeros((len(good), size, 6), np.int32)
        rows[:, :, 0], rows[:, :, 1], rows[:, :, 2:5] = vertices[part[good]], frame[good, None], steps[good, None]
        found.append(rows.reshape(-1, 6))
    return ascending(np.concatenate(found))


def ascending(corrections: np.ndarray) -> np.ndarray:
    """The same by vertex and frame."""
    return corrections[np.lexsort(corrections[:, 1::-1].T)]
