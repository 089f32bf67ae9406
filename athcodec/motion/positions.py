"""Positions as arrays of other programs have them: in another order of axes, or of another type than a clip takes.

An order is the names of the axes of an array, one after the other: "vertices,frames,xyz". Two names joined by + share
an axis, the first of them slowest: "frames,vertices+xyz" is x, y, z of the first vertex, then of the next. "1" is an
axis of length 1. Without "frames" the array is a single frame. Names of dimensions that other programs use, such as
"time" and "point", are known too.

No order is guessed: what belongs to the vertices or frames tells whether an order fits (`order_of`), and whether frames
look like paths of vertices is asked (`looks_turned`). Both take facts: by the name of an array, what it counts (FRAMES,
VERTICES, or INDICES of vertices) and its number of rows or, of indices, the highest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import DTypeLike

from athcodec.errors import ClipError
from athcodec.motion.frames import Frames
from athcodec.motion.sampling import spread
from athcodec.untyped import ArrayLike, JsonMapping

FRAMES, VERTICES, XYZ, INDICES = "frames", "vertices", "xyz", "indices"
Order = tuple[tuple[str, ...], ...]
Facts = Mapping[str, tuple[str, int]]
USUAL: Order = ((FRAMES,), (VERTICES,), (XYZ,))
LABELS = {
    FRAMES: "frames frame time times t step steps timestep timesteps time_step time_steps".split(),
    VERTICES: "vertices vertex points point nodes node particles particle markers marker".split(),
    XYZ: "xyz axis axes coordinate coordinates coord coords component components dim space direction".split(),
}
_NAMES = {label: name for name, labels in LABELS.items() for label in labels}
FRAMES_LOOKED_AT, VERTICES_LOOKED_AT = 8, 4096  # Each with the next one, they tell whether an array looks turned.
SMALL_SPREAD = 0.5  # Extent of a frame over that of a vertex' path, below which a frame looks like a path itself.
_COUNTED = {"time": FRAMES, "rest": VERTICES, "vertex_branch": VERTICES, "stem_index": VERTICES}
_COUNTED |= {"faces": INDICES, "edges": INDICES}


def parse_order(axes: str | Sequence[str]) -> Order:
    """Return the order of an array's axes from the names of the axes, as text with commas or as a sequence.

    The names are "frames", "vertices" and "xyz"; "vertices+xyz" is an axis that vertices and xyz share.

    Raises
    ------
    ValueError
        Unless "vertices" and "xyz" occur once each, "frames" at most once, and frames and vertices do not share an
        axis.
    """
    words = axes.split(",") if isinstance(axes, str) else [str(word) for word in axes]
    order = tuple(_axis(word.strip().lower()) for word in words)
    names = sorted(name for axis in order for name in axis)
    if names not in ([FRAMES, VERTICES, XYZ], [VERTICES, XYZ]) or {FRAMES, VERTICES} in map(set, order):
        raise ValueError(
            f"axes: got {axes!r}, expected the order of the array's axes in the words frames, vertices and xyz, such "
            "as vertices,frames,xyz or, where vertices and xyz share an axis, frames,vertices+xyz"
        )
    if any(len(axis) > 2 for axis in order):
        raise ValueError(f"axes: got {axes!r}, expected at most two of frames, vertices and xyz in one axis")
    return order


def order_of_labels(labels: Sequence[ArrayLike]) -> Order | None:
    """Return the order that the names of an array's dimensions state; None where they state none."""
    names = [_NAMES.get(str(label).strip().lower().rpartition("/")[2]) for label in labels]
    return tuple((name,) for name in names if name) if sorted(map(str, names)) == sorted(_text(USUAL)) else None


def written(order: Order) -> str:
    """Return the text of an axis order, "frames,vertices,xyz", that `parse_order` reads."""
    return ",".join(_text(order))


def advice(orders: Sequence[Order]) -> str:
    """Return what to pass for one of these orders, on the command line and in Python."""
    words = [written(order) for order in orders]
    in_python = f'axes="{words[0]}"' if len(words) == 1 else "axes="
    return f"--axes {' or '.join(words)} ({in_python})"


def facts_of(arrays: JsonMapping) -> dict[str, tuple[str, int]]:
    """Return what arrays of a clip tell about its size: by array name, an axis of the positions and its length. Arrays
    of vertex numbers tell the largest number instead. `arrays` has None for a missing one."""
    facts = {}
    for name, axis in _COUNTED.items():
        values = np.asarray(arrays[name]) if arrays.get(name) is not None else np.zeros(0)
        if values.size and axis != INDICES:
            facts[name] = axis, len(values.reshape(-1) if axis == FRAMES else values)
        elif values.size and values.dtype.kind in "iu":
            facts[name] = axis, int(values.max())
    return facts


