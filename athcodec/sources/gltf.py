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
from dataclasses import replace

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.gltf.document import GltfFile
from athcodec.files.gltf.json import BROKEN, indices, integer
from athcodec.files.gltf.motion import EXTENSION, extension_of
from athcodec.files.gltf.primitives import corners, rows_of
from athcodec.files.plain import FilePath
from athcodec.files.reading import closing_on_failure, naming
from athcodec.motion.clip import RESERVED_NAMES, ClipRange, MotionClip, Skin
from athcodec.motion.frames import Frames
from athcodec.motion.joining import join
from athcodec.sources import LISTED, ReadOptions, besides
from athcodec.sources.gltf_motion import NodeMotion, sampling_of
from athcodec.sources.gltf_nodes import GltfNode, load_node, moving_nodes, nodes_of_mesh
from athcodec.sources.gltf_scene import Scene
from athcodec.sources.gltf_unread import INSTANCING, guessed, not_read
from athcodec.sources.scene_objects import FACE_MATERIAL, MATERIAL_NAMES, Facing, presence_metadata
from athcodec.untyped import JsonObject

MOST_VERTICES = 1 << 27
CORNER_BYTES = 96  # Bytes that a corner of a face takes; strips make three of each.
VERTEX_BYTES = 160  # Bytes that a vertex takes in the poses that are held and made.
NAMES = {"TEXCOORD_0": "uv", "COLOR_0": "colors", "NORMAL": "normals"}
FILLERS = {"colors": 1.0}
ANIMATION = "animation:"
REST_ROUNDING = 1e-6  # Distance by which joints may miss the unmoved mesh, over its largest coordinate.


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the glTF file `path`; close it, or use it in a `with` statement.

    The rest pose is the scene without animation if options.rest is "auto". The metadata "animations" names the
    animations that are played, and "other_animations" those that are not; with options.takes, the clip has a clip range
    for each take, called like its animation. Raises ClipError if the file is no glTF that can be read here,
    MissingExtra if its compression needs a package, OSError if a file cannot be opened.
    """
    with naming(path):
        file = GltfFile(path, options.max_memory)
        if extension_of(file.json) is not None:
            file.close()
            raise ClipError(f"{EXTENSION}: got a motion of its own, expected one of glTF: decode the file first")
    with naming(path, *BROKEN), closing_on_failure(file), np.errstate(all="ignore"):
        return _read(file, options)


def _read(file: GltfFile, options: ReadOptions) -> MotionClip:
    """Return the clip of the nodes that the options choose. Raises ClipError."""
    scenes = _scenes(file, options)
    scene = next(iter(scenes.values()))
    nodes = _chosen(scene, _patterns(options))
    for node in nodes:
        load_node(node, scene)
    return _clip(file, scenes, nodes, options, None)


def read_moving(file: GltfFile, options: ReadOptions) -> tuple[MotionClip, list[GltfNode], Placement]:
    """Return (clip, nodes, placement): the clip of those meshes of a glTF file that move, the nodes that show them, and
    where the clip's space lies in the world.

    If a single matrix takes the stored meshes to their places, the clip's space is that of the stored meshes, so that
    the rest pose has exactly their numbers. `file` stays open. Raises ClipError if nothing moves.
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
            load_node(node, scene)
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
        """Choose the space for the motion of `nodes`: the space in which the rest pose has the stored numbers of as
        many meshes as possible. `scenes` are the takes, each as a scene of its own."""
        self._scenes = scenes
        self.starts = [float(scene.keys[0]) for scene in scenes]
        self.space = NodeMotion(scenes[0], nodes).placed(max(nodes, key=self._preference))
        if not abs(np.linalg.det(self.space[:3, :3])) > 0:
            self.space = np.eye(4)
        self.from_world = None if np.array_equal(self.space, np.eye(4)) else np.linalg.inv(self.space)
        self._motion = NodeMotion(scenes[0], nodes, self.from_world)

    def _preference(self, node: GltfNode) -> tuple[bool, int]:
        """Return the key by which the node is chosen whose space the clip takes: no animation moves it, then the most
        vertices."""
        hangs = node.skin is None and any(scene.animates({node.index}) for scene in self._scenes)
        return not hangs, node.count

    def stays(self, index: int) -> bool:
        """Return whether node `index` has the space of the clip in all frames, so that its vertices need no
        transform."""
        scene = self._scenes[0]
        matrix = scene.matrices(scene.ancestors({index}), None)[index][0]
        off = np.abs(matrix - self.space).max()
        return off <= REST_ROUNDING * np.abs(self.space).max() and not any(
            each.animates({index}) for each in self._scenes
        )

    def is_always_shown(self, index: int) -> bool:
        """Return whether a node is visible at all keys of all takes."""
        return all(scene.shown(index, scene.keys).all() for scene in self._scenes)

    def turned(self, node: GltfNode, directions: np.ndarray, is_normal: bool) -> np.ndarray:
        """Return (n, 3) unit directions at a node's vertices, in this space without animation."""
        return self._motion.turned(node, directions, is_normal)


