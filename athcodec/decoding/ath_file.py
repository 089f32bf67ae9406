"""An .ath file: its bytes, what all its clips share, and the segments that its core prepares.

Opening reads the prelude; everything else is read when it is asked for. The C core parses and decodes (core_file.py);
this module feeds it bytes and reads the static data. What one clip shows is the business of decoder.py.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import Any, BinaryIO, cast

import numpy as np

from athcodec._native import WHOLE, as_bytes
from athcodec.decoding import container as ct
from athcodec.decoding import core_file
from athcodec.decoding.container import Chunk, Limits
from athcodec.decoding.host_mesh import HostMesh, mesh_positions
from athcodec.errors import (
    BadChecksum,
    BadChunk,
    ClipError,
    ClipUnavailable,
    FormatError,
    LevelUnavailable,
    LimitExceeded,
    NotAnAthFile,
    TrailingBytes,
    Truncated,
    error_class,
)
from athcodec.files.atomic import file_ids, is_url
from athcodec.files.plain import open_plain
from athcodec.files.threads import ThreadPool, default_jobs
from athcodec.motion.clip import ERROR_WEIGHTS, check_stem_index
from athcodec.motion.hierarchy import Hierarchy, derived_edges
from athcodec.motion.joining import HEADING, STRENGTH, metadata_of, wind_of
from athcodec.motion.polygons import Polygons
from athcodec.motion.presence import stated_presence
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.transitions import transitions_of
from athcodec.options import whole

CHUNK_FIELDS = ("kind", "level", "segment", "length", "checksum", "offset")


@dataclass(frozen=True)
class Level:
    """One level of detail of a file.

    Attributes
    ----------
    level : int
        Its number, 0 for the coarsest.
    name : str
        What it is: "depth 1", branches down to an order; "all branches", or "layer 2 of 3" in a file with layers of
        precision; "lossless".
    nodes : int
        Parts that the plant is made of: exact stems, and subtrees that move as one.
    bytes : int
        Size of the file cut off after this level.
    max_error, p99_error, rms_error : float
        Largest distance of the vertices from the source, the one that at most 1 % of all vertices in all frames exceed,
        and the root mean square, in scene units; as stored, at most 3.2 % above the measured ones.
    available : bool
        Whether this level and all coarser ones are in the file, undamaged.
    """

    level: int
    name: str
    nodes: int
    bytes: int
    max_error: float
    p99_error: float
    rms_error: float
    available: bool


@dataclass(frozen=True)
class Clip:
    """A clip of a file. Frames and segments are numbered over the whole file, one clip after the other.

    Attributes
    ----------
    name : str
        Empty where the only clip of a file has none.
    first_frame, frame_count, first_segment, segment_count : int
        Its place in the file.
    loop : bool
        Whether its first frame follows its last.
    duration : float
        Seconds from the first frame to the last.
    seam_errors : tuple of float
        For a loop, how well each level of the full file keeps the step from the last frame to the first: the most that
        any vertex's is off, in scene units. Empty for others.
    """

    name: str
    first_frame: int
    frame_count: int
    first_segment: int
    segment_count: int
    loop: bool
    duration: float
    seam_errors: tuple[float, ...]

    @property
    def segments(self) -> range:
        """Numbers of its segments in the file."""
        return range(self.first_segment, self.first_segment + self.segment_count)


class AthFile:
    """An opened .ath file, for any number of decoders, one per clip; a context manager.

    Arrays are in the source's order of vertices and branches unless said otherwise, lengths in scene units. Threads may
    share it.

    Parameters
    ----------
    path : str, path-like or binary file object
        A path, a URL, or a seekable file object, which stays open when this is closed. A path may be that of a GLB with
        ATH_motion, whose meshes are the host's.
    strict : bool
        Refuse a file that is shorter or longer than its header says.
    allow_partial : bool
        Read all of the file now; a damaged level hides itself and those after it instead of raising.
    limits : Limits, optional
        What the file may ask for; by default those of FORMAT.md.
    host_mesh : array or MotionClip, optional
        The mesh that is the rest pose, for files that do not hold one: see `set_host_mesh`.
    gltf_motion : str, optional
        Of a GLB that has several motions, the name of the one to open; "motion 0" and so on where they have none.

    Attributes
    ----------
    limits : Limits
        What the file may ask for.
    inputs : frozenset
        The files that are read, by device and inode: this one, and those of the host mesh.
    core : core_file.File
        The file as the C core has opened it.
    available_length : int
        Bytes that are there.
    bytes_read : int
        Bytes read so far.

    Raises
    ------
    FormatError
        Where it cannot be decoded: Truncated, BadChecksum, LimitExceeded ...
    ClipError
        Where a GLB has no such motion.
    RemoteError, OSError
        Where it cannot be read.
    """

    def __init__(
        self,
        path: str | os.PathLike[str] | BinaryIO,
        *,
        strict: bool = False,
        allow_partial: bool = False,
        limits: Limits | None = None,
        host_mesh: HostMesh | None = None,
        gltf_motion: str | None = None,
    ):
        self.limits = limits or Limits()
        self.bytes_read = 0
        self._lock = threading.Lock()
        self._rests_read = 0  # those of layers up to this level's
        self._rest_read = -1, np.empty(0)  # the level that gave it
        self._owned = not hasattr(path, "read")
        self._source = _opened(path, gltf_motion) if self._owned else cast(Any, path)
        self.inputs = file_ids(cast(Any, path) if self._owned else getattr(path, "name", None))
        try:
            self.available_length: int = self._source.seek(0, os.SEEK_END)
            self.core = self._open_core()
            self._check_length(strict)
            self._set_tables()
            self._damaged_from = self._first_damaged_level() if allow_partial else self.level_count
            if host_mesh is None and self.needs_host_mesh:
                host_mesh = getattr(self._source, "host_mesh", None)
            if host_mesh is not None:
                self.set_host_mesh(host_mesh)
        except BaseException:
            self.close()
            raise

    # ---- bytes ----

    def close(self) -> None:
        """Closes the file where it was opened here, once nobody reads from it."""
        if self._owned:
            with self._lock:
                self._source.close()

    def __enter__(self) -> AthFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def source(self) -> Any:
        """The file object that the bytes come from. Of a URL: its `requests` and `bytes` count what it has cost."""
        return self._source

    def _read_some(self, offset: int, length: int) -> bytes:
        """`length` bytes, or what there is of them: a file may give fewer at a time than it was asked for."""
        self._source.seek(offset)
        parts, got = [], 0
        while got < length and (part := self._source.read(length - got)):
            parts.append(part)
            got += len(part)
        self.bytes_read += got
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _read(self, offset: int, length: int, what: str) -> bytes:
        data = self._read_some(offset, length)
        if len(data) < length:
            raise Truncated(f"{what}: got {len(data)} bytes; expected {length}")
        return data

    def _prefetch(self, ranges: list[tuple[int, int]]) -> None:
        """Tells a file that is far away which (offset, size) are read next."""
        if hasattr(self._source, "prefetch"):
            self._source.prefetch(ranges)

    def _open_core(self) -> core_file.File:
        limits, data = core_file.Limits.of(self.limits), b""
        try:
            needed, memory, lacking = core_file.front(data, limits)
            while len(data) < needed:
                more = self._read_some(len(data), needed - len(data))
                if not more:
                    raise Truncated(str(lacking)) if data else NotAnAthFile("file: got no bytes; expected an .ath file")
                data += more
                if len(data) < needed or not memory:
                    needed, memory, lacking = core_file.front(data, limits)
            return core_file.File(data, memory, limits)
        except core_file.CoreError as error:
            raise self._refusal(error) from None

    def _refusal(self, error: core_file.CoreError) -> FormatError:
        refused = Truncated if error.code == core_file.MISSING else error_class(error.code)
        return refused(f"{error}{getattr(self._source, 'change_hint', '') if refused is BadChecksum else ''}")

    def _check_length(self, strict: bool) -> None:
        expected, got = self.file_length, self.available_length
        if strict and got != expected:
            raise (Truncated if got < expected else TrailingBytes)(f"file: got {got} bytes; expected {expected}")

    @property
    def file_length(self) -> int:
        """Bytes that the header announces."""
        return self.core.info.file_length

    @property
    def prelude_length(self) -> int:
        """Bytes in front of the first chunk of motion."""
        return self.core.info.prelude_length

    @property
    def complete(self) -> bool:
        """Whether every byte that the header announces is there."""
        return self.available_length >= self.file_length

    # ---- chunks ----

    def _set_tables(self) -> None:
        table = self.core.chunks()
        self._index = np.flatnonzero(np.isin(table["kind"], list(ct.KIND_NAMES), kind="table"))  # of the known chunks
        self._table = table = table[self._index]
        self._ends = table["offset"] + table["length"]
        self._is_motion = ct.is_motion(table["kind"])
        self._is_late = self._is_motion & (self._ends > self.available_length)

    @cached_property
    def chunks(self) -> list[Chunk]:
        """The chunk table without unknown kinds, in file order."""
        return list(map(Chunk, *(self._table[name].tolist() for name in CHUNK_FIELDS), self._index.tolist()))

    def _chunks_of(self, kind: int) -> list[Chunk]:
        rows = np.flatnonzero(self._table["kind"] == kind)
        fields = (self._table[name][rows].tolist() for name in CHUNK_FIELDS)
        return list(map(Chunk, *fields, self._index[rows].tolist()))

    def find(self, kind: int) -> Chunk | None:
        """The first chunk of a kind, such as the only one of metadata.

        Parameters
        ----------
        kind : int
            As in the chunk table (FORMAT.md, "Chunk table").

        Returns
        -------
        Chunk or None
            None where the file has none.
        """
        return next(iter(self._chunks_of(kind)), None)

    def is_available(self, chunk: Chunk) -> bool:
        """Whether the chunk's bytes are there.

        Parameters
        ----------
        chunk : Chunk
            One of `chunks`.
        """
        return chunk.offset + chunk.length <= self.available_length

    def _lacks(self, kind: int) -> bool:
        """Whether the file was cut off before a chunk of this kind."""
        return not all(map(self.is_available, self._chunks_of(kind)))

    def payload(self, chunk: Chunk) -> bytes:
        """A chunk's bytes as stored.

        Parameters
        ----------
        chunk : Chunk
            One of `chunks`.

        Raises
        ------
        Truncated
            Where they are not there.
        BadChecksum
            Where they are damaged.
        """
        with self._lock:
            data = self._read(chunk.offset, chunk.length, str(chunk))
            try:
                self.core.check_chunk(chunk.index, chunk.offset, data)
            except core_file.CoreError as error:
                raise self._refusal(error) from None
        return data

    def _first_damaged_level(self) -> int:
        self._prefetch([(0, self.file_length)])
        for chunk in self.chunks:
            if chunk.is_motion and self.is_available(chunk):
                try:
                    self.payload(chunk)
                except BadChecksum:
                    return chunk.level
        return self.level_count

    # ---- what the file holds ----

    @property
    def header(self) -> ct.Header:
        """The fixed header."""
        counts = [field.name for field in fields(ct.Header) if field.name not in ("joins", "repeats")]
        values = {name: getattr(self.core.info, name) for name in counts}
        return ct.Header(**values, joins=self.core.joins(), repeats=self.core.repeats())

    @property
    def vertex_count(self) -> int:
        """Vertices of the plant, N."""
        return self.core.info.vertex_count

    @property
    def branch_count(self) -> int:
        """Branches of the plant, B."""
        return self.core.info.branch_count

    @property
    def frame_count(self) -> int:
        """Frames of all clips."""
        return self.core.info.frame_count

    @property
    def segment_count(self) -> int:
        """Segments of all clips."""
        return self.core.info.segment_count

    @property
    def level_count(self) -> int:
        """Stored levels: 0 to level_count - 1."""
        return self.core.info.level_count

    @property
    def full_level_count(self) -> int:
        """Levels of the original encoding; more than level_count in a truncated file."""
        return self.core.info.full_level_count

    @property
    def max_error_bound(self) -> float:
        """Largest distance of any vertex in any frame at the deepest stored level, as promised; scene units."""
        return self.core.info.max_error

    @property
    def dtype(self) -> np.dtype:
        """Type of positions by default: float32, or float64 where the source's precision asked for it."""
        return np.dtype(np.float64 if self.core.info.is_float64 else np.float32)

    @property
    def origin(self) -> np.ndarray:
        """The point that the file's arithmetic is relative to, (3,) float64."""
        return np.array(self.core.info.origin)

    @cached_property
    def clips(self) -> tuple[Clip, ...]:
        """All that the file holds, in its order."""
        return tuple(
            Clip(
                clip.name.decode(),
                clip.first_frame,
                clip.frame_count,
                clip.first_segment,
                clip.segment_count,
                bool(clip.loop),
                clip.duration,
                tuple(self.core.seam_error(index, level) for level in range(self.full_level_count))
                if clip.loop
                else (),
            )
            for index, clip in enumerate(self.core.clips())
        )

    def clip_named(self, name: str) -> Clip:
        """The clip of this name.

        Parameters
        ----------
        name : str
            As in `clips`.

        Raises
        ------
        ClipUnavailable
            Where no clip has it.
        """
        found = next((clip for clip in self.clips if clip.name == name), None)
        if found is None:
            names = ", ".join(repr(clip.name) for clip in self.clips if clip.name)
            raise ClipUnavailable(f"clip: got {name!r}; expected {names or 'none, the only one has no name'}")
        return found

    @cached_property
    def time(self) -> np.ndarray:
        """Seconds, (T,) float64, of the frames of all clips."""
        return self.core.times()

    def segment_starts(self, clip: Clip) -> list[int]:
        """The first frame of each segment of a clip, and that behind its last.

        Parameters
        ----------
        clip : Clip
            One of `clips`.

        Returns
        -------
        list of int
            Counted over the whole file; one more than the clip has segments.
        """
        return self.core.segment_starts(clip.segments)

    # ---- levels ----

    def available(self, level: int) -> bool:
        """Whether all segments of all levels up to this one are there and undamaged.

        Parameters
        ----------
        level : int
            0 is the coarsest.
        """
        return whole("level", level) < self._first_lacking

    @cached_property
    def _first_lacking(self) -> int:
        """The first level that is not all there or damaged."""
        return int(self._table["level"][self._is_late].min(initial=self._damaged_from))

    @property
    def deepest(self) -> int:
        """The deepest complete level.

        Raises
        ------
        Truncated
            Where not even level 0 is complete.
        """
        if self._first_lacking == 0:
            raise Truncated(f"level 0: got {self.available_length} bytes; expected at least {self._level_end(0)}")
        return self._first_lacking - 1

    @cached_property
    def missing(self) -> str:
        """One line on what a cut-off or damaged file lacks; empty when nothing."""
        late = self._table[self._is_late]
        parts = []
        for level in np.unique(late["level"]).tolist():
            segments = late["segment"][late["level"] == level]
            first, last = int(segments.min()), int(segments.max())
            parts.append(f"level {level}: " + (f"segments {first}-{last}" if first < last else f"segment {first}"))
        if self._damaged_from < self.level_count:
            parts.append(f"damaged from level {self._damaged_from}")
        if not parts and self._lacks(ct.ATTRIBUTE):
            parts.append("attributes behind the motion")
        if self.rest_is_missing:
            parts.append("rest pose of the source")
        if not self.complete and not parts:
            parts.append("what is behind the motion")
        return "; ".join(parts)

    def _level_end(self, level: int) -> int:
        """Bytes of the file cut off after a level."""
        kept = ct.is_prelude(self._table["kind"]) | (self._is_motion & (self._table["level"] <= level))
        return int(self._ends[kept].max())

    def nodes_at(self, level: int) -> int:
        """Parts that the plant is made of at a level: exact stems, and subtrees that move as one.

        Parameters
        ----------
        level : int
            One that is stored.
        """
        parts = self.core.cut(level)
        return len(self.exact_branches(parts)) + int((parts["branch"] >= 0).sum())

    def exact_branches(self, parts: np.ndarray) -> np.ndarray:
        """Branches whose stems are exact in a cut.

        Parameters
        ----------
        parts : ndarray, (P,) core_file.PART
            What the plant is made of at a level: `core.cut(level)`.

        Returns
        -------
        ndarray, (K,) int64
            Ascending, in file order.
        """
        runs = parts[parts["branch"] < 0]
        run = np.searchsorted(runs["first"], self.branches["first"], "right") - 1
        ends = np.append(runs["first"] + runs["count"], 0)  # -1: before the first run
        return np.flatnonzero(self.branches["first"] < ends[run])

    @property
    def levels(self) -> list[Level]:
        """The stored levels, coarse to fine, with their errors in all clips."""
        return self.levels_in(range(self.segment_count))

    def levels_in(self, segments: range) -> list[Level]:
        """The stored levels, coarse to fine, with their errors in some segments of the file.

        Parameters
        ----------
        segments : range
            Counted over the whole file.
        """
        return [
            Level(
                level,
                self.core.level_name(level),
                self.nodes_at(level),
                self._level_end(level),
                *self.core.level_error(level, segments),
                self.available(level),
            )
            for level in range(self.level_count)
        ]

    def level_within(self, max_error: float, segments: range | None = None) -> int:
        """The coarsest stored level whose largest error is not above one.

        Parameters
        ----------
        max_error : float
            Scene units.
        segments : range, optional
            Of the file; by default all.

        Raises
        ------
        LevelUnavailable
            Where the deepest level's is larger.
        """
        segments = segments or range(self.segment_count)
        largest = self.errors[:, segments.start : segments.stop, 0].max(axis=1)
        if not (within := np.flatnonzero(largest <= max_error)).size:
            raise LevelUnavailable(f"max_error: got {max_error:.4g}; expected at least {largest.min():.4g}")
        return int(within[0])

    @cached_property
    def errors(self) -> np.ndarray:
        """Error of each level in each segment, (levels, segments, 3) float64: the largest, that of the 99th percentile,
        the root mean square, scene units."""
        return self.core.errors()

    @property
    def joins(self) -> np.ndarray:
        """How each segment goes on from the end of the one before it, (levels, segments) uint8; 0: it does not."""
        return self.core.joins()

    def table1(self) -> dict[str, float]:
        """Table 1 of the paper: depth (levels of nodes), nodes, leaves, and thresholds that the encoder was given."""
        branches = self.branches
        whole, inside = branches["flags"] & WHOLE > 0, np.zeros(len(branches) + 1, np.int64)
        np.add.at(inside, np.flatnonzero(whole) + 1, 1)
        np.add.at(inside, (np.arange(len(branches)) + branches["subtree"])[whole], -1)
        is_node = np.cumsum(inside)[:-1] == 0
        leaf = is_node & (whole | (branches["subtree"] == 1))
        thresholds = Thresholds.of_metadata(self.metadata)
        return {
            "depth": int(branches["depth"][is_node].max()) + 1,
            "nodes": self.core.info.node_count,
            "leaves": int(leaf.sum()),
            **(asdict(thresholds) if thresholds else {}),
        }

    def info(self) -> dict[str, Any]:
        """What `athcodec info --json` prints: of the whole file, all clips together."""
        first = self.clips[0]
        return {
            "vertices": self.vertex_count,
            "frames": self.frame_count,
            "fps": median_rate(self.time[: first.frame_count]),
            "branches": self.branch_count,
            "segments": self.segment_count,
            "nodes": self.core.info.node_count,
            "bytes": self.file_length,
            "available_bytes": self.available_length,
            "max_error_bound": self.max_error_bound,
            "complete": self.complete,
            "full_level_count": self.full_level_count,
            "format": f"{ct.MAJOR}.{ct.MINOR}",
            "rest_bytes": sum(chunk.length for kind in (ct.REST, ct.REFINED_REST) for chunk in self._chunks_of(kind)),
            "host_mesh": None if self.host_checksum is None else {"checksum": self.host_checksum},
            "ath": self.table1(),
            "clips": [
                {
                    "name": clip.name,
                    "frames": clip.frame_count,
                    "segments": clip.segment_count,
                    "seconds": clip.duration,
                    "loop": clip.loop,
                    "wind": self._wind_of(clip),
                    "presence": stated_presence(metadata_of(self.metadata, clip.name)),
                    "transitions": len(transitions_of(metadata_of(self.metadata, clip.name), clip.frame_count)),
                    "seam_errors": list(clip.seam_errors),
                    "max_errors": [level.max_error for level in self.levels_in(clip.segments)],
                }
                for clip in self.clips
            ],
            "levels": [asdict(level) for level in self.levels],
        }

    def _wind_of(self, clip: Clip) -> dict[str, float] | None:
        """Its strength and heading; None where its metadata name none."""
        strength, heading = wind_of(metadata_of(self.metadata, clip.name))
        return None if math.isnan(strength) else {STRENGTH: strength, HEADING: heading}

    # ---- static data, in the source's numbering ----

    @cached_property
    def branches(self) -> np.ndarray:
        """Records of the branches in file order, (B,) of _native.BRANCH."""
        return self.core.branches()

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """The branches in file order and how they hang on each other."""
        return Hierarchy.from_parts(
            self.branches["parent"],
            self.branches["count"],
            self.branches["attach"],
            self.core.vertex_source(),
            self.core.branch_source(),
        )

    @property
    def rest(self) -> np.ndarray:
        """Rest pose of the source as decoded with the deepest complete level, (N, 3), float32 or float64 as the source
        had it; where the source gave none, or `rest_is_missing`, the reference pose of that level."""
        level = max(self._first_lacking - 1, 0)
        return self._as_rest(self.level_rest(level)) if self.rest_is_missing else self.rest_at(level)

    @property
    def rest_is_missing(self) -> bool:
        """Whether the file was cut off before the rest pose of the source, which stands behind the motion."""
        return self._lacks(ct.SOURCE_REST)

    def rest_at(self, level: int) -> np.ndarray:
        """The rest pose as decoded with a level that is stored. Raises Truncated where it is missing."""
        if self.rest_is_missing:
            raise Truncated(
                f"SOURCE_REST: not in the file; it is cut off at {self.available_length} of {self.file_length} bytes"
            )
        known, pose = self._rest_read
        if known != level:
            with self._poses_read(level, [ct.SOURCE_REST]):
                pose = self._as_rest(self.core.rest(level))
            self._rest_read = level, pose
        return pose.copy()

    def _as_rest(self, pose: np.ndarray) -> np.ndarray:
        """Of the source's type; beyond float32 infinite, as FORMAT.md rounds."""
        with np.errstate(over="ignore"):
            return pose.astype(np.float64 if self.core.info.rest_is_float64 else np.float32, copy=False)

    def level_rest(self, level: int, order: int = core_file.SOURCE_ORDER) -> np.ndarray:
        """The reference pose of a level, which its maps move: the source's rest pose, or another that the motion is
        closer to. Levels that refine the plant may refine it, too.

        Parameters
        ----------
        level : int
            One that is stored.
        order : int
            core_file.SOURCE_ORDER or core_file.FILE_ORDER.

        Returns
        -------
        numpy.ndarray
            (N, 3) float64, scene units, not rounded to the source's type.

        Raises
        ------
        LevelUnavailable
            Where the file was cut off before it.
        FormatError
            Where it is damaged.
        """
        with self._poses_read(level):
            return self.core.level_rest(level, order)

    @contextmanager
    def _poses_read(self, level: int, kinds: Sequence[int] = ()) -> Iterator[None]:
        """The core has, or can read, the reference poses up to a level's for as long as this lasts, and has the chunks
        of these kinds."""
        with self._lock:
            chunks = [chunk for chunk in self._chunks_of(ct.REFINED_REST) if self._rests_read < chunk.level <= level]
            chunks += [chunk for kind in kinds for chunk in self._chunks_of(kind)]
            with self._fed([(chunk.offset, chunk.length) for chunk in chunks], f"reference pose of level {level}"):
                yield
            self._rests_read = max(self._rests_read, level)

    @cached_property
    def _source_branches(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.hierarchy.source_branches()

    @property
    def vertex_branch(self) -> np.ndarray:
        """The branch of each vertex, (N,) int32."""
        return self._source_branches[0]

    @property
    def branch_parent(self) -> np.ndarray:
        """The parent of each branch, (B,) int32, -1 for a root."""
        return self._source_branches[1]

    @property
    def stem_index(self) -> np.ndarray | None:
        """Place of each vertex on its stem, (N,) int32, where the source's numbering does not say it, else None."""
        vertex_branch, _, places = self._source_branches
        return check_stem_index(places, vertex_branch)

    @cached_property
    def faces(self) -> np.ndarray | None:
        """Vertex numbers of the corners, (F, k) of the source's integer type, or None; faces of different sizes are
        attributes. Of a motion in a GLB that holds none, the triangles there."""
        if self.find(ct.FACES) is None:
            return getattr(self._source, "faces", None)
        return None if self._polygons is None or self._polygons.counts is not None else self._polygons.rows

    @cached_property
    def edges(self) -> np.ndarray | None:
        """Vertex numbers of both ends, (E, 2) of the source's integer type, or None."""
        stored = self._indices(ct.EDGES)
        if stored is None or not stored.derived:
            return None if stored is None else stored.rows
        return derived_edges(self.hierarchy).astype(stored.index_type)

    @cached_property
    def _polygons(self) -> Polygons | None:
        return self._indices(ct.FACES)

    def _indices(self, kind: int) -> Polygons | None:
        chunk = self.find(kind)
        if chunk is None:
            return None
        with self._lock, self._fed([(chunk.offset, chunk.length)], str(chunk)):
            return self.core.polygons(kind, self.limits.corners)

    @cached_property
    def metadata(self) -> dict[str, Any]:
        """Unit, up axis and whatever else the sources of all clips said of themselves, as `join` puts it together."""
        chunk = self.find(ct.METADATA)
        return ct.parse_metadata(self.payload(chunk), self.limits) if chunk else {}

    @cached_property
    def attributes(self) -> dict[str, np.ndarray]:
        """Named static arrays, unchanged. Those of a file that was cut off before them are left out."""
        faces = self._polygons
        result: dict[str, np.ndarray] = {} if faces is None or faces.counts is None else faces.attributes
        for chunk in self._chunks_of(ct.ATTRIBUTE):
            if not self.is_available(chunk):
                continue
            if len(result) >= self.limits.attributes:
                raise LimitExceeded(f"{chunk}: got more than {self.limits.attributes} attributes")
            name, array = ct.parse_array(self.payload(chunk), str(chunk), self.limits)
            if name in result:
                raise BadChunk(f"{chunk}: got attribute {ct.brief(name)} twice")
            result[name] = array
            total = sum(array.nbytes for array in result.values())
            if total > self.limits.memory_bytes:
                raise LimitExceeded(
                    f"{chunk}: got {total} bytes of attributes; the limit is {self.limits.memory_bytes}"
                )
        return result

    @property
    def error_weights(self) -> np.ndarray | None:
        """Factors on the bound that the file was encoded with, (N,) float64, or None.

        Vertex v is within max_error_bound * error_weights[v] / error_weights.max() at the deepest level of the full
        file.
        """
        name = self.metadata.get(ERROR_WEIGHTS)
        array = self.attributes.get(name) if isinstance(name, str) else None
        if array is None or array.size != self.vertex_count or array.dtype.kind not in "biuf":
            return None
        weights = array.reshape(-1).astype(np.float64)
        return weights if np.isfinite(weights).all() and weights.min() > 0 else None

    # ---- the host's mesh ----

    @property
    def host_checksum(self) -> str | None:
        """The checksum, 16 hexadecimal digits, of the mesh that is the rest pose where the file does not hold one; else
        None."""
        info = self.core.info
        return "{:08x}{:08x}".format(*info.host_checksum) if info.rest_is_host else None

    @property
    def needs_host_mesh(self) -> bool:
        """Whether the rest pose is a mesh of the host's that has not been given: nothing can be decoded then."""
        return not self.core.has_rest

    def set_host_mesh(self, mesh: HostMesh) -> None:
        """Gives the mesh that the file was made for, where it does not hold the rest pose; other files pass it over.

        Parameters
        ----------
        mesh : (N, 3) array or MotionClip
            Positions in the source's order, scene units and axes, which are used as float32, bit for bit; or a clip
            that has them as its rest pose.

        Raises
        ------
        WrongHostMesh
            Where it is another one, by its number of vertices or its checksum.
        ClipError
            Where it is no mesh.
        """
        if self.needs_host_mesh:
            positions, files = mesh_positions(mesh)
            self.inputs |= files
            try:
                with self._lock:
                    self.core.set_host_mesh(positions)
            except core_file.CoreError as error:
                raise self._refusal(error) from None

    # ---- segments ----

    @cached_property
    def _work(self) -> core_file.Work:
        return core_file.Work(self.core.work_size())

    def prefetch(self, segments: range, level: int) -> None:
        """Fetch what these segments need at a level from a remote file.

        Parameters
        ----------
        segments : range
            Counted over the whole file.
        level : int
            One that is stored.
        """
        with self._lock:
            self._prefetch(self.core.missing(level, segments[0], segments[-1]))

    def prepare(
        self, segment: int, level: int, spare: core_file.Segment | None = None, to: np.ndarray | None = None
    ) -> core_file.Segment:
        """Decodes a segment of the file at a level.

        Parameters
        ----------
        segment : int
            Counted over the whole file.
        level : int
            One that is stored.
        spare : core_file.Segment, optional
            A prepared segment that nobody needs any more. Where it is this one, at a coarser level of all vertices, or
            the one that this is joined to, decoding goes on from there, and its bytes are not read again; else its
            memory is taken if it is large enough.
        to : (k, N, 3) array, optional
            Where the positions of its k frames go, of the file's type, contiguous, in the source's order; where they
            cannot go there at once, they do not.

        Returns
        -------
        core_file.Segment
            What `core.positions` and `core.matrices` show, unless it is `gone` to the array.

        Raises
        ------
        LevelUnavailable
            Where the file was cut off before it.
        FormatError
            Where it is damaged, or needs more memory than is allowed.
        """
        size = self.core.segment_size(level)
        needed, limit = size + self.core.work_size(), self.limits.memory_bytes
        if needed > limit:
            raise LimitExceeded(f"level {level}, segment {segment}: got a need of {needed} bytes; the limit is {limit}")
        before = joined_to = None
        if spare and needed + len(spare.memory) <= limit:
            if self.core.goes_on(spare, segment, level):
                before = spare
            elif self.core.is_ready(spare, self.core.joined_to(segment, level), level):
                joined_to = spare
        is_free = spare and not before and not joined_to and len(spare.memory) >= size
        ready = spare if spare and is_free else core_file.Segment(size)
        with self._lock:
            self._decode(segment, level, ready, before, joined_to, to)
        return ready

    def show_all(
        self,
        segments: range,
        level: int,
        show: Callable[[int, core_file.Segment], None],
        room: Callable[[int], np.ndarray | None],
    ) -> None:
        """Decodes segments of the file at a level, in runs that threads share.

        Parameters
        ----------
        segments : range
            Counted over the whole file.
        level : int
            One that is stored.
        show : callable
            Takes a segment's number and what was prepared, whose memory the next one takes over; threads call it.
        room : callable
            Takes a segment's number and gives the array that `prepare` has as `to`. What went there is not shown.

        Raises
        ------
        LevelUnavailable, FormatError
            As for `prepare`.
        """
        what = f"level {level}, segments {segments.start} to {segments.stop - 1}"
        with self._lock, self._fed(self.core.missing(level, segments[0], segments[-1]), what):
            self._refine(level)
            follows, runs = self._runs(segments, level, what)
            items = [(run, level, follows, show, room) for run in runs]
            faults = ThreadPool(len(runs)).map(self._show_run, items)
            for fault in filter(None, faults):
                raise fault
        self._rests_read = max(self._rests_read, level)

    def _runs(self, segments: range, level: int, what: str) -> tuple[bool, list[range]]:
        """Whether memory allows to go on from a segment to one that is joined to it, and one run for each thread.

        The first segment of a run is decoded with the one that it is joined to, whose end nobody else has yet.
        """
        joined = any(self.core.joined_to(segment, level) >= 0 for segment in segments)
        size, limit = self.core.segment_size(level), self.limits.memory_bytes
        needed = size + self.core.work_size()
        if needed > limit:
            raise LimitExceeded(f"{what}: got a need of {needed} bytes; the limit is {limit}")
        follows = joined and needed + size <= limit
        room = limit // (needed + size if follows else needed)
        count = max(1, min(default_jobs(), len(segments) // (2 if joined else 1), room))
        cuts = [len(segments) * i // count for i in range(count + 1)]
        return follows, [segments[start:stop] for start, stop in zip(cuts, cuts[1:])]

    def _show_run(
        self,
        run: range,
        level: int,
        follows: bool,
        show: Callable[[int, core_file.Segment], None],
        room: Callable[[int], np.ndarray | None],
    ) -> core_file.CoreError | None:
        """Returns a fault rather than raises it: the other runs need the file's bytes until they end."""
        work, size = core_file.Work(self.core.work_size()), self.core.segment_size(level)
        ready, spare = core_file.Segment(size), None
        for segment in run:
            joined_to = None
            if follows and segment > run.start and self.core.joined_to(segment, level) == segment - 1:
                joined_to, ready = ready, spare or core_file.Segment(size)
                spare = joined_to
            try:
                self.core.prepare(work, segment, level, ready, joined_to=joined_to, to=room(segment))
            except core_file.CoreError as fault:
                return fault
            if not ready.gone:
                show(segment, ready)
        return None

    def _refine(self, level: int) -> None:
        """Builds what the segments share at a level, whose bytes are there."""
        needed, limit = self.core.refinement_size(level), self.limits.memory_bytes
        if needed > limit:
            raise LimitExceeded(f"level {level}: got layers of {needed} bytes; the limit is {limit}")
        self.core.build()
        self.core.refine(level)

    def _decode(
        self,
        segment: int,
        level: int,
        ready: core_file.Segment,
        before: core_file.Segment | None,
        joined_to: core_file.Segment | None,
        to: np.ndarray | None,
    ) -> None:
        with self._fed(self._missing(segment, level, before, joined_to), f"level {level}, segment {segment}"):
            self._refine(level)
            self.core.prepare(self._work, segment, level, ready, before, joined_to, to)
        self._rests_read = max(self._rests_read, level)

    def _missing(
        self, segment: int, level: int, before: core_file.Segment | None, joined_to: core_file.Segment | None
    ) -> list[tuple[int, int]]:
        if not before and not joined_to:
            return self.core.missing(level, segment)
        own = self.core.missing_of(segment, level, self.core.level_of(before) if before else -1)
        beside = -1 if joined_to else self.core.joined_to(segment, level)
        return own if beside < 0 else sorted(own + self.core.missing_of(beside, level))

    @contextmanager
    def _fed(self, ranges: list[tuple[int, int]], what: str) -> Iterator[None]:
        """The core has these bytes, (offset, size), for as long as this lasts. Raises as `prepare`."""
        if any(offset + size > self.available_length for offset, size in ranges):
            raise LevelUnavailable(
                f"{what}: not in the file; it is cut off at {self.available_length} of {self.file_length} bytes"
            )
        self._prefetch(ranges)
        pieces = [as_bytes(self._read(offset, size, f"bytes from {offset} on")) for offset, size in ranges]
        try:
            for (offset, _), data in zip(ranges, pieces):
                self.core.feed(data, offset)
            yield
        except core_file.CoreError as error:
            raise self._refusal(error) from None
        finally:
            for offset, size in ranges:
                self.core.drop(offset, size)

    def check(self, decode: bool = True) -> None:
        """Reads every chunk and decodes every level.

        Parameters
        ----------
        decode : bool
            False: compare checksums and read static data, which takes no mesh of the host's, and decode nothing.

        Raises
        ------
        FormatError
            The first fault that is met.
        """
        if not self.complete:
            raise Truncated(f"file: got {self.available_length} bytes; expected {self.file_length}; {self.missing}")
        with self._lock:
            self._prefetch([(0, self.file_length)])
        for chunk in self.chunks:
            self.payload(chunk)
        try:
            _ = self.metadata, self.faces, self.edges, self.attributes
        except ClipError as error:
            raise BadChunk(f"static data: {error}") from None
        if not decode:
            return
        _, ready = self.rest, None
        for segment in range(self.segment_count):
            for level in range(self.level_count):
                ready = self.prepare(segment, level, ready)


def _opened(path: Any, gltf_motion: str | None) -> Any:
    if is_url(path):
        from athcodec.files.remote import Remote  # what it needs takes long to import

        return Remote(path)
    file = open_plain(os.fspath(path), -1)
    with ExitStack() as unread:
        unread.callback(file.close)
        if file.read(4) != b"glTF":
            if gltf_motion is not None:
                raise ClipError(f"gltf_motion: got {gltf_motion!r} of a file that is no GLB, expected a GLB")
            unread.pop_all()
            return file
    from athcodec.files.gltf.motion import GltfMotion  # takes long to import

    return GltfMotion(path, gltf_motion)


def median_rate(time: np.ndarray) -> float:
    """Median frame rate of times in seconds, frames per second; 0 for a single frame."""
    return float(1 / np.median(np.diff(time))) if len(time) > 1 else 0.0
