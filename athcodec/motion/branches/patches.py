"""Patches of a mesh that move rigidly."""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.groups import cheapest_of_each
from athcodec.motion.branches.seen import components, numbered
from athcodec.motion.branches.steady import scipy_module

PATCH_ROUNDS = 8  # Largest number of rounds in which vertices change to other patches, and small patches join others.
MOST_PATCHES = 2000  # Largest number of patches, which bounds the time that they take.
CRUMBS = 0.25, 12  # Part of the average below which a patch joins a neighbour, and most vertices of such a patch.


def rigid_patches(frames: np.ndarray, links: np.ndarray, patch_vertices: int) -> np.ndarray:
    """Return the patch of each vertex, (N,): connected parts of a mesh, each of which one affine map per frame carries
    well. They grow from seeds spread over the mesh; then maps are fitted to patches, and vertices change to
    neighbouring patches whose maps fit better, in turn (Lloyd's iteration). `frames`: (F, N, 3) positions, the rest
    pose first; `links`: (L, 2) pairs of neighbours; `patch_vertices`: about how many vertices a patch is to have.
    """
    links = np.concatenate([links, links[:, ::-1]])
    label = _spread(frames[0], links, int(np.clip(frames.shape[1] / patch_vertices, 1, MOST_PATCHES)))
    for _ in range(PATCH_ROUNDS):
        maps = _maps(frames, label)
        current = _misfit(frames, maps, np.arange(len(label)), label)
        beside = label[links[:, 0]] != label[links[:, 1]]
        pairs = np.unique(links[beside, 0] * len(maps) + label[links[beside, 1]])
        vertex, other = np.divmod(pairs, len(maps))
        misfit = _misfit(frames, maps, vertex, other)
        best = cheapest_of_each(vertex, misfit)
        best = best[misfit[best] < current[vertex[best]]]
        label[vertex[best]] = other[best]
        label = numbered(label)
    inner = links[label[links[:, 0]] == label[links[:, 1]]]
    crumb = min(CRUMBS[0] * patch_vertices, CRUMBS[1])
    return _without_crumbs(components(inner, len(label)), links, crumb)


def _spread(rest: np.ndarray, links: np.ndarray, count: int) -> np.ndarray:
    """Return for each vertex the number of the seed that is nearest over the links, (N,). The seeds are about `count`
    vertices that are far apart, at least one in each connected part. `rest`: (N, 3) positions; `links`: (L, 2) pairs of
    neighbours.
    """
    length = np.maximum(np.linalg.norm(rest[links[:, 0]] - rest[links[:, 1]], axis=1), 1e-30)
    graph = scipy_module("sparse").coo_matrix((length, links.T), (len(rest),) * 2).tocsr()
    dijkstra = scipy_module("sparse.csgraph").dijkstra
    seeds = np.unique(components(links, len(rest)), return_index=True)[1].tolist()
    way = dijkstra(graph, indices=seeds, min_only=True)
    while len(seeds) < count and way.max() > 0:
        seeds.append(int(way.argmax()))
        near = dijkstra(graph, indices=seeds[-1], limit=way[seeds[-1]])
        way = np.minimum(way, near)
    source = dijkstra(graph, indices=seeds, min_only=True, return_predecessors=True)[2]
    return numbered(source)


def _maps(frames: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return for each patch and frame the least-squares affine map, (B, F, 4, 3), from rest positions to how far the
    vertices have moved from there; it is a translation if the vertices do not determine more. `frames`: (F, N, 3)
    positions, the rest pose first; `label`: the patch of each vertex, (N,).
    """
    order = np.argsort(label, kind="stable")
    first = np.searchsorted(label[order], np.arange(label.max() + 1))
    rest = np.concatenate([frames[0], np.ones((len(label), 1))], axis=1)[order]
    moved = (frames - frames[0])[:, order]
    squares = np.add.reduceat(rest[:, :, None] * rest[:, None, :], first)
    products = np.stack([np.add.reduceat(rest[:, :, None] * frame[:, None, :], first) for frame in moved], axis=1)
    firmness = 1e-3 * np.trace(squares[:, :3, :3], axis1=1, axis2=2) + 1e-30
    squares[:, np.arange(3), np.arange(3)] += firmness[:, None]
    return np.linalg.solve(squares[:, None], products)


def _misfit(frames: np.ndarray, maps: np.ndarray, vertex: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Return the sum over frames of the squared distances of vertices from where maps carry them."""
    total = np.zeros(len(vertex))
    rest = np.concatenate([frames[0, vertex], np.ones((len(vertex), 1))], axis=1)
    for frame, moved in enumerate(frames):
        carried = np.einsum("ni,nij->nj", rest, maps[label, frame])
        total += ((moved[vertex] - frames[0, vertex] - carried) ** 2).sum(axis=1)
    return total


def _without_crumbs(label: np.ndarray, links: np.ndarray, crumb: float) -> np.ndarray:
    """Return the patch of each vertex, (N,), after patches of fewer than `crumb` vertices were merged into larger
    neighbours. `label`: the patches before; `links`: (L, 2) pairs of neighbours.
    """
    for _ in range(PATCH_ROUNDS):
        size = np.bincount(label)
        leaves = (size[label[links[:, 0]]] < crumb) & (size[label[links[:, 0]]] < size[label[links[:, 1]]])
        if not leaves.any():
            break
        into = np.arange(len(size))
        into[label[links[leaves, 0]]] = label[links[leaves, 1]]
        label = numbered(into[label])
    return label
