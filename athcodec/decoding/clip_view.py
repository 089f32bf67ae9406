"""Some frames of an .ath file at one level, or all its clips, in the shape of a clip, which exporters write."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from athcodec.decoding.affines import Affines
from athcodec.decoding.decoder import Decoder
from athcodec.errors import LevelUnavailable
from athcodec.files.atomic import FileId
from athcodec.files.shown import counted
from athcodec.motion.clip import DEFAULT_FPS, ClipRange, clip_range_frames, polygons, stated_fps
from athcodec.motion.frames import Frames
from athcodec.motion.presence import presence_within
from athcodec.options import whole
from athcodec.untyped import JsonObject


def _of_file(name: str, text: str) -> Any:
    """Return a property for a view that gives the file's property `name`; text: its docstring."""
    return property(lambda view: getattr(view.decoder.file, name), doc=text)


class ClipView:
    """Frames of an .ath file at one level, with the names and the meanings of MotionClip, and `affines` besides.

    Vertices stand in the source's order, lengths are in scene units. Frame 0 is the first of the view; its time and
    metadata["start_frame"] are those of the frame in the whole clip.

    Parameters
    ----------
    decoder : Decoder
        The clip to show; it stays open as long as the view is used.
    level : int, optional
        Level of detail; by default the deepest that is complete.
    frames : range, optional
        Frames of the clip, with step 1; by default all.
    all_clips : bool
        Show these frames of every clip of the file, one clip after the other, as a MotionClip of several clip ranges
        has them.

    Raises
    ------
    LevelUnavailable
        If the level or the frames do not exist. Methods raise the errors of Decoder besides.

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("grass")) as grass:
    ...     view = athcodec.ClipView(grass, level=1, frames=range(10, 20))
    ...     view.frame_count, view.positions[2:5].shape
    (10, (3, 1400, 3))
    """

    def __init__(
        self, decoder: Decoder, level: int | None = None, frames: range | None = None, *, all_clips: bool = False
    ):
        self.decoder = decoder
        self.level = decoder.level if level is None else decoder.file.tables.checked_level(level)
        played = [decoder.play(clip.name) for clip in decoder.file.clips] if all_clips else [decoder]
        self._runs = [(clip, _checked(frames, clip.frame_count)) for clip in played]

    def __repr__(self) -> str:
        """Return a line with the names, size, level and error of the frames."""
        names = ", ".join(repr(clip_range.name) for clip_range in self.clip_ranges if clip_range.name)
        unit = self.metadata.get("unit")
        return (
            f"<ClipView{f' {names}' if names else ''}: {counted(self.frame_count, 'frame')} of {self.vertex_count:,} "
            f"vertices, {self.dtype}, level {self.level} of 0 to {self.decoder.file.level_count - 1}, error at most "
            f"{self.max_error:.3g}{f' {unit}' if unit else ''}>"
        )

    vertex_count = _of_file("vertex_count", "Vertices of the plant, N.")
    branch_count = _of_file("branch_count", "Branches of the plant, B.")
    dtype = _of_file("dtype", "Type of the positions, float32 or float64.")
    rest = _of_file("rest", "Rest pose, (N, 3) float32 or float64, scene units.")
    vertex_branch = _of_file("vertex_branch", "The branch of each vertex, (N,) int32.")
    branch_parent = _of_file("branch_parent", "The parent of each branch, (B,) int32, -1 for a root.")
    stem_index = _of_file("stem_index", "Place of each vertex on its stem, (N,) int32, or None; see MotionClip.")
    edges = _of_file("edges", "(E, 2) vertex numbers, or None.")
    faces = _of_file("faces", "(F, k) vertex numbers, or None.")
    attributes = _of_file("attributes", "Named static arrays, as the source had them.")

    @property
    def inputs(self) -> frozenset[FileId]:
        """The files that the view is read from, by device and inode."""
        return self.decoder.file.inputs

    @property
    def clip_ranges(self) -> tuple[ClipRange, ...]:
        """The clips. One that loops does not loop here if only some of its frames are shown."""
        return tuple(
            ClipRange(decoder.clip.name, len(frames), decoder.clip.loop and len(frames) == decoder.frame_count)
            for decoder, frames in self._runs
        )

    @property
    def clip_range_frames(self) -> list[tuple[int, int]]:
        """(start, stop) frames of each clip."""
        return clip_range_frames(self.clip_ranges)

    @property
    def frame_count(self) -> int:
        """Frames of all its clips, T."""
        return sum(len(frames) for _, frames in self._runs)

    @property
    def first_frame(self) -> int:
        """Number of the view's first frame in the whole clip."""
        return self._runs[0][1].start

    @property
    def max_error(self) -> float:
        """The largest distance of any vertex in any frame of its clips at this level from the source, scene units."""
        return max(decoder.levels[self.level].max_error for decoder, _ in self._runs)

    @property
    def positions(self) -> Frames:
        """Positions (T, N, 3), which are decoded when they are sliced by frames."""
        return Frames(self.block, self.frame_count, self.vertex_count, self.dtype)

    @property
    def time(self) -> np.ndarray:
        """Seconds, (T,) float64."""
        return np.concatenate([decoder.time[frames.start : frames.stop] for decoder, frames in self._runs])

    @property
    def fps(self) -> float:
        """Frames per second that the source states, else the median rate of the file, else 30."""
        return stated_fps(self.metadata) or self.decoder.fps or DEFAULT_FPS

    @cached_property
    def metadata(self) -> JsonObject:
        """Unit, up axis and whatever else the source states for the clip, or for all clips."""
        if len(self._runs) > 1:
            return dict(self.decoder.file.metadata)
        return presence_within(self.decoder.metadata, self._runs[0][1])

    @property
    def polygons(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Faces of any sizes: corners per face (F,), and the vertex of each corner (C,); or None."""
        return polygons(self.faces, self.attributes)

    def block(self, start: int, stop: int) -> np.ndarray:
        """Return the positions of some frames of the view.

        Parameters
        ----------
        start, stop : int
            The first frame, and the frame behind the last.

        Returns
        -------
        numpy.ndarray
            (stop - start, N, 3), scene units.
        """
        parts, start, stop = [], whole("start", start), whole("stop", stop)
        for (decoder, frames), (first, last) in zip(self._runs, self.clip_range_frames):
            part = frames[max(start - first, 0) : max(min(stop, last) - first, 0)]
            if part:
                parts.append(decoder.positions(slice(part.start, part.stop), self.level))
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def blocks(self) -> Iterator[tuple[int, np.ndarray]]:
        """Yield the positions of all frames, with one segment in memory at a time.

        Yields
        ------
        start : int
            The first frame of the block.
        block : numpy.ndarray
            (k, N, 3), scene units.
        """
        for (decoder, frames), (first, _) in zip(self._runs, self.clip_range_frames):
            for start, block in decoder.blocks(self.level, frames=slice(frames.start, frames.stop)):
                yield start - frames.start + first, block

    def affines(self, frame: int) -> Affines:
        """Return a frame of the view as matrices.

        Parameters
        ----------
        frame : int
            Number of the frame in the view.

        Returns
        -------
        Affines
            The result of Decoder.affines.

        Raises
        ------
        IndexError
            If the view has no such frame.
        """
        frame = whole("frame", frame)
        for (decoder, frames), (first, last) in zip(self._runs, self.clip_range_frames):
            if first <= frame < last:
                return decoder.affines(frames[frame - first], self.level)
        raise IndexError(f"frame {frame}: expected 0 to {self.frame_count - 1}")


def _checked(frames: range | None, frame_count: int) -> range:
    """Return the frames, by default all. Raises LevelUnavailable if they do not exist."""
    frames = range(frame_count) if frames is None else frames
    if not (0 <= frames.start < frames.stop <= frame_count and frames.step == 1):
        raise LevelUnavailable(f"frames: got {frames.start}:{frames.stop}, expected A:B with A < B <= {frame_count}")
    return frames
