"""Layers of precision: the plant at a coarse step, and refinements of it down to the step of the file's bound.

The first layer has the levels of the branch hierarchy; each further one is one level of the file that refines all of
it, motion, rest pose and learned modes. A refinement is coded about the positions of the layer before (FORMAT.md,
"Layers").
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from athcodec._native import MEASURES
from athcodec.decoding import container as ct
from athcodec.encoding import quantise as qz
from athcodec.encoding import streams
from athcodec.encoding.features import Feature
from athcodec.encoding.joins import (
    END_FRAMES,
    NO_CORRECTIONS,
    SLOPED,
    CorrectionPrice,
    End,
    ErrorPrice,
    apply_join,
    best_join,
    end_corrections,
    end_of,
    seen,
)
from athcodec.encoding.learned_modes import LearnedModes, nested
from athcodec.encoding.motion import Plan, SegmentMotion, position_errors
from athcodec.encoding.polygons import Mesh
from athcodec.encoding.search import Choice
from athcodec.encoding.segment import (
    CodedPrelude,
    Corrections,
    Settings,
    Source,
    StreamBasis,
    analyse,
    basis_ratio,
    code_source_rest,
    correction_step,
    find_corrections,
    learned_bases,
    stem_streams,
    stems_head,
    time_components,
)
from athcodec.encoding.shape import rest_steps

COARSER = 2.0  # steps of layers before the last than those of a file of their own with the same bound
# Of the bytes up to a layer before the last, what its corrections may take: to keep the error that the ladder names,
# and else to keep the tightest of these limits, over its own.
NAMED_SHARE, CORRECTIONS_SHARE = 0.06, 0.015
CORRECTED_LIMITS = tuple(2.0 ** (i / 8) for i in range(16, -16, -1))
LEAST_RATIO = 8  # of the steps of neighbouring layers
MOST_RATIO = 1 << 14  # likewise
MOST_LAYERS, MOST_LEVELS = 8, 32  # of a file
LEVEL_0_STEP = 4  # of the rest pose of level 0, over that of the first layer
LEAST_MEETING = 8  # frames of a segment whose corrections meet those of the segments beside it
RMS = MEASURES.index("rms")
LEVEL_TOLERANCE = 1.005  # of the RMS error of a level, over that of the level before
FINER_MAPS, COARSER_MAPS = 3, 16  # half octaves that steps of maps may move for that
EVEN_SHARE = 0.05  # of the bytes of a segment, that corrections may take for that
TIGHTER_LIMITS = tuple(2.0 ** (-i / 8) for i in range(1, 17))  # of corrections for that
LEVEL_0_SHARE, LEVEL_0_BYTES = 1.03, 24  # of the first layer's rest pose, and beyond, that it may take with level 0's


@dataclass
class Layer:
    """One layer of precision.

    Attributes
    ----------
    plan : Plan
        On the rest pose of the layer.
    settings : Settings
        Those of the file, with the layer's step and limit.
    modes : LearnedModes or None
    ratio : int
        Of its step to that of the last layer.
    rest : streams.CodedRest or None
        The content of REFINED_REST; None: the rest pose of the layer before or, for the first layer, of level 0.
    """

    plan: Plan
    settings: Settings
    modes: LearnedModes | None
    ratio: int = 1
    rest: streams.CodedRest | None = None


@dataclass
class Layers:
    """The layers of a file, the contents of REST and SOURCE_REST (empty: none), and the plan on the pose of REST, which
    level 0 is shown with."""

    rest: ct.Rest
    source_rest: bytes
    level_0: Plan
    each: list[Layer]

    @property
    def level_count(self) -> int:
        """Without that of the source's own numbers."""
        return self.level_0.level_count + len(self.each) - 1

    def of_segment(self, whole_loop: bool) -> Layers:
        """As Settings.of_segment has it."""
        return replace(self, each=[replace(own, settings=own.settings.of_segment(whole_loop)) for own in self.each])

    @property
    def first_rest_bytes(self) -> int:
        """Of the streams up to the rest pose of the first layer."""
        refined = self.each[0].rest
        return len(self.rest.stream) + (0 if refined is None else len(refined.stream))


