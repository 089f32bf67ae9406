"""Fixtures that several test files share."""

from __future__ import annotations

import gc
import os
import re
import signal
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from blender import INSTALL, Blender, build_extension
from counting import CountedCore
from plants import awkward, plant
from programs import blender_python
from s3 import S3Server

import athcodec
from athcodec import encoding
from athcodec.decoding import core_file, segment_decoder
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search import start
from athcodec.motion.clip import MotionClip
from athcodec.sources import read_hdf5, sample_path

# The tests import bench, which is not installed; athcodec stays the installed one.
sys.path.append(str(Path(__file__).resolve().parent.parent))

WEBGPU_FLAGS = [
    "--no-sandbox",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-unsafe-swiftshader",
    # These present a canvas of WebGPU; without them Chromium's GPU process ends at the first picture
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--ignore-gpu-blocklist",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
]
SLOWEST = 240_000  # ms, of waiting for a page that draws in software


class Marks(set):
    """Marks as the names of a marker expression: True for those that are in the set."""

    __getitem__ = set.__contains__


def tiers(config) -> list[str]:
    """The tiers that pyproject.toml leaves out of the default, in their order."""
    return re.findall(r"\bnot (\w+)", " ".join(config.getini("addopts")))


def pytest_configure(config):
    """Leave out tests that belong to a later tier than those that the marker expression names. Let SIGINT interrupt
    tests and the programs that they start: a shell has it ignored by what it runs in the background.
    """
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    expression, names = config.option.markexpr, tiers(config)
    last = max((place for place, name in enumerate(names) if re.search(rf"\b{name}\b", expression)), default=None)
    if last is not None:
        config.option.markexpr = " and not ".join([f"({expression})", *names[last + 1 :]])


def pytest_ignore_collect(collection_path, config):
    """Do not import a module of which the marker expression selects no test: the libraries that it needs take seconds.

    `pytestmark` holds for all tests of a module; any other mark that the module names may stand on some of them.
    """
    if collection_path.suffix != ".py" or not config.option.markexpr:
        return None
    text = collection_path.read_text("utf-8")
    marks = [re.findall(r"mark\.(\w+)", line) for line in re.findall(r"^pytestmark = (.*)", text, re.M)]
    common = {name for line in marks for name in line}
    others = (set(re.findall(r"mark\.(\w+)", text)) & set(tiers(config))) - common
    possible = [Marks(common.union(some)) for count in range(len(others) + 1) for some in combinations(others, count)]
    return None if any(eval(config.option.markexpr, {}, marks) for marks in possible) else True


def pytest_collection_finish():
    """Spare the garbage collector to go through all modules and tests again and again: they stay to the end."""
    gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter):
    """Print the processor time of the run, which other work on the machine changes little."""
    seconds = sum(os.times()[:4])  # of this process, and of those that it waited for: workers, and what they started
    terminalreporter.write_line(f"processor time: {seconds:.0f} s, with workers and the programs that tests started")


@pytest.fixture(scope="module")
def browser():
    """Chromium, of the tests that are marked so."""
    from athcodec.viewer.picture import chromium

    with chromium() as found:
        yield found


@pytest.fixture
def opened(browser):
    """A function that opens an address and waits for a condition; the page must not have logged anything at the end."""
    pages, errors = [], []
    said = ["GL Driver Message"]  # Chromium's own, about reading pixels back

    def visit(address: str, until: str = "athcodecViewer.motion?.complete", quiet: str | None = None, **options):
        said.extend([quiet] if quiet else [])
        page = browser.new_page(**{"viewport": {"width": 1000, "height": 700}} | options)
        pages.append(page)
        page.set_default_timeout(SLOWEST)
        page.on(
            "console",
            lambda message: None if any(map(message.text.__contains__, said)) else errors.append(message.text),
        )
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(address)
        page.wait_for_function(f"() => {until}")
        if "athcodecViewer" in until:  # and all of the page
            page.wait_for_function("() => athcodecViewer.modules")
        return page

    yield visit
    for page in pages:
        page.close()
    assert errors == []


@pytest.fixture
def opened_file(opened):
    """A function that opens the viewer with the bytes of a file, which a server has until the test ends."""
    from bench.throttled_server import ThrottledServer

    with ThrottledServer({}) as line:

        def visit(data: bytes, *until: str, **options):
            line.files["tree.ath"] = data
            return opened(line.page("tree.ath"), *until, **options)

        yield visit


