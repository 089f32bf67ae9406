"""The controls of the viewer's page, by mouse, touch and keyboard; what it tells of a file and of loading it."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SLOWEST
from PIL import Image, ImageSequence
from test_tubes import RINGS, TWIGS, twigs

import athcodec
from athcodec import cli
from athcodec.viewer.build_viewer import modules
from bench.throttled_server import ThrottledServer

pytestmark = pytest.mark.browser

VIEW = "athcodecViewer.stage.camera.position.toArray()"
PIXELS_OFF = """(({ motion, stage, plants }) =>
  motion.pixelError(motion.level, stage.camera, stage.pixels, plants[0].root.matrixWorld))(athcodecViewer)"""


@pytest.fixture(scope="module")
def windy(tmp_path_factory):
    """An .ath file of one plant in winds of strength 2 and 10 towards 0 degrees, and of 10 towards 90."""
    folder = tmp_path_factory.mktemp("windy")
    with athcodec.read(athcodec.sample_path()) as clip:
        clips = {}
        for name, strength, heading in (("calm", 2.0, 0.0), ("gale", 10.0, 0.0), ("across", 10.0, 90.0)):
            clips[name] = athcodec.in_wind(clip, strength, heading)
        athcodec.encode(athcodec.join(clips), folder / "windy.ath", rel_error=1e-3, effort="fast")
    return (folder / "windy.ath").read_bytes()


@pytest.fixture
def page(opened_file, sample_ath):
    return opened_file(sample_ath.read_bytes())


def centre(page, selector: str) -> tuple[float, float]:
    box = page.locator(selector).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


class Fingers:
    """On a page, with a clock of their own: taps are as far apart as here, however long the browser takes."""

    def __init__(self, page):
        self.session, self.now = page.context.new_cdp_session(page), time.time()

    def _send(self, kind: str, points) -> None:
        self.now += 0.02
        touches = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(points)]
        event = {"type": kind, "touchPoints": touches, "timestamp": self.now}
        self.session.send("Input.dispatchTouchEvent", event)

    def go(self, *ways) -> None:
        """Each from one place to another, all at once."""
        for step in range(5):
            places = [(a + (c - a) * step / 4, b + (d - b) * step / 4) for (a, b), (c, d) in ways]
            self._send("touchStart" if step == 0 else "touchMove", places)
        self._send("touchEnd", [])

    def tap(self, place) -> None:
        self._send("touchStart", [place])
        self._send("touchEnd", [])


def drag(page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*end, steps=4)
    page.mouse.up()


def chosen(page, group: str) -> str:
    return page.locator(f"#{group} [aria-checked=true]").get_attribute("data-value")


def test_a_headline_says_what_is_sent_and_lines_how_small_it_is(page, sample_ath):
    """Its figures are all of the whole file: a position is 12 bytes as float32, a joint of a GLB 28."""
    with athcodec.open(sample_ath) as decoder:
        points, frames, branches = decoder.file.vertex_count, decoder.frame_count, decoder.file.branch_count
        seconds, error = decoder.clip.duration, 1000 * decoder.levels[-1].max_error
    size = sample_ath.stat().st_size
    lines = [line for line in page.inner_text("#sizes").replace("\xa0", " ").split("\n") if line]
    assert lines == [
        "A plant's motion, streamed in levels",
        f"{seconds:.2g} s, {points:,} points, within {error:.2g} mm of the source",
        f"{size / 1e3:.0f} kB",
        f"instead of {points * frames * 12 / 1e6:.2f} MB uncompressed",
        f"or {branches * frames * 28 / 1e3:.0f} kB as GLB",
    ]
    assert f"{size:,} bytes" in page.get_attribute("#sizes", "title")


def test_levels_are_chips_of_their_bytes_and_their_error(page, sample_ath):
    with athcodec.open(sample_ath) as decoder:
        size, error = decoder.levels[0].bytes, decoder.levels[0].max_error
    chip = page.inner_text("#level-choice [data-value='0']").replace("\xa0", " ").split("\n")
    assert [chip[0], chip[1]] == [f"{size / 1e3:.1f} kB", f"±{100 * error:.2g} cm"]
    assert page.inner_text("#levels-title").replace("\xa0", " ") == f"Plays from {size / 1e3:.1f} kB on, then sharpens"


def test_whether_levels_are_automatic_is_a_switch_and_the_chip_that_is_filled_is_what_is_shown(page):
    filled = "Number(document.querySelector('#level-choice [aria-current=true]')?.dataset.value)"
    page.evaluate("athcodecViewer.setPlaying(false)")
    automatic = f"""() => {{
      const {{ automatic, level, target }} = athcodecViewer.motion;
      return automatic && level === target && target > 0 && {filled} >= target;
    }}"""
    page.wait_for_function(automatic)
    assert page.is_checked("#auto") and page.locator("#level-choice [aria-checked=true]").count() == 0
    page.click("#level-choice [data-value='0']")
    page.wait_for_function(f"() => {filled} === 0")
    assert not page.is_checked("#auto") and chosen(page, "level-choice") == "0"
    page.check("#auto")
    page.wait_for_function(automatic)
    page.uncheck("#auto")
    assert chosen(page, "level-choice") == str(page.evaluate("athcodecViewer.motion.target"))
    assert not page.evaluate("athcodecViewer.motion.automatic")


def test_a_level_as_small_as_the_next_one_has_no_chip_and_is_reached_by_key(opened_file):
    """Two levels of the fern are 11 kB."""
    page = opened_file(athcodec.sample_path("fern").read_bytes())
    sizes = [text.split("\n")[0] for text in page.locator("#level-choice button").all_inner_texts()]
    with athcodec.open(athcodec.sample_path("fern")) as decoder:
        count = len(decoder.levels)
    assert len(sizes) == len(set(sizes)) == count - 1
    page.locator("#level-choice button").last.click()
    shown = set()
    for _ in range(count):
        shown.add(page.evaluate("Number(athcodecViewer.motion.target)"))
        page.keyboard.press("[")
    assert shown == set(range(count))


def test_lines_run_once_along_each_branch_and_not_around_its_bark(opened_file, tmp_path):
    """Nine twigs of twelve rings on a stem of twelve vertices."""
    athcodec.encode(twigs(), tmp_path / "twigs.ath", rel_error=1e-3, effort="fast")
    page = opened_file((tmp_path / "twigs.ath").read_bytes())
    page.click("#show [data-value=lines]")
    found = """() => { const all = []; athcodecViewer.stage.panes[0].scene.traverse((each) => {
      if (each.isLineSegments) all.push(each.geometry.index.count / 2); }); return all; }"""
    assert page.evaluate(found) == [TWIGS * RINGS + RINGS - 1]


def test_colours_that_tell_something_have_a_legend(page):
    legend = page.locator("#legend")
    assert not legend.is_visible()
    page.click("#colour [data-value=order]")
    assert legend.inner_text().split("\n")[:2] == ["trunk", "limbs"]
    page.click("#colour [data-value=part]")
    assert "moves as one piece" in legend.inner_text()
    page.click("#colour [data-value=plant]")
    assert not legend.is_visible()


DARKEST = """() => {
  const { stage, modules: { three } } = athcodecViewer, { canvas, panes: [{ scene }] } = stage;
  const wanted = getComputedStyle(document.querySelector("#legend i")).backgroundColor;
  for (const name of ["ground", "sky", "under"]) scene.getObjectByName(name).visible = false;
  scene.background = new three.Color(wanted); // so that edges are no darker either
  stage.render();
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
  copy.drawImage(canvas, 0, 0);
  const { data } = copy.getImageData(0, 0, canvas.width, canvas.height), legend = wanted.match(/\\d+/g).map(Number);
  let darkest = 1, differ = 0;
  for (let i = 0; i < data.length; i += 4) {
    const share = Math.min(...legend.map((value, k) => data[i + k] / value));
    darkest = Math.min(darkest, share);
    differ += share < 0.99;
  }
  return [darkest, differ];
}"""


def test_colours_that_tell_something_are_those_of_their_legend_inside_a_crown_too(opened_file):
    """All blades of the tuft have one order."""
    page = opened_file(athcodec.sample_path("grass").read_bytes())
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.click("#colour [data-value=order]")
    darkest, pixels = page.evaluate(DARKEST)
    assert pixels > 500 and darkest > 0.7


@pytest.mark.parametrize("size", [(390, 844), (844, 390), (1200, 800)])
def test_a_window_of_any_size_shows_the_levels_and_says_in_their_figures_which_is_drawn(opened, sample_ath, size):
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        page = opened(line.page("tree.ath"), viewport=dict(zip(("width", "height"), size)))
        for level in (0, 1):
            chip = page.locator(f"#level-choice [data-value='{level}']")
            chip.click()
            bytes_, error = chip.inner_text().split("\n±")
            page.wait_for_function(
                """([level, text]) => document.getElementById("arrived").innerText === text
                  && document.querySelector("#level-choice [aria-current=true]")?.dataset.value === level""",
                arg=[str(level), f"First {bytes_} shown, within {error} of the source"],
            )
            assert page.evaluate("athcodecViewer.motion.level") == level
            assert page.locator("#arrived").is_visible()


def test_the_loading_is_played_again_at_the_rate_that_is_chosen(page, sample_ath):
    """Without a server's help: the bytes come no faster than such a line has them."""
    page.evaluate("athcodecViewer.setLevel('1')")
    page.click("#replay button[data-mbit='1']")
    page.wait_for_function("() => athcodecViewer.motion?.readyLevel >= 1 && athcodecViewer.counters.arrived.first")
    page.evaluate("athcodecViewer.setLevel('auto')")
    page.wait_for_function("() => athcodecViewer.counters.arrived.whole")
    fetched, seconds = page.evaluate(
        "[athcodecViewer.motion.bytesFetched, athcodecViewer.counters.arrived.whole / 1000]"
    )
    assert fetched > 0.9 * sample_ath.stat().st_size
    assert 8 * fetched / seconds <= 1.02e6
    page.wait_for_function("() => document.getElementById('timing').textContent.includes('full detail after')")
    assert page.get_attribute("#progress", "aria-valuenow") == "100"
    page.wait_for_function("() => getComputedStyle(document.getElementById('progress')).opacity === '0'")


