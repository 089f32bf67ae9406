"""Readers: one module per file format, each giving a MotionClip. Nothing here knows .ath files.

`read` finds the format by what a file begins with, then by its suffix, and imports the module of that format and no
other. A module has one function, `read_clip(path, options) -> MotionClip`. Most formats name no branches: the clip has
none then (see motion/branches). Other packages add formats by entry points (registry.py), which are asked last.
"""

from __future__ import annotations

import importlib
import os
import re
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from athcodec.errors import ClipError, GuessWarning, MissingExtra, SourceWarning
from athcodec.files.kinds import HEAD_BYTES, UNKNOWN, kind_of
from athcodec.files.plain import open_plain
from athcodec.files.reading import closing_on_failure, naming_file
from athcodec.motion.clip import NOT_KEPT, MotionClip
from athcodec.motion.positions import Order, parse_order
from athcodec.motion.scene import in_scene
from athcodec.motion.units import checked_axis, checked_unit, size_of, stated_scene
from athcodec.options import MAX_MEMORY, SAMPLES, set_numbers
from athcodec.untyped import JsonMapping, JsonObject

# Kinds of what is not read that are no shapes, or that are not shown as the source stands.
NO_SHAPES = frozenset("Material Camera Light GeomSubset FaceSet SkelAnimation".split()).union(
    "animation attribute element empty extension extras field hidden statement other".split(),
    (
        "animated property",
        "class that nothing inherits",
        "framesPerSecond",
        "inactive",
        "keys outside of the stage's range",
        "layer",
        "metadata",
        "skin that no node of the scene has",
        "variant",
        "warning of USD",
    ),
    (
        "note of a dataset",
        "empty dataset",
        "dataset of references or lists",
        "pickled object",
        "member",
        "sparse matrix",
    ),
    NOT_KEPT.values(),
)
LISTED = 8
MEANINGS = {
    "animation": ' (--takes all, takes="all": a clip of each)',
    "Material": " (names are kept for each face, contents only in a GLB by `encode --into`)",
    "attribute": " (they change in time, do not fit their object, or are of a kind that is not kept)",
}
ATH, ATH_MAGIC = ".ath", b"\x89ATH\r\n\x1a\n"
NO_SOURCES = {
    ATH: (
        "is an .ath file already",
        "athcodec.open opens it, athcodec.write writes other formats of that, athcodec.truncate leaves levels out",
        "`athcodec decode` writes other formats, `athcodec truncate` fewer levels",
    ),
    ".nc": ("is netCDF 3, expected netCDF 4, which is HDF5", *2 * ("`nccopy -k nc4` makes it",)),
    **dict.fromkeys(
        (".vti", ".vtr"),
        ("is a grid without points of its own", *2 * ("in ParaView, Append Datasets makes it a .vtu",)),
    ),
    ".mtg": (
        "holds branches and no motion (MTG)",
        "encode the clip of the same plant by `athcodec encode`, with --hierarchy and this file",
        "encode the clip of the same plant, with --hierarchy and this file",
    ),
}
"""What is no source, by its suffix: what it is, and what to do with it in Python and on the command line."""
_MESHES = (".obj", ".ply")
_VTK = (".vtu", ".vtp", ".vtk", ".vts", ".pvtu", ".pvtp", ".pvts", ".vtm", ".vtpd", ".vtpc")
FRAME_SUFFIXES = (*_MESHES, *_VTK)  # Formats that have one file per frame.
SERIES = ".series"  # The suffix, behind that of the files, of ParaView's indices in JSON.
NUMBER_PATTERN = re.compile(r"([^#%]*)(#+|%0?(\d?)d)([^#%]*)", re.DOTALL)


class RestFields(TypedDict, total=False):
    """The fields of a MotionClip that make its rest pose."""

    rest: np.ndarray
    rest_pose: str


