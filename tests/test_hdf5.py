"""HDF5 in and out: what survives, what is filled in, what is refused, and what a failed write leaves."""

from __future__ import annotations

import os
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from athcodec.errors import ClipError, GuessWarning, SourceWarning
from athcodec.exporters import write_hdf5
from athcodec.exporters.hdf5 import Hdf5Writer
from athcodec.motion import clip as clip_module
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import hierarchy_of
from athcodec.sources import read_hdf5

STATIC_DTYPES = ["u1", "i2", "<i8", ">i4", "f2", "f4", ">f8", "?", "S5", "c16"]


def write_source(path, forked, leave_out=(), attrs=None, **more):
    arrays = {k: v for k, v in (forked | more).items() if k not in ("metadata", *leave_out)}
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
        file.attrs.update(forked["metadata"] if attrs is None else attrs)
    return path


def assert_same_clip(a, b):
    assert np.array_equal(a.block(0, a.frame_count), b.block(0, b.frame_count)) and a.dtype == b.dtype
    assert np.array_equal(a.rest, b.rest) and a.rest_dtype == b.rest_dtype
    for name in ("time", "vertex_branch", "branch_parent"):
        assert np.array_equal(getattr(a, name), getattr(b, name))
    for name in ("edges", "faces", "stem_index"):
        assert_same_array(getattr(a, name), getattr(b, name))
    assert a.attributes.keys() == b.attributes.keys()
    for name, values in a.attributes.items():
        assert_same_array(values, b.attributes[name])
    assert a.metadata == b.metadata


def assert_same_array(a, b):
    assert (a is None) == (b is None)
    if a is not None:
        assert a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


@pytest.mark.parametrize("gzip", [False, True])
def test_the_sample_survives_unchanged(sample_clip, sample_file, tmp_path, gzip):
    copy = tmp_path / "copy.h5"
    write_hdf5(sample_clip, copy, gzip=gzip)
    with read_hdf5(copy) as again:
        assert_same_clip(sample_clip, again)
    with h5py.File(sample_file) as a, h5py.File(copy) as b:
        assert a.keys() == b.keys()
        for name in a:
            assert_same_array(a[name][()], b[name][()])


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    dtypes=st.lists(st.sampled_from(STATIC_DTYPES), max_size=4),
    shape=st.lists(st.integers(0, 4), max_size=3),
    metadata=st.dictionaries(
        st.text("abcdef_", min_size=1),
        st.text(st.characters(codec="utf-8", exclude_characters="\0"))
        | st.integers(-(2**63), 2**63 - 1)
        | st.floats(allow_nan=False)
        | st.booleans()
        | st.lists(st.integers(-99, 99))
        | st.lists(st.text("xyz"), min_size=1)
        | st.lists(st.lists(st.floats(-1, 1), min_size=2, max_size=2), min_size=1),
    ),
    seed=st.integers(0, 2**32),
    gzip=st.booleans(),
    precision=st.sampled_from(["f4", "f8"]),
)
def test_static_arrays_and_metadata_survive(forked, tmp_path, dtypes, shape, metadata, seed, gzip, precision):
    rng = np.random.default_rng(seed)
    arrays = {f"group/{i}": rng.integers(0, 99, shape).astype(d) for i, d in enumerate(dtypes)}
    more = {"attributes": arrays, "metadata": metadata, "faces": np.array([[0, 1, 4]], "u1")}
    more["positions"] = forked["positions"].astype(precision)
    clip = MotionClip(**(forked | more))
    write_hdf5(clip, tmp_path / "clip.h5", gzip=gzip)
    with read_hdf5(tmp_path / "clip.h5") as again:
        assert_same_clip(clip, again)


