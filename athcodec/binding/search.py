"""The place on a plant's chains that each point of a mesh hangs on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from athcodec.binding.chains import Chains
from athcodec.binding.surface import MeshPoints
from athcodec.motion.branches.groups import moments_of_each, sums_of_each
from athcodec.motion.branches.steady import scipy_module
from athcodec.untyped import ScipyObject

NEAREST = 8  # Marks looked at around each point; they tell the branches that it may be on.
FINENESS = 300  # Marks on an element over its length, where that is the plant's diagonal.
MOST_MARKS = 64  # Marks on an element.
LOOKED_AT = 64  # Points of a piece that its branch is chosen by.
BRANCHES_TRIED = 12  # Branches that a piece may be on, without their parents.
AROUND = 0.5  # Length of the mean offset from a stem over the mean length of offsets, below which a piece encloses it.
ONE_STEM = 2.0  # Mean distance of a piece from its branch over that from the nearest branches, for a piece on one stem.
ONE_SURFACE = 0.6  # Share of a piece's points that are nearest to one branch that is a surface.
LARGEST_CARD = 0.5  # Extent of a piece over the plant's diagonal, above which it is no leaf.
SMALL_CARD = 0.1  # The same extent, below which a piece between several stems is a leaf and no wood.
FLAT = 0.05  # Variance of a flat piece across its plane over the smaller one within it.
BLADE = 0.15  # Mean distance of a flat piece from its stem over its extent, above which it is a leaf across the stem.
SHARES = 3  # Branches that move a point, at most.
LEAST_WEIGHT = 0.005
REACH = 1.5  # How far two stems share a skin from where they meet in it, over its distance from the thinner of them.
SLACK = 3.0  # Lengths of that reach over which a skin that nothing holds goes back to its own stem.
LEAST_LINK = 1e-3  # Length of a link, over the median, below which weights spread along it as along one so long.
COLUMNS = 64  # Branches whose weights are in memory at once.
BLOCK = 1 << 21  # Pairs of points and elements whose distances are in memory at once.


@dataclass(frozen=True)
class Binding:
    """What moves the P points of a mesh: up to SHARES places each, by rows of a table with R rows.

    Attributes
    ----------
    point, element : (R,) int64
        The point, and the element of the chains.
    share : (R,) float64
        The place along the element, 0 to 1.
    weight : (R,) float64
        Weights of a point's rows add up to 1.
    distance : (P,) float64
        Distance of each point from the plant in the rest pose.
    card_count : int
        Pieces that move as a whole.
    """

    point: np.ndarray
    element: np.ndarray
    share: np.ndarray
    weight: np.ndarray
    distance: np.ndarray
    card_count: int

    @property
    def is_shared(self) -> np.ndarray:
        """Which points more than one branch moves, (P,) bool."""
        return np.bincount(self.point, minlength=len(self.distance)) > 1


class Marks:
    """Points all over the plant, with the branch of each: samples of lines and vertices of surfaces."""

    def __init__(self, chains: Chains):
        """Spread marks evenly over all branches of the chains, in a tree that finds the marks nearest to a point."""
        branch, place = [], []
        lines = np.flatnonzero(chains.is_line[chains.element_branch])
        if len(lines):
            step = chains.diagonal / FINENESS or 1.0
            count = np.clip(np.ceil(chains.length[lines] / step), 1, MOST_MARKS).astype(np.int64)
            element = np.repeat(lines, count)
            number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
            share = (number + 0.5) / np.repeat(count, count)
            place.append(chains.at_rest(element, share))
            branch.append(chains.element_branch[element])
        on_surface = ~chains.is_line[chains.branch_of]
        if on_surface.any():
            place.append(chains.vertex_rest[on_surface])
            branch.append(chains.branch_of[on_surface])
        self.branch = np.concatenate(branch)
        self.tree = scipy_module("spatial").cKDTree(np.concatenate(place))

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distances and branches (P, k) of the marks nearest to points."""
        distance, mark = self.tree.query(points, k=min(NEAREST, len(self.branch)))
        return distance.reshape(len(points), -1), self.branch[mark].reshape(len(points), -1)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance (P,) of each point (P, 3) from the nearest mark."""
        return self.tree.query(points)[0]


class _Pairs:
    """Points with a branch each, put onto it: the place on the branch, and the distance from it."""

    def __init__(self, chains: Chains, points: np.ndarray, branch: np.ndarray):
        """Find the nearest place on a branch for pairs of a point, (P, 3), and a branch, (P,), and the offset and
        distance of the point from it.
        """
        self.element, self.share = np.zeros(len(points), np.int64), np.zeros(len(points))
        order = np.argsort(branch, kind="stable")
        branches, first = np.unique(branch[order], return_index=True)
        for each, rows in zip(branches.tolist(), np.split(order, first[1:])):
            low, high = chains.first_element[each], chains.first_element[each + 1]
            step = max(1, BLOCK // max(1, high - low))
            for begin in range(0, len(rows), step):
                some = rows[begin : begin + step]
                self.element[some], self.share[some] = _onto(chains, points[some], low, high)
        self.offset = points - chains.at_rest(self.element, self.share)
        self.distance = np.linalg.norm(self.offset, axis=1)
        self.depth = self.distance
        if chains.radius is not None:
            start, end = chains.radius[chains.start[self.element]], chains.radius[chains.end[self.element]]
            self.depth = self.distance - ((1 - self.share) * start + self.share * end)


def _onto(chains: Chains, points: np.ndarray, low: int, high: int) -> tuple[np.ndarray, np.ndarray]:
    """Return for each point the nearest of the elements `low` to `high` - 1, and how far along it the nearest place is,
    from 0 to 1.
    """
    start = chains.rest[chains.start[low:high]]
    chord = chains.rest[chains.end[low:high]] - start
    square = (chord**2).sum(axis=1)
    along = (points @ chord.T - (start * chord).sum(axis=1)) / np.where(square > 0, square, 1.0)
    along = np.clip(along, 0.0, 1.0)
    # |p - s - t c|^2 without an array of vectors.
    off = points[:, None] - start if len(points) * (high - low) < BLOCK // 4 else None
    if off is None:
        distance = np.stack(
            [((points - start[e] - along[:, e : e + 1] * chord[e]) ** 2).sum(axis=1) for e in range(high - low)], axis=1
        )
    else:
        distance = ((off - along[..., None] * chord) ** 2).sum(axis=2)
    best = distance.argmin(axis=1)
    return low + best, along[np.arange(len(points)), best]


def bind(chains: Chains, mesh: MeshPoints, marks: Marks) -> Binding:
    """Return which elements of the chains move each point of a mesh, by how much, found in the plant's rest pose."""
    return _Search(chains, mesh, marks).result()


