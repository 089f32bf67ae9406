"""Codecs for the tests of the benchmark: one that works and one for every way to go wrong."""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path

import numpy as np


class Rounded:
    """Integers on a grid; counts in the file that COUNT names how often it encodes."""

    name, kind = "rounded", "program"
    step = 1.0

    def __init__(self):
        self.settings = {}

    def missing(self):
        return None

    def encode(self, source, bound):
        if "COUNT" in os.environ:
            with Path(os.environ["COUNT"]).open("a") as file:
                file.write(f"{bound}\n")
        step = self.step * bound
        numbers = np.rint(source.positions / step).astype(np.int32)
        self.settings = {"step": step}
        return struct.pack("<2if", *source.positions.shape[:2], step) + zlib.compress(numbers.tobytes())

    def decode(self, data):
        frames, vertices, step = struct.unpack_from("<2if", data)
        numbers = np.frombuffer(zlib.decompress(data[12:]), np.int32)
        return (numbers.reshape(frames, vertices, 3) * step).astype(np.float32)


class TooCoarse(Rounded):
    name, step = "too coarse", 8.0


class TooCoarseBaseline(TooCoarse):
    name, kind = "too coarse here", "baseline"


class Aborting(Rounded):
    name = "aborting"

    def encode(self, source, bound):
        os.abort()


class Raising(Rounded):
    name = "raising"

    def encode(self, source, bound):
        raise ValueError("sizes: got 3, expected 4")


class Remembering(Rounded):
    """Keeps what decoding needs to itself."""

    name = "remembering"

    def encode(self, source, bound):
        self.positions = source.positions
        return b""

    def decode(self, data):
        return self.positions


class Absent(Rounded):
    name = "absent"

    def missing(self):
        return "not installed: pip install absent"


class Endless(Rounded):
    name = "endless"

    def encode(self, source, bound):
        while True:
            pass


class Uninstallable(Rounded):
    name = "uninstallable"

    def missing(self):
        return "not installed" if "UNINSTALLED" in os.environ else None
