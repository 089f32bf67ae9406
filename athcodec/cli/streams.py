"""Standard input and output as files of the command line: what is called "-" there.

Most formats are read from many places and written back and forth, so the bytes go through a temporary file.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cached_property
from typing import cast

from athcodec.errors import ClipError
from athcodec.exporters import formats as written_formats
from athcodec.files.kinds import HEAD_BYTES
from athcodec.sources import format_named, formats

STREAM = "-"
ATH = ".ath"


class Streams:
    """Files in place of "-", in a folder of their own, which is made for the first of them and removed with `opened`.
    `writes`: whether one of them goes to standard output."""

    def __init__(self, opened: ExitStack):
        self._opened, self._input, self._output = opened, "", ""

    @cached_property
    def _folder(self) -> str:
        return self._opened.enter_context(tempfile.TemporaryDirectory(prefix="athcodec-"))

    @property
    def writes(self) -> bool:
        return bool(self._output)

    def ath(self, path: str) -> str:
        """Return the .ath file, or GLB, to read in place of `path`. Raises ClipError, OSError."""
        return self._read(ATH) if path == STREAM else path

    def source(self, path: str, format: str | None) -> str:
        """Return the file to read for `path`. If it is "-", standard input is copied to a file first, whose format is
        `format` or is told by its first bytes. Raises ClipError if the format remains unknown, OSError."""
        if path != STREAM:
            return path
        if format is not None or self._input:
            return self._read(format_named(format, formats()).suffixes[0] if format else "")
        head = cast(io.BufferedReader, sys.stdin.buffer).peek(HEAD_BYTES)
        kind = next((kind for kind in formats() if kind.begins(head)), None)
        if kind is None:
            raise ClipError(f"{STREAM}: got a format that its first bytes do not tell, expected --source-format")
        return self._read(kind.suffixes[0])

    def target(self, path: str, format: str | None) -> str:
        """Return the file to write in place of `path`: format is None for .ath. Raises ClipError."""
        if path != STREAM:
            return path
        suffix = ATH if format is None else format_named(format, written_formats()).suffixes[0]
        os.mkdir(os.path.join(self._folder, "out"))
        self._output = os.path.join(self._folder, "out", f"standard_output{suffix}")
        return self._output

    def send(self) -> None:
        """Copy the written file to standard output if the output is "-". Raises ClipError if the format made several
        files, OSError."""
        if not self.writes:
            return
        made = os.listdir(os.path.dirname(self._output))
        if made != [os.path.basename(self._output)]:
            raise ClipError(f"{STREAM}: got a format of several files, expected one that is a single file")
        with open(self._output, "rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)
        sys.stdout.buffer.flush()

    def _read(self, suffix: str) -> str:
        """Write standard input to a temporary file and return its path. Raises ClipError the second time."""
        if self._input:
            raise ClipError(f"{STREAM}: got standard input twice, expected it once")
        self._input = os.path.join(self._folder, f"standard_input{suffix}")
        with open(self._input, "wb") as file:
            shutil.copyfileobj(sys.stdin.buffer, file)
        return self._input


@contextmanager
def standard_streams() -> Iterator[Streams]:
    """Yield streams whose output is sent when the block ends without an error."""
    with ExitStack() as opened:
        streams = Streams(opened)
        yield streams
        streams.send()
