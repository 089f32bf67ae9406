"""The entry points of encoding: a motion clip becomes one .ath file, in one call or in three.

`encode` does all of it. `draft`, `code_segments` and `write` are its three steps, for several processes that work on
one clip. The work itself is job.py's.
"""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from os import PathLike
from typing import Any

import numpy as np

from athcodec.decoding import container as ct
from athcodec.encoding.bounds import BoundOption
from athcodec.encoding.branch_trials import best_branches
from athcodec.encoding.job import SPOOL_BYTES, CodedSegment, Draft, EncodingJob, EncodingOptions
from athcodec.encoding.layers import layer_ratios
from athcodec.encoding.progress import BRANCH_SHARE, Progress, WeightedProgress, Work, allowed_work, stage_weights
from athcodec.encoding.segment_samples import SAMPLES
from athcodec.encoding.segmentation import split_segments
from athcodec.encoding.summary import Summary
from athcodec.files.atomic import check_target, keeping, new_file
from athcodec.motion.branches.grown_pose import with_grown_pose
from athcodec.motion.clip import MotionClip
from athcodec.motion.thresholds import Thresholds
from athcodec.motion.units import Length
from athcodec.options import DEFAULT_LADDER, DEFAULT_REL_ERROR


def encode(
    clip: MotionClip,
    path: str | PathLike[str],
    *,
    max_error: float | None = None,
    rel_error: float | None = None,
    target_size: int | None = None,
    segment_frames: int | None = None,
    tam: Thresholds | None = None,
    exact_rest: bool = False,
    host_rest: bool = False,
    rest_error: float | str | Length | None = None,
    lossless: bool = False,
    weights: str | np.ndarray | None = None,
    attributes: str = "all",
    effort: str = "default",
    smoothness: str = "default",
    ladder: str | Sequence[float] = DEFAULT_LADDER,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Summary:
    """Compress a clip into an .ath file, which appears under its name only when it is whole.

    At most one of `max_error`, `rel_error` and `target_size` is given.

    Parameters
    ----------
    clip : MotionClip
        A clip without branches gets those that `find_branches` proposes, whichever make the smallest file. Several
        clips of one plant go into one file when they have been joined (`join`).
    path : str or path-like
        The file; an older .ath file, unless `clip` reads it, or an empty file is replaced, any other one refused.
    max_error : float, optional
        Bound in scene units on the distance of every vertex in every frame from the source.
    rel_error : float, optional
        The same as a fraction of the diagonal of the bounding box over all frames; default 1e-4, lossless 4e-7.
    target_size : int, optional
        Bytes: the file has the smallest bound that fits.
    segment_frames : int, optional
        Longest segment in frames, 16 to 256; default 128, or all frames of a clip of up to 256 whose float32 positions
        take at most 32 MiB, or 256 where motion is predicted.
    tam : Thresholds, optional
        Acceptance thresholds of the ATH (Song, Yang and Peng 2011, section 3); by default one map per frame stays
        within the bound. Where they are given, the file keeps them in its metadata, and motion is not predicted, which
        has no such hierarchy.
    exact_rest : bool
        Keep the rest pose bit for bit. Else one that the clip was given comes back within the bound, or within 0.3 % of
        the diagonal where motion is coded about another pose; one that was made is not stored.
    host_rest : bool
        Leave the rest pose out: whoever plays the file has the mesh, and hands it over (`open`, host_mesh). It is the
        clip's rest pose, the first frame where it has none of its own, as float32; the file holds its checksum.
    rest_error : float or str or Length, optional
        How far the rest pose may be off: a fraction of the diagonal, a length with its unit ("2mm"), or "bound", which
        leaves it to the bound. By default that of branches with faces is fine enough at every level that edges keep
        their length within about 2 % and normals within about 1 degree, and that of others is of the bound.
    lossless : bool
        One more level holds the positions bit for bit, and the rest pose is kept likewise; the bound is that of the
        level before.
    weights : str or (N,) array, optional
        A factor above 0 on the bound for each vertex, or the name of the attribute that holds them: vertex v is within
        weights[v] times the bound. The file promises the largest of these for all vertices.
    attributes : {"all", "none"}
        "none" drops faces, edges and named arrays.
    effort : {"fast", "default", "best"}
        How long settings are searched. "default" counts its work, which a thread does in at most about 3 s and 5 us for
        each vertex in a frame, and "best" may take ten times as long; `Summary.untried` names what did not fit.
    smoothness : {"default", "bytes", "motion"}
        How many bytes steady errors of predicted motion, as of growth, may cost: up to 15 %, none, or as many again.
    ladder : {"decades", "none"} or sequence of float
        Largest errors over the diagonal at which a decoder can stop, each held by a layer of precision: one file for
        every distance, a few percent larger than "none", a single layer for archives. "decades" is 1e-2, 1e-3 and so
        on. Errors below 4 bounds, or less than 2.5 times apart, make no layer of their own. A clip that stands still
        has a single layer in any case.
    jobs : int, optional
        Threads; by default one per core, at most 4, fewer for large meshes. The file is the same whatever their number,
        memory grows with it.
    progress : callable, optional
        Called with the stage ("survey", "search: learned modes", "motion" ...) and the elapsed fraction of the whole
        time, which never falls and ends with 1.0.

    Returns
    -------
    Summary

    Raises
    ------
    ClipError
        For a clip that cannot be stored.
    BoundError
        For a bound or size that cannot be kept.
    ValueError
        For options that contradict each other or are out of range.
    OSError
        Where the file cannot be written.
    """
    option = BoundOption(max_error, rel_error, target_size, lossless)
    options = EncodingOptions.of(
        segment_frames=segment_frames,
        tam=tam,
        exact_rest=exact_rest,
        host_rest=host_rest,
        rest_error=rest_error,
        lossless=lossless,
        weights=weights,
        attributes=attributes,
        effort=effort,
        smoothness=smoothness,
        jobs=jobs,
        ladder=ladder,
    )
    with keeping(clip.inputs):
        check_target(path, ".ath")  # Refused targets cost no work.
        job, bound = _begin(clip, option, options, _weighted_progress(clip, progress, option, options))
        with new_file(path) as out, clip.watched(), tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
            with job.refusing(bound):
                decided = job.decide(bound)
                return job.write(path, out, spool, decided, job.coded(decided, range(decided.segment_count)))


def draft(
    clip: MotionClip,
    *,
    max_error: float | None = None,
    rel_error: float | None = None,
    target_size: int | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Draft:
    """The first step of `encode`, whose options it takes: branches, survey, and the search for settings.

    Raises
    ------
    ClipError, BoundError, ValueError
        As `encode`.
    """
    checked = EncodingOptions.of(**options)
    option = BoundOption(max_error, rel_error, target_size, checked.lossless)
    with clip.watched():
        job, bound = _begin(clip, option, checked, _weighted_progress(clip, progress, option, checked, draft=True))
        with job.refusing(bound):
            return job.draft(job.decide(bound))


def code_segments(
    clip: MotionClip, draft: Draft, segments: Iterable[int], *, jobs: int | None = None
) -> Iterator[CodedSegment]:
    """The second step: codes some of the segments 0 to draft.segment_count - 1.

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
    job = EncodingJob.resume(clip, draft, jobs=jobs)
    with clip.watched(), job.refusing(draft.choice.settings.bound):
        yield from job.coded(job.decided(draft), list(segments))


def write(
    clip: MotionClip,
    draft: Draft,
    coded: Iterable[CodedSegment],
    path: str | PathLike[str],
    *,
    progress: Progress | None = None,
) -> Summary:
    """The third step: writes the file that `encode` would write.

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
    job = EncodingJob.resume(clip, draft, WeightedProgress(progress, {"motion": 1.0}))
    with new_file(path) as out, clip.watched(), tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
        return job.write(path, out, spool, job.decided(draft), coded)


def _begin(
    clip: MotionClip, option: BoundOption, options: EncodingOptions, report: Progress
) -> tuple[EncodingJob, float]:
    """The job, whose clip has branches by then, and its bound in scene units."""
    clip.check()
    grown = clip if options.keeps_rest else with_grown_pose(clip)
    branches = None
    if not clip.has_branches:
        work = Work(
            BRANCH_SHARE * allowed_work(clip.vertex_count, clip.frame_count, options.effort), report, "branches"
        )
        work.expected = BRANCH_SHARE * allowed_work(clip.vertex_count, clip.frame_count, "default")
        with work.trying("branches"):
            branches = best_branches(grown, option, work, options.host_rest)
    job = EncodingJob.begin(clip, grown, branches, options, report)
    if branches is not None:
        job.spent, job.untried = work.done, tuple(set(work.untried) & {"branches"})
    attempts = itertools.count(1)

    def file_size(bound: float) -> float:
        size, attempt = job.file_size(bound), next(attempts)
        report("size", attempt / (attempt + 4))
        return size

    return job, option.in_scene_units(job.source, file_size)


def _weighted_progress(
    clip: MotionClip, progress: Progress | None, option: BoundOption, options: EncodingOptions, draft: bool = False
) -> WeightedProgress:
    segments = split_segments(clip.frame_count, clip.vertex_count, options.segment_frames, ct.Limits.memory_bytes)
    return WeightedProgress(
        progress,
        stage_weights(
            clip.vertex_count,
            segments,
            options.effort,
            samples=min(SAMPLES, len(clip.clip_range_frames)),
            branches=not clip.has_branches,
            sizes=option.target_size is not None,
            motion=not draft,
            layers=len(layer_ratios(options.ladder, option.rel_error or DEFAULT_REL_ERROR, 1.0)),
        ),
    )
