"""The affine transform hierarchy (ATH) of a motion clip: which subtrees of a plant move as one affine map.

Based on Song, Yang and Peng, "Hierarchical approximation of plant motion", Journal of Image and Graphics 16(8), 2011,
sections 2 and 3: the residual (eq. 3), GAD, LAD and the acceptance test TAM. One pass over the frames, the survey,
serves any number of thresholds. It works on the unquantised motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from athcodec.files.shown import counted
from athcodec.files.threads import SERIAL, ThreadPool
from athcodec.motion.affine_fit import Differences, Pieces, seen_from
from athcodec.motion.algebra import largest_distance, length, multiply
from athcodec.motion.hierarchy import Hierarchy, hierarchy_of
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.units import LengthLike, scene_unit
from athcodec.options import whole

if TYPE_CHECKING:
    from athcodec.motion.clip import MotionClip

MAX_DEPTH = 29  # Depth from which on nodes are accepted whatever their errors are.

_READ_VALUES = 3 << 21  # Numbers that are read from the clip at once.
_WORK_VERTICES = 1 << 17  # Vertices times frames that one thread works on at once.


class CutPiece(NamedTuple):
    """Vertices first_vertex to stop_vertex - 1 (file order), which move as one: a branch's subtree or its stem."""

    branch: int
    first_vertex: int
    stop_vertex: int
    is_stem: bool


class Gaps(NamedTuple):
    """Distances where two pieces meet, over attach points and frames, in scene units; 0 where none meet."""

    max: float
    rms: float


