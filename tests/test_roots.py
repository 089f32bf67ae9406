"""What stands side by side: found branches cost what true ones cost, as meshes and as points."""

from __future__ import annotations

import numpy as np
import pytest
from plants import ring_quads, turns

import athcodec
from athcodec import MotionClip
from athcodec.encoding.decisions import FileDecisions
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.branch_trials import Trial, best_branches
from athcodec.encoding.search.progress import Work
from athcodec.motion.branches import finding
from athcodec.motion.branches.forest import cheapest_forest, without_needless_orders
from athcodec.motion.branches.result import order_of
from athcodec.motion.hierarchy import branch_orders
from bench.data import Canopy
from bench.scenes import fields
from bench.scenes.assembly import bare

pytestmark = pytest.mark.sizes

FRAMES = 32
MOST = 1.05  # Size on branches that are found, over that on true ones.


def ribbons(count: int = 40, rows: int = 8, seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Positions (FRAMES, count * 2 * rows, 3) of ribbons that stand close together and bend in gusts, and faces."""
    random = np.random.default_rng(seed)
    time, along = np.arange(FRAMES) / 24, np.linspace(0, 1, rows)
    foot = np.stack(np.divmod(np.arange(count), 8), axis=1) * 0.1 + random.normal(size=(count, 2)) * 0.02
    gust = 0.3 * np.sin(2 * time[:, None] - foot @ [3.0, 1.0]) + 0.2 * np.sin(
        random.uniform(3, 6, count) * time[:, None] + random.uniform(0, 6, count)
    )
    bend = (gust + random.normal(size=count) * 0.1)[:, :, None] * along
    x = foot[:, :1] + np.cumsum(np.sin(bend), axis=2) / rows
    y = np.cumsum(np.cos(bend), axis=2) / rows - np.cos(bend[:, :, :1]) / rows
    side = 0.02 * np.array([-1.0, 1.0])
    z = foot[:, 1, None, None] + np.broadcast_to(side, (count, rows, 2))
    sheet = [np.repeat(array[..., None], 2, axis=-1) for array in (x, y)]
    positions = np.stack([*sheet, np.broadcast_to(z, sheet[0].shape)], axis=-1)
    faces = np.array([[2 * row + corner for corner in (0, 1, 3, 2)] for row in range(rows - 1)])
    of_all = (faces + 2 * rows * np.arange(count)[:, None, None]).reshape(-1, 4)
    triangles = np.concatenate([of_all[:, [0, 1, 2]], of_all[:, [0, 2, 3]]])
    return positions.reshape(FRAMES, -1, 3).astype(np.float32), triangles


def crown(leaves: int = 60, rows: int = 6, seed: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """The same of leaves that flutter on a crown that sways, each near others."""
    random = np.random.default_rng(seed)
    time, along = np.arange(FRAMES) / 24, np.linspace(0, 1, rows)
    base = random.normal(size=(leaves, 3)) * 0.6 + [0, 3, 0]
    sway = np.stack([0.3 * np.sin(1.7 * time), 0 * time, 0.2 * np.sin(1.3 * time + 1)], axis=-1)
    outward, aside = random.normal(size=(2, leaves, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    aside = np.cross(outward, aside)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    flutter = 0.4 * np.sin(random.uniform(4, 9, leaves) * time[:, None] + random.uniform(0, 6, leaves))[..., None]
    way = np.cos(flutter) * outward + np.sin(flutter) * np.cross(outward, aside)
    line = (base + sway[:, None] * base[:, 1:2] / 3)[:, :, None] + 0.3 * along[:, None] * way[:, :, None]
    wide = 0.05 * np.sin(np.pi * (0.1 + 0.8 * along))[:, None] * aside[:, None]
    positions = np.stack([line - wide, line + wide], axis=3).reshape(FRAMES, -1, 3)
    quads = np.array([[2 * row + corner for corner in (0, 1, 3, 2)] for row in range(rows - 1)])
    of_all = (quads + 2 * rows * np.arange(leaves)[:, None, None]).reshape(-1, 4)
    return positions.astype(np.float32), np.concatenate([of_all[:, [0, 1, 2]], of_all[:, [0, 2, 3]]])


def size(positions: np.ndarray, plants: int = 0, faces: np.ndarray | None = None) -> int:
    """Bytes on branches that are found, or of `plants` plants of as many vertices each, which are roots."""
    each = np.arange(positions.shape[1]) * plants // positions.shape[1]
    true = {"vertex_branch": each, "branch_parent": np.full(plants, -1)} if plants else {}
    clip = MotionClip(positions, np.arange(FRAMES) / 24, faces=faces, **true)
    return len(athcodec.encode(clip, ladder="none", attributes="none", effort="fast"))


@pytest.mark.parametrize(
    ("make", "plants", "has_faces"), [(ribbons, 40, True), (ribbons, 40, False), (crown, 60, True)]
)
def test_plants_side_by_side_cost_no_more_than_with_each_as_a_root(make, plants, has_faces):
    positions, faces = make()
    faces = faces if has_faces else None
    assert size(positions, faces=faces) <= MOST * size(positions, plants, faces)


def test_the_cheapest_forest_is_the_one_that_trying_all_finds():
    random = np.random.default_rng(0)
    for _ in range(30):
        cost = random.random((5, 6)) + np.eye(5, 6) * 9
        child, parent = np.divmod(np.arange(30), 6)
        kept = child != parent
        chosen = cheapest_forest(5, child[kept], parent[kept], cost.reshape(-1)[kept])
        total = cost.reshape(-1)[kept][chosen].sum()
        every = np.stack(np.meshgrid(*[np.arange(6)] * 5, indexing="ij"), axis=-1).reshape(-1, 5)
        step = np.concatenate([every, np.full((len(every), 1), 5)], axis=1)
        end = every
        for _ in range(5):
            end = np.take_along_axis(step, end, axis=1)
        is_forest = (end == 5).all(axis=1)
        assert total == pytest.approx(cost[np.arange(5), every[is_forest]].sum(axis=1).min())


def test_no_order_of_branches_is_kept_for_a_few_that_cost_little_more_without_it():
    # Nodes 0 to 3 hang in a chain; each may hang on the root instead, or be one, for some more.
    child, parent = np.array([[0, 4], [1, 0], [2, 1], [3, 2], [2, 0], [3, 0], [1, 4], [2, 4], [3, 4]]).T
    cost = np.array([5.0, 1, 1, 1, 2, 3, 90, 90, 90])
    chosen = cheapest_forest(4, child, parent, cost)
    assert parent[chosen].tolist() == [4, 0, 1, 2]
    for price, each, expected in ((0.5, 9, [4, 0, 1, 2]), (9, 0.5, [4, 0, 1, 2]), (3.5, 9, [4, 0, 0, 0])):
        assert parent[without_needless_orders(child, parent, cost, chosen, price, each)].tolist() == expected


def test_leaves_of_shrubs_hang_no_deeper_than_they_grow():
    clip = fields.stems(seed=3, plants=6).clip
    bare = clip.replace(vertex_branch=None, branch_parent=None, stem_index=None)
    found = next(finding.candidates(bare))
    assert branch_orders(found.branch_parent).max() == branch_orders(clip.branch_parent).max() == 1


def test_twigs_and_leaves_of_shrubs_side_by_side_hang_on_stems():
    clip = fields.stems(seed=3, plants=3).clip
    true, found = (
        len(athcodec.encode(one, ladder="none", attributes="none"))
        for one in (clip, clip.replace(vertex_branch=None, branch_parent=None, stem_index=None))
    )
    assert found <= MOST * true


STORMS = [(40, 16, 80, 3), *(pytest.param(100, 40, 200, seed, marks=pytest.mark.slow) for seed in range(1, 7))]


@pytest.mark.parametrize("nodes, frames, leaves, seed", STORMS)
def test_leaves_that_hinge_in_a_storm_hang_on_twigs_and_not_on_each_other(nodes, frames, leaves, seed):
    """Those beside each other move alike, but not as exactly as a leaf that turns about its own hinge."""
    tree = Canopy(nodes, 2, frames, 6.0, 14.0, leaves, "broadleaf", seed).make()
    found, true = (
        len(athcodec.encode(clip, rel_error=1e-4, ladder="none", attributes="none")) for clip in (bare(tree), tree)
    )
    assert found <= MOST * true


def test_branches_are_tried_with_what_keeps_narrow_faces_in_shape(monkeypatch):
    """Sizes that are compared without it are those of another file."""
    keeps: list[np.ndarray] = []
    decide = FileDecisions.tried

    def noted(decisions: FileDecisions, *args):
        keeps.append(decisions.source.keeps_shape)
        return decide(decisions, *args)

    monkeypatch.setattr(FileDecisions, "tried", noted)
    blades = bare(fields.ribbons(seed=3, plants=6, points=8).clip)
    best_branches(blades, BoundOption(rel_error=1e-4), Work(), is_compared=True)
    assert keeps and all(some.all() for some in keeps)


def test_no_branches_are_tried_that_would_take_the_work_of_the_search(monkeypatch):
    work, coded = Work(1e9), Trial.size

    def costly(self, branches):
        work.add(0.4 * work.allowed)
        return coded(self, branches)

    monkeypatch.setattr(Trial, "size", costly)
    best_branches(fields.stems(seed=5, plants=2).without_faces().bare(), BoundOption(rel_error=1e-4), work)
    assert 0.8 * work.allowed <= work.done <= work.allowed


def compound_leaves(leaves: int = 12, leaflets: int = 3, welded: bool = True) -> MotionClip:
    """Objects of a scene, each of them a few copies of one crumpled leaflet that swing as one, joined where they meet
    or a little apart."""
    rng, rows, columns = np.random.default_rng(1), 12, 5
    along, across = np.meshgrid(np.linspace(0, 1, rows), np.linspace(-0.3, 0.3, columns), indexing="ij")
    sheet = np.stack([along.ravel(), rng.normal(0, 0.05, along.size), across.ravel()], axis=1)
    sheet[:, 0] += 0 if welded else 0.1
    corner = np.arange(rows * columns).reshape(rows, columns)[:-1, :-1, None] + [0, 1, columns + 1, columns]
    angle = rng.uniform(0, 6, (leaves, 1)) + 2.1 * np.arange(leaflets)
    each = turns(angle[..., None] * [0, 1, 0])
    shapes = np.einsum("lkij,nj->lkni", each, sheet) * rng.uniform(0.5, 1, (leaves, 1, 1, 1))
    swing = 0.3 * np.sin(np.linspace(0, 12, FRAMES)[:, None] + angle[:, 0]) + 0.05 * rng.normal(size=(FRAMES, leaves))
    posed = np.einsum("flij,lkni->flknj", turns(swing[..., None] * [1, 0, 0]), shapes)
    positions = posed + rng.uniform(-3, 3, (leaves, 1, 1, 3)) * [1, 0.2, 1]
    faces = corner.reshape(-1, 4) + sheet.shape[0] * np.arange(leaves * leaflets)[:, None, None]
    return MotionClip(
        positions.reshape(FRAMES, -1, 3).astype(np.float32),
        np.arange(FRAMES) / 24,
        faces=faces.reshape(-1, 4),
        attributes={"part_vertex_counts": np.full(leaves, leaflets * sheet.shape[0], np.int32)},
        metadata={"part_names": [f"/plant/leaf{leaf}" for leaf in range(leaves)]},
    )


@pytest.mark.parametrize("welded", [True, False], ids=["leaflets meet", "leaflets apart"])
def test_leaflets_of_an_object_may_be_branches_of_their_own(welded):
    tried = list(finding.candidates(compound_leaves(welded=welded)))
    assert (tried[0].method, len(tried[0].branch_parent)) == ("objects", 12)
    assert any(len(one.branch_parent) == 36 and one.stem_index is None and order_of(one) == 0 for one in tried)


def skinned_wood(seed: int, boughs: int = 24, around: int = 8, rings: int = 12) -> MotionClip:
    """Boughs that are one piece of a mesh, each on the tip of another, that bend along their lengths as on bones."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = 0.03 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    height = np.linspace(0, 1, rings)
    time = np.arange(FRAMES) / 24
    base, frame, positions, faces = [np.zeros((FRAMES, 3))], [np.tile(np.eye(3), (FRAMES, 1, 1))], [], []
    quads = np.array(ring_quads(rings, around)).reshape(-1, 4)
    for bough in range(boughs):
        below = int(rng.integers(len(base)))
        lean = turns(np.array([rng.uniform(-0.7, 0.7), rng.uniform(-0.7, 0.7), 0.0]))
        sway = rng.uniform(0.05, 0.3, 2) * np.sin(time[:, None] * rng.uniform(3, 6) + rng.uniform(0, 6, 2))
        bend = np.concatenate([sway, 0 * sway[:, :1]], axis=1)
        local = ring[None] + height[:, None, None] * [0, 0, 1]
        turned = np.einsum("fhij,hrj->fhri", turns(bend[:, None] * height[:, None]), local)
        carrier = frame[below] @ lean
        positions.append(base[below][:, None] + np.einsum("fij,fhrj->fhri", carrier, turned).reshape(FRAMES, -1, 3))
        tip = np.einsum("fij,fj->fi", carrier, turned[:, -1].mean(axis=1))
        base.append(base[below] + tip)
        frame.append(carrier @ turns(bend))
        faces.append(quads + bough * rings * around)
        first, carries = bough * rings * around, (below * rings - 1) * around if below else 0
        faces.append(np.array([[carries, carries + 1, first + 1, first]]))
    return MotionClip(np.concatenate(positions, axis=1).astype(np.float32), time, faces=np.concatenate(faces))


def test_boughs_that_are_one_piece_of_a_mesh_are_found_in_it():
    wood = skinned_wood(seed=2)
    positions = wood.block(0, FRAMES)
    leaf = positions[:, -4:] + np.float32([0, 0, 0.2])
    faces = np.concatenate([wood.faces, wood.vertex_count + np.array([[0, 1, 2, 3]])])
    tried = list(finding.candidates(MotionClip(np.concatenate([positions, leaf], axis=1), wood.time, faces=faces)))
    assert (tried[0].method, len(tried[0].branch_parent)) == ("components", 2)
    assert any(one.method == "motion" and len(one.branch_parent) > 24 for one in tried)
