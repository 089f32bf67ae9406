"""Copies of one shape in glTF: nodes that show one mesh, each with a translation, a rotation and scales of its own.

Animations move them. glTF's EXT_mesh_gpu_instancing, which has no animation, says the same in less where none of them
moves. The node above the copies of an object has its name, and {"copies": true} in extras; what an array has for each
copy stands in the extras of its node, or among the attributes of the instancing. sources/gltf.py takes both back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from athcodec.exporters.copies import Copies, fit_copies
from athcodec.exporters.fitting import allowed_error
from athcodec.exporters.gltf_build import Glb, GltfMesh, add_mesh
from athcodec.exporters.gltf_joints import SLACK, hold
from athcodec.exporters.scene_objects import SceneObject, objects_of

INSTANCING = "EXT_mesh_gpu_instancing"
PATHS = ("translation", "rotation", "scale")


@dataclass(eq=False)
class Movers:
    """Nodes that animations move: where J of them are at rest and in T frames, as Joints has it."""

    nodes: list[int]
    rest: tuple[np.ndarray, ...]
    poses: tuple[np.ndarray, ...]

    @classmethod
    def all_of(cls, movers: list[Movers]) -> Movers | None:
        """Those of several, one after the other; None of none."""
        if not movers:
            return None
        return cls(
            [node for each in movers for node in each.nodes],
            tuple(np.concatenate(parts) for parts in zip(*(each.rest for each in movers))),
            tuple(np.concatenate(parts, axis=1) for parts in zip(*(each.poses for each in movers))),
        )


@dataclass(eq=False)
class GltfCopies:
    """`shape` is the mesh of one copy; own: what each copy has instead of each vertex, (k, width) by its semantic;
    lost: the semantics of what neither has."""

    shape: GltfMesh
    copies: Copies
    own: dict[str, np.ndarray]
    lost: list[str]

    def add(self, glb: Glb, parent: int | None, transform: dict[str, Any]) -> list[Movers]:
        """The mesh and its nodes, below one with a transform; those that move."""
        mesh = add_mesh(glb, self.shape, self.copies.shape)
        poses = self.copies.places, self.copies.turns, self.copies.scales
        if all((pose == pose[:1]).all() for pose in poses):
            self._add_instancing(glb, parent, mesh, transform)
            return []
        above = glb.node(parent, name=self.shape.name, extras={"copies": True}, **transform)
        nodes = []
        for number, (place, turn, scale) in enumerate(zip(*self.copies.rest)):
            at = dict(zip(PATHS, (place.tolist(), unit_quaternion(turn), scale.tolist())))
            extras = {key[1:]: _plain(values[number]) for key, values in self.own.items()}
            name = f"{self.shape.name}_{number}"
            nodes.append(glb.node(above, name=name, mesh=mesh, **at, **({"extras": extras} if extras else {})))
        return [Movers(nodes, self.copies.rest, poses)]

    def _add_instancing(self, glb: Glb, parent: int | None, mesh: int, transform: dict[str, Any]) -> None:
        poses = self.copies.places[0], self.copies.turns[0], self.copies.scales[0]
        parts = {path.upper(): glb.array(pose) for path, pose in zip(PATHS, poses)}
        parts |= {key: glb.array(values) for key, values in self.own.items()}
        extension = {INSTANCING: {"attributes": parts}}
        glb.node(parent, name=self.shape.name, mesh=mesh, extensions=extension, **transform)
        for key in ("extensionsUsed", "extensionsRequired"):  # without it one of them would be shown
            glb.json[key] = [INSTANCING]


def with_copies(motion: Any, found: list[GltfMesh]) -> list[GltfMesh | GltfCopies]:
    """The meshes, those that are copies of one shape as such: where transforms keep them within what the level is off,
    and they have one set of texture coordinates and colours. Attributes that copies lose all meshes lose."""
    objects, allowed = objects_of(motion), allowed_error(motion)
    instanced = {
        (objects[number].first, objects[number].count): (objects[number], copies)
        for number, copies in fit_copies(motion, objects, allowed).items()
    }
    shapes: list[GltfMesh | GltfCopies] = []
    for shape in found:
        fitted = instanced.get((int(shape.source[0]), len(np.unique(shape.source))))
        made = None if fitted is None else _as_copies(shape, *fitted)
        if made is not None:
            _hold(motion, made.copies, allowed)
        shapes.append(made or shape)
    lost = {key for shape in shapes if isinstance(shape, GltfCopies) for key in shape.lost}
    return [_without(shape, lost) for shape in shapes] if lost else shapes


def unit_quaternion(quaternion: np.ndarray) -> list[float]:
    """Of length 1 in float64."""
    exact = quaternion.astype(np.float64)
    return (exact / np.linalg.norm(exact)).tolist()


def _without(shape: GltfMesh | GltfCopies, lost: set[str]) -> GltfMesh | GltfCopies:
    if isinstance(shape, GltfCopies):
        own = {key: values for key, values in shape.own.items() if key not in lost}
        return GltfCopies(_without(shape.shape, lost), shape.copies, own, sorted(lost))
    return replace(shape, attributes={key: values for key, values in shape.attributes.items() if key not in lost})


def _hold(motion: Any, copies: Copies, allowed: float) -> None:
    """What hardly moves stands still, and needs no keys."""
    extent = np.tile(np.abs(copies.shape).max(axis=0), (copies.places.shape[1], 1))
    for start, stop in motion.clip_range_frames:
        poses = [pose[start:stop] for pose in (copies.places, copies.turns, copies.scales)]
        hold(poses, copies.rest, extent, SLACK * allowed)
    copies.max_error += len(PATHS) * SLACK * allowed


def _as_copies(shape: GltfMesh, obj: SceneObject, copies: Copies) -> GltfCopies | None:
    """None where copies have texture coordinates or colours of their own."""
    which, local = np.divmod(shape.source - obj.first, obj.count // obj.copies)
    if (np.bincount(which) * obj.copies != len(which)).any():
        return None
    rows = np.argsort(which, kind="stable").reshape(obj.copies, -1)
    if (local[rows] != local[rows[:1]]).any():
        return None
    shared, own, lost = {}, {}, []
    for key, values in shape.attributes.items():
        each = values[rows]
        if key == "NORMAL":
            shared[key] = (each[0] @ copies.axes).astype(np.float32)
        elif _same(each, each[:1]):
            shared[key] = each[0]
        elif not key.startswith("_"):
            return None
        elif _same(each, each[:, :1]):
            own[key] = each[:, 0]
        else:
            lost.append(key)
    place = np.full(len(which), -1)
    place[rows[0]] = np.arange(rows.shape[1])
    corners, materials = shape.corners, shape.materials
    if corners is not None:
        mine = (which[corners] == 0).all(axis=1)
        corners, materials = place[corners[mine]], None if materials is None else materials[mine]
    return GltfCopies(GltfMesh(shape.name, local[rows[0]], corners, shared, materials), copies, own, lost)


def _same(values: np.ndarray, expected: np.ndarray) -> bool:
    return bool(((values == expected) | ((values != values) & (expected != expected))).all())


def _plain(row: np.ndarray) -> Any:
    """As JSON has it."""
    return row[0].item() if len(row) == 1 else row.tolist()
