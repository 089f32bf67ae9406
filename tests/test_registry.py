"""Formats of other packages are read and written beside athcodec's own, which come first and need no search."""

from __future__ import annotations

import json
import shutil
import sys
import tomllib
from importlib import invalidate_caches
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest
from programs import printed

import athcodec
from athcodec import batch, cli, exporters, sources
from athcodec.errors import ClipError, GuessWarning, MissingExtra, SourceWarning
from athcodec.files import kinds
from athcodec.sources.registry import registered

PLUGIN = Path(__file__).parent / "points_plugin"
GROUPS = {"athcodec.sources": sources, "athcodec.exporters": exporters}


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder of installed packages on sys.path, and a function that installs one: its folder with pyproject.toml, and
    files by name in place of the package's own."""
    folder, modules = tmp_path / "site", set(sys.modules)
    folder.mkdir()
    monkeypatch.syspath_prepend(folder)
    for name in ("_KINDS", "_PATTERNS"):  # What packages add to the kinds of files ends with the test.
        monkeypatch.setattr(kinds, name, dict(getattr(kinds, name)))

    def install(package: Path = PLUGIN, name: str = "athcodec-points", **files: str) -> None:
        project = tomllib.loads((package / "pyproject.toml").read_text())["project"]
        module = name.replace("-", "_")
        shutil.copytree(package / "athcodec_points", folder / module)
        for file, text in files.items():
            (folder / module / f"{file}.py").write_text(text)
        info = folder / f"{module}-{project['version']}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {project['version']}\n")
        groups = project["entry-points"].items()
        lines = [f"[{group}]\n{name} = {value}\n" for group, points in groups for value in points.values()]
        (info / "entry_points.txt").write_text("".join(lines).replace("athcodec_points", module))
        registered.cache_clear()
        invalidate_caches()

    registered.cache_clear()
    batch.inputs._clip_suffixes.cache_clear()
    yield install
    registered.cache_clear()
    batch.inputs._clip_suffixes.cache_clear()
    for module in set(sys.modules) - modules:
        if module.startswith(("athcodec_points", "athcodec_dots")):
            del sys.modules[module]


@pytest.fixture
def swaying():
    """Three points that go apart for four frames."""
    rest = np.array([[0, 0, 0], [0, 1, 0], [0.5, 2, 0]])
    return athcodec.MotionClip(rest * (1 + np.arange(4))[:, None, None] / 8, np.arange(4) / 30)


def test_a_format_of_another_package_is_written_read_and_encoded(site, swaying, tmp_path, capsys):
    site()
    path = tmp_path / "sway.points"
    assert athcodec.write(swaying, path).files == (path,)
    assert path.read_text().splitlines()[:6] == ["points 1", "4 3", "0", "0 0 0", "0 0.125 0", "0.0625 0.25 0"]
    path.rename(tmp_path / "sway.dat")  # It is known by its first bytes.
    for file, how in (("sway.dat", {}), ("sway.dat", {"format": "points"})):
        with athcodec.read(tmp_path / file, **how) as clip:
            np.testing.assert_array_equal(clip.block(0, 4), swaying.block(0, 4))
            np.testing.assert_array_equal(clip.time, swaying.time)
    ath, back = str(tmp_path / "sway.ath"), str(tmp_path / "back.points")
    assert cli.main(["encode", str(tmp_path / "sway.dat"), ath, "--max-error", "0.001", "--effort", "fast"]) == 0
    assert cli.main(["decode", ath, back]) == 0 and cli.main(["decode", ath, back]) == 0, "an older one is replaced"
    with athcodec.read(back) as clip:
        assert np.linalg.norm(clip.block(0, 4) - swaying.block(0, 4), axis=-1).max() <= 0.001
    (tmp_path / "other.points").write_bytes(Path(ath).read_bytes())
    with pytest.raises(FileExistsError, match="other.points: is there already"):
        athcodec.write(swaying, tmp_path / "other.points")
    assert [item.name for item in batch.find([tmp_path], tmp_path)] == ["back.points", "other.points"]
    capsys.readouterr()
    assert cli.main(["formats", "--json"]) == 0
    rows = {row["format"]: row for row in json.loads(capsys.readouterr().out)["formats"]}
    assert rows["points"]["package"] == "athcodec-points" and rows["points"]["reads"] == [".points"]
    assert rows["usd"]["package"] == "athcodec"


@pytest.mark.parametrize("group", GROUPS)
def test_formats_of_athcodec_are_an_entry_point_and_come_first_with_and_without_metadata(group, monkeypatch):
    own = GROUPS[group].FORMATS
    assert entry_points(group=group)["athcodec"].load() is own
    for installed in (entry_points(group=group), ()):
        registered.cache_clear()
        monkeypatch.setattr("importlib.metadata.entry_points", lambda group, installed=installed: installed)
        assert registered(group)[: len(own)] == own == tuple(GROUPS[group].formats())[: len(own)]
    registered.cache_clear()


