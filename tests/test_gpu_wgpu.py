"""The shaders through a second compiler: wgpu, which Firefox has, runs what Chromium runs in test_gpu.py and shows what
the decoder does. Without a graphics card it draws with the software of Chromium."""

from __future__ import annotations

import ctypes
import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from plants import distance
from test_gpu import Checked, blended, files, shows_of  # noqa: F401

from athcodec.gpu import SHADERS
from athcodec.gpu.evaluate import LEVEL, SEGMENT, head
from athcodec.viewer.picture import browser_path

pytestmark = pytest.mark.browser

KERNELS = {  # Texts of each pipeline, its entry point, and the buffers that it is given, by binding.
    "time": ("blocks time", "main", [None, "segments", "places", "amplitudes"]),
    "hierarchy": (
        *("blocks hierarchy", "main"),
        ["level", "segments", "places", "amplitudes", "positions", "matrices", "modes", "bodies", "number"],
    ),
    "bodies": ("blocks finish", "bodies", ["level", "segments", "places", "positions", "matrices"]),
    "corrections": ("blocks finish", "corrections", [None, "segments", "places", "positions", None, "number"]),
    "baked": ("blocks finish", "baked", ["level", "segments", "places", "positions"]),
    "vertices": ("vertices", "main", ["level", "corners", "shows", "positions", "matrices", "vertices"]),
}
PLACE_WORDS, SOURCE_WORDS, SLOTS = 8, 4, 2


@cache
def vulkan_of_chromium() -> None:
    """Lets wgpu find the Vulkan in software that Chromium comes with, where the machine has no other."""
    program = Path(browser_path() or "chromium").resolve()
    for folder in (program.parent, Path("/usr/lib/chromium")):
        driver = folder / "vk_swiftshader_icd.json"
        if driver.exists() and "VK_ICD_FILENAMES" not in os.environ:
            ctypes.CDLL(str(folder / "libvulkan.so.1"), ctypes.RTLD_GLOBAL)
            os.environ["VK_ICD_FILENAMES"] = str(driver)


