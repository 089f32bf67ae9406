"""The examples of README.md and docs/ do what they say, and the reference of the Python API is complete.

Blocks marked `sh`, `python`, `c` and `js` are run as they stand, in the order of their page; `bash` marks commands that
install something or take long, which are not; those of the README are run by `.ci/readme` where nothing is installed.
Blocks marked `py` take packages that athcodec does without: `-m programs` runs them.
"""

from __future__ import annotations

import dataclasses
import doctest
import json
import os
import pydoc
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import athcodec
from athcodec import cli
from athcodec._library import library_path
from athcodec.sources import read_hdf5, sample_path

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FRAMES = 50  # Of the sample's motion, as many as the examples name.
SERVES = re.compile(r"athcodec view (?!.*--export)")  # runs until it is interrupted


def blocks(page: Path, *languages: str) -> list[tuple[str, str]]:
    """(language, text) of the blocks of code in these languages."""
    found = re.findall(r"^```(\w+)\n(.*?)^```$", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    return [(language, text) for language, text in found if language in languages]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The files that the examples start from."""
    from test_usd import add_grid, add_leaves, new_stage  # here, because USD takes long to import

    from bench.trees.mesh import Tubes
    from bench.trees.ride import Skeleton

    folder = tmp_path_factory.mktemp("examples")
    with read_hdf5(sample_path()) as sample:
        clip = sample.replace(positions=sample.block(0, FRAMES), time=sample.time[:FRAMES])
        athcodec.write(clip, folder / "tree.h5")
        athcodec.encode(clip, folder / "tree.ath", effort="fast")
        clip.attributes["slack"] = np.ones(clip.vertex_count, np.float32)
        athcodec.write(clip, folder / "tree.usdc")
        athcodec.write(clip, folder / "tree.glb")
        for name, frames in {"calm": slice(0, 36), "gale": slice(60, 96), "storm": slice(60, 96)}.items():
            motion = dataclasses.replace(
                sample, positions=sample.positions[frames], time=sample.time[frames], rest=clip.rest.astype(np.float32)
            )
            athcodec.write(motion, folder / f"{name}.h5")
            athcodec.write(motion, folder / f"{name}.abc")
        for number, sides in enumerate((5, 4, 3)):
            tubes = Tubes(Skeleton.of(clip, 1), sides)
            lod = athcodec.MotionClip(tubes.at(clip.rest)[None], [0.0], faces=tubes.faces, metadata={"unit": "m"})
            athcodec.write(lod, folder / f"lod{number}.glb")
    stage = new_stage(folder / "forest.usda")
    add_grid(stage)
    add_leaves(stage)
    stage.Save()
    return folder


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=page.stem, marks=[] if page.stem == "README" else [pytest.mark.formats])
        for page in PAGES
        if blocks(page, "sh", "python")
    ],
)
def test_commands_and_python_of_a_page_run(page, files, tmp_path, monkeypatch):
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    names = {}
    for language, text in blocks(page, "sh", "python"):
        if language == "python":
            exec(compile(text, page.name, "exec"), names)
        for line in text.splitlines() if language == "sh" else ():
            program, *args = shlex.split(line, comments=True)
            assert program == "athcodec"
            assert SERVES.match(line) or cli.main(args) == 0, line
    if page.stem == "python":
        assert names["frame"].shape == (1001, 3) and names["block"].shape == (48, 1001, 3)
        assert names["maps"].shape[1:] == (3, 4)


def test_the_program_that_runs_the_readme_in_a_fresh_clone_leaves_no_block_out_without_a_word():
    script = runpy.run_path(str(ROOT / ".ci" / "readme"))["script"]
    readme, command = (ROOT / "README.md").read_text("utf-8"), blocks(ROOT / "README.md", "bash")[-1][1].strip()
    runs = script(readme, "/a clone", command)
    assert "git clone -q '/a clone' athcodec" in runs and command not in runs and "runs elsewhere" in runs
    for language, text in blocks(ROOT / "README.md", "bash", "python")[:-1]:
        assert text.replace("git clone ADDRESS", "git clone -q '/a clone'") in runs, language
    for wrong in ("```js\n1\n```\n", "\n\n    athcodec demo\n", "git clone ADDRESS\n", "```\nathcodec demo\n```\n"):
        with pytest.raises(SystemExit, match=r"README\.md.*: got .*, expected"):
            script(readme + wrong, "/a clone", command)
    with pytest.raises(SystemExit, match="expected the command that runs elsewhere"):
        script(readme, "/a clone", "make test")


@pytest.mark.programs
def test_the_examples_with_packages_that_athcodec_does_not_need_run(files, tmp_path, monkeypatch):
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    for _, text in blocks(ROOT / "docs" / "python.md", "py"):
        exec(compile(text, "python.md", "exec"), {})
    assert Path("tree.gif").stat().st_size and Path("half.ath").stat().st_size


def test_sizes_and_times_stand_only_in_what_is_written_from_stored_results():
    """The gallery's are compared by the next test; code may hold options."""
    written_or_code = r"<!-- (\S+): written by.*?<!-- end of \1 -->|^```.*?^```|`[^`\n]*`"
    for page in PAGES:
        prose = re.sub(written_or_code, "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
        stated = re.findall(r"\b\d[\d,.]* ?(?:[kM]B|ms|times (?:its?|as|smaller|larger|faster)) .*", prose)
        assert not stated or page.name == "gallery.md", page


def test_the_gallery_states_the_figures_and_the_bounds_of_its_files():
    text = " ".join(re.sub(r"<!--.*?-->", "", (ROOT / "docs" / "gallery.md").read_text("utf-8")).split())
    stated = re.findall(r'<ath-viewer src="([^"]+)"[^>]*>.*?<p>[^<]*: ([^<]*?) ?</p>', text)
    assert len(stated) == 5
    for source, figures in stated:
        path = ROOT / "docs" / source
        with athcodec.open(path) as decoder:
            frames, size = decoder.file.frame_count, path.stat().st_size / 1000
            points, bound = (
                f"{decoder.file.vertex_count:,} points",
                f"within {1000 * decoder.file.levels[-1].max_error:.2g} mm",
            )
            assert figures == f"{points}, {frames} frames, {size:.{1 if size < 10 else 0}f} kB, {bound}"


def run(*command, **options):
    return subprocess.run(list(map(str, command)), capture_output=True, check=True, timeout=120, **options).stdout


@pytest.fixture
def c_program(tmp_path):
    """A function that compiles a program of docs/c-api.md, by its number, and runs it on a file."""

    def run_it(number: int, path: Path) -> str:
        (tmp_path / "example.c").write_text(blocks(ROOT / "docs" / "c-api.md", "c")[number][1])
        library, flags = (
            library_path(),
            ("-std=c11", "-Wall", "-Wextra", "-Werror", "-I", ROOT / "athcodec" / "core" / "include"),
        )
        linked = (library, f"-Wl,-rpath,{library.parent}", "-lm")
        run("cc", *flags, "example.c", *linked, "-o", "example", cwd=tmp_path)
        return run(tmp_path / "example", path, text=True)

    return run_it


def test_the_c_program_with_a_player_shows_the_positions_of_python(files, c_program):
    x, y, z = map(float, re.findall(r"-?\d+\.\d+", c_program(0, files / "tree.ath")))
    with athcodec.open(files / "tree.ath") as decoder:
        frame = (299 / 60) % (decoder.time[-1] - decoder.time[0] + 1 / 30) * 30  # the frame of the last drawn one
        source = np.flatnonzero(decoder.file.vertex_branch == np.flatnonzero(decoder.file.branch_parent < 0)[0])[0]
        around = decoder.positions()[[int(frame), (int(frame) + 1) % decoder.frame_count]][:, source]
    assert (around.min(axis=0) - 1e-5 <= (x, y, z)).all() and ((x, y, z) <= around.max(axis=0) + 1e-5).all()


def test_the_c_program_shows_a_coarse_level_at_a_distance(files, c_program):
    shown = c_program(1, files / "tree.ath")
    found = re.fullmatch(r"level (\d+): (\d+) matrices, (\d+) exact vertices\n", shown)
    level, matrices, exact = map(int, found.groups())
    with athcodec.open(files / "tree.ath") as decoder:
        assert 0 < level < decoder.file.deepest and (matrices, exact) == (0, 1001)


def test_the_javascript_program_has_the_positions_of_python(files, tmp_path):
    (_, player), (_, text) = blocks(ROOT / "docs" / "webassembly.md", "js")
    viewer = ROOT / "athcodec" / "viewer"
    module = (viewer / "ath_decoder.mjs").as_uri()
    given = (
        "import { readFileSync } from 'node:fs';\n"
        "const bytes = new Uint8Array(readFileSync(process.argv[2]));\n"
        "const [distance, fov, height, seconds] = [0.01, 1, 1080, 1];\n"
    )  # so near that all detail is shown
    (tmp_path / "example.mjs").write_text(
        given + text.replace("./ath_decoder.mjs", module) + "process.stdout.write(new Uint8Array(positions.buffer));\n"
    )
    shown = run("node", tmp_path / "example.mjs", files / "tree.ath")
    with athcodec.open(files / "tree.ath") as decoder:
        assert shown == decoder.positions(30).tobytes()
    copied = (viewer / "examples" / "plant.js").read_text("utf-8").replace("athcodec-three/decoder", module)
    (tmp_path / "plant.js").write_text(copied)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    draw = "const draw = (triangles, positions) => console.log(triangles.length, positions.length);\n"
    at_once = player.replace("'tree.ath'", "bytes").replace("height }", "height, budget: 60_000 }")
    (tmp_path / "example.mjs").write_text(given + draw + at_once)
    assert run("node", tmp_path / "example.mjs", files / "tree.ath") == b"0 3003\n"


def test_the_report_on_tiers_of_tests_is_that_of_the_stored_results():
    from spec.tiers import as_markdown

    results = json.loads((ROOT / "spec" / "tiers.json").read_text())
    assert (ROOT / "spec" / "tiers.md").read_text() == as_markdown(results)


def test_the_report_on_robustness_is_that_of_the_stored_results_and_names_the_commit_of_each():
    from spec.robustness import as_markdown

    results = json.loads((ROOT / "spec" / "robustness.json").read_text())
    text = (ROOT / "spec" / "robustness.md").read_text()
    assert text == as_markdown(results)
    assert len(re.findall(r"^\d+ s, commit \(?[0-9a-f]{8}\)?( \+ uncommitted changes)?, ", text, re.M)) == len(results)


def test_the_reference_has_every_public_name():
    text = (ROOT / "docs" / "python-reference.md").read_text("utf-8")
    assert set(re.findall(r"^::: athcodec\.(?:\w+\.)?(\w+)$", text, re.MULTILINE)) == set(athcodec.__all__)


@pytest.mark.parametrize("name", athcodec.__all__)
def test_every_public_name_has_an_example_that_runs(name):
    """In its docstring, or else below its name in the reference, whose examples run with those of all pages."""
    names = {"athcodec": athcodec, "np": np}
    [example] = doctest.DocTestFinder(recurse=False).find(getattr(athcodec, name), name, globs=names)
    result = doctest.DocTestRunner().run(example)
    reference = (ROOT / "docs" / "python-reference.md").read_text("utf-8")
    assert result.failed == 0
    assert result.attempted or re.search(
        rf"^::: athcodec\.{name}\n\n```python\n[^`]*\b{name}\b", reference, re.MULTILINE
    )


def test_the_help_of_encode_fits_on_a_page():
    assert len(pydoc.render_doc(athcodec.encode, renderer=pydoc.plaintext).splitlines()) <= 66


USER = """
from pathlib import Path

import numpy as np
import numpy.typing as npt

import athcodec


def shown(positions: npt.NDArray[np.float32], path: Path) -> npt.NDArray[np.float32]:
    summary = athcodec.encode(positions, path, fps=24, unit="m", rel_error=1e-3, ladder=(1e-2,))
    data = athcodec.encode(str(path), max_error="1cm", target_size=None, tam=athcodec.Thresholds("1mm", 0, 0.1, 0))
    with athcodec.open(data) as decoder, athcodec.open(memoryview(data), clip="calm") as calm:
        frames, vertices, three = decoder.shape
        largest = max(float(frame.max()) for frame in decoder.at_level(0))
        errors = athcodec.compare(decoder[10:20, ::2], calm)
        doubled, mean, turned = decoder * 2 - positions, decoder.mean(axis=0), decoder.T
        near = decoder.at_level(decoder.level_within("5cm"))
        print(np.abs(doubled).max(), mean.shape, turned.shape, (near == decoder).all(), near.nbytes)
        print(summary.ratio, len(data), frames * vertices * three, largest, np.asarray(decoder).mean())
        print(errors.max_error.max(axis=1), decoder.levels[0].max_error, decoder.positions([1, 2], level=0).shape)
        return decoder.at(0.5)
"""
CHECKERS = {"mypy": ["--strict", "--follow-imports=silent"], "pyright": []}


@pytest.mark.formats
@pytest.mark.parametrize("checker", ["mypy", pytest.param("pyright", marks=pytest.mark.tools)])
def test_a_type_checker_finds_nothing_in_the_script_of_a_user_and_its_mistakes_in_another(checker, tmp_path):
    (tmp_path / "pyrightconfig.json").write_text(
        json.dumps({"extraPaths": [str(ROOT)], "typeCheckingMode": "standard"})
    )
    mistakes = {"rel_error=1e-3": "rel_eror=1e-3", "path, fps": "5, fps", "at_level(0)": "at_level('fine')"}
    scripts = {"user": USER} | {f"mistake_{i}": USER.replace(*words) for i, words in enumerate(mistakes.items())}
    for name, text in scripts.items():
        (tmp_path / f"{name}.py").write_text(text)
    command = [sys.executable, "-m", checker, *CHECKERS[checker], *(f"{name}.py" for name in scripts)]
    environment = os.environ | {"MYPYPATH": str(ROOT), "MYPY_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment)
    wrong = set(re.findall(r"(\w+)\.py:\d+.* error: ", done.stdout))
    assert done.returncode and wrong == scripts.keys() - {"user"}, done.stdout + done.stderr
