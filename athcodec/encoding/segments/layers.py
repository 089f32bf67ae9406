"""Layers of precision: the plant at a coarse step, and refinements of it down to the step of the file's bound.

The first layer has the stages of the branch hierarchy; each further one is one stage of the file that refines all of
it, motion, rest pose and learned modes. A refinement is coded about the positions of the layer before (FORMAT.md,
"Layers"). This is one module because every layer is planned, coded and finished on what the layer before it leaves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from athcodec._native import MEASURES
from athcodec.decoding import container as ct
from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.learned_modes import nested
from athcodec.encoding.model.motion import LearnedModes, Plan, SegmentMotion, position_errors, release_memory, zeros
from athcodec.encoding.options.features import Feature
from athcodec.encoding.options.shape import rest_steps
from athcodec.encoding.segments.joins import (
    END_FRAMES,
    NO_CORRECTIONS,
    SLOPED,
    CorrectionPrice,
    End,
    ErrorPrice,
    SourceStart,
    apply_join,
    best_join,
    end_corrections,
    end_of,
    seen,
)
from athcodec.encoding.segments.levels import MOST_JERK, SourceFrames
from athcodec.encoding.segments.predicted import PredictedBeside
from athcodec.encoding.segments.segment import (
    CodedPrelude,
    Corrections,
    Source,
    StreamBasis,
    analyse,
    basis_ratio,
    code_source_rest,
    correction_step,
    find_corrections,
    learned_bases,
    parts_that_keep_their_shape,
    stem_streams,
    stems_head,
    time_components,
)
from athcodec.encoding.segments.settings import Choice, Settings
from athcodec.encoding.streams import streams, writing
from athcodec.errors import BoundError
from athcodec.files.threads import ranges

# Steps of the first layer and of others before the last, over that of a file whose bound is the error that the layer
# holds. Where there are leaves, corrections take more bytes than finer steps.
STEP_FACTORS = (1.7, 1.25)  # Factors for plants without leaves.
LEAVES_STEP_FACTORS = (0.8, 0.8)  # Factors for plants with leaves.
FEW_ROOTS = 4  # Up to so many roots a scene counts as one plant.
MOTION_STEP = 2.0  # Largest step of the first layer of more roots, over the RMS motion of all vertices.
SURFACE_MOTION_STEP = 1.0  # The same where they have faces or leaves.
LEAST_ABOVE_BOUND = 4.0  # Least error, over the bound, of a layer before the last: a closer one costs too much.
LEAST_APART = 2.5  # Least error of a layer over that of the next.
MOST_RATIO = 1 << 14  # Ratio of the steps of neighbouring layers.
ROUNDED = 1 + 1e-9  # Factor before rounding down, because errors are rounded numbers themselves.
MOST_TWITCH = 1.5  # Largest second difference of corrections before the last layer, over the source's largest one.
MOST_LAYERS = 8  # Layers of a file (FORMAT.md, Limits).
MOST_LEVELS = 32  # Levels of a file (FORMAT.md, Limits); no file has more stages.
STAGE_0_STEP = 4  # Step of the rest pose of stage 0, over that of the first layer.
LEAST_MEETING = 8  # Frames from which on the corrections of a segment meet those of the segments beside it.
LARGEST = MEASURES.index("max")
RMS = MEASURES.index("rms")
FINER_MAPS = 3  # Half octaves by which steps of maps may become finer for that.
COARSER_MAPS = 16  # Half octaves by which steps of maps may become coarser for that.
MOST_POSES = 4  # Largest number of poses for each stage by which steps of maps are moved.
EVEN_SHARE = 0.05  # Share of the bytes of a segment that corrections may take for that.
TIGHTER_LIMITS = tuple(2.0 ** (-i / 8) for i in range(1, 17))  # Limits of these corrections, over that of the layer.
STAGE_0_SHARE = 1.03  # Bytes of the first layer's rest pose with one of stage 0 before it, over those without.
STAGE_0_BYTES = 24  # Bytes that it may add besides.


@dataclass
class Layer:
    """One layer of precision. Without a rest pose it has that of the layer before; the first layer that of stage 0."""

    plan: Plan  # On the rest pose of the layer.
    settings: Settings  # Settings of the file, with the layer's step and limit.
    modes: LearnedModes | None
    ratio: int = 1  # The layer's step over that of the last layer.
    rest: streams.CodedRest | None = None  # The content of REFINED_REST.
    holds_error: bool = True  # Whether corrections hold its error even where a stage or a part of it jerks with them.


@dataclass
class Layers:
    """The layers of a file, and the contents of REST and SOURCE_REST (empty: none)."""

    rest: writing.Rest
    source_rest: bytes
    stage_0: Plan  # On the pose of REST, which stage 0 is shown with.
    each: list[Layer]

    @property
    def stage_count(self) -> int:
        """Number of stages without that of the source's own numbers."""
        return self.stage_0.stage_count + len(self.each) - 1

    def of_segment(self, whole_loop: bool) -> Layers:
        """Return the layers of a segment, which is all of a loop or not."""
        return replace(
            self, each=[replace(layer, settings=layer.settings.of_segment(whole_loop)) for layer in self.each]
        )

    @property
    def first_rest_bytes(self) -> int:
        """Bytes of the hierarchy and of the rest pose that the first layer decodes."""
        refined = self.each[0].rest
        return len(self.rest.stream) + (0 if refined is None else len(refined.stream))


