"""Pictures of rate and distortion, one set per clip, as PNG, by matplotlib (of the extra `bench` alone).

Rate against the largest error and against the RMS error, both axes logarithmic; prefixes over files of their own.
Colours are those of Okabe and Ito ("Color universal design", 2008), which colour-blind people
can tell apart, without the yellow, which is faint on white; every curve has its own marker too, so that the
pictures are readable in grey.
"""

from __future__ import annotations

import re
from itertools import cycle
from pathlib import Path
from typing import Any

from bench.codec_registry import OURS
from bench.compare import Point, is_pca, measured

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#7A7A7A")
MARKERS = "svDP<>pXh8*d^"
STYLES = {"baseline": "-", "program": "--"}
MISSING = 'matplotlib is not installed, so there are no pictures: pip install "athcodec[bench]"'
INCHES, DPI = (12, 6), 110
ERRORS = {"max": "largest error / bounding-box diagonal", "rms": "RMS error / bounding-box diagonal"}


class NoPlots(Exception):
    """matplotlib is missing; the message says what to do."""


def draw(contents: dict[str, list[dict[str, Any]]], clip: str, folder: Path, prefix: str = "") -> list[Path]:
    """Writes the pictures of a clip and returns their files. Raises NoPlots."""
    figure_of = pyplot(INCHES)
    points = measured(point for point in contents["points"] if point["clip"] == clip)
    pictures = {error: _rate_picture(figure_of, points, error, clip) for error in ERRORS if points}
    return [save(figure, folder / file_name(prefix + clip, what)) for what, figure in pictures.items()]


def pyplot(inches: tuple[float, float], rows: int = 1):
    """A function that makes a figure of this size and its axes, or an array of them below each other, without a
    display. Raises NoPlots.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise NoPlots(MISSING) from None

    def figure_of():
        figure = Figure(figsize=inches, dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        return figure, figure.subplots(rows, sharex=True)

    return figure_of


def file_name(clip: str, what: str) -> str:
    return f"{re.sub(r'[^A-Za-z0-9._-]+', '_', clip)}_{what}.png"


def _rate_picture(figure_of, points: list[Point], error: str, clip: str):
    figure, axes = figure_of()
    styles = zip(cycle(COLOURS[1:]), cycle(MARKERS))
    for codec in dict.fromkeys(point["codec"] for point in points):
        own = sorted((point for point in points if point["codec"] == codec), key=lambda point: point["bits"])
        own = [point for point in own if point[error] > 0]
        if not own:  # lossless points have no place on a logarithmic axis
            continue
        line = _style_of(own[0], styles)
        axes.plot([point["bits"] for point in own], [point[error] for point in own], label=codec, **line)
    name = "rate against largest error" if error == "max" else "rate against RMS error"
    _label(axes, f"{clip}: {name}", "bits per vertex and frame", ERRORS[error])
    figure.legend(fontsize=8, loc="outside right upper")
    return figure


def _style_of(point: Point, styles) -> dict[str, Any]:
    if point["kind"] == OURS:
        return {"color": COLOURS[0], "marker": "o", "linewidth": 2.6, "zorder": 5}
    colour, marker = next(styles)
    style = ":" if is_pca(point) else STYLES[point["kind"]]
    return {"color": colour, "marker": marker, "linestyle": style, "linewidth": 1.3, "markersize": 5}


def _label(axes, title: str, across: str, up: str) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:,g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_title(title)
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.grid(True, which="major", color="#dddddd", linewidth=0.8)


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
