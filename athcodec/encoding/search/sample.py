"""A sample of a large plant: whole subtrees chosen evenly along it, with the branches that they are attached to.

The search for settings (search.py) codes the sample and extrapolates its bytes to the plant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.kinds import plant_kinds
from athcodec.encoding.model.motion import Plan
from athcodec.encoding.segments.segment import Source, branch_records
from athcodec.encoding.segments.settings import OF_BRANCHES, Settings
from athcodec.encoding.streams import streams
from athcodec.motion.hierarchy import Hierarchy

LARGE = 5_000  # Vertices up to which a plant is not sampled.
LEAST_SAMPLE = 3_500  # Least vertices of a sample.
ENOUGH = 4_000  # Vertices of a sample up to which it has LEAST_SHARE of the plant.
MOST_SAMPLE = 1 << 16  # Most vertices of a sample.
LEAST_SHARE = 0.4  # Least share of the plant in a sample.
SEGMENT_SHARE = 1 / 64  # Share of the plant that each segment of the clip adds to a sample.
SMALL = 1 << 18  # Vertices times frames up to which trials are so cheap that choices are made again.
SUBTREES = 8  # Least number of subtrees in a sample.


class PlantSample:
    """Some branches of a plant and all their ancestors, as a source of their own with the plant's segments.

    branches, vertices: those of the plant that are in the sample, ascending in file order. Trials of motion go without
    faces.
    """

    def __init__(self, source: Source, ath: Ath, branches: np.ndarray, with_faces: bool = False):
        """Take the sampled `branches`, ascending, which include the parents of each, out of `source` and `ath`.
        `with_faces`: whether the sample has the faces of its vertices.
        """
        whole = source.hierarchy
        kept = np.zeros(whole.branch_count, bool)
        kept[branches] = True
        self.branches, self.vertices = branches, np.flatnonzero(np.repeat(kept, whole.stem_count))
        self._number = np.cumsum(kept) - 1
        self.source = self._source(source, with_faces)
        self.ath = self._ath(ath)

    def _source(self, source: Source, with_faces: bool) -> Source:
        """Return the source of the sampled branches, in the segments of the whole plant."""
        places = source.hierarchy.vertex_source[self.vertices]
        hierarchy = self._hierarchy(source.hierarchy, np.searchsorted(np.sort(places), places))
        sample = replace(
            source,
            clip=source.clip.among(self.vertices, hierarchy, with_faces),
            shapes=None,
            reference=None if source.reference is None else source.reference[self.vertices],
            whole=(source, self.vertices),
        )
        sample.segments, sample.repeats = source.segments, source.repeats
        return sample

    def like(self, settings: Settings) -> Settings:
        """Return settings for the sample that agree with those of the whole plant. Which branches copy others is found
        anew.
        """
        some = replace(
            settings,
            **{name: getattr(settings, name)[self.branches] for name in OF_BRANCHES},
            limit=settings.limit_of(self.vertices),
            shape_of=None,
        )
        if settings.shape_of is None:
            return some
        branches = branch_records(self.source.hierarchy, self.ath, some)
        return replace(some, shape_of=streams.find_copies(branches, some.rest_step, self.source.rest, some.rest_slack))

    def _hierarchy(self, whole: Hierarchy, vertex_source: np.ndarray) -> Hierarchy:
        """Return the hierarchy of the sampled branches, numbered within the sample. `whole`: the plant's hierarchy;
        `vertex_source`: the number of each vertex of the sample in the order of the sampled clip.
        """
        parent, attach = whole.branch_parent[self.branches], whole.attach[self.branches]
        number_of_vertex = np.zeros(whole.vertex_count, np.int64)
        number_of_vertex[self.vertices] = np.arange(len(self.vertices))
        return Hierarchy.from_parts(
            np.where(parent < 0, -1, self._number[parent]),
            whole.stem_count[self.branches],
            np.where(attach < 0, -1, number_of_vertex[attach]),
            vertex_source,
            np.argsort(np.argsort(whole.branch_source[self.branches])),
        )

    def _ath(self, whole: Ath) -> Ath:
        """Return the part of the ATH `whole` whose nodes are sampled branches, numbered within the sample."""
        chosen = np.flatnonzero(np.isin(whole.node_branch, self.branches))
        parent = whole.node_parent[chosen]
        return Ath(
            self.source.hierarchy,
            whole.thresholds,
            whole.rest[self.vertices],
            self._number[whole.node_branch[chosen]].astype(np.int32),
            np.where(parent < 0, -1, np.searchsorted(chosen, parent)).astype(np.int32),
            whole.node_depth[chosen],
            whole.whole[chosen],
        )


@dataclass(frozen=True)
class ExtrapolationFactors:
    """Factors from a sample to its plant."""

    vertices: float
    rows: np.ndarray  # (stages,) rows of each stage's stream.
    nodes: np.ndarray  # (stages,) nodes that have maps.
    rest_cap: float  # Largest step of the rest pose that is tried, in bounds.

    @classmethod
    def everything(cls, stages: int) -> ExtrapolationFactors:
        """Return the factors of a plant that is not sampled."""
        return cls(1.0, np.ones(stages), np.ones(stages), qz.REST_CAP)

    @classmethod
    def of(cls, whole: np.ndarray, sample: np.ndarray) -> ExtrapolationFactors:
        """Return the factors for the branches of a plant and of its sample, (B,) of _native.BRANCH."""
        plans = [Plan(branches, int(branches["count"].sum())) for branches in (whole, sample)]
        rows, nodes = (
            np.divide(of_whole, of_sample, out=np.ones(plans[0].stage_count), where=of_sample > 0)
            for of_whole, of_sample in zip(*map(_counts, plans))
        )
        return cls(plans[0].vertex_count / plans[1].vertex_count, rows, nodes, qz.SAFE_REST_CAP)


def _counts(plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of stems, and the nodes with maps, per stage."""
    pieces, stages = plan.pieces, plan.stage_count
    low = np.bincount(plan.base_stage, pieces["low_modes"], stages)
    high = np.bincount(pieces["stage"], pieces["count"] - pieces["low_modes"], stages)
    return low + high, np.bincount(plan.nodes["stage"], plan.nodes["coded"], stages)


