"""Reads OBJ or PLY files that are the frames of one motion: tree_0001.obj, tree_0002.obj ...

Which files these are, and at what times, say their names or an index: see file_series.py. A file without a number is a
motion of one frame. One file is in memory at a time. Faces and edges come from the first file, and so do texture
coordinates and other arrays that are the same in all; the clip's `not_read` names those that change. See obj.py and
ply.py for what is read of a file. Exporters that split vertices (Blender's PLY does where texture coordinates are to be
written) split those of all frames alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.files.reading import Budget, FileWatch, naming, read_plain
from athcodec.motion.clip import MotionClip, stated_fps
from athcodec.motion.frames import Frames
from athcodec.sources import ReadOptions
from athcodec.sources.file_series import Series, StatedTime, series_of, time_in_text
from athcodec.sources.mesh import NAMED, Mesh, comments, same_values
from athcodec.sources.mesh_files import parse_mesh
from athcodec.sources.obj import narrowed, obj_lines, obj_points
from athcodec.sources.ply import POSITION_COLUMNS, ply_header, ply_points

_ELEMENTS = (b"f ", b"f\t", b"l ", b"l\t")
_LABELS = (b"vt ", b"vt\t", b"usemtl ", b"usemtl\t", b"o ", b"o\t", b"g ", b"g\t")


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Return the clip whose frames are the numbered files that `path`, any one of them or a pattern, belongs to. Raises
    ClipError if a file is broken or, as soon as its frame is read, differs from the first in vertices, faces or edges;
    OSError if a file cannot be opened."""
    series = series_of(path, options)
    if len(series.parts) > 1:
        raise ClipError(f"{series.index}: got {len(series.parts)} files at one time, expected one")
    reader = _reader_of(series, options)
    ordered = series.in_time(reader.stated)
    if ordered is not series:
        series, reader = ordered, _reader_of(ordered, options)
    mesh, changed = reader.mesh, reader.changed
    time, metadata = series.clock(reader.stated, options, stated_fps(mesh.metadata))
    if mesh.metadata["part_names"] == [series.first.stem]:
        mesh.metadata["part_names"] = [series.name]
    attributes = {name: values for name, values in mesh.attributes.items() if name not in changed.union(options.skip)}
    for name in changed:
        mesh.metadata["domains"].pop(name, None)
        mesh.metadata.pop(NAMED.get(name, ""), None)
    not_read = reader.not_read | series.not_read
    left_out = [*not_read.pop("attribute", []), *sorted(changed.difference(options.skip))]
    with naming(path):
        return MotionClip(
            reader.frames,
            time,
            faces=mesh.faces,
            edges=mesh.edges,
            attributes=attributes,
            metadata=mesh.metadata | metadata,
            not_read=not_read | ({"attribute": left_out} if left_out else {}),
            **options.rest_fields(None),
            unchanged=reader.unchanged,
        )


def _reader_of(series: Series, options: ReadOptions) -> FileFrames:
    """Return the reader of a series of files, after it has looked at each of them once."""
    files = [file for (file,) in series.frames]
    reader = FileFrames(files, parse_mesh, _fast_reader, Budget(options.max_memory))
    if series.index is not None:
        reader.unchanged.add(series.index)
    reader.look()
    return reader


