"""Single plants: beside what stands still, on what moves, turning, in a storm, or as leaves alone."""

from __future__ import annotations

import numpy as np

import athcodec
from athcodec import MotionClip
from bench.odd.bending import Bones, swaying
from bench.scenes import stems as covers
from bench.scenes.assembly import FPS, Assembly, Scene
from bench.scenes.stems import Stems, bent, gusts, headings, swayed
from bench.trees.plant import grow
from bench.trees.ride import rotations, sideways

FRAMES = 60
NO_FACES = np.empty((0, 4), np.int32)


def willow(seed: int, leaves: int) -> Scene:
    """Return leaves of ten pairs of vertices on hanging twigs that are not in the clip."""
    rng, scene, time = np.random.default_rng(seed), Assembly(), np.arange(FRAMES) / FPS
    plant = grow(500, 3, 7.0, seed)
    nodes = swaying(Bones.of(plant), FRAMES, rng, 0.2)
    node = np.sort(rng.choice(np.flatnonzero(plant.foliage > 0), leaves))
    heading = headings(rng, leaves, 0.4) * [1, -1, 1]
    flutter = swayed(rng, time, nodes[0, node], 0.3, lean=0.3, flutter=0.8)
    base = rotations(swayed(rng, time, nodes[0, node], 0.3, lean=0.0))
    blades = bent(nodes[:, node], heading, rng.uniform(0.15, 0.25, leaves), 10, flutter, base)
    width = 0.012 * np.sin(np.linspace(0.2, np.pi - 0.1, 10))
    scene.add(*covers.ribbons(blades, rng.uniform(0, 2 * np.pi, leaves), width), feet=0)
    return scene.scene()


def _sample() -> MotionClip:
    with athcodec.read(athcodec.sample_path()) as clip:
        return MotionClip(
            clip.block(0, clip.frame_count),
            clip.time,
            clip.vertex_branch,
            clip.branch_parent,
            rest=clip.source_rest,
            metadata={"unit": "m", "up_axis": "y", "fps": FPS},
        )


