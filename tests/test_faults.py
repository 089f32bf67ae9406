"""What a failed write leaves: nothing, or the older file; and what comes of sources that change or cannot be read.

Kills, full disks and read-only places are those of spec/robust/faults.py with a few rounds each; `python -m
spec.robustness --only faults` has many.
"""

from __future__ import annotations

import io
import os
import stat
from contextlib import nullcontext
from pathlib import Path

import h5py
import numpy as np
import pytest
from plants import plant

import athcodec
from athcodec import cli
from athcodec.files import atomic as atomic_files
from athcodec.files.atomic import PendingFile, new_file
from athcodec.sources import sample_path
from spec.robust import _io_errors, faults

pytestmark = pytest.mark.tools

DEAD = ".target.ath.0123abcd.part"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return faults.Place.make(tmp_path_factory.mktemp("faults"))


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


# ---- writers that die ----


@pytest.mark.parametrize("rounds", [6, pytest.param(200, marks=pytest.mark.slow)])
def test_a_killed_writer_leaves_the_older_file_or_a_whole_one_and_nothing_after_the_next_run(rounds, place):
    row = faults.kill_while_writing(place, rounds, seed=6)
    assert row.tried == rounds and row.wrong == 0
    assert row.note[0] != "0", "no writer was killed between its first byte and its last: nothing was tested"


@pytest.mark.parametrize(
    "write",
    [
        lambda path, ath: athcodec.truncate(ath, path, 1),
        lambda path, ath: athcodec.write_hdf5(plant(frames=3), path),
        lambda path, ath: athcodec.encode(plant(frames=3), path, effort="fast"),
    ],
    ids=["truncate", "write_hdf5", "encode"],
)
def test_every_writer_removes_what_a_dead_one_left_and_nothing_else(write, bushy_ath, tmp_path):
    others = {".other.ath.0123abcd.part", ".target.ath.part", ".target.ath.0123abcd.part.txt", "target.ath.part"}
    for name in {DEAD, *others}:
        (tmp_path / name).write_bytes(b"half a file")
    write(tmp_path / "target.ath", bushy_ath)
    assert names(tmp_path) == {"target.ath"} | others


def test_the_part_of_a_living_writer_stays_and_the_last_one_to_finish_wins(tmp_path):
    target = tmp_path / "target.ath"
    with new_file(target) as slow:
        slow.write(b"slow")
        with new_file(target) as quick:
            quick.write(b"quick")
        assert target.read_bytes() == b"quick" and len(names(tmp_path)) == 2
    assert target.read_bytes() == b"slow" and names(tmp_path) == {"target.ath"}


def test_a_part_whose_writer_cannot_be_asked_stays(tmp_path, monkeypatch):
    """A file system without locks."""

    def refuse(*_):
        raise OSError(37, "No locks available")

    monkeypatch.setattr(atomic_files.fcntl, "flock", refuse)
    (tmp_path / DEAD).write_bytes(b"who knows")
    with new_file(tmp_path / "target.ath") as out:
        out.write(b"new")
    assert names(tmp_path) == {DEAD, "target.ath"} and (tmp_path / "target.ath").read_bytes() == b"new"


def test_what_only_looks_like_a_part_is_not_followed(tmp_path):
    precious = tmp_path / "precious"
    precious.write_bytes(b"kept")
    (tmp_path / DEAD).symlink_to(precious)
    os.mkfifo(tmp_path / DEAD.replace("0123", "4567"))
    with new_file(tmp_path / "target.ath") as out:
        out.write(b"new")
    assert precious.read_bytes() == b"kept" and names(tmp_path) >= {DEAD, "precious", "target.ath"}


# ---- places that cannot be written to ----


def test_a_full_disk_is_one_line_and_leaves_the_older_file(place):
    row = faults.fill_disk(place, ("encode", "decode"), [4096])
    assert row.tried == 2 and row.crashes == row.hangs == row.wrong == 0


def test_a_read_only_folder_or_file_is_one_line_and_left_alone(place):
    row = faults.write_where_not_allowed(place, ("truncate",))
    assert row.tried == 2 and row.wrong == 0


def test_hdf5_is_written_where_the_environment_insists_on_its_locks(place, tmp_path):
    process = faults.spawn(
        place.words("decode", tmp_path / "a.h5"), lambda: os.environ.update(HDF5_USE_FILE_LOCKING="TRUE")
    )
    _, err = process.communicate(timeout=60)
    assert process.returncode == 0 and err == "" and faults.is_whole(tmp_path / "a.h5")


