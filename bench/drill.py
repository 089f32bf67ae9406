"""A batch that everything happens to: a broken clip, a worker killed, the run itself killed; what is there in the end.

The same command four times over. In the first run a worker is killed (SIGKILL) when a quarter of the clips are done,
and the command itself when half of them are; the second goes on where that ended; before the third the broken clip is
repaired; the fourth finds nothing to do. In the end every file has to be there once, as its line in the manifest says,
with every level decoding, and be the one that `athcodec.encode` writes.
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
from athcodec.encoding import EFFORTS
from bench.batch import COUNT, FRAMES, encode_in_loop, make_clips
from bench.clips import add_rel_error
from bench.tables import table

WORKERS = 2
BROKEN_BYTES = 3000  # that are left of the broken clip
PATIENCE = 600  # seconds for a run

NOTE = """
{clips} clips, each {frames} frames of {vertices:,} vertices, bound {bound:g}, effort {effort}, {workers} workers.
Lines: in the manifest that the run added; new: clips that it did, which no run before had; again: clips that were done
before; left: part files when it had ended. The command's own counts are done, kept and failed; a killed one says none.
"""
END_NOTE = """
Once: files with one line in the manifest that they are done, and its checksum; verified: strict opening, all checksums,
every level decoded; same: bytes as of athcodec.encode alone.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--clips", type=int, default=COUNT, metavar="N", help="how many (default %(default)s)")
    parser.add_argument("--frames", type=int, default=FRAMES, metavar="N", help="of each (default %(default)s)")
    parser.add_argument("--of", type=Path, default=athcodec.sample_path(), metavar="CLIP.h5",
                        help="what they are windows of (default: the sample)")
    parser.add_argument("--effort", choices=EFFORTS, default="default", help="(default %(default)s)")
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name:
        drill = _Drill(args, Path(name))
        rows = list(drill.runs())
        end, broken = drill.end()
    done = [row["new"] for row in rows]
    if sum(done) != args.clips or any(row["again"] for row in rows) or done[2:] != [1, 0]:
        broken.append(f"new clips of the runs: got {done}, again {[row['again'] for row in rows]}; expected every clip "
                      "once, one of them in the third run")
    facts = {"clips": args.clips, "frames": args.frames, "vertices": drill.vertices, "bound": args.rel_error,
             "effort": args.effort, "workers": WORKERS}
    return {"tables": [table("A batch that everything happens to", rows, NOTE.format(**facts)),
                       table("What is there in the end", [end], END_NOTE)], "broken": broken}


class _Drill:
    """The folder with clips and outputs, and the command that is given again and again."""

    def __init__(self, args: argparse.Namespace, folder: Path) -> None:
        self.args, self.folder, self.source, self.out = args, folder, folder / "in", folder / "out"
        self.vertices = make_clips(args, self.source)
        self.broken = sorted(self.source.iterdir())[args.clips // 2]
        self._before = self._lines()

    def runs(self) -> Iterator[dict[str, Any]]:
        whole = self.broken.read_bytes()
        self.broken.write_bytes(whole[:BROKEN_BYTES])
        yield self._row("a worker killed, then the command", *self._killed())
        yield self._row("again", *self._finished())
        self.broken.write_bytes(whole)
        yield self._row("again, the broken clip repaired", *self._finished())
        yield self._row("again", *self._finished())

    def _start(self) -> subprocess.Popen:
        words = [str(self.source), "--out", str(self.out), "--rel-error", str(self.args.rel_error),
                 "--effort", self.args.effort, "--workers", str(WORKERS), "--json"]
        return subprocess.Popen([sys.executable, "-m", "athcodec", "batch", *words], cwd=self.folder, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def _killed(self) -> tuple[int, dict[str, Any]]:
        import psutil  # comes with dask.distributed

        process = self._start()
        self._wait(process, self.args.clips // 4)
        workers = [each for each in psutil.Process(process.pid).children() if "spawn_main" in " ".join(each.cmdline())]
        workers[0].kill()
        self._wait(process, self.args.clips // 2)
        workers += psutil.Process(process.pid).children()
        process.kill()
        process.communicate()
        psutil.wait_procs(workers, timeout=30)  # which notice by themselves
        return process.returncode, {}

    def _finished(self) -> tuple[int, dict[str, Any]]:
        process = self._start()
        said = json.loads(process.communicate(timeout=PATIENCE)[0])
        return process.returncode, said | {"failed": len(said["failed"])}

    def _wait(self, process: subprocess.Popen, lines: int) -> None:
        while len(self._lines()) < lines:
            if process.poll() is not None:
                raise SystemExit(f"drill: the run ended with exit code {process.returncode}; expected it to go on")
            time.sleep(0.02)

    def _lines(self) -> list[dict[str, Any]]:
        """Those of the manifest that are whole."""
        path = self.out / MANIFEST
        whole = path.read_bytes().rpartition(b"\n")[0] if path.exists() else b""
        return [json.loads(line) for line in whole.splitlines()]

    def _row(self, what: str, code: int, said: dict[str, Any]) -> dict[str, Any]:
        lines, before = self._lines(), self._done(self._before)
        added = self._done(lines[len(self._before):])
        row = {"run": what, "exit code": code, "lines": len(lines) - len(self._before),
               "new": len(added - before), "again": len(added & before)}
        self._before = lines
        return row | {name: said.get(name) for name in ("done", "kept", "failed")} | {"left": len(self._parts())}

    def _done(self, lines: list[dict[str, Any]]) -> set[str]:
        return {line["output"] for line in lines if line["status"] == "done"}

    def _parts(self) -> list[Path]:
        return [path for path in self.out.rglob("*") if path.name.endswith(".part")]

    def end(self) -> tuple[dict[str, Any], list[str]]:
        """What is there, and what is wrong with it."""
        alone = self.folder / "alone"
        encode_in_loop(self.source, alone, {"rel_error": self.args.rel_error, "effort": self.args.effort})
        done = [line for line in self._lines() if line["status"] == "done"]
        counts, sums = Counter(line["output"] for line in done), {line["output"]: line["sha256"] for line in done}
        files = sorted(self.out.glob("*.ath"))
        checks = {"once": lambda path: counts[path.name] == 1 and sums[path.name] == sha256(path),
                  "verified": _is_whole,
                  "same": lambda path: path.read_bytes() == (alone / path.name).read_bytes()}
        faults = {what: [path.name for path in files if not good(path)] for what, good in checks.items()}
        row = {"clips": self.args.clips, "files": len(files)} | {
            what: len(files) - len(names) for what, names in faults.items()}
        broken = [f"{name}: not {what}" for what, names in faults.items() for name in names]
        if len(files) != self.args.clips:
            broken.append(f"files: got {len(files)}; expected {self.args.clips}")
        return row | {"parts left": len(self._parts())}, broken


def _is_whole(path: Path) -> bool:
    try:
        with athcodec.open(path, strict=True) as decoder:
            decoder.file.check()
    except athcodec.errors.AthError:
        return False
    return True
