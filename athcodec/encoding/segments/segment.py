"""One clip as the encoder codes it: hierarchy and rest pose under some settings, and the streams of one segment.

This is one module because a segment is coded in a closed loop: its streams, the poses that they are coded about and the
corrections of what is decoded again need each other. What several layers or segments share is in the modules beside it.

Both the search for settings (search/) and the encoder itself call what is here. Everything is closed loop: pieces are
predicted from what the decoder will have, corrections are found on what it will output.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from athcodec._native import BRANCH, LOOSE, RIGID, SHEET, STILL, WHOLE, Rounding, address, lib
from athcodec.decoding import container as ct
from athcodec.encoding.clip.coded_clip import CodedClip
from athcodec.encoding.clip.survey import Ath, Survey
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.motion import LearnedModes, Plan, PlanSample, SegmentMotion, StageStream, gather, zeros
from athcodec.encoding.options.features import Feature
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.options.shape import RestPrecision, finer_than
from athcodec.encoding.segments.segmentation import split_segments
from athcodec.encoding.segments.settings import BEAM, Settings
from athcodec.encoding.segments.time_bases import Entries, InWaves, TimeComponents, TrackMoments
from athcodec.encoding.streams import streams, writing
from athcodec.encoding.streams.polygons import Mesh
from athcodec.errors import BoundError
from athcodec.files.threads import SERIAL, ThreadPool, default_jobs, ranges
from athcodec.motion.algebra import largest_distance, length, multiply
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.polygons import Polygons

FINER = 32  # Step of a layer over the step at which bases and modes are learned.
REST_ROUNDS = 16  # Steps of a rest pose that are tried until one keeps the bound; the last is 1/28 of the first.
ROWS_AT_ONCE = 1 << 14  # Rows of coefficients whose moments are added at once.
LEAST_THREADED = 16 << 20  # Bytes of a segment from which a clip of one segment is coded by several threads.
WORK_BYTES = 1 << 28  # Memory of the segments coded at once, unless `jobs` says how many.
SAMPLED = 4000  # Number of vertices from which trials find corrections of a sample of them only.
LEAST_SAMPLED = 256  # Vertices from which on a part of them is enough if many frames are to be corrected.
SPARSE = 16  # Vertices of which one is in the smallest such part.
SPREAD = 512  # Vertices all over the plant of which frames beyond the limit are counted.
MANY = 8000  # Frames of vertices beyond the limit that are many.
MANY_SHARE = 0.06  # More of them for each frame of a vertex that is coded.
SEGMENT_WORK = 9  # Memory of a segment while it is coded, over its float32 positions.


def thread_count(jobs: int | None, source: Source) -> int:
    """Return how many segments are coded at once: `jobs`, or one per core, at most 4 and within WORK_BYTES. Threads of
    small clips would mostly wait for each other."""
    if len(source.segments) == 1 and source.segment_bytes < LEAST_THREADED:
        return jobs or 1
    return jobs or max(1, min(default_jobs(), WORK_BYTES // (SEGMENT_WORK * source.segment_bytes)))


@dataclass
class Source:
    """A clip in file order, relative to an origin, cut into segments, and the reference pose of its motion.

    It answers what can be asked of a clip before any setting is known: positions, limits of error, and which frames
    of a segment are coded. Its methods are many and short, and all follow from these fields.
    """

    clip: CodedClip
    seen: Survey
    segment_frames: int | None
    pool: ThreadPool = SERIAL
    rest_precision: RestPrecision = RestPrecision()
    reference: np.ndarray | None = None  # (N, 3) float64 less the origin; None: the rest pose.
    held: np.ndarray | None = None  # (frames,) bool: frames that the pose before them stands for; None: repeats alone.
    held_error: float = 0.0  # Largest distance of any vertex in a held frame from the pose that stands for it.
    without: frozenset[Feature] = frozenset()  # Features that the file does without.
    shapes: tuple[np.ndarray, np.ndarray] | None = None  # Details and keeps_shape of an inexact reference, if known.
    whole: tuple[Source, np.ndarray] | None = None  # The source that this is a sample of, and its vertices there.
    still_branches: np.ndarray | None = None  # (B,) bool: branches whose motion is not looked at; None: there are none.
    source_rest: np.ndarray = field(init=False)  # (N, 3) float64 less the origin.
    rest: np.ndarray = field(init=False)  # (N, 3) float64 less the origin: the reference pose.
    origin: np.ndarray = field(init=False)  # (3,) float64
    details: np.ndarray = field(init=False)  # (B,) int32 (FORMAT.md, Detail).
    keeps_shape: np.ndarray = field(init=False)  # (B,) bool: branches whose faces are to keep their shape.
    rest_error: float = field(init=False)  # Largest error of the rest pose that is asked for; infinite: none is.
    sheet_like: np.ndarray = field(init=False)  # (B,) bool: branches that do not look like beams.
    clip_range_segments: list[list[tuple[int, int]]] = field(init=False)  # Segments of each clip of the file.
    segments: list[tuple[int, int]] = field(init=False)  # Segments of all clips.
    _held: WeakValueDictionary[int, np.ndarray] = field(init=False, repr=False, compare=False)  # Positions by segment.
    _only: list[np.ndarray] = field(init=False, repr=False, compare=False)  # Those of an only segment, once read.

    def __post_init__(self) -> None:
        """Derive from the clip and its survey what no setting changes: origin, rest pose, forms, precision of branches,
        and segments.
        """
        stays_in_place = self.exact_rest and bool(self.seen.repeats[1:].all())
        is_exact = self.clip.dtype == np.float64 or stays_in_place  # Then the error may be 0 to the last bit.
        first = self.clip.rest[self.hierarchy.vertex_source[0]]  # The rest pose of a rooted plant begins at 0.
        self.origin = qz.origin_of(first, self.seen.low, self.seen.high, is_exact)
        self.source_rest = self.clip.rest[self.hierarchy.vertex_source] - self.origin
        self.rest = self.source_rest if self.reference is None else self.reference
        self.sheet_like = ~_thin_branches(self)
        self.details = np.zeros(self.hierarchy.branch_count, np.int32)
        self.keeps_shape, self.rest_error = self.details > 0, math.inf
        if not self.reference_is_exact:
            precision, diagonal = self.rest_precision, self.seen.diagonal
            self.shapes = self.shapes or precision.details(
                self.clip.motion.polygons, self.clip.rest, self.hierarchy, diagonal
            )
            self.details, self.keeps_shape = self.shapes
            least = 2 * qz.least_bound(self.seen.low, self.seen.high, self.clip.dtype)
            error = precision.error(self.clip.motion.metadata, diagonal, least)
            is_stored = self.reference is None or self.clip.rest_given
            if math.isfinite(error) and is_stored and not self.exact_rest:
                self.rest_error = qz.error_limit(error, diagonal)
        self.clip_range_segments = [
            [
                (start + a, start + b)
                for a, b in split_segments(
                    stop - start, self.clip.vertex_count, self.segment_frames, ct.Limits.memory_bytes
                )
            ]
            for start, stop in self.clip.motion.clip_range_frames
        ]
        self.segments = [segment for segments in self.clip_range_segments for segment in segments]
        self._held, self._only = WeakValueDictionary(), []

    @classmethod
    def of(cls, clip: CodedClip, seen: Survey, options: EncodingOptions, pool: ThreadPool) -> Source:
        """Return the source of a clip about the pose that its record names."""
        source = cls(
            clip, seen, options.segment_frames, pool, rest_precision=options.rest_precision, without=options.without
        )
        return source if clip.reference is None else source.about(clip.reference - source.origin)

    @property
    def hierarchy(self) -> Hierarchy:
        """Branches and vertices in file order."""
        return self.clip.hierarchy

    @property
    def exact_rest(self) -> bool:
        """Whether the rest pose comes back bit for bit."""
        return self.clip.exact_rest

    @property
    def host_rest(self) -> bool:
        """Whether a host has the rest pose."""
        return self.clip.host_rest

    @property
    def weights(self) -> np.ndarray | None:
        """Factors on the bound, (N,) float64."""
        return self.clip.weights

    @property
    def polygons(self) -> Polygons | None:
        """Polygons that the file stores as FACES."""
        return self.clip.polygons

    @property
    def still(self) -> bool:
        """Whether all frames are the rest pose."""
        return self.clip.stands_still

    @property
    def has_seams(self) -> bool:
        """Whether segments meet."""
        return len(self.segments) > len(self.clip_range_segments)

    def about(self, reference: np.ndarray | None) -> Source:
        """Return the source with another reference pose, (N, 3) less the origin, for its motion."""
        if reference is None and self.reference is None:
            return self
        source = self._changed(reference=reference)
        source.clip_range_segments, source.segments = self.clip_range_segments, self.segments
        source._held, source._only = self._held, self._only
        return source

    def marking(self, still_branches: np.ndarray) -> Source:
        """Return the source with some branches, (B,) bool, marked as standing still: the coder takes them from the rest
        pose."""
        return self._changed(still_branches=still_branches)

    def in_segments(self, frames: int | None) -> Source:
        """Return the source in segments of at most so many frames."""
        return self._changed(segment_frames=frames, whole=None)

    def holding(self, tolerance: float) -> Source:
        """Return the source in which a frame repeats the last coded one if no vertex differs by more than `tolerance`
        there, so that the frame is not coded.
        """
        nearly = (self.seen.steps > 0) & (self.seen.steps <= tolerance)
        if not nearly.any() or self.still or Feature.REPEATS in self.without:
            return self
        held, starts, worst = self.seen.repeats, {start for start, _ in self.segments}, 0.0
        shown = np.zeros(0)
        for start, block in self.clip.motion.blocks():
            for frame, pose in enumerate(block, start):
                if frame not in starts and nearly[frame]:
                    distance = largest_distance(pose, shown)
                    held[frame] = distance <= tolerance
                    worst = max(worst, distance if held[frame] else 0.0)
                if not held[frame] or frame in starts:
                    shown = pose.copy()
        # Where segments are cut elsewhere, a held frame may stand for others that the same pose stood for.
        return self._changed(held=held, held_error=2 * worst)

    def _changed(self, **fields: Any) -> Source:
        """Return the source with other fields; it shares the positions that were read if its segments are the same."""
        source = replace(self, **fields)
        source.source_rest = self.source_rest  # Neither the clip nor the origin changes.
        if source.segments == self.segments and source.held is self.held:
            source._held, source._only = self._held, self._only
        return source

    @property
    def reference_is_exact(self) -> bool:
        """Whether the reference pose is the rest pose in its very numbers."""
        return self.exact_rest and self.reference is None

    @property
    def has_source_rest(self) -> bool:
        """Whether the rest pose comes back and differs from the reference pose."""
        return self.reference is not None and (self.clip.rest_given or self.exact_rest)

    @property
    def clip_range_starts(self) -> list[int]:
        """The first segment of each clip of the file."""
        return np.cumsum([0, *map(len, self.clip_range_segments[:-1])]).tolist()

    def segment_before(self, segment: int) -> int | None:
        """Return the segment before one in its clip; before the first of a loop of several, the last."""
        for i, (start, segments) in enumerate(zip(self.clip_range_starts, self.clip_range_segments)):
            if start == segment:
                loop = len(segments) > 1 and bool(self.clip.motion.clip_ranges) and self.clip.motion.clip_ranges[i].loop
                return start + len(segments) - 1 if loop else None
        return segment - 1

    def goes_on(self, segment: int) -> bool:
        """Return whether a segment of the same clip follows."""
        following = {segment + 1, *self.clip_range_starts} - {len(self.segments)}
        return any(self.segment_before(other) == segment for other in following)

    def stands_alone(self, segment: int) -> bool:
        """Return whether a segment is all of its clip, so that it is joined to no other."""
        return self.segment_before(segment) is None and not self.goes_on(segment)

    @cached_property
    def mesh(self) -> Mesh | None:
        """Faces that rest poses may go by."""
        if {Feature.CONNECTED, Feature.ADAPTIVE} & self.without:  # Connected vertices are adaptive, too.
            return None
        return Mesh.of(self.polygons, self.hierarchy.vertex_source)

    def mesh_for(self, settings: Settings) -> Mesh | None:
        """Return the faces by which the rest pose is predicted under these settings; None without such a prediction."""
        return self.mesh if settings.connected_rest else None

    @property
    def box(self) -> np.ndarray:
        """The corners of the box around all frames, (2, 3)."""
        return np.array([self.seen.low, self.seen.high])

    @property
    def largest_number(self) -> np.floating:
        """The largest coordinate, in the source's type."""
        return np.abs([self.seen.low, self.seen.high]).max().astype(self.clip.dtype)

    @property
    def extent(self) -> float:
        """Diagonal of the box around all frames and the rest pose: the furthest that a vertex can be from its place."""
        low = np.minimum(self.seen.low, self.source_rest.min(axis=0) + self.origin)
        high = np.maximum(self.seen.high, self.source_rest.max(axis=0) + self.origin)
        return length(high - low)

    def limit(self, bound: float) -> float | np.ndarray:
        """Return the distance within which decoded positions have to be: one for all vertices, or one for each, (N,) in
        file order."""
        if self.weights is None:
            return self.unweighted_limit(bound)
        return np.array(
            [qz.error_limit(limit, self.seen.diagonal) for limit in bound * self.weights - self.replaced_error]
        )

    def unweighted_limit(self, bound: float) -> float:
        """Return the distance within which decoded positions would have to be if no vertex had a weight."""
        return qz.error_limit(bound - self.replaced_error, self.seen.diagonal)

    @property
    def replaced_error(self) -> float:
        """Largest distance of any vertex in any frame from the place or held frame that is coded instead of it."""
        return self.held_error + self.clip.placed.places.error

    def smallest_bound(self, bound: float) -> float:
        """Return the smallest bound of any vertex."""
        return bound if self.weights is None else bound * float(self.weights.min())

    def largest_bound(self, bound: float) -> float:
        """Return the largest bound of any vertex."""
        return bound if self.weights is None else bound * float(self.weights.max())

    def rest_limit(self, bound: float) -> float:
        """Return the largest error of the reference pose."""
        return bound if self.has_source_rest else min(bound, self.rest_error)

    def stage_weights(self, stages: int, part: float) -> np.ndarray:
        """Return for each stage, (stages,), the weight below which a share `part` of its vertices, and of those of
        finer stages, lies. A stage without vertices has the weight of the one above."""
        stage = self.hierarchy.branch_depth[self.hierarchy.vertex_branch()]
        weights = np.ones(len(stage)) if self.weights is None else self.weights
        below = [weights[stage >= first] for first in range(stages)]
        quantiles = [float(np.quantile(some, part)) if len(some) else 0.0 for some in below]
        return np.maximum.accumulate(quantiles)

    def is_whole_loop(self, segment: int) -> bool:
        """Return whether the segment is all of a clip that is a loop."""
        of_clips = zip(self.clip.motion.clip_ranges, self.clip_range_segments)
        return any(clip_range.loop and segments == [self.segments[segment]] for clip_range, segments in of_clips)

    @property
    def segment_bytes(self) -> int:
        """Bytes of the float32 positions of the longest segment."""
        return 12 * self.clip.vertex_count * max(stop - start for start, stop in self.segments)

    @cached_property
    def repeats(self) -> np.ndarray:
        """(frames,) bool: frames of the clip that are not coded, because the one before in their segment shows them.
        None is left out if all are the rest pose: they take no bytes either."""
        repeats = self.seen.repeats & (not self.still and Feature.REPEATS not in self.without)
        repeats |= self.held if self.held is not None else False
        repeats[[start for start, _ in self.segments]] = False
        return repeats

    @property
    def coded_frames(self) -> int:
        """Number of frames of the clip that are coded."""
        return int((~self.repeats).sum())

    def frames_of(self, segment: int) -> int:
        """Return the number of coded frames of a segment, T."""
        return int((~self.repeats[slice(*self.segments[segment])]).sum())

    def shown_times(self, segment: int) -> np.ndarray:
        """Return how many frames of the clip show each coded frame of a segment, (T,) int32."""
        repeats = self.repeats[slice(*self.segments[segment])]
        return np.diff(np.append(np.flatnonzero(~repeats), len(repeats))).astype(np.int32)

    def block(self, segment: int) -> np.ndarray:
        """Return the coded frames of a segment as the clip has them, (T, N, 3)."""
        block, repeats = self.clip.motion.block(*self.segments[segment]), self.repeats[slice(*self.segments[segment])]
        return block[~repeats] if repeats.any() else block

    def exact(self, block: np.ndarray) -> np.ndarray:
        """Return a block (T, N, 3) of the clip in file order, (N, 3, T), without any rounding."""
        return np.ascontiguousarray(block[:, self.hierarchy.vertex_source].transpose(1, 2, 0))

    def relative(self, block: np.ndarray) -> np.ndarray:
        """Return a block in file order less the origin, (N, 3, T) float64."""
        return gather(block, self.hierarchy.vertex_source, self.origin, self.pool)

    def positions(self, segment: int) -> np.ndarray:
        """Return the positions of a segment less the origin, (N, 3, T) float64. All callers get the same array, which
        is read-only.
        """
        positions = self._held.get(segment)
        if positions is None:
            if self.whole is not None and (of_plant := self.whole[0]._held.get(segment)) is not None:
                positions = of_plant[self.whole[1]]
            else:
                positions = self.relative(self.block(segment))
            positions.setflags(write=False)
            self._held[segment] = positions
        if len(self.segments) == 1:  # A search asks for them again and again.
            self._only[:] = [positions]
        return positions

    def sharing(self, segment: int, positions: np.ndarray) -> np.ndarray:
        """Return the positions (N, 3, T) of a segment. If they have all of its frames, `positions` returns the same
        array while it is in use."""
        if positions.shape[2] == self.frames_of(segment):
            self._held[segment] = positions
        return positions


