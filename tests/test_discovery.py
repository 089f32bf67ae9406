"""Branches for clips that name none: those of a dressed tree come back, whatever the file has lost, and every mesh is
compressed; what was found can be kept, edited and used again."""

from __future__ import annotations

import dataclasses
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from plants import plant, ring_quads, runs_of_points, turns

import athcodec
from athcodec import MotionClip
from athcodec.cli import main
from athcodec.encoding.decisions import FileDecisions
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.branch_trials import best_branches
from athcodec.encoding.search.progress import Work, allowed_work
from athcodec.errors import ClipError
from athcodec.motion.branches import finding, saving, seen
from athcodec.motion.branches.result import Found, hierarchy_on
from athcodec.motion.clip import Skin, source_stem_index
from athcodec.motion.hierarchy import branch_orders
from bench.odd.grass import ORDERS, grass
from bench.scenes.stems import swayed
from bench.trees.mesh import dress
from bench.trees.ride import rotations
from bench.trees.wind import Wind

pytestmark = pytest.mark.sizes

FRAMES = 24


@pytest.fixture(scope="module")
def dressed() -> MotionClip:
    """Bark tubes and 100 leaf cards on the sample tree, with the branches that they were made from."""
    with athcodec.read_hdf5(athcodec.sample_path()) as sample:
        return dress(sample, Wind(11.0, 8.0, seed=1), FRAMES, leaves=100, seed=3)


def bare(clip: MotionClip, **changes) -> MotionClip:
    """The clip without its branches."""
    return clip.replace(vertex_branch=None, branch_parent=None, stem_index=None, **changes)


def right_parents(found: athcodec.Found, clip: MotionClip) -> float:
    """Share of the branches found that are branches of the clip, on the right parent."""
    whose = clip.vertex_branch[np.unique(found.vertex_branch, return_index=True)[1]]
    parent = np.where(found.branch_parent < 0, -1, whose[found.branch_parent])
    return float((parent == clip.branch_parent[whose]).mean())


def renumbered(clip: MotionClip, order: np.ndarray) -> MotionClip:
    """The clip with vertex order[i] as vertex i."""
    place = np.argsort(order)
    return clip.replace(
        positions=clip.block(0, clip.frame_count)[:, order],
        faces=place[clip.faces],
        vertex_branch=clip.vertex_branch[order],
        stem_index=None,
        rest=clip.source_rest[order],
    )


def test_tubes_and_leaves_are_found_again(dressed):
    found = athcodec.find_branches(bare(dressed))
    assert found.method == "components"
    assert len(found.branch_parent) == dressed.branch_count
    assert right_parents(found, dressed) > 0.98


def test_branches_are_found_whatever_the_order_of_the_vertices(dressed):
    mixed = renumbered(dressed, np.random.default_rng(0).permutation(dressed.vertex_count))
    found = athcodec.find_branches(bare(mixed))
    assert right_parents(found, mixed) > 0.98
    trunk = found.vertex_branch == np.flatnonzero(found.branch_parent < 0)[0]
    height, place = mixed.rest[trunk, 1], found.stem_index[trunk]
    assert np.corrcoef(height, place)[0, 1] > 0.9, "the trunk does not run from base to tip"


def test_a_mesh_that_was_split_along_its_seams_hangs_together(dressed):
    corners = dressed.faces.reshape(-1)
    split = MotionClip(
        dressed.block(0, FRAMES)[:, corners],
        dressed.time,
        rest=dressed.rest[corners],
        faces=np.arange(len(corners)).reshape(-1, 4),
    )
    found = athcodec.find_branches(split, "components")
    assert len(found.branch_parent) == dressed.branch_count


def test_the_hierarchy_found_costs_no_more_than_the_true_one(dressed, tmp_path):
    known = athcodec.encode(dressed, tmp_path / "a.ath", rel_error=1e-4, effort="fast")
    found = athcodec.encode(bare(dressed), tmp_path / "b.ath", rel_error=1e-4, effort="fast")
    assert found.bytes < 1.05 * known.bytes


@pytest.mark.parametrize("domain", ["vertex", "face"])
def test_attributes_named_like_branch_ids_are_used(dressed, domain):
    labels = 10 * dressed.vertex_branch + 5  # any numbers
    if domain == "face":
        labels = labels[dressed.faces[:, 0]]
    found = athcodec.find_branches(bare(dressed, attributes={"primvars:Branch_ID": labels}))
    assert found.method == "attributes" and " branches by attributes (primvars:Branch_ID): " in str(found)
    assert right_parents(found, dressed) > 0.98


