"""Writes PC2 point caches, and beside them, where there are faces or edges, the mesh that they move as OBJ.

A cache holds float32 positions and a start frame, at one step from frame to frame: clips whose times are uneven are
refused (MDD has a time per frame). Blender takes both files: import the OBJ with "Y forward, Z up", so that its axes
stay as they are, then add a Mesh Cache modifier. A mesh that is there already stays as it is where its vertices,
faces and edges are those of the clip, so that materials in it are kept; another one is never replaced.
"""

from __future__ import annotations

import os
from contextlib import suppress
from os import fspath
from pathlib import Path
from typing import BinaryIO

import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters import Progress, WriteOptions
from athcodec.exporters.mesh import ObjWriter, has_mesh, obj_arrays
from athcodec.exporters.scene_objects import lost_arrays
from athcodec.exporters.timing import frame_numbers
from athcodec.files.atomic import check_target, new_files
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget
from athcodec.motion.protocol import Motion
from athcodec.sources.mesh import Mesh
from athcodec.sources.mesh_files import read_mesh
from athcodec.sources.pc2 import HEADER, MAGIC
from athcodec.untyped import JsonObject

STEP_TOLERANCE = 1e-4
LARGEST_COUNT = 2**31 - 1


def write_clip(motion: Motion, path: FilePath, options: WriteOptions, report: Progress) -> JsonObject:
    """Write the cache and its mesh. Raises ClipError where the times are uneven or there is another mesh beside it,
    OSError where nothing can be written."""
    header = HEADER.pack(MAGIC, 1, *_counted(motion, *_start_and_step(motion)))
    return write_cache(motion, path, header, "<f4", report)


def _counted(motion: Motion, start: float, step: float) -> tuple[int, float, float, int]:
    check_counts(motion)
    return motion.vertex_count, start, step, motion.frame_count


def check_counts(motion: Motion) -> None:
    """Raise ClipError if a motion has more frames or vertices than a cache can count."""
    if max(motion.vertex_count, motion.frame_count) > LARGEST_COUNT:
        raise ClipError(f"got {motion.frame_count} frames of {motion.vertex_count} vertices, expected fewer than 2^31")


def _start_and_step(motion: Motion) -> tuple[float, float]:
    """Return the number of the first frame, and the number of frames from one sample to the next. Raise ClipError if
    the steps in time are uneven.
    """
    numbers = frame_numbers(motion)
    if len(numbers) < 2:
        return float(numbers[0]), 1.0
    step = float(numbers[-1] - numbers[0]) / (len(numbers) - 1)
    off = np.abs(numbers - numbers[0] - step * np.arange(len(numbers)))
    if off.max() > STEP_TOLERANCE * max(1.0, step):
        raise ClipError(
            f"time: frame {int(off.argmax())} is {off.max():.3g} frames off, expected even steps: a PC2 "
            "cache has no others; mdd has a time per frame"
        )
    return float(numbers[0]), float(round(step, 6))


def write_cache(motion: Motion, path: FilePath, header: bytes, dtype: str, report: Progress) -> JsonObject:
    """Write `header` and the positions in the type `dtype`, and beside them the mesh, if the clip has one and none is
    there yet. Return what point caches have no place for.
    """
    mesh_name = _mesh_to_write(motion, Path(check_target(path)))
    with new_files(path) as folder:
        if mesh_name:
            with open(os.path.join(folder, mesh_name), "wb") as file:
                ObjWriter(motion).write(file, np.asarray(motion.rest, motion.dtype))
        with open(os.path.join(folder, Path(check_target(path)).name), "wb") as file:
            file.write(header)
            _write_frames(motion, file, dtype, report)
    return lost_arrays(motion, obj_arrays(motion) if has_mesh(motion) else ())


def _write_frames(motion: Motion, file: BinaryIO, dtype: str, report: Progress) -> None:
    for start, frames in motion.blocks():
        file.write(np.ascontiguousarray(frames, dtype).data)
        report((start + len(frames)) / motion.frame_count)


def _mesh_to_write(motion: Motion, target: Path) -> str:
    """Return the name of the mesh file to write beside the cache, or "" if none is needed. Raise ClipError if another
    mesh has that name.
    """
    if not has_mesh(motion):
        return ""
    mesh_path = target.with_suffix(".obj")
    if not mesh_path.exists():
        return mesh_path.name
    topology = Mesh(np.empty((motion.vertex_count, 0)), motion.faces, motion.edges, dict(motion.attributes))
    different = "got no OBJ mesh"
    with suppress(ClipError):
        different = topology.same_topology(read_mesh(mesh_path, Budget()))
    if different:
        raise ClipError(
            f"{fspath(mesh_path)}: {different} as in the clip; remove this file or choose another name: "
            "the cache's own mesh goes there"
        )
    return ""
