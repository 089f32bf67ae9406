"""Levels of detail: bytes, errors and gaps at the joints, compared with the paper's approximation A^d.

Both sides use the same nodes. The paper's side (Song, Yang and Peng 2011, sections 3 and 4) is
athcodec.encoding.clip.survey: one independent least-squares affine map per piece and frame, as exact matrices, never
quantised. Ours is the decoder's output for the bytes of that level.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec._native import LOOSE
from athcodec.decoding.file_tables import Level
from athcodec.encoding.clip.survey import Ath, Gaps
from athcodec.metrics import ErrorMeter, MotionMeter, level_meters
from bench import data
from bench.clips import Encoded, add_clips, add_ladder, add_rel_error, encoded
from bench.tables import table

GAP_FRAMES = 9
ROUNDING = 1e-6  # the error table holds float32
STANDING = 1e-3  # largest motion of a foot that stands still, over the extent of its plant
LEVELLED_BYTES = 20_000  # Bytes above which a file should have levels.
FEWEST_LEVELS = 3  # Levels that it should have at least.
LARGEST_PREFIX = 0.25  # Share of its bytes that its first level should take at most.

LEVELS_NOTE = """
Bytes: the file cut after this level, with rest pose and hierarchy, without attributes. Errors over the
diagonal of the bounding box of all frames, measured on decoded positions. Ratio: our RMS over the paper's.
Above a level's nodes our stems are exact, the paper's are affine maps; the paper's maps are not quantised, so
where pieces are rigid they have no error at all and ours have that of the bound. The last level is the
original within the bound; the paper gets there by its residuals. Of the one before: the larger ratio of the
stored largest and RMS errors to those of the level before. Second difference: the largest RMS over vertices, over
the source's within two frames, or half the bound.
"""

FILES_NOTE = """
Bytes of the file without attributes; share of it that the first level takes, with rest pose and hierarchy. Of the one
before: the largest ratio of the largest and RMS errors of a level to those of the level before, of any clip of the
file. Foot: the largest distance, at any level, of the first vertex of a root that stands still in the source from where
it is there, over the extent of its plant.
"""

GAPS_NOTE = """
Over the diagonal. Joints: attach points between two different pieces of the level. Ours: the distance between
the place where the child's matrix puts its attach point's rest position and the place where the parent's
decoded stem has that vertex (float32 output and rest pose: their rounding is included). An exact stem hangs
on its parent's decoded stem by construction and counts as 0 (so do all joints of the last level, left out
here); 'measured' are the other joints. The paper's: the distance between the places where the child's and the
parent's maps put the attach vertex. The RMS goes over all joints and frames on both sides. 'Loose' joints are
measured ones whose child the encoder lets come off, because it does so in the source.
"""


def measured_levels(decoder: athcodec.Decoder, clip: athcodec.MotionClip) -> list[MotionMeter]:
    """Return a meter for each level, with all frames."""
    meters = level_meters(decoder, clip)
    for start, stop in decoder.segments:
        source = clip.block(start, stop)
        for number, meter in enumerate(meters):
            meter.add(source, decoder.positions(slice(start, stop), number))
    return meters


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_clips(parser)
    add_rel_error(parser)
    add_ladder(parser, "decades")
    parser.add_argument("--all", action="store_true", help="all clips of all suites, made if they are missing")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Encode the chosen clips and measure every level: bytes, errors beside the paper's method, and gaps where branches
    join. Return the tables, and lines about levels that break a promise.
    """
    levels, gaps, files, broken = [], [], [], []
    names = dict.fromkeys(name for suite in data.SUITES.values() for name in suite)
    for path in map(data.path_of, names) if args.all else args.clips:
        with encoded(path, args.rel_error, ladder=args.ladder) as result:
            file = result.decoder.file
            ath = None if file.tables.header.is_predicted else _same_nodes(result)  # The paper has no such motion.
            meters = measured_levels(result.decoder, result.clip)
            files.append(_file_row(path.stem, result))
            broken += _broken_file_lines(files[-1], file.tables.header.is_predicted)
            for stored in result.decoder.levels:
                case = {"clip": path.stem, "level": stored.level}
                depth = file.tables.header.stages[stored.level]
                meter, error = meters[stored.level], meters[stored.level].error
                has_nodes = ath is not None and depth <= ath.height
                paper = _measure_paper(result.clip, ath, depth) if has_nodes else None
                row = case | _level_row(stored, error, paper) | _better(file.levels, stored.level, meter)
                levels.append(row)
                broken += _broken_lines(path, stored, error, result.decoder)
                broken += _worse_lines(path, row, file.tables.header.is_predicted)
                if has_nodes:
                    gaps.append(case | _gap_row(result, ath, stored.level, error.diagonal))
    return {
        "tables": [
            table(f"Levels, bound {args.rel_error:g}", levels, LEVELS_NOTE),
            table("Files", files, FILES_NOTE),
            table(f"Gaps at the attach points, {GAP_FRAMES} frames", gaps, GAPS_NOTE),
        ],
        "broken": broken,
    }


