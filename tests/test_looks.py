"""Smoothness and shape of decoded motion, against motions and shapes whose figures are known."""

from __future__ import annotations

from math import inf
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import athcodec
from athcodec.metrics import MotionMeter, ShapeMeter, SmoothnessMeter, Spread, edges_of
from athcodec.motion.clip import MotionClip

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
"""A card in the plane z = 0, whose normal is the z axis."""


def moving(track: np.ndarray, vertices: int = 3) -> np.ndarray:
    """(T, vertices, 3): vertices that all move along x as `track` says."""
    frames = np.zeros((len(track), vertices, 3))
    frames[..., 0] = np.asarray(track)[:, None]
    return frames


def smoothness(source: np.ndarray, decoded: np.ndarray, block: int = 7, **how) -> SmoothnessMeter:
    meter = SmoothnessMeter(len(source), **how)
    for start in range(0, len(source), block):
        meter.add(source[start : start + block], decoded[start : start + block])
    return meter


def shape(source: np.ndarray, decoded: np.ndarray, edges=None, polygons=None, block: int = 2) -> ShapeMeter:
    meter = ShapeMeter(edges, polygons)
    for start in range(0, len(source), block):
        meter.add(source[start : start + block], decoded[start : start + block])
    return meter


def turned(points: np.ndarray, degrees: float) -> np.ndarray:
    """About the x axis."""
    angle = np.radians(degrees)
    return points @ np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])


# ---- smoothness ----


def test_an_error_that_sways_as_a_sine_has_the_second_difference_of_the_sine():
    frames, rate = np.arange(60), 0.3
    error = 0.01 * np.sin(rate * frames + 0.1)
    meter = smoothness(moving(frames * 0.5), moving(frames * 0.5 + error), bound=0.01)
    expected = (2 - 2 * np.cos(rate)) * np.abs(np.sin(rate * frames + 0.1))
    assert meter.max_error_acceleration == pytest.approx(expected[1:-1].max())
    assert meter.worst_frame == 1 + expected[1:-1].argmax()
    assert meter.error_acceleration[1:-1] == pytest.approx(0.01 * expected[1:-1])
    assert np.isnan(meter.error_acceleration[[0, -1]]).all()
    assert meter.worst_share == 0


def test_an_error_that_changes_sides_from_frame_to_frame_is_four_bounds_of_trembling():
    still, error = moving(np.zeros(20)), moving(0.5 * (-1.0) ** np.arange(20))
    meter = smoothness(still, still + error, bound=0.5)
    assert meter.max_error_acceleration == pytest.approx(4)
    assert meter.rms_error_acceleration == pytest.approx(4)
    assert (meter.worst_share, meter.median_share) == (1, 1)


def test_a_jump_at_a_seam_is_seen_there_and_nowhere_else():
    parabola, seam = 0.5 * np.arange(40.0) ** 2, 20
    error = np.where(np.arange(40) < seam, 0.1, -0.1)
    meter = smoothness(moving(parabola), moving(parabola + error), bound=0.1, starts=[0, seam])
    assert meter.max_error_acceleration == pytest.approx(2) and meter.worst_frame in (seam - 1, seam)
    assert (meter.worst_share, meter.median_share) == (1, 0)
    assert meter.rms_error_acceleration == pytest.approx(np.sqrt(2 * 2**2 / 38))
    assert meter.acceleration[[seam - 1, seam]] == pytest.approx([0.8, 1.2])
    assert meter.tick_ratio == pytest.approx(1.2)
    assert meter.source_tick_ratio == pytest.approx(1)


@pytest.mark.parametrize("frame, is_near", [(16, False), (17, True), (20, True), (21, False)])
def test_two_frames_on_either_side_are_near_a_seam(frame, is_near):
    track = 0.5 * np.arange(40.0) ** 2
    track[frame + 1 :] += 0.5 + np.arange(39 - frame) * 0.5  # a kink: one second difference of 1.5
    kinked = moving(track)
    meter = smoothness(kinked, kinked, starts=[0, 19])
    assert meter.acceleration[frame] == pytest.approx(1.5)
    assert meter.tick_ratio == meter.source_tick_ratio == pytest.approx(1.5 if is_near else 1)


