"""Blosc2 (blosc2): shuffled bytes or bits, with zstd at its highest level, in one block.

Integers on the grid of the bound, or floats whose mantissas are rounded to as few bits as the bound allows
(rounded, not cut as its own filter does: half the error for the same bits). Left out: the codecs that it
carries as plug-ins.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from bench.codecs.program import FLAT_LAYOUTS, Program, decode_arrays, encode_arrays, from_zigzag, narrowest, zigzag

FILTERS = ("SHUFFLE", "BITSHUFFLE", "BYTEDELTA")
MANTISSA = 23


class Blosc2(Program):
    name, module, package = "Blosc2", "blosc2", "blosc2"
    forms = ("integers", "floats")
    strengths = tuple(range(MANTISSA + 1))
    sample_values = 90_000

    def choices(self, form: str) -> list:
        """Return (layout, filter, zigzag)."""
        return list(product(FLAT_LAYOUTS, FILTERS, (True, False) if form == "integers" else (False,)))

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        layout, filters, folded = choice
        numbers = narrowest(zigzag(values) if folded else values)
        packed = encode_arrays(lambda part: self._packed(part, filters, thorough), numbers, layout)
        return bytes([numbers.itemsize]) + packed

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        layout, _, folded = choice
        numbers = self._unpacked(data[1:], f"{'u' if folded else 'i'}{data[0]}", layout, shape)
        return from_zigzag(numbers) if folded else numbers.astype(np.int32)

    def encode_floats(self, values: np.ndarray, strength: float | None, choice, thorough: bool) -> bytes:
        layout, filters, _ = choice
        rounded = _rounded(values, MANTISSA if strength is None else int(strength))
        return encode_arrays(lambda part: self._packed(part, filters, thorough), rounded, layout)

    def decode_floats(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        return self._unpacked(data, "f4", choice[0], shape)

    def _packed(self, part: np.ndarray, filters: str, thorough: bool) -> bytes:
        """Compress an array with Blosc2 and return the bytes. `filters` names Blosc2's filter, and `thorough` selects
        the highest level of zstd and tries a second block size.
        """
        blosc2 = self.load()
        pipeline = (
            [blosc2.Filter.SHUFFLE, blosc2.Filter.BYTEDELTA]
            if filters == "BYTEDELTA"
            else [getattr(blosc2.Filter, filters)]
        )
        metas = [0, part.itemsize] if filters == "BYTEDELTA" else [0]
        block = min(part.nbytes, blosc2.MAX_BLOCKSIZE)
        tries = [block, 0] if thorough else [block]  # 0: its own choice
        settings = {
            "codec": blosc2.Codec.ZSTD,
            "clevel": 9 if thorough else 5,
            "filters": pipeline,
            "filters_meta": metas,
            "typesize": part.itemsize,
            "nthreads": 1,
        }
        return min((blosc2.compress2(part, blocksize=size, **settings) for size in tries), key=len)

    def _unpacked(self, data: bytes, dtype: str, layout: str, shape: tuple[int, int, int]) -> np.ndarray:
        decompress = self.load().decompress2
        return decode_arrays(
            lambda blob, part: np.frombuffer(decompress(blob, nthreads=1), dtype).reshape(part), data, layout, shape
        )


def _rounded(values: np.ndarray, bits: int) -> np.ndarray:
    """Return floating-point values rounded to the nearest values whose mantissas have `bits` bits."""
    cut = MANTISSA - bits
    if cut == 0:
        return values
    words = np.ascontiguousarray(values).view(np.uint32)
    sign, size = words & np.uint32(1 << 31), words & np.uint32((1 << 31) - 1)
    nearest = (size + np.uint32(1 << (cut - 1))) >> np.uint32(cut) << np.uint32(cut)
    return (sign | nearest).view(np.float32)
