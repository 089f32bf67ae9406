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
not followed. Where a file could make the HDF5 library take more memory than options.max_memory, by filters that unpack
to more than they should or by text that many elements share, it is read in a process of its own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from contextlib import suppress
from os import fspath
from typing import Any

import h5py
import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, closing_on_failure, naming
from athcodec.motion.clip import RESERVED_NAMES, MotionClip
from athcodec.motion.frames import KEPT_BYTES
from athcodec.motion.presence import PRESENCE
from athcodec.motion.thresholds import THRESHOLDS
from athcodec.sources import ReadOptions
from athcodec.sources.reader_process import read_apart
from athcodec.sources.schema import clip_of_arrays

CHUNK_CACHE_BYTES = 16 << 20
CACHE_SLOTS = 8191  # Chunks that the cache of a small dataset has places for.
GROWTH = {
    h5py.h5z.FILTER_SHUFFLE: 1,
    h5py.h5z.FILTER_FLETCHER32: 1,
    h5py.h5z.FILTER_DEFLATE: 1032,
    h5py.h5z.FILTER_LZF: 90,
}
"""How many bytes a filter makes of one at most; DEFLATE unpacks all that there is, whatever size a chunk has."""
MOST_GROWTH = 1 << 20  # Largest growth that is expected of an unknown filter.
BROKEN = (OSError, RuntimeError, KeyError, ValueError, TypeError, OverflowError, UnicodeError, MemoryError)
_OWN = "expected numbers in the file itself; --allow-outside (allow_outside=True) reads others"


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the HDF5 file `path`; close it, or use it in a `with` statement.

    The file's rest pose is used where options.rest is "auto"; branches derived from edges begin at options.root, or at
    the lowest vertex along the file's attribute up_axis ("y" where it has none).

    Raises ClipError where the file is not HDF5 or its contents are no usable clip, OSError where it cannot be opened.
    """
    file = _open(path)
    with naming(path, *BROKEN), closing_on_failure(_Reading(file)):
        if not options.allow_outside:
            for name in _names(file):
                check_own(file, name, False)
        if not may_explode(file, options.max_memory):
            return _read(file, options)
    _Reading(file).close()
    return read_apart(path, options, "athcodec.sources.hdf5", "HDF5: it is damaged, or the HDF5 library")


class _Reading:
    """A file that has only been read: it does not matter whether it can be closed."""

    def __init__(self, file: h5py.File):
        self._file = file

    def close(self) -> None:
        with suppress(RuntimeError, OSError):
            self._file.close()


def open_clip(path: str, options: ReadOptions) -> MotionClip:
    """The clip in a file, for the process of reader_main.py. Raises ClipError, OSError."""
    file = _open(path)
    with closing_on_failure(_Reading(file)):
        clip = _read(file, options)
    clip.unchanged = FileWatch(path)
    return clip


def _open(path: FilePath) -> h5py.File:
    open_plain(path).close()
    if not h5py.is_hdf5(path):
        raise ClipError(f"{fspath(path)}: got something else, expected an HDF5 file")
    try:
        return h5py.File(path, "r", rdcc_nbytes=CHUNK_CACHE_BYTES)
    except OSError as error:
        raise ClipError(f"{fspath(path)}: the HDF5 file cannot be opened: {error}") from error


def _read(file: h5py.File, options: ReadOptions) -> MotionClip:
    budget = Budget(options.max_memory)
    unchanged = FileWatch(file.id.get_vfd_handle())  # HDF5 itself reads zeros where a file has become shorter
    positions = _unpacked_once(file, "positions", budget)
    if positions is None and "ABC" in file:
        raise ClipError("archive: got Alembic in HDF5, expected Alembic in Ogawa; abcconvert -toOgawa makes it")
    if positions is None:
        raise ClipError("positions: got no such dataset, expected (frames, vertices, 3)")
    frame = positions.nbytes // max(positions.shape[0], 1) if positions.shape else 0
    budget.need(4 * frame + chunk_bytes(positions), "positions: a frame")  # read, converted, checked, and the rest pose
    metadata = {name: _to_python(value) for name, value in file.attrs.items()}
    for name in ("domains", THRESHOLDS, PRESENCE, "part_usd"):
        if isinstance(metadata.get(name), str):
            metadata[name] = _parsed(name, metadata[name])
    attributes = _static_arrays(file, options.skip, budget)
    return clip_of_arrays(
        positions,
        lambda name: _array(file, name, budget),
        attributes,
        metadata,
        options,
        resource=_Reading(file),
        unchanged=unchanged,
    )


def check_own(file: h5py.File, name: str, allow_outside: bool) -> None:
    """Raises ClipError where a dataset, or a link on the way to it, is in another file."""
    if allow_outside:
        return
    parts = [part for part in name.split("/") if part]
    for end in range(1, len(parts) + 1):
        link = file.get("/".join(parts[:end]), getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise ClipError(f"{name[:80]}: got a link to {link.filename[:80]!r}, {_OWN}")
    found = file.get(name) if parts else None
    if found is not None and found.file.filename != file.filename:
        raise ClipError(f"{name[:80]}: got a link to {found.file.filename[:80]!r}, {_OWN}")
    if isinstance(found, h5py.Dataset) and (found.external or found.is_virtual):
        raise ClipError(f"{name[:80]}: got a dataset whose numbers are in other files, {_OWN}")


def _names(file: h5py.File) -> list[str]:
    """Return the names in the file, among them links to other files, which are not followed."""
    names, groups, seen = [], [("", file["/"])], set()
    while groups:
        within, group = groups.pop()
        address = h5py.h5o.get_info(group.id).addr
        if address in seen:  # groups may hold each other
            continue
        seen.add(address)
        for key in group:
            names.append(f"{within}/{key}")
            is_own = group.get(key, getclass=True, getlink=True) is h5py.HardLink
            if is_own and isinstance(group[key], h5py.Group):
                groups.append((names[-1], group[key]))
    return names


def _dataset(file: h5py.File, name: str) -> h5py.Dataset | None:
    if name not in file:
        return None
    dataset = file[name]
    if not isinstance(dataset, h5py.Dataset) or dataset.shape is None:
        raise ClipError(f"{name}: got a group or an empty dataset, expected an array")
    return dataset


def _unpacked_once(file: h5py.File, name: str, budget: Budget) -> h5py.Dataset | None:
    """Return a dataset that is read several times: with room for all its chunks if it is small."""
    dataset, size = _dataset(file, name), 0
    if dataset is not None and dataset.chunks:
        size = dataset.id.get_num_chunks() * chunk_bytes(dataset)
    if not CHUNK_CACHE_BYTES < size <= min(KEPT_BYTES, budget.left):
        return dataset
    access = h5py.h5p.create(h5py.h5p.DATASET_ACCESS)
    access.set_chunk_cache(CACHE_SLOTS, size, 1.0)
    del dataset  # A dataset that is open has its cache already.
    return h5py.Dataset(h5py.h5d.open(file.id, name.encode(), access), readonly=True)


def chunk_bytes(dataset: h5py.Dataset) -> int:
    """Return how many bytes of a dataset are unpacked at once."""
    return int(np.prod(dataset.chunks or (0,), dtype=object)) * dataset.dtype.itemsize


def may_explode(file: h5py.File, limit: int) -> bool:
    """Whether datasets or attributes of a file, or of a part of it, may take the HDF5 library more than `limit` bytes
    whatever shape they have."""
    size = os.fstat(file.id.get_vfd_handle()).st_size
    texts = 0
    for name in file.attrs:
        attribute = file.attrs.get_id(name)
        if attribute.dtype.hasobject:
            texts += max(int(np.prod(attribute.shape, dtype=object)), 1) * size
    if texts > max(limit, size):
        return True
    found: list[bool] = []
    file.visititems(lambda _, item: found.append(isinstance(item, h5py.Dataset) and unpacks_to_more(item, limit)))
    return any(found)


def unpacks_to_more(dataset: h5py.Dataset, limit: int) -> bool:
    """Whether a packed chunk, or one of its texts, may unpack to more than `limit` bytes, whatever it should be."""
    if dataset.dtype.hasobject:
        size = os.fstat(dataset.file.id.get_vfd_handle()).st_size
        if max(int(np.prod(dataset.shape or (), dtype=object)), 1) * size > max(limit, size):
            return True
    packed = dataset.id.get_create_plist()
    growth = 1
    for number in range(packed.get_nfilters() if dataset.chunks else 0):
        growth *= GROWTH.get(packed.get_filter(number)[0], MOST_GROWTH)
    if growth == 1:
        return False
    largest = 0

    def see(chunk: Any) -> None:
        nonlocal largest
        largest = max(largest, chunk.size)

    dataset.id.chunk_iter(see)
    return largest * growth > limit


def _array(file: h5py.File, name: str, budget: Budget) -> np.ndarray | None:
    dataset = _dataset(file, name)
    return None if dataset is None else _load(name, dataset, budget)


def _load(name: str, dataset: h5py.Dataset, budget: Budget) -> np.ndarray:
    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    if dataset.dtype.hasobject and not is_text:
        raise ClipError(f"{name}: got {str(dataset.dtype)[:80]}, expected numbers or text; or skip it")
    budget.take(dataset.nbytes, name)
    budget.need(chunk_bytes(dataset), name)
    try:
        values = np.asarray(dataset[...])
        if not dataset.dtype.hasobject:
            return values
        longest = max(map(len, values.ravel()), default=0)
        budget.take(longest * values.size, name)
        return values.astype(np.bytes_)
    except (OSError, RuntimeError, UnicodeError, TypeError) as error:
        raise ClipError(f"{name}: the dataset cannot be read: {error}") from error


def _static_arrays(file: h5py.File, skip: Collection[str], budget: Budget) -> dict[str, np.ndarray]:
    arrays = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and name not in RESERVED_NAMES and name not in skip:
            if item.shape is None:
                raise ClipError(f"{name}: got an empty dataset, expected an array; or skip it")
            arrays[name] = _load(name, item, budget)

    file.visititems(visit)
    return arrays


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
