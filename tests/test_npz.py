"""NumPy archives: what survives, what NumPy itself makes and reads, positions block by block, broken files."""

from __future__ import annotations

import os
import pickle
import zipfile

import numpy as np
import pytest
from moving_meshes import mixed_clip, quad_clip
from test_hdf5 import assert_same_clip

import athcodec
from athcodec.errors import ClipError
from athcodec.motion.clip import MotionClip


@pytest.mark.parametrize("gzip", [False, True])
def test_the_sample_survives_unchanged(sample_clip, tmp_path, gzip):
    athcodec.write(sample_clip, tmp_path / "a.npz", gzip=gzip)
    with athcodec.read(tmp_path / "a.npz") as again:
        assert_same_clip(sample_clip, again)
        athcodec.write(again, tmp_path / "b.npz", gzip=gzip)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_polygons_domains_and_names_survive(tmp_path, dtype):
    clip = mixed_clip(dtype=dtype)
    clip.attributes |= {"group/names": np.array([b"oak", "bäume".encode()]), "flags": np.array([True, False])}
    athcodec.write(clip, tmp_path / "a.npz")
    with athcodec.read(tmp_path / "a.npz", root=5) as again:
        assert np.array_equal(again.block(0, 6), clip.block(0, 6)) and again.dtype == clip.dtype
        assert again.metadata == clip.metadata and again.attributes.keys() == clip.attributes.keys()
        for name, values in clip.attributes.items():
            assert np.array_equal(again.attributes[name], values) and again.attributes[name].dtype == values.dtype


