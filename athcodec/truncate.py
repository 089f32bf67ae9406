"""A shorter .ath file from a longer one, without decoding: the deeper levels are left out, the header says so."""

from __future__ import annotations

import os
from dataclasses import replace

from athcodec import container as ct
from athcodec.ath_file import AthFile
from athcodec.atomic_files import new_file
from athcodec.errors import LevelUnavailable, Truncated


def truncate(source: str | os.PathLike[str], target: str | os.PathLike[str], level: int) -> int:
    """Write the levels 0 to `level` of an .ath file as a complete file, whose error bound is that of `level`.

    Static data is kept. Nothing is decoded.

    Parameters
    ----------
    source : str or path-like
        The file to shorten.
    target : str or path-like
        The file to write; it appears when it is complete.
    level : int
        The last level to keep.

    Returns
    -------
    int
        Size of the new file, bytes.

    Raises
    ------
    LevelUnavailable
        Where the source has no such level.
    FormatError
        Where the source is damaged, or was cut off before that level.
    OSError
        Where a file cannot be read or written.
    """
    with open(os.fspath(source), "rb") as opened, AthFile(opened) as file:
        if not 0 <= level < file.level_count:
            raise LevelUnavailable(f"level: got {level}; expected 0 to {file.level_count - 1}")
        chunks = [chunk for chunk in file.chunks if not chunk.is_motion or chunk.level <= level]
        for chunk in chunks:
            if not file.is_available(chunk):
                raise Truncated(
                    f"{chunk}: got a file of {file.available_length} bytes; expected at least "
                    f"{chunk.offset + chunk.length}"
                )
        errors = file.errors[: level + 1]
        whole = level + 1 == file.full_level_count
        header = replace(
            file.header,
            level_count=level + 1,
            max_error=file.max_error_bound if whole else float(errors[level, :, 0].max()),
        )
        with new_file(target) as out:
            out.write(ct.pack_front(header, chunks, errors))
            for chunk in chunks:
                out.write(file.payload(chunk))
            return out.tell()
