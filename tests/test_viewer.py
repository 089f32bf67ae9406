"""The viewer: its page comes complete, from a server or as one file; plays from the first bytes on, shows the bits of
every level, and says what is wrong with a file.

Tests with the marker `browser` look at the page in Chromium (Debian: apt-get install chromium; athcodec[browser]).
"""

from __future__ import annotations

import base64
import collections
import gzip
import json
import math
import re
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from plants import bending_tube, clip_of
from programs import printed

import athcodec
from athcodec import cli
from athcodec.decoding import container as ct
from athcodec.exporters import write
from athcodec.viewer import view
from athcodec.viewer.build_viewer import MOST_BYTES, MOST_PAGE_BYTES, own_bytes
from athcodec.viewer.still import still_svg
from bench.throttled_server import WEB, ThrottledServer
from bench.trees.plant import grow

ROOT = Path(__file__).resolve().parent.parent

pytestmark = pytest.mark.web

VIEWER = ROOT / "athcodec" / "viewer"


# ---- the server and the page ----


@contextmanager
def viewing(path: str, *options: str):
    """The address that `athcodec view` prints for a file or URL."""
    command = [sys.executable, "-m", "athcodec", "view", path, "--no-browser", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        yield process.stdout.readline().split()[0]
    finally:
        process.terminate()
        process.communicate(timeout=20)


@pytest.fixture(scope="module")
def served(sample_ath):
    """Address of the viewer with the sample."""
    with viewing(str(sample_ath)) as address:
        yield address


def get(url: str, **headers: str):
    return urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=20)


def test_view_serves_the_page_and_ranges_of_the_file(served, sample_ath):
    base, file = served.split("?file=")
    data = sample_ath.read_bytes()
    assert base.startswith("http://127.0.0.1:")
    with get(base) as page:
        named = re.findall(r'(?:href|src)="([\w.]+)"', page.read().decode())
    for name in {*named, "ath_worker.js"} - {"still.svg"}:  # which is that of the file
        with get(base + name) as answer:
            assert answer.read() == (WEB / name).read_bytes(), name
    with get(base + file, Range="bytes=100-299") as answer:
        assert answer.status == 206 and answer.headers["Content-Range"] == f"bytes 100-299/{len(data)}"
        assert answer.read() == data[100:300]
    with get(base + file) as answer:
        assert answer.read() == data


def test_nothing_else_of_the_computer_is_served(served):
    base, file = served.split("?file=")
    for path in (file.rsplit("/", 1)[1], "../view.py", "..%2fview.py", "file/guess/" + file.rsplit("/", 1)[1], "file"):
        with pytest.raises(urllib.error.HTTPError) as refused:
            get(base + path)
        refused.value.close()
        assert refused.value.code in (403, 404), path


def test_a_file_behind_a_url_is_passed_on_range_by_range(sample_ath):
    data = sample_ath.read_bytes()
    with ThrottledServer({"tree.ath": data}) as line, viewing(f"{line.address}tree.ath") as address:
        line.log.clear()
        with get(address.replace("?file=", ""), Range="bytes=5-9") as answer:
            assert (answer.status, answer.read()) == (206, data[5:10])
        assert line.log == [["tree.ath", 5, 5]]


def test_an_exported_page_holds_everything(sample_ath, tmp_path, capsys):
    page = tmp_path / "page.html"
    assert cli.main(["view", str(sample_ath), "--export", str(page)]) == 0
    assert str(page) in capsys.readouterr().out
    text = page.read_text("utf-8")
    file = re.search(r'id="ath-file" data-name="sample.ath">([^<]*)<', text)[1]
    assert base64.b64decode(file) == sample_ath.read_bytes()
    modules = json.loads(re.search(r'<script type="importmap">(.*?)</script>', text)[1])["imports"]
    assert modules.keys() == {"three", "viewer", "later"}
    for name, url in modules.items():
        kind, _, body = url.partition(",")
        module = base64.b64decode(body).decode()
        assert kind == "data:text/javascript;base64"
        beside = re.sub(r'(from|import\()"(three|viewer|later|model)"', r'\1"./\2.js"', module)
        assert beside == (WEB / f"{name}.js").read_text("utf-8")
        assert not re.search(r'(?:from|import\()"\./', module)
    outside = re.sub(r"<script.*?</script>|<style.*?</style>", "", text, flags=re.DOTALL)
    assert not re.search(r'(?:src|href)="(?!data:)', outside)
    assert "connect-src 'none'" in outside


def test_a_clip_to_begin_with_is_named_in_the_address_and_in_the_page(medley_ath, tmp_path, capsys):
    with viewing(str(medley_ath), "--clip", "Böe") as address:
        assert address.endswith("medley.ath&clip=B%C3%B6e")
    page = tmp_path / "page.html"
    assert cli.main(["view", str(medley_ath), "--clip", "Böe", "--export", str(page)]) == 0
    assert 'data-clip="Böe"' in page.read_text("utf-8")
    capsys.readouterr()
    for more in ([], ["--export", str(page)]):
        assert cli.main(["view", str(medley_ath), "--clip", "gale", *more]) == 1
        error = capsys.readouterr().err.strip()
        assert "'gale'" in error and "'calm', 'Böe'" in error and "\n" not in error


def test_a_file_that_cannot_be_shown_is_an_error_of_one_line(sample_ath, tmp_path, monkeypatch, capsys):
    broken = tmp_path / "broken.ath"
    broken.write_bytes(b"no plant at all")
    for arguments in (
        ["view", str(broken)],
        ["view", str(broken), "--export", str(tmp_path / "x.html")],
        ["view", str(tmp_path / "none.ath")],
        ["view", "ftp://example.org/tree.ath"],
    ):
        assert cli.main(arguments) == 1
        error = capsys.readouterr().err.strip()
        assert error.startswith("athcodec: error: ") and "\n" not in error and arguments[1] in error
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    assert cli.main(["view", str(sample_ath)]) == 1
    error = capsys.readouterr().err.strip()
    assert 'pip install "athcodec[view]"' in error and "\n" not in error
    assert cli.main(["view", str(sample_ath), "--export", str(tmp_path / "x.html")]) == 0


def test_pages_have_no_inline_scripts_and_styles():
    for name in ("index.html", "forest.html"):
        text = (WEB / name).read_text("utf-8")
        policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)[1]
        assert re.search(r"script-src ([^;]*);", policy)[1].split() == ["'self'", "'wasm-unsafe-eval'"]
        assert not re.search(r"<script(?: [^>]*)?>[^<]|<style|unsafe-inline|\son\w+=\"|style=\"", text), name


def test_the_page_is_served_compressed_and_small(served):
    """Until the first picture come the page, its style, three.js, the viewer, and the worker with the decoder."""
    base, size = served.split("?file=")[0], 0
    for name in ("", "viewer.css", "start.js", "three.js", "viewer.js", "ath_worker.js"):
        with get(base + name, **{"Accept-Encoding": "gzip"}) as answer:
            packed = answer.read()
            assert answer.headers["Content-Encoding"] == "gzip", name
            assert gzip.decompress(packed) == (WEB / (name or "index.html")).read_bytes(), name
            size += len(packed)
    assert size <= MOST_PAGE_BYTES


