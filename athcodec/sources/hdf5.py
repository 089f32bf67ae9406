"""Reads HDF5: athcodec's schema, arrays of other programs, MATLAB 7.3; VTKHDF is handed to vtkhdf.py.

| dataset       | shape, dtype               | where it is missing                                   |
|---------------|----------------------------|-------------------------------------------------------|
| positions     | (T, N, 3) float32 or 64    | another dataset, see schema.py, or ClipError          |
| time          | (T,) seconds               | from the attribute fps, else 30 frames per second     |
| rest          | (N, 3) float32 or 64       | the first frame or the mean pose                      |
| vertex_branch | (N,) integers              | both derived from edges; none without edges           |
| branch_parent | (B,) integers, -1 = root   |                                                       |
| stem_index    | (N,) integers, 0 = base    | the vertices of a branch run from base to tip         |
| branch_order  | (B,) integers              | not needed; kept only where it is not the depth       |
| edges, faces  | (E, 2), (F, k) integers    | none                                                  |

The positions stay in the file and are read in blocks. Every other dataset, also one inside a group, is a named static
array and survives unchanged (strings of variable length become UTF-8 of fixed length). Attributes of the file become
metadata, but for clip_name and loop (true), which say the name of the clip and that it is a loop. Attributes of
datasets are read where they state units, rates or dimensions; the clip's `not_read` names the others, datasets without
numbers, and links that lead nowhere or to groups of other files. Where a file could make the HDF5 library take more
memory than options.max_memory, by filters that unpack to more than they should or by text that many elements share, it
is read in a process of its own.

MATLAB 7.3 is HDF5 whose datasets have the attribute MATLAB_class and their dimensions reversed: shapes and --axes are
those that MATLAB shows. Vertices are counted from 1 there.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from contextlib import suppress
from os import fspath
from pathlib import Path

import h5py
import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath, open_plain
from athcodec.files.reading import Budget, FileWatch, closing_on_failure, naming
from athcodec.motion.clip import MotionClip
from athcodec.motion.frames import KEPT_BYTES
from athcodec.motion.positions import Order, ordered
from athcodec.motion.presence import PRESENCE
from athcodec.motion.thresholds import THRESHOLDS
from athcodec.sources import ReadOptions
from athcodec.sources.reader_process import read_apart
from athcodec.sources.schema import POSITIONS, Stored, clip_of_arrays
from athcodec.untyped import ArrayLike, H5Object, JsonMapping, JsonObject, JsonValue

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
MATLAB_SPARSE, SPARSE = "MATLAB_sparse", "sparse matrix"
VTKHDF = "VTKHDF"  # Name of VTK's group.
MATLAB_CLASS, MATLAB_EMPTY, MATLAB_OWN = "MATLAB_class", "MATLAB_empty", ("#refs#", "#subsystem#")
BOOKKEEPING = {"CLASS", "NAME", "DIMENSION_LIST", "DIMENSION_LABELS", "REFERENCE_LIST", "_FillValue", "H5PATH"}
BOOKKEEPING_OF = ("MATLAB_", "_Netcdf4", "_NC")  # Beginnings of names of attributes by which libraries find their way.
ONLY_A_DIMENSION = "This is a netCDF dimension"  # Name of a dataset of zeros that stands for the length of an axis.
_OWN = "expected numbers in the file itself; --allow-outside (allow_outside=True) reads others"


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the HDF5 file `path`; close it, or use it in a `with` statement.

    The file's rest pose is used if options.rest is "auto". Branches that follow from edges begin at the vertex
    options.root or, by default, at the lowest vertex along the file's attribute up_axis ("y" if it has none), unless
    that sways and another one stands still.

    Raises ClipError if the file is not HDF5 or holds no usable clip, OSError if it cannot be opened.
    """
    file = _open(path)
    with naming(path, *BROKEN), closing_on_failure(_Reading(file)):
        if not options.allow_outside:
            for name in _names(file):
                check_own(file, name, False)
        if not may_explode(file, options.max_memory):
            return _read(file, path, options)
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
    """Return the clip in a file, for the process of reader_main.py. Raises ClipError, OSError."""
    file = _open(path)
    with closing_on_failure(_Reading(file)):
        clip = _read(file, path, options)
    clip.unchanged = FileWatch(path)
    return clip