@dataclass(frozen=True)
class ReadOptions:
    """Options of `read` for a source. A reader ignores those that have no meaning for its format.

    Parameters
    ----------
    rest : {"auto", "first", "mean"}, optional
        The rest pose: that of the file, else the first frame; the first frame; or the mean of all frames.
    fps : float, optional
        Frames per second: the rate at which curves are sampled, and the rate of a source that states none.
    mesh : path, optional
        The file that has the faces of a point cache, or of the vertices of a plant in MTG.
    field : str, optional
        Name of the displacement that is added to the points of a finite-element result.
    dataset : str, optional
        Path of the array with the positions in HDF5, NumPy and MATLAB files, or of its group.
    axes : str or sequence of str, optional
        The order of that array's axes, by default "frames,vertices,xyz"; "frames,vertices+xyz" where x, y and z of all
        vertices lie in one axis, "vertices,xyz" for a single frame.
    only : sequence of str, optional
        Patterns (fnmatch) of the names of the prims, objects or meshes to read; all by default.
    takes : sequence of str or str, optional
        Names or patterns of a file's animations, each of which becomes a clip of its own in what is read (`split` takes
        them apart), "all" for all of them. By default the one motion that players begin with is read.
    skip : collection of str, optional
        Names of static arrays to leave out.
    root : int or sequence of int, optional
        The vertex, or one per connected component, at which branches that are derived from edges begin.
    allow_outside : bool, optional
        Whether a source may name files outside of its own folder: XDMF, VTK, .series, HDF5 and USD; by default that is
        refused.
    alone : bool, optional
        Whether the named file is read by itself, without files that are numbered like it: lod1.obj beside lod0.obj.
    max_memory : int or str, optional
        Bytes of memory that reading the source may take, or text such as "500MB"; 4 GiB by default: what of it is
        held, and what one frame or one file of it takes besides.

    Raises
    ------
    ValueError
        For values that rest, fps, axes and max_memory cannot have.
    """

    rest: str = "auto"
    fps: float | None = None
    mesh: str | PathLike[str] | None = None
    field: str | None = None
    dataset: str | None = None
    axes: str | Sequence[str] | None = None
    only: Sequence[str] = ()
    takes: Sequence[str] | str = ()
    skip: Collection[str] = ()
    root: int | Sequence[int] | None = None
    allow_outside: bool = False
    alone: bool = False
    max_memory: int = MAX_MEMORY

    def __post_init__(self) -> None:
        """Check the options and bring `max_memory` to bytes. Raises ValueError for a value that an option cannot
        have."""
        if self.rest not in ("auto", "first", "mean"):
            raise ValueError(f'rest: got {self.rest!r}, expected "auto", "first" or "mean"')
        set_numbers(self, reals=("fps",))
        if self.fps is not None and not 0 < self.fps < float("inf"):
            raise ValueError(f"fps: got {self.fps!r}, expected a positive number")
        object.__setattr__(self, "max_memory", size_of(self.max_memory, "max_memory"))
        if self.max_memory < 1:
            raise ValueError(f"max_memory: got {self.max_memory!r}, expected a positive number of bytes")
        if self.axes is not None:
            parse_order(self.axes)

    def rest_fields(self, rest: np.ndarray | None) -> RestFields:
        """Return the fields of a MotionClip that make its rest pose; `rest` is that of the file (N, 3), or None."""
        fields: RestFields = {"rest_pose": "mean" if self.rest == "mean" else "first"}
        if rest is not None and self.rest == "auto":
            fields["rest"] = rest
        return fields

    @property
    def order(self) -> Order | None:
        """The axes as motion/positions.py has them; None where they are not given."""
        return None if self.axes is None else parse_order(self.axes)