@pytest.mark.browser
def test_what_the_first_picture_does_not_need_comes_behind_it_and_then_works(opened, sample_ath):
    """While it is held up the plant plays, and controls that need it cannot be used; then the view can be turned."""
    from bench.throttled_server import ThrottledServer

    held = []
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line:
        page = opened("about:blank", "true")
        page.route("**/later.js", lambda route: held.append(route))
        page.goto(line.page("tree.ath"))
        page.wait_for_function(
            "() => document.querySelector('#canvas.drawn') && document.querySelector('#time').value > 0"
        )
        assert page.evaluate("document.querySelector('#picture').closest('[inert]') !== null")
        assert page.evaluate("athcodecViewer.modules === undefined")
        for _ in range(100):
            if held:
                break
            page.wait_for_timeout(100)
        held[0].continue_()
        page.wait_for_function("() => athcodecViewer.modules")
        assert page.evaluate("document.querySelector('#picture').closest('[inert]') === null")
        before = page.evaluate("athcodecViewer.stage.camera.position.toArray()")
        page.locator("#canvas").press("ArrowLeft")
        page.wait_for_function(
            "(before) => String(athcodecViewer.stage.camera.position.toArray()) !== String(before)", arg=before
        )


def test_without_scripts_the_server_has_a_still_of_the_file(served, sample_ath):
    with get(served.split("?file=")[0] + "still.svg") as answer, athcodec.open(sample_ath) as decoder:
        assert answer.headers["Content-Type"] == "image/svg+xml" and answer.read().decode() == still_svg(decoder)


def test_a_still_is_as_wide_and_as_tall_as_the_plant(forked_clip, tmp_path):
    """A stem of four vertices and a branch of two, in 360 by 360 units, turned by 20 degrees."""
    athcodec.encode(forked_clip, tmp_path / "a.ath", rel_error=1e-3, exact_rest=True)
    with athcodec.open(tmp_path / "a.ath") as decoder:
        dots = {(int(x), int(y)) for x, y in re.findall(r"M(\d+) (\d+)h0", still_svg(decoder))}
    across = 120 * math.cos(math.radians(20))  # a unit sideways, where three are 360 upward
    left = 200 - across
    assert dots == {(round(left), 380 - 120 * up) for up in range(4)} | {
        (round(left + n * across), 140) for n in (1, 2)
    }


def test_the_bundles_are_small_and_their_licences_are_there():
    assert own_bytes(WEB) <= MOST_BYTES
    licences = (WEB / "LICENSES.txt").read_text("utf-8")
    assert re.search(r"three 0\.187\.0.*The MIT License.*three\.js authors", licences, re.DOTALL)
    assert "fzstd" in licences
    assert (ROOT / "LICENSE").read_text("utf-8") in licences  # npm packs this file, and no other with the licence


def test_no_view_of_the_page_imports_another_or_does_anything_where_it_is_imported():
    """Each gives its commands to the controller, app.js, when main.js or later.js begins it; Node has no document."""
    page = VIEWER / "page"
    begins = "".join((page / name).read_text("utf-8") for name in ("main.js", "later.js"))
    views = re.findall(r'^import \w+ from "\./(\w+)\.js";$', begins, re.M)
    assert len(views) > 10
    for name in views:
        imported = set(re.findall(r'from "\./(\w+)\.js"', (page / f"{name}.js").read_text("utf-8")))
        assert not imported & {*views, "main", "later"}, name
    script = f"""import {{ register }} from "node:module";
      register({json.dumps((ROOT / "tests" / "node" / "page_modules.mjs").as_uri())});
      for (const view of {json.dumps(views)}) await import({json.dumps(page.as_uri())} + `/${{view}}.js`);"""
    printed("node", "--input-type=module", "-e", script)


def test_the_package_has_the_viewers_material():
    """It has leaves where a file names its surfaces, and is a plain material where it does not."""
    script = f"""import {{ register }} from "node:module";
      const modules = {json.dumps((ROOT / "tests" / "node" / "page_modules.mjs").as_uri())};
      register(modules, {{ data: {{ three: "three.webgpu.js" }} }});
      const {{ ATHPlantMaterial }} = await import({json.dumps((WEB / "ATHLoader.js").as_uri())});
      const shader = {{ vertexShader: "#include <common>", fragmentShader: "#include <map_fragment>" }};
      new ATHPlantMaterial({{ surfaces: "bark, pinnae" }}).onBeforeCompile(shader);
      const plain = new ATHPlantMaterial({{ surfaces: "brick" }}), drawn = shader.fragmentShader.includes("athIsLeaf");
      console.log(JSON.stringify([drawn, shader.fragmentShader.includes("ATH_LEAF 2"), plain.color.getHexString()]));"""
    assert json.loads(printed("node", "--input-type=module", "-e", script)) == [True, True, "6f8f4a"]


@pytest.mark.programs
def test_the_bundles_are_what_the_sources_make():
    printed(sys.executable, VIEWER / "build_viewer.py", "--check")


PACKED = """
import { ATHLoader, ATHForest, ATHMotion, injectMotion } from "athcodec-three";
import { AthFile } from "athcodec-three/decoder";
import.meta.resolve("athcodec-three/viewer");
import { athMotion } from "athcodec-three/gltf/three";
import { ATHMotionExtension, aside } from "athcodec-three/gltf/transform";
import { createRequire } from "node:module";
const worker = createRequire(import.meta.url).resolve("athcodec-three/ath_worker.js");
const loader = new ATHLoader().setWorkerLimit(2).setDecoderPath("/x/");
const found = [typeof loader.loadAsync, typeof AthFile.open, worker.endsWith("ath_worker.js"), loader.workerURL,
  athMotion(loader)({}).name, ATHMotionExtension.EXTENSION_NAME, typeof aside()];
console.log(JSON.stringify(found));
"""


@pytest.mark.programs
def test_the_npm_package_installs_from_its_tarball(tmp_path):
    tarball = printed("npm", "pack", "--silent", "--pack-destination", tmp_path, cwd=VIEWER).split()[-1]
    (tmp_path / "package.json").write_text('{"type": "module", "private": true}')
    packages = "three@0.187.0 typescript@5.9.3 @types/three @gltf-transform/core@4.5.1".split()
    printed("npm", "install", "--silent", "--no-audit", "--no-fund", f"./{tarball}", *packages, cwd=tmp_path)
    (tmp_path / "use.mjs").write_text(PACKED)
    wanted = ["function", "function", True, "/x/ath_worker.js", "ATH_motion", "ATH_motion", "function"]
    assert json.loads(printed("node", "use.mjs", cwd=tmp_path)) == wanted
    (tmp_path / "use.ts").write_text(TYPED)
    command = "npx tsc --noEmit --strict --target esnext --module esnext --moduleResolution bundler".split()
    printed(*command, "use.ts", cwd=tmp_path)
    printed("npm", "install", "--silent", "--no-audit", "--no-fund", "@types/react@19", cwd=tmp_path)
    (tmp_path / "use.tsx").write_text(REACT)
    printed(*command, "--jsx", "react-jsx", "--jsxImportSource", "react", "use.tsx", cwd=tmp_path)
    (tmp_path / "wrong.tsx").write_text(REACT.replace('camera-controls="turn"', 'camera-controls="spin"'))
    wrong = subprocess.run([*command, "--jsx", "react-jsx", "wrong.tsx"], cwd=tmp_path, capture_output=True, text=True)
    assert "spin" in wrong.stdout


REACT = """
import "athcodec-three/viewer";
import type { ATHViewerElement } from "athcodec-three/viewer";
import { useRef } from "react";
export function Plant() {
  const viewer = useRef<ATHViewerElement>(null);
  const play = () => viewer.current?.play();
  return <ath-viewer ref={viewer} src="oak.ath" level={2} scenery camera-controls="turn" className="oak" onClick={play}>
    <img src="oak.webp" alt="" />
  </ath-viewer>;
}
"""

