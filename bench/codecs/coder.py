"""The entropy coder of the baselines, which is athcodec's (coder.c, compiled here with the core's headers and flags).

It takes arrays of integers: rows of three axes over frequency, and tables of anything else.
`Writer` concatenates such arrays and a few numbers, each with its shape and length, and `Reader` parses them, so that a
decoder gets nothing that was not counted. Hierarchy and corrections are
coded as athcodec codes them. Integers of any size up to 64 bits are taken; those
of 30 bits or more are split, which baselines never need.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import re
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Sequence
from ctypes import c_double, c_int32, c_int64, c_void_p
from functools import cache
from pathlib import Path

import numpy as np

from athcodec._native import BRANCH, SEGMENT_FRAMES
from athcodec.encoding.model import quantise
from athcodec.encoding.streams import streams
from athcodec.motion.hierarchy import Hierarchy

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "athcodec" / "core"
CORE_SOURCES = [CORE / "model" / name for name in ("basis.c", "motion.c", "refine.c", "rotations.c")]
OPTIMISATION = "-O3"  # The level of the core in CMakeLists.txt; no level changes a bit of what is coded.
# A call that no longer fits a function of the core ends the build, even where its arguments can be converted.
STRICT = tuple(
    f"-Werror={name}" for name in ("implicit-function-declaration", "incompatible-pointer-types", "int-conversion")
)
LARGEST = 1 << 30
LOW_BITS = 24


class DamagedStream(Exception):
    """Bytes that are not a stream of this module."""


# ---- coder.c ----


def compiler() -> list[str] | None:
    """Return the C compiler and its first options, from CC or the usual names."""
    command = os.environ.get("CC") or next(filter(shutil.which, ("cc", "gcc", "clang")), None)
    return command.split() if command else None


def compile_c(target: Path, sources: Sequence[Path], *options: str) -> None:
    """Compile C sources to a program or library at `target`, with the compiler options that CMakeLists.txt gives the
    core and further `options`.

    Raise SystemExit with the compiler's first error if the sources do not compile.
    """
    command = compiler()
    if command is None:
        raise SystemExit("C compiler: found none of cc, gcc and clang; expected one, or its name in CC")
    flags = re.findall(r"^\s*(-f[\w=-]+)", (CORE / "CMakeLists.txt").read_text(), re.MULTILINE)
    command += ["-std=c11", OPTIMISATION, *flags, *STRICT, f"-I{CORE}", f"-I{CORE / 'include'}", *options]
    done = subprocess.run(
        [*command, "-o", target, *sources, "-lm"], stderr=subprocess.PIPE, text=True, env=os.environ | {"LC_ALL": "C"}
    )
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        first = next((line for line in lines if re.search(r"\berror: |\bundefined ", line)), lines[-1])
        raise SystemExit(f"C compiler, {sources[0].name}: {first.replace(f'{ROOT}/', '')}")


@cache
def library(writes: bool) -> ctypes.CDLL:
    """Return the compiled coder.c as a ctypes library: its writers if `writes` is true, else its readers. Each is
    compiled once per process.
    """
    folder = Path(tempfile.mkdtemp(prefix="athcodec-bench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    file = folder / ("writer.so" if writes else "reader.so")
    sources, way = ([], ["-DATH_ENCODING"]) if writes else (CORE_SOURCES, [])
    compile_c(file, [Path(__file__).with_name("coder.c"), *sources], "-shared", "-fPIC", *way)
    loaded = ctypes.CDLL(str(file))
    arguments = {"bench_rows": [c_int32] * 3 + [c_void_p], "bench_table": [c_int32] * 2 + [c_void_p]}
    if not writes:
        arguments["bench_hierarchy"] = [c_int32] * 2 + [c_void_p] * 3
        arguments["bench_corrections"] = [c_int32, c_int32, c_double, c_int32, c_void_p]
        arguments["bench_pose"] = [c_void_p, c_int32, c_double, c_void_p]
    for name, rest in arguments.items():
        function = getattr(loaded, name)
        function.restype, function.argtypes = c_int64, [c_void_p, c_int64, *rest]
    return loaded


def _written(name: str, capacity: int, *arguments) -> bytes:
    """Call the C writer `name` with a buffer of `capacity` bytes, four times as large whenever it does not suffice, and
    return the stream that it wrote. Raise ValueError for numbers that the stream cannot hold.
    """
    while True:
        buffer = np.empty(capacity, np.uint8)
        size = getattr(library(True), name)(buffer.ctypes.data, capacity, *arguments)
        if size >= 0:
            return buffer[:size].tobytes()
        if size < -1:
            raise ValueError(f"{name}: got numbers that the stream cannot hold")
        capacity *= 4


def _read(name: str, data: bytes, *arguments) -> None:
    array = np.frombuffer(data, np.uint8) if data else np.zeros(1, np.uint8)
    if not getattr(library(False), name)(array.ctypes.data, len(data), *arguments):
        raise DamagedStream(f"{name}: got {len(data)} bytes that are not such a stream")


# ---- arrays of integers ----


def _code_rows(rows: np.ndarray, unit: int) -> bytes:
    """Code integers (R, 3, F) below 2^30 twice, as motion coefficients and as a table, and return the smaller stream.
    `unit` is the number of consecutive rows that belong together.
    """
    parts = [np.ascontiguousarray(rows[:, :, at : at + SEGMENT_FRAMES]) for at in _blocks(rows.shape[2])]
    coded = [
        _written("bench_rows", 4096 + part.size, len(part), part.shape[2], unit, part.ctypes.data) for part in parts
    ]
    streams = [_join(coded), _code_table(rows.reshape(len(rows), -1))]
    smaller = int(len(streams[1]) < len(streams[0]))
    return bytes([smaller]) + streams[smaller]


def _read_rows(data: bytes, shape: tuple[int, int, int], unit: int) -> np.ndarray:
    """Return the int32 array of shape (rows, 3, frames) that `data` holds. `unit` is the number of consecutive rows
    that were coded together.
    """
    if data[0]:
        return _read_table(data[1:], (shape[0], 3 * shape[2])).reshape(shape)
    rows = np.zeros(shape, np.int32)
    for at, stream in zip(_blocks(shape[2]), _split(data[1:], len(_blocks(shape[2]))), strict=True):
        part = np.zeros((*shape[:2], min(SEGMENT_FRAMES, shape[2] - at)), np.int32)
        _read("bench_rows", stream, len(part), part.shape[2], unit, part.ctypes.data)
        rows[:, :, at : at + SEGMENT_FRAMES] = part
    return rows


def _code_table(table: np.ndarray) -> bytes:
    """Return (R, C) int32 below 2^30."""
    table = table.copy()
    return _written("bench_table", 4096 + 2 * table.size, *table.shape, table.ctypes.data)


def _read_table(data: bytes, shape: tuple[int, int]) -> np.ndarray:
    table = np.zeros(shape, np.int32)
    _read("bench_table", data, *shape, table.ctypes.data)
    return table


def _blocks(frames: int) -> range:
    return range(0, max(1, frames), SEGMENT_FRAMES)


def _join(streams: list[bytes]) -> bytes:
    """Return concatenated streams; all but the last have their length in front."""
    return b"".join(varint(len(stream)) + stream for stream in streams[:-1]) + streams[-1]


def _split(data: bytes, count: int) -> list[bytes]:
    """Return the streams that `data` holds one after the other; a length stands before each but the last."""
    streams, at = [], 0
    for _ in range(count - 1):
        size, at = read_varint(data, at)
        streams.append(data[at : at + size])
        at += size
    return [*streams, data[at:]]


def varint(value: int) -> bytes:
    """Return a non-negative integer as a variable-length integer: 7 bits per byte, low bits first, with the high bit
    set in all bytes but the last.
    """
    if value < 0:
        raise ValueError(f"varint: got {value}; expected a number >= 0")
    result = bytearray()
    while value > 127:
        result.append(value & 127 | 128)
        value >>= 7
    result.append(value)
    return bytes(result)


def read_varint(data: bytes, at: int) -> tuple[int, int]:
    """Read a variable-length integer of `data` that begins at byte `at`. Return its value and the position of the byte
    after it; raise DamagedStream if the data ends before it does.
    """
    value = shift = 0
    while True:
        if at >= len(data):
            raise DamagedStream(f"varint: got the end of the data at byte {at}; expected more")
        value |= (data[at] & 127) << shift
        shift, at = shift + 7, at + 1
        if data[at - 1] < 128:
            return value, at


# ---- parts of an encoding ----


def core_branches(hierarchy: Hierarchy) -> np.ndarray:
    branches = np.zeros(hierarchy.branch_count, BRANCH)
    branches["parent"], branches["count"] = hierarchy.branch_parent, hierarchy.stem_count
    branches["attach"], branches["first"] = hierarchy.attach, hierarchy.first_vertex
    branches["subtree"], branches["depth"] = hierarchy.subtree_branches, hierarchy.branch_depth
    return branches


class Writer:
    """Parts of an encoding, in the order in which they are read. Each method returns what a reader will get."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.values: list[object] = []

    def _add(self, part: bytes, value):
        self.parts.append(part)
        self.values.append(value)
        return value

    def data(self) -> bytes:
        return b"".join(self.parts)

    def echo(self) -> Echo:
        """Return a reader that gives back the values as they were written, without decoding."""
        return Echo(self.values)

    def count(self, value: int) -> int:
        return self._add(varint(value), value)

    def single(self, value: float) -> float:
        value = quantise.single(value)
        return self._add(struct.pack("<f", value), value)

    def rows(self, rows: np.ndarray, unit: int = 1) -> np.ndarray:
        """Return (R, 3, F) integers, coded as motion coefficients are; see bench_rows for `unit`."""
        head = b"".join(map(varint, (len(rows), rows.shape[2], unit)))
        coded, wide = self._integers(rows, lambda part: _code_rows(part, unit))
        return self._add(head + coded, wide)

    def table(self, table: np.ndarray) -> np.ndarray:
        """Return (R, C) integers of any kind; best if neighbours are of similar magnitude."""
        head = b"".join(map(varint, table.shape))
        coded, wide = self._integers(table, _code_table)
        return self._add(head + coded, wide)

    def _integers(self, integers: np.ndarray, code) -> tuple[bytes, np.ndarray]:
        """Code integers with the function `code`, split into several streams if they do not fit 32 bits. Return the
        bytes (the number of streams, and each with its length in front) and the integers as int64.
        """
        integers = np.asarray(integers, np.int64)
        if not integers.size:
            return b"", integers
        if integers.min() > -LARGEST and integers.max() < LARGEST:
            streams = [code(np.ascontiguousarray(integers, np.int32))]
        else:
            limbs = [
                integers & (1 << LOW_BITS) - 1,
                integers >> LOW_BITS & (1 << LOW_BITS) - 1,
                integers >> 2 * LOW_BITS,
            ]
            streams = [code(np.ascontiguousarray(limb, np.int32)) for limb in limbs]
        return varint(len(streams)) + b"".join(varint(len(stream)) + stream for stream in streams), integers

    def bits(self, bits: np.ndarray) -> np.ndarray:
        """Return bits, one per byte, packed and not compressed."""
        return self._add(varint(len(bits)) + np.packbits(bits).tobytes(), bits)

    def pose(self, branches: np.ndarray, lags: Sequence[np.ndarray], step: float, pose: np.ndarray) -> np.ndarray:
        """Quantise a pose (N, 3) by `step` and write it as athcodec codes a rest pose. `lags` has alternative sets of a
        number per branch, the vertices back that predict a vertex; the set that makes the smallest stream is used.
        Return the pose (N, 3) that a decoder gets.
        """
        coded = []
        for lag in lags:
            branches["lag"] = lag
            rest = streams.encode_rest(branches, step, pose)
            table = Writer()
            table.table(lag[None])
            coded.append((table.data(), rest))
        head, rest = min(coded, key=lambda some: len(some[0]) + len(some[1].stream))
        return self._add(head + varint(len(rest.stream)) + rest.stream, rest.decoded)

    def hierarchy(self, hierarchy: Hierarchy) -> Hierarchy:
        branches = core_branches(hierarchy)
        stream = streams.encode_hierarchy(branches, hierarchy.branch_source, hierarchy.vertex_source)
        head = varint(hierarchy.branch_count) + varint(hierarchy.vertex_count) + varint(len(stream))
        return self._add(head + stream, hierarchy)


