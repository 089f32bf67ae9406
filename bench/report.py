"""The tables that documents have of stored results, written between their markers: for each a test compares them."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import athcodec
from bench import branches, compare, constants, engines, features, gallery, pairs, rd, shown
from bench.store import read
from bench.tables import table

README = rd.ROOT / "README.md"
RATIONALE, BENCHMARKS = rd.ROOT / "spec" / "rationale.md", rd.ROOT / "docs" / "benchmarks.md"
DECIDES = rd.ROOT / "docs" / "how-the-encoder-decides.md"
FORMATS, ENGINES = rd.ROOT / "docs" / "formats.md", rd.ROOT / "docs" / "engines.md"
GALLERY = rd.ROOT / "docs" / "gallery.md"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    del parser  # There is nothing to set.


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows = []
    for document, name, text in sections():
        put(document, name, text)
        rows.append({"document": document.name, "part": name})
    return {"tables": [table("Written", rows)], "broken": []}


def sections() -> Iterator[tuple[Path, str, str]]:
    """Yield each part of a document that is written from stored results: the document's path, the name of the part, and
    its text. Parts whose results are not stored are left out.
    """
    texts = {"features": features.table_text, "rd": compare.clips_text} | dict.fromkeys(rd.KEPT, compare.suite_text)
    for name, text in texts.items():
        file = rd.RESULTS / f"{name}.json"
        if file.exists():
            yield RATIONALE if name == "features" else BENCHMARKS, name, text(read(file))
    yield BENCHMARKS, "lost", compare.lost_text(read(rd.RESULTS / f"{name}.json") for name in ("foreign", "held-out"))
    if constants.RESULTS.exists():
        yield DECIDES, "constants", constants.left_text(read(constants.RESULTS))
    if pairs.RESULTS.exists():
        yield BENCHMARKS, "pairs", pairs.table_text(read(pairs.RESULTS))
    if branches.RESULTS.exists():
        yield FORMATS, "branches", branches.table_text(read(branches.RESULTS))
    yield (
        README,
        "overview",
        compare.overview_text([read(rd.RESULTS / f"{name}.json") for name in ("rd", "foreign", "held-out")]),
    )
    if engines.RESULTS.exists():
        yield ENGINES, "engines", engines.table_text(read(engines.RESULTS))
    yield README, "picture", picture_text()
    for name, text in gallery.captions():
        yield GALLERY, name, text
    yield from shown.sections()


def picture_text() -> str:
    """Return the caption of the moving picture, with facts of the file that the picture shows."""
    path = athcodec.sample_path("leafed")
    with athcodec.open(path) as decoder:
        raw, size = decoder.file.info()["frames"] * decoder.file.vertex_count * 12, path.stat().st_size
        return (
            f"{decoder.file.vertex_count:,} vertices in two winds of {len(decoder)} frames each: {raw / 1e6:.0f} MB as "
            f"float32, {size / 1e3:.0f} kB as the `.ath` file that ships with the package, within "
            f"{1e3 * decoder.levels[-1].max_error:.0f} mm."
        )


def put(document: Path, name: str, text: str) -> None:
    """Put a text between the markers of its name."""
    before, _, after = parted(document.read_text("utf-8"), name)
    document.write_text(f"{before}\n{text}\n{after}", "utf-8")


def parted(text: str, name: str) -> tuple[str, str, str]:
    """Return what a document has up to the first marker of a name, between both, and from the second one on."""
    first, last = f"<!-- {name}: written by python -m bench report -->\n", f"<!-- end of {name} -->\n"
    before, marker, rest = text.partition(first)
    inside, ended, after = rest.partition(last)
    if not (marker and ended):
        raise SystemExit(f"document: found no {first.strip()} with its end; expected both lines, each once")
    return before + first, inside, last + after
