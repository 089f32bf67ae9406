"""Galleries: folders with a page of several plants that start when they come into view, and the documentation's own."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import SLOWEST

import athcodec
from athcodec import cli
from athcodec.viewer import gallery, picture
from athcodec.viewer.build_viewer import modules
from bench.throttled_server import WEB, ThrottledServer

pytestmark = pytest.mark.web

DOCS = Path(__file__).parents[1] / "docs"


def small_files(sample_ath: Path, folder: Path, names: list[str]) -> list[str]:
    """Copies of one file under several names."""
    paths = [folder / name for name in names]
    for path in paths:
        path.write_bytes(sample_ath.read_bytes())
    return [str(path) for path in paths]


@pytest.fixture
def bare(monkeypatch):
    """Without what still pictures take."""
    monkeypatch.setattr(picture, "browser_path", lambda: None)


def test_a_gallery_is_a_folder_with_page_viewer_and_files(sample_ath, bare, tmp_path, capsys):
    files = small_files(sample_ath, tmp_path, ["oak & ash.ath", "fern.ath"])
    out = tmp_path / "gallery"
    assert cli.main(["view", *files, "--export", str(out)]) == 0
    said = capsys.readouterr()
    assert f"{out}: 2 plants, " in said.out and "no still pictures" in said.err
    page = (out / "index.html").read_text("utf-8")
    assert "<h2>oak &amp; ash</h2>" in page and "CARDS" not in page
    with athcodec.open(files[0]) as decoder:
        assert f"{decoder.file.vertex_count:,} points, {decoder.frame_count} frames" in page
    assert {path.name for path in (out / "plants").iterdir()} == {"oak & ash.ath", "fern.ath"}
    named = re.findall(r'(?:src|href)="((?:viewer|plants)/[^"?]*)', page) + re.findall(r'": "\./([^"]*)"', page)
    for name in named:
        assert (out / name.replace("%20", " ").replace("%26", "&")).is_file(), name


def test_a_gallery_refuses_what_it_cannot_show_before_it_writes(sample_ath, bare, tmp_path, capsys):
    out = tmp_path / "gallery"
    (tmp_path / "no.ath").write_bytes(b"nothing of the kind")
    (tmp_path / "else").mkdir()
    (twin,) = small_files(sample_ath, tmp_path / "else", [sample_ath.name])
    for files, words in (
        ([str(sample_ath), str(tmp_path / "no.ath")], "no.ath"),
        ([str(sample_ath), twin], "names that differ"),
        (["https://example.org/oak.ath"], "got a URL"),
    ):
        assert cli.main(["view", *files, "--export", str(out)]) == 1
        assert words in capsys.readouterr().err and not out.exists()


def test_several_files_are_no_page_and_no_server(sample_ath, tmp_path, capsys):
    two = [str(sample_ath), str(sample_ath)]
    assert cli.main(["view", *two, "--export", str(tmp_path / "page.html")]) != 0
    assert cli.main(["view", *two, "--no-browser"]) != 0
    assert "--export DIR" in capsys.readouterr().err
    assert cli.main(["view", *two, "--export", str(tmp_path / "gallery"), "--clip", "calm"]) != 0
    assert "--clip" in capsys.readouterr().err and not (tmp_path / "gallery").exists()


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


@pytest.fixture
def shown(opened, sample_ath, tmp_path):
    """The page of a gallery of four plants on a low screen, and `line`, the server that it comes from."""
    files, out = small_files(sample_ath, tmp_path, [f"tree {number}.ath" for number in range(4)]), tmp_path / "gallery"
    gallery.export_gallery(files, out, stills=False)
    made = {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*.*")}
    with ThrottledServer(made) as line:
        page = opened(line.address, "true", viewport={"width": 360, "height": 360})
        page.line = line
        page.evaluate("globalThis.plants = [...document.querySelectorAll('ath-viewer')]")
        yield page


@pytest.mark.browser
def test_a_plant_of_a_gallery_starts_when_it_comes_into_view_and_is_given_back_behind(shown):
    shown.wait_for_function("() => plants[0].currentTime > 0.1")
    assert {name for name, *_ in shown.line.log if name.startswith("plants/")} == {"plants/tree 0.ath"}
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
  other.src = "viewer/gallery.css";
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
    shown.evaluate("other.src = 'plants/tree 1.ath'")
    shown.wait_for_function(f"() => {drawn}")


@pytest.mark.browser
def test_attributes_of_an_element_say_what_it_shows(shown, tmp_path):
    (tmp_path / "gallery" / "plants" / "grass.ath").write_bytes(athcodec.sample_path("grass").read_bytes())
    shown.evaluate("""() => {
      globalThis.tuft = document.createElement("ath-viewer");
      const wanted = { src: "plants/grass.ath", clip: "gale", level: 0, alt: "Grass", speed: 4, "camera-controls": "" };
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
    shown.evaluate("tuft.removeAttribute('clip'); tuft.setAttribute('src', 'plants/tree 0.ath')")
    shown.wait_for_function("() => tuft.ath?.motion.clips.length === 1")


@pytest.mark.browser
def test_an_element_shows_a_forest_with_plants_on_its_floor(shown, tmp_path):
    (tmp_path / "gallery" / "plants" / "grass.ath").write_bytes(athcodec.sample_path("grass").read_bytes())
    shown.evaluate("""() => {
      globalThis.wood = document.createElement("ath-viewer");
      const wanted = { src: "plants/tree 0.ath", scenery: "", forest: 9, floor: "plants/grass.ath=2" };
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
    head = re.search(r'<script type="importmap">.*?</script>', (WEB / "index.html").read_text("utf-8"))[0]
    head += '<link rel="stylesheet" href="gallery.css"><script type="module" src="ath-viewer.js"></script>'
    card = '<ath-viewer src="/tree.ath" scenery><img src="fern.webp" alt=""></ath-viewer>'
    cards = f'<!doctype html>{head}<ul class="ath-gallery"><li>{card}</li></ul>'
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
    command = [sys.executable, "-m", "athcodec", "view", str(sample_ath), "--export", str(tmp_path / "gallery")]
    subprocess.run(command, check=True, capture_output=True, text=True)
    still = tmp_path / "gallery" / "stills" / f"{sample_ath.stem}.webp"
    assert still.read_bytes()[8:12] == b"WEBP"
    assert f'src="stills/{sample_ath.stem}.webp"' in (tmp_path / "gallery" / "index.html").read_text("utf-8")
