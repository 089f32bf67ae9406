"""One clip as the encoder codes it: hierarchy and rest pose under some settings, and the streams of one segment.

Both the search for settings (search.py) and the encoder itself call what is here. Everything is closed loop: pieces are
predicted from what the decoder will have, corrections are found on what it will output.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from weakref import WeakValueDictionary

import numpy as np

from athcodec._native import BRANCH, LOOSE, SHEET, WHOLE, Rounding, address, lib
from athcodec.decoding import container as ct
from athcodec.encoding import quantise as qz
from athcodec.encoding import streams
from athcodec.encoding.features import Feature
from athcodec.encoding.learned_modes import LearnedModes
from athcodec.encoding.motion import NODE_ROOT, STEM_ROOT, LevelStream, Plan, PlanSample, SegmentMotion, gather
from athcodec.encoding.polygons import Mesh
from athcodec.encoding.rigid import turn_of
from athcodec.encoding.segmentation import split_segments
from athcodec.encoding.shape import RestPrecision
from athcodec.encoding.survey import Ath, Survey
from athcodec.encoding.time_bases import Entries, InWaves, TimeComponents
from athcodec.errors import BoundError
from athcodec.files.threads import SERIAL, ThreadPool, default_jobs
from athcodec.motion.algebra import length, multiply
from athcodec.motion.clip import MotionClip, stands_still
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.polygons import Polygons

BEAM = 0  # form of a branch; others are SHEET, or a tube's vertices for each ring
FINER = 32  # step over that of segments that bases and modes are learned from
REST_ROUNDS = 16  # Steps of a rest pose that are tried until one keeps the bound; the last is 1/28 of the first.
ROWS_AT_ONCE = 1 << 14  # of coefficients
WORK_BYTES = 1 << 30  # of the segments coded at once, where `jobs` does not say how many these are
CONNECTED_SHARE = 0.8  # of a rest pose at once, that one by faces may take where layers refine it
SAMPLED = 4000  # vertices from which on trials correct a sample
SEGMENT_WORK = 16  # memory of a segment while it is coded, over its float32 positions


def thread_count(jobs: int | None, source: Source) -> int:
    """Segments, or candidates, that are coded at once: `jobs`, or one per core, at most 4 and within WORK_BYTES."""
    fit = WORK_BYTES // (SEGMENT_WORK * source.segment_bytes)
    return jobs or max(1, min(default_jobs(), fit))


@dataclass
class Source:
    """A clip in file order, relative to an origin, cut into segments, and the reference pose of its motion.

    exact_rest: the numbers of its rest pose are to come back. reference: (N, 3) float64 less the origin, file order;
    None: the rest pose. polygons: what the file stores as FACES. without: features that the file is to do without.
    """

    clip: MotionClip
    hierarchy: Hierarchy
    seen: Survey
    segment_frames: int | None
    exact_rest: bool
    weights: np.ndarray | None = None  # (N,) float64, factors on the bound; file order
    pool: ThreadPool = SERIAL
    host_rest: bool = False
    rest_precision: RestPrecision = RestPrecision()
    reference: np.ndarray | None = None
    polygons: Polygons | None = None
    without: frozenset[Feature] = frozenset()
    source_rest: np.ndarray = field(init=False)  # (N, 3) float64, less the origin
    rest: np.ndarray = field(init=False)  # likewise: the reference pose
    origin: np.ndarray = field(init=False)  # (3,) float64
    details: np.ndarray = field(init=False)  # (B,) int32: of the branches, FORMAT.md, Detail
    sheet_like: np.ndarray = field(init=False)  # (B,) bool: branches that do not look like beams
    clip_range_segments: list[list[tuple[int, int]]] = field(init=False)  # per clip of the file
    segments: list[tuple[int, int]] = field(init=False)  # of all of them
    _held: WeakValueDictionary[int, np.ndarray] = field(init=False, repr=False, compare=False)  # positions, by segment

    def __post_init__(self) -> None:
        stays_in_place = self.exact_rest and self.seen.repeats[1:].all()  # then its error may be 0 to the last bit
        is_exact = self.clip.dtype == np.float64 or stays_in_place
        first = self.clip.rest[self.hierarchy.vertex_source[0]]  # The rest pose of a rooted plant begins at 0.
        self.origin = qz.origin_of(first, self.seen.low, self.seen.high, is_exact)
        self.source_rest = self.clip.rest[self.hierarchy.vertex_source] - self.origin
        self.rest = self.source_rest if self.reference is None else self.reference
        self.sheet_like = ~_thin_branches(self)
        self.details = np.zeros(self.hierarchy.branch_count, np.int32)
        if not self.reference_is_exact:
            self.details = self.rest_precision.details(self.clip, self.hierarchy, self.seen.diagonal)
        self.clip_range_segments = [
            [
                (start + a, start + b)
                for a, b in split_segments(
                    stop - start, self.clip.vertex_count, self.segment_frames, ct.Limits.memory_bytes
                )
            ]
            for start, stop in self.clip.clip_range_frames
        ]
        self.segments = [segment for segments in self.clip_range_segments for segment in segments]
        self._held = WeakValueDictionary()

    @property
    def has_seams(self) -> bool:
        """Whether segments meet."""
        return len(self.segments) > len(self.clip_range_segments)

    def about(self, reference: np.ndarray | None) -> Source:
        """The same about another reference pose."""
        if reference is None and self.reference is None:
            return self
        source = self._changed(reference=reference)
        source.clip_range_segments, source.segments = self.clip_range_segments, self.segments
        source._held = self._held
        return source

    def in_segments(self, frames: int) -> Source:
        """The same in other segments, of at most so many frames."""
        return self._changed(segment_frames=frames)

    def _changed(self, **fields) -> Source:
        source = replace(self, **fields)
        source.still = self.still  # for which frames are read
        if len(self.segments) == len(source.segments) == 1:
            source._all_positions = self._all_positions
        return source

    @property
    def reference_is_exact(self) -> bool:
        """Whether the reference pose is the rest pose in its very numbers."""
        return self.exact_rest and self.reference is None

    @property
    def has_source_rest(self) -> bool:
        """Whether the rest pose is to come back, and is another than the reference pose."""
        return self.reference is not None and (self.clip.rest_given or self.exact_rest)

    @property
    def clip_range_starts(self) -> list[int]:
        """The first segment of each clip of the file."""
        return np.cumsum([0, *map(len, self.clip_range_segments[:-1])]).tolist()

    def segment_before(self, segment: int) -> int | None:
        """The one before it in its clip; before the first of a loop of several, the last."""
        for i, (start, own) in enumerate(zip(self.clip_range_starts, self.clip_range_segments)):
            if start == segment:
                loop = len(own) > 1 and bool(self.clip.clip_ranges) and self.clip.clip_ranges[i].loop
                return start + len(own) - 1 if loop else None
        return segment - 1

    def goes_on(self, segment: int) -> bool:
        """Whether a segment of the same clip is behind it."""
        following = {segment + 1, *self.clip_range_starts} - {len(self.segments)}
        return any(self.segment_before(other) == segment for other in following)

    @cached_property
    def mesh(self) -> Mesh | None:
        """What rest poses may go by."""
        if Feature.CONNECTED in self.without:
            return None
        return Mesh.of(self.polygons, self.hierarchy.vertex_source)

    @cached_property
    def still(self) -> bool:
        """Whether all frames are the rest pose."""
        return stands_still(self.clip)

    @property
    def largest_number(self) -> np.floating:
        """Of the coordinates, in the source's type."""
        return np.abs([self.seen.low, self.seen.high]).max().astype(self.clip.dtype)

    @property
    def extent(self) -> float:
        """Diagonal of the box around all frames and the rest pose: the longest way a vertex can be from its place."""
        low = np.minimum(self.seen.low, self.source_rest.min(axis=0) + self.origin)
        high = np.maximum(self.seen.high, self.source_rest.max(axis=0) + self.origin)
        return length(high - low)

    def limit(self, bound: float) -> float | np.ndarray:
        """What decoded positions are held to: one for all vertices, or one each, (N,) in file order."""
        if self.weights is None:
            return qz.error_limit(bound, self.seen.diagonal)
        return np.array([qz.error_limit(limit, self.seen.diagonal) for limit in bound * self.weights])

    def smallest_bound(self, bound: float) -> float:
        """Of any vertex."""
        return bound if self.weights is None else bound * float(self.weights.min())

    def largest_bound(self, bound: float) -> float:
        """Of any vertex."""
        return bound if self.weights is None else bound * float(self.weights.max())

    def level_weights(self, levels: int, part: float) -> np.ndarray:
        """(levels,) of the vertices of each level and those below it the weight that such a part of them falls short
        of; a level without vertices has that of the one above."""
        level = self.hierarchy.branch_depth[self.hierarchy.vertex_branch()]
        below = [self.weights[level >= first] for first in range(levels)]
        quantiles = [float(np.quantile(weights, part)) if len(weights) else 0.0 for weights in below]
        return np.maximum.accumulate(quantiles)

    def is_whole_loop(self, segment: int) -> bool:
        """Whether the segment is all of a clip that is a loop."""
        of_clips = zip(self.clip.clip_ranges, self.clip_range_segments)
        return any(clip_range.loop and own == [self.segments[segment]] for clip_range, own in of_clips)

    @property
    def segment_bytes(self) -> int:
        """Of the float32 positions of the longest segment."""
        return 12 * self.clip.vertex_count * max(stop - start for start, stop in self.segments)

    @cached_property
    def repeats(self) -> np.ndarray:
        """(frames,) bool: frames of the clip that are not coded, because the one before in their segment is the same.
        Where all are the rest pose none is: that takes no bytes either."""
        repeats = self.seen.repeats & (not self.still and Feature.REPEATS not in self.without)
        repeats[[start for start, _ in self.segments]] = False
        return repeats

    @property
    def coded_frames(self) -> int:
        """Of the clip."""
        return int((~self.repeats).sum())

    def frames_of(self, segment: int) -> int:
        """Coded frames of a segment, T."""
        return int((~self.repeats[slice(*self.segments[segment])]).sum())

    def shown_times(self, segment: int) -> np.ndarray:
        """(T,) int32: how many frames of the clip show each coded frame of a segment."""
        repeats = self.repeats[slice(*self.segments[segment])]
        return np.diff(np.append(np.flatnonzero(~repeats), len(repeats))).astype(np.int32)

    def block(self, segment: int) -> np.ndarray:
        """(T, N, 3) positions of a segment as the clip has them, of the frames that are coded."""
        block, repeats = self.clip.block(*self.segments[segment]), self.repeats[slice(*self.segments[segment])]
        return block[~repeats] if repeats.any() else block

    def exact(self, block: np.ndarray) -> np.ndarray:
        """(N, 3, T) of a block in file order, its very numbers."""
        return np.ascontiguousarray(block[:, self.hierarchy.vertex_source].transpose(1, 2, 0))

    def relative(self, block: np.ndarray) -> np.ndarray:
        """(N, 3, T) float64 of a block in file order, less the origin."""
        return gather(block, self.hierarchy.vertex_source, self.origin, self.pool)

    def positions(self, segment: int) -> np.ndarray:
        """(N, 3, T) float64 positions of a segment, less the origin: made once for all who hold them at a time."""
        if len(self.segments) == 1:
            return self._all_positions
        positions = self._held.get(segment)
        if positions is None:
            self._held[segment] = positions = self.relative(self.block(segment))
            positions.setflags(write=False)
        return positions

    @cached_property
    def _all_positions(self) -> np.ndarray:
        """Of the only segment, which a search asks for again and again."""
        positions = self.relative(self.block(0))
        positions.setflags(write=False)
        return positions


