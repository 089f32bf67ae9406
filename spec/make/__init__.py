"""The source of the vectors: every file of spec/vectors with the rule that it tests, a module per part of the format.

    python -m spec.make            adds missing vectors and their lines in expected.txt

All but those that athcodec encodes (whole.py) are scripts (scripted.py), which always give the same bytes. The
expected error of a vector is stated here; expected.txt gets the results of FORMAT.md's code if they agree with it. A
vector never changes once it exists: a better one gets another name.
"""

import hashlib
from importlib import import_module
from pathlib import Path

from spec import conformance
from spec.make.base import VECTORS, Vector

for part in sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py")):
    import_module(f"spec.make.{part}")


def results(data: bytes, mesh: bytes | None = None) -> dict[str, str]:
    """Return the document's result for every item of a file."""
    return {item: conformance.result(conformance.document, data, item, mesh) for item in conformance.items(data)}


def line_of(vector: Vector, data: bytes) -> str:
    """Return the line of a vector in expected.txt. Raise ValueError if FORMAT.md's code gives another result than the
    vector states.
    """
    outcome = results(data, vector.mesh)
    wrong = {item: result for item, result in outcome.items() if result in conformance.ERRORS}
    if (vector.error and outcome.get(vector.item) != vector.error) or (not vector.error and wrong):
        raise ValueError(f"{vector.path}: got {outcome}; expected {vector.error or 'no error'} {vector.item}")
    first = next(iter(wrong), "")
    also_strict = first == "strict" and (vector.item == "open" or vector.error == "TRUNCATED")
    if vector.error and first != vector.item and not also_strict:
        raise ValueError(f"{vector.path}: got {outcome}; expected nothing wrong before {vector.item}")
    return conformance.format_line(vector.path, data, outcome, vector.reason)


def write(folder: Path = conformance.FOLDER) -> int:
    """Write the vectors that are missing in a folder, with their expected results and checksums, and return their
    number.
    """
    for name in ("valid", "invalid"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    listed = folder / "expected.txt"
    lines = listed.read_text("utf-8").splitlines() if listed.exists() else []
    existing = {line.split()[0] for line in lines if not line.startswith("#")}
    made = 0
    for vector in VECTORS:
        if vector.path in existing:
            continue
        data = vector.make()
        lines.append(line_of(vector, data))
        (folder / vector.path).write_bytes(data)
        if vector.mesh is not None:
            (folder / vector.path).with_suffix(".mesh").write_bytes(vector.mesh)
        made += 1
    if not lines or not lines[0].startswith("#"):
        lines = [f"# {text}" if text else "#" for text in conformance.LISTING.splitlines()] + lines
    listed.write_text("\n".join(lines) + "\n", "utf-8")
    write_sums(folder)
    return made


def write_sums(folder: Path = conformance.FOLDER) -> None:
    """Write SHA256SUMS, the checksums of all other files of the vectors, as `sha256sum --check` reads them."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != "SHA256SUMS")
    sums = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder).as_posix()}" for path in files]
    (folder / "SHA256SUMS").write_text("\n".join(sums) + "\n", "utf-8")
