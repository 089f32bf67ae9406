"""Writes MDD point caches, and beside them, where there are faces or edges, the mesh that they move as OBJ
(see pc2.py).

Positions and times are float32; a time is the frame's number divided by the rate, so that frame 1 of a clip which
starts there is at 1 / fps seconds, as the tools count.
"""

from __future__ import annotations

import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters.pc2 import check_counts, write_cache
from athcodec.exporters.timing import frame_rate_of, start_frame_of
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.sources.mdd import HEADER
from athcodec.untyped import JsonObject


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write the point cache, and beside it the mesh that it moves. Raise ClipError if another mesh is there already, or
    if times are closer than float32 tells apart, OSError if nothing can be written.
    """
    check_counts(motion)
    times = np.asarray(motion.time) + start_frame_of(motion.metadata) / frame_rate_of(motion)
    stored = times.astype(">f4")
    if (np.diff(stored.astype(np.float64)) <= 0).any():
        raise ClipError("time: got frames closer together than float32 tells apart, expected times for an MDD cache")
    return write_cache(
        motion, path, HEADER.pack(motion.frame_count, motion.vertex_count) + stored.tobytes(), ">f4", report
    )
