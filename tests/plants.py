"""Motion clips made for tests: plants with nasty hierarchies, shapes and motions, as plain arrays."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from athcodec import MotionClip
from athcodec.encoding.model.quantise import least_bound
from athcodec.motion.clip import source_stem_index
from bench.odd import SAMPLES


def random_hierarchy(rng: np.random.Generator, branches: int, longest: int, roots: int = 1):
    """(vertex_branch, branch_parent) of a random plant, stems of 1 to `longest` vertices."""
    parent = np.array([-1 if b < roots else rng.integers(0, b) for b in range(branches)], np.int32)
    counts = rng.integers(1, longest + 1, branches)
    return np.repeat(np.arange(branches, dtype=np.int32), counts), parent


def chain(branches: int, longest: int):
    """Every branch hangs on the one before."""
    return (np.repeat(np.arange(branches, dtype=np.int32), longest), np.arange(-1, branches - 1, dtype=np.int32))


def grow(rng: np.random.Generator, vertex_branch: np.ndarray, branch_parent: np.ndarray, wild: float = 0.3):
    """A rest pose: stems of unit steps that bend at random and start near a vertex of their parent; (N, 3)."""
    rest = np.zeros((len(vertex_branch), 3))
    for branch, parent in enumerate(branch_parent):
        mine = np.flatnonzero(vertex_branch == branch)
        base = np.flatnonzero(vertex_branch == parent)
        start = rest[rng.choice(base)] if parent >= 0 else rng.normal(size=3) * branch
        heading = rng.normal(size=3)
        for vertex in mine:
            heading += wild * rng.normal(size=3)
            start = start + heading / np.linalg.norm(heading)
            rest[vertex] = start
    return rest


def sway(rng: np.random.Generator, rest: np.ndarray, frames: int, amount: float = 0.2, rough: float = 0.01):
    """Smooth swaying that grows with height, and some noise; (frames, N, 3)."""
    t = np.linspace(0, 2 * np.pi, frames)[:, None, None]
    size = np.ptp(rest, axis=0).max() + 1e-9
    phase = rng.uniform(0, 6, 3)
    lift = np.linalg.norm(rest - rest[0], axis=1)[None, :, None] / size
    motion = amount * size * lift**2 * np.sin(t * np.array([1.0, 2.0, 3.0]) + phase + 2 * lift)
    return rest + motion + rough * rng.normal(size=(frames, len(rest), 3))


def plant(
    seed: int = 0,
    branches: int = 12,
    longest: int = 9,
    frames: int = 30,
    roots: int = 1,
    dtype=np.float32,
    scale: float = 1.0,
    offset: float = 0.0,
    **motion,
) -> MotionClip:
    """A random plant that sways."""
    rng = np.random.default_rng(seed)
    vertex_branch, branch_parent = random_hierarchy(rng, branches, longest, roots)
    rest = grow(rng, vertex_branch, branch_parent)
    positions = sway(rng, rest, frames, **motion)
    return clip_of(positions * scale + offset, rest * scale + offset, vertex_branch, branch_parent, dtype)


def clip_of(positions, rest, vertex_branch, branch_parent, dtype=np.float32, **more) -> MotionClip:
    """Plain arrays as a clip at 30 frames a second."""
    return MotionClip(
        positions=np.asarray(positions, dtype),
        rest=np.asarray(rest, float),
        time=np.arange(len(positions)) / 30,
        vertex_branch=vertex_branch,
        branch_parent=branch_parent,
        **more,
    )


def tube(rings: int, around: int, frames: int, seed: int = 0) -> MotionClip:
    """A bark mesh: rings of vertices about a bending centre line, one stem."""
    rng = np.random.default_rng(seed)
    z = np.linspace(0, 10, rings)
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    offset = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1) * 0.3
    rest = (np.stack([0 * z, 0 * z, z], 1)[:, None] + offset).reshape(-1, 3)
    bend = 0.03 * np.sin(np.linspace(0, 6, frames) + rng.uniform(0, 6))[:, None]
    turn = bend * z[None] * 2
    line = np.stack([bend * z**2, 0 * turn, z + 0 * turn], -1)
    cos, sin = np.cos(turn)[..., None], np.sin(turn)[..., None]
    x, y, w = offset[:, 0], offset[:, 1], offset[:, 2]
    turned = np.stack([cos * x + sin * w, y + 0 * cos, -sin * x + cos * w], -1)
    positions = (line[:, :, None] + turned).reshape(frames, -1, 3)
    return clip_of(positions, rest, np.zeros(len(rest), np.int32), np.array([-1], np.int32))


SHAPES = ("stem", "point", "straight", "flat", "stuttering", "coincident")
MOTIONS = ("static", "sway", "noise", "teleport", "mirror", "flatten", "drift", "spin")

STEADY = settings(derandomize=True, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow])
"""Hypothesis with the same examples in every run, and without limits of time, which a busy machine exceeds."""
settings.register_profile("steady", STEADY)
settings.load_profile("steady")


def awkward(
    seed: int,
    branches: int = 6,
    longest: int = 7,
    frames: int = 20,
    roots: int = 1,
    shape: str | None = None,
    motion: str | None = None,
    on_first_vertex: bool = False,
    shuffled: bool = False,
    scale: float = 1.0,
    offset: float = 0.0,
    dtype=np.float32,
    **more,
) -> MotionClip:
    """A plant of degenerate stems in degenerate motion; a `shape` or `motion` of None is drawn anew for each branch or
    clip. offset: distance from the origin in plant sizes. shuffled: vertices and branches numbered at random, with a
    stem index that gives their order.
    """
    rng = np.random.default_rng(seed)
    vertex_branch, branch_parent = random_hierarchy(rng, branches, longest, roots)
    rest = np.zeros((len(vertex_branch), 3))
    for branch, parent in enumerate(branch_parent):
        mine = np.flatnonzero(vertex_branch == branch)
        base = np.flatnonzero(vertex_branch == parent)
        start = rest[base[0] if on_first_vertex else rng.choice(base)] if parent >= 0 else rng.normal(size=3) * branch
        rest[mine] = start + _stem(rng, len(mine), shape or rng.choice(SHAPES))
    positions = _moved(rng, rest, vertex_branch, branch_parent, frames, motion or rng.choice(MOTIONS))
    rest, positions = (rest + 7 * offset) * scale, (positions + 7 * offset) * scale
    if not shuffled:
        return clip_of(positions, rest, vertex_branch, branch_parent, dtype, **more)
    return _renumbered(rng, positions, rest, vertex_branch, branch_parent, dtype, more)


def _stem(rng: np.random.Generator, count: int, shape: str) -> np.ndarray:
    """(count, 3) from a base at the origin."""
    steps = rng.normal(size=(count, 3)) + rng.normal(size=3)
    if shape == "straight":
        steps = np.abs(rng.normal(size=(count, 1))) * rng.normal(size=3)
    elif shape == "flat":
        steps = steps @ np.diag([1.0, 0.0, 1.0])
    elif shape == "stuttering":
        steps[rng.random(count) < 0.5] = 0.0
    elif shape == "coincident":
        steps[:] = 0.0
    elif shape == "point":
        steps[1:] = 0.0
    return np.cumsum(steps, axis=0) * 0.3


def subtree(branch_parent: np.ndarray, root: int) -> np.ndarray:
    """(B,) bool: the branches of a subtree, where parents have smaller numbers."""
    inside = np.arange(len(branch_parent)) == root
    for branch, parent in enumerate(branch_parent):
        inside[branch] |= parent >= 0 and inside[parent]
    return inside


def _moved(rng, rest, vertex_branch, branch_parent, frames: int, motion: str) -> np.ndarray:
    still = np.repeat(rest[None], frames, axis=0)
    if motion == "static":
        return still
    if motion == "noise":
        return still + 0.3 * rng.normal(size=still.shape)
    moving = sway(rng, rest, frames, rough=1e-3)
    some = subtree(branch_parent, int(rng.integers(len(branch_parent))))[vertex_branch]
    centre, later = rest[some].mean(axis=0), slice(frames // 2, None)
    if motion == "teleport":
        late = moving[later]
        late[:, some] += 100 * rng.normal(size=3)
    elif motion in ("mirror", "flatten"):
        factor = np.array([-1.0, 1, 1]) if motion == "mirror" else np.array([1.0, 0, 1])
        late = moving[later]
        late[:, some] = (late[:, some] - centre) * factor + centre
    elif motion == "drift":
        moving += np.linspace(0, 1, frames)[:, None, None] * rng.normal(size=3) * 20
    elif motion == "spin":
        angle = np.linspace(0, 9, frames)
        cos, sin, zero = np.cos(angle), np.sin(angle), 0 * angle
        turn = np.array([[cos, -sin, zero], [sin, cos, zero], [zero, zero, zero + 1]]).transpose(2, 0, 1)
        moving = moving @ turn
    return moving


def _renumbered(rng, positions, rest, vertex_branch, branch_parent, dtype, more) -> MotionClip:
    vertex, branch = rng.permutation(len(rest)), rng.permutation(len(branch_parent))
    places = source_stem_index(vertex_branch)
    new_branch = np.argsort(branch)
    parent = branch_parent[branch]
    return clip_of(
        positions[:, vertex],
        rest[vertex],
        new_branch[vertex_branch[vertex]],
        np.where(parent < 0, -1, new_branch[parent]),
        dtype,
        stem_index=places[vertex],
        **more,
    )


def chain_plant(branches: int, longest: int, frames: int = 12, seed: int = 0) -> MotionClip:
    """A chain of branches, each on the one before."""
    rng = np.random.default_rng(seed)
    labels, parents = chain(branches, longest)
    rest = np.cumsum(rng.normal(size=(len(labels), 3)) * 0.1 + [0.0, 0.0, 0.3], axis=0)
    return clip_of(sway(rng, rest, frames, rough=1e-3), rest, labels, parents)


def bush(branches: int, longest: int = 3, frames: int = 12, seed: int = 0) -> MotionClip:
    """Many branches on one stem."""
    rng = np.random.default_rng(seed)
    counts = np.append(30, rng.integers(1, longest + 1, branches - 1))
    labels = np.repeat(np.arange(branches), counts)
    parents = np.append(-1, np.zeros(branches - 1, int))
    rest = grow(rng, labels, parents)
    return clip_of(sway(rng, rest, frames, rough=1e-3), rest, labels, parents)


@st.composite
def awkward_plants(draw, **fixed):
    """`awkward` with everything drawn but what is `fixed`."""
    branches = draw(st.integers(1, 10))
    drawn = dict(
        seed=draw(st.integers(0, 10**6)),
        branches=branches,
        roots=draw(st.integers(1, min(3, branches))),
        longest=draw(st.sampled_from([1, 2, 3, 7, 70])),
        frames=draw(st.sampled_from([1, 2, 3, 15, 16, 17, 33])),
        shape=draw(st.sampled_from([None, *SHAPES])),
        motion=draw(st.sampled_from(MOTIONS)),
        on_first_vertex=draw(st.booleans()),
        shuffled=draw(st.booleans()),
        scale=draw(st.sampled_from([1e-6, 1.0, 1e6])),
        offset=draw(st.sampled_from([0.0, 1e3])),
        dtype=draw(st.sampled_from([np.float32, np.float64])),
    )
    return awkward(**drawn | fixed)


def runs_of_points(
    counts: list[int], frames: int = 24, seed: int = 0, order: str = "runs", still: int = 1, drift: float = 0.0
) -> MotionClip:
    """Runs of so many points that bend and keep the lengths of their elements, a root each.

    order: of the vertices, run after run, all first points before all second ones ("interleaved"), or at random.
    still: lowest points that do not move. drift: how far runs move as a whole, over their own length of about 1.
    """
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 2 * np.pi, frames)

    def waves(size: float) -> np.ndarray:
        return size * np.sin(rng.uniform(0.5, 2, 3) * time[:, None] + rng.uniform(0, 6.28, 3))

    positions = []
    for count in counts:
        share = np.clip(np.arange(1, count) - (still - 1), 0, None) / max(1, count)
        slope = rng.normal(0, 0.3, 3) + waves(0.8)[:, None] * share[:, None]
        heading = slope + [0.0, 1.0, 0.0]
        heading *= rng.uniform(0.5, 1.5) / max(1, count) / np.linalg.norm(heading, axis=2, keepdims=True)
        base = rng.uniform(-1, 1, 3) * [len(counts) ** 0.5 / 5, 0, len(counts) ** 0.5 / 5] + waves(drift)
        positions.append(base[:, None] + np.concatenate([np.zeros((frames, 1, 3)), np.cumsum(heading, axis=1)], axis=1))
    branch = np.repeat(np.arange(len(counts)), counts)
    place = source_stem_index(branch)
    vertices = {
        "runs": np.arange(len(branch)),
        "interleaved": np.argsort(place, kind="stable"),
        "shuffled": rng.permutation(len(branch)),
    }[order]
    moved = np.concatenate(positions, axis=1)[:, vertices]
    return clip_of(moved, moved[0], branch[vertices], np.full(len(counts), -1), stem_index=place[vertices])


def ring_quads(rings: int, around: int) -> np.ndarray:
    """(F, 4) of a tube whose vertices go ring by ring."""
    ring, side, following = np.arange(rings - 1)[:, None] * around, np.arange(around), np.roll(np.arange(around), -1)
    corners = [ring + side, ring + following, ring + around + following, ring + around + side]
    return np.stack(corners, axis=-1).reshape(-1, 4).astype(np.int32)


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """The largest of any vertex in any frame."""
    return float(np.linalg.norm(np.asarray(a, np.float64) - b, axis=-1).max())


def diagonal(clip: MotionClip) -> float:
    return float(np.linalg.norm(np.ptp(clip.block(0, clip.frame_count).reshape(-1, 3).astype(np.float64), axis=0)))


def bound_for(clip: MotionClip, fraction: float) -> float:
    """A fraction of the diagonal, but something that the source's numbers and 30-bit steps can express."""
    low, high = clip.positions.min(axis=(0, 1)), clip.positions.max(axis=(0, 1))
    away = float(np.abs(clip.positions - clip.rest).max())
    return max(fraction * diagonal(clip), 3 * least_bound(low, high, clip.dtype), 1e-6 * away)


