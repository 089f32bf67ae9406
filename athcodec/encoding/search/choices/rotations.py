"""Rotations: whether stems are predicted as turned with what they are attached to, and how finely (FORMAT.md)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from athcodec.decoding.container import ROTATION_FACTORS
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search.choices import learned_bases
from athcodec.encoding.search.hopeless import Hopeless
from athcodec.encoding.search.segment_samples import FRAMES, SegmentSample
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.segment import Source
from athcodec.encoding.segments.settings import Settings
from athcodec.motion.algebra import decompose, determinant
from athcodec.motion.sampling import spread

HOPELESS_RATIO = 1.5  # Rotations that make a file so many times larger are not tried at the roots alone either.
HOPELESS_STILL = 1.1  # Branches whose bending turns nothing, the same; time bases have not made up for more than 1.02.
FAR_SMALLER = 0.8  # Share of the bytes in waves at which time bases stay at once.
TRIALS_BEFORE_BASES = 20  # Trials up to which those of forms and rotations may leave none for time bases.

FINEST = ROTATION_FACTORS[1]
LEAST_TURN = 0.35  # Radians by which what turns as a whole turns at least.
MOST_BENT = 0.25  # Largest share of the squares of its motion about its centre that is then no turn.


def first_rotations(
    source: Source, samples: Sequence[SegmentSample], rigid: np.ndarray, stages: int
) -> tuple[int, ...]:
    """Return the factor of each stage that a search starts with: none turn, or the roots do where most of what stands
    on them turns with them. Other choices, above all the mean pose, depend on it too much to wait for rotations. rigid:
    (B,) of branches that turn in any case if it is not 0."""
    turns = Feature.ROTATIONS not in source.without and not _are_rigid_roots(source, rigid)
    turns = turns and _turn_as_wholes(source, samples)
    count = min(2, stages) if turns else 0
    return (FINEST,) * count + (0,) * (stages - count)


def rigid_roots_turn(source: Source, samples: Sequence[SegmentSample], rigid: np.ndarray) -> bool:
    """Return whether the roots are rigid, and turn what stands on them as a whole without a rotation factor."""
    return _are_rigid_roots(source, rigid) and _turn_as_wholes(source, samples)


def _are_rigid_roots(source: Source, rigid: np.ndarray) -> bool:
    return bool(rigid[source.hierarchy.branch_parent < 0].all())


def with_fine_roots(settings: Settings) -> Settings:
    """Return the settings with fine turns, if roots alone turn: a coarse turn in one layer moves a crown far, which
    leaves little for the next layer to be predicted from."""
    if not settings.roots_turn:
        return settings
    factors = tuple(FINEST if factor else 0 for factor in settings.rotation_step_factors)
    return replace(settings, rotation_step_factors=factors)


def _turn_as_wholes(source: Source, samples: Sequence[SegmentSample]) -> bool:
    """Return whether most of the plant belongs to trees that turn as a whole by much more than they bend."""
    roots = np.flatnonzero(source.hierarchy.branch_parent < 0)
    first = source.hierarchy.first_vertex[roots]
    rest = _about_centres(source.rest, first)
    size2 = _sums(np.square(rest), first).sum(axis=1)
    moved, bent, turned = (np.zeros(len(roots)) for _ in range(3))
    for sample in samples:
        for frame in spread(sample.positions.shape[2], FRAMES):
            pose = _about_centres(sample.positions[:, :, frame], first)
            moments = _sums((pose[:, :, None] * rest[:, None]).reshape(-1, 9), first).reshape(-1, 3, 3)
            left, stretch, right = decompose(moments)
            stretch[:, 2] *= np.sign(determinant(left) * determinant(right))
            both, along = size2 + _sums(np.square(pose), first).sum(axis=1), stretch.sum(axis=1)
            way = both - 2 * np.trace(moments, axis1=1, axis2=2)
            moved, bent, turned = moved + way, bent + np.maximum(both - 2 * along, 0), np.maximum(turned, way)
    is_far = turned >= LEAST_TURN**2 * size2 / 2  # What turns about its longest axis has hardly any levers.
    turning = is_far & (bent <= MOST_BENT * moved)
    return bool(size2[turning].sum() > size2.sum() / 2)


def candidates(settings: Settings, factors: tuple[int, ...] = ROTATION_FACTORS) -> list[Settings]:
    """Return the settings with each rotation factor at all stages."""
    return [settings.with_rotations(factor) for factor in factors]


def still_if_smaller(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with branches whose bending turns what they carry, or does not: a sum of a few shapes has as
    few tracks only in frames that do not turn. Where time bases make a file far smaller than waves do, they stay, so
    that the choices that follow are made in them, and take less work. Where little work is left, they stay if they are
    smaller at all: they would be tried after other choices, and would not be then."""
    in_waves, best = _first_moves(settings, trials)
    has_time = trials.work.left >= TRIALS_BEFORE_BASES * trials.work_of_trial
    smaller = FAR_SMALLER if has_time else 1.0
    return best if trials.cost(best) <= smaller * trials.cost(in_waves) else replace(in_waves, still=best.still)


