"""ath.h in Python: a file opened by the C core, its prepared segments, and what they show.

Every member mirrors a function of core/include/ath.h, where its contract stands. This module holds the memory, checks
sizes and turns result codes into exceptions. It reads no file: file_bytes.py feeds the bytes.
Vertices are in file order unless said otherwise; positions are in scene units.
"""

from __future__ import annotations

import ctypes
import math
import threading
from collections.abc import Callable
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_double,
    c_int32,
    c_size_t,
    c_uint8,
    c_uint16,
    c_uint32,
    c_uint64,
    c_void_p,
)

import numpy as np
import numpy.typing as npt

from athcodec._native import BRANCH, CHUNK, MEASURES, CorePolygons, as_bytes, check_layouts, fields, lib
from athcodec.decoding import container
from athcodec.errors import LimitExceeded
from athcodec.motion.polygons import Polygons, type_of

ALIGNMENT = 64  # Bytes of a cache line.
MOST_STEPS = 2**31 - 1
KEPT_SHARE = 2  # A segment keeps at most 1 / KEPT_SHARE of its memory for a deeper level; a hundredth is usual.
FAULT_TEXT = 256
LEVEL_NAME = 32
OK, HELD, MISSING = 0, 65, 66
FILE_ORDER, SOURCE_ORDER = 0, 1
AS_MARKED = 3
BLEND_CLIPS = 4

PART = np.dtype(fields("<i4", "first count branch index"))


class Limits(Structure):
    """ath_limits."""

    _fields_ = fields(
        *(c_uint32, "chunks table_bytes vertices branches frames hierarchy_depth chunk_bytes reserved"),
        *(c_uint64, "memory_bytes"),
    )

    @classmethod
    def of(cls, limits: container.Limits) -> Limits:
        """Return the limits that the core keeps to; more than a field can hold becomes its largest value."""
        most = {name: 256 ** ctypes.sizeof(kind) - 1 for name, kind in cls._fields_ if name != "reserved"}
        return cls(**{name: min(getattr(limits, name), largest) for name, largest in most.items()})


class Info(Structure):
    """ath_info."""

    _fields_ = fields(
        *(c_uint64, "file_length prelude_length", c_double, "max_error", c_double * 3, "origin"),
        *(c_int32, "vertex_count place_count branch_count frame_count segment_count clip_count level_count"),
        *(c_int32, "full_level_count"),
        *(c_int32, "layer_count depth_levels node_count chunk_count is_float64 rest_is_float64 rest_is_host"),
        *(c_uint32 * 2, "host_checksum", c_int32, "is_predicted"),
    )


class Clip(Structure):
    """ath_clip."""

    _fields_ = fields(
        *(ctypes.c_char_p, "name", c_double, "duration"),
        *(c_int32, "first_frame frame_count first_segment segment_count loop periodic"),
    )


class Fault(Structure):
    """ath_fault_info; its text is one line of English."""

    _fields_ = fields(
        *(c_int32, "code field chunk", c_uint16, "kind", c_uint8, "level reserved"),
        *(c_uint32, "segment", c_uint64, "offset", c_double, "found least most"),
    )

    def __str__(self) -> str:
        text = ctypes.create_string_buffer(FAULT_TEXT)
        lib.ath_fault_text(byref(self), text, len(text))
        return text.value.decode()


class Share(Structure):
    """ath_share."""

    _fields_ = fields(c_void_p, "segments", c_int32, "segment_count", c_double, "frame weight")


class Range(Structure):
    """ath_range."""

    _fields_ = fields(c_uint64, "offset size")


MIRRORS: dict[str, type[ctypes.Structure] | np.dtype] = {
    "ath_clip": Clip,
    "ath_fault_info": Fault,
    "ath_info": Info,
    "ath_limits": Limits,
    "ath_part": PART,
    "ath_range": Range,
    "ath_share": Share,
}
check_layouts(MIRRORS)


def aligned(size: int) -> np.ndarray:
    """Return uninitialised bytes whose address is a multiple of ALIGNMENT."""
    block = np.empty(size + ALIGNMENT, np.uint8)
    start = -block.ctypes.data % ALIGNMENT
    return block[start : start + size]


class CoreError(Exception):
    """A failure of the core, with the sentence for it; codes are those of FORMAT.md, or above 63 about the call."""

    def __init__(self, code: int, fault: Fault | None = None):
        super().__init__(str(fault) if fault else lib.ath_result_name(code).decode())
        self.code = code


