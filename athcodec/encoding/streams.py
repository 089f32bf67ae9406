"""From integers to the bytes of a stream: one function per kind of stream of FORMAT.md.

The models run in the C core; this module knows which arrays each takes. What the bytes are wrapped in (steps, flags) is
the container's business. Reading streams is the core's.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field, replace

import numpy as np

from athcodec._native import BRANCH, CoreMetEnds, address, encode_stream, lib
from athcodec.encoding.learned_modes import LearnedModes
from athcodec.encoding.motion import Plan, SegmentMotion
from athcodec.encoding.polygons import Mesh
from athcodec.files.threads import SERIAL, ThreadPool, ranges


def encode_hierarchy(branches: np.ndarray, branch_source: np.ndarray, vertex_source: np.ndarray) -> bytes:
    """branches: (B,) of _native.BRANCH; the sources: the int32 permutations of hierarchy.Hierarchy."""
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
    """A rest pose at one precision: the stream, what it decodes to, (N, 3) float64, and its integers, (N, 3) int32,
    where another is coded about it."""

    step: float
    stream: bytes
    decoded: np.ndarray
    steps: np.ndarray | None = None
    connected: bool = False


def encode_rest(
    branches: np.ndarray,
    step: float,
    rest: np.ndarray,
    coarse: CodedRest | None = None,
    slack: float = 0.0,
    mesh: Mesh | None = None,
    shape_of: np.ndarray | None = None,
) -> CodedRest:
    """A rest pose, (N, 3) float64 less the origin; about that of the layer before, if there is one.

    slack: how far from its place a vertex may be put to save bits. mesh: that it goes by, if any.
    shape_of: as find_copies gives it; copies that are too far off are coded as other branches are.
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
    return CodedRest(step, data, decoded, steps, mesh is not None)


def find_copies(branches: np.ndarray, step: float, rest: np.ndarray, slack: float) -> np.ndarray | None:
    """(B,) int32, of each branch the one that it is a copy of, itself where others are copies of it, or -1; None: there
    are no copies."""
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
    """The source's rest pose about the reference pose as decoded, both (N, 3) float64 less the origin."""
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
    """The stream of a rest pose that comes back bit for bit: (N, 3) float32 or float64, origin included. mesh: that it
    goes by."""
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
    """The stream of times in seconds, (T,) float64, bit for bit."""
    return encode_stream("ath_encode_times", 1024 + 10 * time.size, time.size, address(time, np.float64, time.size))


def encode_temporal(steps: np.ndarray) -> bytes:
    """Rows of a learned temporal basis as stored integers of 14 bits, (rows, frames) int32."""
    rank, frames = steps.shape
    return encode_stream(
        "ath_encode_temporal", 1024 + 8 * steps.size, rank, frames, address(steps, np.int32, steps.size)
    )


def encode_basis(exponents: np.ndarray, integers: np.ndarray) -> bytes:
    """Rows of a learned temporal basis in waves: half octaves of their steps, (rows,) int32, and integers,
    (rows, frames) int32."""
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
    """Learned learned_modes by level; nothing where there are none."""
    if learned_modes is None:
        return {}
    pieces = len(plan.pieces)
    arrays = (
        address(learned_modes.counts, np.int32, pieces),
        address(learned_modes.first, np.int64, pieces),
        address(learned_modes.integers, np.int32, learned_modes.integers.size),
    )
    return {
        level: encode_stream("ath_encode_shapes", 4096 + 8 * learned_modes.integers.size, plan.core, *arrays, level)
        for level in learned_modes.levels(plan).tolist()
    }


def encode_refined_modes(
    plan: Plan, modes: LearnedModes | None, coarse: LearnedModes | None, shift: int
) -> bytes | None:
    """Learned modes of a refinement, all of its level, about those of the layer before; None where there are none."""
    if modes is None:
        return None
    pieces, known = len(plan.pieces), (None, None, None)
    if coarse is not None:
        known = (
            address(coarse.counts, np.int32, pieces),
            address(coarse.first, np.int64, pieces),
            address(coarse.integers, np.int32, coarse.integers.size),
        )
    return encode_stream(
        "ath_encode_refined_shapes",
        4096 + 8 * modes.integers.size,
        plan.core,
        address(modes.counts, np.int32, pieces),
        address(modes.first, np.int64, pieces),
        address(modes.integers, np.int32, modes.integers.size),
        *known,
        shift,
    )


def encode_stems(segment: SegmentMotion, level: int) -> bytes:
    """Coefficients and tracks of one level."""
    return encode_stream(
        "ath_encode_stems", 4096 + segment.coefficients.size, segment.plan.core, segment.motion, segment.integers, level
    )


def encode_refinement(segment: SegmentMotion, level: int) -> bytes:
    """Coefficients and tracks of a refinement."""
    return encode_stream(
        "ath_encode_refinement",
        4096 + segment.coefficients.size,
        segment.plan.core,
        segment.motion,
        segment.integers,
        level,
    )


def encode_affines(segment: SegmentMotion, level: int) -> bytes:
    """Maps of the nodes of one level."""
    return encode_stream(
        "ath_encode_affines",
        4096 + 4 * segment.node_tracks.size,
        segment.plan.core,
        segment.motion,
        segment.integers,
        level,
    )


def encode_corrections(corrections: np.ndarray, vertex_count: int, frames: int) -> bytes:
    """corrections: (K, 6) int32 rows of (vertex, frame, x, y, z, width), sorted by vertex, then frame."""
    return encode_stream(
        "ath_encode_corrections",
        4096 + 16 * len(corrections),
        vertex_count,
        frames,
        address(corrections, np.int32, 6 * len(corrections)),
        len(corrections),
    )


