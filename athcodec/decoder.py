"""From an .ath file back to motion: any depth, any frames, any part that is there.

`open` reads the prelude; a segment's chunks are read when one of its frames is asked for, and only those of the levels
that the depth needs. Decoding is the C core's (player.py); this module feeds it bytes, says in words what it refuses,
and reads the static data. It never imports the encoder.
"""

from __future__ import annotations

import builtins
import copy
import os
import threading
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from athcodec import container as ct
from athcodec import player
from athcodec._native import WHOLE, as_bytes
from athcodec.ath import stem_maps
from athcodec.clip import check_stem_index
from athcodec.container import Container, Limits
from athcodec.errors import (
    BadChecksum,
    BadChunk,
    BadChunkTable,
    BadHeader,
    ClipError,
    ClipUnavailable,
    LevelUnavailable,
    LimitExceeded,
    Truncated,
    error_class,
)
from athcodec.files import is_url
from athcodec.hierarchy import Hierarchy, derived_edges
from athcodec.joining import metadata_of
from athcodec.transform import balanced_segments

INTEGER_TYPES = [np.dtype(f"{order}{kind}{size}").str for order in "<>" for kind in "iu" for size in (1, 2, 4, 8)]
SHOWN_TYPES = (np.dtype(np.float32), np.dtype(np.float64))
TABLE_KEYS = ("epsilon", "eta", "xi", "lam")


@dataclass(frozen=True)
class Depth:
    """One level of detail: bytes of the file cut after it, errors in scene units against the source."""

    depth: int
    nodes: int
    bytes: int
    max_error: float
    rms_error: float
    available: bool


@dataclass(frozen=True)
class Clip:
    """A clip of a file. Frames and segments are numbered over the whole file, one clip after the other.

    seam_errors: for a loop, how well each level of the full file keeps the step from the last frame to the first, the
    most that any vertex's is off, scene units; empty for others.
    """

    name: str
    first_frame: int
    frame_count: int
    first_segment: int
    segment_count: int
    loop: bool
    duration: float  # seconds from the first frame to the last
    seam_errors: tuple[float, ...]

    @property
    def segments(self) -> range:
        return range(self.first_segment, self.first_segment + self.segment_count)


@dataclass(frozen=True)
class Affines:
    """What moves as one: per part its branch, vertex range (file order), kind, and 3x4 matrix in absolute positions."""

    branch: np.ndarray  # (K,) source branch numbers
    first_vertex: np.ndarray  # (K,) int32, file order
    vertex_count: np.ndarray  # (K,) int32
    is_stem: np.ndarray  # (K,) bool: an exact stem (least-squares matrix), else a node of the ATH
    matrices: np.ndarray  # (K, 3, 4) float64


def open(path, *, clip: str | None = None, strict: bool = False, allow_partial: bool = False,
         limits: Limits | None = None) -> Decoder:
    """Opens an .ath file: a path, a URL (remote.py), or a seekable binary file object.

    clip: the name of the one to play (default: the first). strict: refuse a file shorter or longer than it says.
    allow_partial: a damaged level hides itself and those after it instead of raising. Raises a FormatError, or OSError,
    a RemoteError where it is about a URL, ClipUnavailable.
    """
    return Decoder(path, clip=clip, strict=strict, allow_partial=allow_partial, limits=limits)


def _opened(path):
    if is_url(path):
        from athcodec.remote import Remote  # what it needs takes long to import

        return Remote(path)
    return builtins.open(os.fspath(path), "rb")


