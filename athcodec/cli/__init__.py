"""The command `athcodec`: verbs.py does what arguments.py understands; clips.py opens the files, printing.py shows.

The words themselves import nothing heavy; what a verb works with is imported when it runs.

Results go to stdout, as a table or with --json as one JSON object; messages and progress go to stderr,
progress only where that is a terminal. Exit codes: 0 done, 1 an error or a failed check, 2 wrong usage,
130 interrupted. An error is one line; its traceback comes with --debug. How a clip is coded is not known here
(encoder.py, decoder.py), nor what an error measure is (metrics.py).
"""

from __future__ import annotations

import argparse
import logging
import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import TextIO

from athcodec.cli.arguments import make_parser
from athcodec.files.shown import shown

INTERRUPTED, BROKEN_PIPE, TERMINATED = 130, 141, 143
"""Exit codes: 128 and the number of the signal, as shells have it."""
OUTCOMES = {"batch": "; the same command goes on from here", "view": "", "demo": ""}
"""What an interrupted verb leaves, of those that do not write all they write at their end."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line `argv`, by default that of this process, and return its exit code: 0 if it succeeded.

    Raises SystemExit: code 2 for wrong usage, 0 after --help and --version, 143 on SIGTERM.
    """
    try:
        return _run(make_parser().parse_args(argv))
    except BrokenPipeError:
        # Whoever read stdout has left. What is still buffered goes nowhere, or Python complains at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE


def _run(args: argparse.Namespace) -> int:
    """Run the verb that `args` name and return its exit code. Raise BrokenPipeError if stdout has lost its reader."""
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file name need not be valid text
    try:
        with _termination_unwinds(), _messages_escaped():
            code = getattr(import_module("athcodec.cli.verbs"), args.verb)(args)
            sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        print(f"athcodec: interrupted{OUTCOMES.get(args.verb, ', nothing written')}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        raise
    except Exception as error:
        if args.debug:
            print(shown(traceback.format_exc()), file=sys.stderr)
        from athcodec.cli.printing import one_line, say

        say("error", one_line(error))
        return 1


@contextmanager
def _messages_escaped() -> Iterator[None]:
    """Print warnings, and what libraries log, on stderr as the command line prints its own messages, with control
    characters escaped."""

    def warned(message: Warning | str, *_: object) -> None:
        print(f"athcodec: warning: {shown(str(message))}".replace("\n", " "), file=sys.stderr)

    before, logged = warnings.showwarning, logging.lastResort
    warnings.showwarning, logging.lastResort = warned, _Escaping(sys.stderr)  # type: ignore[assignment]
    logging.lastResort.setLevel(logging.WARNING)
    try:
        yield
    finally:
        warnings.showwarning, logging.lastResort = before, logged


class _Escaping(logging.StreamHandler[TextIO]):
    def format(self, record: logging.LogRecord) -> str:
        return shown(super().format(record))


@contextmanager
def _termination_unwinds() -> Iterator[None]:
    """Turn the signal SIGTERM into SystemExit while the block runs, so that unfinished files are removed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(TERMINATED))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
