"""What `python -m spec.robustness` runs: one module per class of runs, each with `run(budget) -> list[Row]`.

budget: seconds that the class may take. A module may also have `figures() -> dict[str, str]`, lines that the report
prints under its rows. Nothing here knows how a class finds out what it counts.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Row:
    """One line of the report: how many inputs were tried, and how many of them went wrong in which way."""

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
