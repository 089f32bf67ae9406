"""Pictures by matplotlib, of the extra `bench` alone, which other modules draw."""

from __future__ import annotations

from pathlib import Path

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


def save(figure, file: Path) -> Path:
    figure.savefig(file, metadata={"Software": None})
    return file
