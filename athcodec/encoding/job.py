"""One clip on its way into a file: the stages of FORMAT.md run forward, in closed loop, segment by segment.

The source is read twice: once for what needs all frames (bounding box, TAM), once to code. What the file promises is
checked on what a decoder will output: every level of every segment is decoded and measured, and vertices beyond the
bound at the last level are corrected before the segment is written. Settings come from search.py, the streams of a
segment from segment.py.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import IO, BinaryIO

import numpy as np
import numpy.typing as npt

from athcodec._native import MEASURES, SHEET
from athcodec.decoding import container as ct
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.decoder import Decoder
from athcodec.encoding import polygons, streams, writing
from athcodec.encoding import quantise as qz
from athcodec.encoding.choices.levels import chosen_levels
from athcodec.encoding.choices.prediction import FoundPrediction, best_prediction, code_predicted_segment, one_map_each
from athcodec.encoding.features import Feature
from athcodec.encoding.layers import (
    MOST_LAYERS,
    MOST_LEVELS,
    CodedMotion,
    Ends,
    Layer,
    Layers,
    layer_chunks,
    layer_ratios,
    layers_of,
    step_factors,
)
from athcodec.encoding.motion import release_memory
from athcodec.encoding.places import PlacedClip, find_places
from athcodec.encoding.progress import (
    FILE_BYTE,
    LEVEL_MOTION,
    MOTION,
    POSES,
    READING,
    SURVEY,
    Progress,
    Work,
    allowed_work,
    silent,
)
from athcodec.encoding.sample import is_small
from athcodec.encoding.search import Search
from athcodec.encoding.segment import CodedPrelude, Source, thread_count
from athcodec.encoding.segment_samples import typical_segments
from athcodec.encoding.settings import Choice
from athcodec.encoding.shape import RestPrecision
from athcodec.encoding.start import still_choice
from athcodec.encoding.still import SplitSource
from athcodec.encoding.summary import Seam, Summary
from athcodec.encoding.survey import Ath, Survey, survey
from athcodec.errors import BoundError, ClipError, SourceWarning
from athcodec.files.threads import ThreadPool, default_jobs
from athcodec.motion.branches.grown_pose import with_grown_branches
from athcodec.motion.branches.result import Found, with_branches
from athcodec.motion.clip import ERROR_WEIGHTS, MotionClip
from athcodec.motion.hierarchy import Hierarchy, derived_edges, hierarchy_of
from athcodec.motion.joining import split
from athcodec.motion.neighbours import lost_neighbours
from athcodec.motion.places import Places
from athcodec.motion.polygons import POLYGON_ARRAYS, Polygons, type_code
from athcodec.motion.presence import parts_hidden_far_away
from athcodec.motion.thresholds import THRESHOLDS, Thresholds
from athcodec.motion.units import METRES_PER_UNIT, LengthLike, stated_scene
from athcodec.options import (
    DEFAULT_LADDER,
    EFFORTS,
    LADDERS,
    MAX_SEGMENT,
    MIN_SEGMENT,
    SMOOTHNESS,
    ladder_of,
    set_numbers,
)

SPOOL_BYTES = 64 << 20  # Bytes of chunks that are held in memory and not in a temporary file.
CHUNK_BYTES, LEVEL_BYTES = 6, 6  # Bytes of the front for a chunk, and for the errors of a level and segment.
PREDICTED_SHARE = 0.8  # Largest share of the bytes of layers at which predicted motion, which has none, is better.
REFUSAL_ROUNDS = 12  # Largest number of files that are coded to find the smallest bound that can be kept.
FEW_BYTES = 2000  # Bytes up to which the file of a small clip may do without coarse levels.
PLACE_SHARE = 1 / 16  # Largest distance, in bounds, of a vertex from another that is coded in its place.
HELD_SHARE = 1 / 64  # Largest distance, in bounds, of a frame from the pose that is shown in its place.
SEARCH_SAVES = 0.4  # Smallest share of the bytes at its first settings that a search has come down to.
STATIC_METADATA = ("unit", METRES_PER_UNIT, "up_axis")


@dataclass(frozen=True)
class EncodingOptions:
    """The options of `encode` that are not the bound, checked. Raises ValueError."""

    segment_frames: int | None = None  # Longest segment, as split_segments takes it.
    tam: Thresholds | None = None
    exact_rest: bool = False
    host_rest: bool = False
    rest_precision: RestPrecision = RestPrecision()
    lossless: bool = False
    weights: str | np.ndarray | None = None
    attributes: str = "all"
    effort: str = "default"
    smoothness: str = "default"
    jobs: int | None = None
    ladder: tuple[float, ...] = ()  # Largest errors over the diagonal, descending; (): a single layer.
    predicted_frames: int = MAX_SEGMENT  # Longest segment of predicted motion.
    without: frozenset[Feature] = frozenset()  # Features that the file does without.

    @classmethod
    def of(
        cls,
        *,
        segment_frames: int | None = None,
        ladder: str | Sequence[float] = DEFAULT_LADDER,
        rest_error: LengthLike | None = None,
        **options,
    ) -> EncodingOptions:
        """Return checked options; ladder, rest_error: as `ladder_of` and `RestPrecision.of` take them."""
        if segment_frames is not None:
            options |= {"segment_frames": segment_frames, "predicted_frames": segment_frames}
        return cls(ladder=ladder_of(ladder), rest_precision=RestPrecision.of(rest_error), **options)

    @property
    def keeps_rest(self) -> bool:
        """Whether the clip's rest pose comes back bit for bit, and so is what motion is coded about."""
        return self.exact_rest or self.host_rest

    def __post_init__(self) -> None:
        set_numbers(self, wholes=("segment_frames", "jobs", "predicted_frames"))
        if self.segment_frames is not None and not MIN_SEGMENT <= self.segment_frames <= MAX_SEGMENT:
            raise ValueError(f"segment_frames: got {self.segment_frames}; expected {MIN_SEGMENT} to {MAX_SEGMENT}")
        if self.exact_rest and self.host_rest:
            raise ValueError("host_rest: got exact_rest too; expected one of them")
        if self.attributes not in ("all", "none"):
            raise ValueError(f"attributes: got {self.attributes!r}; expected 'all' or 'none'")
        if self.jobs is not None and self.jobs < 1:
            raise ValueError(f"jobs: got {self.jobs}; expected at least 1")
        if self.effort not in EFFORTS:
            raise ValueError(f"effort: got {self.effort!r}; expected one of {', '.join(EFFORTS)}")
        if self.smoothness not in SMOOTHNESS:
            raise ValueError(f"smoothness: got {self.smoothness!r}; expected one of {', '.join(SMOOTHNESS)}")