def turns(angles: np.ndarray) -> np.ndarray:
    """(..., 3, 3) rotations of rotation vectors (..., 3)."""
    size = np.linalg.norm(angles, axis=-1)[..., None, None] + 1e-12
    x, y, z = np.moveaxis(angles, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3) / size
    return np.eye(3) + np.sin(size) * cross + (1 - np.cos(size)) * cross @ cross


def blown_tree(seed: int, branches: int = 120, frames: int = 120, lean: float = 1.2, sway: float = 0.15) -> MotionClip:
    """A scanned tree in a gale: straight stems of one to five vertices, each leaning away from its parent by as much as
    a right angle in all frames, so that tips have turned right over from their rest pose, and swaying about that."""
    rng = np.random.default_rng(seed)
    parent, counts = [-1], [12]
    for b in range(1, branches):
        parent.append(int(rng.integers(max(0, b - 40), b)) if rng.random() < 0.7 else 0)
        counts.append(int(rng.choice([1, 2, 2, 3, 3, 4, 5])))
    first = np.cumsum([0, *counts])
    rest, positions = np.zeros((first[-1], 3)), np.zeros((frames, first[-1], 3))
    time, wind, turned = np.arange(frames) / 30, lean * rng.normal(size=3), []
    for b, count in enumerate(counts):
        heading = rng.normal(size=3)
        heading[1] = abs(heading[1]) + 0.3
        heading = np.array([0.0, 1.0, 0.0]) if b == 0 else heading / np.linalg.norm(heading)
        length = 8.0 if b == 0 else rng.uniform(0.1, 1.5)
        rate, phase = rng.uniform(0.2, 4.0, 3), rng.uniform(0.0, 6.0, 3)
        swing = rng.uniform(0.0, sway) * np.sin(2 * np.pi * rate * time[:, None] + phase)
        turn = turns(swing + rng.uniform(0.0, 0.4 if b else 0.08) * wind)
        turned.append(turned[parent[b]] @ turn if b else turn)
        hold = first[parent[b]] + rng.integers(counts[parent[b]]) if b else 0
        along = np.arange(count) + (b > 0)
        offsets = along[:, None] * heading * length / max(count - 1, 1)
        own = slice(first[b], first[b + 1])
        rest[own] = rest[hold] * (b > 0) + offsets
        positions[:, own] = positions[:, [hold]] * (b > 0) + np.einsum("tij,vj->tvi", turned[b], offsets)
    return MotionClip(
        positions.astype(np.float32),
        time,
        rest=rest.astype(np.float32),
        vertex_branch=np.repeat(np.arange(branches, dtype=np.int32), counts),
        branch_parent=np.array(parent, np.int32),
    )


