"""Chunks as they are written: heads in front of the streams (streams.py), static data, and their order in a file.

Chunks of the prelude come first, those of the motion by (stage, segment, kind), other attributes last.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, BinaryIO, Protocol

import numpy as np
import zstandard

from athcodec._native import CorePolygons, crc32c
from athcodec.decoding.container import (
    ARRAY_HEAD,
    ARRAY_KINDS,
    KIND_ID,
    NO_LEVEL,
    ROTATION_FACTORS,
    WAVES,
    Chunk,
    Header,
    Limits,
    brief,
    is_prelude,
    pack_front,
    parse_array,
    parse_metadata,
    round_up_singles,
)
from athcodec.errors import ClipError, FormatError
from athcodec.motion.clip import ClipRange
from athcodec.untyped import JsonObject

if TYPE_CHECKING:
    from athcodec.encoding.streams.polygons import Mesh

IS_HOST = 4  # Method of a REST that the host has.
_IS_CONNECTED = 8  # Bit of Method.
_REST = struct.Struct("<B3ff")
_SOURCE_REST = struct.Struct("<Bf")
_MESH_CHECKSUM = struct.Struct("<II")
_TIME = struct.Struct("<B")
BY_STEP, BY_RATE, ONE_BY_ONE = range(3)  # Values of Method of TIME.
_STEADY = struct.Struct("<dd")
_RATE = struct.Struct("<H")
_CLIP = struct.Struct("<IIBB")
_STEMS = struct.Struct("<fBB")
_BASIS = struct.Struct("<HBI")
_RATIO = struct.Struct("<H")
_SHIFT = struct.Struct("<B")
_STEP = struct.Struct("<f")  # Of REFINED_REST, PREDICTED and CORRECTIONS.
_POLYGONS = struct.Struct("<II")
_IS_MIXED = 8  # Bit of the first byte of FACES: polygons of several sizes.
_IS_DERIVED = 16  # Bit of the first byte of EDGES: they are the sides of the faces.


def _order(chunk: Chunk) -> tuple[int, ...]:
    if chunk.is_motion:
        return (1, NO_LEVEL if chunk.stage is None else chunk.stage, chunk.segment, chunk.kind)
    return (0 if is_prelude(chunk.kind) else 2, chunk.kind & KIND_ID)


class Spool(Protocol):
    """A temporary file."""

    def seek(self, offset: int, whence: int = ..., /) -> int: ...
    def read(self, size: int = ..., /) -> bytes: ...
    def write(self, data: bytes, /) -> int: ...


@dataclass
class ChunkStore:
    """Chunks on their way into a file: payloads in a spool, in any order."""

    spool: Spool
    entries: list[tuple[Chunk, int]] = field(default_factory=list)

    def add(self, kind: int, payload: bytes, stage: int = NO_LEVEL, segment: int = 0) -> None:
        place = self.spool.seek(0, 2)
        self.spool.write(payload)
        self.entries.append((Chunk(kind, NO_LEVEL, segment, len(payload), crc32c(payload), stage=stage), place))

    def leave_out(self, is_needless: Callable[[Chunk], bool]) -> None:
        """Drop the chunks of motion that `is_needless` is true of. All other chunks stay."""
        self.entries = [entry for entry in self.entries if not (entry[0].is_motion and is_needless(entry[0]))]

    def replace(self, kind: int, payload: bytes) -> None:
        """Replace the content of the one chunk of a kind."""
        self.entries = [(chunk, place) for chunk, place in self.entries if chunk.kind != kind]
        self.add(kind, payload)

    def size(self, header: Header, errors: np.ndarray) -> int:
        """Return the bytes of the whole file."""
        pack_front(header, sorted((chunk for chunk, _ in self.entries), key=_order), errors)
        return header.file_length

    def write(self, out: BinaryIO, header: Header, errors: np.ndarray) -> list[Chunk]:
        """Write the whole file to `out`, its chunks in the order that files have, and return the chunks."""
        entries = sorted(self.entries, key=lambda entry: _order(entry[0]))
        out.write(pack_front(header, [chunk for chunk, _ in entries], errors))
        chunks = []
        for chunk, place in entries:
            chunks.append(replace(chunk, offset=out.tell()))
            self.spool.seek(place)
            out.write(self.spool.read(chunk.length))
        return chunks


@dataclass
class Rest:
    """Head of REST and its stream: the very numbers of the source if `exact`, the checksum of the host's mesh if
    `is_host`, else steps. `mesh`: the faces that the pose goes by. Origin and step are numbers of float32."""

    origin: np.ndarray
    step: float
    source_dtype: np.dtype
    stream: bytes = b""
    exact: bool = False
    is_host: bool = False
    mesh: Mesh | None = None


def pack_rest(rest: Rest) -> bytes:
    by_mesh = 0 if rest.mesh is None else _IS_CONNECTED
    method = int(rest.exact) | int(rest.source_dtype == np.float64) << 1 | by_mesh
    return _REST.pack(IS_HOST if rest.is_host else method, *rest.origin, rest.step) + rest.stream


def pack_source_rest(step: float, stream: bytes) -> bytes:
    return _SOURCE_REST.pack(0, step) + stream


def pack_exact_source_rest(stream: bytes) -> bytes:
    return b"\1" + stream


def mesh_checksum(mesh: np.ndarray) -> bytes:
    """Return the checksum by which a file knows the mesh of a host, (N, 3) in source order."""
    data = (mesh.astype("<f4") + np.float32(0)).tobytes()  # Adding 0 turns -0.0 into 0.0.
    return _MESH_CHECKSUM.pack(crc32c(data), crc32c(data[::-1]))


def pack_steady_time(*times: np.ndarray) -> bytes | None:
    """Return TIME by the rule that gives the very same times in seconds, (T,) for each clip; None: none does."""
    for method, code, find in ((BY_RATE, _RATE, _rate_of), (BY_STEP, _STEADY, _step_of)):
        rules = [rule for time in times if (rule := find(time)) is not None]
        if len(rules) == len(times):
            return _TIME.pack(method) + b"".join(code.pack(*rule) for rule in rules)
    return None


def _rate_of(time: np.ndarray) -> tuple[int] | None:
    """Return the whole number of frames per second whose times from 0 on are exactly these, if there is one."""
    rate = round(1 / float(time[1])) if len(time) > 1 and float(time[1]) > 1e-5 else 1
    return (rate,) if 0 < rate < 65536 and (np.arange(len(time)) / rate == time).all() else None


def _step_of(time: np.ndarray) -> tuple[float, float] | None:
    """Return the first time and the step in seconds that give exactly these times, if there are such."""
    index, first = np.arange(len(time)), float(time[0])
    if len(time) == 1:
        return first, 1.0
    steps = {(float(time[-1]) - first) / (len(time) - 1), float(time[1]) - first}
    with np.errstate(over="ignore", invalid="ignore"):  # A step that overflows cannot give the times back.
        return next(((first, step) for step in steps if (first + index * step == time).all()), None)


def pack_clips(
    clip_ranges: Sequence[ClipRange],
    segment_counts: Sequence[int],
    seams: Sequence[Sequence[float] | None],
    periodic: bool = False,
) -> bytes:
    """Return the payload of the chunk CLIPS. `segment_counts`: how many segments each clip has; `seams`: for each clip
    that loops the error at its seam at each level, in scene units, None for other clips; `periodic`: whether loops of
    one segment are coded by periodic waves.
    """
    entries = []
    for clip_range, segments, errors in zip(clip_ranges, segment_counts, seams):
        name = clip_range.name.encode()
        flags = clip_range.loop | (clip_range.loop and periodic and segments == 1) << 1
        entries.append(_CLIP.pack(clip_range.frame_count, segments, flags, len(name)) + name)
        if clip_range.loop:
            assert errors is not None  # A loop has a seam.
            entries.append(round_up_singles(np.asarray(errors)).astype("<f4").tobytes())
    return b"".join(entries)


def pack_time(stream: bytes) -> bytes:
    """Return TIME with times one by one; stream: as `encode_times` returns it."""
    return _TIME.pack(ONE_BY_ONE) + stream


@dataclass
class StemsHead:
    """Head of STEMS. basis: stream of a learned basis of a rank; base: the stage of the stream whose basis it begins
    with; turn: half octaves below 1 of the largest step of rigid pieces' rotations (0: there is none)."""

    step: float
    rotation_step_factor: int
    basis_kind: int = WAVES
    rank: int = 0
    basis: bytes = b""
    base: int = NO_LEVEL
    turn: int = 0