def test_positions_stay_in_the_file_and_come_by_whole_chunks(forked, tmp_path, monkeypatch):
    path = tmp_path / "chunked.h5"
    positions = np.arange(100 * 6 * 3, dtype=np.float32).reshape(100, 6, 3)
    forked |= {"time": np.arange(100.0)}
    write_source(path, forked, leave_out=["positions"])
    with h5py.File(path, "a") as file:
        file.create_dataset("positions", data=positions, chunks=(16, 6, 3), compression="gzip")
    monkeypatch.setattr(clip_module, "BLOCK_BYTES", 40 * 6 * 12)
    with read_hdf5(path) as clip:
        assert isinstance(clip.positions, h5py.Dataset)
        blocks = list(clip.blocks())
    assert [start for start, _ in blocks] == [0, 32, 64, 96]
    assert np.array_equal(np.concatenate([block for _, block in blocks]), positions)


@pytest.mark.parametrize(("max_memory", "is_kept"), [(64 << 20, True), (12 << 20, False)])
def test_chunks_of_a_small_clip_are_unpacked_once_if_they_fit_the_memory(tmp_path, max_memory, is_kept):
    with h5py.File(tmp_path / "packed.h5", "w") as file:
        ones = np.ones((150, 10000, 3), np.float32)
        file.create_dataset("positions", data=ones, chunks=(32, 10000, 3), compression="gzip")
    with read_hdf5(tmp_path / "packed.h5", max_memory=max_memory) as clip:
        _, cache, _ = clip.positions.id.get_access_plist().get_chunk_cache()
        assert (cache >= clip.positions.nbytes) == is_kept
    assert clip.vertex_count == 10000, "its shape is known once it is closed"


def test_a_closed_clip_says_that_it_cannot_be_read(sample_file):
    with read_hdf5(sample_file) as clip:
        pass
    with pytest.raises(ClipError, match="cannot be read"):
        clip.block(0, 1)


def test_the_rest_pose_is_the_files_or_the_first_frame_or_the_mean(forked, tmp_path):
    forked["rest"] = forked["rest"] + np.float32(1)
    with_rest = write_source(tmp_path / "with.h5", forked)
    without = write_source(tmp_path / "without.h5", forked, leave_out=["rest"])
    poses = {}
    for path, option in ((p, o) for p in (with_rest, without) for o in ("auto", "first", "mean")):
        with read_hdf5(path, rest=option) as clip:
            poses[path, option] = clip.rest
    first, mean = forked["positions"][0], forked["positions"].mean(axis=0, dtype=np.float64)
    assert np.array_equal(poses[with_rest, "auto"], forked["rest"])
    assert np.array_equal(poses[without, "auto"], first)
    for path in (with_rest, without):
        assert np.array_equal(poses[path, "first"], first)
        assert np.allclose(poses[path, "mean"], mean, rtol=0, atol=1e-15)


@pytest.mark.parametrize("attrs, step", [({"fps": np.int32(25)}, 1 / 25), ({}, 1 / 30)])
def test_missing_times_come_from_the_frame_rate(forked, tmp_path, attrs, step):
    with read_hdf5(write_source(tmp_path / "a.h5", forked, ["time"], attrs)) as clip:
        assert np.allclose(clip.time, np.arange(5) * step)


@pytest.mark.parametrize("fps", [0, -1.0, np.nan, "fast"])
def test_a_frame_rate_that_is_none_is_refused(forked, tmp_path, fps):
    with pytest.raises(ClipError, match="fps"):
        read_hdf5(write_source(tmp_path / "a.h5", forked, ["time"], {"fps": fps}))


def test_branches_are_derived_from_edges_along_the_up_axis(forked, tmp_path):
    path = write_source(tmp_path / "a.h5", forked, ["vertex_branch", "branch_parent"])
    with read_hdf5(path) as clip:
        assert clip.vertex_branch.tolist() == [0, 0, 0, 0, 1, 1]
        assert clip.branch_parent.tolist() == [-1, 0]
    with read_hdf5(path, root=3) as clip:
        assert clip.vertex_branch.tolist() == [0, 0, 0, 0, 1, 1]
        assert clip.stem_index.tolist() == [3, 2, 1, 0, 0, 1]