def step_factors(source: Source, ladder: Sequence[float], bound: float) -> tuple[float, float]:
    """Return two factors: the step of the first layer, and that of the other layers before the last, each over the step
    of a file whose bound is the error that the layer holds. The first factor is smaller for many plants side by side,
    which move little compared with the diagonal of them all: rounded at the usual step, they would hardly move.
    `ladder`: the largest errors of the layers over the diagonal, descending; `bound`: in scene units.
    """
    has_leaves = source.sheet_like.any()
    first, others = LEAVES_STEP_FACTORS if has_leaves else STEP_FACTORS
    coarsest = max(_in_bounds(ladder, bound, source.seen.diagonal), default=0.0)
    if coarsest > 0 and (source.hierarchy.branch_parent < 0).sum() > FEW_ROOTS:
        has_surface = has_leaves or source.polygons is not None
        motion = SURFACE_MOTION_STEP if has_surface else MOTION_STEP
        first = min(first, motion * source.seen.rms_motion / (coarsest * bound))
    return first, others


def layer_ratios(
    ladder: Sequence[float], bound: float, diagonal: float, factors: tuple[float, float] = STEP_FACTORS
) -> list[int]:
    """Return for each layer the ratio of its step to the step of the last layer, descending to 1.

    `ladder`: the largest errors that layers are to hold, over the diagonal, descending. An error that is close to the
    bound or to another error makes no layer of its own. Where two layers are too far apart for one to refine the other,
    layers are added between them. A first layer whose step is as fine as that of a later one takes its place, as where
    plants side by side hardly move. `bound`, `diagonal`: in scene units; `factors`: what `step_factors` returns.
    """
    errors: list[float] = []  # In bounds.
    for bounds in _in_bounds(ladder, bound, diagonal):
        if not errors or ROUNDED * errors[-1] >= LEAST_APART * bounds:
            errors.append(bounds)
    # Ratios are rounded down, so that layers hold what the ladder names.
    ratios = [max(1, int(min(factors[i > 0] * bounds, MOST_RATIO**2))) for i, bounds in enumerate(errors)]
    descending = [ratio for ratio in ratios[:1] if ratio > 1] + [ratio for ratio in ratios[1:] if 1 < ratio < ratios[0]]
    return [step for pair in pairwise([*descending, 1]) for step in _between(*pair)] + [1]


def _in_bounds(ladder: Sequence[float], bound: float, diagonal: float) -> list[float]:
    """Return the errors of a ladder over the bound, without those too close to it for a layer."""
    errors = [ROUNDED * error * diagonal / bound for error in ladder]
    return [error for error in errors if error >= LEAST_ABOVE_BOUND]


def _held_limit(source: Source, bound: float, factor: float, ratio: int) -> float | np.ndarray:
    """Return the distance within which corrections keep the positions of a layer before the last, so that no stored
    error exceeds the one that the ladder names. factor: of its step."""
    error = ct.short_float_within(ratio / factor * bound)
    return np.minimum(source.limit(error), source.unweighted_limit(error))


def _between(ratio: int, finer: int) -> list[int]:
    """Return the ratios of steps from `ratio` down to the one before `finer`, each at most MOST_RATIO times the next
    one."""
    if ratio <= MOST_RATIO * finer:
        return [ratio]
    middle = math.isqrt(ratio * finer)
    return _between(ratio, middle) + _between(middle, finer)


def layers_of(
    source: Source,
    prelude: CodedPrelude,
    choice: Choice,
    ratios: Sequence[int],
    factors: tuple[float, float],
    hold_errors: bool,
) -> Layers:
    """Return the layers of a file for a choice of settings. `prelude`: hierarchy and rest pose as coded for the last
    layer; `ratios`: the step of each layer over that of the last; `factors`: what `step_factors` returns;
    `hold_errors`: whether the layers before the last hold their errors in any case (`Layer.holds_error`).
    """
    settings = choice.settings
    rest, stage_0, rests = _rests(source, prelude, ratios, settings)
    layers: list[Layer] = []
    for i, (ratio, (pose, refined)) in enumerate(zip(ratios, rests)):
        before = layers[-1].plan if layers and pose is not prelude.plan.rest else prelude.plan
        plan = prelude.plan if len(ratios) == 1 else _plan_on(pose, prelude, before, i)
        of_layer = replace(
            choice.first_layer if i == 0 else _uniform(prelude.plan, settings),
            step=qz.single(settings.step * ratio),
            limit=settings.limit if ratio == 1 else _held_limit(source, settings.bound, factors[i > 0], ratio),
            layer=i,
        )
        modes = _modes(plan, choice, of_layer, ratio)
        layers.append(Layer(plan, of_layer, modes, ratio, refined, hold_errors or ratio == 1))
    source_rest = code_source_rest(source, prelude.plan.branches, layers[-1].plan.rest, settings.bound)
    return Layers(rest, source_rest, layers[0].plan if stage_0 is None else _plan_on(stage_0, prelude, None), layers)


