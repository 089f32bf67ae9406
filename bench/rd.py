"""Rate and distortion of athcodec, baselines and programs: every codec, at every bound, on every clip.

Each codec makes the smallest file it can within the bound; one process encodes, another decodes the bytes and
measures (rd_worker.py). A codec that is missing, exceeds the bound, crashes or takes too long gets a row
that says so. With --json results are saved as they are measured: a run that was stopped resumes there, and a result of
the same clip, code and versions is not measured again. The tables add mean savings and
ratios (compare.py).
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import athcodec
from bench import compare, data, odd
from bench.codec_registry import all_codecs, chosen, fingerprint, is_lossless
from bench.codecs import Codec, simple
from bench.data import digest
from bench.store import Store
from bench.suite import SUITES, Case, cases
from bench.tables import cpu_model, environment, table

ROOT = Path(__file__).resolve().parent.parent
BOUNDS = {
    "quick": (1e-3, 1e-4, 1e-5),
    "full": (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6),
    "odd": (1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
    "odd-quick": (1e-3, 1e-5),
}
ODD_CODECS = ("athcodec", simple.NAME, "SZ3", "global PCA", "clustered PCA (Sattler)", "moving frames + PCA (Lengyel)")
CODECS = {"odd": ODD_CODECS, "odd-quick": ODD_CODECS[:2]}  # Other suites run all codecs.
TIMEOUTS = {"quick": 3600, "full": 3600, "odd": 300, "odd-quick": 300}
KEYS = {"clips": ("clip",), "points": ("clip", "codec", "bound")}
OK, MISSING, BROKEN, FAILED, SLOW = "ok", "missing", "bound broken", "failed", "too slow"
CANNOT = "cannot keep the bound"
ABOUT = ("frames", "fps", "vertices", "branches")

POINTS_NOTE = """
Bound: largest distance of any vertex in any frame, over the diagonal of the bounding box of all frames; each
codec tuned itself for the fewest bytes within it, everything that decoding needs counted. Bits: per vertex
and frame. Max and RMS over the diagonal, KG in per cent, motion: RMS error over the RMS distance from the
rest pose, all measured on what another process decoded from the bytes. d2: second difference over frames of
the error, in bounds, of the worst vertex and frame and RMS; stretch: how much longer or shorter edges are
than in the source; normals: the angle by which faces are turned, degrees; RMS and what one in a thousand exceeds.
Encode: seconds with all tuning, median of 3 runs, or a single run ('runs' 1) of a codec that takes more
than a second. Decode: median of 3 to 7 runs after one that does not count. MB (1,000,000 bytes): peak
memory of the whole process, Python and imports included; when encoding with the clip in memory.
"""

SAVINGS_NOTE = """
Mean saving of athcodec in bytes at the same error (Bjontegaard), over the errors that both codecs cover;
positive: athcodec is smaller.
"""

RATIOS_NOTE = """
Bytes of the best of them over athcodec's. At a bound: both at their smallest within that bound. At a
Karni-Gotsman error, that is at equal RMS: sizes interpolated (log-log) between the points above, which all
codecs tuned for the bound. PCA: every codec that stores a basis learned from the clip.
"""

ODD_NOTE = f"""
Bytes within the bound, over the diagonal of the bounding box. Within: ours takes at most
{compare.SIMPLE_SHARE:g} times the bytes of the simple codec and {compare.SIMPLE_BYTES} more. Best other: of all
codecs but ours.
"""

OVER_CLIPS_NOTE = "Ratios as above, over the clips that have them."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips",
        nargs="*",
        metavar="CLIP",
        default=[],
        help="files CLIP.h5, or names of clips of this benchmark; by default the suite's",
    )
    parser.add_argument(
        "--suite",
        choices=SUITES,
        default="quick",
        help="which clips and bounds, where none are named (default %(default)s)",
    )
    parser.add_argument(
        "--bounds", type=float, nargs="+", metavar="FRACTION", help="error bounds over the bounding box's diagonal"
    )
    parser.add_argument(
        "--codecs",
        nargs="+",
        metavar="NAME",
        default=[],
        help="codecs to measure (default: all, of odd clips some), or MODULE:NAME for one of your own",
    )
    parser.add_argument(
        "--lossless", action="store_true", help="measure lossless modes of the programs too, once per clip"
    )
    parser.add_argument(
        "--timeout",
        type=float,
        metavar="SECONDS",
        help="for one encoding or decoding (default: an hour, of odd clips five minutes)",
    )
    parser.add_argument("--again", action="store_true", help="repeat what failed or was too slow")
    parser.add_argument("--list", action="store_true", help="list codecs and clips, and measure nothing")


def run(args: argparse.Namespace) -> dict[str, Any]:
    file, args.json = args.json, None  # written by the store; a listing is no result
    if args.list:
        return _listing(args)
    store = Store(file, environment(args.argv), KEYS)
    codecs, bounds = _codecs(args), tuple(args.bounds or BOUNDS[args.suite])
    timeout = args.timeout or TIMEOUTS[args.suite]
    clips = cases(args.clips, args.suite)
    for case in clips:
        about = _about(store, case)
        if case.path is None:
            continue
        for name, codec in codecs.items():
            for bound in (0.0,) if is_lossless(codec) else bounds:
                _point(_Job(case, name, codec, bound, about["digest"], timeout), store, args.again)
    return summary(store.contents(), [case.name for case in clips], bounds, args.suite in CODECS)


def _codecs(args: argparse.Namespace) -> dict[str, Codec]:
    codecs = chosen(args.codecs or CODECS.get(args.suite, ()))
    return codecs | ({codec.name: codec for codec in all_codecs() if is_lossless(codec)} if args.lossless else {})


def _listing(args: argparse.Namespace) -> dict[str, Any]:
    codecs = [{"codec": codec.name, "kind": codec.kind, "can run": codec.missing() or "yes"} for codec in all_codecs()]
    clips = [{"clip": name, "what": data.describe(name)} for name in data.SUITES[args.suite]]
    return {"tables": [table("Codecs", codecs), table(f"Clips, suite {args.suite}", clips)], "broken": []}


def _about(store: Store, case: Case) -> dict[str, Any]:
    """Facts about a clip, with a digest of its content."""
    if case.path is None:
        return store.add("clips", {"clip": case.name, "what": case.description})
    with athcodec.read_hdf5(case.path) as clip:
        row = {
            "clip": case.name,
            "what": case.description,
            "frames": clip.frame_count,
            "fps": clip.fps,
            "vertices": clip.vertex_count,
            "branches": clip.branch_count,
            "bytes": 12 * clip.frame_count * clip.vertex_count,
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
    timeout: float

    @property
    def identity(self) -> dict[str, Any]:
        return {"clip": self.case.name, "codec": self.codec.name, "kind": self.codec.kind, "bound": self.bound}

    @property
    def depends(self) -> dict[str, str]:
        return {"clip": self.digest} | fingerprint(self.codec)


def _point(job: _Job, store: Store, again: bool) -> None:
    known = store.find("points", job.identity, job.depends)
    if known is not None and known["status"] != MISSING and (known["status"] == OK or not again):
        return
    why = job.codec.missing()
    if why and _was_measured(job, store):
        return
    result = {"status": MISSING, "why": why} if why else _measure(job)
    _print_progress(job, result)
    store.add("points", job.identity | result | {"cpu": cpu_model(), "depends": job.depends})


def _was_measured(job: _Job, store: Store) -> bool:
    """Whether there is a result of this clip, from another machine or time at which the codec could run."""
    known = store.find("points", job.identity)
    return known is not None and known["status"] == OK and known["depends"]["clip"] == job.digest


def _measure(job: _Job) -> dict[str, Any]:
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for step in ("encode", "decode"):
            words = (step, job.name, job.case.path.resolve(), repr(job.bound), Path(folder) / "data")
            try:
                figures |= _process(map(str, words), job.timeout)
            except subprocess.TimeoutExpired:
                return figures | {"status": SLOW, "why": f"{step}: longer than {job.timeout:g} s"}
            except _Failed as error:
                return figures | {"status": FAILED, "why": f"{step}: {error}"}
            if "cannot" in figures:
                return {"status": CANNOT, "why": figures["cannot"]}
    why = figures.pop("broken", None)
    return figures | ({"status": BROKEN, "why": why} if why else {"status": OK})


class _Failed(Exception):
    """A process of rd_worker.py ended without a result."""


def _process(words: Iterable[str], timeout: float) -> dict[str, Any]:
    command = [sys.executable, "-m", "bench.rd_worker", *words]
    with subprocess.Popen(
        command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    ) as process:
        try:
            out, errors = process.communicate(timeout=timeout)
        except BaseException:  # ends programs that the codec has started too
            os.killpg(process.pid, signal.SIGKILL)
            raise
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
    contents: dict[str, list[dict[str, Any]]], clips: list[str], bounds: tuple[float, ...] | None, as_odd: bool = False
) -> dict[str, Any]:
    """Tables of the results of these clips and bounds (None: all bounds); `as_odd`: one for all, beside the simple
    codec.
    """
    tables = [_clips_table([row for row in contents["clips"] if row["clip"] in clips])]
    points = [
        point
        for point in contents["points"]
        if point["clip"] in clips and (bounds is None or point["bound"] in (0, *bounds))
    ]
    if as_odd:
        return {"tables": [*tables, *_odd_tables(points)], "broken": list(_broken(points))}
    all_ratios: list[dict[str, Any]] = []
    for clip in clips:
        own = [point for point in points if point["clip"] == clip]
        if not own:
            continue
        tables.append(table(title(clip), [_row(point) for point in own], POINTS_NOTE, _processors(own)))
        for ours in compare.our_names(own):
            rows = compare.ratios(own, ours)
            all_ratios += [{"clip": clip, "codec": ours} | row for row in rows]
            tables.append(table(f"Mean saving: {clip}, {ours}", compare.savings(own, ours), SAVINGS_NOTE))
            tables.append(table(f"Ratios: {clip}, {ours}", rows, RATIOS_NOTE, *_absent(own)))
    if len(clips) > 1:
        tables.append(table("Ratios over all clips", compare.over_clips(all_ratios), OVER_CLIPS_NOTE))
    return {"tables": tables, "broken": list(_broken(points))}


def _odd_tables(points: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    plants = {name for name, recipe in odd.CLIPS.items() if recipe.plant}
    for ours in compare.our_names(points):
        rows = compare.against_simple(points, ours)
        yield table(f"Odd clips: {ours}", rows, ODD_NOTE, *_absent(points))
        yield table(f"Odd clips, in short: {ours}", compare.beaten(rows, plants))
    without = [point for point in points if point["status"] not in (OK, MISSING)]
    if without:
        columns = ("clip", "codec", "bound", "status", "why")
        yield table("Without a file", [{name: point[name] for name in columns} for point in without])


def title(clip: str) -> str:
    """Title of the table of a clip's points."""
    return f"Rate and distortion: {clip}"


