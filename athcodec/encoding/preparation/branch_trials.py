"""Which of the branches that motion/branches proposes make the smallest file; each is tried on a few frames."""

from __future__ import annotations

import dataclasses
import math
from itertools import chain

import numpy as np

from athcodec.encoding.clip.coded_clip import CodedClip, stored_polygons
from athcodec.encoding.clip.places import PlacedClip
from athcodec.encoding.clip.survey import survey
from athcodec.encoding.decisions import FileDecisions
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.search.hopeless import Hopeless
from athcodec.encoding.search.progress import ANALYSIS, FINDING, SURVEY, TRIAL, Work
from athcodec.encoding.search.segment_samples import TRIAL_FRAMES
from athcodec.encoding.search.still import STILL_SHARES, more_still
from athcodec.encoding.segments.segment import Source
from athcodec.errors import BoundError
from athcodec.files.threads import SERIAL
from athcodec.motion.branches.divided import clip_among, joined, plants_apart
from athcodec.motion.branches.finding import candidates, named_labels
from athcodec.motion.branches.result import Found, hierarchy_on, order_of, with_branches
from athcodec.motion.branches.still import still_parts
from athcodec.motion.clip import MotionClip, stands_still
from athcodec.motion.polygons import POLYGON_ARRAYS
from athcodec.options import DEFAULT_SEGMENT

FILLED = 0.8  # Share of a target size that a file fills at the bound at which branches are compared.
TRIAL_SHARE = 0.2  # Largest share of the work left before the first trial that each takes: sizes are of equal searches.
ALIKE = 1.05  # Bytes, over the fewest, up to which branches of lower order are better: trials err by that.
SAME = 1.02  # The same up to which fewer branches of the same order are better.
PATCHES = 1.4  # Bytes in whole files, over those in trials, of patches of a mesh that has pieces.
PLANTS_SHARE = 0.35  # Largest share of the work for branches of all plants, where they are sought for each, too.
LEAST_TRIALS = 8  # Trials of settings that tell which branches are better.


def best_branches(
    clip: MotionClip, option: BoundOption, work: Work, options: EncodingOptions | None = None, is_compared: bool = False
) -> tuple[Found, float]:
    """Find the branches on which a clip makes the smallest file. Return them, and about the bytes of that file, which
    may be infinite unless `is_compared` is true. Unless the source names branches, those of what stands still are found
    apart from the others, without trials on frames. `options`: those of the file, or None for a file of one layer.
    """
    options = EncodingOptions() if options is None else options
    if clip.skin is not None or named_labels(clip) is not None:
        return _best_candidate(clip, option, work, options, is_compared)
    least = option.least(clip)
    still = None if options.host_rest else _still(clip, least)
    if still is None:
        return _best_of_plants(clip, option, work, options, is_compared)
    if least > 0:  # The bound of the parts is that of the whole.
        option = BoundOption(max_error=least)
    moving, standing = (clip_among(clip, np.flatnonzero(some), some is still) for some in (~still, still))
    branches, size = _best_of_plants(moving, option, work, options, is_compared)
    others, still_size = _best_candidate(standing, option, Work(), options, is_compared)
    return joined(clip, still.astype(int), [branches, others]), size + (still_size if is_compared else 0.0)


def _best_of_plants(
    clip: MotionClip, option: BoundOption, work: Work, options: EncodingOptions, is_compared: bool
) -> tuple[Found, float]:
    """Return the best branches, and about the bytes of their file, as `_best_candidate` does, or those that were found
    for each plant by itself where points that nothing joins are of plants that stand apart, and these are smaller:
    what suits one plant may suit no other.
    """
    bound, finding = option.least(clip), FINDING * clip.vertex_count
    may_differ = bound > 0 and not stands_still(clip) and work.fits(2 * finding)
    plant = plants_apart(clip) if may_differ else None
    if plant is None:
        return _best_candidate(clip, option, work, options, is_compared)
    with work.trying("branches", PLANTS_SHARE):
        trial = Trial(clip, option, options, work)
        best, least = _best_candidate(clip, option, work, options, is_compared=True, trial=trial)
    allowed, found, option = work.left - trial.least_work, [], BoundOption(max_error=bound)
    for number in range(plant.max() + 1):
        vertices = np.flatnonzero(plant == number)
        own = Work(allowed * (len(vertices) / len(plant) + 1 / (plant.max() + 1)) / 2)
        found.append(_best_candidate(clip_among(clip, vertices), option, own, options, is_compared=False)[0])
        work.add(own.done)
    apart = joined(clip, plant, found)
    size = trial.size(apart)[0]
    return (apart, size) if size < least else (best, least)


