"""A picture of the viewer: two levels of a file with layers of precision under the split, coloured by their distance
from the deepest one. The page in it says the bound of the file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from athcodec.options import LADDERS
from athcodec.viewer.picture import chromium
from bench.clips import add_clips, add_rel_error, encoded
from bench.tables import table
from bench.throttled_server import ThrottledServer

COMPLETE = "() => athcodecViewer.motion?.complete && athcodecViewer.counters.firstMotion"
COMPARE = """([left, right, seconds]) => {
  const press = (group, value) => document.querySelector(`#${group} [data-value="${value}"]`).click();
  athcodecViewer.setPlaying(false);
  press("compare", "levels");
  press("colour", "error");
  athcodecViewer.setLevel(String(right));
  athcodecViewer.setLeft(left);
  athcodecViewer.seek(seconds);
}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    parser.add_argument("--out", type=Path, default=Path("bench/results/viewer.png"), metavar="FILE.png")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Take a screenshot of the viewer that compares two levels of one clip's file, and return a table that names it."""
    [clip] = args.clips
    with encoded(clip, args.rel_error, ladder=LADDERS["decades"]) as result, chromium() as browser:
        data, right = result.summary.path.read_bytes(), result.decoder.file.deepest - 1
        with ThrottledServer({clip.with_suffix(".ath").name: data}) as server:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(server.page(clip.with_suffix(".ath").name))
            page.wait_for_function(COMPLETE)
            page.evaluate(COMPARE, [right - 1, right, result.decoder.time[-1] / 2])
            page.wait_for_function(f"() => athcodecViewer.motion.level === {right}")
            page.wait_for_timeout(3000)
            page.screenshot(path=args.out)
    return {"tables": [table("picture", [{"clip": clip.stem, "file": args.out.name}])], "broken": []}