def sample_plant(source: Source, ath: Ath, effort: str, with_faces: bool = False) -> PlantSample | None:
    """Return a sample of a large plant that includes a branch of every stage. Its size grows with the clip, so that the
    search keeps its share of the work. Return None if the plant is small, if `effort` is "best", or if the sample would
    be half of it.
    """
    frames = -(-source.coded_frames // len(source.segments))
    wanted = sample_vertices(source.clip.vertex_count, len(source.segments), frames, effort)
    if wanted is None:
        return None
    branches = even_branches(source.hierarchy, wanted, int(ath.node_branch[ath.node_depth.argmax()]))
    sample = PlantSample(source, ath, branches, with_faces)
    return sample if len(sample.vertices) < source.clip.vertex_count // 2 else None


def is_small(vertices: int, segments: list[tuple[int, int]], effort: str) -> bool:
    """Return whether what a search has chosen is tried again when the rest is known. Where segments meet it is not,
    because bytes do not count what is seen there."""
    return vertices * segments[-1][1] <= SMALL and len(segments) == 1 and effort != "fast"


def sample_vertices(vertices: int, segments: int, frames: int, effort: str) -> int | None:
    """Return about how many vertices a sample has; None: the plant is not sampled. frames: of a segment."""
    if vertices <= LARGE or effort == "best":
        return None
    least = min(max(int(vertices * LEAST_SHARE), LEAST_SAMPLE), ENOUGH)
    return min(max(int(vertices * segments * SEGMENT_SHARE), least, SMALL // frames), MOST_SAMPLE)


def even_branches(hierarchy: Hierarchy, wanted: int, deepest: int) -> np.ndarray:
    """Return the numbers of branches that are spread evenly over the plant and have about `wanted` vertices in all. The
    branch `deepest`, the ancestors of each chosen branch, and a plant of each kind are among them.
    """
    vertices = np.append(hierarchy.first_vertex, hierarchy.vertex_count).tolist()
    after = (np.arange(hierarchy.branch_count) + hierarchy.subtree_branches).tolist()
    kept = np.zeros(hierarchy.branch_count, bool)
    kept[deepest] = True
    branch, due, share = 0, 0.0, wanted / hierarchy.vertex_count
    kinds = plant_kinds(hierarchy.branch_parent, hierarchy.stem_count)
    whole: dict[int, tuple[int, int]] = {}  # A plant of each kind: its first branch, and the one after its last.
    while branch < len(after):
        size = vertices[after[branch]] - vertices[branch]
        if size > wanted // SUBTREES and after[branch] > branch + 1:
            branch += 1
            continue
        due += share * size
        if 2 * due >= size:
            kept[branch : after[branch]] = True
            due -= size
        if hierarchy.branch_parent[branch] < 0:
            whole.setdefault(int(kinds[branch]), (branch, after[branch]))
        branch = after[branch]
    for kind in set(whole) - set(kinds[kept].tolist()):
        kept[slice(*whole[kind])] = True
    for branch, parent in reversed(list(enumerate(hierarchy.branch_parent.tolist()))):
        if kept[branch] and parent >= 0:
            kept[parent] = True
    return np.flatnonzero(kept)
