"""GLB files by the text of glTF, for tests: taken apart, put together, and posed with what pygltflib reads."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from plants import turns

COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def apart(data: bytes) -> tuple[dict, bytes]:
    """The JSON of a file, and the chunks behind it."""
    end = 20 + int.from_bytes(data[12:16], "little")
    return json.loads(data[20:end]), data[end:]


def together(text: bytes, behind: bytes = b"", spaces: int = 0) -> bytes:
    """A file of the text of its JSON, with more spaces than it takes, and the chunks behind it."""
    chunks = chunk(b"JSON", text + b" " * (-len(text) % 4 + spaces)) + behind
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack("<I4s", len(data), kind) + data


def glb(structure: dict, binary: bytes = b"", spaces: int = 0) -> bytes:
    behind = chunk(b"BIN\0", binary + bytes(-len(binary) % 4)) if binary else b""
    return together(json.dumps(structure).encode(), behind, spaces)


def accessor_of(gltf: Any, index: int) -> np.ndarray:
    """An accessor as pygltflib's structure says, (count, width)."""
    accessor = gltf.accessors[index]
    view = gltf.bufferViews[accessor.bufferView]
    dtype = np.dtype({number: name for name, number in COMPONENTS.items()}[accessor.componentType])
    width = {name: number for number, name in TYPES.items()}[accessor.type]
    start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    stride = view.byteStride or dtype.itemsize * width
    return np.ndarray((accessor.count, width), dtype, gltf.binary_blob(), start, (stride, dtype.itemsize)).copy()


def transform(translation: Any, rotation: Any, scale: Any) -> np.ndarray:
    axis = np.asarray(rotation[:3], float)
    sine = np.linalg.norm(axis)
    matrix = np.eye(4)
    matrix[:3, :3] = (turns(2 * np.arctan2(sine, rotation[3]) / sine * axis) if sine else np.eye(3)) * np.asarray(scale)
    matrix[:3, 3] = translation
    return matrix


def posed(gltf: Any, frame: int) -> np.ndarray:
    """World places of all vertices at a key of the first animation, by the text of glTF."""
    nodes = [
        {
            "translation": node.translation or [0, 0, 0],
            "rotation": node.rotation or [0, 0, 0, 1],
            "scale": node.scale or [1, 1, 1],
            "weights": None,
        }
        for node in gltf.nodes
    ]
    for channel in gltf.animations[0].channels if gltf.animations else ():
        sampler = gltf.animations[0].samplers[channel.sampler]
        count = gltf.accessors[sampler.input].count
        keys = accessor_of(gltf, sampler.output)
        keys = keys.reshape(count, -1)
        nodes[channel.target.node][channel.target.path] = keys[min(frame, count - 1)]
    world: dict[int, np.ndarray] = {}

    def place(index: int, above: np.ndarray) -> None:
        own = nodes[index]
        world[index] = above @ transform(own["translation"], own["rotation"], own["scale"])
        for child in gltf.nodes[index].children or ():
            place(child, world[index])

    for root in gltf.scenes[gltf.scene].nodes:
        place(root, np.eye(4))
    return np.concatenate(
        [_of_node(gltf, i, nodes[i]["weights"], world) for i in world if gltf.nodes[i].mesh is not None]
    )


def _of_node(gltf: Any, index: int, weights: Any, world: dict[int, np.ndarray]) -> np.ndarray:
    node, primitive = gltf.nodes[index], gltf.meshes[gltf.nodes[index].mesh].primitives[0]
    points = accessor_of(gltf, primitive.attributes.POSITION).astype(np.float64)
    for number, weight in enumerate(weights if weights is not None else ()):
        if weight:
            points = points + weight * accessor_of(gltf, _target(primitive.targets[number]))
    matrices = world[index][None]
    if node.skin is not None:
        skin = gltf.skins[node.skin]
        bind = accessor_of(gltf, skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
        bones = np.stack([world[joint] @ own for joint, own in zip(skin.joints, bind)])
        joints, shares = (accessor_of(gltf, getattr(primitive.attributes, name)) for name in ("JOINTS_0", "WEIGHTS_0"))
        shares = shares / (255 if shares.dtype == np.uint8 else 65535 if shares.dtype == np.uint16 else 1)
        matrices = np.einsum("nk,nkij->nij", shares, bones[joints])
    elif "EXT_mesh_gpu_instancing" in (node.extensions or {}):
        parts = {
            name: accessor_of(gltf, accessor)
            for name, accessor in node.extensions["EXT_mesh_gpu_instancing"]["attributes"].items()
        }
        own = [transform(*row) for row in zip(parts["TRANSLATION"], parts["ROTATION"], parts["SCALE"])]
        return np.concatenate([_moved(points, world[index] @ matrix) for matrix in own])
    return _moved(points, matrices)


def _target(target: Any) -> int:
    return target["POSITION"] if isinstance(target, dict) else target.POSITION


def _moved(points: np.ndarray, matrices: np.ndarray) -> np.ndarray:
    return (matrices[..., :3, :3] @ points[..., None])[..., 0] + matrices[..., :3, 3]
