"""Which settings make the smallest file: candidates code a sample of the segments, and their bytes are counted.

Bases, rotations, time bases and steps are searched one after the other, on a part of the plant where that is large.
`Search` knows what to try; what a trial does is coding.py's business.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from athcodec import entropy
from athcodec import quantize as qz
from athcodec.ath import Ath
from athcodec.coding import (
    Settings,
    Shape,
    Source,
    analyse,
    analyse_finely,
    branch_records,
    code_stems,
    lags,
    loose_branches,
    threads,
)
from athcodec.errors import BoundError
from athcodec.part import Part, Share, part_of
from athcodec.progress import TRIALS, Progress
from athcodec.shapes import Components, Shapes, components, estimated_bits, learn
from athcodec.transform import Plan, SegmentMotion, position_error

EFFORTS = tuple(TRIALS)
WALKS = 3  # of both steps
SAMPLES = 3  # of several clips
LEARNING_SEGMENTS = 4  # of a clip, that shapes are learned from
SHAPES_KEPT = 6  # between trials
WORTH = {"_with_learned": 2, "_with_shapes": 6, "_with_node_steps": 4}  # trials, of what a step does besides


@dataclass(frozen=True, eq=False)
class Sample:
    """(N, 3, T) positions of a segment in file order, and how many frames of the clip it stands for."""

    positions: np.ndarray
    frames: int

    @property
    def scale(self) -> float:
        return self.frames / self.positions.shape[2]

    def of_part(self, part: Part) -> Sample:
        return Sample(self.positions[part.vertices], self.frames)


def samples_of(source: Source) -> list[Sample]:
    """The segment in the middle of a clip; of several clips those of a few, from calm to wild, each for its like."""
    middles = [start + len(own) // 2 for start, own in zip(source.clip_range_starts, source.clip_range_segments)]
    if len(middles) == 1:
        return [Sample(source.positions(middles[0]), source.clip.frame_count)]
    lengths = np.array([own[-1][1] - own[0][0] for own in source.clip_range_segments])
    groups = np.array_split(np.argsort([_moved(source, each) for each in middles], kind="stable"),
                            min(SAMPLES, len(middles)))
    return [Sample(source.positions(middles[group[len(group) // 2]]), int(lengths[group].sum())) for group in groups]


def _moved(source: Source, segment: int) -> float:
    """How far vertices go from the first frame of a segment to its middle, RMS."""
    start, stop = source.segments[segment]
    first, middle = (source.clip.block(each, each + 1).astype(np.float64) for each in (start, (start + stop) // 2))
    return math.sqrt(((middle - first) ** 2).sum() / source.clip.vertex_count)


def decide(source: Source, ath: Ath, bound: float, effort: str, report: Progress,
           jobs: int | None = None) -> tuple[Settings, Shape, Shapes | None]:
    """Settings, and what follows from them: hierarchy and rest pose as coded, learned shapes."""
    search = Search.of(source, ath, bound, effort, report, jobs)
    settings = search.found()
    shape = search.shape(settings)
    return settings, shape, search.shapes(shape.plan, settings)


def first_settings(source: Source, ath: Ath, bound: float, wildest: Sample) -> Settings:
    """Where a search starts from."""
    relative = bound / source.seen.diagonal if source.seen.diagonal > 0 else 1e-4
    step, rest_step = bound * qz.first_step_ratio(relative), bound * qz.rest_step_ratio(relative)
    levels = ath.height + 2
    return Settings(
        bound=bound, largest_bound=source.largest_bound(bound), limit=source.limit(bound), step=qz.single(step),
        level_steps=np.ones(levels), rest_step=qz.single(rest_step), sheet=source.wide,
        loose=loose_branches(source, wildest.positions), lags=lags(source, rest_step), omega=(0,) * levels,
        learned=(False,) * levels, shaped=None, node_steps=np.full(levels, step))


class Search:
    """Finds settings by coding a sample of the segments with each candidate and counting the bytes.

    samples: from calm to wild; that in the middle says what maps of nodes need. share: what the clip is a part of, if
    it is one.
    """

    def __init__(self, source: Source, ath: Ath, start: Settings, samples: list[Sample], effort: str, report: Progress,
                 jobs: int | None = None, share: Share | None = None):
        self.jobs, self.source, self.ath, self.effort, self.report = jobs, source, ath, effort, report
        self.start, self.samples, self.levels = start, samples, ath.height + 2
        self.sample = samples[len(samples) // 2].positions
        self.share = share or Share.everything(self.levels)
        self.doubt: float | None = None  # of SHAPE_DOUBTS, that the shapes found best had to overcome
        self._known: dict[tuple, tuple[float, np.ndarray]] = {}
        self._components: dict[tuple, Components] = {}
        self._shapes: dict[tuple, Shape] = {}
        self._besides = 0

    @classmethod
    def of(cls, source: Source, ath: Ath, bound: float, effort: str, report: Progress,
           jobs: int | None = None) -> Search:
        """For a clip that is no part."""
        samples = samples_of(source)
        return cls(source, ath, first_settings(source, ath, bound, samples[-1]), samples, effort, report, jobs)

    def _level_errors(self, bound: float) -> np.ndarray:
        """Per level, the error in all vertices of one node together that would double the level's own, (levels,).

        The level's own: the RMS that independent least-squares maps would leave, in a few frames, at least the bound.
        """
        some = np.linspace(0, self.sample.shape[2] - 1, min(8, self.sample.shape[2])).astype(int)
        frames = np.empty((len(some), *self.sample.shape[:2]))
        frames[:, self.source.hierarchy.vertex_source] = np.moveaxis(self.sample[:, :, some], 2, 0) + self.source.origin
        nodes = self.inner_nodes()
        errors = np.full(self.levels, bound)
        for level in np.flatnonzero(nodes):
            left = self.ath.approximation(frames, int(level)) - frames
            whole = max(bound, math.sqrt((left**2).sum() / (frames.size / 3)))
            errors[level] = whole * math.sqrt(self.source.clip.vertex_count / nodes[level])
        return errors

    def inner_nodes(self) -> np.ndarray:
        """Nodes of more than one branch, per level."""
        hierarchy, branches = self.source.hierarchy, self.ath.node_branch
        branches = branches[hierarchy.subtree_branches[branches] > 1]
        return np.bincount(hierarchy.branch_depth[branches], minlength=self.levels)

    def found(self) -> Settings:
        """The best settings, as far as a part shows them where the plant is large."""
        part = part_of(self.source, self.ath, self.effort)
        return self.best() if part is None else self.best_of_part(part)

    def best(self) -> Settings:
        steps = [self._with_basis, self._with_rotations, self._with_learned, self._with_basis, self._with_shapes,
                 self._with_steps]
        if self.effort == "fast":
            steps = [self._with_rotations]
        if self.source.weights is not None:
            steps.insert(0, self._with_level_steps)
        elif self.effort == "best":
            steps += [self._with_rotations, self._with_learned, self._with_finer_steps]
        settings = self.start
        for step in [*steps, self._with_node_steps]:
            settings = step(settings)
            self._tell(WORTH.get(step.__name__, 0))
        self.report("search", 1.0)
        return settings

    def _tell(self, worth: int = 0) -> None:
        """Tells how far it has come, after work that was worth so many trials besides those that were made."""
        self._besides += worth
        self.report("search", min((len(self._known) + self._besides) / TRIALS[self.effort], 0.99))

    def best_of_part(self, part: Part) -> Settings:
        """What is best for a part of the plant, for all of it; its pieces are asked one by one for their shapes."""
        start, kept = self.start, part.branches
        limit = start.limit if np.isscalar(start.limit) else start.limit[part.vertices]
        some = replace(start, sheet=part.source.wide, loose=start.loose[kept], lags=start.lags[kept], limit=limit)
        share = Share.of(branch_records(self.source.hierarchy, self.ath, start),
                         branch_records(part.source.hierarchy, part.ath, some))
        samples = [sample.of_part(part) for sample in self.samples]
        search = Search(part.source, part.ath, some, samples, self.effort, self.report, self.jobs, share)
        found = search.best()
        inner, all_inner = search.inner_nodes(), self.inner_nodes()
        coarser = np.where(inner > 0, np.sqrt(share.vertices * inner / np.maximum(all_inner, 1)), 1.0)
        as_wide = np.array_equal(found.sheet, part.source.wide)
        settings = replace(
            start, step=found.step, level_steps=found.level_steps, rest_step=found.rest_step, omega=found.omega,
            learned=found.learned, sheet=start.sheet if as_wide else np.full_like(start.sheet, found.sheet[0]),
            node_steps=found.node_steps * coarser)
        if search.doubt is None:
            return settings
        return replace(settings, shaped=self._pieces_for_shapes(settings, [search.doubt])[0])

    def cost(self, settings: Settings) -> tuple[float, np.ndarray]:
        """(bytes of a whole file, and of each level's streams in it) at these settings."""
        varied = (settings.step, settings.level_steps.tobytes(), settings.rest_step, settings.omega, settings.learned,
                  settings.sheet.tobytes(), settings.shaped is not None and settings.shaped.tobytes())
        if varied not in self._known:
            self._known[varied] = self._try(settings)
        return self._known[varied]

    def _try(self, settings: Settings) -> tuple[float, np.ndarray]:
        shape = self.shape(settings)
        shapes = self.shapes(shape.plan, settings)
        try:
            levels = sum(self._level_bytes(shape, settings, shapes, sample) for sample in self.samples)
        except BoundError:
            return math.inf, np.full(self.levels, math.inf)
        shape_bytes = 0.0
        for level, data in entropy.encode_shapes(shape.plan, shapes).items():
            shape_bytes += len(data) * self.share.rows[level]
        return levels.sum() + shape_bytes + self._prelude_bytes(shape), levels

    def _level_bytes(self, shape: Shape, settings: Settings, shapes: Shapes | None, sample: Sample) -> np.ndarray:
        """Of the streams in all that a sample stands for, (levels,)."""
        coded = code_stems(shape, settings, sample.positions, shapes)
        levels, heads = np.zeros(self.levels), np.zeros(self.levels)
        for level, data in coded.stems.items():
            levels[level], heads[level] = len(data), coded.heads[level]
        corrections = len(coded.correction_chunk)
        if corrections:
            levels += corrections * self._corrected(shape.plan, coded.corrections)
        levels += (levels - heads) * (self.share.rows - 1)
        return levels * sample.scale

    def _prelude_bytes(self, shape: Shape) -> float:
        return shape.prelude_bytes * self.share.vertices

    def shapes(self, plan: Plan, settings: Settings, everywhere: bool = False) -> Shapes | None:
        """Shapes of the pieces that are to have some, or of all, learned from segments spread over the clip."""
        if settings.shaped is None and not everywhere:
            return None
        known = settings.omega, settings.sheet.tobytes()
        if known not in self._components:
            shape, count = self.shape(settings), len(self.source.segments)
            some = np.unique(np.linspace(0, count - 1, LEARNING_SEGMENTS).astype(int))
            self._components[known] = components(shape.plan, (
                analyse_finely(shape, settings, self.source.positions(segment)) for segment in some))
        return learn(plan, self._components[known], settings.step, None if everywhere else settings.shaped)

    def _with_shapes(self, settings: Settings) -> Settings:
        """Learned shapes for the pieces that take fewer bits with them, if the file as a whole gets shorter."""
        plain = replace(settings, shaped=None)
        wanted = dict(zip(qz.SHAPE_DOUBTS, self._pieces_for_shapes(plain, qz.SHAPE_DOUBTS)))
        tried = {None: plain} | {doubt: replace(plain, shaped=some) for doubt, some in wanted.items() if some.any()}
        self.doubt, settings = self._cheapest_of(tried)
        return settings

    def _pieces_for_shapes(self, plain: Settings, doubts: Sequence[float]) -> list[np.ndarray]:
        """(P,) bool for each doubt: the pieces that seem to take so many times fewer bits with shapes."""
        shape = self.shape(plain)
        shapes = self.shapes(shape.plan, plain, everywhere=True)
        pieces = np.repeat(np.arange(len(shapes.counts)), shape.plan.pieces["count"])
        modes, tracks = (sum(estimated_bits(analyse(shape, plain, sample.positions, some)[0].coefficients, pieces,
                                            len(shapes.counts)) * sample.scale for sample in self.samples)
                         for some in (None, shapes))
        owners = np.repeat(np.arange(len(shapes.counts)), shapes.counts)
        price = estimated_bits(shapes.integers, owners, len(shapes.counts))
        return [(shapes.counts > 0) & ((tracks + price) * doubt < modes) for doubt in doubts]

    def _corrected(self, plan: Plan, corrections: np.ndarray) -> np.ndarray:
        """Fractions of the corrections that fall on the pieces of each level."""
        level_of_vertex = np.repeat(plan.base_level, plan.pieces["count"])
        counts = np.bincount(level_of_vertex[corrections[:, 0]], minlength=self.levels)
        return counts / counts.sum()

    def _costs(self, candidates: list[Settings]) -> list[tuple[float, np.ndarray]]:
        some = {self._shape_key(settings): settings for settings in candidates}  # by shape, each to be made once
        with ThreadPoolExecutor(threads(self.jobs, self.source)) as pool:
            list(pool.map(self.shape, some.values()))
            costs = []
            for cost in pool.map(self.cost, candidates):
                costs.append(cost)
                self._tell()
            return costs

    def shape(self, settings: Settings) -> Shape:
        """As in earlier trials, where one had it."""
        key = self._shape_key(settings)
        shape = self._shapes.pop(key, None) or Shape(self.source, self.ath, settings)
        self._shapes[key] = shape  # the last one used
        while len(self._shapes) > SHAPES_KEPT:
            self._shapes.pop(next(iter(self._shapes)))
        return shape

    def _shape_key(self, settings: Settings) -> tuple:
        return settings.rest_step, settings.sheet.tobytes()

    def _with_basis(self, settings: Settings) -> Settings:
        """The spatial basis of each branch: all alike, or by shape; judged without rotations and with some."""
        sheets = [self.source.wide, np.zeros_like(self.source.wide), np.ones_like(self.source.wide)]
        if not self.source.wide.any() or self.source.wide.all():
            sheets = sheets[1:]
        omegas = {settings.omega, (2,) * self.levels} if not any(settings.omega) else {settings.omega}
        candidates = [replace(settings, sheet=sheet, omega=omega) for sheet in sheets for omega in sorted(omegas)]
        return replace(self._cheapest(candidates), omega=settings.omega)

    def _with_level_steps(self, settings: Settings) -> Settings:
        """Coarser steps for levels whose vertices, and those that hang on them, may be further off."""
        candidates = []
        for part in qz.WEIGHT_PARTS:
            least = self.source.level_weights(self.levels, part)
            for power in (0.5, 1.0):
                candidates.append(replace(settings, level_steps=least**power))
        return self._cheapest([settings, *candidates])

    def _with_rotations(self, settings: Settings) -> Settings:
        factors = (0, 2) if self.effort == "fast" else qz.ROTATION_FACTORS
        candidates = [replace(settings, omega=(k,) * self.levels) for k in factors]
        per_level = np.array([levels for _, levels in self._costs(candidates)])
        mixed = replace(settings, omega=tuple(int(factors[i]) for i in per_level.argmin(axis=0)))
        return self._cheapest([settings, mixed, *candidates])

    def _cheapest(self, candidates: list[Settings]) -> Settings:
        return self._cheapest_of(dict(enumerate(candidates)))[1]

    def _cheapest_of(self, candidates: dict) -> tuple[Any, Settings]:
        costs = [cost for cost, _ in self._costs(list(candidates.values()))]
        return list(candidates.items())[int(np.argmin(costs))]

    def _with_learned(self, settings: Settings) -> Settings:
        """Learned time bases for the levels whose streams they shorten, where the file as a whole gets shorter."""
        learning = replace(settings, learned=(True,) * self.levels)
        (cost, cosines), (_, learned) = self._costs([settings, learning])
        mixed = replace(settings, learned=tuple((learned < cosines).tolist()))
        return mixed if any(mixed.learned) and self.cost(mixed)[0] < cost else settings

    def _with_steps(self, settings: Settings) -> Settings:
        return self._walk_steps(settings, 1.15, 1.4)

    def _with_finer_steps(self, settings: Settings) -> Settings:
        return self._walk_steps(settings, 1.04, 1.12)

    def _walk_steps(self, settings: Settings, factor: float, rest_factor: float) -> Settings:
        """Walks step and rest step in turn to the cheapest on geometric grids."""
        for _ in range(WALKS):
            before, settings = settings, self._walk(settings, "step", factor, math.inf)
            if self.source.exact_rest:
                break
            settings = self._walk(settings, "rest_step", rest_factor, self.share.rest_cap * settings.bound)
            if (settings.step, settings.rest_step) == (before.step, before.rest_step):
                break
        return settings

    def _walk(self, settings: Settings, name: str, factor: float, cap: float) -> Settings:
        def moved(exponent: int) -> Settings:
            return replace(settings, **{name: qz.single(min(getattr(settings, name) * factor**exponent, cap))})

        def costs_at(exponents) -> dict[int, float]:
            return dict(zip(exponents, (cost for cost, _ in self._costs([moved(e) for e in exponents]))))

        costs = costs_at((-1, 0, 1))
        while True:
            best = min(costs, key=costs.get)
            wanted = [e for e in (best - 1, best + 1) if e not in costs and abs(e) <= 10]
            if not wanted:
                return moved(best)
            costs |= costs_at(wanted)

    def _with_node_steps(self, settings: Settings) -> Settings:
        """Maps of inner nodes that keep to their share of the file, no finer than the levels' errors ask for."""
        shape, errors = self.shape(settings), self._level_errors(settings.bound)
        segment, _ = analyse(shape, settings, self.sample, self.shapes(shape.plan, settings))
        rest = self.cost(settings)[1].sum() + self._prelude_bytes(shape)
        scale = self.source.clip.frame_count / self.sample.shape[2]
        allowed = max(qz.NODE_BYTES, qz.NODE_SHARE / (1 - qz.NODE_SHARE) * rest)
        roots = int((self.source.hierarchy.branch_parent < 0).sum())
        chosen = limits = None
        for quality in qz.NODE_QUALITIES:
            steps = quality * errors
            if roots <= qz.FEW_ROOTS:
                steps[0] = qz.NODE_QUALITIES[0] * errors[0]  # a few bytes: the roots' maps are never coarser
            segment.clear_nodes()
            segment.analyse_nodes(self.sample, steps, qz.DEAD_ZONE)
            if limits is None:
                size = sum(len(entropy.encode_affines(segment, level)) * self.share.nodes[level]
                           for level in self._map_levels(shape.plan))
                if size * scale > allowed and quality < qz.NODE_QUALITIES[-1]:
                    continue
                chosen, limits = steps, self._errors_of_maps(shape, segment)
                limits[1:] = np.minimum(qz.NODE_HARM * limits[1:], limits[:-1])  # a deeper level stays the better one
            elif (self._errors_of_maps(shape, segment) <= limits).all():
                chosen = steps
            else:
                break
        return replace(settings, node_steps=chosen)

    def _map_levels(self, plan: Plan) -> list[int]:
        return [level for level in range(self.levels) if plan.has_affines(level)]

    def _errors_of_maps(self, shape: Shape, segment: SegmentMotion) -> np.ndarray:
        """RMS errors of the sample at the levels that have maps."""
        poses = (segment.pose(level, shape.origin, shape.dtype) for level in self._map_levels(shape.plan))
        return np.sqrt([position_error(pose, self.sample, shape.origin, shape.plan.crew)[1] for pose in poses])
