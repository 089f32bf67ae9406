"""The bytes of an .ath file: where they come from, which are there, and how the C core gets them."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, BinaryIO, TypeAlias

from athcodec._native import as_bytes
from athcodec.decoding import core_file
from athcodec.decoding.container import Limits
from athcodec.errors import (
    BadChecksum,
    ClipError,
    FormatError,
    LevelUnavailable,
    NeedsHostMesh,
    NotAnAthFile,
    TrailingBytes,
    Truncated,
    error_class,
)
from athcodec.files.atomic import file_ids, is_url
from athcodec.files.kinds import HEAD_BYTES, SOURCES, UNKNOWN, kind_of_bytes
from athcodec.files.plain import open_plain
from athcodec.files.shown import redacted

Openable: TypeAlias = str | os.PathLike[str] | bytes | bytearray | memoryview | BinaryIO
"""A path, a URL, the bytes of a file, or a file object."""


class FileBytes:
    """An opened source of bytes, and the core's file that it feeds. AthFile documents the attributes.

    Whoever reads or feeds holds `lock`.
    """

    is_closed = False  # Whether `close` has closed the file; a file object of a caller stays open.

    def __init__(self, path: Any, strict: bool, limits: Limits | None, gltf_motion: str | None) -> None:
        """Open `path`, a path, URL, bytes or file object, and read the front of the file. With `strict`, its length has
        to be the stated one. `gltf_motion` names the motion of a GLB."""
        self.limits = limits or Limits()
        self.bytes_read = 0
        self.lock = threading.Lock()
        self.closes_source = not hasattr(path, "read")
        self.source = _opened(path, gltf_motion)
        self._name = redacted(os.fspath(path)) if isinstance(path, (str, os.PathLike)) else ""
        self.inputs = file_ids(path if isinstance(path, (str, os.PathLike)) else getattr(path, "name", None))
        try:
            self.available_length: int = self.source.seek(0, os.SEEK_END)
            self.core = self._open_core()
            self.file_length: int = self.core.info.file_length
            self.complete: bool = self.available_length >= self.file_length
            if strict and self.available_length != self.file_length:
                refused = TrailingBytes if self.complete else Truncated
                raise refused(f"file: got {self.available_length} bytes; expected {self.file_length}")
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file, if it was opened here, as soon as no thread reads from it."""
        if self.closes_source:
            with self.lock:
                self.source.close()
                self.is_closed = True

    def __del__(self) -> None:
        """Close a file that nobody can read from any more, as h5py does."""
        if getattr(self, "closes_source", False) and hasattr(self, "source"):
            self.source.close()

    @property
    def name(self) -> str:
        """The path or URL of the file, or the name of a file object; "file" if it has none."""
        stated = self._name or getattr(self.source, "name", None)
        return stated if isinstance(stated, str) and stated else "file"

    # ---- bytes ----

    def whole(self) -> bytes:
        """Return all bytes of the file that are there."""
        with self.lock:
            return self._read_some(0, self.available_length)

    def _read_some(self, offset: int, length: int) -> bytes:
        """Return up to `length` bytes from `offset` on, fewer only at the end of the file."""
        self.source.seek(offset)
        parts, size = [], 0
        while size < length and (part := self.source.read(length - size)):
            parts.append(part)
            size += len(part)
        self.bytes_read += size
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def read(self, offset: int, length: int, subject: str) -> bytes:
        """Return `length` bytes from an offset on. Raises Truncated, which names `what` is read, if fewer are there."""
        data = self._read_some(offset, length)
        if len(data) < length:
            raise Truncated(f"{subject}: got {len(data)} bytes; expected {length}")
        return data

    def announce(self, ranges: list[tuple[int, int]]) -> None:
        """Tell a remote source which (offset, size) are read next, so that it fetches them together."""
        if hasattr(self.source, "prefetch"):
            self.source.prefetch(ranges)

    def _open_core(self) -> core_file.File:
        """Read as much of the front as the C core needs, and return the file as the core has opened it. Raises
        FormatError."""
        limits, data = core_file.Limits.of(self.limits), b""
        try:
            needed, memory, lacking = core_file.front(data, limits)
            while len(data) < needed:
                more = self._read_some(len(data), needed - len(data))
                if not more:
                    raise Truncated(str(lacking)) if data else self._no_ath_file()
                data += more
                if len(data) < needed or not memory:
                    needed, memory, lacking = core_file.front(data, limits)
            return core_file.File(data, memory, limits)
        except core_file.CoreError as error:
            raise self.refusal(error) from None

    def _no_ath_file(self) -> NotAnAthFile:
        """Return the exception for a file that is not .ath, which says what it looks like and how to encode it."""
        head, name = self._read_some(0, HEAD_BYTES), self._name
        kind = kind_of_bytes(head, self.available_length)
        looks = f"it looks like {kind}" if kind != UNKNOWN else "got first bytes of no format that athcodec knows"
        message = f"is not an .ath file ({looks if head else 'got no bytes'})"
        message = f"{name}: {message}" if name else f"this {message}"
        if kind not in SOURCES:
            return NotAnAthFile(message)
        names = f"{name!r}, {os.path.splitext(name)[0] + '.ath'!r}" if name else "PATH, 'a.ath'"
        return NotAnAthFile(message, python=f"athcodec.encode({names}) makes one", shell="use `athcodec encode` first")

    def refusal(self, error: core_file.CoreError) -> FormatError:
        """Return the exception for an error of the core. It says so if a checksum is bad because a remote file was
        changed since it was opened."""
        refused = Truncated if error.code == core_file.MISSING else error_class(error.code)
        if refused is NotAnAthFile:
            return self._no_ath_file()
        if refused is NeedsHostMesh:
            return refused(error, python="athcodec.open takes it as host_mesh", shell="--host-mesh names it")
        return refused(f"{error}{getattr(self.source, 'change_hint', '') if refused is BadChecksum else ''}")

    @contextmanager
    def fed(self, ranges: list[tuple[int, int]], subject: str) -> Iterator[None]:
        """Give the C core the bytes of these ranges (offset, size) of the file until the block ends. `subject` begins
        messages. Raises LevelUnavailable if the file is cut off before, FormatError if the core finds a fault."""
        if any(offset + size > self.available_length for offset, size in ranges):
            raise LevelUnavailable(
                f"{subject}: not in the file; it is cut off at {self.available_length} of {self.file_length} bytes"
            )
        self.announce(ranges)
        pieces = [as_bytes(self.read(offset, size, f"bytes from {offset} on")) for offset, size in ranges]
        try:
            for (offset, _), data in zip(ranges, pieces):
                self.core.feed(data, offset)
            yield
        except core_file.CoreError as error:
            raise self.refusal(error) from None
        finally:
            for offset, size in ranges:
                self.core.drop(offset, size)


