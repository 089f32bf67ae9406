"""Trials: candidates code samples of the segments, and the bytes of the whole file are estimated from theirs.

`Trials` remembers what every candidate costs. It is all that a coding choice (choices/) sees of a search.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import TypeAlias

import numpy as np

from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model.learned_modes import Components, components, learn
from athcodec.encoding.model.motion import LearnedModes, Plan, SegmentMotion, release_memory
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search import progress
from athcodec.encoding.search.progress import Work
from athcodec.encoding.search.sample import ExtrapolationFactors
from athcodec.encoding.search.segment_samples import LEARNING_SEGMENTS, SegmentSample, usual_change
from athcodec.encoding.segments.segment import (
    Coded,
    CodedPrelude,
    Source,
    StreamBasis,
    analyse_finely,
    basis_ratio,
    code_stems,
    stage_bases,
    stage_streams,
    thread_count,
    time_components,
    uncoded_plan,
)
from athcodec.encoding.segments.settings import Key, Settings
from athcodec.encoding.segments.time_bases import TimeComponents
from athcodec.encoding.streams import streams
from athcodec.errors import BoundError
from athcodec.files.threads import ThreadPool
from athcodec.motion.sampling import spread

TimeComponentsOfSamples: TypeAlias = list[dict[int | None, TimeComponents]]
"""For each sample its components over time by stage; None: those of all stages."""

PRELUDES_KEPT = 6  # Hierarchies and rest poses that are kept between trials.
PRELUDE_BYTES = 1 << 28  # Bytes that the bases of those of a large plant may take, unless one alone takes more.


@dataclass(eq=False)
class Trials:
    """Trials of settings on one plant, or on a sample of it."""

    source: Source
    ath: Ath
    start: Settings  # Settings that the search starts with.
    samples: Sequence[SegmentSample]  # From calm to wild.
    extrapolation: ExtrapolationFactors  # From the part of a plant that is tried to the whole.
    jobs: int | None = None
    work: Work = field(default_factory=Work)  # Work that the whole search may take.
    map_errors: dict[int, float] = field(init=False, default_factory=dict)  # Errors of maps by stage.
    _work_done: int = field(init=False, default=0)  # Work of all trials.
    _known: dict[Key, tuple[float, np.ndarray]] = field(init=False, default_factory=dict)
    _components: dict[Key, Components] = field(init=False, default_factory=dict)
    _last_modes: tuple[Key, LearnedModes] | None = field(init=False, default=None)
    _time_components: dict[Key, tuple[float, TimeComponentsOfSamples]] = field(init=False, default_factory=dict)
    _preludes: dict[Key, CodedPrelude] = field(init=False, default_factory=dict)
    _seen_preludes: set[Key] = field(init=False, default_factory=set)
    _lock: Lock = field(init=False, default_factory=Lock)  # Threads that try candidates share the preludes.

    def __post_init__(self) -> None:
        self.stages = self.start.stages

    @property
    def is_layered(self) -> bool:
        """Whether the file has several layers of precision."""
        return self.start.layer > 0

    @property
    def middle(self) -> int:
        """Number of the sample between the calm and the wild ones."""
        return len(self.samples) // 2

    def in_segments(self, source: Source, samples: Sequence[SegmentSample]) -> Trials:
        """Return trials on the same plant in other segments, which are these if they are on the same positions. Rest
        poses are coded once for both."""
        if [id(sample.positions) for sample in samples] == [id(sample.positions) for sample in self.samples]:
            return self
        change = usual_change(samples) if source.has_seams else math.inf
        other = replace(self, source=source, start=replace(self.start, usual_change=change), samples=samples)
        other._preludes, other._seen_preludes = self._preludes, self._seen_preludes
        return other

    def apart(self) -> Trials:
        """Return a copy that knows the costs so far and counts its own work from zero, without a limit."""
        other = replace(self, work=Work())
        for name in ("_known", "_components", "_time_components", "_preludes", "_seen_preludes"):
            setattr(other, name, getattr(self, name).copy())
        return other

    def without(self, feature: Feature) -> bool:
        """Return whether the file does without a feature."""
        return feature in self.source.without

    @property
    def frames(self) -> int:
        """Number of frames of all samples."""
        return sum(sample.positions.shape[2] for sample in self.samples)

    def work_of(self, each: float) -> float:
        """Return the work of an operation that takes `each` for every vertex in every frame of the samples."""
        return each * self.source.clip.vertex_count * self.frames

    @property
    def work_of_trial(self) -> float:
        """The work of a usual trial."""
        usual = progress.TRIAL + self.work_of(progress.ANALYSIS + progress.TURNS)
        return self._work_done / len(self._known) if self._known else usual

    def cost(self, settings: Settings) -> float:
        """Return the bytes of a whole file, without maps of nodes; infinite if the bound cannot be kept."""
        return self._tried(settings)[0]

    def stage_costs(self, settings: Settings) -> np.ndarray:
        """Return the bytes of each stage's streams in a whole file, (stages,)."""
        return self._tried(settings)[1]

    def costs(self, candidates: Sequence[Settings]) -> list[float]:
        """Return the estimated bytes of the file with each candidate, in their order; several are tried at once on
        threads. The cost is infinite for a candidate that does not keep the bound, or whose trial the allowed work has
        no room for.
        """
        keys = [settings.key for settings in candidates]
        fitting = self._fitting(keys)
        tried = list({key: settings for settings, key in zip(candidates, keys) if key in fitting}.values())
        by_prelude = {settings.prelude_key: settings for settings in tried}
        pool = ThreadPool(thread_count(self.jobs, self.source))
        list(pool.ordered(self._keeps_bound, by_prelude.values(), pool.jobs))
        # Learning is done in order, because the first candidate of a kind decides what all like it learn.
        for settings in filter(self._keeps_bound, tried):
            if any(settings.learned_bases):
                self._learn_time(settings)
            if settings.learned_pieces is not None:
                self._learn_modes(settings)
        for _ in pool.ordered(self.cost, tried, pool.jobs):
            self.work.report()
        return [self._known[key][0] if key in fitting else math.inf for key in keys]

    def _fitting(self, keys: Sequence[Key]) -> set[Key]:
        """Return the keys of those candidates whose cost is known, or whose trials fit the work that is allowed."""
        known = {key for key in keys if key in self._known}
        for key in keys:
            if key not in known and self.work.fits((1 + len(known - self._known.keys())) * self.work_of_trial):
                known.add(key)
        return known

    def cheapest(self, candidates: Sequence[Settings]) -> Settings:
        """Return the candidate that makes the smallest file, the first of several."""
        return candidates[int(np.argmin(self.costs(candidates)))]

    def prelude(self, settings: Settings) -> CodedPrelude:
        """Return the hierarchy and the rest pose as coded under some settings; they are coded now unless they are kept
        from an earlier trial. Raises BoundError if the rest pose cannot keep the bound.
        """
        key = settings.prelude_key
        with self._lock:
            prelude = self._preludes.pop(key, None)
            if prelude is not None:
                self._preludes[key] = prelude  # The prelude used last stands last.
                return prelude
            if self._preludes:  # Room for another one as large is made beforehand.
                self._keep_preludes(next(iter(self._preludes.values())).plan.bases_bytes, others=1)
        prelude = CodedPrelude(self.source, self.ath, settings)
        with self._lock:
            if key not in self._seen_preludes:  # A prelude that was dropped depends on the order of threads.
                self._seen_preludes.add(key)
                squares = float(np.square(prelude.plan.pieces["count"]).sum())
                self.work.add(progress.POSE * self.source.clip.vertex_count + progress.PIECE * squares)
            self._preludes[key] = prelude
            self._keep_preludes(prelude.plan.bases_bytes)
        return prelude

    def _keep_preludes(self, size: int, others: int = 0) -> None:
        """Drop the preludes that were not used for longest, so that all take at most PRELUDE_BYTES. `size`: bytes of
        the bases of each; `others`: how many more are to come."""
        most = min(PRELUDES_KEPT, max(1, PRELUDE_BYTES // max(1, size))) - others
        while len(self._preludes) > most:
            self._preludes.pop(next(iter(self._preludes)))

    def prelude_bytes(self, settings: Settings) -> float:
        """Return the bytes of hierarchy and rest pose of the whole plant."""
        return self.prelude(settings).prelude_bytes * self.extrapolation.vertices

    def learned_modes(self, plan: Plan, settings: Settings) -> LearnedModes | None:
        """Return the learned modes of the pieces that the settings name; None if they name none."""
        if settings.learned_pieces is None:
            return None
        return self._learned(self._learn_modes(settings), plan, settings, settings.learned_pieces)

    def learned_modes_everywhere(self, settings: Settings) -> LearnedModes:
        """Return the learned modes of all pieces. The prelude is made after what takes the most memory."""
        seen = self._learn_modes(settings)
        return self._learned(seen, self.prelude(settings).plan, settings, None)

    def _learned(self, seen: Components, plan: Plan, settings: Settings, pieces: np.ndarray | None) -> LearnedModes:
        """Return the learned modes of some pieces, (P,) bool, or of all if that is None."""
        key = id(seen), settings.step, pieces if pieces is None else pieces.tobytes()
        last = self._last_modes  # Other rest poses are tried with the same modes, by several threads.
        if last is None or last[0] != key:
            self._last_modes = last = key, learn(plan, seen, settings.step, pieces)
        return last[1]

    def analysed(
        self, settings: Settings, number: int, modes: LearnedModes | None, bent: bool = False
    ) -> SegmentMotion:
        """Return the quantised motion of sample `number` under some settings. bent: as SegmentMotion.analyse has it."""
        plan, sample = self.prelude(settings).plan, self.samples[number]
        of_sample = settings.of_segment(sample.whole_loop)
        stages = stage_streams(of_sample, plan.stage_count, self._bases(settings, number))
        segment = SegmentMotion(plan, sample.positions.shape[2], stages, modes, periodic=of_sample.periodic)
        segment.analyse(sample.positions, of_sample.rounding, bent=bent)
        return segment

    def coded(self, settings: Settings, number: int, modes: LearnedModes | None) -> Coded:
        """Return the coded streams of sample `number` under some settings."""
        sample = self.samples[number]
        of_sample = settings.of_segment(sample.whole_loop)
        return code_stems(self.prelude(settings), of_sample, sample.positions, modes, self._bases(settings, number))

    def forget(self, settings: Settings) -> None:
        """Forget all learned time bases and what the settings cost, so that they are learned at their own step."""
        self._time_components.clear()
        self._known.pop(settings.key, None)

    def forget_modes(self) -> None:
        """Free the components of learned modes, which take as much memory as a segment."""
        self._components.clear()
        self._last_modes = None

    def _tried(self, settings: Settings) -> tuple[float, np.ndarray]:
        """Return bytes and bytes of each stage under some settings, from an earlier trial if there was one."""
        key = settings.key
        if key not in self._known:
            self._known[key] = self._try(settings)
        return self._known[key]

    def _try(self, settings: Settings) -> tuple[float, np.ndarray]:
        """Code the samples under some settings. Return two things: the estimated bytes of the whole file, and those of
        each stage's streams, (stages,). All are infinite if the bound cannot be kept.
        """
        try:
            plan = self.prelude(settings).plan
            modes = self.learned_modes(plan, settings)
            coded = [self._coded_bytes(settings, number, modes) for number in range(len(self.samples))]
        except BoundError:
            self._count(progress.TRIAL)
            return math.inf, np.full(self.stages, math.inf)
        stages, coding = np.sum([stages for stages, _ in coded], axis=0), sum(work for _, work in coded)
        each = progress.ANALYSIS + progress.TURNS * any(settings.rotation_step_factors)
        self._count(progress.TRIAL + self.work_of(each) + coding)
        stored = streams.encode_learned_modes(plan, modes)
        mode_bytes = sum(len(stream) * self.extrapolation.rows[stage] for stage, stream in stored.items())
        return float(stages.sum()) + mode_bytes + self.prelude_bytes(settings), stages

    def _coded_bytes(self, settings: Settings, number: int, modes: LearnedModes | None) -> tuple[np.ndarray, float]:
        """Code sample `number`. Return two things: the estimated bytes of each stage's streams, (stages,), in all
        segments that the sample stands for; and the work that depends on what was coded.
        """
        coded = self.coded(settings, number, modes)
        rows, size = len(coded.corrections.rows), sum(map(len, coded.stems.values()))
        return self._stage_bytes(coded, self.samples[number]), progress.BYTE * size + progress.CORRECTION * rows

    def _count(self, work: float) -> None:
        """Count the work of a trial."""
        self.work.add(work)
        with self._lock:
            self._work_done += int(work)

    def _stage_bytes(self, coded: Coded, sample: SegmentSample) -> np.ndarray:
        """Return the estimated bytes of each stage's streams, (stages,), in all segments of the whole plant that a
        sample stands for. `coded`: the coded sample.
        """
        stages, heads = np.zeros(self.stages), np.zeros(self.stages)
        for stage, stream in coded.stems.items():
            stages[stage], heads[stage] = len(stream), coded.heads[stage]
        corrections = len(coded.corrections.chunk) / coded.sample_share
        if corrections:
            stage_of_vertex = np.repeat(coded.segment.plan.base_stage, coded.segment.plan.pieces["count"])
            counts = np.bincount(stage_of_vertex[coded.corrected], minlength=self.stages)
            stages += corrections * (counts / counts.sum())
        stages += (stages - heads) * (self.extrapolation.rows - 1)
        return stages * sample.scale

    def _keeps_bound(self, settings: Settings) -> bool:
        """Return whether the rest pose under some settings keeps the bound. The coded pose is kept for later calls if
        there is room.
        """
        if settings.prelude_key in self._seen_preludes:
            return True
        try:
            self.prelude(settings)
        except BoundError:
            return False
        return True

    def _bases(self, settings: Settings, number: int) -> dict[int, StreamBasis]:
        """Return the time bases of the stages that learn theirs."""
        if not any(settings.learned_bases):
            return {}
        step, learned = self._learn_time(settings)
        plan = self.prelude(settings).plan
        return stage_bases(plan, settings, learned[number], basis_ratio(plan, settings, settings.step / step))

    def _learn_time(self, settings: Settings) -> tuple[float, TimeComponentsOfSamples]:
        """Return two things for trials of learned time bases: the step at which the components were measured, which is
        that of the first trial to ask for them; and the components over time of each sample, by stage, with None for
        all stages together.
        """
        only_common = self.is_layered and settings.common_basis
        key = *_before_modes(settings), settings.stage_steps.tobytes(), settings.periodic, only_common
        if key not in self._time_components:
            prelude = self.prelude(settings)  # Layers learn about the coded pose of the last one.
            plan = prelude.plan if self.is_layered else self._uncoded_plan(settings)
            stages = [*(stage for stage in range(self.stages) if plan.has_stems(stage) and not only_common), None]
            longest = max(sample.positions.shape[2] for sample in self.samples)
            self.work.add(self.work_of(progress.BASIS + progress.COMPONENT * longest))
            each = 3 if plan.kinds.any() else 1  # Of all tracks, and of two kinds of plants.
            matrices = each * len(stages) * len(self.samples)
            self.work.add(progress.EIGENVECTOR * longest**3 * matrices)
            release_memory()
            learned = [
                time_components(
                    plan,
                    settings.of_segment(sample.whole_loop),
                    sample.positions,
                    stages,
                    last=plan is not prelude.plan and sample is self.samples[-1],
                )
                for sample in self.samples
            ]
            self._time_components[key] = settings.step, learned
        return self._time_components[key]

    def _uncoded_plan(self, settings: Settings) -> Plan:
        """Return the plan on the rest pose before it is coded. What is learned on it is kept, and it is not: its bases
        may take more memory than the positions of a segment."""
        return uncoded_plan(self.source, self.ath, settings)

    def _learn_modes(self, settings: Settings) -> Components:
        """Return the components from which modes of pieces are learned, measured on segments spread over the clip, at
        the steps of the first trial to ask for them.
        """
        coded, count = settings.learned_coded, len(self.source.segments)
        key = _before_modes(settings) + (settings.prelude_key if coded else ())
        if key not in self._components:
            plan = self.prelude(settings).plan if coded else self._uncoded_plan(settings)
            chosen = spread(count, LEARNING_SEGMENTS)
            frames = sum(self.source.frames_of(segment) for segment in chosen)
            self.work.add((progress.LEARNT + progress.LEARNING * frames) * self.source.clip.vertex_count)
            self._components[key] = components(plan, self._analysed_finely(plan, settings, chosen, last=not coded))
        return self._components[key]

    def _analysed_finely(
        self, plan: Plan, settings: Settings, segments: Sequence[int], last: bool
    ) -> Iterator[SegmentMotion]:
        """Yield segments that were analysed with a fine step. `last`: whether the plan is of no use afterwards; its
        bases are freed then before the last segment is looked at.
        """
        release_memory()
        for segment in segments:
            motion = analyse_finely(plan, settings, self.source.positions(segment), bent=True)
            if last and segment == segments[-1]:
                plan.forget_bases()
            yield motion
            del motion  # The next segment is analysed after this one has been freed.


def distinct(candidates: Iterable[Settings]) -> list[Settings]:
    """Return the candidates without those that are the same as others."""
    return list({settings.key: settings for settings in candidates}.values())


def _before_modes(settings: Settings) -> Key:
    """Return what decides the motion that is left for the modes of a piece."""
    return settings.rotation_step_factors, settings.forms.tobytes(), settings.still
