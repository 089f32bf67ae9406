"""The three passes of docs/gpu.md in NumPy, in float32 as a GPU has them: what shows that the blocks are whole, and a
program to read beside the shaders."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy import typing as npt

NODE, FOLLOWS, FITTED = 1, 2, 4
MOVED = 1 << 31
SHIFT, ROTATION, WIDE = 64, 65, 128
POLAR_ITERATIONS = 4
FOOTPRINTS = np.array([[32, 0, 0, 0], [32, 16, 0, 0], [32, 27, 16, 5]])
"""Of widths: parts of a correction so many frames from its own."""

LEVEL = np.dtype(
    [(name, "<u4") for name in "words level vertex_count body_count position_count matrix_count depth_count".split()]
    + [(name, "<u4") for name in "vertices bodies order depths bases".split()]
    + [("origin", "<f4", 3), ("reserved", "<u4")]
)
VERTEX = np.dtype([("rest", "<f4", 3), ("binding", "<u4")])
BODY = np.dtype(
    [("flags", "<u4"), ("parent", "<i4"), ("attach", "<i4"), ("way", "<u4"), ("modes", "<u4")]
    + [("first", "<i4"), ("count", "<i4"), ("vertex", "<i4"), ("basis", "<u4"), ("shape_modes", "<u4")]
    + [("rest_point", "<f4", 3), ("tangent", "<f4", 3)]
)
ROW = np.dtype([("values", "<u4"), ("count", "<u2"), ("slot", "u1"), ("waves", "u1"), ("step", "<f4")])
MOVE = np.dtype([("row", "<u4"), ("rows", "<u2"), ("shape_count", "<u2"), ("shapes", "<u4"), ("turn", "<u4")])
CORRECTION = np.dtype([("value", "<i2", 3), ("frame", "u1"), ("width", "u1")])
SEGMENT = np.dtype(
    [(name, "<u4") for name in "words level segment frames join_frames row_count corrected_count".split()]
    + [("correction_part", "<f4")]
    + [(name, "<u4") for name in "moves rows values shapes turns join_curve join_steps joins matrix_joins".split()]
    + [(name, "<u4") for name in "corrected corrections baked".split()]
    + [("wave_sets", "<u4", 34)]
)


def section(words: np.ndarray, at: int, dtype: npt.DTypeLike, count: int) -> np.ndarray:
    """Return `count` records of a type from word `at` of a block on."""
    size = np.dtype(dtype).itemsize // 4
    return words[at : at + size * count].view(dtype)


def head(words: np.ndarray, dtype: np.dtype) -> np.void:
    """Return the header of a block."""
    return section(words, 0, dtype, 1)[0]


class Source:
    """A segment at some of its frames, and how much each counts.

    Parameters
    ----------
    segment : (W,) uint32
        The block of the segment.
    frames : (T,) int
        Coded frames of the segment.
    weights : (T,) float, optional
        Of the frames, 1 where not given. Those of all sources of a picture add up to 1.
    """

    def __init__(self, segment: np.ndarray, frames: np.ndarray, weights: np.ndarray | None = None):
        self.words, self.head, self.frames = segment, head(segment, SEGMENT), np.asarray(frames)
        self.weights = np.ones(len(self.frames), np.float32) if weights is None else np.asarray(weights, np.float32)
        self._amplitudes = np.zeros((0, 3, len(self.frames)), np.float32) if self.head["baked"] else self._over_time()

    # ---- pass 1: time ----

    def _over_time(self) -> np.ndarray:
        """Return the value of each row of integers in each frame on three axes, (rows, 3, frames), float32."""
        rows = section(self.words, self.head["rows"], ROW, self.head["row_count"])
        out = np.zeros((len(rows), 3, len(self.frames)), np.float32)
        for i, row in enumerate(rows):
            first = self.head["wave_sets"][row["waves"] & (WIDE - 1)]
            waves = section(self.words, first, "<f4", row["count"] * self.head["frames"])
            waves = waves.reshape(row["count"], -1)[:, self.frames]
            out[i] = self.weights * row["step"] * (self._values(row).astype(np.float32) @ waves)
        return out

    def _values(self, row: np.void) -> np.ndarray:
        at, count = self.head["values"] + row["values"], 3 * int(row["count"])
        if row["waves"] & WIDE:
            return section(self.words, at, "<i4", count).reshape(3, -1)
        return self.words[at : at + (count + 1) // 2].view("<i2")[:count].reshape(3, -1)

    # ---- what moves a body ----

    def _move(self, b: int) -> tuple[np.void, dict[int, np.ndarray]]:
        """Return its ath_gpu_move, and the amplitudes of its rows by slot."""
        move = section(self.words, self.head["moves"] + 4 * b, MOVE, 1)[0]
        rows = section(self.words, self.head["rows"] + 3 * move["row"], ROW, move["rows"])
        return move, dict(zip(rows["slot"].tolist(), self._amplitudes[move["row"] :], strict=False))

    def shift(self, b: int) -> np.ndarray:
        """Return how far body number `b` is shifted in each frame, (frames, 3)."""
        return self._move(b)[1].get(SHIFT, np.zeros((3, len(self.frames)), np.float32)).T

    def turn(self, b: int) -> np.ndarray:
        """Return the rotation vector of body number `b` in each frame, (frames, 3)."""
        move, tracks = self._move(b)
        if ROTATION not in tracks:
            return np.zeros((len(self.frames), 3), np.float32)
        turn = section(self.words, self.head["turns"] + move["turn"], "<f4", 9).reshape(3, 3)
        return tracks[ROTATION].T @ turn.T

    def modes(self, b: int, body: np.void) -> np.ndarray:
        """Return the amplitudes (modes, 3, frames) of all modes of body number `b` on three axes. `body` is its record
        in the block.
        """
        move, tracks = self._move(b)
        modes = {slot: track for slot, track in tracks.items() if slot < SHIFT}
        if move["shape_count"] > 0:
            modes = self._unshaped(body, move, modes)
        out = np.zeros((body["modes"], 3, len(self.frames)), np.float32)
        for mode, track in modes.items():
            out[mode] = track
        return out

    def _unshaped(self, body: np.void, move: np.void, rows: dict[int, np.ndarray]) -> dict[int, np.ndarray]:
        """Return the amplitudes of modes, (3, frames) by the mode's number. The first rows of a body can be amplitudes
        of shapes, which are sums of modes; these are replaced by the modes.
        """
        modes, count = int(body["shape_modes"]), int(move["shape_count"])
        shapes = section(self.words, self.head["shapes"] + move["shapes"], "<f4", 3 * modes * count)
        shapes = shapes.reshape(count, modes, 3)
        out = {slot: track for slot, track in rows.items() if slot >= modes}
        sums = np.zeros((modes, 3, len(self.frames)), np.float32)
        for slot, track in rows.items():
            for axis in range(3):
                shape = 3 * slot + axis
                if slot < modes and shape < count:
                    sums += shapes[shape][:, :, None] * track[axis]
        return out | dict(enumerate(sums))

    # ---- joins, corrections ----

    def join(self, bodies: np.ndarray, positions: np.ndarray, matrices: np.ndarray) -> None:
        """Add to positions and matrices, in place, what remains in each frame of the jump at the segment's seam."""
        frames = self.head["join_frames"]
        joined = self.frames < frames
        if not joined.any():
            return
        curve = section(self.words, self.head["join_curve"], "<f4", 2 * frames).reshape(-1, 2)[self.frames[joined]]
        curve = curve * self.weights[joined, None]
        count = positions.shape[1]
        integers = self.words[self.head["joins"] : self.head["joins"] + 3 * count].view("<i2").reshape(count, 3, 2)
        steps = section(self.words, self.head["join_steps"], "<f4", 2 * len(bodies)).reshape(-1, 2)
        is_piece = (bodies["flags"] & NODE) == 0
        off = integers * np.repeat(steps[is_piece], bodies["count"][is_piece], axis=0)[:, None]
        positions[joined] += np.einsum("vak,tk->tva", off, curve)
        at, size = self.head["matrix_joins"], 24 * matrices.shape[1]
        off = section(self.words, at, "<f4", size).reshape(-1, 12, 2)
        added = np.einsum("mik,tk->tmi", off, curve)
        matrices[joined, :, :, :3] += added[:, :, :9].reshape(*added.shape[:2], 3, 3)
        matrices[joined, :, :, 3] += added[:, :, 9:]

    def correct(self, positions: np.ndarray) -> None:
        """Add the corrections of vertices to positions, in place."""
        count = self.head["corrected_count"]
        if not count:
            return
        corrected = section(self.words, self.head["corrected"], "<u4", 2 * count + 2).reshape(-1, 2)
        corrections = section(self.words, self.head["corrections"], CORRECTION, corrected[-1, 1])
        of = np.repeat(corrected[:-1, 0], np.diff(corrected[:, 1]))
        parts = FOOTPRINTS[corrections["width"] & 15] << (corrections["width"] >> 4)[:, None]
        away = np.abs(self.frames[:, None] - corrections["frame"])
        part = np.where(away < 4, np.take_along_axis(parts, np.minimum(away, 3).T, axis=1).T, 0)
        sums = np.zeros(positions.shape)
        for i in range(len(self.frames)):
            np.add.at(sums[i], of, corrections["value"] * part[i][:, None])
        sums *= self.weights[:, None, None]
        positions += (sums * self.head["correction_part"]).astype(np.float32)

    def baked(self, shape: tuple[int, ...]) -> np.ndarray:
        """Return positions that the block stores frame by frame, weighted, (frames, positions, 3)."""
        shape = int(self.head["frames"]), *shape[1:]
        every = section(self.words, self.head["baked"], "<f4", int(np.prod(shape))).reshape(shape)
        return every[self.frames] * self.weights[:, None, None]


