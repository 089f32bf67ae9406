"""The source of the vectors: every file of spec/vectors, with the rule that it tests.

    python -m spec.make_vectors            adds missing vectors and their lines in expected.txt

All but the last few valid ones are scripts (scripted.py), which do not need athcodec and always give the same bytes.
The expected error of a vector is stated here; expected.txt gets the results of the reference decoder if they agree with
it. A vector never changes once it exists: a better one gets another name.
"""

from __future__ import annotations

import argparse
import math
import re
import struct
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import zstandard

from spec import conformance, real_size
from spec.document import KIND_NAMES, rules
from spec.scripted import (
    LOOSE,
    NO_LEVEL,
    REST_ADAPTIVE,
    REST_CONNECTED,
    SHEET,
    WHOLE,
    Chance,
    Clip,
    Draft,
    Entry,
    Join,
    Plant,
    Script,
    Stem,
    basis_in_waves,
    basis_stream,
    clip_entry,
    grown,
    hierarchy_chunk,
    hierarchy_script,
    host_rest_chunk,
    predicted_head,
    refined_rest_chunk,
    refined_row,
    rest_chunk,
    row,
    source_rest_chunk,
    steady_time,
    steady_times,
    stems_head,
    uneven_time,
    whole_rates,
    write,
)

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
INFINITY, NAN = math.inf, math.nan
LOWEST, HIGHEST = -sys.float_info.max, sys.float_info.max
TINY = 5e-324
FLOAT_MAX, FLOAT_TINY = float(np.finfo(np.float32).max), float(np.finfo(np.float32).smallest_subnormal)


@dataclass(frozen=True)
class Vector:
    """A file, and its error of an item (conformance.py); none if it is valid."""

    name: str
    reason: str
    make: Callable[[], bytes]
    error: str = ""
    item: str = ""
    scripted: bool = True
    mesh: bytes | None = None  # of the host, which is given to the decoder

    @property
    def path(self) -> str:
        return f"{'invalid' if self.error else 'valid'}/{self.name}.ath"


VECTORS: list[Vector] = []


MADE: dict[str, Plant | Draft | bytes | Callable] = {}  # by the name of the vector


def valid(
    name: str,
    reason: str,
    make: Plant | Draft | bytes | Callable,
    scripted: bool = True,
    mesh: np.ndarray | None = None,
) -> None:
    MADE[name] = make
    VECTORS.append(Vector(name, reason, lambda: bytes_of(make), scripted=scripted, mesh=mesh_bytes(mesh)))


def invalid(
    name: str, error: str, item: str | int, reason: str, make: Draft | bytes | Callable, mesh: np.ndarray | None = None
) -> None:
    VECTORS.append(Vector(name, reason, lambda: bytes_of(make), error, str(item), mesh=mesh_bytes(mesh)))


def mesh_bytes(mesh: np.ndarray | None) -> bytes | None:
    return None if mesh is None else mesh.tobytes()


def bytes_of(made: Plant | Draft | bytes | Callable) -> bytes:
    if callable(made):
        made = made()
    return made if isinstance(made, bytes) else made.file()


# ---- files that others are derived from ----------------------------------------------------------------------


def lone(**fields) -> Plant:
    """One vertex, one frame."""
    return Plant([Stem(-1, 1)], points=[[4.0, 8.0, 12.0]], **fields)


FORK = [Stem(-1, 3), Stem(0, 2, 1)]


def forked(**fields) -> Plant:
    """A trunk and a branch, four frames in two segments, every kind of motion chunk."""
    scripts = {
        (rules.SHAPES, 1, 0): [2, *row((3, 0, 4), (0, 1, 0)), *row((0, 0, 1)), 0],
        (rules.STEMS, 1): lambda: Chance(1),
        (rules.STEMS, 2): lambda: Chance(2),
        (rules.AFFINES, 0): [-8, *row((5, -3, 1), (0, 2, 0))],
        (rules.CORRECTIONS, 2): lambda: Chance(3),
    }
    return Plant(FORK, **{"frames": 4, "segments": 2, "scripts": scripts} | fields)


def fork() -> Draft:
    return forked().draft()


def still(stems: list[Stem], **fields) -> Plant:
    """A plant whose rows are all empty."""
    return Plant(stems, **fields)


def moving(stems: list[Stem], seed: int, frames: int = 3, segments: int = 1, **fields) -> Plant:
    """Random rows at all levels."""
    scripts = {}
    for level in range(33):
        scripts[rules.STEMS, level] = lambda level=level: Chance(100 * seed + level)
        scripts[rules.AFFINES, level] = lambda level=level: Chance(100 * seed + level + 50, large=4)
    return Plant(stems, frames, segments, **{"scripts": scripts} | fields)


# ---- valid: predicted motion ---------------------------------------------------------------------------------

ROOTED = [Stem(-1, 4, flags=WHOLE), Stem(0, 3, 2), Stem(1, 2, 2), Stem(0, 3, 3)]
SINGLE = [Stem(-1, 1, flags=WHOLE)]
TWINS = [Stem(-1, 6, flags=WHOLE), Stem(-1, 6, flags=WHOLE), Stem(1, 2, 5)]
ROOTS = [Stem(-1, 1), Stem(-1, 3), Stem(-1, 2, flags=WHOLE), Stem(2, 2, 1)]
LONG = [Stem(-1, 5, flags=WHOLE), Stem(0, 4, 3)]
FORKED = [Stem(-1, 3), Stem(0, 2, 1)]
RESTING = [0, 1, *[0] * 16]  # a frame of them that is no copy, and in which none follow


def frame_of(stems: list[Stem], of_vertex: Callable[[], list[int]], follow: Callable[[], int]) -> list[int]:
    """What a frame says of its vertices, but for those that follow the ends of their stem."""
    values = []
    for stem in stems:
        ends = 2 if stem.parent < 0 and stem.count > 1 else 1
        for _ in range(ends):
            values += of_vertex()
        if stem.count > ends:
            values.append(follow())
            for _ in range(stem.count - ends if not values[-1] else 0):
                values += of_vertex()
    return values


def frame_steps(stems: list[Stem], seed: int, large: int = 12, still: float = 0.5, follow: float = 0.3) -> list[int]:
    """Of a frame: whether vertices have integers, and these."""
    chance = Chance(seed, large=large)

    def of_vertex() -> list[int]:
        moved = int(chance.random.random() >= still)
        return [1, *(chance.answer("signed", 0) for _ in range(3))] if moved else [0]

    return frame_of(stems, of_vertex, lambda: int(chance.random.random() < follow))


def frame_points(stems: list[Stem], seed: int) -> list[int]:
    """The same of points of the lattice: integers, or halves of even ones, or signs and halves of odd ones."""
    chance = Chance(seed, large=12)

    def of_vertex() -> list[int]:
        if not chance.answer("bit", 1):
            return [0]
        first = chance.answer("signed", 0)
        asked = ("bit", "unsigned") * 2 if first % 2 else ("signed",) * 2
        return [1, first, *(chance.answer(what, 0) for what in asked)]

    return frame_of(stems, of_vertex, lambda: int(chance.random.random() < 0.3))


def predicted(stems: list[Stem], frames: list, segments: int = 1, settings: int = 2, **fields) -> Plant:
    """frames: of each segment alike what it is coded about, (copied, 1) or (copied, 0, distance - 1), and its steps."""
    scripts = {(rules.PREDICTED, 1, s): [x for frame in frames for x in frame] for s in range(segments)}
    fields = {"predicted": predicted_head(settings=settings)} | fields
    fields["scripts"] = scripts | fields.get("scripts", {})
    return Plant(stems, len(frames) * segments, segments, **fields)


def swayed(frames: int, seed: int, stems: list[Stem] = ROOTED, **options) -> list:
    return [[0, 1, *frame_steps(stems, seed + t, **options)] for t in range(frames)]


valid("predicted-still", "nothing moves", lambda: predicted(ROOTED, [RESTING] * 3))
valid("predicted-smallest", "one vertex, one frame", lambda: predicted(SINGLE, [[0, 1]]))
valid("predicted", "vertices move at random, longer than any line", lambda: predicted(ROOTED, swayed(30, 1, large=5)))
valid(
    "predicted-following",
    "most stems follow their ends, for long and then for a while not",
    lambda: predicted(ROOTED, swayed(8, 21, follow=0.9) + swayed(4, 40, follow=0.1) + swayed(8, 50, follow=0.9)),
)
valid(
    "predicted-following-huge",
    "what follows leaves the range of binary32, and of binary64",
    lambda: predicted(
        LONG, swayed(6, 60, LONG, large=30, follow=1.0), predicted=predicted_head(FLOAT_MAX, 3), is_float64=True
    ),
)
for settings in (0, 7, 8, 15):
    valid(
        f"predicted-settings-{settings}",
        f"Memory {settings & 7}, Common {settings >> 3}",
        lambda settings=settings: predicted(ROOTED, swayed(12, 2), settings=settings),
    )
valid(
    "predicted-lattice",
    "vertices are points of the lattice",
    lambda: predicted(ROOTED, [[0, 1, *frame_points(ROOTED, 30 + t)] for t in range(20)], settings=18),
)
valid(
    "predicted-lattice-huge",
    "the largest points of the lattice, even and odd",
    lambda: predicted(
        SINGLE,
        [
            [0, 1, 1, -((1 << 30) - 1), 1, (1 << 30) - 1, 0, (1 << 30) - 1],
            [0, 1, 1, (1 << 30) - 2, (1 << 30) - 1, -((1 << 30) - 1)],
        ],
        predicted=predicted_head(FLOAT_MAX, 31),
    ),
)
valid(
    "predicted-references",
    "frames that are copies of earlier ones, of the rest pose, and coded about earlier ones",
    lambda: predicted(
        ROOTED,
        [
            [0, 1, *frame_steps(ROOTED, 3)],
            [0, 1, *frame_steps(ROOTED, 4)],
            [1, 1],
            [1, 1],
            [0, 0, 2, *frame_steps(ROOTED, 5)],
            [1, 0, 5],
            [0, 1, *frame_steps(ROOTED, 6)],
            [0, 0, 0, *frame_steps(ROOTED, 7)],
        ],
    ),
)
valid(
    "predicted-all-copied", "every frame is the rest pose", lambda: predicted(ROOTED, [[1, 1]] + [[1, 0, 0], [1, 0, 2]])
)
valid(
    "predicted-twins",
    "vertices that rest at the same places, and a stem as long as another",
    lambda: predicted(
        TWINS, swayed(9, 8, TWINS, large=6), points=[[4.0 * (i % 3), float(i % 2), 1.0] for i in range(14)]
    ),
)
valid(
    "predicted-collapsed",
    "all vertices rest at one place",
    lambda: predicted(ROOTED, swayed(6, 9), points=[[2.0, 2.0, 2.0]] * 12),
)
valid(
    "predicted-huge",
    "the largest integers and steps: positions leave the range of binary32",
    lambda: predicted(
        SINGLE, [[0, 1, 1, (1 << 30) - 1, -((1 << 30) - 1), 1]] * 5, predicted=predicted_head(FLOAT_MAX, 3)
    ),
)
valid(
    "predicted-tiny", "a subnormal Step", lambda: predicted(ROOTED, swayed(4, 10), predicted=predicted_head(FLOAT_TINY))
)
valid(
    "predicted-wide",
    "binary64 positions far from the origin",
    lambda: predicted(ROOTED, swayed(7, 11), is_float64=True, origin=(1e6, -3e5, 0.125)),
)
valid(
    "predicted-rounded",
    "binary32 positions far from the origin, a step below their spacing",
    lambda: predicted(ROOTED, swayed(7, 12), origin=(1e6, -3e5, 0.125)),
)
valid(
    "predicted-segments",
    "two segments, of which one has maps for level 0",
    lambda: predicted(ROOTED, swayed(5, 13), 2, scripts={(rules.AFFINES, 0, 1): [-8, *row((5, -3, 1), (0, 2, 0))]}),
)
valid(
    "predicted-roots",
    "maps of roots of one vertex, of one stem and of a subtree",
    lambda: predicted(ROOTS, swayed(3, 14, ROOTS), scripts={(rules.AFFINES, 0, 0): lambda: Chance(15, large=4)}),
)
valid("predicted-level-0", "shortened: level 0 of 2", lambda: predicted(ROOTED, swayed(2, 16)).draft().upto(0))
valid(
    "predicted-lossless",
    "the source's own numbers behind it",
    lambda: (
        predicted(ROOTED, swayed(2, 17))
        .draft()
        .with_header(level_count=3, full_level_count=3)
        .add(Entry(rules.EXACT, b"", 2, 0))
    ),
)

# ---- valid: plants -----------------------------------------------------------------------------------------

HEADS = {level: stems_head(0.01 * (level + 1), level % 5) for level in range(33)}


def chain(branches: int, count: int = 1, **last) -> list[Stem]:
    return [Stem(b - 1, count, count - 1 if b else 0) for b in range(branches - 1)] + [
        Stem(branches - 2, count, count - 1, **last)
    ]


def documented() -> bytes:
    """The hex dump in FORMAT.md."""
    text = (Path(__file__).resolve().parent.parent / "FORMAT.md").read_text("utf-8")
    dump = text[text.index("\n## Smallest file") :]
    return bytes.fromhex("".join(re.findall(r"^ {4}[0-9a-f]{8}  ((?:[0-9a-f]{2} ?)+)", dump, re.M)))


valid("documented", "the smallest file, as FORMAT.md has it", documented)
valid("smallest", "one vertex, one frame, nothing moves", lone)
valid("smallest-wide", "the same with binary64 positions and rest pose", lambda: lone(is_float64=True))
valid(
    "one-vertex-moves",
    "one vertex whose translation has three frequencies in five frames",
    lambda: lone(frames=5, scripts={(rules.STEMS, 0): row((1, 2, 3), (-40, 5, 0), (7, 0, -1))}),
)
valid("one-frame", "a bush in a single frame", lambda: moving(FORK, 5, frames=1, heads=HEADS))
valid(
    "all-equal",
    "all vertices at one point: no length, no extent, no rotations, no maps",
    lambda: moving([Stem(-1, 4), Stem(0, 2, 1), Stem(0, 2, 3, SHEET)], 6, points=[[1.0, 1.0, 1.0]] * 8, heads=HEADS),
)
valid(
    "all-at-origin",
    "all vertices at the origin, and the origin 0",
    lambda: still([Stem(-1, 3)], points=[[0.0] * 3] * 3),
)
valid("empty-streams", "streams all of whose decisions are 1 and that have no bytes", lambda: still(FORK, frames=3))
valid(
    "two-roots",
    "two plants: a root in the middle of the file",
    lambda: moving([Stem(-1, 3), Stem(0, 2, 1), Stem(-1, 4), Stem(2, 1, 3)], 7, heads=HEADS),
)
valid(
    "many-roots",
    "roots alone, each a node by its first modes",
    lambda: moving([Stem(-1, 1), Stem(-1, 2), Stem(-1, 3), Stem(-1, 1, 0, SHEET)], 8, heads=HEADS),
)
valid(
    "chain",
    "the deepest hierarchy of nodes that there can be: 31 branches, each on the one before, 32 levels",
    lambda: moving(chain(31), 9, heads=HEADS),
)
valid(
    "chain-in-whole",
    "a chain of 40 branches in a WHOLE subtree: nodes end where it begins",
    lambda: moving(
        [Stem(-1, 2), *(replace(s, parent=b, flags=WHOLE if b == 0 else 0) for b, s in enumerate(chain(40)))],
        10,
        heads=HEADS,
    ),
)
valid(
    "depth-4096",
    "branches as deep as the limit allows, of which level 0 is stored",
    lambda: (
        still([replace(s, flags=WHOLE if b == 0 else 0) for b, s in enumerate(chain(4096))], points=[[0.0] * 3] * 4096)
        .draft()
        .upto(0)
    ),
)
valid(
    "whole",
    "WHOLE subtrees: a root's, a branch's, and that of a branch alone, shown till the last level",
    lambda: moving(
        [
            Stem(-1, 3),
            Stem(0, 2, 1),
            Stem(1, 2, 1, WHOLE),
            Stem(2, 1),
            Stem(0, 2, 2, WHOLE),
            Stem(-1, 2, 0, WHOLE),
            Stem(5, 3, 1),
        ],
        11,
        heads=HEADS,
    ),
)
valid(
    "whole-alone",
    "a root that is WHOLE and all there is: h is 0",
    lambda: moving([Stem(-1, 3, 0, WHOLE)], 12, heads=HEADS),
)
valid(
    "loose",
    "LOOSE branches: a node by its modes, one with a map of its own, one inside a WHOLE subtree",
    lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1, LOOSE), Stem(0, 3, 2, LOOSE), Stem(2, 2, 1, WHOLE), Stem(3, 2, 0, LOOSE)],
        13,
        heads=HEADS,
    ),
)
valid(
    "loose-long",
    "a LOOSE stem of two pieces: only its first has a translation",
    lambda: moving([Stem(-1, 2), Stem(0, 65, 1, LOOSE)], 14, frames=2, heads=HEADS),
)
valid(
    "long-stem",
    "a stem of 129 vertices: three pieces, a root with a map of its own",
    lambda: moving([Stem(-1, 129)], 15, frames=2, heads=HEADS),
)
valid("stem-of-64", "a stem of 64 vertices: one piece, by its modes", lambda: moving([Stem(-1, 64)], 16, frames=2))
valid(
    "sheet",
    "SHEET branches that others hang on: flat, of one vertex, of two, in a line",
    lambda: moving(
        [Stem(-1, 9, 0, SHEET), Stem(0, 1, 4, SHEET), Stem(1, 2, 0, SHEET), Stem(0, 5, 8, SHEET), Stem(3, 2, 4)],
        17,
        frames=4,
        heads=HEADS,
        points=[[float(i % 3), float(i // 3), 0.0] for i in range(9)]
        + [[5.0, 1.0, 1.0]]
        + [[6.0, 1.0, 1.0], [6.0, 2.0, 1.0]]
        + [[2.0 + i, 2.0, 0.0] for i in range(5)]
        + [[7.0, 2.0, 1.0], [8.0, 2.0, 1.0]],
    ),
)
valid(
    "sheet-long",
    "a SHEET of 70 vertices in two pieces, and a branch on the second",
    lambda: moving([Stem(-1, 70, 0, SHEET), Stem(0, 2, 69)], 18, frames=2, heads=HEADS),
)
valid(
    "sheet-mirrored",
    "a sheet that is turned inside out: the gradient is followed, not Newton's step",
    lambda: Plant(
        [Stem(-1, 4, 0, SHEET), Stem(0, 2, 3)],
        2,
        points=[[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 8.0], [0.0, 0.0, 9.0], [0.0, 0.0, 10.0]],
        scripts={
            (rules.STEMS, 1): [
                *row(),
                0,
                *row((0, 0, 0), (-200, 30, 0)),
                *row((0, 0, 0), (0, -170, 0)),
                *row((3, 3, -160), (0, 0, 40)),
            ]
        },
    ),
)
valid(
    "tangent-opposed",
    "a parent that folds back on itself: the kept rotation is not turned",
    lambda: Plant(
        [Stem(-1, 2), Stem(0, 2, 1)],
        2,
        points=[[0.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 8.0, 0.0], [0.0, 9.0, 1.0]],
        scripts={(rules.STEMS, 1): [*row(), *row((0, -60, 0), (0, 60, 0)), *row((0, -9, 1))]},
    ),
)
valid(
    "tangent-none",
    "coincident vertices: no tangent to follow, at rest and in motion",
    lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1), Stem(0, 2, 2)],
        19,
        points=[[1.0, 2.0, 3.0]] * 3 + [[1.0, 3.0, 3.0], [1.0, 4.0, 3.0], [1.0, 2.0, 3.0], [2.0, 2.0, 3.0]],
    ),
)
valid(
    "whitening",
    "nodes whose subtrees extend in 0, 1, 2 and 3 directions",
    lambda: moving(
        [
            Stem(-1, 2),
            Stem(0, 1, 1),
            Stem(-1, 2),
            Stem(2, 1, 1),
            Stem(-1, 2),
            Stem(4, 2, 1),
            Stem(-1, 2),
            Stem(6, 3, 1),
        ],
        20,
        heads=HEADS,
        points=[
            [0.0] * 3,
            [0.0] * 3,
            [0.0] * 3,
            [5.0, 0.0, 0.0],
            [6.0, 1.0, 0.0],
            [7.0, 2.0, 0.0],
            [0.0, 5.0, 0.0],
            [1.0, 5.0, 0.0],
            [1.0, 6.0, 0.0],
            [3.0, 9.0, 0.0],
            [0.0, 0.0, 9.0],
            [1.0, 0.0, 9.0],
            [1.0, 2.0, 9.0],
            [1.0, 2.0, 12.0],
            [2.0, 3.0, 14.0],
        ],
    ),
)
valid(
    "rotations",
    "every rotation factor there is: 0, 1, 2, 4, 8",
    lambda: moving([Stem(-1, 3), *(Stem(b, 2, 1) for b in range(4))], 21, frames=4, heads=HEADS),
)
BLADES = [Stem(-1, 3), Stem(-1, 4), Stem(-1, 2), Stem(-1, 3)]


def interleaved(stems: list[Stem]) -> list[int]:
    """Numbers of the vertices in a source that holds all first vertices, then all second ones."""
    places = [(i, b) for b, stem in enumerate(stems) for i in range(stem.count)]
    return np.argsort(sorted(range(len(places)), key=places.__getitem__)).tolist()


valid(
    "permutations",
    "branches and vertices numbered otherwise in the source",
    lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1), Stem(0, 1, 2)], 22, branch_source=[2, 0, 1], vertex_source=[5, 0, 3, 1, 4, 2]
    ),
)
valid(
    "permutation-of-branches",
    "branches numbered otherwise, vertices as that lets one expect",
    lambda: moving(FORK, 23, branch_source=[1, 0]),
)
valid(
    "permutations-said",
    "numbers as expected, but said one by one",
    lambda: still(FORK, branch_source=[0, 1], vertex_source=[0, 1, 2, 3, 4]),
)
valid(
    "permutation-interleaved",
    "all first vertices in front of all second ones, of stems of different lengths",
    lambda: still(BLADES, vertex_source=interleaved(BLADES)),
)
valid(
    "permutation-interleaved-long",
    "the same of two stems of more vertices than numbers are remembered of",
    lambda: still([Stem(-1, 259), Stem(-1, 260)], vertex_source=interleaved([Stem(-1, 259), Stem(-1, 260)])),
)
valid(
    "permutation-turned",
    "stems from tip to base",
    lambda: still(BLADES, vertex_source=[v for a, b in ((0, 3), (3, 7), (7, 9), (9, 12)) for v in range(a, b)[::-1]]),
)

# ---- valid: segments, time, levels -------------------------------------------------------------------------

valid(
    "frames-256",
    "a segment of as many frames as there can be, with rows that code all of them",
    lambda: lone(frames=256, scripts={(rules.STEMS, 0): row(*[(1, 0, -1)] * 256), (rules.STEMS, 1): []}),
)
valid(
    "frames-257", "one frame more: segments of 128 and 129", lambda: moving([Stem(-1, 2)], 24, frames=257, segments=2)
)
valid(
    "uneven-segments",
    "7 frames in 3 segments, of 2, 2 and 3",
    lambda: moving(FORK, 25, frames=7, segments=3, heads=HEADS),
)
valid("segment-per-frame", "as many segments as frames", lambda: moving(FORK, 26, frames=3, segments=3, heads=HEADS))
valid(
    "steps-per-segment",
    "segments with steps, rotations and bases of their own",
    lambda: moving(
        FORK,
        27,
        frames=6,
        segments=2,
        heads={
            (1, 0): stems_head(0.5, 3),
            (1, 1): stems_head(0.001, 0),
            (2, 1): stems_head(0.25, 1, 8, 2, basis_stream([[100, -100, 100], [128, 0, -128]], 8)),
        },
    ),
)
valid("level-0-alone", "shortened: level 0 of 3", lambda: fork().upto(0))
valid("level-1-of-3", "shortened: without the last level and its corrections", lambda: fork().upto(1))
valid(
    "errors-announced",
    "an error table with the largest and the smallest numbers; those of the deepest level are above Max_Error 0",
    lambda: replace(lone().draft().with_header(max_error=0.0), errors=(8159, 0, 4000, 0, 1, 8159)),
)
valid(
    "max-error-largest",
    "the largest Max_Error, and errors of segments up and down",
    lambda: replace(fork().with_header(max_error=HIGHEST), errors=tuple(range(8000, 8018))),
)
valid(
    "kind-spelt",
    "known Kinds by all their bits",
    lambda: fork().change(rules.STEMS, 1, 1, spelt=True).change(rules.AFFINES, 0, 0, spelt=True),
)
valid("time-whole-rate", "times by a whole rate", lambda: lone(frames=7, time=whole_rates(3)))
valid(
    "time-whole-step",
    "times by a step that is one over a whole rate",
    lambda: lone(frames=7, time=whole_rates(49, method=4)),
)
valid("time-largest-rate", "Rate 65535", lambda: lone(frames=7, time=whole_rates(65535)))
valid("time-rate", "times by their rate, First below 0", lambda: lone(frames=4, time=steady_time(-2.0, 24.0, 1)))
valid(
    "time-wide",
    "times far from 0, with a Step that just counts",
    lambda: lone(frames=3, time=steady_time(2.0**52, 1.0)),
)
valid(
    "time-uneven",
    "times one by one, -0.0 and subnormal ones among them",
    lambda: lone(frames=6, time=uneven_time(-1e300, -1.0, -0.0, TINY, 1 / 3, HIGHEST)),
)
valid("time-one-uneven", "a single time by Method 2", lambda: lone(time=uneven_time(1.5)))
valid(
    "thresholds",
    "Epsilon, Xi, Eta and Lambda at the ends of their range",
    lambda: (
        lone()
        .draft()
        .change(
            rules.HIERARCHY,
            content=hierarchy_chunk(lone().draft().content(rules.HIERARCHY)[8:], rules.SHORT_FLOATS - 1, 0, 65535, 0),
        )
    ),
)

# ---- valid: clips ------------------------------------------------------------------------------------------

CALM, STORM = Clip(3, 1, "calm"), Clip(4, 2, "storm")


def two_clips(**fields) -> Draft:
    """The fork with two clips, of 3 frames, and of 4 in two segments."""
    return forked(**{"clips": (CALM, STORM)} | fields).draft()


def loop(clip: Clip, *seams: float) -> Clip:
    return replace(clip, seams=seams)


def periodic(clip: Clip, *seams: float) -> Clip:
    return replace(loop(clip, *seams), periodic=True)


def all_waves(frames: int) -> Callable[[], Plant]:
    clips = Clip(frames, 1, "once"), periodic(Clip(frames, 1, "again"), 0.0, 0.0)
    rows = row(*(tuple((k + axis) % 5 - 2 for axis in range(3)) for k in range(frames)))
    return lambda: lone(clips=clips, scripts={(rules.STEMS, 0): rows})


def named(*names: str) -> Plant:
    """One vertex with a clip of a frame for each name."""
    return lone(clips=tuple(Clip(1, 1, name) for name in names))


valid("clips-two", "two clips of different lengths, that share the shapes of pieces", two_clips)
valid(
    "clips-three",
    "13 frames in 6 segments, which without the clips would begin elsewhere",
    lambda: moving(FORK, 28, heads=HEADS, clips=(Clip(5, 2, "a"), Clip(1, 1, "b"), Clip(7, 3, "c"))),
)
valid(
    "clips-of-one-frame",
    "three clips of one frame each, one of them a loop",
    lambda: moving(
        FORK, 29, heads=HEADS, clips=(Clip(1, 1, "a"), loop(Clip(1, 1, "b"), 0.0, 0.0, 0.0), Clip(1, 1, "c"))
    ),
)
valid(
    "clips-segment-lengths",
    "a segment of as many frames as there can be before shorter ones",
    lambda: lone(
        clips=(Clip(256, 1, "long"), Clip(257, 2, "longer"), Clip(2, 2, "short")),
        scripts={(rules.STEMS, 0): row((1, 2, 3))},
    ),
)
valid(
    "clips-255",
    "as many clips as there can be, the last with a segment more",
    lambda: lone(
        clips=(*(Clip(1, 1, f"{i}") for i in range(254)), Clip(2, 2, "last")),
        scripts={(rules.STEMS, 0): row((1, 2, 3))},
    ),
)
valid(
    "clips-loops",
    "two loops around a clip that is none: seams at the ends of binary32, and -0.0",
    lambda: two_clips(clips=(loop(CALM, 0.5, FLOAT_TINY, 0.0), Clip(2, 1, "once"), loop(STORM, FLOAT_MAX, 1.0, -0.0))),
)
valid("clip-named", "a single clip with a name", lambda: two_clips(clips=(CALM,)))
valid("clip-loop", "a single clip with a name, a loop", lambda: two_clips(clips=(loop(STORM, 3.0, 2.0, 1.0),)))
valid(
    "clips-periodic",
    "of three loops of one segment the first and the last are periodic",
    lambda: moving(
        FORK,
        30,
        heads=HEADS,
        clips=(
            periodic(CALM, 0.5, 0.25, 0.0),
            loop(Clip(3, 1, "jerks"), 0.5, 0.25, 0.0),
            periodic(Clip(1, 1, "one"), 0.0, 0.0, 0.0),
        ),
    ),
)
for frames in (2, 3, 4, 7, 33, 255, 256):
    valid(f"waves-{frames}", f"all waves of {frames} frames, once of a beam and once periodic", all_waves(frames))
valid("clip-unnamed", "a single clip that CLIPS gives an empty name", lambda: two_clips(clips=(Clip(4, 2),)))
valid(
    "clip-unnamed-loop",
    "a single loop with an empty name",
    lambda: two_clips(clips=(loop(Clip(4, 2), 0.25, 0.25, 0.0),)),
)
valid(
    "clips-time",
    "First and Step of each clip: the second begins before the first and overlaps it",
    lambda: two_clips(time=steady_times((10.0, 0.5), (-1.0, 0.25))),
)
valid(
    "clips-time-rate",
    "First and rate of each clip, which all begin at 0",
    lambda: two_clips(time=steady_times((0.0, 24.0), (0.0, 30.0), method=1)),
)
valid(
    "clips-time-uneven",
    "times one by one, that descend and repeat from clip to clip",
    lambda: two_clips(time=uneven_time(0.0, 0.5, 2.0, -1.0, 0.5, 0.75, 2.0)),
)
valid(
    "clips-time-of-one-frame",
    "clips of one frame, all at the same time, one by one",
    lambda: replace(named("a", "b", "c"), time=uneven_time(1.5, 1.5, 1.5)),
)
valid(
    "clips-time-vast",
    "what a time is expected to be, from clips before, overflows to infinity",
    lambda: replace(named("a", "b", "c", "d"), time=uneven_time(LOWEST, HIGHEST, LOWEST, 0.0)),
)
valid(
    "clips-time-step-vanishes",
    "a Step that vanishes, in a clip of one frame",
    lambda: two_clips(clips=(CALM, Clip(1, 1, "still")), time=steady_times((0.0, 0.5), (1e30, 1.0)), scripts={}),
)
valid(
    "clips-steps",
    "segments with steps, rotations and bases of their own, of as many rows as each has frames",
    lambda: moving(
        FORK,
        30,
        clips=(CALM, STORM),
        heads={
            (1, 0): stems_head(0.5, 3, 8, 3, basis_stream([[100, -100, 100], [128, 0, -128], [1, 2, 3]], 8)),
            (1, 1): stems_head(0.001, 0, 9, 2, basis_stream([[1, 2], [256, -256]], 9)),
            (2, 2): stems_head(0.25, 1),
        },
    ),
)
valid(
    "clips-corrections",
    "corrections in the second clip alone",
    lambda: Plant(FORK, clips=(CALM, STORM), is_float64=True, scripts={(rules.CORRECTIONS, 2, 2): lambda: Chance(58)}),
)
valid(
    "clips-truncated",
    "shortened: level 0 of 3, seams of all three",
    lambda: two_clips(clips=(CALM, loop(STORM, 3.0, 2.0, 1.0))).upto(0),
)
valid(
    "clips-lossless",
    "two loops whose last level is the source's own numbers: seams of four levels",
    lambda: (
        two_clips(clips=(loop(CALM, 3.0, 2.0, 1.0, 0.0), loop(STORM, 0.5, 0.25, 0.125, 0.0)))
        .with_header(level_count=4, full_level_count=4)
        .add(*(Entry(rules.EXACT, b"", 3, s) for s in range(3)))
    ),
)
valid(
    "clips-names",
    "names that differ in case, in accents, in their ends, by spaces alone",
    lambda: named(
        "wind",
        "Wind",
        "WIND",
        "win",
        "winds",
        " ",
        "  ",
        "B\u00f6e",
        "Bo\u0308e",
        "\u98ce",
        "\U0001f333",
        '"\\/',
        "a.b/c",
    ),
)
valid(
    "clips-names-ends",
    "characters at the ends of the ranges of UTF-8",
    lambda: named(
        " ",
        "~",
        "\x80",
        "\x9f",
        "\u07ff",
        "\u0800",
        "\ud7ff",
        "\ue000",
        "\ufeff",
        "\ufffe",
        "\uffff",
        "\U00010000",
        "\U0010ffff",
    ),
)
valid("clips-names-longest", "names of 255 bytes", lambda: named("n" * 255, "n" * 254 + "m", "\u98ce" * 85))

