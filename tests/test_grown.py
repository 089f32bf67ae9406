"""Plants whose parts are born while the clip runs: the pose that they are coded about, and the objects of a scene."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import athcodec
from athcodec.motion.branches.grown_pose import grown_pose, with_grown_pose

pytestmark = pytest.mark.sizes

ORGANS = 10  # leaves of the plant
VERTICES = 20  # vertices of each leaf
FRAMES = 24  # a second


def growing_organs(decay: bool = False) -> athcodec.MotionClip:
    """Leaves along an axis, each scaled up from a point where it stands, one after the other; or down to one."""
    rng = np.random.default_rng(3)
    shapes = rng.uniform(-0.05, 0.05, (ORGANS, VERTICES, 3))
    places = np.stack([np.zeros(ORGANS), np.linspace(0, 1, ORGANS), np.zeros(ORGANS)], axis=1)
    born = np.linspace(0, 16, ORGANS)
    scale = np.clip((np.arange(FRAMES)[:, None] - born) / 6, 0, 1)
    positions = places[:, None] * np.linspace(0.3, 1, FRAMES)[:, None, None, None] + shapes * scale[..., None, None]
    return athcodec.MotionClip(
        positions[:: -1 if decay else 1].reshape(FRAMES, -1, 3).astype(np.float32),
        np.arange(FRAMES) / 24,
        attributes={"part_vertex_counts": np.full(ORGANS, VERTICES, np.int32)},
        metadata={"part_names": [f"/plant/S{i // 5}_P{i % 5}/Leaf" for i in range(ORGANS)]},
    )


@pytest.mark.parametrize("decay", [False, True])
def test_a_plant_that_grows_from_nothing_is_coded_about_its_grown_shape_and_no_level_leaves_its_box(decay, tmp_path):
    clip = growing_organs(decay)
    summary = athcodec.encode(clip, tmp_path / "grown.ath", rel_error=1e-4)
    low, high = clip.positions.min(axis=(0, 1)), clip.positions.max(axis=(0, 1))
    margin = 0.1 * np.linalg.norm(high - low)
    with athcodec.open(tmp_path / "grown.ath", strict=True) as decoder:
        for level in range(decoder.file.level_count):
            shown = decoder.positions(level=level)
            assert (shown >= low - margin).all() and (shown <= high + margin).all()
        size = np.ptp(decoder.file.rest.reshape(ORGANS, VERTICES, 3), axis=1).max(axis=1)
        assert size.min() > 0.08, "every leaf has its full size in the pose that the file is coded about"
    affine_maps = 12 * 4 * ORGANS * FRAMES
    assert summary.bytes < 4 * ORGANS * VERTICES + affine_maps // 4


def test_a_clip_that_begins_grown_keeps_its_first_frame_as_rest_pose():
    clip = growing_organs(decay=True)
    with athcodec.open(athcodec.encode(clip, rel_error=1e-4, attributes="none", effort="fast")) as decoder:
        assert np.abs(decoder.file.rest - clip.positions[0]).max() < 1e-3


def test_chunks_of_many_frames_are_not_unpacked_for_each_frame_that_is_looked_at(tmp_path):
    clip = growing_organs()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("positions", data=clip.positions, chunks=(FRAMES // 2, *clip.positions.shape[1:]))
        stored, reads = athcodec.MotionClip(data, clip.time, attributes=clip.attributes), []
        stored.block, read = lambda start, stop: reads.append(start) or read(start, stop), stored.block
        assert np.array_equal(grown_pose(stored), grown_pose(clip))
    assert len(reads) == 3, "both chunks once, and the frame that is most grown"


def test_no_more_frames_of_a_chunk_are_read_at_once_than_a_block_has(monkeypatch):
    clip, runs = growing_organs(), []
    monkeypatch.setattr("athcodec.motion.clip.BLOCK_BYTES", 5 * clip.positions[0].nbytes)
    stored = athcodec.MotionClip(Chunked(clip.positions), clip.time, attributes=clip.attributes)
    stored.block, read = lambda start, stop: runs.append(stop - start) or read(start, stop), stored.block
    assert np.array_equal(grown_pose(stored), grown_pose(clip))
    assert 1 < max(runs) <= 5


class Chunked:
    """Positions in one chunk of all frames."""

    def __init__(self, positions: np.ndarray):
        self.positions, self.shape, self.dtype, self.chunks = (
            positions,
            positions.shape,
            positions.dtype,
            positions.shape,
        )

    def __getitem__(self, index):
        return self.positions[index]


def test_no_pose_shows_points_grown_that_wander():
    positions = np.random.default_rng(3).random((40, 60, 3)).astype(np.float32)
    clip = athcodec.MotionClip(positions, np.arange(40) / 24, rest=positions[0])
    assert with_grown_pose(clip) is clip


def test_a_rest_pose_that_a_clip_was_given_comes_back_whatever_its_size():
    clip = growing_organs()
    given = clip.replace(rest=clip.positions[0])
    with athcodec.open(athcodec.encode(given, rel_error=1e-4, exact_rest=True, effort="fast")) as decoder:
        assert np.array_equal(decoder.file.rest, clip.positions[0])


def test_objects_of_a_scene_become_branches_that_hang_on_relatives_of_the_same_name():
    clip = growing_organs()
    found = athcodec.find_branches(clip, "objects")
    assert np.array_equal(found.vertex_branch, np.repeat(np.arange(ORGANS), VERTICES))
    assert "10 branches by objects: 1 without a parent" in str(found)
    relatives = [child // 5 == parent // 5 for child, parent in enumerate(found.branch_parent) if parent >= 0]
    assert sum(relatives) == len(relatives) - 1, "only one of each shoot hangs on another shoot"


def test_objects_that_bend_are_no_branches():
    clip = growing_organs()
    rng = np.random.default_rng(1)
    bent = clip.replace(positions=clip.positions + rng.normal(0, 0.01, clip.positions.shape).astype(np.float32))
    with pytest.raises(athcodec.errors.ClipError, match="several objects in a scene that move by one affine map each"):
        athcodec.find_branches(bent, "objects")


def test_a_rest_pose_in_which_little_is_grown_is_kept_but_not_what_motion_is_coded_about(tmp_path):
    clip = growing_organs()
    given = clip.replace(rest=clip.positions[0])
    sizes = [athcodec.encode(one, tmp_path / "a.ath", rel_error=1e-4, ladder="none").bytes for one in (clip, given)]
    assert sizes[1] <= 1.3 * sizes[0]
    with athcodec.open(tmp_path / "a.ath") as decoder:
        assert np.linalg.norm(decoder.file.rest - clip.positions[0], axis=1).max() < 0.003 * 1.2


@pytest.mark.parametrize("counts", [[-40, 440], [0.5, 399.5], [100, 100]])
def test_numbers_of_vertices_that_cannot_be_name_no_objects(counts):
    clip = growing_organs()
    wrong = clip.replace(attributes={"part_vertex_counts": np.array(counts)})
    with pytest.raises(athcodec.errors.ClipError, match="several objects in a scene"):
        athcodec.find_branches(wrong, "objects")
