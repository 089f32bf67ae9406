"""Puts a motion into the GLB that it was read from, and back: its vertices move by ATH_motion, all else stays as it is.

What moved them before goes where nothing else needs it: morph targets, skins and their joints, channels of animations,
and the bytes of these. Meshes keep their bytes where their vertices lie in the motion's space; one that hangs on a
moving node gets new positions, normals and tangents there and a node of its own. Primitives that move and have no
material, which viewers show black, get one (looks.py) and normals. spec/gltf/README.md describes the extension.
"""

from __future__ import annotations

import copy
import io
import os
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.clip_view import ClipView
from athcodec.errors import ClipError
from athcodec.exporters.gltf import check_morphs
from athcodec.exporters.gltf_build import COLOUR, INDICES, NORMAL, UNLIT, by_material, material_of, takes
from athcodec.exporters.gltf_edit import DRACO, INSTANCES, Binary, glb_bytes, prune, used_numbers
from athcodec.exporters.looks import Look, line_look, looks_of_mesh
from athcodec.exporters.surface import MovingNormals, Surface
from athcodec.files.atomic import file_ids, keeping, new_file
from athcodec.files.gltf.document import HARMLESS, GltfFile
from athcodec.files.gltf.json import BROKEN, entries
from athcodec.files.gltf.motion import (
    EXTENSION,
    MAGIC,
    VERTEX_ATTRIBUTE,
    GltfPlace,
    extension_of,
    motion_names,
    places_of,
)
from athcodec.files.gltf.primitives import triangles
from athcodec.files.plain import FilePath
from athcodec.files.reading import naming
from athcodec.motion.clip import ClipRange, MotionClip
from athcodec.motion.frames import Frames
from athcodec.motion.joining import split
from athcodec.sources import ReadOptions
from athcodec.sources.gltf import read_moving
from athcodec.sources.gltf_nodes import GltfNode
from athcodec.sources.gltf_scene import POINTER, Target, target_of
from athcodec.untyped import JsonObject

# Share of duplicate vertices from which the motion stores each once and meshes refer to it by index.
SHARE_OF_TWINS = 1 / 8
KNOWN = (*HARMLESS, INSTANCES, DRACO, "FB_ngon_encoding")  # gltf_edit.references lists every index that these hold.


