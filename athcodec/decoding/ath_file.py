"""`AthFile`, the public face of an opened .ath file, for any number of clips that play it.

It puts together four parts that share its bytes (file_bytes.py): chunks (chunks.py), clips and levels
(file_tables.py), the rest pose and all else that does not move (static_data.py), and the decoding of segments
(segment_decoder.py). Playing a clip is the job of decoder.py.
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
from athcodec.decoding.chunks import Chunks
from athcodec.decoding.container import Limits
from athcodec.decoding.file_bytes import FileBytes, Openable
from athcodec.decoding.file_tables import Clip, FileTables, Level
from athcodec.decoding.host_mesh import HostMesh
from athcodec.decoding.segment_decoder import SegmentDecoder
from athcodec.decoding.static_data import StaticData
from athcodec.errors import BadChecksum, BadChunk, ClipError, LevelUnavailable, Truncated
from athcodec.files.atomic import FileId, is_url
from athcodec.files.shown import counted, redacted
from athcodec.motion.clip import median_rate
from athcodec.motion.hierarchy import Hierarchy
from athcodec.motion.joining import HEADING, STRENGTH, metadata_of, wind_of
from athcodec.motion.presence import stated_presence
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.units import LengthLike, length_of, scene_unit
from athcodec.untyped import JsonObject, Keywords


class AthFile:
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
    chunks : Chunks
        The chunk table without unknown kinds, a sequence, and the contents of chunks.
    tables : FileTables
        Clips, levels and branches, and which levels are there.
    static : StaticData
        Rest pose, hierarchy, faces, attributes and metadata.
    segments : SegmentDecoder
        The segments, which it decodes.
    limits : Limits
        What the file may ask for.
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
        """Open the .ath file `path`, which may also be a URL, bytes or a file object, and read its front. The other
        parameters are those of `athcodec.open`."""
        self._bytes = FileBytes(path, strict, limits, gltf_motion)
        self.core = self._bytes.core
        self._place = _place_of(path)
        self._options = {"strict": strict, "allow_partial": allow_partial, "limits": limits, "gltf_motion": gltf_motion}
        info = self.core.info
        self.file_length: int = info.file_length
        self.prelude_length: int = info.prelude_length
        self.available_length: int = self._bytes.available_length
        self.complete: bool = self._bytes.complete
        self.segment_count: int = info.segment_count
        self.level_count: int = info.level_count
        self.full_level_count: int = info.full_level_count
        self.vertex_count: int = info.vertex_count
        self.branch_count: int = info.branch_count
        self.frame_count: int = info.frame_count
        self.max_error_bound: float = info.max_error
        self.dtype = np.dtype(np.float64 if info.is_float64 else np.float32)
        self.origin = np.array(info.origin[:])
        try:
            self.chunks = Chunks(self._bytes)
            damaged_from = self.chunks.first_damaged_level() if allow_partial else None
            self.tables = FileTables(self._bytes, self.chunks, damaged_from)
            self.static = StaticData(self._bytes, self.chunks, self.tables)
            self.segments = SegmentDecoder(self._bytes)
            if host_mesh is None and self.needs_host_mesh:
                host_mesh = getattr(self.source, "host_mesh", None)
            if host_mesh is not None:
                self.set_host_mesh(host_mesh)
        except BaseException:
            self.close()
            raise

    @property
    def limits(self) -> Limits:
        """What decoding may take. Other limits hold from then on."""
        return self._bytes.limits

    @limits.setter
    def limits(self, limits: Limits) -> None:
        self._bytes.limits = limits

    def __repr__(self) -> str:
        return (
            f"<AthFile {self.name!r}: {counted(self.vertex_count, 'vertex', 'vertices')} on "
            f"{counted(self.branch_count, 'branch', 'branches')}, {counted(self.frame_count, 'frame')} in "
            f"{counted(len(self.clips), 'clip')}, {counted(self.level_count, 'level')}, {self.file_length:,} bytes>"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how pickle opens the file again: by its path, URL or bytes. Raises TypeError for a file object,
        ValueError if the file is closed."""
        if self.is_closed:
            raise ValueError("AthFile: is closed; expected an open file to pickle")
        if not self._bytes.closes_source:
            raise TypeError(
                "AthFile: got one of a file object, which only this process has; expected one of a path, a URL or "
                "bytes to pickle"
            )
        place = self.source.getvalue() if self._place is None else self._place
        return _reopened, (type(self), place, self._options | {"host_mesh": self.static.host_mesh}, self._fingerprint)

    def __enter__(self) -> AthFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # ---- bytes ----

    def close(self) -> None:
        """Close the file, if it was opened here, as soon as no thread reads from it."""
        self._bytes.close()

    @property
    def is_closed(self) -> bool:
        """Whether `close` has closed the file; a file object of a caller stays open."""
        return self._bytes.is_closed

    @property
    def name(self) -> str:
        """The path or URL of the file, or the name of a file object; "file" if it has none."""
        return self._bytes.name

    @property
    def source(self) -> Any:
        """The file object that the bytes come from. That of a URL counts its `requests` and `bytes`."""
        return self._bytes.source

    @property
    def bytes_read(self) -> int:
        """Bytes read so far."""
        return self._bytes.bytes_read

    @property
    def inputs(self) -> frozenset[FileId]:
        """The files that are read, by device and inode: this one, and those of the host mesh."""
        return self._bytes.inputs | self.static.host_files

    def whole(self) -> bytes:
        """Return all bytes of the file that are there."""
        return self._bytes.whole()

    def private_chunks(self, name: str) -> list[bytes]:
        """Return the chunks that another program added under a name (FORMAT.md, "Chunk table", private kinds).

        Parameters
        ----------
        name : str
            The name of what they hold, which begins with a domain, backwards: "org.example.leaf_age".

        Returns
        -------
        list of bytes
            Their contents in file order; none if METADATA does not have the name.

        Raises
        ------
        Truncated
            If the file was cut off before one of them.
        BadChecksum
            If one is damaged.
        """
        return self.static.private_chunks(name)

    # ---- clips and levels ----

    @property
    def clips(self) -> tuple[Clip, ...]:
        """The clips that the file holds, in its order."""
        return self.tables.clips

    @property
    def time(self) -> np.ndarray:
        """Seconds, (T,) float64, of the frames of all clips."""
        return self.tables.time

    @property
    def levels(self) -> list[Level]:
        """The stored levels, coarse to fine, with their errors in all clips."""
        return self.tables.levels_in(range(self.segment_count))

    def available(self, level: int) -> bool:
        """Return whether all segments of all levels up to this one are there and undamaged."""
        return self.tables.available(level)

    @property
    def deepest(self) -> int:
        """The deepest complete level. Raises Truncated if not even level 0 is complete."""
        return self.tables.deepest

    @property
    def missing(self) -> str:
        """One line on what a cut-off or damaged file lacks; empty for a complete one."""
        return self.tables.missing

    @property
    def errors(self) -> np.ndarray:
        """Errors of each level in each segment, (levels, segments, 3) float64, scene units: largest, 99th percentile,
        root mean square."""
        return self.tables.errors

    @property
    def joins(self) -> np.ndarray:
        """How each segment goes on from the end of the one before it, (levels, segments) uint8; 0: it does not."""
        return self.tables.joins

    def level_within(self, max_error: LengthLike, segments: range | None = None) -> int:
        """Return the coarsest stored level whose largest error is at most `max_error`.

        Parameters
        ----------
        max_error : float or str
            A length in scene units, or text such as "5cm".
        segments : range, optional
            Numbers of the segments, in the whole file, in which the error counts; by default all.

        Returns
        -------
        int
            Number of the level.

        Raises
        ------
        LevelUnavailable
            If the largest error of every level is above `max_error`.
        BoundError
            If `max_error` is text that is no length, or has a unit and the file states none.
        """
        segments = segments or range(self.segment_count)
        wanted = length_of(max_error, "max_error")
        length = wanted.in_scene_units(scene_unit(self.metadata))
        largest = self.errors[:, segments.start : segments.stop, 0].max(axis=1)
        if not (within := np.flatnonzero(largest <= length)).size:
            raise LevelUnavailable(f"max_error: got {wanted}; expected at least {largest.min():.4g} scene units")
        return int(within[0])

    # ---- static data ----

    @property
    def metadata(self) -> JsonObject:
        """Unit, up axis and whatever else the sources of all clips state, as `join` puts it together."""
        return self.static.metadata

    @property
    def hierarchy(self) -> Hierarchy:
        """The branches in file order with all vertices, of which those at one place follow each other."""
        return self.static.hierarchy

    @property
    def vertex_branch(self) -> np.ndarray:
        """The branch of each vertex, (N,) int32."""
        return self.static.vertex_branch

    @property
    def branch_parent(self) -> np.ndarray:
        """The parent of each branch, (B,) int32, -1 for a root."""
        return self.static.branch_parent

    @property
    def stem_index(self) -> np.ndarray | None:
        """Number of each vertex along its stem, (N,) int32; None if the source's numbering already says it of the first
        vertices of places."""
        return self.static.stem_index

    @property
    def faces(self) -> np.ndarray | None:
        """Vertex numbers of the corners, (F, k) of the source's integer type, or None; faces of different sizes are
        attributes. If the file has none and is in a GLB, the triangles there."""
        return self.static.faces

    @property
    def edges(self) -> np.ndarray | None:
        """Vertex numbers of both ends, (E, 2) of the source's integer type, or None."""
        return self.static.edges

    @property
    def attributes(self) -> dict[str, np.ndarray]:
        """Named static arrays, unchanged. Those that a cut-off file lacks are left out."""
        return self.static.attributes

    @property
    def error_weights(self) -> np.ndarray | None:
        """Factors on the bound that the file was encoded with, (N,) float64, or None.

        Vertex v is within max_error_bound * error_weights[v] / error_weights.max() at the deepest level of the full
        file.
        """
        return self.static.error_weights

    @property
    def rest(self) -> np.ndarray:
        """Rest pose of the source as decoded with the deepest complete level, (N, 3), float32 or float64 as in the
        source. If the source had none, or its rest pose was cut off, the reference pose of that level."""
        return self.static.rest

    def rest_at(self, level: int) -> np.ndarray:
        """Return the rest pose as decoded with a stored level. Raises LevelUnavailable; Truncated if it was cut off."""
        return self.static.rest_at(level)

    @property
    def host_checksum(self) -> str | None:
        """The checksum, 16 hexadecimal digits, of the host's mesh that is the rest pose; None if the file holds a rest
        pose."""
        return self.static.host_checksum

    @property
    def needs_host_mesh(self) -> bool:
        """Whether the rest pose is a mesh of the host's that has not been set. Nothing can be decoded then."""
        return self.static.needs_host_mesh

    def set_host_mesh(self, mesh: HostMesh) -> None:
        """Set the mesh that the file was made for, if the file does not hold the rest pose; others ignore it.

        Parameters
        ----------
        mesh : (N, 3) array or MotionClip
            Positions in the source's order, scene units and axes, which are used as float32, bit for bit; or a clip
            that has them as its rest pose.

        Raises
        ------
        WrongHostMesh
            If it is another mesh, by its number of vertices or its checksum.
        ClipError
            If it is no mesh.
        """
        self.static.set_host_mesh(mesh)

    # ---- facts and checks ----

    @property
    def _fingerprint(self) -> str:
        """Tells this file from another at the same place, by its front, which has the checksums of all chunks."""
        return hashlib.sha256(self.core.prelude.tobytes()).hexdigest()

    def table1(self) -> dict[str, float]:
        """Return the figures of Table 1 of the ATH paper (Song, Yang and Peng 2011): "depth" (levels of the node tree),
        "nodes", "leaves" (nodes without children), and the encoder's four thresholds if the file states them."""
        branches = self.tables.branches
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

    def info(self) -> JsonObject:
        """Return the facts that `athcodec info --json` prints about the file and all its clips, as a JSON object."""
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

    def _clip_info(self, clip: Clip) -> JsonObject:
        """Return the facts about one clip that `info` lists: name, frames, duration, wind, errors and so on."""
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
            "max_errors": [level.max_error for level in self.tables.levels_in(clip.segments)],
        }

    def check(self, decode: bool = True) -> None:
        """Read every chunk and decode every level, and raise the first fault of the file as a FormatError.

        With `decode` False, only compare checksums and read static data, which needs no mesh of the host application.
        """
        if not self.complete:
            raise Truncated(f"file: got {self.available_length} bytes; expected {self.file_length}; {self.missing}")
        with self._bytes.lock:
            self._bytes.announce([(0, self.file_length)])
        for chunk in self.chunks:
            self.chunks.payload(chunk)
        static = self.static
        try:
            _ = static.metadata, static.faces, static.edges, static.attributes
        except ClipError as error:
            raise BadChunk(f"static data: {error}") from None
        if not decode:
            return
        _, ready = static.rest, None
        for segment in range(self.segment_count):
            for level in range(self.level_count):
                ready = self.segments.prepare(segment, level, ready)


def _place_of(path: Openable) -> str | None:
    """Return the path or URL that opens the same file from any folder; None for bytes and file objects."""
    if not isinstance(path, (str, os.PathLike)):
        return None
    return str(path) if is_url(path) else os.path.abspath(os.fspath(path))


def _reopened(kind: type[AthFile], place: str | bytes, options: Keywords, fingerprint: str) -> AthFile:
    """Open the file of a pickled AthFile. Raises BadChecksum if another is in its place, and the errors of opening."""
    file = kind(place, **options)
    if file._fingerprint != fingerprint:
        file.close()
        name = redacted(place) if isinstance(place, str) else "bytes"
        raise BadChecksum(f"{name}: got another file than the one that was pickled; open it again")
    return file