# ---- valid: rest poses -------------------------------------------------------------------------------------

AWKWARD_FLOATS = [-0.0, FLOAT_TINY, -FLOAT_MAX, FLOAT_MAX, 1.0, -1e-40, 0.0, 1 + 2**-23, -1.0]
AWKWARD_DOUBLES = [-0.0, TINY, -1e300, 1e300, 1.0, -1e-310, 0.0, 1 + 2**-52, -1.0]


def branches_of(stems: list[Stem]) -> list:
    count = sum(stem.count for stem in stems)
    return rules.decode_hierarchy(
        write(rules.decode_hierarchy, hierarchy_script(stems), len(stems), count), len(stems), count
    )[0]


def exact_rest(stems: list[Stem], numbers: list, is_float64: bool, **fields) -> bytes:
    stream = write(rules.decode_exact_rest, numbers, branches_of(stems), is_float64)
    return rest_chunk(stream, exact=1, rest_type=int(is_float64), **fields)


def coded_rest(stems: list[Stem], script: list | Chance, **fields) -> bytes:
    return rest_chunk(write(rules.decode_rest, script, branches_of(stems), 1.0), **fields)


def adaptive_rest(
    stems: list[Stem], script: list | Chance, step: float = 0.25, connected: bool = False, **fields
) -> bytes:
    stream = write(rules.decode_rest, script, branches_of(stems), step, None, True)
    bits = REST_ADAPTIVE | REST_CONNECTED * connected
    return rest_chunk(stream, step=step, reserved=bits >> 2, **fields)


def with_rest(stems: list[Stem], rest: bytes, **fields) -> Plant:
    return Plant(stems, rest=rest, **fields)


valid(
    "rest-lags",
    "rest poses by steps, predicted from 1, 2 and 3 vertices before",
    lambda: still(
        [Stem(-1, 7, lag=1), Stem(0, 6, 3, lag=2), Stem(1, 8, 5, lag=3)],
        points=grown([Stem(-1, 7), Stem(0, 6, 3), Stem(1, 8, 5)], 3),
    ),
)
valid(
    "rest-lag-65535",
    "the largest Lag: every vertex is expected where the one before is",
    lambda: still([Stem(-1, 3, lag=65535)]),
)
valid(
    "rest-beams",
    "beams: runs of 1, 16 and 17 and of 32 vertices, from roots and from attach vertices",
    lambda: with_rest(
        [Stem(-1, 2, lag=0), Stem(0, 33, 1, lag=0), Stem(0, 32, 0, lag=0), Stem(-1, 1, lag=0)],
        coded_rest([Stem(-1, 2, lag=0), Stem(0, 33, 1, lag=0), Stem(0, 32, 0, lag=0), Stem(-1, 1, lag=0)], Chance(31)),
    ),
)
valid(
    "rest-beams-and-steps",
    "stems of both kinds that share their models",
    lambda: with_rest(
        [Stem(-1, 5, lag=0), Stem(0, 3, 1, lag=1), Stem(0, 4, 4, lag=0)],
        coded_rest(
            [Stem(-1, 5, lag=0), Stem(0, 3, 1, lag=1), Stem(0, 4, 4, lag=0)],
            Chance(32),
            rest_type=1,
            origin=(1e6, -0.5, 3.0),
        ),
    ),
)
ADAPTIVE = [  # every filter, phases within lags and across stems, rows of several vertices, a beam among them
    Stem(-1, 30, lag=1),
    Stem(0, 12, 3, lag=2),
    Stem(0, 12, 4, lag=3),
    Stem(2, 14, 5, SHEET, lag=4),
    Stem(0, 40, 9, SHEET, lag=7),
    Stem(-1, 9, lag=0),
    Stem(5, 3, 2, lag=65535),
]
valid(
    "rest-adaptive",
    "an adaptive rest pose",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, Chance(33, large=6), rest_type=1)),
)
valid(
    "rest-adaptive-phases",
    "an adaptive rest pose of a lag of more vertices than there are phases",
    lambda: with_rest([Stem(-1, 900, lag=300)], adaptive_rest([Stem(-1, 900, lag=300)], Chance(34, large=3))),
)
valid(
    "rest-adaptive-still",
    "an adaptive rest pose without bytes, which is a point",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, [])),
)
valid(
    "rest-adaptive-vast",
    "integers of 30 bits under the largest Rest_Step: weighted guesses are out of range",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, Chance(35, large=29), FLOAT_MAX)),
)
valid(
    "rest-adaptive-tiny",
    "a subnormal Rest_Step",
    lambda: with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, Chance(36, large=9), FLOAT_TINY)),
)
COPIED = [  # a shape and its copies, of branches that have detail and that have none
    Stem(-1, 8, lag=2),
    Stem(0, 4, 3, lag=2),
    Stem(0, 4, 5, SHEET, lag=2, detail=118),
    Stem(0, 4, 0, lag=1),
    Stem(0, 8, 2, lag=2),
]
for name_, seed_, title_ in (
    ("rest-copies", 2364, "copies of shapes: one that is mirrored and scaled, one that is bent"),
    ("rest-copies-bent", 2949, "copies of shapes that are bent, mirrored and scaled"),
):
    valid(name_, title_, lambda seed_=seed_: with_rest(COPIED, adaptive_rest(COPIED, Chance(seed_, large=3))))
DETAILED = [  # finer and coarser than the step, the largest and the smallest, alike and unlike by lag
    replace(stem, detail=detail) for stem, detail in zip(ADAPTIVE, (0, 121, 118, 0, 255, 110, 1))
]
valid(
    "rest-detail",
    "steps of branches of their own, in an adaptive rest pose and in beams",
    lambda: with_rest(DETAILED, adaptive_rest(DETAILED, Chance(37, large=6))),
)
valid(
    "rest-detail-steps",
    "the same in a rest pose that is not adaptive",
    lambda: with_rest(DETAILED, rest_chunk(write(rules.decode_rest, Chance(38, large=6), branches_of(DETAILED), 0.25))),
)
valid(
    "rest-exact",
    "binary32 bit for bit: -0.0, subnormal and largest numbers",
    lambda: with_rest([Stem(-1, 3)], exact_rest([Stem(-1, 3)], AWKWARD_FLOATS, False)),
)
valid(
    "rest-exact-wide",
    "binary64 bit for bit, in a file whose positions are binary32",
    lambda: with_rest([Stem(-1, 3)], exact_rest([Stem(-1, 3)], AWKWARD_DOUBLES, True, origin=(1.0, -0.0, FLOAT_TINY))),
)
valid(
    "rest-exact-predicted",
    "exact numbers expected from vertices before; the expectation overflows to infinity",
    lambda: with_rest(
        [Stem(-1, 4), Stem(0, 3, 2)],
        exact_rest(
            [Stem(-1, 4), Stem(0, 3, 2)],
            [1.0, 2.0, -3e38, 2.0, 4.0, 1e38, 3.0, 6.0, 3e38, 4.0, 8.0, 0.0] + [0.5] * 9,
            False,
        ),
    ),
)
valid(
    "rest-exact-wraps",
    "differences beyond half of all numbers wrap around",
    lambda: with_rest([Stem(-1, 2)], exact_rest([Stem(-1, 2)], [1.0, 0.0, 0.0, (2**64 - 1, True), 0.0, 0.0], True)),
)
valid(
    "rest-steps-vast",
    "Rest_Step at the end of binary32: positions are infinite",
    lambda: moving([Stem(-1, 3), Stem(0, 2, 1)], 33, step=FLOAT_MAX, heads=HEADS),
)
valid(
    "rest-vast",
    "an exact rest pose at 1e300: distances overflow, nothing has a length",
    lambda: moving(FORK, 33, rest=exact_rest(FORK, [1e300 * (i * i % 7) for i in range(15)], True), heads=HEADS),
)
valid("rest-steps-tiny", "a subnormal Rest_Step", lambda: moving(FORK, 34, step=FLOAT_TINY, heads=HEADS))
valid(
    "rest-tiny",
    "an exact rest pose of subnormal numbers: squares of distances vanish",
    lambda: moving(FORK, 34, rest=exact_rest(FORK, [TINY * (i * i % 7) for i in range(15)], True), heads=HEADS),
)
valid(
    "origin-far", "an origin that eats what the rest pose adds", lambda: moving(FORK, 35, origin=(1e9, -1e9, 2.0**60))
)
valid(
    "origin-overflows",
    "binary32 positions beyond its range are infinite",
    lambda: still(FORK, rest=exact_rest(FORK, [1e39, -1e39, 0.0] * 5, True, origin=(FLOAT_MAX, -FLOAT_MAX, 0.0))),
)

# ---- valid: rest poses of the source -----------------------------------------------------------------------

BUSH = [
    Stem(-1, 70, lag=0),
    Stem(0, 5, 3, SHEET, lag=1),
    Stem(1, 4, 4, lag=0),
    Stem(0, 33, 69, LOOSE, lag=0),
    Stem(3, 1, 32, lag=0),
    Stem(-1, 6, lag=2),
    Stem(5, 3, 0, lag=0),
]


DETAILED_BUSH = [replace(stem, detail=detail) for stem, detail in zip(BUSH, (0, 120, 119, 0, 121, 0, 118))]


def detailed_rest() -> bytes:
    return rest_chunk(write(rules.decode_rest, Chance(214, large=6), branches_of(DETAILED_BUSH), 0.25))


def bent(stems: list[Stem], script: list | Chance, rest: bytes | None = None) -> bytes:
    """SOURCE_REST about the pose of REST, by default that of `still`, at the same step."""
    branches, reference = branches_of(stems), 0.25 * np.array(grown(stems), float)
    if rest is not None:
        reference = rules.decode_rest(rest[17:], branches, 0.25).rest
    return source_rest_chunk(write(rules.decode_source_rest, script, branches, 0.25, reference))


def bent_bush(script: list | Chance, rest: list | Chance, **fields) -> Plant:
    reference = coded_rest(BUSH, rest, **{"rest_type": 1, "origin": fields.pop("origin")} if fields else {})
    return still(BUSH, rest=reference, source_rest=bent(BUSH, script, reference), **fields)


valid(
    "source-rest",
    "a rest pose about the reference pose: beams of several runs, stems that are none, roots",
    lambda: bent_bush(Chance(201, large=6), Chance(211, large=9)),
)
valid("source-rest-same", "the same pose once more: a stream of no bytes", lambda: bent_bush([], Chance(212, large=9)))
valid(
    "source-rest-detail",
    "steps of branches of their own",
    lambda: still(
        DETAILED_BUSH, source_rest=bent(DETAILED_BUSH, Chance(204, large=6), detailed_rest()), rest=detailed_rest()
    ),
)
valid(
    "source-rest-far",
    "steps as large as the plant: tangents are opposed and vanish",
    lambda: bent_bush(Chance(202, large=12), Chance(213, large=9)),
)
valid(
    "source-rest-point",
    "a reference pose that is one point: no tangents, no turns",
    lambda: bent_bush(Chance(203, large=4), []),
)
valid(
    "source-rest-wide",
    "with a pose of binary64",
    lambda: bent_bush(Chance(204, large=9), Chance(214, large=9), is_float64=True, origin=(FLOAT_MAX, 0.0, -FLOAT_MAX)),
)
valid(
    "source-rest-largest-step",
    "Rest_Step is the largest number: positions beyond binary32",
    lambda: still(FORK, source_rest=source_rest_chunk(bent(FORK, Chance(205))[5:], FLOAT_MAX)),
)
valid(
    "source-rest-exact",
    "the very numbers of the source, the reference pose at a step",
    lambda: still(
        FORK, source_rest=source_rest_chunk(exact_rest(FORK, [*AWKWARD_FLOATS, *[1.5] * 6], False)[17:], method=1)
    ),
)
valid(
    "source-rest-exact-wide",
    "the same in binary64",
    lambda: still(
        FORK,
        is_float64=True,
        source_rest=source_rest_chunk(exact_rest(FORK, [*AWKWARD_DOUBLES, *[1.5] * 6], True)[17:], method=1),
    ),
)

# ---- valid: motion -----------------------------------------------------------------------------------------

valid(
    "steps-largest",
    "Step at the end of binary32: infinities and NaN as the arithmetic yields them",
    lambda: moving(FORK, 41, heads={level: stems_head(FLOAT_MAX, 4) for level in range(3)}),
)
valid(
    "steps-smallest",
    "the smallest Step",
    lambda: moving(FORK, 42, heads={level: stems_head(FLOAT_TINY, 4) for level in range(3)}),
)
valid(
    "numbers-largest",
    "integers at the ends of what a stream can hold",
    lambda: lone(
        frames=3, scripts={(rules.STEMS, 0): row((2**30 - 1, 1 - 2**30, 0), (2**29, -1, 1), (2**20 + 1, 0, 9))}
    ),
)
valid(
    "maps-largest",
    "maps whose steps are 2^100 and 2^-100 in turn",
    lambda: Plant(
        [Stem(-1, 2), Stem(0, 1, 1), Stem(-1, 2), Stem(2, 1, 1), Stem(-1, 2), Stem(4, 1, 1)],
        2,
        points=[[float(x), 0.0, 0.0] for x in range(9)],
        scripts={
            (rules.AFFINES, 0): [
                200,
                *row((1, 2, 3)),
                *row((0, 1, 0)),
                -400,
                *row((5, 5, 5)),
                *row(),
                399,
                *row(),
                *row((0, 0, 1)),
            ]
        },
    ),
)
valid(
    "learned-basis",
    "a learned basis of one row, 8 bits, at the ends of its range",
    lambda: lone(
        frames=4,
        heads={0: stems_head(0.5, 0, 8, 1, basis_stream([[128, -128, 128, 0]], 8))},
        scripts={(rules.STEMS, 0): row((3, -1, 70))},
    ),
)
valid(
    "learned-basis-full",
    "a learned basis of as many rows as frames, 16 bits, beside waves on other levels",
    lambda: moving(
        FORK,
        43,
        heads={1: stems_head(0.5, 2, 16, 3, basis_stream([[32768, 1, -5], [-32768, 32768, -32768], [0, 0, 77]], 16))},
    ),
)
valid(
    "learned-basis-zero",
    "a learned basis of zeros, of no bytes but the stream's",
    lambda: moving([Stem(-1, 3)], 44, heads={0: stems_head(0.5, 1, 12, 2, basis_stream([[0] * 3] * 2, 12))}),
)
WAVE_ROWS = (  # of four rows over four frames: exponents, integers; the axes without a use of the last row are not 0
    *(-6, 3, -1),
    *row((9, 0, 1), (-4, 60, 0), (0, 2, 700)),
    -200 + 4,
    *row((1, 2, 3), (5, 0, 0)),
)
valid(
    "basis-in-waves",
    "a learned basis of four rows in waves, one of them of the least step",
    lambda: moving(FORK, 45, frames=4, heads={1: stems_head(0.5, 2, 2, 4, basis_in_waves(4, *WAVE_ROWS, rank=4))}),
)
valid(
    "basis-in-waves-zero",
    "a learned basis of two rows in waves: one of zeros, and one like the first of its level before",
    lambda: moving(
        FORK,
        46,
        frames=4,
        heads={
            1: stems_head(0.5, 2, 2, 2, basis_in_waves(4, 0, 0, *row((1, 0, 0), (2, 0, 0)), rank=2)),
            2: stems_head(0.25, 0, 2, 3, basis_in_waves(4, 8, *row((1, 0, 0), (2, 0, 0)), rank=1), base=1),
        },
    ),
)
valid(
    "basis-shared",
    "levels that share a learned basis, which lies with the first of them",
    lambda: moving(
        FORK,
        47,
        frames=4,
        heads={
            1: stems_head(0.5, 2, 2, 4, basis_in_waves(4, *WAVE_ROWS, rank=4)),
            2: stems_head(0.25, 0, 2, 4, b"", base=1),
        },
    ),
)
valid(
    "basis-of-both-kinds",
    "learned bases in waves that begin with rows by their entries, and the other way round",
    lambda: moving(
        FORK,
        48,
        frames=4,
        segments=1,
        heads={
            1: stems_head(0.5, 2, 9, 1, basis_stream([[256, -256, 256, 200]], 9)),
            2: stems_head(0.25, 0, 2, 3, basis_in_waves(4, -3, 2, *row((3, 1, 0), (0, 2, 0)), rank=2), base=1),
            3: stems_head(0.25, 0, 9, 4, basis_stream([[5, 6, 7, -200]], 9), base=2),
        },
    ),
)
valid(
    "node-waves",
    "stems in the waves of maps beside those of stems: Basis_Bits 1",
    lambda: moving(FORK, 45, heads={1: stems_head(0.5, 2, 1)}),
)
valid("shapes", "learned shapes at base levels and at the levels that complete a piece, in both segments", fork)
valid(
    "shapes-high",
    "as many shapes as there can be: of the first modes, then of the others",
    lambda: Plant(
        [Stem(-1, 4)],
        3,
        scripts={
            (rules.SHAPES, 0, 0): [6, *(n for i in range(6) for n in row((1, -i, 2), (i, 5, 0), (0, 0, 3)))],
            (rules.SHAPES, 1, 0): [6, *(n for i in range(6) for n in row((0, 1, i), (0, -i, 0), (2, 2, 2), (9, 9, i)))],
            (rules.STEMS, 0): lambda: Chance(45),
            (rules.STEMS, 1): lambda: Chance(46),
        },
    ),
)
valid(
    "shapes-few",
    "a shape less than its mode has axes, and none at the level that completes the piece",
    lambda: Plant(
        [Stem(-1, 20)],
        3,
        scripts={
            (rules.SHAPES, 0, 0): [2, *row((2**29, 0, 0)), *row(*[(0, 0, 0)] * 15, (1, 0, 0))],
            (rules.SHAPES, 1, 0): [],
            (rules.STEMS, 0): lambda: Chance(47),
            (rules.STEMS, 1): lambda: Chance(48),
        },
    ),
)
valid(
    "shapes-of-sheets",
    "shapes of a sheet, and of pieces inside a WHOLE subtree",
    lambda: Plant(
        [Stem(-1, 4, 0, SHEET), Stem(0, 3, 3, WHOLE), Stem(1, 2, 1, SHEET)],
        3,
        scripts={
            (rules.SHAPES, 1, 0): [3, *row((1, 2, 3)), *row((3, 2, 1), (1, 1, 1)), *row((0, 0, 5))],
            (rules.SHAPES, 2, 0): [1, *row((4, 0, 0)), 2, *row((0, 7, 0)), *row((0, 0, 7))],
            (rules.STEMS, 1): lambda: Chance(49),
            (rules.STEMS, 2): lambda: Chance(50),
            (rules.AFFINES, 0): lambda: Chance(51, large=3),
            (rules.AFFINES, 1): lambda: Chance(52, large=3),
        },
    ),
)
valid(
    "shapes-in-one-level",
    "shapes at the last level alone, of pieces that begin there",
    lambda: Plant(
        [Stem(-1, 2), Stem(0, 2, 1, WHOLE), Stem(1, 2, 1)],
        2,
        scripts={(rules.SHAPES, 2, 0): [2, *row((1, 0, 0)), *row((0, 1, 1))], (rules.STEMS, 2): lambda: Chance(53)},
    ),
)
valid(
    "corrections",
    "corrections on the last level: blocks of 8 frames, the last of 2, and vertices that have none",
    lambda: Plant([Stem(-1, 6)], 18, scripts={(rules.CORRECTIONS, 1): lambda: Chance(54)}),
)
valid(
    "corrections-footprints",
    "corrections of all widths that overlap, are cut off at both ends of a segment, and sum up to 0 in a frame",
    lambda: Plant(
        [Stem(-1, 2)],
        5,
        scripts={
            (rules.CORRECTIONS, 1): [
                *(1, 1, *(1, 1), *(1, 0, 3), 0, 0, 0, 0, 0, 1, *(1, 1), *(1, 1, 3), 0, 0),  # 4 and -4 along x
                *(1, 0, 1, *(1, 0), 0, *(1, 0, 0), 0, 1, 0, 0, 0, *(1, 1), 0, 0),  # 1 along y, -2 along z
            ]
        },
    ),
)
valid(
    "corrections-wide",
    "corrections of binary64 positions",
    lambda: Plant(
        FORK, 3, is_float64=True, origin=(0.1, 0.2, 0.3), scripts={(rules.CORRECTIONS, 2): lambda: Chance(55)}
    ),
)
valid(
    "corrections-none",
    "a CORRECTIONS chunk that corrects nothing, in one of two segments",
    lambda: Plant(FORK, 3, 2, scripts={(rules.CORRECTIONS, 2, 1): []}),
)
valid(
    "corrections-to-infinity",
    "a Correction_Step at the end of binary32",
    lambda: (
        Plant(FORK, 2, scripts={(rules.CORRECTIONS, 2): lambda: Chance(56)})
        .draft()
        .change(
            rules.CORRECTIONS,
            2,
            content=struct.pack("<f", FLOAT_MAX)
            + Plant(FORK, 2, scripts={(rules.CORRECTIONS, 2): lambda: Chance(56)})
            .draft()
            .content(rules.CORRECTIONS, 2)[4:],
        )
    ),
)
NOT_A_NUMBER = [Stem(-1, 3), Stem(0, 2, 2), Stem(1, 1, 1, SHEET)]
valid(
    "not-a-number",
    "vertices at NaN, others hang on them",
    lambda: Plant(
        NOT_A_NUMBER,
        2,
        heads={level: stems_head(FLOAT_MAX, 1) for level in range(4)},
        rest=exact_rest(NOT_A_NUMBER, (1e200 * np.array(grown(NOT_A_NUMBER, 4))).ravel().tolist(), True),
        scripts={
            (rules.STEMS, level): lambda level=level: Chance(57 + level, empty=0.1, large=25) for level in range(4)
        },
    ),
)

# ---- valid: chunks that are skipped ------------------------------------------------------------------------

FUTURE = b"from the future"
valid(
    "unknown-optional",
    "optional kinds that are not known, in every place where they may stand, some twice",
    lambda: fork().add(
        Entry(0x8000, FUTURE),
        Entry(0x8009, FUTURE),
        Entry(0x800F, b""),
        Entry(0x8018, FUTURE, 0, 1),
        Entry(0x8018, FUTURE, 1, 1),
        Entry(0x801F, FUTURE, 1, 1),
        Entry(0x801F, b"", 2, 0),
        Entry(0x8022, FUTURE),
        Entry(0x8022, FUTURE),
        Entry(0xFFFF, FUTURE),
        Entry(0xFFFF, b""),
    ),
)
valid(
    "unknown-optional-damaged",
    "what is skipped is not read: its Checksum does not fit",
    lambda: fork().add(Entry(0x8009, FUTURE, checksum=0), Entry(0x8064, FUTURE, checksum=0)),
)

valid(
    "minor-later",
    "a later minor version, whose optional kinds are not known",
    lambda: fork().with_header(minor=255).add(Entry(0x8009, FUTURE), Entry(0x8018, FUTURE, 0, 1)),
)

# ---- zstd frames and static data ---------------------------------------------------------------------------


def frame(
    content: bytes,
    *,
    stated: int | None = -1,
    single_segment: bool = True,
    window: int = 0,
    checksum: int | None = -1,
    dictionary: int | None = None,
    reserved: int = 0,
    blocks: bytes | None = None,
) -> bytes:
    """A zstd frame (RFC 8878) of raw blocks, or of `blocks`. -1: the true value; None: left out.

    window: the byte Window_Descriptor, where there is no single segment."""
    size = len(content) if stated == -1 else stated
    flags = reserved << 3 | (checksum is not None) << 2 | single_segment << 5
    flags |= (3 << 6 if size is not None else 0) | (1 if dictionary is not None else 0)
    out = ZSTD_MAGIC + bytes([flags]) + (b"" if single_segment else bytes([window]))
    out += bytes([dictionary]) if dictionary is not None else b""
    out += struct.pack("<Q", size) if size is not None else b""
    out += raw_block(content, True) if blocks is None else blocks
    if checksum is not None:
        right = zstandard.ZstdCompressor(write_checksum=True).compress(content)[-4:]
        out += right if checksum == -1 else struct.pack("<I", checksum)
    return out


def raw_block(content: bytes, last: bool) -> bytes:
    return struct.pack("<I", len(content) << 3 | last)[:3] + content


def run_block(byte: bytes, count: int, last: bool) -> bytes:
    """A repeated byte."""
    return struct.pack("<I", count << 3 | 1 << 1 | last)[:3] + byte


def zeros(count: int) -> bytes:
    """Blocks of zeros, at most 128 KiB each."""
    sizes = [1 << 17] * (count >> 17) + ([count & (1 << 17) - 1] if count & (1 << 17) - 1 else [])
    return b"".join(run_block(b"\0", size, i == len(sizes) - 1) for i, size in enumerate(sizes))


def plain(content: bytes) -> bytes:
    """The simplest frame."""
    return frame(content, checksum=None)


def shuffled(array: np.ndarray) -> bytes:
    return np.frombuffer(array.tobytes(), np.uint8).reshape(-1, array.dtype.itemsize).T.tobytes()


def item_type(name: str) -> tuple[int, int]:
    """Item_Type and Item_Bytes of a type as NumPy writes it."""
    return "buifcSV".index(name[1]) | 8 * (name[0] == ">"), int(name[2:])


def array_chunk(
    type_: str | tuple[int, int], shape: Sequence[int], body: bytes = b"", name: str | bytes = "a"
) -> bytes:
    """type_: as NumPy writes it, or Item_Type and Item_Bytes."""
    code, size = item_type(type_) if isinstance(type_, str) else type_
    text = name.encode() if isinstance(name, str) else name
    return struct.pack(f"<BBHI{len(shape)}I", code, len(shape), len(text), size, *shape) + text + body


def numbers(array: np.ndarray, type_: str | None = None, name: str = "a") -> bytes:
    return array_chunk(type_ or array.dtype.str, array.shape, plain(shuffled(array)) if array.size else b"", name)


def polygon_type(name: str) -> int:
    """A type of integers as FACES and EDGES number them."""
    return "1248".index(name[2]) | 4 * (name[1] == "i") | 8 * (name[0] == ">")


def polygon_head(type_: str, faces: int, corners: int, count_type: str | None = None, flags: int = 0) -> bytes:
    """corners: of each face, or where there is a count_type of all."""
    mixed = b"" if count_type is None else bytes([polygon_type(count_type)])
    return bytes([polygon_type(type_) | flags | 16 * len(mixed)]) + mixed + struct.pack("<II", faces, corners)


def polygon_shape(
    index_type: int, count_type: int | None, is_absolute: bool, face_count: int, columns: int, corner_count: int
):
    """Head of FACES or EDGES."""
    return rules.Record(
        index_type=index_type,
        count_type=count_type,
        is_absolute=is_absolute,
        is_derived=False,
        face_count=face_count,
        columns=columns,
        corner_count=corner_count,
    )


def polygons(rows: np.ndarray, vertex_count: int = 5, absolute: bool = False, script: Script | None = None) -> bytes:
    """FACES or EDGES with as many corners each."""
    shape = polygon_shape(polygon_type(rows.dtype.str), None, absolute, *rows.shape, rows.size)
    stream = write(rules.decode_polygons, script or rows.reshape(-1).tolist(), shape, vertex_count)
    return polygon_head(rows.dtype.str, *rows.shape, flags=32 * absolute) + stream


def mixed_polygons(
    faces: list[list[int]],
    vertex_count: int = 5,
    types: tuple[str, str] = ("<u4", "|u1"),
    corner_count: int | None = None,
    absolute: bool = False,
) -> bytes:
    """FACES of different sizes; types: of vertices and numbers of corners."""
    corners = sum(map(len, faces)) if corner_count is None else corner_count
    index_type, count_type = map(polygon_type, types)
    shape = polygon_shape(index_type, count_type, absolute, len(faces), 0, corners)
    script = [value for face in faces for value in (len(face), *face)]
    return polygon_head(types[0], len(faces), corners, types[1], 32 * absolute) + write(
        rules.decode_polygons, script, shape, vertex_count
    )


def derived(type_: str) -> bytes:
    return bytes([polygon_type(type_) | 64])


def element(type_: str, content: bytes, name: str = "a") -> bytes:
    """A single element of any type."""
    return array_chunk(type_, (), plain(content), name)


def with_static(*entries: tuple[int, bytes]) -> Draft:
    return fork().add(*(Entry(kind, content) for kind, content in entries))


def metadata(text: bytes | str, method: int = 0) -> Draft:
    return with_static((rules.METADATA, bytes([method]) + (text if isinstance(text, bytes) else text.encode())))


def attributes(*contents: bytes) -> Draft:
    return with_static(*((rules.ATTRIBUTE, content) for content in contents))


# A text of 456 bytes compressed by zstd 1.5 at level 19: literals with a Huffman table, sequences with FSE tables.
WIND_FRAME = bytes.fromhex(
    "28b52ffd60c800ad020022451011a0ed1eed626666b605a3aadb6d42a28a6b759b222fa48e0e364efd01138aae2035fb"
    "a691439684d741439ee7d467ee9d9ba6e65e2cb76b7bb06c2fb6558b4b0305004e05f0d550b2ea0815558a6bb10205"
)

FACES_3 = np.array([[0, 1, 2], [2, 1, 4]], "<u2")
EDGES_2 = np.array([[0, 1], [4, 3]], "<i8")

