"""Time and memory of the decoder in C: whole files, levels, playing, seeking, many plants; compared with SZ3 and HDF5.

One thread, and two where Python decodes whole files. The decoder is timed by decode.c, compiled here with the core's
own sources and flags, so that no Python is in its loops. Runs of whole decoding alternate with SZ3 (pysz, where it is
installed) and h5py, so that conditions are the same for all. The decoder's frames are compared with those of
athcodec.open by their checksum.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

import h5py
import numpy as np

import athcodec
from athcodec._native import crc32c
from athcodec.decoding import segment_decoder
from athcodec.metrics import ErrorMeter
from bench.clips import add_ladder, add_number, add_rel_error, read
from bench.codecs.coder import CORE, compile_c
from bench.codecs.program import arrays_of, from_arrays
from bench.tables import table

try:
    import pysz
except ImportError:
    pysz = None

ROUNDS, SEEKS, INSTANCES = 9, 1000, 1000
THREADS = (1, 2)  # Threads of Python's positions().
TABLES = ("target", "whole", "levels", "onward", "memory", "instances")
GZIP_CHUNK = 1 << 20
SZ3_LAYOUTS = ("T,N,3", "N,T,3", "3,T,N", "3,N,T", "T,3N", "3N,T")
SZ3_ALGORITHMS = ("LORENZO_REG", "INTERP_LORENZO", "INTERP")

TARGET_NOTE = """
Targets: for tree_8k at a bound of 1e-4; printed for every clip. Whole decoding: every segment prepared at the
deepest level, entropy decoding included, and every frame written as float32 in the source's order; the file
is open. Playing with decoding: a segment's preparation divided by its frames, and the evaluation of a pose
between two frames. Prepared: the evaluation alone. Vertices: ath_positions, all of
them, in the file's order; matrices: ath_matrices and ath_exact, what a renderer needs. Bytes of level 1:
prelude and what ath_ranges names. Seek: a random frame, its segment prepared and the frame
written; the target is the mean cost of preparing one segment. Memory over positions: all memory
for playing (table Memory) over one segment's float32 positions.
"""

WHOLE_NOTE = """
Readers alternate, {rounds} rounds; ratio: the reader's median over athcodec's. Each writes into memory that it has
written before, but for Python's rows, whose memory is new. The second athcodec row includes opening the file and
building its bases, as the others do. Threads share segments: a clip of one segment takes one thread. SZ3 bounds
values, not distances: its bound is bound/sqrt(3), and a distance reaches the bound only where all three axes do.
It compresses positions or displacements from the rest pose (then without the rest pose, and without adding
it again), in {layouts} layouts with {algorithms} algorithms: the configuration with the smallest file, and the
fastest one. HDF5: float32 positions, gzip 4 with shuffle, chunks of whole frames, exact. Where an .ath file
was given, these two hold its decoded frames.
"""

LEVELS_NOTE = """
Prepare: all segments; write: all frames, source order, from prepared segments. Vertices, matrices:
microseconds for one picture between two frames, from prepared segments; playing: with its share of the
preparation. CRC-32C: of all frames, float32, source order. Bytes with the prelude.
"""

ONWARD_NOTE = """
From each level of all vertices to each that refines it, all segments, in ms. Keep: preparing the first, with what is
kept of it; onward: the second, from that; anew: the second, from the first layer; the three in turn, segment by
segment. Kept: bytes, of all segments; share: of the memory of the prepared segments of the first level.
"""

MEMORY_NOTE = """
Bytes. File: all of it in memory; opened: ath_open; bases: ath_build; work: one preparation; segments: prepared
ones. Nothing else is allocated. Over positions: their sum over the float32 positions of the longest
segment.
"""

INSTANCES_NOTE = """
Instances of the clip, each at its own time, for one second at 30 pictures a second: matrices
and exact vertices of each are written one after the other into a buffer of 64 MiB. Segments are
prepared before and shared. Even mix: levels in rotation.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips",
        nargs="*",
        type=Path,
        metavar="CLIP",
        default=[athcodec.sample_path()],
        help="motion clips, which are encoded first, or .ath files; by default the sample that ships with athcodec",
    )
    add_rel_error(parser)
    add_ladder(parser, "decades")
    add_number(parser, "--rounds", ROUNDS, "runs of everything")
    add_number(parser, "--seeks", SEEKS, "random frames")
    add_number(parser, "--instances", INSTANCES, "plants shown at once")


