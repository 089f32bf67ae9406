"""Where people put the page: in sandboxed frames, under a site's policy, in notebooks, in browsers without scripts."""

from __future__ import annotations

import re
import threading
from pathlib import Path

import pytest
from conftest import SLOWEST

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


def test_a_notebook_plays_a_decoder(watched, sample_ath):
    with athcodec.open(sample_ath) as decoder:
        cell = f'<!doctype html><link rel="icon" href="data:,">{decoder.show(height=360)._repr_html_()}'
        assert decoder.show()._repr_html_() in decoder._repr_html_()
    with ThrottledServer({"cell.html": cell.encode()}) as line:
        watched.goto(f"{line.address}cell.html")
        framed(watched).wait_for_function(MOVES)
        assert watched.locator("iframe").bounding_box()["height"] == 360
