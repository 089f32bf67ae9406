"""The command `python -m spec.tiers TIER ...`: runs tiers of the tests file by file, each to its end or to a limit of
time, and writes what came of them to spec/tiers.md and spec/tiers.json.

A file that does not end is stopped and named with the test it was in, and the others still run. Exit code 1 if a test
failed or a file was stopped. Results of tiers, and with --file of files, that a run leaves out stay in the report.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path

from bench.tables import commit

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
CODE = ("athcodec", "bench", "spec", "tests", ":!spec/robustness.*", ":!spec/tiers.*", ":!bench/results")
DEFAULT = "first"  # The tier that runs without -m.
COUNTS = ("passed", "failed", "error", "skipped")
ENDING = 60.0  # Seconds that a stopped file has to clean up.
RUNNING = re.compile(
    r"^(tests/\S+::(?:(?! (?:PASSED|FAILED|ERROR|SKIPPED|XFAIL)).)*?) *$", re.MULTILINE
)  # A test without an outcome.
NOT_PASSED = re.compile(r"^(?:FAILED|ERROR) (\S+::.*?)(?: - .*)?$", re.MULTILINE)


def tiers() -> list[str]:
    """Return the names of all tiers, in their order."""
    options = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["pytest"]["ini_options"]
    return [DEFAULT, *(marker.partition(":")[0] for marker in options["markers"])]


def selection(tier: str) -> list[str]:
    return [] if tier == DEFAULT else ["-m", tier]


def files_of(tier: str) -> list[str]:
    """Return the files that have tests of a tier."""
    command = [sys.executable, "-m", "pytest", "-q", "-n0", "--collect-only", *selection(tier)]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    if listed.returncode:
        sys.exit(f"{tier}: tests cannot be collected\n{listed.stdout[-2000:]}{listed.stderr[-2000:]}")
    return list(dict.fromkeys(re.findall(r"^(tests/\S+?)::", listed.stdout, re.MULTILINE)))


def run_file(tier: str, file: str, limit: float) -> dict:
    """Return what came of the tests of one file. Those that it started end with it."""
    command = [sys.executable, "-m", "pytest", "-v", "-n0", *selection(tier), file]
    start, is_stopped = time.monotonic(), False
    machine = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}, {os.cpu_count()} cores"
    result = {"commit": commit(CODE), "date": datetime.date.today().isoformat(), "machine": machine}
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    ) as process:
        try:
            printed, _ = process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            is_stopped = True
            process.send_signal(signal.SIGINT)  # Then pytest reports what it has run.
            try:
                printed, _ = process.communicate(timeout=ENDING)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                printed, _ = process.communicate()
    summary = printed.rstrip().splitlines()[-1] if printed.strip() else ""
    for name in COUNTS:
        found = re.search(rf"(\d+) {name}", summary)
        result[name] = int(found[1]) if found else 0
    result["not_passed"] = NOT_PASSED.findall(printed)
    result["stopped_in"] = _running(printed) if is_stopped else ""
    if not is_stopped and process.returncode and not result["not_passed"]:
        result["not_passed"] = [f"{file}: exit code {process.returncode}"]
    result["seconds"] = round(time.monotonic() - start)
    return result


def _running(printed: str) -> str:
    """Return the test that had not ended."""
    return (RUNNING.findall(printed) or ["a fixture or an import"])[-1]


def as_markdown(results: dict[str, dict]) -> str:
    lines = [
        "# Tiers of the tests",
        "",
        "Written by `python -m spec.tiers`, which runs each file of a tier to its end, or stops it at a limit of time.",
        "All tiers are run again before each release, on its code. *stopped* counts files that did not end.",
        "",
        "| tier | files | passed | failed | errors | skipped | stopped | seconds | dates | commits |",
        "|---|--:|--:|--:|--:|--:|--:|--:|---|---|",
    ]
    names = [name for name in tiers() if name in results]
    for name in names:
        files = results[name]["files"].values()
        ran = f"{len(files)} of {results[name]['of']}"
        counts = " | ".join(f"{sum(each[count] for each in files):,}" for count in COUNTS)
        stopped = sum(bool(each["stopped_in"]) for each in files)
        dates = sorted({each["date"] for each in files})
        shown = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
        of = ", ".join(sorted({each["commit"] for each in files}))
        seconds = sum(each["seconds"] for each in files)
        lines.append(f"| {name} | {ran} | {counts} | {stopped} | {seconds:,} | {shown} | {of} |")
    left = [
        f"* {name}: `{test}`"
        for name in names
        for each in results[name]["files"].values()
        for test in each["not_passed"]
    ] + [
        f"* {name}: stopped in `{each['stopped_in']}`"
        for name in names
        for each in results[name]["files"].values()
        if each["stopped_in"]
    ]
    lines += ["", "What did not pass:" if left else "Everything passed.", *([""] if left else []), *left, ""]
    machines = "; ".join(sorted({each["machine"] for name in names for each in results[name]["files"].values()}))
    return "\n".join([*lines, f"Seconds are those of the clock, beside other work, on {machines}.", ""])


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m spec.tiers", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("tiers", nargs="+", choices=tiers(), metavar="TIER", help=f"of {', '.join(tiers())}")
    parser.add_argument("--file", action="append", help="run this file of tests alone; may be repeated")
    parser.add_argument("--limit", type=float, default=3600.0, help="seconds for each file (default: 3600)")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of tiers.md and tiers.json")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    stored = args.out / "tiers.json"
    results = json.loads(stored.read_text()) if stored.exists() else {}
    failed = False
    for tier in args.tiers:
        files = files_of(tier)
        kept = results.get(tier, {"files": {}})["files"].items()
        results[tier] = {"of": len(files), "files": {file: result for file, result in kept if file in files}}
        for file in args.file or files:
            result = run_file(tier, file, args.limit)
            results[tier]["files"][file] = result
            failed |= bool(result["not_passed"] or result["stopped_in"])
            counts = ", ".join(f"{result[name]} {name}" for name in COUNTS if result[name])
            ended = f"stopped in {result['stopped_in']}" if result["stopped_in"] else "ended"
            print(f"{tier} {file}: {counts or 'nothing run'}; {ended} after {result['seconds']} s", flush=True)
            for test in result["not_passed"]:
                print(f"  {test}", flush=True)
            # A run that is interrupted leaves what came of its files.
            stored.write_text(json.dumps(results, indent=1) + "\n")
            (args.out / "tiers.md").write_text(as_markdown(results))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
