"""Centre lines of plants that grow or hang, given without branches: as edges, in a file, or as points alone."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import athcodec
from athcodec import MotionClip
from athcodec.errors import ClipError
from athcodec.motion.hierarchy import hierarchy_of
from bench.odd.growing import growth, growth_in_wind

pytestmark = pytest.mark.sizes

SEED = 6


def without_branches(clip: MotionClip, **changes) -> MotionClip:
    return clip.replace(vertex_branch=None, branch_parent=None, stem_index=None, **changes)


def bytes_of(clip: MotionClip) -> int:
    return len(athcodec.encode(clip, rel_error=1e-4, ladder="none", attributes="none"))


def branches_of(clip: MotionClip) -> dict:
    found = athcodec.find_branches(clip)
    return {name: getattr(found, name) for name in ("vertex_branch", "branch_parent", "stem_index")}


def upside_down(clip: MotionClip) -> MotionClip:
    """The plant as a root system: all of it lies below where it began."""
    return clip.replace(positions=clip.block(0, clip.frame_count) * np.float32([1, -1, 1]), rest=None)


@pytest.mark.parametrize(
    "clip",
    [growth(SEED, 60, 400), upside_down(growth(SEED, 60, 400)), growth_in_wind(SEED, 60, 200)],
    ids=["a shoot", "a root system", "in wind"],
)
def test_edges_of_what_grows_give_the_branches_that_grew(clip):
    found = athcodec.find_branches(without_branches(clip))
    pairs = set(zip(found.vertex_branch.tolist(), clip.vertex_branch.tolist()))
    assert found.method == "edges"
    assert len(pairs) == len(found.branch_parent) == clip.branch_count
    assert bytes_of(without_branches(clip)) <= 1.05 * bytes_of(clip)


def test_points_of_what_grows_are_linked_as_they_grew():
    clip = growth(seed=SEED, frames=60, vertices=400, carried=True)
    points = without_branches(clip, edges=None)
    found = athcodec.find_branches(points)
    linked = set(map(tuple, np.sort(found.links, axis=1).tolist()))
    assert len(linked & set(map(tuple, np.sort(clip.edges, axis=1).tolist()))) > 0.95 * len(clip.edges)
    assert bytes_of(points) <= 1.1 * bytes_of(clip)


def test_a_vine_is_rooted_where_it_hangs_and_a_named_root_is_kept(tmp_path):
    way = np.linspace(0, 1, 40)
    swing = 0.3 * np.sin(np.linspace(0, 6, 30))[:, None] * way**2
    vine = np.stack([swing, np.broadcast_to(-way, swing.shape), 0 * swing], axis=2).astype(np.float32)
    edges = np.stack([np.arange(39), np.arange(1, 40)], axis=1)
    with h5py.File(tmp_path / "vine.h5", "w") as file:
        file["positions"], file["edges"] = vine, edges
    for root, first in ((None, 0), (39, 39), (7, 7)):
        with athcodec.read(tmp_path / "vine.h5", root=root) as clip:
            assert hierarchy_of(clip).vertex_source[0] == first
    with pytest.raises(ClipError, match="root: got"):
        athcodec.read(tmp_path / "vine.h5", root=40)


def test_a_plant_that_stands_still_is_rooted_at_its_lowest_vertex():
    still = np.zeros((5, 4, 3), np.float32)
    still[:, :, 1] = [3, 2, 1, 0]
    clip = MotionClip(still, np.arange(5) / 30, edges=[[0, 1], [1, 2], [2, 3]])
    assert athcodec.find_branches(clip).stem_index.tolist() == [3, 2, 1, 0]


def test_a_plant_that_sways_on_a_turntable_is_rooted_at_its_lowest_vertex():
    """What moves least beside the turn is somewhere in the crown."""
    times = np.arange(60) / 30
    height = np.linspace(0, 8, 40)
    place = np.zeros((60, 40, 3))
    place[:, :, 0] = np.sin(4 * times)[:, None] * 0.05 * height**2 + 0.3
    place[:, :, 1] = height
    place[:, 20:, 2] = 0.5 * (height[20:] - height[19])
    turn = np.pi * times
    turned = place.copy()
    turned[..., 0] = np.cos(turn)[:, None] * place[..., 0] + np.sin(turn)[:, None] * place[..., 2]
    turned[..., 2] = np.cos(turn)[:, None] * place[..., 2] - np.sin(turn)[:, None] * place[..., 0]
    edges = np.stack([np.arange(39), np.arange(1, 40)], axis=1)
    clip = MotionClip(turned.astype(np.float32), times, edges=edges)
    assert hierarchy_of(clip.replace(**branches_of(clip))).vertex_source[0] == 0