@dataclass(frozen=True)
class Settings:
    """What a trial varies; steps in scene units."""

    bound: float
    largest_bound: float  # of any vertex
    limit: float | np.ndarray  # what the positions of each vertex, (N,), are held to
    step: float
    level_steps: np.ndarray  # (levels,) factors on it
    rest_step: float
    forms: np.ndarray  # (B,) int32, file order: BEAM, SHEET, or the vertices of each ring of a tube
    loose: np.ndarray  # (B,) bool, file order
    rigid: np.ndarray  # (B,) int32: in how many layers, from the first on, branches are rigid
    layer: int  # that these settings are of
    free_rigid: bool  # rigid branches are loose
    turn_step: float  # largest of rotations of rigid pieces
    lags: np.ndarray  # (B,) int32, file order
    details: np.ndarray  # likewise
    connected_rest: bool
    rotation_step_factors: tuple[int, ...]  # per level: rotation factors
    learned_bases: tuple[bool, ...]  # per level: whether the time basis is
    common_basis: bool  # these levels share one, else each has its own
    learned_pieces: np.ndarray | None  # (P,) bool: pieces that have learned modes; None: none has
    node_steps: np.ndarray  # (levels,) of the maps of nodes, scene units; see SegmentMotion.analyse_nodes
    rest_slack: float = 0.0  # what the rest pose may be off by, to save bits
    shape_of: np.ndarray | None = None  # (B,) of streams.find_copies; None: the rest pose has no copies
    periodic: bool = False  # waves over time are, of loops that are one segment
    usual_change: float = np.inf  # of velocity, in length per frame squared, where segments meet
    without: frozenset[Feature] = frozenset()  # features that the file does without

    @property
    def learning_levels(self) -> list[int]:
        """Levels that learn their time bases."""
        return [level for level, learned in enumerate(self.learned_bases) if learned]

    @property
    def rounding(self) -> Rounding:
        """How numbers become integers."""
        return Rounding(qz.DEAD_ZONE, qz.end_weights(self._relative_change))

    @property
    def _relative_change(self) -> float:
        """usual_change over the bound."""
        return self.usual_change / float(np.min(self.limit))

    @property
    def is_straight(self) -> bool:
        """Whether rows end in straight lines, as modes of a beam do, and not in parabolas."""
        return self._relative_change < qz.STRAIGHT and Feature.STRAIGHT not in self.without

    def step_of(self, level: int) -> float:
        """Of the stems of a level."""
        return qz.single(self.step * self.level_steps[level])

    def of_segment(self, whole_loop: bool) -> Settings:
        """The same for a segment, which is all of a loop or not."""
        return replace(self, periodic=self.periodic and whole_loop)


