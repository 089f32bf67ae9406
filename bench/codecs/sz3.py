"""SZ3 (Liang and others, IEEE Trans. Big Data 2023; pysz): prediction within an absolute error bound.

Lorenzo and regression, interpolation, or its choice of both, in every layout. Its bound holds for single
values; it is adjusted until the resulting distances just keep the bound. Left out: its relative
and norm bounds.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from bench.codecs.program import LAYOUTS, Program, decode_arrays, encode_arrays

ALGORITHMS = ("LORENZO_REG", "INTERP_LORENZO", "INTERP")


class Sz3(Program):
    name, module, package = "SZ3", "pysz", "pysz"
    forms = lossless_forms = ("floats",)

    def choices(self, form: str) -> list:
        return list(product(LAYOUTS, ("LOSSLESS",) if self.lossless else ALGORITHMS))

    def encode_floats(self, values: np.ndarray, strength: float | None, choice, thorough: bool) -> bytes:
        """Return float values as SZ3 compresses them. `strength` is the absolute error bound (None: lossless), `choice`
        a pair of the array's layout and SZ3's algorithm; `thorough` changes nothing.
        """
        pysz = self.load()
        layout, algorithm = choice

        def encode(part: np.ndarray) -> bytes:
            config = pysz.szConfig(part.shape)
            config.errorBoundMode = pysz.szErrorBoundMode.ABS
            config.absErrorBound = float(strength or 0.0)
            config.cmprAlgo = getattr(pysz.szAlgorithm, algorithm)
            return pysz.sz.compress(part, config)[0].tobytes()

        return encode_arrays(encode, values, layout)

    def decode_floats(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        pysz = self.load()

        def decode(blob: bytes, part: tuple[int, ...]) -> np.ndarray:
            return pysz.sz.decompress(np.frombuffer(blob, np.uint8), np.float32, part)[0]

        return decode_arrays(decode, data, choice[0], shape)
