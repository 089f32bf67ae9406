"""Files that take their name only when they are complete, and removal of what dead writers have left.

An older file is replaced only where it holds what the new one holds, or nothing, and is no input.

A file is written beside its target as `.NAME.XXXXXXXX.part`, under a lock that the system drops when the
writer dies, and then renamed. Whoever next writes to the same target removes the pending files that nobody holds any
more. Where a file system has no locks, those of dead writers stay: one of a living writer is never removed.
"""

from __future__ import annotations

import errno
import io
import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import TYPE_CHECKING, BinaryIO, TypeGuard

from athcodec.files.kinds import UNKNOWN, kind_by_suffix, kind_of
from athcodec.files.plain import FilePath

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

try:
    import fcntl
except ImportError:  # Windows lets nobody remove a file that another program has open.
    fcntl = None  # type: ignore[assignment]

FileId = tuple[int, int]
# Characters of the target's name in that of the pending file; even the longest name leaves room for the rest.
NAME_CHARACTERS = 50
PLAIN_OPEN = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)

_PENDING_NAME = re.compile(r"(\..*\.)[0-9a-f]{8}\.part", re.DOTALL)
_URL = re.compile(r"[a-z][a-z0-9+.-]+(://|::)", re.IGNORECASE)
_inputs: ContextVar[frozenset[FileId]] = ContextVar("_inputs", default=frozenset())


def file_id(file: FilePath | int) -> FileId:
    """Return device and inode, which a file has in common under all its names. Raises OSError."""
    status = os.stat(file)
    return status.st_dev, status.st_ino


def file_ids(*paths: FilePath | None) -> frozenset[FileId]:
    """Return the device and inode of those of the paths that are files; URLs and others are left out."""
    return frozenset(file_id(path) for path in paths if path is not None and os.path.isfile(path))


@contextmanager
def keeping(inputs: Iterable[FileId]) -> Iterator[None]:
    """Refuse to replace these files in the block, under whatever name."""
    token = _inputs.set(_inputs.get().union(inputs))
    try:
        yield
    finally:
        _inputs.reset(token)


def check_target(path: FilePath, suffix: str = "") -> str:
    """Return the path of the file to write for `path`, with links resolved. Raises OSError if nothing can be written
    there: the folder is missing or read-only, or `path` is a folder, a device, read-only, an input of this call, or a
    file of another kind than `suffix` stands for."""
    path = os.fspath(path)
    target = os.path.realpath(path)
    directory = os.path.dirname(target if os.path.islink(path) else path) or "."
    if not os.path.isdir(directory):
        raise FileNotFoundError(f"{path}: the directory {directory} does not exist")
    if not os.access(directory, os.W_OK | os.X_OK):
        raise PermissionError(f"{path}: the directory {directory} is read-only")
    try:
        mode = os.stat(target).st_mode
    except FileNotFoundError:
        return target
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(f"{path}: got a directory, expected a file name")
    if not stat.S_ISREG(mode):
        raise FileExistsError(f"{path}: got a device, pipe or socket, expected a plain file")
    if not os.access(target, os.W_OK):
        raise PermissionError(f"{path}: is read-only")
    _check_replaceable(path, kind_by_suffix(suffix))
    return target


def _check_replaceable(path: str, kind: str | None) -> None:
    """Raise FileExistsError if the file `path` is an input, or holds something else than `kind`; with None, any content
    may be replaced."""
    if not os.path.exists(path):
        return
    if file_id(path) in _inputs.get():
        raise FileExistsError(f"{path}: is the input, or a file that belongs to it; choose another output name")
    content = kind_of(path) if kind is not None and os.path.getsize(path) else kind
    if content != kind or content == UNKNOWN:
        raise FileExistsError(
            f"{path}: is there already and holds {content}, expected {kind}; choose another output name, or remove it "
            "first"
        )


def is_url(path: object) -> TypeGuard[str]:
    """Return whether a path is a URL for remote.py."""
    return isinstance(path, str) and _URL.match(path) is not None