class Into:
    """A GLB whose vertices are to move by ATH_motion: `clip` is their motion, with the meshes as its rest pose.

    Close it. keep_animation leaves what moved the vertices in the file, for programs that do not know the extension.
    name: of the motion. What other motions of the file move is left to them. `lost`, once it is written: what the file
    said and the new one does not, by its kind.
    Raises ClipError where the file is no GLB with its bytes inside, nothing in it moves, or what moves has to move to
    another node though it is to be kept.
    """

    def __init__(self, path: FilePath, options: ReadOptions, keep_animation: bool = False, name: str | None = None):
        """Read the moving meshes of the GLB at `path` as one clip, `clip`. `keep_animation` leaves the file's own
        animation in place, and `name` is the name of the motion. Raise ClipError if the GLB cannot take a motion.
        """
        self.path, self._keep, self._name = os.fspath(path), keep_animation, name
        self.lost: dict[str, list[str]] = {}
        with naming(path, *BROKEN):
            self._file = GltfFile(path)
        try:
            with naming(path, *BROKEN):
                self._json = self._file.json
                self._check()
                clip, self._nodes, self._placement = read_moving(self._file, options)
                first, self._vertex = _twins(clip)
                self.clip = _named(clip if self._vertex is None else _without_twins(clip, first, self._vertex))
                if not np.array_equal(self._placement.space, np.eye(4)):
                    self.clip.metadata = {
                        key: value for key, value in self.clip.metadata.items() if key not in ("unit", "up_axis")
                    }
        except BaseException:
            self._file.close()
            raise

    def _check(self) -> None:
        """Raise ClipError if the file is no GLB with all its bytes inside, or has a motion of the wanted name
        already.
        """
        with open(self.path, "rb") as file:
            if file.read(4) != MAGIC:
                raise ClipError(
                    "into: got glTF as text, expected a GLB: pack it first, for example with gltf-transform copy"
                )
        if any("uri" in buffer for buffer in self._file.items("buffers")):
            raise ClipError("into: got buffers outside the GLB, expected all bytes in it")
        names = motion_names(self._json)
        if self._name in names:
            raise ClipError(f"gltf_motion: got {self._name!r}, which the file has, expected another name")
        self._number = len(names)

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Into:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, path: FilePath, encoded: FilePath) -> None:
        """Write the GLB with the .ath file `encoded`, of the clip `clip`, in it. This can be called once. Raise
        ClipError, OSError.
        """
        with naming(self.path, *BROKEN):
            self._check_unchanged()
            used = used_numbers(self._json)
            binary, ath = Binary(self._file), Path(encoded).read_bytes()
            animations = self._json["animations"]
            self._replace_motion(binary)
            motion = self._motion(binary.add(ath), ath, animations)
            extension = self._json.setdefault("extensions", {}).setdefault(EXTENSION, {})
            extension.setdefault("motions", []).append(motion)
            if EXTENSION not in self._json.setdefault("extensionsUsed", []):
                self._json["extensionsUsed"].append(EXTENSION)
            if _knows_references(self._json):
                prune(self._json, used, self._needless)
            data = binary.packed(self._json)
        with keeping(file_ids(self.path)), new_file(path) as out:
            out.write(glb_bytes(self._json, data))

    def _check_unchanged(self) -> None:
        if not self._file.unchanged():
            raise ClipError("got another file than when it was opened, expected the same")

    def _motion(self, view: int, ath: bytes, animations: list[JsonObject]) -> JsonObject:
        """Return the entry of ATH_motion for the bytes `ath`, stored in the view numbered `view`. Each clip states when
        it begins, which is the first key of its animation, and the extras of that animation.
        """
        extras = {animation.get("name"): animation.get("extras") for animation in animations}
        clips = []
        with AthFile(io.BytesIO(ath)) as file:
            for clip, name, start in zip(file.clips, split(self.clip), self._placement.starts):
                more = {"start": start, "extras": extras.get(name)}
                clips.append({"name": clip.name} | {key: value for key, value in more.items() if value})
        clips = [clip for clip in clips if len(clip) > 1]
        named = {} if self._name is None else {"name": self._name}
        return named | {"bufferView": view} | ({"clips": clips} if clips else {})

    # ---- meshes and nodes ----

    def _replace_motion(self, binary: Binary) -> None:
        """Remove what moved the meshes before, unless it is to be kept, and let ATH_motion move their primitives
        instead.
        """
        gltf, moving = self._json, {node.index for node in self._nodes}
        bound = {}
        for index in sorted(moving):
            node = gltf["nodes"][index]
            mesh = gltf["meshes"][node["mesh"]]
            is_shared = sum(other.get("mesh") == node["mesh"] for other in gltf["nodes"]) > 1
            if is_shared:  # others go on showing it as it is
                bound[index] = mesh = copy.deepcopy(mesh)
                gltf["meshes"].append(mesh)
                node["mesh"] = len(gltf["meshes"]) - 1
            if not self._keep:
                mesh.pop("weights", None)
                mesh.get("extras", {}).pop("targetNames", None)  # By custom this member names morph targets.
                for key in ("weights", "skin"):
                    node.pop(key, None)
        for part in self._nodes:
            self._replace_part(part, bound.get(part.index), binary)
        if self._keep:
            self._needless: set[int] = set()
            return
        meshes = {gltf["nodes"][index]["mesh"] for index in moving}
        for index in sorted(moving):
            if not self._placement.stays(index):
                self._move_mesh(index)
        freed = moving | {joint for node in self._nodes for joint in node.joints}
        self._needless = _needless_nodes(gltf, freed)
        _drop_channels(gltf, moving, meshes, self._needless)

    def _replace_part(self, part: GltfNode, mesh: JsonObject | None, binary: Binary) -> None:
        """Let ATH_motion move the primitives of one mesh, with attributes that fit the motion's space. `mesh` is the
        copy of the mesh, if other nodes show the original.
        """
        primitives = part.primitives
        if mesh is not None:
            originals = self._json["meshes"][part.mesh]["primitives"]
            primitives = [
                mesh["primitives"][number]
                for number, one in enumerate(originals)
                if any(one is reached for reached in primitives)
            ]
        faces = [self._faces(part, primitive) for primitive in primitives]
        attributes = self._attributes(part, binary)
        if self._keep and ("POSITION" in attributes or not self._placement.stays(part.index)):
            raise ClipError(
                f"mesh {part.name!r}: got one that lies elsewhere than its motion, expected no animation to keep"
            )
        for primitive, rows in zip(primitives, faces):
            if not self._keep:
                primitive.pop("targets", None)
                if part.mirrored.any() and len(rows):
                    primitive |= _drawn(binary, rows)
            kept = {
                key: value
                for key, value in primitive["attributes"].items()
                if self._keep or not key.startswith(("JOINTS_", "WEIGHTS_"))
            }
            primitive["attributes"] = kept | {
                key: value for key, value in attributes.items() if key in kept or key == VERTEX_ATTRIBUTE
            }
            content = {"motion": self._number} | (
                {"firstVertex": part.first} if part.first and self._vertex is None else {}
            )
            primitive.setdefault("extensions", {})[EXTENSION] = content
        shown = self._json["meshes"][part.mesh] if mesh is None else mesh
        self._dress(part, shown["primitives"], list(zip(primitives, faces)), binary)

    def _faces(self, part: GltfNode, primitive: JsonObject) -> np.ndarray:
        """Return the triangles of a primitive, (F, 3), as they are to face in the motion's space."""
        rows = triangles(self._file, primitive, part.count)
        return rows[:, ::-1] if part.mirrored.any() and not self._keep else rows

    def _dress(
        self, part: GltfNode, siblings: list[JsonObject], drawn: list[tuple[JsonObject, np.ndarray]], binary: Binary
    ) -> None:
        """Give a material to primitives that have none, and normals where they lack them. `drawn` has each primitive
        with its triangles, and `siblings` all primitives of the mesh, to which further ones are added.
        """
        if all("material" in primitive for primitive, _ in drawn):
            return
        faces = np.concatenate([rows for _, rows in drawn])
        rest = self.clip.source_rest[self._vertices(part)]
        surface = Surface(np.full(len(faces), 3), faces.ravel(), rest)
        looks, normals, first = looks_of_mesh(surface, part.name), None, 0
        for primitive, rows in drawn:
            first += len(rows)
            if "material" in primitive:
                continue
            has_colours = COLOUR in primitive["attributes"]
            if not len(rows):
                primitive["material"] = self._material(line_look(part.name), has_colours)
                continue
            if NORMAL not in primitive["attributes"] and not primitive.get("targets"):
                if normals is None:
                    normals = binary.attribute(surface.unit_normals(rest))
                primitive["attributes"][NORMAL] = normals
            groups = by_material(rows, looks.labels[first - len(rows) : first])
            further = [copy.deepcopy(primitive) for _ in groups[1:]]
            siblings += further  # at the end, so that the others keep their places
            for each, (label, material) in zip([primitive, *further], groups):
                each["material"] = self._material(looks.materials[label], has_colours)
                each |= _drawn(binary, material) if further else {}

    def _material(self, look: Look, has_colours: bool) -> int:
        """Return the number of a material, which is added where the file has not got it."""
        materials, material = self._json.setdefault("materials", []), material_of(look, has_colours)
        if material not in materials:
            materials.append(material)
            used = self._json.setdefault("extensionsUsed", []) if not look.is_lit else [UNLIT]
            used += [] if UNLIT in used else [UNLIT]
        return materials.index(material)

    def _attributes(self, part: GltfNode, binary: Binary) -> dict[str, int]:
        """Store the attributes of a part that change, and return the numbers of the new accessors by their semantic."""
        accessors = {}
        rest = self.clip.source_rest[self._vertices(part)]
        positions = part.attributes["POSITION"]
        stored = self._file.array(positions)
        if stored.dtype != np.float32 or not np.array_equal(stored.view("<u4"), rest.view("<u4")):
            accessors["POSITION"] = binary.attribute(rest, bounds=True)
            for key in ("NORMAL", "TANGENT"):
                if key in part.attributes:
                    values = self._file.floats(part.attributes[key]).astype(np.float32)
                    values[:, :3] = self._placement.turned(part, values[:, :3], key == "NORMAL")
                    accessors[key] = binary.attribute(values)
        if self._vertex is not None:
            dtype = np.uint16 if self.clip.vertex_count <= 1 << 16 else np.float32
            accessors[VERTEX_ATTRIBUTE] = binary.attribute(self._vertices(part)[:, None].astype(dtype))
        return accessors

    def _vertices(self, part: GltfNode) -> np.ndarray:
        return np.arange(part.first, part.first + part.count) if self._vertex is None else self._vertex[part.vertices]

    def _move_mesh(self, index: int) -> None:
        """Move the mesh of the node numbered `index` to a new node of the scene, in the motion's space."""
        gltf, node = self._json, self._json["nodes"][index]
        matrix = self._placement.space
        if not self._placement.is_always_shown(index):
            self.lost.setdefault("visibility in time", []).append(node.get("name") or f"node {index}")
        child = {"mesh": node.pop("mesh")} | ({"name": node["name"]} if "name" in node else {})
        if not np.array_equal(matrix, np.eye(4)):
            child["matrix"] = matrix.T.ravel().tolist()
        gltf["nodes"].append(child)
        scene = gltf["scenes"][gltf.get("scene", 0)] if gltf.get("scenes") else None
        if scene is not None:
            scene.setdefault("nodes", []).append(len(gltf["nodes"]) - 1)


