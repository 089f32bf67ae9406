"""Opening of files to read: plain ones alone."""

from __future__ import annotations

import os
import stat
from os import PathLike, fspath
from typing import BinaryIO, cast

from athcodec.errors import ClipError

_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0)  # for somebody who writes to a pipe; of plain files it changes nothing


def open_plain(path: str | PathLike[str], buffering: int = 0) -> BinaryIO:
    """A plain file, open to be read, without a buffer by default. Raises ClipError for a device or pipe, which may have
    no end or no beginning, OSError where it cannot be opened."""
    file = open(path, "rb", buffering, opener=lambda name, flags: os.open(name, flags | _WITHOUT_WAITING))
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise ClipError(f"{fspath(path)}: got a device, pipe or socket, expected a plain file")
    return cast(BinaryIO, file)