def layer_ratios(ladder: Sequence[float], bound: float, diagonal: float) -> list[int]:
    """Of the step of each layer to that of the last, descending to 1.

    ladder: largest errors over the diagonal, descending; those close to the bound, or to each other, make no layer of
    their own. Between layers that are too far apart for one to refine the other stand more.
    """
    ratios: list[int] = []
    for error in ladder:
        ratio = round(min(COARSER * error * diagonal / bound, MOST_RATIO**2))
        if ratio >= LEAST_RATIO and (not ratios or ratios[-1] >= LEAST_RATIO * ratio):
            ratios.append(ratio)
    return [step for pair in pairwise([*ratios, 1]) for step in _between(*pair)] + [1]


def _between(ratio: int, finer: int) -> list[int]:
    """`ratio` and those before `finer`, each at most MOST_RATIO from the next one."""
    if ratio <= MOST_RATIO * finer:
        return [ratio]
    middle = math.isqrt(ratio * finer)
    return _between(ratio, middle) + _between(middle, finer)


def layers_of(source: Source, prelude: CodedPrelude, choice: Choice, ratios: Sequence[int]) -> Layers:
    """The layers for what was chosen; prelude: of the last of them."""
    settings = choice.settings
    rest, level_0, rests = _rests(source, prelude, ratios, settings.bound)
    layers: list[Layer] = []
    for i, (ratio, (pose, refined)) in enumerate(zip(ratios, rests)):
        plan = prelude.plan if len(ratios) == 1 else _plan_on(pose, prelude, i)
        own = replace(
            choice.first_layer if i == 0 else _uniform(prelude.plan, settings),
            step=qz.single(settings.step * ratio),
            limit=settings.limit * ratio,
            layer=i,
        )
        layers.append(Layer(plan, own, _modes(plan, choice, own, ratio), ratio, refined))
    source_rest = code_source_rest(source, prelude.plan.branches, layers[-1].plan.rest, settings.bound)
    return Layers(rest, source_rest, layers[0].plan if level_0 is None else _plan_on(level_0, prelude), layers)


def _plan_on(pose: np.ndarray, prelude: CodedPrelude, layer: int = 0) -> Plan:
    plan = Plan(prelude.plan.branches.copy(), prelude.plan.vertex_count, prelude.plan.pool, layer > 0, layer=layer)
    plan.set_rest(pose)
    return plan


def _modes(plan: Plan, choice: Choice, settings: Settings, ratio: int) -> LearnedModes | None:
    """Those of the pieces that a layer's settings name."""
    if ratio == 1 or choice.learned_modes is None:
        return choice.learned_modes
    if settings.learned_pieces is None:
        return None
    return nested(plan, choice.learned_modes, settings.learned_pieces & ~plan.is_rigid, _binary_digits(ratio))


def _binary_digits(ratio: int) -> int:
    """That integers lose where steps are so many times as large."""
    return ratio.bit_length() - 1


def _uniform(plan: Plan, settings: Settings) -> Settings:
    """For a refinement, which has one stream: the settings of the level with the most rows, the finest step of all."""
    main, factors = plan.main_level, settings.rotation_step_factors
    finest = min(settings.level_steps[level] for level in range(plan.level_count) if plan.has_stems(level))
    return replace(
        settings,
        level_steps=np.full(plan.level_count, finest),
        rotation_step_factors=(factors[main],) * plan.level_count,
        learned_bases=(settings.learned_bases[main],) * plan.level_count,
    )


