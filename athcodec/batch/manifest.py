"""The manifest of a batch: one JSON line per clip that was finished or failed, appended when its file is in place.

A line is on the disk before the next is written. The last line for an output counts. A line that is incomplete, after
a kill or on a full disk, is removed when the manifest is opened again, and its clip is encoded again. One process at a
time has a manifest open; the system drops its lock when the process dies.
"""

from __future__ import annotations

import json
import os

from athcodec.errors import AthError
from athcodec.files.atomic import PLAIN_OPEN
from athcodec.files.plain import FilePath
from athcodec.untyped import JsonObject

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]
    import msvcrt

LINE_START = b'{"output": '
FAR = 1 << 40  # where Windows locks a byte: beyond what anybody reads

Record = JsonObject


class ManifestError(AthError):
    """A manifest is in use by another run, or is no manifest."""


class Manifest:
    """An open manifest, locked: `records` are the last ones, by output. Raises ManifestError, OSError."""

    def __init__(self, path: FilePath):
        """Open and lock the manifest `path`, or begin a new one. Raises ManifestError, OSError."""
        self.path = os.fspath(path)
        is_new = not os.path.exists(self.path)
        self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | PLAIN_OPEN, 0o666)
        try:
            self._lock()
            self.records, self._length = _parse(self.path, self._content())
            os.ftruncate(self._file, self._length)
            if is_new:
                _sync_folder(self.path)
        except BaseException:
            self.close()
            raise

    def add(self, record: Record) -> None:
        """Append a record as a line, and return when it is on the disk. If this raises OSError, the manifest stays as
        before."""
        line = json.dumps({"output": record["output"]} | record).encode() + b"\n"
        try:
            os.lseek(self._file, self._length, os.SEEK_SET)
            written = 0
            while written < len(line):
                written += os.write(self._file, line[written:])
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, self._length)
            raise OSError(error.errno, error.strerror, self.path) from None
        self._length += len(line)
        self.records[record["output"]] = record

    def close(self) -> None:
        descriptor, self._file = self._file, -1
        if descriptor >= 0:
            os.close(descriptor)

    def __enter__(self) -> Manifest:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _content(self) -> bytes:
        parts = []
        while part := os.read(self._file, 1 << 20):
            parts.append(part)
        return b"".join(parts)

    def _lock(self) -> None:
        """Lock the manifest for this process. Raises ManifestError if another run has it open, or if it cannot be
        locked."""
        try:
            if fcntl is None:
                os.lseek(self._file, FAR, os.SEEK_SET)
                msvcrt.locking(self._file, msvcrt.LK_NBLCK, 1)
                os.lseek(self._file, 0, os.SEEK_SET)
            else:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            raise ManifestError(f"{self.path}: another run has this manifest open, expected one at a time") from None
        except OSError as error:
            raise ManifestError(
                f"{self.path}: cannot be locked here ({error.strerror}), expected a file system with "
                "locks; --manifest may name a file elsewhere"
            ) from None


def read_records(path: FilePath) -> dict[str, Record]:
    """Return the last records by output, without a lock and without repair; none where there is no manifest."""
    try:
        with open(path, "rb") as file:
            return _parse(os.fspath(path), file.read())[0]
    except FileNotFoundError:
        return {}


def _parse(path: str, content: bytes) -> tuple[dict[str, Record], int]:
    """Return (records, length): the last record of each output, and the length in bytes of all complete lines. Raises
    ManifestError if the content is no manifest; a last line that was cut off is allowed."""
    *lines, rest = content.split(b"\n")
    records, length = {}, 0
    for number, line in enumerate([*lines, rest] if rest else lines, 1):
        record = _record(line) if number <= len(lines) else None
        if record is not None:
            records[record["output"]] = record
            length += len(line) + 1
        elif number < len(lines) or not _may_be_torn(line):
            raise ManifestError(f"{path}: line {number} is no line of a manifest, expected a manifest or a new file")
    return records, length


def _record(line: bytes) -> Record | None:
    try:
        record = json.loads(line)
        return record if isinstance(record["output"], str) else None
    except (ValueError, KeyError, TypeError):
        return None


def _may_be_torn(line: bytes) -> bool:
    """Return whether it is the beginning of a line of `add`, or the zeros that some file systems leave in its place."""
    return line.startswith(LINE_START) or LINE_START.startswith(line) or not line.strip(b"\0")


def _sync_folder(path: str) -> None:
    if fcntl is not None:
        folder = os.open(os.path.dirname(os.path.abspath(path)), os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