class Card:
    """Runs all three passes, as passes.mjs does, for one plant at a time."""

    def __init__(self):
        vulkan_of_chromium()
        import wgpu

        self.wgpu = wgpu
        self.device = wgpu.gpu.request_adapter_sync().request_device_sync()
        self.kernels = {}
        for name, (texts, entry, _) in KERNELS.items():
            code = "\n".join((SHADERS / f"{text}.wgsl").read_text("utf-8") for text in texts.split())
            module = self.device.create_shader_module(code=code)
            compute = {"module": module, "entry_point": entry}
            self.kernels[name] = self.device.create_compute_pipeline(layout="auto", compute=compute)

    def buffer(self, words: np.ndarray | int, usage: str = "STORAGE | COPY_SRC | COPY_DST"):
        data = np.zeros(max(4, words), np.uint32) if isinstance(words, int) else words
        flags = 0
        for name in usage.split(" | "):
            flags |= self.wgpu.BufferUsage[name]
        return self.device.create_buffer_with_data(data=data.tobytes(), usage=flags)

    def shown(self, level: np.ndarray, segments: list[np.ndarray], show, weight: float) -> np.ndarray:
        """(V, 3) float32: vertices between two frames, each [segment, frame]."""
        top, starts = head(level, LEVEL), np.cumsum([0, *map(len, segments)])
        heads = [head(words, SEGMENT) for words in segments]
        rows, corrected = (max(each[name] for each in heads) for name in ("row_count", "corrected_count"))
        positions, matrices = 3 * top["position_count"], 12 * top["matrix_count"]
        bodies, vertices = 12 * top["body_count"], 9 * top["vertex_count"]
        places = np.zeros((PLACE_WORDS + SOURCE_WORDS) * SLOTS, np.uint32)
        for slot, (segment, frame) in enumerate(show):
            at = PLACE_WORDS * SLOTS + SOURCE_WORDS * slot
            words = [at, 1, slot * positions, slot * matrices, slot * positions, slot * bodies]
            places[PLACE_WORDS * slot :][:6] = words
            places[PLACE_WORDS * slot + 6] = np.float32(1).view(np.uint32)  # strength
            places[at : at + 3] = starts[segment], frame, 3 * rows * slot
            places[at + 3] = np.float32(1).view(np.uint32)
        shows = np.zeros(12, np.uint32)
        shows[:8] = [0, positions, 0, positions, 0, matrices, 0, matrices]
        shows[8:10] = np.float32([weight, weight]).view(np.uint32)
        sizes = {"amplitudes": 3 * rows * SLOTS, "modes": SLOTS * positions, "bodies": SLOTS * bodies, "corners": 4}
        sizes |= {"positions": SLOTS * positions, "matrices": SLOTS * matrices, "vertices": vertices}
        buffers = {name: self.buffer(int(words)) for name, words in sizes.items()}
        buffers |= {"level": self.buffer(level), "segments": self.buffer(np.concatenate(segments))}
        buffers |= {"places": self.buffer(places), "shows": self.buffer(shows)}
        encoder = self.device.create_command_encoder()
        work = encoder.begin_compute_pass()

        def run(name: str, count: int, number: int = 0, across: int = SLOTS) -> None:
            if count == 0:
                return
            own = buffers | {"number": self.buffer(np.uint32([number, 0, 0, 0]), "UNIFORM")}
            entries = [
                {"binding": binding, "resource": {"buffer": own[key]}}
                for binding, key in enumerate(KERNELS[name][2])
                if key
            ]
            pipeline = self.kernels[name]
            group = self.device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
            work.set_pipeline(pipeline)
            work.set_bind_group(0, group)
            work.dispatch_workgroups(int(count), across, 1)

        groups = lambda count: -(-int(count) // 64)  # noqa: E731
        if any(each["baked"] for each in heads):
            run("baked", groups(positions))
        else:
            run("time", groups(rows))
            depths = level[top["depths"] :][: top["depth_count"] + 1]
            for depth, count in enumerate(np.diff(depths.astype(int))):
                run("hierarchy", count, depth)
            run("bodies", top["body_count"])
            run("corrections", groups(corrected))
        run("vertices", groups(top["vertex_count"]), across=1)
        work.end()
        self.device.queue.submit([encoder.finish()])
        data = self.device.queue.read_buffer(buffers["vertices"], 0, 4 * vertices)
        return np.frombuffer(data, np.float32).reshape(-1, 9)[:, :3]


@pytest.fixture(scope="module")
def card():
    return Card()


@pytest.mark.parametrize("name", ["sample", "leaves", "several clips", "chain", "growth"])
def test_the_shaders_show_what_the_decoder_does_through_another_compiler(files, card, name):  # noqa: F811
    file: Checked = files(name)
    tolerance = file.tolerance()
    for level in range(file.info.level_count):
        segments = [file.gpu.segment(segment, level) for segment in range(file.info.segment_count)]
        for show in shows_of(file, 2):
            frames, weight = show
            asked = [(file.segment_of(frame), file.gpu.coded_frame(frame)) for frame in frames]
            got = card.shown(file.gpu.level(level), segments, asked, weight)
            assert distance(got, blended(file, level, show)) <= tolerance, (level, show)


VIEW = np.dtype(
    [("planes", "f4", (6, 4)), ("eye", "f4", 3), ("pixel", "f4"), ("count", "u4"), ("shapes", "u4"), ("near", "f4")]
    + [("room", "u4"), ("offset", "f4", 3), ("beyond", "f4"), ("rest", "f4"), ("headed", "u4"), ("none", "u4", 2)]
)


def chosen(
    card, vertices: np.ndarray, instances: np.ndarray, tolerances: list[float], **view: object
) -> list[set[int]]:
    """The instances that choose.wgsl appends to the list of each shape."""
    module = card.device.create_shader_module(code=(SHADERS / "choose.wgsl").read_text("utf-8"))
    count, shapes = len(instances), len(tolerances)
    words = np.zeros(1, VIEW)
    for name, value in {"count": count, "shapes": shapes, "room": count, **view}.items():
        words[0][name] = value
    shape = np.zeros(shapes, np.dtype([("tolerance", "f4"), ("list", "u4")]))
    shape["tolerance"], shape["list"] = tolerances, np.arange(shapes)
    buffers = [instances, None, shape, 5 * shapes, shapes * count, 1, vertices]
    made = [
        card.buffer(each if isinstance(each, int) else each.view(np.uint32)) for each in buffers if each is not None
    ]
    made.insert(1, card.buffer(words.view(np.uint32), "UNIFORM"))
    encoder = card.device.create_command_encoder()
    work = encoder.begin_compute_pass()
    for entry, bindings, groups in (("measure", [1, 5, 6], 3), ("main", [0, 1, 2, 3, 4, 5], -(-count // 64))):
        compute = {"module": module, "entry_point": entry}
        pipeline = card.device.create_compute_pipeline(layout="auto", compute=compute)
        entries = [{"binding": each, "resource": {"buffer": made[each]}} for each in bindings]
        layout = pipeline.get_bind_group_layout(0)
        work.set_pipeline(pipeline)
        work.set_bind_group(0, card.device.create_bind_group(layout=layout, entries=entries))
        work.dispatch_workgroups(groups, 1, 1)
    work.end()
    card.device.queue.submit([encoder.finish()])
    draws, lists = (np.frombuffer(card.device.queue.read_buffer(made[k]), np.uint32) for k in (3, 4))
    return [set(lists[count * k :][: draws[5 * k + 1]].tolist()) for k in range(shapes)]


@pytest.mark.parametrize("headed", [0, 1])
def test_no_instance_that_is_in_view_is_left_out(card, headed):
    """Each moves along the lines from its rest pose, which is about its place, far beyond it; in view is x > 10."""
    rng = np.random.default_rng(3)
    rest, away = rng.normal(size=(700, 3)), rng.normal(size=(700, 3)) * [4, 1, 1]
    rest /= np.maximum(np.linalg.norm(rest, axis=1, keepdims=True), 1)
    vertices = np.zeros((700, 9), np.float32)
    vertices[:, :3] = rest + away - [5, 0, 0]  # as they are relative to an origin
    instances = np.zeros((500, 12), np.float32)
    instances[:, :3] = rng.uniform(-60, 20, (500, 3)) * [1, 0, 0]
    instances[:, 3], instances[:, 8] = rng.uniform(0.5, 2, 500), rng.uniform(-2, 3, 500)  # size, amplitude
    angle = rng.uniform(0, 2 * np.pi, 500) if headed else np.zeros(500)
    turned = np.stack([away[None, :, 0] * np.cos(angle)[:, None] - away[None, :, 2] * np.sin(angle)[:, None]])[0]
    x = instances[:, :1] + instances[:, 3:4] * (rest[None, :, 0] + instances[:, 8:9] * turned)
    planes = np.zeros((6, 4))
    planes[:, 0], planes[:, 3] = 1, -10
    view = {"planes": planes, "eye": [10, 0, 0], "pixel": 0.1, "rest": 1.0, "offset": [5, 0, 0], "headed": headed}
    lists = chosen(card, vertices, instances, [0.5, 2.0], **view)
    drawn = lists[0] | lists[1]
    assert not lists[0] & lists[1] and set(np.flatnonzero((x > 10).any(axis=1)).tolist()) <= drawn
    assert len(drawn) < 500 and lists[0] and lists[1]
    far = np.flatnonzero(np.abs(10 - instances[:, 0]) > 20 * instances[:, 3] + 1e-3).tolist()
    assert lists[1] == drawn & set(far), "the coarsest whose error is at most a tenth of the distance"
