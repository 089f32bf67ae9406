"""Rest poses and still meshes: sizes against what anyone would do, and the bound."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO

import numpy as np
import pytest
import zstandard
from files import coded
from plants import diagonal

import athcodec
from athcodec._native import BRANCH
from athcodec.decoding import container as ct
from athcodec.encoding.streams import streams
from bench.odd.others import still_mesh
from bench.scenes import fields


def terrain(rows: int, columns: int, rough: float, seed: int) -> np.ndarray:
    """Vertices of a height field, row by row, off their places by chance."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:rows, :columns].astype(float)
    height = sum(
        np.sin(a * x + b * y + c) / k for k, (a, b, c) in enumerate(random.uniform(-0.2, 0.2, (12, 3)) * [1, 1, 30], 1)
    )
    points = np.stack([x, y, 4.0 * height], axis=2).reshape(-1, 3)
    return (points + rough * random.normal(size=points.shape)).astype(np.float32)


def cards(count: int, seed: int) -> np.ndarray:
    """Rectangles of four vertices, anywhere and any way round."""
    random = np.random.default_rng(seed)
    along, across = random.normal(size=(2, count, 1, 3))
    across -= along * (across * along).sum(-1, keepdims=True) / (along**2).sum(-1, keepdims=True)
    corners = np.array([[0, -1], [0, 1], [2, -1], [2, 1]])
    centre = random.uniform(-20, 20, (count, 1, 3))
    points = centre + corners[:, :1] * along + corners[:, 1:] * across
    return points.reshape(-1, 3).astype(np.float32)


def tubes(count: int, seed: int) -> np.ndarray:
    """Rings of eight vertices, not quite round, along bent stems that start anywhere, any way round."""
    random = np.random.default_rng(seed)
    angle, height = 2 * np.pi * np.arange(8) / 8, np.linspace(0, 10, 24)
    points = []
    for _ in range(count):
        bend, start = random.normal(size=(2, 3)) * [[0.05], [8.0]]
        line = start + height[:, None] * [0, 0, 1] + height[:, None] ** 2 * bend + 0.02 * random.normal(size=(24, 3))
        radius = (0.5 - 0.04 * height)[:, None] * (1 + 0.05 * random.normal(size=(24, 8)))
        ring = np.stack([np.cos(angle) * radius, np.sin(angle) * radius, 0 * radius], axis=2)
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        points.append((line[:, None] + ring).reshape(-1, 3) @ turn)
    return np.concatenate(points).astype(np.float32)


MESHES: dict[str, Callable[[int], np.ndarray]] = {
    "terrain": lambda seed: terrain(50, 63, 0.1, seed),
    "smooth terrain": lambda seed: terrain(50, 63, 0.0, seed),
    "cards": lambda seed: cards(700, seed),
    "tubes": lambda seed: tubes(16, seed),
}


def simple_bytes(points: np.ndarray, bound: float) -> int:
    """Quantised coordinates, differences of any degree along the vertices, shuffled bytes, zstd: the best of these."""
    numbers = np.rint(points.astype(float) / (2 * bound / 3**0.5 * 0.999)).astype(np.int64)
    sizes = []
    for _ in range(3):
        largest = np.abs(numbers).max()
        kind = np.dtype(np.int8 if largest < 128 else np.int16 if largest < 32768 else np.int32)
        for order in (numbers, numbers.T):
            shuffled = np.ascontiguousarray(order.astype(kind)).reshape(-1, 1).view(np.uint8).T
            sizes.append(len(zstandard.compress(np.ascontiguousarray(shuffled).tobytes(), 19)))
        numbers = np.diff(numbers, axis=0, prepend=0)
    return min(sizes)


def still(points: np.ndarray, frames: int = 1) -> athcodec.MotionClip:
    return athcodec.MotionClip(np.repeat(points[None], frames, axis=0), np.arange(frames) / 24.0)


