"""Draco (Google 2017 and later; DracoPy): point clouds with their order kept.

It codes differences of neighbouring points. They are the vertices of a frame, of several frames or of all;
all frames of a vertex after the other; or points of many coordinates. Its own quantisation gets the grid of
the bound, on which every integer comes back. Left out: meshes, whose connectivity would come with every
frame; its order of points by space, as it is another in every frame; its keyframe encoder, which wraps the
number of components at 255 without an error.
"""

from __future__ import annotations

import struct

import numpy as np

from bench.codecs.program import CannotKeep, Program, join, split

LEVELS = (10, 7)  # more effort by itself is not always smaller
FLOAT_BITS = 24  # Bits that a float32 coordinate holds exactly.
INTEGER_BITS = 30  # wider ones are coded as two halves, since it refuses differences of more than 31 bits
WIDE = 84  # frames or vertices in one point: 252 components


class Draco(Program):
    name, module, package = "Draco", "DracoPy", "DracoPy"

    def choices(self, form: str) -> list:
        """(what a point is, how many of the others come in one cloud, level); 0: all."""
        clouds = [("vertex", 1), ("vertex", 8), ("vertex", 0), ("frame", 0)]
        clouds += [("vertex, wide", 8), ("vertex, wide", WIDE), ("frame, wide", 8), ("frame, wide", WIDE)]
        return [(*cloud, level) for cloud in clouds for level in LEVELS]

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        low = int(values.min())
        bits = max(1, (int(values.max()) - low).bit_length())
        unsigned = (values.astype(np.int64) - low).astype(np.uint32)
        clouds, encode = _clouds(unsigned, choice), self._wide if "wide" in choice[0] else self._cloud
        if "wide" in choice[0] and bits > INTEGER_BITS:
            clouds = [half for cloud in clouds for half in (cloud >> 16, cloud & 0xFFFF)]
        return struct.pack("<qB", low, bits) + join([encode(cloud, bits, choice[2]) for cloud in clouds])

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        low, bits = struct.unpack_from("<qB", data)
        decoded = [self._points(blob, "wide" in choice[0]) for blob in split(data[9:])]
        if "wide" in choice[0] and bits > INTEGER_BITS:
            decoded = [(high << 16) + rest for high, rest in zip(decoded[::2], decoded[1::2], strict=True)]
        return (_from_clouds(decoded, shape, choice) + low).astype(np.int32)

    def _cloud(self, points: np.ndarray, bits: int, level: int) -> bytes:
        if bits > FLOAT_BITS:
            raise CannotKeep(f"Draco: got {bits} bits; expected at most {FLOAT_BITS} in a coordinate")
        return self.load().encode(
            points.astype(np.float32),
            quantization_bits=bits,
            quantization_range=2**bits - 1,
            quantization_origin=[0.0, 0.0, 0.0],
            compression_level=level,
            preserve_order=True,
        )

    def _wide(self, points: np.ndarray, bits: int, level: int) -> bytes:
        return self.load().encode(
            np.zeros((len(points), 3), np.float32),
            quantization_bits=1,
            compression_level=level,
            preserve_order=True,
            generic_attributes={1: np.ascontiguousarray(points)},
        )

    def _points(self, data: bytes, wide: bool) -> np.ndarray:
        cloud = self.load().decode(data)
        if not wide:
            return np.rint(cloud.points).astype(np.int64)
        [found] = [part["data"] for part in cloud.attributes if part["attribute_type"] != 0]
        return found.astype(np.int64)


def _clouds(values: np.ndarray, choice) -> list[np.ndarray]:
    """(points, components) of every cloud."""
    points, count, _ = choice
    turned = values.transpose(1, 0, 2) if points in ("frame", "vertex, wide") else values
    if "wide" in points:
        return [turned[:, i : i + count].reshape(len(turned), -1) for i in range(0, turned.shape[1], count)]
    count = count or len(turned)
    return [turned[i : i + count].reshape(-1, 3) for i in range(0, len(turned), count)]


def _from_clouds(clouds: list[np.ndarray], shape: tuple[int, int, int], choice) -> np.ndarray:
    turn = choice[0] in ("frame", "vertex, wide")
    rows, columns, _ = (shape[1], shape[0], 3) if turn else shape
    if "wide" in choice[0]:
        turned = np.concatenate([cloud.reshape(rows, -1, 3) for cloud in clouds], axis=1)
    else:
        turned = np.concatenate(clouds).reshape(rows, columns, 3)
    return turned.transpose(1, 0, 2) if turn else turned