@dataclass(frozen=True)
class Draft:
    """All that is decided about a file before its motion is coded. It can be pickled.

    With the same clip, which may have been opened again elsewhere, it goes to `code_segments` and `write`. The
    `fingerprint` tells a process that its hierarchy or rest pose differs from those of the draft.
    """

    choice: Choice
    seen: Survey
    segment_count: int
    places: Places
    branches: Found | None  # Branches of places for a clip without.
    options: EncodingOptions
    fingerprint: str
    thresholds: Thresholds


@dataclass(frozen=True)
class CodedSegment:
    """One segment: chunks {(level, kind): payload}, (levels, 3) errors of stopping at each level, (levels,) joins to
    the segment before, and (levels, 2) flaws of what each level shows (SourceFrames)."""

    index: int
    chunks: dict[tuple[int, int], bytes]
    errors: np.ndarray
    joins: np.ndarray
    flaws: np.ndarray


def _check_limits(clip: MotionClip, hierarchy: Hierarchy) -> None:
    """Raise ClipError for counts that decoders refuse."""
    limits = ct.Limits()
    for name, value, limit in (
        ("vertices", clip.vertex_count, limits.vertices),
        ("branches", clip.branch_count, limits.branches),
        ("frames", clip.frame_count, limits.frames),
        ("branches on branches", int(hierarchy.branch_depth.max()) + 1, limits.hierarchy_depth),
    ):
        if value > limit:
            raise ClipError(f"clip: got {value} {name}; expected at most {limit}")


def _completed(clip: MotionClip, branches: Found | None, options: EncodingOptions) -> MotionClip:
    """Return the clip on branches that were found for it, with the rest pose as a host has it."""
    if branches is not None:
        clip = with_branches(clip, branches)
    if options.host_rest:
        clip = clip.replace(rest=_host_rest(clip))
    return clip


def _host_rest(clip: MotionClip) -> np.ndarray:
    return clip.rest.astype(np.float32) + np.float32(0)  # -0.0 is 0.0


def placed_clip(
    clip: MotionClip, options: EncodingOptions, bound: float = 0.0, places: Places | None = None
) -> PlacedClip:
    """Return the clip with a vertex for each place. bound: the largest error at least; places: as they were found
    before. Raises ClipError."""
    clip, weights = (clip, None) if options.weights is None else _weighted(clip, options.weights)
    if places is None:
        labels = [] if weights is None else [weights]
        least = bound if weights is None else bound * float(weights.min() / weights.max())
        most_error = 0.0 if options.lossless or options.keeps_rest else PLACE_SHARE * least
        places = find_places(clip, labels, options.lossless or options.exact_rest, most_error)
    return PlacedClip.of(clip, places, weights)


def _weighted(clip: MotionClip, weights: str | np.ndarray) -> tuple[MotionClip, np.ndarray]:
    """Return the clip, which then names its weights, and these as (N,) float64. Raises ClipError."""
    name = weights if isinstance(weights, str) else ERROR_WEIGHTS
    attributes = clip.attributes if isinstance(weights, str) else clip.attributes | {name: _numbers(weights)}
    if name not in attributes:
        raise ClipError(f"weights: got {name!r}, expected one of {', '.join(attributes) or 'no attributes'}")
    array = attributes[name]
    if array.size != clip.vertex_count or array.dtype.kind not in "biuf":
        raise ClipError(
            f"weights: got {array.dtype} of shape {array.shape} in {name!r}, expected a number for each of "
            f"{clip.vertex_count} vertices"
        )
    values = array.reshape(-1).astype(np.float64)
    bad = np.flatnonzero(~((values > 0) & np.isfinite(values)))
    if bad.size:
        raise ClipError(f"weights: vertex {bad[0]} has {values[bad[0]]:g} in {name!r}, expected a number above 0")
    return clip.replace(attributes=attributes, metadata=clip.metadata | {ERROR_WEIGHTS: name}), values


