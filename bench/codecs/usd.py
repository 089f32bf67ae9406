"""USD crates (Pixar 2016 and later; usd-core): size of a .usdc file with the motion as time samples.

Two entries. Points are what every USD program plays: float3, or half3 where halves keep the bound, as
positions or as displacements. Integers use the crate's integer compression on the grid of the bound,
in attributes that only a special reader understands. Left out: value clips, which spread
the samples over files; faces.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.codecs.program import Program, decode_arrays, encode_arrays

PRIM, VALUES = "/motion", "points"


class UsdPoints(Program):
    name, module, package = "USD crate, points", "pxr.Usd", "usd-core"
    forms = lossless_forms = ("floats",)
    strengths = (0,)  # there is nothing to set

    def choices(self, form: str) -> list:
        return ["float3", "half3"]

    def encode_floats(self, values: np.ndarray, strength: float | None, choice, thorough: bool) -> bytes:
        if choice == "half3":
            largest = np.float32(np.finfo(np.float16).max)
            values = np.clip(values, -largest, largest).astype(np.float16)
        return _crate(list(values), choice)

    def decode_floats(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        return np.stack(_samples(data)).astype(np.float32)


class UsdIntegers(Program):
    name, module, package = "USD crate, integers", "pxr.Usd", "usd-core"

    def choices(self, form: str) -> list:
        """Frame by frame, or without time samples: one array in some order."""
        return ["frames of N,3", "frames of 3,N", "T,N,3", "3,T,N", "3,N,T"]

    def encode_integers(self, values: np.ndarray, choice, thorough: bool) -> bytes:
        if not choice.startswith("frames"):
            return encode_arrays(lambda part: _crate([part.ravel()], "int"), values, choice)
        turned = values if choice.endswith("N,3") else values.transpose(0, 2, 1)
        return _crate(list(turned.reshape(len(values), -1)), "int")

    def decode_integers(self, data: bytes, shape: tuple[int, int, int], choice) -> np.ndarray:
        if not choice.startswith("frames"):
            return decode_arrays(lambda blob, part: _samples(blob)[0].reshape(part), data, choice, shape)
        frames, vertices, _ = shape
        rows = np.stack(_samples(data))
        if choice.endswith("N,3"):
            return rows.reshape(shape)
        return rows.reshape(frames, 3, vertices).transpose(0, 2, 1)


def _crate(samples: Sequence[np.ndarray], kind: str) -> bytes:
    """A .usdc file with one array attribute: time samples, or a single value where there is one."""
    from pxr import Sdf, Usd, Vt

    names = {
        "float3": (Sdf.ValueTypeNames.Point3fArray, Vt.Vec3fArray),
        "half3": (Sdf.ValueTypeNames.Point3hArray, Vt.Vec3hArray),
        "int": (Sdf.ValueTypeNames.IntArray, Vt.IntArray),
    }
    type_name, array = names[kind]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.usdc"
        stage = Usd.Stage.CreateNew(str(path))
        attribute = stage.DefinePrim(PRIM).CreateAttribute(VALUES, type_name)
        for frame, sample in enumerate(samples):
            value = array.FromNumpy(np.ascontiguousarray(sample))
            attribute.Set(value, *([frame] if len(samples) > 1 else []))
        stage.Save()
        return path.read_bytes()


def _samples(data: bytes) -> list[np.ndarray]:
    from pxr import Usd

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.usdc"
        path.write_bytes(data)
        stage = Usd.Stage.Open(str(path))  # attributes live as long as their stage
        attribute = stage.GetAttributeAtPath(f"{PRIM}.{VALUES}")
        times = attribute.GetTimeSamples()
        return [np.array(attribute.Get(time)) for time in times] if times else [np.array(attribute.Get())]