def branch_records(hierarchy: Hierarchy, ath: Ath, settings: Settings) -> np.ndarray:
    """Return the branches as the C core reads them under some settings, (B,) of _native.BRANCH."""
    branches = np.zeros(hierarchy.branch_count, BRANCH)
    branches["parent"], branches["count"] = hierarchy.branch_parent, hierarchy.stem_count
    branches["attach"], branches["first"] = hierarchy.attach, hierarchy.first_vertex
    free = settings.free_rigid & (settings.rigid > settings.layer) & (hierarchy.branch_parent >= 0)
    if settings.predicted_trees is not None:
        free |= settings.predicted_trees & (hierarchy.branch_parent < 0)
    branches["flags"] = (
        SHEET * (settings.forms != BEAM) + LOOSE * free + WHOLE * ath.whole_branches() + STILL * settings.still
    )
    branches["rigid"] = settings.rigid
    branches["lag"], branches["detail"] = settings.lags, settings.details
    branches["ring"] = np.where(settings.forms > SHEET, settings.forms, 0)
    return branches


def plain_settings(source: Source, stages: int, bound: float, step: float, rest_step: float) -> Settings:
    """Return settings without rotations, learned bases, rigid parts or other choices. `bound`: the bound of the file;
    `step`, `rest_step`: the quantisation steps of motion and of the rest pose; all in scene units.
    """
    none = np.zeros(source.hierarchy.branch_count, np.int32)
    return Settings(
        bound=bound,
        largest_bound=source.largest_bound(bound),
        limit=source.limit(bound),
        step=qz.single(step),
        stage_steps=np.ones(stages),
        rest_step=qz.single(rest_step),
        forms=none,
        rigid=none,
        lags=none,
        details=finer_than(source.details, bound),
        rotation_step_factors=(0,) * stages,
        learned_bases=(False,) * stages,
        node_steps=np.full(stages, step),
        without=source.without,
    )