@dataclass(frozen=True, eq=False, repr=False)
class Ath:
    """An affine transform hierarchy; `build_ath` makes it (Song, Yang and Peng 2011, section 3).

    Attributes
    ----------
    hierarchy : Hierarchy
        Branches and vertices, in file order.
    thresholds : Thresholds
        Those that TAM accepted nodes by.
    rest : (N, 3) float64
        Base pose V_0 in file order, scene units.
    node_branch : (M,) int32
        The branch whose subtree a node represents, ascending.
    node_parent : (M,) int32
        Parent node, -1 for a root.
    node_depth : (M,) int32
        0 for a root.
    whole : (M,) bool
        The subtree moves as one: accepted by TAM, or cut at the depth limit.
    """

    hierarchy: Hierarchy
    thresholds: Thresholds
    rest: np.ndarray
    node_branch: np.ndarray
    node_parent: np.ndarray
    node_depth: np.ndarray
    whole: np.ndarray

    def __repr__(self) -> str:
        leaves = int((~self.is_inner).sum())
        return f"<Ath: depth {self.height + 1}, {counted(self.node_count, 'node')}, {leaves:,} without children>"

    @property
    def node_count(self) -> int:
        """Number of nodes, M."""
        return len(self.node_branch)

    @property
    def height(self) -> int:
        """Largest depth h of a node: h + 1 levels of motion detail (section 4)."""
        return int(self.node_depth.max())

    @property
    def is_inner(self) -> np.ndarray:
        """(M,) bool: the node has child nodes."""
        inner = np.zeros(self.node_count, bool)
        inner[self.node_parent[self.node_parent >= 0]] = True
        return inner

    def as_one(self, trees: np.ndarray) -> Ath:
        """Return the ATH in which some trees, (B,) bool of their branches, are a single node each."""
        is_root = self.node_parent < 0
        kept = is_root | ~trees[self.node_branch]
        parent = self.node_parent[kept]
        return replace(
            self,
            node_branch=self.node_branch[kept],
            node_parent=np.where(parent < 0, -1, (np.cumsum(kept) - 1)[parent]).astype(self.node_parent.dtype),
            node_depth=self.node_depth[kept],
            whole=(self.whole | (is_root & trees[self.node_branch]))[kept],
        )

    def whole_branches(self) -> np.ndarray:
        """Return which branches are nodes whose subtree moves as one (see `whole`).

        Returns
        -------
        (B,) bool
            In file order; False for branches inside such a subtree, which are no nodes.
        """
        result = np.zeros(self.hierarchy.branch_count, bool)
        result[self.node_branch] = self.whole
        return result

    def table1(self) -> dict[str, float | int]:
        """Return table 1 of the paper: depth (levels of nodes), nodes, leaves, and the thresholds.

        Returns
        -------
        dict of str to float or int
            "depth", "nodes", "leaves", "epsilon", "eta", "xi", "lam".
        """
        epsilon, xi = self.thresholds.distances
        return {
            "depth": self.height + 1,
            "nodes": self.node_count,
            "leaves": int((~self.is_inner).sum()),
            "epsilon": epsilon,
            "eta": self.thresholds.eta,
            "xi": xi,
            "lam": self.thresholds.lam,
        }

    def cut(self, level: int) -> list[CutPiece]:
        """Return the partition of the vertices into what moves as one at a level.

        Parameters
        ----------
        level : int
            At least 0; one beyond the height gives the cut at the height.

        Returns
        -------
        list of CutPiece
            By first vertex: the subtrees of the nodes at that depth, those of the leaves above it, and the stems of
            the inner nodes above it.

        Raises
        ------
        ValueError
            For a negative level.
        """
        pieces, shown, is_stem = self._cut_pieces(level)
        columns = (pieces.first_branch[shown], pieces.first[shown], pieces.stop[shown], is_stem)
        return [CutPiece(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]

    def affine(self, positions: MotionClip | np.ndarray, node: int) -> np.ndarray:
        """Return the maps A_t of a node's subtree (eq. 2).

        Parameters
        ----------
        positions : MotionClip or (T, N, 3) array
            In source order, scene units.
        node : int

        Returns
        -------
        (T, 3, 4) float64
            Maps from rest positions to those of each frame.

        Raises
        ------
        IndexError
            For a node that does not exist.
        """
        pieces, last = self._path(node)
        return np.concatenate([pieces.fit(frames).matrices()[:, last] for frames in self._frames(positions)])

    def affines(self, positions: MotionClip | np.ndarray) -> np.ndarray:
        """Return the maps of all nodes.

        Parameters
        ----------
        positions : MotionClip or (T, N, 3) array
            In source order, scene units.

        Returns
        -------
        (T, M, 3, 4) float64
            The same as `affine` gives for each node.
        """
        hierarchy, rest = self.hierarchy, self.rest
        pieces = Pieces.subtrees(hierarchy, rest, self.node_branch, self.node_parent, self.node_depth)
        return np.concatenate([pieces.fit(frames).matrices() for frames in self._frames(positions)])

    def residual(self, positions: MotionClip | np.ndarray, node: int) -> np.ndarray:
        """Return the residual R_t of a node's subtree in the space of the base pose (eq. 3); A_t R_t = V_t (eq. 4).

        Parameters
        ----------
        positions : MotionClip or (T, N, 3) array
            In source order, scene units.
        node : int

        Returns
        -------
        (T, K, 3) float64
            Of the K vertices of the subtree, in file order.

        Raises
        ------
        IndexError
            For a node that does not exist.
        """
        pieces, last = self._path(node)
        vertices = slice(pieces.first[last], pieces.stop[last])
        residuals = []
        for frames in self._frames(positions):
            inverse, offset = pieces.fit(frames).inverse_maps()
            moved = multiply(np.moveaxis(frames[:, :, vertices], 0, 2), np.swapaxes(inverse[:, last], 1, 2))
            residuals.append(moved + offset[:, last, None] + pieces.origin)
        return np.concatenate(residuals)

    def approximation(self, positions: np.ndarray, level: int) -> np.ndarray:
        """Return the motion at a level: every piece of `cut(level)` moves by its own least-squares affine map.

        The maps of different pieces are independent, as in the paper, so pieces may come apart where they meet: see
        `attachment_gaps`.

        Parameters
        ----------
        positions : (T, N, 3) array
            In source order, scene units.
        level : int

        Returns
        -------
        (T, N, 3) float64
            In source order.

        Raises
        ------
        ValueError
            For a negative level.
        """
        pieces, shown, _ = self._cut_pieces(level)
        result = np.empty(np.shape(positions))
        start = 0
        for frames in self._frames(positions):
            moved = pieces.fit(frames).apply(shown, pieces.vertices(shown), pieces.counts[shown])
            stop = start + frames.shape[1]
            result[start:stop, self.hierarchy.vertex_source] = np.moveaxis(moved, 0, 2) + pieces.origin
            start = stop
        return result

    def attachment_gaps(self, positions: MotionClip | np.ndarray, level: int) -> Gaps:
        """Return how far the pieces of `approximation` come apart where a branch is attached to its parent's stem.

        For every branch whose piece is another than its parent's: the distance between the places where the two
        pieces' maps put the attach vertex, which is the visible gap.

        Parameters
        ----------
        positions : MotionClip or (T, N, 3) array
            In source order, scene units.
        level : int

        Returns
        -------
        Gaps

        Raises
        ------
        ValueError
            For a negative level.
        """
        pieces, shown, _ = self._cut_pieces(level)
        piece_of_branch = np.repeat(shown, (pieces.stop_branch - pieces.first_branch)[shown])
        parent = self.hierarchy.branch_parent
        child = np.flatnonzero((parent >= 0) & (piece_of_branch != piece_of_branch[parent]))
        if not len(child):
            return Gaps(0.0, 0.0)
        attach = self.hierarchy.attach[child]
        once = np.ones(len(child), np.intp)
        largest, total, count = 0.0, 0.0, 0
        for frames in self._frames(positions):
            fit = pieces.fit(frames)
            placed_by_child = fit.apply(piece_of_branch[child], attach, once)
            placed_by_parent = fit.apply(piece_of_branch[parent[child]], attach, once)
            squares = ((placed_by_child - placed_by_parent) ** 2).sum(axis=0)
            largest, total, count = max(largest, squares.max()), total + squares.sum(), count + squares.size
        return Gaps(float(np.sqrt(largest)), float(np.sqrt(total / count)))

    def _frames(self, positions: MotionClip | np.ndarray) -> Iterator[np.ndarray]:
        return _file_order_frames(positions, self.hierarchy, self.rest.mean(axis=0))

    def _path(self, node: int) -> tuple[Pieces, int]:
        """Return the subtrees of the nodes from the root down to `node`, as pieces of which each hangs on the one
        before it, and the number of the last piece, which is that of `node`. Raises IndexError for a node that does not
        exist.
        """
        if not 0 <= (node := whole("ATH node", node)) < self.node_count:
            raise IndexError(f"ATH node: got {node}, expected 0 to {self.node_count - 1}")
        path = [node]
        while self.node_parent[path[-1]] >= 0:
            path.append(int(self.node_parent[path[-1]]))
        branches = self.node_branch[path[::-1]]
        order = np.arange(len(path))
        return Pieces.subtrees(self.hierarchy, self.rest, branches, order - 1, order), len(path) - 1

    def _cut_pieces(self, level: int) -> tuple[Pieces, np.ndarray, np.ndarray]:
        """Return three things about the cut at a level: all pieces that its affine maps depend on; the numbers of the
        pieces that are in the cut, ordered by first vertex; and for each of these whether it is a stem, and not a
        subtree. Raises ValueError for a negative level.
        """
        if (level := whole("level of a cut", level)) < 0:
            raise ValueError(f"level of a cut: got {level}, expected 0 to {self.height}")
        hierarchy = self.hierarchy
        nodes = np.flatnonzero(self.node_depth <= level)
        renumbered = np.full(self.node_count + 1, -1)
        renumbered[nodes] = np.arange(len(nodes))
        parent = renumbered[self.node_parent[nodes]]
        divided = np.flatnonzero(self.is_inner[nodes] & (self.node_depth[nodes] < level))
        branch = self.node_branch[nodes]
        first_branch = np.concatenate([branch, branch[divided]])
        stop_branch = np.concatenate([branch + hierarchy.subtree_branches[branch], branch[divided] + 1])
        node_depth = np.concatenate([self.node_depth[nodes], self.node_depth[nodes[divided]] + 1])
        parent = np.concatenate([parent, divided])
        pieces = Pieces(hierarchy, self.rest, first_branch, stop_branch, parent, node_depth)
        shown = np.setdiff1d(np.arange(len(first_branch)), divided)
        shown = shown[np.argsort(first_branch[shown], kind="stable")]
        return pieces, shown, shown >= len(nodes)


@dataclass(frozen=True, eq=False)
class Survey:
    """The statistics of one pass over all frames of a clip: its extent, its motion, and what TAM needs.

    Lengths are in scene units. Nothing is kept frame by frame.

    Attributes
    ----------
    hierarchy : Hierarchy
        Branches and vertices, in file order.
    rest : (N, 3) float64
        Base pose V_0 in file order.
    max_depth : int
        Nodes at this depth are accepted whatever their errors are.
    frame_count : int
        Frames read, all of whose positions are finite.
    low, high : (3,) float64
        Corners of the axis-aligned bounding box of all frames.
    rms_motion : float
        RMS over frames and vertices of a vertex's distance from its rest position.
    branches : (C,) integer array
        The branches above max_depth, whose subtrees are tested.
    largest_gads : (E, C) float64
        The largest GADs (eq. 5) of each subtree over the frames, descending; E is the surveyed eta + 1, or frame_count
        where that is fewer.
    largest_distance : (C,) float64
        Largest distance of any vertex of the subtree from its base position.
    xi : float or None
        The surveyed one; None where lam was 0.
    most_beyond_xi : (C,) integer array or None
        The most vertices beyond xi in a frame (LAD); None where lam was 0.
    largest_ways : (R,) float64
        For each tree, by its root, the largest distance of any of its vertices from where it is in the base pose.
    steps : (T,) float64
        The largest distance of any vertex from where it is in the frame before, 0 only if all have the same bits;
        infinite for the first frame.
    """

    hierarchy: Hierarchy
    rest: np.ndarray
    max_depth: int
    frame_count: int
    low: np.ndarray
    high: np.ndarray
    rms_motion: float
    branches: np.ndarray
    largest_gads: np.ndarray
    largest_distance: np.ndarray
    xi: float | None
    most_beyond_xi: np.ndarray | None
    largest_ways: np.ndarray
    steps: np.ndarray

    @property
    def repeats(self) -> np.ndarray:
        """(T,) bool: whether each frame is the one before it, bit for bit."""
        return self.steps == 0

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal over all frames, in scene units."""
        return length(self.high - self.low)

    def ath(self, thresholds: Thresholds) -> Ath:
        """Return the ATH for some thresholds (section 3), without reading the clip again.

        Parameters
        ----------
        thresholds : Thresholds
            Any epsilon and any eta up to the surveyed one, and any xi where lam is 0; with a greater lam, xi must be
            the surveyed one.

        Returns
        -------
        Ath

        Raises
        ------
        ValueError
            For thresholds that were not surveyed.
        """
        accepted = np.ones(self.hierarchy.branch_count, bool)
        accepted[self.branches] = self._keeps_epsilon(thresholds) & self._keeps_xi(thresholds)
        return _prune(self.hierarchy, thresholds, self.rest, accepted, self.max_depth)

    def _keeps_epsilon(self, thresholds: Thresholds) -> np.ndarray | bool:
        """Return whether TAM's first condition holds: at most eta frames have a GAD above epsilon."""
        eta, surveyed = thresholds.eta, len(self.largest_gads) - 1
        if eta >= self.frame_count:
            return True
        if eta > surveyed:
            raise ValueError(f"thresholds: got eta {eta}, expected at most the surveyed {surveyed}")
        return self.largest_gads[eta] <= thresholds.distances[0]

    def _keeps_xi(self, thresholds: Thresholds) -> np.ndarray:
        """Return for each surveyed branch, (C,) bool, whether its subtree meets TAM's second condition: in every frame
        at most `lam` of its vertices are further than `xi` from where the base pose has them. Raises ValueError for
        thresholds that were not surveyed.
        """
        lam, (_, xi) = thresholds.lam, thresholds.distances
        if lam == 0:
            return self.largest_distance <= xi
        if self.most_beyond_xi is None:
            raise ValueError(f"thresholds: got lam {lam}, expected 0, since the survey was made with lam 0")
        if xi != self.xi:
            raise ValueError(f"thresholds: got xi {xi} with lam {lam}, expected the surveyed {self.xi}")
        return self.most_beyond_xi <= lam


def survey(
    clip: MotionClip,
    hierarchy: Hierarchy | None = None,
    lam: int = 0,
    xi: float | None = None,
    max_depth: int = MAX_DEPTH,
    progress: Callable[[float], object] | None = None,
    *,
    eta: int = 0,
    pool: ThreadPool = SERIAL,
    rest: np.ndarray | None = None,
) -> Survey:
    """Return the statistics of a clip's frames from which `Survey.ath` makes the ATH for thresholds chosen afterwards.

    Parameters
    ----------
    clip : MotionClip
        Every frame is read once, block by block.
    hierarchy : Hierarchy, optional
        The clip's, where it is known already.
    lam : int
        Vertices; above 0 the survey is for a single `xi`, which is then needed.
    xi : float, optional
        Scene units.
    max_depth : int
        Nodes at this depth are accepted whatever their errors are.
    progress : callable, optional
        Called with the fraction of the frames read, at last with 1.0.
    eta : int
        Frames; the largest eta that `Survey.ath` will be asked for.
    pool : ThreadPool
        The result does not depend on the number of threads.
    rest : (N, 3) float64 array, optional
        The base pose in file order, where it is not the clip's rest pose.

    Returns
    -------
    Survey

    Raises
    ------
    ValueError
        Where a number is negative or xi is missing.
    ClipError
        For positions that are NaN or infinite.
    """
    limits = Thresholds(0.0, eta, 0.0 if xi is None else xi, lam)
    if limits.lam and xi is None:
        raise ValueError(f"xi: got None with lam {lam}, expected the distance that lam counts from")
    if (max_depth := whole("max_depth", max_depth)) < 0:
        raise ValueError(f"max_depth: got {max_depth}, expected a number >= 0")
    if hierarchy is None:
        hierarchy = hierarchy_of(clip)
    rest = np.asarray(clip.rest, float)[hierarchy.vertex_source] if rest is None else rest
    branches = np.flatnonzero(hierarchy.branch_depth < max_depth)
    pieces = _tested_pieces(hierarchy, rest, branches)
    trees = hierarchy.first_vertex[hierarchy.branch_parent < 0]
    xi = limits.distances[1] if limits.lam else None

    def measured(portion: np.ndarray) -> tuple[_Extent, Differences]:
        frames = _in_file_order(portion, hierarchy)
        return _Extent.of(frames, rest, trees), Differences.of(seen_from(pieces.origin, frames), pieces, xi)

    extent: _Extent | None = None
    differences: Differences | None = None
    gads = _Largest(limits.eta + 1)
    steps: list[float] = []
    portions = _noting_steps(_portions(clip, hierarchy.vertex_count), steps)
    for where, how in pool.ordered(measured, portions, 2 * pool.jobs):
        extent = where if extent is None else extent | where
        differences = how if differences is None else differences | how
        gads.add(how.gads)
        if progress is not None:
            progress(extent.frame_count / clip.frame_count)
    assert extent is not None and differences is not None  # Every clip has frames.
    return Survey(
        hierarchy=hierarchy,
        rest=rest,
        max_depth=max_depth,
        frame_count=extent.frame_count,
        low=extent.low,
        high=extent.high,
        rms_motion=extent.rms_motion(len(rest)),
        branches=branches,
        largest_gads=gads.rows(),
        largest_distance=differences.largest_distance,
        xi=xi,
        most_beyond_xi=None if xi is None else differences.most_beyond_xi,
        largest_ways=np.sqrt(extent.square_ways),
        steps=np.array(steps),
    )


def build_ath(
    clip: MotionClip,
    epsilon: LengthLike | None = None,
    eta: int = 0,
    xi: LengthLike | None = None,
    lam: int = 0,
    hierarchy: Hierarchy | None = None,
    max_depth: int = MAX_DEPTH,
    *,
    max_error: LengthLike | None = None,
) -> Ath:
    """Return the ATH of a clip (Song, Yang and Peng 2011, section 3), in one pass over its frames.

    Where TAM accepts a subtree, its node is a leaf; otherwise the sub-branches are tested, down to a single branch.
    For several thresholds see `survey`.

    Parameters
    ----------
    clip : MotionClip
        Read block by block.
    epsilon : float or str, optional
        Scene units, or text such as "1mm": a frame whose mean residual distance (GAD, eq. 5) exceeds it counts against
        `eta`.
    eta : int
        At most this number of frames may exceed epsilon.
    xi : float or str, optional
        Scene units, or text such as "1mm": a vertex further than this from its base position counts against `lam`
        (LAD).
    lam : int
        At most this number of vertices may exceed xi in any frame.
    hierarchy : Hierarchy, optional
        The clip's, where it is known already.
    max_depth : int
        Nodes at this depth are accepted whatever their errors are.
    max_error : float or str, optional
        In place of epsilon and xi: both are this, in scene units or text such as "1mm".

    Returns
    -------
    Ath

    Raises
    ------
    ValueError
        Where thresholds are missing, given twice or negative.
    ClipError
        For positions that are NaN or infinite.
    """
    thresholds = _thresholds(epsilon, eta, xi, lam, max_error).in_scene_units(scene_unit(clip.metadata))
    surveyed = survey(clip, hierarchy, thresholds.lam, thresholds.distances[1], max_depth, eta=thresholds.eta)
    return surveyed.ath(thresholds)


def _thresholds(
    epsilon: LengthLike | None, eta: int, xi: LengthLike | None, lam: int, max_error: LengthLike | None
) -> Thresholds:
    """Return the four thresholds of TAM from a caller's options, where `max_error` stands for both epsilon and xi.
    Raises ValueError if thresholds are missing, or if `max_error` is given beside epsilon or xi.
    """
    if max_error is not None:
        if epsilon is not None or xi is not None:
            raise ValueError("ATH thresholds: got max_error beside epsilon or xi, expected one or the other")
        epsilon = xi = max_error
    if epsilon is None or xi is None:
        raise ValueError(f"ATH thresholds: got epsilon {epsilon} and xi {xi}, expected both, or max_error")
    return Thresholds(epsilon, eta, xi, lam)


@dataclass(frozen=True)
class _Extent:
    """Bounding box (3,), number of frames, and squared distances from the rest pose: their sum, and the largest in each
    tree, (R,)."""

    low: np.ndarray
    high: np.ndarray
    frame_count: int
    square_sum: float
    square_ways: np.ndarray

    @classmethod
    def of(cls, frames: np.ndarray, rest: np.ndarray, trees: np.ndarray) -> _Extent:
        """Return the extent of frames (3,k,N) in the scene's coordinates; rest: (N,3); trees: (R,) their first
        vertices."""
        moved = frames - rest.T[:, None]
        moved *= moved
        low, high = (corner.astype(float) for corner in (frames.min(axis=(1, 2)), frames.max(axis=(1, 2))))
        ways = np.maximum.reduceat(moved.sum(axis=0).max(axis=0), trees)
        return cls(low, high, frames.shape[1], float(moved.sum()), ways)

    def __or__(self, other: _Extent) -> _Extent:
        """Return the extent of the frames of both."""
        return _Extent(
            np.minimum(self.low, other.low),
            np.maximum(self.high, other.high),
            self.frame_count + other.frame_count,
            self.square_sum + other.square_sum,
            np.maximum(self.square_ways, other.square_ways),
        )

    def rms_motion(self, vertex_count: int) -> float:
        return float(np.sqrt(self.square_sum / (self.frame_count * vertex_count)))


class _Largest:
    """The `count` largest numbers of each column of the rows added: what TAM needs to allow eta frames."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._parts: list[np.ndarray] = []
        self._held = 0

    def add(self, rows: np.ndarray) -> None:
        self._parts.append(rows)
        self._held += len(rows)
        # Sorting whenever the rows have doubled costs each row the same, however many are kept.
        if self._held >= 2 * self._count:
            self._parts = [self.rows()]
            self._held = self._count

    def rows(self) -> np.ndarray:
        """Return the largest numbers, (count or fewer, columns), each column descending."""
        ascending = np.sort(np.concatenate(self._parts), axis=0)
        return ascending[::-1][: self._count].copy()


def _tested_pieces(hierarchy: Hierarchy, rest: np.ndarray, branches: np.ndarray) -> Pieces:
    """Return the subtrees of the branches, which hold the parent of each."""
    index = np.full(hierarchy.branch_count + 1, -1)
    index[branches] = np.arange(len(branches))
    parent = index[hierarchy.branch_parent[branches]]
    return Pieces.subtrees(hierarchy, rest, branches, parent, hierarchy.branch_depth[branches])


def _prune(hierarchy: Hierarchy, thresholds: Thresholds, rest: np.ndarray, accepted: np.ndarray, max_depth: int) -> Ath:
    """Make the ATH whose nodes are the root branches and every branch whose ancestors all failed TAM, so that no
    subtree around it moves as one affine map. `accepted`: (B,) bool, whether TAM accepts the subtree of each branch as
    moving by one affine map; `rest`: the base pose, (N, 3) in file order; `max_depth`: no node is deeper than this.
    """
    depth, parent = hierarchy.branch_depth, hierarchy.branch_parent
    kept = depth == 0
    for level in range(1, min(int(depth.max()), max_depth) + 1):
        branches = np.flatnonzero(depth == level)
        kept[branches] = kept[parent[branches]] & ~accepted[parent[branches]]
    nodes = np.flatnonzero(kept).astype(np.int32)
    index = np.full(hierarchy.branch_count + 1, -1, np.int32)
    index[nodes] = np.arange(len(nodes))
    return Ath(hierarchy, thresholds, rest, nodes, index[parent[nodes]], depth[nodes], accepted[nodes])


def _file_order_frames(
    positions: MotionClip | np.ndarray, hierarchy: Hierarchy, origin: np.ndarray
) -> Iterator[np.ndarray]:
    """Yield frames in working portions: (3,k,N) float64, vertices in file order, seen from `origin`."""
    for portion in _portions(positions, hierarchy.vertex_count):
        yield seen_from(origin, _in_file_order(portion, hierarchy))


def _portions(positions: MotionClip | np.ndarray, vertex_count: int) -> Iterator[np.ndarray]:
    """Yield the frames of `positions` in portions small enough to work on, (k, N, 3) each, in source order and in the
    dtype that they have. `positions`: a clip, or an array (T, N, 3); raises ValueError for an array of another shape.
    """
    at_once = max(1, _WORK_VERTICES // vertex_count)
    blocks: Iterator[np.ndarray]
    if hasattr(positions, "blocks"):
        blocks = (block for _, block in positions.blocks(max(1, _READ_VALUES // (3 * vertex_count))))
    elif np.ndim(positions) == 3 and np.shape(positions)[1:] == (vertex_count, 3):
        blocks = iter([np.asarray(positions)])
    else:
        raise ValueError(f"positions: got shape {np.shape(positions)}, expected (T, {vertex_count}, 3)")
    for block in blocks:
        for start in range(0, len(block), at_once):
            yield block[start : start + at_once]


def _noting_steps(portions: Iterable[np.ndarray], steps: list[float]) -> Iterator[np.ndarray]:
    """Yield the portions, and note of each frame how far it is from the one before it (`Survey.steps`)."""
    before = None
    for portion in portions:
        for frame in portion:
            steps.append(np.inf if before is None else _step(frame, before))
            before = frame
        yield portion


def _step(one: np.ndarray, other: np.ndarray) -> float:
    if _same_bits(one, other):
        return 0.0
    return max(largest_distance(one, other), np.finfo(np.float64).tiny)


def _same_bits(one: np.ndarray, other: np.ndarray) -> bool:
    last = one[-1].tobytes() == other[-1].tobytes()  # Different frames mostly differ there.
    return last and np.ascontiguousarray(one).tobytes() == np.ascontiguousarray(other).tobytes()


def _in_file_order(portion: np.ndarray, hierarchy: Hierarchy) -> np.ndarray:
    """Return a portion in the source's dtype, (3,k,N), vertices in file order."""
    return np.take(np.moveaxis(portion, 2, 0), hierarchy.vertex_source, axis=2)
