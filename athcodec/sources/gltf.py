"""Reads glTF 2.0, .glb or .gltf with its buffers, as positions in world space: skins, animated nodes, morph targets.

Vertices are those of the meshes in the order of the nodes in the scene; a mesh that two nodes show is there twice, one
with EXT_mesh_gpu_instancing as an object of so many copies. So are the nodes below one that athcodec's writer marks.
Frames are evaluated a block at a time; keys of animations and base meshes are held in memory, morph targets are read
when a frame needs them. Frames lie at `fps`; by default at the rate that the keys were sampled at, else 30 per second.
Animations that move different nodes run together, of several for the same nodes the first; `only` takes patterns of the
names of nodes and meshes, and "animation:NAME" for another animation; `takes` makes a clip of its own of each. One
whose extras say {"loop": true} is a loop, and loses its last frame where that is the first again. The attribute
"face_material" numbers the materials, whose names are the metadata "material_names". Draco is refused. What else
the file holds is named in the clip's `not_read` (gltf_unread.py).
"""

from __future__ import annotations

import fnmatch
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.gltf.document import DRACO, UNPACKED_BY, GltfFile
from athcodec.files.gltf.json import BROKEN, brief, entries, entry, extension, indices, integer
from athcodec.files.gltf.motion import EXTENSION, extension_of
from athcodec.files.gltf.primitives import corners, rows_of
from athcodec.files.plain import FilePath
from athcodec.files.reading import closing_on_failure, naming
from athcodec.motion.clip import DEFAULT_FPS, RESERVED_NAMES, ClipRange, MotionClip, Skin
from athcodec.motion.frames import Frames, is_far
from athcodec.motion.joining import join
from athcodec.motion.quaternions import rotation_matrices
from athcodec.sources import ReadOptions, besides
from athcodec.sources.gltf_scene import Scene, key_rate, off_grid
from athcodec.sources.gltf_unread import INSTANCE_PARTS, INSTANCING, guessed, not_read
from athcodec.sources.scene_objects import FACE_MATERIAL, MATERIAL_NAMES, Facing, presence_metadata
from athcodec.sources.timing import warn_of_missed

WORK_BYTES = 64 << 20
MOST_VERTICES = 1 << 27
INSTANCE_BYTES = 256  # Bytes that an instance takes.
CORNER_BYTES = 96  # Bytes that a corner of a face takes; strips make three of each.
INFLUENCE_BYTES = 100  # Bytes that a joint of a vertex takes.
VERTEX_BYTES = 160  # Bytes that a vertex takes in the poses that are held and made.
MOST_FRAMES = 1 << 20
FACING_FRAMES = 64  # Frames whose transforms are held at once to see whether they mirror.
KINDS = ("points", "curves", "mesh")  # the last that a node has is what it is
MODE_KINDS = ("points", "curves", "curves", "curves", "mesh", "mesh", "mesh")
NAMES = {"TEXCOORD_0": "uv", "COLOR_0": "colors", "NORMAL": "normals"}
FILLERS = {"colors": 1.0}
ANIMATION = "animation:"
REST_ROUNDING = 1e-6  # Distance by which joints may miss the unmoved mesh, over its largest coordinate.
SAME = 1e-5  # Distance between the ends of a loop, over the plant's size.


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the glTF file `path`; close it, or use it in a `with` statement.

    The rest pose, where options.rest is "auto", is the scene without animation. metadata has "animations", the names of
    those that are played, and "other_animations", those that are not; with options.takes the names are those of the
    clip's ranges. Raises ClipError where the file is no glTF that can be read here, MissingExtra where its compression
    needs a package, OSError where a file cannot be opened.
    """
    with naming(path):
        file = GltfFile(path, options.max_memory)
        if extension_of(file.json) is not None:
            file.close()
            raise ClipError(f"{EXTENSION}: got a motion of its own, expected one of glTF: decode the file first")
    with naming(path, *BROKEN), closing_on_failure(file), np.errstate(all="ignore"):
        return _read(file, options)


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
    primitives: list[dict] = field(default_factory=list)
    base: np.ndarray | None = None
    joints: list[int] = field(default_factory=list)
    bind: np.ndarray | None = None
    influences: list[tuple[int, np.ndarray, np.ndarray]] = field(default_factory=list)
    strongest: np.ndarray | None = None
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


def _read(file: GltfFile, options: ReadOptions) -> MotionClip:
    scenes = _scenes(file, options)
    scene = next(iter(scenes.values()))
    nodes = _chosen(scene, _patterns(options))
    for node in nodes:
        _load(node, scene)
    return _clip(file, scenes, nodes, options, None)


def read_moving(file: GltfFile, options: ReadOptions) -> tuple[MotionClip, list[GltfNode], Placement]:
    """The clip of what moves alone, its nodes, and how they lie in the space of the clip.

    Where nodes or skins leave meshes together as they are stored but for one matrix, the space is that of the meshes:
    the rest pose has their very numbers. Closes nothing. Raises ClipError.
    """
    if not options.takes and _other_animations(Scene(file)):
        options = replace(options, takes="all")
    with np.errstate(all="ignore"):
        scenes = _scenes(file, options)
        scene = next(iter(scenes.values()))
        moving = [
            node
            for node in _chosen(scene, _patterns(options))
            if any(_moves(take, node) for take in scenes.values()) and not _has_motion(node)
        ]
        if not moving:
            raise ClipError("animations: got none that moves vertices, expected skins, nodes or morph targets that do")
        _number(moving)
        for node in moving:
            _load(node, scene)
            if node.copies is not None:
                raise ClipError(
                    f"node {node.name!r}: got {INSTANCING} on a mesh that moves, expected one without: each instance "
                    "would need vertices of its own"
                )
        placement = Placement(list(scenes.values()), moving)
        return _clip(file, scenes, moving, options, placement.from_world), moving, placement


class Placement:
    """The space of a clip that is the motion of some nodes of a scene: `space` (4, 4) leads from it to the world.
    `starts` are the seconds at which its takes begin."""

    def __init__(self, scenes: list[Scene], nodes: list[GltfNode]):
        self._scenes = scenes
        self.starts = [float(scene.keys[0]) for scene in scenes]
        self.space = _Motion(scenes[0], nodes).placed(max(nodes, key=self._preference))
        if not abs(np.linalg.det(self.space[:3, :3])) > 0:
            self.space = np.eye(4)
        self.from_world = None if np.array_equal(self.space, np.eye(4)) else np.linalg.inv(self.space)
        self._motion = _Motion(scenes[0], nodes, self.from_world)

    def _preference(self, node: GltfNode) -> tuple[bool, int]:
        """The largest mesh keeps its place, of those that can."""
        hangs = node.skin is None and any(scene.animates({node.index}) for scene in self._scenes)
        return not hangs, node.count

    def stays(self, index: int) -> bool:
        """Whether what a node shows lies in this space, at all times."""
        scene = self._scenes[0]
        matrix = scene.matrices(scene.ancestors({index}), None)[index][0]
        off = np.abs(matrix - self.space).max()
        return off <= REST_ROUNDING * np.abs(self.space).max() and not any(
            each.animates({index}) for each in self._scenes
        )

    def is_always_shown(self, index: int) -> bool:
        """Whether a node is visible at all keys of all takes."""
        return all(scene.shown(index, scene.keys).all() for scene in self._scenes)

    def turned(self, node: GltfNode, directions: np.ndarray, is_normal: bool) -> np.ndarray:
        """(n, 3) unit directions at a node's vertices, in this space without animation."""
        return self._motion.turned(node, directions, is_normal)


