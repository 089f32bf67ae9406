"""Reads MATLAB files up to version 7.2, by SciPy in a process of its own: it trusts its files. Version 7.3 is HDF5, see
hdf5.py.

See schema.py for which variable the positions are. A struct is a group of arrays. Cells, objects, functions, sparse
matrices and arrays of structs are named as not read. Vertices are counted from 1, as MATLAB does.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import fspath
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.plain import FilePath
from athcodec.files.reading import FileWatch
from athcodec.motion.clip import MotionClip
from athcodec.motion.positions import Order, ordered
from athcodec.sources import ReadOptions
from athcodec.sources.reader_process import read_apart
from athcodec.sources.schema import Stored, clip_of_arrays
from athcodec.untyped import ArrayLike, JsonMapping, JsonObject

MOST_NESTED = 16  # Structs inside structs.
SYSTEM = "__"  # Beginning of names that SciPy adds.


def read_clip(path: FilePath, options: ReadOptions) -> MotionClip:
    """Open the clip in the file `path`. Raises ClipError where it holds none or is broken, OSError where it cannot be
    opened."""
    return read_apart(path, options, "athcodec.sources.mat", "MATLAB file: it is damaged, or SciPy")


def open_clip(path: str, options: ReadOptions) -> MotionClip:
    """Return the clip in the MATLAB file `path`. A separate process calls this function, because SciPy may fail badly
    on a damaged file (reader_main.py). Raises ClipError, OSError."""
    from scipy.io import loadmat  # It takes long to import.

    watch = FileWatch(path)
    try:
        variables = loadmat(path, mat_dtype=True, chars_as_strings=True)
    except Exception as error:  # SciPy trusts its files: a damaged one may raise any exception.
        text = " ".join(str(error).split()) or type(error).__name__
        raise ClipError(f"{fspath(path)}: the MATLAB file cannot be read: {text[:200]}") from None
    return clip_of_arrays(_Variables(variables), path, options, unchanged=watch)


class _Variables:
    """Arrays in memory: see schema.Arrays."""

    counts_from_1 = True

    def __init__(self, variables: JsonMapping):
        """Take the variables of a MATLAB file by their names, as SciPy's `loadmat` returns them."""
        self._arrays: dict[str, np.ndarray] = {}
        self.metadata: JsonObject = {}
        self.not_read: dict[str, list[str]] = {}
        for name, values in variables.items():
            if not name.startswith(SYSTEM):
                self._add(name, values, 0)
        self.stored = {name: Stored(name, values.shape, values.dtype) for name, values in self._arrays.items()}

    def _add(self, name: str, values: Any, depth: int) -> None:
        """Store the variable `name` if it is an array of numbers or text. The fields of a struct are stored as
        "name/field"; anything else is added to `not_read`. `depth` counts the structs around the variable."""
        is_array = type(values) is np.ndarray
        if is_array and values.dtype.names and values.size == 1 and depth < MOST_NESTED:
            for field in values.dtype.names:
                self._add(f"{name}/{field}", values.reshape(-1)[0][field], depth + 1)
        elif is_array and values.dtype.kind in "biufcU" and values.size:
            self._arrays[name] = _texts(values) if values.dtype.kind == "U" else values
        else:
            kind = "empty dataset" if is_array and not values.size else "cell, object or struct array"
            self.not_read.setdefault(kind, []).append(name)

    def read(self, name: str) -> np.ndarray:
        return self._arrays[name]

    def positions(self, name: str, order: Order) -> ArrayLike:
        return ordered(self._arrays[name], order)

    def notes(self, name: str) -> JsonMapping:
        return {}

    def labels(self, name: str) -> Sequence[str]:
        return ()


def _texts(values: np.ndarray) -> np.ndarray:
    """Return rows of text as UTF-8; a single row as one text."""
    texts = np.char.encode(values, "utf-8")
    return texts.reshape(()) if texts.size == 1 else texts
