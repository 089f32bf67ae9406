"""A plant's motion on another mesh: `athcodec.onto`.

chains.py makes frames along the stems of the plant, surface.py finds what hangs together in the mesh, search.py where
on the plant each piece hangs, and moving.py moves it. scene.py looks for the unit and the up axis of a mesh that lies
elsewhere.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from athcodec.arrays import Source, clip_of
from athcodec.binding.bones import bones_of
from athcodec.binding.chains import Chains
from athcodec.binding.moving import MovingPoints
from athcodec.binding.scene import COVERS, FITS, Fit
from athcodec.binding.search import Marks, bind
from athcodec.binding.surface import MeshPoints
from athcodec.decoding.array_like import ArrayLike
from athcodec.decoding.clip_view import ClipView
from athcodec.decoding.decoder import Decoder
from athcodec.decoding.indexing import split_index
from athcodec.errors import ClipError, CoarseWarning
from athcodec.files.atomic import FileId
from athcodec.files.plain import FilePath
from athcodec.files.shown import counted
from athcodec.metrics import ErrorMeter
from athcodec.motion.branches.steady import scipy_module
from athcodec.motion.clip import MotionClip, stands_still, stem_index_of
from athcodec.motion.frames import Frames
from athcodec.motion.joining import BLEND, HEADING, OWN, STRENGTH
from athcodec.motion.scene import in_scene
from athcodec.motion.units import METRES_PER_UNIT, checked_axis, checked_unit, stated_scene
from athcodec.untyped import JsonObject, Keywords

FAR = 0.1  # Distance from the plant, as a share of its diagonal, beyond which a vertex is named as far.
COARSE_REST = 2.0  # Error of the plant's rest pose over that of its motion, above which a mesh lies on it badly.
POINT = 10.0  # Diagonal of a plant over its error, up to which it is a point.
MOST_FAR = 0.5  # Share of far vertices above which a mesh is refused.
DEFAULT_SCENE = {"unit": "m", "up_axis": "y"}
OF_PLANT = ("unit", "up_axis", METRES_PER_UNIT, "fps", "start_frame", STRENGTH, HEADING, BLEND, OWN)
OF_MESH = ("animations", "presence")  # What the mesh's metadata say of the frames that it had.


@dataclass(frozen=True)
class OntoReport:
    """What `onto` did with a mesh; lengths are in the plant's unit.

    Attributes
    ----------
    vertex_count : int
        Vertices of the mesh.
    far_count : int
        Vertices that are further from the plant than `far_limit` in the rest pose.
    far_limit : float
        A tenth of the diagonal of the plant's rest pose.
    furthest : float
        Largest distance of a vertex from the plant.
    card_count : int
        Connected pieces, such as leaves, that each move as a whole.
    joint_count : int
        Vertices that more than one branch moves.
    unit : str
        The plant's unit, "" where it states none.
    frame_count : int
        Frames that were compared with the mesh's own motion; 0 without any.
    max_error, rms_error : float or None
        Largest distance and root mean square of the distances from the mesh's own motion; None without any.
    not_compared : str
        Why a mesh with motion of its own was not compared; else "".

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("grass")) as grass:
    ...     report = athcodec.onto(grass, grass.file.rest).report
    ...     type(report) is athcodec.OntoReport, report.vertex_count, report.max_error is None
    (True, 1400, True)
    """

    vertex_count: int
    far_count: int
    far_limit: float
    furthest: float
    card_count: int
    joint_count: int
    unit: str = ""
    frame_count: int = 0
    max_error: float | None = None
    rms_error: float | None = None
    not_compared: str = ""

    def __str__(self) -> str:
        """Return the report as one sentence."""
        unit = f" {self.unit}" if self.unit else ""
        text = (
            f"{counted(self.vertex_count, 'vertex', 'vertices')} on the plant, {counted(self.card_count, 'piece')} of "
            f"them whole, {self.joint_count:,} at joints; {self.far_count:,} further away than {self.far_limit:.3g}"
            f"{unit}, the furthest {self.furthest:.3g}{unit}"
        )
        if self.max_error is not None:
            text += (
                f"; off the mesh's own motion by up to {self.max_error:.3g}{unit}, RMS {self.rms_error:.3g}{unit}, in "
                f"{counted(self.frame_count, 'frame')}"
            )
        return text + (f"; {self.not_compared}" if self.not_compared else "")


class OntoMesh(ArrayLike):
    """A mesh that moves with an .ath file, a read-only array of shape (frames, vertices, 3); a context manager.

    Indices mean what they mean for a NumPy array and move only the frames that they need. Positions come in the order
    of the mesh's vertices, in the unit and axes of the plant. `onto` makes it.

    Attributes
    ----------
    clip : MotionClip
        The mesh with its new motion, its faces and all its attributes: what `write` and `encode` take. Its frames are
        computed when they are read.

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("grass")) as grass:
    ...     with athcodec.onto(grass.at_level(1), grass.file.rest[:280], faces=grass.file.faces[:120]) as some:
    ...         type(some) is athcodec.OntoMesh, some[::50].shape, some.clip
    (True, (3, 280, 3), MotionClip(150 frames, 280 vertices, 20 branches, float32))
    """

    def __init__(
        self,
        view: ClipView,
        pose: np.ndarray,
        mesh: MotionClip,
        plant: dict[str, str],
        assumed: dict[str, str],
        opened: ExitStack,
    ):
        """Bind a mesh to the plant in the pose `pose` (N, 3). `plant` and `assumed` have the "unit" and "up_axis" of
        the plant and of the mesh, and `opened` closes the mesh's file. Raise ClipError if most of the mesh is far from
        the plant.
        """
        self._view, self._mesh, self._opened = view, mesh, opened
        chains = Chains(view, pose)
        if not chains.diagonal > POINT * view.decoder.file.max_error_bound:
            raise ClipError(
                "onto: the plant is a point in its rest pose, expected the pose of the mesh",
                python="frame=-1 takes a mesh in the pose of the last frame",
                shell="--onto-frame -1 takes a mesh in the pose of the last frame",
            )
        marks, self._limit = Marks(chains), FAR * chains.diagonal
        rest = np.asarray(mesh.rest, np.float64)
        _refuse_far_mesh(view, marks, rest, self._limit, plant, assumed)
        points = MeshPoints(rest, mesh.polygons, mesh.edges)
        self._points, self._binding = points, bind(chains, points, marks)
        offset = rest - points.place[points.of_vertex]
        self._chains = chains
        self._moving = MovingPoints(chains, self._binding, points.place, points.of_vertex, offset)
        self.clip = self._moved_clip()

    def __repr__(self) -> str:
        frames, vertices, _ = self.shape
        return f"<OntoMesh: {counted(frames, 'frame')} of {counted(vertices, 'vertex', 'vertices')}, {self.dtype}>"

    def __enter__(self) -> OntoMesh:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the mesh's file; the plant's stays open."""
        self._opened.close()

    # ---- the array ----

    @property
    def shape(self) -> tuple[int, int, int]:
        """Frames, vertices and 3."""
        return self._view.frame_count, self._mesh.vertex_count, 3

    @property
    def dtype(self) -> np.dtype:
        """Type of the positions, float32 or float64 as in the .ath file."""
        return self._view.dtype

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: Any) -> Any:
        frames, of_frames = split_index(index, self.shape[0])
        shown = np.empty((len(frames), *self.shape[1:]), self.dtype)
        runs = np.split(np.arange(len(frames)), np.flatnonzero(np.diff(frames) != 1) + 1) if len(frames) else ()
        for run in runs:
            shown[run] = self._block(int(frames[run[0]]), int(frames[run[-1]]) + 1)
        return shown[of_frames]

    def __iter__(self) -> Iterator[np.ndarray]:
        for _, block in self.clip.blocks():
            yield from block

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> np.ndarray:
        if copy is False:
            raise ValueError("OntoMesh: got copy=False; expected None or True, because the array is computed")
        return np.asarray(self[:], dtype)

    def _block(self, start: int, stop: int) -> np.ndarray:
        return self._moving.move(self._view.block(start, stop)).astype(self.dtype, copy=False)

    def write_bound(self, path: FilePath) -> JsonObject:
        """Write the mesh as a GLB with a skin whose bones stand in the rest pose, for ATHBones of three.js.

        Bones are the vertices of the plant's stems, or slices of stems that are surfaces. ATHBones moves them by
        positions that are decoded from the .ath file, so that one small file moves any number of meshes.

        Parameters
        ----------
        path : str or path-like
            The GLB to write.

        Returns
        -------
        dict
            "bones", their number; "vertices"; "max_error", the largest distance of a skinned vertex in any frame from
            where this array has it, in the plant's unit; and "not_written", what GLB has no place for, if anything.

        Raises
        ------
        ClipError
            If there are more than 65,536 bones.
        OSError
            If the file cannot be written.
        """
        from athcodec.exporters.gltf import write_bound  # Formats take long to import.

        bones = bones_of(self._chains, self._binding, self._points.of_vertex)
        rest, largest = np.asarray(self.clip.rest, np.float64), 0.0
        for start, block in self.clip.blocks():
            off = bones.skinned(self._view.block(start, start + len(block)), rest) - block
            largest = max(largest, float(np.sqrt((off**2).sum(axis=2).max())))
        facts = {"bones": len(bones.rest), "vertices": len(rest), "max_error": largest}
        return facts | write_bound(self.clip, path, bones, facts | {"max_error_of_plant": self._chains.error})

    # ---- what is known of it ----

    @cached_property
    def report(self) -> OntoReport:
        """How the mesh lies on the plant, as an OntoReport. If the mesh has motion of its own, the first access moves
        all frames to compare them.
        """
        of_vertex = self._points.of_vertex
        distance = self._binding.distance[of_vertex]
        known: JsonObject = {
            "vertex_count": self._mesh.vertex_count,
            "far_count": int((distance > self._limit).sum()),
            "far_limit": self._limit,
            "furthest": float(distance.max()),
            "card_count": self._binding.card_count,
            "joint_count": int(self._binding.is_shared[of_vertex].sum()),
            "unit": str(self._view.metadata.get("unit") or ""),
        }
        return OntoReport(**known, **self._errors())

    def _errors(self) -> JsonObject:
        """Return the errors against the mesh's own motion, by name; empty if it has no motion in the plant's frames."""
        mesh, view = self._mesh, self._view
        if mesh.frame_count == 1 or stands_still(mesh):
            return {}
        is_whole = mesh.frame_count == view.decoder.frame_count and len(view.clip_ranges) == 1
        first = view.first_frame if is_whole else 0
        if not is_whole and (mesh.frame_count != view.frame_count or not _same_times(mesh.time, view.time)):
            frames = f"{mesh.frame_count:,} against {view.frame_count:,}"
            return {"not_compared": f"the mesh's own motion has other frames ({frames}) and was not compared"}
        meter = ErrorMeter()
        for start, block in self.clip.blocks():
            meter.add(mesh.block(first + start, first + start + len(block)), block)
        return {"frame_count": meter.frame_count, "max_error": meter.max_error, "rms_error": meter.rms_error}

    def _moved_clip(self) -> MotionClip:
        """Return the mesh as a clip with the plant's frames and times. Its positions are computed when they are
        read.
        """
        view, mesh = self._view, self._mesh
        of_plant = {name: view.metadata[name] for name in OF_PLANT if name in view.metadata}
        of_mesh = {name: value for name, value in mesh.metadata.items() if name not in (*OF_PLANT, *OF_MESH)}
        branches = {} if mesh.has_branches else self._branches()
        return mesh.replace(
            **branches,
            positions=Frames(self._block, view.frame_count, mesh.vertex_count, self.dtype),
            time=view.time,
            clip_ranges=view.clip_ranges,
            metadata=of_mesh | of_plant,
            rest_given=True,
            unchanged=_Unchanged(mesh, view.inputs),
        )

    def _branches(self) -> dict[str, np.ndarray]:
        """Return the branches of the plant that move any of the mesh, as arrays of a clip of the mesh."""
        branch, along = self._moving.branch_of_points()
        parent = self._view.decoder.file.hierarchy.branch_parent
        is_used = np.bincount(branch, minlength=len(parent)) > 0
        # The nearest branch below that is used; parents come before their children.
        below = np.full(len(parent), -1)
        for each in np.flatnonzero(parent >= 0).tolist():
            below[each] = parent[each] if is_used[parent[each]] else below[parent[each]]
        number = np.append(np.cumsum(is_used) - 1, -1)
        vertex_branch = number[branch[self._points.of_vertex]]
        stem_index = stem_index_of(vertex_branch, along[self._points.of_vertex])
        return {"vertex_branch": vertex_branch, "branch_parent": number[below[is_used]], "stem_index": stem_index}


