"""Poses of plants that grow: those in which their parts have their full size.

Maps from a pose in which a part is hardly more than a point say nothing about its shape, so motion is coded about a
pose that shows every part.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from athcodec.motion.branches.seen import links_of
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.sampling import spread

FRAMES = 64  # Frames of a clip that are looked at.
SMALL_LINK = 0.2  # Length of a link, over its largest in any frame, below which it is not grown.
UNGROWN = 0.02  # Share of the links that may be small in the rest pose alone.
GROWN = 0.75  # Mean length of all links, over their largest, that some frame of what grows reaches.
LINKS = 20_000  # Links that are looked at, about.
SMALL = 0.5  # Size of a part, over its largest in any frame, below which another pose shows it better.


def with_grown_pose(clip: MotionClip) -> MotionClip:
    """Return the clip with the frame in which it is most grown as its rest pose, if that shows more of it."""
    pose = grown_pose(clip)
    return clip if pose is None else clip.replace(rest=pose, rest_given=False)


def grown_pose(clip: MotionClip) -> np.ndarray | None:
    """Return the frame in which the links between vertices are longest, (N, 3) in the clip's dtype, if the plant is
    more grown in the frames than in the rest pose: a frame has fewer links that are much shorter than at their longest.
    Return None if the rest pose serves as well.
    """
    if clip.frame_count == 1 or clip.vertex_count == 1:
        return None
    links = links_of(clip)
    if not len(links):
        links = np.stack([np.arange(clip.vertex_count - 1), np.arange(1, clip.vertex_count)], axis=1)
    links = links[:: max(1, len(links) // LINKS)]
    frames = shown_frames(clip)
    poses = (pose.T.copy() for pose in itertools.chain([clip.rest], poses_of(clip, frames)))
    sizes = np.sqrt([sum(np.square(x[links[:, 0]] - x[links[:, 1]]) for x in pose) for pose in poses])
    largest = sizes[1:].max(axis=0)
    small = (sizes < SMALL_LINK * largest).mean(axis=1)
    if small[0] <= small[1:].min() + UNGROWN:
        return None
    moving = largest > 0
    grown = (sizes[1:, moving] / largest[moving]).mean(axis=1)
    if grown.max() < GROWN:  # Points that wander are never all far apart.
        return None
    best = frames[int(np.argmax(grown))]
    return clip.block(best, best + 1)[0]


def with_grown_branches(pose: np.ndarray, clip: MotionClip, hierarchy: Hierarchy) -> np.ndarray:
    """Return `pose`, (N, 3), in which each branch that is much smaller than in some frame has the shape of the frame
    where it is largest. Such a branch hangs on its parent as it does in that frame.
    """
    if clip.frame_count == 1:
        return pose
    frames, source, first = shown_frames(clip), hierarchy.vertex_source, hierarchy.first_vertex
    sizes = np.array([_branch_sizes(frame[source], first) for frame in poses_of(clip, frames)])
    rest = pose[source].astype(np.float64)
    small = np.flatnonzero(_branch_sizes(rest, first) < SMALL * sizes.max(axis=0))
    if not len(small):
        return pose
    largest = np.array(frames)[sizes.argmax(axis=0)]
    shown = np.unique(largest[small]).tolist()
    shapes = {number: frame[source] for number, frame in zip(shown, poses_of(clip, shown))}
    for branch in small.tolist():  # Parents come first.
        shape, attach = shapes[int(largest[branch])], hierarchy.attach[branch]
        vertices = slice(first[branch], first[branch] + hierarchy.stem_count[branch])
        rest[vertices] = shape[vertices] + (rest[attach] - shape[attach] if attach >= 0 else 0.0)
    grown = np.empty_like(pose)
    grown[source] = rest
    return grown


def shown_frames(clip: MotionClip) -> list[int]:
    """Return the frames that show how a plant grows, spread over the clip."""
    return spread(clip.frame_count, FRAMES)


def poses_of(clip: MotionClip, frames: list[int]) -> Iterator[np.ndarray]:
    """Yield the positions (N, 3) float64 of the clip in each of these frames, which ascend. Frames in one chunk of the
    source are read together, so that it is unpacked once, but never more of them than fit a block."""
    length = min(clip.chunk_frames, clip.block_length())
    for _, chosen in itertools.groupby(frames, lambda frame: frame // length):
        run = list(chosen)
        block = clip.block(run[0], run[-1] + 1)
        for frame in run:
            yield block[frame - run[0]].astype(np.float64)


def _branch_sizes(pose: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return the diagonals of the stems' bounding boxes, (B,)."""
    return np.linalg.norm(np.maximum.reduceat(pose, first) - np.minimum.reduceat(pose, first), axis=1)
