"""Records that go from one step of encoding to the next: what is decided about a file, and what is coded of it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from athcodec.encoding.clip.survey import Ath, Survey
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.segments.layers import Layers, layer_chunks
from athcodec.encoding.segments.predicted import PredictedTrees
from athcodec.encoding.segments.segment import CodedPrelude, Source
from athcodec.encoding.segments.settings import Choice
from athcodec.motion.branches.result import Found
from athcodec.motion.places import Places
from athcodec.motion.thresholds import Thresholds


@dataclass(frozen=True)
class Draft:
    """All that is decided about a file before its motion is coded. It can be pickled.

    With the same clip, which may have been opened again elsewhere, it goes to `code_segments` and `write`. The
    `fingerprint` tells a process that its hierarchy or rest pose differs from those of the draft.
    """

    choice: Choice
    seen: Survey
    segment_count: int
    places: Places
    branches: Found | None  # Branches of places for a clip without.
    options: EncodingOptions
    fingerprint: str
    thresholds: Thresholds


@dataclass(frozen=True)
class CodedSegment:
    """One segment: chunks {(stage, kind): payload}, (stages, 3) errors of stopping at each stage, (stages,) joins to
    the segment before, and (stages, 2) flaws of what each stage shows (SourceFrames)."""

    index: int
    chunks: dict[tuple[int, int], bytes]
    errors: np.ndarray
    joins: np.ndarray
    flaws: np.ndarray


@dataclass
class Decided:
    """Settings that the streams of a file depend on, and what follows from them."""

    ath: Ath
    choice: Choice
    prelude: CodedPrelude
    layers: Layers
    source: Source
    tried: dict[int, CodedSegment] = field(default_factory=dict)  # Segments that were coded to compare.

    @property
    def segment_count(self) -> int:
        return len(self.source.segments)

    @cached_property
    def predicted_trees(self) -> PredictedTrees | None:
        """The trees with predicted motion beside others; None: there are none."""
        last = self.layers.each[-1]
        if self.choice.settings.predicted_trees is None:
            return None
        return PredictedTrees(self.prelude, last.plan, last.settings, self.choice.error_share)

    @property
    def shared_bytes(self) -> int:
        """Bytes of hierarchy, rest poses and learned modes."""
        return self.prelude.prelude_bytes + sum(map(len, layer_chunks(self.layers).values()))

    @property
    def fingerprint(self) -> str:
        streams_and_pose = (
            self.prelude.hierarchy_stream,
            self.prelude.rest_chunk.stream,
            self.source.source_rest.tobytes(),
        )
        return hashlib.sha256(b"".join(streams_and_pose)).hexdigest()