def order_of(shape: Sequence[int], facts: Facts, order: Order | None = None) -> Order:
    """Return the order of the axes of an array of positions, which usually is frames, vertices, xyz.

    Parameters
    ----------
    shape : sequence of int
        The array's shape.
    facts : Facts
        What other arrays tell about the numbers of frames and vertices (see `facts_of`).
    order : Order, optional
        The order that the caller states. It is returned if the shape can have it.

    Raises
    ------
    ClipError
        If the shape cannot have the order, or the facts contradict it; the message says which order to pass.
    """
    if order is not None:
        _lengths(shape, order)
        return order
    possible = list(_possible(tuple(shape)))
    fitting = [each for each in possible if not conflicts(shape, facts, each)]
    if USUAL in fitting or (USUAL in possible and not fitting):
        return USUAL
    if USUAL in possible:
        raise ClipError(
            f"positions: got shape {tuple(shape)}, which is {shape[0]} frames of {shape[1]} vertices, but "
            f"{', '.join(conflicts(shape, facts))}; pass {advice(fitting)}"
        )
    got = f"positions: got shape {tuple(shape)}, expected (frames, vertices, 3)"
    raise ClipError(f"{got}; say the order of its axes: {advice(fitting or possible)}" if possible else got)


def is_possible(shape: Sequence[int], order: Order | None = None) -> bool:
    """Return whether an array of this shape can have this order, or any."""
    if order is None:
        return any(_possible(tuple(shape)))
    try:
        return bool(_lengths(shape, order))
    except ClipError:
        return False


def ordered(array: ArrayLike, order: Order) -> ArrayLike:
    """Return an array of positions as (frames, vertices, 3), which reads frames of `array` when they are sliced.

    Parameters
    ----------
    array : array-like
        Anything with a shape and a dtype that is sliced along each of its axes.
    order : Order
        What each axis of the array holds.

    Raises
    ------
    ClipError
        If the array's shape cannot have this order.
    """
    lengths = _lengths(array.shape, order)
    if order == USUAL:
        return array
    names = [name for axis in order for name in axis]
    places = [names.index(name) for name in (FRAMES, VERTICES, XYZ) if name in names]
    axis = next((number for number, each in enumerate(order) if FRAMES in each), None)
    frame_count, dtype = lengths.get(FRAMES, 1), np.dtype(array.dtype)

    def read(start: int, stop: int) -> np.ndarray:
        """Return the positions (stop - start, vertices, 3) of frames start to stop - 1."""
        if axis is None:
            block = np.asarray(array[(slice(None),) * len(order)])
        else:
            parts = [np.asarray(array[rows]) for rows in _rows(order, axis, lengths, start, stop)]
            block = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=axis)
        sizes = [stop - start if name == FRAMES else lengths[name] for name in names]
        block = block.reshape(sizes).transpose(places)
        return np.ascontiguousarray(block if FRAMES in names else block[None], dtype.newbyteorder("="))

    return Frames(read, frame_count, lengths[VERTICES], dtype.newbyteorder("="), keeps=axis != 0)


def in_floats(positions: ArrayLike) -> tuple[ArrayLike, str]:
    """Return (positions, sentence): positions (frames, vertices, 3) as float32, or as float64 if float32 cannot hold
    their values, and a sentence that says how the type changed, "" if it did not."""
    before = np.dtype(positions.dtype)
    if before.kind not in "iuf" or len(positions.shape) != 3 or (before.kind == "f" and before.itemsize in (4, 8)):
        return positions, ""
    after: DTypeLike = np.float32 if np.result_type(before, np.float32) == np.float32 else np.float64

    def read(start: int, stop: int) -> np.ndarray:
        return np.asarray(positions[start:stop]).astype(after)

    frame_count, vertex_count, _ = positions.shape
    return Frames(read, frame_count, vertex_count, after), f"positions: {before} became {np.dtype(after)}"


def seconds_of_dates(dates: np.ndarray) -> np.ndarray:
    """Return dates, or times between them, as (T,) float64 seconds from the first; other numbers unchanged."""
    return (dates - dates[:1]).astype("timedelta64[ns]").astype(np.float64) / 1e9 if dates.dtype.kind in "mM" else dates


def looks_turned(positions: ArrayLike, facts: Facts) -> bool:
    """Return whether the first two axes, frames and vertices, are probably the wrong way round.

    A vertex mostly stays near its place, and a plant is larger than the paths of its vertices. If single frames are
    much smaller than the paths over time, and neighbours in a frame are closer than successive points of a path, the
    axes are probably exchanged. If `facts` confirm the order, the result is False. Only a few frames are read.
    """
    frame_count, vertex_count = positions.shape[:2]
    if min(frame_count, vertex_count) < 2 or positions.dtype.kind != "f" or _confirm(positions.shape, facts):
        return False
    starts, places = spread(frame_count - 1, FRAMES_LOOKED_AT), np.array(spread(vertex_count - 1, VERTICES_LOOKED_AT))
    pairs = [np.asarray(positions[start : start + 2]) for start in starts]
    points = np.stack([pair[:, places] for pair in pairs]).astype(np.float64)  # Of each frame and the next one.
    beside = np.stack([pair[:, places + 1] for pair in pairs]).astype(np.float64)
    with np.errstate(all="ignore"):  # What is no number, or too large, is refused where it is read.
        in_frame, in_path = (np.linalg.norm(np.ptp(points[:, 0], axis=axis), axis=-1).mean() for axis in (1, 0))
        step_in_frame = np.linalg.norm(beside - points, axis=-1).mean()
        step_in_path = np.linalg.norm(points[:, 1] - points[:, 0], axis=-1).mean()
        return bool(in_frame < SMALL_SPREAD * in_path and step_in_frame < step_in_path)


