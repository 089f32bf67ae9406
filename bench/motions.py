"""Several motions of one plant in one file: its size compared with one file per motion, and the errors at the seams.

The motions are consecutive windows of each clip, all as loops with some frames blended; every file has the same bound
in scene units, checked by decoding.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import athcodec
from bench.clips import add_clips, add_rel_error, measure
from bench.tables import table

NOTE = """
One clip: the unchanged source, whose frames are those of the motions and the blended ones. Seam: largest distance,
over all loops and at the deepest level, between the decoded step over the seam and that of the motion, over the bound;
2 at most.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    parser.add_argument("--motions", type=int, nargs="+", default=[2, 4], metavar="N", help="windows of a clip")
    parser.add_argument("--blend", type=int, default=4, metavar="FRAMES", help="frames blended in each window")


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows, broken = [], []
    for path in args.clips:
        for count in args.motions:
            rows.append(_row(path, count, args.blend, args.rel_error))
            if not rows[-1]["kept"]:
                broken.append(f"{path.name}, {count} motions: got an error beyond the bound")
    return {"tables": [table(f"Motions of one plant, bound {args.rel_error:g}", rows, NOTE)], "broken": broken}


def _row(path: Path, count: int, blend: int, rel_error: float) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder, athcodec.read_hdf5(path) as clip:
        file = Path(folder, "a.ath")
        whole = athcodec.encode(clip, file, rel_error=rel_error, attributes="none")
        bound, motions = whole.max_error_bound, dict(_windows(clip, count, blend))
        apart = [athcodec.encode(motion, file, max_error=bound, attributes="none").bytes for motion in motions.values()]
        joined = athcodec.encode(athcodec.join(motions), file, max_error=bound, attributes="none")
        with athcodec.open(file, strict=True) as decoder:
            error = max(measure(motion, decoder.play(name)).max_error for name, motion in motions.items())
    return {
        "clip": path.stem,
        "motions": count,
        "frames": sum(motion.frame_count for motion in motions.values()),
        "bytes, one clip": whole.bytes,
        "bytes, a file each": sum(apart),
        "bytes, one file": joined.bytes,
        "one file / a file each": joined.bytes / sum(apart),
        "seam": max(s.error for s in joined.seams) / bound,
        "kept": error <= bound,
    }


def _windows(clip: athcodec.MotionClip, count: int, blend: int) -> Iterator[tuple[str, athcodec.MotionClip]]:
    for index in range(count):
        start, stop = clip.frame_count * index // count, clip.frame_count * (index + 1) // count
        part = dataclasses.replace(
            clip,
            positions=clip.block(start, stop),
            time=clip.time[: stop - start],
            rest=clip.rest.astype(clip.rest_dtype),
        )
        yield f"{start}", athcodec.looped(part, blend)
