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

VERTICES = 2048  # Vertices by which the motion is found, about.
PAIRED = 256  # Vertices of which all pairs are looked at, about.
ROUNDS = 12  # Fits, each by what the one before leaves least of.
LEAST_WEIGHED = 1e-5  # Of the diagonal: what a vertex is off by, below which it counts no more for it.
MOST_LEFT = 0.2  # Share of the squares of all motion that the rest of it is at most if there is motion in common.
LEAST_TURN = 0.7  # Radians by which all turn at least where a foot stands still, or nothing is rigid.
RIGID = 1e-5  # Distance, in diagonals, that a vertex moves at most beside the common motion to count as steady.
RIGID_SHARE = 0.01  # Least share of the vertices that has to be steady.
LEAST_STEADY = 8  # Least number of steady vertices: a turn known by fewer is one of noise.
WIDE = 0.03  # Least spread of steady vertices in two directions, in diagonals.
FEET = 4  # Vertices of a branch that carries others by which its turn is known, far apart.
LEAST_FEET = 3  # Least number of these: fewer tell no turn.
STEADY_FEET = 1e-4  # Of the diagonal: what feet are off by at most.
FLAT = 0.05  # Extent of feet across their line, over that along it, that turns are known by.


def without_common_motion(frames: np.ndarray) -> np.ndarray | None:
    """Return frames from which the rotation and translation that the whole plant shares is removed: each frame is moved
    so that the vertices that keep their distances from each other come as close as possible to where the rest pose has
    them. Return None if that removes little of the motion. `frames`: (1 + F, N, 3) positions, of which the first is the
    rest pose.
    """
    some = slice(None, None, max(1, frames.shape[1] // VERTICES))
    rest, poses = frames[0, some], frames[1:, some]
    diagonal = float(np.linalg.norm(np.ptp(rest, axis=0)))
    if not diagonal > 0 or len(rest) < LEAST_FEET:
        return None
    way = np.square(frames[1:] - frames[0]).sum(axis=2).max(axis=0)
    foot = int(way.argmin())
    stands = bool(way[foot] <= (RIGID * diagonal) ** 2)
    steady = _steady(frames[:, some], RIGID * diagonal)
    if stands or steady is None:
        least = _fit(rest, poses, np.ones(len(rest)))[0]
        if np.arccos(np.clip((np.trace(least, axis1=1, axis2=2).min() - 1) / 2, -1, 1)) < LEAST_TURN:
            return None
    weight = np.ones(len(rest)) if steady is None else steady
    for _ in range(ROUNDS):
        back, from_centre, to_centre = _fit(rest, poses, weight)
        left = (poses - to_centre[:, None]) @ back - (rest - from_centre)
        weight = 1 / (np.square(left).sum(axis=2).mean(axis=0) + (LEAST_WEIGHED * diagonal) ** 2)
    if np.square(left).sum() > MOST_LEFT * np.square(poses - rest).sum():
        return None
    if stands:  # On the axis of the turn.
        from_centre, to_centre = frames[0, foot], frames[1:, foot]
    moved = (frames[1:] - to_centre[:, None]) @ back + from_centre
    return np.concatenate([frames[:1], moved])


def _fit(rest: np.ndarray, poses: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rotations, (F, 3, 3), that take the poses, (F, N, 3), back to the rest pose best from the right, with
    weights (N,), and the centres there, (3,), and in the poses, (F, 3)."""
    weight = weight / weight.sum()
    from_centre, to_centre = weight @ rest, np.einsum("n,fni->fi", weight, poses)
    moments = np.einsum("n,fni,nj->fij", weight, poses - to_centre[:, None], rest - from_centre)
    return nearest_rotations(moments), from_centre, to_centre


def _steady(frames: np.ndarray, most: float) -> np.ndarray | None:
    """Return weights of the vertices, (N,), 1 for those of the largest set whose distances from one vertex of the set
    change by at most `most` over the frames, (F, N, 3), and 0 for the others. Return None if the set is small, or lies
    along a line, as on a stiff branch, from which no rotation can be told.
    """
    count = frames.shape[1]
    some = np.arange(0, count, max(1, count // PAIRED))
    least, largest = np.full((2, len(some), count), np.inf)
    largest *= -1
    for pose in frames:
        apart = np.linalg.norm(pose[some, None] - pose[None], axis=2)
        np.minimum(least, apart, out=least)
        np.maximum(largest, apart, out=largest)
    keeps = largest - least <= most
    best = keeps[keeps.sum(axis=1).argmax()]
    if np.count_nonzero(best) < max(LEAST_STEADY, RIGID_SHARE * count):
        return None
    rigid = frames[0, best]
    spread = np.linalg.svd(rigid - rigid.mean(axis=0), compute_uv=False) / np.sqrt(len(rigid))
    is_wide = spread[1] >= WIDE * np.linalg.norm(np.ptp(frames[0], axis=0))
    return best.astype(np.float64) if is_wide else None


def carried(branches: Found, frames: np.ndarray) -> Found | None:
    """Return branches with one more, on which all roots hang: it consists of some first vertices of roots, which stand
    still in `frames`, from which the common motion was removed. Return None if there are too few such vertices, or if
    they lie along a line.
    """
    label, parent = branches.vertex_branch.astype(np.int64), branches.branch_parent.astype(np.int64)
    roots = parent < 0
    if np.count_nonzero(roots) < 2:
        return None
    place = source_stem_index(label) if branches.stem_index is None else branches.stem_index.astype(np.int64)
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
    index = None if branches.stem_index is None else place
    return dataclasses.replace(
        checked_branches(label, above, place, branches.method),
        stem_index=index,
        array_name=branches.array_name,
        links=branches.links,
    )


def _far_apart(points: np.ndarray, count: int) -> np.ndarray:
    """Return at most so many points, ascending, each far from those before it."""
    chosen = [int(np.square(points - points.mean(axis=0)).sum(axis=1).argmax())]
    away = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        away = np.minimum(away, np.square(points - points[chosen[-1]]).sum(axis=1))
        chosen.append(int(away.argmax()))
    return np.unique(chosen)
