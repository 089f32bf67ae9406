"""The order in which the choices about a file are made, so that it becomes the smallest.

Each choice (choices/) is made by trials on a sample of the segments, and of the plant if that is large (trials.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search import order
from athcodec.encoding.search.choices import forms, learned_bases, learned_pieces, rotations
from athcodec.encoding.search.choices.node_steps import best_node_steps, cost_with_maps, inner_nodes, work_of_steps
from athcodec.encoding.search.choices.reference import mean_pose, turned_pose
from athcodec.encoding.search.choices.rest import best_slack, with_slack
from athcodec.encoding.search.choices.rigid import best_freedom, calm_parts
from athcodec.encoding.search.choices.steps import best_stage_steps, best_steps, finer_steps, walked
from athcodec.encoding.search.hopeless import Hopeless, OnBranches, OnPieces
from athcodec.encoding.search.progress import ANALYSIS, LEARNING, POSE, START, TRIAL, Work, expected_trials
from athcodec.encoding.search.sample import ExtrapolationFactors, is_small, sample_plant
from athcodec.encoding.search.segment_samples import samples_of, spread_samples
from athcodec.encoding.search.start import first_settings
from athcodec.encoding.search.trials import Trials, distinct
from athcodec.encoding.segments.segment import CodedPrelude, Source, branch_records, prelude_size
from athcodec.encoding.segments.settings import OF_SAMPLE, Choice, Settings
from athcodec.options import MIN_SEGMENT

REFINEMENTS_MAX_GAIN = 1.05  # Largest gain of settings that suit refinements better than the layer that trials code.
SURE_SAVING = 0.05  # Estimated share of all bits from which on learned modes make the file of any plant smaller.
NEAREST = 3  # Steps are walked for so many other choices.
NEAR_RATIO = 1.1  # Bytes of these, over the least.
STEP_TRIALS = 12  # Trials of steps for which choices leave work.
FIRST_LAYER_TRIALS = 6  # Trials of the first layer for which choices leave work.
WAVES_SHARE = 0.8  # Share of the bytes of motion in waves, at first settings, that a search usually comes down to.
BASES_SHARE = 0.85  # The same for time bases, about which less is left to find.
HOPELESS_TURN = 1.15  # Bytes in waves with roots that turn, over those without, above which bases do not help.
WORTHY_TURN = 0.95  # The same up to which trials of branches look at roots that turn.
OWN_BASES_SHARE = 0.8  # Share of the bytes at which time bases of each stage are taken, which layers cannot have.
FIRST_POSE_TRIALS = 6  # Trials that show whether another reference pose is better at once.
CLOSE_POSES = 1.03  # Bytes about one reference pose, over those about another, up to which all choices are made again.
MID_TURNS = 2  # Mean poses, each about the one before: the first is not in the middle of a full turn.
FAR_TURN = 0.9  # Bytes about a mean pose, over those before, up to which another one may be better still.
POSE_TRIALS = 18  # Trials that another reference pose takes, beside those of steps that it has to leave.

Choose = Callable[[Settings, Trials], Settings]
PosesBeside = Callable[[Source, Ath, Settings, Work], float]


def settled(settings: Settings, trials: Trials) -> Settings:
    """Return the settings after single choices were made again at the steps found so far, each followed by a search for
    its own best steps, until none of them saves bytes. Earlier choices were made at other steps, and a wrong one among
    them lets sizes jump from bound to bound.
    """
    saving = settings.learned_saving
    while True:
        plain = replace(settings, learned_pieces=None)
        turned = rotations.candidates(plain)
        in_forms = [candidate for start in (plain, turned[0]) for candidate in forms.candidates(start, trials)]
        starts = [plain, *_nearest(plain, turned + in_forms, trials)]
        learned = [candidate for start in starts for candidate in learned_pieces.candidates(start, trials)]
        in_time = [settings.in_waves(), *learned_bases.candidates(settings, trials)]
        others = _nearest(settings, starts + learned + in_time + rotations.turned_over(settings, trials), trials)
        best = trials.cheapest([settings, *(walked(other, trials) for other in others)])
        if best is settings:  # All of a sampled plant goes by the saving chosen before.
            return replace(settings, learned_saving=saving)
        settings = best


def _nearest(settings: Settings, others: list[Settings], trials: Trials) -> list[Settings]:
    """Return the few of the other settings that cost least, and hardly more than the cheapest of all."""
    others = [other for other in distinct(others) if other.key != settings.key]
    costs = trials.costs(others)
    most = NEAR_RATIO * min([trials.cost(settings), *costs])
    return [others[i] for i in np.argsort(costs, kind="stable")[:NEAREST] if costs[i] <= most]


def _learned_cost(trials: Trials) -> float:
    """Return the bytes of a file at first settings, or with learned time bases or modes if it is smaller with them."""
    start = trials.start
    with_bases = trials.cheapest([start, *learned_bases.candidates(start, trials)])
    return min(trials.costs([with_bases, *learned_pieces.candidates(with_bases, trials)]))


CHOICES: dict[Choose, str] = {  # What progress and summaries call a choice.
    best_stage_steps: "steps of stages",
    forms.best_forms: "forms",
    forms.best_forms_again: "forms",
    rotations.still_if_smaller: "branches whose bending turns nothing",
    rotations.best_rotations: "rotations",
    rotations.fast_rotations: "rotations",
    learned_bases.best_bases: "time bases",
    learned_bases.best_waves: "periodic waves",
    learned_bases.waves_if_smaller: "time bases",
    learned_pieces.best_pieces: "learned modes",
    learned_pieces.best_pieces_in_any_basis: "learned modes",
    best_steps: "steps",
    learned_pieces.learned_about_other_pose: "learned modes",
    finer_steps: "finer steps",
    calm_parts: "calm parts",
    best_slack: "precision of the rest pose",
    best_node_steps: "maps of coarse stages",
    settled: "all choices again",
}
BY_NAME = {choose.__name__: choose for choose in CHOICES}


@dataclass(eq=False)
class Search:
    """Finds the settings of a file, in the order in which its choices depend on each other.

    The order is its only job: how a choice is made stands in choices/, how its bytes are counted in trials.py. `ratios`
    are those of the steps of the file's layers to that of the last, descending to 1. `beside`: returns the bytes that
    poses of what stands still beside the plant add to the file of a source about some reference pose, with an ATH and
    settings, and counts its work; None if nothing does.
    """

    trials: Trials
    effort: str
    ratios: Sequence[int] = (1,)
    beside: PosesBeside | None = None

    def __post_init__(self) -> None:
        source, keeps_shape = self.trials.source, self.trials.start.turn_step > 0  # A few bytes less cost the shape.
        self._forms: np.ndarray | None = None
        self.makes_all_again = is_small(source.clip.vertex_count, source.segments, self.effort) and not keeps_shape

    @classmethod
    def of(
        cls,
        source: Source,
        ath: Ath,
        bound: float,
        effort: str,
        work: Work,
        jobs: int | None = None,
        *,
        ratios: Sequence[int] = (1,),
        hopeless: Hopeless | None = None,
        beside: PosesBeside | None = None,
    ) -> Search:
        """Return the search for settings of a whole plant, at `bound` and within the allowed `work`. `jobs`: threads
        that try settings at a time; `ratios`: the step of each layer over that of the last; `hopeless`: what trials on
        other branches have shown to be so, or None; `beside`: as in `Search`.
        """
        samples = samples_of(source)
        start = first_settings(source, ath, bound, samples, ratios)
        everything = ExtrapolationFactors.everything(start.stages)
        work.add(START * source.clip.vertex_count)
        trials = Trials(source, ath, start, samples, everything, jobs, work)
        search = cls(trials, effort, ratios, beside)
        search = search._with_freedom(OnPieces() if hopeless is None else hopeless.on_pieces)
        if any(start.rotation_step_factors):
            search = search._best_turn() if hopeless is None else search._best_turn_of_trial(hopeless.on_branches)
        elif rotations.rigid_roots_turn(source, samples, start.rigid):
            search = search._in_mid_turn()
        trial = TRIAL + (search.of_sample or search).trials.work_of(ANALYSIS)
        expected = work.done + trial * expected_trials(effort, search.trials.is_layered, search.makes_all_again)
        work.expected = work.expected or min(expected, work.allowed)
        return search

    def shorter_segments(self) -> list[tuple[int, float]]:
        """Return pairs of a number of frames and the estimated bytes at first settings, for shorter segments that may
        make the file smaller. Segments are halved as long as that makes motion in waves smaller, since a jump is seen
        in all waves of its segment. The list ends where learned time bases, too, make the file smallest, and with the
        power of two next to that.
        """
        trials = (self.of_sample or self).trials
        lengths = [max(stop - start for start, stop in trials.source.segments)]
        tried = [trials.in_segments(trials.source, spread_samples(trials.source))]
        while (length := -(-lengths[-1] // 2)) >= MIN_SEGMENT:
            halves = trials.source.in_segments(length)
            if halves.coded_frames < MIN_SEGMENT * len(halves.segments):  # Most frames are held.
                break
            other = trials.in_segments(halves, spread_samples(halves))
            if other.cost(other.start) >= tried[-1].cost(tried[-1].start):
                break
            lengths.append(length)
            tried.append(other)
        if len(tried) == 1:
            return []
        costs = [_learned_cost(one) for one in tried]
        best = int(np.argmin(costs))
        shorter = list(zip(lengths, costs))[1 : best + 1]
        usual = 1 << round(math.log2(lengths[best]))
        return [*shorter, (usual, costs[best])] if shorter and usual != lengths[best] else shorter

    def stages_need_own_bases(self) -> bool:
        """Return whether a file is much smaller if each stage learns a time basis of its own, as only a single layer
        can."""
        trials = (self.of_sample or self).trials
        start, in_bases = trials.start, trials.start.in_learned_bases()
        if not trials.is_layered or trials.stages <= 2 or trials.without(Feature.TIME_BASES):
            return False
        others = start, replace(in_bases, common_basis=True)
        return all(trials.costs([in_bases])[0] <= OWN_BASES_SHARE * trials.costs([other])[0] for other in others)

    def keep_work_of_maps(self) -> None:
        """Take the work of choosing the maps of coarse stages from what is allowed: that choice comes last and is
        always made."""
        self.trials.work.allowed -= work_of_steps((self.of_sample or self).trials)

    def first_cost(self) -> float:
        """Return the bytes of a whole file at the settings that the search starts with, or with time bases."""
        search = self.of_sample or self
        return search.trials.cost(search.at_first_move)

    @property
    def cost_of_best(self) -> float:
        """Bytes of a file of one layer."""
        search = self.of_sample or self
        return search.trials.cost(search.best)

    def tried(self, frames_ratio: float) -> float:
        """Return about the bytes of a file of `frames_ratio` times the frames, after the choices that save most were
        made."""
        search = self.of_sample or self
        return search._cost_of_frames(search.at_best_step, frames_ratio)

    def expected(self, frames_ratio: float, hopeless: Hopeless) -> float:
        """Return about the bytes of a file of so many times the frames, by what is expected of its bytes in waves and
        in time bases, whichever is less. What is compared so takes the same few trials, whatever work is left.
        `hopeless`: what these trials leave out."""
        search = self.of_sample or self
        moves = rotations.typical_moves(search.trials.start, search.trials, hopeless)
        shares = [BASES_SHARE if any(move.learned_bases) else WAVES_SHARE for move in moves]
        sizes = [search._cost_of_frames(move, share * frames_ratio) for move, share in zip(moves, shares)]
        size, move = min(zip(sizes, moves), key=lambda expected: expected[0])
        if search is self:
            return size
        trials = self.trials  # A sample's poses tell less of the whole plant's than its motion does.
        trials.work.add(POSE * trials.source.clip.vertex_count)
        return size - search.trials.prelude_bytes(move) + prelude_size(trials.source, trials.ath, trials.start)

    def _cost_of_frames(self, settings: Settings, frames_ratio: float) -> float:
        return self.trials.cost(settings) + (frames_ratio - 1) * self.trials.stage_costs(settings).sum()

    def decide(self) -> tuple[list[Choice], CodedPrelude]:
        """Search, and return two things: the settings to choose from, best first, and the hierarchy and poses as coded
        with them.
        """
        of_first_layer = FIRST_LAYER_TRIALS * self.trials.is_layered
        with self.trials.work.trying("reference pose", (self.of_sample or self)._share_beside(of_first_layer)):
            search = self.about_best_reference()
            self.cost = search.cost_of_best
        trials, (first_layer, candidates) = search.trials, search.candidates()
        prelude = trials.prelude(candidates[0])
        choices = [
            Choice(settings, first_layer, trials.learned_modes(prelude.plan, settings), trials.source.reference)
            for settings in candidates
        ]
        trials.forget_modes()
        return choices, prelude

    def candidates(self) -> tuple[Settings, list[Settings]]:
        """Return two things: the settings of the first layer, and the settings to choose from for refinements, which
        are the best settings alone if the file has a single layer. Those of a large plant come from a search on a
        sample of it.
        """
        if self.of_sample:
            first, candidates = self._candidates_of_sample(self.of_sample)
        else:
            candidates = list(self.refinements())  # Refinements come first: components are of the step that asks first.
            first = self.first_layer()
        self.trials.work.finish()
        return first, candidates

    @cached_property
    def at_first_move(self) -> Settings:
        """The settings that the search starts with, or with time bases where these are far smaller."""
        if self.effort == "fast":
            return self.trials.start
        return rotations.still_if_smaller(self.trials.start, self.trials)

    @cached_property
    def at_first_step(self) -> Settings:
        """Return settings of a file of one layer, with time bases, rotations and modes chosen at the step that the
        search starts with.
        """
        if self.effort == "fast":
            fast = [best_stage_steps, rotations.fast_rotations, learned_bases.best_waves]
            return self._after(fast, self.trials.start)
        choices = [BY_NAME[name] for name in order.BEFORE_STEPS]
        last = [learned_pieces.best_pieces_in_any_basis, learned_bases.best_waves]
        with self.trials.work.trying("steps", self._share_beside(STEP_TRIALS)):
            return self._after([best_stage_steps, *choices, *last], self.trials.start)

    @cached_property
    def at_best_step(self) -> Settings:
        """Bases, rotations and modes of a file of one layer, at the best steps."""
        if self.effort == "fast":
            return self.at_first_step
        return self._after([best_steps, learned_pieces.learned_about_other_pose], self.at_first_step)

    @cached_property
    def best(self) -> Settings:
        """Return the best settings found for a file of one layer."""
        choices = [] if self.effort == "fast" else [BY_NAME[name] for name in order.AFTER_STEPS]
        if not self.makes_all_again:
            left_out = [settled, finer_steps] if self.trials.is_layered and self.effort != "best" else [settled]
            choices = [choose for choose in choices if choose not in left_out]
        if not self.trials.is_layered:  # The first of several layers has maps, and chooses their steps itself.
            choices = [*choices, best_node_steps]
        settings = self.at_best_step
        with self.trials.work.trying("first layer", self._share_beside(FIRST_LAYER_TRIALS * self.trials.is_layered)):
            return self._after(choices, settings)

    def _share_beside(self, trials: int) -> float:
        """Return the share of the work that is left that leaves room for so many more trials, but at least half."""
        left = self.trials.work.left
        return max(0.5, 1 - trials * self.trials.work_of_trial / left) if left > 0 else 1.0

    def _after(self, choices: Sequence[Choose], settings: Settings) -> Settings:
        for choose in choices:
            with self.trials.work.trying(CHOICES[choose]):
                settings = choose(settings, self.trials)
        return settings

    def first_layer(self) -> Settings:
        """Return the settings of the first layer: the best ones if that is the only layer."""
        if not self.trials.is_layered:
            return self.best
        best = rotations.with_fine_roots(self.best)
        turns = any(best.rotation_step_factors) and not best.roots_turn  # Coarser steps turn no more.
        choices: list[Choose] = [rotations.best_rotations] * turns + [learned_pieces.best_pieces]
        first = replace(best.coarser(self.ratios[0]), learned_pieces=None)  # Layers share a learned time basis.
        return self._after([*(choices if self.effort != "fast" else []), best_node_steps], first)

    def refinements(self) -> Iterator[Settings]:
        """Yield settings that may suit the layers after the first, each of which has one stream: with rotations and
        without, the smaller one by trials first, leaving out what these show to be much larger. Without rotations or
        with a single layer, the best settings are yielded.
        """
        settings, trials = self.best, self.trials
        if not trials.is_layered or not any(settings.rotation_step_factors):
            yield settings
            if trials.is_layered and self.makes_all_again and settings.learned_pieces is not None:
                yield replace(settings, learned_pieces=None)
            return
        factors = settings.rotation_step_factors
        main = factors[trials.prelude(settings).plan.main_stage]
        all_turn = main and not settings.roots_turn
        turned = settings.with_rotations(main) if all_turn else settings.with_turning_roots(rotations.FINEST)
        candidates = [turned, settings.with_rotations(0)]
        if self.effort != "fast":
            candidates = [learned_pieces.best_pieces(candidate, trials) for candidate in candidates]
            most = REFINEMENTS_MAX_GAIN * min(map(trials.cost, candidates))
            candidates = [candidate for candidate in candidates if trials.cost(candidate) <= most]
        yield from sorted(candidates, key=trials.cost)

    def _with_freedom(self, known: OnPieces) -> Search:
        """Return this search, whose rigid parts move away from what they hang on if that is known to be smaller; if it
        is not known, note it. Leaves that hinge on twigs may be most of a plant, and take a third less if they are
        loose, so this is decided before anything is compared."""
        trials, start = self.trials, self.trials.start
        if self.effort == "fast" or not (start.rigid > start.layer).any():
            return self
        if known.free_rigid is None:
            search = self.of_sample or self
            with trials.work.trying("freedom of rigid parts"):
                known.free_rigid = best_freedom(search.trials.start, search.trials).free_rigid
        if not known.free_rigid:
            return self
        return self._starting_at(replace(start, free_rigid=True))

    def _best_turn(self, most: float = HOPELESS_TURN) -> Search:
        """Return this search, whose roots turn, or one without rotations if that begins with a smaller file: roots
        that sway far look as if they turned, and shapes that turn sum a few, too. `most`: bytes with roots that turn,
        over those without, both in waves, above which no more is tried."""
        turned, plain = self._in_mid_turn(), self._without_turns()
        if turned._cost_at_start > most * plain._cost_at_start:
            return plain
        return min(plain, turned, key=Search.first_cost)

    def _best_turn_of_trial(self, known: OnBranches) -> Search:
        """Return the same, from fewer trials, and note if roots that turn are hopeless on these branches."""
        if known.turning:
            return self._without_turns()
        best = self._best_turn(most=WORTHY_TURN)
        known.turning = not any(best.trials.start.rotation_step_factors)
        return best

    def _without_turns(self) -> Search:
        start = self.trials.start
        return self._starting_at(replace(start, rotation_step_factors=(0,) * len(start.rotation_step_factors)))

    def _starting_at(self, start: Settings) -> Search:
        """Return a search that starts with other settings, and has made no choices yet."""
        return replace(self, trials=replace(self.trials, start=start))

    @property
    def _cost_at_start(self) -> float:
        trials = (self.of_sample or self).trials
        return trials.cost(trials.start)

    def _in_mid_turn(self) -> Search:
        """Return the search about a pose in the middle of the turns of what turns as a whole, if that is cheaper: a
        rotation by a full turn has no numbers, and jumps before."""
        if not self._may_have_other_pose:
            return self
        best = self
        for _ in range(MID_TURNS):
            self.trials.work.add(LEARNING * self.trials.source.clip.vertex_count * self.trials.frames)
            before, other = best._cost_at_start, best.about_mean_pose()
            if other._cost_at_start < before:
                best = other
            if other._cost_at_start > FAR_TURN * before:
                break
        return best

    @property
    def _may_have_other_pose(self) -> bool:
        return not (self.effort == "fast" or self.trials.source.host_rest or self.trials.without(Feature.MEAN_POSE))

    @property
    def _may_have_mean_pose(self) -> bool:  # The mean of what turns is smaller than what turns.
        return self._may_have_other_pose and not self.trials.source.keeps_shape.any()

    def about_best_reference(self) -> Search:
        """Return this search, or one about the mean pose of the motion if that makes a smaller file than the rest pose
        does. The mean pose is taken at once if its file and its motion are smaller at first moves. Else both are
        compared by what was chosen about the rest pose or, in small clips, by separate searches up to their steps, and
        beside what stands still to their ends if they are close.
        """
        if not self._may_have_mean_pose:
            return self
        if not self._leaves_steps(POSE_TRIALS if self.makes_all_again else FIRST_POSE_TRIALS):
            return self
        self.trials.work.add(LEARNING * self.trials.source.clip.vertex_count * self.trials.frames)
        other = self.about_mean_pose()
        about_rest, about_mean = self.of_sample or self, other.of_sample or other
        if not self.makes_all_again:
            at_first = ((one.trials, one.at_first_move) for one in (about_rest, about_mean))
            of_rest, of_mean = (np.array([one.cost(first), one.stage_costs(first).sum()]) for one, first in at_first)
            if (of_rest > of_mean).all() and about_rest.beside is None:
                return other
            if not self._leaves_steps(POSE_TRIALS):
                return self
        if not self.makes_all_again:
            about_mean.at_first_step = about_mean._like(about_rest, about_rest.at_first_step)
            rest, mean = (one._cost_of(one.at_first_step) for one in (about_rest, about_mean))
            return other if mean < rest else self
        rest, mean = (one._cost_of(one.at_best_step) for one in (about_rest, about_mean))
        # Poses of what stands still may be most of the file, and the choices that follow decide then. Of other clips
        # none gets smaller by comparing after them.
        if self.beside is not None and max(rest, mean) < CLOSE_POSES * min(rest, mean):
            rest, mean = (one._cost_of(one.best) for one in (about_rest, about_mean))
        return other if mean < rest else self

    def _leaves_steps(self, trials: int) -> bool:
        """Return whether so many trials about another reference pose leave work for those of steps, and of maps."""
        work, tried = self.trials.work, (self.of_sample or self).trials
        maps = 0.0 if tried.is_layered else 2 * work_of_steps(tried)
        with work.trying("mean pose"):
            return work.fits((trials + STEP_TRIALS) * tried.work_of_trial + maps)

    def _cost_of(self, settings: Settings) -> float:
        """Return the bytes of this search's file, by which it is compared with one about another reference pose."""
        trials = self.trials
        beside = 0.0 if self.beside is None else self.beside(trials.source, trials.ath, settings, trials.work)
        return cost_with_maps(settings, trials) + beside

    def about_mean_pose(self) -> Search:
        """Return a search whose motion is coded about its mean pose or, where faces are to keep their shape, about the
        rest pose turned as the mean pose is. It has made no choices yet."""
        trials = self.trials
        pose = mean_pose(trials.source, trials.ath, trials.start)
        if trials.source.keeps_shape.any():
            pose = turned_pose(trials.source.rest, pose, trials.source.hierarchy)
        source = trials.source.about(pose)
        ath = replace(trials.ath, rest=source.rest + source.origin)
        start = first_settings(source, ath, trials.start.bound, trials.samples, self.ratios)
        start = replace(start, free_rigid=trials.start.free_rigid)
        if not any(trials.start.rotation_step_factors):  # What sways far and does not turn sways about its mean, too.
            start = replace(start, rotation_step_factors=trials.start.rotation_step_factors)
        return replace(self, trials=replace(trials, source=source, ath=ath, start=start))

    def _like(self, other: Search, settings: Settings) -> Settings:
        """Return settings about this search's reference pose that follow the choices in `settings`, which the search
        `other` made about its own reference pose.
        """
        trials, start = self.trials, self.trials.start
        like = replace(
            settings,
            forms=forms.forms_like(settings.forms, other.trials.source, trials),
            rest_step=start.rest_step,
            coarsest_rest_step=start.coarsest_rest_step,
            lags=start.lags,
            connected_rest=start.connected_rest,
            shape_of=start.shape_of,
            learned_pieces=None,
            learned_coded=False,
        )
        if settings.learned_pieces is None or settings.learned_saving is None:
            return like
        [(pieces, _)] = learned_pieces.pieces_that_save(like, trials, [settings.learned_saving])
        return learned_pieces.learned_anew(replace(like, learned_pieces=pieces), trials)

    @cached_property
    def of_sample(self) -> Search | None:
        """Return a search on a sample of the plant, or None if the plant is small enough to be searched whole."""
        trials, start = self.trials, self.trials.start
        sample = sample_plant(trials.source, trials.ath, self.effort)
        if sample is None:
            return None
        some = sample.like(replace(start, shape_of=None))
        extrapolation = ExtrapolationFactors.of(
            branch_records(trials.source.hierarchy, trials.ath, start),
            branch_records(sample.source.hierarchy, sample.ath, some),
        )
        samples = [segment.of_plant(sample) for segment in trials.samples]
        of_sample = Trials(sample.source, sample.ath, some, samples, extrapolation, trials.jobs, trials.work)
        return Search(of_sample, self.effort, self.ratios)

    def _candidates_of_sample(self, sample: Search) -> tuple[Settings, list[Settings]]:
        """Return the candidates of a sample for all of the plant. Pieces with learned modes are chosen in all of it."""
        start = self.trials.start
        candidates = [self._from_sample(sample, settings, start) for settings in sample.refinements()]
        if not self.trials.is_layered:
            return candidates[0], candidates
        return self._from_sample(sample, sample.first_layer(), start.coarser(self.ratios[0])), candidates

    def _from_sample(self, sample: Search, chosen: Settings, start: Settings) -> Settings:
        """Return settings for the whole plant that follow the settings `chosen` by the search `sample` on a part of it.
        `start`: the source of those settings that no sample decides.
        """
        trials, of_sample = self.trials, sample.trials
        inner, all_inner = (inner_nodes(some.source, some.ath, some.stages) for some in (of_sample, trials))
        fewer = np.sqrt(of_sample.extrapolation.vertices * inner / np.maximum(all_inner, 1))
        settings = replace(
            start,
            **{name: getattr(chosen, name) for name in OF_SAMPLE},
            forms=forms.forms_like(chosen.forms, of_sample.source, trials),
            node_steps=chosen.node_steps * np.where(inner > 0, fewer, 1.0),
        )
        if self._forms is None:  # The forms of all of the plant are chosen once.
            self._forms = settings.forms if self.effort == "fast" else forms.best_of_plant(settings, trials)
        settings = replace(settings, forms=self._forms)
        if chosen.rest_slack > 0:
            settings = with_slack(trials.source, trials.ath, settings, chosen.rest_slack)
        if chosen.learned_saving is None:
            return settings
        [(pieces, saved)] = learned_pieces.pieces_that_save(settings, trials, [chosen.learned_saving])
        learned = replace(settings, learned_pieces=pieces)
        if saved >= SURE_SAVING or not trials.work.fits(2 * trials.work_of_trial):
            return learned
        return trials.cheapest([learned, settings])  # A sample errs by more than some savings.
