"""How smooth each level moves, of clips and of .ath files: second differences over frames, and ticks at seams."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import athcodec
from athcodec.arrays import clip_of
from athcodec.decoding.file_tables import Level
from athcodec.metrics import MotionMeter, level_meters
from bench.clips import add_clips, add_effort, add_ladder, add_rel_error, add_segment_frames, encoded
from bench.tables import table

SAMPLES = ("leafed", "fern", "grass")
MOST = 2.0  # The encoder keeps the second differences of levels below so many times the source's.

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


def run(args: argparse.Namespace) -> dict[str, Any]:
    files = [*map(athcodec.sample_path, SAMPLES), athcodec.sample_path()] if args.all else args.clips
    how = {"effort": args.effort, "ladder": args.ladder, "segment_frames": args.segment_frames}
    tables, broken = [], []
    for path in files:
        for name in _clips_in(path):
            with _opened(path, name, args.rel_error, how) as (decoder, clip):
                meters = measured_levels(decoder, clip)
                rows = [_row(stored, meter) for stored, meter in zip(decoder.levels, meters, strict=True)]
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