@pytest.mark.parametrize(
    "make",
    [os.mkfifo, lambda path: path.symlink_to("/dev/null"), lambda path: path.symlink_to(path)],
    ids=["pipe", "device", "endless link"],
)
def test_what_is_no_plain_file_is_refused_before_any_work(make, tmp_path, capsys):
    odd = tmp_path / "odd.ath"
    make(odd)
    before = _looks(odd)
    assert cli.main(["encode", str(sample_path()), str(odd)]) == 1
    assert faults.ONE_LINE.fullmatch(capsys.readouterr().err)
    assert _looks(odd) == before and names(tmp_path) == {"odd.ath"} and stat.S_ISCHR(os.stat("/dev/null").st_mode)


def _looks(path) -> tuple:
    """But for when it was read last, which looking at a link changes."""
    found = os.lstat(path)
    return found.st_mode, found.st_ino, found.st_uid, found.st_gid, found.st_size, found.st_mtime_ns


# ---- input and output that fails ----


@pytest.mark.parametrize("verb", _io_errors.VERBS)
def test_a_call_that_fails_is_one_line_that_names_a_file_and_leaves_the_older_one_or_a_whole_one(verb, tmp_path):
    row = _io_errors.each_call(verb, tmp_path, sample=8)
    assert row.tried == 8 and row.crashes == row.wrong == 0, row.note


@pytest.mark.slow
@pytest.mark.parametrize("lasts", [False, True])
@pytest.mark.parametrize("verb", _io_errors.VERBS)
def test_so_it_is_with_every_call(verb, lasts, tmp_path):
    row = _io_errors.each_call(verb, tmp_path, lasts=lasts)
    assert row.tried > 10 and row.crashes == row.wrong == 0, row.note


@pytest.mark.slow
def test_a_batch_whose_calls_fail_is_finished_by_the_next_run(tmp_path):
    row = _io_errors.each_call_of_batch(tmp_path, [1, 3, 7, 15, 25, 40, 60])
    assert row.tried == 7 and row.crashes == row.wrong == 0, row.note


# ---- what a new file is like ----


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_a_file_that_is_replaced_keeps_its_permissions(mode, bushy_ath, tmp_path):
    for suffix in (".ath", ".h5"):
        target = tmp_path / f"target{suffix}"
        target.write_bytes(faults.OLDER[suffix])
        target.chmod(mode)
    athcodec.truncate(bushy_ath, tmp_path / "target.ath", 0)
    athcodec.write_hdf5(plant(frames=3), tmp_path / "target.h5")
    assert {stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()} == {mode}


def test_a_new_file_has_the_permissions_of_any_new_file(bushy_ath, tmp_path):
    (tmp_path / "plain").touch()
    athcodec.truncate(bushy_ath, tmp_path / "new.ath", 0)
    athcodec.write_hdf5(plant(frames=3), tmp_path / "new.h5")
    assert len({stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()}) == 1


def test_a_link_stays_and_the_file_behind_it_is_replaced(bushy_ath, tmp_path):
    real, link = tmp_path / "far" / "real.ath", tmp_path / "near" / "link.ath"
    for path in (real, link):
        path.parent.mkdir()
    link.symlink_to(real)
    for _ in range(2):  # first to where nothing is yet
        athcodec.truncate(bushy_ath, link, 0)
        assert link.is_symlink() and not real.is_symlink() and names(real.parent) == {"real.ath"}
        assert faults.is_whole(real)


def test_names_of_the_longest_length_can_be_written(bushy_ath, tmp_path):
    target = tmp_path / ("ü" * 125 + ".ath")
    athcodec.truncate(bushy_ath, target, 0)
    assert names(tmp_path) == {target.name}


@pytest.mark.parametrize("link", [os.symlink, os.link], ids=["symbolic", "hard"])
@pytest.mark.parametrize("verb", faults.VERBS)
def test_the_input_is_not_replaced_by_the_output_under_another_name_either(verb, link, place, tmp_path, capsys):
    source = place.source if verb == "encode" else place.encoded
    before, alias = source.read_bytes(), tmp_path / "alias.ath"
    link(source, alias)
    assert cli.main(place.words(verb, alias)) == 1
    assert "is the input" in capsys.readouterr().err and source.read_bytes() == before


def test_a_pending_file_can_be_discarded_twice(tmp_path):
    pending = PendingFile(tmp_path / "a.ath")
    pending.discard()
    pending.discard()
    assert names(tmp_path) == set()


# ---- sources that misbehave ----


@pytest.fixture
def long_source(tmp_path):
    """A clip of 200 frames in 20 vertices, as HDF5."""
    path = tmp_path / "source.h5"
    athcodec.write_hdf5(plant(seed=1, branches=5, longest=4, frames=200), path)
    return path


