"""zfp (Lindstrom, IEEE TVCG 2014; zfpy): block transform coding with a fixed accuracy.

Its tolerance counts in powers of two only, and is far from reached in blocks of three dimensions: the values
are scaled before it, so that any tolerance can be had, and the one whose distances just keep the bound is
searched. Left out: its fixed rate and precision, which spend more at the same largest error.
"""

from __future__ import annotations

import struct

import numpy as np

from bench.codecs.program import Program, decode_arrays, encode_arrays


class Zfp(Program):
    name, module, package = "zfp", "zfpy", "zfpy"
    forms = lossless_forms = ("floats",)

    def encode_floats(self, values: np.ndarray, strength: float | None, choice, thorough: bool) -> bytes:
        zfpy = self.load()
        scale = np.float32(1 / strength) if strength else np.float32(1)
        tolerance = {"tolerance": 1.0} if strength else {}  # without one it is reversible
        return struct.pack("<f", scale) + encode_arrays(
            lambda part: zfpy.compress_numpy(part * scale, **tolerance), values, choice
        )

    def decode_floats(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        zfpy = self.load()
        (scale,) = struct.unpack_from("<f", data)
        decoded = decode_arrays(lambda blob, part: zfpy.decompress_numpy(blob), data[4:], choice, shape)
        return decoded if scale == 1 else (decoded / np.float64(scale)).astype(np.float32)
