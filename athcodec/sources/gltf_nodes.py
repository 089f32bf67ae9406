"""Reads the vertices of the nodes of a glTF scene: points, copies, morph targets and the influences of joints."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeGuard

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.gltf.document import DRACO, UNPACKED_BY, GltfFile
from athcodec.files.gltf.json import brief, entries, entry, extension, integer
from athcodec.motion.quaternions import rotation_matrices
from athcodec.sources.gltf_scene import Scene
from athcodec.sources.gltf_unread import INSTANCE_PARTS, INSTANCING
from athcodec.untyped import JsonObject, JsonValue

INSTANCE_BYTES = 256  # Bytes that an instance takes.
INFLUENCE_BYTES = 100  # Bytes that a joint of a vertex takes.
KINDS = ("points", "curves", "mesh")  # the last that a node has is what it is
MODE_KINDS = ("points", "curves", "curves", "curves", "mesh", "mesh", "mesh")


@dataclass(eq=False)
class GltfNode:
    """A node that shows vertices: `first` to `first + count` - 1 of the clip. Where its mesh has several sets of
    vertices, there is one of these for each."""

    index: int
    name: str
    mesh: int
    skin: int | None
    attributes: dict[str, int]
    targets: list[int | None]
    weights: np.ndarray
    first: int = 0
    count: int = 0
    kind: str = "points"
    primitives: list[JsonObject] = field(default_factory=list)
    base: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.float32))  # (n, 3) points of one copy
    joints: list[int] = field(default_factory=list)
    bind: np.ndarray = field(default_factory=lambda: np.zeros((0, 4, 4)))  # from the mesh to each joint
    influences: list[tuple[int, np.ndarray, np.ndarray]] = field(default_factory=list)
    strongest: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))  # (n,) the joint that counts most
    copies: np.ndarray | None = None  # (k, 4, 4) from each instance to the node
    of_copies: dict[str, np.ndarray] = field(default_factory=dict)  # (k, width) by attribute: what each copy has
    is_flipped: bool = False
    mirrored: np.ndarray = field(default_factory=lambda: np.zeros(1, bool))  # whether it, or a copy, is inside out

    @property
    def shape_count(self) -> int:
        """Vertices of one copy."""
        return self.count if self.copies is None else self.count // len(self.copies)

    @property
    def vertices(self) -> slice:
        return slice(self.first, self.first + self.count)


def nodes_of_mesh(scene: Scene, index: int, mesh: JsonObject, name: str) -> list[GltfNode]:
    """Return the node number `index` of the scene, which shows `mesh`, as one GltfNode for each set of vertices:
    primitives of the mesh that use the same accessors share one. `name` is the node's name for objects and messages."""
    copies, of_copies = _copies(scene, index)
    nodes: dict[Any, GltfNode] = {}
    for primitive in entries(mesh, "primitives"):
        attributes = {key: integer(entry(primitive, "attributes"), key) for key in entry(primitive, "attributes")}
        targets = [
            integer(target, "POSITION") if "POSITION" in target else None for target in entries(primitive, "targets")
        ]
        if "POSITION" not in attributes:
            raise ClipError(f"mesh {name!r}: got a primitive without POSITION, expected one with it")
        _refuse_draco(scene.file, primitive, attributes["POSITION"])
        key = (tuple(sorted(attributes.items())), tuple(targets))
        if key not in nodes:
            weights = scene.nodes[index].get("weights", mesh.get("weights")) or [0.0] * len(targets)
            if not isinstance(weights, list) or len(weights) != len(targets):
                raise ClipError(f"mesh {name!r}: got weights {brief(weights)}, expected {len(targets)}")
            nodes[key] = GltfNode(
                index,
                name,
                scene.nodes[index]["mesh"],
                scene.nodes[index].get("skin"),
                attributes,
                targets,
                np.array(weights, np.float64),
                count=scene.file.count(attributes["POSITION"]) * (1 if copies is None else len(copies)),
                copies=copies,
                of_copies=of_copies,
            )
        node = nodes[key]
        kind = MODE_KINDS[integer(primitive, "mode", 4, stop=7)]
        node.kind = max(node.kind, kind, key=KINDS.index)
        node.primitives.append(primitive)
    in_order = list(nodes.values())
    for number, node in enumerate(in_order[1:], 1):
        node.name = f"{name}.{number}"
    return in_order


