"""Modes learned from the motion of single pieces, which take the place of cantilever modes (SHAPES chunks).

A piece bends in few ways, which its stiffness, its load and its neighbours determine. Cantilever modes are the same for
all pieces; principal components of a piece's modes over time (Lengyel 1999; by clusters: Sattler et al. 2005) represent
its motion in fewer tracks, at the price of storing the components. They are learned once for a clip, so their cost per
frame falls with the number of frames. FORMAT.md, "SHAPES".
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from athcodec._native import SHAPE_MODES, address, lib
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.motion import LEARNED_NUMBERS, LearnedModes, Plan, SegmentMotion
from athcodec.files.threads import ranges
from athcodec.motion.algebra import multiply, principal, solve

PART_BYTES = 2 << 20  # Memory of the products, or modes, of the pieces that are worked on at once.
FAINT = 0.15  # Bend of rings, in steps, below which a learned mode drops it: it would stretch rings that turn.


@dataclass(frozen=True)
class Components:
    """Principal components of pieces' first modes over all frames analysed, in scene units.

    A group holds pieces with the same number of modes: pieces (G,), lengths (G, 3 modes) in descending order, and unit
    vectors (G, 3 modes, 3 modes), a row each.
    """

    frames: int
    groups: list[tuple[np.ndarray, np.ndarray, np.ndarray]]


def components(plan: Plan, segments: Iterable[SegmentMotion]) -> Components:
    """Return the components of the motion of pieces, from which modes are learned. `segments`: analysed with a fine
    step and without learned modes, so that the components describe the motion and not its rounding.
    """
    sizes = np.minimum(plan.ranks, SHAPE_MODES)
    groups = [
        (pieces, 3 * int(size), np.zeros((len(pieces), len(_half(3 * size)))))
        for size in np.unique(sizes[sizes > 0])
        for pieces in [np.flatnonzero(sizes == size)]
    ]
    frames = 0
    for segment in segments:
        frames += segment.frames
        for pieces, count, total in groups:
            for part in _parts(pieces, count * count):
                total[part] += _products(plan, segment, pieces[part], count).reshape(-1, count * count)[:, _half(count)]
        del segment  # The next segment is made after this one has been freed.
    return Components(frames, [(pieces, *_principal(total, count)) for pieces, count, total in groups])


@lru_cache(SHAPE_MODES)
def _half(count: int) -> np.ndarray:
    """Return where the lower triangle of a symmetric matrix of so many rows is among all of its numbers."""
    row, column = np.tril_indices(count)
    return row * count + column


def _principal(moments: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the lengths, (P, count), and the unit vectors, (P, count, count), of the components of moments. `moments`:
    the lower triangles of symmetric matrices of so many rows, (P, count (count + 1) / 2)."""
    place = np.zeros((count, count), np.int64)
    place[np.tril_indices(count)] = np.arange(moments.shape[1])
    place = np.maximum(place, place.T)
    values, vectors = np.empty((len(moments), count)), np.empty((len(moments), count, count))
    for part in _parts(moments, count * count):
        values[part], vectors[part] = principal(np.take(moments[part], place, axis=1))
    return np.sqrt(np.maximum(values, 0.0)), vectors


