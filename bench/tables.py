"""Results as aligned Markdown tables, and the description of the machine.

A verb's result is a dictionary that JSON can hold: "tables", each {"title", "rows", "notes"} with rows as dictionaries
of unrounded figures by column, and "broken", one line for every bound or target that must hold and does not.
"""

from __future__ import annotations

import json
import os
import platform
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
CODE = ("athcodec", "bench", ":!bench/results")  # Paths whose uncommitted changes a result is marked with.
DISTRIBUTIONS = ("athcodec", "numpy", "h5py", "zstandard")
MISSING = "-"


def table(title: str, rows: list[dict[str, Any]], *notes: str) -> dict[str, Any]:
    """Return a table of a result; `notes` are printed below it, one paragraph each."""
    return {"title": title, "rows": rows, "notes": [" ".join(note.split()) for note in notes]}


def environment(argv: Sequence[str]) -> dict[str, Any]:
    """Return what a result depends on beside its input: the command, with paths reduced to their last part, the commit,
    the versions of packages, and the machine.
    """
    words = [Path(word).name if os.sep in word else word for word in argv]
    versions = {"python": platform.python_version()} | {name: version(name) for name in DISTRIBUTIONS}
    system = f"{platform.system()} {platform.machine()}"
    machine = {"cpu": cpu_model(), "cores": os.cpu_count(), "system": system}
    if hasattr(os, "getloadavg"):
        machine["load_before"] = round(os.getloadavg()[0], 2)
    command = shlex.join(["python", "-m", "bench", *words])
    return {"command": command, "commit": commit(), "versions": versions, "machine": machine}


@cache
def commit(code: tuple[str, ...] = CODE) -> str:
    """Return the hash of the clone's current commit, with a mark if files below the paths `code` have changed since, or
    "unknown" outside a clone.
    """

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()

    try:
        is_clone = not git("rev-parse", "--show-prefix")  # The folder may lie in the clone of another project.
        name, changes = git("rev-parse", "--short=8", "HEAD"), git("status", "--porcelain", "--", *code)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return name + (" + uncommitted changes" if changes else "") if is_clone else "unknown"


def cpu_model() -> str:
    """Return the name that the system gives the first processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or "unknown"


def write_json(result: dict[str, Any], file: Path) -> None:
    file.write_text(json.dumps(result, indent=1) + "\n")


def as_text(result: dict[str, Any]) -> str:
    """Return the result of a verb as text: its tables, the lines about broken promises, the commit and the machine.

    Notes that several tables have in common are printed below the first of them.
    """
    parts, printed = [], set()
    for part in result["tables"]:
        notes = [note for note in part["notes"] if note not in printed]
        printed.update(notes)
        parts.append(_table_text(part | {"notes": notes}))
    parts += [f"BROKEN: {line}" for line in result["broken"]]
    parts.append("; ".join([f"commit {result['commit']}", _pairs(result["machine"]), _pairs(result["versions"])]))
    return "\n\n".join([f"`{result['command']}`", *parts])


def _pairs(values: dict[str, Any]) -> str:
    return ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in values.items())


def _table_text(part: dict[str, Any]) -> str:
    return "\n".join([f"### {part['title']}", "", markdown(part["rows"]), *(f"\n{note}" for note in part["notes"])])


def markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a table in Markdown."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = [_column(name, [row.get(name) for row in rows]) for name in names]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in zip(*columns, strict=True))


def _column(name: str, values: list[Any]) -> list[str]:
    """Return header, rule and cells of one column, padded to one width; numbers are aligned to the right."""
    cells = [_cell(value) for value in values]
    width = max(3, *map(len, [name, *cells]))
    if all(isinstance(value, str) for value in values):
        return [name.ljust(width), "-" * width, *(cell.ljust(width) for cell in cells)]
    return [name.rjust(width), "-" * (width - 1) + ":", *(cell.rjust(width) for cell in cells)]


def _cell(value: Any) -> str:
    """Return a value as the text of a table's cell: rounded numbers, "yes" or "no", and a sign for missing values."""
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        return " ".join(str(int(item)) if isinstance(item, bool) else _cell(item) for item in value)
    return str(value)