def meadow(blades: int, frames: int = 30, rows: int = 8, seed: int = 0, faces: bool = True) -> MotionClip:
    """Blades of about a metre with their feet in 12 m of ground, over which gusts travel: each a root, two vertices
    for a row, which bends as a cantilever."""
    rng, t = np.random.default_rng(seed), np.arange(frames) / 30
    foot, height = rng.uniform(0, 12, (blades, 2)), rng.uniform(0.7, 1.2, blades)
    turned = rng.uniform(0, np.pi, blades)
    up = np.linspace(0, 1, rows)
    bend = 0.15 * rng.normal(size=(2, blades, 1)) + np.zeros((2, blades, frames))
    for speed, size in ((1.7, 0.2), (3.1, 0.12), (5.3, 0.05)):
        phase = speed * t - speed / 2 * foot @ rng.normal(size=(2, 1)) + rng.uniform(0, 6)
        bend += size * rng.normal(size=(2, 1, 1)) * np.sin(phase)
    across = np.moveaxis(bend[..., None] * up**2, 0, -1)  # (blades, T, rows, 2)
    along = height[:, None, None] * up * np.sqrt(1 - np.clip((across**2).sum(axis=3), 0, 0.9))
    line = np.concatenate([across * height[:, None, None, None] + foot[:, None, None], along[..., None]], axis=3)
    half = 0.01 * np.stack([np.cos(turned), np.sin(turned), 0 * turned], axis=1)[:, None, None] * (1.2 - up[:, None])
    positions = np.stack([line - half, line + half], axis=3).reshape(blades, frames, 2 * rows, 3)
    positions = np.moveaxis(positions, 1, 0).reshape(frames, -1, 3)
    quads = 2 * np.arange(rows - 1)[:, None] + [0, 1, 3, 2]
    surface = (2 * rows * np.arange(blades)[:, None, None] + quads).reshape(-1, 4) if faces else None
    branch = np.repeat(np.arange(blades), 2 * rows)
    return clip_of(positions, positions.mean(axis=0), branch, np.full(blades, -1), faces=surface)


