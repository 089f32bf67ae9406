"""Reads Alembic: see alembic_archive.py for what is read of it. Alembic's library crashes on damaged archives, so it
works in a process of its own (reader_process.py)."""

from __future__ import annotations

from athcodec.files.plain import FilePath
from athcodec.motion.clip import MotionClip
from athcodec.sources import ReadOptions
from athcodec.sources.reader_process import read_apart


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the Alembic file `path`; close it, or use it in a `with` statement.

    options.only are patterns of names or paths of objects. Raises ClipError, OSError.
    """
    crashed = "archive: it is damaged, or no Alembic archive: Alembic's library"
    return read_apart(path, options, "athcodec.sources.alembic_archive", crashed)
