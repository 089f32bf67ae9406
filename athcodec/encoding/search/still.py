"""Parts of a plant that stand still beside others that move: terrain, pots, fences. No setting of motion is tried on
them. A search sees the branches that move alone; what it chooses is then extended to all branches, and the rest pose of
what stands still is as coarse as in a file without motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from athcodec.encoding.clip.survey import Ath, Survey
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.learned_modes import components, learn
from athcodec.encoding.model.motion import LearnedModes, Plan
from athcodec.encoding.options.shape import detail_of, finer_than
from athcodec.encoding.search.progress import POSE, Work
from athcodec.encoding.search.sample import PlantSample
from athcodec.encoding.search.segment_samples import LEARNING_SEGMENTS
from athcodec.encoding.search.start import still_choice
from athcodec.encoding.segments.segment import (
    CodedPrelude,
    Source,
    analyse_finely,
    branch_records,
    poses_size,
    prelude_size,
)
from athcodec.encoding.segments.settings import OF_BRANCHES, Choice, Settings
from athcodec.motion.branches.still import LEAST_STILL
from athcodec.motion.sampling import spread
from athcodec.motion.thresholds import Thresholds
from athcodec.untyped import Keywords

STILL_SHARES = 1 / 64, 1 / 4  # Largest distances, in bounds, from their places of vertices that stand still, at most.
MUCH_MORE = 1.25  # Vertices that stand still within the second of them, over the first, from which on it is taken.


def still_branches(source: Source, bound: float) -> np.ndarray | None:
    """Return which branches belong to trees that stand still, (B,) bool; None: too few do, or all."""
    hierarchy, smallest = source.hierarchy, source.smallest_bound(bound)
    roots = np.flatnonzero(hierarchy.branch_parent < 0)
    branches = np.diff(np.append(roots, hierarchy.branch_count))
    few, many = (np.repeat(source.seen.largest_ways <= share * smallest, branches) for share in STILL_SHARES)
    still = more_still(few, many, hierarchy.stem_count)
    vertices = int(hierarchy.stem_count[still].sum())
    return still if LEAST_STILL <= vertices < hierarchy.vertex_count else None


def more_still(few: np.ndarray, many: np.ndarray, vertices: np.ndarray | int = 1) -> np.ndarray:
    """Return `many` if it is much more than `few`, as where a capture shakes, else `few`: a part that moves a little is
    better coded so than at the cost of all that stands. `few`, `many`: what stands still within each of STILL_SHARES,
    (K,) bool; `vertices`: how many each has."""
    return many if (many * vertices).sum() >= MUCH_MORE * (few * vertices).sum() else few


@dataclass(frozen=True)
class SplitSource:
    """A source of which some branches stand still, and what moves and what stands still as sources of their own."""

    source: Source
    ath: Ath
    bound: float  # In scene units.
    still: np.ndarray  # (B,) bool
    moving_source: Source
    still_source: Source

    @classmethod
    def of(cls, source: Source, ath: Ath, bound: float) -> SplitSource | None:
        """Divide a source into branches that move and branches that stand still within `bound`, and return both. Return
        None if nothing stands still or everything does, or if the moving part alone would have fewer stages.
        """
        if source.still or source.still_branches is not None or source.reference_is_exact:
            return None
        still = still_branches(source, bound)
        if still is None:
            return None
        moving, others = (part_of(source, ath, np.flatnonzero(some)) for some in (~still, still))
        if moving.seen.ath(ath.thresholds).height != ath.height:
            return None
        return cls(source, ath, bound, still, moving, _standing(others))

    @property
    def marked(self) -> Source:
        """The source, whose branches that stand still are not looked at when motion is coded."""
        return self.source.marking(self.still)

    def poses_beside(self, moving: Source, ath: Ath, settings: Settings, work: Work) -> float:
        """Return the bytes of the poses of all branches less those of the branches that move alone, for a file about
        the reference pose of `moving`, with the thresholds of `ath`, at the settings of what moves. They depend on the
        reference pose, because the source's rest pose is coded beside another one in the steps that both parts have."""
        split = self._with_thresholds(ath.thresholds)
        source = split.about(moving.reference)
        joined = [split._settings(settings, split._still_settings, may_be_coarser=flag) for flag in (True, False)]
        work.add(len(joined) * POSE * source.clip.vertex_count)
        return min(prelude_size(source, split.ath, each) for each in joined) - prelude_size(moving, ath, settings)

    def choice(self, chosen: Choice, thresholds: Thresholds) -> Choice:
        """Return a choice for the branches that move, made for an ATH of some thresholds, for all branches."""
        split, predicted = self._with_thresholds(thresholds), chosen.settings.predicted_trees
        if predicted is not None:
            trees = split._joined(predicted, np.zeros(self.still.sum(), bool))
            split = replace(split, ath=split.ath.as_one(trees))
        return split._choice(chosen)

    def _with_thresholds(self, thresholds: Thresholds) -> SplitSource:
        is_of_these = thresholds == self.ath.thresholds
        return self if is_of_these else replace(self, ath=self.source.seen.ath(thresholds))

    def _choice(self, chosen: Choice) -> Choice:
        """Extend a choice that was made for the branches that move to all branches, and return it."""
        stillness, source = self._still_settings, self.about(chosen.reference)
        may_be_coarser = not chosen.predicted
        settings = self._settings(chosen.settings, stillness, may_be_coarser)
        if chosen.settings.connected_rest != stillness.connected_rest:
            connected = [replace(settings, connected_rest=flag) for flag in (False, True)]
            settings = min(connected, key=lambda one: poses_size(source, self.ath, one))
        if may_be_coarser and source.has_source_rest:  # Details hold for that pose, too, which may be far coarser.
            alike = self._settings(chosen.settings, stillness, may_be_coarser=False)
            alike = replace(alike, connected_rest=settings.connected_rest)
            settings = min((settings, alike), key=lambda one: prelude_size(source, self.ath, one))
            may_be_coarser = settings is not alike
        first = self._settings(chosen.first_layer, stillness, may_be_coarser)
        first = replace(first, connected_rest=settings.connected_rest)
        return replace(
            chosen,
            settings=settings,
            first_layer=first,
            learned_modes=self._modes(chosen.learned_modes, source, settings),
            reference=self._reference(chosen.reference),
        )

    def about(self, reference: np.ndarray | None) -> Source:
        """Return the source about a reference pose of the branches that move."""
        return self.source.about(self._reference(reference))

    @cached_property
    def _still_settings(self) -> Settings:
        source = self.still_source
        ath = source.seen.ath(self.ath.thresholds)
        ways = self.source.seen.largest_ways[self.still[self.source.hierarchy.branch_parent < 0]]
        is_wide = (ways > STILL_SHARES[0] * self.source.smallest_bound(self.bound)).any()
        return still_choice(source, ath, (1 - STILL_SHARES[int(is_wide)]) * self.bound, 1).settings

    def _settings(self, moving: Settings, still: Settings, may_be_coarser: bool) -> Settings:
        """Join the settings of the branches that move and of those that stand still to settings of all branches.
        `may_be_coarser`: whether the rest pose of what stands still may be coded with a larger step than the rest.
        """
        details, step, slack = self._joined(moving.details, still.details), moving.rest_step, moving.rest_slack
        own_step = qz.single(step)
        is_coarser = still.rest_slack > 0 and slack == 0 and still.rest_step > step
        if is_coarser and may_be_coarser and not self.source.exact_rest and (still.details == 0).any():
            step, slack = still.rest_step, still.rest_slack
            of_step = int(detail_of(np.array([own_step]))[0])
            finer = finer_than(moving.details, own_step)
            details[~self.still] = np.where(finer > 0, finer, of_step)
        arrays: Keywords = {
            name: self._joined(getattr(moving, name), getattr(still, name)) for name in OF_BRANCHES if name != "details"
        }
        shape_of = None
        if moving.shape_of is not None or still.shape_of is not None:
            shape_of = self._joined(*(self._numbered(one, some) for one, some in self._shapes(moving, still)))
        predicted = moving.predicted_trees
        settings = replace(
            moving,
            **arrays,
            details=details,
            predicted_trees=None if predicted is None else self._joined(predicted, np.zeros(self.still.sum(), bool)),
            limit=self.source.limit(moving.bound) if isinstance(moving.limit, np.ndarray) else moving.limit,
            rest_step=step,
            rest_slack=slack,
            coarsest_rest_step=0.0,  # Then what stands still has one pose in all layers, and is never refined.
            shape_of=shape_of,
        )
        if moving.learned_pieces is None:
            return settings
        moves = self._moving_pieces(settings)
        pieces = np.zeros(len(moves), bool)
        pieces[moves] = moving.learned_pieces
        return replace(settings, learned_pieces=pieces)

    def _joined(self, moving: np.ndarray, still: np.ndarray) -> np.ndarray:
        """Return values for all branches, (B, ...), from those of branches that move and of those that stand still."""
        joined = np.empty(len(self.still), moving.dtype)
        joined[~self.still], joined[self.still] = moving, still
        return joined

    def _shapes(self, moving: Settings, still: Settings) -> list[tuple[np.ndarray | None, np.ndarray]]:
        """Return for both parts which branches copy others, and the numbers of the part's branches among all."""
        return [(moving.shape_of, np.flatnonzero(~self.still)), (still.shape_of, np.flatnonzero(self.still))]

    @staticmethod
    def _numbered(shape_of: np.ndarray | None, branches: np.ndarray) -> np.ndarray:
        if shape_of is None:
            return np.full(len(branches), -1, np.int32)
        return np.where(shape_of < 0, -1, branches[shape_of]).astype(np.int32)

    def _moving_pieces(self, settings: Settings) -> np.ndarray:
        hierarchy = self.source.hierarchy
        plan = Plan(branch_records(hierarchy, self.ath, settings), hierarchy.vertex_count, layer=settings.layer)
        return ~self.still[plan.pieces["branch"]]

    def _modes(self, modes: LearnedModes | None, source: Source, settings: Settings) -> LearnedModes | None:
        """Return the learned modes of the moving pieces, numbered among all pieces. Those that take the rounding of the
        rest pose back are learned anew, because both parts' poses are coded as one. `source`: all branches, about the
        reference pose."""
        if modes is None:
            return None
        if settings.learned_coded:
            plan, source = CodedPrelude(source, self.ath, settings).plan, source.marking(self.still)
            segments = (source.positions(segment) for segment in spread(len(source.segments), LEARNING_SEGMENTS))
            analysed = (analyse_finely(plan, settings, positions, bent=True) for positions in segments)
            return learn(plan, components(plan, analysed), settings.step, settings.learned_pieces)
        moves = self._moving_pieces(settings)
        counts = np.zeros(len(moves), modes.counts.dtype)
        counts[moves] = modes.counts
        return replace(modes, counts=counts, first=(np.cumsum(counts) - counts).astype(modes.first.dtype))

    def _reference(self, reference: np.ndarray | None) -> np.ndarray | None:
        """Return a reference pose for all branches from one for those that move."""
        if reference is None:
            return self.source.reference
        whole = self.source.rest.copy()
        moves = np.repeat(~self.still, self.source.hierarchy.stem_count)
        whole[moves] = reference + (self.moving_source.origin - self.source.origin)
        return whole


