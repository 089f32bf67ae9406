"""Forests on WebGPU: bytes uploaded, memory of levels beside baked textures, what a frame costs the processor, and how
long the passes take beside skinning.

A clip is joined with copies of it, as many as there are clips. Where there is no graphics card rendering is in
software: times of passes then say something only beside those of skinning; the processor's are the page's own, without
those of its GPU process.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import athcodec
from athcodec.exporters import WriteOptions, openvat
from bench.browser import WEBGPU_FLAGS, chromium
from bench.clips import add_clips, add_effort, add_rel_error
from bench.tables import table
from bench.throttled_server import ThrottledServer

COUNTS = (100, 10_000)
UPDATES = 40
TEXEL = 8  # Bytes of a texel of four halves, one for each vertex and frame: positions, without normals.
HERE = Path(__file__).parent
COSTS = f"""motion: bytes uploaded once, of levels and segments. again: bytes of motion uploaded in {UPDATES} updates
when all of them are there. parameters: bytes a frame, which frames are shown, and the view. All levels are computed in
each frame. update: milliseconds, the median of {UPDATES} updates, 60 a second, of the forest; render: of three.js, the
median of 5."""
MEMORY = """Of all clips. textures: positions as four halves for each vertex and frame. OpenVAT: the PNG files that the
exporter writes, 16 bits a number."""
PASSES = """Milliseconds for all plants, each position, normal and previous position of each vertex, the median of 7.
skinning: one matrix for each branch, of two frames. shown: pass 3 alone, as between two frames; placed: passes 1 to 3
where every plant has come to its next frame, as a clip of 30 frames a second does in every other picture."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_effort(parser, "fast")
    parser.add_argument("--copies", type=int, default=10, metavar="CLIPS", help="of the clip in the file (default 10)")


def run(args: argparse.Namespace) -> dict[str, Any]:
    costs, memory, passes = [], [], []
    for path in args.clips:
        with tempfile.TemporaryDirectory() as folder, athcodec.read(path) as clip:
            file = Path(folder) / "clips.ath"
            clips = athcodec.join({f"copy {i}": clip for i in range(args.copies)})
            athcodec.encode(clips, file, rel_error=args.rel_error, effort=args.effort, attributes="none")
            texture = TEXEL * clip.frame_count * clip.vertex_count * args.copies
            theirs = args.copies * openvat_bytes(clip, Path(folder) / "vat")
            data = file.read_bytes()
        for count in COUNTS:
            print(f"{path.stem}: {count:,} instances", file=sys.stderr)
            found = measured(data, count, beside_skinning=count == COUNTS[0])
            case = {"clip": path.stem, "clips": args.copies, "instances": count}
            names = ("plants", "update", "render", "parameters", "again", "motion")
            costs.append(case | {name: found[name] for name in names})
            for row in found["passes"]:
                ratios = {f"{name} / skinning": row[name] / row["skinning"] for name in ("shown", "placed")}
                passes.append({"clip": path.stem, "plants": found["plants"]} | row | ratios)
        for level, (size, upload) in enumerate(zip(found["gpu"], found["uploads"], strict=True)):
            sizes = {"uploaded": upload, "on the GPU": size, "textures": texture, "OpenVAT": theirs}
            memory.append({"clip": path.stem, "level": level} | sizes)
    tables = [table("A frame", costs, COSTS), table("Bytes of a level", memory, MEMORY)]
    return {"tables": [*tables, table("Passes beside skinning", passes, PASSES)], "broken": []}


def openvat_bytes(clip: Any, folder: Path) -> int:
    openvat.write_clip(clip, folder, WriteOptions(half=True), lambda share: None)
    return sum(file.stat().st_size for file in folder.glob("*.png"))


def measured(data: bytes, count: int, beside_skinning: bool) -> dict[str, Any]:
    with chromium(WEBGPU_FLAGS) as browser, ThrottledServer({"plant.ath": data}) as line:
        page = browser.new_page(viewport={"width": 320, "height": 200})
        page.goto(f"{line.address}forest.html?file=plant.ath&count={count}&drawn=0")
        page.wait_for_function("() => window.athcodecForest?.forest")
        page.evaluate(f"window.measure = {(HERE / 'gpu.js').read_text()}; null")
        page.evaluate("measure.opened()")
        found = page.evaluate("(updates) => measure.measured(updates)", UPDATES)
        if not beside_skinning:
            return found | {"passes": []}
        shader = (HERE / "skinning.wgsl").read_text()
        return found | {"passes": page.evaluate("(shader) => measure.besideSkinning(shader)", shader)}