def _drawn(binary: Binary, faces: np.ndarray) -> dict[str, int]:
    """Return the members of a primitive that draws these triangles, (F, 3)."""
    return {"indices": binary.array(faces.reshape(-1, 1).astype(np.uint32), INDICES), "mode": 4}


def _named(clip: MotionClip) -> MotionClip:
    """Return the clip under the name of its animation if it has a single one."""
    played = clip.metadata.get("animations", [])
    if clip.clip_ranges[1:] or len(played) != 1:
        return clip
    is_loop = bool(clip.clip_ranges and clip.clip_ranges[0].loop)
    return clip.replace(clip_ranges=(ClipRange(played[0], clip.frame_count, is_loop),))


def write_back(path: FilePath, views: Sequence[ClipView], out: FilePath) -> None:
    """Write the GLB `path` to `out` with a morph target per frame in place of the motions of ATH_motion that `views`
    show.

    Raise ClipError if there are more targets than glTF can sensibly hold, OSError if a file cannot be read or written.
    """
    with naming(path, *BROKEN), closing(GltfFile(path)) as file:
        gltf, used, binary, needless = file.json, used_numbers(file.json), Binary(file), set[int]()
        numbers = [view.decoder.file.source.number for view in views]
        places_of_views = [places_of(file, number) for number in numbers]
        for view, places in zip(views, places_of_views):
            check_morphs(view, sum(len(vertices) * (1 + _has_normals(primitive)) for primitive, vertices in places))
        for number, view, places in zip(numbers, views, places_of_views):
            clips = {clip["name"]: clip for clip in gltf["extensions"][EXTENSION]["motions"][number].get("clips", ())}
            _add_targets(file, binary, places, view)
            needless |= _morph_nodes(gltf, binary, places, view, clips)
            for primitive, _ in places:
                _pop_extension(primitive)
        _remove_motions(gltf, set(numbers))
        if _knows_references(gltf):
            prune(gltf, used, needless)
        data = binary.packed(gltf)
    with keeping(file_ids(path)), new_file(out) as written:
        written.write(glb_bytes(gltf, data))