def _numbers(weights: npt.ArrayLike) -> np.ndarray:
    """Return weights as an array that a file can hold, which has no type for long doubles."""
    array = np.asarray(weights)
    return array.astype(np.float64) if array.dtype.kind == "f" and array.itemsize > 8 else array


def time_chunk(*times: np.ndarray) -> bytes:
    """Return TIME for times in seconds, (T,) for each clip, exactly: by rules if these give the very same numbers."""
    steady = writing.pack_steady_time(*times)
    return steady or writing.pack_time(streams.encode_times(np.concatenate(times).astype(np.float64)))


MOST_LOST = 0.4  # Share of points that are far from their neighbours above which encoding warns.


@dataclass
class Decided:
    """Settings that the streams of a file depend on, and what follows from them."""

    ath: Ath
    choice: Choice
    prelude: CodedPrelude
    layers: Layers
    source: Source
    tried: dict[int, CodedSegment] = field(default_factory=dict)  # Segments that were coded to compare.

    @property
    def segment_count(self) -> int:
        return len(self.source.segments)

    @property
    def shared_bytes(self) -> int:
        """Bytes of hierarchy, rest poses and learned modes."""
        return self.prelude.prelude_bytes + sum(map(len, layer_chunks(self.layers).values()))

    @property
    def fingerprint(self) -> str:
        streams_and_pose = (
            self.prelude.hierarchy_stream,
            self.prelude.rest_chunk.stream,
            self.source.source_rest.tobytes(),
        )
        return hashlib.sha256(b"".join(streams_and_pose)).hexdigest()


@dataclass
class _Result:
    store: writing.ChunkStore
    header: ct.Header
    errors: np.ndarray


