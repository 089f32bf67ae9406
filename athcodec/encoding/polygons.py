"""Chunks of polygons, and what a rest pose that is coded by them goes by."""

from __future__ import annotations

import threading
from ctypes import byref

import numpy as np

from athcodec._native import address, encode_stream, lib
from athcodec.decoding import container as ct
from athcodec.encoding import writing
from athcodec.errors import ClipError
from athcodec.motion.polygons import Polygons

CORNERS_OF_REST, FACES_OF_REST = 8, 4  # Corners and faces per vertex up to which a rest pose goes by faces.
MESH_PARTS = 3  # Calls of the core that build a mesh.
WELDS = 3, 4  # Corners of the polygons that are tried for names of places: what faces with vertices of their own have.


def pack(polygons: Polygons, vertex_count: int) -> bytes:
    """Return FACES or EDGES. Raises ClipError if no reader would accept that many."""
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
    return writing.pack_polygons(polygons.shape, stream)


def pack_welds(names: np.ndarray) -> bytes:
    """Return the front of a welded rest pose's body. names: (N,) names of places in source order."""
    rows = (np.resize(names, (-(-len(names) // corners), corners)).astype(np.uint32) for corners in WELDS)
    data = min((pack(Polygons.of_rows(some), len(names)) for some in rows), key=len)
    return len(data).to_bytes(4, "little") + data


class Mesh:
    """Connectivity in the memory of the core, and the order in which it has vertices coded. One coding at a time.
    names: vertices of the same name, in source order, share a place; None: each has its own."""

    def __init__(self, polygons: Polygons, vertex_source: np.ndarray, names: np.ndarray | None = None):
        vertex_count = len(vertex_source)
        self.welds = b"" if names is None else pack_welds(names)
        self.memory = np.zeros(lib.ath_mesh_size(vertex_count, len(polygons.corners)) // 8 + 2, np.uint64)
        self.lock = threading.Lock()
        at = -(-self.memory.ctypes.data // 16) * 16
        lib.ath_place_mesh(at, vertex_count, len(polygons.corners))
        source = address(vertex_source, np.int32, vertex_count)
        lib.ath_weld_mesh(at, None if names is None else address(names, np.int32, vertex_count), source)
        counts = None if polygons.counts is None else address(polygons.counts, np.uint32, polygons.face_count)
        corners = address(polygons.corners, np.int32, len(polygons.corners))
        for part in range(MESH_PARTS):
            lib.ath_build_mesh(at, part, byref(polygons.shape), counts, corners, source)
        self.address = at

    @classmethod
    def of(cls, polygons: Polygons | None, vertex_source: np.ndarray, names: np.ndarray | None = None) -> Mesh | None:
        """Return the mesh of polygons; None: there are none, or more than a decoder goes by."""
        vertex_count = len(vertex_source)
        if polygons is None or len(polygons.corners) == 0:
            return None
        if len(polygons.corners) > CORNERS_OF_REST * vertex_count or polygons.face_count > FACES_OF_REST * vertex_count:
            return None
        return cls(polygons, vertex_source, names)
