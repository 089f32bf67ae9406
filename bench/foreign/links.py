"""Shrubs of rigid links on ball joints with springs, which the physics engine MuJoCo moves in turbulent wind."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from bench.foreign.tubes import tubes
from bench.trees.plant import Plant, grow
from bench.trees.wind import Wind

FRAMES = 80
FPS = 30.0
STEPS = 8  # Steps of the engine in a frame.
DENSITY = 700.0  # kg/m3
YOUNG = 2e8  # N/m2
DAMPING = 0.03  # Seconds.
SIDES, LEAVES, WIDTH = 5, 2, 0.05  # Leaves: on each node that carries foliage. Width: what the wind sees, in metres.


def bush(path: Path, seed: int, stems: int, nodes: int, height: float) -> None:
    """Write a NumPy archive of a shrub's mesh in wind: `stems` stems of `nodes` nodes that leave one patch of ground,
    each with side stems, and with cards as leaves.
    """
    rng = np.random.default_rng(seed)
    points, faces, motion = [], [], []
    wind = Wind(4.0, height, length=2.0, seed=seed)
    count = 0
    for stem in range(stems):
        plant = grow(nodes, 1, height * rng.uniform(0.6, 1.2), seed + stem)
        foot, lean = rng.normal(0, 0.12, 3) * [1, 0, 1], rng.normal(0, 0.25, 3) * [1, 0, 1]
        rest = plant.position + foot + plant.position[:, 1:2] * lean
        moved = _moved(plant, rest, wind)
        bark, quads = tubes(plant, SIDES)
        leaf = np.repeat(np.flatnonzero(plant.foliage > 0), LEAVES)
        along, across = rng.normal(size=(2, len(leaf), 3)) * [[[0.06]], [[0.02]]]
        cards = np.stack([0 * along, along / 2 + across, along, along / 2 - across], axis=1)
        carrier = np.concatenate([np.repeat(np.arange(nodes), SIDES), np.repeat(leaf, 4)])
        offset = np.concatenate([bark - np.repeat(plant.position, SIDES, axis=0), cards.reshape(-1, 3)])
        places, turns = moved
        motion.append(places[:, carrier] + np.einsum("tnij,nj->tni", turns[:, carrier], offset))
        card_faces = len(bark) + np.arange(4 * len(leaf)).reshape(-1, 4)
        faces.append(count + np.concatenate([quads, card_faces]))
        count += len(offset)
        points.append(offset)
    positions = np.concatenate(motion, axis=1).astype(np.float32)
    np.savez(path, positions=positions, faces=np.concatenate(faces).astype(np.int32), fps=FPS)


def _moved(plant: Plant, rest: np.ndarray, wind: Wind) -> tuple[np.ndarray, np.ndarray]:
    """Simulate a plant as rigid links on sprung joints in the wind. Return the positions (T, N, 3) and rotation
    matrices (T, N, 3, 3) of the ends of its N elements; the lowest element stands still.
    """
    below = plant.parent
    piece = rest - rest[np.maximum(below, 0)]
    lengths = np.linalg.norm(piece, axis=1)
    children: list[list[int]] = [[] for _ in below]
    for node, parent in enumerate(below[1:].tolist(), start=1):
        children[parent].append(node)

    def body(node: int) -> str:
        """Return the MuJoCo XML of the element that ends at `node`, with the elements of all nodes above it inside."""
        parent, radius = int(below[node]), max(float(plant.radius[node]), 0.003)
        place = piece[parent] if below[parent] >= 0 else 0 * piece[node] if parent else rest[0]
        end, start = _words(piece[node]), _words(place)
        stiff = YOUNG * np.pi / 4 * radius**4 / lengths[node]
        mass = DENSITY * np.pi * radius**2 * lengths[node]
        inside = "".join(body(child) for child in children[node])
        return (
            f'<body pos="{start}"><joint type="ball" stiffness="{stiff}" damping="{stiff * DAMPING}"/>'
            f'<geom type="capsule" fromto="0 0 0 {end}" size="{radius}" mass="{mass}" contype="0" conaffinity="0"/>'
            f"{inside}</body>"
        )

    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 0 0" timestep="{1 / FPS / STEPS}" integrator="implicitfast"/>
        <worldbody>{"".join(body(child) for child in children[0])}</worldbody></mujoco>"""
    )
    state = mujoco.MjData(model)
    mujoco.mj_forward(model, state)
    order = _preorder(children)
    bodies = np.arange(1, model.nbody)
    places, turns = np.empty((FRAMES, len(below), 3)), np.tile(np.eye(3), (FRAMES, len(below), 1, 1))
    places[:, 0] = rest[0]
    for step in range((FRAMES - 1) * STEPS + 1):
        turn = state.xmat[1:].reshape(-1, 3, 3)
        if step % STEPS == 0:
            places[step // STEPS, order] = state.xpos[1:] + np.einsum("nij,nj->ni", turn, piece[order])
            turns[step // STEPS, order] = turn
        blown = wind.at(state.xipos[1:], state.time)
        drag = 0.6 * WIDTH * lengths[order, None] * np.linalg.norm(blown, axis=1, keepdims=True) * blown
        state.xfrc_applied[bodies, :3] = drag * (plant.radius[order, None] / 0.02) ** 2
        mujoco.mj_step(model, state)
    return places, turns


def _preorder(children: list[list[int]]) -> np.ndarray:
    """Return the nodes above the lowest in the order of their bodies: each before what it carries, subtree after
    subtree."""
    order, waiting = [], children[0][::-1]
    while waiting:
        node = waiting.pop()
        order.append(node)
        waiting += children[node][::-1]
    return np.array(order)


def _words(vector: np.ndarray) -> str:
    return " ".join(map(str, vector.tolist()))