def pack_stems(head: StemsHead, stream: bytes) -> bytes:
    rotation = ROTATION_FACTORS.index(head.rotation_step_factor) | head.turn << 4
    data = _STEMS.pack(head.step, rotation, head.basis_kind)
    if head.basis_kind != WAVES:
        data += _BASIS.pack(head.rank, head.base, len(head.basis)) + head.basis
    return data + stream


def pack_refined_stems(ratio: int, head: StemsHead, stream: bytes) -> bytes:
    """Return STEMS of a refinement; ratio: the step of the layer before over that of this one."""
    return _RATIO.pack(ratio) + pack_stems(head, stream)


def pack_refined_shapes(shift: int, stream: bytes) -> bytes:
    """Return SHAPES of a refinement; shift: binary digits that integers have more than in the layer before."""
    return _SHIFT.pack(shift) + stream


def pack_refined_rest(step: float, stream: bytes) -> bytes:
    """Return REST of a refinement: its step and its stream."""
    return _STEP.pack(step) + stream


def pack_predicted(step: float, stream: bytes) -> bytes:
    return _STEP.pack(step) + stream


def pack_corrections(step: float, stream: bytes) -> bytes:
    return _STEP.pack(step) + stream


def _compress(array: np.ndarray) -> bytes:
    """Compress the array's bytes, shuffled: all first bytes of the items, then all second bytes, and so on."""
    array = np.ascontiguousarray(array)
    shuffled = np.frombuffer(array.tobytes(), np.uint8).reshape(-1, array.dtype.itemsize).T.tobytes()
    return zstandard.ZstdCompressor(level=19, write_content_size=True, write_checksum=False).compress(shuffled)