def _copies(scene: Scene, index: int) -> tuple[np.ndarray | None, dict[str, np.ndarray]]:
    """Return (matrices, attributes) of the instances that EXT_mesh_gpu_instancing gives node `index`: matrices (k, 4,
    4) from each instance to the node, and arrays with a row for each instance, by attribute name. Without the
    extension, matrices is None and the attributes are the node's own extras."""
    instancing = extension(scene.nodes[index], INSTANCING)
    if instancing is None:
        return None, _own_extras(scene, index)
    if scene.nodes[index].get("skin") is not None:
        raise ClipError(f"node {index}: got {INSTANCING} of a mesh with a skin, expected one without")
    accessors = entry(instancing, "attributes")
    for name in accessors:
        scene.file.budget.take(INSTANCE_BYTES * scene.file.count(integer(accessors, name)), f"node {index}")
    parts = {
        name: scene.file.floats(integer(accessors, name)).astype(np.float64)
        for name in INSTANCE_PARTS
        if name in accessors
    }
    counts = {len(values) for values in parts.values()}
    widths = all(values.shape[1] == INSTANCE_PARTS[name] for name, values in parts.items())
    if len(counts) != 1 or not widths:
        raise ClipError(
            f"node {index}: got {INSTANCING} of {sorted(counts)} instances, expected TRANSLATION, ROTATION "
            "or SCALE of as many"
        )
    matrices = np.tile(np.eye(4), (counts.pop(), 1, 1))
    if "ROTATION" in parts:
        matrices[:, :3, :3] = rotation_matrices(parts["ROTATION"])
    if "SCALE" in parts:
        matrices[:, :3, :3] *= parts["SCALE"][:, None, :]
    if "TRANSLATION" in parts:
        matrices[:, :3, 3] = parts["TRANSLATION"]
    of_copies = {name: scene.file.attribute(integer(accessors, name)) for name in accessors if name.startswith("_")}
    for name, values in of_copies.items():
        if len(values) != len(matrices):
            raise ClipError(
                f"node {index}: got {len(values)} entries of {name}, expected {len(matrices)}, one an instance"
            )
    return matrices, of_copies


def _own_extras(scene: Scene, index: int) -> dict[str, np.ndarray]:
    """Return the numbers in the extras of node `index`, as rows (1, width) by attribute name. Only nodes below a node
    that is marked as one of copies have such attributes; for others the result is empty."""
    extras = scene.nodes[index].get("extras")
    if scene.says_copies(int(scene.parent[index])) is None or not isinstance(extras, dict):
        return {}
    attributes = {}
    for key, value in extras.items():
        row = value if isinstance(value, list) else [value]
        if 1 <= len(row) <= 4 and all(is_number(number) for number in row):
            attributes[f"_{key}"] = np.array([row], np.int64 if all(type(n) is int for n in row) else np.float32)
    return attributes


def _refuse_draco(file: GltfFile, primitive: JsonObject, positions: int) -> None:
    packed = DRACO in (primitive.get("extensions") or {})
    if packed and file.item("accessors", positions).get("bufferView") is None:
        raise ClipError(f"meshes: got {DRACO}, expected a file without it: {UNPACKED_BY}")


def load_node(node: GltfNode, scene: Scene) -> None:
    """Read the points and joints of a node into it, and check the size of its morph targets. Raises ClipError if they
    do not fit each other."""
    file = scene.file
    slots = sum(key.startswith("JOINTS_") for key in node.attributes) if node.skin is not None else 0
    file.budget.take(INFLUENCE_BYTES * 4 * slots * node.count, f"mesh {node.name!r}")
    node.base = triples(file, node.attributes["POSITION"], node.shape_count, "POSITION")
    for target in node.targets:
        if target is not None and file.count(target) != node.shape_count:
            raise ClipError(
                f"mesh {node.name!r}: got a morph target of {file.count(target)} vertices, expected {node.shape_count}"
            )
    if node.skin is None:
        return
    skin = file.item("skins", node.skin)
    node.joints = [integer({"joint": joint}, "joint") for joint in skin.get("joints") or ()]
    node.bind = _bind_matrices(file, skin, len(node.joints))
    if "JOINTS_0" not in node.attributes or not node.joints:
        raise ClipError(f"mesh {node.name!r}: got a skin without joints, expected JOINTS_0 and WEIGHTS_0")
    _load_influences(node, file)