def _clips_table(rows: list[dict[str, Any]]) -> dict[str, Any]:
    return table(
        "Clips",
        [
            {"clip": row["clip"]}
            | {name: row.get(name) for name in ABOUT}
            | {"float32 MB": row["bytes"] / 1e6 if "bytes" in row else None}
            | {"what": row["what"]}
            for row in rows
        ],
    )


def _row(point: dict[str, Any]) -> dict[str, Any]:
    row = {"codec": point["codec"], "bound": f"{point['bound']:g}"}
    if "bytes" in point:
        row |= {
            "bytes": point["bytes"],
            "encode s": point["encode_s"],
            "runs": point["encode_runs"],
            "encode MB": point["encode_peak_bytes"] / 1e6,
        }
    if "decode_s" in point:
        row |= {"decode s": point["decode_s"], "decode MB": point["decode_peak_bytes"] / 1e6, "bits": point["bits"]}
    if "max" in point:
        row |= {"max": point["max"], "RMS": point["rms"], "KG %": point["kg"], "motion": point["motion"]}
    row |= {column: point.get("looks", {}).get(name) for column, name in LOOKS.items()}
    settings = point["settings"] if point["status"] == OK else f"{point['status'].upper()}: {point['why']}"
    return _ordered(row | {"settings": settings.replace("|", "/")})


