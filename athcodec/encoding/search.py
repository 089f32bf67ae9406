"""Which settings make the smallest file: candidates code a sample of the segments, and their bytes are counted.

Bases, rotations, time bases and steps are searched one after the other, on a sample of the plant where that is large.
`Search` knows what to try; a trial itself is segment.py's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from threading import Lock
from typing import Any, cast

import numpy as np

from athcodec.decoding.container import ROTATION_FACTORS
from athcodec.encoding import quantise as qz
from athcodec.encoding import streams
from athcodec.encoding.features import Feature
from athcodec.encoding.learned_modes import Components, LearnedModes, components, estimated_bits, learn
from athcodec.encoding.motion import Plan, SegmentMotion, position_errors
from athcodec.encoding.progress import Progress, trials
from athcodec.encoding.reference import mean_pose
from athcodec.encoding.rigid import TURN_STEP, finer_turn, rigid_layers
from athcodec.encoding.rings import ring_sizes
from athcodec.encoding.sample import ExtrapolationFactors, PlantSample, is_small, sample_plant
from athcodec.encoding.segment import (
    BEAM,
    SHEET,
    CodedPrelude,
    Settings,
    Source,
    StreamBasis,
    analyse,
    analyse_finely,
    basis_ratio,
    branch_records,
    code_stems,
    lags,
    level_bases,
    loose_branches,
    thread_count,
    time_components,
    uncoded_plan,
    with_best_lags,
    with_connected_rest,
)
from athcodec.encoding.shape import finer_than
from athcodec.encoding.survey import Ath
from athcodec.encoding.time_bases import TimeComponents
from athcodec.errors import BoundError
from athcodec.options import DEFAULT_SEGMENT

WALKS = 3  # of both steps
SAMPLES = 3  # of several clips
LEARNING_SEGMENTS = 4  # of a clip, that modes are learned from
MEAN_POSE_WORTH = 6  # trials, to find the mean pose and learned modes about it
PRELUDES_KEPT = 6  # between trials
REST_SHARE = 0.25  # of a file, from which on its rest pose is tried with slack
STILL_STEP = 1024.0  # over what nothing is to be left of
HOPELESS = 1.3  # over the least bytes, spatial bases that rotations do not save
MODES_SAVE, LAYERS_SAVE = 1.5, 1.05  # of a single layer's bytes, at most: learned modes, what suits refinements better
SHORT_STEM = 3  # vertices of a stem whose learned modes are tried in place of rotations and in any basis
NEAREST, NEAR = 4, 1.12  # other choices that steps are found for, and what they cost before, over the best
SETTLING_ROUNDS = 64  # Choices of one kind that settings of a small clip are changed for at most.
CALM_STEP, CALM_COST = 1.15, 1.03  # of small rigid parts: how much finer a step at a time, for how much in all
CALM_ROUNDS = 32  # Steps finer than the first that are tried at most: the last is 1/87 of it.
CALM_SHARE = 1e-4  # of their vertices over time, that may be corrected
WORTH = {
    "_with_learned_bases": 2,
    "_with_learned_modes_for_all": 6,
    "_with_node_steps": 4,
}  # trials, of other work in a step


@dataclass(frozen=True, eq=False)
class SegmentSample:
    """(N, 3, T) positions of a segment in file order, how many frames of the clip it stands for, and whether it is all
    of a loop."""

    positions: np.ndarray
    frames: float
    whole_loop: bool = False

    @property
    def scale(self) -> float:
        return self.frames / self.positions.shape[2]

    def of_plant(self, sample: PlantSample) -> SegmentSample:
        return replace(self, positions=self.positions[sample.vertices])


def samples_of(source: Source) -> list[SegmentSample]:
    """The middle segment of a clip; of several clips those of a few, from calm to wild, each for clips like it."""
    return [
        SegmentSample(_middle(source.positions(segment)), frames, source.is_whole_loop(segment))
        for segment, frames in typical_segments(source)
    ]


def typical_segments(source: Source) -> list[tuple[int, int]]:
    """Those that `samples_of` takes, and how many frames of the file each stands for."""
    middles = [start + len(own) // 2 for start, own in zip(source.clip_range_starts, source.clip_range_segments)]
    if len(middles) == 1:
        return [(middles[0], source.coded_frames)]
    lengths = np.array([(~source.repeats[own[0][0] : own[-1][1]]).sum() for own in source.clip_range_segments])
    groups = np.array_split(
        np.argsort([_moved(source, segment) for segment in middles], kind="stable"), min(SAMPLES, len(middles))
    )
    return [(middles[group[len(group) // 2]], int(lengths[group].sum())) for group in groups]


def _middle(positions: np.ndarray) -> np.ndarray:
    """At most DEFAULT_SEGMENT frames of a segment: the search has the same work where segments are longer."""
    first = max(0, positions.shape[2] - DEFAULT_SEGMENT) // 2
    return np.ascontiguousarray(positions[:, :, first : first + DEFAULT_SEGMENT])


def _moved(source: Source, segment: int) -> float:
    """RMS displacement of the vertices from the first frame of a segment to its middle."""
    start, stop = source.segments[segment]
    first, middle = (source.clip.block(frame, frame + 1).astype(np.float64) for frame in (start, (start + stop) // 2))
    return math.sqrt(((middle - first) ** 2).sum() / source.clip.vertex_count)


@dataclass(frozen=True)
class Choice:
    """Settings of a file: those of its only layer of precision, or of the refinements and of the first layer.

    learned_modes: of the last layer. reference: the pose that motion is coded about, (N, 3) float64 less the origin,
    file order; None: the rest pose. predicted: where motion is predicted, whether vertices are points of the lattice;
    error_share: of the limits, that its errors may take.
    """

    settings: Settings
    first_layer: Settings
    learned_modes: LearnedModes | None
    reference: np.ndarray | None = None
    predicted: bool | None = None
    error_share: float = 1.0


def first_settings(
    source: Source, ath: Ath, bound: float, samples: Sequence[SegmentSample], ratios: Sequence[int] = (1,)
) -> Settings:
    """The start of a search for the last of layers; ratios: of their steps to its own, descending to 1."""
    layered, rigid = len(ratios) > 1, _rigid(source, bound, samples, ratios)
    relative = bound / source.seen.diagonal if source.seen.diagonal > 0 else 1e-4
    step, rest_step = bound * qz.first_step_ratio(relative), bound * qz.rest_step_ratio(relative)
    levels = ath.height + 2
    settings = Settings(
        bound=bound,
        largest_bound=source.largest_bound(bound),
        limit=source.limit(bound),
        step=qz.single(step),
        level_steps=np.ones(levels),
        rest_step=qz.single(rest_step),
        forms=_forms(source, samples),
        loose=loose_branches(source, samples[-1].positions),
        rigid=rigid,
        layer=len(ratios) - 1,
        free_rigid=False,
        turn_step=TURN_STEP if rigid[source.details > 0].any() and Feature.TURN not in source.without else 0.0,
        lags=np.zeros(source.hierarchy.branch_count, np.int32),
        details=source.details if layered else finer_than(source.details, bound),
        connected_rest=False,
        rotation_step_factors=(0,) * levels,
        learned_bases=(False,) * levels,
        common_basis=False,
        learned_pieces=None,
        node_steps=np.full(levels, step),
        usual_change=usual_change(samples) if source.has_seams else np.inf,
        without=source.without,
    )
    if layered and not settings.details.any():  # lags that are best at once are worse where layers refine them
        return with_connected_rest(source, ath, replace(settings, lags=lags(source, rest_step, settings.details)))
    return with_best_lags(source, ath, settings)


def _forms(source: Source, samples: Sequence[SegmentSample]) -> np.ndarray:
    """(B,) of Settings.forms: tubes where rings move alike, else by how branches look."""
    hierarchy, sheets = source.hierarchy, source.sheet_like & (Feature.SHEETS not in source.without)
    if Feature.RINGS in source.without:
        return sheets.astype(np.int32)
    first, count = hierarchy.first_vertex, hierarchy.stem_count
    positions = [sample.positions for sample in samples]
    rings = ring_sizes(first, count, np.ones_like(source.sheet_like), source.rest, positions)
    return np.where(rings > 0, rings, sheets)


def _rigid(source: Source, bound: float, samples: Sequence[SegmentSample], ratios: Sequence[int]) -> np.ndarray:
    """(B,) in how many of the layers branches that are to keep their shape move rigidly."""
    hierarchy, least = source.hierarchy, source.smallest_bound(bound)
    if Feature.RIGID in source.without:
        return np.zeros(hierarchy.branch_count, np.int32)
    return rigid_layers(
        hierarchy.first_vertex,
        hierarchy.stem_count,
        source.sheet_like | (source.details > 0),
        source.rest,
        [sample.positions for sample in samples],
        [ratio * least for ratio in ratios],
    )


def still_settings(source: Source, ath: Ath, bound: float) -> Settings:
    """Of a clip all of whose frames are the rest pose: no motion, a rest pose of the bound's precision."""
    step = STILL_STEP * source.smallest_bound(bound)
    settings = first_settings(source, ath, bound, [SegmentSample(source.positions(0), source.coded_frames)])
    slack = float(np.min(settings.limit)) - float(np.spacing(source.largest_number))
    settings = with_rest_slack(source, ath, settings, max(slack, 0.5 * source.smallest_bound(bound)))
    return replace(
        settings,
        step=qz.single(step),
        node_steps=np.full(len(settings.level_steps), STILL_STEP * source.seen.diagonal + step),
    )


