"""Wind of a vertex shader: trees of cards whose vertex colours say how far and in which phase a vertex moves.

The formulas are those of Crysis (Sousa, "Vegetation procedural animation and shading in Crysis", GPU Gems 3, 2007):
the trunk bends by height, branches and leaf edges by smoothed triangle waves.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.foreign.tubes import tubes
from bench.trees.plant import grow

FPS, CARDS, SIDES = 24.0, 4, 6  # Cards: on every node that carries foliage.
WAVES = np.array([1.975, 0.793, 0.375, 0.193])


class _Tree:
    """Points, faces, and the colours: red the leaf's edge, green the branch's phase, blue how far it swings."""

    def __init__(self, nodes: int, orders: int, height: float, seed: int) -> None:
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
        """The positions that the shader gives."""
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


def morphs(path: Path, seed: int, nodes: int, frames: int) -> None:
    """A morph target for every frame, as tools that bake a shader write it for engines without one."""
    import pygltflib as gltf

    tree = _Tree(nodes, 3, 8.0, seed)
    triangles = np.concatenate([tree.faces[:, :3], tree.faces[:, [0, 2, 3]]]).astype(np.uint32)
    times = (np.arange(frames) / FPS).astype(np.float32)
    targets = [(tree.at(seconds) - tree.points).astype(np.float32) for seconds in times]
    file = gltf.GLTF2(scene=0, scenes=[gltf.Scene(nodes=[0])], nodes=[gltf.Node(name="tree", mesh=0)])
    blob = b""

    def accessor(array: np.ndarray, component: int, kind: str) -> int:
        nonlocal blob
        view = gltf.BufferView(buffer=0, byteOffset=len(blob), byteLength=array.nbytes)
        limits = {"min": array.min(axis=0, keepdims=array.ndim < 2).tolist()}
        limits["max"] = array.max(axis=0, keepdims=array.ndim < 2).tolist()
        blob += array.tobytes()
        file.bufferViews.append(view)
        file.accessors.append(
            gltf.Accessor(
                bufferView=len(file.bufferViews) - 1, componentType=component, count=len(array), type=kind, **limits
            )
        )
        return len(file.accessors) - 1

    shape = gltf.Primitive(
        attributes=gltf.Attributes(
            POSITION=accessor(tree.points.astype(np.float32), gltf.FLOAT, gltf.VEC3),
            COLOR_0=accessor(tree.colours.astype(np.float32), gltf.FLOAT, gltf.VEC3),
        ),
        indices=accessor(triangles.ravel(), gltf.UNSIGNED_INT, gltf.SCALAR),
        targets=[gltf.Attributes(POSITION=accessor(target, gltf.FLOAT, gltf.VEC3)) for target in targets],
    )
    file.meshes.append(gltf.Mesh(name="tree", primitives=[shape], weights=[1.0, *[0.0] * (frames - 1)]))
    sampler = gltf.AnimationSampler(
        input=accessor(times, gltf.FLOAT, gltf.SCALAR),
        output=accessor(np.eye(frames, dtype=np.float32).ravel(), gltf.FLOAT, gltf.SCALAR),
    )
    channel = gltf.AnimationChannel(sampler=0, target=gltf.AnimationChannelTarget(node=0, path="weights"))
    file.animations.append(gltf.Animation(name="wind", samplers=[sampler], channels=[channel]))
    file.buffers.append(gltf.Buffer(byteLength=len(blob)))
    file.set_binary_blob(blob)
    file.save_binary(str(path))


def points(path: Path, seed: int, nodes: int, frames: int) -> None:
    """A USD mesh with its points sampled in time and the colours as displayColor."""
    from pxr import Usd, UsdGeom, Vt

    tree = _Tree(nodes, 2, 1.2, seed)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(FPS)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(frames - 1)
    mesh = UsdGeom.Mesh.Define(stage, "/bush/cards")
    mesh.CreateFaceVertexCountsAttr([4] * len(tree.faces))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(tree.faces.ravel()))
    colour = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
    colour.Set(Vt.Vec3fArray.FromNumpy(tree.colours.astype(np.float32)))
    sampled = mesh.CreatePointsAttr()
    for frame in range(frames):
        sampled.Set(Vt.Vec3fArray.FromNumpy(tree.at(frame / FPS).astype(np.float32)), frame)
    stage.SetDefaultPrim(stage.GetPrimAtPath("/bush"))
    stage.Save()
