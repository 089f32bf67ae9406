"""Names what a glTF file holds besides the motion that is read of it (gltf.py), by its kind, for the clip's `not_read`.

Every list of the file is looked through: extensions that are not known here, extras and channels of animations that
move nothing are named, too, because a reader cannot know what they mean to the one who wrote them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from athcodec.files.gltf.document import MESHOPT, GltfFile
from athcodec.files.gltf.json import entries, entry, extension
from athcodec.files.gltf.motion import EXTENSION
from athcodec.sources.gltf_scene import BONES, COPIES, NODE_VISIBILITY, POINTED, POINTER, Scene
from athcodec.sources.scene_objects import FLIPPED, GUESSED, OWN
from athcodec.untyped import JsonObject, JsonValue

if TYPE_CHECKING:
    from athcodec.sources.gltf_nodes import GltfNode

INSTANCING, LIGHTS, VARIANTS = "EXT_mesh_gpu_instancing", "KHR_lights_punctual", "KHR_materials_variants"
INSTANCE_PARTS = {"TRANSLATION": 3, "ROTATION": 4, "SCALE": 3}
READ = (POINTER, NODE_VISIBILITY, EXTENSION, INSTANCING, LIGHTS, "KHR_mesh_quantization", *MESHOPT)
OF_MATERIALS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "ADOBE_materials_")
READ_EXTRAS = {  # Members of extras that are read or that athcodec's exporter derives, of the parts that may have them.
    # The nodes turn and scale vertices from "unit" and "up_axis" to glTF's metres and y, which are what is read.
    "asset": frozenset(("fps", "start_frame", "loop", "unit", "up_axis", OWN)),
    "animation": frozenset(("fps", "start_frame", "loop")),
    "node": frozenset((COPIES, BONES)),
}
ARRAYS = ("POSITION", "TEXCOORD_0", "COLOR_0")  # Attributes that are read of every mesh.


def not_read(scenes: Sequence[Scene], nodes: Sequence[GltfNode], keeps_normals: bool = True) -> dict[str, list[str]]:
    """Return what is in the file and is not read with these nodes, as they move in each of these scenes; parts of a
    node by the node's name. keeps_normals: whether normals are read, or were made by athcodec's exporter."""
    scene = scenes[0]
    file, unread = scene.file, _unused(scene)
    for index in scene.order:
        if extension(scene.nodes[index], LIGHTS) is not None:
            _add(unread, "Light", index, scene.nodes[index])
        if scene.nodes[index].get("mesh") is not None and scene.is_hidden(index):
            _add(unread, "hidden", index, scene.nodes[index])
    for node in nodes:
        if node.is_flipped and node.kind == "mesh":
            unread.setdefault(FLIPPED, []).append(node.name)
        for key in _left_attributes(scene, node, keeps_normals):
            unread.setdefault("attribute", []).append(f"{node.name}.{key}")
    for kind, name in _unplayed(scenes):
        unread.setdefault(kind, []).append(name)
    for kind, names in (("extension", _extensions(file)), ("extras", _extras(scene))):
        if names:
            unread[kind] = names
    return unread


def _add(unread: dict[str, list[str]], kind: str, number: int, item: JsonValue) -> None:
    unread.setdefault(kind, []).append(_name(kind.lower(), number, item))


def _name(kind: str, number: int, item: JsonValue) -> str:
    name = item.get("name") if isinstance(item, dict) else None
    return name if isinstance(name, str) and name else f"{kind} {number}"


def guessed(item: JsonValue) -> list[JsonValue]:
    """Return the names of what athcodec's writer has guessed of a part of the file."""
    extras = item.get("extras") if isinstance(item, dict) else None
    entry = extras.get(OWN) if isinstance(extras, dict) else None
    names = entry.get(GUESSED) if isinstance(entry, dict) else None
    return names if isinstance(names, list) else []


