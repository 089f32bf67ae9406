"""Predicted motion, the other way to code a clip: every vertex of every frame about what is decoded (FORMAT.md).

It suits what waves and modes do not: growth, few frames, noise, jumps, rests. `best_prediction` finds its settings,
`code_predicted_segment` makes the chunks of a segment.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from athcodec._native import Rounding
from athcodec.decoding import container as ct
from athcodec.encoding import quantise as qz
from athcodec.encoding import streams
from athcodec.encoding.features import Feature
from athcodec.encoding.layers import Layer, Layers
from athcodec.encoding.motion import LevelStream, SegmentMotion, position_errors
from athcodec.encoding.search import Choice, SegmentSample, typical_segments
from athcodec.encoding.segment import CodedPrelude, Settings, Source, with_best_lags
from athcodec.encoding.shape import finer_than
from athcodec.encoding.survey import Ath, Survey
from athcodec.errors import BoundError
from athcodec.motion.thresholds import Thresholds

CUBES, LATTICE = False, True  # What positions are rounded to.
REST_STEPS = (0.5, 0.25, 0.125, 1.15)  # over the bound
STEPS = (0.999, 0.97, 0.9, 0.75, 0.5, 0.3)  # over the largest that reaches every point within the limit
TRIAL_SEGMENTS, TRIAL_FRAMES = 3, 64
STILL, FINE_STILL = 0.35, 0.25  # over the limit, errors whose second differences are at most 1.4 limits, or one
FINE = 9e-4  # over the diagonal, bounds below which it is to be one
UNSEEN, INVISIBLE = 1e-5, 1e-6  # over the diagonal, bounds from which on twitches count for less, and for nothing
TWITCHING = 0.02  # of the vertices, which may twitch in any frame
MOST_FOR_STILL = 2.0  # over the bytes without, that errors without twitches may take
TOO_MANY = 1.2  # over the bytes wanted, that a few frames may promise
MAP_SHARE, MAP_STEPS = 0.02, (0.1, 0.25, 0.5, 1.0)  # of the bytes, for level 0; over the error of the rest pose
LESS_ERROR = 0.9  # of level 0, with maps that are worth their bytes


def one_map_each(seen: Survey) -> Ath:
    """The ATH in which each root's subtree moves as one."""
    epsilon, xi = (float(errors.max(initial=0.0)) for errors in (seen.largest_gads, seen.largest_distance))
    return replace(seen, xi=None).ath(Thresholds(epsilon, 0, xi, 0))


def predicted_layers(source: Source, choice: Choice) -> tuple[Ath, CodedPrelude, Layers]:
    """What the segments share."""
    ath = one_map_each(source.seen)
    prelude = CodedPrelude(source, ath, choice.settings, predicted=True)
    only = Layer(prelude.plan, choice.settings, None)
    return ath, prelude, Layers(prelude.rest_chunk, prelude.source_rest, prelude.plan, [only])


def _settings(source: Source, ath: Ath, bound: float, rest_step: float) -> Settings:
    branches, levels = source.hierarchy.branch_count, ath.height + 2
    none = np.zeros(branches, bool)
    settings = Settings(
        bound=bound,
        largest_bound=source.largest_bound(bound),
        limit=source.limit(bound),
        step=_largest_step(source.limit(bound), CUBES),
        level_steps=np.ones(levels),
        rest_step=qz.single(rest_step),
        forms=np.zeros(branches, np.int32),
        loose=none,
        rigid=np.zeros(branches, np.int32),
        layer=0,
        free_rigid=False,
        turn_step=0.0,
        lags=np.zeros(branches, np.int32),
        details=finer_than(source.details, bound),
        connected_rest=False,
        rotation_step_factors=(0,) * levels,
        learned_bases=(False,) * levels,
        common_basis=False,
        learned_pieces=None,
        node_steps=np.ones(levels),
    )
    return with_best_lags(source, ath, settings)


@dataclass(frozen=True)
class FoundPrediction:
    """The choice that makes the smallest file with predicted motion, and its bytes but for what all files have."""

    choice: Choice
    bytes: float
    twitches: bool


