"""Predicted motion, the other way to code a clip: every vertex of every frame about what is decoded (FORMAT.md).

It suits what waves and modes do not: growth, few frames, noise, jumps, rests. `best_prediction` finds its settings,
`code_predicted_segment` makes the chunks of a segment.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from athcodec._native import Rounding
from athcodec.decoding import container as ct
from athcodec.encoding.clip.survey import Ath, Survey
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.motion import SegmentMotion, StageStream, position_errors
from athcodec.encoding.search.choices.node_steps import FILE_SHARE
from athcodec.encoding.search.choices.rest import with_best_rest
from athcodec.encoding.search.progress import PREDICTION, REST, Work
from athcodec.encoding.search.segment_samples import SAMPLES, TRIAL_FRAMES, SegmentSample, typical_segments
from athcodec.encoding.segments.levels import MOST_AWAY, SourceFrames
from athcodec.encoding.segments.predicted import code_predicted, largest_step
from athcodec.encoding.segments.segment import CodedPrelude, Source, plain_settings
from athcodec.encoding.segments.settings import Choice, Settings
from athcodec.encoding.streams import streams
from athcodec.errors import BoundError
from athcodec.files.threads import ranges
from athcodec.motion.algebra import length
from athcodec.motion.sampling import spread
from athcodec.motion.thresholds import Thresholds
from athcodec.options import SMOOTHNESS

REST_STEPS = (1.15, 0.5, 0.25, 0.125)  # Steps of the rest pose, in bounds.
USUAL_REST_RATIO = 0.5  # Step of the rest pose, in bounds, that is taken where none other is tried.
TOO_MANY = 1.2  # Bytes, over those allowed, that TRIAL_FRAMES have to promise for predicted motion to be given up.
STILL = 0.35  # Largest error, in limits, whose second differences stay within 1.4 limits.
CALMER = (0.5, 0.7)  # Larger errors, in limits, that are tried where those are too dear.
FINE_STILL = 0.25  # Largest error, in limits, whose second differences stay within one limit.
FINE = 9e-4  # Bound, in diagonals, below which second differences are held to one limit.
UNSEEN = 1e-5  # Bound, in diagonals, below which twitches count for less: a hundredth of a pixel.
INVISIBLE = 1e-6  # Bound, in diagonals, below which they count for nothing.
TWITCHING = 0.02  # Share of the vertices that may twitch in any frame.
HOPELESS = 1.05  # Factor on the bytes allowed at which other steps of the rest pose do not help.
MAP_STEPS = (0.1, 0.25, 0.5, 1.0)  # Steps of these maps that are tried, over the error of the rest pose.


def one_map_each(seen: Survey) -> Ath:
    """Return the ATH in which each root's subtree moves as one."""
    epsilon, xi = (float(errors.max(initial=0.0)) for errors in (seen.largest_gads, seen.largest_distance))
    return replace(seen, xi=None).ath(Thresholds(epsilon, 0, xi, 0))


def _settings(source: Source, ath: Ath, bound: float, rest_step: float) -> Settings:
    settings = plain_settings(source, ath.height + 2, bound, largest_step(source.limit(bound)), rest_step)
    return with_best_rest(source, ath, settings)


class Way(NamedTuple):
    """How motion is predicted: the step of the rest pose, in bounds, and the largest error, over the limit."""

    rest_ratio: float
    error_share: float = 1.0


@dataclass(frozen=True)
class FoundPrediction:
    """The choice that makes the smallest file with predicted motion, and its bytes but for what all files have.

    poses: those of the bytes that hierarchy and rest pose take.
    """

    way: Way
    choice: Choice
    bytes: float
    twitches: bool
    poses: float = 0.0

    def bytes_of(self, frames_ratio: float) -> float:
        """Return the bytes of a file of so many times the frames."""
        return self.poses + frames_ratio * (self.bytes - self.poses)


