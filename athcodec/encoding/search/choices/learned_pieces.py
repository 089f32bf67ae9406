"""Learned modes: which pieces have modes learned from their motion in place of a beam's (FORMAT.md, "SHAPES")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from athcodec.encoding.model.learned_modes import estimated_bits
from athcodec.encoding.model.motion import LearnedModes
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search import progress
from athcodec.encoding.search.choices import learned_bases
from athcodec.encoding.search.choices.forms import in_each_basis
from athcodec.encoding.search.choices.steps import walked
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.settings import Settings

NEAR_RATIO = 1.2  # Bytes, over the least, up to which other pieces are learned about the coded rest pose as well.
REQUIRED_SAVINGS = (1.0, 1.25)  # Factors by which a piece's estimated bits have to shrink for learned modes.


def candidates(settings: Settings, trials: Trials) -> list[Settings]:
    """Return copies of the settings with learned modes for the pieces that these save bits on, one copy for each factor
    of REQUIRED_SAVINGS by which a piece's bits have to shrink. The list is empty if no piece gains so much or no work
    is left.
    """
    work = trials.work_of(2 * progress.ANALYSIS)
    if trials.without(Feature.SHAPES) or not trials.work.fits(work):
        return []
    trials.work.add(work)
    plain = replace(settings, learned_pieces=None)
    pieces = pieces_that_save(plain, trials, REQUIRED_SAVINGS)
    return [
        replace(plain, learned_pieces=some, learned_saving=saving)
        for saving, (some, _) in zip(REQUIRED_SAVINGS, pieces)
        if some.any()
    ]


def best_pieces(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with learned modes, or without if the file as a whole gets no shorter."""
    plain = replace(settings, learned_pieces=None, learned_saving=None)
    return plain if trials.without(Feature.SHAPES) else trials.cheapest([plain, *candidates(plain, trials)])


def best_pieces_in_any_basis(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with learned modes, if these save bytes, and with the rotations, forms and time bases that
    are best beside them. Choices made without learned modes are tried without again, because on short stems learned
    modes describe the same motion as rotations and affine functions do.
    """
    starts = in_each_basis(settings, trials)
    if any(settings.learned_bases):  # Time bases were chosen before learned modes were known, too.
        starts.append(settings.in_waves())
    if any(settings.rotation_step_factors) and not trials.is_layered:
        if any(settings.learned_bases):
            starts.append(trials.cheapest(learned_bases.candidates(settings.with_rotations(0), trials)))
        else:
            start = trials.start
            starts.append(
                replace(settings, rotation_step_factors=start.rotation_step_factors, roots_turn=start.roots_turn)
            )
    plain = [replace(start, learned_pieces=None, learned_saving=None) for start in starts]
    if trials.without(Feature.SHAPES):
        return trials.cheapest(plain)
    learned = [candidate for start in plain for candidate in candidates(start, trials)]
    best = trials.cheapest([*plain, *learned])
    most = NEAR_RATIO * trials.cost(best)  # Learned about the coded rest pose, more pieces may pay.
    near = [other for other in learned if other is not best and trials.cost(other) <= most]
    return trials.cheapest([learned_anew(one, trials) for one in [best, *near]])


def learned_anew(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with modes learned about the rest pose as it is coded, whose rounding they then describe, or
    before that, whichever is smaller."""
    if settings.learned_pieces is None or trials.is_layered or trials.source.reference_is_exact:
        return settings
    step = settings.rest_step if settings.learned_coded else trials.start.rest_step
    other = replace(settings, learned_coded=not settings.learned_coded, rest_step=step)
    return trials.cheapest([settings, other])


def learned_about_other_pose(settings: Settings, trials: Trials) -> Settings:
    """Return the same at the best steps: those of the other way to learn are walked to again."""
    best = learned_anew(settings, trials)
    return settings if best is settings else walked(best, trials)


def pieces_that_save(
    plain: Settings, trials: Trials, required_savings: Sequence[float]
) -> list[tuple[np.ndarray, float]]:
    """Return for each required saving two things: which pieces have estimated bits, without learned modes, of more than
    that factor times those with them, (P,) bool; and the share of all bits of the motion that learned modes on these
    pieces save. `plain`: settings without learned modes.
    """
    modes = trials.learned_modes_everywhere(plain)
    plan = trials.prelude(plain).plan
    piece_count = len(modes.counts)
    piece_of_row = np.repeat(np.arange(piece_count), plan.ranks)

    def bits(tried: LearnedModes | None) -> np.ndarray:
        """Return the estimated bits of each piece in the whole file, (P,), with these learned modes."""
        of_pieces = np.zeros(piece_count)
        for number, sample in enumerate(trials.samples):
            integers = trials.analysed(plain, number, tried, bent=True).coefficients
            of_pieces += estimated_bits(integers, piece_of_row, piece_count) * sample.scale
        return of_pieces

    bits_without, bits_with = bits(None), bits(modes)
    price = estimated_bits(modes.integers, np.repeat(np.arange(piece_count), modes.counts), piece_count)
    chosen = [(modes.counts > 0) & ((bits_with + price) * saving < bits_without) for saving in required_savings]
    saved = bits_without - bits_with - price
    return [(pieces, float(saved[pieces].sum() / max(bits_without.sum(), 1.0))) for pieces in chosen]
