"""The command `python -m bench`: arguments, printing, JSON.

Exit code 1 where a promise of a file was found broken. What is measured, and how, is known to the verbs' own
modules.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from bench import decode, levels, memory, picture, report, sizes, speed

VERBS = {"sizes": sizes, "levels": levels, "speed": speed, "memory": memory, "decode": decode,
         "picture": picture}


def main(argv: Sequence[str]) -> int:
    args = _parser().parse_args(argv)
    result = report.environment(argv) | VERBS[args.verb].run(args)
    print(report.as_text(result))
    if args.json:
        args.json.write_text(json.dumps(result, indent=1) + "\n")
    return 1 if result["broken"] else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m bench", description="Measures athcodec on motion clips.")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, module in VERBS.items():
        first_line = module.__doc__.splitlines()[0]
        verb = verbs.add_parser(name, help=first_line, description=first_line)
        module.add_arguments(verb)
        verb.add_argument("--json", type=Path, metavar="FILE", help="write the unrounded figures to FILE too")
    return parser


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
