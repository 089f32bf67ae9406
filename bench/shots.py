"""Screenshots of the viewer's page, as people see it: at the sizes of a desk and of a phone, light and dark; start,
playing, two levels under the split, the error as colours, a forest, loading over a slow line, and each thing that can
be wrong with a file.

Drawing is in software, by Chromium; the pictures are WebP.
"""

from __future__ import annotations

import argparse
import io
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import athcodec
from bench.browser import chromium
from bench.tables import table
from bench.throttled_server import ThrottledServer

SIZES = [(1440, 900), (390, 844)]
SCHEMES = ["light", "dark"]
PHONE = 680  # pixels; as in viewer.css
SLOW = 125_000  # bytes a second
LOADED = 0.3  # share of the file that has come where it is loading
QUALITY = 80
PLANTS = 300  # of the forest
TIMEOUT = 120_000  # ms
WHOLE = "athcodecViewer.counters.arrived.whole && athcodecViewer.motion.level === athcodecViewer.motion.target"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, nargs="?", help="the .ath file (default: the leafed sample)")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument(
        "--only", nargs="+", choices=[*SHOTS, *WRONG], metavar="SHOT", help=f"of {', '.join([*SHOTS, *WRONG])}"
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    from PIL import Image

    data = (args.file or athcodec.sample_path("leafed")).read_bytes()
    args.out.mkdir(parents=True, exist_ok=True)
    rows = []
    with chromium() as browser:
        for size in SIZES:
            for scheme in SCHEMES:
                for name in args.only or [*SHOTS, *WRONG]:
                    path = args.out / f"{name}_{size[0]}x{size[1]}_{scheme}.webp"
                    with _page(browser, size, scheme) as page:
                        picture = _wrong(page, data, name) if name in WRONG else _shot(page, data, name)
                    Image.open(io.BytesIO(picture)).save(path, quality=QUALITY)
                    rows.append({"picture": path.name, "bytes": path.stat().st_size})
    total = sum(row["bytes"] for row in rows)
    return {"tables": [table(f"Pictures in {args.out}, {total:,} bytes", rows)], "broken": []}


@contextmanager
def _page(browser, size: tuple[int, int], scheme: str) -> Iterator:
    page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)
    page.set_default_timeout(TIMEOUT)
    try:
        yield page
    finally:
        page.close()


class _Held(ThrottledServer):
    """A line that stops after a share of its file, so that what is loading stays so while it is drawn."""

    def wait(self, size: int) -> None:
        super().wait(size)
        if self.sent("tree.ath") > LOADED * len(self.files["tree.ath"]):
            threading.Event().wait()


def _shot(page, data: bytes, name: str) -> bytes:
    server = _Held if name == "loading" else ThrottledServer
    with server({"tree.ath": data}, rate=SLOW if name == "loading" else None) as line:
        page.goto(line.page("tree.ath", quality="full"))
        if name != "loading":
            page.wait_for_function(f"() => {WHOLE}")
        SHOTS[name](page)
        return page.screenshot(timeout=TIMEOUT)


def _settled(page, seconds: float) -> None:
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.evaluate(f"athcodecViewer.seek({seconds})")
    page.wait_for_timeout(1500)


def _playing(page) -> None:
    page.evaluate("athcodecViewer.playClip(athcodecViewer.motion.clips.length - 1)")
    page.wait_for_function("() => !athcodecViewer.motion.switching && athcodecViewer.motion.complete")
    page.wait_for_timeout(1500)


def _split(page) -> None:
    page.keyboard.press("d")
    _settled(page, 1)


def _error(page) -> None:
    page.evaluate("athcodecViewer.setLevel('3')")
    page.evaluate("document.querySelector('#colour [data-value=distance]').click()")
    _settled(page, 1)


def _forest(page) -> None:
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.evaluate(f"athcodecViewer.forestOf({PLANTS})")
    page.wait_for_function("() => athcodecViewer.state.forest.baked.length === athcodecViewer.motion.levelCount")
    page.wait_for_timeout(3000)


def _settings(page) -> None:
    if page.viewport_size["width"] <= PHONE:
        page.click("#toggle-panel")
    _settled(page, 0)


SHOTS: dict[str, Callable] = {
    "start": lambda page: _settled(page, 0),
    "settings": _settings,
    "playing": _playing,
    "split": _split,
    "error": _error,
    "forest": _forest,
    "loading": lambda page: page.wait_for_function("() => athcodecViewer.counters.firstMotion"),
}


def _flipped(data: bytes, at: int) -> bytes:
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


WRONG: dict[str, Callable[[bytes], bytes | None]] = {
    "no-ath-file": lambda data: b"<!doctype html>" + data[15:],
    "cut-off": lambda data: data[:40],
    "damaged": lambda data: _flipped(data, 900),
    "partly-damaged": lambda data: _flipped(data, int(0.3 * len(data))),
    "incomplete": lambda data: data[: int(0.4 * len(data))],
    "not-found": lambda data: None,
}


def _wrong(page, data: bytes, name: str) -> bytes:
    broken = WRONG[name](data)
    with ThrottledServer({} if broken is None else {"tree.ath": broken}) as line:
        page.goto(line.page("tree.ath", quality="full"))
        page.wait_for_selector("#message:not([hidden]), #trouble:not([hidden])")
        page.wait_for_timeout(1500)
        return page.screenshot(timeout=TIMEOUT)
