"""Peak memory of encoding a clip, and the same clip repeated in time.

It must not grow with the number of frames. All encodings have segments as long as those of the single clip, so that
only the number of frames differs. Every encoding, and every writing of a longer clip, has its own process, which runs
this module.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.encoding.segments.segmentation import split_segments
from athcodec.exporters.hdf5 import Hdf5Writer
from athcodec.options import MIN_SEGMENT
from bench.clips import add_clips, add_number, add_rel_error
from bench.tables import table

STATUS = Path("/proc/self/status")
ROOT = Path(__file__).resolve().parent.parent
REPEATS = (4, 8)

NOTE = """
Times: repetitions of the clip in a gzip-compressed HDF5 file; all in segments of the same length.
Positions: raw size of the clip. Peak: largest resident memory of the process; imports: the same
before anything is read. A few segments are processed at once: clips with fewer need less.
HDF5's chunk cache, at most 16 MiB, is included: it fills as a clip gets longer.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_number(parser, "--repeats", REPEATS, "repetitions of the clip")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Encode each clip, and the clip repeated several times, in processes of their own. Return the table of their peak
    memory.
    """
    rows = []
    for path in args.clips:
        segment = str(_segment_frames(path))
        for repeats in (1, *args.repeats):
            with tempfile.TemporaryDirectory() as folder:
                longer, file = str(Path(folder) / "clip.h5"), str(Path(folder) / "clip.ath")
                _process("repeat", str(path.resolve()), longer, str(repeats))
                peak = _process("encode", longer, file, str(args.rel_error), segment)
            rows.append({"clip": path.stem, "times": repeats} | _row(peak))
    return {
        "tables": [table(f"Peak memory of encoding, bound {args.rel_error:g}, MB of 1,000,000 bytes", rows, NOTE)],
        "broken": [],
    }


def _segment_frames(path: Path) -> int:
    with athcodec.read(path) as clip:
        segments = split_segments(clip.frame_count, clip.vertex_count)
    return max(MIN_SEGMENT, *(stop - start for start, stop in segments))


def _process(*words: str) -> dict[str, int]:
    command = [sys.executable, "-m", "bench.memory", *words]
    done = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def _row(peak: dict[str, int]) -> dict[str, float | int]:
    """Return the table's row from the figures of `_encode`, with bytes as megabytes of 1,000,000 bytes."""
    return {
        "frames": peak["frames"],
        "segments": peak["segments"],
        "positions": peak["raw_bytes"] / 1e6,
        "file": peak["bytes"] / 1e6,
        "imports": peak["imports"] / 1e6,
        "peak": peak["peak"] / 1e6,
        "peak - imports": (peak["peak"] - peak["imports"]) / 1e6,
    }


# ---- the process that is measured ----


def _encode(source: str, target: str, rel_error: float, segment_frames: int) -> dict[str, int]:
    """Encode a source file to `target`. Return the numbers of frames and segments, the bytes of the positions and of
    the file, and the peak memory of this process after its imports and at the end, in bytes.
    """
    imports = peak_bytes()
    with athcodec.read(source) as clip:
        summary = athcodec.encode(clip, target, rel_error=rel_error, segment_frames=segment_frames, attributes="none")
        frames = clip.frame_count
    peak = peak_bytes()
    with athcodec.open(target) as decoder:
        segments = len(decoder.segments)
    return {
        "frames": frames,
        "segments": segments,
        "raw_bytes": summary.raw_bytes,
        "bytes": summary.bytes,
        "imports": imports,
        "peak": peak,
    }


def _repeat(source: str, target: str, times: int) -> dict[str, int]:
    """Write the clip of `source` to `target`, repeated `times` times, as gzip-compressed HDF5. Return its number of
    frames as "frames".
    """
    with athcodec.read(source) as clip:
        period = clip.frame_count / clip.fps
        time = np.concatenate([clip.time + period * i for i in range(times)])
        with Hdf5Writer(
            target,
            time=time,
            vertex_branch=clip.vertex_branch,
            branch_parent=clip.branch_parent,
            rest=clip.source_rest,
            dtype=clip.dtype,
            stem_index=clip.stem_index,
            edges=clip.edges,
            metadata=clip.metadata,
            gzip=True,
        ) as writer:
            for _ in range(times):
                for _, frames in clip.blocks():
                    writer.add(frames)
    return {"frames": len(time)}


def peak_bytes() -> int:
    """Return the largest resident memory of this process so far. On Linux getrusage would count what the parent
    process had when it started this one; /proc does not.
    """
    if STATUS.exists():
        return int(re.search(r"VmHWM:\s+(\d+)", STATUS.read_text())[1]) * 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


if __name__ == "__main__":  # encode CLIP.h5 OUT.ath REL_ERROR SEGMENT_FRAMES, or repeat CLIP.h5 OUT.h5 TIMES
    verb, source, target, *numbers = sys.argv[1:]
    if verb == "encode":
        result = _encode(source, target, float(numbers[0]), int(numbers[1]))
    else:
        result = _repeat(source, target, int(numbers[0]))
    print(json.dumps(result))