def _moves(scene: Scene, node: GltfNode) -> bool:
    """Whether an animation that is played moves its vertices."""
    joints = [node.index] if node.skin is None else indices(scene.file.item("skins", node.skin), "joints")
    return scene.morphs(node.index) or scene.animates(set(joints))


def _has_motion(node: GltfNode) -> bool:
    """Whether a motion of ATH_motion moves it already."""
    return any(extension_of(primitive) is not None for primitive in node.primitives)


def _patterns(options: ReadOptions) -> list[str]:
    """Return the patterns in `options.only` that choose nodes and meshes, without those that choose animations."""
    return [name for name in options.only if not name.startswith(ANIMATION)]


def _clip(
    file: GltfFile, scenes: dict[str, Scene], nodes: list[GltfNode], options: ReadOptions, from_world: np.ndarray | None
) -> MotionClip:
    scene = next(iter(scenes.values()))
    motions = {name: _Motion(take, nodes, from_world) for name, take in scenes.items()}
    motion = next(iter(motions.values()))
    timings = {name: _sampling(take, options.fps) for name, take in motions.items()}
    keeps_normals = all(len(timing.times) == 1 for timing in timings.values()) and not any(
        node.skin is not None or node.weights.any() or node.copies is not None for node in nodes
    )
    are_guessed = NAMES["NORMAL"] in guessed(file.json["asset"])
    attributes, branches = _attributes(scene, nodes, options.skip, motion, keeps_normals and not are_guessed)
    facings = [Facing() for _ in nodes]
    for name, take in motions.items():
        take.add_facings(timings[name].times, facings)
    for node, facing in zip(nodes, facings):
        node.mirrored, node.is_flipped = facing.mirrored, facing.changes
    faces, edges, face_material = _connections(file, nodes)
    names = _names(scene, nodes)
    stated: dict[str, Any] = {}
    if face_material is not None and FACE_MATERIAL not in options.skip:
        attributes[FACE_MATERIAL] = face_material
        stated = {MATERIAL_NAMES: _material_names(file), "domains": {FACE_MATERIAL: "face"}}
    rest = _rest_pose(motion, nodes) if options.rest == "auto" else None
    unread = not_read(list(scenes.values()), nodes, keeps_normals or are_guessed) | (
        {} if _chooses(options) else _other_animations(scene)
    )
    clips = {}
    for name, timing in timings.items():
        clips[name] = MotionClip(
            positions=_positions(motions[name], timing.times),
            time=np.arange(len(timing.times)) / timing.fps,
            rest=rest if rest is not None and np.isfinite(rest).all() else None,
            rest_pose="mean" if options.rest == "mean" else "first",
            edges=edges,
            faces=faces,
            attributes=attributes,
            resource=file,
            skin=_skin(scene, nodes),
            clip_ranges=(ClipRange("", len(timing.times), True),) if timing.is_loop else (),
            metadata={"unit": "m", "up_axis": "y"}
            | timing.clock
            | names
            | presence_metadata(names["part_names"], _shown(scenes[name], nodes, timing.times))
            | stated
            | ({} if options.takes else _played(scene, nodes)),
            unchanged=file.unchanged,
            not_read=unread,
            **branches,
        )
        clips[name].rest_given = options.rest == "auto"
        rest = clips[name].source_rest  # All clips have the same rest pose.
    return join(clips) if options.takes else clips[""]


