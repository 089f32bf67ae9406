"""The motion model as an encoder runs it: the plan of a plant (pieces, nodes, bases) and the motion of one segment.

Follows FORMAT.md, "Plan" and "Reconstruction"; the arithmetic itself runs in the C core. `Plan` is what all segments
share. `SegmentMotion` owns the integers of one segment and turns positions into them (`analyse`), and them into what a
decoder will have (`pose`). Arrays over a segment are vertex-major, (vertices, 3, frames), in file order.
"""

from __future__ import annotations

import math
import mmap
from collections.abc import Callable, Sequence
from ctypes import addressof, c_size_t
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import DTypeLike

from athcodec._native import (
    BRANCH,
    NODE,
    PIECE,
    PIECE_VERTICES,
    RIGID,
    SEGMENT_FRAMES,
    SHAPE_MODES,
    SHORT_FLOATS,
    Coarse,
    CorePlan,
    Integers,
    Motion,
    Rounding,
    Stream,
    address,
    lib,
)
from athcodec.decoding import container as ct
from athcodec.decoding.container import from_short_float
from athcodec.encoding.model.kinds import plant_kinds
from athcodec.files.threads import SERIAL, ThreadPool, ranges

CoreOutput: TypeAlias = tuple[int | None, bool, int | None]
"""Where the core writes positions: pointer to the origin, whether they are float64, pointer to the positions."""

NO_OUTPUT: CoreOutput = (None, False, None)
NO_ROOT = -1  # Root of streams without a learned basis (core/model/motion.h).
RANGES = 24  # Parts of a plant of which threads take one at a time; more cost more calls, fewer leave threads idle.
LEAST_RANGE = 1024  # Vertices of the smallest such part, below which a call costs more than its work.
LEAST_PIECES = 3  # Pieces of a sample, if there are as many.
PERIOD = 128  # Vertices from one run of a sample to the next.
LARGE_BYTES = 1 << 19  # Bytes from which on an array has memory of its own.
RELEASING_BYTES = 32 << 20  # Bytes of an array before which memory that the allocator keeps is released.
_PRIVATE = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_ANONYMOUS") else {}


def zeros(shape: tuple[int, ...], dtype: DTypeLike = np.float64, *, sparse: bool = False) -> np.ndarray:
    """Return zeros. The memory of a large array goes back to the system with it, whereas allocators keep freed memory
    for each thread. `sparse`: whether most numbers stay 0; then memory is taken in small pages, and only where one is
    written.
    """
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if size < LARGE_BYTES:
        return np.zeros(shape, dtype)
    if size >= RELEASING_BYTES:
        release_memory()
    memory = mmap.mmap(-1, size, **_PRIVATE)
    if (pages := getattr(mmap, "MADV_NOHUGEPAGE" if sparse else "MADV_HUGEPAGE", None)) is not None:
        memory.madvise(pages)
    return np.frombuffer(memory, dtype).reshape(shape)


def release_memory() -> None:
    """Give memory that the allocator keeps for later arrays back to the system, if it is one that keeps much."""
    if (trim := getattr(lib, "malloc_trim", None)) is not None:
        trim(c_size_t(0))


class Waves(IntEnum):  # core/model/basis.h
    """Kinds of waves: eigenvectors of third differences, a Fourier series, modes of a free beam."""

    SMOOTH, PERIODIC, BEAM = range(3)


@lru_cache(16)
def waves_over_time(frames: int, kind: Waves = Waves.SMOOTH) -> np.ndarray:
    """Return orthonormal rows, (frames, frames) float64, with the decoder's bits."""
    waves = np.empty((frames, frames))
    lib.ath_waves(frames, kind, waves.ctypes.data)
    waves.setflags(write=False)
    return waves


