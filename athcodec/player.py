"""ath.h in Python: a file opened by the C core, its prepared segments, and what they show.

Every member mirrors a function of core/ath.h, where its contract stands; this module owns the memory, checks sizes and
turns result codes into the errors of errors.py. It reads no file: whoever uses it feeds the bytes (decoder.py does).
Vertices are in file order unless said otherwise; positions are in scene units.
"""

from __future__ import annotations

import ctypes
import threading
from ctypes import (
    POINTER,
    Structure,
    byref,
    c_double,
    c_float,
    c_int32,
    c_size_t,
    c_uint8,
    c_uint16,
    c_uint32,
    c_uint64,
)

import numpy as np

from athcodec._native import BRANCH, as_bytes, lib

ALIGNMENT = 16
FAULT_TEXT = 256
OK, HELD, MISSING = 0, 65, 66
FILE_ORDER, SOURCE_ORDER = 0, 1

PART = np.dtype([(name, "<i4") for name in ("first", "count", "branch", "index")])


class Limits(Structure):
    """ath_limits."""

    _fields_ = [(name, c_uint32) for name in ("chunks table_bytes vertices branches frames hierarchy_depth chunk_bytes "
                                              "reserved").split()]
    _fields_ += [("memory_bytes", c_uint64)]

    @classmethod
    def of(cls, limits) -> Limits:
        """Those of container.Limits that the core keeps to; more than a field can hold is its largest value."""
        most = {name: 256 ** ctypes.sizeof(kind) - 1 for name, kind in cls._fields_ if name != "reserved"}
        return cls(**{name: min(getattr(limits, name), largest) for name, largest in most.items()})


class Info(Structure):
    """ath_info."""

    _fields_ = [("file_length", c_uint64), ("prelude_length", c_uint64), ("max_error", c_double),
                ("origin", c_double * 3)]
    _fields_ += [(name, c_int32) for name in ("vertex_count branch_count frame_count segment_count clip_count "
                                              "level_count full_level_count node_count chunk_count is_float64").split()]
    _fields_ += [("epsilon", c_float), ("xi", c_float), ("eta", c_uint32), ("lam", c_uint32),
                 ("rest_is_float64", c_int32)]


class Clip(Structure):
    """ath_clip."""

    _fields_ = [("name", ctypes.c_char_p), ("duration", c_double)]
    _fields_ += [(name, c_int32) for name in ("first_frame frame_count first_segment segment_count loop "
                                              "reserved").split()]


class Chunk(Structure):
    """ath_chunk."""

    _fields_ = [("bytes", ctypes.c_void_p), ("offset", c_uint64), ("length", c_uint32), ("checksum", c_uint32),
                ("segment", c_uint32), ("kind", c_uint16), ("level", c_uint8), ("reserved", c_uint8)]


class Fault(Structure):
    """ath_fault_info."""

    _fields_ = [("code", c_int32), ("field", c_int32), ("chunk", c_int32), ("kind", c_uint16), ("level", c_uint8),
                ("reserved", c_uint8), ("segment", c_uint32), ("offset", c_uint64), ("found", c_double),
                ("least", c_double), ("most", c_double)]

    def __str__(self) -> str:
        text = ctypes.create_string_buffer(FAULT_TEXT)
        lib.ath_fault_text(byref(self), text, len(text))
        return text.value.decode()


class Range(Structure):
    """ath_range."""

    _fields_ = [("offset", c_uint64), ("size", c_uint64)]


def aligned(size: int) -> np.ndarray:
    """Uninitialised bytes whose address is a multiple of ALIGNMENT."""
    block = np.empty(size + ALIGNMENT, np.uint8)
    start = -block.ctypes.data % ALIGNMENT
    return block[start: start + size]


class PlayError(Exception):
    """A result of the core that is no success: `code` (FORMAT.md, "Errors", or above 63 about the call), and the fault
    with the chunk that it is about, or None."""

    def __init__(self, code: int, fault: Fault | None = None):
        super().__init__(str(fault) if fault else lib.ath_result_name(code).decode())
        self.code, self.chunk = code, fault if fault and fault.chunk >= 0 else None


class Segment:
    """One segment prepared at one level, in memory of its own that another preparation may take over."""

    def __init__(self, size: int):
        self.memory = aligned(size)

    @property
    def pointer(self) -> int:
        return self.memory.ctypes.data


class Work:
    """What one preparation at a time needs."""

    def __init__(self, size: int):
        self.memory = aligned(size)


