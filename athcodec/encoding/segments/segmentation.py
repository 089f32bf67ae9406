"""How a clip is cut into segments, each of which can be decoded on its own (FORMAT.md, "Counts" and "Limits")."""

from __future__ import annotations

from athcodec._native import PIECE_VERTICES
from athcodec.options import DEFAULT_SEGMENT, MAX_SEGMENT

SEGMENT_BYTES = 128 << 20  # Largest number of bytes of a segment's float32 positions.
SMALL_BYTES = 32 << 20  # Bytes of float32 positions up to which segments are longer than DEFAULT_SEGMENT.


def decoding_bytes(vertex_count: int, frames: int) -> int:
    """Return the memory that decoding a segment takes at most: integers, two sets of positions, bases."""
    return vertex_count * (3 * frames * (4 + 8 + 8) + 8 * PIECE_VERTICES)


def split_segments(
    frame_count: int, vertex_count: int, limit: int | None = None, memory: int = 2 << 30
) -> list[tuple[int, int]]:
    """Return segments as pairs (start, stop) of frames, all of about the same length, at most `limit` frames. They are
    shorter if the float32 positions of one exceed 128 MiB, or if a decoder would need more than `memory` bytes. If
    `limit` is None, it is MAX_SEGMENT if such a segment is small, else DEFAULT_SEGMENT.
    """
    if limit is None:
        longest = -(-frame_count // -(-frame_count // MAX_SEGMENT))
        limit = MAX_SEGMENT if 12 * vertex_count * longest <= SMALL_BYTES else DEFAULT_SEGMENT
    limit = max(1, min(limit, SEGMENT_BYTES // (12 * vertex_count)))
    while limit > 1 and decoding_bytes(vertex_count, limit) > memory:
        limit -= 1
    return balanced_segments(frame_count, -(-frame_count // limit))


def balanced_segments(frame_count: int, count: int) -> list[tuple[int, int]]:
    """Return `count` runs (start, stop) of frames whose lengths differ by at most one frame."""
    return [(frame_count * i // count, frame_count * (i + 1) // count) for i in range(count)]
