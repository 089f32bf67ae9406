"""Steps: how coarsely motion and rest pose are quantised, walked on geometric grids to the smallest file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from athcodec.encoding.model import quantise as qz
from athcodec.encoding.search.choices.forms import in_each_basis
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.settings import Settings

WALKS = 3  # Largest number of walks of both steps.
STEP_FACTOR = 1.15  # Ratio of neighbouring steps of motion on the grid.
REST_STEP_FACTOR = 1.4  # Ratio of neighbouring steps of the rest pose, by which bytes change less.
WEIGHT_PARTS = (0.0, 0.05, 0.2)  # Shares of a stage's vertices that may have weights below that of the stage's step.
WEIGHT_POWERS = (0.5, 1.0)  # Powers of a stage's weight that are tried as the factor on its step.


def best_stage_steps(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with coarser steps for stages whose vertices and those below have larger weights."""
    if trials.source.weights is None:
        return settings
    weights = [trials.source.stage_weights(settings.stages, part) for part in WEIGHT_PARTS]
    tried = [replace(settings, stage_steps=least**power) for least in weights for power in WEIGHT_POWERS]
    return trials.cheapest([settings, *tried])


def best_steps(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with the best steps. On short stems each basis is tried with steps of its own, because affine
    functions are best at finer steps than modes."""
    return trials.cheapest([walked(start, trials) for start in in_each_basis(settings, trials)])


def finer_steps(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with steps from a grid that is three times as fine."""
    return walked(settings, trials, STEP_FACTOR ** (1 / 3), REST_STEP_FACTOR ** (1 / 3))


def walked(
    settings: Settings, trials: Trials, factor: float = STEP_FACTOR, rest_factor: float = REST_STEP_FACTOR
) -> Settings:
    """Return the settings with the steps of motion and of the rest pose that cost fewest bytes near those given. The
    two steps are changed in turn, by powers of `factor` and of `rest_factor`, until neither changes any more.
    """
    for again in range(WALKS):
        # Where the nearest steps do not pay, a much coarser step, or a much finer rest pose, still may.
        coarser, finer = ([], []) if again else ([2], [-4])
        before, settings = settings, _walk(settings, trials, "step", factor, math.inf, coarser)
        if trials.source.reference_is_exact:
            break
        cap = trials.extrapolation.rest_cap * trials.source.rest_limit(settings.bound)
        settings = _walk(settings, trials, "rest_step", rest_factor, cap, finer)
        if (settings.step, settings.rest_step) == (before.step, before.rest_step):
            break
    return settings


def _walk(
    settings: Settings, trials: Trials, name: Literal["step", "rest_step"], factor: float, cap: float, ahead: list[int]
) -> Settings:
    """Return the settings with the cheapest value of the step called `name`, found by multiplying it by powers of
    `factor` until both neighbours cost more. `cap`: the largest step; `ahead`: further exponents to try if neither
    neighbour of the given step is cheaper.
    """

    def moved(exponent: int) -> Settings:
        if name == "step":
            return replace(settings, step=qz.single(min(settings.step * factor**exponent, cap)))
        return replace(settings, rest_step=qz.single(min(settings.rest_step * factor**exponent, cap)))

    def costs_at(exponents: Sequence[int]) -> dict[int, float]:
        return dict(zip(exponents, trials.costs([moved(exponent) for exponent in exponents])))

    costs = costs_at([-1, 0, 1])
    if min(costs, key=costs.__getitem__) == 0:
        costs |= costs_at(ahead)
    while True:
        best = min(costs, key=costs.__getitem__)
        wanted = [e for e in (best - 1, best + 1) if e not in costs]
        if not wanted:
            return moved(best)
        costs |= costs_at(wanted)
