"""What `athcodec info` says of an .ath file, as values for programs and as a table for people."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from athcodec.files.shown import Table, counted
from athcodec.untyped import JsonObject, JsonValue

if TYPE_CHECKING:
    from athcodec.decoding.decoder import Decoder

LEVEL_COLUMNS = ["level", "", "nodes", "bytes", "share"]
NAMED_OBJECTS = 8  # Objects that are named of those that some frames do not show.


class Column(NamedTuple):
    """How a measure is shown in a table."""

    head: str
    format: str = ".3g"

    def cell(self, value: float | None) -> str:
        return "" if value is None else f"{value:{self.format}}"


TICK_RATIO = Column("tick ratio")


def facts_of(
    path: str | os.PathLike[str], decoder: Decoder, tick_ratios: Sequence[Sequence[float | None]] | None = None
) -> JsonObject:
    """Return the facts about a file: `decoder.file.info()` and, for each level, its bytes beyond those of the levels
    before it. `tick_ratios` has for each clip, at each level, how much larger accelerations are near seams than in the
    median frame, if it was measured."""
    facts: JsonObject = {"file": os.fspath(path)} | decoder.file.info()
    facts |= {"unit": decoder.metadata.get("unit"), "missing": decoder.file.missing}
    facts["raw_bytes"] = facts["frames"] * decoder.file.vertex_count * 12
    facts["ratio"] = facts["raw_bytes"] / facts["bytes"]
    before = decoder.file.prelude_length
    for level in facts["levels"]:
        level["added_bytes"] = level["bytes"] - before
        level["share"] = level["added_bytes"] / facts["bytes"]
        before = level["bytes"]
    for clip, ratios in zip(facts["clips"], tick_ratios or ()):
        clip["tick_ratios"] = list(ratios)
    for level, ratios in zip(facts["levels"], zip(*(tick_ratios or ()))):
        level["tick_ratio"] = max((ratio for ratio in ratios if ratio is not None), default=None)
    return facts


def parts_of(facts: JsonObject) -> Iterator[str | Table]:
    """Yield the lines of text and the tables that `athcodec info` prints, from the facts about a file."""
    ath = facts["ath"]
    rate = f" at {facts['fps']:.6g} per second" if facts["fps"] else ""
    yield (
        f"{facts['file']}: {counted(facts['vertices'], 'vertex', 'vertices')} on "
        f"{counted(facts['branches'], 'branch', 'branches')}, {counted(facts['frames'], 'frame')}{rate} in "
        f"{counted(facts['segments'], 'segment')}, format {facts['format']}"
    )
    thresholds = ""
    if "epsilon" in ath:
        thresholds = f"; epsilon {ath['epsilon']:.2g}, eta {ath['eta']}, xi {ath['xi']:.2g}, lambda {ath['lam']}"
    yield (
        f"ATH: depth {ath['depth']}, {counted(ath['nodes'], 'node')}, {ath['leaves']:,} without children{thresholds}"
    )
    unit = f" {facts['unit']}" if facts["unit"] else ""
    share = facts["predicted_error_share"]
    held = "" if share is None else f", errors of predicted motion held to {share:.2g} of it"
    yield (f"Error bound: {facts['max_error_bound']:.4g}{unit}{held}. {size_of(facts)}")
    yield f"Rest pose: {_rest(facts)}."
    if len(facts["levels"]) < facts["full_level_count"]:
        yield (f"Holds levels 0 to {len(facts['levels']) - 1} of 0 to {facts['full_level_count'] - 1}.")
    if facts["missing"]:
        yield f"{facts['available_bytes']:,} bytes are there; missing {facts['missing']}."
    if len(facts["clips"]) > 1 or facts["clips"][0]["name"] or any(facts["clips"][0][key] for key in ("loop", "wind")):
        yield _clips(facts)
    yield from filter(None, map(_presence, facts["clips"]))
    yield _levels(facts)


def _presence(clip: JsonObject) -> str:
    """Return a line that names objects which some frames do not show, up to `NAMED_OBJECTS` of them, and the frames
    that show them; "" if there are none."""
    named = [
        f"{name} in {', '.join(f'{first} to {stop - 1}' for first, stop in runs) or 'none'}"
        for name, runs in list(clip["presence"].items())[:NAMED_OBJECTS]
    ]
    if not named:
        return ""
    more = len(clip["presence"]) - len(named)
    of_clip = f" of {clip['name']}" if clip["name"] else ""
    return f"Shown in some frames{of_clip} only: {'; '.join(named)}{f'; and {more:,} more' if more else ''}."


def _rest(facts: JsonObject) -> str:
    """Return where it is, and what it takes."""
    if facts["host_mesh"]:
        vertices = counted(facts["vertices"], "vertex", "vertices")
        return f"a mesh of {vertices} that the host has, checksum {facts['host_mesh']['checksum']}"
    return f"{facts['rest_bytes']:,} of these bytes"


def _clips(facts: JsonObject) -> Table:
    """Return the table of a file's clips. The column of errors at a loop's seam is for the deepest stored level."""
    rows = [
        [
            clip["name"],
            f"{clip['frames']:,}",
            f"{clip['seconds']:.4g}",
            f"{clip['segments']:,}",
            f"{clip['wind']['strength']:g} to {clip['wind']['heading']:g}°" if clip["wind"] else "",
            f"{clip['seam_errors'][len(facts['levels']) - 1]:.3g}" if clip["loop"] else "",
            *(f"{error:.3g}" for error in clip["max_errors"]),
        ]
        for clip in facts["clips"]
    ]
    levels = [f"max at {level}" for level in range(len(facts["levels"]))]
    seam = head("loop's seam", facts["unit"])
    return Table(["clip", "frames", "seconds", "segments", "wind", seam, *levels], rows)


def _levels(facts: JsonObject) -> Table:
    """Return the table of a file's levels: their nodes, bytes and errors."""
    measures = {"max": "max_error", "99 %": "p99_error", "RMS": "rms_error"}
    columns = ["bytes so far", *(head(f"{name} error", facts["unit"]) for name in measures)]
    cells = [
        [f"{level['bytes']:,}", *(f"{level[field]:.3g}" for field in measures.values())] for level in facts["levels"]
    ]
    if "tick_ratio" in facts["levels"][0]:
        columns.append(TICK_RATIO.head)
        for row, level in zip(cells, facts["levels"], strict=True):
            row.append(TICK_RATIO.cell(level["tick_ratio"]))
    return Table([*LEVEL_COLUMNS, *columns], level_rows(facts, cells))


def level_rows(facts: JsonObject, cells: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the rows of a table of levels: one for the bytes before the first level, one for each level, which ends
    with the level's texts from `cells`, and one for the bytes behind the last level."""
    levels, total = facts["levels"], facts["bytes"]

    def row(level: str, name: str, nodes: str, size: int) -> list[str]:
        return [level, name, nodes, f"{size:,}", f"{size / total:.1%}"]

    rows = [row("prelude", "", "", levels[0]["bytes"] - levels[0]["added_bytes"])]
    for level, more in zip(levels, cells, strict=True):
        name = level["name"] if level["available"] else f"{level['name']} (incomplete)"
        rows.append(row(f"{level['level']}", name, f"{level['nodes']:,}", level["added_bytes"]) + list(more))
    behind = total - levels[-1]["bytes"]
    return [*rows, row("arrays", "", "", behind)] if behind else rows


def head(name: str, unit: JsonValue) -> str:
    return f"{name} ({unit})" if unit else name


def size_of(facts: JsonObject) -> str:
    """Return a sentence on the size of the file beside that of its positions as float32."""
    return f"{facts['bytes']:,} bytes; the positions as float32 take {facts['raw_bytes']:,}: {facts['ratio']:.1f} to 1."