valid(
    "metadata-plain",
    "METADATA as plain text, with white space around it",
    lambda: metadata('\t\r\n {"unit": "m", "up_axis": "y", "more": [1, -0, 2.5e-3, true, false, null]} \n'),
)
valid("metadata-zstd", "METADATA in a zstd frame of compressed blocks", lambda: metadata(WIND_FRAME, 1))
valid("metadata-empty", "an object without members", lambda: metadata("{}"))
valid(
    "metadata-escapes",
    "escapes, surrogate pairs and text beyond ASCII; the members differ",
    lambda: metadata(
        '{"\\u0061\\n\\"": "\\ud83c\\udf33", "\u00e9": "\U0001f333\\/", "": {"a": 1, "A": 1}, "\\u0000": ""}'
    ),
)
valid("metadata-long-integer", "an integer of 4300 digits", lambda: metadata('{"n": -' + "9" * 4300 + "}"))
valid("metadata-nested", "100 levels of nesting", lambda: metadata('{"a":' * 50 + "[" * 50 + "]" * 50 + "}" * 50))
valid(
    "metadata-numbers",
    "numbers at the ends of binary64, and below them",
    lambda: metadata(
        '{"a": [1.7976931348623157e308, -1.797693134862315807e+308, 1e-400, 0e99999, 1E0, '
        "123456789012345678901234567890]}"
    ),
)
valid(
    "faces-and-edges",
    "triangles and edges, in integers of different sizes",
    lambda: with_static((rules.FACES, polygons(FACES_3)), (rules.EDGES, polygons(EDGES_2))),
)
valid(
    "faces-of-any-width",
    "faces of five columns, big-endian",
    lambda: with_static((rules.FACES, polygons(np.array([[4, 3, 2, 1, 0]], ">i4")))),
)
valid(
    "faces-none",
    "no faces: three columns, no rows, no data; edges without rows likewise",
    lambda: with_static(
        (rules.FACES, polygons(np.zeros((0, 3), "|u1"))), (rules.EDGES, polygons(np.zeros((0, 2), "<u4")))
    ),
)
valid(
    "edges-derived",
    "edges that the hierarchy implies, as big-endian numbers, in a file with permutations",
    lambda: (
        moving([Stem(-1, 3), Stem(0, 2, 1), Stem(-1, 1)], 61, vertex_source=[5, 0, 3, 1, 4, 2])
        .draft()
        .add(Entry(rules.EDGES, derived(">i2")))
    ),
)
valid(
    "edges-derived-least",
    "as numbers of one byte; of one vertex there are none",
    lambda: lone().draft().add(Entry(rules.EDGES, derived("|i1"))),
)
MANY_FACES = {  # of 119 vertices: those of ADAPTIVE
    "by chance": lambda: polygons(np.zeros((150, 3), "<i2"), 120, script=Chance(71)),
    "absolute": lambda: polygons(np.zeros((60, 4), "<u4"), 120, True, Chance(72)),
    "strip": lambda: polygons(np.array([[i, i + 1, i + 2] for i in range(118)], "<i4"), 120),
    "quads": lambda: polygons(np.array([[i, i + 1, i + 11, i + 10] for i in range(109)], "<i8"), 120),
    "mixed": lambda: mixed_polygons(
        [[(7 * i + k * k) % 120 for k in range((3, 4, 3, 5, 0, 1, 4, 2, 40)[i % 9])] for i in range(60)], 120
    ),
}
valid(
    "faces-mixed",
    "faces of 3, 4, 0, 1, 2 and 5 corners, numbers of one byte and of eight",
    lambda: with_static(
        (rules.FACES, mixed_polygons([[0, 1, 2], [3, 2, 1, 0], [], [4], [4, 3], [0, 1, 2, 3, 4]], types=(">i8", "|i1")))
    ),
)
valid(
    "faces-mixed-alike",
    "faces that could be of different sizes, but are triangles; attributes behind them",
    lambda: with_static((rules.FACES, mixed_polygons([[0, 1, 2], [2, 1, 4]]))).add(
        Entry(rules.ATTRIBUTE, numbers(np.arange(5.0), name="radius"))
    ),
)
valid("faces-mixed-none", "no faces of different sizes", lambda: with_static((rules.FACES, mixed_polygons([]))))
for name_, make_faces in MANY_FACES.items():
    valid(
        f"faces-many-{name_.replace(' ', '-')}",
        f"faces of 120 vertices: {name_}",
        lambda make_faces=make_faces: (
            with_rest(ADAPTIVE, adaptive_rest(ADAPTIVE, [])).draft().add(Entry(rules.FACES, make_faces()))
        ),
    )


def connected(
    make_faces: Callable[[], bytes], seed: int = 73, step: float = 0.25, exact: bool = False, order: list | None = None
) -> Plant:
    """ADAPTIVE, by faces."""
    content, branches = make_faces(), branches_of(ADAPTIVE)
    shape, stream = rules.parse_polygons(content, rules.FACES)
    count = sum(stem.count for stem in ADAPTIVE)
    mesh = rules.build_mesh(*rules.decode_polygons(stream, shape, count), order or list(range(count)))
    script, bits = Chance(seed, large=6), REST_CONNECTED >> 2
    if exact:
        stream = write(rules.decode_exact_rest, script, branches, False, mesh)
        rest = rest_chunk(stream, exact=1, reserved=bits)
    else:
        stream = write(rules.decode_rest, script, branches, step, None, True, mesh)
        rest = rest_chunk(stream, step=step, reserved=bits | REST_ADAPTIVE >> 2)
    fields = {} if order is None else {"vertex_source": order}
    return with_rest(ADAPTIVE, rest, faces=content, **fields)


for name_, make_faces in MANY_FACES.items():
    valid(
        f"rest-connected-{name_.replace(' ', '-')}",
        f"a rest pose by faces: {name_}",
        lambda make_faces=make_faces: connected(make_faces),
    )
valid(
    "rest-connected-order",
    "a rest pose by faces of vertices that stand the other way round",
    lambda: connected(MANY_FACES["strip"], order=list(range(119, -1, -1))),
)
valid("rest-connected-tiny", "the same, a subnormal Rest_Step", lambda: connected(MANY_FACES["strip"], 74, FLOAT_TINY))
valid("rest-connected-exact", "an exact rest pose by faces", lambda: connected(MANY_FACES["quads"], exact=True))
valid(
    "rest-connected-none", "a rest pose by no faces", lambda: connected(lambda: polygons(np.zeros((0, 3), "<u2"), 120))
)
valid(
    "attributes",
    "named arrays: a name beyond ASCII, booleans, no dimensions",
    lambda: attributes(
        numbers(np.linspace(0, 1, 5).astype("<f4"), name="radius"),
        numbers(np.array([0, 1, 2, 255], "|u1"), "|b1", "\U0001f333 ?"),
        numbers(np.array(2.5, "<f8"), name=" "),
    ),
)
valid(
    "attribute-types",
    "one element of every type",
    lambda: attributes(
        *(
            element(name, bytes(range(1, 1 + int(name[2:]))), name)
            for name in (
                *("|b1", "|u1", "|i1", "<i2", ">u2", "<u4", ">i4", "<i8", ">u8"),
                *("<f2", ">f2", ">f4", "<f8", "<c8", ">c16", "|S3", "|V5"),
            )
        )
    ),
)
valid(
    "attribute-shuffled",
    "planes of bytes of texts of 7 bytes, 3 elements",
    lambda: attributes(array_chunk("|S7", (3,), plain(bytes(range(21))))),
)
valid(
    "attribute-empty",
    "no elements and no data; sizes of 0 count as 1 against the limit",
    lambda: attributes(array_chunk("<f4", (0, 1 << 20, 1 << 6))),
)
valid(
    "attribute-32-dimensions",
    "as many dimensions as there can be",
    lambda: attributes(array_chunk("<u2", [1] * 31 + [2], plain(b"abcd"))),
)
valid(
    "attribute-element-largest",
    "an element of 2^20 bytes",
    lambda: attributes(array_chunk("|V1048576", (), frame(bytes(1 << 20), checksum=None, blocks=zeros(1 << 20)))),
)
valid(
    "attribute-name-longest", "a name of 4096 bytes", lambda: attributes(numbers(np.zeros(1, "|u1"), name="n" * 4096))
)
valid(
    "attributes-256",
    "as many attributes as there can be",
    lambda: lone().draft().add(*(Entry(rules.ATTRIBUTE, element("|u1", bytes([i]), str(i))) for i in range(256))),
)
valid("zstd-checksum", "a frame with a Content_Checksum", lambda: attributes(array_chunk("|u1", (5,), frame(b"plant"))))
valid(
    "zstd-blocks",
    "raw, repeated and empty blocks, a frame with a window",
    lambda: attributes(
        array_chunk(
            "|u1",
            (9,),
            frame(
                b"abaaaaaaa",
                checksum=None,
                single_segment=False,
                window=0,
                blocks=raw_block(b"ab", False) + run_block(b"a", 7, False) + raw_block(b"", True),
            ),
        )
    ),
)
valid(
    "zstd-window-8-mib",
    "a window of 8 MiB, the largest that small arrays may ask for",
    lambda: attributes(array_chunk("|u1", (5,), frame(b"plant", checksum=None, single_segment=False, window=13 << 3))),
)
valid(
    "zstd-window-of-array",
    "a window of 9 MiB where the array has 9 MiB",
    lambda: attributes(array_chunk("|u1", (9 << 20,), frame(bytes(9 << 20), checksum=None, blocks=zeros(9 << 20)))),
)
valid(
    "zstd-dictionary-0",
    "Dictionary_ID 0 is none",
    lambda: attributes(array_chunk("|u1", (5,), frame(b"plant", checksum=None, dictionary=0))),
)


# ---- valid: everything at once, and what the encoder writes ------------------------------------------------


EVERYTHING = [
    Stem(-1, 6, lag=1),
    Stem(0, 1, 3, lag=2),
    Stem(0, 66, 5, LOOSE),
    Stem(2, 5, 60, SHEET | LOOSE),
    Stem(3, 3, 0, LOOSE),
    Stem(2, 4, 1, WHOLE, lag=0),
    Stem(5, 4, 3, SHEET, lag=0),
    Stem(-1, 7, 0, SHEET),
    Stem(7, 2, 3, SHEET | WHOLE),
    Stem(7, 5, 6, SHEET, lag=0),
    Stem(7, 4, 1),
    Stem(10, 2, 2),
    Stem(-1, 1, 0, WHOLE),
    Stem(12, 2),
    Stem(12, 3, 0, LOOSE),
    Stem(-1, 3),
    Stem(15, 3, 2, LOOSE | WHOLE),
    Stem(16, 2, 1, LOOSE),
]


def basis_by_chance(random: np.random.Generator, rank: int, frames: int, bits: int) -> bytes:
    most = 1 << bits - 1
    return basis_stream(random.integers(-most, most + 1, (rank, frames)).tolist(), bits)


def everything() -> Draft:
    random = np.random.default_rng(99)
    vertices = sum(stem.count for stem in EVERYTHING)
    bases = {
        level: stems_head(0.03 + 0.01 * level, level % 5, bits, rank, basis_by_chance(random, rank, 5, bits))
        for level, bits, rank in ((1, 11, 3), (2, 8, 1), (4, 16, 5))
    }
    plant = Plant(
        EVERYTHING,
        clips=(loop(Clip(5, 1, "up"), 0.5, 0.4, 0.3, 0.2, 0.1, 0.05, 0.0), Clip(5, 1, "down")),
        rest=coded_rest(EVERYTHING, Chance(71), rest_type=1, origin=(10.0, -3.5, 0.25), step=0.01),
        source_rest=bent(EVERYTHING, Chance(93, large=9)),
        time=uneven_time(*random.random((2, 5)).cumsum(axis=1).ravel().tolist()),
        branch_source=random.permutation(len(EVERYTHING)).tolist(),
        vertex_source=random.permutation(vertices).tolist(),
        is_float64=True,
        layers=2,
        heads=HEADS | bases | {5: stems_head(0.01, 3)},
        scripts={(rules.STEMS, level): lambda level=level: Chance(72 + level) for level in range(6)}
        | {(rules.AFFINES, level): lambda level=level: Chance(80 + level, large=3) for level in range(5)}
        | {(rules.CORRECTIONS, level): lambda level=level: Chance(86 + level) for level in (4, 5)}
        | {(rules.REFINED_REST, 5, 0): lambda: Chance(92, large=4)}
        | {
            (rules.SHAPES, 1, 0): [
                2,
                *row((1, 2, -3), (0, 0, 9)),
                *row((5, 0, 0)),
                1,
                *row((3, 1, 4)),
                0,
                0,
                9,
                *(n for i in range(9) for n in row((i, 1, -i), (0, 2, 0))),
            ],
            (rules.SHAPES, 2, 0): [1, *row((0, 1, 0)), 0, 2, *row((1, 0, 0), (0, 0, 1)), *row((0, 0, 8))],
            (rules.SHAPES, 5, 0): [2, *refined_row((0, -1, 0)), *refined_row((3, 0, 0), (0, 0, -1))],
        },
    )
    return (
        plant.draft()
        .with_header(level_count=7, full_level_count=7)
        .add(
            Entry(rules.EXACT, b"", 6, 0),
            Entry(rules.EXACT, b"", 6, 1),
            Entry(rules.METADATA, b"\1" + WIND_FRAME),
            Entry(rules.FACES, polygons(FACES_3)),
            Entry(rules.EDGES, derived("<i2")),
            Entry(0x8009, FUTURE),
            Entry(0x8018, FUTURE, 1, 1),
            Entry(rules.ATTRIBUTE, numbers(np.arange(6.0).reshape(2, 3), name="b")),
            Entry(rules.ATTRIBUTE, element("|S3", b"oak", "a")),
            Entry(0x8040, FUTURE),
        )
    )


valid("everything", "every kind of chunk, flag, method and stream in one file", everything)


def encoded(name: str) -> bytes:
    """A small plant encoded by athcodec."""
    import athcodec
    from athcodec.clip import MotionClip

    stems = {
        "encoded-tree": [Stem(-1, 9), Stem(0, 6, 4), Stem(1, 5, 3), Stem(0, 5, 8), Stem(3, 3, 2)],
        "encoded-wide": [Stem(-1, 5), Stem(0, 4, 3)],
        "encoded-exact-rest": [Stem(-1, 4), Stem(0, 3, 1), Stem(-1, 2)],
        "encoded-noise": [Stem(-1, 4), Stem(0, 3, 2)],
        "encoded-clips": [Stem(-1, 4), Stem(0, 3, 2)],
        "encoded-lossless": [Stem(-1, 4), Stem(0, 3, 1)],
        "encoded-lossless-wide": [Stem(-1, 3), Stem(0, 2, 1)],
        "encoded-layers": [Stem(-1, 9), Stem(0, 6, 4), Stem(1, 5, 3), Stem(0, 5, 8), Stem(3, 3, 2)],
        "encoded-layers-lossless": [Stem(-1, 4), Stem(0, 3, 1)],
    }[name]
    random = np.random.default_rng(7)
    rest = np.array(grown(stems, 7)) * 0.1
    lift = np.linalg.norm(rest - rest[0], axis=1)[:, None]
    swing = np.sin(np.linspace(0, 6, 40)[:, None, None] * [1.0, 2.0, 3.0] + 2 * lift) * lift**2 * 0.05
    noise = random.normal(size=(40, *rest.shape)) * (0.1 if name == "encoded-noise" else 1e-4)
    clip = MotionClip(
        positions=(rest + swing + noise).astype(np.float64 if "wide" in name else np.float32),
        rest=rest,
        time=np.arange(40) / 30,
        vertex_branch=np.repeat(np.arange(len(stems)), [s.count for s in stems]),
        branch_parent=np.array([s.parent for s in stems]),
        metadata={"unit": "m"},
    )
    if name == "encoded-clips":
        clip = athcodec.join({"whole": clip, "loop": athcodec.looped(clip, blend=9)})
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "clip.ath"
        athcodec.encode(
            clip,
            target,
            rel_error=2e-3,
            segment_frames=20,
            ladder=(1e-1, 2e-2) if "layers" in name else (),
            exact_rest=name == "encoded-exact-rest",
            lossless="lossless" in name,
        )
        return target.read_bytes()


for name, why in (
    ("encoded-tree", "a small tree in wind"),
    ("encoded-wide", "binary64 positions"),
    ("encoded-exact-rest", "a rest pose bit for bit"),
    ("encoded-noise", "vertices that follow no plant"),
    ("encoded-clips", "two clips, one of them a loop"),
    ("encoded-lossless", "every bit of the source at the last level"),
    ("encoded-lossless-wide", "every bit of binary64 positions at the last level"),
    ("encoded-layers", "three layers of precision"),
    ("encoded-layers-lossless", "three layers of precision, then every bit of the source"),
):
    valid(name, f"what athcodec wrote: {why}", lambda name=name: encoded(name), scripted=False)


# ---- valid: layers -----------------------------------------------------------------------------------------


def layered(layers: int = 3, *left_out: tuple, **fields) -> Plant:
    """The fork, which is level 0 to 2, and refinements with everything that they may have; `left_out`: scripts."""
    more = {"scripts": {}} | fields
    scripts = forked().scripts | {
        (rules.SHAPES, 3, 0): [
            3,
            *refined_row((1, 0, -2), (0, 3, 0)),
            0,
            *refined_row((0, 0, 5)),
            1,
            *refined_row((2, 0, 0)),
        ],
        (rules.SHAPES, 4, 0): [2, *refined_row((-1, 1, 0), (0, 0, 7), (1, 0, 0)), *refined_row((0, 0, 1)), 0],
    }
    for q in range(1, layers):
        scripts |= {
            (rules.STEMS, 2 + q): lambda q=q: Chance(10 + q),
            (rules.CORRECTIONS, 2 + q): lambda q=q: Chance(20 + q),
            (rules.REFINED_REST, 2 + q, 0): lambda q=q: Chance(30 + q, large=4),
        }
    scripts = {place: script for place, script in scripts.items() if place not in left_out}
    return forked(**{"layers": layers, "heads": LAYER_HEADS} | more | {"scripts": scripts | more["scripts"]})


valid(
    "source-rest-layers",
    "a rest pose about the reference poses of all layers",
    lambda: layered(source_rest=bent(FORK, Chance(207, large=9))),
)

SHARED_BASES = {
    1: stems_head(0.5, 1, 8, 1, basis_stream([[77, -90]], 8)),
    2: stems_head(0.5, 2, 9, 1, base=1),
    3: stems_head(0.125, 3, 10, 2, basis_stream([[-300, 512]], 10), base=2),
    4: stems_head(0.03125, 4, 8, 2, base=3),
}
LAYER_HEADS = {level: stems_head(0.5 / 4 ** max(level - 2, 0), level % 5) for level in range(12)}
MIXED = [
    Stem(-1, 4),
    Stem(0, 3, 2, SHEET),
    Stem(1, 2, 1, LOOSE),
    Stem(0, 70, 3),
    Stem(3, 5, 66, SHEET | LOOSE),
    Stem(-1, 6, 0, SHEET),
    Stem(5, 3, 4, WHOLE),
    Stem(6, 2, 1),
]
BEAMS = [
    Stem(-1, 36, lag=0),
    Stem(0, 5, 20, lag=0),
    Stem(0, 1, 35, lag=0),
    Stem(0, 40, 7, SHEET, lag=2),
    Stem(-1, 1, lag=0),
]


def refinements(stems: list[Stem], seed: int, large: int = 12, **fields) -> Plant:
    """Three layers of random rows and rest poses."""
    plant = moving(stems, seed, **{"layers": 3, "heads": LAYER_HEADS} | fields)
    plant.scripts |= {
        (rules.STEMS, level): lambda level=level: Chance(100 * seed + level, large=large) for level in range(40)
    }
    plant.scripts |= {
        (rules.REFINED_REST, level, 0): lambda level=level: Chance(100 * seed + level + 70, large=6)
        for level in range(2, 40)
    }
    return plant


LEVEL_1_REST = {(rules.REFINED_REST, 1, 0): lambda: Chance(81, large=4)}


def rest_by_level(stems: list[Stem], seed: int, **fields) -> Plant:
    """The same, with a rest pose of level 0 alone."""
    plant = refinements(stems, seed, **fields)
    plant.scripts |= LEVEL_1_REST
    return plant


def learned(*levels: int) -> dict:
    """Heads with learned time bases for some levels, in segments of two frames."""
    random = np.random.default_rng(5)
    return LAYER_HEADS | {
        level: stems_head(
            0.5 / 4 ** max(level - 2, 0), level % 5, 10, 1 + level % 2, basis_by_chance(random, 1 + level % 2, 2, 10)
        )
        for level in levels
    }


def lossless_layers() -> Draft:
    """An additional last level with empty streams."""
    return (
        layered()
        .draft()
        .with_header(level_count=6, full_level_count=6)
        .add(Entry(rules.EXACT, b"", 5, 0), Entry(rules.EXACT, b"", 5, 1))
    )


valid("layers-smallest", "one vertex in two layers, all of it empty", lone(layers=2))
valid("layers-eight", "as many layers as there may be", refinements([Stem(-1, 2), Stem(0, 2, 1)], 31, layers=8))
valid(
    "layers-two",
    "a refinement of motion alone: the rest pose is that of the layer before, and no piece has shapes",
    layered(2, (rules.REFINED_REST, 3, 0), (rules.SHAPES, 3, 0), (rules.CORRECTIONS, 3)),
)
valid("layers-three", "refinements with REFINED_REST, SHAPES and CORRECTIONS", layered())
valid(
    "layers-rest-of-last",
    "the second refinement refines the rest pose of the layer before the one before",
    layered(3, (rules.REFINED_REST, 3, 0)),
)
valid(
    "layers-rest-of-first",
    "the second refinement has the rest pose of the first",
    layered(3, (rules.REFINED_REST, 4, 0)),
)
valid("layers-shapes-of-last", "shapes in a refinement alone", layered(3, (rules.SHAPES, 1, 0), (rules.SHAPES, 3, 0)))
valid(
    "layers-shapes-of-first", "shapes in the first layer alone", layered(3, (rules.SHAPES, 3, 0), (rules.SHAPES, 4, 0))
)
valid(
    "layers-learned-first",
    "learned time bases in the first layer: predictions in waves are of all frequencies",
    layered(heads=learned(1, 2)),
)
valid("layers-learned-one", "a learned time basis in one refinement", layered(heads=learned(3)))
valid(
    "layers-learned-low",
    "a learned time basis of a level that holds the first modes of a piece",
    layered(heads=learned(1)),
)
valid("layers-learned-all", "learned time bases in all layers", layered(heads=learned(1, 2, 3, 4)))
valid(
    "layers-learned-shared",
    "learned time bases that begin with those of earlier layers: some with further rows, one of other bits",
    layered(heads=LAYER_HEADS | SHARED_BASES),
)
valid(
    "layers-learned-apart",
    "two roots of learned time bases: predictions of pieces of level 1 alone are of all frequencies",
    layered(heads=LAYER_HEADS | SHARED_BASES | {2: stems_head(0.5, 2, 8, 1, basis_stream([[3, 99]], 8))}),
)
valid(
    "layers-tips",
    "rotations of tips alone, in all layers",
    refinements(
        MIXED, 36, heads={level: stems_head(0.5 / 4 ** max(level - 2, 0), 8 | level % 5) for level in range(12)}
    ),
)
RIGID = [replace(stem, rigid=q % 4, detail=q % 3 * 120) for q, stem in enumerate(MIXED)]
valid("rigid", "branches that move as they are: alone, with others on them, loose", refinements(RIGID, 38, layers=1))
valid(
    "rigid-turn",
    "the same with a largest step of rotations",
    refinements(RIGID, 39, layers=1, default_head=stems_head(0.5, 161)),
)
valid(
    "layers-rigid",
    "branches that move as they are in the first layers",
    refinements(
        RIGID,
        40,
        heads={level: stems_head(0.5 / 4 ** max(level - 2, 0), 16 * level | level % 5) for level in range(12)},
    ),
)
TUBES = [
    Stem(-1, 13, 0, SHEET, lag=4, ring=4),
    Stem(0, 70, 5, SHEET, lag=6, ring=6),
    Stem(1, 8, 69, SHEET | LOOSE, ring=2),
    Stem(1, 5, 30),
    Stem(0, 62, 3, SHEET, ring=30),
    Stem(0, 20, 1, SHEET, ring=32),
    Stem(-1, 9, 0, SHEET, rigid=1, ring=3),
    Stem(6, 12, 4, SHEET | WHOLE, ring=3),
    Stem(7, 6, 2, SHEET, ring=2),
]
valid(
    "tubes",
    "tubes: with a tip, of two pieces, loose, of a ring that is none, rigid, and what hangs on them",
    refinements(TUBES, 41, layers=1),
)
valid("layers-tubes", "the same in layers", refinements(TUBES, 42, frames=9, segments=2))
valid(
    "layers-mixed",
    "rotations, loose stems, sheets, a stem of two pieces and a subtree that is whole",
    refinements(MIXED, 32, frames=9, segments=2),
)
valid(
    "layers-still",
    "refinements whose rows are all predictions",
    layered(
        scripts={
            (rules.STEMS, 3): [],
            (rules.STEMS, 4): [],
            (rules.REFINED_REST, 3, 0): [],
            (rules.REFINED_REST, 4, 0): [],
        }
    ),
)
valid(
    "layers-beams",
    "runs of beams, some of two, and steps, in all rest poses",
    refinements(BEAMS, 33, rest=coded_rest(BEAMS, Chance(61, large=4))),
)
valid("layers-large", "large integers in all streams", refinements(MIXED[:3], 34, large=29, frames=5, is_float64=True))
valid(
    "layers-ratio-1",
    "Ratio 1",
    refinements(
        MIXED[:3],
        35,
        frames=5,
        ratio=1,
        heads=learned(2) | {3: stems_head(0.5, 1), 4: stems_head(0.5, 1)},
        segments=2,
        clips=(Clip(2, 1, "a"), Clip(2, 1, "b")),
    ),
)
valid("layers-ratio-largest", "Ratio 65535", layered(ratio=65535, heads=learned(1, 2)))
valid(
    "layers-shift-15",
    "Shift 15: what it takes beyond 30 bits is kept there",
    layered(
        shift=15,
        scripts={(rules.SHAPES, 1, 0): [2, *row((1 << 20, 0, -(1 << 14)), (0, -(1 << 29), 0)), *row((0, 0, 1)), 0]},
    ),
)
valid(
    "layers-exact-rest",
    "refinements of an exact rest pose",
    layered(
        3,
        (rules.REFINED_REST, 3, 0),
        (rules.REFINED_REST, 4, 0),
        rest=exact_rest(FORK, [float(i * i % 7) for i in range(15)], False),
    ),
)
valid("layers-wide", "binary64 positions", layered(is_float64=True))
valid(
    "layers-clips",
    "two clips, one of them a loop",
    layered(clips=(loop(Clip(3, 1, "up"), 0.5, 0.4, 0.3, 0.2, 0.1), Clip(2, 1, "down"))),
)
valid(
    "layers-periodic",
    "two clips, one of them periodic",
    layered(clips=(periodic(Clip(3, 1, "up"), 0.5, 0.4, 0.3, 0.2, 0.1), Clip(2, 1, "down"))),
)
valid("layers-lossless", "EXACT behind three layers", lossless_layers)
for level_ in range(5):
    valid(
        f"layers-upto-{level_}",
        f"three layers, shortened after level {level_}",
        lambda level=level_: layered().draft().upto(level),
    )
valid("rest-of-level-1", "level 1 refines the rest pose, and so do the refinements", layered(scripts=LEVEL_1_REST))
valid(
    "rest-of-level-1-alone",
    "level 1 refines the rest pose, which the refinements have, too",
    layered(3, (rules.REFINED_REST, 3, 0), (rules.REFINED_REST, 4, 0), scripts=LEVEL_1_REST),
)
for level_ in range(4):
    valid(
        f"rest-of-level-1-upto-{level_}",
        f"level 1 refines the rest pose, and the file is shortened after level {level_}",
        lambda level=level_: layered(scripts=LEVEL_1_REST).draft().upto(level),
    )
valid(
    "rest-of-level-1-of-point",
    "the rest pose of level 0 is a point: its maps have no directions, those of level 1 have",
    rest_by_level([Stem(-1, 3), Stem(0, 2, 1), Stem(1, 2, 1)], 41, points=[(0, 0, 0)] * 7),
)
LOOSE_BEAMS = [*BEAMS[:3], Stem(0, 9, 30, LOOSE), Stem(-1, 70, lag=0)]
valid(
    "rest-of-level-1-beams",
    "runs of beams, loose stems, a root of two pieces and two roots",
    rest_by_level(
        LOOSE_BEAMS,
        42,
        rest=rest_chunk(write(rules.decode_rest, Chance(47, large=6), branches_of(LOOSE_BEAMS), 1.0), rest_type=1),
        frames=5,
        segments=2,
        is_float64=True,
    ),
)
valid(
    "rest-of-level-1-whole",
    "all that level 0 moves is shown exactly at level 1",
    rest_by_level([Stem(-1, 4, 0, WHOLE), Stem(0, 3, 2)], 43),
)
valid(
    "layers-adaptive-rest",
    "adaptive rest poses of all layers",
    refinements(ADAPTIVE, 46, rest=adaptive_rest(ADAPTIVE, Chance(38, large=4), 1.0)),
)
valid(
    "layers-connected-rest",
    "rest poses of all layers by faces",
    refinements(ADAPTIVE, 46, rest=connected(MANY_FACES["strip"]).rest, faces=MANY_FACES["strip"]()),
)
valid(
    "rest-of-level-1-adaptive",
    "adaptive rest poses by level",
    rest_by_level(BEAMS[:3], 47, rest=adaptive_rest(BEAMS[:3], Chance(39, large=4), 1.0)),
)
valid(
    "rest-of-level-1-still", "the chunk has no bytes in its stream", layered(scripts={(rules.REFINED_REST, 1, 0): []})
)

# ---- invalid: the header -----------------------------------------------------------------------------------


def header(name: str, error: str, reason: str, **fields) -> None:
    invalid(f"header-{name}", error, "open", reason, lambda: lone().draft().with_header(**fields))


def first_bytes(count: int, change: bytes = b"") -> bytes:
    data = lone().file()[:count]
    return data[: len(data) - len(change)] + change


invalid("empty", "NOT_AN_ATH_FILE", "open", "a file of no bytes", b"")
invalid(
    "magic-other",
    "NOT_AN_ATH_FILE",
    "open",
    "something else",
    b"PK\x03\x04 something else entirely, longer than a header would be",
)
invalid("magic-first-byte", "NOT_AN_ATH_FILE", "open", "one byte, not that of Magic", b"P")
header("magic-newline", "NOT_AN_ATH_FILE", "CR LF of Magic became LF on the way", magic=b"\x89ATH\n\x1a\n\x00")
header("magic-last-byte", "NOT_AN_ATH_FILE", "the last byte of Magic is another", magic=b"\x89ATH\r\n\x1a\r")
invalid("cut-in-magic", "TRUNCATED", "open", "three bytes, those of Magic", lambda: first_bytes(3))
invalid(
    "cut-before-version",
    "TRUNCATED",
    "open",
    "11 bytes: the versions are not all there, and not looked at",
    lambda: first_bytes(11, b"\xff\xff\xff"),
)
invalid(
    "cut-behind-version",
    "UNSUPPORTED_VERSION",
    "open",
    "12 bytes are enough to refuse a version",
    lambda: first_bytes(12, b"\xff\xff\xff\xff"),
)
invalid("cut-in-header", "TRUNCATED", "open", "23 bytes", lambda: first_bytes(23))
invalid("cut-in-front-stream", "TRUNCATED", "open", "ends inside the front stream", lambda: first_bytes(40))
invalid(
    "cut-in-checksums",
    "TRUNCATED",
    "open",
    "ends inside the checksums",
    lambda: first_bytes(rules.u32(lone().file(), 16) - 1),
)
header("major-0", "UNSUPPORTED_VERSION", "Major_Version 0: versions before the first", major=0)
header("major-2", "UNSUPPORTED_VERSION", "Major_Version 2, which is to come", major=2)
header("feature-first", "UNSUPPORTED_FEATURE", "the lowest bit of Features is set", features=1)
header(
    "feature-last",
    "UNSUPPORTED_FEATURE",
    "the highest bit of Features is set, in a later minor version",
    minor=9,
    features=1 << 15,
)
header(
    "feature-and-version",
    "UNSUPPORTED_VERSION",
    "what Features means is for the major version to say",
    major=2,
    features=1,
)
invalid(
    "cut-behind-features",
    "UNSUPPORTED_FEATURE",
    "open",
    "12 bytes are enough to refuse a feature",
    lambda: first_bytes(12, b"\1\0\0\1"),
)
header("vertices-limit", "LIMIT_EXCEEDED", "Vertex_Count 2^26 + 1", vertex_count=(1 << 26) + 1)
header(
    "branches-limit", "LIMIT_EXCEEDED", "Branch_Count 2^20 + 1, more than vertices as well", branch_count=(1 << 20) + 1
)
header("branches-more-than-vertices", "BAD_HEADER", "two branches, one vertex", branch_count=2)
header("frames-limit", "LIMIT_EXCEEDED", "Frame_Count 2^20 + 1", frame_count=(1 << 20) + 1)
header("frames-257", "BAD_HEADER", "257 frames in one segment", frame_count=257)
header(
    "segments-limit", "LIMIT_EXCEEDED", "Segment_Count 2^20 + 1, more than frames as well", segment_count=(1 << 20) + 1
)
header("segments-more-than-frames", "BAD_HEADER", "two segments, one frame", segment_count=2)
header("chunks-0", "BAD_HEADER", "Chunk_Count 0", chunk_count=0)
header(
    "chunks-before-front-length",
    "LIMIT_EXCEEDED",
    "a Chunk_Count beyond its limit comes before a Front_Length that is too small",
    chunk_count=2**32 - 1,
    front_length=0,
)
header("front-length-less", "BAD_HEADER", "Front_Length has no room for the checksums", front_length=24 + 5 * 4 - 1)
header("front-length-0", "BAD_HEADER", "Front_Length 0", front_length=0)
header("front-length-limit", "LIMIT_EXCEEDED", "Front_Length above Max_Table_Bytes", front_length=(1 << 24) + 1)
header("front-length-more", "TRUNCATED", "Front_Length is behind the end of the file", front_length=1 << 20)
header("chunks-more", "BAD_HEADER", "more chunks announced than the front has room for", chunk_count=1000)
header("chunks-less", "BAD_CHUNK_TABLE", "a chunk less than there are: the front stream is longer", chunk_count=4)
header(
    "tables-limit",
    "LIMIT_EXCEEDED",
    "2^20 segments at two levels: more than Max_Table_Bytes, and not there",
    frame_count=1 << 20,
    segment_count=1 << 20,
)
header(
    "limit-before-rules",
    "LIMIT_EXCEEDED",
    "a count beyond its limit comes before others that are out of range",
    segment_count=1 << 29,
    clip_count=256,
)
header("clips-256", "BAD_HEADER", "Clip_Count 256", clip_count=256)
header("levels-negative", "BAD_HEADER", "Level_Count is below 0", level_count=-7)
header("counts-largest", "LIMIT_EXCEEDED", "Vertex_Count 2^30", vertex_count=1 << 30)
header("chunks-limit", "LIMIT_EXCEEDED", "Chunk_Count 2^20 + 1", chunk_count=(1 << 20) + 1)
header("levels-0", "BAD_HEADER", "Level_Count 0", level_count=0)
header("full-levels-33", "BAD_HEADER", "Full_Level_Count 33", full_level_count=33)
header(
    "full-levels-not-those",
    "BAD_HEADER",
    "Full_Level_Count 4, the hierarchy has 2, or 3 with EXACT",
    full_level_count=4,
)
invalid(
    "header-full-levels-less",
    "BAD_HEADER",
    "open",
    "Full_Level_Count 2, the hierarchy has 3",
    lambda: fork().upto(1).with_header(full_level_count=2),
)
invalid(
    "hierarchy-31-deep",
    "BAD_HEADER",
    "open",
    "32 branches, each on the one before: no Full_Level_Count can say 33",
    lambda: moving(chain(32), 1).draft().upto(31).with_header(full_level_count=32),
)
header("max-error-nan", "BAD_HEADER", "Max_Error is NaN", max_error=NAN)
header("max-error-infinite", "BAD_HEADER", "Max_Error is infinite", max_error=INFINITY)
header("checksum", "BAD_CHECKSUM", "Front_Checksum is another", checksum=0)
header("memory-limit", "LIMIT_EXCEEDED", "2^22 vertices take more than Max_Memory_Bytes", vertex_count=1 << 22)