def uncoded_plan(source: Source, ath: Ath, settings: Settings) -> Plan:
    """Return the plan on the rest pose before it is coded."""
    branches = branch_records(source.hierarchy, ath, settings)
    plan = Plan(branches, source.hierarchy.vertex_count, source.pool, layer=settings.layer)
    plan.set_rest(source.rest)
    return plan


class CodedPrelude:
    """Hierarchy and rest pose as the decoder will have them, for one choice of settings."""

    def __init__(self, source: Source, ath: Ath, settings: Settings, predicted: bool = False, bases: bool = True):
        """Code hierarchy and rest pose. `predicted`: whether motion is predicted, so that stems have no streams;
        `bases`: whether the bases of pieces are built. Raises BoundError if the rest pose cannot keep the bound.
        """
        hierarchy = source.hierarchy
        self.origin, self.dtype = source.origin, np.dtype(source.clip.dtype)
        self.shares, self._of = source.clip.shares, (source, ath, settings)
        branches = branch_records(hierarchy, ath, settings)
        self.plan = Plan(branches, hierarchy.vertex_count, source.pool, predicted=predicted, layer=settings.layer)
        self.plan.still_branches = source.still_branches
        self.shape_of = settings.shape_of
        self.rest_chunk, rest = _coded_rest(source, branches, settings)
        self.plan.set_rest(rest, bases)
        self.hierarchy_stream = streams.encode_hierarchy(branches, hierarchy.branch_source, hierarchy.vertex_source)
        self.source_rest = code_source_rest(source, branches, self.plan.rest, settings.bound)
        self.prelude_bytes = len(self.hierarchy_stream) + len(self.rest_chunk.stream) + len(self.source_rest)

    @cached_property
    def uncoded_plan(self) -> Plan:
        """The plan on the rest pose before it is coded. Modes and time bases are learned on it, because they would else
        describe the rounding of the coded pose as well."""
        return uncoded_plan(*self._of)

    @property
    def output(self) -> tuple[np.ndarray, np.dtype]:
        """Origin and type of decoded positions."""
        return self.origin, self.dtype


