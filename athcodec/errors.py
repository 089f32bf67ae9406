"""Every error that athcodec raises on purpose, one class per cause.

The codes are those of FORMAT.md, "Errors", and of core/include/ath.h; they never change once released. A message is
one short line: what is wrong, where, what was found and what was expected. Messages quote text of files, so every error
and warning makes its message with `one_line`.

Examples
--------
>>> try:
...     athcodec.open(b"no plant")
... except athcodec.errors.FormatError as error:
...     error.name
'NOT_AN_ATH_FILE'
"""

from __future__ import annotations

import re
from typing import Self

LONGEST_MESSAGE = 2000  # Characters of a message, some 20 lines of a terminal; the middle of a longer one is left out.
MESSAGE_HEAD = 1500  # Characters that stay at its beginning: the subject, and what is wrong.
MESSAGE_TAIL = 450  # Characters that stay at its end: what was expected, and what to do.
LONGEST_WORD = 400  # Characters of what has no space in it, such as a number or a path; longer ones are cut alike.
WORD_HEAD = 250  # Characters that stay at its beginning, enough for most paths.
WORD_TAIL = 120  # Characters that stay at its end, enough for the name of a file.
_LONG_WORD = re.compile(rf"[^ ]{{{LONGEST_WORD + 1},}}")


def one_line(text: object) -> str:
    """Return text of a message as one short line of printable characters.

    Parameters
    ----------
    text : object
        What the message says; `str` of it may hold names, numbers and other text of a file.

    Returns
    -------
    str
        The text with unprintable characters, line breaks among them, as Python's escapes. The middle is left out of
        words of more than `LONGEST_WORD` characters, and of the line where it has more than `LONGEST_MESSAGE`.
    """
    line = str(text)
    if not line.isprintable():
        line = "".join(character if character.isprintable() else ascii(character)[1:-1] for character in line)
    line = _LONG_WORD.sub(_shortened, line)
    if len(line) > LONGEST_MESSAGE:  # It has spaces enough, because its words are short.
        line = f"{line[:MESSAGE_HEAD].rpartition(' ')[0]} ... {line[-MESSAGE_TAIL:].partition(' ')[2]}"
    return line


def _shortened(match: re.Match[str]) -> str:
    """Return the head and the tail of a word. A URL loses its tail, which may be a key that only the part before it
    marks as one."""
    word = match[0]
    return f"{word[:WORD_HEAD]}...{'' if '://' in word else word[-WORD_TAIL:]}"


class AthError(Exception):
    """Base of all errors raised by athcodec on purpose.

    Parameters
    ----------
    message : str
        What is wrong, where, what was found and what was expected.
    python, shell : str, optional
        What to do next in the words of the Python API, which end the message, and in those of the command line, which
        end `for_shell`.

    Attributes
    ----------
    for_shell : str
        The message as the command line shows it.
    """

    def __init__(self, message: object = "", *, python: str = "", shell: str = ""):
        super().__init__(one_line(f"{message}; {python}" if python else message))
        self.for_shell = one_line(f"{message}; {shell}") if shell else str(self)

    def about(self, subject: str) -> Self:
        """Return the same error with a name before its messages."""
        error = type(self)(f"{subject}: {self}")
        error.for_shell = one_line(f"{subject}: {self.for_shell}")
        return error


class ClipError(AthError, ValueError):
    """A motion clip, or the source file it comes from, is not usable."""


class AthWarning(UserWarning):
    """Base of all warnings of athcodec.

    Parameters
    ----------
    message : str
        What is not as the user may expect, and where.
    """

    def __init__(self, message: object = ""):
        super().__init__(one_line(message))


class SourceWarning(AthWarning):
    """A source holds something that is part of its picture and is not read, or that is hidden and costs precision."""


class GuessWarning(SourceWarning):
    """What a source means was guessed; the message says what was taken for what, and how to say otherwise."""


class CoarseWarning(AthWarning):
    """An error is so large a part of the plant that little of its motion may be left: that of a bound which was asked
    for, or that of a skeleton; or a rest pose is less exact than the motion, and a mesh is to lie on it."""


class BoundError(AthError, ValueError):
    """An error bound or target size cannot be kept."""


class MissingExtra(AthError, ImportError):
    """A file format needs a package that is not installed; the message names the command that installs it."""


class FormatError(AthError):
    """An .ath file cannot be decoded.

    Attributes
    ----------
    code : int
        Number of the cause in FORMAT.md, "Errors"; it never changes.
    name : str
        Its name there.
    """

    code = 1
    name = "INVALID"


class NotAnAthFile(FormatError):
    """The first bytes are not those of an .ath file."""

    code, name = 2, "NOT_AN_ATH_FILE"


class UnsupportedVersion(FormatError):
    """The file is of another version of the format."""

    code, name = 3, "UNSUPPORTED_VERSION"


class Truncated(FormatError):
    """The file ends before the bytes that were needed."""

    code, name = 4, "TRUNCATED"


class BadChecksum(FormatError):
    """Bytes are not those that were written."""

    code, name = 5, "BAD_CHECKSUM"


class BadHeader(FormatError):
    """A field of the header is out of range, or contradicts the hierarchy."""

    code, name = 6, "BAD_HEADER"


class BadChunkTable(FormatError):
    """The chunk table or the error table contradicts the header or the hierarchy."""

    code, name = 7, "BAD_CHUNK_TABLE"


class UnknownChunk(FormatError):
    """The file needs a kind of chunk that this version does not know."""

    code, name = 8, "UNKNOWN_CHUNK"


class BadChunk(FormatError):
    """The content of a chunk does not decode."""

    code, name = 9, "BAD_CHUNK"


class LimitExceeded(FormatError):
    """The file asks for more than `Limits` allow."""

    code, name = 10, "LIMIT_EXCEEDED"


class TrailingBytes(FormatError):
    """The file is longer than its header says."""

    code, name = 11, "TRAILING_BYTES"


class NeedsHostMesh(FormatError):
    """The rest pose is a mesh of the host's, which was not passed."""

    code, name = 12, "NEEDS_HOST_MESH"


class WrongHostMesh(FormatError):
    """The mesh that was passed is not the one that the file was made for."""

    code, name = 13, "WRONG_HOST_MESH"


class UnsupportedFeature(FormatError):
    """The file needs something of a later version of the format that this one does not have."""

    code, name = 14, "UNSUPPORTED_FEATURE"


class LevelUnavailable(AthError, IndexError):
    """The file, or the part of it that is there, has no such level or frame."""


class ClipUnavailable(AthError, LookupError):
    """The file has no clip of this name."""


class RemoteError(AthError, OSError):
    """Bytes behind a URL cannot be fetched, or are no longer those of the file that was opened."""


def error_class(code: int) -> type[FormatError]:
    """Return the class of a code of FORMAT.md's table. Raises KeyError for other codes."""
    classes: list[type[FormatError]] = [FormatError, *FormatError.__subclasses__()]
    return {error.code: error for error in classes}[code]
