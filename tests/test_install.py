"""The C core in an engine: the decoder compiles alone, as C and as C++, needs nothing but
memory functions, is found by CMake and pkg-config once it is installed, and plays."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from fuzz.targets import CORE, decoder_sources

import athcodec
from athcodec._native import crc32c

pytestmark = pytest.mark.formats

HEADERS = "ath.h", "ath_gpu.h", "ath_player.h"
SLOW = pytest.mark.slow
C_COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)] or ["cc"]
CXX_COMPILERS = [name for name in ("g++", "clang++") if shutil.which(name)] or ["c++"]
TOOLS = {**os.environ, "PATH": os.pathsep.join([sysconfig.get_path("scripts"), os.environ["PATH"]])}

# An engine's first program: opens a file, prepares all of its deepest level, and says what came out.
CONSUMER = r"""
#include <ath.h>
#include <stdio.h>
#include <stdlib.h>

static uint8_t bytes[1 << 22];

int main(int argc, char **argv)
{
    FILE *source = argc > 1 ? fopen(argv[1], "rb") : NULL;
    size_t size = source ? fread(bytes, 1, sizeof bytes, source) : 0, front, needed;
    int result = ath_front(bytes, size, NULL, &front, &needed, NULL);
    if (result != ATH_OK) return printf("%s\n", ath_result_name(result)), 1;
    ath_file *file = (ath_file *)malloc(needed);
    result = ath_open(file, needed, bytes, size, NULL, NULL);
    size_t build = ath_build_size(file);
    if (result == ATH_OK) result = ath_build(file, malloc(build), build);
    ath_info info;
    ath_get_info(file, &info);
    int32_t deepest = info.level_count - 1;
    size_t refinements;
    if (result == ATH_OK) result = ath_refine_size(file, deepest, &refinements, NULL);
    if (result == ATH_OK) result = ath_refine(file, deepest, malloc(refinements), refinements);
    size_t work_size = ath_work_size(file), segment_size = ath_segment_size(file, deepest);
    void *work = malloc(work_size), *segment = malloc(segment_size);
    float *xyz = (float *)malloc((size_t)info.vertex_count * 3 * sizeof(float));
    uint32_t crc = 0;
    for (int32_t s = 0; result == ATH_OK && s < info.segment_count; s++) {
        const ath_segment *segments[1] = {(const ath_segment *)segment};
        result = ath_prepare(work, work_size, file, s, deepest, segment, segment_size);
        int32_t end = ath_segment_start(file, s + 1);
        for (int32_t t = ath_segment_start(file, s); result == ATH_OK && t < end; t++) {
            result = ath_positions(file, segments, 1, t, ATH_SOURCE_ORDER, xyz, 3 * sizeof(float));
            crc = ath_crc32c(crc, (const uint8_t *)xyz, (size_t)info.vertex_count * 3 * sizeof(float));
        }
    }
    printf("%s %d %d %d %d %08x\n", ath_result_name(result), (int)info.vertex_count, (int)info.frame_count,
           (int)info.segment_count, (int)info.level_count, (unsigned)crc);
    return result;
}
"""

PROJECT = """
cmake_minimum_required(VERSION 3.18)
project(engine LANGUAGES C CXX)
{finding}
add_executable(shared consumer.c)
target_link_libraries(shared PRIVATE athcodec::ath)
add_executable(static consumer.c)
target_link_libraries(static PRIVATE athcodec::ath_static)
add_executable(cxx consumer.cpp)
target_compile_features(cxx PRIVATE cxx_std_17)
target_link_libraries(cxx PRIVATE athcodec::ath_static)
add_executable(play "{core}/examples/play.c")
target_link_libraries(play PRIVATE athcodec::ath)
"""


def run(*command, env=TOOLS) -> str:
    done = subprocess.run(
        [str(part) for part in command], env=env, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert done.returncode == 0, f"{command}: exit {done.returncode}\n{done.stdout}"
    return done.stdout


# ---- compiling ----


@pytest.mark.parametrize(
    "command",
    [*([name, "-std=c11"] for name in C_COMPILERS), *([name, "-x", "c++", "-std=c++17"] for name in CXX_COMPILERS)],
    ids=lambda command: command[0],
)
def test_decoding_compiles_freestanding_without_warnings_and_needs_only_memory_functions(command, tmp_path):
    strict = "-O2 -ffreestanding -fno-math-errno -ffp-contract=off -Wall -Wextra -Wconversion -Werror".split()
    folders = f"-I{CORE}", f"-I{CORE / 'include'}"
    objects = []
    for source in decoder_sources():
        objects.append(tmp_path / f"{source.stem}.o")
        run(*command, *strict, *folders, "-c", source, "-o", objects[-1])
    whole = tmp_path / "decoder.o"
    run(command[0], "-nostdlib", "-r", *objects, "-o", whole)
    undefined = run("nm", "-u", whole).split()
    assert set(undefined) - {"U"} <= {"memcpy", "memset", "memmove"}


def test_the_sources_that_are_no_encoder_are_the_decoder():
    """A new file is in one of the three lists, so that an engine cannot miss it."""
    (names,) = re.findall(r"ATH_ENCODER_SOURCES\s([^)]*)\)", (CORE / "CMakeLists.txt").read_text())
    assert sorted(path for path in CORE.rglob("*.c") if path.parent.name != "examples") == sorted(
        decoder_sources() + [CORE / name for name in names.split()]
    )


# ---- one file ----


@pytest.fixture
def single(tmp_path) -> Path:
    """A folder with the decoder as one file, its header, and a program."""
    run(sys.executable, CORE / "amalgamate.py", tmp_path / "ath.c")
    shutil.copy(CORE / "include" / "ath.h", tmp_path)
    (tmp_path / "consumer.c").write_text(CONSUMER)
    return tmp_path


@pytest.mark.parametrize("compiler", C_COMPILERS)
@pytest.mark.parametrize(
    "options", [pytest.param("", marks=SLOW), pytest.param("-O2", marks=SLOW), "-O3 -march=native -ffp-contract=fast"]
)
def test_the_decoder_as_one_file_decodes_what_python_does(compiler, options, single, sample_ath, expected):
    """Also where the compiler was told that it may fuse multiplications and additions. Clang's "fast" is the one way
    that sources cannot undo (docs/c-api.md)."""
    told = options.replace("=fast", "=on") if compiler == "clang" else options
    flags = [*told.split(), "-DATH_STATIC", "-I", single]
    run(compiler, *flags, single / "consumer.c", single / "ath.c", "-lm", "-o", single / "consumer")
    assert run(single / "consumer", sample_ath) == expected


@pytest.mark.parametrize("compiler", ["gcc -std=c11", "g++ -std=c++17 -x c++"])
def test_the_single_file_may_hold_the_gpu_form(compiler, single):
    """Without warnings, as C and as C++."""
    run(sys.executable, CORE / "amalgamate.py", "--gpu", single / "ath_with_gpu.c")
    shutil.copy(CORE / "include" / "ath_gpu.h", single)
    flags = "-O1 -Wall -Wextra -Werror -DATH_STATIC -c".split()
    run(*compiler.split(), *flags, "-I", single, single / "ath_with_gpu.c", "-o", single / "ath.o")
    assert "ath_gpu_record" in run("nm", single / "ath.o")


@SLOW
def test_no_instruction_of_the_decoder_rounds_once_for_two_operations(single):
    """Compiled for processors that have such instructions, by a compiler that takes them where it is let."""
    fused = re.compile(r"\b(vfn?m(?:add|sub)|fn?m(?:add|sub)\b|fml[as]\b|vfm[as]|fmadd\.|m[as][ed]br)")
    compiler = [sys.executable, "-m", "ziglang", "cc", *"-O2 -g0 -DATH_STATIC -ffp-contract=fast-honor-pragmas".split()]
    for target in ("x86_64-linux-musl -mcpu=haswell", "aarch64-linux-musl"):
        run(*compiler, "-target", *target.split(), "-S", single / "ath.c", "-o", single / "ath.s")
        assembly = (single / "ath.s").read_text()
        assert "ath_prepare" in assembly and not fused.findall(assembly), target


@pytest.mark.parametrize(
    "options, why",
    [("-ffast-math", "expected a build without -ffast-math"), ("-m32 -mfpmath=387", "expected doubles in registers")],
)
def test_a_build_whose_arithmetic_differs_is_refused(options, why, single):
    if "x86_64" not in platform.machine() and "-m32" in options:
        pytest.skip("this processor has no x87 registers")
    command = ["gcc", "-ffreestanding", *options.split(), "-c", single / "ath.c", "-o", single / "ath.o"]
    done = subprocess.run([str(part) for part in command], env=TOOLS, text=True, capture_output=True)
    assert done.returncode != 0 and why in done.stderr


# ---- installing ----


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    """The decoder, installed, and then moved to another place."""
    folder = tmp_path_factory.mktemp("install")
    run("cmake", "-G", "Ninja", "-S", CORE, "-B", folder / "build")
    built = run("cmake", "--build", folder / "build")
    assert "warning" not in built
    run("cmake", "--install", folder / "build", "--prefix", folder / "first place")
    return (folder / "first place").rename(folder / "moved")


def write_project(folder: Path, finding: str) -> None:
    (folder / "CMakeLists.txt").write_text(PROJECT.format(finding=finding, core=CORE.as_posix()))
    for name in ("consumer.c", "consumer.cpp"):
        (folder / name).write_text(CONSUMER)


@pytest.fixture(scope="module")
def engine(installed, tmp_path_factory) -> Path:
    """The build folder of a project that uses the installed decoder through find_package."""
    project = tmp_path_factory.mktemp("engine")
    write_project(project, f"find_package(athcodec {athcodec.__version__} REQUIRED)")
    options = [f"-DCMAKE_PREFIX_PATH={installed}", "-DCMAKE_BUILD_TYPE=Release"]
    run("cmake", "-G", "Ninja", "-S", project, "-B", project / "build", *options)
    run("cmake", "--build", project / "build")
    return project / "build"


@pytest.fixture(scope="module")
def expected(sample_ath) -> str:
    """What the consumer is to say about the sample."""
    return said_of(sample_ath)


def said_of(path: Path) -> str:
    with athcodec.open(path) as decoder:
        numbers = decoder.file.vertex_count, decoder.frame_count, len(decoder.segments), decoder.file.level_count
        crc = crc32c(np.ascontiguousarray(decoder.positions(), np.float32).tobytes())
    return "OK {} {} {} {} {:08x}\n".format(*numbers, crc)


def library_folder(installed: Path) -> Path:
    (config,) = installed.glob("lib*/**/cmake/athcodec/athcodecConfig.cmake")
    return config.parents[2]


def test_an_install_holds_the_header_both_libraries_and_both_ways_to_find_them(installed):
    folder = library_folder(installed)
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    found_by_cmake = {f"cmake/athcodec/athcodecConfig{part}.cmake" for part in ("", "Version")}
    assert {"libath.a", "pkgconfig/athcodec.pc", *found_by_cmake} <= files
    for name in HEADERS:
        assert (installed / "include" / name).read_bytes() == (CORE / "include" / name).read_bytes()
    assert sorted(path.name for path in installed.rglob("*.h")) == sorted(HEADERS)


def test_the_shared_library_exports_what_the_header_declares_and_nothing_else(installed):
    headers = "".join((installed / "include" / name).read_text() for name in HEADERS)
    declared = re.findall(r"^ATH_API [^;(]*?(ath_\w+)\(", headers, re.MULTILINE)
    names = run("nm", "-D", "--defined-only", library_folder(installed) / "libath.so").split("\n")
    assert sorted(line.split()[-1] for line in names if line) == sorted(declared) and len(declared) > 30


@pytest.mark.parametrize("program", ["shared", "static", "cxx"])
def test_a_program_that_finds_the_package_decodes_what_python_does(program, engine, sample_ath, expected):
    assert run(engine / program, sample_ath) == expected


@pytest.mark.parametrize("compiler", C_COMPILERS)
def test_programs_compiled_through_pkg_config_link_and_decode_what_python_does(
    compiler, installed, sample_ath, expected, tmp_path
):
    folder = library_folder(installed)
    environment = TOOLS | {"PKG_CONFIG_PATH": str(folder / "pkgconfig")}
    flags = run("pkg-config", "--cflags", "--libs", "athcodec", env=environment).split()
    assert run("pkg-config", "--modversion", "athcodec", env=environment).strip() == athcodec.__version__
    (tmp_path / "consumer.c").write_text(CONSUMER)
    for source in (tmp_path / "consumer.c", CORE / "examples" / "play.c"):
        run(compiler, source, *flags, f"-Wl,-rpath,{folder}", "-o", tmp_path / source.stem)
    assert run(tmp_path / "consumer", sample_ath) == expected
    assert "ranges missing at the end: 0" in run(tmp_path / "play", sample_ath)


def test_a_project_that_holds_the_sources_uses_them_under_the_same_name(sample_ath, expected, tmp_path):
    """As a submodule: add_subdirectory in the place of find_package, and nothing of it is installed."""
    write_project(tmp_path, f'add_subdirectory("{CORE.as_posix()}" athcodec)')
    run("cmake", "-G", "Ninja", "-S", tmp_path, "-B", tmp_path / "build")
    run("cmake", "--build", tmp_path / "build", "--target", "static")
    run("cmake", "--install", tmp_path / "build", "--prefix", tmp_path / "installed")
    assert run(tmp_path / "build" / "static", sample_ath) == expected
    assert not [path for path in (tmp_path / "installed").rglob("*") if path.is_file()]


# ---- playing ----


def rows(text: str) -> np.ndarray:
    """The example's table: second, distance, level asked for, level shown, bytes, and two times."""
    return np.array([line.split() for line in text.splitlines() if re.match(r" *\d+ ", line)], float)


