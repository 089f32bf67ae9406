"""Prefixes of one file, with and without layers of precision, against files of their own of the same error.

Own files are coded without layers, for bounds from 2e-2 down to that of the file. Each row is the prefix that ends with
a level of one of the two files; its errors are those of the file's table.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.encoding.layers import LADDERS, ladder_of
from bench.clips import Encoded, add_clips, add_rel_error, encoded
from bench.curves import Curve
from bench.tables import table

LOOSEST, OWN_PER_DECADE = 2e-2, 4

NOTE = """
Max and RMS over the diagonal. Own: bytes of a file of its own with the same largest or RMS error, interpolated
(log-log); no figure beyond the loosest of them. A prefix has everything up to a level, without attributes.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    parser.add_argument(
        "--ladder",
        type=ladder_of,
        default=LADDERS["decades"],
        metavar="ERROR,...",
        help="largest errors of the layers over the diagonal (default: decades)",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows, sizes = [], []
    for path in args.clips:
        own = list(_own(path, args.rel_error))
        found = {}
        for name, ladder in (("none", ()), ("layers", args.ladder)):
            with encoded(path, args.rel_error, ladder=ladder) as result:
                found[name] = result.summary.bytes
                rows += [{"clip": path.stem, "ladder": name} | row for row in _prefixes(result, own)]
        sizes.append({"clip": path.stem} | found | {"more %": 100 * (found["layers"] / found["none"] - 1)})
    return {
        "tables": [
            table(f"Prefixes of files of {args.rel_error:g}", rows, NOTE),
            table("Bytes of the whole files", sizes),
        ],
        "broken": [],
    }


def _own(path: Path, rel_error: float) -> Iterator[tuple[float, float, int]]:
    """(largest error, RMS error, bytes), errors over the diagonal, of files of their own."""
    count = 1 + max(1, round(OWN_PER_DECADE * np.log10(LOOSEST / rel_error)))
    for bound in np.geomspace(LOOSEST, rel_error, count):
        with encoded(path, float(bound)) as result:
            last = result.decoder.levels[-1]
            yield *_over_diagonal(result, last.max_error, last.rms_error), result.summary.bytes


def _over_diagonal(result: Encoded, *errors: float) -> list[float]:
    diagonal = result.summary.max_error_bound / result.summary.relative_bound
    return [error / diagonal for error in errors]


def _prefixes(result: Encoded, own: list[tuple[float, float, int]]) -> Iterator[dict[str, Any]]:
    largest, rms, sizes = zip(*own, strict=True)
    by_max, by_rms = Curve.of(largest, sizes), Curve.of(rms, sizes)
    for level in result.decoder.levels:
        at_max, at_rms = _over_diagonal(result, level.max_error, level.rms_error)
        row = {"level": level.level, "bytes": level.bytes, "max": at_max, "RMS": at_rms}
        for name, own_size in (("max", by_max.size_at(at_max)), ("RMS", by_rms.size_at(at_rms))):
            row |= {
                f"own at {name}": own_size and round(own_size),
                f"/own at {name}": own_size and level.bytes / own_size,
            }
        yield row