def _same_times(times: np.ndarray, others: np.ndarray) -> bool:
    """Return whether frames are at the same times, within half a frame."""
    return len(times) == 1 or bool((np.abs(times - others) < 0.5 * np.abs(np.diff(others)).min()).all())


class _Unchanged:
    """Whether the mesh's file is as it was, and the files that the moved mesh is read from."""

    def __init__(self, mesh: MotionClip, inputs: frozenset[FileId]):
        self._mesh, self.files = mesh, mesh.inputs | inputs

    def __call__(self) -> bool:
        return self._mesh.unchanged is None or self._mesh.unchanged()


def onto(
    motion: Decoder | ClipView,
    mesh: Source,
    *,
    frame: int | None = None,
    unit: str | None = None,
    up_axis: str | None = None,
    **options: Any,
) -> OntoMesh:
    """Let a mesh in the rest pose of a plant, or in the pose of a frame, move as the plant does.

    Every vertex of the mesh hangs on the nearest place along a stem, or on two or three where stems join. It keeps its
    offset from there in a frame that turns with the stem. Connected pieces that grow beside a stem, such as leaves,
    move as a whole. A stem that grows by more than a tenth takes its girth and its leaves with it.

    Parameters
    ----------
    motion : Decoder or ClipView
        The plant: an opened .ath file, at the level that it shows.
    mesh : str, path-like, MotionClip or array
        The mesh: a file of any format that `read` knows, of which the rest pose, or else the first frame, is the
        plant's rest pose; files that are numbered like it are not read. An array (vertices, 3) or (frames, vertices, 3)
        can have `faces` beside it.
    frame : int, optional
        The frame of the clip whose pose the mesh is in, negative from the end; by default it is in the rest pose. For a
        plant that grows the last one shows all its parts. A mesh with as many frames as the clip is taken in this one.
    unit : {"m", "cm", "mm", "km", "in", "ft"}, optional
        The unit of the mesh, in place of what it states. The mesh is brought to that of the plant, or to metres where
        the plant states none.
    up_axis : {"x", "y", "z"}, optional
        The up axis of the mesh, in place of what it states; likewise.
    **options
        What an array does not say, as for `encode`: faces; for a path, options of `read`.

    Returns
    -------
    OntoMesh
        Positions (frames, V, 3) in the plant's unit and axes, with a `report`, and as a `clip` for `write`. Close it,
        or use it in a ``with`` statement; the motion stays open.

    Raises
    ------
    ClipError
        If most vertices are further from the plant than a tenth of its diagonal, or the mesh is no usable clip.
    NeedsHostMesh
        If the file has no rest pose, and no `host_mesh` was passed to `open`.
    MissingExtra
        If scipy is missing, or what reads the mesh.
    OSError
        If the mesh cannot be read.
    IndexError
        If the clip has no such frame.

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("grass"), clip="gale") as grass:
    ...     blades = athcodec.onto(grass, grass.file.rest[::2])
    ...     blades.shape, blades.report.far_count
    ((150, 700, 3), 0)
    """
    view = ClipView(motion) if isinstance(motion, Decoder) else motion
    if not isinstance(view, ClipView):
        raise TypeError(f"onto: got {type(view).__name__}, expected a decoder of the plant, as athcodec.open returns")
    if frame is None:
        _warn_of_rest(view)
    stated = {"unit": unit and checked_unit(unit), "up_axis": up_axis and checked_axis(up_axis)}
    opened = ExitStack()
    try:
        clip = _opened_mesh(mesh, opened, options)
        pose = view.rest
        if frame is not None:
            pose = view.decoder.at_level(None).positions(frame, dtype=np.float64)
            if clip.frame_count == view.decoder.frame_count > 1:
                number = frame % clip.frame_count
                clip = clip.replace(rest=clip.block(number, number + 1)[0])
        return OntoMesh(view, pose, *_in_scene_of(view, clip, stated), opened)
    except BaseException:
        opened.close()
        raise


