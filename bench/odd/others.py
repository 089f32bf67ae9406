"""Clips that a codec for swaying plants is not made for: noise, single things, shapes that are mixed, still meshes."""

from __future__ import annotations

import numpy as np

from athcodec import MotionClip
from bench.odd.bending import FPS, Bones, clip_of, swaying
from bench.trees.mesh import dress
from bench.trees.plant import grow
from bench.trees.ride import rotations
from bench.trees.wind import Wind


def captured_stem(seed: int, frames: int, points: int, noise: float, fps: float = 120.0) -> MotionClip:
    """Return a swaying stem of `points` markers as motion capture gives it: every coordinate has noise of the same
    standard deviation, `noise` times the diagonal.
    """
    rng = np.random.default_rng(seed)
    stem = np.linspace(0.0, 2.0, points)[:, None] * [0.0, 1.0, 0.0]
    element = np.diff(stem, axis=0, prepend=0.0)
    bones = Bones(np.arange(-1, points - 1), np.zeros(points, np.int32), np.array([-1]), element)
    positions = swaying(bones, frames, rng, 0.4, fps=fps)
    diagonal = np.linalg.norm(np.ptp(positions.reshape(-1, 3), axis=0))
    positions += noise * diagonal * rng.normal(size=positions.shape)
    return clip_of(bones, positions, fps, positions.mean(axis=0))


def white_noise(seed: int, frames: int, points: int) -> MotionClip:
    """Return points that are somewhere else in every frame."""
    positions = np.random.default_rng(seed).normal(size=(frames, points, 3))
    return _unnamed(positions)


def still_mesh(seed: int, frames: int, nodes: int, leaves: int) -> MotionClip:
    """Return the mesh of a tree, tubes and leaf cards, all frames alike."""
    plant = grow(nodes, 2, 8.0, seed)
    tree = clip_of(Bones.of(plant), plant.position[None])
    tree.attributes["radius"] = plant.radius
    mesh = dress(tree, Wind(1e-3, 8.0, seed=seed), 1, leaves, seed)
    return _unnamed(np.repeat(mesh.rest[None], frames, axis=0), faces=mesh.faces)


def morph_targets(
    seed: int, frames: int, points: int, targets: int, active: int, key: int, reach: tuple[float, float]
) -> MotionClip:
    """Return a ball of radius 1 with `points` points, moved by `targets` bumps whose radii lie between the two numbers
    of `reach`. Every `key` frames, `active` of the bumps get new random weights, and weights change linearly in
    between.
    """
    rng = np.random.default_rng(seed)
    base = _ball(points)
    centre = base[rng.integers(0, points, targets)]
    distance = np.linalg.norm(base - centre[:, None], axis=-1)
    bump = np.maximum(1.0 - (distance / rng.uniform(*reach, (targets, 1))) ** 2, 0.0) ** 2
    shapes = bump[..., None] * rng.normal(0, 0.2, (targets, 1, 3))
    keys = -(-frames // key) + 1
    weights = np.zeros((keys, targets))
    for row in weights[1:]:  # the first pose is the base
        row[rng.choice(targets, active, replace=False)] = rng.uniform(0.2, 1.0, active)
    at = np.arange(frames) / key
    mixed = np.stack([np.interp(at, np.arange(keys), column) for column in weights.T], axis=-1)
    return _unnamed(base + np.tensordot(mixed, shapes, axes=1))


def rippling_sheet(seed: int, side: int, frames: int, bumps: int) -> MotionClip:
    """Return a square sheet of `side` times `side` vertices, with triangles, over which `bumps` smooth bumps move."""
    rng = np.random.default_rng(seed)
    plane = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, side)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    time = np.arange(frames)[:, None] / FPS
    moved = np.zeros((frames, len(plane), 3))
    for width, speed, height in zip(
        rng.uniform(0.08, 0.25, bumps), rng.uniform(0.2, 1.2, bumps), rng.normal(size=(bumps, 3))
    ):
        centre = rng.random(2) + 0.15 * rng.normal(size=2) * time * np.sin(speed * time)
        away = np.square(plane - centre[:, None]).sum(axis=-1)
        moved += 0.05 * (np.sin(2 * np.pi * speed * time) * np.exp(-away / (2 * width**2)))[..., None] * height
    first = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1, 1)
    faces = np.concatenate([first + [0, side, side + 1], first + [0, side + 1, 1]]).astype(np.int32)
    return _unnamed(np.pad(plane, ((0, 0), (0, 1))) + moved, faces=faces)


