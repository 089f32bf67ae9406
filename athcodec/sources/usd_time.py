"""Chooses the time codes of a USD stage that become frames, by the range and the keys of the stage."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Ts, Usd, UsdGeom

from athcodec.errors import ClipError
from athcodec.sources.timing import warn_of_missed
from athcodec.sources.usd_values import PrimObject, all_above, has_range, hiding, lineage, quietly, visibility
from athcodec.untyped import JsonObject

MAX_FRAMES = 1 << 24


@dataclass
class _Keys:
    """Time codes, ascending, at which what is read has samples or knots of splines; whether there are splines, and the
    paths of those that go on moving before their first knot or behind their last."""

    times: np.ndarray
    has_splines: bool
    endless: list[str]


def time_codes(
    stage: Usd.Stage, objects: list[PrimObject], fps: float | None, irregular: bool, not_read: dict[str, list[str]]
) -> tuple[np.ndarray, float]:
    """Return (codes, rate): the USD time codes (T,) of the frames to read, and frames per second. `fps` is the caller's
    rate; `irregular` says that athcodec's writer stored a time code for every frame. Keys outside of the stage's range
    are added to `not_read`."""
    codes_per_second = stage.GetTimeCodesPerSecond()
    if not 0 < codes_per_second < math.inf:
        raise ClipError(f"timeCodesPerSecond: got {codes_per_second}, expected a positive number")
    keys = _keys(objects)
    start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if has_range(stage) and not irregular:
        _name_keys_outside(keys.times, start, end, not_read)
    else:
        if stage.HasAuthoredTimeCodeRange() and not start <= end:
            not_read["range of the stage"] = [f"{start:g} to {end:g}, which runs backward"]
        if keys.endless:
            not_read["motion beyond the knots of splines"] = keys.endless
        if not fps and not keys.has_splines:
            return (keys.times if len(keys.times) else np.zeros(1)), _rate(stage, keys, 0.0, not_read)
        start, end = (keys.times[0], keys.times[-1]) if len(keys.times) else (0.0, 0.0)
    if not (math.isfinite(start) and math.isfinite(end)):
        raise ClipError(f"time codes: got {start} to {end}, expected finite numbers")
    rate = fps or _rate(stage, keys, start, not_read)
    step = codes_per_second / rate
    if not fps:
        times = keys.times[(keys.times >= start) & (keys.times <= end)]
        missed = _off_grid(times, start, step)
        warn_of_missed(times / codes_per_second, missed, rate, stage.GetRootLayer().realPath, start / codes_per_second)
    count = math.floor((end - start) / step + 1e-6) + 1
    if count > MAX_FRAMES:
        raise ClipError(f"time codes: got {start:g} to {end:g}, expected at most {MAX_FRAMES} frames")
    return start + np.arange(count) * step, rate


def _off_grid(times: np.ndarray, start: float, step: float) -> np.ndarray:
    """Return (K,) bool: whether each time code lies between the frames that begin at `start`, `step` apart."""
    places = (times - start) / step
    off: np.ndarray = np.abs(places - np.round(places)) > 1e-3
    return off


def _rate(stage: Usd.Stage, keys: _Keys, start: float, not_read: dict[str, list[str]]) -> float:
    """Return the clip's frames per second: one frame for each time code, or the stage's framesPerSecond if only these
    frames meet all keys, or if splines gain frames by it. A stated framesPerSecond that is not used is added to
    `not_read`. `start` is the first time code."""
    codes_per_second, stated = stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()
    if (
        not stage.HasAuthoredMetadata("framesPerSecond")
        or not 0 < stated < math.inf
        or math.isclose(stated, codes_per_second)
    ):
        return codes_per_second
    misses = [bool(_off_grid(keys.times, start, step).any()) for step in (1.0, codes_per_second / stated)]
    if misses == [True, False] or keys.has_splines and stated > codes_per_second and not misses[1]:
        return stated
    not_read["framesPerSecond"] = [f"{stated:g} (frames are time codes, {codes_per_second:g} per second)"]
    return codes_per_second


def _name_keys_outside(times: np.ndarray, start: float, end: float, not_read: dict[str, list[str]]) -> None:
    outside = times[(times < start - 1e-6) | (times > end + 1e-6)]
    if len(outside):
        text = f"time codes {outside[0]:g} to {outside[-1]:g} ({len(outside)} keys; the range is {start:g} to {end:g})"
        not_read["keys outside of the stage's range"] = [text]


def _keys(objects: list[PrimObject]) -> _Keys:
    """Return the time codes at which something changes that places or shapes the objects, whether splines are among it,
    and which splines go on beyond their knots."""
    times: set[float] = set()
    splines: JsonObject = {}
    seen: set[Sdf.Path] = set()

    def add(attribute: Usd.Attribute) -> None:
        """Add the time samples and spline knots of an attribute to the keys."""
        if attribute.GetPath() in seen:
            return
        seen.add(attribute.GetPath())
        times.update(attribute.GetTimeSamples())
        if attribute.HasSpline():
            splines[str(attribute.GetPath())] = spline = attribute.GetSpline()
            with quietly():  # USD says each time that inner loops are deprecated; not every version bakes them.
                times.update(getattr(spline, "GetKnotsWithInnerLoopsBaked", spline.GetKnots)().keys())

    for obj in objects:
        prims = [*all_above(obj), *(() if obj.skeleton is None else lineage(obj.skeleton.query.GetPrim()))]
        attributes = [obj.points.GetAttribute(), *(() if obj.instances is None else obj.instances.all.attributes)]
        attributes += filter(None, map(visibility, hiding(obj)))
        for prim in prims:
            if prim.IsA(UsdGeom.Xformable) and prim.GetPath() not in seen:
                seen.add(prim.GetPath())
                attributes += [operation.GetAttr() for operation in UsdGeom.Xformable(prim).GetOrderedXformOps()]
        for attribute in attributes:
            add(attribute)
        if obj.skeleton is not None and obj.skeleton.animation:
            times.update(obj.skeleton.animation.GetJointTransformTimeSamples())
            times.update(obj.skeleton.animation.GetBlendShapeWeightTimeSamples())
    endless = [path for path, spline in splines.items() if _goes_on(spline)]
    return _Keys(np.array(sorted(filter(math.isfinite, times)), np.float64), bool(splines), endless)


def _goes_on(spline: Ts.Spline) -> bool:
    """Return whether a spline moves before its first knot or behind its last."""
    still = (Ts.ExtrapHeld, Ts.ExtrapValueBlock)
    return any(each.mode not in still for each in (spline.GetPreExtrapolation(), spline.GetPostExtrapolation()))
