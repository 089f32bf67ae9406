"""The examples for engines in JavaScript: what is shown is what the decoder of Python gives, at the level that a
distance asks for, and no more is fetched than that level takes. PlayCanvas, Babylon.js and three.js draw the shipped
tree in Chromium, in software."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
import shutil
from pathlib import Path

import numpy as np
import plants
import pytest
from programs import CACHE, install_once, printed

import athcodec
from bench import engines as measured
from bench.store import read
from bench.throttled_server import ThrottledServer

ROOT = Path(__file__).resolve().parent.parent
VIEWER = ROOT / "athcodec" / "viewer"
EXAMPLES = VIEWER / "examples"
TREE = ROOT / "athcodec" / "sample" / "leafed_tree.ath"
NODE = Path(__file__).resolve().parent / "node"
NEAR, FAR = 12.0, 90.0  # Metres at which the tree is shown at two levels.
FRAMES = range(0, 40, 4)
ESBUILD = "esbuild@0.28.2"
# Engines that a user of Babylon.js or PlayCanvas has, and those of a user of three.js.
APPS = {"engines_page.mjs": "playcanvas@2.23.3 @babylonjs/core@9.35.0", "engines_three_page.mjs": "three@0.187.0"}
ENGINES = {"playcanvas": "engines_page.mjs", "babylon": "engines_page.mjs", "three": "engines_three_page.mjs"}
NAMES = {"playcanvas": "PlayCanvas", "babylon": "Babylon.js", "three": "three.js"}

PLAY = """
import { openPlant } from "./plant.js";
const [url, distance, ...seconds] = process.argv.slice(2);
const view = { distance: Number(distance), fov: 0.8, height: 1080, budget: 50 };
const plant = await openPlant(url), shown = [];
for (const at of seconds.map(Number)) {
  const wanted = plant.file.levelFor(view.distance, view.fov, view.height, 1, 0, 1, "p99");
  let now = plant.update(at, view);
  for (let i = 0; i < 2000 && now?.level !== wanted && !plant.failure; i++) {
    await new Promise((done) => setTimeout(done, 2));
    now = plant.update(at, view);
  }
  const positions = [...now?.positions ?? []], normals = [...(now?.normals ?? []).slice(0, 300)];
  shown.push({ level: now?.level ?? -1, wanted, positions, normals, bounds: now?.bounds });
}
const { failure, mesh, origin } = plant;
console.log(JSON.stringify({ shown, failure: failure?.message ?? null, source: [...mesh.source], origin,
  triangles: [...mesh.triangles] }));
"""


# Plays 60 pictures a second by a clock of its own, in which a segment takes `cost` ms at the deepest level, and a
# `share` of that for each step at others.
PLAY_ON = """
import { openPlant } from "./plant.js";
const [url, cost, rounds, share] = process.argv.slice(2), { AthFile } = await import("athcodec-three/decoder");
const plant = await openPlant(url), { file } = plant, deepest = file.info.levelCount - 1;
const alone = file.preparation(0, deepest);
let clock = 0, steps = 1, spent = 0, longest = 0;
while (!alone.step(1)) steps++;
alone.segment.free();
performance.now = () => clock;
const preparation = file.preparation.bind(file);
file.preparation = (...given) => {
  const work = preparation(...given), step = work.step.bind(work);
  work.step = () => { clock += (work.level === deepest ? 1 : Number(share)) * Number(cost) / steps; return step(1); };
  return work;
};
const shown = [], view = { distance: 1e-3, fov: 0.8, height: 1080 };
for (let picture = 0; picture / 60 < rounds * file.clips[0].lastTime; picture++) {
  const start = clock, now = plant.update(picture / 60, view);
  longest = Math.max(longest, clock - start);
  shown.push([file.segmentOf(Math.floor(file.frameAt(picture / 60, "loop"))), now?.level ?? -1]);
  await new Promise((done) => setTimeout(done, 0)); // what is fetched arrives
  while (picture === 0 && file.ranges(deepest, 0).length > 0 && !plant.failure) { // to measure decoding alone
    plant.update(0, view);
    await new Promise((done) => setTimeout(done, 1));
  }
}
const sizes = Array.from({ length: deepest + 1 }, (_, level) =>
  file.ranges(level, 0, file.info.segmentCount - 1, true).reduce((sum, { size }) => sum + size, 0));