def _same_nodes(result: Encoded) -> Ath:
    """Return the hierarchy of the paper for the thresholds of the file. Raises RuntimeError if the file states other
    nodes."""
    hierarchy = result.decoder.file.hierarchy
    ath = athcodec.build_ath(result.clip, max_error=result.summary.max_error_bound, hierarchy=hierarchy)
    stored, computed = result.decoder.file.table1(), ath.table1()
    if any(stored[key] != computed[key] for key in ("depth", "nodes", "leaves")):
        raise RuntimeError(f"nodes of the ATH: got {stored} in the file, {computed} from the clip")
    return ath


def _measure_paper(clip: athcodec.MotionClip, ath: Ath, depth: int) -> ErrorMeter:
    meter = ErrorMeter()
    for _, frames in clip.blocks():
        meter.add(frames, ath.approximation(frames, depth))
    return meter


def _level_row(stored: Level, error: ErrorMeter, paper: ErrorMeter | None) -> dict[str, float | int | None]:
    """Return the row of one level: its nodes and bytes, its largest and RMS error over the diagonal, the errors of the
    paper's method with the same nodes, and the RMS error over the paper's. `paper` is None where the paper has no such
    level.
    """
    diagonal = error.diagonal
    return {
        "nodes": stored.nodes,
        "bytes": stored.bytes,
        "max": error.max_error / diagonal,
        "RMS": error.rms_error / diagonal,
        "paper max": paper and paper.max_error / diagonal,
        "paper RMS": paper and paper.rms_error / diagonal,
        "ratio": error.rms_error / paper.rms_error if paper and paper.rms_error else None,
    }


def _better(levels: list[Level], level: int, meter: MotionMeter) -> dict[str, float | None]:
    """Return two ratios for a level: its larger error (largest or RMS) over that of the level before, None at level 0,
    and its second differences in time over those of the source.
    """
    before, this = levels[max(level - 1, 0)], levels[level]
    pairs = (this.max_error, before.max_error), (this.rms_error, before.rms_error)
    worse = max(ratio / other if other else float(ratio > 0) for ratio, other in pairs)
    return {
        "of the one before": worse if level else None,
        "second difference": meter.figures()["smoothness"]["acceleration_ratio"],
    }


def _worse_lines(path: Path, row: dict[str, Any], may_jerk: bool) -> list[str]:
    """Return a line if a level is worse than the one before it, or jerks."""
    limits = {"of the one before": 1.0} | ({} if may_jerk else {"second difference": 2.0})
    return [
        f"{path.name}, level {row['level']}: got {row[name]:.3f} {name}; expected at most {limit:g}"
        for name, limit in limits.items()
        if (row[name] or 0.0) > limit
    ]


def _broken_lines(path: Path, stored: Level, error: ErrorMeter, decoder: athcodec.Decoder) -> list[str]:
    """Return a line if the decoded error exceeds the level's error in the file or, at the last level, the bound."""
    is_last = stored.level == decoder.file.level_count - 1
    allowed = decoder.file.max_error_bound if is_last else stored.max_error * (1 + ROUNDING)
    if error.max_error <= allowed:
        return []
    return [f"{path.name}, level {stored.level}: got an error of {error.max_error:.9g}; expected at most {allowed:.9g}"]


# ---- files ----


def _file_row(name: str, result: Encoded) -> dict[str, Any]:
    """Return a row about one file: its numbers of clips and levels, its bytes, the share of them in its first level,
    the largest ratio of a level's error to that of the level before, and how far feet that stand still move.
    """
    decoder, last = result.decoder, result.decoder.levels[-1].bytes
    parts = [decoder.play(clip.name) for clip in decoder.file.clips]
    return {
        "clip": name,
        "clips": len(parts),
        "levels": decoder.file.level_count,
        "bytes": last,
        "first": decoder.levels[0].bytes / last,
        "of the one before": max(map(_worst_ratio, parts)),
        "foot": _foot_drift(result),
    }


def _worst_ratio(part: athcodec.Decoder) -> float:
    """Return the largest ratio of the errors of a level to those of the level before."""
    pairs = [
        (getattr(after, name), getattr(before, name))
        for before, after in pairwise(part.levels)
        for name in ("max_error", "rms_error")
    ]
    return max((after / before if before else float(after > 0) for after, before in pairs), default=0.0)


