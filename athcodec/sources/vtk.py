"""Reads VTK results: files of VTK's XML formats or legacy ones, one for each time step.

Which files are the steps, and their times, say an index (.pvd, .series), fields such as TimeValue, or their names: see
file_series.py. vtk_xml.py and vtk_legacy.py say what is read of a file, fields.py what becomes the motion and cells.py
what becomes of the cells. The files that one of .pvtu, .pvtp, .vtm, .vtpd or .vtpc lists, and the parts of a .pvd, are
joined. A file is read whole, one step at a time; all are read once to see which data change in time.
"""

from __future__ import annotations

import binascii
import lzma
import os
import zlib
from os import fspath
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget, FileWatch, file_beside, naming, read_plain
from athcodec.motion.clip import MotionClip, stated_fps
from athcodec.sources import ReadOptions
from athcodec.sources.fields import clip_of_steps
from athcodec.sources.file_series import Kind, Series, StatedTime, series_of, time_in_text
from athcodec.sources.mesh import same_values
from athcodec.sources.scene_objects import OWN
from athcodec.sources.vtk_grid import STEP_NAMES, Grid, joined
from athcodec.sources.vtk_legacy import is_legacy, read_legacy
from athcodec.sources.vtk_xml import VtkXml

STEPS_HELD = 3  # Data sets that are held at once: the first, the latest, and one that is read.
MOST_FILES, LEVELS = 1 << 16, 8  # How many files a frame may be in, and how deep files may list files.
_BROKEN = (
    ValueError,
    KeyError,
    TypeError,
    IndexError,
    OverflowError,
    MemoryError,
    zlib.error,
    lzma.LZMAError,
    binascii.Error,
    ElementTree.ParseError,
)


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip whose frames are the VTK files that `path` stands for: any one of a numbered series, a pattern or
    an index. Raises ClipError if a file is broken or, as soon as its frame is read, has other cells than the first;
    OSError if one cannot be opened."""
    try:
        series = series_of(path, options)
        steps = _Steps(series, options)
        ordered = series.in_time(steps.stated)
        if ordered is not series:
            series, steps = ordered, _Steps(ordered, options)
        if Path(path).is_file():  # an index, or one of the files
            steps.unchanged.add(path)
        if series.index is not None:
            steps.unchanged.add(series.index)
        time, metadata = series.clock(steps.stated, options, stated_fps(steps.metadata))
        if not series.hears(steps.stated):
            steps.left_out += steps.times_unheard
        return clip_of_steps(
            steps,
            time,
            steps.metadata | metadata,
            series.name,
            options,
            steps.static(),
            unchanged=steps.unchanged,
            parts=steps.parts,
            not_read=series.not_read | steps.not_read,
            is_own=steps.is_own,
        )
    except _BROKEN as error:
        text = " ".join(str(error).split())
        raise ClipError(text if text.startswith(fspath(path)) else f"{fspath(path)}: {text}") from None


class _Steps:
    """See fields.Steps."""

    def __init__(self, series: Series, options: ReadOptions):
        """Read every file of the series once to learn which arrays stay the same and which times the files state.
        Raises ClipError, OSError."""
        self._series, self._options = series, options
        self._max_memory = options.max_memory // STEPS_HELD
        self.unchanged = FileWatch(*(file for frame in series.frames for file in frame))
        self._now: tuple[int, Grid] | None = None
        first = self._grid(0)
        self._cells, self.metadata, self.parts = first.cells, dict(first.metadata), first.parts
        self.is_own = self.metadata.pop(OWN, False)  # Whether athcodec's exporter wrote the files.
        self.stated = [_time_of(first)]
        self.topology = first.topology()
        self._fields, self.elsewhere = list(first.point_data), dict.fromkeys(first.cell_data, "cell")
        self._static, still, self._fixed = dict(first.point_data), dict(first.cell_data), True
        names = dict.fromkeys(self._fields), dict.fromkeys(still)
        left_out, other, hidden = dict.fromkeys(first.left_out), dict.fromkeys(first.other), first.hidden_count
        fields = dict.fromkeys(first.field_data)
        for step in range(1, len(series.frames)):
            grid = self._grid(step)
            self.stated.append(_time_of(grid))
            self._fixed = self._fixed and np.array_equal(grid.points, first.points)
            for same, all_names, data in zip((self._static, still), names, (grid.point_data, grid.cell_data)):
                all_names.update(dict.fromkeys(data))
                for name in [name for name, values in same.items() if not same_values(values, data.get(name))]:
                    del same[name]
            left_out |= dict.fromkeys(grid.left_out)
            other |= dict.fromkeys(grid.other)
            fields |= dict.fromkeys(grid.field_data)
        lost = [name for name, values in still.items() if not self.topology.add_cell_data(name, values)]
        lost += [name for name in names[1] if name not in still]
        self.left_out = [*left_out, *(name for name in names[0] if name not in first.point_data)]
        self.left_out += [f"{name} (cell)" if name in names[0] else name for name in lost]
        time = first.time()
        self.times_unheard = [f"{name} (field data)" for name in fields if time is not None and name == time[0]]
        self.left_out += [f"{name} (field data)" for name in fields if time is None or name != time[0]]
        self.not_read = {"other": list(other)} if other else {}
        if hidden:
            self.not_read["cells that are hidden or of another piece"] = [f"{hidden} by vtkGhostType"]

    def static(self) -> dict[str, np.ndarray]:
        return self._static

    def fixed_points(self) -> bool:
        return self._fixed

    def points(self, step: int) -> np.ndarray:
        return self._grid(step).points

    def fields(self) -> list[str]:
        return self._fields

    def field(self, step: int, name: str) -> np.ndarray:
        if name not in self._grid(step).point_data:
            raise ClipError(f"{self._file(step)}: got no field {name!r}, expected one as in the first file")
        return self._grid(step).point_data[name]

    def check(self, step: int) -> None:
        if not all(map(np.array_equal, self._grid(step).cells, self._cells)):
            raise ClipError(
                f"frame {step}, {self._file(step).name}: got other cells than in {self._file(0).name}; "
                "topology that changes cannot be coded"
            )

    def _file(self, step: int) -> Path:
        return self._series.frames[step][0]

    def _grid(self, step: int) -> Grid:
        if self._now is None or self._now[0] != step:
            files, budget = self._series.frames[step], Budget(self._max_memory)
            self._file_count = 0
            grids = [self._read(file, budget) for file in files]
            self._now = step, joined(grids, self._series.parts)
        return self._now[1]

    def _read(self, path: Path, budget: Budget, above: tuple[Path, ...] = ()) -> Grid:
        """Return the data set in a VTK file or, if the file only lists others, the joined data sets of these. `above`
        has the files through which this one was reached. Raises ClipError if a file lists itself or lists are nested
        too deep."""
        self._file_count += 1
        if self._file_count > MOST_FILES:
            raise ClipError(f"{above[0]}: got more than {MOST_FILES} files, expected fewer for one frame")
        if path.is_dir():
            raise ClipError(f"{path}: got a folder, expected a plain file")
        data = read_plain(path, budget)
        with naming(path, *_BROKEN):
            if is_legacy(data):
                return read_legacy(data, budget)
            file = VtkXml(data, budget)
            listed = file.files()
            if listed is None:
                return file.grid()
            paths = [file_beside(path.parent, one.file, self._options.allow_outside) for one in listed]
            listing = {os.path.abspath(file) for file in (path, *above)}
            if len(above) >= LEVELS or not listing.isdisjoint(map(os.path.abspath, paths)):
                raise ClipError(f"lists itself, or files more than {LEVELS} deep, expected files with data")
        for piece in paths:
            self.unchanged.add(piece)
        grids = [self._read(piece, budget, (*above, path)) for piece in paths]
        whole = joined(grids, [one.name for one in listed])
        with naming(path, *_BROKEN):
            fields, _, others = file.fields()
        whole.field_data = fields or whole.field_data
        whole.left_out += [name for name in others if name not in whole.left_out]
        return whole


def _time_of(grid: Grid) -> StatedTime | None:
    stated = grid.time()
    if stated is not None:
        name, seconds = stated
        return StatedTime(f"the field {name}", seconds, Kind.COUNT if name.lower() in STEP_NAMES else Kind.TIME)
    return time_in_text("the title", grid.title)