def still_choice(source: Source, ath: Ath, bound: float, ratio: int) -> Choice:
    """Of a clip all of whose frames are the rest pose; ratio: as Search.decide has it."""
    settings = still_settings(source, ath, bound)
    return Choice(settings, _coarser(settings, ratio), None)


def with_rest_slack(source: Source, ath: Ath, settings: Settings, slack: float) -> Settings:
    """A rest pose that is off by as much, of the coarsest step that allows it."""
    rest_step = qz.single(0.9999 * qz.LATTICE_REST_CAP * slack)
    return with_best_lags(source, ath, replace(settings, rest_step=rest_step, rest_slack=slack))


def usual_change(samples: Sequence[SegmentSample]) -> float:
    """RMS of the change of velocity of samples, in length per frame squared; infinite where they are too short."""
    changes = [np.diff(sample.positions, 2, axis=2) for sample in samples if sample.positions.shape[2] > 2]
    return float(np.sqrt(np.mean([(own**2).sum(axis=1).mean() for own in changes]))) if changes else np.inf


def _in_waves(settings: Settings) -> Settings:
    """The same without learned time bases."""
    return replace(settings, learned_bases=(False,) * len(settings.learned_bases), common_basis=False)


def _coarser(settings: Settings, ratio: int) -> Settings:
    """The same, so many times as coarse, as a first layer."""
    return replace(
        settings,
        bound=ratio * settings.bound,
        largest_bound=ratio * settings.largest_bound,
        limit=ratio * settings.limit,
        step=qz.single(ratio * settings.step),
        rest_step=qz.first_rest_step(settings.rest_step, settings.bound, ratio),
        layer=0,
    )


