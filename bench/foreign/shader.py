"""Wind of a vertex shader: trees of cards whose vertex colours say how far and in which phase a vertex moves.

The formulas are those of Crysis (Sousa, "Vegetation procedural animation and shading in Crysis", GPU Gems 3, 2007):
the trunk bends by height, branches and leaf edges by smoothed triangle waves.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np

from bench.foreign.tubes import tubes
from bench.trees.plant import grow

FPS, CARDS, SIDES = 24.0, 4, 6  # Cards: on every node that carries foliage.
WAVES = np.array([1.975, 0.793, 0.375, 0.193])


class _Tree:
    """Points, faces, and the colours: red the leaf's edge, green the branch's phase, blue how far it swings."""

    def __init__(self, nodes: int, orders: int, height: float, seed: int) -> None:
        """Grow a tree of tubes and cards, `height` metres high, whose vertex colours tell a wind shader how far and in
        which phase each vertex moves.
        """
        rng = np.random.default_rng(seed)
        plant = grow(nodes, orders, height, seed)
        bark, bark_faces = tubes(plant, SIDES)
        node = np.repeat(np.flatnonzero(plant.foliage > 0), CARDS)
        along, across = rng.normal(size=(2, len(node), 3)) * height * [[[0.035]], [[0.015]]]
        foot = plant.position[node]
        cards = np.stack([foot - across, foot + across, foot + along + across, foot + along - across], axis=1)
        card_faces = len(bark) + np.arange(4 * len(node)).reshape(-1, 4)
        self.points = np.concatenate([bark, cards.reshape(-1, 3)])
        self.faces = np.concatenate([bark_faces, card_faces]).astype(np.int32)
        carrier = np.concatenate([np.repeat(np.arange(nodes), SIDES), np.repeat(node, 4)])
        phase = rng.random(len(plant.branch_parent))[plant.branch][carrier]
        edge = np.concatenate([np.zeros(len(bark)), np.tile([0.0, 0.0, 1.0, 1.0], len(node))])
        swing = np.hypot(*plant.position[:, [0, 2]].T)[carrier] / height
        self.colours = np.round(255 * np.stack([edge, phase, np.minimum(swing, 1)], axis=1)) / 255  # As bytes.
        facing = np.concatenate([bark - np.repeat(plant.position, SIDES, axis=0), np.repeat(along, 4, axis=0)])
        self.normals = facing / np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-9)
        self.height = height

    def at(self, seconds: float) -> np.ndarray:
        """Return the positions (V, 3) that the wind shader gives the vertices at a time in seconds."""
        edge, phase, swing = self.colours.T
        phases = np.stack([self.points @ np.full(3, 0.7) + phase, phase], axis=1)
        waves = np.abs(((seconds + phases)[:, [0, 0, 1, 1]] * WAVES * 0.7 + 0.5) % 1.0 * 2 - 1)
        waves = waves * waves * (3 - 2 * waves) * 2 - 1
        flutter, branch = waves[:, 0] + waves[:, 1], waves[:, 2] + waves[:, 3]
        points = self.points + (0.012 * self.height * edge * flutter)[:, None] * self.normals
        points[:, 1] += 0.05 * self.height * swing * branch
        length = np.linalg.norm(points, axis=1, keepdims=True)
        gust = 0.04 * (1 + 0.5 * np.sin(0.9 * seconds) + 0.3 * np.sin(2.3 * seconds))
        bend = (1 + gust * np.maximum(points[:, 1], 0) / self.height) ** 2
        points[:, [0, 2]] += ((bend**2 - bend) * self.height)[:, None] * [0.8, 0.6]
        return points * length / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-9)


class _Willow(_Tree):
    """Leaves alone, on a crown that is not there, each a strip of pairs of vertices that hangs and flutters."""

    def __init__(self, leaves: int, pairs: int, height: float, seed: int) -> None:
        """Make `leaves` hanging ribbons of `pairs` pairs of vertices on the twigs of a tree that is not shown, with
        vertex colours for the wind shader.
        """
        rng = np.random.default_rng(seed)
        plant = grow(400, 3, height, seed)
        node = np.sort(rng.choice(np.flatnonzero(plant.foliage > 0), leaves))
        foot = plant.position[node] + rng.normal(0, 0.02 * height, (leaves, 3))
        down = rng.normal(0, 0.4, (leaves, 3)) + [0.0, -1.0, 0.0]
        side = np.cross(down, rng.normal(size=(leaves, 3)))
        down, side = (part / np.linalg.norm(part, axis=1, keepdims=True) for part in (down, side))
        level = np.linspace(0, 1, pairs)[:, None]
        spine = foot[:, None] + 0.03 * height * rng.uniform(0.7, 1.3, (leaves, 1, 1)) * level * down[:, None]
        across = 0.0025 * height * np.sin(np.pi * (0.08 + 0.86 * level)) * side[:, None]
        self.points = np.stack([spine - across, spine + across], axis=2).reshape(-1, 3)
        quads = 2 * np.arange(pairs - 1)[:, None] + [0, 1, 3, 2]
        self.faces = (2 * pairs * np.arange(leaves)[:, None, None] + quads).reshape(-1, 4).astype(np.int32)
        size = 2 * pairs
        phase = np.repeat(rng.random(leaves), size)
        edge = np.tile(np.repeat(level[:, 0] ** 2, 2), leaves)
        swing = np.repeat(np.hypot(*foot[:, [0, 2]].T) / height, size)
        self.colours = np.round(255 * np.stack([edge, phase, np.minimum(swing, 1)], axis=1)) / 255  # As bytes.
        self.normals = np.repeat(np.cross(side, down), size, axis=0)
        self.height = height


def morphs(path: Path, seed: int, nodes: int, orders: int, height: float, frames: int) -> None:
    """Make a GLB with a morph target for every frame, as tools that bake a shader write it for engines without one."""
    _write(path, _Tree(nodes, orders, height, seed), "tree", frames)


def willow(path: Path, seed: int, leaves: int, pairs: int, height: float, frames: int) -> None:
    """Make the morphs of a willow's leaves alone."""
    _write(path, _Willow(leaves, pairs, height, seed), "leaves", frames)