def test_a_loop_has_a_seam_between_its_last_frame_and_its_first():
    angle = 2 * np.pi * np.arange(30) / 30
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None]
    whole = smoothness(circle, circle, starts=[0], loop=True)
    assert np.ptp(whole.acceleration) < 1e-12
    assert whole.tick_ratio == pytest.approx(1)
    jumps = circle.copy()
    jumps[-1] *= 1.5
    assert smoothness(circle, jumps, loop=True).tick_ratio > 20
    assert smoothness(circle, jumps, loop=True).source_tick_ratio == pytest.approx(1)
    assert smoothness(circle, jumps).tick_ratio is None, "without a loop there is no seam"


@given(st.integers(0, 2**32), st.integers(1, 12), st.integers(1, 9), st.booleans())
def test_blocks_of_any_length_give_the_same_figures(seed, frames, block, loop):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(frames, 4, 3))
    y = x + rng.normal(size=x.shape)
    how = {"bound": np.array([0.5, 1, 2, 3]), "starts": [0, frames // 2], "loop": loop}
    blockwise, at_once = smoothness(x, y, block, **how), smoothness(x, y, frames, **how)
    assert np.array_equal(blockwise.acceleration, at_once.acceleration, equal_nan=True)
    assert blockwise.tick_ratio == at_once.tick_ratio
    assert blockwise.rms_error_acceleration == pytest.approx(at_once.rms_error_acceleration)
    around = np.concatenate([y - x] * 3)[frames - 1 : 2 * frames + 1] if loop and frames > 1 else y - x
    expected = (
        np.linalg.norm(np.diff(around, 2, axis=0), axis=2) / how["bound"] if len(around) > 2 else np.zeros((1, 4))
    )
    assert blockwise.max_error_acceleration == pytest.approx(expected.max())
    assert blockwise.rms_error_acceleration == pytest.approx(np.sqrt((expected**2).mean()))
    assert blockwise.worst_share == (expected > 1).mean(axis=1).max()


def test_each_vertex_is_held_to_its_own_bound():
    still, error = moving(np.zeros(9), 2), moving((-1.0) ** np.arange(9), 2)
    clip = MotionClip(still.astype(np.float32), np.arange(9))
    meter = MotionMeter(clip, bound=8.0, weights=np.array([1.0, 4.0]))
    meter.add(still, still + error)
    figures = meter.figures()["smoothness"]
    assert figures["max_second_difference"] == pytest.approx(2), "4 of a bound of 2, which is a quarter of 8"
    assert figures["worst_share_above_bound"] == 0.5


def test_a_decoded_nan_is_an_infinite_second_difference():
    still = moving(np.zeros(8))
    broken = still.copy()
    broken[4, 1, 0] = np.nan
    meter = smoothness(still, broken, starts=[0, 4])
    assert meter.max_error_acceleration == meter.rms_error_acceleration == meter.tick_ratio == inf
    assert meter.source_tick_ratio == 0
    assert meter.worst_share == pytest.approx(1 / 3)


def test_more_frames_than_were_expected_are_refused():
    with pytest.raises(ValueError, match="more than 3"):
        SmoothnessMeter(3).add(moving(np.zeros(4)), moving(np.zeros(4)))


# ---- shape ----


def test_edges_stretch_by_what_a_plant_is_scaled_by():
    frames = np.stack([SQUARE, SQUARE + 5])
    ring = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    meter = shape(frames, frames * 1.25, ring)
    assert meter.stretch.rms == pytest.approx(0.25)
    assert meter.stretch.quantile(0.999) == pytest.approx(0.25, rel=0.004)
    assert shape(frames, frames + 3, ring).stretch.rms == 0
    assert shape(frames, frames[:, ::-1] - 9, ring).stretch.rms == 0


def test_a_card_that_is_folded_along_its_diagonal_shows_the_angle_on_the_folded_side():
    halves = np.array([3, 3]), np.array([0, 1, 2, 0, 2, 3])
    angle = np.radians(30)
    folded = SQUARE.copy()
    height = np.sqrt(0.5)  # of vertex 3 over the diagonal from 0 to 2
    folded[3] = [0.5, 0.5, 0] + height * np.cos(angle) * np.array([-1, 1, 0]) / np.sqrt(2)
    folded[3, 2] += height * np.sin(angle)
    meter = shape(SQUARE[None], folded[None], None, halves)
    assert meter.angle.quantile(1) == pytest.approx(30, rel=0.004)
    assert meter.angle.quantile(0.5) == 0
    assert meter.angle.rms == pytest.approx(30 / np.sqrt(2))
    assert (meter.degenerate_faces, meter.left_out_faces) == (0, 0)


@pytest.mark.parametrize("degrees", [1e-6, 0.01, 45, 90, 179.9])
def test_a_card_that_is_turned_shows_its_angle(degrees):
    meter = shape(SQUARE[None], turned(SQUARE, degrees)[None], None, (np.array([4]), np.arange(4)))
    assert meter.angle.rms == pytest.approx(degrees, rel=1e-6)


def test_a_face_that_trembles_turns_by_twice_the_angle_and_one_that_turns_with_its_source_does_not():
    card = (np.array([4]), np.arange(4))
    swinging = np.stack([turned(SQUARE, 10 * frame) for frame in range(8)])
    assert shape(swinging, swinging, None, card).excess_turn.rms == pytest.approx(0, abs=1e-6)
    still = np.stack([SQUARE] * 8)
    trembling = np.stack([turned(SQUARE, 5 * (-1) ** frame) for frame in range(8)])
    assert shape(still, trembling, None, card).excess_turn.quantile(0.999) == pytest.approx(10, rel=0.004)
    assert shape(still, trembling, None, card).excess_turn.count == 7, "blocks are joined"
    assert shape(swinging, still, None, card).excess_turn.rms == 0, "what turns less does not turn in excess"


def test_faces_that_collapse_are_counted_once_each():
    two = np.concatenate([SQUARE, SQUARE + [3, 0, 0]])
    flat = two.copy()
    flat[:4, 1] *= 0.9e-3
    cards = np.array([4, 4]), np.arange(8)
    frames = np.stack([two] * 3)
    assert shape(frames, np.stack([two, flat, flat]), None, cards).degenerate_faces == 1
    thin = two.copy()
    thin[:4, 1] *= 1.1e-3
    assert shape(frames, np.stack([two, thin, two]), None, cards).degenerate_faces == 0
    gone = two.copy()
    gone[:4] = 0
    meter = shape(frames[:1], gone[None], None, cards)
    assert meter.degenerate_faces == 1 and meter.angle.quantile(1) == pytest.approx(90, rel=0.004)


def test_what_has_no_extent_in_the_source_is_left_out_and_counted():
    point = np.concatenate([SQUARE, np.zeros((3, 3))])
    edges = np.array([[0, 1], [4, 5]])
    faces = np.array([4, 3]), np.arange(7)
    frames = np.stack([point, point])
    decoded = frames + np.random.default_rng(1).normal(size=frames.shape) * [[[0], [0], [0], [0], [1], [1], [1]]][0]
    meter = shape(frames, decoded, edges, faces)
    assert (meter.left_out_edges, meter.left_out_faces) == (2, 2)
    assert meter.stretch.rms == meter.angle.rms == 0 and meter.degenerate_faces == 0


def test_polygons_of_all_sizes_are_measured_in_one_clip():
    """A triangle, a square and a concave polygon, a face of two corners among them that is none."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [3, 0, 0], [3, 1, 0], [2, 1, 0]], float)
    star = np.array([[5, 0, 0], [7, 0, 0], [5.4, 0.4, 0], [5, 2, 0]], float)  # concave at its third corner
    frame = np.concatenate([points, star])
    polygons = np.array([3, 2, 4, 4]), np.array([0, 1, 2, 0, 1, 3, 4, 5, 6, 7, 8, 9, 10])
    meter = shape(frame[None], turned(frame, 20)[None], None, polygons)
    assert meter.face_count == 3 and meter.angle.count == 3
    assert meter.angle.rms == pytest.approx(20)


def test_edges_are_those_of_faces_before_those_given_before_neighbours_on_stems():
    frames = np.zeros((1, 5, 3), np.float32)
    stems = {"vertex_branch": np.array([0, 1, 0, 1, 0]), "branch_parent": np.array([-1, 0])}
    stems["stem_index"] = np.array([2, 0, 1, 1, 0])
    faces = {
        "attributes": {"face_vertex_counts": np.array([3, 4]), "face_vertex_indices": np.array([0, 1, 2, 0, 2, 3, 4])}
    }

    def pairs(**fields):
        return {tuple(sorted(map(int, edge))) for edge in edges_of(MotionClip(frames, [0.0], **fields))}

    edges = np.array([[0, 4]])
    assert pairs(**stems, edges=edges, **faces) == {(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (0, 4)}
    assert pairs(**stems, edges=edges) == {(0, 4)}
    assert pairs(**stems) == {(2, 4), (0, 2), (1, 3)}
    assert edges_of(MotionClip(frames, [0.0])) is None


def test_a_clip_without_faces_and_edges_has_no_figures_of_shape():
    clip = MotionClip(np.zeros((3, 2, 3), np.float32), np.arange(3))
    meter = MotionMeter(clip, bound=1.0)
    meter.add(clip.block(0, 3), clip.block(0, 3))
    assert meter.figures()["shape"]["rms_stretch"] is None
    assert meter.figures()["shape"]["rms_normal_angle"] is None
    assert meter.figures()["smoothness"]["tick_ratio"] is None


# ---- spreads ----


@given(st.lists(st.floats(0, 2.0**100, width=32), min_size=1, max_size=50), st.floats(0.01, 1))
def test_quantiles_are_at_most_four_in_a_thousand_too_large(values, fraction):
    spread = Spread()
    for value in values:
        spread.add(np.array([value]))
    expected = np.quantile(values, fraction, method="inverted_cdf")
    assert expected - 1e-38 <= spread.quantile(fraction) <= expected * 1.004 + 1e-38
    assert spread.rms == pytest.approx(np.sqrt(np.mean(np.square(np.array(values, float)))))


def test_a_nan_among_the_values_is_infinite():
    spread = Spread()
    spread.add(np.array([1.0, np.nan]))
    assert spread.rms == spread.quantile(0.999) == inf
    assert spread.quantile(0.5) == pytest.approx(1, rel=0.004)
    assert Spread().quantile(0.5) == Spread().rms == 0


# ---- the samples ----


def second_differences(frames: np.ndarray) -> np.ndarray:
    """(T, N) of a loop, over its wrap."""
    return np.linalg.norm(np.roll(frames, -1, axis=0) - 2 * frames + np.roll(frames, 1, axis=0), axis=2)


GALLERY = Path(__file__).parents[1] / "docs" / "gallery"


@pytest.mark.parametrize(
    "name, clip",
    [
        *((name, wind) for name in ("fern", "grass") for wind in ("calm", "gale")),
        *(pytest.param("leafed", wind, marks=pytest.mark.slow) for wind in ("calm", "gale")),
        ("bare", "wind"),
        ("growth", "growth"),
    ],
)
def test_no_level_of_a_plant_that_is_shown_jerks_by_much_more_than_the_file(name, clip):
    """Each vertex is seen over the wrap of the loop; a third of the leafed tree's vertices."""
    every = 3 if name == "leafed" else 1
    path = athcodec.sample_path(name) if clip in ("calm", "gale") else GALLERY / f"{name}.ath"
    with athcodec.open(path, clip=clip) as decoder:
        assert decoder.clip.loop
        full = second_differences(np.asarray(decoder[:, ::every], np.float64)).max()
        for level in decoder.levels:
            shown = second_differences(np.asarray(decoder.at_level(level.level)[:, ::every], np.float64))
            assert shown.max() <= 1.2 * full, (level.level, np.unravel_index(shown.argmax(), shown.shape))


def test_the_growing_sample_gets_leaves_late_small_at_first_and_its_end_is_held_for_a_second():
    clip = athcodec.read(athcodec.sample_path("growth"))
    positions, fps = clip.block(0, clip.frame_count).astype(np.float64), round(clip.metadata["fps"])
    moves = np.abs(np.diff(positions, axis=0)).max(axis=(1, 2)) > 0
    assert moves[:-fps].all() and not moves[-fps:].any()
    with_leaves = np.unique(clip.vertex_branch[clip.attributes["uv"][:, 0] > 1])
    leaves = np.stack([positions[:, clip.vertex_branch == branch] for branch in with_leaves], axis=1)
    size = np.linalg.norm(np.ptp(leaves, axis=2), axis=2)
    size /= size[-1]
    growing = len(positions) - fps
    assert size.shape[1] > 50 and size[growing // 4].max() == 0
    assert size[growing // 2].mean() < 0.3 and size.max() < 1.25
    assert all(((0.05 < one) & (one < 0.5)).any() for one in size.T), "each is small at first"