class _Search:
    def __init__(self, chains: Chains, mesh: MeshPoints, marks: Marks):
        """Begin to bind the points of a mesh to chains: find the branches near each point by the marks."""
        self.chains, self.mesh = chains, mesh
        self.near, self.near_branch = marks.nearest(mesh.place)
        parent = chains.hierarchy.branch_parent
        self.parent = np.where(chains.is_line[np.maximum(parent, 0)] & (parent >= 0), parent, -1)
        self.branch = np.full(len(mesh.place), -1)  # The branch of points whose piece is on one.
        self.foot = np.full(len(mesh.place), -1)  # The point that its card hangs by, of each point of one.
        self.card_count = 0

    def result(self) -> Binding:
        """Return the binding of all points: of whole pieces of the mesh first, then of cards, then point by point."""
        if self.mesh.piece_count:
            self._look_at_pieces()
        one_by_one = np.flatnonzero((self.branch < 0) & (self.foot < 0))
        rows = [self._of_pieces(), self._of_cards(), self._of_points(one_by_one)]
        point, element, share, weight = (np.concatenate(column) for column in zip(*rows))
        return Binding(point, element, share, weight, self.near[:, 0], self.card_count)

    # ---- pieces ----

    def _look_at_pieces(self) -> None:
        """Decide for each connected piece of the mesh, by a sample of its points, whether one branch moves it as a
        whole, and whether it is a card that a foot on a branch carries.
        """
        mesh, chains = self.mesh, self.chains
        inside = np.flatnonzero(mesh.piece >= 0)
        # Vertices are in any order within their piece: every n-th one of a tube may lie on one side of it.
        order = inside[np.lexsort((np.random.default_rng(0).random(len(inside)), mesh.piece[inside]))]
        piece = mesh.piece[order]
        first = np.searchsorted(piece, np.arange(mesh.piece_count + 1))
        low, high = (each.reduceat(mesh.place[order], first[:-1]) for each in (np.minimum, np.maximum))
        extent = np.linalg.norm(high - low, axis=1)
        sample = order[np.arange(len(order)) - first[piece] < LOOKED_AT]
        nearest = _Pairs(chains, mesh.place[sample], self.near_branch[sample, 0])
        near, around = _mean_offsets(mesh.piece[sample], nearest.offset, mesh.piece_count)
        best, mean, best_around = self._best_stems(sample)
        mode, mode_share = _modes(mesh.piece[sample], self.near_branch[sample, 0], mesh.piece_count)
        on_line = chains.is_line[mode]
        whole = np.where(on_line, (mean <= ONE_STEM * near) & (best_around < AROUND), mode_share >= ONE_SURFACE)
        # A card hangs by a point that it shares with its twig, or else by its point nearest to the plant. It lies
        # to one side of that place.
        foot = order[np.lexsort((self.near[order, 0], piece))][first[:-1]]
        foot[mesh.shared[:, 0]] = mesh.shared[:, 1]
        hangs = _Pairs(chains, mesh.place[foot], self.near_branch[foot, 0])
        from_foot = mesh.place[sample] - (mesh.place[foot] - hangs.offset)[mesh.piece[sample]]
        aside = _mean_offsets(mesh.piece[sample], from_foot, mesh.piece_count)[1]
        # A flat piece that is wide for its distance from the stem is a leaf across it, and no blade along it.
        flat = _flatness(mesh.piece[sample], mesh.place[sample], mesh.piece_count) < FLAT
        across = on_line & flat & (mean > BLADE * extent)
        whole &= ~across
        is_card = (across | (around >= AROUND)) & (extent <= LARGEST_CARD * chains.diagonal)
        is_card |= (aside >= AROUND) & (extent <= SMALL_CARD * chains.diagonal)
        is_card &= ~whole
        self.branch[order] = np.where(whole, np.where(on_line, best, mode), -1)[piece]
        self.foot[order] = np.where(is_card, foot, -1)[piece]
        self.card_count = int(is_card.sum())

    def _best_stems(self, sample: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return three arrays with an entry per piece of the mesh: the line nearest to the piece as a whole, their mean
        distance, and the length of the mean offset as a fraction of that, which is small for a piece around the line.
        """
        mesh, count, branches = self.mesh, self.mesh.piece_count, self.chains.hierarchy.branch_count
        piece = np.repeat(mesh.piece[sample], self.near_branch.shape[1])
        key, votes = np.unique(piece * branches + self.near_branch[sample].reshape(-1), return_counts=True)
        order = np.lexsort((-votes, key // branches))
        key = key[order]
        rank = np.arange(len(key)) - np.searchsorted(key // branches, key // branches)
        key = key[rank < BRANCHES_TRIED]
        parent = self.parent[key % branches]
        key = np.unique(np.append(key, (key // branches * branches + parent)[parent >= 0]))
        key = key[self.chains.is_line[key % branches]]
        best, mean, around = np.zeros(count, np.int64), np.full(count, np.inf), np.ones(count)
        if not len(key):
            return best, mean, around
        sizes = np.bincount(mesh.piece[sample], minlength=count)
        by_piece = sample[np.argsort(mesh.piece[sample], kind="stable")]
        starts = np.cumsum(sizes) - sizes
        times = sizes[key // branches]
        row = np.repeat(np.arange(len(key)), times)
        number = np.arange(times.sum()) - np.repeat(np.cumsum(times) - times, times)
        points = by_piece[starts[key[row] // branches] + number]
        pairs = _Pairs(self.chains, mesh.place[points], key[row] % branches)
        far, off = _mean_offsets(row, pairs.offset, len(key))
        order = np.lexsort((far, key // branches))
        pieces, first = np.unique(key[order] // branches, return_index=True)
        chosen = order[first]
        best[pieces], mean[pieces], around[pieces] = key[chosen] % branches, far[chosen], off[chosen]
        return best, mean, around

    # ---- rows ----

    def _of_pieces(self) -> tuple[np.ndarray, ...]:
        points = np.flatnonzero(self.branch >= 0)
        pairs = _Pairs(self.chains, self.mesh.place[points], self.branch[points])
        return points, pairs.element, pairs.share, np.ones(len(points))

    def _of_cards(self) -> tuple[np.ndarray, ...]:
        points = np.flatnonzero((self.branch < 0) & (self.foot >= 0))
        feet, of = np.unique(self.foot[points], return_inverse=True)
        branch = np.where(self.branch[feet] >= 0, self.branch[feet], self.near_branch[feet, 0])
        pairs = _Pairs(self.chains, self.mesh.place[feet], branch)
        return points, pairs.element[of], pairs.share[of], np.ones(len(points))

    def _of_points(self, points: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return rows that put points on their nearest branches: point, element, place along the element from 0 to 1,
        and weight. Weights change gradually between neighbouring points.
        """
        if not len(points):
            return points, points, np.zeros(0), np.zeros(0)
        branches = self.chains.hierarchy.branch_count
        candidates = self.near_branch[points]
        candidates = np.concatenate([candidates, self.parent[candidates]], axis=1)
        key = np.arange(len(points))[:, None] * branches + candidates
        key = np.unique(key[candidates >= 0])
        point, branch = key // branches, key % branches
        pairs = _Pairs(self.chains, self.mesh.place[points[point]], branch)
        depth = pairs.depth.copy()
        surface = np.flatnonzero(~self.chains.is_line[branch])
        if len(surface):  # A surface is as far away as its nearest vertex.
            is_it = self.near_branch[points[point[surface]]] == branch[surface, None]
            depth[surface] = np.where(is_it, self.near[points[point[surface]]], np.inf).min(axis=1)
        order = np.lexsort((depth, point))
        nearest = branch[order[np.unique(point[order], return_index=True)[1]]]
        weights = self._spread(points, nearest)
        pairs = _Pairs(self.chains, self.mesh.place[points[weights.row]], weights.col.astype(np.int64))
        return points[weights.row], pairs.element, pairs.share, weights.data

    def _spread(self, points: np.ndarray, branch: np.ndarray) -> ScipyObject:
        """Return weights (points, B) of branches as a sparse matrix with at most SHARES entries per row.

        Weights are 1 and 0 except near links between points of different branches. There, as far as REACH says, they
        change smoothly over the surface, as the height of a membrane does, so that short edges hold no large change.
        """
        sparse, graphs = scipy_module("sparse"), scipy_module("sparse.csgraph")
        number = np.full(len(self.mesh.place), -1)
        number[points] = np.arange(len(points))
        # Only a skin spreads: the points of a centre line are each on one stem.
        links = number[self.mesh.links[(self.mesh.piece[self.mesh.links] >= 0).all(axis=1)]]
        links = links[(links >= 0).all(axis=1)]
        count, branches = len(points), self.chains.hierarchy.branch_count
        weights = sparse.coo_matrix((np.ones(count), (np.arange(count), branch)), (count, branches)).tocsr()
        seams = links[branch[links[:, 0]] != branch[links[:, 1]]]
        if not len(seams):
            return weights.tocoo()
        place = self.mesh.place[points]
        length = np.linalg.norm(place[links[:, 0]] - place[links[:, 1]], axis=1)
        length = np.maximum(length, LEAST_LINK * np.median(length))
        ends = np.concatenate([links, links[:, ::-1]])
        near = sparse.coo_matrix((1.0 / np.tile(length, 2), ends.T), (count, count)).tocsr()
        seeds, of_seam = np.unique(seams, return_inverse=True)
        girth = _Pairs(self.chains, place[seeds], branch[seeds]).distance[of_seam.reshape(seams.shape)].min(axis=1)
        reach = np.zeros(len(seeds))
        np.maximum.at(reach, of_seam.reshape(-1), REACH * np.repeat(girth, 2))
        # A point in front of all seams, each as far behind it as its reach is short of the longest, tells what is near.
        most = max(float(reach.max()), float(length.min()))
        rows, columns = np.append(links[:, 0], np.full(len(seeds), count)), np.append(links[:, 1], seeds)
        ways = np.append(length, 1.001 * most - reach)
        graph = sparse.coo_matrix((ways, (rows, columns)), (count + 1, count + 1)).tocsr()
        away = graphs.dijkstra(graph, directed=False, indices=count, limit=1.001 * most)[:count]
        return _largest(_membrane(near, weights, np.flatnonzero(np.isfinite(away)), most)).tocoo()


def _membrane(near: ScipyObject, weights: ScipyObject, free: np.ndarray, reach: float) -> ScipyObject:
    """Return a sparse matrix of weights whose rows `free` lie between the others as a membrane would. `near` (n, n) has
    how strongly neighbours pull, and `reach` how far a membrane extends from its middle at most.
    """
    sparse, linalg = scipy_module("sparse"), scipy_module("sparse.linalg")
    pull = np.asarray(near.sum(axis=1)).reshape(-1)
    # Far beyond its reach it holds to what it was, which matters only where nothing else holds it.
    degree = np.diff(near.indptr)
    slack = pull * np.minimum(degree / np.maximum(2 * SLACK * reach * pull, degree), 1.0) ** 2
    rows = near[free]
    matrix = sparse.diags(pull[free] + slack[free]) - rows[:, free]
    held = np.ones(near.shape[0], bool)
    held[free] = False
    right = rows[:, held] @ weights[held] + sparse.diags(slack[free]) @ weights[free]
    right = right.tocsc()
    used = np.flatnonzero(np.diff(right.indptr))
    solved, columns = linalg.splu(matrix.tocsc()), []
    for some in np.split(used, np.arange(COLUMNS, len(used), COLUMNS)):
        spread = solved.solve(right[:, some].toarray())
        columns.append(sparse.csc_matrix(np.where(spread >= LEAST_WEIGHT / 2, spread, 0.0)))
    of_free = sparse.hstack(columns, format="coo")
    kept = weights.tocoo()
    rest = held[kept.row]
    row, column = np.append(kept.row[rest], free[of_free.row]), np.append(kept.col[rest], used[of_free.col])
    return sparse.coo_matrix((np.append(kept.data[rest], of_free.data), (row, column)), weights.shape)


def _largest(weights: ScipyObject) -> ScipyObject:
    """Return a sparse matrix with the SHARES largest entries of each row, without small ones, scaled to add up to 1."""
    entries = weights.tocoo()
    order = np.lexsort((-entries.data, entries.row))
    row, col, data = entries.row[order], entries.col[order], entries.data[order]
    rank = np.arange(len(row)) - np.searchsorted(row, row)
    kept = (rank < SHARES) & ((data >= LEAST_WEIGHT) | (rank == 0))
    row, col, data = row[kept], col[kept], data[kept]
    data = data / np.bincount(row, data, minlength=weights.shape[0])[row]
    return type(entries)((data, (row, col)), weights.shape).tocsr()


def _mean_offsets(group: np.ndarray, offset: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return for each group of offsets (n, 3) their mean length, and the length of their mean over that."""
    size = np.maximum(np.bincount(group, minlength=count), 1)
    length = np.bincount(group, np.linalg.norm(offset, axis=1), count) / size
    mean = sums_of_each(offset, group, count) / size[:, None]
    return length, np.linalg.norm(mean, axis=1) / np.where(length > 0, length, np.inf)


def _flatness(group: np.ndarray, points: np.ndarray, count: int) -> np.ndarray:
    """Return for each group of points (n, 3) the smallest of its variances along axes over the middle one, else 1."""
    size = np.maximum(np.bincount(group, minlength=count), 1)
    off = points - (sums_of_each(points, group, count) / size[:, None])[group]
    variance = np.linalg.eigvalsh(moments_of_each(off, off, group, count))
    return np.where(variance[:, 1] > 0, variance[:, 0] / np.where(variance[:, 1] > 0, variance[:, 1], 1.0), 1.0)


def _modes(group: np.ndarray, label: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the most frequent label of each of `count` groups, and the fraction of the group's entries that have it.
    Entry i has the label `label[i]` and is in group `group[i]`.
    """
    width = int(label.max()) + 1
    key, votes = np.unique(group * width + label, return_counts=True)
    order = np.lexsort((-votes, key // width))
    groups, first = np.unique(key[order] // width, return_index=True)
    mode, share = np.zeros(count, np.int64), np.zeros(count)
    mode[groups] = key[order[first]] % width
    share[groups] = votes[order[first]] / np.bincount(group, minlength=count)[groups]
    return mode, share
