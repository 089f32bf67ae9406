"""PC2 and MDD: bytes as other programs make them, frames and rates that are kept, meshes beside them, broken files."""

from __future__ import annotations

import os
import struct

import numpy as np
import pytest
from moving_meshes import assert_same_mesh, assert_same_motion, mixed_clip, quad_clip

import athcodec
from athcodec.errors import ClipError
from athcodec.sources import raw

pytestmark = pytest.mark.formats

MOTION = np.arange(4 * 5 * 3, dtype=np.float32).reshape(4, 5, 3) / 7


def pc2_bytes(motion=MOTION, start=10.0, step=1.0, magic=b"POINTCACHE2\0", version=1):
    frames, points = motion.shape[:2]
    return struct.pack("<12siiffi", magic, version, points, start, step, frames) + motion.astype("<f4").tobytes()


def mdd_bytes(motion=MOTION, times=(0.0, 1 / 24, 2 / 24, 3 / 24)):
    return (
        struct.pack(">2i", *motion.shape[:2]) + struct.pack(f">{len(times)}f", *times) + motion.astype(">f4").tobytes()
    )


def test_a_pc2_cache_as_the_format_is_described_is_read(tmp_path):
    (tmp_path / "a.pc2").write_bytes(pc2_bytes())
    with athcodec.read(tmp_path / "a.pc2", fps=25) as clip:
        assert np.array_equal(clip.block(0, 4), MOTION) and clip.dtype == np.float32
        assert np.array_equal(clip.time, np.arange(4) / 25)
        assert clip.metadata["fps"] == 25 and clip.metadata["start_frame"] == 10
        assert clip.metadata["part_kinds"] == ["points"] and clip.polygons is None


def test_a_pc2_cache_states_a_rate_only_where_it_is_given_or_needed(tmp_path):
    (tmp_path / "a.pc2").write_bytes(pc2_bytes())
    (tmp_path / "b.pc2").write_bytes(pc2_bytes(start=0.5, step=0.25))
    with athcodec.read(tmp_path / "a.pc2") as clip:
        assert "fps" not in clip.metadata and np.array_equal(clip.time, np.arange(4) / 30)
    with athcodec.read(tmp_path / "b.pc2") as clip:
        assert clip.metadata["fps"] == 30 and clip.metadata["start_frame"] == 0.5
        assert np.array_equal(clip.time, np.arange(4) / 120)
        athcodec.write(clip, tmp_path / "c.pc2")
    assert (tmp_path / "c.pc2").read_bytes() == (tmp_path / "b.pc2").read_bytes()


def test_the_times_of_an_mdd_cache_give_its_rate(tmp_path):
    for rate, start in ((24, 0), (25, 1), (30, 100), (24000 / 1001, 5), (60, -3)):
        times = [(start + frame) / rate for frame in range(4)]
        (tmp_path / "a.mdd").write_bytes(mdd_bytes(times=times))
        with athcodec.read(tmp_path / "a.mdd") as clip:
            assert np.array_equal(clip.block(0, 4), MOTION)
            assert clip.metadata["fps"] == pytest.approx(rate, rel=1e-15)
            assert clip.metadata.get("start_frame", 0) == start
            assert np.allclose(clip.time, np.arange(4) / rate, rtol=0, atol=1e-15)


def test_uneven_times_of_an_mdd_cache_stay_as_they_are(tmp_path):
    times = np.array([0.5, 0.625, 1.0, 3.0])
    (tmp_path / "a.mdd").write_bytes(mdd_bytes(times=times))
    with athcodec.read(tmp_path / "a.mdd") as clip:
        assert np.array_equal(clip.time, times - 0.5) and "fps" not in clip.metadata
        with pytest.raises(ClipError, match="even steps"):
            athcodec.write(clip, tmp_path / "a.pc2")
        athcodec.write(clip, tmp_path / "b.mdd")
    assert os.listdir(tmp_path).count("a.pc2") == 0
    with athcodec.read(tmp_path / "b.mdd") as again:
        assert np.array_equal(again.time, times - 0.5)


