"""The static data of an .ath file, in the source's numbering: rest pose, branches, faces, attributes, metadata."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property

import numpy as np

from athcodec.decoding import container as ct
from athcodec.decoding import core_file
from athcodec.decoding.chunks import Chunks
from athcodec.decoding.file_bytes import FileBytes
from athcodec.decoding.file_tables import FileTables
from athcodec.decoding.host_mesh import HostMesh, mesh_positions
from athcodec.errors import BadChunk, LimitExceeded, Truncated
from athcodec.motion.clip import ERROR_WEIGHTS, check_stem_index
from athcodec.motion.hierarchy import Hierarchy, derived_edges
from athcodec.motion.places import Places
from athcodec.motion.polygons import Polygons
from athcodec.untyped import JsonObject

CUBE_CORNER = 3**0.5 / 2  # Largest distance of a point from the nearest one of a cubic lattice, in its steps.
_SOURCE_REST = struct.Struct("<Bf")  # Is_Exact and Rest_Step of FORMAT.md.


class StaticData:
    """What a file holds beside motion; each part is read when it is asked for."""

    def __init__(self, file_bytes: FileBytes, chunks: Chunks, tables: FileTables) -> None:
        self._bytes, self._chunks, self._tables = file_bytes, chunks, tables
        self._core = file_bytes.core
        self._rest_read = -1, np.empty(0)  # The level that `rest_at` was last asked for, and its pose.
        self.host_mesh: np.ndarray | None = None  # Positions of the host's mesh that was set, (N, 3) float32.
        self.host_files: frozenset[tuple[int, int]] = frozenset()  # The files that the host's mesh was read from.

    @cached_property
    def metadata(self) -> JsonObject:
        """Unit, up axis and whatever else the sources of all clips state, as `join` puts it together."""
        chunk = self._chunks.find(ct.METADATA)
        return ct.parse_metadata(self._chunks.payload(chunk), self._bytes.limits) if chunk else {}

    def private_chunks(self, name: str) -> list[bytes]:
        """Return the contents of private chunks of a name, in file order. Raises Truncated, BadChecksum."""
        named = self.metadata.get(ct.PRIVATE_KINDS)
        kinds = {kind for kind, stated in named.items() if stated == name} if isinstance(named, dict) else set()
        private = (chunk for chunk in self._chunks.all if chunk.kind >= ct.FIRST_PRIVATE)
        return [self._chunks.payload(chunk) for chunk in private if f"{chunk.kind:04X}" in kinds]

    # ---- branches ----

    @cached_property
    def places(self) -> Places:
        """Which vertices are at one place."""
        info = self._core.info
        if info.place_count == info.vertex_count:
            return Places.apart(info.vertex_count)
        return Places.of_labels(self._core.vertex_places())

    @cached_property
    def place_hierarchy(self) -> Hierarchy:
        """The branches in file order, with one vertex for each place: vertices that always coincide count as one."""
        number = np.empty(self.places.count, np.int32)
        number[self._core.vertex_places()[self.places.first]] = np.arange(self.places.count)
        return Hierarchy.from_parts(
            self._tables.branches["parent"],
            self._tables.branches["count"],
            self._tables.branches["attach"],
            number,
            self._core.branch_source(),
        )

    @cached_property
    def hierarchy(self) -> Hierarchy:
        """The branches in file order, with all vertices; those at the same place follow one another."""
        if not self.places.are_shared:
            return self.place_hierarchy
        starts, attach = self.place_starts, self._tables.branches["attach"]
        return Hierarchy.from_parts(
            self._tables.branches["parent"],
            np.diff(starts[np.append(self._tables.branches["first"], self.places.count)]),
            np.where(attach < 0, -1, starts[attach]),
            np.argsort(self._core.vertex_places(), kind="stable"),
            self._core.branch_source(),
        )

    @cached_property
    def place_starts(self) -> np.ndarray:
        """The number in `hierarchy` of the first vertex of each place in file order, and of all vertices, (P + 1,)."""
        return np.append(0, np.cumsum(np.bincount(self._core.vertex_places())))

    @cached_property
    def _source_branches(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.hierarchy.source_branches()

    @property
    def vertex_branch(self) -> np.ndarray:
        """The branch of each vertex, (N,) int32."""
        return self._source_branches[0]

    @property
    def branch_parent(self) -> np.ndarray:
        """The parent of each branch, (B,) int32, -1 for a root."""
        return self._source_branches[1]

    @property
    def stem_index(self) -> np.ndarray | None:
        """Number of each vertex along its stem, (N,) int32; None if the source's numbering already says it of the first
        vertices of places."""
        if self.places.are_shared:
            place_branch, _, along = self.place_hierarchy.source_branches()
            if check_stem_index(along, place_branch) is None:
                return None
        vertex_branch, _, along = self._source_branches
        return check_stem_index(along, vertex_branch)

    # ---- polygons and attributes ----

    @cached_property
    def faces(self) -> np.ndarray | None:
        """Vertex numbers of the corners, (F, k) of the source's integer type, or None; faces of different sizes are
        attributes. If the file has none and is in a GLB, the triangles there."""
        if self._chunks.find(ct.FACES) is None:
            return getattr(self._bytes.source, "faces", None)
        return None if self._polygons is None or self._polygons.counts is not None else self._polygons.rows

    @cached_property
    def edges(self) -> np.ndarray | None:
        """Vertex numbers of both ends, (E, 2) of the source's integer type, or None."""
        stored = self._indices(ct.EDGES)
        if stored is None or not stored.derived:
            return None if stored is None else stored.rows
        return self.places.first[derived_edges(self.place_hierarchy)].astype(stored.index_type)

    @cached_property
    def _polygons(self) -> Polygons | None:
        return self._indices(ct.FACES)

    def _indices(self, kind: int) -> Polygons | None:
        chunk = self._chunks.find(kind)
        if chunk is None:
            return None
        with self._bytes.lock, self._bytes.fed([(chunk.offset, chunk.length)], str(chunk)):
            return self._core.polygons(kind, self._bytes.limits.corners)

    @cached_property
    def attributes(self) -> dict[str, np.ndarray]:
        """The named static arrays, as in the source. Arrays that a cut-off file lacks are left out."""
        faces = self._polygons
        result: dict[str, np.ndarray] = {} if faces is None or faces.counts is None else faces.attributes
        for chunk in self._chunks.of_kind(ct.ATTRIBUTE):
            if not self._chunks.is_available(chunk):
                continue
            if len(result) >= self._bytes.limits.attributes:
                raise LimitExceeded(f"{chunk}: got more than {self._bytes.limits.attributes} attributes")
            name, array = ct.parse_array(self._chunks.payload(chunk), str(chunk), self._bytes.limits)
            if name in result:
                raise BadChunk(f"{chunk}: got attribute {ct.brief(name)} twice")
            result[name] = array
            total = sum(array.nbytes for array in result.values())
            if total > self._bytes.limits.memory_bytes:
                raise LimitExceeded(
                    f"{chunk}: got {total} bytes of attributes; the limit is {self._bytes.limits.memory_bytes}"
                )
        return result

    @property
    def error_weights(self) -> np.ndarray | None:
        """Factors on the bound that the file was encoded with, (N,) float64, or None.

        Vertex v is within max_error_bound * error_weights[v] / error_weights.max() at the deepest level of the full
        file.
        """
        name = self.metadata.get(ERROR_WEIGHTS)
        array = self.attributes.get(name) if isinstance(name, str) else None
        if array is None or array.size != self._core.info.vertex_count or array.dtype.kind not in "biuf":
            return None
        weights = array.reshape(-1).astype(np.float64)
        return weights if np.isfinite(weights).all() and weights.min() > 0 else None

    # ---- rest pose ----

    @property
    def rest(self) -> np.ndarray:
        """Rest pose of the source as decoded with the deepest complete level, (N, 3), float32 or float64 as in the
        source. If the source had none, or `rest_is_missing`, the reference pose of that level."""
        level = max(self._tables.first_lacking - 1, 0)
        return self._as_rest(self.level_rest(level)) if self._tables.rest_is_missing else self.rest_at(level)

    def rest_at(self, level: int) -> np.ndarray:
        """Return the rest pose (N, 3) at the precision of a stored level. Raises Truncated if the file is cut off
        before it, LevelUnavailable if there is no such level."""
        if self._tables.rest_is_missing:
            raise Truncated(
                f"SOURCE_REST: not in the file; it is cut off at {self._bytes.available_length} of "
                f"{self._bytes.file_length} bytes"
            )
        level = self._tables.checked_level(level)
        level_read, pose = self._rest_read
        if level_read != level:
            with self._poses_read(level, [ct.SOURCE_REST]):
                pose = self._as_rest(self._core.rest(level))
            self._rest_read = level, pose
        return pose.copy()

    @property
    def rest_error(self) -> float:
        """The largest distance of a vertex of `rest` from the source's rest pose, in scene units, if the file stores
        that pose apart from the reference pose. Otherwise 0: the pose is exact, or is the reference pose, which is
        within the error bound."""
        chunk = self._chunks.find(ct.SOURCE_REST)
        if chunk is None or self._tables.rest_is_missing:
            return 0.0
        head = bytes(self._chunks.payload(chunk)[: _SOURCE_REST.size])
        if len(head) < _SOURCE_REST.size:
            raise BadChunk(f"{chunk}: got {len(head)} bytes; expected at least {_SOURCE_REST.size}")
        is_exact, step = _SOURCE_REST.unpack(head)
        return 0.0 if is_exact else step * CUBE_CORNER

    def _as_rest(self, pose: np.ndarray) -> np.ndarray:
        """Return a pose in the source's type; numbers beyond float32 become infinite, as FORMAT.md rounds."""
        with np.errstate(over="ignore"):
            return pose.astype(np.float64 if self._core.info.rest_is_float64 else np.float32, copy=False)

    def level_rest(self, level: int, order: int = core_file.SOURCE_ORDER) -> np.ndarray:
        """Return the reference pose of a level, which its maps move: the source's rest pose, or another that the motion
        is closer to. Levels that refine the plant may refine their reference pose, too.

        It is (N, 3) float64, scene units, not rounded to the source's type, in core_file.SOURCE_ORDER or FILE_ORDER.
        Raises LevelUnavailable, FormatError.
        """
        level = self._tables.checked_level(level)
        with self._poses_read(level):
            return self._core.level_rest(level, order)

    @contextmanager
    def _poses_read(self, level: int, kinds: Sequence[int] = ()) -> Iterator[None]:
        """Give the C core the chunks of reference poses up to a level, and all chunks of `kinds`, until the block
        ends."""
        with self._bytes.lock:
            chunks = [
                chunk for chunk in self._chunks.of_kind(ct.REFINED_REST) if self._core.poses_read < chunk.level <= level
            ]
            chunks += [chunk for kind in kinds for chunk in self._chunks.of_kind(kind)]
            with self._bytes.fed(
                [(chunk.offset, chunk.length) for chunk in chunks], f"reference pose of level {level}"
            ):
                yield

    # ---- the host's mesh ----

    @property
    def host_checksum(self) -> str | None:
        """The checksum, 16 hexadecimal digits, of the host's mesh that is the rest pose; None if the file holds a rest
        pose."""
        info = self._core.info
        return "{:08x}{:08x}".format(*info.host_checksum) if info.rest_is_host else None

    @property
    def needs_host_mesh(self) -> bool:
        """Whether the rest pose is a mesh of the host's that has not been set. Nothing can be decoded then."""
        return not self._core.has_rest

    def set_host_mesh(self, mesh: HostMesh) -> None:
        """Set the rest pose from the mesh that the host application has. Nothing happens if the file holds its rest
        pose or has been given it before.

        Raises WrongHostMesh if it is another mesh, ClipError if it cannot be read.
        """
        if self.needs_host_mesh:
            positions, files = mesh_positions(mesh)
            self.host_files |= files
            try:
                with self._bytes.lock:
                    self._core.set_host_mesh(positions)
                    self.host_mesh = positions
            except core_file.CoreError as error:
                raise self._bytes.refusal(error) from None