def best_prediction(
    source: Source, bound: float, most_bytes: float, work: Work, smoothness: str = "default", usual: bool = False
) -> FoundPrediction | None:
    """Find the way to predict the motion that takes fewest bytes, and return it. Return None if it takes `most_bytes`
    or more, or if no way keeps the bound. `smoothness`: how many more bytes a calmer motion may take, as the option of
    `encode`; `usual`: try the usual way alone.
    """
    ath = one_map_each(source.seen)
    limit = source.rest_limit(source.smallest_bound(bound))
    samples, vertices = _samples(source), source.clip.vertex_count

    @cache
    def by_ratio(ratio: float) -> Settings:
        work.add(REST * vertices)
        return _settings(source, ath, bound, ratio * limit)

    @cache
    def prelude_of(ratio: float) -> CodedPrelude:
        return CodedPrelude(source, ath, by_ratio(ratio), predicted=True)

    def coded(way: Way) -> FoundPrediction:
        """Return the prediction of one way, as coding the samples in it tells; its bytes are infinite if the bound is
        not kept.
        """
        settings = by_ratio(way.rest_ratio)
        stepped = replace(settings, step=largest_step(way.error_share * settings.limit))
        choice = Choice(stepped, stepped, None, predicted=True, error_share=way.error_share)
        work.add(PREDICTION * vertices * sum(source.frames_of(segment) for segment, _ in samples))
        motion, twitches = 0.0, False
        try:
            prelude = prelude_of(way.rest_ratio)
            for sample in _read(source, samples):
                payload, shown = _predicted(prelude, choice, sample.positions)
                motion += len(payload) * sample.scale
                twitches = twitches or _twitches(shown, sample.positions, settings.limit)
                del sample, shown  # One segment is in memory at a time.
        except BoundError:
            return FoundPrediction(way, choice, math.inf, False)
        return FoundPrediction(way, choice, motion + prelude.prelude_bytes, twitches, prelude.prelude_bytes)

    def best(share: float, most: float) -> FoundPrediction:
        """Return the best prediction whose errors are at most a share of the limit; far above `most`, any."""
        ratios = sorted(REST_STEPS, key=lambda ratio: abs(math.log(ratio / share)))
        prediction = coded(Way(ratios[0], error_share=share))
        if prediction.bytes > HOPELESS * most:
            return prediction
        tried = [prediction, *(coded(Way(ratio, error_share=share)) for ratio in ratios[1:])]
        return min(tried, key=lambda one: one.bytes)

    if usual:
        prediction = coded(Way(USUAL_REST_RATIO))
        return prediction if prediction.bytes < most_bytes else None
    work.add(PREDICTION * vertices * sum(min(TRIAL_FRAMES, source.frames_of(segment)) for segment, _ in samples))
    try:
        prelude, settings = prelude_of(USUAL_REST_RATIO), by_ratio(USUAL_REST_RATIO)
        if sum(_begun(prelude, settings, sample) for sample in _read(source, samples)) > TOO_MANY * most_bytes:
            return None
    except BoundError:
        return None
    prediction = best(1.0, most_bytes)
    if prediction.bytes > HOPELESS * most_bytes:
        return None
    if prediction.twitches and smoothness != "bytes":
        relative = source.smallest_bound(bound) / source.seen.diagonal
        most = min(most_bytes, SMOOTHNESS[smoothness] * prediction.bytes)
        for share in _still_shares(relative, smoothness):
            still = best(share, most)
            if still.bytes < most:
                prediction = still
                if not (still.twitches and smoothness == "motion"):
                    break
    return prediction if prediction.bytes < most_bytes else None


def _still_shares(relative: float, smoothness: str) -> list[float]:
    """Return the shares of the limit that errors may be held to, as they are tried: from small to large until one is
    not too dear, or for the calmest motion from large to small until nothing twitches."""
    least = _still_share(relative)
    if smoothness == "motion":
        return [least, *(share for share in (FINE_STILL,) if share < least and relative >= FINE)]
    return [least, *(share for share in CALMER if share > least)]


def _still_share(relative: float) -> float:
    """Return the share of the limit for errors that do not twitch. It grows by less than the bound falls."""
    if relative >= FINE:
        return STILL
    unseen = math.log(UNSEEN / relative) / math.log(UNSEEN / INVISIBLE)
    return FINE_STILL ** (1.0 - min(max(unseen, 0.0), 1.0))


def _twitches(shown: np.ndarray, positions: np.ndarray, limit: np.ndarray | float) -> bool:
    """Return whether the error of `shown` positions about the source's `positions`, (N, 3, T) each, makes vertices
    twitch visibly. An error twitches where its second difference over frames exceeds `limit`, one or (N,). It is
    visible if many vertices twitch in few frames only, or if many twitch by more than the source's own second
    differences.
    """
    if positions.shape[2] < 3:
        return False
    limits, counts = np.broadcast_to(limit, len(positions)), np.zeros((2, positions.shape[2] - 2), np.int64)
    for start, stop in ranges(len(positions), positions[0].size):
        rows = shown[start:stop] - positions[start:stop], positions[start:stop]
        error, moved = (np.linalg.norm(np.diff(some, 2, axis=2), axis=1) for some in rows)
        above = error > limits[start:stop, None]
        counts += above.sum(axis=0), (above & (error > moved)).sum(axis=0)
    share, seen = counts / len(positions)
    return share.max() > max(TWITCHING, 2 * np.median(share)) or seen.max() > TWITCHING


def _samples(source: Source) -> list[tuple[int, float]]:
    """Return a few segments spread over a clip, or the typical segments of several clips: pairs of a segment and the
    number of frames that it stands for."""
    if len(source.clip_range_segments) > 1:
        return [(segment, frames) for segment, frames in typical_segments(source)]
    chosen = spread(len(source.segments), SAMPLES)
    scale = source.coded_frames / sum(map(source.frames_of, chosen))
    return [(segment, scale * source.frames_of(segment)) for segment in chosen]


