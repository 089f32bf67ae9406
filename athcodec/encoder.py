"""From a motion clip to one .ath file: the stages of FORMAT.md run forward, in closed loop, segment by segment.

The source is read twice: once for what needs all frames (bounding box, TAM), once to code. What the file promises is
checked on what a decoder will output: every level of every segment is decoded and measured, and what is beyond the bound
at the last level is corrected before it is written. Choices (basis, rotations, time basis, steps) are made by trial on
a sample of the segments; see `_Search`.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from athcodec import container as ct
from athcodec import entropy
from athcodec import quantize as qz
from athcodec._native import BRANCH, LOOSE, SHEET, WHOLE
from athcodec.ath import Ath, Survey, Thresholds, survey
from athcodec.clip import MotionClip
from athcodec.errors import BoundError, ClipError
from athcodec.files import new_file
from athcodec.hierarchy import Hierarchy, derived_edges, hierarchy_of
from athcodec.transform import (DEFAULT_SEGMENT, MAX_SEGMENT, MIN_SEGMENT, LevelStream, Plan, SegmentMotion, gather,
                                position_error, split_segments)

DEFAULT_REL_ERROR = 1e-4
LARGEST_COORDINATE = 1e36
EFFORTS = ("fast", "default", "best")
SPOOL_BYTES = 64 << 20
STATIC_METADATA = ("unit", "up_axis")

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class LevelSummary:
    """One level of a file just written; errors in scene units."""

    depth: int
    nodes: int
    bytes: int
    max_error: float
    rms_error: float


@dataclass(frozen=True)
class Summary:
    """What `encode` made."""

    path: Path
    bytes: int
    raw_bytes: int
    max_error_bound: float
    relative_bound: float
    table1: dict
    depths: list[LevelSummary]
    chunk_bytes: dict[str, int]
    choices: dict

    @property
    def ratio(self) -> float:
        """Raw positions over the whole file."""
        return self.raw_bytes / self.bytes


@dataclass(frozen=True)
class Settings:
    """What a trial varies. Per level: rotation factors and whether the time basis is learned."""

    bound: float
    limit: float
    step: float
    rest_step: float
    sheet: np.ndarray  # (B,) bool, file order
    loose: np.ndarray  # (B,) bool, file order
    lags: np.ndarray  # (B,) int32, file order
    omega: tuple[int, ...]
    learned: tuple[bool, ...]
    level_errors: np.ndarray  # (levels,) RMS error of the paper's maps at each level, scene units
    node_quality: float = qz.NODE_QUALITIES[0]


def encode(clip: MotionClip, path, *, max_error: float | None = None, rel_error: float | None = None,
           target_size: int | None = None, segment_frames: int | None = None, tam: Thresholds | None = None,
           exact_rest: bool = False, attributes: str = "all", effort: str = "default",
           progress: Progress | None = None) -> Summary:
    """Compresses a clip into an .ath file at `path`, which appears only when it is whole.

    max_error: bound in scene units on the distance of every vertex in every frame; or rel_error: the same as a fraction
    of the bounding box's diagonal over all frames (default 1e-4); or target_size: bytes, the smallest bound that fits.
    segment_frames: longest segment, 16 to 256. tam: acceptance thresholds of the ATH (default: one map per frame stays
    within the bound). exact_rest: keep the rest pose bit for bit. attributes: "none" drops faces, edges and named
    arrays. Raises ClipError, BoundError, ValueError, OSError.
    """
    _check_options(max_error, rel_error, target_size, segment_frames, attributes, effort)
    report = progress or (lambda stage, fraction: None)
    clip.check()
    hierarchy = hierarchy_of(clip)
    _check_limits(clip, hierarchy)
    seen = survey(clip, hierarchy, progress=lambda f: report("survey", f), **_survey_options(tam))
    _check_coordinates(seen)
    job = _Job(clip, hierarchy, seen, tam, segment_frames or DEFAULT_SEGMENT, exact_rest, attributes == "all", effort,
               report)
    if target_size is not None:
        bound = _bound_for_size(job, target_size)
    else:
        bound = max_error if max_error is not None else _relative_bound(rel_error or DEFAULT_REL_ERROR, job)
    with new_file(Path(path)) as out, tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
        result = job.encode(bound, ct.ChunkStore(spool))
        chunks = result.store.write(out, result.header, result.errors)
    report("done", 1.0)
    return _summary(Path(path), clip, job, result, chunks)


def _check_options(max_error, rel_error, target_size, segment_frames, attributes, effort) -> None:
    given = [name for name, value in (("max_error", max_error), ("rel_error", rel_error), ("target_size", target_size))
             if value is not None]
    if len(given) > 1:
        raise ValueError(f"got {' and '.join(given)}; expected one of them")
    for name, value in (("max_error", max_error), ("rel_error", rel_error), ("target_size", target_size)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise BoundError(f"{name}: got {value}; expected a finite number above 0")
    if segment_frames is not None and not MIN_SEGMENT <= segment_frames <= MAX_SEGMENT:
        raise ValueError(f"segment_frames: got {segment_frames}; expected {MIN_SEGMENT} to {MAX_SEGMENT}")
    if attributes not in ("all", "none"):
        raise ValueError(f"attributes: got {attributes!r}; expected 'all' or 'none'")
    if effort not in EFFORTS:
        raise ValueError(f"effort: got {effort!r}; expected one of {', '.join(EFFORTS)}")


def _check_limits(clip: MotionClip, hierarchy: Hierarchy) -> None:
    """Raises ClipError for counts that decoders refuse."""
    limits = ct.Limits()
    for name, value, limit in (("vertices", clip.vertex_count, limits.vertices),
                               ("branches", clip.branch_count, limits.branches),
                               ("frames", clip.frame_count, limits.frames),
                               ("branches on branches", int(hierarchy.branch_depth.max()) + 1, limits.hierarchy_depth)):
        if value > limit:
            raise ClipError(f"clip: got {value} {name}; expected at most {limit}")


def _check_coordinates(seen: Survey) -> None:
    largest = float(np.abs([seen.low, seen.high]).max())
    if largest > LARGEST_COORDINATE:
        raise ClipError(f"positions: got a coordinate of {largest:.3g}; expected at most {LARGEST_COORDINATE:g}, so "
                        f"that errors are float32 numbers")


def _relative_bound(fraction: float, job: _Job) -> float:
    """A fraction of the diagonal; where nothing has any extent, the least that the source's numbers allow."""
    if job.seen.diagonal > 0:
        return fraction * job.seen.diagonal
    return 2 * qz.least_bound(job.seen.low, job.seen.high, job.clip.dtype)


