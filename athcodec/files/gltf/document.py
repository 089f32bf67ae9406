"""The bytes of a glTF 2.0 file: GLB or JSON, its buffers, and its accessors as arrays.

Buffers are the binary chunk of a GLB, files beside it, or data URIs; what is asked for is read when it is asked for.
Buffer views compressed by EXT_meshopt_compression are decoded where the package meshoptimizer is installed, those of
Draco are not. Based on the glTF 2.0 specification; nothing here knows nodes, meshes or animations (gltf_scene.py).
"""

from __future__ import annotations

import base64
import binascii
import json
import os
import struct
from os import fspath
from typing import BinaryIO
from urllib.parse import unquote

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.gltf.json import brief, entries, entry, integer, looked_up
from athcodec.files.gltf.meshopt import unpack, unpacked_size
from athcodec.files.kinds import HEAD_BYTES, TEXT, kind_of_bytes
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, closing_on_failure
from athcodec.options import MAX_MEMORY
from athcodec.untyped import JsonMapping, JsonObject, JsonValue

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
KEPT_VIEWS = 8  # Bytes that have been decompressed.
JSON_ENDS, JSON_BYTES = b",:[{", 96  # Bytes of text, and of the objects made of it.
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"
UNPACKED_BY = "decompress it first, for example with `gltf-transform copy packed.glb plain.glb`"
# Extensions that a reader of positions may ignore, or that are read here.
HARMLESS = (
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_",
    "ADOBE_materials_",
    "KHR_mesh_quantization",
    "KHR_animation_pointer",
    "KHR_node_visibility",
    "ATH_motion",
    "EXT_mesh_gpu_instancing",
    *MESHOPT,
)

_GLB_HEADER = struct.Struct("<4sII")
_CHUNK_HEADER = struct.Struct("<II")
_JSON_CHUNK, _BIN_CHUNK = 0x4E4F534A, 0x004E4942