@dataclass(frozen=True)
class Format:
    """A file format that can be read or written.

    Parameters
    ----------
    name, title : str
        What a user calls it by, as its module is called, too; and what it is in words.
    suffixes : tuple of str
        Of its files, in lower case, with the dot.
    extra : str, optional
        The optional dependencies of athcodec that it takes.
    needs : tuple of str, optional
        The modules that these install.
    magic : tuple of bytes, optional
        What its files begin with.
    holds_several : bool, optional
        Whether a file can be written with several clips of one plant.
    keeps : tuple of str, optional
        What its files can say of objects besides: "presence", "doubleSided", "subdivisionScheme".
    magic_places : tuple of int, optional
        Where in its files `magic` may stand.
    has_series : bool, optional
        Whether the times of its files may be in an index with the suffix .series behind theirs.
    module : str, optional
        The module with its `read_clip` or `write_clip`, if another package adds it.
    package : str
        The package that adds it; empty for athcodec's own. Its entry point sets it.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    extra: str = ""
    needs: tuple[str, ...] = ()
    magic: tuple[bytes, ...] = ()
    holds_several: bool = False
    keeps: tuple[str, ...] = ()
    has_series: bool = False
    magic_places: tuple[int, ...] = (0,)
    module: str = ""
    package: str = ""

    def begins(self, head: bytes) -> bool:
        """Return whether the first bytes of a file are those of this format."""
        return bool(self.magic) and any(head.startswith(self.magic, place) for place in self.magic_places)

    def ends(self, name: str) -> bool:
        """Return whether the suffix of a file's name, in lower case, is one of this format's."""
        return Path(name.removesuffix(SERIES) if self.has_series else name).suffix in self.suffixes

    @property
    def is_installed(self) -> bool:
        """Whether the packages that it needs are installed."""
        return not self._missing()

    def _missing(self) -> list[str]:
        return [name for name in self.needs if find_spec(name) is None]

    def check(self) -> None:
        """Check that the packages that it needs are installed.

        Raises
        ------
        MissingExtra
            Where one is not; the message says how to install it.
        """
        missing = self._missing()
        if missing:
            package = (self.package or "athcodec") + (f"[{self.extra}]" if self.extra else "")
            title = self.title.partition(": ")[0]
            raise MissingExtra(f'{title}: needs {", ".join(missing)}: pip install "{package}"')

    def function(self, name: str, home: str) -> Callable[..., Any]:
        """Return the function `name` of the module that implements this format. If the format is one of athcodec's own,
        its module is in the package `home` ("athcodec.sources", for example).

        Raises ClipError if the module of another package cannot be imported or has no such function.
        """
        if not self.package:
            return getattr(importlib.import_module(f"{home}.{self.name}"), name)
        try:
            return getattr(importlib.import_module(self.module), name)
        except (ImportError, AttributeError) as error:
            raise ClipError(
                f"{self.title}: {name} of {self.module} cannot be imported: {error}; update or uninstall {self.package}"
            ) from error


FORMATS = (
    Format(
        "hdf5",
        "HDF5 of athcodec's schema or of other programs, VTKHDF, MATLAB 7.3",
        (".h5", ".hdf5", ".hdf", ".vtkhdf"),
        magic=(b"\x89HDF\r\n\x1a\n",),
        magic_places=(0, 512, 1024, 2048),
    ),
    Format("npz", "NumPy archive, of the same schema or of other programs", (".npz",)),
    Format("npy", "NumPy array of positions", (".npy",), magic=(b"\x93NUMPY",)),
    Format("mat", "MATLAB up to 7.2", (".mat",), "matlab", ("scipy",), (b"MATLAB 5.0 MAT-file",)),
    Format(
        "usd",
        "USD: meshes, curves and points, UsdSkel",
        (".usd", ".usdc", ".usda", ".usdz"),
        "usd",
        ("pxr",),
        (b"PXR-USDC", b"#usda"),
    ),
    Format("gltf", "glTF: skins, nodes and morph targets", (".glb", ".gltf"), magic=(b"glTF",)),
    Format("alembic", "Alembic: meshes, curves and points", (".abc",), "alembic", ("alembic3d",), (b"Ogawa",)),
    Format("pc2", "PC2 point cache; its mesh by --mesh", (".pc2",), magic=(b"POINTCACHE2\0",)),
    Format("mdd", "MDD point cache; its mesh by --mesh", (".mdd",)),
    Format("sequence", "OBJ or PLY: numbered files, or their .series", _MESHES, has_series=True),
    Format("xdmf", "XDMF time series", (".xdmf", ".xmf")),
    Format("vtk", "VTK: numbered files, or their .pvd or .series", (*_VTK, ".pvd"), has_series=True),
)


def formats() -> Iterator[Format]:
    """Yield the formats that can be read: athcodec's own, and then those of other packages, which are searched for only
    if somebody asks for more."""
    yield from FORMATS
    yield from _others()


def _others() -> tuple[Format, ...]:
    from athcodec.sources.registry import registered  # It imports this module.

    return registered(__name__)[len(FORMATS) :]


def read(
    path: str | PathLike[str],
    format: str | None = None,
    *,
    unit: str | None = None,
    up_axis: str | None = None,
    **options: Any,
) -> MotionClip:
    """Open the clip in a file of any known format.

    Parameters
    ----------
    path : str or path
        The file. For numbered files, pass any one of them, or a name with # or %04d in place of the number.
    format : str, optional
        Name of one of `athcodec.sources.formats()`. By default the format is found by what the file begins with, then
        by its suffix.
    unit : str, optional
        A unit of length ("m", "cm", "mm", "km", "in", "ft"). A clip in another unit is converted. A clip that states
        no unit is taken to be in this one, as is, with a GuessWarning, a clip that states an unknown unit.
    up_axis : {"x", "y", "z"}, optional
        The axis that points up: a clip with another up axis is turned, one that states none is taken to have this one.
    **options
        Parameters of `athcodec.sources.ReadOptions`: rest, fps, mesh, field, dataset, axes, only, takes, skip, root,
        allow_outside, alone, max_memory.

    Returns
    -------
    MotionClip
        Close it, or use it in a ``with`` statement; frames are read from the file when they are asked for. Its
        `not_read` names what else the file holds; a SourceWarning names what of that would be visible.

    Raises
    ------
    ClipError
        If the file holds no usable clip, or states an unknown unit or up axis that the caller does not override, or
        if `unit` or `up_axis` is none of the values above.
    MissingExtra
        If a package is missing that the format needs.
    OSError
        If the file cannot be opened.
    ValueError
        If the format does not exist, or an option has a value that it cannot have.
    TypeError
        If an option does not exist.
    """
    wanted = ReadOptions(**options)
    unit = None if unit is None else checked_unit(unit)
    up_axis = None if up_axis is None else checked_axis(up_axis)
    with naming_file(path):
        kind = find_format(path) if format is None else format_named(format, formats())
        kind.check()
        clip: MotionClip = kind.function("read_clip", __name__)(path, wanted)
    lost = {kind: names for kind, names in clip.not_read.items() if kind not in NO_SHAPES}
    with closing_on_failure(clip):
        if clip.frame_count == 1 and not kind.has_series and not wanted.alone:
            _warn_of_frames(path)
        if lost:
            warnings.warn(f"{os.fspath(path)}: not read: {listed(lost)}", SourceWarning, stacklevel=2)
        clip.metadata |= _stated(clip.metadata, path, unit=unit, up_axis=up_axis)
        return in_scene(clip, unit, up_axis)


def _warn_of_frames(path: str | PathLike[str]) -> None:
    """Warn of a file whose format has all frames in one file, where others beside it are numbered like frames."""
    from athcodec.sources.numbering import some  # They import this module.
    from athcodec.sources.one_frame import numbered_beside

    if others := numbered_beside(path):
        warnings.warn(
            f"{os.fspath(path)}: read as one frame, without {some(others)}: numbered files of this format are not read "
            "as one motion; write all frames into one file, or numbered OBJ, PLY or VTK files",
            GuessWarning,
            stacklevel=3,
        )


def listed(not_read: Mapping[str, Sequence[str]]) -> str:
    """Return motionclip.not_read in words: each kind once, with its first names."""
    return "; ".join(
        f"{kind} {', '.join(names[:LISTED])}{f' and {len(names) - LISTED} more' if len(names) > LISTED else ''}"
        f"{MEANINGS.get(kind, '')}"
        for kind, names in not_read.items()
    )


def besides(not_read: Mapping[str, Sequence[str]]) -> str:
    """Return the end of an error about a source of which nothing can be read: what it holds instead."""
    return f"; not read: {listed(not_read)}" if not_read else ""


def is_pattern(path: str | PathLike[str]) -> bool:
    """Return whether a path stands for numbered files, by # or %04d in its name, and is none itself."""
    return NUMBER_PATTERN.fullmatch(Path(path).name) is not None and not os.path.exists(path)


