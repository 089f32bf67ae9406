"""The viewer in Chromium: time to first motion on a slow connection, long tasks, size of the bundles, forests.

The page is loaded and empty when a file is requested, as in a viewer that opens several files; the same is assumed for
the other formats. These count as shown when their last byte has arrived; parsing is not included. Rendering is in
software: only ratios of frame times are meaningful for a graphics processor.
"""

from __future__ import annotations

import argparse
import gzip
import json
import statistics
import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.options import LADDERS
from bench.browser import chromium
from bench.clips import add_clips, add_rel_error, encoded
from bench.tables import table
from bench.throttled_server import WEB, ThrottledServer

MEGABIT = 125_000
SLOW = 10_000  # bytes a second
ROUNDS = 7
MOST_SECONDS, MOST_SHARE, LONGEST_TASK = 0.5, 0.1, 50

OBSERVE = """new Promise((found) => {
  globalThis.longTasks = [];
  new PerformanceObserver((list) => longTasks.push(...list.getEntries().map(({ duration }) => duration)))
    .observe({ type: "longtask" });
  found();
})"""
FETCH = """async (name) => {
  const start = performance.now(), answer = await fetch(name);
  const size = (await answer.arrayBuffer()).byteLength;
  return { seconds: (performance.now() - start) / 1000, size };
}"""
MODES = """async ([name, mode, levels, frames]) => {
  const { ATHLoader } = await import("athcodec-three"), loader = new ATHLoader().setMode(mode);
  const ath = await loader.loadAsync(name), { stage } = athcodecViewer, gl = stage.renderer.getContext();
  const { motion } = ath, scene = stage.scene([ath.object]), pixel = new Uint8Array(4), found = [];
  while (!motion.complete) await new Promise((done) => setTimeout(done, 20));
  for (let level = 0; level < levels; level++) {
    const ms = [], worker = [];
    for (let i = 0; i < frames; i++) {
      const start = performance.now();
      await motion.show(i / 30, level);
      stage.renderer.render(scene, stage.camera);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      ms.push(performance.now() - start);
      worker.push(motion.milliseconds);
    }
    const median = (values) => values.sort((a, b) => a - b)[frames >> 1];
    const texture = motion.uniforms.athData.value, bytes = mode === "matrices" ? texture.image.data.byteLength
      : 12 * motion.info.vertexCount;
    found.push({ level, mode, ms: median(ms), worker: median(worker), bytes });
  }
  ath.dispose();
  loader.dispose();
  return found;
}"""
COMPARE = """([left, right, seconds]) => {
  const press = (group, value) => document.querySelector(`#${group} [data-value="${value}"]`).click();
  athcodecViewer.setPlaying(false);
  press("compare", "levels");
  press("colour", "distance");
  document.getElementById("compare-level").value = left;
  athcodecViewer.setLevel(String(right));
  athcodecViewer.seek(seconds);
}"""

