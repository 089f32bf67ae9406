"""Valid files that were made to be slow, and small ones that announce much. No encoder would write any of them.

SLOW: functions of a scale, where everything is twice as much at 2 as at 1. LYING: functions without arguments.
"""

from __future__ import annotations

import json
import struct
from io import BytesIO

import numpy as np
import zstandard
from files import Parts, exact_rest_chunk, roots, still_file, with_header
from plants import awkward

import athcodec
from athcodec._native import BRANCH
from athcodec.decoding import container as ct
from athcodec.encoding.model.motion import Plan
from athcodec.encoding.streams import streams, writing

SHEET, WHOLE = 1, 4


def branches_of(parents: np.ndarray, counts, flags=0) -> np.ndarray:
    """(B,) of BRANCH: each on the first vertex of its parent's stem."""
    branches = np.zeros(len(parents), BRANCH)
    branches["parent"], branches["count"], branches["flags"], branches["lag"] = parents, counts, flags, 1
    first = np.cumsum(branches["count"]) - branches["count"]
    branches["attach"] = np.where(parents < 0, -1, first[parents])
    return branches


def on_one_vertex(count: int, vertices: int, flags: int = 0) -> np.ndarray:
    """Stems of `vertices` on a root of one vertex."""
    parents = np.append(-1, np.zeros(count, int))
    return branches_of(parents, np.append(1, np.full(count, vertices)), np.append(0, np.full(count, flags)))


# ---- rest poses with chosen gaps ----


def gap_hash(gaps: np.ndarray) -> np.ndarray:
    """That of the core's table of bases: (n, count) to (n,) uint32."""
    value = np.full(len(gaps), 2166136261, np.uint32)
    for column in gaps.T.astype(np.uint32):
        value = (value ^ column) * np.uint32(16777619)
    return value ^ (value >> np.uint32(15))


def random_gaps(rng: np.random.Generator, count: int, vertices: int) -> np.ndarray:
    """(count, vertices) integers of which each row adds up to 4 * vertices: what the core makes of them is the same."""
    places = rng.random((count, 4 * vertices - 1)).argpartition(vertices - 1, axis=1)[:, : vertices - 1]
    cuts = np.sort(places, axis=1) + 1
    edge = np.zeros((count, 1), int)
    return np.diff(np.concatenate([edge, cuts, edge + 4 * vertices], axis=1), axis=1)


