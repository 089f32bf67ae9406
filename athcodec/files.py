"""Files that take their name only when they are whole."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO


class Part:
    """A file on its way to `path`: it is written as `name`, beside it, until it is complete.

    Raises FileNotFoundError where the directory is missing, IsADirectoryError where `path` is one.
    """

    def __init__(self, path: str | os.PathLike[str]):
        self.path = os.path.realpath(path)
        directory, name = os.path.split(self.path)
        if not os.path.isdir(directory):
            raise FileNotFoundError(f"{self.path}: the directory {directory} does not exist")
        if os.path.isdir(self.path):
            raise IsADirectoryError(f"{self.path}: is a directory, expected a file name")
        self.name = os.path.join(directory, f".{name}.{secrets.token_hex(4)}.part")

    def complete(self) -> None:
        """Gives the file its name, in place of an older one."""
        os.replace(self.name, self.path)

    def discard(self) -> None:
        """Removes what has been written."""
        with suppress(FileNotFoundError):
            os.unlink(self.name)


@contextmanager
def new_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A file that replaces `path` when the block ends, and leaves nothing behind when it raises. Raises OSError."""
    part = Part(path)
    try:
        with open(part.name, "x+b") as out:
            yield out
            out.flush()
            os.fsync(out.fileno())
        part.complete()
    except BaseException:
        part.discard()
        raise
