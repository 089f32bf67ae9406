"""The clips that other programs make: the same whenever they are made, or a word on what is missing."""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path

import pytest

import athcodec
from bench import clips, data, foreign
from bench.data import digest
from bench.suite import cases

ROOT = Path(__file__).resolve().parent.parent

pytestmark = pytest.mark.tools


@pytest.mark.parametrize(
    ("name", "frames", "vertices"), [("shader_card_sapling", 100, 2440), ("lsystem_herb", 80, 880)]
)
def test_a_program_makes_the_same_clip_again_and_it_is_kept_with_its_recipe(name, frames, vertices, tmp_path):
    paths = [data.path_of(name, tmp_path / folder) for folder in ("one", "two")]
    assert digest(paths[0]) == digest(paths[1])
    with athcodec.read(paths[0]) as clip:
        assert (clip.frame_count, clip.vertex_count) == (frames, vertices)
    files = set((tmp_path / "one").iterdir())
    assert files == {*clips.files_of(paths[0]), tmp_path / "one" / f"{name}.recipe"}
    assert data._found_or_made(name, tmp_path / "one") == (paths[0], None)
    (tmp_path / "one" / f"{name}.recipe").write_text("another")
    assert data._found_or_made(name, tmp_path / "one")[1] is not None


def test_a_program_that_is_not_installed_is_named_with_the_line_that_installs_it(monkeypatch, tmp_path):
    monkeypatch.setattr(foreign, "find_spec", lambda name: None)
    monkeypatch.setenv(data.FOLDER_VARIABLE, str(tmp_path))
    words = "Helios: not installed, expected `pip install pyhelios3d usd-core`"
    with pytest.raises(foreign.MissingProgram, match=words):
        data.path_of("helios_bean_8d", tmp_path)
    result = data.run(argparse.Namespace(names=["helios_bean_8d"], suite=None, folder=tmp_path))
    assert result["tables"][0]["rows"] == [{"name": "helios_bean_8d", "made": f"MISSING: {words}"}]
    [case] = cases(["helios_bean_8d"], "foreign")
    assert case.path is None and words in case.description


def test_every_program_gives_a_clip_to_both_suites_and_the_extra_installs_all_that_they_need():
    suites = [{foreign.CLIPS[name].program for name in data.SUITES[suite]} for suite in ("foreign", "held-out")]
    assert suites == [set(foreign.PROGRAMS), set(foreign.PROGRAMS)]
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    installed = {line.partition(";")[0] for line in extras["bench-clips"] + extras["bench"]}
    assert {package for _, needs in foreign.PROGRAMS.values() for package in needs.values()} <= installed
