"""The mesh that is the rest pose of a file which does not hold one, as whoever plays the file has it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from athcodec.atomic_files import FileId
from athcodec.clip import MotionClip
from athcodec.errors import ClipError

HostMesh: TypeAlias = npt.ArrayLike | MotionClip | str | os.PathLike[str]


def mesh_positions(mesh: HostMesh, metadata: Mapping[str, Any]) -> tuple[np.ndarray, frozenset[FileId]]:
    """(N, 3) float32 positions of a mesh, of one in a file in the unit and axes of these metadata; and the files that
    they come from. Raises ClipError, OSError."""
    if isinstance(mesh, (str, os.PathLike)):
        return _read(mesh, metadata)
    positions = np.asarray(mesh.rest if isinstance(mesh, MotionClip) else mesh)
    if positions.ndim != 2 or positions.shape[1] != 3 or positions.dtype.kind not in "fiu":
        raise ClipError(f"host mesh: got {positions.dtype} of shape {positions.shape}, expected positions (N, 3)")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(positions, np.float32), getattr(mesh, "inputs", frozenset())


def _read(path: str | os.PathLike[str], metadata: Mapping[str, Any]) -> tuple[np.ndarray, frozenset[FileId]]:
    from athcodec.sources import read  # a decoder reads no sources otherwise

    units = {name: metadata[name] for name in ("unit", "up_axis") if isinstance(metadata.get(name), str)}
    with read(path, **units) as clip:
        return mesh_positions(clip, {})
