"""How a run of a batch is followed: a live table on a terminal, plain lines elsewhere, or nothing."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from athcodec.batch.inputs import Item
from athcodec.files.shown import shown

ROWS = 20  # Rows that the live table shows.
ENDED = ("done", "failed", "kept")


class Show:
    """Receiver of a run's reports; this base class shows nothing. Another thread calls `stage` than the others."""

    def begin(self, items: Sequence[Item], kept: int) -> None:
        """Before the first clip; the files of `kept` further ones are up to date."""

    def stage(self, output: str, stage: str, fraction: float) -> None:
        """How far the clip of an output is: the stage, and the fraction of it that is done."""

    def finished(self, item: Item, record: dict[str, Any]) -> None:
        """A clip that is done or has failed, and its record in the manifest."""

    def kept(self, item: Item) -> None:
        """A clip whose file has turned out to be up to date."""

    def end(self) -> None:
        """After the last clip, or an interruption."""


class Lines(Show):
    """A line per clip on stderr."""

    def begin(self, items: Sequence[Item], kept: int) -> None:
        self.count, self.total = 0, len(items)
        if kept:
            self._print(f"{kept} kept, {self.total} to do")

    def finished(self, item: Item, record: dict[str, Any]) -> None:
        self.count += 1
        self._print(f"[{self.count}/{self.total}] {item.name}: {_said(record)}")

    def kept(self, item: Item) -> None:
        self.count += 1
        self._print(f"[{self.count}/{self.total}] {item.name}: kept")

    def _print(self, line: str) -> None:
        print(shown(line), file=sys.stderr, flush=True)


class LiveTable(Show):
    """A table on a terminal: the clips that are worked on, and the last that are not any more."""

    def begin(self, items: Sequence[Item], kept: int) -> None:
        self.names = {item.output: item.name for item in items}
        self.rows: dict[str, tuple[str, str]] = {}  # state and figures by output
        self.counts, self.total = {"done": 0, "failed": 0, "kept": kept}, len(items)
        self.bytes, self.start = 0, time.monotonic()
        self.lock = threading.Lock()
        self.live = Live(get_renderable=self._table, console=Console(stderr=True), refresh_per_second=4, transient=True)
        self.live.start()

    def stage(self, output: str, stage: str, fraction: float) -> None:
        with self.lock:
            if self.rows.get(output, ("", ""))[0] not in ENDED:
                self.rows[output] = stage, f"{fraction:.0%}"

    def finished(self, item: Item, record: dict[str, Any]) -> None:
        with self.lock:
            self.counts[record["status"]] += 1
            self.bytes += record.get("bytes", 0)
            self._ended(item.output, record["status"], _figures(record))

    def kept(self, item: Item) -> None:
        with self.lock:
            self.counts["kept"] += 1
            self._ended(item.output, "kept", "")

    def end(self) -> None:
        if hasattr(self, "live"):
            self.live.stop()

    def _ended(self, output: str, state: str, said: str) -> None:
        self.rows.pop(output, None)
        ended = [row for row, (before, _) in self.rows.items() if before in ENDED]
        for row in ended[: max(0, len(ended) - ROWS // 2)]:
            del self.rows[row]
        self.rows[output] = state, said

    def _table(self) -> Group:
        with self.lock:
            rows, counts = sorted(self.rows.items(), key=lambda row: row[1][0] in ENDED), dict(self.counts)
        ended = counts["done"] + counts["failed"]
        head = (
            f"{ended} of {self.total}: {counts['done']} done, {counts['failed']} failed, {counts['kept']} kept, "
            f"{self.bytes:,} bytes, {time.monotonic() - self.start:.0f} s"
        )
        table = Table(box=SIMPLE_HEAD, pad_edge=False, expand=True)
        table.add_column("clip", no_wrap=True, ratio=2)
        table.add_column("state", no_wrap=True, min_width=8)
        table.add_column("", no_wrap=True, ratio=3)
        for output, (state, figures) in rows[:ROWS]:
            table.add_row(*(Text(shown(cell)) for cell in (self.names.get(output, output), state, figures)))
        return Group(Text(head), table if rows else Text("starting workers" if not ended else ""))


def show_of_terminal() -> Show:
    """The table where stderr is a terminal, else lines."""
    return LiveTable() if sys.stderr.isatty() else Lines()


def _said(record: dict[str, Any]) -> str:
    return f"failed: {_figures(record)}" if record["status"] == "failed" else _figures(record)


def _figures(record: dict[str, Any]) -> str:
    if record["status"] == "failed":
        return record["reason"]
    return f"{record['bytes']:,} bytes, {record['raw_bytes'] / record['bytes']:.1f} to 1"