TYPED = """
import { type Loader, PerspectiveCamera, Scene } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { NodeIO } from "@gltf-transform/core";
import { type ATH, ATHForest, ATHLimbs, ATHLoader, type ATHMotion, ATHPlantMaterial } from "athcodec-three";
import { athMotion } from "athcodec-three/gltf/three";
import type { ATHViewerElement } from "athcodec-three/viewer";
import type { ATHBabylonMotion } from "athcodec-three/gltf/babylon";
import { ATHMotionExtension, aside, type MotionList } from "athcodec-three/gltf/transform";
const ath = await new ATHLoader().setWorkerLimit(2).loadAsync("tree.ath");
new Scene().add(ath.object);
ath.motion.setLevel("auto").setTime(2).addEventListener("level", (event) => { const level: number = event.level; });
const { clips, clip }: ATHMotion = ath.motion.play("storm", { fade: 0.5 });
const name: string = clips[0].loop ? clips[0].name : clip.name;
const forest = new ATHForest(ath);
forest.setInstances([{ x: 0, y: 0, z: 0, size: 1, angle: 0, seconds: 0, clip: name }]);
forest.update(new PerspectiveCamera(), 100, 1);
const xyz: Float32Array = await ath.motion.positions(1, 0);
const whole: ATH = await ath.loaded;
whole.motion.bindShadows(ath.object).castShadow = true;
whole.motion.addEventListener("error", ({ message }) => console.error(message));
const loader: Loader<ATH> = new ATHLoader().abort();
for (const bytes of [new ArrayBuffer(8), new SharedArrayBuffer(8), xyz.subarray(1), new DataView(new ArrayBuffer(8))])
  await new ATHLoader().parseAsync(bytes);
new Scene().add(new ATHLimbs(ath, { color: "brown" }).setColor((vertex) => [vertex, 0, 0]));
const pixelsOff = ({ ath, camera }: ATHViewerElement): number | undefined => ath?.motion.pixelError(0, camera, 9);
pixelsOff(new HTMLElement() as ATHViewerElement);
ath.motion.bind(new ATHPlantMaterial(ath.metadata)).roughness = 0.5;
ath.abort();
new GLTFLoader().register(athMotion(new ATHLoader()));
const io = new NodeIO().registerExtensions([ATHMotionExtension]), document = await io.read("tree_motion.glb");
await document.transform(aside(() => {}));
const bytes: Uint8Array = document.getRoot().getExtension<MotionList>("ATH_motion")!.listMotions()[0].getBytes();
const seconds = (motion: ATHBabylonMotion): string => motion.setSeconds(bytes.length, "storm").clips[0].name;
"""


# ---- in a browser ----

browser_test = pytest.mark.browser


@pytest.fixture(scope="module")
def gusty_tree():
    """An .ath file of 8,000 vertices whose branches sway, each in its own time."""
    plant, rng, time_ = grow(8000, 2, 12.0, 5), np.random.default_rng(3), np.arange(120) / 30
    positions = np.repeat(plant.position[None], len(time_), axis=0)
    height = (plant.position[:, 1] / plant.height) ** 2
    positions[:, :, 0] += 0.6 * height * np.sin(2.3 * time_)[:, None]
    positions[:, :, 2] += 0.4 * height * np.sin(1.7 * time_ + 1)[:, None]
    for branch in range(1, len(plant.branch_parent)):
        mine = np.flatnonzero(plant.branch == branch)
        gust = 1 + 0.4 * np.sin(0.9 * time_ + rng.uniform(0, 6))
        swing = gust * np.sin(rng.uniform(3, 9) * time_ + rng.uniform(0, 6))
        along = np.linspace(0, 1, len(mine)) ** 2
        positions[:, mine] += swing[:, None, None] * along[:, None] * rng.normal(size=3) * 0.15
    more = {"attributes": {"radius": plant.radius.astype(np.float32)}, "metadata": {"unit": "m", "up_axis": "y"}}
    return clip_of(positions, plant.position, plant.branch, plant.branch_parent, edges=plant.edges, **more)


@pytest.fixture(scope="module")
def gusty_ath(gusty_tree, tmp_path_factory):
    path = tmp_path_factory.mktemp("gusty") / "gusty.ath"
    return athcodec.encode(gusty_tree, path, rel_error=1e-4, effort="fast").path


@pytest.fixture(scope="module")
def windy_ath(gusty_tree, tmp_path_factory):
    """Three clips of that tree: a calm that was blended into a loop, a gust, and a storm that is one."""

    def part(start: int, stop: int, force: float):
        rest, moved = gusty_tree.rest, gusty_tree.block(start, stop)
        positions = (rest + force * (moved - rest)).astype(np.float32)
        return gusty_tree.replace(positions=positions, time=np.arange(len(moved)) / 30)

    clips = {
        "calm": athcodec.looped(part(0, 40, 0.3), blend=8),
        "gust": part(30, 80, 1.0),
        "storm": athcodec.looped(part(60, 120, 1.6), blend=20),
    }
    path = tmp_path_factory.mktemp("windy") / "windy.ath"
    return athcodec.encode(athcodec.join(clips), path, rel_error=1e-4, effort="fast", segment_frames=16).path


class HeldServer(ThrottledServer):
    """A line that can be held after some more bytes of its files, in whole packets, until it is released. each: whether
    every connection has so many bytes, so that a request that is given up takes none from the next."""

    def __init__(self, files: dict[str, bytes], after: float = math.inf, each: bool = False, **options):
        super().__init__(files, **options)
        self._left, self._changed = after, threading.Condition()
        self._each, self._sent = each, collections.Counter()

    def hold(self) -> None:
        with self._changed:
            self._left = 0

    def release(self) -> None:
        with self._changed:
            self._left = math.inf
            self._changed.notify_all()

    def wait(self, size: int) -> None:
        with self._changed:
            if self._each:
                connection = threading.get_ident()
                self._sent[connection] += size
                self._changed.wait_for(lambda: self._left >= self._sent[connection])
                return
            self._left -= size
            self._changed.wait_for(lambda: self._left >= 0)

    def __exit__(self, *error) -> None:
        self.release()
        super().__exit__(*error)


READBACK = (ROOT / "tests" / "node" / "readback.js").read_text("utf-8")


def settle(page, line: ThrottledServer) -> None:
    """Waits until many pictures have been drawn, for each of which the worker is asked, and nothing was fetched."""
    before = None
    while before != line.log:
        before = [list(answer) for answer in line.log]
        pictures = page.evaluate("athcodecViewer.counters.pictures")
        page.wait_for_function(f"() => athcodecViewer.counters.pictures >= {pictures + 20}")


def positions_of(page, call: str) -> np.ndarray:
    return np.array(page.evaluate(call), float).reshape(-1, 3)


def drawn_at_level_0(decoder, frame: int) -> np.ndarray:
    """Its matrices on the rest pose of the levels above, which a page draws it with once that is there."""
    parts, order = decoder.affines(frame, 0), decoder.file.hierarchy.vertex_source
    matrices, out = np.repeat(parts.matrices, parts.vertex_count, axis=0), np.empty((decoder.file.vertex_count, 3))
    out[order] = np.einsum("nij,nj->ni", matrices[..., :3], decoder.level_rest(1)[order]) + matrices[..., 3]
    return out


@browser_test
def test_every_level_shows_the_positions_that_python_decodes(opened, sample_ath):
    """In the worker, in the texture, and as the vertex shader reads it."""
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line, athcodec.open(sample_ath) as decoder:
        page = opened(line.page("tree.ath"))
        page.evaluate(READBACK)
        size = float(np.ptp(decoder.positions(0), axis=0).max())
        for level in range(decoder.file.level_count):
            for frame in (0, 41, decoder.frame_count - 1):
                wanted = decoder.positions(frame, level)
                seconds = float(decoder.time[frame] - decoder.time[0])
                decoded = positions_of(page, f"athcodecViewer.decoded({seconds}, {level})")
                assert np.array_equal(decoded.astype(np.float32), wanted.astype(np.float32))
                assert page.evaluate(f"athcodecViewer.shown({seconds}, {level})")["level"] == level
                drawn = wanted if level > 0 else drawn_at_level_0(decoder, frame)
                for way in ("athcodecViewer.uploaded", "onGraphics"):
                    shown = positions_of(page, f"{way}()")
                    assert np.abs(shown - drawn).max() < 1e-6 * size, (level, frame, way)


