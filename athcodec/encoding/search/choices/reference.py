"""Reference poses: what motion may be coded about in place of the source's rest pose.

The mean pose has the mean tracks of the motion, each seen from where its piece is attached: stems keep their lengths,
as they would not in the mean of positions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from athcodec.encoding.clip.survey import Ath
from athcodec.encoding.model import quantise as qz
from athcodec.encoding.model.motion import SegmentMotion
from athcodec.encoding.search.segment_samples import LEARNING_SEGMENTS
from athcodec.encoding.segments.segment import FINER, Source, analyse_finely, stage_streams, uncoded_plan
from athcodec.encoding.segments.settings import Settings
from athcodec.motion.algebra import nearest_rotations
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.sampling import spread


def mean_pose(source: Source, ath: Ath, settings: Settings) -> np.ndarray:
    """Return the mean pose of the motion, (N, 3) float64 less the origin, in file order. `settings`: those that a
    search starts with.
    """
    settings = replace(settings, forms=source.sheet_like.astype(np.int32), layer=0)
    plan = uncoded_plan(source, ath, settings)
    coefficients, tracks, frames = 0.0, 0.0, 0
    for segment in spread(len(source.segments), LEARNING_SEGMENTS):
        motion = analyse_finely(plan, settings, source.positions(segment))
        of_sum = np.sqrt(motion.frames)  # Factor from the coefficient of the mean wave to the sum over frames.
        coefficients = coefficients + of_sum * motion.coefficients[:, :, 0]
        tracks = tracks + of_sum * motion.tracks[:, :, :, 0]
        frames += motion.frames
    fine = replace(settings, step=qz.single(settings.step / FINER), turn_step=settings.turn_step / FINER)
    mean = SegmentMotion(plan, 1, stage_streams(fine, plan.stage_count, {}))
    mean.coefficients[:, :, 0], mean.tracks[:, :, :, 0] = np.rint(coefficients / frames), np.rint(tracks / frames)
    return mean.pose(plan.stage_count - 1, np.zeros(3), np.float64)[:, :, 0]


def turned_pose(rest: np.ndarray, mean: np.ndarray, hierarchy: Hierarchy) -> np.ndarray:
    """Return a rest pose, (N, 3) in file order, each tree of which is turned about its first vertex as a whole, as near
    to a mean pose as a rotation takes it: what turns keeps its shape, and is in the middle of its turns.
    """
    first = hierarchy.first_vertex[hierarchy.branch_parent < 0]
    count = np.diff(np.append(first, len(rest)))
    base = np.repeat(rest[first], count, axis=0)
    from_base, to_base = rest - base, mean - np.repeat(mean[first], count, axis=0)
    moments = np.add.reduceat(to_base[:, :, None] * from_base[:, None], first)
    turns = np.repeat(nearest_rotations(moments), count, axis=0)
    turned: np.ndarray = np.einsum("nij,nj->ni", turns, from_base) + base
    return turned
