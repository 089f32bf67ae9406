"""What is released: wheels that .ci/release builds for other platforms than this one, and one that installs here
without a compiler and writes the same bytes.

Run with -m programs; it takes packages from the index, and zig some minutes. Libraries for other machines run under
wine and qemu (Debian: wine, qemu-user-static, libc6-arm64-cross)."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest
from fuzz.targets import CORE
from programs import printed
from test_install import CONSUMER, said_of

import athcodec

pytestmark = pytest.mark.programs
ROOT = Path(__file__).resolve().parent.parent
GLIBC = "manylinux_2_17_{0}.manylinux2014_{0}"
HERE = GLIBC.format(platform.machine())
BUILT = {HERE, GLIBC.format("aarch64"), "win_amd64", "macosx_11_0_arm64"}


@pytest.fixture(scope="module")
def released(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("released")
    subprocess.run([sys.executable, ROOT / ".ci" / "release", out, "--only", *sorted(BUILT)], check=True)
    return out


def test_every_wheel_is_there_with_its_sum(released):
    sums = dict(reversed(line.split()) for line in (released / "SHA256SUMS").read_text().splitlines())
    tags = [set(name[: -len(".whl")].split("-")[-1].split(".")) for name in sums if name.endswith(".whl")]
    assert sorted(map(sorted, tags)) == sorted(sorted(platform.split(".")) for platform in BUILT)
    assert all(hashlib.sha256((released / name).read_bytes()).hexdigest() == value for name, value in sums.items())
    assert any(name.endswith(".tar.gz") for name in sums)


def test_a_wheel_installs_without_a_compiler_and_writes_the_same_bytes(released, sample_clip, tmp_path):
    venv.create(tmp_path / "venv", with_pip=True)
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "python3").symlink_to(tmp_path / "venv" / "bin" / "python3")
    bare = {"PATH": str(programs), "HOME": str(tmp_path), "TMPDIR": str(tmp_path)} | {
        name: value for name, value in os.environ.items() if name.startswith("PIP_")
    }
    assert not any(shutil.which(name, path=bare["PATH"]) for name in ("cc", "gcc", "clang", "cmake", "ninja"))
    (wheel,) = released.glob(f"*manylinux2014_{platform.machine()}*.whl")
    python = tmp_path / "venv" / "bin" / "python3"
    install = [python, "-m", "pip", "install", "-q", "--only-binary", ":all:", wheel]
    subprocess.run(install, check=True, env=bare, cwd=tmp_path)
    subprocess.run([python, "-m", "athcodec", "demo"], check=True, env=bare, cwd=tmp_path, stdout=subprocess.DEVNULL)
    assert (tmp_path / "athcodec_demo.html").stat().st_size > 100_000
    theirs = tmp_path / "theirs.ath"
    program = "import sys, athcodec; athcodec.encode(athcodec.read(athcodec.sample_path()), sys.argv[1])"
    subprocess.run([python, "-c", program, theirs], check=True, env=bare, cwd=tmp_path)
    assert theirs.read_bytes() == athcodec.encode(sample_clip)


@dataclass(frozen=True)
class Machine:
    """Another one: the wheels for it, their library, zig's target, and what runs a program there."""

    wheel: str
    library: str
    target: str
    emulator: list[str]

    def linked(self, folder: Path) -> Path:
        """What a program is linked with: the library, or on Windows one that says what it exports."""
        if self.library != "libath.dll":
            return folder / self.library
        names = sorted(set(re.findall(r"\b(ath_[a-z0-9_]+)\(", CONSUMER)))
        (folder / "ath.def").write_text("\n".join(["LIBRARY libath.dll", "EXPORTS", *names]))
        zig("dlltool", "-m", "i386:x86-64", "-d", folder / "ath.def", "-l", folder / "ath.lib")
        return folder / "ath.lib"


MACHINES = {
    "windows": Machine("*win_amd64.whl", "libath.dll", "x86_64-windows-gnu", ["wine"]),
    "aarch64": Machine(
        "*manylinux2014_aarch64*.whl",
        "libath.so",
        "aarch64-linux-gnu.2.17",
        "qemu-aarch64-static -L /usr/aarch64-linux-gnu -E LD_LIBRARY_PATH=.".split(),
    ),
}


def zig(*words: object) -> None:
    subprocess.run([sys.executable, "-m", "ziglang", *map(str, words)], check=True)


@pytest.mark.parametrize("name", MACHINES)
def test_a_library_for_another_machine_decodes_there_what_python_does_here(name, released, sample_ath, tmp_path):
    machine = MACHINES[name]
    (wheel,) = released.glob(machine.wheel)
    (tmp_path / machine.library).write_bytes(zipfile.ZipFile(wheel).read(f"athcodec/{machine.library}"))
    (tmp_path / "consumer.c").write_text(CONSUMER)
    program = tmp_path / "consumer.exe"
    zig(
        "cc",
        "-target",
        machine.target,
        "-I",
        CORE / "include",
        tmp_path / "consumer.c",
        machine.linked(tmp_path),
        "-o",
        program,
    )
    shutil.copy(sample_ath, tmp_path / "sample.ath")
    environment = os.environ | {"WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all"}
    found = printed(*machine.emulator, program, "sample.ath", cwd=tmp_path, env=environment)
    assert found.splitlines() == said_of(sample_ath).splitlines()
