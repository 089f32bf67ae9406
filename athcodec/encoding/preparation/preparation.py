"""A source's clip is made ready: places and branches are found, its record is made, its frames are surveyed."""

from __future__ import annotations

import dataclasses
import warnings

from athcodec.decoding import container as ct
from athcodec.encoding.assembly.decided import Draft
from athcodec.encoding.clip.coded_clip import CodedClip, hierarchy_and_pose
from athcodec.encoding.clip.places import PlacedClip, find_places
from athcodec.encoding.clip.survey import survey
from athcodec.encoding.model.motion import release_memory
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.options.weights import ErrorWeights
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.branch_trials import Trial, best_branches
from athcodec.encoding.search.progress import BRANCH_SHARE, Progress, Work, allowed_work
from athcodec.encoding.segments.segment import Source
from athcodec.encoding.streams.polygons import pack_places
from athcodec.errors import ClipError, SourceWarning
from athcodec.files.threads import ThreadPool, default_jobs
from athcodec.motion.branches.grown_pose import with_grown_pose
from athcodec.motion.branches.result import Found
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.joining import split
from athcodec.motion.neighbours import lost_neighbours
from athcodec.motion.places import Places
from athcodec.motion.presence import parts_hidden_far_away

PLACE_SHARE = 1 / 16  # Largest distance, in bounds, of a vertex from another that is coded in its place.
JOINED_SHARE = 0.95  # Largest share of the bytes at which parts that touch at a point are joined there.
FEWER_PLACES = 0.9  # Largest share of the places that are left then, if joining is to be tried.
MOST_LOST = 0.4  # Share of points that are far from their neighbours above which encoding warns.


def placed_clip(
    clip: MotionClip, options: EncodingOptions, bound: float = 0.0, places: Places | None = None
) -> PlacedClip:
    """Return the clip with one vertex for each place. `bound`: a length that the bound will not be below, for joining
    vertices that differ by roundings; `places`: the places if they are known already. Raises ClipError.
    """
    weights = None if options.weights is None else ErrorWeights.of(clip, options.weights)
    if places is None:
        labels = [] if weights is None else [weights.values]
        least = bound if weights is None else bound * float(weights.values.min() / weights.values.max())
        most_error = 0.0 if options.lossless or options.keeps_rest else PLACE_SHARE * least
        places = find_places(clip, labels, options.lossless or options.exact_rest, most_error)
    return PlacedClip.of(clip, places, weights)


def prepared(
    placed: PlacedClip, option: BoundOption, options: EncodingOptions, report: Progress
) -> tuple[Source, Work | None]:
    """Read all frames of a clip and find its branches if it has none. Return the source that is coded, and the work
    that finding branches took, or None for a clip that had them.
    """
    clip = placed.source
    if clip.has_branches:
        return surveyed(placed, None, options, report), None
    vertices, frames = placed.clip.vertex_count, clip.frame_count
    work = Work(BRANCH_SHARE * allowed_work(vertices, frames, options.effort), report, "branches")
    work.expected = BRANCH_SHARE * allowed_work(vertices, frames, "default")
    with work.trying("branches"):
        placed, branches = _best_places(placed, option, options, work)
    return surveyed(placed, branches, options, report), work


def surveyed(placed: PlacedClip, branches: Found | None, options: EncodingOptions, report: Progress) -> Source:
    """Read all frames of a clip once, and return the source that is coded. `branches`: those that were found for a clip
    without branches, or None.
    """
    hierarchy, pose = hierarchy_and_pose(placed, branches, options)
    _check_limits(placed.source.vertex_count, placed.source.frame_count, hierarchy)
    clip, pool = CodedClip.of(placed, branches, hierarchy, pose, options), ThreadPool(options.jobs or default_jobs())
    thresholds = {} if options.tam is None else {name: getattr(options.tam, name) for name in ("lam", "xi", "eta")}
    _warn_of_odd_points(placed.clip)
    seen = survey(clip.motion, hierarchy, progress=lambda f: report("survey", f), pool=pool, rest=pose, **thresholds)
    release_memory()
    return Source.of(clip, seen, options, pool)


