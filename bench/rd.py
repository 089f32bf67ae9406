"""Rate and distortion of athcodec, baselines and programs: every codec, at every bound, on every clip.

Each codec makes the smallest file it can within the bound; one process encodes, another decodes the bytes and
measures (rd_worker.py). A codec that is missing, exceeds the bound, crashes or takes too long gets a row
that says so. With --json, and of suites whose results are kept in bench/results, results are saved as they are
measured: a run that was stopped resumes there, and a result of the same clip, code and versions is not measured again.
`python -m bench report` puts the tables of these files into docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import athcodec
from bench import compare, data
from bench.clips import files_of
from bench.codec_registry import OURS, all_codecs, chosen, fingerprint, is_lossless
from bench.codecs import Codec, simple
from bench.codecs.ours import Athcodec
from bench.compare import MISSING, OK, SLOW
from bench.data import digest
from bench.store import Store
from bench.suite import SUITES, Case, cases
from bench.tables import cpu_model, environment, table

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "bench" / "results"
BOUNDS = {
    "full": (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6),
    "odd": (1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
    "odd-quick": (1e-3, 1e-5),
}  # Other suites are measured at compare.BOUNDS.
CODECS = {"odd-quick": (Athcodec.name, simple.NAME)}  # Other suites run all codecs.
KEPT = ("foreign", "held-out", "odd-quick")  # Suites whose results are kept in bench/results.
IN_SHORT = (*KEPT, "odd")  # Suites that are printed as one table.
OUR_SECONDS, SECONDS = 600, 120  # Processor time of one encoding or decoding by athcodec and by others.
WALL_FACTOR = 60  # Seconds that may pass per second of processor time, before a process is taken to hang.
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}  # Threads of NumPy's algebra that wait would count as processor time.
KEYS = {"clips": ("clip",), "points": ("clip", "codec", "bound")}
BROKEN, FAILED, CANNOT = "bound broken", "failed", "cannot keep the bound"

POINTS_NOTE = """
Bound: largest distance of any vertex in any frame, over the diagonal of the bounding box of all frames; each
codec tuned itself for the fewest bytes within it, everything that decoding needs counted. Bits: per vertex
and frame. Max and RMS over the diagonal and KG in per cent, measured on what another process decoded from the bytes.
Encode: seconds with all tuning, and processor seconds of all its threads. MB (1,000,000 bytes): peak memory of the
whole process, Python and imports included; when encoding with the clip in memory.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bench rd` to a parser: clips or a suite, error bounds, codecs, the time limit, and which
    results are listed or measured again.
    """
    parser.add_argument(
        "clips",
        nargs="*",
        metavar="CLIP",
        default=[],
        help="files, or names of clips of this benchmark; by default the suite's",
    )
    parser.add_argument(
        "--suite",
        choices=SUITES,
        default="quick",
        help="suite whose clips and bounds are measured if none are named (default %(default)s)",
    )
    parser.add_argument(
        "--bounds", type=float, nargs="+", metavar="FRACTION", help="error bounds over the bounding box's diagonal"
    )
    parser.add_argument(
        "--codecs",
        nargs="+",
        metavar="NAME",
        default=[],
        help="codecs to measure (default: all), or MODULE:NAME for one of your own",
    )
    parser.add_argument(
        "--lossless", action="store_true", help="measure lossless modes of the programs too, once per clip"
    )
    parser.add_argument(
        "--timeout",
        type=float,
        default=SECONDS,
        metavar="SECONDS",
        help=f"processor time of others for a file (default %(default)s; athcodec has {OUR_SECONDS})",
    )
    parser.add_argument("--again", action="store_true", help="repeat measurements that failed or were too slow")
    parser.add_argument("--list", action="store_true", help="list codecs and clips, and measure nothing")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Measure every chosen codec at every bound on every clip, as far as results are not stored yet. Return the tables
    of the stored results.
    """
    file, args.json = args.json, None  # written by the store; a listing is no result
    if args.list:
        return _listing(args)
    if file is None and args.suite in KEPT and not args.clips:
        file = RESULTS / f"{args.suite}.json"
    store = Store(file, environment(args.argv), KEYS)
    codecs, bounds = _codecs(args), tuple(args.bounds or BOUNDS.get(args.suite, compare.BOUNDS))
    clips = cases(args.clips, args.suite)
    for case in clips:
        about = _about(store, case)
        if case.path is None:
            continue
        for name, codec in codecs.items():
            seconds = OUR_SECONDS if codec.kind == OURS else args.timeout
            for bound in _bounds_of(codec, bounds, bool(args.codecs)):
                _point(_Job(case, name, codec, bound, about["digest"], seconds), store, args.again)
    return summary(store.contents(), [case.name for case in clips], bounds, args.suite in IN_SHORT)


def _bounds_of(codec: Codec, bounds: tuple[float, ...], is_named: bool) -> Collection[float]:
    if is_lossless(codec):
        return (0.0,)
    some = getattr(codec, "bounds", None)
    return bounds if some is None or is_named else [bound for bound in bounds if bound in some]


def _codecs(args: argparse.Namespace) -> dict[str, Codec]:
    codecs = chosen(args.codecs or CODECS.get(args.suite, ()))
    return codecs | ({codec.name: codec for codec in all_codecs() if is_lossless(codec)} if args.lossless else {})


def _listing(args: argparse.Namespace) -> dict[str, Any]:
    codecs = [{"codec": codec.name, "kind": codec.kind, "can run": codec.missing() or "yes"} for codec in all_codecs()]
    clips = [{"clip": name, "what": data.describe(name)} for name in data.SUITES[args.suite]]
    return {"tables": [table("Codecs", codecs), table(f"Clips, suite {args.suite}", clips)], "broken": []}


def _about(store: Store, case: Case) -> dict[str, Any]:
    """Store and return facts about a clip: its name and origin, its numbers of frames, vertices and branches, the bytes
    of its source, and a digest of its content.
    """
    program, colon, _ = case.description.partition(": ")
    row = {"clip": case.name, "what": case.description} | ({"program": program} if colon else {})
    if case.path is None:
        return store.find("clips", row) or store.add("clips", row)
    with athcodec.read(case.path) as clip:
        row |= {
            "frames": clip.frame_count,
            "vertices": clip.vertex_count,
            "branches": clip.branch_count,
            "source_bytes": sum(file.stat().st_size for file in files_of(case.path)),
            "digest": digest(case.path),
        }
    return store.add("clips", row)


# ---- points ----


@dataclass(frozen=True)
class _Job:
    """One codec at one bound on one clip; `name` identifies the codec in another process."""

    case: Case
    name: str
    codec: Codec
    bound: float
    digest: str
    seconds: float

    @property
    def identity(self) -> dict[str, Any]:
        return {"clip": self.case.name, "codec": self.codec.name, "kind": self.codec.kind, "bound": self.bound}

    @property
    def depends(self) -> dict[str, str]:
        return {"clip": self.digest} | fingerprint(self.codec)


def _point(job: _Job, store: Store, again: bool) -> None:
    """Measure one codec at one bound on one clip and store the result, unless a usable one is stored. `again` repeats
    measurements that have failed.
    """
    known = store.find("points", job.identity, job.depends)
    if known is not None and known["status"] != MISSING and (known["status"] == OK or not again):
        return
    why = job.codec.missing()
    if why and _was_measured(job, store):
        return
    result = {"status": MISSING, "why": why} if why else _measure(job)
    _print_progress(job, result)
    store.add("points", job.identity | result | {"limit_s": job.seconds, "cpu": cpu_model(), "depends": job.depends})


def _was_measured(job: _Job, store: Store) -> bool:
    """Return whether there is a result of this clip, from another machine or time at which the codec could run."""
    known = store.find("points", job.identity)
    return known is not None and known["status"] == OK and known["depends"]["clip"] == job.digest


def _measure(job: _Job) -> dict[str, Any]:
    """Encode and decode in processes of their own and return the figures, with a "status" that tells success from each
    kind of failure, and "why" it failed.
    """
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for step in ("encode", "decode"):
            words = (step, job.name, job.case.path.resolve(), repr(job.bound), Path(folder) / "data", job.seconds)
            try:
                figures |= _process(map(str, words), job.seconds * WALL_FACTOR)
            except (subprocess.TimeoutExpired, _TooSlow):
                return figures | {"status": SLOW, "why": f"{step}: longer than {job.seconds:g} s"}
            except _Failed as error:
                return figures | {"status": FAILED, "why": f"{step}: {error}"}
            if "cannot" in figures:
                return {"status": CANNOT, "why": figures["cannot"]}
    why = figures.pop("broken", None)
    return figures | ({"status": BROKEN, "why": why} if why else {"status": OK})


class _Failed(Exception):
    """A process of rd_worker.py ended without a result."""


class _TooSlow(Exception):
    """The system ended a process that had used up its processor time."""


def _process(words: Iterable[str], timeout: float) -> dict[str, Any]:
    """Run a worker process with some words of a command line, and return the figures that it prints as JSON. Raise
    TimeoutExpired, _TooSlow or _Failed if it takes more than `timeout` seconds or its limit of processor time, or ends
    with an error.
    """
    command = [sys.executable, "-m", "bench.rd_worker", *words]
    options = {"cwd": ROOT, "env": os.environ | ONE_THREAD, "text": True, "start_new_session": True}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options) as process:
        try:
            out, errors = process.communicate(timeout=timeout)
        except BaseException:  # ends programs that the codec has started too
            os.killpg(process.pid, signal.SIGKILL)
            raise
    if process.returncode == -signal.SIGXCPU:
        raise _TooSlow
    if process.returncode < 0:
        raise _Failed(f"ended by signal {-process.returncode}")
    if process.returncode:
        raise _Failed((errors.strip().splitlines() or [f"exit code {process.returncode}"])[-1])
    if not out.strip():
        raise _Failed("got no result; expected a line of JSON")
    return json.loads(out.splitlines()[-1])


def _print_progress(job: _Job, result: dict[str, Any]) -> None:
    end = f"{result['bytes']:,} bytes" if result["status"] == OK else f"{result['status']}: {result['why']}"
    print(f"{job.case.name}, {job.codec.name}, {job.bound:g}: {end}", file=sys.stderr, flush=True)


# ---- tables ----


def summary(
    contents: dict[str, list[dict[str, Any]]], names: list[str], bounds: Collection[float], in_short: bool = False
) -> dict[str, Any]:
    """Return tables and broken promises for the clips `names` and the error bounds `bounds`. With `in_short` there are
    only the table of all clips and the list of results without a file, else a table for each clip as well.
    """
    clips = [row for row in contents["clips"] if row["clip"] in names]
    points = [point for point in contents["points"] if point["clip"] in names and point["bound"] in (0, *bounds)]
    note = compare.losses(clips, points, bounds)
    tables = [
        table("Beside other codecs", compare.rows(clips, points, bounds), note, compare.CAPTION, *_absent(points))
    ]
    if in_short:
        without = [point for point in points if point["status"] not in compare.DONE]
        columns = ("clip", "codec", "bound", "status", "why")
        rows = [{name: point[name] for name in columns} for point in without]
        return {"tables": tables + ([table("Without a file", rows)] if rows else []), "broken": list(_broken(points))}
    for name in names:
        points_of_clip = [point for point in points if point["clip"] == name]
        if points_of_clip:
            tables.append(
                table(title(name), [_row(point) for point in points_of_clip], POINTS_NOTE, _processors(points_of_clip))
            )
    return {"tables": tables, "broken": list(_broken(points))}


def title(clip: str) -> str:
    """Return title of the table of a clip's points."""
    return f"Rate and distortion: {clip}"


def _row(point: dict[str, Any]) -> dict[str, Any]:
    """Return the table's row of one stored result: bytes, errors, seconds and megabytes of encoding and decoding, and
    the codec's settings or the reason of a failure.
    """
    megabytes = {name: point[name] / 1e6 for name in ("encode_peak_bytes", "decode_peak_bytes") if name in point}
    settings = point["settings"] if point["status"] == OK else f"{point['status'].upper()}: {point['why']}"
    return {
        "codec": point["codec"],
        "bound": f"{point['bound']:g}",
        "bytes": point.get("bytes"),
        "bits": point.get("bits"),
        "max": point.get("max"),
        "RMS": point.get("rms"),
        "KG %": point.get("kg"),
        "encode s": point.get("encode_s"),
        "encode CPU s": point.get("encode_cpu_s"),
        "decode s": point.get("decode_s"),
        "encode MB": megabytes.get("encode_peak_bytes"),
        "decode MB": megabytes.get("decode_peak_bytes"),
        "settings": settings.replace("|", "/"),
    }


def _processors(points: list[dict[str, Any]]) -> str:
    names = dict.fromkeys(point["cpu"] for point in points)
    return f"Processor: {'; '.join(names)}."


def _absent(points: list[dict[str, Any]]) -> list[str]:
    """Return a note on the codecs without any measured point."""
    present = {point["codec"] for point in compare.measured(points)}
    absent = {point["codec"]: point["status"] for point in points if point["codec"] not in present}
    names = ", ".join(f"{name} ({why})" for name, why in absent.items())
    return [f"Not measured: {names}."] if absent else []


def _broken(points: list[dict[str, Any]]) -> Iterator[str]:
    """Yield faults of athcodec and the baselines; those of programs are only rows."""
    for point in points:
        if point["status"] in (BROKEN, FAILED) and point["kind"] != "program":
            yield (f"{point['clip']}, {point['codec']} at {point['bound']:g}: {point['status']}: {point['why']}")
