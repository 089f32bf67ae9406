"""Some frames of an .ath file at one depth, in the shape of a clip: what exporters write.

It decodes nothing itself (decoder.py) and knows no file format (exporters/).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from athcodec.clip import polygons
from athcodec.decoder import Affines, Decoder
from athcodec.errors import LevelUnavailable


class Excerpt:
    """Frames `frames` of `decoder` at level `depth` (None: the deepest complete one), vertices in the source's order.

    It has the names and the meanings of MotionClip, `affines` besides. Frame 0 is the first of the excerpt; time and
    metadata["start_frame"] are those that it has in the whole clip. Raises LevelUnavailable where depth or frames do
    not exist.
    """

    def __init__(self, decoder: Decoder, depth: int | None = None, frames: range | None = None):
        self.decoder = decoder
        self.depth = decoder.deepest if depth is None else depth
        self.frames = range(decoder.frame_count) if frames is None else frames
        if not 0 <= self.depth < decoder.level_count:
            raise LevelUnavailable(f"depth: got {depth}; expected 0 to {decoder.level_count - 1}")
        if not (0 <= self.frames.start < self.frames.stop <= decoder.frame_count and self.frames.step == 1):
            raise LevelUnavailable(f"frames: got {self.frames.start}:{self.frames.stop}, expected A:B with A < B <= "
                                   f"{decoder.frame_count}")

    @property
    def frame_count(self) -> int:
        return len(self.frames)

    @property
    def vertex_count(self) -> int:
        return self.decoder.vertex_count

    @property
    def branch_count(self) -> int:
        return self.decoder.branch_count

    @property
    def dtype(self) -> np.dtype:
        return self.decoder.dtype

    @property
    def max_error(self) -> float:
        """The largest distance of any vertex in any frame of the whole file at this depth from the source."""
        return self.decoder.depths[self.depth].max_error

    @property
    def time(self) -> np.ndarray:
        return self.decoder.time[self.frames.start : self.frames.stop]

    @property
    def fps(self) -> float:
        """Frames per second: what the source said, else the median rate of the file, else 30."""
        said = self.metadata.get("fps")
        is_number = isinstance(said, (int, float)) and not isinstance(said, bool) and 0 < said < float("inf")
        return float(said) if is_number else self.decoder.fps or 30.0

    @cached_property
    def metadata(self) -> dict[str, Any]:
        return dict(self.decoder.metadata)

    @property
    def rest(self) -> np.ndarray:
        return self.decoder.rest

    @property
    def vertex_branch(self) -> np.ndarray:
        return self.decoder.vertex_branch

    @property
    def branch_parent(self) -> np.ndarray:
        return self.decoder.branch_parent

    @property
    def stem_index(self) -> np.ndarray | None:
        return self.decoder.stem_index

    @property
    def edges(self) -> np.ndarray | None:
        return self.decoder.edges

    @property
    def faces(self) -> np.ndarray | None:
        return self.decoder.faces

    @property
    def attributes(self) -> dict[str, np.ndarray]:
        return self.decoder.attributes

    @property
    def polygons(self) -> tuple[np.ndarray, np.ndarray] | None:
        return polygons(self.faces, self.attributes)

    def block(self, start: int, stop: int) -> np.ndarray:
        """Frames start to stop - 1 of the excerpt, (stop - start, N, 3)."""
        return self.decoder.positions(slice(self.frames.start + start, self.frames.start + stop), self.depth)

    def blocks(self) -> Iterator[tuple[int, np.ndarray]]:
        """(start, (k, N, 3)) over all frames, one segment in memory at a time."""
        for start, block in self.decoder.blocks(self.depth, frames=slice(self.frames.start, self.frames.stop)):
            yield start - self.frames.start, block

    def affines(self, frame: int) -> Affines:
        """What moves as one in frame `frame` of the excerpt; see Decoder.affines."""
        return self.decoder.affines(self.frames.start + frame, self.depth)