LOOKS = {
    "d2 max": "max_second_difference",
    "d2 RMS": "rms_second_difference",
    "stretch": "rms_stretch",
    "stretch 99.9 %": "tail_stretch",
    "normals": "rms_normal_angle",
    "normals 99.9 %": "tail_normal_angle",
}
COLUMNS = (
    "codec",
    "bound",
    "bytes",
    "bits",
    "max",
    "RMS",
    "KG %",
    "motion",
    *LOOKS,
    "encode s",
    "runs",
    "decode s",
    "encode MB",
    "decode MB",
    "settings",
)


def _ordered(row: dict[str, Any]) -> dict[str, Any]:
    return {name: row.get(name) for name in COLUMNS}


def _processors(points: list[dict[str, Any]]) -> str:
    names = dict.fromkeys(point["cpu"] for point in points)
    return f"Processor: {'; '.join(names)}."


def _absent(points: list[dict[str, Any]]) -> list[str]:
    """A note on the codecs without any measured point."""
    present = {point["codec"] for point in compare.measured(points)}
    absent = {point["codec"]: point["status"] for point in points if point["codec"] not in present}
    names = ", ".join(f"{name} ({why})" for name, why in absent.items())
    return [f"Not measured: {names}."] if absent else []


def _broken(points: list[dict[str, Any]]) -> Iterator[str]:
    """Faults of athcodec and the baselines; those of programs are only rows."""
    for point in points:
        if point["status"] in (BROKEN, FAILED) and point["kind"] != "program":
            yield (f"{point['clip']}, {point['codec']} at {point['bound']:g}: {point['status']}: {point['why']}")
