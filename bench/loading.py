"""How long the viewer's page takes to show that it loads, to have a first moving picture and to have all of a file, in
Chromium over slow lines.

The page's own files come at once, as from a cache; what is measured is the file. Drawing is in software, so what is
decoded and what is drawn are told apart.
"""

from __future__ import annotations

import argparse
import statistics
from pathlib import Path
from typing import Any

import athcodec
from bench.browser import chromium
from bench.clips import add_number
from bench.tables import table
from bench.throttled_server import ThrottledServer

MEGABIT = 125_000
TIMEOUT = 120_000  # ms
WHOLE = "() => athcodecViewer.counters.arrived.whole && athcodecViewer.counters.firstMotion"
TIMES = """() => {
  const { started, arrived, firstPicture, firstMotion } = athcodecViewer.counters;
  const seen = performance.getEntriesByName("first-contentful-paint")[0];
  return { seen: seen.startTime, page: started, first: arrived.first, picture: firstPicture.ms, motion: firstMotion.ms,
    whole: arrived.whole };
}"""

NOTE = """
Milliseconds, medians. Text: from the address until the page is painted, which says that it loads; page: until its
programs run and it asks for the file. From there on: until the first of the motion is decoded, by the worker's clock,
until it is drawn, until it has moved, and until all bytes that the clip needs have come.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, nargs="?", help="the .ath file (default: the leafed sample)")
    add_number(parser, "--line", (1.0, 10.0, 100.0), "megabits a second", "MBIT")
    add_number(parser, "--rounds", 5, "how often the page is opened")


def run(args: argparse.Namespace) -> dict[str, Any]:
    data = (args.file or athcodec.sample_path("leafed")).read_bytes()
    with chromium() as browser:
        _times(browser, data, max(args.line))  # the browser's own start
        rows = [_row(line, [_times(browser, data, line) for _ in range(args.rounds)]) for line in args.line]
    return {"tables": [table(f"Loading {len(data):,} bytes", rows, NOTE)], "broken": []}


def _times(browser, data: bytes, line: float) -> dict[str, float]:
    page = browser.new_page(viewport={"width": 960, "height": 600})
    page.set_default_timeout(TIMEOUT)
    with ThrottledServer({"tree.ath": data}, rate=line * MEGABIT) as server:
        page.goto(server.page("tree.ath"))
        page.wait_for_function(WHOLE)
        found = page.evaluate(TIMES)
    page.close()
    return found


def _row(line: float, rounds: list[dict[str, float]]) -> dict[str, Any]:
    median = {name: statistics.median(times[name] for times in rounds) for name in rounds[0]}
    return {
        "Mbit/s": line,
        "text": median["seen"],
        "page": median["page"],
        "decoded": median["first"],
        "drawn": median["picture"],
        "moved": median["motion"],
        "all here": median["whole"],
    }