class Decoder:
    """One clip of an opened .ath file; a context manager. Positions come in the source's vertex order unless said
    otherwise; frames, segments, times and errors are those of the clip, counted from its first frame."""

    def __init__(self, path, *, clip: str | None = None, strict: bool = False, allow_partial: bool = False,
                 limits: Limits | None = None):
        self._owned = not hasattr(path, "read")
        self._file = _opened(path) if self._owned else path
        try:
            self._open(strict, allow_partial, limits or Limits())
            if clip is not None:
                self._clip = self._clip_named(clip)
        except BaseException:
            self.close()
            raise

    def _open(self, strict: bool, allow_partial: bool, limits: Limits) -> None:
        self.limits = limits
        self.container = Container(self._file, strict=strict, limits=limits)
        self._read_prelude()
        self.branches = branches = self._player.branches()  # in file order, _native.BRANCH
        self._vertex_source = self._player.vertex_source()
        self.hierarchy = Hierarchy.from_parts(branches["parent"], branches["count"], branches["attach"],
                                              self._vertex_source, self._player.branch_source())
        self.clips = self._read_clips()
        self._clip = self.clips[0]
        self._damaged_from = self._first_damaged_level() if allow_partial else self.container.header.level_count
        self._lock = threading.Lock()
        self._ready: dict[tuple[int, int], player.Segment] = {}  # the segment shown last, by (segment, depth)

    def _read_prelude(self) -> None:
        try:
            self._player = player.File(self.container.prelude(), player.Limits.of(self.limits))
        except player.PlayError as error:
            raise self._refusal(error, "header") from None

    def _read_clips(self) -> tuple[Clip, ...]:
        """All that the file holds, in its order."""
        return tuple(Clip(clip.name.decode(), clip.first_frame, clip.frame_count, clip.first_segment,
                          clip.segment_count, bool(clip.loop), clip.duration,
                          tuple(self._player.seam_error(index, level) for level in range(self.full_level_count))
                          if clip.loop else ())
                     for index, clip in enumerate(self._player.clips()))

    def _clip_named(self, name: str) -> Clip:
        found = next((clip for clip in self.clips if clip.name == name), None)
        if found is None:
            names = ", ".join(repr(clip.name) for clip in self.clips if clip.name)
            raise ClipUnavailable(f"clip: got {name!r}; expected {names or 'none, the only one has no name'}")
        return found

    @property
    def clip(self) -> Clip:
        """The one that is played."""
        return self._clip

    def play(self, name: str) -> Decoder:
        """Another clip of the same file, at the same time as this one: a decoder that shares the file, which is closed
        with this one. Raises ClipUnavailable."""
        other = copy.copy(self)
        other._owned, other._clip, other._ready = False, self._clip_named(name), {}
        for own in ("time", "segments", "_segment_starts"):
            other.__dict__.pop(own, None)
        return other

    def _refusal(self, error: player.PlayError, where: str) -> Exception:
        """What the core refused, in words."""
        refused = error_class(error.code)
        if error.chunk is not None:
            chunk = self.container.find(error.chunk.kind, error.chunk.level, error.chunk.segment)
            if refused is BadChecksum:
                self.container.payload(chunk)
            where = str(chunk)
        header, limits = self.container.header, self.limits
        reasons = {
            BadHeader: f"got Full_Level_Count {header.full_level_count}; expected what the hierarchy has",
            BadChunkTable: f"got {self._absent_chunk()}; expected what the header and the hierarchy ask for",
            LimitExceeded: f"got branches too deep; the limit is {limits.hierarchy_depth}" if error.chunk else
                           f"got {header.vertex_count} vertices and {header.frame_count} frames in "
                           f"{header.segment_count} segments, of which one needs more memory than is allowed; the "
                           f"limit is {limits.memory_bytes}",
        }
        return refused(f"{where}: {reasons.get(refused, 'got content that does not decode; expected a valid stream')}")

    def _absent_chunk(self) -> str:
        """The first chunk that the table lacks as far as it tells by itself."""
        header = self.container.header
        for kind in (*((ct.CLIPS,) if header.clip_count > 1 else ()), ct.HIERARCHY, ct.REST, ct.TIME):
            if self.container.find(kind) is None:
                return f"no {ct.KIND_NAMES[kind]}"
        for (kind, level), count in Counter((c.kind, c.level) for c in self.container.chunks if c.is_motion).items():
            if kind not in (ct.CORRECTIONS, ct.SHAPES) and count < header.segment_count:
                segment = next(i for i in range(header.segment_count) if self.container.find(kind, level, i) is None)
                return f"no {ct.KIND_NAMES[kind]} of level {level}, segment {segment}"
        return "other chunks"

    def _first_damaged_level(self) -> int:
        self.container.prefetch([(0, self.file_length)])
        for chunk in self.container.chunks:
            if chunk.is_motion and self.container.is_available(chunk):
                try:
                    self.container.payload(chunk)
                except BadChecksum:
                    return chunk.level
        return self.level_count

    def close(self) -> None:
        """Closes the file where `open` opened it."""
        if self._owned:
            self._file.close()

    def __enter__(self) -> Decoder:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    # ---- what the file holds ----

    @property
    def vertex_count(self) -> int:
        return self.container.header.vertex_count

    @property
    def frame_count(self) -> int:
        return self._clip.frame_count

    @cached_property
    def time(self) -> np.ndarray:
        """Seconds, (T,) float64."""
        return self._player.times()[self._clip.first_frame: self._clip.first_frame + self._clip.frame_count]

    @property
    def branch_count(self) -> int:
        return self.container.header.branch_count

    @property
    def level_count(self) -> int:
        """Stored levels: depths run from 0 to level_count - 1."""
        return self.container.header.level_count

    @property
    def full_level_count(self) -> int:
        """Levels of the original encoding (h + 2); more than level_count in a truncated file."""
        return self.container.header.full_level_count

    @property
    def max_error_bound(self) -> float:
        """Largest distance of any vertex in any frame at the deepest stored level, as promised; scene units."""
        return self.container.header.max_error

    @property
    def dtype(self) -> np.dtype:
        """Type of positions by default: float32, or float64 where the source's precision asked for it."""
        return np.dtype(np.float64 if self.container.header.wide else np.float32)

    @property
    def fps(self) -> float:
        """Median frame rate; 0 for a single frame."""
        return float(1 / np.median(np.diff(self.time))) if self.frame_count > 1 else 0.0

    @cached_property
    def segments(self) -> list[tuple[int, int]]:
        """(start, stop) frames of each segment."""
        return balanced_segments(self.frame_count, self._clip.segment_count)

    @cached_property
    def _segment_starts(self) -> list[int]:
        return [start for start, _ in self.segments]

    @property
    def source(self):
        """The file that the bytes come from. Of a URL: `source.requests` and `source.bytes` count what it has cost."""
        return self._file

    @property
    def bytes_read(self) -> int:
        """Bytes read from the file so far."""
        return self.container.bytes_read

    @property
    def file_length(self) -> int:
        return self.container.header.file_length

    @property
    def complete(self) -> bool:
        """Whether every byte that the header announces is there."""
        return self.container.available_length >= self.file_length

    @cached_property
    def _missing_segments(self) -> dict[int, list[int]]:
        missing: dict[int, set[int]] = {level: set() for level in range(self.level_count)}
        for chunk in self.container.chunks:
            if chunk.is_motion and not self.container.is_available(chunk):
                missing[chunk.level].add(chunk.segment)
        return {level: sorted(segments) for level, segments in missing.items()}

    def available(self, depth: int) -> bool:
        """Whether all segments of all levels up to `depth` are there and undamaged."""
        return depth < self._damaged_from and not any(self._missing_segments[d] for d in range(depth + 1))

    @property
    def deepest(self) -> int:
        """Deepest complete level. Raises Truncated where not even level 0 is complete."""
        depth = max((d for d in range(self.level_count) if self.available(d)), default=-1)
        if depth < 0:
            raise Truncated(f"level 0: got {self.container.available_length} bytes; expected at least "
                            f"{self.container.level_end(0)}")
        return depth

    @property
    def missing(self) -> str:
        """One line on what a cut-off or damaged file lacks; empty when nothing."""
        parts = [f"level {level}: segments {segments[0]}-{segments[-1]}" if len(segments) > 1
                 else f"level {level}: segment {segments[0]}"
                 for level, segments in self._missing_segments.items() if segments]
        if self._damaged_from < self.level_count:
            parts.append(f"damaged from level {self._damaged_from}")
        if not self.complete and not parts:
            parts.append("attributes behind the motion")
        return "; ".join(parts)

    def _exact_branches(self, parts: np.ndarray) -> np.ndarray:
        """Branches whose stems are exact in a cut, ascending."""
        runs = parts[parts["branch"] < 0]
        run = np.searchsorted(runs["first"], self.branches["first"], "right") - 1
        ends = np.append(runs["first"] + runs["count"], 0)  # -1: before the first run
        return np.flatnonzero(self.branches["first"] < ends[run])

    def nodes_at(self, depth: int) -> int:
        """Parts that the plant is made of at `depth`: exact stems, and subtrees that move as one."""
        parts = self._player.cut(depth)
        return len(self._exact_branches(parts)) + int((parts["branch"] >= 0).sum())

    @property
    def depths(self) -> list[Depth]:
        """The stored levels, coarse to fine."""
        return self._depths(self._clip)

    def _depths(self, *clips: Clip) -> list[Depth]:
        """With the errors of these clips."""
        segments = [segment for clip in clips for segment in clip.segments]
        bounds = [np.array(balanced_segments(clip.frame_count, clip.segment_count)) for clip in clips]
        frames = np.concatenate([stops - starts for starts, stops in (each.T for each in bounds)])
        result = []
        for depth, errors in enumerate(self.container.errors[:, segments]):
            rms = float(np.sqrt((errors[:, 1] ** 2 * frames).sum() / frames.sum()))
            result.append(Depth(depth, self.nodes_at(depth), self.container.level_end(depth),
                                float(errors[:, 0].max()), rms, self.available(depth)))
        return result

    def depth_for(self, distance: float, fov: float, height: float, pixels: float = 1.0) -> int:
        """The coarsest stored level whose largest error, seen from `distance` (scene units) under a vertical field of
        view of `fov` (radians) on a screen of `height` pixels, is at most `pixels`; the deepest where none is.
        """
        return self._player.depth_for(self._clip.segments, distance, fov, height, pixels)

    def table1(self) -> dict:
        """The paper's table 1: depth, nodes, leaves and the four parameters of the ATH."""
        branches, info = self.branches, self._player.info
        whole, inside = branches["flags"] & WHOLE > 0, np.zeros(len(branches) + 1, np.int64)
        np.add.at(inside, np.flatnonzero(whole) + 1, 1)
        np.add.at(inside, (np.arange(len(branches)) + branches["subtree"])[whole], -1)
        leaf = (np.cumsum(inside)[:-1] == 0) & (whole | (branches["subtree"] == 1))
        return {"depth": self.full_level_count - 1, "nodes": info.node_count, "leaves": int(leaf.sum())} | dict(
            zip(TABLE_KEYS, self.thresholds))

    def info(self) -> dict:
        """What `athcodec info --json` prints: of the whole file, all clips together."""
        return {
            "vertices": self.vertex_count, "frames": self.container.header.frame_count, "fps": self.fps,
            "branches": self.branch_count, "segments": self.container.header.segment_count,
            "nodes": self._player.info.node_count, "bytes": self.file_length,
            "available_bytes": self.container.available_length, "max_error_bound": self.max_error_bound,
            "complete": self.complete, "levels": self.level_count, "full_levels": self.full_level_count,
            "format": f"{ct.MAJOR}.{ct.MINOR}", "ath": self.table1(),
            "clips": [{"name": clip.name, "frames": clip.frame_count, "segments": clip.segment_count,
                       "seconds": clip.duration, "loop": clip.loop, "seam_errors": list(clip.seam_errors),
                       "max_errors": [depth.max_error for depth in self._depths(clip)]} for clip in self.clips],
            "depths": [{"depth": d.depth, "nodes": d.nodes, "bytes": d.bytes, "max_error": d.max_error,
                        "rms_error": d.rms_error, "available": d.available} for d in self._depths(*self.clips)],
        }

    # ---- static data, in the source's numbering ----

    @property
    def rest(self) -> np.ndarray:
        """Rest pose as decoded, (N, 3), float32 or what the source had."""
        dtype = np.float64 if self._player.info.rest_wide else np.float32
        with np.errstate(over="ignore"):  # a pose beyond float32 is infinite, as FORMAT.md rounds
            return self._player.rest(player.SOURCE_ORDER).astype(dtype, copy=False)

    @property
    def origin(self) -> np.ndarray:
        """The point that the file's arithmetic is relative to, (3,) float64."""
        return np.array(self._player.info.origin)

    @property
    def thresholds(self) -> tuple[float, int, float, int]:
        """epsilon, eta, xi and lambda by which nodes were accepted."""
        info = self._player.info
        return info.epsilon, info.eta, info.xi, info.lam

    @cached_property
    def _source_branches(self) -> tuple:
        return self.hierarchy.source_branches()

    @property
    def vertex_branch(self) -> np.ndarray:
        return self._source_branches[0]

    @property
    def branch_parent(self) -> np.ndarray:
        return self._source_branches[1]

    @property
    def stem_index(self) -> np.ndarray | None:
        """Place of each vertex on its stem where the source's numbering does not say it, else None."""
        vertex_branch, _, places = self._source_branches
        return check_stem_index(places, vertex_branch)

    def _payload(self, chunk: ct.Chunk) -> bytes:
        """A chunk's bytes, while no other thread reads the file. Raises Truncated, BadChecksum."""
        with self._lock:
            return self.container.payload(chunk)

    def _static(self, kind: int) -> tuple[dict, np.ndarray | None] | None:
        chunk = self.container.find(kind)
        if chunk is None:
            return None
        return ct.parse_array(self._payload(chunk), str(chunk), self.limits)

    def _indices(self, kind: int, name: str) -> np.ndarray | None:
        found = self._static(kind)
        if found is None:
            return None
        head, array = found
        if array is None and kind == ct.EDGES:
            return derived_edges(self.hierarchy).astype(self._derived_dtype(head))
        if array is None or array.ndim != 2 or array.dtype.kind not in "iu" or (
                kind == ct.EDGES and array.shape[1] != 2) or (
                array.size and (array.min() < 0 or array.max() >= self.vertex_count)):
            raise BadChunk(f"{name}: got {ct.brief(head)}; expected rows of vertex numbers")
        return array

    def _derived_dtype(self, head: dict) -> np.dtype:
        if head.get("derived") not in INTEGER_TYPES or np.iinfo(head["derived"]).max < self.vertex_count - 1:
            raise BadChunk(f"EDGES: got {ct.brief(head)}; expected an array or a type that holds derived edges")
        return np.dtype(head["derived"])

    @cached_property
    def faces(self) -> np.ndarray | None:
        return self._indices(ct.FACES, "FACES")

    @cached_property
    def edges(self) -> np.ndarray | None:
        return self._indices(ct.EDGES, "EDGES")

    @cached_property
    def joined_metadata(self) -> dict:
        """Unit, up axis and whatever else the sources of all clips said of themselves, as `join` puts it together."""
        chunk = self.container.find(ct.METADATA)
        return ct.parse_metadata(self._payload(chunk), self.limits) if chunk else {}

    @property
    def metadata(self) -> dict:
        """Unit, up axis and whatever else the source said of itself, this clip's own in place of those for all."""
        return metadata_of(self.joined_metadata, self._clip.name) if len(self.clips) > 1 else self.joined_metadata

    @cached_property
    def attributes(self) -> dict[str, np.ndarray]:
        """Named static arrays, unchanged. Those of a file that was cut off before them are left out."""
        result: dict[str, np.ndarray] = {}
        for chunk in self.container.chunks:
            if chunk.kind != ct.ATTRIBUTE or not self.container.is_available(chunk):
                continue
            if len(result) >= self.limits.attributes:
                raise LimitExceeded(f"{chunk}: got more than {self.limits.attributes} attributes")
            data = self._payload(chunk)
            name = ct.array_name(data, str(chunk), self.limits)
            _, array = ct.parse_array(data, str(chunk), self.limits)
            if array is None or name in result:
                raise BadChunk(f"{chunk}: got attribute {ct.brief(name)} twice or without data")
            result[name] = array
            total = sum(array.nbytes for array in result.values())
            if total > self.limits.memory_bytes:
                raise LimitExceeded(f"{chunk}: got {total} bytes of attributes; the limit is "
                                    f"{self.limits.memory_bytes}")
        return result

    @property
    def error_weights(self) -> np.ndarray | None:
        """(N,) factors on the bound that the file was encoded with, if any: vertex v is within
        max_error_bound * error_weights[v] / error_weights.max() at the deepest level of the full file."""
        name = self.metadata.get("error_weights")
        array = self.attributes.get(name) if isinstance(name, str) else None
        if array is None or array.size != self.vertex_count or array.dtype.kind not in "biuf":
            return None
        weights = array.reshape(-1).astype(np.float64)
        return weights if np.isfinite(weights).all() and weights.min() > 0 else None

    # ---- motion ----

    def _check_depth(self, depth: int | None) -> int:
        if depth is None:
            return self.deepest
        if not 0 <= depth < self.level_count:
            raise LevelUnavailable(f"depth: got {depth}; expected 0 to {self.level_count - 1}")
        return depth

    def _check_frames(self, frames) -> tuple[int, int]:
        if frames is None:
            return 0, self.frame_count
        if isinstance(frames, slice):
            start, stop, step = frames.indices(self.frame_count)
            if step != 1:
                raise LevelUnavailable(f"frames: got a step of {step}; expected 1")
            return start, max(stop, start)
        index = int(frames) + (self.frame_count if frames < 0 else 0)
        if not 0 <= index < self.frame_count:
            raise LevelUnavailable(f"frame: got {frames}; expected 0 to {self.frame_count - 1}")
        return index, index + 1

    @cached_property
    def _work(self) -> player.Work:
        return player.Work(self._player.work_size())

    def _in_file(self, segment: int) -> int:
        """A segment of the clip, counted over the whole file."""
        return self._clip.first_segment + segment

    @contextmanager
    def _prepared(self, segment: int, depth: int) -> Iterator[player.Segment]:
        """A segment of the file ready to be shown, for the caller alone. Raises a FormatError, or LevelUnavailable."""
        with self._lock:
            ready = self._ready.pop((segment, depth), None)
            if ready is None:
                spare = self._ready.popitem()[1] if self._ready else None
                ready = self._prepare(segment, depth, spare)
        try:
            yield ready
        finally:
            with self._lock:
                self._ready = {(segment, depth): ready}

    def _prepare(self, segment: int, depth: int, spare: player.Segment | None) -> player.Segment:
        """Decodes a segment, into spare memory where that is large enough."""
        size = self._player.segment_size(depth)
        needed, limit = size + self._player.work_size(), self.limits.memory_bytes
        if needed > limit:
            raise LimitExceeded(f"level {depth}, segment {segment}: got a need of {needed} bytes; the limit is {limit}")
        ready = spare if spare is not None and len(spare.memory) >= size else player.Segment(size)
        missing = self._player.missing(depth, segment)
        if any(offset + size > self.container.available_length for offset, size in missing):
            raise LevelUnavailable(f"level {depth}, segment {segment}: not in the file; it is cut off at "
                                   f"{self.container.available_length} of {self.file_length} bytes")
        self.container.prefetch(missing)
        bytes_there = [as_bytes(self.container.read(offset, size)) for offset, size in missing]
        try:
            for (offset, _), data in zip(missing, bytes_there):
                self._player.feed(data, offset)
            self._player.prepare(self._work, segment, depth, ready)
        except player.PlayError as error:
            raise self._refusal(error, f"segment {segment}") from None
        finally:
            for offset, size in missing:
                self._player.drop(offset, size)
        return ready

    def _prefetched(self, depth: int, first: int, last: int) -> range:
        """The segments that hold the frames first to last - 1; what they need is there, if they are more than one."""
        segments = self._segments_within(first, last)
        if len(segments) > 1:
            with self._lock:
                self.container.prefetch(self._player.missing(depth, *map(self._in_file, (segments[0], segments[-1]))))
        return segments

    def _show(self, segment: int, depth: int, start: int, out: np.ndarray) -> None:
        """Fills `out`, (k, N, 3) float32 or float64, with the frames from `start` on, in the source's order."""
        with self._prepared(self._in_file(segment), depth) as ready:
            for i, frame in enumerate(out, self._clip.first_frame + start):
                self._player.positions(ready, i, frame)

    def blocks(self, depth: int | None = None, dtype=None, frames=None) -> Iterator[tuple[int, np.ndarray]]:
        """(start, (k, N, 3)) over the segments that hold the frames, one segment in memory at a time."""
        depth, (first, last) = self._check_depth(depth), self._check_frames(frames)
        for index in self._prefetched(depth, first, last):
            start, stop = self.segments[index]
            low, high = max(start, first), min(stop, last)
            yield low, self.positions(slice(low, high), depth, dtype)

    def positions(self, frames=None, depth: int | None = None, dtype=None) -> np.ndarray:
        """Positions in the source's vertex order: (N, 3) for one frame, (T, N, 3) for a slice or None (all).

        depth: level of detail, by default the deepest that is complete. Raises LevelUnavailable, or a FormatError.
        """
        depth, (first, last) = self._check_depth(depth), self._check_frames(frames)
        dtype = np.dtype(dtype or self.dtype)
        shown = np.empty((last - first, self.vertex_count, 3), dtype if dtype in SHOWN_TYPES else self.dtype)
        for index in self._prefetched(depth, first, last):
            start, stop = self.segments[index]
            low, high = max(start, first), min(stop, last)
            self._show(index, depth, low, shown[low - first: high - first])
        out = shown.astype(dtype, copy=False)
        return out if frames is None or isinstance(frames, slice) else out[0]

    def affines(self, frame: int, depth: int | None = None) -> Affines:
        """The cut at `depth` as matrices: nodes that move as one, and the least-squares maps of exact stems.

        Matrices take absolute rest positions (self.rest) to absolute positions (paper, eq. 2). Raises as `positions`.
        """
        depth, (frame, _) = self._check_depth(depth), self._check_frames(frame)
        parts = self._player.cut(depth)
        nodes, stems = parts[parts["branch"] >= 0], self._exact_branches(parts)
        positions = np.empty((self.vertex_count, 3))
        with self._prepared(self._in_file(self._segment_of(frame)), depth) as ready:
            in_file = self._clip.first_frame + frame
            node_matrices = self._player.matrices(ready, in_file, len(nodes))
            self._player.positions(ready, in_file, positions, player.FILE_ORDER)
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                maps = stem_maps(self.hierarchy, self._player.rest(), positions[None])
        except np.linalg.LinAlgError:  # which only some plants with infinite positions lead to
            maps = np.array(np.nan)
        if not np.isfinite(maps).all():
            raise BadChunk(f"frame {frame}: got positions that no matrix fits; expected those of a plant")
        first = np.concatenate([nodes["first"], self.branches["first"][stems]])
        count = np.concatenate([nodes["count"], self.branches["count"][stems]])
        branch = self.hierarchy.branch_source[np.concatenate([nodes["branch"], stems])]
        is_stem, matrices = np.arange(len(first)) >= len(nodes), np.concatenate([node_matrices, maps[0, stems]])
        order = np.argsort(first, kind="stable")
        return Affines(branch[order], first[order], count[order], is_stem[order], matrices[order])

    def _segment_of(self, frame: int) -> int:
        return bisect_right(self._segment_starts, frame) - 1

    def _segments_within(self, first: int, last: int) -> range:
        """The segments that hold the frames from `first` on, `last` not included."""
        return range(self._segment_of(first), self._segment_of(last - 1) + 1) if first < last else range(0)

    def residual(self, frame: int, depth: int | None = None) -> np.ndarray:
        """What the matrices of `affines` leave, in the space of the rest pose (paper, eq. 3): (N, 3), source order.

        The matrix of a vertex's part, applied to this, gives the position at the deepest available level.
        """
        parts = self.affines(frame, depth)
        full = self.positions(frame, self.deepest, np.float64)[self._vertex_source]
        if not np.isfinite(full).all():
            raise BadChunk(f"frame {frame}: got positions that are not finite; expected those of a plant")
        out = np.empty_like(full)
        for first, count, matrix in zip(parts.first_vertex, parts.vertex_count, parts.matrices):
            rows = slice(first, first + count)
            out[self._vertex_source[rows]] = (full[rows] - matrix[:, 3]) @ np.linalg.pinv(matrix[:, :3]).T
        return out

    # ---- checks ----

    def check(self) -> None:
        """Reads every chunk and decodes every level. Raises the first FormatError met."""
        if not self.complete:
            raise Truncated(f"file: got {self.container.available_length} bytes; expected {self.file_length}; "
                            f"{self.missing}")
        with self._lock:
            self.container.prefetch([(0, self.file_length)])
        for chunk in self.container.chunks:
            self._payload(chunk)
        try:
            _ = self.metadata, self.faces, self.edges, self.attributes
        except ClipError as error:
            raise BadChunk(f"static data: {error}") from None
        for segment in range(self.container.header.segment_count):
            for depth in range(self.level_count):
                with self._prepared(segment, depth):
                    pass
