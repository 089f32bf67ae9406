"""Prefixes of one file, with and without layers of precision, against files of their own of the same error.

Own files are coded without layers, for bounds from 2e-2 down to that of the file. Each row is the prefix that ends with
a level of one of the two files; its errors are those of the file's table.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from bench.clips import Encoded, add_clips, add_ladder, add_rel_error, encoded
from bench.curves import Curve
from bench.progressive import diagonal, single_files
from bench.tables import table

LOOSEST, OWN_PER_DECADE = 2e-2, 4

NOTE = """
Max and RMS over the diagonal. Own: bytes of a file of its own with the same largest or RMS error, interpolated
(log-log); no figure beyond the loosest of them. A prefix has everything up to a level, without attributes.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_ladder(parser, "decades")


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows, sizes = [], []
    for path in args.clips:
        own = single_files(path, _bounds(args.rel_error))
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


def _bounds(rel_error: float) -> list[float]:
    count = 1 + max(1, round(OWN_PER_DECADE * np.log10(LOOSEST / rel_error)))
    return np.geomspace(LOOSEST, rel_error, count).tolist()


def _prefixes(result: Encoded, own: list[dict[str, float]]) -> Iterator[dict[str, Any]]:
    sizes, scale = [row["bytes"] for row in own], diagonal(result)
    by_max, by_rms = (Curve.of([row[error] for row in own], sizes) for error in ("max", "rms"))
    for level in result.decoder.levels:
        at_max, at_rms = level.max_error / scale, level.rms_error / scale
        row = {"level": level.level, "bytes": level.bytes, "max": at_max, "RMS": at_rms}
        for name, own_size in (("max", by_max.size_at(at_max)), ("RMS", by_rms.size_at(at_rms))):
            row |= {
                f"own at {name}": own_size and round(own_size),
                f"/own at {name}": own_size and level.bytes / own_size,
            }
        yield row