def best_prediction(source: Source, bound: float, most_bytes: float) -> FoundPrediction | None:
    """None where that is above `most_bytes`, or the bound cannot be kept."""
    ath = one_map_each(source.seen)
    first, *others = (_settings(source, ath, bound, ratio * source.smallest_bound(bound)) for ratio in REST_STEPS)
    samples = _samples(source)
    preludes: dict[float, CodedPrelude] = {}

    def prelude_of(settings: Settings) -> CodedPrelude:
        if settings.rest_step not in preludes:
            preludes[settings.rest_step] = CodedPrelude(source, ath, settings, predicted=True)
        return preludes[settings.rest_step]

    def coded(settings: Settings, lattice: bool = CUBES, error_share: float = 1.0) -> FoundPrediction:
        own = replace(settings, step=_largest_step(error_share * settings.limit, lattice))
        choice = Choice(own, own, None, predicted=lattice, error_share=error_share)
        try:
            prelude = prelude_of(settings)
            parts = [(sample, *_predicted(prelude, choice, sample.positions)) for sample in samples]
        except BoundError:
            return FoundPrediction(choice, math.inf, False)
        motion = sum(len(payload) * sample.scale for sample, payload, _ in parts)
        twitches = any(_twitches(shown, sample.positions, settings.limit) for sample, _, shown in parts)
        return FoundPrediction(choice, motion + prelude.prelude_bytes, twitches)

    def best(found: Iterable[FoundPrediction]) -> FoundPrediction:
        return min(found, key=lambda one: one.bytes)

    try:
        if sum(_begun(prelude_of(first), first, sample) for sample in samples) > TOO_MANY * most_bytes:
            return None
    except BoundError:
        return None
    found = best(coded(own) for own in (first, *others))
    if Feature.LATTICE not in source.without:
        found = best([found, coded(found.choice.settings, LATTICE)])
    if found.twitches:
        relative = source.smallest_bound(bound) / source.seen.diagonal
        share = _still_share(relative)
        still = best(coded(own, CUBES, share) for own in (first, *others))
        if relative < FINE and Feature.LATTICE not in source.without:
            still = best([still, coded(still.choice.settings, LATTICE, share)])
        if still.bytes < min(most_bytes, MOST_FOR_STILL * found.bytes):
            found = still
    return found if found.bytes < most_bytes else None


def _still_share(relative: float) -> float:
    """Of the limit, for errors that do not twitch; it grows by less than the bound, over the diagonal, falls."""
    if relative >= FINE:
        return STILL
    unseen = math.log(UNSEEN / relative) / math.log(UNSEEN / INVISIBLE)
    return FINE_STILL ** (1.0 - min(max(unseen, 0.0), 1.0))


def _twitches(shown: np.ndarray, positions: np.ndarray, limit: np.ndarray | float) -> bool:
    """Whether second differences of the error over frames, (N, 3, T), are seen to be above the limit: of many vertices
    in some frames only, or of vertices that hardly jerk themselves.
    """
    if positions.shape[2] < 3:
        return False
    moved = np.linalg.norm(np.diff(positions, 2, axis=2), axis=1)
    error = np.linalg.norm(np.diff(shown - positions, 2, axis=2), axis=1)
    above = error > np.reshape(limit, (-1, 1))
    share, seen = above.mean(axis=0), (above & (error > moved)).mean(axis=0)
    return share.max() > max(TWITCHING, 2 * np.median(share)) or seen.max() > TWITCHING


def _largest_step(limit: np.ndarray | float, lattice: bool) -> float:
    """The largest that reaches every place within the limit."""
    return qz.single((qz.LATTICE_REST_CAP if lattice else qz.SAFE_REST_CAP) * float(np.min(limit)))


def _samples(source: Source) -> list[SegmentSample]:
    """A few segments spread over a clip; of several clips those that are typical."""
    if len(source.clip_range_segments) > 1:
        return [SegmentSample(source.positions(segment), frames) for segment, frames in typical_segments(source)]
    some = np.unique(np.linspace(0, len(source.segments) - 1, TRIAL_SEGMENTS).astype(int))
    positions = [source.positions(segment) for segment in some]
    scale = source.coded_frames / sum(own.shape[2] for own in positions)
    return [SegmentSample(own, scale * own.shape[2]) for own in positions]