def test_loading_is_told_before_the_first_picture(opened, sample_ath):
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}, rate=2_000) as line:
        page = opened(line.page("tree.ath"), "document.getElementById('arrived').textContent === 'Loading…'")
        assert page.inner_text("#name") == "tree.ath" and page.is_visible("#progress")


@pytest.mark.parametrize("size", [(390, 844), (1000, 700)])
def test_while_bytes_come_the_page_says_how_many_of_how_many_are_here(opened_file, size):
    """As if the line had stopped: what has come is set here, so that no clock decides what is seen."""
    page = opened_file(athcodec.sample_path("fern").read_bytes(), viewport=dict(zip(("width", "height"), size)))
    page.evaluate("""() => {
      const { motion } = athcodecViewer;
      athcodecViewer.setLevel(String(motion.levelCount - 1));
      const stopped = { bytesFetched: 5900, complete: false, level: 0 };
      for (const [name, value] of Object.entries(stopped))
        Object.defineProperty(motion, name, { get: () => value, set() {} });
    }""")
    says = "/^Streaming: 5.9 of 41 kB, within [\\d.]+ .?m of the source$/"
    page.wait_for_function(
        f"() => {says}.test(document.getElementById('arrived').textContent.replaceAll('\\xa0', ' '))"
    )
    assert page.is_visible("#arrived") and page.get_attribute("#progress", "aria-valuenow") == "14"