def _write(path: Path, tree: _Tree, name: str, frames: int) -> None:
    """Write a GLB of a tree with a morph target for each of `frames` frames, as a tool that bakes the shader's wind
    writes it.
    """
    triangles = np.concatenate([tree.faces[:, :3], tree.faces[:, [0, 2, 3]]])
    times = np.arange(frames) / FPS
    targets = [tree.at(seconds) - tree.points for seconds in times]
    arrays = [
        tree.points,
        tree.colours,
        triangles.reshape(-1, 1),
        times[:, None],
        np.eye(frames).reshape(-1, 1),
        *targets,
    ]
    kept = [array.astype("<u4" if array is arrays[2] else "<f4") for array in arrays]
    starts = np.cumsum([0, *(array.nbytes for array in kept)]).tolist()
    primitive = {
        "attributes": {"POSITION": 0, "COLOR_0": 1},
        "indices": 2,
        "targets": [{"POSITION": 5 + frame} for frame in range(frames)],
    }
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0}],
        "meshes": [{"name": name, "primitives": [primitive], "weights": [0] * frames}],
        "animations": [{"name": "wind", "samplers": [{"input": 3, "output": 4}], "channels": [channel]}],
        "buffers": [{"byteLength": starts[-1]}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes} for start, array in zip(starts, kept)
        ],
        "accessors": [
            {"bufferView": view, "componentType": 5125 if view == 2 else 5126, "count": len(array)}
            | {"type": "VEC3" if array.shape[1] == 3 else "SCALAR"}
            | {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
            for view, array in enumerate(kept)
        ],
    }
    text, blob = json.dumps(document).encode(), b"".join(array.tobytes() for array in kept)
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4s4I", b"glTF", 2, 28 + len(text) + len(blob), len(text), 0x4E4F534A)
    path.write_bytes(head + text + struct.pack("<2I", len(blob), 0x004E4942) + blob)
