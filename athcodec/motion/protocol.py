"""A motion as those who show, write or measure it see it, whether it comes from a source or from an .ath file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import numpy as np

from athcodec.motion.clip import ClipRange
from athcodec.untyped import JsonMapping


class Motion(Protocol):
    """A `MotionClip`, a `ClipView`, or what has the same members; N vertices, T frames, lengths in scene units."""

    @property
    def vertex_count(self) -> int:
        """Vertices, N."""

    @property
    def frame_count(self) -> int:
        """Frames of all clips, T."""

    @property
    def dtype(self) -> np.dtype:
        """Type of the positions, float32 or float64."""

    @property
    def rest(self) -> np.ndarray:
        """Rest pose, (N, 3)."""

    @property
    def time(self) -> np.ndarray:
        """Seconds of the frames, (T,) float64."""

    @property
    def fps(self) -> float:
        """Frames per second."""

    @property
    def vertex_branch(self) -> np.ndarray | None:
        """The branch of each vertex, (N,) int32; None: no branches are known."""

    @property
    def branch_parent(self) -> np.ndarray | None:
        """The parent of each branch, (B,) int32, -1 for a root."""

    @property
    def branch_count(self) -> int:
        """Branches, B; 0: none are known."""

    @property
    def stem_index(self) -> np.ndarray | None:
        """Place of each vertex on its stem, (N,) int32; None: their order says it."""

    @property
    def edges(self) -> np.ndarray | None:
        """Vertex numbers of both ends, (E, 2)."""

    @property
    def faces(self) -> np.ndarray | None:
        """Vertex numbers of the corners, (F, k), if all faces have as many."""

    @property
    def polygons(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Faces of any sizes: corners per face (F,), and the vertex of each corner (C,)."""

    @property
    def attributes(self) -> Mapping[str, np.ndarray]:
        """Named static arrays."""

    @property
    def metadata(self) -> JsonMapping:
        """Unit, up axis and whatever else the source states."""

    @property
    def clip_ranges(self) -> Sequence[ClipRange]:
        """The clips, one after the other."""

    @property
    def clip_range_frames(self) -> Sequence[tuple[int, int]]:
        """(start, stop) frames of each clip."""

    def block(self, start: int, stop: int) -> np.ndarray:
        """Return the positions of frames `start` to `stop - 1`, (stop - start, N, 3)."""

    def blocks(self) -> Iterator[tuple[int, np.ndarray]]:
        """Yield the first frame and the positions, (k, N, 3), of one run of frames after the other."""
