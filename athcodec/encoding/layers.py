"""Layers of precision: the plant at a coarse step, and refinements of it down to the step of the file's bound.

The first layer has the levels of the branch hierarchy; each further one is one level of the file that refines all of
it, motion, rest pose and learned modes. A refinement is coded about the positions of the layer before (FORMAT.md,
"Layers").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from athcodec import container as ct
from athcodec.encoding import quantise as qz
from athcodec.encoding import streams
from athcodec.encoding.learned_modes import LearnedModes, nested
from athcodec.encoding.motion import Plan, SegmentMotion, position_errors
from athcodec.encoding.segment import (
    CodedPrelude,
    Settings,
    Source,
    analyse,
    correct,
    correction_chunk,
    stem_streams,
    stems_head,
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
    digits : int
        Binary digits of its integers beyond those of the layer before; 0 for the first.
    rest : ct.Rest or streams.CodedRest or None
        The content of REST for the first layer, of REFINED_REST for others; None: the rest pose of the layer before.
    """

    plan: Plan
    settings: Settings
    modes: LearnedModes | None
    digits: int = 0
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
    source: Source, prelude: CodedPrelude, settings: Settings, modes: LearnedModes | None, digits: Sequence[int]
) -> list[Layer]:
    """The layers for settings and a prelude that were found for the last of them."""
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
        step = qz.single(settings.step * 2.0**coarser)
        limit = settings.limit if coarser == 0 else None
        own = replace(settings if i == 0 else _uniform(prelude.plan, settings), step=step, limit=limit)
        layers.append(
            Layer(
                plan,
                own,
                modes if coarser == 0 or modes is None else nested(plan, modes, coarser),
                digits[i - 1] - coarser if i else 0,
                rests[i][0],
            )
        )
    return layers


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
        modes = streams.encode_refined_modes(layer.plan, layer.modes, before.modes, layer.digits)
        if modes is not None:
            chunks[level, ct.SHAPES] = ct.pack_refined_shapes(layer.digits, modes)
        if isinstance(layer.rest, streams.CodedRest):
            chunks[level, ct.REFINED_REST] = ct.pack_refined_rest(layer.rest.step, layer.rest.stream)
        before = layer
    return chunks


class _SegmentCoder:
    """Chunks {(level, kind): payload} and errors of stopping at each level, by each of MEASURES, of one segment."""

    def __init__(self, prelude: CodedPrelude, positions: np.ndarray):
        self._origin, self._dtype, self._positions = prelude.origin, prelude.dtype, positions
        self._pool = prelude.plan.pool
        self.chunks: dict[tuple[int, int], bytes] = {}
        self.errors: list[tuple[float, ...]] = []
        self.decoded = np.empty(0)

    def first(self, layer: Layer, layered: bool) -> SegmentMotion:
        """The levels of the branch hierarchy."""
        plan, settings = layer.plan, layer.settings
        segment, bases = analyse(plan, settings, self._positions, layer.modes, layered=layered)
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

    def refine(self, layer: Layer, before: SegmentMotion, level: int) -> SegmentMotion:
        """One further level."""
        settings, last = layer.settings, layer.plan.level_count - 1
        segment, bases = analyse(
            layer.plan, settings, self._positions, layer.modes, before, 1 << layer.digits, layered=True
        )
        head = stems_head(settings, last, bases)
        self.chunks[level, ct.STEMS] = ct.pack_refined_stems(
            1 << layer.digits, head, streams.encode_refinement(segment, last)
        )
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

    def _error(self, decoded: np.ndarray) -> tuple[float, ...]:
        return position_errors(decoded, self._positions, self._origin, self._pool)


def code_segment(
    prelude: CodedPrelude, layers: Sequence[Layer], positions: np.ndarray, exact: np.ndarray | None = None
) -> tuple[dict[tuple[int, int], bytes], np.ndarray]:
    """Chunks {(level, kind): payload} of one segment and (levels, 3) errors of stopping at each level.

    exact: the source's own numbers (see Source.exact), which one more level is to give.
    """
    coder, level = _SegmentCoder(prelude, positions), layers[0].plan.level_count
    segment = coder.first(layers[0], layered=len(layers) > 1)
    for layer in layers[1:]:
        segment = coder.refine(layer, segment, level)
        level += 1
    largest_bound = layers[-1].settings.largest_bound
    if coder.errors[-1][0] > largest_bound:
        raise AssertionError(f"decoded error {coder.errors[-1][0]} is beyond the bound {largest_bound}")
    if exact is not None:
        coder.chunks[level, ct.EXACT] = streams.encode_exact(coder.decoded, exact)
        coder.errors.append((0.0, 0.0, 0.0))
    return coder.chunks, np.array(coder.errors)
