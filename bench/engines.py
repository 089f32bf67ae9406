"""Plays the shipped tree in engines: lines of glue, milliseconds a frame in software, as tests of examples measure."""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench import rd
from bench.store import Results, Store
from bench.tables import environment, table

RESULTS = rd.RESULTS / "engines.json"
RECORD = "ATHCODEC_ENGINES"
"""Environment variable: the file that tests of engines append what they measure to."""
TESTS = (
    "tests/test_engines_javascript.py::test_an_engine_shows_the_shipped_tree_at_two_levels_as_python_decodes_it",
    "tests/test_engines.py::test_raylib_draws_the_tree_at_the_level_of_its_distance_from_the_ranges_that_it_needs",
    "tests/test_csharp.py::test_the_example_plays_at_the_level_of_its_distance_from_the_ranges_that_it_needs",
)
EXAMPLES = {
    "PlayCanvas": ("viewer/examples/playcanvas.js", "an ESM script, over plant.js"),
    "Babylon.js": ("viewer/examples/babylon.js", "thin instances, over plant.js"),
    "three.js": ("viewer/examples/three.js", "over [the loader](three-js.md)"),
    "raylib": ("core/examples/raylib_player.c", "a whole program, over ath_player.h"),
    "Mono": ("core/examples/PlayPlant.cs", "decodes without drawing, over Plant.cs and Ath.cs"),
}
"""For each engine the path of its example below athcodec, and what it is."""
_NO_CODE = r"\s*(//|/\*|\*|import|using |#include|#define)"


def lines_of(path: str) -> int:
    """Return the lines of code of an example below athcodec, without comments and imports."""
    text = (rd.ROOT / "athcodec" / path).read_text("utf-8")
    return sum(bool(line.strip()) and not re.match(_NO_CODE, line) for line in text.splitlines())


def is_recording() -> bool:
    """Return whether a test is to measure programs as users build them."""
    return RECORD in os.environ


def record(engine: str, version: str, near: float, far: float) -> None:
    """Write what a test has measured where `python -m bench engines` asks for it. near, far: milliseconds a frame."""
    if is_recording():
        with open(os.environ[RECORD], "a") as file:
            file.write(json.dumps({"engine": engine, "version": version, "near": near, "far": far}) + "\n")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--only", metavar="WORDS", default="", help="tests to run, as pytest's -k")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Run the tests that play the shipped tree in game engines and browsers, and store what they measure. Return the
    table of engines, and whether any test failed.
    """
    store = Store(RESULTS, environment(args.argv), {"engines": ["engine"]})
    with tempfile.TemporaryDirectory() as folder:
        measured = Path(folder) / "engines.jsonl"
        command = [sys.executable, "-m", "pytest", "-q", "-n0", "-m", "programs or browser", "-k", args.only, *TESTS]
        done = subprocess.run(command, cwd=rd.ROOT, env=os.environ | {RECORD: str(measured)})
        lines = measured.read_text().splitlines() if measured.exists() else []
    for line in lines:
        row = json.loads(line)
        store.add("engines", row | {"lines": lines_of(EXAMPLES[row["engine"]][0])})
    broken = [{"tests": "failed"}] if done.returncode else []
    return {"tables": [table("Engines", store.contents()["engines"])], "broken": broken}


def table_text(contents: Mapping[str, Any]) -> str:
    """Return the stored measurements as a Markdown table for a document, one row per engine in the order of
    EXAMPLES.
    """
    rows: Results = contents["engines"]
    text = "| engine | version | example | lines | ms a frame, near | ms a frame, far |\n|---|---|---|--:|--:|--:|\n"
    for engine, (path, form) in EXAMPLES.items():
        for row in rows:
            if row["engine"] == engine:
                link = f"[{Path(path).name}](../athcodec/{path}), {form}"
                times = f"{row['near']:.0f} | {row['far']:.0f}"
                text += f"| {engine} | {row['version']} | {link} | {row['lines']} | {times} |\n"
    return text
