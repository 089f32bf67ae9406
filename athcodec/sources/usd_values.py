"""Reads values of USD attributes, from which usd_stage.py and the modules beside it make a clip."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom

from athcodec.errors import ClipError
from athcodec.sources.scene_objects import GUESSED, OWN, SceneObject
from athcodec.sources.usd_unread import is_array
from athcodec.untyped import UsdObject

if TYPE_CHECKING:
    from athcodec.sources.usd_instances import Instances
    from athcodec.sources.usd_skeleton import Skeleton

NAMES = {"st": "uv", "displayColor": "colors"}


def one_line(error: Exception) -> str:
    """Return the message of the first of USD's errors, without its place in USD's source."""
    try:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    except UnicodeDecodeError:  # it quotes bytes of the file
        return "cannot be parsed"
    text = (lines or [type(error).__name__])[0].split(" : '", 1)
    return text[-1].rstrip("'")


@dataclass
class PrimObject(SceneObject):
    """A prim that is read, and how its points are found."""

    prim: Usd.Prim = None
    points: Usd.AttributeQuery = None
    skeleton: Skeleton | None = None
    instances: Instances | None = None
    moves: bool = False  # its transforms do, or a skeleton moves it


def lineage(prim: Usd.Prim) -> Iterator[Usd.Prim]:
    """Yield a prim and all prims above it, without the root."""
    while prim and not prim.IsPseudoRoot():
        yield prim
        prim = prim.GetParent()


def all_above(obj: PrimObject) -> Iterator[Usd.Prim]:
    """Yield the prims whose transforms place an object."""
    yield from lineage(obj.prim)
    if obj.instances is not None:
        yield from lineage(obj.instances.instancer.GetPrim())


def hiding(obj: PrimObject) -> Iterator[Usd.Prim]:
    """Yield the prims that hide an object where they are invisible."""
    for prim in lineage(obj.prim):
        if obj.instances is not None and prim == obj.instances.prototype:
            yield from lineage(obj.instances.instancer.GetPrim())
            return
        yield prim


def visibility(prim: Usd.Prim) -> Usd.Attribute | None:
    """Return the visibility attribute of a prim; None if its type has none."""
    return UsdGeom.Imageable(prim).GetVisibilityAttr() if prim.IsA(UsdGeom.Imageable) else None


def held_at(times: Sequence[float] | np.ndarray, codes: np.ndarray) -> np.ndarray:
    """Return (T,) the number of the time whose sample holds at each time code."""
    return np.maximum(np.searchsorted(times, codes + 1e-6, "right") - 1, 0)


def fixed(obj: PrimObject, attribute: Usd.Attribute, codes: np.ndarray) -> np.ndarray:
    """Return the integers of an attribute, int32. Raises ClipError if they change over `codes`, the time codes of the
    frames."""
    query = Usd.AttributeQuery(attribute)
    first = array_of(query.Get(codes[0]), np.int32)
    if query.GetNumTimeSamples() > 1 and query.ValueMightBeTimeVarying():
        for sample in samples(attribute, codes):
            if not np.array_equal(array_of(query.Get(sample), np.int32), first):
                frame = int(np.searchsorted(codes, sample - 1e-9))
                raise ClipError(
                    f"{obj.path}: {attribute.GetName()} changes in frame {min(frame, len(codes) - 1)} "
                    f"(time code {sample:g}), expected the same vertices and faces in all"
                )
    return first


def samples(source: Usd.Attribute | UsdGeom.Primvar, codes: np.ndarray) -> Sequence[float]:
    """Return the time codes in the stage's range, or all, at which an attribute or primvar may change: those of its
    samples, or, where it has a spline, those of all frames or knots."""
    attribute = source.GetAttr() if isinstance(source, UsdGeom.Primvar) else source
    if not has_range(attribute.GetStage()):
        return [*attribute.GetSpline().GetKnots().keys()] if attribute.HasSpline() else source.GetTimeSamples()
    if attribute.HasSpline():
        return [float(code) for code in codes]
    return source.GetTimeSamplesInInterval(interval(codes))


def interval(codes: np.ndarray) -> Gf.Interval:
    return Gf.Interval(float(codes[0]), float(codes[-1]))


def array_of(value: Any, dtype: Any) -> np.ndarray:
    return np.empty(0, dtype) if value is None else np.array(value, dtype)


def value_at(source: Usd.Attribute | UsdGeom.Primvar, code: float) -> UsdObject:
    """Return what an array holds at a time, without indices; None where USD finds it faulty."""
    try:
        return source.ComputeFlattened(code) if isinstance(source, UsdGeom.Primvar) else source.Get(code)
    except Tf.ErrorException:
        return None


def changes(source: Usd.Attribute | UsdGeom.Primvar, codes: np.ndarray) -> bool:
    """Return whether an array has other values in any frame than in the first."""
    if not source.ValueMightBeTimeVarying():
        return False
    first = np.array(value_at(source, codes[0]))
    return any(
        not np.array_equal(np.array(value_at(source, code)), first) for code in (*samples(source, codes), codes[-1])
    )


def numbers_of(values: Any) -> np.ndarray | None:
    """Return a value of USD as an array of numbers with a row for each element, or None if it holds no numbers."""
    if values is None:
        return None
    try:
        array = np.array(values)
    except (TypeError, ValueError):
        return None
    if array.dtype.kind not in "biuf" or not isinstance(values, (bool, int, float)) and array.ndim == 0:
        return None
    return array.reshape(-1) if array.ndim == 0 else array if is_array(values) else array[None]


def is_guessed(attribute: Usd.Attribute) -> bool:
    """Return whether athcodec's writer has made up the value, so that it says nothing of the clip."""
    return attribute.GetCustomDataByKey(f"{OWN}:{GUESSED}") is True


def custom_text(attribute: Usd.Attribute, key: str) -> str | None:
    """Return the text that athcodec's writer has kept with an attribute under a key, or None."""
    text = attribute.GetCustomDataByKey(f"{OWN}:{key}")
    return text if isinstance(text, str) else None


def has_range(stage: Usd.Stage) -> bool:
    return stage.HasAuthoredTimeCodeRange() and stage.GetStartTimeCode() <= stage.GetEndTimeCode()


def frame_name(codes: np.ndarray, frame: int) -> str:
    return f"frame {frame} (time code {codes[frame]:g})"


@contextmanager
def quietly() -> Iterator[Tf.DiagnosticTrap]:
    """Keep USD's messages off stderr while the block runs, and turn USD's errors into ClipErrors of one line."""
    with Tf.DiagnosticTrap() as trap:
        try:
            yield trap
        except Tf.ErrorException as error:
            raise ClipError(f"stage: {one_line(error)}") from None
        finally:
            trap.Clear()
