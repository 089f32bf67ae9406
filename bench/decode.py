"""Processor time and memory of the decoder: whole files, levels, playing, seeking; and beside SZ3, from Python.

The decoder is timed by decode.c, compiled here with the core's own sources and flags, so that no Python is in its
loops. It has one thread, whose processor time other programs on the machine do not add to. Its frames are compared
with those of athcodec.open by their checksum.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import athcodec
from athcodec._native import crc32c
from bench.clips import add_clips, add_ladder, add_number, add_rel_error
from bench.codecs.coder import CORE, compile_c
from bench.codecs.program import split
from bench.codecs.sz3 import ALGORITHMS, Sz3
from bench.tables import table

SOURCE = Path(__file__).with_suffix(".c")
ROUNDS, SEEKS = 9, 1000
TABLES = ("whole", "levels", "onward", "memory", "sz3")

WHOLE_NOTE = """
Whole decoding: every segment prepared at the
deepest level, entropy decoding included, and every frame written as float32 in the source's order; the file
is open. Playing with decoding: a segment's preparation divided by its frames, and the evaluation of a pose
between two frames. Prepared: the evaluation alone. Vertices: ath_positions, all of
them, in the file's order; matrices: ath_matrices and ath_exact, what a renderer needs. Bytes of level 1:
prelude and what ath_ranges names. Seek: a random frame, its segment prepared and the frame written.
Memory over positions: all memory for playing (table Memory) over one segment's float32 positions.
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


SZ3_NOTE = """
Processor time in ms, runs in turns: athcodec.open of the bytes and all positions, of a file in layers and of one with a
single layer; opening the file in layers and one frame at level 0; the fastest of SZ3's algorithms on the array of
frames x vertices x 3, each number within the bound over the root of 3. Ratios above 1: faster than SZ3.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser, "motion clips, which are encoded first, or .ath files")
    add_rel_error(parser)
    add_ladder(parser, "decades")
    add_number(parser, "--rounds", ROUNDS, "runs of everything")
    add_number(parser, "--seeks", SEEKS, "random frames")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Measure decoding of each clip by a C program: whole files, single levels, refining from level to level, memory
    and seeks, and SZ3 beside them. Return the tables, and the clips whose decoded bits differ.
    """
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in TABLES}
    broken = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = compile_program(folder)
        for path in args.clips:
            case = Case(path, folder, args.rel_error, program, args.ladder)
            figures = case.program("all", args.rounds, args.seeks)
            rows = {
                "whole": _whole_rows(figures, case.whole(args.rounds)),
                "levels": level_rows(figures),
                "onward": onward_rows(figures),
                "memory": memory_rows(figures),
                "sz3": sz3_rows(case, args.rel_error, args.rounds),
            }
            for key, added in rows.items():
                tables[key] += [{"clip": path.stem} | row for row in added]
            broken += case.broken(figures["levels"][-1]["crc"])
    shown = [table("Beside SZ3, medians", tables["sz3"], SZ3_NOTE, Sz3().missing() or "")] if tables["sz3"] else []
    return {
        "tables": [
            table(f"Decoding, bound {args.rel_error:g}", tables["whole"], WHOLE_NOTE),
            table("Levels, medians", tables["levels"], LEVELS_NOTE),
            table("Going on to a deeper level, medians", tables["onward"], ONWARD_NOTE),
            table("Memory", tables["memory"], MEMORY_NOTE),
            *shown,
        ],
        "broken": broken,
    }


# ---- clips and the program ----


class Case:
    """A clip's .ath file, with the program that times the decoder on it."""

    def __init__(self, path: Path, folder: Path, rel_error: float, program: Path, ladder: Sequence[float] = ()) -> None:
        """Encode the clip at `path` into `folder`, unless it is an .ath file already, and keep the checksum of its
        decoded positions. `program` is the compiled C program that measures.
        """
        self.path, self._program = path, program
        self.file = path if path.suffix == ".ath" else folder / "clip.ath"
        if path.suffix != ".ath":
            with athcodec.read(path) as clip:
                athcodec.encode(clip, self.file, rel_error=rel_error, attributes="none", ladder=ladder)
        with athcodec.open(self.file, strict=True) as decoder:
            self.crc = crc32c(np.ascontiguousarray(decoder.positions(), np.float32))

    def program(self, *words: object) -> dict[str, Any]:
        command = [str(self._program), str(self.file), *map(str, words)]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)

    def whole(self, rounds: int) -> dict[str, float]:
        """Return medians of whole decoding and of opening, each round a process of its own."""
        runs = [self.program("once") for _ in range(rounds)]
        return {name: median(run[name] for run in runs) for name in runs[0]}

    def broken(self, crc: int) -> list[str]:
        if crc == self.crc:
            return []
        return [f"{self.path.name}, frames of decode.c: got CRC-32C {crc:#010x}; expected {self.crc:#010x}"]


def compile_program(folder: Path) -> Path:
    """Return compiles decode.c with the decoder's sources and flags of CMakeLists.txt."""
    sources = re.search(r"set\(ATH_DECODER_SOURCES\s+([^)]*)\)", (CORE / "CMakeLists.txt").read_text())
    if sources is None:
        raise SystemExit("CMakeLists.txt: got no ATH_DECODER_SOURCES, expected the decoder's source files")
    program = folder / "decode"
    compile_c(program, [SOURCE, *(CORE / source for source in sources[1].split())])
    return program