def _rest_pose(motion: _Motion, nodes: Sequence[GltfNode]) -> np.ndarray:
    """(N, 3) the scene without animation. Where joints leave a mesh as it is stored, these are its very numbers, which
    others who read the file have too: products of matrices round."""
    rest = motion.read(None)[0]
    for node in nodes:
        if node.copies is not None:
            continue
        placed = rest[node.vertices]
        with np.errstate(all="ignore"):
            off, size = np.abs(placed - node.base).max(initial=0.0), np.abs(node.base).max(initial=0.0)
        if off <= REST_ROUNDING * size:
            placed[:] = node.base
    return rest


def _positions(motion: _Motion, times: np.ndarray) -> Frames:
    return Frames(lambda start, stop: motion.read(times[start:stop]), len(times), motion.count, motion.dtype, True)


# ---- scenes and nodes ----


def _scenes(file: GltfFile, options: ReadOptions) -> dict[str, Scene]:
    """The scene as it moves in each take, by its name; by "" as what `only` asks for, or as players begin."""
    patterns = [name[len(ANIMATION) :] for name in options.only if name.startswith(ANIMATION)]
    if not _chooses(options):
        return {"": Scene(file)}
    still = Scene(file, [])
    if not options.takes:
        return {"": Scene(file, list(_animations(still, patterns, f"only: got {ANIMATION}").values()))}
    if patterns:
        raise ClipError(f"takes: got only {ANIMATION}{patterns[0]} too, expected one of both")
    takes = [options.takes] if isinstance(options.takes, str) else list(options.takes)
    chosen = _animations(still, ["*"] if takes == ["all"] else takes, "takes: got ")
    return {name: Scene(file, [index]) for name, index in chosen.items()}


def _chooses(options: ReadOptions) -> bool:
    """Whether the options name animations."""
    return bool(options.takes) or any(name.startswith(ANIMATION) for name in options.only)


def _chosen(scene: Scene, patterns: Sequence[str]) -> list[GltfNode]:
    """Return the nodes that show a mesh, if they or it have such a name, in the order of the scene."""
    file = scene.file
    nodes, seen = [], []
    for index in scene.order:
        mesh_index = scene.nodes[index].get("mesh")
        if mesh_index is not None and not scene.is_hidden(index):
            mesh = file.item("meshes", mesh_index)
            called = [scene.name(index), mesh["name"] if isinstance(mesh.get("name"), str) else ""]
            seen.extend(called)
            if not patterns or any(fnmatch.fnmatchcase(name, pattern) for name in called for pattern in patterns):
                nodes.extend(_nodes(scene, index, mesh, next(filter(None, called), f"mesh {mesh_index}")))
    if not nodes:
        names = brief(sorted({name for name in seen if name}))
        raise ClipError(
            f"only: got {', '.join(patterns)}, expected names such as {names}"
            if patterns and seen
            else f"meshes: got none in the scene, expected at least one{besides(not_read([scene], []))}"
        )
    file.budget.take(VERTEX_BYTES * _number(nodes), "meshes")
    return nodes


def _number(nodes: Sequence[GltfNode]) -> int:
    """Gives each node its vertices, and says how many there are."""
    first = 0
    for node in nodes:
        node.first = first
        first += node.count
    if first > MOST_VERTICES:
        raise ClipError(f"meshes: got {first} vertices, expected at most {MOST_VERTICES}")
    return first


def _animations(scene: Scene, patterns: Sequence[str], subject: str) -> dict[str, int]:
    """Return the animations that any of the patterns names and that move something, in the file's order."""
    every, wanted = _animation_numbers(scene.file), set()
    numbers = {name: index for name, index in every.items() if scene.targets(index)}
    for pattern in patterns:
        matching = {name for name in numbers if name == pattern or fnmatch.fnmatchcase(name, pattern)}
        if not matching:
            unmoving = ", which moves no node of the scene" if pattern in every else ""
            raise ClipError(f"{subject}{pattern}{unmoving}, expected one of {brief(list(numbers))}")
        wanted |= matching
    return {name: index for name, index in numbers.items() if name in wanted}


