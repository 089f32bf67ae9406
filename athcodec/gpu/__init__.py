"""The GPU form of a file (ath_gpu.h, docs/gpu.md): blocks of words that shaders compute positions from.

`GpuFile` makes the blocks; evaluate.py computes with them in NumPy what the shaders beside it, *.wgsl, do on a GPU.
"""

from __future__ import annotations

import ctypes
from ctypes import POINTER, byref, c_float, c_int, c_int32, c_size_t, c_uint32, c_void_p
from pathlib import Path

import numpy as np

from athcodec._native import as_bytes, lib
from athcodec.decoding import core_file
from athcodec.decoding.container import Limits

SHADERS = Path(__file__).parent


class Room(ctypes.Structure):
    """ath_gpu_room: words of the parts of a segment."""

    _fields_ = [(name, c_uint32) for name in "rows values shapes turns corrected corrections waves".split()]


_FUNCTIONS = {  # core/include/ath_gpu.h
    "ath_gpu_level_size": (c_size_t, [c_void_p, c_int32]),
    "ath_gpu_build_level": (c_int, [c_void_p, c_int32, c_void_p, c_size_t]),
    "ath_gpu_record_size": (c_size_t, [c_void_p, c_int32, POINTER(Room)]),
    "ath_gpu_record": (c_int, [c_void_p, POINTER(Room), c_void_p, c_size_t]),
    "ath_gpu_recorded": (c_void_p, [c_void_p, POINTER(Room)]),
    "ath_gpu_bounds": (None, [c_void_p, c_void_p, POINTER(c_float * 6)]),
    "ath_gpu_frame": (c_int32, [c_void_p, c_int32]),
}
for _name, (_result, _arguments) in _FUNCTIONS.items():
    getattr(lib, _name).restype, getattr(lib, _name).argtypes = _result, _arguments


class GpuFile:
    """A file whose levels and segments are made into blocks for the GPU.

    Parameters
    ----------
    data : bytes
        The whole file.
    host_mesh : array, optional
        (N, 3) float32 in source order, the rest pose of files that do not hold one.
    """

    def __init__(self, data: bytes, host_mesh: np.ndarray | None = None):
        """Open a file of `data`. `host_mesh` (N, 3) is the rest pose of a file that does not store one."""
        limits = core_file.Limits.of(Limits())
        _, memory, _ = core_file.front(data, limits)
        self.core, self._bytes = core_file.File(data, memory, limits), as_bytes(data)
        self.core.feed(self._bytes, 0)
        if host_mesh is not None:
            self.core.set_host_mesh(host_mesh)
        self.core.refine(0)
        self._file = self.core.pointer
        self._work = core_file.Work(self.core.work_size())

    def level(self, level: int) -> np.ndarray:
        """Return words of a level's block, uint32."""
        self.core.refine(level)
        memory = core_file.aligned(lib.ath_gpu_level_size(self._file, level))
        self._check(lib.ath_gpu_build_level(self._file, level, memory.ctypes.data, len(memory)))
        words = memory.view(np.uint32)
        return words[: words[0]].copy()

    def segment(self, segment: int, level: int) -> np.ndarray:
        """Return words of the block of a segment at a level, uint32."""
        room = Room()  # none: to find out how much there has to be
        block = self.recorded(segment, level, room)
        if block is None:
            block = self.recorded(segment, level, room)
        assert block is not None
        return block

    def recorded(self, segment: int, level: int, room: Room) -> np.ndarray | None:
        """Return the words of a segment's block for the GPU at a level. If the block needs more than `room`, set `room`
        to what it needs and return None.
        """
        memory = core_file.aligned(lib.ath_gpu_record_size(self._file, level, byref(room)))
        self._prepare(segment, level, room, memory)
        at = lib.ath_gpu_recorded(memory.ctypes.data, byref(room))
        if not at:
            return None
        words = memory[at - memory.ctypes.data :].view(np.uint32)
        return words[: words[0]].copy()

    def prepared(self, segment: int, level: int) -> core_file.Segment:
        """Return the segment as the core has it, which the blocks stand for."""
        return self._prepare(segment, level)

    def _prepare(
        self, segment: int, level: int, room: Room | None = None, memory: np.ndarray | None = None
    ) -> core_file.Segment:
        """Decode a segment at a level and return it. With `room` and `memory`, the segment's block for the GPU is
        recorded there as well.
        """
        self.core.refine(level)
        into = core_file.Segment(self.core.segment_size(level))
        place = self._work.pointer, len(self._work.memory), self._file, segment, level
        self._check(lib.ath_prepare_start(*place, into.pointer, len(into.memory)))
        if room is not None and memory is not None:
            self._check(lib.ath_gpu_record(self._work.pointer, byref(room), memory.ctypes.data, len(memory)))
        self._check(lib.ath_prepare_step(self._work.pointer, core_file.MOST_STEPS))
        return into

    def bounds(self, segment: core_file.Segment) -> np.ndarray:
        """Return (2, 3) float32, the box of all that a prepared segment shows, relative to the origin."""
        box = (c_float * 6)()
        lib.ath_gpu_bounds(self._file, segment.pointer, byref(box))
        return np.array(box, np.float32).reshape(2, 3)

    def coded_frame(self, frame: int) -> int:
        """Return which of the coded frames of its segment shows a frame of the file."""
        return lib.ath_gpu_frame(self._file, frame)

    @staticmethod
    def _check(result: int) -> None:
        if result != core_file.OK:
            raise core_file.CoreError(result)


def corners_of(triangles: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return what vertices.wgsl takes normals from, uint32: for each vertex where its pairs begin in this array, and
    where the last end, (N + 1,); then the pairs, the two other vertices of each triangle at a vertex, counter-clockwise
    like the triangle. triangles: (F, 3), file order."""
    turns = np.concatenate([np.roll(triangles, -turn, axis=1) for turn in range(3)]).astype(np.uint32)
    turns = turns[np.argsort(turns[:, 0], kind="stable")]
    first = np.searchsorted(turns[:, 0], np.arange(vertex_count + 1))
    return np.concatenate([(vertex_count + 1 + 2 * first).astype(np.uint32), turns[:, 1:].reshape(-1)])
