"""Which of the branches that motion/branches proposes make the smallest file; each is tried on a few frames."""

from __future__ import annotations

import dataclasses
import math
import tempfile

import numpy as np

from athcodec.decoding import container as ct
from athcodec.encoding import writing
from athcodec.encoding.bounds import BoundOption
from athcodec.encoding.job import SPOOL_BYTES, EncodingJob, EncodingOptions
from athcodec.encoding.progress import Progress
from athcodec.encoding.segment import Source
from athcodec.encoding.survey import survey
from athcodec.errors import BoundError
from athcodec.motion.branches.finding import candidates
from athcodec.motion.branches.result import Found, with_branches
from athcodec.motion.clip import MotionClip
from athcodec.motion.hierarchy import hierarchy_of
from athcodec.options import DEFAULT_SEGMENT

TRIAL_FRAMES = 64  # Frames of a clip that branches are tried on.
FILLED = 0.8  # Share of a target size that a file fills at the bound at which branches are compared.


def best_branches(clip: MotionClip, option: BoundOption, report: Progress, host_rest: bool = False) -> Found:
    """Return the candidate that makes the smallest file of a few frames at the bound."""
    proposals = candidates(clip)
    if len(proposals) == 1:
        return proposals[0]
    trial = _Trial(clip, option, host_rest)
    sizes = []
    for branches in proposals:
        sizes.append(trial.size(branches))
        report("branches", len(sizes) / (len(proposals) + 2))
    best = proposals[int(np.argmin(sizes))]
    if best.stem_index is None or best.method != "motion":
        return best
    unordered = dataclasses.replace(best, stem_index=None)  # The source's order of vertices costs no bytes.
    return unordered if trial.size(unordered) < min(sizes) else best


class _Trial:
    """Frames from the middle of a clip, coded on different branches. Sizes are extrapolated to the whole clip."""

    def __init__(self, clip: MotionClip, option: BoundOption, host_rest: bool):
        start = max(0, (clip.frame_count - TRIAL_FRAMES) // 2)
        stop = min(clip.frame_count, start + TRIAL_FRAMES)
        self._clip = MotionClip(clip.block(start, stop), np.arange(start, stop) / clip.fps, rest=clip.source_rest)
        self._clip.rest_given = clip.rest_given
        self._frames_ratio = clip.frame_count / (stop - start)
        self._option, self._host_rest = option, host_rest

    def size(self, branches: Found) -> float:
        """Return the bytes of the whole clip's file on these branches; infinite if the bound cannot be kept."""
        clip, lossless, host_rest = with_branches(self._clip, branches), self._option.lossless, self._host_rest
        hierarchy = hierarchy_of(clip)
        source = Source(
            clip,
            hierarchy,
            survey(clip, hierarchy),
            DEFAULT_SEGMENT,
            exact_rest=lossless or host_rest,
            host_rest=host_rest,
        )
        job = EncodingJob(source, EncodingOptions(attributes="none", lossless=lossless))
        if self._option.target_size is not None:
            self._option = self._bound_of_target(job)
        return self._job_size(job, self._option.in_scene_units(source, job.file_size))

    def _bound_of_target(self, job: EncodingJob) -> BoundOption:
        """Return the bound at which the branches tried first meet the target size; all are tried at it."""
        try:
            bound = self._option.in_scene_units(job.source, lambda bound: self._job_size(job, bound), FILLED)
        except BoundError:
            return BoundOption()
        return BoundOption(max_error=bound)

    def _job_size(self, job: EncodingJob, bound: float) -> float:
        with tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
            try:
                entries = job.encode(bound, writing.ChunkStore(spool)).store.entries
            except BoundError:
                return math.inf
        return sum(
            chunk.length * (self._frames_ratio if chunk.is_motion and chunk.kind != ct.SHAPES else 1)
            for chunk, _ in entries
        )
