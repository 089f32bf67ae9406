"""One clip as the encoder codes it: hierarchy and rest pose under some settings, and the streams of one segment.

Both the search for settings (search.py) and the encoder itself call what is here. Everything is closed loop: pieces are
predicted from what the decoder will have, corrections are found on what it will output.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from athcodec import container as ct
from athcodec._native import BRANCH, LOOSE, SHEET, WHOLE
from athcodec.ath import Ath, Survey
from athcodec.clip import MotionClip
from athcodec.encoding import quantise as qz
from athcodec.encoding import streams
from athcodec.encoding.learned_modes import LearnedModes
from athcodec.encoding.motion import LevelStream, Plan, SegmentMotion, gather
from athcodec.encoding.time_bases import BASIS_BITS, TimeComponents, basis_rows
from athcodec.errors import BoundError
from athcodec.hierarchy import Hierarchy
from athcodec.segmentation import split_segments
from athcodec.threads import SERIAL, ThreadPool, default_jobs

FINER = 32  # step over that of segments that bases and modes are learned from
ROWS_AT_ONCE = 1 << 14  # of coefficients
WORK_BYTES = 1536 << 20  # of the segments coded at once, where `jobs` does not say how many these are
SEGMENT_WORK = 8  # memory of a segment while it is coded, over its float32 positions


def thread_count(jobs: int | None, source: Source) -> int:
    """Segments, or candidates, that are coded at once: `jobs`, or one per core, at most 4 and within WORK_BYTES."""
    fit = WORK_BYTES // (SEGMENT_WORK * source.segment_bytes)
    return jobs or max(1, min(default_jobs(), fit))


@dataclass
class Source:
    """A clip in file order, relative to an origin, cut into segments."""

    clip: MotionClip
    hierarchy: Hierarchy
    seen: Survey
    segment_frames: int
    exact_rest: bool
    weights: np.ndarray | None = None  # (N,) float64, factors on the bound; file order
    pool: ThreadPool = SERIAL
    rest: np.ndarray = field(init=False)  # (N, 3) float64
    origin: np.ndarray = field(init=False)  # (3,) float64
    sheet_like: np.ndarray = field(init=False)  # (B,) bool: branches that do not look like beams
    clip_range_segments: list[list[tuple[int, int]]] = field(init=False)  # per clip of the file
    segments: list[tuple[int, int]] = field(init=False)  # of all of them

    def __post_init__(self) -> None:
        self.origin = qz.nearest_singles((self.seen.low + self.seen.high) / 2)
        self.rest = self.clip.rest[self.hierarchy.vertex_source] - self.origin
        self.sheet_like = ~_thin_branches(self)
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

    @property
    def clip_range_starts(self) -> list[int]:
        """The first segment of each clip of the file."""
        return np.cumsum([0, *map(len, self.clip_range_segments[:-1])]).tolist()

    @property
    def extent(self) -> float:
        """Diagonal of the box around all frames and the rest pose: the longest way a vertex can be from its place."""
        low = np.minimum(self.seen.low, self.rest.min(axis=0) + self.origin)
        high = np.maximum(self.seen.high, self.rest.max(axis=0) + self.origin)
        return float(np.linalg.norm(high - low))

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

    @property
    def segment_bytes(self) -> int:
        """Of the float32 positions of the longest segment."""
        return 12 * self.clip.vertex_count * max(stop - start for start, stop in self.segments)

    def block(self, segment: int) -> np.ndarray:
        """(T, N, 3) positions of a segment as the clip has them."""
        return self.clip.block(*self.segments[segment])

    def exact(self, block: np.ndarray) -> np.ndarray:
        """(N, 3, T) of a block in file order, its very numbers."""
        return np.ascontiguousarray(block[:, self.hierarchy.vertex_source].transpose(1, 2, 0))

    def relative(self, block: np.ndarray) -> np.ndarray:
        """(N, 3, T) float64 of a block in file order, less the origin."""
        return gather(block, self.hierarchy.vertex_source, self.origin, self.pool)

    def positions(self, segment: int) -> np.ndarray:
        """(N, 3, T) float64 positions of a segment, less the origin."""
        return self.relative(self.block(segment))


@dataclass(frozen=True)
class Settings:
    """What a trial varies; steps in scene units."""

    bound: float
    largest_bound: float  # of any vertex
    limit: float | np.ndarray  # what the positions of each vertex, (N,), are held to
    step: float
    level_steps: np.ndarray  # (levels,) factors on it
    rest_step: float
    sheet: np.ndarray  # (B,) bool, file order
    loose: np.ndarray  # (B,) bool, file order
    lags: np.ndarray  # (B,) int32, file order
    rotation_step_factors: tuple[int, ...]  # per level: rotation factors
    learned_bases: tuple[bool, ...]  # per level: whether the time basis is
    learned_pieces: np.ndarray | None  # (P,) bool: pieces that have learned modes; None: none has
    only_tips: bool  # pieces that carry others have no rotations
    node_steps: np.ndarray  # (levels,) of the maps of nodes, scene units; see SegmentMotion.analyse_nodes

    def step_of(self, level: int) -> float:
        """Of the stems of a level."""
        return qz.single(self.step * self.level_steps[level])


def branch_records(hierarchy: Hierarchy, ath: Ath, settings: Settings) -> np.ndarray:
    """(B,) of _native.BRANCH."""
    branches = np.zeros(hierarchy.branch_count, BRANCH)
    branches["parent"], branches["count"] = hierarchy.branch_parent, hierarchy.stem_count
    branches["attach"] = hierarchy.attach
    branches["flags"] = SHEET * settings.sheet + WHOLE * ath.whole_branches() + LOOSE * settings.loose
    branches["lag"] = settings.lags
    return branches


class CodedPrelude:
    """Hierarchy and rest pose as the decoder will have them, for one choice of settings."""

    def __init__(self, source: Source, ath: Ath, settings: Settings, predicted: bool = False):
        hierarchy = source.hierarchy
        self.origin, self.dtype = source.origin, np.dtype(source.clip.dtype)
        branches = branch_records(hierarchy, ath, settings)
        self.hierarchy_stream = streams.encode_hierarchy(branches, hierarchy.branch_source, hierarchy.vertex_source)
        self.plan = Plan(branches, hierarchy.vertex_count, source.pool, predicted=predicted)
        self.rest_chunk = self._code_rest(source, branches, settings)
        self.prelude_bytes = len(self.hierarchy_stream) + len(self.rest_chunk.stream)

    def _code_rest(self, source: Source, branches: np.ndarray, settings: Settings) -> ct.Rest:
        head = ct.Rest(source.origin, settings.rest_step, source.clip.rest_dtype)
        if source.exact_rest:
            pose = source.clip.source_rest[source.hierarchy.vertex_source]
            head.exact, head.stream = True, streams.encode_exact_rest(branches, pose)
            self.plan.set_rest(pose.astype(np.float64) - source.origin)
        else:
            coded = streams.encode_rest(branches, head.step, source.rest)
            while np.linalg.norm(coded.decoded - source.rest, axis=1).max() > settings.bound:
                head.step = qz.single(0.8 * head.step)
                coded = streams.encode_rest(branches, head.step, source.rest)
            head.stream = coded.stream
            self.plan.set_rest(coded.decoded)
        return head


def lags(source: Source, step: float) -> np.ndarray:
    """Predictors of the rest pose, (B,): 0, a beam's modes, or the lag that does best elsewhere."""
    hierarchy = source.hierarchy
    lags = np.zeros(hierarchy.branch_count, np.int32)
    for b in np.flatnonzero(source.sheet_like):
        first, count = hierarchy.first_vertex[b], hierarchy.stem_count[b]
        attach = hierarchy.attach[b]
        lags[b] = qz.rest_lag(source.rest[first : first + count], source.rest[attach] if attach >= 0 else None, step)
    return lags


