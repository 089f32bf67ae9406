"""How a clip is cut into segments, each of which can be decoded on its own (FORMAT.md, "Segments" and "Limits")."""

from __future__ import annotations

from athcodec._native import PIECE_VERTICES, SEGMENT_FRAMES

MIN_SEGMENT, MAX_SEGMENT, DEFAULT_SEGMENT = 16, SEGMENT_FRAMES, 128
SEGMENT_BYTES = 128 << 20


def decoding_bytes(vertex_count: int, frames: int) -> int:
    """Memory that decoding a segment takes, at most: integers, two sets of positions, bases."""
    return vertex_count * (3 * frames * (4 + 8 + 8) + 8 * PIECE_VERTICES)


def split_segments(
    frame_count: int, vertex_count: int, limit: int = DEFAULT_SEGMENT, memory: int = 2 << 30
) -> list[tuple[int, int]]:
    """Balanced runs of at most `limit` frames, fewer where a run's float32 positions would exceed 128 MiB, or where a
    decoder would need more than `memory` bytes."""
    limit = max(1, min(limit, SEGMENT_BYTES // (12 * vertex_count)))
    while limit > 1 and decoding_bytes(vertex_count, limit) > memory:
        limit -= 1
    return balanced_segments(frame_count, -(-frame_count // limit))


def balanced_segments(frame_count: int, count: int) -> list[tuple[int, int]]:
    """`count` runs (start, stop) of frames, as long as each other but for one frame."""
    return [(frame_count * i // count, frame_count * (i + 1) // count) for i in range(count)]