def triples(file: GltfFile, index: int, count: int, subject: str) -> np.ndarray:
    values = file.floats(index)
    if values.shape != (count, 3):
        raise ClipError(f"{subject}: got shape {values.shape}, expected ({count}, 3)")
    return values


def _bind_matrices(file: GltfFile, skin: JsonObject, joint_count: int) -> np.ndarray:
    """Return the inverse bind matrices (joint_count, 4, 4) of a skin, which take vertices from the mesh to each joint's
    space in the bind pose; the identity if the file has none."""
    if skin.get("inverseBindMatrices") is None:
        return np.broadcast_to(np.eye(4), (joint_count, 4, 4))
    file.budget.take(256 * file.count(skin["inverseBindMatrices"]), "skins")
    values = file.floats(skin["inverseBindMatrices"]).astype(np.float64)
    if values.shape[1] != 16 or len(values) < joint_count:
        raise ClipError(f"skins: got inverse bind matrices of shape {values.shape}, expected ({joint_count}, 16)")
    return values[:joint_count].reshape(-1, 4, 4).swapaxes(1, 2)


def _load_influences(node: GltfNode, file: GltfFile) -> None:
    """Store in the node, for each joint, the vertices that it moves and their weights, which add up to 1 for each
    vertex. A vertex whose weights are all 0 hangs on its first joint. Also store the strongest joint of each vertex."""
    influences: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # Each slot has vertices, joints and weights.
    for slot in range(64):
        names = f"JOINTS_{slot}", f"WEIGHTS_{slot}"
        if names[0] not in node.attributes or names[1] not in node.attributes:
            break
        joints, weights = file.array(node.attributes[names[0]]), file.floats(node.attributes[names[1]])
        if joints.shape != (node.count, 4) or joints.shape != weights.shape or joints.dtype.kind not in "iu":
            raise ClipError(f"mesh {node.name!r}: got {names[0]} of shape {joints.shape}, expected ({node.count}, 4)")
        rows, columns = np.nonzero(weights)
        influences.append((rows, joints[rows, columns].astype(np.int64), weights[rows, columns].astype(np.float64)))
        if slot == 0:
            first = joints[:, 0].astype(np.int64)
    if not influences:
        raise ClipError(f"mesh {node.name!r}: got JOINTS_0 without WEIGHTS_0, expected both")
    vertex, joint, weight = map(np.concatenate, zip(*influences))
    total = np.bincount(vertex, weight, node.count)
    bare = np.flatnonzero(~(np.abs(total) > 1e-12))
    vertex, joint = np.append(vertex, bare), np.append(joint, first[bare])
    weight = np.append(weight, np.ones(len(bare)))
    total[bare] = 1.0
    if not np.isfinite(weight).all() or joint.min() < 0 or joint.max() >= len(node.joints):
        raise ClipError(
            f"mesh {node.name!r}: got joints up to {joint.max()} or weights that are no numbers, expected "
            f"joints below {len(node.joints)}"
        )
    pair, index = np.unique(joint * node.count + vertex, return_inverse=True)
    weight = np.bincount(index, weight / total[vertex], len(pair))
    joint, vertex = np.divmod(pair, node.count)
    starts = np.flatnonzero(np.diff(joint, prepend=-1))
    stops = np.append(starts[1:], len(pair))
    node.influences = [(int(joint[a]), vertex[a:b], weight[a:b]) for a, b in zip(starts, stops)]
    order = np.lexsort((weight, vertex))
    node.strongest = np.empty(node.count, np.int64)
    node.strongest[vertex[order]] = joint[order]


def is_number(value: JsonValue) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e15


def moving_nodes(nodes: list[GltfNode]) -> set[int]:
    """Return numbers of the joints that move vertices, and of the nodes without a skin."""
    return {joint for node in nodes for joint in node.joints} | {node.index for node in nodes if node.skin is None}