# ---- valid: joins ------------------------------------------------------------------------------------------


def joins(*widths: float) -> tuple[Join, ...]:
    """Of each level and segment; a half more where they are sloped."""
    return tuple(Join(int(width), width % 1 > 0) for width in widths)


def joined(stems: list[Stem], seed: int, *widths: float, **fields) -> Plant:
    """Random rows, in two segments of six frames."""
    return moving(stems, seed, **{"frames": 12, "segments": 2, "heads": HEADS, "joins": joins(*widths)} | fields)


valid("joins", "maps and vertices are joined, over all frames that may be", lambda: joined(FORK, 101, 0, 4, 0, 1, 0, 4))
valid("joins-sloped", "in value and slope", lambda: joined(FORK, 102, 0, 4.5, 0, 1.5, 0, 3.5))
valid("joins-of-some", "at one level alone", lambda: joined(FORK, 103, 0, 0, 0, 3.5, 0, 0))
valid("joins-float64", "positions of binary64", lambda: joined(FORK, 104, 0, 2.5, 0, 4, 0, 3, is_float64=True))
valid(
    "joins-forms",
    "sheets, loose branches, several pieces and roots",
    lambda: joined(
        [Stem(-1, 4), Stem(0, 3, 2, SHEET), Stem(1, 2, 1, LOOSE), Stem(0, 70, 3), Stem(-1, 6, 0, SHEET)],
        *(105, 0, 3, 0, 4.5, 0, 2, 0, 1.5),
    ),
)
valid(
    "joins-whole",
    "nodes whose maps serve several levels",
    lambda: joined([Stem(-1, 3), Stem(0, 2, 1, WHOLE), Stem(1, 2, 1), Stem(0, 4, 2), Stem(3, 3, 1)], 106, *(0, 4) * 4),
)
valid(
    "joins-many",
    "segments of different lengths and joins, none of them at first",
    lambda: joined(FORK, 107, *(0, 3, 0, 2.5), *(0, 0, 2, 2), *(0, 1, 3.5, 1), frames=19, segments=4),
)
valid("joins-longest", "over 127 frames", lambda: joined([Stem(-1, 2)], 108, 0, 127.5, 0, 127, frames=258, segments=2))
valid(
    "joins-of-three-frames", "the shortest segment that is joined", lambda: joined(FORK, 109, *(0, 1.5) * 3, frames=6)
)
valid(
    "joins-loop",
    "the first segment of a loop goes on from its last",
    lambda: joined(
        FORK,
        110,
        *(3, 2.5, 4, 0, 4.5, 0, 0, 0, 3, 0, 2, 0),
        clips=(loop(Clip(18, 3, "loop"), 0.0, 0.0, 0.0), Clip(6, 1, "once")),
    ),
)
valid(
    "joins-clips",
    "a loop of two segments behind a clip that is none",
    lambda: joined(
        FORK, 111, *(0, 2, 3, 4.5) * 3, clips=(Clip(12, 2, "once"), loop(Clip(11, 2, "loop"), 0.0, 0.0, 0.0))
    ),
)
valid(
    "joins-corrections",
    "corrections are added to what is joined, and what is joined goes on from what is not corrected",
    lambda: joined(
        FORK,
        112,
        *(0, 4, 0, 4, 0, 3.5),
        scripts={
            (rules.STEMS, 1): lambda: Chance(1),
            (rules.STEMS, 2): lambda: Chance(2),
            (rules.AFFINES, 0): lambda: Chance(3, large=4),
            (rules.CORRECTIONS, 2): lambda: Chance(4),
        },
    ),
)
valid(
    "joins-layers",
    "three layers, of which each is joined and none predicts from that",
    lambda: refinements(MIXED, 113, frames=12, segments=2, joins=joins(*(0, 4.5) * 6)),
)
valid(
    "joins-lossless",
    "the source's own numbers about positions that are joined",
    lambda: replace(
        joined(FORK, 114)
        .draft()
        .with_header(level_count=4, full_level_count=4)
        .add(*(Entry(rules.EXACT, b"", 3, s) for s in range(2))),
        joins=joins(0, 2, 0, 3, 0, 4.5, 0, 0),
    ),
)
valid("joins-truncated", "shortened: level 1 of 3", lambda: joined(FORK, 115, *(0, 4) * 3).draft().upto(1))
valid(
    "joins-predicted",
    "maps of level 0 before predicted motion",
    lambda: replace(
        predicted(ROOTED, swayed(5, 116), segments=2, scripts={(rules.AFFINES, 0): lambda: Chance(116, large=4)}),
        joins=joins(0, 3, 0, 0),
    ),
)

# ---- valid: repeats ----------------------------------------------------------------------------------------

TWOS, THREES = (0, 1) * 6, (0, 1, 1) * 4


def repeats_by_chance(frames: int) -> tuple[int, ...]:
    random, repeats = np.random.default_rng(420), list[int]()
    while len(repeats) < frames:
        repeats += [0] * random.choice([1, 2, 6]) + [1] * random.choice([1, 1, 2, 3, 10])
    return (*repeats[: frames - 1], 0)


valid(
    "repeats",
    "poses held for one to eleven frames",
    lambda: moving(FORK, 124, frames=14, repeats=(0, 0, *(0, 1), *(1,) * 9, 0)),
)
valid(
    "repeats-of-one",
    "all frames are alike, and one is coded",
    lambda: moving(FORK, 125, frames=12, repeats=(0, *(1,) * 11)),
)
valid(
    "repeats-by-chance",
    "now many poses that are held, now few, for one frame to ten",
    lambda: moving(FORK, 420, frames=160, repeats=repeats_by_chance(160)),
)
valid("repeats-joined", "over all coded frames that may be", lambda: joined(FORK, 126, *(0, 1.5) * 3, repeats=TWOS))
valid(
    "repeats-clips",
    "a periodic loop, and a clip of which a segment has no repeats",
    lambda: moving(
        FORK,
        127,
        heads=HEADS,
        clips=(periodic(Clip(6, 1, "loop"), 0.0, 0.0, 0.0), Clip(12, 2, "once")),
        repeats=(*TWOS, *(0,) * 6),
    ),
)
valid("repeats-layers", "two layers", lambda: refinements(MIXED, 128, frames=12, repeats=THREES))
valid(
    "repeats-predicted",
    "predicted motion",
    lambda: replace(predicted(ROOTED, swayed(4, 129)), frames=12, repeats=THREES),
)
valid(
    "repeats-lossless",
    "the source's own numbers",
    lambda: (
        moving(FORK, 130, frames=12, repeats=THREES)
        .draft()
        .with_header(level_count=4, full_level_count=4)
        .add(Entry(rules.EXACT, b"", 3, 0))
    ),
)

# ---- invalid: tables ---------------------------------------------------------------------------------------


def flipped(data: bytes, place: int) -> bytes:
    return data[:place] + bytes([data[place] ^ 0x10]) + data[place + 1 :]


def error_table(*values: int) -> Draft:
    return replace(lone().draft(), errors=values)


def front_stream(change: Callable[[bytes], bytes]) -> Draft:
    return replace(fork(), stream=change)


invalid(
    "table-damaged", "BAD_CHECKSUM", "open", "a bit of the front stream is flipped", lambda: flipped(lone().file(), 30)
)
invalid(
    "checksums-damaged",
    "BAD_CHECKSUM",
    "open",
    "a bit of a checksum is flipped",
    lambda: flipped(lone().file(), rules.u32(lone().file(), 16) - 2),
)
invalid(
    "errors-infinite", "BAD_CHUNK_TABLE", "open", "Level_Max_Error is 8160", lambda: error_table(8160, 0, 0, 0, 0, 0)
)
invalid("errors-negative", "BAD_CHUNK_TABLE", "open", "Level_P99_Error is -1", lambda: error_table(0, -1, 0, 0, 0, 0))
invalid(
    "errors-largest", "BAD_CHUNK_TABLE", "open", "the last error is 2^29", lambda: error_table(0, 0, 0, 0, 0, 1 << 29)
)
for name, reason, of in (
    ("first", "the first segment of a clip that is no loop is joined", (1, 0)),
    ("too-long", "over more frames than the segment has, less two", (0, 5)),
    ("128", "over 128 frames", (0, 128)),
    ("negative", "over -1 frames", (0, -1)),
    ("largest", "over 2^29 frames", (0, 1 << 29)),
):
    invalid(f"joins-{name}", "BAD_CHUNK_TABLE", "open", reason, lambda of=of: joined(FORK, 120, 0, 0, *of, 0, 0).file())
invalid(
    "joins-lone-loop",
    "BAD_CHUNK_TABLE",
    "open",
    "a loop of one segment is joined to itself",
    lambda: joined(
        *(FORK, 121, 2, 0, 0, 0, 0, 0), clips=(loop(Clip(9, 1, "loop"), 0.0, 0.0, 0.0), Clip(3, 1, "once"))
    ).file(),
)
for name, reason, widths, repeats in (
    ("first", "the first frame of the second segment is a repeat", (0, 0), (*(0,) * 6, 1, *(0,) * 5)),
    ("join-too-long", "a join over as many frames as are coded, less one", (0, 3), (*(0,) * 7, 1, 1, *(0,) * 3)),
    ("join-to-one", "a segment goes on from one with a single coded frame", (0, 2), (0, *(1,) * 5, *(0,) * 6)),
):
    invalid(
        f"repeats-{name}",
        "BAD_CHUNK_TABLE",
        "open",
        reason,
        lambda widths=widths, repeats=repeats: joined(FORK, 136, *widths * 3, repeats=repeats).file(),
    )
invalid(
    "joins-exact",
    "BAD_CHUNK_TABLE",
    "open",
    "the source's own numbers are joined",
    lambda: replace(
        joined(FORK, 122)
        .draft()
        .with_header(level_count=4, full_level_count=4)
        .add(*(Entry(rules.EXACT, b"", 3, s) for s in range(2))),
        joins=joins(0, 0, 0, 0, 0, 0, 0, 2),
    ).file(),
)
invalid(
    "joins-of-predicted-motion",
    "BAD_CHUNK_TABLE",
    "open",
    "predicted motion is joined",
    lambda: replace(predicted(ROOTED, swayed(5, 123), segments=2), joins=joins(0, 0, 0, 2)).file(),
)
invalid(
    "front-zero-behind",
    "BAD_CHUNK_TABLE",
    "open",
    "a zero byte behind the front stream",
    lambda: front_stream(lambda stream: stream + b"\0"),
)
invalid(
    "front-bytes-behind",
    "BAD_CHUNK_TABLE",
    "open",
    "bytes behind the front stream",
    lambda: front_stream(lambda stream: stream + b"\1" * 12),
)
invalid(
    "front-nothing",
    "LIMIT_EXCEEDED",
    "open",
    "a front stream of no bytes, whose decisions are all 1: 2^30 vertices",
    lambda: front_stream(lambda stream: b""),
)


def table(name: str, error: str, reason: str, make: Callable[[], Draft | bytes]) -> None:
    invalid(f"table-{name}", error, "open", reason, make)


def swapped(i: int, j: int) -> Draft:
    draft = fork()
    entries = list(draft.entries)
    entries[i], entries[j] = entries[j], entries[i]
    return replace(draft, entries=tuple(entries))


def moved(kind: int, **place: int) -> Draft:
    """The last chunk of a kind, with another level or segment in the table."""
    draft = fork()
    i = max(i for i, entry in enumerate(draft.entries) if entry.kind == kind)
    return replace(draft, entries=(*draft.entries[:i], replace(draft.entries[i], **place), *draft.entries[i + 1 :]))


def inserted(at: int, *entries: Entry) -> Draft:
    draft = fork()
    return replace(draft, entries=(*draft.entries[:at], *entries, *draft.entries[at:]))


for kind, level, why in (
    (0x0000, 255, "kind 0"),
    (0x0009, 255, "in the prelude"),
    (0x0018, 0, "of motion"),
    (0x0022, 255, "behind the motion"),
    (0x7FFF, 255, "the last one"),
):
    table(
        f"unknown-{kind:04x}",
        "UNKNOWN_CHUNK",
        f"a required kind that is not known, {why}",
        lambda kind=kind, level=level: fork().add(Entry(kind, b"", level)),
    )
for kind, level, name in (
    (0x8001, 255, "HIERARCHY"),
    (0x0004, 255, "METADATA"),
    (0x8010, 1, "STEMS"),
    (0x8013, 1, "SHAPES"),
    (0x8015, 1, "REFINED_REST"),
    (0x8007, 255, "CLIPS"),
    (0x8021, 255, "SOURCE_REST"),
    (0x0020, 255, "ATTRIBUTE"),
):
    table(
        f"twin-{kind:04x}",
        "UNKNOWN_CHUNK",
        f"{name} with the wrong bit 15",
        lambda kind=kind, level=level: fork().add(Entry(kind, b"", level)),
    )
table("no-level", "BAD_CHUNK_TABLE", "the last CORRECTIONS with Level 255", lambda: moved(rules.CORRECTIONS, level=255))
table(
    "level-beyond",
    "BAD_CHUNK_TABLE",
    "a motion chunk of a level that is not stored",
    lambda: moved(rules.CORRECTIONS, level=3),
)
table(
    "segment-beyond",
    "BAD_CHUNK_TABLE",
    "a motion chunk of a segment that is not there",
    lambda: moved(rules.CORRECTIONS, segment=2),
)
table(
    "unknown-without-level",
    "BAD_CHUNK_TABLE",
    "an unknown optional motion kind with Level 255",
    lambda: fork().add(Entry(0x8018, b"")),
)
table("order-prelude", "BAD_CHUNK_TABLE", "REST before HIERARCHY", lambda: swapped(0, 1))
table("order-motion-first", "BAD_CHUNK_TABLE", "a motion chunk before TIME", lambda: swapped(2, 3))
table("order-kinds", "BAD_CHUNK_TABLE", "SHAPES before STEMS", lambda: swapped(5, 6))
table(
    "order-optional",
    "BAD_CHUNK_TABLE",
    "an unknown optional motion kind before the known ones of its level: bit 15 counts",
    lambda: inserted(3, Entry(0x8018, b"", 0, 0)),
)
table(
    "order-attributes",
    "BAD_CHUNK_TABLE",
    "ATTRIBUTE before the motion",
    lambda: inserted(3, Entry(rules.ATTRIBUTE, element("|u1", b"a"))),
)
table(
    "order-behind",
    "BAD_CHUNK_TABLE",
    "METADATA behind the motion",
    lambda: inserted(len(fork().entries), Entry(rules.METADATA, b"\0{}")),
)
table("twice-time", "BAD_CHUNK_TABLE", "TIME twice", lambda: fork().add(Entry(rules.TIME, steady_time())))
table(
    "twice-metadata",
    "BAD_CHUNK_TABLE",
    "METADATA twice: only kinds from 32 on may repeat",
    lambda: fork().add(Entry(rules.METADATA, b"\0{}"), Entry(rules.METADATA, b"\0{}")),
)
table(
    "twice-stems",
    "BAD_CHUNK_TABLE",
    "STEMS of a level and segment twice",
    lambda: fork().add(Entry(rules.STEMS, fork().content(rules.STEMS, 1, 0), 1, 0)),
)
table(
    "twice-unknown",
    "BAD_CHUNK_TABLE",
    "an unknown optional kind of the prelude twice",
    lambda: fork().add(Entry(0x8009, b""), Entry(0x8009, b"")),
)
table(
    "twice-unknown-motion",
    "BAD_CHUNK_TABLE",
    "an unknown optional motion kind twice",
    lambda: fork().add(Entry(0x8018, b"", 0, 0), Entry(0x8018, b"", 0, 0)),
)
table(
    "length-limit",
    "LIMIT_EXCEEDED",
    "a chunk of 2^28 + 1 bytes",
    lambda: fork().add(Entry(0x8009, b"", length=(1 << 28) + 1)),
)
table(
    "length-limit-of-unknown",
    "UNKNOWN_CHUNK",
    "the Kind is checked before the Length",
    lambda: fork().add(Entry(9, b"", length=2**30 - 1)),
)
table(
    "length-limit-before-place",
    "LIMIT_EXCEEDED",
    "the Length is checked before the Level",
    lambda: fork().add(Entry(0x8018, b"", length=2**30 - 1)),
)
for kind in (rules.HIERARCHY, rules.REST, rules.TIME):
    table(
        f"no-{KIND_NAMES[kind].lower()}",
        "BAD_CHUNK_TABLE",
        f"{KIND_NAMES[kind]} is missing",
        lambda kind=kind: fork().without(kind),
    )
table(
    "no-chunk-of-motion",
    "BAD_CHUNK_TABLE",
    "a file without motion",
    lambda: replace(fork(), entries=fork().entries[:3]),
)
table("no-stems", "BAD_CHUNK_TABLE", "STEMS of a segment is missing", lambda: fork().without(rules.STEMS, 2, 1))
table(
    "no-affines",
    "BAD_CHUNK_TABLE",
    "AFFINES of level 0 is missing in one segment",
    lambda: fork().without(rules.AFFINES, 0, 1),
)
table(
    "more-stems",
    "BAD_CHUNK_TABLE",
    "STEMS of a level that has no pieces",
    lambda: fork().add(Entry(rules.STEMS, stems_head(), 0, 0)),
)
table(
    "more-affines",
    "BAD_CHUNK_TABLE",
    "AFFINES of a level without coded nodes",
    lambda: fork().add(Entry(rules.AFFINES, b"", 1, 0)),
)
table(
    "more-corrections",
    "BAD_CHUNK_TABLE",
    "CORRECTIONS of a level that is not the last",
    lambda: fork().add(Entry(rules.CORRECTIONS, struct.pack("<f", 1.0), 1, 0)),
)
table(
    "corrections-of-short-file",
    "BAD_CHUNK_TABLE",
    "CORRECTIONS on the last level of a shortened file",
    lambda: fork().upto(1).add(Entry(rules.CORRECTIONS, struct.pack("<f", 1.0), 1, 0)),
)
table(
    "more-shapes",
    "BAD_CHUNK_TABLE",
    "SHAPES of a level without STEMS",
    lambda: fork().add(Entry(rules.SHAPES, b"", 0, 0)),
)
table(
    "shapes-of-segment-1",
    "BAD_CHUNK_TABLE",
    "SHAPES stands with segment 0",
    lambda: fork().add(Entry(rules.SHAPES, b"", 1, 1)),
)

# ---- invalid: ends and checksums ---------------------------------------------------------------------------


def cut(short: Callable[[Draft], int], draft: Draft | None = None) -> bytes:
    """The first chunks of a file, of the fork if none is given, less some bytes."""
    draft = draft or fork()
    return draft.file()[: short(draft)]


def end_of(draft: Draft, kind: int, level: int = NO_LEVEL, segment: int = 0) -> int:
    behind = draft.entries[draft.index(kind, level, segment) + 1 :]
    return len(draft.file()) - sum(len(entry.content) for entry in behind)


def cut_static() -> bytes:
    return attributes(element("|u1", b"1", "a"), element("|u1", b"2", "b")).file()[:-1]


invalid("trailing-byte", "TRAILING_BYTES", "strict", "a byte behind the end", lambda: fork().file() + b"\0")
invalid("trailing-file", "TRAILING_BYTES", "strict", "the file twice", lambda: fork().file() * 2)
invalid(
    "cut-in-prelude",
    "TRUNCATED",
    "open",
    "the last byte of TIME is missing",
    lambda: cut(lambda d: end_of(d, rules.TIME) - 1),
)
invalid("cut-behind-prelude", "TRUNCATED", 0, "no motion has arrived", lambda: cut(lambda d: end_of(d, rules.TIME)))
invalid(
    "cut-in-level-0",
    "TRUNCATED",
    0,
    "one segment of level 0 has arrived",
    lambda: cut(lambda d: end_of(d, rules.AFFINES, 0, 1) - 1),
)
invalid(
    "cut-behind-level-0",
    "TRUNCATED",
    1,
    "level 0 has arrived and plays",
    lambda: cut(lambda d: end_of(d, rules.AFFINES, 0, 1)),
)
invalid("cut-in-last-level", "TRUNCATED", 2, "the last byte is missing", lambda: cut(lambda d: len(d.file()) - 1))
invalid(
    "cut-behind-damage",
    "TRUNCATED",
    1,
    "STEMS of level 1 is damaged and SHAPES is missing: what is missing comes first",
    lambda: flipped(cut(lambda d: end_of(d, rules.SHAPES, 1) - 1), end_of(fork(), rules.STEMS, 1) - 1),
)
invalid(
    "cut-in-source-rest",
    "TRUNCATED",
    "rest",
    "all motion has arrived and plays, the rest pose of the source has not",
    lambda: forked(source_rest=bent(FORK, Chance(206))).file()[:-1],
)
invalid(
    "cut-in-attributes",
    "TRUNCATED",
    "strict",
    "all motion has arrived and plays, one of two attributes has",
    cut_static,
)

for kind, item in ((rules.HIERARCHY, "open"), (rules.REST, "open"), (rules.TIME, "open")):
    invalid(
        f"damaged-{KIND_NAMES[kind].lower()}",
        "BAD_CHECKSUM",
        item,
        f"a bit of {KIND_NAMES[kind]} is flipped",
        lambda kind=kind: flipped(fork().file(), end_of(fork(), kind) - 1),
    )
for kind, level in ((rules.AFFINES, 0), (rules.STEMS, 1), (rules.SHAPES, 1), (rules.CORRECTIONS, 2)):
    invalid(
        f"damaged-{KIND_NAMES[kind].lower()}",
        "BAD_CHECKSUM",
        level,
        f"a bit of {KIND_NAMES[kind]} is flipped",
        lambda kind=kind, level=level: flipped(fork().file(), end_of(fork(), kind, level) - 1),
    )
invalid(
    "damaged-metadata",
    "BAD_CHECKSUM",
    "static",
    "a bit of METADATA is flipped; the motion plays",
    lambda: metadata("{}").change(rules.METADATA, checksum=0),
)
invalid(
    "damaged-attribute",
    "BAD_CHECKSUM",
    "static",
    "a bit of an attribute is flipped; the motion plays",
    lambda: attributes(element("|u1", b"1")).change(rules.ATTRIBUTE, checksum=0),
)
invalid(
    "damaged-before-table",
    "BAD_CHECKSUM",
    "open",
    "HIERARCHY is damaged and STEMS is missing: HIERARCHY comes first",
    lambda: fork().without(rules.STEMS, 2, 1).change(rules.HIERARCHY, checksum=0),
)
invalid(
    "hierarchy-before-rest",
    "BAD_CHUNK",
    "open",
    "HIERARCHY is not valid and REST is damaged: HIERARCHY comes first",
    lambda: fork().change(rules.HIERARCHY, content=b"").change(rules.REST, checksum=0),
)
invalid(
    "table-before-rest",
    "BAD_CHUNK_TABLE",
    "open",
    "STEMS is missing and REST is damaged: the table comes first",
    lambda: fork().without(rules.STEMS, 2, 1).change(rules.REST, checksum=0),
)

# ---- invalid: the prelude's chunks -------------------------------------------------------------------------


def prelude(name: str, kind: int, reason: str, content: bytes | Callable[[], bytes], error: str = "BAD_CHUNK") -> None:
    def make() -> Draft:
        return fork().change(kind, content=content() if callable(content) else content)

    invalid(f"{KIND_NAMES[kind].lower()}-{name}", error, "open", reason, make)


def hierarchy(name: str, reason: str, stems: list[Stem], **sources) -> None:
    """Written for the five vertices and two branches of the fork, or as many branches as there are."""

    def make() -> Draft:
        stream = write(rules.decode_hierarchy, hierarchy_script(stems, **sources), len(stems), 5)
        return fork().with_header(branch_count=len(stems)).change(rules.HIERARCHY, content=hierarchy_chunk(stream))

    invalid(f"hierarchy-{name}", "BAD_CHUNK", "open", reason, make)


def corrupted_hierarchy(**fields) -> bytes:
    return hierarchy_chunk(fork().content(rules.HIERARCHY)[8:], **fields)


prelude("empty", rules.HIERARCHY, "no bytes", b"")
prelude("short", rules.HIERARCHY, "7 bytes", bytes(7))
for field_name in ("epsilon", "xi"):
    for what, value in (("infinite", rules.SHORT_FLOATS), ("largest", 65535)):
        prelude(
            f"{field_name}-{what}",
            rules.HIERARCHY,
            f"{field_name.capitalize()} is {value}",
            lambda field_name=field_name, value=value: corrupted_hierarchy(**{field_name: value}),
        )
prelude("zero-behind", rules.HIERARCHY, "a zero byte behind the stream", lambda: corrupted_hierarchy() + b"\0")
prelude("bytes-behind", rules.HIERARCHY, "bytes behind the stream", lambda: corrupted_hierarchy() + b"\1" * 12)
invalid(
    "hierarchy-above-root",
    "BAD_CHUNK",
    "open",
    "a parent above the root",
    lambda: fork().change(
        rules.HIERARCHY, content=hierarchy_chunk(write(rules.decode_hierarchy, [2, 0, 0, 0, 1, 2], 2, 5))
    ),
)
hierarchy("too-many-vertices", "stems have more vertices than the file", [Stem(-1, 4), Stem(0, 3)])
hierarchy("too-few-vertices", "stems have fewer vertices than the file", [Stem(-1, 3), Stem(0, 1)])
hierarchy("no-vertex-left", "nothing is left for the last stem", [Stem(-1, 5), Stem(0, 1)])
hierarchy("lag-negative", "Lag -1", [Stem(-1, 3), Stem(0, 2, 1, lag=-1)])
hierarchy("lag-65536", "Lag 65536", [Stem(-1, 3, lag=65536), Stem(0, 2, 1)])
hierarchy("rigid-negative", "Rigid -1", [Stem(-1, 3, rigid=1), Stem(0, 2, 1, rigid=-1)])
hierarchy("rigid-9", "Rigid 9", [Stem(-1, 3), Stem(0, 2, 1, rigid=9)])
hierarchy("detail-negative", "Detail -1", [Stem(-1, 3, detail=1), Stem(0, 2, 1, detail=-1)])
hierarchy("detail-256", "Detail 256", [Stem(-1, 3), Stem(0, 2, 1, detail=256)])
hierarchy("ring-negative", "Ring -1", [Stem(-1, 3, 0, SHEET, ring=2), Stem(0, 2, 1, SHEET, ring=-1)])
hierarchy("ring-1", "Ring 1", [Stem(-1, 3), Stem(0, 2, 1, SHEET, ring=1)])
hierarchy("ring-33", "Ring 33", [Stem(-1, 3), Stem(0, 2, 1, SHEET, ring=33)])
hierarchy("ring-of-beam", "a branch that is no SHEET has a Ring", [Stem(-1, 3), Stem(0, 2, 1, ring=2)])
hierarchy("root-loose", "a root is LOOSE", [Stem(-1, 3, 0, LOOSE), Stem(0, 2, 1)])
hierarchy("second-root-loose", "another root is LOOSE", [Stem(-1, 3), Stem(-1, 2, 0, LOOSE)])
hierarchy(
    "whole-in-whole",
    "a WHOLE branch in the subtree of another",
    [Stem(-1, 2), Stem(0, 1, 0, WHOLE), Stem(1, 1), Stem(2, 1, 0, WHOLE)],
)
hierarchy("attach-beyond", "a branch hangs behind the end of its parent", [Stem(-1, 3), Stem(0, 2, 3)])
hierarchy("attach-before", "a branch hangs before the beginning of its parent", [Stem(-1, 3), Stem(0, 2, -1)])
hierarchy("attach-far", "a step of 2^28 + 1 along the parent", [Stem(-1, 3), Stem(0, 2, (1 << 28) + 1)])
hierarchy("branch-twice", "two branches with the same number", [Stem(-1, 3), Stem(0, 2, 1)], branch_source=[1, 1])
hierarchy("branch-beyond", "a branch with a number beyond the last", [Stem(-1, 3), Stem(0, 2, 1)], branch_source=[0, 2])
hierarchy("branch-negative", "a branch with a number below 0", [Stem(-1, 3), Stem(0, 2, 1)], branch_source=[-1, 0])
hierarchy(
    "vertex-twice", "two vertices with the same number", [Stem(-1, 3), Stem(0, 2, 1)], vertex_source=[0, 1, 2, 3, 3]
)
hierarchy(
    "vertex-beyond",
    "a vertex with a number beyond the last",
    [Stem(-1, 3), Stem(0, 2, 1)],
    vertex_source=[0, 1, 2, 3, 5],
)
hierarchy(
    "vertex-negative", "a vertex with a number below 0", [Stem(-1, 3), Stem(0, 2, 1)], vertex_source=[-1, 0, 1, 2, 3]
)
for what, vertex_source in (
    ("along-beyond", [0, 3, 6, 1, 2]),
    ("along-negative", [4, 1, -2, 0, 3]),
    ("beside-beyond", [1, 3, 0, 4, 6]),
    ("beside-negative", [3, 1, 4, 0, -2]),
):
    hierarchy(
        f"vertex-{what}",
        "a number out of range, as expected",
        [Stem(-1, 3), Stem(0, 2, 1)],
        vertex_source=vertex_source,
    )
invalid(
    "hierarchy-depth-limit",
    "LIMIT_EXCEEDED",
    "open",
    "4097 branches, each on the one before",
    lambda: (
        still([replace(s, flags=WHOLE if b == 0 else 0) for b, s in enumerate(chain(4097))], points=[[0.0] * 3] * 4097)
        .draft()
        .upto(0)
    ),
)


def adaptive_fork() -> bytes:
    return adaptive_rest(FORK, Chance(37, large=4))


def corrupted_rest(**fields) -> bytes:
    return rest_chunk(fork().content(rules.REST)[17:], **fields)


def exact_of_fork(numbers_: list, is_float64: bool, **fields) -> bytes:
    return exact_rest(FORK, numbers_, is_float64, **fields)


