"""A file is put together: prelude, static data, motion, and the front that says where each is."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from athcodec._native import MEASURES, SHEET
from athcodec.decoding import container as ct
from athcodec.encoding.assembly.decided import CodedSegment, Decided
from athcodec.encoding.assembly.filled import Clips, FilledFile, LoopSteps
from athcodec.encoding.assembly.segment_coding import SegmentCoder
from athcodec.encoding.assembly.summary import Summary
from athcodec.encoding.clip.coded_clip import CodedClip, host_rest, stored_polygons
from athcodec.encoding.options.features import Feature
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.options.weights import ErrorWeights
from athcodec.encoding.search.progress import Progress, silent
from athcodec.encoding.segments.layers import layer_chunks
from athcodec.encoding.segments.levels import chosen_levels
from athcodec.encoding.streams import polygons, streams, writing
from athcodec.errors import ClipError
from athcodec.motion.clip import ERROR_WEIGHTS
from athcodec.motion.hierarchy import derived_edges
from athcodec.motion.polygons import POLYGON_ARRAYS, Polygons, type_code
from athcodec.motion.thresholds import THRESHOLDS
from athcodec.motion.units import METRES_PER_UNIT, stated_scene
from athcodec.untyped import JsonObject

SPOOL_BYTES = 64 << 20  # Bytes of chunks that are held in memory and not in a temporary file.
STATIC_METADATA = ("unit", METRES_PER_UNIT, "up_axis")


def time_chunk(*times: np.ndarray) -> bytes:
    """Return TIME for times in seconds, (T,) for each clip, exactly: by rules if these give the very same numbers."""
    steady = writing.pack_steady_time(*times)
    return steady or writing.pack_time(streams.encode_times(np.concatenate(times).astype(np.float64)))


@dataclass(frozen=True)
class FileAssembly:
    """Puts a file together as it is decided."""

    decided: Decided
    options: EncodingOptions
    report: Progress = silent

    @property
    def clip(self) -> CodedClip:
        return self.decided.source.clip

    @property
    def _keeps_static(self) -> bool:
        return self.options.attributes == "all"

    def size(self) -> int:
        """Return the bytes of a file. Raises BoundError."""
        with tempfile.SpooledTemporaryFile(SPOOL_BYTES) as spool:
            coded = SegmentCoder(self.decided, self.options).coded(range(self.decided.segment_count))
            return replace(self, report=silent).filled(spool, coded).size

    def filled(self, spool: writing.Spool, coded: Iterable[CodedSegment]) -> FilledFile:
        """Return the whole file with the summary of what was decided, ready to be written. `spool`: holds the chunks
        until then; `coded`: the segments of the file, each once.
        """
        decided, layers, store = self.decided, self.decided.layers, writing.ChunkStore(spool)
        self._add_prelude(store)
        for (stage, kind), content in layer_chunks(layers).items():
            store.add(kind, content, stage)
        errors, joins, stages = self._add_motion(store, coded)
        self._add_static(store)
        clips = self._clips()
        if clips.ranges:
            store.add(ct.CLIPS, clips.packed([[0.0] * len(errors)] * len(clips.ranges)))
        header = ct.Header(
            self.clip.placed.source.vertex_count,
            self.clip.vertex_count,
            self.clip.hierarchy.branch_count,
            self.clip.frame_count,
            decided.segment_count,
            len(errors),
            len(errors),
            0.0 if self.options.lossless else decided.source.largest_bound(decided.choice.settings.bound),
            self.clip.dtype == np.float64,
            len(self.clip.motion.clip_range_frames),
            len(layers.each),
            decided.choice.predicted,
            stages=tuple(stages),
            joins=joins,
            repeats=decided.source.repeats,
        )
        mesh = host_rest(self.clip.placed.source) if self.options.host_rest else None
        return FilledFile(store, header, errors, clips, mesh, self._summary())

    def _clips(self) -> Clips:
        """Return what the chunk CLIPS states, and how loops of the source move where they begin again."""
        motion, decided = self.clip.motion, self.decided
        segment_counts = [len(segments) for segments in decided.source.clip_range_segments]
        loops = [
            self._loop_steps(start, stop) if clip_range.loop else None
            for clip_range, (start, stop) in zip(motion.clip_ranges, motion.clip_range_frames)
        ]
        return Clips(motion.clip_ranges, segment_counts, decided.choice.settings.periodic, loops)

    def _loop_steps(self, start: int, stop: int) -> LoopSteps:
        """Return how a loop, the frames from `start` to before `stop`, moves where it begins again."""
        beside = [self._step(start, min(start + 1, stop - 1)), self._step(max(stop - 2, start), stop - 1)]
        return LoopSteps(self._step(stop - 1, start), max(float(np.linalg.norm(one, axis=1).max()) for one in beside))

    def _step(self, frame: int, following: int) -> np.ndarray:
        """Return how far the vertices move from one frame of the source to another, (N, 3) float64."""
        source = self.clip.placed.source
        before, after = (source.block(frame, frame + 1)[0].astype(np.float64) for frame in (frame, following))
        return after - before

    def _add_prelude(self, store: writing.ChunkStore) -> None:
        """Add to `store` the chunks that decoding begins with: hierarchy, rest poses, times and places."""
        decided = self.decided
        store.add(ct.HIERARCHY, decided.prelude.hierarchy_stream)
        store.add(ct.REST, writing.pack_rest(decided.layers.rest))
        if decided.layers.source_rest:
            store.add(ct.SOURCE_REST, decided.layers.source_rest)
        store.add(
            ct.TIME,
            time_chunk(*(self.clip.motion.time[start:stop] for start, stop in self.clip.motion.clip_range_frames)),
        )
        source, places = self.clip.placed.source, self.clip.placed.places
        if places.are_shared:
            store.add(ct.PLACES, polygons.pack_places(places))
        metadata = self._stored(source.metadata, lambda weights: {ERROR_WEIGHTS: weights.name})
        kept = metadata.keys() - {THRESHOLDS, ct.PRIVATE_KINDS} if self._keeps_static else STATIC_METADATA
        metadata = {key: value for key, value in metadata.items() if key in kept}
        metadata |= stated_scene(metadata)
        if self.options.tam is not None:
            metadata[THRESHOLDS] = self.options.tam.in_metadata
        if metadata:
            store.add(ct.METADATA, writing.pack_metadata(metadata))
        faces = stored_polygons(source, self.options)
        if faces is not None:
            store.add(ct.FACES, polygons.pack(faces, places, Feature.SIDES not in self.options.without))
        if self._keeps_static and source.edges is not None:
            store.add(ct.EDGES, self._edges(source.edges))

    def _edges(self, edges: np.ndarray) -> bytes:
        places = self.clip.placed.places
        derived = places.first[derived_edges(self.clip.hierarchy)]
        if derived.shape == edges.shape and (derived == edges).all():
            return writing.pack_derived_edges(type_code(edges.dtype))
        return polygons.pack(Polygons.of_rows(edges), places)

    def _add_static(self, store: writing.ChunkStore) -> None:
        """Add to `store` the chunks of what does not move: attributes, faces, edges and metadata."""
        source = self.clip.placed.source
        attributes = self._stored(source.attributes, lambda weights: {weights.name: weights.array})
        if self._keeps_static and len(attributes) > ct.Limits.attributes:
            raise ClipError(f"attributes: got {len(attributes)}; expected at most {ct.Limits.attributes}")
        in_faces = POLYGON_ARRAYS if self.clip.polygons is not None and source.faces is None else ()
        if self._keeps_static:
            for name, array in attributes.items():
                if name in in_faces:
                    continue
                store.add(ct.ATTRIBUTE, writing.pack_array(name, array))

    def _stored(self, of_source: JsonObject, of_weights: Callable[[ErrorWeights], JsonObject]) -> JsonObject:
        """Return the attributes or the metadata that the file stores: those of the source, and those that weights
        add."""
        weights = self.clip.placed.weights
        return of_source if weights is None else of_source | of_weights(weights)

    def _add_motion(
        self, store: writing.ChunkStore, coded: Iterable[CodedSegment]
    ) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """Add the chunks of all segments to `store`, choose which stages become levels, and remove chunks that no level
        needs. Return three things about these levels: their errors by each of MEASURES, (levels, segments, 3); their
        joins, (levels, segments); and the numbers of their stages. Raises ValueError unless each segment comes once.
        """
        decided = self.decided
        stages, count = decided.layers.stage_count + self.options.lossless, decided.segment_count
        errors, joins = np.zeros((stages, count, len(MEASURES))), np.zeros((stages, count), np.uint8)
        flaws, missing = np.zeros((stages, count, 2)), set(range(count))
        for segment in coded:
            if segment.index not in missing:
                raise ValueError(f"segments: got {segment.index} twice or beyond the last, expected each once")
            missing.remove(segment.index)
            errors[:, segment.index] = self._errors(segment)
            joins[:, segment.index] = segment.joins
            flaws[:, segment.index] = segment.flaws
            for (stage, kind), payload in segment.chunks.items():
                store.add(kind, payload, stage, segment.index)
            self.report("motion", 1 - len(missing) / count)
        if missing:
            raise ValueError(f"segments: got {count - len(missing)}, expected all {count}")
        frames = [[stop - start for start, stop in clip] for clip in decided.source.clip_range_segments]
        shown = self._chosen_levels(errors, frames, flaws)
        serves = decided.layers.stage_0.serves
        store.leave_out(lambda chunk: chunk.stage is not None and not serves(chunk.kind, chunk.stage, shown))
        return errors[shown], joins[shown], shown

    def levels_of(self, coded: Sequence[CodedSegment]) -> list[int]:
        """Return which stages become levels, as far as some of the segments tell."""
        errors = np.stack([self._errors(one) for one in coded], axis=1)
        flaws = np.stack([one.flaws for one in coded], axis=1)
        frames = [self.decided.source.segments[one.index] for one in coded]
        return self._chosen_levels(errors, [[stop - start for start, stop in frames]], flaws)

    def _errors(self, segment: CodedSegment) -> np.ndarray:
        """Return the errors of a segment about the source, (stages, 3), and not about what is coded in its place."""
        return segment.errors + self.decided.source.replaced_error

    def _chosen_levels(self, errors: np.ndarray, frames: Sequence[Sequence[int]], flaws: np.ndarray) -> list[int]:
        """Return which stages become levels; frames: of each segment of each clip."""
        first_held, diagonal = self.decided.layers.stage_0.stage_count - 1, self.decided.source.seen.diagonal
        return chosen_levels(errors, frames, flaws, diagonal, self.options.lossless, first_held)

    def _summary(self) -> Summary:
        """Return the summary of the file, as far as it is known before the file is written, with the choices that the
        search made."""
        decided = self.decided
        settings, bound = decided.choice.settings, decided.choice.settings.bound
        beside = settings.predicted_trees is not None
        choices = {
            "motion": "predicted" if decided.choice.predicted else "both" if beside else "transformed",
            "step_ratio": settings.step / bound,
            "rest_step_ratio": settings.rest_step / bound,
            "still": settings.still,
            "rotations": list(settings.rotation_step_factors),
            "learned": list(settings.learned_bases),
            "common_basis": settings.common_basis,
            "sheets": int((settings.forms == SHEET).sum()),
            "tubes": int((settings.forms > SHEET).sum()),
            "periodic": settings.periodic,
            "learned_pieces": 0 if settings.learned_pieces is None else int(settings.learned_pieces.sum()),
        }
        diagonal, raw = decided.source.seen.diagonal, self.clip.frame_count * self.clip.placed.source.vertex_count * 12
        return Summary(
            path=None,
            bytes=0,
            raw_bytes=raw,
            max_error_bound=settings.largest_bound,
            relative_bound=bound / diagonal if diagonal > 0 else 0.0,
            table1={},
            levels=[],
            chunk_bytes={},
            choices=choices,
            found_branches=None if self.clip.branches is None else str(self.clip.branches),
            not_read=self.clip.placed.source.not_read,
            untried=decided.choice.untried,
        )
