"""A file is put together: prelude, static data, motion, and the front that says where each is."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import BinaryIO

import numpy as np

from athcodec._native import MEASURES, SHEET
from athcodec.decoding import container as ct
from athcodec.decoding.ath_file import AthFile
from athcodec.decoding.decoder import Decoder
from athcodec.encoding.assembly.decided import CodedSegment, Decided
from athcodec.encoding.assembly.segment_coding import SegmentCoder
from athcodec.encoding.assembly.summary import Seam, Summary
from athcodec.encoding.clip.coded_clip import CodedClip, host_rest, stored_polygons
from athcodec.encoding.options.features import Feature
from athcodec.encoding.options.file_options import EncodingOptions
from athcodec.encoding.options.weights import ErrorWeights
from athcodec.encoding.search.progress import Progress, silent
from athcodec.encoding.segments.layers import layer_chunks
from athcodec.encoding.segments.levels import chosen_levels
from athcodec.encoding.streams import polygons, streams, writing
from athcodec.errors import ClipError, FormatError
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


@dataclass
class _Result:
    store: writing.ChunkStore
    header: ct.Header
    errors: np.ndarray


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
            result = replace(self, report=silent)._fill(writing.ChunkStore(spool), coded)
            return result.store.size(result.header, result.errors)

    def write(
        self, path: str | PathLike[str] | None, out: BinaryIO, spool: writing.Spool, coded: Iterable[CodedSegment]
    ) -> Summary:
        """Write the whole file to the stream `out`, decode every level once as a check, and return its summary. `path`:
        the name that the file is to have afterwards, for the summary; `spool`: holds the chunks until they are written;
        `coded`: the segments of the file, each once.
        """
        result = self._fill(writing.ChunkStore(spool), coded)
        chunks = result.store.write(out, result.header, result.errors)
        mesh = host_rest(self.clip.placed.source) if self.options.host_rest else None
        if any(clip_range.loop for clip_range in self.clip.motion.clip_ranges):
            with AthFile(out, strict=True, host_mesh=mesh) as file, Decoder(file) as decoder:
                result.store.replace(ct.CLIPS, self._clips(self._seam_errors(decoder)))
            out.seek(0)
            chunks = result.store.write(out, result.header, result.errors)
        with AthFile(out, strict=True, host_mesh=mesh) as file, Decoder(file) as decoder:
            try:  # The file gets its name after this check.
                file.check()
            except FormatError as error:
                raise AssertionError(
                    f"the encoder made a file that cannot be decoded, and did not keep it: {error}"
                ) from error
            summary = self._summary(Path(path) if path else None, result, chunks, decoder)
        self.report("done", 1.0)
        return summary

    def _fill(self, store: writing.ChunkStore, coded: Iterable[CodedSegment]) -> _Result:
        """Add all chunks of a file to `store`, and return what is known of the file then. `coded`: the segments of the
        file, each once.
        """
        decided, layers = self.decided, self.decided.layers
        self._add_prelude(store)
        for (stage, kind), content in layer_chunks(layers).items():
            store.add(kind, content, stage)
        errors, joins, stages = self._add_motion(store, coded)
        self._add_static(store)
        if self.clip.motion.clip_ranges:
            store.add(ct.CLIPS, self._clips([[0.0] * len(errors)] * len(self.clip.motion.clip_ranges)))
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
        return _Result(store, header, errors)

    def _clips(self, seam_errors: Sequence[Sequence[float] | None]) -> bytes:
        """Return the chunk CLIPS. seam_errors: for each loop the error at its seam at each level."""
        decided = self.decided
        segment_counts = [len(segments) for segments in decided.source.clip_range_segments]
        return writing.pack_clips(
            self.clip.motion.clip_ranges, segment_counts, seam_errors, decided.choice.settings.periodic
        )

    def _seam_errors(self, decoder: Decoder) -> list[list[float] | None]:
        """Return for each loop how far off its step from the last frame to the first is, per level."""
        return [
            self._seam_errors_of(decoder.play(clip.name), self._step(stop - 1, start)) if clip.loop else None
            for clip, (start, stop) in zip(decoder.file.clips, self.clip.motion.clip_range_frames)
        ]

    @staticmethod
    def _seam_errors_of(loop: Decoder, step: np.ndarray) -> list[float]:
        errors = []
        for level in range(loop.file.level_count):
            last, first = (loop.positions(frame, level, np.float64) for frame in (-1, 0))
            errors.append(np.linalg.norm(first - last - step, axis=1).max())
        return errors

    def _step(self, frame: int, following: int) -> np.ndarray:
        """Return how far the vertices move from one frame of the source to another, (N, 3) float64."""
        source = self.clip.placed.source
        before, after = (source.block(frame, frame + 1)[0].astype(np.float64) for frame in (frame, following))
        return after - before

    def _seams(self, decoder: Decoder) -> tuple[Seam, ...]:
        """Return for each clip of the file that loops its seam: how far the source moves from the last frame to the
        first one, how far at most from frame to frame beside the seam, and the error at the seam of the finest level.
        `decoder`: the file just written.
        """
        seams = []
        for clip, (start, stop) in zip(decoder.file.clips, self.clip.motion.clip_range_frames):
            if clip.loop:
                beside = [(start, min(start + 1, stop - 1)), (max(stop - 2, start), stop - 1)]
                step, *steps = (
                    np.linalg.norm(self._step(*frames), axis=1).max() for frames in [(stop - 1, start), *beside]
                )
                seams.append(Seam(clip.name, float(step), float(max(steps)), clip.seam_errors[-1]))
        return tuple(seams)

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

    def _summary(self, path: Path | None, result: _Result, chunks: list[ct.Chunk], decoder: Decoder) -> Summary:
        """Return the summary of a file that has been written, with the bytes of each kind of chunk and the choices that
        the search made. `path`: the file's name, or None; `result`: what `_fill` returned; `chunks`: those of the file;
        `decoder`: the file itself.
        """
        decided = self.decided
        sizes: dict[str, int] = {}
        for chunk in chunks:
            name = ct.KIND_NAMES[chunk.kind]
            sizes[name] = sizes.get(name, 0) + chunk.length
        sizes["HEADER"] = result.header.file_length - sum(sizes.values())
        settings, bound = decided.choice.settings, decided.choice.settings.bound
        choices = {
            "motion": "predicted" if decided.choice.predicted else "transformed",
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
            path,
            result.header.file_length,
            raw,
            settings.largest_bound,
            bound / diagonal if diagonal > 0 else 0.0,
            decoder.file.table1(),
            decoder.file.levels,
            sizes,
            choices,
            self._seams(decoder),
            None if self.clip.branches is None else str(self.clip.branches),
            self.clip.placed.source.not_read,
            decided.choice.untried,
        )