def _open(path: FilePath) -> h5py.File:
    """Return the opened HDF5 file. Raises ClipError if the file is not HDF5 or cannot be read as such, OSError if it
    cannot be opened."""
    open_plain(path).close()
    if not h5py.is_hdf5(path):
        raise ClipError(f"{fspath(path)}: got something else, expected an HDF5 file")
    try:
        return h5py.File(path, "r", rdcc_nbytes=CHUNK_CACHE_BYTES)
    except OSError as error:
        raise ClipError(f"{fspath(path)}: the HDF5 file cannot be opened: {error}") from error


def _read(file: h5py.File, path: FilePath, options: ReadOptions) -> MotionClip:
    """Return the clip of an opened HDF5 file, which is VTKHDF or arrays of athcodec's schema. `path` names it in
    messages. Raises ClipError."""
    unchanged = FileWatch(file.id.get_vfd_handle())  # HDF5 itself reads zeros where a file has become shorter
    watched = {"resource": _Reading(file), "unchanged": unchanged}
    if VTKHDF in file and options.dataset is None:
        from athcodec.sources.vtkhdf import clip_of_vtkhdf  # It is rare, and imports readers of cells.

        return clip_of_vtkhdf(file, path, options, **watched)
    if "ABC" in file and POSITIONS not in file:
        raise ClipError("archive: got Alembic in HDF5, expected Alembic in Ogawa; abcconvert -toOgawa makes it")
    arrays = _Datasets(file, Budget(options.max_memory))
    try:
        return clip_of_arrays(arrays, path, options, **watched)
    except ClipError as error:
        index = _index_of(Path(path)) if POSITIONS not in file and options.dataset is None else None
        if index is None:
            raise
        raise ClipError(f"{error}; {index.name} beside it lists what is in it: encode that") from None


def _index_of(path: Path) -> Path | None:
    """Return the XDMF file of the same name, whose numbers an HDF5 file has."""
    names = [path.with_suffix(suffix) for suffix in (".xdmf", ".xmf", "")]
    return next((name for name in names if name.suffix in (".xdmf", ".xmf") and name.is_file()), None)