def _plan_on(pose: np.ndarray, prelude: CodedPrelude, before: Plan | None, layer: int = 0) -> Plan:
    plan = Plan(prelude.plan.branches.copy(), prelude.plan.vertex_count, prelude.plan.pool, layer > 0, layer=layer)
    plan.still_branches = prelude.plan.still_branches
    plan.set_rest(pose, like=before)
    return plan


def _modes(plan: Plan, choice: Choice, settings: Settings, ratio: int) -> LearnedModes | None:
    """Return the learned modes of the pieces that a layer's settings name."""
    if ratio == 1 or choice.learned_modes is None:
        return choice.learned_modes
    if settings.learned_pieces is None:
        return None
    return nested(plan, choice.learned_modes, settings.learned_pieces & ~plan.is_rigid, _binary_digits(ratio))


def _binary_digits(ratio: int) -> int:
    """Return how many binary digits integers lose at steps so many times as large."""
    return ratio.bit_length() - 1


def _uniform(plan: Plan, settings: Settings) -> Settings:
    """Return settings for a refinement, whose motion is one stream: they have the rotation factor and the kind of time
    basis of the stage with the most rows, and the finest step of all stages that have stems.
    """
    main, factors = plan.main_stage, settings.rotation_step_factors
    finest = min(settings.stage_steps[stage] for stage in range(plan.stage_count) if plan.has_stems(stage))
    return replace(
        settings,
        stage_steps=np.full(plan.stage_count, finest),
        rotation_step_factors=(factors[main],) * plan.stage_count,
        learned_bases=(settings.learned_bases[main],) * plan.stage_count,
    )


def _rests(
    source: Source, prelude: CodedPrelude, ratios: Sequence[int], settings: Settings
) -> tuple[writing.Rest, np.ndarray | None, list[tuple[np.ndarray, streams.CodedRest | None]]]:
    """Return three things about the rest poses of the layers: the content of the chunk REST; the pose that REST decodes
    to if the first layer refines it, else None; and for each layer its decoded rest pose with the stream that refines
    the pose of the layer before into it, None if both are the same. `ratios`: the step of each layer over that of the
    last.
    """
    rest = prelude.rest_chunk
    at_once: list[tuple[np.ndarray, streams.CodedRest | None]] = [(prelude.plan.rest, None)] * len(ratios)
    if source.exact_rest or len(ratios) == 1 or Feature.REFINED_REST in source.without:
        return rest, None, at_once
    wanted = [qz.first_rest_step(rest.step, settings.bound, ratios[0])]
    wanted += [qz.single(rest.step * max(1.0, ratio / 2)) for ratio in ratios[1:]]
    first_step, *steps = (settings.rest_step_of(rest.step, step) for step in wanted)
    if first_step == rest.step:
        return rest, None, at_once
    branches, mesh = prelude.plan.branches, rest.mesh
    coded = _first_rests(prelude, first_step, source, settings)
    for step in steps:
        if np.array_equal(rest_steps(branches, step), rest_steps(branches, coded[-1].step)):
            coded.append(coded[-1])
            continue
        coded.append(streams.encode_rest(branches, step, source.rest, coded[-1], mesh=mesh))
    if max(np.linalg.norm(pose.decoded - source.rest, axis=1).max() for pose in coded) > source.rest_error:
        return rest, None, at_once
    stored, of_layers = coded[0], coded[-len(ratios) :]
    rest = replace(rest, step=stored.step, stream=stored.stream)
    stage_0 = None if of_layers[0] is stored else stored.decoded
    before = [coded[-len(ratios) - 1] if stage_0 is not None else stored, *of_layers[:-1]]
    return rest, stage_0, [(pose.decoded, None if pose is last else pose) for pose, last in zip(of_layers, before)]


def layered_poses_size(source: Source, ath: Ath, settings: Settings, ratios: Sequence[int]) -> float:
    """Return the bytes that the hierarchy and the rest poses of all layers take, or infinity if the last pose cannot
    keep the bound. `ratios`: the step of each layer over that of the last.
    """
    try:
        prelude = CodedPrelude(source, ath, settings, bases=False)
    except BoundError:
        return math.inf
    rest, _, rests = _rests(source, prelude, ratios, settings)
    refined = sum(len(coded.stream) for _, coded in rests if coded is not None)
    return len(prelude.hierarchy_stream) + len(rest.stream) + refined