def _survey_options(tam: Thresholds | None) -> dict:
    return {} if tam is None else {"lam": tam.lam, "xi": tam.xi, "eta": tam.eta}


@dataclass
class _Result:
    store: ct.ChunkStore
    header: ct.Header
    errors: np.ndarray
    ath: Ath
    plan: Plan
    settings: Settings


@dataclass
class _Job:
    """One clip on its way into a file: what does not depend on the bound."""

    clip: MotionClip
    hierarchy: Hierarchy
    seen: Survey
    tam: Thresholds | None
    segment_frames: int
    exact_rest: bool
    keep_static: bool
    effort: str
    report: Progress
    rest: np.ndarray = field(init=False)  # (N, 3) float64, file order, less the origin
    origin: np.ndarray = field(init=False)
    wide: np.ndarray = field(init=False)  # (B,) bool: branches that do not look like beams

    def __post_init__(self) -> None:
        self.origin = np.float64((self.seen.low + self.seen.high) / 2)
        self.rest = self.clip.rest[self.hierarchy.vertex_source] - self.origin
        self.wide = ~_thin_branches(self)
        self.segments = split_segments(self.clip.frame_count, self.clip.vertex_count, self.segment_frames)

    def source(self, segment: int) -> np.ndarray:
        """(N, 3, T) float64 positions of a segment, file order, less the origin."""
        return gather(self.clip.block(*self.segments[segment]), self.hierarchy.vertex_source, self.origin)

    def thresholds(self, bound: float) -> Thresholds:
        return self.tam or Thresholds(bound, 0, bound, 0)

    def encode(self, bound: float, store: ct.ChunkStore) -> _Result:
        diagonal = self.seen.diagonal
        qz.check_bound(bound, self.seen.low, self.seen.high, self.clip.dtype)
        ath = self.seen.ath(self.thresholds(bound))
        search = _Search(self, ath, bound, qz.error_limit(bound, diagonal))
        settings = search.best()
        shape = _Shape(self, ath, settings)
        self._add_prelude(store, shape, ath)
        errors = self._add_motion(store, shape, settings)
        self._add_static(store)
        header = ct.Header(self.clip.vertex_count, self.clip.branch_count, self.clip.frame_count, len(self.segments),
                           shape.plan.level_count, shape.plan.level_count, bound, self.clip.dtype == np.float64)
        return _Result(store, header, errors, ath, shape.plan, settings)

    def _add_prelude(self, store: ct.ChunkStore, shape: _Shape, ath: Ath) -> None:
        limits = ath.thresholds
        store.add(ct.HIERARCHY, ct.pack_hierarchy((limits.epsilon, limits.eta, limits.xi, limits.lam),
                                                  shape.hierarchy_stream))
        store.add(ct.REST, ct.pack_rest(shape.rest_chunk))
        store.add(ct.TIME, ct.pack_time(self.clip.time))
        metadata = self.clip.metadata if self.keep_static else {
            key: self.clip.metadata[key] for key in STATIC_METADATA if key in self.clip.metadata}
        if metadata:
            store.add(ct.METADATA, ct.pack_metadata(metadata))
        if self.keep_static and self.clip.faces is not None:
            store.add(ct.FACES, ct.pack_array(self.clip.faces))
        if self.keep_static and self.clip.edges is not None:
            store.add(ct.EDGES, self._edges())

    def _edges(self) -> bytes:
        derived = derived_edges(self.hierarchy)
        if derived.shape == self.clip.edges.shape and (derived == self.clip.edges).all():
            return ct.pack_array(None, derived=self.clip.edges.dtype.str)
        return ct.pack_array(self.clip.edges)

    def _add_static(self, store: ct.ChunkStore) -> None:
        if self.keep_static and len(self.clip.attributes) > ct.Limits.attributes:
            raise ClipError(f"attributes: got {len(self.clip.attributes)}; expected at most {ct.Limits.attributes}")
        if self.keep_static:
            for name, array in self.clip.attributes.items():
                store.add(ct.ATTRIBUTE, ct.pack_array(array, name))

    def _add_motion(self, store: ct.ChunkStore, shape: _Shape, settings: Settings) -> np.ndarray:
        """Codes all segments, a few at a time; returns (levels, segments, 2) errors."""
        errors = np.zeros((shape.plan.level_count, len(self.segments), 2))
        with ThreadPoolExecutor(_threads()) as pool:
            pending: list = []
            for index in range(len(self.segments)):
                pending.append(pool.submit(_code_segment, shape, settings, self.source(index)))
                if len(pending) > _threads():
                    self._collect(store, errors, index + 1 - len(pending), pending.pop(0))
            while pending:
                self._collect(store, errors, len(self.segments) - len(pending), pending.pop(0))
        return errors

    def _collect(self, store: ct.ChunkStore, errors: np.ndarray, index: int, future) -> None:
        chunks, errors[:, index] = future.result()
        for (level, kind), payload in chunks.items():
            store.add(kind, payload, level, index)
        self.report("motion", (index + 1) / len(self.segments))