def _coded_rest(source: Source, branches: np.ndarray, settings: Settings) -> tuple[writing.Rest, np.ndarray]:
    """Return two things: the content of the chunk REST, and the rest pose that it decodes to, (N, 3) float64 less the
    origin.
    """
    head = writing.Rest(source.origin, settings.rest_step, source.clip.rest_dtype)
    if source.host_rest:
        head.is_host, head.step, head.stream = (
            True,
            1.0,
            writing.mesh_checksum(source.clip.source_rest if source.clip.host_mesh is None else source.clip.host_mesh),
        )
        return head, source.rest
    if source.reference_is_exact:
        pose = source.clip.source_rest[source.hierarchy.vertex_source]
        head.exact, head.mesh = True, source.mesh_for(settings)
        head.stream = streams.encode_exact_rest(branches, pose, head.mesh)
        return head, pose.astype(np.float64) - source.origin
    coded = _rest_within(source, branches, settings)
    head.step, head.stream, head.mesh = coded.step, coded.stream, coded.mesh
    return head, coded.decoded


def _rest_within(source: Source, branches: np.ndarray, settings: Settings) -> streams.CodedRest:
    """Return the rest pose coded at the step that the settings have, or at the first finer step that keeps the bound.
    Raises BoundError if none does.
    """

    def encode(step: float) -> streams.CodedRest:
        mesh = source.mesh_for(settings)
        return streams.encode_rest(
            branches, step, source.rest, None, settings.rest_slack, mesh=mesh, shape_of=settings.shape_of
        )

    return _within(source.rest_limit(settings.bound), source.rest, encode, settings.rest_step)