def test_arrows_move_the_choice_in_a_group(page):
    page.locator("#colour [data-value=plant]").focus()
    keys = ("Right", "Right", "Left", "Up", "Up")
    for key, value in zip(keys, ("part", "order", "part", "plant", "error")):
        page.keyboard.press(f"Arrow{key}")
        assert chosen(page, "colour") == value
        assert page.evaluate("document.activeElement.dataset.value") == value
    assert page.evaluate("document.querySelectorAll('#colour [tabindex=\"0\"]').length") == 1


def test_the_view_turns_and_zooms_by_keys_and_a_double_tap_resets_it(page):
    page.evaluate("athcodecViewer.setPlaying(false)")
    before = page.evaluate(VIEW)
    page.locator("#canvas").focus()
    time = page.evaluate("athcodecViewer.state.time")
    page.keyboard.press("ArrowRight")
    turned = page.evaluate(VIEW)
    page.keyboard.press("+")
    nearer = page.evaluate(VIEW)
    target = page.evaluate("athcodecViewer.stage.controls.target.toArray()")
    assert turned != before and page.evaluate("athcodecViewer.state.time") == time
    assert sum((a - b) ** 2 for a, b in zip(nearer, target)) < 0.8 * sum((a - b) ** 2 for a, b in zip(turned, target))
    page.mouse.dblclick(400, 500)
    assert page.evaluate(VIEW) == pytest.approx(before)


def test_a_double_tap_fits_by_touch(opened_file, sample_ath):
    page = opened_file(sample_ath.read_bytes(), has_touch=True, viewport={"width": 390, "height": 844})
    page.evaluate("athcodecViewer.setPlaying(false)")
    before, fingers = page.evaluate(VIEW), Fingers(page)
    page.evaluate("athcodecViewer.moveView(1, 0.2)")
    assert page.evaluate(VIEW) != pytest.approx(before)
    for _ in range(2):
        fingers.tap((200, 500))
    page.wait_for_function("() => !athcodecViewer.stage.moved")
    assert page.evaluate(VIEW) == pytest.approx(before, rel=1e-3)
    page.touchscreen.tap(*centre(page, "#toggle-panel"))
    page.touchscreen.tap(*centre(page, "#colour [data-value=order]"))
    assert chosen(page, "colour") == "order"


def test_two_levels_lie_under_one_split_that_is_dragged_and_moved_by_keys(page):
    page.locator("#level-choice button").last.click()
    page.click("#compare [data-value=levels]")
    assert page.evaluate("athcodecViewer.plants.length") == 2 and page.is_visible("#split")
    chips = [text.replace("\n±", ": within ") for text in page.locator("#level-choice button").all_inner_texts()]
    assert chips == [text.replace("\n±", ": within ") for text in page.locator("#left-choice button").all_inner_texts()]
    for side, text in (("left", f"First {chips[1]} of the source"), ("right", f"All {chips[-1]} of the source")):
        page.wait_for_function(
            "([side, text]) => document.getElementById(`split-${side}`).innerText === text", arg=[side, text]
        )
    x, y = centre(page, "#split svg")
    drag(page, (x, y), (x - 150, y))
    share = page.evaluate("athcodecViewer.stage.split")
    width = page.evaluate("document.getElementById('split-view').clientWidth")
    assert share == pytest.approx(0.5 - 150 / width, abs=0.01)
    page.keyboard.press("ArrowRight")
    assert page.evaluate("athcodecViewer.stage.split") == pytest.approx(share + 0.02)
    assert page.get_attribute("#split", "aria-valuetext").startswith(f"{round(100 * (share + 0.02))} %")
    page.click("#compare [data-value=off]")
    assert not page.is_visible("#split")