class Passes:
    """Positions that the blocks of a level and of its segments give: frames of one segment, or of several, blended.

    Parameters
    ----------
    level : (W,) uint32
        The block of the level.
    sources : Source
        With as many frames each as pictures are computed.

    Attributes
    ----------
    positions : (frames, positions, 3) float32
    matrices : (frames, matrices, 3, 4) float32, from rest positions to positions
    """

    def __init__(self, level: np.ndarray, *sources: Source):
        """Compute the positions and matrices of a level from its words and from the segments `sources`, which are
        blended by their weights.
        """
        self._level, self._sources, self._of_level = level, sources, head(level, LEVEL)
        self._vertices = section(level, self._of_level["vertices"], VERTEX, self._of_level["vertex_count"])
        self._bodies = section(level, self._of_level["bodies"], BODY, self._of_level["body_count"])
        self._count = count = len(sources[0].frames)
        self.positions = np.zeros((count, self._of_level["position_count"], 3), np.float32)
        self.matrices = np.zeros((count, self._of_level["matrix_count"], 3, 4), np.float32)
        self._attach = np.zeros((count, len(self._bodies), 3, 4), np.float32)
        if any(source.head["baked"] for source in sources):
            self.positions += total([source.baked(self.positions.shape) for source in sources])
            return
        self._modes: dict[int, np.ndarray] = {}  # By piece: (modes, 3, frames).
        for body in section(level, self._of_level["order"], "<u4", len(self._bodies)):
            self._place(int(body))
        for source in sources:
            source.join(self._bodies, self.positions, self.matrices)
            source.correct(self.positions)
        self._finish_matrices()

    # ---- pass 2: hierarchy ----

    def _place(self, b: int) -> None:
        """Compute the rotation, place and vertices, or the matrix, of body number `b` from those of the body that it
        hangs on.
        """
        body, sources = self._bodies[b], self._sources
        point, rotation = self._hung(body)
        point = point + total([source.shift(b) for source in sources])
        rotation = rotation @ rotations(total([source.turn(b) for source in sources]))
        modes = self._modes[b] = total([source.modes(b, body) for source in sources])
        local = np.tensordot(modes, self._basis(body["basis"], len(modes), body["count"]), (0, 0)).transpose(1, 2, 0)
        if body["flags"] & NODE:
            matrix = np.swapaxes(np.eye(3, dtype=np.float32) + local, 1, 2)  # its columns are the three positions
            self.matrices[:, body["first"], :, :3] = rotation @ matrix
            self.matrices[:, body["first"], :, 3] = point
            return
        offsets = self._offsets(body)
        placed = np.einsum("tij,tvj->tvi", rotation, offsets + local) + point[:, None]
        self.positions[:, body["first"] : body["first"] + body["count"]] = placed
        if body["flags"] & FITTED:
            rotation = rotation @ fitted(offsets, offsets + local)
        self._attach[:, b, :, :3], self._attach[:, b, :, 3] = rotation, point

    def _offsets(self, body: np.void) -> np.ndarray:
        rest = self._vertices["rest"][body["vertex"] : body["vertex"] + body["count"]]
        return rest - body["rest_point"]

    def _hung(self, body: np.void) -> tuple[np.ndarray, np.ndarray]:
        """Return the place (frames, 3) at which a body hangs and the rotation (frames, 3, 3) there, before the body's
        own motion.
        """
        count = self._count
        if body["parent"] < 0:
            return np.tile(body["rest_point"], (count, 1)), np.tile(np.eye(3, dtype=np.float32), (count, 1, 1))
        base = self._attach[:, body["parent"]]
        point, rotation = self.positions[:, body["attach"]], base[:, :, :3]
        if body["flags"] & FOLLOWS:
            modes = self._modes[body["parent"]]
            way = np.tensordot(modes, self._basis(body["way"], len(modes), 1)[:, 0], (0, 0)).T
            rotation = rotation @ between(unit(body["tangent"]), unit(body["tangent"] + way))
        return point, rotation

    def _basis(self, at: int, modes: int, count: int) -> np.ndarray:
        return section(self._level, self._of_level["bases"] + at, "<f4", modes * count).reshape(modes, count)

    def _finish_matrices(self) -> None:
        """Turn R and c of x = c + R (x0 - a) into what is added to R x0."""
        points = self._bodies["rest_point"][(self._bodies["flags"] & NODE) != 0]
        self.matrices[:, :, :, 3] -= np.einsum("tmij,mj->tmi", self.matrices[:, :, :, :3], points)

    # ---- pass 3: vertices ----

    def vertices(self) -> np.ndarray:
        """Return the positions (frames, vertices, 3) of all vertices in the file's order, float32, relative to the
        file's origin.
        """
        binding = self._vertices["binding"]
        moved, index = (binding & MOVED) != 0, (binding & ~np.uint32(MOVED)).astype(int)
        out = np.empty((self._count, len(binding), 3), np.float32)
        out[:, ~moved] = self.positions[:, index[~moved]]
        matrices = self.matrices[:, index[moved]]
        rest = self._vertices["rest"][moved]
        out[:, moved] = np.einsum("tvij,vj->tvi", matrices[..., :3], rest) + matrices[..., 3]
        return out