class _Datasets:
    """See schema.Arrays."""

    def __init__(self, file: h5py.File, budget: Budget):
        """List the datasets of the file that can be read as arrays. `budget` limits the memory that reading them
        takes."""
        self._file, self._budget = file, budget
        self.stored: dict[str, Stored] = {}
        self.not_read: dict[str, list[str]] = {}
        self.counts_from_1 = False
        self.metadata = _notes(file)
        for name in ("domains", THRESHOLDS, PRESENCE, "part_usd"):
            if isinstance(self.metadata.get(name), str):
                self.metadata[name] = _parsed(name, self.metadata[name])
        seen: set[H5Object] = set()
        for name in sorted((name.lstrip("/") for name in _names(file)), key=lambda name: name.split("/")):
            self._add(name, seen)

    def _add(self, name: str, seen: set[H5Object]) -> None:
        """List the dataset called `name` in `stored`, or add its name to `not_read` if it is no array that can be read.
        `seen` has the addresses of the datasets listed so far, so that none is listed twice."""
        link, item = self._file.get(name, getlink=True), self._file.get(name)
        if item is None:
            self._leave_out("link", name)
            return
        if isinstance(link, h5py.SoftLink) and name != POSITIONS:
            return  # What a link within the file names is read where it is.
        if not isinstance(item, h5py.Dataset):
            if isinstance(link, h5py.ExternalLink):
                self._leave_out("link", name)
            return
        info = h5py.h5o.get_info(item.id)
        if self._is_sparse(name.rpartition("/")[0]):
            return
        is_known = (info.fileno, info.addr) in seen and name != POSITIONS
        seen.add((info.fileno, info.addr))
        if is_known or name.startswith(MATLAB_OWN) or _is_only_a_dimension(item):
            return
        if item.shape is None or MATLAB_EMPTY in item.attrs:
            if name == POSITIONS:
                raise ClipError(f"{name}: got an empty dataset, expected an array")
            self._leave_out("empty dataset", name)
        elif item.dtype.hasobject and h5py.check_string_dtype(item.dtype) is None:
            self._leave_out("dataset of references or lists", name)
        else:
            self.stored[name] = _stored(name, item)
            self.counts_from_1 = self.counts_from_1 or _is_matlab(item)

    def _is_sparse(self, group: str) -> bool:
        """Return whether a group is a sparse matrix of MATLAB, which is named then."""
        if not group or MATLAB_SPARSE not in self._file[group].attrs:
            return False
        if group not in self.not_read.get(SPARSE, ()):
            self._leave_out(SPARSE, group)
        return True

    def _leave_out(self, kind: str, name: str) -> None:
        self.not_read.setdefault(kind, []).append(name)

    def read(self, name: str) -> np.ndarray:
        """Return the dataset `name` as an array in memory, with the axes and texts of MATLAB's files brought to the
        order and type of NumPy."""
        dataset = self._file[name]
        values = _load(name, dataset, self._budget)
        if not _is_matlab(dataset):
            return values
        kind = _matlab_class(dataset)
        if kind == "char":
            rows = ["".join(map(chr, row)).encode("utf-8", "replace") for row in values.T.tolist()]
            return np.array(rows).reshape(self.stored[name].shape)
        return values.T.astype(bool) if kind == "logical" else values.T

    def positions(self, name: str, order: Order) -> ArrayLike:
        """Return the positions in dataset `name` as (frames, vertices, 3), read from the file when they are sliced.
        `order` says what each axis of the dataset holds. Raises ClipError if a frame does not fit into memory."""
        dataset = _unpacked_once(self._file, name, self._budget)
        order = order[::-1] if _is_matlab(dataset) else order
        positions = ordered(dataset, order)
        frame = 3 * positions.shape[1] * dataset.dtype.itemsize
        # A frame is read, converted, checked, and becomes the rest pose.
        self._budget.need(4 * frame + chunk_bytes(dataset), f"{name}: a frame")
        return positions

    def notes(self, name: str) -> JsonMapping:
        return _notes(self._file[name], False)

    def labels(self, name: str) -> Sequence[str]:
        return [
            dimension.label or next((scale.name for scale in dimension.values() if scale.name), "")
            for dimension in self._file[name].dims
        ]


def _notes(item: H5Object, of_file: bool = True) -> JsonObject:
    """Return the HDF5 attributes of a file, group or dataset as Python values. Unless `of_file`, attributes by which
    libraries keep their own records are left out, and a value of an unknown type becomes None."""
    if of_file:
        return {name: _to_python(item.attrs[name]) for name in item.attrs}
    notes: JsonObject = {}
    for name in item.attrs:
        if name not in BOOKKEEPING and not name.startswith(BOOKKEEPING_OF):
            notes[name] = None
            with suppress(*BROKEN):  # Some types have no equivalent in NumPy; the name is known all the same.
                notes[name] = _to_python(item.attrs[name])
    return notes


def _is_matlab(dataset: h5py.Dataset) -> bool:
    return MATLAB_CLASS in dataset.attrs


def _matlab_class(dataset: h5py.Dataset) -> str:
    """Return what MATLAB calls the type of a dataset: "char" for rows of text in uint16."""
    kind = str(_to_python(dataset.attrs[MATLAB_CLASS]))
    return kind if kind != "char" or (dataset.dtype.kind == "u" and dataset.ndim == 2) else ""