def drifting_points(seed: int, points: int, frames: int, noise: float) -> MotionClip:
    """Return points of a cube without faces, each on a smooth way of its own, and a little noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames)[:, None, None] / FPS
    waves = (np.sin(2 * np.pi * rng.uniform(0.3, 2.0) * time) * rng.normal(0, 0.03, (points, 3)) for _ in range(3))
    return _unnamed(rng.random((points, 3)) + sum(waves) + noise * rng.normal(size=(frames, points, 3)))


def _ball(points: int) -> np.ndarray:
    """Return (points, 3) evenly over the unit sphere, along a spiral."""
    height = 1.0 - 2.0 * (np.arange(points) + 0.5) / points
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(points)
    radius = np.sqrt(1.0 - height**2)
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], axis=-1)


def one_vertex(seed: int, frames: int) -> MotionClip:
    """Return a single vertex on a smooth way."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames)[:, None, None] / FPS
    waves = np.sin(2 * np.pi * rng.uniform(0.2, 1.0, (4, 1)) * time + rng.uniform(0, 6.28, (4, 3)))
    return _unnamed(waves.mean(axis=1, keepdims=True))


def tumbling_cube(seed: int, frames: int) -> MotionClip:
    """Return a cube of 24 vertices, four to a side, that is thrown and turns."""
    rng = np.random.default_rng(seed)
    square = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]) / 2.0
    sides = [[0, 0, 0], [0, 0.5, 0], [0, 1, 0], [0, 1.5, 0], [0.5, 0, 0], [1.5, 0, 0]]
    cube = np.concatenate([square @ rotations(np.pi * np.array(side)).T for side in sides])
    time = np.arange(frames)[:, None] / FPS
    way = time * [2.0, 6.0, 0.5] - [0.0, 4.9, 0.0] * time**2
    turns = rotations(time * rng.normal(0, 3.0, 3))
    positions = np.einsum("tij,nj->tni", turns, cube) + way[:, None]
    return _unnamed(positions, faces=np.arange(24, dtype=np.int32).reshape(6, 4))


def triangulated_leaf(seed: int, frames: int, points: int) -> MotionClip:
    """Return a swaying leaf as a mesh of irregular triangles over `points` points, as scans and decimated meshes have
    them.
    """
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    plane = rng.random((points, 2)) * [1.0, 0.4]
    corners = Delaunay(plane).simplices
    centres = plane[corners].mean(axis=1)
    corners = corners[np.lexsort((centres[:, 1], np.floor(0.7 * np.sqrt(points) * centres[:, 0])))]
    used, first = np.unique(corners, return_index=True)
    order = used[np.argsort(first)]  # Vertices are numbered as faces use them first.
    along, across = plane[order].T
    sway = 0.2 * np.sin(np.arange(frames)[:, None] / 5.0) + 0.1 * np.sin(np.arange(frames)[:, None] / 3.0 + 4.0 * along)
    height = 0.05 * np.sin(9.0 * along) * np.cos(11.0 * across) + sway * along**2
    positions = np.stack(np.broadcast_arrays(along, height, across), axis=-1)
    return _unnamed(positions, faces=np.argsort(order)[corners].astype(np.int32))


def _unnamed(positions: np.ndarray, **more: np.ndarray) -> MotionClip:
    """Return a clip without branches; its rest pose is the first frame."""
    return MotionClip(
        positions.astype(np.float32),
        np.arange(len(positions)) / FPS,
        metadata={"unit": "m", "up_axis": "y", "fps": FPS},
        **more,
    )
