"""What an engine that takes the C core relies on: decoding compiles alone, and needs nothing but memory functions."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

CORE = Path(__file__).resolve().parent.parent / "athcodec" / "core"
COMPILERS = [name for name in ("gcc", "clang", "cc") if shutil.which(name)]


def decoder_sources():
    (names,) = re.findall(r"ATH_DECODER_SOURCES ([^)]*)\)", (CORE / "CMakeLists.txt").read_text())
    return [CORE / name for name in names.split()]


@pytest.mark.parametrize("compiler", COMPILERS)
def test_decoding_compiles_freestanding_without_warnings_and_needs_only_memory_functions(compiler, tmp_path):
    strict = ["-std=c11", "-O2", "-ffreestanding", "-fno-math-errno", "-ffp-contract=off", "-Wall",
              "-Wextra", "-Wconversion", "-Werror"]
    objects = []
    for source in decoder_sources():
        objects.append(tmp_path / f"{source.stem}.o")
        subprocess.run([compiler, *strict, "-c", source, "-o", objects[-1]], check=True)
    whole = tmp_path / "decoder.o"
    subprocess.run([compiler, "-nostdlib", "-r", *objects, "-o", whole], check=True)
    undefined = subprocess.run(["nm", "-u", whole], check=True, capture_output=True, text=True).stdout.split()
    assert set(undefined) - {"U"} <= {"memcpy", "memset", "memmove"}
