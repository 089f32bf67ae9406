"""How smooth each level moves, of clips and of .ath files: second differences over frames, and ticks at seams."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.arrays import clip_of
from athcodec.decoding.file_tables import Level
from athcodec.metrics import MotionMeter, level_meters
from bench.clips import add_clips, add_effort, add_ladder, add_rel_error, add_segment_frames, encoded
from bench.tables import table

SAMPLES = ("leafed", "fern", "grass")
MOST = 2.0  # The encoder keeps the second differences of levels below so many times the source's.
SHEET_LEVEL, SHEET_FRAMES, SHEET_VERTICES, SHEET_DPI = 1, 4, 1500, 110

NOTE = """
d2: second difference over frames of the error, in bounds of the level: the largest error that it promises, at least
the file's. Share: of vertices whose d2 is above 1, in the worst and in the median frame. Tick ratio: RMS over vertices
of the decoded positions' second difference in the worst frame within two of a seam between segments, or of a loop's
seam, over the median frame; beside it the source's own in the same frames. Stretch of edges, and degrees by which
normals of faces are off: RMS. Over source: the RMS second difference over the source's largest within two frames, or
half the bound, in the frame where that is worst. The source of an .ath file is its deepest level.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_ladder(parser, "decades")
    add_segment_frames(parser)
    add_effort(parser)
    parser.add_argument("--all", action="store_true", help="all clips of all .ath files that ship with athcodec")
    parser.add_argument(
        "--sheet", type=Path, metavar="FILE.png", help=f"draw level {SHEET_LEVEL} of .ath files over their loops' wrap"
    )
    parser.add_argument(
        "--before",
        type=Path,
        metavar="FOLDER",
        help="with --sheet: what is drawn beside a clip, STEM.CLIP.h5, by `athcodec decode --level 1 --clip CLIP`",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    files = [*map(athcodec.sample_path, SAMPLES), athcodec.sample_path()] if args.all else args.clips
    how = {"effort": args.effort, "ladder": args.ladder, "segment_frames": args.segment_frames}
    tables, broken, loops = [], [], []
    for path in files:
        for name in _clips_in(path):
            with _opened(path, name, args.rel_error, how) as (decoder, clip):
                meters = measured_levels(decoder, clip)
                rows = [_row(stored, meter) for stored, meter in zip(decoder.levels, meters, strict=True)]
                if args.sheet and decoder.clip.loop:
                    loops.append((path.stem, name, _around(decoder.positions(level=SHEET_LEVEL))))
                may_jerk = decoder.file.header.is_predicted
            title = " ".join([path.stem, name]).rstrip()
            tables.append(table(f"Smoothness: {title}", rows, NOTE))
            if not may_jerk:
                broken += [
                    f"{title}, level {row['level']}: got {row['over source']:.3f} times the source's second difference "
                    f"in frame {row['in frame']}; expected at most {MOST:g}"
                    for row in rows
                    if row["over source"] > MOST
                ]
    if args.sheet:
        _sheet(loops, args.before).savefig(args.sheet, metadata={"Software": None})
    return {"tables": tables, "broken": broken}


def measured_levels(decoder: athcodec.Decoder, clip: athcodec.MotionClip) -> list[MotionMeter]:
    """Return a meter for each level, with all frames."""
    meters = level_meters(decoder, clip)
    for start, stop in decoder.segments:
        source = clip.block(start, stop)
        for number, meter in enumerate(meters):
            meter.add(source, decoder.positions(slice(start, stop), number))
    return meters


def _clips_in(path: Path) -> list[str]:
    """The names of a file's clips; one without a name where the file is to be encoded first."""
    if path.suffix != ".ath":
        return [""]
    with athcodec.open(path) as decoder:
        return [clip.name for clip in decoder.file.clips]


@contextmanager
def _opened(
    path: Path, name: str, rel_error: float, how: dict[str, Any]
) -> Iterator[tuple[athcodec.Decoder, athcodec.MotionClip]]:
    """A clip of an .ath file and its deepest level, or a clip that is encoded first and that clip itself."""
    if path.suffix != ".ath":
        with encoded(path, rel_error, **how) as result:
            yield result.decoder, result.clip
    else:
        with athcodec.open(path, clip=name) as decoder, clip_of(decoder) as (clip, _):
            yield decoder, clip


def _row(stored: Level, meter: MotionMeter) -> dict[str, Any]:
    smoothness, figures = meter.smoothness, meter.figures()
    return {
        "level": stored.level,
        "name": stored.name,
        "bytes": stored.bytes,
        "d2 max": smoothness.max_error_acceleration,
        "d2 RMS": smoothness.rms_error_acceleration,
        "share": smoothness.worst_share,
        "median share": smoothness.median_share,
        "tick ratio": smoothness.tick_ratio,
        "source's": smoothness.source_tick_ratio,
        "over source": figures["smoothness"]["acceleration_ratio"],
        "in frame": figures["smoothness"]["acceleration_ratio_frame"],
        "stretch": figures["shape"]["rms_stretch"],
        "normals": figures["shape"]["rms_normal_angle"],
    }


# ---- the sheet ----


def _around(positions: np.ndarray) -> np.ndarray:
    """The frames on both sides of a loop's wrap, of some vertices."""
    frames = np.arange(-SHEET_FRAMES, SHEET_FRAMES) % len(positions)
    chosen = np.linspace(0, positions.shape[1] - 1, min(SHEET_VERTICES, positions.shape[1])).astype(int)
    return positions[frames][:, chosen]


def _sheet(loops: list[tuple[str, str, np.ndarray]], before: Path | None) -> Any:
    """Paths of vertices over the wrap, the step from the last frame to the first in red; a column for each clip."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise SystemExit('--sheet: matplotlib is not installed: pip install "athcodec[bench]"') from None
    rows = 1 + (before is not None)
    figure = Figure(figsize=(5 * len(loops), 5 * rows), dpi=SHEET_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, len(loops))
    for (stem, name, now), cells in zip(loops, np.reshape(axes, (rows, len(loops))).T, strict=True):
        shown = [("", now)]
        if before:
            with athcodec.read(before / f"{stem}.{name}.h5") as clip:
                shown.insert(0, (", before", _around(clip.block(0, clip.frame_count))))
        for cell, (when, paths) in zip(cells, shown, strict=True):
            _draw_paths(cell, f"{stem}, {name}, level {SHEET_LEVEL}{when}", paths)
    return figure


def _draw_paths(axes: Any, title: str, paths: np.ndarray) -> None:
    steps = np.sqrt(np.square(np.diff(paths, axis=0)).sum(axis=2).mean(axis=1))
    usual = np.median(np.delete(steps, SHEET_FRAMES - 1))
    axes.plot(paths[0, :, 0], paths[0, :, 1], ".", color="#cccccc", markersize=2)
    sides = paths[:SHEET_FRAMES], paths[SHEET_FRAMES:], paths[SHEET_FRAMES - 1 : SHEET_FRAMES + 1]
    for frames, colour in zip(sides, ("#7A7A7A", "#0072B2", "#D55E00"), strict=True):
        axes.plot(frames[:, :, 0], frames[:, :, 1], linewidth=0.7, color=colour)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(
        f"{title}\nRMS step over the wrap {steps[SHEET_FRAMES - 1]:.2g} m, of others {usual:.2g} m", fontsize=9
    )
