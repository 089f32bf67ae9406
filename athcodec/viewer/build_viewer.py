"""Builds athcodec/viewer/web, the viewer and the loader as they ship, from src, page and ath_decoder.mjs.

The packages are those of package-lock.json, put into a cache folder by npm; esbuild makes the bundles, which are the
same on every machine.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import athcodec
from athcodec.viewer.still import still_svg

VIEWER = Path(__file__).resolve().parent
WEB = VIEWER / "web"
CACHE_VARIABLE = "ATHCODEC_VIEWER_CACHE"
DEFAULT_CACHE = Path("~/.cache/athcodec-viewer")
MOST_BYTES = 200_000
"""Of what is ours in the bundles, loader, worker with decoder and page, compressed by gzip as web hosts send them."""
MOST_PAGE_BYTES = 250_000
"""Of all that the page takes before its first picture, compressed by gzip: its own files and three.js."""
OURS = ("ath_worker.js", "viewer.js", "later.js")


class BuildError(Exception):
    """One line for the user."""


def modules() -> Path:
    """Return the folder with the packages of package-lock.json, which are installed first if they are not there yet."""
    lock = (VIEWER / "package-lock.json").read_bytes()
    cache = Path(os.environ.get(CACHE_VARIABLE) or DEFAULT_CACHE).expanduser() / hashlib.sha256(lock).hexdigest()[:16]
    folder = cache / "node_modules"
    if not (cache / "complete").exists():
        npm = shutil.which("npm")
        if npm is None:
            raise BuildError("npm: got none on PATH, expected Node.js 18 or newer with npm")
        cache.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(VIEWER / name, cache)
        _run([npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=cache)
        (cache / "complete").touch()
    return folder


def build(folder: Path) -> None:
    node = shutil.which("node")
    if node is None:
        raise BuildError("node: got none on PATH, expected Node.js 18 or newer")
    _run([node, str(VIEWER / "build.mjs"), str(folder)], env=os.environ | {"NODE_PATH": str(modules())})
    with athcodec.open(athcodec.sample_path("leafed")) as decoder:
        (folder / "still.svg").write_text(still_svg(decoder), "utf-8")


def _run(command: list[str], **options: Any) -> None:
    done = subprocess.run(command, capture_output=True, text=True, **options)
    if done.returncode != 0:
        last = (done.stderr.strip() or "no message").splitlines()[-1]
        raise BuildError(f"{Path(command[0]).name} {Path(command[1]).name}: got exit status {done.returncode}: {last}")


def differences(built: Path, committed: Path) -> list[str]:
    """Return names of the files that are not the same in both folders."""
    contents = [{path.name: path.read_bytes() for path in folder.glob("*")} for folder in (built, committed)]
    names = sorted(contents[0].keys() | contents[1].keys())
    return [name for name in names if contents[0].get(name) != contents[1].get(name)]


def own_bytes(folder: Path) -> int:
    return sum(len(gzip.compress((folder / name).read_bytes())) for name in OURS)


def main() -> int:
    """Build the viewer's folder, or with `--check` only compare it with the folder that exists. Return the exit status:
    1 if the build fails or a file differs.
    """
    parser = argparse.ArgumentParser(description="Builds athcodec/viewer/web from its sources.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file differs")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "web"  # A temporary folder itself is for nobody else, and copies of it would be.
        built.mkdir()
        try:
            build(built)
        except BuildError as error:
            print(f"build_viewer: {error}", file=sys.stderr)
            return 1
        different = differences(built, WEB)
        size = own_bytes(built)
        if size > MOST_BYTES:
            print(f"build_viewer: got {size:,} bytes, expected at most {MOST_BYTES:,}", file=sys.stderr)
            return 1
        if different and arguments.check:
            print(
                f"build_viewer: {', '.join(different)}: got other than the sources make; "
                "run python athcodec/viewer/build_viewer.py and commit the result",
                file=sys.stderr,
            )
            return 1
        if different:
            shutil.rmtree(WEB, ignore_errors=True)
            shutil.copytree(built, WEB)
    done = f"{', '.join(different)} written" if different else "up to date"
    print(f"web: {size:,} bytes of our own, compressed, {done}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