def _within(
    limit: float, pose: np.ndarray, encode: Callable[[float], streams.CodedRest], step: float
) -> streams.CodedRest:
    """Return a pose at a step, or at the first finer one by which no vertex is further off than the limit. Raises
    BoundError if there is none: integers of steps that fine do not reach all places."""
    for _ in range(REST_ROUNDS):
        coded = encode(step)
        if np.linalg.norm(coded.decoded - pose, axis=1).max() <= limit:
            return coded
        step = qz.single(0.8 * step)
    raise BoundError(f"max error: got {limit:.3g}; the rest pose cannot be kept within it")


def poses_size(source: Source, ath: Ath, settings: Settings) -> float:
    """Return the bytes of hierarchy and rest pose; infinite if the pose cannot keep the bound."""
    hierarchy, branches = source.hierarchy, branch_records(source.hierarchy, ath, settings)
    stream = streams.encode_hierarchy(branches, hierarchy.branch_source, hierarchy.vertex_source)
    try:
        return len(stream) + len(_coded_rest(source, branches, settings)[0].stream)
    except BoundError:
        return math.inf


def prelude_size(source: Source, ath: Ath, settings: Settings) -> float:
    """Return the bytes of hierarchy, reference pose and the source's rest pose; infinite if they cannot keep the
    bound."""
    try:
        return CodedPrelude(source, ath, settings, bases=False).prelude_bytes
    except BoundError:
        return math.inf


def code_source_rest(source: Source, branches: np.ndarray, reference: np.ndarray, bound: float) -> bytes:
    """Return the payload of the chunk SOURCE_REST, which is empty if the rest pose in REST serves. `reference`: the
    reference pose as decoded, (N, 3) float64 less the origin, about which the source's rest pose is coded.
    """
    if not source.has_source_rest:
        return b""
    if source.exact_rest:
        pose = source.clip.source_rest[source.hierarchy.vertex_source]
        return writing.pack_exact_source_rest(streams.encode_exact_rest(branches, pose))
    tolerance = min(source.rest_error, max(bound, qz.SOURCE_REST_TOLERANCE * source.seen.diagonal))
    pose = source.source_rest

    def encode(step: float) -> streams.CodedRest:
        return streams.encode_source_rest(branches, step, reference, pose)

    coded = _within(tolerance, pose, encode, qz.single(qz.SOURCE_REST_STEP * tolerance))
    return writing.pack_source_rest(coded.step, coded.stream)


def stem_sizes(source: Source) -> np.ndarray:
    """Return the diagonals of the stems' bounding boxes in the rest pose, (B,)."""
    first = source.hierarchy.first_vertex
    return np.linalg.norm(np.maximum.reduceat(source.rest, first) - np.minimum.reduceat(source.rest, first), axis=1)


def _thin_branches(source: Source) -> np.ndarray:
    """Return which branches look like beams, (B,): the way along their vertices is not much longer than their size."""
    hierarchy, rest = source.hierarchy, source.rest
    first = hierarchy.first_vertex
    steps = np.zeros(len(rest))
    steps[1:] = np.linalg.norm(np.diff(rest, axis=0), axis=1)
    steps[first] = 0.0
    return np.add.reduceat(steps, first) <= 1.3 * stem_sizes(source)


@dataclass(frozen=True)
class StreamBasis:
    """The learned time basis of a stream, which begins with `known` rows of the stream of stage `base`, if any."""

    stored: Entries | InWaves
    root: int
    known: int = 0
    base: int = ct.NO_LEVEL


