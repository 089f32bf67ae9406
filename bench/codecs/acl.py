"""Baseline: tracks of a skeleton with bit rates of their own, as games store animation.

Frechette, "Animation Compression Library" (ACL, 2017 and later): every bone has a track of rotations and one of
translations against its parent; segments of 16 frames have a range each, and the fewest bits per number, from none to
19, that keep the error at the bone's skin. Numbers are packed without entropy coding. A second tier, with every other
frame, may come later; without it those frames are interpolated.

Bones are runs of vertices along the branches, a leaf being one; two neighbours on a branch share the skin between them
by linear weights. All that a rigger would do is done by least squares, and kinder than ACL: a bone turns about the
point that stays nearest to its parent, tracks follow the decoded parent, so errors do not add up, and ranges are
entropy coded. What a skeleton cannot follow is corrected as in all baselines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from athcodec.motion.hierarchy import Hierarchy
from bench.codecs import Source
from bench.codecs.baseline import Baseline, Choice, Ladder, Settings
from bench.codecs.coder import Reader, Writer
from bench.codecs.lengyel import Parts, quaternions
from bench.codecs.pca import GRID
from bench.codecs.tree import VertexOrder, memo, ordered, read_order, read_pose, vertex_order, write_order, write_pose

SEGMENT = 16  # frames
MOST_BITS = 19
RANGE_STEPS = 8  # Steps of a range's ends, per error of a number.
HELD = 1e-4  # Weight of keeping a hinge at its bone's middle, relative to that of fitting the motion.
BLOCK = 1024  # vertices

Follow = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class SkeletalTracks(Baseline):
    name = "skeletal tracks (ACL)"

    def __init__(self, tiers: int = 2):
        super().__init__()
        self.tiers = tiers  # Tiers that are read.

    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        """Return the values that the search tries for each setting: quantisation step, vertices per bone, whether
        neighbouring bones are blended, and which pose the bones are fitted to.
        """
        return {
            "step": Ladder.geometric(0.25, 16, 2.0),
            "bone": Ladder((6, 12, 24, 48, 96, 192, 384), 2),
            "blend": Choice((1, 0)),
            "pose_of": Choice(("rest", "mean")),
            "pose": GRID["pose"].starting_at(0.25),
        }

    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        """Write the clip as rotations and offsets of bones, and return the order in which the decoder gets the
        vertices. `bound` is the error bound in scene units; `settings` has a value for each key of `grid`.
        """
        order = vertex_order(source, "hierarchy")
        write_order(writer, order)
        positions = ordered(source, order)
        frames = writer.count(positions.shape[2])
        pose = positions.mean(axis=2) if settings["pose_of"] == "mean" else source.rest[order.source].astype(np.float64)
        pose = write_pose(writer, order, pose, settings["pose"] * bound)
        bones = Bones(order.hierarchy, writer.count(settings["bone"]), pose)
        writer.count(settings["blend"])
        key = ("bones", settings["bone"], settings["pose_of"], settings["pose"] * bound)
        turns, shifts, hinges = memo(source, key, lambda: bones.fitted(positions))
        step = writer.single(settings["step"] * bound)
        hinges = writer.table(np.rint((hinges - bones.parts.centre) / step)) * step + bones.parts.centre
        tracks = [_Track(step / (2 * bones.radius), frames), _Track(np.full(bones.count, step), frames)]

        def coded(some: np.ndarray, turn: np.ndarray, at: np.ndarray) -> np.ndarray:
            wanted = np.swapaxes(turn, 2, 3) @ turns[some]
            target = _moved(turns[some], shifts[some], hinges[some])
            offset = (np.swapaxes(turn, 2, 3) @ (target - at)[..., None])[..., 0]
            quaternion = quaternions(wanted)[..., 1:]
            return np.stack([track.write(some, x) for track, x in zip(tracks, (quaternion, offset), strict=True)])

        bones.follow(hinges, frames, coded)
        for track in tracks:
            for table in track.ranges():
                writer.table(table)
        for tier in (0, 1):
            writer.bits(np.concatenate([track.bits(tier) for track in tracks]))
        return order

    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        """Read what `write` has written. Return the decoded positions (N, 3, T) and the order of their vertices."""
        order, frames = read_order(reader), reader.count()
        pose = read_pose(reader, order)
        bones, blend, step = Bones(order.hierarchy, reader.count(), pose), reader.count(), reader.single()
        hinges = reader.table() * step + bones.parts.centre
        tracks = [_Track(step / (2 * bones.radius), frames), _Track(np.full(bones.count, step), frames)]
        for track in tracks:
            track.set_ranges(reader.table(), reader.table())
        for tier in range(self.tiers):
            bits, at = reader.bits(), 0
            for track in tracks:
                at = track.set_bits(tier, bits, at)
        values = [track.values() if self.tiers == 2 else track.between() for track in tracks]
        turns, shifts = bones.follow(hinges, frames, lambda some, turn, at: np.stack([x[some] for x in values]))
        return bones.skin(turns, shifts, bool(blend)), order


@dataclass(eq=False)
class _Track:
    """Three numbers of every bone and frame within `error` (bones,) each, in segments with ranges of their own."""

    error: np.ndarray
    frames: int

    def __post_init__(self) -> None:
        self.unit = self.error / np.sqrt(3) / RANGE_STEPS
        segments = -(-self.frames // SEGMENT)
        self.low, self.extent = (np.zeros((len(self.error), segments, 3), np.int64) for _ in range(2))
        self.codes = np.zeros((len(self.error), segments, SEGMENT, 3), np.int64)

    def write(self, some: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Quantise and store three numbers per frame, `numbers` (M, T, 3), of the M bones that `some` lists. Return the
        values (M, T, 3) that a decoder gets.
        """
        padded = np.pad(numbers, ((0, 0), (0, -self.frames % SEGMENT), (0, 0)), "edge")
        padded = padded.reshape(len(some), -1, SEGMENT, 3) / self.unit[some, None, None, None]
        self.low[some] = np.floor(padded.min(axis=2))
        self.extent[some] = np.ceil(padded.max(axis=2)) - self.low[some]
        share = (padded - self.low[some][:, :, None]) / np.maximum(self.extent[some], 1)[:, :, None]
        self.codes[some] = np.rint(share * ((1 << self._rates(some)) - 1)[:, :, None, None])
        return self.values(some)

    def _rates(self, some: np.ndarray | slice) -> np.ndarray:
        """Return (M, segments) bits of a number: its steps are at most two errors apart."""
        steps = self.extent[some].max(axis=2) / (2 * RANGE_STEPS)
        return np.where(steps <= 1, 0, np.minimum(np.ceil(np.log2(1 + steps)), MOST_BITS)).astype(np.int64)

    def values(self, some: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Return (M, T, 3)"""
        most = ((1 << self._rates(some)) - 1)[:, :, None, None]
        share = np.where(most > 0, self.codes[some] / np.maximum(most, 1), 0.5)
        numbers = (self.low[some][:, :, None] + share * self.extent[some][:, :, None]) * self.unit[
            some, None, None, None
        ]
        return numbers.reshape(len(numbers), -1, 3)[:, : self.frames]

    def between(self) -> np.ndarray:
        """Return (M, T, 3) with frames of odd numbers from those beside them."""
        numbers = self.values()
        last = self.frames - 1 & ~1
        numbers[:, 1:last:2] = (numbers[:, :last:2] + numbers[:, 2 : last + 1 : 2]) / 2
        numbers[:, last + 1 :] = numbers[:, last : last + 1]
        return numbers

    def ranges(self) -> list[np.ndarray]:
        """Return two tables with a row for each bone: the least values of its segments, as differences, and their
        extents."""
        low = np.diff(self.low, axis=1, prepend=0)
        return [table.reshape(len(table), -1) for table in (low, self.extent)]

    def set_ranges(self, low: np.ndarray, extent: np.ndarray) -> None:
        self.low, self.extent = np.cumsum(low.reshape(self.low.shape), axis=1), extent.reshape(self.low.shape)

    def _layout(self, tier: int) -> tuple[np.ndarray, np.ndarray]:
        """Return bits of each number of a tier, in order, and where they begin."""
        rates = self._rates(slice(None))[:, :, None, None]
        rates = np.broadcast_to(rates, (*rates.shape[:2], SEGMENT // 2, 3)).ravel()
        return rates, np.cumsum(rates) - rates

    def bits(self, tier: int) -> np.ndarray:
        """Return the bits, one per byte, of the values in frames of even (tier 0) or odd (tier 1) number."""
        (rates, begin), codes = self._layout(tier), self.codes[:, :, tier::2].ravel()
        bits = np.zeros(rates.sum(), np.uint8)
        for bit in range(rates.max(initial=0)):
            has = rates > bit
            bits[begin[has] + bit] = codes[has] >> bit & 1
        return bits

    def set_bits(self, tier: int, bits: np.ndarray, at: int) -> int:
        """Set the integers of the even (`tier` 0) or odd (`tier` 1) frames from an array of single bits, which is read
        from index `at` on. Return the index of the first bit that was not used.
        """
        rates, begin = self._layout(tier)
        codes = np.zeros(len(rates), np.int64)
        for bit in range(rates.max(initial=0)):
            has = rates > bit
            codes[has] |= bits[at + begin[has] + bit].astype(np.int64) << bit
        shape = self.codes[:, :, tier::2].shape
        self.codes[:, :, tier::2] = codes.reshape(shape)
        return at + int(rates.sum())


class Bones:
    """Runs of at most `size` vertices along the branches, each but those of roots on a parent with a lower number."""

    def __init__(self, hierarchy: Hierarchy, size: int, pose: np.ndarray):
        """Cut every branch of a hierarchy into bones of about `size` vertices each. `pose` (N, 3) has the positions
        that the bones' rotations are measured from.
        """
        branch = hierarchy.vertex_branch()
        self.place = np.arange(len(branch)) - hierarchy.first_vertex[branch]
        count = np.maximum(1, np.rint(hierarchy.stem_count / size).astype(int))  # bones of a branch
        first = np.cumsum(count) - count
        self.length = (hierarchy.stem_count / count)[branch]  # vertices of a bone
        self.of_vertex = first[branch] + np.minimum(self.place / self.length, count[branch] - 1).astype(int)
        self.branch, self.pose, self.count = np.repeat(np.arange(len(count)), count), pose, int(count.sum())
        self.parts = Parts(self.of_vertex, pose)
        self.parent = np.arange(self.count) - 1
        self.parent[first] = np.where(hierarchy.attach < 0, -1, self.of_vertex[hierarchy.attach])

    @property
    def radius(self) -> np.ndarray:
        """(bones,) farthest vertex from the middle."""
        far = np.linalg.norm(self.parts.around, axis=1)
        radius = np.zeros(self.count)
        np.maximum.at(radius, self.of_vertex, far)
        return np.maximum(2 * radius, 1e-9)  # a hinge is at an end

    def generations(self) -> Iterator[np.ndarray]:
        depth = np.zeros(self.count, int)
        for bone, parent in enumerate(self.parent.tolist()):
            depth[bone] = depth[parent] + 1 if parent >= 0 else 0
        yield from np.split(np.argsort(depth, kind="stable"), np.cumsum(np.bincount(depth))[:-1])

    def fitted(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Fit rigid bones to positions (N, 3, T). Return their rotations (bones, T, 3, 3) and translations (bones, T,
        3) from the reference pose, and the hinges (bones, 3): the points of that pose about which each bone turns.
        """
        centre, turns = self.parts.rigid_maps(self.parts.fit_rigid(positions))
        shifts = np.moveaxis(centre, 1, 2) - (turns @ self.parts.centre[:, None, :, None])[..., 0]
        hinges = self.parts.centre.copy()
        for some in np.array_split(np.arange(self.count), -(-self.count // BLOCK)):
            below = self.parent[some]
            root = (below < 0)[:, None, None]
            apart = turns[some] - np.where(root[..., None], np.eye(3), turns[below])
            drift = shifts[some] - np.where(root, 0.0, shifts[below])
            normal = np.einsum("ntki,ntkj->nij", apart, apart)
            held = (HELD * np.trace(normal, axis1=1, axis2=2) + 1e-12)[:, None]
            middle = self.parts.centre[some]
            wanted = held * middle - np.einsum("ntki,ntk->ni", apart, drift)
            hinges[some] = np.linalg.solve(normal + held[..., None] * np.eye(3), wanted[..., None])[..., 0]
        return turns, shifts, hinges

    def follow(self, hinges: np.ndarray, frames: int, tracks: Follow) -> tuple[np.ndarray, np.ndarray]:
        """Chain the bones from the root outwards and return their absolute rotations (bones, T, 3, 3) and translations
        (bones, T, 3).

        For each generation, `tracks(bones, turns, places)` is called with the numbers of M bones, the rotations of
        their parents, and the positions to which these move the hinges. It returns (2, M, T, 3): the vector parts of
        relative quaternions, and offsets from those positions.
        """
        turns, shifts = np.empty((self.count, frames, 3, 3)), np.empty((self.count, frames, 3))
        for some in self.generations():
            below = self.parent[some]
            turn, at = turns[below], _moved(turns[below], shifts[below], hinges[some])
            if below[0] < 0:
                turn, at = np.broadcast_to(np.eye(3), turn.shape), np.broadcast_to(hinges[some][:, None], at.shape)
            vector, offset = tracks(some, turn, at)
            turns[some] = turn @ _turns(vector)
            shifts[some] = at + (turn @ offset[..., None])[..., 0] - _moved(turns[some], 0.0, hinges[some])
        return turns, shifts

    def skin(self, turns: np.ndarray, shifts: np.ndarray, blend: bool) -> np.ndarray:
        """Return the vertices (N, 3, T) that bones with rotations (bones, T, 3, 3) and translations (bones, T, 3) move.
        With `blend`, a vertex mixes its own bone with the nearest other bone of its branch.
        """
        along = (self.place - self._first_place()[self.of_vertex] + 0.5) / self.length - 0.5
        other = np.clip(self.of_vertex + np.where(along < 0, -1, 1), 0, self.count - 1)
        weight = np.abs(along) * blend * (self.branch[other] == self.branch[self.of_vertex])
        positions = np.empty((len(self.pose), 3, turns.shape[1]))
        for start in range(0, len(self.pose), BLOCK):
            some = slice(start, start + BLOCK)
            w, pose = weight[some, None, None], self.pose[some]
            moved = _moved(turns[self.of_vertex[some]], shifts[self.of_vertex[some]], pose)
            if w.any():
                moved = (1 - w) * moved + w * _moved(turns[other[some]], shifts[other[some]], pose)
            positions[some] = np.moveaxis(moved, 1, 2)
        return positions

    def _first_place(self) -> np.ndarray:
        """Return (bones,) place of the first vertex on the branch."""
        return self.place[np.unique(self.of_vertex, return_index=True)[1]]


def _moved(turns: np.ndarray, shifts: np.ndarray | float, points: np.ndarray) -> np.ndarray:
    """Return (M, T, 3) points (M, 3) under maps."""
    return (turns @ points[:, None, :, None])[..., 0] + shifts


def _turns(vector: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) of unit quaternions, given their vector parts (..., 3); the scalar part
    is positive.
    """
    square = (vector**2).sum(axis=-1, keepdims=True)
    vector = vector / np.sqrt(np.maximum(square, 1.0))
    w = np.sqrt(np.maximum(1 - square, 0.0))[..., None]
    cross = np.zeros((*vector.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -vector[..., 2], vector[..., 1], -vector[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    return np.eye(3) + 2 * w * cross + 2 * (cross @ cross)