def total(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Return the sum of arrays of one shape, added in their order."""
    return reduce(np.add, arrays)


def rotations(omega: np.ndarray) -> np.ndarray:
    """Return (..., 3, 3): of the quaternions normalize(1, omega / 4) squared."""
    return squared(np.float32(0.25) * omega)


def squared(half: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) of the squares of the quaternions (1, x, y, z), normalised; `half` (...,
    3) has x, y and z.
    """
    n2 = (half * half).sum(-1, keepdims=True)
    scale = 1 / (1 + n2)
    w = ((1 - n2) * scale)[..., 0]
    x, y, z = np.moveaxis(2 * half * scale, -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def unit(v: np.ndarray) -> np.ndarray:
    """Return vectors of length 1; those that vanish as they are."""
    n2 = (v * v).sum(-1, keepdims=True)
    return v / np.sqrt(np.where(n2 > 1e-30, n2, 1))


def between(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the rotation matrices of the smallest rotations from unit vectors `u` to unit vectors `v`. Beyond a right
    angle the rotation shrinks, so that opposite vectors need none.
    """
    cosine, axis = (u * v).sum(-1), np.cross(u, v)
    w, sine2 = 1 + np.maximum(cosine, 0), (axis * axis).sum(-1)
    h = 2 / (w * w + sine2)
    x, y, z = np.moveaxis(axis, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
    turn = h[:, None, None] * axis[:, :, None] * axis[:, None] + (h * w)[:, None, None] * cross
    return turn + (1 - h * sine2)[:, None, None] * np.eye(3, dtype=np.float32)


def fitted(offsets: np.ndarray, placed: np.ndarray) -> np.ndarray:
    """Return the rotations (frames, 3, 3) that best take the offsets of a sheet's vertices to their places in each
    frame, drawn towards no rotation with a weight of a hundredth.
    """
    identity = np.eye(3, dtype=np.float32)
    H = np.einsum("tvi,vj->tij", placed, offsets) + np.float32(0.01) * (offsets * offsets).sum() * identity
    norm2 = (H * H).sum((1, 2), keepdims=True)
    H, out = H / np.sqrt(np.where(norm2 > 1e-30, norm2, 1)), np.broadcast_to(identity, H.shape)
    for _ in range(POLAR_ITERATIONS):
        out = turned_towards(H, out)
    return np.where(norm2 > 1e-30, out, identity)


def turned_towards(H: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Return the rotations after one step of Newton's method from `R` towards those nearest to the matrices `H`, both
    (frames, 3, 3).
    """
    C = H @ np.swapaxes(R, 1, 2)
    axial = np.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], -1)
    spare = np.maximum(1 - np.trace(C, axis1=1, axis2=2), 0) + np.float32(1e-6)
    x, y, z = np.diagonal(C, axis1=1, axis2=2).T
    a, b, c = y + z + spare, x + z + spare, x + y + spare  # Differences from the trace would lose precision.
    d, e, f = (-(C[:, i, j] + C[:, j, i]) / 2 for i, j in ((0, 1), (0, 2), (1, 2)))
    adjugate = np.stack(
        [
            np.stack([b * c - f * f, e * f - d * c, d * f - e * b], -1),
            np.stack([e * f - d * c, a * c - e * e, d * e - a * f], -1),
            np.stack([d * f - e * b, d * e - a * f, a * b - d * d], -1),
        ],
        -2,
    )
    determinant = a * adjugate[:, 0, 0] + d * adjugate[:, 0, 1] + e * adjugate[:, 0, 2]
    half = np.einsum("tij,tj->ti", adjugate, axial) * (np.float32(0.25) / determinant)[:, None]
    return squared(half) @ R
