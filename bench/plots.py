"""Pictures by matplotlib, of the extra `bench` alone: prefixes over files of their own, and what other modules draw.

Colours are those of Okabe and Ito ("Color universal design", 2008), which colour-blind people can tell apart, without
the yellow, which is faint on white.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#7A7A7A")
MISSING = 'matplotlib is not installed, so there are no pictures: pip install "athcodec[bench]"'
DPI = 110


class NoPlots(Exception):
    """matplotlib is missing; the message says what to do."""


def pyplot(inches: tuple[float, float], rows: int = 1, columns: int = 1):
    """A function that makes a figure of this size and its axes, or an array of them, without a display.

    Raises NoPlots.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise NoPlots(MISSING) from None

    def figure_of():
        figure = Figure(figsize=inches, dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        return figure, figure.subplots(rows, columns)

    return figure_of


def draw_prefixes(rows: list[dict[str, Any]], file: Path) -> Path:
    """Draw the bytes of prefixes over those of files of their own, by error. Raises NoPlots."""
    figure, axes = pyplot((8, 4.5))()
    clips = list(dict.fromkeys(row["clip"] for row in rows))
    curves: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        curves.setdefault((row["clip"], row["ladder"], row["measure"]), []).append(row)
    for (clip, ladder, measure), own in sorted(curves.items()):
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
    axes.set_title("A prefix that keeps an error, over a file of its own (dots: levels)")
    axes.set_xlabel("error / diagonal")
    axes.set_ylabel("prefix / own")
    axes.grid(True, color="#dddddd", linewidth=0.8)
    axes.legend(fontsize=8)
    return save(figure, file)


def save(figure, file: Path) -> Path:
    figure.savefig(file, metadata={"Software": None})
    return file
