"""The entry points of encoding: a motion clip becomes one .ath file, in one call or in three.

`encode_clip` does all of it. `draft`, `code_segments` and `write` are its three steps, for several processes that work
on one clip. A clip is made ready (preparation/), decided about (decisions.py), coded and put together (assembly/).
"""

from __future__ import annotations

import dataclasses
import io
import itertools
import shutil
import tempfile
import warnings
from collections.abc import Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, cast

from athcodec.decoding import container as ct
from athcodec.encoding.assembly.assembly import SPOOL_BYTES, FileAssembly
from athcodec.encoding.assembly.decided import CodedSegment, Decided, Draft
from athcodec.encoding.assembly.filled import FilledFile
from athcodec.encoding.assembly.segment_coding import SegmentCoder
from athcodec.encoding.assembly.summary import Summary
from athcodec.encoding.clip.places import PlacedClip
from athcodec.encoding.decisions import FileDecisions
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.preparation.bounds import BoundOption
from athcodec.encoding.preparation.preparation import placed_clip, prepared, resumed
from athcodec.encoding.search.progress import Progress, WeightedProgress, phase_weights
from athcodec.encoding.search.segment_samples import SAMPLES
from athcodec.encoding.segments.layers import layer_ratios
from athcodec.encoding.segments.segmentation import split_segments
from athcodec.encoding.streams.writing import Spool
from athcodec.errors import CoarseWarning, SourceWarning
from athcodec.files.atomic import check_target, keeping, new_file
from athcodec.motion.clip import ClipRange, MotionClip
from athcodec.motion.joining import metadata_of
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.units import LengthLike, length_of, scene_unit, size_of, stated_scene
from athcodec.options import DEFAULT_REL_ERROR

USUAL = "usual effort"  # The phase of progress in which effort "best" decides as "default" does.