def test_labels_with_parents_are_taken_as_they_are(dressed):
    attributes = {"branch": dressed.vertex_branch, "branch_parent_of": np.zeros(3), "parent": dressed.branch_parent}
    found = athcodec.find_branches(bare(dressed, attributes=attributes))
    assert np.array_equal(found.branch_parent, dressed.branch_parent)
    assert np.array_equal(found.vertex_branch, dressed.vertex_branch)


def test_a_skin_gives_its_joints(dressed):
    joints = np.append(dressed.branch_parent, 0).astype(np.int32)  # one more joint, which moves nothing
    found = athcodec.find_branches(bare(dressed, skin=Skin(joints, dressed.vertex_branch)))
    assert found.method == "skeleton"
    assert np.array_equal(found.branch_parent, dressed.branch_parent)


def test_centre_lines_give_their_stems():
    with athcodec.read_hdf5(athcodec.sample_path()) as sample:
        found = athcodec.find_branches(bare(sample))
        assert found.method == "edges"
        assert branch_orders(found.branch_parent).max() == branch_orders(sample.branch_parent).max()


def walker(frames: int = 20) -> MotionClip:
    """One closed mesh, a body on four legs, whose legs swing: no pieces, no edges, no names."""
    rings, around = 60, 24
    angle = 2 * np.pi * np.arange(around) / around
    along = np.linspace(-1, 1, rings)
    across = 0.3 * np.stack([np.sin(angle), np.cos(angle)], axis=1)
    body = np.column_stack([np.repeat(along, around), np.tile(across, (rings, 1))])
    legs = np.abs(np.abs(body[:, 0]) - 0.75) < 0.12
    drop = legs & (body[:, 1] < -0.1)
    body[drop, 1] *= 4
    time = np.arange(frames) / 30
    positions = np.repeat(body[None], frames, axis=0)
    for front in (-1, 1):
        for left in (-1, 1):
            leg = drop & (np.sign(body[:, 0]) == front) & (np.sign(body[:, 2]) == left)
            swing = 0.4 * np.sin(2 * np.pi * 1.7 * time + front + 2 * left)
            lever = body[leg, 1] + 0.1
            positions[:, leg, 0] += -np.sin(swing)[:, None] * lever
            positions[:, leg, 1] += (np.cos(swing)[:, None] - 1) * lever
    positions[:, :, 1] += 0.05 * np.sin(2 * np.pi * 3.4 * time)[:, None]
    positions[:, :, 2] += 0.1 * np.sin(3 * body[:, 0] + 4 * time[:, None])
    return MotionClip(positions.astype(np.float32), time, faces=ring_quads(rings, around))


@pytest.mark.slow
def test_a_mesh_of_one_piece_gets_patches_that_move_rigidly(tmp_path):
    clip = walker()
    found = athcodec.find_branches(clip)
    assert found.method == "motion"
    assert 1 < len(found.branch_parent) < clip.vertex_count / 10
    result = athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-3, effort="fast")
    assert result.bytes < clip.frame_count * clip.vertex_count * 12 / 50
    with athcodec.open(tmp_path / "a.ath") as decoder:
        apart = np.linalg.norm(decoder.positions(dtype=np.float64) - clip.block(0, clip.frame_count), axis=2)
        assert apart.max() <= result.max_error_bound


@pytest.mark.parametrize("vertices", [1, 2, *(pytest.param(count, marks=pytest.mark.slow) for count in (5, 40))])
def test_points_without_any_mesh_are_compressed_too(tmp_path, vertices):
    rng = np.random.default_rng(vertices)
    clip = MotionClip(rng.normal(size=(6, vertices, 3)).astype(np.float32), np.arange(6.0))
    result = athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-3)
    with athcodec.open(tmp_path / "a.ath") as decoder:
        apart = np.linalg.norm(decoder.positions(dtype=np.float64) - clip.block(0, 6), axis=2)
        assert apart.max() <= result.max_error_bound


