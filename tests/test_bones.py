"""Meshes on the bones of a plant, moved in three.js by the plant's own file: docs/onto.md. Needs Node and npm; run with
-m programs, what looks at pictures with -m browser."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from test_gltf_programs import node  # noqa: F401, a fixture
from test_onto import CARD, LENGTH, bent_clip, coarse_surfaces, line, rows, surfaces, tube

import athcodec
from athcodec.viewer.build_viewer import modules
from bench.throttled_server import ThrottledServer

pytestmark = pytest.mark.programs

ROOT = Path(__file__).resolve().parent.parent
VIEWER = ROOT / "athcodec" / "viewer"
RINGS = (41, 21, 6)  # Of the tube of each level of detail.


@pytest.fixture
def bound(tmp_path):
    """The folder of a plant's file and three levels of detail on its bones."""
    points = np.concatenate([line(21), line(9, (0.0, 1.0, 0.1), (0.0, 1.0, 0.9))])
    edges = np.concatenate([rows(21), [[10, 21]], 21 + rows(9)])
    athcodec.encode(bent_clip(points, edges=edges), tmp_path / "tree.ath", rel_error=1e-5, exact_rest=True)
    with athcodec.open(tmp_path / "tree.ath") as plant:
        for number, rings in enumerate(RINGS):
            trunk, quads = tube(0.0, LENGTH, 0.05, rings)
            side, side_quads = tube(0.05, 0.9, 0.03, max(rings // 2, 2), axis=2, centre=(0.0, 1.0))
            faces = [*quads, *(len(trunk) + side_quads), len(trunk) + len(side) + np.arange(4)]
            with athcodec.onto(plant, np.concatenate([trunk, side, CARD]), faces=faces) as moving:
                facts = moving.write_bound(tmp_path / f"lod{number}_bound.glb")
                np.savez(tmp_path / f"lod{number}.npz", moved=np.asarray(moving), max_error=facts["max_error"])
    return tmp_path


def test_one_file_moves_three_meshes_in_three_js_as_onto_does(bound, node):  # noqa: F811
    for number in range(len(RINGS)):
        out = bound / "out.bin"
        facts = json.loads(
            node("bones.mjs", VIEWER, bound / "tree.ath", bound / f"lod{number}_bound.glb", out).splitlines()[-1]
        )
        expected = np.load(bound / f"lod{number}.npz")
        moved = expected["moved"]
        off = np.linalg.norm(np.fromfile(out, "<f4").reshape(moved.shape) - moved, axis=2)
        assert facts["allocated"] < 2000, "bytes a pose: numbers alone"
        assert facts["bones"] == 30 and off.max() <= expected["max_error"] + 1e-5
        assert np.median(off) < 1e-3 * np.abs(moved[-1] - moved[0]).max()


def test_slices_of_surfaces_move_a_mesh_in_three_js_as_its_bones_say(tmp_path, node):  # noqa: F811
    points, faces = coarse_surfaces()
    athcodec.encode(surfaces(), tmp_path / "tree.ath", rel_error=1e-5, exact_rest=True)
    with athcodec.open(tmp_path / "tree.ath") as plant, athcodec.onto(plant, points, faces=faces) as moving:
        facts = moving.write_bound(tmp_path / "bound.glb")
        moved = np.asarray(moving)
    out = tmp_path / "out.bin"
    printed = node("bones.mjs", VIEWER, tmp_path / "tree.ath", tmp_path / "bound.glb", out)
    assert json.loads(printed.splitlines()[-1])["allocated"] < 2000, "bytes a pose: numbers alone"
    off = np.linalg.norm(np.fromfile(out, "<f4").reshape(moved.shape) - moved, axis=2)
    assert off.max() <= facts["max_error"] + 1e-5 < 1e-3 * np.abs(moved[-1] - moved[0]).max() + 1e-5


def test_a_bound_mesh_is_valid_gltf(bound, node):  # noqa: F811
    found = json.loads(node("validate.mjs", bound / "lod1_bound.glb"))
    assert (found["errors"], found["warnings"]) == (0, 0), found["messages"]


PAGE = """<!doctype html><link rel="icon" href="data:,"><body style="margin:0"><script type="importmap">{"imports": {
  "three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/",
  "athcodec-three/": "/package/"}}</script>
<script type="module">
import { Scene, PerspectiveCamera, WebGLRenderer, DirectionalLight, HemisphereLight } from 'three';
SNIPPET
const renderer = new WebGLRenderer({ preserveDrawingBuffer: true }), camera = new PerspectiveCamera(35, 1, 0.1, 100);
renderer.setSize(400, 400);
document.body.append(renderer.domElement);
scene.add(new HemisphereLight(0xffffff, 0x888888, 3));
globalThis.show = (away, at) => {
  camera.position.set(0, 1, away);
  camera.lookAt(0, 1, 0);
  camera.updateMatrixWorld();
  seconds = at;
  draw();
  renderer.render(scene, camera);
  return [tree.getCurrentLevel(), renderer.domElement.toDataURL()];
};
</script>"""


@pytest.mark.browser
def test_a_chain_of_levels_of_detail_moves_by_one_file_as_the_document_says(bound, opened):
    code = re.search(r"```js\n(.*?)```", (ROOT / "docs" / "onto.md").read_text("utf-8"), re.S)[1]
    code = code.replace("athcodec-three/decoder", "athcodec-three/ath_decoder.mjs")
    code = code.replace("athcodec-three/gltf/bones", "athcodec-three/gltf/bones.js")
    before, frame = code.split("// every frame\n")
    snippet = f"const scene = new Scene(); let seconds = 0;\n{before}\nconst draw = () => {{\n{frame}\n}};"
    files = {path.name: path.read_bytes() for path in bound.glob("*.*") if path.suffix in (".ath", ".glb")}
    for folder, names in (
        (modules() / "three", ("build/three.module.js", "build/three.core.js")),
        (modules() / "three", ("examples/jsm/loaders/GLTFLoader.js",)),
        (modules() / "three", ("examples/jsm/utils/BufferGeometryUtils.js", "examples/jsm/utils/SkeletonUtils.js")),
        (VIEWER, ("ath_decoder.mjs", "gltf/bones.js")),
    ):
        at = "three" if folder.name == "three" else "package"
        files |= {f"{at}/{name}": (folder / name).read_bytes() for name in names}
    files["index.html"] = PAGE.replace("SNIPPET", snippet).encode()
    with ThrottledServer(files) as line_:
        page = opened(f"{line_.address}index.html", "globalThis.show !== undefined")
        shown = [page.evaluate(f"show({away}, {at})") for away in (6, 20, 60) for at in (0.0, 0.4)]
    assert [level for level, _ in shown] == [0, 0, 1, 1, 2, 2]
    pictures = [picture for _, picture in shown]
    assert all(still != moved for still, moved in zip(pictures[::2], pictures[1::2]))