class FileFrames:
    """Frames of which each is a file of its own, read whole.

    Parameters
    ----------
    paths : sequence of Path
        In the order of time.
    parse : callable
        (bytes, path, budget) -> Mesh.
    fast_reader : callable
        (bytes of the first file, its mesh) -> a function from the bytes of a further file to its points, or to None
        where all else is not as in the first, or that function cannot tell.
    budget : Budget
        What a file may take.

    What all files say, once `look` has read them: `changed`, the names of the arrays that are not the same in all;
    `stated`, the time that each states; `not_read` as in MotionClip.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        parse: Callable[[bytes, Path, Budget], Mesh],
        fast_reader: Callable[[bytes, Mesh], Callable[[bytes], np.ndarray | None]],
        budget: Budget,
    ):
        """Read the first file and prepare frames of all `paths`. `parse(data, path, budget)` returns the mesh in a
        file's content; `fast_reader(data, mesh)` returns a function that quickly reads the points of files that differ
        from the first in coordinates alone, and returns None for others."""
        self.paths, self._parse, self._budget = list(paths), parse, budget
        self.unchanged = FileWatch(*self.paths)
        data = read_plain(self.paths[0], budget)
        self.mesh = parse(data, self.paths[0], budget)
        self._fast = fast_reader(data, self.mesh)
        self.stated: list[StatedTime | None] = [_time_in(data)]
        self.changed: set[str] = set()
        self.not_read = {kind: list(names) for kind, names in self.mesh.not_read.items()}
        self.frames = Frames(self._read, len(self.paths), len(self.mesh.points), self.mesh.points.dtype, True)

    def _read(self, start: int, stop: int) -> np.ndarray:
        block = np.empty((stop - start, *self.frames.shape[1:]), self.frames.dtype)
        for frame in range(start, stop):
            with np.errstate(over="ignore"):
                block[frame - start] = self._points(frame)
        return block

    def look(self) -> None:
        """Read all files once to learn the times that they state, which attributes change and what is not read. A
        broken file raises no error here but when its frame is read."""
        for path in self.paths[1:]:
            data = read_plain(path, self._budget)
            self.stated.append(_time_in(data))
            with suppress(ClipError):
                if self._quick_points(data) is None:
                    mesh = self._parse(data, path, self._budget)
                    self.changed |= set() if self.mesh.same_topology(mesh) else self.mesh.changed(mesh)
                    for kind, names in mesh.not_read.items():
                        self.not_read[kind] = list(dict.fromkeys([*self.not_read.get(kind, []), *names]))

    def _quick_points(self, data: bytes) -> np.ndarray | None:
        try:
            points = self._fast(data)
        except (ClipError, ValueError, IndexError, OverflowError):
            return None  # The full parser says what is wrong.
        return points if points is not None and points.shape == self.mesh.points.shape else None

    def _points(self, frame: int) -> np.ndarray:
        """Return the points (N, 3) in the file of a frame. Raises ClipError if the file differs from the first in
        vertices, faces or edges."""
        path = self.paths[frame]
        data = read_plain(path, self._budget)
        points = self._quick_points(data)
        if points is not None:
            return points
        mesh = self._parse(data, path, self._budget)
        different = self.mesh.same_topology(mesh)
        if different:
            raise ClipError(
                f"frame {frame}, {path.name}: {different}, unlike {self.paths[0].name}; topology that "
                "changes cannot be coded"
            )
        return mesh.points


def _time_in(data: bytes) -> StatedTime | None:
    return time_in_text("the comment", "\n".join(comments(data)))


def _fast_reader(data: bytes, mesh: Mesh) -> Callable[[bytes], np.ndarray | None]:
    if data.startswith((b"ply\n", b"ply\r")):
        return _fast_ply(data)
    return _fast_obj(data, mesh)


def _fast_obj(data: bytes, mesh: Mesh) -> Callable[[bytes], np.ndarray | None]:
    """Return a function that takes the content of an OBJ file and returns its points (N, 3), or None if the file
    differs from `data`, whose mesh is `mesh`, in more than coordinates."""
    dtype, colors = mesh.points.dtype, mesh.attributes.get("colors")
    elements, statements = _obj_elements(obj_lines(data)), _statements(obj_lines(data))
    if any(b"-" in line for line in elements if line.startswith(_ELEMENTS)):
        return lambda data: None  # relative numbers: which vertices they mean depends on the lines around them

    tail = data[data.rfind(b"\nv ") + 1 :].partition(b"\n")[2]  # Usually all that is not a coordinate.

    def points(data: bytes) -> np.ndarray | None:
        """Return the points (N, 3) in the content of an OBJ file, or None if the file differs from the first in more
        than coordinates."""
        if tail and colors is None and data.endswith(tail):
            rows = [line for line in data[: -len(tail)].splitlines() if not line.startswith(b"#")]
            words = b" ".join(rows).split()
            if len(words) == 4 * len(rows) and set(words[::4]) == {b"v"}:
                del words[::4]
                return narrowed(np.array(list(map(float, words)), np.float64).reshape(-1, 3), dtype)
        lines = obj_lines(data)
        if _obj_elements(lines) != elements or not _statements(lines) <= statements:
            return None
        points, others = obj_points([line.split()[1:] for line in lines if line[:2] in (b"v ", b"v\t")], dtype)
        return points if colors is others is None or same_values(colors, others) else None

    return points


def _obj_elements(lines: Sequence[bytes]) -> list[bytes]:
    """Return the lines that say which vertices belong together, and what is where on them."""
    return [line for line in lines if line.startswith(_ELEMENTS + _LABELS)]


def _statements(lines: Sequence[bytes]) -> set[bytes]:
    return {line.split(None, 1)[0] for line in lines if line and not line.isspace() and line[:2] != b"v "}


def _fast_ply(data: bytes) -> Callable[[bytes], np.ndarray | None]:
    """Return a function that takes the content of a binary PLY file and returns its points (N, 3), or None if the file
    differs from `data` in more than coordinates."""
    header = ply_header(data)
    vertex = header.elements[0]
    if not header.order or vertex.name != "vertex" or vertex.lists:
        return lambda data: None
    dtype = vertex.row(header.order, {})
    head, end = data[: header.length], header.length + vertex.count * dtype.itemsize
    tail = data[end:]
    first = np.frombuffer(data, dtype, vertex.count, len(head))
    others = [name for name in dtype.names or () if name not in POSITION_COLUMNS]

    def points(data: bytes) -> np.ndarray | None:
        if data[: len(head)] != head or data[end:] != tail:
            return None
        rows = np.frombuffer(data, dtype, vertex.count, len(head))
        return ply_points(rows) if all(np.array_equal(rows[name], first[name]) for name in others) else None

    return points
