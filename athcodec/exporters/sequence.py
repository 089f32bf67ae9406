"""Writes a motion as numbered OBJ or PLY files: tree.obj becomes tree_0001.obj, tree_0002.obj ...

The numbers are those of the frames in the tool that the clip comes from; where its times fall between frames, or before
frame 0, files are numbered from 1 on and their times are lost. A path that is numbered itself (tree_0001.obj,
tree_####.obj, tree_%04d.obj) says how the numbers look. A single frame is written to tree.obj itself. All files appear
together; files of that name with other numbers are an error, because they would be read as frames of the same motion.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from os import fspath
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters import FILES, Progress, WriteOptions
from athcodec.exporters.mesh import WRITERS
from athcodec.exporters.scene_objects import lost_arrays
from athcodec.exporters.timing import frame_numbers
from athcodec.files.atomic import check_target, new_files
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.sources.numbering import LARGEST_NUMBER, Numbering, numbering_of
from athcodec.untyped import JsonObject

DIGITS = 4


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write one file per frame, and return their names. Raise ClipError if files of the same numbering exist already,
    OSError if nothing can be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise ClipError(f"{fspath(path)}: got the suffix {suffix!r}, expected one of {', '.join(WRITERS)}")
    names = file_names(motion, path)
    writer = WRITERS[suffix](motion)
    with new_files(path, named=False) as folder:
        write_frames(motion, writer, [os.path.join(folder, name) for name in names], report)
    return {FILES: names} | lost_arrays(motion, writer.arrays(motion))


def write_frames(motion: Motion, writer: Any, paths: Sequence[str], report: Progress) -> None:
    """Write a file for each frame by `writer.write(file, points)`."""
    for start, frames in motion.blocks():
        for frame, points in enumerate(frames, start):
            with open(paths[frame], "wb") as file:
                writer.write(file, points)
            report((frame + 1) / motion.frame_count)


def file_names(motion: Motion, path: FilePath) -> list[str]:
    """Return the name of each frame's file, numbered after the name of `path`. Raise ClipError if files with other
    numbers exist beside them.
    """
    path = Path(check_target(path))
    numbering = _numbering(path)
    if numbering is None:
        if motion.frame_count == 1:
            return [path.name]
        numbering = Numbering(path.parent, f"{path.stem}_", DIGITS, path.suffix)
    numbers, files = file_numbers(motion), numbering.files()
    further = sorted(files.keys() - set(numbers))
    if further:
        raise ClipError(
            f"{fspath(files[further[0]])}: is there already and no frame of the clip, which has "
            f"{numbers[0]} to {numbers[-1]}; remove such files or choose another name"
        )
    return [numbering.path(number).name for number in numbers]


def file_numbers(motion: Motion) -> list[int]:
    """Return numbers of the frames, or 1, 2 ... where they are not whole, twice the same or below 0."""
    numbers = np.round(frame_numbers(motion), 3)
    usable = (numbers == np.floor(numbers)).all() and numbers.min() >= 0 and numbers.max() <= LARGEST_NUMBER
    if usable and (np.diff(numbers) > 0).all():
        return [int(number) for number in numbers]
    return list(range(1, motion.frame_count + 1))


def _numbering(path: Path) -> Numbering | None:
    """Return how the files are to be called, where the path says so: by # or %04d, or by digits with a zero before
    them."""
    return Numbering.of_pattern(path) or (numbering_of(path) if re.search(r"(^|\D)0\d*$", path.stem) else None)
