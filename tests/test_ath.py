"""The affine transform hierarchy: its maps and residuals, what TAM accepts, its cuts and its limits;
the survey that makes it for any thresholds from one reading of the clip.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from plants import clip_of

from athcodec.encoding.clip import survey as ath_module
from athcodec.encoding.clip.survey import Ath, Gaps, build_ath, survey
from athcodec.errors import ClipError
from athcodec.motion.clip import MotionClip
from athcodec.motion.thresholds import Thresholds

FRAMES = 12
BUSHY = (np.tile(np.arange(6), 8), [-1, 0, 0, 1, 1, 2])
"""Six branches of eight vertices, three levels deep, their vertices interleaved in the source."""


def rotations(count: int, seed: int = 0) -> np.ndarray:
    """(count,3,3) proper rotations."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(count, 3, 3)))
    return q * np.sign(np.linalg.det(q))[:, None, None]


def make_clip(rest: np.ndarray, positions: np.ndarray, vertex_branch: np.ndarray, branch_parent: list) -> MotionClip:
    return clip_of(positions, rest, vertex_branch, np.array(branch_parent), np.float64)


def bushy_clip(noise: float, seed: int = 1) -> MotionClip:
    """Every vertex moves anyhow."""
    rng = np.random.default_rng(seed)
    rest = rng.normal(size=(48, 3))
    return make_clip(rest, rest + noise * rng.normal(size=(FRAMES, 48, 3)), *BUSHY)


def one_branch(rest: np.ndarray, positions: np.ndarray) -> tuple[MotionClip, Ath]:
    clip = make_clip(rest, positions, np.zeros(len(rest), int), [-1])
    return clip, build_ath(clip, max_error=1e-9)


def subtree(ath: Ath, node: int) -> np.ndarray:
    """Source numbers of a node's vertices."""
    return ath.hierarchy.vertex_source[slice(*ath.hierarchy.subtree_range(ath.node_branch[node]))]


