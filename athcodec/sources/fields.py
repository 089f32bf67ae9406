"""A finite-element result, step by step, as a clip: which field is the displacement, and what else is kept.

If the points differ in any step, they are the motion. Otherwise the displacement is added to them: options.field, else
the one field per point that is called displacement, disp or u. A field called u may be a velocity too, so a
GuessWarning says that it was taken. Other data per point and per cell are kept where they are the same in all steps;
the clip's `not_read` names the others. The format of the file is not known here.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.motion.clip import RESERVED_NAMES, MotionClip, polygons
from athcodec.motion.frames import Frames
from athcodec.sources import ReadOptions
from athcodec.sources.cells import Part, Topology
from athcodec.sources.mesh import kind_of
from athcodec.sources.scene_objects import scene_fields
from athcodec.untyped import JsonObject

AMBIGUOUS = "u"  # Name of the displacement in some programs and of the velocity in others.
DISPLACEMENTS = ("displacement", "displacements", "disp", "displ", AMBIGUOUS)


class Steps(Protocol):
    """The steps of a result, as a format gives them, read when they are asked for.

    topology       of the first step
    left_out       names of data that are in no clip: per cell where they change, or per anything else
    elsewhere      names of the data of the first step that are not per point, and what they are per
    """

    @property
    def topology(self) -> Topology: ...
    @property
    def left_out(self) -> Sequence[str]: ...
    @property
    def elsewhere(self) -> Mapping[str, str]: ...

    def points(self, step: int) -> np.ndarray:
        """Return (N, 2) or (N, 3) points of the mesh."""

    def fields(self) -> Sequence[str]:
        """Return the names of the fields per point."""

    def field(self, step: int, name: str) -> np.ndarray:
        """Return (N, ...) values of a field."""

    def fixed_points(self) -> bool:
        """Return whether all steps have the points of the first."""

    def check(self, step: int) -> None:
        """Raise ClipError where the cells are others than in the first step."""


def clip_of_steps(
    steps: Steps,
    time: np.ndarray,
    metadata: JsonObject,
    name: str,
    options: ReadOptions,
    static: dict[str, np.ndarray],
    *,
    resource: Any = None,
    unchanged: Any = None,
    parts: Sequence[Part] = (),
    not_read: Mapping[str, list[str]] | None = None,
    is_own: bool = False,
) -> MotionClip:
    """Return the clip of a simulation result whose steps are at `time` (T,), in seconds.

    `static` holds the data per point that do not change, and `parts` the objects that the points form one after the
    other, "" for one without a name. is_own: athcodec's exporter wrote the file, so points that do not move stand
    still. Raises ClipError if nothing moves, or if it is not clear what does.
    """
    first = _padded(steps.points(0))
    fixed = steps.fixed_points()
    moved_by = _displacement(steps, fixed, 1 if is_own else len(time), options)
    if moved_by and moved_by.lower() == AMBIGUOUS and options.field is None:
        warnings.warn(
            f"{name}: the points do not move, and {moved_by} was taken for the displacement that moves them; pass "
            f"--field {moved_by} if it is that, and the name of the displacement if it is a velocity or anything else",
            GuessWarning,
            stacklevel=2,
        )
    frames = _frames(steps, first, fixed, moved_by, len(time))
    topology, names = steps.topology, _names_of_static(static, steps)
    attributes = topology.attributes | {new: static[key] for key, new in names.items()}
    attributes = {key: values for key, values in attributes.items() if key not in options.skip}
    metadata, numbers = scene_fields(metadata, len(first))
    parts = parts or (Part("", len(first)),)
    attributes |= {"part_vertex_counts": np.array([part.point_count for part in parts], np.int32)} | numbers
    domains = topology.domains | dict.fromkeys(("part_vertex_counts", "part_copies"), "constant")
    facts = {
        "part_names": [part.name or name for part in parts],
        "part_kinds": _kinds(parts, polygons(topology.faces, topology.attributes), topology.edges),
        "domains": {key: domain for key, domain in domains.items() if key in attributes},
    }
    kept = {*names, *options.skip, moved_by}
    moving = [key for key in steps.fields() if key not in kept] + [
        key for key in steps.left_out if key not in options.skip
    ]
    moving = list(dict.fromkeys(moving))
    rest = first.astype(frames.dtype) if moved_by else None
    return MotionClip(
        frames,
        time,
        faces=topology.faces,
        edges=topology.edges,
        **options.rest_fields(rest),
        attributes=attributes,
        metadata=facts | metadata,
        resource=resource,
        unchanged=unchanged,
        not_read=({"field": moving} if moving else {}) | dict(not_read or {}),
    )


def _frames(steps: Steps, first: np.ndarray, fixed: bool, moved_by: str | None, frame_count: int) -> Frames:
    """Return the positions at every step. If `moved_by` names a displacement field, positions are points plus
    displacement; otherwise they are the points. `first` has the points (N, 3) of step 0, which all steps share if
    `fixed`."""
    count = len(first)
    dtype = _dtype(first, _padded(steps.field(0, moved_by)) if moved_by else first)

    def frame(step: int) -> np.ndarray:
        """Return the positions (N, 3) at a step. Raises ClipError if the number of points differs from that of step
        0."""
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

    return Frames(read, frame_count, count, dtype)


def _names_of_static(static: Mapping[str, np.ndarray], steps: Steps) -> dict[str, str]:
    """Return the name of the attribute that each static array becomes; an array is left out if all of its names are
    in use."""
    attributes = steps.topology.attributes
    names = {key: f"vertex_{key}" if key in attributes else key for key in static}
    return {key: name for key, name in names.items() if name not in RESERVED_NAMES and name not in attributes}


def _kinds(parts: Sequence[Part], faces: tuple[np.ndarray, np.ndarray] | None, edges: np.ndarray | None) -> list[str]:
    """Return the kind of each object ("mesh", "curves" or "points"): an object with corners of faces is a mesh, one
    with edges alone is curves. `faces` is a pair of the faces' sizes and their corners."""
    if len(parts) == 1:
        return [kind_of(faces, edges)]
    stops = np.cumsum([part.point_count for part in parts])
    owners = [
        set() if corners is None else set(np.unique(np.searchsorted(stops, corners, side="right")).tolist())
        for corners in (None if faces is None else faces[1], edges)
    ]
    return [kind_of(*(True if part in owner else None for owner in owners)) for part in range(len(parts))]