def test_the_sides_of_a_split_never_show_the_same_level(page):
    """Whichever is chosen on either side; while they do, as bytes come, there is no split to see."""
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.click("#compare [data-value=levels]")
    count = page.evaluate("athcodecViewer.motion.levelCount")
    for left in range(count):
        page.evaluate(f"athcodecViewer.setLeft({left})")
        for right in ("auto", *map(str, range(count))):
            page.evaluate(f"athcodecViewer.setLevel({right!r})")
            targets = page.evaluate("athcodecViewer.plants.map(({ motion }) => motion.target)")
            assert targets[0] != targets[1] and (targets[0] == left or targets[1] == left), (left, right)
    for group in ("left-choice", "level-choice"):
        page.click(f"#{group} [data-value='1']")
    page.wait_for_function("() => athcodecViewer.plants.every(({ motion }) => motion.level === motion.target)")
    page.wait_for_function("() => document.querySelector('#left-choice [aria-current=true]').dataset.value === '0'")
    page.evaluate("athcodecViewer.plants[0].motion.setLevel(1)")
    page.evaluate("Object.defineProperty(athcodecViewer.plants[0].motion, 'level', { get: () => 1, set() {} })")
    page.wait_for_function("() => document.getElementById('split-view').hidden")


def test_the_colours_of_the_error_end_where_99_in_100_points_do(page):
    page.evaluate("athcodecViewer.setLevel('0')")
    page.click("#colour [data-value=error]")
    page.wait_for_function("() => /^[\\d.,]+ mm, more$/.test(document.getElementById('scale-high').textContent)")
    high = float(page.inner_text("#scale-high").split()[0].replace(",", ""))
    errors = page.evaluate("athcodecViewer.motion.error(0)")
    assert high == pytest.approx(1000 * errors["p99"], rel=0.01) and errors["p99"] < errors["max"]


def test_no_number_promises_more_than_is_shown(page):
    """Less than a pixel is said only where the level that is shown has such an error there."""
    for level in range(page.evaluate("athcodecViewer.motion.levelCount")):
        page.evaluate(f"athcodecViewer.setLevel('{level}')")
        page.wait_for_function(f"() => athcodecViewer.motion.level === {level} && !athcodecViewer.motion.fading")
        page.wait_for_timeout(600)
        off = page.evaluate(PIXELS_OFF)
        assert ("Under a pixel" in page.get_attribute("#arrived", "title")) == (off <= 1)


def test_wind_is_one_weight_from_calm_to_gale_and_the_gale_comes_first(opened_file, windy):
    page = opened_file(windy)
    assert page.evaluate("athcodecViewer.motion.clip.name") == "gale" and page.input_value("#wind") == "1"
    page.locator("#wind").focus()
    for _ in range(10):
        page.keyboard.press("ArrowLeft")
    strength = page.evaluate("athcodecViewer.state.wind")
    assert strength == pytest.approx(2 + 0.9 * 8, abs=0.01) and page.input_value("#clip") == "wind"
    page.wait_for_function("() => athcodecViewer.motion.level >= 0")
    page.select_option("#clip", label="calm")
    assert page.evaluate("athcodecViewer.state.wind") is None and page.input_value("#wind") == "0"
    assert page.evaluate("athcodecViewer.plants[0].root.rotation.y") == 0


def test_a_file_opens_with_the_story_of_how_it_comes(opened_file, windy, opened):
    """Each level beside the best that has come, unless somebody does anything, or an address says what is seen."""
    with ThrottledServer({"tree.ath": windy}) as line:
        intro = "globalThis.athcodecViewer?.state.intro"
        tag = "document.getElementById('split-{}').textContent.startsWith('{}')"
        words = f"{intro} && {tag.format('left', 'First')} && {tag.format('right', 'All')}"
        small = {"viewport": {"width": 500, "height": 350}}  # The story takes six seconds, in software, too.
        page = opened(line.page("tree.ath", intro="on"), words, **small)
        last = "document.querySelector('#left-choice button:nth-last-child(2)').ariaCurrent === 'true'"
        page.wait_for_function(f"() => !{intro} || {last}")
        assert page.evaluate(intro) and page.is_visible("#split-view")
        page.wait_for_function("() => athcodecViewer.plants.length === 1 && !athcodecViewer.state.intro")
        page = opened(line.page("tree.ath", intro="on"), intro, **small)
        page.keyboard.press("c")
        assert page.evaluate("athcodecViewer.plants.length") == 1
        page = opened(line.page("tree.ath", intro="on") + "#colour=order")
        assert page.evaluate("athcodecViewer.plants.length") == 1


