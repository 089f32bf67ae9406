"""How a clip is cut into segments, each of which can be decoded on its own (FORMAT.md, "Counts" and "Limits")."""

from __future__ import annotations

from athcodec._native import PIECE_VERTICES
from athcodec.options import DEFAULT_SEGMENT, MAX_SEGMENT

SEGMENT_BYTES = 128 << 20
SMALL_BYTES = 32 << 20  # of the float32 positions of a clip that may be one segment of MAX_SEGMENT frames


def decoding_bytes(vertex_count: int, frames: int) -> int:
    """Memory that decoding a segment takes, at most: integers, two sets of positions, bases."""
    return vertex_count * (3 * frames * (4 + 8 + 8) + 8 * PIECE_VERTICES)


def split_segments(
    frame_count: int, vertex_count: int, limit: int | None = None, memory: int = 2 << 30
) -> list[tuple[int, int]]:
    """Balanced runs of at most `limit` frames, fewer where a run's float32 positions would exceed 128 MiB, or where a
    decoder would need more than `memory` bytes. None: DEFAULT_SEGMENT, or all of a short and small clip."""
    if limit is None:
        short = frame_count <= MAX_SEGMENT and 12 * vertex_count * frame_count <= SMALL_BYTES
        limit = MAX_SEGMENT if short else DEFAULT_SEGMENT
    limit = max(1, min(limit, SEGMENT_BYTES // (12 * vertex_count)))
    while limit > 1 and decoding_bytes(vertex_count, limit) > memory:
        limit -= 1
    return balanced_segments(frame_count, -(-frame_count // limit))


def balanced_segments(frame_count: int, count: int) -> list[tuple[int, int]]:
    """`count` runs (start, stop) of frames, as long as each other but for one frame."""
    return [(frame_count * i // count, frame_count * (i + 1) // count) for i in range(count)]
