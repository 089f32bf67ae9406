"""Forests on WebGPU: plants are where the decoder has them, and every instance in view is drawn.

In Chromium, Debian's, without a graphics card; marker `browser`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from plants import bending_tube, blown_tree

import athcodec

sys.path.append(str(Path(__file__).parents[1]))  # for bench, which is not installed; athcodec stays the installed one

from athcodec.core_file import FILE_ORDER  # noqa: E402
from athcodec.gpu import GpuFile  # noqa: E402
from bench.browser import WEBGPU_FLAGS, chromium  # noqa: E402
from bench.throttled_server import ThrottledServer  # noqa: E402

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
    athcodec.encode(athcodec.join({"gale": gale, "calm": calm}), path, rel_error=1e-3, segment_frames=20)
    return path


@pytest.fixture
def opened(browser):
    """A function that opens the forest of a file, stopped; the page must not have logged an error at the end."""
    with ThrottledServer({}) as line:
        errors, page = [], browser.new_page(viewport={"width": 360, "height": 240})
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))

        def visit(path: Path, count: int, until: str = FINEST):
            line.files["plant.ath"] = path.read_bytes()
            page.goto(f"{line.address}forest.html?file=plant.ath&count={count}")
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
        " forest.wind(strength).update(camera, 1e6, seconds); }",
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


def test_nothing_of_the_motion_is_uploaded_again(opened, grove):
    page = opened(grove, 100)
    uploaded = "athcodecForest.forest.bytesOfMotion"
    first = page.evaluate(uploaded)
    for seconds in (0.1, 0.5, 3.0):
        shown(page, seconds, 0)
    assert page.evaluate(uploaded) == first > 0


def test_ten_thousand_plants_are_seen(opened, grove):
    page = opened(grove, 10_000, "athcodecForest.frames > 2 && athcodecForest.forest.levels.length > 0")
    assert page.evaluate("athcodecForest.forest.count") == 10_000
    assert sum(page.evaluate("athcodecForest.forest.drawn()")) > 1000
    assert page.evaluate("athcodecForest.milliseconds") < 100


@pytest.mark.parametrize("mode", ["matrices", "positions"])
def test_one_plant_and_its_shadow_move_on_a_renderer_for_webgpu(opened, mode, tmp_path):
    path = tmp_path / "tube.ath"
    athcodec.encode(bending_tube(), path, rel_error=1e-3)
    page = opened(path, 1, "true")
    found = page.evaluate((Path(__file__).parent / "node" / "shadows.js").read_text("utf-8"), mode)
    assert found["covered"] > 0.95 and found["changed"] > 20, found
