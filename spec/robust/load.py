"""The decoder under load: many threads, thousands of seeks, a thousand open files, and exhausted memory.

Jobs that measure memory or make allocations fail run in separate processes: `python -m spec.robust.load JOB ...` prints
one JSON object. The C core is tested with ThreadSanitizer. `run` returns the rows of the table; the tests use the same
functions with fewer rounds. Memory is that of the whole process, after a warm-up.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import athcodec
from athcodec.decoding.container import Limits
from athcodec.errors import AthError, LimitExceeded
from athcodec.sources import sample_path
from spec.robust import Row, ended

HERE = Path(__file__).resolve().parent
CORE = HERE.parent.parent / "athcodec" / "core"
TIMEOUT = 300.0  # Seconds after which a process counts as hung, beside those that its job was given.
RACE_FOUND = 66  # ThreadSanitizer's exit code
LIBRARIES = "-lm", "-lpthread", "-ldl"
GET_HANDLER = 305  # index of PyDataMem_GetHandler in NumPy's table of functions


# ---- processes ----


def job(name: str, *words: object, seconds: float = 0.0) -> tuple[int, dict]:
    """Return (exit code, result) of one job of this file in a process of its own. seconds: that it may use."""
    root = str(HERE.parent.parent)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])}
    try:
        done = ended(
            [sys.executable, "-m", "spec.robust.load", name, *map(str, words)],
            env=environment,
            timeout=seconds + TIMEOUT,
        )
    except subprocess.TimeoutExpired:
        return -1, {"error": "hung"}
    result = json.loads(done.stdout.splitlines()[-1]) if done.stdout else {}
    return done.returncode, result | ({"error": done.stderr[-2000:]} if done.returncode else {})


def compilers() -> list[str]:
    """Return compilers that may support ThreadSanitizer; clang first, whose programs run faster with it."""
    commands = [name for name in (os.environ.get("CC"), "clang", "gcc", "cc") if name and shutil.which(name.split()[0])]
    if not commands:
        raise RuntimeError("C compiler: found none of clang, gcc and cc; expected one, or its name in CC")
    return commands


def compiled(folder: Path, sources: list[Path], *options: str) -> Path:
    """Compile C sources to a program or library in `folder`, with the first compiler that succeeds, and return its
    path.
    """
    target = folder / sources[0].stem
    problems = ""
    for compiler in compilers():
        command = [*compiler.split(), "-std=c11", "-O1", "-g", *options, "-o", target, *sources, *LIBRARIES]
        done = ended(command)
        if done.returncode == 0:
            return target
        problems += f"{compiler}: {done.stderr.strip()[-500:]}\n"
    raise RuntimeError(f"{sources[0].name}: got no program, expected one of these compilers to make it\n{problems}")


# ---- threads ----


def thread_program(folder: Path) -> Path:
    """Build threads.c with the decoder's sources, under ThreadSanitizer."""
    cmake = (CORE / "CMakeLists.txt").read_text()
    names = re.search(r"set\(ATH_DECODER_SOURCES\s+([^)]*)\)", cmake)[1].split()
    flags = re.findall(r"^\s*(-f[\w=-]+)", cmake, re.MULTILINE)
    sources = [HERE / "threads.c", *(CORE / name for name in names)]
    folders = f"-I{CORE}", f"-I{CORE / 'include'}"
    return compiled(folder, sources, "-fsanitize=thread", *flags, "-DATH_STATIC", *folders)


