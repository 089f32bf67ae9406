"""Samples for motion blur: positions between frames, and velocities, of any motion."""

from __future__ import annotations

import numpy as np
import pytest

import athcodec
from athcodec.errors import ClipError
from athcodec.exporters.samples import samples_of, with_samples
from athcodec.exporters.scene_objects import objects_of
from athcodec.motion.clip import ClipRange, MotionClip

TIMES = np.array([0.0, 0.1, 0.3, 0.35, 0.5, 0.6])


def clip_of(loop=False, presence=None, times=TIMES):
    """Two points that go apart, each an object of its own."""
    rng = np.random.default_rng(1)
    parts = {"part_names": ["a", "b"], "fps": 10.0} | ({"presence": presence} if presence else {})
    return MotionClip(
        rng.random((len(times), 2, 3)),
        times,
        attributes={"part_vertex_counts": np.array([1, 1])},
        metadata=parts,
        clip_ranges=(ClipRange("sway", len(times), loop),),
    )


def velocities(clip):
    found = list(samples_of(clip, objects_of(clip), True))
    assert [frame for frame, _, _ in found] == list(range(clip.frame_count))
    return np.array([velocity for _, _, velocity in found])


def test_velocities_are_the_gradient_of_the_positions_at_steps_that_differ():
    clip = clip_of()
    expected = np.gradient(clip.block(0, 6), TIMES, axis=0, edge_order=1)
    assert np.allclose(velocities(clip), expected, rtol=1e-6, atol=1e-6)


def test_velocities_of_a_loop_go_round():
    clip = clip_of(loop=True)
    step, frames = TIMES[-1] / 5, np.tile(clip.block(0, 6), (3, 1, 1))
    times = np.concatenate([TIMES + turn * (TIMES[-1] + step) for turn in range(3)])
    assert np.allclose(velocities(clip), np.gradient(frames, times, axis=0)[6:12], rtol=1e-6, atol=1e-6)


def test_what_appears_or_vanishes_has_velocities_of_the_frames_that_show_it():
    """And what is there in a single frame has none."""
    clip = clip_of(presence={"a": [[0, 1], [2, 5]]})
    a, b = clip.block(0, 6).swapaxes(0, 1)
    found = velocities(clip)
    assert np.allclose(found[2:5, 0], np.gradient(a[2:5], TIMES[2:5], axis=0), rtol=1e-6)
    assert not found[[0, 1, 5], 0].any()
    assert np.allclose(found[:, 1], np.gradient(b, TIMES, axis=0), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("loop", [False, True])
def test_samples_lie_where_the_decoder_shows_the_plant_between_frames(loop):
    path = athcodec.sample_path("grass")
    with athcodec.open(path) as grass:
        view = athcodec.ClipView(grass, frames=None if loop else range(40))
        assert view.clip_ranges[0].loop == loop
        sampled, start = with_samples(view, 3), grass.time[0]
        assert sampled.frame_count == (3 * 150 if loop else 3 * 39 + 1)
        for number in (0, 1, 59, sampled.frame_count - 1):
            shown = sampled.block(number, number + 1)[0]
            assert np.allclose(shown, grass.at(sampled.time[number] - start), rtol=0, atol=1e-6)
        assert np.array_equal(sampled.block(0, 118)[::3], view.block(0, 40))
        blocks = [(start, block) for start, block in sampled.blocks()]
        assert [start for start, _ in blocks] == np.cumsum([0, *(len(block) for _, block in blocks[:-1])]).tolist()
        assert np.array_equal(np.concatenate([block for _, block in blocks]), sampled.block(0, sampled.frame_count))
        assert np.allclose(np.diff(sampled.time), 1 / (3 * grass.fps), rtol=0, atol=1e-9)


def test_what_vanishes_before_the_next_frame_stands_still_until_then():
    clip = clip_of(presence={"a": [[1, 3]]})
    sampled = with_samples(clip, 2)
    assert sampled.metadata["presence"] == {"a": [[2, 6]]} and sampled.frame_count == 11
    a, b = sampled.block(0, 11).swapaxes(0, 1)
    frames = clip.block(0, 6)
    assert np.array_equal(a[5], frames[2, 0]) and np.allclose(a[3], (frames[1, 0] + frames[2, 0]) / 2)
    assert np.allclose(b[5], (frames[2, 1] + frames[3, 1]) / 2)


def test_motion_blur_is_refused_where_a_format_has_no_place_for_it(tmp_path):
    for name, options, reason in (
        ("a.glb", {"velocities": True}, "velocities: got gltf, expected one of usd, alembic"),
        ("a.npz", {"samples": 2}, "samples: got npz, expected one of usd, alembic"),
    ):
        with pytest.raises(ClipError, match=reason):
            athcodec.write(clip_of(), tmp_path / name, **options)
    for options, reason in (
        ({"samples": 0}, "samples: got 0, expected 1 to 1000"),
        ({"samples": 2, "rig": 4}, "samples: got a rig too"),
        ({"velocities": True, "rig": 4}, "velocities: got a rig too"),
    ):
        with pytest.raises(ValueError, match=reason):
            athcodec.write(clip_of(), tmp_path / "a.usdc", **options)
    assert not any(tmp_path.iterdir())
