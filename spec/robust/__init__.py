"""The classes of `python -m spec.robustness`: one module per class, each with `run(budget) -> list[Row]`.

budget: seconds that the class may take. A module may also have `figures() -> dict[str, str]`, lines that the report
prints below its rows.
"""

from __future__ import annotations

import subprocess
from dataclasses import dataclass


@dataclass
class Row:
    """One line of the report: the number of inputs tried, and of faults by kind."""

    name: str
    tried: int
    crashes: int = 0
    hangs: int = 0
    over_limit: int = 0
    wrong: int = 0
    note: str = ""

    @property
    def faults(self) -> int:
        return self.crashes + self.hangs + self.over_limit + self.wrong


def ended(words: list, **options) -> subprocess.CompletedProcess:
    """Run a command to its end; what it prints is kept as text."""
    return subprocess.run(words, capture_output=True, text=True, **options)
