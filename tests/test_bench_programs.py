"""Real programs in the benchmark: each keeps the bound, needs its bytes alone, and says if it is absent."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from athcodec.motion.clip import MotionClip
from athcodec.sources import read_hdf5, sample_path
from bench.codecs import BoundBroken, Source, check
from bench.codecs.program import CannotKeep, Grid
from bench.codecs.programs import CLASSES, PROGRAMS, lossless

ROOT = Path(__file__).resolve().parent.parent

pytestmark = pytest.mark.tools

MODULES = {kind.module: kind.package for kind in CLASSES}
FRAMES, BRANCHES = slice(30, 46), 16
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
NEEDED = PROJECT["dependencies"] + PROJECT["optional-dependencies"]["test"]
INSTALLED = {re.match(r"[\w-]+", package)[0] for package in NEEDED}


def interleaved(clip, seed):
    """Some branches and frames of a clip, their vertices mixed, in order along each branch."""
    kept = clip.vertex_branch < BRANCHES
    branch = clip.vertex_branch[kept]
    labels = np.random.default_rng(seed).permutation(branch)
    order = np.empty(len(branch), int)
    order[np.argsort(labels, kind="stable")] = np.argsort(branch, kind="stable")
    positions = clip.block(FRAMES.start, FRAMES.stop)[:, kept][:, order]
    return MotionClip(positions, clip.time[FRAMES], labels, clip.branch_parent[:BRANCHES], clip.rest[kept][order])


@pytest.fixture(scope="module")
def piece():
    with read_hdf5(sample_path()) as clip:
        return Source(interleaved(clip, seed=3))


def each_of(codecs):
    """One test for each; those that the tests' own extra does not install need the extra `bench`."""
    return pytest.mark.parametrize(
        "codec",
        [
            pytest.param(codec, id=codec.name, marks=() if codec.package in INSTALLED else pytest.mark.programs)
            for codec in codecs
        ],
    )


@each_of(PROGRAMS)
@pytest.mark.parametrize("relative", [1e-3, 1e-5])
def test_programs_keep_the_bound_and_are_decoded_from_their_bytes_alone(codec, relative, piece):
    data, decoded = check(codec, piece, relative * piece.diagonal)
    assert np.array_equal(type(codec)().decode(bytes(data)), decoded)
    assert {"form", "order", "pose", "choice"} <= codec.settings.keys()
    assert codec.kind == "program" and len(data) < 1.02 * piece.positions.nbytes


@each_of(lossless())
def test_lossless_programs_give_every_bit_back(codec, piece):
    data, decoded = check(codec, piece, 0.0)
    assert decoded.tobytes() == piece.positions.tobytes()
    assert np.array_equal(type(codec)(lossless=True).decode(data), decoded)


@each_of(PROGRAMS)
@pytest.mark.parametrize(("frames", "vertices"), [(1, 1), (1, 5), (6, 1)])
def test_programs_take_clips_of_one_frame_or_one_vertex(codec, frames, vertices):
    rng = np.random.default_rng(frames + vertices)
    positions = rng.normal(size=(frames, vertices, 3)).astype(np.float32)
    clip = MotionClip(
        positions=positions, time=np.arange(frames), vertex_branch=np.zeros(vertices, int), branch_parent=np.array([-1])
    )
    _, decoded = check(codec, Source(clip), 1e-3)
    assert decoded.shape == positions.shape


@pytest.mark.parametrize("module", MODULES)
def test_a_program_that_is_not_installed_says_what_to_install(module, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    [absent] = [codec for codec in PROGRAMS if codec.module == module]
    assert absent.missing() == f"not installed: pip install {MODULES[module]}"


@each_of([codec for codec in PROGRAMS if codec.name in ("SZ3", "zfp")])
def test_tuning_beats_one_call_with_the_bound_of_a_coordinate(codec, piece):
    bound = 1e-4 * piece.diagonal
    module, flat = codec.load(), piece.positions.reshape(len(piece.positions), -1)
    if codec.name == "zfp":
        plain = len(module.compress_numpy(flat.copy(), tolerance=bound / np.sqrt(3)))
    else:
        config = module.szConfig(flat.shape)
        config.errorBoundMode, config.absErrorBound = module.szErrorBoundMode.ABS, bound / np.sqrt(3)
        plain = module.sz.compress(flat.copy(), config)[0].nbytes
    assert len(codec.encode(piece, bound)) < 0.8 * plain


def test_a_bound_below_what_float32_resolves_is_refused(piece):
    [codec] = [codec for codec in PROGRAMS if codec.package == "meshoptimizer"]
    with pytest.raises(CannotKeep, match="1e-12"):
        codec.encode(piece, 1e-12)


def test_a_program_that_breaks_the_bound_is_caught(piece, monkeypatch):
    [codec] = [codec for codec in PROGRAMS if codec.package == "meshoptimizer"]

    def wrong(grid, integers):
        return (integers * grid.step * 0.9).astype(np.float32)

    monkeypatch.setattr(Grid, "positions", wrong)
    monkeypatch.setattr("bench.codecs.program.largest_error", lambda positions, decoded: 0.0)
    with pytest.raises(BoundBroken, match="meshoptimizer"):
        check(codec, piece, 1e-3 * piece.diagonal)
