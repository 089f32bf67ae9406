"""A moving picture of the viewer's stage, as WebP: the leafed sample in its strongest wind, one loop of it.

Drawing is in software, by Chromium, at full quality.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import Any

import athcodec
from bench.browser import chromium
from bench.tables import table
from bench.throttled_server import ThrottledServer

SIZE = 760, 460
FRAMES, LOOP_SECONDS = 60, 5.0  # Frames of the picture; the loop plays in its own time.
QUALITY = 58
TIMEOUT = 120_000  # ms
ALONE = """() => {
    for (const part of document.body.children) part.hidden = part.id !== "stage";
    document.body.classList.add("no-panel");
}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, nargs="?", help="the .ath file (default: the leafed sample)")
    parser.add_argument("--out", type=Path, default=Path("bench/results/moving.webp"), metavar="FILE")


def run(args: argparse.Namespace) -> dict[str, Any]:
    from PIL import Image

    data = (args.file or athcodec.sample_path("leafed")).read_bytes()
    with chromium() as browser, ThrottledServer({"tree.ath": data}) as line:
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.set_default_timeout(TIMEOUT)
        page.goto(line.page("tree.ath", quality="full"))
        page.wait_for_function("() => athcodecViewer.motion?.complete")
        page.evaluate(ALONE)
        page.evaluate("athcodecViewer.playClip(athcodecViewer.motion.clips.length - 1)")
        page.wait_for_function("() => !athcodecViewer.motion.switching && athcodecViewer.motion.complete")
        page.evaluate("athcodecViewer.stage.fit(); athcodecViewer.frameView()")
        pictures = [Image.open(io.BytesIO(_picture(page, i * LOOP_SECONDS / FRAMES))) for i in range(FRAMES)]
    first, *others = pictures
    milliseconds = round(1000 * LOOP_SECONDS / FRAMES)
    first.save(args.out, save_all=True, append_images=others, duration=milliseconds, loop=0, quality=QUALITY, method=6)
    row = {"picture": args.out.name, "frames": FRAMES, "bytes": args.out.stat().st_size}
    return {"tables": [table("Moving picture", [row])], "broken": []}


def _picture(page, seconds: float) -> bytes:
    page.evaluate(
        """async (seconds) => {
            await athcodecViewer.shown(seconds);
            await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        }""",
        seconds,
    )
    return page.screenshot(timeout=TIMEOUT)
