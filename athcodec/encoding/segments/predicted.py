"""Predicted motion of a segment, of a whole file or of some trees beside others (FORMAT.md, Predicted motion)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property

import numpy as np

from athcodec._native import LOOSE
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.motion import Plan
from athcodec.encoding.segments.segment import CodedPrelude
from athcodec.encoding.segments.settings import Settings
from athcodec.encoding.streams import streams, writing
from athcodec.errors import BoundError

STEPS = (0.999, 0.97, 0.9, 0.75, 0.5, 0.3)  # Steps tried, over the largest that reaches every point in the limit.


def code_predicted(
    plan: Plan,
    output: tuple[np.ndarray, np.dtype],
    settings: Settings,
    error_share: float,
    positions: np.ndarray,
    limit: np.ndarray | float | None = None,
) -> tuple[bytes, np.ndarray]:
    """Code the motion of a segment by prediction. Return the payload of the chunk PREDICTED, and the positions that it
    decodes to, (N, 3, T), frame by frame in memory. Raises BoundError if no step keeps the limits. `output`: origin and
    type of decoded positions; `error_share`: share of the limits that errors may take; `positions`: (N, 3, T) of the
    source, less the origin; `limit`: that of the plan's vertices, where it is not that of the settings.
    """
    origin, dtype = output
    limits = np.array(np.broadcast_to(settings.limit if limit is None else limit, len(positions)), np.float64)
    for share in dict.fromkeys((error_share, 1.0)):  # A part may need too fine numbers.
        for factor in STEPS:
            step = qz.single(factor * largest_step(share * limits))
            coded = streams.encode_predicted(plan, origin, positions, share * limits, step, dtype)
            if coded is not None:
                return writing.pack_predicted(step, coded[0]), coded[1].transpose(1, 2, 0)
    raise BoundError(f"max error: got {settings.bound:.3g}; it cannot be kept in the output's {dtype.name} numbers")


def largest_step(limit: np.ndarray | float) -> float:
    """Return the largest step that reaches every place within the limit."""
    return qz.single(qz.SAFE_REST_CAP * float(np.min(limit)))


def trees_alone(branches: np.ndarray, trees: np.ndarray) -> np.ndarray:
    """Return the branches of some trees as if there were no others. `branches`: (B,) of _native.BRANCH; `trees`: (B,)
    bool, which of them are of these trees.
    """
    alone = branches[trees].copy()
    number_of_branch = np.cumsum(trees) - 1
    chosen = np.repeat(trees, branches["count"])
    number = np.cumsum(chosen) - 1
    has_parent = alone["parent"] >= 0
    alone["parent"][has_parent] = number_of_branch[alone["parent"][has_parent]]
    alone["attach"][has_parent] = number[alone["attach"][has_parent]]
    alone["first"] = number[alone["first"]]
    alone["flags"] &= ~LOOSE
    return alone


class PredictedTrees:
    """The trees of a plan that have predicted motion beside others, as if the file had no other branches.

    vertices: (K,) theirs in file order.
    """

    def __init__(self, prelude: CodedPrelude, plan: Plan, settings: Settings, error_share: float):
        """Take the trees that `settings` name out of a `plan`, that of the last layer, which has its rest pose."""
        assert settings.predicted_trees is not None
        self._trees, self._plan, self._settings = settings.predicted_trees, plan, settings
        self.vertices = np.flatnonzero(np.repeat(self._trees, plan.branches["count"]))
        self._share, self._output = error_share, prelude.output

    @cached_property
    def _alone(self) -> Plan:
        """A plan of these trees alone."""
        plan = Plan(trees_alone(self._plan.branches, self._trees), len(self.vertices), predicted=True)
        plan.set_rest(self._plan.rest[self.vertices], bases=False)
        return plan

    def coded(self, positions: np.ndarray) -> tuple[bytes, np.ndarray]:
        """Return what `code_predicted` does for these trees. `positions`: (K, 3, T) theirs, less the origin."""
        limit = self._settings.limit_of(self.vertices)
        return code_predicted(self._alone, self._output, self._settings, self._share, positions, limit)

    def standing(self, positions: np.ndarray) -> np.ndarray:
        """Return the positions of a whole segment, (N, 3, T), in which these trees stand in their rest pose."""
        stands = positions.copy()
        stands[self.vertices] = self._plan.rest[self.vertices][:, :, None]
        return stands


class PredictedBeside:
    """The predicted motion of some trees in one segment, beside others in modes.

    payload: of the chunk PREDICTED. modes: (N, 3, T) the positions that modes describe, in which the trees stand.
    """

    def __init__(self, trees: PredictedTrees, positions: np.ndarray):
        """Code the predicted trees of a segment. `positions`: (N, 3, T) of the source, less the origin."""
        self._vertices, self._source = trees.vertices, positions[trees.vertices]
        self.payload, self._decoded = trees.coded(self._source)
        self.modes = trees.standing(positions)

    @contextmanager
    def shown(self, decoded: np.ndarray, is_last: bool) -> Iterator[None]:
        """Return a context in which `modes` has the trees where the source has them, and `decoded`, the positions of a
        stage, where this motion has them if the stage is the last one."""
        stood, stood_decoded = self.modes[self._vertices], decoded[self._vertices]
        self.modes[self._vertices] = self._source
        if is_last:
            decoded[self._vertices] = self._decoded
        yield
        self.modes[self._vertices], decoded[self._vertices] = stood, stood_decoded
