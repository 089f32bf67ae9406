"""From an .ath file back to motion: any depth, any frames, any part that is there.

`open` reads the prelude; a segment's chunks are read when one of its frames is asked for, and only those of the levels
that the depth needs. The arithmetic is the C core's (transform.py); this module decides what to read and checks that
streams fit the hierarchy. It never imports the encoder.
"""

from __future__ import annotations

import builtins
import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from athcodec import container as ct
from athcodec import entropy
from athcodec._native import WHOLE
from athcodec.ath import stem_maps
from athcodec.clip import check_stem_index
from athcodec.container import Container, Limits
from athcodec.errors import (
    BadChecksum,
    BadChunk,
    BadChunkTable,
    BadHeader,
    ClipError,
    LevelUnavailable,
    LimitExceeded,
    Truncated,
)
from athcodec.hierarchy import Hierarchy, derived_edges
from athcodec.transform import (
    LevelStream,
    Plan,
    SegmentMotion,
    balanced_segments,
    decoding_bytes,
    scatter,
    temporal_basis,
)

INTEGER_TYPES = [np.dtype(f"{order}{kind}{size}").str for order in "<>" for kind in "iu" for size in (1, 2, 4, 8)]
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
class Affines:
    """What moves as one: per part its branch, vertex range (file order), kind, and 3x4 matrix in absolute positions."""

    branch: np.ndarray  # (K,) source branch numbers
    first_vertex: np.ndarray  # (K,) int32, file order
    vertex_count: np.ndarray  # (K,) int32
    is_stem: np.ndarray  # (K,) bool: an exact stem (least-squares matrix), else a node of the ATH
    matrices: np.ndarray  # (K, 3, 4) float64


def open(path, *, strict: bool = False, allow_partial: bool = False, limits: Limits | None = None) -> Decoder:
    """Opens an .ath file: a path or a seekable binary file object.

    strict: refuse a file shorter or longer than it says. allow_partial: a damaged level hides itself and those after
    it instead of raising. Raises a FormatError, or OSError.
    """
    return Decoder(path, strict=strict, allow_partial=allow_partial, limits=limits)


def read_time(data: bytes, frame_count: int) -> np.ndarray:
    """Times in seconds from the content of TIME, (T,) float64. Raises BadChunk."""
    time, stream = ct.parse_time(data, frame_count)
    if time is None:
        time = entropy.decode_times(stream, frame_count)
    if not np.isfinite(time).all() or (np.diff(time) <= 0).any():
        raise BadChunk("TIME: got times that are not finite and increasing")
    return time


