"""Errors of a file against its source: `athcodec.compare`."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

from athcodec.arrays import Source, clip_of
from athcodec.decoding.decoder import Decoder
from athcodec.decoding.file_bytes import Openable
from athcodec.errors import ClipError
from athcodec.files.shown import Report, Table, counted
from athcodec.metrics.blocks import paired
from athcodec.motion.joining import split
from athcodec.opening import open


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Distances between the vertices of a file and of its source, in scene units; `str` is a table of the levels.

    Attributes
    ----------
    time : (T,) float64 array
        Seconds of the frames.
    max_error, rms_error : (levels, T) float64 array
        Largest distance and root mean square of the distances in each frame at each level.
    worst_vertex : (levels, T) int64 array
        The vertex that is furthest off.
    promised : (levels,) float64 array
        The largest error that the file states for each level.

    Examples
    --------
    >>> tree = athcodec.sample_path("tree")
    >>> errors = athcodec.compare(tree, athcodec.encode(tree, effort="fast"))
    >>> bool((errors.max_error.max(axis=1) <= errors.promised).all())
    True
    """

    time: np.ndarray
    max_error: np.ndarray
    rms_error: np.ndarray
    worst_vertex: np.ndarray
    promised: np.ndarray

    def __repr__(self) -> str:
        """Return a line with the number of levels and frames and the largest error."""
        levels, frames = self.max_error.shape
        largest = self.max_error.max(axis=1)
        coarse = f", {largest[0]:.3g} at level 0" if levels > 1 else ""
        return (
            f"<Comparison: {counted(levels, 'level')} in {counted(frames, 'frame')}, largest error "
            f"{largest[-1]:.3g} at level {levels - 1}{coarse}>"
        )

    def __str__(self) -> str:
        return str(self._report())

    def _repr_html_(self) -> str:
        return self._report()._repr_html_()

    def _report(self) -> Report:
        """Return the table that `str` and notebooks show: for each level the promised, largest and RMS error, and the
        frame, time and vertex of the largest."""
        rows = []
        for level, (largest, rms) in enumerate(zip(self.max_error, self.rms_error)):
            frame = int(largest.argmax())
            errors = (self.promised[level], largest[frame], np.sqrt(np.mean(rms**2)))
            place = f"{frame:,}", f"{self.time[frame]:.4g}", f"{self.worst_vertex[level, frame]:,}"
            rows.append([f"{level}", *(f"{error:.4g}" for error in errors), *place])
        return Report([Table(["level", "promised", "max", "RMS", "in frame", "at seconds", "vertex"], rows)])


def compare(source: Source, file: Decoder | Openable, **options: Any) -> Comparison:
    """Measure every level of an .ath file against its source, frame by frame.

    Parameters
    ----------
    source : (frames, vertices, 3) array, MotionClip, Decoder, str or path-like
        The source, as for `encode`. If it has several clips, the one with the same name as the file's clip is measured.
    file : Decoder, or str, path-like, bytes or binary file object
        The .ath file, whose first clip is compared, or a decoder, whose clip is compared.
    **options
        Parameters of `open`, such as clip, which names another clip to compare, and host_mesh.

    Returns
    -------
    Comparison
        The error of each level in each frame, in scene units.

    Raises
    ------
    ClipError
        If source and file differ in the number of frames or vertices.
    FormatError
        If the file is damaged.

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("grass")) as grass:
    ...     coarse = athcodec.compare(grass[:], grass)
    >>> coarse.max_error.shape, float(coarse.max_error[-1].max())
    ((4, 150), 0.0)
    """
    opened = nullcontext(file) if isinstance(file, Decoder) else open(file, **options)
    with opened as decoder, clip_of(source) as (whole, _):
        clip = split(whole).get(decoder.clip.name, whole)
        got, expected = (clip.frame_count, clip.vertex_count), decoder.shape[:2]
        if got != expected:
            raise ClipError(f"source: got {got} frames and vertices, expected {expected} as in the .ath file")
        if decoder.file.needs_host_mesh:
            decoder.file.set_host_mesh(clip)
        shape = decoder.file.deepest + 1, decoder.frame_count
        largest, rms, worst = np.empty(shape), np.empty(shape), np.empty(shape, np.int64)
        for start, stop in decoder.segments:
            reference = clip.block(start, stop)
            for level in range(len(largest)):
                first = start
                for frames, shown in paired(reference, decoder.positions(slice(start, stop), level), 0):
                    distance = np.linalg.norm(frames - shown, axis=2)
                    rows = level, slice(first, first := first + len(distance))
                    largest[rows], worst[rows] = distance.max(axis=1), distance.argmax(axis=1)
                    rms[rows] = np.sqrt((distance**2).mean(axis=1))
        promised = np.array([level.max_error for level in decoder.levels[: len(largest)]])
        return Comparison(decoder.time, largest, rms, worst, promised)
