"""What the verbs share: clips from the command line, a clip encoded into a temporary file, decoded errors."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import athcodec
from athcodec.metrics import ErrorMeter

REL_ERROR = 1e-4


@dataclass(frozen=True)
class Encoded:
    """A clip, what encoding it said, and the opened result."""

    clip: athcodec.MotionClip
    summary: athcodec.Summary
    decoder: athcodec.Decoder


def add_clips(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("clips", nargs="*", type=Path, metavar="CLIP.h5", default=[athcodec.sample_path()],
                        help="motion clips; by default the sample that ships with athcodec")


def add_rel_error(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rel-error", type=float, default=REL_ERROR, metavar="FRACTION",
                        help="error bound over the bounding box's diagonal (default %(default)s)")


@contextmanager
def encoded(path: Path, rel_error: float, effort: str = "default") -> Iterator[Encoded]:
    """The clip at `path`, encoded without attributes into a file that goes away with the context."""
    with tempfile.TemporaryDirectory() as folder, athcodec.read_hdf5(path) as clip:
        file = Path(folder) / "clip.ath"
        summary = athcodec.encode(clip, file, rel_error=rel_error, attributes="none", effort=effort)
        with athcodec.open(file, strict=True) as decoder:
            yield Encoded(clip, summary, decoder)


def measure(clip: athcodec.MotionClip, decoder: athcodec.Decoder, depth: int | None = None) -> ErrorMeter:
    """Errors of the positions decoded at a depth (default: the deepest), in the file's own float type."""
    meter = ErrorMeter(clip.rest)
    for start, frames in decoder.blocks(depth):
        meter.add(clip.block(start, start + len(frames)), frames)
    return meter
