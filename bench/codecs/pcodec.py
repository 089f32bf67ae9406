"""pcodec (Loncaric and others 2025; pcodec): numbers in bins by their distribution, after differences.

It is lossless; its input are integers on the coarsest grid within the bound, in every order of the numbers,
with its own choice of differences, none, first or second ones, or its linear prediction. Left out:
its modes for floats, which are useless on a grid.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from bench.codecs.program import FLAT_LAYOUTS, Program, decode_arrays, encode_arrays

DELTAS = ("auto", "none", "first", "second", "convolution 4", "convolution 16")


class Pcodec(Program):
    name, module, package = "pcodec", "pcodec", "pcodec"

    def choices(self, form: str) -> list:
        return list(product((*FLAT_LAYOUTS, "3|T,N", "3|N,T"), DELTAS))

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        pcodec = self.load()
        layout, delta = choice
        spec = pcodec.DeltaSpec
        specs = {
            "auto": spec.auto,
            "none": spec.no_op,
            "first": lambda: spec.try_consecutive(1),
            "second": lambda: spec.try_consecutive(2),
            "convolution 4": lambda: spec.try_conv1(4),
            "convolution 16": lambda: spec.try_conv1(16),
        }
        config = pcodec.ChunkConfig(compression_level=12 if thorough else 8, delta_spec=specs[delta]())
        return encode_arrays(lambda part: pcodec.standalone.simple_compress(part.ravel(), config), values, layout)

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        decompress = self.load().standalone.simple_decompress
        return decode_arrays(lambda blob, part: decompress(blob).reshape(part), data, choice[0], shape)
