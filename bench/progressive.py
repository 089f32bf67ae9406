"""The error of growing prefixes of one .ath file, and the cost in bytes of levels that can be truncated.

The curve: after every level and segment of one file, the bytes so far and the error of the decoded positions; segments
whose next level is complete use it. Errors are measured on what athcodec decodes from exactly that many bytes, beside
those that the file's table states. They are compared with separate files, each coded for a looser bound.

The cost: the same clip coded without intermediate levels by the encoder's own stages: the same settings, every stem's
modes in one stream per segment, no maps of nodes, a table of one level.
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import athcodec
from athcodec.decoding import container as ct
from athcodec.encoding import Draft, code_segments, draft, write
from athcodec.encoding.job import EncodingJob
from athcodec.encoding.progress import silent
from athcodec.encoding.search import Search, samples_of
from athcodec.encoding.segment import Coded, CodedPrelude, Settings, code_stems
from athcodec.encoding.streams import encode_learned_modes
from athcodec.metrics import ErrorMeter
from bench.clips import Encoded, encoded, measure

TABLE_ENTRY, ERROR_ENTRY = 6, 2.5  # bytes of the front, about: of a chunk, and of the errors of a level in a segment
ROUNDING = 1e-6  # the error table holds float32
STREAMS = ("SHAPES", "STEMS", "CORRECTIONS")

CURVE_NOTE = """
Bytes: length of the prefix; segments: number at this level, the others are at the one before. Max and RMS over
the diagonal, decoded from the prefix; 'table': as stated in the file. Single file: bytes of a separate file with
the same largest error, interpolated (log-log) between files coded for looser bounds; prefix/single: the cost of one
file for all distances.
"""

COST_NOTE = """
Bytes of whole files. AFFINES: maps of nodes, which only truncated files need. Early split: a leaf of the ATH
that is one short stem has its first modes in the stream of its node's level and the rest one level deeper; this
is the saving of coding each stem's modes together, with levels otherwise unchanged. One stream: the saving of coding
all levels, unsplit, in one stream per segment. All three with the file's steps and the best of its rotation factors
and time bases for all levels (split and unsplit: or those of the file), including corrections; below 0: no saving.
Table: entries for chunks and errors of the levels before the last. Without: the file less AFFINES, table and the
larger of the two savings; cost: the excess of the file over that.
"""


# ---- the curve ----


def curve(clip_path: Path, rel_error: float, looser: Iterable[float]) -> dict[str, Any]:
    """{"steps": rows by growing prefix, "single": separate files at looser bounds, "broken": lines}."""
    with encoded(clip_path, rel_error) as result:
        steps = _steps(result, diagonal(result))
    single = single_files(clip_path, (*(bound for bound in looser if bound > rel_error), rel_error))
    broken = [
        f"{clip_path.name}, {row['bytes']} bytes: got an error of {row['max']:.7g} of the diagonal; "
        f"the file's table says {row['table max']:.7g}"
        for row in steps
        if row["max"] > row["table max"] * (1 + ROUNDING)
    ]
    return {"steps": steps, "single": single, "broken": broken}


def single_files(clip_path: Path, bounds: Iterable[float]) -> list[dict[str, float]]:
    """A row for a file of its own at each bound, with the errors of what it decodes to over the diagonal."""
    rows = []
    for bound in bounds:
        with encoded(clip_path, bound) as result:
            meter, scale = measure(result.clip, result.decoder), diagonal(result)
            rows.append(
                {
                    "bound": bound,
                    "bytes": result.summary.bytes,
                    "max": meter.max_error / scale,
                    "rms": meter.rms_error / scale,
                }
            )
    return rows


def diagonal(result: Encoded) -> float:
    return result.summary.max_error_bound / result.summary.relative_bound


def _steps(result: Encoded, diagonal: float) -> list[dict[str, Any]]:
    decoder, clip = result.decoder, result.clip
    whole = result.summary.path.read_bytes()
    decoded: dict[int, ErrorMeter] = {}  # by segment, at its deepest complete level
    level_of: dict[int, int] = {}
    rows = []
    for level, segment, end in _boundaries(decoder):
        with athcodec.open(io.BytesIO(whole[:end])) as cut:
            decoded[segment] = measure(clip, cut, level, slice(*decoder.segments[segment]))
        level_of[segment] = level
        if len(level_of) == len(decoder.segments):
            done = sum(shown == level for shown in level_of.values())
            rows.append(
                {"bytes": end, "level": level, "segments": done}
                | _together(decoded, decoder, diagonal)
                | _from_table(level_of, decoder, diagonal)
            )
    return rows


def _boundaries(decoder: athcodec.Decoder) -> list[tuple[int, int, int]]:
    """(level, segment, bytes of the file until both are complete), in file order."""
    ends: dict[tuple[int, int], int] = {}
    for chunk in decoder.file.chunks:
        if chunk.is_motion:
            ends[chunk.level, chunk.segment] = chunk.offset + chunk.length
    before, found = decoder.file.prelude_length, []
    for level in range(decoder.file.level_count):
        for segment in range(len(decoder.segments)):
            before = ends.get((level, segment), before)
            found.append((level, segment, before))
    return found


def _together(decoded: dict[int, ErrorMeter], decoder: athcodec.Decoder, diagonal: float) -> dict[str, float]:
    parts = [
        (decoded[segment].max_error, decoded[segment].rms_error, stop - start)
        for segment, (start, stop) in enumerate(decoder.segments)
    ]
    return dict(zip(("max", "rms"), _pooled(parts, diagonal), strict=True))


def _from_table(level_of: dict[int, int], decoder: athcodec.Decoder, diagonal: float) -> dict[str, float]:
    errors = decoder.file.errors
    parts = [
        (*map(float, errors[level_of[segment], segment, [0, 2]]), stop - start)
        for segment, (start, stop) in enumerate(decoder.segments)
    ]
    return dict(zip(("table max", "table rms"), _pooled(parts, diagonal), strict=True))


def _pooled(parts: Iterable[tuple[float, float, int]], diagonal: float) -> tuple[float, float]:
    """Largest and RMS error over the diagonal from those of segments with so many frames."""
    parts = list(parts)
    squares = sum(rms**2 * frames for _, rms, frames in parts)
    return (
        max(largest for largest, _, _ in parts) / diagonal,
        sqrt(squares / sum(frames for _, _, frames in parts)) / diagonal,
    )


# ---- the cost ----


def cost(clip_path: Path, rel_error: float) -> dict[str, Any] | None:
    """One row: bytes of a file, bytes of each part that serves its levels, and bytes without them. None for a file
    whose levels have no streams, such as one of predicted motion."""
    with tempfile.TemporaryDirectory() as folder, athcodec.read_hdf5(clip_path) as clip:
        plan = draft(clip, rel_error=rel_error, attributes="none", rest_error="bound", ladder=())
        coded = code_segments(clip, plan, range(plan.segment_count))
        summary = write(clip, plan, coded, Path(folder) / "clip.ath")
        if not any(summary.chunk_bytes.get(kind) for kind in STREAMS):
            return None
        with athcodec.open(summary.path, strict=True) as decoder:
            return _cost(_Recoding(clip, plan), decoder, summary)


def _cost(recoding: _Recoding, decoder: athcodec.Decoder, summary: athcodec.Summary) -> dict[str, Any]:
    uniform, levels = recoding.of_one_level(), decoder.file.level_count
    split = min(recoding.streams(settings) for settings in (recoding.settings, *uniform))
    unsplit = min(recoding.streams(settings, split=False) for settings in (recoding.settings, *uniform))
    merged = min(recoding.streams(settings, split=False, one_level=True) for settings in uniform)
    table = TABLE_ENTRY * sum(1 for chunk in decoder.file.chunks if _serves_levels(chunk, levels - 1)) + ERROR_ENTRY * (
        levels - 1
    ) * len(decoder.segments)
    affines = summary.chunk_bytes.get("AFFINES", 0)
    without = summary.bytes - affines - table - (split - min(split, unsplit, merged))
    return {
        "bytes": summary.bytes,
        "levels": levels,
        "AFFINES": affines,
        "table": table,
        "early split": split - unsplit,
        "one stream": split - merged,
        "without": without,
        "cost %": 100 * (summary.bytes / without - 1),
    }


def _serves_levels(chunk: ct.Chunk, last: int) -> bool:
    """Whether a file of one level would not have the chunk."""
    return chunk.kind == ct.AFFINES or (chunk.kind in (ct.STEMS, ct.SHAPES) and chunk.level < last)


def _bytes_of(coded: Coded) -> int:
    """Of the streams of a segment, and of its corrections: of all vertices, where those of some were sought."""
    return sum(map(len, coded.stems.values())) + round(len(coded.corrections.chunk) / coded.sample_share)


class _Recoding:
    """The motion of a file coded by the encoder's own stages, at the file's settings and at others. Its sizes are
    compared with each other alone, because they are not those of the file: trials correct a sample of the vertices."""

    def __init__(self, clip: athcodec.MotionClip, plan: Draft) -> None:
        decided = EncodingJob.resume(clip, plan).decided(plan)
        self.settings, self._source, self._ath = plan.choice.settings, decided.source, decided.ath
        self._search = Search(
            self._source, self._ath, self.settings, samples_of(self._source), plan.options.effort, silent
        )
        self._positions = [self._source.positions(i) for i in range(plan.segment_count)]

    def of_one_level(self) -> list[Settings]:
        """Settings for a single stream: those of each level in turn, applied to all levels."""
        levels = len(self.settings.rotation_step_factors)
        pairs = sorted(set(zip(self.settings.rotation_step_factors, self.settings.learned_bases, strict=True)))
        return [
            replace(self.settings, rotation_step_factors=(factors,) * levels, learned_bases=(learned,) * levels)
            for factors, learned in pairs
        ]

    def streams(self, settings: Settings, split: bool = True, one_level: bool = False) -> int:
        """Bytes of all learned_modes, stems and corrections."""
        prelude = CodedPrelude(self._source, self._ath, settings)
        pieces = prelude.plan.pieces  # the memory that the core reads
        if not split:
            pieces["low_level"], pieces["low_modes"] = -1, 0
        if one_level:
            pieces["level"] = prelude.plan.level_count - 1
        learned_modes = self._search.learned_modes(prelude.plan, settings)
        of_shapes = sum(map(len, encode_learned_modes(prelude.plan, learned_modes).values()))
        coded = (code_stems(prelude, settings, positions, learned_modes) for positions in self._positions)
        return of_shapes + sum(map(_bytes_of, coded))