def apply(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ np.swapaxes(matrices[:, :, :3], 1, 2) + matrices[:, None, :, 3]


def rms(error: np.ndarray) -> float:
    return float(np.sqrt((error**2).sum(axis=-1).mean()))


def node_of(ath: Ath, branch: int) -> int | None:
    """The node of a branch of the source, or None."""
    found = np.flatnonzero(ath.hierarchy.branch_source[ath.node_branch] == branch)
    return int(found[0]) if len(found) else None


def test_a_map_applied_to_its_residual_gives_the_motion_back():
    clip = bushy_clip(noise=0.2)
    ath = build_ath(clip, max_error=0.0)
    assert ath.node_count == 6
    for node in range(ath.node_count):
        restored = apply(ath.affine(clip, node), ath.residual(clip, node))
        np.testing.assert_allclose(restored, clip.positions[:, subtree(ath, node)], atol=1e-9)


def test_maps_are_the_least_squares_solution():
    clip = bushy_clip(noise=0.2)
    ath = build_ath(clip, max_error=0.0)
    homogeneous = np.column_stack([clip.rest, np.ones(48)])
    for node in range(ath.node_count):
        vertices = subtree(ath, node)
        expected = [np.linalg.lstsq(homogeneous[vertices], frame[vertices])[0].T for frame in clip.positions]
        np.testing.assert_allclose(ath.affine(clip, node), expected, atol=1e-10)


def test_rigid_motion_far_from_the_origin_is_one_node():
    rest = bushy_clip(0.0).rest + 1000.0
    moved = rest @ np.swapaxes(rotations(FRAMES), 1, 2) + np.linspace(0, 50, FRAMES)[:, None, None]
    ath = build_ath(make_clip(rest, moved, *BUSHY), max_error=1e-9)
    assert ath.table1() == {"depth": 1, "nodes": 1, "leaves": 1, "epsilon": 1e-9, "eta": 0, "xi": 1e-9, "lam": 0}
    assert ath.whole.tolist() == [True]


def test_a_rigid_subtree_of_a_moving_plant_is_accepted_whole():
    clip = bushy_clip(noise=0.3)
    rigid = np.isin(clip.vertex_branch, [1, 3, 4])
    positions = clip.positions.copy()
    positions[:, rigid] = clip.rest[rigid] @ np.swapaxes(rotations(FRAMES), 1, 2)
    ath = build_ath(make_clip(clip.rest, positions, clip.vertex_branch, clip.branch_parent), max_error=1e-9)
    assert ath.whole[node_of(ath, 1)]
    assert node_of(ath, 3) is None and node_of(ath, 4) is None
    assert not ath.whole[[node_of(ath, 0), node_of(ath, 2), node_of(ath, 5)]].any()
    assert ath.height == 2


@pytest.mark.parametrize("extents", [(1, 0, 0), (1, 1, 0), (1, 1, 1e-7), (1, 1e-7, 1e-7), (0, 0, 0)])
def test_straight_flat_and_point_like_subtrees_that_move_rigidly_keep_their_shape(extents):
    turned = rotations(1, seed=5)[0]
    rest = np.random.default_rng(2).normal(size=(20, 3)) * extents @ turned
    clip, ath = one_branch(rest, rest @ np.swapaxes(rotations(FRAMES), 1, 2) + 3.0)
    matrices = ath.affine(clip, 0)
    np.testing.assert_allclose(np.linalg.det(matrices[:, :, :3]), 1.0, atol=1e-4)
    np.testing.assert_allclose(ath.residual(clip, 0), np.broadcast_to(rest, clip.positions.shape), atol=1e-6)
    np.testing.assert_allclose(ath.approximation(clip.positions, 0), clip.positions, atol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_a_flat_subtree_turns_its_normal_with_it(seed):
    rest = np.random.default_rng(seed).normal(size=(20, 3)) * (1, 1, 0) @ rotations(1, seed)[0]
    turns = rotations(FRAMES)
    clip, ath = one_branch(rest, rest @ np.swapaxes(turns, 1, 2))
    np.testing.assert_allclose(ath.affine(clip, 0)[:, :, :3], turns, atol=1e-9)


def test_a_straight_branch_inherits_its_twist_from_the_parent():
    trunk = np.random.default_rng(3).normal(size=(10, 3))
    twig = np.array([[0, 0, 1.0], [0, 0, 2.0], [0, 0, 3.0]])
    turns = rotations(FRAMES)
    rest = np.concatenate([trunk, twig])
    positions = rest @ np.swapaxes(turns, 1, 2)
    positions[:, -3:] *= 1.5  # the twig stretches, so that it is a node of its own
    clip = make_clip(rest, positions, np.repeat([0, 1], [10, 3]), [-1, 0])
    ath = build_ath(clip, max_error=1e-9)
    left, _, right = np.linalg.svd(ath.affine(clip, 0)[:, :, :3])
    parent_turn = left @ right
    own_turn = ath.affine(clip, 1)[:, :, :3] / (1, 1, 1.5)
    np.testing.assert_allclose(own_turn[:, :, 2], turns[:, :, 2], atol=1e-9)
    np.testing.assert_allclose(np.swapaxes(own_turn, 1, 2) @ own_turn - np.eye(3), 0, atol=1e-9)
    # From the parent's turn to the twig's by no more than the angle between their axes.
    cosine = (own_turn[:, :, 2] * parent_turn[:, :, 2]).sum(axis=1)
    np.testing.assert_allclose((own_turn * parent_turn).sum(axis=(1, 2)), 1 + 2 * cosine, atol=1e-9)


def test_a_frame_that_flattens_a_subtree_does_not_blow_up_its_residual():
    rng = np.random.default_rng(4)
    rest = rng.normal(size=(30, 3))
    frames = [rest * kept for kept in ((1, 1, 1), (1, 1, 0), (1, 0, 0), (0, 0, 0))] * 5
    clip, ath = one_branch(rest, np.stack(frames) + 1e-3 * rng.normal(size=(20, 30, 3)))
    assert (np.linalg.det(ath.affine(clip, 0)[:, :, :3]) > 0).all()  # and none turns inside out
    residual = ath.residual(clip, 0)
    assert np.abs(residual - rest).max() < 2 * np.abs(rest).max()
    np.testing.assert_allclose(apply(ath.affine(clip, 0), residual), clip.positions, atol=1e-9)


def test_residuals_are_at_most_ten_times_the_error_of_the_map():
    rng = np.random.default_rng(6)
    rest = np.column_stack([np.linspace(0, 1, 20), 0.01 * rng.normal(size=(20, 2))])
    clip, ath = one_branch(rest, rest + 0.02 * rng.normal(size=(200, 20, 3)))
    error = np.linalg.norm(ath.approximation(clip.positions, 0) - clip.positions, axis=2)
    distance = np.linalg.norm(ath.residual(clip, 0) - rest, axis=2)
    assert (distance <= 10 * error + 1e-9).all()


def test_a_plant_that_grows_from_nearly_nothing_is_one_node():
    rest = np.random.default_rng(7).normal(size=(30, 3))
    clip, ath = one_branch(rest, rest * np.linspace(0.01, 1, FRAMES)[:, None, None])
    assert ath.whole.all()


def test_every_cut_partitions_the_vertices(sample_clip):
    ath = build_ath(sample_clip, max_error=0.01)
    for depth in range(ath.height + 2):
        pieces = ath.cut(depth)
        assert pieces[0].first_vertex == 0 and pieces[-1].stop_vertex == sample_clip.vertex_count
        assert all(a.stop_vertex == b.first_vertex for a, b in zip(pieces, pieces[1:], strict=False))
    assert len(ath.cut(0)) == 1
    assert ath.cut(ath.height + 1) == ath.cut(ath.height)


def test_a_cut_divides_exactly_the_nodes_above_its_depth():
    clip = bushy_clip(noise=0.3)
    cut = build_ath(clip, max_error=0.0).cut(1)
    # file order: 0, (1, 3, 4), (2, 5)
    assert [tuple(piece) for piece in cut] == [(0, 0, 8, True), (1, 8, 32, False), (4, 32, 48, False)]


def test_a_deeper_cut_never_has_a_larger_rms_error(sample_clip):
    ath = build_ath(sample_clip, max_error=1e-4)
    positions = sample_clip.block(0, sample_clip.frame_count)
    errors = [rms(ath.approximation(positions, depth) - positions) for depth in range(ath.height + 1)]
    assert len(errors) == 3
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.2 * errors[0]


def test_pieces_of_a_rigid_plant_do_not_gape_and_those_of_a_bending_one_do(sample_clip):
    bending = build_ath(sample_clip, max_error=1e-4)
    assert bending.attachment_gaps(sample_clip, 0) == Gaps(0.0, 0.0)
    gaps = bending.attachment_gaps(sample_clip, 1)
    assert gaps.max > gaps.rms > 1e-3

    rest = bushy_clip(0.0).rest
    rigid = make_clip(rest, rest @ np.swapaxes(rotations(FRAMES), 1, 2), *BUSHY)
    divided = build_ath(rigid, max_error=0.0)
    assert divided.height == 2
    assert divided.attachment_gaps(rigid, 2).max < 1e-12


def test_a_gap_is_the_distance_between_the_two_places_of_the_attach_vertex():
    clip = bushy_clip(noise=0.3)
    ath = build_ath(clip, max_error=0.0)
    hierarchy = ath.hierarchy
    gaps = []
    for child in (1, 4):  # the branches on the trunk, in file order
        attach = ath.rest[hierarchy.attach[child]]
        trunk = clip.positions[:, hierarchy.vertex_source[:8]]
        homogeneous = np.column_stack([ath.rest[:8], np.ones(8)])
        stem_map = np.stack([np.linalg.lstsq(homogeneous, frame)[0].T for frame in trunk])
        child_map = ath.affine(clip, child)
        gaps.append(np.linalg.norm(apply(stem_map, attach[None]) - apply(child_map, attach[None]), axis=2))
    measured = ath.attachment_gaps(clip, 1)
    np.testing.assert_allclose(measured, (np.max(gaps), np.sqrt(np.mean(np.square(gaps)))))


def test_eta_is_the_number_of_frames_that_may_exceed_epsilon():
    clip = bushy_clip(noise=0.0)
    positions = clip.positions.copy()
    positions[[2, 5, 7]] += 0.3 * np.random.default_rng(8).normal(size=(3, 48, 3))
    shaken = make_clip(clip.rest, positions, clip.vertex_branch, clip.branch_parent)
    assert build_ath(shaken, 0.01, 3, np.inf, 0).node_count == 1
    assert build_ath(shaken, 0.01, 2, np.inf, 0).node_count > 1


def test_lambda_is_the_number_of_vertices_that_may_be_further_than_xi_in_a_frame():
    clip = bushy_clip(noise=0.0)
    positions = clip.positions.copy()
    positions[4, [3, 10]] += (0.0, 0.5, 0.0)
    positions[9, [20]] += (0.0, 0.5, 0.0)
    plucked = make_clip(clip.rest, positions, clip.vertex_branch, clip.branch_parent)
    assert build_ath(plucked, np.inf, 0, 0.2, 2).node_count == 1
    assert build_ath(plucked, np.inf, 0, 0.2, 1).node_count > 1


def test_epsilon_bounds_the_mean_distance_and_xi_the_largest():
    clip = bushy_clip(noise=0.05)
    ath = build_ath(clip, max_error=0.0)
    distance = np.linalg.norm(ath.residual(clip, 0) - ath.rest, axis=2)
    mean, largest = distance.mean(axis=1).max(), distance.max()
    for epsilon, xi, nodes in ((1.001 * mean, np.inf, 1), (np.inf, 1.001 * largest, 1)):
        assert build_ath(clip, epsilon, 0, xi, 0).node_count == nodes
    for epsilon, xi in ((0.999 * mean, np.inf), (np.inf, 0.999 * largest)):
        assert build_ath(clip, epsilon, 0, xi, 0).node_count > 1


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"epsilon": 1.0},
        {"epsilon": 1.0, "max_error": 1.0},
        {"max_error": -1.0},
        {"max_error": np.nan},
        {"max_error": 1.0, "eta": -1},
        {"max_error": 1.0, "max_depth": -1},
    ],
)
def test_unusable_thresholds_are_refused(arguments):
    with pytest.raises(ValueError, match="got"):
        build_ath(bushy_clip(noise=0.0), **arguments)


