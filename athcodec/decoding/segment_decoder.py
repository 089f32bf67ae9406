"""Segments of an .ath file, decoded at a level: one at a time, or many in threads."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TypeAlias

import numpy as np

from athcodec.decoding import core_file
from athcodec.decoding.file_bytes import FileBytes
from athcodec.errors import LimitExceeded
from athcodec.files.threads import ThreadPool, default_jobs
from athcodec.options import whole

Show: TypeAlias = Callable[[int, core_file.Segment], None]
Room: TypeAlias = Callable[[int], np.ndarray | None]


class SegmentDecoder:
    """The segments of a file, which are decoded within the memory that its limits allow."""

    def __init__(self, file_bytes: FileBytes) -> None:
        self._bytes, self._core = file_bytes, file_bytes.core

    @cached_property
    def _work(self) -> core_file.Work:
        return core_file.Work(self._core.work_size())

    def prefetch(self, segments: range, level: int) -> None:
        """Fetch what segments of the whole file need at a level from a remote source."""
        with self._bytes.lock:
            self._bytes.announce(self._core.missing(level, segments[0], segments[-1]))

    def prepare(
        self, segment: int, level: int, spare: core_file.Segment | None = None, to: np.ndarray | None = None
    ) -> core_file.Segment:
        """Decode a segment of the file at a level.

        Parameters
        ----------
        segment : int
            Number of the segment in the whole file.
        level : int
            A stored level.
        spare : core_file.Segment, optional
            A prepared segment that nobody needs any more. If it is the wanted segment at a coarser level of all
            vertices, or the segment that the wanted one is joined to, decoding goes on from it and does not read its
            bytes again. Otherwise only its memory is reused, if it is large enough.
        to : (k, N, 3) array, optional
            Array for the positions of the k frames, of the file's type, contiguous, in the source's order. The array
            stays untouched if decoding cannot write there directly.

        Returns
        -------
        core_file.Segment
            The prepared segment, from which `core.positions` and `core.matrices` give frames. If its `is_delivered` is
            true, the positions are in the array `to` instead.

        Raises
        ------
        LevelUnavailable
            If the file was cut off before the segment.
        FormatError
            If the segment is damaged, or needs more memory than the limits allow.
        """
        segment, level = whole("segment", segment), whole("level", level)
        subject = f"level {level}, segment {segment}"
        size = self._core.segment_size(level) if to is None else self._core.segment_size_to(segment, level)
        needed = self._checked_need(level, subject)
        before = joined_to = None
        if spare and needed + len(spare.memory) <= self._bytes.limits.memory_bytes:
            if self._core.goes_on(spare, segment, level):
                before = spare
            elif self._core.is_ready(spare, self._core.joined_to(segment, level), level):
                joined_to = spare
        is_free = spare and not before and not joined_to and len(spare.memory) >= size
        ready = spare if spare and is_free else core_file.Segment(size)
        with self._bytes.lock, self._bytes.fed(self._missing(segment, level, before, joined_to), subject):
            self._refine(level)
            self._core.prepare(self._work, segment, level, ready, before, joined_to, to=to)
        return ready

    def show_all(self, segments: range, level: int, show: Show, room: Room) -> None:
        """Decode a range of segments of the file at a level, in runs of consecutive segments that threads share.

        `room(segment)` returns the array for the positions of a segment, the parameter `to` of `prepare`, or None. If
        the positions of a segment did not go into that array, a thread calls `show(segment, prepared)` with the
        prepared segment, whose memory the next segment takes over afterwards. Raises the exceptions of `prepare`.
        """
        subject = f"level {level}, segments {segments.start} to {segments.stop - 1}"
        with self._bytes.lock, self._bytes.fed(self._core.missing(level, segments[0], segments[-1]), subject):
            self._refine(level)
            follows, runs = self._runs(segments, level, subject)
            items = [(run, level, follows, show, room) for run in runs]
            faults = ThreadPool(len(runs)).map(self._show_run, items)
            for fault in filter(None, faults):
                raise fault

    def _checked_need(self, level: int, subject: str) -> int:
        """Return the bytes that preparing a segment takes. Raises LimitExceeded if they are not allowed."""
        needed, limit = self._core.segment_size(level) + self._core.work_size(), self._bytes.limits.memory_bytes
        if needed > limit:
            raise LimitExceeded(f"{subject}: got a need of {needed} bytes; the limit is {limit}")
        return needed

    def _runs(self, segments: range, level: int, subject: str) -> tuple[bool, list[range]]:
        """Return (goes_on, runs): whether memory allows to keep a segment while the segment joined to it is decoded,
        and one range of consecutive segments for each thread.

        The first segment of a run is decoded together with the segment that it is joined to, because no other thread
        has that one ready.
        """
        joined = any(self._core.joined_to(segment, level) >= 0 for segment in segments)
        size, limit, needed = (
            self._core.segment_size(level),
            self._bytes.limits.memory_bytes,
            self._checked_need(level, subject),
        )
        follows = joined and needed + size <= limit
        room = limit // (needed + size if follows else needed)
        count = max(1, min(default_jobs(), len(segments) // (2 if joined else 1), room))
        cuts = [len(segments) * i // count for i in range(count + 1)]
        return follows, [segments[start:stop] for start, stop in zip(cuts, cuts[1:])]

    def _show_run(self, run: range, level: int, follows: bool, show: Show, room: Room) -> core_file.CoreError | None:
        """Decode a range of segments at a level, one after the other, as `show_all` describes. `follows` says that a
        segment stays in memory for the one joined to it. A fault is returned and not raised, because other threads
        still need the file's bytes."""
        work, full = core_file.Work(self._core.work_size()), self._core.segment_size(level)
        size = max(full if room(segment) is None else self._core.segment_size_to(segment, level) for segment in run)
        ready, spare = core_file.Segment(size), None
        for segment in run:
            joined_to = None
            if follows and segment > run.start and self._core.joined_to(segment, level) == segment - 1:
                joined_to, ready = ready, spare or core_file.Segment(size)
                spare = joined_to
            try:
                self._core.prepare(work, segment, level, ready, joined_to=joined_to, to=room(segment))
            except core_file.CoreError as fault:
                return fault
            if not ready.is_delivered:
                show(segment, ready)
        return None

    def _refine(self, level: int) -> None:
        """Build what the segments share at a level, whose bytes are there."""
        needed, limit = self._core.refinement_size(level), self._bytes.limits.memory_bytes
        if needed > limit:
            raise LimitExceeded(f"level {level}: got layers of {needed} bytes; the limit is {limit}")
        self._core.refine(level)

    def _missing(
        self, segment: int, level: int, before: core_file.Segment | None, joined_to: core_file.Segment | None
    ) -> list[tuple[int, int]]:
        """Return the ranges of bytes that decoding a segment at a level still lacks. before, joined_to: prepared
        segments that need no bytes."""
        if not before and not joined_to:
            return self._core.missing(level, segment)
        ranges = self._core.missing_of(segment, level, self._core.level_of(before) if before else -1)
        neighbour = -1 if joined_to else self._core.joined_to(segment, level)
        return ranges if neighbour < 0 else sorted(ranges + self._core.missing_of(neighbour, level))
