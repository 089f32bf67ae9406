"""Reads MDD point caches (LightWave, Blender ...): counts, a time in seconds per frame, then the frames as float32, all
big endian.

Times that are whole frames of a usual rate, but for their rounding to float32, give the clip that rate (see timing.py);
else it is options.fps or none. The faces come from a mesh beside it, and coordinates are taken as they are: see pc2.py.
"""

from __future__ import annotations

import os
import struct
from typing import BinaryIO

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.motion.clip import MotionClip
from athcodec.sources import ReadOptions
from athcodec.sources.pc2 import check_size, open_cache
from athcodec.sources.raw import raw_frames, read_exactly
from athcodec.sources.timing import times_in_seconds
from athcodec.untyped import JsonObject

HEADER = struct.Struct(">ii")


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the point cache `path`. Raises ClipError where it is none, or where the mesh has another number
    of vertices; OSError where a file cannot be opened."""
    return open_cache(path, options, _read_header)


def _read_header(file: BinaryIO, options: ReadOptions) -> JsonObject:
    """Return the fields of a MotionClip that an MDD point cache holds: "positions", "time" and "metadata". Raises
    ClipError if its header contradicts its size or its times do not increase."""
    frame_count, vertex_count = HEADER.unpack(read_exactly(file, HEADER.size, "header"))
    if not 0 < 4 * frame_count <= os.fstat(file.fileno()).st_size:
        raise ClipError(f"header: got {frame_count} frames, expected at least one and no more than the file can hold")
    offset = HEADER.size + 4 * frame_count
    check_size(file, frame_count, vertex_count, offset)
    stored = np.frombuffer(read_exactly(file, 4 * frame_count, "times"), ">f4").astype(np.float32)
    if not np.isfinite(stored).all() or (np.diff(stored) <= 0).any():
        raise ClipError("times: got some that do not increase, expected the seconds of every frame")
    time, metadata = times_in_seconds(stored, options.fps)
    return {"positions": raw_frames(file, offset, frame_count, vertex_count, ">f4"), "time": time, "metadata": metadata}