def _animation_numbers(file: GltfFile) -> dict[str, int]:
    """All by name; where two have the same, the later one's number is added to it."""
    numbers: dict[str, int] = {}
    for index, animation in enumerate(file.items("animations")):
        name = animation.get("name")
        name = name if isinstance(name, str) and name else f"animation {index}"
        while name in numbers:
            name = f"{name}.{index}"
        numbers[name] = index
    return numbers


def _nodes(scene: Scene, index: int, mesh: dict, name: str) -> list[GltfNode]:
    """One per set of vertices: primitives that use the same accessors share theirs."""
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
    """(k, 4, 4) from each instance of EXT_mesh_gpu_instancing to its node, None without; and what each copy of a shape
    has, (k, width) by attribute."""
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
    """Numbers in the extras of a node below one that has COPIES, (1, width) by attribute."""
    extras = scene.nodes[index].get("extras")
    if scene.says_copies(int(scene.parent[index])) is None or not isinstance(extras, dict):
        return {}
    attributes = {}
    for key, value in extras.items():
        row = value if isinstance(value, list) else [value]
        if 1 <= len(row) <= 4 and all(_is_number(number) for number in row):
            attributes[f"_{key}"] = np.array([row], np.int64 if all(type(n) is int for n in row) else np.float32)
    return attributes


def _refuse_draco(file: GltfFile, primitive: dict, positions: int) -> None:
    packed = DRACO in (primitive.get("extensions") or {})
    if packed and file.item("accessors", positions).get("bufferView") is None:
        raise ClipError(f"meshes: got {DRACO}, expected a file without it: {UNPACKED_BY}")


def _load(node: GltfNode, scene: Scene) -> None:
    file = scene.file
    slots = sum(key.startswith("JOINTS_") for key in node.attributes) if node.skin is not None else 0
    file.budget.take(INFLUENCE_BYTES * 4 * slots * node.count, f"mesh {node.name!r}")
    node.base = _triples(file, node.attributes["POSITION"], node.shape_count, "POSITION")
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


def _triples(file: GltfFile, index: int, count: int, subject: str) -> np.ndarray:
    values = file.floats(index)
    if values.shape != (count, 3):
        raise ClipError(f"{subject}: got shape {values.shape}, expected ({count}, 3)")
    return values


def _bind_matrices(file: GltfFile, skin: dict, joint_count: int) -> np.ndarray:
    if skin.get("inverseBindMatrices") is None:
        return np.broadcast_to(np.eye(4), (joint_count, 4, 4))
    file.budget.take(256 * file.count(skin["inverseBindMatrices"]), "skins")
    values = file.floats(skin["inverseBindMatrices"]).astype(np.float64)
    if values.shape[1] != 16 or len(values) < joint_count:
        raise ClipError(f"skins: got inverse bind matrices of shape {values.shape}, expected ({joint_count}, 16)")
    return values[:joint_count].reshape(-1, 4, 4).swapaxes(1, 2)


def _load_influences(node: GltfNode, file: GltfFile) -> None:
    """Per joint its vertices and their weights, which add up to 1; where a file has none, the first joint counts."""
    vertex, joint, weight = [], [], []
    for slot in range(64):
        names = f"JOINTS_{slot}", f"WEIGHTS_{slot}"
        if names[0] not in node.attributes or names[1] not in node.attributes:
            break
        joints, weights = file.array(node.attributes[names[0]]), file.floats(node.attributes[names[1]])
        if joints.shape != (node.count, 4) or joints.shape != weights.shape or joints.dtype.kind not in "iu":
            raise ClipError(f"mesh {node.name!r}: got {names[0]} of shape {joints.shape}, expected ({node.count}, 4)")
        rows, columns = np.nonzero(weights)
        vertex.append(rows)
        joint.append(joints[rows, columns].astype(np.int64))
        weight.append(weights[rows, columns].astype(np.float64))
        if slot == 0:
            first = joints[:, 0].astype(np.int64)
    if not vertex:
        raise ClipError(f"mesh {node.name!r}: got JOINTS_0 without WEIGHTS_0, expected both")
    total = np.bincount(np.concatenate(vertex), np.concatenate(weight), node.count)
    bare = np.flatnonzero(~(np.abs(total) > 1e-12))
    vertex, joint = np.concatenate([*vertex, bare]), np.concatenate([*joint, first[bare]])
    weight = np.concatenate([*weight, np.ones(len(bare))])
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


# ---- how it moves ----