class GltfFile:
    """An opened file; close it. `json` is its structure, an object, `budget` what reading it may take. Raises
    ClipError, OSError."""

    def __init__(self, path: FilePath, max_memory: int = MAX_MEMORY):
        """Open the glTF or GLB file `path` and read its JSON. Reading takes at most `max_memory` bytes of memory.
        Raises ClipError, OSError."""
        self.path, self.budget = fspath(path), Budget(max_memory)
        self._files: list[BinaryIO] = []
        self._buffers: dict[int, _Bytes] = {}
        self._unpacked_views: dict[int, bytes] = {}
        self.unchanged = FileWatch()
        with closing_on_failure(self):
            file = self._open(self.path)
            self.size = os.fstat(file.fileno()).st_size
            self._binary: _Bytes | None = None
            text = self._read_json(file)
            self.budget.need_for(text, JSON_ENDS, JSON_BYTES, "JSON")
            self.json = _parsed(text)
            self._check_version()

    def _open(self, path: str) -> BinaryIO:
        self._files.append(open_plain(path))
        self.unchanged.add(self._files[-1].fileno())
        return self._files[-1]

    def close(self) -> None:
        for file in self._files:
            file.close()

    # ---- structure ----

    def _read_json(self, file: BinaryIO) -> bytes:
        """Return the file's JSON text, and note where the binary chunk of a GLB lies. Raises ClipError."""
        self.budget.need(self.size, "file")
        head = file.read(_GLB_HEADER.size)
        text: bytes | None = None
        if head[:4] != b"glTF":
            text = head + file.read()
            kind = kind_of_bytes(text[:HEAD_BYTES], self.size)
            if kind not in ("glTF", "JSON", TEXT):
                raise ClipError(f"got {kind}, expected glTF: a GLB or JSON")
            return text
        if len(head) < _GLB_HEADER.size:
            raise ClipError(f"GLB: got {len(head)} bytes, expected a header of {_GLB_HEADER.size}")
        _, version, length = _GLB_HEADER.unpack(head)
        if version != 2:
            raise ClipError(f"GLB: got version {version}, expected 2")
        if length > self.size:
            raise ClipError(f"GLB: got {self.size} bytes, expected {length}: the file is cut off")
        place = _GLB_HEADER.size
        while place + _CHUNK_HEADER.size <= length:
            file.seek(place)
            size, kind = _CHUNK_HEADER.unpack(file.read(_CHUNK_HEADER.size))
            place += _CHUNK_HEADER.size
            if size > length - place:
                raise ClipError(f"GLB: got a chunk of {size} bytes, expected at most {length - place}")
            if text is None:
                if kind != _JSON_CHUNK:
                    raise ClipError(f"GLB: got a first chunk of type {kind:#x}, expected JSON")
                text = file.read(size)
            elif kind == _BIN_CHUNK and self._binary is None:
                self._binary = _FilePart(file, place, size)
            place += size  # Where it ends, aligned or not: trimesh once wrote chunks that are not.
        if text is None:
            raise ClipError("GLB: got no chunk, expected JSON")
        return text

    def _check_version(self) -> None:
        """Raise ClipError unless the file is of glTF 2 and requires only extensions that are read here."""
        version = str(entry(self.json, "asset").get("version"))
        if not version.startswith("2."):
            raise ClipError(f"asset: got version {version[:20]!r}, expected 2.0")
        for name in self.json.get("extensionsRequired") or ():
            if not str(name).startswith(HARMLESS):
                how = f": {UNPACKED_BY}" if name == DRACO else ""
                raise ClipError(
                    f"extensionsRequired: got {str(name)[:60]!r}, which is not read here; expected a file without it"
                    + how
                )

    def item(self, kind: str, index: JsonValue) -> JsonObject:
        """Return entry `index` of the top-level array `kind`, such as "nodes". Raises ClipError if it does not
        exist."""
        every = self.json.get(kind)
        entries = every if isinstance(every, list) else []
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise ClipError(f"{kind}: got index {brief(index)}, expected one below {len(entries)}")
        if not isinstance(entries[index], dict):
            raise ClipError(f"{kind}: entry {index} is {brief(entries[index])}, expected an object")
        return entries[index]

    def items(self, kind: str) -> list[JsonObject]:
        return entries(self.json, kind)

    # ---- accessors ----

    def count(self, index: JsonValue) -> int:
        """Return the number of elements of accessor `index`."""
        return integer(self.item("accessors", index), "count", low=1)

    def array(self, index: JsonValue) -> np.ndarray:
        """Return the values of accessor `index`, (count, width), in the type that they are stored in. Raises
        ClipError."""
        accessor, where = self.item("accessors", index), f"accessor {index}"
        dtype = looked_up(COMPONENTS, accessor.get("componentType"), f"{where}: componentType")
        width = looked_up(WIDTHS, accessor.get("type"), f"{where}: type")
        count = integer(accessor, "count", low=1)
        if accessor.get("bufferView") is None:
            if count * width > max(self.size, 1 << 16):
                raise ClipError(f"{where}: got {count} elements without bytes in a file of {self.size}")
            self.budget.need(count * width * np.dtype(dtype).itemsize, where)
            values = np.zeros((count, width), dtype)
        else:
            values = self._strided(accessor, np.dtype(dtype), width, count, where)
        if accessor.get("sparse") is not None:
            values = self._sparse(entry(accessor, "sparse"), values, where)
        return values

    def floats(self, index: JsonValue) -> np.ndarray:
        """Return accessor `index` as numbers: float32 unchanged, normalized integers between -1 and 1 (float64)."""
        values = self.array(index)
        if values.dtype.kind == "f":
            return values
        if not self.item("accessors", index).get("normalized"):
            return values.astype(np.float64)
        return np.maximum(values / float(np.iinfo(values.dtype).max), -1.0)

    def attribute(self, index: JsonValue) -> np.ndarray:
        """Return accessor `index` in the type that it is stored in, normalized integers as float32."""
        is_normalized = self.item("accessors", index).get("normalized")
        return self.floats(index).astype(np.float32) if is_normalized else self.array(index)

    def _strided(self, accessor: JsonMapping, dtype: np.dtype, width: int, count: int, where: str) -> np.ndarray:
        """Return the elements (count, width) of an accessor, or of a part of one, from its buffer view. `where` names
        it in messages. Raises ClipError if they do not fit into the view."""
        index = accessor.get("bufferView")
        view = self.item("bufferViews", index)
        item, offset = dtype.itemsize * width, integer(accessor, "byteOffset", 0)
        stride = integer(view, "byteStride", 0) or item
        size = stride * (count - 1) + item
        length = integer(view, "byteLength", low=1)
        if stride < item or offset + size > length:
            raise ClipError(
                f"{where}: got {count} elements of {item} bytes at {offset}, expected what fits into the "
                f"{length} bytes of its buffer view"
            )
        raw = self._view(index, view, offset, size)
        return np.ndarray((count, width), dtype, raw, strides=(stride, dtype.itemsize))

    def _sparse(self, sparse: JsonMapping, values: np.ndarray, where: str) -> np.ndarray:
        """Return a copy of an accessor's `values` in which the rows that its `sparse` object lists are replaced.
        `where` names the accessor in messages."""
        count = integer(sparse, "count", low=1, stop=len(values) + 1)
        indices, changed = entry(sparse, "indices"), entry(sparse, "values")
        dtype = np.dtype(looked_up(COMPONENTS, indices.get("componentType"), f"{where}: sparse indices"))
        rows = self._strided(indices, dtype, 1, count, f"{where}: sparse indices")[:, 0]
        if dtype.kind != "u" or int(rows.max()) >= len(values):
            raise ClipError(f"{where}: got sparse indices up to {rows.max()}, expected those of {len(values)} elements")
        values = values.copy()
        values[rows] = self._strided(changed, values.dtype, values.shape[1], count, f"{where}: sparse values")
        return values

    def binary_chunk(self) -> bytes:
        """Return the bytes of the GLB's internal buffer; none if it has none."""
        return self._binary.read(0, self._binary.size) if self._binary is not None else b""

    def part(self, holder: JsonMapping, key: str) -> tuple[_Bytes, int, int]:
        """Return (buffer, offset, size) of the buffer view whose number `holder` has under `key`: its buffer, and where
        in it the view's bytes lie. Raises ClipError if the view is compressed or cut off."""
        index = integer(holder, key)
        view = self.item("bufferViews", index)
        offset, size = integer(view, "byteOffset", 0), integer(view, "byteLength", low=1)
        buffer = self._buffer_of(view)
        if offset + size > buffer.size or any(name in (view.get("extensions") or {}) for name in MESHOPT):
            raise ClipError(f"bufferView {index}: got one that is compressed or cut off, expected {size} plain bytes")
        return buffer, offset, size

    def _view(self, index: JsonValue, view: JsonMapping, offset: int, size: int) -> bytes:
        """Return bytes of the buffer view `view`, of number `index`, unpacked if it is compressed. Raises ClipError."""
        extensions = view.get("extensions") or {}
        for name in MESHOPT:
            if name in extensions:
                return self._unpacked(index, name)[offset : offset + size]
        return self._slice(view, integer(view, "byteOffset", 0) + offset, size, f"bufferView {index}")

    def _unpacked(self, index: int, name: str) -> bytes:
        """Return the bytes of buffer view `index`, decompressed from the extension `name`. The last few results are
        cached."""
        if index not in self._unpacked_views:
            packed = entry(entry(self.item("bufferViews", index), "extensions"), name)
            raw = self._slice(packed, integer(packed, "byteOffset", 0), integer(packed, "byteLength", low=1), name)
            # Unpacking takes four times the memory.
            self.budget.need((KEPT_VIEWS + 4) * unpacked_size(packed), f"bufferView {index}")
            if len(self._unpacked_views) >= KEPT_VIEWS:
                self._unpacked_views.pop(next(iter(self._unpacked_views)))
            self._unpacked_views[index] = unpack(raw, packed)
        return self._unpacked_views[index]

    def _slice(self, view: JsonMapping, offset: int, size: int, where: str) -> bytes:
        """Return `size` bytes from an offset of a view's buffer. Raises ClipError beyond its end."""
        buffer = self._buffer_of(view)
        if offset + size > buffer.size:
            raise ClipError(
                f"{where}: got bytes {offset} to {offset + size}, expected those of a buffer of {buffer.size}"
            )
        return buffer.read(offset, size)

    def _buffer_of(self, view: JsonMapping) -> _Bytes:
        index = integer(view, "buffer")
        if index not in self._buffers:
            self._buffers[index] = self._buffer(index)
        return self._buffers[index]

    def _buffer(self, index: int) -> _Bytes:
        """Return the bytes of buffer `index`, which are the binary chunk, a data URI or another file. Raises ClipError
        if there are fewer than stated."""
        buffer = self.item("buffers", index)
        uri = buffer.get("uri")
        if uri is None and index == 0 and self._binary is not None:
            source = self._binary
        elif isinstance(uri, str) and uri.startswith("data:"):
            source = _Bytes(_data_uri(uri))
        elif isinstance(uri, str):
            file = self._open(self._beside(uri))
            source = _FilePart(file, 0, os.fstat(file.fileno()).st_size)
        else:
            raise ClipError(f"buffers: entry {index} has no bytes, expected a URI or the binary chunk of a GLB")
        length = integer(buffer, "byteLength", low=1)
        if length > source.size:
            raise ClipError(f"buffers: entry {index} has {source.size} bytes, expected {length}")
        source.size = length
        return source

    def _beside(self, uri: str) -> str:
        """Return the file that a relative URI names. A URI that leads elsewhere is refused: an untrusted file must not
        read others on the disk."""
        name = unquote(uri)
        parts = name.replace("\\", "/").split("/")
        if ":" in parts[0] or name.startswith(("/", "\\")) or ".." in parts or "\0" in name:
            raise ClipError(f"buffers: got the URI {uri[:60]!r}, expected a file beside the glTF file or below it")
        return os.path.join(os.path.dirname(self.path), *parts)


