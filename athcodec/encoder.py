"""From a motion clip to one .ath file: the stages of FORMAT.md run forward, in closed loop, segment by segment.

The source is read twice: once for what needs all frames (bounding box, TAM), once to code. What the file promises is
checked on what a decoder will output: every level of every segment is decoded and measured, and what is beyond the
bound at the last level is corrected before it is written. Settings come from search.py, the streams of a segment from
coding.py. `encode` does all of it; `draft`, `code_segments` and `write` are its three steps, for several processes that
work on one clip.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from athcodec import container as ct
from athcodec import entropy
from athcodec import quantize as qz
from athcodec.ath import Ath, Survey, Thresholds, survey
from athcodec.ath_file import Level
from athcodec.atomic_files import check_target, new_file
from athcodec.clip import MotionClip
from athcodec.coding import Settings, Shape, Source, code_segment, threads
from athcodec.crew import Crew, default_jobs
from athcodec.decoder import Decoder
from athcodec.decoder import open as open_ath
from athcodec.discovery import Found, candidates, with_branches
from athcodec.errors import BoundError, ClipError
from athcodec.hierarchy import Hierarchy, derived_edges, hierarchy_of
from athcodec.progress import Course, Progress
from athcodec.progress import weights as stage_weights
from athcodec.search import EFFORTS, SAMPLES, decide
from athcodec.shapes import Shapes
from athcodec.transform import DEFAULT_SEGMENT, MAX_SEGMENT, MIN_SEGMENT, split_segments

DEFAULT_REL_ERROR = 1e-4
LOSSLESS_REL_ERROR = 4e-7  # about where a lossless file is smallest
SPOOL_BYTES = 64 << 20
TRIAL_FRAMES = 64  # that candidates for branches are tried on
STATIC_METADATA = ("unit", "up_axis")
WEIGHTS = "error_weights"  # metadata: name of the attribute that holds factors on the bound; or that attribute


@dataclass(frozen=True)
class Seam:
    """Where a loop begins again, in scene units. step: the largest way of any vertex from the source's last frame to
    its first; step_beside: from frame to frame beside that, which it resembles in a seamless loop; error: how far off
    the file's step is at most."""

    clip: str
    step: float
    step_beside: float
    error: float


@dataclass(frozen=True)
class Summary:
    """What `encode` made."""

    path: Path
    bytes: int
    raw_bytes: int
    max_error_bound: float
    relative_bound: float
    table1: dict
    levels: list[Level]
    chunk_bytes: dict[str, int]
    choices: dict
    seams: tuple[Seam, ...] = ()

    @property
    def ratio(self) -> float:
        """Raw positions over the whole file."""
        return self.raw_bytes / self.bytes


def encode(clip: MotionClip, path, *, max_error: float | None = None, rel_error: float | None = None,
           target_size: int | None = None, segment_frames: int | None = None, tam: Thresholds | None = None,
           exact_rest: bool = False, lossless: bool = False, weights: str | np.ndarray | None = None,
           attributes: str = "all", effort: str = "default", jobs: int | None = None,
           progress: Progress | None = None) -> Summary:
    """Compresses a clip into an .ath file at `path`, which appears only when it is whole.

    max_error: bound in scene units on the distance of every vertex in every frame; or rel_error: the same as a fraction
    of the bounding box's diagonal over all frames (default 1e-4, lossless 4e-7); or target_size: bytes, the smallest
    bound that fits. segment_frames: longest segment, 16 to 256. tam: acceptance thresholds of the ATH (default: one map
    per frame stays within the bound). exact_rest: keep the rest pose bit for bit. lossless: one more level gives the
    positions bit for bit, and the rest pose is kept likewise; the bound is that of the level before. weights: a factor
    on the bound for each vertex, (N,) above 0, or the name of the attribute that holds them: vertex v is within
    weights[v] times the bound, the largest of which the file promises for all. attributes: "none" drops faces, edges
    and named arrays. jobs: threads (default: one per core, at most 4, fewer for large meshes); the file is the same
    whatever their number, memory grows with it. progress: called with the stage ("survey", "search", "motion" ...) and
    about what part of all the time is over; it never falls and ends with 1.0. A clip without branches gets those that
    discovery.py finds. Several clips of one plant go into one file when they have been joined (joining.py). Raises
    ClipError, BoundError, ValueError, OSError.
    """
    _check_options(max_error, rel_error, target_size, segment_frames, attributes, effort, jobs)
    check_target(path)  # before any work
    report = _course(clip, progress, segment_frames, effort, target_size)
    job = _Job.begin(clip, report, jobs, rel_error=rel_error, segment_frames=segment_frames, tam=tam,
                     exact_rest=exact_rest, lossless=lossless, weights=weights, attributes=attributes, effort=effort)
    bound = job.bound(max_error, rel_error, target_size)
    with new_file(path) as out, clip.watched(), tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
        decided = job.decide(bound)
        return job.write(path, out, spool, decided, job.coded(decided, range(job.segment_count)))