def stage_streams(settings: Settings, stages: int, bases: dict[int, StreamBasis]) -> list[StageStream]:
    """Return how the integers of each stage are read, a list of one stream description per stage. `bases`: the learned
    time basis of each stage that has one; the other stages are in waves.
    """
    stage_streams = []
    for stage in range(stages):
        factor = float(settings.rotation_step_factors[stage])
        stream = StageStream(settings.step_of(stage), factor, turn_step=settings.turn_step)
        if stage in bases:
            stream.temporal, stream.root = bases[stage].stored.rows, bases[stage].root
        stage_streams.append(stream)
    return stage_streams


def _stage_moments(segment: SegmentMotion, stage: int | None) -> list[TrackMoments]:
    """Return what the tracks in the stream of `stage`, or all tracks if it is None, have in common over time, in a
    segment that was analysed with fine steps: those of the kind of plants that has most vertices, and of all others.
    """
    is_other = segment.plan.kinds > 0
    if not is_other.any():
        return [_moments(segment, _rows_of(segment, stage, None))]
    both = [_moments(segment, _rows_of(segment, stage, chosen)) for chosen in (~is_other, is_other)]
    return [moments for moments in both if moments.count] or both[:1]


def _rows_of(segment: SegmentMotion, stage: int | None, chosen: np.ndarray | None) -> Iterable[np.ndarray]:
    """Return the rows of integers that the stream of `stage`, or of all stages if it is None, has for the `chosen`
    pieces, (P,) bool, or for all if they are None."""
    if stage is None and chosen is None:
        return [segment.coefficients, segment.tracks]
    pieces, ranks = segment.plan.pieces, segment.plan.ranks
    among = np.ones(len(pieces), bool) if chosen is None else chosen
    few, base = pieces["low_modes"], segment.plan.base_stage
    is_chosen = among & (ranks > 0)
    rows = []
    for low, high, at in ((0 * few, few, pieces["low_stage"]), (few, ranks, pieces["stage"])):
        count = np.where(is_chosen & ((at == stage) | (stage is None)), np.maximum(high - low, 0), 0)
        before = np.cumsum(count) - count
        rows.append(np.repeat(segment.plan.first_rows + low - before, count) + np.arange(count.sum()))
    places = np.concatenate(rows)
    some = (segment.coefficients[places[at : at + ROWS_AT_ONCE]] for at in range(0, len(places), ROWS_AT_ONCE))
    return chain(some, [segment.tracks[among & ((base == stage) | (stage is None))]])


def _moments(segment: SegmentMotion, parts: Iterable[np.ndarray]) -> TrackMoments:
    """Return what the rows of integers in `parts` have in common over time. Rows that quantise to nothing do not
    count."""
    lower, count, least = np.zeros((segment.frames, segment.frames)), 0, (FINER * qz.DEAD_ZONE) ** 2
    for part in parts:
        rows = part.reshape(-1, segment.frames)
        into = address(rows, np.int32, rows.size), least, address(lower, np.float64, lower.size)
        count += lib.ath_add_moments(len(rows), segment.frames, *into)
    moments, waves = (np.tril(lower) + np.tril(lower, -1).T) / FINER**2, segment.waves_of(segment.streams[0])
    return TrackMoments(multiply(waves.T, multiply(moments, waves)), count)


def analyse_finely(plan: Plan, settings: Settings, positions: np.ndarray, bent: bool = False) -> SegmentMotion:
    """Analyse a segment with a step FINER times smaller and without learned modes, so that what is learned from it
    describes the motion and not its rounding."""
    fine = replace(settings, step=qz.single(settings.step / FINER), turn_step=settings.turn_step / FINER)
    segment = SegmentMotion(
        plan, positions.shape[2], stage_streams(fine, plan.stage_count, {}), periodic=settings.periodic
    )
    segment.analyse(positions, Rounding(qz.DEAD_ZONE, roots_turn=settings.roots_turn), bent=bent)
    return segment


def time_components(
    plan: Plan, settings: Settings, positions: np.ndarray, stages: Sequence[int | None], last: bool = False
) -> dict[int | None, TimeComponents]:
    """Return the components of some stages, or of all that moves (None), from a finer pass. `last`: whether the plan is
    of no use afterwards, so that its bases are freed."""
    if not stages:
        return {}
    segment = analyse_finely(plan, settings, positions)
    if last:
        plan.forget_bases()
    may_be_in_waves = Feature.WAVE_BASES not in settings.without
    return {stage: TimeComponents(_stage_moments(segment, stage), segment.waves, may_be_in_waves) for stage in stages}


def stage_bases(
    plan: Plan, settings: Settings, components: dict[int | None, TimeComponents], ratio: float = 1.0
) -> dict[int, StreamBasis]:
    """Return the learned time basis of each stage that has one, as {stage: basis}. If the settings ask for a common
    basis, all stages use that of all motion, which the stream of the first of them holds. `components`: what time bases
    are learned from, by stage, None for all motion; `ratio`: the steps of the settings over those that the components
    were measured at.
    """
    stages = [stage for stage in settings.learning_stages if plan.has_stems(stage)]
    if not settings.common_basis:
        bases = {stage: components[stage].basis(ratio, ratio) for stage in stages}
        return {stage: StreamBasis(basis, stage) for stage, basis in bases.items() if basis is not None}
    basis = components[None].basis(ratio, ratio)
    if basis is None:
        return {}
    first, *others = stages
    return {first: StreamBasis(basis, first)} | {
        stage: StreamBasis(basis, first, len(basis.rows), first) for stage in others
    }


