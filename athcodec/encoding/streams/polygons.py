"""Chunks of polygons, and what a rest pose that is coded by them goes by."""

from __future__ import annotations

import threading
from ctypes import byref

import numpy as np

from athcodec._native import address, encode_stream, lib
from athcodec.decoding import container as ct
from athcodec.encoding.streams import writing
from athcodec.errors import ClipError
from athcodec.motion.places import Places
from athcodec.motion.polygons import Polygons

CORNERS_OF_REST = 8  # Corners for each vertex up to which a rest pose goes by faces (FORMAT.md, Connected rest poses).
FACES_OF_REST = 4  # Faces for each vertex up to which it does.
MESH_PARTS = 3  # Calls of the core that build a mesh.
PLACES_IN_ROWS = (1, 3, 4, 6)  # Columns of PLACES that are tried: faces with vertices of their own have 3 or 4 corners.


def pack(polygons: Polygons, places: Places, has_sides: bool = True) -> bytes:
    """Return the payload of a chunk FACES or EDGES. `has_sides`: whether guesses of corners from open sides are used.
    Raises ClipError if there are more polygons than readers take.
    """
    count = polygons.face_count + len(polygons.corners)
    if count > ct.Limits.corners:
        raise ClipError(f"faces: got {count} faces and corners; the limit is {ct.Limits.corners}")
    vertex_count, place_count = places.vertex_count, places.count
    stream = encode_stream(
        "ath_encode_faces",
        1024 + 6 * count,
        byref(polygons.shape),
        vertex_count,
        address(places.of_vertex, np.int32, vertex_count),
        place_count,
        None if polygons.counts is None else address(polygons.counts, np.uint32, polygons.face_count),
        address(polygons.corners, np.int32, len(polygons.corners)),
        has_sides,
        model=_memory(vertex_count, place_count),
    )
    return writing.pack_polygons(polygons.shape, stream)


def pack_places(places: Places) -> bytes:
    """Return PLACES, in rows of as many columns as make it smallest."""
    return min((_pack_places(places, columns) for columns in PLACES_IN_ROWS), key=len)


def _pack_places(places: Places, columns: int) -> bytes:
    table = address(places.of_vertex, np.int32, places.vertex_count)
    counts = places.vertex_count, places.count
    size, model = 1024 + 6 * places.vertex_count, _memory(places.count, places.count)
    return bytes([columns]) + encode_stream("ath_encode_places", size, columns, *counts, table, model=model)


def _memory(vertex_count: int, place_count: int) -> np.ndarray:
    return np.empty(lib.ath_faces_memory(vertex_count, place_count) // 8 + 1, np.uint64)


class Mesh:
    """Connectivity in the memory of the core, and the order in which it has vertices coded. One coding at a time."""

    def __init__(self, polygons: Polygons, vertex_source: np.ndarray):
        """Build the connectivity of polygons in memory of the C core. `vertex_source`: the number of each vertex in the
        source, (N,), in file order.
        """
        vertex_count = len(vertex_source)
        vertex_of = np.argsort(vertex_source).astype(np.int32)
        self.memory = np.zeros(lib.ath_mesh_size(vertex_count, len(polygons.corners)) // 8 + 2, np.uint64)
        self.lock = threading.Lock()
        at = -(-self.memory.ctypes.data // 16) * 16
        lib.ath_place_mesh(at, vertex_count, len(polygons.corners))
        numbers = address(vertex_of, np.int32, vertex_count)
        counts = None if polygons.counts is None else address(polygons.counts, np.uint32, polygons.face_count)
        corners = address(polygons.corners, np.int32, len(polygons.corners))
        for part in range(MESH_PARTS):
            lib.ath_build_mesh(at, part, byref(polygons.shape), counts, corners, numbers)
        self.address = at

    @classmethod
    def of(cls, polygons: Polygons | None, vertex_source: np.ndarray) -> Mesh | None:
        """Return the mesh of polygons; None: there are none, or more than a decoder goes by."""
        vertex_count = len(vertex_source)
        if polygons is None or len(polygons.corners) == 0:
            return None
        if len(polygons.corners) > CORNERS_OF_REST * vertex_count or polygons.face_count > FACES_OF_REST * vertex_count:
            return None
        return cls(polygons, vertex_source)
