"""Layers of precision: the plant at a coarse step, and refinements of it down to the step of the file's bound.

The first layer has the levels of the branch hierarchy; each further one is one level of the file that refines all of
it, motion, rest pose and learned modes. A refinement is coded about the positions of the layer before (FORMAT.md,
"Layers").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from athcodec import container as ct
from athcodec.encoding import quantise as qz
from athcodec.encoding import streams
from athcodec.encoding.learned_modes import LearnedModes, nested
from athcodec.encoding.motion import Plan, SegmentMotion, position_error
from athcodec.encoding.search import Choice
from athcodec.encoding.segment import (
    CodedPrelude,
    Settings,
    Source,
    StreamBasis,
    analyse,
    correct,
    correction_chunk,
    learned_bases,
    stem_streams,
    stems_head,
    time_components,
)

LADDERS = {"none": (), "decades": (1e-2, 1e-3, 1e-4, 1e-5)}  # largest errors over the diagonal
LEAST_RATIO = 4  # of the steps of neighbouring layers
MOST_DIGITS = 14  # binary, between neighbouring layers


@dataclass
class Layer:
    """One layer of precision.

    Attributes
    ----------
    plan : Plan
        On the rest pose of the layer.
    settings : Settings
        Those of the file, with the layer's step and limit; a limit of None leaves the layer without corrections.
    modes : LearnedModes or None
    coarser : int
        Binary digits by which its step is coarser than that of the last layer.
    rest : ct.Rest or streams.CodedRest or None
        The content of REST for the first layer, of REFINED_REST for others; None: the rest pose of the layer before.
    """

    plan: Plan
    settings: Settings
    modes: LearnedModes | None
    coarser: int = 0
    rest: ct.Rest | streams.CodedRest | None = None


def ladder_of(ladder: str | Sequence[float]) -> tuple[float, ...]:
    """Largest errors over the diagonal, descending, of a ladder's name or errors, in text with commas between them.

    Raises ValueError.
    """
    if isinstance(ladder, str) and ladder in LADDERS:
        return LADDERS[ladder]
    try:
        errors = tuple(sorted(map(float, ladder.split(",") if isinstance(ladder, str) else ladder), reverse=True))
    except (TypeError, ValueError):
        errors = (math.nan,)
    if not all(0 < error < 1 for error in errors):
        raise ValueError(f"ladder: got {ladder!r}; expected {', '.join(LADDERS)} or errors between 0 and 1")
    return errors


def layer_digits(ladder: Sequence[float], bound: float, diagonal: float) -> list[int]:
    """Binary digits by which the step of each layer is coarser than that of the last, descending to 0.

    ladder: largest errors over the diagonal, descending; those close to the bound, or to each other, make no layer of
    their own.
    """
    digits: list[int] = []
    for error in ladder:
        ratio = error * diagonal / bound
        coarser = int(np.ceil(np.log2(ratio))) if ratio > 1 else 0
        if 2**coarser >= LEAST_RATIO and (not digits or digits[-1] - coarser >= 2):
            digits.append(coarser)
    digits.append(0)
    return [most for i, most in enumerate(digits) if i == 0 or digits[i - 1] - most <= MOST_DIGITS]


def layers_of(
    source: Source, prelude: CodedPrelude, choice: Choice, digits: Sequence[int]
) -> list[Layer]:
    """The layers for what was chosen; prelude: of the last of them."""
    settings = choice.settings
    rests = _rests(source, prelude, digits)
    layers: list[Layer] = []
    for i, coarser in enumerate(digits):
        plan = (
            prelude.plan
            if coarser == 0 and i == 0
            else Plan(prelude.plan.branches.copy(), source.hierarchy.vertex_count, source.pool, refined=i > 0)
        )
        if plan is not prelude.plan:
            plan.set_rest(rests[i][1])
        own = replace(
            choice.first_layer if i == 0 else _uniform(prelude.plan, settings),
            step=qz.single(settings.step * 2.0**coarser),
            limit=settings.limit if coarser == 0 else None,
        )
        layers.append(Layer(plan, own, _modes(plan, choice, own, coarser), coarser, rests[i][0]))
    return layers


def _modes(plan: Plan, choice: Choice, settings: Settings, coarser: int) -> LearnedModes | None:
    """Those of the pieces that a layer's settings name."""
    if coarser == 0 or choice.learned_modes is None:
        return choice.learned_modes
    if settings.learned_pieces is None:
        return None
    return nested(plan, choice.learned_modes, settings.learned_pieces, coarser)


def _uniform(plan: Plan, settings: Settings) -> Settings:
    """For a refinement, which has one stream: the settings of the level with the most rows, the finest step of all."""
    levels = np.bincount(plan.base_level, plan.pieces["low_modes"], plan.level_count)
    levels += np.bincount(plan.pieces["level"], plan.pieces["rank"] - plan.pieces["low_modes"], plan.level_count)
    main = int(levels.argmax())
    return replace(
        settings,
        level_steps=np.full(plan.level_count, settings.level_steps[levels > 0].min()),
        rotation_step_factors=(settings.rotation_step_factors[main],) * plan.level_count,
        learned_bases=(settings.learned_bases[main],) * plan.level_count,
    )


def _rests(source: Source, prelude: CodedPrelude, digits: Sequence[int]) -> list[tuple]:
    """(rest, decoded pose) of each layer, as Layer.rest has it."""
    final = prelude.rest_chunk
    if final.exact or len(digits) == 1:
        return [(final if i == 0 else None, prelude.plan.rest) for i in range(len(digits))]
    found: list[tuple] = []
    coded = None
    for coarser in digits:
        step = final.step * 2.0 ** max(0, coarser - 1)
        coded = streams.encode_rest(prelude.plan.branches, step, source.rest, coded)
        found.append((coded if found else replace(final, step=step, stream=coded.stream), coded.decoded))
    return found


