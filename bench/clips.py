"""Shared by the verbs: clips from the command line, a clip encoded into a temporary file, errors of decoded positions,
and clips with more plants and frames.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.exporters.hdf5 import Hdf5Writer
from athcodec.metrics import ErrorMeter
from athcodec.options import EFFORTS, LADDERS, ladder_of
from athcodec.sources.sequence import FRAME_SUFFIXES, sequence_files

REL_ERROR = 1e-4
FRAMES_AHEAD = 7


@dataclass(frozen=True)
class Encoded:
    """A clip, the summary of its encoding, and the opened file."""

    clip: athcodec.MotionClip
    summary: athcodec.Summary
    decoder: athcodec.Decoder


def read(path: str | PathLike[str]) -> athcodec.MotionClip:
    """Open the clip in a file of any format, as a user would: with the default options."""
    return athcodec.read(path)


def files_of(path: Path) -> list[Path]:
    """The files that a clip lies in: `path`, the other frames of a sequence, the arrays beside an XDMF file."""
    beside = path.parent.glob(f"{path.stem}.h5") if path.suffix == ".xdmf" else ()
    frames = sequence_files(path).values() if path.suffix in FRAME_SUFFIXES else ()
    return sorted({path, *frames, *beside})


def add_clips(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "clips",
        nargs="*",
        type=Path,
        metavar="CLIP",
        default=[athcodec.sample_path()],
        help="motion clips; by default the sample that ships with athcodec",
    )


def add_number(parser: argparse.ArgumentParser, name: str, default: Any, what: str, metavar: str = "N") -> None:
    """Add an option that takes a number, or several where its default is several."""
    several = {"nargs": "+"} if isinstance(default, tuple) else {}
    kind = type(default[0] if several else default)
    parser.add_argument(
        name, type=kind, default=default, metavar=metavar, help=f"{what} (default %(default)s)", **several
    )


def add_rel_error(parser: argparse.ArgumentParser, default: Any = REL_ERROR) -> None:
    add_number(parser, "--rel-error", default, "error bound over the bounding box's diagonal", "FRACTION")


def add_ladder(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument(
        "--ladder",
        type=ladder_of,
        default=LADDERS[default],
        metavar="ERROR,...",
        help=f"largest errors of the layers over the diagonal (default: {default})",
    )


def add_segment_frames(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--segment-frames", type=int, metavar="FRAMES", help="longest segment (default: the encoder's own choice)"
    )


def add_source(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--of",
        type=Path,
        default=athcodec.sample_path(),
        metavar="CLIP.h5",
        help="the clip that those measured are made from (default: the sample)",
    )


def add_effort(parser: argparse.ArgumentParser, default: str = "default") -> None:
    parser.add_argument("--effort", choices=EFFORTS, default=default, help="the encoder's effort (default %(default)s)")


@contextmanager
def encoded(
    path: Path,
    rel_error: float,
    effort: str = "default",
    ladder: Sequence[float] = (),
    host_rest: bool = False,
    segment_frames: int | None = None,
) -> Iterator[Encoded]:
    """The clip at `path`, encoded without attributes into a file that is deleted with the context."""
    with tempfile.TemporaryDirectory() as folder, read(path) as clip:
        file = Path(folder) / "clip.ath"
        settings = {"attributes": "none", "effort": effort, "ladder": ladder, "host_rest": host_rest}
        given = {"rel_error": rel_error, "rest_error": "bound", "segment_frames": segment_frames}
        summary = athcodec.encode(clip, file, **given | settings)
        with athcodec.open(file, strict=True, host_mesh=clip) as decoder:
            yield Encoded(clip, summary, decoder)


def measure(
    clip: athcodec.MotionClip, decoder: athcodec.Decoder, level: int | None = None, frames: slice | None = None
) -> ErrorMeter:
    """Errors of the positions decoded at a level (default: the deepest), in the file's own float type."""
    meter = ErrorMeter(clip.rest)
    for start, block in decoder.blocks(level, frames=frames):
        meter.add(clip.block(start, start + len(block)), block)
    return meter


@contextmanager
def replicated_plants(path: Path) -> Iterator[ReplicatedPlants]:
    with read(path) as clip:
        yield ReplicatedPlants(clip, path.stem)


class ReplicatedPlants:
    """Copies of one plant at the same position, with its motion extended to any number of frames."""

    def __init__(self, clip: athcodec.MotionClip, name: str) -> None:
        self._clip, self.name = clip, name
        self._positions = np.asarray(clip.block(0, clip.frame_count), np.float32)

    def write(self, path: Path, plants: int, frames: int) -> None:
        """Writes an HDF5 clip."""
        source = self._clip
        parent, offset = source.branch_parent, np.arange(plants)[:, None] * source.branch_count
        index = None if source.stem_index is None else np.tile(source.stem_index, plants)
        with Hdf5Writer(
            path,
            time=np.arange(frames) / source.fps,
            vertex_branch=(source.vertex_branch + offset).ravel(),
            branch_parent=np.where(parent < 0, -1, parent + offset).ravel(),
            rest=np.tile(source.rest.astype(np.float32), (plants, 1)),
            stem_index=index,
            metadata=source.metadata,
        ) as writer:
            for frame in range(frames):
                writer.add(self._frame(frame, plants).reshape(1, -1, 3))

    def _frame(self, frame: int, plants: int) -> np.ndarray:
        """(plants, N, 3): played forwards and backwards in turn, each plant some frames ahead of the one before."""
        last = self._clip.frame_count - 1
        at = (frame + FRAMES_AHEAD * np.arange(plants)) % max(1, 2 * last)
        return self._positions[np.where(at > last, 2 * last - at, at)]