def encode_predicted(
    plan: Plan, origin: np.ndarray, source: np.ndarray, limits: np.ndarray, step: float, lattice: bool, dtype
) -> tuple[bytes, np.ndarray] | None:
    """Predicted motion of a segment, and the positions that it decodes to, (T, N, 3) of `dtype`.

    source: (T, N, 3) float64 less the origin; limits: (N,). None where steps so large cannot keep the limits.
    """
    frames, vertices, _ = source.shape
    memory = np.empty(lib.ath_predicted_memory(vertices) // 16 + 1, np.complex128)
    positions = np.empty(source.shape, dtype)
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
            lattice,
            address(source, np.float64, source.size),
            address(limits, np.float64, vertices),
            positions.ctypes.data,
        )
        if size >= 0:
            return buffer[:size].tobytes(), positions
        if size < -1:
            return None
        capacity *= 4


def encode_exact(positions: np.ndarray, source: np.ndarray) -> bytes:
    """What takes decoded positions, (N, 3, T) float32 or float64, to those of the source, bit for bit."""
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
        """And corrections that move parts as a whole, (K, 6), but for those where others stand."""
        taken, wanted = (rows[:, 0].astype(np.int64) << 32 | rows[:, 1] for rows in (self.decided, moves))
        moves = moves[~np.isin(wanted, taken)]
        return replace(self, decided=ascending(np.concatenate([self.decided, moves])))

    def of_vertices(self, start: int, stop: int) -> MetEnds:
        """The same for some of the vertices, numbered from `start` on."""
        first, last = np.searchsorted(self.decided[:, 0], (start, stop))
        return MetEnds(self.closed, self.decided[first:last] - np.array([start, 0, 0, 0, 0, 0], np.int32))


FIRST, LAST = 1, 2
FREE_ENDS = MetEnds()


def find_corrections(
    positions: np.ndarray,
    source: np.ndarray,
    origin: np.ndarray,
    limit: float | np.ndarray,
    step: float,
    pool: ThreadPool = SERIAL,
    narrow: np.ndarray | bool = False,
    ends: MetEnds = FREE_ENDS,
) -> np.ndarray | None:
    """Corrections, (K, 6) int32, that bring every vertex of (N, 3, T) positions within `limit` of the source; None
    where this step cannot express them. limit: one, or one each (N,).

    narrow: of which vertices, (N,) bool, corrections are to be of one frame. ends: how they meet those of the
    segments beside this one."""
    vertices, _, frames = positions.shape
    limits = np.array(np.broadcast_to(limit, vertices), np.float64)
    of_one_frame = np.array(np.broadcast_to(narrow, vertices), np.uint8)

    def found(start: int, stop: int) -> np.ndarray | None:
        some = slice(start, stop)
        met = ends.of_vertices(start, stop)
        rows = _corrections(positions[some], source[some], origin, limits[some], of_one_frame[some], step, met)
        if rows is not None:
            rows[:, 0] += start
        return rows

    parts = pool.map(found, ranges(vertices, 3 * frames))
    if any(rows is None for rows in parts):
        return None
    return np.concatenate(parts)


def apply_corrections(positions: np.ndarray, corrections: np.ndarray, step: float) -> None:
    """Moves (N, 3, T) positions by corrections of a step."""
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
    pool: ThreadPool = SERIAL,
    narrow: bool = False,
    closed: int = 0,
) -> np.ndarray:
    """Corrections, (K, 6), ascending, each of which moves all vertices of a part together, where one of `positions` is
    beyond its limit, and this brings all of them within. parts: first vertices and numbers of vertices; narrow:
    corrections are to be of one frame; closed: as MetEnds has it."""
    vertices, _, frames = positions.shape
    limits = np.array(np.broadcast_to(limit, vertices), np.float64)
    first, counts = (np.ascontiguousarray(numbers, np.int32) for numbers in parts)

    def found(start: int, stop: int) -> np.ndarray:
        return _rows(
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

    per_part = 3 * frames * max(1, int(counts.sum()) // max(1, len(counts)))
    corrections = np.concatenate([np.empty((0, 6), np.int32), *pool.map(found, ranges(len(first), per_part))])
    return ascending(corrections)


def ascending(corrections: np.ndarray) -> np.ndarray:
    """The same by vertex and frame."""
    return corrections[np.lexsort(corrections[:, 1::-1].T)]


def _rows(most: int, find: Callable[[int, int], int]) -> np.ndarray | None:
    """The corrections, (K, 6), at most so many, that a function of the core finds, which takes their place and how many
    have room; None where it finds that there are none that serve."""
    rows = np.empty((most, 6), np.int32)
    count = find(rows.ctypes.data, most)
    return None if count < 0 else rows[:count].copy()


def _corrections(
    positions: np.ndarray,
    source: np.ndarray,
    origin: np.ndarray,
    limits: np.ndarray,
    narrow: np.ndarray,
    step: float,
    ends: MetEnds,
) -> np.ndarray | None:
    vertices, _, frames = positions.shape
    decided = np.ascontiguousarray(ends.decided, np.int32)
    met = CoreMetEnds(decided.ctypes.data, len(decided), ends.closed)
    return _rows(
        vertices * frames,
        lambda rows, capacity: lib.ath_find_corrections(
            vertices,
            frames,
            positions.dtype == np.float64,
            address(positions, positions.dtype, positions.size),
            address(source, np.float64, positions.size),
            address(origin, np.float64, 3),
            address(limits, np.float64, vertices),
            address(narrow, np.uint8, vertices),
            step,
            met,
            rows,
            capacity,
        ),
    )
