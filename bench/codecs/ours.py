"""athcodec itself: a whole .ath file without attributes, at the default effort."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import athcodec
from athcodec.ath import Thresholds
from bench.codecs import Source


class Athcodec:
    """The file as users get it, with levels of detail.

    `single_depth`: thresholds that take the whole plant for one node, so that no branch has a level of its
    own and all stems come with the last one. One map per frame, of the whole plant, is left.
    """

    kind = "athcodec"

    def __init__(self, single_depth: bool = False, effort: str = "default"):
        self.single_depth, self.effort = single_depth, effort
        self.name = "athcodec, single depth" if single_depth else "athcodec"
        self.settings: dict = {}

    def missing(self) -> str | None:
        return None

    def encode(self, source: Source, bound: float) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "clip.ath"
            far = 1e3 * source.diagonal
            summary = athcodec.encode(
                source.clip,
                file,
                max_error=bound,
                attributes="none",
                effort=self.effort,
                tam=Thresholds(far, 0, far, 0) if self.single_depth else None,
            )
            self.settings = dict(summary.choices) | {"chunk_bytes": dict(summary.chunk_bytes)}
            return file.read_bytes()

    def decode(self, data: bytes) -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "clip.ath"
            file.write_bytes(data)
            with athcodec.open(file, strict=True) as decoder:
                return np.ascontiguousarray(decoder.positions(), np.float32)