def _threads() -> int:
    return min(4, os.cpu_count() or 1)


class _Shape:
    """Hierarchy and rest pose as the decoder will have them, for one choice of settings."""

    def __init__(self, job: _Job, ath: Ath, settings: Settings):
        hierarchy = job.hierarchy
        self.origin, self.dtype = job.origin, np.dtype(job.clip.dtype)
        branches = np.zeros(hierarchy.branch_count, BRANCH)
        branches["parent"], branches["count"] = hierarchy.branch_parent, hierarchy.stem_count
        branches["attach"] = hierarchy.attach
        branches["flags"] = (SHEET * settings.sheet + WHOLE * ath.whole_branches()
                             + LOOSE * settings.loose)
        branches["lag"] = settings.lags
        self.hierarchy_stream = entropy.encode_hierarchy(branches, hierarchy.branch_source, hierarchy.vertex_source)
        self.plan = Plan(branches, hierarchy.vertex_count)
        self.rest_chunk = self._code_rest(job, branches, settings)
        self.prelude_bytes = len(self.hierarchy_stream) + len(self.rest_chunk.stream)

    def _code_rest(self, job: _Job, branches: np.ndarray, settings: Settings) -> ct.Rest:
        head = ct.Rest(job.origin, settings.rest_step, job.clip.rest_dtype)
        if job.exact_rest:
            pose = job.clip.rest[job.hierarchy.vertex_source].astype(job.clip.rest_dtype)
            head.exact = pose
            self.plan.set_rest(pose.astype(np.float64) - job.origin)
        else:
            head.stream, decoded = entropy.encode_rest(branches, settings.rest_step, job.rest)
            self.plan.set_rest(decoded)
        return head