def branch_records(hierarchy: Hierarchy, ath: Ath, settings: Settings) -> np.ndarray:
    """(B,) of _native.BRANCH."""
    branches = np.zeros(hierarchy.branch_count, BRANCH)
    branches["parent"], branches["count"] = hierarchy.branch_parent, hierarchy.stem_count
    branches["attach"], branches["first"] = hierarchy.attach, hierarchy.first_vertex
    free = settings.free_rigid & (settings.rigid > settings.layer) & (hierarchy.branch_parent >= 0)
    branches["flags"] = (
        SHEET * (settings.forms != BEAM) + WHOLE * ath.whole_branches() + LOOSE * (settings.loose | free)
    )
    branches["rigid"] = settings.rigid
    branches["lag"], branches["detail"] = settings.lags, settings.details
    branches["ring"] = np.where(settings.forms > SHEET, settings.forms, 0)
    return branches


def uncoded_plan(source: Source, ath: Ath, settings: Settings) -> Plan:
    """The plan on the rest pose before it is coded. Poses and modes are learned on it, because they would else describe
    the rounding of the coded pose as well."""
    branches = branch_records(source.hierarchy, ath, settings)
    plan = Plan(branches, source.hierarchy.vertex_count, source.pool, layer=settings.layer)
    plan.set_rest(source.rest)
    return plan


