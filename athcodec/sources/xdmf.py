"""Reads XDMF: meshes and their data in time, of one temporal collection or several, in HDF5, raw binary or text.

Grids become tracks: a mesh and what the file says of it, step by step. The mesh of a step is its own, or that of the
first step. Collections of one mesh at the same times, as DOLFINx writes one for each function, are one track; spatial
collections, trees, and collections of different meshes at the same times are several parts of one clip. Of tracks at
different times the one that moves is read, and the others are named, as are sets, information of other programs, and
meshes that no step refers to. See fields.py for what becomes the motion, parts.py for several meshes, cells.py for the
cells, xdmf_document.py for includes and references and xdmf_items.py for numbers. Grids without points of their own
(rectilinear ones) are refused, as are subsets and polyhedra. Data are read when a frame is asked for.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from os import fspath
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget, closing_on_failure, naming
from athcodec.motion.clip import MotionClip, frame_rate
from athcodec.sources import ReadOptions
from athcodec.sources.cells import NODE_BYTES, NODES, Block
from athcodec.sources.fields import DISPLACEMENTS, clip_of_steps
from athcodec.sources.mesh import same_values
from athcodec.sources.parts import CELL, NODE, JoinedSteps
from athcodec.sources.scene_objects import MATERIAL_NAMES
from athcodec.sources.timing import times_in_seconds, whole
from athcodec.sources.xdmf_cells import (
    PLAIN,
    RECTILINEAR,
    STRUCTURED,
    TOPOLOGIES,
    WITHOUT_POINTS,
    mixed_blocks,
    same_block,
    structured_blocks,
    whole_numbers,
)
from athcodec.sources.xdmf_document import Element
from athcodec.sources.xdmf_items import Items
from athcodec.sources.xpointer import local_name
from athcodec.untyped import JsonObject

KNOWN = ("Grid", "Topology", "Geometry", "Attribute", "Time", "DataItem")  # Elements of a grid that are read.
COLLECTIONS, UNIFORM = ("collection", "tree"), "uniform"
MOST_NESTED = 16  # Grids inside grids.
MOST_VISITS, VISITS_PER_ELEMENT = 1000, 16  # Grids that are looked at, more than once if they are included.
FUNCTION_SPACE = "degrees of freedom of write_checkpoint; XDMFFile.write writes values per point"
LISTED = 12  # Names in a message.
TIME_NAMES = ("time", "timevalue", "time_value", "t")
_XML_ERRORS = (ElementTree.ParseError, ValueError, KeyError, OverflowError, IndexError, TypeError, MemoryError)


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the XDMF file `path`. Raises ClipError where it or what it names is no usable series, OSError
    where the file cannot be opened."""
    budget = Budget(options.max_memory)
    with naming(path, *_XML_ERRORS):
        items = Items(Path(path), options.allow_outside, budget)
        with closing_on_failure(items):
            return _clip(items, path, options)


def _clip(items: Items, path: FilePath, options: ReadOptions) -> MotionClip:
    """Return the clip of the grids that an XDMF document shows or `options` choose. Raises ClipError."""
    scene = _Scene(items, fspath(path), options)
    selection = _Selection(scene)
    tracks = selection.chosen()
    parts = [_Part(items, track, selection.mesh_for(track)) for track in tracks]
    time, metadata = scene.times(tracks[0])
    steps = JoinedSteps(parts, items.budget, fspath(path))
    metadata = metadata if len(parts) == 1 else {"objects": steps.objects()} | metadata
    steps.left_out += selection.other_fields
    name, static = Path(path).stem, steps.static()
    clip = clip_of_steps(steps, time, metadata, name, options, static, resource=items, unchanged=items.unchanged)
    clip.not_read = {**clip.not_read, **{kind: names for kind, names in scene.not_read.items() if names}}
    return clip


@dataclass
class Track:
    """A mesh in time: for each step the grids that say something of it, and its time if that is stated.

    is_series: whether it comes from a temporal collection, even if of a single step. families: numbers of the grids
    that it is in; what is in one grid belongs together.
    """

    name: str
    steps: list[list[Element]]
    times: np.ndarray | None = None
    is_series: bool = False
    families: frozenset[int] = frozenset()