def run(args: argparse.Namespace) -> dict[str, Any]:
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in TABLES}
    broken = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = compile_program(folder)
        for path in args.clips:
            case = Case(path, folder, args.rel_error, program, args.ladder)
            whole = _whole(case, folder, args.rounds)
            figures = case.program("all", args.rounds, args.seeks, args.instances)
            rows = {
                "target": _target_rows(figures, whole),
                "whole": whole,
                "levels": level_rows(figures),
                "onward": onward_rows(figures),
                "memory": memory_rows(figures),
                "instances": _instance_rows(figures),
            }
            for key, added in rows.items():
                tables[key] += [{"clip": path.stem} | row for row in added]
            broken += case.broken(figures["levels"][-1]["crc"])
    setups = {"layouts": len(SZ3_LAYOUTS), "algorithms": len(SZ3_ALGORITHMS)}
    whole_note = WHOLE_NOTE.format(rounds=args.rounds, **setups)
    return {
        "tables": [
            table(f"Decoding, bound {args.rel_error:g}, beside the targets", tables["target"], TARGET_NOTE),
            table("Whole decoding, medians in ms", tables["whole"], whole_note),
            table("Levels, medians", tables["levels"], LEVELS_NOTE),
            table("Going on to a deeper level, medians", tables["onward"], ONWARD_NOTE),
            table("Memory", tables["memory"], MEMORY_NOTE),
            table("Instances", tables["instances"], INSTANCES_NOTE),
        ],
        "broken": broken,
    }


# ---- clips and the program ----


class Case:
    """A clip's float32 positions and its .ath file, with the program that times the decoder on it."""

    def __init__(self, path: Path, folder: Path, rel_error: float, program: Path, ladder: Sequence[float] = ()) -> None:
        self.path, self._program = path, program
        self.file = path if path.suffix == ".ath" else folder / "clip.ath"
        if path.suffix != ".ath":
            with read(path) as clip:
                athcodec.encode(clip, self.file, rel_error=rel_error, attributes="none", ladder=ladder)
                self.positions = np.asarray(clip.block(0, clip.frame_count), np.float32)
        with athcodec.open(self.file, strict=True) as decoder:
            self.bound, self.rest = decoder.file.max_error_bound, np.asarray(decoder.file.rest, np.float32)
            decoded = np.ascontiguousarray(decoder.positions(), np.float32)
        if path.suffix == ".ath":
            self.positions = decoded
        self.crc, self.max_error = crc32c(decoded), self.error_of(decoded)
        self.vertex_frames = decoded.shape[0] * decoded.shape[1]

    def error_of(self, decoded: np.ndarray) -> float:
        meter = ErrorMeter()
        meter.add(self.positions, decoded)
        return meter.max_error

    def program(self, *words: object) -> dict[str, Any]:
        command = [str(self._program), str(self.file), *map(str, words)]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)

    def broken(self, crc: int) -> list[str]:
        name, lines = self.path.name, []
        if crc != self.crc:
            lines.append(f"{name}, frames of decode.c: got CRC-32C {crc:#010x}; expected {self.crc:#010x}")
        if self.max_error > self.bound:
            lines.append(f"{name}: got an error of {self.max_error:.6g}; expected at most {self.bound:.6g}")
        return lines


def compile_program(folder: Path) -> Path:
    """Compiles decode.c with the decoder's sources and flags of CMakeLists.txt."""
    sources = re.search(r"set\(ATH_DECODER_SOURCES\s+([^)]*)\)", (CORE / "CMakeLists.txt").read_text())
    if sources is None:
        raise SystemExit("CMakeLists.txt: got no ATH_DECODER_SOURCES, expected the decoder's source files")
    program = folder / "decode"
    compile_c(program, [Path(__file__).with_suffix(".c"), *(CORE / source for source in sources[1].split())])
    return program


# ---- whole decoding, compared with others ----


@dataclass(frozen=True)
class _Reader:
    """Another reader of the clip's frames; `read` returns the milliseconds of one run."""

    name: str
    bytes: int
    max_error: float
    read: Callable[[], float]


def _whole(case: Case, folder: Path, rounds: int) -> list[dict[str, Any]]:
    others = [*(_python_reader(case, threads) for threads in THREADS), *_sz3_readers(case), _hdf5_reader(case, folder)]
    decode, opening, read = [], [], {other.name: [] for other in others}
    for number in range(rounds + 1):  # the first round is a warm-up
        ours = case.program("once")
        theirs = {other.name: other.read() for other in others}
        if number:
            decode.append(ours["decode_ms"])
            opening.append(ours["decode_ms"] + ours["opening_ms"])
            for name, ms in theirs.items():
                read[name].append(ms)
    size, error = case.file.stat().st_size, case.max_error
    rows = [
        _whole_row(case, "athcodec", decode, decode, size, error),
        _whole_row(case, "athcodec, opening included", opening, decode, size, error),
    ]
    for other in others:
        rows.append(_whole_row(case, other.name, read[other.name], decode, other.bytes, other.max_error))
    if pysz is None:
        rows.insert(2 + len(THREADS), {"reader": "SZ3: not installed (pip install pysz)"})
    return rows


