"""Whether points are the same ones in all frames: neighbours of one frame stay neighbours where a plant moves."""

from __future__ import annotations

import numpy as np

from athcodec.motion.clip import MotionClip

SAMPLED = 64  # Points whose neighbours are followed.
APART = 0.1  # Distance, in diagonals, below which points count as neighbours,
TIMES_APART = 4.0  # as they do below so many times the distance that they had as neighbours.


def lost_neighbours(clip: MotionClip) -> float:
    """Return the share of sampled points, over all frames, that are far from their neighbour; 0 for meshes and curves.

    Neighbours are those of the first, middle or last frame, whichever is the largest: before plants grow, and where
    leaves begin to fall, points may lie together that are no neighbours.
    """
    if clip.polygons is not None or clip.edges is not None or clip.vertex_count < SAMPLED:
        return 0.0
    frames = [clip.block(frame, frame + 1)[0] for frame in {0, clip.frame_count // 2, clip.frame_count - 1}]
    sizes = [float(np.linalg.norm(np.ptp(frame, axis=0))) for frame in frames]
    size = max(sizes)
    points = frames[sizes.index(size)].astype(np.float64)
    chosen = np.linspace(0, clip.vertex_count - 1, SAMPLED).astype(np.int64)
    nearest = np.empty(SAMPLED, np.int64)
    for row, vertex in enumerate(chosen):
        away = ((points - points[vertex]) ** 2).sum(axis=1)
        away[vertex] = np.inf
        nearest[row] = away.argmin()
    farthest = np.maximum(APART * size, TIMES_APART * np.linalg.norm(points[chosen] - points[nearest], axis=1))
    lost = sum(
        int((np.linalg.norm(block[:, chosen] - block[:, nearest], axis=-1) > farthest).sum())
        for _, block in clip.blocks()
    )
    return lost / (SAMPLED * clip.frame_count)
