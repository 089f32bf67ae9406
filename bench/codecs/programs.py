"""All programs that the benchmark compares with, each as installed from a package index.

Only NumPy and zstandard are imported here; Codec.missing reports a program that is not installed. `lossless()` are
those with a lossless mode.
"""

from __future__ import annotations

from bench.codecs import Codec
from bench.codecs.blosc2 import Blosc2
from bench.codecs.meshopt import Meshopt
from bench.codecs.sz3 import Sz3
from bench.codecs.zfp import Zfp

CLASSES = (Sz3, Blosc2, Zfp, Meshopt)
PROGRAMS: list[Codec] = [kind() for kind in CLASSES]


def lossless() -> list[Codec]:
    return [kind(lossless=True) for kind in CLASSES]
