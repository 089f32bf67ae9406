"""Files taken to pieces, put together again, and made from nothing, for tests of what no encoder would write.

`Parts` is a file in pieces whose checksums always fit. `still_file` is the least that a hierarchy and a number
of frames ask for: a plant that never leaves the origin, in which a test replaces the stream that it is about.
"""

from __future__ import annotations

import struct
import sys
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import numpy as np

import athcodec
from athcodec._native import BRANCH, LOOSE, SEGMENT_FRAMES, crc32c
from athcodec.decoding import container as ct
from athcodec.decoding.ath_file import AthFile
from athcodec.encoding.model.motion import Plan, SegmentMotion, StageStream
from athcodec.encoding.segments.predicted import trees_alone
from athcodec.encoding.segments.segmentation import balanced_segments
from athcodec.encoding.segments.time_bases import MOST_SAMPLE
from athcodec.encoding.streams import streams, writing

sys.path.append(str(Path(__file__).resolve().parent.parent))  # for spec, which is not installed

from spec.scripted import Draft, Entry, Join  # noqa: E402

COUNTS = (
    "vertex_count place_count branch_count frame_count segment_count full_level_count level_count clip_count "
    "layer_count is_float64 is_predicted max_error"
).split()
CHECKSUM_AT = 12


@dataclass
class Parts:
    """An .ath file in pieces."""

    header: ct.Header
    errors: np.ndarray
    chunks: list[tuple[ct.Chunk, bytes]]

    @classmethod
    def of(cls, data: bytes) -> Parts:
        file = AthFile(BytesIO(data), strict=True)
        return cls(file.tables.header, file.errors, [(chunk, file.chunks.payload(chunk)) for chunk in file.chunks])

    def file(self) -> bytes:
        """The bytes of a file whose table and checksums fit its chunks."""
        chunks = [replace(chunk, length=len(data), checksum=crc32c(data)) for chunk, data in self.chunks]
        front = ct.pack_front(replace(self.header), chunks, self.errors)
        return front + b"".join(data for _, data in self.chunks)

    def index(self, kind: int, level: int | None = None, segment: int = 0) -> int:
        return next(
            i
            for i, (c, _) in enumerate(self.chunks)
            if c.kind == kind and (level is None or (c.level, c.segment) == (level, segment))
        )

    def payload(self, kind: int, level: int | None = None) -> bytes:
        return self.chunks[self.index(kind, level)][1]

    def with_payload(self, kind: int, data: bytes, level: int | None = None) -> bytes:
        """The file with another content of one chunk."""
        i = self.index(kind, level)
        chunks = list(self.chunks)
        chunks[i] = chunks[i][0], data
        return Parts(self.header, self.errors, chunks).file()

    def with_chunks(self, chunks: list) -> bytes:
        return Parts(self.header, self.errors, chunks).file()

    def without(self, kind: int) -> bytes:
        """The file less all chunks of a kind."""
        return self.with_chunks([entry for entry in self.chunks if entry[0].kind != kind])


def draft_of(data: bytes) -> Draft:
    """The file with a front that can have any values."""
    parts = Parts.of(data)
    entries = tuple(Entry(chunk.kind, payload, chunk.stage, chunk.segment) for chunk, payload in parts.chunks)
    counts = {name: getattr(parts.header, name) for name in COUNTS} | {"stages": parts.header.stages}
    joins = tuple(Join(join % 128, join >= 128) for join in parts.header.joins.ravel().tolist())
    repeats = tuple(parts.header.repeats.astype(int).tolist())
    return Draft(counts, entries, tuple(ct.short_floats(parts.errors).ravel().tolist()), joins, repeats)


def with_header(data: bytes, **fields) -> bytes:
    """The file with other values in its header or other counts, and a checksum that fits."""
    draft = draft_of(data).with_header(**fields)
    same_table = not fields.keys() & {"level_count", "segment_count"}
    return (draft if same_table else replace(draft, errors=None, joins=None)).file()


def with_checksum(front: bytes) -> bytes:
    """The front with a checksum that fits."""
    head, tail = front[:CHECKSUM_AT], front[CHECKSUM_AT + 4 :]
    return head + struct.pack("<I", crc32c(head + bytes(4) + tail)) + tail


def opened(data: bytes, **options) -> athcodec.Decoder:
    return athcodec.open(BytesIO(data), **options)


def coded(clip: athcodec.MotionClip, path: Path, **options) -> athcodec.Decoder:
    """The clip encoded to a file, which is opened strictly."""
    return athcodec.open(athcodec.encode(clip, path, **options).path, strict=True)