INFINITE_BITS = {False: (0xFF << 23, False), True: (0x7FF << 52, False)}  # how far infinity is from 0.0
prelude("empty", rules.REST, "no bytes", b"")
prelude("short", rules.REST, "16 bytes", lambda: corrupted_rest()[:16])
for bit in (0, 2, 3, 4, 5):
    prelude(
        f"method-{bit}",
        rules.REST,
        f"bit {bit + 2} of Method is set",
        lambda bit=bit: corrupted_rest(reserved=1 << bit),
    )
prelude(
    "exact-and-adaptive",
    rules.REST,
    "Method has Is_Exact and Is_Adaptive",
    lambda: exact_rest(FORK, [0.5] * 15, False, reserved=REST_ADAPTIVE >> 2),
)
for name_, seed_, title_ in (
    ("rest-copies-of-no-shape", 2, "a copy of a shape that is not there"),
    ("rest-copies-scale", 15, "the scale of a copy is not above 0"),
    ("rest-copies-rotation", 89, "a quaternion of more than 1"),
):
    invalid(
        name_,
        "BAD_CHUNK",
        "open",
        title_,
        lambda seed_=seed_: (
            with_rest(COPIED, adaptive_rest(COPIED, Chance(2364, large=3)))
            .draft()
            .change(rules.REST, content=adaptive_rest(COPIED, Chance(seed_, large=3)))
        ),
    )
invalid(
    "rest-connected-without-faces",
    "BAD_CHUNK_TABLE",
    "open",
    "Method has Is_Connected, and there are no FACES",
    lambda: with_rest(FORK, adaptive_rest(FORK, [], connected=True)),
)
for what, content in (
    ("broken", lambda: polygons(FACES_3) + b"\0"),
    ("derived", lambda: derived("<i4")),
    ("many-corners", lambda: polygons(np.zeros((1, 41), "<i4"))),
    ("many-faces", lambda: polygons(np.zeros((21, 1), "<i4"))),
):
    invalid(
        f"rest-connected-{what}-faces",
        "BAD_CHUNK",
        "open",
        f"a rest pose by faces that do not serve it: {what}",
        lambda content=content: (
            with_rest(FORK, adaptive_rest(FORK, [], connected=True)).draft().add(Entry(rules.FACES, content()))
        ),
    )
prelude("adaptive-zero-behind", rules.REST, "a zero byte behind an adaptive rest pose", lambda: adaptive_fork() + b"\0")
prelude("adaptive-bytes-behind", rules.REST, "bytes behind an adaptive rest pose", lambda: adaptive_fork() + b"\1" * 12)
for what, value in (("nan", NAN), ("infinite", -INFINITY)):
    prelude(
        f"origin-{what}",
        rules.REST,
        f"Origin has {value}",
        lambda value=value: corrupted_rest(origin=(0.0, 0.0, value)),
    )
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    prelude(f"step-{what}", rules.REST, f"Rest_Step is {value}", lambda value=value: corrupted_rest(step=value))
prelude(
    "step-of-exact",
    rules.REST,
    "Rest_Step is 0 with Method 1, where it has no meaning",
    lambda: exact_of_fork([0.0] * 15, False, step=0.0),
)
prelude("zero-behind", rules.REST, "a zero byte behind the stream", lambda: corrupted_rest() + b"\0")
prelude("bytes-behind", rules.REST, "bytes behind the stream", lambda: corrupted_rest() + b"\1" * 12)
prelude(
    "exact-infinite",
    rules.REST,
    "an infinite binary32 number",
    lambda: exact_of_fork([0.0, INFINITE_BITS[False]], False),
)
prelude(
    "exact-wide-infinite",
    rules.REST,
    "an infinite binary64 number",
    lambda: exact_of_fork([0.0, INFINITE_BITS[True]], True),
)
prelude("exact-nan", rules.REST, "a number that is NaN", lambda: exact_of_fork([((0xFF << 23) + 1, False)], False))
prelude(
    "exact-zero-behind",
    rules.REST,
    "a zero byte behind the stream of exact numbers",
    lambda: exact_of_fork([0.5] * 15, False) + b"\0",
)
invalid(
    "rest-beam-frequencies",
    "BAD_CHUNK",
    "open",
    "a run of two vertices codes three frequencies",
    lambda: (
        with_rest([Stem(-1, 3, lag=0)], coded_rest([Stem(-1, 3, lag=0)], []))
        .draft()
        .change(rules.REST, content=coded_rest([Stem(-1, 3, lag=0)], [0, 0, 0, 3]))
    ),
)


def source_rest(
    name: str,
    reason: str,
    content: bytes | Callable[[], bytes],
    plant: Callable[..., Plant] = forked,
    item: str = "rest",
) -> None:
    def make() -> Plant:
        return plant(source_rest=content() if callable(content) else content)

    invalid(f"source-rest-{name}", "BAD_CHUNK", item, reason, make)


source_rest("empty", "no bytes", b"")
source_rest("method", "Method 2", b"\2" + bytes(8))
source_rest("short", "3 bytes of Rest_Step", bytes(4))
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    source_rest(f"step-{what}", f"Rest_Step is {value}", lambda value=value: source_rest_chunk(b"", value))
source_rest("zero-behind", "a zero byte behind the stream", lambda: bent(FORK, Chance(206)) + b"\0")
source_rest("bytes-behind", "bytes behind the stream", lambda: bent(FORK, Chance(206)) + b"\1" * 12)
TWO = [Stem(-1, 2, lag=0)]
source_rest(
    "frequencies",
    "a run of one vertex codes two modes",
    lambda: bent(TWO, [0, 0, 0, 2], coded_rest(TWO, [])),
    lambda **fields: still(TWO, rest=coded_rest(TWO, []), **fields),
)
source_rest(
    "exact-infinite",
    "an infinite number",
    lambda: source_rest_chunk(exact_of_fork([0.0, INFINITE_BITS[False]], False)[17:], method=1),
)
source_rest(
    "of-exact",
    "REST is exact",
    lambda: bent(FORK, []),
    lambda **fields: forked(rest=exact_of_fork([0.0] * 15, False), **fields),
    "open",
)
invalid(
    "source-rest-damaged",
    "BAD_CHECKSUM",
    "rest",
    "a bit of SOURCE_REST is flipped",
    lambda: forked(source_rest=bent(FORK, Chance(206))).draft().change(rules.SOURCE_REST, checksum=0),
)


def steady(first: float, step: float, method: int = 0) -> Callable[[], bytes]:
    return lambda: steady_time(first, step, method)


prelude("empty", rules.TIME, "no bytes", b"")
prelude("method-5", rules.TIME, "Method 5", lambda: whole_rates(1, method=5))
for method in (3, 4):
    prelude(
        f"whole-{method}-0",
        rules.TIME,
        f"Rate 0 of Method {method}",
        lambda method=method: whole_rates(0, method=method),
    )
prelude("whole-short", rules.TIME, "half of Rate", lambda: whole_rates(2)[:2])
prelude("whole-long", rules.TIME, "two Rates of one clip", lambda: whole_rates(2, 2))
prelude("short", rules.TIME, "First and half of Step", lambda: steady_time()[:13])
prelude("long", rules.TIME, "a byte behind Step", lambda: steady_time() + b"\0")
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    prelude(f"step-{what}", rules.TIME, f"Step is {value}", steady(0.0, value))
    prelude(f"rate-{what}", rules.TIME, f"Step of Method 1 is {value}", steady(0.0, value, 1))
prelude("first-nan", rules.TIME, "First is NaN", steady(NAN, 1.0))
prelude("first-infinite", rules.TIME, "First is infinite", steady(-INFINITY, 1.0))
prelude("stands-still", rules.TIME, "Step vanishes beside First", steady(1e30, 1.0))
prelude("overflows", rules.TIME, "times beyond binary64", steady(0.0, HIGHEST))
prelude("rate-overflows", rules.TIME, "a rate so low that times are infinite", steady(0.0, TINY, 1))
prelude("equal", rules.TIME, "a time twice", lambda: uneven_time(0.0, 1.0, 1.0, 2.0))
prelude("descends", rules.TIME, "a time before the one before", lambda: uneven_time(0.0, 1.0, 2.0, 1.5))
prelude("zeros", rules.TIME, "-0.0 is not before 0.0", lambda: uneven_time(-0.0, 0.0, 1.0, 2.0))
prelude(
    "infinite",
    rules.TIME,
    "an infinite time at the end",
    lambda: uneven_time(
        0.0, 1.0, 2.0, (rules.ordered(0x7FF << 52, 64) - rules.ordered(rules.to_bits(3.0, 64), 64), False)
    ),
)
prelude("zero-behind", rules.TIME, "a zero byte behind the stream", lambda: uneven_time(0.0, 1.0, 2.5, 3.0) + b"\0")
prelude("bytes-behind", rules.TIME, "bytes behind the stream", lambda: uneven_time(0.0, 1.0, 2.5, 3.0) + b"\1" * 12)
invalid(
    "time-code-outside",
    "BAD_CHUNK",
    "open",
    "a stream whose code is outside the final interval",
    lambda: lone().draft().change(rules.TIME, content=b"\2" + b"\xff" * 8),
)
invalid(
    "time-of-one-infinite",
    "BAD_CHUNK",
    "open",
    "First of a single frame is infinite",
    lambda: lone().draft().change(rules.TIME, content=steady_time(INFINITY)),
)

# ---- invalid: clips ----------------------------------------------------------------------------------------

CALM_ENTRY, STORM_ENTRY = CALM.entry(), STORM.entry()


def clips(name: str, reason: str, *entries: bytes, count: int = 2) -> None:
    """The two clips with another CLIPS."""
    invalid(
        f"clips-{name}",
        "BAD_CHUNK",
        "open",
        reason,
        lambda: two_clips().with_header(clip_count=count).change(rules.CLIPS, content=b"".join(entries)),
    )


def lone_clips(frames: int, segments: int, *entries: bytes, **header_fields) -> Draft:
    """One vertex, and any CLIPS."""
    draft = lone(frames=frames, segments=segments).draft().add(Entry(rules.CLIPS, b"".join(entries)))
    return draft.with_header(clip_count=len(entries), **header_fields)


invalid("clips-missing", "BAD_CHUNK_TABLE", "open", "two clips and no CLIPS", lambda: two_clips().without(rules.CLIPS))
clips("empty", "no bytes")
clips("cut-in-entry", "ends inside the fields of the first clip", CALM_ENTRY[:9])
clips("cut-before-name", "ends before the Name of the first clip", CALM_ENTRY[:10])
clips("cut-in-name", "ends inside the Name of the second clip", CALM_ENTRY, STORM_ENTRY[:-1])
clips("less", "one clip of two", CALM_ENTRY)
clips("less-than-count", "two clips of three", CALM_ENTRY, STORM_ENTRY, count=3)
clips("more-than-count", "a clip more than Clip_Count", CALM_ENTRY, STORM_ENTRY, clip_entry(1, 1, "more"))
clips("more-than-one", "two clips where Clip_Count is 1", CALM_ENTRY, STORM_ENTRY, count=1)
clips("byte-behind", "a byte behind the last clip", CALM_ENTRY, STORM_ENTRY, b"\0")
clips("frames-0", "Clip_Frames and Clip_Segments are 0", clip_entry(0, 0, "calm"), clip_entry(7, 3, "storm"))
clips("segments-0", "Clip_Segments 0", clip_entry(3, 0, "calm"), clip_entry(4, 3, "storm"))
clips(
    "segments-more-than-frames", "Clip_Segments above Clip_Frames", clip_entry(1, 2, "calm"), clip_entry(6, 1, "storm")
)
invalid(
    "clips-frames-257",
    "BAD_CHUNK",
    "open",
    "Clip_Frames 257 in one segment",
    lambda: lone_clips(513, 3, clip_entry(257, 1, "long"), clip_entry(256, 2, "short")),
)
clips("frames-do-not-add-up", "Clip_Frames add up to less than Frame_Count", clip_entry(2, 1, "calm"), STORM_ENTRY)
clips("frames-add-up-to-more", "Clip_Frames add up to more than Frame_Count", CALM_ENTRY, clip_entry(5, 2, "storm"))
clips(
    "segments-do-not-add-up", "Clip_Segments add up to less than Segment_Count", CALM_ENTRY, clip_entry(4, 1, "storm")
)
clips(
    "segments-add-up-to-more", "Clip_Segments add up to more than Segment_Count", clip_entry(3, 2, "calm"), STORM_ENTRY
)
clips(
    "sums-wrap",
    "Clip_Frames and Clip_Segments add up to 2^32 more than they should",
    clip_entry(2**32 - 4, 2**32 - 4, "calm"),
    clip_entry(11, 7, "storm"),
)
clips("of-one-do-not-add-up", "the only clip has less frames than the file", clip_entry(6, 3, "all"), count=1)
for bit in range(2, 8):
    clips(
        f"flags-{bit}",
        f"reserved bit {bit} of Clip_Flags is set",
        clip_entry(3, 1, "calm", flags=1 << bit),
        STORM_ENTRY,
    )
clips("periodic-no-loop", "Periodic of a clip that is no loop", clip_entry(3, 1, "calm", flags=2), STORM_ENTRY)
clips("periodic-segments", "Periodic of two segments", CALM_ENTRY, clip_entry(4, 2, "storm", (0.0,) * 3, flags=3))
clips("name-none", "Name_Length 0 in a file of two clips", CALM_ENTRY, clip_entry(4, 2))
clips("name-twice", "two clips with the same Name", CALM_ENTRY, clip_entry(4, 2, "calm"))
clips(
    "name-twice-apart",
    "the first and the third clip with the same Name",
    CALM_ENTRY,
    clip_entry(1, 1, "storm"),
    clip_entry(3, 1, "calm"),
    count=3,
)
clips("name-length-more", "Name_Length is more than the chunk holds", CALM_ENTRY, clip_entry(4, 2, "storm", length=6))
clips("name-length-less", "Name_Length is less: a byte remains", CALM_ENTRY, clip_entry(4, 2, "storm", length=4))
for name, why, text in (
    ("continuation", "a continuation byte alone", b"\x80"),
    ("latin-1", "Latin-1", b"B\xf6e"),
    ("overlong-2", "an overlong form of two bytes", b"\xc1\xbf"),
    ("overlong-nul", "U+0000 in two bytes", b"\xc0\x80"),
    ("overlong-3", "an overlong form of three bytes", b"\xe0\x9f\xbf"),
    ("overlong-4", "an overlong form of four bytes", b"\xf0\x8f\xbf\xbf"),
    ("surrogate-first", "the first surrogate", b"\xed\xa0\x80"),
    ("surrogate-last", "the last surrogate", b"\xed\xbf\xbf"),
    ("surrogates", "a surrogate pair", b"\xed\xa0\xbc\xed\xbc\xb3"),
    ("beyond", "U+110000", b"\xf4\x90\x80\x80"),
    ("far-beyond", "U+140000", b"\xf5\x80\x80\x80"),
    ("five-bytes", "a sequence of five bytes", b"\xf8\x88\x80\x80\x80"),
    ("fe", "the byte FE", b"a\xfe"),
    ("ff", "the byte FF", b"a\xff"),
    ("cut-2", "a sequence cut before its second byte", b"a\xc3"),
    ("cut-3", "a sequence cut before its third byte", b"a\xe9\xa3"),
    ("cut-4", "a sequence cut before its fourth byte", b"a\xf0\x9f\x8c"),
    ("broken", "a letter inside a sequence", b"\xe9\xa3a"),
    ("broken-4", "a letter behind a first byte", b"\xf0a\x8c\xb3"),
):
    clips(f"name-{name}", f"a Name that is not UTF-8: {why}", CALM_ENTRY, clip_entry(4, 2, text))
invalid(
    "clips-name-cut-before-continuation",
    "BAD_CHUNK",
    "open",
    "a Name that ends inside a sequence, which the Clip_Frames behind it would complete",
    lambda: lone_clips(131, 2, clip_entry(3, 1, b"\xc3"), clip_entry(128, 1, "b")),
)
for code in (0x00, 0x01, 0x0A, 0x1F, 0x7F):
    clips(f"name-control-{code:02x}", f"U+{code:04X} in a Name", CALM_ENTRY, clip_entry(4, 2, f"st{chr(code)}rm"))
for what, value in (("nan", NAN), ("infinite", INFINITY), ("negative", -FLOAT_TINY)):
    clips(
        f"seam-{what}", f"the last of Seam_Errors is {value}", CALM_ENTRY, clip_entry(4, 2, "storm", (0.0, 0.0, value))
    )
clips("seams-missing", "a Loop without Seam_Errors", CALM_ENTRY, clip_entry(4, 2, "storm", flags=1))
clips("seams-cut", "ends inside Seam_Errors", CALM_ENTRY, clip_entry(4, 2, "storm", (1.0, 1.0, 1.0))[:-1])
clips("seams-less", "Seam_Errors of two levels of three", CALM_ENTRY, clip_entry(4, 2, "storm", (1.0, 1.0)))
clips("seams-more", "Seam_Errors of four levels of three", CALM_ENTRY, clip_entry(4, 2, "storm", (1.0,) * 4))
clips(
    "seams-of-none", "Seam_Errors of a clip that is no loop", CALM_ENTRY, clip_entry(4, 2, "storm", (0.0,) * 3, flags=0)
)
invalid(
    "clips-seams-of-stored-levels",
    "BAD_CHUNK",
    "open",
    "a shortened file with Seam_Errors of its level 0 alone",
    lambda: two_clips(clips=(CALM, loop(STORM, 1.0))).upto(0),
)
invalid(
    "clips-seam-not-stored-nan",
    "BAD_CHUNK",
    "open",
    "a shortened file whose Seam_Errors of a level not stored is NaN",
    lambda: two_clips(clips=(CALM, loop(STORM, 1.0, 1.0, NAN))).upto(0),
)

table("twice-clips", "BAD_CHUNK_TABLE", "CLIPS twice", lambda: two_clips().add(Entry(rules.CLIPS, CALM_ENTRY)))
table(
    "order-clips",
    "BAD_CHUNK_TABLE",
    "METADATA behind CLIPS",
    lambda: inserted(3, Entry(rules.CLIPS, clip_entry(4, 2)), Entry(rules.METADATA, b"\0{}")),
)
table(
    "order-clips-motion",
    "BAD_CHUNK_TABLE",
    "CLIPS behind the first motion chunk",
    lambda: inserted(4, Entry(rules.CLIPS, clip_entry(4, 2))),
)

invalid(
    "clips-damaged",
    "BAD_CHECKSUM",
    "open",
    "a bit of CLIPS is flipped",
    lambda: flipped(two_clips().file(), end_of(two_clips(), rules.CLIPS) - 1),
)
invalid(
    "clips-cut",
    "TRUNCATED",
    "open",
    "the file ends inside CLIPS",
    lambda: two_clips().file()[: end_of(two_clips(), rules.CLIPS) - 1],
)
invalid(
    "clips-cut-in-motion",
    "TRUNCATED",
    0,
    "level 0 of the first clip alone has arrived",
    lambda: two_clips().file()[: end_of(two_clips(), rules.AFFINES, 0, 0)],
)
invalid(
    "clips-before-hierarchy",
    "BAD_CHUNK",
    "open",
    "CLIPS is not valid and HIERARCHY is damaged: CLIPS comes first",
    lambda: two_clips().change(rules.CLIPS, content=CALM_ENTRY).change(rules.HIERARCHY, checksum=0),
)
invalid(
    "clips-missing-before-hierarchy",
    "BAD_CHUNK_TABLE",
    "open",
    "CLIPS is missing and HIERARCHY is damaged: CLIPS comes first",
    lambda: two_clips().without(rules.CLIPS).change(rules.HIERARCHY, checksum=0),
)
invalid(
    "clips-damaged-before-hierarchy",
    "BAD_CHECKSUM",
    "open",
    "CLIPS is damaged and HIERARCHY is missing: CLIPS comes first",
    lambda: two_clips().without(rules.HIERARCHY).change(rules.CLIPS, checksum=0),
)
invalid(
    "clips-before-levels",
    "BAD_CHUNK",
    "open",
    "Seam_Errors of the three levels of the hierarchy, while Full_Level_Count says 5: CLIPS comes first",
    lambda: two_clips(clips=(CALM, loop(STORM, 1.0, 1.0, 1.0))).with_header(full_level_count=5),
)
invalid(
    "clips-levels",
    "BAD_HEADER",
    "open",
    "Full_Level_Count 5, and as many Seam_Errors; the hierarchy has 3",
    lambda: two_clips(clips=(CALM, loop(STORM, *[1.0] * 5))).with_header(full_level_count=5),
)
UNEVEN = clip_entry(256, 1, "long"), clip_entry(2, 2, "short")
invalid(
    "clips-memory",
    "LIMIT_EXCEEDED",
    "open",
    "2^18 vertices and a segment of 256 frames, though the mean is 86",
    lambda: lone_clips(258, 3, *UNEVEN, vertex_count=1 << 18),
)
invalid(
    "clips-before-memory",
    "BAD_CHECKSUM",
    "open",
    "CLIPS is damaged, and its longest segment takes too much memory",
    lambda: lone_clips(258, 3, *UNEVEN, vertex_count=1 << 18).change(rules.CLIPS, checksum=0),
)
invalid(
    "clips-memory-of-mean",
    "LIMIT_EXCEEDED",
    "open",
    "2^22 vertices are too many, before CLIPS is missed",
    lambda: lone(frames=2, segments=2).draft().with_header(vertex_count=1 << 22, clip_count=2),
)


def clip_times(name: str, reason: str, make: Callable[[], bytes]) -> None:
    """TIME of the two clips."""
    invalid(f"time-{name}", "BAD_CHUNK", "open", reason, lambda: two_clips().change(rules.TIME, content=make()))


STEADY = (0.0, 0.25)
clip_times("of-one-clip", "First and Step of one clip of two", lambda: steady_times(STEADY))
clip_times(
    "of-three-clips", "First and Step of three clips where two are", lambda: steady_times(STEADY, STEADY, STEADY)
)
clip_times("without-last-step", "First of the second clip without its Step", lambda: steady_times(STEADY, STEADY)[:-8])
invalid(
    "time-of-two-clips",
    "BAD_CHUNK",
    "open",
    "First and Step of two clips where one is",
    lambda: lone().draft().change(rules.TIME, content=steady_times(STEADY, STEADY)),
)
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    clip_times(
        f"second-step-{what}",
        f"Step of the second clip is {value}",
        lambda value=value: steady_times(STEADY, (0.0, value)),
    )
    clip_times(
        f"second-rate-{what}",
        f"Step of the second clip, by Method 1, is {value}",
        lambda value=value: steady_times(STEADY, (0.0, value), method=1),
    )
clip_times("second-first-nan", "First of the second clip is NaN", lambda: steady_times(STEADY, (NAN, 1.0)))
clip_times(
    "second-stands-still",
    "Step of the second clip vanishes beside its First",
    lambda: steady_times(STEADY, (1e30, 1.0)),
)
clip_times(
    "first-stands-still", "Step of the first clip vanishes beside its First", lambda: steady_times((1e30, 1.0), STEADY)
)
clip_times("second-overflows", "times of the second clip beyond binary64", lambda: steady_times(STEADY, (0.0, HIGHEST)))
clip_times(
    "uneven-second-equal", "a time twice in the second clip", lambda: uneven_time(0.0, 1.0, 2.0, 0.0, 1.0, 1.0, 2.0)
)
clip_times(
    "uneven-first-descends",
    "a time of the first clip before the one before",
    lambda: uneven_time(0.0, 2.0, 1.0, 3.0, 4.0, 5.0, 6.0),
)
clip_times(
    "uneven-more", "a time more than there are frames", lambda: uneven_time(0.0, 1.5, 2.0, 0.0, 1.0, 2.0, 3.0, 1e-9)
)

# ---- invalid: motion ---------------------------------------------------------------------------------------


def motion(
    name: str, kind: int, level: int, reason: str, content: bytes | Callable[[], bytes], segment: int = 0
) -> None:
    def make() -> Draft:
        return fork().change(kind, level, segment, content=content() if callable(content) else content)

    invalid(f"{KIND_NAMES[kind].lower()}-{name}", "BAD_CHUNK", level, reason, make)


def stems(*head, **fields) -> Callable[[], bytes]:
    """STEMS of level 1 with another head."""
    return lambda: stems_head(*head, **fields) + fork().content(rules.STEMS, 1, 0)[6:]


def basis(rank: int, bits: int, stream: bytes) -> Callable[[], bytes]:
    return lambda: stems_head(0.5, 0, bits, rank, stream)


motion("empty", rules.STEMS, 1, "no bytes", b"")
motion("short", rules.STEMS, 1, "5 bytes", bytes(5))
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    motion(f"step-{what}", rules.STEMS, 1, f"Step is {value}", stems(value))
motion("rotation-5", rules.STEMS, 1, "Rotation 5", stems(0.5, 5))
motion("rotation-tips-5", rules.STEMS, 1, "Only_Tips and Rotation 5", stems(0.5, 13))
motion("rotation-turn-5", rules.STEMS, 1, "Turn 1 and Rotation 5", stems(0.5, 21))
motion("bits-7", rules.STEMS, 1, "Basis_Bits 7", basis(1, 7, basis_stream([[0, 0]], 8)))
motion("bits-17", rules.STEMS, 1, "Basis_Bits 17", basis(1, 17, basis_stream([[0, 0]], 8)))
motion("rank-0", rules.STEMS, 1, "Basis_Rank 0 though there is a basis", basis(0, 8, b""))
motion(
    "rank-more-than-frames",
    rules.STEMS,
    1,
    "Basis_Rank 3 in a segment of two frames",
    basis(3, 8, basis_stream([[0, 0]] * 3, 8)),
)
motion(
    "basis-length-missing", rules.STEMS, 1, "the chunk ends inside Basis_Length", lambda: stems_head(0.5, 0, 8, 1)[:11]
)
motion(
    "basis-length-more",
    rules.STEMS,
    1,
    "Basis_Length is more than the chunk holds",
    lambda: struct.pack("<fBBHBI", 0.5, 0, 8, 1, 255, 100) + basis_stream([[1, 2]], 8),
)
for name, level, reason, base in (
    ("own", 1, "Basis_Level is the level itself", 1),
    ("later", 1, "Basis_Level is a later level", 2),
    ("waves", 2, "Basis_Level is a level in waves", 1),
    ("missing", 2, "Basis_Level is a level without STEMS", 0),
):
    motion(
        f"basis-level-{name}",
        rules.STEMS,
        level,
        reason,
        lambda base=base: stems_head(0.5, 0, 8, 1, base=base),
        segment=1,
    )
invalid(
    "stems-basis-level-rank",
    "BAD_CHUNK",
    2,
    "Basis_Rank 1 though Basis_Level has a basis of two rows",
    lambda: (
        forked(heads={1: stems_head(0.5, 0, 8, 2, basis_stream([[1, 2], [3, 4]], 8))})
        .draft()
        .change(rules.STEMS, 2, 0, content=stems_head(0.5, 0, 8, 1, base=1))
    ),
)
motion(
    "basis-beyond-1",
    rules.STEMS,
    1,
    "an entry of a learned basis of 8 bits is 129",
    basis(1, 8, basis_stream([[128, 129]], 8)),
)
motion(
    "basis-below-1",
    rules.STEMS,
    1,
    "an entry of a learned basis of 8 bits is -129",
    basis(1, 8, basis_stream([[-129, 0]], 8)),
)
motion("bits-3", rules.STEMS, 1, "Basis_Bits 3", basis(1, 3, basis_stream([[0, 0]], 8)))
for name, reason, exponents in (
    ("change", "an exponent of a row of a basis changes by 401", (-200, 401)),
    ("high", "an exponent of a row of a basis is 201", (201, 0)),
    ("low", "an exponent of a row of a basis is -201", (0, -201)),
):
    motion(
        f"basis-exponent-{name}",
        rules.STEMS,
        1,
        reason,
        lambda exponents=exponents: basis(2, 2, basis_in_waves(2, *exponents, *row((1, 1, 0)), rank=2))(),
    )
motion(
    "basis-in-waves-frequencies",
    rules.STEMS,
    1,
    "a row of a basis codes three frequencies of two frames",
    lambda: basis(1, 2, basis_in_waves(2, 0, *row((1, 0, 0), (1, 0, 0), (1, 0, 0)), rank=1))(),
)
motion(
    "basis-in-waves-zero-behind",
    rules.STEMS,
    1,
    "a zero byte behind the stream of a basis in waves",
    lambda: basis(1, 2, basis_in_waves(2, 0, *row((1, 0, 0)), rank=1) + b"\0")(),
)
motion(
    "basis-zero-behind",
    rules.STEMS,
    1,
    "a zero byte behind the stream of a basis",
    basis(1, 8, basis_stream([[1, 2]], 8) + b"\0"),
)
motion(
    "frequencies",
    rules.STEMS,
    1,
    "a row codes three frequencies of two",
    lambda: stems_head() + write(rules.decode_stems, [3], forked_plan(), stems_motion(stems_head(), 2), 1),
)
motion(
    "frequencies-of-basis",
    rules.STEMS,
    1,
    "a row codes two frequencies of a learned basis of rank 1",
    lambda: (
        basis(1, 8, basis_stream([[1, 2]], 8))()
        + write(rules.decode_stems, [2], forked_plan(), stems_motion(basis(1, 8, basis_stream([[1, 2]], 8))(), 2), 1)
    ),
)
motion(
    "zero-behind", rules.STEMS, 1, "a zero byte behind the stream", lambda: fork().content(rules.STEMS, 1, 0) + b"\0"
)
motion(
    "bytes-behind",
    rules.STEMS,
    2,
    "bytes behind the stream of the second segment",
    lambda: fork().content(rules.STEMS, 2, 1) + b"\1" * 12,
    1,
)


def forked_plan():
    plant = forked()
    plant.draft()
    return plant.plan


def stems_motion(head: bytes, frames: int):
    made = rules.no_motion(forked_plan(), frames, False)
    rules.read_stems_head(head, made, 1)
    return made


def affines(*script) -> Callable[[], bytes]:
    def make() -> bytes:
        plan = forked_plan()
        return write(rules.decode_affines, list(script), plan, rules.no_motion(plan, 2, False), 0)

    return make


motion("step-beyond", rules.AFFINES, 0, "the step of a map is 2^100.5", affines(201))
motion("step-below", rules.AFFINES, 0, "the step of a map is 2^-100.5", affines(-201))
motion("frequencies", rules.AFFINES, 0, "a row codes three frequencies of two frames", affines(0, 3))
motion(
    "zero-behind",
    rules.AFFINES,
    0,
    "a zero byte behind the stream",
    lambda: fork().content(rules.AFFINES, 0, 1) + b"\0",
    1,
)
motion(
    "bytes-behind",
    rules.AFFINES,
    0,
    "bytes behind the stream",
    lambda: fork().content(rules.AFFINES, 0, 0) + b"\1" * 12,
)
invalid(
    "affines-change",
    "BAD_CHUNK",
    0,
    "a step changes by more than 400",
    lambda: Plant(
        [Stem(-1, 2), Stem(0, 1, 1), Stem(-1, 2), Stem(2, 1, 1)],
        points=[[0.0] * 3] * 6,
        scripts={(rules.AFFINES, 0): [200, 0, -401]},
    ),
)


def shapes(*script) -> Callable[[], bytes]:
    def make() -> bytes:
        plan = forked_plan()
        return write(rules.decode_shapes, list(script), plan, rules.no_motion(plan, 1, False), 1)

    return make


motion("too-many", rules.SHAPES, 1, "a piece of three modes has ten shapes", shapes(10))
motion(
    "too-many-of-base", rules.SHAPES, 1, "a piece whose base level has two modes has seven shapes there", shapes(0, 7)
)
motion("all-zero", rules.SHAPES, 1, "a shape is all 0", shapes(1, *row((0, 0, 0))))
motion("empty-row", rules.SHAPES, 1, "a shape whose row is empty", shapes(1, 0))
motion("modes", rules.SHAPES, 1, "a shape has numbers for four modes of three", shapes(1, 4))
motion("zero-behind", rules.SHAPES, 1, "a zero byte behind the stream", lambda: fork().content(rules.SHAPES, 1) + b"\0")
motion("bytes-behind", rules.SHAPES, 1, "bytes behind the stream", lambda: fork().content(rules.SHAPES, 1) + b"\1" * 12)
invalid(
    "shapes-too-many-at-last",
    "BAD_CHUNK",
    1,
    "a level adds more shapes than the other modes have axes",
    lambda: Plant(
        [Stem(-1, 3)],
        scripts={(rules.SHAPES, 0, 0): [6, *(n for i in range(6) for n in row((1, i, 0)))], (rules.SHAPES, 1, 0): [4]},
    ),
)