@browser_test
def test_what_is_drawn_has_the_rest_pose_of_level_1_once_that_is_here(opened, stepwise_ath):
    """Lines and limbs are there before it, with that of level 0."""
    with athcodec.open(stepwise_ath) as decoder:
        rests = [decoder.level_rest(level).astype(np.float32) for level in (0, 1)]
        assert not np.array_equal(*rests) and decoder.levels[0].bytes + 100 < decoder.levels[1].bytes
        after = decoder.levels[0].bytes + 100
    with HeldServer({"tree.ath": stepwise_ath.read_bytes()}, after=after) as line:
        line.packet = 100
        page = opened(line.page("tree.ath"), "athcodecViewer.motion?.level === 0")
        page.evaluate("athcodecViewer.plants[0].ath.lines")
        drawn = """(() => {
            const { ath, root } = athcodecViewer.plants[0];
            const limbs = root.children[0].geometry;
            const { rest, lines, sphere } = ath, point = (array, i) => String(array.subarray(3 * i, 3 * i + 3));
            const ends = Array.from(limbs.userData.source);
            return { rest: [...rest], lines: [...lines.attributes.position.array], radius: sphere.radius,
              limbs: ends.every((v, i) => point(limbs.attributes.rest.array, i) === point(rest, v)) };
        })()"""
        for rest in rests:
            found = page.evaluate(drawn)
            assert np.array_equal(np.array(found["rest"], np.float32).reshape(-1, 3), rest)
            assert found["lines"] == found["rest"] and found["limbs"]
            assert abs(2 * found["radius"] - np.linalg.norm(np.ptp(rest, axis=0))) < 1e-5 * found["radius"]
            line.release()
            page.wait_for_function("() => athcodecViewer.motion.level > 0")


def play(page, clip) -> None:
    """Another clip, and waits until nothing is left of the one before."""
    page.evaluate(f"athcodecViewer.playClip({clip})")
    page.wait_for_function("() => !athcodecViewer.motion.switching && athcodecViewer.motion.complete")