def _kinds(settings: Settings, trials: Trials) -> list[tuple[Settings, list[Settings]]]:
    """Return for both kinds of branches, those of the settings first, the settings in waves and in time bases."""
    kinds = [settings] if trials.without(Feature.STILL) else [settings, _other_kind(settings).in_waves()]
    return [(in_waves, learned_bases.candidates(in_waves, trials)) for in_waves in kinds]


def _first_moves(settings: Settings, trials: Trials) -> tuple[Settings, Settings]:
    """Return two settings: the cheapest in waves, and the cheapest of those in waves or learned time bases. Where
    little work is left, both are the same, and waves alone are tried, because no other choice saves as much as this
    one.
    """
    kinds = _kinds(settings, trials)
    if kinds[1:] and trials.costs([kinds[1][0]])[0] > HOPELESS_STILL * trials.cost(settings):
        del kinds[1:]
    tried = [in_waves for in_waves, _ in kinds]
    in_waves = trials.cheapest(tried)
    if not trials.work.fits(2 * trials.work_of_trial):
        return in_waves, in_waves
    if any(settings.rotation_step_factors):  # What turns steadily is a sum of a few shapes in each kind of branches.
        tried += next(in_bases for one, in_bases in kinds if one is in_waves)
    else:
        tried += [candidate for _, in_bases in kinds[1:] for candidate in in_bases]
        if not in_waves.still:  # One time basis alone would win against waves.
            tried += kinds[0][1][:1]
    return in_waves, trials.cheapest(tried)


def typical_moves(settings: Settings, trials: Trials, hopeless: Hopeless) -> list[Settings]:
    """Return the cheapest settings in waves, and the cheapest in time bases, whatever work is left, but for those that
    are `hopeless`. Branches that are, by their bytes in waves, have these alone."""
    known, of_branches = hopeless.on_pieces, hopeless.on_branches
    kinds = [kind for kind in _kinds(settings, trials) if of_branches.still in (None, kind[0].still)]
    in_waves = min((in_waves for in_waves, _ in kinds), key=trials.cost)
    least = trials.cost(in_waves)
    kinds = [kind for kind in kinds if trials.cost(kind[0]) <= HOPELESS_STILL * least]
    if any(settings.rotation_step_factors) or hopeless.is_in_waves(least):
        return [in_waves]
    in_bases = [candidate for _, in_bases in reversed(kinds) for candidate in in_bases if known.has_hope(candidate)]
    if not in_bases:
        return [in_waves]
    best = min(in_bases, key=trials.cost)
    known.compare_bases(in_bases, trials.costs(in_bases))
    of_branches.still = best.still
    return [in_waves, best]


def _other_kind(settings: Settings) -> Settings:
    """Return the settings with the other kind of branches, whose modes would have to be learned anew."""
    return replace(settings, still=not settings.still, learned_pieces=None)


def turned_over(settings: Settings, trials: Trials) -> list[Settings]:
    """Return the settings with the other kind of branches, in each time basis."""
    if trials.without(Feature.STILL):
        return []
    other = _other_kind(settings)
    return [other.in_waves(), *learned_bases.candidates(other, trials)]


def fast_rotations(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with the best of a few factors."""
    return best_rotations(settings, trials, ROTATION_FACTORS[:2])


def best_rotations(settings: Settings, trials: Trials, factors: tuple[int, ...] = ROTATION_FACTORS) -> Settings:
    """Return the settings with those rotation factors, of `factors`, that cost fewest bytes: one for all stages, one
    for each stage, or one for the stages of the roots alone.
    """
    if trials.without(Feature.ROTATIONS):
        return settings
    uniform = candidates(settings, factors)
    unturned, *turned = costs = trials.costs(uniform)
    if max(costs) == math.inf or min(turned) > HOPELESS_RATIO * unturned:
        return trials.cheapest([settings, *uniform])
    per_stage = np.array([trials.stage_costs(candidate) for candidate in uniform])
    mixed = replace(settings, rotation_step_factors=tuple(factors[i] for i in per_stage.argmin(axis=0)))
    all_turn = [replace(candidate, roots_turn=False) for candidate in uniform[1:] if settings.roots_turn]
    return trials.cheapest([settings, mixed, *_with_turning_roots(settings, trials, factors), *uniform, *all_turn])


def _with_turning_roots(settings: Settings, trials: Trials, factors: tuple[int, ...]) -> list[Settings]:
    """Return the settings with each rotation factor at the first stages alone, where roots have their stems: at stage 0
    if they move as one, else at stage 1. What stands on a root turns with it."""
    has_stems = [trials.prelude(settings).plan.has_stems(stage) for stage in range(settings.stages)]
    stages = [stage for stage in (1, 2) if any(has_stems[:stage]) and stage < settings.stages]
    tried = [(factor,) * stage + (0,) * (settings.stages - stage) for stage in stages for factor in factors if factor]
    return [replace(settings, rotation_step_factors=of_stages) for of_stages in tried]


def _sums(values: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return the sums of rows, (N, k), of runs that begin at `first`."""
    sums: np.ndarray = np.add.reduceat(values, first)
    return sums


def _about_centres(positions: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return positions, (N, 3), less the mean of their run."""
    count = np.diff(np.append(first, len(positions)))
    away: np.ndarray = positions - np.repeat(_sums(positions, first) / count[:, None], count, axis=0)
    return away
