"""Readers: one module per file format, each giving a MotionClip. Nothing here knows .ath files.

`read` finds the format by what a file begins with, then by its suffix, and imports the module of that format and no
other. A module has one function, `read_clip(path, options) -> MotionClip`. Most formats name no branches: the clip has
none then (see discovery.py).
"""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from os import PathLike
from pathlib import Path

import numpy as np

from athcodec.clip import MotionClip
from athcodec.errors import ClipError, MissingExtra
from athcodec.sources.frames import Frames
from athcodec.sources.opening import closing_on_failure
from athcodec.units import METRES, unit_symbol

HEAD_BYTES = 4096
NUMBER_PATTERN = re.compile(r"([^#%]*)(#+|%0?(\d?)d)([^#%]*)", re.DOTALL)


@dataclass(frozen=True)
class ReadOptions:
    """What a user may say about a source. A reader ignores what has no meaning for its format.

    rest   "auto" (the file's rest pose, else the first frame), "first", or "mean" (of all frames)
    fps    frames per second: the rate at which curves are sampled; the rate of a source that states none
    mesh   the file that has the faces of a point cache, a hierarchy's MTG ...
    field  name of the displacement that is added to the points of a finite-element result
    only   patterns (fnmatch) of the names of the prims, objects or meshes to read; () reads all
    takes  names or patterns of a file's animations, each of which is a clip of its own in what is read (joining.py has
           `split`), "all" of them; () reads the one motion that players begin with
    skip   names of static arrays to leave out
    root   the vertex, or one per connected part, at which branches derived from edges begin
    """

    rest: str = "auto"
    fps: float | None = None
    mesh: str | PathLike[str] | None = None
    field: str | None = None
    only: Sequence[str] = ()
    takes: Sequence[str] | str = ()
    skip: Collection[str] = ()
    root: int | Sequence[int] | None = None

    def __post_init__(self) -> None:
        if self.rest not in ("auto", "first", "mean"):
            raise ValueError(f'rest: got {self.rest!r}, expected "auto", "first" or "mean"')
        if self.fps is not None and not 0 < self.fps < float("inf"):
            raise ValueError(f"fps: got {self.fps!r}, expected a positive number")


@dataclass(frozen=True)
class Format:
    """A file format: `needs` are the importable modules that `extra` installs, `magic` what its files begin with;
    `holds_several` clips of one plant, as far as they are written."""

    name: str
    title: str
    suffixes: tuple[str, ...]
    module: str
    extra: str = ""
    needs: tuple[str, ...] = ()
    magic: tuple[bytes, ...] = ()
    holds_several: bool = False

    @property
    def is_installed(self) -> bool:
        return not self._missing()

    def _missing(self) -> list[str]:
        return [name for name in self.needs if find_spec(name) is None]

    def check(self) -> None:
        """Raises MissingExtra where a package that this format needs is not installed."""
        missing = self._missing()
        if missing:
            raise MissingExtra(f'{self.title}: needs {", ".join(missing)}: pip install "athcodec[{self.extra}]"')


FORMATS = (
    Format("hdf5", "HDF5 of athcodec's schema", (".h5", ".hdf5", ".hdf"), "athcodec.sources.hdf5",
           magic=(b"\x89HDF\r\n\x1a\n",)),
    Format("npz", "NumPy archive of the same schema", (".npz",), "athcodec.sources.npz"),
    Format("usd", "USD: meshes, curves and points, UsdSkel", (".usd", ".usdc", ".usda", ".usdz"),
           "athcodec.sources.usd", "usd", ("pxr",), (b"PXR-USDC", b"#usda")),
    Format("gltf", "glTF: skins, nodes and morph targets", (".glb", ".gltf"), "athcodec.sources.gltf",
           magic=(b"glTF",)),
    Format("alembic", "Alembic: meshes, curves and points", (".abc",), "athcodec.sources.alembic", "alembic",
           ("alembic3d",), (b"Ogawa",)),
    Format("pc2", "PC2 point cache; its mesh by --mesh", (".pc2",), "athcodec.sources.pc2", magic=(b"POINTCACHE2\0",)),
    Format("mdd", "MDD point cache; its mesh by --mesh", (".mdd",), "athcodec.sources.mdd"),
    Format("sequence", "numbered OBJ or PLY files, named by any one of them", (".obj", ".ply"),
           "athcodec.sources.sequence"),
    Format("xdmf", "XDMF time series", (".xdmf", ".xmf"), "athcodec.sources.xdmf"),
    Format("vtk", "VTU, VTK (with athcodec[mesh]) or PVD series, named by any one of its files",
           (".vtu", ".vtk", ".pvd"), "athcodec.sources.vtk"),
)


