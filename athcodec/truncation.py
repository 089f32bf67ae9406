"""A shorter .ath file from a longer one, without decoding: the deeper levels and their entries in the header go."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import cast

from athcodec.decoding import container as ct
from athcodec.decoding.ath_file import AthFile
from athcodec.errors import ClipError, LevelUnavailable, Truncated
from athcodec.exporters import check_ath_name
from athcodec.files.atomic import check_target, new_file
from athcodec.motion.units import LengthLike, size_of


def truncate(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    level: int | None = None,
    *,
    max_error: LengthLike | None = None,
    target_size: int | str | None = None,
    gltf_motion: str | None = None,
) -> int:
    """Write the first levels of an .ath file as a complete file, whose error bound is that of the last of them.

    Static data is kept, and so are the rest pose of the source, unless the source is cut off before it, and what other
    programs added in optional chunks. Nothing is decoded. One of `level`, `max_error` and `target_size` is given.

    Parameters
    ----------
    source : str or path-like
        The file to shorten, or a GLB whose vertices one moves (ATH_motion).
    target : str or path-like
        The file to write; it appears when it is complete. If the source is a GLB and this name ends in ``.glb``, the
        GLB is written with the shorter file in it.
    level : int, optional
        The last level to keep.
    max_error : float or str, optional
        A length in scene units, or text such as "5cm": keep the levels down to the first whose largest error is at
        most this.
    target_size : int or str, optional
        A size in bytes, or text such as "2kB": keep as many levels as fit into it.
    gltf_motion : str, optional
        The name of the motion to shorten, if the source is a GLB with several motions.

    Returns
    -------
    int
        Size of the new file, bytes.

    Raises
    ------
    LevelUnavailable
        If the source has no such level.
    FormatError
        If the source is damaged, or was cut off before that level.
    ClipError
        If a GLB is to be written and the source is no GLB, has no motion of that name, or has several motions and none
        is named.
    OSError
        If a file cannot be read or written.
    TypeError
        If not exactly one of `level`, `max_error` and `target_size` is given.

    Examples
    --------
    >>> import os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     size = athcodec.truncate(athcodec.sample_path("grass"), os.path.join(folder, "far.ath"), level=0)
    >>> size < os.path.getsize(athcodec.sample_path("grass"))
    True
    """
    if sum(option is not None for option in (level, max_error, target_size)) != 1:
        raise TypeError("truncate: expected one of level, max_error and target_size")
    with AthFile(source, gltf_motion=gltf_motion) as file:
        suffix = ".glb" if Path(target).suffix.lower() == ".glb" else ".ath"
        if suffix == ".ath":
            check_ath_name(target)
        check_target(target, suffix)
        if max_error is not None:
            last = file.level_within(max_error)
        elif target_size is not None:
            last = _last_within(file, size_of(target_size, "target_size"))
        else:
            last = file.tables.checked_level(cast(int, level))
        front, chunks = _shortened(file, last)
        for chunk in chunks:
            if not file.chunks.is_available(chunk):
                raise Truncated(
                    f"{chunk}: got a file of {file.available_length} bytes; expected at least "
                    f"{chunk.offset + chunk.length}"
                )
        if Path(target).suffix.lower() == ".glb":
            from athcodec.exporters.gltf_into import put_motion  # The module takes long to import.
            from athcodec.files.gltf.motion import GltfMotion

            if not isinstance(file.source, GltfMotion):
                raise ClipError(f"{target}: got an .ath file to cut, expected a GLB with a motion to write another one")
            return put_motion(source, b"".join([front, *map(file.chunks.stored, chunks)]), target, file.source.number)
        with new_file(target) as out:
            out.write(front)
            for chunk in chunks:
                out.write(file.chunks.stored(chunk))
            return out.tell()


def _shortened(file: AthFile, level: int) -> tuple[bytes, list[ct.Chunk]]:
    """Return (front, chunks) of a file cut off behind `level`: the bytes of its new front, and the chunks that follow
    it.

    Chunks of unknown kinds are kept if FORMAT.md, "Rewriting", says that they survive a cut.
    """
    chunks = [chunk for chunk in file.chunks.all if not chunk.is_motion or chunk.level <= level]
    if file.tables.rest_is_missing:
        chunks = [chunk for chunk in chunks if chunk.kind != ct.SOURCE_REST]
    whole = level + 1 == file.full_level_count
    header = replace(
        file.tables.header,
        level_count=level + 1,
        joins=file.joins[: level + 1],
        max_error=file.max_error_bound if whole else float(file.errors[level, :, 0].max()),
    )
    return ct.pack_front(header, chunks, file.errors[: level + 1]), chunks


def _last_within(file: AthFile, target_size: float) -> int:
    parts = (_shortened(file, level) for level in range(file.level_count))
    sizes = [len(front) + sum(chunk.length for chunk in chunks) for front, chunks in parts]
    if sizes[0] > target_size:
        raise LevelUnavailable(f"target_size: got {target_size:.0f}; expected at least {sizes[0]} bytes")
    return max(level for level, size in enumerate(sizes) if size <= target_size)