class CodedPrelude:
    """Hierarchy and rest pose as the decoder will have them, for one choice of settings."""

    def __init__(self, source: Source, ath: Ath, settings: Settings, predicted: bool = False):
        hierarchy = source.hierarchy
        self.origin, self.dtype = source.origin, np.dtype(source.clip.dtype)
        branches = branch_records(hierarchy, ath, settings)
        self.plan = Plan(branches, hierarchy.vertex_count, source.pool, predicted=predicted, layer=settings.layer)
        self.shape_of = settings.shape_of
        self.rest_chunk, rest = _coded_rest(source, branches, settings)
        self.plan.set_rest(rest)
        self.hierarchy_stream = streams.encode_hierarchy(branches, hierarchy.branch_source, hierarchy.vertex_source)
        self.source_rest = code_source_rest(source, branches, self.plan.rest, settings.bound)
        self.prelude_bytes = len(self.hierarchy_stream) + len(self.rest_chunk.stream) + len(self.source_rest)

    @property
    def output(self) -> tuple[np.ndarray, np.dtype]:
        """Origin and type of decoded positions."""
        return self.origin, self.dtype


def _coded_rest(source: Source, branches: np.ndarray, settings: Settings) -> tuple[ct.Rest, np.ndarray]:
    """REST, and the rest pose as decoded."""
    head = ct.Rest(source.origin, settings.rest_step, source.clip.rest_dtype)
    if source.host_rest:
        head.is_host, head.step, head.stream = True, 1.0, ct.mesh_checksum(source.clip.source_rest)
        return head, source.rest
    if source.reference_is_exact:
        pose = source.clip.source_rest[source.hierarchy.vertex_source]
        head.exact, head.connected = True, settings.connected_rest
        head.stream = streams.encode_exact_rest(branches, pose, source.mesh if head.connected else None)
        return head, pose.astype(np.float64) - source.origin
    coded = _rest_within(source, branches, settings)
    head.step, head.stream, head.connected = coded.step, coded.stream, coded.connected
    return head, coded.decoded


def _rest_within(source: Source, branches: np.ndarray, settings: Settings) -> streams.CodedRest:
    """At the step of the settings, or the first finer one that keeps the bound."""

    def encode(step: float) -> streams.CodedRest:
        mesh = source.mesh if settings.connected_rest else None
        return streams.encode_rest(branches, step, source.rest, None, settings.rest_slack, mesh, settings.shape_of)

    return _within(settings.bound, source.rest, encode, settings.rest_step)


def _within(
    limit: float, pose: np.ndarray, encode: Callable[[float], streams.CodedRest], step: float
) -> streams.CodedRest:
    """At a step, or the first finer one by which no vertex is further from the pose than the limit. Raises BoundError
    where none is: integers of steps that fine do not reach all places."""
    for _ in range(REST_ROUNDS):
        coded = encode(step)
        if np.linalg.norm(coded.decoded - pose, axis=1).max() <= limit:
            return coded
        step = qz.single(0.8 * step)
    raise BoundError(f"max error: got {limit:.3g}; the rest pose cannot be kept within it")