def _remove_motions(gltf: JsonObject, numbers: set[int]) -> None:
    """Remove the motions `numbers` from the file, and the extension with the last motion. Primitives that remaining
    motions move get the new numbers.
    """
    extension = gltf["extensions"][EXTENSION]
    kept = [number for number in range(len(extension["motions"])) if number not in numbers]
    if not kept:
        _pop_extension(gltf)
        gltf["extensionsUsed"].remove(EXTENSION)
        if not gltf["extensionsUsed"]:
            del gltf["extensionsUsed"]
        return
    extension["motions"] = [extension["motions"][number] for number in kept]
    for primitive in (primitive for mesh in gltf["meshes"] for primitive in mesh["primitives"]):
        reference = extension_of(primitive)
        if reference is not None:
            reference["motion"] = kept.index(reference["motion"])


def put_motion(path: FilePath, ath: bytes, out: FilePath, number: int) -> int:
    """Write the GLB `path` to `out` with the bytes `ath` in place of those of its motion `number`, which must be as
    many or more. Return the size of the new file.

    Raise ClipError if `path` is no GLB that holds the motion inside, OSError if a file cannot be read or written.
    """
    with naming(path, *BROKEN), closing(GltfFile(path)) as file:
        motion = entries(extension_of(file.json) or {}, "motions")[number]
        _, start, _ = file.part(motion, "bufferView")
        view, binary = file.json["bufferViews"][motion["bufferView"]], Binary(file)
        if view["buffer"] != 0 or "uri" in file.json["buffers"][0]:
            raise ClipError(f"{EXTENSION}: got a motion outside the GLB, expected it inside")
        view["byteLength"] = len(ath)
        binary.put(start, ath)
        data = binary.packed(file.json)
    with new_file(out) as written:
        written.write(glb_bytes(file.json, data))
        return written.tell()