def pack_polygons(shape: CorePolygons, stream: bytes) -> bytes:
    """Return FACES or EDGES of a shape."""
    types = bytes([shape.index_type | _IS_MIXED * shape.is_mixed] + [shape.count_type] * shape.is_mixed)
    return types + _POLYGONS.pack(shape.face_count, shape.corner_count if shape.is_mixed else shape.columns) + stream


def pack_derived_edges(index_type: int) -> bytes:
    """Return EDGES that follow from the branches, of an integer type (polygons.type_code)."""
    return bytes([index_type | _IS_DERIVED])


def pack_array(name: str, array: np.ndarray) -> bytes:
    """Return the payload of a chunk ATTRIBUTE that holds an array of numbers, booleans or texts under a name. Raises
    ClipError if readers would refuse it.
    """
    subject, limits = f"array {brief(name)}", Limits()
    if array.nbytes > limits.decoded_chunk_bytes:  # Refused before it is compressed.
        raise ClipError(f"{subject}: got {array.nbytes} bytes; the limit is {limits.decoded_chunk_bytes}")
    with _refusals(subject):
        text = name.encode()
        head = ARRAY_HEAD.pack(ARRAY_KINDS.index(array.dtype.kind), array.ndim, len(text), array.dtype.itemsize)
        shape = struct.pack(f"<{array.ndim}I", *array.shape)
        packed = head + shape + text + (_compress(array) if array.size else b"")
        parse_array(packed, subject, limits)
    return packed


@contextmanager
def _refusals(subject: str) -> Iterator[None]:
    """Turn what a reader would refuse into ClipError: it is the source's fault."""
    try:
        yield
    except FormatError as error:
        raise ClipError(str(error)) from None
    except (TypeError, ValueError, RecursionError, struct.error) as error:
        raise ClipError(f"{subject}: {error}; expected plain data that a file can hold") from None


def pack_metadata(metadata: JsonObject) -> bytes:
    """Return JSON, compressed if that is shorter. Raises ClipError for what no reader would accept."""
    with _refusals("metadata"):
        text = json.dumps(metadata, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        shorter = zstandard.ZstdCompressor(level=19, write_content_size=True).compress(text)
        packed = b"\1" + shorter if len(shorter) < len(text) else b"\0" + text
        parse_metadata(packed, Limits())
    return packed
