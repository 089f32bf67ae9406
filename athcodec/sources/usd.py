"""Reads USD stages: see usd_stage.py for what is read of them. USD takes as much memory as a file says that it needs,
and may crash on damaged ones, so it works in a process of its own (reader_process.py)."""

from __future__ import annotations

from athcodec.files.plain import FilePath
from athcodec.motion.clip import MotionClip
from athcodec.sources import ReadOptions
from athcodec.sources.reader_process import read_apart


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the USD file `path`; close it, or use it in a `with` statement.

    options.only are patterns of prim names or paths, options.fps the rate at which the stage is sampled in place of its
    own. The rest pose is a static primvar `rest` where every prim has one. Raises ClipError, OSError.
    """
    return read_apart(
        path, options, "athcodec.sources.usd_stage", "stage: it is damaged, or no USD file: USD's library"
    )
