"""The package is built as its folders say: decoding stands without what only an encoder needs."""

from __future__ import annotations

import ast
import re
import shutil
import sys
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatch
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from programs import printed

ROOT = Path(__file__).resolve().parent.parent
DECODING = (
    "athcodec",
    "athcodec.decoding.decoder",
    "athcodec.decoding.container",
    "athcodec.truncation",
    "athcodec.exporters",
)


@pytest.mark.parametrize("module", DECODING)
def test_decoding_imports_nothing_of_encoding(module):
    program = f"import sys, {module}; print([name for name in sys.modules if name.startswith('athcodec.encoding')])"
    assert printed(sys.executable, "-c", program).strip() == "[]"


def test_the_picture_of_the_floors_shows_the_contract_that_imports_are_checked_by():
    """Each line of the contract is a line of CONTRIBUTING.md, in the same order, with the same modules side by side."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["name"] == "floors")
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    picture = re.search(r"^```text\n(   cli .*?)^```", text, re.M | re.S).group(1)
    shown = [
        re.split(r"\s{4,}", line.strip())[0]
        for line in picture.splitlines()
        if line.startswith("   ") and line[3] != " "
    ]
    assert [re.findall(r"\w+", line.replace("core/", "")) for line in shown] == [
        re.findall(r"\w+", layer) for layer in layers
    ]


CORE = ROOT / "athcodec" / "core"
FLOORS = ("include", "bits", "container", "model", "streams", "file", "play", "gpu", "encode")
"""Folders of the C core. Each may include, and call, only itself and those before it."""
DECLARATION = re.compile(r"^\w[^(\n]*\b(ath_\w+)\([^;{}]*\);", re.M)
SHARED_HEADERS = ("encode/encode.h", "file/file.h")  # Each declares functions of several C files of its folder.


def broken_rules_of_the_core(core: Path) -> list[str]:
    """What a copy of the core breaks: floors, cycles between files, places of functions, include guards.

    A C file and its header count as one. Calls count as includes do, so that ath.h hides no cycle.
    """
    broken, uses, defined, declared = [], {}, {}, []
    names = [str(path.relative_to(core)) for folder in FLOORS for path in sorted((core / folder).rglob("*.*"))]
    texts = {name: re.sub(r"/\*.*?\*/", "", (core / name).read_text("utf-8"), flags=re.S) for name in names}
    texts = {name: text.split("#ifdef ATH_PLAYER_IMPLEMENTATION")[0] for name, text in texts.items()}

    def unit(name: str) -> str:
        return name if name in SHARED_HEADERS or name.endswith(".inl") else re.sub(r"\.[ch]$", "", name)

    for name, text in texts.items():
        uses.setdefault(unit(name), set())
        defined |= dict.fromkeys(re.findall(r"^\w(?![^(\n]*=)[^(\n]*\b(ath_\w+)\([^;{}]*\)\s*\{", text, re.M), name)
        if not name.endswith(".c"):
            declared += [(function, name) for function in re.findall(DECLARATION, text)]
            guard = (
                "ATH_" + re.sub(r"\W", "_", name).upper() if "include/" not in name else Path(name).stem.upper() + "_H"
            )
            broken += [f"{name}: no guard {guard}"] * (f"#ifndef {guard}\n#define {guard}\n" not in text)
    for name, text in texts.items():
        for header in re.findall(r'^#include "([\w/]+\.\w+)"', text, re.M):
            uses[unit(name)].add(unit(header if "/" in header else f"include/{header}"))
        calls = re.findall(r"\b(ath_\w+)\(", re.sub(DECLARATION, "", text))
        uses[unit(name)] |= {unit(defined[call]) for call in calls if call in defined}
    for user, used in uses.items():
        used.discard(user)
        floor = FLOORS.index(user.split("/")[0])
        broken += [f"{user} uses {other}" for other in used if FLOORS.index(other.split("/")[0]) > floor]
    for function, header in declared:
        if header.startswith("include/"):
            continue
        file, wanted = defined.get(function, ""), Path(header)
        here = Path(file).parent == wanted.parent if header in SHARED_HEADERS else file == str(wanted.with_suffix(".c"))
        broken += [f"{header} declares {function} of {file or 'no file'}"] * (not here)
    try:
        TopologicalSorter(uses).prepare()
    except CycleError as error:
        broken.append(" uses ".join(reversed(error.args[1])))
    return broken


FORBIDDEN_IN_C = {
    "bits/crc32c.c": '#include "model/plan.h"',
    "container/refuse.c": "int f(void) { return ath_prepare_step(0, 0); }",
    "model/plan.c": "void f(void) { ath_move(0, 0, 0); }",
    "model/mesh.h": "void ath_move(int frames);",
    "streams/rest.inl": '#include "streams/source_rest.inl"',
}


@pytest.mark.parametrize("file", [None, *FORBIDDEN_IN_C])
def test_a_file_of_the_core_that_uses_a_floor_above_or_stands_in_a_circle_breaks_its_rules(file, tmp_path):
    core = tmp_path / "core"
    shutil.copytree(CORE, core)
    if file is not None:
        with open(core / file, "a", encoding="utf-8") as text:
            text.write(f"\n{FORBIDDEN_IN_C[file]}\n")
    assert bool(broken_rules_of_the_core(core)) == (file is not None), broken_rules_of_the_core(core)


@pytest.mark.parametrize("words", [["--version"], ["--help"], ["encode", "--help"]])
def test_the_command_line_explains_itself_without_what_its_verbs_work_with(words):
    """NumPy alone takes longer to import than all of that."""
    program = f"""
