"""The command `python -m spec.robustness`: runs every class of hostile input and fault, and writes the results to
spec/robustness.md and spec/robustness.json.

Exit code 1 if anything crashed, hung, took more memory than its limits or gave a wrong result. The modules of
spec/robust define what is tried and how faults are detected. Results of classes that a run leaves out stay in the
report.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import platform
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from bench.store import commits
from bench.tables import commit
from spec import robust
from spec.robust import Row

HERE = Path(__file__).resolve().parent
CODE = ("athcodec", "spec", "tests", ":!spec/robustness.*")  # Paths whose uncommitted changes a result is marked with.
COUNTS = ("tried", "crashes", "hangs", "over_limit", "wrong")


def classes() -> list[str]:
    """Return names of the modules of spec/robust that can be run."""
    return sorted(module.name for module in pkgutil.iter_modules(robust.__path__) if not module.name.startswith("_"))


def run_class(name: str, seconds: float) -> dict:
    """Run one class of tests for about `seconds` and return its record: the counts, figures, commit and machine."""
    tested = commit(CODE)  # Before the run, which may take hours.
    module = importlib.import_module(f"spec.robust.{name}")
    start = time.perf_counter()
    rows = [asdict(row) for row in module.run(seconds)]
    figures = module.figures() if hasattr(module, "figures") else {}
    return {
        "about": " ".join((module.__doc__ or "").split("\n\n")[0].split()),
        "rows": rows,
        "figures": figures,
        "seconds": round(time.perf_counter() - start, 1),
        "budget": seconds,
        "commit": tested,
        "machine": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
    }


def as_markdown(results: dict[str, dict]) -> str:
    """Return the records of all classes as the text of the document robustness.md."""
    lines = [
        "# Robustness",
        "",
        "Written by `python -m spec.robustness`. *over limit*: took more memory or work than its limits allow; "
        "*wrong*: neither refused nor",
        "decoded as it should be. A section describes the commit under it, in brackets if that only stored it; all",
        "sections are run again before each release.",
        "",
    ]
    for name, result in sorted(results.items()):
        lines += [f"## {name}", "", result["about"], ""]
        lines += ["| class | tried | crashes | hangs | over limit | wrong | |", "|---|---|---|---|---|---|---|"]
        for row in result["rows"]:
            counts = " | ".join(f"{row[count]:,}" for count in COUNTS)
            lines.append(f"| {row['name']} | {counts} | {row['note']} |")
        lines += ["", *(f"* {key}: {value}" for key, value in result["figures"].items())]
        lines += ["", f"{result['seconds']:.0f} s, commit {commits([result])}, {result['machine']}.", ""]
    return "\n".join(lines)


def arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m spec.robustness", description=__doc__.split("\n\n")[0])
    parser.add_argument("--only", action="append", choices=classes(), help="run this class alone; may be repeated")
    parser.add_argument("--seconds", type=float, default=60.0, help="budget of each class (default: 60)")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of robustness.md and robustness.json")
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the chosen classes of tests, and store their records and the document. Return the exit status: 1 if there are
    faults.
    """
    args = arguments(argv)
    record = args.out / "robustness.json"
    args.out.mkdir(parents=True, exist_ok=True)  # before minutes of work
    results = json.loads(record.read_text()) if record.exists() else {}
    faults = 0
    for name in args.only or classes():
        results[name] = run_class(name, args.seconds)
        rows = [Row(**row) for row in results[name]["rows"]]
        faults += sum(row.faults for row in rows)
        for row in rows:
            print(f"{name}: {row.name}: {row.tried} tried, {row.faults} faults {row.note}".rstrip(), flush=True)
    record.write_text(json.dumps(results, indent=1) + "\n")
    (args.out / "robustness.md").write_text(as_markdown(results))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
