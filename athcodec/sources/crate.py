"""Checks the counts in binary USD files (crates) before USD reads them: USD allocates as much memory as they say, and
in a damaged file they can say anything. It reads no values and decides nothing else.
"""

from __future__ import annotations

import struct
import zipfile
from typing import BinaryIO

from athcodec.errors import ClipError
from athcodec.files.plain import open_plain

MAGIC = b"PXR-USDC"
LARGEST_EXPANSION = 1024  # integers per compressed byte: two bits each at least, and LZ4 makes at most 255 bytes of one
MAX_SECTIONS = 64
COMPRESSED = (0, 4, 0)  # the version since which the sections are compressed


def check_crates(path: str) -> None:
    """Raise ClipError if `path` is a USD crate, or a .usdz that holds crates, and a crate states more entries than its
    bytes can hold."""
    with open_plain(path) as file:
        head = file.read(8)
        if head == MAGIC:
            _check(file, 0, file.seek(0, 2))
        elif head.startswith(b"PK"):
            for start, size in _members(file):
                file.seek(start)
                if file.read(8) == MAGIC:
                    _check(file, start, size)


def _members(file: BinaryIO) -> list[tuple[int, int]]:
    """Return (start, size), in bytes, of each member of a .usdz, whose members are stored without compression. Raises
    ClipError if the file is no zip."""
    try:
        with zipfile.ZipFile(file) as archive:
            entries = [(member.header_offset, member.file_size) for member in archive.infolist()]
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OSError) as error:
        raise ClipError(f"stage: got no .usdz: {error}") from None
    end, members = file.seek(0, 2), []
    for header, size in entries:
        file.seek(header)
        local = file.read(30)
        if len(local) == 30:
            start = header + 30 + sum(struct.unpack_from("<HH", local, 26))
            members.append((start, max(0, min(size, end - start))))
    return members


def _check(file: BinaryIO, start: int, size: int) -> None:
    """Raise ClipError if a section of the crate at byte `start` of the file, `size` bytes long, states more entries
    than fit into its bytes."""
    version, contents = struct.unpack("<8x8sq", _read(file, start, size, 0, 24))
    for name, place, length in _sections(file, start, size, contents):
        numbers = _numbers(file, start, size, place, length)
        if tuple(version[:3]) < COMPRESSED:
            fits = numbers[0] <= length
        elif name == "TOKENS":
            fits = numbers[0] <= numbers[1] <= 256 * numbers[2] + 64 and numbers[2] <= length
        elif name == "STRINGS":
            fits = 4 * numbers[0] <= length
        else:
            # PATHS says its count twice
            packed = numbers[2] if name == "PATHS" else numbers[1]
            fits = (
                max(numbers[0], numbers[1] if name == "PATHS" else 0)
                <= LARGEST_EXPANSION * packed
                <= (LARGEST_EXPANSION * length)
            )
        if not fits:
            raise ClipError(
                f"stage: got {numbers[0]} entries in the {length} bytes of its section {name}, expected as "
                "many as it holds"
            )


def _numbers(file: BinaryIO, start: int, size: int, place: int, length: int) -> list[int]:
    count = min(3, length // 8)  # an empty section is its count alone
    numbers = struct.unpack(f"<{count}Q", _read(file, start, size, place, 8 * count))
    return [*numbers, 0, 0][:3]


def _sections(file: BinaryIO, start: int, size: int, contents: int) -> list[tuple[str, int, int]]:
    """Return (name, start, length) of each section of a crate that holds counts; start and length are in bytes,
    relative to the crate. The crate begins at byte `start` of the file, has `size` bytes, and its table of sections is
    at byte `contents` of it. Raises ClipError if a section lies outside of the crate."""
    (count,) = struct.unpack("<Q", _read(file, start, size, contents, 8))
    if count > MAX_SECTIONS:
        raise ClipError(f"stage: got {count} sections, expected at most {MAX_SECTIONS}")
    table = _read(file, start, size, contents + 8, 32 * count)
    known = ("TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS")
    sections = []
    for name, place, length in struct.iter_unpack("<16s2q", table):
        text = name.split(b"\0")[0].decode("ascii", "replace")
        if not (0 <= place <= size and 0 <= length <= size - place):
            raise ClipError(f"stage: got a section {text} behind the end, expected it within {size} bytes")
        if text in known:
            sections.append((text, place, length))
    return sections


def _read(file: BinaryIO, start: int, size: int, place: int, length: int) -> bytes:
    if not 0 <= place <= size - length:
        raise ClipError(f"stage: got {size} bytes, expected {length} more at {place}: it has been cut off")
    file.seek(start + place)
    return file.read(length).ljust(length, b"\0")
