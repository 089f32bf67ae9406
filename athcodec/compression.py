"""Encoding of whatever a caller has: `athcodec.encode`."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace
from inspect import Parameter, Signature, signature
from os import PathLike
from typing import BinaryIO, TypedDict, Unpack, overload

import numpy as np
import numpy.typing as npt

from athcodec.arrays import OF_ARRAYS, OF_PATHS, Source, clip_of
from athcodec.encoding import Summary, encode_clip
from athcodec.encoding.search.progress import Progress
from athcodec.exporters import check_ath_name
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.units import LengthLike
from athcodec.untyped import Keywords


class EncodeOptions(TypedDict, total=False):
    """The options of `encode`; None, where it is not a type of one, is the default."""

    faces: npt.ArrayLike | None
    vertex_branch: npt.ArrayLike | None
    branch_parent: npt.ArrayLike | None
    fps: float | None
    unit: str | None
    up_axis: str | None
    axes: str | Sequence[str] | None
    dataset: str | None
    max_error: LengthLike | None
    rel_error: float | None
    target_size: int | str | None
    ladder: str | Sequence[float]
    lossless: bool
    exact_rest: bool
    host_rest: bool
    rest_error: LengthLike | None
    weights: str | np.ndarray | None
    attributes: str
    effort: str
    smoothness: str
    segment_frames: int | None
    tam: Thresholds | None
    jobs: int | None
    progress: Progress | None


@overload
def encode(source: Source, target: None = None, **options: Unpack[EncodeOptions]) -> bytes: ...
@overload
def encode(source: Source, target: str | PathLike[str] | BinaryIO, **options: Unpack[EncodeOptions]) -> Summary: ...
def encode(
    source: Source, target: str | PathLike[str] | BinaryIO | None = None, **options: Unpack[EncodeOptions]
) -> Summary | bytes:
    """Compress motion into an .ath file, within an error bound.

    Parameters
    ----------
    source : (frames, vertices, 3) array, MotionClip, Decoder, str or path-like
        An array may be anything that slices by frames: NumPy, h5py, zarr, dask. It is never read whole. Integers and
        float16 are converted, and the summary says so. A path is that of a file that `read` knows.
    target : str, path-like or binary file object, optional
        A path gets its file when that is whole; other files and names of other formats are refused. None: return bytes.
    **options
        Those below.

    Other Parameters
    ----------------
    faces, vertex_branch, branch_parent, fps, unit, up_axis, axes, dataset : optional
        What an array does not say, as in MotionClip; fps is 30 and branches are found unless they are passed. Units are
        "m", "cm", "mm", "km", "in" and "ft", axes of space "x", "y" and "z"; axes is the order of an array's own, such
        as "vertices,frames,xyz". With a path, all from fps on are those of `read`.
    max_error, rel_error, target_size : optional
        At most one: the largest distance of any vertex in any frame from the source, in scene units or as "1mm"; the
        same over the diagonal of all frames (default 1e-4, lossless 4e-7); or the bytes of the file, or "50kB".
    ladder : {"decades", "none"} or sequence of float
        Largest errors over the diagonal at which decoding can stop, each held by a layer; "none", a single layer, is a
        few percent smaller, and taken for "decades" where it seems to be a fifth smaller. Errors below 4 bounds, or
        less than 2.5 times apart, make no layer.
    lossless, exact_rest, host_rest : bool
        Add a level that is the source bit for bit; keep the rest pose so; leave it out (`open`, host_mesh).
    rest_error : float, str or Length, optional
        Largest error of the rest pose: a fraction of the diagonal, a length ("2mm") or "bound". By default faces keep
        their shape at every level, and other rest poses are within the bound.
    weights : str or (vertices,) array, optional
        A factor on the bound for each vertex, or the attribute that has them.
    attributes : {"all", "none"}
        "none" drops faces, edges and named arrays.
    effort, smoothness : str
        How long to search ("fast", "default", "best"), and how many bytes steady errors of growth may cost ("bytes":
        none, "default", "motion": twice the file).
    segment_frames, jobs : int, optional
        Longest run of frames that is decoded at once, 16 to 256; threads, which do not change the file.
    tam : Thresholds, optional
        Acceptance thresholds of the ATH (Song, Yang and Peng 2011, section 3) in place of those that the bound allows.
    progress : callable, optional
        Called with the phase of the work and the fraction that is done, which never falls and ends with 1.0.

    Returns
    -------
    Summary, or bytes if target is None

    Raises
    ------
    ClipError, BoundError, ValueError, OSError
        For motion that cannot be stored, a bound that cannot be kept, options that contradict each other or are out of
        range, and a target that cannot be written.

    Examples
    --------
    >>> positions = np.zeros((60, 20, 3), np.float32)  # a stem of 20 vertices that bends for 60 frames
    >>> positions[..., 1] = np.linspace(0, 2, 20)
    >>> positions[..., 0] = 0.02 * np.sin(np.arange(60) / 10)[:, None] * positions[..., 1] ** 2
    >>> data = athcodec.encode(positions, max_error=0.001, vertex_branch=np.zeros(20, int), branch_parent=[-1])
    >>> with athcodec.open(data) as decoder:
    ...     bool(np.abs(decoder - positions).max() <= 0.001)
    True
    """
    if unknown := options.keys() - EncodeOptions.__annotations__.keys():
        raise TypeError(f"encode: got the option {min(unknown)!r}; expected {', '.join(EncodeOptions.__annotations__)}")
    if isinstance(target, (str, PathLike)):
        check_ath_name(target)
    settings: Keywords = {name: value for name, value in options.items() if value is not None}
    of_source = {name: settings.pop(name) for name in {*OF_ARRAYS, *OF_PATHS} if name in settings}
    out = io.BytesIO() if target is None else target
    with clip_of(source, **of_source) as (clip, converted):
        if isinstance(source, (str, PathLike)):
            from athcodec.sources.one_frame import warn_of_still  # The sources take long to import.

            warn_of_still(clip, source, axes=of_source.get("axes"))
        summary = replace(encode_clip(clip, out, **settings), converted=converted)
    return out.getvalue() if isinstance(out, io.BytesIO) and target is None else summary


# The names for `help` and for completion, which look at the signature.
_NAMES = [Parameter(name, Parameter.KEYWORD_ONLY, default=None) for name in EncodeOptions.__annotations__]
_PLACES = [parameter for parameter in signature(encode).parameters.values() if parameter.name != "options"]
encode.__signature__ = Signature([*_PLACES, *_NAMES])  # type: ignore[attr-defined]