class _Scene:
    """Reads the grids of a file as tracks, with their times and what the file says of all of them."""

    def __init__(self, items: Items, shown_path: str, options: ReadOptions):
        """Read the grids of an XDMF file. `shown_path` is the file's name in warnings. Raises ClipError."""
        self.items, self.documents, self._path, self.options = items, items.documents, shown_path, options
        self._grid_count, self._warned = 0, set[str]()
        self.not_read: dict[str, list[str]] = {"series": [], "mesh": [], "element": []}
        root = self.documents.root
        self._domains = self.documents.children(root, "Domain")
        self._facts = self._information()
        grids = [grid for domain in self._domains for grid in self.documents.children(domain, "Grid")]
        if not grids:
            raise ClipError("got no Grid, expected some in a Domain")
        self.tracks = [
            replace(track, families=frozenset([number]))
            for number, grid in enumerate(grids)
            for track in self._tracks_of(grid, 0)
        ]

    # ---- from grids to tracks ----

    def _tracks_of(self, grid: Element, depth: int) -> list[Track]:
        """Return the meshes in a Grid element, over time. `depth` counts the Grids around it. Raises ClipError."""
        self._grid_count += 1
        most = MOST_VISITS + VISITS_PER_ELEMENT * self.documents.size
        if depth > MOST_NESTED or self._grid_count > most:
            raise ClipError(f"Grid: got more than {MOST_NESTED} inside each other or {most} in all, expected fewer")
        kind, name = grid.get("GridType", UNIFORM).lower(), grid.get("Name", "")
        self._name_unknown(grid, KNOWN)
        if kind == UNIFORM:
            time = self._time_of(grid)
            inside = self.documents.children(grid, "Grid")  # Some steps include the grid of their mesh as it is.
            return [Track(name, [[grid, *inside]], None if time is None else np.array([time]))]
        if kind not in COLLECTIONS:
            raise ClipError(f"Grid {name[:40]!r}: got the type {kind[:40]!r}, expected Uniform, Collection or Tree")
        grids = self.documents.children(grid, "Grid")
        if kind == "collection" and grid.get("CollectionType", "Spatial").lower() == "temporal":
            return self._series(grid, name, grids, depth)
        tracks = [track for each in grids for track in self._tracks_of(each, depth + 1)]
        time = self._time_of(grid)
        return [replace(track, times=np.array([time])) if self._is_timeless(track, time) else track for track in tracks]

    @staticmethod
    def _is_timeless(track: Track, time: float | None) -> bool:
        """Return whether a track is a single grid without a time, in a scene that has times."""
        return time is not None and track.times is None and len(track.steps) == 1

    def _series(self, collection: Element, name: str, grids: Sequence[Element], depth: int) -> list[Track]:
        """Return the meshes of a temporal collection over time; each of its `grids` is one step of every mesh."""
        steps = [self._tracks_of(grid, depth + 1) for grid in grids]
        if not steps:
            return []
        if any(track.is_series for step in steps for track in step):
            raise ClipError(f"Grid {name[:40]!r}: got a temporal collection inside of another, expected one")
        first = [track.name for track in steps[0]]
        for number, step in enumerate(steps):
            if len(step) != len(first):
                raise ClipError(f"step {number}: got {len(step)} grids, expected {len(first)} as in the first step")
        by_name = len(set(first)) == len(first) > 1 and all(
            {track.name for track in step} == set(first) for step in steps
        )
        tracks = []
        for place, name_of_part in enumerate(first):
            row = [next(t for t in step if t.name == name_of_part) if by_name else step[place] for step in steps]
            times = self._series_times(collection, [track.times for track in row], grids)
            joined = Track(
                name_of_part if len(first) > 1 else name or name_of_part, [t.steps[0] for t in row], times, True
            )
            tracks.append(_in_order(joined))
        return tracks

    # ---- times ----

    def _time_of(self, grid: Element) -> float | None:
        """Return the time that a grid states for itself alone."""
        element = self.documents.child(grid, "Time")
        numbers = self._time_elsewhere(grid) if element is None else self._numbers(element)
        if len(numbers) > 1 and grid.get("GridType", UNIFORM).lower() != "collection":
            raise ClipError(f"Time: got {len(numbers)} for the grid {grid.get('Name', '')[:40]!r}, expected one")
        return float(numbers[0]) if len(numbers) == 1 else None

    def _time_elsewhere(self, grid: Element) -> np.ndarray:
        """Return the time (1,) that a grid states as Information or Attribute, or an empty array if it states none."""
        for element in self.documents.children(grid, "Information", "Attribute"):
            is_whole = local_name(element) == "Information" or element.get("Center", "").lower() == "grid"
            if is_whole and element.get("Name", "").lower() in TIME_NAMES:
                with suppress(ClipError, ValueError):  # Words, or what is no single number, are no time.
                    numbers = self._numbers(element)
                    if len(numbers) == 1:
                        self._say_once(
                            f"Time: {local_name(element)} {element.get('Name')} was taken for that of the steps"
                        )
                        return numbers
        return np.zeros(0)

    def _numbers(self, element: Element) -> np.ndarray:
        text = element.get("Value", "").split()
        item = self.documents.child(element, "DataItem")
        if text:
            return np.array(text, np.float64)
        return np.zeros(0) if item is None else self.items.read(item).reshape(-1).astype(np.float64)

    def _series_times(
        self, collection: Element, stated: Sequence[np.ndarray | None], grids: Sequence[Element]
    ) -> np.ndarray | None:
        """Return the times of a collection's steps, stated by the steps or by the collection, or None."""
        count = len(stated)
        missing = [number for number, time in enumerate(stated) if time is None]
        if not missing:
            return np.array([float(time[0]) for time in stated if time is not None])
        common = self.documents.child(collection, "Time")
        if common is None:
            if len(missing) < count and self.options.fps is None:
                raise ClipError(
                    f"Time: got none in step {missing[0]} ({grids[missing[0]].get('Name', '')[:40]!r}) and one in "
                    "others, expected it in all; --fps (fps=) numbers them in place of all times"
                )
            return None
        kind, numbers = common.get("TimeType", "Single").lower(), self._numbers(common)
        if kind == "function":
            raise ClipError("Time: got the type Function, expected Single, List, Range or HyperSlab")
        if kind == "hyperslab" and len(numbers) == 3:
            if numbers[2] != count:
                raise ClipError(f"Time: got {numbers[2]:g} times, expected {count}, one per grid")
            return numbers[0] + numbers[1] * np.arange(count)
        if kind == "range" and len(numbers) == 2 and count > 1:
            return np.linspace(numbers[0], numbers[1], count)
        if len(numbers) != count:
            raise ClipError(f"Time: got {len(numbers)} times, expected {count}, one per grid")
        return numbers

    def times(self, track: Track) -> tuple[np.ndarray, JsonObject]:
        """Return a track's times (T,) in seconds from 0, and metadata that the file states, such as "fps" and
        "unit"."""
        information, stored, count = self._facts, track.times, len(track.steps)
        fps = information.get("fps") if self.options.fps is None else self.options.fps
        if stored is None or not track.is_series:
            stored = np.arange(count) / frame_rate({} if fps is None else {"fps": fps})
            if count > 1 and fps is None:
                self.warn(
                    f"Time: the steps have none, and come {frame_rate({}):g} a second; --fps (fps=) states a rate"
                )
        with np.errstate(all="ignore"):  # Times that are no numbers of seconds are refused by the clip.
            time, metadata = times_in_seconds(stored, fps)
            if "start_frame" in information:
                start = float(information["start_frame"]) + stored[0] * frame_rate(metadata)
                metadata["start_frame"] = whole(round(start, 6))
        return time, information | metadata

    def _information(self) -> JsonObject:
        """Return what Information elements state by these names: fps, start_frame, unit and up_axis, and the names of
        objects and materials, which athcodec's own writer stores as JSON."""
        information: JsonObject = {}
        self._name_unknown(self.documents.root, ("Domain", "Information"))
        for domain in (self.documents.root, *self._domains):
            if domain is not self.documents.root:
                self._name_unknown(domain, ("Grid", "Information", "DataItem", *KNOWN))
            for element in self.documents.children(domain, "Information"):
                name, value = element.get("Name", ""), element.get("Value", "")
                if name in ("unit", "up_axis"):
                    information[name] = value
                elif name in ("fps", "start_frame"):
                    information[name] = whole(float(value)) if name == "start_frame" else float(value)
                elif name in ("objects", MATERIAL_NAMES):
                    with suppress(ValueError, RecursionError):  # Another program may have written something else here.
                        information[name] = json.loads(value)
                else:
                    self.add_not_read("element", f"Information {name}")
        frame_rate(information)
        return information

    def _name_unknown(self, parent: Element, known: Sequence[str]) -> None:
        """Name the children of an element that are not looked at."""
        for child in self.documents.children(parent):
            if local_name(child) not in known and child.get("Name", "").lower() not in TIME_NAMES:
                self.add_not_read("element", f"{local_name(child)} {child.get('Name', '')}".strip())

    def add_not_read(self, kind: str, name: str) -> None:
        if name not in self.not_read[kind]:
            self.not_read[kind].append(name)

    def _say_once(self, text: str) -> None:
        if text not in self._warned:
            self._warned.add(text)
            self.warn(text)

    def warn(self, text: str) -> None:
        warnings.warn(f"{self._path}: {text}", GuessWarning, stacklevel=2)


