"""Playing one clip of an .ath file: any frames at any level.

The `AthFile` behind a `Decoder` holds what all clips share, and reads and decodes the segments that the frames need.
"""

from __future__ import annotations

import threading
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property, partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from athcodec.decoding import core_file
from athcodec.decoding.affines import Affines, affines_of, residual_of
from athcodec.decoding.array_like import ArrayLike
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.blending import Blending, Share
from athcodec.decoding.facts import facts_of, parts_of
from athcodec.decoding.file_tables import Clip, Level
from athcodec.decoding.indexing import Frames, split_index
from athcodec.errors import LevelUnavailable
from athcodec.files.shown import Report
from athcodec.motion.clip import median_rate
from athcodec.motion.joining import metadata_of, wind_of
from athcodec.motion.units import LengthLike, length_of, scene_unit
from athcodec.options import real
from athcodec.untyped import JsonObject

if TYPE_CHECKING:
    from athcodec import Frame

MOST_SHOWN_BYTES = 4_000_000  # Size of a file that a notebook plays unasked.
WITHIN = '; level_within("5cm") returns the level for a length'
SHOWN_TYPES = (np.dtype(np.float32), np.dtype(np.float64))  # Types that the core writes itself.


class Decoder(ArrayLike):
    """One clip of an .ath file, a read-only array of shape (frames, vertices, 3); a context manager.

    Indices, `len` and iteration mean what they mean for a NumPy array, and decode only the segments of frames that they
    need. Operators, NumPy's functions and the methods of its arrays (`tree * 2`, `np.mean(tree, axis=0)`, `tree.max()`)
    decode all of it, `nbytes` bytes, each time, and return plain arrays: keep `np.asarray(tree)` where that is done
    often. `clip` is the clip and no method. Positions come in the source's vertex order, in scene units. Frames,
    segments, times and errors are those of the clip, counted from its first frame. `file` has what all clips share,
    such as vertices, levels and the rest pose. Threads may share a decoder. One of a path, a URL or bytes can be
    pickled; it opens the same file again, at the same clip and level.

    Parameters
    ----------
    file : AthFile
        An opened file; see `athcodec.open` for a path.
    clip : str, optional
        Name of the clip to play; by default the first.
    closes_file : bool
        Whether closing the decoder closes the file.
    level : int, optional
        The level to show; by default the deepest that is complete.

    Attributes
    ----------
    file : AthFile
        The file, which all decoders of its clips share.
    clip : Clip
        The clip that is played.

    Raises
    ------
    ClipUnavailable
        If no clip has that name.
    LevelUnavailable
        By methods that take a level or frames, if the file has no such ones, or was cut off before them.
    FormatError
        By the same methods, if the bytes are damaged.

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("grass")) as grass:
    ...     grass.shape, grass[10:20].shape, grass[-1, :100].shape, grass.at_level(1)[::30].dtype
    ((150, 1400, 3), (10, 1400, 3), (100, 3), dtype('float32'))
    >>> with athcodec.open(athcodec.sample_path("grass")) as grass:
    ...     (grass - grass[0]).shape, grass.T.shape, np.mean(grass, axis=(0, 1)).shape
    ((150, 1400, 3), (3, 1400, 150), (3,))
    """

    def __init__(self, file: AthFile, clip: str | None = None, *, closes_file: bool = False, level: int | None = None):
        """Play a clip of an opened file, by default its first one, at `level`, by default the deepest complete one.
        With `closes_file`, closing the decoder closes the file, too."""
        self.file, self._closes_file, self._level = file, closes_file, level
        if level is not None:
            self._level = self._checked_level(level)
        self.clip: Clip = file.clips[0] if clip is None else file.tables.clip_named(clip)
        self._lock = threading.Lock()
        # The segment that was decoded last, after its number and level.
        self._last: tuple[tuple[int, int] | None, core_file.Segment | None] = None, None
        self._blending = Blending(file)

    def play(self, name: str) -> Decoder:
        """Return a decoder for another clip of the same file; both may be used at the same time.

        Parameters
        ----------
        name : str
            Name of the clip.

        Returns
        -------
        Decoder
            It shares the file and is usable until that is closed.

        Raises
        ------
        ClipUnavailable
            If no clip has that name.
        """
        return Decoder(self.file, name, level=self._level)

    def at_level(self, level: int | None) -> Decoder:
        """Return a decoder that shows another level of the same clip; both may be used at the same time.

        Parameters
        ----------
        level : int or None
            Level of detail; None for the deepest that is complete.

        Returns
        -------
        Decoder
            It shares the file and is usable until that is closed.
        """
        return Decoder(self.file, self.clip.name, level=level)

    def close(self) -> None:
        """Close the file, if the decoder comes from `athcodec.open`."""
        if self._closes_file:
            self.file.close()

    def __enter__(self) -> Decoder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), closes_file=self._closes_file, level=self._level), (self.file, self.clip.name)

    def __repr__(self) -> str:
        """Return a line with the clip's name, size, level and error."""
        name = f" {self.clip.name!r}" if self.clip.name else ""
        last = self.file.level_count - 1
        shown = self.levels[last if self._level is None else self._level]
        unit = self.metadata.get("unit")
        return (
            f"<Decoder{name}: {self.frame_count:,} frames of {self.file.vertex_count:,} vertices, {self.dtype}, "
            f"level {shown.level} of 0 to {last}, {self.file.file_length:,} bytes, error at most "
            f"{shown.max_error:.3g}{f' {unit}' if unit else ''}>"
        )

    def _repr_html_(self) -> str:
        file, report = self.file, Report(parts_of(facts_of(self.file.name, self)))._repr_html_()
        if file.missing or file.tables.rest_is_missing or file.is_closed:
            return report
        if file.file_length > MOST_SHOWN_BYTES:
            return f"{report}<p>A large file: show() plays it here.</p>"
        return self.show()._repr_html_() + report

    def show(self, height: int = 480) -> Frame:
        """Return the plant in motion, for the last value of a notebook's cell.

        It is the viewer, in a frame that reaches nothing outside of itself.

        Parameters
        ----------
        height : int
            Height of the frame in pixels.

        Returns
        -------
        Frame
            A notebook plays it, and keeps the whole file in its output. In a terminal use `athcodec view`.
        """
        import athcodec  # The package knows its viewer, which stands above decoders.

        return athcodec.Frame(self, height)

    # ---- the array ----

    @property
    def shape(self) -> tuple[int, int, int]:
        """Frames, vertices and 3."""
        return self.frame_count, self.file.vertex_count, 3

    @property
    def dtype(self) -> np.dtype:
        """Type of the positions, float32 or float64."""
        return self.file.dtype

    @property
    def level(self) -> int:
        """The level that is shown: that of `at_level`, or the deepest that is complete."""
        return self.file.deepest if self._level is None else self._level

    def __len__(self) -> int:
        return self.frame_count

    def __getitem__(self, index: Any) -> Any:
        return self._indexed(index, self.level, self.dtype)

    def __iter__(self) -> Iterator[np.ndarray]:
        for _, block in self.blocks():
            yield from block

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> np.ndarray:
        if copy is False:
            raise ValueError("Decoder: got copy=False; expected None or True, because the array is decoded")
        return self.positions(dtype=dtype)

    # ---- what the clip holds ----

    @property
    def frame_count(self) -> int:
        """Frames of the clip, T."""
        return self.clip.frame_count

    @property
    def time(self) -> np.ndarray:
        """Seconds, (T,) float64."""
        return self.file.time[self.clip.first_frame : self.clip.first_frame + self.clip.frame_count]

    @property
    def fps(self) -> float:
        """Median frame rate, frames per second; 0 for a single frame."""
        return median_rate(self.time)

    @cached_property
    def segments(self) -> list[tuple[int, int]]:
        """(start, stop) frames of each segment."""
        starts = [start - self.clip.first_frame for start in self.file.tables.segment_starts(self.clip)]
        return list(zip(starts, starts[1:]))

    @property
    def metadata(self) -> JsonObject:
        """Unit, up axis and whatever else the source states, with this clip's values in place of the file's."""
        metadata = self.file.metadata
        return metadata_of(metadata, self.clip.name) if len(self.file.clips) > 1 else metadata

    @property
    def levels(self) -> list[Level]:
        """The stored levels, coarse to fine, with their errors in this clip."""
        return self.file.tables.levels_in(self.clip.segments)

    def level_for(
        self, distance: LengthLike, fov: float, height: float, pixels: float = 1.0, measure: str = "max"
    ) -> int:
        """Return the level to show at a distance.

        Parameters
        ----------
        distance : float or str
            Distance from the eye, in scene units or text such as "40m".
        fov : float
            Vertical field of view, radians.
        height : float
            Height of the screen, pixels.
        pixels : float
            Largest deviation of vertices on the screen.
        measure : {"max", "p99", "rms"}
            Statistic of the vertices' errors; with "p99", at most 1 % of them may deviate further.

        Returns
        -------
        int
            The coarsest stored level whose error is at most `pixels`; the deepest if none is.
        """
        length = length_of(distance, "distance").in_scene_units(scene_unit(self.metadata))
        return self.file.core.level_for(self.clip.segments, measure, length, fov, height, pixels)

    def level_within(self, max_error: LengthLike) -> int:
        """Return the coarsest stored level whose largest error in this clip is at most a length.

        Parameters
        ----------
        max_error : float or str
            Scene units, or text such as "5cm".

        Returns
        -------
        int
            Number of the level.

        Raises
        ------
        LevelUnavailable
            If the error of the deepest level is larger.
        BoundError
            If it is text that is no length, or has a unit and the file states none.
        """
        length = length_of(max_error, "max_error").in_scene_units(scene_unit(self.metadata))
        return self.file.level_within(length, self.clip.segments)

    def summary(self) -> str:
        """Return what `athcodec info` prints: the levels of the file with their bytes and errors.

        Returns
        -------
        str
            Lines of text, which a Python prompt shows as they are printed, and a notebook as tables.
        """
        return Report(parts_of(facts_of(self.file.name, self)))

    # ---- motion ----

    def positions(
        self, frames: Frames | None = None, level: int | None = None, dtype: npt.DTypeLike | None = None
    ) -> np.ndarray:
        """Return the positions of all vertices in one or several frames. Threads share the segments.

        Parameters
        ----------
        frames : int, slice or sequence of int, optional
            Frames as an index of the decoder has them; by default all.
        level : int, optional
            Level of detail; by default the decoder's own, the deepest that is complete unless `at_level` chose it.
        dtype : numpy dtype, optional
            By default that of the file, float32 or float64.

        Returns
        -------
        numpy.ndarray
            (N, 3) for one frame, else (frames, N, 3), scene units.
        """
        index = slice(None) if frames is None else frames
        return self._indexed(index, self._checked_level(level), np.dtype(dtype or self.dtype))

    def at(self, seconds: npt.ArrayLike) -> np.ndarray:
        """Return the positions at a time, interpolated between frames as players do.

        Parameters
        ----------
        seconds : float or array of float
            Times in seconds since the first frame. A loop goes on from its first frame; any other clip stays at its
            first frame before its beginning and at its last frame after its end.

        Returns
        -------
        numpy.ndarray
            Positions, `seconds.shape` + (N, 3), float32, scene units.

        Raises
        ------
        ValueError
            If a time is not a finite number.
        """
        times = np.asarray(seconds, np.float64)
        if not np.isfinite(times).all():
            raise ValueError(f"seconds: got {seconds!r}; expected finite numbers")
        shown = np.empty((*times.shape, self.file.vertex_count, 3), np.float32)
        for place in np.ndindex(times.shape):
            shown[place] = self.blended_places([(float(times[place]), 1.0)])
        return shown

    def blocks(
        self, level: int | None = None, dtype: npt.DTypeLike | None = None, frames: int | slice | None = None
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Yield positions in blocks, with one segment in memory at a time.

        Parameters
        ----------
        level, dtype, frames
            The level, the type of the arrays and the frames to decode, as for `positions`.

        Yields
        ------
        start : int
            Number of the block's first frame in the clip.
        block : numpy.ndarray
            Positions (k, N, 3) of the block's k frames, scene units.
        """
        level, (first, last) = self._checked_level(level), self._checked_run(frames)
        segments = self._segments_of(first, last)
        if len(segments) > 1:
            self.file.segments.prefetch(self._in_file(segments), level)
        for segment in segments:
            start, stop = self.segments[segment]
            low, high = max(start, first), min(stop, last)
            yield low, self.positions(slice(low, high), level, dtype)

    def wind_weights(self, strength: float, heading: float) -> dict[str, float]:
        """Return the clips to blend for a wind, with their weights.

        The weights are bilinear in the strength and heading of the clips' winds (metadata "strength" and "heading"):
        between the two strengths next to the wanted one, and at each between the two headings next to the wanted one on
        the circle. They change without a jump, and stay constant beyond the calmest and the wildest clip.

        Parameters
        ----------
        strength : float
            In the unit that the clips' strengths have.
        heading : float
            Degrees.

        Returns
        -------
        dict of str to float
            At most four clips by name, with weights above 0 that add up to 1; for `blended`.
        """
        winds = np.array([wind_of(metadata_of(self.file.metadata, clip.name)) for clip in self.file.clips])
        weights = core_file.wind_weights(winds, strength, heading)
        return {clip.name: float(weight) for clip, weight in zip(self.file.clips, weights) if weight > 0}

    def blended(
        self,
        weights: Mapping[str, float],
        seconds: float | Mapping[str, float],
        level: int | None | Mapping[str, int] = None,
    ) -> np.ndarray:
        """Return positions that blend several clips of the file, branch by branch.

        Branches stay attached, and edges along stems are as long as the weighted mean of those in the clips.

        Parameters
        ----------
        weights : mapping of str to float
            Weights by name of clip; up to four are above 0. They need not add up to 1.
        seconds : float or mapping of str to float
            Time in seconds since the first frame, one for all clips or one for each by its name; loops wrap around.
        level : int or mapping of str to int, optional
            Level of detail, one for all clips or one for each by its name; by default the deepest complete level.

        Returns
        -------
        numpy.ndarray
            Positions (N, 3) float32, scene units. If only one clip has a weight above 0, these are its own positions.

        Raises
        ------
        ValueError
            If no weight or more than four weights are above 0, or a weight is not finite.
        ClipUnavailable
            If no clip has that name.
        """
        used = {name: number for name, weight in weights.items() if not (number := real("weights", weight)) <= 0}
        if not 0 < len(used) <= core_file.BLEND_CLIPS or not np.isfinite(list(used.values())).all():
            raise ValueError(f"weights: got {dict(weights)}; expected 1 to {core_file.BLEND_CLIPS} that are above 0")
        return self._blending.positions(
            [
                Share(
                    self.file.tables.clip_named(name),
                    seconds[name] if isinstance(seconds, Mapping) else seconds,
                    self._checked_level(level.get(name) if isinstance(level, Mapping) else level),
                    weight,
                )
                for name, weight in used.items()
            ]
        )

    def blended_places(self, places: Sequence[tuple[float, float]], level: int | None = None) -> np.ndarray:
        """Return the clip at several times at once, blended along the branches as `blended` blends clips.

        Parameters
        ----------
        places : sequence of tuple of float
            Up to four: seconds since the first frame, and weight, above 0.
        level : int, optional
            Level of detail; by default the deepest that is complete.

        Returns
        -------
        numpy.ndarray
            (N, 3) float32, scene units.
        """
        weights = np.array([weight for _, weight in places], np.float64)
        if not 0 < len(places) <= core_file.BLEND_CLIPS or not (np.isfinite(weights) & (weights > 0)).all():
            raise ValueError(f"places: got {list(places)}; expected 1 to {core_file.BLEND_CLIPS} with weights above 0")
        level = self._checked_level(level)
        return self._blending.positions([Share(self.clip, seconds, level, weight) for seconds, weight in places])

    def level_rest(self, level: int | None = None) -> np.ndarray:
        """Return the reference pose of a level, which its maps move; see `AthFile.static.level_rest`.

        Parameters
        ----------
        level : int, optional
            Level of detail; by default the deepest that is complete.

        Returns
        -------
        numpy.ndarray
            (N, 3) float64, scene units.
        """
        return self.file.static.level_rest(self._checked_level(level))

    def affines(self, frame: int, level: int | None = None) -> Affines:
        """Return a frame as matrices: of nodes that move as one, and least-squares maps of exact stems (paper, eq. 2).

        Parameters
        ----------
        frame : int
            Negative from the end.
        level : int, optional
            Level of detail; by default the deepest that is complete.

        Returns
        -------
        Affines
            Maps from the reference pose of the level, `level_rest`, to the frame.
        """
        level, (index, _) = self._checked_level(level), self._checked_run(frame)
        with self._prepared(self.clip.first_segment + self._segment_of(index), level) as ready:
            return affines_of(self.file, ready, level, self.clip.first_frame + index, f"frame {index}")

    def residual(self, frame: int, level: int | None = None) -> np.ndarray:
        """Return what the matrices of `affines` leave out, in the space of the level's rest pose (paper, eq. 3).

        The matrix of a vertex's part, applied to this, gives the position at the deepest complete level.

        Parameters
        ----------
        frame, level
            As for `affines`.

        Returns
        -------
        numpy.ndarray
            (N, 3) float64, scene units.
        """
        positions = self.positions(frame, self.file.deepest, np.float64)
        return residual_of(self.affines(frame, level), positions, self.file.hierarchy.vertex_source, f"frame {frame}")

    def _checked_level(self, level: int | None) -> int:
        return self.level if level is None else self.file.tables.checked_level(level, WITHIN)

    def _indexed(self, index: Any, level: int, dtype: np.dtype) -> np.ndarray:
        """Return the items of the positions array that a NumPy index selects, after decoding only the frames that it
        needs."""
        frames, of_frames = split_index(index, self.frame_count)
        shown = np.empty((len(frames), *self.shape[1:]), dtype if dtype in SHOWN_TYPES else self.dtype)

        def rows(segment: int) -> slice:
            return slice(*(bisect_left(frames, edge) for edge in self.segments[segment - self.clip.first_segment]))

        def show(segment: int, ready: core_file.Segment) -> None:
            for row in range(rows(segment).start, rows(segment).stop):
                self.file.core.positions(ready, self.clip.first_frame + int(frames[row]), shown[row])

        def room(segment: int) -> np.ndarray | None:
            start, stop = self.segments[segment - self.clip.first_segment]
            out = shown[rows(segment)]
            return out if len(out) == stop - start and shown.dtype == self.dtype else None

        for segments in self._runs_of(frames):
            if len(segments) > 1:
                self.file.segments.show_all(segments, level, show, room)
            else:
                with self._prepared(segments.start, level, room(segments.start)) as ready:
                    if not ready.is_delivered:
                        show(segments.start, ready)
        return shown.astype(dtype, copy=False)[of_frames]

    def _runs_of(self, frames: np.ndarray) -> Iterator[range]:
        """Yield ranges of segments, numbered over the whole file, that hold the given ascending frames of the clip.
        Each range has no gap."""
        run, read = range(0), 0
        while read < len(frames):
            segment = self._segment_of(int(frames[read]))
            if run and segment > run.stop:
                yield self._in_file(run)
            run = range(run.start if run and segment == run.stop else segment, segment + 1)
            read = bisect_left(frames, self.segments[segment][1], read)
        if run:
            yield self._in_file(run)

    def _checked_run(self, frames: int | slice | None) -> tuple[int, int]:
        """Return the first frame of a run with step 1, and the frame behind its last one."""
        numbers, _ = split_index(slice(None) if frames is None else frames, self.frame_count)
        if len(numbers) and numbers[-1] - numbers[0] >= len(numbers):
            raise LevelUnavailable(f"frames: got {frames}; expected frames with step 1")
        return (int(numbers[0]), int(numbers[-1]) + 1) if len(numbers) else (0, 0)

    @contextmanager
    def _prepared(self, segment: int, level: int, to: np.ndarray | None = None) -> Iterator[core_file.Segment]:
        """Yield a segment of the file, prepared at a level, that only the caller uses until the block ends. The last
        one stays in memory for the next call.

        `to` is an array for the positions, as in `AthFile.segments.prepare`, whose exceptions this raises.
        """
        place = segment, level
        with self._lock:
            (last, ready), self._last = self._last, (None, None)
        if last != place or ready is None:
            ready = self.file.segments.prepare(*place, ready, to)
        try:
            yield ready
        finally:
            with self._lock:
                self._last = (None if ready.is_delivered else place), ready

    def _segments_of(self, first: int, last: int) -> range:
        """Return the clip's segments that hold the frames first to last - 1."""
        return range(self._segment_of(first), self._segment_of(last - 1) + 1) if first < last else range(0)

    def _in_file(self, segments: range) -> range:
        return range(self.clip.first_segment + segments.start, self.clip.first_segment + segments.stop)

    def _segment_of(self, frame: int) -> int:
        return bisect_right(self.segments, frame, key=itemgetter(0)) - 1