def with_best_lags(source: Source, ath: Ath, settings: Settings) -> Settings:
    """The lags, connected or not, and the copies that make hierarchy and rest pose smallest."""
    settings = replace(settings, shape_of=None)
    own = lags(source, settings.rest_step, settings.details)
    candidates = [replace(settings, lags=own, connected_rest=False)]
    if not source.reference_is_exact:
        candidates += _lag_candidates(source, settings, own)
    if source.mesh is not None and not source.host_rest:
        candidates += [replace(settings, lags=lag, connected_rest=True) for lag in (own, np.ones_like(own))]
    if not source.reference_is_exact:
        candidates += _with_copies(source, ath, candidates)
    return candidates[0] if len(candidates) == 1 else min(candidates, key=lambda some: _poses_size(source, ath, some))


def _with_copies(source: Source, ath: Ath, candidates: list[Settings]) -> list[Settings]:
    """The candidates with branches that are copies of others, where there are any."""
    if Feature.COPIES in source.without:
        return []
    own, branches = candidates[0], branch_records(source.hierarchy, ath, candidates[0])
    shape_of = streams.find_copies(branches, own.rest_step, source.rest, own.rest_slack)
    return [] if shape_of is None else [replace(settings, shape_of=shape_of) for settings in candidates]


def _poses_size(source: Source, ath: Ath, settings: Settings) -> float:
    """Bytes of hierarchy and rest pose; infinite where the pose cannot be kept within the bound."""
    hierarchy, branches = source.hierarchy, branch_records(source.hierarchy, ath, settings)
    stream = streams.encode_hierarchy(branches, hierarchy.branch_source, hierarchy.vertex_source)
    try:
        return len(stream) + len(_coded_rest(source, branches, settings)[0].stream)
    except BoundError:
        return math.inf


def with_connected_rest(source: Source, ath: Ath, settings: Settings) -> Settings:
    """For layers: a rest pose that goes by faces where that is much smaller at once, or the one given."""
    if source.mesh is None or source.host_rest:
        return settings
    connected = replace(settings, connected_rest=True)
    share = 1.0 if source.reference_is_exact else CONNECTED_SHARE
    much = _poses_size(source, ath, connected) < share * _poses_size(source, ath, settings)
    return connected if much else settings


def _lag_candidates(source: Source, settings: Settings, own: np.ndarray) -> list[Settings]:
    """Beams or not, the lags of stems or one for all; short stems as such whose vertices differ by their numbers."""
    count, no_beam = source.hierarchy.stem_count, np.maximum(own, 1)
    some = [np.minimum(own, 1), no_beam, np.ones_like(own), np.where(count <= qz.SHORT_STEM, count, no_beam)]
    if source.still:
        some += [np.full_like(own, 3), np.full_like(own, 4), np.minimum(2 * no_beam, 65535)]
    tried = {lag.astype(np.int32).tobytes() for lag in some} - {own.tobytes()}
    return [replace(settings, lags=np.frombuffer(lag, np.int32), connected_rest=False) for lag in sorted(tried)]


def code_source_rest(source: Source, branches: np.ndarray, reference: np.ndarray, bound: float) -> bytes:
    """SOURCE_REST about the reference pose as decoded, (N, 3) float64 less the origin; empty where none is needed."""
    if not source.has_source_rest:
        return b""
    if source.exact_rest:
        pose = source.clip.source_rest[source.hierarchy.vertex_source]
        return ct.pack_exact_source_rest(streams.encode_exact_rest(branches, pose))
    tolerance = max(bound, qz.SOURCE_REST_TOLERANCE * source.seen.diagonal)
    pose = source.source_rest

    def encode(step: float) -> streams.CodedRest:
        return streams.encode_source_rest(branches, step, reference, pose)

    coded = _within(tolerance, pose, encode, qz.single(qz.SOURCE_REST_STEP * tolerance))
    return ct.pack_source_rest(coded.step, coded.stream)


def lags(source: Source, step: float, details: np.ndarray) -> np.ndarray:
    """Predictors of the rest pose, (B,): 0, a beam's modes, or the lag that does best elsewhere."""
    hierarchy = source.hierarchy
    lags = np.zeros(hierarchy.branch_count, np.int32)
    for b in np.flatnonzero((source.sheet_like | (details > 0)) & (not source.host_rest)):
        first, count = hierarchy.first_vertex[b], hierarchy.stem_count[b]
        attach = hierarchy.attach[b]
        lags[b] = qz.rest_lag(source.rest[first : first + count], source.rest[attach] if attach >= 0 else None, step)
    return lags


