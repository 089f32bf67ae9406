"""athcodec: a whole .ath file without attributes, at the default effort, and as small as possible."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import athcodec
from athcodec.errors import BoundError
from athcodec.motion.thresholds import Thresholds
from bench.codecs import Source
from bench.codecs.program import CannotKeep


class Athcodec:
    """The file as users get it, with levels of detail.

    `single_depth`: thresholds that take the whole plant for one node, so that no branch has a level of its
    own and all stems come with the last one. Only one map per frame, of the whole plant, remains.
    """

    kind = "athcodec"
    effort = "default"
    segment_frames = None
    lossless = False

    def __init__(self, single_depth: bool = False):
        self.single_depth = single_depth
        self.name = "athcodec, single depth" if single_depth else "athcodec"
        self.settings: dict = {}

    def missing(self) -> str | None:
        return None

    def encode(self, source: Source, bound: float) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "clip.ath"
            far = 1e3 * source.diagonal
            try:
                summary = athcodec.encode(
                    source.clip,
                    file,
                    max_error=None if self.lossless else bound,
                    lossless=self.lossless,
                    rest_error="bound",
                    attributes="none",
                    effort=self.effort,
                    segment_frames=self.segment_frames,
                    ladder="none",
                    tam=Thresholds(far, 0, far, 0) if self.single_depth else None,
                )
            except BoundError as error:
                raise CannotKeep(str(error)) from error
            self.settings = dict(summary.choices) | {"chunk_bytes": dict(summary.chunk_bytes)}
            return file.read_bytes()

    def decode(self, data: bytes) -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "clip.ath"
            file.write_bytes(data)
            with athcodec.open(file, strict=True) as decoder:
                return np.ascontiguousarray(decoder.positions(), np.float32)


class LongSegments(Athcodec):
    """With the longest segments and the longest search, at the cost of coarser seeking.

    The others code a clip as a whole; for clips of up to 256 frames, so does this.
    """

    effort = "best"
    segment_frames = 256

    def __init__(self):
        super().__init__()
        self.name = "athcodec, long segments"


class LosslessAthcodec(Athcodec):
    """With an additional lossless level."""

    lossless = True

    def __init__(self):
        super().__init__()
        self.name = "athcodec, lossless"
