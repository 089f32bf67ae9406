"""The mesh of the host that is the rest pose of a file without one."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from athcodec.errors import ClipError
from athcodec.files.atomic import FileId
from athcodec.motion.clip import MotionClip

HostMesh: TypeAlias = npt.ArrayLike | MotionClip


def mesh_positions(mesh: HostMesh) -> tuple[np.ndarray, frozenset[FileId]]:
    """Return (N, 3) float32 positions of a mesh, and the files that they come from. Raises ClipError."""
    positions = np.asarray(mesh.rest if isinstance(mesh, MotionClip) else mesh)
    if positions.ndim != 2 or positions.shape[1] != 3 or positions.dtype.kind not in "fiu":
        raise ClipError(f"host mesh: got {positions.dtype} of shape {positions.shape}, expected positions (N, 3)")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(positions, np.float32), getattr(mesh, "inputs", frozenset())
