"""Tables at the front of an .ath file: its clips, and its levels with their sizes and errors."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from athcodec.decoding import container as ct
from athcodec.decoding.chunks import Chunks
from athcodec.decoding.file_bytes import FileBytes
from athcodec.errors import ClipUnavailable, LevelUnavailable, Truncated
from athcodec.options import whole


@dataclass(frozen=True)
class Level:
    """One level of detail of a file.

    Attributes
    ----------
    level : int
        Number of the level, 0 for the coarsest.
    name : str
        "depth 1" for branches down to an order; "all branches", or "layer 2 of 3" in a file with layers of precision;
        "lossless".
    nodes : int
        Parts that the plant is made of: exact stems, and subtrees that move as one.
    bytes : int
        Size of the file cut off after this level.
    max_error, p99_error, rms_error : float
        Largest distance of the vertices from the source, the distance that at most 1 % of all vertices in all frames
        exceed, and the root mean square, in scene units; as stored, at most 3.2 % above the measured ones.
    available : bool
        Whether this level and all coarser ones are in the file, undamaged.
    """

    level: int
    name: str
    nodes: int
    bytes: int
    max_error: float
    p99_error: float
    rms_error: float
    available: bool


@dataclass(frozen=True)
class Clip:
    """A clip of a file. Frames and segments are numbered over the whole file, one clip after the other.

    Attributes
    ----------
    name : str
        Empty if the only clip of a file has none.
    first_frame, frame_count, first_segment, segment_count : int
        Place of the clip in the file.
    loop : bool
        Whether the first frame follows the last.
    duration : float
        Seconds from the first frame to the last.
    seam_errors : tuple of float
        For a loop, how well each level of the full file keeps the step from the last frame to the first: the largest
        deviation of any vertex's step, in scene units. Empty for other clips.
    """

    name: str
    first_frame: int
    frame_count: int
    first_segment: int
    segment_count: int
    loop: bool
    duration: float
    seam_errors: tuple[float, ...] = field(repr=False)

    @property
    def segments(self) -> range:
        """Numbers of the clip's segments in the file."""
        return range(self.first_segment, self.first_segment + self.segment_count)