def turned_advice(shape: Sequence[int]) -> str:
    """Return the question about an array that `looks_turned`."""
    swapped = (USUAL[1], USUAL[0], USUAL[2])
    return (
        f"positions: shape {tuple(shape)} was taken as {shape[0]} frames of {shape[1]} vertices, but each frame looks "
        f"like the path of one vertex; pass {advice([swapped])} if it is {shape[0]} vertices in {shape[1]} frames, and "
        f"{advice([USUAL])} if it is right"
    )


def _axis(word: str) -> tuple[str, ...]:
    return () if word == "1" else tuple(_NAMES.get(part.strip(), part) for part in word.split("+"))


def _text(order: Order) -> list[str]:
    return ["+".join(axis) or "1" for axis in order]


def _lengths(shape: Sequence[int], order: Order) -> dict[str, int]:
    """Return the lengths of "frames", "vertices" and "xyz" by these names, for an array of `shape` with axes in
    `order`. Raises ClipError if the shape cannot have this order."""
    lengths = {XYZ: 3}
    fits = len(shape) == len(order)
    for length, axis in zip(shape, order):
        others = [name for name in axis if name != XYZ]
        width = 3 if XYZ in axis else 1
        fits = fits and length % width == 0 and (bool(others) or length == width)
        lengths |= dict.fromkeys(others, length // width)
    if not fits:
        raise ClipError(f"positions: got shape {tuple(shape)}, expected one of axes {written(order)}, xyz being 3")
    return lengths


def _possible(shape: tuple[int, ...]) -> Iterator[Order]:
    """Yield the orders of axes that an array of positions with this shape can have, the usual one first."""
    extra = max(len(shape) - 3, 0)
    ones = [axis for axis, length in enumerate(shape) if length == 1][:extra]
    if len(ones) < extra:
        return
    for order in _possible_of_few(tuple(length for axis, length in enumerate(shape) if axis not in ones)):
        axes = iter(order)
        yield tuple(() if axis in ones else next(axes) for axis in range(len(shape)))


def _possible_of_few(shape: tuple[int, ...]) -> Iterator[Order]:
    """Yield the orders of axes that an array of positions with two or three axes of these lengths can have."""
    if len(shape) == 3:
        yield from (order for order in permutations(USUAL) if shape[order.index((XYZ,))] == 3)
    elif len(shape) == 2:
        yield from (order for order in permutations(USUAL[1:]) if shape[order.index((XYZ,))] == 3)
        for joined in ((VERTICES, XYZ), (XYZ, VERTICES)):
            shared = permutations(((FRAMES,), joined))
            yield from (order for order in shared if shape[order.index(joined)] % 3 == 0 < shape[order.index(joined)])


def conflicts(shape: Sequence[int], facts: Facts, order: Order = USUAL) -> list[str]:
    """Return sentences that say which `facts` (see `facts_of`) contradict that an array of this shape has its axes in
    `order`; none if all agree. Raises ClipError if the shape itself cannot have this order."""
    lengths = {FRAMES: 1} | _lengths(shape, order)
    lines = []
    for name, (axis, number) in facts.items():
        if axis == INDICES and number >= lengths[VERTICES]:
            lines.append(f"{name} name vertex {number}")
        elif axis != INDICES and number != lengths[axis]:
            lines.append(f"{name} has {number} rows")
    return lines


def _confirm(shape: Sequence[int], facts: Facts) -> bool:
    """Return whether the facts fit frames and vertices of this shape, and not the other way round."""
    swapped: Order = (USUAL[1], USUAL[0], USUAL[2])
    return not conflicts(shape, facts) and bool(conflicts(shape, facts, swapped))


def _rows(order: Order, axis: int, lengths: Mapping[str, int], start: int, stop: int) -> Iterator[tuple[slice, ...]]:
    """Yield the index of each run of an array's rows that has frames `start` to `stop` - 1, which lie on this axis."""
    place = order[axis].index(FRAMES)
    runs, width = (
        math.prod(lengths[name] for name in names) for names in (order[axis][:place], order[axis][place + 1 :])
    )
    for first in range(0, runs * lengths[FRAMES], lengths[FRAMES]):
        yield (*(slice(None),) * axis, slice((first + start) * width, (first + stop) * width))