def _still(clip: MotionClip, least: float) -> np.ndarray | None:
    """Return which vertices are of parts that stand still, (N,) bool, within a part of the least bound; None: none."""
    many = still_parts(clip, STILL_SHARES[1] * least)
    if many is None:
        return None
    few = still_parts(clip, STILL_SHARES[0] * least)
    return many if few is None else more_still(few, many)


def _best_candidate(
    clip: MotionClip,
    option: BoundOption,
    work: Work,
    options: EncodingOptions,
    is_compared: bool,
    trial: Trial | None = None,
) -> tuple[Found, float]:
    """Try ways to divide a clip into branches on a few frames, as many as the work allows. Return the branches that
    make the smallest file, and about its bytes, which are infinite if there was nothing to compare and `is_compared` is
    false.

    Of candidates of about the same size the one of lowest order wins, but one of roots alone, which has no stages,
    comes last. Predicted motion hardly depends on branches: trials end if the first two candidates have it. If the
    same branches are smaller with vertices in the order of the source, all that follow are tried in it, and the best
    ones are unless that order was worse.
    """
    by_points = work.fits(FINDING * clip.vertex_count)
    proposals, trial = candidates(clip, by_points), trial or Trial(clip, option, options, work)
    best, least, predicted = next(proposals), math.inf, 0
    tried: list[tuple[float, Found]] = []
    finding = FINDING * clip.vertex_count if by_points and best.method == "motion" and not stands_still(clip) else 0.0
    work.add(finding)
    second = next(proposals, None) if work.fits(finding + 2 * trial.least_work) else None
    if second is None:
        return best, trial.size(best)[0] if is_compared else least
    in_order: bool | None = None  # Whether vertices are better in the order of the source, which costs no bytes.
    for number, branches in enumerate(chain([best, second], proposals), start=1):
        before = work.done
        branches = dataclasses.replace(branches, stem_index=None) if in_order else branches
        size, is_predicted = trial.size(branches)
        if best.method == "components" and branches.method == "motion":
            size *= PATCHES
        next_trial = max(trial.least_work, work.done - before)  # Settings cost about as much on other branches.
        predicted += is_predicted
        ordered = [other for other, one in tried if _differ_in_order(one, branches)]
        if ordered and not in_order:
            in_order = size < min(ordered)
        tried.append((size, branches))
        if number > 1:
            if predicted == number or not work.fits(finding + next_trial):
                break
            work.add(finding)
    least, best = _best_of(tried)
    if best.stem_index is None or in_order is False or not work.fits(next_trial):
        return best, least
    unordered = dataclasses.replace(best, stem_index=None)
    size = trial.size(unordered)[0]
    return (unordered, size) if size < least else (best, least)


def _differ_in_order(first: Found, second: Found) -> bool:
    """Return whether two ways to divide a clip are the same branches, the second in the order of the source."""
    is_order = first.stem_index is not None and second.stem_index is None
    return (
        is_order
        and np.array_equal(first.vertex_branch, second.vertex_branch)
        and np.array_equal(first.branch_parent, second.branch_parent)
    )


def _best_of(tried: list[tuple[float, Found]]) -> tuple[float, Found]:
    """Return the best of the candidates that were tried, with about the bytes of its file: among those of about the
    same size one of the lowest order, but of roots alone last; among the smallest of these the one of the fewest
    branches. A branch that carries all others adds no order, and is better than the same order without: it turns once.
    If roots alone are smallest, others have to be closer.
    """
    fewest, smallest = min(tried, key=lambda one: one[0])
    alike = [one for one in tried if one[0] <= (SAME if order_of(smallest) == 0 else ALIKE) * fewest]
    least, best = min(alike, key=_rank_and_size)
    rank = _rank(best)
    same = [one for one in alike if _rank(one[1]) == rank and one[0] <= SAME * least]
    return min(same, key=lambda one: (len(one[1].branch_parent), one[0]))


