"""Several clips of one plant as one, for one file; and clips that repeat without a jump.

A game's oak has a calm, a breeze and a storm: the same mesh, branches and rest pose, stored once. `join` lays such
clips one after the other; the encoder sees one long clip whose ranges it codes apart. `split` is its inverse. `looped`
makes a clip that can be played over and over. All read frames only when they are asked for.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.atomic import FileId
from athcodec.motion.clip import ClipRange, MotionClip, check_clip_ranges, clip_range_frames
from athcodec.motion.frames import Frames
from athcodec.options import real, whole
from athcodec.untyped import ArrayLike, JsonMapping, JsonObject

BLEND = "loop_blend"  # Key of metadata: number of frames that were blended.
OWN = "clips"  # Key of metadata: by name, what only one of several clips has.
STRENGTH, HEADING = "strength", "heading"  # Keys of metadata: the wind of a clip, the heading in degrees.
NAME, LOOP = "clip_name", "loop"  # Keys of metadata in files that hold a single clip and know no names or loops.


def join(clips: Mapping[str, MotionClip]) -> MotionClip:
    """Return several clips of one plant as one clip, for one .ath file, which holds once what they have in common.

    Parameters
    ----------
    clips : dict of str to MotionClip
        The clips by name, in the order that they get in the file. They need the same vertices, branches, faces, edges,
        attributes and rest pose. A clip whose rest pose is only its first frame, because its source has none, takes
        the rest pose of the others. Metadata in which clips differ are kept for each clip.

    Returns
    -------
    MotionClip
        A clip with a clip range for each. Closing it closes all of them.

    Raises
    ------
    ClipError
        If the clips are not of one plant, a name cannot be stored, or one of them is several clips already.

    Examples
    --------
    >>> with athcodec.read(athcodec.sample_path()) as tree:
    ...     athcodec.join({"first": tree, "again": tree}).frame_count
    240
    """
    if not clips:
        raise ClipError("clips: got none, expected at least one")
    parts, first = list(clips.values()), next(iter(clips.values()))
    for name, part in clips.items():
        _check_alike(name, part, next(iter(clips)), first)
    clip_ranges = tuple(dataclasses.replace(_only_clip_range(name, part), name=name) for name, part in clips.items())
    rest = _common_rest(clips)
    closing = ExitStack()
    for part in parts:
        closing.callback(part.close)
    joined = MotionClip(
        _joined([part.positions for part in parts]),
        np.concatenate([part.time for part in parts]),
        first.vertex_branch,
        first.branch_parent,
        rest,
        first.edges,
        first.faces,
        first.attributes,
        _common_metadata(clips),
        stem_index=first.stem_index,
        clip_ranges=clip_ranges,
        resource=closing,
        unchanged=_AllUnchanged(parts),
        skin=first.skin,
        not_read=first.not_read,
    )
    joined.rest_given = any(part.rest_given for part in parts)
    return joined


def split(clip: MotionClip) -> dict[str, MotionClip]:
    """Return the single clips that `join` has put into one clip.

    Parameters
    ----------
    clip : MotionClip
        A clip with one or several clip ranges.

    Returns
    -------
    dict of str to MotionClip
        The clips by their names; a single clip without a name is under "". Closing any of them closes all.

    Examples
    --------
    >>> with athcodec.read(athcodec.sample_path()) as tree:
    ...     list(athcodec.split(athcodec.join({"first": tree, "again": tree})))
    ['first', 'again']
    """
    if len(clip.clip_ranges) < 2:
        return {_only_clip_range("", clip).name: clip}
    return {
        clip_range.name: clip.replace(
            positions=_run(clip.positions, start, stop),
            time=clip.time[start:stop],
            clip_ranges=(clip_range,),
            metadata=metadata_of(clip.metadata, clip_range.name),
        )
        for clip_range, (start, stop) in zip(clip.clip_ranges, clip.clip_range_frames)
    }


def metadata_of(metadata: JsonMapping, name: str) -> JsonObject:
    """Return the metadata of one of several clips: what all have in common, and what only this one has."""
    owned = metadata.get(OWN)
    by_clip = owned.get(name) if isinstance(owned, dict) else None
    common = {key: value for key, value in metadata.items() if key != OWN}
    return common | by_clip if isinstance(by_clip, dict) else common


def in_wind(clip: MotionClip, strength: float, heading: float = 0.0) -> MotionClip:
    """Return the clip with the wind that it shows, by which players choose what to blend.

    Parameters
    ----------
    clip : MotionClip
    strength : float
        Of the wind, 0 or more, in any unit that all clips of a file share.
    heading : float, optional
        Direction that the wind blows to, degrees about the up axis.

    Returns
    -------
    MotionClip
        Closing it closes `clip`.

    Raises
    ------
    ClipError
        If a number is not finite, or the strength below 0.

    Examples
    --------
    >>> with athcodec.read(athcodec.sample_path()) as tree:
    ...     athcodec.in_wind(tree, 8.0, 45.0).metadata["strength"]
    8.0
    """
    strength, heading = real("wind strength", strength), real("wind heading", heading)
    if not (0 <= strength < math.inf and math.isfinite(heading)):
        raise ClipError(
            f"wind: got strength {strength} and heading {heading}, expected finite numbers, the first 0 or more"
        )
    return clip.replace(metadata=clip.metadata | {STRENGTH: strength, HEADING: heading % 360})


def wind_of(metadata: JsonMapping) -> tuple[float, float]:
    """Return strength and heading of a clip's wind, from its metadata; NaN if it names none."""
    numbers = metadata.get(STRENGTH, math.nan), metadata.get(HEADING, 0.0)
    are_known = all(isinstance(one, int | float) and not isinstance(one, bool) and abs(one) < 1e300 for one in numbers)
    return (float(numbers[0]), float(numbers[1])) if are_known else (math.nan, math.nan)


