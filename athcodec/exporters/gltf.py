"""Writes GLB: glTF 2.0 in one file, moved by joints or by morph targets. Structure and skinning are written by hand.

"joints": a joint for each part that moves as one at the view's level (node or stem of the .ath file, branch of a
clip), all side by side below one node. A joint has translation, rotation and three scales; a part that this leaves
further off than the level itself is (of a clip: fitting.OF_CLIP of its size) is cut into shorter ones (fitting.py).
"morphs": a morph target per frame, exact but for float32, and large: it moves normals too, as these would stay those of
the rest pose and the light with them. "auto": the smaller of both for a short clip, else joints, or morph targets where
float32 puts joints further off and they are not too large.
options.rig makes a hierarchy of joints for engines (rig.py), options.instances nodes of copies of one shape
(gltf_copies.py). Some engines, three.js among them, move triangles only: lines and points stand still there.

Each of several clips is an animation of its name over the same joints or targets, and moves all that any of them
moves: players may go from one to the other. glTF knows no loops: theirs end with the first frame again, and have
{"loop": true} in extras.

The error against what was to be written is in asset.extras.athcodec.max_error, in the unit of the vertices, and is
what write_clip returns. A node above all turns and scales to glTF's metres with y up, so that vertices keep their
numbers. Keys of animations are held in memory, morph targets are written frame by frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from os import fspath
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.decoding.clip_view import ClipView
from athcodec.errors import ClipError
from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters.fitting import allowed_error
from athcodec.exporters.gltf_build import (
    NORMAL,
    UNKNOWN_BOUND,
    VERTICES,
    Glb,
    GltfMesh,
    Take,
    add_materials,
    add_mesh,
    branch_extras,
    clock,
    meshes_of,
    root_transform,
    takes,
)
from athcodec.exporters.gltf_copies import PATHS, GltfCopies, Movers, unit_quaternion, with_copies
from athcodec.exporters.gltf_joints import Joints, fit_joints
from athcodec.exporters.looks import looks_of
from athcodec.exporters.rig import fit_rig
from athcodec.exporters.scene_objects import NOT_WRITTEN, lost_arrays, objects_of
from athcodec.exporters.surface import MovingNormals, Surface
from athcodec.files.atomic import new_file
from athcodec.files.plain import FilePath
from athcodec.motion.protocol import Motion
from athcodec.sources.gltf_scene import BONES
from athcodec.sources.scene_objects import GUESSED
from athcodec.untyped import JsonMapping, JsonObject

MOST_JOINTS = 65536
SHORT_FRAMES, SHORT_BYTES = 300, 256 << 20
MORPH_FRAMES, MORPH_BYTES = 4096, 2 << 30
BYTES_PER_JOINT_KEY, BYTES_PER_JOINT, BYTES_PER_TARGET = 40, 900, 180


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write a MotionClip or a ClipView as GLB to `path`. Return the facts that the file has in asset.extras.athcodec,
    such as its error.

    Raise ClipError if the motion has more joints, frames or bytes than glTF can sensibly hold.
    """
    try:
        facts = _write(motion, path, options, report)
    except ValueError as error:
        if isinstance(error, ClipError):
            raise
        raise ClipError(f"{fspath(path)}: got values that glTF cannot hold: {error}") from None
    report(1.0)
    return facts


