"""Joints of glTF for a motion: parts (fitting.py) with translation, rotation and scale along their own axes.

What hardly moves is made constant, so that it needs no keys. The error is measured against the motion, in the precision
that is written. It writes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from athcodec.exporters import Progress
from athcodec.exporters.fitting import Placed, fit
from athcodec.motion.protocol import Motion
from athcodec.motion.quaternions import quaternions, rotation_matrices

SLACK = 0.01  # Share of the allowed error below which motion counts as none.


@dataclass(eq=False)
class Joints:
    """J joints over T frames, as written: all arrays float32.

    vertex_joint (N,), or (N, k) with weights (N, k) that add up to 1; parent (J,), before its children, -1 for none, or
    None where none has any; names (J,); bind (J, 4, 4) from the clip's vertices to each joint; rest and moving poses
    are (translation, rotation, scale): (J, 3), (J, 4), (J, 3) and (T, J, 3), (T, J, 4), (T, J, 3), quaternions x y z w.
    max_error: the largest distance of a vertex from the motion, in scene units.
    """

    vertex_joint: np.ndarray
    bind: np.ndarray
    rest: tuple[np.ndarray, np.ndarray, np.ndarray]
    poses: tuple[np.ndarray, np.ndarray, np.ndarray]
    max_error: float = 0.0
    parent: np.ndarray | None = None
    weights: np.ndarray | None = None
    names: tuple[str, ...] = ()

    def pose(self, rest: np.ndarray, frame: int) -> np.ndarray:
        """Return (N, 3) float64: where an engine puts vertices whose rest pose (N, 3) is that of the file."""
        joint = self.vertex_joint
        bind = self.bind.astype(np.float64)[joint]
        local = np.einsum("nij,nj->ni", bind[:, :3, :3], rest) + bind[:, :3, 3]
        translation, rotation, scale = (pose[frame].astype(np.float64) for pose in self.poses)
        matrices = rotation_matrices(rotation) * scale[:, None, :]
        return np.einsum("nij,nj->ni", matrices[joint], local) + translation[joint]


def fit_joints(
    motion: Motion, allowed: float, most: int, report: Progress, chosen: np.ndarray | None = None
) -> Joints | None:
    """Return joints that move vertices to within about `allowed` of the motion, in scene units; None if that takes more
    than `most` joints. `chosen` (N,), bool, tells which vertices they move, by default all.
    """
    fitted = (1 - 4 * SLACK) * allowed  # `hold` takes up to 3 of these SLACKs, rounding some of the fourth.
    moving = fit(motion, Placed, fitted, most, lambda done: report(0.7 * done), chosen)
    if moving is None:
        return None
    parts, poses = moving.parts, (moving.places, *moving.values)
    still = (parts.middle, quaternions(parts.axes), np.ones((len(parts), 3)))
    for start, stop in motion.clip_range_frames:
        hold([pose[start:stop] for pose in poses], still, parts.extent, SLACK * allowed)
    bind = np.zeros((len(parts), 4, 4))
    bind[:, :3, :3] = parts.axes.swapaxes(1, 2)
    bind[:, :3, 3] = -np.einsum("kij,ki->kj", parts.axes, parts.middle)
    bind[:, 3, 3] = 1.0
    joints = Joints(parts.vertex_part(), bind.astype(np.float32), _singles(still), _singles(poses))
    joints.max_error = _measured(motion, joints, chosen, lambda done: report(0.7 + 0.3 * done))
    return joints


def _singles(pose: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a translation, a rotation and a scale in float32."""
    translation, rotation, scale = (values.astype(np.float32) for values in pose)
    return translation, rotation, scale


def _measured(motion: Motion, joints: Joints, chosen: np.ndarray | None, report: Progress) -> float:
    """Return the largest distance between the motion and the vertices that the joints move, in all frames. `chosen`
    (N,), bool, limits it to some vertices.
    """
    rows = slice(None) if chosen is None else chosen
    rest = np.asarray(motion.rest).astype(np.float32).astype(np.float64)
    largest = 0.0
    for start, frames in motion.blocks():
        for i, frame in enumerate(frames):
            away = (joints.pose(rest, start + i) - frame)[rows]
            largest = max(largest, float(np.einsum("ni,ni->n", away, away).max()))
        report((start + len(frames)) / motion.frame_count)
    return float(np.sqrt(largest))


def hold(poses: Sequence[np.ndarray], still: Sequence[np.ndarray], extent: np.ndarray, slack: float) -> None:
    """Make poses constant where no vertex moves further than `slack`: equal to the rest pose if that is close enough,
    else to the first frame. `poses` has the translations, rotations and scales (T, K, width) of K joints, `still` those
    at rest (K, width), and `extent` (K, 3) how far vertices reach along each joint's axes.
    """
    scaled = extent * np.abs(poses[2]).max(axis=0)
    around = np.sqrt((scaled**2).sum(axis=1, keepdims=True) - scaled**2)  # from each axis
    moves: tuple[Callable[[np.ndarray, np.ndarray], np.ndarray], ...] = (
        lambda values, constant: values - constant,
        lambda values, constant: _turns(constant, values) * around,
        lambda values, constant: (values - constant) * extent,
    )
    for values, rest, moved in zip(poses, still, moves):
        for constant in (values[0].copy(), rest):
            held = np.linalg.norm(moved(values, constant), axis=-1).max(axis=0) <= slack
            values[:, held] = constant[held]


def _turns(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return angles about a part's own axes, (T, K, 3), at most, between quaternions (K, 4) and (T, K, 4)."""
    turn = (
        before[..., 3:] * after[..., :3] - after[..., 3:] * before[..., :3] - np.cross(before[..., :3], after[..., :3])
    )
    return np.pi * turn
