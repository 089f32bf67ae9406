"""All packages of a release have one version, and the workflow runs the commands of the documents."""

from __future__ import annotations

import json
import re
from importlib import metadata
from pathlib import Path

import pytest

import athcodec

ROOT = Path(__file__).resolve().parent.parent
VIEWER = ROOT / "athcodec" / "viewer"


def first(pattern: str, place: str) -> str:
    """Return the first group of a pattern in a file of the repository, or "none"."""
    match = re.search(pattern, (ROOT / place).read_text("utf-8"), re.MULTILINE)
    return match[1] if match else "none"


def stated(place: str) -> list[str]:
    """Return the versions of athcodec that a file states."""
    if place == "installed package":
        return [metadata.version("athcodec")]
    if place.endswith(".json"):
        package = json.loads((ROOT / place).read_text("utf-8"))
        return [
            package["version"],
            *(held["version"] for name, held in package.get("packages", {}).items() if not name),
        ]
    patterns = {
        "CITATION.cff": r"^version: (\S+)$",
        "CHANGELOG.md": r"^## (\d\S*)",
        "docs/releasing.md": r"^git tag -s v(\S+)$",
    }
    return [first(patterns[place], place)]


@pytest.mark.parametrize(
    "place, times",
    [
        ("installed package", 1),
        ("CITATION.cff", 1),
        ("CHANGELOG.md", 1),
        ("docs/releasing.md", 1),
        ("athcodec/viewer/package.json", 1),
        ("athcodec/viewer/package-lock.json", 2),
    ],
)
def test_every_package_has_the_version_of_the_python_package(place, times):
    """CMake and pkg-config follow in test_smoke.py, the extension for Blender in test_blender.py. The plugin for USD
    and the header of the C library state no version of athcodec."""
    assert stated(place) == [athcodec.__version__] * times, f"{place} states another version than athcodec/__init__.py"


def test_the_workflow_runs_the_commands_of_the_documents():
    workflow = (ROOT / ".github" / "workflows" / "checks.yml").read_text("utf-8")
    runs = [line.split("run: ", 1)[1] for line in workflow.splitlines() if "run: " in line]
    assert ".ci/run" in runs
    releasing = (ROOT / "docs" / "releasing.md").read_text("utf-8")
    commands = [line for line in releasing.splitlines() if line.startswith(".venv/bin/")]
    assert len(commands) == 2 and set(commands) <= set(runs)
    of_readme = first(r"^(python3 -m venv \.venv && .*pytest -q)$", "README.md")
    of_workflow = [run.replace("${{ matrix.python }}", "python3").replace("${{ matrix.bin }}", "bin") for run in runs]
    assert f"{of_readme} --continue-on-collection-errors" in of_workflow


def test_every_file_that_the_npm_package_offers_is_packed():
    package = json.loads((VIEWER / "package.json").read_text("utf-8"))
    offered = [
        place
        for entry in package["exports"].values()
        for place in (entry.values() if isinstance(entry, dict) else [entry])
    ]
    for place in (Path(place.removesuffix("*")) for place in [*offered, package["main"], package["types"]]):
        assert (VIEWER / place).exists(), place
        assert str(place) == "package.json" or {str(place), place.parts[0]} & set(package["files"]), place
