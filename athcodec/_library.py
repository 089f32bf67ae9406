"""Finding and loading the C core, which installing the package builds. The bindings are in _native.py.

The library lies beside this file in an installed package. If Python runs the sources of a clone, it lies in the
installed package: an editable install puts it there, and in the clone's folder the sources hide that package.
"""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

from athcodec import __version__

_SUFFIX = {"win32": ".dll", "cygwin": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
LIBRARY_NAME = f"libath{_SUFFIX}"
_RUNNING = Path(__file__).parent
BINDINGS = "_native.py"  # The module whose signatures have to be those of the library.


def library_path() -> Path:
    """Return the path of the C core's shared library.

    Raise ImportError if it is missing, or was built for another version of the package than the running one.
    """
    if (beside := _RUNNING / LIBRARY_NAME).is_file():
        return beside
    # Only sources need this module, which takes long to import.
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        installed = distribution("athcodec")
    except PackageNotFoundError:
        raise ImportError(
            f"athcodec's C core is missing: got no {LIBRARY_NAME} in {_RUNNING}, whose Python runs, and no athcodec "
            f"installed for {sys.executable}; {_advice(_RUNNING)}"
        ) from None
    path = Path(str(installed.locate_file("athcodec"))) / LIBRARY_NAME
    if not path.is_file():
        raise ImportError(
            f"athcodec's C core is missing: got no {LIBRARY_NAME} in {_RUNNING}, whose Python runs, nor in "
            f"{path.parent}, where athcodec {installed.version} is installed; {_advice(path.parent)}"
        )
    if installed.version != __version__:
        raise misfit(path, f"got version {installed.version}, expected {__version__}")
    bindings = path.with_name(BINDINGS)  # An editable install has none.
    if bindings.is_file() and bindings.read_bytes() != (_RUNNING / BINDINGS).read_bytes():
        raise misfit(path, f"got a library that was installed with another {BINDINGS}")
    return path


def load_library() -> ctypes.CDLL:
    """Return the C core as a ctypes library.

    Raises ImportError if it is missing or the system refuses to load it.
    """
    path = library_path()
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise ImportError(f"athcodec's C core cannot be loaded: {path}: {error}") from error


def misfit(path: str | Path, reason: str) -> ImportError:
    """Return the error for a library that is not of the Python that runs."""
    return ImportError(
        f"athcodec's C core {path} does not fit {_RUNNING}, whose Python runs: {reason}; {_advice(Path(path).parent)}"
    )


def _advice(installed: Path) -> str:
    """Return what to do, in words. `installed` is the folder of the library, as far as there is one."""
    clone = _RUNNING.parent
    if not (clone / "pyproject.toml").is_file():
        return "install athcodec again"
    editable = "" if installed == _RUNNING or (installed / BINDINGS).is_file() else "-e "
    return f'`{sys.executable} -m pip install {editable}"{clone}"` builds it'
