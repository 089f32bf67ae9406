"""External faults while files are written: writers killed at random moments, full disks, input and output that fails.

All of it runs the command line program in separate processes; `run` returns the rows of the table. A target must not
exist, be unchanged, or be a complete new file; the next writer to the same place must leave no temporary file; an error
must be one line, with exit code 1. The tests use the same functions with fewer rounds.
"""

from __future__ import annotations

import ctypes
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import athcodec
from athcodec.sources import sample_path
from spec.robust import Row

TIMEOUT = 120.0  # seconds after which a command counts as hung
ONE_LINE = re.compile(r"athcodec: error: [^\n]+\n")
VERBS = ("encode", "decode", "decode --gzip", "truncate")
OLDER = {
    ".ath": b"\x89ATH\r\n\x1a\nolder",
    ".h5": b"\x89HDF\r\n\x1a\nolder",
    ".npz": b"PK\x03\x04" + bytes(26) + b"older.npy",
}
"""By suffix, the first bytes of a file that the next one of its kind replaces."""


@dataclass
class Place:
    """A source and its .ath file, and an empty folder to write to."""

    source: Path
    encoded: Path
    folder: Path

    @classmethod
    def make(cls, folder: Path) -> Place:
        source, encoded, out = folder / "source.h5", folder / "encoded.ath", folder / "out"
        shutil.copy(sample_path(), source)
        with athcodec.read_hdf5(source) as clip:
            athcodec.encode(clip, encoded, effort="fast", segment_frames=40)
        out.mkdir()
        return cls(source, encoded, out)

    def words(self, verb: str, target: Path) -> list[str]:
        """Return the command line of a verb that writes `target`."""
        source = str(self.source if verb == "encode" else self.encoded)
        more = {"encode": ["--effort", "fast"], "decode --gzip": ["--gzip"], "truncate": ["--level", "1"]}
        return [verb.split()[0], source, str(target), *more.get(verb, [])]

    def left_over(self, target: Path) -> list[str]:
        return [path.name for path in self.folder.iterdir() if path != target]


def spawn(words: list[str], prepare: Callable[[], None] | None = None) -> subprocess.Popen:
    """Start athcodec with some arguments in a process that calls `prepare` first, and return the process."""
    return subprocess.Popen(
        [sys.executable, "-m", "athcodec", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=prepare,
    )


def finished(words: list[str], prepare: Callable[[], None] | None = None) -> tuple[int, str]:
    """Run athcodec with some arguments, and return its exit code and its standard error output. The exit code is
    -SIGKILL if it takes longer than TIMEOUT.
    """
    process = spawn(words, prepare)
    try:
        _, err = process.communicate(timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        _, err = process.communicate()
    return process.returncode, err


def is_whole(path: Path) -> bool:
    """Return whether an .ath or HDF5 file is complete, so that all of it can be read."""
    try:
        if path.suffix == ".ath":
            with athcodec.open(path, strict=True) as decoder:
                decoder.file.check()
        else:
            with athcodec.read(path) as clip:
                clip.block(0, clip.frame_count)
    except (athcodec.errors.AthError, OSError):
        return False
    return True


# ---- killed ----


def kill_while_writing(place: Place, rounds: int, seed: int, until: float = float("inf")) -> Row:
    """Run commands `rounds` times and kill each with SIGKILL: half of the time as soon as its partial file exists, else
    at a random moment. Return the counts as a row.
    """
    rng, row = random.Random(seed), Row("killed while writing", 0)
    parts = cleaned = 0
    while row.tried < rounds and time.monotonic() < until:
        verb = VERBS[row.tried % len(VERBS)]
        target = place.folder / ("target.h5" if verb.startswith("decode") else "target.ath")
        older = rng.choice([None, OLDER[target.suffix]])
        target.unlink(missing_ok=True)
        if older:
            target.write_bytes(older)
        row.wrong += not _survives_a_kill(place, verb, target, older, rng)
        left = place.left_over(target)
        parts += bool(left)
        _next_run(place, target)
        row.wrong += bool(place.left_over(target)) or not is_whole(target)
        cleaned += bool(left)
        row.tried += 1
        target.unlink()
    row.note = f"{parts} left a part, {cleaned} were removed by the next run"
    return row


def _survives_a_kill(place: Place, verb: str, target: Path, older: bytes | None, rng: random.Random) -> bool:
    """Kill a command while it writes, and return whether its target is then absent, unchanged (`older`) or complete."""
    process = spawn(place.words(verb, target))
    if rng.random() < 0.5:
        while process.poll() is None and not place.left_over(target):
            time.sleep(0.0005)
        time.sleep(rng.uniform(0, 0.004 if verb != "encode" else 0.3))
    else:
        time.sleep(rng.uniform(0, 1.5))
    process.kill()
    process.communicate()
    if not target.exists():
        return older is None
    return target.read_bytes() == older or is_whole(target)


def _next_run(place: Place, target: Path) -> None:
    """Write to the same place, as the next writer does; in this process, to be fast."""
    if target.suffix == ".ath":
        athcodec.truncate(place.encoded, target, 1)
    else:
        with athcodec.open(place.encoded) as decoder:
            athcodec.write_hdf5(decoder, target)


# ---- full disks ----


def fill_disk(place: Place, verbs: tuple[str, ...], sizes: list[int], until: float = float("inf")) -> Row:
    """Run commands under limits on the size of files (RLIMIT_FSIZE), so that a write fails with EFBIG. Return the
    counts as a row.
    """
    row = Row("no room to write", 0, note="RLIMIT_FSIZE, the error is EFBIG")
    for size in sizes:
        for verb in verbs:
            if time.monotonic() >= until:
                return row
            _judge_refusal(place, verb, row, lambda size=size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)))
    return row


