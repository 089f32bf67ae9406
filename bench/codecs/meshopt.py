"""meshoptimizer (Kapoulkine 2016 and later): its vertex codec, version 1, then zstd where that is smaller.

Elements are vertices with one or many frames each, or frames with many vertices each: the codec takes
differences of neighbouring elements, byte by byte. Integers are as narrow as they can be. Left out: its
filters, which quantise with an exponent per value and so waste bits on a uniform bound.
"""

from __future__ import annotations

import numpy as np

from bench.codecs.program import Program, deflate, from_zigzag, inflate, join, narrowest, split, zigzag

STRIDE = 256  # the most bytes of one element


class Meshopt(Program):
    name, module, package = "meshoptimizer", "meshoptimizer", "meshoptimizer"

    def choices(self, form: str) -> list:
        """Return the layouts to try, as tuples: the array's axis that elements run along, the number of items that each
        element holds (0: as many as fit), and whether signed integers are folded to unsigned ones.
        """
        elements = [
            ("vertices", 1),
            ("vertices", 4),
            ("vertices", 0),
            ("frames", 1),
            ("frames", 2),
            ("frames", 4),
            ("frames", 8),
            ("frames", 0),
        ]
        return [(*element, folded) for element in elements for folded in (False, True)]

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        """Return integers (T, N, 3) as buffers of meshoptimizer's vertex codec, compressed once more where that makes
        them smaller. `choice` is an item of `choices`; `thorough` selects the higher level of compression.
        """
        encoder = self.load()
        encoder.encode_vertex_version(1)
        elements, count, folded = choice
        numbers = narrowest(zigzag(values) if folded else values)
        blobs = [encoder.encode_vertex_buffer(buffer) for buffer in _buffers(numbers, elements, count)]
        plain = join(blobs)
        packed = deflate(plain, 19 if thorough else 6)
        small = len(packed) < len(plain)
        return bytes([numbers.itemsize, small]) + (packed if small else plain)

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        """Return the int32 array of shape (T, N, 3) that `encode_integers` has packed with the same `choice`."""
        decoder = self.load()
        elements, count, folded = choice
        dtype = np.dtype(f"{'u' if folded else 'i'}{data[0]}")
        blobs = iter(split(inflate(data[2:]) if data[1] else data[2:]))
        rows, columns = shape[:2] if elements == "frames" else shape[1::-1]
        turned = np.empty((rows, columns, 3), dtype)
        for first, last in _spans(columns, count, dtype.itemsize):
            width = 3 * (last - first) * dtype.itemsize
            stride = -4 * (-width // 4)
            raw = decoder.decode_vertex_buffer(rows, stride, next(blobs)).view(np.uint8).reshape(rows, stride)
            turned[:, first:last] = np.ascontiguousarray(raw[:, :width]).view(dtype).reshape(rows, -1, 3)
        values = turned if elements == "frames" else turned.transpose(1, 0, 2)
        return from_zigzag(values) if folded else values.astype(np.int32)


def _buffers(numbers: np.ndarray, elements: str, count: int) -> list[np.ndarray]:
    """Return (elements, bytes) each, their width a multiple of four."""
    turned = numbers if elements == "frames" else numbers.transpose(1, 0, 2)
    buffers = []
    for first, last in _spans(turned.shape[1], count, numbers.itemsize):
        row = np.ascontiguousarray(turned[:, first:last]).reshape(len(turned), -1).view(np.uint8)
        buffers.append(np.pad(row, ((0, 0), (0, -row.shape[1] % 4))))
    return buffers


def _spans(columns: int, count: int, size: int) -> list[tuple[int, int]]:
    most = STRIDE // (3 * size)
    count = min(count or most, most)
    return [(first, min(first + count, columns)) for first in range(0, columns, count)]