def _has_normals(primitive: JsonObject) -> bool:
    return NORMAL in primitive["attributes"]


def _add_targets(file: GltfFile, binary: Binary, places: list[GltfPlace], motion: ClipView) -> None:
    """Add a morph target per frame to each primitive that moves, and as many targets without effect to the other
    primitives of its mesh.
    """
    gltf, rest = file.json, np.asarray(motion.rest).astype(np.float32)
    counts, corners = motion.polygons or (np.empty(0, np.int64), np.empty(0, np.int64))
    normals, at_rest = MovingNormals(Surface(counts, corners, rest), rest), {}
    for primitive, _ in places:
        primitive["targets"] = []
        primitive["attributes"].pop(VERTEX_ATTRIBUTE, None)
        if _has_normals(primitive):
            at_rest[id(primitive)] = file.floats(primitive["attributes"][NORMAL])
    for _, frames in motion.blocks():
        for frame in frames:
            offsets = (frame.astype(np.float64) - rest).astype(np.float32)
            normals.move(frame)
            for primitive, vertices in places:
                target = {"POSITION": binary.attribute(offsets[vertices], bounds=True)}
                if id(primitive) in at_rest:
                    target[NORMAL] = binary.attribute(normals.offsets(at_rest[id(primitive)], vertices))
                primitive["targets"].append(target)
    moved = {id(primitive) for primitive, _ in places}
    for mesh in gltf["meshes"]:
        if moved.isdisjoint(map(id, mesh["primitives"])):
            continue
        mesh.pop("weights", None)
        for primitive in mesh["primitives"]:
            if id(primitive) not in moved:
                count = gltf["accessors"][primitive["attributes"]["POSITION"]]["count"]
                still = {"componentType": 5126, "count": count, "type": "VEC3", "min": [0.0] * 3, "max": [0.0] * 3}
                gltf["accessors"].append(still)
                primitive["targets"] = [{"POSITION": len(gltf["accessors"]) - 1}] * motion.frame_count