def test_numpy_opens_what_is_written(tmp_path):
    clip = quad_clip()
    athcodec.write(clip, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        assert np.array_equal(arrays["positions"], clip.block(0, 6)) and np.array_equal(arrays["faces"], clip.faces)
        assert np.array_equal(arrays["time"], clip.time) and '"fps": 24.0' in str(arrays["metadata"])


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_what_numpy_writes_is_read(tmp_path, save):
    motion = np.random.default_rng(0).random((20, 7, 3))
    save(tmp_path / "a.npz", positions=motion, fps=25, unit="cm", species=np.array(["oak", "bäume"]))
    with athcodec.read(tmp_path / "a.npz") as clip:
        assert np.array_equal(clip.block(0, 20), motion) and clip.dtype == np.float64
        assert clip.metadata == {"fps": 25, "unit": "cm"} and np.array_equal(clip.time, np.arange(20) / 25)
        assert clip.attributes["species"].tolist() == [b"oak", "bäume".encode()]
        for start, stop in ((5, 9), (9, 20), (0, 1), (3, 4), (19, 20)):
            assert np.array_equal(clip.block(start, stop), motion[start:stop])


def test_other_byte_orders_and_orders_of_axes_are_read(tmp_path):
    motion = np.random.default_rng(0).random((20, 7, 3)).astype(np.float32)
    for stored in (motion.astype(">f4"), np.asfortranarray(motion)):
        np.savez(tmp_path / "a.npz", positions=stored, time=np.arange(20.0))
        with athcodec.read(tmp_path / "a.npz") as clip:
            assert np.array_equal(clip.block(3, 9), motion[3:9]) and clip.dtype == np.float32
    np.savez_compressed(tmp_path / "a.npz", positions=np.asfortranarray(motion))
    with athcodec.read(tmp_path / "a.npz") as clip:
        assert np.array_equal(clip.block(3, 9), motion[3:9])
    with pytest.raises(ClipError, match="in another order, whole: got 1,680 bytes to read"):
        athcodec.read(tmp_path / "a.npz", max_memory=1600)


def test_reading_forward_unpacks_once(tmp_path, monkeypatch):
    motion = np.random.default_rng(0).random((64, 7, 3))
    np.savez_compressed(tmp_path / "a.npz", positions=motion)
    with athcodec.read(tmp_path / "a.npz") as clip:
        opened = []
        plain = zipfile.ZipFile.open
        monkeypatch.setattr(zipfile.ZipFile, "open", lambda *a, **k: opened.append(1) or plain(*a, **k))
        for _ in range(2):
            assert np.array_equal(np.concatenate([block for _, block in clip.blocks(8)]), motion)
    assert len(opened) == 2


def saved(path, compressed=False, **arrays):
    (np.savez_compressed if compressed else np.savez)(path, **arrays)


MOTION = np.zeros((4, 5, 3), np.float32)
REFUSED = {
    "no positions": ({"time": np.arange(4)}, "positions: got no such dataset"),
    "two axes": ({"positions": MOTION[0]}, r"got shape \(5, 3\)"),
    "no frames": ({"positions": MOTION[:0]}, "got no frames"),
    "texts": ({"positions": MOTION.astype(str)}, "got dtype <U32"),
    "no JSON": ({"positions": MOTION, "metadata": "{"}, "metadata: got no JSON"),
    "a JSON list": ({"positions": MOTION, "metadata": "[]"}, "expected a JSON object"),
    "NaN": ({"positions": MOTION + np.nan}, "frame 0, vertex 0"),
    "one of two": ({"positions": MOTION, "vertex_branch": np.zeros(5, int)}, "got one of vertex_branch"),
    "times": ({"positions": MOTION, "time": np.arange(3)}, "time: got shape"),
}


@pytest.mark.parametrize("arrays, message", REFUSED.values(), ids=REFUSED)
def test_an_unusable_archive_is_refused_by_name(tmp_path, arrays, message):
    saved(tmp_path / "a.npz", **arrays)
    with pytest.raises(ClipError, match=message) as caught:
        athcodec.read(tmp_path / "a.npz")
    assert str(tmp_path / "a.npz") in str(caught.value)


def test_objects_and_other_files_of_an_archive_are_named(tmp_path):
    saved(tmp_path / "a.npz", positions=MOTION, time=np.arange(4), more=np.array([{}, []], object))
    with zipfile.ZipFile(tmp_path / "a.npz", "a") as archive:
        archive.writestr("notes.txt", "by hand")
    with athcodec.read(tmp_path / "a.npz") as clip:
        assert dict(clip.not_read) == {"pickled object": ["more"], "member": ["notes.txt"]}


def test_sizes_are_checked_before_anything_is_allocated(tmp_path):
    header = b"\x93NUMPY\x01\0v\0" + str({"descr": "<f4", "fortran_order": False, "shape": (10**9, 10**6, 3)}).encode()
    for packing in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        with zipfile.ZipFile(tmp_path / "a.npz", "w", packing) as archive:
            archive.writestr("positions.npy", header.ljust(127) + b"\n" + bytes(100))
        with pytest.raises(ClipError, match="got 100 bytes, expected 12000000000000000"):
            athcodec.read(tmp_path / "a.npz")


def test_static_arrays_that_are_too_large_can_be_skipped(tmp_path):
    saved(tmp_path / "a.npz", positions=MOTION, big=np.zeros(1000))
    with pytest.raises(ClipError, match="big: got 16,256 bytes to read, but expected at most 10,000"):
        athcodec.read(tmp_path / "a.npz", max_memory=10_000)
    with athcodec.read(tmp_path / "a.npz", skip=["big"], max_memory=10_000) as clip:
        assert clip.attributes == {}


def test_a_pickle_in_an_archive_is_not_executed(tmp_path):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "sprung"),)

    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("positions.npy", pickle.dumps(Trap()))
    with pytest.raises(ClipError, match="positions: the array cannot be read"):
        athcodec.read(tmp_path / "a.npz")
    assert not (tmp_path / "sprung").exists()


def test_an_array_may_not_have_the_name_of_one_of_the_schema(tmp_path):
    with pytest.raises(ClipError, match="name 'metadata'"):
        athcodec.write(MotionClip(MOTION, np.arange(4.0), attributes={"metadata": np.zeros(2)}), tmp_path / "a.npz")
    assert os.listdir(tmp_path) == []