def loose_branches(source: Source, sample: np.ndarray) -> np.ndarray:
    """Branches whose base leaves its attach point by more than their own size: fallen leaves, separate parts."""
    if Feature.LOOSE in source.without:
        return np.zeros(source.hierarchy.branch_count, bool)
    hierarchy, rest = source.hierarchy, source.rest
    first, attach = hierarchy.first_vertex, np.maximum(hierarchy.attach, 0)
    gap = np.linalg.norm(sample[first] - sample[attach], axis=1)
    rest_gap = np.linalg.norm(rest[first] - rest[attach], axis=1)
    stretch = np.abs(gap - rest_gap[:, None]).max(axis=1)
    return (hierarchy.attach >= 0) & (stretch > np.maximum(_stem_sizes(source), rest_gap))


def _stem_sizes(source: Source) -> np.ndarray:
    """Diagonals of the stems' bounding boxes in the rest pose, (B,)."""
    first = source.hierarchy.first_vertex
    return np.linalg.norm(np.maximum.reduceat(source.rest, first) - np.minimum.reduceat(source.rest, first), axis=1)


def _thin_branches(source: Source) -> np.ndarray:
    """Branches that look like beams: the way along their vertices is not much longer than they are wide."""
    hierarchy, rest = source.hierarchy, source.rest
    first = hierarchy.first_vertex
    steps = np.zeros(len(rest))
    steps[1:] = np.linalg.norm(np.diff(rest, axis=0), axis=1)
    steps[first] = 0.0
    way = np.add.reduceat(steps, first)
    return way <= 1.3 * _stem_sizes(source)


@dataclass(frozen=True)
class StreamBasis:
    """The learned time basis of a stream; root as in LevelStream. It begins with the `known` rows of the stream of
    another level, if any."""

    stored: Entries | InWaves
    root: int
    known: int = 0
    base: int = ct.NO_LEVEL


def level_streams(settings: Settings, levels: int, bases: dict[int, StreamBasis]) -> list[LevelStream]:
    found = []
    for level in range(levels):
        factor = float(settings.rotation_step_factors[level])
        root = NODE_ROOT if settings.is_straight else STEM_ROOT
        stream = LevelStream(settings.step_of(level), factor, turn_step=settings.turn_step, root=root)
        if level in bases:
            stream.temporal, stream.root = bases[level].stored.rows, bases[level].root
        found.append(stream)
    return found


def _level_moments(segment: SegmentMotion, level: int | None) -> tuple[np.ndarray, int]:
    """Second moments over time, (T, T), of those tracks of one level's stream, or of all, that do not quantise to
    nothing, in units of their steps, and how many they are; of a segment that was analysed finely, in no learned
    basis."""
    if level is None:
        return _moments(segment, [segment.coefficients, segment.tracks])
    pieces, slots = segment.plan.pieces, []
    for low, high, at in (
        (0, pieces["low_modes"], pieces["low_level"]),
        (pieces["low_modes"], pieces["count"], pieces["level"]),
    ):
        for piece in np.flatnonzero(at == level):
            start = low if np.isscalar(low) else low[piece]
            slots.append(np.arange(pieces["first"][piece] + start, pieces["first"][piece] + high[piece]))
    chosen = np.concatenate(slots) if slots else np.zeros(0, int)
    parts = (segment.coefficients[chosen[at : at + ROWS_AT_ONCE]] for at in range(0, len(chosen), ROWS_AT_ONCE))
    return _moments(segment, (*parts, segment.tracks[segment.plan.base_level == level]))


def _moments(segment: SegmentMotion, parts: Iterable[np.ndarray]) -> tuple[np.ndarray, int]:
    lower, count, least = np.zeros((segment.frames, segment.frames)), 0, (FINER * qz.DEAD_ZONE) ** 2
    for part in parts:
        rows = part.reshape(-1, segment.frames)
        into = address(rows, np.int32, rows.size), least, address(lower, np.float64, lower.size)
        count += lib.ath_add_moments(len(rows), segment.frames, *into)
    moments, waves = (np.tril(lower) + np.tril(lower, -1).T) / FINER**2, segment.waves_of(segment.streams[0])
    return multiply(waves.T, multiply(moments, waves)), count


def analyse_finely(plan: Plan, settings: Settings, positions: np.ndarray) -> SegmentMotion:
    """A segment at a step FINER times smaller, in nothing learned, to learn bases and modes from."""
    fine = replace(settings, step=qz.single(settings.step / FINER), turn_step=settings.turn_step / FINER)
    segment = SegmentMotion(
        plan, positions.shape[2], level_streams(fine, plan.level_count, {}), periodic=settings.periodic
    )
    segment.analyse(positions, Rounding(qz.DEAD_ZONE))
    return segment


