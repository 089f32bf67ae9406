"""The settings that a search starts with, and those of a clip that stands still, which needs no search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.options.features import Feature
from athcodec.encoding.options.shape import LENGTH_STEP
from athcodec.encoding.search.choices import rest
from athcodec.encoding.search.choices.forms import first_forms
from athcodec.encoding.search.choices.rigid import first_rigid
from athcodec.encoding.search.choices.rotations import first_rotations
from athcodec.encoding.search.segment_samples import SegmentSample, usual_change
from athcodec.encoding.segments.layers import layered_poses_size
from athcodec.encoding.segments.segment import Source, plain_settings, poses_size
from athcodec.encoding.segments.settings import Choice, Settings

AT_ONCE_SHARE = 0.9  # Largest share of the size of a rest pose to refine at which all layers have one pose.
STILL_STEP = 1024.0  # Quantisation step, in bounds, that rounds every coefficient of a still stem to zero.


def first_settings(
    source: Source, ath: Ath, bound: float, samples: Sequence[SegmentSample], ratios: Sequence[int] = (1,)
) -> Settings:
    """Return the settings that a search for the last layer starts with. `bound`: in scene units; `ratios`: the step of
    each layer over that of the last, descending to 1.
    """
    is_layered, (rigid, turn_step) = len(ratios) > 1, first_rigid(source, bound, samples, ratios)
    relative = bound / source.seen.diagonal if source.seen.diagonal > 0 else 1e-4
    step, rest_step = bound * qz.first_step_ratio(relative), source.rest_limit(bound) * qz.rest_step_ratio(relative)
    settings = plain_settings(source, ath.height + 2, bound, step, rest_step)
    factors = first_rotations(source, samples, rigid, settings.stages)
    settings = replace(
        settings,
        forms=first_forms(source, samples),
        rigid=rigid,
        layer=len(ratios) - 1,
        turn_step=turn_step,
        rotation_step_factors=factors,
        roots_turn=any(factors),
        details=source.details if is_layered else settings.details,
        usual_change=usual_change(samples) if source.has_seams else np.inf,
    )
    return _in_layers(source, ath, settings, ratios) if is_layered else rest.with_best_rest(source, ath, settings)


def _in_layers(source: Source, ath: Ath, settings: Settings, ratios: Sequence[int]) -> Settings:
    """Return settings for a file in layers, of two kinds whichever is better: either each layer refines the rest pose
    of the layer before, or all layers have the rest pose of the last one. The latter is taken if it makes the file much
    smaller, or if an error of the rest pose is asked for that only the last layer can hold. `ratios`: the step of each
    layer over that of the last.
    """
    at_once = rest.with_best_rest(source, ath, replace(settings, coarsest_rest_step=0.0))
    if source.has_source_rest and source.rest_error < math.inf:
        return at_once
    # Lags that are best at once are worse where layers refine them.
    refined = replace(
        settings,
        lags=rest.lags(source, settings.rest_step, settings.details),
        coarsest_rest_step=qz.single(LENGTH_STEP * source.rest_error),
    )
    size = rest.judge(source, ath, layered_poses_size)
    rings = rest.ring_lags(refined)
    if Feature.ADAPTIVE not in source.without and not np.array_equal(rings, refined.lags):
        refined = min(refined, replace(refined, lags=rings), key=lambda settings: size(settings, ratios))
    refined = rest.connected_if_smaller(source, ath, refined)
    return at_once if size(at_once, ratios) < AT_ONCE_SHARE * size(refined, ratios) else refined


def still_choice(source: Source, ath: Ath, bound: float, ratio: int) -> Choice:
    """Return the choice for a clip all of whose frames are the rest pose: no motion, and a rest pose as precise as the
    bound asks. `ratio`: the step of the first layer over that of the last.
    """
    step, least = STILL_STEP * source.smallest_bound(bound), 0.5 * source.rest_limit(source.smallest_bound(bound))
    settings = first_settings(source, ath, bound, [SegmentSample(source.positions(0), source.coded_frames)])
    slack = source.rest_limit(float(np.min(settings.limit))) - float(np.spacing(source.largest_number))
    settings = rest.with_slack(source, ath, settings, max(slack, least))
    tried = settings, replace(settings, rest_slack=0.0)  # What has detail moves along and may leave the bound.
    settings = min(tried, key=rest.judge(source, ath, poses_size))
    node_steps = np.full(settings.stages, STILL_STEP * source.seen.diagonal + step)
    settings = replace(settings, step=qz.single(step), node_steps=node_steps)
    return Choice(settings, settings.coarser(ratio), None)