def lossless(first: bytes = b"") -> Draft:
    """An additional last level with empty streams."""
    return (
        fork()
        .with_header(level_count=4, full_level_count=4)
        .add(Entry(rules.EXACT, first, 3, 0), Entry(rules.EXACT, b"", 3, 1))
    )


table("exact-missing", "BAD_CHUNK_TABLE", "a segment lacks its EXACT", lambda: lossless().without(rules.EXACT, 3, 1))
table("exact-too-early", "BAD_CHUNK_TABLE", "EXACT at level h + 1", lambda: fork().add(Entry(rules.EXACT, b"", 2, 0)))
table(
    "exact-with-stems", "BAD_CHUNK_TABLE", "STEMS at level h + 2", lambda: lossless().add(Entry(rules.STEMS, b"", 3, 0))
)
table(
    "exact-with-corrections",
    "BAD_CHUNK_TABLE",
    "CORRECTIONS at level h + 2",
    lambda: lossless().add(Entry(rules.CORRECTIONS, b"", 3, 0)),
)
valid("exact-empty", "EXACT without bytes: differences of 32 bits, all of them ones", lossless)
invalid("exact-bytes-behind", "BAD_CHUNK", 3, "bytes behind the stream of EXACT", lambda: lossless(b"\1" * 400))


def corrections(step: float) -> Callable[[], bytes]:
    return lambda: struct.pack("<f", step) + fork().content(rules.CORRECTIONS, 2, 0)[4:]


motion("empty", rules.CORRECTIONS, 2, "no bytes", b"")
motion("short", rules.CORRECTIONS, 2, "3 bytes", bytes(3))
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    motion(f"step-{what}", rules.CORRECTIONS, 2, f"Correction_Step is {value}", corrections(value))
motion(
    "zero-behind",
    rules.CORRECTIONS,
    2,
    "a zero byte behind the stream",
    lambda: fork().content(rules.CORRECTIONS, 2, 0) + b"\0",
)
motion(
    "bytes-behind",
    rules.CORRECTIONS,
    2,
    "bytes behind the stream",
    lambda: fork().content(rules.CORRECTIONS, 2, 1) + b"\1" * 12,
    1,
)

# ---- invalid: predicted motion -------------------------------------------------------------------------------


def swaying() -> Draft:
    return predicted(ROOTED, swayed(3, 18), 2).draft()


PREDICTED_PLACE = rules.PREDICTED, 1, 1
invalid(
    "predicted-missing", "BAD_CHUNK_TABLE", "open", "a segment has none", lambda: swaying().without(*PREDICTED_PLACE)
)
invalid(
    "predicted-stems",
    "BAD_CHUNK_TABLE",
    "open",
    "a segment has STEMS too",
    lambda: swaying().add(Entry(rules.STEMS, stems_head(), 1, 0)),
)
invalid(
    "predicted-corrections",
    "BAD_CHUNK_TABLE",
    "open",
    "a segment has CORRECTIONS too",
    lambda: swaying().add(Entry(rules.CORRECTIONS, struct.pack("<f", 0.5), 1, 0)),
)
invalid(
    "predicted-unsaid",
    "BAD_CHUNK_TABLE",
    "open",
    "PREDICTED where Is_Predicted is 0",
    lambda: fork().add(Entry(rules.PREDICTED, predicted_head(), 2, 0)),
)
invalid(
    "predicted-at-level-0",
    "BAD_CHUNK_TABLE",
    "open",
    "PREDICTED of level 0",
    lambda: swaying().add(Entry(rules.PREDICTED, predicted_head(), 0, 0)),
)
invalid(
    "predicted-layers",
    "BAD_HEADER",
    "open",
    "Layer_Count 2",
    lambda: swaying().with_header(layer_count=2, full_level_count=3),
)
invalid(
    "predicted-nodes",
    "BAD_HEADER",
    "open",
    "h is 1",
    lambda: predicted(FORKED, swayed(1, 19, FORKED)).draft().with_header(full_level_count=3, level_count=2),
)
for name, reason, content in (
    ("short", "4 bytes", predicted_head()[:4]),
    ("settings", "a reserved bit of Settings", predicted_head(settings=32)),
    ("step-0", "Step 0", predicted_head(0.0)),
    ("step-nan", "Step is NaN", predicted_head(math.nan)),
    ("left-over", "a byte behind the stream", predicted_head() + b"\1" * 400),
    ("zero", "a stream that ends in 0", predicted_head() + b"\1\0"),
):
    invalid(
        f"predicted-{name}",
        "BAD_CHUNK",
        1,
        reason,
        lambda content=content: swaying().change(*PREDICTED_PLACE, content=content),
    )
invalid(
    "predicted-before-first",
    "BAD_CHUNK",
    1,
    "a frame is coded about one before the rest pose",
    lambda: predicted(ROOTED, [RESTING, [0, 0, 2]]),
)

# ---- invalid: layers ---------------------------------------------------------------------------------------

header("layers-9", "BAD_HEADER", "Layer_Count 9", layer_count=9, level_count=10, full_level_count=10)
header("layers-not-those", "BAD_HEADER", "Layer_Count 4: a file of h = 0 has 5 levels, or 6 with EXACT", layer_count=4)
for count in (1, 4):
    invalid(
        f"layers-count-{count}",
        "BAD_HEADER",
        "open",
        f"Layer_Count {count}, Full_Level_Count is that of 3 layers",
        lambda count=count: layered().draft().with_header(layer_count=count),
    )
table(
    "layers-exact-taken",
    "BAD_CHUNK_TABLE",
    "Layer_Count 2 makes the last level the lossless one: EXACT is missing",
    lambda: layered().draft().with_header(layer_count=2),
)
table(
    "layers-no-stems",
    "BAD_CHUNK_TABLE",
    "a refinement lacks the STEMS of a segment",
    lambda: layered().draft().without(rules.STEMS, 3, 1),
)
table(
    "layers-affines",
    "BAD_CHUNK_TABLE",
    "AFFINES of a refinement",
    lambda: layered().draft().add(Entry(rules.AFFINES, b"", 3, 0)),
)
table(
    "layers-exact-early",
    "BAD_CHUNK_TABLE",
    "EXACT at the level of the last refinement",
    lambda: layered().draft().add(Entry(rules.EXACT, b"", 4, 0)),
)
table(
    "layers-corrections-low",
    "BAD_CHUNK_TABLE",
    "CORRECTIONS below level h + 1",
    lambda: layered().draft().add(Entry(rules.CORRECTIONS, struct.pack("<f", 1.0), 1, 0)),
)
table(
    "layers-corrections-exact",
    "BAD_CHUNK_TABLE",
    "CORRECTIONS of the lossless level behind three layers",
    lambda: lossless_layers().add(Entry(rules.CORRECTIONS, struct.pack("<f", 1.0), 5, 0)),
)
table(
    "layers-shapes-of-segment-1",
    "BAD_CHUNK_TABLE",
    "SHAPES of a refinement stands with segment 0",
    lambda: layered().draft().add(Entry(rules.SHAPES, b"\0", 3, 1)),
)
for level_, why in ((0, "level 0"), (2, "a level of the hierarchy above 1"), (5, "the lossless level")):
    table(
        f"refined-rest-{level_}",
        "BAD_CHUNK_TABLE",
        f"REFINED_REST of {why}",
        lambda level=level_: lossless_layers().add(Entry(rules.REFINED_REST, b"", level, 0)),
    )
table(
    "refined-rest-of-segment-1",
    "BAD_CHUNK_TABLE",
    "REFINED_REST stands with segment 0",
    lambda: layered(3, (rules.REFINED_REST, 3, 0)).draft().add(Entry(rules.REFINED_REST, b"", 3, 1)),
)
for name, why, plant in (
    ("with-stems", "level 0 has STEMS", rest_by_level([*FORK, Stem(-1, 2)], 44)),
    (
        "with-affines",
        "AFFINES of level 0 serve level 1",
        rest_by_level([Stem(-1, 2, 0, WHOLE), Stem(0, 2, 1), *[Stem(-1, 2), Stem(2, 2, 1)]], 45),
    ),
    ("of-one-layer", "Layer_Count is 1", Plant(FORK, scripts=LEVEL_1_REST)),
):
    table(
        f"refined-rest-1-{name}",
        "BAD_CHUNK_TABLE",
        f"REFINED_REST of level 1, though {why}",
        lambda plant=plant: plant.draft(),
    )


def refinement(name: str, kind: int, reason: str, content: bytes | Callable[[bytes], bytes], segment: int = 0) -> None:
    """Other content for a chunk of level 3; a function gets what it has."""

    def make() -> Draft:
        draft = layered().draft()
        made = content(draft.content(kind, 3, segment)) if callable(content) else content
        return draft.change(kind, 3, segment, content=made)

    invalid(f"refined-{KIND_NAMES[kind].lower().removeprefix('refined_')}-{name}", "BAD_CHUNK", 3, reason, make)


def scripted_refinement(name: str, place: tuple, reason: str, *script) -> None:
    """Another script for a stream of level 3, of which it is the last that is written."""
    invalid(name, "BAD_CHUNK", 3, reason, lambda: layered(2, scripts={place: list(script)}).draft())


refinement("ratio-0", rules.STEMS, "Ratio is 0", lambda content: bytes(2) + content[2:])
refinement("empty", rules.STEMS, "STEMS of a refinement without bytes", b"")
refinement("ratio-alone", rules.STEMS, "nothing behind Ratio", b"\4\0")
refinement("step-zero", rules.STEMS, "Step of a refinement is 0", lambda content: content[:2] + bytes(4) + content[6:])
refinement(
    "zero-behind", rules.STEMS, "a zero byte behind the stream of refined stems", lambda content: content + b"\0"
)
refinement(
    "bytes-behind", rules.STEMS, "bytes behind the stream of refined stems", lambda content: content + b"\1" * 12, 1
)
scripted_refinement("refined-stems-frequencies", (rules.STEMS, 3, 0), "a refined row codes three frequencies of two", 3)
refinement("empty", rules.SHAPES, "SHAPES of a refinement without bytes", b"")
refinement("shift-16", rules.SHAPES, "Shift is 16", lambda content: b"\x10" + content[1:])
refinement(
    "zero-behind", rules.SHAPES, "a zero byte behind the stream of refined shapes", lambda content: content + b"\0"
)
refinement(
    "bytes-behind", rules.SHAPES, "bytes behind the stream of refined shapes", lambda content: content + b"\1" * 12
)
scripted_refinement(
    "refined-shapes-too-many", (rules.SHAPES, 3, 0), "a piece of three modes has ten shapes in a refinement", 10
)
scripted_refinement(
    "refined-shapes-modes", (rules.SHAPES, 3, 0), "a refined shape has numbers for four modes of three", 1, 4
)
scripted_refinement(
    "refined-shapes-all-zero", (rules.SHAPES, 3, 0), "a shape that the layer before lacks is all 0", 3, 0, 0, 0
)
scripted_refinement(
    "refined-shapes-cancelled", (rules.SHAPES, 3, 0), "differences make a shape all 0", 2, 0, *[1, 0, 0, 4, 1]
)
refinement("short", rules.REFINED_REST, "3 bytes", bytes(3))
for what, value in (("zero", 0.0), ("negative", -1.0), ("nan", NAN), ("infinite", INFINITY)):
    refinement(
        f"step-{what}",
        rules.REFINED_REST,
        f"Rest_Step of a refinement is {value}",
        lambda content, value=value: refined_rest_chunk(content[4:], value),
    )
refinement(
    "zero-behind",
    rules.REFINED_REST,
    "a zero byte behind the stream of a refined rest pose",
    lambda content: content + b"\0",
)
refinement(
    "bytes-behind",
    rules.REFINED_REST,
    "bytes behind the stream of a refined rest pose",
    lambda content: content + b"\1" * 20,
)
invalid(
    "refined-rest-of-exact",
    "BAD_CHUNK",
    3,
    "REFINED_REST of a rest pose that is exact",
    lambda: (
        layered(3, (rules.REFINED_REST, 3, 0), (rules.REFINED_REST, 4, 0), rest=exact_rest(FORK, [0.5] * 15, False))
        .draft()
        .add(Entry(rules.REFINED_REST, refined_rest_chunk(b""), 3))
    ),
)
invalid(
    "refined-rest-modes",
    "BAD_CHUNK",
    2,
    "a refined run of two vertices has three modes",
    lambda: (
        Plant([Stem(-1, 3, lag=0)], rest=coded_rest([Stem(-1, 3, lag=0)], []), layers=2)
        .draft()
        .add(Entry(rules.REFINED_REST, refined_rest_chunk(refined_run(3)), 2))
    ),
)
invalid(
    "refined-rest-checksum",
    "BAD_CHECKSUM",
    3,
    "the Checksum of REFINED_REST is another",
    lambda: layered().draft().change(rules.REFINED_REST, 3, checksum=0),
)
invalid(
    "refined-rest-cut",
    "TRUNCATED",
    3,
    "the file ends inside REFINED_REST",
    lambda: cut(lambda draft: end_of(draft, rules.REFINED_REST, 3) - 1, layered().draft()),
)
for name, why, error, change in (
    ("exact", "of a rest pose that is exact", "BAD_CHUNK", None),
    ("step", "whose Rest_Step is 0", "BAD_CHUNK", lambda content: dict(content=bytes(4) + content[4:])),
    ("behind", "with a zero byte behind its stream", "BAD_CHUNK", lambda content: dict(content=content + b"\0")),
    ("checksum", "whose Checksum is another", "BAD_CHECKSUM", lambda content: dict(checksum=0)),
):
    invalid(
        f"refined-rest-1-{name}",
        error,
        1,
        f"REFINED_REST of level 1 {why}",
        lambda change=change: bad_rest_of_1(change),
    )


def bad_rest_of_1(change: Callable[[bytes], dict] | None) -> Draft:
    """Level 1 refines a rest pose that is exact, or by a chunk that is changed."""
    if change is None:
        exact = layered(
            3, (rules.REFINED_REST, 3, 0), (rules.REFINED_REST, 4, 0), rest=exact_rest(FORK, [0.5] * 15, False)
        )
        return exact.draft().add(Entry(rules.REFINED_REST, refined_rest_chunk(b""), 1))
    draft = layered(scripts=LEVEL_1_REST).draft()
    return draft.change(rules.REFINED_REST, 1, **change(draft.content(rules.REFINED_REST, 1)))


def refined_run(count: int) -> bytes:
    """The stream of a root of three vertices, the last two of which are a run with so many modes."""
    branches = branches_of([Stem(-1, 3, lag=0)])
    before = rules.Record(rest=[[0.0] * 3] * 3, steps=[[0] * 3] * 3)
    return write(rules.decode_rest, [0, 0, 0, count], branches, 0.0625, before)


# ---- the host's mesh ---------------------------------------------------------------------------------------

MESH = np.array(grown(FORK, 5), "<f4") / 4 + np.float32(0.1)
ORDER = [3, 0, 4, 1, 2]  # of the fork's vertices in the source


def hosted(mesh: np.ndarray = MESH, **fields) -> Plant:
    """The fork, whose rest pose is the host's mesh; its vertices stand in another order in the source."""
    return forked(**{"mesh": mesh, "vertex_source": ORDER} | fields)


valid("host-mesh", "the rest pose is the host's mesh, in source order", hosted, mesh=MESH)
valid(
    "host-mesh-far",
    "a mesh far from 0, less an origin",
    lambda: hosted(MESH * np.float32(1e5), origin=(2e5, -1e5, 0.1)),
    mesh=MESH * np.float32(1e5),
)
AWKWARD_MESH = np.array([*AWKWARD_FLOATS, 0.0, -0.0, 0.0, 1.0, -2.0, -0.5], "<f4").reshape(5, 3)
valid(
    "host-mesh-awkward",
    "-0.0, which counts as 0.0, subnormal and largest numbers in the host's mesh",
    lambda: hosted(AWKWARD_MESH),
    mesh=AWKWARD_MESH,
)
valid("host-mesh-wide", "binary64 positions about a mesh of binary32", lambda: hosted(is_float64=True), mesh=MESH)
NO_REFINED_REST = [(rules.REFINED_REST, 3, 0), (rules.REFINED_REST, 4, 0)]
valid(
    "host-mesh-layers",
    "three layers about the host's mesh, which none refines",
    lambda: layered(3, *NO_REFINED_REST, mesh=MESH, vertex_source=ORDER),
    mesh=MESH,
)
HOSTED_STEMS = [Stem(-1, 70), Stem(0, 9, 60, SHEET), Stem(1, 4, 8)]
HOSTED_MESH = np.array(grown(HOSTED_STEMS, 6), "<f4")
valid(
    "host-mesh-sheets",
    "sheets and long stems of the host's mesh",
    lambda: moving(HOSTED_STEMS, 71, frames=3, mesh=HOSTED_MESH, heads=HEADS),
    mesh=HOSTED_MESH,
)
invalid("host-mesh-none", "NEEDS_HOST_MESH", 0, "no mesh is given", hosted)
invalid("host-mesh-short", "WRONG_HOST_MESH", 0, "a mesh with one vertex less", hosted, MESH[:-1])
invalid(
    "host-mesh-long", "WRONG_HOST_MESH", 0, "a mesh with one vertex more", hosted, np.append(MESH, MESH[:1], axis=0)
)
invalid("host-mesh-in-file-order", "WRONG_HOST_MESH", 0, "the mesh in file order", hosted, MESH[ORDER])
for name, value in (("nan", NAN), ("infinite", -INFINITY)):
    INFINITE_MESH = np.append(MESH[:-1], [[0.0, np.float32(value), 0.0]], axis=0).astype("<f4")
    invalid(
        f"host-mesh-{name}",
        "WRONG_HOST_MESH",
        0,
        f"the file's own mesh has {value}",
        lambda mesh=INFINITE_MESH: hosted().draft().change(rules.REST, content=host_rest_chunk(mesh)),
        INFINITE_MESH,
    )
for at, which in ((17, "first"), (21, "second")):
    invalid(
        f"host-mesh-{which}-checksum",
        "WRONG_HOST_MESH",
        0,
        f"a mesh that differs by the {which} checksum alone",
        lambda at=at: hosted().draft().change(rules.REST, content=flipped(host_rest_chunk(MESH), at)),
        MESH,
    )
for name, why, bits in (("exact", "Is_Exact", {"exact": 1}), ("float64", "Rest_Is_Float64", {"rest_type": 1})):
    prelude(
        f"host-{name}", rules.REST, f"{why} beside Is_Host in Method", lambda bits=bits: host_rest_chunk(MESH, **bits)
    )
for name, why, change in (
    ("no-checksum", "Is_Host without checksums", lambda chunk: chunk[:17]),
    ("checksum-short", "Is_Host with 7 bytes of checksums", lambda chunk: chunk[:-1]),
    ("checksum-long", "Is_Host with a byte behind the checksums", lambda chunk: chunk + b"\0"),
):
    prelude(f"host-{name}", rules.REST, why, lambda change=change: change(host_rest_chunk(MESH)))
prelude(
    "step-of-host",
    rules.REST,
    "Rest_Step is 0 with Is_Host, where it has no meaning",
    lambda: host_rest_chunk(MESH, step=0.0),
)
invalid(
    "refined-rest-of-host",
    "BAD_CHUNK",
    3,
    "REFINED_REST of the host's mesh",
    lambda: (
        layered(3, *NO_REFINED_REST, mesh=MESH, vertex_source=ORDER)
        .draft()
        .add(Entry(rules.REFINED_REST, refined_rest_chunk(b""), 3))
    ),
    MESH,
)


# ---- invalid: static data ----------------------------------------------------------------------------------


def static(name: str, reason: str, make: Draft | Callable[[], Draft], error: str = "BAD_CHUNK") -> None:
    invalid(name, error, "static", reason, make)


for name, why, text in (
    ("empty-text", "no text", b""),
    ("array", "an array, not an object", b"[1]"),
    ("number", "a number", b"1"),
    ("cut", "an object that does not end", b'{"a": 1'),
    ("two", "two objects", b"{} {}"),
    ("zero-behind", "a zero byte behind it", b"{}\0"),
    ("comma", "a comma behind the last member", b'{"a": 1,}'),
    ("quotes", "single quotes", b"{'a': 1}"),
    ("comment", "a comment", b'{"a": 1 /* metre */}'),
    ("nan", "NaN is no number", b'{"a": NaN}'),
    ("infinity", "Infinity is no number", b'{"a": [1, -Infinity]}'),
    ("overflow", "a number that rounds to infinity", b'{"a": {"b": 1.8e308}}'),
    ("leading-zero", "a number with a zero before it", b'{"a": 01}'),
    ("plus", "a number with a plus sign", b'{"a": +1}'),
    ("point", "a number that ends in its point", b'{"a": 1.}'),
    ("hex", "a hexadecimal number", b'{"a": 0x1}'),
    ("twice", "two members of the same name", b'{"a": 1, "a": 1}'),
    ("twice-escaped", "two members of the same name, one escaped", b'{"a": 1, "\\u0061": 2}'),
    ("twice-inside", "two members of the same name, further inside", b'{"a": [{"b": {}, "b": {}}]}'),
    ("surrogate", "half of a surrogate pair", b'{"a": "\\ud83c"}'),
    ("surrogate-name", "a name that is half of a surrogate pair", b'{"\\udf33": 1}'),
    ("surrogates-reversed", "a surrogate pair in the wrong order", b'{"a": "\\udf33\\ud83c"}'),
    ("control", "a line break in a string", b'{"a": "b\nc"}'),
    ("escape", "an escape that JSON does not have", b'{"a": "\\x41"}'),
    ("latin-1", "not UTF-8", '{"a": "\u00e9"}'.encode("latin-1")),
    ("utf-16", "UTF-16", '{"a": 1}'.encode("utf-16-le")),
    ("surrogate-bytes", "a surrogate in UTF-8", b'{"a": "\xed\xa0\xbc"}'),
    ("overlong", "an overlong form in UTF-8", b'{"a": "\xc1\x81"}'),
    ("byte-order-mark", "a byte order mark", b"\xef\xbb\xbf{}"),
    ("white-space", "white space that JSON does not have", b"\x0b{}"),
):
    static(f"metadata-{name}", why, lambda text=text: metadata(text))
static("metadata-empty", "no bytes", lambda: with_static((rules.METADATA, b"")))
static("metadata-method-2", "Method 2", lambda: metadata("{}", 2))
static(
    "metadata-limit",
    "a text of 2^20 + 1 bytes in a small frame",
    lambda: metadata(
        frame(
            b"{" + b" " * ((1 << 20) - 1) + b"}",
            checksum=None,
            blocks=raw_block(b"{", False)
            + b"".join(run_block(b" ", n, False) for n in [1 << 17] * 7 + [(1 << 17) - 1])
            + raw_block(b"}", True),
        ),
        1,
    ),
    "LIMIT_EXCEEDED",
)
static(
    "metadata-zstd-size",
    "a frame that does not state its size",
    lambda: metadata(frame(b"{}", stated=None, single_segment=False, checksum=None), 1),
)
static("metadata-zstd-empty", "a frame of no bytes", lambda: metadata(plain(b""), 1))
static("metadata-zstd-none", "no zstd frame", lambda: metadata("{}", 1))
static("metadata-zstd-text", "a frame whose text is no object", lambda: metadata(plain(b"[]"), 1))
static("metadata-zstd-behind", "a byte behind the frame", lambda: metadata(plain(b"{}") + b"\0", 1))


def faces(content: bytes) -> Callable[[], Draft]:
    return lambda: with_static((rules.FACES, content))


def edges(content: bytes) -> Callable[[], Draft]:
    return lambda: with_static((rules.EDGES, content))


static("faces-empty", "FACES without bytes", faces(b""))
static("faces-short", "FACES of 8 bytes", faces(polygon_head("<i4", 0, 3)[:8]))
static("faces-mixed-short", "FACES of 9 bytes with Is_Mixed", faces(polygon_head("<i4", 0, 0, "<i4")[:9]))
static("faces-derived", "FACES cannot be derived", faces(derived("<i4")))
static("faces-reserved", "bit 7 of Index_Type is set", faces(polygon_head("<i4", 0, 3, flags=128)))
static("faces-big-endian-byte", "Index_Type is a big-endian byte", faces(polygon_head(">u1", 0, 3)))
static("faces-count-type", "Count_Type is a big-endian byte", faces(polygon_head("<i4", 0, 0, ">i1")))
static("faces-count-reserved", "Count_Type has bit 4 set", faces(bytes([16, 16]) + bytes(8)))
static("faces-beyond", "a face of a vertex behind the last", faces(polygons(np.array([[0, 1, 5]], "<u4"))))
static("faces-beyond-absolute", "the same by its number", faces(polygons(np.array([[0, 1, 5]], "<u4"), absolute=True)))
static("faces-negative", "a face of vertex -1", faces(polygons(np.array([[0, 1, -1]], "<i2"))))
static("faces-too-many", "2^32 - 1 faces", faces(polygon_head("<i4", 2**32 - 1, 3)), "LIMIT_EXCEEDED")
static("faces-too-wide", "2^26 + 1 columns of no rows", faces(polygon_head("<i4", 0, 2**26 + 1)), "LIMIT_EXCEEDED")
static("faces-too-large", "2^13 faces of 2^13 corners", faces(polygon_head("<i4", 2**13, 2**13)), "LIMIT_EXCEEDED")
static("faces-mixed-too-many", "a face and 2^26 corners", faces(polygon_head("<i4", 1, 2**26, "<i4")), "LIMIT_EXCEEDED")
static("faces-more-corners", "a face of more corners than are left", faces(mixed_polygons([[0, 1, 2]], corner_count=2)))
static("faces-fewer-corners", "corners of no face", faces(mixed_polygons([[0, 1, 2]], corner_count=4)))
static(
    "faces-count-beyond-type",
    "a face of 128 corners, of which |i1 holds 127",
    faces(mixed_polygons([[0, 1, 2, 3] * 32], types=("<u4", "|i1"))),
)
static(
    "faces-beyond-type",
    "a face of vertex 128, which |i1 does not hold",
    lambda: (
        moving([Stem(-1, 64), Stem(-1, 64), Stem(-1, 2)], 2, frames=1)
        .draft()
        .add(Entry(rules.FACES, polygons(np.array([[0, 127, 128]], "<i2"), 130).replace(b"\x05", b"\x04", 1)))
    ),
)
static("faces-zero-behind", "a zero byte behind the stream", faces(polygons(FACES_3) + b"\0"))
static("faces-bytes-behind", "bytes behind the stream", faces(polygons(FACES_3) + b"\1" * 12))
static("edges-three-columns", "edges of three columns", edges(polygons(np.zeros((1, 3), "<i4"))))
static("edges-mixed", "edges of different sizes", edges(mixed_polygons([[0, 1]])))
static("edges-beyond", "an edge to a vertex behind the last", edges(polygons(np.array([[0, 5]], ">u2"))))
static("edges-derived-mixed", "Is_Derived with Is_Mixed", edges(bytes([2 | 64 | 16])))
static("edges-derived-byte-order-of-a-byte", "derived edges of a big-endian byte", edges(bytes([8 | 64])))
static(
    "edges-derived-small",
    "130 vertices do not fit |i1",
    lambda: (
        moving([Stem(-1, 64), Stem(-1, 64), Stem(-1, 2)], 2, frames=1).draft().add(Entry(rules.EDGES, derived("|i1")))
    ),
)
static("edges-derived-with-data", "data behind derived edges", edges(derived("<i4") + bytes(8)))


def attribute(name: str, reason: str, content: bytes, error: str = "BAD_CHUNK") -> None:
    static(f"attribute-{name}", reason, lambda: attributes(content), error)


FOUR = plain(bytes(16))
attribute("short", "seven bytes", array_chunk("<f4", ())[:7])
attribute("shape-short", "a chunk that ends in its Shape", array_chunk("<f4", (4,), name="")[:-1])
attribute("name-short", "a chunk that ends in its Name", array_chunk("<f4", ())[:-1])
attribute("name-empty", "Name_Length 0", array_chunk("<f4", (4,), FOUR, ""))
attribute("name-latin-1", "a name that is not UTF-8", array_chunk("<f4", (4,), FOUR, "\u00e9".encode("latin-1")))
attribute("name-surrogate", "a surrogate in UTF-8", array_chunk("<f4", (4,), FOUR, b"\xed\xa0\xbc"))
attribute("name-limit", "a name of 4097 bytes", array_chunk("<f4", (4,), FOUR, "n" * 4097), "LIMIT_EXCEEDED")
static(
    "attribute-twice", "two attributes of the same name", lambda: attributes(element("|u1", b"1"), element("|u1", b"2"))
)
static(
    "attributes-257",
    "257 attributes",
    lambda: lone().draft().add(*(Entry(rules.ATTRIBUTE, element("|u1", b"a", str(i))) for i in range(257))),
    "LIMIT_EXCEEDED",
)
for name, why, type_ in (
    ("7", "kind 7", (7, 4)),
    ("reserved", "bit 4 is set", (16 | 3, 4)),
    ("size", "a size that floats do not have", (3, 16)),
    ("float-byte", "a float of one byte", (3, 1)),
    ("integer-size", "integers of 3 bytes", (2, 3)),
    ("unsigned-size", "unsigned integers of 16 bytes", (1, 16)),
    ("pair-size", "pairs of binary16", (4, 4)),
    ("boolean-size", "booleans of four bytes", (0, 4)),
    ("boolean-order", "a boolean with byte order", (8, 1)),
    ("byte-order", "a big-endian byte", (8 | 2, 1)),
    ("text-order", "texts with byte order", (8 | 5, 4)),
    ("raw-order", "raw bytes with byte order", (8 | 6, 4)),
    ("nothing", "elements of no bytes", (6, 0)),
    ("element-limit", "elements of 2^20 + 1 bytes", (6, (1 << 20) + 1)),
):
    attribute(f"type-{name}", f"Item_Type {type_[0]} with Item_Bytes {type_[1]}: {why}", array_chunk(type_, (4,), FOUR))
attribute("shape-33", "Dimension_Count 33", array_chunk("<f4", [1] * 33, plain(bytes(4))))
attribute("decoded-limit", "an array of 2^28 + 4 bytes", array_chunk("<f4", ((1 << 26) + 1,), FOUR), "LIMIT_EXCEEDED")
attribute(
    "decoded-limit-vast",
    "an array of some 2^1024 bytes",
    array_chunk("<f4", [(1 << 32) - 1] * 32, FOUR),
    "LIMIT_EXCEEDED",
)
attribute(
    "decoded-limit-of-none",
    "no elements, but 2^28 + 4 bytes with its size of 0 taken as 1",
    array_chunk("<f4", (0, (1 << 26) + 1)),
    "LIMIT_EXCEEDED",
)
attribute("data-of-none", "no elements, but data", array_chunk("<f4", (0,), plain(b"")))
attribute("no-data", "elements, but no data", array_chunk("<f4", (4,)))


def zstd_frame(name: str, reason: str, body: bytes, error: str = "BAD_CHUNK", size: int = 5) -> None:
    attribute(f"zstd-{name}", reason, array_chunk("|u1", (size,), body), error)


