"""A short run of the main verbs, two minutes: codecs, decoder, URLs.

Each step is a separate command; its JSON goes to one folder. What takes long is left out: most codecs,
most bounds, large clips. It checks that everything works; figures to quote come from the full runs.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bench.clips import add_number
from bench.tables import table

ROOT = Path(__file__).resolve().parent.parent
CLIPS = ("sample", "mj_1k_200f")
CODECS = ("athcodec", "simple (differences, zstd)", "meshoptimizer", "trajectory PCA + hierarchy (CoDDyAC)")
BOUNDS = (1e-3, 1e-4)

NOTE = "Seconds of each step, including the start of Python."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips",
        nargs="*",
        metavar="CLIP",
        default=list(CLIPS),
        help="files CLIP.h5, or names of clips of this benchmark (default: %(default)s)",
    )
    parser.add_argument(
        "--codecs", nargs="+", metavar="NAME", default=list(CODECS), help="codecs to compare (default: %(default)s)"
    )
    add_number(parser, "--bounds", BOUNDS, "error bounds over the bounding box's diagonal", "FRACTION")
    parser.add_argument(
        "--out", type=Path, default=Path("build/bench"), metavar="FOLDER", help="where results go (default %(default)s)"
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    args.out.mkdir(parents=True, exist_ok=True)
    rows, broken = [], []
    for verb, words in _steps(args):
        start = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "bench", verb, *words], cwd=ROOT, text=True, stdout=subprocess.PIPE
        )
        rows.append({"step": verb, "seconds": time.perf_counter() - start, "exit code": done.returncode})
        if done.returncode:
            broken += [
                line.removeprefix("BROKEN: ") for line in done.stdout.splitlines() if line.startswith("BROKEN: ")
            ] or [f"{verb}: exit code {done.returncode}"]
    rows.append({"step": "all", "seconds": sum(row["seconds"] for row in rows)})
    return {"tables": [table("Steps", rows, NOTE)], "broken": broken}


def _steps(args: argparse.Namespace) -> Iterator[tuple[str, list[str]]]:
    out = args.out.resolve()
    clips = [str(Path(clip).resolve()) if Path(clip).is_file() else clip for clip in args.clips]
    files = [clip for clip in clips if Path(clip).is_file()][:1]  # The first clip, or none: then the sample is taken.
    bounds = [f"{bound:g}" for bound in args.bounds]
    few = ["--rounds", "2", "--seeks", "20", "--instances", "20"]
    made = ["--of", *files] if files else []
    steps = {
        "rd": [*clips, "--codecs", *args.codecs, "--bounds", *bounds],
        "decode": [*files, *few],
        "remote": [*"--plants 1 --frames 240 --frame 200 --rounds 1".split(), *made],
    }
    for verb, words in steps.items():
        yield verb, [*words, "--json", str(out / f"{verb}.json")]
