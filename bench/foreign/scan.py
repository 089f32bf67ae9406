"""The skeleton that skeletor finds in a scanned tree, with sway added: irregular nodes, no branches named."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import skeletor
import trimesh

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
    rest = np.array(found.vertices) + rng.normal(0, 0.004, (len(found.vertices), 3))
    parent, order = _rooted(rest, np.array(found.edges))
    wind = Wind(6.0, 9.0, seed=seed)
    for frame in range(FRAMES):
        moved = _swayed(rest, parent, order, wind, frame / FPS)
        mesh = meshio.Mesh(moved.astype(np.float32), [("line", np.array(found.edges, np.int32))])
        mesh.write(path.with_name(path.name.replace("0000", f"{frame:04}")))


def _rooted(points: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """The node below each, -1 for the lowest of its piece, and all nodes with those below them first."""
    beside: list[list[int]] = [[] for _ in points]
    for one, other in edges.tolist():
        beside[one].append(other)
        beside[other].append(one)
    parent, order = np.full(len(points), -2), []
    for root in np.argsort(points[:, 1]).tolist():
        waiting = [(root, -1)] if parent[root] == -2 else []
        while waiting:
            node, below = waiting.pop()
            if parent[node] == -2:
                parent[node] = below
                order.append(node)
                waiting += [(above, node) for above in beside[node]]
    return parent, order


def _swayed(rest: np.ndarray, parent: np.ndarray, order: list[int], wind: Wind, seconds: float) -> np.ndarray:
    """Every piece turns with the one below and a little more, across the wind where it is."""
    push = wind.at(rest, seconds) * [1, 0, 1]
    height = rest[:, 1].max()
    axis = np.stack([push[:, 2], 0 * push[:, 0], -push[:, 0]], axis=1) * (0.002 + 0.006 * rest[:, 1:2] / height)
    moved, turn = rest.copy(), np.zeros_like(rest)
    for node in order:
        below = parent[node]
        if below >= 0:
            piece = rest[node] - rest[below]
            turn[node] = turn[below] + axis[node] * np.linalg.norm(piece)
            angle = np.linalg.norm(turn[node])
            unit = turn[node] / max(angle, 1e-12)
            turned = piece * np.cos(angle) + np.cross(unit, piece) * np.sin(angle)
            moved[node] = moved[below] + turned + unit * (unit @ piece) * (1 - np.cos(angle))
    return moved