def test_derived_branches_survive_where_stems_run_against_the_numbering(forked, tmp_path):
    path = write_source(tmp_path / "a.h5", forked, ["vertex_branch", "branch_parent"])
    with read_hdf5(path, root=3) as clip:
        write_hdf5(clip, tmp_path / "b.h5")
        with read_hdf5(tmp_path / "b.h5") as again:
            assert_same_clip(clip, again)
            assert hierarchy_of(again).vertex_source.tolist() == [3, 2, 1, 0, 4, 5]


def test_branch_order_is_kept_only_where_it_is_not_the_depth(forked, tmp_path):
    for order, kept in (([0, 1], False), ([1, 2], True)):
        with read_hdf5(write_source(tmp_path / "a.h5", forked, branch_order=np.array(order, "i2"))) as clip:
            assert ("branch_order" in clip.attributes) == kept
            write_hdf5(clip, tmp_path / "b.h5")
        with h5py.File(tmp_path / "b.h5") as file:
            assert file["branch_order"][()].tolist() == order


def test_texts_become_bytes_of_fixed_length(forked, tmp_path):
    with read_hdf5(write_source(tmp_path / "a.h5", forked, names=["oak", "bäume"])) as clip:
        assert clip.attributes["names"].tolist() == [b"oak", "bäume".encode()]


BRANCHES = ["vertex_branch", "branch_parent"]
REFUSED = {
    "labels without parents": (["branch_parent"], {}, "got one of vertex_branch and branch_parent"),
    "no positions": (["positions"], {}, "positions: got no such dataset"),
    "Alembic of old": (
        ["positions"],
        {"ABC/abc": [0]},
        "archive: got Alembic in HDF5, expected .* abcconvert -toOgawa",
    ),
    "complex positions": ([], {"positions": np.zeros((5, 6, 3), "c8")}, "complex64"),
    "empty positions": ([], {"positions": h5py.Empty("f4")}, "positions: got an empty dataset"),
    "a cycle of edges": (BRANCHES, {"edges": [[0, 1], [1, 2], [2, 0]]}, "closes a cycle"),
    "NaN at rest": ([], {"rest": np.full((6, 3), np.nan)}, "rest: vertex 0"),
}


@pytest.mark.parametrize("leave_out, more, message", REFUSED.values(), ids=REFUSED)
def test_an_unusable_file_is_refused_by_name_and_closed(forked, tmp_path, leave_out, more, message):
    path = write_source(tmp_path / "bad.h5", forked, leave_out, **more)
    with pytest.raises(ClipError, match=message) as caught:
        read_hdf5(path)
    assert str(path) in str(caught.value)
    with h5py.File(path, "a"):
        pass


def test_what_cannot_be_kept_is_named_and_the_rest_is_read(forked, tmp_path):
    path = write_source(tmp_path / "a.h5", forked, radius=h5py.Empty("f4"))
    with h5py.File(path, "a") as file:
        lists = file.create_dataset("lists", (2,), h5py.vlen_dtype(np.int32))
        lists[0] = [1, 2, 3]
        file["positions"].attrs["note"] = "by hand"
        file["gone"] = h5py.SoftLink("/nowhere")
    with pytest.warns(SourceWarning, match="not read: link gone"), read_hdf5(path) as clip:
        assert clip.attributes == {}
        named = {
            "link": ["gone"],
            "empty dataset": ["radius"],
            "dataset of references or lists": ["lists"],
            "note of a dataset": ["positions@note"],
        }
        assert dict(clip.not_read) == named


@pytest.mark.parametrize("dtype", ["f2", "i2", "u1"])
def test_positions_of_another_type_are_converted_and_that_is_said(forked, tmp_path, dtype):
    path = write_source(tmp_path / "a.h5", forked, positions=np.arange(90).reshape(5, 6, 3).astype(dtype))
    with pytest.warns(GuessWarning, match="became float32"), read_hdf5(path) as clip:
        assert np.array_equal(clip.block(1, 3).reshape(-1), np.arange(18, 54)) and clip.dtype == np.float32


