"""Writes the HDF5 schema of athcodec (see sources/hdf5.py), frame block by frame block.

The file is written under another name in the same directory and takes its own name when it is complete, so a
reader never sees half a clip, and a failure leaves the older file. It computes nothing but branch_order.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import h5py
import numpy as np

from athcodec.errors import ClipError
from athcodec.exporters import Progress, WriteOptions
from athcodec.files.atomic import PendingFile
from athcodec.files.plain import FilePath
from athcodec.motion.clip import RESERVED_NAMES, check_branches, check_float_dtype, check_time
from athcodec.motion.hierarchy import branch_orders
from athcodec.motion.joining import clip_metadata
from athcodec.untyped import H5Object, JsonMapping, JsonObject, JsonValue

CHUNK_BYTES = 1 << 20


class Hdf5Writer:
    """Writes one clip whose frames are added in order; use it in a ``with`` statement.

    Parameters
    ----------
    path : str or path
        The file to write; an existing one is replaced when the new one is complete, and stays if it never is.
    time : (T,) array
        Seconds; says how many frames must be added.
    vertex_branch, branch_parent : (N,) and (B,) arrays of integers, or None both
        As in MotionClip.
    rest : (N, 3) array of float32 or float64
        The rest pose, written in its own dtype.
    dtype : dtype, optional
        Of the positions, float32 or float64.
    stem_index, edges, faces, attributes, metadata : optional
        As in MotionClip.
    gzip : bool, optional
        Compress without loss: smaller and slower.

    Raises
    ------
    ClipError
        For arrays that make no clip.
    OSError
        Where the file cannot be written.
    """

    def __init__(
        self,
        path: FilePath,
        *,
        time: np.ndarray,
        vertex_branch: np.ndarray | None,
        branch_parent: np.ndarray | None,
        rest: np.ndarray,
        dtype: Any = np.float32,
        stem_index: np.ndarray | None = None,
        edges: np.ndarray | None = None,
        faces: np.ndarray | None = None,
        attributes: Mapping[str, np.ndarray] | None = None,
        metadata: JsonMapping | None = None,
        gzip: bool = False,
    ) -> None:
        """Create the file under a temporary name and write all arrays but the positions. `time` (T,) is in seconds,
        `rest` (N, 3) the rest pose, `dtype` the type of positions, and `gzip` compresses arrays. Raise ClipError,
        OSError.
        """
        dtype, rest = np.dtype(dtype), np.asarray(rest)
        check_float_dtype("positions", dtype)
        check_float_dtype("rest", rest.dtype)
        if rest.ndim != 2 or rest.shape[1] != 3:
            raise ClipError(f"rest: got shape {rest.shape}, expected (vertices, 3)")
        branch_order = None
        if branch_parent is not None:
            vertex_branch, branch_parent = check_branches(vertex_branch, branch_parent, len(rest))
            branch_order = branch_orders(branch_parent)
        time = check_time(time, len(time))
        arrays = {
            "time": time,
            "rest": rest,
            "vertex_branch": vertex_branch,
            "branch_parent": branch_parent,
            "branch_order": branch_order,
            "stem_index": stem_index,
            "edges": edges,
            "faces": faces,
        }
        self._frame_count, self._vertex_count = len(time), len(rest)
        self._written, self._gzip = 0, gzip
        self._pending: PendingFile | None = PendingFile(path)
        self._file: H5Object = None  # An h5py.File, which has no types.
        self._sink = Sink(self._pending.descriptor, self._pending.path)
        try:
            self._file = h5py.File(self._sink, "w")
            self._positions = self._create_positions(dtype)
            self._write_arrays(arrays | _further(attributes))
            self._write_metadata(metadata or {})
            self._sink.check()
        except BaseException:
            self.abort()
            raise

    def __enter__(self) -> Hdf5Writer:
        return self

    def __exit__(self, exception_type: type[BaseException] | None, *details: object) -> None:
        if exception_type is None:
            self.close()
        else:
            self.abort()

    def add(self, frames: np.ndarray) -> None:
        """Append consecutive frames of positions to the file.

        Parameters
        ----------
        frames : (k, N, 3) array

        Raises
        ------
        ClipError
            If the frames have another shape, or there are more than the file has times for.
        OSError
            If the frames cannot be written.
        """
        frames = np.asarray(frames)
        if frames.ndim != 3 or frames.shape[1:] != (self._vertex_count, 3):
            raise ClipError(f"frames: got shape {frames.shape}, expected (k, {self._vertex_count}, 3)")
        stop = self._written + len(frames)
        if stop > self._frame_count:
            raise ClipError(f"frames: got {stop}, expected {self._frame_count}, one per time")
        self._positions[self._written : stop] = frames
        self._sink.check()
        self._written = stop

    def close(self) -> None:
        """Complete the file and rename it to its final name. If the file is closed already, do nothing.

        Raises
        ------
        ClipError
            If fewer frames were added than the file has times for.
        OSError
            Where the file cannot be written.
        """
        if self._pending is None:
            return
        try:
            if self._written < self._frame_count:
                raise ClipError(f"frames: got {self._written}, expected {self._frame_count}, one per time")
            self._file.close()
            self._sink.check()
            self._pending.complete()
            self._pending = None
        except BaseException:
            self.abort()
            raise

    def abort(self) -> None:
        """Remove the file as far as it has been written. If it is complete already, do nothing."""
        pending, self._pending = self._pending, None
        if pending is None:
            return
        try:
            if self._file is not None:
                self._file.close()
        finally:
            pending.discard()

    def _create_positions(self, dtype: np.dtype) -> h5py.Dataset:
        """Create and return the dataset of positions (T, N, 3), in compressed chunks if the file is compressed."""
        shape = (self._frame_count, self._vertex_count, 3)
        options = self._compression()
        if options:
            vertices = min(self._vertex_count, max(1, CHUNK_BYTES // (3 * dtype.itemsize)))
            frames = min(self._frame_count, max(1, CHUNK_BYTES // (3 * dtype.itemsize * vertices)))
            options["chunks"] = (frames, vertices, 3)
        return self._file.create_dataset("positions", shape, dtype, **options)

    def _write_arrays(self, arrays: Mapping[str, np.ndarray | None]) -> None:
        for name, values in arrays.items():
            if values is not None:
                values = np.asarray(values)
                options = self._compression() if values.ndim and values.size else {}
                self._file.create_dataset(name, data=values, **options)

    def _write_metadata(self, metadata: JsonMapping) -> None:
        for name, value in metadata.items():
            self._file.attrs[name] = _attribute(value)

    def _compression(self) -> JsonObject:
        return {"compression": "gzip", "shuffle": True} if self._gzip else {}


def write_clip(clip: Any, path: FilePath, options: WriteOptions, report: Progress) -> None:
    """Write a clip to `path`, block by block, as Hdf5Writer does.

    `clip` is a MotionClip, a ClipView, or any object with time, vertex_branch, branch_parent, rest, dtype and blocks()
    like theirs. The attributes stem_index, edges, faces, attributes, metadata, clip_ranges and source_rest are written
    if it has them.
    """
    optional = ("vertex_branch", "branch_parent", "stem_index", "edges", "faces", "attributes")
    writer = Hdf5Writer(
        path,
        time=clip.time,
        rest=getattr(clip, "source_rest", clip.rest),
        dtype=clip.dtype,
        gzip=options.gzip,
        metadata=clip_metadata(clip),
        **{name: getattr(clip, name, None) for name in optional},
    )
    with writer:
        for start, frames in clip.blocks():
            writer.add(frames)
            report((start + len(frames)) / len(clip.time))


class Sink:
    """An open file that HDF5 writes to through Python. HDF5 loses track of its objects, and crashes when the program
    ends, where writing fails because the disk is full or the program was interrupted. So it never sees errors; `check`
    raises the first of them, with the name `path`."""

    def __init__(self, descriptor: int, path: str):
        self._file, self._path = open(descriptor, "r+b", buffering=0, closefd=False), path
        self._error: BaseException | None = None

    def check(self) -> None:
        """Raise the first error met; an OSError with the name of the file."""
        if isinstance(self._error, OSError):
            raise OSError(self._error.errno, self._error.strerror, self._path)
        if self._error is not None:
            raise self._error

    def write(self, data: Any) -> int:
        data = memoryview(data).cast("B")
        done = 0
        while done < len(data) and self._error is None:
            with self._noting():
                done += self._file.write(data[done:])
        return len(data)

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer with the next bytes of the file. After an error, which is kept, or at the end, the rest is
        filled with zeros; always return the buffer's length.
        """
        view, done = memoryview(buffer).cast("B"), 0
        while done < len(view) and self._error is None:
            with self._noting():
                got = self._file.readinto(view[done:])
                if not got:
                    break
                done += got
        view[done:] = bytes(len(view) - done)
        return len(view)

    def read(self, size: int = -1) -> bytes:
        return self._file.read(size)

    def seek(self, place: int, whence: int = os.SEEK_SET) -> int:
        return self._file.seek(place, whence)

    def tell(self) -> int:
        return self._file.tell()

    def truncate(self, size: int) -> int:
        with self._noting():
            self._file.truncate(size)
        return size

    def flush(self) -> None:
        pass  # nothing is buffered here

    @contextmanager
    def _noting(self) -> Iterator[None]:
        try:
            yield
        except BaseException as error:
            self._error = self._error or error


def _further(attributes: Mapping[str, np.ndarray] | None) -> dict[str, np.ndarray]:
    clashing = RESERVED_NAMES.intersection(attributes or {})
    if clashing:
        raise ClipError(f"attributes: got the name {min(clashing)!r}, expected one that the schema does not use")
    return dict(attributes or {})


def _attribute(value: JsonValue) -> JsonValue:
    """Return a value in a form that HDF5 attributes can hold. Anything but a scalar, a text or an array of one type
    becomes JSON text.
    """
    if value is None:
        return h5py.Empty("f4")
    if not isinstance(value, (list, tuple)):
        return json.dumps(value) if isinstance(value, dict) else value
    if value and all(isinstance(item, str) for item in value):
        return np.array(value, dtype=h5py.string_dtype())
    try:
        array = np.array(value)
    except ValueError:
        return json.dumps(value)
    return array if array.dtype.kind in "biuf" else json.dumps(value)
