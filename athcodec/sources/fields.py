"""A finite-element result, step by step, as a clip: which field is the displacement, and what else is kept.

Points of a step are those of the file plus the displacement. It is options.field, else the one field per point that is
called displacement, disp or u; where there is none, the points themselves move, and where they do move, a field of such
a name is left alone unless it is asked for. Other data per point and per cell are kept where they are the same in all
steps, and left out where they change in time: those per point are in the clip's `not_read`. The format of the file is
not known here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from athcodec.errors import ClipError
from athcodec.motion.clip import RESERVED_NAMES, MotionClip
from athcodec.motion.frames import Frames
from athcodec.sources import ReadOptions
from athcodec.sources.cells import Topology
from athcodec.sources.mesh import kind_of
from athcodec.sources.scene_objects import scene_said

DISPLACEMENTS = ("displacement", "displacements", "disp", "u", "displ")


class Steps(Protocol):
    """The steps of a result, as a format gives them, read when they are asked for. `topology` is that of the first."""

    topology: Topology

    def points(self, step: int) -> np.ndarray:
        """(N, 2) or (N, 3) points of the mesh."""

    def fields(self) -> Sequence[str]:
        """The names of the fields per point."""

    def field(self, step: int, name: str) -> np.ndarray:
        """(N, ...) values of a field."""

    def fixed_points(self) -> bool:
        """Whether all steps have the points of the first, as far as the file says."""

    def check(self, step: int) -> None:
        """Raises ClipError where the cells are others than in the first step."""


def clip_of_steps(
    steps: Steps,
    time: np.ndarray,
    metadata: dict[str, Any],
    name: str,
    options: ReadOptions,
    static: dict[str, np.ndarray],
    resource: Any = None,
    unchanged: Any = None,
) -> MotionClip:
    """The clip of a result at (T,) times. static: data per point that do not change. Raises ClipError where nothing
    moves, or it is not clear what does."""
    first = _padded(steps.points(0))
    moved_by = _displacement(steps, len(time), options)
    topology, count = steps.topology, len(first)
    dtype = _dtype(first, _padded(steps.field(0, moved_by)) if moved_by else first)
    fixed = steps.fixed_points()

    def frame(step: int) -> np.ndarray:
        steps.check(step)
        points = first if fixed else _padded(steps.points(step))
        if len(points) != count:
            raise ClipError(
                f"frame {step}: got {len(points)} vertices, expected {count} as in the first; topology "
                "that changes cannot be coded"
            )
        if not moved_by:
            return points
        moved = _padded(steps.field(step, moved_by))
        if len(moved) != count:
            raise ClipError(f"frame {step}: got {len(moved)} rows of {moved_by}, expected {count}, one per point")
        return points.astype(np.float64) + moved

    def read(start: int, stop: int) -> np.ndarray:
        with np.errstate(over="ignore", invalid="ignore"):
            return np.stack([frame(step).astype(dtype) for step in range(start, stop)])

    domains = dict(topology.domains)
    attributes = topology.attributes | {
        key: values for key, values in static.items() if key not in RESERVED_NAMES and key not in topology.attributes
    }
    attributes = {key: values for key, values in attributes.items() if key not in options.skip}
    metadata, numbers = scene_said(metadata, count)
    attributes |= {"part_vertex_counts": np.array([count], np.int32)} | numbers
    domains |= dict.fromkeys(("part_vertex_counts", "part_copies"), "constant")
    polygons = topology.faces if topology.faces is not None else topology.attributes.get("face_vertex_counts")
    said = {
        "part_names": [name],
        "part_kinds": [kind_of(polygons, topology.edges)],
        "domains": {key: domain for key, domain in domains.items() if key in attributes},
    }
    moving = [key for key in steps.fields() if key != moved_by and key not in attributes and key not in options.skip]
    rest = first.astype(dtype) if moved_by and options.rest == "auto" else None
    return MotionClip(
        Frames(read, len(time), count, dtype),
        time,
        faces=topology.faces,
        edges=topology.edges,
        rest=rest,
        rest_pose="mean" if options.rest == "mean" else "first",
        attributes=attributes,
        metadata=said | metadata,
        resource=resource,
        unchanged=unchanged,
        not_read={"field": moving} if moving else {},
    )


def _padded(points: np.ndarray) -> np.ndarray:
    """(N, 3) of (N, 2) or (N, 3)."""
    if points.ndim != 2 or points.shape[1] not in (2, 3) or points.dtype.kind not in "fiu":
        raise ClipError(f"points: got {points.dtype} of shape {points.shape}, expected two or three numbers each")
    return points if points.shape[1] == 3 else np.pad(points, ((0, 0), (0, 1)))


def _dtype(*arrays: np.ndarray) -> type:
    single = all(values.dtype.kind == "f" and values.dtype.itemsize <= 4 for values in arrays)
    return np.float32 if single else np.float64


def _displacement(steps: Any, step_count: int, options: ReadOptions) -> str | None:
    """The name of the field to add to the points; None: they move themselves."""
    names = list(steps.fields())
    if options.field is not None:
        if options.field not in names:
            raise ClipError(f"field: got {options.field!r}, expected one of {_listed(names)}")
        return options.field
    if not steps.fixed_points() and _points_differ(steps, step_count):
        return None
    found = [name for name in names if name.lower() in DISPLACEMENTS and _is_vector(steps.field(0, name))]
    if len(found) > 1:
        raise ClipError(f"field: got {_listed(found)}, expected one displacement; name it with --field")
    if not names and step_count > 1:
        raise ClipError("field: got points that do not move and no field per point, expected a displacement")
    if not found and step_count > 1:
        raise ClipError(
            f"field: got points that do not move and no displacement, only {_listed(names)}; name one of "
            "them with --field"
        )
    return found[0] if found else None


def _points_differ(steps: Any, step_count: int) -> bool:
    first = steps.points(0)
    return any(
        not np.array_equal(first, steps.points(step))
        for step in {1, step_count // 2, step_count - 1}
        if 0 < step < step_count
    )


def _is_vector(values: np.ndarray) -> bool:
    return values.ndim == 2 and values.shape[1] in (2, 3) and values.dtype.kind == "f"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(sorted(names)[:20]) or "no fields per point"