@pytest.mark.parametrize("suffix", [".pc2", ".mdd"])
def test_cache_and_mesh_come_back_as_they_were(tmp_path, suffix):
    clip = mixed_clip()
    athcodec.write(clip, tmp_path / f"tree{suffix}")
    assert sorted(os.listdir(tmp_path)) == sorted(["tree.obj", f"tree{suffix}"])
    with athcodec.read(tmp_path / f"tree{suffix}", fps=24) as again:
        assert_same_motion(again, clip)
        assert_same_mesh(again, clip)
        assert np.array_equal(again.attributes["uv"], clip.attributes["uv"])
        assert again.metadata == clip.metadata


def test_a_mesh_of_another_size_is_refused_by_name(tmp_path):
    (tmp_path / "a.pc2").write_bytes(pc2_bytes())
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(ClipError, match=r"a\.obj: got 3 vertices, expected 5 as in the cache"):
        athcodec.read(tmp_path / "a.pc2")


def test_a_mesh_that_is_there_stays_where_it_fits_and_is_never_replaced(tmp_path):
    clip = quad_clip()
    athcodec.write(clip, tmp_path / "tree.pc2")
    with open(tmp_path / "tree.obj", "a") as file:
        file.write("# by hand\n")
    before = (tmp_path / "tree.obj").read_bytes()
    athcodec.write(clip, tmp_path / "tree.mdd")
    with pytest.raises(ClipError, match=r"tree\.obj: got 24 vertices, expected 8 as in the clip"):
        athcodec.write(mixed_clip(), tmp_path / "tree.mdd")
    (tmp_path / "tree.mdd").unlink()
    assert (tmp_path / "tree.obj").read_bytes() == before and len(os.listdir(tmp_path)) == 2


@pytest.mark.parametrize("suffix", ["pc2", "mdd", "npz"])
def test_only_the_frames_asked_for_are_read(tmp_path, monkeypatch, suffix):
    clip, made = quad_clip(frames=50), []
    athcodec.write(clip, tmp_path / f"a.{suffix}")
    with athcodec.read(tmp_path / f"a.{suffix}") as again:
        monkeypatch.setattr(raw.np, "empty", lambda shape, dtype=float: made.append(shape) or np.zeros(shape, dtype))
        assert np.array_equal(again.block(30, 32), clip.block(30, 32))
        monkeypatch.undo()
    assert made == [(2, clip.vertex_count, 3)]


REFUSED = {
    "a.pc2": [
        (pc2_bytes(version=2), "version: got 2"),
        (pc2_bytes(step=0.0), "expected a step above 0"),
        (pc2_bytes(start=float("nan")), "got the start nan"),
        (pc2_bytes()[:-1], "got 271 bytes, expected 272"),
        (pc2_bytes() + b"\0", "got 273 bytes, expected 272"),
        (pc2_bytes(MOTION[:0]), "at least one"),
        (b"POINTCACHE2\0" + struct.pack("<iiffi", 1, 2**31 - 1, 0, 1, 2**31 - 1), "expected 55340232"),
        (b"something else that is long enough", "expected a PC2 point cache"),
        (pc2_bytes(MOTION + np.float32("inf")), "frame 0, vertex 0"),
    ],
    "a.mdd": [
        (mdd_bytes()[:30], "expected 264"),
        (mdd_bytes(times=(0, 0, 0, 0)), "do not increase"),
        (mdd_bytes(times=(0, 1, float("nan"), 2)), "do not increase"),
        (struct.pack(">2i", -1, 5), "-1 frames"),
        (struct.pack(">2i", 2**31 - 1, 2**31 - 1), "no more than the file can hold"),
    ],
}


@pytest.mark.parametrize("name, data, message", [(name, *case) for name, cases in REFUSED.items() for case in cases])
def test_a_broken_cache_is_refused_and_named(tmp_path, name, data, message):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ClipError, match=message) as caught:
        athcodec.read(tmp_path / name)
    assert str(tmp_path / name) in str(caught.value) and "\n" not in str(caught.value)


def test_a_cache_that_shrinks_while_it_is_read_is_an_error(tmp_path):
    (tmp_path / "a.pc2").write_bytes(pc2_bytes())
    with athcodec.read(tmp_path / "a.pc2") as clip:
        os.truncate(tmp_path / "a.pc2", 100)
        with pytest.raises(ClipError, match="end of the file"):
            clip.block(0, 4)
        with pytest.raises(ClipError, match="was changed"), clip.watched():
            pass
