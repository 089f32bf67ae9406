"""Reads and writes points as text: a line "points 1", one with the numbers of frames and vertices, and for each frame a
line with its time in seconds and one for each point."""

import numpy as np

from athcodec import MotionClip
from athcodec.errors import ClipError
from athcodec.files.atomic import new_file
from athcodec_points import MAGIC


def read_clip(path, options):
    """Return the MotionClip in a file. `options` is an athcodec.sources.ReadOptions."""
    with open(path) as file:
        _, counts, *numbers = file.read().split("\n", 2)
    frames, vertices = map(int, counts.split())
    numbers = np.array(" ".join(numbers).split(), float)
    if numbers.size != frames * (1 + 3 * vertices):
        raise ClipError(f"{path}: got {numbers.size} numbers, expected {frames * (1 + 3 * vertices)}")
    table = numbers.reshape(frames, 1 + 3 * vertices)
    return MotionClip(table[:, 1:].reshape(frames, vertices, 3), table[:, 0])


def write_clip(motion, path, options, report):
    """Write a clip, or a level of an .ath file. `options` is an athcodec.exporters.WriteOptions."""
    with new_file(path) as file:
        file.write(MAGIC + f"{motion.frame_count} {motion.vertex_count}\n".encode())
        for start, positions in motion.blocks():
            for time, frame in zip(motion.time[start:], positions):
                np.savetxt(file, frame, "%.9g", header=f"{time:.17g}", comments="")
            report((start + len(positions)) / motion.frame_count)