def _begun(prelude: CodedPrelude, settings: Settings, sample: SegmentSample) -> float:
    """Bytes of the frames that a sample stands for, but for first ones, as far as a few of it tell."""
    some = sample.positions[:, :, :TRIAL_FRAMES]
    choice = Choice(settings, settings, None, predicted=CUBES)
    coded, first = (len(_predicted(prelude, choice, part)[0]) for part in (some, some[:, :, :1]))
    return (coded - first) / some.shape[2] * sample.frames


def _predicted(prelude: CodedPrelude, choice: Choice, positions: np.ndarray) -> tuple[bytes, np.ndarray]:
    """PREDICTED of a segment and its positions, (N, 3, T). Raises BoundError."""
    lattice, settings = choice.predicted, choice.settings
    assert lattice is not None
    source = np.ascontiguousarray(positions.transpose(2, 0, 1))
    limits = np.array(np.broadcast_to(settings.limit, len(positions)), np.float64)
    for share in dict.fromkeys((choice.error_share, 1.0)):  # the whole limit where numbers are too coarse for a part
        for factor in STEPS:
            step = qz.single(factor * _largest_step(share * limits, lattice))
            coded = streams.encode_predicted(
                prelude.plan, prelude.origin, source, share * limits, step, lattice, prelude.dtype
            )
            if coded is not None:
                return ct.pack_predicted(step, lattice, coded[0]), np.ascontiguousarray(coded[1].transpose(1, 2, 0))
    raise BoundError(
        f"max error: got {settings.bound:.3g}; it cannot be kept in the output's {prelude.dtype.name} numbers"
    )


def code_predicted_segment(
    prelude: CodedPrelude, choice: Choice, positions: np.ndarray, exact: np.ndarray | None, shown_times: np.ndarray
) -> tuple[dict[tuple[int, int], bytes], np.ndarray]:
    """Chunks and errors as CodedMotion.joined_to gives them; predicted motion is not joined. shown_times: as Source has
    them."""
    assert choice.predicted is not None
    plan, settings = prelude.plan, choice.settings
    payload, decoded = _predicted(prelude, choice, positions)

    def error(shown: np.ndarray) -> tuple[float, ...]:
        return position_errors(shown, positions, prelude.origin, plan.pool, shown_times)

    last = plan.level_count - 1
    chunks, level_0 = {(last, ct.PREDICTED): payload}, _still(prelude, positions.shape[2])
    errors = [error(level_0.pose(level, prelude.origin, prelude.dtype)) for level in range(last)]
    for moved in _with_maps(prelude, positions, errors[0][-1]):
        maps = streams.encode_affines(moved, 0)
        own = error(moved.pose(0, prelude.origin, prelude.dtype))
        if len(maps) <= MAP_SHARE * len(payload) and own[-1] < LESS_ERROR * errors[0][-1]:
            chunks[0, ct.AFFINES], errors[0] = maps, own
            break
    errors.append(error(decoded))
    if errors[-1][0] > settings.largest_bound:
        raise AssertionError(f"decoded error {errors[-1][0]} is beyond the bound {settings.largest_bound}")
    if exact is not None:
        chunks[last + 1, ct.EXACT] = streams.encode_exact(decoded, exact)
        errors.append((0.0, 0.0, 0.0))
    return chunks, np.array(errors)


def _still(prelude: CodedPrelude, frames: int) -> SegmentMotion:
    """A segment that shows the rest pose where no maps move it."""
    return SegmentMotion(prelude.plan, frames, [LevelStream(1.0)] * prelude.plan.level_count)


def _with_maps(prelude: CodedPrelude, positions: np.ndarray, error: float) -> Iterator[SegmentMotion]:
    """Segments with maps of the roots, from fine to coarse; error: that of the rest pose standing still (RMS)."""
    plan = prelude.plan
    for part in MAP_STEPS:
        moved = _still(prelude, positions.shape[2])
        step = part * error * (plan.vertex_count / len(plan.nodes)) ** 0.5
        if step > 0:
            moved.analyse_nodes(positions, np.full(plan.level_count, step), Rounding(qz.DEAD_ZONE), level=0)
            yield moved
