"""Reads the copies of a USD PointInstancer: where each stands in each frame, and which copy is which."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom

from athcodec.errors import ClipError
from athcodec.sources.scene_objects import rows_by_id
from athcodec.sources.usd_unread import PLACES, unread_properties
from athcodec.sources.usd_values import (
    NAMES,
    PrimObject,
    array_of,
    changes,
    frame_name,
    held_at,
    interval,
    numbers_of,
    value_at,
)


class Copies:
    """The copies that a PointInstancer shows in the frames that are played, once `follow` has found them.

    A copy is a row of the instancer's arrays or, where ids change in time, an id; ids ascend. `names` (k,) are the rows
    or ids, `protos` (k,) the numbers of their prototypes, `shown` (T, k) the frames that show them.
    """

    def __init__(self, instancer: UsdGeom.PointInstancer):
        self.instancer = instancer
        prim = instancer.GetPrim()
        self.attributes = [prim.GetAttribute(name) for name in PLACES if prim.HasAttribute(name)]
        self.names = np.zeros(0, np.int64)
        self._is_known = False

    def follow(self, codes: np.ndarray) -> None:
        """Find the prototype of every copy, its row in the instancer's arrays and whether it is shown, for each frame.
        `codes` (T,) are the USD time codes of the frames. Raises ClipError if copies cannot be told apart over time."""
        if self._is_known:
            return
        schema, changes_at = self.instancer, [float(codes[0])]
        for attribute in (schema.GetProtoIndicesAttr(), schema.GetIdsAttr(), schema.GetInvisibleIdsAttr()):
            changes_at += attribute.GetTimeSamplesInInterval(interval(codes))
        times = np.unique(changes_at)
        used, self._states = np.unique(held_at(times, codes), return_inverse=True)
        self._codes, times = codes, times[used]  # In a frame holds what held at the last of these times.
        protos, ids = (
            [array_of(attribute.Get(time), np.int64) for time in times]
            for attribute in (schema.GetProtoIndicesAttr(), schema.GetIdsAttr())
        )
        self.follows_ids = any(not np.array_equal(ids_of_frame, ids[0]) for ids_of_frame in ids)
        self.follows_ids &= all(
            len(ids_of_frame) == len(of) == len(np.unique(ids_of_frame)) for ids_of_frame, of in zip(ids, protos)
        )
        self.names = np.unique(np.concatenate(ids)) if self.follows_ids else np.arange(len(protos[0]))
        self.protos = np.full(len(self.names), -1)
        self._rows = np.empty((len(times), len(self.names)), np.int32)
        self.shown = np.zeros(self._rows.shape, bool)
        for state, count in enumerate(map(len, protos)):
            if not self.follows_ids and count != len(self.names):
                expected = f"{len(self.names)} as in frame 0; give the copies unique ids in all frames"
                self._refuse(state, f"got {count} copies", expected)
            rows = rows_by_id(ids[state], self.names) if self.follows_ids else self.names
            there = np.flatnonzero(rows >= 0)
            new = protos[state][rows[there]]
            if ((self.protos[there] >= 0) & (self.protos[there] != new)).any():
                self._refuse(state, "protoIndices changes", "the same shape of each copy in all frames")
            self.protos[there] = new
            mask = np.array(schema.ComputeMaskAtTime(times[state]), bool)
            self._rows[state], self.shown[state] = rows, rows >= 0
            if len(mask):
                self.shown[state, there] = mask[rows[there]]
        self.shown = self.shown[self._states]
        self._hold()
        self._is_known = True

    def _refuse(self, state: int, got: str, expected: str) -> None:
        frame = int(np.flatnonzero(self._states == state)[0])
        raise ClipError(f"{self.instancer.GetPath()}: {got} in {frame_name(self._codes, frame)}, expected {expected}")

    def _hold(self) -> None:
        """Note the place of each copy for frames in which the instancer lacks it: where the copy was last or, before
        its first frame, where it will appear."""
        absent, states = self._rows < 0, np.arange(len(self._rows))
        last = np.maximum.accumulate(np.where(absent, -1, states[:, None]), axis=0)
        following = np.minimum.accumulate(np.where(absent, states[-1], states[:, None])[::-1], axis=0)[::-1]
        starts, stops = (np.searchsorted(self._states, states, side) for side in ("left", "right"))
        frames = np.where(last >= 0, stops[last] - 1, starts[following])
        # A frame that has the copy, and the copy.
        self._sources = frames * len(self.names) + np.arange(len(self.names))
        self._held = np.unique(self._sources[absent])
        self._places = np.zeros((len(self._held), 4, 4))
        frames, copies = np.divmod(self._held, max(len(self.names), 1))
        for frame in np.unique(frames):
            is_frame = frames == frame
            self._places[is_frame] = self._placed(frame)[self._rows[self._states[frame], copies[is_frame]]]

    def places(self, frame: int) -> np.ndarray:
        """Return the matrices (copies, 4, 4) from the prototype to the instancer in a frame, for all copies."""
        state = self._states[frame]
        rows, absent = self._rows[state], np.flatnonzero(self._rows[state] < 0)
        matrices = self._placed(frame)
        if not len(absent):
            return matrices[rows]
        out = np.empty((len(rows), 4, 4))
        out[rows >= 0] = matrices[rows[rows >= 0]]
        out[absent] = self._places[np.searchsorted(self._held, self._sources[state, absent])]
        return out

    def _placed(self, frame: int) -> np.ndarray:
        """Return the matrices (rows, 4, 4) from the prototype to the instancer in a frame, in the order of the
        instancer's arrays. Raises ClipError if these are too short."""
        code = code_of_order(self.instancer.GetIdsAttr(), float(self._codes[frame]))
        matrices = self.instancer.ComputeInstanceTransformsAtTime(
            code, code, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
        placed, expected = np.array(matrices).reshape(-1, 4, 4), self._rows[self._states[frame]].max(initial=-1) + 1
        if len(placed) < expected:
            raise ClipError(
                f"{self.instancer.GetPath()}: got {len(placed)} positions at time code {code:g}, expected {expected}"
            )
        return placed


class Instances:
    """The copies of one prototype that a PointInstancer has."""

    def __init__(self, copies: Copies, number: int, prototype: Usd.Prim):
        self.all, self.number, self.prototype = copies, number, prototype
        self.instancer = copies.instancer

    def choose(self, codes: np.ndarray) -> tuple[np.ndarray, list[str]]:
        """Return the frames that show each copy, (T, copies); and the names of copies that none shows, which are left
        out."""
        self.all.follow(codes)
        is_of_prototype, seen = self.all.protos == self.number, self.all.shown.any(axis=0)
        self.rows = np.flatnonzero(is_of_prototype & seen)
        return self.all.shown[:, self.rows], [
            f"{self.instancer.GetPath()}:{name}" for name in self.all.names[is_of_prototype & ~seen]
        ]

    def matrices(self, cache: UsdGeom.XformCache, prim: Usd.Prim, frame: int) -> np.ndarray:
        """Return (copies, 4, 4) from a prim of the prototype to the world, at the time of the cache."""
        inner = np.array(cache.ComputeRelativeTransform(prim, self.prototype)[0])
        world = np.array(cache.GetLocalToWorldTransform(self.instancer.GetPrim()))
        return inner @ self.all.places(frame)[self.rows] @ world

    def add_arrays(self, obj: PrimObject, codes: np.ndarray) -> None:
        """Store the instancer's arrays that have a value for each copy in `obj`, if they stay the same over `codes`,
        the time codes of the frames. Arrays that change are noted as left out."""
        obj.left_out += unread_properties(self.instancer.GetPrim())
        for primvar in UsdGeom.PrimvarsAPI(self.instancer).GetPrimvarsWithValues():
            name, values = str(primvar.GetPrimvarName()), numbers_of(value_at(primvar, codes[0]))
            varies = changes(primvar, codes) or self.all.follows_ids
            if values is None or varies or len(values) <= self.rows.max(initial=-1):
                obj.left_out.append(name)
            elif NAMES.get(name, name) not in obj.statics:
                obj.left_out = [other for other in obj.left_out if other != NAMES.get(name, name)]
                spread = np.repeat(values[self.rows], obj.count // obj.copies, axis=0)
                obj.keep(NAMES.get(name, name), "vertex", spread)


def code_of_order(ids: Usd.Attribute, code: float) -> float:
    """Return the time code at which to read arrays whose order `ids` says: the code, or, where USD would mix two orders
    between samples, that of the sample before it."""
    if ids.GetNumTimeSamples() < 2:
        return code
    low, high = ids.GetBracketingTimeSamples(code + 1e-6)
    return code if np.array_equal(array_of(ids.Get(low), np.int64), array_of(ids.Get(high), np.int64)) else low