def resumed(clip: MotionClip, draft: Draft, jobs: int | None = None) -> tuple[Source, EncodingOptions]:
    """Return two things: the source that a draft was made of, from the same clip, and the options of the draft with
    `jobs` in place of its own. Raises ClipError for a clip of other frames or vertices.
    """
    seen = draft.seen
    got, expected = (clip.frame_count, clip.vertex_count), (seen.frame_count, draft.places.vertex_count)
    if got != expected:
        raise ClipError(f"clip: got {got} frames and vertices, expected {expected} as in the draft")
    options = dataclasses.replace(draft.options, jobs=jobs)
    placed = placed_clip(clip, options, places=draft.places)
    coded = CodedClip.of(placed, draft.branches, seen.hierarchy, seen.rest, options)
    return Source.of(coded, seen, options, ThreadPool(jobs or default_jobs())), options


def _warn_of_odd_points(clip: MotionClip) -> None:
    """Warn if hidden parts are so far away that they enlarge the diagonal, and if frames seem to list different
    points.
    """
    for far in (parts_hidden_far_away(part) for part in split(clip).values()):
        if far:
            warnings.warn(
                f"hidden: {', '.join(far)}: where this is in frames that do not show it makes the diagonal more "
                "than a tenth longer, and so a bound relative to it larger; move it closer, or pass a length",
                SourceWarning,
                stacklevel=2,
            )
    if (lost := lost_neighbours(clip)) > MOST_LOST:
        warnings.warn(
            f"points: {lost:.0%} of the sampled points are far from their neighbour, more than a tenth of the "
            "diagonal, so frames seem to list other points, as scans do, and the file will be large; expected "
            "vertex i to be the same point of the plant in all frames: register the scans first",
            SourceWarning,
            stacklevel=2,
        )


def _check_limits(vertices: int, frames: int, hierarchy: Hierarchy) -> None:
    """Raise ClipError if a file would have more vertices, frames or branches than decoders take."""
    limits = ct.Limits()
    for name, value, limit in (
        ("vertices", vertices, limits.vertices),
        ("branches", hierarchy.branch_count, limits.branches),
        ("frames", frames, limits.frames),
        ("branches on branches", int(hierarchy.branch_depth.max()) + 1, limits.hierarchy_depth),
    ):
        if value > limit:
            raise ClipError(f"clip: got {value} {name}; expected at most {limit}")


def _grown(placed: PlacedClip, options: EncodingOptions) -> MotionClip:
    """Return the clip in which branches are sought: with the pose that shows most of a growing plant, unless the rest
    pose has to stay."""
    return placed.clip if options.keeps_rest else with_grown_pose(placed.clip)


def _best_places(
    placed: PlacedClip, option: BoundOption, options: EncodingOptions, work: Work
) -> tuple[PlacedClip, Found]:
    """Return two things, chosen to make the smallest file as far as the work allows trials: the clip with its places,
    and the branches of these places. Parts of a mesh that touch at a point may share a place there or not, and objects
    of as many vertices may have the same vertices joined.
    """
    apart = placed.apart()
    first = placed if apart is None else apart
    regular = first.regular()
    is_joined_tried = apart is not None and placed.places.count <= FEWER_PLACES * apart.places.count
    is_compared = is_joined_tried or regular is not None
    branches, size = best_branches(_grown(first, options), option, work, options, is_compared)
    best, least = (first, branches), size + _table_bytes(first)
    if regular is not None:
        moved, trial = (first.moved_to(branches, regular), Trial(_grown(regular, options), option, options, work))
        size = trial.size(moved)[0] + _table_bytes(regular)
        best, least = ((regular, moved), size) if size < least else (best, least)
    if is_joined_tried and work.fits(work.done):
        others, size = best_branches(_grown(placed, options), option, work, options, is_compared=True)
        if size + _table_bytes(placed) < JOINED_SHARE * least:
            return placed, others
    return best


def _table_bytes(placed: PlacedClip) -> int:
    return len(pack_places(placed.places)) if placed.places.are_shared else 0