def _rests(
    source: Source, prelude: CodedPrelude, ratios: Sequence[int], bound: float
) -> tuple[ct.Rest, np.ndarray | None, list[tuple[np.ndarray, streams.CodedRest | None]]]:
    """The content of REST; what it decodes to, where the first layer refines that; of each layer the decoded pose and
    what refines one."""
    rest = prelude.rest_chunk
    if source.exact_rest or len(ratios) == 1 or Feature.REFINED_REST in source.without:
        return rest, None, [(prelude.plan.rest, None)] * len(ratios)
    first_step = qz.first_rest_step(rest.step, bound, ratios[0])
    steps = [qz.single(rest.step * max(1.0, ratio / 2)) for ratio in ratios[1:]]
    branches, mesh = prelude.plan.branches, source.mesh if rest.connected else None
    coded = _first_rests(prelude, first_step, source, mesh)
    for step in steps:
        if np.array_equal(rest_steps(branches, step), rest_steps(branches, coded[-1].step)):
            coded.append(coded[-1])
            continue
        coded.append(streams.encode_rest(branches, step, source.rest, coded[-1], mesh=mesh))
    stored, of_layers = coded[0], coded[-len(ratios) :]
    rest = replace(rest, step=stored.step, stream=stored.stream)
    level_0 = None if of_layers[0] is stored else stored.decoded
    before = [coded[-len(ratios) - 1] if level_0 is not None else stored, *of_layers[:-1]]
    return rest, level_0, [(own.decoded, None if own is last else own) for own, last in zip(of_layers, before)]


def _first_rests(prelude: CodedPrelude, step: float, source: Source, mesh: Mesh | None) -> list[streams.CodedRest]:
    """The rest pose at the step of the first layer; before it that of level 0, where that takes few bytes more."""
    plan = prelude.plan

    def encode(step: float, before: streams.CodedRest | None = None) -> streams.CodedRest:
        shape_of = prelude.shape_of if before is None else None
        return streams.encode_rest(plan.branches, step, source.rest, before, mesh=mesh, shape_of=shape_of)

    at_once = encode(step)
    if not plan.level_0_stands_alone or Feature.LEVEL_0_REST in source.without:
        return [at_once]
    level_0 = encode(LEVEL_0_STEP * step)
    refined = encode(step, level_0)
    both = len(level_0.stream) + len(refined.stream)
    takes_little = both <= LEVEL_0_SHARE * len(at_once.stream) + LEVEL_0_BYTES
    return [level_0, refined] if takes_little else [at_once]


def layer_chunks(layers: Layers) -> dict[tuple[int, int], bytes]:
    """What all segments share of the layers: {(level, kind): payload}."""
    first, *finer = layers.each
    chunks = {
        (level, ct.SHAPES): stream for level, stream in streams.encode_learned_modes(first.plan, first.modes).items()
    }
    before = first
    for level, layer in enumerate(finer, first.plan.level_count):
        digits = _binary_digits(before.ratio) - _binary_digits(layer.ratio)
        modes = streams.encode_refined_modes(layer.plan, layer.modes, before.modes, digits)
        if modes is not None:
            chunks[level, ct.SHAPES] = ct.pack_refined_shapes(digits, modes)
        before = layer
    for level, layer in [(1, first), *enumerate(finer, first.plan.level_count)]:
        if layer.rest is not None:
            chunks[level, ct.REFINED_REST] = ct.pack_refined_rest(layer.rest.step, layer.rest.stream)
    return chunks


class _TimeBases:
    """The time bases of the layers of one segment: one, learned for the last layer, with more rows in each."""

    def __init__(self, last: Layer, positions: np.ndarray):
        everything = [None] if last.settings.learned_bases[-1] else []
        self._components = time_components(last.plan, last.settings, positions, everything).get(None)
        self._before: tuple[int, StreamBasis] | None = None

    def first(self, layer: Layer) -> dict[int, StreamBasis]:
        """Of the levels of the first layer that are to have it."""
        bases: dict[int, StreamBasis] = {}
        for level, learned in enumerate(layer.settings.learned_bases):
            if learned and layer.plan.has_stems(level):
                bases |= self.refined(layer, level, level)
        return bases

    def refined(self, layer: Layer, stream: int, level: int) -> dict[int, StreamBasis]:
        """Of a stream of the layer's settings, which stands at a level of the file."""
        if self._components is None or not layer.settings.learned_bases[stream]:
            return {}
        stored = self._components.basis(basis_ratio(layer.plan, layer.settings, layer.ratio))
        if stored is None:
            return {}
        own = StreamBasis(stored, level)
        if self._before is not None:
            base, before = self._before
            own = StreamBasis(stored, before.root, len(before.stored.rows), base)
        self._before = level, own
        return {stream: own}


@dataclass(frozen=True)
class _ShownLevel:
    """The positions of a level before they are joined and corrected, and the layer that ends with it, if one does."""

    pose: Callable[[], np.ndarray]
    layer: Layer | None = None


