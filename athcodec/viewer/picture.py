"""Pictures of a file: still ones and moving ones, drawn by the viewer's page in Chromium.

Takes Playwright, Pillow and Chromium, Debian's or any that ATHCODEC_CHROMIUM names.
"""

from __future__ import annotations

import base64
import io
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from athcodec.decoding.host_mesh import HostMesh
from athcodec.errors import MissingExtra
from athcodec.files.atomic import check_target, new_file
from athcodec.files.plain import FilePath
from athcodec.opening import open as open_ath
from athcodec.untyped import PlaywrightObject
from athcodec.viewer.view import export_page

INSTALL = 'pip install "athcodec[picture]"'
BROWSER_VARIABLE = "ATHCODEC_CHROMIUM"
FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
"""Of Chromium, so that it draws in software."""

SIZE = (640, 480)
FRAMES_PER_SECOND = 15
FORMATS = {"png": "PNG", "gif": "GIF", "webp": "WEBP"}

_STILL_QUALITY = 78  # Quality of WebP, from 0 to 100, of a still.
_MOVING_QUALITY = 45  # The same of a moving picture, for fewer bytes.
_STILL_AT = 0.7  # Time of a still picture, over the clip's duration.
_TIMEOUT = 300_000  # ms
_BEGUN = "() => globalThis.athcodecViewer?.motion"
_WHOLE = "() => athcodecViewer.motion.complete"
_ALONE = """() => {
  athcodecViewer.setLevel(String(athcodecViewer.motion.levelCount - 1));
  athcodecViewer.stage.keepClear([]);
  athcodecViewer.stage.fit();
  athcodecViewer.frameView();
}"""
_DRAWN = """async (seconds) => {
  const { motion, stage } = athcodecViewer;
  await athcodecViewer.shown(seconds, motion.levelCount - 1);
  stage.render();
  return stage.canvas.toDataURL("image/png").split(",")[1];
}"""


def browser_path() -> str | None:
    """Return the path of Chromium's program, or None."""
    return os.environ.get(BROWSER_VARIABLE) or shutil.which("chromium") or shutil.which("chromium-browser")


def save_picture(
    path: FilePath,
    out: FilePath,
    kind: str = "gif",
    clip: str | None = None,
    size: tuple[int, int] = SIZE,
    *,
    fps: float = FRAMES_PER_SECOND,
    time: float = 0.0,
    host_mesh: HostMesh | None = None,
) -> int:
    """Write a picture of a plant at full detail.

    Parameters
    ----------
    path : str or path-like
        The .ath file, or its URL.
    out : str or path-like
        The picture; it appears when it is complete. An older one of this kind is replaced, no other file.
    kind : str
        "gif" and "webp" move, over one round of the clip; "png" stands still.
    clip : str, optional
        The name of a clip; by default the first.
    size : tuple of int
        Width and height in pixels.
    fps : float
        Pictures a second of what moves.
    time : float
        Seconds from the clip's first frame, of what stands still.
    host_mesh : array, MotionClip, str or path-like, optional
        As `athcodec.viewer.view.export_page`.

    Returns
    -------
    int
        Size of the picture, bytes.

    Raises
    ------
    MissingExtra
        Where Playwright, Pillow or Chromium is not there.
    AthError, OSError
        As `athcodec.viewer.view.export_page`.
    """
    check_target(out, f".{kind}")
    image = _packages()
    pictures = [
        image.open(io.BytesIO(data)).convert("RGB")
        for data in _drawn(path, kind, size, fps=fps, time=time, clip=clip, host_mesh=host_mesh)
    ]
    data = io.BytesIO()
    moving = {"save_all": True, "append_images": pictures[1:], "duration": round(1000 / fps), "loop": 0}
    moving["quality"] = _MOVING_QUALITY
    pictures[0].save(data, FORMATS[kind], **({} if kind == "png" else moving))
    with new_file(out) as file:
        file.write(data.getvalue())
    return data.tell()


def still(path: FilePath, size: tuple[int, int] = SIZE) -> bytes:
    """Return a picture of a plant, late in its clip, when a growing plant has grown, as the bytes of a WebP file. Raise
    what `save_picture` raises.
    """
    image = _packages()
    with open_ath(path) as decoder:
        time = _STILL_AT * decoder.clip.duration
    (png,) = _drawn(path, "png", size, time=time)
    data = io.BytesIO()
    image.open(io.BytesIO(png)).convert("RGB").save(data, "WEBP", quality=_STILL_QUALITY, method=6)
    return data.getvalue()


def can_draw() -> bool:
    """Return whether all is there that pictures take."""
    try:
        _packages()
    except MissingExtra:
        return False
    return True


def _packages() -> PlaywrightObject:
    """Return Pillow's module of images. Raise MissingExtra if a package that pictures need is missing."""
    try:
        import playwright.sync_api  # noqa: F401
        from PIL import Image
    except ImportError as error:
        raise MissingExtra(f"athcodec picture: needs {error.name}: {INSTALL}") from None
    if browser_path() is None:
        raise MissingExtra(
            f"athcodec picture: needs Chromium on PATH or in {BROWSER_VARIABLE}: apt-get install chromium"
        )
    return Image


@contextmanager
def chromium(flags: Sequence[str] = FLAGS) -> Iterator[PlaywrightObject]:
    """Start a browser of Playwright and yield it. Raise MissingExtra if it is not installed."""
    _packages()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=list(flags))
        try:
            yield browser
        finally:
            browser.close()


def _drawn(
    path: FilePath,
    kind: str,
    size: tuple[int, int],
    *,
    fps: float = FRAMES_PER_SECOND,
    time: float = 0.0,
    clip: str | None = None,
    host_mesh: HostMesh | None = None,
) -> Iterator[bytes]:
    """Yield each picture as the bytes of a PNG file, with all scenery, also on machines without a graphics
    processor.
    """
    with open_ath(path, clip=clip, host_mesh=host_mesh) as decoder:
        playing = decoder.clip
        steps = max(playing.frame_count - 1, 1)
        seconds = playing.duration * ((steps + 1) / steps if playing.loop else 1)
    times = [time] if kind == "png" else [i / fps for i in range(max(1, round(seconds * fps)))]
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        export_page(path, Path(folder) / "page.html", clip, host_mesh)
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        page.goto((Path(folder) / "page.html").as_uri() + "?intro=off&quality=full")
        page.wait_for_function(_BEGUN, timeout=_TIMEOUT)
        page.evaluate(_ALONE)
        page.wait_for_function(_WHOLE, timeout=_TIMEOUT)
        for at in times:
            yield base64.b64decode(page.evaluate(_DRAWN, at))