class _Bytes:
    """A buffer in memory."""

    def __init__(self, data: bytes):
        self._data, self.size = data, len(data)

    def read(self, offset: int, size: int) -> bytes:
        return self._data[offset : offset + size]


class _FilePart(_Bytes):
    """A buffer in a file."""

    def __init__(self, file: BinaryIO, start: int, size: int):
        self._file, self._start, self.size = file, start, size

    def read(self, offset: int, size: int) -> bytes:
        self._file.seek(self._start + offset)
        data = self._file.read(size)
        if len(data) < size:
            raise ClipError(f"buffer: got {len(data)} bytes at {offset}, expected {size}: the file is cut off")
        return data


def _parsed(text: bytes) -> JsonObject:
    """Return the JSON object in `text`. Raises ClipError if it is none."""
    try:
        document = json.loads(text.decode("utf-8-sig"), parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise ClipError(f"JSON: got text that is none: {str(error)[:100]}, expected glTF 2.0") from None
    if not isinstance(document, dict):
        raise ClipError(f"JSON: got {brief(document)}, expected an object")
    return document


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _data_uri(uri: str) -> bytes:
    """Return the bytes in a base64 data URI. Raises ClipError if it is none."""
    head, _, data = uri.partition(",")
    if not head.endswith(";base64"):
        raise ClipError(f"buffers: got the URI {head[:60]!r}, expected data in base64")
    try:
        return base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError) as error:
        raise ClipError(f"buffers: got data that is no base64: {error}") from None