NOTE_START = """
Seconds from the request of the file until a picture is drawn, until a different one is drawn (motion), and until the
file is complete, medians. Bytes: received at first motion, on a slow connection. Raw and GLB: until their last byte has
arrived.
"""
NOTE_TASKS = """
The longest task of the page's main thread in each round, while a file streams in until all of it is shown: by the
clock, as the long-task observer has it (0: none over 50 ms), and in processor time of that thread, to which other
programs on the machine add nothing. Over 50 ms: tasks of all rounds, by the clock.
"""
NOTE_FOREST = """
Milliseconds from choosing levels until the picture is drawn, in software, the fastest of seven, alternating;
vertices are those drawn.
"""
NOTE_MODES = """
Milliseconds from requesting a frame from the worker until it is drawn, medians; bytes: sent to the graphics processor.
Matrices: by a texture, in the vertex shader (the default); positions: by a new position attribute.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    parser.add_argument("--line", type=float, default=10.0, metavar="MBIT", help="megabits a second (default 10)")
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="how often a file is opened (default 5)")
    parser.add_argument("--instances", type=int, nargs="+", default=[10, 30, 100, 300, 1000], metavar="N")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE.png", help="measure nothing: write a picture of the page with two levels"
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    if args.picture:
        return _picture(args.clips[0], args.rel_error, args.picture)
    starts, tasks, forests, modes, broken = [], [], [], [], []
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        for path in args.clips:
            files = _files(path, Path(folder), args.rel_error)
            found = _starts(browser, files, args)
            starts += [{"clip": path.stem} | row for row in found["starts"]]
            tasks.append({"clip": path.stem} | found["tasks"])
            broken += _missed_targets(path.stem, found)
            forests += [{"clip": path.stem} | row for row in _forests(browser, files["tree.ath"], args.instances)]
            modes += [{"clip": path.stem} | row for row in _modes(browser, files["tree.ath"])]
    scripts = {path.name: path.read_bytes() for path in sorted(WEB.glob("*.js"))}
    sizes = [{"file": name, "bytes": len(code), "gzip": len(gzip.compress(code))} for name, code in scripts.items()]
    return {
        "tables": [
            table(f"First motion at {args.line:g} Mbit/s", starts, NOTE_START),
            table("Tasks of the main thread, ms", tasks, NOTE_TASKS),
            table("Bundles, in bytes", sizes),
            table("Forest", forests, NOTE_FOREST),
            table("Ways of moving the vertices", modes, NOTE_MODES),
        ],
        "broken": broken,
    }


def _picture(clip: Path, rel_error: float, out: Path) -> dict[str, Any]:
    """Two levels of a file with layers of precision side by side, coloured by their distance from the deepest one."""
    with encoded(clip, rel_error, ladder=LADDERS["decades"]) as result, chromium() as browser:
        data, right = result.summary.path.read_bytes(), result.decoder.file.deepest - 1
        with ThrottledServer({clip.with_suffix(".ath").name: data}) as server:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(server.page(clip.with_suffix(".ath").name))
            page.wait_for_function(f"() => {COMPLETE}")
            page.evaluate(COMPARE, [right - 1, right, result.decoder.time[-1] / 2])
            page.wait_for_function(f"() => athcodecViewer.motion.level === {right}")
            page.wait_for_timeout(3000)
            page.screenshot(path=out)
    return {"tables": [table("picture", [{"clip": clip.stem, "file": out.name}])], "broken": []}


def _files(path: Path, folder: Path, rel_error: float) -> dict[str, bytes]:
    """The clip as .ath, as raw float32 and as a GLB with morph targets."""
    with athcodec.read_hdf5(path) as clip:
        athcodec.encode(clip, folder / "tree.ath", rel_error=rel_error)
        positions = clip.block(0, clip.frame_count).astype("<f4")
        return {
            "tree.ath": (folder / "tree.ath").read_bytes(),
            "tree.raw": positions.tobytes(),
            "tree.glb": _glb(positions, clip.time),
        }


def _glb(positions: np.ndarray, time: np.ndarray) -> bytes:
    """Points with a morph target per frame, and the animation that shows one after the other."""
    frames, count = positions.shape[:2]
    arrays = [positions[0], *(positions - positions[0]), time.astype("<f4"), np.eye(frames, dtype="<f4")]
    views, accessors, body = [], [], b""
    for array in arrays:
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": array.nbytes})
        accessor = {"bufferView": len(views) - 1, "componentType": 5126, "type": "SCALAR", "count": array.size}
        if array.ndim == 2 and array.shape[1] == 3:
            accessor |= {"type": "VEC3", "count": len(array)}
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        accessors.append(accessor)
        body += array.tobytes()
    sampler = {"input": frames + 1, "output": frames + 2}
    targets = [{"POSITION": 1 + frame} for frame in range(frames)]
    head = json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0, "targets": targets}]}],
            "animations": [
                {"samplers": [sampler], "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}
            ],
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{"byteLength": len(body)}],
        }
    ).encode()
    head += b" " * (-len(head) % 4)
    parts = struct.pack("<II", len(head), 0x4E4F534A) + head + struct.pack("<II", len(body), 0x004E4942) + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(parts)) + parts


def _page(browser, server: ThrottledServer, name: str | None = None):
    page = browser.new_page(viewport={"width": 960, "height": 600})
    page.goto(server.page(name))
    page.wait_for_function("() => globalThis.athcodecViewer")
    page.wait_for_timeout(1000)
    return page


def _starts(browser, files: dict[str, bytes], args: argparse.Namespace) -> dict[str, Any]:
    with ThrottledServer(files, rate=args.line * MEGABIT) as server:
        rounds = [_open(browser, server) for _ in range(args.rounds)]
        page = _page(browser, server)
        others = {name: page.evaluate(FETCH, name) for name in ("tree.raw", "tree.glb")}
        page.close()
    with ThrottledServer(files, rate=SLOW) as server:
        first = _open(browser, server, until="athcodecViewer.counters.firstMotion")["motion"]["bytes"]
    motion = [opening["motion"]["ms"] / 1000 for opening in rounds]
    ath = {
        "file": ".ath",
        "size": len(files["tree.ath"]),
        "picture": statistics.median(opening["picture"]["ms"] for opening in rounds) / 1000,
        "motion": statistics.median(motion),
        "slowest": max(motion),
        "bytes": first,
        "share": first / len(files["tree.ath"]),
        "all": statistics.median(opening["all"] for opening in rounds),
    }
    rows = [ath] + [{"file": name, "size": found["size"], "motion": found["seconds"]} for name, found in others.items()]
    return {
        "starts": rows,
        "tasks": {
            "rounds": args.rounds,
            "by the clock": [max(opening["tasks"], default=0) for opening in rounds],
            "processor": [opening["processor"] for opening in rounds],
            "over 50 ms": sum(ms > LONGEST_TASK for opening in rounds for ms in opening["tasks"]),
        },
    }


COMPLETE = "athcodecViewer.motion?.complete && athcodecViewer.counters.firstMotion"


def _open(browser, server: ThrottledServer, until: str = COMPLETE) -> dict[str, Any]:
    page = _page(browser, server)
    page.evaluate(OBSERVE)
    browser.start_tracing(page=page, categories=["toplevel"])
    page.evaluate("athcodecViewer.open('/tree.ath', 'tree.ath')")
    page.wait_for_function(f"() => {until}", timeout=120_000)
    done = page.evaluate("(performance.now() - athcodecViewer.counters.started) / 1000")
    page.wait_for_timeout(500)
    counters = page.evaluate("athcodecViewer.counters")
    tasks = page.evaluate("longTasks")
    processor = _longest_task(json.loads(browser.stop_tracing())["traceEvents"])
    page.close()
    return {
        "picture": counters["firstPicture"],
        "motion": counters["firstMotion"],
        "all": done,
        "tasks": tasks,
        "processor": processor,
    }


def _longest_task(events: list[dict[str, Any]]) -> float:
    """Milliseconds of processor time of the longest task of a renderer's main thread."""
    threads = {
        (event["pid"], event["tid"])
        for event in events
        if event["name"] == "thread_name" and event["args"]["name"] == "CrRendererMain"
    }
    return max(
        event.get("tdur", 0) / 1000
        for event in events
        if event.get("ph") == "X" and (event["pid"], event["tid"]) in threads
    )