class Plan:
    """Pieces, nodes and bases of a plant, from its branches and decoded rest pose.

    branches: (B,) of _native.BRANCH in file order. refined: of a refinement. predicted: of predicted motion, without
    bases. rest: (N, 3) float64, less the origin, and bases: once `set_rest` was called.
    """

    rest: np.ndarray
    bases: np.ndarray

    def __init__(
        self,
        branches: np.ndarray,
        vertex_count: int,
        pool: ThreadPool = SERIAL,
        refined: bool = False,
        predicted: bool = False,
        layer: int = 0,
    ):
        """Divide branches into pieces and nodes. `branches`: (B,) of _native.BRANCH in file order; `refined`: whether
        all pieces are of one stage, as in a refinement; `predicted`: whether stems have no streams, as in predicted
        motion; `layer`: the number of the layer, which decides what is rigid. Raises ValueError if the branches form no
        hierarchy.
        """
        self.branches, self.pool, self.predicted = branches, pool, predicted
        self.vertex_count = vertex_count
        piece_count = lib.ath_count_pieces(address(branches, BRANCH, 1), len(branches), vertex_count)
        if piece_count <= 0:
            raise ValueError("branches do not form a hierarchy in file order")
        node_count = lib.ath_count_nodes(address(branches, BRANCH, 1), len(branches))
        self.pieces = np.zeros(piece_count, PIECE)
        self.nodes = np.zeros(node_count, NODE)
        self.core = CorePlan(
            vertex_count=vertex_count,
            branch_count=len(branches),
            piece_count=piece_count,
            node_count=node_count,
            branches=branches.ctypes.data,
            pieces=self.pieces.ctypes.data,
            nodes=self.nodes.ctypes.data,
        )
        memory = np.empty(vertex_count, np.int32)
        lib.ath_build_plan(self.core, self.pieces.ctypes.data, self.nodes.ctypes.data, memory.ctypes.data, 1)
        lib.ath_plan_rigid(self.core, self.pieces.ctypes.data, layer)
        if refined:
            self.pieces["stage"], self.pieces["low_stage"], self.pieces["low_modes"] = self.stage_count - 1, -1, 0
        if predicted:
            lib.ath_without_stems(self.core, self.pieces.ctypes.data, self.nodes.ctypes.data)
        self.still_branches: np.ndarray | None = None  # (B,) bool: trees that stand as they are in the rest pose.
        self._samples: dict[int, PlanSample] = {}

    @property
    def height(self) -> int:
        """Depth of the deepest node; stages run from 0 to height + 1."""
        return self.core.height

    @property
    def stage_count(self) -> int:
        return self.height + 2

    @property
    def bases_bytes(self) -> int:
        """Bytes of the bases."""
        return 0 if self.bases is None else self.bases.nbytes

    def set_rest(self, rest: np.ndarray, bases: bool = True, like: Plan | None = None) -> None:
        """Take `rest` as the decoded rest pose, (N, 3) float64, and build the bases of the pieces on it if `bases` is
        true. `like`: a plan whose bases are used again if it has the same rest pose and the same pieces.
        """
        vertices, pieces = self.vertex_count, len(self.pieces)
        self.rest = np.ascontiguousarray(rest, np.float64)
        self.core.rest = at = address(self.rest, np.float64, 3 * vertices)
        lib.ath_plan_nodes(self.core, self.nodes.ctypes.data, 0, self.stage_count)
        if self.predicted or not bases:
            return
        gaps = np.empty(vertices, np.uint8)
        table = np.empty(lib.ath_basis_table_size(pieces), np.int32)
        size = lib.ath_basis_layout(self.pieces.ctypes.data, pieces, at, gaps.ctypes.data, table.ctypes.data)
        shape = ["first", "count", "modes", "basis"]  # Sheets and tubes alone have a basis that is not their modes.
        if (
            like is not None
            and like.rest is self.rest
            and not (like.is_rigid & ~self.is_rigid).any()
            and np.array_equal(like.pieces[shape], self.pieces[shape])
        ):
            self.bases, self.core.bases, self.pieces["rank"] = like.bases, like.core.bases, like.pieces["rank"]
            return
        self.bases = np.empty(size)

        def fill_modes(first: int, stop: int) -> None:
            work = np.empty(2 * PIECE_VERTICES**2)
            lib.ath_basis_modes(self.pieces.ctypes.data, first, stop, at, work.ctypes.data, self.bases.ctypes.data)

        def fill_sheets(first: int, stop: int) -> None:
            lib.ath_basis_sheets(self.pieces.ctypes.data, first, stop, at, self.bases.ctypes.data)

        for fill in fill_modes, fill_sheets:
            self.pool.map(fill, ranges(pieces, PIECE_VERTICES * PIECE_VERTICES))
        self.core.bases = self.bases.ctypes.data

    def forget_bases(self) -> None:
        """Free the bases of the pieces, without which nothing more can be analysed or posed on this plan."""
        self.bases, self.core.bases = np.empty(0), None

    @cached_property
    def piece_ranges(self) -> tuple[list[tuple[int, int]], list[tuple[int, int]], list[tuple[int, int]]]:
        """Return three lists of ranges (start, stop) of pieces, which have no piece in common: branches with large
        subtrees, to be processed first and in order; whole small subtrees, of which threads may then process several at
        a time; and trees that stand still.
        """
        most = max(LEAST_RANGE, self.vertex_count // RANGES)
        vertices = np.append(self.branches["first"], self.vertex_count).tolist()
        after = (np.arange(len(self.branches)) + self.branches["subtree"]).tolist()
        carrying, carried, standing = list[tuple[int, int]](), list[tuple[int, int]](), list[tuple[int, int]]()
        branch = 0
        is_still = np.zeros(len(after), bool) if self.still_branches is None else self.still_branches
        while branch < len(after):
            stop = after[branch]
            if is_still[branch]:
                standing.append((branch, stop))
                branch = stop
                continue
            if vertices[stop] - vertices[branch] > most and stop > branch + 1:
                stop = branch + 1
                carrying.append((branch, stop))
            else:
                while stop < len(after) and not is_still[stop] and vertices[after[stop]] - vertices[branch] <= most:
                    stop = after[stop]
                carried.append((branch, stop))
            branch = stop
        first_piece = np.searchsorted(self.pieces["branch"], np.arange(len(after) + 1)).tolist()

        def of_pieces(of_branches: list[tuple[int, int]]) -> list[tuple[int, int]]:
            return [(first_piece[start], first_piece[stop]) for start, stop in of_branches]

        return of_pieces(carrying), of_pieces(carried), of_pieces(standing)

    @cached_property
    def node_ranges(self) -> list[tuple[int, int]]:
        """Ranges (start, stop) of nodes that threads may process at the same time."""
        share = np.cumsum(self.nodes["count"]) // max(LEAST_RANGE, self.vertex_count // 4)
        bounds = np.unique(share, return_index=True)[1].tolist()
        return list(zip(bounds, [*bounds[1:], len(self.nodes)]))

    def sample(self, part: int) -> PlanSample:
        """Return a sample of about one piece in `part`, in short runs all along the plant."""
        if part in self._samples:
            return self._samples[part]
        pieces = self.pieces[self.pieces["first"] % PERIOD < PERIOD // part]
        # Long pieces that all begin at the start of a period would all be in the sample.
        pieces = pieces[:: max(1, int(pieces["count"].sum()) * part // (2 * self.vertex_count))]
        if len(pieces) < LEAST_PIECES:  # Few long pieces that begin elsewhere would leave one of them, calm or wild.
            stride = max(1, min(part, len(self.pieces) // LEAST_PIECES))
            pieces = self.pieces[stride // 2 :: stride].copy()
        first, count = np.cumsum(pieces["count"]) - pieces["count"], pieces["count"]
        vertices = np.arange(count.sum()) + np.repeat(pieces["first"] - first, count)
        pieces["first"] = first
        self._samples[part] = PlanSample(vertices, pieces, self.pool)
        return self._samples[part]

    @property
    def base_stage(self) -> np.ndarray:
        """Per piece the stage whose stream holds its tracks and first modes, (P,)."""
        return np.where(self.pieces["low_stage"] >= 0, self.pieces["low_stage"], self.pieces["stage"])

    @cached_property
    def first_rows(self) -> np.ndarray:
        """Per piece the row of its first mode in the coefficients of a segment, (P,) int32."""
        return (np.cumsum(self.ranks) - self.ranks).astype(np.int32)

    @property
    def ranks(self) -> np.ndarray:
        """Per piece the modes that it moves by, each a row of coefficients, (P,). They are known with the rest pose."""
        return np.where(self.is_rigid, 0, self.pieces["rank"])

    @property
    def is_rigid(self) -> np.ndarray:
        """Per piece whether it turns and moves as it is, (P,)."""
        return self.pieces["flags"] & RIGID > 0

    def levers(self) -> np.ndarray:
        """Return how far a turn by one radian moves each piece, (P,): the root of its mean moment of inertia."""
        pieces = self.pieces
        at = np.where(pieces["attach"] >= 0, pieces["attach"], pieces["first"])
        away = self.rest - np.repeat(self.rest[at], pieces["count"], axis=0)
        return np.sqrt(2 / 3 * np.add.reduceat((away**2).sum(axis=1), pieces["first"]))

    @cached_property
    def kinds(self) -> np.ndarray:
        """Per piece the number of the kind of plant that it belongs to, (P,)."""
        return plant_kinds(self.branches["parent"], self.branches["count"])[self.pieces["branch"]]

    @property
    def main_stage(self) -> int:
        """The stage whose stream holds the most rows."""
        low, rotations = np.minimum(self.pieces["low_modes"], self.ranks), self.is_rigid
        rows = np.bincount(self.base_stage, low + rotations, self.stage_count)
        return int((rows + np.bincount(self.pieces["stage"], self.ranks - low, self.stage_count)).argmax())

    def has_stems(self, stage: int) -> bool:
        """Return whether the stage has a coefficient stream."""
        return bool(((self.pieces["stage"] == stage) | (self.pieces["low_stage"] == stage)).any())

    def has_affines(self, stage: int) -> bool:
        """Return whether nodes of the stage have maps of their own."""
        return bool(((self.nodes["stage"] == stage) & (self.nodes["coded"] == 1)).any())

    def serves(self, kind: int, stage: int, shown: Sequence[int]) -> bool:
        """Return whether the chunks of a kind and stage are stored where these stages are shown."""
        if kind == ct.AFFINES:
            last = self.nodes["last_stage"][(self.nodes["stage"] == stage) & (self.nodes["coded"] == 1)].max(initial=-1)
            return any(stage <= one <= last for one in shown)
        return kind != ct.CORRECTIONS or stage in shown

    @property
    def stage_0_stands_alone(self) -> bool:
        """Whether nothing of stage 0 serves other stages, so that stage 1 may refine the rest pose."""
        return not self.has_stems(0) and not (self.nodes["last_stage"][self.nodes["stage"] == 0] > 0).any()


@dataclass(frozen=True)
class PlanSample:
    """Some pieces of a plan, whose vertices follow each other, and the places of these in the plan."""

    vertices: np.ndarray
    pieces: np.ndarray
    pool: ThreadPool


LEARNED_NUMBERS = 3 * SHAPE_MODES  # Numbers of a learned mode.


@dataclass(frozen=True)
class LearnedModes:
    """The learned modes of all pieces, a row each; the modes of a piece follow each other."""

    counts: np.ndarray  # (P,) int32, how many each piece has; 0: it keeps its cantilever modes.
    first: np.ndarray  # (P,) int64, row of each piece's first mode.
    integers: np.ndarray  # (K, LEARNED_NUMBERS) int32, as streams hold them: axis a of mode m at SHAPE_MODES a + m.
    units: np.ndarray  # (K, LEARNED_NUMBERS) float64 of unit length: axis a of mode m at 3 m + a.
    duals: np.ndarray  # Like units: map a piece's cantilever modes to the tracks of its learned modes.

    def stages(self, plan: Plan) -> np.ndarray:
        """Return the stages whose streams hold tracks of learned modes."""
        pieces, learned = plan.pieces, self.counts > 0
        full = learned & (pieces["low_stage"] >= 0) & (self.counts >= 3 * pieces["low_modes"])
        return np.union1d(plan.base_stage[learned], pieces["stage"][full])


@dataclass
class StageStream:
    """How one stage's integers are read: step in scene units, rotation step factor (0: no rotations), time basis."""

    step: float
    rotation_step_factor: float = 0.0
    temporal: np.ndarray | None = None  # (rank, frames) float64; None: waves, by the root.
    turn_step: float = 0.0  # Largest step of rotations of rigid pieces; 0: any.
    root: int = NO_ROOT  # Stage of the first stream whose learned basis begins with the same rows.


class SegmentMotion:
    """The quantised motion of one segment."""

    motion: Motion
    integers: Integers

    def __init__(
        self,
        plan: Plan,
        frames: int,
        streams: list[StageStream],
        learned_modes: LearnedModes | None = None,
        before: SegmentMotion | None = None,
        ratio: int = 1,
        *,
        periodic: bool = False,
    ):
        """Make room for the integers of a segment of `frames` frames, all 0. `streams`: how those of each stage are
        read; `before`: the integers of the layer that this one refines, or None; `ratio`: the step of that layer over
        the step of this one; `periodic`: whether waves go on from the last frame to the first. Raises ValueError for
        wrong numbers of frames or streams.
        """
        if not 1 <= frames <= SEGMENT_FRAMES or len(streams) != plan.stage_count:
            raise ValueError(
                f"segment of {frames} frames, {len(streams)} streams: expected 1 to {SEGMENT_FRAMES} "
                f"frames, {plan.stage_count} streams"
            )
        self.plan, self.frames, self.streams, self.learned_modes = plan, frames, streams, learned_modes
        core = plan.core
        self.coefficients = zeros((int(plan.ranks.sum()), 3, frames), np.int32, sparse=True)
        self.tracks = zeros((core.piece_count, 2, 3, frames), np.int32, sparse=True)
        node_count = 0 if before is not None else core.node_count  # Refinements have no maps.
        self.node_tracks = zeros((node_count, 4, 3, frames), np.int32, sparse=True)
        self.node_steps = np.zeros(node_count, np.int32)
        self._attach_caches: np.ndarray | None = None
        self.waves = waves_over_time(frames, Waves.PERIODIC if periodic else Waves.SMOOTH)
        self.node_waves = waves_over_time(frames, Waves.PERIODIC if periodic else Waves.BEAM)
        self.before, self.ratio = before, ratio
        self.coarse: Coarse | None = None
        self.known: np.ndarray | None = None
        self.predicted: np.ndarray | None = None
        self.predicted_tracks: np.ndarray | None = None
        if before is not None:
            self.predicted, self.predicted_tracks = (
                zeros(self.coefficients.shape, np.int32, sparse=True),
                zeros(self.tracks.shape, np.int32, sparse=True),
            )
            self.known = self._known(before)
            self.turn_steps = np.empty((core.piece_count, 3))
            self.nothing = np.zeros((core.longest, 3, frames), np.int32)
            layer = map(addressof, (before.plan.core, before.motion, before.integers))
            self.coarse = Coarse(*layer, self.turn_steps.ctypes.data, self.nothing.ctypes.data)
        self._bind()

    def _known(self, before: SegmentMotion) -> np.ndarray:
        """Return which pieces have integers in the layer before for the same functions of time as here, (P,) uint8."""
        same = np.array([stream.root == self.streams[-1].root for stream in before.streams])
        pieces = before.plan.pieces
        all_at_base = before.plan.ranks <= pieces["low_modes"]
        return (same[before.plan.base_stage] & (same[pieces["stage"]] | all_at_base)).astype(np.uint8)

    def waves_of(self, stream: StageStream) -> np.ndarray:
        """Return the waves of a stream, or what is learned in their place, (rank, frames)."""
        return self.waves if stream.temporal is None else stream.temporal

    def _bind(self) -> None:
        """Make the structs of the C core that point to the arrays of this segment."""
        self._c_streams = (Stream * len(self.streams))()
        self._temporal = []  # Arrays that the C structs point to.
        for c_stream, stream in zip(self._c_streams, self.streams):
            temporal = self.waves_of(stream)
            self._temporal.append(temporal)
            c_stream.step, c_stream.rotation_step_factor = stream.step, stream.rotation_step_factor
            c_stream.temporal, c_stream.temporal_rank = temporal.ctypes.data, len(temporal)
            c_stream.root, c_stream.turn_step = stream.root, stream.turn_step
        self.motion = Motion(
            streams=addressof(self._c_streams),
            waves=self.node_waves.ctypes.data,
            frames=self.frames,
            ratio=self.ratio,
            before=None if self.coarse is None else addressof(self.coarse),
            known=None if self.known is None else self.known.ctypes.data,
        )
        self.integers = Integers(
            self.coefficients.ctypes.data,
            self.tracks.ctypes.data,
            self.node_tracks.ctypes.data,
            self.node_steps.ctypes.data,
            first_rows=address(self.plan.first_rows, np.int32, 0),
        )
        if self.predicted is not None and self.predicted_tracks is not None:
            self.integers.predicted = self.predicted.ctypes.data
            self.integers.predicted_tracks = self.predicted_tracks.ctypes.data
        if self.learned_modes is not None:
            for name, array in (
                ("shape_counts", self.learned_modes.counts),
                ("shape_first", self.learned_modes.first),
                ("shapes", self.learned_modes.units),
                ("duals", self.learned_modes.duals),
            ):
                setattr(self.integers, name, array.ctypes.data)

    def forget_nodes(self) -> None:
        """Free the maps of nodes."""
        self.node_tracks, self.integers.node_tracks = np.empty(0, np.int32), None

    def forget_caches(self) -> None:
        """Free what pieces and maps of nodes are placed by."""
        self._attach_caches = self.motion.attach_caches = None

    def forget_before(self) -> None:
        """Free the layer before, which nothing more is predicted from, and what is predicted from it."""
        self.before = self.coarse = self.predicted = self.predicted_tracks = None
        self.motion.before = self.motion.known = None
        self.integers.predicted = self.integers.predicted_tracks = None

    def analyse(
        self,
        source: np.ndarray,
        rounding: Rounding,
        origin: np.ndarray | None = None,
        positions: np.ndarray | None = None,
        bent: bool = False,
    ) -> None:
        """Quantise the motion of the segment into its coefficients and tracks, in closed loop: each piece is fitted to
        what a decoder makes of those before it. Trees that stand still keep the rest pose, whatever their positions
        are.

        `source`: (N, 3, frames) float64 less the origin; `positions`: an array to be filled with what `pose` returns at
        the last stage, which needs `origin`, too, or None; `bent`: leave out rigid pieces on which nothing hangs.
        """
        at, out, place = self._source(source), NO_OUTPUT, None
        if positions is not None and origin is not None:
            out = _output(origin, positions)
            place = self._placing(self.plan.stage_count - 1, out)
        self._piecewise(
            lambda motion, first, stop: lib.ath_analyse(
                self.plan.core, motion, self.integers, first, stop, at, rounding, bent, *out
            ),
            place,
        )

    def analyse_nodes(
        self, source: np.ndarray, stage_steps: np.ndarray, rounding: Rounding, stage: int | None = None
    ) -> None:
        """Quantise the affine maps of all nodes, or of those of one stage, after `analyse` or `pose` was called (not
        needed for stage 0). `source`: (N, 3, frames) float64 less the origin; `stage_steps`: (stage_count,) float64 in
        scene units. A map's step is that of its stage over the root of its vertex count.
        """
        at, steps = self._source(source), address(stage_steps, np.float64, self.plan.stage_count)
        self._nodewise(
            lambda motion, first, stop: lib.ath_analyse_nodes(
                self.plan.core, motion, self.integers, first, stop, at, steps, rounding
            ),
            stage,
        )

    def clear_nodes(self) -> None:
        """Set the maps of the nodes to zero."""
        self.node_tracks.fill(0)
        self.node_steps.fill(0)

    def _piecewise(
        self, call: Callable[[Motion, int, int], None], of_still: Callable[[Motion, int, int], None] | None
    ) -> None:
        """Call `call` with a motion and each range of pieces that may move, so that pieces come after those that they
        hang on. `of_still` is called likewise for ranges that stand still, unless it is None.
        """
        if self._attach_caches is None:
            self._attach_caches = zeros((lib.ath_attach_cache_size(self.plan.core.attach_cache_rows, self.frames),))
            self.motion.attach_caches = self._attach_caches.ctypes.data
        carrying, carried, standing = self.plan.piece_ranges
        for first, stop in carrying:
            self._with_scratch(call)(first, stop)
        self.plan.pool.map(self._with_scratch(call), carried)
        if of_still is not None:
            self.plan.pool.map(self._with_scratch(of_still), standing)

    def _placing(self, stage: int, out: CoreOutput) -> Callable[[Motion, int, int], None]:
        """Return what places a range of pieces at a stage into `out`."""

        def place(motion: Motion, first: int, stop: int) -> None:
            lib.ath_pose(self.plan.core, motion, self.integers, first, stop, stage, *out)

        return place

    def _nodewise(self, call: Callable[[Motion, int, int], None], stage: int | None = None) -> None:
        """Call with a motion and each range of nodes, or each node of one stage."""
        plan = self.plan
        of_stage = [(n, n + 1) for n in np.flatnonzero(plan.nodes["stage"] == stage).tolist()]
        plan.pool.map(self._with_scratch(call), plan.node_ranges if stage is None else of_stage)

    def _with_scratch(self, call: Callable[[Motion, int, int], None]) -> Callable[[int, int], None]:
        """Return a function of a range of pieces or nodes that calls `call` with this motion and the range, and gives
        it scratch memory that no other thread uses.
        """

        def run(first: int, stop: int) -> None:
            motion = Motion.from_buffer_copy(self.motion)
            layers = 1 + (self.before is not None)
            work = np.empty(layers * lib.ath_motion_work(self.plan.core.longest, self.frames))
            motion.work = work.ctypes.data
            call(motion, first, stop)

        return run

    def _source(self, source: np.ndarray) -> int | None:
        """Return the address of positions (N, 3, T), once their type and size are checked."""
        return address(source, np.float64, self.plan.vertex_count * 3 * self.frames)

    def pose(self, stage: int, origin: np.ndarray, dtype: DTypeLike, room: np.ndarray | None = None) -> np.ndarray:
        """Return the positions that a decoder shows at `stage`, without corrections: (N, 3, frames) of `dtype`, float32
        or float64, with the origin added. `room`: an array whose memory the result takes, which is enough for it; None:
        new memory is taken.
        """
        shape = self.plan.vertex_count, 3, self.frames
        if room is None:
            positions = zeros(shape, dtype)
        else:
            positions = room.reshape(-1).view(dtype)[: math.prod(shape)].reshape(shape)
        out = _output(origin, positions)
        place = self._placing(stage, out)
        self._piecewise(place, place)
        self._nodewise(
            lambda motion, first, stop: lib.ath_pose_nodes(
                self.plan.core, motion, self.integers, first, stop, stage, *out
            )
        )
        return positions


def gather(block: np.ndarray, vertex_source: np.ndarray, origin: np.ndarray, pool: ThreadPool = SERIAL) -> np.ndarray:
    """Return the positions of some vertices less the origin, as (N, 3, T) float64. `block`: (T, M, 3) float32 or
    float64 positions in source order; `vertex_source`: (N,) int32, which of the M vertices are wanted, in the order of
    the result.
    """
    frames, vertices = len(block), len(vertex_source)
    block = np.ascontiguousarray(block)
    out = zeros((vertices, 3, frames))

    def fill(start: int, stop: int) -> None:
        """Fill the rows of some vertices."""
        lib.ath_gather(
            stop - start,
            frames,
            address(vertex_source[start:stop], np.int32, stop - start),
            block.shape[1],
            block.dtype == np.float64,
            block.ctypes.data,
            address(origin, np.float64, 3),
            out[start:stop].ctypes.data,
        )

    pool.map(fill, ranges(vertices, 3 * frames))
    return out


def _output(origin: np.ndarray, positions: np.ndarray) -> CoreOutput:
    """Return where the core writes positions, to which it adds the origin (3,)."""
    return address(origin, np.float64, 3), positions.dtype == np.float64, positions.ctypes.data


def squared_bends(positions: np.ndarray) -> np.ndarray:
    """Return for each frame but the first and the last the sum over vertices of the squared second difference over
    time, (T - 2,). `positions`: (N, 3, T).
    """
    positions, sums = np.ascontiguousarray(positions), np.zeros(max(positions.shape[2] - 2, 0))
    lib.ath_add_bends(
        3 * len(positions),
        positions.shape[2],
        positions.dtype == np.float64,
        address(positions, positions.dtype, positions.size),
        sums.ctypes.data,
    )
    return sums


def position_errors(
    positions: np.ndarray,
    source: np.ndarray,
    origin: np.ndarray,
    pool: ThreadPool,
    shown: np.ndarray | None = None,
    shares: np.ndarray | None = None,
    *,
    rounding: float = 0.0,
) -> tuple[float, float, float]:
    """Return the largest, the 99th percentile and the RMS distance of decoded positions, (N, 3, T), from those of the
    source, as MEASURES names them; the percentile is rounded up to a number that files can hold.

    `source`: (N, 3, T) less the origin; `shown`: how many frames of the clip show each frame, (T,) int32, or None for
    1; `shares`: how many vertices of the source are at each place, (N,) int32, or None for 1; `rounding`: a distance
    that is added for decoders that round otherwise.
    """
    vertices, _, frames = positions.shape
    shown = np.ones(frames, np.int32) if shown is None else shown

    def measured(start: int, stop: int) -> tuple[np.ndarray, np.ndarray]:
        """Return two things for a range of vertices: their largest distance and sum of squares, and a histogram of
        distances.
        """
        result, histogram, part = np.empty(2), np.zeros(SHORT_FLOATS, np.uint32), positions[start:stop]
        lib.ath_error(
            stop - start,
            frames,
            address(shown, np.int32, frames),
            None if shares is None else address(shares[start:stop], np.int32, stop - start),
            part.dtype == np.float64,
            address(part, part.dtype, 0),
            address(source[start:stop], np.float64, part.size),
            address(origin, np.float64, 3),
            rounding,
            result[:1].ctypes.data,
            result[1:].ctypes.data,
            histogram.ctypes.data,
        )
        return result, histogram

    results, histograms = zip(*pool.map(measured, ranges(vertices, 3 * frames)))
    largest, squares = np.transpose(results)
    count = int(vertices if shares is None else shares.sum()) * int(shown.sum())
    within = np.cumsum(np.sum(histograms, axis=0, dtype=np.int64))
    p99 = int(np.searchsorted(within, count - count // 100))
    return float(largest.max()) + rounding, from_short_float(p99), math.sqrt(float(sum(squares)) / count) + rounding
