"""What trials on some branches have shown to be hopeless, so that trials on other branches of the clip leave it out."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from athcodec.encoding.segments.settings import Settings

Move: TypeAlias = tuple[bool, bool, bool]
"""Whether branches that bend turn nothing, whether time bases are learned, and whether that is one for all stages."""

TOO_LARGE = 1.08  # Bytes in waves, over the fewest on other branches, above which time bases make up for nothing.


@dataclass
class OnPieces:
    """What is hopeless where a clip is divided into certain pieces, whatever hangs on what: roots that turn, and moves
    that cost more than others."""

    turning: bool = False
    _moves: set[Move] = field(default_factory=set)

    def leaves_out(self, settings: Settings) -> bool:
        return _move(settings) in self._moves

    def leave_out(self, settings: Iterable[Settings]) -> None:
        self._moves.update(map(_move, settings))


@dataclass
class Hopeless:
    """What takes part in no more trials. Which way to move makes a file smallest hardly depends on what a piece hangs
    on; whether motion is predicted, hardly on the pieces either."""

    prediction: bool = False
    on_pieces: OnPieces = field(default_factory=OnPieces)
    _least_in_waves: float = math.inf  # Bytes of the smallest file with waves so far.
    _known: dict[bytes, OnPieces] = field(default_factory=dict)

    def divide(self, vertex_branch: np.ndarray) -> None:
        """Go on with trials on these pieces, (N,)."""
        self.on_pieces = self._known.setdefault(vertex_branch.tobytes(), OnPieces())

    def is_in_waves(self, cost: float) -> bool:
        """Return whether branches whose file has so many bytes in waves are hopeless."""
        self._least_in_waves = min(self._least_in_waves, cost)
        return cost > TOO_LARGE * self._least_in_waves


def _move(settings: Settings) -> Move:
    return settings.still, any(settings.learned_bases), settings.common_basis