def _padded(points: np.ndarray) -> np.ndarray:
    """Return (N, 3) of (N, 2) or (N, 3)."""
    if points.ndim != 2 or points.shape[1] not in (2, 3) or points.dtype.kind not in "fiu":
        raise ClipError(f"points: got {points.dtype} of shape {points.shape}, expected two or three numbers each")
    return points if points.shape[1] == 3 else np.pad(points, ((0, 0), (0, 1)))


def _dtype(*arrays: np.ndarray) -> type:
    single = all(values.dtype.kind == "f" and values.dtype.itemsize <= 4 for values in arrays)
    return np.float32 if single else np.float64


def _displacement(steps: Steps, fixed: bool, step_count: int, options: ReadOptions) -> str | None:
    """Return the name of the field to add to the points as their displacement, or None if the points move themselves.
    `fixed` says whether the points are the same at all steps. Raises ClipError if no field, or more than one, can be
    the displacement."""
    names = list(steps.fields())
    others = _listed([f"{key} ({place})" for key, place in steps.elsewhere.items()])
    listed = _listed(names) + (f"; not per point: {others}" if steps.elsewhere else "")
    if options.field is not None:
        if options.field not in names:
            raise ClipError(f"field: got {options.field!r}, expected one of {listed}")
        return options.field
    if not fixed:
        return None
    matching = [name for name in names if name.lower() in DISPLACEMENTS and _is_vector(steps.field(0, name))]
    if len(matching) > 1:
        raise ClipError(f"field: got {_listed(matching)}, expected one displacement; name it with --field")
    if not matching and step_count > 1 and (names or steps.elsewhere):  # Without any data, it stands still.
        vectors = [name for name in names if _is_vector(steps.field(0, name))]
        if vectors:
            advice = f"name one of {'them' if len(vectors) == len(names) else _listed(vectors)} with --field"
        else:
            advice = f"write the displacement with {'two or three numbers' if names else 'one value'} per point"
        raise ClipError(f"field: got points that do not move and no displacement, only {listed}; {advice}")
    return matching[0] if matching else None


def _is_vector(values: np.ndarray) -> bool:
    return values.ndim == 2 and values.shape[1] in (2, 3) and values.dtype.kind == "f"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(sorted(names)[:20]) or "no fields per point"