def _whole_row(
    case: Case, name: str, runs: list[float], ours: list[float], size: int, max_error: float
) -> dict[str, Any]:
    middle = median(runs)
    return {
        "reader": name,
        "ms": middle,
        "min": min(runs),
        "max": max(runs),
        "M vertex-frames/s": case.vertex_frames / middle / 1e3,
        "ratio": middle / median(ours),
        "bytes": size,
        "error/bound": max_error / case.bound,
    }


def _python_reader(case: Case, threads: int) -> _Reader:
    """athcodec.open and all positions, by so many threads."""

    def read() -> float:
        with patch.object(segment_decoder, "default_jobs", lambda: threads):
            start = time.perf_counter()
            with athcodec.open(case.file) as decoder:
                decoder.positions()
            return 1e3 * (time.perf_counter() - start)

    name = f"athcodec in Python, opening included, {threads} thread{'s' if threads > 1 else ''}"
    return _Reader(name, case.file.stat().st_size, case.max_error, read)


def _hdf5_reader(case: Case, folder: Path) -> _Reader:
    file, out = folder / "clip.h5", np.zeros_like(case.positions)
    frames = max(1, min(len(out), GZIP_CHUNK // out[0].nbytes))
    with h5py.File(file, "w") as target:
        stored = target.create_dataset(
            "positions",
            data=case.positions,
            chunks=(frames, *out.shape[1:]),
            compression="gzip",
            compression_opts=4,
            shuffle=True,
        )
        size = stored.id.get_storage_size()

    def read() -> float:
        start = time.perf_counter()
        with h5py.File(file, "r") as source:
            source["positions"].read_direct(out)
        return 1e3 * (time.perf_counter() - start)

    return _Reader("HDF5 gzip 4", size, 0.0, read)


def _sz3_readers(case: Case) -> list[_Reader]:
    """The configuration with the smallest file, and the one that decodes fastest."""
    if pysz is None:
        return []
    setups = [_Sz3(case, *setup) for setup in product((False, True), SZ3_LAYOUTS, SZ3_ALGORITHMS)]
    smallest = min(setups, key=lambda setup: setup.compressed.nbytes)
    fastest = min(setups, key=lambda setup: min(setup.read() for _ in range(3)))
    return [smallest.reader(case, "smallest"), fastest.reader(case, "fastest")]


class _Sz3:
    """The clip compressed by SZ3 in one configuration."""

    def __init__(self, case: Case, displaced: bool, layout: str, algorithm: str) -> None:
        self.name = f"{'displacements' if displaced else 'positions'} {layout} {algorithm}"
        self._rest = case.rest if displaced else np.float32(0)
        self._layout = layout
        [values] = arrays_of(case.positions - self._rest, layout)
        self._shape = values.shape
        config = pysz.szConfig()
        config.errorBoundMode = pysz.szErrorBoundMode.ABS
        config.absErrorBound = case.bound / np.sqrt(3)
        config.cmprAlgo = getattr(pysz.szAlgorithm, algorithm)
        self.compressed = pysz.sz.compress(values, config)[0]

    def reader(self, case: Case, why: str) -> _Reader:
        name = f"SZ3 (pysz {version('pysz')}), {why}: {self.name}"
        return _Reader(name, self.compressed.nbytes, self._max_error(case), self.read)

    def read(self) -> float:
        start = time.perf_counter()
        pysz.sz.decompress(self.compressed, np.float32, self._shape)
        return 1e3 * (time.perf_counter() - start)

    def _max_error(self, case: Case) -> float:
        values = pysz.sz.decompress(self.compressed, np.float32, self._shape)[0]
        return case.error_of(from_arrays([values], self._layout, case.positions.shape) + self._rest)


# ---- tables ----


def _target_rows(figures: dict[str, Any], whole: list[dict[str, Any]]) -> list[dict[str, Any]]:
    levels = level_rows(figures)
    deep, coarse = levels[-1], levels[min(1, len(levels) - 1)]
    decode, seeks = whole[0], figures["seeks"]
    one, two = memory_rows(figures)[-2:]
    frames, segment = figures["frames"], deep["prepare"] / figures["segments"]
    whole_ms = deep["prepare"] + deep["write"]
    matrices_ms = coarse["prepare"] + coarse["matrices"] * frames / 1e3
    vertices_ms = coarse["prepare"] + coarse["write"]
    rows = [
        ("whole decoding", decode["ms"], "ms", "<= 100"),
        ("whole decoding", decode["M vertex-frames/s"], "M vertex-frames/s", None),
        *((f"{row['reader']} over athcodec", row.get("ratio"), "times", None) for row in whole[2:]),
        ("whole decoding over level 1, matrices", whole_ms / matrices_ms, "times", ">= 10"),
        ("whole decoding over level 1, vertices", whole_ms / vertices_ms, "times", ">= 10"),
        ("bytes for level 1", coarse["%"], "% of the file", "<= 15"),
        ("playing with decoding, deepest level, vertices", deep["playing vertices"], "us a frame", "<= 500"),
        ("playing with decoding, level 1, matrices", coarse["playing matrices"], "us a frame", "<= 25"),
        ("playing with decoding, level 1, vertices", coarse["playing vertices"], "us a frame", "<= 25"),
        ("prepared, deepest level, vertices", deep["vertices"], "us a frame", "<= 60"),
        ("prepared, level 1, matrices", coarse["matrices"], "us a frame", "<= 3"),
        ("prepared, level 1, vertices", coarse["vertices"], "us a frame", None),
        ("opening: ath_open", figures["open_ms"], "ms", None),
        ("opening: ath_build", figures["build_ms"], "ms", None),
        ("seek, median", seeks["median_ms"], "ms", f"<= {segment:.4g}"),
        ("seek, 99th percentile", seeks["p99_ms"], "ms", f"<= {segment:.4g}"),
        ("memory over positions, one segment", one["over positions"], "times", "<= 2"),
        ("memory over positions, two segments", two["over positions"], "times", None),
    ]
    return [dict(zip(("what", "figure", "unit", "target"), row, strict=True)) for row in rows]


def level_rows(figures: dict[str, Any]) -> list[dict[str, Any]]:
    rows = []
    for level in figures["levels"]:
        share = 1e3 * level["prepare_ms"] / figures["frames"]
        vertices, matrices = level["positions_us"], level["matrices_us"]
        rows.append(
            {
                "level": level["level"],
                "nodes": level["nodes"],
                "exact": level["exact_vertices"],
                "bytes": level["bytes"],
                "%": 100 * level["bytes"] / figures["file_bytes"],
                "prepare": level["prepare_ms"],
                "write": level["frames_ms"],
                "vertices": vertices,
                "matrices": matrices,
                "playing vertices": share + vertices,
                "playing matrices": share + matrices,
                "CRC-32C": f"{level['crc']:08x}",
            }
        )
    return rows


def onward_rows(figures: dict[str, Any]) -> list[dict[str, Any]]:
    rows = []
    for pair in figures["onward"]:
        segments = figures["segments"] * figures["levels"][pair["from"]]["segment_bytes"]
        rows.append(
            {
                "from": pair["from"],
                "to": pair["to"],
                "keep": pair["keeping_ms"],
                "onward": pair["onward_ms"],
                "anew": pair["anew_ms"],
                "onward/anew": pair["onward_ms"] / pair["anew_ms"],
                "kept": pair["kept_bytes"],
                "share": pair["kept_bytes"] / segments,
            }
        )
    return rows


def memory_rows(figures: dict[str, Any]) -> list[dict[str, Any]]:
    """Level 1 and the deepest, each with one segment and with two."""
    levels, rows = figures["levels"], []
    positions = 12 * figures["vertices"] * figures["longest_segment"]
    for level in sorted({min(1, len(levels) - 1), len(levels) - 1}):
        for count in (1, 2):
            row = {name: figures[f"{name}_bytes"] for name in ("file", "opened", "bases", "work")}
            row["segments"] = count * levels[level]["segment_bytes"]
            whole = {"sum": sum(row.values()), "positions": positions}
            rows.append(
                {"level": level, "prepared": count} | row | whole | {"over positions": whole["sum"] / positions}
            )
    return rows


def _instance_rows(figures: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        {
            "level": "even mix" if row["level"] < 0 else str(row["level"]),
            "instances": row["instances"],
            "pictures": row["pictures"],
            "ms": row["ms"],
            "instances/ms": row["per_ms"],
        }
        for row in figures["instances"]
    ]