# ---- tables ----


def _whole_rows(figures: dict[str, Any], whole: dict[str, float]) -> list[dict[str, Any]]:
    """Return rows (what is measured, value, unit) about decoding a whole file. `figures` are the C program's
    measurements by level; `whole` has the milliseconds of opening and of decoding all frames.
    """
    levels = level_rows(figures)
    deep, coarse = levels[-1], levels[min(1, len(levels) - 1)]
    seeks, decode_ms = figures["seeks"], whole["decode_ms"]
    one, two = memory_rows(figures)[-2:]
    frames = figures["frames"]
    whole_ms = deep["prepare"] + deep["write"]
    matrices_ms = coarse["prepare"] + coarse["matrices"] * frames / 1e3
    vertices_ms = coarse["prepare"] + coarse["write"]
    rows = [
        ("whole decoding", decode_ms, "ms"),
        ("whole decoding", figures["vertices"] * frames / decode_ms / 1e3, "M vertex-frames/s"),
        ("whole decoding, opening included", decode_ms + whole["opening_ms"], "ms"),
        ("whole decoding over level 1, matrices", whole_ms / matrices_ms, "times"),
        ("whole decoding over level 1, vertices", whole_ms / vertices_ms, "times"),
        ("bytes for level 1", coarse["%"], "% of the file"),
        ("playing with decoding, deepest level, vertices", deep["playing vertices"], "us a frame"),
        ("playing with decoding, level 1, matrices", coarse["playing matrices"], "us a frame"),
        ("playing with decoding, level 1, vertices", coarse["playing vertices"], "us a frame"),
        ("prepared, deepest level, vertices", deep["vertices"], "us a frame"),
        ("prepared, level 1, matrices", coarse["matrices"], "us a frame"),
        ("prepared, level 1, vertices", coarse["vertices"], "us a frame"),
        ("opening", whole["opening_ms"], "ms"),
        ("seek, median", seeks["median_ms"], "ms"),
        ("seek, 99th percentile", seeks["p99_ms"], "ms"),
        ("memory over positions, one segment", one["over positions"], "times"),
        ("memory over positions, two segments", two["over positions"], "times"),
    ]
    return [dict(zip(("what", "figure", "unit"), row, strict=True)) for row in rows]


def level_rows(figures: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a row for each level from the C program's measurements: its bytes, the milliseconds to prepare and write
    all frames, and microseconds per frame for vertices and for matrices.
    """
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
    """Return a row for each pair of levels that a decoder refines between: milliseconds of decoding onward from the
    kept coarser level, and anew from the start, and the bytes of memory kept for it.
    """
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


def sz3_rows(case: Case, rel_error: float, rounds: int) -> list[dict[str, Any]]:
    """Return one row that compares the decoding times of athcodec and SZ3 on the same clip, as medians of `rounds`; an
    empty list for an .ath file, which does not hold the source.
    """
    if case.path.suffix == ".ath":
        return []
    with athcodec.read(case.path) as clip:
        positions = np.asarray(clip.positions[:], np.float32)
        single = athcodec.encode(clip, rel_error=rel_error, attributes="none", ladder="none")
    layers = case.file.read_bytes()
    jobs: dict[str, Callable[[], Any]] = {
        "layers": lambda: athcodec.open(layers).positions(),
        "single": lambda: athcodec.open(single).positions(),
        "level 0": lambda: athcodec.open(layers).positions(0, level=0),
    }
    if not Sz3().missing():
        extent = np.ptp(positions.reshape(-1, 3).astype(np.float64), axis=0)
        for algorithm in (*ALGORITHMS, "NOPRED"):
            jobs[algorithm] = _sz3_job(positions, float(rel_error * np.linalg.norm(extent) / np.sqrt(3)), algorithm)
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds + 1):
        for name, job in jobs.items():
            start = time.process_time()
            job()
            seconds[name].append(time.process_time() - start)
    row: dict[str, Any] = {name: 1e3 * median(runs[1:]) for name, runs in seconds.items()}
    others = {name: row.pop(name) for name in list(row)[3:]}
    row["layers/single"] = row["layers"] / row["single"]
    if others:
        row["fastest"] = min(others, key=lambda name: others[name])
        row["SZ3"] = others[row["fastest"]]
        row |= {f"SZ3/{name}": row["SZ3"] / row[name] for name in ("layers", "single")}
    return [row]


def _sz3_job(positions: np.ndarray, bound: float, algorithm: str) -> Callable[[], Any]:
    pysz = Sz3().load()
    (data,) = split(Sz3().encode_floats(positions, bound, ("T,N,3", algorithm), thorough=True))
    return lambda: pysz.sz.decompress(np.frombuffer(data, np.uint8), np.float32, positions.shape)[0]


def memory_rows(figures: dict[str, Any]) -> list[dict[str, Any]]:
    """Return rows of the bytes of memory that decoding takes, at level 1 and at the deepest level, with one prepared
    segment and with two.
    """
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
