"""Prefixes of one file, with and without layers of precision, against files of their own of the same error.

Own files are coded without layers, for bounds from 0.1 down to a little below that of the file. A prefix ends with a
level of one of the two files; its errors are those of the file's table. Prefixes are compared at their own errors, and
at errors between them: whoever asks for such a one gets the next level, which is more precise than asked for.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bench.clips import Encoded, add_clips, add_ladder, add_rel_error, encoded, measure
from bench.curves import Curve
from bench.tables import table

LOOSEST, OWN_PER_DECADE = 0.1, 4
BELOW = 0.9  # Share of the bound down to which files are made, so that the last has the errors of whole files too.
JUST_BELOW = 1 - 1e-6
ASKED = 3e-4, 1e-2  # Errors between which the worst prefix is sought.
MEASURES = ("max", "RMS")

NOTE = """
Max and RMS over the diagonal. Own: bytes of a file of its own with the same largest or RMS error, interpolated
(log-log); no figure beyond the loosest of them. A prefix has everything up to a level, without attributes.
"""

ERRORS_NOTE = """
The shortest prefix whose largest or RMS error is not above this one, over the diagonal, and a file of its own of just
this error.
"""

SIZES_NOTE = """
Worst: the prefix for any largest error from 3e-4 to 1e-2 over a file of its own of this error, where it is largest.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_ladder(parser, "decades")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Measure the prefixes of files with and without layers of precision against files that are encoded directly at the
    same error. Return tables of prefixes, of bytes at round errors, and of whole files.
    """
    rows, at_errors, sizes = [], [], []
    for path in args.clips:
        curves = _own_files(path, args.rel_error)
        bytes_of = {}
        for name, ladder in (("none", ()), ("layers", args.ladder)):
            with encoded(path, args.rel_error, ladder=ladder) as result:
                bytes_of[name], prefixes = result.summary.bytes, list(_prefixes(result, curves))
            about = {"clip": path.stem, "ladder": name}
            rows += [about | row for row in prefixes]
            at_errors += [about | row for row in _at_errors(prefixes, curves)]
        worst = max(_ratios(prefixes, curves["max"]), default=None)
        more = {"more %": 100 * (bytes_of["layers"] / bytes_of["none"] - 1), "worst /own": worst}
        sizes.append({"clip": path.stem} | bytes_of | more)
    return {
        "tables": [
            table(f"Prefixes of files of {args.rel_error:g}", rows, NOTE),
            table("At an error", at_errors, ERRORS_NOTE),
            table("Bytes of the whole files", sizes, SIZES_NOTE),
        ],
        "broken": [],
    }


def _own_files(path: Path, rel_error: float) -> dict[str, Curve]:
    """Encode a clip directly at several error bounds down to `rel_error`, and return for each measure of the error,
    largest and RMS, the curve of bytes over error.
    """
    rows = []
    for bound in _bounds(rel_error):
        with encoded(path, bound) as result:
            meter, scale = measure(result.clip, result.decoder), _diagonal(result)
            rows.append((result.summary.bytes, meter.max_error / scale, meter.rms_error / scale))
    sizes, *errors = zip(*rows, strict=True)
    return {name: Curve.of(errors_of_kind, sizes) for name, errors_of_kind in zip(MEASURES, errors, strict=True)}


def _diagonal(result: Encoded) -> float:
    return result.summary.max_error_bound / result.summary.relative_bound


def _bounds(rel_error: float) -> list[float]:
    count = 1 + max(1, round(OWN_PER_DECADE * np.log10(LOOSEST / rel_error)))
    return [*np.geomspace(LOOSEST, rel_error, count).tolist(), rel_error * BELOW]


def _prefixes(result: Encoded, curves: dict[str, Curve]) -> Iterator[dict[str, Any]]:
    """Yield a row for each level of a file: its bytes and errors, and the bytes of a file encoded directly at the same
    error. `curves` has the bytes of such files over each measure of the error.
    """
    scale = _diagonal(result)
    for level in result.decoder.levels:
        row = {"level": level.level, "bytes": level.bytes}
        row |= {"max": level.max_error / scale, "RMS": level.rms_error / scale}
        for kind in MEASURES:
            size = curves[kind].size_at(row[kind])
            row |= {f"own at {kind}": size and round(size), f"/own at {kind}": size and level.bytes / size}
        yield row


def _at_errors(prefixes: list[dict[str, Any]], curves: dict[str, Curve]) -> Iterator[dict[str, Any]]:
    """Yield a row for each error 1e-1, 3e-2, 1e-2 and so on over the diagonal that the prefixes reach: for each measure
    of the error, the level and bytes of the prefix, the bytes of a file encoded directly at that error, and the ratio
    of the two.
    """
    for error in (digit * 10.0**-decade for decade in range(1, 9) for digit in (1, 0.3)):
        row: dict[str, Any] = {}
        for kind in MEASURES:
            if match := _at(error, kind, prefixes, curves[kind]):
                prefix, size = match
                row |= {f"level at {kind}": prefix["level"], f"bytes at {kind}": prefix["bytes"]}
                row |= {f"own at {kind}": round(size), f"/own at {kind}": prefix["bytes"] / size}
        if row:
            yield {"error": error} | row


def _ratios(prefixes: list[dict[str, Any]], curve: Curve) -> Iterator[float]:
    """Yield the size of a prefix over that of a file encoded directly, at the errors of ASKED that both have and
    just below those of the prefixes."""
    steps = {prefix["max"] for prefix in prefixes}
    for error in {*curve.errors.tolist(), *steps, *(JUST_BELOW * step for step in steps)}:
        if ASKED[0] <= error <= ASKED[1] and (match := _at(error, "max", prefixes, curve)):
            prefix, size = match
            yield prefix["bytes"] / size


def _at(error: float, kind: str, prefixes: list[dict[str, Any]], curve: Curve) -> tuple[dict[str, Any], float] | None:
    """Return the shortest prefix whose error is at most `error`, and the size of a file that is encoded at that error;
    None where either is missing."""
    prefix, size = next((row for row in prefixes if row[kind] <= error), None), curve.size_at(error)
    return (prefix, size) if prefix and size else None
