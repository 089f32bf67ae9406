"""The least that a codec of motion has to beat: integers on a grid, differences, and zstd at level 19.

The grid is as fine as the bound needs in its cells' corners; differences are of degree 0 to 2 in time and 0 to 2 from
vertex to vertex in the source's order, then bytes are shuffled. All are tried, in four orders of the numbers. There is
no rest pose, no branch and no search for a coarser step.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from itertools import product

import numpy as np

from bench.codecs import Source, largest_error
from bench.codecs.coder import read_varint, varint
from bench.codecs.program import (
    CORNER,
    CannotKeep,
    arrays_of,
    deflate,
    from_arrays,
    from_planes,
    from_zigzag,
    inflate,
    narrowest,
    planes,
    zigzag,
)

NAME = "simple (differences, zstd)"
LAYOUTS = ("T,N,3", "N,T,3", "3,T,N", "3,N,T")
# Factors of the grid's step, for when rounding to float32 breaks the bound.
FINER = (1.0, 0.999, 0.99, 0.95, 0.9, 0.7, 0.5)
FEW_NUMBERS = 300_000  # up to which every setup is tried at the final level
FINALISTS = 4
QUICK_LEVEL, LEVEL = 3, 19


@dataclass(frozen=True)
class Setup:
    """Degrees of the differences, and the order of the numbers."""

    in_time: int
    along: int
    layout: int


SETUPS = [Setup(*values) for values in product(range(3), range(3), range(len(LAYOUTS)))]


class Simple:
    """A Codec; see bench.codecs."""

    name, kind = NAME, "baseline"

    def __init__(self) -> None:
        self.settings: dict = {}

    def missing(self) -> str | None:
        return None

    def encode(self, source: Source, bound: float) -> bytes:
        """Return the clip as integers on a grid, in differences and compressed by zstd, with every vertex within
        `bound`, in scene units. Of several layouts and differences the smallest result is kept.
        """
        step, integers = _on_grid(source.positions, bound)
        low = integers.min(axis=(0, 1))
        numbers = (integers - low).astype(np.int32)
        setups = SETUPS
        if numbers.size > FEW_NUMBERS:
            setups = sorted(setups, key=lambda setup: len(_packed(numbers, setup, QUICK_LEVEL)))[:FINALISTS]
        body, best = min(((_packed(numbers, setup, LEVEL), setup) for setup in setups), key=lambda pair: len(pair[0]))
        self.settings = {"in_time": best.in_time, "along": best.along, "layout": LAYOUTS[best.layout]}
        counts = [*numbers.shape[:2], *(int(value) for value in 2 * np.abs(low) + (low < 0))]
        return bytes([SETUPS.index(best)]) + struct.pack("<f", step) + b"".join(map(varint, counts)) + body

    def decode(self, data: bytes) -> np.ndarray:
        """Return the positions (T, N, 3) that `encode` has packed."""
        setup = SETUPS[data[0]]
        (step,) = struct.unpack_from("<f", data, 1)
        at, counts = 5, []
        for _ in range(5):
            value, at = read_varint(data, at)
            counts.append(value)
        frames, vertices, *corner = counts
        low = np.array([-(value >> 1) if value & 1 else value >> 1 for value in corner])
        numbers = _unpacked(data[at:], setup, (frames, vertices, 3))
        return _positions(numbers.astype(np.int64) + low, step)


def _on_grid(positions: np.ndarray, bound: float) -> tuple[float, np.ndarray]:
    """Return the spacing of a grid, exact in float32, and the positions (T, N, 3) rounded to it as int64 that span less
    than 31 bits. Raise CannotKeep if no such grid keeps `bound`.
    """
    for factor in FINER:
        step = float(np.float32(CORNER * bound * factor))
        integers = np.rint(positions.astype(np.float64) / step).astype(np.int64)
        if np.ptp(integers, axis=(0, 1)).max() >= 2**31:
            break
        if largest_error(positions, _positions(integers, step)) <= bound:
            return step, integers
    raise CannotKeep(f"bound: got {bound:g}; expected one that 31 bits can keep")


def _positions(integers: np.ndarray, step: float) -> np.ndarray:
    return (integers * step).astype(np.float32)


def _packed(numbers: np.ndarray, setup: Setup, level: int) -> bytes:
    """Return the width of the residuals in bytes, and these."""
    for axis in _axes(setup):
        numbers = np.diff(numbers, axis=axis, prepend=np.int32(0))  # modulo 2**32
    [row] = arrays_of(narrowest(zigzag(numbers)), LAYOUTS[setup.layout])
    return bytes([row.itemsize]) + deflate(planes(row.ravel()), level)


def _unpacked(data: bytes, setup: Setup, shape: tuple[int, int, int]) -> np.ndarray:
    row = from_planes(inflate(data[1:]), f"u{data[0]}")
    numbers = from_zigzag(from_arrays([row], LAYOUTS[setup.layout], shape))
    for axis in _axes(setup):
        numbers = np.cumsum(numbers, axis=axis, dtype=np.int32)
    return numbers


def _axes(setup: Setup) -> list[int]:
    return [0] * setup.in_time + [1] * setup.along


SIMPLE = (Simple,)