@dataclass(frozen=True)
class Draft:
    """All that is decided about a file before its motion is coded, without the motion. It can be pickled.

    With the same clip, which may have been opened again elsewhere, it goes to `code_segments` and `write`. `fingerprint`
    tells a process that arrives at another hierarchy or rest pose for it than the one that made the draft.
    """

    settings: Settings
    shapes: Shapes | None
    seen: Survey
    segment_count: int
    found: Found | None  # branches, for a clip without
    weights: str | np.ndarray | None
    options: dict  # what _Job takes besides
    fingerprint: str


@dataclass(frozen=True)
class CodedSegment:
    """One segment: chunks {(level, kind): payload}, and (levels, 2) errors of stopping at each level."""

    index: int
    chunks: dict[tuple[int, int], bytes]
    errors: np.ndarray


def draft(clip: MotionClip, *, max_error: float | None = None, rel_error: float | None = None,
          target_size: int | None = None, segment_frames: int | None = None, attributes: str = "all",
          effort: str = "default", jobs: int | None = None, progress: Progress | None = None, **options) -> Draft:
    """The first step of `encode`, whose options it takes: branches, survey, and the search for settings."""
    _check_options(max_error, rel_error, target_size, segment_frames, attributes, effort, jobs)
    report = _course(clip, progress, segment_frames, effort, target_size, draft=True)
    with clip.watched():
        job = _Job.begin(clip, report, jobs, rel_error=rel_error, segment_frames=segment_frames,
                         attributes=attributes, effort=effort, **options)
        return job.draft(job.decide(job.bound(max_error, rel_error, target_size)))


def code_segments(clip: MotionClip, draft: Draft, segments: Iterable[int], *,
                  jobs: int | None = None) -> Iterator[CodedSegment]:
    """The second step: some of the segments 0 to draft.segment_count - 1, in ascending order, one after the other.

    Raises ClipError where the clip is not the one that the draft was made of, as far as that shows.
    """
    job = _Job.resume(clip, draft, _silent, jobs)
    with clip.watched():
        yield from job.coded(job.decided(draft), list(segments))


def write(clip: MotionClip, draft: Draft, coded: Iterable[CodedSegment], path, *,
          progress: Progress | None = None) -> Summary:
    """The third step: the file that `encode` writes, of all segments, which may come in any order. Raises as
    `code_segments` does, and ValueError where segments are missing."""
    check_target(path)
    job = _Job.resume(clip, draft, Course(progress, {"motion": 1.0}))
    with new_file(path) as out, clip.watched(), tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
        return job.write(path, out, spool, job.decided(draft), coded)


def _silent(stage: str, fraction: float) -> None:
    pass


def _course(clip: MotionClip, progress: Progress | None, segment_frames: int | None, effort: str,
            target_size: int | None, draft: bool = False) -> Course:
    segments = split_segments(clip.frame_count, clip.vertex_count, segment_frames or DEFAULT_SEGMENT,
                              ct.Limits.memory_bytes)
    return Course(progress, stage_weights(clip.vertex_count, segments, effort,
                                          samples=min(SAMPLES, len(clip.clip_range_frames)),
                                          branches=not clip.has_branches,
                                          sizes=target_size is not None, motion=not draft))


def _check_options(max_error, rel_error, target_size, segment_frames, attributes, effort, jobs) -> None:
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
    if jobs is not None and jobs < 1:
        raise ValueError(f"jobs: got {jobs}; expected at least 1")
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