def _lags(job: _Job, step: float) -> np.ndarray:
    """Predictors of the rest pose, (B,): linear along beams, by trial elsewhere."""
    hierarchy = job.hierarchy
    lags = np.ones(hierarchy.branch_count, np.int32)
    for b in np.flatnonzero(job.wide):
        first, count = hierarchy.first_vertex[b], hierarchy.stem_count[b]
        attach = hierarchy.attach[b]
        lags[b] = qz.rest_lag(job.rest[first: first + count], job.rest[attach] if attach >= 0 else None, step)
    return lags


def _loose_branches(job: _Job, sample: np.ndarray) -> np.ndarray:
    """Branches whose base leaves its attach point by more than their own size: fallen leaves, separate parts."""
    hierarchy, rest = job.hierarchy, job.rest
    first, attach = hierarchy.first_vertex, np.maximum(hierarchy.attach, 0)
    gap = np.linalg.norm(sample[first] - sample[attach], axis=1)
    rest_gap = np.linalg.norm(rest[first] - rest[attach], axis=1)
    stretch = np.abs(gap - rest_gap[:, None]).max(axis=1)
    return (hierarchy.attach >= 0) & (stretch > np.maximum(_stem_sizes(job), rest_gap))


def _stem_sizes(job: _Job) -> np.ndarray:
    """Diagonals of the stems' bounding boxes in the rest pose, (B,)."""
    first = job.hierarchy.first_vertex
    return np.linalg.norm(np.maximum.reduceat(job.rest, first) - np.minimum.reduceat(job.rest, first), axis=1)


# ---- one segment ----


def _streams(settings: Settings, levels: int, bases: dict[int, np.ndarray]) -> list[LevelStream]:
    streams = []
    for level in range(levels):
        stream = LevelStream(settings.step, float(settings.omega[level]))
        if level in bases:
            stream.temporal_steps = bases[level]
            stream.temporal = qz.temporal_basis(bases[level])
        streams.append(stream)
    return streams