def test_what_is_no_hdf5_file_is_refused(tmp_path):
    (tmp_path / "a.h5").write_bytes(b"\0" * 100)
    with pytest.raises(ClipError, match="expected an HDF5 file"):
        read_hdf5(tmp_path / "a.h5")
    with pytest.raises(FileNotFoundError):
        read_hdf5(tmp_path / "none.h5")


def test_huge_static_arrays_can_be_skipped(forked, tmp_path):
    path = write_source(tmp_path / "a.h5", forked, velocity=np.zeros((500, 6, 3)))
    with pytest.raises(ClipError, match="velocity: got 72,000 bytes"):
        read_hdf5(path, max_memory=10_000)
    with read_hdf5(path, skip=["velocity"], max_memory=10_000) as clip:
        assert clip.attributes == {}


def writer_arguments(forked):
    return {name: forked[name] for name in ("time", "vertex_branch", "branch_parent", "rest")}


def test_frames_are_written_as_they_come(forked, forked_clip, tmp_path):
    with Hdf5Writer(tmp_path / "a.h5", **writer_arguments(forked)) as writer:
        writer.add(forked["positions"][:2])
        assert not (tmp_path / "a.h5").exists()
        writer.add(forked["positions"][2:])
    with read_hdf5(tmp_path / "a.h5") as clip:
        assert np.array_equal(clip.block(0, 5), forked["positions"])


@pytest.mark.parametrize(
    "blocks, message",
    [
        ([np.zeros((3, 6, 3))], "got 3, expected 5"),
        ([np.zeros((3, 6, 3))] * 2, "got 6, expected 5"),
        ([np.zeros((5, 7, 3))], r"got shape \(5, 7, 3\)"),
    ],
)
def test_a_failed_write_leaves_what_was_there_before(forked, tmp_path, blocks, message):
    (tmp_path / "a.h5").write_bytes(b"\x89HDF\r\n\x1a\nold")
    with pytest.raises(ClipError, match=message):
        with Hdf5Writer(tmp_path / "a.h5", **writer_arguments(forked)) as writer:
            for block in blocks:
                writer.add(block)
    assert os.listdir(tmp_path) == ["a.h5"] and (tmp_path / "a.h5").read_bytes() == b"\x89HDF\r\n\x1a\nold"


def test_nothing_is_left_where_the_source_breaks_or_cannot_be_stored(forked, forked_clip, tmp_path):
    forked["positions"][4, 0, 0] = np.nan
    with pytest.raises(ClipError, match="frame 4, vertex 0"):
        write_hdf5(MotionClip(**forked), tmp_path / "a.h5")
    with pytest.raises(ClipError, match="name 'time'"):
        Hdf5Writer(tmp_path / "a.h5", **writer_arguments(forked), attributes={"time": np.zeros(3)})
    with pytest.raises(TypeError):
        Hdf5Writer(tmp_path / "a.h5", **writer_arguments(forked), metadata={"a": object()})
    with pytest.raises(FileNotFoundError, match="does not exist"):
        write_hdf5(forked_clip, tmp_path / "none" / "a.h5")
    assert os.listdir(tmp_path) == []


def test_a_clip_is_not_written_over_the_file_that_it_is_read_from(forked, tmp_path):
    path = write_source(tmp_path / "a.h5", forked)
    with read_hdf5(path) as clip, pytest.raises(FileExistsError, match="is the input"):
        write_hdf5(clip, path, gzip=True)
    with read_hdf5(path) as clip:
        assert np.array_equal(clip.block(0, 5), forked["positions"])


def test_anything_with_frame_blocks_can_be_written(forked, tmp_path):
    positions = forked["positions"]
    decoded = SimpleNamespace(
        **writer_arguments(forked), dtype=np.dtype("f4"), blocks=lambda: ((i, positions[i : i + 1]) for i in range(5))
    )
    write_hdf5(decoded, tmp_path / "a.h5")
    with read_hdf5(tmp_path / "a.h5") as clip:
        assert np.array_equal(clip.block(0, 5), positions) and clip.rest_dtype == np.float32