def _morph_nodes(
    gltf: JsonObject, binary: Binary, places: list[GltfPlace], motion: ClipView, stated: dict[str, JsonObject]
) -> set[int]:
    """Animate the weights of the nodes whose meshes move, with one animation per clip, and remove what moved these
    meshes before. `stated` has what the file says of each clip, by name. Return the numbers of nodes that are no longer
    needed.
    """
    moved = {id(primitive) for primitive, _ in places}
    moving = {
        index
        for index, node in enumerate(gltf["nodes"])
        if "mesh" in node and not moved.isdisjoint(map(id, gltf["meshes"][node["mesh"]]["primitives"]))
    }
    skins = [gltf["nodes"][index].pop("skin") for index in moving if "skin" in gltf["nodes"][index]]
    for index in moving:
        gltf["nodes"][index].pop("weights", None)
    needless = _needless_nodes(gltf, moving | {joint for skin in skins for joint in gltf["skins"][skin]["joints"]})
    _drop_channels(gltf, moving, {gltf["nodes"][index]["mesh"] for index in moving}, needless)
    weights = np.eye(motion.frame_count, dtype=np.float32)
    for take, clip_range in zip(takes(motion), motion.clip_ranges):
        entry = stated.get(clip_range.name, {})
        times = (take.times + entry.get("start", 0.0)).astype(np.float32)
        sampler = {"input": binary.array(times[:, None]), "output": binary.array(take.of(weights).reshape(-1, 1))}
        _animate(gltf, take.name, take.extras | entry.get("extras", {}), sampler, sorted(moving))
    return needless


def _animate(gltf: JsonObject, name: str, extras: JsonObject, sampler: dict[str, int], nodes: list[int]) -> None:
    """Add a sampler, and channels by which it sets the weights of `nodes`, to the animation `name`. If there is no such
    animation, it is made with `extras`.
    """
    every = gltf.setdefault("animations", [])
    animation = next((one for one in every if one.get("name") == name), None)
    if animation is None:
        animation = {"name": name, "samplers": [], "channels": []}
        if extras:
            animation["extras"] = extras
        every.append(animation)
    animation["samplers"].append(sampler)
    number = len(animation["samplers"]) - 1
    animation["channels"] += [{"sampler": number, "target": {"node": node, "path": "weights"}} for node in nodes]


def _pop_extension(holder: JsonObject) -> None:
    holder["extensions"].pop(EXTENSION)
    if not holder["extensions"]:
        del holder["extensions"]


def _twins(clip: MotionClip) -> tuple[np.ndarray, np.ndarray | None]:
    """Find vertices that coincide in all frames. Return the first vertex of each set, and the number of its set for
    each vertex; None instead of the latter if few vertices coincide.
    """
    everyone = np.arange(clip.vertex_count)
    kind = _kinds(np.zeros(clip.vertex_count, np.int64), clip.source_rest)
    for _, block in clip.blocks():
        if _few_twins(kind):
            return everyone, None
        first = np.unique(kind, return_index=True)[1]
        if not np.array_equal(block, block[:, first[kind]]):
            for frame in block:
                kind = _kinds(kind, frame)
    if _few_twins(kind):
        return everyone, None
    first = np.unique(kind, return_index=True)[1]
    order = np.argsort(first)
    place = np.empty(len(first), np.int64)
    place[order] = np.arange(len(first))
    return first[order], place[kind]


def _few_twins(kind: np.ndarray) -> bool:
    return len(kind) - int(kind.max()) - 1 < SHARE_OF_TWINS * len(kind)


