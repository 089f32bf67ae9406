"""What the documentation's gallery shows besides the samples: files of a tree that grows and of a bare one, and a still
picture of every plant and of the forest, drawn by Chromium. And the stills beside the samples, which the
viewer's page shows before they move.

Both files are loops without a jump. The bare tree stands in a wind that repeats, and the tree that grows goes back to
where it began.
"""

from __future__ import annotations

import argparse
import base64
import io
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.motion.clip import ClipRange
from athcodec.viewer import picture, view
from athcodec.viewer.picture import chromium
from bench.sample import sapling
from bench.tables import table
from bench.trees.beams import bend
from bench.trees.plant import grow
from bench.trees.wind import Wind

FOLDER = Path(__file__).parents[1] / "docs" / "gallery"
SAMPLES = ("leafed", "fern", "grass")
RETURN_FRAMES = 30  # In so many frames the tree that grows goes back to its first one.
BARE = {"nodes": 4001, "orders": 3, "height": 12.0, "seed": 1}
BARE_FRAMES = 200  # After so many frames the wind of the bare tree repeats.
BARE_FPS = 30.0  # Frames per second of the bare tree.
BARE_WIND = 9.0  # Speed of its wind, in m/s.
BARE_SETTLING_SECONDS = 12.0  # What the tree began with has died away after these.
FLOOR = {"fern": 4.0, "grass": 9.0}  # plants around each tree of the forest
TREES = 40
SIZE = (640, 480)
CARD = (330, 272)  # pixels, of the stills beside the samples
QUALITY = 78
TIMEOUT = 300_000  # ms

_PLANTED = """() => {
  const [trees, ...floor] = athcodecViewer.forests();
  return floor.length > 0 &&
    floor.every(({ baked }) => baked.length > 2) && !trees.fading &&
    trees.baked.length === athcodecViewer.motion.levelCount;
}"""
_DRAWN = "(canvas) => { athcodecViewer.stage.render(); return canvas.toDataURL(); }"


def grown() -> athcodec.MotionClip:
    """Return the sample that grows, changed into a loop: it holds its last pose, and then shrinks back, slowly at the
    beginning and the end.
    """
    clip = sapling()
    share = np.arange(1, RETURN_FRAMES + 1) / (RETURN_FRAMES + 1)
    place = (clip.frame_count - 1) * (1.0 - share * share * (3.0 - 2.0 * share))
    before = np.floor(place).astype(int)
    part = (place - before)[:, None, None].astype(np.float32)
    back = clip.positions[before] * (1 - part) + clip.positions[before + 1] * part
    positions = np.concatenate([clip.positions, back])
    time = np.arange(len(positions)) / clip.metadata["fps"]
    return _loop(clip.replace(positions=positions, time=time), "growth")


def bare() -> athcodec.MotionClip:
    """Return a tree of points and the lines between them, in a wind that repeats."""
    plant = grow(**BARE)
    wind = Wind(BARE_WIND, plant.height, seed=BARE["seed"], period=BARE_FRAMES / BARE_FPS)
    positions = bend(plant, wind, BARE_FRAMES, BARE_FPS, spin_up=BARE_SETTLING_SECONDS)
    return _loop(plant.clip(positions, np.arange(BARE_FRAMES) / BARE_FPS, BARE_FPS), "wind")


def _loop(clip: athcodec.MotionClip, name: str) -> athcodec.MotionClip:
    clip.clip_ranges = (ClipRange(name, clip.frame_count, loop=True),)
    return clip


MADE: dict[str, tuple[Callable[[], athcodec.MotionClip], dict[str, Any]]] = {
    "growth": (grown, {"rel_error": 1e-4}),
    # In one segment its coarse levels would jump where the loop begins again, by up to 70 cm.
    "bare": (bare, {"rel_error": 1e-3, "ladder": "none", "segment_frames": BARE_FRAMES // 2}),
}
"""What makes the clips that do not ship as .ath, and how each is encoded."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="FOLDER")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Draw the still pictures of the documentation's gallery and write them, with the files that they show, to a
    folder. Return a table of the written files and their bytes.
    """
    args.out.mkdir(parents=True, exist_ok=True)
    samples = {name: athcodec.sample_path(name) for name in SAMPLES}
    for path in samples.values():
        path.with_suffix(".webp").write_bytes(picture.still(path, CARD))
    plants = samples | _encoded(args.out)
    for name, path in plants.items():
        (args.out / f"{name}.webp").write_bytes(picture.still(path, SIZE))
    (args.out / "forest.webp").write_bytes(_forest())
    rows = [{"file": path.name, "bytes": path.stat().st_size} for path in sorted(args.out.iterdir())]
    return {"tables": [table(str(args.out), rows)], "broken": []}


def captions() -> Iterator[tuple[str, str]]:
    """Yield the name and the size of each plant of the gallery, by its file: points, frames, bytes, bound."""
    for name in (*SAMPLES, *MADE):
        path = athcodec.sample_path(name) if name in SAMPLES else FOLDER / f"{name}.ath"
        with athcodec.open(path) as decoder:
            file, size = decoder.file, path.stat().st_size
            points, frames, error = file.vertex_count, file.info()["frames"], 1e3 * file.levels[-1].max_error
        yield name, f"{points:,} points, {frames} frames, {size / 1e3:.{size < 1e4:d}f} kB, within {error:.2g} mm"


def _encoded(folder: Path) -> dict[str, Path]:
    """Encode the gallery's clips that do not ship with the package, and return the files by name."""
    made = {}
    for name, (source, options) in MADE.items():
        made[name] = folder / f"{name}.ath"
        athcodec.encode(source(), made[name], **options)
    return made


def _forest() -> bytes:
    """Return a picture of a forest that the viewer draws on WebGPU, as the bytes of a WebP file."""
    from PIL import Image

    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        page_file = Path(folder, "page.html")
        floor = {athcodec.sample_path(name): each for name, each in FLOOR.items()}
        view.export_page(athcodec.sample_path("leafed"), page_file, floor=floor)
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.set_default_timeout(TIMEOUT)
        page.goto(page_file.as_uri() + "?quality=full")
        page.wait_for_function("() => athcodecViewer.motion?.complete")
        page.evaluate("document.body.classList.add('no-panel')")
        page.evaluate(f"athcodecViewer.stage.fit(); athcodecViewer.forestOf({TREES})")
        page.wait_for_function(_PLANTED)
        page.evaluate("athcodecViewer.setPlaying(false)")
        page.wait_for_timeout(2000)
        shot = page.locator("#canvas").evaluate(_DRAWN)
    return _webp(Image, shot)


def _webp(image, address: str) -> bytes:
    out = io.BytesIO()
    image.open(io.BytesIO(base64.b64decode(address.split(",")[1]))).convert("RGB").save(out, "WEBP", quality=QUALITY)
    return out.getvalue()