def layer_chunks(layers: Sequence[Layer]) -> dict[tuple[int, int], bytes]:
    """What all segments share of the layers: {(level, kind): payload}."""
    first, *finer = layers
    chunks = {
        (level, ct.SHAPES): stream for level, stream in streams.encode_learned_modes(first.plan, first.modes).items()
    }
    before = first
    for level, layer in enumerate(finer, first.plan.level_count):
        digits = before.coarser - layer.coarser
        modes = streams.encode_refined_modes(layer.plan, layer.modes, before.modes, digits)
        if modes is not None:
            chunks[level, ct.SHAPES] = ct.pack_refined_shapes(digits, modes)
        if isinstance(layer.rest, streams.CodedRest):
            chunks[level, ct.REFINED_REST] = ct.pack_refined_rest(layer.rest.step, layer.rest.stream)
        before = layer
    return chunks


class _TimeBases:
    """The time bases of the layers of one segment: one, learned for the last layer, with more rows in each."""

    def __init__(self, last: Layer, positions: np.ndarray):
        found = time_components(last.plan, last.settings, positions)
        self._components = found.get(last.plan.level_count - 1)
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
        steps = self._components.basis(layer.coarser)
        if steps is None:
            return {}
        own = StreamBasis(steps, level)
        if self._before is not None:
            base, before = self._before
            own = StreamBasis(steps, before.root, len(before.steps), base)
        self._before = level, own
        return {stream: own}


class _SegmentCoder:
    """Chunks {(level, kind): payload} and errors of stopping at each level, (largest, RMS), of one segment."""

    def __init__(self, prelude: CodedPrelude, layers: Sequence[Layer], positions: np.ndarray):
        self._origin, self._dtype, self._positions = prelude.origin, prelude.dtype, positions
        self._pool, self._layered = prelude.plan.pool, len(layers) > 1
        self._bases = _TimeBases(layers[-1], positions) if self._layered else None
        self.chunks: dict[tuple[int, int], bytes] = {}
        self.errors: list[tuple[float, float]] = []
        self.decoded = np.empty(0)

    def first(self, layer: Layer) -> SegmentMotion:
        """The levels of the branch hierarchy."""
        plan, settings = layer.plan, layer.settings
        bases = self._bases.first(layer) if self._bases else learned_bases(plan, settings, self._positions)
        segment = analyse(plan, settings, self._positions, layer.modes, bases, layered=self._layered)
        stems, _ = stem_streams(segment, settings, bases)
        self.chunks |= {(level, ct.STEMS): data for level, data in stems.items()}
        self._finish_with(segment, layer, plan.level_count - 1)
        segment.analyse_nodes(self._positions, settings.node_steps, qz.DEAD_ZONE)
        for level in range(plan.level_count):
            if plan.has_affines(level):
                self.chunks[level, ct.AFFINES] = streams.encode_affines(segment, level)
        below = [self._error(segment.pose(level, self._origin, self._dtype)) for level in range(plan.level_count - 1)]
        self.errors = [*below, *self.errors]
        return segment

    def refine(self, layer: Layer, before: SegmentMotion, ratio: int, level: int) -> SegmentMotion:
        """One further level; ratio: the step of the layer before over that of this one."""
        settings, last = layer.settings, layer.plan.level_count - 1
        bases = self._bases.refined(layer, last, level)
        segment = analyse(layer.plan, settings, self._positions, layer.modes, bases, before, ratio, layered=True)
        head = stems_head(settings, last, bases)
        self.chunks[level, ct.STEMS] = ct.pack_refined_stems(ratio, head, streams.encode_refinement(segment, last))
        self._finish_with(segment, layer, level)
        return segment

    def _finish_with(self, segment: SegmentMotion, layer: Layer, level: int) -> None:
        """Corrections of the level that a layer ends with, and its errors."""
        self.decoded = segment.pose(layer.plan.level_count - 1, self._origin, self._dtype)
        if layer.settings.limit is not None:
            corrections, step = correct(self.decoded, self._positions, self._origin, layer.settings, self._pool)
            if chunk := correction_chunk(corrections, step, self.decoded.shape):
                self.chunks[level, ct.CORRECTIONS] = chunk
        self.errors.append(self._error(self.decoded))

    def _error(self, decoded: np.ndarray) -> tuple[float, float]:
        largest, squares = position_error(decoded, self._positions, self._origin, self._pool)
        return largest, math.sqrt(squares / (self._positions.shape[0] * self._positions.shape[2]))


def code_segment(
    prelude: CodedPrelude, layers: Sequence[Layer], positions: np.ndarray, exact: np.ndarray | None = None
) -> tuple[dict[tuple[int, int], bytes], np.ndarray]:
    """Chunks {(level, kind): payload} of one segment and (levels, 2) errors of stopping at each level.

    exact: the source's own numbers (see Source.exact), which one more level is to give.
    """
    coder, level = _SegmentCoder(prelude, layers, positions), layers[0].plan.level_count
    segment = coder.first(layers[0])
    for before, layer in pairwise(layers):
        segment = coder.refine(layer, segment, 1 << before.coarser - layer.coarser, level)
        level += 1
    largest_bound = layers[-1].settings.largest_bound
    if coder.errors[-1][0] > largest_bound:
        raise AssertionError(f"decoded error {coder.errors[-1][0]} is beyond the bound {largest_bound}")
    if exact is not None:
        coder.chunks[level, ct.EXACT] = streams.encode_exact(coder.decoded, exact)
        coder.errors.append((0.0, 0.0))
    return coder.chunks, np.array(coder.errors)
