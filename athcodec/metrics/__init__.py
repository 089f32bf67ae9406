"""How close decoded motion is to its source: the error of positions, how smooth it is over time, and shapes.

Frames are accumulated in float64, block by block, so that clips larger than memory can be measured. Lengths are in the
unit of the positions. A bound on the distance says nothing about how motion looks: an error that changes from frame
to frame trembles, one that changes at a seam between segments ticks, and one that differs from vertex to
vertex crumples faces. `SmoothnessMeter` and `ShapeMeter` measure that, `MotionMeter` all.

Examples
--------
>>> meter = athcodec.metrics.ErrorMeter()
>>> meter.add(np.zeros((2, 5, 3)), np.full((2, 5, 3), 0.1))
>>> round(meter.max_error, 3)
0.173
"""

from athcodec.metrics.blocks import Meter, Spread
from athcodec.metrics.error import ErrorMeter, bits_per_vertex_frame
from athcodec.metrics.motion import MotionMeter, level_meters
from athcodec.metrics.shape import ShapeMeter, edges_of, stem_links
from athcodec.metrics.smoothness import SmoothnessMeter, second_differences, tick_ratio

__all__ = [
    "ErrorMeter",
    "Meter",
    "MotionMeter",
    "ShapeMeter",
    "SmoothnessMeter",
    "Spread",
    "bits_per_vertex_frame",
    "edges_of",
    "level_meters",
    "second_differences",
    "stem_links",
    "tick_ratio",
]