@pytest.fixture
def any_unit(monkeypatch):
    """Lets encoding store whatever unit and up axis a clip has, as encoders of other versions did."""
    for module in ("encoder", "assembly.assembly"):
        monkeypatch.setattr(f"athcodec.encoding.{module}.stated_scene", lambda metadata: {})


@pytest.fixture
def sample_file():
    return sample_path()


@pytest.fixture
def sample_clip():
    with read_hdf5(sample_path()) as clip:
        yield clip


@pytest.fixture
def forked():
    """Arguments of a small clip: a trunk of four vertices with a branch of two on its third, five frames."""
    rest = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 0], [1, 2, 0], [2, 2, 0]], np.float32)
    sway = np.linspace(0, 1, 5, dtype=np.float32)[:, None, None] * rest[:, 1:2] * np.float32(0.1)
    return {
        "positions": rest + sway * np.array([1, 0, 0], np.float32),
        "time": np.array([0.0, 0.1, 0.3, 0.35, 2.0]),
        "vertex_branch": np.array([0, 0, 0, 0, 1, 1]),
        "branch_parent": np.array([-1, 0]),
        "rest": rest,
        "edges": np.array([[0, 1], [1, 2], [2, 3], [2, 4], [4, 5]], np.uint16),
        "metadata": {"unit": "m", "up_axis": "y"},
    }


@pytest.fixture
def forked_clip(forked):
    return MotionClip(**forked)


@pytest.fixture(scope="session")
def scratch(tmp_path_factory):
    """A folder for files that tests overwrite at will."""
    return tmp_path_factory.mktemp("scratch")


@pytest.fixture(scope="session")
def sample_positions():
    """(120, N, 3) float32, the motion of the sample."""
    with read_hdf5(sample_path()) as clip:
        return clip.block(0, clip.frame_count)


@pytest.fixture(scope="session")
def sample_ath(tmp_path_factory):
    """The sample at the default bound in three segments, coded once for all tests."""
    path = tmp_path_factory.mktemp("sample") / "sample.ath"
    with read_hdf5(sample_path()) as clip:
        athcodec.encode(clip, path, segment_frames=40, ladder="none")
    return path


@pytest.fixture(scope="session")
def stepwise_ath(tmp_path_factory):
    """The sample in layers: its level 1 refines the rest pose."""
    path = tmp_path_factory.mktemp("stepwise") / "sample.ath"
    with read_hdf5(sample_path()) as clip:
        athcodec.encode(clip, path, rel_error=1e-4, effort="fast")
    return path


@pytest.fixture(scope="session")
def bushy_clip():
    """A random plant of 25 branches on two roots, numbered at random, that sways for 50 frames."""
    return awkward(seed=5, branches=25, longest=9, frames=50, roots=2, shape="stem", motion="sway", shuffled=True)


@pytest.fixture(scope="session")
def bushy_ath(bushy_clip, tmp_path_factory):
    """The bushy clip in four segments."""
    path = tmp_path_factory.mktemp("bushy") / "bushy.ath"
    return athcodec.encode(bushy_clip, path, rel_error=1e-3, segment_frames=16, ladder="none").path


@pytest.fixture(scope="session")
def layered_ath(bushy_clip, tmp_path_factory):
    """The bushy clip in four segments and three layers of precision, each with a rest pose of its own."""
    path = tmp_path_factory.mktemp("layered") / "layered.ath"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(start, "AT_ONCE_SHARE", 0.0)  # One pose for all layers would be smaller.
        return athcodec.encode(bushy_clip, path, rel_error=1e-4, ladder=(1e-2, 1e-3), segment_frames=16).path


def full_clip_of(seed: int):
    """A small clip that needs every kind of chunk: 20 frames of five branches with all sorts of static data.

    It sways along one line, so its stems have shapes that are worth learning, and not about its rest pose.
    """
    clip = plant(seed=seed, branches=5, longest=4, frames=20, rough=0.02)
    line = np.array([0.6, 0.48, 0.64])
    along = (clip.positions - clip.rest) @ line
    along = along + 0.03 * np.random.default_rng(seed).normal(size=along.shape[1])
    clip.positions = (clip.rest + along[..., None] * line).astype(np.float32)
    count = clip.vertex_count
    clip.faces = np.array([[0, 1, 2], [2, 1, 3]], np.uint16)
    clip.edges = np.array([[0, 1], [count - 1, 0]], np.int64)
    clip.attributes = {"radius": np.linspace(1, 2, count, dtype=np.float32), "species": np.array([b"oak", b"elm"])}
    clip.metadata = {"unit": "m", "up_axis": "y", "note": "wind from the west, wind from the west, wind from the west"}
    clip.time = clip.time + np.linspace(0, 1, 20) ** 3 * 0.01
    clip.check()
    return clip


