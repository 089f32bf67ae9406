"""The command `python -m tests.fuzz`: fuzzes each target for a time, or prints what the corpus covers.

Exit code 1 where a target went wrong; the input that did it is kept beside the corpus and named.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from fuzz import coverage, seeds, sources, targets
from fuzz.targets import BUILD, Outcome

SOURCES = "sources"
ALL = (*targets.TARGETS, *(f"{SOURCES}-{kind}" for kind in sources.KINDS))
GRACE = 300


def fuzz(
    target: str, seconds: float, corpus: Path = BUILD / "corpus", sanitizer: str = "address", seed: int = 0
) -> Outcome:
    """One target for some time. Raises BuildError."""
    if target.startswith(SOURCES):
        return read_sources(target.removeprefix(f"{SOURCES}-"), seconds, seed)
    used = targets.compiler()
    program = targets.build(target, used, sanitizer)
    if used.fuzzer:
        return targets.fuzz(target, program, seconds, corpus / target, BUILD / "finds", seed=seed)
    start = BUILD / "seeds" / target
    seeds.write_inputs(target, start)
    return targets.replay(target, program, sorted(start.iterdir()))


def read_sources(kind: str, seconds: float, seed: int) -> Outcome:
    """The readers of a format, in a process of their own."""
    number = seed or time.time_ns() % 10**9
    command = [sys.executable, "-m", "fuzz.sources", kind, str(seconds), str(number)]
    path, target = {"PYTHONPATH": str(targets.HERE.parent)}, f"{SOURCES}-{kind}"
    try:
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ | path, timeout=seconds + GRACE)
    except subprocess.TimeoutExpired as late:
        return Outcome(target, 0, "hang", f"no end {GRACE} s after its time: {late}")
    log = done.stdout + done.stderr
    tried = re.findall(r'"tried": (\d+)', log)
    return Outcome(target, int(tried[-1]) if tried else 0, "wrong" if done.returncode else "", log, seconds=seconds)


def arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__.split("\n\n")[0])
    parser.add_argument("--seconds", type=float, default=30.0, help="of each target (default: 30)")
    parser.add_argument(
        "--target", action="append", choices=(*ALL, SOURCES), help=f"this one alone, or all {SOURCES}; may be repeated"
    )
    parser.add_argument(
        "--sanitizer",
        choices=[name for name in targets.SANITIZERS if name != "coverage"],
        default="address",
        help="address (with undefined), memory or none (default: address)",
    )
    parser.add_argument(
        "--corpus", type=Path, default=BUILD / "corpus", help="folder that grows (default: %(default)s)"
    )
    parser.add_argument("--coverage", action="store_true", help="print the lines of the decoder that are reached")
    parser.add_argument("--seed", type=int, default=0, help="0: another one each time")
    return parser.parse_args(argv)


def show(outcome: Outcome) -> None:
    found = f", {outcome.kind}" if outcome.kind else ""
    edges = f", {outcome.edges} edges" if outcome.edges else ""
    print(f"{outcome.target}: {outcome.tried} inputs{edges}{found}", flush=True)
    if outcome.kind:
        print(outcome.log[-6000:])
    if outcome.artifact:
        print(f"{outcome.target}: kept {outcome.artifact}")


def main(argv: Sequence[str] | None = None) -> int:
    args = arguments(argv)
    if args.coverage:
        files = coverage.measure(args.corpus)
        print(coverage.as_text(files) if files is not None else coverage.NO_CLANG)
        return 0
    outcomes = []
    wanted = args.target or ALL
    chosen = [target for target in ALL if target in wanted or SOURCES in wanted and target.startswith(SOURCES)]
    if any(not target.startswith(SOURCES) for target in chosen) and not targets.compiler().fuzzer:
        print(f"fuzz: {targets.NO_FUZZER}", flush=True)
    for target in chosen:
        outcomes.append(fuzz(target, args.seconds, args.corpus, args.sanitizer, args.seed))
        show(outcomes[-1])
    return 1 if any(outcome.kind for outcome in outcomes) else 0