class PendingFile:
    """A file on its way to `path`. It is written as `name`, beside `path`, until it is complete; `descriptor` is open.

    It has the permissions of the file that it replaces, or those of any new file. Raises OSError.
    """

    def __init__(self, path: FilePath):
        """Create a temporary file beside `path`, with the permissions of the file that it will replace. Raises
        OSError."""
        self.path = check_target(path)
        remove_leftovers(self.path)
        self.name, self.descriptor = _locked_new_file(self.path)
        try:
            _take_permissions(self.path, self.descriptor)
        except BaseException:
            self.discard()
            raise

    def complete(self) -> None:
        """Write the bytes to the disk and rename the temporary file to its final name, replacing an older file. Raises
        OSError."""
        _check_replaceable(self.path, kind_of(self.name))
        try:
            os.fsync(self.descriptor)
            if fcntl is None:
                self._close()  # Windows renames no open files.
            os.replace(self.name, self.path)
        except OSError as error:
            raise OSError(error.errno, error.strerror, self.path) from None
        with suppress(OSError):  # The bytes are on the disk, under the final name.
            self._close()
        _sync_folder(os.path.dirname(self.path))

    def discard(self) -> None:
        """Remove what has been written."""
        if fcntl is None:
            self._close()
        with suppress(OSError):  # The file is gone already, or the next writer removes it.
            os.unlink(self.name)
        with suppress(OSError):
            self._close()

    def _close(self) -> None:
        descriptor, self.descriptor = self.descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)


class _Naming(io.FileIO):
    """The bytes of a pending file, whose errors name the file that it becomes."""

    def __init__(self, pending: PendingFile):
        super().__init__(pending.descriptor, "w+", closefd=False)
        self._path = pending.path

    def write(self, data: ReadableBuffer) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise OSError(error.errno, error.strerror, self._path) from None

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            raise OSError(error.errno, error.strerror, self._path) from None


@contextmanager
def new_file(path: FilePath) -> Iterator[BinaryIO]:
    """Yield an open file that replaces `path` when the block ends. If the block raises, `path` stays as it was and
    nothing else is left behind. Raises OSError."""
    pending = PendingFile(path)
    try:
        with io.BufferedRandom(_Naming(pending)) as out:
            yield out
        pending.complete()
    except BaseException:
        pending.discard()
        raise


@contextmanager
def new_files(path: FilePath, named: bool = True) -> Iterator[str]:
    """Yield a temporary folder for files that belong together. When the block ends, its files move beside `path` and
    replace older ones, the file called like `path` last; there has to be one unless `named` is False. If the block
    raises, nothing is left behind. Raises OSError."""
    path = check_target(path)
    directory, name = os.path.split(path)
    with scratch_folder(path) as folder:
        yield folder
        made = sorted(os.listdir(folder), key=lambda file: (file == name, file))
        if named and name not in made:
            raise FileNotFoundError(f"{path}: the writer has made no such file")
        for file in made:
            _check_replaceable(os.path.join(directory, file), kind_of(os.path.join(folder, file)))
        for file in made:
            os.replace(os.path.join(folder, file), os.path.join(directory, file))
        _sync_folder(directory)


@contextmanager
def new_folder(path: FilePath) -> Iterator[str]:
    """Yield a temporary folder that is renamed to `path` when the block ends. Nothing that exists is replaced; if the
    block raises, nothing is left behind. Raises OSError."""
    path = check_target(path)
    if os.path.lexists(path):
        raise FileExistsError(f"{path}: exists, expected the name of a new folder")
    with scratch_folder(path) as folder:
        yield folder
        os.rename(folder, path)
        _sync_folder(os.path.dirname(path))


@contextmanager
def scratch_folder(path: str) -> Iterator[str]:
    """Yield a temporary folder beside `path`, which is removed with its content when the block ends. An OSError of the
    block that names no file gets the name `path`."""
    remove_leftovers(path)
    directory, name = os.path.split(path)
    folder = os.path.join(directory, f"{_prefix(name)}{secrets.token_hex(4)}.part")
    os.mkdir(folder)
    lock = _locked_folder(folder)
    try:
        yield folder
    except OSError as error:
        if error.filename is not None or error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, path) from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if lock >= 0:
            os.close(lock)