def _level_rows(segment: SegmentMotion, level: int) -> np.ndarray:
    """All quantised tracks of one level's stream over time, in units of their steps: (rows, frames)."""
    pieces = segment.plan.pieces
    base = np.where(pieces["low_level"] >= 0, pieces["low_level"], pieces["level"])
    slots = []
    for low, high, at in ((0, pieces["low_modes"], pieces["low_level"]),
                          (pieces["low_modes"], pieces["count"], pieces["level"])):
        for piece in np.flatnonzero(at == level):
            start = low if np.isscalar(low) else low[piece]
            slots.append(np.arange(pieces["first"][piece] + start, pieces["first"][piece] + high[piece]))
    coefficients = segment.coefficients[np.concatenate(slots) if slots else np.zeros(0, int)]
    tracks = segment.tracks[base == level]
    rows = np.concatenate([coefficients.reshape(-1, segment.frames), tracks.reshape(-1, segment.frames)])
    return rows[np.any(rows, axis=1)] @ segment._cosines


def _learn_bases(shape: _Shape, settings: Settings, source: np.ndarray) -> dict[int, np.ndarray]:
    """Temporal bases of the levels that learn theirs, from a finer pass with cosines."""
    levels = [level for level, learned in enumerate(settings.learned) if learned]
    if not levels:
        return {}
    finer = 32
    fine = replace(settings, step=qz.single(settings.step / finer))
    segment = SegmentMotion(shape.plan, source.shape[2], _streams(fine, shape.plan.level_count, {}))
    segment.analyse(source, qz.DEAD_ZONE)
    bases = {level: qz.learn_temporal_basis(_level_rows(segment, level) / finer, qz.TEMPORAL_TOLERANCE) for level in levels}
    return {level: basis for level, basis in bases.items() if basis is not None}


@dataclass
class _Coded:
    segment: SegmentMotion
    stems: dict[int, bytes]
    corrections: np.ndarray
    positions: np.ndarray
    correction_step: float

    @property
    def bytes(self) -> int:
        return sum(map(len, self.stems.values())) + len(self.correction_chunk)

    @property
    def correction_chunk(self) -> bytes:
        if not len(self.corrections):
            return b""
        vertices, _, frames = self.positions.shape
        stream = entropy.encode_corrections(self.corrections, vertices, frames)
        return ct.pack_corrections(self.correction_step, stream)


def _code_stems(shape: _Shape, settings: Settings, source: np.ndarray) -> _Coded:
    """Streams of the stems and the corrections that keep the limit."""
    plan = shape.plan
    bases = _learn_bases(shape, settings, source)
    streams = _streams(settings, plan.level_count, bases)
    segment = SegmentMotion(plan, source.shape[2], streams)
    segment.analyse(source, qz.DEAD_ZONE)
    stems = {}
    for level in range(plan.level_count):
        if plan.has_stems(level):
            head = ct.StemsHead(settings.step, settings.omega[level])
            if level in bases:
                head.bits, head.rank = qz.TEMPORAL_BITS, len(bases[level])
                head.basis = entropy.encode_temporal(bases[level], head.bits)
            stems[level] = ct.pack_stems(head, entropy.encode_stems(segment, level))
    positions = segment.pose(plan.level_count - 1, shape.origin, shape.dtype)
    factor = 1.0
    while True:
        step = qz.single(qz.CORRECTION_STEP * settings.limit * factor)
        corrections = entropy.find_corrections(positions, source, shape.origin, settings.limit, step)
        if corrections is not None:
            return _Coded(segment, stems, corrections, positions, step)
        factor *= 0.5
        if factor < 1e-3:
            raise BoundError(f"max error: got {settings.bound:.3g}; it cannot be kept in the output's "
                             f"{shape.dtype.name} numbers")


