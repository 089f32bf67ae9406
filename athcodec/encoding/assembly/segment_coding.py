"""The segments of a file are coded in threads, each as soon as the one that it goes on from has left its ends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from athcodec.encoding.assembly.decided import CodedSegment, Decided
from athcodec.encoding.model.motion import release_memory
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.search.choices.prediction import code_predicted_segment
from athcodec.encoding.search.progress import Progress, silent
from athcodec.encoding.segments.layers import CodedMotion, Ends
from athcodec.encoding.segments.predicted import PredictedBeside
from athcodec.encoding.segments.segment import Source, thread_count
from athcodec.files.threads import ThreadPool


@dataclass(frozen=True)
class SegmentCoder:
    """Codes segments as it is decided for a file."""

    decided: Decided
    options: EncodingOptions
    report: Progress = silent

    def coded(self, segments: Sequence[int]) -> Iterator[CodedSegment]:
        """Yield coded segments, as many at a time as there is memory for, after those that were coded to compare and
        are joined to no other."""
        decided, source = self.decided, self.decided.source
        alone = {index for index in segments if index in decided.tried and source.stands_alone(index)}
        others = [index for index in segments if index not in alone]
        tried = (decided.tried[index] for index in sorted(alone))
        return chain(tried, self._coded(others)) if others else tried

    def _coded(self, segments: Sequence[int]) -> Iterator[CodedSegment]:
        """Code some segments on several threads, and yield each as it is finished, in the order of `segments`. A
        segment that one of these is joined to is coded too, but not yielded unless it is among them.
        """
        decided, source = self.decided, self.decided.source
        at_once = thread_count(self.options.jobs, source)
        pool = ThreadPool(at_once, beside=source.pool.jobs > 1)

        def predict(read: tuple[int, list[np.ndarray]]) -> CodedSegment:
            index, block = read
            positions, exact = self._positions(block.pop())  # The list no longer holds the block.
            frames = positions, exact, source.shown_times(index), source.box
            return CodedSegment(index, *code_predicted_segment(decided.prelude, decided.choice, *frames))

        def begin(read: tuple[int, list[np.ndarray], Ends | None, Ends | None]) -> tuple[int, CodedMotion]:
            index, block, before, after = read
            frames = self._positions(block.pop()) if block else (source.positions(index), self._exact(index))
            return index, self._motion(index, *frames, before, after)

        if decided.choice.predicted:
            return pool.ordered(predict, ((index, [source.block(index)]) for index in segments), at_once)
        order = self._in_order(source, segments)
        begun = pool.ordered(begin, self._linked(order), at_once - 1)
        coded = pool.ordered(_finished, self._halfway(begun, decided.segment_count), 0)
        return (one for one, (_, is_wanted) in zip(coded, order) if is_wanted)

    def one(self, segment: int) -> CodedSegment:
        """Return one coded segment, which is joined to no other."""
        positions = self.decided.source.positions(segment)
        return _finished((segment, self._motion(segment, positions, self._exact(segment))))

    def _halfway(self, begun: Iterable[tuple[int, CodedMotion]], count: int) -> Iterator[tuple[int, CodedMotion]]:
        """Report each of `count` segments whose first layer is coded."""
        for done, one in enumerate(begun):
            self.report("motion", min((done + 0.5) / count, 1.0))
            yield one
            del one

    def _motion(
        self,
        index: int,
        positions: np.ndarray,
        exact: np.ndarray | None,
        before: Ends | None = None,
        after: Ends | None = None,
    ) -> CodedMotion:
        """Return a segment, which goes on from the ends of the one before it and leaves its own."""
        decided, source = self.decided, self.decided.source
        loops = source.is_whole_loop(index)
        frames = positions, exact, source.goes_on(index), source.shown_times(index), source.box, loops
        layers, trees = decided.layers.of_segment(loops), decided.predicted_trees
        release_memory()
        beside = None if trees is None else PredictedBeside(trees, positions)
        return CodedMotion(decided.prelude, layers, decided.segment_count, *frames, before, after, beside)

    @staticmethod
    def _in_order(source: Source, segments: Sequence[int]) -> list[tuple[int, bool]]:
        """Return pairs of a segment to code and whether it is wanted as a result, in the order in which to code them.
        Right before a segment that is joined to another one comes that other one; it is not wanted if it is coded for
        its ends alone.
        """
        order: list[tuple[int, bool]] = []
        for index in segments:
            before = source.segment_before(index)
            if before is not None and (not order or before != order[-1][0]):
                order.append((before, False))
            order.append((index, True))
        return order

    def _linked(
        self, order: Sequence[tuple[int, bool]]
    ) -> Iterator[tuple[int, list[np.ndarray], Ends | None, Ends | None]]:
        """Yield four things for each segment of `order`: its number; its block of positions in a list, which is empty
        if the search already holds them; the ends of the segment that it is joined to, or None; and the object that is
        to hold its own ends, or None if the next segment is not joined to it.
        """
        decided = self.decided
        goes_on = [is_wanted and decided.source.segment_before(index) is not None for index, is_wanted in order]
        ends: Ends | None = None
        for (index, _), follows in zip(order, [*goes_on[1:], False]):
            before, ends = ends, Ends(decided.layers.stage_count) if follows else None
            # The search holds the positions of an only segment.
            block = [decided.source.block(index)] if len(decided.source.segments) > 1 else []
            yield index, block, before, ends

    def _positions(self, block: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Return what is coded of a block, and its very numbers if these are to come back."""
        return self.decided.source.relative(block), self.decided.source.exact(block) if self.options.lossless else None

    def _exact(self, segment: int) -> np.ndarray | None:
        return self.decided.source.exact(self.decided.source.block(segment)) if self.options.lossless else None


def _finished(begun: tuple[int, CodedMotion]) -> CodedSegment:
    """Return a segment whose first layer is coded. Its memory is freed, whoever holds it."""
    index, motion = begun
    motion.finish()
    coded = CodedSegment(index, motion.chunks, *map(np.array, (motion.errors, motion.joins, motion.flaws)))
    vars(motion).clear()
    return coded