class File:
    """An opened file. Raises PlayError; safe to read from several threads, each with a Work of its own."""

    def __init__(self, prelude: bytes, limits: Limits):
        self._prelude = as_bytes(prelude)
        data, front, size, fault = self._prelude.ctypes.data, c_size_t(), c_size_t(), Fault()
        self._check(lib.ath_front(data, len(self._prelude), byref(limits), byref(front), byref(size), byref(fault)), fault)
        self._memory = aligned(size.value)
        self._file = self._memory.ctypes.data
        self._check(lib.ath_open(self._file, size.value, data, len(self._prelude), byref(limits), byref(fault)), fault)
        self.info = Info()
        lib.ath_get_info(self._file, byref(self.info))
        self._build, self._building = None, threading.Lock()

    @staticmethod
    def _check(result: int, fault: Fault | None = None) -> int:
        if result not in (OK, HELD):
            raise PlayError(result, fault)
        return result

    def build(self) -> None:
        """Computes the bases that all segments share, unless that is done."""
        with self._building:
            if self._build is None:
                memory = aligned(lib.ath_build_size(self._file))
                self._check(lib.ath_build(self._file, memory.ctypes.data, len(memory)))
                self._build = memory

    def _array(self, address: int, dtype, count: int) -> np.ndarray:
        dtype = np.dtype(dtype)
        view = np.ctypeslib.as_array(ctypes.cast(address, POINTER(c_uint8)), (count * dtype.itemsize,))
        return view.view(dtype).copy()

    def branches(self) -> np.ndarray:
        """(B,) of _native.BRANCH."""
        return self._array(lib.ath_branches(self._file), BRANCH, self.info.branch_count)

    def branch_source(self) -> np.ndarray:
        return self._array(lib.ath_branch_source(self._file), "<i4", self.info.branch_count)

    def vertex_source(self) -> np.ndarray:
        return self._array(lib.ath_vertex_source(self._file), "<i4", self.info.vertex_count)

    def times(self) -> np.ndarray:
        """Seconds, (T,) float64, of all clips."""
        return self._array(lib.ath_times(self._file), "<f8", self.info.frame_count)

    def clips(self) -> list[Clip]:
        """In memory of the file."""
        return ctypes.cast(lib.ath_clips(self._file), POINTER(Clip))[: self.info.clip_count]

    def seam_error(self, clip: int, level: int) -> float:
        return lib.ath_seam_error(self._file, clip, level)

    def rest(self, order: int = FILE_ORDER) -> np.ndarray:
        """(N, 3) float64."""
        out = np.empty((self.info.vertex_count, 3))
        lib.ath_rest_float64(self._file, order, out.ctypes.data, out.strides[0])
        return out

    def chunks(self) -> list[Chunk]:
        """The chunk table, in memory of the file."""
        return ctypes.cast(lib.ath_chunks(self._file), POINTER(Chunk))[: self.info.chunk_count]

    def errors(self) -> np.ndarray:
        """(levels, segments, 2) float32: largest and RMS error, scene units."""
        count = 2 * self.info.level_count * self.info.segment_count
        return self._array(lib.ath_errors(self._file), "<f4", count).reshape(self.info.level_count, -1, 2)

    def cut(self, level: int) -> np.ndarray:
        """(P,) of PART: what the plant is made of at a level."""
        count = c_int32()
        lib.ath_cut_size(self._file, level, byref(count), None, None)
        parts = np.zeros(count.value, PART)
        lib.ath_cut(self._file, level, parts.ctypes.data)
        return parts

    # ---- bytes ----

    def missing(self, level: int, segment: int, last: int | None = None) -> list[tuple[int, int]]:
        """(offset, size) of the bytes that are still to be fed for a segment, or all from it to the last."""
        last = segment if last is None else last
        count = lib.ath_ranges(self._file, level, segment, last, 0, None, 0)
        ranges = (Range * count)()
        lib.ath_ranges(self._file, level, segment, last, 0, ranges, count)
        return [(each.offset, each.size) for each in ranges]

    def feed(self, data: np.ndarray, offset: int) -> None:
        """data: uint8, which the caller keeps until it is dropped."""
        lib.ath_feed(self._file, data.ctypes.data, offset, len(data))

    def drop(self, offset: int, size: int) -> None:
        lib.ath_drop(self._file, offset, size)

    # ---- segments ----

    def work_size(self) -> int:
        return lib.ath_work_size(self._file)

    def segment_size(self, level: int) -> int:
        return lib.ath_segment_size(self._file, level)

    def prepare(self, work: Work, segment: int, level: int, into: Segment) -> None:
        """Decodes a segment at a level."""
        self.build()
        result = lib.ath_prepare(work.memory.ctypes.data, len(work.memory), self._file, segment, level, into.pointer,
                                 len(into.memory))
        if result != OK:
            fault = Fault()
            lib.ath_work_fault(work.memory.ctypes.data, byref(fault))
            raise PlayError(result, fault)

    def positions(self, segment: Segment, frame: float, out: np.ndarray, order: int = SOURCE_ORDER) -> None:
        """Fills `out`, contiguous (N, 3) float32 or float64, with the positions of a frame of the segment."""
        show = lib.ath_positions_float64 if out.dtype == np.float64 else lib.ath_positions
        self._check(show(self._file, byref(ctypes.c_void_p(segment.pointer)), 1, frame, order, out.ctypes.data,
                         out.strides[0]))

    def matrices(self, segment: Segment, frame: float, node_count: int) -> np.ndarray:
        """(nodes, 3, 4) float64: maps of the cut's nodes from rest positions to positions."""
        out = np.empty((node_count, 3, 4))
        self._check(lib.ath_matrices_float64(self._file, byref(ctypes.c_void_p(segment.pointer)), 1, frame,
                                          out.ctypes.data, 12 * out.itemsize))
        return out

    def depth_for(self, segments: range, distance: float, fov: float, height: float, pixels: float) -> int:
        """The coarsest level whose error in these segments, seen from afar, is at most `pixels`."""
        return lib.ath_level_for(self._file, segments[0], segments[-1], distance, fov, height, pixels)
