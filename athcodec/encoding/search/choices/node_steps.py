"""Steps of the maps of inner nodes, which show the coarse stages (FORMAT.md, Affines stream)."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model.motion import Plan, SegmentMotion, position_errors
from athcodec.encoding.search import progress
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.segment import CodedPrelude, Source
from athcodec.encoding.segments.settings import Settings
from athcodec.encoding.streams import streams
from athcodec.motion.sampling import spread

# Steps that are tried, over the error of a stage: half octaves, and octaves from 8 on.
QUALITIES = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0, 32.0, 64.0, 128.0)
FEW_ROOTS = 4  # Roots up to which their maps have steps of their own: these are mostly a few bytes.
ROOT_QUALITIES = (0.7, 1.4, 2.8)  # Steps of these maps that are tried, over the error of stage 0.
FILE_SHARE = 0.02  # Share of the file that the maps may take.
FEW_BYTES = 320  # Bytes that they may take if these are more.
SMALL_FILE_SHARE = 0.04  # A file without layers may give its maps this share if that is less than FEW_BYTES.
ERROR_TOLERANCE = 1.08  # Cheaper maps may err by this much more than the finest ones.
FRAMES = 8  # Frames by which the error of a stage is measured.
USUAL_TRIALS = 6  # Steps that are usually tried.


def work_of_steps(trials: Trials) -> float:
    """Return about the work of choosing steps, which is done however little is left."""
    stages, vertices = trials.stages, trials.source.clip.vertex_count
    if stages == 1:
        return 0.0
    return (
        trials.work_of(progress.ANALYSIS + USUAL_TRIALS * progress.MAPS * stages) + progress.MAP_FIT * vertices * stages
    )


def best_node_steps(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with steps for the affine maps of nodes: the finest whose maps take at most their allowed
    share of the file, or coarser ones as long as these hardly raise the errors of the stages that the maps show.
    """
    prelude = trials.prelude(settings)
    errors = _stage_errors(trials, prelude.plan, settings.bound)
    sample = trials.samples[trials.middle].positions
    segment = _analysed(settings, trials)
    allowed = _allowed_bytes(settings, trials)
    tried = [quality * errors for quality in _qualities(trials)]

    def analyse(number: int) -> np.ndarray:
        segment.clear_nodes()
        trials.work.add(trials.work_of(progress.MAPS * trials.stages))
        segment.analyse_nodes(sample, tried[number], settings.rounding)
        return tried[number]

    def fits(number: int) -> bool:
        analyse(number)
        return _map_bytes(segment, trials) <= allowed

    finest = bisect_left(range(len(tried) - 1), True, key=fits)
    chosen, limits = analyse(finest), np.array(list(_errors_of_maps(prelude, segment, sample)))
    limits[1:] = np.minimum(ERROR_TOLERANCE * limits[1:], limits[:-1])  # Deeper stages stay better.
    for number in range(finest + 1, len(tried)):
        steps = analyse(number)
        if any(error > limit for error, limit in zip(_errors_of_maps(prelude, segment, sample), limits)):
            break
        chosen = steps
    return replace(settings, node_steps=chosen)


def cost_with_maps(settings: Settings, trials: Trials) -> float:
    """Return the estimated bytes of a whole file including its affine maps, whose steps are as large as the errors of
    their stages. For a file in layers, whose maps get their steps from other choices, return its bytes without maps.
    """
    if trials.is_layered:
        return trials.cost(settings)
    segment = _analysed(settings, trials)
    steps = _stage_errors(trials, segment.plan, settings.bound)
    segment.analyse_nodes(trials.samples[trials.middle].positions, steps, settings.rounding)
    trials.work.add(trials.work_of(progress.MAPS * trials.stages))
    return trials.cost(settings) + min(_map_bytes(segment, trials), _allowed_bytes(settings, trials))


def _allowed_bytes(settings: Settings, trials: Trials) -> float:
    """Return the bytes that maps may take."""
    rest = trials.stage_costs(settings).sum() + trials.prelude_bytes(settings)
    least = min(FEW_BYTES, SMALL_FILE_SHARE * rest) if _is_played_whole(trials) else FEW_BYTES
    return max(least, FILE_SHARE / (1 - FILE_SHARE) * rest)