def _first_rests(prelude: CodedPrelude, step: float, source: Source, settings: Settings) -> list[streams.CodedRest]:
    """Return the rest poses that the first layer needs: its own at `step`, and before it a coarser one for stage 0 if
    both together take few bytes more than the first layer's alone.
    """
    plan, mesh = prelude.plan, prelude.rest_chunk.mesh

    def encode(step: float, before: streams.CodedRest | None = None) -> streams.CodedRest:
        shape_of = prelude.shape_of if before is None else None
        return streams.encode_rest(plan.branches, step, source.rest, before, mesh=mesh, shape_of=shape_of)

    at_once = encode(step)
    is_out = Feature.STAGE_0_REST in source.without or STAGE_0_STEP * step > settings.coarsest_rest_step
    if is_out or not plan.stage_0_stands_alone:
        return [at_once]
    stage_0 = encode(STAGE_0_STEP * step)
    refined = encode(step, stage_0)
    both = len(stage_0.stream) + len(refined.stream)
    takes_little = both <= STAGE_0_SHARE * len(at_once.stream) + STAGE_0_BYTES
    return [stage_0, refined] if takes_little else [at_once]


def layer_chunks(layers: Layers) -> dict[tuple[int, int], bytes]:
    """Return the chunks of learned modes and of refined rest poses, which all segments share, as {(stage, kind):
    payload}.
    """
    first, *finer = layers.each
    chunks = {
        (stage, ct.SHAPES): stream for stage, stream in streams.encode_learned_modes(first.plan, first.modes).items()
    }
    before = first
    for stage, layer in enumerate(finer, first.plan.stage_count):
        digits = _binary_digits(before.ratio) - _binary_digits(layer.ratio)
        modes = streams.encode_refined_modes(layer.plan, layer.modes, before.modes, digits)
        if modes is not None:
            chunks[stage, ct.SHAPES] = writing.pack_refined_shapes(digits, modes)
        before = layer
    for stage, layer in [(1, first), *enumerate(finer, first.plan.stage_count)]:
        if layer.rest is not None:
            chunks[stage, ct.REFINED_REST] = writing.pack_refined_rest(layer.rest.step, layer.rest.stream)
    return chunks


class _TimeBases:
    """The time bases of the layers of one segment: each has as many rows as the one before, or more, of one that is
    learned for the last layer."""

    def __init__(self, last: Layer, positions: np.ndarray):
        everything = [None] if last.settings.learned_bases[-1] else []
        self._components = time_components(last.plan, last.settings, positions, everything).get(None)
        self._before: tuple[int, StreamBasis] | None = None

    def first(self, layer: Layer) -> dict[int, StreamBasis]:
        """Return the bases of the stages of the first layer that learn theirs."""
        bases: dict[int, StreamBasis] = {}
        for stage, learned in enumerate(layer.settings.learned_bases):
            if learned and layer.plan.has_stems(stage):
                bases |= self.refined(layer, stage, stage)
        return bases

    def refined(self, layer: Layer, stream: int, stage: int) -> dict[int, StreamBasis]:
        """Return the learned time basis of one stream of a layer as {stream: basis}, or {} if the stream learns none.
        From then on it is the basis that the next call extends. `stream`: the stage whose settings in the layer say how
        the stream is coded; `stage`: the stage of the file that holds the stream.
        """
        if self._components is None or not layer.settings.learned_bases[stream]:
            return {}
        # Rigid parts of a coarse layer may need more rows than a finer one where they are not rigid.
        least = 0 if self._before is None else len(self._before[1].stored.rows)
        stored = self._components.basis(basis_ratio(layer.plan, layer.settings, layer.ratio), least=least)
        if stored is None:
            return {}
        basis = StreamBasis(stored, stage)
        if self._before is not None:
            base, before = self._before
            basis = StreamBasis(stored, before.root, len(before.stored.rows), base)
        self._before = stage, basis
        return {stream: basis}


class Ends:
    """The ends of the stages of a segment, for which the next segment may wait on another thread."""

    def __init__(self, stages: int):
        self._stages: list[Future[End]] = [Future() for _ in range(stages)]

    def add(self, stage: int, end: End) -> None:
        self._stages[stage].set_result(end)

    def take(self, stage: int) -> End:
        """Return the end of a stage as soon as it is known. Only its one caller holds it then."""
        end = self._stages[stage].result()
        self._stages[stage] = Future()
        return end

    @contextmanager
    def failing(self) -> Iterator[None]:
        """Return a context in which an error is also passed on to the next segment, which would wait for these ends for
        ever.
        """
        try:
            yield
        except BaseException as error:
            for stage in self._stages:
                if not stage.done():
                    stage.set_exception(error)
            raise