def _kinds(kind: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return numbers (N,) that are equal where both `kind` (N,) and position (N, 3) are."""
    table = np.concatenate([kind[:, None], positions.astype(np.float32).view("<i4").astype(np.int64)], axis=1)
    rows = np.ascontiguousarray(table).view(f"V{table.dtype.itemsize * table.shape[1]}").ravel()
    return np.unique(rows, return_inverse=True)[1].ravel()


def _without_twins(clip: MotionClip, first: np.ndarray, vertex: np.ndarray) -> MotionClip:
    """Return the clip with one vertex in place of each set of coinciding vertices. `first` lists the vertices to keep,
    and `vertex` has the new number of each vertex.
    """
    source = clip.positions
    skin = clip.skin and clip.skin.__class__(clip.skin.joint_parent, clip.skin.vertex_joint[first], clip.skin.names)
    return clip.replace(
        positions=Frames(lambda start, stop: np.asarray(source[start:stop])[:, first], clip.frame_count, len(first)),
        rest=clip.source_rest[first],
        rest_given=True,
        faces=None if clip.faces is None else vertex[clip.faces].astype(np.int32),
        edges=None if clip.edges is None else vertex[clip.edges].astype(np.int32),
        attributes={},
        skin=skin,
        vertex_branch=None,
        branch_parent=None,
        stem_index=None,
    )


def _drop_channels(gltf: JsonObject, moving: set[int], meshes: set[int], needless: set[int]) -> None:
    """Remove animation channels: those of the weights of the nodes `moving` and of `meshes`, and all channels of the
    nodes `needless`.
    """

    def stays(target: Target | str) -> bool:
        if isinstance(target, str):
            return True
        if target.holder == "meshes":
            return target.entry not in meshes
        return target.entry not in needless and not (target.path == "weights" and target.entry in moving)

    kept = []
    for animation in gltf.get("animations", []):
        channels = [channel for channel in animation["channels"] if stays(target_of(channel))]
        samplers = sorted({channel["sampler"] for channel in channels})
        animation["samplers"] = [animation["samplers"][sampler] for sampler in samplers]
        for channel in channels:
            channel["sampler"] = samplers.index(channel["sampler"])
        if channels:
            kept.append(animation | {"channels": channels})
    gltf.pop("animations", None)
    if kept:
        gltf["animations"] = kept
    if not any(_has_pointer(channel) for animation in kept for channel in animation["channels"]):
        for key in ("extensionsUsed", "extensionsRequired"):
            if POINTER in gltf.get(key, ()):
                gltf[key].remove(POINTER)
                if not gltf[key]:
                    del gltf[key]


def _has_pointer(channel: JsonObject) -> bool:
    return POINTER in (channel["target"].get("extensions") or {})


def _knows_references(gltf: JsonObject) -> bool:
    """Return whether _references lists every index of the file: not where pointers to places in it remain, which are
    text."""
    return all(name.startswith(KNOWN) and name != POINTER for name in gltf.get("extensionsUsed", ()))


def _needless_nodes(gltf: JsonObject, freed: set[int]) -> set[int]:
    """Return the nodes that can be removed once vertices move by themselves: of the nodes `freed`, their ancestors and
    descendants, those that show nothing, that no skin uses, and that have no node below that stays.
    """
    nodes = gltf["nodes"]
    parent = {child: index for index, node in enumerate(nodes) for child in node.get("children", ())}
    related = set(freed)
    for index in freed:
        related.update(_above(index, parent))
    related |= {index for index in range(len(nodes)) if not freed.isdisjoint(_above(index, parent))}
    skins = {node["skin"] for node in nodes if "skin" in node}
    joints = {joint for number in skins for joint in gltf["skins"][number]["joints"]}
    stays = {
        index
        for index, node in enumerate(nodes)
        if index not in related or index in joints or node.keys() & {"mesh", "camera", "extensions", "extras"}
    }
    for index in list(stays):
        stays.update(_above(index, parent))
    return set(range(len(nodes))) - stays


def _above(index: int, parent: dict[int, int]) -> list[int]:
    nodes = []
    while index in parent:
        index = parent[index]
        nodes.append(index)
    return nodes


# ---- what is needed no more ----
