"""Shared by the verbs: clips from the command line, a clip encoded into a temporary file, errors of decoded
positions.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import athcodec
from athcodec.metrics import ErrorMeter
from athcodec.options import EFFORTS, LADDERS, ladder_of
from athcodec.sources import FRAME_SUFFIXES
from athcodec.sources.numbering import numbered_files

REL_ERROR = 1e-4
POLYGONS = ("face_vertex_counts", "face_vertex_indices")  # Attributes that hold the faces of a clip of many sizes.
POSITIONS: dict[str, Any] = {"attributes": "none", "ladder": "none"}  # Options of a file of positions in one layer.


@dataclass(frozen=True)
class Encoded:
    """A clip, the summary of its encoding, and the opened file."""

    clip: athcodec.MotionClip
    summary: athcodec.Summary
    decoder: athcodec.Decoder


def files_of(path: Path) -> list[Path]:
    """Return the files that a clip lies in: `path`, the other frames of a sequence, the arrays beside an XDMF file."""
    beside = path.parent.glob(f"{path.stem}.h5") if path.suffix == ".xdmf" else ()
    frames = numbered_files(path).paths if path.suffix in FRAME_SUFFIXES else ()
    return sorted({path, *frames, *beside})


def add_clips(parser: argparse.ArgumentParser, kinds: str = "motion clips") -> None:
    """Add the positional argument `clips` to a parser: paths of source files, by default the sample that ships with
    athcodec. `kinds` names the accepted files in the help.
    """
    parser.add_argument(
        "clips",
        nargs="*",
        type=Path,
        metavar="CLIP",
        default=[athcodec.sample_path()],
        help=f"{kinds}; by default the sample that ships with athcodec",
    )


def add_number(parser: argparse.ArgumentParser, name: str, default: Any, text: str, metavar: str = "N") -> None:
    """Add an option that takes a number, or several where its default is several."""
    several = {"nargs": "+"} if isinstance(default, tuple) else {}
    kind = type(default[0] if several else default)
    parser.add_argument(
        name, type=kind, default=default, metavar=metavar, help=f"{text} (default %(default)s)", **several
    )


def add_rel_error(parser: argparse.ArgumentParser, default: Any = REL_ERROR) -> None:
    add_number(parser, "--rel-error", default, "error bound over the bounding box's diagonal", "FRACTION")


def add_ladder(parser: argparse.ArgumentParser, default: str) -> None:
    """Add the option `--ladder` to a parser: the largest errors of the layers over the diagonal. `default` names the
    entry of LADDERS that is used without the option.
    """
    parser.add_argument(
        "--ladder",
        type=ladder_of,
        default=LADDERS[default],
        metavar="ERROR,...",
        help=f"largest errors of the layers over the diagonal (default: {default})",
    )


def add_effort(parser: argparse.ArgumentParser, default: str = "default") -> None:
    parser.add_argument("--effort", choices=EFFORTS, default=default, help="the encoder's effort (default %(default)s)")


def file_and_seconds(clip: athcodec.MotionClip, **options: Any) -> tuple[bytes, float]:
    """Return the file of a clip, and seconds of the processor."""
    start = time.process_time()
    data = athcodec.encode(clip, **options)
    return data, time.process_time() - start


@contextmanager
def encoded(
    path: Path,
    rel_error: float,
    effort: str = "default",
    ladder: Sequence[float] = (),
    host_rest: bool = False,
    segment_frames: int | None = None,
) -> Iterator[Encoded]:
    """Encode the clip at `path` without attributes and yield the result with an open decoder; the .ath file is deleted
    with the context. `rel_error` is the error bound over the diagonal, `ladder` the larger errors at which layers end,
    and `host_rest` leaves the rest pose out of the file.
    """
    with tempfile.TemporaryDirectory() as folder, athcodec.read(path) as clip:
        file = Path(folder) / "clip.ath"
        settings = {"attributes": "none", "effort": effort, "ladder": ladder, "host_rest": host_rest}
        options = {"rel_error": rel_error, "rest_error": "bound", "segment_frames": segment_frames}
        summary = athcodec.encode(clip, file, **options | settings)
        with athcodec.open(file, strict=True, host_mesh=clip) as decoder:
            yield Encoded(clip, summary, decoder)


def measure(
    clip: athcodec.MotionClip, decoder: athcodec.Decoder, level: int | None = None, frames: slice | None = None
) -> ErrorMeter:
    """Return errors of the positions decoded at a level (default: the deepest), in the file's own float type."""
    meter = ErrorMeter(clip.rest)
    for start, block in decoder.blocks(level, frames=frames):
        meter.add(clip.block(start, start + len(block)), block)
    return meter


def beginning(clip: athcodec.MotionClip, frames: int) -> athcodec.MotionClip:
    """Return the first `frames` frames of a clip, read into memory, with its branches, edges and faces but without
    other attributes.
    """
    return athcodec.MotionClip(
        clip.block(0, min(frames, clip.frame_count)),
        clip.time[:frames],
        clip.vertex_branch,
        clip.branch_parent,
        clip.source_rest,
        clip.edges,
        clip.faces,
        {name: clip.attributes[name] for name in POLYGONS if name in clip.attributes},
        metadata=clip.metadata,
        stem_index=clip.stem_index,
    )
