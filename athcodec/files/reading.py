"""Habits of readers: take plain files alone, watch them for changes, close them if reading fails, name them in
errors, and count the memory that reading takes. It knows no file format."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from os import fspath
from pathlib import Path
from typing import Protocol

from athcodec.errors import ClipError, one_line
from athcodec.files.atomic import FileId
from athcodec.files.plain import FilePath, open_plain
from athcodec.options import MAX_MEMORY

File = FilePath | int
Stamp = tuple[int, int, int, int]  # Size, time of change, device and inode.


class Closable(Protocol):
    def close(self) -> None: ...


def read_plain(path: FilePath, budget: Budget) -> bytes:
    """Return all bytes of a plain file. Raises ClipError, OSError."""
    with open_plain(path) as file:
        budget.need(os.fstat(file.fileno()).st_size, fspath(path))
        return file.read()


class Budget:
    """The memory that reading a source may take, in bytes; arrays that stay are subtracted.

    What is counted are the arrays and texts of the file, as they are unpacked, not what libraries need besides.
    """

    def __init__(self, limit: int = MAX_MEMORY):
        self.limit, self.left = limit, limit

    def need(self, size: int, subject: str) -> None:
        """Raise ClipError if there is no room for so many bytes, which do not stay."""
        if size > self.left:
            raise ClipError(f"{subject}: got {size:,} bytes to read, but {no_room(self.limit)}")

    def need_for(self, text: bytes, marks: bytes, each: int, subject: str) -> None:
        """Check that there is room for the objects made of a text, each of so many bytes: one before each of these
        marks."""
        self.need(len(text) + each * (1 + len(text) - len(text.translate(None, marks))), subject)

    def take(self, size: int, subject: str) -> None:
        """Check that there is room for bytes that stay, and subtract them."""
        self.need(size, subject)
        self.left -= size


def no_room(limit: int) -> str:
    """Return the message for memory that a source may not take."""
    return f"expected at most {limit:,} bytes of memory for the whole source; --max-memory (max_memory=) allows more"


class FileWatch:
    """Files, by path or by open descriptor, whose size and time of change are remembered.

    Called, it says whether all of them are as they were when they were added; one that is gone is not.
    """

    def __init__(self, *files: File):
        self.stamps: dict[File, Stamp] = {}
        for file in files:
            self.add(file)

    @classmethod
    def of(cls, stamps: dict[File, Stamp]) -> FileWatch:
        """Return an instance that goes on from the `stamps` of another."""
        watch = cls()
        watch.stamps = stamps
        return watch

    def add(self, file: File) -> None:
        """Remember the state of a file. Raises OSError if there is none."""
        self.stamps.setdefault(file, _stamp(file))

    def __call__(self) -> bool:
        try:
            return all(_stamp(file)[:2] == stamp[:2] for file, stamp in self.stamps.items())
        except OSError:
            return False

    @property
    def files(self) -> frozenset[FileId]:
        """Device and inode of the files."""
        return frozenset(stamp[2:] for stamp in self.stamps.values())


def file_beside(folder: FilePath, name: str, allow_outside: bool = False) -> Path:
    """Return the path of the file that a source refers to as `name`, relative to its folder.

    Raises ClipError if `name` is no plain file or, unless `allow_outside`, lies outside of the folder: a source that is
    not trusted must not reach other files on the disk.
    """
    if not name or "\0" in name:
        raise ClipError(f"got the file name {name[:80]!r}, expected a path")
    path = Path(folder, name)
    check_inside(folder, path, allow_outside)
    if path.exists() and not path.is_file():
        raise ClipError(f"{name[:80]}: got a folder, device or pipe, expected a plain file")
    return path


def check_inside(folder: FilePath, path: FilePath, allow_outside: bool) -> None:
    """Raise ClipError for a path outside of a folder. Links inside the folder may lead outside."""
    if not allow_outside and not Path(os.path.abspath(path)).is_relative_to(os.path.abspath(folder)):
        raise ClipError(
            f"got the file {fspath(path)[-80:]!r}, expected one in the folder of the source or below it; "
            "--allow-outside (allow_outside=True) reads others"
        )


def _stamp(file: File) -> Stamp:
    now = os.stat(file)
    return now.st_size, now.st_mtime_ns, now.st_dev, now.st_ino


@contextmanager
def naming(path: FilePath, *errors: type[Exception]) -> Iterator[None]:
    """Turn ClipErrors of the block, and exceptions of the types `errors`, into ClipErrors whose messages begin with
    `path`."""
    try:
        yield
    except ClipError as error:
        if str(error).startswith(one_line(f"{fspath(path)}: ")):
            raise
        raise error.about(fspath(path)) from error
    except errors as error:
        text = " ".join(str(error).split())[:200] or type(error).__name__
        raise ClipError(f"{fspath(path)}: cannot be read: {text}") from error


@contextmanager
def naming_file(path: FilePath) -> Iterator[None]:
    """Let errors of the system that name no file, such as those of reading, name this one."""
    try:
        yield
    except OSError as error:
        if error.filename is not None or error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, fspath(path)) from error


@contextmanager
def closing_on_failure(resource: Closable) -> Iterator[None]:
    """Close the resource if the block raises; otherwise leave it open."""
    try:
        yield
    except BaseException:
        resource.close()
        raise