ORDERS_OF_RUNS = ("runs", "interleaved", "shuffled")
RUNS = {
    "blades of 3 to 11 points": dict(counts=[3 + 7 * n % 9 for n in range(90)]),
    "blades with three points in the ground": dict(counts=[8] * 60, still=3),
    "needles of 2 points in the air": dict(counts=[2] * 80, drift=0.5),
    "strands of 30 points, loose at both ends": dict(counts=[30] * 12, drift=0.3),
}


@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("order", ORDERS_OF_RUNS)
def test_runs_of_points_are_found_whatever_their_order(name, order):
    clip = runs_of_points(**RUNS[name], order=order)
    found = athcodec.find_branches(bare(clip))
    assert found.method == "runs"
    assert len(found.branch_parent) == clip.branch_count
    assert (found.branch_parent < 0).all()
    pairs = np.stack([found.vertex_branch, clip.vertex_branch], axis=1)
    assert len(np.unique(pairs, axis=0)) == clip.branch_count, "points of several runs in one branch"
    place = source_stem_index(clip.vertex_branch) if clip.stem_index is None else clip.stem_index
    last = np.bincount(clip.vertex_branch)[clip.vertex_branch] - 1
    turned = found.stem_index != place
    assert (found.stem_index == np.where(turned, last - place, place)).all(), "points are not in the order of their run"
    assert "drift" in RUNS[name] or not turned[place == 0].any(), "a run does not begin at its base"


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_branches_of_points_are_sought_in_few_frames_too(frames):
    rng, time, along = np.random.default_rng(1), np.arange(frames)[:, None, None], np.linspace(0, 0.3, 8)
    base, phase = rng.uniform(0, 5, (600, 2)).T[..., None], rng.uniform(0, 6, (600, 1))
    bent = base[0] + 0.3 * along**2 * np.sin(time + phase), base[1] + 0.2 * along**2 * np.cos(2 * time + phase)
    points = np.stack([*bent, along + 0 * bent[0]], axis=-1).reshape(frames, -1, 3)[:, rng.permutation(4800)]
    found = athcodec.find_branches(MotionClip(points.astype(np.float32), np.arange(float(frames))))
    assert len(found.vertex_branch) == 4800


def test_many_points_in_few_frames_are_not_searched_beyond_the_work_allowed(monkeypatch):
    clip = MotionClip(np.random.default_rng(2).normal(size=(3, 40_000, 3)).astype(np.float32), np.arange(3.0))
    monkeypatch.setitem(finding._FINDERS, "runs", lambda *_: pytest.fail("the points were searched"))
    work = Work(allowed_work(clip.vertex_count, clip.frame_count, "default") / 2)
    found, _ = best_branches(clip, BoundOption(rel_error=1e-4), work)
    assert found.branch_parent.tolist() == [-1]


@pytest.fixture(scope="module")
def named_grass(tmp_path_factory) -> int:
    """Bytes of a meadow whose blades are named, in order."""
    clip = grass(seed=1, blades=150, frames=48)
    path = tmp_path_factory.mktemp("grass") / "a.ath"
    return athcodec.encode(clip, path, rel_error=1e-3, attributes="none", effort="fast").bytes


@pytest.mark.parametrize(
    "order", [pytest.param(order, marks=() if order == "shuffled" else pytest.mark.slow) for order in ORDERS]
)
def test_unnamed_blades_take_hardly_more_than_named_ones(order, named_grass, tmp_path):
    clip = grass(seed=1, blades=150, frames=48, named=False, order=order)
    result = athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-3, attributes="none", effort="fast")
    permutation = result.chunk_bytes["HIERARCHY"] if order == "shuffled" else 0
    assert result.bytes - permutation < 1.05 * named_grass
    if order == "interleaved":
        assert result.chunk_bytes["HIERARCHY"] < 100


def test_loose_points_of_a_tree_get_its_centre_lines():
    with athcodec.read_hdf5(athcodec.sample_path()) as sample:
        found = athcodec.find_branches(bare(sample, edges=None))
        assert found.method == "runs"
        assert (found.branch_parent < 0).sum() == 1
        order = np.lexsort((found.stem_index, found.vertex_branch))
        along = found.vertex_branch[order[1:]] == found.vertex_branch[order[:-1]]
        ours = np.sort(np.stack([order[:-1], order[1:]], axis=1)[along], axis=1)
        edges = set(map(tuple, np.sort(sample.edges, axis=1).tolist()))
        assert sum(tuple(pair) in edges for pair in ours.tolist()) > 0.98 * len(ours)


