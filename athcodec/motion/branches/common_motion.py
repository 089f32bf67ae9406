"""What turns or travels as a whole: plants on a turntable, in a pot that is carried, on a boat.

Branches are found by how parts move against each other, so what all have in common is taken off first. Where several
plants have it in common, a few vertices that keep their distances, such as feet, become a branch that carries all.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from athcodec.motion.algebra import nearest_rotations
from athcodec.motion.branches.result import Found, checked_branches
from athcodec.motion.clip import source_stem_index

VERTICES = 4096  # Vertices by which the motion is found, about.
ROUNDS = 12  # Fits, each by what the one before leaves least of.
LEAST_WEIGHED = 1e-5  # Of the diagonal: what a vertex is off by, below which it counts no more for it.
MOST_LEFT = 0.2  # Share of the squares of all motion that the rest of it is at most if there is motion in common.
LEAST_TURN = 0.35  # Radians; plants that stand in wind lean by less.
RIGID, RIGID_SHARE = 1e-5, 0.01  # Of the diagonal: what the share of the vertices is off by that shows it as well.
FEET, LEAST_FEET = 8, 3  # Vertices of a branch that carries others.
STEADY_FEET = 1e-4  # Of the diagonal: what feet are off by at most.
FLAT = 0.05  # Extent of feet across their line, over that along it, that turns are known by.


def without_common_motion(frames: np.ndarray) -> np.ndarray | None:
    """Return the frames, (1 + F, N, 3), of which the first is the rest pose, each moved so that most of what keeps its
    distances is where it is in the rest pose; None where that takes off little of the motion."""
    some = slice(None, None, max(1, frames.shape[1] // VERTICES))
    rest, poses = frames[0, some], frames[1:, some]
    diagonal = float(np.linalg.norm(np.ptp(rest, axis=0)))
    if not diagonal > 0 or len(rest) < LEAST_FEET:
        return None
    weight = np.ones(len(rest))
    for _ in range(ROUNDS):
        weight /= weight.sum()
        from_centre, to_centre = weight @ rest, np.einsum("n,fni->fi", weight, poses)
        moments = np.einsum("n,fni,nj->fij", weight, poses - to_centre[:, None], rest - from_centre)
        back = nearest_rotations(moments)
        left = (poses - to_centre[:, None]) @ back - (rest - from_centre)
        off2 = np.square(left).sum(axis=2).mean(axis=0)
        weight = 1 / (off2 + (LEAST_WEIGHED * diagonal) ** 2)
    turn = np.arccos(np.clip((np.trace(back, axis1=1, axis2=2).min() - 1) / 2, -1, 1))
    is_rigid = off2 <= (RIGID * diagonal) ** 2
    moves = np.square(poses[:, is_rigid] - rest[is_rigid]).sum(axis=2).max(axis=0) > (STEADY_FEET * diagonal) ** 2
    if turn < LEAST_TURN and np.count_nonzero(moves) < max(LEAST_FEET + 1, RIGID_SHARE * len(rest)):
        return None
    if np.square(left).sum() > MOST_LEFT * np.square(poses - rest).sum():
        return None
    way = np.square(frames[1:] - frames[0]).sum(axis=2).max(axis=0)
    foot = int(way.argmin())
    if way[foot] <= (RIGID * diagonal) ** 2:  # It stands on the axis of the turn.
        from_centre, to_centre = frames[0, foot], frames[1:, foot]
    moved = (frames[1:] - to_centre[:, None]) @ back + from_centre
    return np.concatenate([frames[:1], moved])


def carried(found: Found, frames: np.ndarray) -> Found | None:
    """Return branches with one that all roots hang on, of vertices of theirs that stand still in frames without common
    motion; None where too few do, or along a line."""
    label, parent = found.vertex_branch.astype(np.int64), found.branch_parent.astype(np.int64)
    roots = parent < 0
    if np.count_nonzero(roots) < 2:
        return None
    place = source_stem_index(label) if found.stem_index is None else found.stem_index.astype(np.int64)
    rest, diagonal = frames[0], float(np.linalg.norm(np.ptp(frames[0], axis=0)))
    off = np.sqrt(np.square(frames - rest).sum(axis=2).max(axis=0))
    is_first = (place == 0) & (np.bincount(label) > 1)[label]
    feet = np.flatnonzero(roots[label] & is_first & (off <= STEADY_FEET * diagonal))
    if len(feet) < LEAST_FEET:
        return None
    feet = feet[_far_apart(rest[feet], FEET)]
    extent = np.linalg.svd(rest[feet] - rest[feet].mean(axis=0), compute_uv=False)
    if extent[1] <= FLAT * extent[0]:
        return None
    place[np.isin(label, label[feet])] -= 1
    place[feet] = np.arange(len(feet))
    label[feet] = len(parent)
    above = np.append(np.where(roots, len(parent), parent), -1)
    index = None if found.stem_index is None else place
    return dataclasses.replace(checked_branches(label, above, place, found.method), stem_index=index, taken=found.taken)


def _far_apart(points: np.ndarray, count: int) -> np.ndarray:
    """Return at most so many points, ascending, each far from those before it."""
    chosen = [int(np.square(points - points.mean(axis=0)).sum(axis=1).argmax())]
    away = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        away = np.minimum(away, np.square(points - points[chosen[-1]]).sum(axis=1))
        chosen.append(int(away.argmax()))
    return np.unique(chosen)