def opening_flower(petals: int, frames: int = 60, seed: int = 0) -> MotionClip:
    """Petals of 8 x 6 vertices on the tip of a stalk, which open slowly, one after the other."""
    rng, at = np.random.default_rng(seed), np.linspace(0, 1, frames)[:, None, None]
    u, v = (each.T for each in np.meshgrid(np.linspace(0, 1, 8), np.linspace(-1, 1, 6)))
    stalk = np.zeros((frames, 12, 3)) + np.linspace(-1, 0, 12)[:, None] * [0, 0, 1]
    parts, quads = [stalk], []
    for petal in range(petals):
        heading, length = 2.4 * petal + 0.1 * rng.normal(), rng.uniform(0.5, 0.8)
        open_ = 1 / (1 + np.exp(-12 * (at - 0.35 - rng.uniform(0, 0.3))))
        angle = 1.5 - 1.4 * open_ + 1.1 * (open_ - 1) * u + 0.1 * np.sin(3 * u * v * open_ + petal)
        step = (0.5 + 0.5 * open_) * length / 8
        out, up = (np.cumsum(turn(angle) * step, axis=1) for turn in (np.cos, np.sin))
        side = 0.2 * length * (0.4 + 0.6 * open_) * v * np.sqrt(np.sin(np.pi * (0.9 * u + 0.05)))
        cos, sin = np.cos(heading), np.sin(heading)
        parts.append(np.stack([cos * out - sin * side, sin * out + cos * side, up], axis=3).reshape(frames, -1, 3))
        corner = 12 + 48 * petal + 6 * np.arange(7)[:, None] + np.arange(5)
        quads.append(np.stack([corner, corner + 1, corner + 7, corner + 6], axis=2).reshape(-1, 4))
    positions = np.concatenate(parts, axis=1)
    branch = np.concatenate([np.zeros(12, int), np.repeat(np.arange(1, petals + 1), 48)])
    return clip_of(positions, positions[0], branch, np.append(-1, np.zeros(petals, int)), faces=np.concatenate(quads))


def bending_tube() -> MotionClip:
    """Of quads, which bends to one side."""
    clip = tube(40, 12, 30)
    clip.positions = clip.positions * np.float32(1)
    clip.positions[..., 0] += (np.arange(30, dtype=np.float32) / 29)[:, None] * np.float32(0.06) * clip.rest[:, 2] ** 2
    clip.faces = ring_quads(40, 12)
    clip.check()
    return clip


def flowing_growth(frames: int = 120) -> MotionClip:
    """A tree of lines whose branches come out without a stop; its motion can be predicted from frame to frame."""
    clip = SAMPLES["growth_flowing"].make()
    return clip.replace(positions=clip.block(0, frames), time=clip.time[:frames])