console.log(JSON.stringify({ shown, deepest, sizes, steps, longest, failure: plant.failure?.message ?? null }));
"""


def package(folder: Path) -> None:
    """The npm package, where programs of a folder find it."""
    (folder / "node_modules").mkdir()
    (folder / "node_modules" / "athcodec-three").symlink_to(VIEWER)


def run(folder: Path, script: str, *words: object, player: str | None = None) -> str:
    """What a script prints that stands beside plant.js, or another player of that name."""
    package(folder)
    (folder / "plant.js").write_text(player or (EXAMPLES / "plant.js").read_text("utf-8"), "utf-8")
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "script.mjs").write_text(script)
    return printed("node", folder / "script.mjs", *words)


def decoded(level: int, frame: int) -> np.ndarray:
    with athcodec.open(TREE) as decoder:
        return decoder.at_level(level)[frame]


@pytest.mark.web
@pytest.mark.parametrize("distance, ranges", [(NEAR, True), (400.0, True), (400.0, False)])
def test_the_example_shows_what_python_decodes_and_fetches_what_its_level_takes(distance, ranges, tmp_path):
    data = TREE.read_bytes()
    with ThrottledServer({"tree.ath": data}, ranges=ranges) as server:
        result = json.loads(run(tmp_path, PLAY, f"{server.address}tree.ath", distance, 0.5, 3.5))
        fetched = server.sent("tree.ath")
    assert result["failure"] is None
    for shown, frame in zip(result["shown"], (15, 105)):
        assert shown["level"] == shown["wanted"]
        wanted = decoded(shown["level"], frame)[result["source"]] - result["origin"]
        assert np.abs(np.reshape(shown["positions"], (-1, 3)) - wanted).max() < 1e-6 * np.abs(wanted).max()
        assert np.allclose(np.reshape(shown["bounds"], (2, 3)), [wanted.min(axis=0), wanted.max(axis=0)], atol=1e-5)
        assert np.allclose(np.linalg.norm(np.reshape(shown["normals"], (-1, 3)), axis=1), 1, atol=1e-5)
    with athcodec.open(TREE) as decoder:
        level = decoder.levels[result["shown"][0]["level"]]
        assert len(result["triangles"]) > 0 and max(result["triangles"]) < len(result["source"])
        if ranges:  # prelude, arrays, and of the two segments of one clip what the level takes
            assert fetched <= level.bytes + len(data) - decoder.levels[-1].bytes + (1 << 14)
            assert distance == NEAR or fetched < len(data) / 3


@pytest.fixture(scope="module")
def swaying() -> bytes:
    """A plant of 6 segments of 40 frames, 1.3 s each."""
    options = dict(rel_error=1e-3, effort="fast", segment_frames=40)
    return athcodec.encode(plants.plant(branches=60, longest=20, frames=240), **options)


# The budget of 2 ms in each of 80 pictures is 160 ms a segment: the second case takes more.
@pytest.mark.web
@pytest.mark.parametrize("cost", [110, 200])
def test_the_shown_level_never_falls_at_the_boundaries_of_segments(cost, swaying, tmp_path):
    with ThrottledServer({"plant.ath": swaying}) as server:
        result = json.loads(run(tmp_path, PLAY_ON, f"{server.address}plant.ath", cost, 1.5, 0.1))
    assert result["failure"] is None and result["steps"] > 100, "one step is little"
    segments, levels = np.transpose(result["shown"])
    arrival = np.argmax(levels == result["deepest"])
    assert (levels[np.argmax(levels >= 0) :] >= 0).all() and (np.diff(segments[arrival:]) != 0).sum() > 6
    assert (levels[arrival:] == result["deepest"]).all()
    assert result["longest"] <= 500 / 60 + cost / result["steps"], "half of a picture's time, and a step"


@pytest.mark.web
def test_boundaries_of_segments_show_a_middle_level_where_the_finest_comes_too_late(swaying, tmp_path):
    with ThrottledServer({"plant.ath": swaying}) as server:
        result = json.loads(run(tmp_path, PLAY_ON, f"{server.address}plant.ath", 3000, 1.5, 0.005))
    middle = max(level for level, size in enumerate(result["sizes"]) if 8 * size <= result["sizes"][-1])
    segments, levels = np.transpose(result["shown"])
    arrival = np.argmax(levels == middle)
    assert result["failure"] is None and 0 < middle < result["deepest"]
    assert (np.diff(segments[arrival:]) != 0).sum() > 6 and (levels[arrival:] >= middle).all()


def page_blocks() -> list[str]:
    """The blocks of JavaScript of the page: the player, what lists levels, and lines for fades."""
    return re.findall(r"```js\n(.*?)```\n", (ROOT / "docs" / "engines.md").read_text("utf-8"), re.DOTALL)


WARNS = 'process.on("warning", (warning) => { throw warning; });'
LISTS = """
import { readFileSync } from "node:fs";
import { openPlant } from "./plant.js";
const plant = await openPlant(readFileSync(process.argv[2]));
"""


@pytest.mark.web
def test_the_lines_of_the_page_list_the_levels_of_a_file_in_node(tmp_path):
    lines = run(tmp_path, WARNS + LISTS + page_blocks()[1], TREE).splitlines()
    with athcodec.open(TREE) as decoder:
        levels = decoder.file.levels
    assert len(lines) == len(levels)
    for line, level in zip(lines, levels):  # A level does without what only coarser ones need.
        words, size = line.rsplit(" ", 1)
        assert words == f"{level.level} {level.name} {level.p99_error:.16g}" and 0 < int(size) <= level.bytes


FADES = """
import { openPlant } from "./plant.js";
import { readFileSync } from "node:fs";
const plant = await openPlant(readFileSync(process.argv[2])), shown = [], { file } = plant;
const start = file.times()[file.segmentStart(1)] - 0.15, play = (k, distance) =>
  plant.update(start + k / 600, { distance, fov: 0.8, height: 1080, budget: 1e9 });
