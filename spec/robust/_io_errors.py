"""Errors of input and output at every call: the n-th read, write, fsync, rename or close of a run fails, for every n.

A library in C stands between the command line program and the system (faulty.c, by LD_PRELOAD). A run must end in one
line that names a file, with exit code 1, or be done; the target is the older file or a complete one; what else is left
the next run removes.
"""

from __future__ import annotations

import ctypes
import errno
import io
import json
import os
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from spec.robust import Row, ended
from spec.robust.faults import OLDER, ONE_LINE, Place, is_whole
from spec.robust.load import compiled

HERE = Path(__file__).resolve().parent
VERBS = {"encode": "target.ath", "decode": "target.h5", "decode npz": "target.npz", "truncate": "target.ath"}
ERRORS = (errno.EIO, errno.ENOSPC)
DEAD = 70
"""Exit code of a run that says nothing of itself."""


def build(folder: Path) -> Path:
    """Return the library. Raises RuntimeError where there is no C compiler."""
    return compiled(folder, [HERE / "faulty.c"], "-shared", "-fPIC")


def each_call(verb: str, folder: Path, sample: int = 0, lasts: bool = False, until: float = float("inf")) -> Row:
    """Run an athcodec command once for each of its file operations, with the n-th operation failing in run n, and
    return the counts as a row. `sample` limits the runs to so many random ones (0: all), and `lasts` lets all later
    operations fail too.
    """
    row = Row(f"{verb}: call n fails{', and all after it' if lasts else ''}", 0)
    library = build(folder)
    asked = {"verb": verb, "folder": str(folder), "sample": sample, "lasts": lasts, "seconds": until - time.monotonic()}
    done = ended(
        [sys.executable, "-m", "spec.robust._io_errors", json.dumps(asked, default=str)],
        env=os.environ | {"LD_PRELOAD": str(library), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        cwd=HERE.parent.parent,
    )
    if done.returncode:
        raise RuntimeError(done.stderr[-3000:])
    results = [json.loads(line) for line in done.stdout.splitlines()]
    for result in results:
        row.tried += 1
        row.crashes += result["kind"] == "crash"
        row.wrong += result["kind"] == "wrong"
    faults = [result for result in results if result["kind"]]
    row.note = f"of {max((result['calls'] for result in results), default=0)} calls"
    row.note += f"; {faults[0]}" if faults else ""
    return row


def each_call_of_batch(folder: Path, numbers: list[int], until: float = float("inf")) -> Row:
    """Run a batch of one clip for each n of `numbers`, with the n-th file operation failing in the main process and in
    each worker. The next run, without faults, must finish the batch and leave no other files. Return the counts as a
    row.
    """
    row = Row("batch: call n fails", 0, note="in the run and in its worker")
    library, place = build(folder), Place.make(folder)
    words = ["batch", str(place.source), "--out", str(place.folder), "--workers", "1", "--effort", "fast"]
    command, target = [sys.executable, "-m", "athcodec", *words], place.folder / "source.ath"
    for n in numbers:
        if time.monotonic() > until:
            break
        faulty = {"LD_PRELOAD": str(library), "FAULTY_FOLDER": str(folder), "FAULTY_CALL": str(n)}
        done = ended(command, env=os.environ | faulty)
        again = ended(command)
        left = {path.name for path in place.folder.iterdir()} - {target.name, "athcodec-batch.jsonl"}
        row.tried += 1
        row.crashes += done.returncode not in (0, 1)
        fine = "Traceback" not in done.stderr and again.returncode == 0 and is_whole(target) and not left
        row.wrong += not fine
        if not fine:
            row.note += f"; {n}: {done.stderr[-300:]!r} {again.stderr[-300:]!r} {sorted(left)}"
        for path in place.folder.iterdir():
            path.unlink()
    return row


def _runs(verb: str, place: Place, sample: int, lasts: bool, deadline: float) -> Iterator[dict]:
    """Yield the result of a child process for each file operation that can fail; these are counted by a first run
    without faults.
    """
    calls = _run(verb, place, 0, lasts)["calls"]
    numbers = list(range(1, calls + 1))
    if sample:
        numbers = sorted(random.Random(verb).sample(numbers, min(sample, calls)))
    for n in numbers:
        if time.monotonic() > deadline:
            return
        yield {"n": n, "calls": calls} | _run(verb, place, n, lasts)


def _run(verb: str, place: Place, n: int, lasts: bool) -> dict:
    """Run a command in a child process whose `n`-th file operation fails (0: none). Return what happened: "kind" is ""
    if all is well, "crash" or "wrong", "kept" tells whether an older file is unchanged, and "left" names files that
    remain.
    """
    target = place.folder / VERBS[verb]
    target.write_bytes(OLDER[target.suffix])
    ends, start = os.pipe()
    child = os.fork()
    if child == 0:
        _in_child(start, place, verb, target, n, lasts)
    os.close(start)
    with os.fdopen(ends, "rb") as pipe:
        answer = pipe.read()
    _, status = os.waitpid(child, 0)
    if not answer:
        return {"kind": "crash", "note": f"ended by {status}"}
    result = json.loads(answer)
    kept = target.read_bytes() == OLDER[target.suffix]
    refused = result["code"] == 1 and ONE_LINE.fullmatch(result["err"]) and str(place.source.parent) in result["err"]
    fine = (refused or result["code"] == 0 and not kept) and (kept or is_whole(target))
    _next_run(place, target)
    left = place.left_over(target)
    for name in left:
        (place.folder / name).unlink()
    return result | {"kind": "" if fine and not left else "wrong", "left": left, "kept": kept}


def _in_child(start: int, place: Place, verb: str, target: Path, n: int, lasts: bool) -> None:
    """Run a command in the forked child process with its `n`-th file operation failing, write the exit code and
    messages as JSON to the pipe `start`, and end the process.
    """
    code, err = DEAD, io.StringIO()
    try:
        from athcodec import cli

        with redirect_stdout(io.StringIO()), redirect_stderr(err):
            library = ctypes.CDLL(None)
            library.faulty_arm(os.fsencode(place.source.parent), ctypes.c_long(n), ERRORS[n % 2], int(lasts))
            try:
                code = cli.main(place.words(verb, target))
            except SystemExit as end:
                code = end.code
            finally:
                calls, fired = library.faulty_calls(), library.faulty_fired()
                library.faulty_arm(b"", ctypes.c_long(0), 0, 0)
        answer = {"code": code, "calls": calls, "fired": bool(fired), "err": err.getvalue()}
        os.write(start, json.dumps(answer).encode())
    finally:
        os._exit(0)


def _next_run(place: Place, target: Path) -> None:
    """Write to the same place, as the next writer does; to be fast, little."""
    from athcodec.files.atomic import new_file

    with new_file(target) as file:
        file.write(OLDER[target.suffix])


def rows(budget: float) -> list[Row]:
    """Test all file operations of all commands for about `budget` seconds, and return the counts as rows."""
    start, outcomes = time.monotonic(), []
    for number, (verb, lasts) in enumerate((verb, lasts) for verb in VERBS for lasts in (False, True)):
        with tempfile.TemporaryDirectory() as folder:
            until = start + 0.7 * budget * (number + 1) / (2 * len(VERBS))
            outcomes.append(each_call(verb, Path(folder).resolve(), lasts=lasts, until=until))
    with tempfile.TemporaryDirectory() as folder:
        outcomes.append(each_call_of_batch(Path(folder).resolve(), list(range(1, 100, 3)), start + budget))
    return outcomes


def main() -> None:
    """Run the tests that the first argument asks for, as JSON, in a process with the library that makes operations
    fail, and print each result as a line of JSON.
    """
    asked = json.loads(sys.argv[1])
    import athcodec.cli.verbs  # noqa: F401 - what all runs need
    import athcodec.encoding  # noqa: F401
    import athcodec.exporters.hdf5  # noqa: F401
    import athcodec.exporters.npz  # noqa: F401

    place = Place.make(Path(asked["folder"]))
    deadline = time.monotonic() + float(asked["seconds"])
    for result in _runs(asked["verb"], place, asked["sample"], asked["lasts"], deadline):
        print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main()
