"""`AthFile`, the public face of an opened .ath file, for any number of clips that play it.

Bytes and chunks are in chunk_file.py, clips and levels in file_tables.py, the rest pose and all else that does not move
in static_data.py, and the decoding of segments in segment_decoder.py. Playing a clip is the job of decoder.py.
"""

from __future__ import annotations

import hashlib
import math
import os
from dataclasses import asdict
from typing import Any

import numpy as np

from athcodec._native import WHOLE
from athcodec.decoding import container as ct
from athcodec.decoding.chunk_file import Openable
from athcodec.decoding.container import Limits
from athcodec.decoding.file_tables import Clip
from athcodec.decoding.host_mesh import HostMesh
from athcodec.decoding.segment_decoder import SegmentDecoder
from athcodec.decoding.static_data import StaticData
from athcodec.errors import BadChecksum, BadChunk, ClipError, Truncated
from athcodec.files.atomic import is_url
from athcodec.files.shown import counted, redacted
from athcodec.motion.clip import median_rate
from athcodec.motion.joining import HEADING, STRENGTH, metadata_of, wind_of
from athcodec.motion.presence import stated_presence
from athcodec.motion.thresholds import Thresholds


class AthFile(StaticData, SegmentDecoder):
    """An opened .ath file, for any number of decoders, one per clip; a context manager.

    Arrays are in the source's order of vertices and branches unless stated otherwise, lengths in scene units. Threads
    may share it. Opening reads the prelude; everything else is read when it is asked for.

    Parameters
    ----------
    path : str, path-like, bytes or binary file object
        As for `open`. A path may be that of a GLB with ATH_motion, whose meshes are the host's.
    strict : bool
        Refuse a file that is shorter or longer than its header says.
    allow_partial : bool
        Read all of the file now; a damaged level hides itself and those after it instead of raising.
    limits : Limits, optional
        What the file may ask for; by default those of FORMAT.md.
    host_mesh : array or MotionClip, optional
        The mesh that is the rest pose, for files that do not hold one: see `set_host_mesh`.
    gltf_motion : str, optional
        Name of the motion to open in a GLB that has several; "motion 0" and so on if they have none.

    Attributes
    ----------
    limits : Limits
        What the file may ask for.
    inputs : frozenset
        The files that are read, by device and inode: this one, and those of the host mesh.
    core : core_file.File
        The file as the C core has opened it.
    file_length, prelude_length, available_length : int
        Bytes that the header announces, that stand in front of the motion, and that are there.
    complete : bool
        Whether every byte that the header announces is there.
    bytes_read : int
        Bytes read so far.
    vertex_count, branch_count, frame_count, segment_count : int
        Vertices and branches of the plant, N and B; frames and segments of all clips.
    level_count, full_level_count : int
        Stored levels, 0 to level_count - 1, and levels of the original encoding, which a truncated file has fewer of.
    max_error_bound : float
        Largest distance of any vertex in any frame at the deepest stored level, as promised; scene units.
    dtype : numpy.dtype
        Default type of positions: float32, or float64 if the source's precision needed it.
    origin : (3,) float64 array
        The point that the file's arithmetic is relative to.

    Raises
    ------
    FormatError
        If it cannot be decoded: Truncated, BadChecksum, LimitExceeded ...
    ClipError
        If a GLB has no such motion.
    RemoteError, OSError
        If it cannot be read.

    Examples
    --------
    >>> with athcodec.AthFile(athcodec.sample_path("grass")) as file:
    ...     file.vertex_count, file.branch_count, [clip.name for clip in file.clips]
    (1400, 100, ['calm', 'gale'])
    """

    def __init__(
        self,
        path: Openable,
        *,
        strict: bool = False,
        allow_partial: bool = False,
        limits: Limits | None = None,
        host_mesh: HostMesh | None = None,
        gltf_motion: str | None = None,
    ):
        super().__init__(path, strict, allow_partial, limits, gltf_motion)
        self._place = _place_of(path)
        self._options = {"strict": strict, "allow_partial": allow_partial, "limits": limits, "gltf_motion": gltf_motion}
        info = self.core.info
        self.vertex_count: int = info.vertex_count
        self.branch_count: int = info.branch_count
        self.frame_count: int = info.frame_count
        self.max_error_bound: float = info.max_error
        self.dtype = np.dtype(np.float64 if info.is_float64 else np.float32)
        self.origin = np.array(info.origin[:])
        try:
            if host_mesh is None and self.needs_host_mesh:
                host_mesh = getattr(self.source, "host_mesh", None)
            if host_mesh is not None:
                self.set_host_mesh(host_mesh)
        except BaseException:
            self.close()
            raise

    def __repr__(self) -> str:
        return (
            f"<AthFile {self.name!r}: {counted(self.vertex_count, 'vertex', 'vertices')} on "
            f"{counted(self.branch_count, 'branch', 'branches')}, {counted(self.frame_count, 'frame')} in "
            f"{counted(len(self.clips), 'clip')}, {counted(self.level_count, 'level')}, {self.file_length:,} bytes>"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        if self.is_closed:
            raise ValueError("AthFile: is closed; expected an open file to pickle")
        if not self._closes_source:
            raise TypeError(
                "AthFile: got one of a file object, which only this process has; expected one of a path, a URL or "
                "bytes to pickle"
            )
        place = self.source.getvalue() if self._place is None else self._place
        return _reopened, (type(self), place, self._options | {"host_mesh": self.host_mesh}, self._fingerprint)

    def __enter__(self) -> AthFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _fingerprint(self) -> str:
        """Tells this file from another at the same place, by its front, which has the checksums of all chunks."""
        return hashlib.sha256(self.core.prelude.tobytes()).hexdigest()

    def table1(self) -> dict[str, float]:
        """Return Table 1 of the paper: depth (levels of nodes), nodes, leaves, and the encoder's thresholds."""
        branches = self.branches
        whole, inside = branches["flags"] & WHOLE > 0, np.zeros(len(branches) + 1, np.int64)
        np.add.at(inside, np.flatnonzero(whole) + 1, 1)
        np.add.at(inside, (np.arange(len(branches)) + branches["subtree"])[whole], -1)
        is_node = np.cumsum(inside)[:-1] == 0
        leaf = is_node & (whole | (branches["subtree"] == 1))
        thresholds = Thresholds.of_metadata(self.metadata)
        return {
            "depth": int(branches["depth"][is_node].max()) + 1,
            "nodes": self.core.info.node_count,
            "leaves": int(leaf.sum()),
            **(asdict(thresholds) if thresholds else {}),
        }

    def info(self) -> dict[str, Any]:
        """Return what `athcodec info --json` prints, of the whole file with all its clips."""
        return {
            "vertices": self.vertex_count,
            "frames": self.frame_count,
            "fps": median_rate(self.time[: self.clips[0].frame_count]),
            "branches": self.branch_count,
            "segments": self.segment_count,
            "nodes": self.core.info.node_count,
            "bytes": self.file_length,
            "available_bytes": self.available_length,
            "max_error_bound": self.max_error_bound,
            "predicted_error_share": self._predicted_error_share,
            "complete": self.complete,
            "full_level_count": self.full_level_count,
            "format": "{}.{}".format(*self.core.prelude[8:10]),
            "rest_bytes": sum(chunk.length for chunk in self.chunks if chunk.kind in (ct.REST, ct.REFINED_REST)),
            "host_mesh": None if self.host_checksum is None else {"checksum": self.host_checksum},
            "ath": self.table1(),
            "clips": [self._clip_info(clip) for clip in self.clips],
            "levels": [asdict(level) for level in self.levels],
        }

    @property
    def _predicted_error_share(self) -> float | None:
        """The share of the bound that errors of predicted motion reach; None: it is not there."""
        if not self.core.info.is_predicted or len(self.levels) < 2 or not self.max_error_bound:
            return None
        return self.levels[1].max_error / self.max_error_bound

    def _clip_info(self, clip: Clip) -> dict[str, Any]:
        metadata = metadata_of(self.metadata, clip.name)
        strength, heading = wind_of(metadata)
        return {
            "name": clip.name,
            "frames": clip.frame_count,
            "segments": clip.segment_count,
            "seconds": clip.duration,
            "loop": clip.loop,
            "wind": None if math.isnan(strength) else {STRENGTH: strength, HEADING: heading},
            "presence": stated_presence(metadata),
            "seam_errors": list(clip.seam_errors),
            "max_errors": [level.max_error for level in self.levels_in(clip.segments)],
        }

    def check(self, decode: bool = True) -> None:
        """Read every chunk and decode every level. Raises FormatError, the first fault in the file.

        Without `decode`, compare checksums and read static data only, which needs no mesh of the host's.
        """
        if not self.complete:
            raise Truncated(f"file: got {self.available_length} bytes; expected {self.file_length}; {self.missing}")
        with self._lock:
            self._announce([(0, self.file_length)])
        for chunk in self.chunks:
            self.payload(chunk)
        try:
            _ = self.metadata, self.faces, self.edges, self.attributes
        except ClipError as error:
            raise BadChunk(f"static data: {error}") from None
        if not decode:
            return
        _, ready = self.rest, None
        for segment in range(self.segment_count):
            for level in range(self.level_count):
                ready = self.prepare(segment, level, ready)


def _place_of(path: Openable) -> str | None:
    """Return the path or URL that opens the same file from any folder; None for bytes and file objects."""
    if not isinstance(path, (str, os.PathLike)):
        return None
    return str(path) if is_url(path) else os.path.abspath(os.fspath(path))


def _reopened(kind: type[AthFile], place: str | bytes, options: dict[str, Any], fingerprint: str) -> AthFile:
    """Open the file of a pickled AthFile. Raises BadChecksum if another is in its place, and the errors of opening."""
    file = kind(place, **options)
    if file._fingerprint != fingerprint:
        file.close()
        name = redacted(place) if isinstance(place, str) else "bytes"
        raise BadChecksum(f"{name}: got another file than the one that was pickled; open it again")
    return file
