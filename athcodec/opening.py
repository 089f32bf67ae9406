"""Opening of .ath files: `athcodec.open`."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import cast

from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.container import Limits
from athcodec.decoding.decoder import Decoder
from athcodec.decoding.file_bytes import Openable
from athcodec.decoding.host_mesh import HostMesh
from athcodec.errors import ClipError
from athcodec.motion.units import stated_scene


def open(
    path: Openable,
    *,
    clip: str | None = None,
    strict: bool = False,
    allow_partial: bool = False,
    limits: Limits | None = None,
    host_mesh: HostMesh | str | os.PathLike[str] | None = None,
    gltf_motion: str | None = None,
) -> Decoder:
    """Open an .ath file for playing one of its clips.

    Parameters
    ----------
    path : str, path-like, bytes or binary file object
        A path, a URL (`pip install "athcodec[remote]"`), the bytes of a file (any buffer, such as a memoryview), or a
        file object, which stays open when the decoder is closed; one that cannot seek is read whole.
    clip : str, optional
        The name of the clip to play; by default the file's first clip.
    strict : bool
        Raise an error for a file that is shorter or longer than its header states.
    allow_partial : bool
        Read the whole file now. If a level is damaged, only the levels before it can be used, and nothing is raised.
    limits : Limits, optional
        The largest sizes, counts and memory that the file may ask for; by default those of FORMAT.md.
    host_mesh : (N, 3) array, MotionClip, str or path-like, optional
        The mesh that is the rest pose, for files that do not hold one (`encode`, host_rest): positions in the source's
        order (see AthFile.set_host_mesh), or a file of any format that `read` knows, of which the rest pose, or else
        the first frame, is brought to the unit and axes of this file. Without it such a file opens, and says what it
        holds.
    gltf_motion : str, optional
        The name of the motion to open, if the file is a GLB with several motions; "motion 0", "motion 1" and so on if
        they have no names.

    Returns
    -------
    Decoder
        The clip, as an array of positions (frames, vertices, 3). Close it, or use it in a `with` statement.

    Raises
    ------
    FormatError
        If the file cannot be decoded: Truncated, BadChecksum, LimitExceeded ...
    ClipUnavailable
        If no clip has that name.
    ClipError
        If a GLB has no such motion.
    RemoteError, OSError
        If it cannot be read.

    Examples
    --------
    >>> with athcodec.open(athcodec.sample_path("grass"), clip="gale") as gale:
    ...     gale.shape, gale.metadata["unit"], gale.level_within(0.05)
    ((150, 1400, 3), 'm', 0)
    """
    mesh_path = host_mesh if isinstance(host_mesh, (str, os.PathLike)) else None
    mesh = None if mesh_path is not None else cast("HostMesh | None", host_mesh)
    file = AthFile(
        path, strict=strict, allow_partial=allow_partial, limits=limits, host_mesh=mesh, gltf_motion=gltf_motion
    )
    try:
        if mesh_path is not None:
            set_host_mesh_of(file, mesh_path)
        return Decoder(file, clip, closes_file=True)
    except BaseException:
        file.close()
        raise


def set_host_mesh_of(file: AthFile, path: str | os.PathLike[str]) -> None:
    """Read the mesh in `path` in the unit and axes of an .ath file, and set it as the file's rest pose, if the file
    needs one. Raises ClipError, WrongHostMesh, OSError."""
    if not file.needs_host_mesh:
        return
    from athcodec.sources import read  # The sources take long to import, and most files need no mesh.

    scene: dict[str, str] = {}
    for name in ("unit", "up_axis"):
        with suppress(ClipError):  # A file may hold a unit that no source can be brought to.
            scene |= stated_scene({name: file.metadata.get(name)})
    with read(path, **scene) as clip:
        file.set_host_mesh(clip)
