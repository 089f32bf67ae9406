"""The segments that a search codes in place of all of them: one of each kind of clip, from calm to wild."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from athcodec.encoding.model.motion import squared_bends
from athcodec.encoding.search.sample import PlantSample
from athcodec.encoding.segments.segment import Source
from athcodec.options import DEFAULT_SEGMENT, MAX_SEGMENT

SAMPLES = 3  # Largest number of segments that stand for a clip, or for several.
LEARNING_SEGMENTS = 4  # Largest number of segments of a clip that modes and a mean pose are made from.
TRIAL_FRAMES = 64  # Frames of a segment, or of a clip, that tell which of several ways makes the smaller file.
FRAMES = 12  # Frames of a segment by which is judged how parts move.
SPAN = MAX_SEGMENT  # Largest number of frames of a clip on which lengths of segments are compared.


@dataclass(frozen=True, eq=False)
class SegmentSample:
    """A segment that stands for others."""

    positions: np.ndarray  # (N, 3, T), in file order.
    frames: float  # Number of frames of the clip that the segment stands for.
    whole_loop: bool = False  # Whether the segment is all of a loop.
    segment: int = 0  # Number of the segment.

    @property
    def scale(self) -> float:
        """Number of frames that the sample stands for, over its own."""
        return self.frames / self.positions.shape[2]

    def of_plant(self, sample: PlantSample) -> SegmentSample:
        """Return the segment of a part of the plant, whose source goes on with these positions."""
        return replace(self, positions=sample.source.sharing(self.segment, self.positions[sample.vertices]))


def samples_of(source: Source) -> list[SegmentSample]:
    """Return the typical segments with their positions."""
    return [
        SegmentSample(_middle(source.positions(segment)), frames, source.is_whole_loop(segment), segment)
        for segment, frames in typical_segments(source)
    ]


def typical_segments(source: Source) -> list[tuple[int, int]]:
    """Return pairs of a segment and the number of frames of the file that it stands for: the middle segment of a single
    clip, or segments of a few of several clips, from calm to wild.
    """
    ranges = source.clip_range_segments
    middles = [start + len(segments) // 2 for start, segments in zip(source.clip_range_starts, ranges)]
    if len(middles) == 1:
        return [(middles[0], source.coded_frames)]
    lengths = np.array([(~source.repeats[segments[0][0] : segments[-1][1]]).sum() for segments in ranges])
    groups = np.array_split(
        np.argsort([_moved(source, segment) for segment in middles], kind="stable"), min(SAMPLES, len(middles))
    )
    return [(middles[group[len(group) // 2]], int(lengths[group].sum())) for group in groups]


def spread_samples(source: Source) -> list[SegmentSample]:
    """Return the segments of `spread_segments` with their positions."""
    return [
        SegmentSample(source.positions(segment), frames, source.is_whole_loop(segment), segment)
        for segment, frames in spread_segments(source)
    ]


def spread_segments(source: Source) -> list[tuple[int, int | float]]:
    """Return pairs of a segment and the number of frames of the file that it stands for: the segments of the middle
    SPAN frames of a clip, or of a few of several clips. They serve to compare lengths of segments on nearly the same
    frames.
    """
    spread: list[tuple[int, int | float]] = []
    for middle, frames in typical_segments(source):
        starts, segments = np.array(source.clip_range_starts), source.segments
        clip_range = int(np.searchsorted(starts, middle, side="right")) - 1
        first, count = int(starts[clip_range]), len(source.clip_range_segments[clip_range])
        low = (segments[first][0] + segments[first + count - 1][1] - SPAN) // 2
        chosen = [one for one in range(first, first + count) if low <= sum(segments[one]) // 2 < low + SPAN]
        scale = frames / sum(map(source.frames_of, chosen))
        spread += [(one, scale * source.frames_of(one)) for one in chosen]
    return spread


def usual_change(samples: Sequence[SegmentSample]) -> float:
    """Return the RMS change of velocity, in length per frame squared; infinite if all samples are too short."""
    long = [sample.positions for sample in samples if sample.positions.shape[2] > 2]
    squares = [squared_bends(positions).mean() / len(positions) for positions in long]
    return float(np.sqrt(np.mean(squares))) if squares else np.inf


def _middle(positions: np.ndarray) -> np.ndarray:
    """Return at most DEFAULT_SEGMENT frames of a segment, so that longer segments do not slow the search."""
    first = max(0, positions.shape[2] - DEFAULT_SEGMENT) // 2
    if positions.shape[2] <= DEFAULT_SEGMENT:
        return positions  # A copy would be another array than the one that all callers share.
    return np.ascontiguousarray(positions[:, :, first : first + DEFAULT_SEGMENT])


def _moved(source: Source, segment: int) -> float:
    """Return the RMS distance that vertices move from the first frame of a segment to its middle, in scene units."""
    start, stop = source.segments[segment]
    first, middle = (
        source.clip.motion.block(frame, frame + 1).astype(np.float64) for frame in (start, (start + stop) // 2)
    )
    return math.sqrt(((middle - first) ** 2).sum() / source.clip.vertex_count)