def shrink(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def overwrite(path: Path) -> None:
    with h5py.File(path) as file:
        place = file["positions"].id.get_offset()
    data = bytearray(path.read_bytes())
    data[place : place + 600] = np.linspace(0, 1, 150, dtype=np.float32).tobytes()
    path.write_bytes(data)


@pytest.mark.parametrize("stage", ["survey", "search", "motion"])
@pytest.mark.parametrize("change", [shrink, overwrite])
def test_a_source_that_changes_while_it_is_read_is_refused_by_name(
    change, stage, long_source, tmp_path, capsys, monkeypatch
):
    pending = [stage]

    def report(now: str, fraction: float) -> None:
        if now in pending:
            pending.remove(now)
            change(long_source)

    monkeypatch.setattr("athcodec.cli.verbs.progress", lambda: nullcontext(report))
    assert cli.main(["encode", str(long_source), str(tmp_path / "a.ath"), "--effort", "fast"]) == 1
    err = capsys.readouterr().err
    assert not pending and faults.ONE_LINE.fullmatch(err) and str(long_source) in err
    assert "changed while it was read" in err and names(tmp_path) == {"source.h5"}


def test_comparing_with_a_source_that_changes_is_refused(long_source, tmp_path, capsys, monkeypatch):
    assert cli.main(["encode", str(long_source), str(tmp_path / "a.ath"), "--effort", "fast"]) == 0
    capsys.readouterr()
    monkeypatch.setattr("athcodec.cli.clips.progress", lambda: nullcontext(lambda stage, fraction: shrink(long_source)))
    assert cli.main(["verify", str(tmp_path / "a.ath"), "--against", str(long_source)]) == 1
    assert "changed while it was read" in capsys.readouterr().err


class Restless:
    """Positions that are others, `factor` times as large, each time they are read."""

    def __init__(self, array: np.ndarray, factor: float):
        self.array, self.shape, self.dtype, self.factor, self.reads = array, array.shape, array.dtype, factor, 0

    def __getitem__(self, frames):
        self.reads += 1
        return self.array[frames] * self.dtype.type(self.factor**self.reads)


def restless(factor: float) -> athcodec.MotionClip:
    source = plant(seed=1, branches=5, longest=4, frames=40)
    return source.replace(positions=Restless(source.positions, factor))


def test_arrays_that_change_a_little_between_two_readings_give_an_intact_file(tmp_path):
    athcodec.encode(restless(1.2), tmp_path / "a.ath", effort="fast", segment_frames=16)
    assert faults.is_whole(tmp_path / "a.ath")


@pytest.mark.parametrize("factor", [50.0, 1e4])
def test_arrays_that_change_much_between_two_readings_are_an_error_and_leave_no_file(factor, tmp_path):
    with pytest.raises((athcodec.errors.ClipError, athcodec.errors.BoundError), match="float32|expected finite"):
        athcodec.encode(restless(factor), tmp_path / "a.ath", effort="fast", segment_frames=16)
    assert names(tmp_path) == set()


class Dribble(io.RawIOBase):
    """A file that gives a few bytes at a time, as pipes, sockets and some network file systems do."""

    def __init__(self, data: bytes):
        self.file = io.BytesIO(data)

    def seekable(self) -> bool:
        return True

    def seek(self, *place) -> int:
        return self.file.seek(*place)

    def read(self, size: int = -1) -> bytes:
        return self.file.read(min(size, 1 + self.file.tell() % 7))


def test_a_file_that_gives_a_few_bytes_at_a_time_is_read_all_the_same(full_ath):
    with athcodec.open(full_ath) as decoder, athcodec.open(Dribble(full_ath.read_bytes()), strict=True) as slow:
        slow.file.check()
        assert np.array_equal(slow.positions(), decoder.positions()) and slow.metadata == decoder.metadata


def test_a_file_that_shrinks_while_it_is_played_is_truncated_where_it_is_read(sample_ath, tmp_path):
    path = tmp_path / "shrinking.ath"
    path.write_bytes(sample_ath.read_bytes())
    with athcodec.open(path) as decoder:
        coarse = decoder.positions(0, 0)
        os.truncate(path, decoder.levels[0].bytes)
        with pytest.raises(athcodec.errors.Truncated):
            decoder.positions(0)
        assert np.array_equal(decoder.positions(0, 0), coarse), "level 0 is still there"


def test_an_unreadable_source_is_an_os_error_of_one_line(capsys, tmp_path):
    """/proc/self/mem can be opened and fails when it is read."""
    assert cli.main(["info", "/proc/self/mem"]) == 1
    assert faults.ONE_LINE.fullmatch(capsys.readouterr().err)
