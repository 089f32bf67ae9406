"""What readers do with the files that they open: watch them for changes, close them where reading fails, and say in
errors which file it was. It knows no file format.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike, fspath
from pathlib import Path
from typing import Protocol

from athcodec.errors import ClipError

File = str | PathLike[str] | int


class Closable(Protocol):
    def close(self) -> None: ...


class FileWatch:
    """Files, by path or by open descriptor, whose size and time of change are remembered.

    Called, it says whether all of them are as they were when they were added; one that is gone is not.
    """

    def __init__(self, *files: File):
        self._stamps: dict[File, tuple[int, int]] = {}
        for file in files:
            self.add(file)

    def add(self, file: File) -> None:
        """Raises OSError where there is no such file."""
        self._stamps.setdefault(file, _stamp(file))

    def __call__(self) -> bool:
        try:
            return all(_stamp(file) == stamp for file, stamp in self._stamps.items())
        except OSError:
            return False


def file_beside(folder: str | PathLike[str], name: str, allow_outside: bool = False) -> Path:
    """A file that a source names, by a path from its own folder.

    Raises ClipError where it is no plain file and, unless `allow_outside`, where it lies outside of that folder: a
    source that is not trusted must not reach other files on the disk.
    """
    if not name or "\0" in name:
        raise ClipError(f"got the file name {name[:80]!r}, expected a path")
    path = Path(folder, name)
    check_inside(folder, path, allow_outside)
    if path.exists() and not path.is_file():
        raise ClipError(f"{name[:80]}: got a folder, device or pipe, expected a plain file")
    return path


def check_inside(folder: str | PathLike[str], path: str | PathLike[str], allow_outside: bool) -> None:
    """Raises ClipError for a path outside of a folder. Links inside the folder lead where they lead."""
    if not allow_outside and not Path(os.path.abspath(path)).is_relative_to(os.path.abspath(folder)):
        raise ClipError(
            f"got the file {fspath(path)[-80:]!r}, expected one in the folder of the source or below it; "
            "--allow-outside (allow_outside=True) reads others"
        )


def _stamp(file: File) -> tuple[int, int]:
    now = os.stat(file)
    return now.st_size, now.st_mtime_ns


@contextmanager
def naming(path: str | PathLike[str], *errors: type[Exception]) -> Iterator[None]:
    """Errors of the block that are ClipErrors, or of these further types, become ClipErrors that begin with `path`."""
    try:
        yield
    except ClipError as error:
        raise ClipError(f"{fspath(path)}: {error}") from error
    except errors as error:
        text = " ".join(str(error).split())[:200] or type(error).__name__
        raise ClipError(f"{fspath(path)}: cannot be read: {text}") from error


@contextmanager
def closing_on_failure(resource: Closable) -> Iterator[None]:
    """Closes the resource where the block raises; else it stays open."""
    try:
        yield
    except BaseException:
        resource.close()
        raise
