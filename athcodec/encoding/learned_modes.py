"""Modes learned from the motion of single pieces, which take the place of cantilever modes (SHAPES chunks).

A piece bends in few ways, which its stiffness, its load and its neighbours determine. Cantilever modes are the same for
all pieces; principal components of a piece's modes over time (Lengyel 1999; by clusters: Sattler et al. 2005) represent
its motion in fewer tracks, at the price of storing the components. They are learned once for a clip, so their cost per
frame falls with the number of frames. FORMAT.md, "SHAPES".
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from athcodec._native import SHAPE_MODES, address, lib
from athcodec.encoding import quantise as qz
from athcodec.encoding.motion import LEARNED_NUMBERS, LearnedModes, Plan, SegmentMotion, zeros

FAINT = 0.15  # Bend of rings, in steps, below which a learned mode drops it: it would stretch rings that turn.


@dataclass(frozen=True)
class Components:
    """Principal components of pieces' first modes over all frames analysed, in scene units.

    sizes: (P,) int32, modes of each piece. Of each piece in turn: 3 modes lengths in descending order, and as many unit
    vectors, a row each.
    """

    frames: int
    sizes: np.ndarray
    lengths: np.ndarray
    vectors: np.ndarray


def components(plan: Plan, segments: Iterable[SegmentMotion]) -> Components:
    """Return the components of segments that were analysed with a fine step and without learned modes, so that they
    describe the motion and not its rounding."""
    sizes, frames = np.minimum(plan.pieces["rank"], SHAPE_MODES).astype(np.int32), 0
    moments = zeros((int((9 * sizes.astype(np.int64) ** 2).sum()),))
    for segment in segments:
        frames += segment.frames
        steps = np.array([stream.step for stream in segment.streams])
        arrays = (array.ctypes.data for array in (sizes, steps, segment.coefficients, moments))
        lib.ath_add_mode_moments(plan.core, segment.frames, *arrays)
        del segment  # The next segment is made after this one has been freed.
    lengths, vectors = np.empty(3 * int(sizes.sum())), zeros(moments.shape)
    lib.ath_mode_components(len(sizes), *(array.ctypes.data for array in (sizes, moments, lengths, vectors)))
    return Components(frames, sizes, lengths, vectors)


def learn(plan: Plan, seen: Components, step: float, wanted: np.ndarray | None = None) -> LearnedModes:
    """Return the modes that a motion step makes worth storing, of the pieces `wanted`, (P,) bool, or of all."""
    least = step * np.sqrt(seen.frames)
    wanted = np.full(len(plan.pieces), True if wanted is None else wanted)
    counts = np.zeros(len(plan.pieces), np.int32)
    integers = zeros((3 * int(seen.sizes[wanted].sum()), LEARNED_NUMBERS), np.int32)
    count = lib.ath_learn_modes(
        plan.core,
        *(array.ctypes.data for array in (seen.sizes, wanted, seen.lengths, seen.vectors)),
        *(qz.MODE_STEP * least, qz.LARGEST_MODE, qz.LEAST_MODE * least, FAINT * least),
        counts.ctypes.data,
        integers.ctypes.data,
    )
    return _modes(counts, integers[:count].copy())


def nested(plan: Plan, modes: LearnedModes, wanted: np.ndarray, digits: int) -> LearnedModes:
    """Return the modes of the pieces `wanted`, (P,) bool, with so many binary digits less. Those of a piece end before
    the first that vanishes."""
    piece = np.repeat(np.arange(len(modes.counts)), modes.counts)
    integers = np.sign(modes.integers) * (np.abs(modes.integers) + (1 << digits - 1) >> digits)
    gone = np.cumsum(~(integers.any(axis=1) & wanted[piece]))
    kept = gone == np.append(0, gone)[modes.first[piece]]
    sizes = np.minimum(plan.pieces["rank"][piece[kept]], SHAPE_MODES)
    integers = integers[kept] * np.tile(np.arange(SHAPE_MODES) < sizes[:, None], 3)
    return _modes(np.bincount(piece[kept], minlength=len(modes.counts)).astype(np.int32), integers.astype(np.int32))


def _modes(counts: np.ndarray, integers: np.ndarray) -> LearnedModes:
    units, duals = np.zeros((2, *integers.shape))
    lib.ath_unit_shapes(len(integers), address(integers, np.int32, 0), address(units, np.float64, 0))
    lib.ath_mode_duals(len(counts), *(array.ctypes.data for array in (counts, units, duals)))
    return LearnedModes(counts, np.cumsum(counts, dtype=np.int64) - counts, integers, units, duals)


def estimated_bits(integers: np.ndarray, pieces: np.ndarray, piece_count: int) -> np.ndarray:
    """Return about how many bits integers (K, ...) of pieces (K,) take in a stream, (piece_count,)."""
    busy = np.flatnonzero(integers)
    bits = 2.0 * qz.bits(np.abs(integers.reshape(-1)[busy]).astype(np.float64)) + 1.0
    return np.bincount(pieces[busy // math.prod(integers.shape[1:])], bits, piece_count)
