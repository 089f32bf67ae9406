"""Which codecs take part: athcodec, the baselines and the programs, by name, and a codec of one's own.

A codec of one's own is named MODULE:NAME, an object or class of a module on the path (see codecs/__init__.py
for what it has to offer). `fingerprint` says which code made a result, so that it is measured again when that
has changed. Baselines use parts of athcodec: for them its version counts, and not each change of its code.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
from collections.abc import Iterable, Iterator
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType

import athcodec
from athcodec._library import library_path
from bench.codecs import Codec
from bench.codecs.programs import lossless

SOURCES = (("bench.codecs.ours", None), ("bench.codecs.programs", "PROGRAMS"),
           ("bench.codecs.baselines", "BASELINES"))
OURS = "athcodec"
DISTRIBUTIONS = ("athcodec", "numpy", "zstandard")


def all_codecs() -> Iterator[Codec]:
    """Every codec of this benchmark, athcodec first, lossless ones last; modules are imported in turn."""
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
    """Codecs by name or as MODULE:NAME; none named: all that are not lossless.

    Raises SystemExit for a name that there is not.
    """
    names = list(names)
    return {name: _named(name) for name in names} if names else {
        codec.name: codec for codec in all_codecs() if not is_lossless(codec)}


def _named(name: str) -> Codec:
    if ":" in name:
        module, _, attribute = name.partition(":")
        return _instance(getattr(importlib.import_module(module), attribute))
    found = next((codec for codec in all_codecs() if codec.name == name), None)
    if found is None:
        known = "; ".join(codec.name for codec in all_codecs())
        raise SystemExit(f"codec: got {name!r}; expected MODULE:NAME or one of: {known}")
    return found


# ---- which code made a result ----


def fingerprint(codec: Codec) -> dict[str, str]:
    """Versions and digests of what can change this codec's results."""
    package = getattr(codec, "package", None)
    versions = {name: _version(name) for name in (*DISTRIBUTIONS, *([package] if package else []))}
    versions["source"] = _digest(tuple(sorted(_bench_files(type(codec).__module__))))
    return versions | (fingerprint_of_athcodec() if codec.kind == OURS else {})


def fingerprint_of_athcodec() -> dict[str, str]:
    """Its version, and a digest of its Python and of the compiled core."""
    return {"athcodec": f"{version('athcodec')} {_digest(tuple(sorted(_athcodec_files())))}"}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def _athcodec_files() -> set[Path]:
    """Python and the compiled core of the installed package."""
    return {library_path(), *Path(athcodec.__file__).parent.glob("*.py")}


def _bench_files(module: str) -> set[Path]:
    """The file of a module, of the C beside it, of the codecs' modules that it imports, and so on."""
    files: set[Path] = set()
    names = [module]
    while names:
        spec = _spec(names.pop())
        if spec is None or spec.origin is None or Path(spec.origin) in files:
            continue
        files |= {file for file in (Path(spec.origin), Path(spec.origin).with_suffix(".c")) if file.exists()}
        names += [name for name in _imports(Path(spec.origin)) if name.startswith("bench.codecs")]
    return files


def _spec(name: str):
    try:
        return importlib.util.find_spec(name)
    except ModuleNotFoundError:  # `from bench.codecs import name` may name a function
        return None


def _imports(file: Path) -> list[str]:
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
        digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()[:12]
