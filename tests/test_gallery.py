"""Pages of several plants that start when they come into view, and the one of the documentation."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import SLOWEST

import athcodec
from athcodec.viewer.build_viewer import modules
from bench.throttled_server import ThrottledServer

pytestmark = pytest.mark.web

DOCS = Path(__file__).parents[1] / "docs"


def test_all_that_the_gallery_of_the_documentation_names_is_there():
    text = (DOCS / "gallery.md").read_text("utf-8")
    named = re.findall(r'(?:src=|href=|: )"((?:\.\./|gallery/)[^"?#]*)', text)
    viewer = DOCS.parent / "athcodec" / "viewer" / "web"
    files = re.findall(r"(?<=[?;])(?:file|floor)=([^&#\"]*)", text)
    floor = re.search(r'floor="([^"]*)"', text)[1].split()
    named += [name.rpartition("=")[0] for name in floor]
    assert len(named) > 15 and len(files) > 8
    assert all((DOCS / name).is_file() for name in named)
    assert all((viewer / name).is_file() for name in files)


@pytest.mark.parametrize("name", ["growth", "bare"])
def test_a_clip_that_the_gallery_is_made_of_repeats_without_a_jump(name):
    with athcodec.open(DOCS / "gallery" / f"{name}.ath") as decoder:
        frames = decoder.positions(dtype=np.float64)
        assert decoder.clip.loop
    steps = np.abs(np.diff(frames, axis=0)).max(axis=(1, 2))
    assert np.abs(frames[0] - frames[-1]).max() <= steps.max()


MAP = re.search(r'<script type="importmap">(.*?)</script>', (DOCS / "gallery.md").read_text("utf-8"))[0]
HEAD = f"""<!doctype html><html lang="en"><meta charset="utf-8"><title>Plants</title><link rel="icon" href="data:,">
  <link rel="stylesheet" href="gallery.css">{MAP.replace("../athcodec/viewer/web/", "./")}
  <script type="module" src="ath-viewer.js"></script><body class="ath-page"><main>"""
CARD = """<li><ath-viewer src="{0}" scenery loading="lazy" camera-controls="turn" alt="A tree, moving"></ath-viewer>
  <h2>{0}</h2><p>A tree</p><p><a href="index.html?file={0}">Open in the viewer</a></p></li>"""


@pytest.fixture
def shown(opened, sample_ath):
    """A page of four plants on cards on a low screen, and `line`, the server that it comes from."""
    files = {f"tree{number}.ath": sample_ath.read_bytes() for number in range(4)}
    cards = f'<h1>Plants</h1><ul class="ath-gallery">{"".join(map(CARD.format, files))}</ul></main>'
    files |= {"cards.html": f"{HEAD}{cards}".encode(), "grass.ath": athcodec.sample_path("grass").read_bytes()}
    with ThrottledServer(files) as line:
        page = opened(f"{line.address}cards.html", "true", viewport={"width": 360, "height": 360})
        page.line = line
        page.evaluate("globalThis.plants = [...document.querySelectorAll('ath-viewer')]")
        yield page


@pytest.mark.browser
def test_a_plant_of_a_gallery_starts_when_it_comes_into_view_and_is_given_back_behind(shown):
    shown.wait_for_function("() => plants[0].currentTime > 0.1")
    fetched = {name for name, *_ in shown.line.log if name.startswith("tree")}
    assert {"tree0.ath"} <= fetched <= {"tree0.ath", "tree1.ath"}  # The second is just below the view.
    assert shown.evaluate("plants[3].ath") is None
    assert shown.evaluate("plants[3].shadowRoot.querySelector('canvas')") is None
    shown.evaluate("plants[3].scrollIntoView()")
    shown.wait_for_function("() => plants[3].currentTime > 0.1 && plants[0].ath === null")
    assert shown.evaluate("plants[0].shadowRoot.querySelector('canvas')") is None
    shown.evaluate("plants[0].scrollIntoView()")
    shown.wait_for_function("() => plants[0].ath !== null && plants[0].currentTime > 0.1")


@pytest.mark.browser
def test_a_plant_of_a_gallery_is_turned_and_the_page_scrolls_over_it(shown):
    shown.wait_for_function("() => plants[0].currentTime > 0.1")
    view = "plants[0].camera.position.toArray()"
    before, (x, y, wide, tall) = shown.evaluate(view), shown.locator("ath-viewer").first.bounding_box().values()
    shown.mouse.move(x + wide / 2, y + tall / 2)
    shown.mouse.wheel(0, 120)
    shown.wait_for_function("() => scrollY > 50")
    assert shown.evaluate(view) == pytest.approx(before)
    shown.evaluate("scrollTo(0, 0)")
    shown.mouse.down()
    shown.mouse.move(x + wide / 2 + 80, y + tall / 2, steps=4)
    shown.mouse.up()
    shown.wait_for_function(f"() => Math.abs({view}[0] - {before[0]}) > 0.1")


BESIDE = """() => {
  globalThis.other = document.createElement("ath-viewer");
  other.style.cssText = "display: block; width: 100px; height: 80px";
  other.innerHTML = "<b></b>";
  other.src = "gallery.css";
  globalThis.failed = new Promise((done) => {
    other.addEventListener("error", ({ detail }) => done(detail.codeName));
  });
  document.body.prepend(other);
}"""


@pytest.mark.browser
def test_what_stands_in_an_element_is_seen_until_the_plant_is(shown):
    shown.evaluate(BESIDE)
    assert shown.evaluate("failed") == "NOT_AN_ATH_FILE"
    drawn = "other.shadowRoot.querySelector('canvas').classList.contains('drawn')"
    assert shown.evaluate(drawn) is False
    assert shown.evaluate("other.firstChild.getBoundingClientRect().width") == 100
    shown.evaluate("other.src = 'tree1.ath'")
    shown.wait_for_function(f"() => {drawn}")


@pytest.mark.browser
def test_attributes_of_an_element_say_what_it_shows(shown):
    shown.evaluate("""() => {
      globalThis.tuft = document.createElement("ath-viewer");
      const wanted = { src: "grass.ath", clip: "gale", level: 0, alt: "Grass", speed: 4, "camera-controls": "" };
      for (const [name, value] of Object.entries(wanted)) tuft.setAttribute(name, value);
      tuft.style.cssText = "display: block; width: 320px; height: 240px";
      document.body.prepend(tuft);
    }""")
    shown.wait_for_function("() => tuft.currentTime > 1 && tuft.ath.motion.level === 0")
    assert shown.evaluate("tuft.ath.motion.clip.name") == "gale"
    canvas = "tuft.shadowRoot.querySelector('canvas')"
    assert shown.evaluate(f"[{canvas}.ariaLabel, {canvas}.tabIndex]") == ["Grass", 0]
    shown.evaluate("tuft.pause(); globalThis.stopped = tuft.currentTime")
    shown.evaluate("tuft.setAttribute('clip', 'calm'); tuft.setAttribute('level', 'auto')")
    shown.evaluate("tuft.removeAttribute('camera-controls')")
    shown.wait_for_function("() => tuft.ath.motion.clip.name === 'calm' && tuft.ath.motion.level > 0")
    assert shown.evaluate("tuft.currentTime === stopped") and shown.evaluate(f"{canvas}.tabIndex") == -1
    shown.evaluate("tuft.removeAttribute('clip'); tuft.setAttribute('src', 'tree0.ath')")
    shown.wait_for_function("() => tuft.ath?.motion.clips.length === 1")


@pytest.mark.browser
def test_an_element_shows_a_forest_with_plants_on_its_floor(shown):
    shown.evaluate("""() => {
      globalThis.wood = document.createElement("ath-viewer");
      const wanted = { src: "tree0.ath", scenery: "", forest: 9, floor: "grass.ath=2" };
      for (const [name, value] of Object.entries(wanted)) wood.setAttribute(name, value);
      wood.style.cssText = "display: block; width: 160px; height: 120px";
      document.body.prepend(wood);
    }""")
    shown.wait_for_function("() => wood.forests.length === 2 && wood.forests.every(({ baked }) => baked.length > 0)")
    assert shown.evaluate("wood.forests.map(({ count }) => count)") == [9, 18]
    drawn = (
        "() => wood.forests.every(({ count, counts, culled }) => counts.reduce((a, b) => a + b, 0) + culled === count)"
    )
    shown.wait_for_function(drawn)
    shown.evaluate("wood.remove()")
    assert shown.evaluate("wood.forests.length") == 0


NO_WEBGL = """HTMLCanvasElement.prototype.getContext = () => null"""


@pytest.mark.browser
def test_a_browser_that_cannot_draw_shows_stills_and_plain_sentences(browser, sample_ath):
    page, still = browser.new_page(), (DOCS / "gallery" / "fern.webp").read_bytes()
    page.set_default_timeout(SLOWEST)
    page.add_init_script(NO_WEBGL)
    card = '<ath-viewer src="/tree.ath" scenery><img src="fern.webp" alt=""></ath-viewer>'
    cards = f'{HEAD}<ul class="ath-gallery"><li>{card}</li></ul>'
    page.route("**/cards.html", lambda route: route.fulfill(body=cards, content_type="text/html"))
    page.route("**/fern.webp", lambda route: route.fulfill(body=still, content_type="image/webp"))
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        page.goto(f"{line.address}cards.html")
        page.wait_for_function("() => document.querySelector('ath-viewer').shadowRoot.querySelector('[role=alert]')")
        assert page.locator("ath-viewer [role=alert]").inner_text() == "This browser cannot draw in 3D"
        box, card = (page.locator(each).bounding_box() for each in ("img", "ath-viewer"))
        assert page.locator("img").is_visible() and box == card
        page.goto(f"{line.address}forest.html?file=/tree.ath&count=30")
        page.wait_for_selector("#message")
        assert "cannot draw in 3D" in page.inner_text("#message h2") and "index.html" in page.url
    page.close()


@pytest.mark.browser
def test_without_webgpu_the_forest_is_drawn_on_webgl(opened, sample_ath):
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        address = f"{line.address}forest.html?file=/tree.ath&count=30"
        page = opened(
            address,
            "globalThis.athcodecViewer?.forests()[0]?.counts.some((count) => count > 0)",
            quiet="No available adapters",
        )
        assert page.evaluate("athcodecViewer.forests()[0].count") == 30


@pytest.mark.browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_in_a_gallery(shown, scheme):
    shown.emulate_media(color_scheme=scheme)
    shown.evaluate((modules() / "axe-core" / "axe.min.js").read_text("utf-8"))
    found = shown.evaluate("axe.run().then(({ violations }) => violations.map(({ id, nodes }) => [id, nodes[0].html]))")
    assert found == []


@pytest.mark.browser
def test_still_pictures_are_drawn_where_chromium_is(sample_ath, tmp_path):
    """In a process of its own: the tests' browser is Playwright's only one in this."""
    script = """import pathlib, sys
from athcodec.viewer import picture
pathlib.Path(sys.argv[2]).write_bytes(picture.still(sys.argv[1]))"""
    subprocess.run([sys.executable, "-c", script, sample_ath, tmp_path / "still.webp"], check=True)
    assert (tmp_path / "still.webp").read_bytes()[8:12] == b"WEBP"
