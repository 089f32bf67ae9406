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
MOST_SWAY = 0.8  # The same if vertices that keep their distances turn far: plants on a table may sway far about it.
LEAST_TURN = 0.7  # Radians by which all turn at least where a foot stands still, or nothing is rigid.
RIGID = 1e-5  # Distance, in diagonals, that a vertex moves at most beside the common motion to count as steady.
AT_ENDS = 64  # Vertices at each end along the axis of a turn, of which all pairs are looked at, too.
LEAST_STEADY = 8  # Least number of steady vertices: a turn known by fewer is one of noise.
WIDE = 0.03  # Least spread of steady vertices in two directions, in diagonals.
FEET = 4  # Vertices of a branch that carries others by which its turn is known, far apart.
LEAST_FEET = 3  # Least number of these: fewer tell no turn.
FLAT = 0.05  # Extent of feet across their line, over that along it, that turns are known by.


def without_common_motion(frames: np.ndarray) -> np.ndarray | None:
    """Return frames from which the rotation and translation that the whole plant shares is removed: each frame is moved
    so that the vertices that keep their distances from each other come as close as possible to where the rest pose has
    them. Return None if that removes little of the motion. `frames`: (1 + F, N, 3) positions, of which the first is the
    rest pose.
    """
    diagonal = float(np.linalg.norm(np.ptp(frames[0], axis=0)))
    if not diagonal > 0 or frames.shape[1] < LEAST_FEET:
        return None
    some = np.arange(0, frames.shape[1], max(1, frames.shape[1] // VERTICES))
    least = _fit(frames[:, some], np.ones(len(some)))[0]
    ends = _ends(frames[0], least)
    some = np.union1d(some, ends)
    seen = frames[:, some]
    rows = np.union1d(np.arange(0, len(some), max(1, len(some) // PAIRED)), np.searchsorted(some, ends))
    way = np.square(frames[1:] - frames[0]).sum(axis=2).max(axis=0)
    foot = int(way.argmin())
    stands = bool(way[foot] <= (RIGID * diagonal) ** 2)
    hardly_turns = bool(np.trace(least, axis1=1, axis2=2).min() > 1 + 2 * np.cos(LEAST_TURN))
    if stands and hardly_turns:
        return None
    moves = way[some] > (RIGID * diagonal) ** 2
    steady = _steady(seen, rows, moves, RIGID * diagonal)
    if steady is None and hardly_turns:
        return None
    floor = (LEAST_WEIGHED * diagonal) ** 2
    fit = _fit(seen, np.ones(len(some)) if steady is None else steady.astype(np.float64))
    for _ in range(ROUNDS if steady is None else 0):
        fit = _fit(seen, 1 / (_left2(seen, fit).mean(axis=0) + floor))
    left = _left2(seen, fit)
    most = MOST_LEFT if steady is None or hardly_turns else MOST_SWAY
    if left.sum() > most * np.square(seen[1:] - seen[0]).sum():
        return None
    back, from_centre, to_centre = fit
    if stands:  # On the axis of the turn.
        from_centre, to_centre = frames[0, foot], frames[1:, foot]
    moved = (frames[1:] - to_centre[:, None]) @ back + from_centre
    return np.concatenate([frames[:1], moved])


def _fit(frames: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rotations, (F, 3, 3), that take all frames but the first, (1 + F, N, 3), back to that best from the
    right, with weights (N,), and the centres in the first, (3,), and in the others, (F, 3)."""
    rest, poses = frames[0], frames[1:]
    weight = weight / weight.sum()
    from_centre, to_centre = weight @ rest, np.einsum("n,fni->fi", weight, poses)
    moments = np.einsum("n,fni,nj->fij", weight, poses - to_centre[:, None], rest - from_centre)
    return nearest_rotations(moments), from_centre, to_centre


def _left2(frames: np.ndarray, fit: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the squares of how far a fit leaves vertices from their places in the first frame, (F, N)."""
    back, from_centre, to_centre = fit
    left: np.ndarray = np.square((frames[1:] - to_centre[:, None]) @ back - (frames[0] - from_centre)).sum(axis=2)
    return left


def _ends(rest: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the vertices at both ends of a plant along the axis about which it turns, where its feet are."""
    turns = np.stack([rotations[:, i, j] - rotations[:, j, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
    order = np.argsort(rest @ np.linalg.svd(turns)[2][0], kind="stable")
    return np.unique(np.concatenate([order[:AT_ENDS], order[-AT_ENDS:]]))


def _steady(frames: np.ndarray, rows: np.ndarray, moves: np.ndarray, most: float) -> np.ndarray | None:
    """Return the widest set of vertices, (N,) bool, whose distances from each other change by at most `most` over the
    frames, (F, N, 3), and some of which move: feet are far apart, and what else is stiff is a branch. A set is what
    keeps its distance from one of `rows`, without what keeps it from few others of these. Return None if all are small,
    or so narrow that a rotation cannot be told from what distances change. `moves`: (N,) bool.
    """
    least, largest = np.full((2, len(rows), frames.shape[1]), np.inf)
    largest *= -1
    for pose in frames:
        size2 = np.square(pose).sum(axis=1)
        apart = np.sqrt(np.maximum(size2[rows, None] + size2 - 2 * pose[rows] @ pose.T, 0))
        np.minimum(least, apart, out=least)
        np.maximum(largest, apart, out=largest)
    change, diagonal = largest - least, np.linalg.norm(np.ptp(frames[0], axis=0))
    keeps = change <= most
    left, best, widest = keeps.sum(axis=1) >= LEAST_STEADY, None, 0.0
    while left.any():
        row = int(left.argmax())
        near = keeps[row]
        steady = near & (2 * keeps[near[rows]].sum(axis=0) > np.count_nonzero(near[rows]))
        left[steady[rows]] = left[row] = False
        if np.count_nonzero(steady) < LEAST_STEADY or not moves[steady].any():
            continue
        rigid = frames[0, steady]
        width = float(np.linalg.svd(rigid - rigid.mean(axis=0), compute_uv=False)[1] / np.sqrt(len(rigid)))
        is_wide = width * most >= WIDE * diagonal * change[steady[rows]][:, steady].max(initial=0.0)
        if is_wide and width > widest:
            best, widest = steady, width
    return best


def carried(branches: Found, frames: np.ndarray) -> Found | None:
    """Return branches with one more, on which all roots hang: it consists of the first vertices of some roots, which
    stand still in `frames`, from which the common motion was removed. Return None if there are too few such roots, or
    if they stand in a line. All first vertices that stand still go with them, so that tubes and ribbons stay whole.
    """
    label, parent = branches.vertex_branch.astype(np.int64), branches.branch_parent.astype(np.int64)
    roots = parent < 0
    if np.count_nonzero(roots) < 2:
        return None
    place = source_stem_index(label) if branches.stem_index is None else branches.stem_index.astype(np.int64)
    rest, diagonal = frames[0], float(np.linalg.norm(np.ptp(frames[0], axis=0)))
    off = np.sqrt(np.square(frames - rest).sum(axis=2).max(axis=0))
    size = np.bincount(label)
    first_moving = size - 1  # Of a root that stands still, too, a vertex is left.
    moving = np.flatnonzero(off > RIGID * diagonal)
    np.minimum.at(first_moving, label[moving], place[moving])
    feet = np.flatnonzero(roots[label] & (place == 0) & (first_moving > 0)[label])
    if len(feet) < LEAST_FEET:
        return None
    feet = feet[_far_apart(rest[feet], FEET)]
    extent = np.linalg.svd(rest[feet] - rest[feet].mean(axis=0), compute_uv=False)
    if extent[1] <= FLAT * extent[0]:
        return None
    is_carrier = np.isin(label, label[feet])
    place[is_carrier] -= first_moving[label[is_carrier]]
    standing = np.flatnonzero(is_carrier & (place < 0))
    standing = standing[np.lexsort((place[standing], label[standing]))]
    place[standing] = np.arange(len(standing))
    label[standing] = len(parent)
    above = np.append(np.where(roots, len(parent), parent), -1)
    index = None if branches.stem_index is None else place
    return dataclasses.replace(
        checked_branches(label, above, place, branches.method),
        stem_index=index,
        array_name=branches.array_name,
        links=branches.links,
        is_carried=True,
    )


def _far_apart(points: np.ndarray, count: int) -> np.ndarray:
    """Return at most so many points, ascending, each far from those before it."""
    chosen = [int(np.square(points - points.mean(axis=0)).sum(axis=1).argmax())]
    away = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        away = np.minimum(away, np.square(points - points[chosen[-1]]).sum(axis=1))
        chosen.append(int(away.argmax()))
    return np.unique(chosen)