def test_formats_of_athcodec_are_read_and_written_without_a_search_for_others(site, swaying, tmp_path):
    site(__init__="raise RuntimeError('it is not to be imported')")
    for name, how in (("a.npz", None), ("a.obj", None), ("b", "npz")):
        file, *_ = athcodec.write(swaying, tmp_path / name, how).files
        with athcodec.read(file, how) as clip:
            assert clip.frame_count == 4
    program = (
        f"import sys, athcodec; athcodec.read({str(tmp_path / 'a.npz')!r}); print('importlib.metadata' in sys.modules)"
    )
    assert printed(sys.executable, "-c", program).strip() == "False"


def test_names_and_suffixes_of_athcodec_are_its_own(site, swaying, tmp_path):
    site(
        __init__="from athcodec.sources import Format\n"
        'SOURCE = Format("npz", "mine", (".mine",), module="athcodec_points.text"), '
        'Format("points", "mine", (".npz", ".points"), magic=(b"PK",), module="athcodec_points.text")\n'
        "EXPORTER = SOURCE[1]\nMAGIC = b'points 1\\n'\n"
    )
    athcodec.write(swaying, tmp_path / "a.npz")
    athcodec.read(tmp_path / "a.npz").close()
    (tmp_path / "a.mine").write_text("points")
    with pytest.warns(
        SourceWarning, match="athcodec-points, .*'npz' is left out, because athcodec has one of that name"
    ):
        with pytest.raises(ClipError, match="unknown format"):
            athcodec.read(tmp_path / "a.mine")
    athcodec.write(swaying, tmp_path / "b.npz", "points")
    with athcodec.read(tmp_path / "b.npz", "points") as clip:
        assert clip.frame_count == 4


FORM = "from athcodec.sources import Format\nSOURCE = Format"


@pytest.mark.parametrize(
    "text, message",
    [
        ("import nowhere", "cannot be loaded: ModuleNotFoundError: No module named 'nowhere'; update or uninstall it"),
        ("SOURCES = 1", "cannot be loaded: AttributeError: .*SOURCE"),
        ("SOURCE = 3", "got 3, expected an athcodec.sources.Format"),
        (f"{FORM}('p', '', ('.p',))", "got Format.*, expected .* with suffixes .* and a module"),
        (f"{FORM}('p', '', ('p',), module='m')", "got Format.*, expected .* with suffixes .* and a module"),
    ],
)
def test_a_package_that_cannot_be_loaded_is_named_and_others_are_asked(text, message, site, tmp_path):
    site(name="athcodec-dots", __init__=text)
    site()
    (tmp_path / "a.points").write_text("points 1\n1 2\n0\n1 2 3\n4 5 6\n")
    with pytest.warns(SourceWarning, match=f"^athcodec-dots, entry point .* of athcodec.sources: {message}"):
        with athcodec.read(tmp_path / "a.points") as clip:
            assert clip.block(0, 1).tolist() == [[[1, 2, 3], [4, 5, 6]]]


def test_a_module_of_another_package_that_cannot_be_imported_is_an_error_that_names_it(site, swaying, tmp_path):
    site(text="import nowhere")
    with pytest.raises(
        ClipError, match="write_clip of athcodec_points.text cannot be imported: .*nowhere.*athcodec-poi"
    ):
        athcodec.write(swaying, tmp_path / "a.points")


def test_what_a_format_of_another_package_needs_is_installed_with_that_package(site, swaying, tmp_path):
    text = (PLUGIN / "athcodec_points" / "__init__.py").read_text()
    site(__init__=text.replace("module=", "needs=('nowhere',), module="))
    with pytest.raises(MissingExtra, match='needs nowhere: pip install "athcodec-points"'):
        athcodec.write(swaying, tmp_path / "a.points")


def test_of_two_packages_with_one_suffix_the_first_is_taken_and_the_other_named(site, swaying, tmp_path):
    text = (PLUGIN / "athcodec_points" / "__init__.py").read_text()
    site(name="athcodec-dots", __init__=text.replace('"points",', '"dots",').replace("magic=(MAGIC,), ", ""))
    site()
    with pytest.warns(
        GuessWarning, match="points is taken for dots of athcodec-dots, not for points of athcodec-points"
    ):
        athcodec.write(swaying, tmp_path / "a.points")
    with athcodec.read(tmp_path / "a.points") as clip:  # Its first bytes say which.
        assert clip.frame_count == 4
    with pytest.raises(ValueError, match="expected one of hdf5, .*dots, points"):
        athcodec.read(tmp_path / "a.points", "lines")


def test_the_code_that_the_documents_show_is_that_of_the_package():
    page = (PLUGIN.parents[1] / "docs" / "formats.md").read_text("utf-8")
    section = page[page.index("## Add a format without a fork") :].partition("\n## ")[0]
    package = [line for file in PLUGIN.rglob("*.[tp]*") for line in file.read_text("utf-8").splitlines()]
    shown = [line[4:] for line in section.splitlines() if line.startswith("    ")]
    assert len(shown) > 6 and set(shown) <= set(package)


@pytest.mark.programs
def test_the_package_of_the_tests_can_be_installed(tmp_path):
    """By pip, which takes its build backend from the index."""
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", tmp_path / "site"]
    printed(*pip, shutil.copytree(PLUGIN, tmp_path / "package"))
    program = f"import sys; sys.path.append({str(tmp_path / 'site')!r})\nfrom athcodec import sources\n"
    found = printed(sys.executable, "-c", f"{program}print([form.package for form in sources.formats()][-1])")
    assert found.strip() == "athcodec-points"