import sys
from athcodec.cli import main
try:
    main({words})
except SystemExit:
    heavy = {{"numpy", "h5py", "scipy", "rich", "zstandard", "importlib.metadata"}}
    print("imported:", sorted(heavy & set(sys.modules)))
"""
    assert printed(sys.executable, "-c", program).splitlines()[-1] == "imported: []"


def test_the_package_names_all_that_it_gives_before_any_of_it_is_imported():
    program = """
import sys, athcodec
assert set(athcodec.__all__) <= set(dir(athcodec)) and "numpy" not in sys.modules
assert athcodec.truncate is athcodec.truncate and callable(athcodec.truncate)
print([name for name in athcodec.__all__ if getattr(athcodec, name, None) is None])
"""
    assert printed(sys.executable, "-c", program).strip() == "[]"


LARGEST = {"module": (600,), "class": (300, 25), "function": (60, 6)}
"""Lines, and then methods of a class or arguments of a function that may be passed without a name."""


def statements(node: ast.AST) -> list[ast.AST]:
    """Return what stands directly in a node but expressions, which are most of a tree and define nothing with lines."""
    return [part for part in ast.iter_child_nodes(node) if not isinstance(part, ast.expr)]


def definitions(part: ast.AST) -> Iterator[ast.ClassDef | ast.FunctionDef]:
    """Yield the classes and functions of a part, itself among them."""
    if isinstance(part, (ast.ClassDef, ast.FunctionDef)):
        yield part
    for inner in statements(part):
        yield from definitions(inner)


def lines_without_docstrings(part: ast.ClassDef | ast.FunctionDef) -> int:
    """Return the lines of a class or function, without the docstrings of it and of what is in it."""
    texts = (ast.get_docstring(one, clean=False) for one in definitions(part))
    return part.end_lineno - part.lineno + 1 - sum(text.count("\n") + 1 for text in texts if text is not None)


def large_parts(tree: ast.Module, module: str) -> set[str]:
    """Return the names of a module and of what is in it that are larger than `LARGEST`."""
    large = {module} if tree.body and tree.body[-1].end_lineno > LARGEST["module"][0] else set()

    def look(node: ast.AST, place: str) -> None:
        for part in statements(node):
            name = f"{place}.{getattr(part, 'name', '')}"
            if isinstance(part, ast.ClassDef):
                sizes = lines_without_docstrings(part), sum(isinstance(one, ast.FunctionDef) for one in part.body)
                large.update({name} if sizes[0] > LARGEST["class"][0] or sizes[1] > LARGEST["class"][1] else ())
            elif isinstance(part, ast.FunctionDef):
                named = [one.arg for one in part.args.args if one.arg not in ("self", "cls")]
                sizes = lines_without_docstrings(part), len(named)
                large.update({name} if sizes[0] > LARGEST["function"][0] or sizes[1] > LARGEST["function"][1] else ())
            look(part, name if hasattr(part, "name") else place)

    look(tree, module)
    return large


def test_each_large_part_has_a_sentence_that_says_why_it_is_one():
    """And docs/large-parts.md, which holds these sentences, names no part that is not large, and the limits."""
    package, large = ROOT / "athcodec", set()
    for path in sorted(package.rglob("*.py")):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        large |= large_parts(ast.parse(path.read_text("utf-8")), module)
    text = (ROOT / "docs" / "large-parts.md").read_text("utf-8")
    rows = re.findall(r"^\| `([\w.]+)` \| (.+\.) \|$", text, re.M)
    assert {name for name, _ in rows} == large and len(rows) == len(large)
    limits = re.findall(r"^\| (module|class|function) \|(.*)\|$", text, re.M)
    assert {name: tuple(map(int, re.findall(r"\d+", row))) for name, row in limits} == LARGEST


def test_a_part_that_grows_beyond_its_size_is_large():
    lines = "\n".join(f"    {number}" for number in range(60))
    assert large_parts(ast.parse(f"def short(a, b, c, d, e, f, *, g):\n{lines[:-7]}"), "m") == set()
    assert large_parts(ast.parse(f"class A:\n def long(self):\n{lines}\n    60"), "m") == {"m.A.long"}
    assert large_parts(ast.parse("def many(a, b, c, d, e, f, g): ..."), "m") == {"m.many"}
    assert large_parts(ast.parse("class A:\n" + " def f(self): ...\n" * 26), "m") == {"m.A"}
    assert large_parts(ast.parse("0\n" * 601), "m") == {"m"}


def test_the_benchmark_imports_nothing_that_a_wheel_leaves_out():
    """`python -m bench` measures the athcodec that is installed, which need not be an editable one."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["scikit-build"]["wheel"]
    code = "".join(path.read_text("utf-8") for path in (ROOT / "bench").rglob("*.py"))
    files = {name.replace(".", "/") + ".py" for name in re.findall(r"^ *(?:from|import) (athcodec[\w.]*)", code, re.M)}
    assert {file for file in files if any(fnmatch(file, pattern) for pattern in settings["exclude"])} == set()
