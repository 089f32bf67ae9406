"""The viewer in Chromium: time to first motion on a slow connection and long tasks.

The page is loaded and empty when a file is requested, as in a viewer that opens several files; the same is assumed for
the other formats. These count as shown when their last byte has arrived; parsing is not included.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from pathlib import Path
from typing import Any

import athcodec
from athcodec.options import LADDERS
from bench.browser import chromium
from bench.clips import add_clips, add_number, add_rel_error, encoded, read
from bench.tables import table
from bench.throttled_server import ThrottledServer

MEGABIT = 125_000
SLOW = 10_000  # bytes a second
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


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_number(parser, "--line", 10.0, "megabits a second", "MBIT")
    add_number(parser, "--rounds", 5, "how often a file is opened")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE.png", help="measure nothing: write a picture of the page with two levels"
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    if args.picture:
        return _picture(args.clips[0], args.rel_error, args.picture)
    starts, tasks, broken = [], [], []
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        for path in args.clips:
            files = _files(path, Path(folder), args.rel_error)
            found = _starts(browser, files, args)
            starts += [{"clip": path.stem} | row for row in found["starts"]]
            tasks.append({"clip": path.stem} | found["tasks"])
            broken += _missed_targets(path.stem, found)
    return {
        "tables": [
            table(f"First motion at {args.line:g} Mbit/s", starts, NOTE_START),
            table("Tasks of the main thread, ms", tasks, NOTE_TASKS),
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
    with read(path) as clip:
        athcodec.encode(clip, folder / "tree.ath", rel_error=rel_error)
        athcodec.write(clip.replace(attributes={}), folder / "tree.glb", animation="morphs")
        return {
            "tree.ath": (folder / "tree.ath").read_bytes(),
            "tree.raw": clip.block(0, clip.frame_count).astype("<f4").tobytes(),
            "tree.glb": (folder / "tree.glb").read_bytes(),
        }


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
