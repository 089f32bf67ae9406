"""Decisions of an encoder about a file: the settings of a layer of precision, and those of a whole file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from athcodec._native import Rounding
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.motion import LearnedModes
from athcodec.encoding.options.features import Feature

BEAM = 0  # Form of a branch whose modes are those of a beam; other forms are SHEET, or the vertices in a tube's ring.
# Fields that distinguish settings of a search: by hierarchy and rest pose, and by motion.
OF_PRELUDE = "rest_step rest_slack connected_rest lags shape_of forms still layer free_rigid".split()
OF_MOTION = (
    "step stage_steps turn_step rotation_step_factors roots_turn periodic learned_bases common_basis learned_pieces "
    "learned_coded"
).split()
# Fields that a large plant takes from its sample as they are.
OF_SAMPLE = (
    "step stage_steps rest_step rotation_step_factors roots_turn free_rigid still learned_bases common_basis periodic "
    "learned_coded"
).split()
OF_BRANCHES = "forms lags details rigid".split()  # Arrays with an entry for each branch.

Key: TypeAlias = tuple[object, ...]  # Distinguishes settings of one search.


@dataclass(frozen=True)
class Settings:
    """Settings that a trial varies. Steps are in scene units; arrays of branches, (B,), are in file order."""

    bound: float
    largest_bound: float  # The bound of the vertex with the largest weight.
    limit: float | np.ndarray  # Largest error of positions: one distance, or one for each vertex, (N,).
    step: float
    stage_steps: np.ndarray  # (stages,) factors on the step.
    rest_step: float
    forms: np.ndarray  # (B,) int32: BEAM, SHEET, or the vertices of each ring of a tube.
    rigid: np.ndarray  # (B,) int32: the number of layers, from the first on, in which a branch is rigid.
    lags: np.ndarray  # (B,) int32
    details: np.ndarray  # (B,) int32
    rotation_step_factors: tuple[int, ...]  # The rotation factor of each stage.
    learned_bases: tuple[bool, ...]  # Whether each stage has a learned time basis.
    node_steps: np.ndarray  # (stages,) steps of the maps of nodes, as SegmentMotion.analyse_nodes takes them.
    roots_turn: bool = False  # Whether roots alone turn, and other branches are only predicted to.
    layer: int = 0  # Number of the layer of precision that the settings are for.
    still: bool = False  # Whether bending of branches turns nothing that they carry.
    free_rigid: bool = False  # Whether rigid branches are loose.
    turn_step: float = 0.0  # Largest step of rotations of rigid pieces, in radians; 0: none.
    connected_rest: bool = False
    coarsest_rest_step: float = np.inf  # Largest step of layers' rest poses; 0: all have that of the last, unrefined.
    rest_slack: float = 0.0  # Distance by which the rest pose may be off to save bits.
    shape_of: np.ndarray | None = None  # (B,) as streams.find_copies returns it; None: the rest pose has no copies.
    common_basis: bool = False  # Whether the stages with learned time bases share one.
    learned_pieces: np.ndarray | None = None  # (P,) bool: pieces that have learned modes; None: no piece has.
    learned_saving: float | None = None  # Factor by which the bits of pieces had to shrink for learned modes.
    learned_coded: bool = False  # Whether modes are learned about the coded rest pose, and take its rounding back.
    periodic: bool = False  # Whether waves over time are periodic, in loops that are one segment.
    usual_change: float = np.inf  # Change of velocity in a usual frame where segments meet, length per frame squared.
    without: frozenset[Feature] = frozenset()  # Features that the file does without.
    predicted_trees: np.ndarray | None = None  # (B,) bool: trees with predicted motion beside others; None: no tree.

    @property
    def key(self) -> Key:
        """Return the key that distinguishes these settings from others of the same search."""
        return self.prelude_key + self._values(OF_MOTION)

    @property
    def prelude_key(self) -> Key:
        """The part of the key that decides hierarchy and rest pose."""
        return self._values(OF_PRELUDE)

    def _values(self, names: Sequence[str]) -> Key:
        values = (getattr(self, name) for name in names)
        return tuple(value.tobytes() if isinstance(value, np.ndarray) else value for value in values)

    def limit_of(self, vertices: np.ndarray | slice) -> float | np.ndarray:
        """Return the limit of some vertices: one distance, or one for each of them."""
        return self.limit[vertices] if isinstance(self.limit, np.ndarray) else self.limit

    @property
    def stages(self) -> int:
        """The number of stages of the branch hierarchy."""
        return len(self.stage_steps)

    @property
    def learning_stages(self) -> list[int]:
        """Stages that learn their time bases."""
        return [stage for stage, learned in enumerate(self.learned_bases) if learned]

    @property
    def rounding(self) -> Rounding:
        """The way in which coefficients become integers: dead zone, weights of the ends, and whether roots alone
        turn."""
        return Rounding(
            qz.DEAD_ZONE, qz.end_weights(self.usual_change / float(np.min(self.limit))), roots_turn=self.roots_turn
        )

    def step_of(self, stage: int) -> float:
        """Return the step of the stems of a stage."""
        return qz.single(self.step * self.stage_steps[stage])

    def rest_step_of(self, last: float, wanted: float) -> float:
        """Return the step of a layer's rest pose, as near to a wanted one as is allowed; last: of the last layer."""
        return max(last, min(wanted, self.coarsest_rest_step))

    def of_segment(self, whole_loop: bool) -> Settings:
        """Return the settings for one segment. whole_loop: whether the segment is all of a loop, and may have periodic
        waves."""
        return replace(self, periodic=self.periodic and whole_loop)

    def with_rotations(self, factor: int) -> Settings:
        """Return the settings with one rotation factor for all stages."""
        return replace(self, rotation_step_factors=(factor,) * self.stages)

    def with_turning_roots(self, factor: int) -> Settings:
        """Return the settings with a rotation factor of roots alone, in streams that hold all branches."""
        return replace(self.with_rotations(factor), roots_turn=True)

    def in_learned_bases(self) -> Settings:
        """Return the settings with a learned time basis of its own for each stage."""
        return replace(self, learned_bases=(True,) * self.stages, common_basis=False)

    def in_waves(self) -> Settings:
        """Return the settings without learned time bases."""
        return replace(self, learned_bases=(False,) * self.stages, common_basis=False)

    def coarser(self, ratio: int) -> Settings:
        """Return these settings for a first layer whose step is `ratio` times that of the last layer."""
        return replace(
            self,
            bound=ratio * self.bound,
            largest_bound=ratio * self.largest_bound,
            limit=ratio * self.limit,
            step=qz.single(ratio * self.step),
            rest_step=self.rest_step_of(self.rest_step, qz.first_rest_step(self.rest_step, self.bound, ratio)),
            layer=0,
        )


@dataclass(frozen=True)
class Choice:
    """Settings of a file: those of its only layer of precision, or of its refinements and of its first layer."""

    settings: Settings
    first_layer: Settings
    learned_modes: LearnedModes | None  # Learned modes of the last layer.
    reference: np.ndarray | None = None  # (N, 3) pose that motion is coded about, less the origin; None: the rest pose.
    predicted: bool = False  # Whether motion is predicted.
    error_share: float = 1.0  # Share of the limits that the errors of predicted motion may take.
    ladder: tuple[float, ...] | None = None  # Errors of layers before the last, over the diagonal; None: the options'.
    untried: tuple[str, ...] = ()  # What was left out of the search for these, in words.