class _SegmentCoder:
    """Chunks {(level, kind): payload} and errors of stopping at each level, by each of MEASURES, of one segment."""

    def __init__(
        self,
        prelude: CodedPrelude,
        layers: Layers,
        segment_count: int,
        positions: np.ndarray,
        goes_on: bool,
        keeps_last: bool,
        shown_times: np.ndarray,
    ):
        self._shown_times = shown_times
        self._output, self._origin, self.positions = prelude.output, prelude.origin, positions
        self._pool, self._layered = prelude.plan.pool, len(layers.each) > 1
        self._level_0 = layers.level_0
        self._shared_bytes = (len(prelude.hierarchy_stream) + layers.first_rest_bytes) / segment_count
        self._bases = _TimeBases(layers.each[-1], positions) if self._layered else None
        self.chunks: dict[tuple[int, int], bytes] = {}
        self.errors: list[tuple[float, ...]] = []
        self._shown: list[_ShownLevel] = []
        self._keeps_last, self._decoded = keeps_last, np.empty(0)  # at the last level
        self._goes_on = goes_on  # in a segment behind it
        self._met = streams.FREE_ENDS  # by the corrections of the last layer
        self._end_corrections = NO_CORRECTIONS  # likewise: of the last frame
        self.joins = [0] * layers.level_count

    def first(self, layer: Layer) -> SegmentMotion:
        """The levels of the branch hierarchy."""
        plan, settings = layer.plan, layer.settings
        bases = self._bases.first(layer) if self._bases else learned_bases(plan, settings, self.positions)
        segment, decoded = analyse(
            plan, self._output, settings, self.positions, layer.modes, bases, layered=self._layered
        )
        stems, _ = stem_streams(segment, settings, bases)
        self.chunks |= {(level, ct.STEMS): data for level, data in stems.items()}
        self._finish_with(decoded, layer, plan.level_count - 1)
        segment.analyse_nodes(self.positions, settings.node_steps, settings.rounding)
        shown = [self._at_level_0(segment, settings), *[segment] * (plan.level_count - 2)]
        self.errors = _EvenLevels(self, shown, settings).errors
        self._shown = [
            _ShownLevel(partial(self._pose_to_join, own, level)) for level, own in enumerate(shown)
        ] + self._shown
        self._keep_last_level_best(layer, plan.level_count - 1, self._shown[-1].pose())
        for level, nodes in enumerate(shown):
            if plan.has_affines(level):
                self.chunks[level, ct.AFFINES] = streams.encode_affines(nodes, level)
            nodes.forget_caches()
        return segment

    def _keep_last_level_best(self, layer: Layer, level: int, decoded: np.ndarray) -> None:
        """More corrections where the exact stems are worse than the maps before them, as far as they are cheap."""
        before, known = self.errors[level - 1][RMS], len(self.chunks.get((level, ct.CORRECTIONS), b""))
        most = known + EVEN_SHARE * (self._bytes_up_to(level) + known)
        for factor in TIGHTER_LIMITS:
            if self.errors[level][RMS] <= LEVEL_TOLERANCE * before:
                break
            corrections = self._corrections(decoded, layer, factor)
            if len(corrections.chunk) > most:
                break
            self.errors[level] = self._set_last(layer, level, decoded, corrections)

    def _at_level_0(self, segment: SegmentMotion, settings: Settings) -> SegmentMotion:
        """The segment as level 0 shows it, which may have a rest pose of its own."""
        if self._level_0 is segment.plan:
            return segment
        shown = SegmentMotion(self._level_0, segment.frames, segment.streams, periodic=settings.periodic)
        shown.analyse_nodes(self.positions, settings.node_steps, settings.rounding, level=0)
        return shown

    def refine(self, layer: Layer, before: SegmentMotion, ratio: int, level: int) -> SegmentMotion:
        """One further level; ratio: the step of the layer before over that of this one."""
        settings, last = layer.settings, layer.plan.level_count - 1
        bases = self._bases.refined(layer, last, level)
        is_last = layer.ratio == 1
        segment, decoded = analyse(
            layer.plan, self._output, settings, self.positions, layer.modes, bases, before, ratio, layered=not is_last
        )
        head = stems_head(settings, last, bases)
        self.chunks[level, ct.STEMS] = ct.pack_refined_stems(ratio, head, streams.encode_refinement(segment, last))
        segment.forget_before()
        self._finish_with(decoded, layer, level)
        return segment

    def _finish_with(self, decoded: np.ndarray, layer: Layer, level: int) -> None:
        """Corrections of the level that a layer ends with, and its errors; decoded: the positions without."""
        if layer.ratio == 1 and self._goes_on and decoded.shape[2] >= LEAST_MEETING:
            self._end_corrections = self._corrections_of_end(layer, decoded)
            self._met = streams.MetEnds(streams.LAST, self._end_corrections)
        self._shown.append(_ShownLevel(lambda: decoded, layer))
        self.errors.append(self._finish_level(layer, level, decoded))

    def _corrections_of_end(self, layer: Layer, decoded: np.ndarray) -> np.ndarray:
        """Of the last frame, but for rigid parts, which keep their shape."""
        away = decoded[:, :, -4:] - (self.positions[:, :, -4:] + self._origin[:, None])
        limit, count = layer.settings.limit, layer.plan.pieces["count"]
        rows = end_corrections(away, limit, correction_step(limit), decoded.shape[2] - 1)
        return rows[~np.repeat(layer.plan.is_rigid, count)[rows[:, 0]]]

    def _finish_level(self, layer: Layer, level: int, decoded: np.ndarray) -> tuple[float, ...]:
        is_last = layer.ratio == 1
        corrections = self._corrections(decoded, layer) if is_last else self._tightest(decoded, layer, level)
        return self._set_last(layer, level, decoded, corrections)

    def _set_last(
        self, layer: Layer, level: int, decoded: np.ndarray, corrections: Corrections | None
    ) -> tuple[float, ...]:
        """The corrections of the level that a layer ends with; decoded: the positions without. Returns its errors."""
        self.chunks.pop((level, ct.CORRECTIONS), None)
        if corrections is not None and corrections.chunk:
            self.chunks[level, ct.CORRECTIONS] = corrections.chunk
            decoded = corrections.applied(decoded)
        if layer.ratio == 1 and self._keeps_last:
            self._decoded = decoded
        return self.error(decoded)

    def _bytes_up_to(self, level: int) -> int:
        """Of this level and those before it, without its corrections."""
        return sum(
            len(chunk) for key, chunk in self.chunks.items() if key[0] <= level and key != (level, ct.CORRECTIONS)
        )

    def ends(self) -> list[End | None]:
        """What each level of the segment behind this one goes on from."""
        source = self.positions[:, :, -END_FRAMES:] + self._origin[:, None]
        ends = [end_of(shown.pose(), source) for shown in self._shown]
        if ends[-1] is not None:
            ends[-1] = replace(ends[-1], corrections=self._end_corrections)
        return ends

    def _meet(self, start: np.ndarray) -> None:
        """Closes the start of the last level, in whose first frame the corrections of an end stand."""
        rows = np.concatenate([start * np.array([1, 0, 1, 1, 1, 1], np.int32), self._end_corrections])
        ordered = rows[np.lexsort(rows[:, 1::-1].T)]
        self._met = streams.MetEnds(self._met.closed | streams.FIRST, ordered)

    def join(self, ends: Sequence[End | None]) -> None:
        """Lets the levels go on from the ends of the segment before, where they are better for it."""
        some = seen(len(self.positions))
        source = self.positions[some] + self._origin[:, None]
        shown, self._shown = self._shown[::-1], []
        for level, end in enumerate(ends):
            own = shown.pop()  # which is not held any longer
            if end is not None and self.positions.shape[2] > END_FRAMES:
                self._join_level(level, end, own.pose(), own.layer, some, source)

    def _join_level(
        self, level: int, end: End, positions: np.ndarray, layer: Layer | None, some: slice, source: np.ndarray
    ) -> None:
        """Joins one level, whose positions change; layer: that it ends, if one; source: of some vertices."""
        if layer is None:
            most_rms = self.errors[level - 1][RMS] if level > 0 else math.inf
            price = ErrorPrice(self.errors[level][RMS], most_rms, positions.shape[2])
        else:
            limit, share = layer.settings.limit, len(source) / len(positions)
            bytes_ = share * (self._shared_bytes + self._bytes_up_to(level))
            price = CorrectionPrice(limit if np.isscalar(limit) else limit[some], bytes_)
        join = best_join(end.of(some), positions[some], source, price)
        if join == 0:
            return
        self.joins[level] = join
        apply_join(end, positions, join)
        if layer is None:
            positions = positions.astype(self._output[1])
            size = np.abs(positions).max()
            # A decoder joins maps. It may round a position to the other side, and slopes make last bits larger.
            last_bits = 16 * (1 + join % SLOPED) * float(np.spacing(np.float64(size)))
            self.errors[level] = self.error(positions, 2 * float(np.spacing(size)) + last_bits)
        else:
            if layer.ratio == 1 and positions.shape[2] >= LEAST_MEETING:
                self._meet(end.corrections)
            self.errors[level] = self._finish_level(layer, level, positions)
        if level == self._level_0.level_count - 1:
            self._keep_last_level_best(layer, level, positions)

    def coded(
        self, exact: np.ndarray | None, largest_bound: float
    ) -> tuple[dict[tuple[int, int], bytes], np.ndarray, np.ndarray]:
        """Chunks, (levels, 3) errors and (levels,) joins."""
        if self.errors[-1][0] > largest_bound:
            raise AssertionError(f"decoded error {self.errors[-1][0]} is beyond the bound {largest_bound}")
        if exact is None:
            return self.chunks, np.array(self.errors), np.array(self.joins)
        chunk = streams.encode_exact(self._decoded, exact)
        exact_level = (len(self.errors), ct.EXACT)
        return self.chunks | {exact_level: chunk}, np.array([*self.errors, (0.0,) * 3]), np.array([*self.joins, 0])

    def _corrections(self, decoded: np.ndarray, layer: Layer, factor: float = 1.0) -> Corrections:
        """Those that bring the positions within the limit times a factor; but for rigid parts of a layer before the
        last, which keep their shape."""
        settings = replace(layer.settings, limit=layer.settings.limit * factor)
        is_last = layer.ratio == 1
        met = self._met if is_last and factor == 1.0 else replace(self._met, decided=NO_CORRECTIONS)
        met = met if is_last else streams.FREE_ENDS
        return find_corrections(
            decoded, self.positions, self._origin, settings, layer.plan, keeps_all=is_last, ends=met
        )

    def _tightest(self, decoded: np.ndarray, layer: Layer, level: int) -> Corrections | None:
        """Those of the tightest limit that they reach for their share of the bytes so far, if any do."""

        def within(factor: float, share: float) -> Corrections | None:
            corrections = self._corrections(decoded, layer, factor)
            return corrections if len(corrections.chunk) <= share * bytes_ else None

        bytes_ = self._shared_bytes + self._bytes_up_to(level)
        best, loosest, tightest = None, 0, len(CORRECTED_LIMITS)
        if named := within(1 / COARSER, NAMED_SHARE):
            best, loosest = named, sum(factor >= 1 / COARSER for factor in CORRECTED_LIMITS)
        while loosest < tightest:
            middle = (loosest + tightest) // 2
            if corrections := within(CORRECTED_LIMITS[middle], CORRECTIONS_SHARE):
                best, loosest = corrections, middle + 1
            else:
                tightest = middle
        return best

    def error_at(self, shown: SegmentMotion, level: int) -> tuple[float, ...]:
        """Of a level without corrections."""
        return self.error(self.pose(shown, level))

    def pose(self, shown: SegmentMotion, level: int) -> np.ndarray:
        """As it is put out, neither joined nor corrected."""
        return shown.pose(level, *self._output)

    def _pose_to_join(self, shown: SegmentMotion, level: int) -> np.ndarray:
        """A level without corrections as float64, to be joined: what stems place is rounded before and after that, what
        maps place only after it."""
        origin, dtype = self._output
        positions, pieces = shown.pose(level, origin, np.float64), shown.plan.pieces
        of_stems = np.repeat(pieces["level"] <= level, pieces["count"])
        positions[of_stems] = positions[of_stems].astype(dtype)
        return positions

    def error(self, decoded: np.ndarray, rounding: float = 0.0) -> tuple[float, ...]:
        return position_errors(decoded, self.positions, self._origin, self._pool, self._shown_times, rounding)