def loose_branches(source: Source, sample: np.ndarray) -> np.ndarray:
    """Branches whose base leaves its attach point by more than their own size: fallen leaves, separate parts."""
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
    """The learned time basis of a stream, (rank, frames) int32 as stored; root as in LevelStream. It begins with the
    `known` rows of the stream of another level, if any."""

    steps: np.ndarray
    root: int
    known: int = 0
    base: int = ct.NO_LEVEL


def _level_streams(settings: Settings, levels: int, bases: dict[int, StreamBasis]) -> list[LevelStream]:
    level_streams = []
    for level in range(levels):
        factor = float(settings.rotation_step_factors[level])
        stream = LevelStream(settings.step_of(level), factor, only_tips=settings.only_tips)
        if level in bases:
            stream.temporal, stream.root = basis_rows(bases[level].steps), bases[level].root
        level_streams.append(stream)
    return level_streams


def _level_moments(segment: SegmentMotion, level: int) -> tuple[np.ndarray, int]:
    """Second moments over time, (T, T), of those tracks of one level's stream that do not quantise to nothing, in units
    of their steps, and how many they are; of a segment that was analysed finely, in cosines."""
    pieces, slots = segment.plan.pieces, []
    for low, high, at in (
        (0, pieces["low_modes"], pieces["low_level"]),
        (pieces["low_modes"], pieces["count"], pieces["level"]),
    ):
        for piece in np.flatnonzero(at == level):
            start = low if np.isscalar(low) else low[piece]
            slots.append(np.arange(pieces["first"][piece] + start, pieces["first"][piece] + high[piece]))
    chosen = np.concatenate(slots) if slots else np.zeros(0, int)
    moments, count = np.zeros((segment.frames, segment.frames)), 0
    parts = (segment.coefficients[chosen[at : at + ROWS_AT_ONCE]] for at in range(0, len(chosen), ROWS_AT_ONCE))
    for part in (*parts, segment.tracks[segment.plan.base_level == level]):
        rows = part.reshape(-1, segment.frames) / FINER
        rows = rows[(rows**2).sum(axis=1) > qz.DEAD_ZONE**2]
        moments += rows.T @ rows
        count += len(rows)
    return segment.cosines.T @ moments @ segment.cosines, count


