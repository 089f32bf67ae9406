"""athcodec: a whole .ath file without attributes, at the default effort."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import athcodec
from athcodec.errors import BoundError
from bench.codecs import Source
from bench.codecs.program import CannotKeep


class Athcodec:
    """The file as users get it, with levels of detail."""

    name = kind = "athcodec"
    lossless = False

    def __init__(self) -> None:
        self.settings: dict = {}

    def missing(self) -> str | None:
        return None

    def encode(self, source: Source, bound: float) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "clip.ath"
            limit = {"lossless": True} if self.lossless else {"max_error": bound}
            try:
                summary = athcodec.encode(
                    source.clip, file, rest_error="bound", attributes="none", ladder="none", **limit
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


class LosslessAthcodec(Athcodec):
    """With an additional lossless level."""

    name = "athcodec, lossless"
    lossless = True
