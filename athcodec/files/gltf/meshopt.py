"""Buffer views of EXT_meshopt_compression, decoded by the package meshoptimizer. It reads no files."""

from __future__ import annotations

import numpy as np

from athcodec.errors import ClipError, MissingExtra
from athcodec.files.gltf.json import integer
from athcodec.untyped import JsonMapping

STRIDES = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,), "EXPONENTIAL": range(4, 257, 4), "NONE": range(1, 257)}
MOST_PER_BYTE = 2048  # Bytes that the codec makes of one at most; more is refused before memory is allocated.


def unpacked_size(packed: JsonMapping) -> int:
    """Return the number of bytes of the buffer view. Raises ClipError."""
    return integer(packed, "count", low=1) * integer(packed, "byteStride", low=1, stop=257)


def unpack(raw: bytes, packed: JsonMapping) -> bytes:
    """Return the bytes of a buffer view that EXT_meshopt_compression has compressed to `raw`. `packed` is its extension
    object, which states count, stride, mode and filter. Raises ClipError, and MissingExtra if the package meshoptimizer
    is missing."""
    try:
        import meshoptimizer as library
    except ImportError:
        raise MissingExtra(
            'glTF compressed by EXT_meshopt_compression: needs meshoptimizer: pip install "athcodec[gltf]"'
        ) from None
    count, stride = integer(packed, "count", low=1), integer(packed, "byteStride", low=1, stop=257)
    if count * stride > MOST_PER_BYTE * len(raw):
        raise ClipError(f"meshopt: got {count} elements of {stride} bytes in {len(raw)}, expected fewer")
    mode, filtered = packed.get("mode"), packed.get("filter", "NONE")
    if (
        mode not in ("ATTRIBUTES", "TRIANGLES", "INDICES")
        or stride not in STRIDES.get(filtered, ())
        or (stride % 4 if mode == "ATTRIBUTES" else stride not in (2, 4) or filtered != "NONE")
        or (mode == "TRIANGLES" and count % 3)
    ):
        raise ClipError(
            f"meshopt: got mode {mode!r}, filter {filtered!r}, {count} elements of {stride} bytes; "
            "expected what the extension defines"
        )
    try:
        if mode == "ATTRIBUTES":
            values = library.decode_vertex_buffer(count, stride, raw)
        else:
            decode = library.decode_index_buffer if mode == "TRIANGLES" else library.decode_index_sequence
            values = decode(count, stride, raw)
        values = np.frombuffer(np.ascontiguousarray(values).tobytes()[: count * stride], np.uint8).copy()
        filters = {
            "OCTAHEDRAL": library.decode_filter_oct,
            "QUATERNION": library.decode_filter_quat,
            "EXPONENTIAL": library.decode_filter_exp,
        }
        if filtered in filters:
            values = filters[filtered](values, count, stride)
    except (RuntimeError, ValueError, TypeError) as error:
        raise ClipError(f"meshopt: got bytes that do not decode: {str(error)[:80]}") from None
    data = np.ascontiguousarray(values).tobytes()
    if len(data) != count * stride:
        raise ClipError(f"meshopt: got {len(data)} bytes, expected {count * stride}")
    return data
