"""The worker processes of rd.py: one encodes a clip with a codec, another decodes and measures.

    python -m bench.rd_worker encode CODEC CLIP.h5 BOUND FILE
    python -m bench.rd_worker decode CODEC CLIP.h5 BOUND FILE

The second gets only the file from the first, so that its output depends on these bytes alone; it reads the clip after
decoding. Peak memory is that of the whole process. A codec that crashes ends only its own process. BOUND is a fraction
of the bounding box's diagonal. Prints one line of JSON.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import athcodec
from athcodec.metrics import MotionMeter, bits_per_vertex_frame
from bench.codec_registry import OURS, chosen
from bench.codecs import Source
from bench.codecs.program import CannotKeep
from bench.memory import peak_bytes

ENCODES, QUICK_ENCODE = 3, 1.0  # an encoder that takes longer than these seconds runs once
DECODES, DECODE_SECONDS = 7, 5.0  # fewer decodes, at least three, where they take longer than this together


def encode(codec_name: str, clip_path: str, rel_bound: float, file: Path) -> dict[str, Any]:
    [codec] = chosen([codec_name]).values()
    with athcodec.read_hdf5(clip_path) as clip:
        bound = rel_bound * Source(clip).diagonal
        runs: list[float] = []
        if not clip.has_branches and codec.kind != OURS:  # only athcodec finds some
            clip = clip.replace(vertex_branch=np.zeros(clip.vertex_count, np.int32), branch_parent=np.array([-1]))
        while not runs or (runs[0] < QUICK_ENCODE and len(runs) < ENCODES):
            source = _loaded(clip)  # a new one, since codecs may cache results in it
            seconds, data = _timed(partial(codec.encode, source, bound))
            runs.append(seconds)
    peak = peak_bytes()
    file.write_bytes(data)
    return {
        "bytes": len(data),
        "encode_s": median(runs),
        "encode_runs": len(runs),
        "encode_peak_bytes": peak,
        "settings": _words(codec.settings),
    }


def decode(codec_name: str, clip_path: str, rel_bound: float, file: Path) -> dict[str, Any]:
    [codec] = chosen([codec_name]).values()
    data = file.read_bytes()
    decoded = codec.decode(data)  # a warm-up: only its memory counts
    peak = peak_bytes()
    runs: list[float] = []
    while len(runs) < DECODES and (len(runs) < 3 or sum(runs) < DECODE_SECONDS):
        seconds, decoded = _timed(lambda: codec.decode(data))
        runs.append(seconds)
    with athcodec.read_hdf5(clip_path) as clip:
        result = _errors(Source(clip), decoded, rel_bound)
        rate = bits_per_vertex_frame(len(data), clip.frame_count, clip.vertex_count)
    return result | {"decode_s": median(runs), "decode_runs": len(runs), "decode_peak_bytes": peak, "bits": rate}


def _loaded(clip: athcodec.MotionClip) -> Source:
    source = Source(clip)
    _ = source.positions, source.rest
    return source


def _timed(step: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    result = step()
    return time.perf_counter() - start, result


def _errors(source: Source, decoded: np.ndarray, rel_bound: float) -> dict[str, Any]:
    """Errors over the diagonal; "broken" describes a wrong type, shape or error."""
    shape = source.positions.shape
    if getattr(decoded, "shape", None) != shape or decoded.dtype != np.float32:
        is_array = isinstance(decoded, np.ndarray)
        got = f"{decoded.dtype} {decoded.shape}" if is_array else type(decoded).__name__
        return {"broken": f"got {got}; expected float32 {shape}"}
    bound = rel_bound * source.diagonal
    meter = MotionMeter(source.clip, bound=bound or 1.0)  # lossless: second differences of 0 in any unit
    meter.add(source.positions, decoded)
    figures = meter.figures()
    errors = {
        "max": meter.error.max_error / source.diagonal,
        "rms": meter.error.rms_error / source.diagonal,
        "kg": meter.error.kg_error,
        "motion": meter.error.motion_normalised_error,
        "looks": figures["smoothness"] | figures["shape"],
    }
    if not meter.error.max_error <= bound:
        errors["broken"] = f"got an error of {meter.error.max_error:.6g}; expected at most {bound:.6g}"
    return errors


def _words(settings: Any) -> str:
    """Settings on one line."""
    if isinstance(settings, dict):
        return ", ".join(f"{name} {_words(value)}" for name, value in settings.items())
    if isinstance(settings, (list, tuple, np.ndarray)):
        return " ".join(map(_words, settings))
    return f"{settings:.4g}" if isinstance(settings, (float, np.floating)) else str(settings)


if __name__ == "__main__":
    verb, name, clip, bound, target = sys.argv[1:]
    try:
        result = {"encode": encode, "decode": decode}[verb](name, clip, float(bound), Path(target))
    except CannotKeep as error:
        result = {"cannot": str(error)}
    print(json.dumps(result))
