"""Tubes and leaves whose vertices a program has put into another order: their faces still tell their rows."""

from __future__ import annotations

from math import lgamma, log

import numpy as np
import pytest
from plants import ring_quads, turns

import athcodec
from athcodec import MotionClip
from athcodec.motion.branches.rows import row_places
from athcodec.motion.polygons import sides

pytestmark = pytest.mark.sizes

FRAMES = 24


def leaf_faces(rows: int, columns: int, triangles: bool) -> np.ndarray:
    """Faces of a grid; triangles go round one way or the other, as some programs make them."""
    corner = np.arange(rows * columns).reshape(rows, columns)[:-1, :-1, None] + [0, 1, columns + 1, columns]
    quads = corner.reshape(-1, 4)
    if not triangles:
        return quads
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 3, 2]]])


def rest_of(kind: str, rows: int, columns: int) -> np.ndarray:
    """The rest pose of a tube or of a leaf that gets narrow, row by row, (rows * columns, 3)."""
    along, across = np.divmod(np.arange(rows * columns), columns)
    if kind == "tube":
        angle = 2 * np.pi * across / columns
        return np.stack([0.1 * np.cos(angle), along / rows, 0.1 * np.sin(angle)], axis=1)
    return np.stack([(across / (columns - 1) - 0.5) * (1 - 0.8 * along / rows), along / rows, 0 * along], axis=1)


@pytest.mark.parametrize("kind", ["tube", "leaf", "leaf of triangles"])
@pytest.mark.parametrize("seed", range(3))
def test_rows_come_back_from_the_base_to_the_tip(kind, seed):
    rows, columns = 9, 5
    faces = ring_quads(rows, columns) if kind == "tube" else leaf_faces(rows, columns, "triangles" in kind)
    order = np.random.default_rng(seed).permutation(rows * columns)
    rest, label = rest_of(kind.split()[0], rows, columns)[order], np.zeros(rows * columns, int)
    base = int(np.flatnonzero(order == 0)[0])
    place = row_places(rest, label, _sides(np.argsort(order)[faces]), np.array([base]), np.arange(rows * columns))
    found = order[np.argsort(place)].reshape(rows, columns)
    assert np.array_equal(found // columns, np.repeat(np.arange(rows)[:, None], columns, axis=1))
    assert (found % columns == found[0] % columns).all(), "a column does not run straight up"
    assert set(np.diff(found[0]) % columns) in ({1}, {columns - 1}), "a row does not run round"


def _sides(faces: np.ndarray) -> np.ndarray:
    return sides(np.full(len(faces), faces.shape[1]), faces.ravel())


def test_rows_that_the_source_keeps_and_what_is_no_grid_are_left_as_they_are():
    rows, columns = 9, 5
    rest, label, base = rest_of("leaf", rows, columns), np.zeros(rows * columns, int), np.array([0])
    kept = np.arange(rows * columns)
    faces = leaf_faces(rows, columns, False)
    for source in (kept, kept[::-1]):
        assert (row_places(rest, label, _sides(faces), base, source) < 0).all()
    shuffled = np.random.default_rng(0).permutation(rows * columns)
    for some in (faces[1:], faces[:0], np.concatenate([faces, [[0, 20, 21, 44]]]), np.zeros((3, 4), int)):
        assert (row_places(rest, label, _sides(some), base, shuffled) < 0).all()


@pytest.mark.parametrize("seed", range(20))
def test_faces_of_any_kind_give_places_or_none(seed):
    rng = np.random.default_rng(seed)
    label = np.sort(rng.integers(0, 4, 40))
    label = np.unique(label, return_inverse=True)[1]
    base = np.unique(label, return_index=True)[1]
    faces = rng.integers(0, 40, (rng.integers(1, 60), rng.integers(3, 5)))
    place = row_places(rng.normal(size=(40, 3)), label, _sides(faces), base, np.arange(40))
    for branch in range(label.max() + 1):
        own = place[label == branch]
        assert (own < 0).all() or np.array_equal(np.sort(own), np.arange(len(own)))


def test_a_hedge_in_another_order_costs_little_more_than_its_order():
    rng, rows, columns, stems = np.random.default_rng(3), 10, 5, 24
    tube = rest_of("tube", rows, columns)
    time = np.linspace(0, 12, FRAMES)[:, None]
    lean = 0.3 * np.sin(time + rng.uniform(0, 6, stems)) + 0.1 * np.sin(2.7 * time + rng.uniform(0, 6, stems))
    bend = lean[..., None] * tube[:, 1]
    turned = np.einsum("fsnij,nj->fsni", turns(bend[..., None] * [0, 0, 1]), tube)
    positions = (turned + rng.uniform(-2, 2, (stems, 1, 3)) * [1, 0, 1]).reshape(FRAMES, -1, 3).astype(np.float32)
    count = positions.shape[1]
    faces = (ring_quads(rows, columns) + tube.shape[0] * np.arange(stems)[:, None, None]).reshape(-1, 4)
    order = rng.permutation(count)
    sizes = [
        len(athcodec.encode(MotionClip(p, np.arange(FRAMES) / 24, faces=f), ladder="none", attributes="none"))
        for p, f in ((positions, faces), (positions[:, order], np.argsort(order)[faces]))
    ]
    order_alone = lgamma(count + 1) / log(2) / 8
    assert sizes[1] <= 1.2 * (sizes[0] + order_alone)