class Echo:
    """The values of a Writer, one after the other."""

    def __init__(self, values: list[object]):
        self._values = iter(values)

    def _next(self):
        return next(self._values)

    count = single = rows = table = bits = hierarchy = _next

    def pose(self, branches: np.ndarray, step: float) -> np.ndarray:
        return self._next()


class Reader:
    """The parts of an encoding, from its bytes alone."""

    def __init__(self, data: bytes, at: int = 0):
        self._data, self.at = data, at

    def count(self) -> int:
        """Read a number, 7 bits a byte."""
        value, self.at = read_varint(self._data, self.at)
        return value

    def take(self, size: int) -> bytes:
        if self.at + size > len(self._data):
            raise DamagedStream(f"encoding: got {len(self._data)} bytes; expected {self.at + size} at least")
        self.at += size
        return self._data[self.at - size : self.at]

    def single(self) -> float:
        return struct.unpack("<f", self.take(4))[0]

    def rows(self) -> np.ndarray:
        shape, unit = (self.count(), 3, self.count()), self.count()
        return self._integers(shape, lambda data: _read_rows(data, shape, unit))

    def table(self) -> np.ndarray:
        shape = self.count(), self.count()
        return self._integers(shape, lambda data: _read_table(data, shape))

    def _integers(self, shape: tuple[int, ...], decode) -> np.ndarray:
        result = np.zeros(shape, np.int64)
        if result.size:
            for limb in range(self.count()):
                result += decode(self.take(self.count())).astype(np.int64) << limb * LOW_BITS
        return result

    def bits(self) -> np.ndarray:
        count = self.count()
        return np.unpackbits(np.frombuffer(self.take(-(-count // 8)), np.uint8), count=count)

    def pose(self, branches: np.ndarray, step: float) -> np.ndarray:
        """Read the lags of branches into `branches`, records of BRANCH, and return their rest pose, (N, 3) float64,
        whose quantisation step is `step`."""
        branches["lag"] = self.table()[0]
        pose, stream = np.zeros((int(branches["count"].sum()), 3)), self.take(self.count())
        _read("bench_pose", stream, branches.ctypes.data, len(branches), step, pose.ctypes.data)
        return pose

    def hierarchy(self) -> Hierarchy:
        """Read the numbers of branches and vertices and the hierarchy's stream, and return the branch hierarchy."""
        branch_count, vertex_count = self.count(), self.count()
        stream = self.take(self.count())
        branches = np.zeros(branch_count, BRANCH)
        branch_source, vertex_source = np.zeros(branch_count, np.int32), np.zeros(vertex_count, np.int32)
        _read(
            "bench_hierarchy",
            stream,
            branch_count,
            vertex_count,
            branches.ctypes.data,
            branch_source.ctypes.data,
            vertex_source.ctypes.data,
        )
        return Hierarchy.from_parts(
            branches["parent"], branches["count"], branches["attach"], vertex_source, branch_source
        )


# ---- corrections ----


def write_corrections(positions: np.ndarray, wanted: np.ndarray, limit: float) -> bytes:
    """Add quantised corrections in place to float32 positions (N, 3, T), so that every vertex is within `limit` of
    `wanted`, float64 (N, 3, T). Return the bytes that let a decoder add the same corrections.

    The bytes hold the quantisation step, and then a length and a stream for each segment of SEGMENT_FRAMES frames.
    """
    starts = range(0, positions.shape[2], SEGMENT_FRAMES)
    factor = 1.0
    while factor > 1e-3:
        step = quantise.single(quantise.CORRECTION_STEP * limit * factor)
        parts = [np.ascontiguousarray(positions[:, :, at : at + SEGMENT_FRAMES]) for at in starts]
        coded = [
            streams.find_corrections(
                part, np.ascontiguousarray(wanted[:, :, at : at + SEGMENT_FRAMES]), np.zeros(3), limit, step
            )
            for at, part in zip(starts, parts, strict=True)
        ]
        if all(rows is not None for rows in coded):
            break
        factor *= 0.5
    else:
        raise ValueError(f"corrections: got a limit of {limit:.3g}; expected one that float32 positions can keep")
    result = struct.pack("<f", step)
    for at, part, rows in zip(starts, parts, coded, strict=True):
        positions[:, :, at : at + SEGMENT_FRAMES] = part
        stream = streams.encode_corrections(rows, len(part), part.shape[2]) if len(rows) else b""
        result += varint(len(stream)) + stream
    return result


def read_corrections(positions: np.ndarray, reader: Reader) -> None:
    """Read corrections and add them in place to contiguous float32 positions (N, 3, T)."""
    vertices, _, frames = positions.shape
    step = reader.single()
    for at in range(0, frames, SEGMENT_FRAMES):
        stream = reader.take(reader.count())
        if stream:
            _read(
                "bench_corrections",
                stream,
                vertices,
                min(SEGMENT_FRAMES, frames - at),
                step,
                frames,
                positions.ctypes.data + positions.itemsize * at,
            )
