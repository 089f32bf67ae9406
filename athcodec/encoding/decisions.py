"""What is decided about a file: search or prediction, layers, and the length of segments.

Settings are searched for by search/. Segments are coded and whole files are put together (assembly/) only where their
bytes decide. What a file promises is checked on what a decoder will output.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import NamedTuple

from athcodec.decoding import container as ct
from athcodec.encoding.assembly.assembly import FileAssembly
from athcodec.encoding.assembly.decided import CodedSegment, Decided, Draft
from athcodec.encoding.assembly.segment_coding import SegmentCoder
from athcodec.encoding.clip.coded_clip import CodedClip
from athcodec.encoding.clip.survey import Ath, Survey
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.options.features import Feature
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.search.choices.prediction import FoundPrediction, best_prediction, one_map_each
from athcodec.encoding.search.hopeless import Hopeless
from athcodec.encoding.search.predicted_trees import PredictedSplit
from athcodec.encoding.search.progress import (
    FILE_BYTE,
    MOTION,
    POSES,
    READING,
    STAGE_MOTION,
    SURVEY,
    Progress,
    Work,
    allowed_work,
    silent,
)
from athcodec.encoding.search.sample import is_small
from athcodec.encoding.search.search import PosesBeside, Search
from athcodec.encoding.search.segment_samples import typical_segments
from athcodec.encoding.search.start import still_choice
from athcodec.encoding.search.still import SplitSource
from athcodec.encoding.segments.layers import (
    MOST_LAYERS,
    MOST_LEVELS,
    Layer,
    Layers,
    layer_ratios,
    layers_of,
    step_factors,
)
from athcodec.encoding.segments.segment import CodedPrelude, Source
from athcodec.encoding.segments.settings import Choice
from athcodec.errors import BoundError, ClipError
from athcodec.motion.thresholds import Thresholds
from athcodec.options import DEFAULT_LADDER, LADDERS

CHUNK_BYTES = 6  # Bytes of the front for a chunk, four of them its checksum.
LEVEL_BYTES = 6  # Bytes of the front for the three errors of a level in a segment.
PREDICTED_SHARE = 0.8  # Largest share of the bytes of layers at which predicted motion, which has none, is better.
REFUSAL_ROUNDS = 12  # Files that are coded at most to name a bound that can be kept: some clips can keep none.
TREES_SAVE = 0.78  # Largest share of the bytes of growing trees in modes at which prediction is tried for them.
SURELY_SAVES = 0.4  # The same at which it is without a comparison of both files.
APART_SHARE = 0.9  # Largest share of the bytes of layers at which a file of which a part has none is better.
SEARCHED = 0.8  # Bytes that a search usually leaves of those at first settings.
SHOWN_SHARE = 1 / 64  # Largest distance, in bounds, of a frame from what others show in its place.
FEW_BYTES = 2000  # Bytes up to which the file of a small clip may do without coarse levels.
FINER_LADDERS = 0.5, 0.25  # Factors on the errors of layers that are tried where too few stages are fit for levels.
LEAST_LEVELS = 3  # Levels of a file below which finer layers are tried.
LEVELS_BYTES = 20_000  # Bytes of motion from which on a file is streamed, and needs levels.
SEARCH_SAVES = 0.4  # Smallest share of the bytes at its first settings that a search has come down to.


class GrowingTrees(NamedTuple):
    """A source divided into trees that grow and others, the usual prediction of the former, and whether that is surely
    better for them than modes."""

    split: PredictedSplit
    prediction: FoundPrediction
    is_sure: bool


@dataclass(frozen=True)
class FileDecisions:
    """Decides what a file is made of: search or prediction, layers, and the length of segments.

    These are one job because each decision is made by the bytes that the others give: segments of another length are
    searched anew, and prediction stands against the file that the search has found.
    """

    source: Source
    options: EncodingOptions
    report: Progress = silent
    spent: float = 0.0  # Work of finding branches.
    predicts_as_usual: bool = False  # Whether no other way to predict motion is tried.
    untried: tuple[str, ...] = ()  # What that left out.
    beside: PosesBeside | None = None  # What the poses of branches that stand still add, if these are no part of it.

    @property
    def clip(self) -> CodedClip:
        return self.source.clip

    @property
    def seen(self) -> Survey:
        return self.source.seen

    @property
    def segment_count(self) -> int:
        return len(self.source.segments)

    def thresholds(self, bound: float) -> Thresholds:
        return self.options.tam or Thresholds(bound, 0, bound, 0)

    def _check(self, bound: float) -> None:
        smallest = self.source.smallest_bound(bound)
        qz.check_bound(smallest, self.seen.low, self.seen.high, self.clip.dtype, self.source.extent)

    @contextmanager
    def refusing(self, bound: float) -> Iterator[None]:
        """Return a context in which a BoundError, raised while coding at `bound`, is replaced by one that names the
        smallest bound that this clip can keep, if one is found.
        """
        try:
            yield
        except BoundError:
            self._check(bound)
            least = self._smallest_kept(bound)
            if least == math.inf:
                raise
            raise BoundError(
                f"max error: got {bound:.3g}; expected at least {least:.3g}, the smallest that this clip can keep"
            ) from None

    def _smallest_kept(self, low: float) -> float:
        """Return the smallest bound above `low` that trials of a few bounds found to be kept, or infinity if none
        was.
        """
        high = math.inf
        for _ in range(REFUSAL_ROUNDS):
            bound = qz.rounded_up(4 * low if high == math.inf else math.sqrt(low * high))
            if bound >= high:
                break
            low, high = (bound, high) if self.file_size(bound) == math.inf else (low, bound)
        return high

    def tried(self, bound: float, work: Work, frames_ratio: float, hopeless: Hopeless) -> tuple[float, bool]:
        """Return about the bytes of a file of so many times the frames, as far as the work allowed tells, and whether
        its motion is predicted; infinite if the bound cannot be kept. `hopeless`: what trials on other branches have
        shown to be so; what this one shows is added."""
        return self._holding(bound)._tried(bound, work, frames_ratio, hopeless)

    def _tried(self, bound: float, work: Work, frames_ratio: float, hopeless: Hopeless) -> tuple[float, bool]:
        """Return two things: the estimated bytes of a file at `bound` that has `frames_ratio` times as many frames as
        the clip, infinite if the bound cannot be kept; and whether the motion of that file is predicted.
        """
        try:
            self._check(bound)
            if self.source.still:
                return self.decide(bound).shared_bytes, False
            found = self._growing_trees(bound, work)
            if found is not None:
                others = dataclasses.replace(self, source=found.split.moving_source)
                size = others._tried(bound, work, frames_ratio, Hopeless())[0]
                apart = found.prediction.bytes_of(frames_ratio) + size, False
                return apart if found.is_sure else min(apart, self._tried_alike(bound, work, frames_ratio, hopeless))
            return self._tried_alike(bound, work, frames_ratio, hopeless)
        except BoundError:
            return math.inf, False

    def _tried_alike(self, bound: float, work: Work, frames_ratio: float, hopeless: Hopeless) -> tuple[float, bool]:
        """Return what `_tried` does, for a file of motion of one kind."""
        try:
            ath = self.seen.ath(self.thresholds(bound))
            ratios, effort, jobs = (
                self._layer_ratios(ath, bound, self.options.ladder),
                self.options.effort,
                self.options.jobs,
            )
            search = Search.of(self.source, ath, bound, effort, work, jobs, ratios=ratios, hopeless=hopeless)
            if hopeless.prediction:
                return search.expected(frames_ratio, hopeless), False
            unsearched = search.first_cost()
            prediction = self._best_prediction(bound, unsearched, work)
            if prediction is None:  # First settings rank branches as the work that is left for a search hardly does.
                hopeless.prediction = True
                return search.expected(frames_ratio, hopeless), False
            predicted = frames_ratio * prediction.bytes, True
            if prediction.bytes < SEARCH_SAVES * unsearched:
                return predicted
            return min((search.tried(frames_ratio), False), predicted)
        except BoundError:
            return math.inf, False

    def decide(self, bound: float) -> Decided:
        """Decide about a file that keeps `bound`: search for the settings of what moves, settle what stands still
        beside it, and return both with the layers, streams and segments that follow from them.
        """
        self._check(bound)
        holding = self._holding(bound)
        split = holding._split(bound, self.thresholds(bound))
        moving = holding
        if split is not None:
            moving = dataclasses.replace(holding, source=split.moving_source, beside=split.poses_beside)
        work = moving._allowed_work(bound)
        decided = moving._decide_by_trees(bound, work)
        if split is not None:
            choice = split.choice(decided.choice, decided.ath.thresholds)
            decided = holding._coded_as(decided, choice)
        decided = holding._with_levels(decided, work)
        untried = tuple(dict.fromkeys([*self.untried, *work.untried]))
        decided.choice = dataclasses.replace(decided.choice, untried=untried)
        return decided

    def _with_levels(self, decided: Decided, work: Work) -> Decided:
        """Return `decided`, or a decision with finer layers if it gives a file more levels. Coarse layers give too few
        where the motion that they show is less smooth than the source's, as in calms between gusts. Finer ones are
        tried for the usual ladder alone, and as far as the work allows to code typical segments.
        """
        if not self._has_usual_ladder or len(decided.layers.each) == 1:
            return decided
        with work.trying("levels"):
            if not self._may_code_typical_segments(decided, work) or self._estimated_bytes(decided) < LEVELS_BYTES:
                return decided
            options = dataclasses.replace(self.options, segment_frames=decided.source.segment_frames)
            decisions, most = dataclasses.replace(self, options=options), self._level_count(decided)
            best, choice, each = decided, decided.choice, self._typical_work(decided)
            for part in FINER_LADDERS:
                if most >= LEAST_LEVELS or not work.fits(each):
                    break
                work.add(each)
                finer = dataclasses.replace(choice, ladder=tuple(part * error for error in options.ladder))
                other = decisions._of_choice(finer, decided.ath.thresholds)
                count = self._level_count(other)
                best, most = (other, count) if count > most else (best, most)
            return best

    def _may_code_typical_segments(self, decided: Decided, work: Work) -> bool:
        """Return whether the typical segments have been coded already, or there is work left to code them. If they
        still have to be coded, their work is counted here as done.
        """
        typical = [segment for segment, _ in typical_segments(decided.source)]
        if all(segment in decided.tried or decided.source.stands_alone(segment) for segment in typical):
            return True
        each = self._typical_work(decided)
        if not work.fits(each):
            return False
        work.add(each)
        return True

    def _typical_work(self, decided: Decided) -> float:
        """Return the work of coding typical segments."""
        frames = sum(decided.source.frames_of(segment) for segment, _ in typical_segments(decided.source))
        return self._coding_work(decided.choice.settings.bound, frames)

    def _level_count(self, decided: Decided) -> int:
        """Return the number of levels of a file, as far as typical segments tell."""
        coded = [self._tried_segment(decided, segment) for segment, _ in typical_segments(decided.source)]
        return len(FileAssembly(decided, self.options).levels_of(coded))

    def _tried_segment(self, decided: Decided, segment: int) -> CodedSegment:
        if segment not in decided.tried:
            decided.tried[segment] = SegmentCoder(decided, self.options).one(segment)
        return decided.tried[segment]

    def _split(self, bound: float, thresholds: Thresholds) -> SplitSource | None:
        """Return what moves and what stands still, each as a source; None: one of them is missing. What stands still
        takes no part in the search for settings."""
        return SplitSource.of(self.source, self.seen.ath(thresholds), bound)

    def _of_choice(self, choice: Choice, thresholds: Thresholds) -> Decided:
        """Return the decision about a file whose settings are already chosen, for moving and still branches alike: the
        layers and streams that follow from `choice`, with the hierarchy that TAM gives for `thresholds`.
        """
        bound, predicted = choice.settings.bound, choice.settings.predicted_trees
        split = self._split(bound, thresholds)
        source = self.source if split is None else split.marked
        if predicted is not None:
            source = source.marking(predicted if split is None else predicted | split.still)
        if not choice.predicted and source.segment_frames != self.options.segment_frames:
            source = source.in_segments(self.options.segment_frames)
        decisions = dataclasses.replace(self, source=source)
        if choice.predicted:
            return decisions._predicted(choice)
        ath = self.seen.ath(thresholds)
        ath = ath if predicted is None else ath.as_one(predicted)
        return decisions._layered(ath, choice, CodedPrelude(source.about(choice.reference), ath, choice.settings))

    def _holding(self, bound: float) -> FileDecisions:
        """Return the decisions about a clip without frames that others show within a small part of the bound."""
        tolerance = 0.0 if self.options.lossless else SHOWN_SHARE * self.source.smallest_bound(bound)
        return dataclasses.replace(self, source=self.source.holding(tolerance))

    def _decide_by_trees(self, bound: float, work: Work) -> Decided:
        """Decide about a file at `bound` in which trees that grow may have motion of another kind than others. If both
        kinds of files may be the smaller one, and there is work left for as much again, both are compared."""
        found, before = self._growing_trees(bound, work), work.done
        if found is None:
            return self._decide(bound, work)
        begins_apart = found.is_sure or self._is_smaller_apart(found, bound, work)
        apart = self._tried_apart(found, bound, work) if begins_apart else None
        if apart is not None and (found.is_sure or not work.fits(work.done - before)):
            return apart
        alike = self._decide(bound, work)
        if not begins_apart and work.fits(work.done - before):
            apart = self._tried_apart(found, bound, work)
        share = APART_SHARE if len(alike.layers.each) > 1 else 1.0
        is_smaller = apart is not None and self._estimated_bytes(apart) < share * self._size(alike)
        return apart if apart is not None and is_smaller else alike

    def _tried_apart(self, found: GrowingTrees, bound: float, work: Work) -> Decided | None:
        """Return what `_decide_apart` does, and None, too, if typical segments cannot keep the bound."""
        with suppress(BoundError):
            apart = self._decide_apart(found, bound, work)
            if apart is not None and math.isfinite(self._estimated_bytes(apart)):
                return apart
        return None

    def _is_smaller_apart(self, found: GrowingTrees, bound: float, work: Work) -> bool:
        """Return whether a file with two kinds of motion is smaller, as far as first settings show it."""
        others = dataclasses.replace(self, source=found.split.moving_source)
        alike, in_modes = (SEARCHED * one._first_cost(bound, work) for one in (self, others))
        return found.prediction.bytes + in_modes < alike

    def _decide_apart(self, found: GrowingTrees, bound: float, work: Work) -> Decided | None:
        """Decide about a file of which some trees have predicted motion, and others modes. Return None if the others
        are smaller with predicted motion, too, or if it cannot keep the bound. `found`: these trees."""
        split = found.split
        poses_beside = split.predicting(found.prediction.choice).poses_beside
        decided = dataclasses.replace(self, source=split.moving_source, beside=poses_beside)._decide(bound, work)
        source = split.still_source.in_segments(decided.source.segment_frames)
        growing = dataclasses.replace(self, source=source)
        prediction = None if decided.choice.predicted else growing._best_prediction(bound, math.inf, work, source)
        if prediction is None:
            return None
        choice = split.predicting(prediction.choice).choice(decided.choice, decided.ath.thresholds)
        return self._coded_as(decided, choice)

    def _growing_trees(self, bound: float, work: Work) -> GrowingTrees | None:
        """Return the source divided into trees that grow and others. Return None if one of them is missing, or if
        motion of one kind is surely better.
        """
        if self.options.tam or self.options.lossless or Feature.PREDICTED in self.options.without:
            return None
        split = PredictedSplit.by_growth(self.source, self.seen.ath(self.thresholds(bound)), bound)
        if split is None:
            return None
        growing = dataclasses.replace(self, source=split.still_source, predicts_as_usual=True)
        some = dataclasses.replace(growing, source=split.some_growing)
        sample, prediction = (
            some._best_prediction(bound, math.inf, work),
            growing._best_prediction(bound, math.inf, work),
        )
        if sample is None or prediction is None:
            return None
        share = sample.bytes / some._first_cost(bound, work)
        return GrowingTrees(split, prediction, share <= SURELY_SAVES) if share <= TREES_SAVE else None

    def _first_cost(self, bound: float, work: Work) -> float:
        """Return the bytes of a file in modes, at the settings that a search starts with."""
        ath = self.seen.ath(self.thresholds(bound))
        return Search.of(self.source, ath, bound, self.options.effort, work, self.options.jobs).first_cost()

    def _coded_as(self, decided: Decided, choice: Choice) -> Decided:
        """Return the decision about a file of all branches, in the segments and layers of one of some branches, for a
        choice that extends that one's."""
        options = dataclasses.replace(self.options, segment_frames=decided.source.segment_frames)
        if len(decided.layers.each) == 1:
            options = dataclasses.replace(options, ladder=())
        return dataclasses.replace(self, options=options)._of_choice(choice, decided.ath.thresholds)

    def _decide(self, bound: float, work: Work) -> Decided:
        """Decide about a file at `bound`, all of whose branches are searched, within the allowed `work`: its settings
        and layers or its prediction, and the length of its segments.
        """
        ath = self.seen.ath(self.thresholds(bound))
        ratios = self._layer_ratios(ath, bound, self.options.ladder)
        ratio = ratios[0]
        if self.source.still:
            choice = still_choice(self.source, ath, bound, ratio)
            return self._layered(ath, choice, CodedPrelude(self.source, ath, choice.settings))
        share = PREDICTED_SHARE if ratio > 1 else 1.0
        effort, jobs = self.options.effort, self.options.jobs
        search = Search.of(self.source, ath, bound, effort, work, jobs, ratios=ratios, beside=self.beside)
        if self._has_usual_ladder and search.stages_need_own_bases():
            return self._with_one_layer()._decide(bound, work)
        with work.trying("segments"):
            best = self._searched(search, share, work)
        shorter = search.shorter_segments() if self.options.segment_frames is None else []
        least, coding = self._size(best) if shorter else 0, self._coding_work(bound, self.clip.frame_count)
        for left, (length, price) in zip(range(len(shorter), 0, -1), shorter):
            with work.trying("segments", 1 / left), suppress(BoundError):
                if least >= SEARCH_SAVES * price and work.fits(coding):
                    work.add(coding)
                    decisions = self._in_segments(length)
                    other = decisions._decide(bound, work)
                    size = decisions._size(other)
                    best, least = (other, size) if size < least else (best, least)
        return best

    def _searched(self, search: Search, share: float, work: Work) -> Decided:
        """Return the decision for the best settings that `search` finds, or for predicted motion if a file with it
        takes at most `share` times the bytes of the file with those settings. Raises BoundError if neither keeps the
        bound.
        """
        bound, unsearched = search.trials.start.bound, share * search.first_cost()
        if math.isfinite(unsearched):
            work.allowed -= FILE_BYTE * unsearched
            search.keep_work_of_maps()
        start = search.trials.start
        keeps_shape = (self.source.keeps_shape & (start.rigid > start.layer)).any()  # Also in the last layer.
        prediction = None if keeps_shape else self._best_prediction(bound, unsearched, work)
        if prediction is not None and prediction.bytes < unsearched:
            with work.trying("transformed motion"):
                if prediction.bytes < SEARCH_SAVES * unsearched or not work.fits(search.trials.work_of_trial):
                    return self._predicted(prediction.choice)
        try:
            choices, prelude = search.decide()
            if prediction is not None and prediction.bytes < share * search.cost:
                return self._predicted(prediction.choice)
            best = self._best_of(search, choices, prelude)
            if self._is_short(best) and work.fits(work.done):
                others = best, self._without_stages(bound, work)
                best = min(others, key=lambda one: self._estimated_bytes(one) + self._poses_beside(one, work))
            if prediction is None or prediction.bytes >= share * self._estimated_bytes(best):
                return best
        except BoundError:
            if prediction is None:
                raise
        return self._predicted(prediction.choice)

    def _with_one_layer(self) -> FileDecisions:
        """Return the decisions about a clip whose stages move by series of their own, which prediction hardly suits."""
        return dataclasses.replace(self, options=dataclasses.replace(self.options, ladder=()), predicts_as_usual=True)

    def _in_segments(self, frames: int) -> FileDecisions:
        """Return the decisions about the clip in segments of at most so many frames."""
        options = dataclasses.replace(self.options, segment_frames=frames)
        return dataclasses.replace(self, source=self.source.in_segments(frames), options=options)

    def _allowed_work(self, bound: float) -> Work:
        """Return the work that the decisions about a file may take: what its survey and coding leave of all."""
        vertices, frames = self.clip.vertex_count, self.clip.frame_count
        known = (READING + SURVEY) * vertices * frames + POSES * vertices + self._coding_work(bound, frames)
        return Work(allowed_work(vertices, frames, self.options.effort) - known - self.spent, self.report)

    def _coding_work(self, bound: float, frames: int) -> float:
        """Return the work of coding the motion of so many frames."""
        layers = len(layer_ratios(self.options.ladder, bound, self.seen.diagonal))
        stages = int(self.source.hierarchy.branch_depth.max())
        return (MOTION * (1 + layers) / 2 + STAGE_MOTION * stages) * self.clip.vertex_count * frames

    def _best_of(self, search: Search, choices: list[Choice], prelude: CodedPrelude) -> Decided:
        """Return the decision, of those for the `choices` of a search, that makes the smallest file. The first choice
        is always among those compared, the others only while there is work left to code typical segments with them.
        `prelude`: the hierarchy and poses as coded for these choices.
        """
        trials = search.trials
        frames = sum(trials.source.frames_of(segment) for segment, _ in typical_segments(trials.source))
        each, coded = self._coding_work(trials.start.bound, frames), choices[:1]
        for choice in choices[1:]:
            if trials.work.fits(each):
                trials.work.add(each)
                coded.append(choice)
        layered = [self._layered(trials.ath, choice, prelude) for choice in coded]
        return layered[0] if len(layered) == 1 else min(layered, key=self._estimated_bytes)

    def _is_short(self, decided: Decided) -> bool:
        """Return whether a file is loaded and played whole, so that its coarse levels are hardly ever shown."""
        options = self.options
        if len(decided.layers.each) > 1 or decided.ath.height == 0 or options.tam is not None:
            return False
        small = is_small(self.clip.vertex_count, self.source.segments, options.effort)
        return small and self._estimated_bytes(decided) <= FEW_BYTES

    def _without_stages(self, bound: float, work: Work) -> Decided:
        """Return the best file with one node for the whole plant, whatever its error."""
        ath = self.seen.ath(Thresholds(bound, self.clip.frame_count, self.seen.largest_distance.max(), 0))
        search = Search.of(self.source, ath, bound, self.options.effort, work, self.options.jobs, beside=self.beside)
        return self._best_of(search, *search.decide())

    def _poses_beside(self, decided: Decided, work: Work) -> float:
        """Return the bytes that the poses of branches that stand still add to a file of those that move."""
        choice = decided.choice
        if self.beside is None:
            return 0.0
        return self.beside(self.source.about(choice.reference), decided.ath, choice.settings, work)

    def _best_prediction(
        self, bound: float, most_bytes: float, work: Work, source: Source | None = None
    ) -> FoundPrediction | None:
        """Return the best prediction, in its long segments or in those of a `source`; None: it is too large, or a
        hierarchy of maps is asked for, which it lacks."""
        if self.options.tam or Feature.PREDICTED in self.options.without:
            return None
        source = self._long_segments if source is None else source
        return best_prediction(source, bound, most_bytes, work, self.options.smoothness, self.predicts_as_usual)

    @property
    def _long_segments(self) -> Source:
        return self.source.in_segments(self.options.predicted_frames)

    def _predicted(self, choice: Choice) -> Decided:
        """Return what follows from a choice of predicted motion, in its longer segments."""
        source = self._long_segments
        ath = one_map_each(source.seen)
        prelude = CodedPrelude(source, ath, choice.settings, predicted=True)
        only = Layer(prelude.plan, choice.settings, None)
        layers = Layers(prelude.rest_chunk, prelude.source_rest, prelude.plan, [only])
        return Decided(ath, choice, prelude, layers, source)

    def _estimated_bytes(self, decided: Decided) -> float:
        """Return the estimated bytes of a file, without its exact numbers, from typical segments: they are coded, and
        each counts for the number of frames of the file that it stands for.
        """
        total = float(decided.shared_bytes)
        for segment, frames in typical_segments(decided.source):
            coded = self._tried_segment(decided, segment)
            lossy = [data for (_, kind), data in coded.chunks.items() if kind != ct.EXACT]
            front = CHUNK_BYTES * len(lossy) + LEVEL_BYTES * len(coded.errors)
            total += (front + sum(map(len, lossy))) * frames / decided.source.frames_of(segment)
        return total

    def _layer_ratios(self, ath: Ath, bound: float, ladder: Sequence[float]) -> list[int]:
        """Return the ratios of as many of the last layers as there is room for behind the stages of the hierarchy. A
        still clip has one layer: a rest pose in layers takes up to two thirds more."""
        if self.source.still:
            return [1]
        ratios = layer_ratios(ladder, bound, self.seen.diagonal, step_factors(self.source, ladder, bound))
        return ratios[-min(MOST_LAYERS, MOST_LEVELS - ath.height - 1 - self.options.lossless) :]

    @property
    def _has_usual_ladder(self) -> bool:
        return self.options.ladder == LADDERS[DEFAULT_LADDER]

    def _layered(self, ath: Ath, choice: Choice, prelude: CodedPrelude) -> Decided:
        source = self.source.about(choice.reference)
        bound, ladder = choice.settings.bound, self.options.ladder if choice.ladder is None else choice.ladder
        ratios, factors = self._layer_ratios(ath, bound, ladder), step_factors(self.source, ladder, bound)
        layers = layers_of(source, prelude, choice, ratios, factors, hold_errors=not self._has_usual_ladder)
        return Decided(ath, choice, prelude, layers, source)

    def draft(self, decided: Decided) -> Draft:
        """Return a record of `decided` from which other processes can code the segments of the file without a
        search.
        """
        options = self.options
        if not decided.choice.predicted:
            options = dataclasses.replace(options, segment_frames=decided.source.segment_frames)
        if len(decided.layers.each) == 1:
            options = dataclasses.replace(options, ladder=())
        return Draft(
            decided.choice,
            self.seen,
            decided.segment_count,
            self.clip.placed.places,
            self.clip.branches,
            options,
            decided.fingerprint,
            decided.ath.thresholds,
        )

    def decided(self, draft: Draft) -> Decided:
        """Return what the maker of the draft decided. Raises ClipError if it is not the same here."""
        return self._holding(draft.choice.settings.bound)._decided(draft)

    def _decided(self, draft: Draft) -> Decided:
        """Return the decision that a draft records, made anew from its choice and thresholds. Raises ClipError if the
        hierarchy or the rest pose that follow here are not those of the draft.
        """
        decided = self._of_choice(draft.choice, draft.thresholds)
        if decided.fingerprint != draft.fingerprint:
            raise ClipError(
                "clip: got another rest pose or hierarchy than that of the draft, expected the same clip, "
                "on machines that calculate alike"
            )
        return decided

    def file_size(self, bound: float) -> float:
        """Return the bytes of the file at a bound; infinite if it cannot be kept."""
        try:
            return self._size(dataclasses.replace(self, report=silent).decide(bound))
        except BoundError:
            return math.inf

    def _size(self, decided: Decided) -> int:
        """Return the bytes of a file. Raises BoundError."""
        return FileAssembly(decided, self.options).size()
