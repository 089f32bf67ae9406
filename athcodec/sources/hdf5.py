"""Reads the HDF5 schema of athcodec into a MotionClip; the positions stay in the file and are read in blocks.

| dataset       | shape, dtype               | where it is missing                                   |
|---------------|----------------------------|-------------------------------------------------------|
| positions     | (T, N, 3) float32 or 64    | ClipError                                             |
| time          | (T,) seconds               | from the attribute fps, else 30 frames per second     |
| rest          | (N, 3) float32 or 64       | the first frame or the mean pose                      |
| vertex_branch | (N,) integers              | both derived from edges; none without edges           |
| branch_parent | (B,) integers, -1 = root   |                                                       |
| stem_index    | (N,) integers, 0 = base    | the vertices of a branch run from base to tip         |
| branch_order  | (B,) integers              | not needed; kept only where it is not the depth       |
| edges, faces  | (E, 2), (F, k) integers    | none                                                  |

Every other dataset, also one inside a group, is a named static array and survives unchanged (strings of
variable length become UTF-8 of fixed length). Attributes of the file become metadata, but for clip_name and loop
(true), which say the name of the clip and that it is a loop; attributes of datasets and groups are not read, links are
not followed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Sequence
from os import PathLike, fspath
from typing import Any

import h5py
import numpy as np

from athcodec.clip import RESERVED_NAMES, MotionClip, frame_rate
from athcodec.errors import ClipError
from athcodec.hierarchy import branch_orders, branches_from_edges
from athcodec.joining import read_clip_metadata
from athcodec.sources import ReadOptions

CHUNK_CACHE_BYTES = 64 << 20
MAX_ATTRIBUTE_BYTES = 1 << 30


def read_clip(path: str | PathLike[str], options: ReadOptions) -> MotionClip:
    """Open the clip in the HDF5 file `path`; close it, or use it in a `with` statement.

    The file's rest pose is used where options.rest is "auto"; branches derived from edges begin at options.root, or at
    the lowest vertex along the file's attribute up_axis ("y" where it has none).

    Raises ClipError where the file is not HDF5 or its contents are no usable clip, OSError where it cannot be opened.
    """
    file = _open(path)
    try:
        return _read(file, options)
    except ClipError as error:
        file.close()
        raise ClipError(f"{fspath(path)}: {error}") from error
    except BaseException:
        file.close()
        raise


def _open(path: str | PathLike[str]) -> h5py.File:
    with open(path, "rb"):
        pass
    if not h5py.is_hdf5(path):
        raise ClipError(f"{fspath(path)}: got something else, expected an HDF5 file")
    try:
        return h5py.File(path, "r", rdcc_nbytes=CHUNK_CACHE_BYTES)
    except OSError as error:
        raise ClipError(f"{fspath(path)}: the HDF5 file cannot be opened: {error}") from error


def _watch(file: h5py.File) -> Callable[[], bool]:
    """Whether the file has kept its size and time. HDF5 itself reads zeros where a file has become shorter."""
    descriptor = file.id.get_vfd_handle()

    def stamp() -> tuple[int, int]:
        now = os.fstat(descriptor)
        return now.st_size, now.st_mtime_ns

    before = stamp()
    return lambda: stamp() == before


def _read(file: h5py.File, options: ReadOptions) -> MotionClip:
    unchanged = _watch(file)
    positions = _dataset(file, "positions")
    if positions is None:
        raise ClipError("positions: got no such dataset, expected (frames, vertices, 3)")
    metadata = {name: _to_python(value) for name, value in file.attrs.items()}
    if isinstance(metadata.get("domains"), str):
        metadata["domains"] = _parsed("domains", metadata["domains"])
    attributes = _static_arrays(file, options.skip)
    clip = MotionClip(
        positions=positions,
        time=_time(file, positions, metadata),
        rest=_array(file, "rest") if options.rest == "auto" else None,
        rest_pose="mean" if options.rest == "mean" else "first",
        edges=_array(file, "edges"),
        faces=_array(file, "faces"),
        attributes=attributes,
        metadata=metadata,
        resource=file,
        unchanged=unchanged,
        **_branches(file, positions, metadata, options.root),
    )
    _drop_derivable_order(clip)
    read_clip_metadata(clip)
    return clip


def _dataset(file: h5py.File, name: str) -> h5py.Dataset | None:
    if name not in file:
        return None
    dataset = file[name]
    if not isinstance(dataset, h5py.Dataset) or dataset.shape is None:
        raise ClipError(f"{name}: got a group or an empty dataset, expected an array")
    return dataset


def _array(file: h5py.File, name: str) -> np.ndarray | None:
    dataset = _dataset(file, name)
    return None if dataset is None else _load(name, dataset)


def _load(name: str, dataset: h5py.Dataset) -> np.ndarray:
    if dataset.nbytes > MAX_ATTRIBUTE_BYTES:
        raise ClipError(
            f"{name}: got {dataset.nbytes} bytes, expected a static array of at most {MAX_ATTRIBUTE_BYTES}; "
            "or skip it"
        )
    try:
        if h5py.check_string_dtype(dataset.dtype) and dataset.dtype.hasobject:
            return np.asarray(dataset[...]).astype(np.bytes_)
        return np.asarray(dataset[...])
    except (OSError, RuntimeError, UnicodeError, TypeError) as error:
        raise ClipError(f"{name}: the dataset cannot be read: {error}") from error


def _static_arrays(file: h5py.File, skip: Collection[str]) -> dict[str, np.ndarray]:
    arrays = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and name not in RESERVED_NAMES and name not in skip:
            if item.shape is None:
                raise ClipError(f"{name}: got an empty dataset, expected an array; or skip it")
            arrays[name] = _load(name, item)

    file.visititems(visit)
    return arrays


def _time(file: h5py.File, positions: h5py.Dataset, metadata: dict[str, Any]) -> np.ndarray:
    time = _array(file, "time")
    if time is None:
        return np.arange(positions.shape[0] if positions.shape else 0) / frame_rate(metadata)
    return time


def _branches(
    file: h5py.File, positions: h5py.Dataset, metadata: dict[str, Any], root: int | Sequence[int] | None
) -> dict[str, np.ndarray | None]:
    vertex_branch, branch_parent = _array(file, "vertex_branch"), _array(file, "branch_parent")
    if vertex_branch is not None and branch_parent is not None:
        stem_index = _array(file, "stem_index")
        return {"vertex_branch": vertex_branch, "branch_parent": branch_parent, "stem_index": stem_index}
    if vertex_branch is not None or branch_parent is not None:
        raise ClipError(
            "branches: got one of vertex_branch and branch_parent, expected both, or neither and edges"
        )
    edges = _array(file, "edges")
    if edges is None:
        return {}
    rest = _pose_for_roots(file, positions)
    up_axis = metadata.get("up_axis", "y")
    vertex_branch, branch_parent, stem_index = branches_from_edges(edges, len(rest), rest, root, up_axis)
    return {"vertex_branch": vertex_branch, "branch_parent": branch_parent, "stem_index": stem_index}


def _pose_for_roots(file: h5py.File, positions: h5py.Dataset) -> np.ndarray:
    """The stored rest pose or first frame, checked as the clip will check them again."""
    frame_count, vertex_count = positions.shape[:2] if positions.ndim == 3 else (0, 0)
    time, one_branch, parent = np.arange(frame_count), np.zeros(vertex_count, np.int32), np.array([-1])
    return MotionClip(positions, time, one_branch, parent, rest=_array(file, "rest")).rest


def _drop_derivable_order(clip: MotionClip) -> None:
    order = clip.attributes.get("branch_order")
    if order is None or order.dtype.kind not in "iu":
        return
    if np.array_equal(order, branch_orders(clip.branch_parent)):
        del clip.attributes["branch_order"]


def _parsed(name: str, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        raise ClipError(f"{name}: got {text[:40]!r}, expected JSON: {error}") from None


def _to_python(value: Any) -> Any:
    """An HDF5 attribute as str, int, float, bool, None or nested lists of them."""
    if isinstance(value, h5py.Empty):
        return None
    if isinstance(value, np.ndarray):
        return [_to_python(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, (str, int, float, bool)) else str(value)
