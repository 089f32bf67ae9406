"""Rigid parts: which branches move without bending, and how finely they turn (FORMAT.md, Rigid).

A card that is smaller than the bound is noise after affine functions and modes have been quantised to it. As a rigid
part it keeps its shape whatever the bound, and takes three rows in place of nine. A twig of few bounds has no direction
that its noise would not turn, and throws the leaves on it about. As a rigid part it holds them still.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from athcodec._native import PIECE_VERTICES
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search.choices.steps import STEP_FACTOR
from athcodec.encoding.search.segment_samples import FRAMES, SegmentSample
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.segment import Source
from athcodec.encoding.segments.settings import Settings
from athcodec.motion.algebra import decompose, determinant, multiply
from athcodec.motion.sampling import spread

MOST_BEND = 0.3  # Distance, in bounds, by which a rigid part may bend in the source.
STIFF_BEND = 0.05  # Distance, in bounds, up to which a part of any size is rigid.
LARGEST = 20.0  # Size of a part, in bounds, up to which the bound would spoil its shape.
CARRIER = 8.0  # Size of a part that carries others, in bounds, up to which it is rigid where it bends within the bound.
TURN_STEP = qz.half_octave(-7)  # Largest step of rotations, in radians: their errors are 1 to 2 degrees.
MOST_TURN = 15  # Half octaves below 1 radian of the finest largest step.
CALM_COST = 1.03  # Bytes that all calmer steps may cost, over those of the first.
CALM_SHARE = 1e-4  # Share of the vertices of small rigid parts, over all frames, that may be corrected.


def first_rigid(
    source: Source, bound: float, samples: Sequence[SegmentSample], ratios: Sequence[int]
) -> tuple[np.ndarray, float]:
    """Return two things: for each branch in how many of the layers it moves rigidly, (B,) int32; and the largest step
    of rotations, 0 if it is not limited. Only leaves and branches that are to keep their shape may be rigid. `ratios`:
    the step of each layer over that of the last.
    """
    hierarchy, least = source.hierarchy, source.smallest_bound(bound)
    if Feature.RIGID in source.without:
        return np.zeros(hierarchy.branch_count, np.int32), 0.0
    wanted = source.sheet_like | source.keeps_shape
    rigid = _rigid_layers(source, wanted, [sample.positions for sample in samples], [ratio * least for ratio in ratios])
    turns = rigid[source.keeps_shape].any() and Feature.TURN not in source.without
    return rigid, TURN_STEP if turns else 0.0


def best_freedom(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with rigid branches that move away from what they hang on, or not."""
    if trials.without(Feature.FREE_RIGID) or not (settings.rigid > settings.layer).any():
        return settings
    return trials.cheapest([settings, replace(settings, free_rigid=True)])


def calm_parts(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with a finer step, of all motion or of rotations alone, if corrections would make many small
    rigid parts twitch, and if the finer step costs few bytes more.
    """
    most, share = CALM_COST * trials.cost(settings), _corrected_parts(settings, trials)
    while share > CALM_SHARE:
        finer = (
            replace(settings, step=qz.single(settings.step / STEP_FACTOR)),
            replace(settings, turn_step=_finer_turn(settings.turn_step)),
        )
        calmer = {_corrected_parts(tried, trials): tried for tried in finer if trials.cost(tried) <= most}
        if min(calmer, default=share) >= share:
            break
        share = min(calmer)
        settings = calmer[share]
    return settings


def _corrected_parts(settings: Settings, trials: Trials) -> float:
    """Return which share of the vertices of small rigid parts, over all frames, have to be corrected. A part is small
    if the largest step of rotations moves its vertices by less than the step of motion.
    """
    if not settings.turn_step:
        return 0.0
    plan = trials.prelude(settings).plan
    small = plan.is_rigid & (plan.levers() * settings.turn_step < settings.step)
    is_small = np.repeat(small, plan.pieces["count"])
    if not is_small.any():
        return 0.0
    coded = trials.coded(settings, trials.middle, trials.learned_modes(plan, settings))
    return is_small[coded.corrected].sum() / (max(1, is_small[coded.sample].sum()) * coded.segment.frames)


def _finer_turn(turn_step: float) -> float:
    """Return the next finer largest step of rotations, or the finest."""
    return qz.half_octave(-min(qz.turn_of(turn_step) + 1, MOST_TURN))


def _rigid_layers(
    source: Source, wanted: np.ndarray, samples: Sequence[np.ndarray], bounds: Sequence[float]
) -> np.ndarray:
    """Return for each branch in how many layers it counts as rigid, (B,) int32: those at whose bound it bends little,
    or is itself small. `wanted`: (B,) bool, which branches may be rigid; `samples`: arrays (N, 3, T) of positions;
    `bounds`: the bounds of the layers, descending.
    """
    first, count, rest = source.hierarchy.first_vertex, source.hierarchy.stem_count, source.rest
    layers, carries = np.zeros(len(count), np.int32), source.hierarchy.subtree_branches > 1
    for size in np.unique(count[wanted & (count > 2) & ((count <= PIECE_VERTICES) | carries)]).tolist():
        branches = np.flatnonzero(wanted & (count == size))
        vertices = first[branches, None] + np.arange(size)
        bend = np.max([_bends(rest[vertices], sample, vertices) for sample in samples], axis=0)
        extent = np.linalg.norm(np.ptp(rest[vertices], axis=1), axis=1)
        for bound in bounds:  # Refined rotations cost more than refined modes, so only parts that need them have them.
            keeps = (extent <= LARGEST * bound) | (bend <= STIFF_BEND * bound)
            keeps &= (bend <= MOST_BEND * bound) & (size <= PIECE_VERTICES)
            layers[branches] += keeps | (carries[branches] & (extent <= CARRIER * bound) & (bend <= bound))
    return layers


def _bends(shapes: np.ndarray, sample: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Return for each part how far any of its vertices is at most from where the nearest rigid motion takes it, (B,),
    in some frames of a sample. `shapes`: rest positions of the parts, (B, n, 3); `sample`: positions, (N, 3, T);
    `vertices`: the vertices of the parts in it, (B, n).
    """
    d = shapes - shapes.mean(axis=1, keepdims=True)
    worst = np.zeros(len(shapes))
    for t in spread(sample.shape[2], FRAMES):
        x = sample[:, :, t][vertices]
        x = x - x.mean(axis=1, keepdims=True)
        u, _, v = decompose(multiply(x.transpose(0, 2, 1), d))
        u[:, :, 2] *= np.sign(determinant(u) * determinant(v))[:, None]
        away = x - multiply(d, multiply(u, v).transpose(0, 2, 1))
        worst = np.maximum(worst, np.linalg.norm(away, axis=2).max(axis=1))
    return worst
