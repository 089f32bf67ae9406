"""Packs the Blender extension: python -m athcodec.blender.build athcodec.zip athcodec-*.whl

The wheels of athcodec (one per platform) are given; those of zstandard, which it needs besides what Blender has, are
given too or fetched by pip for the same platforms and the Pythons of Blender. Wheels go in as they are, also others:
with those of scipy what Blender exports gets the branches that athcodec finds, in place of the pieces of the mesh.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

from athcodec.files.atomic import new_file

PYTHONS = ("3.11", "3.13")  # Blender 4.2 to 5.0 has the first, Blender 5.1 and later the second.
NEEDED = ("zstandard",)
MAKE = "in a clone `pip wheel --no-deps -w dist .` makes dist/athcodec-*.whl for this platform"
EXTENSION = Path(__file__).resolve().parent / "extension"
PLATFORMS = {"linux": "linux", "manylinux": "linux", "win": "windows", "macosx": "macos"}
MACHINES = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64", "arm64": "arm64"}


def main(argv: Sequence[str] | None = None) -> int:
    """Pack the Blender extension that the command line describes, and return the exit status 0."""
    parser = argparse.ArgumentParser(prog="python -m athcodec.blender.build", description=__doc__.splitlines()[0])
    parser.add_argument("output", type=Path, help="the .zip to write, which Blender installs")
    parser.add_argument("wheels", type=Path, nargs="*", help="wheels of athcodec, and of the others if not by pip")
    args = parser.parse_args(argv)
    try:
        check(args.wheels)
        with tempfile.TemporaryDirectory() as folder:
            pack(args.output, [*args.wheels, *_fetched(args.wheels, Path(folder))])
    except (ValueError, OSError) as error:
        parser.error(str(error))
    print(f"{args.output}: {args.output.stat().st_size:,} bytes")
    return 0


def check(wheels: Sequence[Path]) -> None:
    """Raise ValueError if a wheel does not exist, if none is athcodec's, or if one is for a platform that Blender does
    not have.
    """
    for wheel in wheels:
        if not wheel.is_file():
            raise ValueError(f"{wheel}: there is no such wheel; {MAKE}")
    for wheel in _of_athcodec(wheels):
        platform(wheel)
    if not _of_athcodec(wheels):
        names = ", ".join(wheel.name for wheel in wheels) or "none"
        raise ValueError(f"wheels: got {names}, expected one of athcodec for each platform; {MAKE}")


def _of_athcodec(wheels: Sequence[Path]) -> list[Path]:
    return [wheel for wheel in wheels if wheel.name.startswith("athcodec-")]


def pack(output: Path, wheels: Sequence[Path]) -> None:
    """Write the extension with some wheels to `output`. Raise ValueError as `check` does, OSError if it cannot be
    written.
    """
    check(wheels)
    built = _of_athcodec(wheels)
    platforms = sorted({platform(wheel) for wheel in built})
    names = sorted({wheel.name: wheel for wheel in wheels})
    manifest = (EXTENSION / "blender_manifest.toml").read_text(encoding="utf-8")
    for before, after in (
        ('version = "0.0.0"', f'version = "{built[0].name.split("-")[1]}"'),
        ("platforms = []", f"platforms = {_toml(platforms)}"),
        ("wheels = []", f"wheels = {_toml([f'./wheels/{name}' for name in names])}"),
    ):
        manifest = manifest.replace(before, after)
    with new_file(output) as out, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("blender_manifest.toml", manifest)
        for source in sorted(EXTENSION.glob("*.py")):
            archive.write(source, source.name)
        for wheel in {wheel.name: wheel for wheel in wheels}.values():
            archive.write(wheel, f"wheels/{wheel.name}", zipfile.ZIP_STORED)


def _toml(texts: Sequence[str]) -> str:
    return "[" + ", ".join(f'"{text}"' for text in texts) + "]"


def platform(wheel: Path) -> str:
    """Return Blender's name of the platform that a wheel is for. Raises ValueError."""
    tag = wheel.stem.split("-")[-1].split(".")[0]
    system = next((name for start, name in PLATFORMS.items() if tag.startswith(start)), None)
    machine = next((name for end, name in MACHINES.items() if tag.endswith(end)), None)
    if system is None or machine is None:
        raise ValueError(f"{wheel.name}: got the platform {tag}, expected one that Blender has")
    return f"{system}-{machine}"


def _fetched(wheels: Sequence[Path], folder: Path) -> list[Path]:
    """Download the wheels that are needed beside `wheels` with pip, for each platform and version of Python, and return
    their paths.
    """
    missing = [name for name in NEEDED if not any(wheel.name.startswith(f"{name}-") for wheel in wheels)]
    if not missing:
        return []
    for tag in sorted({wheel.stem.split("-")[-1] for wheel in wheels}):
        tags = [option for name in _pip_platforms(tag) for option in ("--platform", name)]
        for python in PYTHONS:
            words = [
                "pip",
                "download",
                "--quiet",
                "--no-deps",
                "--only-binary=:all:",
                "--python-version",
                python,
                *tags,
            ]
            if subprocess.run([sys.executable, "-m", *words, "--dest", str(folder), *missing]).returncode:
                raise ValueError(
                    f"wheels: pip has no {', '.join(missing)} of Python {python} for {tag}; name its wheels beside "
                    f"those of athcodec, from another machine by: {' '.join(words)} {' '.join(missing)}"
                )
    return sorted(folder.glob("*.whl"))


def _pip_platforms(tag: str) -> list[str]:
    """Return the tags that pip may choose for a platform: a wheel that was built here is for "linux", published ones
    for manylinux."""
    machine = tag.removeprefix("linux_")
    if machine != tag:
        return [f"manylinux2014_{machine}", f"manylinux_2_17_{machine}", f"manylinux_2_28_{machine}"]
    return tag.split(".")


if __name__ == "__main__":
    sys.exit(main())