def _moves(scene: Scene, node: GltfNode) -> bool:
    """Return whether an animation that is played moves the vertices of a node, by transforms, joints or morph
    targets."""
    joints = [node.index] if node.skin is None else indices(scene.file.item("skins", node.skin), "joints")
    return scene.morphs(node.index) or scene.animates(set(joints))


def _has_motion(node: GltfNode) -> bool:
    """Return whether the extension ATH_motion moves a primitive of the node already."""
    return any(extension_of(primitive) is not None for primitive in node.primitives)


def _patterns(options: ReadOptions) -> list[str]:
    """Return the patterns in `options.only` that choose nodes and meshes, without those that choose animations."""
    return [name for name in options.only if not name.startswith(ANIMATION)]


def _clip(
    file: GltfFile, scenes: dict[str, Scene], nodes: list[GltfNode], options: ReadOptions, from_world: np.ndarray | None
) -> MotionClip:
    """Return the clip of the given nodes. `scenes` has the scene of each take by the take's name, "" for a single take
    without a name. `from_world` (4, 4) takes world space to the space of the clip; None leaves positions in world
    space."""
    scene = next(iter(scenes.values()))
    motions = {name: NodeMotion(take, nodes, from_world) for name, take in scenes.items()}
    motion = next(iter(motions.values()))
    timings = {name: sampling_of(take, options.fps) for name, take in motions.items()}
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
    stated: JsonObject = {}
    if face_material is not None and FACE_MATERIAL not in options.skip:
        attributes[FACE_MATERIAL] = face_material
        stated = {MATERIAL_NAMES: _material_names(file), "domains": {FACE_MATERIAL: "face"}}
    rest = _rest_pose(motion, nodes) if options.rest == "auto" else None
    unread = not_read(list(scenes.values()), nodes, keeps_normals or are_guessed) | (
        {} if _chooses(options) else _other_animations(scene)
    )
    clips = {}
    rest_fields = options.rest_fields(None)
    for name, timing in timings.items():
        if rest is not None and np.isfinite(rest).all():
            rest_fields["rest"] = rest
        clips[name] = MotionClip(
            positions=_positions(motions[name], timing.times),
            time=np.arange(len(timing.times)) / timing.fps,
            **rest_fields,
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


def _rest_pose(motion: NodeMotion, nodes: Sequence[GltfNode]) -> np.ndarray:
    """Return the rest pose (N, 3), which is the scene without animation. A mesh that transforms and joints leave in
    place up to rounding gets its stored numbers, which other programs read from the file, too."""
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


def _positions(motion: NodeMotion, times: np.ndarray) -> Frames:
    return Frames(lambda start, stop: motion.read(times[start:stop]), len(times), motion.count, motion.dtype, True)


# ---- scenes and nodes ----


def _scenes(file: GltfFile, options: ReadOptions) -> dict[str, Scene]:
    """Return the scene of each take by the take's name. Without `options.takes` there is one scene under "", which
    plays the animations that `options.only` names or, by default, those with which players begin. Raises ClipError for
    a name that no animation has."""
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
    """Return whether the options name the animations to read."""
    return bool(options.takes) or any(name.startswith(ANIMATION) for name in options.only)


def _chosen(scene: Scene, patterns: Sequence[str]) -> list[GltfNode]:
    """Return the visible nodes that show a mesh, in the order of the scene. If there are `patterns`, the name of the
    node or of the mesh has to match one of them. Raises ClipError if there is no such node."""
    file = scene.file
    nodes, seen = [], []
    for index in scene.order:
        mesh_index = scene.nodes[index].get("mesh")
        if mesh_index is not None and not scene.is_hidden(index):
            mesh = file.item("meshes", mesh_index)
            called = [scene.name(index), mesh["name"] if isinstance(mesh.get("name"), str) else ""]
            seen.extend(called)
            if not patterns or any(fnmatch.fnmatchcase(name, pattern) for name in called for pattern in patterns):
                nodes.extend(nodes_of_mesh(scene, index, mesh, next(filter(None, called), f"mesh {mesh_index}")))
    if not nodes:
        names = ", ".join(sorted({name for name in seen if name})[:LISTED])
        raise ClipError(
            f"only: got {', '.join(patterns)}, expected names such as {names}"
            if patterns and seen
            else f"meshes: got none in the scene, expected at least one{besides(not_read([scene], []))}"
        )
    file.budget.take(VERTEX_BYTES * _number(nodes), "meshes")
    return nodes


def _number(nodes: Sequence[GltfNode]) -> int:
    """Store in each node the number of its first vertex in the clip, and return the number of vertices of all nodes.
    Raises ClipError if these are too many."""
    first = 0
    for node in nodes:
        node.first = first
        first += node.count
    if first > MOST_VERTICES:
        raise ClipError(f"meshes: got {first} vertices, expected at most {MOST_VERTICES}")
    return first


def _animations(scene: Scene, patterns: Sequence[str], subject: str) -> dict[str, int]:
    """Return the animations that move something and whose name matches one of `patterns`: their numbers by their names,
    in the file's order. `subject` begins the message of the ClipError for a pattern that matches none."""
    every, wanted = _animation_numbers(scene.file), set()
    numbers = {name: index for name, index in every.items() if scene.targets(index)}
    for pattern in patterns:
        matching = {name for name in numbers if name == pattern or fnmatch.fnmatchcase(name, pattern)}
        if not matching:
            unmoving = ", which moves no node of the scene" if pattern in every else ""
            raise ClipError(f"{subject}{pattern}{unmoving}, expected one of {', '.join(list(numbers)[:LISTED])}")
        wanted |= matching
    return {name: index for name, index in numbers.items() if name in wanted}


def _animation_numbers(file: GltfFile) -> dict[str, int]:
    """Return the numbers of all animations of the file by their names. An animation whose name is taken gets a name
    that ends in its number, and one without a name is "animation N"."""
    numbers: dict[str, int] = {}
    for index, animation in enumerate(file.items("animations")):
        name = animation.get("name")
        name = name if isinstance(name, str) and name else f"animation {index}"
        while name in numbers:
            name = f"{name}.{index}"
        numbers[name] = index
    return numbers


# ---- how it moves ----


# ---- what does not move ----


def _parts(scene: Scene, nodes: list[GltfNode]) -> list[tuple[str, list[GltfNode]]]:
    """Return the objects of the clip as pairs (name, nodes). A node is an object of its own, except that neighbouring
    nodes with the same shape are one object of several copies if the node above them is marked as a node of copies."""
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
    """Return whether two nodes show the same vertices and faces."""
    return node.mesh == other.mesh and node.index != other.index and node.primitives == other.primitives


def _names(scene: Scene, nodes: list[GltfNode]) -> JsonObject:
    """Return metadata of the clip's objects: "part_names", "part_kinds" and, if faces of any object are visible from
    both sides, "part_usd"."""
    parts = _parts(scene, nodes)
    details = [
        {"doubleSided": "true"} if all(_is_double_sided(scene.file, node) for node in members) else {}
        for _, members in parts
    ]
    return {"part_names": [name for name, _ in parts], "part_kinds": [members[0].kind for _, members in parts]} | (
        {"part_usd": details} if any(details) else {}
    )


def _is_double_sided(file: GltfFile, node: GltfNode) -> bool:
    """Return whether the file states for all primitives of the node that both sides are seen."""
    numbers = [primitive.get("material") for primitive in node.primitives]
    materials = [{} if number is None else file.item("materials", number) for number in numbers]
    return all(item.get("doubleSided") is True and "doubleSided" not in guessed(item) for item in materials)


def _shown(scene: Scene, nodes: list[GltfNode], times: np.ndarray) -> list[np.ndarray]:
    """Return the frames that show each object, or each of its copies."""
    parts = [part for _, part in _parts(scene, nodes)]
    return [np.stack([scene.shown(node.index, times) for node in part], axis=1) for part in parts]


def _played(scene: Scene, nodes: list[GltfNode]) -> JsonObject:
    """Return the names of the animations that move these nodes, and of those that are not played."""
    names = list(_animation_numbers(scene.file))
    movers = {node.index for node in nodes}.union(scene.ancestors(moving_nodes(nodes)))
    played = [names[i] for i in scene.played if not movers.isdisjoint(scene.targets(i))]
    others = _other_animations(scene).get("animation")
    return ({"animations": played} if played else {}) | ({"other_animations": others} if others else {})


def _other_animations(scene: Scene) -> dict[str, list[str]]:
    """Return the names of animations that are not played and would move something, as a kind of what is not read."""
    numbers = _animation_numbers(scene.file)
    others = [name for name, i in numbers.items() if i not in scene.played and scene.targets(i)]
    return {"animation": others} if others else {}


def _connections(
    file: GltfFile, nodes: list[GltfNode]
) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray | None]:
    """Return (faces, edges, materials) of the nodes' meshes: triangles (F, 3) and edges (E, 2), int32, as vertex
    numbers of the clip, and the number of each triangle's material (F,), -1 for none. Each of the three is None if the
    file has nothing of that kind."""
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
    scene: Scene, nodes: list[GltfNode], skip: Collection[str], motion: NodeMotion, keeps_normals: bool
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return (attributes, branches): the static arrays of the clip by name, and the arrays that describe branches,
    empty unless athcodec wrote the file. Vertices of nodes that lack an array get 0, NaN or, as a colour, white. Arrays
    named in `skip` are left out; normals are read only if `keeps_normals`."""
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


def _attribute(file: GltfFile, nodes: list[GltfNode], key: str, name: str, motion: NodeMotion) -> np.ndarray:
    """Return the array `name` of the clip, with a row for each vertex, from the glTF attribute `key` of all nodes.
    Vertices of nodes without this attribute get a filler, mostly 0. Normals are turned to world space."""
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
    """Move the arrays that describe branches out of `attributes` and return them: vertex_branch, branch_parent and, if
    stored, stem_index. Return nothing if athcodec did not write the file."""
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


def _skin(scene: Scene, nodes: list[GltfNode]) -> Skin | None:
    """Return the joints that move vertices, or the nodes where a mesh has no joints, as a hierarchy with the strongest
    joint of each vertex. Return None if a single node moves all vertices."""
    movers = moving_nodes(nodes)
    order = [joint for joint in scene.order if joint in movers]
    copied = [(node, len(node.copies)) for node in nodes if node.copies is not None]
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
    for node, copy_count in copied:  # Each copy hangs on a joint of its own, below the node.
        joints = len(parents) + np.arange(copy_count)
        vertex_joint[node.vertices] = np.repeat(joints, node.shape_count)
        parents += [place[node.index]] * len(joints)
        names += [node.name] * len(joints)
    return Skin(np.array(parents, np.int32), vertex_joint, tuple(names))


def _above(scene: Scene, joint: int, place: dict[int, int]) -> int:
    """Return the number in `place` of the nearest joint above another, -1 for none."""
    joint = int(scene.parent[joint])
    while joint >= 0 and joint not in place:
        joint = int(scene.parent[joint])
    return place.get(joint, -1)