class Search:
    """Finds settings by coding a sample of the segments with each candidate and counting the bytes.

    samples: from calm to wild; the one in the middle decides the steps of the nodes' maps. extrapolation: for a clip
    that is a sample of a larger plant. ratios: as first_settings has them.
    """

    def __init__(
        self,
        source: Source,
        ath: Ath,
        start: Settings,
        samples: list[SegmentSample],
        effort: str,
        report: Progress,
        jobs: int | None = None,
        extrapolation: ExtrapolationFactors | None = None,
        ratios: Sequence[int] = (1,),
    ):
        self.jobs, self.source, self.ath, self.effort, self.report = jobs, source, ath, effort, report
        self.start, self.samples, self.levels = start, samples, ath.height + 2
        self.sample = samples[len(samples) // 2].positions
        self.extrapolation = extrapolation or ExtrapolationFactors.everything(self.levels)
        self.required_saving: float | None = None  # of REQUIRED_SAVINGS: the one that made the smallest file
        self._known: dict[tuple, tuple[float, np.ndarray]] = {}
        self._components: dict[tuple, Components] = {}
        self._time_components: dict[tuple, tuple[float, list[dict[int, TimeComponents]]]] = {}
        self._preludes: dict[tuple, CodedPrelude] = {}
        self._kept = Lock()  # Threads that cost candidates share the preludes.
        self._ratios, self._layered = ratios, len(ratios) > 1
        keeps_shape = start.turn_step > 0  # which a few bytes less would cost
        self._is_small = is_small(source.clip.vertex_count, source.segments, effort) and not keeps_shape
        self._forms: np.ndarray | None = None  # that is best in all of a plant that is sampled
        self._extra_trials, self._trials = 0, trials(effort, self._layered, self._is_small)

    @classmethod
    def of(
        cls,
        source: Source,
        ath: Ath,
        bound: float,
        effort: str,
        report: Progress,
        jobs: int | None = None,
        ratios: Sequence[int] = (1,),
    ) -> Search:
        """For a whole plant."""
        samples = samples_of(source)
        start = first_settings(source, ath, bound, samples, ratios)
        return cls(source, ath, start, samples, effort, report, jobs, ratios=ratios)

    def _without(self, feature: Feature) -> bool:
        return feature in self.source.without

    def _level_errors(self, bound: float) -> np.ndarray:
        """Per level, the error in all vertices of one node together that would double the level's own, (levels,).

        The level's own: the RMS that independent least-squares maps would leave, in a few frames, at least the bound.
        """
        some = np.linspace(0, self.sample.shape[2] - 1, min(8, self.sample.shape[2])).astype(int)
        frames = np.empty((len(some), *self.sample.shape[:2]))
        frames[:, self.source.hierarchy.vertex_source] = np.moveaxis(self.sample[:, :, some], 2, 0) + self.source.origin
        nodes = self.inner_nodes()
        errors = np.full(self.levels, bound)
        for level in np.flatnonzero(nodes):
            left = self.ath.approximation(frames, int(level)) - frames
            whole = max(bound, math.sqrt((left**2).sum() / (frames.size / 3)))
            errors[level] = whole * math.sqrt(self.source.clip.vertex_count / nodes[level])
        return errors

    def inner_nodes(self) -> np.ndarray:
        """Nodes of more than one branch, per level."""
        hierarchy, branches = self.source.hierarchy, self.ath.node_branch
        branches = branches[hierarchy.subtree_branches[branches] > 1]
        return np.bincount(hierarchy.branch_depth[branches], minlength=self.levels)

    def first_cost(self) -> float:
        """Bytes of a whole file at the settings that the search starts with."""
        search = self.of_sample or self
        return search.cost(search.start)[0]

    def decide(self, ratio: int = 1) -> tuple[list[Choice], CodedPrelude]:
        """Settings to choose from, and hierarchy and poses as coded with them; ratio: of the first layer's step to the
        last one's, 1 if that is the same layer."""
        search = self.about_best_reference()
        first_layer, candidates = search.found(ratio)
        prelude = search.prelude(candidates[0])
        choices = [
            Choice(settings, first_layer, search.learned_modes(prelude.plan, settings), search.source.reference)
            for settings in candidates
        ]
        search._components.clear()  # they take as much memory as a segment
        return choices, prelude

    def found(self, ratio: int = 1) -> tuple[Settings, list[Settings]]:
        """Settings of a first layer, and those to choose from for refinements; for a large plant those of a sample of
        it. Where the ratio is 1, the best of the only layer."""
        if self.of_sample:
            first, candidates = self.best_of_sample(ratio)
        else:
            candidates = list(self.refinements(self.best, ratio))  # first: components are of the step that asks first
            first = self.best if ratio == 1 else self.first_layer(self.best, ratio)
        self.report("search", 1.0)
        return first, candidates

    @cached_property
    def at_first_step(self) -> Settings:
        """Bases, rotations and modes of a file of one layer, at the step that the search starts with."""
        steps = [
            self._with_free_rigid,
            self._with_basis,
            self._with_rotations,
            self._with_learned_bases,
            self._with_basis,
            self._with_learned_modes_for_all,
        ]
        if self.effort == "fast":
            steps = [self._with_rotations]
        if self.source.weights is not None:
            steps.insert(0, self._with_level_steps)
        if any(sample.whole_loop for sample in self.samples):
            steps.append(self._with_periodic_waves)
        return self._after(steps, self.start)

    @cached_property
    def best(self) -> Settings:
        """Settings of a file of one layer."""
        steps = [
            self._with_steps,
            self._settled,
            self._with_calm_parts,
            self._with_rest_slack,
            self._with_waves_if_smaller,
        ]
        if self.effort == "fast":
            steps = []
        if self.effort == "best" and self.source.weights is None:
            steps += [self._with_rotations, self._with_learned_bases, self._with_finer_steps]
        return self._after([*steps, self._with_node_steps], self.at_first_step)

    def _after(self, steps: Sequence[Callable[[Settings], Settings]], settings: Settings) -> Settings:
        for step in steps:
            settings = step(settings)
            self._report(WORTH.get(step.__name__, 0))
        return settings

    def first_layer(self, settings: Settings, ratio: int) -> Settings:
        """Settings of a layer whose step is `ratio` times that of the given ones."""
        first, steps = replace(_coarser(settings, ratio), learned_pieces=None), [self._with_rotations]
        if not settings.turn_step:  # else its turns are as fine as those of refinements, which have that basis
            first = _in_waves(first)
            steps.append(self._with_learned_bases)
        for step in (*steps, self._with_learned_modes):
            first = first if self.effort == "fast" else step(first)
        return self._with_node_steps(first)

    def refinements(self, settings: Settings, ratio: int) -> Iterator[Settings]:
        """Settings that may suit refinements, each of which has one stream: with rotations and without."""
        if ratio == 1 or not any(settings.rotation_step_factors):
            yield settings
            if ratio > 1 and self._is_small and settings.learned_pieces is not None:
                yield replace(settings, learned_pieces=None)
            return
        factor, least = settings.rotation_step_factors[self.prelude(settings).plan.main_level], math.inf
        for own in dict.fromkeys((factor, 0)):
            candidate = replace(settings, rotation_step_factors=(own,) * self.levels)
            if self.effort != "fast":
                plain = replace(candidate, learned_pieces=None)
                if self.cost(plain)[0] > MODES_SAVE * least:
                    continue
                candidate = self._with_learned_modes(candidate)
                least = min(least, self.cost(candidate)[0])
                if self.cost(candidate)[0] > LAYERS_SAVE * least:
                    continue
            yield candidate

    def _report(self, worth: int = 0) -> None:
        """Reports progress after work that counts as `worth` trials in addition to those made."""
        self._extra_trials += worth
        self.report("search", min((len(self._known) + self._extra_trials) / self._trials, 0.99))

    def about_best_reference(self) -> Search:
        """The same about the rest pose or the mean pose of the motion, whichever makes the smaller file: the mean pose
        is tried with what was found about the rest pose, and goes on from there; in small clips both are searched."""
        if self.effort == "fast" or self.source.host_rest or self.source.details.any():
            return self  # the mean of what turns is smaller than it
        if self._without(Feature.MEAN_POSE):
            return self
        other = self.about_mean_pose()
        tried, its = self.of_sample or self, other.of_sample or other
        tried._extra_trials += MEAN_POSE_WORTH
        own_cost = tried._cost_to_compare()
        its._extra_trials = tried._extra_trials + len(tried._known)
        if not self._is_small:
            its.at_first_step = its.like(tried, tried.at_first_step)
        if its._cost_to_compare() < own_cost:
            return other
        tried._extra_trials += len(its._known)
        return self

    def _cost_to_compare(self) -> float:
        """With that of a search about another reference pose."""
        return self._cost_with_maps(self.best if self._is_small else self.at_first_step)

    def about_mean_pose(self) -> Search:
        """The same about the mean pose of the motion, nothing found yet."""
        source = self.source.about(mean_pose(self.source, self.ath, self.start))
        ath = replace(self.ath, rest=source.rest + source.origin)
        start = first_settings(source, ath, self.start.bound, self.samples, self._ratios)
        return Search(source, ath, start, self.samples, self.effort, self.report, self.jobs, ratios=self._ratios)

    def like(self, other: Search, settings: Settings) -> Settings:
        """Settings that were found about another reference pose, about this one."""
        own = replace(
            settings,
            forms=self._forms_like(settings.forms, other),
            lags=self.start.lags,
            connected_rest=self.start.connected_rest,
            shape_of=self.start.shape_of,
            loose=self.start.loose,
            learned_pieces=None,
        )
        return own if settings.learned_pieces is None else self._with_learned_modes(own)

    @cached_property
    def of_sample(self) -> Search | None:
        """The search on a sample of a large plant."""
        sample = sample_plant(self.source, self.ath, self.effort)
        if sample is None:
            return None
        start, kept = self.start, sample.branches
        limit = start.limit if np.isscalar(start.limit) else start.limit[sample.vertices]
        some = replace(
            start,
            forms=start.forms[kept],
            loose=start.loose[kept],
            lags=start.lags[kept],
            details=start.details[kept],
            rigid=start.rigid[kept],
            limit=limit,
            shape_of=None,
        )
        extrapolation = ExtrapolationFactors.of(
            branch_records(self.source.hierarchy, self.ath, start),
            branch_records(sample.source.hierarchy, sample.ath, some),
        )
        samples = [segment.of_plant(sample) for segment in self.samples]
        return Search(
            sample.source, sample.ath, some, samples, self.effort, self.report, self.jobs, extrapolation, self._ratios
        )

    def best_of_sample(self, ratio: int) -> tuple[Settings, list[Settings]]:
        """The settings that are best for a sample of the plant; pieces with learned modes are chosen in all of it."""
        search, start = cast(Search, self.of_sample), self.start
        found = search.best
        candidates = [self._from_sample(search, own, start) for own in search.refinements(found, ratio)]
        if ratio == 1:
            return candidates[0], candidates
        return self._from_sample(search, search.first_layer(found, ratio), _coarser(start, ratio)), candidates

    def _from_sample(self, search: Search, found: Settings, start: Settings) -> Settings:
        """What was found last for a sample of the plant, for all of it; start: what does not depend on that."""
        inner, all_inner = search.inner_nodes(), self.inner_nodes()
        fewer = np.sqrt(search.extrapolation.vertices * inner / np.maximum(all_inner, 1))
        settings = replace(
            start,
            step=found.step,
            level_steps=found.level_steps,
            rest_step=found.rest_step,
            rotation_step_factors=found.rotation_step_factors,
            free_rigid=found.free_rigid,
            learned_bases=found.learned_bases,
            common_basis=found.common_basis,
            periodic=found.periodic,
            forms=self._forms_like(found.forms, search),
            node_steps=found.node_steps * np.where(inner > 0, fewer, 1.0),
        )
        settings = replace(settings, forms=self._forms_of_all(settings))
        if found.rest_slack > 0:
            settings = with_rest_slack(self.source, self.ath, settings, found.rest_slack)
        if search.required_saving is None:
            return settings
        return replace(settings, learned_pieces=self._pieces_for_learned_modes(settings, [search.required_saving])[0])

    def _forms_like(self, forms: np.ndarray, other: Search) -> np.ndarray:
        """What was chosen for the branches of another search, for those of this one: tubes or none, and for others by
        how they look, or one for all."""
        plain = forms <= SHEET
        by_look = np.array_equal(forms[plain], other.source.sheet_like[plain])
        own = self.source.sheet_like.astype(np.int32) if by_look else np.full_like(self.start.forms, forms[plain][0])
        return own if plain.all() else np.where(self.start.forms > SHEET, self.start.forms, own)

    def _forms_of_all(self, settings: Settings) -> np.ndarray:
        """Which branches have the affine functions first: as in the sample or by form, or by form or all where some did
        there. A sample holds more than its share of what carries others, and errs there by more than in all else."""
        if self._forms is None:
            other = np.maximum(settings.forms, SHEET) if settings.forms.any() else settings.forms
            candidates = [replace(settings, forms=forms) for forms in (self.start.forms, other)]
            is_clear = self.effort == "fast" or np.array_equal(self.start.forms, other)
            self._forms = settings.forms if is_clear else self._cheapest(candidates).forms
        return self._forms

    def cost(self, settings: Settings) -> tuple[float, np.ndarray]:
        """(bytes of a whole file, and of each level's streams in it) at these settings."""
        varied = self._key(settings)
        if varied not in self._known:
            self._known[varied] = self._try(settings)
        return self._known[varied]

    def _key(self, settings: Settings) -> tuple:
        return (
            settings.step,
            settings.level_steps.tobytes(),
            settings.turn_step,
            *self._prelude_key(settings),
            settings.rotation_step_factors,
            settings.periodic,
            settings.learned_bases,
            settings.common_basis,
            settings.learned_pieces is not None and settings.learned_pieces.tobytes(),
        )

    def _try(self, settings: Settings) -> tuple[float, np.ndarray]:
        try:
            prelude = self.prelude(settings)
            learned_modes = self.learned_modes(prelude.plan, settings)
            levels = sum(self._level_bytes(prelude, settings, learned_modes, i) for i in range(len(self.samples)))
            modes = streams.encode_learned_modes(prelude.plan, learned_modes)
        except BoundError:
            return math.inf, np.full(self.levels, math.inf)
        mode_bytes = sum(len(data) * self.extrapolation.rows[level] for level, data in modes.items())
        return levels.sum() + mode_bytes + self._prelude_bytes(prelude), levels

    def _level_bytes(
        self, prelude: CodedPrelude, settings: Settings, learned_modes: LearnedModes | None, number: int
    ) -> np.ndarray:
        """Of the streams in all that a sample stands for, (levels,)."""
        sample = self.samples[number]
        own = settings.of_segment(sample.whole_loop)
        coded = code_stems(prelude, own, sample.positions, learned_modes, self._bases(settings, number))
        levels, heads = np.zeros(self.levels), np.zeros(self.levels)
        for level, data in coded.stems.items():
            levels[level], heads[level] = len(data), coded.heads[level]
        corrections = len(coded.corrections.chunk) / coded.sample_share
        if corrections:
            levels += corrections * self._corrected(prelude.plan, coded.corrected)
        levels += (levels - heads) * (self.extrapolation.rows - 1)
        return levels * sample.scale

    def _prelude_bytes(self, prelude: CodedPrelude) -> float:
        return prelude.prelude_bytes * self.extrapolation.vertices

    def _analysed(self, settings: Settings, number: int, modes: LearnedModes | None) -> SegmentMotion:
        """A sample in its integers."""
        prelude, sample = self.prelude(settings), self.samples[number]
        own = settings.of_segment(sample.whole_loop)
        return analyse(prelude.plan, prelude.output, own, sample.positions, modes, self._bases(settings, number))[0]

    def _bases(self, settings: Settings, number: int) -> dict[int, StreamBasis]:
        """The time bases of the levels that learn theirs."""
        if not any(settings.learned_bases):
            return {}
        step, components = self._learn_time(settings)
        plan = self.prelude(settings).plan
        ratio = basis_ratio(plan, settings, settings.step / step)
        return level_bases(plan, settings, components[number], ratio)

    def _learn_time(self, settings: Settings) -> tuple[float, list[dict[int, TimeComponents]]]:
        """Components of the samples over time, of each level and of all, and the step of the trial that asked first for
        them: they hardly depend on it."""
        known = *self._turning(settings), settings.level_steps.tobytes(), settings.periodic
        if known not in self._time_components:
            plan = self.prelude(settings).plan
            levels = [*(level for level in range(self.levels) if plan.has_stems(level)), None]
            found = [
                time_components(plan, settings.of_segment(sample.whole_loop), sample.positions, levels)
                for sample in self.samples
            ]
            self._time_components[known] = settings.step, found
        return self._time_components[known]

    def _turning(self, settings: Settings) -> tuple:
        """What decides what is left for the modes of a piece."""
        return settings.rotation_step_factors, settings.forms.tobytes()

    def learned_modes(self, plan: Plan, settings: Settings, everywhere: bool = False) -> LearnedModes | None:
        """Of the pieces that `settings` gives some, or of all, learned."""
        if settings.learned_pieces is None and not everywhere:
            return None
        seen = self._learn_modes(settings)
        return learn(plan, seen, settings.step, None if everywhere else settings.learned_pieces)

    def _learn_modes(self, settings: Settings) -> Components:
        """Of segments spread over the clip, in the steps of the trial that asked first for them."""
        known = self._turning(settings)
        if known not in self._components:
            plan, count = uncoded_plan(self.source, self.ath, settings), len(self.source.segments)
            some = np.unique(np.linspace(0, count - 1, LEARNING_SEGMENTS).astype(int))
            self._components[known] = components(
                plan, (analyse_finely(plan, settings, self.source.positions(segment)) for segment in some)
            )
        return self._components[known]

    def _with_learned_modes(self, settings: Settings) -> Settings:
        """Learned modes for the pieces that take fewer bits with them, if the file as a whole gets shorter."""
        plain = replace(settings, learned_pieces=None)
        if self._without(Feature.SHAPES):
            return plain
        wanted = dict(zip(qz.REQUIRED_SAVINGS, self._pieces_for_learned_modes(plain, qz.REQUIRED_SAVINGS)))
        tried = {None: plain} | {
            saving: replace(plain, learned_pieces=some) for saving, some in wanted.items() if some.any()
        }
        self.required_saving, settings = self._cheapest_of(tried)
        return settings

    def _with_learned_modes_for_all(self, settings: Settings) -> Settings:
        """Learned modes beside what was found without them, or in its place: on stems of few vertices they serve the
        motion that rotations and affine functions serve, which were chosen before learned modes were known."""
        found, starts = [], self._in_each_basis(settings)
        if any(settings.learned_bases):  # which were chosen before learned modes were known, too
            starts.append(_in_waves(settings))
        for start in starts:
            chosen = self._with_learned_modes(start)
            found.append((self.cost(chosen)[0], len(found), self.required_saving, chosen))
        _, _, self.required_saving, settings = min(found)
        return settings

    def _in_each_basis(self, settings: Settings) -> list[Settings]:
        """The settings and, on short stems, the same without rotations in each basis."""
        unturned = replace(settings, rotation_step_factors=(0,) * self.levels)
        bases = [replace(unturned, forms=forms) for forms in self._all_forms()] if self._short_stems() else []
        return list({self._key(own): own for own in (settings, *bases)}.values())

    def _short_stems(self) -> bool:
        """Whether learned modes can stand for whole stems."""
        return float(np.median(self.source.hierarchy.stem_count)) <= SHORT_STEM

    def _pieces_for_learned_modes(self, plain: Settings, required_savings: Sequence[float]) -> list[np.ndarray]:
        """(P,) bool for each required saving: pieces whose estimated bits shrink by that factor with learned modes."""
        prelude = self.prelude(plain)
        learned_modes = self.learned_modes(prelude.plan, plain, everywhere=True)
        pieces = np.repeat(np.arange(len(learned_modes.counts)), prelude.plan.pieces["count"])
        modes, tracks = (
            sum(
                estimated_bits(self._analysed(plain, number, some).coefficients, pieces, len(learned_modes.counts))
                * sample.scale
                for number, sample in enumerate(self.samples)
            )
            for some in (None, learned_modes)
        )
        owners = np.repeat(np.arange(len(learned_modes.counts)), learned_modes.counts)
        price = estimated_bits(learned_modes.integers, owners, len(learned_modes.counts))
        return [(learned_modes.counts > 0) & ((tracks + price) * saving < modes) for saving in required_savings]

    def _corrected(self, plan: Plan, corrected: np.ndarray) -> np.ndarray:
        """Fractions of the corrections, of such vertices, that fall on the pieces of each level."""
        level_of_vertex = np.repeat(plan.base_level, plan.pieces["count"])
        counts = np.bincount(level_of_vertex[corrected], minlength=self.levels)
        return counts / counts.sum()

    def _costs(self, candidates: list[Settings]) -> list[tuple[float, np.ndarray]]:
        some = {self._prelude_key(settings): settings for settings in candidates}  # by prelude, each to be made once
        with ThreadPoolExecutor(thread_count(self.jobs, self.source)) as pool:
            list(pool.map(self._make_prelude, some.values()))
            # One after the other, because what the first one sees serves all like it.
            for settings in filter(self._make_prelude, candidates):
                if any(settings.learned_bases):
                    self._learn_time(settings)
                if settings.learned_pieces is not None:
                    self._learn_modes(settings)
            costs = []
            for cost in pool.map(self.cost, candidates):
                costs.append(cost)
                self._report()
            return costs

    def prelude(self, settings: Settings) -> CodedPrelude:
        """As in earlier trials, where one had it."""
        key = self._prelude_key(settings)
        with self._kept:
            prelude = self._preludes.pop(key, None)
        prelude = prelude or CodedPrelude(self.source, self.ath, settings)
        with self._kept:
            self._preludes[key] = prelude  # The prelude used last stands last.
            while len(self._preludes) > PRELUDES_KEPT:
                self._preludes.pop(next(iter(self._preludes)))
        return prelude

    def _make_prelude(self, settings: Settings) -> bool:
        """Whether there is a prelude that keeps the bound; it is there for later calls."""
        try:
            self.prelude(settings)
        except BoundError:
            return False
        return True

    def _prelude_key(self, settings: Settings) -> tuple:
        return (
            settings.rest_step,
            settings.rest_slack,
            settings.connected_rest,
            settings.lags.tobytes(),
            None if settings.shape_of is None else settings.shape_of.tobytes(),
            settings.forms.tobytes(),
            settings.layer,
            settings.free_rigid,
        )

    def _with_free_rigid(self, settings: Settings) -> Settings:
        """Rigid branches that move away from what they hang on, or not."""
        if self._without(Feature.FREE_RIGID) or not (settings.rigid > settings.layer).any():
            return settings
        return self._cheapest([settings, replace(settings, free_rigid=True)])

    def _with_basis(self, settings: Settings) -> Settings:
        """The spatial basis of each branch: all alike, or by shape; judged without rotations and with some."""
        plain = [replace(settings, forms=forms) for forms in self._all_forms()]
        candidates = [*plain]
        if not any(settings.rotation_step_factors) and not self._without(Feature.ROTATIONS):
            costs = [cost for cost, _ in self._costs(plain)]
            candidates += [
                replace(own, rotation_step_factors=(1,) * self.levels)
                for own, cost in zip(plain, costs)
                if cost <= HOPELESS * min(costs)
            ]
        return replace(self._cheapest(candidates), rotation_step_factors=settings.rotation_step_factors)

    def _all_forms(self) -> list[np.ndarray]:
        """The forms that branches may have: tubes stay tubes where branches are to keep their shape."""
        looks, tubes = self.source.sheet_like, np.where(self.start.forms > SHEET, self.start.forms, 0)
        forms = [np.full(looks.shape, BEAM, np.int32)]
        if not self._without(Feature.SHEETS):
            forms.append(np.full(looks.shape, SHEET, np.int32))
            if looks.any() and not looks.all():
                forms.insert(0, looks.astype(np.int32))
        with_tubes = [np.where(tubes > 0, tubes, own) for own in forms if tubes.any()]
        return with_tubes if self.start.details[tubes > 0].any() else with_tubes + forms

    def _with_level_steps(self, settings: Settings) -> Settings:
        """Coarser steps for levels whose vertices, and those that hang on them, may be further off."""
        candidates = []
        for part in qz.WEIGHT_PARTS:
            least = self.source.level_weights(self.levels, part)
            for power in (0.5, 1.0):
                candidates.append(replace(settings, level_steps=least**power))
        return self._cheapest([settings, *candidates])

    def _with_rotations(self, settings: Settings) -> Settings:
        if self._without(Feature.ROTATIONS):
            return settings

        factors = ROTATION_FACTORS[:2] if self.effort == "fast" else ROTATION_FACTORS
        candidates = [replace(settings, rotation_step_factors=(k,) * self.levels) for k in factors]
        per_level = np.array([levels for _, levels in self._costs(candidates)])
        mixed = replace(settings, rotation_step_factors=tuple(factors[i] for i in per_level.argmin(axis=0)))
        roots = [replace(settings, rotation_step_factors=(k, *[0] * (self.levels - 1))) for k in factors if k]
        return self._cheapest([settings, mixed, *roots, *candidates])

    def _cheapest(self, candidates: list[Settings]) -> Settings:
        return self._cheapest_of(dict(enumerate(candidates)))[1]

    def _cheapest_of(self, candidates: dict) -> tuple[Any, Settings]:
        costs = [cost for cost, _ in self._costs(list(candidates.values()))]
        return list(candidates.items())[int(np.argmin(costs))]

    def _with_learned_bases(self, settings: Settings) -> Settings:
        """Learned time bases, one for all levels or one for each whose stream it shortens, where the file as a whole
        gets shorter."""
        if self._without(Feature.TIME_BASES):
            return settings
        unlearned = _in_waves(settings)
        own = replace(unlearned, learned_bases=(True,) * self.levels)
        common = replace(own, common_basis=True)
        (_, plain), (_, learned), _ = self._costs([unlearned, own, common])
        mixed = replace(own, learned_bases=tuple((learned < plain).tolist()))
        return self._cheapest([unlearned, mixed, *([] if self._without(Feature.COMMON_BASIS) else [common])])

    def _with_waves_if_smaller(self, settings: Settings) -> Settings:
        """Learned time bases, or none: they take more bytes the finer the steps are. As a file will have them, learned
        at its own step: where a component is just left out, that of another step may have had it."""
        if not any(settings.learned_bases):
            return settings
        self._time_components.clear()
        self._known.pop(self._key(settings), None)
        return self._cheapest([settings, _in_waves(settings)])

    def _with_periodic_waves(self, settings: Settings) -> Settings:
        """Loops that are one segment by waves that go on across their seam: those of a motion that does not are
        larger so."""
        if self._without(Feature.PERIODIC):
            return settings
        return self._cheapest([replace(settings, periodic=True), settings])

    def _with_steps(self, settings: Settings) -> Settings:
        """On short stems those of each basis: affine functions are best at finer steps than modes are."""
        return self._cheapest([self._walk_steps(start, 1.15, 1.4) for start in self._in_each_basis(settings)])

    def _settled(self, settings: Settings) -> Settings:
        """Of small clips those that no other choice of one kind makes smaller, each with steps of its own: what was
        chosen first was chosen at other steps, and sizes jump from bound to bound where the worse one of two stays."""
        for _ in range(SETTLING_ROUNDS if self._is_small else 0):
            plain = replace(settings, learned_pieces=None)
            bases = self._nearest(plain, list(self._other_bases(plain)))
            others = self._nearest(
                settings, [*self._each_with_learned_modes([plain, *bases]), *self._other_waves(settings)]
            )
            best = self._cheapest([settings, *(self._walk_steps(own, 1.15, 1.4) for own in others)])
            if best is settings:
                break
            settings = best
        return settings

    def _other_bases(self, plain: Settings) -> Iterator[Settings]:
        """Other spatial bases and rotations."""
        turned = [replace(plain, rotation_step_factors=(factor,) * self.levels) for factor in ROTATION_FACTORS]
        yield from turned
        yield from (replace(own, forms=forms) for own in (plain, turned[0]) for forms in self._all_forms())

    def _each_with_learned_modes(self, plain: Sequence[Settings]) -> Iterator[Settings]:
        """The settings, and the same with learned modes."""
        yield from plain
        for own in plain if not self._without(Feature.SHAPES) else ():
            some = self._pieces_for_learned_modes(own, qz.REQUIRED_SAVINGS)
            yield from (replace(own, learned_pieces=pieces) for pieces in some if pieces.any())

    def _other_waves(self, settings: Settings) -> Iterator[Settings]:
        """Waves, or learned time bases."""
        yield _in_waves(settings)
        if not self._without(Feature.TIME_BASES):
            own = replace(settings, learned_bases=(True,) * self.levels)
            commons = (False,) if self._without(Feature.COMMON_BASIS) else (False, True)
            yield from (replace(own, common_basis=common) for common in commons)

    def _nearest(self, settings: Settings, others: list[Settings]) -> list[Settings]:
        """The few of the others that are the cheapest, and hardly dearer than the cheapest of all."""
        others = list({self._key(own): own for own in others if self._key(own) != self._key(settings)}.values())
        costs = [cost for cost, _ in self._costs(others)]
        most = NEAR * min([self.cost(settings)[0], *costs])
        return [others[i] for i in np.argsort(costs, kind="stable")[:NEAREST] if costs[i] <= most]

    def _with_calm_parts(self, settings: Settings) -> Settings:
        """A finer step, of all or of turns, where corrections bend and twitch many small rigid parts, as far as it is
        cheap."""
        most, share = CALM_COST * self.cost(settings)[0], self._corrected_parts(settings)
        for _ in range(CALM_ROUNDS):
            if share <= CALM_SHARE:
                break
            finer = (
                replace(settings, step=qz.single(settings.step / CALM_STEP)),
                replace(settings, turn_step=finer_turn(settings.turn_step)),
            )
            calmer = {self._corrected_parts(own): own for own in finer if self.cost(own)[0] <= most}
            if min(calmer, default=share) >= share:
                break
            share = min(calmer)
            settings = calmer[share]
        return settings

    def _corrected_parts(self, settings: Settings) -> float:
        """Of the vertices of rigid parts whose turns are finer than their step asks for, over all frames: the share
        that is corrected."""
        if not settings.turn_step:
            return 0.0
        plan = self.prelude(settings).plan
        small = plan.is_rigid & (plan.levers() * settings.turn_step < settings.step)
        of_small = np.repeat(small, plan.pieces["count"])
        if not of_small.any():
            return 0.0
        number = len(self.samples) // 2
        modes, own = self.learned_modes(plan, settings), settings.of_segment(self.samples[number].whole_loop)
        coded = code_stems(self.prelude(settings), own, self.sample, modes, self._bases(settings, number))
        return of_small[coded.corrected].sum() / (max(1, of_small[coded.sample].sum()) * self.sample.shape[2])

    def _with_finer_steps(self, settings: Settings) -> Settings:
        return self._walk_steps(settings, 1.04, 1.12)

    def _with_rest_slack(self, settings: Settings) -> Settings:
        """A rest pose as far off as the motion leaves room for, where it is much of the file."""
        exact = self.source.reference_is_exact
        if exact or self._layered or self._prelude_bytes(self.prelude(settings)) < REST_SHARE * self.cost(settings)[0]:
            return settings
        slacks = [part * float(np.min(settings.limit)) for part in qz.REST_SLACKS]
        return self._cheapest(
            [settings, *(with_rest_slack(self.source, self.ath, settings, slack) for slack in slacks)]
        )

    def _walk_steps(self, settings: Settings, factor: float, rest_factor: float) -> Settings:
        """Walks step and rest step in turn to the cheapest on geometric grids."""
        for again in range(WALKS):
            before, settings = settings, self._walk(settings, "step", factor, math.inf, again > 0)
            if self.source.reference_is_exact:
                break
            cap = self.extrapolation.rest_cap * settings.bound
            settings = self._walk(settings, "rest_step", rest_factor, cap, again > 0)
            if (settings.step, settings.rest_step) == (before.step, before.rest_step):
                break
        return settings

    def _walk(self, settings: Settings, name: str, factor: float, cap: float, again: bool) -> Settings:
        def moved(exponent: int) -> Settings:
            return replace(settings, **{name: qz.single(min(getattr(settings, name) * factor**exponent, cap))})

        def costs_at(exponents) -> dict[int, float]:
            return dict(zip(exponents, (cost for cost, _ in self._costs([moved(e) for e in exponents]))))

        # at first: a step to be coarse by far may pay where one to be a little coarser does not
        costs = costs_at((-1, 0, 1) if again else (-1, 0, 1, 2))
        while True:
            best = min(costs, key=costs.get)
            wanted = [e for e in (best - 1, best + 1) if e not in costs and abs(e) <= 10]
            if not wanted:
                return moved(best)
            costs |= costs_at(wanted)

    def _with_node_steps(self, settings: Settings) -> Settings:
        """Maps of inner nodes that keep to their share of the file, no finer than the levels' errors ask for."""
        prelude, errors = self.prelude(settings), self._level_errors(settings.bound)
        segment = self._analysed(settings, len(self.samples) // 2, self.learned_modes(prelude.plan, settings))
        rest = self.cost(settings)[1].sum() + self._prelude_bytes(prelude)
        least = min(qz.NODE_BYTES, qz.SMALL_NODE_SHARE * rest) if self._is_played_whole() else qz.NODE_BYTES
        allowed = max(least, qz.NODE_SHARE / (1 - qz.NODE_SHARE) * rest)
        qualities = self._node_qualities()
        chosen = limits = None
        for quality in qualities:
            steps = quality * errors
            segment.clear_nodes()
            segment.analyse_nodes(self.sample, steps, settings.rounding)
            if limits is None:
                if self._map_bytes(prelude.plan, segment) > allowed and quality is not qualities[-1]:
                    continue
                chosen, limits = steps, self._errors_of_maps(prelude, segment)
                limits[1:] = np.minimum(qz.NODE_ERROR_TOLERANCE * limits[1:], limits[:-1])  # deeper levels stay better
            elif (self._errors_of_maps(prelude, segment) <= limits).all():
                chosen = steps
            else:
                break
        return replace(settings, node_steps=chosen)

    def _cost_with_maps(self, settings: Settings) -> float:
        """Bytes of a whole file, those of the maps of nodes included; of layers without: others choose their steps."""
        if self._layered:
            return self.cost(settings)[0]
        settings = self._with_node_steps(settings)
        plan = self.prelude(settings).plan
        segment = self._analysed(settings, len(self.samples) // 2, self.learned_modes(plan, settings))
        segment.analyse_nodes(self.sample, settings.node_steps, settings.rounding)
        return self.cost(settings)[0] + self._map_bytes(plan, segment)

    def _map_bytes(self, plan: Plan, segment: SegmentMotion) -> float:
        """Of the maps of nodes in a whole file, where all segments are like this one."""
        levels = self._map_levels(plan)
        size = sum(len(streams.encode_affines(segment, level)) * self.extrapolation.nodes[level] for level in levels)
        return size * self.source.coded_frames / self.sample.shape[2]

    def _is_played_whole(self) -> bool:
        """Of one layer and segment, so that its coarse levels are hardly ever shown, and need not meet."""
        return not self._layered and not self.source.has_seams

    def _node_qualities(self) -> list[np.ndarray]:
        """(levels,) each, from fine to coarse; that of a few roots is another and rises last, if at all."""
        qualities = [np.full(self.levels, quality) for quality in qz.NODE_QUALITIES]
        if (self.source.hierarchy.branch_parent < 0).sum() > qz.FEW_ROOTS:
            return qualities
        fine, *coarser = qz.ROOT_QUALITIES if self._is_played_whole() else qz.ROOT_QUALITIES[:1]
        roots, coarsest = [fine] * len(qualities) + coarser, qualities[-1:] * len(coarser)
        return [np.append(root, quality[1:]) for root, quality in zip(roots, qualities + coarsest)]

    def _map_levels(self, plan: Plan) -> list[int]:
        return [level for level in range(self.levels) if plan.has_affines(level)]

    def _errors_of_maps(self, prelude: CodedPrelude, segment: SegmentMotion) -> np.ndarray:
        """RMS errors of the sample at the levels that have maps."""
        poses = (segment.pose(level, prelude.origin, prelude.dtype) for level in self._map_levels(prelude.plan))
        return np.array([position_errors(pose, self.sample, prelude.origin, prelude.plan.pool)[2] for pose in poses])