for (let k = 0; k < 240; k++) shown.push([...play(k, k < 20 ? 1e9 : 1e-3).positions]);
console.log(JSON.stringify(shown));
"""


@pytest.mark.web
def test_the_lines_of_the_page_fade_from_level_to_level_over_boundaries_of_segments(swaying, tmp_path):
    (tmp_path / "plant.ath").write_bytes(swaying)
    text, steps, ends = (EXAMPLES / "plant.js").read_text("utf-8"), [], []
    replaced = re.search(r"    for \(const each of decoded\).*?file\.positions\(.*?\n", text, re.DOTALL)[0]
    faded = text.replace(replaced, page_blocks()[2]).replace("{ AthFile, ready }", "{ AthFade, AthFile, ready }")
    faded = faded.replace("  let works", "  const fade = new AthFade();\n  let works")
    for name, code in (("plain", text), ("faded", faded)):
        folder = tmp_path / name
        folder.mkdir()
        shown = np.array(json.loads(run(folder, FADES, tmp_path / "plant.ath", player=code)))
        steps.append(np.abs(np.diff(shown, axis=0)).max(axis=1))
        ends.append(shown[-1])
    assert np.argmax(steps[0]) == 19 and steps[1].max() < steps[0].max() / 4
    assert np.allclose(*ends, atol=1e-5 * np.abs(ends[0]).max())


def version_of(engine: str) -> str:
    """The version that npm installs for the tests of an engine."""
    return re.search(rf"{engine}\S*?@(\S+)", APPS[ENGINES[engine]])[1]


def test_the_page_shows_the_example_and_its_table_the_versions_and_lines():
    page = (ROOT / "docs" / "engines.md").read_text("utf-8")
    assert page_blocks()[0] == (EXAMPLES / "plant.js").read_text("utf-8")
    for path in ("viewer/examples/plant.js", "core/examples/Plant.cs", "core/examples/raylib_player.c"):
        assert re.search(rf"\({re.escape(f'../athcodec/{path}')}\) \| {measured.lines_of(path)} \|", page), path
    rows = {row["engine"]: row for row in read(measured.RESULTS)["engines"]}
    assert rows.keys() == measured.EXAMPLES.keys()
    for engine, row in rows.items():
        assert row["lines"] == measured.lines_of(measured.EXAMPLES[engine][0]), engine
    for engine, name in NAMES.items():
        assert rows[name]["version"] == version_of(engine), name


@pytest.mark.web
def test_a_plant_without_faces_is_points(tmp_path):
    clip = plants.plant(branches=4, frames=10)
    script = """
    import { openPlant } from "./plant.js";
    const plant = await openPlant(process.argv[2]), { mesh, origin } = plant;
    let shown = null;
    while (shown?.level !== plant.file.info.levelCount - 1 && !plant.failure) {
      await new Promise((done) => setTimeout(done, 1));
      shown = plant.update(0.2, { distance: 1e-3, fov: 0.8, height: 1080 });
    }
    console.log(JSON.stringify({ failure: plant.failure, positions: [...shown.positions], origin,
      source: [...mesh.source], triangles: mesh.triangles.length }));
    """
    with ThrottledServer({"points.ath": athcodec.encode(clip, rel_error=1e-3, effort="fast")}) as server:
        result = json.loads(run(tmp_path, script, f"{server.address}points.ath"))
    assert result["failure"] is None and result["triangles"] == 0
    wanted, bound = clip.positions[6], 1.1e-3 * np.linalg.norm(np.ptp(clip.positions.reshape(-1, 3), axis=0))
    assert np.abs(np.reshape(result["positions"], (-1, 3)) + result["origin"] - wanted[result["source"]]).max() < bound


@pytest.mark.web
def test_a_file_that_is_cut_off_or_not_there_is_an_error(tmp_path):
    with ThrottledServer({"cut.ath": TREE.read_bytes()[:20_000]}) as server:
        for name, message in (("cut.ath", "MISSING"), ("none.ath", "got status 404")):
            folder = tmp_path / name
            folder.mkdir()
            script = f"""
            import {{ openPlant }} from "./plant.js";
            await openPlant("{server.address}{name}").catch((error) => console.log(error.message));
            """
            assert message in run(folder, script)


def test_an_engine_that_is_not_three_asks_for_no_three():
    """In the first tier; `test_an_app_of_another_engine_installs_no_three` lets npm install the package."""
    described = json.loads((VIEWER / "package.json").read_text())
    assert all(described["peerDependenciesMeta"][name]["optional"] for name in described["peerDependencies"])
    for name in ("plant.js", "playcanvas.js", "babylon.js"):
        assert '"three' not in (EXAMPLES / name).read_text() and '"athcodec-three"' not in (EXAMPLES / name).read_text()


# ---- engines, in Chromium ----


def numbers(text: str, dtype) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype)


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    """A function that gives the folder with an app, whose packages npm has installed."""

    def installed(page: str) -> Path:
        folder, packed = CACHE / Path(page).stem, tmp_path_factory.mktemp("packed")
        name = printed("npm", "pack", "--silent", "--pack-destination", packed, cwd=VIEWER).split()[-1]

        def install() -> None:
            (folder / "package.json").write_text('{"name": "app", "private": true, "type": "module"}')
            packages = [*APPS[page].split(), ESBUILD, packed / name]
            printed("npm", "install", "--no-audit", "--no-fund", *packages, cwd=folder)

        state = hashlib.sha256((packed / name).read_bytes()).hexdigest()
        install_once(folder, f"{APPS[page]} {ESBUILD} {state}", install)
        return folder

    return installed


@pytest.mark.programs
def test_an_app_of_another_engine_installs_no_three(app):
    modules = app("engines_page.mjs") / "node_modules"
    assert (modules / "athcodec-three").exists() and (modules / "playcanvas").exists()
    assert not (modules / "three").exists()


@pytest.mark.programs
@pytest.mark.browser
@pytest.mark.parametrize("engine", ENGINES)
def test_an_engine_shows_the_shipped_tree_at_two_levels_as_python_decodes_it(engine, app, browser, tmp_path):
    from PIL import Image

    folder = app(ENGINES[engine])
    shutil.copy(NODE / ENGINES[engine], folder)
    bundle = ["--bundle", "--format=esm", f"--outfile={tmp_path / 'page.js'}", "--log-level=error"]
    printed(folder / "node_modules" / ".bin" / "esbuild", ENGINES[engine], *bundle, cwd=folder)
    files = {path.name: path.read_bytes() for path in tmp_path.glob("*.js")} | {"tree.ath": TREE.read_bytes()}
    files["ath_worker.js"] = (VIEWER / "web" / "ath_worker.js").read_bytes()
    files["page.html"] = b'<canvas width="320" height="240"></canvas><script type="module" src="/page.js"></script>'
    page, errors = browser.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    pictures, levels, spent = [], [], []
    with ThrottledServer(files) as server:
        page.goto(f"{server.address}page.html")
        page.wait_for_function("() => globalThis.engines", timeout=60_000)
        draws = "engines[name](document.querySelector('canvas'), '/tree.ath', 4)"
        page.evaluate(f"async (name) => {{ globalThis.player = await {draws}; }}", engine)
        for distance in (FAR, NEAR):
            for frame in FRAMES:
                shown = page.evaluate("([seconds, distance]) => player.play(seconds, distance)", [frame / 30, distance])
                positions = numbers(shown["positions"], np.float32).reshape(-1, 3)
                wanted = decoded(shown["level"], frame)[numbers(shown["source"], np.uint32)]
                assert np.abs(positions - wanted).max() < 1e-5 * np.abs(wanted).max()
                spent.append(shown["ms"])
            levels.append(shown["level"])
            url = page.evaluate("(distance) => player.picture(0.5, distance)", distance)
            pictures.append(np.array(Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))).convert("RGB"), int))
    page.close()
    assert errors == [] and levels[0] < levels[1]
    for name, picture in zip(("far", "near"), pictures):
        Image.fromarray(picture.astype(np.uint8)).save(tmp_path / f"{engine}_{name}.png")
    shares = [(np.abs(picture - picture[0, 0]).max(axis=2) > 20).mean() for picture in pictures]
    assert 0.0005 < shares[0] < shares[1] / 4 and shares[1] > 0.05, "the tree is drawn, and larger from near"
    far, near = np.median(spent[:10]), np.median(spent[10:])
    measured.record(NAMES[engine], version_of(engine), near, far)