def _foot_drift(result: Encoded) -> float | None:
    """Return the largest distance that any level moves a root's first vertex which stands still in the source, over the
    extent of its plant. Return None if no such vertex stands still.
    """
    hierarchy, clip, decoder = result.decoder.file.hierarchy, result.clip, result.decoder
    roots = np.flatnonzero(hierarchy.branch_parent < 0)
    starts = hierarchy.first_vertex[roots]
    feet, rest = hierarchy.vertex_source[starts], clip.rest[hierarchy.vertex_source]
    low, high = (corner.reduceat(rest, starts, axis=0) for corner in (np.minimum, np.maximum))
    extent = np.maximum(np.linalg.norm(high - low, axis=1), np.finfo(np.float64).tiny)
    source = np.concatenate([frames[:, feet] for _, frames in clip.blocks()]).astype(np.float64)
    still = np.linalg.norm(source - source[0], axis=2).max(axis=0) <= STANDING * extent
    if not still.any():
        return None
    drift = 0.0
    for level in range(decoder.file.level_count):
        for start, shown in decoder.blocks(level):
            away = np.linalg.norm(shown[:, feet] - source[start : start + len(shown)], axis=2) / extent
            drift = max(drift, float(away[:, still].max()))
    return drift


def _broken_file_lines(row: dict[str, Any], is_predicted: bool) -> list[str]:
    """Return a line for each promise about a whole file that a row of `_file_row` does not keep."""
    lines = []
    if row["of the one before"] > 1:
        lines.append(f"{row['of the one before']:.3f} of the level before in a clip; expected at most 1")
    if row["bytes"] > LEVELLED_BYTES and not is_predicted:
        if row["levels"] < FEWEST_LEVELS:
            lines.append(f"{row['levels']} levels; expected at least {FEWEST_LEVELS}")
        if row["first"] > LARGEST_PREFIX:
            lines.append(f"{row['first']:.0%} of the file in its first level; expected at most {LARGEST_PREFIX:.0%}")
    return [f"{row['clip']}: got {line}" for line in lines]


# ---- gaps ----


def _gap_row(result: Encoded, ath: Ath, level: int, diagonal: float) -> dict[str, Any]:
    """Return how far branches are from the points that they hang on, at a level of the file and in the paper's method:
    numbers of joints, and the largest and RMS gaps over `diagonal`.
    """
    clip = result.clip
    frames = np.unique(np.linspace(0, clip.frame_count - 1, GAP_FRAMES).astype(int)).tolist()
    source = np.concatenate([clip.block(frame, frame + 1) for frame in frames])
    paper = ath.attachment_gaps(source, result.decoder.file.tables.header.stages[level])
    joints = _Joints(result.decoder, level)
    gaps = joints.gaps(frames)
    return {
        "joints": len(joints.branch),
        "measured": len(joints.measured),
        "loose": joints.loose,
        "max": gaps.max / diagonal,
        "RMS": gaps.rms / diagonal,
        "paper max": paper.max / diagonal,
        "paper RMS": paper.rms / diagonal,
    }


class _Joints:
    """The attach points between two pieces of a level, by the branch attached there, in file order."""

    def __init__(self, decoder: athcodec.Decoder, level: int) -> None:
        """Find the joints of a level: branches whose part moves apart from the part of the vertex that they hang on.
        Raise RuntimeError if a joint that is to be measured hangs on a part without exact stems.
        """
        self.decoder, self.level = decoder, level
        hierarchy, parts = decoder.file.hierarchy, decoder.affines(0, level)
        part_of_branch = np.searchsorted(parts.first_vertex, hierarchy.first_vertex, side="right") - 1
        part_of_attach = np.searchsorted(parts.first_vertex, hierarchy.attach, side="right") - 1
        is_joint = (hierarchy.attach >= 0) & (part_of_branch != part_of_attach)
        self.branch = np.flatnonzero(is_joint)
        self.measured = np.flatnonzero(is_joint & ~parts.is_stem[part_of_branch])
        self._part = part_of_branch[self.measured]
        self._attach = hierarchy.vertex_source[hierarchy.attach[self.measured]]
        if not parts.is_stem[part_of_attach[self.measured]].all():
            raise RuntimeError(f"level {level}: got a node on a node; expected exact stems above nodes")

    @property
    def loose(self) -> int:
        """Number of measured joints with a translation of their own."""
        return int((self.decoder.file.tables.branches["flags"][self.measured] & LOOSE > 0).sum())

    def gaps(self, frames: list[int]) -> Gaps:
        """Return largest and RMS gap over these frames and all joints."""
        if not len(self.measured):
            return Gaps(0.0, 0.0)
        squares = np.array([self._squares(frame) for frame in frames])
        return Gaps(float(np.sqrt(squares.max())), float(np.sqrt(squares.sum() / (len(frames) * len(self.branch)))))

    def _squares(self, frame: int) -> np.ndarray:
        matrices = self.decoder.affines(frame, self.level).matrices[self._part]
        rest = self.decoder.level_rest(self.level)[self._attach].astype(np.float64)
        by_child = (matrices[:, :, :3] @ rest[:, :, None])[..., 0] + matrices[:, :, 3]
        by_parent = self.decoder.positions(frame, self.level, np.float64)[self._attach]
        return ((by_child - by_parent) ** 2).sum(axis=1)