def _opened_mesh(mesh: Source, opened: ExitStack, options: Keywords) -> MotionClip:
    """Return a mesh as a clip. A file that is opened for it is closed with `opened`."""
    if isinstance(mesh, (str, os.PathLike)):
        from athcodec.sources import read  # The sources take long to import.

        # Levels of detail are numbered as frames are.
        return opened.enter_context(read(mesh, alone=True, **options))
    if not isinstance(mesh, (MotionClip, Decoder, ClipView)) and "axes" not in options:
        # A mesh may be a single pose; elsewhere an array without frames is taken for a mistake.
        mesh = np.asarray(mesh)[None] if len(getattr(mesh, "shape", None) or np.shape(mesh)) == 2 else mesh
    return opened.enter_context(clip_of(mesh, **options))[0]


def _warn_of_rest(view: ClipView) -> None:
    """Warn if the plant's rest pose, which the mesh lies on, is stored less exactly than its motion."""
    file = view.decoder.file
    if file.static.rest_error <= COARSE_REST * file.max_error_bound:
        return
    unit = f" {view.metadata['unit']}" if view.metadata.get("unit") else ""
    warnings.warn(
        f"{file.name}: the rest pose is off by up to {file.static.rest_error:.3g}{unit}, and the mesh lies on it no "
        "better; encode the plant with --exact-rest (exact_rest=True)",
        CoarseWarning,
        stacklevel=3,
    )


