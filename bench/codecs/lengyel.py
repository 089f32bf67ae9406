"""Baseline: one moving frame per part, and principal components of the residuals.

Lengyel, "Compression of time-dependent geometry", I3D 1999: vertices are grouped, each
group is moved by an affine or rigid map per frame, and the residuals are coded. Here parts are the stems of
the branches, or whole subtrees below some depth, in place of his greedy clustering; the maps' tracks go
through a transform in time (athcodec's waves or a learned basis), and the residuals through PCA (pca.py), both better
than what the paper has. Maps are fitted in the space of their own part (affine: orthonormal functions of the
coded pose; rigid: a turn about the part's centre), and quantised before the residual is taken. The residual
stays in world space.
"""

from __future__ import annotations

import numpy as np

from athcodec.encoding.model.motion import waves_over_time
from athcodec.motion.hierarchy import Hierarchy
from bench.codecs import Source
from bench.codecs.baseline import Baseline, Choice, Ladder, Settings, Split, quantised
from bench.codecs.coder import Reader, Writer
from bench.codecs.pca import GRID, Trajectories, grid_of, principal, read_group, write_group
from bench.codecs.tree import VertexOrder, memo, ordered, read_order, read_pose, vertex_order, write_order, write_pose

LEAST_EXTENT = 1e-3  # Smallest extent over the part's largest; flatter directions are not stretched.
DEEPEST = 5  # branches with parts of their own
REGULARISATION = 1e-3  # towards no rotation, which determines the twist of straight parts


class Lengyel(Baseline):
    name = "moving frames + PCA (Lengyel)"

    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        """Return the values that the search tries for each setting, such as whether the parts move rigidly, how many
        generations of branches share a part, and the quantisation steps of the parts' motion and of the residual.
        """
        depths = tuple(range(min(DEEPEST, int(source.hierarchy.branch_depth.max())) + 1))
        return grid_of(
            "rigid joint depth step learned keep_tracks tracks keep basis pose_of differences dead_zone pose first",
            rigid=Choice((0, 1)),
            joint=Choice((0, 1), 1),
            depth=Split(depths),
            learned=Choice((0, 1)),
            keep_tracks=GRID["keep"].starting_at(0.1),
            tracks=Ladder.geometric(0.18, 2, 0.7),
            keep=Ladder.geometric(0.01, 40, 0.3),
            pose_of=Choice(("mean", "rest")),
            pose=GRID["pose"].starting_at(0.25),
        )

    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        """Write the clip as the motion of parts and the principal components of the residual. Return the order in which
        the decoder gets the vertices; `bound` is the error bound in scene units.
        """
        order = vertex_order(source, "hierarchy")
        write_order(writer, order)
        positions = ordered(source, order)
        frames = writer.count(positions.shape[2])
        rigid, depth = writer.count(settings["rigid"]), writer.count(settings["depth"])
        trajectories = Trajectories(bool(writer.count(settings["joint"])), frames)
        pose = positions.mean(axis=2) if settings["pose_of"] == "mean" else source.rest[order.source].astype(np.float64)
        pose = write_pose(writer, order, pose, settings["pose"] * bound)
        parts = Parts(part_of_vertex(order.hierarchy, depth), pose)
        track_step = writer.single(settings["tracks"] * settings["step"] * bound)
        fit, place = (parts.fit_rigid, parts.place_rigid) if rigid else (parts.fit_affine, parts.place_affine)
        exact = memo(
            source, ("frames", rigid, depth, settings["pose_of"], settings["pose"] * bound), lambda: fit(positions)
        )
        residual = positions - place(_write_tracks(writer, exact, track_step, settings))
        step = writer.single(settings["step"] * bound)
        # the basis of another trial's residual at about this step is close enough, and saves most of the time
        near = (
            rigid,
            depth,
            settings["joint"],
            settings["pose_of"],
            settings["learned"],
            round(2 * np.log2(track_step)),
        )
        spectrum = memo(source, ("residual", *near), lambda: principal(trajectories.rows(residual)))
        write_group(writer, residual, order, spectrum, step, settings, trajectories)
        return order

    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        """Read what `write` has written. Return the decoded positions (N, 3, T) and the order of their vertices."""
        order = read_order(reader)
        frames, rigid, depth = reader.count(), reader.count(), reader.count()
        trajectories = Trajectories(bool(reader.count()), frames)
        pose, track_step = read_pose(reader, order), reader.single()
        parts = Parts(part_of_vertex(order.hierarchy, depth), pose)
        tracks = _read_tracks(reader, parts.count, frames, track_step).reshape(parts.count, -1, 3, frames)
        moved = parts.place_rigid(tracks) if rigid else parts.place_affine(tracks)
        return moved + read_group(reader, order, reader.single(), trajectories), order