def format_named(name: str, formats: Iterable[Format]) -> Format:
    """Return the one of `formats` with this name. Raises ValueError."""
    known = []
    for candidate in formats:
        if candidate.name == name:
            return candidate
        known.append(candidate.name)
    raise ValueError(f"format: got {name!r}, expected one of {', '.join(known)}")


def format_by_suffix(path: str | PathLike[str], formats: Iterable[Format], content: str = UNKNOWN) -> Format:
    """Return the first of `formats` that has the suffix of `path`. `content` says what the file looks like by its first
    bytes, for the message of the error. Raises ClipError if no format has the suffix."""
    name, candidates = Path(path).name.lower(), iter(formats)
    known: list[str] = []
    for candidate in candidates:
        if candidate.ends(name):
            _warn_of_others(path, candidate, candidates)
            return candidate
        known += candidate.suffixes
    looks = "" if content == UNKNOWN else f" (it looks like {content})"
    hint = f"; an index has the suffix of its files, too: NAME.vtu{SERIES}" if name.endswith(SERIES) else ""
    raise ClipError(f"{os.fspath(path)}: got an unknown format{looks}, expected one of {' '.join(known)}{hint}")


def _warn_of_others(path: str | PathLike[str], chosen: Format, others: Iterable[Format]) -> None:
    """Give a GuessWarning if the chosen format comes from another package and formats among `others` have the suffix of
    `path`, too."""
    name = Path(path).name.lower()
    if chosen.package and (same := [other for other in others if other.ends(name)]):
        names = " and ".join(f"{other.name} of {other.package}" for other in same)
        warnings.warn(
            f"{os.fspath(path)}: {Path(name).suffix} is taken for {chosen.name} of {chosen.package}, not for {names}; "
            "--source-format or --format (format=) names another",
            GuessWarning,
            stacklevel=4,
        )


