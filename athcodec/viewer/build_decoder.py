"""Builds ath_decoder.mjs: the C decoder compiled to WebAssembly, put into ath_decoder.template.mjs as text.

The compiler is Zig's, a pip package, at one version: the WebAssembly that it makes is the same on every
machine. Exported is what the template calls, nothing is imported. The module is written only if its text or
its WebAssembly would change: what zstd packs may differ between its versions, what it unpacks does not.
"""

from __future__ import annotations

import argparse
import base64
import re
import subprocess
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import zstandard

VIEWER = Path(__file__).resolve().parent
CORE = VIEWER.parent / "core"
TEMPLATE = VIEWER / "ath_decoder.template.mjs"
MODULE = VIEWER / "ath_decoder.mjs"

ZIG = "0.17.1"
"""Version of the package ziglang that the committed module was built with."""

STACK_BYTES = 64 << 10
PACKING = 22  # Level of zstd, whose decoder is in the module anyway, for arrays.
SMALL = (
    "build.c",
    "checksums.c",
    "container.c",
    "decode.c",
    "fault_text.c",
    "file.c",
    "foresee.c",
    "gpu.c",
    "heads.c",
    "join.c",
    "keep.c",
    "maps.c",
    "mesh.c",
    "open.c",
    "plan.c",
    "predict.c",
    "ranges.c",
    "refine.c",
    "refuse.c",
    "rest.c",
    "static.c",
    "store.c",
    "work.c",
)
"""Run once per file, or little: compiled for size, all else for speed."""
SCALAR = (*SMALL, "correct.c", "pieces.c", "prepare.c")
"""Vectors make the loops of these files larger and no faster."""
FLAGS = [
    "-target",
    "wasm32-freestanding",
    "-mcpu=generic+bulk_memory+bulk_memory_opt+nontrapping_fptoint+sign_ext+simd128",
    "-std=c11",
    "-fno-unroll-loops",  # unrolled it is larger, and no faster
    "-mllvm",
    "-inline-threshold=20",  # LLVM has 225; with less the module is 2 % smaller packed, and decodes as fast.
    "-DATH_STATIC",
    "-DATH_AT_ONCE",  # without the code of slices, which no worker of the page asks for
    # the bits of positions are part of the format, as in core/CMakeLists.txt
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-nostdlib",
    "-s",
]
# Zig puts the stack below the data, where an overflow traps
LINKING = ["-Wl,--no-entry", f"-Wl,-z,stack-size={STACK_BYTES}"]

INCLUDE = re.compile(r"^// @include (\S+)\n", re.MULTILINE)
"""A line of the template in whose place the text of a file stands, without its exports."""
PAYLOAD = re.compile(r'(const WASM = ")([^"]*)(";)')


class BuildError(Exception):
    """One line for the user."""


def decoder_sources() -> list[Path]:
    """Return the C files that a player needs, as core/CMakeLists.txt lists them."""
    lists = re.findall(r"set\(ATH_(?:DECODER|GPU)_SOURCES\s([^)]*)\)", (CORE / "CMakeLists.txt").read_text("utf-8"))
    if len(lists) != 2:
        raise BuildError(f"{CORE / 'CMakeLists.txt'}: got {len(lists)} lists of C files, expected decoder and GPU form")
    return [CORE / name for names in lists for name in names.split()]


def exports(template: str) -> list[str]:
    """Return the C functions that the template calls."""
    return sorted(set(re.findall(r"\bc\.(ath_\w+)\(", template)))


def check_compiler() -> None:
    try:
        installed = version("ziglang")
    except PackageNotFoundError:
        installed = "none"
    if installed != ZIG:
        raise BuildError(f"package ziglang: got version {installed}, expected {ZIG}; pip install ziglang=={ZIG}")


def compile_decoder(template: str) -> bytes:
    """Compile the C decoder with the exports that the template uses, and return the WebAssembly module."""
    check_compiler()
    wanted = [f"-Wl,--export={name}" for name in ["__heap_base", *exports(template)]]
    # functions of one kind beside each other compress better
    sources = sorted([*decoder_sources(), VIEWER / "wasm.c"], key=lambda path: path.name in SMALL)
    with tempfile.TemporaryDirectory() as folder:
        for path in sources:
            speed = "-Os" if path.name in SMALL else "-O3"
            vectors = "-fno-vectorize" if path.name in SCALAR else "-fvectorize"
            _zig(folder, speed, vectors, "-c", str(path), "-o", f"{path.stem}.o")
        _zig(folder, "-O3", *LINKING, *wanted, *(f"{path.stem}.o" for path in sources), "-o", "decoder.wasm")
        return (Path(folder) / "decoder.wasm").read_bytes()


def _zig(folder: str, *arguments: str) -> None:
    command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, "-I", str(CORE), "-I", str(CORE / "include"), *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise BuildError(f"zig cc: got exit status {done.returncode}, expected 0:\n{done.stderr}")


def pack(template: str, wasm: bytes) -> str:
    """Return the text of the JavaScript module: the template with what it includes, and the compiled decoder as
    base64."""
    payload = base64.b64encode(zstandard.ZstdCompressor(level=PACKING).compress(wasm)).decode("ascii")
    head, code = template.split("\n\n", 1)
    pieces = INCLUDE.split(code)  # Text of the template and names of files take turns.
    texts = [(VIEWER / text).read_text("utf-8") if i % 2 else text for i, text in enumerate(pieces)]
    lean = "".join(_lean(text) for text in texts)
    return PAYLOAD.sub(lambda match: match[1] + payload + match[3], f"{head}\n\n{lean}", count=1)


def _lean(text: str) -> str:
    """Return text without comments and indentation. No string in it may go over several lines."""
    text = re.sub(r"^/\*\*.*?\*/\n", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^ +|^ *//.*\n|^\n|^export (?=function)", "", text, flags=re.MULTILINE)


def unpack(module: str) -> tuple[str, bytes]:
    """Return the text of a module without its payload, and the WebAssembly in the payload; ("", b"") if the text is no
    such module.
    """
    match = PAYLOAD.search(module)
    if match is None:
        return "", b""
    try:
        return PAYLOAD.sub("", module, count=1), zstandard.ZstdDecompressor().decompress(base64.b64decode(match[2]))
    except (TypeError, ValueError, zstandard.ZstdError):
        return "", b""


def differences(built: str, committed: str) -> list[str]:
    names = ("text", "WebAssembly")
    return [name for name, a, b in zip(names, unpack(built), unpack(committed), strict=True) if a != b]


def main() -> int:
    """Build ath_decoder.mjs, or with `--check` only compare it with the file. Return the exit status: 1 if the build
    fails or the file differs.
    """
    parser = argparse.ArgumentParser(description="Builds athcodec/viewer/ath_decoder.mjs from the C decoder.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if the module differs")
    arguments = parser.parse_args()
    template = TEMPLATE.read_text("utf-8")
    try:
        built = pack(template, compile_decoder(template))
    except BuildError as error:
        print(f"build_decoder: {error}", file=sys.stderr)
        return 1
    different = differences(built, MODULE.read_text("utf-8") if MODULE.exists() else "")
    if different and arguments.check:
        print(
            f"build_decoder: {MODULE.name}: got other {' and '.join(different)} than the sources make; "
            "run python athcodec/viewer/build_decoder.py and commit the result",
            file=sys.stderr,
        )
        return 1
    if different:
        MODULE.write_text(built, "utf-8", newline="\n")
    print(f"{MODULE.name}: {len(built.encode()):,} bytes, {'written' if different else 'up to date'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