@browser_test
def test_every_clip_shows_the_positions_that_python_decodes_of_it(opened, medley_ath):
    with ThrottledServer({"tree.ath": medley_ath.read_bytes()}) as line, athcodec.open(medley_ath) as first:
        page = opened(line.page("tree.ath"))
        page.evaluate(READBACK)
        for index, clip in reversed(list(enumerate(first.file.clips))):
            play(page, index)
            decoder = first.play(clip.name)
            for level in (0, decoder.file.level_count - 1):
                for frame in sorted({0, clip.frame_count // 2, clip.frame_count - 1}):
                    wanted, seconds = decoder.positions(frame, level), float(decoder.time[frame] - decoder.time[0])
                    decoded = positions_of(page, f"athcodecViewer.decoded({seconds}, {level})")
                    assert np.abs(decoded - wanted).max() < 1e-6 * np.ptp(wanted)  # times are rounded
                    page.evaluate(f"athcodecViewer.shown({seconds}, {level})")
                    shown = positions_of(page, "onGraphics()")
                    drawn = wanted if level > 0 else drawn_at_level_0(decoder, frame)
                    assert np.abs(shown - drawn).max() < 2e-6 * np.ptp(wanted), (clip.name, level, frame)


@browser_test
def test_only_the_clips_that_play_are_fetched(opened, windy_ath):
    data = windy_ath.read_bytes()
    with ThrottledServer({"tree.ath": data}) as line, athcodec.open(windy_ath) as decoder:
        clips = {clip.name: clip for clip in decoder.file.clips}
        shared = ct.SHAPES, ct.REFINED_REST  # by all segments
        common = {chunk.offset for chunk in decoder.file.chunks if not chunk.is_motion or chunk.kind in shared}

        def outside(*names: str) -> int:
            """Bytes sent behind the first request that belong to none of these clips."""
            played = {segment for name in names for segment in clips[name].segments}
            asked = np.zeros(len(data), bool)
            for _, first, size in line.log[1:]:
                asked[first : first + size] = True
            for chunk in decoder.file.chunks:
                if chunk.offset in common or chunk.segment in played:
                    asked[chunk.offset : chunk.offset + chunk.length] = False
            return int(asked.sum())

        page = opened(line.page("tree.ath", clip="storm"))
        page.wait_for_function("() => athcodecViewer.plants[0].ath.attributes.radius")
        assert page.evaluate("athcodecViewer.motion.clip.name") == "storm"
        assert outside("storm") == 0 and line.sent("tree.ath") < 0.7 * len(data)
        play(page, 0)
        assert outside("storm", "calm") == 0
        settle(page, line)
        assert line.sent("tree.ath") < len(data) - 10_000  # the gust has not been asked for


@browser_test
def test_the_clip_before_goes_on_until_the_next_is_here_and_fades_into_it(opened, windy_ath):
    with HeldServer({"tree.ath": windy_ath.read_bytes()}) as line, athcodec.open(windy_ath) as decoder:
        page = opened(line.page("tree.ath"))
        page.evaluate("athcodecViewer.setPlaying(false)")
        line.hold()
        page.evaluate(f"void (globalThis.fading = ({FADE})({decoder.file.level_count - 1}))")
        page.wait_for_function("() => globalThis.waiting?.length > 0")
        line.release()
        found = page.evaluate("fading")
        gust = decoder.file.clips[1]
        assert all(0 <= frame < gust.first_frame for frame in found["waiting"])
        assert gust.first_frame <= found["frame"] < gust.first_frame + gust.frame_count
        before, after = (np.array(found[name]).reshape(-1, 3) for name in ("before", "after"))
        for share, name in ((0.25, "quarter"), (1, "end")):
            mean = before + share * (after - before)
            assert np.abs(np.array(found[name]).reshape(-1, 3) - mean).max() < 1e-5 * np.ptp(mean)


# Time stands still for both clips but for what passes in a fade.
FADE = """async (level) => {
  const motion = athcodecViewer.motion.clone(), waiting = globalThis.waiting = [];
  const pictured = () => new Promise((done) => {
    const once = () => { motion.removeEventListener("frame", once); done(); };
    motion.addEventListener("frame", once);
  });
  const until = async (met) => { while (!met()) await new Promise((done) => setTimeout(done, 5)); };
  const still = async () => {
    for (let i = 0; i < 2; i++) { // the first of two pictures may have been asked for before
      const next = pictured();
      motion.refresh();
      await next;
    }
    return [...motion.uploaded()];
  };
  const first = pictured();
  motion.wrap = "clamp";
  motion.setLevel(level).setTime(100);
  await first;
  await until(() => motion.level === level);
  const begun = new Promise((done) => motion.addEventListener("clip", done));
  motion.addEventListener("frame", ({ frame }) => { if (motion.switching === "waiting") waiting.push(frame); });
  motion.play("gust", { fade: 4, at: 100 });
  await begun;
  const { frame } = motion;
  await until(() => motion.complete && motion.level === level && !motion.fading);
  const found = { waiting, frame, before: await still() };
  motion.setTime(101);
  found.quarter = await still();
  motion.setTime(104);
  found.end = await still();
  found.after = await motion.positions(104, level).then((all) => [...all]);
  return { ...found, over: !motion.switching };
}"""


# ---- from level to level ----

# A motion of its own, whose clock and time pass as is told: `show` gives the picture after `passed` seconds of both.
WATCHED = """() => {
  const clock = { now: performance.now() };
  performance.now = () => clock.now;
  const motion = athcodecViewer.motion.clone();
  const pictured = () => new Promise((done) => {
    const once = () => { motion.removeEventListener("frame", once); done(); };
    motion.addEventListener("frame", once);
    motion.refresh();
  });
  const still = async () => { await pictured(); await pictured(); }; // the first may have been asked for before
  const decoded = async (level) => {
    while (motion.level < 0 || (!motion.fading && motion.level !== level)) await still();
  };
  const show = async (passed, level, play = true) => {
    clock.now += 1000 * passed;
    motion.setLevel(level);
    motion.setTime(motion.time + (play ? passed : 0));
    await still();
    return [...motion.uploaded()];
  };
  globalThis.watched = { clock, motion, still, decoded, show };
}"""

CHANGES = """async ({ fade, step, wanted, start, known }) => {
  const { motion, decoded, still, show } = watched, rows = [];
  motion.fade = 0;
  for (const level of known) { // decodes them
    motion.setLevel(level);
    for (const seconds of [start + step * wanted.length, start]) {
      motion.setTime(seconds);
      await still();
      for (let i = 0; i < 30 && motion.level !== level; i++) await still();
    }
  }
  motion.setLevel(wanted[0]);
  await decoded(wanted[0]);
  motion.fade = fade;
  for (const level of wanted) rows.push(await show(step, level));
  return { rows, rest: motion.fading, level: motion.level };
}"""


@pytest.fixture(scope="module")
def segmented(tmp_path_factory):
    """The sample in segments of 16 frames, of which the second has levels 0 and 1 alone, and its decoder."""
    path = tmp_path_factory.mktemp("segmented") / "tree.ath"
    with athcodec.read(athcodec.sample_path()) as clip:
        athcodec.encode(clip, path, rel_error=1e-4, effort="fast", segment_frames=16)
    data = bytearray(path.read_bytes())
    with athcodec.open(path) as decoder:
        for chunk in decoder.file.chunks:
            if chunk.is_motion and (chunk.level, chunk.segment) == (2, 1):
                data[chunk.offset] ^= 1
        yield bytes(data), decoder


@browser_test
@pytest.mark.parametrize("case", ["asked", "segment"])
def test_no_vertex_jumps_where_the_level_changes(opened_file, segmented, case):
    """It is asked for, or a segment begins of which less can be shown. No vertex goes further in a picture than a level
    takes it and its share of the way, nor does it jerk; without fading it does."""
    data, decoder = segmented
    deepest, step, fade = decoder.file.level_count - 1, 1 / 60, 0.2
    wanted = [1] * 3 + [deepest] * 5 + [2] * 20 if case == "asked" else [deepest] * 30
    start = 0.0 if case == "asked" else 16 / 30 - 10 * step
    levels = sorted({1, *wanted})
    page = opened_file(data, "athcodecViewer.motion?.readyLevel >= 1")
    page.evaluate("athcodecViewer.setPlaying(false)")
    page.wait_for_function("() => athcodecViewer.motion.readyLevel === 1")
    page.evaluate(WATCHED)
    plan = {"step": step, "wanted": wanted, "start": start, "known": levels}
    faded, at_once = (page.evaluate(CHANGES, plan | {"fade": seconds}) for seconds in (fade, 0))
    assert not faded["rest"] and faded["level"] == at_once["level"] != max(levels)
    faded, at_once = (np.array(found["rows"]) for found in (faded, at_once))
    assert np.allclose(faded[-1], at_once[-1], rtol=0, atol=1e-5)
    places = 30 * (start + step * np.arange(1, len(wanted) + 1))
    low, part = places.astype(int), places % 1
    shown = {}
    for level in levels:
        frames = decoder.positions(slice(0, low[-1] + 2), level).reshape(low[-1] + 2, -1)
        shown[level] = frames[low] + part[:, None] * (frames[low + 1] - frames[low])
    own = max(np.abs(np.diff(xyz, axis=0)).max() for xyz in shown.values())
    bent = max(np.abs(np.diff(xyz, 2, axis=0)).max() for xyz in shown.values())
    apart = max(np.abs(a - b).max() for a in shown.values() for b in shown.values())
    share = step / fade
    most = own + 2 * 1.5 * share * apart  # two changes may be under way
    most_bent = bent + 2 * (6 * share**2 * apart + 2 * 1.5 * share * 2 * own)
    assert np.abs(np.diff(faded, axis=0)).max() <= 1.01 * most
    assert np.abs(np.diff(faded, 2, axis=0)).max() <= 1.01 * most_bent
    assert np.abs(np.diff(at_once, 2, axis=0)).max() > 1.5 * most_bent


SHARPENING = """async (deepest) => {
  const { motion, still, show } = watched, rows = [];
  motion.setTime(0.2);
  await still();
  while (motion.level < 0) await still();
  rows.push(await show(0, deepest, false));
  globalThis.held = true;
  while (!motion.complete) await still();
  for (let i = 0; i < 60 || motion.level !== deepest || motion.fading; i++)
    rows.push(await show(1 / 60, deepest, false));
  return { rows, exact: [...await motion.positions(0.2, deepest)] };
}"""


@browser_test
def test_a_tree_that_sharpens_as_bytes_come_does_not_jump(opened, sample_ath):
    """Time stands still: what moves is what levels, and their rest poses, differ by. At rest it is at the deepest."""
    with athcodec.open(sample_ath) as decoder:
        first, deepest = decoder.levels[0].bytes, decoder.file.level_count - 1
        apart = np.abs(decoder.positions(6, 0) - decoder.positions(6, deepest)).max()
        apart += 2 * np.abs(decoder.level_rest(0) - decoder.level_rest(1)).max()
    with HeldServer({"tree.ath": sample_ath.read_bytes()}, after=first + 100) as line:
        line.packet = 100
        page = opened(line.page("tree.ath"), "athcodecViewer.motion?.level === 0")
        page.evaluate("athcodecViewer.setPlaying(false)")
        page.evaluate(WATCHED)
        page.evaluate(f"void (globalThis.sharpening = ({SHARPENING})({deepest}))")
        page.wait_for_function("() => globalThis.held")
        line.release()
        found = page.evaluate("sharpening")
    rows = np.array(found["rows"])
    assert np.abs(rows[0] - rows[-1]).max() > 0.2 * apart
    assert np.abs(np.diff(rows, axis=0)).max() < 1.5 / 12 * 2 * apart
    assert np.abs(rows[-1] - np.array(found["exact"])).max() < 1e-5 * np.ptp(rows)


FOREST = """async ([from, to]) => {
  const { three, loading: { ATHForest, ATHLoader } } = athcodecViewer.modules;
  const { stage, plants } = athcodecViewer, { ath } = plants[0], clock = { now: performance.now() };
  performance.now = () => clock.now;
  const loader = new ATHLoader(), forest = new ATHForest(ath);
  for (const level of [from, to]) await forest.bake(level);
  forest.setInstances([{ x: 0, y: 0, z: 0, size: 1, angle: 0, seconds: 0 }]);
  const update = (level, seconds) => { // from where levels as coarse as this will do
    clock.now += 1000 * seconds;
    forest.pixels = level === Math.min(from, to) ? 1e9 : 1e-9;
    forest.update(stage.camera, stage.pixels, 0.2);
    return forest.children.find(({ visible }) => visible);
  };
  const read = ({ geometry: { attributes: all }, material }) => {
    const attributes = {}, shader = { uniforms: {}, vertexShader: "" }, { count } = all.position;
    const repeated = (array) => Float32Array.from({ length: 4 * count }, (_, i) => array[i % 4]);
    const each = ({ array }) => new three.BufferAttribute(repeated(array), 4);
    for (const name of ["position", "athPart", "athPartBefore"]) if (all[name]) attributes[name] = all[name];
    for (const name of ["athPlace", "athTurn", "athLook", "athFading"])
      if (all[name]) attributes[name] = each(all[name]);
    material.onBeforeCompile(shader, stage.renderer);
    const defines = { ATH_FOREST: 1, ...(all.athFading ? { ATH_FADING: 1 } : {}) };
    return readback(attributes, shader.uniforms, { defines });
  };
  const finest = (drawn) => drawn.geometry.attributes.position.count === ath.rest.length / 3;
  const found = { shown: [], fading: [] };
  update(from, 0);
  for (const passed of [0.01, 0.04, 0.06, 0.3]) {
    const drawn = update(to, passed);
    if (!finest(drawn)) throw new Error("another geometry");
    found.shown.push(await read(drawn));
    found.fading.push(forest.fading);
  }
  found.levels = [];
  for (const level of [from, to]) found.levels.push([...await ath.motion.positions(0.2, level)]);
  loader.dispose();
  return found;
}"""


@browser_test
def test_an_instance_of_a_forest_fades_from_level_to_level(opened, sample_ath):
    """As the vertex shader places it: it begins where it was, and after the fade it is at the level alone."""
    with ThrottledServer({"tree.ath": sample_ath.read_bytes()}) as line, athcodec.open(sample_ath) as decoder:
        page = opened(line.page("tree.ath"))
        page.evaluate("athcodecViewer.setPlaying(false)")
        page.evaluate(READBACK)
        found = page.evaluate(FOREST, [1, decoder.file.level_count - 1])
    before, after = np.array(found["levels"])
    apart = np.abs(before - after).max()
    for shown, passed in zip(np.array(found["shown"]), (0, 0.2, 0.5, 1)):
        weight = passed**2 * (3 - 2 * passed)
        assert np.abs(shown - (before + weight * (after - before))).max() < 1e-4 * apart + 1e-5 * np.ptp(before), passed
    assert found["fading"] == [True, True, True, False]


@browser_test
def test_a_loop_goes_over_its_seam_without_a_jump_and_other_clips_end(opened, medley_ath, medley_clips):
    with ThrottledServer({"tree.ath": medley_ath.read_bytes()}) as line, athcodec.open(medley_ath) as first:
        page = opened(line.page("tree.ath"))
        deepest = first.file.level_count - 1
        for index, clip in enumerate(first.file.clips):
            play(page, index)
            decoder, last = first.play(clip.name), clip.frame_count - 1
            ends = decoder.positions(0), decoder.positions(last)
            round_ = page.evaluate("athcodecViewer.motion.duration")
            assert page.get_attribute("#loop", "aria-pressed") == str(clip.loop).lower()
            page.wait_for_function(
                "(loop) => document.getElementById('facts').textContent.includes('Loop seam') === loop", arg=clip.loop
            )
            if not clip.loop:
                assert round_ == pytest.approx(clip.duration)
                held = positions_of(page, f"athcodecViewer.decoded({round_ + 1}, {deepest})")
                assert np.abs(held - ends[1]).max() < 1e-6 * np.ptp(ends[1])
                continue
            assert round_ == pytest.approx(clip.duration * clip.frame_count / last)
            between = (clip.duration + round_) / 2
            for seconds, wanted in ((between, (ends[0] + ends[1]) / 2), (round_ + 1e-9, ends[0])):
                shown = positions_of(page, f"athcodecViewer.decoded({seconds}, {deepest})")
                assert np.abs(shown - wanted).max() < 1e-5 * np.ptp(wanted)
            seam = page.evaluate(f"athcodecViewer.motion.seamError({deepest})")
            source = medley_clips[clip.name].block(0, 1)[0] - medley_clips[clip.name].block(last, last + 1)[0]
            off = np.linalg.norm((ends[0] - ends[1]) - source, axis=1).max()
            assert off <= seam * (1 + 1e-5) and seam == pytest.approx(clip.seam_errors[deepest])
            page.keyboard.press("l")
            assert page.evaluate("athcodecViewer.motion.duration") == pytest.approx(clip.duration)


@browser_test
def test_clips_are_chosen_from_a_list_by_key_and_in_the_address(opened, medley_ath, sample_ath):
    with ThrottledServer({"tree.ath": medley_ath.read_bytes(), "one.ath": sample_ath.read_bytes()}) as line:
        page = opened(line.page("tree.ath"))
        assert page.locator("#clip option").all_inner_texts() == ["calm ↻", "Böe", "still", "round ↻"]

        def playing() -> tuple[str, str]:
            return page.evaluate("athcodecViewer.motion.clip.name"), page.locator("#clip option:checked").inner_text()

        page.select_option("#clip", label="Böe")
        assert playing() == ("Böe", "Böe")
        page.locator("#canvas").focus()
        page.keyboard.press("n")
        assert playing() == ("still", "still")
        page.keyboard.press("Shift+N")
        page.keyboard.press("Shift+N")
        assert playing() == ("calm", "calm ↻")
        page.keyboard.press("End")
        assert float(page.input_value("#time")) <= float(page.get_attribute("#time", "max"))
        page = opened(line.page("tree.ath", clip="still"))
        assert page.evaluate("athcodecViewer.motion.clip.name") == "still"
        page = opened(line.page("tree.ath", clip="gale"), "document.getElementById('message').checkVisibility()")
        assert "no such clip" in page.inner_text("#message h2") and "calm, Böe" in page.inner_text("#message")
        page = opened(line.page("one.ath"))
        assert not page.locator("#clip").is_visible()


@browser_test
def test_instances_of_a_forest_play_clips_of_their_own(opened_file, windy_ath):
    page = opened_file(windy_ath.read_bytes())
    page.evaluate("athcodecViewer.forestOf(30)")
    drawn = """athcodecViewer.state.forest.children.filter(({ visible }) => visible)
      .map(({ userData, geometry }) => [userData.clip, geometry.instanceCount])"""

    def clips(wanted: int) -> None:
        page.wait_for_function(f"() => new Set({drawn}.map(([clip]) => clip)).size === {wanted}")
        forest = page.evaluate("[...athcodecViewer.state.forest.counts, athcodecViewer.state.forest.culled]")
        assert sum(forest) == 30

    clips(1)
    page.check("#forest-mix")
    clips(3)
    page.uncheck("#forest-mix")
    page.evaluate("athcodecViewer.playClip(2)")
    page.wait_for_function(f"() => {drawn}.every(([clip]) => clip === 2)")
    assert ink(page) > 0.005


@browser_test
def test_it_moves_before_a_seventh_of_the_file_has_come(opened, gusty_ath):
    data = gusty_ath.read_bytes()
    with HeldServer({"tree.ath": data}, after=len(data) / 7) as line:
        page = opened(line.page("tree.ath"), "athcodecViewer.counters.firstMotion")
        assert line.log[0][1] == 0 and line.sent("tree.ath") <= len(data) / 7
        page.evaluate("athcodecViewer.setLevel(String(athcodecViewer.motion.levelCount - 1))")
        line.release()
        page.wait_for_function("() => athcodecViewer.motion.complete")
        assert line.sent("tree.ath") <= 1.01 * len(data) and len(line.log) > 3


@browser_test
def test_only_the_level_that_is_looked_at_is_fetched(opened, gusty_ath):
    data = gusty_ath.read_bytes()
    with HeldServer({"tree.ath": data}, after=len(data) / 7) as line, athcodec.open(gusty_ath) as decoder:
        page = opened(line.page("tree.ath"), "athcodecViewer.motion")
        page.evaluate("athcodecViewer.setLevel('1')")
        pictures = page.evaluate("athcodecViewer.counters.pictures")
        page.wait_for_function(f"() => athcodecViewer.counters.pictures > {pictures + 2}")  # the worker knows of it
        line.release()
        page.wait_for_function(
            "() => athcodecViewer.motion.readyLevel >= 1 && athcodecViewer.plants[0].ath.attributes.radius"
        )
        settle(page, line)
        assert page.evaluate("athcodecViewer.motion.level") == 1
        page.wait_for_function("() => document.getElementById('facts').textContent.includes(': depth 1')")
        assert line.sent("tree.ath") < 0.6 * len(data) and decoder.file.level_count > 2


@browser_test
def test_a_server_without_ranges_sends_a_download_that_plays_while_it_grows(opened, gusty_ath):
    """And is asked for once: what the page began before the worker was there goes on."""
    data = gusty_ath.read_bytes()
    with HeldServer({"tree.ath": data}, after=len(data) / 2, each=True, ranges=False) as line:
        page = opened(line.page("tree.ath"), "athcodecViewer.counters.firstMotion")
        assert all(size <= len(data) / 2 for _, _, size in line.log)
        line.release()
        page.wait_for_function("() => athcodecViewer.motion.complete")
        page.wait_for_function("() => athcodecViewer.plants[0].ath.attributes.radius")
        assert [size for _, _, size in line.log] == [len(data)]


def cut_after(path: Path, level: int) -> bytes:
    """The file up to the end of a level."""
    with athcodec.open(path) as decoder:
        return path.read_bytes()[: decoder.file.info()["levels"][level]["bytes"]]


@browser_test
@pytest.mark.parametrize("ranges", [True, False])
def test_a_truncated_file_plays_to_its_level(opened, sample_ath, ranges):
    data = cut_after(sample_ath, 1) + b"xx"
    with ThrottledServer({"tree.ath": data}, ranges=ranges) as line, athcodec.open(sample_ath) as decoder:
        page = opened(line.page("tree.ath"), "athcodecViewer.motion?.readyLevel === 1")
        page.wait_for_function("() => athcodecViewer.counters.pictures > 8")
        assert page.evaluate("athcodecViewer.motion.level") == 1
        shown = positions_of(page, "athcodecViewer.decoded(1, 1)")
        with athcodec.open(sample_ath) as whole:
            frame = int(np.argmin(np.abs(whole.time - whole.time[0] - 1)))
        assert np.abs(shown - decoder.positions(frame, 1)).max() < 0.05


@browser_test
@pytest.mark.parametrize(
    "damage, words",
    [
        (lambda data: b"<!doctype html>" + data[15:], "not an .ath file"),
        (lambda data: data[:40], "cut off"),
        (lambda data: data[:900] + bytes([data[900] ^ 1]) + data[901:], "damaged"),
        (lambda data: b"", "not an .ath file"),
        (None, "cannot be fetched"),
    ],
)
def test_the_page_says_that_a_file_cannot_be_shown(opened, sample_ath, damage, words):
    files = {} if damage is None else {"tree.ath": damage(sample_ath.read_bytes())}
    with ThrottledServer(files) as line:
        shown = "document.getElementById('message').checkVisibility()"
        page = opened(line.page("tree.ath"), shown, quiet="Failed to load resource")  # as the browser says it
        assert words in page.inner_text("#message h2") and page.inner_text("#message p").strip()


@browser_test
def test_the_intact_levels_of_a_damaged_file_play(opened_file, sample_ath):
    parts = sample_ath.read_bytes()
    with athcodec.open(sample_ath) as decoder:
        at = decoder.file.info()["levels"][1]["bytes"] + 50
    damaged = parts[:at] + bytes([parts[at] ^ 4]) + parts[at + 1 :]
    shown = "!document.getElementById('trouble').hidden && athcodecViewer.motion"
    page = opened_file(damaged, shown)
    assert "damaged" in page.inner_text("#trouble")
    page.wait_for_function("() => athcodecViewer.counters.pictures > 20")
    assert page.evaluate("athcodecViewer.motion.level") >= 1
    assert page.is_visible("#trouble")  # It stays as long as the file is open.


@browser_test
def test_a_glb_with_a_motion_is_shown_with_its_materials_by_view_and_by_an_exported_page(opened, tmp_path):
    clip = bending_tube()
    clip.attributes = {"colors": np.tile(np.float32([0.8, 0.1, 0.1]), (clip.vertex_count, 1))}
    clip.check()
    write(clip, tmp_path / "plain.glb", animation="morphs")
    assert cli.main(["encode", str(tmp_path / "plain.glb"), "--into", str(tmp_path / "tube.glb")]) == 0
    view.export_page(tmp_path / "tube.glb", tmp_path / "page.html")
    with athcodec.open(tmp_path / "tube.glb") as decoder, viewing(str(tmp_path / "tube.glb")) as address:
        wanted, seconds = decoder.positions(20), float(decoder.time[20] - decoder.time[0])
        for place in (address, (tmp_path / "page.html").as_uri()):
            page = opened(place)
            assert page.inner_text("#name") == "tube.glb"
            deepest = decoder.file.level_count - 1
            shown = positions_of(page, f"athcodecViewer.decoded({seconds}, {deepest})")
            assert np.abs(shown - wanted).max() < 1e-5 * np.abs(wanted).max()
            drawn = "athcodecViewer.plants[0].space"
            assert page.evaluate(f"{drawn}.isMesh && {drawn}.material.isMeshStandardMaterial")
            page.click("#colour [data-value=error]")
            assert page.evaluate(f"{drawn}.material.isMeshLambertMaterial")
            page.click("#compare [data-value=levels]")
            page.wait_for_function("() => athcodecViewer.plants.length === 2 && athcodecViewer.counters.pictures > 3")
    with ThrottledServer({"plain.glb": (tmp_path / "plain.glb").read_bytes()}) as line:
        page = opened(line.page("plain.glb"), "document.getElementById('message').checkVisibility()")
        assert "no plant that moves" in page.inner_text("#message h2") and "--into" in page.inner_text("#message p")


@browser_test
def test_an_exported_page_plays_from_the_disk(opened, sample_ath, tmp_path):
    page_file = tmp_path / "page.html"
    view.export_page(sample_ath, page_file)
    page = opened(page_file.as_uri(), "athcodecViewer.counters.firstMotion")
    assert page.inner_text("#name") == "sample.ath"


@pytest.fixture(scope="module")
def hosted(tmp_path_factory):
    """The sample without its rest pose, and that."""
    path = tmp_path_factory.mktemp("hosted") / "hosted.ath"
    with athcodec.read(athcodec.sample_path()) as clip:
        athcodec.encode(clip, path, rel_error=1e-3, effort="fast", host_rest=True)
        return path, clip.rest.astype(np.float32)


@browser_test
def test_pages_play_a_file_about_the_mesh_that_they_have(opened, hosted, sample_file, tmp_path):
    path, mesh = hosted
    view.export_page(path, tmp_path / "page.html", host_mesh=mesh)
    with viewing(str(path), "--host-mesh", str(sample_file)) as address:
        for place in ((tmp_path / "page.html").as_uri(), address):
            page = opened(place, "athcodecViewer.counters.firstMotion")
            assert page.evaluate("[...athcodecViewer.plants.at(-1).ath.rest.slice(0, 3)]") == mesh[0].tolist()


@browser_test
def test_a_page_without_the_mesh_says_so(opened, hosted):
    path, mesh = hosted
    with ThrottledServer({"tree.ath": path.read_bytes(), "mesh": (mesh + 1).tobytes()}) as line:
        for more, words in (({}, "needs the mesh"), ({"mesh": "/mesh"}, "not the one")):
            page = opened(line.page("tree.ath", **more), "!document.getElementById('message').hidden")
            assert words in page.inner_text("#message h2")


LOAD_ABOUT = """async (numbers) => {
  const { three: { BufferAttribute, BufferGeometry }, loading: { ATHLoader } } = athcodecViewer.modules;
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(Float32Array.from(numbers), 3));
  const loader = new ATHLoader(), url = new URLSearchParams(location.search).get("file");
  const refused = [];
  for (const mesh of [null, Float32Array.from(numbers.slice(3)), new Float32Array(numbers.length)])
    await loader.setHostMesh(mesh).loadAsync(url).catch((error) => refused.push(error.codeName));
  const firsts = [];
  for (const mesh of [geometry, Float32Array.from(numbers)]) {
    const ath = await loader.setHostMesh(mesh).loadAsync(url);
    firsts.push([...(await ath.motion.positions(0, 0)).slice(0, 3)]);
    ath.dispose();
  }
  loader.dispose();
  return { refused, firsts };
}"""


@browser_test
def test_the_loader_takes_a_geometry_or_its_numbers_as_the_mesh(opened, hosted):
    path, mesh = hosted
    with ThrottledServer({"tree.ath": path.read_bytes(), "mesh": mesh.tobytes()}) as line:
        page = opened(line.page("tree.ath", mesh="/mesh"))
        found = page.evaluate(LOAD_ABOUT, mesh.reshape(-1).tolist())
    with athcodec.open(path, host_mesh=mesh) as decoder:
        expected = decoder.positions(0, 0)[0].tolist()
    assert found["refused"] == ["NEEDS_HOST_MESH", "WRONG_HOST_MESH", "WRONG_HOST_MESH"]
    assert found["firsts"] == [expected, expected]


@browser_test
def test_a_thousand_instances_are_drawn_each_at_its_level(opened_file, sample_ath):
    page = opened_file(sample_ath.read_bytes())
    page.evaluate("athcodecViewer.forestOf(1000)")
    forest = "athcodecViewer.state.forest"
    page.wait_for_function(f"() => {forest}?.baked.length === athcodecViewer.motion.levelCount")
    page.wait_for_function(f"() => {forest}.counts.reduce((a, b) => a + b, 0) > 300")
    counts = page.evaluate(f"[...{forest}.counts, {forest}.culled]")
    assert sum(counts) == 1000 and sum(count > 0 for count in counts[:-1]) > 1
    assert ink(page) > 0.1


INK = """() => {
  const { stage } = athcodecViewer, copy = new OffscreenCanvas(320, 240), pen = copy.getContext("2d");
  stage.render();
  pen.drawImage(stage.canvas, 0, 0, 320, 240);
  const { data } = pen.getImageData(0, 0, 320, 240);
  let drawn = 0;
  for (let i = 0; i < data.length; i += 4) drawn += Math.abs(data[i + 1] - data[1]) > 60;
  return drawn / (320 * 240);
}"""


def ink(page) -> float:
    """Share of the picture's pixels that are neither background nor shadow."""
    return page.evaluate(INK)


@browser_test
def test_meshes_of_all_kinds_are_drawn(opened, tmp_path):
    """Faces of four corners; of different sizes; uv per corner."""
    clip = bending_tube()
    quads = clip.faces
    mixed = {"face_vertex_counts": np.full(len(quads), 4, np.int32), "face_vertex_indices": quads.ravel()}
    mixed["face_vertex_counts"][0] = 3
    mixed["face_vertex_indices"] = np.delete(quads.ravel(), 3)
    uv = np.linspace(0, 1, 2 * quads.size, dtype=np.float32).reshape(-1, 2)
    cases = {
        "quads.ath": (quads, {}, {}),
        "mixed.ath": (None, mixed, {}),
        "corners.ath": (quads, {"uv": uv}, {"domains": {"uv": "corner"}}),
    }
    files = {}
    for name, (clip.faces, clip.attributes, clip.metadata) in cases.items():
        clip.metadata = clip.metadata | {"up_axis": "z"}
        clip.check()
        files[name] = athcodec.encode(clip, tmp_path / name, rel_error=1e-3).path.read_bytes()
    with ThrottledServer(files) as line:
        for name in files:
            page = opened(line.page(name))
            page.wait_for_function("() => athcodecViewer.plants[0].ath.geometry?.index.count > 0")
            page.keyboard.press("l")
            mesh = page.evaluate("""() => {
              const { index, attributes: { position, normal, uv } } = athcodecViewer.plants[0].ath.geometry;
              return { index: index.count, vertices: position.count, uv: uv?.count ?? 0, normal: normal.count };
            }""")
            triangles = 2 * len(quads) - (name == "mixed.ath")
            vertices = quads.size if name == "corners.ath" else clip.vertex_count
            uv = vertices if name == "corners.ath" else 0
            assert mesh == {"index": 3 * triangles, "vertices": vertices, "normal": vertices, "uv": uv}
            page.wait_for_function("() => athcodecViewer.counters.pictures > 1")
            assert ink(page) > 0.01, name


def smooth_normals(positions: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Each quad's normal, by its diagonals, added to its corners."""
    a, b, c, d = (positions[quads[:, k]] for k in range(4))
    normals = np.zeros_like(positions)
    for k in range(4):
        np.add.at(normals, quads[:, k], np.cross(c - a, d - b))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@browser_test
def test_normals_turn_with_the_surface_at_every_level(opened, tmp_path):
    clip = bending_tube()
    quads = clip.faces
    path = tmp_path / "tube.ath"
    athcodec.encode(clip, path, rel_error=1e-3)
    with ThrottledServer({"tube.ath": path.read_bytes()}) as line, athcodec.open(path) as decoder:
        page = opened(line.page("tube.ath"))
        page.evaluate(READBACK)
        page.wait_for_function("() => athcodecViewer.plants[0].ath.geometry?.hasAttribute('normal')")
        for level in range(decoder.file.level_count):
            page.evaluate(f"athcodecViewer.shown({decoder.time[20] - decoder.time[0]}, {level})")
            shown = positions_of(page, "onGraphics('normals')")
            drawn = decoder.positions(20, level) if level > 0 else drawn_at_level_0(decoder, 20)
            wanted = smooth_normals(drawn.astype(float), quads)
            turned = np.abs(wanted - smooth_normals(clip.rest.astype(float), quads)).max()
            assert turned > 0.3 and (shown * wanted).sum(axis=1).min() > np.cos(np.radians(8)), level


@browser_test
def test_the_page_works_by_keyboard(opened_file, sample_ath):
    page = opened_file(sample_ath.read_bytes())

    def pressed(key: str, then: str):
        page.keyboard.press(key)
        return page.evaluate(then)

    assert pressed("Space", "athcodecViewer.state.playing") is False
    pressed("Home", "0")
    assert pressed("ArrowRight", "athcodecViewer.state.time") == pytest.approx(1 / 30, rel=1e-3)
    assert pressed("[", "athcodecViewer.motion.target") < page.evaluate("athcodecViewer.motion.levelCount") - 1
    assert pressed("a", "athcodecViewer.motion.automatic") is True
    assert pressed("c", "document.querySelector('#colour [aria-checked=true]').textContent") == "Part"
    assert pressed("s", "document.querySelector('#show [aria-checked=true]').textContent") == "Lines"
    assert pressed("l", "athcodecViewer.motion.wrap") == "clamp", "a file without loops was repeated"
    assert pressed("l", "athcodecViewer.motion.wrap") == "loop"
    assert pressed("d", "athcodecViewer.plants.length") == 2
    assert pressed("f", "Boolean(athcodecViewer.state.forest) && athcodecViewer.plants.length === 1") is True
    with page.expect_download() as download:
        page.keyboard.press("p")
    assert Path(download.value.path()).read_bytes()[:4] == b"\x89PNG"
