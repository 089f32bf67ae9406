"""float16, or integers of as many bits as the bound needs, and zstd at level 19: without a codec.

Halves keep a bound only where displacements are small against it; integers on its grid always do. Bytes are
shuffled where that is smaller. Left out: an entropy coder (see the baselines).
"""

from __future__ import annotations

from itertools import product

import numpy as np

from bench.codecs.program import (
    FLAT_LAYOUTS,
    CannotKeep,
    Program,
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


class Half(Program):
    name, module, package = "float16 or integers + zstd", "zstandard", "zstandard"
    forms = ("integers", "floats")
    strengths = (0,)  # a half is a half
    sample_values = 90_000

    def choices(self, form: str) -> list:
        """(layout, shuffled)."""
        return list(product(FLAT_LAYOUTS, (True, False)))

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        numbers = narrowest(zigzag(values))
        return bytes([numbers.itemsize]) + _packed(numbers, choice, thorough)

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        return from_zigzag(_unpacked(data[1:], f"u{data[0]}", choice, shape))

    def encode_floats(self, values: np.ndarray, strength: float | None, choice, thorough: bool) -> bytes:
        if np.abs(values).max() > np.finfo(np.float16).max:
            raise CannotKeep("float16: got values beyond its range")
        return _packed(values.astype(np.float16), choice, thorough)

    def decode_floats(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        return _unpacked(data, "f2", choice, shape).astype(np.float32)


def _packed(numbers: np.ndarray, choice, thorough: bool) -> bytes:
    layout, shuffled = choice
    [row] = arrays_of(numbers, layout)
    return deflate(planes(row.ravel()) if shuffled else row.tobytes(), 19 if thorough else 9)


def _unpacked(data: bytes, dtype: str, choice, shape: tuple[int, int, int]) -> np.ndarray:
    layout, shuffled = choice
    raw = inflate(data)
    return from_arrays([from_planes(raw, dtype) if shuffled else np.frombuffer(raw, dtype)], layout, shape)