def test_every_control_answers_to_a_finger(opened_file, windy):
    page = opened_file(windy, has_touch=True, viewport={"width": 390, "height": 844})
    fingers = Fingers(page)

    def tapped(selector: str, then: str):
        page.locator(selector).tap()
        return page.evaluate(then)

    def dragged(selector: str, x: float, y: float) -> None:
        page.locator(selector).scroll_into_view_if_needed()
        start = centre(page, selector)
        fingers.go((start, (start[0] + x, start[1] + y)))

    assert tapped("#play", "athcodecViewer.state.playing") is False
    page.locator("#time").tap(position={"x": 80, "y": 15})
    assert page.evaluate("athcodecViewer.state.time") > 0.3
    assert tapped("#loop", "athcodecViewer.motion.wrap") in ("loop", "clamp")
    assert not page.is_visible("#replay")
    tapped("#more", "0")
    assert page.is_visible("#replay") and page.get_attribute("#more", "aria-expanded") == "true"
    distance = "athcodecViewer.stage.controls.getDistance()"
    far = page.evaluate(distance)
    fingers.go(((160, 400), (60, 400)), ((230, 400), (330, 400)))
    page.wait_for_function(f"() => {distance} < {0.8 * far}")
    tapped("#toggle-panel", "0")
    assert tapped("#level-choice [data-value='1']", "athcodecViewer.motion.target") == 1
    assert tapped("#colour [data-value=part]", "athcodecViewer.plants[0].colour") == "part"
    assert tapped("#show [data-value=lines]", "athcodecViewer.plants[0].show") == "lines"
    assert tapped("#compare [data-value=levels]", "athcodecViewer.plants.length") == 2
    dragged("#split svg", -80, 0)
    assert page.evaluate("athcodecViewer.stage.split") == pytest.approx(0.5 - 80 / 390, abs=0.02)
    tapped("#compare [data-value=off]", "0")
    page.locator("#wind").scroll_into_view_if_needed()
    page.locator("#wind").tap(position={"x": 40, "y": 15})
    assert 2 < page.evaluate("athcodecViewer.state.wind") < 10
    assert tapped("#forest", "Boolean(athcodecViewer.state.forest)") is True


REACHABLE = """() => [...document.querySelectorAll("button, input, select, summary, [tabindex]")]
  .filter((each) => each.checkVisibility() && each.tabIndex >= 0 && !each.disabled)"""


def test_every_control_is_reached_by_tab(opened_file, windy):
    page = opened_file(windy)
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.click("#compare [data-value=levels]")
    wanted = page.evaluate(f"globalThis.wanted = ({REACHABLE})(); wanted.length")
    page.evaluate("""() => {
      globalThis.reached = new Set();
      document.addEventListener("focusin", ({ target }) => reached.add(target));
    }""")
    for _ in range(wanted + 2):
        page.keyboard.press("Tab")
    assert page.evaluate("wanted.filter((each) => !reached.has(each)).map((each) => each.outerHTML)") == []


PIXELS = """(stage) => {
  stage.render();
  const gl = stage.renderer.getContext(), { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
  const out = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, out);
  return out;
}"""


def test_grass_sways_and_the_plants_of_a_forest_cast_shadows(opened):
    with ThrottledServer({"fern.ath": athcodec.sample_path("fern").read_bytes()}) as line:
        page = opened(line.page("fern.ath", quality="full"), viewport={"width": 320, "height": 240})
        page.evaluate("athcodecViewer.setPlaying(false)")
        page.evaluate(f"globalThis.seen = () => ({PIXELS})(athcodecViewer.stage)")
        moved = page.evaluate("""() => {
          athcodecViewer.stage.breeze(0, 1, 0);
          const before = seen();
          athcodecViewer.stage.breeze(1, 1, 0);
          return seen().filter((value, i) => Math.abs(value - before[i]) > 8).length;
        }""")
        assert moved > 100
        page.evaluate("athcodecViewer.forestOf(30)")
        page.wait_for_function("() => athcodecViewer.forests()[0].counts.some((count) => count > 0)")
        darker = page.evaluate("""() => {
          const shadowed = seen();
          athcodecViewer.stage.panes[0].scene.getObjectByName("sun").castShadow = false;
          return seen().filter((value, i) => value - shadowed[i] > 15).length;
        }""")
        assert darker > 300


def test_a_file_of_one_clip_has_no_wind_to_choose(page):
    assert not page.is_visible("#wind-section")


def test_sliders_are_read_out_with_units(page):
    page.wait_for_function("() => document.getElementById('time').getAttribute('aria-valuetext')")
    assert re.fullmatch(r"[\d.]+ of [\d.]+ seconds", page.get_attribute("#time", "aria-valuetext"))
    assert page.get_attribute("#forest-count", "aria-valuetext").endswith(" plants")


def test_arrows_on_the_time_go_from_frame_to_frame(page):
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.keyboard.press("Home")
    page.locator("#time").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("athcodecViewer.state.time") == pytest.approx(2 / 30, rel=1e-3)


@pytest.mark.parametrize("size", [(1000, 700), (390, 844)])
def test_the_thumb_of_the_time_runs_on_its_track(opened_file, sample_ath, size):
    page = opened_file(sample_ath.read_bytes(), viewport=dict(zip(("width", "height"), size)))
    assert centre(page, "#time")[1] == pytest.approx(centre(page, "#ready")[1], abs=0.5)


