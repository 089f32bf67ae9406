"""The fuzz targets of tests/fuzz, each for an equal part of the time, and the decoder's lines covered by their inputs.

C targets run under AddressSanitizer and UndefinedBehaviorSanitizer with libFuzzer, from a corpus that grows with every
run; the readers of other formats are in Python. Without clang, every seed is tried once.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from spec.robust import Row

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests"))

from fuzz import cli, coverage, targets  # noqa: E402

LEAST_COVERAGE = 0.95
HOURS = targets.BUILD / "hours.json"
COUNTS = {"crash": "crashes", "hang": "hangs", "over_limit": "over_limit", "wrong": "wrong"}


def run(budget: float) -> list[Row]:
    """Run each fuzz target for an equal part of `budget` seconds, and return the counts as rows, the last of which is
    the coverage.
    """
    fuzzer = targets.compiler().fuzzer
    rows, seconds = [], budget / len(cli.ALL)
    for target in cli.ALL:
        outcome = cli.fuzz(target, seconds)
        if fuzzer or target.startswith(cli.SOURCES):
            _add_hours(target, seconds / 3600)
        counted = {COUNTS[outcome.kind]: 1} if outcome.kind else {}
        rows.append(Row(target, outcome.tried, **counted, note=_note(outcome, fuzzer)))
    return [*rows, _coverage_row()]


def _note(outcome: targets.Outcome, fuzzer: bool) -> str:
    if outcome.kind:
        return f"kept {outcome.artifact}" if outcome.artifact else _failure(outcome.log.strip().splitlines()[0])
    if outcome.target.startswith(cli.SOURCES):
        return "files read"
    return f"{outcome.edges:,} edges" if fuzzer else targets.NO_FUZZER


def _failure(line: str) -> str:
    """Return the end of what a reader's process says of its failure, without the input that made it fail."""
    try:
        return json.loads(line)["failure"].strip().splitlines()[-1]
    except (ValueError, LookupError, TypeError):
        return line[:200]


def _coverage_row() -> Row:
    """Return a row on how many lines of the decoder the inputs of the fuzz targets reach; it is wrong if they are fewer
    than LEAST_COVERAGE.
    """
    files = coverage.measure()
    if files is None:
        return Row("lines of the decoder", 0, note=coverage.NO_CLANG)
    whole = coverage.total(files)
    return Row(
        "lines of the decoder",
        whole.lines,
        wrong=int(whole.share < LEAST_COVERAGE),
        note=f"{100 * whole.share:.1f} % reached, {100 * LEAST_COVERAGE:.0f} % wanted",
    )


# ---- hours ----


def _hours() -> dict[str, float]:
    return json.loads(HOURS.read_text()) if HOURS.exists() else {}


def _add_hours(target: str, hours: float) -> None:
    HOURS.parent.mkdir(parents=True, exist_ok=True)
    HOURS.write_text(json.dumps(_hours() | {target: _hours().get(target, 0.0) + hours}))


def figures() -> dict[str, str]:
    hours = ", ".join(f"{target} {hours:.2f}" for target, hours in _hours().items())
    return {"hours with this corpus": hours or "none"}
