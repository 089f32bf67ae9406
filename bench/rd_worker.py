"""The worker processes of rd.py: one encodes a clip with a codec, another decodes and measures.

    python -m bench.rd_worker encode CODEC CLIP BOUND FILE SECONDS
    python -m bench.rd_worker decode CODEC CLIP BOUND FILE SECONDS

The second gets only the file from the first, so that its output depends on these bytes alone; it reads the clip after
decoding. Peak memory is that of the whole process. A codec that crashes ends only its own process, and the system ends
one that takes more than SECONDS of processor time. BOUND is a fraction of the bounding box's diagonal. Prints one line
of JSON.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.branch_trials import best_branches
from athcodec.encoding.search.progress import Work
from athcodec.metrics import ErrorMeter, bits_per_vertex_frame
from athcodec.motion.branches.result import with_branches
from bench.codec_registry import OURS, chosen
from bench.codecs import Codec, Source
from bench.codecs.ours import LayeredAthcodec
from bench.codecs.program import CannotKeep
from bench.levels import measured_levels
from bench.memory import peak_bytes
from bench.speed import processor_seconds


def encode(codec: Codec, clip_path: str, rel_bound: float, file: Path, limit: float) -> dict[str, Any]:
    """Encode the clip at `clip_path` with a codec and write the bytes to `file`. `rel_bound` is the error bound over
    the diagonal and `limit` the seconds of processor time allowed. Return the bytes, seconds, peak memory and settings.
    """
    with athcodec.read(clip_path) as clip:
        source = Source(_with_branches(clip, codec, rel_bound))
        bound = rel_bound * source.diagonal
        _ = source.rest
        seconds, cpu_seconds, data = _timed(partial(codec.encode, source, bound), limit)
    file.write_bytes(data)
    figures = {"bytes": len(data), "encode_s": seconds, "encode_cpu_s": cpu_seconds}
    return figures | {"encode_peak_bytes": peak_bytes(), "settings": _words(codec.settings)}


def decode(codec: Codec, clip_path: str, rel_bound: float, file: Path, limit: float) -> dict[str, Any]:
    """Decode the bytes of `file` with a codec and compare them with the clip at `clip_path`. `limit` is the seconds of
    processor time allowed. Return errors, seconds, peak memory and bits per vertex and frame.
    """
    data = file.read_bytes()
    codec.decode(data)  # a warm-up: only its memory counts
    peak = peak_bytes()
    seconds, _, decoded = _timed(partial(codec.decode, data), limit)
    with athcodec.read(clip_path) as clip:
        result = _errors(Source(clip), decoded, rel_bound)
        rate = bits_per_vertex_frame(len(data), clip.frame_count, clip.vertex_count)
        if isinstance(codec, LayeredAthcodec):
            result |= _levels(data, clip)
    return result | {"decode_s": seconds, "decode_peak_bytes": peak, "bits": rate}


def _with_branches(clip: athcodec.MotionClip, codec: Codec, rel_bound: float) -> athcodec.MotionClip:
    """Return the clip as a codec gets it: where the source names no branches, other codecs are given those that
    athcodec finds, so that none of them loses for want of an order. Finding them is not counted."""
    if clip.has_branches or codec.kind == OURS:
        return clip
    option = BoundOption(rel_error=rel_bound) if rel_bound else BoundOption(lossless=True)
    return with_branches(clip, best_branches(clip, option, Work())[0])


def _timed(step: Callable[[], Any], limit: float) -> tuple[float, float, Any]:
    """Return wall time, processor time with all threads and child processes, and the result of a step of at most
    `limit` s."""
    start, used = time.perf_counter(), processor_seconds()
    allowed = int(time.process_time() + limit) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (allowed, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    result = step()
    return time.perf_counter() - start, processor_seconds() - used, result


def _errors(source: Source, decoded: np.ndarray, rel_bound: float) -> dict[str, Any]:
    """Return the largest, RMS and Karni-Gotsman errors ("max", "rms", "kg") of decoded positions, the first two over
    the diagonal. "broken" is a sentence, present if the type, the shape or the largest error is wrong.
    """
    shape = source.positions.shape
    if getattr(decoded, "shape", None) != shape or decoded.dtype != np.float32:
        is_array = isinstance(decoded, np.ndarray)
        got = f"{decoded.dtype} {decoded.shape}" if is_array else type(decoded).__name__
        return {"broken": f"got {got}; expected float32 {shape}"}
    bound = rel_bound * source.diagonal
    meter = ErrorMeter(source.rest)
    meter.add(source.positions, decoded)
    errors = {"max": meter.max_error / source.diagonal, "rms": meter.rms_error / source.diagonal, "kg": meter.kg_error}
    if not meter.max_error <= bound:
        errors["broken"] = f"got an error of {meter.max_error:.6g}; expected at most {bound:.6g}"
    return errors


def _levels(data: bytes, clip: athcodec.MotionClip) -> dict[str, float | None]:
    """Return the worst growth of the error from one level of a file to the next, by largest and RMS error, and how much
    the decoded motion and the source jerk at seams between segments.
    """
    with athcodec.open(data, strict=True) as decoder:
        meters = measured_levels(decoder, clip)

    def growth(errors: list[float]) -> float | None:
        return max((after / before for before, after in zip(errors, errors[1:]) if before), default=None)

    worst = max(meters, key=lambda meter: meter.smoothness.tick_ratio or 0).smoothness
    return {
        "level_max_ratio": growth([meter.error.max_error for meter in meters]),
        "level_rms_ratio": growth([meter.error.rms_error for meter in meters]),
        "tick_ratio": worst.tick_ratio,
        "source_tick_ratio": worst.source_tick_ratio,
    }


def _words(settings: Any) -> str:
    """Return settings on one line."""
    if isinstance(settings, dict):
        return ", ".join(f"{name} {_words(value)}" for name, value in settings.items())
    if isinstance(settings, (list, tuple, np.ndarray)):
        return " ".join(map(_words, settings))
    return f"{settings:.4g}" if isinstance(settings, (float, np.floating)) else str(settings)


if __name__ == "__main__":
    verb, name, clip, bound, target, seconds = sys.argv[1:]
    [codec] = chosen([name]).values()
    try:
        result = {"encode": encode, "decode": decode}[verb](codec, clip, float(bound), Path(target), float(seconds))
    except CannotKeep as error:
        result = {"cannot": str(error)}
    print(json.dumps(result))