def test_the_address_brings_back_what_is_looked_at(opened, opened_file, windy):
    page = opened_file(windy)
    page.select_option("#clip", label="across")
    page.wait_for_function("() => !athcodecViewer.motion.switching")
    page.click("#colour [data-value=order]")
    page.evaluate("athcodecViewer.setLevel('1')")
    page.evaluate("athcodecViewer.moveView(0.5, 0.1, 0.8)")
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.evaluate("athcodecViewer.seek(1)")
    page.wait_for_function("() => location.hash.includes('t=1')")
    view, address = page.evaluate(VIEW), page.evaluate("location.href")
    page = opened(address, "athcodecViewer.state.time === 1")
    assert page.evaluate("athcodecViewer.motion.clip.name") == "across"
    assert chosen(page, "colour") == "order" and chosen(page, "level-choice") == "1"
    assert page.evaluate(VIEW) == pytest.approx(view, rel=1e-3)


def test_an_address_that_is_changed_in_an_open_page_is_followed(opened_file, windy):
    page = opened_file(windy)
    page.evaluate("location.hash = 'colour=order&detail=1&clip=calm&t=0.5'")
    page.wait_for_function("() => athcodecViewer.state.time === 0.5 && athcodecViewer.motion.clip.name === 'calm'")
    assert chosen(page, "colour") == "order" and chosen(page, "level-choice") == "1"
    page.evaluate("location.hash = ''")
    page.wait_for_function("() => athcodecViewer.state.playing && athcodecViewer.motion.clip.name === 'gale'")
    assert chosen(page, "colour") == "plant" and page.is_checked("#auto")


def test_while_nothing_is_on_the_stage_no_control_reaches_for_a_plant(opened_file, windy):
    """Figures are open, and a wind is chosen; what goes wrong would be in the log."""
    page = opened_file(windy)
    page.click("summary:has-text('Figures')")
    page.evaluate("athcodecViewer.setWind(5, 30)")
    page.click("#replay button[data-mbit='1']")
    assert page.evaluate("athcodecViewer.plants.length === 0 && document.querySelector('footer').inert")
    for key in ("c", "d", "f", "n", ".", "l", "]"):
        page.keyboard.press(key)
    page.evaluate("athcodecViewer.state.dirty = true")
    page.wait_for_function("() => athcodecViewer.plants.length === 1 && !document.querySelector('footer').inert")


PLACED = (Path(__file__).parent / "node" / "placed.js").read_text("utf-8")


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768), (1280, 640), (1100, 760), (844, 390), (390, 844)])
def test_no_card_covers_the_plant(opened_file, sample_ath, size):
    page = opened_file(sample_ath.read_bytes(), viewport=dict(zip(("width", "height"), size)))
    for panel in ("as it opens", "the other way"):
        page.wait_for_timeout(300)  # cards are measured when the browser has laid them out
        found = page.evaluate(PLACED)
        assert found["over"] == found["outside"] == [] and found["share"] > 0.3, (panel, found)
        page.click("#toggle-panel")


