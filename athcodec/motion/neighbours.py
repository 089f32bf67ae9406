"""Whether points are the same ones in all frames: neighbours of one frame stay neighbours where a plant moves."""

from __future__ import annotations

from itertools import chain

import numpy as np

from athcodec.motion.clip import MotionClip
from athcodec.motion.sampling import spread

SAMPLED = 64  # Points whose neighbours are followed.
FRAMES = 17  # Frames that are looked at, spread over the clip: scans list other points in each.
APART = 0.1  # Distance, in diagonals, below which points count as neighbours.
TIMES_APART = 4.0  # Distance of two points, over that as neighbours, from which they are apart.


def lost_neighbours(clip: MotionClip) -> float:
    """Return the share, 0 to 1, of sampled points and frames in which a point is far from the point that was its
    nearest neighbour. A large share means that point numbers change between frames. For meshes and curves it is 0.

    Neighbours are looked for in the first, middle or last frame, whichever has the largest extent: before plants grow,
    and where leaves fall, points that are no neighbours may lie together.
    """
    if clip.polygons is not None or clip.edges is not None or clip.vertex_count < SAMPLED:
        return 0.0
    numbers = spread(clip.frame_count, FRAMES)
    largest = {numbers[0], numbers[len(numbers) // 2], numbers[-1]}
    frames = [clip.block(frame, frame + 1)[0] for frame in sorted(largest)]
    sizes = [float(np.linalg.norm(np.ptp(frame, axis=0))) for frame in frames]
    size = max(sizes)
    points = frames[sizes.index(size)].astype(np.float64)
    chosen = np.array(spread(clip.vertex_count, SAMPLED))
    nearest = np.empty(SAMPLED, np.int64)
    for row, vertex in enumerate(chosen):
        away = ((points - points[vertex]) ** 2).sum(axis=1)
        away[vertex] = np.inf
        nearest[row] = away.argmin()
    farthest = np.maximum(APART * size, TIMES_APART * np.linalg.norm(points[chosen] - points[nearest], axis=1))
    others = (clip.block(frame, frame + 1)[0] for frame in numbers if frame not in largest)
    distances = (np.linalg.norm(frame[chosen] - frame[nearest], axis=-1) for frame in chain(frames, others))
    return sum(int((distance > farthest).sum()) for distance in distances) / (SAMPLED * len(numbers))
