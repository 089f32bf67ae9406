"""fpzip (Lindstrom and Isenburg, IEEE TVCG 2006): Lorenzo prediction and range coding of floats.

Its own loss cuts mantissas, which bounds the relative error; or integers on a grid are given to it as floats
from 1 to 2, where a cut mantissa is a uniform step and nothing more is lost.
"""

from __future__ import annotations

import struct

import numpy as np

from bench.codecs.program import CannotKeep, Program, decode_arrays, encode_arrays

MANTISSA, SINGLE, DOUBLE = 23, 9, 12  # bits of a float's mantissa; of sign and exponent


class Fpzip(Program):
    name, module, package = "fpzip", "fpzip", "fpzip"
    forms, lossless_forms = ("integers", "floats"), ("floats",)
    strengths = tuple(range(10, 33))

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        low = int(values.min())
        bits = max(1, (int(values.max()) - low).bit_length())
        kind, spare = (np.float32, SINGLE) if bits <= MANTISSA else (np.float64, DOUBLE)
        floats = (1 + (values - np.float64(low)) * 0.5**bits).astype(kind)
        return struct.pack("<qB", low, bits) + self._encoded(floats, spare + bits, choice)

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        low, bits = struct.unpack_from("<qB", data)
        floats = self._decoded(data[9:], shape, choice)
        return (np.rint((floats.astype(np.float64) - 1) * 2.0**bits) + low).astype(np.int32)

    def encode_floats(self, values: np.ndarray, strength: float | None, choice, thorough: bool) -> bytes:
        return self._encoded(values, int(strength or 0), choice)

    def decode_floats(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        return self._decoded(data, shape, choice)

    def _encoded(self, values: np.ndarray, precision: int, choice) -> bytes:
        fpzip = self.load()

        def encode(part: np.ndarray) -> bytes:
            try:
                return fpzip.compress(np.require(part, requirements=["C", "W"]), precision=precision)
            except fpzip.FpzipError as error:
                raise CannotKeep(f"fpzip: {error}") from error

        return encode_arrays(encode, values, choice)

    def _decoded(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        fpzip = self.load()
        return decode_arrays(lambda blob, part: fpzip.decompress(blob).reshape(part), data, choice, shape)
