"""What runs whole tiers of the tests: every file ends, and what came of it is stored."""

from __future__ import annotations

import json

import pytest

from spec import tiers

pytestmark = pytest.mark.tools


@pytest.fixture
def ran(monkeypatch, tmp_path):
    """A function that runs a tier of one file of tests, and returns the exit code, what is stored, and where."""

    def run(text: str, limit: float):
        (tmp_path / "tests").mkdir()
        (tmp_path / "tests" / "test_a.py").write_text(text)
        (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\nmarkers = ['slow: s']\n")
        monkeypatch.setattr(tiers, "ROOT", tmp_path)
        code = tiers.main(["slow", "--limit", str(limit), "--out", str(tmp_path)])
        return code, json.loads((tmp_path / "tiers.json").read_text())["slow"]["files"]["tests/test_a.py"], tmp_path

    return run


MARKED = "import pytest, subprocess\npytestmark = pytest.mark.slow\n"


def test_a_test_that_never_ends_is_stopped_with_what_it_started_and_named(ran):
    text = MARKED + "def test_first(): pass\ndef test_endless(): subprocess.run(['sleep', '1000'])\n"
    code, result, folder = ran(text, 20)
    assert code == 1 and result["passed"] == 1
    assert result["stopped_in"] == "tests/test_a.py::test_endless"
    assert "stopped in `tests/test_a.py::test_endless`" in (folder / "tiers.md").read_text()


def test_what_passed_and_failed_is_counted_with_its_date_and_commit(ran):
    text = MARKED + "def test_good(): pass\ndef test_bad(): assert False\n@pytest.mark.skip\ndef test_left(): pass\n"
    code, result, folder = ran(text, 300)
    assert code == 1 and (result["passed"], result["failed"], result["skipped"]) == (1, 1, 1)
    assert result["not_passed"] == ["tests/test_a.py::test_bad"] and result["date"] and result["commit"]
    assert "| slow | 1 of 1 | 1 | 1 | 0 | 1 | 0 |" in (folder / "tiers.md").read_text()


def test_every_tier_of_the_tests_can_be_run():
    assert tiers.tiers() == "first sizes formats web tools vectors slow programs browser machines".split()