def _parts(pieces: np.ndarray, numbers: int) -> Iterator[slice]:
    """Yield few enough pieces at a time that memory does not grow with their number. `numbers`: those of each."""
    count = max(1, PART_BYTES // (8 * numbers))
    return (slice(at, at + count) for at in range(0, len(pieces), count))


def _mode_weights(pieces: np.ndarray) -> np.ndarray:
    """Return the weights of the modes of pieces, (P, SHAPE_MODES)."""
    kinds, kind = np.unique(pieces[["flags", "count", "ring"]], return_index=True, return_inverse=True)[1:]
    weights = np.empty((len(kinds), SHAPE_MODES))
    for row, piece in zip(weights, pieces[kinds]):
        lib.ath_mode_weights(np.array(piece).ctypes.data, address(row, np.float64, SHAPE_MODES))
    return weights[kind]


def _products(plan: Plan, segment: SegmentMotion, pieces: np.ndarray, count: int) -> np.ndarray:
    """Return for each piece the products of the tracks of its first modes with each other, summed over frames, (P,
    count, count) in squared scene units. `pieces`: (P,) numbers of pieces; `count`: how many tracks of each are taken.
    """
    products, first = np.empty((len(pieces), count, count)), plan.first_rows[pieces]
    rows = address(segment.coefficients, np.int32, 0)
    lib.ath_row_products(len(pieces), first.ctypes.data, count, segment.frames, rows, products.ctypes.data)
    steps = np.array([stream.step for stream in segment.streams])[plan.pieces["stage"][pieces]]
    scale = np.repeat(steps[:, None] * _mode_weights(plan.pieces[pieces])[:, : count // 3], 3, axis=1)
    products *= scale[:, :, None] * scale[:, None, :]
    return products


def _across(pieces: np.ndarray, size: int) -> np.ndarray:
    """Return (P, size) bool: which numbers of a learned mode belong to modes that bend rings."""
    rings = -(-pieces["count"] // np.maximum(pieces["ring"], 1))
    return (pieces["ring"] > 0)[:, None] & (np.arange(size) // 3 >= rings[:, None])


def learn(plan: Plan, seen: Components, step: float, wanted: np.ndarray | None = None) -> LearnedModes:
    """Return the learned modes that are large enough to be worth storing at a step of motion. `seen`: the components of
    the motion; `wanted`: the pieces that get modes, (P,) bool, or None for all.
    """
    counts, learned = np.zeros(len(plan.pieces), np.int32), []
    least = step * np.sqrt(seen.frames)
    wanted = np.ones(len(counts), bool) if wanted is None else wanted
    parts = (
        (group[some[part]], lengths[some[part]], vectors[some[part]])
        for group, lengths, vectors in seen.groups
        for some in [np.flatnonzero(wanted[group])]
        for part in _parts(some, 4 * vectors[:1].size)
    )
    for pieces, lengths, vectors in parts:
        scale = np.minimum(lengths / (qz.MODE_STEP * least), qz.LARGEST_MODE)
        numbers = np.rint(vectors * scale[:, :, None]).astype(np.int32)
        across = _across(plan.pieces[pieces], numbers.shape[2])
        rings = np.flatnonzero(across.any(axis=1))
        faint = np.abs(vectors[rings] * lengths[rings, :, None]) < FAINT * least
        numbers[rings] *= ~(across[rings, None] & faint)
        kept = np.cumprod((lengths > qz.LEAST_MODE * least) & numbers.any(axis=2), axis=1) > 0
        counts[pieces] = kept.sum(axis=1)
        piece, mode = np.nonzero(kept)
        learned.append((pieces[piece], mode, numbers[kept]))
    integers, first = np.zeros((int(counts.sum()), 3, SHAPE_MODES), np.int32), np.cumsum(counts) - counts
    for pieces, modes, numbers in learned:
        size = numbers.shape[1] // 3
        integers[first[pieces] + modes, :, :size] = numbers.reshape(-1, size, 3).transpose(0, 2, 1)
    return _with_duals(counts, integers.reshape(-1, LEARNED_NUMBERS))


def nested(plan: Plan, modes: LearnedModes, wanted: np.ndarray, digits: int) -> LearnedModes:
    """Return learned modes for a coarser layer: those of the pieces `wanted`, (P,) bool, whose integers have `digits`
    fewer binary digits. The modes of a piece end before the first one that vanishes.
    """
    piece = np.repeat(np.arange(len(modes.counts)), modes.counts)
    integers = np.sign(modes.integers) * (np.abs(modes.integers) + (1 << digits - 1) >> digits)
    dropped = np.cumsum(~(integers.any(axis=1) & wanted[piece]))
    kept = dropped == np.append(0, dropped)[modes.first[piece]]
    sizes = np.minimum(plan.pieces["rank"][piece[kept]], SHAPE_MODES)
    integers = integers[kept] * np.tile(np.arange(SHAPE_MODES) < sizes[:, None], 3)
    return _with_duals(np.bincount(piece[kept], minlength=len(modes.counts)).astype(np.int32), integers)


def _with_duals(counts: np.ndarray, integers: np.ndarray) -> LearnedModes:
    """Return learned modes with their unit vectors and the duals that project on these. `counts`: the number of modes
    of each piece, (P,); `integers`: those of the modes, (K, LEARNED_NUMBERS).
    """
    (units, duals), first = np.zeros((2, *integers.shape)), np.cumsum(counts, dtype=np.int64) - counts
    lib.ath_unit_shapes(len(integers), address(integers, np.int32, 0), address(units, np.float64, 0))
    for count in np.unique(counts[counts > 0]).tolist():
        all_rows = first[counts == count, None] + np.arange(count)
        for rows in (all_rows[part] for part in _parts(all_rows, 16 * count * LEARNED_NUMBERS)):
            products = multiply(units[rows], units[rows].transpose(0, 2, 1))
            duals[rows] = solve(products + 1e-4 * np.eye(count), units[rows])  # A few modes are nearly alike.
    return LearnedModes(counts, first, integers, units, duals)


def estimated_bits(integers: np.ndarray, pieces: np.ndarray, piece_count: int) -> np.ndarray:
    """Return about how many bits integers (K, ...) of pieces (K,) take in a stream, (piece_count,)."""
    total, size = np.zeros(piece_count), math.prod(integers.shape[1:])
    for start, stop in ranges(len(pieces), size):
        busy = np.flatnonzero(integers[start:stop])
        bits = 2.0 * qz.bits(np.abs(integers[start:stop].reshape(-1)[busy]).astype(np.float64)) + 1.0
        total += np.bincount(pieces[start + busy // size], bits, piece_count)  # Parts of bits add up exactly.
    return total
