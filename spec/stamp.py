"""Gives the format another version: its documents, code, vectors and samples, and the list of the vectors' checksums.

    python -m spec.stamp 1.0            from the root of a clone without changes

A file whose front is valid changes in its version and Front_Checksum alone, so what it decodes to stays; other vectors
are made anew. Vectors of versions go where the rule of the new version puts them. The WebAssembly decoder and the
viewer, which hold the version too, are built anew afterwards.
"""

from __future__ import annotations

import re
import struct
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FORMAT, VECTORS = ROOT / "FORMAT.md", ROOT / "spec" / "vectors"
PLACES = {  # Where the version stands: a pattern of the text, with the two numbers as groups.
    FORMAT: (
        r"^Format_Version (\d+)\.(\d+)$",
        r"\\x1a\\n\", \((\d+), (\d+)\), 0x0000",
        r"\| Major_Version \| u8 \| (\d+) \|\n.*\| Minor_Version \| u8 \| (\d+),",
    ),
    ROOT / "athcodec/core/include/ath.h": (r"ATH_FORMAT_MAJOR = (\d+), ATH_FORMAT_MINOR = (\d+),",),
    ROOT / "athcodec/decoding/container.py": (r"^MAJOR, MINOR, FEATURES = (\d+), (\d+),",),
}


def write_version(version: tuple[int, int]) -> None:
    """Write a version, major and minor, into the documents and sources that state it."""
    for path, patterns in PLACES.items():
        text = path.read_text("utf-8")
        for pattern in patterns:
            (match,) = re.finditer(pattern, text, re.M)
            for group in (2, 1):
                text = f"{text[: match.start(group)]}{version[group - 1]}{text[match.end(group) :]}"
        path.write_text(text, "utf-8")


def stamped(data: bytes, old: tuple[int, int], new: tuple[int, int]) -> bytes | None:
    """Return a file with the version `new` in place of `old`; None if its front is not a valid one of the version
    `old`.
    """
    from spec.document import crc32c

    length = struct.unpack_from("<I", data, 16)[0] if len(data) >= 24 else 0
    if not 24 <= length <= len(data) or tuple(data[8:10]) != old:
        return None
    if crc32c(data[:12] + bytes(4) + data[16:length]) != struct.unpack_from("<I", data, 12)[0]:
        return None
    front = data[:8] + bytes(new) + data[10:12]
    return front + struct.pack("<I", crc32c(front + bytes(4) + data[16:length])) + data[16:]


def stamp_files(old: tuple[int, int]) -> None:
    """Change the version from `old` to that of FORMAT.md in all files that state it."""
    from spec import conformance, dump, make
    from spec.document import crc32c, rules

    listed = VECTORS / "expected.txt"
    lines = listed.read_text("utf-8").splitlines()
    before = {line.split()[0]: line for line in lines if not line.startswith("#")}
    after = {}
    for vector in make.VECTORS:
        other = f"{'valid' if vector.error else 'invalid'}/{vector.name}.ath"
        was = vector.path if vector.path in before else other
        data = stamped((VECTORS / was).read_bytes(), old, rules.VERSION)
        if data is None:
            data = vector.make()
            after[was] = make.line_of(vector, data)
        else:
            after[was] = re.sub(r"^(\S+) \w+", rf"\1 {crc32c(data):08x}", before[was])
        if was != vector.path:
            (VECTORS / was).unlink()
        (VECTORS / vector.path).write_bytes(data)
    head = [f"# {text}" if text else "#" for text in conformance.LISTING.splitlines()]
    listed.write_text("\n".join([*head, *(after[path] for path in before)]) + "\n", "utf-8")
    make.write_sums()
    named = subprocess.run(["git", "ls-files", "*.ath"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for path in (ROOT / name for name in named.split() if not name.startswith("spec/vectors/")):
        if (data := stamped(path.read_bytes(), old, rules.VERSION)) is not None:
            path.write_bytes(data)
    text = FORMAT.read_text("utf-8")
    shown = "\n".join(dump.lines((VECTORS / "valid" / "traced.ath").read_bytes()))
    FORMAT.write_text(re.sub(r"^    00000000  (?:.+\n)+", lambda _: shown + "\n", text, count=1, flags=re.M), "utf-8")


def main(words: list[str]) -> int:
    """Set the version of the format that the command line states, in all files that have it. Return the exit status."""
    match words:
        case ["--files", major, minor]:  # in a process that reads the new FORMAT.md
            stamp_files((int(major), int(minor)))
        case [version] if re.fullmatch(r"\d+\.\d+", version):
            (old,) = re.findall(PLACES[FORMAT][0], FORMAT.read_text("utf-8"), re.M)
            write_version(tuple(map(int, version.split("."))))
            subprocess.run([sys.executable, "-m", "spec.stamp", "--files", *old], cwd=ROOT, check=True)
        case _:
            print(__doc__.split("\n\n")[1], file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