def part_of(source: Source, ath: Ath, branches: np.ndarray) -> Source:
    """Return a source that consists of some trees of `source` alone. `branches`: the numbers of their branches,
    ascending.
    """
    sample = PlantSample(source, ath, branches, with_faces=True)
    part = replace(
        sample.source,
        seen=_seen(source.seen, sample),
        shapes=(source.details[branches], source.keeps_shape[branches]),
        reference=None if source.reference is None else sample.source.reference + source.origin - sample.source.origin,
        whole=None,
    )
    part.segments, part.clip_range_segments = source.segments, source.clip_range_segments
    return part


def _seen(seen: Survey, sample: PlantSample) -> Survey:
    """Return the survey `seen` reduced to the branches of a sample, but with the bounding box of the whole plant."""
    chosen = np.isin(seen.branches, sample.branches)
    roots = np.flatnonzero(seen.hierarchy.branch_parent < 0)
    return replace(
        seen,
        hierarchy=sample.source.hierarchy,
        rest=seen.rest[sample.vertices],
        branches=np.searchsorted(sample.branches, seen.branches[chosen]),
        largest_gads=seen.largest_gads[:, chosen],
        largest_distance=seen.largest_distance[chosen],
        most_beyond_xi=None if seen.most_beyond_xi is None else seen.most_beyond_xi[chosen],
        largest_ways=seen.largest_ways[np.isin(roots, sample.branches)],
    )


def _standing(source: Source) -> Source:
    """Return a source of one frame that shows the rest pose of another."""
    seen = replace(source.seen, frame_count=1, steps=np.array([np.inf]))
    return replace(source, clip=source.clip.standing(), seen=seen, held=None)