def _in_scene_of(
    view: ClipView, mesh: MotionClip, stated: dict[str, str | None]
) -> tuple[MotionClip, dict[str, str], dict[str, str]]:
    """Return the mesh in the unit and axes of the plant, then the "unit" and "up_axis" of the plant, and then those
    that the mesh was taken to have.

    What the caller states takes precedence over what the mesh states. If the plant states none and the caller does, the
    plant is taken to be in metres and y up; if nobody states any, the mesh is taken to be as the plant is.
    """
    plant, assumed = dict(DEFAULT_SCENE), dict(DEFAULT_SCENE)
    metadata = dict(mesh.metadata)
    for name, option in stated.items():
        known: dict[str, str] = {}
        with suppress(ClipError):  # A plant may have a unit that nothing can be brought to.
            known = stated_scene({name: view.metadata.get(name)})
        plant |= known
        assumed[name] = plant[name]
        if option:
            metadata = {key: value for key, value in metadata.items() if key != METRES_PER_UNIT or name != "unit"}
            metadata[name] = option
        if known or option:
            mesh = mesh.replace(metadata=metadata)
            assumed |= stated_scene({name: metadata.get(name)})
            mesh = in_scene(mesh, **{"unit": None, "up_axis": None} | {name: plant[name]})
            metadata = dict(mesh.metadata)
    return mesh, plant, assumed


