"""The motion clip: what every source reader makes and everything after it reads.

A clip is positions over time, a rest pose, the branch of every vertex and any named static arrays. It checks
its own structure when it is made, and the positions while they are read in blocks of frames, so that a clip
larger than memory works. It knows no file format and derives no hierarchy (see sources/ and hierarchy.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.atomic import FileId
from athcodec.files.shown import counted
from athcodec.options import real, set_numbers, whole
from athcodec.untyped import ArrayLike, JsonMapping, JsonObject, JsonValue

LARGEST_COORDINATE = 1e18
BLOCK_BYTES = 32 << 20
CLIP_RANGES, NAME_BYTES = 255, 255
DEFAULT_FPS = 30.0
PLAIN_TYPES = frozenset((str, int, float, bool, type(None)))
LARGEST_RATE_SLACK = 2e-7  # Share of a rate; 29.97 and 30000 / 1001 are 1e-6 apart.
NOT_KEPT = {
    "c": "complex array (store real and imaginary parts as two)",
    "V": "array of raw bytes (store unsigned integers)",
}
# Key of metadata: name of the attribute that holds factors on the bound. Also the usual name of that attribute.
ERROR_WEIGHTS = "error_weights"
RESERVED_NAMES = frozenset(
    ("positions", "rest", "time", "vertex_branch", "branch_parent", "stem_index", "edges", "faces")
)


@dataclass(frozen=True, eq=False, repr=False)
class Skin:
    """The joints that move a clip's vertices, as far as the source states them; only finding branches uses them.

    Parameters
    ----------
    joint_parent : (J,) int32 array
        Parent of each joint, which comes before it; -1 for a root.
    vertex_joint : (N,) int32 array
        The joint with the largest weight on each vertex, -1 for none.
    names : (J,) sequence of str, optional
        Names of the joints.
    """

    joint_parent: np.ndarray
    vertex_joint: np.ndarray
    names: Sequence[str] = ()

    def __repr__(self) -> str:
        return f"<Skin: {counted(len(self.joint_parent), 'joint')} of {len(self.vertex_joint):,} vertices>"


@dataclass(frozen=True)
class ClipRange:
    """A run of frames that is a clip in a file.

    Parameters
    ----------
    name : str
        Name of the clip.
    frame_count : int
        Number of its frames.
    loop : bool, optional
        Whether its first frame follows its last.
    """

    name: str
    frame_count: int
    loop: bool = False

    def __post_init__(self) -> None:
        set_numbers(self, wholes=("frame_count",))


@dataclass(eq=False, repr=False)
class MotionClip:
    """One moving plant: T frames of N vertices, on B branches where they are known.

    The structure is checked when the clip is made, the positions while they are read in blocks of frames, so that a
    clip may be larger than memory. A clip is a context manager that closes the file behind it.

    Parameters
    ----------
    positions : (T, N, 3) array of float32 or float64
        Positions of the vertices in ``metadata["unit"]``: an array, or anything that has a shape and a dtype and is
        sliced by frames, such as an h5py.Dataset or a numpy.memmap. Never read whole.
    time : (T,) array
        Seconds, strictly increasing within each clip range, in steps that may differ. Becomes float64.
    vertex_branch : (N,) array of integers, optional
        The branch of each vertex. Becomes int32. None, as is branch_parent then, where branches are not known; see
        `find_branches`.
    branch_parent : (B,) array of integers, optional
        The branch that each branch grows on, -1 for a root, of which there may be several. Becomes int32.
    rest : (N, 3) array of float32 or float64, optional
        The rest pose. Becomes float64; `rest_dtype` keeps the dtype that was given. None: made of the motion, see
        rest_pose; files then do without it.
    edges : (E, 2) array of integers, optional
        Pairs of vertices.
    faces : (F, k) array of integers, optional
        Vertices of each polygon; rows of fewer corners end with -1. Polygons of different sizes become the attributes
        face_vertex_counts (F,) and face_vertex_indices (C,) instead; `polygons` gives either.
    attributes : dict of str to array, optional
        Further named static arrays (radius, colours ...) of any shape: numbers, booleans or bytes. An array of records
        is taken apart: its field "u" becomes an array whose name ends in ".u".
        They have a row per vertex, branch, face or corner of a face, or none of that: ``metadata["domains"]`` says
        which, as in ``{"uv": "corner"}``, where the number of rows does not.
    metadata : dict, optional
        "unit", "up_axis" and whatever else describes the clip: str, int, float, bool, lists and dicts of them. "fps"
        and "start_frame" are the rate, and the number of the first frame, in the tool that made the clip: its frames
        are start_frame + time * fps. "part_names" are the objects that the vertices belong to, one after the other;
        the attribute part_vertex_counts has their numbers of vertices. Where part_copies is there too, an object is so
        many copies of one shape, one after the other, each of which moves as a whole: the leaves of an instancer.
        "presence" says which frames show an object or a copy, where not all do: docs/formats.md.
    rest_pose : {"first", "mean"}, optional
        How the rest pose is made where none is given: the first frame, or the mean of all, which reads the clip once.
    stem_index : (N,) array of integers, optional
        The place of each vertex on its stem, 0 at the base. None if the vertices of every branch run from base to
        tip in the order of their numbers.
    clip_ranges : tuple of ClipRange, optional
        The clips that the frames are, one after the other, or the only one, where it has a name or is a loop; `join`
        and `looped` make such clips. Empty: one clip without a name.
    resource : object with close(), optional
        Closed with the clip: the open file behind positions that are read when they are asked for.
    unchanged : callable, optional
        Says, without arguments, whether what the positions are read from is as it was when the clip was made.
    skin : Skin, optional
        The joints that moved the vertices. Not stored in .ath files; `find_branches` uses it.
    not_read : dict of str to sequence of str, optional
        What the source holds besides, by its kind ("Material", "Camera" ...), named. Not stored in .ath files.

    Attributes
    ----------
    rest_dtype : numpy.dtype
        float32 or float64: the dtype in which the rest pose was given or made, and in which files store it.
    rest_given : bool
        Whether the rest pose was given, so that files keep it, and not made of the motion.

    Raises
    ------
    ClipError
        If the structure is wrong; by `block` and `blocks`, at the first position that is not a finite number.

    Examples
    --------
    >>> positions = np.zeros((60, 20, 3), np.float32)
    >>> positions[..., 1] = np.linspace(0, 2, 20)  # a stem that stands still
    >>> athcodec.MotionClip(positions, np.arange(60) / 30, vertex_branch=np.zeros(20, int), branch_parent=[-1])
    MotionClip(60 frames, 20 vertices, 1 branch, float32)
    """

    positions: ArrayLike
    time: np.ndarray
    vertex_branch: np.ndarray | None = None
    branch_parent: np.ndarray | None = None
    rest: np.ndarray = field(default=cast(Any, None))  # None only until __post_init__ has made it.
    edges: np.ndarray | None = None
    faces: np.ndarray | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)
    metadata: JsonObject = field(default_factory=dict)
    rest_pose: str = "first"
    stem_index: np.ndarray | None = None
    clip_ranges: tuple[ClipRange, ...] = ()
    resource: Any = None
    unchanged: Callable[[], bool] | None = None
    skin: Skin | None = None
    not_read: Mapping[str, Sequence[str]] = field(default_factory=dict)
    rest_dtype: np.dtype = field(init=False)
    rest_given: bool = field(init=False, default=False)
    _checked_rest: np.ndarray | None = field(init=False, default=None)
    _stands_still: bool | None = field(init=False, default=None)  # None: not known yet.

    def __post_init__(self) -> None:
        if not (hasattr(self.positions, "shape") and hasattr(self.positions, "dtype")):
            self.positions = np.asarray(self.positions)
        self.check()

    def __repr__(self) -> str:
        branches = counted(self.branch_count, "branch", "branches") if self.has_branches else "branches unknown"
        frames, vertices = counted(self.frame_count, "frame"), counted(self.vertex_count, "vertex", "vertices")
        return f"MotionClip({frames}, {vertices}, {branches}, {self.dtype})"

    def __enter__(self) -> MotionClip:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file behind the clip, if there is one; its positions cannot be read afterwards."""
        if self.resource is not None:
            self.resource.close()

    @property
    def frame_count(self) -> int:
        """Number of frames, T."""
        return len(self.time)

    @property
    def vertex_count(self) -> int:
        """Number of vertices, N."""
        return int(self.positions.shape[1])

    @property
    def branch_count(self) -> int:
        """Number of branches, B; 0 if they are not known."""
        return 0 if self.branch_parent is None else len(self.branch_parent)

    @property
    def has_branches(self) -> bool:
        """Whether the branches are known."""
        return self.branch_parent is not None

    @property
    def source_rest(self) -> np.ndarray:
        """Rest pose in `rest_dtype`, (N, 3), unchanged."""
        return self.rest.astype(self.rest_dtype)

    def replace(self, *, rest_given: bool | None = None, **changes: Any) -> MotionClip:
        """Return the clip with other values of some parameters; the rest pose keeps its dtype unless another is passed.

        Parameters
        ----------
        rest_given : bool, optional
            Whether the rest pose counts as given; by default another one does, and the same one as it did.
        **changes
            Parameters of MotionClip.

        Returns
        -------
        MotionClip
            A new clip, which shares everything else with this one: closing either closes both.

        Raises
        ------
        ClipError
            If the changed structure is wrong.
        """
        clip = replace(self, **{"rest": self.source_rest} | changes)
        if rest_given is not None or "rest" not in changes:
            clip.rest_given = self.rest_given if rest_given is None else rest_given
        if not changes.keys() & {"positions", "rest"}:
            clip._stands_still = self._stands_still
        return clip

    @property
    def polygons(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Faces of any sizes, or None: corners of each (F,), and the vertex of each corner (C,), face after face."""
        return polygons(self.faces, self.attributes)

    @property
    def dtype(self) -> np.dtype:
        """dtype of the positions in `block` and `blocks`: float32 or float64 in native byte order."""
        return self._dtype

    @property
    def fps(self) -> float:
        """Median frame rate in frames per second; metadata["fps"] of a single frame, else 30."""
        runs = [self.time[start:stop] for start, stop in self.clip_range_frames]
        return median_rate(*runs) or frame_rate(self.metadata)

    @property
    def clip_range_frames(self) -> list[tuple[int, int]]:
        """(start, stop) frames of each clip range, or of the whole clip without ranges."""
        return clip_range_frames(self.clip_ranges) if self.clip_ranges else [(0, self.frame_count)]

    def check(self) -> None:
        """Check the structure again, after fields were set, and bring the small arrays to their documented dtypes.

        If the clip has no rest pose, it is made now, from the first frame or from all frames.

        Raises
        ------
        ClipError
            If a field has a wrong shape, type or value, or fields contradict each other.
        """
        frame_count, vertex_count = self._check_positions()
        check_clip_ranges(self.clip_ranges, frame_count)
        self.time = check_time(self.time, frame_count, self.clip_ranges)
        self._check_branches(vertex_count)
        self.edges = check_indices("edges", self.edges, vertex_count, width=2)
        self.attributes, left_out = check_attributes(self.attributes)
        self.not_read = {**self.not_read, **left_out}
        try:
            self.metadata = _plain(dict(self.metadata or {}))
        except RecursionError:
            raise ClipError("metadata: got data that holds itself or is nested deeply, expected plain data") from None
        self._take_padding_off()
        self.faces = check_indices("faces", self.faces, vertex_count)
        check_polygons(self.polygons, vertex_count)
        self._check_rest()

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Guard a block in which the files behind the positions must not change.

        Raises
        ------
        ClipError
            At the end of the ``with`` block, also in place of an error of the block, where one of the files has been
            written to since the clip was made.
        """
        try:
            yield
        finally:
            if self.unchanged is not None and not self.unchanged():
                raise ClipError("positions: the file was changed while it was read, expected it to stay as it is")

    @property
    def inputs(self) -> frozenset[FileId]:
        """The files behind the positions, by device and inode, as far as `unchanged` knows them."""
        return getattr(self.unchanged, "files", frozenset())

    def block(self, start: int, stop: int) -> np.ndarray:
        """Return the positions of frames `start` to `stop` - 1.

        Parameters
        ----------
        start, stop : int
            0 <= start < stop <= frame_count.

        Returns
        -------
        (stop - start, N, 3) array
            In the clip's dtype, read-only.

        Raises
        ------
        IndexError
            If `start` and `stop` are not as above.
        ClipError
            If a position is NaN, infinite or beyond 1e18, or cannot be read.
        """
        start, stop = whole("start", start), whole("stop", stop)
        if not 0 <= start < stop <= self.frame_count:
            raise IndexError(f"frames {start} to {stop}: expected 0 <= start < stop <= {self.frame_count}")
        try:
            frames = np.asarray(self.positions[start:stop], dtype=self.dtype).view()
        except (ValueError, OSError, RuntimeError) as error:
            raise ClipError(f"positions: frames {start} to {stop - 1} cannot be read: {error}") from error
        check_finite(frames, start)
        frames.flags.writeable = False
        return frames

    def blocks(self, max_frames: int | None = None) -> Iterator[tuple[int, np.ndarray]]:
        """Yield all frames in order, a block at a time.

        Parameters
        ----------
        max_frames : int, optional
            Frames in a block at most. A block has at most 32 MiB too, but at least one frame; its length is a multiple
            of the chunk length of the source's HDF5 dataset where that is no longer.

        Yields
        ------
        start : int
            Number of the first frame of the block.
        block : (k, N, 3) array
            See `block`, whose errors are raised here too.

        Raises
        ------
        ValueError
            For max_frames below 1.
        """
        length = self.block_length(max_frames)
        for start in range(0, self.frame_count, length):
            yield start, self.block(start, min(start + length, self.frame_count))

    @property
    def chunk_frames(self) -> int:
        """Frames that the source unpacks together, 1 if it has no chunks."""
        return int(np.max((getattr(self.positions, "chunks", None) or (1,))[0]))  # dask names the size of each.

    def block_length(self, max_frames: int | None = None) -> int:
        """Return how many frames are read at once: as many as a block may have bytes for, at most `max_frames`, and
        whole chunks of the source where one fits. Raises ValueError for max_frames below 1.
        """
        if max_frames is not None and (max_frames := whole("max_frames", max_frames)) < 1:
            raise ValueError(f"max_frames: got {max_frames}, expected at least 1")
        length = max(1, BLOCK_BYTES // (self.vertex_count * 3 * self.dtype.itemsize))
        length = min(length, max_frames or length)
        return length - length % self.chunk_frames if self.chunk_frames <= length else length

    def _check_branches(self, vertex_count: int) -> None:
        """Raise ClipError unless vertex_branch, branch_parent and stem_index fit each other, and bring them to
        int32."""
        if self.vertex_branch is None and self.branch_parent is None:
            if self.stem_index is not None:
                raise ClipError("stem_index: got places on branches that are not known, expected none")
            return
        if self.vertex_branch is None or self.branch_parent is None:
            raise ClipError("branches: got one of vertex_branch and branch_parent, expected both or neither")
        self.vertex_branch, self.branch_parent = check_branches(self.vertex_branch, self.branch_parent, vertex_count)
        self.stem_index = check_stem_index(self.stem_index, self.vertex_branch)

    def _take_padding_off(self) -> None:
        """Turn faces whose rows are filled up with -1 into polygons of different sizes."""
        faces = np.asarray(self.faces)
        if self.faces is None or faces.ndim != 2 or faces.dtype.kind != "i" or not (faces == -1).any():
            return
        used = np.logical_or.accumulate((faces != -1)[:, ::-1], axis=1)[:, ::-1]
        counts = used.sum(axis=1, dtype=np.int32)
        if counts.min() == counts.max() > 0:
            self.faces = faces[:, : counts[0]]
            return
        self.faces = None
        self.attributes |= {"face_vertex_counts": counts, "face_vertex_indices": faces[used]}
        domains = {"face_vertex_counts": "face", "face_vertex_indices": "corner"}
        stated = self.metadata.get("domains")
        self.metadata["domains"] = (stated if isinstance(stated, dict) else {}) | domains

    def _check_positions(self) -> tuple[int, int]:
        """Return the numbers of frames and vertices. Raises ClipError unless the positions are floats (frames,
        vertices, 3)."""
        shape, dtype = tuple(self.positions.shape or ()), self.positions.dtype
        if len(shape) != 3 or shape[2] != 3:
            raise ClipError(f"positions: got shape {shape}, expected (frames, vertices, 3)")
        check_float_dtype("positions", dtype)
        if shape[0] == 0:
            raise ClipError("positions: got no frames, expected at least one")
        if shape[1] == 0:
            raise ClipError("positions: got no vertices, expected at least one")
        self._dtype: np.dtype = dtype.newbyteorder("=")
        return shape[0], shape[1]

    def _check_rest(self) -> None:
        """Check the rest pose (N, 3) or, without one, make it from the first frame or the mean of all frames."""
        if self.rest_pose not in ("first", "mean"):
            raise ClipError(f'rest_pose: got {self.rest_pose!r}, expected "first" or "mean"')
        if cast(np.ndarray | None, self.rest) is None:
            pose = self.block(0, 1)[0] if self.rest_pose == "first" else self._mean_pose()
            self.rest_dtype, self.rest_given = pose.dtype, False
            self.rest = self._checked_rest = pose.astype(np.float64)
            return
        rest = np.asarray(self.rest)
        if rest.shape != (self.vertex_count, 3):
            raise ClipError(f"rest: got shape {rest.shape}, expected ({self.vertex_count}, 3)")
        check_float_dtype("rest", rest.dtype)
        bad = np.flatnonzero(~np.isfinite(rest).all(axis=1))
        if bad.size:
            raise ClipError(f"rest: vertex {bad[0]} is {_point(rest[bad[0]])}, expected finite numbers")
        if self.rest is not self._checked_rest:
            self.rest_dtype, self.rest_given = rest.dtype.newbyteorder("="), True
        self.rest = self._checked_rest = rest.astype(np.float64)

    def _mean_pose(self) -> np.ndarray:
        total = np.zeros((self.vertex_count, 3))
        for _, frames in self.blocks():
            total += frames.sum(axis=0, dtype=np.float64)
        return total / self.frame_count


def check_float_dtype(name: str, dtype: np.dtype) -> None:
    """Raise ClipError unless the dtype is float32 or float64, in any byte order."""
    if dtype.kind != "f" or dtype.itemsize not in (4, 8):
        raise ClipError(f"{name}: got dtype {dtype}, expected float32 or float64")


def check_finite(frames: np.ndarray, start: int = 0) -> None:
    """Raise ClipError, which names frame and vertex, if a coordinate in `frames` (k, N, 3) is not finite or so large
    that its square overflows float32. `start` is the number of the first frame."""
    if -LARGEST_COORDINATE <= frames.min() and frames.max() <= LARGEST_COORDINATE:  # False if one is NaN.
        return
    usable = np.abs(frames) <= LARGEST_COORDINATE
    frame, vertex = np.argwhere(~usable.all(axis=2))[0]
    point = _point(frames[frame, vertex])
    raise ClipError(
        f"positions: frame {start + frame}, vertex {vertex} is {point}, expected finite numbers up to "
        f"{LARGEST_COORDINATE:g}"
    )


def clip_range_frames(clip_ranges: Sequence[ClipRange]) -> list[tuple[int, int]]:
    """Return (start, stop) frames of each clip range, the first of which begins at frame 0."""
    stops = np.cumsum([clip_range.frame_count for clip_range in clip_ranges]).tolist()
    return list(zip([0, *stops], stops))


def check_clip_ranges(clip_ranges: Sequence[ClipRange], frame_count: int) -> None:
    """Raise ClipError unless the ranges cover all frames and have different names that a file can hold. A single range
    may have no name."""
    if not clip_ranges:
        return
    counts = [clip_range.frame_count for clip_range in clip_ranges]
    names = [clip_range.name for clip_range in clip_ranges]
    if min(counts) < 1 or sum(counts) != frame_count:
        raise ClipError(f"clip_ranges: got {counts} frames, expected {frame_count} in all, at least one each")
    for name in names:
        size = len(name.encode("utf-8", "surrogatepass"))
        if not (name or len(clip_ranges) == 1) or size > NAME_BYTES or not is_name(name):
            raise ClipError(
                f"clip names: got {name!r}, expected 1 to {NAME_BYTES} bytes of text without control characters"
            )
    if len(set(names)) < len(names):
        raise ClipError(f"clip names: got {', '.join(names)}, expected each once")
    if len(clip_ranges) > CLIP_RANGES:
        raise ClipError(f"clips: got {len(clip_ranges)}, expected at most {CLIP_RANGES}")


def is_name(text: str) -> bool:
    """Return whether it can be stored as UTF-8 and has no control characters below U+0080."""
    return not any(c < " " or c == "\x7f" or "\ud800" <= c <= "\udfff" for c in text)


def check_time(time: ArrayLike, frame_count: int, clip_ranges: Sequence[ClipRange] = ()) -> np.ndarray:
    """Return the times (T,) of the frames as float64 seconds. Raises ClipError unless there is one for each frame, all
    are finite, and they increase within each clip range."""
    times: np.ndarray = np.asarray(time)
    if times.shape != (frame_count,):
        raise ClipError(f"time: got shape {times.shape}, expected ({frame_count},), one time per frame")
    if times.dtype.kind not in "fiu":
        raise ClipError(f"time: got dtype {times.dtype}, expected float64 seconds")
    times = times.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(times))
    if bad.size:
        raise ClipError(f"time: frame {bad[0]} is at {times[bad[0]]}, expected a finite number of seconds")
    starts = [start for start, _ in clip_range_frames(clip_ranges)[1:]]
    late = np.setdiff1d(np.flatnonzero(np.diff(times) <= 0), np.array(starts, int) - 1)
    if late.size:
        frame = late[0] + 1
        raise ClipError(
            f"time: frame {frame} is at {times[frame]} after {times[frame - 1]}, expected strictly increasing"
        )
    return times


def stated_fps(metadata: JsonMapping) -> float | None:
    """Return the frames per second in `metadata["fps"]`; None if it is missing or no positive number."""
    try:
        fps = real("fps", cast(JsonValue, metadata.get("fps")))
    except TypeError:
        return None
    return fps if 0 < fps < float("inf") else None


def frame_rate(metadata: JsonMapping) -> float:
    """Return the frames per second in `metadata["fps"]`, by default 30. Raises ClipError for no positive number."""
    fps = stated_fps(metadata) if "fps" in metadata else DEFAULT_FPS
    if fps is None:
        raise ClipError(f"fps: got {metadata['fps']!r}, expected a positive number")
    return fps


def median_rate(*runs: np.ndarray) -> float:
    """Return the frame rate, in frames per second, of the median step in one or more arrays of times (T,) in seconds; 0
    if no array has two frames.

    If the rate equals a usual one (30, 23.976, 24000 / 1001) up to the rounding of the times, the usual one is
    returned.
    """
    steps = np.concatenate([np.diff(run) for run in runs])
    if not len(steps):
        return 0.0
    step = float(np.median(steps))
    rate = 1.0 / step if step > 1.0 / LARGEST_COORDINATE else math.inf
    if rate == math.inf:
        return rate
    rounding = 4 * rate * float(np.spacing(max(np.abs(run).max(initial=0.0) for run in runs)))
    slack = rate * min(1e-9 + rounding, LARGEST_RATE_SLACK)
    usual = (float(round(rate)), round(rate, 3), round(rate * 1.001) * 1000 / 1001)
    return next((number for number in usual if 0 < number and abs(number - rate) <= slack), rate)


def check_indices(name: str, indices: ArrayLike, stop: int, width: int | None = None) -> np.ndarray | None:
    """Return the array of vertex numbers called `name`, in its own integer type, or None for None. Raises ClipError
    unless it has two axes, the second one of length `width` if that is given, and every number is in 0 .. stop - 1."""
    if indices is None:
        return None
    array: np.ndarray = np.asarray(indices)
    expected = f"(rows, {width or 'k'})"
    if array.ndim != 2 or (width is not None and array.shape[1] != width):
        raise ClipError(f"{name}: got shape {array.shape}, expected {expected}")
    if array.dtype.kind not in "iu":
        raise ClipError(f"{name}: got dtype {array.dtype}, expected integers")
    bad = np.argwhere((array < 0) | (array >= stop))
    if bad.size:
        row, column = bad[0]
        raise ClipError(f"{name}: row {row} names vertex {array[row, column]}, expected 0 to {stop - 1}")
    return array


def polygons(faces: np.ndarray | None, attributes: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (counts (F,), indices (C,)) of `faces` or of the attributes that stand for it; None without either."""
    if faces is not None:
        return np.full(len(faces), faces.shape[1], np.int64), np.asarray(faces).reshape(-1)
    counts, indices = (attributes.get(f"face_vertex_{name}") for name in ("counts", "indices"))
    return None if counts is None or indices is None else (counts, indices)


def check_polygons(faces: tuple[np.ndarray, np.ndarray] | None, vertex_count: int) -> None:
    """Raise ClipError unless counts and indices of polygons fit each other and name vertices that exist."""
    if faces is None:
        return
    counts, indices = (_integers(f"face_vertex_{name}", array) for name, array in zip(("counts", "indices"), faces))
    if (counts < 0).any() or counts.sum() != len(indices):
        raise ClipError(f"face_vertex_counts: got {int(counts.sum())} corners, expected {len(indices)}, one per index")
    check_indices("face_vertex_indices", indices[:, None], vertex_count)


def check_branches(
    vertex_branch: ArrayLike, branch_parent: ArrayLike, vertex_count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return (vertex_branch (N,), branch_parent (B,)) as int32: the branch of each vertex, and the parent of each
    branch, -1 for a root. Raises ClipError unless every branch has vertices and no branch is its own ancestor."""
    branch_parent = _integers("branch_parent", branch_parent)
    branch_count = len(branch_parent)
    vertex_branch = _integers("vertex_branch", vertex_branch)
    if len(vertex_branch) != vertex_count:
        raise ClipError(f"vertex_branch: got {len(vertex_branch)} entries, expected {vertex_count}, one per vertex")
    bad = np.flatnonzero((vertex_branch < 0) | (vertex_branch >= branch_count))
    if bad.size:
        got = vertex_branch[bad[0]]
        raise ClipError(f"vertex_branch: vertex {bad[0]} is on branch {got}, expected 0 to {branch_count - 1}")
    vertex_branch = vertex_branch.astype(np.int32)
    empty = np.flatnonzero(np.bincount(vertex_branch, minlength=branch_count) == 0)
    if empty.size:
        raise ClipError(f"vertex_branch: branch {empty[0]} has no vertices, expected at least one")
    return vertex_branch, _check_parents(branch_parent)


def check_stem_index(stem_index: ArrayLike, vertex_branch: np.ndarray) -> np.ndarray | None:
    """Return the place of each vertex along its branch (N,), int32, or None if these places only repeat the order of
    the vertices. `vertex_branch` (N,) is the branch of each vertex.

    Raises ClipError unless a branch with n vertices has each of the places 0 .. n - 1 once.
    """
    if stem_index is None:
        return None
    stem_index = _integers("stem_index", stem_index)
    if stem_index.shape != vertex_branch.shape:
        raise ClipError(f"stem_index: got {len(stem_index)} entries, expected {len(vertex_branch)}, one per vertex")
    stem_index = stem_index.astype(np.int64)
    places = source_stem_index(vertex_branch)
    order = np.lexsort((stem_index, vertex_branch))
    expected = np.sort(places + vertex_branch * np.int64(len(places)))
    numbered_places = stem_index[order] + vertex_branch[order] * np.int64(len(places))
    bad = np.flatnonzero(numbered_places != expected)
    if bad.size:
        vertex = order[bad[0]]
        raise ClipError(
            f"stem_index: vertex {vertex} has place {stem_index[vertex]} on branch {vertex_branch[vertex]}, "
            "expected each place from 0 on once"
        )
    return None if np.array_equal(stem_index, places) else stem_index.astype(np.int32)


def source_stem_index(vertex_branch: np.ndarray) -> np.ndarray:
    """Return the place of each vertex on its stem, (N,) int32, if vertices run from base to tip by their numbers."""
    return stem_index_of(vertex_branch, np.arange(len(vertex_branch)))


def stem_index_of(vertex_branch: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the place of each vertex on its stem, (N,) int32, by how far along it is, (N,), and then by its number."""
    order = np.lexsort((along, vertex_branch))
    labels = vertex_branch[order]
    places = np.empty(len(order), np.int32)
    places[order] = np.arange(len(order)) - np.searchsorted(labels, labels)
    return places


def check_attributes(attributes: JsonMapping | None) -> tuple[dict[str, np.ndarray], dict[str, list[str]]]:
    """Return (attributes, left_out): the named arrays in little-endian order, with each field of a record as an array
    of its own, and the names of arrays of types that no file holds, by kind.

    Raises ClipError if a name is taken, or values are not numbers, booleans or bytes.
    """
    checked: dict[str, np.ndarray] = {}
    left_out: dict[str, list[str]] = {}
    for name, values in (attributes or {}).items():
        if not isinstance(name, str) or not name.strip("/"):
            raise ClipError(f"attributes: got the name {name!r}, expected one that is not empty")
        for column, array in _columns(name, np.asarray(values)):
            if column in RESERVED_NAMES or column in checked:
                raise ClipError(f"attributes: got the name {column!r}, expected one that is free")
            if array.dtype.hasobject or array.dtype.kind not in "biufcSV":
                raise ClipError(f"attributes: {column} has dtype {array.dtype}, expected numbers, booleans or texts")
            if array.dtype.kind in NOT_KEPT:
                left_out.setdefault(NOT_KEPT[array.dtype.kind], []).append(column)
            else:
                checked[column] = array.astype(array.dtype.newbyteorder("<"), copy=False)
    return checked, left_out


def _columns(name: str, array: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield an array of records as one array for each field, at any depth; any other array unchanged."""
    if array.dtype.names is None:
        yield name, array
    for field_name in array.dtype.names or ():
        yield from _columns(f"{name}.{field_name}", array[field_name])


def _plain(value: JsonValue) -> JsonValue:
    """Return a value of metadata with its numbers and lists as plain Python ones, in place of types of NumPy and other
    libraries."""
    if type(value) in PLAIN_TYPES:
        return value
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):  # Lists of names may be long.
        return value if PLAIN_TYPES.issuperset(map(type, value)) else [_plain(item) for item in value]
    if isinstance(value, np.ndarray) and value.ndim:
        return [_plain(item) for item in value]
    if isinstance(value, np.bool_):
        return bool(value)
    for number in (whole, real):
        try:
            return number("metadata", value)
        except TypeError:
            pass
    return value


def _check_parents(branch_parent: np.ndarray) -> np.ndarray:
    """Return branch_parent (B,) as int32. Raises ClipError unless each is the number of another branch, or -1, and
    there is no cycle."""
    branch_count = len(branch_parent)
    bad = np.flatnonzero((branch_parent < -1) | (branch_parent >= branch_count))
    if bad.size:
        got = branch_parent[bad[0]]
        raise ClipError(f"branch_parent: branch {bad[0]} has parent {got}, expected -1 to {branch_count - 1}")
    loops = np.flatnonzero(branch_parent == np.arange(branch_count))
    if loops.size:
        raise ClipError(f"branch_parent: branch {loops[0]} is its own parent, expected another branch or -1")
    branch_parent = branch_parent.astype(np.int32)
    on_cycle = _branch_on_cycle(branch_parent)
    if on_cycle is not None:
        got = branch_parent[on_cycle]
        raise ClipError(f"branch_parent: branch {on_cycle} (parent {got}) is its own ancestor, expected no cycle")
    return branch_parent


def _branch_on_cycle(branch_parent: np.ndarray) -> int | None:
    """Return the number of a branch that is its own ancestor, or None if there is none. `branch_parent` (B,) has -1 for
    roots."""
    count = len(branch_parent)
    ancestor = np.append(np.where(branch_parent < 0, count, branch_parent), count)
    for _ in range(count.bit_length()):
        ancestor = ancestor[ancestor]
    # At least `count` steps up have been taken: what has not reached a root is on a cycle, or leads to one.
    cyclic = np.flatnonzero(ancestor[:count] < count)
    return int(ancestor[cyclic[0]]) if cyclic.size else None


def _integers(name: str, values: ArrayLike) -> np.ndarray:
    array: np.ndarray = np.asarray(values)
    if array.ndim != 1:
        raise ClipError(f"{name}: got shape {array.shape}, expected one dimension")
    if array.dtype.kind not in "iu":
        raise ClipError(f"{name}: got dtype {array.dtype}, expected integers")
    return array


def _point(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"


def stands_still(clip: MotionClip) -> bool:
    """Return whether all frames are the rest pose; they are read once for a clip."""
    if clip._stands_still is None:
        frames = (clip.block(frame, frame + 1)[0] for frame in range(clip.frame_count))
        clip._stands_still = all(np.array_equal(frame, clip.source_rest) for frame in frames)
    return clip._stands_still