def _missed_targets(clip: str, found: dict[str, Any]) -> list[str]:
    ath, *others = found["starts"]
    broken = []
    if ath["motion"] > MOST_SECONDS:
        broken.append(f"{clip}: first motion: got {ath['motion']:.2f} s, expected at most {MOST_SECONDS} s")
    for other in others:
        if ath["motion"] > MOST_SHARE * other["motion"]:
            broken.append(
                f"{clip}: first motion: got {ath['motion']:.2f} s, expected at most a tenth of "
                f"{other['file']}'s {other['motion']:.2f} s"
            )
    longest = statistics.median(found["tasks"]["by the clock"])
    if longest > LONGEST_TASK:
        broken.append(
            f"{clip}: main thread: got tasks of {longest:.0f} ms by the clock (median of the rounds' "
            f"longest), expected none over {LONGEST_TASK} ms"
        )
    return broken


def _forests(browser, data: bytes, counts: list[int]) -> list[dict[str, Any]]:
    rows = []
    with ThrottledServer({"tree.ath": data}) as server:
        page = _page(browser, server, "tree.ath")
        page.wait_for_function("() => athcodecViewer.motion?.complete")
        page.evaluate("athcodecViewer.setPlaying(false)")
        page.evaluate("athcodecViewer.forestOf(10)")
        page.wait_for_function("() => athcodecViewer.state.forest.baked.length === athcodecViewer.motion.levelCount")
        for count in counts:
            page.evaluate(f"athcodecViewer.forestOf({count})")
            both: dict[bool, list[dict[str, Any]]] = {True: [], False: []}
            for _ in range(ROUNDS):  # alternating, so that other load on the machine affects both
                for detail, timings in both.items():
                    page.evaluate(f"athcodecViewer.state.forest.levelOfDetail = {json.dumps(detail)}")
                    timings.append(page.evaluate("athcodecViewer.timeForest(1)"))
            on, off = (min(timings, key=lambda timing: timing["ms"]) for timings in both.values())
            rows.append(
                {
                    "instances": count,
                    "in view": count - on["unseen"],
                    "by level": on["counts"],
                    "detail on": on["ms"],
                    "detail off": off["ms"],
                    "off / on": off["ms"] / on["ms"],
                    "vertices on": on["vertices"],
                    "vertices off": off["vertices"],
                }
            )
        page.close()
    return rows


def _modes(browser, data: bytes) -> list[dict[str, Any]]:
    with ThrottledServer({"tree.ath": data}) as server:
        page = _page(browser, server, "tree.ath")
        page.wait_for_function("() => athcodecViewer.motion?.complete")
        page.evaluate("athcodecViewer.setPlaying(false)")
        levels = page.evaluate("athcodecViewer.motion.levelCount")
        rows = [
            row for mode in ("matrices", "positions") for row in page.evaluate(MODES, ["/tree.ath", mode, levels, 21])
        ]
        page.close()
    return sorted(rows, key=lambda row: row["level"])
