"""The codecs that are compared, by name: athcodec, the baselines, the programs, and custom ones.

A custom codec is named MODULE:NAME, an object or class of an importable module (codecs/__init__.py says what it must
provide). `fingerprint` identifies the code that made a result, so that the result is measured again when that code has
changed; comments, docstrings and layout do not count. Baselines use parts of athcodec: for them its version counts and
the C files of the entropy coder, not every change of its encoder.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType

import athcodec
from athcodec._library import library_path
from bench.codecs import Codec
from bench.codecs.coder import CORE, CORE_SOURCES
from bench.codecs.programs import lossless

SOURCES = (
    ("bench.codecs.ours", None),
    ("bench.codecs.programs", "PROGRAMS"),
    ("bench.codecs.baselines", "BASELINES"),
    ("bench.codecs.simple", "SIMPLE"),
)
OURS = "athcodec"
DISTRIBUTIONS = ("athcodec", "zstandard")
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def all_codecs() -> Iterator[Codec]:
    """Yield every codec of this benchmark, athcodec first, lossless ones last; modules are imported one by one."""
    for module, attribute in SOURCES:
        yield from _codecs_of(importlib.import_module(module), attribute)
    yield from lossless()


def _codecs_of(module: ModuleType, attribute: str | None) -> Iterator[Codec]:
    if attribute is None:
        values = [value for value in vars(module).values() if getattr(value, "kind", None) == OURS]
    else:
        values = getattr(module, attribute)
    yield from map(_instance, values)


def _instance(codec: Codec | type) -> Codec:
    return codec() if isinstance(codec, type) else codec


def is_lossless(codec: Codec) -> bool:
    return getattr(codec, "lossless", False)


def chosen(names: Iterable[str]) -> dict[str, Codec]:
    """Return codecs by name or as MODULE:NAME; without names all that are not lossless.

    Raises SystemExit for an unknown name.
    """
    names = list(names)
    return (
        {name: _named(name) for name in names}
        if names
        else {codec.name: codec for codec in all_codecs() if not is_lossless(codec)}
    )


def _named(name: str) -> Codec:
    """Return the codec with a name such as "athcodec", or an instance of the class that "MODULE:NAME" tells. Raise
    SystemExit with the known names if there is no such codec.
    """
    if ":" in name:
        module, _, attribute = name.partition(":")
        return _instance(getattr(importlib.import_module(module), attribute))
    codec_of_name = next((codec for codec in all_codecs() if codec.name == name), None)
    if codec_of_name is None:
        known = "; ".join(codec.name for codec in all_codecs())
        raise SystemExit(f"codec: got {name!r}; expected MODULE:NAME or one of: {known}")
    return codec_of_name


# ---- which code made a result ----


def fingerprint(codec: Codec) -> dict[str, str]:
    """Return versions and digests of what can change this codec's results."""
    package = getattr(codec, "package", None)
    versions = {name: _version(name) for name in (*DISTRIBUTIONS, *([package] if package else []))}
    versions["source"] = _digest(tuple(sorted(_bench_files(type(codec).__module__))))
    return versions | (fingerprint_of_athcodec() if codec.kind == OURS else {})


def fingerprint_of_athcodec() -> dict[str, str]:
    """Return its version, and a digest of its Python and of the compiled core."""
    return {"athcodec": f"{version('athcodec')} {_digest(tuple(sorted(_athcodec_files())))}"}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def _athcodec_files() -> set[Path]:
    """Yield Python of the encoder and decoder, and the compiled core, of the installed package."""
    package = Path(athcodec.__file__).parent
    return {
        library_path(),
        *(path for name in ("encoding", "decoding", "motion") for path in package.glob(f"{name}/**/*.py")),
    }


def _bench_files(module: str) -> set[Path]:
    """Return the paths of a module's source file, of the C files that it compiles, and of all codec modules that it
    imports, with their C files.
    """
    files: set[Path] = set()
    names = [module]
    while names:
        spec = _spec(names.pop())
        if spec is None or spec.origin is None or Path(spec.origin) in files:
            continue
        files.add(Path(spec.origin))
        if (beside := Path(spec.origin).with_suffix(".c")).exists():
            files |= _c_files([beside, *CORE_SOURCES])
        names += [name for name in _imports(Path(spec.origin)) if name.startswith("bench.codecs")]
    return files


def _c_files(sources: Iterable[Path]) -> set[Path]:
    """Return the paths of C files and of all headers of the core that they include, directly or through other
    headers.
    """
    files, waiting = set(), list(sources)
    while waiting:
        file = waiting.pop()
        if file not in files:
            files.add(file)
            folders = (file.parent, CORE, CORE / "include")
            near = (folder / name for name in INCLUDE.findall(file.read_text()) for folder in folders)
            waiting += [path.resolve() for path in near if path.exists()]
    return files


def _spec(name: str):
    try:
        return importlib.util.find_spec(name)
    except ModuleNotFoundError:  # `from bench.codecs import name` may name a function
        return None


def _imports(file: Path) -> list[str]:
    """Return the dotted names of all modules that a Python file imports, and of all names that it imports from
    modules.
    """
    names: list[str] = []
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return names


@lru_cache
def _digest(files: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + _code(file))
    return digest.hexdigest()[:12]


def _code(file: Path) -> bytes:
    """Return what decides the behaviour of a source file: of Python its code without comments, docstrings, imports and
    layout, of any other file all its bytes.
    """
    if file.suffix in (".c", ".h", ".inl"):
        return "".join(re.sub(r"/\*.*?\*/|//[^\n]*", "", file.read_text(), flags=re.DOTALL).split()).encode()
    if file.suffix != ".py":
        return file.read_bytes()
    tree = ast.parse(file.read_text())
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [statement for statement in body if not _is_docstring_or_import(statement)]
    return ast.dump(tree).encode()


def _is_docstring_or_import(statement: ast.stmt) -> bool:
    is_text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return is_text or isinstance(statement, (ast.Import, ast.ImportFrom))
