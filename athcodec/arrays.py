"""What a caller has of a motion, as a clip: an array of positions, a clip, a decoder, or the path of a source."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from athcodec.decoding.clip_view import ClipView
from athcodec.decoding.decoder import Decoder
from athcodec.errors import ClipError
from athcodec.files.atomic import keeping
from athcodec.motion.clip import DEFAULT_FPS, MotionClip, frame_rate
from athcodec.motion.frames import Frames
from athcodec.motion.units import checked_axis, checked_unit

Source: TypeAlias = Any
"""An array (frames, vertices, 3), a MotionClip, a Decoder or ClipView, or a path."""
OF_ARRAYS = ("faces", "vertex_branch", "branch_parent")
OF_FILES = ("fps", "unit", "up_axis")
OF_VIEWS = "positions time vertex_branch branch_parent stem_index rest edges faces".split()
OF_VIEWS += ["attributes", "metadata", "clip_ranges"]


@contextmanager
def clip_of(source: Source, **given: Any) -> Iterator[tuple[MotionClip, str]]:
    """Give a source as a clip, and a sentence on how its numbers were converted, empty if they were not.

    The options are OF_ARRAYS and OF_FILES, as far as they are given. A file that is opened here is closed when the
    block ends. Raises ClipError, ValueError, and the errors of `read`.
    """
    is_path, is_view = isinstance(source, (str, os.PathLike)), isinstance(source, (Decoder, ClipView))
    allowed = OF_FILES if is_path else () if is_view or isinstance(source, MotionClip) else (*OF_ARRAYS, *OF_FILES)
    for name in given.keys() - set(allowed):
        raise ValueError(f"{name}: got it beside {type(source).__name__} {source!r:.80}, which states its own")
    if is_path:
        from athcodec.sources import read  # The sources take long to import.

        with read(source, **given) as clip:
            yield clip, ""
    elif is_view:
        view = ClipView(source) if isinstance(source, Decoder) else source
        with keeping(view.inputs):
            yield MotionClip(**{name: getattr(view, name) for name in OF_VIEWS}), ""
    else:
        with nullcontext((source, "") if isinstance(source, MotionClip) else _clip_of_array(source, given)) as made:
            yield made


def _clip_of_array(source: Source, given: dict[str, Any]) -> tuple[MotionClip, str]:
    if isinstance(source, np.ma.MaskedArray) and np.ma.is_masked(source):
        raise ClipError("positions: got an array with masked items, expected a number for each; fill them first")
    is_sliced = hasattr(source, "shape") and isinstance(getattr(source, "dtype", None), np.dtype)
    positions, converted = _in_floats(source if is_sliced else np.asarray(source))
    rate = frame_rate({"fps": given.pop("fps", DEFAULT_FPS)})
    metadata: dict[str, Any] = {name: given.pop(name) for name in OF_FILES if name in given}
    for name, checked in (("unit", checked_unit), ("up_axis", checked_axis)):
        if name in metadata:
            metadata[name] = checked(metadata[name])
    frame_count = positions.shape[0] if positions.shape else 0
    return MotionClip(positions, np.arange(frame_count) / rate, metadata=metadata, **given), converted


def _in_floats(positions: Any) -> tuple[Any, str]:
    """Return positions in float32 or float64, whichever holds them, and a sentence if that is another type."""
    before = positions.dtype
    if before.kind not in "iuf" or len(positions.shape) != 3 or (before.kind == "f" and before.itemsize in (4, 8)):
        return positions, ""
    after: npt.DTypeLike = np.float32 if np.result_type(before, np.float32) == np.float32 else np.float64

    def read(start: int, stop: int) -> np.ndarray:
        return np.asarray(positions[start:stop]).astype(after)

    frame_count, vertex_count, _ = positions.shape
    return Frames(read, frame_count, vertex_count, after), f"positions: {before} became {np.dtype(after)}"