def _rank(branches: Found) -> tuple[bool, int, bool]:
    """Return what ranks branches among others whose file is about as large, the best first."""
    order = order_of(branches)
    return order == 0, order - branches.is_carried, not branches.is_carried


def _rank_and_size(tried: tuple[float, Found]) -> tuple[bool, int, bool, float]:
    size, branches = tried
    return *_rank(branches), size


class Trial:
    """Frames from the middle of a clip, coded on different branches. Sizes are extrapolated to the whole clip. What is
    hopeless on the branches tried first is not tried on others."""

    def __init__(self, clip: MotionClip, option: BoundOption, options: EncodingOptions, work: Work):
        """Read a few frames from the middle of a clip. `option`: the bound of the files; `options`: their other
        options; `work`: counts the work of the trials.
        """
        start = max(0, (clip.frame_count - TRIAL_FRAMES) // 2)
        stop = min(clip.frame_count, start + TRIAL_FRAMES)
        faces = {name: clip.attributes[name] for name in POLYGON_ARRAYS if name in clip.attributes}
        self._clip = MotionClip(
            clip.block(start, stop),
            np.arange(start, stop) / clip.fps,
            rest=clip.source_rest,
            faces=clip.faces,
            attributes=faces,
            metadata=clip.metadata,
        )
        self._clip.rest_given = clip.rest_given
        self._frames_ratio = clip.frame_count / (stop - start)
        self._option, self._options, self._work = option, options, work
        self._most_work = TRIAL_SHARE * work.left
        self._hopeless, self._polygons = Hopeless(), stored_polygons(clip, options)
        self.least_work = LEAST_TRIALS * (TRIAL + ANALYSIS * clip.vertex_count * (stop - start))

    def size(self, branches: Found) -> tuple[float, bool]:
        """Return two things about the file of the whole clip on these branches: about its bytes, infinite if the bound
        cannot be kept; and whether its motion is predicted.
        """
        clip, lossless, host_rest = with_branches(self._clip, branches), self._option.lossless, self._options.host_rest
        hierarchy = hierarchy_on(branches, clip.rest, clip.edges)
        self._work.add(SURVEY * clip.vertex_count * clip.frame_count)
        coded = CodedClip(
            PlacedClip.of(clip),
            clip,
            hierarchy,
            clip.rest,
            clip.rest_dtype,
            clip.rest_given,
            exact_rest=lossless or host_rest,
            host_rest=host_rest,
            polygons=self._polygons,
        )
        options = EncodingOptions(
            segment_frames=DEFAULT_SEGMENT,
            rest_precision=self._options.rest_precision,
            attributes="none",
            lossless=lossless,
            ladder=self._options.ladder,
            without=self._options.without,
        )
        source = Source.of(coded, survey(clip, hierarchy), options, SERIAL)
        decisions = FileDecisions(source, options, predicts_as_usual=True)
        if self._option.target_size is not None:
            self._option = self._bound_of_target(decisions)
        with self._work.trying("branches", most=self._most_work):
            bound = self._option.in_scene_units(source, decisions.file_size)
            self._hopeless.divide(branches.vertex_branch, branches.branch_parent)
            return decisions.tried(bound, self._work, self._frames_ratio, self._hopeless)

    def _bound_of_target(self, decisions: FileDecisions) -> BoundOption:
        """Return the bound at which the file on these branches has the target size. Other branches are then tried at
        this bound.
        """
        work = Work()

        def size(bound: float) -> float:
            return decisions.tried(bound, work, self._frames_ratio, Hopeless())[0]

        try:
            return BoundOption(max_error=self._option.in_scene_units(decisions.source, size, FILLED))
        except BoundError:
            return BoundOption()
