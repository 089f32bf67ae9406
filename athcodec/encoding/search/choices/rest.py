"""The rest pose: how vertices are predicted, whether it goes by faces, what is copied, how precise it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np

from athcodec._native import SHEET
from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search.progress import START
from athcodec.encoding.search.sample import sample_plant
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.segment import Source, branch_records, poses_size
from athcodec.encoding.segments.settings import Settings
from athcodec.encoding.streams import streams
from athcodec.files.threads import ranges

CONNECTED_SHARE = 0.8  # Largest share of the size without faces at which layers refine a rest pose that goes by faces.
REST_SHARE = 0.25  # Share of a file from which on slack is tried for its rest pose.
REST_SLACKS = (0.5, 0.65, 0.8, 0.95)  # Distances, over the limit, by which a rest pose may be off.


def lags(source: Source, step: float, details: np.ndarray) -> np.ndarray:
    """Return how the rest pose of each branch is predicted, (B,) int32: 0 for the modes of a beam, else the lag
    (FORMAT.md, Lag) that leaves least to code. Only sheets and the branches with `details`, (B,), above 0 get lags.
    """
    hierarchy = source.hierarchy
    first, count, attach = hierarchy.first_vertex, hierarchy.stem_count, hierarchy.attach
    lags = np.zeros(hierarchy.branch_count, np.int32)
    is_adaptive = not source.host_rest and Feature.ADAPTIVE not in source.without
    wanted = (source.sheet_like | (details > 0)) & is_adaptive
    for size, is_attached in product(np.unique(count[wanted]).tolist(), (False, True)):
        alike = np.flatnonzero(wanted & (count == size) & ((attach >= 0) == is_attached))
        for part in ranges(len(alike), 3 * size):
            branches = alike[slice(*part)]
            bases = source.rest[attach[branches]] if is_attached else None
            lags[branches] = qz.rest_lags(source.rest[first[branches, None] + np.arange(size)], bases, step)
    return lags


def candidates(source: Source, ath: Ath, settings: Settings) -> list[Settings]:
    """Return the settings with all predictors of the rest pose, connected or not, with copies and without."""
    best = lags(source, settings.rest_step, settings.details)
    settings = replace(settings, shape_of=None, lags=best, connected_rest=False)
    if source.reference_is_exact:
        return [settings, *_connected(source, settings)]
    tried = [settings, *_other_lags(source, settings), *_connected(source, settings)]
    return tried + _with_copies(source, ath, tried)


def with_best_rest(source: Source, ath: Ath, settings: Settings) -> Settings:
    """Return the settings that make hierarchy and rest pose smallest."""
    tried, size = candidates(source, ath, settings), judge(source, ath, poses_size)
    return tried[0] if len(tried) == 1 else min(tried, key=size)


def judge(source: Source, ath: Ath, size: Callable[..., float]) -> Callable[..., float]:
    """Return a function that judges settings by `size` of a source, an ath and settings: on a sample of a large plant,
    unless the rest pose is all of the file."""
    sample = None if source.still else sample_plant(source, ath, "default", with_faces=True)
    if sample is None:
        return lambda *words: size(source, ath, *words)
    return lambda settings, *words: size(sample.source, sample.ath, sample.like(settings), *words)


def connected_if_smaller(source: Source, ath: Ath, settings: Settings) -> Settings:
    """Return the settings for layers: with a rest pose that goes by faces if that is much smaller."""
    if source.mesh is None or source.host_rest:
        return settings
    size = judge(source, ath, poses_size)
    connected = replace(settings, connected_rest=True)
    share = 1.0 if source.reference_is_exact else CONNECTED_SHARE
    return connected if size(connected) < share * size(settings) else settings


def with_slack(source: Source, ath: Ath, settings: Settings, slack: float) -> Settings:
    """Return the settings with a rest pose that may be off by a distance, at the coarsest step that allows it."""
    return with_best_rest(source, ath, _slack(settings, slack))


def _slack(settings: Settings, slack: float) -> Settings:
    return replace(settings, rest_step=qz.single(0.9999 * qz.LATTICE_REST_CAP * slack), rest_slack=slack)


def best_slack(settings: Settings, trials: Trials) -> Settings:
    """Return the settings with a coarser rest pose, as far from the source's as the motion leaves room for, if this
    saves bytes. It is tried only where the rest pose takes a large part of a file of one layer.
    """
    source = trials.source
    limit = source.rest_limit(float(np.min(settings.limit)))
    if source.reference_is_exact or trials.is_layered:
        return settings
    if trials.prelude_bytes(settings) < REST_SHARE * trials.cost(settings):
        return settings
    best = trials.cheapest([settings, *(_slack(settings, part * limit) for part in REST_SLACKS)])
    work = START * source.clip.vertex_count
    if best is settings or not trials.work.fits(work + trials.work_of_trial):
        return best
    trials.work.add(work)
    return trials.cheapest([best, with_best_rest(source, trials.ath, best)])


def ring_lags(settings: Settings) -> np.ndarray:
    """Return the lags of the settings, (B,) int32, but for tubes the vertices of a ring: a tube's vertices go on from
    the two rings before them, however thin the tube is."""
    return np.where(settings.forms > SHEET, settings.forms, settings.lags).astype(np.int32)


def _other_lags(source: Source, settings: Settings) -> list[Settings]:
    """Return copies of the settings with other lags of the stems (FORMAT.md, Lag): at most 1; at least 1; 1 for all;
    for short stems as many as they have vertices, so that a stem is coded about the one before it; and for tubes the
    vertices of a ring. Plants that stand still get some longer lags, too.
    """
    if Feature.ADAPTIVE in source.without:
        return []
    best, count = settings.lags, source.hierarchy.stem_count
    no_beam = np.maximum(best, 1)
    others = [np.minimum(best, 1), no_beam, np.ones_like(best), np.where(count <= qz.SHORT_STEM, count, no_beam)]
    others.append(ring_lags(settings))
    if source.still:
        others += [np.full_like(best, 3), np.full_like(best, 4), np.minimum(2 * no_beam, qz.MOST_LAG)]
    tried = {lag.astype(np.int32).tobytes() for lag in others} - {best.tobytes()}
    return [replace(settings, lags=np.frombuffer(lag, np.int32)) for lag in sorted(tried)]


def _connected(source: Source, settings: Settings) -> list[Settings]:
    """Return the settings with a rest pose that is predicted by faces, with their lags and with lags of 1; none without
    faces."""
    if source.mesh is None or source.host_rest:
        return []
    tried = (settings.lags, np.ones_like(settings.lags))
    return [replace(settings, lags=lag, connected_rest=True) for lag in tried]


def _with_copies(source: Source, ath: Ath, tried: list[Settings]) -> list[Settings]:
    """Return the candidates with branches that are copies of others, if there are any."""
    if Feature.COPIES in source.without:
        return []
    first, branches = tried[0], branch_records(source.hierarchy, ath, tried[0])
    shape_of = streams.find_copies(branches, first.rest_step, source.rest, first.rest_slack)
    return [] if shape_of is None else [replace(settings, shape_of=shape_of) for settings in tried]