def _read(source: Source, samples: list[tuple[int, float]]) -> Iterator[SegmentSample]:
    """Yield samples with their positions, of which this holds none."""
    return (SegmentSample(source.positions(segment), frames) for segment, frames in samples)


def _begun(prelude: CodedPrelude, settings: Settings, sample: SegmentSample) -> float:
    """Return the bytes of the frames that a sample stands for, without first frames, as far as its first ones tell."""
    some = sample.positions[:, :, :TRIAL_FRAMES]
    choice = Choice(settings, settings, None, predicted=True)
    coded, first = (len(_predicted(prelude, choice, part)[0]) for part in (some, some[:, :, :1]))
    return (coded - first) / some.shape[2] * sample.frames


def _predicted(prelude: CodedPrelude, choice: Choice, positions: np.ndarray) -> tuple[bytes, np.ndarray]:
    """Code the motion of a segment by prediction, as `code_predicted` does."""
    return code_predicted(prelude.plan, prelude.output, choice.settings, choice.error_share, positions)


def code_predicted_segment(
    prelude: CodedPrelude,
    choice: Choice,
    positions: np.ndarray,
    exact: np.ndarray | None,
    shown_times: np.ndarray,
    box: np.ndarray,
) -> tuple[dict[tuple[int, int], bytes], np.ndarray, np.ndarray, np.ndarray]:
    """Code a segment by prediction. Return four things: its chunks as {(stage, kind): payload}; the errors of its
    stages by each of MEASURES, (stages, 3); their joins, which are all 0; and their flaws, (stages, 2), as SourceFrames
    measures them.

    `positions`: (N, 3, T) of the source, less the origin; `exact`: the source's own numbers, to be coded as one more
    stage, or None; `shown_times`: how many frames of the clip show each frame, (T,); `box`: corners of the source, (2,
    3).
    """
    plan, settings = prelude.plan, choice.settings
    payload, by_frame = _predicted(prelude, choice, positions)
    decoded = np.ascontiguousarray(by_frame)
    del by_frame

    def error(shown: np.ndarray) -> tuple[float, ...]:
        return position_errors(shown, positions, prelude.origin, plan.pool, shown_times, prelude.shares)

    last = plan.stage_count - 1
    chunks, stage_0 = {(last, ct.PREDICTED): payload}, _still(prelude, positions.shape[2])
    source = SourceFrames(positions, shown_times, None, box, settings.bound, plan.pool)
    coarse = stage_0.pose(0, prelude.origin, prelude.dtype)
    errors, away = [error(coarse)], source.flaws(coarse, None)[0]
    for moved in _with_maps(prelude, positions, errors[0][-1]):
        maps = streams.encode_affines(moved, 0)
        pose = moved.pose(0, prelude.origin, prelude.dtype)
        with_maps, map_away = error(pose), source.flaws(pose, None)[0]
        stays = map_away <= max(away, MOST_AWAY * length(box[1] - box[0]))
        if stays and len(maps) <= FILE_SHARE * len(payload) and with_maps[-1] < errors[0][-1]:
            chunks[0, ct.AFFINES], errors[0], away = maps, with_maps, map_away
            break
    errors.append(error(decoded))
    if errors[-1][0] > settings.largest_bound:
        raise AssertionError(f"decoded error {errors[-1][0]} is beyond the bound {settings.largest_bound}")
    if exact is not None:
        chunks[last + 1, ct.EXACT] = streams.encode_exact(decoded, exact)
        errors.append((0.0, 0.0, 0.0))
    flaws = [(away, 0.0)] + [(0.0, 0.0)] * (len(errors) - 1)
    return chunks, np.array(errors), np.zeros(len(errors), int), np.array(flaws)


def _still(prelude: CodedPrelude, frames: int) -> SegmentMotion:
    """Return a segment that shows the rest pose where no maps move it."""
    return SegmentMotion(prelude.plan, frames, [StageStream(1.0)] * prelude.plan.stage_count)


def _with_maps(prelude: CodedPrelude, positions: np.ndarray, error: float) -> Iterator[SegmentMotion]:
    """Yield segments in which the rest pose is moved by one affine map of each root, with steps of the maps from fine
    to coarse. `error`: the RMS error of the rest pose that stands still, which the steps are in proportion to.
    """
    plan = prelude.plan
    for part in MAP_STEPS:
        moved = _still(prelude, positions.shape[2])
        step = part * error * (plan.vertex_count / len(plan.nodes)) ** 0.5
        if step > 0:
            moved.analyse_nodes(positions, np.full(plan.stage_count, step), Rounding(qz.DEAD_ZONE), stage=0)
            yield moved
