"""Encoding writes the same bytes whatever NumPy's BLAS, its threads and the instructions of the processor are.

Files are made in processes of their own, under settings that give NumPy's matrix products and logarithms other bits."""

from __future__ import annotations

import hashlib
import os
import platform
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from moving_meshes import leafed_tree
from plants import awkward, blown_tree, flowing_growth, plant, tube
from programs import printed

import athcodec

OLD = {  # as on a processor of 2004
    "OPENBLAS_CORETYPE": "Prescott",
    "OPENBLAS_NUM_THREADS": "1",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F",
}
SETTINGS = {name: {"OPENBLAS_CORETYPE": name} for name in ("Haswell", "SkylakeX", "Nehalem")} | {
    "one thread": {"OPENBLAS_NUM_THREADS": "1"},
    "x86-64-v2": {"NPY_DISABLE_CPU_FEATURES": OLD["NPY_DISABLE_CPU_FEATURES"]},
    "old": OLD,
}
OPTIONS = [{}, {"lossless": True}, {"effort": "best"}, {"ladder": "none"}]
PROGRAM = """
import hashlib, pathlib, sys
import numpy as np
import athcodec
path, where, *options = sys.argv[1:]
matrix = np.random.default_rng(0).normal(size=(300, 300))
print(hashlib.sha256((matrix @ matrix).tobytes() + np.log2(np.abs(matrix)).tobytes()).hexdigest())
for chosen in map(eval, options):
    clip = athcodec.read(path)
    athcodec.encode(clip, where, **chosen)
    print(hashlib.sha256(pathlib.Path(where).read_bytes()).hexdigest())
"""


CLIPS = {
    "random": lambda: plant(3),
    "double": lambda: plant(7, branches=8, dtype="f8"),
    "noise": lambda: plant(8, branches=10, rough=0.3),
    "leaves": leafed_tree,
    "bark": lambda: tube(20, 8, 40),
    "degenerate": lambda: awkward(5, shuffled=True),
    "gale": lambda: blown_tree(1, branches=40, frames=60),
    "loop": lambda: athcodec.looped(plant(4, branches=6, frames=40), 4),
}


def made(path: Path, folder: Path, settings: dict[str, str], options: list[dict]) -> list[str]:
    """Checksums: of what NumPy computes under such settings, and of the files."""
    command = [sys.executable, "-c", PROGRAM, path, folder / "made.ath", *map(repr, options)]
    return printed(*command, env=os.environ | settings).split()


@cache
def usable_settings() -> dict[str, dict[str, str]]:
    """Return the settings but those whose instructions this processor lacks, which end a process at once."""
    product = "import numpy as np; np.ones((300, 300)) @ np.ones((300, 300))"

    def ends(own: dict[str, str]) -> int:
        return subprocess.run([sys.executable, "-c", product], env=os.environ | own).returncode

    return {where: own for where, own in SETTINGS.items() if ends(own) != -signal.SIGILL}


def source(name: str, folder: Path) -> Path:
    if name == "tree":
        return athcodec.sample_path(name)
    athcodec.write((CLIPS | {"growth": flowing_growth})[name](), folder / "clip.h5")  # Growth is predicted.
    return folder / "clip.h5"


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the settings are for x86-64")
def test_a_file_is_the_same_where_numpy_computes_other_bits(tmp_path):
    path = source("degenerate", tmp_path)
    (here, file), (there, again) = (made(path, tmp_path, settings, [{"effort": "fast"}]) for settings in ({}, OLD))
    assert here != there, "the settings do nothing here"
    assert file == again


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tree", "growth", *CLIPS])
def test_every_kind_of_file_is_the_same_whatever_blas_and_processor_do(name, tmp_path):
    path = source(name, tmp_path)
    options = [*OPTIONS, {"target_size": 3000}] if name == "random" else OPTIONS  # which takes many attempts
    _, *wanted = made(path, tmp_path, {}, options)
    found = {where: made(path, tmp_path, own, options)[1:] for where, own in usable_settings().items()}
    assert found == dict.fromkeys(found, wanted)


@pytest.mark.slow
def test_the_number_of_threads_does_not_show_where_modes_are_learned(tmp_path):
    """Trials that ran at once learned from whichever of them came first."""
    clip = blown_tree(2, branches=700, frames=200)
    files = set()
    for jobs in (1, 2, 4):
        athcodec.encode(clip, tmp_path / "a.ath", ladder="none", jobs=jobs)
        files.add(hashlib.sha256((tmp_path / "a.ath").read_bytes()).hexdigest())
    assert len(files) == 1