zstd_frame("none", "no zstd frame", b"plant")
zstd_frame("magic-alone", "a frame that ends behind its magic number", ZSTD_MAGIC)
zstd_frame("cut", "a frame that ends in its block", plain(b"plant")[:-1])
zstd_frame("shorter", "a frame of 4 bytes where 5 are", plain(b"plan"))
zstd_frame("longer", "a frame of 6 bytes where 5 are", plain(b"plants"))
zstd_frame(
    "size-not-stated",
    "a frame that does not state its size",
    frame(b"plant", stated=None, single_segment=False, checksum=None),
)
zstd_frame("size-lies-less", "a frame that states 5 bytes and holds 6", frame(b"plants", stated=5, checksum=None))
zstd_frame("size-lies-more", "a frame that states 5 bytes and holds 4", frame(b"plan", stated=5, checksum=None))
zstd_frame("size-memory", "a frame of 13 bytes that states some 2^62", bytes.fromhex("28b52ffde06c06060663636363"))
zstd_frame("byte-behind", "a byte behind the frame", plain(b"plant") + b"\0")
zstd_frame("two-frames", "two frames that make the array together", plain(b"pl") + plain(b"ant"))
zstd_frame("frame-behind", "an empty frame behind the frame", plain(b"plant") + plain(b""))
zstd_frame(
    "skippable-behind", "a skippable frame behind the frame", plain(b"plant") + bytes.fromhex("502a4d1800000000")
)
zstd_frame(
    "skippable-before", "a skippable frame before the frame", bytes.fromhex("502a4d1800000000") + plain(b"plant")
)
zstd_frame("skippable-alone", "a skippable frame of the right size", bytes.fromhex("502a4d1805000000") + b"plant")
zstd_frame("checksum", "a Content_Checksum that does not match", frame(b"plant", checksum=0))
zstd_frame("dictionary", "a frame that needs a dictionary", frame(b"plant", checksum=None, dictionary=7))
zstd_frame("reserved-bit", "the reserved bit of the frame header is set", frame(b"plant", checksum=None, reserved=1))
zstd_frame(
    "reserved-block",
    "a block of the reserved type",
    frame(b"plant", checksum=None, blocks=struct.pack("<I", 5 << 3 | 3 << 1 | 1)[:3] + b"plant"),
)
zstd_frame(
    "bomb", "a frame that states 5 bytes and holds a megabyte", frame(b"plant", checksum=None, blocks=zeros(1 << 20))
)
zstd_frame(
    "window",
    "a window of 9 MiB for 5 bytes",
    frame(b"plant", checksum=None, single_segment=False, window=13 << 3 | 1),
    "LIMIT_EXCEEDED",
)
zstd_frame(
    "window-largest",
    "the largest window there is",
    frame(b"plant", checksum=None, single_segment=False, window=255),
    "LIMIT_EXCEEDED",
)


# ---- valid: what only certain numbers tell -------------------------------------------------------------------


def placed(stems: list[Stem], points: Sequence, seed: int, frames: int = 3, **fields) -> Plant:
    """Random rows of stems that rest at any points, in binary64."""
    rest = exact_rest(stems, np.array(points, float).ravel().tolist(), True)
    return moving(stems, seed, frames, **{"rest": rest, "heads": HEADS} | fields)


def along_x(*places: float) -> list[list[float]]:
    return [[x, 0.5 * (i % 2), 0.0] for i, x in enumerate(places)]


def mode_and_more(share: float) -> list[list[float]]:
    """Two places along x as the first mode of a sheet of two vertices, but for a share of it."""
    mode = rules.cantilever((4, 4), 0.1, 0.001, 1.0)[0]
    across = np.array([-mode[1], mode[0]])
    return [[x, 0.0, 0.0] for x in mode + share * across]


valid(
    "gaps",
    "distances along stems of under 1/4 to over 16 of their mean, of which 1 to 64 quarters are told apart",
    lambda: placed(
        [Stem(-1, 24), Stem(0, 20, 3)],
        along_x(*range(12), *range(1011, 1023)) + along_x(3, *range(30, 40), 40.01, 40.02, 40.02, *range(241, 247)),
        131,
    ),
)
valid(
    "tube-gaps",
    "the same of the rings of a tube",
    lambda: placed(
        [Stem(-1, 40, flags=SHEET, ring=2)],
        [[1000.0 * (i > 17) + i, j, 0.1 * i * j] for i in range(20) for j in (0, 1)],
        132,
    ),
)
valid(
    "rigid-diagonal",
    "rigid branches whose inertia has no products: nothing to reduce, axes that are equally long",
    lambda: placed(
        [Stem(-1, 2), Stem(0, 3, 1, rigid=1), Stem(0, 3, 0, rigid=1), Stem(0, 2, 1, rigid=1)],
        [[0, 0, 0], [1, 0, 0], [5, 0, 0], [1, 8, 0], [1, 0, 2], [0, 0, 3], [0, 3, 0], [3, 0, 0], [1, 4, 0], [1, 5, 0]],
        133,
    ),
)
for side_, width_ in (("above", 203), ("below", 197)):
    valid(
        f"whitening-{side_}",
        f"a node that extends {side_} 1/100 as far in its second direction as in its first",
        lambda width_=width_: placed([Stem(-1, 2), Stem(0, 1, 1)], [[0, 0, 0], [10000, 0, 0], [10000, width_, 0]], 134),
    )
for side_, size_ in (("above", 1.015), ("below", 0.985)):
    valid(
        f"sheet-thin-{side_}",
        f"a sheet that is {side_} 1/100 as wide as long, once turned",
        lambda size_=size_: placed(
            [Stem(-1, 1), Stem(0, 4, 0, SHEET)],
            [[0, 0, 0], *([x, x + y * 0.01 * size_, 0] for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)))],
            135,
        ),
    )
    valid(
        f"sheet-mode-{side_}",
        f"a sheet whose places leave {side_} 1/100000 of a mode",
        lambda size_=size_: placed([Stem(-1, 1), Stem(0, 2, 0, SHEET)], [[0, 0, 0], *mode_and_more(1e-5 * size_)], 136),
    )
    valid(
        f"tube-function-{side_}",
        f"a tube whose rings leave {side_} 1/100000 of a function",
        lambda size_=size_: placed(
            [Stem(-1, 6, flags=SHEET, ring=2)],
            [
                [10.0 * i + y, s * (1 + 2e-5 * size_ * (i == 2) + 0 * y), s]
                for i in range(3)
                for s, y in ((-1, 0), (1, 0))
            ],
            137,
        ),
    )
    valid(
        f"tangent-short-{side_}",
        f"a stem of {side_} 1e-100, which has a direction or none",
        lambda size_=size_: placed(
            [Stem(-1, 2), Stem(0, 2, 1)], [[0, 0, 0], [0, 1e-100 * size_, 0], [0, 1, 1], [0, 2, 1]], 138
        ),
    )
    valid(
        f"sheet-short-{side_}",
        f"a sheet whose matrix to turn by has squares that add up to {side_} 1e-200",
        lambda size_=size_: placed(
            [Stem(-1, 2), Stem(0, 2, 0, SHEET), Stem(1, 2, 1)],
            [[0, 0, 0], [0, 1, 0], [0, 1e-50 * (size_**2 / 1.0203) ** 0.25, 0], [0, 0, 0], [0, 1, 1], [0, 2, 1]],
            139,
            is_float64=True,
            scripts={(rules.STEMS, 1): [*row(), *row((9, -5, 7), (3, 8, -6))]},
            heads={1: stems_head(0.125, 1)},
        ),
    )
    valid(
        f"predicted-short-{side_}",
        f"a step and a way at rest whose squares add up to {side_} 1e-60",
        lambda size_=size_: predicted(
            [Stem(-1, 3, flags=WHOLE)],
            swayed(6, 140, [Stem(-1, 3, flags=WHOLE)], follow=1.0, still=0.1),
            rest=exact_rest([Stem(-1, 3)], [x * 1e-30 * size_ for x in (0, 0, 0, 0, 0.3, 0.2, 0, 1, 0)], True),
            predicted=predicted_head(1e-33),
            is_float64=True,
        ),
    )


def tall(*counts: int) -> Draft:
    """Roots of so many vertices."""
    return without_mesh([Stem(-1, count, lag=1) for count in counts])


def deep() -> Draft:
    stems = chain(1300, 1, flags=0)
    for up in (1200, 1, 20, 98):
        parent = len(stems) - 1
        for _ in range(up):
            parent = stems[parent].parent
        stems.append(Stem(parent, 1))
    return without_mesh([replace(stem, flags=WHOLE if b == 0 else 0) for b, stem in enumerate(stems)])


def without_mesh(stems: list[Stem]) -> Draft:
    """A file of which only the hierarchy is decoded: the rest pose is the host's mesh, which is not there."""
    count = sum(stem.count for stem in stems)
    stream = write(rules.decode_hierarchy, hierarchy_script(stems), len(stems), count)
    plan = rules.make_parts(rules.decode_hierarchy(stream, len(stems), count)[0])
    levels, front = range(plan.height + 2), Plant([Stem(-1, 1)], mesh=np.zeros((1, 3), "<f4")).draft()
    return (
        replace(front, entries=front.entries[:3])
        .with_header(vertex_count=count, branch_count=len(stems), level_count=len(levels), full_level_count=len(levels))
        .change(rules.HIERARCHY, content=hierarchy_chunk(stream))
        .add(*(Entry(rules.STEMS, b"", level, 0) for level in levels if rules.has_stems(plan, level)))
        .add(*(Entry(rules.AFFINES, b"", level, 0) for level in levels if rules.has_affines(plan, level, level)))
    )


invalid(
    "host-mesh-tall",
    "NEEDS_HOST_MESH",
    0,
    "of a stem of 2^17 vertices among short ones only 2^16 count for how many others have",
    lambda: tall(1 << 17, *range(1, 17)),
)
invalid(
    "host-mesh-deep",
    "NEEDS_HOST_MESH",
    0,
    "a chain of 1300 branches, from whose end others go up by 1200 and then by 1 to 1000",
    deep,
)


# ---- exactly at limits and bounds ------------------------------------------------------------------------------


def not_refused(make: Callable[[], Draft]) -> bytes:
    """The file with streams that go on behind what is refused."""
    kept, rules.require = rules.require, lambda *_: None
    try:
        return make().file()
    finally:
        rules.require = kept


def front_alone(draft: Draft) -> bytes:
    data = draft.file()
    return data[: rules.u32(data, 16)]


"""Limits that are just kept: what else is wrong gives the error."""
radius = numbers(np.arange(5.0), name="radius")

def segments_of_tables() -> Draft:
    draft = lone().draft().upto(0)
    first, second, *others = draft.entries
    count = (1 << 20) - len(draft.entries)
    return replace(draft, entries=(second, first, *others)).with_header(frame_count=count, segment_count=count)

invalid("cut-behind-first-byte", "TRUNCATED", "open", "one byte, that of Magic", lambda: first_bytes(1))
invalid(
    "header-alone",
    "BAD_HEADER",
    "open",
    "24 bytes are a header: its Chunk_Count is 0",
    lambda: lone().draft().with_header(chunk_count=0).file()[:24],
)
header(
    "chunks-2-20", "BAD_HEADER", "Chunk_Count 2^20 is allowed, but Front_Length is too small", chunk_count=1 << 20
)
header("front-length-2-24", "TRUNCATED", "Front_Length 2^24 is allowed, but not there", front_length=1 << 24)
invalid(
    "front-alone-damaged",
    "BAD_CHECKSUM",
    "open",
    "a file that ends with its front, which is damaged",
    lambda: flipped(front_alone(lone().draft()), 30),
)
table(
    "one-chunk",
    "BAD_CHUNK_TABLE",
    "Chunk_Count 1 is allowed, but chunks are missing",
    lambda: replace(lone().draft(), entries=lone().draft().entries[:1]),
)
table(
    "longest-and-order",
    "BAD_CHUNK_TABLE",
    "as many segments and chunks as Max_Table_Bytes allows, of which the first two are the wrong way round",
    segments_of_tables,
)
table(
    "repeatable-order",
    "BAD_CHUNK_TABLE",
    "an attribute behind a chunk whose number is larger",
    lambda: not_refused(lambda: fork().add(Entry(0x8040, FUTURE), Entry(rules.ATTRIBUTE, radius), sort=False)),
)
invalid(
    "table-longest-chunk",
    "TRUNCATED",
    "strict",
    "a last chunk of 2^28 bytes is allowed, but has not arrived",
    lambda: fork().add(Entry(0x8040, FUTURE, length=1 << 28)),
)
invalid(
    "joins-0",
    "BAD_CHUNK_TABLE",
    "open",
    "a segment is joined over 0 frames",
    lambda: not_refused(lambda: joined(FORK, 500, 0, 0.5, 0, 0, 0, 0).draft()),
)




longest, many = 1 << 20, 1 << 25

def recent(_: bytes) -> None:
    """A triangle of vertex 0 and of the corner before that."""
    coder, model = rules.RangeDecoder(b""), rules.PolygonModel()
    decisions = [(model.guessed[1][0][0], 1), (model.guessed[1][1][2], 0), (model.is_recent[1], 1)]
    node = 1
    for bit in (0, 0, 0, 0, 1):
        decisions.append((model.recent[1][node], bit))
        node = node << 1 | bit
    decisions.append((model.guessed[1][2][15], 1))
    coder.script = Script(*(bit for _, bit in decisions))
    for context, _ in decisions:
        coder.bit(context)

valid(
    "metadata-longest",
    "a text of 2^20 bytes",
    lambda: metadata(
        frame(
            b"{" + b" " * (longest - 2) + b"}",
            checksum=None,
            blocks=raw_block(b"{", False)
            + b"".join(run_block(b" ", n, False) for n in [1 << 17] * 7 + [(1 << 17) - 2])
            + raw_block(b"}", True),
        ),
        1,
    ),
)
zstd_frame("descriptor-alone", "a frame that ends before its Window_Descriptor", ZSTD_MAGIC + b"\0")
zstd_frame(
    "header-alone",
    "a frame of a header alone, with the largest window and no size: the window comes first",
    ZSTD_MAGIC + b"\0\xff",
    "LIMIT_EXCEEDED",
)
valid(
    "faces-none-widest",
    "no faces of 2^26 corners each",
    lambda: with_static((rules.FACES, polygon_head("<u4", 0, 1 << 26))),
)
valid(
    "faces-of-most-corners",
    "faces of as many corners as Count_Type holds",
    lambda: with_static(
        (rules.FACES, mixed_polygons([[0, 1, 2], [i % 5 for i in range(127)]], types=("<u4", "|i1")))
    ),
)
static(
    "faces-more-corners-of-many",
    "the second of two faces has one corner more than are left, of 2^25: none is decoded",
    faces(
        polygon_head("<u4", 2, many, "<u4")
        + write(
            *(rules.decode_polygons, [42, *[0, 1, 2] * 14, many - 41]),
            *(polygon_shape(2, 2, False, 2, 0, many), 5),
            lowest=True,
        )
    ),
)
static(
    "faces-recent-before-first",
    "the second corner is the one before the first",
    lambda: with_static((rules.FACES, polygon_head("<u4", 1, 3) + write(recent, []))),
)
strips = {
    "up": [[i, i + 1, i + 2] for i in range(18)],
    "down": [[i, i - 1, i - 2] for i in range(19, 1, -1)] + [[1, 0, 2], [3, 4, 0]],
}
for name, strip in strips.items():
    for is_absolute in (False, True):
        valid(
            f"faces-{name}-and-on{'-absolute' if is_absolute else ''}",
            f"triangles {'up to the last vertex' if name == 'up' else 'down to vertex 0'}, beyond which the same "
            f"ways would lead{'; vertices by their numbers' if is_absolute else ''}",
            lambda strip=strip, is_absolute=is_absolute: (
                moving([Stem(-1, 20)], 501, frames=1)
                .draft()
                .add(Entry(rules.FACES, polygons(np.array(strip + [[7, 3, 9]], "<u2"), 20, is_absolute)))
            ),
        )




class Counts(Chance):
    """Rows of 20 to 40 frequencies, most of them of 30 and 31, and empty ones."""

    def answer(self, asked: str, most: int):
        if asked == "count":
            return min(most, int(self.random.choice([0, 20, 29, 30, 30, 31, 31, 32, 40])))
        return int(self.random.integers(-1, 2) * self.random.integers(0, 2))


IMPULSES = basis_stream([[128, 0], [0, 128]], 8)  # a learned basis of two frames: each alone


base, most = [Stem(-1, 3)], (1 << 30) - 1
valid(
    "predicted-on-vertex-0",
    "a stem on vertex 0, whose first vertex is no end",
    lambda: predicted([Stem(-1, 2, flags=WHOLE), Stem(0, 3, 0)], swayed(6, 510, [Stem(-1, 2), Stem(0, 3, 0)])),
)
valid(
    "rows-of-30",
    "rows of 30 and 31 frequencies, which are expected differently",
    lambda: Plant(
        [Stem(-1, 9)], frames=40, scripts={(rules.STEMS, k): lambda k=k: Counts(511 + k) for k in (0, 1)}
    ),
)
motion(
    "frequencies-1023",
    rules.STEMS,
    1,
    "a row codes 1023 frequencies of two: as long as a number of them can be",
    lambda: stems_head() + write(rules.decode_stems, [1023], forked_plan(), stems_motion(stems_head(), 2), 1),
)
valid(
    "basis-exponents",
    "the exponent of a row of a basis is -200, and 400 more in the next",
    lambda: Plant(
        base,
        frames=2,
        heads={0: stems_head(0.25, 0, 2, 2, basis_in_waves(2, -200, 400, *row((1, 1, 0), (2, -1, 0)), rank=2))},
        scripts={(rules.STEMS, 0): lambda: Chance(513)},
    ),
)
motion(
    "basis-length-one-more",
    rules.STEMS,
    1,
    "Basis_Length is one more than the chunk holds",
    lambda: struct.pack("<fBBHBI", 0.5, 0, 8, 2, 255, 1 + len(IMPULSES)) + IMPULSES,
)
motion(
    "basis-length-cut",
    rules.STEMS,
    1,
    "the chunk ends before the last byte of Basis_Length",
    lambda: stems_head(0.5, 0, 8, 1)[:12],
)
valid(
    "basis-of-level-0",
    "learned bases that begin with that of level 0",
    lambda: Plant(
        base,
        frames=3,
        heads={
            0: stems_head(0.25, 0, 8, 1, basis_stream([[99, -128, 3]], 8)),
            1: stems_head(0.25, 0, 9, 2, basis_stream([[256, 0, -77]], 9), base=0),
        },
        scripts={(rules.STEMS, 0): lambda: Chance(514), (rules.STEMS, 1): lambda: Chance(515)},
    ),
)
valid(
    "corrections-of-one-frame",
    "corrections in a segment of one frame, before which there is none",
    lambda: Plant(base, scripts={(rules.CORRECTIONS, 1, 0): [1, *(2, 3, 1, 0), 0, 1, *(1, 0, 5, 1)]}),
)
valid(
    "gaps-of-62-quarters",
    "a distance along a stem of 15 times the mean",
    lambda: placed([Stem(-1, 24)], [[x + 38.2 * (x > 9), 0, 0] for x in range(24)], 516, is_float64=True),
)
valid(
    "layers-shapes-of-many-modes",
    "eight shapes of a piece of 18 modes, the last of which have rows of their own",
    lambda: Plant(
        [Stem(-1, 18)],
        frames=3,
        layers=2,
        heads=LAYER_HEADS,
        scripts={
            (rules.SHAPES, 0, 0): [6, *(n for i in range(6) for n in row((i, 1, 0), (2, 0, -i)))],
            (rules.SHAPES, 1, 0): [2, *row((0, 0, 1)), *row((1, 0, 0), (0, 0, 0), (0, 3, 1))],
            (rules.SHAPES, 2, 0): [8, *(n for i in range(8) for n in refined_row((i % 3, -1, 0)))],
        }
        | {(rules.STEMS, level): lambda level=level: Chance(517 + level, large=6, empty=0.1) for level in range(3)},
    ),
)
valid(
    "layers-shapes-largest",
    "a shape with the largest integers there are, which a refinement of Shift 0 goes back from",
    lambda: Plant(
        base,
        frames=2,
        layers=2,
        shift=0,
        heads=LAYER_HEADS,
        scripts={
            (rules.SHAPES, 0, 0): [2, *row((most, 1, 0)), *row((0, -most, 3))],
            (rules.SHAPES, 2, 0): [2, *refined_row((-most, 0, 0)), *refined_row((0, -most, 0))],
        }
        | {(rules.STEMS, level): lambda level=level: Chance(521 + level, large=6, empty=0.0) for level in range(3)},
    ),
)
valid(
    "layers-halves",
    "what is predicted of one vertex is half the ratio, in another basis than before, and half a step in the same",
    lambda: Plant(
        [Stem(-1, 1)],
        frames=4,
        segments=2,
        layers=2,
        heads={
            0: stems_head(0.5, 0, 8, 2, IMPULSES),
            (2, 0): stems_head(0.25, 0, 8, 2, IMPULSES),
            (2, 1): stems_head(1.0, 0, 9, 2, base=0),
        },
        scripts={(rules.STEMS, 0): row((1, 0, -1), (-1, 2, 3)), (rules.STEMS, 2): row()},
    ),
)
valid(
    "layers-rigid-turned-300",
    "a branch that moves as it is turned by 100, 180, 250 and 300 degrees, one after the other",
    lambda: Plant(
        [Stem(-1, 4, rigid=1)],
        frames=5,
        layers=2,
        is_float64=True,
        rest=exact_rest([Stem(-1, 4)], [0.0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5], True),
        heads={
            0: stems_head(
                8.0, 4 << 4 | 1, 8, 5, basis_stream([[128 * (k == t) for t in range(5)] for k in range(5)], 8)
            ),
            2: stems_head(0.25, 1),
        },
        scripts={
            (rules.STEMS, 0): [*row(), *row(*((0, 0, n) for n in (0, 7, 16, 31, 60)))],
            (rules.STEMS, 2): [0, *refined_row((3, -5, 2))],
        },
    ),
)
valid(
    "layers-rigid-from-a-point",
    "rigid branches at one place in the first layer, where they have no rotation, and not in the next",
    lambda: Plant(
        [Stem(-1, 2), Stem(0, 3, 1, rigid=1), Stem(0, 3, 1, rigid=2)],
        frames=2,
        layers=2,
        points=[[0, 0, 0], *[[1, 2, 3]] * 7],
        heads=LAYER_HEADS,
        scripts={(rules.STEMS, level): lambda level=level: Chance(525 + level, large=6) for level in range(4)}
        | {(rules.REFINED_REST, 3, 0): lambda: Chance(529, large=4, empty=0.0)},
    ),
)
ratios = (63000, 0.36065), (67000, 0.34967), (0.45, 0.5)
valid(
    "layers-rigid-ratios-near",
    "steps of rotations are 63000 and 67000 times those of the next layer, and less than half of them",
    lambda: Plant(
        [Stem(-1, 3, rigid=2)],
        frames=6,
        segments=3,
        layers=2,
        is_float64=True,
        points=[[0, 0, 0], [3, 0, 0], [1, 4, 0]],
        heads={0: stems_head(0.125, 1)}
        | {
            (2, s): stems_head(0.125 / ratio, 1, 16, 1, basis_stream([[int(size * 32768)] * 2], 16))
            for s, (ratio, size) in enumerate(ratios)
        },
        scripts={(rules.STEMS, 0): [*row(), *row((1, -1, 1))]}
        | {(rules.STEMS, 2, s): [*row(), *refined_row((1, 0, 2))] for s in range(3)},
    ),
)




valid(
    "time-uneven-empty",
    "TIME of Method 2 without a stream: its bits are ones, and the only time is the least that there is",
    lambda: lone(time=b"\2"),
)
valid(
    "rest-connected-own-opposite",
    "a quadrangle whose corners one and three are the same vertex, behind those between them",
    lambda: meshed([Stem(-1, 5)], [[3, 0, 3, 1], [0, 1, 2], [2, 3, 4]], Chance(530, large=5)),
)
valid(
    "rest-copies-between",
    "the last turn of a shape is two and a half steps of the next copy, but for rounding",
    lambda: copy_of((36, 0, 0), (0, 0, 1, 0), (15, 0, 3, 0), *[(0, 0, 0, 0), (15, 0, 0, 0)] * 3),
)
points = [Stem(-1, 1, lag=2), Stem(-1, 1, lag=2), Stem(-1, 1, lag=2, detail=100), Stem(-1, 1, lag=2, detail=100)]
far = [10**9, 495 * 10**6, 515 * 10**6]  # units in x, in y and z pairs of them
valid(
    "rest-adaptive-far",
    "what is expected by the weights is 10^9 units, a little less, or more than is allowed",
    lambda: with_rest(points, adaptive_rest(points, [0, *far, 0, 0, 0, *(-n for n in far), 0, 0, 0], rest_type=1)),
)




def of_sizes(*powers: int) -> list[list[float]]:
    """A stem, and for each power of two three vertices by chance that are as far away from its first one; every second
    three are flat."""
    random = np.random.default_rng(531)
    triples = [
        math.ldexp(1.0, power - 10) * random.integers(-1024, 1025, (3, 3)) * [1, 1, i % 2]
        for i, power in enumerate(powers)
    ]
    return [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], *np.vstack(triples).tolist()]


def of_any_size(*powers: int) -> Plant:
    """Rigid branches of these sizes, all turned."""
    stems = [Stem(-1, 2), *(Stem(0, 3, 0, rigid=1) for _ in powers)]
    size = [1 << 28 if power > 0 else 1 for power in powers]
    turned = [row((n * (1 + i % 3), n * (2 - i % 4), n), (i % 2, 3 * n, -n)) for i, n in enumerate(size)]
    return Plant(
        stems,
        frames=2,
        is_float64=True,
        rest=exact_rest(stems, [x for point in of_sizes(*powers) for x in point], True),
        heads={level: stems_head(1e38, 3 << 4 | 4) for level in range(3)},
        scripts={(rules.STEMS, 1): [*row() * 4, *(value for each in turned for value in each)]},
    )


def shrunk(last: int) -> Plant:
    """A row that 18 known ones along it leave about 1e-100 of; `last`: an entry of the last of these, in 1/32768."""
    known = [[6426] * 26] * 17 + [[last] * 26]
    rows = [[entry / 32768 for entry in entries] for entries in known]
    in_waves = basis_in_waves(26, -200, *row((1, 0, 0)), rank=19, known=rows)
    return Plant(
        [Stem(-1, 3)],
        frames=26,
        heads={
            0: stems_head(0.25, 0, 16, 18, basis_stream(known, 16)),
            1: stems_head(0.25, 0, 2, 19, in_waves, base=0),
        },
        scripts={(rules.STEMS, 1): row(*[(0, 0, 0)] * 18, (50, -30, 10))},
    )


rounded = (263597123, 32053444), (241475353, 36228921), (79323412, 26324395), (170050111, 70213091)
valid(
    "rigid-tiny",
    "branches that move as they are, of 1e-78 to 1e-84 and of 1e-160: squares of their moments are 0",
    lambda: of_any_size(*[*range(-274, -265)] * 2, *[-268] * 12, -279, -276, -260, *[*range(-536, -531)] * 2),
)
valid(
    "rigid-huge",
    "rigid branches of 1e77 to 1e150: squares of their moments are infinite, and nothing is reduced",
    lambda: of_any_size(250, 257, 258, 259, 260, 300, 400, 500),
)
for side, last in (("above", 6448), ("below", 6405)):
    valid(
        f"basis-short-{side}",
        f"a row of a basis whose squares add up to {side} 1e-200, since the known rows are no unit vectors",
        lambda last=last: shrunk(last),
    )
valid(
    "basis-rounded",
    "rows of bases, of which an entry is within 2^-56 of the middle between two numbers of binary32",
    lambda: Plant(
        [Stem(-1, 2)],
        frames=8,
        segments=4,
        heads={
            (0, s): stems_head(0.25, 0, 2, 1, basis_in_waves(2, 0, *row((a, 0, 0), (b, 0, 0)), rank=1))
            for s, (a, b) in enumerate(rounded)
        },
        is_float64=True,
        scripts={(rules.STEMS, 0): [*row((1, 3, 0)), *row((0, 1, 7))]},
    ),
)




# ---- what no encoder writes, and decoders may take for granted ------------------------------------------------

valid(
    "faces-of-8-bytes",
    "vertices and numbers of corners in 8 bytes: behind their largest one is none of 64 bits",
    lambda: with_static(
        (rules.FACES, mixed_polygons([[0, 1, 2], [3, 2, 1, 0], [4]], types=("<u8", ">u8"))),
        (rules.EDGES, polygons(np.array([[0, 1], [4, 3]], ">u8"))),
    ),
)
valid(
    "faces-of-8-bytes-absolute",
    "the same by their numbers, and with signs; edges that the hierarchy implies",
    lambda: with_static(
        (rules.FACES, mixed_polygons([[0, 1, 2], [3, 2, 1, 0], [4]], types=(">u8", "<i8"), absolute=True)),
        (rules.EDGES, derived(">u8")),
    ),
)
static(
    "faces-of-8-bytes-beyond",
    "vertex 2^30 - 1 by its number, in 8 bytes",
    faces(polygons(np.array([[0, 1, (1 << 30) - 1]], "<u8"), absolute=True)),
)
static(
    "faces-of-8-bytes-negative",
    "vertex -1 in 8 bytes without a sign",
    faces(polygons(np.array([[0, 1, -1]], "<i8")).replace(b"\x07", b"\x03", 1)),
)
static(
    "faces-of-8-bytes-count",
    "a face of 2^30 - 1 corners, a number of 8 bytes",
    faces(
        polygon_head("<u8", 1, 3, ">u8")
        + write(rules.decode_polygons, [(1 << 30) - 1], polygon_shape(3, 11, False, 1, 0, 3), 5)
    ),
)
static("edges-of-8-bytes-beyond", "an edge to vertex 5 of 5", edges(polygons(np.array([[0, 5]], ">u8"))))


def with_source(draft: Draft, seed: int) -> Draft:
    """A last level that is up to 2^22 numbers away from the one before it."""
    file, level, chance = rules.open_file(draft.file()), draft.header["level_count"], Chance(seed, large=22)
    plans = rules.shown_plans(file, level - 1)

    def stream(s: int) -> bytes:
        positions = rules.decode_segment(file, plans, s, level - 1)
        differences = [chance.answer("signed", 0) for track in positions for x in track for _ in x]
        return write(rules.decode_exact, [(abs(n), n < 0) for n in differences], positions, file.header.is_float64)

    added = [Entry(rules.EXACT, stream(s), level, s) for s in range(draft.header["segment_count"])]
    joins_there = draft.joins and (*draft.joins, *joins(*(0,) * len(added)))
    return replace(draft, joins=joins_there).with_header(level_count=level + 1, full_level_count=level + 1).add(*added)


SOURCE_FRAMES = [  # with copies, of the frame before, of earlier ones and of the rest pose
    [0, 1, *frame_steps(ROOTED, 150)],
    [1, 1],
    [0, 0, 1, *frame_steps(ROOTED, 151)],
    [1, 0, 3],
    [0, 1, *frame_steps(ROOTED, 152)],
    [1, 0, 1],
]
for name_, more_ in (("", {}), ("-wide", {"is_float64": True, "origin": (3.0, -1e3, 0.1)})):
    valid(
        f"predicted-lossless-repeats{name_}",
        "the source's own numbers, which differ where predicted motion has copies, of frames that are shown for long; "
        "level 0 is joined",
        lambda more_=more_: with_source(
            replace(
                predicted(
                    ROOTED, SOURCE_FRAMES, 2, scripts={(rules.AFFINES, 0): lambda: Chance(153, large=4)}, **more_
                ),
                frames=20,
                repeats=(0, 1, 0, 0, 1, 1, 0, 0, 0, 1) + (0, 0, 0, 1, 0, 0, 1, 0, 1, 1),
                joins=joins(0, 2.5, 0, 0),
            ).draft(),
            154,
        ),
    )


def by_chance(count: int, seed: int, most: int = 4) -> list:
    """Script of so many vertices of an adaptive rest pose, whose first numbers are even."""
    random = np.random.default_rng(seed)
    return [n for x, y, z in random.integers(-most, most + 1, (count, 3)).tolist() for n in (2 * x, y, z)]