def looped(clip: MotionClip, blend: int = 0) -> MotionClip:
    """Return the clip as a loop: its first frame follows its last, after the mean time of a frame.

    Parameters
    ----------
    clip : MotionClip
    blend : int, optional
        Number of frames, at most a third of all, for a motion that does not end where it began. They are taken off
        its end and blended into the frames at its beginning, so that the new frame 0 is what followed the new last
        frame in the source.

    Returns
    -------
    MotionClip
        Closing it closes `clip`.

    Raises
    ------
    ClipError
        If the clip is several clips, or has too few frames to blend.

    Examples
    --------
    >>> with athcodec.read(athcodec.sample_path()) as tree:
    ...     athcodec.looped(tree, blend=20).frame_count
    100
    """
    clip_range = _only_clip_range("", clip)
    if not 0 <= (blend := whole("blend", blend)) <= clip.frame_count // 3:
        raise ClipError(
            f"loop: got {blend} frames to blend, expected 0 to {clip.frame_count // 3}, a third of the clip"
        )
    frames = clip.frame_count - blend
    clip_ranges = (dataclasses.replace(clip_range, frame_count=frames, loop=True),)
    if not blend:
        return clip.replace(clip_ranges=clip_ranges)
    return clip.replace(
        positions=_blended(clip.positions, blend),
        time=clip.time[:frames],
        clip_ranges=clip_ranges,
        metadata=clip.metadata | {BLEND: blend},
    )


def clip_metadata(motion: Any) -> JsonObject:
    """Return metadata of a motion, with the name of its clip and whether that is a loop, for files with a single
    clip."""
    clip_range = next(iter(getattr(motion, "clip_ranges", ())), ClipRange("", 0))
    metadata = getattr(motion, "metadata", None) or {}
    return metadata | ({NAME: clip_range.name} if clip_range.name else {}) | ({LOOP: True} if clip_range.loop else {})


def read_clip_metadata(clip: MotionClip) -> None:
    """Move name and loop from the metadata of a clip, as clip_metadata puts them there, to its clip range. Raises
    ClipError."""
    name, loop = clip.metadata.get(NAME), clip.metadata.get(LOOP)
    name, loop = name if isinstance(name, str) else "", loop is True
    if name or loop:
        clip.metadata = {key: value for key, value in clip.metadata.items() if key not in (NAME, LOOP)}
        clip.clip_ranges = (ClipRange(name, clip.frame_count, loop),)
        check_clip_ranges(clip.clip_ranges, clip.frame_count)


def _only_clip_range(name: str, clip: MotionClip) -> ClipRange:
    if len(clip.clip_ranges) > 1:
        raise ClipError(f"{name or 'clip'}: got {len(clip.clip_ranges)} clips in one, expected a single one")
    return clip.clip_ranges[0] if clip.clip_ranges else ClipRange(name, clip.frame_count)


