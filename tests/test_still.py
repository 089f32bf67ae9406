"""What stands still beside what moves, and what turns as a whole, cost about what they cost alone."""

from __future__ import annotations

import io
import itertools

import numpy as np
import pytest
from plants import blown_tree, turns

import athcodec
from athcodec.encoding.encoder import encode_clip
from athcodec.encoding.search.choices.reference import turned_pose
from athcodec.encoding.search.trials import Trials
from athcodec.motion.branches.common_motion import carried, without_common_motion
from athcodec.motion.branches.result import Found
from athcodec.motion.branches.still import still_parts
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import build_hierarchy
from bench.data import Canopy
from bench.scenes import fields, singles
from bench.scenes.assembly import Assembly, bare
from bench.scenes.stems import bent, headings, ribbons, tubes
from bench.trees.ride import sideways

pytestmark = pytest.mark.sizes

SINGLE = {"ladder": "none", "attributes": "none", "rest_error": "bound", "jobs": 1}


def size_of(clip: MotionClip, bound: float, **options) -> int:
    file = io.BytesIO()
    encode_clip(clip, file, max_error=bound, **SINGLE | options)
    return len(file.getvalue())


def terrain(side: int, seed: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    random, along = np.random.default_rng(seed), np.linspace(-1, 1, side)
    x, z = np.meshgrid(along, along, indexing="ij")
    waves = (random.uniform(0.02, 0.06) * np.sin(random.uniform(-4, 4) * x + random.uniform(-4, 4) * z) for _ in "1234")
    y = sum(waves) + 0.002 * random.standard_normal(x.shape) - 0.1
    number = np.arange(side * side, dtype=np.int32).reshape(side, side)
    corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate(
        [np.stack([corners[i] for i in three], -1).reshape(-1, 3) for three in ((0, 1, 2), (0, 2, 3))]
    )
    return (size * np.stack([x, y, z], -1)).reshape(-1, 3).astype(np.float32), faces


def scene(side: int = 40, branches: int = 40, frames: int = 24) -> tuple[MotionClip, np.ndarray, np.ndarray]:
    tree = blown_tree(3, branches, frames)
    ground, faces = terrain(side, 5, 2.0)
    return tree, ground, faces


def beside(tree: MotionClip, ground: np.ndarray) -> np.ndarray:
    moving = tree.block(0, tree.frame_count).astype(np.float32)
    return np.concatenate([moving, np.broadcast_to(ground, (len(moving), *ground.shape))], axis=1)


def bound_of(positions: np.ndarray) -> float:
    return 1e-4 * float(np.linalg.norm(np.ptp(positions.reshape(-1, 3), axis=0)))


@pytest.fixture(scope="module")
def tree_alone() -> int:
    """The size of the tree of `scene` without its ground, at the bound of both."""
    tree, ground, _ = scene()
    both = beside(tree, ground)
    return size_of(MotionClip(both[:, : tree.vertex_count], tree.time), bound_of(both))


@pytest.mark.parametrize("has_faces", [False, True])
def test_a_still_terrain_beside_a_tree_costs_what_it_costs_alone(has_faces, tree_alone):
    tree, ground, faces = scene()
    both, time, count = beside(tree, ground), tree.time, tree.vertex_count
    bound = bound_of(both)
    alone = tree_alone + size_of(MotionClip(both[:, count:], time, faces=faces if has_faces else None), bound)
    together = size_of(MotionClip(both, time, faces=faces + count if has_faces else None), bound)
    assert together <= 1.05 * alone


def test_what_stands_still_takes_no_part_in_trials(monkeypatch):
    tree, ground, _ = scene()
    both, seen = beside(tree, ground), set()
    bound = bound_of(both)
    tried = Trials._try

    def counted(self, settings):
        seen.add(self.source.clip.vertex_count)
        return tried(self, settings)

    monkeypatch.setattr(Trials, "_try", counted)
    size_of(MotionClip(both, tree.time), bound)
    assert seen and max(seen) <= tree.vertex_count


def test_frames_of_what_stands_still_may_differ_by_a_small_part_of_the_bound():
    tree, ground, _ = scene(side=20)
    both, count = beside(tree, ground), tree.vertex_count
    both[:, count:] += 1e-6 * np.random.default_rng(2).standard_normal(both[:, count:].shape).astype(np.float32)
    clip = MotionClip(both, tree.time)
    assert still_parts(clip, 0.0) is None
    standing = still_parts(clip, 1e-4)
    # The base of the tree, and points of the ground right beside it, may count as either.
    assert standing[count:].mean() > 0.98 and np.count_nonzero(standing[:count]) <= 1


def test_a_plant_whose_trunk_stands_still_stays_whole():
    tree = blown_tree(3, 40, 24)
    positions = tree.block(0, tree.frame_count).copy()
    positions[:, tree.vertex_branch == 0] = positions[0, tree.vertex_branch == 0]
    assert still_parts(MotionClip(positions, tree.time, edges=None), 0.0) is None


@pytest.mark.parametrize("ladder", ["none", pytest.param("decades", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("named", "ways"),
    [
        pytest.param(True, ((0.25, 1.0), (1.0, 1.0), (0.5, 0.5)), marks=pytest.mark.slow, id="named"),
        pytest.param(False, ((1.0, 1.0),), id="found"),
    ],
)
def test_a_plant_on_a_turntable_costs_a_few_hundred_bytes_more_than_one_that_stands(named, ways, ladder):
    """`named`: whether the clip names its branches, or they are found. `ways`: whole turns, and the part of the clip
    after which the table stands still."""
    tree = blown_tree(3, 40, 24)
    positions = tree.block(0, tree.frame_count).astype(np.float64)
    bound = bound_of(positions)

    def size(turn: float, stop: float) -> int:
        turned_by = 2 * np.pi * turn * np.minimum(np.linspace(0, 1, len(positions)) / stop, 1)
        turned = positions @ turns(turned_by[:, None] * [0.0, 1.0, 0.0]).transpose(0, 2, 1)
        on = {"vertex_branch": tree.vertex_branch, "branch_parent": tree.branch_parent} if named else {}
        return size_of(MotionClip(turned.astype(np.float32), tree.time, **on), bound, ladder=ladder)

    standing = size(0.0, 1.0)
    for turn, stop in ways:
        assert size(turn, stop) <= 1.05 * standing + 50, (turn, stop)


def leafed_tree(seed: int, nodes: int, leaves: int, turn: float) -> MotionClip:
    """A tree with leaves in wind, without branches, that turns as a whole besides."""
    tree = bare(Canopy(nodes, 2, 24, 6.0, 8.0, leaves, "broadleaf", seed).make())
    angles = np.linspace(0, turn, tree.frame_count)[:, None] * [0.0, 1.0, 0.0]
    turned = np.einsum("tij,tvj->tvi", turns(angles), tree.block(0, tree.frame_count).astype(np.float64))
    return tree.replace(positions=turned.astype(np.float32))


def test_a_tree_that_turns_stands_on_its_trunk():
    """Of what is left without the turn, any part of the crown may move less than the foot of the trunk."""
    for seed in range(1, 5):
        found = athcodec.find_branches(leafed_tree(seed, 40, 80, 2 * np.pi))
        roots = np.flatnonzero(found.branch_parent < 0)
        assert found.vertex_branch[0] in roots and len(roots) == 1, seed


@pytest.mark.slow
@pytest.mark.parametrize("ladder", ["none", "decades"])
def test_trees_with_leaves_on_a_turntable_cost_little_more_than_trees_that_stand(ladder):
    standing, turning = 0, 0
    for seed in range(16, 21):
        clips = [leafed_tree(seed, 100, 200, turn) for turn in (0.0, 2 * np.pi)]
        sizes = [size_of(clip, bound_of(clips[0].positions), ladder=ladder) for clip in clips]
        standing, turning = standing + 1.05 * sizes[0] + 500, turning + sizes[1]
    assert turning <= standing


def test_layers_of_what_turns_are_predicted_from_those_before():
    """A turn that is coarse in one layer moves a crown much more than it moves the trunk by which it is known."""
    with athcodec.read(athcodec.sample_path()) as tree:
        positions = tree.block(0, 60).astype(np.float64)
        turned_by = turns(np.linspace(0, 2 * np.pi, len(positions))[:, None] * [0.0, 1.0, 0.0])
        standing, turning = (
            len(athcodec.encode(tree.replace(positions=one.astype(np.float32), time=tree.time[:60]), rel_error=1e-4))
            for one in (positions, positions @ turned_by.transpose(0, 2, 1))
        )
    assert turning <= 1.05 * standing + 300


def planted(count: int = 9, each: int = 6, frames: int = 10) -> np.ndarray:
    """The rest pose and frames, (1 + frames, count * each, 3), of stems that bend from feet that stand still."""
    random = np.random.default_rng(4)
    foot = np.stack(np.divmod(np.arange(count), 3), axis=-1) + 0.1 * random.standard_normal((count, 2))
    time, height = np.linspace(0, 1, frames + 1), np.arange(each) / each
    lean = 0.2 * np.sin(random.uniform(3, 9, (count, 2)) * time[:, None, None])
    away = lean[:, :, None] * np.maximum(height - height[1], 0)[:, None] ** 2
    x, z = np.moveaxis(foot[:, None] + away, -1, 0)
    return np.stack([x, np.broadcast_to(height, x.shape), z], axis=-1).reshape(frames + 1, -1, 3)


@pytest.mark.parametrize("apart", [1.0, 0.05])
def test_feet_of_plants_that_stand_close_are_no_ground(apart):
    """Without faces the points next to a foot are feet of other plants."""
    positions = planted(100, 8)
    feet = np.repeat(positions[0].reshape(100, 8, 3)[:, 0], 8, axis=0)
    positions = positions - (1 - apart) * feet
    assert still_parts(MotionClip(positions.astype(np.float32), np.arange(len(positions)) / 30), 0.0) is None


def test_what_stands_still_does_not_make_the_rest_pose_of_what_moves_finer():
    """A rest pose that only the source names, such as that of a rig, is for binding."""
    tree, ground, _ = scene(side=9, branches=60)
    both, time, count = beside(tree, ground), tree.time, tree.vertex_count
    rest = both[0].copy()
    rest[:count, 0] += 0.2 * (rest[:count, 1] - rest[:count, 1].min())
    bound = bound_of(both)
    alone = size_of(MotionClip(both[:, :count], time, rest=rest[:count]), bound)
    alone += size_of(MotionClip(both[:, count:], time), bound)
    assert size_of(MotionClip(both, time, rest=rest), bound) <= 1.05 * alone


def test_modes_of_what_moves_fit_the_rest_pose_that_is_coded_with_what_stands_still():
    """Modes that take back how the rest pose is rounded were either learned about the pose of what moves alone, which
    fits only by luck, or not at all beside what stands still."""
    scene = singles.tree_on_terrain(side=100).without_faces()
    bound = 1.02 * bound_of(scene.clip.positions)
    alone = sum(size_of(scene.part(plant), bound) for plant in np.unique(scene.plant))
    assert size_of(scene.bare(), bound) <= 1.05 * alone


def test_what_stands_still_may_tremble_by_a_small_part_of_the_bound():
    """As captures do, and as positions in float32 do far from the origin."""
    clip = singles.tree_on_terrain(side=50).without_faces().bare()
    positions = clip.block(0, clip.frame_count)
    bound = bound_of(positions)
    noise = np.random.default_rng(1).normal(0, 0.006 * bound, positions.shape)
    shaken = clip.replace(positions=(positions + noise).astype(np.float32), rest=None)
    assert size_of(shaken, bound) <= 1.25 * size_of(clip, bound)


@pytest.mark.slow
def test_leaves_of_stems_that_stand_still_cost_as_much_as_those_that_hang_on_them():
    """What stands still hung on nothing, and took learned modes away from what moves: up to a sixth more."""
    clip = struck_leaves(seed=2)
    bound = bound_of(clip.positions)
    assert size_of(bare(clip), bound) <= 1.05 * size_of(clip, bound)


def struck_leaves(seed: int, stems: int = 3, leaves: int = 40, frames: int = 50) -> MotionClip:
    """Leaves on stems that stand still; each is struck once, and swings until it rests."""
    rng, time = np.random.default_rng(seed), np.arange(frames) / 30
    lean = np.broadcast_to(rng.normal(0, 0.3, (stems, 3)), (frames, stems, 3))
    still = bent(np.zeros((stems, 3)), headings(rng, stems, 0.5), rng.uniform(1, 2, stems), 20, lean)
    parts = Assembly()
    parts.add(*tubes(still, np.linspace(0.03, 0.005, 20), 6))
    on = rng.integers(0, stems, leaves)
    foot, _ = still.feet(on, rng.integers(5, 19, leaves))
    since = np.clip(time[:, None] - rng.uniform(0, 1.2, leaves), 0, None)
    swing = rng.uniform(0.2, 0.8, leaves) * np.exp(-4 * since) * np.sin(30 * since)
    heading = sideways(still.heading[on], rng.uniform(0, 6, leaves), 1.2)
    leaf = bent(foot, heading, rng.uniform(0.1, 0.2, leaves), 4, swing[..., None] * np.cross(heading, [0, 1, 0.01]))
    parts.add(*ribbons(leaf, rng.uniform(0, 6, leaves), np.array([0.004, 0.03, 0.03, 0.002])), parent=on)
    return parts.scene().clip


@pytest.mark.slow
@pytest.mark.parametrize("fraction", [5e-4, 1e-3])
def test_what_stands_still_is_counted_where_files_of_a_few_kilobytes_are_compared(fraction):
    """The mean pose of what moves was chosen in a search that did not see it: the file was twice as large."""
    scene = singles.tree_on_terrain(side=100)
    bound = 1e4 * fraction * bound_of(scene.clip.positions)
    alone = sum(size_of(scene.part(plant), bound, rest_error=None) for plant in np.unique(scene.plant))
    assert size_of(scene.bare(), bound, rest_error=None) <= 1.05 * alone


def test_common_motion_is_taken_off_as_if_plants_stood():
    standing = planted()
    time = np.linspace(0, 1, len(standing))[:, None]
    rocks = turns(0.3 * np.sin(4 * time) * [1.0, 0.0, 0.0])
    moved = standing @ rocks.transpose(0, 2, 1) + (time * [3.0, 0.5, 1.0])[:, None]
    assert without_common_motion(standing) is None
    assert np.abs(without_common_motion(moved) - standing).max() < 1e-6


def test_feet_of_several_plants_carry_all_of_them():
    standing = planted()
    found = Found(np.repeat(np.arange(9), 6), np.full(9, -1), None, "components")
    on_feet = carried(found, standing)
    assert on_feet.branch_parent.tolist() == [9] * 9 + [-1]
    feet = np.flatnonzero(on_feet.vertex_branch == 9)
    assert on_feet.is_carried and np.ptp(standing[0, feet], axis=0)[[0, 2]].min() > 1.5
    # The lowest two vertices of each plant stand still: half a ring would leave a tube that is none.
    assert len(feet) == 8 and set(feet % 6) == {0, 1} and set(feet[feet % 6 == 0] + 1) == set(feet[feet % 6 == 1])


def on_a_table(clip: MotionClip) -> MotionClip:
    """A clip whose scene turns once about the middle."""
    positions = clip.block(0, clip.frame_count).astype(np.float64)
    around = turns(np.linspace(0, 2 * np.pi, clip.frame_count)[:, None] * [0.0, 1.0, 0.0])
    middle = positions.mean(axis=(0, 1))
    return clip.replace(positions=((positions - middle) @ around.transpose(0, 2, 1) + middle).astype(np.float32))


SCENES = {
    "wheat": lambda: fields.ribbons(seed=102, plants=10, points=20),
    "hedge": lambda: fields.stems(seed=101, plants=6),
    "tubes": lambda: fields.tubes(seed=101, plants=10, rings=16, sides=5),
    "kelp": lambda: fields.kelp(seed=101, plants=4),
}


MORE = {"none": 500, "decades": 800}  # Bytes that one motion of all plants may take, by the ladder.
QUICK = {("wheat", "decades"), ("tubes", "none")}


@pytest.mark.parametrize(
    ("name", "ladder"),
    [
        pytest.param(*scene, marks=() if scene in QUICK else pytest.mark.slow)
        for scene in itertools.product(SCENES, MORE)
    ],
)
def test_several_plants_on_one_turntable_turn_once(name, ladder):
    clip = bare(SCENES[name]().clip)
    standing, turning = (size_of(one, bound_of(clip.positions), ladder=ladder) for one in (clip, on_a_table(clip)))
    assert turning <= 1.05 * standing + MORE[ladder]


def test_feet_that_stand_still_are_no_motion_of_the_rest():
    """A leaf that is held by its stalk may swing as a whole, although the stalk keeps its shape, too."""
    random = np.random.default_rng(8)
    leaf, stalk = random.uniform(-1, 1, (300, 3)) * [1.0, 0.05, 0.4], random.uniform(-1, 1, (20, 3)) * 0.3
    swings = turns(np.linspace(0, 1.5, 12)[:, None] * [0.0, 0.0, 1.0])
    swung = (leaf + [1.3, 0.0, 0.0]) @ swings.transpose(0, 2, 1)
    frames = np.concatenate([np.broadcast_to(stalk, (12, 20, 3)), swung], axis=1)
    left = without_common_motion(np.concatenate([frames[:1], frames]))
    assert left is not None and np.ptp(left[:, 20:], axis=0).max() < 0.2 * np.ptp(frames[:, 20:], axis=0).max()


def test_what_turns_and_keeps_its_shape_is_coded_about_the_middle_of_its_turns():
    rest = np.random.default_rng(9).random((80, 3))
    hierarchy = build_hierarchy(np.repeat([0, 1], 40), np.array([-1, -1]), rest)
    rest = rest[hierarchy.vertex_source]
    mean = 0.5 * rest @ turns(np.array([[0.0, 0.7, 0.0]]))[0].T
    pose = turned_pose(rest, mean, hierarchy)
    for tree in (slice(0, 40), slice(40, 80)):
        apart, before = (np.linalg.norm(one[tree] - one[tree][:1], axis=1) for one in (pose, rest))
        np.testing.assert_allclose(apart, before, atol=1e-12)
        np.testing.assert_allclose(pose[tree] - pose[tree][:1], 2 * (mean[tree] - mean[tree][:1]), atol=1e-9)


def test_organs_that_grow_in_proportion_do_not_stand_still():
    tree, random = blown_tree(3, 12, 24), np.random.default_rng(7)
    leaf, count = random.standard_normal((40, 3)) * [0.1, 0.1, 0.002], 12
    feet, size = 2 * random.standard_normal((count, 1, 3)), np.linspace(0.2, 1.0, tree.frame_count)
    leaves = (feet + np.multiply.outer(size, np.broadcast_to(leaf, (count, 40, 3)))).reshape(tree.frame_count, -1, 3)
    moving = tree.block(0, tree.frame_count)
    both = np.concatenate([moving, leaves], axis=1).astype(np.float32)
    of_leaves = np.repeat(np.arange(count), 40)
    label = np.concatenate([np.zeros(tree.vertex_count, int), 1 + of_leaves])
    bound = bound_of(both)

    def clip(positions: np.ndarray, labels: np.ndarray) -> MotionClip:
        parents = np.full(labels.max() + 1, -1)
        return MotionClip(positions, tree.time, rest=positions[-1], vertex_branch=labels, branch_parent=parents)

    alone = size_of(clip(both[:, : tree.vertex_count], 0 * label[: tree.vertex_count]), bound)
    alone += size_of(clip(both[:, tree.vertex_count :], of_leaves), bound)
    assert size_of(clip(both, label), bound) <= 1.2 * alone