def time_components(
    plan: Plan, settings: Settings, positions: np.ndarray, levels: Sequence[int | None]
) -> dict[int | None, TimeComponents]:
    """Of some levels, None: of all that moves, from a finer pass."""
    if not levels:
        return {}
    segment = analyse_finely(plan, settings, positions)
    may_be_in_waves = Feature.WAVE_BASES not in settings.without
    return {level: TimeComponents(*_level_moments(segment, level), segment.waves, may_be_in_waves) for level in levels}


def level_bases(
    plan: Plan, settings: Settings, components: dict[int | None, TimeComponents], ratio: float = 1.0
) -> dict[int, StreamBasis]:
    """Of the levels that learn theirs, for steps `ratio` times those of the components: each its own, or that of all,
    which lies with the first of them."""
    levels = [level for level in settings.learning_levels if plan.has_stems(level)]
    if not settings.common_basis:
        bases = {level: components[level].basis(ratio, ratio) for level in levels}
        return {level: StreamBasis(basis, level) for level, basis in bases.items() if basis is not None}
    basis = components[None].basis(ratio, ratio)
    if basis is None:
        return {}
    first, *others = levels
    return {first: StreamBasis(basis, first)} | {
        level: StreamBasis(basis, first, len(basis.rows), first) for level in others
    }


def basis_ratio(plan: Plan, settings: Settings, ratio: float) -> float:
    """By how much rows may be coarser than where a time basis was learned, at steps `ratio` times as fine: by less
    where the turns of rigid pieces have a largest step."""
    levers = plan.levers()[plan.is_rigid]
    if not settings.turn_step or not levers.any():
        return ratio
    steps = np.minimum(settings.step / levers[levers > 0], settings.turn_step)
    finest = np.minimum(settings.step / ratio / levers[levers > 0], settings.turn_step)
    return float(np.sqrt(np.mean((steps / finest) ** 2)))


def learned_bases(plan: Plan, settings: Settings, positions: np.ndarray) -> dict[int, StreamBasis]:
    """Of the levels that learn theirs."""
    levels = [None] if settings.common_basis and any(settings.learned_bases) else settings.learning_levels
    return level_bases(plan, settings, time_components(plan, settings, positions, levels))


@dataclass(frozen=True)
class Corrections:
    """Those of positions of a shape, (N, 3, T): rows (K, 6) int32, and their step."""

    rows: np.ndarray
    step: float
    shape: tuple[int, ...]

    @cached_property
    def chunk(self) -> bytes:
        """CORRECTIONS; empty where there are none."""
        if not len(self.rows):
            return b""
        return ct.pack_corrections(self.step, streams.encode_corrections(self.rows, self.shape[0], self.shape[2]))

    def applied(self, decoded: np.ndarray) -> np.ndarray:
        """The positions as they are with them."""
        corrected = decoded.copy()
        streams.apply_corrections(corrected, self.rows, self.step)
        return corrected


@dataclass
class Coded:
    """The stems of one segment: integers, streams by level, and corrections of a sample of its vertices."""

    segment: SegmentMotion
    stems: dict[int, bytes]
    corrections: Corrections
    sample: np.ndarray  # (n,) vertices, in whose numbers the corrections are
    heads: dict[int, int]  # bytes of each stream that are the same for few pieces and for many: its time basis

    @property
    def corrected(self) -> np.ndarray:
        """(K,) the vertex of each correction."""
        return self.sample[self.corrections.rows[:, 0]]

    @property
    def sample_share(self) -> float:
        """Of the vertices."""
        return len(self.sample) / self.segment.plan.vertex_count


def analyse(
    plan: Plan,
    output: tuple[np.ndarray, np.dtype],
    settings: Settings,
    positions: np.ndarray,
    learned_modes: LearnedModes | None,
    bases: dict[int, StreamBasis],
    before: SegmentMotion | None = None,
    ratio: int = 1,
    layered: bool = False,
) -> tuple[SegmentMotion, np.ndarray]:
    """The integers of the stems, and the positions at the last level without corrections; output: the origin and the
    type of these. bases: of the levels that learn theirs; before, ratio, layered: as SegmentMotion has them."""
    own = level_streams(settings, plan.level_count, bases)
    segment = SegmentMotion(plan, positions.shape[2], own, learned_modes, before, ratio, layered, settings.periodic)
    origin, dtype = output
    decoded = np.empty(positions.shape, dtype)
    segment.analyse(positions, settings.rounding, origin, decoded)
    if before is not None:
        segment.forget_caches()  # a refinement has no nodes
    return segment, decoded


