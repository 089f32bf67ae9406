"""Baselines on principal components: global PCA, clustered PCA.

* Alexa and Mueller, "Representing animations by principal components", Computer Graphics Forum 19(3), 2000:
  the matrix of all frames is a sum of products of a shape and a track in time. Either factor is quantised
  first, the other fitted to it by least squares; trajectories are one per coordinate (shared basis of T
  numbers) or one per vertex (of 3T).
* Sattler, Sarlette and Klein, "Simple and efficient compression of animation sequences", SCA 2005:
  trajectories in clusters with a basis each (Lloyd's algorithm with the distance to a cluster's basis).

Left out of all: removal of rigid motion (a plant is rooted), and meshes' connectivity (the order of vertices
replaces it). The mean of each vertex is subtracted and coded. The larger of the two factors has a
uniform step (uniform error in the positions); each component of the smaller one gets the precision that it needs. Basis
vectors are coded as they are or by athcodec's waves (for smooth ones), whichever is smaller. None of the papers
predicts coefficients from a neighbour's; here each component may be, by differences of the integers along the order of
vertices, because that halves the sizes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec.encoding.model.motion import waves_over_time
from bench.codecs import Source, blocks
from bench.codecs.baseline import Baseline, Choice, Ladder, Settings, Split, quantised
from bench.codecs.coder import Reader, Writer
from bench.codecs.tree import (
    ORDERS,
    VertexOrder,
    differences,
    memo,
    ordered,
    read_order,
    read_pose,
    sums,
    vertex_order,
    write_order,
    write_pose,
)

COARSEST_BASIS = -2  # half octaves
GRID: dict[str, Ladder | Choice] = {
    "step": Ladder.geometric(0.5, 12, 2.0, 4),
    "keep": Ladder.geometric(0.01, 2.5, 0.15),
    "basis": Ladder.geometric(0.05, 4, 0.7),
    "joint": Split((0, 1)),
    "differences": Choice((0, 1, 2), 2),
    "first": Choice(("tracks", "shapes")),
    "dead_zone": Ladder((0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8), 2),
    "pose": Ladder.geometric(0.05, 2, 0.5),
    "order": Choice(ORDERS, 1),
}


def grid_of(names: str, **parameters: Ladder | Choice) -> dict[str, Ladder | Choice]:
    """Return settings by name, in the order of the search: those of GRID, and the codec's own."""
    return {name: parameters.get(name) or GRID[name] for name in names.split()}


# ---- trajectories and bases ----


@dataclass
class Trajectories:
    """Rows that share a basis: (3N, T) one per coordinate, or, `joint`, (N, 3T) one per vertex."""

    joint: bool
    frames: int

    def rows(self, motion: np.ndarray) -> np.ndarray:
        """Return the rows of (N, 3, T) motion."""
        return motion.reshape(-1, 3 * self.frames if self.joint else self.frames)

    def motion(self, rows: np.ndarray) -> np.ndarray:
        return rows.reshape(-1, 3, self.frames)

    def to_axes(self, coefficients: np.ndarray) -> np.ndarray:
        """Return (N, 3, F) for code_row of coefficients (rows, K): joint components take the axes by turns."""
        if not self.joint:
            return coefficients.reshape(-1, 3, coefficients.shape[1])
        missing = -coefficients.shape[1] % 3
        padded = np.pad(coefficients, ((0, 0), (0, missing)))
        return padded.reshape(len(padded), -1, 3).transpose(0, 2, 1)

    def from_axes(self, axes: np.ndarray, count: int) -> np.ndarray:
        if not self.joint:
            return axes.reshape(-1, axes.shape[2])
        return axes.transpose(0, 2, 1).reshape(len(axes), -1)[:, :count]


