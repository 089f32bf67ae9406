"""Names sources of one frame when they are encoded: a file without a motion looks like one that lost it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path

from athcodec.errors import ClipError, GuessWarning
from athcodec.motion.clip import MotionClip
from athcodec.motion.positions import FRAMES, parse_order
from athcodec.sources import find_format, format_named, formats
from athcodec.sources.numbering import numbered_files

STILL_ADVICE = {
    "gltf": "no animation in it moves a vertex; exporters keep the motion of bones and shape keys, but not that of "
    "modifiers, physics or geometry nodes: bake it to shape keys, or export Alembic (.abc) or USD (.usdc)",
    "usd": "it has no samples in time; export it with its animation, over the range of frames",
    "alembic": "it has no samples in time; export it with its animation, over the range of frames",
    "sequence": "each file of this format is a frame; number the files of a motion and name any one of them",
    "vtk": "each file of this format is a frame; number the files of a motion and name any one of them",
    "xdmf": "it has no series in time; write each step as a grid of a temporal collection",
}  # What a format of that name says of a file of one frame, and what to do for a motion.


def warn_of_still(
    clip: MotionClip, path: str | PathLike[str], format: str | None = None, axes: str | Sequence[str] | None = None
) -> None:
    """Warn of a source of one frame that is about to be encoded: a file without a motion looks like one that lost it.

    Parameters
    ----------
    clip : MotionClip
        What `read` returned.
    path : str or path
        The file.
    format : str, optional
        The name of its format, if `read` was told that.
    axes : str or sequence of str, optional
        The axes that `read` was told: those of a single frame ask for it.
    """
    order = None if axes is None else parse_order(axes)
    if clip.frame_count != 1 or order is not None and not any(FRAMES in axis for axis in order):
        return
    kind = find_format(path) if format is None else format_named(format, formats())
    if not kind.has_series and numbered_beside(path):  # `read` has warned of that.
        return
    advice = STILL_ADVICE.get(kind.name, "for a motion, write several frames")
    warnings.warn(
        f"{os.fspath(path)}: holds a single frame, so the plant stands still: {advice}; if one pose is meant, pass "
        "--still (in Python, encode the clip of athcodec.read)",
        GuessWarning,
        stacklevel=3,
    )


def numbered_beside(path: str | PathLike[str]) -> list[str]:
    """Return the names of other files that are numbered like frames of the same motion."""
    with suppress(ClipError, OSError):
        return [file.name for file in numbered_files(path).paths if file != Path(path)]
    return []
