"""What a user of NumPy and h5py tries first: a decoder is an array, and what is in an array is encoded in one call."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import tracemalloc
from pathlib import Path

import h5py
import numpy as np
import pytest

import athcodec
from athcodec.errors import ClipError, LevelUnavailable, NotAnAthFile

COUNT = 50  # Frames of the bushy file.
INDICES = """0 | -1 | 5 | np.int64(7) | np.uint8(3) | np.array(4) | np.s_[10:20] | np.s_[:] | np.s_[::4] | np.s_[::-1]
| np.s_[30:3:-7] | np.s_[7:7] | np.s_[-3:99] | [3, 5] | [5, 3, 3, -1] | [] | range(2, 5) | np.array([[0, 1], [40, 2]])
| np.arange(50) % 3 == 0 | np.s_[5, :100] | np.s_[2:4, 3, 1] | np.s_[:, 1:3] | (-1, [4, 2]) | ([1, 2], [3, 4]) | True
| ([0, 49], ..., 2) | ... | () | (..., 0) | (3, ...) | None | (None, 3) | np.s_[1:3, None] | np.s_[:4, :, [0, 2]]"""
MAX = {"max_error": 0.01, "effort": "fast"}


def indices(text: str):
    """Run a test with each of the indices that are written with bars between them."""
    written = [part.strip() for part in text.split("|")]
    return pytest.mark.parametrize("index", [pytest.param(eval(part), id=part) for part in written])


@pytest.fixture(scope="module")
def decoder(bushy_ath):
    with athcodec.open(bushy_ath) as opened:
        yield opened


@pytest.fixture(scope="module")
def array(decoder):
    return decoder.positions()


@indices(INDICES)
def test_an_index_of_a_decoder_picks_what_it_picks_of_an_array(index, decoder, array):
    np.testing.assert_array_equal(decoder[index], array[index], strict=True)  # shape and type too


@indices("50 | -51 | [0, 50] | (0, 0, 3) | (0, 0, 0, 0) | np.ones(49, bool)")
def test_an_index_that_an_array_has_not_is_an_index_error_here_too(index, decoder, array):
    for sequence in (array, decoder):
        with pytest.raises(IndexError):
            sequence[index]


@indices("3.5 | [0.5, 2] | np.float64(2.0) | 'positions' | np.s_[0.5:2]")
def test_a_frame_between_two_is_an_error_that_names_what_shows_it(index, decoder):
    for ask in (decoder.__getitem__, decoder.positions):
        with pytest.raises(TypeError, match=r"at\(seconds\)"):
            ask(index)


def test_a_decoder_goes_wherever_an_array_goes(decoder, array, tmp_path):
    from dask.array import from_array  # here, because it takes long to import

    for name in ("shape", "dtype", "ndim", "size", "__len__"):
        mine, theirs = getattr(decoder, name), getattr(array, name)
        assert (mine() if callable(mine) else mine) == (theirs() if callable(theirs) else theirs)
    assert all(np.array_equal(one, other) for one, other in zip(decoder, array, strict=True))
    assert np.array_equal(list(reversed(decoder)), array[::-1]) and np.array(decoder, "f8").dtype == np.float64
    assert np.array_equal(np.mean(decoder, axis=0), array.mean(axis=0)) and np.array_equal(np.stack(decoder), array)
    with pytest.raises(ValueError, match="copy"):
        np.asarray(decoder, copy=False)
    lazy = from_array(decoder, chunks=(16, -1, -1))
    assert np.array_equal(lazy[5:40:7].compute(scheduler="synchronous"), array[5:40:7])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        stored = file.create_dataset("positions", data=decoder)
        for index in ((), ..., 3, slice(1, 40, 5), [3, 5], (slice(2, 9), 4), np.arange(COUNT) % 7 == 0):
            assert np.array_equal(stored[index], decoder[index])


def test_another_level_is_another_view_of_the_same_file(bushy_ath, tmp_path):
    with athcodec.open(bushy_ath) as decoder:
        coarse = decoder.at_level(0)
        assert coarse.file is decoder.file and (coarse.level, decoder.level) == (0, decoder.file.deepest)
        assert np.array_equal(coarse[3], decoder.positions(3, 0)) and not np.array_equal(coarse[3], decoder[3])
        assert np.array_equal(coarse.at_level(None)[3], decoder[3])
        assert np.array_equal(athcodec.ClipView(coarse, frames=range(4, 9)).positions[1:3], coarse[5:7])
        athcodec.write(coarse, tmp_path / "coarse.npz")
        with athcodec.read(tmp_path / "coarse.npz") as clip:
            assert np.array_equal(clip.block(0, COUNT), coarse)
        with pytest.raises(LevelUnavailable, match="expected 0 to"):
            decoder.at_level(99)
        shown = repr(coarse)
        for part in (
            "50 frames",
            f"{coarse.shape[1]:,} vertices",
            f"level 0 of 0 to {decoder.level}",
            "bytes",
            "error",
        ):
            assert part in shown
        decoder.close()
        assert repr(coarse) == shown


def test_a_time_shows_what_players_show_between_frames(decoder, array, medley_ath):
    seconds = decoder.time - decoder.time[0]
    assert np.allclose(decoder.at(seconds), array, atol=1e-6)
    assert np.allclose(decoder.at((seconds[3] + seconds[4]) / 2), (array[3] + array[4]) / 2, atol=1e-6)
    assert np.array_equal(decoder.at([-1.0, 1e6]), decoder.at([0.0, seconds[-1]]))
    with athcodec.open(medley_ath, clip="calm") as loop:
        lap = loop.clip.duration / (len(loop) - 1) * len(loop)
        assert np.allclose(loop.at(lap + 0.1), loop.at(0.1), atol=1e-5)
    for wrong in (np.nan, [0.0, np.inf]):
        with pytest.raises(ValueError, match="finite"):
            decoder.at(wrong)


@indices("np.s_[10:20] | np.s_[::4] | 33 | [3, 49]")
def test_an_index_takes_the_work_and_memory_of_the_segments_that_it_reads(index, bushy_ath, work_of):
    def cost(ask) -> tuple[int, int]:
        with athcodec.open(bushy_ath) as opened:
            ask(opened)  # What the file keeps is there from now on.
            tracemalloc.start()
            ask(opened)
            memory = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        with athcodec.open(bushy_ath) as opened:
            return work_of(lambda: ask(opened)), memory

    frames = np.atleast_1d(np.arange(COUNT)[index])
    with athcodec.open(bushy_ath) as opened:
        runs = [slice(*run) for run in opened.segments if np.isin(frames, range(*run)).any()]
    work, memory = cost(lambda opened: opened[index])
    assert work <= 1.1 * cost(lambda opened: [opened.positions(run) for run in runs])[0]
    assert memory <= 1.1 * cost(lambda opened: opened.positions(slice(runs[0].start, runs[-1].stop)))[1]


# ---- opening ----

HELD = {
    "bytes": lambda path: path.read_bytes(),
    "bytearray": lambda path: bytearray(path.read_bytes()),
    "strided": lambda path: memoryview(np.repeat(np.fromfile(path, np.uint8), 2))[::2],
    "BytesIO": lambda path: io.BytesIO(path.read_bytes()),
    "pipe": lambda path: subprocess.Popen(["cat", path], stdout=subprocess.PIPE).stdout,
    "str": str,
    "Path": Path,
}


@pytest.mark.parametrize("hold", HELD.values(), ids=HELD)
@pytest.mark.filterwarnings("ignore:subprocess:ResourceWarning")
def test_a_file_opens_from_all_that_holds_its_bytes(hold, bushy_ath, array):
    held = hold(bushy_ath)
    with athcodec.open(held) as decoder, held if hasattr(held, "read") else contextlib.nullcontext():
        assert np.array_equal(decoder, array)


def test_what_is_no_file_is_refused_by_its_type(bushy_ath):
    with open(bushy_ath, encoding="latin-1") as text:
        for wrong in (None, 5, 2.0, text, ["a.ath"]):
            with pytest.raises(TypeError, match="path: got"):
                athcodec.open(wrong)
    with pytest.raises(NotAnAthFile):
        athcodec.open(b"tree.ath")


# ---- encoding ----

HEIGHT, TIME = np.arange(12) * 6.0, np.arange(20)[:, None] / 5
BENT = np.round(np.sin(TIME) * HEIGHT**2 / 100)
STEM = np.stack([BENT, BENT * 0 + HEIGHT, BENT * 0], axis=-1)  # Whole numbers between -60 and 66.
BRANCHES = {"vertex_branch": [0] * 12, "branch_parent": [-1]}


@pytest.mark.parametrize("dtype", "f2 f4 >f4 f8 g i1 u1 i2 u2 i4 u4 i8 u8".split())
def test_every_real_type_is_encoded_and_the_summary_says_what_became_of_it(dtype):
    out, source = io.BytesIO(), (STEM + 60).astype(dtype)
    summary = athcodec.encode(source, out, **MAX, **BRANCHES)
    stored = np.dtype(np.float32 if dtype in "f2 f4 >f4 i1 u1 i2 u2" else np.float64)
    with athcodec.open(out.getvalue()) as decoder:
        assert decoder.dtype == stored and np.abs(decoder - (STEM + 60)).max() <= 0.01
    assert summary.converted == ("" if dtype[-2:] in ("f4", "f8") else f"positions: {np.dtype(dtype)} became {stored}")
    assert str(summary).endswith(summary.converted) and f"{summary.bytes:,} bytes" in str(summary)


def test_anything_that_slices_by_frames_gives_the_file_of_the_array(tmp_path):
    from dask.array import from_array  # here, because it takes long to import

    said = {"fps": 24, "unit": "cm", "up_axis": "y"}
    expected = athcodec.encode(STEM, **MAX, **said, **BRANCHES)
    mapped = np.memmap(tmp_path / "a.raw", float, "w+", shape=STEM.shape)
    mapped[:] = STEM
    with h5py.File(tmp_path / "a.h5", "w") as file:
        stored, lazy = file.create_dataset("p", data=STEM, chunks=(7, 12, 3)), from_array(STEM, (6, 12, 3))
        laid_out = STEM.astype(">f8"), np.asfortranarray(STEM), np.asfortranarray(STEM.astype(">f8"))
        for source in (mapped, stored, lazy, STEM.tolist(), list(STEM), np.ma.MaskedArray(STEM), *laid_out):
            assert athcodec.encode(source, **MAX, **said, **BRANCHES) == expected
    clip = athcodec.MotionClip(STEM, (np.arange(20) / 24).tolist(), metadata={"unit": "cm", "up_axis": "y"}, **BRANCHES)
    assert athcodec.encode(clip, **MAX) == expected
    athcodec.write(clip, tmp_path / "clip.h5")
    with athcodec.read(tmp_path / "clip.h5") as read:
        assert athcodec.encode(str(tmp_path / "clip.h5"), **MAX) == athcodec.encode(read, **MAX)
    with athcodec.open(expected) as decoder, athcodec.open(athcodec.encode(decoder, max_error=0.1)) as again:
        assert decoder.fps == pytest.approx(24) and decoder.metadata == again.metadata == clip.metadata
        assert not again.file.vertex_branch.any() and np.abs(again - STEM).max() <= 0.11


def test_a_path_a_file_object_and_none_get_the_same_bytes(tmp_path):
    expected, path, out = athcodec.encode(STEM, **BRANCHES), tmp_path / "a.ath", io.BytesIO()
    out.write(b"before")
    assert athcodec.encode(STEM, path, **BRANCHES).path == path
    assert athcodec.encode(STEM, out, **BRANCHES).path is None
    assert path.read_bytes() == expected and out.getvalue() == b"before" + expected
    reading, writing = os.pipe()
    with open(reading, "rb") as pipe:
        with open(writing, "wb") as end:
            athcodec.encode(STEM, end, **BRANCHES)
        assert pipe.read() == expected


REFUSED = {
    "masked": (np.ma.masked_less(STEM, 1), ClipError, "masked"),
    "complex": (STEM + 0j, ClipError, "dtype complex128"),
    "boolean": (STEM > 0, ClipError, "dtype bool"),
    "one frame": (STEM[0], ClipError, r"shape \(12, 3\), expected \(frames, vertices, 3\)"),
    "no frames": (STEM[:0], ClipError, "no frames"),
    "NaN": (np.where(STEM == 6, np.nan, STEM), ClipError, "frame 0, vertex 1"),
    "number": (5, ClipError, "shape"),
    "missing": ("missing.h5", FileNotFoundError, "missing.h5"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_holds_no_positions_is_refused_and_nothing_is_written(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source, error, words = REFUSED[case]
    with pytest.raises(error, match=words):
        athcodec.encode(source, "a.ath")
    assert list(tmp_path.iterdir()) == []


def test_options_and_targets_that_make_no_sense_are_refused(tmp_path):
    clip = athcodec.MotionClip(STEM, np.arange(20) / 30, **BRANCHES)
    for source, options in ((clip, {"faces": [[0, 1, 2]]}), (clip, {"fps": 24}), ("a.h5", {"vertex_branch": [0]})):
        with pytest.raises(ValueError, match="states its own"):
            athcodec.encode(source, **options)
    for options, error in (({"fps": 0}, ClipError), ({"rel_eror": 1e-3}, TypeError), ({"effort": "slow"}, ValueError)):
        with pytest.raises(error):
            athcodec.encode(STEM, **options)
    for mode, error in (("w", TypeError), ("rb", io.UnsupportedOperation)):
        with open(tmp_path / "a", mode) as target, pytest.raises(error, match="'wb'"):
            athcodec.encode(STEM, target)


# ---- comparing ----


def test_the_errors_of_every_level_and_frame_are_those_of_the_arrays(bushy_ath, bushy_clip, medley_ath, medley_clips):
    source = bushy_clip.block(0, COUNT)
    with athcodec.open(bushy_ath) as decoder:
        errors, again = athcodec.compare(source, decoder), athcodec.compare(bushy_clip, bushy_ath.read_bytes())
        for level in range(decoder.level + 1):
            distance = np.linalg.norm(decoder.at_level(level)[:] - source.astype(np.float64), axis=2)
            assert np.allclose(errors.max_error[level], distance.max(axis=1), rtol=1e-12)
            assert np.allclose(errors.rms_error[level], np.sqrt((distance**2).mean(axis=1)), rtol=1e-12)
            assert np.array_equal(errors.worst_vertex[level], distance.argmax(axis=1))
        assert (errors.max_error.max(axis=1) <= errors.promised).all() and np.array_equal(errors.time, decoder.time)
        assert np.array_equal(errors.max_error, again.max_error)
        with pytest.raises(ClipError, match="frames and vertices"):
            athcodec.compare(source[1:], decoder)
    with athcodec.join(medley_clips) as joined:
        calm = athcodec.compare(joined, medley_ath, clip="calm")
    assert np.array_equal(calm.max_error, athcodec.compare(medley_clips["calm"], medley_ath).max_error)