@pytest.fixture(scope="session")
def full_clip():
    return full_clip_of(109)


@pytest.fixture(scope="session")
def other_full_clip():
    return full_clip_of(28)


@pytest.fixture(scope="session")
def medley_clips():
    """Motions of one plant by name: a loop of 20 frames, one of 37 at another rate with uneven steps, one of a single
    frame, and a loop that was blended."""
    clip = awkward(seed=7, branches=9, longest=8, frames=90, roots=1, shape="stem", motion="sway")

    def part(start, stop, time):
        metadata = {"unit": "m", "from": start}
        return clip.replace(positions=clip.block(start, stop), time=time, metadata=metadata)

    return {
        "calm": athcodec.looped(part(0, 20, np.arange(20) / 30)),
        "Böe": part(20, 57, np.sort(np.random.default_rng(2).random(37)) + np.arange(37) / 24),
        "still": part(57, 58, np.array([2.5])),
        "round": athcodec.looped(part(50, 90, np.arange(40) / 30), blend=8),
    }


@pytest.fixture(scope="session")
def medley_ath(medley_clips, tmp_path_factory):
    """All of them in one file, in segments of up to 16 frames."""
    path = tmp_path_factory.mktemp("medley") / "medley.ath"
    tam = athcodec.Thresholds(0, 0, 0, 0)  # with modes, whatever is smaller
    athcodec.encode(athcodec.join(medley_clips), path, rel_error=1e-4, segment_frames=16, tam=tam, ladder="none")
    return path


@pytest.fixture(scope="session")
def full_ath(full_clip, tmp_path_factory):
    """The full clip in two segments, with branches that turn what they carry: others need fewer kinds of chunks."""
    path = tmp_path_factory.mktemp("full") / "full.ath"
    tam = athcodec.Thresholds(0, 0, 0, 0)  # with modes, whatever is smaller
    options = {"segment_frames": 16, "tam": tam, "ladder": "none", "rest_error": "bound"}
    plan = encoding.draft(full_clip, rel_error=1e-4, without=frozenset({Feature.STILL}), **options)
    return encoding.write(full_clip, plan, encoding.code_segments(full_clip, plan, [0, 1]), path).path


@pytest.fixture(scope="session")
def predicted_ath(full_clip, tmp_path_factory):
    """The full clip in two segments of predicted motion."""
    path = tmp_path_factory.mktemp("predicted") / "full.ath"
    options = {"segment_frames": 16, "ladder": "none", "rest_error": "bound"}
    return athcodec.encode(full_clip, path, rel_error=1e-4, **options).path


@pytest.fixture(scope="session")
def built_once(tmp_path_factory):
    """A folder that all workers of a run share: `install_once` builds in it what takes long to compile."""
    mine = tmp_path_factory.getbasetemp()
    return (mine.parent if "PYTEST_XDIST_WORKER" in os.environ else mine) / "built-once"


@pytest.fixture(scope="session")
def _counted_core(built_once):
    return CountedCore(built_once / "counted")


@pytest.fixture
def work_of(_counted_core, monkeypatch):
    """A function that counts the work of an action; until the test ends, Python decodes with a core that counts, in a
    single thread: how several share the work depends on what else the machine does."""
    monkeypatch.setattr(core_file, "lib", _counted_core)
    monkeypatch.setattr(segment_decoder, "default_jobs", lambda: 1)
    return _counted_core.work_of


@pytest.fixture(scope="session")
def s3_server(tmp_path_factory):
    with S3Server(tmp_path_factory.mktemp("s3") / "log") as server:
        yield server


@pytest.fixture
def s3(s3_server, monkeypatch):
    """A server that speaks S3, which s3:// URLs lead to."""
    for name, value in s3_server.environment.items():
        monkeypatch.setenv(name, value)
    return s3_server


@pytest.fixture(scope="session")
def blender(tmp_path_factory):
    """A Blender of its own, for tests marked `programs`."""
    return Blender(Path(blender_python()), tmp_path_factory.mktemp("blender"))


@pytest.fixture(scope="session")
def extended_blender(tmp_path_factory):
    """A Blender that has athcodec's extension, installed as a user installs it."""
    folder = tmp_path_factory.mktemp("extended")
    blender = Blender(Path(blender_python()), folder)
    blender.run(INSTALL, zip=build_extension(folder))
    blender.has_extension = True
    return blender