def without_times(text: str) -> str:
    return re.sub(r" +[\d.]+ +[\d.]+$|us per frame.*", "", text, flags=re.MULTILINE)


@pytest.fixture(scope="module")
def walk(engine, sample_ath) -> list:
    """The command, with slices of which six hold level 0, so that there is motion from the first one that is shown."""
    with athcodec.open(sample_ath) as decoder:
        slices = 6 * decoder.file.file_length // decoder.levels[0].bytes
    return [engine / "play", sample_ath, "--slices", slices, "--seconds", 24, "--fps", 30]


@pytest.fixture(scope="module")
def played(walk) -> str:
    return run(*walk)


def test_the_example_shows_coarse_levels_far_away_and_the_deepest_one_close_by(played, sample_ath):
    with athcodec.open(sample_ath) as decoder:
        deepest = decoder.file.level_count - 1
    _, distance, asked, shown, *_ = rows(played).T
    nearest = distance == distance.min()
    assert shown[0] == 0 and asked[-1] == 0 and shown[-1] <= 1
    assert (asked[nearest] == deepest).all() and shown[nearest][-1] == deepest
    middle = len(asked) // 2
    assert (np.diff(asked[:middle]) >= 0).all() and (np.diff(asked[middle:]) <= 0).all()


def test_the_example_shows_what_has_arrived_until_all_has(played, sample_ath):
    size = sample_ath.stat().st_size
    _, _, asked, shown, there, *_ = rows(played).T
    assert there[0] < size == there[-1] and (np.diff(there) >= 0).all()
    coming = there < size
    assert (shown[coming] <= asked[coming]).all() and (shown[coming] < asked[coming]).any()
    assert played.splitlines()[-1] == "ranges missing at the end: 0"