class FileTables:
    """Clips, levels and branches of a file, and which of its levels are there.

    damaged_from: the first level that is damaged, or None.
    """

    def __init__(self, file_bytes: FileBytes, chunks: Chunks, damaged_from: int | None = None) -> None:
        self._bytes, self._chunks, self._core = file_bytes, chunks, file_bytes.core
        self._level_count: int = self._core.info.level_count
        self._damaged_from = self._level_count if damaged_from is None else damaged_from

    @property
    def header(self) -> ct.Header:
        """The fixed header."""
        counts = [field.name for field in fields(ct.Header) if field.name not in ("stages", "joins", "repeats")]
        values = {name: getattr(self._core.info, name) for name in counts}
        return ct.Header(
            **values, stages=tuple(self._core.stages()), joins=self._core.joins(), repeats=self._core.repeats()
        )

    # ---- clips ----

    @cached_property
    def clips(self) -> tuple[Clip, ...]:
        """The clips in the file, in their order."""
        return tuple(
            Clip(
                *(clip.name.decode(), clip.first_frame, clip.frame_count, clip.first_segment, clip.segment_count),
                *(bool(clip.loop), clip.duration),
                tuple(
                    self._core.seam_error(index, level)
                    for level in range(self._core.info.full_level_count if clip.loop else 0)
                ),
            )
            for index, clip in enumerate(self._core.clips())
        )

    def clip_named(self, name: str) -> Clip:
        """Return the clip of this name. Raises ClipUnavailable if there is none."""
        for clip in self.clips:
            if clip.name == name:
                return clip
        names = ", ".join(repr(clip.name) for clip in self.clips if clip.name)
        raise ClipUnavailable(f"clip: got {name!r}; expected {names or 'none, the only one has no name'}")

    @cached_property
    def time(self) -> np.ndarray:
        """Seconds, (T,) float64, of the frames of all clips."""
        return self._core.times()

    def segment_starts(self, clip: Clip) -> list[int]:
        """Return the first frame of each segment of a clip, in the whole file, and the frame behind its last."""
        return self._core.segment_starts(clip.segments)

    # ---- levels ----

    @cached_property
    def _ends(self) -> np.ndarray:
        """Bytes of the file up to the end of each chunk in the table."""
        return self._chunks.table["offset"] + self._chunks.table["length"]

    @cached_property
    def _is_late(self) -> np.ndarray:
        """Which chunks of motion the file was cut off before."""
        return ct.is_motion(self._chunks.table["kind"]) & (self._ends > self._bytes.available_length)

    def available(self, level: int) -> bool:
        """Return whether all segments of all levels up to this one are there and undamaged."""
        return whole("level", level) < self.first_lacking

    @cached_property
    def first_lacking(self) -> int:
        """The first level that is incomplete or damaged."""
        late = () if self._bytes.complete else self._chunks.table["level"][self._is_late].tolist()
        return min([self._damaged_from, *late])

    def checked_level(self, level: int, hint: str = "") -> int:
        """Return the number of a stored level as an int. hint: the end of the message for what is no whole number.
        Raises LevelUnavailable if the file has no such level."""
        if not 0 <= (level := whole("level", level, hint)) < self._level_count:
            raise LevelUnavailable(f"level: got {level}; expected 0 to {self._level_count - 1}")
        return level

    @property
    def deepest(self) -> int:
        """The deepest complete level. Raises Truncated if not even level 0 is complete."""
        if self.first_lacking == 0:
            raise Truncated(
                f"level 0: got {self._bytes.available_length} bytes; expected at least {self._level_end(0)}"
            )
        return self.first_lacking - 1

    @property
    def rest_is_missing(self) -> bool:
        """Whether the file was cut off before the rest pose of the source, which stands behind the motion."""
        return self._chunks.lacks(ct.SOURCE_REST)

    @cached_property
    def missing(self) -> str:
        """A line that says what a cut-off or damaged file lacks; "" if it is complete."""
        late = self._chunks.table[self._is_late]
        parts = []
        for level in np.unique(late["level"]).tolist():
            segments = late["segment"][late["level"] == level]
            first, last = int(segments.min()), int(segments.max())
            parts.append(f"level {level}: " + (f"segments {first}-{last}" if first < last else f"segment {first}"))
        if self._damaged_from < self._level_count:
            parts.append(f"damaged from level {self._damaged_from}")
        if not parts and self._chunks.lacks(ct.ATTRIBUTE):
            parts.append("attributes behind the motion")
        if self.rest_is_missing:
            parts.append("rest pose of the source")
        if not self._bytes.complete and not parts:
            parts.append("what is behind the motion")
        return "; ".join(parts)

    def _level_end(self, level: int) -> int:
        """Return the bytes of the file cut off after a level."""
        kind = self._chunks.table["kind"]
        kept = ct.is_prelude(kind) | (ct.is_motion(kind) & (self._chunks.table["level"] <= level))
        return int(self._ends[kept].max())

    @cached_property
    def branches(self) -> np.ndarray:
        """Records of the branches in file order, (B,) of _native.BRANCH."""
        return self._core.branches()

    def nodes_at(self, level: int) -> int:
        """Return the number of parts at a stored level: exact stems, and subtrees that move as one."""
        parts = self._core.cut(self.checked_level(level))
        return len(self.exact_branches(parts)) + int((parts["branch"] >= 0).sum())

    def exact_branches(self, parts: np.ndarray) -> np.ndarray:
        """Return the branches, (K,) int64 in file order, whose stems are exact in a cut, `core.cut(level)`."""
        runs = parts[parts["branch"] < 0]
        run = np.searchsorted(runs["first"], self.branches["first"], "right") - 1
        ends = np.append(runs["first"] + runs["count"], 0)  # Index -1 stands for branches before the first run.
        return np.flatnonzero(self.branches["first"] < ends[run])

    def levels_in(self, segments: range) -> list[Level]:
        """Return the stored levels, coarse to fine. Their errors are those within `segments`, numbered over the whole
        file."""
        return [
            Level(
                level,
                self._core.level_name(level),
                self.nodes_at(level),
                self._level_end(level),
                *self._core.level_error(level, segments),
                self.available(level),
            )
            for level in range(self._level_count)
        ]

    @cached_property
    def errors(self) -> np.ndarray:
        """Errors of each level in each segment, (levels, segments, 3) float64, scene units: largest, 99th percentile,
        root mean square."""
        return self._core.errors()

    @property
    def joins(self) -> np.ndarray:
        """How each segment goes on from the end of the one before it, (levels, segments) uint8; 0: it does not."""
        return self._core.joins()
