"""Faces and lines of a primitive, of any mode that glTF has."""

from __future__ import annotations

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.gltf.document import GltfFile
from athcodec.files.gltf.json import integer
from athcodec.untyped import JsonObject


def triangles(file: GltfFile, primitive: JsonObject, count: int) -> np.ndarray:
    """Return a primitive's triangles of its `count` vertices, (F, 3); none if it draws points or lines. Raises
    ClipError."""
    mode = integer(primitive, "mode", 4, stop=7)
    return rows_of(corners(file, primitive, count, "primitive"), mode) if mode >= 4 else np.zeros((0, 3), np.int64)


def corners(file: GltfFile, primitive: JsonObject, count: int, name: str) -> np.ndarray:
    if primitive.get("indices") is None:
        return np.arange(count)
    values = file.array(primitive["indices"])
    if values.shape[1] != 1 or values.dtype.kind != "u" or int(values.max()) >= count:
        raise ClipError(f"{name}: got indices up to {values.max()}, expected those of {count} vertices")
    return values[:, 0].astype(np.int64)


def rows_of(corners: np.ndarray, mode: int) -> np.ndarray:
    """Return the lines (n, 2) or triangles (n, 3) of a primitive. `corners` are its vertex numbers in order, and `mode`
    says how they are joined, as in glTF: 1 LINES, 2 LINE_LOOP, 3 LINE_STRIP, 4 TRIANGLES, 5 TRIANGLE_STRIP, 6
    TRIANGLE_FAN."""
    if mode == 1:
        return corners[: len(corners) // 2 * 2].reshape(-1, 2)
    if mode in (2, 3):
        ends = corners[1:] if mode == 3 else np.roll(corners, -1)
        return np.stack([corners[: len(ends)], ends], axis=1)
    if mode == 4:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    count = max(len(corners) - 2, 0)
    if not count:
        return np.zeros((0, 3), np.int64)
    if mode == 6:
        rows = np.stack([corners[1:-1], corners[2:], np.broadcast_to(corners[:1], count)], axis=1)
    else:
        rows = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
        rows[1::2, 1:] = rows[1::2, :0:-1]
    return rows[(rows[:, 0] != rows[:, 1]) & (rows[:, 1] != rows[:, 2]) & (rows[:, 0] != rows[:, 2])]