class _Motion:
    """Positions of all nodes at any times."""

    def __init__(self, scene: Scene, nodes: list[GltfNode], from_world: np.ndarray | None = None):
        self.scene, self._nodes, self._from_world = scene, nodes, from_world
        self.count = nodes[-1].first + nodes[-1].count
        self.ancestors = scene.ancestors(_movers(nodes))
        self.dtype = np.dtype(np.float64)
        placed = self.read(None)[0]
        loses = is_far(placed) and not np.array_equal(placed, placed.astype(np.float32))
        self.dtype = np.dtype(np.float64 if loses else np.float32)

    def read(self, times: np.ndarray | None) -> np.ndarray:
        """(k, N, 3) in `dtype`: float32, or float64 if nodes place them far from the origin. None: the pose without
        animation, k = 1."""
        out = np.empty((1 if times is None else len(times), self.count, 3), self.dtype)
        largest = max(node.count for node in self._nodes)
        step = max(1, WORK_BYTES // (48 * largest + 512 * len(self.ancestors)))
        with np.errstate(all="ignore"):
            for start in range(0, len(out), step):
                now = None if times is None else times[start : start + step]
                matrices = self.scene.matrices(self.ancestors, now)
                if self._from_world is not None:
                    matrices = {index: self._from_world @ matrix for index, matrix in matrices.items()}
                for node in self._nodes:
                    rows = node.vertices
                    out[start : start + step, rows] = self._positions(node, matrices, now)
        return out

    def _positions(self, node: GltfNode, matrices: dict[int, np.ndarray], times: np.ndarray | None) -> np.ndarray:
        local = self._morphed(node, times)
        if node.skin is None:
            matrix = matrices[node.index]
            if node.copies is not None:
                matrix = (matrix[:, None] @ node.copies).reshape(-1, 4, 4)
                local = np.repeat(
                    np.broadcast_to(local, (len(matrices[node.index]), *local.shape[1:])), len(node.copies), axis=0
                )
                placed = local @ matrix[:, :3, :3].swapaxes(1, 2) + matrix[:, None, :3, 3]
                return placed.reshape(-1, node.count, 3)
            return local @ matrix[:, :3, :3].swapaxes(1, 2) + matrix[:, None, :3, 3]
        return self._skinned(node, matrices, local)

    def _morphed(self, node: GltfNode, times: np.ndarray | None) -> np.ndarray:
        """(k or 1, n, 3): only targets that count in a frame are read."""
        if not node.targets:
            return node.base[None].astype(np.float64)
        weights = self.scene.weights(node.index, times, node.weights)
        local = np.repeat(node.base[None].astype(np.float64), len(weights), axis=0)
        for column in np.flatnonzero((weights != 0).any(axis=0)):
            if node.targets[column] is not None:
                rows = np.flatnonzero(weights[:, column])
                moved = _triples(self.scene.file, node.targets[column], node.shape_count, "morph target")
                local[rows] += weights[rows, column, None, None] * moved
        return local

    def _skinned(self, node: GltfNode, matrices: dict[int, np.ndarray], local: np.ndarray) -> np.ndarray:
        frames = max(len(local), *(len(matrices[joint]) for joint in node.joints))
        out = np.zeros((frames, 3, node.count))
        for joint, vertices, weights in node.influences:
            matrix = (matrices[node.joints[joint]] @ node.bind[joint])[:, :3]
            points = np.ones((len(local), 4, len(vertices)))
            points[:, :3] = local[:, vertices].swapaxes(1, 2)
            points *= weights
            out[:, :, vertices] += _product(matrix, points)
        return out.swapaxes(1, 2)

    def add_facings(self, times: np.ndarray, facings: Sequence[Facing]) -> None:
        """Adds the frames at these times to the facing of each node."""
        world = np.eye(4) if self._from_world is None else self._from_world
        for start in range(0, len(times), FACING_FRAMES):
            matrices = self.scene.matrices(self.ancestors, times[start : start + FACING_FRAMES])
            for node, facing in zip(self._nodes, facings):
                placed = (world @ self._placed(node, matrices))[:, None]
                facing.add(placed if node.copies is None else placed @ node.copies)

    def placed(self, node: GltfNode) -> np.ndarray:
        """(4, 4) from a node's mesh to the world without animation; of a skin, by the joint that counts most."""
        return self._placed(node, self.scene.matrices(self.ancestors, None))[0]

    def _placed(self, node: GltfNode, matrices: dict[int, np.ndarray]) -> np.ndarray:
        if node.skin is None:
            return matrices[node.index]
        strongest = np.bincount(node.strongest).argmax()
        return matrices[node.joints[strongest]] @ node.bind[strongest]

    def turned(self, node: GltfNode, directions: np.ndarray, is_normal: bool) -> np.ndarray:
        """(n, 3) directions at a node's vertices, as its joints or it turn them without animation; of length 1."""
        matrices = self.scene.matrices(self.ancestors, None)
        linear = np.eye(3) if self._from_world is None else self._from_world[:3, :3]

        def moved(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
            matrix = linear @ matrix[:3, :3]
            return vectors @ (np.linalg.pinv(matrix) if is_normal else matrix.T)

        if node.skin is None:
            turned = moved(matrices[node.index][0], directions)
        else:
            turned = np.zeros((node.count, 3))
            for joint, vertices, weights in node.influences:
                matrix = matrices[node.joints[joint]][0] @ node.bind[joint]
                turned[vertices] += weights[:, None] * moved(matrix, directions[vertices])
        length = np.linalg.norm(turned, axis=1, keepdims=True)
        return turned / np.where(length > 0, length, 1.0)

    def normal_matrix(self, node: GltfNode) -> np.ndarray:
        """(3, 3) that turns normals of an unskinned node into the world."""
        matrix = self.scene.matrices(self.ancestors, None)[node.index][0, :3, :3]
        return np.linalg.pinv(matrix).T if np.isfinite(matrix).all() else np.eye(3)


def _product(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(k, 3, 4) by (k or 1, 4, m); one multiplication where all frames have the same points."""
    if len(points) > 1:
        return matrices @ points
    return (matrices.reshape(-1, 4) @ points[0]).reshape(len(matrices), 3, -1)


@dataclass(frozen=True, eq=False)
class Sampling:
    """Frames per second, the times (T,) to evaluate, and metadata of both; whether the first follows the last."""

    fps: float
    times: np.ndarray
    clock: dict[str, Any]
    is_loop: bool = False


def _sampling(motion: _Motion, wanted: float | None) -> Sampling:
    scene, keys = motion.scene, motion.scene.keys
    if not len(keys):
        return Sampling(DEFAULT_FPS, np.zeros(1), {})
    extras = _stated_extras(scene)
    fps = wanted or _stated_rate(extras, keys) or key_rate(keys)
    if fps is None:
        fps = DEFAULT_FPS
        warn_of_missed(keys, off_grid(keys, fps), fps, scene.file.path)
    count = float(keys[-1] - keys[0]) * fps
    if not count < MOST_FRAMES:
        raise ClipError(f"animations: got {count:.0f} frames, expected at most {MOST_FRAMES}; sample at a lower rate")
    scene.file.budget.take(32 * int(count), "animations")
    is_loop = extras.get("loop") is True
    frames = int(count + 0.02) + 1
    if is_loop and frames > 1 and _returns(motion, keys):
        frames = round(count)
        if abs(count - frames) > 0.02:  # the time of all frames is that of the loop
            fps *= frames / count
    times = keys[0] + np.arange(frames) / fps
    first = float(keys[0] * fps) + (extras["start_frame"] if _is_number(extras.get("start_frame")) else 0)
    whole = round(first)
    clock = {"fps": float(fps), "start_frame": whole if abs(first - whole) < 1e-3 else first}
    return Sampling(float(fps), _on_keys(times, keys, fps), clock, is_loop)


def _stated_extras(scene: Scene) -> dict[str, Any]:
    """Return the extras: those of the file, overridden by those of the animation."""
    items = [scene.file.json["asset"]]
    if len(scene.played) == 1:
        items.append(scene.file.item("animations", scene.played[0]))
    return {
        key: value for item in items if isinstance(item.get("extras"), dict) for key, value in item["extras"].items()
    }


def _returns(motion: _Motion, keys: np.ndarray) -> bool:
    """Whether the last key has the pose of the first."""
    first, last = motion.read(keys[[0, -1]]).astype(np.float64)
    return bool(np.linalg.norm(last - first, axis=1).max() <= SAME * np.linalg.norm(np.ptp(first, axis=0)))


def _stated_rate(extras: dict, keys: np.ndarray) -> float | None:
    """Return the frame rate that the file states, if its keys agree."""
    fps = extras.get("fps")
    return float(fps) if _is_number(fps) and 0 < fps < 1e6 and not off_grid(keys, fps).any() else None


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e15


def _on_keys(times: np.ndarray, keys: np.ndarray, fps: float) -> np.ndarray:
    """Times that are those of a key but for rounding become exactly it, which STEP asks for."""
    after = np.clip(np.searchsorted(keys, times), 1, max(len(keys) - 1, 1))
    right = keys[np.minimum(after, len(keys) - 1)]
    nearest = np.where(np.abs(times - keys[after - 1]) <= np.abs(right - times), keys[after - 1], right)
    return np.where(np.abs(nearest - times) * fps < 0.02, nearest, times)


# ---- what does not move ----


def _parts(scene: Scene, nodes: list[GltfNode]) -> list[tuple[str, list[GltfNode]]]:
    """The objects, by name: a node each, but for those side by side that show one shape below a node that says so."""
    parts: list[tuple[int, str, list[GltfNode]]] = []
    for node in nodes:
        above = int(scene.parent[node.index])
        if not scene.says_copies(above) or node.skin is not None or node.targets or node.copies is not None:
            parts.append((-1, node.name, [node]))
        elif parts and parts[-1][0] == above and _is_alike(parts[-1][2][-1], node):
            parts[-1][2].append(node)
        else:
            parts.append((above, scene.name(above) or node.name, [node]))
    return [(name if len(members) > 1 else members[0].name, members) for _, name, members in parts]


def _is_alike(node: GltfNode, other: GltfNode) -> bool:
    """Whether two nodes show the same vertices and faces."""
    return node.mesh == other.mesh and node.index != other.index and node.primitives == other.primitives


def _names(scene: Scene, nodes: list[GltfNode]) -> dict[str, Any]:
    parts = _parts(scene, nodes)
    details = [
        {"doubleSided": "true"} if all(_is_double_sided(scene.file, node) for node in members) else {}
        for _, members in parts
    ]
    return {"part_names": [name for name, _ in parts], "part_kinds": [members[0].kind for _, members in parts]} | (
        {"part_usd": details} if any(details) else {}
    )


def _is_double_sided(file: GltfFile, node: GltfNode) -> bool:
    numbers = [primitive.get("material") for primitive in node.primitives]
    materials = [{} if number is None else file.item("materials", number) for number in numbers]
    return all(item.get("doubleSided") is True and "doubleSided" not in guessed(item) for item in materials)


def _shown(scene: Scene, nodes: list[GltfNode], times: np.ndarray) -> list[np.ndarray]:
    """The frames that show each object, or each of its copies."""
    parts = [part for _, part in _parts(scene, nodes)]
    return [np.stack([scene.shown(node.index, times) for node in part], axis=1) for part in parts]


def _played(scene: Scene, nodes: list[GltfNode]) -> dict[str, Any]:
    """The names of the animations that move these nodes, and of those that are not played."""
    names = list(_animation_numbers(scene.file))
    movers = {node.index for node in nodes}.union(scene.ancestors(_movers(nodes)))
    played = [names[i] for i in scene.played if not movers.isdisjoint(scene.targets(i))]
    others = _other_animations(scene).get("animation")
    return ({"animations": played} if played else {}) | ({"other_animations": others} if others else {})


def _other_animations(scene: Scene) -> dict[str, list[str]]:
    """The names of animations that are not played and would move something, as a kind of what is not read."""
    numbers = _animation_numbers(scene.file)
    others = [name for name, i in numbers.items() if i not in scene.played and scene.targets(i)]
    return {"animation": others} if others else {}


def _connections(
    file: GltfFile, nodes: list[GltfNode]
) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray | None]:
    """Faces (F, 3) and edges (E, 2), int32; and the material of each face (F,), -1 for none, where any has one."""
    indices: dict[int, list[np.ndarray]] = {2: [], 3: []}
    materials, numbers = [], _material_numbers(file)
    for node in nodes:
        indices_of_node: dict[int, list[np.ndarray]] = {2: [], 3: []}
        labels = []
        for primitive in node.primitives:
            mode = integer(primitive, "mode", 4)
            if mode == 0:
                continue
            count = node.shape_count if primitive.get("indices") is None else file.count(primitive["indices"])
            file.budget.take(CORNER_BYTES * count * (node.count // max(node.shape_count, 1)), f"mesh {node.name!r}")
            rows = rows_of(corners(file, primitive, node.shape_count, f"mesh {node.name!r}"), mode)
            indices_of_node[rows.shape[1]].append(rows)
            if rows.shape[1] == 3:
                label = integer(primitive, "material", -1, low=-1, stop=len(file.items("materials")))
                labels.append(np.full(len(rows), label if label < 0 else numbers[label], np.int32))
        starts = np.arange(node.first, node.first + node.count, max(node.shape_count, 1))
        for size, parts in indices_of_node.items():
            if parts:
                rows = np.concatenate(parts)
                rows = rows + starts[:, None, None]
                if size == 3:
                    rows = np.where(node.mirrored[:, None, None], rows[..., ::-1], rows)
                indices[size].append(rows.reshape(-1, size).astype(np.int32))
        if labels:
            materials.append(np.tile(np.concatenate(labels), len(starts)))
    faces, edges = (np.concatenate(indices[size]) if indices[size] else None for size in (3, 2))
    face_material = np.concatenate(materials) if materials else np.empty(0, np.int32)
    return faces, edges, face_material if (face_material >= 0).any() else None


def _material_numbers(file: GltfFile) -> list[int]:
    """Return the number of each material among those that have names; -1 of one that athcodec's writer made up."""
    is_stated = np.array(["name" not in guessed(item) for item in file.items("materials")], bool)
    return np.where(is_stated, np.cumsum(is_stated) - 1, -1).tolist()


def _material_names(file: GltfFile) -> list[str]:
    names = [item.get("name") for item in file.items("materials") if "name" not in guessed(item)]
    return [name if isinstance(name, str) and name else f"material {number}" for number, name in enumerate(names)]


def _attributes(
    scene: Scene, nodes: list[GltfNode], skip: Collection[str], motion: _Motion, keeps_normals: bool
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Static arrays over all vertices; nodes that lack one have 0, no number, or white. And branches, where the file
    was written with them."""
    file = scene.file
    keys = dict.fromkeys(
        key
        for node in nodes
        for key in (*node.attributes, *node.of_copies)
        if key.startswith("_") or key in ("TEXCOORD_0", "COLOR_0") or keeps_normals and key == "NORMAL"
    )
    attributes: dict[str, np.ndarray] = {}
    for key in keys:
        name = NAMES.get(key) or (key[1:].lower() if key.isupper() else key[1:]) or key
        name += "_" * (name in attributes)
        if name not in skip:
            attributes[name] = _attribute(file, nodes, key, name, motion)
    branches = _branches(file, attributes)
    for name in RESERVED_NAMES & attributes.keys():
        attributes[f"{name}_"] = attributes.pop(name)
    parts = [part for _, part in _parts(scene, nodes)]
    attributes["part_vertex_counts"] = np.array([sum(node.count for node in part) for part in parts], np.int32)
    copies = [_rigid_copies(part) for part in parts]
    if any(count > 1 for count in copies) or any(node.copies is not None for node in nodes):
        attributes["part_copies"] = np.array(copies, np.int32)
    return attributes, branches


def _rigid_copies(part: list[GltfNode]) -> int:
    copies = part[0].copies
    return len(part) if copies is None else 1 if part[0].targets else len(copies)


def _attribute(file: GltfFile, nodes: list[GltfNode], key: str, name: str, motion: _Motion) -> np.ndarray:
    pieces = {}
    for number, node in enumerate(nodes):
        if key in node.of_copies:
            pieces[number] = np.repeat(node.of_copies[key], node.shape_count, axis=0)
        elif key in node.attributes:
            index = node.attributes[key]
            values = file.attribute(index) if key.startswith("_") else file.floats(index).astype(np.float32)
            if len(values) != node.shape_count:
                raise ClipError(f"mesh {node.name!r}: got {len(values)} entries of {key}, expected {node.shape_count}")
            if key == "NORMAL" and values.shape[1] == 3:
                turned = values @ motion.normal_matrix(node).T
                length = np.linalg.norm(turned, axis=1, keepdims=True)
                values = (turned / np.where(length > 0, length, 1)).astype(np.float32)
            pieces[number] = values if node.copies is None else np.tile(values, (len(node.copies), 1))
    dtype, width = np.result_type(*pieces.values()), max(piece.shape[1] for piece in pieces.values())
    file.budget.take(2 * motion.count * width * dtype.itemsize, name)
    filler = FILLERS.get(name, np.nan if dtype.kind == "f" and key.startswith("_") else 0)
    out = np.full((motion.count, width), filler, dtype)
    for number, values in pieces.items():
        out[nodes[number].first : nodes[number].first + len(values), : values.shape[1]] = values
    return out[:, 0] if width == 1 else out


def _branches(file: GltfFile, attributes: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """vertex_branch, branch_parent and stem_index of a file that athcodec wrote."""
    extras = file.json["asset"].get("extras")
    entry_of_athcodec = extras.get("athcodec") if isinstance(extras, dict) else None
    parent = (
        entry_of_athcodec.get("branch_parent")
        if isinstance(entry_of_athcodec, dict) and "vertex_branch" in attributes
        else None
    )
    if not isinstance(parent, list) or any(type(number) is not int for number in parent):
        return {}
    names = [name for name in ("vertex_branch", "stem_index") if name in attributes]
    found_branches = {name: attributes.pop(name).astype(np.int64) for name in names}
    return found_branches | {"branch_parent": np.array(parent, np.int64)}


def _movers(nodes: list[GltfNode]) -> set[int]:
    """Numbers of the joints that move vertices, and of the nodes without a skin."""
    return {joint for node in nodes for joint in node.joints} | {node.index for node in nodes if node.skin is None}


def _skin(scene: Scene, nodes: list[GltfNode]) -> Skin | None:
    """The joints, or nodes, that vertices hang on; None where one node moves them all."""
    movers = _movers(nodes)
    order = [joint for joint in scene.order if joint in movers]
    copied = [node for node in nodes if node.copies is not None]
    if len(order) < 2 and not copied:
        return None
    place = {joint: number for number, joint in enumerate(order)}
    vertex_joint = np.full(nodes[-1].first + nodes[-1].count, -1, np.int32)
    for node in nodes:
        rows = node.vertices
        if node.skin is None:
            vertex_joint[rows] = place[node.index]
        else:
            vertex_joint[rows] = np.array([place[joint] for joint in node.joints])[node.strongest]
    parents, names = [_above(scene, joint, place) for joint in order], [scene.name(joint) for joint in order]
    for node in copied:  # each copy hangs on a joint of its own, below the node
        joints = len(parents) + np.arange(len(node.copies))
        vertex_joint[node.vertices] = np.repeat(joints, node.shape_count)
        parents += [place[node.index]] * len(joints)
        names += [node.name] * len(joints)
    return Skin(np.array(parents, np.int32), vertex_joint, tuple(names))


def _above(scene: Scene, joint: int, place: dict[int, int]) -> int:
    joint = int(scene.parent[joint])
    while joint >= 0 and joint not in place:
        joint = int(scene.parent[joint])
    return place.get(joint, -1)
