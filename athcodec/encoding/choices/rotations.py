"""Rotations: whether stems are predicted as turned with what they are attached to, and how finely (FORMAT.md)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from athcodec.decoding.container import ROTATION_FACTORS
from athcodec.encoding.choices import learned_bases
from athcodec.encoding.features import Feature
from athcodec.encoding.settings import Settings
from athcodec.encoding.trials import Trials

HOPELESS_RATIO = 1.5  # Rotations that make a file so many times larger are not tried at the roots alone either.
HOPELESS_STILL = 1.1  # Branches whose bending turns nothing, the same; time bases have not made up for more than 1.02.


def candidates(settings: Settings, factors: tuple[int, ...] = ROTATION_FACTORS) -> list[Settings]:
    """Return the settings with each rotation factor at all levels."""
    return [settings.with_rotations(factor) for factor in factors]


def still_if_smaller(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with branches whose bending turns what they carry, or does not: a sum of a few shapes has as
    few tracks only in frames that do not turn."""
    if trials.without(Feature.STILL):
        return settings
    in_waves, *in_bases = turned_over(settings, trials)
    if trials.costs([in_waves])[0] > HOPELESS_STILL * trials.cost(settings):
        return settings
    tried = [settings, in_waves]
    if trials.work.fits(2 * trials.work_of_trial):  # One time basis alone would win against waves.
        tried += [*learned_bases.candidates(settings, trials)[:1], *in_bases[:1]]
    return replace(settings, still=trials.cheapest(tried).still)


def turned_over(settings: Settings, trials: Trials) -> list[Settings]:
    """Return the settings with the other kind of branches, in each time basis."""
    if trials.without(Feature.STILL):
        return []
    other = replace(settings, still=not settings.still, learned_pieces=None)
    return [other.in_waves(), *learned_bases.candidates(other, trials)]


def fast_rotations(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with the best of a few factors."""
    return best_rotations(settings, trials, ROTATION_FACTORS[:2])


def best_rotations(settings: Settings, trials: Trials, factors: tuple[int, ...] = ROTATION_FACTORS) -> Settings:
    """Return the settings with the best factor: one for all levels, one for each level, or one for the roots alone."""
    if trials.without(Feature.ROTATIONS):
        return settings
    uniform = candidates(settings, factors)
    unturned, *turned = costs = trials.costs(uniform)
    if max(costs) == math.inf or min(turned) > HOPELESS_RATIO * unturned:
        return trials.cheapest([settings, *uniform])
    per_level = np.array([trials.level_costs(candidate) for candidate in uniform])
    mixed = replace(settings, rotation_step_factors=tuple(factors[i] for i in per_level.argmin(axis=0)))
    return trials.cheapest([settings, mixed, *_turning_roots(settings, trials, factors), *uniform])


def _turning_roots(settings: Settings, trials: Trials, factors: tuple[int, ...]) -> list[Settings]:
    """Return the settings with each rotation factor at the roots alone, which turn what turns as a whole. A root has
    its stem at level 0 if it moves as one, else at level 1."""
    has_stems = [trials.prelude(settings).plan.has_stems(level) for level in range(settings.levels)]
    levels = [level for level in (1, 2) if any(has_stems[:level]) and level < settings.levels]
    tried = [(factor,) * level + (0,) * (settings.levels - level) for level in levels for factor in factors if factor]
    return [replace(settings, rotation_step_factors=factors) for factors in tried]
