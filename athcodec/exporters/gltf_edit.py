"""Edits a GLB: appends binary data, and removes what nothing refers to any more."""

from __future__ import annotations

import copy
import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters.gltf_build import COMPONENTS, TYPES, VERTICES
from athcodec.files.gltf.document import MESHOPT, GltfFile
from athcodec.files.gltf.motion import MAGIC, extension_of
from athcodec.untyped import JsonObject, JsonValue

ALIGNMENT = 8  # Bytes to which the parts of the remaining buffer are aligned.
INSTANCES = "EXT_mesh_gpu_instancing"
DRACO = "KHR_draco_mesh_compression"
Reference = tuple[str, JsonValue, JsonValue]


def _references(gltf: JsonObject) -> Iterator[Reference]:
    """Yield every index by which entries of the file's arrays refer to each other, except from meshes, animations and
    what these alone need.
    """
    for scene in gltf.get("scenes", ()):
        yield from _each("nodes", scene, "nodes")
    for node in gltf.get("nodes", ()):
        yield from _each("nodes", node, "children")
        yield from _entry("skins", node, "skin")
        if INSTANCES in (node.get("extensions") or {}):
            yield from _all("accessors", node["extensions"][INSTANCES]["attributes"])
    for skin in gltf.get("skins", ()):
        yield from _each("nodes", skin, "joints")
        yield from _entry("nodes", skin, "skeleton")
        yield from _entry("accessors", skin, "inverseBindMatrices")
    for animation in gltf.get("animations", ()):
        for channel in animation["channels"]:
            yield from _entry("nodes", channel["target"], "node")
        for sampler in animation["samplers"]:
            yield from _all("accessors", sampler, ("input", "output"))
    for mesh in gltf.get("meshes", ()):
        for primitive in mesh["primitives"]:
            yield from _all("accessors", primitive["attributes"])
            yield from _entry("accessors", primitive, "indices")
            for target in primitive.get("targets", ()):
                yield from _all("accessors", target)
            if DRACO in (primitive.get("extensions") or {}):
                yield from _entry("bufferViews", primitive["extensions"][DRACO], "bufferView")
    for accessor in gltf.get("accessors", ()):
        yield from _entry("bufferViews", accessor, "bufferView")
        for part in ("indices", "values") if "sparse" in accessor else ():
            yield from _entry("bufferViews", accessor["sparse"][part], "bufferView")
    for image in gltf.get("images", ()):
        yield from _entry("bufferViews", image, "bufferView")
    for motion in (extension_of(gltf) or {}).get("motions", ()):
        yield from _entry("bufferViews", motion, "bufferView")


def _entry(kind: str, holder: JsonObject, key: str) -> Iterator[Reference]:
    """Yield the reference that an object holds under a key, if it has one."""
    if key in holder:
        yield kind, holder, key


def _all(kind: str, holder: JsonObject, keys: Any = None) -> Iterator[Reference]:
    for key in list(holder) if keys is None else keys:
        yield from _entry(kind, holder, key)


def _each(kind: str, holder: JsonObject, key: str) -> Iterator[Reference]:
    for place in range(len(holder.get(key, ()))):
        yield kind, holder[key], place


def used_numbers(gltf: JsonObject) -> dict[str, set[int]]:
    """Return which entries of each array are referred to."""
    numbers: dict[str, set[int]] = {kind: set() for kind in ("nodes", "skins", "accessors", "bufferViews")}
    for kind, holder, key in _references(gltf):
        numbers[kind].add(holder[key])
    return numbers


def prune(gltf: JsonObject, before: dict[str, set[int]], needless: set[int]) -> None:
    """Remove the nodes `needless` from the JSON, and every entry that was referred to `before` and is not any more.
    `before` has the numbers of such entries by the name of their array.
    """
    _remove(gltf, "skins", before["skins"] - used_numbers(gltf)["skins"])
    for holder, key in [(scene, "nodes") for scene in gltf.get("scenes", ())] + [
        (node, "children") for node in gltf["nodes"]
    ]:
        if not needless.isdisjoint(holder.get(key, ())):
            holder[key] = [node for node in holder[key] if node not in needless]
            if not holder[key]:
                del holder[key]
    _remove(gltf, "nodes", needless)
    for kind in ("accessors", "bufferViews"):
        _remove(gltf, kind, before[kind] - used_numbers(gltf)[kind])


def _remove(gltf: JsonObject, kind: str, dead: set[int]) -> None:
    """Remove the entries numbered `dead` of the array `kind`, to which nothing refers any more. The other entries get
    new numbers, and references follow.
    """
    if not dead:
        return
    place = np.cumsum([index not in dead for index in range(len(gltf[kind]))]) - 1
    gltf[kind] = [item for index, item in enumerate(gltf[kind]) if index not in dead]
    for kind_of, holder, key in _references(gltf):
        if kind_of == kind:
            holder[key] = int(place[holder[key]])
    if not gltf[kind]:
        del gltf[kind]


