"""The loader for three.js: whatever is asked for while bytes come, and whatever is wrong with them, a plant never stops
for good, every request is answered, and at last the picture is what the decoder gives.

Loader and worker run as they ship, in Node (tests/node/loading.mjs); with the marker `browser` in Chromium.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from plants import bending_tube, distance, plant, ring_quads, tube
from programs import CACHE, install_once, printed
from test_gltf_motion import encoded

import athcodec
from athcodec.decoding import container as ct
from athcodec.exporters import write
from athcodec.motion.clip import MotionClip
from athcodec.motion.joining import in_wind
from athcodec.viewer.build_viewer import modules
from bench.throttled_server import WEB, ThrottledServer

ROOT = Path(__file__).resolve().parent.parent

pytestmark = pytest.mark.web

NODE = ROOT / "tests" / "node"


def node(*words) -> object:
    """What a program of tests/node prints, as JSON."""
    program = shutil.which("node")
    if program is None:
        pytest.fail("node: got none on PATH, expected Node.js 18 or newer to test the loader in")
    return json.loads(printed(program, "--no-warnings", "--expose-gc", *words, timeout=1800))


def run_node(case: str, path: Path, *words):
    return node(NODE / "loader_cases.mjs", case, path, *words)


@pytest.fixture(scope="module")
def mesh_ath(tmp_path_factory):
    """A tube of quads in three segments."""
    clip = tube(20, 8, 40)
    clip.faces = ring_quads(20, 8)
    clip.check()
    path = tmp_path_factory.mktemp("mesh") / "mesh.ath"
    return athcodec.encode(clip, path, rel_error=1e-3, segment_frames=16).path


# ---- far from the origin ----


@pytest.mark.parametrize("away", [np.array([5e5, 4e6, 100.0]), np.zeros(3)])
def test_a_plant_in_map_coordinates_keeps_its_millimetres(away, tmp_path):
    """As floats these coordinates are a quarter of a metre apart."""
    clip = plant(seed=4, branches=12, frames=9, dtype=np.float64)
    clip = clip.replace(
        positions=np.asarray(clip.positions) + away, rest=clip.rest + away, metadata={"unit": "m", "up_axis": "z"}
    )
    athcodec.encode(clip, tmp_path / "far.ath", max_error=1e-3, effort="fast")
    times = [0.0, 0.11, float(clip.time[-1] - clip.time[0])]
    result = run_node("far", tmp_path / "far.ath", *times)
    origin = np.array(result["origin"])
    assert np.any(origin != 0) == np.any(away != 0)
    x, y, z = origin
    assert np.allclose(result["place"], [x, z, -y])  # upright
    assert np.abs(result["box"]).max() < 100 and np.abs(result["rest"]).max() < 100
    with athcodec.open(tmp_path / "far.ath") as decoder:
        assert len(result["shown"]) == len(times) * len(decoder.levels)
        for shown in result["shown"]:
            frames = decoder.at_level(shown["level"])
            low, share = int(shown["frame"]), shown["frame"] % 1
            between = frames[low] * (1 - share) + frames[min(low + 1, len(frames) - 1)] * share
            for name in ("drawn", "alone"):
                assert np.abs(np.reshape(shown[name], (-1, 3)) + origin - between[::9]).max() < 2e-4, name


# ---- it never stops for good ----


def test_a_seek_between_two_segments_of_which_one_is_not_here_does_not_stop_the_plant(layered_ath):
    """Segments of this file go on from the one before, which may be absent as well."""
    assert run_node("between", layered_ath) == []


@pytest.mark.parametrize("cost", [0.7, 1.5, 4])
def test_no_boundary_of_segments_shows_level_0_however_long_decoding_takes(cost, tmp_path):
    """The deepest level of a segment takes `cost` times as long as the segment lasts."""
    clip = plant(branches=60, longest=20, frames=240)
    athcodec.encode(clip, tmp_path / "swaying.ath", rel_error=1e-3, effort="fast", segment_frames=40)
    result = run_node("boundaries", tmp_path / "swaying.ath", cost, 1.5)
    segments, levels = np.transpose(result["shown"])
    first = np.argmax(levels > 0)
    assert first < 30 and (levels[first:] > 0).all(), "half a second of level 0 at most, and never again"
    assert set(segments[first:]) == set(range(6))
    if cost < 0.8:  # The deepest level of each segment is decoded in time.
        assert (levels[segments >= 3] == result["deepest"]).all()


def test_what_was_asked_for_last_is_what_is_shown(layered_ath):
    assert run_node("overtaken", layered_ath) is True


def test_a_picture_that_cannot_be_made_is_an_error_that_says_where_and_the_next_one_comes(layered_ath):
    found = run_node("unanswerable", layered_ath)
    message, code = found["error"]
    assert found["moved"] and code == "RangeError"
    assert "clip 0 at 0.5 s, level" in message and "got backwards, expected one of clamp, loop" in message
    assert found["uncaught"] == ["of a listener"] and found["refused"] == ["RangeError", "RangeError", None]


def test_what_a_frame_hides_is_not_drawn(tmp_path):
    clip = MotionClip(
        np.random.default_rng(0).random((5, 12, 3), np.float32),
        np.arange(5) / 24,
        faces=np.arange(12, dtype=np.int32).reshape(4, 3),
        attributes={"part_vertex_counts": np.int32([3, 9]), "part_copies": np.int32([1, 3])},
        metadata={"part_names": ["a", "b"], "presence": {"a": [[1, 3]], "b:2": [[0, 1], [4, 5]]}},
    )
    athcodec.encode(clip, tmp_path / "a.ath", effort="fast")
    shown = [[*(range(3) if 1 <= frame < 3 else ()), *range(3, 12 if frame in (0, 4) else 9)] for frame in range(5)]
    assert run_node("presence", tmp_path / "a.ath") == shown


def random_runs(first: int, count: int, *paths):
    assert node(NODE / "random_loading.mjs", first, count, *paths) == []


def test_random_seeks_while_random_bytes_come_end_with_the_picture_of_the_decoder(
    layered_ath, bushy_ath, medley_ath, mesh_ath, sample_ath
):
    random_runs(0, 200, layered_ath, bushy_ath, medley_ath, mesh_ath, sample_ath)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_thousands_of_random_seeks_end_with_the_picture_of_the_decoder(
    part, layered_ath, bushy_ath, medley_ath, mesh_ath, sample_ath, stepwise_ath, full_ath
):
    paths = layered_ath, bushy_ath, medley_ath, mesh_ath, sample_ath, stepwise_ath, full_ath
    random_runs(1000 * (1 + part), 1000, *paths)


USES = """
import { Canvas } from '@react-three/fiber';
import { Suspense } from 'react';
import { createRoot } from 'react-dom/client';
import { Plant } from './Plant.jsx';
createRoot(document.getElementById('root')).render(
  <Canvas onCreated={({ scene }) => { globalThis.scene = scene; }} camera={{ position: [0, 2, 12] }}>
    <Suspense><Plant url="tree.ath" position={[-2, 0, 0]} /><Plant url="tree.ath" position={[2, 0, 0]} /></Suspense>
  </Canvas>);
