"""Classes of robustness runs: each module here has `run(budget)`, seconds in, rows of a table out. spec/robustness.py runs
them all and writes the table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Row:
    """What one kind of run came to: inputs tried, and how many of them ended as they must not."""

    name: str
    tried: int
    crashes: int = 0
    hangs: int = 0
    over_limit: int = 0
    wrong: int = 0
    note: str = ""
