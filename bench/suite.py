"""The clips of a run: files given on the command line, clips of data.py by name, or a whole suite of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from bench import data
from bench.foreign import MissingProgram

SUITES = tuple(data.SUITES)


@dataclass(frozen=True)
class Case:
    """A clip that takes part: its name in results, its file (None: it cannot be made), and what it is."""

    name: str
    path: Path | None
    description: str = ""


def cases(words: Iterable[str], suite: str) -> list[Case]:
    """Return the clips named, or those of the suite. Raises SystemExit for an unknown name."""
    return [_case(word) for word in list(words) or data.SUITES[suite]]


def _case(word: str) -> Case:
    """Return the case of a word: the file at that path, or else the clip of that name, which is made if it does not
    exist yet.
    """
    if Path(word).is_file():
        return Case(Path(word).stem, Path(word), "given on the command line")
    if word not in (data.SAMPLE, *data.RECIPES):
        names = ", ".join([data.SAMPLE, *data.RECIPES])
        raise SystemExit(f"clip: got {word!r}; expected a file or one of {names}")
    try:
        return Case(word, Path(data.path_of(word)), data.describe(word))
    except MissingProgram as error:
        return Case(word, None, f"{data.describe(word)}: MISSING: {error}")
