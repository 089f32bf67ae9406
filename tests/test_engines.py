"""Engines play .ath files from the examples of docs/engines.md: raylib in C, and C# in Mono."""

from __future__ import annotations

import os
import re
import subprocess
import sysconfig
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from files import Parts
from fuzz.targets import CORE
from PIL import Image
from programs import printed, raylib_library, raylib_version

import athcodec
from athcodec.decoding import container as ct
from bench import engines as measured

pytestmark = pytest.mark.programs

TREE = Path(athcodec.__file__).parent / "sample" / "leafed_tree.ath"
HEADLESS = {**os.environ, "SDL_VIDEODRIVER": "dummy"}
# Checked, and quick to build, unless times are measured.
BUILD, FLAGS = ("Release", "") if measured.is_recording() else ("Debug", "-fsanitize=undefined -O1")

# raylib's wheel is a module of Python with all of raylib in it, so what it needs of Python is linked, too.
RAYLIB = """
add_library(raylib SHARED IMPORTED)
set_target_properties(raylib PROPERTIES
  IMPORTED_LOCATION "{library}"
  INTERFACE_INCLUDE_DIRECTORIES "${{CMAKE_CURRENT_LIST_DIR}}"
  INTERFACE_LINK_LIBRARIES "{python}")
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    """The decoder, installed; unoptimised, which has the same bits."""
    folder = tmp_path_factory.mktemp("install")
    printed("cmake", "-S", CORE, "-B", folder / "build", f"-DCMAKE_BUILD_TYPE={BUILD}", "-DATH_BUILD_EXAMPLES=OFF")
    printed("cmake", "--build", folder / "build")
    printed("cmake", "--install", folder / "build", "--prefix", folder / "prefix")
    return folder / "prefix"


# ---- raylib ----


@pytest.fixture(scope="module")
def raylib(tmp_path_factory) -> Path:
    """A folder in which CMake finds raylib."""
    folder, library = tmp_path_factory.mktemp("raylib"), raylib_library()
    for name in ("raylib", "rlgl"):  # The wheel's headers lack what they include.
        text = (library.parent / f"{name}.h.modified").read_text("utf-8")
        (folder / f"{name}.h").write_text(f"#include <stdarg.h>\n#include <stdbool.h>\n{text}", "utf-8")
    python = Path(sysconfig.get_config_var("LIBDIR"), sysconfig.get_config_var("LDLIBRARY"))
    (folder / "raylib-config.cmake").write_text(RAYLIB.format(library=library, python=python))
    return folder


@pytest.fixture(scope="module")
def player(installed, raylib, tmp_path_factory) -> Path:
    """The example, built by its CMakeLists.txt as a copy of it would be."""
    build = tmp_path_factory.mktemp("player")
    found = f"-DCMAKE_PREFIX_PATH={installed};{raylib}", f"-Draylib_DIR={raylib}"
    printed(
        "cmake", "-S", CORE / "examples", "-B", build, *found, f"-DCMAKE_BUILD_TYPE={BUILD}", f"-DCMAKE_C_FLAGS={FLAGS}"
    )
    printed("cmake", "--build", build)
    return build / "raylib_player"


def played(player: Path, *words: object) -> tuple[int, int, int, int]:
    """Level, number of levels, bytes fetched, and bytes of the file."""
    said = printed(player, *words, env=HEADLESS)
    return tuple(map(int, re.search(r"level (\d+) of (\d+), (\d+) of (\d+) bytes", said).groups()))


def test_raylib_draws_the_tree_at_the_level_of_its_distance_from_the_ranges_that_it_needs(player, tmp_path):
    near, far = tmp_path / "near.png", tmp_path / "far.png"
    level, levels, fetched, size = played(player, TREE, 1.6, 10, near)
    assert size == TREE.stat().st_size and level > 0
    coarse, _, less, _ = played(player, TREE, 60, 10, far)
    assert coarse < level and less < fetched <= size
    green, small = (drawn(path) for path in (near, far))
    rows = green.sum(axis=1)
    assert green.mean() > 0.05 and rows[:360].sum() > rows[360:].sum(), "the crown is above"
    trunk = np.flatnonzero(green[np.flatnonzero(rows)[-1] - 10])
    assert len(trunk) < 60 and abs(trunk.mean() - 480) < 60, "the trunk stands in the middle"
    assert 0 < small.sum() < green.sum() / 100, "a distant tree is small"
    assert len(np.unique(pixels(near)[green], axis=0)) >= 2, "texture coordinates show both colours of the texture"
    if measured.is_recording():
        times = [(seconds(player, away, 70, far) - seconds(player, away, 10, far)) / 60 for away in (1.6, 60)]
        measured.record("raylib", raylib_version(), *(1000 * time for time in times))


def seconds(player: Path, distance: float, frames: int, picture: Path) -> float:
    start = perf_counter()
    played(player, TREE, distance, frames, picture)
    return perf_counter() - start


def pixels(picture: Path) -> np.ndarray:
    """As the window shows them: this build of raylib reads them back from the last row on, and blue first."""
    return np.asarray(Image.open(picture).convert("RGB")).astype(int)[::-1, :, ::-1]


def drawn(picture: Path) -> np.ndarray:
    """Where there is something else than the background."""
    return (abs(pixels(picture) - [225, 235, 240]) > 8).any(axis=2)


@pytest.mark.parametrize("cut", [0, 10, 1000, 40_000])
def test_a_file_that_lacks_bytes_ends_the_example_or_plays_at_a_coarser_level(cut, player, tmp_path):
    (tmp_path / "cut.ath").write_bytes(TREE.read_bytes()[:cut])
    words = [player, tmp_path / "cut.ath", 1.2, 2, tmp_path / "x.png"]
    done = subprocess.run([str(word) for word in words], env=HEADLESS, capture_output=True, text=True)
    assert done.returncode == (0 if cut == 40_000 else 1), done.stdout + done.stderr
    assert "runtime error" not in done.stderr
    assert cut == 40_000 or "FATAL" in done.stdout


def test_arrays_of_another_size_are_not_taken_for_texture_coordinates(player, tmp_path):
    parts = Parts.of(athcodec.encode(small_mesh(), attributes="all", effort="fast", rel_error=1e-2))
    name, array = ct.parse_array(parts.payload(ct.ATTRIBUTE), "uv", ct.Limits())
    assert name == "uv" and len(array) == 10
    (tmp_path / "short.ath").write_bytes(parts.file())
    level, levels, *_ = played(player, tmp_path / "short.ath", 1.2, 2, tmp_path / "x.png")
    assert 0 <= level < levels


def small_mesh() -> athcodec.MotionClip:
    """A strip of squares that sways, with an array "uv" that is too short."""
    y, x = np.divmod(np.arange(12), 2)
    rest = np.column_stack([x, y, 0 * x]).astype(np.float32)
    sway = np.sin(np.arange(6))[:, None, None] * rest[:, 1:2] * [0.1, 0, 0.05]
    faces = np.arange(5)[:, None] * 2 + [0, 1, 3, 2]
    uv = np.zeros((10, 2), np.float32)
    return athcodec.MotionClip(
        positions=(rest + sway).astype(np.float32), time=np.arange(6) / 24, faces=faces, attributes={"uv": uv}
    )