def along(*places: tuple[int, int, int]) -> list:
    """The same of these numbers, all of them even."""
    return [n for x, y, z in places for n in (x, y // 2, z // 2)]


def copied(rank: int, place: Sequence[int] = (0, 0, 0, 0), largest: int = 0, mirrored: int = 0, bent: int = 0) -> list:
    """Script of a copy of the shape of that rank: differences of its scale and of the smaller numbers of its turn."""
    return [1, rank, mirrored, bent, place[0], largest >> 1, largest & 1, *place[1:]]


def with_copies(stems: Sequence[int | Stem], *script: list, step: float = 0.3, still: bool = False) -> Plant:
    """A root of four vertices that is no shape, at one place or not, and branches of so many on it, or others."""
    branches = [stem if isinstance(stem, Stem) else Stem(0, stem, b % 4) for b, stem in enumerate(stems)]
    stems = [Stem(-1, 4), *branches]
    root = [0] * 12 if still else by_chance(4, 160)
    values = [1, 0, *root, *(value for values in script for value in values)]
    return with_rest(stems, adaptive_rest(stems, values, step, rest_type=1))


def broken_rest(make: Callable[[], Plant], goes_on: bool = True) -> Draft:
    """The file, whose rest pose is refused, and may go on behind that; all else is as in one that stands still."""
    kept, rules.require = rules.require, (lambda *_: None) if goes_on else rules.require
    try:
        plant = make()
    finally:
        rules.require = kept
    rest = adaptive_rest(plant.stems, [], 0.3, rest_type=1)
    return replace(plant, rest=rest).draft().change(rules.REST, content=plant.rest)


def copy_of(tip: tuple[int, int, int], *places: Sequence[int], largest: int = 0) -> Plant:
    """Copies of a shape of two vertices that are so far apart, in quarters of a unit."""
    copies = [value for place in places for value in (*copied(0, place, largest), 0, 0, 0)]
    return with_copies([2] * (1 + len(places)), [1, *along((0, 0, 0), tip)], copies, still=True)


def copies_turned() -> Plant:
    """Numbers are alike at first, so that they are expected again, and later near 0 again."""
    random = np.random.default_rng(226)
    script = [[1, *by_chance(4, 162, 40)], [0, 1, *by_chance(4, 163, 40)]]
    for i in range(36):
        place, bent = random.integers(-1, 2, 4) * (random.random(4) < 0.4), int(i % 8 > 4)
        place = np.array([12, -19, 16, 14]) if i < 4 else place - (i in (18, 19)) * np.array([12, -19, 16, 14])
        script += [
            copied(int(i > 0), place.tolist(), (0, 0, 0, 1, 1, 3, 2)[i % 7] if i > 7 else 0, int(i % 7 > 4), bent)
        ]
        script += [by_chance(4 if bent else 1, 164 + i)]
    return with_copies([4] * 38, *script)


def copies_of_many() -> Plant:
    """64 shapes of one vertex behind others, of which one has two vertices."""
    random, counts, script = np.random.default_rng(165), [1, 1, 2, *[1] * 64], []
    for b, count in enumerate(counts):
        script += [[*([0] if b not in (0, 2) else []), 1, *by_chance(count, 166 + b)]]
    for rank in (63, 63, 0, 1, 63, *random.integers(0, 64, 12).tolist(), 0, 0, 0, 0, 0, 5):
        script += [copied(rank), by_chance(1, 300 + rank)]
        counts.append(1)
    return with_copies([*counts, 2], *script, [1, *by_chance(2, 170)])


def copies_of_lengths() -> Plant:
    """Shapes, copies and branches that are neither: whether one is, is expected of others of its length up to 16."""
    counts, script = [15, 16, 17, 15, 17, 16, 16, 15, 17, 16, 15, 17], []
    shapes: list[int] = []
    for b, (count, what) in enumerate(zip(counts, (1, 1, 0, 2, 1, 2, 0, 0, 2, 1, 2, 0))):
        script += [[0] if what < 2 and count in shapes else []]
        script += [copied(0), by_chance(1, 180 + b)] if what == 2 else [[what, *by_chance(count, 180 + b)]]
        shapes += [count] if what == 1 else []
    return with_copies(counts, *script)


FAR, MOST = ((1 << 30) - 2,) * 3, (1 << 29) - 1
valid(
    "rest-copies-turned",
    "the last turn and scale of a shape, which its next copy is about, of two shapes in turn",
    copies_turned,
)
valid("rest-copies-of-many", "64 shapes are remembered, and the last of these is copied", copies_of_many)
valid(
    "rest-copies-of-lengths", "branches of 15, 16 and 17 vertices that are shapes, copies or neither", copies_of_lengths
)
valid(
    "rest-copies-of-roots",
    "a root that is a copy of a branch, a branch that is one of a root, and a root of a root",
    lambda: with_copies(
        [3, Stem(-1, 3), Stem(-1, 2), Stem(3, 2, 1), Stem(-1, 2), Stem(5, 3, 1)],
        *([1, *by_chance(3, 190, 9)], copied(0, (1, 1, 2, -1)), by_chance(1, 191)),
        *([1, *by_chance(2, 192, 9)], copied(0, (0, -1, 2, 0)), by_chance(1, 193)),
        *(copied(0, (1, 0, 0, 1), bent=1), by_chance(2, 194), copied(0), by_chance(1, 195)),
    ),
)
valid(
    "rest-copies-of-a-point",
    "a shape of one vertex, whose copies have whole numbers for their scale, up to 999, and for their turn",
    lambda: with_copies(
        [1] * 4,
        *([1, *by_chance(1, 196)], copied(0, (998, 1, 0, 0)), by_chance(1, 197)),
        *(copied(0, (0, 0, -1, 0), 3), by_chance(1, 198), copied(0, (2, 0, 0, 0), 2), by_chance(1, 199)),
    ),
)
valid("rest-copies-tiny", "a copy of just over 1/1000 of its shape", lambda: copy_of((8, 0, 68), (-19, 0, 0, 0)))
valid(
    "rest-copies-far",
    "numbers of a copy of 29 bits, and what is expected of many behind it",
    lambda: copy_of(FAR, (MOST, MOST, -MOST, 0), *[(0, 0, 1, 0), (1, -1, 0, 0)] * 25),
)
for name_, reason_, tip_, places_ in (
    ("scale-1000", "a scale of 1000", (0, 0, 0), [(999, 0, 0, 0)]),
    ("scale-tiny", "a scale of just under 1/1000", (4, 0, 90), [(-25, 0, 0, 0)]),
    ("number", "a number of 2^29", FAR, [(MOST, MOST + 1, 0, 0)]),
    ("number-negative", "a number of -2^29", FAR, [(MOST, -MOST - 1, 0, 0)]),
):
    invalid(
        f"rest-copies-{name_}",
        "BAD_CHUNK",
        "open",
        f"{reason_}, of a copy",
        lambda tip_=tip_, places_=places_: broken_rest(lambda: copy_of(tip_, *places_)),
    )
invalid(
    "rest-copies-rotation-little",
    "BAD_CHUNK",
    "open",
    "a quaternion of little more than 1",
    lambda: broken_rest(lambda: copy_of((10, 0, 0), (0, 2, 2, 0)), goes_on=False),
)
invalid(
    "rest-copies-of-the-65th",
    "BAD_CHUNK",
    "open",
    "a copy of the shape before the last 64",
    lambda: broken_rest(
        lambda: with_copies([1] * 66, [1, 0, 0, 0], *([0, 1, *by_chance(1, 400 + b)] for b in range(64)), copied(64)),
        goes_on=False,
    ),
)


def meshed(stems: list[Stem], faces: list[list[int]], script: list | Chance, **fields) -> Plant:
    """An adaptive rest pose by faces, of any sizes."""
    count, step = sum(stem.count for stem in stems), 0.3
    content = mixed_polygons(faces, count)
    shape, stream = rules.parse_polygons(content, rules.FACES)
    mesh = rules.build_mesh(*rules.decode_polygons(stream, shape, count), list(range(count)))
    coded = write(rules.decode_rest, script, branches_of(stems), step, None, True, mesh)
    bits = REST_ADAPTIVE | REST_CONNECTED
    return with_rest(stems, rest_chunk(coded, step=step, rest_type=1, reserved=bits >> 2), faces=content, **fields)


def hub(first: int, quads: int, edges: int) -> list[list[int]]:
    """Faces whose last vertex completes so many parallelograms at once, and has so many neighbours more."""
    chain = list(range(first, first + 2 * quads + edges))
    middle, across = len(chain) + first + 1, len(chain) + first
    faces = [[middle, chain[2 * i], across, chain[2 * i + 1]] for i in range(quads)]
    faces += [[middle, v] for v in chain[2 * quads :]]
    return faces + [[v, v + 1] for v in chain[:-1]] + ([] if quads else [[chain[-1], across]])


def hubs() -> list[list[int]]:
    first, faces = 0, []
    for quads, edges in (
        (1, 0),
        (2, 0),
        (2, 2),
        (3, 0),
        (3, 2),
        (4, 0),
        (5, 0),
        (6, 1),
        (7, 0),
        *((0, n) for n in range(1, 11)),
        (1, 7),
    ):
        for _ in range(2):
            faces += hub(first, quads, edges)
            first += 2 * quads + edges + 2
    return faces


def crowd(seed: int) -> list[list[int]]:
    """Triangles and quadrangles by chance that share many sides, and corners."""
    random = np.random.default_rng(seed)
    faces = [random.integers(0, 16, 3 + (i % 5 == 4)).tolist() for i in range(31)]
    return [*faces, [0, 1, 2], [2, 1, 3], [1, 2, 4], [2, 1, 5], [1, 2, 6], [14, 15, 16], [16, 15, 13]]


LEAVES = [  # on a stem: of four vertices that are shapes or copies, finer ones, and some that others reach into
    Stem(-1, 4),
    *(Stem(0, 4, i % 4, detail=(0, 0, 0, 0, 110, 110, 0, 1, 0, 0)[i]) for i in range(10)),
]


def leaves() -> list[list[int]]:
    """A triangle or quadrangle of each but for the last, whose first vertex is alone, and faces of several."""
    faces = [[v, v + 1, v + 2, v + 3] if v % 8 else [v, v + 1, v + 2] for v in range(4, 40, 4)]
    return [
        *faces,
        [41, 42, 43],
        [4, 6, 7],
        [15, 12, 20],
        [20, 15, 21],
        [24, 26, 27],
        [33, 37, 38],
        [0, 1],
        [39, 38, 41, 43],
    ]


HUBS = [Stem(-1, 1 + max(map(max, hubs())), lag=1)]
valid(
    "rest-connected-hubs",
    "vertices that complete up to seven parallelograms, or have up to ten neighbours, and no other way",
    lambda: meshed(HUBS, hubs(), Chance(210, large=5)),
)
valid(
    "rest-connected-leaves",
    "by faces shapes, copies, branches that others have begun, and steps of branches of their own",
    lambda: meshed(LEAVES, leaves(), Chance(236, large=3)),
)
valid(
    "rest-connected-crowd",
    "triangles and quadrangles of the same sides, and of the same vertex twice",
    lambda: meshed([Stem(-1, 17)], crowd(211), Chance(212, large=5)),
)


def cells(seed: int) -> list[list[float]]:
    """Places of vertices, each of them of two that are less or more than half a cell apart, or beyond all cells."""
    random, cell = np.random.default_rng(seed), 0.0625 / 256
    first = random.integers(-3000, 3000, (32, 3))
    first[29:] *= 10**6
    second = first + random.choice([-0.7, -0.4, 0.0, 0.0, 0.4], (32, 1)) * random.integers(0, 2, (32, 3))
    return (cell * np.vstack([first, second])[np.argsort(random.random(64))]).tolist()


PAIR, POINTS = [Stem(-1, 2, flags=WHOLE)], [Stem(-1, 1)] * 64
valid(
    "predicted-long",
    "more frames than means are of, and more than vertices are of any line",
    lambda: predicted(PAIR, swayed(200, 213, PAIR, large=5, still=0.1)),
)
valid(
    "predicted-cells",
    "vertices that follow others at the same places, unless the entry of their cell has been taken",
    lambda: predicted(
        POINTS,
        swayed(3, 310, POINTS, large=6, still=0.2),
        rest=exact_rest(POINTS, np.array(cells(223)).ravel().tolist(), True),
        is_float64=True,
    ),
)
LEAVING = [  # both ends of a stem, and those between them: a root that leaves binary32, and others that follow it
    *([0, 1, 1, 20, 0, 1, 1, move, 1, 0, 0, 0, 0] for move in (20, 1, 0, 0, -1, 0, 0)),
    *([0, 1, 1, 60, 3, 0, 1, 0, 1, move, 1] for move in (2, 0, 0, 1)),
    *([0, 0, distance, 0, 1, 0, move, 0, 1] for distance, move in ((8, 1), (0, 2))),
]
valid(
    "predicted-beyond",
    "a root that leaves binary32: what is expected to go with it stays, and so does what follows ends",
    lambda: predicted([Stem(-1, 4, flags=WHOLE)], LEAVING, predicted=predicted_head(1e36)),
)


def turns(seed: int) -> list:
    """Frames of two vertices that move far, about late and about early ones."""
    random = np.random.default_rng(seed)
    return [
        [0, 0, int(random.integers(0, min(t + 1, 6)) * (t % 3 == 2)), *frame_steps(PAIR, seed + t, large=9, still=0.2)]
        for t in range(24)
    ]


valid(
    "predicted-turns",
    "lines that begin anew in frames that are coded about earlier ones",
    lambda: predicted(PAIR, turns(330)),
)
valid(
    "predicted-about-copies",
    "frames that are coded about copies, about copies of copies, and about frames that were coded about these",
    lambda: predicted(
        ROOTED,
        [
            *swayed(2, 320, still=0.1),
            *([1, 1], *swayed(1, 322, still=0.1), [1, 1], [1, 1], *swayed(2, 323, still=0.1)),
            *([0, 0, 3, *frame_steps(ROOTED, 325, still=0.1)], [0, 0, 0, *frame_steps(ROOTED, 326, still=0.1)]),
            *([1, 0, 6], [0, 0, 0, *frame_steps(ROOTED, 327, still=0.1)], *swayed(2, 328, still=0.1)),
        ],
    ),
)
valid(
    "predicted-copied-rest",
    "a copy of the rest pose, rounded as it is shown, which others are coded about",
    lambda: predicted(
        ROOTED,
        [[1, 1], *swayed(2, 315, still=0.1), [1, 0, 3], *swayed(2, 317, still=0.1)],
        origin=(1e6, -3e5, 0.125),
        step=0.01,
    ),
)


class Turns(Chance):
    """Two frequencies of each row, as large as it takes to turn by up to 360 degrees and back."""

    def answer(self, asked: str, most: int):
        if asked == "count":
            return min(2, most)
        return int(self.random.integers(-130, 131)) if asked == "signed" else super().answer(asked, most)


STIFF = [  # in one, two or three layers, with others on them
    Stem(-1, 4, rigid=1),
    Stem(0, 3, 2, rigid=2),
    Stem(1, 2, 1, LOOSE, rigid=3),
    Stem(2, 3, 0, rigid=3),
    Stem(0, 3, 1, SHEET, rigid=1),
    Stem(4, 2, 0, rigid=2),
    Stem(-1, 3, rigid=2),
]


def stiff(seed: int, **fields) -> Plant:
    """STIFF in three layers, of which the first has rotations of any size."""
    plant = refinements(STIFF, seed, large=5, is_float64=True, **fields)
    plant.scripts |= {(rules.STEMS, level): lambda level=level: Turns(seed + level) for level in range(5)}
    return plant


valid(
    "layers-rigid-turned",
    "branches that move as they are, turned by up to 360 degrees, which the next layers go on from",
    lambda: stiff(
        217, frames=12, heads={level: stems_head(((8.0,) * 5 + (2.0, 0.5))[level], 3 << 4 | 1) for level in range(7)}
    ),
)
LAST_BASIS = 10, 2, basis_stream([[300, -200], [77, 511]], 10)
valid(
    "layers-rigid-ratios",
    "the step of a rotation is over 65535 times that of the next layer, and that less than the one of the last",
    lambda: stiff(
        218,
        frames=4,
        segments=2,
        heads={
            **{level: stems_head(64.0, 4) for level in range(5)},
            5: stems_head(1e-4, 1, *LAST_BASIS),
            6: stems_head(1e-4, 4),
        },
    ),
)


HALF_TURNS = (16, 0, 0), (0, 16, 0), (0, 0, 16), (16, 0, 1), (0, -16, 3)
valid(
    "layers-rigid-half-turns",
    "a branch that moves as it is, turned by 180 degrees about each of its axes: whose quaternions begin with 0",
    lambda: Plant(
        [Stem(-1, 4, rigid=1)],
        frames=5,
        segments=5,
        layers=2,
        is_float64=True,
        rest=exact_rest([Stem(-1, 4)], [0.0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 5], True),
        heads={0: stems_head(8.0, 4 << 4 | 1), 2: stems_head(0.25, 1)},
        scripts={(rules.STEMS, 0, s): [*row(), *row(turn)] for s, turn in enumerate(HALF_TURNS)}
        | {(rules.STEMS, 2, s): [0, *refined_row((3, -5, 2))] for s in range(5)},
    ),
)


LAGS = [Stem(-1, 12, lag=4), Stem(0, 17, 2, lag=5), Stem(0, 262, 4, SHEET, lag=256)]
valid(
    "rest-adaptive-lags",
    "lags of 4 and 5, of which one has filters by phase, and of 256, of which a phase has two vertices",
    lambda: with_rest(LAGS, adaptive_rest(LAGS, Chance(410, large=3, empty=0.0), rest_type=1)),
)
valid(
    "clips-long-segments",
    "512 frames in two segments, of which all but two are repeats",
    lambda: lone(clips=(Clip(512, 2, "long"),), repeats=(0, *(1,) * 255) * 2),
)


def errors_by_chance(count: int) -> tuple[int, ...]:
    """Large and small steps up and down, to both ends of the range."""
    random, last, errors = np.random.default_rng(411), [4000] * 3, []
    for _ in range(count):
        step = random.choice([1, 3, 30, 400, 5000], 3) * random.integers(-2, 3, 3)
        last = np.clip(np.array(last) + step, 0, rules.SHORT_FLOATS - 1).tolist()
        errors += last
    return tuple(errors)


valid(
    "errors-by-chance",
    "errors of thirty segments by chance, which are announced about those of the one before and of the level before",
    lambda: replace(predicted(SINGLE, [[1, 1]], 30).draft(), errors=errors_by_chance(60)),
)


valid(
    "waves-of-nodes-8",
    "all waves of maps of 8 frames; what the third one is computed from goes to and fro by the last bit, for 32 times",
    lambda: Plant(
        FORK,
        frames=8,
        is_float64=True,
        points=[[0, 0, 0], [1, 0, 2], [2, 0, 4], [1, 3, 2], [1, 5, 3]],
        scripts={(rules.AFFINES, 0): [0, *row(), *row(), *row(*[(k == 2, k == 5, 3 - k) for k in range(8)])]},
    ),
)


valid(
    "waves-of-stems-66",
    "the fourth wave of 66 frames, of which the same is true",
    lambda: Plant(
        SINGLE,
        frames=66,
        is_float64=True,
        points=[[0, 0, 0]],
        scripts={(rules.STEMS, 0): row((0, 0, 0), (0, 0, 0), (0, 0, 0), (1, -3, 7))},
    ),
)


# ---- valid: in binary64 --------------------------------------------------------------------------------------


def in_binary64(name: str) -> Plant:
    made = MADE[name]
    plant = made() if callable(made) else made
    assert isinstance(plant, Plant)
    return replace(plant, is_float64=True)


for name_ in (
    "sheet-mode-above",
    "sheet-thin-below",
    "shapes-high",
    "shapes-of-sheets",
    "tube-function-below",
    "layers-periodic",
    "source-rest-far",
    "source-rest-detail",
    "predicted-references",
    "predicted-about-copies",
):
    valid(
        f"{name_}-in-binary64",
        "the same in binary64, which shows the order of every sum and product",
        lambda name_=name_: in_binary64(name_),
    )

# ---- the very numbers that comparisons are about ---------------------------------------------------------------

ATTACHED_TO_0 = [
    Stem(-1, 3, lag=0),
    Stem(0, 32, 0, lag=0),
    Stem(1, 2, 0, lag=0),
    Stem(1, 31, 5, lag=0),
    Stem(-1, 1, lag=0),
]
RUNS_OF_COPIES = (3, 9, 8, 12, 7, 10, 6, 8, 9, 7, 11, 8, 0, 8, 1, 9)
LONE_STEMS = [Stem(-1, 3, rigid=1), Stem(-1, 3), Stem(-1, 3, flags=SHEET, rigid=1)]


def in_runs() -> Plant:
    """Each frame that is no copy is followed by so many copies."""
    frames = []
    for seed, copies in enumerate(RUNS_OF_COPIES):
        frames += [[0, 1, *frame_steps(SINGLE, 500 + seed)], *[[1, 1]] * copies]
    return predicted(SINGLE, frames)


def corrected_lone(stream: Callable[[bytes], bytes], **fields) -> Draft:
    """A vertex with other bytes in place of a stream of CORRECTIONS that corrects nothing."""
    draft = lone(scripts={(rules.CORRECTIONS, 1): [0]}, **fields).draft()
    content = draft.content(rules.CORRECTIONS, 1, 0)
    return draft.change(rules.CORRECTIONS, 1, 0, content=content[:4] + stream(content[4:]))


def of_memory(vertices: int) -> Draft:
    """128 frames, whose first fault behind the front is a checksum."""
    return lone().draft().with_header(vertex_count=vertices, frame_count=128).change(rules.HIERARCHY, checksum=0)


def derived_edges(*counts: int) -> Draft:
    return still([Stem(-1, count) for count in counts]).draft().add(Entry(rules.EDGES, derived("|i1")))


def of_range(max_error: int) -> Draft:
    """Counts after which the range is 2^38 + 56, whose first fault behind the front is a checksum."""
    clips = [clip_entry(25, 17, "0"), *(clip_entry(1, 1, str(i)) for i in range(1, 25))]
    return (
        lone()
        .draft()
        .add(Entry(rules.CLIPS, b"".join(clips), checksum=0))
        .with_header(
            vertex_count=13,
            branch_count=2,
            frame_count=49,
            segment_count=41,
            full_level_count=22,
            level_count=2,
            clip_count=25,
            layer_count=4,
            max_error=rules.from_bits(max_error, 64),
        )
    )


TURNING = [Stem(0, 100, 0, lag=0)] * 2 + [Stem(0, 3, 0, lag=0)] * 2 + [Stem(4, 2, 2, lag=0)]
STEERED = ((20000, 0), (10000, 0), (670, 0), (28, 0), (2, 0))
STEERED_TWICE = ((30000, 54000), (15000, 27000), (1004, 1808), (40, 72), (2, 4))


def hardly_apart(step: float, steered: Sequence[tuple[int, int]] = STEERED, x: int = 1, y: int = 0) -> Plant:
    """A second rest pose about one in which the beam that another one hangs on is shorter than anything that integers
    say: a copy that is bent for long, but for its place, has taught that to expect it there is worth next to nothing.
    """
    script = [
        *[1, 0, *[0] * 12],
        *[1, *[0] * 4],  # a shape whose vertices are at one place
        *[
            *copied(0, bent=1),
            0,
            0,
            0,
            *(n for place in steered for n in (place[0], place[1] // 2, 0)),
            *[0] * (3 * 94),
        ],
        *[1, 0],
        *[*copied(0, bent=1), 4 * x, 2 * y, 0, -2 * x, -y, 0, 0, 0, 0],
        *[0, *row((3, 1, 0), (0, 2, 5))],
    ]
    stems, step = [Stem(-1, 4), *TURNING], float(np.float32(step))
    rest, branches = adaptive_rest(stems, script, step, rest_type=1), branches_of(stems)
    reference = rules.decode_rest(rest[17:], branches, step, None, True).rest
    content = write(rules.decode_source_rest, Chance(507, large=6, empty=0.0), branches, step, reference)
    return still(stems, rest=rest, source_rest=source_rest_chunk(content, step), is_float64=True)


valid("predicted-long-runs", "runs of copied frames of up to 12, of which those from 7 on are alike", in_runs)
valid(
    "predicted-settings-16",
    "points of the lattice, with Memory 0 and Common 0",
    lambda: predicted(ROOTED, [[0, 1, *frame_points(ROOTED, 530 + t)] for t in range(8)], settings=16),
)
invalid(
    "predicted-step-infinite",
    "BAD_CHUNK",
    1,
    "Step is infinite",
    lambda: swaying().change(*PREDICTED_PLACE, content=predicted_head(INFINITY)),
)
valid(
    "predicted-short-exactly",
    "a step and a way at rest whose squares add up to 1e-60, which is no more than that",
    lambda: predicted(
        [Stem(-1, 3, flags=WHOLE)],
        swayed(6, 140, [Stem(-1, 3, flags=WHOLE)], follow=1.0, still=0.1),
        rest=exact_rest(
            [Stem(-1, 3)], [0, 0, 0, 0, 3e-31, 2e-31, 9.50870501981432e-31, 2.9299366694240276e-31, 0], True
        ),
        predicted=predicted_head(1e-31),
        is_float64=True,
    ),
)
valid(
    "tangent-short-exactly",
    "a stem whose squares add up to 1e-200, which has no direction",
    lambda: placed(
        [Stem(-1, 2), Stem(0, 2, 1)],
        [[0, 0, 0], [2.207934554570487e-101, 9.753205883335675e-101, 0], [0, 1, 1], [0, 2, 1]],
        138,
    ),
)
valid(
    "source-rest-attached-to-0",
    "beams that hang on vertex 0, and on the first vertex of such; runs of 31 and 32; a root of one vertex",
    lambda: attached_rest(503, 504),
)
for side, step in (("above", 1.238e-29), ("below", 1.2015e-29)):
    valid(
        f"source-rest-short-{side}",
        f"a beam of {side} 1e-100 in the reference pose, which has a direction or none",
        lambda step=step: hardly_apart(step),
    )
valid(
    "source-rest-short-exactly",
    "a beam whose squares add up to 1e-200, which has no direction",
    lambda: hardly_apart(3.713893830124435e-38, STEERED_TWICE, 121709354, 40038661),
)
valid(
    "source-rest-exact-no-bytes",
    "the very numbers of the source by a stream of no bytes, whose decisions are all 1",
    lambda: still(FORK, source_rest=source_rest_chunk(b"", method=1)),
)
valid(
    "shapes-of-rigid",
    "SHAPES of rigid stems, which have no modes: both levels have a number of shapes of each, 0",
    lambda: moving(
        LONE_STEMS,
        505,
        heads=HEADS,
        scripts=moving(LONE_STEMS, 505).scripts
        | {
            (rules.SHAPES, 0, 0): [0, 6, *(n for i in range(6) for n in row((1, i, 0), (0, 2, 5 - i))), 0],
            (rules.SHAPES, 1, 0): [0, 2, *row((0, 1, 0)), *row((0, 0, 1), (4, 0, 0)), 0],
        },
    ),
)
valid(
    "corrections-no-bytes",
    "a stream of no bytes, whose decisions are all 1: the largest corrections of all frames",
    lambda: corrected_lone(lambda stream: b"", frames=3),
)
valid(
    "corrections-negative-zero",
    "positions that are -0.0 stay so where nothing is corrected",
    lambda: Plant(
        [Stem(-1, 1), Stem(-1, 1)],
        frames=5,
        points=[[0.0, 0.0, 0.0]] * 2,
        default_head=stems_head(FLOAT_TINY),
        scripts={
            (rules.STEMS, 0): [*row((-1, -1, 1)), *row((-1, 1, -1))],
            (rules.CORRECTIONS, 1): [0, 1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 0, 0],
        },
    ),
)
valid(
    "stream-to-its-end",
    "a stream of all the bytes that are read, the last ones of which say nothing",
    lambda: corrected_lone(lambda stream: stream.ljust(7, b"\0") + b"\1"),
)
invalid(
    "stream-behind-its-end",
    "BAD_CHUNK",
    1,
    "a stream of one byte more than is read",
    lambda: corrected_lone(lambda stream: stream.ljust(8, b"\0") + b"\1"),
)
valid(
    "unknown-optional-numbers",
    "chunks whose Kind is written out behind the numbers 17 to 31, which all say that it is",
    lambda: fork().add(
        Entry(rules.METADATA, b"\0{}", number=31),
        Entry(0x8009, FUTURE, number=17),
        Entry(0x800F, b"", number=30),
        Entry(0x8018, FUTURE, 0, 1, number=24),
        Entry(0x801F, FUTURE, 1, 1, number=18),
        Entry(0x8022, FUTURE, number=31),
        Entry(0x8022, FUTURE, number=20),
    ),
)
invalid(
    "memory-exactly",
    "BAD_CHECKSUM",
    "open",
    "2^18 vertices of 128 frames take Max_Memory_Bytes: what is wrong is HIERARCHY",
    lambda: of_memory(1 << 18),
)
invalid(
    "memory-of-one-more",
    "LIMIT_EXCEEDED",
    "open",
    "2^18 + 1 vertices of 128 frames take more than Max_Memory_Bytes",
    lambda: of_memory((1 << 18) + 1),
)
invalid(
    "front-range",
    "BAD_CHECKSUM",
    "open",
    "amid Max_Error the range is just 2^32, twice, which is not less: what is wrong is CLIPS",
    lambda: of_range(7 << 57),
)
valid(
    "edges-derived-127",
    "derived edges of 128 vertices, the last of which is the largest number of |i1",
    lambda: derived_edges(*[2] * 64),
)
invalid(
    "edges-derived-128", "BAD_CHUNK", "static", "129 vertices do not fit |i1", lambda: derived_edges(*[2] * 63, 3)
)
valid(
    "rest-connected-most",
    "a rest pose by four faces and eight corners for each vertex",
    lambda: meshed(
        FORK,
        [[(i + k * (1 + i % 3)) % 5 for k in range(3 if i < 6 else 2 if i < 14 else 1)] for i in range(20)],
        Chance(506, large=5),
    ),
)
refinement("ratio-cut", rules.STEMS, "STEMS of a refinement of 1 byte", b"\4")


def attached_rest(seed: int, reference_seed: int) -> Plant:
    reference = coded_rest(ATTACHED_TO_0, Chance(reference_seed, large=9))
    return still(
        ATTACHED_TO_0, rest=reference, source_rest=bent(ATTACHED_TO_0, Chance(seed, large=6, empty=0.0), reference)
    )



# ---- valid: of real size -------------------------------------------------------------------------------------

for name_, what_ in (
    (
        "all",
        "clips, a loop, uneven times, repeats, layers, learned bases, tubes, a rest pose by faces, a second one, mixed "
        "faces, edges, attributes, every bit of the source",
    ),
    ("refined-rest", "the same with joins, loose branches and a rest pose that layers refine"),
    ("exact-rest", "the same about an exact rest pose, which excludes adaptive, connected and refined ones"),
    ("predicted", "the same in predicted motion, which excludes modes, shapes, bases, corrections, joins and layers"),
):
    valid(
        f"real-size-{name_}",
        f"what athcodec wrote of a tree with leaves: {what_}",
        lambda name_=name_: real_size.encoded(name_),
        scripted=False,
    )

# ---- making them -------------------------------------------------------------------------------------------


def results(data: bytes, mesh: bytes | None = None) -> dict[str, str]:
    """The reference decoder's result for every item of a file."""
    return {item: conformance.result(conformance.reference, data, item, mesh) for item in conformance.items(data)}


def line_of(vector: Vector, data: bytes) -> str:
    """The line in expected.txt. Raises ValueError if the reference decoder's result is not the vector's."""
    found = results(data, vector.mesh)
    wrong = {item: result for item, result in found.items() if result in conformance.ERRORS}
    if (vector.error and found.get(vector.item) != vector.error) or (not vector.error and wrong):
        raise ValueError(f"{vector.path}: got {found}; expected {vector.error or 'no error'} {vector.item}")
    first = next(iter(wrong), "")
    also_strict = first == "strict" and (vector.item == "open" or vector.error == "TRUNCATED")
    if vector.error and first != vector.item and not also_strict:
        raise ValueError(f"{vector.path}: got {found}; expected nothing wrong before {vector.item}")
    return conformance.format_line(vector.path, data, found, vector.reason)


def make(folder: Path = conformance.FOLDER) -> int:
    """Writes missing vectors; returns their number."""
    for name in ("valid", "invalid"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    listed = folder / "expected.txt"
    lines = listed.read_text("utf-8").splitlines() if listed.exists() else []
    existing = {line.split()[0] for line in lines if not line.startswith("#")}
    made = 0
    for vector in VECTORS:
        if vector.path in existing:
            continue
        data = vector.make()
        lines.append(line_of(vector, data))
        (folder / vector.path).write_bytes(data)
        if vector.mesh is not None:
            (folder / vector.path).with_suffix(".mesh").write_bytes(vector.mesh)
        made += 1
    if not lines or not lines[0].startswith("#"):
        lines = [f"# {text}" if text else "#" for text in conformance.LISTING.splitlines()] + lines
    listed.write_text("\n".join(lines) + "\n", "utf-8")
    return made


def main() -> int:
    argparse.ArgumentParser(prog="python -m spec.make_vectors", description="Makes missing vectors.").parse_args()
    print(f"{make()} vectors made, {len(VECTORS)} in all")
    return 0


if __name__ == "__main__":
    sys.exit(main())
