"""Charts of the verbs' tables, one PNG per result, in the style of plots.py.

Each function of CHARTS draws the rows under "chart" of a result or those of its first table; a verb without one has no
picture.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any

from bench.plots import COLOURS, MARKERS, pyplot, save

INCHES = (8, 4.5)

Rows = list[dict[str, Any]]


def draw(verb: str, name: str, result: dict[str, Any], folder: Path) -> list[Path]:
    """Writes NAME.png, if there is a chart for the verb; returns the files written. Raises NoPlots."""
    if verb not in CHARTS:
        return []
    figure, axes = pyplot(INCHES)()
    axes.grid(True, color="#dddddd", linewidth=0.8)
    axes.set_axisbelow(True)
    CHARTS[verb](axes, result.get("chart", result["tables"][0]["rows"]))
    axes.legend(fontsize=8)
    return [save(figure, folder / f"{name}.png")]


def _scale(axes, rows: Rows) -> None:
    for (series, own), style in zip(_grouped(rows, "series"), _styles()):
        sizes = [row["vertices"] * row["frames"] for row in own]
        axes.loglog(sizes, [row["encode ns"] for row in own], label=f"encode: {series}", **style)
        axes.loglog(sizes, [row["decode, C ns"] for row in own], linestyle="--", **style)
    _label(axes, "Time by size (dashed: decoding in C)", "vertices x frames", "ns per vertex and frame")


def _large(axes, rows: Rows) -> None:
    ns = [1e9 * row["seconds"] / (row["vertices"] * row["frames"]) for row in rows]
    axes.bar(range(len(rows)), ns, 0.5, color=COLOURS[0], label="and peak memory over float32 positions, MB")
    for place, (row, height) in enumerate(zip(rows, ns)):
        axes.text(
            place, height, f"{row['peak (MB)']:,.0f} / {row['float32 (MB)']:,.0f}", ha="center", va="bottom", fontsize=8
        )
    axes.set_xticks(
        range(len(rows)),
        [
            f"{row['frames']:,} frames of {row['vertices']:,}\n"
            + (f"threads: {row['threads']}" if row["threads"] else "")
            for row in rows
        ],
    )
    axes.margins(y=0.25)
    _label(axes, "Encoding large clips", "", "ns per vertex and frame")


def _forest(axes, rows: Rows) -> None:
    rows = [{"ladder": "none"} | row for row in rows]
    for ((clips, phases, ladder), own), style in zip(_grouped(rows, "clips", "phases", "ladder"), _styles()):
        instances = [row["instances"] for row in own]
        name = f"{clips} clip{'s' * (clips > 1)}, {phases} phases, ladder {ladder}"
        axes.loglog(instances, [row["ms"] for row in own], label=name, **style)
        axes.loglog(instances, [row["predicted ms"] for row in own], **style | {"marker": "", "linestyle": ":"})
    _label(axes, "A forest on one thread (dotted: predicted)", "instances", "ms a picture")


def _batch(axes, rows: Rows) -> None:
    names = ["plain loop" if row["workers"] == "loop" else f"workers: {row['workers']}" for row in rows]
    axes.bar(names, [row["clips/s"] for row in rows], color=COLOURS[0], width=0.5, label=f"{rows[0]['clips']} clips")
    _label(axes, "Many clips", "", "clips a second")


def _remote(axes, rows: Rows) -> None:
    most = max(row["plants"] for row in rows)
    own = [row for row in rows if row["plants"] == most]
    places = range(len(own))
    for shift, column, colour in ((-0.2, "needed", COLOURS[1]), (0.2, "bytes", COLOURS[0])):
        axes.barh(
            [place + shift for place in places],
            [row[column] for row in own],
            0.4,
            color=colour,
            label={"needed": "needed", "bytes": "over HTTP, and requests"}[column],
        )
    for place, row in zip(places, own):
        axes.text(row["bytes"], place + 0.2, f" {row['requests']}", va="center", fontsize=8)
    axes.set_yticks(places, [row["what"] for row in own])
    axes.invert_yaxis()
    axes.set_xscale("log")
    _label(axes, f"A file of {own[0]['file']:,} bytes behind a URL", "bytes", "")


def _progressive(axes, rows: Rows) -> None:
    clips = list(dict.fromkeys(row["clip"] for row in rows))
    for (clip, ladder, measure), own in _grouped(rows, "clip", "ladder", "measure"):
        line = ("-", "--", ":", "-.")[clips.index(clip) % 4]
        colour = COLOURS[2 * (ladder == "none") + (measure == "RMS")]
        what = "single layer" if ladder == "none" else "layers"
        name = f"{clip}, {what}: {'largest' if measure == 'max' else measure} error"
        axes.semilogx([row["error"] for row in own], [row["ratio"] for row in own], line, color=colour, label=name)
        steps = [row for row in own if row["step"]]
        axes.plot([row["error"] for row in steps], [row["ratio"] for row in steps], "o", color=colour, markersize=4)
    axes.set_yscale("log", base=2)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.axhline(1, color="black", linewidth=0.8)
    axes.invert_xaxis()
    _label(
        axes, "A prefix that keeps an error, over a file of its own (dots: levels)", "error / diagonal", "prefix / own"
    )


CHARTS = {
    "progressive": _progressive,
    "scale": _scale,
    "large": _large,
    "forest": _forest,
    "batch": _batch,
    "remote": _remote,
}


def _grouped(rows: Rows, *names: str) -> Iterator[tuple[Any, Rows]]:
    """Rows grouped and ordered by their value in one column, or their values in several."""

    def key(row: dict[str, Any]) -> Any:
        values = tuple(row[name] for name in names)
        return values if len(names) > 1 else values[0]

    ordered = sorted(rows, key=lambda row: str(key(row)))
    for value, own in groupby(ordered, key):
        yield value, list(own)


def _styles() -> Iterator[dict[str, Any]]:
    for number in range(len(MARKERS)):
        yield {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number], "linewidth": 1.5, "markersize": 5}


def _label(axes, title: str, across: str, up: str) -> None:
    axes.set_title(title)
    axes.set_xlabel(across)
    axes.set_ylabel(up)
