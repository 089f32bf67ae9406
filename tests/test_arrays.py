"""What a user of NumPy and h5py tries first: a decoder is an array, and what is in an array is encoded in one call."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import dask.array
import h5py
import numpy as np
import pytest

import athcodec
from athcodec.errors import ClipError, LevelUnavailable, NotAnAthFile

ROOT = Path(__file__).resolve().parent.parent
COUNT, SEGMENT = 50, 16  # Frames of the bushy file, and of its longest segment.
INDICES = [
    *(0, -1, 5, np.int64(7), np.uint8(3), np.array(4)),
    *(
        slice(10, 20),
        slice(None),
        slice(None, None, 4),
        slice(None, None, -1),
        slice(30, 3, -7),
        slice(7, 7),
        slice(-3, 99),
    ),
    *([3, 5], [5, 3, 3, -1], [], range(2, 5), np.array([[0, 1], [40, 2]]), np.arange(COUNT) % 3 == 0),
    *(
        (5, slice(100)),
        (slice(2, 4), 3, 1),
        (slice(None), slice(1, 3)),
        (-1, [4, 2]),
        ([1, 2], [3, 4]),
        ([0, 49], ..., 2),
    ),
    *(..., (), (..., 0), (3, ...), None, (None, 3), (slice(1, 3), None), (slice(0, 4), slice(None), [0, 2]), True),
]
REFUSED = [50, -51, [0, 50], (0, 0, 3), (0, 0, 0, 0), np.ones(49, bool)]


@pytest.fixture(scope="module")
def decoder(bushy_ath):
    with athcodec.open(bushy_ath) as opened:
        yield opened


@pytest.fixture(scope="module")
def array(decoder):
    return decoder.positions()


@pytest.mark.parametrize("index", INDICES, ids=repr)
def test_an_index_of_a_decoder_picks_what_it_picks_of_an_array(index, decoder, array):
    expected, shown = array[index], decoder[index]
    assert shown.shape == expected.shape and shown.dtype == expected.dtype and np.array_equal(shown, expected)


@pytest.mark.parametrize("index", REFUSED, ids=repr)
def test_an_index_that_an_array_has_not_is_an_index_error_here_too(index, decoder, array):
    for sequence in (array, decoder):
        with pytest.raises(IndexError):
            sequence[index]


@pytest.mark.parametrize("index", [3.5, [0.5, 2], np.float64(2.0), "positions"], ids=repr)
def test_a_frame_between_two_is_an_error_that_names_what_shows_it(index, decoder):
    for ask in (decoder.__getitem__, decoder.positions):
        with pytest.raises(TypeError, match=r"at\(seconds\)"):
            ask(index)


def test_a_decoder_has_the_properties_of_an_array_and_goes_into_its_functions(decoder, array):
    for name in ("shape", "dtype", "ndim", "size"):
        assert getattr(decoder, name) == getattr(array, name)
    assert len(decoder) == len(array) and decoder
    assert all(np.array_equal(one, other) for one, other in zip(decoder, array, strict=True))
    assert all(np.array_equal(one, other) for one, other in zip(reversed(decoder), reversed(array), strict=True))
    assert np.array_equal(np.asarray(decoder), array) and np.array(decoder, np.float64).dtype == np.float64
    assert np.array_equal(np.mean(decoder, axis=0), array.mean(axis=0)) and np.array_equal(np.stack(decoder), array)
    lazy = dask.array.from_array(decoder, chunks=(SEGMENT, -1, -1))
    assert np.array_equal(lazy[5:40:7].compute(scheduler="synchronous"), array[5:40:7])
    with pytest.raises(ValueError, match="copy"):
        np.asarray(decoder, copy=False)


def test_h5py_and_a_decoder_give_the_same_for_the_same_index(decoder, array, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        stored = file.create_dataset("positions", data=array)
        for index in ((), ..., 3, slice(1, 40, 5), [3, 5], (slice(2, 9), 4), np.arange(COUNT) % 7 == 0):
            assert np.array_equal(stored[index], decoder[index])
        assert (stored.shape, stored.dtype, len(stored), stored.ndim) == (*(decoder.shape, decoder.dtype), COUNT, 3)


def test_another_level_is_another_view_of_the_same_file(bushy_ath, tmp_path):
    with athcodec.open(bushy_ath) as decoder:
        coarse = decoder.at_level(0)
        assert coarse.file is decoder.file and (coarse.level, decoder.level) == (0, decoder.file.deepest)
        assert np.array_equal(coarse[3], decoder.positions(3, 0)) and not np.array_equal(coarse[3], decoder[3])
        assert np.array_equal(coarse.at_level(None)[3], decoder[3])
        athcodec.write(coarse, tmp_path / "coarse.npz")
        with athcodec.read(tmp_path / "coarse.npz") as clip:
            assert np.array_equal(clip.block(0, COUNT), coarse)
        for level in (-1, 99):
            with pytest.raises(LevelUnavailable, match="expected 0 to"):
                decoder.at_level(level)
        view = athcodec.ClipView(coarse, frames=range(4, 9))
        assert np.array_equal(view.positions[1:3], coarse[5:7])
        shown = repr(coarse)
        for part in (
            f"{COUNT} frames",
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
    between = decoder.at((seconds[3] + seconds[4]) / 2)
    assert np.allclose(between, (array[3] + array[4]) / 2, atol=1e-6) and between.dtype == np.float32
    assert np.array_equal(decoder.at([-1.0, 1e6]), decoder.at([0.0, seconds[-1]]))
    with athcodec.open(medley_ath, clip="calm") as loop:
        lap = loop.clip.duration / (len(loop) - 1) * len(loop)
        assert np.allclose(loop.at(lap + 0.1), loop.at(0.1), atol=1e-5)
    for wrong in (np.nan, [0.0, np.inf]):
        with pytest.raises(ValueError, match="finite"):
            decoder.at(wrong)


@pytest.mark.parametrize("index", [slice(10, 20), slice(0, COUNT, 4), 33, [3, 49]], ids=repr)
def test_an_index_takes_the_work_and_memory_of_the_frames_that_it_names(index, bushy_ath, work_of):
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


@pytest.mark.parametrize(
    "kind", ["bytes", "bytearray", "memoryview", "strided", "BytesIO", "file", "pipe", "str", "Path"]
)
def test_a_file_opens_from_all_that_holds_its_bytes(kind, bushy_ath, array):
    data = bushy_ath.read_bytes()
    with contextlib.ExitStack() as opened:
        given = {
            "bytes": lambda: data,
            "bytearray": lambda: bytearray(data),
            "memoryview": lambda: memoryview(data),
            "strided": lambda: memoryview(bytes(2 * [byte for byte in data for _ in "ab"]))[: 2 * len(data) : 2],
            "BytesIO": lambda: io.BytesIO(data),
            "file": lambda: opened.enter_context(open(bushy_ath, "rb")),
            "pipe": lambda: opened.enter_context(_piped(bushy_ath)).stdout,
            "str": lambda: str(bushy_ath),
            "Path": lambda: bushy_ath,
        }[kind]()
        with athcodec.open(given) as decoder:
            assert np.array_equal(decoder, array)


def _piped(path: Path) -> subprocess.Popen:
    code = f"import sys; sys.stdout.buffer.write(open({str(path)!r}, 'rb').read())"
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)


def test_what_is_no_file_is_refused_by_its_type(bushy_ath):
    with open(bushy_ath, encoding="latin-1") as text:
        for wrong in (None, 5, 2.0, text, ["a.ath"]):
            with pytest.raises(TypeError, match="path: got"):
                athcodec.open(wrong)
    with pytest.raises(NotAnAthFile):
        athcodec.open(b"tree.ath")


# ---- encoding ----


@pytest.fixture
def stem():
    """Positions (20, 12, 3) of a stem that bends, in float64 and whole numbers of up to 100, and its branches."""
    height, time = np.arange(12) * 6.0, np.arange(20)[:, None] / 5
    positions = np.zeros((20, 12, 3))
    positions[..., 1], positions[..., 0] = height, np.round(np.sin(time) * height**2 / 100)
    return positions, {"vertex_branch": np.zeros(12, int), "branch_parent": [-1]}


@pytest.mark.parametrize("dtype", ["f2", "f4", ">f4", "f8", "g", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"])
def test_every_real_type_is_encoded_and_the_summary_says_what_became_of_it(dtype, stem):
    positions, branches = stem
    out = io.BytesIO()
    summary = athcodec.encode((positions + 60).astype(dtype), out, max_error=0.01, **branches)
    stored = np.dtype(np.float32 if dtype in ("f2", "f4", ">f4", "i1", "u1", "i2", "u2") else np.float64)
    with athcodec.open(out.getvalue()) as decoder:
        assert decoder.dtype == stored and np.abs(decoder - (positions + 60)).max() <= 0.01
    assert summary.converted == ("" if dtype[-2:] in ("f4", "f8") else f"positions: {np.dtype(dtype)} became {stored}")
    assert summary.converted in str(summary) and f"{summary.bytes:,} bytes" in str(summary) and summary.path is None


def test_anything_that_slices_by_frames_gives_the_file_of_the_array(stem, tmp_path):
    positions, branches = stem
    expected = athcodec.encode(positions, max_error=0.01, fps=24, unit="cm", up_axis="y", **branches)
    mapped = np.memmap(tmp_path / "a.raw", float, "w+", shape=positions.shape)
    mapped[:] = positions
    with h5py.File(tmp_path / "a.h5", "w") as file:
        stored = file.create_dataset("positions", data=positions, chunks=(7, 12, 3))
        clip = athcodec.MotionClip(positions, np.arange(20) / 24, metadata={"unit": "cm", "up_axis": "y"}, **branches)
        lazy = dask.array.from_array(positions, chunks=(6, 12, 3))
        for source in (mapped, stored, lazy, positions.tolist(), list(positions), np.ma.MaskedArray(positions)):
            assert athcodec.encode(source, max_error=0.01, fps=24, unit="cm", up_axis="y", **branches) == expected
        assert athcodec.encode(clip, max_error=0.01) == expected
    athcodec.write(clip, tmp_path / "clip.h5")
    with athcodec.read(tmp_path / "clip.h5") as read:
        of_file = athcodec.encode(read, max_error=0.01)
    assert athcodec.encode(str(tmp_path / "clip.h5"), max_error=0.01) == of_file
    with athcodec.open(expected) as decoder:
        assert decoder.fps == pytest.approx(24) and decoder.metadata == {"unit": "cm", "up_axis": "y"}
        with athcodec.open(athcodec.encode(decoder, max_error=0.1)) as again:
            assert np.array_equal(again.file.vertex_branch, decoder.file.vertex_branch)
            assert again.metadata == decoder.metadata and np.abs(again - positions).max() <= 0.11


def test_a_path_a_file_object_and_none_get_the_same_bytes(stem, tmp_path):
    positions, branches = stem
    expected, path, out = athcodec.encode(positions, **branches), tmp_path / "a.ath", io.BytesIO()
    out.write(b"before")
    assert athcodec.encode(positions, path, **branches).path == path
    athcodec.encode(positions, out, **branches)
    assert path.read_bytes() == expected and out.getvalue() == b"before" + expected
    reading, writing = os.pipe()
    with open(reading, "rb") as pipe, open(writing, "wb") as end:
        athcodec.encode(positions, end, **branches)
        end.close()
        assert pipe.read() == expected


REFUSED_SOURCES = {
    "masked": (lambda p: np.ma.masked_less(p, 1), ClipError, "masked"),
    "complex": (lambda p: p + 0j, ClipError, "dtype complex128"),
    "boolean": (lambda p: p > 0, ClipError, "dtype bool"),
    "text": (lambda p: p.astype(str), ClipError, "dtype"),
    "one frame": (lambda p: p[0], ClipError, r"shape \(12, 3\), expected \(frames, vertices, 3\)"),
    "flat": (lambda p: p.reshape(20, 36), ClipError, "expected"),
    "no frames": (lambda p: p[:0], ClipError, "no frames"),
    "NaN": (lambda p: np.where(p == 6, np.nan, p), ClipError, "frame 0, vertex 1"),
    "number": (lambda p: 5, ClipError, "shape"),
    "missing": (lambda p: "missing.h5", FileNotFoundError, "missing.h5"),
}


@pytest.mark.parametrize("case", REFUSED_SOURCES)
def test_what_holds_no_positions_is_refused_and_nothing_is_written(case, stem, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    change, error, words = REFUSED_SOURCES[case]
    with pytest.raises(error, match=words):
        athcodec.encode(change(stem[0]), "a.ath")
    assert list(tmp_path.iterdir()) == []


def test_options_and_targets_that_make_no_sense_are_refused_before_any_work(stem, tmp_path):
    positions, branches = stem
    clip = athcodec.MotionClip(positions, np.arange(20) / 30, **branches)
    for source, options in ((clip, {"faces": [[0, 1, 2]]}), (clip, {"fps": 24}), ("a.h5", {"vertex_branch": [0]})):
        with pytest.raises(ValueError, match="states its own"):
            athcodec.encode(source, **options)
    for options, error in (({"fps": 0}, ClipError), ({"rel_eror": 1e-3}, TypeError), ({"effort": "slow"}, ValueError)):
        with pytest.raises(error):
            athcodec.encode(positions, **options)
    (tmp_path / "a").write_bytes(b"")
    with open(tmp_path / "a", encoding="utf-8") as text, pytest.raises(TypeError, match="'wb'"):
        athcodec.encode(positions, text)
    with open(tmp_path / "a", "rb") as reading, pytest.raises(io.UnsupportedOperation, match="'wb'"):
        athcodec.encode(positions, reading)


# ---- comparing ----


def test_the_errors_of_every_level_and_frame_are_those_of_the_arrays(bushy_ath, bushy_clip):
    source = bushy_clip.block(0, COUNT)
    with athcodec.open(bushy_ath) as decoder:
        for given in (source, bushy_clip):
            for file in (decoder, bushy_ath, bushy_ath.read_bytes()):
                errors = athcodec.compare(given, file)
        for level in range(decoder.level + 1):
            distance = np.linalg.norm(decoder.at_level(level)[:] - source.astype(np.float64), axis=2)
            assert np.allclose(errors.max_error[level], distance.max(axis=1), rtol=1e-12)
            assert np.allclose(errors.rms_error[level], np.sqrt((distance**2).mean(axis=1)), rtol=1e-12)
            assert np.array_equal(errors.worst_vertex[level], distance.argmax(axis=1))
        assert (errors.max_error.max(axis=1) <= errors.promised).all() and np.array_equal(errors.time, decoder.time)
        with pytest.raises(ClipError, match="frames and vertices"):
            athcodec.compare(source[1:], decoder)


def test_a_clip_of_several_is_compared_with_the_one_of_its_name(medley_ath, medley_clips):
    with athcodec.join(medley_clips) as joined:
        errors = athcodec.compare(joined, medley_ath, clip="calm")
    alone = athcodec.compare(medley_clips["calm"], medley_ath)
    assert np.array_equal(errors.max_error, alone.max_error) and errors.max_error.shape[1] == 20
