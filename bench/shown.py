"""The tables of documents that are columns of stored tables, each below its command and the version measured."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.store import commits
from bench.tables import markdown

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "bench" / "results"
Row = dict[str, Any]


@dataclass(frozen=True)
class Shown:
    """A table in a document: rows made of the tables of a file of results, by their titles up to a comma."""

    document: str
    results: str
    rows: Callable[[dict[str, list[Row]]], list[Row]]

    def text(self) -> str:
        result = json.loads((RESULTS / f"{self.results}.json").read_text("utf-8"))
        tables = {table["title"].split(",")[0]: table["rows"] for table in result["tables"]}
        made_by = f"athcodec {result['versions']['athcodec']}, commit {commits([result])}"
        return f"`{result['command']}`, {made_by}\n\n{markdown(self.rows(tables))}"


def picked(title: str, clips: tuple[str, ...] = (), **columns: str) -> Callable[[dict[str, list[Row]]], list[Row]]:
    """Return a function that picks columns of a table, by new names, in the rows of some clips or of all."""

    def rows(tables: dict[str, list[Row]]) -> list[Row]:
        chosen = [row for row in tables[title] if not clips or row["clip"] in clips]
        return [{name.replace("_", " "): row.get(column) for name, column in columns.items()} for row in chosen]

    return rows


def _sizes(tables: dict[str, list[Row]]) -> list[Row]:
    """Return the rows of a document's table of file sizes, one per clip, with the bytes at each error bound in a column
    of its own. `tables` has the stored tables by title.
    """
    rows_of_clips: dict[str, Row] = {}
    for row in tables["Sizes"]:
        shown = rows_of_clips.setdefault(
            row["clip"], {"clip": row["clip"], "float32": round(row["bytes"] * row["ratio"])}
        )
        shown[row["bound"] + {"none": "", "decades": " in layers"}[row["ladder"]]] = row["bytes"]
    return list(rows_of_clips.values())


def _levels(tables: dict[str, list[Row]]) -> list[Row]:
    """Return the rows of a document's table of levels: bytes up to the level, RMS errors and gaps, beside those of the
    paper's method.
    """
    gaps = {(row["clip"], row["level"]): row for row in tables["Gaps at the attach points"]}
    rows = []
    for row in tables["Levels"]:
        gap = gaps.get((row["clip"], row["level"]), {})
        shown = {name: row[name] for name in ("clip", "level")} | {"parts": row["nodes"], "file cut here": row["bytes"]}
        errors = {"RMS": row["RMS"], "paper's RMS": row["paper RMS"]}
        rows.append(shown | errors | {"widest gap": gap.get("max"), "paper's gap": gap.get("paper max")})
    return rows


def _prefixes(tables: dict[str, list[Row]]) -> list[Row]:
    """Return the rows of a document's table of prefixes of files with layers: bytes and error of each prefix, and its
    bytes over those of a file encoded directly at the same error.
    """
    return [
        {"clip": row["clip"], "level": row["level"], "prefix": row["bytes"], "largest error": row["max"]}
        | {"own file": row["own at max"], "prefix / own": row["/own at max"], "at equal RMS": row["/own at RMS"]}
        for [*_, rows] in [[row for key, row in tables.items() if key.startswith("Prefixes")]]
        for row in rows
        if row["ladder"] == "layers"
    ]


def _ladders(tables: dict[str, list[Row]]) -> list[Row]:
    """Return the rows of a document's table of bytes at round errors on one clip: with layers, without layers, and of a
    file encoded directly at that error.
    """
    rows_of_errors: dict[float, Row] = {}
    names = {"layers": "default", "none": "--ladder none"}
    for row in tables["At an error"]:
        if row["clip"] == "tree_1k_120f" and "bytes at max" in row:
            shown = rows_of_errors.setdefault(
                row["error"], {"largest error": row["error"]} | dict.fromkeys(names.values())
            )
            shown[names[row["ladder"]]] = row["bytes at max"]
            shown["own file"] = row["own at max"]
    return list(rows_of_errors.values())


def _host(tables: dict[str, list[Row]]) -> list[Row]:
    rows_of_clips: dict[str, Row] = {}
    for row in tables["Sizes"]:
        if row["ladder"] == "decades":
            shown = rows_of_clips.setdefault(row["clip"], {"clip": row["clip"]})
            shown |= {row["bound"]: row["bytes"], f"{row['bound']}, --rest host": row["rest host"]}
    return list(rows_of_clips.values())


def _decoding(tables: dict[str, list[Row]]) -> list[Row]:
    rows_of_units: dict[tuple[str, str], Row] = {}
    for row in tables["Decoding"]:
        shown = rows_of_units.setdefault((row["what"], row["unit"]), {"": row["what"], "unit": row["unit"]})
        shown[row["clip"]] = row["figure"]
    return list(rows_of_units.values())


def _structure(tables: dict[str, list[Row]]) -> list[Row]:
    """Return the rows of a document's table of scenes: bytes with branches that athcodec finds, over those with named
    branches and over those of the parts encoded alone.
    """
    defaults = {row["scene"]: row for row in tables["Default options"]}
    rows = []
    for row in tables["Found against true branches and against parts"]:
        whole = defaults[row["scene"]]
        named = {name: row[name] for name in ("scene", "roots, branches", "found ones", "true", "found")}
        ratios = {"/ true": row["found / true"], "/ parts": row["found / parts"]}
        rows.append(
            named | ratios | {"default": whole["bytes"], "seconds": whole["seconds"], "levels": whole["levels"]}
        )
    return rows


def _onto(tables: dict[str, list[Row]]) -> list[Row]:
    """Return the rows of a document's table of meshes that move by a skeleton's file: bytes, distances from the mesh's
    own motion, stretch of edges and gaps at joints.
    """
    return [
        {name: row[name] for name in ("clip", "nodes", "vertices", "frames")}
        | {"skeleton's file": row["skeleton bytes"], "mesh's own file": row["mesh bytes"], "diagonal": row["size"]}
        | {"wood, RMS": row["wood RMS"], "wood, max": row["wood max"], "leaves, RMS": row["leaves RMS"]}
        | {name: row[name] for name in ("stretch", "own stretch")}
        | {"skeleton's stretch": row["skeleton stretch"]}
        | {name: row[name] for name in ("gap", "own gap", "bones")}
        | {"bones, max": row["bones max"]}
        for row in tables["Onto"]
    ]


BENCHMARKS = "docs/benchmarks.md"
SHOWN = {
    "onto": Shown("docs/onto.md", "onto", _onto),
    "sizes": Shown(BENCHMARKS, "sizes", _sizes),
    "wrappings": Shown(
        BENCHMARKS, "wrappings", picked("Wrappings", file="file", bytes="bytes", largest_error="max error")
    ),
    "host": Shown("docs/command-line.md", "sizes", _host),
    "ladders": Shown("docs/command-line.md", "progressive", _ladders),
    "levels": Shown(BENCHMARKS, "levels", _levels),
    "structure": Shown(BENCHMARKS, "structure", _structure),
    "split": Shown(
        BENCHMARKS,
        "split",
        picked(
            "Split against welded",
            clip="clip",
            faces="faces",
            order="order",
            vertices="vertices",
            places="places",
            split="split",
            welded="welded",
            over_limit="/ limit",
            decoding="decoding",
        ),
    ),
    "prefixes": Shown(BENCHMARKS, "progressive", _prefixes),
    "decoding": Shown(BENCHMARKS, "decode", _decoding),
    "speed": Shown(
        BENCHMARKS,
        "speed",
        picked(
            "Speed",
            clip="clip",
            encode_cpu_s="CPU",
            over_limit="CPU/limit",
            decode_s="decode",
            frame_at_level_1_s="frame",
        ),
    ),
    "memory": Shown(
        BENCHMARKS,
        "memory",
        picked("Peak memory of encoding", clip="clip", frames="frames", positions_MB="positions", peak_MB="peak"),
    ),
    "onward": Shown(
        "docs/c-api.md",
        "decode",
        picked(
            "Going on to a deeper level",
            ("tree_8k_200f",),
            from_level="from",
            to_level="to",
            onward_over_anew="onward/anew",
            kept_over_prepared="share",
        ),
    ),
}


def sections() -> Iterator[tuple[Path, str, str]]:
    """Yield every table: document, name and text."""
    for name, shown in SHOWN.items():
        yield ROOT / shown.document, name, shown.text()
