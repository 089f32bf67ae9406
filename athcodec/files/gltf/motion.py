"""ATH_motion in a GLB: where the .ath file lies, and the rest pose and faces that the meshes around it give it.

The extension is described in spec/gltf/README.md. Its motions are the bytes of buffer views; a primitive names one and
says which vertices of it its own are.
"""

from __future__ import annotations

import os
from contextlib import closing
from functools import cached_property

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.gltf.document import GltfFile
from athcodec.files.gltf.json import BROKEN, brief, entries, entry, extension, integer
from athcodec.files.gltf.primitives import triangles
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import closing_on_failure, naming
from athcodec.untyped import JsonObject

EXTENSION = "ATH_motion"
VERTEX_ATTRIBUTE = "_ATH_VERTEX"
MAGIC = b"glTF"
GltfPlace = tuple[JsonObject, np.ndarray]
"""A primitive, and the motion's vertex of each of its vertices."""


def extension_of(holder: JsonObject) -> JsonObject | None:
    """Return the extension object of a part of the file, or None. Raises ClipError."""
    return extension(holder, EXTENSION)


def motion_names(gltf: JsonObject) -> list[str]:
    """Return the names of a file's motions, which differ. Raises ClipError."""
    names: list[str] = []
    for number, motion in enumerate(entries(extension_of(gltf) or {}, "motions")):
        stated = motion.get("name")
        name = stated if isinstance(stated, str) and stated else f"motion {number}"
        names.append(f"{name}.{number}" if name in names else name)
    return names


def motions_in(path: FilePath) -> list[str]:
    """Return the names of the motions in a GLB; none for another file. Raises ClipError, OSError."""
    with open_plain(path) as file:
        if file.read(4) != MAGIC:
            return []
    with naming(path, *BROKEN), closing(GltfFile(path)) as gltf:
        return motion_names(gltf.json)


class GltfMotion:
    """An .ath file in a GLB, by its name where there are several, as a file object to read; close it. Raises ClipError.

    `number` is its place among the motions; host_mesh (N, 3) float32 the rest pose, faces (F, 3) int32 or None.
    """

    def __init__(self, path: FilePath, name: str | None = None):
        """Open the motion called `name` in the GLB `path`; without a name, the only motion. Raises ClipError,
        OSError."""
        self.path = os.fspath(path)
        with naming(path, *BROKEN):
            self._gltf = GltfFile(path)
            with closing_on_failure(self._gltf):
                self.number = self._chosen(name)
                motion = entries(extension_of(self._gltf.json) or {}, "motions")[self.number]
                self._bytes, self._start, self._size = self._gltf.part(motion, "bufferView")
        self._place = 0

    def _chosen(self, name: str | None) -> int:
        """Return the number of the motion called `name` or, if it is None, of the only motion in the GLB. Raises
        ClipError."""
        names = motion_names(self._gltf.json)
        if not names:
            raise ClipError(
                f"{EXTENSION}: got a GLB without a motion, expected one at least",
                python="athcodec.encode makes an .ath file of its animation",
                shell="`athcodec encode` makes an .ath file of its animation, with --into a GLB that holds the motion",
            )
        if name is None and len(names) > 1:
            raise ClipError(
                f"{EXTENSION}: got {len(names)} motions, expected the name of one (gltf_motion): {brief(names)}"
            )
        if name is not None and name not in names:
            raise ClipError(f"gltf_motion: got {brief(name)}, expected one of {brief(names)}")
        return 0 if name is None else names.index(name)

    # ---- the bytes ----

    def seek(self, place: int, whence: int = os.SEEK_SET) -> int:
        self._place = max(place + (0, self._place, self._size)[whence], 0)
        return self._place

    def tell(self) -> int:
        return self._place

    def read(self, size: int = -1) -> bytes:
        left = max(self._size - self._place, 0)
        size = left if size < 0 else min(size, left)
        data: bytes = self._bytes.read(self._start + self._place, size) if size else b""
        self._place += len(data)
        return data

    def close(self) -> None:
        self._gltf.close()

    # ---- the meshes ----

    @cached_property
    def _places(self) -> list[GltfPlace]:
        places = places_of(self._gltf, self.number)
        if not places:
            raise ClipError(f"{EXTENSION}: got no primitive that a motion moves, expected at least one")
        return places

    @cached_property
    def host_mesh(self) -> np.ndarray:
        with naming(self.path, *BROKEN):
            return self._rest()

    def _rest(self) -> np.ndarray:
        """Return the rest pose (N, 3) float32 of the motion's N vertices, from the GLB's primitives that it moves.
        Raises ClipError if a vertex has no position or two different ones."""
        total = sum(len(vertices) for _, vertices in self._places)
        count = 1 + max(int(vertices.max()) for _, vertices in self._places)
        if count > total:
            raise ClipError(
                f"{EXTENSION}: got vertex {count - 1} of {total} in all primitives, expected each one there"
            )
        rest, seen = np.empty((count, 3), np.float32), np.zeros(count, bool)
        for primitive, vertices in self._places:
            positions = self._gltf.floats(entry(primitive, "attributes")["POSITION"])
            if positions.dtype != np.float32 or positions.shape != (len(vertices), 3):
                raise ClipError(f"{EXTENSION}: got POSITION as {positions.dtype} {positions.shape}, expected float32")
            rest[vertices], seen[vertices] = positions, True
        for primitive, vertices in self._places:
            if not np.array_equal(rest[vertices], self._gltf.floats(primitive["attributes"]["POSITION"])):
                raise ClipError(f"{EXTENSION}: got places that differ for one vertex of the motion, expected the same")
        if not seen.all():
            raise ClipError(f"{EXTENSION}: got no place for vertex {int(seen.argmin())}, expected one for each")
        return rest

    @cached_property
    def faces(self) -> np.ndarray | None:
        with naming(self.path, *BROKEN):
            faces = [vertices[triangles(self._gltf, primitive, len(vertices))] for primitive, vertices in self._places]
            return np.concatenate(faces).astype(np.int32) if any(map(len, faces)) else None


def places_of(file: GltfFile, number: int) -> list[GltfPlace]:
    """Return the primitives that motion `number` of the file moves, each with the motion's vertex for each of its
    vertices. Raises ClipError."""
    places, count = [], len(motion_names(file.json))
    for mesh in file.items("meshes"):
        for primitive in entries(mesh, "primitives"):
            binding = extension_of(primitive)
            if binding is not None and integer(binding, "motion", stop=count) == number:
                places.append((primitive, _vertices(file, primitive, binding)))
    return places


def _vertices(file: GltfFile, primitive: JsonObject, binding: JsonObject) -> np.ndarray:
    """Return for each of the n vertices of a primitive the vertex of the motion that moves it, (n,). `binding` is the
    primitive's extension object. Raises ClipError."""
    attributes: JsonObject = entry(primitive, "attributes")
    count = len(file.array(integer(attributes, "POSITION")))  # The file may have bytes for fewer vertices.
    if VERTEX_ATTRIBUTE not in attributes:
        return integer(binding, "firstVertex", 0) + np.arange(count)
    values = file.array(integer(attributes, VERTEX_ATTRIBUTE))[:, 0]
    if len(values) != count or not np.isfinite(values).all() or values.min() < 0 or (values % 1).any():
        raise ClipError(f"{VERTEX_ATTRIBUTE}: got what numbers no vertices, expected {count} whole numbers")
    return values.astype(np.int64)
