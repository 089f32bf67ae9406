"""What a caller has of a motion, as a clip: an array of positions, a clip, a decoder, or the path of a source."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any, TypeAlias

import numpy as np

from athcodec.decoding.clip_view import ClipView
from athcodec.decoding.decoder import Decoder
from athcodec.errors import ClipError, GuessWarning
from athcodec.files.atomic import keeping
from athcodec.motion.clip import DEFAULT_FPS, MotionClip, frame_rate
from athcodec.motion.positions import (
    FRAMES,
    Order,
    facts_of,
    in_floats,
    looks_turned,
    order_of,
    order_of_labels,
    ordered,
    parse_order,
    seconds_of_dates,
    turned_advice,
)
from athcodec.motion.units import checked_axis, checked_unit
from athcodec.untyped import JsonObject, Keywords

Source: TypeAlias = Any
"""An array (frames, vertices, 3), a MotionClip, a Decoder or ClipView, or a path."""
OF_ARRAYS = ("faces", "vertex_branch", "branch_parent", "axes")
OF_FILES = ("fps", "unit", "up_axis")
OF_PATHS = (*OF_FILES, "dataset", "axes")
LISTED = 12  # Arrays that a message names.
OF_VIEWS = "positions time vertex_branch branch_parent stem_index rest edges faces".split()
OF_VIEWS += ["attributes", "metadata", "clip_ranges"]


@contextmanager
def clip_of(source: Source, **options: Any) -> Iterator[tuple[MotionClip, str]]:
    """Yield (clip, sentence): the source as a MotionClip, and a sentence that says how its type of number was
    converted, "" if it was not. A file that is opened for this is closed when the block ends.

    `options` may have the names in OF_PATHS if the source is a path, in OF_ARRAYS and OF_FILES if it is an array, and
    none if it is a clip. Raises ClipError, ValueError, and the exceptions of `read`.
    """
    is_path, is_view = isinstance(source, (str, os.PathLike)), isinstance(source, (Decoder, ClipView))
    allowed = OF_PATHS if is_path else () if is_view or isinstance(source, MotionClip) else (*OF_ARRAYS, *OF_FILES)
    for name in options.keys() - set(allowed):
        raise ValueError(f"{name}: got it beside {type(source).__name__} {source!r:.80}, which states its own")
    if is_path:
        from athcodec.sources import read  # The sources take long to import.

        with read(source, **options) as clip:
            yield clip, ""
    elif is_view:
        view = ClipView(source) if isinstance(source, Decoder) else source
        with keeping(view.inputs):
            yield MotionClip(**{name: getattr(view, name) for name in OF_VIEWS}), ""
    else:
        with nullcontext((source, "") if isinstance(source, MotionClip) else _clip_of_array(source, options)) as opened:
            yield opened


def _clip_of_array(source: Source, options: Keywords) -> tuple[MotionClip, str]:
    """Return (clip, sentence) as `clip_of` does, for an array of positions. Raises ClipError."""
    if isinstance(source, np.ma.MaskedArray) and np.ma.is_masked(source):
        raise ClipError("positions: got an array with masked items, expected a number for each; fill them first")
    if hasattr(source, "keys") and not hasattr(source, "shape"):
        raise ClipError(f"positions: got a {type(source).__name__}, expected one of its arrays: {_held(source)}")
    is_sliced = hasattr(source, "shape") and isinstance(getattr(source, "dtype", None), np.dtype)
    array = source if is_sliced else np.asarray(source)
    axes, facts = options.pop("axes", None), facts_of(options)
    order = order_of_labels(_labels(source)) if axes is None else parse_order(axes)
    order = order_of(array.shape, facts, order)
    positions, converted = in_floats(ordered(array, order))
    if axes is None and looks_turned(positions, facts):
        warnings.warn(turned_advice(positions.shape), GuessWarning, stacklevel=2)
    stated = {name: value for name, value in dict(getattr(source, "attrs", {})).items() if name in OF_FILES}
    time = _seconds(source, order, positions.shape[0]) if "fps" not in options else None
    options = stated | options
    rate = frame_rate({"fps": options.pop("fps", DEFAULT_FPS)})
    metadata: JsonObject = {name: options.pop(name) for name in OF_FILES if name in options}
    for name, checked in (("unit", checked_unit), ("up_axis", checked_axis)):
        if name in metadata:
            metadata[name] = checked(metadata[name])
    time = np.arange(positions.shape[0]) / rate if time is None else time
    return MotionClip(positions, time, metadata=metadata, **options), converted


def _held(source: Source) -> str:
    """Return the arrays of a mapping with their shapes; those of an archive of NumPy would have to be read for that."""
    names = list(source.keys())
    shapes = ["" if isinstance(source, np.lib.npyio.NpzFile) else getattr(source[name], "shape", "") for name in names]
    shown = [f"{name} {shape}".strip() for name, shape in zip(names[:LISTED], shapes)]
    return ", ".join(shown) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")


def _labels(source: Source) -> list[str]:
    """Return the names of the dimensions of an array of xarray, HDF5 or zarr, as far as it has them."""
    dimensions = getattr(source, "dims", None) or getattr(getattr(source, "metadata", None), "dimension_names", None)
    dimensions = dimensions or dict(getattr(source, "attrs", {})).get("_ARRAY_DIMENSIONS")
    return [str(getattr(each, "label", each)) for each in dimensions] if np.iterable(dimensions) else []


def _seconds(source: Source, order: Order | None, frame_count: int) -> np.ndarray | None:
    """Return the coordinates that an array of xarray has along its frames, in seconds; None without any."""
    labels, coordinates = _labels(source), getattr(source, "coords", None)
    if coordinates is None or order is None or len(labels) != len(order) or (FRAMES,) not in order:
        return None
    label = labels[order.index((FRAMES,))]
    values = seconds_of_dates(np.asarray(coordinates[label]) if label in coordinates else np.zeros(0))
    return values if values.shape == (frame_count,) and values.dtype.kind in "fiu" else None