def stems_head(settings: Settings, level: int, bases: dict[int, StreamBasis]) -> ct.StemsHead:
    """Of the stems of a level, whose time basis is among `bases` where it is learned."""
    head = ct.StemsHead(
        settings.step_of(level),
        settings.rotation_step_factors[level],
        turn=turn_of(settings.turn_step),
        basis_kind=ct.NODE_WAVES if settings.is_straight else ct.STEM_WAVES,
    )
    if level in bases:
        own = bases[level]
        head.basis_kind, head.rank, head.base = own.stored.kind, len(own.stored.rows), own.base
        head.basis = own.stored.stream(own.known)
    return head


def stem_streams(segment: SegmentMotion, settings: Settings, bases: dict[int, StreamBasis]) -> tuple[dict, dict]:
    """STEMS of the levels of a first layer, and the bytes of their time bases."""
    plan = segment.plan

    def stem_stream(level: int) -> tuple[bytes, int]:
        head = stems_head(settings, level, bases)
        return ct.pack_stems(head, streams.encode_stems(segment, level)), len(head.basis)

    levels = [level for level in range(plan.level_count) if plan.has_stems(level)]
    coded = plan.pool.map(stem_stream, [(level,) for level in levels])
    stems, heads = (dict(zip(levels, column)) for column in zip(*coded))
    return stems, heads


def correction_step(limit: float | np.ndarray) -> float:
    """That is tried first."""
    return qz.single(qz.CORRECTION_STEP * float(np.min(limit)))


def find_corrections(
    decoded: np.ndarray,
    positions: np.ndarray,
    origin: np.ndarray,
    settings: Settings,
    plan: Plan | PlanSample,
    keeps_all: bool = True,
    ends: streams.MetEnds = streams.FREE_ENDS,
) -> Corrections:
    """Those that keep the limit; those of a rigid part, or of a ring, move all of it where that serves, and else,
    unless each vertex of a rigid part is to keep the limit, it has none. ends: what they meet; in the step of
    correction_step. Raises BoundError."""
    factor, is_rigid = 1.0, np.repeat(plan.is_rigid, plan.pieces["count"])
    is_narrow = Feature.WIDE in settings.without
    parts = _parts_that_keep_their_shape(plan)
    limit = settings.limit if keeps_all else np.where(is_rigid, np.inf, settings.limit)
    while True:
        step = qz.single(correction_step(settings.limit) * factor)
        moves = streams.find_rigid_corrections(
            parts, decoded, positions, origin, settings.limit, step, plan.pool, is_narrow, ends.closed
        )
        met = ends.with_moves(moves)
        rows = streams.find_corrections(decoded, positions, origin, limit, step, plan.pool, is_narrow, met)
        if rows is not None:
            return Corrections(rows, step, decoded.shape)
        factor, ends = 0.5 * factor, streams.FREE_ENDS
        if factor < 1e-3:
            raise BoundError(
                f"max error: got {settings.bound:.3g}; it cannot be kept in the output's {decoded.dtype.name} numbers"
            )


def _parts_that_keep_their_shape(plan: Plan | PlanSample) -> tuple[np.ndarray, np.ndarray]:
    """First vertices and numbers of vertices of rigid pieces, and of the rings of others."""
    rigid, tubes = plan.pieces[plan.is_rigid], plan.pieces[~plan.is_rigid & (plan.pieces["ring"] > 0)]
    count = -(-tubes["count"] // np.maximum(tubes["ring"], 1))
    rings, number = np.repeat(tubes, count), np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    offset = number * rings["ring"]
    size = np.minimum(rings["ring"], rings["count"] - offset)
    return np.append(rigid["first"], rings["first"] + offset), np.append(rigid["count"], size)


def code_stems(
    prelude: CodedPrelude,
    settings: Settings,
    positions: np.ndarray,
    learned_modes: LearnedModes | None,
    bases: dict[int, StreamBasis] | None = None,
) -> Coded:
    """Streams of the stems of a single layer and the corrections that keep the limit, of a sample where there are many
    vertices. bases: None: to be learned."""
    if bases is None:
        bases = learned_bases(prelude.plan, settings, positions)
    segment, decoded = analyse(prelude.plan, prelude.output, settings, positions, learned_modes, bases)
    stems, heads = stem_streams(segment, settings, bases)
    some = prelude.plan.sample if prelude.plan.vertex_count >= SAMPLED else None
    if some is None:
        corrections = find_corrections(decoded, positions, prelude.origin, settings, prelude.plan)
        return Coded(segment, stems, corrections, np.arange(len(decoded)), heads)
    at, limit = some.vertices, settings.limit
    own = replace(settings, limit=limit if np.isscalar(limit) else limit[at])
    corrections = find_corrections(decoded[at], positions[at], prelude.origin, own, some)
    return Coded(segment, stems, corrections, at, heads)