def test_positions_that_are_not_finite_are_refused():
    clip = bushy_clip(noise=0.1)
    clip.positions[3, 7, 1] = np.nan
    with pytest.raises(ClipError):
        build_ath(clip, max_error=0.1)


def test_looser_thresholds_give_a_pruned_copy_of_the_tighter_hierarchy(sample_clip):
    tight, loose = build_ath(sample_clip, max_error=1e-4), build_ath(sample_clip, max_error=0.05)
    assert loose.node_count < tight.node_count <= sample_clip.branch_count
    assert np.isin(loose.node_branch, tight.node_branch).all()
    for ath in (tight, loose):
        children = ath.node_parent >= 0
        assert not ath.whole[ath.node_parent[children]].any()
        assert (ath.node_depth[children] == ath.node_depth[ath.node_parent[children]] + 1).all()


def test_the_depth_limit_takes_what_is_below_whole():
    clip = bushy_clip(noise=0.3)
    ath = build_ath(clip, max_error=0.0, max_depth=1)
    assert ath.height == 1 and ath.node_count == 3
    assert ath.whole.tolist() == [False, True, True]
    assert build_ath(clip, max_error=0.0, max_depth=0).whole.tolist() == [True]


def test_several_roots_are_nodes_of_depth_zero():
    rng = np.random.default_rng(9)
    rest = rng.normal(size=(20, 3))
    clip = make_clip(rest, rest + 0.1 * rng.normal(size=(4, 20, 3)), np.repeat([0, 1], 10), [-1, -1])
    ath = build_ath(clip, max_error=0.0)
    assert ath.node_depth.tolist() == [0, 0] and len(ath.cut(0)) == 2


