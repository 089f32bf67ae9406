"""athcodec: a whole .ath file at the default effort, as other codecs have it, in layers, and as users make it."""

from __future__ import annotations

from io import BytesIO
from typing import Any, ClassVar

import numpy as np

import athcodec
from athcodec.errors import BoundError
from bench.codecs import Source
from bench.codecs.program import CannotKeep


class Athcodec:
    """A single layer without attributes, its rest pose within the bound: what other codecs keep, and no more."""

    name = kind = "athcodec"
    lossless = False
    bounds: tuple[float, ...] | None = None  # Bounds at which a suite measures the codec; None: all.
    options: ClassVar[dict[str, Any]] = {"attributes": "none", "rest_error": "bound", "ladder": "none"}

    def __init__(self) -> None:
        self.settings: dict = {}

    def missing(self) -> str | None:
        return None

    def encode(self, source: Source, bound: float) -> bytes:
        """Return the clip as an .ath file within `bound`, in scene units, or without loss, and keep the encoder's
        choices in `settings`. Raise CannotKeep if athcodec cannot keep the bound.
        """
        out, limit = BytesIO(), {"lossless": True} if self.lossless else {"max_error": bound}
        try:
            summary = athcodec.encode(source.clip, out, **self.options, **limit)
        except BoundError as error:
            raise CannotKeep(str(error)) from error
        self.settings = dict(summary.choices) | {"chunk_bytes": dict(summary.chunk_bytes)}
        return out.getvalue()

    def decode(self, data: bytes) -> np.ndarray:
        with athcodec.open(data, strict=True) as decoder:
            return np.ascontiguousarray(decoder.positions(), np.float32)


class LayeredAthcodec(Athcodec):
    """The same in the default layers, whose levels are measured too."""

    name, bounds = "athcodec, layers", (1e-4,)
    options: ClassVar[dict[str, Any]] = {"attributes": "none", "rest_error": "bound"}


class WholeAthcodec(Athcodec):
    """All that the source has, at the default options: `athcodec encode SOURCE`."""

    name, bounds = "athcodec, all arrays", (1e-4,)
    options: ClassVar[dict[str, Any]] = {}


class LosslessAthcodec(Athcodec):
    """With an additional lossless level."""

    name = "athcodec, lossless"
    lossless = True
