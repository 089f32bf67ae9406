"""Processor time and memory of the decoder in C: whole files, levels, playing, seeking.

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
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import athcodec
from athcodec._native import crc32c
from bench.clips import add_clips, add_ladder, add_number, add_rel_error, read
from bench.codecs.coder import CORE, compile_c
from bench.tables import table

ROUNDS, SEEKS = 9, 1000
TABLES = ("target", "levels", "onward", "memory")

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


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser, "motion clips, which are encoded first, or .ath files")
    add_rel_error(parser)
    add_ladder(parser, "decades")
    add_number(parser, "--rounds", ROUNDS, "runs of everything")
    add_number(parser, "--seeks", SEEKS, "random frames")


def run(args: argparse.Namespace) -> dict[str, Any]:
    tables: dict[str, list[dict[str, Any]]] = {name: [] for name in TABLES}
    broken = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = compile_program(folder)
        for path in args.clips:
            case = Case(path, folder, args.rel_error, program, args.ladder)
            figures = case.program("all", args.rounds, args.seeks)
            rows = {
                "target": _target_rows(figures, case.whole(args.rounds)),
                "levels": level_rows(figures),
                "onward": onward_rows(figures),
                "memory": memory_rows(figures),
            }
            for key, added in rows.items():
                tables[key] += [{"clip": path.stem} | row for row in added]
            broken += case.broken(figures["levels"][-1]["crc"])
    return {
        "tables": [
            table(f"Decoding, bound {args.rel_error:g}, beside the targets", tables["target"], TARGET_NOTE),
            table("Levels, medians", tables["levels"], LEVELS_NOTE),
            table("Going on to a deeper level, medians", tables["onward"], ONWARD_NOTE),
            table("Memory", tables["memory"], MEMORY_NOTE),
        ],
        "broken": broken,
    }


# ---- clips and the program ----


class Case:
    """A clip's .ath file, with the program that times the decoder on it."""

    def __init__(self, path: Path, folder: Path, rel_error: float, program: Path, ladder: Sequence[float] = ()) -> None:
        self.path, self._program = path, program
        self.file = path if path.suffix == ".ath" else folder / "clip.ath"
        if path.suffix != ".ath":
            with read(path) as clip:
                athcodec.encode(clip, self.file, rel_error=rel_error, attributes="none", ladder=ladder)
        with athcodec.open(self.file, strict=True) as decoder:
            self.crc = crc32c(np.ascontiguousarray(decoder.positions(), np.float32))

    def program(self, *words: object) -> dict[str, Any]:
        command = [str(self._program), str(self.file), *map(str, words)]
        return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)

    def whole(self, rounds: int) -> dict[str, float]:
        """Medians of whole decoding and of opening, each round a process of its own."""
        runs = [self.program("once") for _ in range(rounds)]
        return {name: median(run[name] for run in runs) for name in runs[0]}

    def broken(self, crc: int) -> list[str]:
        if crc == self.crc:
            return []
        return [f"{self.path.name}, frames of decode.c: got CRC-32C {crc:#010x}; expected {self.crc:#010x}"]


def compile_program(folder: Path) -> Path:
    """Compiles decode.c with the decoder's sources and flags of CMakeLists.txt."""
    sources = re.search(r"set\(ATH_DECODER_SOURCES\s+([^)]*)\)", (CORE / "CMakeLists.txt").read_text())
    if sources is None:
        raise SystemExit("CMakeLists.txt: got no ATH_DECODER_SOURCES, expected the decoder's source files")
    program = folder / "decode"
    compile_c(program, [Path(__file__).with_suffix(".c"), *(CORE / source for source in sources[1].split())])
    return program


# ---- tables ----


def _target_rows(figures: dict[str, Any], whole: dict[str, float]) -> list[dict[str, Any]]:
    levels = level_rows(figures)
    deep, coarse = levels[-1], levels[min(1, len(levels) - 1)]
    seeks, decode_ms = figures["seeks"], whole["decode_ms"]
    one, two = memory_rows(figures)[-2:]
    frames, segment = figures["frames"], deep["prepare"] / figures["segments"]
    whole_ms = deep["prepare"] + deep["write"]
    matrices_ms = coarse["prepare"] + coarse["matrices"] * frames / 1e3
    vertices_ms = coarse["prepare"] + coarse["write"]
    rows = [
        ("whole decoding", decode_ms, "ms", "<= 100"),
        ("whole decoding", figures["vertices"] * frames / decode_ms / 1e3, "M vertex-frames/s", None),
        ("whole decoding, opening included", decode_ms + whole["opening_ms"], "ms", None),
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
