"""A skeleton for engines: a hierarchy of joints that turn and shift, two of which move a vertex at most.

The plant is one part at first. The parts that are furthest off are cut, as far as the joints reach: runs of subtrees
beside each other in two, a subtree into its stem and what hangs on that, so that parts are nodes of the ATH and exact
stems, each as fine as it has to be. A part has a joint, that hangs on the joint of the part at which it grows; a stem
that bends has a chain of them, from base to tip, and its vertices go over from each joint to the next along it (linear
blend skinning). Joints have no scale, so that none is sheared by those above it.
Their rotations and places are fitted to the motion frame by frame: each has the weighted orthogonal Procrustes solution
while the others stay as they are, every second joint of the chains in turn (Le and Deng 2012, "Smooth skinning
decomposition with rigid bones").

A joint lies where its share of the stem begins and has the world's axes in the rest pose. It writes no files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from athcodec.decoding.clip_view import ClipView
from athcodec.exporters import Progress
from athcodec.exporters.fitting import allowed_error, portions
from athcodec.exporters.gltf_joints import Joints
from athcodec.exporters.scene_objects import distinct
from athcodec.motion.algebra import nearest_rotations
from athcodec.motion.branches.finding import find_branches
from athcodec.motion.branches.result import with_branches
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import Hierarchy, hierarchy_of
from athcodec.motion.protocol import Motion
from athcodec.motion.quaternions import quaternions, rotation_matrices
from athcodec.motion.sampling import spread
from athcodec.options import RIG_JOINTS

LONGEST_CHAIN = 32
WORST = 0.5  # Parts whose error is below this share of the worst part's wait for a later round.
BINS = 64  # pieces of a stem of which the middles make its centre line
ROUNDS = 64  # in which parts are cut
SWEEPS = 4
SAMPLE_FRAMES = 12  # looked at meanwhile
HELD = 1e-9  # how much, of a joint's own extent, no turn counts
ROOT = "root"


@dataclass(frozen=True, eq=False)
class _Parts:
    """K runs of vertices in the order of a hierarchy, each behind the part that it hangs on: stems that have a chain of
    joints, and runs of subtrees beside each other that have one. branch, stop (K,): the branches from the one to before
    the other; chain (K,) joints, 0 for a run of subtrees, which has one."""

    branch: np.ndarray
    stop: np.ndarray
    chain: np.ndarray

    @classmethod
    def whole(cls, hierarchy: Hierarchy) -> _Parts:
        """Return a single run of all."""
        return cls(np.zeros(1, np.int64), np.array([len(hierarchy.first_vertex)]), np.zeros(1, np.int64))

    @property
    def joint_count(self) -> int:
        return int(np.maximum(self.chain, 1).sum())

    def finer(self, hierarchy: Hierarchy, off: np.ndarray, allowed: float, most: int) -> _Parts:
        """Return the parts with the worst ones cut in two or given longer chains of joints, `most` joints in all. A run
        of subtrees is cut in the middle, and a single subtree into its stem and what hangs on the stem. `off` (K,) is
        the error of each part; if all are within `allowed`, the same parts are returned.
        """
        rows: list[list[tuple[int, int, int]]] = [
            [part] for part in zip(self.branch.tolist(), self.stop.tolist(), self.chain.tolist())
        ]
        left = most - self.joint_count
        for number in np.argsort(-off, kind="stable").tolist():
            if off[number] <= max(allowed, WORST * off.max()) or left <= 0:
                break
            branch, stop, chain = rows[number][0]
            rows[number] = _cut(hierarchy, branch, stop, chain, off[number] / max(allowed, 1e-30), left)
            left -= sum(max(each, 1) for _, _, each in rows[number]) - max(chain, 1)
        return _Parts(*np.array([part for row in rows for part in row], np.int64).reshape(-1, 3).T)


def _cut(
    hierarchy: Hierarchy, branch: int, stop: int, chain: int, excess: float, left: int
) -> list[tuple[int, int, int]]:
    """Cut one part, the branches `branch` to `stop` - 1, and return the new parts as triples (first branch, branch
    after the last, joints of the chain; 0: no chain). `excess` is the part's error over the allowed error, and at most
    `left` joints may be added.
    """
    if chain:
        room = min(LONGEST_CHAIN, int(hierarchy.stem_count[branch]), chain + left)
        return [(branch, stop, max(min(int(np.ceil(chain * min(np.sqrt(excess), 2.0))), room), chain))]
    after = branch + int(hierarchy.subtree_branches[branch])
    if after == stop:
        return [(branch, branch + 1, 1), *([(branch + 1, stop, 0)] if branch + 1 < stop else [])]
    starts = [branch]
    while after < stop:
        starts.append(after)
        after += int(hierarchy.subtree_branches[after])
    middle = starts[len(starts) // 2]
    return [(branch, middle, 0), (middle, stop, 0)]


def fit_rig(motion: Motion, most: int = RIG_JOINTS, report: Progress = lambda done: None) -> Joints:
    """Return the joints of a motion, at most `most` beside the root. If the clip names no branches, branches are
    found.
    """
    hierarchy = hierarchy_to_rig(motion)
    order = hierarchy.vertex_source
    rest = np.asarray(motion.rest).astype(np.float32).astype(np.float64)[order]
    allowed, parts = allowed_error(motion), _Parts.whole(hierarchy)
    some = spread(motion.frame_count, SAMPLE_FRAMES)
    sample = np.stack([motion.block(frame, frame + 1)[0][order].astype(np.float64) for frame in some])
    for done in range(ROUNDS):
        bones = _Bones(hierarchy, parts, rest)
        off = np.maximum.reduceat(bones.fitted(sample)[2], bones.first_vertex)
        finer = parts.finer(hierarchy, off, allowed, most)
        report(0.4 * (done + 1) / ROUNDS)
        if finer.joint_count == parts.joint_count and len(finer.branch) == len(parts.branch):
            break
        parts = finer
    return _posed(motion, _Bones(hierarchy, parts, rest), order, lambda done: report(0.4 + 0.6 * done))


def hierarchy_to_rig(motion: Motion) -> Hierarchy:
    """Return the branches of a motion, or those that are found where it has none."""
    if isinstance(motion, ClipView):
        return motion.decoder.file.hierarchy
    if motion.branch_parent is None:
        clip = cast(MotionClip, motion)  # Only a clip in memory can lack branches: a file has them.
        motion = with_branches(clip, find_branches(clip))
    return hierarchy_of(motion)


def _along(points: np.ndarray) -> np.ndarray:
    """Return how far each point lies along the centre line of its stem, (n,) from 0 at the base to 1 at the tip. Points
    run from base to tip, as the rings of a tube do.
    """
    bins = min(BINS, len(points))
    of = np.arange(len(points)) * bins // len(points)
    count = np.bincount(of, minlength=bins)
    middle = np.stack([np.bincount(of, points[:, axis], bins) for axis in range(3)], axis=1) / count[:, None]
    way = np.gradient(middle, axis=0) if bins > 1 else np.zeros((1, 3))
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-30)
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1)))
    along = length[of] + ((points - middle[of]) * way[of]).sum(axis=1)
    low, high = along.min(), along.max()
    return (along - low) / (high - low) if high > low else np.zeros(len(points))


class _Bones:
    """The joints of parts, of each at least one: `chain` (K,). Of each vertex the joint `bone` (N, 2) of even and odd
    place in its chain, and their `weight` (N, 2)."""

    def __init__(self, hierarchy: Hierarchy, parts: _Parts, rest: np.ndarray):
        """Give each vertex of the rest pose (N, 3) its one or two joints, with weights that change linearly along the
        stem.
        """
        self.rest, chains = rest, np.maximum(parts.chain, 1)
        self.branch = hierarchy.branch_source[parts.branch]  # in the source's numbering, for names
        self.first_vertex = hierarchy.first_vertex[parts.branch].astype(np.int64)
        self._attach = hierarchy.attach[parts.branch]
        self.first = np.cumsum(chains) - chains
        self.count = int(chains.sum())
        size = np.diff(np.append(self.first_vertex, len(rest)))
        of = np.repeat(np.arange(len(chains)), size)
        self._place = np.zeros(len(rest))
        for number in np.flatnonzero(chains > 1).tolist():
            rows = slice(self.first_vertex[number], self.first_vertex[number] + size[number])
            self._place[rows] = _along(rest[rows])
        along = np.clip(self._place * chains[of] - 0.5, 0, chains[of] - 1)
        low = np.minimum(along.astype(np.int64), np.maximum(chains[of] - 2, 0))
        share = along - low
        high = np.minimum(low + 1, chains[of] - 1)
        odd = low % 2 == 1
        self.bone = self.first[of][:, None] + np.stack([np.where(odd, high, low), np.where(odd, low, high)], axis=1)
        self.weight = np.stack([np.where(odd, share, 1 - share), np.where(odd, 1 - share, share)], axis=1)
        self.number = np.arange(self.count) - np.repeat(self.first, chains)
        self.part = np.repeat(np.arange(len(chains)), chains)
        self.chain = chains
        self._sides = [self._side(side) for side in range(2)]

    def _side(self, side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the vertices that joints of even or odd place move, joint after joint; where each joint begins; which
        they are."""
        used = np.flatnonzero(self.weight[:, side] > 0)
        rows = used[np.argsort(self.bone[used, side], kind="stable")]
        bones, starts = np.unique(self.bone[rows, side], return_index=True)
        return rows, starts, bones

    @property
    def joints(self) -> np.ndarray:
        """Return the places (J, 3) of the joints in the rest pose: each is the middle of the vertices where the joint's
        part of its stem begins.
        """
        key = np.abs(self._place - (self.number / self.chain[self.part])[self.bone.T]).T
        key = np.where(self.weight > 0, key, np.inf)
        out = np.zeros((self.count, 3))
        for side in range(2):
            rows, starts, bones = self._sides[side]
            if len(rows):
                near = key[rows, side]
                nearest = np.repeat(np.minimum.reduceat(near, starts), np.diff(np.append(starts, len(rows))))
                chosen = near <= nearest + 1e-3
                total = np.add.reduceat(chosen.astype(float), starts)
                out[bones] = np.add.reduceat(self.rest[rows] * chosen[:, None], starts) / total[:, None]
        return out

    def parents(self) -> np.ndarray:
        """Return (J,) the joint that each hangs on, -1 for the root."""
        parent = np.arange(self.count) - 1
        attach = self._attach
        strongest = self.bone[np.arange(len(self.bone)), self.weight.argmax(axis=1)]
        parent[self.first] = np.where(attach >= 0, strongest[attach], -1)
        return parent

    def fitted(self, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Fit the joints to frames (T, N, 3). Return their rotations (T, J, 3, 3) and translations (T, J, 3), and the
        largest distance (N,) that they leave at each vertex.
        """
        turn = np.tile(np.eye(3), (len(frames), self.count, 1, 1))
        shift = np.zeros((len(frames), self.count, 3))
        for side in range(2):
            self._fit(side, frames * self.weight[:, side, None], turn, shift)
        for _ in range(SWEEPS if (self.chain > 1).any() else 0):
            for side in range(2):
                self._fit(side, frames - self._moved(1 - side, turn, shift), turn, shift)
        off = frames - self._moved(0, turn, shift) - self._moved(1, turn, shift)
        return turn, shift, np.sqrt((off**2).sum(axis=2).max(axis=0))

    def _moved(self, side: int, turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """Return (T, N, 3) what joints of even or odd place add to the vertices."""
        bone = self.bone[:, side]
        placed = np.einsum("tnij,nj->tni", turn[:, bone], self.rest) + shift[:, bone]
        return placed * self.weight[:, side, None]

    def _fit(self, side: int, target: np.ndarray, turn: np.ndarray, shift: np.ndarray) -> None:
        """Set the best rotations (T, J, 3, 3) and translations (T, J, 3), in place, of the joints with an even (`side`
        0) or odd (`side` 1) number in their chain. `target` (T, N, 3) has the places, multiplied by their weights, that
        vertices should reach by these joints.
        """
        rows, starts, bones = self._sides[side]
        if not len(rows):
            return
        weight, points, wanted = self.weight[rows, side, None], self.rest[rows], target[:, rows]
        of = np.repeat(np.arange(len(bones)), np.diff(np.append(starts, len(rows))))
        total = np.add.reduceat(weight**2, starts)
        middle = np.add.reduceat(weight**2 * points, starts) / total
        aim = np.add.reduceat(weight * wanted, starts, axis=1) / total
        local = weight * (points - middle[of])
        wanted = wanted - weight * aim[:, of]
        products = wanted[:, :, :, None] * local[:, None, :]
        cross = np.add.reduceat(products, starts, axis=1)
        held = HELD * np.add.reduceat((local**2).sum(axis=1), starts)[:, None, None] * np.eye(3) + 1e-30 * np.eye(3)
        rotations = nearest_rotations(cross + held)
        turn[:, bones] = rotations
        shift[:, bones] = aim - np.einsum("tkij,kj->tki", rotations, middle)


def _posed(motion: Motion, bones: _Bones, order: np.ndarray, report: Progress) -> Joints:
    """Return the joints with their pose in every frame, relative to their parents, and their error as they are written.
    `order` has the vertices in the source's order.
    """
    places, parents = bones.joints, np.append(-1, bones.parents() + 1)
    rest = np.concatenate([np.zeros((1, 3)), places])
    turns = np.zeros((motion.frame_count, len(rest), 4), np.float32)
    shifts = np.zeros((motion.frame_count, len(rest), 3), np.float32)
    turns[..., 3] = 1
    largest, before = 0.0, quaternions(np.tile(np.eye(3), (len(rest), 1, 1)))
    for start, frames in portions(motion, len(order) * 8):
        target = frames[:, order].astype(np.float64)
        turn, shift, _ = bones.fitted(target)
        world = np.tile(np.eye(3), (len(frames), len(rest), 1, 1))
        world[:, 1:] = turn
        at = np.zeros((len(frames), len(rest), 3))
        at[:, 1:] = np.einsum("tkij,kj->tki", turn, places) + shift
        inner = world[:, parents[1:]].swapaxes(2, 3)
        local = quaternions(inner @ world[:, 1:])
        moved = np.einsum("tkij,tkj->tki", inner, at[:, 1:] - at[:, parents[1:]])
        for frame in range(len(frames)):
            local[frame] *= np.where((local[frame] * before[1:]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
            before[1:] = local[frame]
        rows = slice(start, start + len(frames))
        turns[rows, 1:], shifts[rows, 1:] = local, moved
        largest = max(largest, _off(bones, parents, places, turns[rows], shifts[rows], target))
        report((start + len(frames)) / motion.frame_count)
    bind = np.tile(np.eye(4, dtype=np.float32), (len(rest), 1, 1))
    bind[:, :3, 3] = -rest
    bone, weight = np.empty_like(bones.bone), np.empty(bones.weight.shape, np.float32)
    bone[order], weight[order] = bones.bone + 1, bones.weight
    still = np.zeros((len(rest), 4), np.float32)
    still[:, 3] = 1
    beside = rest - np.where(parents[:, None] < 0, 0.0, rest[parents])
    ones = np.ones((len(rest), 3), np.float32)
    return Joints(
        bone,
        bind,
        (beside.astype(np.float32), still, ones),
        (shifts, turns, np.broadcast_to(ones, shifts.shape)),
        largest,
        parents,
        weight,
        _names(bones),
    )


def _off(
    bones: _Bones, parents: np.ndarray, places: np.ndarray, turns: np.ndarray, shifts: np.ndarray, target: np.ndarray
) -> float:
    """Return the largest distance between vertices as an engine moves them by joints and their places `target` (T, N,
    3). `turns` and `shifts` are the joints' quaternions and translations relative to their parents.
    """
    local, at = rotation_matrices(turns.astype(np.float64)), shifts.astype(np.float64)
    for joint in range(1, len(parents)):  # Parents precede their children.
        above = parents[joint]
        at[:, joint] = np.einsum("tij,tj->ti", local[:, above], at[:, joint]) + at[:, above]
        local[:, joint] = local[:, above] @ local[:, joint]
    shift = at[:, 1:] - np.einsum("tkij,kj->tki", local[:, 1:], places)
    weight = bones.weight.astype(np.float32).astype(np.float64)
    moved = sum(
        (np.einsum("tnij,nj->tni", local[:, 1:][:, bone], bones.rest) + shift[:, bone]) * share[:, None]
        for bone, share in zip(bones.bone.T, weight.T)
    )
    return float(np.sqrt(((moved - target) ** 2).sum(axis=2).max()))


def _names(bones: _Bones) -> tuple[str, ...]:
    """Return the names of the root and of all joints: "branch" with the number of the branch, and with a number behind
    it where a branch has several joints.
    """
    branches = bones.branch[bones.part]
    joined = np.append(np.diff(branches) == 0, False) | (bones.number > 0)
    plain = [f"branch{branch}" for branch in branches.tolist()]
    numbered = (
        f"{name}_{number}" if of_chain else name
        for name, number, of_chain in zip(plain, bones.number.tolist(), joined.tolist())
    )
    return (ROOT, *distinct(numbered))