def race(program: Path, *words: object) -> tuple[int, str, dict]:
    """Return (exit code, stderr, result) of one run of threads.c."""
    environment = os.environ | {"TSAN_OPTIONS": f"exitcode={RACE_FOUND} halt_on_error=1"}
    try:
        done = ended([program, *map(str, words)], env=environment, timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return -1, "hung", {}
    return done.returncode, done.stderr, json.loads(done.stdout) if done.stdout else {}


def threads_in_c(program: Path, files: list[Path], threads: int, rounds: int) -> Row:
    code, err, result = race(program, threads, rounds, *files)
    row = Row("threads, C core, ThreadSanitizer", result.get("preparations", 0), crashes=int(code < 0))
    row.wrong = result.get("wrong", 0) + err.count("WARNING: ThreadSanitizer")
    shown, feeds = result.get("frames", 0), result.get("feeds", 0)
    row.note = f"{threads} threads, {shown:,} frames shown, fed {feeds:,} times meanwhile"
    return row


def threads_in_python(files: list[Path], threads: int, looks: int) -> Row:
    """Read from files in several threads, through shared decoders and through separate ones, and compare all frames
    with those of a single thread. Each thread reads `looks` times. Return the counts as a row.
    """
    row = Row("threads, Python", 0, note=f"{threads} threads on {len(files)} files, shared and their own")
    shared = [athcodec.open(path) for path in files]
    expected = [[decoder.positions(level=level) for level in range(decoder.file.level_count)] for decoder in shared]

    def watch(seed: int) -> int:
        """Read random frames in one thread, and return how many of them are wrong."""
        rng, wrong = random.Random(seed), 0
        decoders = [athcodec.open(path) for path in files]
        for _ in range(looks):
            number = rng.randrange(len(files))
            decoder = rng.choice((shared, decoders))[number]
            wrong += not _same(decoder, expected[number], rng)
        for decoder in decoders:
            decoder.close()
        return wrong

    with ThreadPoolExecutor(threads) as pool:
        row.wrong = sum(pool.map(watch, range(threads)))
    row.tried = threads * looks
    for decoder in shared:
        decoder.close()
    return row


def _same(decoder: athcodec.Decoder, expected: list[np.ndarray], rng: random.Random) -> bool:
    """Return whether a random frame, or some frames, of a random level are as expected."""
    level, frame = rng.randrange(decoder.file.level_count), rng.randrange(decoder.frame_count)
    if rng.random() < 0.2:
        frames = slice(frame, frame + 10)
        return np.array_equal(decoder.positions(frames, level), expected[level][frames])
    return np.array_equal(decoder.positions(frame, level), expected[level][frame])


# ---- seeks ----


def resident_bytes() -> int:
    """Return the resident memory of this process; its peak if the system does not report it."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def seek_at_random(path: str, seeks: int) -> dict:
    """Read `seeks` random frames at random levels, and return how much the memory and the number of Python's objects
    grow, and how many frames are wrong.
    """
    rng = random.Random(4)
    with athcodec.open(path) as decoder:
        expected = [decoder.positions(level=level) for level in range(decoder.file.level_count)]

        def some(count: int) -> int:
            return sum(not _same(decoder, expected, rng) for _ in range(count))

        wrong = some(300)
        gc.collect()
        before, blocks = resident_bytes(), sys.getallocatedblocks()
        wrong += some(seeks)
        gc.collect()
        growth, objects = resident_bytes() - before, sys.getallocatedblocks() - blocks
        return {"seeks": seeks, "wrong": wrong, "growth": growth, "objects": objects}


def seeks(path: Path, count: int) -> Row:
    code, result = job("seeks", path, count)
    row = Row("random seeks and levels", result.get("seeks", 0), crashes=int(code != 0), wrong=result.get("wrong", 0))
    row.over_limit = int(result.get("growth", 0) > ALLOWED_GROWTH)
    row.note = f"memory grew by {result.get('growth', 0) / 1000:.0f} kB, {result.get('objects', 0)} objects more"
    return row


# Bytes that allocators of threads may keep; leaking a segment at each seek takes 25 times as much.
ALLOWED_GROWTH = 4 << 20


# ---- many at once ----


def open_many(path: str, count: int) -> dict:
    """Open `count` decoders at once and read from each, before and after others are closed in random order. Return the
    number of wrong frames, the bytes per decoder, and the number of files left open.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = count + 100
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    rng, before, files = random.Random(9), resident_bytes(), _open_files()
    with athcodec.open(path) as decoder:
        expected = [decoder.positions(level=level) for level in range(decoder.file.level_count)]
    decoders = [athcodec.open(path) for _ in range(count)]
    wrong = sum(not _same(decoder, expected, rng) for decoder in decoders)
    each = (resident_bytes() - before) / count
    rng.shuffle(decoders)
    while decoders:
        decoders.pop().close()
        for decoder in decoders[: 1 if len(decoders) % 10 else 5]:
            wrong += not _same(decoder, expected, rng)
    gc.collect()
    return {"decoders": count, "wrong": wrong, "bytes_per_decoder": each, "files_left": _open_files() - files}


def _open_files() -> int:
    return len(os.listdir("/dev/fd"))


def many(path: Path, count: int) -> Row:
    code, result = job("many", path, count)
    row = Row("decoders open at once", result.get("decoders", 0), crashes=int(code != 0), wrong=result.get("wrong", 0))
    row.wrong += result.get("files_left", 0)
    row.note = f"{result.get('bytes_per_decoder', 0) / 1000:.0f} kB each, closed in any order"
    return row


# ---- failing allocations ----


class FailingAllocator:
    """Replaces NumPy's allocator of arrays in this process, permanently, by that of scarce.c."""

    def __init__(self, folder: Path):
        """Install an allocator for NumPy's arrays whose n-th allocation can be made to fail; it is compiled in
        `folder`.
        """
        self._library = ctypes.CDLL(str(compiled(folder, [HERE / "scarce.c"], "-fPIC", "-shared")))
        self._library.scarce_arm.argtypes = [ctypes.c_long]
        self._library.scarce_install.argtypes = [ctypes.c_void_p]
        pointer = ctypes.pythonapi.PyCapsule_GetPointer
        pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
        table = ctypes.cast(pointer(np._core._multiarray_umath._ARRAY_API, None), ctypes.POINTER(ctypes.c_void_p))
        handler = ctypes.PYFUNCTYPE(ctypes.py_object)(table[GET_HANDLER])()
        if not self._library.scarce_install(pointer(handler, b"mem_handler")):
            raise RuntimeError("NumPy: got another kind of memory handler, expected version 1")

    def fail(self, n: int) -> None:
        """Let the n-th allocation from now on fail."""
        self._library.scarce_arm(n)

    def stop(self) -> bool:
        """Stop failing; whether the allocation has failed."""
        return bool(self._library.scarce_arm(0))


Call = Callable[[], object]


def _calls(path: str, out: str) -> dict[str, Call]:
    """Return the calls to test by name. They read the file `path` or write to `out`, and keep nothing in memory."""

    def opened(use: Callable[[athcodec.Decoder], object]) -> Call:
        def call() -> object:
            with athcodec.open(path) as decoder:
                return use(decoder)

        return call

    angle = np.linspace(0, 3, 40)
    rest = np.stack([np.zeros(12), np.linspace(0, 1, 12), np.zeros(12)], 1)
    clip = athcodec.MotionClip(
        positions=np.float32(rest + 0.1 * np.sin(angle)[:, None, None] * rest[:, 1:2] ** 2),
        time=np.arange(40) / 30,
        vertex_branch=np.repeat([0, 1, 2], 4),
        branch_parent=[-1, 0, 0],
        rest=rest,
    )
    return {
        "info": opened(lambda decoder: decoder.file.info()),
        "positions": opened(lambda decoder: decoder.positions()),
        "frames": opened(lambda decoder: [decoder.positions(i, level) for i in (0, -1) for level in (0, 1)]),
        "affines": opened(lambda decoder: decoder.affines(3, 1)),
        "static": opened(
            lambda opened_decoder: (
                opened_decoder.file.attributes,
                opened_decoder.metadata,
                opened_decoder.file.edges,
                opened_decoder.file.rest,
            )
        ),
        "check": opened(lambda decoder: decoder.file.check()),
        "truncate": lambda: athcodec.truncate(path, out, 0),
        "encode": lambda: athcodec.encode(clip, out, effort="fast", segment_frames=16),
    }


def run_out_of_memory(path: str, seconds: float) -> dict:
    """Run each call with its n-th allocation failing, for n from 1 until the call needs fewer, and return the counts
    and faults.

    A call may succeed, or raise MemoryError or an error of athcodec and leave no file. An open decoder must continue to
    work.
    """
    wrong, tried, raised, until = [], {}, 0, time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as name, athcodec.open(path) as lasting:
        folder = Path(name)
        memory, out = FailingAllocator(folder), folder / "out" / "out.ath"
        out.parent.mkdir()
        expected = lasting.positions()
        calls = _calls(path, str(out)) | {
            "an open decoder": lambda: [lasting.positions(i, level) for i in (0, -1) for level in (1, 0)]
        }
        for call_name, call in calls.items():
            call()  # fills caches
            files, n, fired, error = _open_files(), 1, True, None
            while fired and time.monotonic() < until:
                out.unlink(missing_ok=True)
                memory.fail(n)
                error = _error_of(call)
                fired = memory.stop()
                tried[call_name] = n - (not fired)
                raised += error is not None
                if not isinstance(error, (MemoryError, AthError, type(None))):
                    wrong.append(f"{call_name}, array {n}: {type(error).__name__}: {error}"[:300])
                if error is not None and any(out.parent.iterdir()):
                    wrong.append(f"{call_name}, array {n}: left a file")
                n += 1
            del error
            gc.collect()
            if _open_files() != files:
                wrong.append(f"{call_name}: {_open_files() - files} files stay open")
            if not np.array_equal(lasting.positions(), expected):
                wrong.append(f"{call_name}: the open decoder returns other positions")
    return {"tried": tried, "raised": raised, "wrong": wrong}


def _error_of(call: Call) -> BaseException | None:
    try:
        call()
    except BaseException as error:  # judged by the caller
        return error.with_traceback(None)
    return None


def failing_allocations(path: Path, seconds: float = 300.0) -> Row:
    """Return every allocation of an array in every call fails once."""
    code, result = job("allocations", path, seconds, seconds=seconds)
    row = Row("the n-th allocation of an array fails", sum(result.get("tried", {}).values()), crashes=int(code != 0))
    row.wrong = len(result.get("wrong", []))
    notes = [f"in {len(result.get('tried', {}))} calls, {result.get('raised', 0)} raised", *result.get("wrong", [])[:3]]
    row.note = "; ".join(notes + result.get("error", "").strip().splitlines()[-1:])
    return row


def in_little_space(path: str, megabytes: float) -> dict:
    """Decode a file with a limit on further address space (RLIMIT_AS), in megabytes. Return whether the frames are
    right, and the name of the error if there was one.
    """
    with athcodec.open(path) as decoder:
        expected = decoder.positions(0)
        room = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE") + int(megabytes * 1e6)
        resource.setrlimit(resource.RLIMIT_AS, (room, resource.RLIM_INFINITY))
        error = _error_of(lambda: [block.copy() for _, block in decoder.blocks()] + [decoder.positions()])
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        same = np.array_equal(decoder.positions(0), expected)
        return {"error_name": type(error).__name__ if error else "", "same": same}


def little_space(path: Path, sizes: list[float], until: float = float("inf")) -> Row:
    """Decode a file under several limits on address space, in megabytes, and return the counts as a row. Each run must
    give the right frames or raise MemoryError.
    """
    row, refused = Row("little address space", 0), 0
    for size in sizes:
        if time.monotonic() >= until:
            break
        code, result = job("space", path, size)
        row.tried += 1
        row.crashes += code != 0
        row.wrong += code == 0 and (not result["same"] or result["error_name"] not in ("", "MemoryError"))
        refused += result.get("error_name", "") != ""
    row.note = f"RLIMIT_AS; {refused} raised MemoryError"
    return row


def budgets(path: Path) -> Row:
    """Decode a file with Limits.memory_bytes from 1 up to enough, and return the counts as a row. Each run must raise
    LimitExceeded or give the right frames.
    """
    row = Row("memory budgets", 0)
    with athcodec.open(path) as decoder:
        expected = decoder.positions()
    budget, refused = 1, 0
    while budget < 1 << 31:
        row.tried += 1
        try:
            with athcodec.open(path, limits=Limits(memory_bytes=budget)) as decoder:
                row.wrong += not np.array_equal(decoder.positions(), expected)
        except LimitExceeded:
            refused += 1
        budget = int(budget * 1.3) + 1
    row.note = f"{refused} refused"
    return row


JOBS: dict[str, Callable[..., dict]] = {
    "seeks": lambda path, count: seek_at_random(path, int(count)),
    "many": lambda path, count: open_many(path, int(count)),
    "allocations": lambda path, seconds: run_out_of_memory(path, float(seconds)),
    "space": lambda path, megabytes: in_little_space(path, float(megabytes)),
}


def run(budget: float) -> list[Row]:
    """Test the decoder under load for about `budget` seconds, and return the counts as rows."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [folder / "short.ath", folder / "long.ath"]
        for path, frames in zip(files, (16, 40), strict=True):
            with athcodec.read_hdf5(sample_path()) as clip:
                athcodec.encode(clip, path, effort="fast", segment_frames=frames)
        rounds = max(1, int(budget / 60))
        return [
            threads_in_c(thread_program(folder), files, 16, rounds),
            threads_in_python(files, 16, 100 * rounds),
            seeks(files[0], 10_000),
            many(files[0], 1_000),
            budgets(files[0]),
            failing_allocations(files[1], budget / 3),
            little_space(files[1], [*range(8), *range(8, 40, 4)], time.monotonic() + budget / 3),
        ]


if __name__ == "__main__":
    print(json.dumps(JOBS[sys.argv[1]](*sys.argv[2:])))