class Decoder:
    """An opened .ath file; a context manager. Positions come in the source's vertex order unless said otherwise."""

    def __init__(self, path, *, strict: bool = False, allow_partial: bool = False, limits: Limits | None = None):
        self._owned = not hasattr(path, "read")
        self._file = builtins.open(os.fspath(path), "rb") if self._owned else path
        try:
            self._open(strict, allow_partial, limits or Limits())
        except BaseException:
            self.close()
            raise

    def _open(self, strict: bool, allow_partial: bool, limits: Limits) -> None:
        self.limits = limits
        self.container = Container(self._file, strict=strict, limits=limits)
        header = self.container.header
        self._check_memory(header)
        data = self.container.required(ct.HIERARCHY)
        self.thresholds, stream = ct.parse_hierarchy(data)
        branches, branch_source, self._vertex_source = entropy.decode_hierarchy(stream, header.branch_count,
                                                                                header.vertex_count)
        if branches["depth"].max() >= limits.hierarchy_depth:
            raise LimitExceeded(f"HIERARCHY: got a depth of {branches['depth'].max() + 1}; the limit is "
                                f"{limits.hierarchy_depth}")
        self.plan = Plan(branches, header.vertex_count)
        if self.plan.level_count != header.full_level_count:
            raise BadHeader(f"header: got Full_Level_Count {header.full_level_count}; expected "
                            f"{self.plan.level_count}, as the hierarchy has it")
        self.hierarchy = Hierarchy.from_parts(branches["parent"], branches["count"], branches["attach"],
                                              self._vertex_source, branch_source)
        self._check_motion_chunks()
        self._read_rest()
        self.time = read_time(self.container.required(ct.TIME), header.frame_count)
        self._damaged_from = self._first_damaged_level() if allow_partial else header.level_count

    def _check_memory(self, header: ct.Header) -> None:
        frames = -(-header.frame_count // header.segment_count)
        needed = decoding_bytes(header.vertex_count, frames)
        if needed > self.limits.memory_bytes:
            raise LimitExceeded(f"header: got {header.vertex_count} vertices in segments of {frames} frames, about "
                                f"{needed} bytes; the limit is {self.limits.memory_bytes}")

    def _check_motion_chunks(self) -> None:
        """Every stream that the hierarchy asks for is in the table, and no other. Raises BadChunkTable."""
        segments, last = self.container.header.segment_count, self.full_level_count - 1
        wanted = {(kind, level) for level in range(self.level_count) for kind, present in
                  ((ct.STEMS, self.plan.has_stems(level)), (ct.AFFINES, self.plan.has_affines(level))) if present}
        there = Counter((c.kind, c.level) for c in self.container.chunks if c.is_motion)  # a segment once: container.py
        del there[ct.CORRECTIONS, last]
        for kind, level in sorted(there.keys() | wanted):
            if (kind, level) not in wanted:
                raise BadChunkTable(f"chunk table: got {ct.KIND_NAMES[kind]} of level {level}; expected none, as the "
                                    f"hierarchy has it")
            if there[kind, level] != segments:
                absent = next(i for i in range(segments) if self.container.find(kind, level, i) is None)
                raise BadChunkTable(f"chunk table: got no {ct.KIND_NAMES[kind]} of level {level}, segment {absent}; "
                                    f"expected one of each segment")

    def _read_rest(self) -> None:
        rest = ct.parse_rest(self.container.required(ct.REST))
        self.origin, self._rest_dtype, self._exact_rest = rest.origin, rest.source_dtype, None
        if rest.exact:
            self._exact_rest = entropy.decode_exact_rest(rest.stream, self.plan.branches, self.vertex_count,
                                                         rest.source_dtype)
            local = self._exact_rest.astype(np.float64) - rest.origin
        else:
            local = entropy.decode_rest(rest.stream, self.plan.branches, self.vertex_count, rest.step)
        if not np.isfinite(local).all():
            raise BadChunk("REST: got a coordinate that is not finite")
        self.plan.set_rest(local)

    def _first_damaged_level(self) -> int:
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
        return self.container.header.frame_count

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
        return balanced_segments(self.frame_count, self.container.header.segment_count)

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

    def nodes_at(self, depth: int) -> int:
        """Parts that the plant is made of at `depth`: exact stems, and subtrees that move as one."""
        return len(self.plan.exact_branches(depth)) + len(self.plan.shown_nodes(depth))

    @property
    def depths(self) -> list[Depth]:
        """The stored levels, coarse to fine."""
        starts = np.array(self.segments)
        frames = starts[:, 1] - starts[:, 0]
        result = []
        for depth, errors in enumerate(self.container.errors):
            rms = float(np.sqrt((errors[:, 1] ** 2 * frames).sum() / frames.sum()))
            result.append(Depth(depth, self.nodes_at(depth), self.container.level_end(depth),
                                float(errors[:, 0].max()), rms, self.available(depth)))
        return result

    def table1(self) -> dict:
        """The paper's table 1: depth, nodes, leaves and the four parameters of the ATH."""
        nodes = self.plan.nodes
        leaf = (self.plan.branches["flags"][nodes["branch"]] & WHOLE > 0) | (
            self.plan.branches["subtree"][nodes["branch"]] == 1)
        return {"depth": self.plan.height + 1, "nodes": len(nodes), "leaves": int(leaf.sum())} | dict(
            zip(TABLE_KEYS, self.thresholds))

    def info(self) -> dict:
        """What `athcodec info --json` prints."""
        return {
            "vertices": self.vertex_count, "frames": self.frame_count, "fps": self.fps, "branches": self.branch_count,
            "segments": len(self.segments), "nodes": len(self.plan.nodes), "bytes": self.file_length,
            "available_bytes": self.container.available_length, "max_error_bound": self.max_error_bound,
            "complete": self.complete, "levels": self.level_count, "full_levels": self.full_level_count,
            "format": f"{ct.MAJOR}.{ct.MINOR}", "ath": self.table1(),
            "depths": [{"depth": d.depth, "nodes": d.nodes, "bytes": d.bytes, "max_error": d.max_error,
                        "rms_error": d.rms_error, "available": d.available} for d in self.depths],
        }

    # ---- static data, in the source's numbering ----

    @property
    def rest(self) -> np.ndarray:
        """Rest pose as decoded, (N, 3), float32 or what the source had."""
        pose = self.plan.rest + self.origin if self._exact_rest is None else self._exact_rest
        out = np.empty((self.vertex_count, 3), self._rest_dtype.newbyteorder("="))
        out[self._vertex_source] = pose
        return out

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

    def _static(self, kind: int) -> tuple[dict, np.ndarray | None] | None:
        chunk = self.container.find(kind)
        if chunk is None:
            return None
        return ct.parse_array(self.container.payload(chunk), str(chunk), self.limits)

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
    def metadata(self) -> dict:
        """Unit, up axis and whatever else the source said of itself."""
        chunk = self.container.find(ct.METADATA)
        return ct.parse_metadata(self.container.payload(chunk), self.limits) if chunk else {}

    @cached_property
    def attributes(self) -> dict[str, np.ndarray]:
        """Named static arrays, unchanged. Those of a file that was cut off before them are left out."""
        result: dict[str, np.ndarray] = {}
        for chunk in self.container.chunks:
            if chunk.kind != ct.ATTRIBUTE or not self.container.is_available(chunk):
                continue
            if len(result) >= self.limits.attributes:
                raise LimitExceeded(f"{chunk}: got more than {self.limits.attributes} attributes")
            data = self.container.payload(chunk)
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

    def _streams(self, segment: int, level: int) -> tuple[list[LevelStream], dict[int, bytes]]:
        """How to read each level, and the stem streams of those up to `level`."""
        start, stop = self.segments[segment]
        streams, bodies = [], {}
        for d in range(self.full_level_count):
            streams.append(LevelStream(1.0))
            if d > level or not self.plan.has_stems(d):
                continue
            where = f"STEMS of level {d}, segment {segment}"
            head, bodies[d] = ct.parse_stems(self._required(ct.STEMS, d, segment), stop - start, where)
            streams[d] = LevelStream(head.step, float(head.omega))
            if head.bits:
                steps = entropy.decode_temporal(head.basis, head.rank, stop - start, head.bits, where)
                streams[d].temporal = temporal_basis(steps, head.bits)
        return streams, bodies

    def _required(self, kind: int, level: int, segment: int) -> bytes:
        if segment in self._missing_segments[level]:
            raise LevelUnavailable(f"level {level}, segment {segment}: not in the file; it is cut off at "
                                   f"{self.container.available_length} of {self.file_length} bytes")
        return self.container.required(kind, level, segment)

    def read_segment(self, segment: int, depth: int) -> SegmentMotion:
        """The integers of one segment for playback at `depth`. Raises a FormatError, or LevelUnavailable."""
        start, stop = self.segments[segment]
        streams, bodies = self._streams(segment, depth)
        motion = SegmentMotion(self.plan, stop - start, streams)
        for level, body in bodies.items():
            entropy.decode_stems(body, motion, level, f"STEMS of level {level}, segment {segment}")
        for level in self.plan.affine_levels(depth):
            entropy.decode_affines(self._required(ct.AFFINES, level, segment), motion, level,
                                   f"AFFINES of level {level}, segment {segment}")
        return motion

    def segment_positions(self, segment: int, depth: int, dtype=None) -> np.ndarray:
        """(N, 3, frames) positions of one segment in file order."""
        motion = self.read_segment(segment, depth)
        return self._finish(motion, segment, depth, np.dtype(dtype or self.dtype))

    def _finish(self, motion: SegmentMotion, segment: int, depth: int, dtype: np.dtype) -> np.ndarray:
        # corrections belong to the file's own type; another type is had by a cast, so that it stays within the bound
        positions = motion.pose(depth, self.origin, self.dtype)
        if self.container.find(ct.CORRECTIONS, depth, segment) is not None:
            where = f"CORRECTIONS of segment {segment}"
            step, stream = ct.parse_corrections(self._required(ct.CORRECTIONS, depth, segment), where)
            entropy.decode_corrections(stream, step, positions, where)
        return positions.astype(dtype, copy=False)

    def blocks(self, depth: int | None = None, dtype=None, frames=None) -> Iterator[tuple[int, np.ndarray]]:
        """(start, (k, N, 3)) over the segments that hold the frames, one segment in memory at a time."""
        depth, (first, last) = self._check_depth(depth), self._check_frames(frames)
        for index, (start, stop) in enumerate(self.segments):
            low, high = max(start, first), min(stop, last)
            if low < high:
                positions = self.segment_positions(index, depth, dtype)
                yield low, scatter(positions, self._vertex_source, low - start, high - start)

    def positions(self, frames=None, depth: int | None = None, dtype=None) -> np.ndarray:
        """Positions in the source's vertex order: (N, 3) for one frame, (T, N, 3) for a slice or None (all).

        depth: level of detail, by default the deepest that is complete. Raises LevelUnavailable, or a FormatError.
        """
        first, last = self._check_frames(frames)
        dtype = np.dtype(dtype or self.dtype)
        out = np.empty((last - first, self.vertex_count, 3), dtype)
        for start, block in self.blocks(depth, dtype, slice(first, last)):
            out[start - first: start - first + len(block)] = block
        return out if frames is None or isinstance(frames, slice) else out[0]

    def _segment_of(self, frame: int) -> tuple[int, int]:
        index = next(i for i, (start, stop) in enumerate(self.segments) if start <= frame < stop)
        return index, frame - self.segments[index][0]

    def affines(self, frame: int, depth: int | None = None) -> Affines:
        """The cut at `depth` as matrices: nodes that move as one, and the least-squares maps of exact stems.

        Matrices take absolute rest positions (self.rest) to absolute positions (paper, eq. 2). Raises as `positions`.
        """
        depth, (frame, _) = self._check_depth(depth), self._check_frames(frame)
        segment, at = self._segment_of(frame)
        motion = self.read_segment(segment, depth)
        positions = self._finish(motion, segment, depth, np.dtype(np.float64))[:, :, at]
        nodes, stems = self.plan.nodes[self.plan.shown_nodes(depth)], self.plan.exact_branches(depth)
        first = np.concatenate([nodes["first"], self.plan.branches["first"][stems]])
        count = np.concatenate([nodes["count"], self.plan.branches["count"][stems]])
        is_stem = np.arange(len(first)) >= len(nodes)
        matrices = np.empty((len(first), 3, 4))
        matrices[: len(nodes)] = motion.node_matrices(depth, self.origin)[at]
        try:
            maps = stem_maps(self.hierarchy, self.plan.rest + self.origin, positions[None])
        except np.linalg.LinAlgError:
            raise BadChunk(f"frame {frame}: got positions that no matrix fits; expected those of a plant") from None
        matrices[len(nodes):] = maps[0, stems]
        branch = self.hierarchy.branch_source[np.concatenate([nodes["branch"], stems])]
        order = np.argsort(first, kind="stable")
        return Affines(branch[order], first[order], count[order], is_stem[order], matrices[order])

    def residual(self, frame: int, depth: int | None = None) -> np.ndarray:
        """What the matrices of `affines` leave, in the space of the rest pose (paper, eq. 3): (N, 3), source order.

        The matrix of a vertex's part, applied to this, gives the position at the deepest available level.
        """
        parts = self.affines(frame, depth)
        full = self.positions(frame, self.deepest, np.float64)[self._vertex_source]
        out = np.empty_like(full)
        for first, count, matrix in zip(parts.first_vertex, parts.vertex_count, parts.matrices):
            rows = slice(first, first + count)
            try:
                inverse = np.linalg.pinv(matrix[:, :3])
            except np.linalg.LinAlgError:
                raise BadChunk(f"frame {frame}: got a matrix without an inverse; expected one of a plant") from None
            out[self._vertex_source[rows]] = (full[rows] - matrix[:, 3]) @ inverse.T
        return out

    # ---- checks ----

    def check(self) -> None:
        """Reads every chunk and decodes every level. Raises the first FormatError met."""
        if not self.complete:
            raise Truncated(f"file: got {self.container.available_length} bytes; expected {self.file_length}; "
                            f"{self.missing}")
        for chunk in self.container.chunks:
            self.container.payload(chunk)
        try:
            _ = self.metadata, self.faces, self.edges, self.attributes
        except ClipError as error:
            raise BadChunk(f"static data: {error}") from None
        for segment in range(len(self.segments)):
            for depth in range(self.level_count):
                self.segment_positions(segment, depth)