"""


@pytest.fixture
def app(browser, tmp_path):
    """A function that opens the page that Vite builds of sources, with the package as its tarball has it."""
    packages = "three@0.187.0 react@19 react-dom@19 @react-three/fiber@9 vite@7 @babylonjs/core@8 @babylonjs/loaders@8"
    folder = CACHE / "vite"

    def npm(*words: object, cwd: Path) -> str:
        return printed("npm", *words, cwd=cwd)

    tarball = tmp_path / npm("pack", "--silent", "--pack-destination", tmp_path, cwd=WEB.parent).split()[-1]

    def install() -> None:
        (folder / "package.json").write_text('{"name": "checks", "private": true, "type": "module"}')
        npm("install", "--no-audit", "--no-fund", *packages.split(), tarball, cwd=folder)

    install_once(folder, f"{packages} {hashlib.sha256(tarball.read_bytes()).hexdigest()}", install)
    (tmp_path / "node_modules").symlink_to(folder / "node_modules")
    page, errors = browser.new_page(viewport={"width": 400, "height": 300}), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    with ThrottledServer({}) as line:

        def visit(body: str, files: dict[str, bytes]):
            begin = f'{body}<script type="module" src="/{next(iter(files))}"></script>'
            files |= {
                "index.html": begin.encode(),
                "vite.config.js": b'export default { esbuild: { jsx: "automatic" } };',
            }
            for name, data in files.items():
                (tmp_path / name).write_bytes(data)
            npm("exec", "vite", "build", cwd=tmp_path)
            dist = tmp_path / "dist"
            line.files = files | {path.relative_to(dist).as_posix(): path.read_bytes() for path in dist.rglob("*.*")}
            page.goto(f"{line.address}index.html")
            return page

        yield visit
    page.close()
    assert errors == []


def snippet(document: str, pattern: str) -> str:
    return re.search(pattern + r"(.*?)```", (ROOT / "docs" / document).read_text("utf-8"), re.S)[1]


@pytest.mark.programs
@pytest.mark.browser
def test_an_app_that_vite_builds_shows_a_plant_for_each_component_as_the_document_says(app, sample_ath):
    sources = {"main.jsx": USES.encode(), "Plant.jsx": snippet("three-js.md", "```jsx\n").encode()}
    page = app('<div id="root"></div>', sources | {"tree.ath": sample_ath.read_bytes()})
    plants = "scene.children.filter(({ name, children }) => name === 'ath' && children.length === 1)"
    page.wait_for_function(f"() => globalThis.scene && {plants}.length === 2", timeout=120_000)
    assert page.evaluate(f"{plants}.map(({{ position }}) => position.x)") == [-2, 2]
    assert page.evaluate(f"{plants}.every(({{ children: [{{ customDepthMaterial }}] }}) => customDepthMaterial)")


BABYLON = """
import { FreeCamera } from '@babylonjs/core/Cameras/freeCamera';
import { Engine } from '@babylonjs/core/Engines/engine';
import { Vector3 } from '@babylonjs/core/Maths/math.vector';
import { Scene } from '@babylonjs/core/scene';
const engine = new Engine(document.querySelector('canvas')), scene = new Scene(engine);
new FreeCamera('camera', new Vector3(0, 5, -20), scene);
%s
engine.runRenderLoop(() => scene.render());
Object.assign(globalThis, { scene, meshes, animationGroups });
"""


@pytest.mark.programs
@pytest.mark.browser
def test_babylon_plays_the_clip_and_level_of_a_glb_as_the_document_says(app, tmp_path):
    calm = bending_tube()
    storm = calm.replace(positions=calm.rest + 2 * (calm.positions - calm.rest))
    write(athcodec.join({"calm": calm, "storm": storm}), tmp_path / "tree.glb", animation="morphs")
    path = encoded(tmp_path / "tree.glb", tmp_path / "tree_motion.glb")
    code = BABYLON % snippet("gltf.md", r"\*\*Babylon.js\*\*[^`]*```js\n")
    page = app("<canvas></canvas>", {"main.js": code.encode(), path.name: path.read_bytes()})
    page.wait_for_function("() => globalThis.meshes && scene.getFrameId() > 3", timeout=120_000)
    assert page.evaluate("animationGroups.filter(({ isPlaying }) => isPlaying).map(({ name }) => name)") == ["storm"]
    page.evaluate("animationGroups.find(({ name }) => name === 'storm').pause().goToFrame(30); scene.render()")
    shown = page.evaluate("[...meshes.find(({ metadata }) => metadata?.ATH_motion).getVerticesData('position')]")
    with athcodec.open(path, clip="storm") as decoder:
        wanted, deepest = decoder.positions(15, level=2), decoder.positions(15)
    off = distance(np.reshape(shown, wanted.shape), wanted)
    assert off < 1e-5 * np.abs(wanted).max() and off < 0.01 * distance(wanted, deepest)


def test_damage_is_named_and_other_segments_are_shown_at_their_deepest_level(layered_ath, tmp_path):
    data = bytearray(layered_ath.read_bytes())
    with athcodec.open(layered_ath) as decoder:
        deepest = decoder.file.level_count - 1
        chunk = next(c for c in decoder.file.chunks if c.is_motion and (c.level, c.segment) == (deepest, 1))
        data[chunk.offset] ^= 1
    path = tmp_path / "damaged.ath"
    path.write_bytes(data)
    found = run_node("damaged", path)
    assert found["reached"][1] == deepest - 1 and found["reached"][0] == found["reached"][3] == deepest
    assert found["whole"]
    message, code, level = found["failures"][0]
    assert (
        code == "BAD_CHECKSUM" and level == deepest and f"level {deepest}, segment 1 at byte {chunk.offset}" in message
    )


# ---- loaded, abort, parse ----


def test_loaded_resolves_when_all_bytes_are_here_and_rejects_where_they_cannot_be(layered_ath):
    found = run_node("loaded", layered_ath)
    assert not found["early"] and found["whole"] and found["same"] and found["ready"]
    assert found["short"] == ["MISSING", "MISSING"] and found["cut"] == "MISSING" and found["none"] == "MISSING"


def test_abort_ends_downloads_and_what_is_here_goes_on_playing(layered_ath):
    found = run_node("aborted", layered_ath)
    assert found["codes"] == ["AbortError", "AbortError", "AbortError", "CLOSED"] and found["plays"]
    assert found["files"] == 0 and found["channels"] == 0


@pytest.mark.parametrize("with_faces", [False, True])
def test_a_wind_shows_the_blended_clips_of_the_decoder(with_faces, sample_clip, mesh_ath, tmp_path):
    with athcodec.open(mesh_ath) as decoder:
        source = athcodec.ClipView(decoder, decoder.file.deepest) if with_faces else sample_clip
        clip = athcodec.MotionClip(
            source.block(0, 40), np.arange(40) / 30, source.vertex_branch, source.branch_parent, source.rest,
            source.edges, source.faces,
        )  # fmt: skip
    clips = {}
    for i in range(3):
        moved = clip.rest + (clip.positions - clip.rest) * np.float32(1 + i)
        clips[f"clip{i}"] = in_wind(clip.replace(positions=moved), 2.0 + 6.0 * (i > 0), 90.0 * i)
    path = tmp_path / "winds.ath"
    athcodec.encode(athcodec.join(clips), path, rel_error=1e-3, segment_frames=16)
    assert run_node("winds", path) == {"off": [], "eased": True, "refused": ["RangeError", "RangeError"]}


def test_parse_takes_buffers_and_views_of_all_kinds_and_leaves_them_as_they_are(layered_ath):
    found = run_node("parsed", layered_ath)
    assert found["same"] and found["kept"]
    assert found["wrong"] == ["TypeError", "TypeError", "TypeError", "NOT_AN_ATH_FILE"]


# ---- materials, boxes, rays ----


def test_a_material_may_be_bound_twice_and_its_clones_are_bound(mesh_ath):
    found = run_node("bound", mesh_ath)
    once = {"uses": True, "times": 1}
    assert found["twice"] == found["other"] == found["clone"] == once


@pytest.mark.parametrize("kind", ["lines", "mesh"])
def test_boxes_and_rays_find_the_plant_where_it_is_shown(kind, sample_ath, mesh_ath):
    found = run_node("rays", sample_ath if kind == "lines" else mesh_ath)
    for mode, rows in found.items():
        for row in rows:
            assert row["inside"] and row["off"] < 1e-6 and row["loose"] < 1.5, (mode, row)
            assert row["hit"] or kind == "mesh", (mode, row)
    assert any(row["hit"] for rows in found.values() for row in rows)


@pytest.mark.parametrize("polygons", ["quads", "mixed"])
def test_objects_are_upright_keep_what_is_set_on_them_and_their_clones_are_whole(polygons, tmp_path):
    """While colours are still to come; the upper half of the tube has no thickness."""
    clip = tube(20, 8, 40)
    positions = clip.block(0, 40).reshape(40, 20, 8, 3).copy()
    positions[:, 10:] = positions[:, 10:].mean(axis=2, keepdims=True)
    quads, color = ring_quads(20, 8), np.tile(np.float32([0.2, 0.5, 0.1]), (160, 1))
    counts = np.r_[3, np.full(len(quads) - 1, 4)].astype(np.int32)
    late = {"face_vertex_counts": counts, "face_vertex_indices": np.delete(quads.ravel(), 3)}
    mesh = (
        {"faces": quads, "attributes": {"colors": color}}
        if polygons == "quads"
        else {"attributes": late | {"colors": color}}
    )
    clip = clip.replace(positions=positions.reshape(40, 160, 3), rest=positions[0].reshape(160, 3), **mesh)
    clip = clip.replace(metadata={"up_axis": "z"})
    path = athcodec.encode(clip, tmp_path / "tube.ath", rel_error=1e-3).path
    with athcodec.open(path) as decoder:
        size = np.ptp(decoder.positions(0, 0), axis=0)
        early = next(chunk.offset for chunk in decoder.file.chunks if chunk.kind == ct.ATTRIBUTE)
    found = run_node("object", path, early)
    assert found["default"] == [True, True] and found["kept"] == [1, False, True, 7, "mine"]
    assert found["look"] == [True, True, True] and found["same"] and found["twin"]
    assert found["flat"] == 0
    assert found["size"] == pytest.approx(size[[0, 2, 1]], rel=0.1)


def test_fifty_loads_and_disposals_leave_no_memory_behind(layered_ath):
    found = run_node("memory", layered_ath)
    assert found["made"] >= 50 and found["files"] == found["channels"] == 0
    assert max(found["used"]) <= 4, found  # that which all files of a worker share, and what is not collected yet


# ---- in a browser ----


DISPOSED = """async () => {
  const { three: { Scene }, loading: { ATHLoader } } = athcodecViewer.modules;
  const { renderer, camera } = athcodecViewer.stage, scene = new Scene();
  const loader = new ATHLoader(), url = new URLSearchParams(location.search).get("file"), counts = [];
  for (let i = 0; i < 50; i++) {
    const ath = await loader.loadAsync(url);
    scene.add(ath.object);
    await ath.loaded;
    await ath.motion.show(0.3, ath.motion.levelCount - 1);
    renderer.render(scene, camera);
    ath.object.removeFromParent();
    ath.dispose();
    renderer.render(scene, camera);
    counts.push([renderer.info.memory.geometries, renderer.info.memory.textures, renderer.info.programs.length]);
  }
  loader.dispose();
  return { first: counts[0], last: counts.at(-1) };
}"""


@pytest.mark.browser
def test_fifty_loads_and_disposals_leave_nothing_on_the_gpu(browser, sample_ath):
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        page = browser.new_page(viewport={"width": 300, "height": 200})
        page.goto(line.page("tree.ath"))
        page.wait_for_function("() => athcodecViewer.motion?.complete", timeout=60_000)
        page.evaluate("athcodecViewer.setPlaying(false)")
        page.wait_for_function(
            "() => athcodecViewer.motion.level === athcodecViewer.motion.target && !athcodecViewer.motion.fading"
        )
        found = page.evaluate(DISPOSED)
        page.close()
    assert found["first"] == found["last"]


@pytest.mark.browser
@pytest.mark.parametrize("mode", ["matrices", "positions"])
def test_shadows_move_with_the_plant_in_every_mode(browser, mode, tmp_path):
    path = tmp_path / "tube.ath"
    athcodec.encode(bending_tube(), path, rel_error=1e-3)
    with ThrottledServer({"tree.ath": path.read_bytes()}) as line:
        page = browser.new_page(viewport={"width": 300, "height": 200})
        errors = []
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.goto(line.page("tree.ath"))
        page.wait_for_function("() => athcodecViewer.motion?.complete && athcodecViewer.modules", timeout=60_000)
        page.evaluate("athcodecViewer.setPlaying(false)")
        found = page.evaluate((NODE / "shadows.js").read_text("utf-8"), mode)
        page.close()
    assert errors == [] and found["covered"] > 0.95 and found["changed"] > 20, found


CDN = "https://cdn.example.org/"
COUNTED = (NODE / "counted.js").read_text("utf-8")
ELSEWHERE = snippet("three-js.md", '```html\n(?=<script type="importmap">)')


@pytest.fixture
def page_with(browser, sample_ath):
    """A function that opens a page of its own on a site that has tree.ath alone; three.js and the package are those of
    another site, unless `missing` is in the address."""
    with ThrottledServer({"tree.ath": sample_ath.read_bytes(), "page.ath": b"<!doctype html>" + bytes(100)}) as line:
        page, errors = browser.new_page(viewport={"width": 900, "height": 700}), []
        page.set_default_timeout(120_000)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.add_init_script(COUNTED)

        def visit(body: str, missing: str = "nothing"):
            def answer(route):
                package, _, path = route.request.url.split("/npm/")[-1].removeprefix(CDN).partition("/")
                file = (modules() / "three" if package.startswith("three") else WEB.parent) / path
                found = file.is_file() and missing not in path
                headers = {"Access-Control-Allow-Origin": "*", "Content-Type": "text/javascript"}
                route.fulfill(
                    status=200 if found else 404, body=file.read_text("utf-8") if found else "", headers=headers
                )

            page.context.route(re.compile("https://cdn"), answer)
            page.route(
                "**/own.html", lambda route: route.fulfill(body=f"<!doctype html>{body}", content_type="text/html")
            )
            page.goto(f"{line.address}own.html")
            return page

        yield visit
        page.context.unroute(re.compile("https://cdn"))
        page.close()
    assert errors == []


@pytest.mark.browser
def test_a_page_takes_the_package_from_another_site_as_the_document_says(page_with):
    page = page_with(ELSEWHERE.replace("oak.ath", "tree.ath"))
    page.wait_for_function("() => document.querySelector('ath-viewer').currentTime > 0.1")


@pytest.mark.browser
def test_a_decoder_that_cannot_be_started_is_said_in_the_element(page_with):
    page = page_with(ELSEWHERE.replace("oak.ath", "tree.ath"), missing="ath_worker")
    page.wait_for_function("""() => document.querySelector('ath-viewer').shadowRoot.querySelector('[role=alert]')
      ?.textContent === 'The decoder cannot be started'""")


HAS_PICTURE = """(viewer) => {
  const canvas = viewer.shadowRoot.querySelector("canvas");
  const { data } = canvas?.getContext("2d").getImageData(0, 0, canvas.width, canvas.height) ?? { data: [] };
  return data.some((value) => value > 0);
}"""


@pytest.mark.browser
def test_twenty_elements_have_one_context_and_draw_again_when_it_is_lost(page_with):
    style = "<style>ath-viewer { display: inline-block; width: 80px; height: 60px; min-height: 0 }</style>"
    elements = "".join(f'<ath-viewer src="tree.ath" {"scenery" * (i % 2)}></ath-viewer>' for i in range(20))
    page = page_with(ELSEWHERE[: ELSEWHERE.index("<ath-viewer")] + style + elements)
    page.evaluate(f"globalThis.drawn = () => [...document.querySelectorAll('ath-viewer')].every({HAS_PICTURE})")
    page.wait_for_function("() => drawn()")
    assert page.evaluate("contexts.length") == 1
    page.evaluate("""() => {
      for (const viewer of document.querySelectorAll("ath-viewer")) {
        const canvas = viewer.shadowRoot.querySelector("canvas");
        viewer.pause();
        canvas.width = canvas.width;
      }
      contexts[0].getExtension("WEBGL_lose_context").loseContext();
    }""")
    page.wait_for_function("() => drawn()")
    assert page.evaluate("contexts.length") == 2


@pytest.mark.browser
def test_fifty_elements_that_come_and_go_leave_nothing_on_the_gpu(page_with):
    page = page_with(ELSEWHERE.replace("oak.ath", "tree.ath"))
    page.wait_for_function("() => document.querySelector('ath-viewer').currentTime > 0.1")
    counts = page.evaluate("""async () => {
      const counts = [];
      for (let i = 0; i < 50; i++) {
        const viewer = Object.assign(document.createElement("ath-viewer"), { src: "tree.ath", paused: true });
        viewer.toggleAttribute("scenery", i % 5 === 0);
        viewer.style.cssText = "display: block; width: 80px; height: 60px; min-height: 0";
        document.body.prepend(viewer);
        while (!viewer.shadowRoot.querySelector(".drawn")) await new Promise(requestAnimationFrame);
        viewer.remove();
        if (i % 5 === 4) counts.push({ ...living });
      }
      return counts;
    }""")
    assert all(counts[-1][what] <= counts[1][what] for what in counts[1]), counts


@pytest.mark.browser
def test_an_element_for_who_wants_less_motion_stands_still_until_its_button_is_pressed(page_with):
    page = page_with(ELSEWHERE.replace("oak.ath", "tree.ath").replace("<ath-viewer", "<p></p><ath-viewer hidden"))
    page.emulate_media(reduced_motion="reduce")
    page.evaluate("document.body.innerHTML = '<ath-viewer src=\"tree.ath\"></ath-viewer>'")
    page.click("ath-viewer button")
    page.wait_for_function("() => document.querySelector('ath-viewer').currentTime > 0.1")
    assert page.locator("ath-viewer button").count() == 0


@pytest.fixture
def element(page_with):
    """A page with <ath-viewer>, whose motion is here at level 1 and above."""
    page = page_with(
        ELSEWHERE.replace("oak.ath", "tree.ath").replace(
            "camera-controls", 'level="1" style="width: 300px; height: 200px"'
        )
    )
    page.evaluate("globalThis.viewer = document.querySelector('ath-viewer')")
    page.wait_for_function("() => viewer.ath?.motion.level === 1")
    return page


@pytest.mark.browser
def test_the_element_plays_at_the_level_of_its_attribute_until_it_is_paused(element):
    element.wait_for_function("() => viewer.currentTime > 0.1")
    element.evaluate("viewer.pause()")
    element.evaluate("viewer.currentTime = 2")
    element.wait_for_function("() => viewer.ath.motion.time === 2")
    element.evaluate("viewer.setAttribute('level', '0')")
    element.wait_for_function("() => viewer.ath.motion.level === 0")
    assert element.evaluate("viewer.currentTime") == 2
    assert element.evaluate("viewer.shadowRoot.querySelector('canvas').ariaLabel") == "An oak in the wind"


@pytest.mark.browser
def test_the_element_tells_of_files_and_of_what_is_wrong_with_them(element):
    told = """(name) => new Promise((done) => {
      for (const type of ["load", "error"])
        viewer.addEventListener(type, ({ detail }) => done(detail.codeName ?? type), { once: true });
      viewer.src = name;
    })"""
    assert element.evaluate(told, "page.ath") == "NOT_AN_ATH_FILE"
    assert element.evaluate(told, "tree.ath") == "load"


@pytest.mark.browser
def test_the_element_frees_its_file_where_it_is_taken_out_and_loads_it_again(element):
    element.evaluate("viewer.remove()")
    assert element.evaluate("viewer.ath") is None
    element.evaluate("document.body.append(viewer)")
    element.wait_for_function("() => viewer.ath?.motion.level === 1", timeout=60_000)


LIMBS = """async () => {
  const { ATHLimbs } = await import("athcodec-three");
  const { OrthographicCamera, Scene, WebGLRenderer } = await import("three");
  const { ath } = viewer, canvas = document.createElement("canvas"), renderer = new WebGLRenderer({ canvas });
  const { center, radius: r } = ath.sphere, scene = new Scene();
  const camera = new OrthographicCamera(-r, r, r, -r, 0, 4 * r);
  camera.position.set(center.x, center.y, center.z + 2 * r);
  const limbs = new ATHLimbs(ath, { color: 0x00ff00 });
  const seen = () => {
    const gl = renderer.getContext(), data = new Uint8Array(4 * 200 * 200);
    renderer.render(scene, camera);
    gl.readPixels(0, 0, 200, 200, gl.RGBA, gl.UNSIGNED_BYTE, data);
    return [0, 1].map((c) => data.filter((value, i) => i % 4 === c && value > 40).length);
  };
  renderer.setSize(200, 200);
  scene.add(limbs);
  const found = [seen()];
  limbs.setColor(() => [1, 0, 0]);
  found.push(seen());
  limbs.dispose();
  found.push(seen());
  renderer.dispose();
  return found;
}"""


@pytest.mark.browser
def test_limbs_are_drawn_in_the_colour_that_is_given(element):
    green, red, none = element.evaluate(LIMBS)
    assert green[0] == 0 and green[1] > 200
    assert red[0] == green[1] and red[1] == 0
    assert none == [0, 0]


INSTANCES = """async () => {
  const { ATHForest } = await import("athcodec-three");
  const { LineBasicMaterial, OrthographicCamera, Scene, WebGLRenderer } = await import("three");
  const { ath } = viewer, canvas = document.createElement("canvas"), renderer = new WebGLRenderer({ canvas });
  const { center, radius: r } = ath.sphere, scene = new Scene();
  const camera = new OrthographicCamera(-r, r, r, -r, 0, 4 * r);
  const material = () => new LineBasicMaterial({ color: 0xffffff });
  camera.position.set(center.x, center.y, center.z + 2 * r);
  camera.updateMatrixWorld();
  const forest = new ATHForest(ath, { geometry: ath.lines, material });
  renderer.setSize(200, 200);
  scene.add(forest);
  await forest.bake(1);
  const seen = (look, seconds) => {
    const gl = renderer.getContext(), data = new Uint8Array(4 * 200 * 200);
    forest.setInstances([{ x: 0, y: 0, z: 0, size: 1, angle: 0, seconds: 0, ...look }]);
    forest.update(camera, 200, seconds);
    renderer.render(scene, camera);
    gl.readPixels(0, 0, 200, 200, gl.RGBA, gl.UNSIGNED_BYTE, data);
    return Array.from(data).filter((_, i) => i % 4 < 3);
  };
  const aside = (away, amplitude) => {
    forest.setInstances([{ x: away, y: 0, z: 0, size: 1, angle: 0, seconds: 0, amplitude }]);
    forest.update(camera, 200, 0);
    return forest.culled;
  };
  const found = { still: [0.2, 1.1].map((seconds) => seen({ amplitude: 0 }, seconds)),
    moved: [0.2, 1.1].map((seconds) => seen({}, seconds)), red: seen({ tint: 0xff0000 }, 0.2),
    culled: [[0, 1], [100 * r, 1], [5 * r, 1], [5 * r, 8]].map(([away, amplitude]) => aside(away, amplitude)) };
  forest.dispose();
  renderer.dispose();
  return found;
}"""


@pytest.mark.browser
def test_instances_have_an_amplitude_and_a_tint_and_are_culled_by_how_far_they_reach(element):
    found = element.evaluate(INSTANCES)
    still, moved, red = (np.array(found[name]) for name in ("still", "moved", "red"))
    assert still.any() and np.array_equal(*still)
    assert not np.array_equal(*moved)
    assert not red.reshape(-1, 3)[:, 1:].any()
    assert np.array_equal(red.reshape(-1, 3)[:, 0] > 40, moved[0].reshape(-1, 3)[:, 0] > 40)
    assert found["culled"] == [0, 1, 1, 0]