def read(path: str | PathLike[str], format: str | None = None, *, unit: str | None = None,
         up_axis: str | None = None, **options: object) -> MotionClip:
    """Open the clip in `path`; close it, or use it in a `with` statement.

    format     the name of one of FORMATS; None: known by the file's content, then by its suffix
    unit       a unit of length: a clip that has another is converted, one that has none is taken to be in it
    up_axis    "x", "y" or "z", likewise: a clip with another is turned
    options    see ReadOptions

    Raises ClipError where the file is no usable clip, MissingExtra where a package is missing, OSError where it cannot
    be opened, ValueError for options that do not exist.
    """
    wanted = ReadOptions(**options)
    kind = find_format(path) if format is None else format_named(format, FORMATS)
    kind.check()
    clip = importlib.import_module(kind.module).read_clip(path, wanted)
    with closing_on_failure(clip):
        return _in_axes(_in_units(clip, unit), up_axis)


def is_pattern(path: str | PathLike[str]) -> bool:
    """Whether a path is no file and stands for numbered ones, with # or %04d in its name."""
    return NUMBER_PATTERN.fullmatch(Path(path).name) is not None and not os.path.exists(path)


def format_named(name: str, formats: Sequence[Format]) -> Format:
    for candidate in formats:
        if candidate.name == name:
            return candidate
    raise ValueError(f"format: got {name!r}, expected one of {', '.join(candidate.name for candidate in formats)}")


def format_by_suffix(path: str | PathLike[str], formats: Sequence[Format]) -> Format:
    """The first of `formats` that has the suffix of a path. Raises ClipError."""
    suffix = Path(path).suffix.lower()
    for candidate in formats:
        if suffix in candidate.suffixes:
            return candidate
    known = " ".join(suffix for candidate in formats for suffix in candidate.suffixes)
    raise ClipError(f"{os.fspath(path)}: got an unknown format, expected one of {known}")


def find_format(path: str | PathLike[str]) -> Format:
    """The format of a file, by its first bytes or else its suffix. Raises ClipError, OSError."""
    if is_pattern(path):
        head = b"#"
    else:
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES)
    if not head:
        raise ClipError(f"{os.fspath(path)}: got an empty file, expected a clip")
    for candidate in FORMATS:
        if head.startswith(candidate.magic or ()):
            return candidate
    return format_by_suffix(path, FORMATS)


def _in_units(clip: MotionClip, unit: str | None) -> MotionClip:
    if unit is None:
        return clip
    unit = unit_symbol(unit)
    before = unit_symbol(clip.metadata.get("unit") or unit)
    if before != unit and not (before in METRES and unit in METRES):
        raise ClipError(f"unit: got a clip in {before!r}, expected one of {', '.join(METRES)} to convert it to "
                        f"{unit!r}")
    factor = 1.0 if before == unit else METRES[before] / METRES[unit]
    return _mapped(clip, np.eye(3) * factor, unit=unit)


def _in_axes(clip: MotionClip, up_axis: str | None) -> MotionClip:
    """Turned by the right angle that takes one axis to the other."""
    if up_axis is None:
        return clip
    up_axis = up_axis.lower()
    if up_axis not in ("x", "y", "z"):
        raise ClipError(f'up_axis: got {up_axis!r}, expected "x", "y" or "z"')
    before, after = ("xyz".find(str(name).lower()) for name in (clip.metadata.get("up_axis", up_axis), up_axis))
    if before < 0:
        raise ClipError(f'up_axis: got a clip with {clip.metadata["up_axis"]!r}, expected "x", "y" or "z"')
    turn = np.eye(3)
    if before != after:
        third = 3 - before - after
        turn = np.zeros((3, 3))
        turn[after, before], turn[before, after], turn[third, third] = 1.0, -1.0, 1.0
    return _mapped(clip, turn, up_axis=up_axis)


def _mapped(clip: MotionClip, matrix: np.ndarray, **metadata: str) -> MotionClip:
    clip.metadata |= metadata
    if np.array_equal(matrix, np.eye(3)):
        return clip
    if "normals" in clip.attributes:
        turned = clip.attributes["normals"] @ (matrix / np.cbrt(np.linalg.det(matrix))).T
        clip.attributes["normals"] = turned.astype(clip.attributes["normals"].dtype)
    source, dtype = clip.positions, clip.dtype
    positions = Frames(lambda start, stop: (np.asarray(source[start:stop], np.float64) @ matrix.T).astype(dtype),
                       clip.frame_count, clip.vertex_count, dtype)
    return clip.replace(positions=positions, rest=(clip.rest @ matrix.T).astype(clip.rest_dtype))


def read_hdf5(path: str | PathLike[str], rest: str = "auto", **options: object) -> MotionClip:
    """Open the clip in an HDF5 file of athcodec's schema; see sources/hdf5.py, and `read` for the rest."""
    return read(path, "hdf5", rest=rest, **options)


def sample_path() -> Path:
    """Where the clip that ships with athcodec lies: a small finite-element tree in wind, HDF5, 120 frames."""
    return Path(__file__).resolve().parent.parent / "sample" / "tree_1k_120f.h5"
