"""One page from all results: the clips, every table with the command that made it, pictures.

Reads the JSON files of a folder (of any verb) and writes report.md and, where matplotlib is installed, the pictures of
plots.py beside them. Measures nothing: a verb without a file has no section.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench import odd, plots, rd, store
from bench.tables import as_text, table

RESULTS = Path(__file__).resolve().parent / "results"
TITLES = {
    "rd": "Rate and distortion",
    "decode": "The decoder",
    "sizes": "Sizes and what they are made of",
    "levels": "Levels of detail",
    "progressive": "Prefixes",
    "speed": "Encoding and decoding in Python",
    "memory": "Memory of encoding",
    "large": "Large clips",
    "batch": "Many clips",
    "remote": "Behind a URL",
}

ORDER = {verb: place for place, verb in enumerate(TITLES)}

INTRODUCTION = """# What athcodec measures

Written by `python -m bench report` from the JSON files beside it, which hold the unrounded figures. Every
section names the command that made it, with versions and machine at its end. Errors are Euclidean distances,
over the diagonal of the bounding box of all frames unless stated otherwise; 1 kB is 1,000 bytes.
"""

PICTURES = """In the pictures, thick: athcodec; full lines: baselines implemented here; dotted: those on
principal components; dashed: programs."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--results",
        type=Path,
        default=RESULTS,
        metavar="FOLDER",
        help="folder of the JSON files, which report.md goes to (default: bench/results)",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    return write(args.results)


def write(folder: Path) -> dict[str, Any]:
    """Writes report.md and pictures into the folder of the results; returns the list of files as a result."""
    results = [(path.stem, store.read(path)) for path in sorted(folder.glob("*.json"))]
    results = sorted(
        ((name, result) for name, result in results if "points" in result or "tables" in result),
        key=lambda pair: ORDER.get(_verb(pair[1]), len(ORDER)),
    )
    if not results:
        raise SystemExit(f"{folder.name}: found no results; expected JSON files of `python -m bench VERB --json FILE`")
    sections, rows = [], []
    for name, result in results:
        pictures, missing = _pictures(name, result, folder)
        sections.append(_section(result, pictures, missing))
        rows += [{"file": file.name, "from": f"{name}.json"} for files in pictures.values() for file in files]
        rows += [{"file": missing, "from": f"{name}.json"}] if missing else []
    (folder / "report.md").write_text("\n".join([INTRODUCTION, *sections]))
    return {"tables": [table("Written", [{"file": "report.md", "from": "all of them"}, *rows])], "broken": []}


def _verb(result: dict[str, Any]) -> str:
    return result["command"].split()[3]


def _pictures(name: str, result: dict[str, Any], folder: Path) -> tuple[dict[str, list[Path]], str]:
    """Files by clip (under "" those about all clips), and the reason if there are none."""
    prefix = "" if name == "rd" else f"{name}_"
    try:
        if _verb(result) == "progressive":
            return {"": [plots.draw_prefixes(result["chart"], folder / f"{name}.png")]}, ""
        if _verb(result) != "rd":
            return {"": []}, ""
        clips = [] if _is_odd(result) else [row["clip"] for row in result["clips"]]
        return {clip: plots.draw(result, clip, folder, prefix) for clip in clips}, ""
    except plots.NoPlots as error:
        return {}, str(error)


def _is_odd(result: dict[str, Any]) -> bool:
    """Whether all clips are odd ones, of which there is one table."""
    return all(row["clip"] in odd.CLIPS for row in result["clips"])


def _section(result: dict[str, Any], pictures: dict[str, list[Path]], missing: str) -> str:
    verb = _verb(result)
    head = f"## {TITLES.get(verb, verb)}\n"
    if verb != "rd":
        above = [f"{missing}\n"] if missing else _image_links(pictures[""])
        return "\n".join([head, *above, as_text(result), ""])
    contents, clips = {key: result[key] for key in rd.KEYS}, [row["clip"] for row in result["clips"]]
    commands = dict.fromkeys(row["command"] for rows in contents.values() for row in rows)
    content = result | rd.summary(contents, clips, None, _is_odd(result)) | {"command": "`, `".join(commands)}
    above = {rd.title(clip): "\n".join([*_image_links(files), ""]) for clip, files in pictures.items()}
    return f"{head}\n{missing or (PICTURES if pictures else '')}\n\n{as_text(content, above)}\n"


def _image_links(files: list[Path]) -> list[str]:
    return [f"![{file.stem}]({file.name})\n" for file in files]