def basis_ratio(plan: Plan, settings: Settings, ratio: float) -> float:
    """Return by how much rows may be coarser than where a time basis was learned, at steps `ratio` times as fine: by
    less if the turns of rigid pieces have a largest step."""
    levers = plan.levers()[plan.is_rigid]
    if not settings.turn_step or not levers.any():
        return ratio
    steps = np.minimum(settings.step / levers[levers > 0], settings.turn_step)
    finest = np.minimum(settings.step / ratio / levers[levers > 0], settings.turn_step)
    return float(np.sqrt(np.mean((steps / finest) ** 2)))


def learned_bases(plan: Plan, settings: Settings, positions: np.ndarray) -> dict[int, StreamBasis]:
    """Return the time bases of the stages that learn theirs."""
    stages = [None] if settings.common_basis and any(settings.learned_bases) else settings.learning_stages
    return stage_bases(plan, settings, time_components(plan, settings, positions, stages))


@dataclass(frozen=True)
class Corrections:
    """Corrections of positions of a shape, (N, 3, T): rows (K, 6) int32, and their step."""

    rows: np.ndarray
    step: float
    shape: tuple[int, ...]

    @classmethod
    def none(cls, shape: tuple[int, ...]) -> Corrections:
        return cls(np.zeros((0, 6), np.int32), 1.0, shape)

    @cached_property
    def chunk(self) -> bytes:
        """CORRECTIONS; empty if there are none."""
        if not len(self.rows):
            return b""
        return writing.pack_corrections(self.step, streams.encode_corrections(self.rows, self.shape[0], self.shape[2]))

    def without_twitches(self, parts: tuple[np.ndarray, np.ndarray], most: float) -> Corrections:
        """Return these corrections without those of vertices that they make twitch: the second difference of a vertex's
        corrections over frames exceeds `most`. If one vertex of a part that moves together twitches, the corrections of
        the whole part go. `parts`: first vertices of such parts, and numbers of their vertices.
        """
        vertices, number = np.unique(self.rows[:, 0], return_inverse=True)
        rows = np.column_stack([number, self.rows[:, 1:]]).astype(np.int32)
        twitches = np.zeros(self.shape[0], bool)
        for start, stop in ranges(len(vertices), 3 * self.shape[2]):
            some = rows[slice(*np.searchsorted(number, [start, stop]))] - np.array([start, 0, 0, 0, 0, 0], np.int32)
            moves = np.zeros((stop - start, *self.shape[1:]))
            streams.apply_corrections(moves, some, self.step)
            bends = np.square(np.diff(moves, 2, axis=2)).sum(axis=1).max(axis=1, initial=0.0)
            twitches[vertices[start:stop]] = bends > most**2
        before, (first, count) = np.concatenate([[0], np.cumsum(twitches)]), parts
        some_do = before[first + count] > before[first]
        for start, size in zip(first[some_do], count[some_do]):
            twitches[start : start + size] = True
        return replace(self, rows=self.rows[~twitches[self.rows[:, 0]]])

    @contextmanager
    def applied(self, decoded: np.ndarray) -> Iterator[None]:
        """Return a context in which `decoded` has the corrections added; they are taken back at its end."""
        vertices = np.unique(self.rows[:, 0])
        before = decoded[vertices]
        streams.apply_corrections(decoded, self.rows, self.step)
        yield
        decoded[vertices] = before


@dataclass
class Coded:
    """The stems of one segment: integers, streams by stage, and corrections of a sample of its vertices."""

    segment: SegmentMotion
    stems: dict[int, bytes]
    corrections: Corrections
    sample: np.ndarray  # (n,) vertices that the corrections number.
    heads: dict[int, int]  # Bytes of the time basis of each stream, which do not grow with the pieces.

    @property
    def corrected(self) -> np.ndarray:
        """The vertex of each correction, (K,)."""
        return self.sample[self.corrections.rows[:, 0]]

    @property
    def sample_share(self) -> float:
        """Share of the vertices that are in the sample."""
        return len(self.sample) / self.segment.plan.vertex_count


def analyse(
    plan: Plan,
    output: tuple[np.ndarray, np.dtype],
    settings: Settings,
    positions: np.ndarray,
    learned_modes: LearnedModes | None,
    bases: dict[int, StreamBasis],
    *,
    before: SegmentMotion | None = None,
    ratio: int = 1,
) -> tuple[SegmentMotion, np.ndarray]:
    """Quantise the motion of a segment. Return two things: its integers, and the positions that they decode to at the
    last stage without corrections, (N, 3, T).

    `output`: the origin and the dtype of decoded positions; `positions`: (N, 3, T) of the source less the origin;
    `bases`: the learned time basis of each stage that has one; `before`: the integers of the layer that this one
    refines, or None; `ratio`: the step of that layer over the step of this one.
    """
    stages = stage_streams(settings, plan.stage_count, bases)
    segment = SegmentMotion(plan, positions.shape[2], stages, learned_modes, before, ratio, periodic=settings.periodic)
    origin, dtype = output
    decoded = zeros(positions.shape, dtype)
    segment.analyse(positions, settings.rounding, origin, decoded)
    if before is not None:
        before.forget_caches()
    return segment, decoded