def _write_tracks(writer: Writer, exact: np.ndarray, step: float, settings: Settings) -> np.ndarray:
    """Write the motion of parts, (parts, k, 3, T) with k vectors per part and frame, as athcodec's functions of time or
    by a learned basis. Return the values of the same shape that a decoder gets.
    """
    parts, count, _, frames = exact.shape
    writer.count(count)
    if writer.count(settings["learned"]):
        rows = exact.reshape(-1, 3, frames)
        trajectories = Trajectories(False, frames)
        tracks = write_group(
            writer,
            rows,
            VertexOrder(np.arange(len(rows))),
            principal(trajectories.rows(rows)),
            step,
            settings | {"differences": 0, "keep": settings["keep_tracks"]},
            trajectories,
        )
        return tracks.reshape(exact.shape)
    waves = quantised(exact @ waves_over_time(frames).T / step, settings["dead_zone"])
    writer.rows(waves.reshape(-1, 3, frames), count)
    return (waves * step) @ waves_over_time(frames)


def _read_tracks(reader: Reader, parts: int, frames: int, step: float) -> np.ndarray:
    rows = parts * reader.count()
    if reader.count():
        return read_group(reader, VertexOrder(np.arange(rows)), step, Trajectories(False, frames))
    return (reader.rows() * step) @ waves_over_time(frames)


def part_of_vertex(hierarchy: Hierarchy, depth: int) -> np.ndarray:
    """Return (N,): branches of less than `depth` on their own, those of `depth` with all that they carry."""
    part = np.arange(hierarchy.branch_count)
    for branch, parent in enumerate(hierarchy.branch_parent.tolist()):
        if hierarchy.branch_depth[branch] > depth:
            part[branch] = part[parent]
    return np.unique(part[hierarchy.vertex_branch()], return_inverse=True)[1]


