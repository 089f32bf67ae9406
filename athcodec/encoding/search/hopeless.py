"""What trials on some branches have shown to be hopeless, so that trials on other branches of the clip leave it out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from athcodec.encoding.segments.settings import Settings

TOO_LARGE = 1.08  # Bytes in waves, over the fewest on other branches, above which time bases make up for nothing.
CLEARLY_LARGER = 1.02  # Bytes with time bases of one kind, over the other, above which the one is not tried again.


@dataclass
class OnPieces:
    """What is known where a clip is divided into certain pieces, whatever hangs on what."""

    free_rigid: bool | None = None  # Whether loose rigid parts are better; None: it is not known.
    common_basis: bool | None = None  # Whether one time basis for all stages is better; None: it is not known.

    def has_hope(self, settings: Settings) -> bool:
        """Return whether settings with time bases have those of the better kind."""
        return self.common_basis in (None, settings.common_basis)

    def compare_bases(self, tried: Sequence[Settings], costs: Sequence[float]) -> None:
        """Note which kind of time bases is better if these costs, in bytes, tell it clearly. Where they hardly differ,
        the other kind may be far better once pieces hang on each other: their tree has more stages then."""
        common, own = (
            min((cost for settings, cost in zip(tried, costs) if settings.common_basis == is_common), default=math.inf)
            for is_common in (True, False)
        )
        if max(common, own) > CLEARLY_LARGER * min(common, own):
            self.common_basis = common < own


@dataclass
class OnBranches:
    """What is known of certain branches, in whatever order their vertices are."""

    turning: bool = False  # Whether roots that turn are hopeless. A tree that hangs together turns, its parts may not.
    still: bool | None = None  # Whether branches whose bending turns nothing are better; None: it is not known.


@dataclass
class Hopeless:
    """What takes part in no more trials. Which time bases make a file smallest hardly depends on what a piece hangs
    on; whether motion is predicted, hardly on the pieces either."""

    prediction: bool = False
    on_pieces: OnPieces = field(default_factory=OnPieces)
    on_branches: OnBranches = field(default_factory=OnBranches)
    _least_in_waves: float = math.inf  # Bytes of the smallest file with waves so far.
    _pieces: dict[bytes, OnPieces] = field(default_factory=dict)
    _branches: dict[bytes, OnBranches] = field(default_factory=dict)

    def divide(self, vertex_branch: np.ndarray, branch_parent: np.ndarray) -> None:
        """Go on with trials on branches: the number of that of each vertex, (N,), and of the parent of each, (B,)."""
        pieces = vertex_branch.tobytes()
        self.on_pieces = self._pieces.setdefault(pieces, OnPieces())
        self.on_branches = self._branches.setdefault(pieces + branch_parent.tobytes(), OnBranches())

    def is_in_waves(self, cost: float) -> bool:
        """Return whether branches whose file has so many bytes in waves are hopeless."""
        self._least_in_waves = min(self._least_in_waves, cost)
        return cost > TOO_LARGE * self._least_in_waves
