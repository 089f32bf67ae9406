"""Screenshots of the viewer's page, as people see it: at the sizes of a desk and of a phone, light and dark; start,
playing, two levels under the split, the error as colours, a forest, loading over a slow line, and each thing that can
be wrong with a file.

Drawing is in software, by Chromium; the pictures are WebP. Each is written once it is drawn, and those that are there
are not drawn again, so that a run that was ended goes on where it was.
"""

from __future__ import annotations

import argparse
import io
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import athcodec
from bench.browser import chromium
from bench.tables import table
from bench.throttled_server import ThrottledServer

FOLDER = Path(__file__).parent / "results" / "shots"
SIZES = {"desk": (1440, 900), "phone": (390, 844)}
SCHEMES = ["light", "dark"]
SLOW = 125_000  # bytes a second
LOADED = 0.3  # share of the file that has come where it is loading
QUALITY = 80
FLOOR = {"fern": 4, "grass": 9}  # plants around each tree of the forest
TREES = 40
TIMEOUT = 300_000  # ms
WHOLE = """() => athcodecViewer.counters.arrived.whole && athcodecViewer.counters.firstPicture &&
  athcodecViewer.motion.level === athcodecViewer.motion.target"""
DRAWN = """async () => {
  const frame = () => new Promise((done) => { requestAnimationFrame(done); });
  athcodecViewer.state.dirty = true;
  for (let i = 0; i < 3; i++) await frame();
  await new Promise((done) => { setTimeout(done, 400); }); // after which all texts are up to date
  await frame();
}"""
PLANTED = """() => {
  const forests = athcodecViewer.forests();
  return forests.length === 3 && forests.slice(1).every(({ baked }) => baked.length > 2) &&
    forests[0].baked.length === athcodecViewer.motion.levelCount && !forests.some(({ fading }) => fading);
}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, nargs="?", help="the .ath file (default: the leafed sample)")
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="FOLDER")
    parser.add_argument(
        "--only", nargs="+", choices=[*SHOTS, *WRONG], metavar="SHOT", help=f"of {', '.join([*SHOTS, *WRONG])}"
    )
    parser.add_argument("--again", action="store_true", help="draw those that are there, too")


def run(args: argparse.Namespace) -> dict[str, Any]:
    data = (args.file or athcodec.sample_path("leafed")).read_bytes()
    names = args.only or [*SHOTS, *WRONG]
    args.out.mkdir(parents=True, exist_ok=True)
    with chromium() as browser:
        for size in SIZES:
            wanted = [
                name for name in names if args.again or not all(path.exists() for path in _paths(args.out, name, size))
            ]
            if size == "desk" and "settings" in wanted:
                wanted.remove("settings")  # they are open from the start
            _states(browser, data, size, [name for name in wanted if name in SHOTS and name != "loading"], args.out)
            for name in wanted:
                if name == "loading" or name in WRONG:
                    _alone(browser, data, size, name, args.out)
    rows = [{"picture": path.name, "bytes": path.stat().st_size} for path in sorted(args.out.glob("*.webp"))]
    total = sum(row["bytes"] for row in rows)
    return {"tables": [table(f"Pictures in {args.out}, {total:,} bytes", rows)], "broken": []}


def _paths(folder: Path, name: str, size: str) -> list[Path]:
    return [folder / f"{name}_{size}_{scheme}.webp" for scheme in SCHEMES]


@contextmanager
def _page(browser, size: str) -> Iterator:
    width, height = SIZES[size]
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(TIMEOUT)
    try:
        yield page
    finally:
        page.close()


def _save(page, name: str, size: str, folder: Path) -> None:
    """As it is now, in both schemes."""
    from PIL import Image

    for scheme, path in zip(SCHEMES, _paths(folder, name, size), strict=True):
        page.emulate_media(color_scheme=scheme)
        page.evaluate(DRAWN)
        Image.open(io.BytesIO(page.screenshot(timeout=TIMEOUT))).save(path, quality=QUALITY, method=6)
        print(path.name, file=sys.stderr, flush=True)
    page.emulate_media(color_scheme=SCHEMES[0])


def _states(browser, data: bytes, size: str, names: list[str], folder: Path) -> None:
    """All that one page shows in turn."""
    if not names:
        return
    floor = {f"{name}.ath": athcodec.sample_path(name).read_bytes() for name in FLOOR}
    with ThrottledServer({"tree.ath": data} | floor) as line, _page(browser, size) as page:
        grown = "".join(f"&floor=/{name}.ath&each={each}" for name, each in FLOOR.items())
        page.goto(line.page("tree.ath", quality="full") + grown)
        page.wait_for_function(WHOLE)
        for name in names:
            page.evaluate("athcodecViewer.setPlaying(false)")
            page.evaluate("athcodecViewer.seek(1)")
            with contextmanager(SHOTS[name])(page):
                _save(page, name, size, folder)


class _Held(ThrottledServer):
    """A line that stops after a share of its file, so that what is loading stays so while it is drawn."""

    def wait(self, size: int) -> None:
        super().wait(size)
        if self.sent("tree.ath") > LOADED * len(self.files["tree.ath"]):
            threading.Event().wait()


def _alone(browser, data: bytes, size: str, name: str, folder: Path) -> None:
    """What takes a page of its own, as it is loading or something is wrong."""
    files = {"tree.ath": WRONG[name](data) if name in WRONG else data}
    line = (
        _Held(files, rate=SLOW)
        if name == "loading"
        else ThrottledServer({k: v for k, v in files.items() if v is not None})
    )
    with line, _page(browser, size) as page:
        page.goto(line.page("tree.ath", quality="full"))
        if name == "loading":
            page.wait_for_function("() => athcodecViewer.counters.firstMotion")
        else:
            page.wait_for_selector("#message:not([hidden]), #trouble:not([hidden])")
            page.wait_for_function(
                "() => athcodecViewer.stage && (athcodecViewer.counters.firstPicture || !athcodecViewer.motion)"
            )
        page.evaluate("athcodecViewer.motion && athcodecViewer.setPlaying(false)")
        _save(page, name, size, folder)


def _start(page) -> Iterator[None]:
    page.evaluate("athcodecViewer.seek(0)")
    yield


def _settings(page) -> Iterator[None]:
    page.click("#toggle-panel")
    yield
    page.click("#toggle-panel")


def _playing(page) -> Iterator[None]:
    page.evaluate("athcodecViewer.playClip(athcodecViewer.motion.clips.length - 1)")
    page.wait_for_function("() => !athcodecViewer.motion.switching && athcodecViewer.motion.complete")
    page.evaluate("athcodecViewer.setPlaying(true)")
    yield


def _split(page) -> Iterator[None]:
    page.keyboard.press("d")
    page.wait_for_function("() => athcodecViewer.plants.every(({ motion }) => motion.level === motion.target)")
    yield
    page.keyboard.press("d")


def _error(page) -> Iterator[None]:
    page.evaluate("athcodecViewer.setLevel('3')")
    page.evaluate("document.querySelector('#colour [data-value=distance]').click()")
    page.wait_for_function("() => athcodecViewer.motion.level === 3 && !athcodecViewer.motion.fading")
    yield
    page.evaluate("document.querySelector('#colour [data-value=plain]').click()")
    page.evaluate("athcodecViewer.setLevel('auto')")


def _forest(page) -> Iterator[None]:
    page.evaluate(f"athcodecViewer.forestOf({TREES})")
    page.wait_for_function(PLANTED)
    yield
    page.evaluate("athcodecViewer.forestSwitch(false)")


SHOTS: dict[str, Callable] = {
    "start": _start,
    "settings": _settings,
    "playing": _playing,
    "split": _split,
    "error": _error,
    "forest": _forest,
    "loading": _start,
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