def test_stems_of_loose_points_end_where_those_of_the_tree_do():
    with athcodec.read_hdf5(athcodec.sample_path()) as sample:
        found = athcodec.find_branches(bare(sample, edges=None))
        order = np.lexsort((found.stem_index, found.vertex_branch))
        along = found.vertex_branch[order[1:]] == found.vertex_branch[order[:-1]]
        assert (sample.vertex_branch[order[1:]] == sample.vertex_branch[order[:-1]])[along].all()


def test_a_branch_that_was_found_hangs_on_the_vertex_that_its_link_names():
    rest = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0.1, 2, 0], [1, 2, 0]], float)
    found = Found(np.array([0, 0, 0, 1, 1]), np.array([-1, 0]), None, "runs", links=np.array([[1, 3]]))
    assert hierarchy_on(found, rest, None).attach.tolist() == [-1, 1]
    assert hierarchy_on(dataclasses.replace(found, links=None), rest, None).attach.tolist() == [-1, 2]


def sheet(frames: int = 24) -> np.ndarray:
    """A flag of 20 x 30 points."""
    u, v = (grid.reshape(-1) / 10 for grid in np.meshgrid(np.arange(20), np.arange(30)))
    time = np.linspace(0, 6, frames)[:, None]
    return np.stack([u + 0 * time, 0.3 * u * np.sin(2 * u + v - 3 * time), v + 0 * time], axis=2)


def body(frames: int = 24) -> np.ndarray:
    """300 points of a thrown stone."""
    points = np.random.default_rng(0).normal(size=(300, 3))
    angle = np.linspace(0, 4, frames)
    cos, sin, zero = np.cos(angle), np.sin(angle), 0 * angle
    turn = np.array([[cos, -sin, zero], [sin, cos, zero], [zero, zero, zero + 1]]).transpose(2, 0, 1)
    return points @ turn + np.linspace(0, 5, frames)[:, None, None]


def noise(frames: int = 24) -> np.ndarray:
    return np.random.default_rng(0).normal(size=(frames, 300, 3))


@pytest.mark.parametrize("points", [sheet, body, noise])
def test_points_that_are_no_runs_are_taken_for_none(points):
    clip = MotionClip(points().astype(np.float32), np.arange(24.0))
    assert athcodec.find_branches(clip).method == "motion"
    with pytest.raises(ClipError, match="neighbours keep their distance"):
        athcodec.find_branches(clip, "runs")


@pytest.mark.parametrize("seed", [0, 2])
def test_leaves_are_found_among_points_scattered_over_them_in_no_order(seed):
    positions, leaf = scattered_leaves(seed)
    found = athcodec.find_branches(positions).vertex_branch
    in_both = np.zeros((found.max() + 1, leaf.max() + 1))
    np.add.at(in_both, (found, leaf), 1)
    assert in_both.max(axis=1).sum() > 0.9 * len(leaf)  # Few points are in the branch of another leaf,
    assert in_both.max(axis=0).sum() > 0.9 * len(leaf)  # and few leaves are divided.


def scattered_leaves(seed: int, leaves: int = 40, points: int = 25, frames: int = 30) -> tuple[np.ndarray, np.ndarray]:
    """A crown that sways, of leaves that turn by themselves, as points on them: positions (T, N, 3), and the leaf of
    each point, (N,)."""
    rng, time = np.random.default_rng(seed), np.arange(frames) / 30
    centre = rng.normal(size=(leaves, 3)) * [0.5, 0.3, 0.5] + [0, 2, 0]
    leaf = rng.permutation(np.repeat(np.arange(leaves), points))
    place = rng.uniform(-1, 1, (len(leaf), 3)) * [0.05, 0.005, 0.12]
    turned = np.einsum("tnij,nj->tni", rotations(swayed(rng, time, centre, 0.3))[:, leaf], place)
    crown = 0.1 * np.sin(2 * time)[:, None, None] * centre[leaf, 1:2] * [1, 0, 0]
    return (turned + centre[leaf] + crown).astype(np.float32), leaf


def test_far_pieces_are_plants_of_their_own(dressed):
    two = MotionClip(
        np.concatenate([dressed.block(0, FRAMES), dressed.block(0, FRAMES) + 500], axis=1),
        dressed.time,
        faces=np.concatenate([dressed.faces, dressed.faces + dressed.vertex_count]),
    )
    found = athcodec.find_branches(two)
    assert len(found.branch_parent) == 2 * dressed.branch_count
    assert (found.branch_parent < 0).sum() == 2


