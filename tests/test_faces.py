"""Faces and edges in a file: they come back as they were, cost little, and serve the rest pose."""

from __future__ import annotations

import numpy as np
import pytest
import zstandard
from files import opened
from plants import ring_quads
from test_rest import cards, simple_bytes, terrain, tubes

import athcodec
from athcodec.decoding import container as ct
from athcodec.encoding.streams import polygons
from athcodec.motion.places import Places
from athcodec.motion.polygons import Polygons
from spec.document import File, rules

CONNECTED = 1 << 3  # A bit of Method of REST.


def grid_faces(rows: int, columns: int, quads: bool = False) -> np.ndarray:
    first = (columns * np.arange(rows - 1)[:, None] + np.arange(columns - 1)).reshape(-1)
    corners = np.stack([first, first + 1, first + columns + 1, first + columns], axis=1)
    return corners if quads else np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def tube_faces(count: int, rings: int = 24, around: int = 8) -> np.ndarray:
    return (ring_quads(rings, around) + rings * around * np.arange(count)[:, None, None]).reshape(-1, 4)


def shuffled(points: np.ndarray, faces: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The same mesh, its vertices by chance."""
    order = np.random.default_rng(seed).permutation(len(points))
    return points[order], np.argsort(order)[faces]


def apart(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same mesh, each face with vertices of its own."""
    return points[faces.reshape(-1)], np.arange(faces.size).reshape(faces.shape)


def chunk_bytes(faces: np.ndarray, vertex_count: int) -> int:
    return len(polygons.pack(Polygons.of_rows(faces), Places.apart(vertex_count)))


def zstd_bytes(faces: np.ndarray) -> int:
    planes = np.ascontiguousarray(faces.astype("<i4").reshape(-1, 1).view(np.uint8).T)
    return len(zstandard.compress(planes.tobytes(), 19))


def still(points: np.ndarray, faces: np.ndarray) -> athcodec.MotionClip:
    return athcodec.MotionClip(points[None], np.zeros(1), faces=faces.astype(np.int32))


def rest_bytes(data: bytes) -> int:
    with opened(data) as decoder:
        return decoder.file.chunks.find(ct.REST).length


@pytest.mark.parametrize(
    ("faces", "most"),
    [
        (grid_faces(60, 50), 100),
        (grid_faces(60, 50, True), 80),
        (tube_faces(30), 100),
        (np.arange(4000).reshape(-1, 4), 40),
    ],
    ids=["triangles", "quads", "tubes", "cards"],
)
def test_faces_whose_numbers_repeat_cost_next_to_nothing(faces, most):
    assert chunk_bytes(faces, int(faces.max()) + 1) < most


@pytest.mark.parametrize("seed", range(3))
def test_faces_by_chance_take_no_more_than_zstd(seed):
    random = np.random.default_rng(seed)
    _, mesh = shuffled(np.zeros((3000, 3)), grid_faces(60, 50), seed)
    for faces in (mesh, random.permutation(mesh), random.integers(0, 3000, (2000, 3))):
        assert chunk_bytes(faces, 3000) <= 1.02 * zstd_bytes(faces) + 32


@pytest.mark.parametrize("dtype", ["|u1", "<i2", "<u4", "<i8"])
def test_faces_of_different_sizes_come_back(dtype):
    random = np.random.default_rng(1)
    counts = random.integers(0, 7, 200).astype("|i1")
    arrays = {
        "face_vertex_counts": counts,
        "face_vertex_indices": random.integers(0, 100, counts.sum()).astype(dtype),
        "uv": random.normal(size=(100, 2)),
    }
    clip = athcodec.MotionClip(terrain(10, 10, 0.1, 1)[None], np.zeros(1), attributes=arrays)
    with opened(athcodec.encode(clip)) as decoder:
        assert decoder.file.faces is None and set(decoder.file.attributes) == set(arrays)
        for name, array in arrays.items():
            assert decoder.file.attributes[name].dtype == array.dtype
            assert np.array_equal(decoder.file.attributes[name], array)


@pytest.mark.parametrize("share", [0.7, 0.85])
def test_vertices_by_chance_cost_little_more_where_faces_are_stored(share):
    points, faces = terrain(40, 40, 0.1, 5), grid_faces(40, 40)
    mixed = shuffled(points, faces, 5)
    bound = {0.7: 1e-3, 0.85: 1e-4}[share] * float(np.linalg.norm(np.ptp(points, axis=0)))
    data = athcodec.encode(still(*mixed), max_error=bound)
    with opened(data) as decoder:
        assert np.array_equal(decoder.file.faces, mixed[1])
        assert np.linalg.norm(decoder.positions(0).astype(float) - mixed[0], axis=1).max() <= bound
    assert rest_bytes(data) < share * simple_bytes(mixed[0], bound)
    assert rest_bytes(data) < 1.15 * rest_bytes(athcodec.encode(still(points, faces), max_error=bound))


MESHES = {
    "terrain": (terrain(30, 40, 0.1, 2), grid_faces(30, 40)),
    "tubes": (tubes(6, 2), tube_faces(6)),
    "cards": (cards(200, 2), np.arange(800).reshape(-1, 4)[:, [0, 1, 3, 2]]),
}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("relative", [1e-3, 1e-5])
def test_a_rest_pose_with_faces_takes_at_most_nine_tenths_of_a_simple_one(name, relative):
    points, faces = MESHES[name]
    bound = relative * float(np.linalg.norm(np.ptp(points, axis=0)))
    data = athcodec.encode(still(points, faces), max_error=bound, rest_error="bound")
    assert rest_bytes(data) <= 0.9 * simple_bytes(points, bound)


def test_faces_are_not_stored_without_attributes():
    points, faces = shuffled(*MESHES["terrain"], 3)
    data = athcodec.encode(still(points, faces), rel_error=1e-4, attributes="none")
    assert File(data).content(rules.REST)[0] & CONNECTED == 0
    with opened(data) as decoder:
        assert decoder.file.faces is None


@pytest.mark.parametrize("options", [{}, {"exact_rest": True}], ids=["bound", "exact"])
@pytest.mark.parametrize("name", ["terrain", "tubes"])
def test_faces_with_vertices_of_their_own_cost_the_mesh_and_its_map(name, options):
    points, faces = MESHES[name]
    clip, welded = still(*apart(points, faces)), still(points, faces)
    data = athcodec.encode(clip, rel_error=1e-4, **options)
    map_bytes = chunk_bytes(faces, len(points))
    assert len(data) <= 1.1 * (len(athcodec.encode(welded, rel_error=1e-4, **options)) + map_bytes)
    with opened(data) as decoder:
        assert np.array_equal(decoder.file.faces, clip.faces)
        error = np.linalg.norm(decoder.positions(0) - clip.block(0, 1)[0], axis=1).max()
        assert error <= (0 if options else 1e-4 * np.linalg.norm(np.ptp(points, axis=0)))


def test_vertices_that_a_seam_splits_cost_less_than_vertices_close_together():
    points, faces = MESHES["terrain"]
    second = np.where(points[faces].mean(axis=1)[:, :1] > np.median(points[:, 0]), faces + len(points), faces)
    used, faces = np.unique(second, return_inverse=True)
    split = points[used % len(points)]
    close = split + 1e-6 * np.linalg.norm(np.ptp(points, axis=0)) * (used >= len(points))[:, None]
    sizes = [rest_bytes(athcodec.encode(still(some, faces.reshape(-1, 3)), rel_error=1e-4)) for some in (split, close)]
    assert sizes[0] < sizes[1]