def _best_branches(clip: MotionClip, fraction: float, report: Progress) -> Found:
    """Of the branches that may be right those that make the smallest file of a few frames."""
    found = candidates(clip)
    if len(found) == 1:
        return found[0]
    start = max(0, (clip.frame_count - TRIAL_FRAMES) // 2)
    stop = min(clip.frame_count, start + TRIAL_FRAMES)
    some = MotionClip(clip.block(start, stop), np.arange(start, stop) / clip.fps,
                      rest=clip.rest.astype(clip.rest_dtype))

    def size(each: Found, part: float) -> float:
        report("branches", part)
        return _trial_size(with_branches(some, each), fraction, clip.frame_count / some.frame_count)

    least, best = min(((size(each, (i + 1) / (len(found) + 2)), each) for i, each in enumerate(found)),
                      key=lambda tried: tried[0])
    if best.stem_index is None or best.method != "motion":
        return best
    unordered = dataclasses.replace(best, stem_index=None)  # the source's order costs nothing to say
    return unordered if size(unordered, (len(found) + 1) / (len(found) + 2)) < least else best


def _trial_size(clip: MotionClip, fraction: float, longer: float) -> float:
    """Bytes of a file of a clip that is so many times longer."""
    hierarchy = hierarchy_of(clip)
    source = Source(clip, hierarchy, survey(clip, hierarchy), DEFAULT_SEGMENT, exact_rest=False)
    job = _Job(source, None, False, "default", False)
    with tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
        try:
            entries = job.encode(_relative_bound(fraction, job), ct.ChunkStore(spool)).store.entries
        except BoundError:
            return math.inf
    return sum(chunk.length * (longer if chunk.is_motion and chunk.kind != ct.SHAPES else 1) for chunk, _ in entries)


def _completed(clip: MotionClip, found: Found | None,
               weights: str | np.ndarray | None) -> tuple[MotionClip, np.ndarray | None]:
    """The clip on branches that were found for it, and its weights, which it then names."""
    if found is not None:
        clip = with_branches(clip, found)
    return (clip, None) if weights is None else _weighted(clip, weights)


def _weighted(clip: MotionClip, weights: str | np.ndarray) -> tuple[MotionClip, np.ndarray]:
    """The clip, which says where its weights are, and these as (N,) float64. Raises ClipError."""
    name = weights if isinstance(weights, str) else WEIGHTS
    attributes = clip.attributes if isinstance(weights, str) else clip.attributes | {name: np.asarray(weights)}
    if name not in attributes:
        raise ClipError(f"weights: got {name!r}, expected one of {', '.join(attributes) or 'no attributes'}")
    array = attributes[name]
    if array.size != clip.vertex_count or array.dtype.kind not in "biuf":
        raise ClipError(f"weights: got {array.dtype} of shape {array.shape} in {name!r}, expected a number for each of "
                        f"{clip.vertex_count} vertices")
    values = array.reshape(-1).astype(np.float64)
    bad = np.flatnonzero(~((values > 0) & np.isfinite(values)))
    if bad.size:
        raise ClipError(f"weights: vertex {bad[0]} has {values[bad[0]]:g} in {name!r}, expected a number above 0")
    metadata = clip.metadata | {WEIGHTS: name}
    rest = clip.rest.astype(clip.rest_dtype)
    return dataclasses.replace(clip, attributes=attributes, metadata=metadata, rest=rest), values


def time_chunk(*times: np.ndarray) -> bytes:
    """Content of TIME for times in seconds, (T,) for each clip, exactly: by rules where these give the very same
    numbers."""
    steady = ct.pack_steady_time(*times)
    return steady or ct.pack_time(entropy.encode_times(np.concatenate(times).astype(np.float64)))


def _relative_bound(fraction: float | None, job: _Job) -> float:
    """A fraction (None: the default) of the diagonal; where nothing has any extent, of that with the rest pose."""
    least = 2 * qz.least_bound(job.seen.low, job.seen.high, job.clip.dtype)
    if fraction is None and job.lossless:
        return max(LOSSLESS_REL_ERROR * job.source.extent, least, job.source.extent / qz.LARGEST_EXTENT)
    fraction = fraction or DEFAULT_REL_ERROR
    return fraction * job.seen.diagonal if job.seen.diagonal > 0 else max(fraction * job.source.extent, least)


def _survey_options(tam: Thresholds | None) -> dict:
    return {} if tam is None else {"lam": tam.lam, "xi": tam.xi, "eta": tam.eta}


@dataclass
class _Decided:
    """What the streams of a file depend on: settings, and what follows from them."""

    ath: Ath
    settings: Settings
    shape: Shape
    shapes: Shapes | None

    @property
    def fingerprint(self) -> str:
        return hashlib.sha256(self.shape.hierarchy_stream + self.shape.rest_chunk.stream).hexdigest()


@dataclass
class _Result:
    store: ct.ChunkStore
    header: ct.Header
    errors: np.ndarray


@dataclass
class _Job:
    """One clip on its way into a file: what does not depend on the bound."""

    source: Source
    tam: Thresholds | None
    keep_static: bool
    effort: str
    lossless: bool
    report: Progress = _silent  # by stages, see progress.py
    jobs: int | None = None
    found: Found | None = None
    weights: str | np.ndarray | None = None

    @classmethod
    def begin(cls, clip: MotionClip, report: Progress, jobs: int | None, *, rel_error: float | None = None,
              segment_frames: int | None = None, tam: Thresholds | None = None, exact_rest: bool = False,
              lossless: bool = False, weights: str | np.ndarray | None = None, attributes: str = "all",
              effort: str = "default") -> _Job:
        """With branches found, where the clip has none, and all frames seen."""
        clip.check()
        found = None
        if not clip.has_branches:
            report("branches", 0.0)
            found = _best_branches(clip, rel_error or DEFAULT_REL_ERROR, report)
        clip, factors = _completed(clip, found, weights)
        hierarchy = hierarchy_of(clip)
        _check_limits(clip, hierarchy)
        crew = Crew(jobs or default_jobs())
        seen = survey(clip, hierarchy, progress=lambda f: report("survey", f), crew=crew, **_survey_options(tam))
        source = Source(clip, hierarchy, seen, segment_frames or DEFAULT_SEGMENT, exact_rest or lossless,
                        None if factors is None else factors[hierarchy.vertex_source], crew)
        return cls(source, tam, attributes == "all", effort, lossless, report, jobs, found, weights)

    @classmethod
    def resume(cls, clip: MotionClip, draft: Draft, report: Progress, jobs: int | None = None) -> _Job:
        """As far as the job was that made the draft. Raises ClipError."""
        seen, hierarchy = draft.seen, draft.seen.hierarchy
        got, expected = (clip.frame_count, clip.vertex_count), (seen.frame_count, hierarchy.vertex_count)
        if got != expected:
            raise ClipError(f"clip: got {got} frames and vertices, expected {expected} as in the draft")
        clip, factors = _completed(clip, draft.found, draft.weights)
        options = dict(draft.options)
        source = Source(clip, hierarchy, seen, options.pop("segment_frames"), options.pop("exact_rest"),
                        None if factors is None else factors[hierarchy.vertex_source], Crew(jobs or default_jobs()))
        return cls(source, **options, report=report, jobs=jobs, found=draft.found, weights=draft.weights)

    @property
    def clip(self) -> MotionClip:
        return self.source.clip

    @property
    def seen(self) -> Survey:
        return self.source.seen

    @property
    def segment_count(self) -> int:
        return len(self.source.segments)

    def thresholds(self, bound: float) -> Thresholds:
        return self.tam or Thresholds(bound, 0, bound, 0)

    def bound(self, max_error: float | None, rel_error: float | None, target_size: int | None) -> float:
        if target_size is not None:
            return _bound_for_size(self, target_size)
        return max_error if max_error is not None else _relative_bound(rel_error, self)

    def decide(self, bound: float) -> _Decided:
        """Searches for settings."""
        qz.check_bound(self.source.smallest_bound(bound), self.seen.low, self.seen.high, self.clip.dtype,
                       self.source.extent)
        ath = self.seen.ath(self.thresholds(bound))
        return _Decided(ath, *decide(self.source, ath, bound, self.effort, self.report, self.jobs))

    def draft(self, decided: _Decided) -> Draft:
        options = {"tam": self.tam, "keep_static": self.keep_static, "effort": self.effort, "lossless": self.lossless,
                   "segment_frames": self.source.segment_frames, "exact_rest": self.source.exact_rest}
        return Draft(decided.settings, decided.shapes, self.seen, self.segment_count, self.found, self.weights, options,
                     decided.fingerprint)

    def decided(self, draft: Draft) -> _Decided:
        """What the draft's maker had decided, made again. Raises ClipError where it is not the same."""
        ath = self.seen.ath(self.thresholds(draft.settings.bound))
        decided = _Decided(ath, draft.settings, Shape(self.source, ath, draft.settings), draft.shapes)
        if decided.fingerprint != draft.fingerprint:
            raise ClipError("clip: got another rest pose or hierarchy than that of the draft, expected the same clip, "
                            "on machines that calculate alike")
        return decided

    def encode(self, bound: float, store: ct.ChunkStore) -> _Result:
        decided = self.decide(bound)
        return self.fill(store, decided, self.coded(decided, range(self.segment_count)))

    def write(self, path, out: BinaryIO, spool: BinaryIO, decided: _Decided,
              coded: Iterable[CodedSegment]) -> Summary:
        """The whole file into `out`, which is to become `path`."""
        result = self.fill(ct.ChunkStore(spool), decided, coded)
        chunks = result.store.write(out, result.header, result.errors)
        if any(clip_range.loop for clip_range in self.clip.clip_ranges):
            with open_ath(out, strict=True) as decoder:
                result.store.replace(ct.CLIPS, self._clips(self._seam_errors(decoder)))
            out.seek(0)
            chunks = result.store.write(out, result.header, result.errors)
        with open_ath(out, strict=True) as decoder:  # before the file gets its name
            summary = _summary(Path(path), self, decided, result, chunks, decoder)
        self.report("done", 1.0)
        return summary

    def fill(self, store: ct.ChunkStore, decided: _Decided, coded: Iterable[CodedSegment]) -> _Result:
        """All chunks of a file."""
        shape = decided.shape
        self._add_prelude(store, shape, decided.ath)
        for level, stream in entropy.encode_shapes(shape.plan, decided.shapes).items():
            store.add(ct.SHAPES, stream, level)
        errors = self._add_motion(store, shape, coded)
        self._add_static(store)
        if self.clip.clip_ranges:
            store.add(ct.CLIPS, self._clips([np.zeros(len(errors))] * len(self.clip.clip_ranges)))
        header = ct.Header(self.clip.vertex_count, self.clip.branch_count, self.clip.frame_count,
                           self.segment_count, len(errors), len(errors),
                           0.0 if self.lossless else self.source.largest_bound(decided.settings.bound),
                           self.clip.dtype == np.float64, len(self.clip.clip_range_frames))
        return _Result(store, header, errors)

    def _clips(self, seam_errors: Sequence[Sequence[float] | None]) -> bytes:
        segment_counts = [len(segments) for segments in self.source.clip_range_segments]
        return ct.pack_clips(self.clip.clip_ranges, segment_counts, seam_errors)

    def _seam_errors(self, decoder: Decoder) -> list[list[float] | None]:
        """Of each clip, if it is a loop: how far off its step from the last frame to the first is, per level."""
        return [self._seam_errors_of(decoder.play(clip.name), self._step(stop - 1, start)) if clip.loop else None
                for clip, (start, stop) in zip(decoder.clips, self.clip.clip_range_frames)]

    @staticmethod
    def _seam_errors_of(loop: Decoder, step: np.ndarray) -> list[float]:
        errors = []
        for level in range(loop.level_count):
            last, first = (loop.positions(frame, level, np.float64) for frame in (-1, 0))
            errors.append(np.linalg.norm(first - last - step, axis=1).max())
        return errors

    def _step(self, frame: int, following: int) -> np.ndarray:
        """Ways of the vertices from one frame of the source to another, (N, 3) float64."""
        before, after = (self.clip.block(each, each + 1)[0].astype(np.float64) for each in (frame, following))
        return after - before

    def seams(self, decoder: Decoder) -> tuple[Seam, ...]:
        """Of the loops of the file just written."""
        seams = []
        for clip, (start, stop) in zip(decoder.clips, self.clip.clip_range_frames):
            if clip.loop:
                beside = [(start, min(start + 1, stop - 1)), (max(stop - 2, start), stop - 1)]
                step, *steps = (np.linalg.norm(self._step(*frames), axis=1).max()
                                for frames in [(stop - 1, start), *beside])
                seams.append(Seam(clip.name, float(step), float(max(steps)), clip.seam_errors[-1]))
        return tuple(seams)

    def _add_prelude(self, store: ct.ChunkStore, shape: Shape, ath: Ath) -> None:
        limits = ath.thresholds
        store.add(ct.HIERARCHY, ct.pack_hierarchy((limits.epsilon, limits.eta, limits.xi, limits.lam),
                                                  shape.hierarchy_stream))
        store.add(ct.REST, ct.pack_rest(shape.rest_chunk))
        store.add(ct.TIME, time_chunk(*(self.clip.time[start:stop] for start, stop in self.clip.clip_range_frames)))
        metadata = self.clip.metadata if self.keep_static else {
            key: self.clip.metadata[key] for key in STATIC_METADATA if key in self.clip.metadata}
        if metadata:
            store.add(ct.METADATA, ct.pack_metadata(metadata))
        if self.keep_static and self.clip.faces is not None:
            store.add(ct.FACES, ct.pack_array(self.clip.faces))
        if self.keep_static and self.clip.edges is not None:
            store.add(ct.EDGES, self._edges())

    def _edges(self) -> bytes:
        derived = derived_edges(self.source.hierarchy)
        if derived.shape == self.clip.edges.shape and (derived == self.clip.edges).all():
            return ct.pack_array(None, derived=self.clip.edges.dtype.str)
        return ct.pack_array(self.clip.edges)

    def _add_static(self, store: ct.ChunkStore) -> None:
        if self.keep_static and len(self.clip.attributes) > ct.Limits.attributes:
            raise ClipError(f"attributes: got {len(self.clip.attributes)}; expected at most {ct.Limits.attributes}")
        if self.keep_static:
            for name, array in self.clip.attributes.items():
                store.add(ct.ATTRIBUTE, ct.pack_array(array, name))

    def coded(self, decided: _Decided, segments: Sequence[int]) -> Iterator[CodedSegment]:
        """Some segments, coded a few at a time, while the next one is read."""
        def code(taken: tuple[int, list[np.ndarray]]) -> CodedSegment:
            index, blocks = taken
            positions, exact = self._positions(blocks.pop())  # not held any longer
            return CodedSegment(index, *code_segment(decided.shape, decided.settings, positions, decided.shapes, exact))

        at_once = threads(self.jobs, self.source)
        crew = Crew(at_once, beside=self.source.crew.jobs > 1)
        return crew.ordered(code, ((index, [self.source.block(index)]) for index in segments), at_once)

    def _positions(self, block: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """What is coded of a block, and its own numbers where these are to come back."""
        return self.source.relative(block), self.source.exact(block) if self.lossless else None

    def _add_motion(self, store: ct.ChunkStore, shape: Shape, coded: Iterable[CodedSegment]) -> np.ndarray:
        """Returns (levels, segments, 2) errors. Raises ValueError unless each segment comes once."""
        errors = np.zeros((shape.plan.level_count + self.lossless, self.segment_count, 2))
        missing = set(range(self.segment_count))
        for segment in coded:
            if segment.index not in missing:
                raise ValueError(f"segments: got {segment.index} twice or beyond the last, expected each once")
            missing.remove(segment.index)
            errors[:, segment.index] = segment.errors
            for (level, kind), payload in segment.chunks.items():
                store.add(kind, payload, level, segment.index)
            self.report("motion", 1 - len(missing) / self.segment_count)
        if missing:
            raise ValueError(f"segments: got {self.segment_count - len(missing)}, expected all {self.segment_count}")
        return errors


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
            result = dataclasses.replace(job, report=_silent).encode(bound, ct.ChunkStore(spool))
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


def _summary(path: Path, job: _Job, decided: _Decided, result: _Result, chunks: list[ct.Chunk],
             decoder: Decoder) -> Summary:
    sizes: dict[str, int] = {}
    for chunk in chunks:
        name = ct.KIND_NAMES[chunk.kind]
        sizes[name] = sizes.get(name, 0) + chunk.length
    sizes["HEADER"] = result.header.file_length - sum(sizes.values())
    settings, bound = decided.settings, decided.settings.bound
    choices = {"step_ratio": settings.step / bound, "rest_step_ratio": settings.rest_step / bound,
               "rotations": list(settings.omega), "learned": list(settings.learned),
               "sheets": int(settings.sheet.sum()),
               "shaped": 0 if settings.shaped is None else int(settings.shaped.sum())}
    diagonal, raw = job.seen.diagonal, job.clip.frame_count * job.clip.vertex_count * 12
    return Summary(path, result.header.file_length, raw, settings.largest_bound,
                   bound / diagonal if diagonal > 0 else 0.0, decoder.file.table1(), decoder.file.levels, sizes, choices,
                   job.seams(decoder))