def find_format(path: str | PathLike[str]) -> Format:
    """Return the format of the file at `path`, which its first bytes tell, or else its suffix. Raises ClipError if no
    format fits or the file is empty, OSError if it cannot be opened."""
    if is_pattern(path):
        head = b"#"
    else:
        if os.path.isdir(path):
            if any(os.path.exists(os.path.join(path, name)) for name in ("zarr.json", ".zarray", ".zgroup")):
                raise ClipError(
                    f"{os.fspath(path)}: is a zarr store, expected a file; in Python, athcodec.encode takes one of its "
                    "arrays"
                )
            raise ClipError(
                f"{os.fspath(path)}: is a folder, expected a file: any one of numbered files stands for all, and "
                "`athcodec batch` encodes many clips"
            )
        with open_plain(path) as file:
            head = file.read(HEAD_BYTES)
    if not head:
        raise ClipError(f"{os.fspath(path)}: got an empty file, expected a clip")
    if head.startswith(ATH_MAGIC):
        raise _no_source(path, ATH)
    for candidates in (lambda: FORMATS, _others):  # Others are searched for only if it is none of athcodec's own.
        known = candidates()
        if kind := _by_first_bytes(head, known):
            return kind
        with suppress(ClipError):
            return format_by_suffix(path, known)
    if (suffix := Path(path).suffix.lower()) in NO_SOURCES:
        raise _no_source(path, suffix)
    return format_by_suffix(path, formats(), "" if is_pattern(path) else kind_of(path))


def _no_source(path: str | PathLike[str], suffix: str) -> ClipError:
    message, python, shell = NO_SOURCES[suffix]
    return ClipError(f"{os.fspath(path)}: {message}", python=python, shell=shell)


def _by_first_bytes(head: bytes, formats: Iterable[Format]) -> Format | None:
    return next((candidate for candidate in formats if candidate.begins(head)), None)


def _stated(metadata: JsonMapping, path: str | PathLike[str], **wanted: str | None) -> JsonObject:
    """Return the unit and the up axis that the metadata of the file `path` state.

    `wanted` has the caller's options "unit" and "up_axis", None for one that was not passed. A stated value that
    athcodec does not know becomes None if the caller passed that option; otherwise it raises ClipError.
    """
    scene: JsonObject = {}
    for name, option in wanted.items():
        try:
            scene |= stated_scene({name: metadata.get(name)})
        except ClipError as error:
            words = f"--{name.replace('_', '-')} ({name}=)"
            if option is None:
                raise ClipError(f"{os.fspath(path)}: {error}; {words} says which one is meant") from None
            warnings.warn(
                f"{os.fspath(path)}: {error}; taken for {option!r}, as {words} says", GuessWarning, stacklevel=3
            )
            scene[name] = None
    return scene


def read_hdf5(path: str | PathLike[str], rest: str = "auto", **options: Any) -> MotionClip:
    """Open the clip in an HDF5 file of athcodec's schema.

    Parameters
    ----------
    path : str or path
        The file; `athcodec.sources.hdf5` says which datasets it has.
    rest : {"auto", "first", "mean"}, optional
        The rest pose: that of the file, else the first frame; the first frame; or the mean of all frames.
    **options
        Further parameters of `read`.

    Returns
    -------
    MotionClip
        Close it, or use it in a ``with`` statement.

    Raises
    ------
    ClipError
        Where the file is not HDF5 or holds no usable clip.
    OSError
        Where the file cannot be opened.
    """
    return read(path, "hdf5", rest=rest, **options)


def sample_path(name: str = "tree") -> Path:
    """Return the path of a sample clip that is installed with athcodec.

    Parameters
    ----------
    name : {"tree", "growth", "leafed", "fern", "grass"}, optional
        "tree" is a small finite-element tree in wind, "growth" a young tree that grows and gets leaves; "leafed" (a
        tree with leaves), "fern" and "grass" (a tuft) each move in a calm wind and in a gale.

    Returns
    -------
    pathlib.Path
        "tree" and "growth" are HDF5 files of athcodec's schema, with 120 frames of 1,001 and 1,476 vertices. The other
        three are .ath files of two loops of 150 frames, with 54,920, 2,844 and 1,400 vertices.

    Raises
    ------
    ValueError
        If there is no sample of that name.
    """
    files = {name_of_sample: f"{name_of_sample}_1k_120f.h5" for name_of_sample in SAMPLES} | {
        "leafed": "leafed_tree.ath",
        "fern": "fern.ath",
        "grass": "grass.ath",
    }
    if name not in files:
        raise ValueError(f"sample: got {name!r}, expected one of {', '.join(files)}")
    return Path(__file__).resolve().parent.parent / "sample" / files[name]
