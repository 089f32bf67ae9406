"""Common parts of the programs: layouts, grids, poses, predictors, and the search among them.

A program compresses numbers, not motion. For its best result, the search tries: the vertices in the source's or in the
hierarchy's order; positions, or displacements from the rest pose, the mean pose or the first frame; integers on a grid
as coarse as the bound allows, or floats where the program bounds their error itself; differences over time and along
the vertices, exact on integers; and the program's own layouts and settings. Setups are compared on a piece of the
clip, the best few on all of it. The pose that is subtracted and the order of vertices are stored and counted.
Displacements are taken from the pose as it will be decoded, so that its rounding adds no error. No program is imported
before it is used.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from importlib import import_module
from itertools import product
from types import ModuleType

import numpy as np
import zstandard

from bench.codecs import Source, blocks, largest_error

AXES = {
    "T,N,3": (0, 1, 2),
    "T,3N": (0, 1, 2),
    "N,T,3": (1, 0, 2),
    "3N,T": (1, 2, 0),
    "3,T,N": (2, 0, 1),
    "3,N,T": (2, 1, 0),
    "3|T,N": (2, 0, 1),
    "3|N,T": (2, 1, 0),
}
LAYOUTS = tuple(AXES)  # "3|": three arrays, one per axis
FLAT_LAYOUTS = ("T,N,3", "N,T,3", "3,T,N", "3,N,T", "3N,T")  # Layouts that differ as one row of numbers.

FORMS, ORDERS = ("integers", "floats"), ("source", "hierarchy")
POSES = ("none", "rest", "mean", "first")
PREDICTORS = ("none", "time", "time2", "vertex", "time+vertex", "time2+vertex")
POSE_STEPS = (0.0, 1.0, 0.25)  # Steps of a pose below floats, over the step of the bound's grid; 0: float32, exact.
COARSER = (1.05, 1.03, 1.02, 1.015, 1.01, 1.007, 1.005, 1.003, 1.001, 1.0, 0.999, 0.99, 0.95, 0.9, 0.7, 0.4)
CORNER = 2 / np.sqrt(3)  # step of a grid over the distance from a cell's centre to its corners
NEARLY = COARSER.index(0.999)
SAMPLE_FRAMES = 512
BEAM = 6
HEAD = struct.Struct("<6BII")


class CannotKeep(Exception):
    """No setting of the program keeps the bound on these numbers."""


# ---- one row of bytes ----


def join(blobs: Sequence[bytes]) -> bytes:
    lengths = struct.pack(f"<{1 + len(blobs)}I", len(blobs), *map(len, blobs))
    return lengths + b"".join(blobs)


def split(data: bytes) -> list[bytes]:
    (count,) = struct.unpack_from("<I", data)
    lengths = struct.unpack_from(f"<{count}I", data, 4)
    stops = 4 + 4 * count + np.cumsum(lengths)
    return [data[stop - length : stop] for stop, length in zip(stops.tolist(), lengths, strict=True)]


def deflate(data: bytes, level: int = 19) -> bytes:
    return zstandard.ZstdCompressor(level=level, write_content_size=True).compress(data)


def inflate(data: bytes) -> bytes:
    return zstandard.ZstdDecompressor().decompress(data)


def planes(values: np.ndarray) -> bytes:
    """Return all first bytes, then all second bytes ..."""
    return values.reshape(-1, 1).view(np.uint8).T.tobytes()


def from_planes(data: bytes, dtype: np.dtype | str) -> np.ndarray:
    size = np.dtype(dtype).itemsize
    return np.ascontiguousarray(np.frombuffer(data, np.uint8).reshape(size, -1).T).view(dtype).ravel()


def zigzag(values: np.ndarray) -> np.ndarray:
    """Return signed int32 as uint32, in which small integers of either sign are small."""
    return ((values << 1) ^ (values >> 31)).view(np.uint32)


def from_zigzag(values: np.ndarray) -> np.ndarray:
    values = values.astype(np.uint32)
    return (values >> 1).view(np.int32) ^ -(values & 1).view(np.int32)


def narrowest(values: np.ndarray) -> np.ndarray:
    """Return integers in the smallest integer type that holds them, signed or unsigned as before."""
    low, high = (int(values.min()), int(values.max())) if values.size else (0, 0)
    kind = values.dtype.kind
    for size in (1, 2):
        info = np.iinfo(f"{kind}{size}")
        if info.min <= low and high <= info.max:
            return values.astype(info.dtype)
    return values


def pack_integers(values: np.ndarray) -> bytes:
    """Return (N, k) int32, coded by their differences of order 0 to 2 along N, the order that is smallest."""
    rows = np.ascontiguousarray(values.T)
    coded = []
    for order in range(3):
        coded.append(bytes([order]) + deflate(planes(zigzag(rows))))
        rows = _difference(rows, axis=1)
    return min(coded, key=len)


def unpack_integers(data: bytes, count: int) -> np.ndarray:
    rows = from_zigzag(from_planes(inflate(data[1:]), np.uint32)).reshape(-1, count)
    for _ in range(data[0]):
        rows = _sum(rows, axis=1)
    return np.ascontiguousarray(rows.T)


# ---- arrays ----


def arrays_of(values: np.ndarray, layout: str) -> list[np.ndarray]:
    """Return (T, N, 3) as the arrays that a program gets."""
    frames, vertices, _ = values.shape
    turned = np.ascontiguousarray(values.transpose(AXES[layout]))
    if "|" in layout:
        return list(turned)
    flat = {"T,3N": (frames, 3 * vertices), "3N,T": (3 * vertices, frames)}
    return [turned.reshape(flat.get(layout, turned.shape))]


def array_shapes(shape: tuple[int, int, int], layout: str) -> list[tuple[int, ...]]:
    return [part.shape for part in arrays_of(np.broadcast_to(np.int8(0), shape), layout)]


def from_arrays(pieces: Sequence[np.ndarray], layout: str, shape: tuple[int, int, int]) -> np.ndarray:
    """Return the inverse of arrays_of."""
    turned = np.concatenate([piece.reshape(-1) for piece in pieces])
    turned = turned.reshape([shape[axis] for axis in AXES[layout]])
    return np.ascontiguousarray(turned.transpose(np.argsort(AXES[layout])))


def _difference(values: np.ndarray, axis: int) -> np.ndarray:
    """Return differences modulo 2**32; the first rows stay as they are."""
    first = np.take(values, [0], axis=axis)
    return np.concatenate([first, np.diff(values, axis=axis)], axis=axis)


def _sum(values: np.ndarray, axis: int) -> np.ndarray:
    return np.cumsum(values, axis=axis, dtype=np.int32)


def predict(values: np.ndarray, predictor: str) -> np.ndarray:
    """Return (T, N, 3) int32 residuals; exact, modulo 2**32."""
    for axis in _predictor_axes(predictor):
        values = _difference(values, axis)
    return values


def unpredict(values: np.ndarray, predictor: str) -> np.ndarray:
    for axis in _predictor_axes(predictor):
        values = _sum(values, axis)
    return values


def _predictor_axes(predictor: str) -> list[int]:
    """Return the axes along which a predictor such as "time+vertex" takes differences: 0 for time, 1 for vertices."""
    names = {"none": [], "time": [0], "time2": [0, 0], "vertex": [1]}
    return [axis for name in predictor.split("+") for axis in names[name]]


def ordered_bits(values: np.ndarray) -> np.ndarray:
    """Return float32 as int32 in the same order; the inverse is the same function with the types exchanged."""
    bits = np.ascontiguousarray(values, np.float32).view(np.int32)
    return np.where(bits < 0, bits ^ np.int32(0x7FFFFFFF), bits)


def from_ordered_bits(bits: np.ndarray) -> np.ndarray:
    return np.where(bits < 0, bits ^ np.int32(0x7FFFFFFF), bits).view(np.float32)


# ---- a clip, and its grid ----


@dataclass(frozen=True)
class Grid:
    """Integers to positions: origin + step * integer."""

    step: float
    origin: tuple[float, float, float]

    def integers(self, positions: np.ndarray) -> np.ndarray:
        """Return positions as int32 multiples of the grid's step. Raise CannotKeep if int32 is too small."""
        integers = np.empty(positions.shape, np.int32)
        for block in blocks(positions):
            scaled = np.rint((positions[block].astype(np.float64) - self.origin) / self.step)
            if not np.abs(scaled).max() < 2**31:
                raise CannotKeep(f"grid of {self.step:g}: got more than 31 bits; expected a coarser bound")
            integers[block] = scaled
        return integers

    def positions(self, integers: np.ndarray) -> np.ndarray:
        positions = np.empty(integers.shape, np.float32)
        for block in blocks(integers):
            positions[block] = integers[block] * self.step + self.origin
        return positions

    def keeps(self, positions: np.ndarray, bound: float) -> bool:
        parts = (positions[block] for block in blocks(positions))
        return all(largest_error(part, self.positions(self.integers(part))) <= bound for part in parts)

    def pack(self) -> bytes:
        return struct.pack("<4d", self.step, *self.origin)

    @classmethod
    def unpack(cls, data: bytes) -> Grid:
        step, *origin = struct.unpack("<4d", data)
        return cls(step, tuple(origin))


