"""Where people put the page: in sandboxed frames, under a site's policy, in notebooks, in browsers without scripts."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest
from conftest import SLOWEST
from playwright.sync_api import Error

import athcodec
from athcodec.viewer import view
from bench.throttled_server import ThrottledServer

pytestmark = pytest.mark.browser

# What docs/viewer.md asks of a site's policy.
POLICY = re.search(r"```text\n(default-src 'none'[^`]*)```", (Path(__file__).parents[1] / "docs/viewer.md").read_text())
MOVES = "() => globalThis.athcodecViewer?.counters.firstMotion"


@pytest.fixture
def watched(browser):
    """A page, whose errors and console have to stay empty."""
    page, errors = browser.new_page(viewport={"width": 900, "height": 700}), []
    page.set_default_timeout(SLOWEST)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    yield page
    page.close()
    assert errors == []


def framed(page):
    """The document in the first frame of a page."""
    return next(frame for frame in page.frames if frame != page.main_frame)


def test_an_exported_page_plays_in_a_sandboxed_frame(watched, sample_ath, tmp_path):
    view.export_page(sample_ath, tmp_path / "plant.html")
    frame = '<iframe sandbox="allow-scripts" src="/plant.html" width="800" height="600"></iframe>'
    outer = f'<!doctype html><link rel="icon" href="data:,">{frame}'
    with ThrottledServer({"plant.html": (tmp_path / "plant.html").read_bytes(), "o.html": outer.encode()}) as line:
        watched.goto(f"{line.address}o.html")
        framed(watched).wait_for_function(MOVES)
        assert not framed(watched).is_visible("#message")


def test_the_page_plays_under_a_policy_without_inline_scripts(watched, sample_ath):
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:

        def with_policy(route):
            answer = route.fetch()
            policy = {"Content-Security-Policy": POLICY[1].replace("\n", " ").strip()}
            route.fulfill(response=answer, headers=answer.headers | policy)

        watched.route(re.compile(r"/(\?.*)?$"), with_policy)
        watched.goto(line.page("tree.ath"))
        watched.wait_for_function(MOVES)
        watched.click("#colour [data-value=order]")
        assert watched.evaluate("athcodecViewer.plants[0].colour") == "order"


def test_three_and_the_decoder_come_in_parallel_with_the_front_of_the_file(watched, sample_ath):
    """three.js is not answered before the worker and the file are asked for, which else would never be."""
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        asked = {"ath_worker.js": threading.Event(), "tree.ath": threading.Event()}
        held = []

        def note(request):
            for name, event in asked.items():
                if name in request.url:
                    event.set()
            if all(event.is_set() for event in asked.values()):
                for route in held:
                    route.continue_()
                held.clear()

        watched.on("request", note)
        watched.route("**/three.js", lambda route: held.append(route))
        watched.goto(line.page("tree.ath"), wait_until="commit")
        watched.wait_for_function(MOVES)
        assert len([entry for entry in line.log if entry[1] == 0]) == 1  # the front once


def test_without_scripts_there_are_a_sentence_and_a_still(browser, sample_ath, tmp_path):
    view.export_page(sample_ath, tmp_path / "plant.html")
    page = browser.new_page(java_script_enabled=False)
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        for address, still in ((line.page("tree.ath"), "img"), ((tmp_path / "plant.html").as_uri(), "svg")):
            page.goto(address)
            assert "takes JavaScript" in page.inner_text("#no-script p")
            assert page.locator(f"#no-script {still}").bounding_box()["height"] > 200
            assert not page.is_visible("header")
    page.close()


def test_a_frame_without_an_origin_plays_and_may_be_turned(watched, sample_ath):
    """As a notebook has it: the page stands in an attribute, and may not change an address."""
    with athcodec.open(sample_ath) as decoder:
        cell = f'<!doctype html><link rel="icon" href="data:,">{decoder.show(height=360)._repr_html_()}'
    with ThrottledServer({"cell.html": cell.encode()}) as line:
        watched.goto(f"{line.address}cell.html")
        frame = framed(watched)
        frame.wait_for_function(MOVES)
        frame.evaluate("athcodecViewer.endIntro?.(); athcodecViewer.moveView(1, 0)")
        frame.wait_for_timeout(700)  # in which the address would be written
        assert watched.locator("iframe").bounding_box()["height"] == 360


NOTEBOOK = """{{"cells": [{{"cell_type": "code", "id": "a", "metadata": {{}}, "outputs": [], "execution_count": null,
  "source": {source}}}], "nbformat": 4, "nbformat_minor": 5,
  "metadata": {{"kernelspec": {{"name": "python3", "display_name": "Python 3", "language": "python"}}}}}}"""


@pytest.fixture
def jupyter(tmp_path):
    """A notebook server for a notebook of one cell, and its address."""
    source = json.dumps('import athcodec\nathcodec.open(athcodec.sample_path("fern"))')
    (tmp_path / "plant.ipynb").write_text(NOTEBOOK.format(source=source))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = ["--no-browser", "--allow-root", f"--ServerApp.port={port}", "--IdentityProvider.token=t"]
    homes = {name: str(tmp_path / name) for name in ("HOME", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR")}
    process = subprocess.Popen(
        [sys.executable, "-m", "notebook", *options, f"--ServerApp.root_dir={tmp_path}"],
        env=os.environ | homes,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield f"http://127.0.0.1:{port}/notebooks/plant.ipynb?token=t"
    finally:
        process.terminate()
        process.wait(30)


def test_a_notebook_server_plays_the_last_value_of_a_cell(browser, jupyter):
    page = browser.new_page(viewport={"width": 1100, "height": 900})
    page.set_default_timeout(SLOWEST)
    for _ in range(60):
        with suppress(Error):
            page.goto(jupyter)
            break
        time.sleep(1)
    page.wait_for_selector(".jp-CodeCell .cm-content")
    page.wait_for_selector(".jp-Notebook-ExecutionIndicator[data-status=idle]")  # The kernel runs.
    page.click(".jp-CodeCell .cm-content")
    page.keyboard.press("Shift+Enter")
    element = page.wait_for_selector("iframe[srcdoc]")
    element.content_frame().wait_for_function(MOVES)
    page.close()
