"""Trees that grow beside others that sway: prediction suits their motion, and modes that of the others.

How the vertices of each tree move along its stems says which it is. A search then sees the others alone, and what it
chooses is extended to all branches, as where a part of the scene stands still.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model.motion import waves_over_time
from athcodec.encoding.options.shape import detail_of
from athcodec.encoding.search.sample import even_branches
from athcodec.encoding.search.segment_samples import typical_segments
from athcodec.encoding.search.still import SplitSource, part_of
from athcodec.encoding.segments.segment import Source
from athcodec.encoding.segments.settings import Choice, Settings
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.thresholds import Thresholds

TREE_VERTICES = 64  # Vertices of a tree that are looked at, at most.
LOOKED_AT = 8192  # Vertices of all trees that are looked at, about.
GROWS = 0.5  # Bits that motion along a stem takes from frame to frame, over those in waves, below which a tree grows.
PRICED = 256  # Vertices of the trees that grow on which both ways to code them are compared, about.
LEAST_SHARE = 0.01  # Least share of the vertices in trees that grow, and in others.


def growing_trees(source: Source, bound: float) -> np.ndarray | None:
    """Return which branches are of trees that grow, (B,) bool; None: all are, or too few are to matter."""
    hierarchy = source.hierarchy
    tree = np.cumsum(hierarchy.branch_parent < 0) - 1
    if tree[-1] == 0:
        return None
    segment = typical_segments(source)[0][0]
    vertices, below, tree_of = _some_links(hierarchy, tree)
    positions = source.positions(segment)
    along = positions[vertices] - np.where(below[:, None, None] < 0, 0.0, positions[below])
    frames = along.shape[2]
    if frames < 3:
        return None
    step = source.smallest_bound(bound)
    by_frame, in_waves = np.diff(along, axis=2), along @ waves_over_time(frames)[1:].T
    bits = [np.bincount(tree_of, np.log2(1 + np.abs(some) / step).sum(axis=(1, 2))) for some in (by_frame, in_waves)]
    grows: np.ndarray = (bits[0] < GROWS * bits[1])[tree]
    share = hierarchy.stem_count[grows].sum() / hierarchy.vertex_count
    return grows if LEAST_SHARE <= share <= 1 - LEAST_SHARE else None


def _some_links(hierarchy: Hierarchy, tree: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return some vertices, the vertex below each on its stem or that its stem hangs on, -1 for none, and the tree of
    each, (K,) each. `tree`: that of each branch, (B,)."""
    count = np.bincount(tree, hierarchy.stem_count).astype(np.int64)
    chosen = np.minimum(count, max(2, min(TREE_VERTICES, LOOKED_AT // len(count))))  # Of each tree, evenly spread.
    of_tree = np.repeat(np.arange(len(count)), chosen)
    place = np.arange(len(of_tree)) - np.repeat(np.cumsum(chosen) - chosen, chosen)
    within = place * (count - 1)[of_tree] // np.maximum(chosen - 1, 1)[of_tree]
    vertices = (np.cumsum(count) - count)[of_tree] + within
    branch = np.repeat(np.arange(len(tree)), hierarchy.stem_count)[vertices]
    below = np.where(vertices == hierarchy.first_vertex[branch], hierarchy.attach[branch], vertices - 1)
    return vertices, below, tree[branch]


@dataclass(frozen=True)
class PredictedSplit(SplitSource):
    """A source of which some trees, those of `still`, have predicted motion, and what moves in modes and these trees as
    sources of their own."""

    prediction: Choice | None = None  # Of the predicted trees.

    @classmethod
    def by_growth(cls, source: Source, ath: Ath, bound: float) -> PredictedSplit | None:
        """Divide a source into trees that grow and others. Return None if all or none do."""
        if source.still or source.reference_is_exact or source.has_source_rest:
            return None
        grows = growing_trees(source, bound)
        if grows is None:
            return None
        others, growing = (part_of(source, ath, np.flatnonzero(some)) for some in (~grows, grows))
        return cls(source, ath.as_one(grows), bound, grows, others, growing)

    @property
    def some_growing(self) -> Source:
        """A part of the trees that grow."""
        source = self.still_source
        if source.clip.vertex_count <= PRICED:
            return source
        branches = even_branches(source.hierarchy, PRICED, 0)
        is_enough = 2 * source.hierarchy.stem_count[branches].sum() >= PRICED
        return part_of(source, source.seen.ath(self.ath.thresholds), branches) if is_enough else source

    def predicting(self, prediction: Choice) -> PredictedSplit:
        """Return this split for a choice of how the trees that grow are predicted."""
        return replace(self, prediction=prediction)

    def choice(self, chosen: Choice, thresholds: Thresholds) -> Choice:
        assert self.prediction is not None
        return replace(super().choice(chosen, thresholds), error_share=self.prediction.error_share)

    def _with_thresholds(self, thresholds: Thresholds) -> SplitSource:
        return replace(self, ath=self.source.seen.ath(thresholds).as_one(self.still))

    @cached_property
    def _still_settings(self) -> Settings:
        assert self.prediction is not None
        return self.prediction.settings

    def _settings(self, moving: Settings, still: Settings, may_be_coarser: bool) -> Settings:
        """Join settings as for branches that stand still. The rest pose of the predicted trees is as fine as the
        prediction asks."""
        details = still.details
        if still.rest_step < moving.rest_step:
            own = int(detail_of(np.array([still.rest_step]))[0])
            details = np.where(details > 0, np.minimum(details, own), own)
        alike = replace(still, details=details, rest_slack=0.0)
        settings = super()._settings(moving, alike, may_be_coarser=False)
        return replace(settings, predicted_trees=self.still)