@pytest.mark.parametrize("relative", [1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("name", MESHES)
def test_a_still_mesh_takes_nine_tenths_of_simple_bytes_at_most(scratch, name, relative):
    points = MESHES[name](5)
    clip = still(points)
    summary = athcodec.encode(clip, scratch / "still.ath", rel_error=relative, attributes="none", ladder="none")
    assert summary.bytes <= 0.9 * simple_bytes(points, relative * diagonal(clip))


@pytest.mark.parametrize("ladder", ["none", "decades"])
@pytest.mark.parametrize("name", MESHES)
def test_still_meshes_keep_their_bound(scratch, name, ladder):
    points = MESHES[name](6)
    clip = still(points, 3)
    bound = 1e-4 * diagonal(clip)
    with coded(clip, scratch / "still.ath", max_error=bound, attributes="none", ladder=ladder) as decoder:
        assert np.linalg.norm(decoder.positions() - points, axis=2).max() <= bound


@pytest.mark.parametrize(("dtype", "origin"), [(np.float64, 0.0), (np.float32, 1e4), (np.float64, -1e7)])
def test_a_still_mesh_far_from_the_origin_keeps_its_bound(scratch, dtype, origin):
    points = (terrain(20, 20, 0.1, 3).astype(float) + origin).astype(dtype)
    with coded(still(points), scratch / "far.ath", max_error=0.01, ladder="none") as decoder:
        assert np.linalg.norm(decoder.positions(0).astype(float) - points, axis=1).max() <= 0.01


def test_a_still_mesh_keeps_the_bounds_of_its_vertices(scratch):
    points = terrain(20, 20, 0.1, 4)
    weights = np.random.default_rng(1).uniform(0.1, 1.0, len(points))
    with coded(still(points), scratch / "weights.ath", max_error=0.05, weights=weights) as decoder:
        assert (np.linalg.norm(decoder.positions(0) - points, axis=1) <= 0.05 * weights).all()


def test_leaves_that_keep_their_shape_on_a_still_tree_take_no_more_bytes_than_half_the_bound_does(scratch):
    mesh = still_mesh(seed=7, frames=1, nodes=400, leaves=160)
    sizes = [
        athcodec.encode(mesh, scratch / "still.ath", rel_error=relative, attributes="none", ladder="none").bytes
        for relative in (1e-5, 5e-6)
    ]
    assert sizes[0] < 1.05 * sizes[1]


def test_a_still_mesh_is_stored_in_its_own_order(scratch):
    clip = still(np.random.default_rng(2).permutation(terrain(40, 40, 0.1, 3)))
    summary = athcodec.encode(clip, scratch / "still.ath", rel_error=1e-4)
    assert summary.chunk_bytes["HIERARCHY"] < 40
    assert summary.chunk_bytes["STEMS"] + summary.chunk_bytes.get("AFFINES", 0) < 40


def test_a_still_mesh_is_encoded_without_a_search(scratch):
    stages = []
    athcodec.encode(
        still(terrain(20, 20, 0.1, 3)), scratch / "still.ath", progress=lambda name, part: stages.append(name)
    )
    assert "search" not in stages


def test_the_lattice_is_never_further_away_than_its_step_says():
    random = np.random.default_rng(9)
    points = 5.0 * random.normal(size=(4000, 3))
    coded = streams.encode_rest(two_stems(3999, 1, 1), 0.1, points)
    errors = np.linalg.norm(coded.decoded - points, axis=1)
    assert 0.06 < errors.max() <= 0.1 * 5**0.5 / 3.2


def test_slack_saves_bytes_and_is_kept():
    points = terrain(30, 30, 0.02, 8).astype(float)
    branches = two_stems(899, 1, 30)
    tight, loose = (streams.encode_rest(branches, 0.1, points, None, slack) for slack in (0.0, 0.0699))
    assert len(loose.stream) < 0.97 * len(tight.stream)
    assert np.linalg.norm(loose.decoded - points, axis=1).max() <= 0.0699


def two_stems(trunk: int, branch: int, lag: int) -> np.ndarray:
    branches = np.zeros(2, BRANCH)
    branches["parent"], branches["attach"], branches["lag"] = (-1, 0), (-1, 7), lag
    branches["count"], branches["first"] = (trunk, branch), (0, trunk)
    return branches


@pytest.mark.parametrize("ladder", ["none", "decades"])
def test_the_rest_pose_of_thin_tubes_goes_on_from_the_rings_before(ladder):
    """Though the way along their vertices is hardly longer than they are. As beams they take 17.3 bits for a vertex."""
    field = fields.stalks(seed=3, plants=40).clip
    stalks = field.replace(positions=field.positions[:16], time=field.time[:16])
    options = {"rel_error": 2e-5, "rest_error": "bound", "ladder": ladder, "effort": "fast"}
    with athcodec.open(BytesIO(athcodec.encode(stalks, **options))) as decoder:
        poses = [chunk.length for chunk in decoder.file.chunks if chunk.kind in (ct.REST, ct.REFINED_REST)]
    assert 8 * sum(poses) <= 16.5 * stalks.vertex_count
