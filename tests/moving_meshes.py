"""Small clips with meshes for tests of formats, and damaged copies of files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from plants import ring_quads

from athcodec.errors import ClipError
from athcodec.motion.clip import MotionClip

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 2], [0, 3, 0], [0, 4, 0], [0.25, 5, 0.125]])


def swaying(rest: np.ndarray, frames: int, dtype: object = np.float32) -> np.ndarray:
    """(T, N, 3): moves more the higher up, by numbers with all their digits."""
    rest = np.asarray(rest, np.float64)
    amount = 0.1 * np.sin(np.arange(frames) / 3)[:, None] * rest[:, 1] ** 2 / 7
    return (rest + amount[..., None] * np.array([1, 0.1, 0.3])).astype(dtype)


def mixed_clip(frames: int = 6, dtype: object = np.float32, fps: float = 24.0, start: int = 1) -> MotionClip:
    """A pyramid of a square and triangles, with texture coordinates per corner, and a line of three vertices."""
    counts, corners = [4, 3, 3, 3, 3], [0, 1, 2, 3, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]
    attributes = {
        "face_vertex_counts": np.array(counts, np.int32),
        "face_vertex_indices": np.array(corners, np.int32),
        "part_vertex_counts": np.array([5, 3], np.int32),
        "uv": np.random.default_rng(1).random((len(corners), 2)).astype(np.float32),
    }
    domains = {"face_vertex_counts": "face", "face_vertex_indices": "corner", "uv": "corner"}
    metadata = {"fps": fps, "start_frame": start, "part_names": ["leaf", "twig"], "part_kinds": ["mesh", "curves"]}
    metadata["domains"] = domains | {"part_vertex_counts": "constant"}
    more = {"edges": np.array([[5, 6], [6, 7]]), "attributes": attributes, "metadata": metadata}
    return MotionClip(swaying(POINTS, frames, dtype), np.arange(frames) / fps, **more)


def quad_clip(frames: int = 6, dtype: object = np.float32, rings: int = 6) -> MotionClip:
    """A tube of quads, one object."""
    angle = np.linspace(0, 2 * np.pi, 5)[:-1]
    rest = np.array([[np.cos(a), 0.7 * ring, np.sin(a)] for ring in range(rings) for a in angle])
    parts = {"part_names": ["tube"], "part_kinds": ["mesh"], "domains": {"part_vertex_counts": "constant"}}
    more = {"attributes": {"part_vertex_counts": np.array([len(rest)], np.int32)}, "faces": ring_quads(rings, 4)}
    metadata = {"fps": 24.0, "start_frame": 1} | parts
    return MotionClip(swaying(rest, frames, dtype), np.arange(frames) / 24, metadata=metadata, **more)


def assert_same_motion(got: MotionClip, wanted: MotionClip, tolerance: float = 0.0) -> None:
    """Positions and times; exactly, bit for bit, where there is no tolerance."""
    assert (got.frame_count, got.vertex_count) == (wanted.frame_count, wanted.vertex_count)
    a, b = got.block(0, got.frame_count), wanted.block(0, wanted.frame_count)
    if tolerance:
        assert np.abs(a.astype(float) - b).max() <= tolerance
    else:
        assert a.dtype == b.dtype and np.array_equal(a, b)
    assert np.allclose(got.time - got.time[0], wanted.time - wanted.time[0], rtol=0, atol=1e-9)


def assert_same_mesh(got: MotionClip, wanted: MotionClip) -> None:
    assert (got.polygons is None) == (wanted.polygons is None) and (got.edges is None) == (wanted.edges is None)
    if wanted.polygons is not None:
        assert all(map(np.array_equal, got.polygons, wanted.polygons))
    if wanted.edges is not None:
        assert np.array_equal(got.edges, wanted.edges)


def on_one_branch(clip: MotionClip) -> MotionClip:
    """The clip as the encoder takes it."""
    return clip.replace(vertex_branch=np.zeros(clip.vertex_count, np.int32), branch_parent=np.array([-1]))


def damaged(data: bytes, seed: int = 0, cuts: int = 25, changes: int = 40) -> Iterator[bytes]:
    """The bytes cut at many places, and with some of them changed at random."""
    rng = np.random.default_rng(seed)
    for length in {0, 1, 3, len(data) - 1, *rng.integers(0, len(data), cuts).tolist()}:
        yield data[:length]
    for _ in range(changes):
        changed = bytearray(data)
        head = min(len(data), 600) if rng.random() < 0.6 else len(data)
        for place in rng.integers(0, head, rng.integers(1, 4)):
            changed[place] = rng.integers(0, 256)
        yield bytes(changed)


def survives_damage(path: Path, read: Callable[[], MotionClip], seed: int = 0, **how_often: int) -> int:
    """Reads the file, then damaged copies in its place; how many were refused. Anything but ClipError and OSError
    fails."""

    def read_all() -> None:
        with read() as clip:
            for _ in clip.blocks():
                pass

    read_all()
    whole, refused = path.read_bytes(), 0
    for data in damaged(whole, seed, **how_often):
        path.write_bytes(data)
        try:
            read_all()
        except (ClipError, OSError) as error:
            assert "\n" not in str(error)
            refused += 1
    path.write_bytes(whole)
    return refused


def leafed_tree(cards: int = 120, frames: int = 24, size: float = 0.115, seed: int = 1) -> MotionClip:
    """A tree 16 m high, of curves, with cards of `size` that each flutter in their own way on swaying twigs."""
    random, along = np.random.default_rng(seed), np.linspace(0.05, 1.0, 20)[:, None]
    stems, parent, first = [along * [0, 16.0, 0]], [-1], [0]
    for twig in range(12):
        base = stems[0][8 + twig % 12]
        stems.append(base + along * (random.normal(size=3) + [0, 1, 0]))
        parent.append(0)
    corner = size * np.array([[-0.3, 0, 0], [0.3, 0, 0], [0.3, 1, 0], [-0.3, 1, 0]])
    for _ in range(cards):
        twig, turn = random.integers(1, 13), np.linalg.qr(random.normal(size=(3, 3)))[0]
        stems.append(stems[twig][random.integers(4, 20)] + corner @ turn.T)
        parent.append(twig)
    first = np.cumsum([0, *map(len, stems[:-1])])
    rest = np.concatenate(stems)
    positions, time = np.repeat(rest[None], frames, axis=0), np.arange(frames) / 24
    sway = 0.02 * np.sin(time * 2.0)[:, None] * rest[:, 1] ** 2 / 16
    for card in range(13, len(stems)):
        own = slice(first[card], first[card] + 4)
        axis, rate, phase = random.normal(size=3), random.uniform(2, 9), random.uniform(0, 6)
        axis /= np.linalg.norm(axis)
        cross = np.cross(np.eye(3), axis)
        for t, angle in enumerate(0.3 * np.sin(rate * time + phase)):
            turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
            positions[t, own] = rest[own][:2].mean(0) + (rest[own] - rest[own][:2].mean(0)) @ turn.T
            sway[t, own] = sway[t, own].mean()
    positions[:, :, 0] += sway
    return MotionClip(
        positions.astype(np.float32),
        time,
        rest=rest.astype(np.float32),
        vertex_branch=np.repeat(np.arange(len(stems)), [len(stem) for stem in stems]).astype(np.int32),
        branch_parent=np.array(parent, np.int32),
        faces=np.array([np.arange(f, f + 4) for f in first[13:]], np.int32),
    )