def colliding_gaps(count: int, vertices: int = 10) -> np.ndarray:
    """Different rows whose hashes fall into the first sixteenth of the table."""
    rng, size, rows = np.random.default_rng(0), 16, np.zeros((0, vertices), int)
    while size < 2 * (count + 1):
        size *= 2
    while len(rows) < count:
        more = random_gaps(rng, 100_000, vertices)
        rows = np.unique(np.concatenate([rows, more[(gap_hash(more) & (size - 1)) < size // 16]]), axis=0)
    return rng.permutation(rows)[:count]


def stems_with_gaps(gaps: np.ndarray) -> bytes:
    """Straight stems on one vertex, their vertices so far apart."""
    branches = on_one_vertex(*gaps.shape)
    rest = np.zeros((1 + gaps.size, 3))
    rest[1:, 0] = np.cumsum(gaps, axis=1).ravel()
    plan = Plan(branches, len(rest))
    stream = streams.encode_exact_rest(plan.branches, rest.astype(np.float32))
    return still_file(branches=branches, rest=exact_rest_chunk(stream, np.float32))


# ---- made to be slow ----


def segments_of_one_frame(count: int) -> bytes:
    parts, store = Parts.of(still_file()), writing.ChunkStore(BytesIO())
    for chunk, payload in parts.chunks:
        if chunk.kind == ct.TIME:
            payload = writing.pack_steady_time(np.arange(count, dtype=float))
        for segment in range(count if chunk.is_motion else 1):
            store.add(chunk.kind, payload, chunk.stage, segment)
    out = BytesIO()
    store.write(out, ct.Header(1, 1, 1, count, count, 2, 2, 1.0), np.zeros((2, count, 3)))
    return out.getvalue()


def a_chain(count: int) -> bytes:
    return still_file(branches=branches_of(np.arange(-1, count - 1), 1, np.append(WHOLE, np.zeros(count - 1, int))))


def nested_nodes(leaves: int) -> bytes:
    """Every level but the last has a map over nearly all of the plant."""
    depth = 30
    parents = np.append(np.arange(-1, depth - 1), np.full(leaves, depth - 1))
    return still_file(branches=branches_of(parents, 1))


def a_chain_of_sheets(count: int) -> bytes:
    flags = np.full(count, SHEET)
    flags[0] |= WHOLE
    return still_file(frames=8, branches=branches_of(np.arange(-1, count - 1), 64, flags))


def unknown_chunks(count: int) -> bytes:
    parts = Parts.of(still_file())
    return parts.with_chunks(parts.chunks + [(ct.Chunk(0x8064, ct.NO_LEVEL, 0, 0, 0), b"")] * count)


def noise(frames: int) -> bytes:
    """Corrections at nearly every vertex in every frame."""
    clip = awkward(3, branches=12, longest=9, frames=frames, motion="noise")
    return athcodec.encode(clip, rel_error=1e-3, effort="fast")


SLOW = {
    "stems whose gaps collide in the table of bases": lambda scale: stems_with_gaps(colliding_gaps(15_000 * scale)),
    "stems of 64 vertices, no two alike": lambda scale: stems_with_gaps(
        random_gaps(np.random.default_rng(1), 250 * scale, 64)
    ),
    "segments of one frame": lambda scale: segments_of_one_frame(2000 * scale),
    "a chain of branches": lambda scale: a_chain(2000 * scale),
    "branches on one vertex": lambda scale: still_file(branches=on_one_vertex(20_000 * scale, 1)),
    "roots": lambda scale: still_file(branches=roots(*[1] * (20_000 * scale))),
    "thirty nodes over all of the plant": lambda scale: nested_nodes(10_000 * scale),
    "a chain of sheets": lambda scale: a_chain_of_sheets(100 * scale),
    "unknown chunks": lambda scale: unknown_chunks(50_000 * scale),
    "many vertices from no bytes": lambda scale: still_file(frames=256, branches=roots(*[64] * (20 * scale))),
    "noise": lambda scale: noise(256 * scale),
}


# ---- small files that announce much ----


def _attribute(name: str, size: int, claimed: int) -> tuple[ct.Chunk, bytes]:
    head = json.dumps({"name": name, "dtype": "<f4", "shape": [claimed // 4]}).encode()
    data = struct.pack("<H", len(head)) + head + zstandard.ZstdCompressor().compress(bytes(size))
    return ct.Chunk(ct.ATTRIBUTE, ct.NO_LEVEL, 0, len(data), 0), data


def _with_attributes(*attributes: tuple[ct.Chunk, bytes]) -> bytes:
    parts = Parts.of(still_file())
    return parts.with_chunks(parts.chunks + list(attributes))


def _counts(**fields: int) -> bytes:
    return with_header(still_file(), **fields)


LYING = {
    "more vertices than memory": lambda: still_file(branches=roots(3_000_000)),
    "as many vertices as memory allows": lambda: still_file(branches=roots(100_000)),
    "more branches than memory": lambda: still_file(branches=on_one_vertex(300_000, 1)),
    "as many branches as memory allows": lambda: still_file(branches=on_one_vertex(100_000, 1)),
    "a million frames": lambda: still_file(frames=1 << 18),
    "a header of many vertices": lambda: _counts(vertex_count=1 << 26),
    "a header of many branches": lambda: _counts(vertex_count=1 << 26, branch_count=1 << 20),
    "a header of many segments": lambda: _counts(frame_count=1 << 20, segment_count=1 << 20),
    "a header of many chunks": lambda: _counts(chunk_count=1 << 20),
    "an attribute that grows a thousandfold": lambda: _with_attributes(_attribute("a", 15 << 20, 15 << 20)),
    "an attribute beyond its limit": lambda: _with_attributes(_attribute("a", 100 << 20, 100 << 20)),
    "an attribute of another size": lambda: _with_attributes(_attribute("a", 15 << 20, 1 << 10)),
    "many attributes": lambda: _with_attributes(*(_attribute(f"a{i}", 1 << 20, 1 << 20) for i in range(200))),
    "many attributes of one name": lambda: _with_attributes(*(_attribute("a", 1 << 20, 1 << 20) for _ in range(50))),
    "too many attributes": lambda: _with_attributes(*(_attribute(f"a{i}", 4, 4) for i in range(300))),
}
