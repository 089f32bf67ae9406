"""All that is measured of one decoded motion against its source."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from athcodec.metrics.blocks import Meter
from athcodec.metrics.error import ErrorMeter
from athcodec.metrics.shape import ShapeMeter, edges_of, stem_links
from athcodec.metrics.smoothness import SmoothnessMeter
from athcodec.motion.clip import MotionClip
from athcodec.options import real
from athcodec.untyped import JsonObject

if TYPE_CHECKING:
    from athcodec.decoding.decoder import Decoder

TAIL = 0.999
"""The quantile of edges and faces that is given: one in a thousand is worse."""


class MotionMeter(Meter):
    """The meters of error, smoothness and shape together, for the frames of a clip in their order.

    Parameters
    ----------
    clip : MotionClip
        The source, for its rest pose, faces and number of frames.
    bound : float
        The largest error that any vertex may have, in the unit of the positions: that in which second differences
        of the error are given.
    weights : (N,) array, optional
        Factors on the bound for each vertex, of which the largest stands for `bound` itself.
    starts, loop
        As for SmoothnessMeter.
    edges : (E, 2) array of integers, optional
        Pairs of vertices; by default those of `edges_of`.
    file_bound : float, optional
        The largest bound of the file, of which this is a level; by default `bound`.

    Attributes
    ----------
    bounds : float or (N,) array
        The bound of all vertices, or of each.
    error : ErrorMeter
    smoothness : SmoothnessMeter
    shape : ShapeMeter
    """

    def __init__(
        self,
        clip: MotionClip,
        *,
        bound: float,
        weights: np.ndarray | None = None,
        starts: Sequence[int] = (),
        loop: bool = False,
        edges: np.ndarray | None = None,
        file_bound: float | None = None,
    ) -> None:
        """Begin to measure motion against `clip`. `bound` is the error bound in scene units; with `weights` (N,) a
        vertex has the part of it that is its weight over the largest one. `file_bound` is the bound of the whole file,
        `starts` has the first frames of segments, and `edges` (E, 2) the edges measured, by default those of the clip.
        """
        bound = real("bound", bound)
        self._file_bound = bound if file_bound is None else real("file_bound", file_bound)
        self.bounds = bound if weights is None else bound * weights / weights.max()
        self.error = ErrorMeter(clip.rest, weights)
        self.smoothness = SmoothnessMeter(clip.frame_count, self.bounds, starts, loop)
        self.shape = ShapeMeter(edges_of(clip) if edges is None else edges, clip.polygons)
        self._values = self.shape._values

    def _add(self, reference: np.ndarray, decoded: np.ndarray) -> None:
        for meter in (self.error, self.smoothness, self.shape):
            meter._add(reference, decoded)

    def figures(self) -> JsonObject:
        """Return the measurements by the names that JSON uses: "smoothness" and "shape" are dictionaries of their own.

        Second differences of the error are in error bounds, angles in degrees. A measurement is None if the clip has no
        seams, edges or faces for it.
        """
        error, smoothness = self.error, self.smoothness
        jerks = smoothness.jerks(self._file_bound)
        return {
            "max_error": error.max_error,
            "rms_error": error.rms_error,
            "kg_error_percent": error.kg_error,
            "motion_normalised_error": error.motion_normalised_error,
            "smoothness": {
                "max_second_difference": smoothness.max_error_acceleration,
                "rms_second_difference": smoothness.rms_error_acceleration,
                "worst_share_above_bound": smoothness.worst_share,
                "median_share_above_bound": smoothness.median_share,
                "tick_ratio": smoothness.tick_ratio,
                "source_tick_ratio": smoothness.source_tick_ratio,
                "acceleration_ratio": float(jerks.max(initial=0.0)),
                "acceleration_ratio_frame": int(jerks.argmax()) if len(jerks) else 0,
            },
            "shape": self._shape(),
        }

    def _shape(self) -> JsonObject:
        """Return the measurements of how edges stretch and faces turn, by name."""
        shape = self.shape
        edges = {
            "edges": shape.edge_count,
            "left_out_edges": shape.left_out_edges,
            "rms_stretch": shape.stretch.rms,
            "tail_stretch": shape.stretch.quantile(TAIL),
        }
        faces = {
            "faces": shape.face_count,
            "left_out_faces": shape.left_out_faces,
            "degenerate_faces": shape.degenerate_faces,
            "rms_normal_angle": shape.angle.rms,
            "tail_normal_angle": shape.angle.quantile(TAIL),
            "tail_excess_turn": shape.excess_turn.quantile(TAIL),
        }
        return _or_none(edges, shape.edge_count) | _or_none(faces, shape.face_count)


def level_meters(decoder: Decoder, clip: MotionClip) -> list[MotionMeter]:
    """Return an empty meter for each level of a decoder, to which the frames of all segments are to be added.

    The bound of a level is the largest error that it promises, but not less than the file's bound.

    Parameters
    ----------
    decoder : Decoder
    clip : MotionClip
        The source that the file was encoded from.

    Returns
    -------
    list of MotionMeter
        In the order of ``decoder.levels``.
    """
    edges = edges_of(clip)
    if edges is None:
        edges = stem_links(decoder.file.vertex_branch, decoder.file.stem_index)
    return [
        MotionMeter(
            clip,
            bound=max(level.max_error, decoder.file.max_error_bound),
            weights=decoder.file.error_weights,
            starts=[start for start, _ in decoder.segments],
            loop=decoder.clip.loop,
            edges=edges,
            file_bound=decoder.file.max_error_bound,
        )
        for level in decoder.levels
    ]


def _or_none(figures: JsonObject, count: int) -> JsonObject:
    return figures if count else dict.fromkeys(figures)
