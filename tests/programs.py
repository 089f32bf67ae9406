"""Other programs for tests marked `programs`: found by an environment variable, or installed, once, in the user's cache
folder where that is not set."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import venv
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "athcodec-tests"


@cache
def blender_python() -> str:
    """A Python that has bpy: that of ATHCODEC_BLENDER, else one in a virtual environment made here."""
    return os.environ.get("ATHCODEC_BLENDER") or _environment("bpy", "bpy")


@cache
def vtk_python() -> str:
    """A Python that has vtk and pyvista: that of ATHCODEC_VTK, else one in a virtual environment made here."""
    return os.environ.get("ATHCODEC_VTK") or _environment("vtk", "vtk", "pyvista")


@cache
def raylib_library() -> Path:
    """The library of raylib that draws in software, in a folder with the headers that belong to it."""
    python = os.environ.get("ATHCODEC_RAYLIB") or _environment("raylib", "raylib-software")
    script = "import importlib.util as u; print(u.find_spec('raylib').submodule_search_locations[0])"
    [library] = Path(run_script(python, script).splitlines()[-1]).glob("_raylib_cffi.*.so")
    return library


def raylib_version() -> str:
    """The version of the package that raylib_library is of."""
    python = os.environ.get("ATHCODEC_RAYLIB") or _environment("raylib", "raylib-software")
    return run_script(python, "from importlib.metadata import version; print(version('raylib-software'))").split()[-1]


@cache
def usd_plugin_python() -> str:
    """A Python that has USD and this repository's plugin for it, and never athcodec."""
    root = Path(__file__).parent.parent
    sources = sorted(path for folder in ("usd", "core") for path in (root / "athcodec" / folder).rglob("*.*"))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources if path.is_file())).hexdigest()
    return _environment("usd-plugin", str(root / "athcodec/usd"), "numpy", state=digest)


def printed(*words: object, code: int = 0, timeout: float = 600, **options: Any) -> str:
    """Return what a command prints, which has to end with the exit code `code`."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=timeout, **options)
    assert done.returncode == code, done.stdout[-2000:] + done.stderr[-4000:]
    return done.stdout


PEAK = """
import re, resource, sys
from pathlib import Path
def peak():
    status = Path("/proc/self/status")  # getrusage counts what the parent process had as well
    if status.exists():
        return int(re.search(r"VmHWM:\\s+(\\d+)", status.read_text())[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
"""
"""Text of a program of Python: a function that returns the largest resident memory of its process, in bytes."""


def peak_of(program: str, *words: object) -> int:
    """Return the largest resident memory, in bytes, of a process that runs the text of a program of Python."""
    return int(printed(sys.executable, "-c", f"{PEAK}\n{program}\nprint(peak())", *words))


def run_script(python: str, script: str, *arguments: object) -> str:
    return printed(python, "-c", script, *arguments)


def install_once(folder: Path, packages: str, install: Callable[[], object]) -> None:
    """Installs packages into a folder that has not got them yet; other processes of the tests wait for that."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder.parent / f"{folder.name}.lock").open("w") as lock:
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        installed = folder / "installed"
        if not installed.exists() or installed.read_text() != packages:
            install()
            installed.write_text(packages)


def _environment(name: str, *packages: str, state: str = "") -> str:
    folder = CACHE / f"{name}-{sys.version_info.major}.{sys.version_info.minor}"
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")

    def install() -> None:
        venv.create(folder, with_pip=True, clear=True)
        subprocess.run([python, "-m", "pip", "install", "-q", *packages], check=True)

    install_once(folder, " ".join([*packages, state]), install)
    return str(python)