def test_the_plant_takes_seventy_per_cent_of_the_free_height_at_every_size_of_the_window(opened_file):
    page = opened_file(athcodec.sample_path("leafed").read_bytes())
    for width, height in ((1440, 900), (1024, 768), (844, 390), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        if height < 400:  # Low windows open without the panel.
            page.click("#toggle-panel")
        for _ in range(50):  # cards are measured when the browser has laid them out
            tall = page.evaluate(PLACED)["tall"]
            if abs(tall - 0.7) < 0.03:
                break
            page.wait_for_timeout(100)
        assert tall == pytest.approx(0.7, abs=0.03), (width, height, page.evaluate("athcodecViewer.stage.room"))


def test_the_playback_stands_below_the_middle_of_the_plant(opened_file, sample_ath):
    page = opened_file(sample_ath.read_bytes())
    for width, height in ((1440, 900), (1024, 768), (844, 390), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        for panel in ("as it was", "the other way"):
            for _ in range(50):  # cards are measured when the browser has laid them out
                plant = page.evaluate(PLACED)["plant"]
                middle, wide = (plant["left"] + plant["right"]) / 2, plant["right"] - plant["left"]
                off = centre(page, "footer")[0] - middle
                if abs(off) < 0.1 * wide:
                    break
                page.wait_for_timeout(100)
            assert abs(off) < 0.1 * wide, (width, height, panel, off, wide)
            page.click("#toggle-panel")


def test_in_a_window_that_cards_fill_the_plant_stands_behind_them(opened_file):
    page = opened_file(athcodec.sample_path("grass").read_bytes(), "true", viewport={"width": 330, "height": 240})
    page.wait_for_function("() => globalThis.athcodecViewer?.motion?.level > 0")
    assert page.evaluate("athcodecViewer.stage.pixels") > 100


def test_who_wants_less_motion_sees_a_still_first_frame_and_a_button(opened_file, sample_ath):
    page = opened_file(sample_ath.read_bytes(), reduced_motion="reduce")
    page.wait_for_timeout(500)
    assert page.evaluate("athcodecViewer.motion.frame") == 0 and page.get_attribute("#play", "aria-label") == "Play"
    page.click("#play")
    page.wait_for_function("() => athcodecViewer.motion.frame > 1")


def test_a_lost_context_is_restored(opened_file, sample_ath):
    page = opened_file(sample_ath.read_bytes(), quiet="WebGL")
    page.evaluate(f"globalThis.seen = () => ({PIXELS})(athcodecViewer.stage)")
    colours = "new Set(seen()).size"
    before = page.evaluate(f"athcodecViewer.setPlaying(false), {colours}")
    page.evaluate("""async () => {
      const { canvas, renderer } = athcodecViewer.stage;
      const lost = renderer.getContext().getExtension("WEBGL_lose_context");
      const told = (type) => new Promise((done) => canvas.addEventListener(type, () => setTimeout(done)));
      const gone = told("webglcontextlost"), back = told("webglcontextrestored");
      lost.loseContext();
      await gone;
      lost.restoreContext();
      await back;
    }""")
    assert page.evaluate(colours) > 0.8 * before > 20


def test_a_line_says_what_of_an_address_was_not_understood(opened, sample_ath):
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        wrong = ["clip=none", "detail=99", "view=a b", "wind=x", "colour=none", "split=abc", "t=soon", "show=node"]
        page = opened(line.page("tree.ath") + f"#{'&'.join(wrong)}&colour=part".replace(" ", "+"))
        assert page.evaluate("athcodecViewer.motion.automatic") and page.evaluate("athcodecViewer.plants.length") == 1
        assert chosen(page, "colour") == "part"
        assert page.inner_text("#note") == f"Not understood in the address: {', '.join(wrong)}"
        words = {group: page.evaluate(BUTTONS, group) for group in ("colour", "show")}
        assert all(value == text.lower() for pairs in words.values() for value, text in pairs), words


BUTTONS = """(group) => [...document.querySelectorAll(`#${group} button`)]
  .map((each) => [each.dataset.value, each.textContent])"""


@pytest.mark.parametrize(
    "name, head, kind",
    [
        ("fern.abc", b"Ogawa\xff", "Alembic"),
        ("my fern.usdc", b"PXR-USDC", "USD"),
        ("fern.h5", b"\x89HDF\r\n\x1a\n", "HDF5"),
    ],
)
def test_a_dropped_file_of_another_program_is_named_with_the_command_that_encodes_it(opened, name, head, kind):
    """However it comes: dropped, or by its address."""
    data = head + bytes(100)
    with ThrottledServer({name: data}) as line:
        page = opened(line.page(), "document.querySelectorAll('#samples li').length === 0", quiet="404")
        made = name.rsplit(".", 1)[0] + ".ath"
        quoted = [f"'{each}'" if " " in each else each for each in (name, made)]
        for way in (f"open({{ bytes: Uint8Array.from({list(data)}).buffer }}, {name!r})", f"open('/{name}', {name!r})"):
            page.evaluate(f"athcodecViewer.{way}")
            page.wait_for_function(f"() => document.querySelector('#message h2').textContent === 'This is {kind}'")
            assert f"athcodec encode {quoted[0]} {quoted[1]}" in page.inner_text("#message p")


@pytest.mark.parametrize("size", [(1000, 700), (390, 844)])
def test_a_page_without_a_file_has_samples_that_move_and_a_field_for_an_address(opened, sample_ath, size):
    names = ("leafed_tree", "fern", "grass")
    paths = [athcodec.sample_path(name.partition("_")[0]) for name in names]
    files = {f"sample/{each.name}": each.read_bytes() for path in paths for each in (path, path.with_suffix(".webp"))}
    with ThrottledServer(files | {"tree.ath": sample_ath.read_bytes()}) as line:
        moves = "[...document.querySelectorAll('#samples ath-viewer')].every(({ currentTime }) => currentTime > 0.1)"
        page = opened(line.page(), moves, viewport=dict(zip(("width", "height"), size)))
        assert page.is_visible("#message-open") and page.inner_text("#message-open") == "Choose a file"
        page.fill("#where input", f"{line.address}tree.ath")
        page.click("#where button")
        page.wait_for_function("() => athcodecViewer.motion?.complete")
        assert page.url.endswith("tree.ath") and not page.is_visible("#message")


CUT_OFF = """() => [...document.querySelectorAll("h1, #sizes, #sizes *, #arrived, #clock, footer")].filter((each) => {
  const { left, right } = each.getBoundingClientRect(), { clientWidth, scrollWidth } = each;
  return each.checkVisibility()
    && (left < 0 || right > innerWidth || (clientWidth > 0 && scrollWidth > clientWidth + 1));
}).map((each) => each.id || each.tagName)"""


@pytest.mark.parametrize("font", [16, 32])
def test_a_page_of_320_pixels_reflows_and_its_text_follows_the_font_size(browser, sample_ath, font):
    page = browser.new_page(viewport={"width": 320, "height": 640})
    page.set_default_timeout(SLOWEST)
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        page.goto(line.page("tree.ath"))
        page.wait_for_function("() => globalThis.athcodecViewer?.motion?.complete")
        page.evaluate(f"document.documentElement.style.fontSize = '{font}px'")
        wide = page.evaluate(CUT_OFF)
        assert wide == []
        assert page.evaluate("getComputedStyle(document.querySelector('#sizes')).fontSize") == f"{0.875 * font:g}px"
    page.close()


def test_links_and_embed_code_are_copied(opened_file, sample_ath):
    page = opened_file(sample_ath.read_bytes())
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("#link")
    page.wait_for_function("() => !document.getElementById('note').hidden")
    assert page.evaluate("navigator.clipboard.readText()") == page.evaluate("location.href")
    assert "this computer" in page.inner_text("#note")
    page.click("#embed")
    page.wait_for_function("() => document.getElementById('note').textContent.startsWith('Embed')")
    assert page.evaluate("navigator.clipboard.readText()").startswith('<iframe src="http')


def test_a_video_is_saved(page):
    with page.expect_download() as download:
        page.click("#video")
        page.wait_for_timeout(1500)
        page.click("#video")
    assert download.value.suggested_filename.endswith(".webm")
    assert Path(download.value.path()).read_bytes()[:4] == b"\x1aE\xdf\xa3"
    page.wait_for_function("() => document.getElementById('video').textContent === 'Save video'")


def test_the_page_fills_the_screen(page):
    page.click("#fullscreen")
    page.wait_for_function(
        "() => document.fullscreenElement && document.getElementById('fullscreen').ariaPressed === 'true'"
    )
    page.click("#fullscreen")
    page.wait_for_function("() => !document.fullscreenElement")


def test_a_file_that_cannot_be_fetched_can_be_tried_again(browser, sample_ath):
    with ThrottledServer({}) as line:
        page = browser.new_page()
        page.set_default_timeout(SLOWEST)
        page.goto(line.page("tree.ath"))
        page.wait_for_selector("#again")
        assert "cannot be fetched" in page.inner_text("#message h2")
        line.files["tree.ath"] = sample_ath.read_bytes()
        page.click("#again")
        page.wait_for_function("() => athcodecViewer.motion?.complete")
        assert not page.is_visible("#message")
        page.close()


def test_a_file_that_ends_within_a_chunk_is_fetched_once_and_said_to_be_cut_off(opened):
    path = athcodec.sample_path("leafed")
    with athcodec.open(path) as decoder:
        moves = [
            chunk for chunk in decoder.file.chunks if chunk.segment == 0 and chunk.level < decoder.file.level_count
        ]
    chunk = max(moves, key=lambda chunk: chunk.length)  # It belongs to the clip that plays.
    data = path.read_bytes()[: chunk.offset + chunk.length // 2]
    with ThrottledServer({"tree.ath": data}) as line:
        page = opened(line.page("tree.ath"), "document.getElementById('trouble').checkVisibility()")
        assert "cut off" in page.inner_text("#trouble")
        pictures = page.evaluate("athcodecViewer.counters.pictures")
        page.wait_for_function(f"() => athcodecViewer.counters.pictures > {pictures + 3}")
        assert line.sent("tree.ath") < 1.6 * len(data)


def test_the_command_line_makes_pictures_that_move(sample_ath, tmp_path):
    for kind, more in (("png", ["--time", "1"]), ("gif", []), ("webp", [])):
        out = tmp_path / f"tree.{kind}"
        command = ["picture", str(sample_ath), f"--{kind}", str(out), "--size", "160x120", "--fps", "2", *more]
        done = subprocess.run([sys.executable, "-m", "athcodec", *command], capture_output=True, text=True)
        assert done.stdout == f"{out}: {out.stat().st_size:,} bytes\n", done.stderr
        with Image.open(out) as image:
            frames = [np.asarray(image.convert("RGB")) for _ in ImageSequence.Iterator(image)]
            assert image.size == (160, 120) and image.format.lower() == kind
        assert len(frames) == (1 if kind == "png" else 8)  # four seconds
        assert np.ptp(frames[0]) > 100
        assert all((a != b).any() for a, b in zip(frames, frames[1:]))


def test_a_picture_without_what_it_takes_is_an_error_of_one_line(sample_ath, tmp_path, monkeypatch, capsys):
    out = tmp_path / "tree.gif"
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "PIL", None)
        assert cli.main(["picture", str(sample_ath), "--gif", str(out)]) == 1
    error = capsys.readouterr().err.strip()
    assert 'pip install "athcodec[picture]"' in error and "\n" not in error
    assert cli.main(["picture", str(sample_ath), "--gif", str(out), "--clip", "none"]) == 1
    assert "none" in capsys.readouterr().err and not out.exists()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1200, 800), (390, 844)])
def test_axe_finds_nothing(opened, windy, scheme, size):
    with ThrottledServer({"tree.ath": windy, "page.ath": b"<!doctype html>" + bytes(100)}) as line:
        page = opened(
            line.page("tree.ath"), viewport=dict(zip(("width", "height"), size)), color_scheme=scheme, bypass_csp=True
        )
        page.add_script_tag(path=modules() / "axe-core/axe.min.js")
        page.evaluate("athcodecViewer.setPlaying(false)")

        def violations() -> list[str]:
            return page.evaluate(
                "axe.run().then(({ violations }) => violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`))"
            )

        assert violations() == []
        if size[0] < 680:
            page.click("#toggle-panel")
        page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
        page.click("#compare [data-value=levels]")
        page.click("#colour [data-value=error]")
        assert violations() == []
        page.click("#help")
        assert violations() == []
        page.keyboard.press("Escape")
        page.evaluate("athcodecViewer.open('/page.ath', 'page.ath')")
        page.wait_for_selector("#message")
        assert violations() == []