def _stored(name: str, dataset: h5py.Dataset) -> Stored:
    if not _is_matlab(dataset):
        return Stored(name, dataset.shape, dataset.dtype)
    shape = dataset.shape[::-1]
    if _matlab_class(dataset) == "char":
        return Stored(name, shape[:1] if shape[0] != 1 else (), np.dtype(f"S{max(shape[1], 1)}"))
    return Stored(name, shape, dataset.dtype)


def _is_only_a_dimension(dataset: h5py.Dataset) -> bool:
    """Return whether netCDF made a dataset only to state the length of an axis."""
    return str(_to_python(dataset.attrs.get("NAME", ""))).startswith(ONLY_A_DIMENSION)


def check_own(file: h5py.File, name: str, allow_outside: bool) -> None:
    """Raise ClipError if the dataset `name`, or a link on the way to it, is in another file, unless `allow_outside`."""
    if allow_outside:
        return
    parts = [part for part in name.split("/") if part]
    for end in range(1, len(parts) + 1):
        link = file.get("/".join(parts[:end]), getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise ClipError(f"{name[:80]}: got a link to {link.filename[:80]!r}, {_OWN}")
    item = file.get(name) if parts else None
    if item is not None and item.file.filename != file.filename:
        raise ClipError(f"{name[:80]}: got a link to {item.file.filename[:80]!r}, {_OWN}")
    if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
        raise ClipError(f"{name[:80]}: got a dataset whose numbers are in other files, {_OWN}")


def _names(file: h5py.File) -> list[str]:
    """Return the paths of all links in the file, including links to other files, which are not followed."""
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


def _unpacked_once(file: h5py.File, name: str, budget: Budget) -> h5py.Dataset:
    """Return dataset `name`, opened with a cache for all its unpacked chunks if these are few enough: the dataset is
    read several times and each chunk should be unpacked only once."""
    dataset, size = file[name], 0
    if dataset.chunks:
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
    """Return whether the HDF5 library may need more than `limit` bytes to read some dataset or attribute, however small
    its shape says that it is."""
    size = os.fstat(file.id.get_vfd_handle()).st_size
    verdicts: list[bool] = [_texts_are_more(file, size, limit)]

    def visit(_: str, item: H5Object) -> None:
        is_more = isinstance(item, h5py.Dataset) and unpacks_to_more(item, limit)
        verdicts.append(is_more or (hasattr(item, "attrs") and _texts_are_more(item, size, limit)))

    file.visititems(visit)
    return any(verdicts)


def _texts_are_more(item: H5Object, size: int, limit: int) -> bool:
    """Return whether attributes may hold more than `limit` bytes of text, each as long as the file of `size` bytes."""
    texts = 0
    for name in item.attrs:
        attribute = item.attrs.get_id(name)
        if attribute.dtype.hasobject:
            texts += max(int(np.prod(attribute.shape or (), dtype=object)), 1) * size
    return texts > max(limit, size)


def unpacks_to_more(dataset: h5py.Dataset, limit: int) -> bool:
    """Return whether one compressed chunk or text of a dataset may unpack to more than `limit` bytes, whatever size it
    states."""
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

    def see(chunk: H5Object) -> None:
        nonlocal largest
        largest = max(largest, chunk.size)

    dataset.id.chunk_iter(see)
    return largest * growth > limit


def _load(name: str, dataset: h5py.Dataset, budget: Budget) -> np.ndarray:
    """Return the whole dataset as an array, with texts as bytes of one length. `name` is for messages and `budget`
    limits memory. Raises ClipError."""
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


def _parsed(name: str, text: str) -> JsonValue:
    try:
        return json.loads(text)
    except ValueError as error:
        raise ClipError(f"{name}: got {text[:40]!r}, expected JSON: {error}") from None


def _to_python(value: JsonValue) -> JsonValue:
    """Return the value of an HDF5 attribute as str, int, float, bool, None, or nested lists of these."""
    if isinstance(value, h5py.Empty):
        return None
    if isinstance(value, np.ndarray):
        return [_to_python(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, (str, int, float, bool)) else str(value)
