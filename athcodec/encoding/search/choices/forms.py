"""Forms: the spatial basis of each branch, that of a beam, of a sheet, or of a tube (FORMAT.md, Flags, Ring)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from athcodec._native import PIECE_VERTICES, SHEET
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search.choices.rings import ring_sizes
from athcodec.encoding.search.segment_samples import SegmentSample
from athcodec.encoding.search.trials import Trials, distinct
from athcodec.encoding.segments.segment import Source
from athcodec.encoding.segments.settings import BEAM, Settings

GIVE_UP_RATIO = 1.3  # Forms are not tried with rotations where they, or the best with them, are so many times as large.
WAVES_RATIO = 1.08  # Forms are not tried with time bases either where they make a file in waves so many times as large.
SHORT_STEM = 3  # Vertices of a median stem up to which learned modes can stand for whole stems.


def first_forms(source: Source, samples: Sequence[SegmentSample]) -> np.ndarray:
    """Return the form of each branch that the search starts with, (B,) int32: a tube, by the vertices of its rings,
    where these move alike in the samples, else a sheet or a beam by how the branch looks.
    """
    hierarchy, sheets = source.hierarchy, source.sheet_like & (Feature.SHEETS not in source.without)
    if Feature.RINGS in source.without:
        return sheets.astype(np.int32)
    first, count = hierarchy.first_vertex, hierarchy.stem_count
    positions = [sample.positions for sample in samples]
    rings = ring_sizes(first, count, np.ones_like(source.sheet_like), source.rest, positions)
    return np.where(rings > 0, rings, sheets)


def candidates(settings: Settings, trials: Trials) -> list[Settings]:
    """Return copies of the settings, one for each way to give forms to the branches: all beams, all sheets, or by how
    branches look, each with tubes where the search started with them, and without. The ways without tubes are left out
    if the settings ask for the shape of such branches to be kept.
    """
    looks, tubes = trials.source.sheet_like, np.where(trials.start.forms > SHEET, trials.start.forms, 0)
    plain = [np.full(looks.shape, BEAM, np.int32)]
    if not trials.without(Feature.SHEETS):
        plain.append(np.full(looks.shape, SHEET, np.int32))
        if looks.any() and not looks.all():
            plain.insert(0, looks.astype(np.int32))
    with_tubes = [np.where(tubes > 0, tubes, forms) for forms in plain if tubes.any()]
    all_forms = with_tubes if settings.details[tubes > 0].any() else with_tubes + plain
    return [_formed(settings, forms, trials.source.hierarchy.stem_count) for forms in all_forms]


def _formed(settings: Settings, forms: np.ndarray, stem_count: np.ndarray) -> Settings:
    """Return the settings with these forms of branches, and without learned modes if a branch of one of these forms is
    of another number of pieces, since modes are learned for pieces by their numbers."""
    other = replace(settings, forms=forms)
    if np.array_equal(_piece_counts(forms, stem_count), _piece_counts(settings.forms, stem_count)):
        return other
    return replace(other, learned_pieces=None, learned_saving=None)


def _piece_counts(forms: np.ndarray, stem_count: np.ndarray) -> np.ndarray:
    """Return the number of pieces of each branch, (B,) (FORMAT.md, `piece_count`)."""
    ring = np.where(forms > SHEET, forms, 1)
    rings, of_piece = (stem_count + ring - 1) // ring, PIECE_VERTICES // ring
    counts: np.ndarray = (rings + of_piece - 1) // of_piece
    return counts


def best_forms(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with those forms of branches that cost fewest bytes. Settings without rotations are compared
    with rotations, too, because these change which forms are best; the returned settings have the rotations that were
    given.
    """
    tried = plain = candidates(settings, trials)
    if not any(settings.rotation_step_factors) and not trials.without(Feature.ROTATIONS):
        costs = trials.costs(plain)
        most, turned = GIVE_UP_RATIO * min(costs), plain[int(np.argmin(costs))].with_rotations(1)
        tried = [*plain, turned]
        if trials.costs([turned])[0] <= most:
            tried += [candidate.with_rotations(1) for candidate, cost in zip(plain, costs) if cost <= most]
    return replace(trials.cheapest(tried), rotation_step_factors=settings.rotation_step_factors)


def best_forms_again(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with the best forms once rotations and time bases are known."""
    tried = candidates(settings, trials)
    costs = trials.costs([candidate.in_waves() for candidate in tried])
    return trials.cheapest([settings, *(one for one, cost in zip(tried, costs) if cost <= WAVES_RATIO * min(costs))])


def in_each_basis(settings: Settings, trials: Trials) -> list[Settings]:
    """Return the settings and, on short stems, the same without rotations in each form."""
    if float(np.median(trials.source.hierarchy.stem_count)) > SHORT_STEM:
        return [settings]
    return distinct([settings, *candidates(settings.with_rotations(0), trials)])


def forms_like(forms: np.ndarray, source: Source, trials: Trials) -> np.ndarray:
    """Return forms that were chosen for another source, for these branches: tubes or none, else by looks or alike."""
    plain, tubes = forms <= SHEET, trials.start.forms
    if np.array_equal(forms[plain], source.sheet_like[plain]):
        others = trials.source.sheet_like.astype(np.int32)
    else:
        others = np.full_like(tubes, forms[plain][0])
    return others if plain.all() else np.where(tubes > SHEET, tubes, others)


def best_of_plant(settings: Settings, trials: Trials) -> np.ndarray:
    """Return the forms of all of a sampled plant: as first, or all sheets that are no tubes if the sample has sheets. A
    sample holds more than its share of what carries others, and errs there by more than elsewhere."""
    start = trials.start.forms
    other = np.maximum(settings.forms, SHEET) if settings.forms.any() else settings.forms
    if np.array_equal(start, other):
        return settings.forms
    return trials.cheapest([replace(settings, forms=forms) for forms in (start, other)]).forms
