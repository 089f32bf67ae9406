"""The decoder under load: threads, seeks, many files at once, and memory that runs out.

These are the runs of spec/robust/load.py with fewer rounds; `python -m spec.robustness --only load` has the
long ones.
"""

from __future__ import annotations

import itertools
import threading

import numpy as np
import pytest

import athcodec
from athcodec.decoding import core_file
from athcodec.decoding.container import Limits
from athcodec.errors import LimitExceeded
from spec.robust import load

pytestmark = pytest.mark.tools


@pytest.fixture(scope="module")
def thread_program(tmp_path_factory):
    return load.thread_program(tmp_path_factory.mktemp("threads"))


# ---- threads ----


def test_sixteen_threads_in_c_race_nowhere_and_see_what_one_alone_does(thread_program, bushy_ath, full_ath):
    row = load.threads_in_c(thread_program, [bushy_ath, full_ath], threads=16, rounds=1)
    assert row.tried > 16 * 8 and row.crashes == row.wrong == 0


def test_the_thread_sanitizer_reports_a_data_race(thread_program, bushy_ath):
    """Two threads on one ath_work without synchronisation, which ath.h forbids."""
    code, err, _ = load.race(thread_program, "race", 2, bushy_ath)
    assert code == load.RACE_FOUND and "WARNING: ThreadSanitizer: data race" in err


def test_sixteen_threads_in_python_see_what_one_alone_does(bushy_ath, full_ath):
    row = load.threads_in_python([bushy_ath, full_ath], threads=16, looks=40)
    assert row.tried == 640 and row.wrong == 0


def test_closing_while_others_play_is_an_error_of_theirs_and_no_crash(sample_ath):
    decoder = athcodec.open(sample_ath)
    expected, unexpected, playing = decoder.positions(), [], threading.Barrier(5)

    def play(seed: int) -> None:
        rng = np.random.default_rng(seed)
        try:
            for shown in itertools.count():
                frame = int(rng.integers(decoder.frame_count))
                if not np.array_equal(decoder.positions(frame), expected[frame]):
                    unexpected.append(frame)
                if shown == 0:
                    playing.wait()
        except ValueError as error:
            unexpected.extend([] if "closed" in str(error) else [error])

    threads = [threading.Thread(target=play, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    playing.wait()
    decoder.close()
    for thread in threads:
        thread.join(60)
    assert not unexpected and not any(thread.is_alive() for thread in threads)
    decoder.close()


# ---- for long and many ----


@pytest.mark.parametrize(
    "count, name", [(1_000, "bushy_ath"), pytest.param(10_000, "sample_ath", marks=pytest.mark.slow)]
)
def test_thousands_of_seeks_do_not_grow_memory(count, name, request):
    row = load.seeks(request.getfixturevalue(name), count)
    assert row.tried == count and row.crashes == row.wrong == row.over_limit == 0, row.note


def test_a_thousand_files_are_open_at_once_and_close_in_any_order(full_ath):
    row = load.many(full_ath, 1_000)
    assert row.tried == 1_000 and row.crashes == row.wrong == 0, row.note


# ---- memory that runs out ----


class Scarce:
    """The binding's one source of memory for the core, whose n-th request from `fail` on fails."""

    def __init__(self, monkeypatch):
        self.left, aligned = -1, core_file.aligned
        monkeypatch.setattr(core_file, "aligned", lambda size: self.take() or aligned(size))

    def take(self) -> None:
        self.left -= 1
        if self.left == 0:
            raise MemoryError


def test_memory_that_fails_for_the_core_leaves_a_decoder_that_goes_on(sample_ath, monkeypatch):
    with athcodec.open(sample_ath) as decoder:
        expected = decoder.positions()

    def show_two_levels() -> None:
        with athcodec.open(sample_ath) as decoder:
            for level in (0, decoder.file.level_count - 1):
                decoder.positions(0, level)

    scarce = Scarce(monkeypatch)
    show_two_levels()
    requests = -1 - scarce.left
    assert requests > 4, "the file, and of two levels what segments share and a segment"
    for n in range(1, requests + 1):
        scarce.left = n
        with pytest.raises(MemoryError):
            show_two_levels()
    scarce.left = requests + 1
    show_two_levels()
    for n in (1, 2):
        scarce.left = -1
        with athcodec.open(sample_ath) as decoder:
            scarce.left = n
            with pytest.raises(MemoryError):
                decoder.positions(0)
            assert np.array_equal(decoder.positions(), expected)


def test_every_budget_of_memory_is_kept_to_or_refused(bushy_ath):
    row = load.budgets(bushy_ath)
    assert row.wrong == 0 and row.note[0] != "0"
    with athcodec.open(bushy_ath, limits=Limits(memory_bytes=1 << 31)) as decoder:
        assert decoder.positions().size
    with pytest.raises(LimitExceeded):
        athcodec.open(bushy_ath, limits=Limits(memory_bytes=1)).positions()


@pytest.mark.slow
def test_every_array_of_every_call_failing_once_is_a_memory_error_and_nothing_else(full_ath):
    row = load.failing_allocations(full_ath, seconds=1500)
    assert row.tried > 1_000 and row.crashes == row.wrong == 0, row.note


@pytest.mark.slow
def test_little_address_space_is_a_memory_error(sample_ath):
    row = load.little_space(sample_ath, [0, 0.3, 1, 3, 10])
    assert row.tried == 5 and row.crashes == row.wrong == 0, row.note


def test_where_no_thread_can_be_started_the_caller_decodes_all_segments(sample_clip, tmp_path):
    """A thread takes 8 MB of address space."""
    path = tmp_path / "segments.ath"
    athcodec.encode(sample_clip, path, effort="fast", segment_frames=40)
    row = load.little_space(path, [4, 5, 6, 7])
    assert row.faults == 0 and row.tried == 4