def _analysed(settings: Settings, trials: Trials) -> SegmentMotion:
    """Return the sample that maps are tried on, which has none yet."""
    modes = trials.learned_modes(trials.prelude(settings).plan, settings)
    trials.work.add(trials.work_of(progress.ANALYSIS))
    return trials.analysed(settings, trials.middle, modes)


def inner_nodes(source: Source, ath: Ath, stages: int) -> np.ndarray:
    """Return the number of nodes of more than one branch, per stage."""
    hierarchy, branches = source.hierarchy, ath.node_branch
    branches = branches[hierarchy.subtree_branches[branches] > 1]
    return np.bincount(hierarchy.branch_depth[branches], minlength=stages)


def _stage_errors(trials: Trials, plan: Plan, bound: float) -> np.ndarray:
    """Return for each stage the step of its maps that would double the stage's error, (stages,) in scene units, as an
    error of all vertices of a node together. The stage's own error is the RMS that independent least-squares maps leave
    in a few frames, or `bound` if that is more.
    """
    source, ath, sample = trials.source, trials.ath, trials.samples[trials.middle].positions
    some = spread(sample.shape[2], FRAMES)
    frames = np.empty((len(some), *sample.shape[:2]))
    frames[:, source.hierarchy.vertex_source] = np.moveaxis(sample[:, :, some], 2, 0) + source.origin
    nodes = np.bincount(plan.nodes["stage"], plan.nodes["coded"], trials.stages)
    errors = np.full(trials.stages, bound)
    for stage in np.flatnonzero(nodes).tolist():
        if stage not in trials.map_errors:
            away = ath.approximation(frames, stage) - frames
            trials.map_errors[stage] = math.sqrt((away**2).sum() / (frames.size / 3))
            trials.work.add(progress.MAP_FIT * source.clip.vertex_count)
        whole = max(bound, trials.map_errors[stage])
        errors[stage] = whole * math.sqrt(source.clip.vertex_count / nodes[stage])
    return errors


def _map_bytes(segment: SegmentMotion, trials: Trials) -> float:
    """Return the bytes of the maps of nodes in a whole file whose segments are like this one."""
    nodes = trials.extrapolation.nodes
    size = sum(len(streams.encode_affines(segment, stage)) * nodes[stage] for stage in _map_stages(segment.plan))
    return size * trials.source.coded_frames / segment.frames


def _is_played_whole(trials: Trials) -> bool:
    """Return whether the file has one layer and segment: its coarse stages are hardly shown and need not meet."""
    return not trials.is_layered and not trials.source.has_seams


def _qualities(trials: Trials) -> list[np.ndarray]:
    """Return the qualities to try, (stages,) each, from fine to coarse. That of a few roots rises last, if at all."""
    qualities = [np.full(trials.stages, quality) for quality in QUALITIES]
    if (trials.source.hierarchy.branch_parent < 0).sum() > FEW_ROOTS:
        return qualities
    fine, *coarser = ROOT_QUALITIES if _is_played_whole(trials) else ROOT_QUALITIES[:1]
    roots, coarsest = [fine] * len(qualities) + coarser, qualities[-1:] * len(coarser)
    return [np.append(root, quality[1:]) for root, quality in zip(roots, qualities + coarsest)]


def _map_stages(plan: Plan) -> list[int]:
    return [stage for stage in range(plan.stage_count) if plan.has_affines(stage)]


def _errors_of_maps(prelude: CodedPrelude, segment: SegmentMotion, sample: np.ndarray) -> Iterator[float]:
    """Yield the RMS error, at each stage that has maps, of the segment against its source positions `sample`."""
    room = np.empty(sample.shape)
    for stage in _map_stages(prelude.plan):
        pose = segment.pose(stage, prelude.origin, prelude.dtype, room)
        yield position_errors(pose, sample, prelude.origin, prelude.plan.pool)[2]
