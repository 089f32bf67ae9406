"""The C core on other processors: 32 and 64 bits, low or high bytes first, each with the bits of the vectors.

Run with -m machines; it needs qemu-user (Debian: qemu-user-static)."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from fuzz.targets import CORE
from programs import printed

from spec import conformance

pytestmark = pytest.mark.machines

TARGETS = {
    "x86_64": "x86_64-linux-musl",
    "i386": "x86-linux-musl -mcpu=pentium4",
    "aarch64": "aarch64-linux-musl",
    "arm": "arm-linux-musleabihf",
    "riscv64": "riscv64-linux-musl",
    "s390x": "s390x-linux-musl",
}
OPTIONS = (
    "-O2 -std=c11 -static -DATH_STATIC -Wall -Wextra -Werror -fno-math-errno -ffp-contract=fast-honor-pragmas".split()
)


def emulator(machine: str) -> str:
    for name in (f"qemu-{machine}-static", f"qemu-{machine}"):
        if path := shutil.which(name):
            return path
    raise FileNotFoundError(f"qemu-{machine}-static: not found; expected Debian's package qemu-user-static")


@pytest.fixture(scope="module")
def sources(tmp_path_factory) -> list[Path]:
    """The decoder as one file, and a program that decodes with it."""
    single = tmp_path_factory.mktemp("machines") / "ath.c"
    subprocess.run([sys.executable, str(CORE / "amalgamate.py"), str(single)], check=True)
    return [single, Path(__file__).with_name("machines.c")]


def decoded(command: list[str], vectors: list[conformance.Vector]) -> dict[str, dict[str, str]]:
    """Results by vector and item."""
    lines = "".join(" ".join(map(str, filter(None, (v.path, v.mesh_path)))) + "\n" for v in vectors)
    rows = [line.split() for line in printed(*command, input=lines, timeout=1200).splitlines()]
    return {path: dict(result.split("=") for result in results) for path, *results in rows}


@pytest.mark.parametrize("machine", TARGETS)
def test_every_vector_has_the_same_bits_on_every_machine(machine, sources, tmp_path):
    program = tmp_path / "decode"
    compiler = [sys.executable, "-m", "ziglang", "cc", "-target", *TARGETS[machine].split(), *OPTIONS]
    subprocess.run([*compiler, "-I", CORE / "include", *sources, "-o", program], check=True)
    vectors = conformance.vectors()
    found = decoded([emulator(machine), str(program)], vectors)
    wrong = [
        (vector.name, item, found[str(vector.path)].get(item), wanted)
        for vector in vectors
        for item, wanted in vector.results.items()
        if (item in found[str(vector.path)] or vector.valid) and item not in ("strict", "time", "clips", "static")
        if found[str(vector.path)].get(item) != wanted
    ]
    assert not wrong and len(found) == len(vectors)