# ---- files made from nothing ----


def roots(*counts: int) -> np.ndarray:
    """(B,) of BRANCH: stems of so many vertices, each its own root."""
    branches = np.zeros(len(counts), BRANCH)
    branches["parent"] = branches["attach"] = -1
    branches["count"] = counts
    return branches


def still_file(
    frames: int = 1,
    branches: np.ndarray | None = None,
    *,
    hierarchy: bytes | None = None,
    rest: bytes | None = None,
    time: bytes | None = None,
    stems: bytes | None = None,
) -> bytes:
    """One vertex, or `branches`, at the origin, one frame a second; or other payloads, `stems` at stage 0."""
    branches = roots(1) if branches is None else branches
    plan = Plan(branches, int(branches["count"].sum()))
    plan.set_rest(np.zeros((plan.vertex_count, 3)))
    store = writing.ChunkStore(BytesIO())
    store.add(ct.HIERARCHY, still_hierarchy(plan) if hierarchy is None else hierarchy)
    store.add(ct.REST, still_rest(plan) if rest is None else rest)
    store.add(ct.TIME, writing.pack_steady_time(np.arange(frames, dtype=float)) if time is None else time)
    stages, segments = plan.stage_count, balanced_segments(frames, -(-frames // SEGMENT_FRAMES))
    for index, (start, stop) in enumerate(segments):
        add_still_segment(store, plan, index, stop - start, stems)
    header = ct.Header(plan.vertex_count, plan.vertex_count, len(branches), frames, len(segments), stages, stages, 1.0)
    out = BytesIO()
    store.write(out, header, np.zeros((stages, len(segments), 3)))
    return out.getvalue()


def still_hierarchy(plan: Plan) -> bytes:
    numbers = (np.arange(count, dtype=np.int32) for count in (len(plan.branches), plan.vertex_count))
    return streams.encode_hierarchy(plan.branches, *numbers)


def still_rest(plan: Plan) -> bytes:
    coded = streams.encode_rest(plan.branches, 1.0, plan.rest)
    return writing.pack_rest(writing.Rest(np.zeros(3), 1.0, np.dtype(np.float32), coded.stream))


def add_still_segment(store: writing.ChunkStore, plan: Plan, index: int, frames: int, stems: bytes | None) -> None:
    motion = SegmentMotion(plan, frames, [StageStream(1.0)] * plan.stage_count)
    for stage in range(plan.stage_count):
        if plan.has_stems(stage):
            payload = writing.pack_stems(writing.StemsHead(1.0, 0), streams.encode_stems(motion, stage))
            store.add(ct.STEMS, payload if stems is None or stage > 0 else stems, stage, index)
        if plan.has_affines(stage):
            store.add(ct.AFFINES, streams.encode_affines(motion, stage), stage, index)
    is_root = plan.branches["parent"] < 0
    root = np.flatnonzero(is_root)[np.cumsum(is_root) - 1]
    trees = plan.branches["flags"][root] & LOOSE > 0
    if trees.any():
        alone = Plan(trees_alone(plan.branches, trees), int(plan.branches["count"][trees].sum()), predicted=True)
        alone.set_rest(np.zeros((alone.vertex_count, 3)), bases=False)
        still, limits = np.zeros((alone.vertex_count, 3, frames)), np.ones(alone.vertex_count)
        stream = streams.encode_predicted(alone, np.zeros(3), still, limits, 1.0, np.dtype(np.float32))[0]
        store.add(ct.PREDICTED, writing.pack_predicted(1.0, stream), plan.stage_count - 1, index)


def exact_rest_chunk(stream: bytes, dtype) -> bytes:
    """REST of Method 1, origin 0."""
    return writing.pack_rest(writing.Rest(np.zeros(3), 1.0, np.dtype(dtype), stream, exact=True))


def basis_chunk(stream: bytes, frames: int) -> bytes:
    """STEMS of stage 0 of the one vertex, which makes the integers of a learned basis of rank 1 its x."""
    plan = Plan(roots(1), 1)
    plan.set_rest(np.zeros((1, 3)))
    learned = StageStream(1.0, temporal=np.ones((1, frames)))
    motion = SegmentMotion(plan, frames, [learned, StageStream(1.0)])
    motion.tracks[0, 1, 0, 0] = MOST_SAMPLE
    head = writing.StemsHead(1.0, 0, ct.BASIS_AS_SAMPLES, 1, stream)
    return writing.pack_stems(head, streams.encode_stems(motion, 0))
