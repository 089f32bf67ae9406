"""The worker process of memory.py: encodes a clip and prints its peak memory, or writes a longer clip.

python -m bench.memory_worker encode CLIP OUT.ath REL_ERROR SEGMENT_FRAMES
python -m bench.memory_worker repeat CLIP OUT.h5 TIMES
"""

from __future__ import annotations

import json
import resource
import sys

import numpy as np

import athcodec
from athcodec.exporters.hdf5 import Hdf5Writer


def encode(source: str, target: str, rel_error: float, segment_frames: int) -> dict[str, int]:
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


def repeat(source: str, target: str, times: int) -> dict[str, int]:
    """Writes the clip repeated `times` times, gzip-compressed."""
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
    """Largest resident memory of this process so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


if __name__ == "__main__":
    verb, source, target, *numbers = sys.argv[1:]
    if verb == "encode":
        result = encode(source, target, float(numbers[0]), int(numbers[1]))
    else:
        result = repeat(source, target, int(numbers[0]))
    print(json.dumps(result))
