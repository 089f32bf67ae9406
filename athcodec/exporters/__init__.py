"""Writers: one module per file format, mirroring sources/. Nothing here knows how .ath files are coded.

`write` imports the module of the wanted format and no other. A module has one function,
`write_clip(motion, path, options, report)`, where `motion` is a MotionClip or a ClipView of an .ath file. It returns
None, or what there is to know of the files: see Written. Other packages add formats by entry points, as in sources/.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from athcodec.decoding.clip_view import ClipView
from athcodec.decoding.decoder import Decoder
from athcodec.errors import ClipError, CoarseWarning
from athcodec.exporters.placing import in_singles
from athcodec.exporters.samples import with_samples
from athcodec.exporters.scene_objects import NOT_WRITTEN, not_written
from athcodec.files.atomic import check_target, keeping
from athcodec.files.kinds import add_kind, kind_by_suffix
from athcodec.motion.protocol import Motion
from athcodec.options import COARSE_SHARE, set_numbers
from athcodec.sources import ATH, Format, format_by_suffix, format_named
from athcodec.sources import FORMATS as SOURCE_FORMATS
from athcodec.sources.registry import registered
from athcodec.untyped import JsonObject

Report = Callable[[str, float], None]
Progress = Callable[[float], None]
MOST_RIGGED = 65535
MOST_SAMPLES = 1000  # Samples of a frame interval.
RIGS = ("usd", "gltf")
BLURRED = ("usd", "alembic")  # Formats whose programs blur motion by samples between frames, or by velocities.
HAVE_TRANSFORMS = ("usd", "gltf", "alembic")  # They hold the place of a plant that is far from the origin.
SINGLES = (*HAVE_TRANSFORMS, "pc2", "mdd")  # Formats whose points are float32.
KEPT = ("presence", "doubleSided", "subdivisionScheme")
FILES = "files"  # in what write_clip returns: the names of the files where they are not the one that was asked for


@dataclass(frozen=True)
class WriteOptions:
    """Options of `write` for a file. A writer ignores those that have no meaning for its format.

    Parameters
    ----------
    gzip : bool, optional
        Compress without loss where the format can.
    animation : {"auto", "joints", "morphs"}, optional
        How glTF moves: by joints, by morph targets, or by the one that keeps the error, the smaller if both do.
    half : bool, optional
        Textures in half precision in place of float.
    instances : bool, optional
        Copies of one shape (MotionClip, part_copies) as instances of USD and Alembic and nodes of glTF that show one
        mesh, where transforms are off by no more than the level is; else, and by default, as vertices.
    rig : int, optional
        For USD and glTF: a skeleton for engines, with so many joints at most besides its root, in place of vertices. It
        is as close as that many allow; `Written` says how close, and a CoarseWarning where that is above 1 % of the
        rest pose's diagonal.
    nanite : bool, optional
        For USD with a rig: laid out as Nanite Assemblies of Unreal Engine 5.7, with copies of one shape as instances on
        the joints, and the JSON of Dynamic Wind beside it. This was not run in Unreal.
    samples : int, optional
        For USD and Alembic: samples of each frame interval, of which the first is the frame. Between frames vertices go
        along straight lines, as players show them.
    velocities : bool, optional
        For USD and Alembic: the velocity of every vertex at every sample, in lengths per second, as central differences
        of the positions that are written. It takes as many bytes as the positions.

    Raises
    ------
    ValueError
        For another animation, nanite without a rig, samples or velocities with one, or no usable number.
    """

    gzip: bool = False
    animation: str = "auto"
    half: bool = True
    instances: bool = False
    rig: int | None = None
    nanite: bool = False
    samples: int = 1
    velocities: bool = False

    def __post_init__(self) -> None:
        """Check the options against each other and against their limits. Raise ValueError for a value that is not
        allowed.
        """
        set_numbers(self, wholes=("rig", "samples"))
        if self.rig is not None and not 1 <= self.rig <= MOST_RIGGED:
            raise ValueError(f"rig: got {self.rig!r}, expected 1 to {MOST_RIGGED} joints")
        if self.nanite and self.rig is None:
            raise ValueError("nanite: got no rig, expected one too")
        if not 1 <= self.samples <= MOST_SAMPLES:
            raise ValueError(f"samples: got {self.samples!r}, expected 1 to {MOST_SAMPLES} in each frame interval")
        for name in self.blur if self.rig is not None else ():
            raise ValueError(f"{name}: got a rig too, whose joints move the vertices; expected one of both")
        if self.animation not in ("auto", "joints", "morphs"):
            raise ValueError(f'animation: got {self.animation!r}, expected "auto", "joints" or "morphs"')

    @property
    def blur(self) -> list[str]:
        """The options for motion blur that are in use."""
        return [name for name, is_used in (("samples", self.samples > 1), ("velocities", self.velocities)) if is_used]


FORMATS = (
    Format("hdf5", "HDF5 of athcodec's schema", (".h5", ".hdf5", ".hdf"), keeps=KEPT),
    Format("npz", "NumPy archive of the same schema", (".npz",), keeps=KEPT),
    Format("usd", "USD: time-sampled points", (".usd", ".usdc", ".usda", ".usdz"), "usd", ("pxr",), keeps=KEPT),
    Format("gltf", "glTF: joints or morph targets", (".glb",), holds_several=True, keeps=("doubleSided",)),
    Format("alembic", "Alembic: samples of points", (".abc",), "alembic", ("alembic3d",), keeps=("presence",)),
    Format("pc2", "PC2 point cache", (".pc2",)),
    Format("mdd", "MDD point cache", (".mdd",)),
    Format("sequence", "numbered OBJ or PLY files", (".obj", ".ply")),
    Format("xdmf", "XDMF time series", (".xdmf", ".xmf")),
    Format("vtk", "VTU series with a PVD index", (".pvd", ".vtu")),
    Format("vat", "vertex animation textures: node matrices", (".vat",), "vat", ("OpenEXR",)),
    Format("openvat", "vertex animation textures: positions, as OpenVAT has them", (".openvat",), "vat", ("OpenEXR",)),
)


@dataclass(frozen=True, repr=False)
class Written:
    """The result of `write`.

    Parameters
    ----------
    files : tuple of pathlib.Path
        The files that hold the clip, in the order of their frames; one, the path that was given, of most formats.
    facts : dict
        What a format costs that does not hold positions as they are: "max_error" in the clip's unit, and more.
        "samples" is the number of samples where frames have several;
        "rounding" is by how much float32 moves a vertex of float64 at most, if the format has float32 alone;
        "not_written" names what the format has no place for, by kind. Empty of others.
    """

    files: tuple[Path, ...]
    facts: JsonObject = field(default_factory=dict)

    def __repr__(self) -> str:
        first, *others = map(os.fspath, self.files)
        names = f"{1 + len(others):,} files, {first!r} to {others[-1]!r}" if others else repr(first)
        facts = "".join(f", {name} {value:.3g}" for name, value in self.facts.items() if isinstance(value, float))
        return f"<Written: {names}{facts}>"


def formats() -> Iterator[Format]:
    """Yield the formats that can be written: athcodec's own, and then those of other packages, which are searched for
    only if somebody asks for more."""
    yield from FORMATS
    yield from registered(__name__)[len(FORMATS) :]


def write(
    motion: Motion | Decoder,
    path: str | PathLike[str],
    format: str | None = None,
    *,
    progress: Report | None = None,
    **options: Any,
) -> Written:
    """Write a motion to a file of any known format, which appears under its name only when it is complete.

    Parameters
    ----------
    motion : MotionClip, ClipView or Decoder
        A clip, frames of an .ath file at some level, or all frames of it at the deepest.
    path : str or path
        The file to write; formats of one file per frame number their files by it. An older file of the same kind, or
        an empty one, is replaced, unless `motion` reads it.
    format : str, optional
        Name of one of `athcodec.exporters.formats()`; known by the suffix by default.
    progress : callable, optional
        Called with "export" and the fraction that is done.
    **options
        Parameters of `athcodec.exporters.WriteOptions`: gzip, animation, half, instances, rig, nanite, samples,
        velocities.

    Returns
    -------
    Written
        The files, and what they cost in error.

    Raises
    ------
    ClipError
        Where the format is not known, or cannot hold the clip or several clips.
    MissingExtra
        Where a package is missing that the format needs.
    OSError
        Where the file cannot be written.
    ValueError
        For a format or values of options that do not exist.
    TypeError
        For options that do not exist.
    """
    wanted = WriteOptions(**options)
    motion = ClipView(motion) if isinstance(motion, Decoder) else motion
    if not hasattr(motion, "blocks"):
        raise TypeError(
            f"write: got {type(motion).__name__}, expected a MotionClip, a decoder or a ClipView; "
            "athcodec.MotionClip(positions) makes a clip of an array, athcodec.read that of a file"
        )
    kind = format_to_write(path, format)
    kind.check()
    if wanted.rig is not None and kind.name not in RIGS:
        raise ClipError(f"rig: got {kind.name}, expected one of {', '.join(RIGS)}")
    if wanted.nanite and kind.name != "usd":
        raise ClipError(f"nanite: got {kind.name}, expected usd")
    if wanted.blur and kind.name not in BLURRED:
        raise ClipError(f"{wanted.blur[0]}: got {kind.name}, expected one of {', '.join(BLURRED)}")
    if wanted.rig is None:
        _check_clips(motion, kind)
    report = progress or (lambda phase, fraction: None)
    with keeping(getattr(motion, "inputs", ())):
        if kind.package:
            add_kind(kind.title, kind.suffixes, kind.magic)
        check_target(path, kind.suffixes[0])
        write_clip = kind.function("write_clip", __name__)
        is_rounded = kind.name in SINGLES and motion.dtype == np.float64
        sampled = motion if wanted.samples == 1 else with_samples(motion, wanted.samples)
        rounded = in_singles(sampled, kind.name in HAVE_TRANSFORMS) if is_rounded else None
        facts = dict(write_clip(rounded or sampled, path, wanted, lambda done: report("export", done)) or {})
        facts |= {"rounding": rounded.rounding} if rounded else {}
        facts |= {"samples": sampled.frame_count} if wanted.samples > 1 else {}
    if lost := not_written(motion, kind.keeps) | facts.get(NOT_WRITTEN, {}):
        facts[NOT_WRITTEN] = lost
    if wanted.rig is not None:
        _object_to_rig(motion, path, wanted.rig, facts)
    names = facts.pop(FILES, [Path(path).name])
    return Written(tuple(Path(path).with_name(name) for name in names), facts)


def _object_to_rig(motion: Motion, path: str | PathLike[str], most: int, facts: JsonObject) -> None:
    """Warn the caller of `write` if the skeleton's motion is far from the clip's. `most` is the largest number of
    joints allowed, and `facts` has what the writer reports, with the error among it.
    """
    diagonal, error = float(np.linalg.norm(np.ptp(motion.rest, axis=0))), facts["max_error"]
    if not error > COARSE_SHARE * diagonal > 0:
        return
    unit = f" {motion.metadata['unit']}" if motion.metadata.get("unit") else ""
    advice = "more joints come no closer to this motion"
    if facts["joints"] >= most < MOST_RIGGED:
        more = min(4 * most, MOST_RIGGED)
        advice = f"more joints come closer, such as --rig {more} (rig={more})"
    warnings.warn(
        f"{os.fspath(path)}: the skeleton is off by {error:.3g}{unit}, {100 * error / diagonal:.2g} % of the diagonal "
        f"of the rest pose; expected at most {100 * COARSE_SHARE:g} %: {advice}; without a skeleton the vertices "
        "themselves are written",
        CoarseWarning,
        stacklevel=3,
    )


def format_to_write(path: str | PathLike[str], format: str | None = None) -> Format:
    """Return the format named `format`, or without a name the format of the path's suffix. Raise ClipError if the
    suffix is unknown, ValueError if the name is.
    """
    if format is not None:
        return format_named(format, formats())
    if Path(path).suffix.lower() == ATH:
        raise ClipError(
            f"{os.fspath(path)}: is the name of an .ath file, expected that of another format",
            python="athcodec.encode writes .ath files, athcodec.truncate shortens them",
            shell="`athcodec encode` writes .ath files, `athcodec truncate` shortens them",
        )
    _object_to_read_only(path)
    return format_by_suffix(path, formats())


def _object_to_read_only(path: str | PathLike[str]) -> None:
    """Raise ClipError if the suffix of a path belongs to a format that is read but not written."""
    suffix = Path(path).suffix.lower()
    source = next((kind for kind in SOURCE_FORMATS if suffix in kind.suffixes), None)
    if source is None or any(suffix in kind.suffixes for kind in formats()):
        return
    family = [kind for kind in FORMATS if kind.name == source.name] or FORMATS
    expected = " ".join(suffix for kind in family for suffix in kind.suffixes)
    raise ClipError(f"{os.fspath(path)}: got {suffix}, which is read and not written, expected one of {expected}")


def check_ath_name(path: str | PathLike[str]) -> None:
    """Raise ClipError if the suffix of a path belongs to another format than .ath files. Any unknown suffix is
    accepted.
    """
    suffix = Path(path).suffix.lower()
    title = next((kind.title for kind in FORMATS if suffix in kind.suffixes), None)
    promised = kind_by_suffix(suffix) or title
    if promised not in (None, ATH):
        raise ClipError(
            f"{os.fspath(path)}: is a name for {promised}, expected one that ends in {ATH}",
            python="athcodec.write writes other formats, of a clip or a decoder",
            shell="`athcodec decode` writes other formats, of an .ath file",
        )


def _check_clips(motion: Motion, kind: Format) -> None:
    """Raise ClipError if a motion has several clips and the format holds only one."""
    clip_ranges = getattr(motion, "clip_ranges", ())
    if len(clip_ranges) > 1 and not kind.holds_several:
        names = ", ".join(clip_range.name for clip_range in clip_ranges)
        suffixes = " ".join(suffix for other in formats() if other.holds_several for suffix in other.suffixes)
        raise ClipError(
            f"{kind.name}: got several clips, {names}; expected one of them with --clip (in Python by "
            f"athcodec.open or athcodec.split), or {suffixes}, which holds all"
        )


def write_hdf5(clip: Motion | Decoder, path: str | PathLike[str], gzip: bool = False) -> None:
    """Write a motion to an HDF5 file of athcodec's schema, which appears under its name only when it is complete.

    Parameters
    ----------
    clip : MotionClip, ClipView or Decoder
        Or anything with time, vertex_branch, branch_parent, rest, dtype and blocks() like them.
    path : str or path
        The file to write.
    gzip : bool, optional
        Compress without loss: smaller and slower.

    Raises
    ------
    ClipError
        Where the arrays make no clip.
    OSError
        Where the file cannot be written.
    """
    write(clip, path, "hdf5", gzip=gzip)