def _code_segment(shape: _Shape, settings: Settings, source: np.ndarray) -> tuple[dict, np.ndarray]:
    """Chunks {(level, kind): payload} of one segment and (levels, 2) errors of stopping at each level."""
    plan, last = shape.plan, shape.plan.level_count - 1
    coded = _code_stems(shape, settings, source)
    segment = coded.segment
    segment.analyse_nodes(source, settings.node_quality, settings.level_errors, qz.DEAD_ZONE)
    chunks: dict[tuple[int, int], bytes] = {(level, ct.STEMS): data for level, data in coded.stems.items()}
    for level in range(plan.level_count):
        if plan.has_affines(level):
            chunks[level, ct.AFFINES] = entropy.encode_affines(segment, level)
    if len(coded.corrections):
        chunks[last, ct.CORRECTIONS] = coded.correction_chunk
    errors = np.zeros((plan.level_count, 2))
    for level in range(plan.level_count):
        positions = coded.positions if level == last else segment.pose(level, shape.origin, shape.dtype)
        largest, squares = position_error(positions, source, shape.origin)
        errors[level] = largest, math.sqrt(squares / (source.shape[0] * source.shape[2]))
    if errors[last, 0] > settings.bound:
        raise AssertionError(f"decoded error {errors[last, 0]} is beyond the bound {settings.bound}")
    return chunks, errors


# ---- choosing ----


