"""The skeleton that skeletor finds in a scanned tree, with sway added: irregular nodes, no branches named."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import skeletor
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.spatial.transform import Rotation

from bench.foreign.tubes import tubes
from bench.trees.plant import grow
from bench.trees.wind import Wind

FRAMES, FPS = 150, 30.0


def skeleton(path: Path, seed: int, nodes: int, turns: float = 0.0) -> None:
    """Write the skeleton of a scanned tree as numbered VTU files of line cells, whose names begin with `path`. The
    plant sways on a table that makes `turns` turns.
    """
    rng = np.random.default_rng(seed)
    plant = grow(nodes, 3, 9.0, seed)
    points, quads = tubes(plant, 8)
    scan = trimesh.Trimesh(points, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]), process=False)
    scan = scan.subdivide()
    scan.vertices += rng.normal(0, 0.006, scan.vertices.shape)
    extracted = skeletor.skeletonize.by_wavefront(scan, waves=1, step_size=1, progress=False)
    rest = np.array(extracted.vertices) + rng.normal(0, 0.004, extracted.vertices.shape)
    edges = np.array(extracted.edges, np.int32)
    graph = coo_array((np.ones(len(edges)), edges.T), shape=2 * (len(rest),))
    order, parent = breadth_first_order(graph, np.argmin(rest[:, 1]), directed=False)
    if len(order) != len(rest):
        raise RuntimeError(
            f"skeleton: got {len(order)} of {len(rest)} nodes joined to the lowest, expected all; take another seed"
        )
    wind = Wind(6.0, 9.0, seed=seed)
    for frame in range(FRAMES):
        moved = _swayed(rest, order, parent, wind, frame / FPS)
        moved = Rotation.from_rotvec([0, 2 * np.pi * turns * frame / FRAMES, 0]).apply(moved) if turns else moved
        mesh = meshio.Mesh(moved.astype(np.float32), [("line", edges)])
        mesh.write(path.with_name(path.name.replace("0000", f"{frame:04}")))


def _swayed(rest: np.ndarray, order: np.ndarray, parent: np.ndarray, wind: Wind, seconds: float) -> np.ndarray:
    """Return the positions (N, 3) of a skeleton at a time in seconds. Each piece turns with the piece below it, and a
    little more by the wind across it; `order` lists the pieces from the root outwards.
    """
    push = wind.at(rest, seconds)
    axis = np.cross([0, 1, 0], push) * (0.002 + 0.006 * rest[:, 1:2] / rest[:, 1].max())
    above = order[1:]
    piece = np.zeros_like(rest)
    piece[above] = rest[above] - rest[parent[above]]
    turn = axis * np.linalg.norm(piece, axis=1, keepdims=True)
    for node in above.tolist():
        turn[node] += turn[parent[node]]
    moved = Rotation.from_rotvec(turn).apply(piece)
    moved[order[0]] = rest[order[0]]
    for node in above.tolist():
        moved[node] += moved[parent[node]]
    return moved
