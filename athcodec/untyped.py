"""Names for what has no types: values of JSON, keywords that are passed on, and objects of libraries without types.

Each name says what a place in the code holds, where a bare `Any` would leave that open.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

JsonObject: TypeAlias = dict[str, Any]
"""An object of JSON: metadata, facts of a file, records of a batch."""

JsonMapping: TypeAlias = Mapping[str, Any]
"""An object of JSON that is only read."""

JsonValue: TypeAlias = Any
"""Any value of JSON."""

Keywords: TypeAlias = dict[str, Any]
"""Keyword arguments by their names, for a function that checks them itself."""

ArrayLike: TypeAlias = Any
"""An array of NumPy or another library: it has a shape and a dtype, and its rows are read by indexing."""

# One name for each library without types.
AlembicObject: TypeAlias = Any  # alembic3d and imath
DaskObject: TypeAlias = Any  # distributed
FsspecObject: TypeAlias = Any  # A file system of fsspec.
H5Object: TypeAlias = Any  # h5py
PlaywrightObject: TypeAlias = Any
ScipyObject: TypeAlias = Any
UsdObject: TypeAlias = Any  # pxr
