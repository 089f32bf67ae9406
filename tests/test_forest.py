"""Forests on WebGPU: plants are where the decoder has them, and every instance in view is drawn.

In Chromium, Debian's, without a graphics card; marker `browser`.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from conftest import WEBGPU_FLAGS
from plants import bending_tube, blown_tree

import athcodec
from athcodec.decoding.core_file import FILE_ORDER
from athcodec.gpu import GpuFile
from athcodec.gpu.evaluate import Passes, Source
from athcodec.motion.joining import in_wind
from athcodec.viewer.build_viewer import modules
from athcodec.viewer.picture import chromium
from bench.throttled_server import ThrottledServer

pytestmark = pytest.mark.browser
FINEST = "athcodecForest.forest.levels.length === athcodecForest.ath.motion.levelCount"


@pytest.fixture(scope="module")
def browser():
    with chromium(WEBGPU_FLAGS) as found:
        yield found


@pytest.fixture(scope="module")
def grove(tmp_path_factory):
    """A file of two clips, in segments."""
    path = tmp_path_factory.mktemp("grove") / "grove.ath"
    gale, calm = blown_tree(3, 60, 30), blown_tree(3, 60, 24, sway=0.02)
    return athcodec.encode(athcodec.join({"gale": gale, "calm": calm}), path, rel_error=1e-3, segment_frames=20).path


@pytest.fixture(scope="module")
def winds(tmp_path_factory):
    """A file of two clips that say how strong their wind is."""
    path = tmp_path_factory.mktemp("winds") / "winds.ath"
    clips = {
        "calm": in_wind(blown_tree(3, 60, 48, sway=0.02), 2.0, 0.0),
        "gale": in_wind(blown_tree(3, 60, 40), 8.0, 0.0),
    }
    return athcodec.encode(athcodec.join(clips), path, rel_error=1e-3, segment_frames=20).path


@pytest.fixture
def opened(browser):
    """A function that opens the forest of a file, stopped; the page must not have logged an error at the end."""
    with ThrottledServer({}) as line:
        errors, page = [], browser.new_page(viewport={"width": 360, "height": 240})
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))

        def visit(path: Path, count: int, until: str = FINEST, floor: Path | None = None):
            line.files["plant.ath"] = path.read_bytes()
            line.files["floor.ath"] = floor.read_bytes() if floor else b""
            more = "&floor=floor.ath&each=3" if floor else ""
            page.goto(f"{line.address}forest.html?file=plant.ath&count={count}{more}")
            page.wait_for_function(f"() => athcodecForest.forest && {until}", timeout=120_000)
            page.evaluate("athcodecForest.playing = false")
            return page

        yield visit
        page.close()
    assert errors == []


def shown(page, seconds: float, level: int, strength: float = 1.0) -> np.ndarray:
    """(plants, vertices, 9): position, normal and previous position at a time, of all plants."""
    page.evaluate(
        "([seconds, strength]) => { const { forest, camera } = athcodecForest;"
        " camera.position.set(0, 1, 0);"
        " camera.updateMatrixWorld();"
        " forest.sway(strength).update(camera, 1e6, seconds); }",
        [seconds, strength],
    )
    numbers = page.evaluate(f"athcodecForest.forest.vertices({level}).then((found) => Array.from(found))")
    plants = page.evaluate("athcodecForest.forest.plantCount")
    return np.array(numbers, np.float32).reshape(plants, -1, 9)


def test_plants_of_a_forest_are_where_the_decoder_has_them(opened, grove):
    page = opened(grove, 40)
    file = GpuFile(grove.read_bytes())
    core, info = file.core, file.core.info
    level = info.level_count - 1
    prepared = [file.prepared(segment, level) for segment in range(info.segment_count)]
    starts = core.segment_starts(range(info.segment_count + 1))
    every = np.empty((info.frame_count, info.vertex_count, 3))
    for frame in range(info.frame_count):
        segment = int(np.searchsorted(starts, frame, side="right")) - 1
        core.positions(prepared[segment], float(frame), every[frame], FILE_ORDER)
    every -= np.array(info.origin)
    got = shown(page, 0.0, level)[..., :3]
    allowed = 0.05 * info.max_error
    first = [clip.first_frame for clip in core.clips()]
    nearest = [min(float(np.abs(plant - every[frame]).max()) for frame in first) for plant in got]
    assert sorted(nearest)[1] <= allowed, "two plants are ahead by nothing: they show the first frames of the clips"
    low, high = every.min((0, 1)) - allowed, every.max((0, 1)) + allowed
    assert (got >= low).all() and (got <= high).all()
    before = shown(page, 0.4, level)[..., 6:]
    assert np.array_equal(before, got), "the previous positions are those of the picture before"


@pytest.mark.parametrize("count", [1, 4])
def test_a_level_that_was_not_shown_in_the_picture_before_has_no_velocity(opened, grove, count):
    """Its positions of some earlier picture would be a jump for motion blur."""
    page = opened(grove, count, f"(athcodecForest.camera.position.set(0, 1, 1), {FINEST})")
    with athcodec.open(grove) as decoder:
        level = decoder.levels[-1].level
    shown(page, 0.0, level)
    page.evaluate(
        "() => { const { forest, camera } = athcodecForest; camera.position.set(0, 1, 1e7);"
        " camera.updateMatrixWorld(); forest.update(camera, 100, 0.4); }"
    )
    again = shown(page, 0.8, level)
    assert np.array_equal(again[..., 6:], again[..., :3])
    after = shown(page, 0.85, level)
    assert np.array_equal(after[..., 6:], again[..., :3]) and not np.array_equal(after[..., 6:], after[..., :3])


def blocks_show(path: Path, seconds: float, weights: dict[str, float], phase: float = 0.0) -> np.ndarray:
    """(N, 3): what the blocks of the file show of its clips, each around its own time."""
    file = GpuFile(path.read_bytes())
    level = file.core.info.level_count - 1
    starts = file.core.segment_starts(range(file.core.info.segment_count + 1))
    with athcodec.open(path) as decoder:
        clips = {clip.name: clip for clip in decoder.file.clips}
    sources = []
    for name, weight in weights.items():
        clip = clips[name]
        frame = (30 * seconds + phase * clip.frame_count) % clip.frame_count
        for at, share in ((int(frame), 1 - frame % 1), (int(frame) + 1, frame % 1)):
            first = clip.first_frame + at % clip.frame_count
            segment = int(np.searchsorted(starts, first, side="right")) - 1
            coded = np.array([file.coded_frame(first)])
            sources.append(Source(file.segment(segment, level), coded, np.array([weight * share])))
    return Passes(file.level(level), *sources).vertices()[0]


@pytest.mark.parametrize(
    ("strength", "weights", "times"),
    [(6.5, {"calm": 0.25, "gale": 0.75}, (0.1, 0.55)), (8.0, {"gale": 1.0}, (0.1, 0.5))],
)
def test_a_wind_blends_clips_on_the_card(opened, winds, strength, weights, times):
    """Also between frames, where one clip alone is a mean of positions."""
    page = opened(winds, 1)
    level = page.evaluate("athcodecForest.ath.motion.levelCount - 1")
    page.evaluate(
        "(strength) => { athcodecForest.forest.ease = 0; return athcodecForest.forest.wind(strength); }", strength
    )
    for seconds in times:
        got = settled(page, seconds, level)
        ((_, phase),) = page.evaluate("athcodecForest.forest.plants")
        assert np.abs(got - blocks_show(winds, seconds, weights, phase)).max() < 1e-4


def settled(page, seconds: float, level: int) -> np.ndarray:
    """(N, 3): the only plant, once all clips that it shows are on the card."""
    shown(page, seconds, level)
    page.wait_for_function(
        "athcodecForest.forest.levels.every(({ clips }) => clips.size === athcodecForest.forest.clips.length)"
    )
    return shown(page, seconds, level)[0, :, :3]


def test_a_clip_that_comes_late_does_not_jump(opened, winds):
    """Weights change over a time, once the bytes are here."""
    page = opened(winds, 1)
    level = page.evaluate("athcodecForest.ath.motion.levelCount - 1")
    page.evaluate("athcodecForest.forest.wind(8)")
    before = settled(page, 0.3, level)
    page.evaluate("athcodecForest.forest.ease = 1e6, athcodecForest.forest.wind(2)")
    after = settled(page, 0.3, level)
    assert 0 <= np.abs(after - before).max() < 1e-3
    page.evaluate("athcodecForest.forest.ease = 0")
    assert np.abs(settled(page, 0.3, level) - before).max() > 0.01


def test_every_instance_in_view_is_drawn_once_and_wind_of_no_strength_is_still(opened, grove):
    page = opened(grove, 300)
    page.evaluate(
        "() => { const { camera, forest, ath } = athcodecForest, r = ath.sphere.radius;"
        " camera.position.set(0, 100 * r, 0.01 * r);"
        " camera.lookAt(0, 0, 0); camera.updateMatrixWorld(); forest.update(camera, 240, 0); }"
    )
    assert sum(page.evaluate("athcodecForest.forest.drawn()")) == 300
    level = page.evaluate("athcodecForest.ath.motion.levelCount - 1")
    still = [shown(page, seconds, level, 0.0)[..., :3] for seconds in (0.1, 0.7)]
    blown = [shown(page, seconds, level, 1.0)[..., :3] for seconds in (0.1, 0.7)]
    assert np.array_equal(*still) and np.abs(blown[0] - blown[1]).max() > 0.01


def test_a_plant_that_has_moved_far_from_its_place_is_drawn_where_it_is(opened, tmp_path):
    """Whether clips are blended or not; and what is out of view is not drawn."""
    clips = {}
    for name, away in (("calm", 0.0), ("gale", 60.0)):
        clip = bending_tube()
        ramp = np.arange(len(clip.time), dtype=np.float32) / np.float32(len(clip.time) - 1)
        moved = clip.positions + (ramp * np.float32(away))[:, None, None] * np.float32([1, 0, 0])
        clips[name] = in_wind(clip.replace(positions=moved), 2.0 + away, 0.0)
    path = tmp_path / "far.ath"
    athcodec.encode(athcodec.join(clips), path, rel_error=1e-4)
    page = opened(path, 1, "athcodecForest.forest.levels.length > 0")

    def drawn(clip: str, x: float, strength: float | None = None) -> int:
        return page.evaluate(
            "async ([clip, x, strength]) => { const { forest, camera } = athcodecForest; forest.ease = 0;"
            " forest.setInstances([{ x: 0, y: 0, z: 0, clip }]);"
            " if (strength === null) forest.blend(null); else await forest.wind(strength);"
            " camera.position.set(x, 0, 12); camera.lookAt(x, 0, 0); camera.updateMatrixWorld();"
            " forest.sway(1);"
            " const isWhole = () => forest.levels.length === athcodecForest.ath.motion.levelCount"
            " && forest.levels.every(({ clips }) => clips.size === forest.clips.length);"
            " for (let i = 0, whole = 0; i < 900 && whole < 3; i++, whole += isWhole()) {"
            " forest.update(camera, 1e6, 0.9); await new Promise(requestAnimationFrame); }"
            " return forest.drawn().then((counts) => counts.reduce((a, b) => a + b)); }",
            [clip, x, strength],
        )

    last = 27 / 29  # of the way at 0.9 seconds
    assert drawn("gale", 60 * last) == 1 and drawn("calm", 0) == 1 and drawn("gale", 30 * last, 32.0) == 1
    assert drawn("calm", 60) == 0 and drawn("gale", -80) == 0


def test_an_instance_of_no_amplitude_stands_still(opened, grove):
    from PIL import Image

    page = opened(grove, 40)

    def picture(amplitude: float, seconds: float) -> np.ndarray:
        page.evaluate(
            "async ([amplitude, seconds]) => { const { camera, forest, ath, renderer, scene } = athcodecForest;"
            " const { center, radius: r } = ath.sphere;"
            " forest.setInstances([{ x: 0, y: 0, z: 0, amplitude }]);"
            " camera.position.set(center.x, center.y, center.z + 2 * r);"
            " camera.lookAt(center.x, center.y, center.z); camera.updateMatrixWorld();"
            " const isWhole = () => forest.levels.length === ath.motion.levelCount"
            " && forest.levels.every(({ clips }) => clips.size);"
            " for (let i = 0, whole = 0; i < 900 && whole < 10; i++, whole += isWhole()) {"
            " forest.update(camera, 240, seconds); renderer.render(scene, camera);"
            " await new Promise(requestAnimationFrame); } }",
            [amplitude, seconds],
        )
        image = Image.open(io.BytesIO(page.locator("canvas").first.screenshot()))
        return np.array(image.convert("RGB"), int)

    def differing(amplitude: float) -> int:
        first, second = (picture(amplitude, seconds) for seconds in (0.1, 0.7))
        return int((np.abs(first - second).max(axis=2) > 8).sum())

    picture(0.0, 0.1)  # Levels and shapes come.
    assert differing(0.0) < 0.25 * differing(1.0)


def test_nothing_of_the_motion_is_uploaded_again(opened, grove):
    page = opened(grove, 100)
    uploaded = "athcodecForest.forest.bytesOfMotion"
    first = page.evaluate(uploaded)
    for seconds in (0.1, 0.5, 3.0):
        shown(page, seconds, 0)
    assert page.evaluate(uploaded) == first > 0


def test_plants_of_another_file_stand_on_the_floor(opened, grove):
    until = "athcodecForest.floor[0].levels.length > 0"
    page = opened(grove, 12, until, floor=athcodec.sample_path("grass"))
    assert page.evaluate("[athcodecForest.forest.count, athcodecForest.floor[0].count]") == [12, 36]


def test_ten_thousand_plants_are_seen(opened, grove):
    page = opened(grove, 10_000, "athcodecForest.frames > 2 && athcodecForest.forest.levels.length > 0")
    assert page.evaluate("athcodecForest.forest.count") == 10_000
    assert sum(page.evaluate("athcodecForest.forest.drawn()")) > 1000
    assert page.evaluate("athcodecForest.milliseconds") < 100


def test_axe_finds_nothing_in_a_forest(opened, grove):
    page = opened(grove, 10)
    page.evaluate((modules() / "axe-core" / "axe.min.js").read_text("utf-8"))
    found = page.evaluate("axe.run().then(({ violations }) => violations.map(({ id, nodes }) => [id, nodes[0].html]))")
    assert found == []


@pytest.mark.parametrize("mode", ["matrices", "positions"])
def test_one_plant_and_its_shadow_move_on_a_renderer_for_webgpu(opened, mode, tmp_path):
    path = tmp_path / "tube.ath"
    athcodec.encode(bending_tube(), path, rel_error=1e-3)
    page = opened(path, 1, "true")
    found = page.evaluate((Path(__file__).parent / "node" / "shadows.js").read_text("utf-8"), mode)
    assert found["covered"] > 0.95 and found["changed"] > 20, found
