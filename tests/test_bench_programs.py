"""Real programs in the benchmark: each keeps the bound, needs its bytes alone, and says if it is absent."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from athcodec.clip import MotionClip
from athcodec.sources import read_hdf5, sample_path

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT))  # for bench, which is not installed; athcodec stays the installed one

from bench.codecs import BoundBroken, Source, check  # noqa: E402
from bench.codecs.program import CannotKeep, Grid  # noqa: E402
from bench.codecs.programs import CLASSES, PROGRAMS, lossless  # noqa: E402

MODULES = {kind.module: kind.package for kind in CLASSES}
FRAMES, BRANCHES = slice(30, 46), 16


def interleaved(clip, seed):
    """Some branches and frames of a clip, their vertices mixed, in order along each branch."""
    kept = clip.vertex_branch < BRANCHES
    branch = clip.vertex_branch[kept]
    labels = np.random.default_rng(seed).permutation(branch)
    order = np.empty(len(branch), int)
    order[np.argsort(labels, kind="stable")] = np.argsort(branch, kind="stable")
    positions = clip.block(FRAMES.start, FRAMES.stop)[:, kept][:, order]
    return MotionClip(positions=positions, time=clip.time[FRAMES], vertex_branch=labels,
                      branch_parent=clip.branch_parent[:BRANCHES], rest=clip.rest[kept][order])


@pytest.fixture(scope="module")
def piece():
    with read_hdf5(sample_path()) as clip:
        return Source(interleaved(clip, seed=3))


def names(codecs):
    return [codec.name for codec in codecs]


def runs(codec, capsys):
    """Whether it is installed; what is not is named in the output, as it would be in the benchmark's."""
    reason = codec.missing()
    if reason is None:
        return True
    assert f": pip install {codec.package}" in reason and reason.startswith("not ") and "\n" not in reason
    with capsys.disabled():
        print(f"\n{codec.name}: {reason}")
    return False


@pytest.mark.parametrize("codec", PROGRAMS, ids=names(PROGRAMS))
@pytest.mark.parametrize("relative", [1e-3, 1e-5])
def test_programs_keep_the_bound_and_are_decoded_from_their_bytes_alone(codec, relative, piece, capsys):
    if runs(codec, capsys):
        data, decoded = check(codec, piece, relative * piece.diagonal)
        assert np.array_equal(type(codec)().decode(bytes(data)), decoded)
        assert {"form", "order", "pose", "choice"} <= codec.settings.keys()
        assert codec.kind == "program" and len(data) < 1.02 * piece.positions.nbytes


@pytest.mark.parametrize("codec", lossless(), ids=names(lossless()))
def test_lossless_programs_decode_the_same_bits(codec, piece, capsys):
    if runs(codec, capsys):
        data, decoded = check(codec, piece, 0.0)
        assert decoded.tobytes() == piece.positions.tobytes()
        assert np.array_equal(type(codec)(lossless=True).decode(data), decoded)


@pytest.mark.parametrize("codec", PROGRAMS, ids=names(PROGRAMS))
@pytest.mark.parametrize(("frames", "vertices"), [(1, 1), (1, 5), (6, 1)])
def test_programs_take_clips_of_one_frame_or_one_vertex(codec, frames, vertices, capsys):
    rng = np.random.default_rng(frames + vertices)
    positions = rng.normal(size=(frames, vertices, 3)).astype(np.float32)
    clip = MotionClip(positions=positions, time=np.arange(frames),
                      vertex_branch=np.zeros(vertices, int), branch_parent=np.array([-1]))
    if runs(codec, capsys):
        check(codec, Source(clip), 1e-3)


@pytest.mark.parametrize("module", MODULES)
def test_a_program_that_is_not_installed_says_what_to_install(module, monkeypatch):
    for name in (module, module.partition(".")[0]):
        monkeypatch.setitem(sys.modules, name, None)
    absent = [codec for codec in PROGRAMS if codec.module == module]
    assert absent
    for codec in absent:
        assert codec.missing() == f"not installed: pip install {MODULES[module]}"


def test_a_program_that_cannot_be_imported_says_why(monkeypatch):
    def load(codec):
        raise ValueError("numpy.dtype size changed,\nmay indicate binary incompatibility")

    monkeypatch.setattr(CLASSES[0], "load", load)
    line = PROGRAMS[0].missing()
    assert line.startswith("not usable: pip install pysz") and "size changed" in line and "\n" not in line


def test_naming_the_programs_imports_none_of_them():
    others = sorted(set(MODULES) - {"zstandard"} | {"pxr"})
    code = f"import sys, bench.codecs.programs; print(sorted(set({others}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, text=True, capture_output=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", ["SZ3", "zfp"])
def test_tuning_beats_one_call_with_the_bound_of_a_coordinate(name, piece, capsys):
    [codec] = [codec for codec in PROGRAMS if codec.name == name]
    if runs(codec, capsys):
        bound = 1e-4 * piece.diagonal
        module, flat = codec.load(), piece.positions.reshape(len(piece.positions), -1)
        if name == "zfp":
            plain = len(module.compress_numpy(flat.copy(), tolerance=bound / np.sqrt(3)))
        else:
            config = module.szConfig(flat.shape)
            config.errorBoundMode, config.absErrorBound = module.szErrorBoundMode.ABS, bound / np.sqrt(3)
            plain = module.sz.compress(flat.copy(), config)[0].nbytes
        assert len(codec.encode(piece, bound)) < 0.8 * plain


def test_a_bound_below_what_float32_resolves_is_refused(piece):
    [codec] = [codec for codec in PROGRAMS if codec.package == "zstandard"]
    with pytest.raises(CannotKeep, match="1e-12"):
        codec.encode(piece, 1e-12)


def test_a_program_that_errs_is_caught(piece, monkeypatch):
    [codec] = [codec for codec in PROGRAMS if codec.package == "zstandard"]
    def wrong(grid, integers):
        return (integers * grid.step * 0.9).astype(np.float32)

    monkeypatch.setattr(Grid, "positions", wrong)
    monkeypatch.setattr("bench.codecs.program.largest_error", lambda positions, decoded: 0.0)
    with pytest.raises(BoundBroken, match="float16"):
        check(codec, piece, 1e-3 * piece.diagonal)