class _Selection:
    """Chooses the tracks of a file that are the clip, and names the others."""

    def __init__(self, scene: _Scene):
        self._scene = scene
        self.other_fields: list[str] = []

    def chosen(self) -> list[Track]:
        """Return the tracks (meshes over time) that make up the clip, and name the others as not read. Raises ClipError
        if it is unclear which they are."""
        tracks = self._scene.tracks
        if self._scene.options.only:
            tracks = [t for t in tracks if any(fnmatchcase(t.name, pattern) for pattern in self._scene.options.only)]
            if not tracks:
                names = ", ".join(dict.fromkeys(repr(track.name) for track in self._scene.tracks))
                raise ClipError(f"only: got no grid of these names, expected some of {names}")
        series = [track for track in tracks if track.is_series]
        if not series:
            return self._still(tracks)
        groups = self._groups(series)
        chosen = groups if len(groups) == 1 else self._moving(groups)
        self._name_others(chosen, [track for track in groups if track not in chosen])
        return chosen

    def _still(self, tracks: Sequence[Track]) -> list[Track]:
        """Return the meshes of a file without time series, which form one frame. Raises ClipError if times differ."""
        with_points = [track for track in tracks if self._element(track, "Geometry") is not None]
        if not with_points:
            raise ClipError("got no grid with a Geometry, expected points")
        times = {float(track.times[0]) for track in with_points if track.times is not None}
        if len(times) > 1:
            raise ClipError(
                f"got {len(with_points)} grids at different times and no temporal collection, expected a time series "
                "or one grid"
            )
        self._name_others(with_points, [track for track in tracks if track not in with_points])
        return with_points

    def _groups(self, series: Sequence[Track]) -> list[Track]:
        """Return the series, with series of one mesh at the same times merged into one that has the data of all."""
        groups: list[Track] = []
        for track in series:
            group = next((each for each in groups if self._belong_together(each, track)), None)
            if group is None:
                groups.append(replace(track, steps=[list(step) for step in track.steps]))
            else:
                for step, more in zip(group.steps, track.steps):
                    step += more
                group.families |= track.families
        return groups

    def _belong_together(self, one: Track, other: Track) -> bool:
        """Return whether two series show the same mesh at the same times and come from different top-level grids."""
        if one.families & other.families or len(one.steps) != len(other.steps):
            return False
        if one.times is None or other.times is None:
            is_at_same_times = one.times is other.times
        else:
            is_at_same_times = np.array_equal(one.times, other.times)
        if not is_at_same_times:
            return False
        return self._same_mesh(one, other)

    def _same_mesh(self, one: Track, other: Track) -> bool:
        """Return whether two tracks have the same points and cells in their first step, shared or stored twice."""
        geometry = self._element(one, "Geometry"), self._element(other, "Geometry")
        topology = self._element(one, "Topology"), self._element(other, "Topology")
        if None in geometry:
            return False
        if all(self._scene.documents.source(a) == self._scene.documents.source(b) for a, b in (geometry, topology)):
            return True
        with suppress(ClipError):  # Of a mesh that cannot be read nothing is known; it may be one that nobody wants.
            parts = [_Part(self._scene.items, track, None) for track in (one, other)]
            points = [part.points(0) for part in parts]
            blocks = [part.blocks for part in parts]
            return (
                np.array_equal(points[0], points[1])
                and len(blocks[0]) == len(blocks[1])
                and all(map(same_block, *blocks))
            )
        return False

    def _moving(self, groups: Sequence[Track]) -> list[Track]:
        """Return the series to read of several: those that have the wanted field or that move, and those beside them in
        the same grid. Raises ClipError if their times differ."""
        wanted = self._scene.options.field
        if wanted is not None:
            moving = [track for track in groups if wanted in self._fields(track)]
            if not moving:
                raise ClipError(f"field: got {wanted!r}, expected one of {self._listed(groups)}")
        else:
            moving = [track for track in groups if self._moves(track)] or list(groups)
        families = frozenset[int]().union(*(track.families for track in moving))
        tracks = [track for track in groups if track.families & families]
        times = {None if track.times is None else track.times.tobytes() for track in tracks}
        if len(times) > 1:
            raise ClipError(
                f"got {len(tracks)} series at different times, {self._listed(tracks)}; expected one: --only (only=) "
                "names it"
            )
        return tracks

    def _moves(self, track: Track) -> bool:
        names = [name.lower() for name in self._fields(track)]
        part = _Part(self._scene.items, track, None, with_mesh=False)
        return any(name in DISPLACEMENTS for name in names) or not part.fixed_points()

    def _fields(self, track: Track) -> list[str]:
        return _Part(self._scene.items, track, None, with_mesh=False).names(NODE)

    def _listed(self, groups: Sequence[Track]) -> str:
        return "; ".join(
            f"{track.name!r} with {', '.join(self._fields(track)[:LISTED]) or 'no fields per point'}"
            for track in groups[:LISTED]
        )

    def _name_others(self, chosen: Sequence[Track], others: Sequence[Track]) -> None:
        """Note what is not read: other series, meshes without steps, and fields of series that share a chosen mesh."""
        points = {self._scene.documents.source(self._element(track, "Geometry")) for track in chosen}
        for track in others:
            if any(self._same_mesh(track, each) for each in chosen):
                self.other_fields += [f"{track.name}/{name}" for name in self._fields(track)]
            elif track.is_series:
                self._scene.add_not_read("series", track.name or "unnamed")
        for track in self._scene.tracks:
            if track.is_series or track in chosen or track in others:
                continue
            geometry = self._element(track, "Geometry")
            part = _Part(self._scene.items, track, None, with_mesh=False)
            if geometry is not None and self._scene.documents.source(geometry) not in points:
                self._scene.add_not_read("mesh", track.name or "unnamed")
            else:  # Tags of the mesh that is read, as DOLFINx writes them.
                self.other_fields += [f"{track.name}/{name}" for center in (NODE, CELL) for name in part.names(center)]

    def mesh_for(self, track: Track) -> Element | None:
        """Return the file's only grid with a mesh, for a track without one; None if the track has a mesh of its own."""
        if self._element(track, "Geometry") is not None:
            return None
        meshes = [
            each for each in self._scene.tracks if not each.is_series and self._element(each, "Geometry") is not None
        ]
        if len(meshes) != 1:
            names = ", ".join(repr(mesh.name) for mesh in meshes[:LISTED]) or "none"
            raise ClipError(
                f"Grid {track.name[:40]!r}: got no grid with a Geometry in its steps; expected one, by xi:include or "
                f"in place, of the meshes in the file: {names}"
            )
        self._scene.warn(f"the steps of {track.name!r} have no mesh, and that of {meshes[0].name!r} was taken for it")
        self._scene.not_read["mesh"] = [
            name for name in self._scene.not_read["mesh"] if name != (meshes[0].name or "unnamed")
        ]
        return meshes[0].steps[0][0]

    def _element(self, track: Track, tag: str) -> Element | None:
        elements = (self._scene.documents.child(grid, tag) for grid in track.steps[0])
        return next((element for element in elements if element is not None), None)