def _check_alike(name: str, clip: MotionClip, first_name: str, first: MotionClip) -> None:
    """Raise ClipError unless the clip `name` has the same vertices, branches, edges, faces and attributes as the clip
    `first_name`."""
    if clip.vertex_count != first.vertex_count:
        raise ClipError(f"{name}: got {clip.vertex_count} vertices, expected {first.vertex_count} as {first_name} has")
    for name_of_array in ("vertex_branch", "branch_parent", "stem_index", "edges", "faces"):
        if not _equal(getattr(clip, name_of_array), getattr(first, name_of_array)):
            raise ClipError(f"{name}: got other {name_of_array} than {first_name}, expected clips of one plant")
    for name_of_array in sorted(clip.attributes.keys() | first.attributes.keys()):
        if not _equal(clip.attributes.get(name_of_array), first.attributes.get(name_of_array)):
            raise ClipError(
                f"{name}: got another attribute {name_of_array} than {first_name}, expected clips of one plant"
            )


def _equal(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    return a is b or (
        a is not None and b is not None and a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    )


def _common_rest(clips: Mapping[str, MotionClip]) -> np.ndarray:
    """Return the rest pose (N, 3) that the clips share. A clip whose rest pose is only its own first frame is not
    asked. Raises ClipError if two rest poses differ."""
    rests = {name: clip for name, clip in clips.items() if not np.array_equal(clip.rest, clip.block(0, 1)[0])}
    name, chosen = next(iter((rests or clips).items()))
    for other, clip in rests.items():
        if not np.array_equal(clip.rest, chosen.rest):
            vertex = int(np.linalg.norm(clip.rest - chosen.rest, axis=1).argmax())
            raise ClipError(
                f"{other}: got another rest pose than {name} (vertex {vertex} is "
                f"{clip.rest[vertex].tolist()}, not {chosen.rest[vertex].tolist()}), expected clips of one "
                "plant"
            )
    return chosen.source_rest


def _common_metadata(clips: Mapping[str, MotionClip]) -> JsonObject:
    """Return the metadata that all clips have in common, and under the key OWN, by clip name, those in which they
    differ."""
    every = [clip.metadata for clip in clips.values()]
    common = {
        key: value
        for key, value in every[0].items()
        if all(key in metadata and metadata[key] == value for metadata in every)
    }
    by_clip = {
        name: {key: value for key, value in clip.metadata.items() if key not in common} for name, clip in clips.items()
    }
    by_clip = {name: metadata for name, metadata in by_clip.items() if metadata}
    return common | {OWN: by_clip} if by_clip else common


class _AllUnchanged:
    """Whether the files of several clips are as they were."""

    def __init__(self, clips: Sequence[MotionClip]):
        self._checks = [clip.unchanged for clip in clips if clip.unchanged is not None]
        self.files = frozenset[FileId]().union(*(clip.inputs for clip in clips))

    def __call__(self) -> bool:
        return all(check() for check in self._checks)


def _joined(parts: Sequence[Any]) -> Frames:
    """Return the positions of several clips as one array, one after the other, read when frames are sliced."""
    ranges = clip_range_frames([ClipRange("", part.shape[0]) for part in parts])
    dtype = np.result_type(*(part.dtype for part in parts))

    def read(start: int, stop: int) -> np.ndarray:
        runs = [
            np.asarray(part[max(start, first) - first : min(stop, last) - first], dtype)
            for part, (first, last) in zip(parts, ranges)
            if first < stop and start < last
        ]
        return runs[0] if len(runs) == 1 else np.concatenate(runs)

    return Frames(read, ranges[-1][1], parts[0].shape[1], dtype)


def _run(positions: ArrayLike, first: int, last: int) -> Frames:
    """Return the positions of frames `first` to `last` - 1, which are read when they are sliced."""
    return Frames(
        lambda start, stop: positions[first + start : first + stop], last - first, positions.shape[1], positions.dtype
    )


def _blended(positions: ArrayLike, blend: int) -> Frames:
    """Return all frames but the last `blend`. The first `blend` frames turn gradually from the frames that followed the
    new last one into the source's own, so that the end leads smoothly to the beginning."""
    frame_count, dtype = positions.shape[0] - blend, positions.dtype

    def read(start: int, stop: int) -> np.ndarray:
        """Return the positions (stop - start, N, 3) of frames start to stop - 1 of the loop."""
        shown, last = np.asarray(positions[start:stop]), min(stop, blend)
        if start >= last:
            return shown
        place = np.arange(start, last)[:, None, None] / blend
        weight = place * place * (3 - 2 * place)  # Smoothstep: neither positions nor speeds jump.
        leaving = np.asarray(positions[frame_count + start : frame_count + last], np.float64)
        mixed = shown.astype(dtype, copy=True)
        mixed[: last - start] = leaving + (shown[: last - start] - leaving) * weight
        return mixed

    return Frames(read, frame_count, positions.shape[1], dtype)