@pytest.mark.parametrize(
    "thresholds", [(0.02, 0, np.inf, 0), (0.02, 4, np.inf, 0), (0.02, 15, np.inf, 0), (np.inf, 0, 0.02, 3)]
)
def test_the_result_does_not_depend_on_how_the_frames_are_read(sample_clip, monkeypatch, thresholds):
    whole = build_ath(sample_clip, *thresholds)
    monkeypatch.setattr("athcodec.encoding.clip.survey._READ_VALUES", 3 * 1001 * 7)
    monkeypatch.setattr("athcodec.encoding.clip.survey._WORK_VERTICES", 3 * 1001)
    portions = build_ath(sample_clip, *thresholds)
    assert 1 < whole.node_count < sample_clip.branch_count
    np.testing.assert_array_equal(whole.node_branch, portions.node_branch)
    np.testing.assert_array_equal(whole.whole, portions.whole)


def test_of_a_chain_of_two_thousand_branches_only_the_subtrees_above_the_depth_limit_are_fitted(monkeypatch):
    rng = np.random.default_rng(10)
    rest = np.cumsum(0.01 * rng.normal(size=(4000, 3)) + (0, 0.05, 0), axis=0)
    positions = rest + np.cumsum(0.001 * rng.normal(size=(20, 4000, 3)), axis=1)
    clip = make_clip(rest, positions, np.repeat(np.arange(2000), 2), list(range(-1, 1999)))
    fitted, fit = [], ath_module.Pieces.fit
    monkeypatch.setattr(
        ath_module.Pieces,
        "fit",
        lambda pieces, frames: (fitted.append(pieces.counts.sum() * frames.shape[1]), fit(pieces, frames))[1],
    )
    ath = build_ath(clip, max_error=1e-6)
    assert sum(fitted) < 29 * clip.vertex_count * clip.frame_count
    assert ath.height == 29 and ath.node_count == 30 and ath.whole[-1]


