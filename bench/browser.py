"""Chromium for measurements and tests of the viewer: Debian's, driven by Playwright, with software rendering."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from athcodec.viewer.picture import BROWSER_VARIABLE, FLAGS, browser_path

WEBGPU_FLAGS = [
    "--no-sandbox",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-unsafe-swiftshader",
    # These present a canvas of WebGPU; without them Chromium's GPU process ends at the first picture
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--ignore-gpu-blocklist",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
]
INSTALL = "apt-get install chromium && pip install playwright"


class MissingBrowser(Exception):
    """The message is one line for the user."""


@contextmanager
def chromium(flags: Sequence[str] = FLAGS) -> Iterator:
    """A Playwright browser. Raises MissingBrowser."""
    path = browser_path()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise MissingBrowser(f"package playwright: got none, expected it: {INSTALL}") from None
    if path is None:
        raise MissingBrowser(f"chromium: got none on PATH or in {BROWSER_VARIABLE}: {INSTALL}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(flags))
        try:
            yield browser
        finally:
            browser.close()
