"""The cost of a forest: bytes a second and milliseconds a picture, predicted by a formula and measured by playing it.

The forest. A camera looks into a wedge of 90 degrees, about what a vertical field of view of 60 degrees shows on a
screen of 16:9. Plants stand evenly in it, one in each square as wide as the plant; the nearest is as far away as that.
Each shows the level that `ath_level_for` gives for its distance: an error of at most 1 pixel on 1,080 lines; or a
deeper one that its clip shows nearby anyway, where prepared segments of both take about the same memory: levels with
many matrices are as dear to show as exact ones, and nothing is prepared twice. Plant i, by distance, plays clip i
modulo the clips. The same forest is played from files with one layer of precision and with several (`--ladder`).

The player works like an engine's. Clips loop and are streamed: of each clip and level in use the segment that plays is
prepared, the one before, and, a few steps a picture, the next one; nothing else is kept, so that memory does not depend
on the length of a clip (clips of up to three segments stay in memory). Plants of a clip are delayed by one of P phases,
spread over a segment's length. Plants of the same clip, level and phase share a pose (node matrices and exact vertices,
which a graphics processor needs), evaluated once a picture, clip by clip; a plant itself costs only the choice of its
level.

The prediction, from the cost of one preparation, one pose and one choice of level:

    bytes a second = sum over clips of bytes / seconds of the clip, where bytes are those of
                         stems up to the deepest level in use, maps of the levels in use, corrections of the last
    ms a picture   = instances * choice
                   + sum over clips and levels in use of
                         phases in use * pose + preparing all segments / (seconds of the clip * pictures a second)

Bytes are those of streaming; a player that keeps the files in memory reads each once. Prelude and learned shapes are
read once, at the start. The prediction leaves out maps of coarser levels, which finer levels need where a subtree moves
as one.

The measured forest is played by forest.c, one thread, files in memory, for the length of a clip; milliseconds are
processor time, bytes are those fed to its decoders. Of a file it notes once what is asked for in
every picture: the distance from which a level will do, its numbers of matrices and of exact vertices. Its clips are
variants of one clip: turned, mirrored, with a larger or smaller sway and another start; they play forwards and
backwards, slowing down before they turn, so that they loop.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil, pi, radians
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import athcodec
from athcodec.decoding import container as ct
from athcodec.options import DEFAULT_SEGMENT, LADDERS
from bench.clips import add_effort, add_rel_error, add_source
from bench.decode import compile_program
from bench.tables import table

INSTANCES, CLIPS, PHASES = (1, 100, 10_000), (1, 10, 100), (16, 0)
FRAMES, RATE, ROUNDS = 480, 60, 3
FOV, SCREEN, WEDGE = radians(60), 1080, radians(90)
GOLDEN = 0.6180339887498949
SLOTS = 3  # segments that forest.c keeps prepared for a clip and level
ALIKE = 1.25  # it shows a deeper level in use in place of one whose segments are at most so much smaller

NOTE = """
Each clip: {frames} frames of {vertices:,} vertices, {seconds:g} s in {segments} segments, made of {source}, bound
{bound:g}; {rate} pictures a second, one thread, processor time, means over {seconds:g} s; medians of {rounds} rounds.
Phases: of the instances of a clip, "own": one each. Levels: instances at level 0, 1, ... Poses: evaluated for each
picture. Predicted: by the formula, from unit costs (below); others: measured. p99: of the
pictures, the 99th percentile. MB: files opened, bases, prepared segments, one work memory; not the compressed bytes,
nor the poses.
"""
FORMULA = """
kB/s = sum over clips of (stems up to the deepest level in use, maps of the levels in use, corrections of the last) /
seconds of the clip. ms a picture = instances * choice + sum over clips and levels in use of (phases in use * pose +
preparing all segments / (seconds of the clip * pictures a second)). The wedge has {wedge:.0f} degrees with a plant on
each {side:.3g} x {side:.3g} of ground; level: ath_level_for, 1 pixel, field of view 60 degrees, 1,080 lines.
Explained in bench/forest.py.
"""
PARTS_NOTE = """
Predicted and measured ms a picture: choosing levels, preparing segments, evaluating poses. Late: preparations that had
to be finished immediately. Start: everything prepared before the first picture.
"""
UNITS_NOTE = """
Means over clips. Prepare: all segments of a clip; pose: one between two frames, of the clips in turn: data of many
clips come from memory, of few from the processor's caches; bytes: of motion, to play this level.
"""


@dataclass(frozen=True)
class Unit:
    """A clip of the forest: its file, and the unit costs of playing it."""

    path: Path
    choice_us: float
    prepare_ms: list[float]  # all segments, by level
    segment_bytes: list[float]  # one, prepared, by level
    pose_us: list[float]  # one, by level

    @cached_property
    def facts(self) -> dict[str, Any]:
        with athcodec.open(self.path) as decoder:
            chunks = [chunk for chunk in decoder.file.chunks if chunk.is_motion]
            return {
                "seconds": decoder.frame_count / decoder.fps,
                "segments": len(decoder.segments),
                "vertices": decoder.file.vertex_count,
                "prelude": decoder.file.prelude_length,
                "chunks": [(chunk.kind, chunk.level, chunk.length) for chunk in chunks],
            }

    def shown(self, wanted: np.ndarray) -> np.ndarray:
        """The levels that plants of this clip show, for those that would do."""
        merged: dict[int, int] = {}
        for level in sorted(set(wanted.tolist()), reverse=True):
            alike = [other for other, own in merged.items() if own == other and self._alike(level, other)]
            merged[level] = max(alike, default=level)
        return np.array([merged[level] for level in wanted.tolist()], int)

    def _alike(self, level: int, deeper: int) -> bool:
        return self.segment_bytes[deeper] <= ALIKE * self.segment_bytes[level]

    @property
    def seconds(self) -> float:
        return self.facts["seconds"]

    @property
    def stays(self) -> bool:
        """Whether all segments stay prepared."""
        return self.facts["segments"] <= SLOTS

    def bytes(self, levels: set[int]) -> int:
        """Bytes of motion that a player of these levels reads per loop."""
        every = range(max(levels) + 1)
        wanted = {ct.STEMS: every, ct.PREDICTED: every, ct.AFFINES: levels, ct.CORRECTIONS: levels}
        return sum(length for kind, level, length in self.facts["chunks"] if level in wanted.get(kind, ()))

    def bytes_per_s(self, levels: set[int]) -> float:
        return 0.0 if self.stays else self.bytes(levels) / self.seconds

    def prepare_share(self, level: int) -> float:
        """Milliseconds a picture."""
        return 0.0 if self.stays else self.prepare_ms[level] / (self.seconds * RATE)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_source(parser)
    parser.add_argument("--instances", type=int, nargs="+", default=list(INSTANCES), metavar="N")
    parser.add_argument("--clips", type=int, nargs="+", default=list(CLIPS), metavar="N", help="unique ones")
    parser.add_argument(
        "--phases",
        type=int,
        nargs="+",
        default=list(PHASES),
        metavar="N",
        help="phases of the instances of a clip; 0: one each",
    )
    parser.add_argument(
        "--ladder",
        nargs="+",
        choices=LADDERS,
        default=["none", "decades"],
        help="layers of precision of the files, one forest after the other (default: both)",
    )
    parser.add_argument("--frames", type=int, default=FRAMES, metavar="N", help="of a clip (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=ROUNDS, metavar="N", help="(default %(default)s)")
    add_effort(parser, "fast")
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    rows, parts, broken = [], [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = compile_program(folder, "forest")
        made = {ladder: _make_clips(args, folder / ladder, ladder) for ladder in args.ladder}
        units = {
            ladder: {count: _units(program, files[:count], args.rounds) for count in args.clips}
            for ladder, files in made.items()
        }
        side = _side(made[args.ladder[0]][0])
        for scene in _scenes(args, units, side):
            played = scene.play(program, folder, args.rounds)
            predicted = scene.predict()
            rows.append(scene.row(predicted, played))
            parts.append(scene.parts(predicted, played))
            broken += scene.differences(played)
        unit_rows = [
            {"ladder": ladder} | row
            for ladder, own in units.items()
            for clips in own.values()
            for row in _unit_rows(clips)
        ]
        facts = units[args.ladder[0]][args.clips[0]][0].facts
    note = NOTE.format(
        **facts, frames=args.frames, source=args.of.stem, bound=args.rel_error, rate=RATE, rounds=args.rounds
    )
    return {
        "tables": [
            table("Forests", rows, note, FORMULA.format(side=side, wedge=np.degrees(WEDGE))),
            table("Time by stage", parts, PARTS_NOTE),
            table("Unit costs", unit_rows, UNITS_NOTE),
        ],
        "broken": broken,
    }


# ---- clips ----


def _make_clips(args: argparse.Namespace, folder: Path, ladder: str) -> list[Path]:
    """Files of as many different clips as the largest forest has."""
    folder.mkdir()
    files = [folder / f"clip_{number}.ath" for number in range(max(args.clips))]
    with athcodec.read_hdf5(args.of) as clip:
        for number, file in enumerate(files):
            athcodec.encode(
                _variant(clip, number, args.frames),
                file,
                rel_error=args.rel_error,
                effort=args.effort,
                attributes="none",
                ladder=ladder,
                segment_frames=DEFAULT_SEGMENT,
            )
    return files


def _variant(clip: athcodec.MotionClip, number: int, frames: int) -> athcodec.MotionClip:
    """The plant turned about the y axis, every other one mirrored, with its own sway and start."""
    source = clip.block(0, clip.frame_count).astype(np.float64)
    turns = max(1, round(frames / (2 * clip.frame_count)))
    swing = np.cos(2 * pi * (turns * np.arange(frames) / frames + GOLDEN * number))
    place = (clip.frame_count - 1) * (1 - swing) / 2
    first = np.minimum(place.astype(int), max(0, clip.frame_count - 2))
    weight = (place - first)[:, None, None]
    motion = (1 - weight) * source[first] + weight * source[np.minimum(first + 1, clip.frame_count - 1)]
    sway, rest = 0.8 + 0.4 * (GOLDEN * number * 7 % 1), clip.rest.astype(np.float64)
    shape = _turn(2 * pi * GOLDEN * number) * (1, 1, -1 if number % 2 else 1)
    return athcodec.MotionClip(
        ((rest + sway * (motion - rest)) @ shape.T).astype(np.float32),
        np.arange(frames) / clip.fps,
        clip.vertex_branch,
        clip.branch_parent,
        (rest @ shape.T).astype(np.float32),
        stem_index=clip.stem_index,
    )


def _turn(angle: float) -> np.ndarray:
    """Rotation matrix about the y axis, (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _side(file: Path) -> float:
    """The longest side of the rest pose's bounding box."""
    with athcodec.open(file) as decoder:
        return float(np.ptp(decoder.file.rest, axis=0).max())


def _units(program: Path, files: list[Path], rounds: int) -> list[Unit]:
    measured = _output(program, "units", rounds, *files)
    return [
        Unit(file, measured["choice_us"], clip["prepare_ms"], clip["segment_bytes"], measured["pose_us"])
        for file, clip in zip(files, measured["clips"], strict=True)
    ]


def _output(program: Path, *words: object) -> Any:
    done = subprocess.run([str(program), *map(str, words)], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def _unit_rows(units: list[Unit]) -> Iterator[dict[str, Any]]:
    for level in range(min(min(len(unit.pose_us), len(unit.prepare_ms)) for unit in units)):
        yield {
            "clips": len(units),
            "level": level,
            "prepare ms": np.mean([unit.prepare_ms[level] for unit in units]),
            "pose us": units[0].pose_us[level],
            "choice us": units[0].choice_us,
            "bytes": round(np.mean([unit.bytes({level}) for unit in units])),
            "prelude": round(np.mean([unit.facts["prelude"] for unit in units])),
        }


# ---- forests ----


@dataclass(frozen=True)
class Scene:
    """Instances of clips, near ones first. phases 0: each instance its own."""

    ladder: str
    units: list[Unit]
    distances: np.ndarray
    phases: int

    def clip_of(self, instance: int) -> int:
        return instance % len(self.units)

    def phase_of(self, instance: int) -> int:
        return instance // len(self.units) % self.phase_count

    @property
    def phase_count(self) -> int:
        return self.phases or ceil(len(self.distances) / len(self.units))

    @cached_property
    def levels(self) -> list[int]:
        """Of every instance."""
        levels = np.zeros(len(self.distances), int)
        for clip, unit in enumerate(self.units):
            with athcodec.open(unit.path) as decoder:
                own = slice(clip, None, len(self.units))
                wanted = [decoder.level_for(distance, FOV, SCREEN) for distance in self.distances[own].tolist()]
                levels[own] = unit.shown(np.array(wanted, int))
        return levels.tolist()

    @cached_property
    def poses(self) -> Counter:
        """Number of different poses of each (clip, level)."""
        shown = {(self.clip_of(i), level, self.phase_of(i)) for i, level in enumerate(self.levels)}
        return Counter((clip, level) for clip, level, _ in shown)

    def predict(self) -> dict[str, float]:
        used: dict[int, set[int]] = {}
        for clip, level in self.poses:
            used.setdefault(clip, set()).add(level)
        units, poses = self.units, self.poses.items()
        return {
            "bytes_per_s": sum(units[clip].bytes_per_s(levels) for clip, levels in used.items()),
            "choose_ms": sum(units[self.clip_of(i)].choice_us for i in range(len(self.distances))) / 1e3,
            "prepare_ms": sum(units[clip].prepare_share(level) for (clip, level), _ in poses),
            "pose_ms": sum(count * units[clip].pose_us[level] for (clip, level), count in poses) / 1e3,
        }

    def play(self, program: Path, folder: Path, rounds: int) -> dict[str, Any]:
        """Results of forest.c, with medians of its times."""
        file = folder / "scene.txt"
        file.write_text(
            "\n".join(
                [
                    f"{self.phase_count} {len(self.units)}",
                    *(str(unit.path) for unit in self.units),
                    f"{len(self.distances)}",
                    *(
                        f"{self.clip_of(i)} {distance!r} {self.phase_of(i)}"
                        for i, distance in enumerate(self.distances.tolist())
                    ),
                ]
            )
        )
        runs = [_output(program, "play", file, max(unit.seconds for unit in self.units), RATE) for _ in range(rounds)]
        return runs[0] | {name: median(figures[name] for figures in runs) for name in runs[0] if name.endswith("_ms")}

    def row(self, predicted: dict[str, float], played: dict[str, Any]) -> dict[str, Any]:
        expected, measured = _ms(predicted), _ms(played)
        return self._name() | {
            "levels": played["levels"],
            "poses": played["poses"],
            "predicted kB/s": predicted["bytes_per_s"] / 1e3,
            "kB/s": played["bytes_per_s"] / 1e3,
            "predicted ms": expected,
            "ms": measured,
            "p99 ms": played["p99_ms"],
            "ms/predicted": measured / expected,
            "us/instance": 1e3 * measured / len(self.distances),
            "MB": played["memory"] / 1e6,
        }

    def parts(self, predicted: dict[str, float], played: dict[str, Any]) -> dict[str, Any]:
        once = sum(unit.facts["prelude"] for unit in self.units) + played["start_bytes"]
        columns = {}
        for part in ("choose", "prepare", "pose"):
            columns |= {f"predicted {part}": predicted[f"{part}_ms"], part: played[f"{part}_ms"]}
        return self._name() | columns | {"late": played["late"], "start ms": played["start_ms"], "start kB": once / 1e3}

    def _name(self) -> dict[str, Any]:
        return {
            "instances": len(self.distances),
            "clips": len(self.units),
            "phases": self.phases or "own",
            "ladder": self.ladder,
        }

    def differences(self, played: dict[str, Any]) -> list[str]:
        """Where the played forest differs from the predicted one."""
        name = ", ".join(f"{value} {what}" for what, value in self._name().items())
        levels = np.bincount(self.levels).tolist()
        lines = [f"{name}: levels: got {played['levels']}; expected {levels}"] if played["levels"] != levels else []
        if played["poses"] != self.poses.total():
            lines.append(f"{name}: poses: got {played['poses']}; expected {self.poses.total()}")
        if played["held"]:
            lines.append(f"{name}: got {played['held']} poses of a nearer frame; expected none")
        return lines


def _ms(figures: dict[str, float]) -> float:
    return figures["choose_ms"] + figures["prepare_ms"] + figures["pose_ms"]


def _scenes(args: argparse.Namespace, units: dict[str, dict[int, list[Unit]]], side: float) -> Iterator[Scene]:
    """Every number of instances with every number of clips up to it, of the files of every ladder."""
    for instances in args.instances:
        for clips in args.clips:
            if clips > instances:
                continue
            for phases in args.phases if instances > clips else args.phases[:1]:
                for ladder, own in units.items():
                    yield Scene(ladder, own[clips], _distances(instances, side), phases)


def _distances(count: int, side: float) -> np.ndarray:
    """Distances from the camera, ascending: plants spread evenly over the wedge, the nearest `side` away."""
    area = (np.arange(count) + 0.5) * side**2
    return np.sqrt(side**2 + 2 * area / WEDGE)