@dataclass
class Case:
    """A clip in one order of its vertices, and values computed once for all setups."""

    positions: np.ndarray
    rest: np.ndarray
    exact: bool
    order: np.ndarray | None = None  # where in the source each vertex is; None: in place
    _known: dict = field(default_factory=dict)

    @cached_property
    def permutation(self) -> bytes:
        return b"" if self.order is None else pack_integers(self.order.astype(np.int32)[:, None])

    def pose(self, name: str) -> np.ndarray:
        if name == "mean":
            return self.positions.mean(axis=0, dtype=np.float64)
        return self.rest if name == "rest" else self.positions[0]

    def grid(self, bound: float, search: bool) -> Grid:
        """Return the coarsest grid that keeps the bound; if `search` is false, for a piece, nearly that grid."""
        if "grid" not in self._known:
            origin = tuple(self.positions.reshape(-1, 3).min(axis=0).astype(float).tolist())
            grids = [Grid(CORNER * bound * factor, origin) for factor in COARSER]
            self._known["grid"] = self._coarsest(grids, bound) if search else grids[NEARLY]
        if self._known["grid"] is None:
            raise CannotKeep(f"bound: got {bound:g}; expected more than the spacing of float32 there")
        return self._known["grid"]

    def _coarsest(self, grids: list[Grid], bound: float) -> Grid | None:
        try:
            return next((grid for grid in grids if grid.keeps(self.positions, bound)), None)
        except CannotKeep:
            return None

    def integers(self, bound: float, search: bool) -> np.ndarray:
        """Return positions on the grid, or the bits of the floats if all must come back."""
        if "integers" not in self._known:
            turn = ordered_bits if self.exact else self.grid(bound, search).integers
            self._known["integers"] = turn(self.positions)
        return self._known["integers"]

    def piece(self, values: int) -> Case:
        """Return a case with neighbouring vertices and frames only, of about `values` numbers."""
        frames, vertices, _ = self.positions.shape
        length = min(frames, SAMPLE_FRAMES)
        width = min(vertices, max(64, values // (3 * length)))
        first, start = (vertices - width) // 2, (frames - length) // 2
        columns = slice(first, first + width)
        positions = np.ascontiguousarray(self.positions[start : start + length, columns])
        order = None if self.order is None else self.order[columns]
        return Case(positions, self.rest[columns], self.exact, order)


def cases_of(source: Source, exact: bool) -> dict[str, Case]:
    """Return a case for each order of vertices; the hierarchy's order only if it differs from the source's."""
    cases = {"source": Case(source.positions, source.rest, exact)}
    order = np.asarray(source.hierarchy.vertex_source)
    if not np.array_equal(order, np.arange(len(order))):
        cases["hierarchy"] = Case(source.positions[:, order], source.rest[order], exact, order)
    return cases


# ---- a program ----


@dataclass(frozen=True)
class Setup:
    """All settings; `choice` is an index into the program's own."""

    form: str
    order: str = "source"
    pose: str = "rest"
    pose_step: float = 1.0
    predictor: str = "none"
    choice: int = 0


class Program:
    """A program as a Codec; see bench.codecs. Subclasses define how it encodes integers, floats or both.
    `choices(form)` lists the program's own settings; `encode_*` and `decode_*` get one of them. Floats have a
    strength: the error that a value may have, or one of `strengths`, the exactest last; None: exact.
    """

    name = ""
    kind = "program"
    module = ""
    package = ""
    forms: tuple[str, ...] = ("integers",)
    lossless_forms: tuple[str, ...] = ("integers",)
    predictors: tuple[str, ...] = PREDICTORS
    strengths: Sequence[int] | None = None
    sample_values = 300_000
    keep = 3

    def __init__(self, lossless: bool = False) -> None:
        self.lossless = lossless
        self.settings: dict = {}
        if lossless:
            self.name = f"{self.name}, lossless"

    def missing(self) -> str | None:
        try:
            self.load()
        except ModuleNotFoundError:
            return f"not installed: pip install {self.package}"
        except (ImportError, ValueError, AttributeError, OSError) as error:  # built for another NumPy, say
            return f"not usable: pip install {self.package}: {' '.join(str(error).split())}"
        return None

    def load(self) -> ModuleType:
        return import_module(self.module)

    def choices(self, form: str) -> list:
        return list(LAYOUTS)

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        raise NotImplementedError

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        raise NotImplementedError

    def encode_floats(self, values: np.ndarray, strength: float | None, choice, thorough: bool) -> bytes:
        raise NotImplementedError

    def decode_floats(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        raise NotImplementedError

    # -- the Codec --

    def encode(self, source: Source, bound: float) -> bytes:
        """Return the smallest encoding found that keeps `bound`, in scene units; raise CannotKeep if none does."""
        cases = cases_of(source, self.lossless)
        pieces = {order: case.piece(self.sample_values) for order, case in cases.items()}
        sizes: dict[Setup, float] = {}
        forms = self.lossless_forms if self.lossless else self.forms
        for form, order in product(forms, cases):
            self._descend(form, order, lambda setup: self._size(pieces, setup, bound, sizes))
        ranked = sorted(
            (size, number, setup) for number, (setup, size) in enumerate(sizes.items()) if np.isfinite(size)
        )
        # a setup that fails on the whole clip is replaced by the next
        done: list[tuple[bytes, Setup]] = []
        for _, _, setup in ranked:
            data = self._write(cases[setup.order], setup, bound, thorough=True)
            done += [] if data is None else [(data, setup)]
            if len(done) == self.keep:
                break
        if not done:
            raise CannotKeep(f"{self.name}: got a bound of {bound:g}; found no setting that keeps it")
        data, setup = min(done, key=lambda pair: len(pair[0]))
        self.settings = self._words(setup)
        return data

    def decode(self, data: bytes) -> np.ndarray:
        """Return the float32 positions (T, N, 3) that `encode` has packed into `data`."""
        head, *rest = split(data)
        form, exact, pose, predictor, reordered, choice, frames, vertices = HEAD.unpack(head)
        choice = self.choices(FORMS[form])[choice]
        shape = (frames, vertices, 3)
        order = unpack_integers(rest.pop(), vertices)[:, 0] if reordered else None
        read = self._read_integers if FORMS[form] == "integers" else self._read_floats
        decoded = read(rest, shape, bool(exact), POSES[pose], PREDICTORS[predictor], choice)
        if order is None:
            return decoded
        placed = np.empty_like(decoded)
        placed[:, order] = decoded
        return placed

    def _words(self, setup: Setup) -> dict:
        """Return the setup without settings that its form does not use."""
        unused = "predictor" if setup.form == "floats" else "pose_step"
        words = {name: value for name, value in asdict(setup).items() if name != unused}
        if setup.pose == "none":
            words.pop("pose_step", None)
        return {**words, "choice": self.choices(setup.form)[setup.choice]}

    # -- choosing --

    def _descend(self, form: str, order: str, size: Callable[[Setup], float]) -> None:
        """Search the settings of one form and vertex order for the smallest `size`, and then poses for the best few."""
        integers = form == "integers"
        predictors = self.predictors if integers else ("none",)
        steps = (1.0,) if integers else POSE_STEPS
        poses = [("none", 1.0), *product(POSES[1:], steps)]
        if self.lossless and not integers:
            poses = poses[:1]
        pose, step = poses[-1]
        heads = [Setup(form, order, pose, step)]
        for _ in range(2):
            candidates = [
                replace(heads[0], predictor=predictor, choice=choice)
                for predictor, choice in product(predictors, range(len(self.choices(form))))
            ]
            heads = sorted(candidates, key=size)[:BEAM]
            heads = sorted(
                (replace(head, pose=pose, pose_step=step) for head, (pose, step) in product(heads, poses)), key=size
            )

    def _size(self, pieces: dict[str, Case], setup: Setup, bound: float, sizes: dict[Setup, float]) -> float:
        if setup not in sizes:
            case = pieces[setup.order]
            data = self._write(case, setup, bound, thorough=False)
            sizes[setup] = float("inf") if data is None else len(data)
        return sizes[setup]

    # -- writing and reading --

    def _write(self, case: Case, setup: Setup, bound: float, thorough: bool) -> bytes | None:
        write = self._write_integers if setup.form == "integers" else self._write_floats
        try:
            blobs = write(case, setup, bound, thorough)
        except CannotKeep:
            return None
        head = HEAD.pack(
            FORMS.index(setup.form),
            self.lossless,
            POSES.index(setup.pose),
            PREDICTORS.index(setup.predictor),
            bool(case.permutation),
            setup.choice,
            *case.positions.shape[:2],
        )
        return join([head, *blobs, *filter(None, [case.permutation])])

    def _write_integers(self, case: Case, setup: Setup, bound: float, thorough: bool) -> list[bytes]:
        values, grid, pose = case.integers(bound, thorough), b"", b""
        turn = ordered_bits
        if not self.lossless:
            grid, turn = case.grid(bound, thorough).pack(), case.grid(bound, thorough).integers
        if setup.pose != "none":
            reference = turn(case.pose(setup.pose))
            values, pose = values - reference, self._kept_pose(case, setup, reference)
        payload = self.encode_integers(
            predict(values, setup.predictor), self.choices("integers")[setup.choice], thorough
        )
        return [grid, pose, payload]

    @staticmethod
    def _kept_pose(case: Case, setup: Setup, reference: np.ndarray) -> bytes:
        if (setup.pose, "packed") not in case._known:
            case._known[setup.pose, "packed"] = pack_integers(reference)
        return case._known[setup.pose, "packed"]

    def _read_integers(
        self, blobs: list[bytes], shape: tuple[int, int, int], exact: bool, pose: str, predictor: str, choice
    ) -> np.ndarray:
        grid, packed, payload = blobs
        values = self.decode_integers(payload, shape, choice).astype(np.int32, copy=False)
        values = unpredict(values, predictor)
        if pose != "none":
            values = values + unpack_integers(packed, shape[1])
        return from_ordered_bits(values) if exact else Grid.unpack(grid).positions(values)

    def _write_floats(self, case: Case, setup: Setup, bound: float, thorough: bool) -> list[bytes]:
        numbers, packed, pose = self._pose_of_floats(case, setup, bound)
        values = case.positions if setup.pose == "none" else case.positions - pose
        choice = self.choices("floats")[setup.choice]

        def encode(strength: float | None) -> tuple[bytes, float]:
            data = self.encode_floats(values, strength, choice, thorough)
            decoded = self.decode_floats(data, values.shape, choice)
            if setup.pose != "none":
                decoded = (pose + decoded).astype(np.float32)
            return data, largest_error(case.positions, decoded)

        if self.lossless:
            data = self.encode_floats(values, None, choice, thorough)
            decoded = self.decode_floats(data, values.shape, choice)
            if not np.array_equal(decoded.view(np.uint32), values.view(np.uint32)):
                raise CannotKeep(f"{self.name}: got other bits back; expected the same")
        elif self.strengths is not None:
            data = _weakest(encode, self.strengths, bound)
        else:
            data = _fitted(encode, bound, 9 if thorough else 3)
        return [numbers, packed, data]

    def _pose_of_floats(self, case: Case, setup: Setup, bound: float) -> tuple[bytes, bytes, np.ndarray]:
        """Return the pose's grid as bytes, the coded pose, and the pose (N, 3) that a decoder gets."""
        if setup.pose == "none":
            return b"", b"", np.zeros((1, 3), np.float32)
        key = (setup.pose, setup.pose_step)
        if key not in case._known:
            pose = case.pose(setup.pose)
            if setup.pose_step == 0:
                pose = pose.astype(np.float32)
                case._known[key] = (b"", _pack_exact(pose), pose)
            else:
                origin = tuple(pose.min(axis=0).astype(float).tolist())
                grid = Grid(CORNER * bound * setup.pose_step, origin)
                integers = grid.integers(pose)
                case._known[key] = (grid.pack(), pack_integers(integers), grid.positions(integers))
        return case._known[key]

    def _read_floats(
        self, blobs: list[bytes], shape: tuple[int, int, int], exact: bool, pose: str, predictor: str, choice
    ) -> np.ndarray:
        numbers, packed, payload = blobs  # a float's predictor is the program's own
        values = self.decode_floats(payload, shape, choice)
        if pose == "none":
            return values
        if numbers:
            reference = Grid.unpack(numbers).positions(unpack_integers(packed, shape[1]))
        else:
            reference = _unpack_exact(packed, shape[1])
        return (reference + values).astype(np.float32)


def _pack_exact(pose: np.ndarray) -> bytes:
    """Return (N, 3) float32 and zstd: row after row, axis after axis, or their bits as integers."""
    ways = {b"r": deflate(pose.tobytes()), b"a": deflate(pose.T.tobytes()), b"i": pack_integers(ordered_bits(pose))}
    way = min(ways, key=lambda name: len(ways[name]))
    return way + ways[way]


def _unpack_exact(data: bytes, count: int) -> np.ndarray:
    if data[:1] == b"i":
        return from_ordered_bits(unpack_integers(data[1:], count))
    flat = np.frombuffer(inflate(data[1:]), np.float32)
    return flat.reshape(count, 3) if data[:1] == b"r" else flat.reshape(3, count).T


def _weakest(encode: Callable[[int], tuple[bytes, float]], strengths: Sequence[int], bound: float) -> bytes:
    """Return the bytes at the first strength that keeps the bound, by bisection; strengths grow in exactness."""
    data, error = encode(strengths[-1])
    if not error <= bound:
        raise CannotKeep("exactest setting: beyond the bound")
    low, high = 0, len(strengths) - 1
    while low < high:
        middle = (low + high) // 2
        tried, error = encode(strengths[middle])
        if error <= bound:
            data, high = tried, middle
        else:
            low = middle + 1
    return data


def _fitted(encode: Callable[[float], tuple[bytes, float]], bound: float, trials: int) -> bytes:
    """Return the smallest bytes within the bound: the program's allowed error is adjusted in `trials` steps."""
    allowed, kept, broken, best = bound / np.sqrt(3), 0.0, np.inf, None
    for trial in range(trials + 20):
        data, error = encode(allowed)
        if error <= bound:
            kept = max(kept, allowed)
            best = data if best is None or len(data) < len(best) else best
        else:
            broken = min(broken, allowed)
        if best is not None and (trial + 1 >= trials or broken < 1.003 * kept):
            return best
        scale = np.clip(0.998 * bound / error if error > 0 else 8.0, 0.05, 8.0)
        allowed *= scale
        if kept and not kept < allowed < broken:
            allowed = np.sqrt(kept * min(broken, 1.1 * kept))
        elif allowed >= broken:
            allowed = 0.9 * broken
    raise CannotKeep("allowed error: no value keeps the bound")


def encode_arrays(encode: Callable[[np.ndarray], bytes], values: np.ndarray, layout: str) -> bytes:
    """Encode every array of a layout separately."""
    return join([encode(part) for part in arrays_of(values, layout)])


def decode_arrays(
    decode: Callable[[bytes, tuple[int, ...]], np.ndarray], data: bytes, layout: str, shape: tuple[int, int, int]
) -> np.ndarray:
    """Return the inverse of encode_arrays: `decode` gets bytes and a shape."""
    blobs: Iterable[bytes] = split(data)
    return from_arrays(
        [decode(blob, part) for blob, part in zip(blobs, array_shapes(shape, layout), strict=True)], layout, shape
    )