def encode_clip(
    clip: MotionClip,
    target: str | PathLike[str] | BinaryIO,
    *,
    max_error: LengthLike | None = None,
    rel_error: float | None = None,
    target_size: int | str | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Summary:
    """Compress a clip into an .ath file: `athcodec.encode`, which documents the options, of a clip."""
    option, checked = _checked(clip, max_error, rel_error, target_size, **options)
    with keeping(clip.inputs):
        _check(target)  # Refused targets cost no work.
        path = target if isinstance(target, (str, PathLike)) else None
        whole = tempfile.SpooledTemporaryFile(SPOOL_BYTES) if path is None else new_file(path)
        with whole as opened, clip.watched(), tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
            out = cast(BinaryIO, opened)
            report = _weighted_progress(clip, progress, option, checked)
            filled, objection = _filled(clip, option, checked, report, spool)
            summary = filled.write(None if path is None else Path(path), out)
            report("done", 1.0)
            if path is None:
                out.seek(0)
                shutil.copyfileobj(out, cast(BinaryIO, target))
        _warn(objection)
        return summary


def _checked(
    clip: MotionClip,
    max_error: LengthLike | None,
    rel_error: float | None,
    target_size: int | str | None,
    *,
    tam: Thresholds | None = None,
    **options: Any,
) -> tuple[BoundOption, EncodingOptions]:
    """Return two things: the bound that is asked for, and the other options, with lengths in the units of the clip.
    Raises ClipError for a clip whose unit or up axis is unknown, and the errors of the options.
    """
    for clip_range in clip.clip_ranges or (ClipRange("", clip.frame_count),):
        stated_scene(metadata_of(clip.metadata, clip_range.name))
    unit = scene_unit(clip.metadata)
    checked = EncodingOptions.of(tam=None if tam is None else tam.in_scene_units(unit), **options)
    length = None if max_error is None else length_of(max_error, "max_error").in_scene_units(unit)
    size = None if target_size is None else size_of(target_size, "target_size")
    return BoundOption(length, rel_error, size, checked.lossless), checked


def _check(target: Any) -> None:
    """Refuse a target that cannot be written. Raises OSError, and TypeError for a file opened as text."""
    if not hasattr(target, "write"):
        check_target(target, ".ath")
    elif isinstance(target, io.TextIOBase):
        raise TypeError("target: got a file opened as text; expected one opened with mode 'wb'")
    elif not getattr(target, "writable", lambda: True)():
        raise io.UnsupportedOperation("target: got a file that is not open for writing; expected mode 'wb'")


def draft(
    clip: MotionClip,
    *,
    max_error: LengthLike | None = None,
    rel_error: float | None = None,
    target_size: int | str | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Draft:
    """Return the first step of `encode`, whose options it takes: branches, survey, and the search for settings.

    Raises
    ------
    ClipError, BoundError, ValueError
        As `encode`.
    """
    option, checked = _checked(clip, max_error, rel_error, target_size, **options)
    with clip.watched():
        report = _weighted_progress(clip, progress, option, checked, draft=True)
        decisions, bound, decided = _decided(clip, option, checked, report)
        made = decisions.draft(decided)
    _warn(_objection(decided, option, bound))
    return made


def code_segments(
    clip: MotionClip, draft: Draft, segments: Iterable[int], *, jobs: int | None = None
) -> Iterator[CodedSegment]:
    """Yield the second step: codes some of the segments 0 to draft.segment_count - 1.

    Parameters
    ----------
    clip : MotionClip
        The clip that the draft was made of; it may have been opened again in another process.
    draft : Draft
    segments : iterable of int
        Ascending.
    jobs : int, optional
        Threads, as in `encode`.

    Yields
    ------
    CodedSegment

    Raises
    ------
    ClipError
        Where the clip is another than that of the draft, as far as its hierarchy and rest pose show.
    """
    decisions = FileDecisions(*resumed(clip, draft, jobs))
    with clip.watched(), decisions.refusing(draft.choice.settings.bound):
        yield from SegmentCoder(decisions.decided(draft), decisions.options).coded(list(segments))


def write(
    clip: MotionClip,
    draft: Draft,
    coded: Iterable[CodedSegment],
    path: str | PathLike[str],
    *,
    progress: Progress | None = None,
) -> Summary:
    """Return the third step: writes the file that `encode` would write.

    Parameters
    ----------
    clip, draft
        As in `code_segments`.
    coded : iterable of CodedSegment
        All segments, in any order.
    path : str or path-like
        The file.
    progress : callable, optional
        As in `encode`.

    Returns
    -------
    Summary

    Raises
    ------
    ClipError
        As `code_segments`.
    ValueError
        Where segments are missing or come twice.
    OSError
        Where the file cannot be written.
    """
    with keeping(clip.inputs):
        check_target(path, ".ath")
    with new_file(path) as out, clip.watched(), tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
        report = WeightedProgress(progress, {"motion": 1.0})
        summary = _filled_of_draft(clip, draft, coded, report, spool).write(Path(path), out)
        report("done", 1.0)
        return summary


def _filled(
    clip: MotionClip, option: BoundOption, options: EncodingOptions, report: Progress, spool: Spool
) -> tuple[FilledFile, str]:
    """Decide about the file of a clip and code all of it. Return two things: the file, ready to be written, and what
    there is to object to its bound. All else that encoding has made is freed, before the file is decoded as a check.
    """
    decisions, bound, decided = _decided(clip, option, options, report)
    with decisions.refusing(bound):
        coded = SegmentCoder(decided, options, report).coded(range(decided.segment_count))
        return FileAssembly(decided, options, report).filled(spool, coded), _objection(decided, option, bound)


def _filled_of_draft(
    clip: MotionClip, draft: Draft, coded: Iterable[CodedSegment], report: Progress, spool: Spool
) -> FilledFile:
    """Return the file of a draft and its coded segments, ready to be written."""
    decisions = FileDecisions(*resumed(clip, draft))
    return FileAssembly(decisions.decided(draft), decisions.options, report).filled(spool, coded)


def _decided(
    clip: MotionClip, option: BoundOption, options: EncodingOptions, report: Progress, known: PlacedClip | None = None
) -> tuple[FileDecisions, float, Decided]:
    """Decide about the file of a clip. Return three things: the object that makes its decisions, the bound in scene
    units, and the decision. As trials estimate sizes, effort "best" also decides as "default" does, and keeps the
    smaller file. `known`: the clip's places, which do not depend on the effort, or None if they have to be found.
    """
    if known is None:
        clip.check()
        known = placed_clip(clip, options, option.least(clip))
    usual = None
    if _is_compared(option, options):
        as_usual = dataclasses.replace(options, effort="default")
        weights = _phase_weights(clip, option, as_usual, motion=False)
        part = WeightedProgress(lambda phase, fraction: report(f"{USUAL}: {phase}", fraction), weights)
        usual = _decided(clip, option, as_usual, part, known)
    with warnings.catch_warnings():
        if usual is not None:
            warnings.simplefilter("ignore", SourceWarning)  # The usual effort has warned.
        source, work = prepared(known, option, options, report)
    decisions = FileDecisions(source, options, report)
    if work is not None:
        decisions = dataclasses.replace(decisions, spent=work.done, untried=tuple(set(work.untried) & {"branches"}))
    bound = _bound(decisions, option, report)
    with decisions.refusing(bound):
        decided = decisions.decide(bound)
    if usual is not None and FileAssembly(usual[2], options).size() <= FileAssembly(decided, options).size():
        usual[2].choice = dataclasses.replace(usual[2].choice, untried=decided.choice.untried)
        return usual[0], bound, usual[2]
    return decisions, bound, decided


def _is_compared(option: BoundOption, options: EncodingOptions) -> bool:
    """Return whether a clip is encoded at the usual effort, too, and the smaller file kept. With a target size both
    files would be of that size."""
    return options.effort == "best" and option.target_size is None


def _bound(decisions: FileDecisions, option: BoundOption, report: Progress) -> float:
    """Return the bound of a file in scene units, for which files of several bounds are measured if a target size is
    asked for.
    """
    attempts = itertools.count(1)

    def file_size(bound: float) -> float:
        size, attempt = decisions.file_size(bound), next(attempts)
        report("size", attempt / (attempt + 4))
        return size

    return option.in_scene_units(decisions.source, file_size)


def _objection(decided: Decided, option: BoundOption, bound: float) -> str:
    """Return a sentence that says why the bound is coarse for the plant, or an empty text if it is not."""
    source = decided.source
    return option.objection(bound, source.seen.diagonal, source.clip.motion.metadata.get("unit"))


def _warn(objection: str) -> None:
    """Warn the caller of `encode` if there is something to object to the bound."""
    if objection:
        warnings.warn(objection, CoarseWarning, stacklevel=4)


def _weighted_progress(
    clip: MotionClip, progress: Progress | None, option: BoundOption, options: EncodingOptions, draft: bool = False
) -> WeightedProgress:
    """Return the progress of a whole encoding, whose phases count by the time that they are expected to take."""
    weights = _phase_weights(clip, option, options, not draft)
    if _is_compared(option, options):
        as_usual = dataclasses.replace(options, effort="default")
        weights = {USUAL: sum(_phase_weights(clip, option, as_usual, motion=False).values())} | weights
    return WeightedProgress(progress, weights)


def _phase_weights(clip: MotionClip, option: BoundOption, options: EncodingOptions, motion: bool) -> dict[str, float]:
    """Return about how much work each phase of an encoding takes, as {phase: work}. `motion`: whether segments are
    coded, too.
    """
    segments = split_segments(clip.frame_count, clip.vertex_count, options.segment_frames, ct.Limits.memory_bytes)
    return phase_weights(
        clip.vertex_count,
        segments,
        options.effort,
        samples=min(SAMPLES, len(clip.clip_range_frames)),
        branches=not clip.has_branches,
        sizes=option.target_size is not None,
        motion=motion,
        layers=len(layer_ratios(options.ladder, option.rel_error or DEFAULT_REL_ERROR, 1.0)),
    )
