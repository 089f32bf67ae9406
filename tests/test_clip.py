"""What MotionClip accepts, what it refuses and how it says so."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import athcodec
from athcodec.errors import ClipError
from athcodec.motion import clip as clip_module
from athcodec.motion.clip import MotionClip


class CountingPositions:
    """Positions that are never there as a whole: each read makes its frames and is recorded."""

    dtype = np.dtype(np.float32)

    def __init__(self, frames, vertices, chunk_frames=None):
        self.shape = (frames, vertices, 3)
        self.chunks = chunk_frames and (chunk_frames, vertices, 3)
        self.reads = []

    def __getitem__(self, frames):
        self.reads.append((frames.start, frames.stop))
        k = frames.stop - frames.start
        moments = np.arange(frames.start, frames.stop, dtype=np.float32)
        return np.broadcast_to(moments[:, None, None], (k, *self.shape[1:])).copy()


def one_branch_clip(positions, **more):
    frames, vertices, _ = positions.shape
    return MotionClip(positions, np.arange(frames), np.zeros(vertices, int), np.array([-1]), **more)


def test_a_clip_is_made_of_plain_arrays(forked):
    needed = ("positions", "time", "vertex_branch", "branch_parent")
    clip = MotionClip(**{name: forked[name] for name in needed})
    assert (clip.frame_count, clip.vertex_count, clip.branch_count) == (5, 6, 2)
    assert clip.vertex_branch.dtype == clip.branch_parent.dtype == np.int32
    assert np.array_equal(clip.rest, forked["positions"][0])
    assert clip.rest.dtype == np.float64 and clip.rest_dtype == np.float32


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_changed_clip_keeps_the_dtype_of_its_rest_pose_unless_another_is_given(forked, dtype):
    clip = MotionClip(**forked | {"rest": np.full((6, 3), 0.1, dtype)})
    again = clip.replace(metadata={"unit": "m"})
    assert again.metadata == {"unit": "m"} and clip.metadata == {"unit": "m", "up_axis": "y"}
    assert again.rest_dtype == again.source_rest.dtype == dtype and np.array_equal(again.rest, clip.rest)
    assert clip.replace(rest=np.zeros((6, 3))).rest_dtype == np.float64


def test_fps_is_the_median_rate_of_uneven_times(forked_clip):
    assert forked_clip.fps == pytest.approx(1 / 0.15)


@pytest.mark.parametrize("fps", [30, 24, 25.0, 12.5, 23.976, 24000 / 1001, 30000 / 1001, 59.94, 1000, 0.1])
def test_a_rate_that_times_are_made_of_comes_back_as_it_was(fps, tmp_path):
    for frames, start in ((2, 0.0), (61, 0.0), (61, 3600.5), (3000, 1e5)):
        positions = np.cumsum(np.ones((frames, 1, 3), np.float32), axis=0) % 7
        if start == 0:
            data = athcodec.encode(positions, fps=fps, vertex_branch=[0], branch_parent=[-1], effort="fast")
            with athcodec.open(data) as still:
                assert (still.fps, still.file.info()["fps"], athcodec.ClipView(still).fps) == (fps,) * 3
                for suffix in ("npz", "glb", "mdd") if frames == 61 else ():
                    athcodec.write(still, tmp_path / f"of_{suffix}.{suffix}")
                    with athcodec.read(tmp_path / f"of_{suffix}.{suffix}") as again:
                        assert again.fps == fps, suffix
        assert MotionClip(positions, start + np.arange(frames) / fps).fps == fps


def test_a_rate_beside_a_usual_one_stays():
    for fps in (30.00001, 29.97002, 7.1234567, 1 / 3):
        clip = MotionClip(np.zeros((100, 1, 3), np.float32), np.arange(100) / fps)
        assert clip.fps == pytest.approx(fps, rel=1e-13)


def test_a_single_frame_is_a_clip_at_the_rate_it_states(forked):
    forked |= {"positions": forked["positions"][:1], "time": [7.5], "metadata": {"fps": 24}}
    assert MotionClip(**forked).fps == 24.0


@pytest.mark.parametrize("dtype", ["f4", "f8", ">f4", ">f8"])
def test_blocks_give_the_source_values_in_native_order(forked, dtype):
    forked["positions"] = forked["positions"].astype(dtype)
    clip = MotionClip(**forked)
    blocks = [frames for _, frames in clip.blocks(2)]
    assert all(frames.dtype == np.dtype(dtype).newbyteorder("=") for frames in blocks)
    assert np.array_equal(np.concatenate(blocks), forked["positions"])


def test_blocks_cannot_be_used_to_change_the_clip(forked_clip):
    with pytest.raises(ValueError, match="read-only"):
        forked_clip.block(0, 1)[0, 0, 0] = 1


@given(frames=st.integers(1, 90), max_frames=st.none() | st.integers(1, 100), chunk=st.none() | st.integers(1, 40))
def test_blocks_cover_every_frame_once_within_the_limits(frames, max_frames, chunk):
    positions = CountingPositions(frames, 7, chunk)
    budget = clip_module.BLOCK_BYTES
    clip_module.BLOCK_BYTES = 7 * 12 * 50
    try:
        clip = one_branch_clip(positions)
        positions.reads.clear()
        starts = [(start, len(block)) for start, block in clip.blocks(max_frames)]
    finally:
        clip_module.BLOCK_BYTES = budget
    limit = min(max_frames or 50, 50)
    assert positions.reads == [(start, start + length) for start, length in starts]
    assert np.concatenate([np.arange(s, s + n) for s, n in starts]).tolist() == list(range(frames))
    assert all(length <= limit for _, length in starts)
    if chunk and chunk <= limit:
        assert all(start % chunk == 0 for start, _ in starts)


def test_a_clip_far_larger_than_memory_opens_by_one_frame():
    positions = CountingPositions(10**7, 10**5)
    clip = one_branch_clip(positions)
    start, block = next(clip.blocks())
    assert positions.reads[0] == (0, 1) and block.nbytes <= clip_module.BLOCK_BYTES


def test_the_mean_rest_pose_is_the_mean_of_all_frames():
    clip = one_branch_clip(CountingPositions(101, 3, 8), rest_pose="mean")
    assert np.array_equal(clip.rest, np.full((3, 3), 50.0)) and clip.rest_dtype == np.float64


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_position_that_is_no_number_is_named_when_it_is_read(forked, value):
    forked["positions"][3, 4, 1] = value
    clip = MotionClip(**forked)
    clip.block(0, 3)
    with pytest.raises(ClipError, match="frame 3, vertex 4"):
        list(clip.blocks(2))


REFUSED = {
    "positions of two dimensions": ({"positions": np.zeros((5, 6))}, r"shape \(5, 6\)"),
    "float16": ({"positions": np.zeros((5, 6, 3), np.float16)}, "float16, expected float32 or float64"),
    "integers": ({"positions": np.zeros((5, 6, 3), int)}, "int64, expected float32 or float64"),
    "no frames": ({"positions": np.zeros((0, 6, 3)), "time": []}, "no frames"),
    "no vertices": ({"positions": np.zeros((5, 0, 3))}, "no vertices"),
    "times of another clip": ({"time": np.arange(4.0)}, r"time: got shape \(4,\)"),
    "repeated time": ({"time": [0, 1, 1, 2, 3]}, "time: frame 2"),
    "time NaN": ({"time": [0, 1, np.nan, 2, 3]}, "time: frame 2"),
    "labels of another clip": ({"vertex_branch": [0, 0, 1]}, "got 3 entries, expected 6"),
    "float labels": ({"vertex_branch": np.zeros(6)}, "vertex_branch: got dtype float64"),
    "label out of range": ({"vertex_branch": [0, 0, 0, 2, 1, 1]}, "vertex 3 is on branch 2"),
    "negative label": ({"vertex_branch": [0, 0, 0, 0, 1, -1]}, "vertex 5 is on branch -1"),
    "empty branch": ({"vertex_branch": [0, 0, 0, 0, 0, 0]}, "branch 1 has no vertices"),
    "parent out of range": ({"branch_parent": [-1, 2]}, "branch 1 has parent 2"),
    "parent below -1": ({"branch_parent": [-2, 0]}, "branch 0 has parent -2"),
    "own parent": ({"branch_parent": [-1, 1]}, "branch 1 is its own parent"),
    "cycle": ({"branch_parent": [1, 0]}, "branch [01] .* is its own ancestor"),
    "rest of another clip": ({"rest": np.zeros((5, 3))}, r"rest: got shape \(5, 3\)"),
    "integer rest": ({"rest": np.zeros((6, 3), int)}, "rest: got dtype int64"),
    "rest NaN": ({"rest": np.where(np.arange(6)[:, None] == 2, np.nan, np.zeros((6, 3)))}, "rest: vertex 2"),
    "edge out of range": ({"edges": [[0, 1], [2, 6]]}, "edges: row 1 names vertex 6"),
    "edges of three": ({"edges": np.zeros((2, 3), int)}, r"edges: got shape \(2, 3\)"),
    "face with a gap": ({"faces": [[0, 1, 2, -1], [0, -1, 1, 2]]}, "face_vertex_indices: row 4 names vertex -1"),
    "float faces": ({"faces": np.zeros((2, 3))}, "faces: got dtype float64"),
    "objects": ({"attributes": {"names": np.array(["a", None])}}, "names has dtype object"),
    "reserved name": ({"attributes": {"rest": np.zeros(3)}}, "name 'rest'"),
    "place used twice": ({"stem_index": [0, 1, 1, 2, 0, 1]}, "stem_index: vertex 2 has place 1 on branch 0"),
    "unknown rest pose": ({"rest_pose": "median"}, "rest_pose: got 'median'"),
}


@pytest.mark.parametrize("change, message", REFUSED.values(), ids=REFUSED)
def test_what_is_no_clip_is_refused_with_its_place(forked, change, message):
    with pytest.raises(ClipError, match=message) as caught:
        MotionClip(**(forked | change))
    assert "\n" not in str(caught.value)


def test_a_cycle_far_from_the_branches_that_lead_into_it_is_named():
    parents = np.arange(-1, 999)
    parents[400] = 403
    with pytest.raises(ClipError, match=r"branch 40[0-3] \(parent"):
        MotionClip(np.zeros((1, 1000, 3)), [0.0], np.arange(1000), parents)


def test_places_that_repeat_the_vertex_order_are_dropped(forked):
    assert MotionClip(**forked, stem_index=[0, 1, 2, 3, 0, 1]).stem_index is None
    assert MotionClip(**forked, stem_index=[3, 2, 1, 0, 0, 1]).stem_index.tolist() == [3, 2, 1, 0, 0, 1]


def test_rows_of_faces_that_end_with_minus_one_are_polygons_of_their_own_sizes(forked):
    del forked["metadata"]
    faces, metadata = np.array([[0, 1, 2, 3], [3, 4, 5, -1]]), {"domains": {"uv": "corner"}}
    clip = MotionClip(**forked, faces=faces, metadata=metadata)
    assert clip.faces is None and [part.tolist() for part in clip.polygons] == [[4, 3], [0, 1, 2, 3, 3, 4, 5]]
    assert clip.metadata["domains"] == {"uv": "corner", "face_vertex_counts": "face", "face_vertex_indices": "corner"}
    clip.check()
    assert clip.polygons[0].tolist() == [4, 3]
    assert MotionClip(**forked, faces=[[0, 1, 2, -1], [3, 4, 5, -1]]).faces.tolist() == [[0, 1, 2], [3, 4, 5]]