def ancestors(ath: Ath, node: int) -> list[int]:
    above = []
    while (node := int(ath.node_parent[node])) >= 0:
        above.append(node)
    return above


def tam(distances: list[np.ndarray], thresholds: Thresholds) -> list[bool]:
    """TAM by its definition, from the distances (T,K) between each node's residual and its base places."""
    return [
        (distance.mean(axis=1) > thresholds.epsilon).sum() <= thresholds.eta
        and ((distance > thresholds.xi).sum(axis=1) <= thresholds.lam).all()
        for distance in distances
    ]


@pytest.mark.parametrize(("xi", "lam"), [(np.inf, 0), (0.36, 0), (0.25, 2), (0.2, 6), (0.1, 48)])
def test_a_survey_accepts_what_tam_accepts_by_its_definition(xi, lam, monkeypatch):
    # The frames come in several portions, with the worst one within.
    monkeypatch.setattr("athcodec.encoding.clip.survey._WORK_VERTICES", 5 * 48)
    clip = bushy_clip(noise=0.1)
    swell = np.sin(np.linspace(0, np.pi, FRAMES))
    clip.positions[:] = clip.rest + (clip.positions - clip.rest) * swell[:, None, None]
    full = build_ath(clip, max_error=0.0)
    rest = [full.rest[slice(*full.hierarchy.subtree_range(node))] for node in range(6)]
    distances = [np.linalg.norm(full.residual(clip, node) - rest[node], axis=2) for node in range(6)]
    surveyed = survey(clip, lam=min(lam, 2), xi=xi, eta=FRAMES - 1)
    results = set()
    for epsilon, eta in product((0.05, 0.12, 0.14, 0.15, np.inf), (0, 1, 5, FRAMES - 1, FRAMES)):
        thresholds = Thresholds(epsilon, eta, xi, lam)
        accepted = tam(distances, thresholds)
        ath = surveyed.ath(thresholds)
        kept = [node for node in range(6) if not any(accepted[above] for above in ancestors(full, node))]
        assert ath.node_branch.tolist() == kept
        assert ath.whole.tolist() == [accepted[node] for node in kept]
        results.add(tuple(kept))
    assert len(results) > 1


def test_thresholds_that_were_not_surveyed_are_refused():
    clip = bushy_clip(noise=0.1)
    plain, wide = survey(clip), survey(clip, lam=2, xi=0.2, eta=3)
    for surveyed, thresholds in (
        (plain, Thresholds(0.1, 1, 0.1, 0)),
        (plain, Thresholds(0.1, 0, 0.1, 1)),
        (wide, Thresholds(0.1, 4, 0.2, 2)),
        (wide, Thresholds(0.1, 3, 0.3, 2)),
    ):
        with pytest.raises(ValueError, match="got .* expected"):
            surveyed.ath(thresholds)
    assert wide.ath(Thresholds(0.0, 0, 0.3, 0)).node_count == 6
    assert plain.ath(Thresholds(0.0, FRAMES, np.inf, 0)).node_count == 1
