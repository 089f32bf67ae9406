"""Forests on WebGPU: bytes uploaded, memory of levels beside baked textures, and what a frame costs the processor.

A clip is joined with copies of it, as many as there are clips. Rendering is in software, so nothing is said of the time
that a graphics processor takes; what is timed is the page's own work, without three.js, on a stopped page.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import athcodec
from bench.browser import WEBGPU_FLAGS, chromium
from bench.clips import add_clips, add_effort, add_rel_error
from bench.tables import table
from bench.throttled_server import ThrottledServer

COUNTS = (100, 10_000)
UPDATES = 40
TEXEL = 8  # of a texture of four halves, one for each vertex and frame: positions, without normals
READY = "athcodecForest.forest.levels.length === athcodecForest.ath.motion.levelCount"
NOTE = (
    "motion: bytes uploaded once, of levels and segments. parameters: bytes a frame, which frames are shown, and "
    f"the view. All levels are computed in each frame. milliseconds: mean of {UPDATES} updates, 60 a second."
)
MEASURED = """async (updates) => {
  const { forest, camera, renderer, ath } = athcodecForest, { device } = renderer.backend;
  camera.position.set(0, ath.sphere.radius, 0);
  forest.update(camera, 720, 0);
  const before = forest.bytesOfParameters;
  let spent = 0;
  for (let i = 0; i < updates; i++) {
    const start = performance.now();
    forest.update(camera, 720, i / 60);
    spent += performance.now() - start;
    if (i % 5 === 4) await device.queue.onSubmittedWorkDone();
  }
  return { milliseconds: spent / updates, parameters: (forest.bytesOfParameters - before) / updates,
    motion: forest.bytesOfMotion, plants: forest.plantCount, gpu: forest.levels.map(({ passes }) => passes.bytes),
    uploads: forest.levels.map(({ passes }) => passes.bytesOfMotion) };
}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_effort(parser, "fast")
    parser.add_argument("--copies", type=int, default=10, metavar="CLIPS", help="of the clip in the file (default 10)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    costs, memory = [], []
    for path in args.clips:
        with tempfile.TemporaryDirectory() as folder, athcodec.read(path) as clip:
            file = Path(folder) / "clips.ath"
            clips = athcodec.join({f"copy {i}": clip for i in range(args.copies)})
            athcodec.encode(clips, file, rel_error=args.rel_error, effort=args.effort, attributes="none")
            texture = TEXEL * clip.frame_count * clip.vertex_count * args.copies
            data = file.read_bytes()
        for count in COUNTS:
            found = measured(data, count)
            case = {"clip": path.stem, "clips": args.copies, "instances": count}
            costs.append(case | {name: found[name] for name in ("plants", "milliseconds", "parameters", "motion")})
        for level, (size, upload) in enumerate(zip(found["gpu"], found["uploads"], strict=True)):
            memory.append(
                {"clip": path.stem, "level": level, "uploaded": upload, "on the GPU": size, "texture": texture}
            )
    return {"tables": [table("A frame", costs, NOTE), table("Bytes of a level", memory)], "broken": []}


def measured(data: bytes, count: int) -> dict[str, Any]:
    with chromium(WEBGPU_FLAGS) as browser, ThrottledServer({"plant.ath": data}) as line:
        page = browser.new_page(viewport={"width": 320, "height": 200})
        page.goto(f"{line.address}forest.html?file=plant.ath&count={count}&drawn=0")
        page.wait_for_function("() => window.athcodecForest?.forest")
        page.evaluate("athcodecForest.forest.pixels = 1e-6")  # so that all levels are wanted
        page.wait_for_function(f"() => {READY}", timeout=300_000)
        page.evaluate("athcodecForest.playing = false")
        return page.evaluate(MEASURED, UPDATES)