def principal(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return singular values, descending, and orthonormal rows (min(shape), length)."""
    values, vectors = np.linalg.eigh(rows.T @ rows)
    count = min(rows.shape)
    return np.sqrt(np.maximum(values[::-1][:count], 0)), np.ascontiguousarray(vectors[:, ::-1][:, :count].T)


def mean_of(source: Source, order: VertexOrder) -> np.ndarray:
    """Return (N, 3) mean of each vertex."""
    return memo(source, ("mean", order.hierarchy is not None), lambda: ordered(source, order).mean(axis=2))


def mean_motion(source: Source, order: VertexOrder) -> np.ndarray:
    """Return (N, 3, T) motion about the mean."""
    return ordered(source, order) - mean_of(source, order)[:, :, None]


def source_basis(source: Source, order: VertexOrder, trajectories: Trajectories) -> tuple[np.ndarray, np.ndarray]:
    return memo(
        source, ("principal", trajectories.joint), lambda: principal(trajectories.rows(mean_motion(source, order)))
    )


def write_basis(writer: Writer, basis: np.ndarray, steps: np.ndarray, trajectories: Trajectories) -> np.ndarray:
    """Quantise and write the rows of a basis (K, length), each by about its own step of `steps` (K,). Return the basis
    (K, length) that a decoder gets.
    """
    exponents = np.minimum(np.rint(2 * np.log2(steps)), COARSEST_BASIS).astype(np.int64)
    writer.table(np.diff(exponents, prepend=COARSEST_BASIS)[None])
    steps = 2.0 ** (exponents / 2)
    tracks = basis.reshape(len(basis), -1, trajectories.frames)
    plain = np.rint(tracks / steps[:, None, None])
    waves = np.rint(tracks @ waves_over_time(trajectories.frames).T / steps[:, None, None])
    kind = writer.count(int(np.log2(1 + np.abs(waves)).sum() < np.log2(1 + np.abs(plain)).sum()))
    writer.rows(_in_threes((plain, waves)[kind].reshape(-1, trajectories.frames)))
    tracks = waves @ waves_over_time(trajectories.frames) if kind else plain
    return (tracks * steps[:, None, None]).reshape(basis.shape)


def read_basis(reader: Reader, trajectories: Trajectories) -> np.ndarray:
    """Read a basis of trajectories and return it as (K, length): one row per component, with as many numbers as a
    trajectory has.
    """
    steps = 2.0 ** ((np.cumsum(reader.table()[0]) + COARSEST_BASIS) / 2)
    kind = reader.count()
    width = 3 if trajectories.joint else 1
    tracks = reader.rows().reshape(-1, trajectories.frames)[: width * len(steps)].astype(np.float64)
    tracks = tracks.reshape(len(steps), width, -1)
    if kind:
        tracks = tracks @ waves_over_time(trajectories.frames)
    return (tracks * steps[:, None, None]).reshape(len(steps), -1)


def _in_threes(tracks: np.ndarray) -> np.ndarray:
    """Return (R, T) as rows of three axes."""
    return np.pad(tracks, ((0, -len(tracks) % 3), (0, 0))).reshape(-1, 3, tracks.shape[1])


# ---- one group of trajectories ----


def write_coefficients(
    writer: Writer, q: np.ndarray, order: VertexOrder, trajectories: Trajectories, most: int
) -> None:
    """Write integer coefficients (rows, K). Each component is coded by its differences from vertex to vertex, of the
    degree from 0 to `most` that makes its stream smallest.
    """
    q = q.reshape(len(order.source), -1, q.shape[1])
    costs = np.array([_cost(differences(q, order, degree)) for degree in range(most + 1)])
    degrees = writer.table(np.argmin(costs, axis=0)[None])[0]
    chosen = np.empty_like(q)
    for degree in np.unique(degrees):
        chosen[:, :, degrees == degree] = differences(q[:, :, degrees == degree], order, degree)
    writer.rows(trajectories.to_axes(chosen.reshape(-1, q.shape[2])))


def _cost(q: np.ndarray) -> np.ndarray:
    """Return about the bits of each component."""
    return sum(np.log2(1 + np.abs(q[some])).sum(axis=(0, 1)) for some in blocks(q))


def read_coefficients(reader: Reader, order: VertexOrder, trajectories: Trajectories) -> np.ndarray:
    degrees = reader.table()[0]
    q = trajectories.from_axes(reader.rows(), len(degrees)).reshape(len(order.source), -1, len(degrees)).copy()
    for degree in (1, 2):
        q[:, :, degrees == degree] = sums(q[:, :, degrees == degree], order, degree)
    return q.reshape(-1, len(degrees))


def significant(
    spectrum: tuple[np.ndarray, np.ndarray],
    rows: np.ndarray,
    step: float,
    settings: Settings,
    trajectories: Trajectories,
    least: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the basis vectors that are worth their bytes, at least `least`, and the step of each."""
    values, basis = spectrum
    count = max(least, int((values > settings["keep"] * step * np.sqrt(len(rows))).sum()))
    steps = settings["basis"] * step * np.sqrt(len(rows) / trajectories.frames) / np.maximum(values[:count], 1e-30)
    return basis[:count], steps


def write_group(
    writer: Writer,
    motion: np.ndarray,
    order: VertexOrder,
    spectrum: tuple[np.ndarray, np.ndarray],
    step: float,
    settings: Settings,
    trajectories: Trajectories,
) -> np.ndarray:
    """Write the motion (N, 3, T) of some vertices as quantised coefficients times a basis. `spectrum` has the motion's
    singular values and singular vectors, and `step` is the quantisation step in scene units.

    Return the motion (N, 3, T) that a decoder gets.
    """
    rows = trajectories.rows(motion)
    basis, steps = significant(spectrum, rows, step, settings, trajectories)
    if writer.count(len(basis)) == 0:
        return np.zeros_like(motion)
    if settings["first"] == "shapes":
        q = quantised(rows @ basis.T / step, settings["dead_zone"])
        shapes = q.astype(np.float64)
        fitted = _inverse(shapes.T @ shapes) @ (shapes.T @ rows) / step
        decoded = write_basis(writer, fitted, steps, trajectories)
    else:
        decoded = write_basis(writer, basis, steps, trajectories)
        q = quantised(fitted_to(decoded, rows) / step, settings["dead_zone"])
    write_coefficients(writer, q, order, trajectories, settings["differences"])
    return trajectories.motion((q * step) @ decoded)


def _inverse(normal: np.ndarray) -> np.ndarray:
    """Return the inverse of the normal matrix of least squares, regularised for components that are quantised to
    zero."""
    return np.linalg.inv(normal + max(1e-12 * np.trace(normal) / len(normal), 1e-30) * np.eye(len(normal)))


def fitted_to(basis: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return least-squares coefficients of rows."""
    return rows @ (basis.T @ _inverse(basis @ basis.T))


def read_group(reader: Reader, order: VertexOrder, step: float, trajectories: Trajectories) -> np.ndarray:
    count = reader.count()
    if count == 0:
        return np.zeros((len(order.source), 3, trajectories.frames))
    basis = read_basis(reader, trajectories)
    coefficients = read_coefficients(reader, order, trajectories)
    return trajectories.motion((coefficients * step) @ basis)


# ---- the common front of an encoding ----


def write_front(
    writer: Writer, source: Source, bound: float, settings: Settings
) -> tuple[VertexOrder, Trajectories, np.ndarray, np.ndarray, float]:
    """Write what all codecs by principal components begin with. Return the order of vertices, the kind of trajectories,
    the mean pose (N, 3), the motion (N, 3, T) about that pose, and the quantisation step in scene units.
    """
    order = vertex_order(source, settings.get("order", "hierarchy"))
    write_order(writer, order)
    positions = ordered(source, order)
    frames = writer.count(positions.shape[2])
    trajectories = Trajectories(bool(writer.count(settings["joint"])), frames)
    pose = write_pose(writer, order, mean_of(source, order), settings["pose"] * bound)
    return order, trajectories, pose, positions - pose[:, :, None], writer.single(settings["step"] * bound)


def read_front(reader: Reader) -> tuple[VertexOrder, Trajectories, np.ndarray, float]:
    """Return order, kind of trajectories, mean pose (N, 3) and step."""
    order, frames = read_order(reader), reader.count()
    return order, Trajectories(bool(reader.count()), frames), read_pose(reader, order), reader.single()


# ---- the baselines ----


class GlobalPca(Baseline):
    name = "global PCA"

    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        return grid_of("step keep basis joint differences first dead_zone pose order")

    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        order, trajectories, _, motion, step = write_front(writer, source, bound, settings)
        spectrum = source_basis(source, order, trajectories)
        write_group(writer, motion, order, spectrum, step, settings, trajectories)
        return order

    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        order, trajectories, pose, step = read_front(reader)
        return read_group(reader, order, step, trajectories) + pose[:, :, None], order


class ClusteredPca(Baseline):
    name = "clustered PCA (Sattler)"
    counts = (1, 2, 4, 8, 16, 24, 32, 48, 64, 96, 128, 192)
    rank = 8  # Rank of the bases that define the clusters.
    main = 24  # components of the motion that clusters are formed by
    turns = 8
    moved = 16_000  # vertices that turns are made with; the others join the clusters in the end

    def grid(self, source: Source, bound: float) -> dict[str, Ladder | Choice]:
        return grid_of(
            "step clusters keep basis joint differences first dead_zone pose order", clusters=Ladder(self.counts, 4)
        )

    def write(self, writer: Writer, source: Source, bound: float, settings: Settings) -> VertexOrder:
        """Write the clip as clusters of vertices, each with principal components of its own. Return the order in which
        the decoder gets the vertices.
        """
        order, trajectories, _, motion, step = write_front(writer, source, bound, settings)
        groups, spectra = self._clusters(source, order, settings["clusters"], trajectories)
        writer.count(len(spectra))
        writer.table(np.diff(groups, prepend=0)[:, None])
        for group, spectrum in enumerate(spectra):
            members = motion[groups == group]
            write_group(writer, members, VertexOrder(np.arange(len(members))), spectrum, step, settings, trajectories)
        return order

    def read(self, reader: Reader) -> tuple[np.ndarray, VertexOrder]:
        """Read what `write` has written. Return the decoded positions (N, 3, T) and the order of their vertices."""
        order, trajectories, pose, step = read_front(reader)
        count, groups = reader.count(), np.cumsum(reader.table()[:, 0])
        positions = np.repeat(pose[:, :, None], trajectories.frames, axis=2)
        for group in range(count):
            members = np.flatnonzero(groups == group)
            positions[members] += read_group(reader, VertexOrder(members), step, trajectories)
        return positions, order

    def _clusters(self, source: Source, order: VertexOrder, count: int, trajectories: Trajectories):
        """Divide the vertices into `count` clusters that move alike. Return the cluster (N,) of each vertex, and for
        each cluster its singular values and vectors.
        """

        def make():
            motion = mean_motion(source, order)
            _, basis = source_basis(source, order, trajectories)
            groups = self._lloyd(trajectories.rows(motion) @ basis[: self.main].T, count, len(motion))
            spectra = [principal(trajectories.rows(motion[groups == group])) for group in range(groups.max() + 1)]
            return groups, spectra

        return memo(source, ("clusters", order.hierarchy is not None, count, trajectories.joint), make)

    def _lloyd(self, coefficients: np.ndarray, count: int, vertices: int) -> np.ndarray:
        """Return the cluster of each vertex. Beginning with runs of neighbours, every round learns a basis of each of
        `count` clusters and moves each vertex to the cluster whose basis holds most of its motion.
        """
        by_vertex = coefficients.reshape(vertices, -1, coefficients.shape[1])
        some = by_vertex[:: -(-vertices // self.moved)]
        groups = np.arange(len(some)) * count // len(some)
        for _ in range(self.turns):
            bases = [self._basis(some[groups == group]) for group in range(count)]
            nearest = self._nearest(some, bases)
            if np.array_equal(nearest, groups):
                break
            groups = nearest
        if len(some) < vertices:
            groups = self._nearest(by_vertex, bases)
        return np.unique(groups, return_inverse=True)[1]

    def _basis(self, members: np.ndarray) -> np.ndarray:
        return principal(members.reshape(-1, members.shape[2]))[1][: self.rank]

    @staticmethod
    def _nearest(by_vertex: np.ndarray, bases: list[np.ndarray]) -> np.ndarray:
        """Return the basis, of (N, rows, K), that has most of each vertex's motion; never an empty one before
        another."""
        caught = [
            ((by_vertex @ basis.T) ** 2).sum(axis=(1, 2)) if len(basis) else np.full(len(by_vertex), -1.0)
            for basis in bases
        ]
        return np.argmax(caught, axis=0)