def _opened(path: Any, gltf_motion: str | None) -> Any:
    """Return a seekable binary file for a path, a URL, bytes, a file object, or the motion called `gltf_motion` inside
    a GLB."""
    if hasattr(path, "read"):
        if isinstance(path, io.TextIOBase):
            raise TypeError("path: got a file opened as text; expected one opened with mode 'rb'")
        return path if getattr(path, "seekable", lambda: True)() else io.BytesIO(path.read())
    if not isinstance(path, (str, os.PathLike)):
        try:
            return io.BytesIO(path if isinstance(path, bytes) else memoryview(path).tobytes())
        except TypeError:
            raise TypeError(f"path: got {path!r:.80}; expected a path, a URL, bytes or a binary file object") from None
    if isinstance(path, str) and is_url(path):
        from athcodec.files.remote import Remote  # The packages behind it take long to import.

        return Remote(path)
    file: BinaryIO = open_plain(os.fspath(path), -1)
    with ExitStack() as unread:
        unread.callback(file.close)
        if file.read(4) != b"glTF":
            if gltf_motion is not None:
                raise ClipError(f"gltf_motion: got {gltf_motion!r} of a file that is no GLB, expected a GLB")
            unread.pop_all()
            return file
    from athcodec.files.gltf.motion import GltfMotion  # The module takes long to import.

    return GltfMotion(path, gltf_motion)