class _EvenLevels:
    """Errors of the levels of the first layer, whose maps it moves until no level's RMS is beyond that of the level
    before: finer where that helps, else coarser at the level before, which need not be better than what follows.

    shown: the segment as each level but the last shows it; its maps are there.
    """

    def __init__(self, coder: _SegmentCoder, shown: list[SegmentMotion], settings: Settings):
        self._coder, self._shown, self._steps = coder, shown, settings.node_steps.copy()
        self._rounding = settings.rounding
        self.errors = [coder.error_at(own, level) for level, own in enumerate(shown)] + coder.errors
        for level in range(1, len(shown)):
            self._move(level, level, level, 0.5**0.5, FINER_MAPS)
        for level in range(len(shown), 0, -1):
            for coarser in range(level - 1, -1, -1):
                self._move(coarser, level, len(shown), 2.0**0.5, COARSER_MAPS)

    def _is_worse(self, level: int) -> bool:
        return self.errors[level][RMS] > LEVEL_TOLERANCE * self.errors[level - 1][RMS]

    def _excess(self, first: int, last: int) -> float:
        """How far the levels from `first` to `last` are beyond those before them."""
        pairs = pairwise(error[RMS] for error in self.errors[first - 1 : last + 1])
        return sum(max(0.0, after - LEVEL_TOLERANCE * before) for before, after in pairs)

    def _move(self, level: int, worse: int, last: int, factor: float, most: int) -> None:
        """Moves the steps of the maps of a level while `worse` is beyond the level before it, and that serves all
        levels from there to `last`."""
        if not self._shown[level].plan.has_affines(level):
            return
        for _ in range(most):
            before = self.errors, self._steps
            excess = self._excess(worse, last)
            if not self._is_worse(worse):
                return
            self._set(level, factor)
            if not self._excess(worse, last) < excess:
                self.errors, self._steps = before
                self._analyse(level)
                return

    def _set(self, moved: int, factor: float) -> None:
        nodes = self._shown[moved].plan.nodes
        last = int(nodes["last"][nodes["level"] == moved].max())
        self._steps, self.errors = self._steps.copy(), [*self.errors]
        self._steps[moved] *= factor
        self._analyse(moved)
        for level in range(moved, min(last + 1, len(self._shown))):
            self.errors[level] = self._coder.error_at(self._shown[level], level)

    def _analyse(self, level: int) -> None:
        self._shown[level].analyse_nodes(self._coder.positions, self._steps, self._rounding, level)