def front(data: bytes, limits: Limits) -> tuple[int, int, Fault]:
    """Return, from the first bytes of a file, how many bytes ath_open needs at least, how much memory it then takes (0:
    not known yet), and what is missing. Raises CoreError."""
    size, memory, fault = c_size_t(), c_size_t(), Fault()
    result = lib.ath_front(data, len(data), byref(limits), byref(size), byref(memory), byref(fault))
    if result not in (OK, MISSING):
        raise CoreError(result, fault)
    return size.value, memory.value, fault


class Segment:
    """One segment prepared at one level, in memory that another preparation may take over, and what a deeper level goes
    on from.

    If `is_delivered`, the positions went to an array of the caller's, and only its end may be used.
    """

    kept = np.empty(0, np.uint8)

    def __init__(self, size: int):
        self.memory, self.is_delivered = aligned(size), False
        self.pointer: int = self.memory.ctypes.data

    @property
    def kept_pointer(self) -> int | None:
        return self.kept.ctypes.data if len(self.kept) else None


class Work:
    """Scratch memory for one preparation at a time."""

    def __init__(self, size: int):
        self.memory = aligned(size)
        self.pointer: int = self.memory.ctypes.data


class File:
    """An opened file. It raises CoreError, and several threads may use it, each with its Work."""

    def __init__(self, prelude: bytes, memory: int, limits: Limits):
        """Open a file in the C core. `prelude` are the bytes up to the first chunk of motion, `memory` is the size in
        bytes of the memory that the core needs. Raises CoreError."""
        self._prelude, self._memory, fault = as_bytes(prelude), aligned(memory), Fault()
        self._file = self._memory.ctypes.data
        self._check(
            lib.ath_open(
                self._file, memory, self._prelude.ctypes.data, len(self._prelude), byref(limits), byref(fault)
            ),
            fault,
        )
        self.info = Info()
        lib.ath_get_info(self._file, byref(self.info))
        self.has_rest = not self.info.rest_is_host
        self._refinements: list[np.ndarray] = []
        self._refined = -1  # The deepest level whose segments have what they share.
        self.poses_read = -1  # The deepest level whose reference pose the core has read.
        self._building = threading.Lock()

    @property
    def pointer(self) -> int:
        """Address of the ath_file, for functions outside ath.h."""
        return self._file

    @property
    def prelude(self) -> np.ndarray:
        """The bytes in front of the motion, uint8."""
        return self._prelude

    @staticmethod
    def _check(result: int, fault: Fault | None = None) -> int:
        if result not in (OK, HELD):
            raise CoreError(result, fault)
        return result

    def set_host_mesh(self, mesh: np.ndarray) -> None:
        """Set the rest pose of a file without one, (N, 3) float32 in source order."""
        fault = Fault()
        with self._building:
            result = lib.ath_set_host_mesh(self._file, mesh.ctypes.data, mesh.strides[0], len(mesh), byref(fault))
            self._check(result, fault)
            self.has_rest = True

    def refine(self, level: int) -> None:
        """Compute the tables that all segments share at a level, unless this has been done."""
        with self._building:
            if level <= self._refined:
                return
            memory = aligned(self._refine_size(level))
            self._check(lib.ath_refine(self._file, level, memory.ctypes.data, len(memory)))
            self._refinements.append(memory)
            self._refined = level

    def refinement_size(self, level: int) -> int:
        """Return the bytes of what the segments share at the levels up to one, built already or not."""
        with self._building:
            further = self._refine_size(level) if level > self._refined else 0
            return further + sum(map(len, self._refinements))

    def _refine_size(self, level: int) -> int:
        size, fault = c_size_t(), Fault()
        self._check(lib.ath_refine_size(self._file, level, byref(size), byref(fault)), fault)
        self.poses_read = max(self.poses_read, level)
        return size.value

    def _array(self, address: int, dtype: npt.DTypeLike, count: int) -> np.ndarray:
        dtype = np.dtype(dtype)
        view = np.ctypeslib.as_array(ctypes.cast(address, POINTER(c_uint8)), (count * dtype.itemsize,))
        return view.view(dtype).copy()

    def polygons(self, kind: int, most: int) -> Polygons:
        """Return the faces or edges in a chunk of `kind` FACES or EDGES, whose bytes have been given to the core. Edges
        that follow from the branches are marked `derived` and empty.

        Raises LimitExceeded if there are more than `most` faces and corners together.
        """
        shape, fault = CorePolygons(), Fault()
        self._check(lib.ath_polygons_of(self._file, kind, byref(shape), byref(fault)), fault)
        types = [type_of(code) for code in (shape.index_type, shape.count_type)]
        count = shape.face_count + shape.corner_count
        if count > most:
            raise LimitExceeded(f"{container.KIND_NAMES[kind]}: got {count} faces and corners; the limit is {most}")
        corners = np.zeros(shape.corner_count, np.int32)
        counts = np.zeros(shape.face_count, np.uint32) if shape.is_mixed else None
        memory = aligned(lib.ath_polygons_size(self._file))
        at = None if counts is None else counts.ctypes.data
        result = lib.ath_read_polygons(
            self._file, kind, memory.ctypes.data, len(memory), at, corners.ctypes.data, byref(fault)
        )
        self._check(result, fault)
        count_type = types[1] if shape.is_mixed else None
        return Polygons(corners, counts, shape.face_count, shape.columns, types[0], count_type, bool(shape.is_derived))

    def branches(self) -> np.ndarray:
        """Return (B,) of _native.BRANCH."""
        return self._array(lib.ath_branches(self._file), BRANCH, self.info.branch_count)

    def branch_source(self) -> np.ndarray:
        return self._array(lib.ath_branch_source(self._file), "<i4", self.info.branch_count)

    def vertex_places(self) -> np.ndarray:
        """Return the vertex in file order at which each vertex of the source is, (N,) int32."""
        return self._array(lib.ath_vertex_places(self._file), "<i4", self.info.vertex_count)

    def rows(self, order: int) -> int:
        """Return how many vertices an order has."""
        return self.info.vertex_count if order == SOURCE_ORDER else self.info.place_count

    def times(self) -> np.ndarray:
        """Return the seconds of the frames of all clips, (T,) float64."""
        return self._array(lib.ath_times(self._file), "<f8", self.info.frame_count)

    def clips(self) -> list[Clip]:
        """Return the clips, which stay in the file's memory."""
        return ctypes.cast(lib.ath_clips(self._file), POINTER(Clip))[: self.info.clip_count]

    def seam_error(self, clip: int, level: int) -> float:
        return lib.ath_seam_error(self._file, clip, level)

    def level_rest(self, level: int, order: int = FILE_ORDER) -> np.ndarray:
        """Return the reference pose of the level, (rows(order), 3) float64, after reading it unless that is done."""
        with self._building:
            self._refine_size(level)
        out = np.empty((self.rows(order), 3))
        self._check(lib.ath_level_rest(self._file, level, order, out.ctypes.data, out.strides[0]))
        return out

    def rest(self, level: int, order: int = SOURCE_ORDER) -> np.ndarray:
        """Return the source's rest pose, (N, 3) float64, as decoded with the reference poses up to a level."""
        out, fault = np.empty((self.rows(order), 3)), Fault()
        with self._building:
            self._refine_size(level)
            self._check(lib.ath_read_rest(self._file, byref(fault)), fault)
            self._check(lib.ath_rest_float64(self._file, order, out.ctypes.data, out.strides[0]))
        return out

    def chunks(self) -> np.ndarray:
        """Return the chunk table, (C,) of CHUNK, with unknown optional kinds."""
        return self._array(lib.ath_chunks(self._file), CHUNK, self.info.chunk_count)

    def check_chunk(self, index: int, offset: int, data: bytes) -> None:
        """Compare the bytes of chunk `index`, which lies at `offset` of the file, with the checksum that the file
        states. Raises CoreError if they differ."""
        array, fault = as_bytes(data), Fault()
        self.feed(array, offset)
        try:
            self._check(lib.ath_check_chunk(self._file, index, byref(fault)), fault)
        finally:
            self.drop(offset, len(array))
            if offset < len(self._prelude):  # The prelude must stay.
                self.feed(self._prelude, 0)

    def errors(self) -> np.ndarray:
        """Return the error of each level in each segment by each of MEASURES, (levels, segments, 3), scene units."""
        shape = self.info.level_count, self.info.segment_count, len(MEASURES)
        return self._array(lib.ath_errors(self._file), "<f8", math.prod(shape)).reshape(shape)

    def joins(self) -> np.ndarray:
        """Return how each segment is joined to the one before it, (levels, segments) uint8."""
        shape = self.info.level_count, self.info.segment_count
        return self._array(lib.ath_joins(self._file), np.uint8, math.prod(shape)).reshape(shape)

    def stages(self) -> list[int]:
        """Return the place of each level, stored or not, among all that FORMAT.md numbers, whether shown or not."""
        return self._array(lib.ath_stages(self._file), np.uint8, self.info.full_level_count).tolist()

    def repeats(self) -> np.ndarray:
        """Return whether each frame repeats the positions of the one before, (frames,) bool."""
        return self._array(lib.ath_repeats(self._file), np.uint8, self.info.frame_count) > 0

    def level_error(self, level: int, segments: range) -> tuple[float, float, float]:
        """Return the error of a level in these segments by each of MEASURES, scene units."""
        largest, p99, rms = (
            lib.ath_level_error(self._file, level, segments[0], segments[-1], measure)
            for measure in range(len(MEASURES))
        )
        return largest, p99, rms

    def level_name(self, level: int) -> str:
        """Return the name of a level, for people."""
        text = ctypes.create_string_buffer(LEVEL_NAME)
        lib.ath_level_name(self._file, level, text, len(text))
        return text.value.decode()

    def segment_starts(self, segments: range) -> list[int]:
        """Return the first frame of each of these segments, and the frame behind the last of them."""
        return [lib.ath_segment_start(self._file, segment) for segment in (*segments, segments.stop)]

    def cut(self, level: int) -> np.ndarray:
        """Return the parts that a level cuts the plant into, (P,) of PART: nodes and runs of exact vertices."""
        count = c_int32()
        lib.ath_cut_size(self._file, level, byref(count), None, None)
        parts = np.zeros(count.value, PART)
        lib.ath_cut(self._file, level, parts.ctypes.data)
        return parts

    # ---- bytes ----

    def missing(self, level: int, segment: int, last: int | None = None) -> list[tuple[int, int]]:
        """Return (offset, size) of the bytes still to be fed for a segment, or for all from it to the last."""
        return self._ranges(lib.ath_ranges, level, segment, segment if last is None else last)

    def missing_of(self, segment: int, level: int, after: int = -1) -> list[tuple[int, int]]:
        """Return the missing bytes of the levels behind `after`, without those of the segment that it is joined to."""
        return self._ranges(lib.ath_onward_ranges, after, level, segment, segment)

    def _ranges(self, call: Callable[..., int], *of: int) -> list[tuple[int, int]]:
        count = call(self._file, *of, 0, None, 0)
        ranges = (Range * count)()
        call(self._file, *of, 0, ranges, count)
        return [(item.offset, item.size) for item in ranges]

    def feed(self, data: np.ndarray, offset: int) -> None:
        """Give bytes at an offset of the file to the core; the caller keeps the uint8 array until it is dropped."""
        lib.ath_feed(self._file, data.ctypes.data, offset, len(data))

    def drop(self, offset: int, size: int) -> None:
        lib.ath_drop(self._file, offset, size)

    # ---- segments ----

    def work_size(self) -> int:
        return lib.ath_work_size(self._file)

    def segment_size(self, level: int) -> int:
        return lib.ath_segment_size(self._file, level)

    def segment_size_to(self, segment: int, level: int) -> int:
        """Return the bytes of a segment whose positions go to an array if the core can write there."""
        return lib.ath_segment_size_to(self._file, segment, level)

    def goes_on(self, before: Segment, segment: int, level: int) -> bool:
        """Return whether a prepared segment is this one, at a level from which decoding can go on to this level."""
        same = lib.ath_segment_index(before.pointer) == segment and not before.is_delivered
        return same and bool(lib.ath_goes_on(self._file, before.pointer, before.kept_pointer, level))

    def joined_to(self, segment: int, level: int) -> int:
        """Return the segment whose end this one goes on from at a level, or -1."""
        return lib.ath_joined_to(self._file, segment, level)

    def is_ready(self, prepared: Segment, segment: int, level: int) -> bool:
        """Return whether a prepared segment is this one at this level."""
        return lib.ath_segment_index(prepared.pointer) == segment and self.level_of(prepared) == level

    def level_of(self, segment: Segment) -> int:
        """Return the level that a segment is prepared at, or -1."""
        return lib.ath_segment_level(segment.pointer)

    def prepare(
        self,
        work: Work,
        segment: int,
        level: int,
        into: Segment,
        before: Segment | None = None,
        joined_to: Segment | None = None,
        *,
        to: np.ndarray | None = None,
    ) -> None:
        """Decode a segment at a level into `into`, from its beginning or, if `before` is given, onward from this
        prepared segment at a coarser level.

        `joined_to` is the prepared segment whose end the segment is joined to. `to` (k, N, 3) is a contiguous array of
        the file's type that gets the positions if the core can write there (`into.is_delivered`). Raises CoreError.
        """
        fault, keeping = Fault(), self._room_to_keep(level, into)
        place, rooms = (work.pointer, len(work.memory), self._file), (into.pointer, len(into.memory))
        if before is None:
            result = lib.ath_prepare_start(*place, segment, level, *rooms)
        else:
            result = lib.ath_prepare_onward(*place, before.pointer, before.kept_pointer, level, *rooms)
        if result == OK:
            if len(keeping):
                self._check(lib.ath_keep(work.pointer, keeping.ctypes.data, len(keeping)))
            if joined_to is not None:
                self._check(lib.ath_follow(work.pointer, joined_to.pointer))
            into.is_delivered = to is not None and lib.ath_prepare_to(work.pointer, to.ctypes.data) == OK
            result = lib.ath_prepare_step(work.pointer, MOST_STEPS)
        if result != OK:
            lib.ath_work_fault(work.pointer, byref(fault))
        self._check(result, fault)
        into.kept = keeping[: lib.ath_kept_size(keeping.ctypes.data) if len(keeping) else 0].copy()

    def _room_to_keep(self, level: int, segment: Segment) -> np.ndarray:
        most = min(lib.ath_keep_size(self._file, level), len(segment.memory) // KEPT_SHARE)
        return aligned(max(most, ALIGNMENT)) if most else Segment.kept

    def positions(self, segment: Segment, frame: float, out: np.ndarray, order: int = SOURCE_ORDER) -> None:
        """Fill `out`, contiguous (rows(order), 3) float32 or float64, with the positions of a frame of the segment."""
        show = lib.ath_positions_float64 if out.dtype == np.float64 else lib.ath_positions
        self._check(
            show(self._file, byref(ctypes.c_void_p(segment.pointer)), 1, frame, order, out.ctypes.data, out.strides[0])
        )

    def frame_at(self, clip: int, seconds: float) -> float:
        """Return the place of a clip's time among the file's frames; times of a loop wrap around."""
        return lib.ath_frame_at(self._file, clip, seconds, AS_MARKED)

    def blended(self, shares: list[tuple[list[Segment], float, float]], order: int = SOURCE_ORDER) -> np.ndarray:
        """Return a blend of several clips, float32, with a row for each vertex in `order`. `shares` has for each clip
        the prepared segments around the frame, the frame, which may lie between two, and the weight."""
        arrays = [(c_void_p * len(segments))(*(segment.pointer for segment in segments)) for segments, _, _ in shares]
        records = (Share * len(shares))(
            *(
                Share(ctypes.addressof(array), len(array), frame, weight)
                for array, (_, frame, weight) in zip(arrays, shares)
            )
        )
        out, scratch = np.empty((self.rows(order), 3), np.float32), aligned(lib.ath_blend_size(self._file))
        self._check(
            lib.ath_blended_positions(
                self._file, records, len(records), order, out.ctypes.data, 12, scratch.ctypes.data, len(scratch)
            )
        )
        return out

    def matrices(self, segment: Segment, frame: float, node_count: int) -> np.ndarray:
        """Return for each of the level's `node_count` nodes the matrix from rest positions to positions at a frame,
        (node_count, 3, 4) float64."""
        out = np.empty((node_count, 3, 4))
        self._check(
            lib.ath_matrices_float64(
                self._file, byref(ctypes.c_void_p(segment.pointer)), 1, frame, out.ctypes.data, 12 * out.itemsize
            )
        )
        return out

    def level_for(
        self, segments: range, measure: str, distance: float, fov: float, height: float, pixels: float
    ) -> int:
        """Return the coarsest level whose error in these segments, seen at a distance, is at most `pixels`."""
        if measure not in MEASURES:
            raise ValueError(f"measure: got {measure!r}; expected one of {', '.join(MEASURES)}")
        number = MEASURES.index(measure)
        return lib.ath_level_for(self._file, segments[0], segments[-1], number, distance, fov, height, pixels)


def wind_weights(winds: np.ndarray, strength: float, heading: float) -> np.ndarray:
    """Return weights of clips for a wind, (K,) float64, from their strengths and headings, (K, 2), NaN without wind."""
    winds, weights = np.ascontiguousarray(winds, np.float64), np.zeros(len(winds))
    lib.ath_wind_weights(winds.ctypes.data, len(winds), strength, heading, weights.ctypes.data)
    return weights