def _in_order(track: Track) -> Track:
    """Return the track with its steps in the order of time, in which not all programs write them."""
    if track.times is None or not np.isfinite(track.times).all() or (np.diff(track.times) > 0).all():
        return track
    order = np.argsort(track.times, kind="stable")
    return replace(track, steps=[track.steps[number] for number in order], times=track.times[order])


class _Part:
    """See parts.Part: a track."""

    def __init__(self, items: Items, track: Track, mesh: Element | None, with_mesh: bool = True):
        """Prepare the mesh of a track. `mesh` is the Grid that has its points and cells if its steps have none."""
        self.name, self._items, self._documents = track.name, items, items.documents
        self._steps, self._mesh = track.steps, mesh
        self._attributes = [self._attributes_of(step) for step in self._steps]
        self.elsewhere = {
            name: center for step in self._attributes for name, center in step if center not in (NODE, CELL)
        }
        self.blocks = self._blocks(self._element(0, "Topology"), self._element(0, "Geometry")) if with_mesh else []
        self.cell_count = sum(len(block.rows) for block in self.blocks)

    def points(self, step: int) -> np.ndarray:
        """Return the points (N, 2) or (N, 3) at a step. Raises ClipError if there are none."""
        geometry = self._element(step, "Geometry")
        if geometry is None:
            raise ClipError("got no grid with a Geometry, expected points")
        kind = (geometry.get("GeometryType") or geometry.get("Type") or "XYZ").upper()
        items = self._documents.children(geometry, "DataItem")
        if kind in ("X_Y_Z", "X_Y") and len(items) == len(kind.split("_")):
            return np.stack([self._items.read(item).reshape(-1) for item in items], axis=1)
        if kind not in ("XYZ", "XY") or len(items) != 1:
            raise ClipError(
                f"Geometry: got the type {kind[:40]!r} with {len(items)} DataItems, expected XYZ, XY, X_Y_Z or X_Y; "
                f"{WITHOUT_POINTS}"
            )
        return self._items.read(items[0]).reshape(-1, len(kind))

    def fixed_points(self) -> bool:
        first = self._element(0, "Geometry")
        others = [step for step in range(1, len(self._steps)) if not self._same(self._element(step, "Geometry"), first)]
        if not others:
            return True
        points = self.points(0)
        return all(np.array_equal(points, self.points(step)) for step in others)

    def check(self, step: int) -> None:
        element, first = self._element(step, "Topology"), self._element(0, "Topology")
        if self._same(element, first):
            return
        blocks = self._blocks(element, self._element(step, "Geometry"))
        if len(blocks) != len(self.blocks) or not all(map(same_block, blocks, self.blocks)):
            raise ClipError(f"frame {step}: got other cells than in the first; topology that changes cannot be coded")

    def names(self, center: str) -> list[str]:
        return list(dict.fromkeys(name for step in self._attributes for name, place in step if place == center))

    def values(self, step: int, name: str, center: str) -> np.ndarray:
        element = self._attributes[step].get((name, center))
        if element is None:
            raise ClipError(f"frame {step}: got no field {name!r} per {center}, expected one as in other steps")
        values = self._items.first(element)
        return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values

    def is_static(self, name: str, center: str) -> bool:
        """Return whether a field has the same values in all steps. The last step is compared first, because a field
        that changes has changed most there."""
        elements = [step.get((name, center)) for step in self._attributes]
        if any(element is None for element in elements):
            return False
        items = [self._documents.child(element, "DataItem") for element in elements if element is not None]
        others = [item for item in reversed(items[1:]) if not self._same(item, items[0])]
        if not others:
            return True
        values = self._items.read(items[0])
        return all(same_values(values, self._items.read(item)) for item in others)

    def _element(self, step: int, tag: str) -> Element | None:
        """Return the Topology or Geometry of a step: its own, that of the first step, or of the mesh that was taken."""
        for grids in (self._steps[step], self._steps[0], [] if self._mesh is None else [self._mesh]):
            for grid in grids:
                element = self._documents.child(grid, tag)
                if element is not None:
                    return element
        return None

    def _same(self, one: Element | None, other: Element | None) -> bool:
        """Return whether two elements of the document are equal, or lead to the same one."""
        return one is other or self._documents.source(one) == self._documents.source(other)

    def _attributes_of(self, grids: Sequence[Element]) -> dict[tuple[str, str], Element]:
        """Return the Attribute elements of a step by (name, center). If several of `grids` have the same name and
        center, further ones get the grid's name in front."""
        elements: dict[tuple[str, str], Element] = {}
        for number, grid in enumerate(grids):
            for element in self._documents.children(grid, "Attribute"):
                name, center = element.get("Name") or "unnamed", element.get("Center", "Node").lower()
                if element.get("ItemType", "").lower() == "finiteelementfunction":
                    center = FUNCTION_SPACE
                key = (
                    (name, center)
                    if (name, center) not in elements
                    else (f"{grid.get('Name') or number}/{name}", center)
                )
                elements[key] = element
        return elements

    # ---- cells ----

    def _blocks(self, element: Element | None, geometry: Element | None) -> list[Block]:
        """Return the cells that a Topology element states, one Block for each type of cell. Raises ClipError."""
        if element is None:
            return []
        kind = (element.get("TopologyType") or element.get("Type") or "").lower()
        if kind == "polyvertex":
            return []
        if kind in STRUCTURED:
            return structured_blocks(STRUCTURED[kind], element, self._items.budget)
        if kind in RECTILINEAR:
            raise ClipError(f"Topology: got the type {kind!r}, expected cells between points; {WITHOUT_POINTS}")
        nodes = self._items.first(element)
        if nodes.dtype.kind not in "iu":
            nodes = whole_numbers(nodes)
        self._items.budget.need(NODE_BYTES * nodes.size, "Topology")
        first = int(element.get("BaseOffset", 0))
        nodes = nodes.astype(np.int64)
        if kind == "mixed":
            return [replace(block, nodes=block.nodes - first) for block in mixed_blocks(nodes.reshape(-1))]
        nodes = nodes - first
        if kind in PLAIN:
            size = int(element.get("NodesPerElement") or nodes.shape[-1])
            rows = np.arange(nodes.size // max(size, 1))
            if size < 1 or nodes.size % size:
                raise ClipError(f"Topology: got {nodes.size} nodes, expected {size} per cell")
            if size == 2:
                return [Block("line", nodes.reshape(-1, 2), rows)]
            return [Block(PLAIN[kind], nodes.reshape(-1), rows, np.full(len(rows), size))]
        if kind not in TOPOLOGIES or nodes.size % NODES[TOPOLOGIES[kind]]:
            raise ClipError(f"Topology: got {nodes.size} nodes of the type {kind[:40]!r}, expected a known one")
        cells = nodes.reshape(-1, NODES[TOPOLOGIES[kind]])
        order = element.get("Order", "").split()
        if order:
            if sorted(order, key=int) != [str(number) for number in range(cells.shape[1])]:
                raise ClipError(f"Topology: got the order {' '.join(order)[:40]!r}, expected 0 to {cells.shape[1] - 1}")
            cells = cells[:, [order.index(str(number)) for number in range(cells.shape[1])]]
        return [Block(TOPOLOGIES[kind], cells, np.arange(len(cells)))]
