"""The fuzz targets build, find nothing in a short run, and find mistakes that are put into the core."""

from __future__ import annotations

import shutil
import sys
import warnings
from io import BytesIO
from pathlib import Path

import pytest
from fuzz import coverage, seeds, sources, targets

import athcodec

pytestmark = pytest.mark.tools

RUNS = 1000
SEED = 1
ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def used():
    found = targets.compiler()
    if not found.fuzzer:
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.warn(targets.NO_FUZZER, stacklevel=1)
    return found


@pytest.mark.parametrize("target", targets.TARGETS)
def test_a_short_run_of_each_target_finds_nothing(target, used, tmp_path):
    program = targets.build(target, used)
    if used.fuzzer:
        outcome = targets.fuzz(target, program, 300, tmp_path / "corpus", tmp_path / "finds", seed=SEED, runs=RUNS)
        assert outcome.tried >= RUNS and outcome.edges > 500
    else:
        seeds.write_inputs(target, tmp_path / "seeds")
        outcome = targets.replay(target, program, sorted((tmp_path / "seeds").iterdir()))
    assert outcome.kind == "", outcome.log


def test_every_seed_is_a_valid_file_and_small():
    files = seeds.valid_files()
    assert len(files) > 15
    for data in files.values():
        assert len(data) <= seeds.LARGEST
        with athcodec.open(BytesIO(data), strict=True) as decoder:
            decoder.file.check(decode=not decoder.file.needs_host_mesh)


CLOCK = "if (!(frame > 0.0) || frame >= (double)file->info.frame_count) frame = 0.0;"
ALL_THERE = "return result != ATH_OK ? result : check_size(available, *needed, ATH_FIELD_PRELUDE_SIZE, fault);"
ROWS = "* sizeof *work->node.rows);\n    int valid"
MISTAKES = {
    "a length that is not checked": ("container/container.c", " || length > body->size - 7", "", "motion", "crash"),
    "a number that is not checked": (
        "streams/hierarchy.inl",
        "if (value < 0 || value >= count) return 0;",
        "if (value < 0) return 0;",
        "prelude",
        "crash",
    ),
    "memory that is not cleared": ("play/pieces.c", ROWS, "* 0);\n    int valid", "motion", "wrong"),
    "a prefix that is not checked": ("container/container.c", ALL_THERE, "return result;", "container", "wrong"),
    "a time that is not checked": ("play/play.c", CLOCK, "", "decode", "crash"),
}


@pytest.mark.slow
@pytest.mark.parametrize("file, correct, mistaken, target, kind", MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_in_the_core_is_noticed(file, correct, mistaken, target, kind, used, tmp_path):
    """Within minutes at most: what the targets promise can fail."""
    core = tmp_path / "core"
    shutil.copytree(targets.CORE, core)
    text = (core / file).read_text()
    assert text.count(correct) == 1
    (core / file).write_text(text.replace(correct, mistaken))
    program = targets.build(target, used, folder=tmp_path / "build", core=core)
    outcome = targets.fuzz(target, program, 180, tmp_path / "corpus", tmp_path / "finds", seed=SEED)
    assert outcome.kind == kind, outcome.log[-3000:]
    assert outcome.artifact is not None and outcome.artifact.stat().st_size <= seeds.LARGEST


def test_repairing_makes_checksums_fit_and_changes_nothing_else():
    """Python's way of repairing, which the runs on hostile files use, leaves a valid file as it is."""
    sys.path.append(str(ROOT))
    from spec.robust.hostile import repaired

    for data in seeds.valid_files().values():
        assert repaired(data) == data
        damaged = data[:12] + b"????" + data[16:]
        assert repaired(damaged) == data


@pytest.mark.slow
def test_the_corpus_reaches_nearly_every_line_of_the_decoder(tmp_path):
    """After half a minute for each target, from the seeds alone."""
    used = targets.compiler()
    for target in targets.TARGETS:
        targets.fuzz(target, targets.build(target, used), 30, tmp_path / target, tmp_path / "finds", seed=SEED)
    files = coverage.measure(tmp_path)
    assert files is not None, coverage.NO_CLANG
    assert coverage.total(files).share > 0.95, coverage.as_text(files)


@pytest.mark.parametrize("kind", sources.KINDS)
def test_readers_give_a_clip_or_one_line_in_a_short_run(kind):
    result = sources.blind(kind, 60, SEED, runs=60)
    assert result["tried"] == 60 and not result["failure"], result


def test_what_is_no_clip_and_no_line_is_a_find(tmp_path, monkeypatch):
    """What the runs on readers promise can fail."""
    data = sources.seeds("obj")[0]
    monkeypatch.setattr("athcodec.read", lambda path, **options: {}["a fault"])
    with pytest.raises(sources.Failed, match="a fault"):
        sources.attempt("obj", data, tmp_path)