def test_the_trunk_can_be_named(dressed):
    vertex = int(np.flatnonzero(dressed.vertex_branch == 5)[0])
    found = athcodec.find_branches(bare(dressed), root=vertex)
    assert found.branch_parent[found.vertex_branch[vertex]] == -1


def test_what_was_found_is_kept_edited_and_used(dressed, tmp_path, capsys):
    source, kept, coded = (str(tmp_path / name) for name in ("a.h5", "a.json", "a.ath"))
    athcodec.write_hdf5(bare(dressed), source)
    assert main(["hierarchy", source, "--save", kept]) == 0
    assert f"{dressed.branch_count:,} branches by components" in capsys.readouterr().out
    content = json.loads(Path(kept).read_text())
    content["branches"][-1]["parent"] = 0
    Path(kept).write_text(json.dumps(content))
    assert main(["encode", source, coded, "--hierarchy", kept, "--effort", "fast"]) == 0
    with athcodec.open(coded) as decoder:
        assert decoder.file.branch_parent[-1] == 0
        found = athcodec.find_branches(bare(dressed))
        assert np.array_equal(decoder.file.vertex_branch, found.vertex_branch)
        assert np.array_equal(decoder.file.branch_parent[:-1], found.branch_parent[:-1])


def test_a_saved_hierarchy_comes_back_unchanged(dressed, tmp_path):
    mixed = renumbered(dressed, np.random.default_rng(0).permutation(dressed.vertex_count))
    found = athcodec.find_branches(bare(mixed))
    saving.save(found, tmp_path / "a.json")
    again = saving.load(tmp_path / "a.json")
    for name in ("vertex_branch", "branch_parent", "stem_index"):
        assert np.array_equal(getattr(found, name), getattr(again, name)), name


def one_branch(vertex_count: int, parent: int, vertices: str) -> str:
    branch = {"branch": 0, "parent": parent, "vertices": vertices}
    return json.dumps({"vertex_count": vertex_count, "branches": [branch]})


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "got no branches"),
        ("[]", "got no branches"),
        ('{"vertex_count": 3, "branches": [{}]}', "got no branches"),
        (one_branch(3, -1, "0-1"), "expected each of 3 vertices"),
        (one_branch(2, 0, "0-1"), "its own parent"),
        (one_branch(2, -1, "0-x"), "got no branches"),
        (one_branch(2, -1, "0-99999999999999"), "got no branches"),
    ],
)
def test_a_file_without_usable_branches_is_refused(tmp_path, text, message):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ClipError, match=message):
        saving.load(tmp_path / "a.json")


def test_a_method_without_the_data_that_it_needs_is_refused(dressed):
    with pytest.raises(ClipError, match="expected joints with weights"):
        athcodec.find_branches(bare(dressed), "skeleton")
    with pytest.raises(ValueError, match="method: got 'luck'"):
        athcodec.find_branches(bare(dressed), "luck")


def trial_bounds(clip: MotionClip, path: Path, monkeypatch, **options) -> list[float]:
    """The bounds that candidates for branches are tried at, in scene units."""
    bounds: list[float] = []
    tried = FileDecisions.tried

    def noted(decisions: FileDecisions, bound: float, *more) -> object:
        bounds.append(bound)
        return tried(decisions, bound, *more)

    with monkeypatch.context() as patch:
        patch.setattr(FileDecisions, "tried", noted)
        athcodec.encode(clip, path, effort="fast", **options)
    return bounds


@pytest.fixture
def loose_points() -> MotionClip:
    """Points without a mesh, whose branches only their motion shows: several candidates are tried."""
    clip = plant(seed=3, branches=4, frames=20)
    return MotionClip(clip.block(0, clip.frame_count), clip.time)


def test_candidates_for_branches_are_tried_at_the_bound_of_the_file(loose_points, tmp_path, monkeypatch):
    assert len(list(finding.candidates(loose_points))) > 1
    bounds = trial_bounds(loose_points, tmp_path / "a.ath", monkeypatch, max_error=0.02)
    assert len(bounds) > 1
    assert set(bounds) == {0.02}