def _sync_folder(folder: str) -> None:
    """Write the entries of a folder to the disk, so that a new file name in it survives a power failure."""
    if fcntl is None:
        return  # Windows opens no folders.
    with suppress(OSError):  # The folder cannot be read, or the file system syncs none; the file itself is complete.
        descriptor = os.open(folder or ".", os.O_RDONLY | PLAIN_OPEN)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _locked_folder(folder: str) -> int:
    """Lock a folder until the returned descriptor is closed; -1 where the system has no locks."""
    if fcntl is None:
        return -1
    descriptor = os.open(folder, os.O_RDONLY | PLAIN_OPEN)
    with suppress(OSError):  # The file system has no locks.
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    return descriptor


def remove_leftovers(path: str) -> None:
    """Remove what dead writers, and only those, have left of files on their way to `path`."""
    directory, name = os.path.split(path)
    remove_leftovers_of(directory, [name])


def remove_leftovers_of(directory: str, names: Iterable[str]) -> None:
    """Remove what dead writers have left of many files of a directory, which is listed once."""
    prefixes = {_prefix(name) for name in names}
    with suppress(OSError):  # The directory can be written to but not listed.
        for entry in os.listdir(directory):
            match = _PENDING_NAME.fullmatch(entry)
            if match and match[1] in prefixes:
                _remove_if_dead(os.path.join(directory, entry))


def _prefix(name: str) -> str:
    return f".{name[:NAME_CHARACTERS]}."


def _locked_new_file(path: str) -> tuple[str, int]:
    """Return (name, descriptor) of a new, open and locked temporary file beside `path`. The lock shows other writers
    that the file is in use."""
    directory, name = os.path.split(path)
    while True:
        pending = os.path.join(directory, f"{_prefix(name)}{secrets.token_hex(4)}.part")
        try:
            descriptor = os.open(pending, os.O_RDWR | os.O_CREAT | os.O_EXCL | PLAIN_OPEN, 0o666)
        except FileExistsError:
            continue
        if fcntl is None:
            return pending, descriptor
        with suppress(OSError):  # The file system has no locks.
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        if os.fstat(descriptor).st_nlink:
            return pending, descriptor
        os.close(descriptor)  # Another writer took the file for a leftover before it was locked.


def _remove_if_dead(name: str) -> None:
    """Remove the temporary file or folder `name` if the process that wrote it no longer runs, which its lock shows."""
    with suppress(OSError):  # The file is locked by its writer, gone by now, or not ours.
        if fcntl is None:
            shutil.rmtree(name) if os.path.isdir(name) else os.unlink(name)
            return
        is_folder = stat.S_ISDIR(os.lstat(name).st_mode)
        access = os.O_RDONLY if is_folder else os.O_RDWR
        descriptor = os.open(name, access | os.O_NOFOLLOW | os.O_NONBLOCK | PLAIN_OPEN)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if is_folder:
                shutil.rmtree(name)
            elif stat.S_ISREG(os.fstat(descriptor).st_mode):
                os.unlink(name)
        finally:
            os.close(descriptor)


def _take_permissions(path: str, descriptor: int) -> None:
    """Give the open file `descriptor` the mode, group and, if allowed, owner of the older file `path`, so that a
    private file stays private."""
    if fcntl is None:
        return
    try:
        older = os.stat(path)
    except FileNotFoundError:
        return
    mode = older.st_mode & 0o777
    for owner in (older.st_uid, -1):
        try:
            os.fchown(descriptor, owner, older.st_gid)
            break
        except OSError as error:
            if error.errno not in (errno.EPERM, errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):
                raise
    else:
        mode &= ~0o070  # The older file was meant for another group.
    os.fchmod(descriptor, mode)
