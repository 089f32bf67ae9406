"""A plant of real size for vectors that athcodec writes, and which features of the format a file uses.

Some features exclude each other, so there are four files (`OPTIONS`). A rest pose is exact, or coded and then
perhaps connected, refined, with detail. A second rest pose is there where motion is about the mean pose. Predicted
motion has no modes, shapes, learned bases, corrections, refinements or layers, and joins at level 0 alone.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from spec.document import KIND_NAMES, File, rules

SIDES, LEAF = 6, 12  # vertices of a ring, of a leaf
SPLIT = 5  # Every so many vertices, one is split, as at a seam of a texture.
OPTIONS: dict[str, dict[str, Any]] = {
    "all": {"rel_error": 1e-3, "ladder": (4e-2, 6e-3), "segment_frames": 16, "lossless": True},
    "refined-rest": {"rel_error": 5e-4, "ladder": (4e-2, 4e-3), "segment_frames": 20, "effort": "best"},
    "exact-rest": {"rel_error": 2e-3, "ladder": (4e-2,), "segment_frames": 16, "exact_rest": True},
    "predicted": {"rel_error": 5e-4, "segment_frames": 24, "ladder": "none"},
}

FEATURES = set(
    "several clips,a loop,periodic waves,layers,predicted motion,joins,sloped joins,repeats,learned bases,sheets,"
    "loose branches,whole subtrees,tubes,rigid branches,detail,several pieces,several roots,exact rest pose,"
    "connected rest pose,uneven times,mixed faces,attributes,places".split(",")
)


class Growing:
    """Vertices and faces of a plant, branch by branch."""

    def __init__(self, seed: int):
        self.random = np.random.default_rng(seed)
        self.points: list[np.ndarray] = []
        self.parents: list[int] = []
        self.faces: list[list[int]] = []
        self.joints: list[np.ndarray] = []  # where a branch hangs

    def add(self, parent: int, joint: np.ndarray, points: np.ndarray, faces: list[list[int]] = []) -> int:  # noqa: B006
        first = sum(map(len, self.points))
        self.points.append(points)
        self.parents.append(parent)
        self.joints.append(joint)
        self.faces += [[first + v for v in face] for face in faces]
        return len(self.parents) - 1

    def tube(self, parent: int, joint: np.ndarray, end: np.ndarray, rings: int, radius: float) -> int:
        """Add a branch that is a tapering tube of `rings` rings from `joint` (3,) to `end` (3,), on the branch
        `parent`. Return the new branch's number.
        """
        along = np.linspace(0.0, 1.0, rings)[:, None, None]
        across = np.linalg.svd((end - joint)[None])[2][1:]
        angle = 2 * np.pi * np.arange(SIDES) / SIDES
        ring = radius * (np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1])
        points = joint + along * (end - joint) + ring * (1.0 - 0.6 * along)
        around = [
            [SIDES * r + s, SIDES * r + (s + 1) % SIDES, SIDES * (r + 1) + (s + 1) % SIDES, SIDES * (r + 1) + s]
            for r in range(rings - 1)
            for s in range(SIDES)
        ]
        return self.add(parent, joint, points.reshape(-1, 3), around)

    def leaf(self, parent: int, joint: np.ndarray, size: float, mirrored: bool) -> int:
        """Return quads and triangles; all leaves are the same shape, turned, scaled and mirrored."""
        rows = np.array([[0.0, 0.0], [0.3, 0.25], [0.6, 0.35], [0.8, 0.2]])
        shape = np.array([[x, y * side, 0.2 * x * x + 0.1 * side * y] for x, y in rows for side in (-1, 0, 1)])
        turn = np.linalg.qr(self.random.normal(size=(3, 3)))[0]
        turn[:, 0] *= np.sign(np.linalg.det(turn)) * (-1 if mirrored else 1)
        faces = [[3 * i + j, 3 * i + j + 1, 3 * i + j + 4, 3 * i + j + 3] for i in range(1, 3) for j in range(2)]
        return self.add(parent, joint, joint + size * shape @ turn.T, [[0, 4, 3], [2, 5, 4], *faces])


def tree(seed: int = 3) -> Growing:
    """Return a plant of a trunk and limbs that are tubes, twigs that are lines of points, leaves, and a stone beside
    them.
    """
    plant = Growing(seed)
    random = plant.random
    trunk = plant.tube(-1, np.zeros(3), np.array([0.1, 0.0, 3.0]), 14, 0.08)
    for limb in range(3):
        heading = 2.4 * limb
        joint = np.array([0.1 * (0.4 + 0.12 * limb), 0.0, 3.0 * (0.4 + 0.12 * limb)])
        end = joint + np.array([np.cos(heading), np.sin(heading), 0.5]) * (1.4 - 0.15 * limb)
        twig_base = plant.tube(trunk, joint, end, 9, 0.03)
        for k in range(1):
            start = joint + (end - joint) * (0.5 + 0.5 * k)
            steps = 0.08 * (np.array([np.cos(heading), np.sin(heading), 0.2]) + random.normal(size=(8, 3)) * 0.3)
            twig = plant.add(twig_base, start, start + steps.cumsum(axis=0))
            for i in range(5):
                at = plant.points[twig][1 + i]
                plant.leaf(twig, at, 0.12 + 0.03 * random.random(), bool(i % 2))
    for needle in range(12):
        joint = plant.points[trunk][SIDES * 13 + needle % SIDES]
        plant.add(trunk, joint, joint + np.linspace(0.02, 0.2, 5)[:, None] * random.normal(size=3))
    u, v = np.meshgrid(np.linspace(0, 1, 14), np.linspace(-0.3, 0.3, 10), indexing="ij")
    blade = np.stack([1.0 + u, 1.0 + v, 0.8 * u - 0.7 * u * u + 0.4 * v * v], axis=2).reshape(-1, 3)
    grid = [[10 * i + j, 10 * i + j + 1, 10 * i + j + 11, 10 * i + j + 10] for i in range(13) for j in range(9)]
    plant.add(-1, np.array([1.0, 1.0, 0.0]), blade + 1e-3 * random.normal(size=blade.shape), grid)
    return plant


def motion(plant: Growing, frames: int, wind: float, turns: float, noise: float, gust: float) -> np.ndarray:
    """Return positions (frames, vertices, 3) of a plant whose branches turn about their joints and carry the branches
    on them. `wind` and `gust` are amplitudes, `turns` the number of periods in the clip, and `noise` the noise of each
    position.
    """
    time = np.linspace(0.0, 1.0, frames, endpoint=False)
    gusts = plant.random.normal(size=frames) * gust
    turned: list[tuple[np.ndarray, np.ndarray]] = []  # For each branch: matrix and shift of each frame.
    positions = []
    for b, (points, parent, joint) in enumerate(zip(plant.points, plant.parents, plant.joints)):
        matrix, shift = (np.eye(3)[None], np.zeros((1, 3))) if parent < 0 else turned[parent]
        turn = matrix @ rotations(b, time, wind * (0.3 if parent < 0 else 1.0), turns, len(points) == LEAF)
        shift = shift + (matrix @ joint) - (turn @ joint)
        turned.append((turn, shift))
        x = points - joint
        if len(points) > LEAF:
            x = x + 0.1 * plant.random.normal(size=3)
        bend = (wind * 0.1 * np.sin(2 * np.pi * (turns * time + 0.1 * b)) + gusts + 0.2)[:, None] * (x**2).sum(axis=1)
        x = x + bend[:, :, None] * np.array([1.0, 0.4, -0.1])
        positions.append((turn @ joint + shift)[:, None, :] + x @ turn.transpose(0, 2, 1))
    noiseless = np.concatenate(positions, axis=1)
    return noiseless + noise * plant.random.normal(size=noiseless.shape)


def rotations(b: int, time: np.ndarray, wind: float, turns: float, flutters: bool) -> np.ndarray:
    """Return rotation matrices (frames, 3, 3) of branch number `b` about two axes. `turns` is the number of periods in
    the clip, and `flutters` adds a faster motion.
    """
    a, c = (
        wind * size * np.sin(2 * np.pi * (turns * k * time) + phase * b)
        for size, k, phase in ((0.08, 1, 0.7), (0.3 if flutters else 0.04, 3, 1.9))
    )
    zero, one = np.zeros_like(time), np.ones_like(time)
    first = np.array([[np.cos(a), zero, np.sin(a)], [zero, one, zero], [-np.sin(a), zero, np.cos(a)]])
    second = np.array([[one, zero, zero], [zero, np.cos(c), -np.sin(c)], [zero, np.sin(c), np.cos(c)]])
    return first.transpose(2, 0, 1) @ second.transpose(2, 0, 1)


def clip(name: str) -> Any:
    """Return the clip that a vector's name selects: sway in wind with frames that repeat and uneven times, a loop, or
    several of these.
    """
    import athcodec
    from athcodec.motion.clip import MotionClip

    plant = tree()
    rest = np.concatenate(plant.points)
    corners = [v for face in plant.faces for v in face]
    place = np.arange(len(rest))
    if name == "all":
        place = np.append(place, place[::SPLIT])
        corners = [len(rest) + v // SPLIT if v % SPLIT == 0 and i % 2 else v for i, v in enumerate(corners)]
    frames, gust = (40, 0.15) if name == "refined-rest" else (22, 0.03)
    wind = motion(plant, frames, 1.0, 2.3, 1e-4, gust)
    loop = motion(plant, 12, 0.6, 1.0, 0.0, 0.0)
    if name == "predicted":
        jumps = plant.random.normal(size=wind.shape) * (plant.random.random(wind.shape[:2]) < 0.1)[:, :, None]
        wind = wind[19] + 0.05 * jumps.cumsum(axis=0)
    wind[20:23] = wind[19]

    def clip_of(positions: np.ndarray, jitter: float) -> MotionClip:
        """Return positions (T, V, 3) as a clip of the plant, with its branches, faces and attributes. `jitter` is the
        largest random shift of the times, in seconds.
        """
        return MotionClip(
            positions=positions[:, place].astype(np.float32),
            rest=rest[place],
            time=np.arange(len(positions)) / 24 + jitter * plant.random.random(len(positions)),
            vertex_branch=np.repeat(np.arange(len(plant.parents)), list(map(len, plant.points)))[place],
            branch_parent=np.array(plant.parents),
            edges=np.array([[face[0], face[1]] for face in plant.faces]),
            attributes={
                "face_vertex_counts": np.array([len(face) for face in plant.faces], np.uint8),
                "face_vertex_indices": np.array(corners, np.int32),
                "colour": np.round(plant_colours(plant)[place], 2).astype(np.float32),
                "species": np.array([b"salix"]),
            },
            metadata={"unit": "m", "plant": {"height": 3.0}},
        )

    return athcodec.join({"wind": clip_of(wind, 0.01), "loop": athcodec.looped(clip_of(loop, 0.01))})


def plant_colours(plant: Growing) -> np.ndarray:
    return np.concatenate(
        [np.repeat([[0.2 + 0.01 * (b % 9), 0.5, 0.1]], len(p), 0) for b, p in enumerate(plant.points)]
    )


def encoded(name: str) -> bytes:
    """Return the bytes of a real-size plant's file as athcodec writes it. `name` selects the clip and forces features:
    layers about the mean pose, a refined rest pose, or motion about the exact rest pose.
    """
    import athcodec
    from athcodec.encoding.search import start
    from athcodec.encoding.search.search import Search

    best, share = Search.about_best_reference, start.AT_ONCE_SHARE
    if name == "all":
        Search.about_best_reference = Search.about_mean_pose
    if name == "exact-rest":
        Search.about_best_reference = lambda search: search
    if name == "refined-rest":
        start.AT_ONCE_SHARE = 0.0
    try:
        with tempfile.TemporaryDirectory() as folder:
            target = Path(folder) / "clip.ath"
            athcodec.encode(clip(name), target, **OPTIONS[name])
            return target.read_bytes()
    finally:
        Search.about_best_reference, start.AT_ONCE_SHARE = best, share


def features(data: bytes) -> set[str]:
    """Return the names of the features of the format that a file uses."""
    opened = File(data, strict=True)
    file, header = opened.file, opened.header
    of_refinements = file.parts.height + 1  # above it STEMS begin with Ratio
    method, heads = opened.content(rules.REST)[0], []
    for (kind, level, _), chunk in file.chunks.items():
        if kind == rules.STEMS:
            heads.append(chunk.bytes[2 if level > of_refinements else 0 :])
    joins = [join for row in header.joins.values() for join in row]
    shown = {
        "several clips": len(file.clips) > 1,
        "a loop": any(clip.seams is not None for clip in file.clips),
        "periodic waves": any(clip.periodic for clip in file.clips),
        "layers": header.layer_count > 1,
        "predicted motion": header.is_predicted,
        "joins": any(join.width for join in joins),
        "sloped joins": any(join.is_sloped for join in joins),
        "repeats": any(header.repeats),
        "learned bases": any(head[5] > 0 for head in heads),
        "sheets": any(branch.flags & rules.SHEET for branch in file.branches),
        "loose branches": any(branch.flags & rules.LOOSE and branch.parent >= 0 for branch in file.branches),
        "whole subtrees": any(branch.flags & rules.WHOLE for branch in file.branches),
        "tubes": any(branch.ring for branch in file.branches),
        "rigid branches": any(branch.rigid for branch in file.branches),
        "detail": any(branch.detail for branch in file.branches),
        "several pieces": any(rules.piece_count(branch) > 1 for branch in file.branches),
        "several roots": sum(branch.parent < 0 for branch in file.branches) > 1,
        "exact rest pose": method & 1,
        "connected rest pose": method & 8,
        "uneven times": opened.content(rules.TIME)[0] == 2,
        "mixed faces": opened.content(rules.FACES)[0] & 8,
        "attributes": bool(file.attributes),
        "places": header.place_count < header.vertex_count,
    }
    kinds = {KIND_NAMES[kind] for kind, _, _ in file.chunks} | ({"ATTRIBUTE"} if file.attributes else set())
    return {feature for feature, there in shown.items() if there} | kinds