def _refuse_far_mesh(
    view: ClipView, marks: Marks, rest: np.ndarray, limit: float, plant: dict[str, str], assumed: dict[str, str]
) -> None:
    """Raise ClipError if most vertices are further than `limit` from the plant. The message names the pose, unit or
    axis that would fit.
    """
    fit = Fit(marks, rest, limit)
    if fit.mesh_far <= MOST_FAR and fit.plant_far <= COVERS:
        return
    fitting: Keywords = fit.better_scene(plant, assumed)
    text = f"onto: {fit.mesh_far:.0%} of the mesh is further from the plant than {limit:.3g}, a tenth of its diagonal"
    if fit.mesh_far > MOST_FAR and _is_in_last_frame(view, rest):
        fitting = {"frame": -1}
    elif fit.mesh_far <= MOST_FAR:
        # A mesh of a part of the plant covers little of it as well, but no other unit makes it cover more.
        if not fitting:
            return
        text = (
            f"onto: {fit.plant_far:.0%} of the plant is further from the mesh than {limit:.3g}, a tenth of its diagonal"
        )
    if not fitting:
        text += ", and no other unit or up axis brings it there"
        raise ClipError(f"{text}; expected a mesh of this plant in its rest pose")
    raise ClipError(
        text,
        python=f"it fits with {', '.join(f'{name}={value!r}' for name, value in fitting.items())}",
        shell="it fits with " + " ".join(f"--onto-{name.replace('_', '-')} {value}" for name, value in fitting.items()),
    )


def _is_in_last_frame(view: ClipView, rest: np.ndarray) -> bool:
    """Return whether a mesh at rest (V, 3) lies on the plant as the clip's last frame shows it, and not as it is at
    rest."""
    last = view.decoder.at_level(None).positions(-1, dtype=np.float64)
    distance = scipy_module("spatial").cKDTree(last).query(rest)[0]
    return bool((distance > FAR * np.linalg.norm(np.ptp(last, axis=0))).mean() < FITS)
