"""A shorter .ath file from a longer one, without decoding: the deeper levels are left out, the header says so."""

from __future__ import annotations

import os

from athcodec import container as ct
from athcodec.atomic_files import new_file
from athcodec.errors import LevelUnavailable, Truncated


def truncate(source, target, level: int) -> int:
    """Writes the levels 0 to `level` of the .ath file `source` to `target`, a complete file of its own.

    Static data is kept; the new file promises the error of `level`. Returns its size in bytes. Raises
    LevelUnavailable, a FormatError, or OSError.
    """
    with open(os.fspath(source), "rb") as file:
        container = ct.Container(file)
        if not 0 <= level < container.header.level_count:
            raise LevelUnavailable(f"level: got {level}; expected 0 to {container.header.level_count - 1}")
        front, chunks = ct.truncated_front(container, level)
        absent = [chunk for chunk in chunks if not container.is_available(chunk)]
        if absent:
            raise Truncated(f"{absent[0]}: got a file of {container.available_length} bytes; expected at least "
                            f"{absent[0].offset + absent[0].length}")
        with new_file(target) as out:
            out.write(front)
            for chunk in chunks:
                out.write(container.payload(chunk))
            return out.tell()