def test_programs_play_the_levels_of_a_file_with_layers(engine, layered_ath):
    assert run(engine / "static", layered_ath) == said_of(layered_ath)
    text = run(engine / "play", layered_ath, "--slices", 40, "--seconds", 24, "--fps", 30)
    with athcodec.open(layered_ath) as decoder:
        assert rows(text)[:, 3].max() == decoder.file.level_count - 1
    assert text.splitlines()[-1] == "ranges missing at the end: 0"


def test_the_example_plays_the_same_again(played, walk):
    again = run(*walk)
    assert without_times(again) == without_times(played) and len(rows(played)) == 24


@pytest.mark.parametrize(
    "damage, says",
    [
        (lambda data: b"", "header: got 0 bytes; expected 24"),
        (lambda data: data[:100], r"front: got 100 bytes; expected \d+"),
        (lambda data: b"PK" + data, "file: got first bytes 0x504b8941; expected 0x89415448"),
        (
            lambda data: data[:9000] + bytes([data[9000] ^ 1]) + data[9001:],
            r"preparing: chunk STEMS of level 2, segment \d at byte \d+: "
            "got checksum 0x[0-9a-f]{8}; expected 0x[0-9a-f]{8}",
        ),
    ],
    ids=["empty", "cut off", "another file", "damaged"],
)
def test_the_example_says_in_one_line_what_is_wrong_with_a_file(damage, says, engine, sample_ath, tmp_path):
    (tmp_path / "bad.ath").write_bytes(damage(sample_ath.read_bytes()))
    done = subprocess.run([engine / "play", tmp_path / "bad.ath"], capture_output=True, text=True)
    assert done.returncode == 1 and re.fullmatch(rf"play: .*{says}\n", done.stderr)
