"""All programs that the benchmark compares with, each as installed from a package index.

Only NumPy and zstandard are imported here; Codec.missing reports a program that is not installed. `lossless()` are
those with a lossless mode.
"""

from __future__ import annotations

from bench.codecs import Codec
from bench.codecs.blosc2 import Blosc2
from bench.codecs.draco import Draco
from bench.codecs.fpzip import Fpzip
from bench.codecs.half import Half
from bench.codecs.meshopt import Meshopt
from bench.codecs.pcodec import Pcodec
from bench.codecs.sz3 import Sz3
from bench.codecs.usd import UsdIntegers, UsdPoints
from bench.codecs.zfp import Zfp

CLASSES = (Sz3, Zfp, Fpzip, Pcodec, Draco, Meshopt, UsdPoints, UsdIntegers, Blosc2, Half)
PROGRAMS: list[Codec] = [kind() for kind in CLASSES]


def lossless() -> list[Codec]:
    return [kind(lossless=True) for kind in CLASSES]