def stems_head(settings: Settings, stage: int, bases: dict[int, StreamBasis]) -> writing.StemsHead:
    """Return the head of the chunk STEMS of a stage: its steps and its time basis, which is learned if `bases` has the
    stage.
    """
    head = writing.StemsHead(
        settings.step_of(stage), settings.rotation_step_factors[stage], turn=qz.turn_of(settings.turn_step)
    )
    if stage in bases:
        basis = bases[stage]
        head.basis_kind, head.rank, head.base = basis.stored.kind, len(basis.stored.rows), basis.base
        head.basis = basis.stored.stream(basis.known)
    return head


def stem_streams(
    segment: SegmentMotion, settings: Settings, bases: dict[int, StreamBasis]
) -> tuple[dict[int, bytes], dict[int, int]]:
    """Return two things about the stages of a first layer that have stems: the payloads of their chunks STEMS, as
    {stage: payload}; and how many bytes of each its time basis takes, as {stage: bytes}.
    """
    plan = segment.plan

    def stem_stream(stage: int) -> tuple[bytes, int]:
        head = stems_head(settings, stage, bases)
        return writing.pack_stems(head, streams.encode_stems(segment, stage)), len(head.basis)

    stages = [stage for stage in range(plan.stage_count) if plan.has_stems(stage)]
    coded = plan.pool.map(stem_stream, [(stage,) for stage in stages])
    stems, heads = (dict(zip(stages, column)) for column in zip(*coded))
    return stems, heads


def correction_step(limit: float | np.ndarray) -> float:
    """Return the quantisation step of corrections that is tried first, for a limit in scene units."""
    return qz.single(qz.CORRECTION_STEP * float(np.min(limit)))


def find_corrections(
    decoded: np.ndarray,
    positions: np.ndarray,
    origin: np.ndarray,
    settings: Settings,
    plan: Plan | PlanSample,
    ends: streams.MetEnds = streams.FREE_ENDS,
) -> Corrections:
    """Return corrections that bring the `decoded` positions within the limit of the settings. A rigid part or a ring is
    moved as a whole if that suffices. `ends`: the corrections of neighbouring segments that these have to go on from,
    at the usual step. Raises BoundError if no step keeps the limit.
    """
    factor, is_narrow = 1.0, Feature.WIDE in settings.without
    parts = parts_that_keep_their_shape(plan)
    while True:
        step = qz.single(correction_step(settings.limit) * factor)
        moves = streams.find_rigid_corrections(
            parts,
            decoded,
            positions,
            origin,
            settings.limit,
            step,
            pool=plan.pool,
            narrow=is_narrow,
            closed=ends.closed,
        )
        met = ends.with_moves(moves)
        rows = streams.find_corrections(
            decoded, positions, origin, settings.limit, step, plan.pool, narrow=is_narrow, ends=met
        )
        if rows is not None:
            return Corrections(rows, step, decoded.shape)
        factor, ends = 0.5 * factor, streams.FREE_ENDS
        if factor < 1e-3:
            raise BoundError(
                f"max error: got {settings.bound:.3g}; it cannot be kept in the output's {decoded.dtype.name} numbers"
            )


def parts_that_keep_their_shape(plan: Plan | PlanSample) -> tuple[np.ndarray, np.ndarray]:
    """Return two arrays about the parts whose vertices corrections move together, which are rigid pieces and the rings
    of tubes: the first vertex of each, and its number of vertices.
    """
    is_rigid = plan.pieces["flags"] & RIGID > 0
    rigid, tubes = plan.pieces[is_rigid], plan.pieces[~is_rigid & (plan.pieces["ring"] > 0)]
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
    bases: dict[int, StreamBasis],
) -> Coded:
    """Return the streams of the stems of a single layer and the corrections that keep the limit, of a sample if there
    are many vertices."""
    plan, origin = prelude.plan, prelude.origin
    segment, decoded = analyse(plan, prelude.output, settings, positions, learned_modes, bases)
    stems, heads = stem_streams(segment, settings, bases)
    part = _part_to_correct(prelude, settings, decoded, positions)
    if part == 1:
        corrections = find_corrections(decoded, positions, origin, settings, plan)
        return Coded(segment, stems, corrections, np.arange(len(decoded)), heads)
    some = plan.sample(part)
    decoded = decoded[some.vertices]  # The others are freed.
    of_sample = replace(settings, limit=settings.limit_of(some.vertices))
    corrections = find_corrections(decoded, positions[some.vertices], origin, of_sample, some)
    return Coded(segment, stems, corrections, some.vertices, heads)


def _part_to_correct(prelude: CodedPrelude, settings: Settings, decoded: np.ndarray, positions: np.ndarray) -> int:
    """Return of how many parts of the pieces one is corrected as a sample: 1 for a small plant, and more the more
    positions lie beyond the limit.
    """
    plan, count, part = prelude.plan, len(decoded), 1 if len(decoded) < SAMPLED else 2
    if count >= LEAST_SAMPLED:
        spread = slice(0, None, -(-count // SPREAD))
        errors = decoded[spread] - positions[spread] - prelude.origin[:, None]
        squared_limit = np.square(settings.limit_of(spread))[..., None]
        beyond = np.mean((np.square(errors).sum(axis=1) > squared_limit).sum(axis=1))
        most = MANY + MANY_SHARE * decoded[:, 0].size
        while part < SPARSE and beyond * len(plan.sample(part).vertices) > most:
            part *= 2
    return part