def _write(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write the GLB as `write_clip` does, and return its facts."""
    looks = looks_of(motion, objects_of(motion))
    meshes = meshes_of(motion, looks, Path(fspath(path)).stem)
    has_copies = options.instances and options.rig is None
    shapes, lost_copies = with_copies(motion, meshes.meshes) if has_copies else (list(meshes.meshes), {})
    write = _writer(motion, options, looks.surface, shapes, lambda done: report(0.95 * done))
    facts: JsonObject = {
        "animation": write.name if options.rig is None else "a rig",
        "unit": str(motion.metadata.get("unit") or ""),
    }
    if isinstance(motion, ClipView):
        facts |= {"level": motion.level, "level_max_error": float(motion.max_error)}
    facts |= write.facts
    copied = [shape for shape in shapes if isinstance(shape, GltfCopies)]
    if copied:
        facts["instances"] = sum(len(shape.copies.rest[0]) for shape in copied)
        write.max_error = max(write.max_error, *(shape.copies.max_error for shape in copied))
    lost_keys = copied[0].lost if copied else []
    left_out = meshes.left_out + [key[1:] for key in lost_keys]
    facts |= {"left_out": left_out} if left_out else {}
    facts |= {GUESSED: ["normals"]} if meshes.has_made_normals else {}
    facts |= branch_extras(motion) if "_vertex_branch" not in lost_keys else {}
    glb = Glb(clock(motion) | {"athcodec": facts})
    add_materials(glb, meshes)
    transform = root_transform(motion)
    later = write.add(glb, glb.node(name="plant", **transform), transform, shapes, report)
    facts |= {"max_error": write.max_error, "vertices": motion.vertex_count}
    with new_file(path) as out:
        glb.write(out, later)
    lost = lost_arrays(motion, set(motion.attributes) - set(left_out)).get(NOT_WRITTEN, {}) | lost_copies
    return facts | ({NOT_WRITTEN: lost} if lost else {})


def _writer(
    motion: Motion, options: WriteOptions, surface: Surface, meshes: list[GltfMesh | GltfCopies], report: Progress
) -> _Joined | _Morphed:
    """Return the object that moves the meshes, by joints or by morph targets, as the options ask or as makes the
    smaller file.
    """
    if options.rig is not None:
        return _Joined(motion, fit_rig(motion, options.rig, report))
    shapes = [shape for shape in meshes if isinstance(shape, GltfMesh)]
    if not shapes:
        return _Joined(motion, None)
    chosen = np.zeros(motion.vertex_count, bool)
    chosen[np.concatenate([shape.source for shape in shapes])] = True
    offsets = sum(map(_offset_count, shapes))
    wanted, joints = options.animation, None
    if wanted != "morphs":
        joints = fit_joints(motion, allowed_error(motion), MOST_JOINTS, report, None if chosen.all() else chosen)
    if wanted == "joints" and joints is None:
        raise ClipError(
            f"joints: got more than {MOST_JOINTS} that it takes to move the clip, expected fewer: choose a "
            "lower level, or morphs"
        )
    if wanted == "auto":
        wanted = _smaller(motion, offsets, joints)
    if wanted == "joints":
        return _Joined(motion, joints)
    check_morphs(motion, offsets)
    return _Morphed(motion, surface)


def write_rest(motion: Motion, path: str, name: str, more: Mapping[str, np.ndarray], extras: JsonMapping) -> None:
    """Write the rest pose alone as GLB. `more` has further attributes (N, width) by their semantic, besides those of
    the clip.
    """
    meshes = meshes_of(motion, looks_of(motion, objects_of(motion)), name, more)
    left_out = {"left_out": meshes.left_out} if meshes.left_out else {}
    glb = Glb(clock(motion) | {"athcodec": dict(extras) | left_out})
    add_materials(glb, meshes)
    root = glb.node(name="plant", **root_transform(motion))
    for shape in meshes.meshes:
        if "TEXCOORD_1" in shape.attributes:  # glTF allows a second set only beside a first
            shape.attributes.setdefault("TEXCOORD_0", np.zeros((len(shape.source), 2), np.float32))
        glb.node(root, name=shape.name, mesh=add_mesh(glb, shape, np.asarray(motion.rest)))
    with open(path, "wb") as out:
        glb.write(out)


def write_bound(motion: Motion, path: FilePath, bones: Any, facts: JsonMapping) -> JsonObject:
    """Write the rest pose with a skin, whose bones (binding.bones.Bones) stand in the rest pose and have no keys.
    Return what was not written, as `write_clip` does.

    The extras of the node above the bones have, as "ATH_bones", what ATHBones needs to turn them: for each bone its
    vertex in the .ath file, and the bones before and after it along its stem; the first bones of stems; and the slices
    of stems that are surfaces (binding.bones.Bones, slices).
    """
    meshes = meshes_of(motion, looks_of(motion, objects_of(motion)), Path(fspath(path)).stem)
    left_out = {"left_out": meshes.left_out} if meshes.left_out else {}
    glb = Glb({"athcodec": {**facts, "animation": "none", **left_out}})
    add_materials(glb, meshes)
    lists = {name: getattr(bones, name).tolist() for name in ("vertex", "before", "after")}
    lists["first"] = np.flatnonzero(bones.side).tolist()
    slices = bones.slices
    lists |= {"slices": slices} if slices["bone"] else {}
    extras = {BONES: {**lists, "error": facts["max_error_of_plant"]}}
    root = glb.node(name="plant", extras=extras, **root_transform(motion))
    count = len(bones.rest)
    bind = np.tile(np.eye(4, dtype=np.float32), (count, 1, 1))
    bind[:, :3, 3] = -bones.rest
    still = (
        bones.rest.astype(np.float32),
        np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1)),
        np.ones((count, 3)),
    )
    names = tuple(f"bone_{number}" for number in range(count))
    joined = _Joined(motion, Joints(bones.joint, bind, still, still, weights=bones.weight, names=names))
    joined.add_still(glb, root, meshes.meshes)
    with new_file(path) as out:
        glb.write(out)
    not_written = lost_arrays(motion, set(motion.attributes) - set(meshes.left_out)).get(NOT_WRITTEN, {})
    return {NOT_WRITTEN: not_written} if not_written else {}


def _offset_count(shape: GltfMesh) -> int:
    """Return how many vectors a morph target of a mesh has: one for each position and each normal."""
    return len(shape.source) * (2 if NORMAL in shape.attributes else 1)


def _smaller(motion: Motion, offset_count: int, joints: Joints | None) -> str:
    """Return "morphs" or "joints", whichever makes the smaller file; joints only if their error is allowed.
    `offset_count` is the number of vertices that each morph target moves.
    """
    morphs = motion.frame_count * (12 * offset_count + 4 * motion.frame_count + BYTES_PER_TARGET)
    fits = joints is not None and joints.max_error <= allowed_error(motion)
    if joints is None or not fits and _morphs_fit(motion, offset_count):
        return "morphs"
    is_short = motion.frame_count <= SHORT_FRAMES and morphs <= SHORT_BYTES
    size = len(joints.bind) * (BYTES_PER_JOINT_KEY * motion.frame_count + BYTES_PER_JOINT)
    return "morphs" if is_short and morphs < size else "joints"


def _morphs_fit(motion: Motion, offset_count: int) -> bool:
    return motion.frame_count <= MORPH_FRAMES and 12 * motion.frame_count * offset_count <= MORPH_BYTES


def check_morphs(motion: Motion, offset_count: int) -> None:
    """Raise ClipError where a motion of so many positions and normals is more than morph targets can sensibly hold."""
    if not _morphs_fit(motion, offset_count):
        raise ClipError(
            f"morph targets: got {motion.frame_count} frames of {offset_count} positions and normals, expected at most "
            f"{MORPH_FRAMES} frames and {MORPH_BYTES} bytes, 12 of each in a frame: choose joints or fewer frames"
        )


def _add_animation(glb: Glb, take: Take, samplers: list[JsonObject], channels: list[JsonObject]) -> None:
    if channels:
        animation = {"name": take.name, "samplers": samplers, "channels": channels}
        extras = {"extras": take.extras} if take.extras else {}
        glb.json.setdefault("animations", []).append(animation | extras)


def _animate(
    glb: Glb, takes: list[Take], movers: Movers | None, more: list[tuple[list[JsonObject], list[JsonObject]]]
) -> None:
    """Add an animation for each take. `more` has the samplers and channels that the take has already; channels are
    added for all movers that leave their rest pose in any take. A mover that stands still in a take gets a single key.
    """
    if movers is None:
        movers = Movers([], (np.zeros((0, 3)),) * 3, (np.zeros((takes[-1].stop, 0, 3)),) * 3)
    has_others = bool(more[0][1])
    used = [(values != rest).any(axis=(0, 2)) for values, rest in zip(movers.poses, movers.rest)]
    if len(takes) > 1 and not np.any(used) and movers.nodes and not has_others:
        used[0][0] = True  # an animation has a channel at least
    for take, (samplers, channels) in zip(takes, more):
        poses = [_keys(take, values) for values in movers.poses]
        moves = [of & (values != values[:1]).any(axis=(0, 2)) for of, values in zip(used, poses)]
        if len(takes) > 1 and np.any(used) and not np.any(moves) and not has_others:
            path = next(path for path, of in enumerate(used) if of.any())
            moves[path][used[path].argmax()] = True  # one that stands still lasts as long as it does
        _add_channels(glb, movers.nodes, take, list(zip(poses, used, moves)), samplers, channels)
        _add_animation(glb, take, samplers, channels)


class _Joined:
    """Adds joints, and meshes that hang on them; None: there are none. It is all in memory."""

    def __init__(self, motion: Motion, joints: Joints | None):
        self._motion, self._joints = motion, joints
        self.name = "instances" if joints is None else "joints"
        self.max_error = 0.0 if joints is None else joints.max_error
        self.facts = {} if joints is None else {"joints": len(joints.bind)}

    def add(
        self, glb: Glb, root: int, transform: JsonObject, shapes: list[GltfMesh | GltfCopies], report: Progress
    ) -> Iterator[bytes]:
        """Add the meshes, their joints and the animations of these to the GLB, below the node `root`. Return an empty
        iterator, because no further data follow.
        """
        joints, movers = self._joints, []
        if joints is not None:
            movers.append(Movers(self._add_skin(glb, root, joints), joints.rest, joints.poses))
        # meshes with a skin are beside the root, as nothing but joints places them, and copies beside those
        place: tuple[int | None, JsonObject] = (root, {}) if joints is None else (None, transform)
        for shape in shapes:
            if isinstance(shape, GltfCopies):
                movers += shape.add(glb, *place)
            elif joints is not None:
                self._add_mesh(glb, shape, joints)
        moving = takes(self._motion)
        _animate(glb, moving, Movers.all_of(movers), [([], []) for _ in moving])
        return iter(())

    def add_still(self, glb: Glb, root: int, shapes: Iterable[GltfMesh]) -> None:
        """Add joints without keys, and meshes that hang on them."""
        assert self._joints is not None
        self._add_skin(glb, root, self._joints)
        for shape in shapes:
            self._add_mesh(glb, shape, self._joints)

    def _add_skin(self, glb: Glb, root: int, joints: Joints) -> list[int]:
        """Add the joints as nodes below the node `root`, and the skin. Return the numbers of the joints' nodes."""
        nodes: list[int] = []
        for i, (place, turn) in enumerate(zip(*joints.rest[:2])):
            above = root if joints.parent is None or joints.parent[i] < 0 else nodes[joints.parent[i]]
            name = joints.names[i] if joints.names else f"part_{i}"
            nodes.append(glb.node(above, name=name, translation=place.tolist(), rotation=unit_quaternion(turn)))
        bind = glb.array(np.ascontiguousarray(joints.bind.swapaxes(1, 2)).reshape(-1, 16))
        glb.json["skins"] = [{"joints": nodes, "inverseBindMatrices": bind, "skeleton": root}]
        return nodes

    def _add_mesh(self, glb: Glb, shape: GltfMesh, joints: Joints) -> None:
        joint_numbers, weights = _influences(joints, shape.source, np.uint8 if len(joints.bind) <= 256 else np.uint16)
        mesh = add_mesh(glb, shape, np.asarray(self._motion.rest), {"JOINTS_0": joint_numbers, "WEIGHTS_0": weights})
        glb.node(name=shape.name, mesh=mesh, skin=0)


def _influences(joints: Joints, source: np.ndarray, dtype: type[np.unsignedinteger]) -> tuple[np.ndarray, np.ndarray]:
    """Return the joints and the weights, (n, 4) each, of n written vertices. `source` (n,) is the clip's vertex that
    each written vertex is.
    """
    vertex_joints = np.zeros((len(source), 4), dtype)
    if joints.weights is None:
        weights = np.zeros(vertex_joints.shape, np.uint8)
        vertex_joints[:, 0], weights[:, 0] = joints.vertex_joint[source], 255
        return vertex_joints, weights
    joint_weights, width = np.zeros(vertex_joints.shape, np.float32), joints.weights.shape[1]
    joint_weights[:, :width] = joints.weights[source]
    vertex_joints[:, :width] = np.where(joint_weights[:, :width] > 0, joints.vertex_joint[source], 0)
    return vertex_joints, joint_weights


def _keys(take: Take, values: np.ndarray) -> np.ndarray:
    """Return the clip's of all frames, (n, J, width); a loop returns to its first rotation the shorter way."""
    keys = take.of(values)
    if take.is_loop and values.shape[2] == 4:
        keys[-1] *= np.where((keys[-1] * keys[-2]).sum(axis=1, keepdims=True) < 0, np.float32(-1), np.float32(1))
    return keys


def _add_channels(
    glb: Glb,
    nodes: list[int],
    take: Take,
    tracks: list[tuple[np.ndarray, np.ndarray, np.ndarray]],
    samplers: list[JsonObject],
    channels: list[JsonObject],
) -> None:
    """Append samplers and channels that move nodes. For each of PATHS, `tracks` has the poses (n, J, width) and two
    bool arrays (J,): which nodes have a channel, and which of them move. A node that moves gets a key per frame, any
    other a single key.
    """
    inputs: dict[int, int] = {}  # accessors of times, by their number
    for path, (values, is_used, moving) in zip(PATHS, tracks):
        for chosen_nodes, count in ((moving, len(values)), (is_used & ~moving, 1)):
            chosen = np.flatnonzero(chosen_nodes)
            if not len(chosen):
                continue
            if count not in inputs:
                inputs[count] = glb.array(take.times[:count], bounds=True)
            data = np.ascontiguousarray(values[:count, chosen].swapaxes(0, 1))
            view, size = glb.stored(data), data[0].nbytes
            for place, joint in enumerate(chosen):
                output = glb.accessor(view, data.dtype, count, data.shape[2], byteOffset=place * size)
                samplers.append({"input": inputs[count], "output": output})
                channels.append({"sampler": len(samplers) - 1, "target": {"node": nodes[joint], "path": path}})


class _Morphed:
    """Adds meshes with a morph target per frame; the targets are written last, frame by frame."""

    name = "morphs"
    facts: JsonMapping = {}

    def __init__(self, motion: Motion, surface: Surface):
        self._motion, self._surface = motion, surface
        self.max_error = 0.0

    def add(
        self, glb: Glb, root: int, transform: JsonObject, parts: list[GltfMesh | GltfCopies], report: Progress
    ) -> Iterator[bytes]:
        """Add the meshes with a morph target for each frame to the GLB, below the node `root`. Yield the bytes of the
        targets, which follow the rest of the file.
        """
        shapes, meshes, channels, movers = [], [], [], []
        for shape in parts:
            if isinstance(shape, GltfCopies):
                movers += shape.add(glb, root, {})
                continue
            shapes.append(shape)
            meshes.append(add_mesh(glb, shape, np.asarray(self._motion.rest)))
            node = glb.node(root, name=shape.name, mesh=meshes[-1])
            channels.append({"sampler": 0, "target": {"node": node, "path": "weights"}})
        frames = self._motion.frame_count
        weights, moving, more = np.eye(frames, dtype=np.float32), takes(self._motion), []
        for take in moving:
            times, values = glb.array(take.times, bounds=True), glb.array(take.of(weights).reshape(-1, 1))
            more.append(([{"input": times, "output": values}], list(channels)))
        _animate(glb, moving, Movers.all_of(movers), more)
        view = glb.view(12 * frames * sum(map(_offset_count, shapes)), target=VERTICES, byteStride=12)
        bounds = self._add_targets(glb, shapes, meshes, view)
        least, self.max_error = self.max_error, UNKNOWN_BOUND
        return self._targets(glb, shapes, bounds, least, report)

    def _add_targets(self, glb: Glb, shapes: list[GltfMesh], meshes: list[int], view: int) -> list[list[JsonObject]]:
        """Add the accessors of the morph targets and return those of positions, whose bounds are not known yet, as a
        list per frame with one item per mesh.
        """
        accessors: list[list[JsonObject]] = []
        place = 0
        for _ in range(self._motion.frame_count):
            accessors.append([])
            for mesh, shape in zip(meshes, shapes):
                target = {}
                for key in ("POSITION", *((NORMAL,) if NORMAL in shape.attributes else ())):
                    target[key] = glb.accessor(view, np.dtype(np.float32), len(shape.source), 3, byteOffset=place)
                    place += 12 * len(shape.source)
                bounds = {"min": [UNKNOWN_BOUND] * 3, "max": [UNKNOWN_BOUND] * 3}
                glb.json["accessors"][target["POSITION"]] |= bounds
                accessors[-1].append(glb.json["accessors"][target["POSITION"]])
                for primitive in glb.json["meshes"][mesh]["primitives"]:
                    primitive.setdefault("targets", []).append(target)
        return accessors

    def _targets(
        self, glb: Glb, shapes: list[GltfMesh], accessors: list[list[JsonObject]], least: float, report: Progress
    ) -> Iterator[bytes]:
        """Yield the bytes of the morph targets frame by frame: offsets of positions from the rest pose, and of normals.
        `least` is the smallest error that is reported, in scene units.
        """
        rest = np.asarray(self._motion.rest).astype(np.float32)
        normals = MovingNormals(self._surface, rest)
        largest = least**2
        for start, frames in self._motion.blocks():
            for i, frame in enumerate(frames):
                offsets = (frame.astype(np.float64) - rest).astype(np.float32)
                away = rest.astype(np.float64) + offsets - frame
                largest = max(largest, float(np.einsum("ni,ni->n", away, away).max()))
                normals.move(frame)
                for shape, accessor in zip(shapes, accessors[start + i]):
                    values = offsets[shape.source]
                    accessor["min"], accessor["max"] = values.min(axis=0).tolist(), values.max(axis=0).tolist()
                    yield values.tobytes()
                    if NORMAL in shape.attributes:
                        yield normals.offsets(shape.attributes[NORMAL], shape.source).tobytes()
            report((start + len(frames)) / self._motion.frame_count)
        self.max_error = float(np.sqrt(largest))
        glb.json["asset"]["extras"]["athcodec"]["max_error"] = self.max_error
