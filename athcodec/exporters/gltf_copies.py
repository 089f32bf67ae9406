"""Copies of one shape in glTF: nodes that show one mesh, each with a translation, a rotation and scales of its own.

Animations move them. glTF's EXT_mesh_gpu_instancing, which has no animation, says the same in less where none of them
moves. The node above the copies of an object has its name, and {"copies": true} in extras; what an array has for each
copy stands in the extras of its node, or among the attributes of the instancing. sources/gltf.py takes both back.
Objects side by side that are of one shape show one mesh too, and keep their names: the node above them has
{"copies": false}.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from athcodec.exporters.copies import Copies, fit_copies
from athcodec.exporters.fitting import allowed_error
from athcodec.exporters.gltf_build import NORMAL, Glb, GltfMesh, add_mesh
from athcodec.exporters.gltf_joints import SLACK, hold
from athcodec.exporters.scene_objects import SceneObject, lost_copies, objects_of
from athcodec.motion.protocol import Motion
from athcodec.untyped import JsonObject

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
        """Return the nodes and poses of several movers as one; None if the list is empty."""
        if not movers:
            return None
        return cls(
            [node for each in movers for node in each.nodes],
            tuple(np.concatenate(parts) for parts in zip(*(each.rest for each in movers))),
            tuple(np.concatenate(parts, axis=1) for parts in zip(*(each.poses for each in movers))),
        )


@dataclass(eq=False)
class GltfCopies:
    """The mesh of one copy, `shape`, and its copies.

    `copy_attributes` holds the values that each copy has in place of each vertex, (k, width) by their semantic. `lost`
    lists the semantics that fit neither. `names` are those of the copies if they are separate objects.
    """

    shape: GltfMesh
    copies: Copies
    copy_attributes: dict[str, np.ndarray]
    lost: list[str]
    names: list[str] | None = None

    def add(self, glb: Glb, parent: int | None, transform: JsonObject) -> list[Movers]:
        """Add the shape as a mesh and a node for each copy, below a node with `transform`. Return the nodes that move,
        with their poses; an empty list if all copies stand still.
        """
        mesh = add_mesh(glb, self.shape, self.copies.shape)
        poses = self.copies.places, self.copies.turns, self.copies.scales
        is_still = all((pose == pose[:1]).all() for pose in poses)
        if is_still and self.names is None:
            self._add_instancing(glb, parent, mesh, transform)
            return []
        named = {"name": self.shape.name} if self.names is None else {}
        above = glb.node(parent, **named, extras={"copies": self.names is None}, **transform)
        nodes, at_rest = [], [pose[0] for pose in poses] if is_still else self.copies.rest
        for number, (place, turn, scale) in enumerate(zip(*at_rest)):
            at = dict(zip(PATHS, (place.tolist(), unit_quaternion(turn), scale.tolist())))
            extras = {key[1:]: _plain(values[number]) for key, values in self.copy_attributes.items()}
            name = f"{self.shape.name}_{number}" if self.names is None else self.names[number]
            nodes.append(glb.node(above, name=name, mesh=mesh, **at, **({"extras": extras} if extras else {})))
        return [] if is_still else [Movers(nodes, self.copies.rest, poses)]

    def _add_instancing(self, glb: Glb, parent: int | None, mesh: int, transform: JsonObject) -> None:
        """Add one node that shows the mesh once for each copy, by EXT_mesh_gpu_instancing, for copies that stand
        still.
        """
        poses = self.copies.places[0], self.copies.turns[0], self.copies.scales[0]
        parts = {path.upper(): glb.array(pose) for path, pose in zip(PATHS, poses)}
        parts |= {key: glb.array(values) for key, values in self.copy_attributes.items()}
        extension = {INSTANCING: {"attributes": parts}}
        glb.node(parent, name=self.shape.name, mesh=mesh, extensions=extension, **transform)
        for key in ("extensionsUsed", "extensionsRequired"):  # without it one of them would be shown
            names = glb.json.setdefault(key, [])
            names += [] if INSTANCING in names else [INSTANCING]


def with_copies(motion: Motion, meshes: list[GltfMesh]) -> tuple[list[GltfMesh | GltfCopies], dict[str, list[str]]]:
    """Return the meshes, with those that are copies of one shape stored as such, and the names of objects whose copies
    are written as one mesh instead, by the reason. Copies need transforms within the level's error, and one set of
    texture coordinates and colours. An attribute that copies lose is dropped from all meshes.
    """
    runs, allowed = list(_runs(objects_of(motion))), allowed_error(motion)
    if sum(len(run) for run in runs) != len(meshes):
        return list(meshes), {}
    together = [_together(run) for run in runs]
    fits = fit_copies(motion, together, allowed)
    shapes: list[GltfMesh | GltfCopies] = []
    waiting = iter(meshes)
    for number, (run, obj) in enumerate(zip(runs, together)):
        parts = [next(waiting) for _ in run]
        made = _as_copies(_joined(parts), obj, fits[number]) if number in fits else None
        if made is None:
            shapes += parts
            obj.copies = 1
            continue
        made.names = [shape.name for shape in parts] if len(run) > 1 else None
        _hold(motion, made.copies, allowed)
        shapes.append(made)
    lost = {key for shape in shapes if isinstance(shape, GltfCopies) for key in shape.lost}
    return [_without(shape, lost) for shape in shapes] if lost else shapes, lost_copies(together)


def _runs(objects: list[SceneObject]) -> Iterator[list[SceneObject]]:
    """Yield lists of consecutive objects that have equally many vertices in the same faces; any other object is a list
    of its own.
    """
    run: list[SceneObject] = []
    for obj in objects:
        if run and not _is_alike(run[0], obj):
            yield run
            run = []
        run.append(obj)
    if run:
        yield run


def _is_alike(one: SceneObject, other: SceneObject) -> bool:
    """Return whether two objects are single copies with the same faces, curves and details."""
    return (
        one.copies == other.copies == 1
        and (one.kind, one.count) == (other.kind, other.count)
        and one.details == other.details
        and all(map(np.array_equal, (*one.faces, one.curves), (*other.faces, other.curves)))
    )


def _together(run: list[SceneObject]) -> SceneObject:
    """Return one object in place of a run of objects that are alike: copies of the first object, as many as there are
    objects.
    """
    first, last = run[0], run[-1]
    if len(run) == 1:
        return first
    counts, indices = first.faces
    shift = np.repeat(np.arange(len(run)) * first.count, len(indices))
    return replace(
        first,
        count=first.count * len(run),
        faces=(np.tile(counts, len(run)), np.tile(indices, len(run)) + shift),
        curves=np.tile(first.curves, len(run)),
        face_rows=slice(first.face_rows.start, last.face_rows.stop),
        corner_rows=slice(first.corner_rows.start, last.corner_rows.stop),
        copies=len(run),
    )


def _joined(shapes: list[GltfMesh]) -> GltfMesh:
    """Return one mesh in place of several that are drawn alike."""
    if len(shapes) == 1:
        return shapes[0]
    starts = np.cumsum([0] + [len(shape.source) for shape in shapes])
    corners = [shape.corners + start for shape, start in zip(shapes, starts) if shape.corners is not None]
    return GltfMesh(
        shapes[0].name,
        np.concatenate([shape.source for shape in shapes]),
        np.concatenate(corners) if corners else None,
        np.concatenate([shape.materials for shape in shapes]),
        {key: np.concatenate([shape.attributes[key] for shape in shapes]) for key in shapes[0].attributes},
    )


def unit_quaternion(quaternion: np.ndarray) -> list[float]:
    """Return the vectors with length 1 in float64."""
    exact = quaternion.astype(np.float64)
    return (exact / np.linalg.norm(exact)).tolist()


def _without(shape: GltfMesh | GltfCopies, lost: set[str]) -> GltfMesh | GltfCopies:
    if isinstance(shape, GltfCopies):
        attributes = {key: values for key, values in shape.copy_attributes.items() if key not in lost}
        return GltfCopies(_mesh_without(shape.shape, lost), shape.copies, attributes, sorted(lost), shape.names)
    return _mesh_without(shape, lost)


def _mesh_without(shape: GltfMesh, lost: set[str]) -> GltfMesh:
    return replace(shape, attributes={key: values for key, values in shape.attributes.items() if key not in lost})


def _hold(motion: Motion, copies: Copies, allowed: float) -> None:
    """Set places, turns and scales of copies that hardly move to those at rest, so that they need no keys, and add the
    error of that."""
    extent = np.tile(np.abs(copies.shape).max(axis=0), (copies.places.shape[1], 1))
    for start, stop in motion.clip_range_frames:
        poses = [pose[start:stop] for pose in (copies.places, copies.turns, copies.scales)]
        hold(poses, copies.rest, extent, SLACK * allowed)
    copies.max_error += len(PATHS) * SLACK * allowed


def _as_copies(shape: GltfMesh, obj: SceneObject, copies: Copies) -> GltfCopies | None:
    """Return a mesh as copies of one shape. Return None if its copies differ in materials, texture coordinates or
    colours.
    """
    copy, local = np.divmod(shape.source - obj.first, obj.count // obj.copies)
    if (np.bincount(copy) * obj.copies != len(copy)).any():
        return None
    rows = np.argsort(copy, kind="stable").reshape(obj.copies, -1)
    if (local[rows] != local[rows[:1]]).any():
        return None
    shared, values_of_copies, lost = {}, {}, []
    for key, values in shape.attributes.items():
        each = values[rows]
        if key == NORMAL:
            shared[key] = (each[0] @ copies.axes).astype(np.float32)
        elif _same(each, each[:1]):
            shared[key] = each[0]
        elif not key.startswith("_"):
            return None
        elif _same(each, each[:, :1]):
            values_of_copies[key] = each[:, 0]
        else:
            lost.append(key)
    place = np.full(len(copy), -1)
    place[rows[0]] = np.arange(rows.shape[1])
    corners, materials = shape.corners, shape.materials
    if corners is not None:
        of_copy = np.argsort(copy[corners[:, 0]], kind="stable").reshape(obj.copies, -1)
        if (materials[of_copy] != materials[of_copy[:1]]).any():
            return None
        corners, materials = place[corners[of_copy[0]]], materials[of_copy[0]]
    one = replace(shape, source=local[rows[0]], corners=corners, attributes=shared, materials=materials)
    return GltfCopies(one, copies, values_of_copies, lost)


def _same(values: np.ndarray, expected: np.ndarray) -> bool:
    return bool(((values == expected) | ((values != values) & (expected != expected))).all())


def _plain(row: np.ndarray) -> Any:
    """Return a row of numbers as JSON holds it: a list, or the number if it is the only one."""
    return row[0].item() if len(row) == 1 else row.tolist()