class Parts:
    """Groups of vertices, `of_vertex` (N,), about their centres in a pose (N, 3)."""

    def __init__(self, of_vertex: np.ndarray, pose: np.ndarray):
        self.of_vertex, self.count = of_vertex, int(of_vertex.max()) + 1
        self.sizes = np.bincount(of_vertex)
        self.centre = self.sum_of(pose) / self.sizes[:, None]
        self.pose, self.around = pose, pose - self.centre[of_vertex]

    def sum_of(self, values: np.ndarray) -> np.ndarray:
        """Return the sums of (N, ...) values over each part."""
        by_part = np.argsort(self.of_vertex, kind="stable")
        return np.add.reduceat(values[by_part], np.cumsum(self.sizes) - self.sizes, axis=0)

    # affine: displacement = sum of orthonormal functions of the pose times their tracks

    def functions(self) -> np.ndarray:
        """Return functions over the vertices of each part, (N, 4): a constant and up to three linear ones, orthonormal
        over the part. A column is 0 in a part that has no extent in that direction.
        """
        spread = self.sum_of(self.around[:, :, None] * self.around[:, None])
        extents, axes = np.linalg.eigh(spread)
        least = LEAST_EXTENT**2 * np.maximum(extents[:, 2:], 1e-24)
        scale = np.where(extents > least, 1 / np.sqrt(np.maximum(extents, least)), 0.0)
        linear = (self.around[:, None] @ (axes * scale[:, None])[self.of_vertex])[:, 0]
        constant = 1 / np.sqrt(self.sizes)
        return np.concatenate([constant[self.of_vertex, None], linear[:, ::-1]], axis=1)

    def fit_affine(self, positions: np.ndarray) -> np.ndarray:
        """Return (parts, 4, 3, T) tracks."""
        motion, functions = positions - self.pose[:, :, None], self.functions()
        return np.stack([self.sum_of(functions[:, i, None, None] * motion) for i in range(4)], axis=1)

    def place_affine(self, tracks: np.ndarray) -> np.ndarray:
        functions, positions = self.functions(), np.repeat(self.pose[:, :, None], tracks.shape[3], axis=2)
        for i in range(4):
            positions += functions[:, i, None, None] * tracks[self.of_vertex, i]
        return positions

    # rigid: a shift and a turn of each part, weighted so that a step moves its vertices alike

    def _lever(self) -> np.ndarray:
        """Return root of the sum of squares that a unit turn moves the vertices by, (parts, 1, 1)."""
        square = self.sum_of((self.around**2).sum(axis=1)) * 2 / 3
        return np.sqrt(np.maximum(square, 1e-12))[:, None, None]

    def fit_rigid(self, positions: np.ndarray) -> np.ndarray:
        """Fit a rigid motion of every part to positions (N, 3, T). Return (parts, 2, 3, T): translations first, then
        rotation vectors in radians.
        """
        centre = self.sum_of(positions) / self.sizes[:, None, None]
        around = positions - centre[self.of_vertex]
        spread = np.stack([self.sum_of(around * self.around[:, i, None, None]) for i in range(3)], axis=2)
        spread = np.moveaxis(spread, 3, 1)  # (parts, T, 3, 3): where to, where from
        extent = self.sum_of((self.around**2).sum(axis=1))
        spread = spread + REGULARISATION * np.maximum(extent, 1e-12)[:, None, None, None] * np.eye(3)
        left, _, right = np.linalg.svd(spread)
        left[..., 2] *= np.linalg.det(left @ right)[..., None]
        turns = np.moveaxis(_rotation_vectors(left @ right), 1, 2)
        shifts = (centre - self.centre[:, :, None]) * np.sqrt(self.sizes)[:, None, None]
        return np.stack([shifts, turns * self._lever()], axis=1)

    def rigid_maps(self, tracks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where the centres are, (parts, 3, T), and turns about them, (parts, T, 3, 3)."""
        centre = self.centre[:, :, None] + tracks[:, 0] / np.sqrt(self.sizes)[:, None, None]
        return centre, _rotations(np.moveaxis(tracks[:, 1] / self._lever(), 1, 2))

    def place_rigid(self, tracks: np.ndarray) -> np.ndarray:
        """Return positions (N, 3, T) of all vertices, each moved as its part is by its rigid track."""
        centre, rotation = self.rigid_maps(tracks)
        rotation = np.ascontiguousarray(np.moveaxis(rotation, 1, 3))
        positions = centre[self.of_vertex]
        for i in range(3):
            positions += rotation[self.of_vertex, :, i] * self.around[:, i, None, None]
        return positions


def _rotations(vectors: np.ndarray) -> np.ndarray:
    """Return (..., 3, 3) of (..., 3), by the formula of Rodrigues."""
    angle = np.maximum(np.linalg.norm(vectors, axis=-1), 1e-12)[..., None, None]
    cross = np.zeros((*vectors.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -vectors[..., 2], vectors[..., 1], -vectors[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    return np.eye(3) + np.sin(angle) / angle * cross + (1 - np.cos(angle)) / angle**2 * (cross @ cross)


def _rotation_vectors(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation vectors (parts, T, 3) of rotation matrices (parts, T, 3, 3). Of the vectors that describe one
    rotation, the vector nearest to that of the frame before is taken.
    """
    quaternion = quaternions(rotation)
    for t in range(1, quaternion.shape[1]):
        opposite = (quaternion[:, t] * quaternion[:, t - 1]).sum(axis=-1) < 0
        quaternion[opposite, t] *= -1
    sine = np.linalg.norm(quaternion[..., 1:], axis=-1)
    angle = 2 * np.arctan2(sine, quaternion[..., 0])
    return quaternion[..., 1:] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)[..., None]


def quaternions(rotation: np.ndarray) -> np.ndarray:
    """Return the unit quaternions (..., 4), with a positive scalar first, of the rotation matrices (..., 3, 3)."""
    m = rotation
    trace = np.trace(m, axis1=-2, axis2=-1)
    k = np.zeros((*trace.shape, 4, 4))
    k[..., 0, 0] = trace
    k[..., 0, 1], k[..., 0, 2] = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0]
    k[..., 0, 3] = m[..., 1, 0] - m[..., 0, 1]
    k[..., 1:, 0] = k[..., 0, 1:]
    k[..., 1:, 1:] = m + np.swapaxes(m, -1, -2) - trace[..., None, None] * np.eye(3)
    quaternion = np.linalg.eigh(k)[1][..., 3]
    return np.where(quaternion[..., :1] < 0, -quaternion, quaternion)