class CodedMotion:
    """The motion of one segment in layers. Each stage is joined to the segment before and measured as soon as it is
    coded, so that the positions of one stage are in memory at a time.

    chunks: {(stage, kind): payload}. errors: those of stopping at each stage, by each of MEASURES. joins: those to the
    segment before. flaws: those of what each stage shows (SourceFrames).

    layers: with the settings of the segment (Layers.of_segment). exact: the source's own numbers (Source.exact), for
    one more stage. goes_on: whether another segment follows. shown_times: as Source returns them. box: corners of the
    source, (2, 3). loops: whether the segment follows itself. before, after: the ends of the segment before, which this
    one is joined to, and those of this one; None: nobody asks for them. beside: the trees with predicted motion, or
    None.
    """

    def __init__(
        self,
        prelude: CodedPrelude,
        layers: Layers,
        segment_count: int,
        positions: np.ndarray,
        exact: np.ndarray | None,
        goes_on: bool,
        shown_times: np.ndarray,
        box: np.ndarray,
        loops: bool,
        before: Ends | None = None,
        after: Ends | None = None,
        beside: PredictedBeside | None = None,
    ):
        self._beside, self._added, self._measured = beside, dict[int, float](), list[tuple[float, ...]]()
        positions = positions if beside is None else beside.modes
        self._exact, self._goes_on, self._shown_times = exact, goes_on, shown_times
        self._output, self._origin, self.positions = prelude.output, prelude.origin, positions
        self._pool, self._layered = prelude.plan.pool, len(layers.each) > 1
        self._stage_0, self._largest_bound = layers.stage_0, layers.each[-1].settings.largest_bound
        self._shared_bytes = (len(prelude.hierarchy_stream) + layers.first_rest_bytes) / segment_count
        self._prelude, self._bases = prelude, _TimeBases(layers.each[-1], positions) if self._layered else None
        self.chunks: dict[tuple[int, int], bytes] = {}
        self.errors: list[tuple[float, ...]] = []
        self.flaws: list[tuple[float, float]] = []
        self._decoded = np.empty(0)  # Positions of the last stage.
        self._met = streams.FREE_ENDS  # Met by the corrections of the last layer.
        self._end_corrections = NO_CORRECTIONS  # Corrections of the last frame.
        self._corrected: dict[int, Corrections] = {}  # What corrects stages.
        self.joins = [0] * layers.stage_count
        self._source = SourceFrames(positions, shown_times, None, box, self._largest_bound, self._pool)
        self._source_alone, self._source_end = self._source, self._source.last_shown(positions)
        self._loops, self._before, self._after = loops, before, after
        self._may_join = Feature.JOINS not in layers.each[-1].settings.without
        self._layers = layers.each
        with self._failing():
            self._segment = self._first(layers.each[0])

    def finish(self) -> None:
        """Code the refinements of the segment, and its exact numbers if these are wanted. The first layer was coded
        when the object was made.
        """
        segment = self._segment
        del self._segment
        with self._failing():
            for stage, (coarse, layer) in enumerate(pairwise(self._layers), self._stage_0.stage_count):
                segment = self._refine(layer, segment, round(coarse.ratio / layer.ratio), stage)
        if self.errors[-1][0] > self._largest_bound:
            raise AssertionError(f"decoded error {self.errors[-1][0]} is beyond the bound {self._largest_bound}")
        if self._beside is not None:
            self.errors, self.chunks[len(self.errors) - 1, ct.PREDICTED] = self._measured, self._beside.payload
        if self._exact is not None:
            self.chunks[len(self.errors), ct.EXACT] = streams.encode_exact(self._decoded, self._exact)
            self.errors.append((0.0,) * 3)
            self.joins.append(0)
            self.flaws.append((0.0, 0.0))

    def _failing(self) -> AbstractContextManager[None]:
        return nullcontext() if self._after is None else self._after.failing()

    def _first(self, layer: Layer) -> SegmentMotion:
        """Code the first layer: all stages of the branch hierarchy, their maps and corrections. Return the layer's
        integers, which the next layer refines.
        """
        plan, settings = layer.plan, layer.settings
        if self._bases:
            bases = self._bases.first(layer)
        else:
            bases = learned_bases(self._prelude.uncoded_plan, settings, self.positions)
        segment, decoded = analyse(plan, self._output, settings, self.positions, layer.modes, bases)
        stems, _ = stem_streams(segment, settings, bases)
        self.chunks |= {(stage, ct.STEMS): data for stage, data in stems.items()}
        last = plan.stage_count - 1
        self._correct(decoded, layer, last)
        del decoded  # Stages with maps are in memory before the last one is posed again.
        segment.analyse_nodes(self.positions, settings.node_steps, settings.rounding)
        stands_alone = self._before is None and self._after is None
        self._room = zeros(self.positions.shape, self._output[1] if stands_alone else np.float64)
        shown = [self._at_stage_0(segment, settings), *[segment] * (plan.stage_count - 2)]
        self.errors = _EvenStages(self, shown, settings).errors
        if self._is_worse_than_before(last):
            self._keep_last_stage_best(layer, last, self.pose(segment, last))
        for stage, nodes in enumerate(shown):
            if plan.has_affines(stage):
                self.chunks[stage, ct.AFFINES] = streams.encode_affines(nodes, stage)
        for stage, nodes in enumerate(shown):
            self._finish(stage, self.pose(nodes, stage) if stands_alone else self._pose_to_join(nodes, stage))
        self._finish(last, self.pose(segment, last), layer)
        segment.forget_nodes()
        del self._room
        return segment

    def _keep_last_stage_best(self, layer: Layer, stage: int, decoded: np.ndarray) -> None:
        """Tighten the corrections of the first layer's last `stage` while its RMS error exceeds that of the stage
        before, which is shown by affine maps, and while the corrections take few bytes. `decoded`: positions of the
        stage without corrections.
        """
        known = len(self.chunks.get((stage, ct.CORRECTIONS), b""))
        most = known + EVEN_SHARE * (self._bytes_up_to(stage) + known)
        for factor in TIGHTER_LIMITS:
            if not self._is_worse_than_before(stage):
                break
            corrections = self._corrections(decoded, layer, factor)
            if len(corrections.chunk) > most:
                break
            self.errors[stage] = self._set_last(layer, stage, decoded, corrections)

    def _is_worse_than_before(self, stage: int) -> bool:
        """Return whether the RMS error of a stage exceeds that of the stage before."""
        return self.errors[stage][RMS] > self.errors[stage - 1][RMS]

    def _keep_smooth(self, layer: Layer, stage: int, positions: np.ndarray) -> None:
        """Leave out corrections without which a stage before the last layer's does not jerk. It is then shown, with an
        error that is above that of its layer. positions: not corrected."""
        if stage not in self._corrected or layer.holds_error:
            return
        with self._corrected_as_shown(stage, positions):
            jerk = self._source_alone.flaws(positions, None, 0.0)[1]
        if jerk > MOST_JERK and self._source_alone.flaws(positions, None, 0.0)[1] <= MOST_JERK:
            self.errors[stage] = self._set_last(layer, stage, positions, Corrections.none(positions.shape))

    def _at_stage_0(self, segment: SegmentMotion, settings: Settings) -> SegmentMotion:
        """Return the segment as stage 0 shows it, which may have a rest pose of its own."""
        if self._stage_0 is segment.plan:
            return segment
        shown = SegmentMotion(self._stage_0, segment.frames, segment.streams, periodic=settings.periodic)
        shown.analyse_nodes(self.positions, settings.node_steps, settings.rounding, stage=0)
        return shown

    def _refine(self, layer: Layer, before: SegmentMotion, ratio: int, stage: int) -> SegmentMotion:
        """Code a layer after the first one, which is one stage of the file, and return its integers. `before`: the
        integers of the layer that it refines; `ratio`: the step of that layer over the step of this one; `stage`: the
        stage that it makes.
        """
        settings, last = layer.settings, layer.plan.stage_count - 1
        self._corrected.clear()  # Stages before are finished.
        release_memory()
        assert self._bases is not None
        bases = self._bases.refined(layer, last, stage)
        segment, decoded = analyse(
            layer.plan, self._output, settings, self.positions, layer.modes, bases, before=before, ratio=ratio
        )
        if layer.ratio == 1:
            segment.forget_caches()
        head = stems_head(settings, last, bases)
        self.chunks[stage, ct.STEMS] = writing.pack_refined_stems(ratio, head, streams.encode_refinement(segment, last))
        segment.forget_before()
        self._correct(decoded, layer, stage)
        self._finish(stage, decoded, layer)
        return segment

    def _correct(self, decoded: np.ndarray, layer: Layer, stage: int) -> None:
        """Set corrections and errors of the stage that a layer ends with; decoded: positions without corrections."""
        if layer.ratio == 1 and self._goes_on and decoded.shape[2] >= LEAST_MEETING:
            self._end_corrections = self._corrections_of_end(layer, decoded)
            self._met = streams.MetEnds(streams.LAST, self._end_corrections)
        self.errors.append(self._finish_stage(layer, stage, decoded))

    def _corrections_of_end(self, layer: Layer, decoded: np.ndarray) -> np.ndarray:
        """Return corrections of the last frame, except of rigid parts, which keep their shape."""
        away = decoded[:, :, -4:] - (self.positions[:, :, -4:] + self._origin[:, None])
        limit, count = layer.settings.limit, layer.plan.pieces["count"]
        rows = end_corrections(away, limit, correction_step(limit), decoded.shape[2] - 1)
        return rows[~np.repeat(layer.plan.is_rigid, count)[rows[:, 0]]]

    def _finish_stage(self, layer: Layer, stage: int, decoded: np.ndarray) -> tuple[float, ...]:
        return self._set_last(layer, stage, decoded, self._corrections(decoded, layer))

    def _set_last(self, layer: Layer, stage: int, decoded: np.ndarray, corrections: Corrections) -> tuple[float, ...]:
        """Store the corrections of the stage that a layer ends with, in place of any earlier ones, and return the
        errors of the corrected stage by each of MEASURES. `decoded`: positions of the stage without corrections.
        """
        self.chunks.pop((stage, ct.CORRECTIONS), None)
        self._corrected.pop(stage, None)
        if corrections.chunk:
            self.chunks[stage, ct.CORRECTIONS] = corrections.chunk
            self._corrected[stage] = corrections
        with self._corrected_as_shown(stage, decoded):
            if layer.ratio == 1 and self._exact is not None:
                self._decoded = decoded.copy()
            return self.error(decoded)

    def _bytes_up_to(self, stage: int) -> int:
        """Return the bytes of this stage and those before it, without its corrections."""
        return sum(
            len(chunk) for key, chunk in self.chunks.items() if key[0] <= stage and key != (stage, ct.CORRECTIONS)
        )

    def _corrected_as_shown(self, stage: int, positions: np.ndarray) -> AbstractContextManager[None]:
        """Return a context in which the positions of a stage have its corrections."""
        return self._corrected[stage].applied(positions) if stage in self._corrected else nullcontext()

    def _meet(self, start: np.ndarray) -> None:
        """Require the corrections of the last stage to meet those that an earlier segment's end left in the first
        frame."""
        rows = np.concatenate([start * np.array([1, 0, 1, 1, 1, 1], np.int32), self._end_corrections])
        ordered = rows[np.lexsort(rows[:, 1::-1].T)]
        self._met = streams.MetEnds(self._met.closed | streams.FIRST, ordered)

    def _finish(self, stage: int, positions: np.ndarray, layer: Layer | None = None) -> None:
        """Pass the end of a stage on to the next segment, join the stage to the segment before if that is better, and
        note its flaws. `positions`: those of the stage without corrections, which a join changes in place; `layer`: the
        layer that ends with the stage, or None.
        """
        if layer is not None and layer.ratio > 1:
            self._keep_smooth(layer, stage, positions)
        if self._after is not None:
            with self._corrected_as_shown(stage, positions):
                shown = self._source.last_shown(positions)
            ends = end_of(positions, self._wanted_end, (shown, self._source_end), self._end_corrections)
            self._after.add(stage, ends)
        end = None if self._before is None else self._before.take(stage)
        if stage == 0:
            known = self._source_end if self._loops else None
            self._source = replace(self._source, before=known if end is None else end.shown[1])
        if end is not None and self._may_join and positions.shape[2] > END_FRAMES == end.positions.shape[2]:
            self._join_stage(stage, end, positions, layer)
        with self._corrected_as_shown(stage, positions):
            loop_pose = self._source.last_shown(positions) if self._loops else None
            before = loop_pose if end is None else end.shown[0]
            self.flaws.append(self._source.flaws(positions, before, self.errors[stage][0]))
            self._measure(stage, positions)

    def _measure(self, stage: int, positions: np.ndarray) -> None:
        """Note the errors of a stage with the trees whose motion is predicted, if there are any. `positions`: those of
        modes, as the stage shows them.
        """
        if self._beside is None:
            return
        is_last = stage == self._stage_0.stage_count + len(self._layers) - 2
        with self._beside.shown(positions, is_last):
            self._measured.append(self.error(positions, self._added.get(stage, 0.0)))
        if is_last and self._measured[-1][0] > self._largest_bound:
            raise AssertionError(f"decoded error {self._measured[-1][0]} is beyond the bound {self._largest_bound}")

    @cached_property
    def _wanted_end(self) -> np.ndarray:
        return self.positions[:, :, -END_FRAMES:] + self._origin[:, None]

    @cached_property
    def _wanted_start(self) -> SourceStart:
        return SourceStart(self.positions[seen(len(self.positions))], self._origin)

    def _join_stage(self, stage: int, end: End, positions: np.ndarray, layer: Layer | None) -> None:
        """Join a stage to `end` in place if that is better. `layer`: the layer that ends with the stage, or None."""
        some = seen(len(positions))
        price: ErrorPrice | CorrectionPrice
        if layer is None:
            most_rms = self.errors[stage - 1][RMS] if stage > 0 else math.inf
            price = ErrorPrice(self.errors[stage][RMS], most_rms, positions.shape[2])
        else:
            bytes_ = len(positions[some]) / len(positions) * (self._shared_bytes + self._bytes_up_to(stage))
            price = CorrectionPrice(layer.settings.limit_of(some), bytes_)
        largest = max(errors[0] for errors in self.errors[stage - 1 : stage + 1]) if stage > 0 else math.inf
        join = best_join(end.of(some), positions[some], self._wanted_start, price, largest)
        if join == 0:
            return
        self.joins[stage] = join
        apply_join(end, positions, join)
        if layer is None:
            size = np.asarray(max(positions.max(), -positions.min()), self._output[1])
            # A decoder joins maps and rounds what it shows, and slopes make last bits larger.
            last_bits = 16 * (1 + join % SLOPED) * float(np.spacing(np.float64(size)))
            self._added[stage] = 2 * float(np.spacing(size)) + last_bits
            self.errors[stage] = self.error(positions, self._added[stage])
        else:
            if layer.ratio == 1 and positions.shape[2] >= LEAST_MEETING:
                self._meet(end.corrections)
            self.errors[stage] = self._finish_stage(layer, stage, positions)
        if layer is not None and stage == self._stage_0.stage_count - 1:
            self._keep_last_stage_best(layer, stage, positions)

    def _corrections(self, decoded: np.ndarray, layer: Layer, factor: float = 1.0) -> Corrections:
        """Return corrections that bring `decoded` positions within the limit of the layer times `factor`."""
        settings = replace(layer.settings, limit=layer.settings.limit * factor)
        met = self._met if factor == 1.0 else replace(self._met, decided=NO_CORRECTIONS)
        met = met if layer.ratio == 1 else streams.FREE_ENDS
        corrections = find_corrections(decoded, self.positions, self._origin, settings, layer.plan, ends=met)
        if layer.holds_error or not len(corrections.rows):
            return corrections
        parts = parts_that_keep_their_shape(layer.plan)
        return corrections.without_twitches(parts, MOST_TWITCH * self._largest_bend)

    @cached_property
    def _largest_bend(self) -> float:
        """Largest second difference of a vertex of the source. Beyond it a part is seen to twitch, however smoothly all
        others move."""
        parts = self._pool.map(
            lambda start, stop: np.square(np.diff(self.positions[start:stop], 2, axis=2)).sum(axis=1).max(initial=0.0),
            ranges(len(self.positions), 3 * self.positions.shape[2]),
        )
        return math.sqrt(max(parts, default=0.0))

    def pose(self, shown: SegmentMotion, stage: int) -> np.ndarray:
        """Return the output of a stage, neither joined nor corrected."""
        return shown.pose(stage, *self._output, self._room)

    def _pose_to_join(self, shown: SegmentMotion, stage: int) -> np.ndarray:
        """Return a stage without corrections as float64, to be joined. What stems place is rounded before and after,
        what maps place only after."""
        origin, dtype = self._output
        positions, pieces = shown.pose(stage, origin, np.float64, self._room), shown.plan.pieces
        is_stem = np.repeat(pieces["stage"] <= stage, pieces["count"])
        for run in np.split(positions, np.flatnonzero(np.diff(is_stem)) + 1)[not is_stem[0] :: 2]:
            for start, stop in ranges(len(run), 3 * shown.frames):
                run[start:stop] = run[start:stop].astype(dtype)
        return positions

    def error(self, decoded: np.ndarray, rounding: float = 0.0) -> tuple[float, ...]:
        shown, shares = self._shown_times, self._prelude.shares
        return position_errors(decoded, self.positions, self._origin, self._pool, shown, shares, rounding=rounding)


