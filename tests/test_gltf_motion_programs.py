"""ATH_motion in the programs that play and change glTF: three.js, Babylon.js and glTF-Transform with their plugins in
athcodec/viewer/gltf, and Khronos' validator. Needs Node and npm; run with -m programs, what looks at pictures with
-m browser."""

from __future__ import annotations

import functools
import http.server
import json
import shutil
import threading
from pathlib import Path

import numpy as np
import pytest
from plants import distance
from test_gltf import leafy, seasons  # noqa: F401, fixtures
from test_gltf_motion import encoded, moved_primitives, rewritten, seamed, stored_positions, world
from test_gltf_programs import node, three_file  # noqa: F401, fixtures

import athcodec
from athcodec.cli import main
from athcodec.exporters import write
from athcodec.motion.clip import MotionClip
from athcodec.viewer.picture import chromium

VIEWER = Path(__file__).resolve().parent.parent / "athcodec" / "viewer"
ENGINES = ["three", "babylon"]
pytestmark = pytest.mark.programs


def assert_valid(node, path):  # noqa: F811
    """No error and no warning; that the extension is not known to the validator is a note."""
    found = json.loads(node("validate.mjs", path))
    assert (found["errors"], found["warnings"]) == (0, 0), found["messages"]
    notes = {message.split()[0] for message in found["messages"]}
    hints = {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT", "BUFFER_VIEW_TARGET_MISSING"}
    assert notes <= hints, found["messages"]


@pytest.fixture
def played(node, tmp_path):  # noqa: F811
    """(T, N, 3) where an engine shows the vertices that move, and what else it says."""

    def play(engine, path, times, *clip):
        (tmp_path / "times.json").write_text(json.dumps([float(time) for time in times]))
        out = tmp_path / "shown.bin"
        facts = json.loads(
            node("gltf_motion.mjs", engine, VIEWER, path, tmp_path / "times.json", out, *clip).splitlines()[-1]
        )
        return np.fromfile(out, "<f4").reshape(len(times), -1, 3), facts

    return play


@pytest.fixture
def sources(three_file, leafy, tmp_path):  # noqa: F811
    """GLBs by what moves them: a skin, nodes and morph targets at once; joints; morph targets; vertices with seams."""
    for animation in ("joints", "morphs"):
        write(leafy, tmp_path / f"{animation}.glb", animation=animation)
    seams = seamed(leafy, tmp_path / "seams.glb", translation=[1, 2, 3], scale=[2, 2, 2])
    return {"three": three_file, "joints": tmp_path / "joints.glb", "morphs": tmp_path / "morphs.glb", "seams": seams}


def start_of(kind):
    """Seconds at which its animation begins."""
    return 0.25 if kind == "seams" else 0.0


KINDS = ["three", "joints", "morphs", "seams"]


@pytest.mark.parametrize("kind", KINDS)
def test_files_are_valid_and_engines_show_what_the_text_says(kind, sources, node, played, tmp_path):  # noqa: F811
    out = encoded(sources[kind], tmp_path / "out.glb")
    assert_valid(node, out)
    wanted, _ = world(out)
    with athcodec.open(out) as decoder:
        times, name = start_of(kind) + decoder.time - decoder.time[0], decoder.file.clips[0].name
    frames = [0, 7, len(times) - 1]
    for engine in ENGINES:
        shown, facts = played(engine, out, times[frames])
        assert distance(shown, wanted[frames]) < 1e-5 * np.abs(wanted).max(), engine
        assert facts["warnings"] == [] and [animation[0] for animation in facts["animations"]] == [name]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_decoded_into_the_file_is_valid_and_three_plays_it(kind, sources, node, tmp_path):  # noqa: F811
    out = encoded(sources[kind], tmp_path / "out.glb")
    assert main(["decode", str(out), str(tmp_path / "again.glb")]) == 0
    assert_valid(node, tmp_path / "again.glb")
    wanted, _ = world(out)
    (tmp_path / "times.json").write_text(json.dumps([0.5 + start_of(kind)]))
    node("play.mjs", tmp_path / "again.glb", tmp_path / "times.json", tmp_path / "out.bin")
    shown = np.fromfile(tmp_path / "out.bin", "<f4").reshape(-1, 3)
    assert distance(shown, wanted[12 if kind == "three" else 15]) < 1e-5 * np.abs(wanted).max()


@pytest.mark.parametrize("engine", ENGINES)
def test_clips_play_by_their_names_at_their_times(engine, seasons, played, tmp_path):  # noqa: F811
    write(athcodec.join(seasons), tmp_path / "source.glb", animation="joints")
    out = encoded(tmp_path / "source.glb", tmp_path / "out.glb")
    for name in ("calm", "gale"):
        wanted, _ = world(out, name)
        with athcodec.open(out, clip=name) as decoder:
            times = decoder.time - decoder.time[0]
        shown, facts = played(engine, out, times[[0, 5, 11]], name)
        assert distance(shown, wanted[[0, 5, 11]]) < 1e-3 * np.abs(wanted).max()  # float32 times of keys
        assert sorted(animation[0] for animation in facts["animations"]) == sorted(seasons)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_skin_that_was_kept_is_not_applied_to_the_motion(engine, sources, played, tmp_path):
    out = encoded(sources["joints"], tmp_path / "out.glb", "--keep-animation")
    wanted, _ = world(out)
    shown, _ = played(engine, out, [0.5])
    assert distance(shown, wanted[15:16]) < 1e-5 * np.abs(wanted).max()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("fault", ["version", "vertices", "mesh"])
def test_a_motion_that_cannot_be_played_leaves_the_fallback(engine, fault, sources, played, tmp_path):
    out = encoded(sources["joints"], tmp_path / "out.glb", "--keep-animation")
    if fault == "vertices":
        bad = rewritten(
            out,
            tmp_path / "bad.glb",
            lambda gltf: moved_primitives(gltf)[0]["extensions"]["ATH_motion"].update(firstVertex=1 << 40),
        )
    else:
        data = bytearray(out.read_bytes())
        place = data.rindex(b"\x89ATH") + 8 if fault == "version" else data.index(stored_positions(out).tobytes())
        data[place] ^= 1
        bad = tmp_path / "bad.glb"
        bad.write_bytes(data)
    _, facts = played(engine, bad, [0])
    assert len(facts["warnings"]) == 1 and "ATH_motion: motion 0 does not play" in facts["warnings"][0]
    if engine == "three":
        assert facts["meshes"][0][0] == "SkinnedMesh"
    else:
        assert facts["skeletons"] == 1


@pytest.mark.parametrize("kind", ["three", "seams"])
@pytest.mark.parametrize(
    "steps", ["copy", "prune", "dedup", "flatten", "dedup prune aside:meshopt", "aside:quantize aside:weld"]
)
def test_gltf_transform_leaves_motions_whole(steps, kind, sources, node, played, tmp_path):  # noqa: F811
    out = encoded(sources[kind], tmp_path / "out.glb")
    words = VIEWER, out, tmp_path / "again.glb", *steps.split()
    assert json.loads(node("gltf_motion_transform.mjs", *words).splitlines()[-1])["refused"] is None
    assert_valid(node, tmp_path / "again.glb")
    before, after = world(out)[0], world(tmp_path / "again.glb")[0]
    assert distance(before, after) < 1e-9
    shown, _ = played("three", tmp_path / "again.glb", [0.5 + start_of(kind)])
    assert distance(shown[0], after[12 if kind == "three" else 15]) < 1e-5 * np.abs(after).max()


def test_vertices_that_carry_their_numbers_may_be_put_in_another_order(sources, node, tmp_path):  # noqa: F811
    out = encoded(sources["seams"], tmp_path / "out.glb")
    said = json.loads(
        node("gltf_motion_transform.mjs", VIEWER, out, tmp_path / "again.glb", "weld", "reorder").splitlines()[-1]
    )
    assert said["refused"] is None
    before, after = (np.sort(world(path)[0].reshape(40, -1), axis=1) for path in (out, tmp_path / "again.glb"))
    assert before.shape == after.shape and np.allclose(before, after)


@pytest.mark.parametrize("step", ["quantize", "reorder", "meshopt"])
def test_gltf_transform_refuses_to_write_vertices_that_were_changed_and_names_them(step, sources, node, tmp_path):  # noqa: F811
    out = encoded(sources["three"], tmp_path / "out.glb")
    said = json.loads(node("gltf_motion_transform.mjs", VIEWER, out, tmp_path / "again.glb", step).splitlines()[-1])
    assert "ATH_motion" in said["refused"] and "stem" in said["refused"] and "aside()" in said["refused"]
    assert not (tmp_path / "again.glb").exists()


# ---- in a browser ----


@pytest.fixture(scope="module")
def page(node, tmp_path_factory):  # noqa: F811
    """A page that draws, and the folder that it is served from."""
    folder = tmp_path_factory.mktemp("page")
    node("gltf_motion_bundle.mjs", VIEWER, folder / "page.js")
    (folder / "index.html").write_text('<!doctype html><script type="module" src="page.js"></script>')
    shutil.copytree(VIEWER / "web", folder / "viewer" / "web")
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with chromium() as browser:
        opened = browser.new_page()
        opened.goto(f"http://127.0.0.1:{server.server_address[1]}/index.html")
        opened.wait_for_function("() => globalThis.draw", timeout=60_000)
        yield opened, folder
    server.shutdown()
    server.server_close()


def flag():
    """A sheet of 24 x 24 vertices that faces +z and bends to the right, 30 frames."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.5, 0.5, 24), np.linspace(0, 2, 24)))
    corner = np.arange(23)[:, None] * 24 + np.arange(23)
    quads = np.stack([corner, corner + 1, corner + 25, corner + 24], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    bend = np.linspace(0, 0.4, 30)[:, None] * y**2
    positions = np.stack([x + bend, np.broadcast_to(y, bend.shape), 0.2 * np.sin(3 * y) + 0 * bend], axis=-1)
    normals = np.tile(np.float32([0, 0, 1]), (x.size, 1))
    return MotionClip(positions.astype(np.float32), np.arange(30) / 30, faces=faces, attributes={"normals": normals})


def drawn_by(page, engine, name, seconds, box):
    """The picture, (256, 256, 3)."""
    words = [engine, name, seconds, box]
    picture = page.evaluate("([engine, url, seconds, box]) => draw(engine, url, seconds, box)", words)
    return np.array(picture, np.uint8).reshape(256, 256, 4)[..., :3].astype(int)


@pytest.mark.browser
@pytest.mark.parametrize("engine", ENGINES)
def test_pictures_are_those_of_the_file_before(engine, page):
    opened, folder = page
    write(flag(), folder / "source.glb", animation="morphs")
    encoded(folder / "source.glb", folder / "motion.glb")
    box = {"centre": [0.4, 1, 0], "size": [2, 2, 0]}

    def draw(name, seconds):
        return drawn_by(opened, engine, name, seconds, box)

    def differing(one, other):
        return (np.abs(one - other).max(axis=2) > 40).mean()

    later = draw("motion.glb", 0.9)
    drawn = differing(later, later[:1, :1])
    assert drawn > 0.05, "the sheet is in the picture"
    assert differing(draw("source.glb", 0.9), later) < 0.02 * drawn
    assert differing(draw("motion.glb", 0.2), later) > 0.3 * drawn, "it moves"


@pytest.mark.browser
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("form", ["joints", "morphs", "into"])
def test_a_leaf_is_green_from_either_side(engine, form, page):
    opened, folder = page
    leaf, name = flag().replace(attributes={}), f"{engine}_{form}.glb"
    write(leaf, folder / name, animation="morphs" if form == "into" else form)
    if form == "into":

        def strip(gltf):
            del gltf["materials"], gltf["meshes"][0]["primitives"][0]["material"]

        encoded(rewritten(folder / name, folder / f"bare_{name}", strip), folder / name)
    for side in (1, -1):
        box = {"centre": [0.2, 1, 0], "size": [2, 2, 0], "side": side}
        red, green, blue = drawn_by(opened, engine, name, 0.5, box)[128, 128]
        assert green > 50 and green > 1.2 * red and green > 1.4 * blue
