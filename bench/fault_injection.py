"""A batch under fault injection: a truncated clip, a worker killed, the run itself killed; the files that result.

The same command runs four times. In the first run a worker is killed (SIGKILL) when a quarter of the clips are done,
and the command itself when half of them are; the second run resumes; before the third the truncated clip is restored;
the fourth has nothing to do. At the end every file must exist once, match its checksum in the manifest, decode at every
level, and be identical to the one that `athcodec.encode` writes.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import athcodec
from athcodec.batch.inputs import sha256
from athcodec.batch.runs import MANIFEST
from bench.batch import add_windows, encode_in_loop, make_clips
from bench.tables import table

WORKERS = 2
TRUNCATED_BYTES = 3000  # length of the truncated clip
RUN_TIMEOUT = 600  # seconds

NOTE = """
{clips} clips, each {frames} frames of {vertices:,} vertices, bound {bound:g}, effort {effort}, {workers} workers.
Lines: added to the manifest by the run; new: clips encoded for the first time; again: clips that an earlier run had
encoded already; parts: part files after the run. Done, kept and failed are the command's own counts; a killed command
reports none.
"""
END_NOTE = """
Once: files that the manifest lists as done exactly once, with the right checksum; verified: opened strictly, all
checksums checked, every level decoded; identical: the same bytes as from athcodec.encode alone.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_windows(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name:
        batch = _FaultyBatch(args, Path(name))
        rows = list(batch.runs())
        final, broken = batch.check_files()
    done = [row["new"] for row in rows]
    if sum(done) != args.clips or any(row["again"] for row in rows) or done[2:] != [1, 0]:
        broken.append(
            f"new clips of the runs: got {done}, again {[row['again'] for row in rows]}; expected every clip "
            "once, one of them in the third run"
        )
    facts = {
        "clips": args.clips,
        "frames": args.frames,
        "vertices": batch.vertices,
        "bound": args.rel_error,
        "effort": args.effort,
        "workers": WORKERS,
    }
    return {
        "tables": [
            table("A batch under fault injection", rows, NOTE.format(**facts)),
            table("Files at the end", [final], END_NOTE),
        ],
        "broken": broken,
    }


class _FaultyBatch:
    """A folder with clips and outputs, and the batch command that is run on it repeatedly."""

    def __init__(self, args: argparse.Namespace, folder: Path) -> None:
        self.args, self.folder, self.source, self.out = args, folder, folder / "in", folder / "out"
        self.vertices = make_clips(args, self.source)
        self.truncated = sorted(self.source.iterdir())[args.clips // 2]
        self._lines_before = self._lines()

    def runs(self) -> Iterator[dict[str, Any]]:
        intact = self.truncated.read_bytes()
        self.truncated.write_bytes(intact[:TRUNCATED_BYTES])
        yield self._row("a worker killed, then the command", *self._killed())
        yield self._row("resumed", *self._finished())
        self.truncated.write_bytes(intact)
        yield self._row("resumed, the truncated clip restored", *self._finished())
        yield self._row("resumed, nothing left to do", *self._finished())

    def _start(self) -> subprocess.Popen:
        words = [
            str(self.source),
            "--out",
            str(self.out),
            "--rel-error",
            str(self.args.rel_error),
            "--effort",
            self.args.effort,
            "--workers",
            str(WORKERS),
            "--json",
        ]
        return subprocess.Popen(
            [sys.executable, "-m", "athcodec", "batch", *words],
            cwd=self.folder,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )

    def _killed(self) -> tuple[int, dict[str, Any]]:
        import psutil  # comes with dask.distributed

        process = self._start()
        self._wait(process, self.args.clips // 4)
        workers = [
            child for child in psutil.Process(process.pid).children() if "spawn_main" in " ".join(child.cmdline())
        ]
        workers[0].kill()
        self._wait(process, self.args.clips // 2)
        workers += psutil.Process(process.pid).children()
        process.kill()
        process.communicate()
        psutil.wait_procs(workers, timeout=30)  # they exit when the command is gone
        return process.returncode, {}

    def _finished(self) -> tuple[int, dict[str, Any]]:
        process = self._start()
        report = json.loads(process.communicate(timeout=RUN_TIMEOUT)[0])
        return process.returncode, report | {"failed": len(report["failed"])}

    def _wait(self, process: subprocess.Popen, lines: int) -> None:
        while len(self._lines()) < lines:
            if process.poll() is not None:
                raise SystemExit(f"fault-injection: the run ended early, with exit code {process.returncode}")
            time.sleep(0.02)

    def _lines(self) -> list[dict[str, Any]]:
        """Complete lines of the manifest."""
        path = self.out / MANIFEST
        complete = path.read_bytes().rpartition(b"\n")[0] if path.exists() else b""
        return [json.loads(line) for line in complete.splitlines()]

    def _row(self, run: str, code: int, report: dict[str, Any]) -> dict[str, Any]:
        lines, done_before = self._lines(), self._done(self._lines_before)
        added = self._done(lines[len(self._lines_before) :])
        row = {
            "run": run,
            "exit code": code,
            "lines": len(lines) - len(self._lines_before),
            "new": len(added - done_before),
            "again": len(added & done_before),
        }
        self._lines_before = lines
        return row | {name: report.get(name) for name in ("done", "kept", "failed")} | {"parts": len(self._parts())}

    def _done(self, lines: list[dict[str, Any]]) -> set[str]:
        return {line["output"] for line in lines if line["status"] == "done"}

    def _parts(self) -> list[Path]:
        return [path for path in self.out.rglob("*") if path.name.endswith(".part")]

    def check_files(self) -> tuple[dict[str, Any], list[str]]:
        """A row on the final files, and a line for each fault."""
        alone = self.folder / "alone"
        encode_in_loop(self.source, alone, {"rel_error": self.args.rel_error, "effort": self.args.effort})
        done = [line for line in self._lines() if line["status"] == "done"]
        counts, checksums = Counter(line["output"] for line in done), {line["output"]: line["sha256"] for line in done}
        files = sorted(self.out.glob("*.ath"))
        checks = {
            "once": lambda path: counts[path.name] == 1 and checksums[path.name] == sha256(path),
            "verified": _is_intact,
            "identical": lambda path: path.read_bytes() == (alone / path.name).read_bytes(),
        }
        faults = {check: [path.name for path in files if not passes(path)] for check, passes in checks.items()}
        row = {"clips": self.args.clips, "files": len(files)} | {
            check: len(files) - len(names) for check, names in faults.items()
        }
        broken = [f"{name}: not {check}" for check, names in faults.items() for name in names]
        if len(files) != self.args.clips:
            broken.append(f"files: got {len(files)}; expected {self.args.clips}")
        return row | {"parts": len(self._parts())}, broken


def _is_intact(path: Path) -> bool:
    try:
        with athcodec.open(path, strict=True) as decoder:
            decoder.file.check()
    except athcodec.errors.AthError:
        return False
    return True