def _unused(scene: Scene) -> dict[str, list[str]]:
    """Return what no reader of vertices needs: names of materials, cameras, other scenes, and of meshes and skins that
    no node of the scene refers to, by kind."""
    file, unread = scene.file, dict[str, list[str]]()
    used = {kind: {scene.nodes[index].get(kind) for index in scene.order} for kind in ("mesh", "skin")}
    for kind, items in (("Material", "materials"), ("Camera", "cameras"), ("scene", "scenes")):
        for number, item in enumerate(file.items(items)):
            if "name" not in guessed(item) and (kind != "scene" or number != file.json.get("scene", 0)):
                _add(unread, kind, number, item)
    for kind, items in (("mesh", "meshes"), ("skin", "skins")):
        for number, item in enumerate(file.items(items)):
            if number not in used[kind]:
                unread.setdefault(f"{kind} that no node of the scene has", []).append(_name(kind, number, item))
    return unread


def _left_attributes(scene: Scene, node: GltfNode, keeps_normals: bool) -> list[str]:
    """Return the names of glTF attributes of a node's mesh, morph targets and instances that are not read.
    `keeps_normals` says whether normals are read."""
    slots = 0
    while node.skin is not None and {f"JOINTS_{slots}", f"WEIGHTS_{slots}"} <= node.attributes.keys():
        slots += 1
    read = {*ARRAYS, *(f"{kind}_{slot}" for kind in ("JOINTS", "WEIGHTS") for slot in range(slots))}
    read |= {"NORMAL"} if keeps_normals else set()
    moving = {"POSITION", "NORMAL"} if keeps_normals else {"POSITION"}
    instancing = extension(scene.nodes[node.index], INSTANCING)
    attributes = () if instancing is None else entry(instancing, "attributes")
    targets = (target for primitive in node.primitives for target in entries(primitive, "targets"))
    return [
        *(key for key in node.attributes if key not in read and not key.startswith("_")),
        *dict.fromkeys(f"targets.{key}" for target in targets for key in target if key not in moving),
        *(key for key in attributes if key not in INSTANCE_PARTS and not key.startswith("_")),
    ]


def _unplayed(scenes: Sequence[Scene]) -> Iterator[tuple[str, str]]:
    """Yield (kind, name) for each property that animations address and that is not played. Animations that were left
    out because others were chosen are not looked into."""
    first = scenes[0]
    played = {index for scene in scenes for index in scene.played}
    for index, animation in enumerate(first.file.items("animations")):
        if index in played or not first.targets(index):
            for pointer in dict.fromkeys(first.unplayed(index)):
                may_move = pointer.startswith(("/nodes/", "/meshes/")) and not any(
                    pattern.fullmatch(pointer) for pattern in POINTED
                )
                kind = "animation channel" if may_move else "animated property"
                yield kind, f"{_name('animation', index, animation)}: {pointer}"


def _parts(file: GltfFile) -> Iterator[tuple[str, int, JsonObject]]:
    """Yield (kind, number, JSON object) of every part of the file that may have extensions or extras, except
    materials."""
    yield "file", 0, file.json
    yield "asset", 0, entry(file.json, "asset")
    for kind in ("scene", "node", "skin", "animation", "camera", "accessor", "bufferView", "buffer"):
        for number, item in enumerate(file.items(f"{kind}s")):
            yield kind, number, item
    for number, mesh in enumerate(file.items("meshes")):
        yield "mesh", number, mesh
        for primitive in entries(mesh, "primitives"):
            yield "mesh", number, {"name": mesh.get("name")} | primitive


def _extensions(file: GltfFile) -> list[str]:
    """Return names of extensions that the file uses and that are not read; those of materials are part of these."""
    used = file.json.get("extensionsUsed")
    names = dict.fromkeys(name for name in (used if isinstance(used, list) else ()) if isinstance(name, str))
    for _, _, part in _parts(file):
        if isinstance(extensions := part.get("extensions"), dict):
            names |= dict.fromkeys(extensions)
    return [name for name in names if name not in READ and (name == VARIANTS or not name.startswith(OF_MATERIALS))]


def _extras(scene: Scene) -> list[str]:
    """Return the names of the file's parts whose `extras` are not read."""
    names = []
    for kind, number, part in _parts(scene.file):
        extras = part.get("extras")
        if kind == "node" and scene.says_copies(int(scene.parent[number])) is not None:
            continue  # They are attributes of a copy.
        if extras is not None and (not isinstance(extras, dict) or extras.keys() - READ_EXTRAS.get(kind, frozenset())):
            names.append(f"{kind} {_name('', number, part).strip()}")
    return list(dict.fromkeys(names))
