"""Opening of plain files for reading."""

from __future__ import annotations

import os
import stat
from os import fspath
from typing import BinaryIO, TypeAlias

from athcodec.errors import ClipError

FilePath: TypeAlias = str | os.PathLike[str]

# Keeps open() from waiting for somebody who writes to a pipe; of plain files it changes nothing.
_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0)


def open_plain(path: FilePath, buffering: int = 0) -> BinaryIO:
    """Open a plain file for reading, without a buffer by default. Raises ClipError for a device or pipe, which may have
    no end or no beginning, and OSError if it cannot be opened."""
    file = open(path, "rb", buffering, opener=lambda name, flags: os.open(name, flags | _WITHOUT_WAITING))
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise ClipError(f"{fspath(path)}: got a device, pipe or socket, expected a plain file")
    return file