def tree_on_terrain(side: int) -> Scene:
    """Return the sample tree, as points, in the middle of a still square of hills."""
    tree = _sample()
    size = 3.0 * float(np.ptp(tree.rest[:, 1]))
    x, z = np.meshgrid(*[np.linspace(-0.5, 0.5, side) * size] * 2, indexing="ij")
    hills = 0.02 * size * (np.sin(5 * x / size + 1) * np.cos(7 * z / size) + 0.4 * np.sin(19 * (x + 0.7 * z) / size))
    hills -= hills[side // 2, side // 2]
    land = np.stack([x, hills, z], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = len(tree.rest) + (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1, 1)
    frames, roots = tree.frame_count, tree.branch_count
    clip = MotionClip(
        np.concatenate([tree.positions, np.repeat(land[None], frames, axis=0)], axis=1),
        tree.time,
        np.concatenate([tree.vertex_branch, np.full(len(land), roots)]),
        np.append(tree.branch_parent, -1),
        rest=np.concatenate([tree.source_rest, land]),
        faces=(corner + [0, 1, side + 1, side]).astype(np.int32),
        metadata=dict(tree.metadata),
    )
    is_land = np.arange(clip.vertex_count) >= len(tree.rest)
    return Scene(clip, is_land.astype(int), np.append(0, np.flatnonzero(is_land)))


def turning_tree() -> Scene:
    """Return the sample tree on a turntable that turns once."""
    tree = _sample()
    angle = np.linspace(0, 2 * np.pi, tree.frame_count)[:, None] * [0.0, 1.0, 0.0]
    turned = np.einsum("tij,tnj->tni", rotations(angle), tree.positions).astype(np.float32)
    return Scene(tree.replace(positions=turned), np.zeros(tree.vertex_count, int), np.arange(1), standing=tree)


def storm(seed: int) -> Scene:
    """Return a mesh of bark and leaves in a wind of 14 m/s, as the suites' canopies are made."""
    from bench.data import Canopy  # Makes more than this one; data knows the suites.

    clip = Canopy(300, 2, FRAMES, 6.0, 14.0, 700, "broadleaf", seed).make()
    return Scene(clip, np.zeros(clip.vertex_count, int), np.arange(6))


def cloth_leaf(seed: int, frames: int, along: int = 40, across: int = 17) -> Scene:
    """Return a leaf of cloth, held at its stalk: masses on springs in gusts."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(0, 1, along), np.linspace(-1, 1, across), indexing="ij")
    width = 0.25 * np.sin(np.pi * (0.06 + 0.9 * u)) ** 0.8
    rest = np.stack([u, 0.05 * np.abs(v) * width, v * width], axis=-1).reshape(-1, 3)
    number = np.arange(along * across).reshape(along, across)
    pairs = [
        (number[:-1], number[1:]), (number[:, :-1], number[:, 1:]), (number[:-1, :-1], number[1:, 1:]),
        (number[:-1, 1:], number[1:, :-1]), (number[:-3], number[3:]), (number[:, :-3], number[:, 3:]),
    ]  # fmt: skip
    a, b = (np.concatenate([pair[end].ravel() for pair in pairs]) for end in (0, 1))
    length = np.linalg.norm(rest[a] - rest[b], axis=1)
    degree = np.bincount(np.concatenate([a, b]), minlength=len(rest))[:, None]
    steps, settle = 24, 30
    seconds = np.arange((settle + frames) * steps) / (FPS * steps)
    air = np.stack([gusts(rng, seconds, np.array([[0.0, 0.0, 0.0]]), fastest=1.0)[:, 0] for _ in range(3)], axis=1)
    air = air * [0.8, 1.2, 1.2] + [1.5, 0.0, 0.0]
    place, before = rest.copy(), rest.copy()
    held = number[:2].ravel()
    kept = []
    for step, wind in enumerate(air):
        grid = place.reshape(along, across, 3)
        normal = np.cross(np.gradient(grid, axis=0), np.gradient(grid, axis=1)).reshape(-1, 3)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        speed = (place - before) * FPS * steps
        ripple = 1.0 + 0.3 * np.sin(9.0 * rest[:, :1] + 8.0 * rest[:, 2:] - 3.0 * step / (FPS * steps))
        force = 6.0 * ((wind * ripple - speed) * normal).sum(axis=1, keepdims=True) * normal - [0.0, 9.81, 0.0]
        place, before = place + 0.97 * (place - before) + force / (FPS * steps) ** 2, place
        for _ in range(6):
            apart = place[a] - place[b]
            now = np.linalg.norm(apart, axis=1)
            move = (0.5 * (length / now - 1.0))[:, None] * apart
            total = np.stack(
                [np.bincount(a, move[:, k], len(rest)) - np.bincount(b, move[:, k], len(rest)) for k in range(3)],
                axis=1,
            )
            place = place + 1.4 * total / degree * 2.0
            place[held] = rest[held]
        if step % steps == 0 and step >= settle * steps:
            kept.append(place.copy())
    scene = Assembly()
    faces = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
    scene.add(np.array(kept)[:, None], faces, feet=2 * across)
    return scene.scene()


def trellis(seed: int) -> Scene:
    """Return stems of a vine that are tied to bars that stand still, and move between these; leaves on the stems."""
    rng, scene, time = np.random.default_rng(seed), Assembly(), np.arange(FRAMES) / FPS
    still = np.zeros((FRAMES, 9, 3))
    posts = np.stack([np.linspace(-1, 1, 9), np.zeros(9), np.zeros(9)], axis=1)
    upright = bent(posts, np.tile([0.0, 1.0, 0.0], (9, 1)), np.full(9, 2.0), 8, still)
    scene.add(*covers.tubes(upright, np.full(8, 0.015), 4))
    bars = np.stack([np.full(5, -1.0), np.linspace(0.3, 1.9, 5), np.full(5, 0.02)], axis=1)
    level = bent(bars, np.tile([1.0, 0.0, 0.0], (5, 1)), np.full(5, 2.0), 12, still[:, :5])
    scene.add(*covers.tubes(level, np.full(12, 0.012), 4))
    count, points = 8, 40
    height = np.linspace(0, 1.9, points)
    x = np.linspace(-0.9, 0.9, count)[:, None] + 0.15 * np.sin(3.0 * height + rng.uniform(0, 6.3, (count, 1)))
    centres = np.stack(np.broadcast_arrays(x, height, 0.035), axis=-1)
    free = np.abs(np.sin(np.pi * (height - 0.3) / 0.4)) * (height > 0.0)  # No motion where a bar holds the stem.
    push = gusts(rng, time, centres[:, 20]) + 0.4 * rng.normal(size=count) * np.sin(
        2 * np.pi * rng.uniform(1, 3, count) * time[:, None] + rng.uniform(0, 6.3, count)
    )
    way = (push[..., None] * free)[..., None] * [0.006, 0.0, 0.02]
    vine = Stems(
        centres + way, np.broadcast_to(np.eye(3), (FRAMES, count, points, 3, 3)), np.tile([0.0, 1.0, 0.0], (count, 1))
    )
    branch = scene.add(*covers.tubes(vine, 0.008 * np.linspace(1, 0.4, points), 4), feet=4)
    _cards(scene, rng, vine, branch, 30, 0.12)
    return scene.scene()


def ivy(seed: int) -> Scene:
    """Return a trunk with limbs that sways, and ivy that clings to it with its leaves."""
    rng, scene, time = np.random.default_rng(seed), Assembly(), np.arange(FRAMES) / FPS
    rings = 30
    trunk = bent(
        np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]), np.array([6.0]), rings, swayed(rng, time, np.zeros((1, 3)), 0.12)
    )
    radius = 0.15 * np.linspace(1, 0.35, rings)
    wood = scene.add(*covers.tubes(trunk, radius, 10), feet=10)
    on = np.arange(10, rings - 1, 2)
    foot, base = trunk.feet(np.zeros(len(on), int), on)
    limbs = bent(
        foot,
        sideways(np.tile([0.0, 1.0, 0.0], (len(on), 1)), rng.uniform(0, 6.3, len(on)), 0.9),
        rng.uniform(1, 2, len(on)),
        12,
        swayed(rng, time, foot[0], 0.25),
        base,
    )
    scene.add(*covers.tubes(limbs, 0.04 * np.linspace(1, 0.3, 12), 6), wood[0])
    count, points = 6, 100
    level = np.linspace(0, 0.8 * (rings - 1), points)
    angle = (
        rng.uniform(0, 6.3, (count, 1))
        + rng.uniform(0.3, 0.8, (count, 1)) * level / 2
        + 0.2 * np.sin(level + rng.uniform(0, 6.3, (count, 1)))
    )
    below = np.minimum(level.astype(int), rings - 2)
    part = (level - below)[:, None]
    centre = trunk.centres[:, 0, below] * (1 - part) + trunk.centres[:, 0, below + 1] * part
    away = np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=-1) * (radius[below] + 0.008)[:, None]
    centres = centre[:, None] + np.einsum("tpij,spj->tspi", trunk.turns[:, 0, below], away)
    turns = np.broadcast_to(trunk.turns[:, :, below], (FRAMES, count, points, 3, 3))
    strands = Stems(centres, turns, np.tile([0.0, 1.0, 0.0], (count, 1)))
    branch = scene.add(*covers.tubes(strands, 0.008 * np.linspace(1, 0.4, points), 4), wood[0])
    _cards(scene, rng, strands, branch, 40, 0.08)
    return scene.scene()


def _cards(scene: Assembly, rng: np.random.Generator, stems: Stems, branch: np.ndarray, each: int, size: float) -> None:
    """Return leaves of three pairs of vertices on points of stems, each with a flutter of its own."""
    stem = np.repeat(np.arange(len(branch)), each)
    foot, base = stems.feet(stem, rng.integers(3, stems.centres.shape[2], len(stem)))
    time = np.arange(FRAMES) / FPS
    heading = sideways(stems.heading[stem], rng.uniform(0, 6.3, len(stem)), 1.2)
    moved = bent(
        foot, heading, size * rng.uniform(0.6, 1.4, len(stem)), 3, swayed(rng, time, foot[0], 0.3, flutter=1.0), base
    )
    width = size * np.array([0.05, 0.4, 0.05])
    scene.add(*covers.ribbons(moved, rng.uniform(0, 6.3, len(stem)), width), branch[stem])
