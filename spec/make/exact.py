"""EXACT: the source's own numbers."""

from spec.make.base import *


def lossless(first: bytes = b"") -> Draft:
    """Return an additional last level with empty streams."""
    return fork().with_header(level_count=4, full_level_count=4).add(Entry(EXACT, first, 3, 0), Entry(EXACT, b"", 3, 1))


table("exact-missing: a segment lacks its EXACT", lambda: lossless().without(EXACT, 3, 1))
table("exact-too-early: EXACT at level h + 1", lambda: fork().add(Entry(EXACT, b"", 2, 0)))
table("exact-with-stems: STEMS at level h + 2", lambda: lossless().add(Entry(STEMS, b"", 3, 0)))
table("exact-with-corrections: CORRECTIONS at level h + 2", lambda: lossless().add(Entry(CORRECTIONS, b"", 3, 0)))
valid("exact-empty: EXACT without bytes: differences of 32 bits, all of them ones", lossless)
invalid("exact-bytes-behind BAD_CHUNK 3: bytes behind the stream of EXACT", lambda: lossless(b"\1" * 400))
