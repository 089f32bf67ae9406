"""Finding and loading the C core that the build puts into this package. Every directory of the package is searched,
because an editable install keeps the built library in site-packages. The bindings are in _native.py."""

from __future__ import annotations

import ctypes
import sys
from importlib.util import find_spec
from pathlib import Path

_SUFFIX = {"win32": ".dll", "cygwin": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
LIBRARY_NAME = f"libath{_SUFFIX}"


def library_path() -> Path:
    """Return the path of the C core's shared library.

    Raises ImportError if no directory of the package holds it.
    """
    package = __package__ or "athcodec"
    spec = find_spec(package)
    directories = [Path(__file__).parent, *map(Path, (spec and spec.submodule_search_locations) or ())]
    for directory in directories:
        candidate = directory / LIBRARY_NAME
        if candidate.is_file():
            return candidate
    looked_in = ", ".join(dict.fromkeys(map(str, directories)))
    raise ImportError(f"athcodec's C core is missing: no {LIBRARY_NAME} in {looked_in}; pip install builds it")


def load_library() -> ctypes.CDLL:
    """Return the C core as a ctypes library.

    Raises ImportError if it is missing or the system refuses to load it.
    """
    path = library_path()
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise ImportError(f"athcodec's C core cannot be loaded: {path}: {error}") from error