def analyse_finely(plan: Plan, settings: Settings, positions: np.ndarray) -> SegmentMotion:
    """A segment at a step FINER times smaller, in cosines and cantilever modes, to learn bases and modes from."""
    fine = replace(settings, step=qz.single(settings.step / FINER))
    segment = SegmentMotion(plan, positions.shape[2], _level_streams(fine, plan.level_count, {}))
    segment.analyse(positions, qz.DEAD_ZONE)
    return segment


def time_components(plan: Plan, settings: Settings, positions: np.ndarray) -> dict[int, TimeComponents]:
    """Of the levels that learn their time bases, from a finer pass with cosines."""
    levels = [level for level, learned in enumerate(settings.learned_bases) if learned]
    if not levels:
        return {}
    segment = analyse_finely(plan, settings, positions)
    return {level: TimeComponents(*_level_moments(segment, level)) for level in levels}


def learned_bases(plan: Plan, settings: Settings, positions: np.ndarray) -> dict[int, StreamBasis]:
    """Each level's own."""
    bases = {level: found.basis() for level, found in time_components(plan, settings, positions).items()}
    return {level: StreamBasis(basis, level) for level, basis in bases.items() if basis is not None}


@dataclass
class Coded:
    """The stems of one segment: integers, streams by level, corrections (K, 5), and the corrected positions."""

    segment: SegmentMotion
    stems: dict[int, bytes]
    corrections: np.ndarray
    decoded: np.ndarray  # (N, 3, T)
    correction_step: float
    heads: dict[int, int]  # bytes of each stream that are the same for few pieces and for many: its time basis

    @property
    def bytes(self) -> int:
        return sum(map(len, self.stems.values())) + len(self.correction_chunk)

    @cached_property
    def correction_chunk(self) -> bytes:
        return correction_chunk(self.corrections, self.correction_step, self.decoded.shape)


def correction_chunk(corrections: np.ndarray, step: float, shape: tuple[int, int, int]) -> bytes:
    """CORRECTIONS for positions of a shape, (N, 3, T); empty where there are none."""
    if not len(corrections):
        return b""
    return ct.pack_corrections(step, streams.encode_corrections(corrections, shape[0], shape[2]))


def analyse(
    plan: Plan,
    settings: Settings,
    positions: np.ndarray,
    learned_modes: LearnedModes | None,
    bases: dict[int, StreamBasis],
    before: SegmentMotion | None = None,
    ratio: int = 1,
    layered: bool = False,
) -> SegmentMotion:
    """The integers of the stems; bases: of the levels that learn theirs; before, ratio, layered: as SegmentMotion has
    them."""
    level_streams = _level_streams(settings, plan.level_count, bases)
    segment = SegmentMotion(plan, positions.shape[2], level_streams, learned_modes, before, ratio, layered)
    segment.analyse(positions, qz.DEAD_ZONE)
    return segment


def stems_head(settings: Settings, level: int, bases: dict[int, StreamBasis]) -> ct.StemsHead:
    """Of the stems of a level, whose time basis is among `bases` where it is learned."""
    head = ct.StemsHead(settings.step_of(level), settings.rotation_step_factors[level], only_tips=settings.only_tips)
    if level in bases:
        own = bases[level]
        head.bits, head.rank, head.base = BASIS_BITS, len(own.steps), own.base
        head.basis = streams.encode_temporal(own.steps[own.known :], BASIS_BITS)
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


def correct(
    decoded: np.ndarray, positions: np.ndarray, origin: np.ndarray, settings: Settings, pool: ThreadPool
) -> tuple[np.ndarray, float]:
    """Corrections (K, 5) that keep the limit, applied to `decoded`, and their step. Raises BoundError."""
    factor = 1.0
    while True:
        step = qz.single(qz.CORRECTION_STEP * float(np.min(settings.limit)) * factor)
        corrections = streams.find_corrections(decoded, positions, origin, settings.limit, step, pool)
        if corrections is not None:
            return corrections, step
        factor *= 0.5
        if factor < 1e-3:
            raise BoundError(
                f"max error: got {settings.bound:.3g}; it cannot be kept in the output's {decoded.dtype.name} numbers"
            )


def code_stems(
    prelude: CodedPrelude, settings: Settings, positions: np.ndarray, learned_modes: LearnedModes | None
) -> Coded:
    """Streams of the stems of a single layer and the corrections that keep the limit."""
    bases = learned_bases(prelude.plan, settings, positions)
    segment = analyse(prelude.plan, settings, positions, learned_modes, bases)
    stems, heads = stem_streams(segment, settings, bases)
    decoded = segment.pose(prelude.plan.level_count - 1, prelude.origin, prelude.dtype)
    corrections, step = correct(decoded, positions, prelude.origin, settings, prelude.plan.pool)
    return Coded(segment, stems, corrections, decoded, step, heads)
