"""From integers to the bytes of a stream: one function per kind of stream of FORMAT.md.

The models run in the C core; this module knows which arrays each takes. Containers add steps and flags.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field, replace

import numpy as np

from athcodec._native import BRANCH, CoreMetEnds, address, encode_stream, lib
from athcodec.encoding.model.motion import LearnedModes, Plan, SegmentMotion, zeros
from athcodec.encoding.streams.polygons import Mesh
from athcodec.files.threads import SERIAL, ThreadPool, ranges

PREDICTED_FRAMES = 8  # Frames of the source that prediction reads at once: a cache line of each row.


def encode_hierarchy(branches: np.ndarray, branch_source: np.ndarray, vertex_source: np.ndarray) -> bytes:
    """Code the hierarchy, and return the stream of the chunk HIERARCHY. `branches`: (B,) of _native.BRANCH;
    `branch_source`, `vertex_source`: the int32 permutations of Hierarchy, from file order to the source's.
    """
    return encode_stream(
        "ath_encode_hierarchy",
        1024 + 16 * len(branches) + 4 * len(vertex_source),
        address(branches, BRANCH, 1),
        len(branches),
        len(vertex_source),
        address(branch_source, np.int32, len(branches)),
        address(vertex_source, np.int32, len(vertex_source)),
    )


@dataclass
class CodedRest:
    """A rest pose at one precision: the stream, what it decodes to, (N, 3) float64, and its integers, (N, 3) int32, if
    another is coded about it."""

    step: float
    stream: bytes
    decoded: np.ndarray
    steps: np.ndarray | None = None
    mesh: Mesh | None = None  # Faces that the pose goes by.


def encode_rest(
    branches: np.ndarray,
    step: float,
    rest: np.ndarray,
    coarse: CodedRest | None = None,
    slack: float = 0.0,
    *,
    mesh: Mesh | None = None,
    shape_of: np.ndarray | None = None,
) -> CodedRest:
    """Code the rest pose of a layer, and return its stream with what it decodes to. `rest`: (N, 3) float64 less the
    origin; `coarse`: the rest pose of the layer before, about which it is coded, or None.

    `slack`: how far from its place a vertex may be put to save bits; `mesh`: faces by which positions are predicted;
    `shape_of`: what find_copies returns; copies that differ by too much are coded like other branches.
    """
    decoded, steps, moved = np.zeros_like(rest), np.zeros(rest.shape, np.int32), np.empty_like(rest)
    with nullcontext() if mesh is None else mesh.lock:
        data = encode_stream(
            "ath_encode_rest",
            1024 + 8 * rest.size,
            address(branches, BRANCH, 1),
            len(branches),
            step,
            slack,
            None if mesh is None else mesh.address,
            None if coarse is None else address(coarse.steps, np.int32, rest.size),
            None if coarse is None else address(coarse.decoded, np.float64, rest.size),
            None if shape_of is None else address(shape_of, np.int32, len(branches)),
            address(steps, np.int32, rest.size),
            address(rest, np.float64, rest.size),
            address(moved, np.float64, rest.size),
            address(decoded, np.float64, rest.size),
        )
    return CodedRest(step, data, decoded, steps, mesh)


def find_copies(branches: np.ndarray, step: float, rest: np.ndarray, slack: float) -> np.ndarray | None:
    """Return for each branch the branch whose shape it repeats, (B,) int32: its own number if others repeat it, or -1
    if it is coded alone. Return None if there are no copies. `rest`: (N, 3) float64; `slack`: how far off a vertex may
    be put.
    """
    shape_of, uses = np.empty((2, len(branches)), np.int32)
    copies = lib.ath_find_copies(
        address(branches, BRANCH, 1),
        len(branches),
        address(rest, np.float64, rest.size),
        step,
        slack,
        address(uses, np.int32, len(branches)),
        address(shape_of, np.int32, len(branches)),
    )
    return shape_of if copies else None


def encode_source_rest(branches: np.ndarray, step: float, reference: np.ndarray, rest: np.ndarray) -> CodedRest:
    """Code the source's rest pose about the reference pose, and return its stream with what it decodes to. `reference`,
    `rest`: both poses, (N, 3) float64 less the origin, the first one as decoded.
    """
    decoded, turns, moved = np.zeros_like(rest), np.empty((len(branches), 9)), np.empty_like(rest)
    data = encode_stream(
        "ath_encode_source_rest",
        1024 + 8 * rest.size,
        address(branches, BRANCH, 1),
        len(branches),
        step,
        address(reference, np.float64, rest.size),
        address(rest, np.float64, rest.size),
        address(moved, np.float64, rest.size),
        address(turns, np.float64, turns.size),
        address(decoded, np.float64, rest.size),
    )
    return CodedRest(step, data, decoded)


def encode_exact_rest(branches: np.ndarray, pose: np.ndarray, mesh: Mesh | None = None) -> bytes:
    """Code a rest pose so that it comes back bit for bit, and return the stream. `pose`: (N, 3) float32 or float64,
    with the origin; `mesh`: its faces, by which positions are predicted, or None.
    """
    numbers = pose.astype(np.float64, order="C")
    return encode_stream(
        "ath_encode_exact_rest",
        1024 + 10 * pose.size,
        address(branches, BRANCH, 1),
        len(branches),
        None if mesh is None else mesh.address,
        pose.dtype == np.float64,
        address(numbers, np.float64, pose.size),
    )


def encode_times(time: np.ndarray) -> bytes:
    """Code times in seconds, (T,) float64, bit for bit."""
    return encode_stream("ath_encode_times", 1024 + 10 * time.size, time.size, address(time, np.float64, time.size))


def encode_temporal(steps: np.ndarray) -> bytes:
    """Code rows of a learned time basis as integers of 14 bits, (rows, frames) int32."""
    rank, frames = steps.shape
    return encode_stream(
        "ath_encode_temporal", 1024 + 8 * steps.size, rank, frames, address(steps, np.int32, steps.size)
    )


def encode_basis(exponents: np.ndarray, integers: np.ndarray) -> bytes:
    """Code the rows of a learned time basis as sums of waves, and return the stream. `exponents`: the step of each row
    in half octaves, (rows,) int32; `integers`: the rows in these steps, (rows, frames) int32.
    """
    rank, frames = integers.shape
    padded = np.concatenate([integers, np.zeros((-rank % 3, frames), np.int32)])
    return encode_stream(
        "ath_encode_basis",
        1024 + 8 * integers.size,
        rank,
        frames,
        address(exponents, np.int32, rank),
        address(padded, np.int32, padded.size),
    )


def encode_learned_modes(plan: Plan, learned_modes: LearnedModes | None) -> dict[int, bytes]:
    """Return the streams of learned modes as {stage: stream}, empty without learned modes."""
    if learned_modes is None:
        return {}
    capacity, arrays = 4096 + 8 * learned_modes.integers.size, _addresses(plan, learned_modes)
    return {
        stage: encode_stream("ath_encode_shapes", capacity, plan.core, *arrays, stage)
        for stage in learned_modes.stages(plan).tolist()
    }


def _addresses(plan: Plan, modes: LearnedModes | None) -> tuple[int | None, int | None, int | None]:
    """Return the addresses of three arrays of learned modes: counts, first modes and integers of the pieces. All are
    None without learned modes.
    """
    if modes is None:
        return None, None, None
    return (
        address(modes.counts, np.int32, len(plan.pieces)),
        address(modes.first, np.int64, len(plan.pieces)),
        address(modes.integers, np.int32, modes.integers.size),
    )


def encode_refined_modes(
    plan: Plan, modes: LearnedModes | None, coarse: LearnedModes | None, shift: int
) -> bytes | None:
    """Code the learned modes of a refinement about those of the layer before; None: there are none."""
    if modes is None:
        return None
    arrays = *_addresses(plan, modes), *_addresses(plan, coarse)
    return encode_stream("ath_encode_refined_shapes", 4096 + 8 * modes.integers.size, plan.core, *arrays, shift)


def encode_stems(segment: SegmentMotion, stage: int) -> bytes:
    """Code coefficients and tracks of one stage."""
    return _encode_stage("ath_encode_stems", segment, stage, segment.coefficients.size + segment.tracks.size)


def encode_refinement(segment: SegmentMotion, stage: int) -> bytes:
    """Code coefficients and tracks of a refinement."""
    return _encode_stage("ath_encode_refinement", segment, stage, segment.coefficients.size + segment.tracks.size)


def encode_affines(segment: SegmentMotion, stage: int) -> bytes:
    """Code the maps of the nodes of one stage."""
    return _encode_stage("ath_encode_affines", segment, stage, 4 * segment.node_tracks.size)


def _encode_stage(name: str, segment: SegmentMotion, stage: int, size: int) -> bytes:
    return encode_stream(name, 4096 + size, segment.plan.core, segment.motion, segment.integers, stage)


def encode_corrections(corrections: np.ndarray, vertex_count: int, frames: int) -> bytes:
    """Code corrections: (K, 6) int32 rows of (vertex, frame, x, y, z, width), sorted by vertex, then frame."""
    return encode_stream(
        "ath_encode_corrections",
        4096 + 16 * len(corrections),
        vertex_count,
        frames,
        address(corrections, np.int32, 6 * len(corrections)),
        len(corrections),
    )


def encode_predicted(
    plan: Plan, origin: np.ndarray, source: np.ndarray, limits: np.ndarray, step: float, dtype: np.dtype
) -> tuple[bytes, np.ndarray] | None:
    """Code the motion of a segment by prediction. Return two things: the stream, and the positions that it decodes to,
    (T, N, 3) of `dtype`. Return None if a step so large cannot keep the limits. `source`: (N, 3, T) float64 less the
    origin, some frames of an array in order; `limits`: the largest error of each vertex, (N,).
    """
    vertices, _, frames = source.shape
    row = source.strides[1]
    if source.strides != (3 * row, row, 8):
        source = np.ascontiguousarray(source)
        row = source.strides[1]
    memory = np.empty(lib.ath_predicted_memory(vertices) // 16 + 1, np.complex128)
    block, positions = np.empty((PREDICTED_FRAMES, vertices, 3)), zeros((frames, vertices, 3), dtype)
    capacity = 1024 + source.size
    while True:
        buffer = np.empty(capacity, np.uint8)
        size = lib.ath_encode_predicted(
            memory.ctypes.data,
            buffer.ctypes.data,
            capacity,
            plan.core,
            address(origin, np.float64, 3),
            frames,
            positions.dtype == np.float64,
            step,
            source.ctypes.data,
            row // source.itemsize,
            address(limits, np.float64, vertices),
            len(block),
            block.ctypes.data,
            positions.ctypes.data,
        )
        if size >= 0:
            return buffer[:size].tobytes(), positions
        if size < -1:
            return None
        capacity *= 4


def encode_exact(positions: np.ndarray, source: np.ndarray) -> bytes:
    """Code by what decoded positions differ from those of the source, so that the source comes back bit for bit, and
    return the stream. `positions`, `source`: (N, 3, T), both float32 or both float64.
    """
    vertices, _, frames = positions.shape
    return encode_stream(
        "ath_encode_exact",
        4096 + 3 * positions.size,
        vertices,
        frames,
        positions.dtype == np.float64,
        address(positions, positions.dtype, positions.size),
        address(source, positions.dtype, positions.size),
    )


@dataclass(frozen=True)
class MetEnds:
    """How the corrections of a segment meet those of the segments beside it.

    closed: the ends at which no footprint is cut off, FIRST and LAST. decided: (K, 6) int32 corrections in ascending
    order, which stand in the first frame of one segment as in the last of the other, or move parts as a whole; no two
    are of one vertex and frame.
    """

    closed: int = 0
    decided: np.ndarray = field(default_factory=lambda: np.empty((0, 6), np.int32))

    def with_moves(self, moves: np.ndarray) -> MetEnds:
        """Return the ends with corrections that move parts as a whole, (K, 6), unless others stand there."""
        places, moved = (rows[:, 0].astype(np.int64) << 32 | rows[:, 1] for rows in (self.decided, moves))
        moves = moves[~np.isin(moved, places)]
        return replace(self, decided=ascending(np.concatenate([self.decided, moves])))

    def of_vertices(self, start: int, stop: int) -> MetEnds:
        """Return the ends of some of the vertices, numbered from `start` on."""
        first, last = np.searchsorted(self.decided[:, 0], (start, stop))
        return MetEnds(self.closed, self.decided[first:last] - np.array([start, 0, 0, 0, 0, 0], np.int32))


FIRST = 1  # Bit of MetEnds.closed: the first frame of a segment.
LAST = 2  # Bit of MetEnds.closed: the last frame.
FREE_ENDS = MetEnds()


def find_corrections(
    positions: np.ndarray,
    source: np.ndarray,
    origin: np.ndarray,
    limit: float | np.ndarray,
    step: float,
    pool: ThreadPool = SERIAL,
    *,
    narrow: np.ndarray | bool = False,
    ends: MetEnds = FREE_ENDS,
) -> np.ndarray | None:
    """Return corrections that bring every vertex within its limit of the source, (K, 6) int32 rows (vertex, frame, x,
    y, z, width); None if this step cannot express them.

    `positions`: decoded, (N, 3, T); `source`: (N, 3, T) less the origin; `limit`: one length or (N,); `narrow`:
    vertices, (N,) bool, whose corrections may move one frame only; `ends`: how corrections go on from those of
    neighbouring segments.
    """
    vertices, _, frames = positions.shape
    limits = np.array(np.broadcast_to(limit, vertices), np.float64)
    of_one_frame = np.array(np.broadcast_to(narrow, vertices), np.uint8)

    def find(start: int, stop: int) -> np.ndarray | None:
        """Return the corrections of a range of vertices, or None if this step cannot express them."""
        met, part = ends.of_vertices(start, stop), positions[start:stop]
        decided = np.ascontiguousarray(met.decided, np.int32)
        rows = _rows(
            (stop - start) * frames,
            lambda rows, capacity: lib.ath_find_corrections(
                stop - start,
                frames,
                positions.dtype == np.float64,
                address(part, part.dtype, part.size),
                address(source[start:stop], np.float64, part.size),
                address(origin, np.float64, 3),
                address(limits[start:stop], np.float64, stop - start),
                address(of_one_frame[start:stop], np.uint8, stop - start),
                step,
                CoreMetEnds(decided.ctypes.data, len(decided), met.closed),
                rows,
                capacity,
            ),
        )
        if rows is not None:
            rows[:, 0] += start
        return rows

    parts = pool.map(find, ranges(vertices, 3 * frames))
    expressed = [rows for rows in parts if rows is not None]
    return np.concatenate(expressed) if len(expressed) == len(parts) else None


def apply_corrections(positions: np.ndarray, corrections: np.ndarray, step: float) -> None:
    """Add corrections to decoded positions, (N, 3, T), in place. `corrections`: (K, 6) int32; `step`: the length of 1
    in them.
    """
    lib.ath_apply_corrections(
        positions.shape[2],
        positions.dtype == np.float64,
        address(positions, positions.dtype, positions.size),
        step,
        address(corrections, np.int32, corrections.size),
        len(corrections),
    )


def find_rigid_corrections(
    parts: tuple[np.ndarray, np.ndarray],
    positions: np.ndarray,
    source: np.ndarray,
    origin: np.ndarray,
    limit: float | np.ndarray,
    step: float,
    *,
    pool: ThreadPool = SERIAL,
    narrow: bool = False,
    closed: int = 0,
) -> np.ndarray:
    """Return corrections, (K, 6) int32 sorted by vertex and frame, that move all vertices of a part alike. A part gets
    one where a vertex of it is beyond its limit of the source, if that brings the whole part within the limits.

    `parts`: the first vertex of each part, and its number of vertices; `positions`: decoded, (N, 3, T); `source`: (N,
    3, T) less the origin; `narrow`: whether corrections may move one frame only; `closed`: the ends as MetEnds has
    them.
    """
    vertices, _, frames = positions.shape
    limits = np.array(np.broadcast_to(limit, vertices), np.float64)
    first, counts = (np.ascontiguousarray(numbers, np.int32) for numbers in parts)

    def find(start: int, stop: int) -> np.ndarray:
        """Return the corrections of a range of parts."""
        rows = _rows(
            int(counts[start:stop].sum()) * frames,
            lambda rows, capacity: lib.ath_find_rigid_corrections(
                stop - start,
                address(first[start:stop], np.int32, stop - start),
                address(counts[start:stop], np.int32, stop - start),
                frames,
                positions.dtype == np.float64,
                address(positions, positions.dtype, positions.size),
                address(source, np.float64, positions.size),
                address(origin, np.float64, 3),
                address(limits, np.float64, vertices),
                narrow,
                step,
                closed,
                rows,
                capacity,
            ),
        )
        assert rows is not None  # The core leaves a part out that no correction serves.
        return rows

    per_part = 3 * frames * max(1, int(counts.sum()) // max(1, len(counts)))
    corrections = np.concatenate([np.empty((0, 6), np.int32), *pool.map(find, ranges(len(first), per_part))])
    return ascending(corrections)


def ascending(corrections: np.ndarray) -> np.ndarray:
    """Return corrections sorted by vertex, then frame."""
    return corrections[np.lexsort(corrections[:, 1::-1].T)]


def _rows(most: int, find: Callable[[int, int], int]) -> np.ndarray | None:
    """Return the corrections, (K, 6), that a function of the core finds; None: none serve. `find` takes an address and
    how many corrections have room there, and returns how many it wrote."""
    rows = np.empty((most, 6), np.int32)
    count = find(rows.ctypes.data, most)
    return None if count < 0 else rows[:count].copy()