def test_candidates_for_branches_of_a_lossless_file_are_tried_lossless(loose_points, tmp_path, monkeypatch):
    lossy = trial_bounds(loose_points, tmp_path / "a.ath", monkeypatch)
    lossless = trial_bounds(loose_points, tmp_path / "b.ath", monkeypatch, lossless=True)
    assert max(lossless) < 0.1 * min(lossy)


@pytest.mark.slow
def test_candidates_for_branches_are_tried_at_a_bound_that_meets_the_target_size(loose_points, tmp_path, monkeypatch):
    tried = []
    for bound in (0.1, 0.001):
        size = athcodec.encode(loose_points, tmp_path / "a.ath", max_error=bound, effort="fast").bytes
        tried.append(trial_bounds(loose_points, tmp_path / "b.ath", monkeypatch, target_size=size))
    loose, tight = (Counter(bounds).most_common(1)[0][0] for bounds in tried)  # the one that all are judged at
    assert loose > 10 * tight


def test_leaves_that_touch_and_move_by_themselves_are_branches_of_their_own(tmp_path):
    rng, count, frames = np.random.default_rng(5), 40, 30
    leaf = np.array([[0, 0, 0], [1, 0.3, 0], [2, 0, 0], [1, -0.3, 0]])
    base = np.array([[i % 5, i // 5, 0] for i in range(count)], float)
    base[1::2] = base[::2]  # two on each place
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = 0.5 * np.sin(np.arange(frames)[:, None] / 3 + np.arange(count))
    positions = (leaf @ turns(angles[..., None] * axes).swapaxes(2, 3) + base[:, None]).reshape(frames, -1, 3)
    faces = (np.array([[0, 1, 2, 3]]) + 4 * np.arange(count)[:, None]).astype(np.int32)
    clip = MotionClip(positions.astype(np.float32), np.arange(frames) / 30, faces=faces)
    assert len(athcodec.find_branches(clip).branch_parent) == count // 2
    summary = athcodec.encode(clip, tmp_path / "a.ath", rel_error=1e-3)
    assert summary.found_branches.startswith(f"{count} branches by components")


def test_pieces_need_no_scipy_and_are_those_that_hang_together(dressed, monkeypatch):
    expected = seen.components(seen.links_of(dressed), dressed.vertex_count)
    for module in (finding, seen):
        monkeypatch.setattr(module, "scipy_module", None)
    found = finding.pieces(bare(dressed))
    assert np.array_equal(found.vertex_branch, expected) and (found.branch_parent == -1).all()
    assert len(finding.pieces(bare(dressed, faces=None, edges=None)).branch_parent) == 1


def test_branches_are_found_for_whatever_is_encoded(tmp_path):
    clip = bare(plant(seed=3, branches=5, frames=20), edges=None)
    positions = clip.block(0, 20)
    expected = athcodec.find_branches(clip)
    np.savez(tmp_path / "a.npz", positions=positions)
    athcodec.encode(clip, tmp_path / "a.ath", lossless=True, effort="fast")
    with athcodec.open(tmp_path / "a.ath") as decoder:
        sources = [positions, positions.tolist(), decoder, athcodec.ClipView(decoder), tmp_path / "a.npz"]
        for source in (*sources, str(tmp_path / "a.npz")):
            found = athcodec.find_branches(source)
            assert found.method == expected.method and np.array_equal(found.vertex_branch, expected.vertex_branch)
            assert np.array_equal(found.branch_parent, expected.branch_parent)
    whole = athcodec.find_branches(positions, "motion", root=3, fps=24, unit="m")
    data = athcodec.encode(
        positions, vertex_branch=whole.vertex_branch, branch_parent=whole.branch_parent, effort="fast"
    )
    with athcodec.open(data) as again:
        assert np.array_equal(again.file.vertex_branch, whole.vertex_branch)
    faces = np.array([[0, 1, 2], [2, 1, 3], [4, 5, 6], [6, 5, 7]])
    pieces = athcodec.find_branches(positions[:, :8], "components", faces=faces)
    assert len(pieces.branch_parent) == 2 and pieces.vertex_branch.tolist() == [0] * 4 + [1] * 4
    for wrong, error in ((np.zeros((4, 5)), ClipError), (tmp_path / "a.ath", ClipError), ("none.h5", OSError)):
        with pytest.raises(error):
            athcodec.find_branches(wrong)
    with pytest.raises(ClipError, match="did you mean 'm'"):
        athcodec.find_branches(positions, unit="meter")
