"""The command `python -m bench`: arguments, printing, JSON.

Exit code 1 where a file did not keep what it promises. What is measured, and how, is known to the verbs' own
modules.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from bench import tables

_NAMES = (
    "data rd report sample sizes features effort constants levels structure pairs split branches",
    "progressive speed memory decode picture viewer gallery wrappings onto engines",
)
VERBS = {name: import_module(f"bench.{name}") for name in " ".join(_NAMES).split()}


def main(argv: Sequence[str]) -> int:
    """Run one verb of `python -m bench`, print its tables and write its figures as JSON if asked to. Return the exit
    status: 1 if the verb reports a broken promise, such as an error above its bound, else 0.
    """
    args = parser().parse_args(argv)
    args.argv = list(argv)
    result = tables.environment(argv) | VERBS[args.verb].run(args)
    print(tables.as_text(result))
    if args.json:
        tables.write_json(result, args.json)
    return 1 if result["broken"] else 0


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line, with a subcommand for each verb and the verb's own arguments."""
    top = argparse.ArgumentParser(prog="python -m bench", description="Measures athcodec on motion clips.")
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, module in VERBS.items():
        first_line = module.__doc__.splitlines()[0]
        verb = verbs.add_parser(name, help=first_line, description=first_line)
        module.add_arguments(verb)
        verb.add_argument("--json", type=Path, metavar="FILE", help="write the unrounded figures to FILE too")
    return top


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