class CodedMotion:
    """The motion of one segment in layers, all but how it goes on from the segment before it.

    layers: with the settings of the segment (see Layers.of_segment). exact: the source's own numbers (see
    Source.exact), which one more level is to give. goes_on: in the segment behind it. shown_times: as Source has them.
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
    ):
        coder = _SegmentCoder(prelude, layers, segment_count, positions, goes_on, exact is not None, shown_times)
        self._coder: _SegmentCoder | None = coder
        self._exact, self._largest_bound = exact, layers.each[-1].settings.largest_bound
        segment = coder.first(layers.each[0])
        for level, (before, layer) in enumerate(pairwise(layers.each), layers.level_0.level_count):
            segment = coder.refine(layer, segment, round(before.ratio / layer.ratio), level)

    def ends(self) -> list[End | None]:
        """What the levels of the next segment go on from."""
        return self._coder.ends()

    def joined_to(self, ends: Sequence[End | None] = ()) -> tuple[dict[tuple[int, int], bytes], np.ndarray, np.ndarray]:
        """Chunks {(level, kind): payload}, (levels, 3) errors of stopping at each level, and (levels,) how each is
        joined to the ends of the segment before; there are none for the first of a clip. To be called once."""
        coder, self._coder = self._coder, None  # which takes much memory
        coder.join(ends)
        return coder.coded(self._exact, self._largest_bound)