class _EvenStages:
    """Errors of the stages of the first layer. The steps of maps move until no stage's RMS or largest error exceeds
    that of the stage before: finer if that helps, else coarser at the stage before, which need not be better than what
    follows.

    shown: the segment with its maps, as each stage but the last shows it.
    """

    def __init__(self, coder: CodedMotion, shown: list[SegmentMotion], settings: Settings):
        """Measure the errors of the stages, and move the steps of maps until the errors do not grow from stage to
        stage. `coder`: the segment, whose last stage is measured already; `settings`: those of the first layer.
        """
        self._coder, self._shown, self._steps = coder, shown, settings.node_steps.copy()
        self._rounding, self._poses = settings.rounding, MOST_POSES * len(shown)
        self.errors = [coder.error(coder.pose(*each)) for each in zip(shown, range(len(shown)))] + coder.errors
        for stage in range(1, len(shown)):
            self._move(stage, stage, stage, 0.5**0.5, FINER_MAPS)
        for stage in range(len(shown), 0, -1):
            for coarser in range(stage - 1, -1, -1):
                self._move(coarser, stage, len(shown), 2.0**0.5, COARSER_MAPS)

    def _is_worse(self, stage: int) -> bool:
        return self._excess(stage, stage) > 0

    def _excess(self, first: int, last: int) -> float:
        """Return how far the errors of the stages from `first` to `last` exceed those before them."""
        pairs = pairwise(np.array(error)[[LARGEST, RMS]] for error in self.errors[first - 1 : last + 1])
        return sum(float(np.maximum(after - before, 0.0).sum()) for before, after in pairs)

    def _move(self, stage: int, worse: int, last: int, factor: float, most: int) -> None:
        """Multiply the step of the maps of `stage` by `factor`, at most `most` times, while the errors of the stage
        `worse` exceed those of the stage before it. Stop, and take the last change back, as soon as it does not reduce
        by how much the stages from `worse` to `last` exceed those before them.
        """
        if not self._shown[stage].plan.has_affines(stage):
            return
        for _ in range(most):
            before = self.errors, self._steps
            excess = self._excess(worse, last)
            if self._poses <= 0 or not self._is_worse(worse):
                return
            self._set(stage, factor)
            if not self._excess(worse, last) < excess:
                self.errors, self._steps = before
                self._analyse(stage)
                return

    def _set(self, moved: int, factor: float) -> None:
        """Multiply the step of the maps of the stage `moved` by `factor`, and measure anew the errors of all stages
        that show these maps.
        """
        nodes = self._shown[moved].plan.nodes
        last = int(nodes["last_stage"][nodes["stage"] == moved].max())
        self._steps, self.errors = self._steps.copy(), [*self.errors]
        self._steps[moved] *= factor
        self._analyse(moved)
        for stage in range(moved, min(last + 1, len(self._shown))):
            self.errors[stage] = self._coder.error(self._coder.pose(self._shown[stage], stage))
            self._poses -= 1

    def _analyse(self, stage: int) -> None:
        self._shown[stage].analyse_nodes(self._coder.positions, self._steps, self._rounding, stage)
