"""Time bases: which stages have one learned from their tracks, and whether waves are periodic (FORMAT.md)."""

from __future__ import annotations

import math
from dataclasses import replace

from athcodec.encoding.options.features import Feature
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.settings import Settings

PERIODIC_WORTH = 1.3  # Largest ratio of bytes at which waves are periodic: coarse stages jump at the seam of others.


def candidates(settings: Settings, trials: Trials) -> list[Settings]:
    """Return the settings with learned time bases at all stages: each stage's own or one for all; layers have one."""
    if trials.without(Feature.TIME_BASES):
        return []
    each = settings.in_learned_bases()
    common = [] if trials.without(Feature.COMMON_BASIS) else [replace(each, common_basis=True)]
    return common if common and trials.is_layered else [each, *common]


def best_bases(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with the time basis that costs fewest bytes: learned ones for all stages, one for all
    together, learned ones just for the stages that they make smaller, or waves.
    """
    if trials.without(Feature.TIME_BASES):
        return settings
    waves = settings.in_waves()
    each, *common = candidates(settings, trials)
    if math.inf in trials.costs([waves, each, *common]):
        return trials.cheapest([settings, waves, each, *common])
    shorter = trials.stage_costs(each) < trials.stage_costs(waves)
    mixed = replace(each, learned_bases=tuple(shorter.tolist()))
    mixes = [each] if each.common_basis else [each, mixed]
    return trials.cheapest([settings, waves, *mixes, *common])


def waves_if_smaller(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with waves if learned time bases no longer pay at the final steps. They are learned again at
    these steps, as for the file: a component that is just left out may be kept at another step."""
    if not any(settings.learned_bases) or not trials.work.fits(2 * trials.work_of_trial):
        return settings
    trials.forget(settings)
    return trials.cheapest([settings, settings.in_waves()])


def best_waves(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with periodic waves for loops of one segment, unless the motion jumps across the seam."""
    if trials.without(Feature.PERIODIC) or not any(sample.whole_loop for sample in trials.samples):
        return settings
    periodic = replace(settings, periodic=True)
    of_periodic, of_free = trials.costs([periodic, settings])
    return periodic if of_periodic <= PERIODIC_WORTH * of_free else settings