class _Search:
    """Finds settings by coding a sample of the segments with each candidate and counting the bytes."""

    def __init__(self, job: _Job, ath: Ath, bound: float, limit: float):
        self.job, self.ath = job, ath
        relative = bound / job.seen.diagonal if job.seen.diagonal > 0 else 1e-4
        step, rest_step = bound * qz.first_step_ratio(relative), bound * qz.rest_step_ratio(relative)
        self.levels = ath.height + 2
        self.sample = job.source(len(job.segments) // 2)
        self.start = Settings(bound, limit, qz.single(step), qz.single(rest_step), job.wide,
                              _loose_branches(job, self.sample), _lags(job, rest_step), (0,) * self.levels,
                              (False,) * self.levels, self._level_errors(bound))

    def _level_errors(self, bound: float) -> np.ndarray:
        """What independent least-squares maps would leave at each level, in a few frames; at least the bound."""
        some = np.linspace(0, self.sample.shape[2] - 1, min(8, self.sample.shape[2])).astype(int)
        frames = np.empty((len(some), *self.sample.shape[:2]))
        frames[:, self.job.hierarchy.vertex_source] = np.moveaxis(self.sample[:, :, some], 2, 0) + self.job.origin
        errors = np.full(self.levels, bound)
        for level in range(self.levels - 1):
            left = self.ath.approximation(frames, level) - frames
            errors[level] = max(bound, math.sqrt((left**2).sum() / (frames.size / 3)))
        return errors

    def best(self) -> Settings:
        report = self.job.report
        steps = [self._with_basis, self._with_rotations, self._with_learned, self._with_basis, self._with_steps]
        if self.job.effort == "fast":
            steps = [self._with_rotations]
        elif self.job.effort == "best":
            steps += [self._with_rotations, self._with_learned, self._with_steps]
        settings = self.start
        for done, step in enumerate([*steps, self._with_node_quality]):
            report("search", done / (len(steps) + 1))
            settings = step(settings)
        report("search", 1.0)
        return settings

    def cost(self, settings: Settings) -> tuple[float, np.ndarray]:
        """(bytes of a whole file, bytes per level in the sample) at these settings."""
        shape = _Shape(self.job, self.ath, settings)
        try:
            coded = _code_stems(shape, settings, self.sample)
        except BoundError:
            return math.inf, np.full(self.levels, math.inf)
        levels = np.zeros(self.levels)
        for level, data in coded.stems.items():
            levels[level] = len(data)
        corrections = len(coded.correction_chunk)
        if corrections:
            levels += corrections * self._share(shape.plan, coded.corrections)
        scale = self.job.clip.frame_count / self.sample.shape[2]
        return levels.sum() * scale + shape.prelude_bytes, levels

    def _share(self, plan: Plan, corrections: np.ndarray) -> np.ndarray:
        """Fractions of the corrections that fall on the pieces of each level."""
        level_of_vertex = np.repeat(np.where(plan.pieces["low_level"] >= 0, plan.pieces["low_level"],
                                             plan.pieces["level"]), plan.pieces["count"])
        counts = np.bincount(level_of_vertex[corrections[:, 0]], minlength=self.levels)
        return counts / counts.sum()

    def _costs(self, candidates: list[Settings]) -> list[tuple[float, np.ndarray]]:
        with ThreadPoolExecutor(_threads()) as pool:
            return list(pool.map(self.cost, candidates))

    def _with_basis(self, settings: Settings) -> Settings:
        """The spatial basis of each branch: all alike, or by shape; judged without rotations and with some."""
        sheets = [self.job.wide, np.zeros_like(self.job.wide), np.ones_like(self.job.wide)]
        if not self.job.wide.any() or self.job.wide.all():
            sheets = sheets[1:]
        omegas = {settings.omega, (2,) * self.levels} if not any(settings.omega) else {settings.omega}
        candidates = [replace(settings, sheet=sheet, omega=omega) for sheet in sheets for omega in sorted(omegas)]
        costs = [cost for cost, _ in self._costs(candidates)]
        return replace(candidates[int(np.argmin(costs))], omega=settings.omega)

    def _with_rotations(self, settings: Settings) -> Settings:
        factors = (0, 2) if self.job.effort == "fast" else qz.ROTATION_FACTORS
        candidates = [replace(settings, omega=(k,) * self.levels) for k in factors]
        per_level = np.array([levels for _, levels in self._costs(candidates)])
        chosen = per_level.argmin(axis=0)
        return replace(settings, omega=tuple(int(factors[i]) for i in chosen))

    def _with_learned(self, settings: Settings) -> Settings:
        """Learned time bases for the levels whose streams they shorten, where the file as a whole gets shorter."""
        learning = replace(settings, learned=(True,) * self.levels)
        (cost, cosines), (_, learned) = self._costs([settings, learning])
        mixed = replace(settings, learned=tuple((learned < cosines).tolist()))
        return mixed if any(mixed.learned) and self.cost(mixed)[0] < cost else settings

    def _with_steps(self, settings: Settings) -> Settings:
        """Walks step, then rest step, to the cheapest on a geometric grid."""
        settings = self._walk(settings, "step", 1.15, math.inf)
        return settings if self.job.exact_rest else self._walk(settings, "rest_step", 1.4, qz.REST_CAP * settings.bound)

    def _walk(self, settings: Settings, name: str, factor: float, cap: float) -> Settings:
        def moved(exponent: int) -> Settings:
            return replace(settings, **{name: qz.single(min(getattr(settings, name) * factor**exponent, cap))})

        def costs_at(exponents) -> dict[int, float]:
            return dict(zip(exponents, (cost for cost, _ in self._costs([moved(e) for e in exponents]))))

        costs = costs_at((-1, 0, 1))
        while True:
            best = min(costs, key=costs.get)
            wanted = [e for e in (best - 1, best + 1) if e not in costs and abs(e) <= 10]
            if not wanted:
                return moved(best)
            costs |= costs_at(wanted)

    def _with_node_quality(self, settings: Settings) -> Settings:
        """The finest maps of inner nodes that keep to their share of the file."""
        shape = _Shape(self.job, self.ath, settings)
        coded = _code_stems(shape, settings, self.sample)
        scale = self.job.clip.frame_count / self.sample.shape[2]
        rest = coded.bytes * scale + shape.prelude_bytes
        allowed = max(qz.NODE_BYTES, qz.NODE_SHARE / (1 - qz.NODE_SHARE) * rest)
        for quality in qz.NODE_QUALITIES:
            coded.segment.clear_nodes()
            coded.segment.analyse_nodes(self.sample, quality, settings.level_errors, qz.DEAD_ZONE)
            size = sum(len(entropy.encode_affines(coded.segment, level)) for level in range(self.levels)
                       if shape.plan.has_affines(level))
            if size * scale <= allowed:
                break
        return replace(settings, node_quality=quality)


def _thin_branches(job: _Job) -> np.ndarray:
    """Branches that look like beams: the way along their vertices is not much longer than they are wide."""
    hierarchy, rest = job.hierarchy, job.rest
    first = hierarchy.first_vertex
    steps = np.zeros(len(rest))
    steps[1:] = np.linalg.norm(np.diff(rest, axis=0), axis=1)
    steps[first] = 0.0
    way = np.add.reduceat(steps, first)
    return way <= 1.3 * _stem_sizes(job)


def _bound_for_size(job: _Job, target: int) -> float:
    """A bound whose file takes 97 to 100 % of `target` bytes, or the finest that does not exceed it. Raises BoundError.

    Size falls about as the square root of the bound; between two known sizes it is interpolated in logarithms.
    """
    diagonal = job.seen.diagonal or 1.0
    least = qz.least_bound(job.seen.low, job.seen.high, job.clip.dtype)
    low, high = 1e-7, max(0.1, 2 * least / diagonal)  # low: too large a file; high: one that fits, once tried
    sizes: dict[float, int] = {}
    guess = min(DEFAULT_REL_ERROR, high)
    while high / low > 1.02 and sizes.get(high, 0) < 0.97 * target:
        job.report("size", len(sizes) / (len(sizes) + 4))
        sizes[guess] = _file_size(job, guess * diagonal)
        low, high = (low, guess) if sizes[guess] <= target else (guess, high)
        guess = _next_guess(low, high, sizes, target)
    if sizes.get(high, target + 1) > target:
        raise BoundError(f"target size: got {target} bytes; expected at least {_file_size(job, high * diagonal)} for "
                         f"this clip")
    return high * diagonal


def _file_size(job: _Job, bound: float) -> float:
    with tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
        try:
            result = job.encode(bound, ct.ChunkStore(spool))
        except BoundError:
            return math.inf
    return result.store.size(result.header)


def _next_guess(low: float, high: float, sizes: dict[float, float], target: int) -> float:
    """Where in [low, high] the size is expected to be just below the target."""
    wanted = math.log(0.985 * target)
    if low in sizes and high in sizes and math.isfinite(sizes[low]):
        a, b = math.log(sizes[low]), math.log(sizes[high])
        part = (a - wanted) / (a - b) if a > b else 0.5
        return low * (high / low) ** min(max(part, 0.05), 0.95)
    known = low if low in sizes else high
    if not math.isfinite(sizes[known]):
        return math.sqrt(low * high)
    guess = known * math.exp((math.log(sizes[known]) - wanted) / 0.5)
    return min(max(guess, low * 1.01), high if high not in sizes else high / 1.01)


def _summary(path: Path, clip: MotionClip, job: _Job, result: _Result, chunks: list[ct.Chunk]) -> Summary:
    from athcodec.decoder import Decoder

    with Decoder(path, strict=True) as decoder:
        depths = [LevelSummary(d.depth, d.nodes, d.bytes, d.max_error, d.rms_error) for d in decoder.depths]
        table = decoder.table1()
    sizes: dict[str, int] = {}
    for chunk in chunks:
        name = ct.KIND_NAMES[chunk.kind]
        sizes[name] = sizes.get(name, 0) + chunk.length
    sizes["HEADER"] = result.header.file_length - sum(sizes.values())
    settings, bound = result.settings, result.settings.bound
    choices = {"step_ratio": settings.step / bound, "rest_step_ratio": settings.rest_step / bound,
               "rotations": list(settings.omega), "learned": list(settings.learned),
               "sheets": int(settings.sheet.sum())}
    diagonal = job.seen.diagonal
    return Summary(path, result.header.file_length, clip.frame_count * clip.vertex_count * 12, bound,
                   bound / diagonal if diagonal > 0 else 0.0, table, depths, sizes, choices)