@dataclass
class EncodingJob:
    """One clip on its way into a file: what does not depend on the bound."""

    source: Source
    placed: PlacedClip
    options: EncodingOptions
    report: Progress = silent
    branches: Found | None = None
    spent: float = 0.0  # Work of finding branches.
    predicts_as_usual: bool = False  # Whether no other way to predict motion is tried.
    untried: tuple[str, ...] = ()  # What that left out.

    @classmethod
    def begin(
        cls, placed: PlacedClip, grown: MotionClip, branches: Found | None, options: EncodingOptions, report: Progress
    ) -> EncodingJob:
        """Return the job for a clip, all of whose frames are read. grown: the clip itself, or with a rest pose that
        shows more of it, which motion is coded about; branches: those found for a clip without."""
        clip, of_grown = placed.clip, _completed(grown, branches, options)
        hierarchy = hierarchy_of(of_grown)
        _check_limits(placed.source, hierarchy)
        pool = ThreadPool(options.jobs or default_jobs())
        thresholds = {} if options.tam is None else {name: getattr(options.tam, name) for name in ("lam", "xi", "eta")}
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
        of_grown = of_grown if options.keeps_rest else with_grown_branches(of_grown, hierarchy)
        seen = survey(of_grown, hierarchy, progress=lambda f: report("survey", f), pool=pool, **thresholds)
        return cls(cls._source(placed, branches, seen, options, pool), placed, options, report, branches)

    @classmethod
    def resume(cls, clip: MotionClip, draft: Draft, report: Progress = silent, jobs: int | None = None) -> EncodingJob:
        """Return the job in the state in which it made the draft. Raises ClipError."""
        seen = draft.seen
        got, expected = (clip.frame_count, clip.vertex_count), (seen.frame_count, draft.places.vertex_count)
        if got != expected:
            raise ClipError(f"clip: got {got} frames and vertices, expected {expected} as in the draft")
        options = dataclasses.replace(draft.options, jobs=jobs)
        placed = placed_clip(clip, options, places=draft.places)
        source = cls._source(placed, draft.branches, seen, options, ThreadPool(jobs or default_jobs()))
        return cls(source, placed, options, report, draft.branches)

    @staticmethod
    def _source(
        placed: PlacedClip, branches: Found | None, seen: Survey, options: EncodingOptions, pool: ThreadPool
    ) -> Source:
        clip = _completed(placed.clip, branches, options)
        order, reference = seen.hierarchy.vertex_source, None
        first, sizes = placed.places.first[order], placed.places.sizes[order]
        if not np.array_equal(seen.rest, clip.rest[order]):
            if not clip.rest_given:
                pose = np.empty_like(seen.rest)
                pose[order] = seen.rest
                clip = clip.replace(rest=pose.astype(clip.rest_dtype), rest_given=False)
            else:
                reference = seen.rest
        source = Source(
            clip,
            seen.hierarchy,
            seen,
            options.segment_frames,
            options.keeps_rest or (options.lossless and clip.rest_given),
            None if placed.weights is None else placed.weights[first],
            pool,
            options.host_rest,
            polygons=_polygons(clip, options),
            shares=sizes if placed.places.are_shared else None,
            place_error=placed.places.error,
            host_mesh=_host_rest(placed.source) if options.host_rest else None,
            rest_precision=options.rest_precision,
            without=options.without,
        )
        return source if reference is None else source.about(reference - source.origin)

    @property
    def clip(self) -> MotionClip:
        return self.source.clip

    @property
    def _keeps_static(self) -> bool:
        return self.options.attributes == "all"

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
        """Let a BoundError of coding at a bound name the smallest bound that can be kept."""
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
        """Return the smallest bound above `low` that a file was found to keep."""
        high = math.inf
        for _ in range(REFUSAL_ROUNDS):
            bound = qz.rounded_up(4 * low if high == math.inf else math.sqrt(low * high))
            if bound >= high:
                break
            low, high = (bound, high) if self.file_size(bound) == math.inf else (low, bound)
        return high

    def tried(self, bound: float, work: Work, frames_ratio: float) -> tuple[float, bool]:
        """Return about the bytes of a file of so many times the frames, as far as the work allowed tells, and whether
        its motion is predicted; infinite if the bound cannot be kept."""
        return self._holding(bound)._tried(bound, work, frames_ratio)

    def _tried(self, bound: float, work: Work, frames_ratio: float) -> tuple[float, bool]:
        try:
            self._check(bound)
            if self.source.still:
                return self.decide(bound).shared_bytes, False
            ath = self.seen.ath(self.thresholds(bound))
            search = Search.of(self.source, ath, bound, self.options.effort, work, self.options.jobs)
            unsearched = search.first_cost()
            prediction = self._best_prediction(bound, unsearched, work)
            if prediction is None:  # First settings rank branches as the work that is left for a search hardly does.
                return search.expected(frames_ratio), False
            predicted = frames_ratio * prediction.bytes, True
            if prediction.bytes < SEARCH_SAVES * unsearched:
                return predicted
            return min((search.tried(frames_ratio), False), predicted)
        except BoundError:
            return math.inf, False

    def decide(self, bound: float) -> Decided:
        """Search for settings."""
        self._check(bound)
        holding = self._holding(bound)
        split = holding._split(bound, self.thresholds(bound))
        moving = holding if split is None else dataclasses.replace(holding, source=split.moving_source)
        work = moving._allowed_work(bound)
        decided = moving._decide(bound, work)
        if split is not None:
            choice = split.choice(decided.choice, decided.ath.thresholds, bound)
            options = dataclasses.replace(holding.options, segment_frames=decided.source.segment_frames)
            if len(decided.layers.each) == 1:
                options = dataclasses.replace(options, ladder=())
            decided = dataclasses.replace(holding, options=options)._of_choice(choice, decided.ath.thresholds)
        untried = tuple(dict.fromkeys([*self.untried, *work.untried]))
        decided.choice = dataclasses.replace(decided.choice, untried=untried)
        return decided

    def _split(self, bound: float, thresholds: Thresholds) -> SplitSource | None:
        """Return what moves and what stands still, each as a source; None: one of them is missing. What stands still
        takes no part in the search for settings."""
        return SplitSource.of(self.source, self.seen.ath(thresholds), bound)

    def _of_choice(self, choice: Choice, thresholds: Thresholds) -> Decided:
        """Return what follows from a choice for all branches."""
        bound = choice.settings.bound
        split = self._split(bound, thresholds)
        source = self.source if split is None else split.marked
        if not choice.predicted and source.segment_frames != self.options.segment_frames:
            source = source.in_segments(self.options.segment_frames)
        job = dataclasses.replace(self, source=source)
        if choice.predicted:
            return job._predicted(choice)
        ath = self.seen.ath(thresholds)
        return job._layered(ath, choice, CodedPrelude(source.about(choice.reference), ath, choice.settings))

    def _holding(self, bound: float) -> EncodingJob:
        """Return the job without frames that others show within a small part of the bound."""
        tolerance = 0.0 if self.options.lossless else HELD_SHARE * self.source.smallest_bound(bound)
        return dataclasses.replace(self, source=self.source.holding(tolerance))

    def _decide(self, bound: float, work: Work) -> Decided:
        ath = self.seen.ath(self.thresholds(bound))
        ratios = self._layer_ratios(ath, bound)
        ratio = ratios[0]
        if self.source.still:
            choice = still_choice(self.source, ath, bound, ratio)
            return self._layered(ath, choice, CodedPrelude(self.source, ath, choice.settings))
        share = PREDICTED_SHARE if ratio > 1 else 1.0
        search = Search.of(self.source, ath, bound, self.options.effort, work, self.options.jobs, ratios)
        if self._has_usual_ladder and search.levels_need_own_bases():
            return self._with_one_layer()._decide(bound, work)
        shorter = search.shorter_segments() if self.options.segment_frames is None else []
        with work.trying("segments", search.share_of_longest(len(shorter)) if shorter else 1.0):
            best = self._searched(search, share, work)
        least, coding = self.size(best) if shorter else 0, self._coding_work(bound, self.clip.frame_count)
        for left, (length, price) in zip(range(len(shorter), 0, -1), shorter):
            with work.trying("segments", 1 / left), suppress(BoundError):
                if least >= SEARCH_SAVES * price and work.fits(coding):
                    work.add(coding)
                    job = self._in_segments(length)
                    other = job._decide(bound, work)
                    size = job.size(other)
                    best, least = (other, size) if size < least else (best, least)
        return best

    def _searched(self, search: Search, share: float, work: Work) -> Decided:
        """Return what a search finds, or predicted motion if that takes at most a share of the bytes."""
        bound, unsearched = search.trials.start.bound, share * search.first_cost()
        if math.isfinite(unsearched):
            work.allowed -= FILE_BYTE * unsearched
            search.keep_work_of_maps()
        start = search.trials.start
        is_rigid = (start.rigid > start.layer).any()  # Also in the last layer.
        prediction = None if is_rigid else self._best_prediction(bound, unsearched, work)
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
                best = min(best, self._without_levels(bound, work), key=self._estimated_bytes)
            if prediction is None or prediction.bytes >= share * self._estimated_bytes(best):
                return best
        except BoundError:
            if prediction is None:
                raise
        return self._predicted(prediction.choice)

    def _with_one_layer(self) -> EncodingJob:
        """Return the job of a clip whose levels move by series of their own, which prediction hardly suits."""
        return dataclasses.replace(self, options=dataclasses.replace(self.options, ladder=()), predicts_as_usual=True)

    def _in_segments(self, frames: int) -> EncodingJob:
        """Return the job in segments of at most so many frames."""
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
        levels = int(self.source.hierarchy.branch_depth.max())
        return (MOTION * (1 + layers) / 2 + LEVEL_MOTION * levels) * self.clip.vertex_count * frames

    def _best_of(self, search: Search, choices: list[Choice], prelude: CodedPrelude) -> Decided:
        """Return the best of what a search has found: the first of it, and others for which there is work left."""
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

    def _without_levels(self, bound: float, work: Work) -> Decided:
        """Return the best file with one node for the whole plant, whatever its error."""
        ath = self.seen.ath(Thresholds(bound, self.clip.frame_count, self.seen.largest_distance.max(), 0))
        search = Search.of(self.source, ath, bound, self.options.effort, work, self.options.jobs)
        return self._best_of(search, *search.decide())

    def _best_prediction(self, bound: float, most_bytes: float, work: Work) -> FoundPrediction | None:
        """Return the best prediction; None: it is too large, or a hierarchy of maps is asked for, which it lacks."""
        if self.options.tam or Feature.PREDICTED in self.options.without:
            return None
        return best_prediction(
            self._long_segments, bound, most_bytes, work, self.options.smoothness, self.predicts_as_usual
        )

    @property
    def _long_segments(self) -> Source:
        return self.source.in_segments(self.options.predicted_frames)

    def _predicted(self, choice: Choice) -> Decided:
        source = self._long_segments
        ath = one_map_each(source.seen)
        prelude = CodedPrelude(source, ath, choice.settings, predicted=True)
        only = Layer(prelude.plan, choice.settings, None)
        layers = Layers(prelude.rest_chunk, prelude.source_rest, prelude.plan, [only])
        return Decided(ath, choice, prelude, layers, source)

    def _estimated_bytes(self, decided: Decided) -> float:
        """Return the bytes of the motion of a file whose segments are like typical ones."""
        total = float(decided.shared_bytes)
        for segment, frames in typical_segments(decided.source):
            if segment not in decided.tried:
                positions = decided.source.positions(segment)
                motion = self._motion(decided, segment, positions, self._exact(segment))
                decided.tried[segment] = _finished((segment, motion))
            coded = decided.tried[segment]
            lossy = [data for (_, kind), data in coded.chunks.items() if kind != ct.EXACT]
            front = CHUNK_BYTES * len(lossy) + LEVEL_BYTES * len(coded.errors)
            total += (front + sum(map(len, lossy))) * frames / decided.source.frames_of(segment)
        return total

    def _layer_ratios(self, ath: Ath, bound: float) -> list[int]:
        """Return the ratios of as many of the last layers as there is room for behind the levels of the hierarchy. A
        still clip has one layer: a rest pose in layers takes up to two thirds more."""
        if self.source.still:
            return [1]
        ratios = layer_ratios(self.options.ladder, bound, self.seen.diagonal, self._step_factors(bound))
        return ratios[-min(MOST_LAYERS, MOST_LEVELS - ath.height - 1 - self.options.lossless) :]

    @property
    def _has_usual_ladder(self) -> bool:
        return self.options.ladder == LADDERS[DEFAULT_LADDER]

    def _step_factors(self, bound: float) -> tuple[float, float]:
        return step_factors(self.source, self.options.ladder, bound)

    def _layered(self, ath: Ath, choice: Choice, prelude: CodedPrelude) -> Decided:
        source = self.source.about(choice.reference)
        bound = choice.settings.bound
        ratios, factors = self._layer_ratios(ath, bound), self._step_factors(bound)
        layers = layers_of(source, prelude, choice, ratios, factors, hold_errors=not self._has_usual_ladder)
        return Decided(ath, choice, prelude, layers, source)

    def draft(self, decided: Decided) -> Draft:
        options = self.options
        if not decided.choice.predicted:
            options = dataclasses.replace(options, segment_frames=decided.source.segment_frames)
        if len(decided.layers.each) == 1:
            options = dataclasses.replace(options, ladder=())
        return Draft(
            decided.choice,
            self.seen,
            decided.segment_count,
            self.placed.places,
            self.branches,
            options,
            decided.fingerprint,
            decided.ath.thresholds,
        )

    def decided(self, draft: Draft) -> Decided:
        """Return what the maker of the draft decided. Raises ClipError if it is not the same here."""
        return self._holding(draft.choice.settings.bound)._decided(draft)

    def _decided(self, draft: Draft) -> Decided:
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
            return self.size(dataclasses.replace(self, report=silent).decide(bound))
        except BoundError:
            return math.inf

    def size(self, decided: Decided) -> int:
        """Return the bytes of a file. Raises BoundError."""
        job = dataclasses.replace(self, report=silent)
        with tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
            coded = job.coded(decided, range(decided.segment_count))
            result = job.fill(writing.ChunkStore(spool), decided, coded)
            return result.store.size(result.header, result.errors)

    def write(
        self,
        path: str | PathLike[str] | None,
        out: BinaryIO,
        spool: IO[bytes],
        decided: Decided,
        coded: Iterable[CodedSegment],
    ) -> Summary:
        """Write the whole file into `out`, which is to become `path`."""
        result = self.fill(writing.ChunkStore(spool), decided, coded)
        chunks = result.store.write(out, result.header, result.errors)
        if any(clip_range.loop for clip_range in self.clip.clip_ranges):
            mesh = _host_rest(self.placed.source) if self.options.host_rest else None
            with AthFile(out, strict=True, host_mesh=mesh) as file, Decoder(file) as decoder:
                result.store.replace(ct.CLIPS, self._clips(decided, self._seam_errors(decoder)))
            out.seek(0)
            chunks = result.store.write(out, result.header, result.errors)
        with AthFile(out, strict=True) as file, Decoder(file) as decoder:  # The file gets its name after this check.
            summary = _summary(path and Path(path), self, decided, result, chunks, decoder)
        self.report("done", 1.0)
        return summary

    def fill(self, store: writing.ChunkStore, decided: Decided, coded: Iterable[CodedSegment]) -> _Result:
        """Add all chunks of a file to a store."""
        layers = decided.layers
        self._add_prelude(store, decided)
        for (level, kind), content in layer_chunks(layers).items():
            store.add(kind, content, level)
        errors, joins, stages = self._add_motion(store, decided, coded)
        self._add_static(store)
        if self.clip.clip_ranges:
            store.add(ct.CLIPS, self._clips(decided, [np.zeros(len(errors))] * len(self.clip.clip_ranges)))
        header = ct.Header(
            self.placed.source.vertex_count,
            self.clip.vertex_count,
            self.clip.branch_count,
            self.clip.frame_count,
            decided.segment_count,
            len(errors),
            len(errors),
            0.0 if self.options.lossless else self.source.largest_bound(decided.choice.settings.bound),
            self.clip.dtype == np.float64,
            len(self.clip.clip_range_frames),
            len(layers.each),
            decided.choice.predicted,
            stages=tuple(stages),
            joins=joins,
            repeats=decided.source.repeats,
        )
        return _Result(store, header, errors)

    def _clips(self, decided: Decided, seam_errors: Sequence[Sequence[float] | None]) -> bytes:
        segment_counts = [len(segments) for segments in decided.source.clip_range_segments]
        return writing.pack_clips(self.clip.clip_ranges, segment_counts, seam_errors, decided.choice.settings.periodic)

    def _seam_errors(self, decoder: Decoder) -> list[list[float] | None]:
        """Return for each loop how far off its step from the last frame to the first is, per level."""
        return [
            self._seam_errors_of(decoder.play(clip.name), self._step(stop - 1, start)) if clip.loop else None
            for clip, (start, stop) in zip(decoder.file.clips, self.clip.clip_range_frames)
        ]

    @staticmethod
    def _seam_errors_of(loop: Decoder, step: np.ndarray) -> list[float]:
        errors = []
        for level in range(loop.file.level_count):
            last, first = (loop.positions(frame, level, np.float64) for frame in (-1, 0))
            errors.append(np.linalg.norm(first - last - step, axis=1).max())
        return errors

    def _step(self, frame: int, following: int) -> np.ndarray:
        """Return how far the vertices move from one frame of the source to another, (N, 3) float64."""
        source = self.placed.source
        before, after = (source.block(frame, frame + 1)[0].astype(np.float64) for frame in (frame, following))
        return after - before

    def seams(self, decoder: Decoder) -> tuple[Seam, ...]:
        """Return the seams of the loops of the file just written."""
        seams = []
        for clip, (start, stop) in zip(decoder.file.clips, self.clip.clip_range_frames):
            if clip.loop:
                beside = [(start, min(start + 1, stop - 1)), (max(stop - 2, start), stop - 1)]
                step, *steps = (
                    np.linalg.norm(self._step(*frames), axis=1).max() for frames in [(stop - 1, start), *beside]
                )
                seams.append(Seam(clip.name, float(step), float(max(steps)), clip.seam_errors[-1]))
        return tuple(seams)

    def _add_prelude(self, store: writing.ChunkStore, decided: Decided) -> None:
        store.add(ct.HIERARCHY, decided.prelude.hierarchy_stream)
        store.add(ct.REST, writing.pack_rest(decided.layers.rest))
        if decided.layers.source_rest:
            store.add(ct.SOURCE_REST, decided.layers.source_rest)
        store.add(ct.TIME, time_chunk(*(self.clip.time[start:stop] for start, stop in self.clip.clip_range_frames)))
        source, places = self.placed.source, self.placed.places
        if places.are_shared:
            store.add(ct.PLACES, polygons.pack_places(places))
        kept = source.metadata.keys() - {THRESHOLDS} if self._keeps_static else STATIC_METADATA
        metadata = {key: value for key, value in source.metadata.items() if key in kept}
        metadata |= stated_scene(metadata)
        if self.options.tam is not None:
            metadata[THRESHOLDS] = self.options.tam.in_metadata
        if metadata:
            store.add(ct.METADATA, writing.pack_metadata(metadata))
        faces = _polygons(source, self.options)
        if faces is not None:
            store.add(ct.FACES, polygons.pack(faces, places, Feature.SIDES not in self.options.without))
        if self._keeps_static and source.edges is not None:
            store.add(ct.EDGES, self._edges(source.edges))

    def _edges(self, edges: np.ndarray) -> bytes:
        places = self.placed.places
        derived = places.first[derived_edges(self.source.hierarchy)]
        if derived.shape == edges.shape and (derived == edges).all():
            return writing.pack_derived_edges(type_code(edges.dtype))
        return polygons.pack(Polygons.of_rows(edges), places)

    def _add_static(self, store: writing.ChunkStore) -> None:
        source = self.placed.source
        if self._keeps_static and len(source.attributes) > ct.Limits.attributes:
            raise ClipError(f"attributes: got {len(source.attributes)}; expected at most {ct.Limits.attributes}")
        in_faces = POLYGON_ARRAYS if self.source.polygons is not None and source.faces is None else ()
        if self._keeps_static:
            for name, array in source.attributes.items():
                if name in in_faces:
                    continue
                store.add(ct.ATTRIBUTE, writing.pack_array(name, array))

    def coded(self, decided: Decided, segments: Sequence[int]) -> Iterator[CodedSegment]:
        """Yield coded segments, as many at a time as there is memory for."""
        source = decided.source
        if len(source.segments) == 1 and decided.tried:
            return iter(decided.tried.values())
        at_once = thread_count(self.options.jobs, source)
        pool = ThreadPool(at_once, beside=source.pool.jobs > 1)

        def predict(read: tuple[int, list[np.ndarray]]) -> CodedSegment:
            index, block = read
            positions, exact = self._positions(block.pop())  # The list no longer holds the block.
            frames = positions, exact, source.shown_times(index), source.box
            return CodedSegment(index, *code_predicted_segment(decided.prelude, decided.choice, *frames))

        def begin(read: tuple[int, list[np.ndarray], Ends | None, Ends | None]) -> tuple[int, CodedMotion]:
            index, block, before, after = read
            frames = self._positions(block.pop()) if block else (source.positions(index), self._exact(index))
            return index, self._motion(decided, index, *frames, before, after)

        if decided.choice.predicted:
            return pool.ordered(predict, ((index, [source.block(index)]) for index in segments), at_once)
        order = self._in_order(source, segments)
        begun = pool.ordered(begin, self._linked(decided, order), at_once - 1)
        coded = pool.ordered(_finished, self._halfway(begun, decided.segment_count), 0)
        return (one for one, (_, is_wanted) in zip(coded, order) if is_wanted)

    def _halfway(self, begun: Iterable[tuple[int, CodedMotion]], count: int) -> Iterator[tuple[int, CodedMotion]]:
        """Report each of `count` segments whose first layer is coded."""
        for done, one in enumerate(begun):
            self.report("motion", min((done + 0.5) / count, 1.0))
            yield one
            del one

    def _motion(
        self,
        decided: Decided,
        index: int,
        positions: np.ndarray,
        exact: np.ndarray | None,
        before: Ends | None = None,
        after: Ends | None = None,
    ) -> CodedMotion:
        """Return a segment, which goes on from the ends of the one before it and leaves its own."""
        source, loops = decided.source, decided.source.is_whole_loop(index)
        frames = positions, exact, source.goes_on(index), source.shown_times(index), source.box, loops
        layers = decided.layers.of_segment(loops)
        release_memory()
        return CodedMotion(decided.prelude, layers, decided.segment_count, *frames, before, after)

    @staticmethod
    def _in_order(source: Source, segments: Sequence[int]) -> list[tuple[int, bool]]:
        """Return the segments, and whether each is wanted: right before it stands the one that it is joined to, which
        may be there for its ends alone."""
        order: list[tuple[int, bool]] = []
        for index in segments:
            before = source.segment_before(index)
            if before is not None and (not order or before != order[-1][0]):
                order.append((before, False))
            order.append((index, True))
        return order

    @staticmethod
    def _linked(decided: Decided, order: Sequence[tuple[int, bool]]) -> Iterator[tuple[int, Ends | None, Ends | None]]:
        """Yield each segment with the ends that it goes on from, and with room for its own if the next one does."""
        goes_on = [is_wanted and decided.source.segment_before(index) is not None for index, is_wanted in order]
        ends = None
        for (index, _), follows in zip(order, [*goes_on[1:], False]):
            before, ends = ends, Ends(decided.layers.level_count) if follows else None
            # The search holds the positions of an only segment.
            block = [decided.source.block(index)] if len(decided.source.segments) > 1 else []
            yield index, block, before, ends

    def _positions(self, block: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Return what is coded of a block, and its very numbers if these are to come back."""
        return self.source.relative(block), self.source.exact(block) if self.options.lossless else None

    def _exact(self, segment: int) -> np.ndarray | None:
        return self.source.exact(self.source.block(segment)) if self.options.lossless else None

    def _add_motion(
        self, store: writing.ChunkStore, decided: Decided, coded: Iterable[CodedSegment]
    ) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """Return (levels, segments, 3) errors and (levels, segments) joins of the levels that are shown, and which of
        all they are. Raises ValueError unless each segment comes once."""
        levels, count = decided.layers.level_count + self.options.lossless, decided.segment_count
        errors, joins = np.zeros((levels, count, len(MEASURES))), np.zeros((levels, count), np.uint8)
        flaws, missing = np.zeros((levels, count, 2)), set(range(count))
        for segment in coded:
            if segment.index not in missing:
                raise ValueError(f"segments: got {segment.index} twice or beyond the last, expected each once")
            missing.remove(segment.index)
            errors[:, segment.index] = segment.errors + decided.source.replaced_error
            joins[:, segment.index] = segment.joins
            flaws[:, segment.index] = segment.flaws
            for (level, kind), payload in segment.chunks.items():
                store.add(kind, payload, level, segment.index)
            self.report("motion", 1 - len(missing) / count)
        if missing:
            raise ValueError(f"segments: got {count - len(missing)}, expected all {count}")
        frames = [[stop - start for start, stop in clip] for clip in decided.source.clip_range_segments]
        first_held = decided.layers.level_0.level_count - 1
        shown = chosen_levels(errors, frames, flaws, self.seen.diagonal, self.options.lossless, first_held)
        store.leave_out(lambda chunk: not decided.layers.level_0.serves(chunk.kind, chunk.level, shown))
        return errors[shown], joins[shown], shown


def _finished(begun: tuple[int, CodedMotion]) -> CodedSegment:
    """Return a segment whose first layer is coded. Its memory is freed, whoever holds it."""
    index, motion = begun
    motion.finish()
    coded = CodedSegment(index, motion.chunks, *map(np.array, (motion.errors, motion.joins, motion.flaws)))
    vars(motion).clear()
    return coded


def _polygons(clip: MotionClip, options: EncodingOptions) -> Polygons | None:
    """Return what is stored as FACES."""
    if options.attributes == "none":
        return None
    return Polygons.of_attributes(clip.attributes) if clip.faces is None else Polygons.of_rows(clip.faces)


def _summary(
    path: Path | None, job: EncodingJob, decided: Decided, result: _Result, chunks: list[ct.Chunk], decoder: Decoder
) -> Summary:
    sizes: dict[str, int] = {}
    for chunk in chunks:
        name = ct.KIND_NAMES[chunk.kind]
        sizes[name] = sizes.get(name, 0) + chunk.length
    sizes["HEADER"] = result.header.file_length - sum(sizes.values())
    settings, bound = decided.choice.settings, decided.choice.settings.bound
    choices = {
        "motion": "transformed" if not decided.choice.predicted else "predicted",
        "step_ratio": settings.step / bound,
        "rest_step_ratio": settings.rest_step / bound,
        "still": settings.still,
        "rotations": list(settings.rotation_step_factors),
        "learned": list(settings.learned_bases),
        "common_basis": settings.common_basis,
        "sheets": int((settings.forms == SHEET).sum()),
        "tubes": int((settings.forms > SHEET).sum()),
        "periodic": settings.periodic,
        "learned_pieces": 0 if settings.learned_pieces is None else int(settings.learned_pieces.sum()),
    }
    diagonal, raw = job.seen.diagonal, job.clip.frame_count * job.placed.source.vertex_count * 12
    return Summary(
        path,
        result.header.file_length,
        raw,
        settings.largest_bound,
        bound / diagonal if diagonal > 0 else 0.0,
        decoder.file.table1(),
        decoder.file.levels,
        sizes,
        choices,
        job.seams(decoder),
        None if job.branches is None else str(job.branches),
        job.clip.not_read,
        decided.choice.untried,
    )
