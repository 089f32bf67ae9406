"""How smooth each level of a clip moves: second differences over frames, ticks at seams, as a table and a picture."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.decoding.file_tables import Level
from athcodec.metrics import MotionMeter, SmoothnessMeter, level_meters
from bench import plots
from bench.clips import add_clips, add_effort, add_ladder, add_rel_error, add_segment_frames, encoded
from bench.tables import table

INCHES = (12, 8)

NOTE = """
d2: second difference over frames of the error, in bounds of the level: the largest error that it promises, at least
the file's. Share: of vertices whose d2 is above 1, in the worst and in the median frame. Tick ratio: RMS over vertices
of the decoded positions' second difference in the worst frame within two of a seam between segments, or of a loop's
seam, over the median frame; beside it the source's own in the same frames. Stretch of edges, and degrees by which
normals of faces are off: RMS.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_ladder(parser, "decades")
    add_segment_frames(parser)
    add_effort(parser)
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="FILE.png",
        help="draw the second differences of the first clip over its frames, seams marked",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    tables = []
    for number, path in enumerate(args.clips):
        how = {"effort": args.effort, "ladder": args.ladder, "segment_frames": args.segment_frames}
        with encoded(path, args.rel_error, **how) as result:
            meters = measured_levels(result.decoder, result.clip)
            rows = [_row(stored, meter) for stored, meter in zip(result.decoder.levels, meters, strict=True)]
        title = f"{path.stem}, bound {args.rel_error:g}"
        tables.append(table(f"Smoothness: {title}", rows, NOTE))
        if args.picture and number == 0:
            names = [f"level {row['level']} ({row['name']})" for row in rows]
            plots.save(_picture([meter.smoothness for meter in meters], names, title), args.picture)
    return {"tables": tables, "broken": []}


def measured_levels(decoder: athcodec.Decoder, clip: athcodec.MotionClip) -> list[MotionMeter]:
    """Return a meter for each level, with all frames."""
    meters = level_meters(decoder, clip)
    for start, stop in decoder.segments:
        source = clip.block(start, stop)
        for number, meter in enumerate(meters):
            meter.add(source, decoder.positions(slice(start, stop), number))
    return meters


def _row(stored: Level, meter: MotionMeter) -> dict[str, Any]:
    smoothness, figures = meter.smoothness, meter.figures()
    return {
        "level": stored.level,
        "name": stored.name,
        "bytes": stored.bytes,
        "d2 max": smoothness.max_error_acceleration,
        "in frame": smoothness.worst_frame,
        "d2 RMS": smoothness.rms_error_acceleration,
        "share": smoothness.worst_share,
        "median share": smoothness.median_share,
        "tick ratio": smoothness.tick_ratio,
        "source's": smoothness.source_tick_ratio,
        "stretch": figures["shape"]["rms_stretch"],
        "normals": figures["shape"]["rms_normal_angle"],
    }


def _picture(meters: list[SmoothnessMeter], names: list[str], title: str) -> Any:
    figure, (motion, error) = plots.pyplot(INCHES, rows=2)()
    frames = np.arange(len(meters[0].acceleration))
    motion.plot(frames, meters[0].source_acceleration, color="black", linewidth=3.5, alpha=0.3, label="source")
    for number, (meter, name) in enumerate(zip(meters, names, strict=True)):
        style = {"color": plots.COLOURS[number % len(plots.COLOURS)], "linewidth": 1.4}
        motion.plot(frames, meter.acceleration, label=name, **style)
        error.plot(frames, meter.error_acceleration, **style)
    for seam in meters[0].seams:
        for axes in (motion, error):
            axes.axvline(seam - 0.5, color="#444444", linestyle=":", linewidth=1.2, zorder=0)
    motion.set_title(f"{title}: second differences over frames, RMS over vertices; dotted: seams")
    motion.set_ylabel("of the motion, scene units")
    error.set_ylabel("of the error, scene units")
    error.set_xlabel("frame")
    for axes in (motion, error):
        axes.set_yscale("log")
        axes.grid(True, which="major", color="#dddddd", linewidth=0.8)
        axes.margins(x=0.01)
    figure.legend(fontsize=9, loc="outside right upper")
    return figure
