"""The skeleton that skeletor finds in a scanned tree, with sway added: irregular nodes, no branches named."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import skeletor
import trimesh
from scipy.spatial.transform import Rotation

from bench.foreign.tubes import tubes
from bench.trees.plant import grow
from bench.trees.wind import Wind

FRAMES, FPS = 150, 30.0


def skeleton(path: Path, seed: int, nodes: int) -> None:
    """Numbered VTU files beginning with `path`, of line cells, as a script around meshio writes them."""
    rng = np.random.default_rng(seed)
    plant = grow(nodes, 3, 9.0, seed)
    points, quads = tubes(plant, 8)
    scan = trimesh.Trimesh(points, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]), process=False)
    scan = scan.subdivide()
    scan.vertices += rng.normal(0, 0.006, scan.vertices.shape)
    found = skeletor.skeletonize.by_wavefront(scan, waves=1, step_size=1, progress=False)
    found.reroot(int(np.argmin(found.vertices[:, 1])))
    table = found.swc  # A node stands below those that it carries.
    rest = table[["x", "y", "z"]].to_numpy() + rng.normal(0, 0.004, (len(table), 3))
    parent = table["parent_id"].to_numpy()
    nodes_above = np.flatnonzero(parent >= 0)
    edges = np.stack([parent[nodes_above], nodes_above], axis=1).astype(np.int32)
    wind = Wind(6.0, 9.0, seed=seed)
    for frame in range(FRAMES):
        moved = _swayed(rest, parent, wind, frame / FPS)
        mesh = meshio.Mesh(moved.astype(np.float32), [("line", edges)])
        mesh.write(path.with_name(path.name.replace("0000", f"{frame:04}")))


def _swayed(rest: np.ndarray, parent: np.ndarray, wind: Wind, seconds: float) -> np.ndarray:
    """Every piece turns with the one below and a little more, across the wind where it is."""
    push = wind.at(rest, seconds)
    axis = np.cross([0, 1, 0], push) * (0.002 + 0.006 * rest[:, 1:2] / rest[:, 1].max())
    above = np.flatnonzero(parent >= 0)
    piece = rest - rest[np.where(parent < 0, np.arange(len(rest)), parent)]
    turn = axis * np.linalg.norm(piece, axis=1, keepdims=True)
    for node in above.tolist():
        turn[node] += turn[parent[node]]
    moved = Rotation.from_rotvec(turn).apply(piece)
    moved[parent < 0] = rest[parent < 0]
    for node in above.tolist():
        moved[node] += moved[parent[node]]
    return moved