class Binary:
    """The binary chunk: its bytes so far, and what is added."""

    def __init__(self, file: GltfFile):
        self._json, self._added = file.json, bytearray()
        self._old = file.binary_chunk()
        self._start = len(self._old) + -len(self._old) % 4
        self._views_before = copy.deepcopy(self._json.get("bufferViews", []))

    def add(self, data: bytes, **view: Any) -> int:
        """Return a buffer view of these bytes."""
        self._json.setdefault("bufferViews", []).append(
            {"buffer": 0, "byteOffset": self._start + len(self._added), "byteLength": len(data)} | view
        )
        self._added += data + bytes(-len(data) % 4)
        return len(self._json["bufferViews"]) - 1

    def put(self, start: int, data: bytes) -> None:
        """Replace as many bytes by these."""
        self._old = self._old[:start] + data + self._old[start + len(data) :]

    def attribute(self, values: np.ndarray, bounds: bool = False) -> int:
        """Store values (count, width) of vertices, each padded to whole words of four bytes, and return the number of
        their accessor. `bounds` also states their least and largest values.
        """
        width, item = values.shape[1], values.itemsize * values.shape[1]
        padded = np.zeros((len(values), item + -item % 4), np.uint8)
        padded[:, :item] = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), item)
        stride = {"byteStride": padded.shape[1]} if padded.shape[1] != item else {}
        accessor = {
            "bufferView": self.add(padded.tobytes(), target=VERTICES, **stride),
            "componentType": COMPONENTS[values.dtype.name],
            "count": len(values),
            "type": TYPES[width],
        }
        if bounds:
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self._json.setdefault("accessors", []).append(accessor)
        return len(self._json["accessors"]) - 1

    def array(self, values: np.ndarray, target: int | None = None) -> int:
        """Return an accessor of (count, 1) numbers without gaps, with its bounds."""
        index = self.attribute(values, bounds=True)
        view = self._json["bufferViews"][self._json["accessors"][index]["bufferView"]]
        del view["target"]
        view |= {} if target is None else {"target": target}
        return index

    def packed(self, gltf: JsonObject) -> bytes:
        """Return the file's binary data without the bytes that only removed views had. The offsets of the remaining
        views are changed to match.
        """
        data = bytes(self._old).ljust(self._start, b"\0") + bytes(self._added)
        needless = np.zeros(len(data) + 1, bool)
        for holder in _byte_ranges(self._views_before):
            needless[holder.get("byteOffset", 0) :][: holder["byteLength"]] = True
        kept = list(_byte_ranges(gltf["bufferViews"]))
        for holder in kept:
            needless[holder.get("byteOffset", 0) :][: holder["byteLength"]] = False
        edges = np.flatnonzero(np.diff(needless, prepend=False)).reshape(-1, 2)
        starts, stops = edges[:, 0] + -edges[:, 0] % ALIGNMENT, edges[:, 1] // ALIGNMENT * ALIGNMENT
        gaps = [(start, stop) for start, stop in zip(starts.tolist(), stops.tolist()) if stop > start]
        ends, removed = np.array([stop for _, stop in gaps]), np.cumsum([0] + [stop - start for start, stop in gaps])
        for holder in kept:
            offset = holder.get("byteOffset", 0)
            if offset or gaps:
                holder["byteOffset"] = int(offset - removed[np.searchsorted(ends, offset, "right")])
        pieces = zip([0] + [stop for _, stop in gaps], [start for start, _ in gaps] + [len(data)])
        return b"".join(data[start:stop] for start, stop in pieces)


def _byte_ranges(views: list[JsonObject]) -> Iterator[JsonObject]:
    """Return the entries with byteOffset and byteLength in the binary chunk: views, and what decompresses to them."""
    for view in views:
        for holder in (view, *((view.get("extensions") or {}).get(name) for name in MESHOPT)):
            if holder is not None and holder["buffer"] == 0:
                yield holder


def glb_bytes(gltf: JsonObject, data: bytes) -> bytes:
    """Return a GLB of the JSON `gltf` and the binary `data`. Raise ClipError if it would have 4 GiB or more."""
    gltf.setdefault("buffers", [{}])[0]["byteLength"] = len(data)
    data = data + bytes(-len(data) % 4)
    text = json.dumps(gltf, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()
    text += b" " * (-len(text) % 4)
    size = 28 + len(text) + len(data)
    if size >= 1 << 32:
        raise ClipError(f"GLB: got {size} bytes, expected less than 4 GiB")
    head = struct.pack("<4sII", MAGIC, 2, size) + struct.pack("<II", len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(data), 0x004E4942) + data
