"""Chunks of polygons, and what a rest pose that is coded by them goes by."""

from __future__ import annotations

import threading
from ctypes import byref

import numpy as np

from athcodec._native import address, encode_stream, lib
from athcodec.decoding import container as ct
from athcodec.errors import ClipError
from athcodec.motion.polygons import Polygons

CORNERS_OF_REST, FACES_OF_REST = 8, 4  # for each vertex, at most, that a rest pose goes by


def pack(polygons: Polygons, vertex_count: int) -> bytes:
    """FACES or EDGES; ClipError where no reader would accept that many."""
    count = polygons.face_count + len(polygons.corners)
    if count > ct.Limits.corners:
        raise ClipError(f"faces: got {count} faces and corners; the limit is {ct.Limits.corners}")
    memory = np.empty(lib.ath_faces_memory(vertex_count) // 8 + 1, np.uint64)
    stream = encode_stream(
        "ath_encode_faces",
        1024 + 6 * count,
        byref(polygons.shape),
        vertex_count,
        None if polygons.counts is None else address(polygons.counts, np.uint32, polygons.face_count),
        address(polygons.corners, np.int32, len(polygons.corners)),
        model=memory,
    )
    return ct.pack_polygons(polygons.shape, stream)


class Mesh:
    """Connectivity in the memory of the core, and the order in which it has vertices coded. One coding at a time."""

    def __init__(self, polygons: Polygons, vertex_source: np.ndarray):
        vertex_count = len(vertex_source)
        self.memory = np.zeros(lib.ath_mesh_size(vertex_count, len(polygons.corners)) // 8 + 2, np.uint64)
        self.lock = threading.Lock()
        at = -(-self.memory.ctypes.data // 16) * 16
        lib.ath_place_mesh(at, vertex_count, len(polygons.corners))
        lib.ath_build_mesh(
            at,
            byref(polygons.shape),
            None if polygons.counts is None else address(polygons.counts, np.uint32, polygons.face_count),
            address(polygons.corners, np.int32, len(polygons.corners)),
            address(vertex_source, np.int32, vertex_count),
        )
        self.address = at

    @classmethod
    def of(cls, polygons: Polygons | None, vertex_source: np.ndarray) -> Mesh | None:
        """None where there are no polygons, or more than a decoder would go by."""
        vertex_count = len(vertex_source)
        if polygons is None or len(polygons.corners) == 0:
            return None
        if len(polygons.corners) > CORNERS_OF_REST * vertex_count or polygons.face_count > FACES_OF_REST * vertex_count:
            return None
        return cls(polygons, vertex_source)