def _judge_refusal(place: Place, verb: str, row: Row, prepare: Callable[[], None]) -> None:
    """Run a command that is expected to fail, and count it as wrong in `row` unless it prints one line, exits with 1
    and leaves an older file unchanged. A complete file is right, too, if it fitted.
    """
    target = place.folder / ("target.h5" if verb.startswith("decode") else "target.ath")
    target.write_bytes(OLDER[target.suffix])
    code, err = finished(place.words(verb, target), prepare)
    row.tried += 1
    row.hangs += code == -signal.SIGKILL
    row.crashes += code < 0 and code != -signal.SIGKILL
    refused = code == 1 and ONE_LINE.fullmatch(err) and target.read_bytes() == OLDER[target.suffix]
    row.wrong += not (refused or (code == 0 and is_whole(target))) or bool(place.left_over(target))
    target.unlink()


# ---- permissions ----

PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1


def obey_permissions() -> None:
    """Make file modes effective for the next program, even if the superuser runs it."""
    ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)


def write_where_not_allowed(place: Place, verbs: tuple[str, ...]) -> Row:
    """Run commands that write into a read-only folder and over a read-only file, and return the counts as a row."""
    row = Row("read-only target", 0)
    for verb in verbs:
        target = place.folder / ("target.h5" if verb.startswith("decode") else "target.ath")
        for locked in (place.folder, target):
            target.write_bytes(OLDER[target.suffix])
            mode = locked.stat().st_mode
            locked.chmod(0o555 if locked.is_dir() else 0o444)
            code, err = finished(place.words(verb, target), obey_permissions)
            locked.chmod(mode)
            row.tried += 1
            row.wrong += code != 1 or not ONE_LINE.fullmatch(err) or "read-only" not in err
            row.wrong += target.read_bytes() != OLDER[target.suffix] or bool(place.left_over(target))
            target.unlink()
    return row


def run(budget: float) -> list[Row]:
    """Test all faults for about `budget` seconds, with 200 kills among them, and return the counts as rows."""
    from spec.robust._io_errors import rows as io_errors  # which uses this module

    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        place = Place.make(Path(folder))
        sizes = [0, 1, 100, 1000, 2048, 4096, 8000]
        return [
            fill_disk(place, VERBS, sizes, start + 0.15 * budget),
            write_where_not_allowed(place, VERBS),
            kill_while_writing(place, 200, 2, start + 0.7 * budget),
            *io_errors(0.3 * budget),
        ]
