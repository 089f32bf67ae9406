"""Plants of several kinds side by side, which move unlike each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from athcodec import MotionClip
from bench.scenes import fields, singles
from bench.scenes.assembly import FPS, Scene

GAP = 0.05  # Between two scenes, over the width of the wider one.


def meadow(seed: int, blades: int, stems: int) -> Scene:
    """Return a leafed tree in a storm between blades of wheat and stems of a hedge."""
    return beside_each_other([fields.ribbons(seed, blades, 20), singles.storm(seed), fields.stems(seed, stems)])


def crown_and_kelp(seed: int, leaves: int, plants: int) -> Scene:
    """Return leaves of a willow beside kelp in a swell."""
    return beside_each_other([singles.willow(seed, leaves), fields.kelp(seed, plants)])


def beside_each_other(scenes: Sequence[Scene]) -> Scene:
    """Return one scene of several of as many frames, next to each other along the first axis. Each is one part."""
    positions, branch, parent, faces, plant, foot = [], [], [], [], [], []
    edge, vertices, branches = 0.0, 0, 0
    for number, scene in enumerate(scenes):
        clip = scene.clip
        across = clip.positions[..., 0]
        width = float(np.ptp(across))
        positions.append(clip.positions + np.float32([edge - across.min(), 0, 0]))
        edge += (1 + GAP) * width
        branch.append(clip.vertex_branch + branches)
        parent.append(np.where(clip.branch_parent < 0, -1, clip.branch_parent + branches))
        faces.append(np.where(clip.faces < 0, -1, clip.faces + vertices))
        plant.append(np.full(clip.vertex_count, number))
        foot.append(scene.foot + vertices)
        vertices, branches = vertices + clip.vertex_count, branches + clip.branch_count
    corners = max(rows.shape[1] for rows in faces)
    rows = [np.pad(rows, ((0, 0), (0, corners - rows.shape[1])), constant_values=-1) for rows in faces]
    clip = MotionClip(
        np.concatenate(positions, axis=1),
        np.arange(len(positions[0])) / FPS,
        np.concatenate(branch),
        np.concatenate(parent),
        faces=np.concatenate(rows).astype(np.int32),
        metadata={"unit": "m", "up_axis": "y", "fps": FPS},
    )
    return Scene(clip, np.concatenate(plant), np.concatenate(foot))
